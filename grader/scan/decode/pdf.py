"""PDF files: a page's scan taken out as stored, else the page rendered."""

import io
import logging
import math
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from itertools import product
from typing import cast

import numpy as np
import pikepdf
import pypdfium2

from grader.records import FloatArray, GreyImage, Page
from grader.scan.decode import pictures
from grader.scan.decode.content import SHOWS_TEXT, drawn_by, filters_of, plain_pixels
from grader.scan.decode.limits import MAX_PAGES, Door, InputFile, check_memory, check_pages, check_size
from grader.scan.decode.pictures import from_pillow, plausible, to_grey
from reference.drawing.canvas import MM_PER_INCH
from reference.errors import InputFileError

RENDER_DPI = 300.0
"""As drawings are scanned."""
_POINTS_PER_INCH = 72.0
_INHERITED = ("/Resources", "/MediaBox", "/CropBox", "/Rotate")
_END, _END_WITHIN = (b"%%EOF", b"startxref"), 1 << 16
MAX_UNPACKED = 450_000_000
"""Bytes that qpdf may unpack of one stream: A2 at 600 dpi in colour has 417 MB."""
_GROUP_BYTES = 4
"""For a pixel of what is drawn together: its colour and how much it covers."""
_COVERS = 0.9
"""An image over this share of the page, alone on it, is the page."""
_SHOWN = 0.94
"""Of an image; where the page hides more, what a viewer shows is another picture."""
_SQUARE = 1e-3
"""Of the image's size: by more than rounding askew, it is resampled by what renders the page."""
_PAINTS = frozenset(("S", "s", "f", "F", "f*", "B", "B*", "b", "b*", "sh", "BI", "INLINE IMAGE"))
_TAKEN_OUT = frozenset(("/DeviceGray", "/CalGray", "/DeviceRGB", "/CalRGB", "/ICCBased", "/Indexed"))
"""Colour spaces whose stored values are grey or colours of light."""
_RENDERED = frozenset(("/DeviceCMYK", "/Lab", "/Separation", "/DeviceN"))
"""Those whose values are inks, or no colours of a screen: what renders the page knows what they look like."""
_INKS = frozenset(("/Separation", "/DeviceN"))
"""Those with a formula for their colours, which may be one that cannot be carried out."""
_TAKEN_OUT_BITS = frozenset((1, 2, 4, 8))
"""Bits of a value that Pillow keeps; it clips longer ones."""
_FOUR_INKS = 4
_MOST_SPACES = 3
"""A colour space, and those that it rests on."""
_INVISIBLE_TEXT = 3
"""Text mode of what optical character recognition lays over a scan."""

Matrix = tuple[float, float, float, float, float, float]
_UNIT: Matrix = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)


logging.getLogger("pikepdf").setLevel(logging.CRITICAL)
"""A damaged file raises an error of ours; the library's own messages would only repeat it."""
if hasattr(pikepdf.settings, "set_qpdf_limits"):
    pikepdf.settings.set_qpdf_limits(
        flate_max_memory=MAX_UNPACKED, run_length_max_memory=MAX_UNPACKED, png_max_memory=MAX_UNPACKED,
        tiff_max_memory=MAX_UNPACKED, dct_max_memory=MAX_UNPACKED, max_stream_filters=4, parser_max_errors=0,
    )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Placement:
    """A page's only image: its size on paper along its own rows and columns, and how viewers turn it."""

    image: pikepdf.PdfImage
    width_pt: float
    height_pt: float
    turn_deg: int


def _page(file: InputFile, number: int) -> Page | None:
    with _opened(file) as document:
        leaves = _leaves(document)
        check_pages(file, len(leaves))
        if number > len(leaves):
            return None
        leaf = leaves[number - 1]
        if leaf is None:
            raise _unreadable(file, number, "its place in the list of pages is empty")
        leaf.Type = pikepdf.Name.Page  # without it qpdf finds no drawing commands
        page = pikepdf.Page(leaf)
        drawn = drawn_by(file, number, page)
        # libtiff would print what it thinks of damaged rows.
        placement = _only_image(page) if drawn.objects == 1 and not drawn.damage else None
        taken = None if placement is None else _taken_out(file, number, placement)
        if taken is None:
            for image in drawn.images.values():
                if filters_of(image) == ["/DCTDecode"]:
                    # What renders the page would fill the rest of a damaged one without a word.
                    pictures.decode(file, number, image.read_raw_bytes())
            taken = _rendered(file, number, len(leaves), _repaired(file, document))
            if int(taken.grey.min()) == int(taken.grey.max()) and any(
                _INKS.intersection(_colour_spaces(image)) for image in drawn.images.values()
            ):
                raise _unreadable(file, number, "nothing is shown of a picture in inks of its own")
    return replace(taken, damage=drawn.damage)


def _leaves(document: pikepdf.Pdf) -> list[pikepdf.Object | None]:
    """All pages in their order, None for a broken one: qpdf's own list closes the gap it leaves."""
    leaves: list[pikepdf.Object | None] = []
    nodes = [document.Root.Pages]
    known: set[tuple[int, int]] = set()
    while nodes and len(leaves) <= MAX_PAGES:
        node = nodes.pop()
        if isinstance(node, pikepdf.Dictionary) and isinstance(node.get("/Kids"), pikepdf.Array):
            if node.objgen not in known:  # a list that holds itself has no end
                kids = list(node.Kids)
                for kid, name in product(kids, _INHERITED):
                    if isinstance(kid, pikepdf.Dictionary) and name in node and name not in kid:
                        kid[name] = node[name]
                nodes += reversed(kids)
            known.add(node.objgen)
        else:
            leaves.append(node if isinstance(node, pikepdf.Dictionary) else None)
    return leaves


def _unreadable(file: InputFile, number: int, why: str) -> InputFileError:
    return InputFileError(
        "pdf_damaged", f"{file.name}, page {number}: cannot be read ({why}); export it again", error=why
    )


@contextmanager
def _opened(file: InputFile) -> Iterator[pikepdf.Pdf]:
    # What could be saved of a file without its end silently lacks pages.
    if not any(sign in file.data[-_END_WITHIN:] for sign in _END):
        raise InputFileError(
            "pdf_damaged", f"{file.name}: the PDF is cut off before its end; copy or upload the file again"
        )
    try:
        # Handing down what pages inherit, qpdf would drop broken ones from the list.
        document = pikepdf.open(io.BytesIO(file.data), inherit_page_attributes=False, suppress_warnings=True)
    except pikepdf.PasswordError as error:
        raise InputFileError(
            "pdf_encrypted", f"{file.name}: the PDF asks for a password; save it without one"
        ) from error
    with document:
        yield document


def _taken_out(file: InputFile, number: int, placement: Placement) -> Page | None:
    """The embedded image as a page, or None where only rendering gives what a viewer shows."""
    image = placement.image
    check_size(file, number, image.width, image.height)
    grey = _decoded(file, number, image)
    if grey is None:
        return None
    width_in, height_in = placement.width_pt / _POINTS_PER_INCH, placement.height_pt / _POINTS_PER_INCH
    dpi = plausible((image.width / width_in, image.height / height_in))
    paper_mm = (width_in * MM_PER_INCH, height_in * MM_PER_INCH)
    return Page(file.name, number, grey, dpi, placement.turn_deg, paper_mm)


def _decoded(file: InputFile, number: int, image: pikepdf.PdfImage) -> GreyImage | None:
    spaces = _colour_spaces(cast("pikepdf.Stream", image.obj))
    unknown = [name for name in spaces if name not in _TAKEN_OUT | _RENDERED]
    if unknown:
        raise _unreadable(file, number, f"the colour space {unknown[0]} is none that a picture can have")
    plain = "/Decode" not in image.obj and "/SMask" not in image.obj and "/Mask" not in image.obj
    if not plain or _RENDERED.intersection(spaces) or "/JBIG2Decode" in image.filters:
        return None
    if list(image.filters) == ["/DCTDecode"]:
        return pictures.decode(file, number, image.obj.read_raw_bytes())
    pixels = plain_pixels(file, number, image)
    if pixels is not None:
        return to_grey(pixels, rgb=True)
    if image.bits_per_component not in _TAKEN_OUT_BITS:
        return None
    try:
        picture = image.as_pil_image()
        check_memory(file, number, picture.width * picture.height, 0)
        return from_pillow(picture)
    except (pikepdf.PdfError, pikepdf.UnsupportedImageTypeError, OSError, ValueError, NotImplementedError):
        return None


def _colour_spaces(image: pikepdf.Stream) -> list[str]:
    """Names of an image's colour space and of those that it rests on; empty for a mask, and for JPEG 2000."""
    names: list[str] = []
    space = image.get("/ColorSpace")
    while space is not None and len(names) < _MOST_SPACES:
        family = space[0] if isinstance(space, pikepdf.Array) and len(space) else space
        names.append(str(family))
        if str(family) == "/ICCBased" and isinstance(space, pikepdf.Array) and len(space) > 1:
            names += ["/DeviceCMYK"] if int(space[1].get("/N", 3)) == _FOUR_INKS else []
        based = str(family) == "/Indexed" and isinstance(space, pikepdf.Array) and len(space) > 1
        space = space[1] if based else None
    masked = bool(image.get("/ImageMask", False)) or "/JPXDecode" in filters_of(image)
    return names if names or masked else ["(none)"]


def _repaired(file: InputFile, document: pikepdf.Pdf) -> bytes:
    """The file's bytes, as repaired where qpdf had to: what is rendered must be what was counted."""
    if not document.get_warnings():
        return file.data
    repaired = io.BytesIO()
    document.save(repaired)
    return repaired.getvalue()


def _rendered(file: InputFile, number: int, pages: int, data: bytes) -> Page:
    with pypdfium2.PdfDocument(data) as document:
        if len(document) != pages:
            raise _unreadable(file, number, "its place in the list of pages is not sure")
        page = document[number - 1]
        width_pt, height_pt = page.get_size()
        scale = RENDER_DPI / _POINTS_PER_INCH
        wide, high = int(width_pt * scale), int(height_pt * scale)
        check_memory(file, number, wide * high, _GROUP_BYTES * wide * high)
        check_size(file, number, wide, high)
        grey = page.render(scale=scale, grayscale=True).to_numpy()
    plane = np.ascontiguousarray(grey.reshape(grey.shape[0], grey.shape[1], -1)[..., 0])
    dpi = (plane.shape[1] / width_pt * _POINTS_PER_INCH, plane.shape[0] / height_pt * _POINTS_PER_INCH)
    paper_mm = (width_pt / _POINTS_PER_INCH * MM_PER_INCH, height_pt / _POINTS_PER_INCH * MM_PER_INCH)
    return Page(file.name, number, plane, dpi, 0, paper_mm)


def _count(file: InputFile) -> int:
    with _opened(file) as document:
        pages = len(_leaves(document))
    check_pages(file, pages)
    return pages


# Where a page places its one image ----------------------------------------------------------------


def _only_image(page: pikepdf.Page) -> Placement | None:
    """The image that is the whole page, or None where the page shows more, less or a mirrored one."""
    images: list[tuple[pikepdf.Stream, Matrix]] = []
    matrix, stack, text_mode = _UNIT, [], 0
    try:
        for instruction in pikepdf.parse_content_stream(page):
            operands, name = instruction.operands, str(instruction.operator)
            if name == "q":
                stack.append(matrix)
            elif name == "Q" and stack:
                matrix = stack.pop()
            elif name == "cm":
                matrix = _times(tuple(float(value) for value in operands), matrix)
            elif name == "Tr":
                text_mode = int(operands[0])
            elif name == "Do":
                images.append((cast("pikepdf.Stream", page.resources.XObject[str(operands[0])]), matrix))
            elif name in _PAINTS or (name in SHOWS_TEXT and text_mode != _INVISIBLE_TEXT):
                return None
    except (pikepdf.PdfError, AttributeError, KeyError, TypeError, ValueError):
        return None
    if len(images) != 1 or images[0][0].get("/Subtype") != "/Image" or "/Annots" in page.obj:
        return None
    return _placed(page, *images[0])


def _placed(page: pikepdf.Page, image: pikepdf.Stream, matrix: Matrix) -> Placement | None:
    a, b, c, d, e, f = matrix
    width, height = math.hypot(a, b), math.hypot(c, d)
    box = [float(value) for value in page.mediabox]
    area = abs((box[2] - box[0]) * (box[3] - box[1]))
    upright = a * d - b * c > 0
    square = min(abs(a), abs(b)) <= _SQUARE * width and abs(a * c + b * d) <= _SQUARE * width * height
    if not upright or not square or width * height < _COVERS * area:
        return None
    corners = np.array([(e, f), (e + a + c, f + b + d)])
    shown = _overlap(corners, [float(value) for value in page.cropbox])
    if shown < _SHOWN * width * height:
        return None
    drawn_turn = round(math.degrees(math.atan2(b, a)) / 90.0) * 90
    page_turn = int(page.obj.get("/Rotate", 0))
    unit = float(page.obj.get("/UserUnit", 1.0))
    turn_deg = (drawn_turn - page_turn) % 360
    return Placement(pikepdf.PdfImage(image), width * unit, height * unit, turn_deg)


def _overlap(corners: FloatArray, box: list[float]) -> float:
    """Area that a rectangle, by opposite corners, shares with a box."""
    low = np.maximum(corners.min(axis=0), np.minimum(box[:2], box[2:]))
    high = np.minimum(corners.max(axis=0), np.maximum(box[:2], box[2:]))
    return float(np.prod(np.maximum(high - low, 0.0)))


def _times(first: tuple[float, ...], second: Matrix) -> Matrix:
    a, b, c, d, e, f = first
    g, h, i, j, k, m = second
    return (a * g + b * i, a * h + b * j, c * g + d * i, c * h + d * j, e * g + f * i + k, e * h + f * j + m)


PDF = Door(_page, _count, "pdf_damaged", "page")
