"""PDF files: a page's embedded scan taken out directly where it is the whole page, else rendered."""

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pikepdf
import pypdfium2

from grader.intake import jpeg
from grader.intake.grey import from_pillow
from grader.intake.limits import Door, check_pages, check_size
from grader.intake.placement import Placement, only_image
from grader.intake.tags import plausible
from grader.records import GreyImage, Page
from reference.errors import InputFileError

RENDER_DPI = 300.0
_POINTS_PER_INCH = 72.0
_MM_PER_INCH = 25.4


def _pages(path: Path, first: int) -> Iterator[Page]:
    with _opened(path) as document:
        check_pages(path, len(document.pages))
        for number in range(first, len(document.pages) + 1):
            page = document.pages[number - 1]
            placement = only_image(page)
            taken = None if placement is None else _taken_out(path, number, placement)
            yield _rendered(path, number) if taken is None else taken


@contextmanager
def _opened(path: Path) -> Iterator[pikepdf.Pdf]:
    try:
        document = pikepdf.open(path)
    except pikepdf.PasswordError as error:
        raise InputFileError(
            "pdf_encrypted", f"{path.name}: the PDF asks for a password; save it without one"
        ) from error
    except (pikepdf.PdfError, OSError, ValueError) as error:
        raise InputFileError(
            "pdf_damaged", f"{path.name}: the PDF cannot be opened ({error}); export it again"
        ) from error
    with document:
        yield document


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
    try:
        return from_pillow(image.as_pil_image())
    except (pikepdf.PdfError, pikepdf.UnsupportedImageTypeError, OSError, ValueError, NotImplementedError):
        return None


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
            "pdf_damaged", f"{path.name}, page {number}: cannot be rendered ({error}); export it again"
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
