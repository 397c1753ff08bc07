"""Small healthy files of every kind that a door takes, to be mutated."""

import io
import json
from pathlib import Path

import cv2
import numpy as np
import pikepdf
import tifffile
from PIL import Image
from reportlab.pdfgen.canvas import Canvas

from tests.unit.lms.classroom import a_class, marked, results

ROOT = Path(__file__).parents[2]
SHAPE = (120, 170)


def seeds(door: str) -> list[bytes]:
    """Healthy files for a door, one of `tests.fuzz.doors.DOORS`."""
    return _SEEDS[door]()


def _pictures() -> list[bytes]:
    grey = np.full(SHAPE, 240, np.uint8)
    cv2.line(grey, (15, 20), (150, 70), 30, 2)
    colour = np.dstack([grey, grey // 2 + 90, grey])
    bits = Image.fromarray(grey > 128)
    files = [
        _saved(grey, "JPEG"),
        _saved(colour, "JPEG", progressive=True, exif=_turned()),
        _saved(grey, "PNG"),
    ]
    files += [_saved(np.dstack([colour, grey]), "PNG"), _saved(grey.astype(np.uint16) << 6, "PNG")]
    files += [_saved(bits, "PNG"), _saved(bits, "TIFF", compression="group4")]
    files += [
        _saved(Image.fromarray(colour).convert("CMYK"), "JPEG"),
        _saved(Image.fromarray(grey).convert("P"), "PNG"),
    ]
    files += [_tiff(grey, compression=kind) for kind in (None, "zlib", "lzw", "jpeg")]
    files += [
        _tiff(colour, planarconfig="separate"),
        _tiff(grey, tile=(64, 64)),
        _tiff(grey, compression="packbits"),
    ]
    files += [_pdf_of_scans(files[0], files[1]), _pdf_of_pixels(grey), _pdf_drawn()]
    files += [(ROOT / "tests/unit/scan/decode/turned.heic").read_bytes()]
    return files


def _saved(pixels: np.ndarray | Image.Image, kind: str, **options: object) -> bytes:
    image = pixels if isinstance(pixels, Image.Image) else Image.fromarray(pixels)
    buffer = io.BytesIO()
    image.save(buffer, kind, dpi=(100, 100), **options)
    return buffer.getvalue()


def _turned() -> Image.Exif:
    exif = Image.Exif()
    exif[274] = 6
    return exif


def _tiff(pixels: np.ndarray, **options: object) -> bytes:
    buffer = io.BytesIO()
    photometric = "rgb" if pixels.ndim == 3 else "minisblack"
    with tifffile.TiffWriter(buffer) as writer:
        for _ in range(2):
            layers = np.moveaxis(pixels, -1, 0) if options.get("planarconfig") == "separate" else pixels
            writer.write(layers, photometric=photometric, resolution=(100, 100), **options)
    return buffer.getvalue()


def _pdf_of_scans(*jpegs: bytes) -> bytes:
    pdf = pikepdf.new()
    for data in jpegs:
        space = pikepdf.Name.DeviceGray if data is jpegs[0] else pikepdf.Name.DeviceRGB
        _add_image(pdf, data, pikepdf.Name.DCTDecode, space)
    return _written(pdf)


def _pdf_of_pixels(grey: np.ndarray) -> bytes:
    pdf = pikepdf.new()
    _add_image(pdf, grey.tobytes(), None, pikepdf.Name.DeviceGray)
    return _written(pdf)


def _add_image(pdf: pikepdf.Pdf, data: bytes, packing: pikepdf.Name | None, space: pikepdf.Name) -> None:
    picture = pikepdf.Stream(
        pdf, data, Type=pikepdf.Name.XObject, Subtype=pikepdf.Name.Image, Width=SHAPE[1], Height=SHAPE[0],
        ColorSpace=space, BitsPerComponent=8,
    )  # fmt: skip
    if packing is not None:
        picture.Filter = packing
    page = pdf.add_blank_page(page_size=(425, 300))
    page.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Scan=picture))
    page.Contents = pdf.make_stream(b"q 425 0 0 300 0 0 cm /Scan Do Q")


def _written(pdf: pikepdf.Pdf) -> bytes:
    buffer = io.BytesIO()
    pdf.save(buffer, compress_streams=False)
    return buffer.getvalue()


def _pdf_drawn() -> bytes:
    buffer = io.BytesIO()
    canvas = Canvas(buffer, pagesize=(400, 300), pageCompression=0)
    for name in ("first", "second"):
        canvas.beginForm(name)
        canvas.line(10, 10, 200, 120)
        canvas.endForm()
        canvas.doForm(name)
        canvas.drawString(50, 50, "o a b")
        canvas.showPage()
    canvas.save()
    return buffer.getvalue()


def _measurements() -> list[bytes]:
    document = {
        "student_id": "s07", "n": 7, "scales": {"kL": "1:5", "kv": "0.185 (m/s)/mm"},
        "segments_mm": {"v_A": 60.0, "v_B": 41.5}, "directions_deg": {"v_A": 134.0}, "values": {"v_D": 1.23},
    }  # fmt: skip
    rows = (ROOT / "samples" / "pump" / "measurements.csv").read_bytes()
    comma = rows.replace(b",", b";").replace(b".", b",")
    return [json.dumps(document).encode(), rows, comma, rows.decode().encode("utf-16")]


def _roster() -> list[bytes]:
    return [
        (ROOT / "samples" / "pump" / "roster.csv").read_bytes(),
        "student_id;name;n;kL;kv;scans\ns1;Ана;3;1:5;0,185 (м/с)/мм;class.pdf#1\n".encode(),
    ]


def _authored() -> list[bytes]:
    return [path.read_bytes() for path in sorted((ROOT / "rubrics").rglob("*.toml"))]


def _decisions() -> list[bytes]:
    return [
        (
            b"student_id,position,criterion,verdict,points,comment,by,at,basis\r\n"
            b's1,,a_D,partial,1.5,"well, yes",S. Popa,2026-11-22T18:00:00+02:00,b1.2.3.4\r\n'
            b's1,2,node:velocity_plan:c,"61.250,140.500",,,,,\r\n'
            b',,page:class.pdf#3,"owner=s3; turn=90; corners=1,2 9,2 9,8 1,8",,,,,\r\n'
        ),
        "student_id;criterion;verdict;points;comment\ns1;total;;-1,5;поздно\ns1;comment;;;așa e\n".encode(),
    ]


def _variants() -> list[bytes]:
    return [
        b"n,AB,phi,n1\n1,40,30,60\n2,45,32,70\n",
        "n;position;AB\n1;1;40,5\n1;2;40,5\n".encode("utf-8-sig"),
    ]


def _settings() -> list[bytes]:
    paths = b'assignment = "pump"\nroster = "lists/roster.csv"\nout = "results"\nlog = "log.txt"\n'
    return [paths + b'language = "ro"\npages = 2\nplatform = "moodle"\n']


def _scales() -> list[bytes]:
    texts = (
        "1:5", "5 cm/cm", "0.036 (m/s)/mm", "0,036 (м/с)/мм", "kv = omega kL", "0.036 m/s·mm", "1 mm = 5 mm",
        "kL = 1:5 = 0.005 m/mm", "7.5 (m/s^2)/mm", "2·10^-3 м/мм",
    )  # fmt: skip
    return [text.encode() for text in texts]


def _worksheet() -> list[bytes]:
    head = (
        "Identifier,Full name,Email address,Status,Grade,Maximum grade,Grade can be changed,"
        "Last modified (submission),Last modified (grade),Feedback comments"
    )
    row = 'Participant 101,"Popa, Ana",ana@example.org,Submitted,7.50,10.00,Yes,-,-,"<p>a ""b""</p>"'
    return [f"{head}\r\n{row}\r\n".encode(), f"{head}\n{row}\n".replace(",", ";").encode("utf-8-sig")]


def _gradebook() -> list[bytes]:
    return [
        (
            b"Student,ID,SIS User ID,SIS Login ID,Section,Plan 1 (77),Final Score\r\n"
            b"    Points Possible,,,,,10.00,(read only)\r\n"
            b'"Popa, Ana",12,s1,ana,Group 3,7.5,75\r\n'
        ),
        (
            b"OrgDefinedId\tUsername\tLast Name\tFirst Name\tPlan 1 Points Grade <Numeric MaxPoints:10>\t"
            b"End-of-Line Indicator\n#s1\t#ana\tPopa\tAna\t7\t#\n"
        ),
        (
            '"Last Name"\t"First Name"\t"Username"\t"Student ID"\t"Plan 1 [Total Pts: 10 Score] |12"\r\n'
            '"Popa"\t"Ana"\t"ana"\t"s1"\t"7,5"\r\n'
        ).encode("utf-16"),
        (
            b'"update","usr_id","login","lastname","firstname","status","mark","notice","comment"\r\n'
            b'"0","12","ana","Popa","Ana","notgraded","","",""\r\n'
        ),
    ]


def _results() -> list[bytes]:
    return [a_class().model_dump_json().encode(), results(marked("s1", 5.0, 2.5)).model_dump_json().encode()]


_SEEDS = {
    "pictures": _pictures, "measurements": _measurements, "roster": _roster, "authored": _authored,
    "decisions": _decisions, "variants": _variants, "settings": _settings, "scales": _scales,
    "worksheet": _worksheet, "gradebook": _gradebook, "results": _results,
}  # fmt: skip
