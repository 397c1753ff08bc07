"""Files that are made to harm: each function gives the bytes of one, and says what is wrong with it."""

import io
import os
import struct
import zlib

import cv2
import numpy as np
import pikepdf
import tifffile
from PIL import Image

NAME, DICTIONARY = pikepdf.Name, pikepdf.Dictionary
A4_PT = (842, 595)


def paper(high=300, wide=420):
    """White paper with dark lines, not symmetric in any way, (high, wide) uint8."""
    grey = np.full((high, wide), 250, dtype=np.uint8)
    cv2.line(grey, (20, 30), (wide - 60, 90), 20, 3)
    cv2.line(grey, (50, 40), (80, high - 20), 60, 3)
    return grey


def stored(image, kind="PNG", **options):
    """An array as a file of some kind, by Pillow."""
    buffer = io.BytesIO()
    Image.fromarray(image).save(buffer, kind, **options)
    return buffer.getvalue()


# What is no file ----------------------------------------------------------------------------------


def link_to_itself(path):
    """A link that leads to itself."""
    path.symlink_to(path.name)


def link_to_nothing(path):
    """A link to a file that is not there."""
    path.symlink_to("not-there.jpg")


def link_out(path):
    """A link to a file that everybody may read, outside the folder."""
    path.symlink_to("/etc/passwd")


def pipe(path):
    """A pipe into which nobody writes."""
    os.mkfifo(path)


# Pictures of a size that no drawing has -----------------------------------------------------------


def thin_picture():
    """PNG of 3000 x 4 pixels: away from its rim nothing is left."""
    return stored(np.full((4, 3000), 255, np.uint8))


def tiny_picture():
    """PNG of 8 x 8 pixels: smaller than any window that looks for paper."""
    return stored(np.full((8, 8), 255, np.uint8))


# PNG ----------------------------------------------------------------------------------------------


def png_of(wide, high, *, bits=8, colour=0, data=b"\0", level=9, extra=()):
    """PNG by its header, its packed data and further chunks (name, content)."""
    header = (b"IHDR", struct.pack(">IIBBBBB", wide, high, bits, colour, 0, 0, 0))
    chunks = (header, *extra, (b"IDAT", zlib.compress(data, level)), (b"IEND", b""))
    return b"\x89PNG\r\n\x1a\n" + b"".join(
        struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))
        for name, content in chunks
    )


def png_of_many_pixels():
    """PNG of 70 bytes that declares 1600 million pixels."""
    return png_of(40_000, 40_000, bits=1)


def png_of_deep_pixels():
    """PNG that declares 170 million pixels of 16 bits in four channels, 1.4 GB, and stores almost none."""
    return png_of(17_000, 10_000, bits=16, colour=6, data=bytes(1_000_000))


def png_of_long_profile():
    """PNG of a small picture whose colour profile unpacks to 200 MB."""
    packer = zlib.compressobj(9)
    profile = b"".join(packer.compress(bytes(10_000_000)) for _ in range(20)) + packer.flush()
    rows = b"".join(b"\0" + row.tobytes() for row in paper())
    return png_of(420, 300, data=rows, extra=((b"iCCP", b"x\0\0" + profile),))


# JPEG ---------------------------------------------------------------------------------------------


def jpeg_of_many_scans(scans=2000, side=8000):
    """Progressive JPEG whose one scan is repeated: each costs a pass over all blocks."""
    data = stored(np.full((side, side), 255, np.uint8), "JPEG", progressive=True)
    last = data.rindex(b"\xff\xda")
    # From the tables of the last scan on: they belong to it.
    tables = data.rindex(b"\xff\xc4", 0, last)
    return data[:-2] + data[tables:-2] * scans + data[-2:]


# TIFF ---------------------------------------------------------------------------------------------


def tiff_of(tags, data):
    """TIFF of one page by its tags (number, type, value); strips and tiles at ``DATA`` point to `data`."""
    size = 8 + 2 + 12 * len(tags) + 4
    entries = b"".join(
        struct.pack("<HHI", tag, kind, 1)
        + (struct.pack("<HH", value, 0) if kind == 3 else struct.pack("<I", value))
        for tag, kind, value in ((tag, kind, size if value == "DATA" else value) for tag, kind, value in tags)
    )
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + entries + struct.pack("<I", 0) + data


def tiff_of_many_samples():
    """TIFF of 198 bytes that asks for 26 GB: few pixels of many samples."""
    tags = [
        (256, 4, 10_000), (257, 4, 10_000), (258, 3, 64), (259, 3, 8), (262, 3, 1), (273, 4, "DATA"),
        (277, 3, 33), (278, 4, 10_000), (279, 4, 40), (284, 3, 1), (339, 3, 3),
    ]  # fmt: skip
    return tiff_of(tags, zlib.compress(bytes(10)).ljust(40, b"\0"))


def tiff_of_many_tiles():
    """TIFF of a page in 40 million tiles of one pixel."""
    tags = [
        (256, 4, 8_000), (257, 4, 5_000), (258, 3, 8), (259, 3, 8), (262, 3, 1), (277, 3, 1),
        (322, 4, 1), (323, 4, 1), (324, 4, "DATA"), (325, 4, 12),
    ]  # fmt: skip
    return tiff_of(tags, bytes(12))


def tiff_whose_pages_go_in_a_circle():
    """TIFF of one page that is followed by itself."""
    data = bytearray(stored(paper(), "TIFF"))
    (first,) = struct.unpack_from("<I", data, 4)
    (tags,) = struct.unpack_from("<H", data, first)
    struct.pack_into("<I", data, first + 2 + 12 * tags, first)
    return bytes(data)


def fax(*, damaged=True, compression="group4"):
    """TIFF of one strip of fax rows; where damaged, a byte in their middle is another."""
    bits = paper(600, 840) >= 128
    data = bytearray(stored(bits, "TIFF", compression=compression, tiffinfo={278: 600}))
    if damaged:
        with tifffile.TiffFile(io.BytesIO(bytes(data))) as file:
            page = file.pages[0]
            data[page.dataoffsets[0] + page.databytecounts[0] // 2] ^= 0xA5
    return bytes(data)


# PDF ----------------------------------------------------------------------------------------------


def pdf_bytes(pdf, **options):
    """A document as saved."""
    buffer = io.BytesIO()
    pdf.save(buffer, **options)
    return buffer.getvalue()


def form(pdf, content, **entries):
    """A form of the page's size with some content."""
    stream = pdf.make_stream(content)
    stream.Type, stream.Subtype, stream.BBox = NAME.XObject, NAME.Form, [0, 0, *A4_PT]
    for name, value in entries.items():
        stream[f"/{name}"] = value
    return stream


def pdf_of_nested_forms(deep=24, *, group=False):
    """PDF of forms that each draw the next one twice: 2^24 lines."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    extra = {"Group": DICTIONARY(S=NAME.Transparency)} if group else {}
    inner = form(pdf, b"0 0 m 500 500 l S", **extra)
    for _ in range(deep):
        inner = form(pdf, b"/F Do /F Do", Resources=DICTIONARY(XObject=DICTIONARY(F=inner)), **extra)
    page.Resources = DICTIONARY(XObject=DICTIONARY(F=inner))
    page.Contents = pdf.make_stream(b"/F Do")
    return pdf_bytes(pdf)


def pdf_of_a_form_in_itself():
    """PDF of a form that draws itself."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    inner = form(pdf, b"0 0 m 500 500 l S /F Do /F Do")
    inner.Resources = DICTIONARY(XObject=DICTIONARY(F=inner))
    page.Resources = DICTIONARY(XObject=DICTIONARY(F=inner))
    page.Contents = pdf.make_stream(b"/F Do")
    return pdf_bytes(pdf)


def pdf_of_nested_groups(deep=30):
    """PDF of transparency groups in each other: each takes a picture of the whole page."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=(2 * A4_PT[0], 2 * A4_PT[1]))
    group = {"Group": DICTIONARY(S=NAME.Transparency, I=True, K=True)}
    state = DICTIONARY(G=DICTIONARY(Type=NAME.ExtGState, ca=0.5, BM=NAME.Multiply))
    lines = b"/G gs 0 0 m 500 500 l S 0 0 1000 1000 re f"
    inner = form(pdf, lines, **group, Resources=DICTIONARY(ExtGState=state))
    inner.BBox = [0, 0, 2000, 2000]
    for _ in range(deep):
        inner = form(
            pdf, b"/G gs /F Do 1 1 200 200 re f", **group,
            Resources=DICTIONARY(XObject=DICTIONARY(F=inner), ExtGState=state),
        )  # fmt: skip
        inner.BBox = [0, 0, 2000, 2000]
    page.Resources = DICTIONARY(XObject=DICTIONARY(F=inner), ExtGState=state)
    page.Contents = pdf.make_stream(b"/G gs /F Do")
    return pdf_bytes(pdf)


def pdf_of_a_narrow_pattern(step=1e-4):
    """PDF of 2 KB that fills its page with tiles of a ten-thousandth of a point."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    tile = pdf.make_stream(b"0 0 1 1 re f")
    for name, value in {
        "PatternType": 1, "PaintType": 1, "TilingType": 1, "BBox": [0, 0, 1, 1], "XStep": step, "YStep": step,
        "Resources": DICTIONARY(),
    }.items():  # fmt: skip
        tile[f"/{name}"] = value
    page.Resources = DICTIONARY(Pattern=DICTIONARY(P=tile))
    page.Contents = pdf.make_stream(b"/Pattern cs /P scn 0 0 842 595 re f")
    return pdf_bytes(pdf)


def pdf_of_short_dashes(dash=1e-5):
    """PDF of long lines in dashes of a hundred-thousandth of a point."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    page.Contents = pdf.make_stream(b"[%f] 0 d 1 w 0 0 m 842 595 l S " % dash * 20)
    return pdf_bytes(pdf)


def pdf_of_a_heavy_font():
    """PDF of a font whose one letter is thousands of lines, written thousands of times."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    glyph = pdf.make_stream(b"1000 0 d0 " + b"0 0 m 900 900 l S " * 2000)
    font = DICTIONARY(
        Type=NAME.Font, Subtype=NAME.Type3, FontBBox=[0, 0, 1000, 1000],
        FontMatrix=[0.001, 0, 0, 0.001, 0, 0],
        CharProcs=DICTIONARY(a=glyph), FirstChar=97, LastChar=97, Widths=[1000],
        Encoding=DICTIONARY(Type=NAME.Encoding, Differences=[97, NAME.a]), Resources=DICTIONARY(),
    )  # fmt: skip
    page.Resources = DICTIONARY(Font=DICTIONARY(T=pdf.make_indirect(font)))
    page.Contents = pdf.make_stream(b"BT /T 8 Tf 10 10 Td " + b"(" + b"a" * 20_000 + b") Tj ET")
    return pdf_bytes(pdf)


def pdf_of_a_heavy_stamp():
    """PDF of an annotation that draws nested forms: not among what the page draws itself."""
    with pikepdf.open(io.BytesIO(pdf_of_nested_forms())) as pdf:
        page = pdf.pages[0]
        inner = page.Resources.XObject.F
        page.Contents, page.Resources = pdf.make_stream(b""), DICTIONARY()
        stamp = DICTIONARY(
            Type=NAME.Annot, Subtype=NAME.Stamp, Rect=[0, 0, *A4_PT], F=4, AP=DICTIONARY(N=inner)
        )
        page.Annots = pdf.make_indirect([stamp])
        return pdf_bytes(pdf)


def pdf_of_a_heavy_mask():
    """PDF of a soft mask that draws nested forms: a state of the page, nothing that it draws itself."""
    with pikepdf.open(io.BytesIO(pdf_of_nested_forms(group=True))) as pdf:
        page = pdf.pages[0]
        mask = DICTIONARY(Type=NAME.Mask, S=NAME.Luminosity, G=page.Resources.XObject.F)
        page.Resources = DICTIONARY(ExtGState=DICTIONARY(G=DICTIONARY(Type=NAME.ExtGState, SMask=mask)))
        page.Contents = pdf.make_stream(b"/G gs 0 0 842 595 re f")
        return pdf_bytes(pdf)


def pdf_of_a_shading(content=b"/S sh", **entries):
    """PDF of a page that its commands fill with a shading, by name ``S`` or as the pattern ``P``."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    grey = DICTIONARY(FunctionType=2, Domain=[0, 1], C0=[0], C1=[1], N=1)
    known = {"ShadingType": 2, "ColorSpace": NAME.DeviceGray, "Coords": [0, 0, *A4_PT], "Function": grey}
    program, mesh = entries.pop("program", None), entries.pop("mesh", None)
    if program is not None:
        function = pdf.make_stream(program)
        function.FunctionType, function.Domain, function.Range = 4, [0, 1, 0, 1], [0, 1]
        known = {**known, "Function": function, "Domain": [0, 1, 0, 1], "Matrix": [842, 0, 0, 595, 0, 0]}
        del known["Coords"]
    shading = DICTIONARY() if mesh is None else pdf.make_stream(mesh)
    for name, value in (known | entries).items():
        shading[f"/{name}"] = value
    shading = pdf.make_indirect(shading)
    pattern = DICTIONARY(P=DICTIONARY(PatternType=2, Shading=shading))
    page.Resources = DICTIONARY(Shading=DICTIONARY(S=shading), Pattern=pattern)
    page.Contents = pdf.make_stream(content)
    return pdf_bytes(pdf)


def pdf_of_many_shadings():
    """PDF of 1 KB that fills its page a thousand times, each pixel with a colour of its own."""
    return pdf_of_a_shading(b"/S sh " * 1000, ShadingType=3, Coords=[400, 300, 0, 400, 300, 500])


def pdf_of_a_shading_by_a_program():
    """PDF of 1 KB that carries out 4,000 commands for each pixel of its page."""
    return pdf_of_a_shading(ShadingType=1, program=b"{ " + b"dup pop " * 2000 + b"pop }")


def pdf_of_paints_by_a_shading():
    """PDF of a shading as the pattern with which the page is filled a thousand times."""
    return pdf_of_a_shading(b"/Pattern cs /P scn " + b"0 0 842 595 re f " * 1000)


def pdf_of_a_shading_by_a_mesh(patches=3000):
    """PDF of a mesh whose every patch covers the page."""
    corners = ((0, 0), (0, 2), (0, 4), (0, 6), (2, 6), (4, 6), (6, 6), (6, 4), (6, 2), (6, 0), (4, 0), (2, 0))
    patch = b"\0" + b"".join(struct.pack(">HH", 10_000 * x, 10_000 * y) for x, y in corners) + b"\0\xff\0\xff"
    return pdf_of_a_shading(
        ShadingType=6, BitsPerCoordinate=16, BitsPerComponent=8, BitsPerFlag=8,
        Decode=[0, 842, 0, 595, 0, 1], mesh=patch * patches,
    )  # fmt: skip


def pdf_of_endless_commands():
    """PDF of 100 KB that unpacks to 39 MB of lines, each drawn."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(b"0 0 m 1 1 l S " * 70_000) for _ in range(40)) + packer.flush()
    lines = pikepdf.Stream(pdf, data, Filter=NAME.FlateDecode)
    page.Contents = pdf.make_indirect(lines)
    return pdf_bytes(pdf, compress_streams=False)


def pdf_of_large_inline_images(count=40, side=30_000):
    """PDF of pictures of 900 million pixels each among its drawing commands, without their data."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    image = b"q 842 0 0 595 0 0 cm BI /W %d /H %d /BPC 1 /CS /G /F /A85 ID ~> EI Q\n" % (side, side)
    page.Contents = pdf.make_stream(image * count)
    return pdf_bytes(pdf)


def pdf_of_a_large_image(side=40_000):
    """PDF with a stamp over an image of 1600 million pixels, deflated twice to 200 bytes."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    packer = zlib.compressobj(9)
    data = b"".join(packer.compress(bytes(side * 100 // 8)) for _ in range(side // 100)) + packer.flush()
    image = pikepdf.Stream(pdf, zlib.compress(data, 9))
    image.stream_dict = DICTIONARY(
        Type=NAME.XObject, Subtype=NAME.Image, Width=side, Height=side, ColorSpace=NAME.DeviceGray,
        BitsPerComponent=1, Filter=[NAME.FlateDecode, NAME.FlateDecode],
    )  # fmt: skip
    page.Resources = DICTIONARY(XObject=DICTIONARY(I=pdf.make_indirect(image)))
    page.Contents = pdf.make_stream(b"q 842 0 0 595 0 0 cm /I Do Q 0 0 100 100 re f")
    return pdf_bytes(pdf, compress_streams=False)


def pdf_of_a_large_page():
    """PDF of an empty page of 10 million points by a unit of 1000."""
    pdf = pikepdf.new()
    page = pdf.add_blank_page(page_size=A4_PT)
    page.MediaBox = [0, 0, 10_000_000, 10_000_000]
    page.obj.UserUnit = 1000
    return pdf_bytes(pdf)


def pdf_of_a_class(pages=6, broken=2, how="page"):
    """PDF of a class; one page (from 0) lacks its ``page`` object, an ``image``'s end or ``content``."""
    pdf = pikepdf.new()
    data = stored(paper(), "JPEG", quality=95)
    for number in range(pages):
        image = pikepdf.Stream(pdf, data[:-200] if (number, how) == (broken, "image") else data)
        image.stream_dict = DICTIONARY(
            Type=NAME.XObject, Subtype=NAME.Image, Width=420, Height=300, ColorSpace=NAME.DeviceGray,
            BitsPerComponent=8, Filter=NAME.DCTDecode,
        )  # fmt: skip
        page = pdf.add_blank_page(page_size=(840 + number, 600))
        page.Resources = DICTIONARY(XObject=DICTIONARY(Scan=pdf.make_indirect(image)))
        page.Contents = pdf.make_stream(b"q %d 0 0 600 0 0 cm /Scan Do Q" % (840 + number))
    if how == "content":
        pdf.pages[broken].Contents = DICTIONARY(No=1)
    saved = pdf_bytes(pdf, object_stream_mode=pikepdf.ObjectStreamMode.disable)
    if how == "page" and broken < pages:
        number = b"%d 0 R" % pdf_object(saved, broken)
        saved = saved.replace(number, b"null".ljust(len(number)), 1)
    return saved


def pdf_object(saved, page):
    """Number of the object of a page, from 0."""
    with pikepdf.open(io.BytesIO(saved)) as pdf:
        return pdf.pages[page].obj.objgen[0]


HEAVY = (
    pdf_of_nested_forms, pdf_of_a_form_in_itself, pdf_of_a_narrow_pattern, pdf_of_a_heavy_stamp,
    pdf_of_a_heavy_mask, pdf_of_many_shadings, pdf_of_a_shading_by_a_program, pdf_of_paints_by_a_shading,
    pdf_of_a_shading_by_a_mesh, pdf_of_endless_commands, pdf_of_nested_groups,
)  # fmt: skip
"""Pages that take seconds or minutes to draw."""
