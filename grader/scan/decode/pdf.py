"""PDF files by pdfium: a page's scan taken out as stored, else the page rendered."""

import math
import re
import zlib
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np
import pypdfium2
from pypdfium2 import raw

from grader.records import FloatArray, GreyImage, Page
from grader.scan.decode import pictures
from grader.scan.decode.fax import Coding, damaged_row
from grader.scan.decode.limits import Door, InputFile, check_memory, check_pages, check_size, damaged
from grader.scan.decode.pictures import plausible, to_grey
from reference.drawing.canvas import MM_PER_INCH
from reference.errors import InputFileError

RENDER_DPI = 300.0
"""As drawings are scanned."""
_POINTS_PER_INCH = 72.0
_END, _END_WITHIN = (b"%%EOF", b"startxref"), 1 << 16
_PIXEL_BYTES = 4
"""Bytes of a pixel of a picture or a page, as pdfium unpacks it."""
_COVERS = 0.9
"""An image over this share of the page, alone on it, is the page."""
_SHOWN = 0.94
"""Share of an image; if the page hides more, a viewer shows another picture."""
_SQUARE = 1e-3
"""Share of the image's size: if it is askew by more than rounding, rendering the page resamples it."""
_OTHERWISE_SHOWN = re.compile(rb"/S?Mask\s*[\d\[]|/Decode\s*\[")
"""In a file whose pictures may be shown otherwise than stored; dictionaries of pictures are never packed."""
_OF_LIGHT = frozenset((
    raw.FPDF_COLORSPACE_DEVICEGRAY, raw.FPDF_COLORSPACE_DEVICERGB, raw.FPDF_COLORSPACE_CALGRAY,
    raw.FPDF_COLORSPACE_CALRGB, raw.FPDF_COLORSPACE_ICCBASED,
))  # fmt: skip
"""Colour spaces whose stored values are grey or colours of light."""
_MOST_BYTES, _SLACK = 8, 1 << 16
"""Bytes of a pixel (four inks of 16 bits), and bytes behind the last row, as writers may leave them."""
_CODINGS = [Coding(k, aligned) for k in (-1, 0, 1) for aligned in (False, True)]
"""Codings of a fax picture, most usual first: pdfium does not say which of them it has."""


def _page(file: InputFile, number: int) -> Page | None:
    with _opened(file) as document:
        check_pages(file, len(document))
        if number > len(document):
            return None
        page = document[number - 1]
        drawn = list(page.get_objects(filter=[raw.FPDF_PAGEOBJ_IMAGE]))
        for image in drawn:
            wide, high = image.get_px_size()
            check_memory(file, wide * high, _PIXEL_BYTES * wide * high)
        damage = next((rows for image in drawn if (rows := _fax_damage(image))), ())
        taken = None if _OTHERWISE_SHOWN.search(file.data) else _taken_out(file, page)
        if taken is None:
            for image in drawn:
                if image.get_filters() == ["DCTDecode"]:
                    # What renders the page would fill the rest of a damaged one without a word.
                    pictures.check_header(file, _stored(image), least=False)
                    pictures.decode(file, _stored(image))
            taken = _rendered(file, page)
        return Page(file.name, number, *taken, damage=damage)


@contextmanager
def _opened(file: InputFile) -> Iterator[pypdfium2.PdfDocument]:
    # What could be saved of a file without its end silently lacks pages.
    if not any(sign in file.data[-_END_WITHIN:] for sign in _END):
        raise InputFileError("pdf_damaged", why="pdf_cut_off", file=file.name)
    try:
        document = pypdfium2.PdfDocument(file.data)
    except pypdfium2.PdfiumError as error:
        if b"/Encrypt" in file.data:
            raise InputFileError("pdf_encrypted", file=file.name) from error
        raise InputFileError("pdf_damaged", why="pdf_without_pages", file=file.name) from error
    with document:
        yield document


def _count(file: InputFile) -> int:
    with _opened(file) as document:
        check_pages(file, len(document))
        return len(document)


_Taken = tuple[GreyImage, pictures.Dpi | None, int, tuple[float, float]]
"""Grey, resolution, turn of the page and size of the paper, mm."""


def _rendered(file: InputFile, page: pypdfium2.PdfPage) -> _Taken:
    width_pt, height_pt = page.get_size()
    scale = RENDER_DPI / _POINTS_PER_INCH
    wide, high = int(width_pt * scale), int(height_pt * scale)
    check_size(file, wide, high, _PIXEL_BYTES)
    grey = page.render(scale=scale, grayscale=True).to_numpy()
    plane = np.ascontiguousarray(grey.reshape(grey.shape[0], grey.shape[1], -1)[..., 0]).copy()
    return plane, *_resolved(plane, width_pt, height_pt, 0)


def _resolved(
    grey: GreyImage, width_pt: float, height_pt: float, turn_deg: int
) -> tuple[pictures.Dpi | None, int, tuple[float, float]]:
    width_in, height_in = width_pt / _POINTS_PER_INCH, height_pt / _POINTS_PER_INCH
    dpi = plausible((grey.shape[1] / width_in, grey.shape[0] / height_in))
    return dpi, turn_deg, (width_in * MM_PER_INCH, height_in * MM_PER_INCH)


# A page that is one picture -------------------------------------------------------------------------


def _taken_out(file: InputFile, page: pypdfium2.PdfPage) -> _Taken | None:
    """The picture that is the whole page, or None where only rendering gives what a viewer shows."""
    shown = [one for one in page.get_objects(max_depth=1) if not _is_invisible(one)]
    if len(shown) != 1 or not isinstance(shown[0], pypdfium2.PdfImage) or raw.FPDFPage_GetAnnotCount(page):
        return None
    image = shown[0]
    about, matrix = image.get_metadata(), image.get_matrix()
    if about.colorspace == raw.FPDF_COLORSPACE_UNKNOWN and about.bits_per_pixel:
        return None  # a stencil through which something is painted
    a, b, c, d, e, f = matrix.get()
    width, height = math.hypot(a, b), math.hypot(c, d)
    box = page.get_bbox()
    upright = a * d - b * c > 0
    square = min(abs(a), abs(b)) <= _SQUARE * width and abs(a * c + b * d) <= _SQUARE * width * height
    if not upright or not square or width * height < _COVERS * (box[2] - box[0]) * (box[3] - box[1]):
        return None
    corners = np.array([(e, f), (e + a + c, f + b + d)])
    if _overlap(corners, box) < _SHOWN * width * height:
        return None
    check_size(file, *image.get_px_size())
    grey = _decoded(file, image, about)
    drawn_turn = round(math.degrees(math.atan2(b, a)) / 90.0) * 90
    return grey, *_resolved(grey, width, height, (drawn_turn - page.get_rotation()) % 360)


def _is_invisible(one: pypdfium2.PdfObject) -> bool:
    """Return whether it is text that optical character recognition lays over a scan."""
    if one.type != raw.FPDF_PAGEOBJ_TEXT:
        return False
    return bool(raw.FPDFTextObj_GetTextRenderMode(one) == raw.FPDF_TEXTRENDERMODE_INVISIBLE)


def _overlap(corners: FloatArray, box: tuple[float, ...]) -> float:
    """Area that a rectangle, by opposite corners, shares with a box."""
    low = np.maximum(corners.min(axis=0), box[:2])
    high = np.minimum(corners.max(axis=0), box[2:])
    return float(np.prod(np.maximum(high - low, 0.0)))


def _decoded(file: InputFile, image: pypdfium2.PdfImage, about: raw.FPDF_IMAGEOBJ_METADATA) -> GreyImage:
    filters = image.get_filters()
    if filters == ["DCTDecode"] and about.colorspace in _OF_LIGHT:
        data = _stored(image)
        if pictures.check_header(file, data, least=False) not in pictures.FOUR_INKS:
            return pictures.decode(file, data)
    if filters == ["FlateDecode"]:
        unpacking = zlib.decompressobj()
        unpacking.decompress(image.get_data(), about.height * (_MOST_BYTES * about.width + 2) + _SLACK)
        if not unpacking.eof:
            raise damaged(file, "wrong_amount")
    try:
        pixels = image.get_bitmap().to_numpy()
    except pypdfium2.PdfiumError as error:
        raise damaged(file, "undecodable") from error
    return to_grey(pixels[..., :3]) if pixels.ndim == 3 else pixels.copy()


def _stored(image: pypdfium2.PdfImage) -> bytes:
    """The data of a picture, still packed as a picture."""
    return bytes(image.get_data(decode_simple=True))


def _fax_damage(image: pypdfium2.PdfImage) -> tuple[int, ...]:
    """First and last damaged row of a picture packed as fax; empty for a whole one and for other packing."""
    if image.get_filters()[-1:] != ["CCITTFaxDecode"]:
        return ()
    (wide, high), data = image.get_px_size(), _stored(image)
    row = -1
    for coding in _CODINGS:
        broken = damaged_row(data, wide, high, coding)
        if broken is None:
            return ()
        row = max(row, broken)
    return row + 1, high


PDF = Door(_page, _count, "pdf_damaged")
