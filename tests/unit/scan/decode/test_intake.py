"""Files of every kind in, pages out; what cannot be used is said."""

import io
import re
import struct
import sys
import zlib
from pathlib import Path

import cv2
import numpy as np
import pikepdf
import pypdfium2
import pytest
import tifffile
from PIL import Image

from grader.scan.decode.pages import count_pages, is_blank, pages_of
from grader.texts.spoken import in_english
from reference.errors import InputFileError
from tests.hostile import paper, stored
from tests.jbig2 import write_jbig2_pdf

SHAPE = (300, 420)
JPEG_ERROR_LEVELS = 3
MM_PER_INCH = 25.4


def only_page(path):
    (page,) = pages_of(path)
    return page


def jpeg_bytes(grey, **options):
    return stored(grey, "JPEG", quality=95, **options)


def refused(call):
    """The error with which a file is refused."""
    with pytest.raises(InputFileError) as caught:
        call()
    return caught.value


def pdf_of(path, *jpegs, matrix=(840, 0, 0, 600, 0, 0), box=(840, 600), rotate=0, extra=b""):
    """A PDF with one JPEG a page, placed by `matrix` (points)."""
    pdf = pikepdf.new()
    for data in jpegs:
        with Image.open(io.BytesIO(data)) as image:
            wide, high = image.size
            space = "/DeviceGray" if image.mode == "L" else "/DeviceRGB"
        stream = pikepdf.Stream(
            pdf,
            data,
            Type=pikepdf.Name.XObject,
            Subtype=pikepdf.Name.Image,
            Width=wide,
            Height=high,
            ColorSpace=pikepdf.Name(space),
            BitsPerComponent=8,
            Filter=pikepdf.Name.DCTDecode,
        )
        page = pdf.add_blank_page(page_size=box)
        page.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Scan=stream))
        placed = " ".join(str(number) for number in matrix)
        page.Contents = pdf.make_stream(f"q {placed} cm /Scan Do Q ".encode() + extra)
        page.Rotate = rotate
    pdf.save(path)


@pytest.mark.parametrize("suffix", ["png", "tif", "jpg"])
def test_grey_pixels_come_through_as_stored(tmp_path, suffix):
    path = tmp_path / f"scan.{suffix}"
    options = {"quality": 98} if suffix == "jpg" else {}
    Image.fromarray(paper()).save(path, dpi=(300, 300), **options)
    page = only_page(path)
    allowed = JPEG_ERROR_LEVELS * 3 if suffix == "jpg" else 0
    assert np.abs(page.grey.astype(int) - paper()).max() <= allowed
    assert page.dpi == pytest.approx((300, 300), rel=1e-3)
    assert (page.source, page.page, page.turn_deg) == (path.name, 1, 0)


HEIC = {name: Path(__file__).with_name(f"{name}.heic") for name in ("plain", "turned")}
"""`paper()` encoded by libheif: grey and seven columns less; turned both by its box and by its EXIF tag."""


def test_a_phones_heic_is_turned_once():
    pytest.importorskip("pi_heif")
    for name, drawn in (("plain", paper()[:, :-7]), ("turned", np.rot90(paper(), -1))):
        page = only_page(HEIC[name])
        assert page.grey.shape == drawn.shape
        assert np.abs(page.grey.astype(int) - drawn).mean() < JPEG_ERROR_LEVELS
        assert (page.dpi, page.turn_deg) == (None, 0)


def test_a_heic_that_is_cut_off_or_of_too_many_pixels_is_refused(tmp_path):
    pytest.importorskip("pi_heif")
    data = HEIC["plain"].read_bytes()
    for size in (100, len(data) - 200):
        (tmp_path / "cut.heic").write_bytes(data[:size])
        assert refused(lambda: only_page(tmp_path / "cut.heic")).code == "image_truncated"
    at = data.index(b"ispe") + 8
    (tmp_path / "bomb.heic").write_bytes(data[:at] + struct.pack(">II", 60_000, 60_000) + data[at + 8 :])
    assert refused(lambda: only_page(tmp_path / "bomb.heic")).code in {"image_too_large", "image_damaged"}


def test_without_its_decoder_a_heic_says_how_to_send_jpeg(monkeypatch):
    monkeypatch.setitem(sys.modules, "pi_heif", None)
    told = refused(lambda: only_page(HEIC["plain"]))
    assert told.code == "heic_unreadable"
    assert "Most Compatible" in in_english(told)


@pytest.mark.parametrize("compression", ["zlib", "lzw", "jpeg"])
def test_pages_of_a_tiff_come_one_by_one(tmp_path, compression):
    path = tmp_path / "class.tif"
    with tifffile.TiffWriter(path) as writer:
        for shade in (200, 100):
            writer.write(
                np.full(SHAPE, shade, np.uint8),
                compression=compression,
                resolution=(200 / 2.54, 200 / 2.54),
                resolutionunit=3,
            )
    pages = list(pages_of(path))
    assert [page.page for page in pages] == [1, 2]
    assert [int(np.median(page.grey)) for page in pages] == [200, 100]
    assert pages[0].dpi == pytest.approx((200, 200), rel=1e-3)
    assert count_pages(path) == 2


@pytest.mark.parametrize("fax", [True, False])
def test_paper_of_a_one_bit_page_is_white(tmp_path, fax):
    path = tmp_path / "copy.tif"
    bits = paper() >= 128
    if fax:
        Image.fromarray(bits).save(path, compression="group4")
    else:
        tifffile.imwrite(path, ~bits, photometric="miniswhite")
    assert np.array_equal(only_page(path).grey, bits * np.uint8(255))


@pytest.mark.parametrize("pen", [(30, 50, 160), (190, 30, 40), (90, 90, 95), (20, 120, 50)])
def test_strokes_of_every_pen_stay_dark(tmp_path, pen):
    picture = np.full((*SHAPE, 3), (250, 247, 240), dtype=np.uint8)
    picture[100:104, 50:300] = pen
    path = tmp_path / "colour.png"
    Image.fromarray(picture).save(path)
    grey = only_page(path).grey
    assert grey[102, 200] < 0.55 * grey[20, 20]


def test_transparent_paper_is_white(tmp_path):
    picture = np.zeros((*SHAPE, 4), dtype=np.uint8)
    picture[100:104, 50:300] = (0, 0, 0, 255)
    path = tmp_path / "clear.png"
    Image.fromarray(picture).save(path)
    grey = only_page(path).grey
    assert (grey[20, 20], grey[102, 200]) == (255, 0)


@pytest.mark.parametrize(("orientation", "turn_deg"), [(1, 0), (3, 180), (6, 270), (8, 90)])
def test_a_phones_orientation_is_told_and_its_pixels_left(tmp_path, orientation, turn_deg):
    exif = Image.Exif()
    exif[274] = orientation
    path = tmp_path / "phone.jpg"
    path.write_bytes(jpeg_bytes(paper(), exif=exif))
    page = only_page(path)
    assert page.turn_deg == turn_deg
    assert page.grey.shape == SHAPE


def test_a_scan_in_a_pdf_is_taken_out_with_its_resolution(tmp_path):
    path = tmp_path / "class.pdf"
    data = jpeg_bytes(paper())
    pdf_of(path, data, data)
    pages = list(pages_of(path))
    direct = tmp_path / "direct.jpg"
    direct.write_bytes(data)
    assert count_pages(path) == len(pages) == 2
    assert np.array_equal(pages[1].grey, only_page(direct).grey)
    assert pages[1].dpi == pytest.approx((420 / 840 * 72, 300 / 600 * 72))
    assert pages[1].paper_mm == pytest.approx((840 / 72 * MM_PER_INCH, 600 / 72 * MM_PER_INCH))


@pytest.mark.parametrize("rotate", [0, 90, 180, 270])
@pytest.mark.parametrize("turned_matrix", [False, True])
def test_what_a_viewer_shows_of_a_pdf_is_what_the_turn_says(tmp_path, rotate, turned_matrix):
    path = tmp_path / "turned.pdf"
    matrix, box = (
        ((0, 840, -600, 0, 600, 0), (600, 840)) if turned_matrix else ((840, 0, 0, 600, 0, 0), (840, 600))
    )
    pdf_of(path, jpeg_bytes(paper()), matrix=matrix, box=box, rotate=rotate)
    taken = only_page(path)
    shown = pdf_rendered(path)
    turned = np.rot90(taken.grey, taken.turn_deg // 90)
    turned = cv2.resize(turned, shown.shape[::-1], interpolation=cv2.INTER_AREA)
    assert np.abs(turned.astype(int) - shown).mean() < JPEG_ERROR_LEVELS


def pdf_rendered(path):
    with pypdfium2.PdfDocument(path) as document:
        image = document[0].render(scale=0.5, grayscale=True).to_numpy()
    return np.ascontiguousarray(image.reshape(image.shape[0], image.shape[1], -1)[..., 0])


def test_a_page_with_more_than_its_scan_is_rendered(tmp_path):
    path = tmp_path / "stamped.pdf"
    pdf_of(path, jpeg_bytes(paper()), extra=b"0 g 100 100 50 50 re f")
    page = only_page(path)
    assert page.dpi == pytest.approx((300, 300), rel=1e-3)
    assert page.grey[-int(125 / 72 * 300), int(125 / 72 * 300)] < 10


@pytest.mark.parametrize(
    ("name", "content", "code"),
    [
        ("empty.jpg", b"", "file_empty"),
        ("text.png", b"not a picture at all", "file_type_unsupported"),
        ("notes.docx", b"PK\x03\x04 and so on", "file_type_unsupported"),
        ("broken.pdf", b"%PDF-1.7\nnothing more", "pdf_damaged"),
        ("broken.tif", b"II*\x00\xff\xff\xff\x7f", "image_truncated"),
        ("broken.png", b"\x89PNG\r\n\x1a\n IEND", "image_truncated"),
        ("broken.jpg", b"\xff\xd8\xff\xe0 nothing", "image_truncated"),
    ],
)
def test_a_file_that_is_no_scan_is_refused_with_its_name_and_a_remedy(tmp_path, name, content, code):
    path = tmp_path / name
    path.write_bytes(content)
    error = refused(lambda: only_page(path))
    assert error.code == code
    told = in_english(error)
    assert told.startswith(f"{name}: The ")
    assert re.search("scan|export|hand it in|upload|use JPEG", told)


@pytest.mark.parametrize("share", [0.3, 0.6, 0.97])
@pytest.mark.parametrize("suffix", ["jpg", "png"])
def test_a_picture_that_is_cut_off_is_never_half_a_picture(tmp_path, suffix, share):
    noisy = np.random.default_rng(0).integers(0, 255, SHAPE, dtype=np.uint8)
    whole = tmp_path / f"whole.{suffix}"
    Image.fromarray(noisy).save(whole)
    data = whole.read_bytes()
    cut = tmp_path / f"cut.{suffix}"
    cut.write_bytes(data[: int(share * len(data))])
    assert refused(lambda: only_page(cut)).code == "image_truncated"


def test_a_missing_file_a_password_and_a_pdf_without_pages_are_told(tmp_path):
    assert refused(lambda: only_page(tmp_path / "nowhere.jpg")).code == "file_missing"
    secret, none = tmp_path / "secret.pdf", tmp_path / "none.pdf"
    pdf = pikepdf.new()
    pdf.save(none)
    pdf.add_blank_page()
    pdf.save(secret, encryption=pikepdf.Encryption(owner="owner", user="user"))
    assert refused(lambda: count_pages(secret)).code == "pdf_encrypted"
    error = refused(lambda: count_pages(none))
    assert error.code == "pdf_damaged"
    assert "no pages" in in_english(error)


MIRRORS = {
    2: Image.Transpose.FLIP_LEFT_RIGHT,
    4: Image.Transpose.FLIP_TOP_BOTTOM,
    5: Image.Transpose.TRANSPOSE,
    7: Image.Transpose.TRANSVERSE,
}


@pytest.mark.parametrize("orientation", sorted(MIRRORS))
@pytest.mark.parametrize("suffix", ["png", "tif"])
def test_a_mirrored_picture_is_given_as_it_was_drawn(tmp_path, orientation, suffix):
    path = tmp_path / f"selfie.{suffix}"
    mirrored = Image.fromarray(paper()).transpose(MIRRORS[orientation])
    if suffix == "png":
        exif = Image.Exif()
        exif[274] = orientation
        mirrored.save(path, exif=exif)
    else:
        mirrored.save(path, tiffinfo={274: orientation})
    page = only_page(path)
    assert np.array_equal(np.rot90(page.grey, page.turn_deg // 90), paper())


def test_a_resolution_in_centimetres_is_understood(tmp_path):
    path = tmp_path / "cm.jpg"
    data = bytearray(jpeg_bytes(paper(), dpi=(118, 118)))
    data[data.find(b"JFIF\0") + 7] = 2
    path.write_bytes(data)
    assert only_page(path).dpi == pytest.approx((118 * 2.54, 118 * 2.54), rel=1e-3)


def inked(grey, ink):
    """Four inks of a grey drawing: all of it in one of them, 0 for none."""
    planes = np.zeros((*grey.shape, 4), np.uint8)
    planes[..., ink] = 255 - grey
    return planes


@pytest.mark.parametrize("ink", [0, 1, 3])
def test_strokes_of_every_printing_ink_are_dark(tmp_path, ink):
    path = tmp_path / "inks.tif"
    tifffile.imwrite(path, inked(paper(), ink), photometric="separated")
    assert np.array_equal(only_page(path).grey, paper())


GREY = paper()
DEEP = GREY.astype(np.uint16) * 257
SHADES = np.repeat((np.arange(256)[::-1] * 257).astype(np.uint16)[None], 3, axis=0)
INKED = np.dstack([np.zeros_like(GREY)] * 3 + [255 - GREY])
TIFFS = {
    "planes": (np.stack([GREY] * 3), {"photometric": "rgb", "planarconfig": "separate"}),
    "sixteen bits": (DEEP, {}),
    "sixteen bits, great end first": (DEEP, {"byteorder": ">"}),
    "sixteen bits, white least": (~DEEP, {"photometric": "miniswhite"}),
    "sixteen bits in colour": (np.dstack([DEEP] * 3), {"photometric": "rgb"}),
    "twelve bits": (GREY.astype(np.uint16) << 4, {}),
    "real": (GREY.astype(np.float32) / 255, {}),
    "white least": (255 - GREY, {"photometric": "miniswhite"}),
    "palette": (255 - GREY, {"photometric": "palette", "colormap": SHADES}),
    "tiles": (GREY, {"tile": (64, 64)}),
    "tiles deflated": (GREY, {"tile": (64, 64), "compression": "zlib", "predictor": True}),
    "large offsets": (GREY, {"bigtiff": True}),
    "transparent": (INKED, {"photometric": "rgb", "extrasamples": ["unassalpha"]}),
}


@pytest.mark.parametrize("kind", TIFFS)
def test_pixels_of_unusual_depth_or_order_come_through(tmp_path, kind):
    pixels, options = TIFFS[kind]
    tifffile.imwrite(tmp_path / "odd.tif", pixels, **options)
    assert np.array_equal(only_page(tmp_path / "odd.tif").grey, GREY)


@pytest.mark.parametrize("tile", [None, (64, 64)])
@pytest.mark.parametrize("colour", [False, True])
def test_a_tiff_of_jpegs_is_read_and_its_damage_told(tmp_path, tile, colour):
    path, grey = tmp_path / "scan.tif", paper()
    pixels = np.dstack([grey] * 3) if colour else grey
    how = {"photometric": "rgb" if colour else "minisblack", "compression": "jpeg", "tile": tile}
    tifffile.imwrite(path, pixels, compressionargs={"level": 95}, **how)
    assert np.abs(only_page(path).grey.astype(int) - grey).mean() < JPEG_ERROR_LEVELS
    with tifffile.TiffFile(path) as file:
        start, size = file.pages[0].dataoffsets[0], file.pages[0].databytecounts[0]
    data = bytearray(path.read_bytes())
    del data[start + size // 2 : start + size - 2]
    data[start + size // 2 : start + size // 2] = bytes(size - 2 - size // 2)
    path.write_bytes(data)
    assert refused(lambda: only_page(path)).code in {"image_damaged", "image_truncated"}


def test_each_page_of_a_tiff_is_read(tmp_path):
    path, grey = tmp_path / "class.tif", paper()
    bits = grey < 128
    with tifffile.TiffWriter(path) as writer:
        writer.write(grey, resolution=(200, 200))
        writer.write(bits, photometric="miniswhite", resolution=(300, 300))
        writer.write(np.dstack([grey] * 3), photometric="rgb", compression="lzw")
    first, second, third = pages_of(path)
    assert np.array_equal(first.grey, grey)
    assert np.array_equal(second.grey, np.where(bits, 0, 255))
    assert np.array_equal(third.grey, grey)
    assert (first.dpi, second.dpi, third.dpi) == ((200, 200), (300, 300), None)


def raw_pdf(data, **entries):
    """A PDF of one page, its image's stream as given; and the page."""
    pdf = pikepdf.new()
    stream = pikepdf.Stream(pdf, data)
    stream.stream_dict = pikepdf.Dictionary(
        Type=pikepdf.Name.XObject,
        Subtype=pikepdf.Name.Image,
        Width=SHAPE[1],
        Height=SHAPE[0],
        Filter=pikepdf.Name.FlateDecode,
        **entries,
    )
    page = pdf.add_blank_page(page_size=(840, 600))
    page.Resources = pikepdf.Dictionary(XObject=pikepdf.Dictionary(Scan=pdf.make_indirect(stream)))
    page.Contents = pdf.make_stream(b"q 840 0 0 600 0 0 cm /Scan Do Q")
    return pdf, page


GREY8 = {"ColorSpace": pikepdf.Name.DeviceGray, "BitsPerComponent": 8}
GREY1 = {"ColorSpace": pikepdf.Name.DeviceGray, "BitsPerComponent": 1}


def test_deflated_pixels_of_a_pdf_are_taken_out_as_stored(tmp_path):
    path = tmp_path / "grey.pdf"
    raw_pdf(zlib.compress(paper().tobytes()), **GREY8)[0].save(path)
    assert np.array_equal(only_page(path).grey, paper())
    bits = paper() >= 128
    raw_pdf(zlib.compress(np.packbits(bits, axis=1).tobytes()), **GREY1)[0].save(path)
    assert np.array_equal(only_page(path).grey, bits * np.uint8(255))


@pytest.mark.parametrize("how", ["bomb", "cut", "damaged"])
def test_an_image_whose_data_are_not_whole_or_too_many_is_told(tmp_path, how):
    path, data = tmp_path / "image.pdf", bytearray(zlib.compress(paper().tobytes()))
    match how:
        case "bomb":
            data = zlib.compress(bytes(900 * paper().size))
        case "cut":
            del data[len(data) // 2 :]
        case _:
            data[len(data) // 2] ^= 0xFF
    raw_pdf(bytes(data), **GREY8)[0].save(path)
    assert refused(lambda: only_page(path)).code in {"image_damaged", "pdf_damaged"}


def test_a_jpeg_in_a_pdf_that_claims_too_many_pixels_is_not_decoded(tmp_path):
    data = bytearray(jpeg_bytes(paper()))
    size = data.find(b"\xff\xc0") + 5
    data[size : size + 4] = struct.pack(">HH", 60_000, 60_000)
    path = tmp_path / "claims.pdf"
    pdf, page = raw_pdf(bytes(data), **GREY8)
    page.Resources.XObject.Scan.Filter = pikepdf.Name.DCTDecode
    pdf.save(path)
    assert refused(lambda: only_page(path)).code == "image_too_large"


@pytest.mark.parametrize("share", [0.5, 0.97])
def test_a_pdf_that_is_cut_off_is_refused_rather_than_read_without_its_last_pages(tmp_path, share):
    path = tmp_path / "class.pdf"
    noisy = np.random.default_rng(0).integers(0, 255, SHAPE, dtype=np.uint8)
    pdf_of(path, *[jpeg_bytes(noisy)] * 6)
    data = path.read_bytes()
    path.write_bytes(data[: int(share * len(data))])
    error = refused(lambda: count_pages(path))
    assert error.code == "pdf_damaged"
    assert str(tmp_path) not in in_english(error)


def test_of_a_cropped_page_what_a_viewer_shows_is_taken(tmp_path):
    path = tmp_path / "cropped.pdf"
    pdf_of(path, jpeg_bytes(paper()))
    with pikepdf.open(path, allow_overwriting_input=True) as pdf:
        pdf.pages[0].CropBox = [0, 0, 420, 600]
        pdf.save(path)
    page = only_page(path)
    assert page.paper_mm == pytest.approx((420 / 72 * MM_PER_INCH, 600 / 72 * MM_PER_INCH))


A3_AT_100_DPI = (1169, 1654)


def duplex_back(rng, show_through):
    """The back of a drawing: grain, dust, a shadow at the rim, and the front shining through."""
    front = np.full(A3_AT_100_DPI, 0.0, dtype=np.float32)
    for _ in range(12):
        ends = rng.integers(100, 1000, 4)
        cv2.line(front, tuple(map(int, ends[:2])), tuple(map(int, ends[2:])), 1.0, 2)
    back = 248.0 * (1.0 - show_through * cv2.GaussianBlur(front[:, ::-1], (0, 0), 2.0))
    back += rng.normal(0, 2.0, back.shape)
    for x, y in rng.integers(60, 1000, (40, 2)):
        cv2.circle(back, (int(x), int(y)), 1, 60.0, -1)
    back[:4] = 120.0
    return np.clip(back, 0, 255).astype(np.uint8)


@pytest.mark.parametrize("show_through", [0.0, 0.1, 0.2])
def test_the_back_of_a_drawing_is_blank(tmp_path, show_through):
    path = tmp_path / "back.png"
    Image.fromarray(duplex_back(np.random.default_rng(3), show_through)).save(path)
    assert is_blank(only_page(path))


def test_a_faint_pencil_drawing_is_not_blank(tmp_path):
    grey = duplex_back(np.random.default_rng(4), 0.0)
    cv2.line(grey, (300, 300), (700, 500), 165, 2, cv2.LINE_AA)
    cv2.line(grey, (300, 300), (600, 700), 165, 2, cv2.LINE_AA)
    path = tmp_path / "faint.png"
    Image.fromarray(grey).save(path)
    assert not is_blank(only_page(path))


def packed_in_a_pdf(path, data, name, **entries):
    """A PDF of one page, its image's data packed as given, with colours from the data or as given."""
    pdf, page = raw_pdf(data, **entries)
    page.Resources.XObject.Scan.Filter = pikepdf.Name(f"/{name}")
    pdf.save(path)
    return path


def test_a_scan_packed_by_jpeg_2000_is_taken_out_as_stored(tmp_path):
    data = stored(paper(), "JPEG2000", irreversible=False)
    path = packed_in_a_pdf(tmp_path / "scan.pdf", data, "JPXDecode")
    assert np.array_equal(only_page(path).grey, paper())


def test_a_jpeg_2000_of_more_pixels_than_its_page_says_is_as_large_as_the_page_says(tmp_path):
    data = stored(np.kron(paper(), np.ones((2, 2), np.uint8)), "JPEG2000")
    path = packed_in_a_pdf(tmp_path / "scan.pdf", data, "JPXDecode")
    assert only_page(path).grey.shape == SHAPE


@pytest.mark.parametrize("annotations", [[42], [pikepdf.Dictionary(Subtype=pikepdf.Name.Link)]])
def test_annotations_that_draw_nothing_do_not_matter(tmp_path, annotations):
    path = tmp_path / "noted.pdf"
    pdf, page = raw_pdf(zlib.compress(paper().tobytes()), **GREY8)
    page.Annots = pdf.make_indirect(annotations)
    pdf.save(path)
    assert not is_blank(only_page(path))


def test_a_pdf_of_a_jbig2_page_is_the_page(tmp_path):
    one_bit = np.where(paper(1240, 1754) < 128, 0, 255).astype(np.uint8)
    write_jbig2_pdf(tmp_path / "copy.pdf", one_bit, 300.0)
    page = only_page(tmp_path / "copy.pdf")
    assert page.dpi == pytest.approx((300.0, 300.0), rel=1e-3)
    dark = page.grey[:1240, :1754] < 128
    # Rendering may move it by a fraction of a pixel.
    near = cv2.dilate((one_bit == 0).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    core = cv2.erode((one_bit == 0).astype(np.uint8), np.ones((3, 3), np.uint8)) > 0
    assert dark[core].all()
    assert not dark[~near].any()
