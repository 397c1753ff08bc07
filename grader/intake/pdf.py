"""PDF files: a page's embedded scan taken out directly where it is the whole page, else rendered."""

import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pikepdf
import pypdfium2
from PIL import Image

from grader.intake import jpeg
from grader.intake.grey import from_pillow, to_grey
from grader.intake.limits import Door, check_pages, check_size, damaged, too_large
from grader.intake.placement import Placement, only_image
from grader.intake.tags import plausible
from grader.intake.unpacking import check_content, plain_pixels
from grader.records import GreyImage, Page
from reference.errors import InputFileError

RENDER_DPI = 300.0
_POINTS_PER_INCH = 72.0
_MM_PER_INCH = 25.4
_END, _END_WITHIN = (b"%%EOF", b"startxref"), 1 << 16
_MOST_CHANNELS = 4


def _pages(path: Path, first: int) -> Iterator[Page]:
    with _opened(path) as document:
        check_pages(path, len(document.pages))
        for number in range(first, len(document.pages) + 1):
            page = document.pages[number - 1]
            check_content(path, number, page)
            placement = only_image(page)
            taken = None if placement is None else _taken_out(path, number, placement)
            yield _rendered(path, number) if taken is None else taken


@contextmanager
def _opened(path: Path) -> Iterator[pikepdf.Pdf]:
    _check_whole(path)
    try:
        document = pikepdf.open(path)
    except pikepdf.PasswordError as error:
        raise InputFileError(
            "pdf_encrypted", f"{path.name}: the PDF asks for a password; save it without one"
        ) from error
    except (pikepdf.PdfError, OSError, ValueError) as error:
        raise InputFileError(
            "pdf_damaged", f"{path.name}: the PDF cannot be opened ({_reason(path, error)}); export it again"
        ) from error
    with document:
        yield document


def _check_whole(path: Path) -> None:
    """Raise InputFileError for a file without its end: what could be saved of it silently lacks pages."""
    with path.open("rb") as file:
        file.seek(0, 2)
        file.seek(max(0, file.tell() - _END_WITHIN))
        tail = file.read()
    if not any(sign in tail for sign in _END):
        raise InputFileError(
            "pdf_damaged", f"{path.name}: the PDF is cut off before its end; copy or upload the file again"
        )


def _reason(path: Path, error: Exception) -> str:
    """What a library says of a file, without where the file lies."""
    return str(error).replace(str(path), path.name).removeprefix(f"{path.name}: ")


def _taken_out(path: Path, number: int, placement: Placement) -> Page | None:
    """The embedded image as a page, or None where only rendering gives what a viewer shows."""
    image = placement.image
    check_size(path, number, image.width, image.height)
    grey = _decoded(path, number, image)
    if grey is None:
        return None
    width_in, height_in = placement.width_pt / _POINTS_PER_INCH, placement.height_pt / _POINTS_PER_INCH
    dpi = plausible((image.width / width_in, image.height / height_in))
    paper_mm = (width_in * _MM_PER_INCH, height_in * _MM_PER_INCH)
    return Page(path.name, number, grey, dpi, placement.turn_deg, paper_mm)


def _decoded(path: Path, number: int, image: pikepdf.PdfImage) -> GreyImage | None:
    plain = "/Decode" not in image.obj and "/SMask" not in image.obj and "/Mask" not in image.obj
    four_inks = image.colorspace in ("/DeviceCMYK", "/DeviceN", "/Separation")
    if list(image.filters) == ["/DCTDecode"] and plain and not four_inks:
        return jpeg.decode(path, number, image.obj.read_raw_bytes())
    if not plain or four_inks:
        return None
    pixels = plain_pixels(path, number, image)
    if pixels is not None:
        return to_grey(pixels[..., ::-1] if pixels.ndim == 3 else pixels)
    if not _within(image):
        raise damaged(path, number, "its data are more than its size asks for")
    try:
        picture = image.as_pil_image()
        check_size(path, number, *picture.size)
        return from_pillow(picture)
    except Image.DecompressionBombError as error:
        raise too_large(path, number) from error
    except (pikepdf.PdfError, pikepdf.UnsupportedImageTypeError, OSError, ValueError, NotImplementedError):
        return None


def _within(image: pikepdf.PdfImage) -> bool:
    """Whether deflated data unpack to no more than an image of its size can need; true for other packing."""
    stream = image.obj
    if [str(name) for name in image.filters] != ["/FlateDecode"]:
        return True
    most = image.height * (image.width * _MOST_CHANNELS * 2 + 1)
    try:
        return len(zlib.decompressobj().decompress(stream.read_raw_bytes(), most + 1)) <= most
    except zlib.error:
        return True


def _rendered(path: Path, number: int) -> Page:
    try:
        with pypdfium2.PdfDocument(path) as document:
            page = document[number - 1]
            width_pt, height_pt = page.get_size()
            scale = RENDER_DPI / _POINTS_PER_INCH
            check_size(path, number, int(width_pt * scale), int(height_pt * scale))
            grey = page.render(scale=scale, grayscale=True).to_numpy()
    except pypdfium2.PdfiumError as error:
        raise InputFileError(
            "pdf_damaged",
            f"{path.name}, page {number}: cannot be rendered ({_reason(path, error)}); export it again",
        ) from error
    plane = np.ascontiguousarray(grey.reshape(grey.shape[0], grey.shape[1], -1)[..., 0])
    dpi = (plane.shape[1] / width_pt * _POINTS_PER_INCH, plane.shape[0] / height_pt * _POINTS_PER_INCH)
    paper_mm = (width_pt / _POINTS_PER_INCH * _MM_PER_INCH, height_pt / _POINTS_PER_INCH * _MM_PER_INCH)
    return Page(path.name, number, plane, dpi, 0, paper_mm)


def _count(path: Path) -> int:
    with _opened(path) as document:
        pages = len(document.pages)
    check_pages(path, pages)
    return pages


DOOR = Door(_pages, _count)
