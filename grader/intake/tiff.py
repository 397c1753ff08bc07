"""TIFF files: one page or many; G4, LZW, deflate, JPEG; 1-bit, grey, colour."""

import logging
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import tifffile

from grader.intake.grey import of_four_inks, to_grey
from grader.intake.limits import Door, check_pages, check_size, damaged, truncated
from grader.intake.tags import Dpi, from_unit, tags_of
from grader.records import GreyImage, Page

logging.getLogger("tifffile").setLevel(logging.CRITICAL)
"""What is wrong with a file is told by an error; the library's own words on it would be in the way."""

_DECODING = (ValueError, RuntimeError, OSError, KeyError, IndexError, TypeError, tifffile.TiffFileError)
"""What the decoders raise for bad data (imagecodecs' own errors are RuntimeErrors)."""


def _pages(path: Path, first: int) -> Iterator[Page]:
    with _opened(path) as file:
        check_pages(path, _length(path, file))
        for number, page in enumerate(file.pages[first - 1 :], start=first):
            if not isinstance(page, tifffile.TiffPage):
                raise damaged(path, number, "its directory cannot be read")
            check_size(path, number, page.imagewidth, page.imagelength)
            tags = tags_of(_dpi(page), int(_value(page, "Orientation", 1)))
            grey = tags.unmirrored(_grey(path, number, page))
            yield Page(path.name, number, grey, tags.dpi, tags.turn_deg)


def _opened(path: Path) -> tifffile.TiffFile:
    try:
        return tifffile.TiffFile(path)
    except _DECODING as error:
        raise damaged(path, 1, "its header cannot be read") from error


def _length(path: Path, file: tifffile.TiffFile) -> int:
    try:
        pages = len(file.pages)
    except _DECODING as error:
        raise damaged(path, 1, "its list of pages cannot be read") from error
    if pages == 0:
        # The list of pages stands at the end of most files, behind the pixels.
        raise truncated(path, 1)
    return pages


def _grey(path: Path, number: int, page: tifffile.TiffPage) -> GreyImage:
    try:
        pixels = np.squeeze(page.asarray())
    except _DECODING as error:
        raise damaged(path, number, str(error) or type(error).__name__) from error
    if page.planarconfig == tifffile.PLANARCONFIG.SEPARATE and pixels.ndim == 3:
        pixels = np.moveaxis(pixels, 0, -1)
    if page.photometric == tifffile.PHOTOMETRIC.SEPARATED and pixels.ndim == 3 and pixels.shape[2] >= 4:
        return of_four_inks(pixels)
    if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
        pixels = (np.moveaxis(page.colormap[:, pixels], 0, -1) >> 8).astype(np.uint8)
    if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
        pixels = ~pixels
    if pixels.ndim == 3 and pixels.shape[2] in (3, 4):
        pixels = pixels[..., [2, 1, 0, *range(3, pixels.shape[2])]]
    try:
        return to_grey(pixels)
    except ValueError as error:
        raise damaged(path, number, str(error)) from error


def _dpi(page: tifffile.TiffPage) -> Dpi | None:
    x, y = _value(page, "XResolution", None), _value(page, "YResolution", None)
    if not (isinstance(x, tuple) and isinstance(y, tuple) and x[1] and y[1]):
        return None
    return from_unit(x[0] / x[1], y[0] / y[1], int(_value(page, "ResolutionUnit", 2)))


def _value(page: tifffile.TiffPage, name: str, default: Any) -> Any:  # noqa: ANN401 - as tagged
    tag = page.tags.get(name)
    return default if tag is None else tag.value


def _count(path: Path) -> int:
    with _opened(path) as file:
        pages = _length(path, file)
    check_pages(path, pages)
    return pages


DOOR = Door(_pages, _count)
