"""Pages of files of any kind that is accepted (JPEG, PNG, TIFF, HEIC, PDF), within limits."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import Page, PageRef
from grader.scan.decode import heic, pdf, pictures, tiff
from grader.scan.decode.limits import Door, InputFile, changed, kind_of, load
from grader.scan.decode.ruling import without_ruling
from grader.scan.pixels import connected, is_dotted, shrink
from reference.errors import InputFileError

_DOORS: dict[str, Door] = {
    "jpeg": pictures.JPEG, "png": pictures.PNG, "tiff": tiff.TIFF, "heic": heic.HEIC, "pdf": pdf.PDF,
}  # fmt: skip
_LONG_SIDE_PX = 1700
"""About 4 px/mm on A3: strokes of 0.3 mm survive, dust and grain fade."""
_DARK = 0.16
"""Contrast of a pencil stroke at this resolution; what shows through paper stays under 0.1."""
_DOTTED_DARK = 0.08
"""The same of a line of dots, of a black and white page, on which nothing shows through."""
_DOT_GAP_PX = 7
"""Dots of a faint copy's line are this near to each other: 1.7 mm."""
_LONG = 0.012
"""Share of the long side (5 mm on A3): longer than dust, hairs and letters that show through."""
_RIM = 0.03
"""Share of the long side: scanners leave shadows there."""
_ENOUGH = 0.1
"""Share of the long side (42 mm): all long marks together on a page that is drawn on."""
_SIGN, _MANY_SIGNS = (0.004, 0.04), 100
"""Extent of a sign or word, shares of the long side; the least number of them on a page of writing."""
_LONG_STROKE, _RULED = 0.04, 0.5
"""Shares of the long side: longer straight lines belong to a drawing, but for fraction bars and underlining;
upright and level ones longer than the second are rulings, margins or frames."""
_SQUARE_WITHIN = 0.05
"""Sine of the largest turn of an upright or level line."""
_FIGURE = 0.08
"""Share of the long side: wider and higher connected ink, and no ruling, is a figure; no line is searched."""
_BESIDE, _MOSTLY = 0.012, 0.7
"""A fraction bar has signs within this share of the long side along so much of its length."""


def pages_of(source: InputFile | Path | str) -> Iterator[Page]:
    """Pages of a file, decoded one at a time as they are asked for.

    Raises
    ------
    InputFileError
        at the first `next` for a file that cannot be used at all; at a later one for a page that is
        damaged. The codes are those of `grader.scan.decode.limits`.
    """
    file = _loaded(source)
    for number in range(1, count_pages(file) + 1):
        yield page_of(file, number)


def page_of(source: InputFile | Path | str, number: int) -> Page:
    """One page of a file, from 1, decoding no other. Raises as `pages_of`, and for a number too high."""
    file = _loaded(source)
    door = _DOORS[kind_of(file)]
    with _as_input_error(file, door):
        page = door.page(file, number)
    if page is None:
        raise InputFileError("page_missing", wanted=number, pages=count_pages(file), file=file.name)
    grey, ruling = without_ruling(page.grey)
    return page if ruling is None else replace(page, grey=grey, ruling=ruling)


def decode(ref: PageRef) -> Page:
    """The page's pixels. Raises as `pages_of`, and where the file is not what it was when it was listed."""
    file = load(ref.path, ref.file)
    if ref.digest and ref.digest != file.digest:
        raise changed(ref.file)
    return replace(page_of(file, ref.page), source=ref.file)


def count_pages(source: InputFile | Path | str) -> int:
    """Number of pages, found without decoding them. Raises as `pages_of` does."""
    file = _loaded(source)
    door = _DOORS[kind_of(file)]
    with _as_input_error(file, door):
        return door.count(file)


def _loaded(source: InputFile | Path | str) -> InputFile:
    return source if isinstance(source, InputFile) else load(source)


@contextmanager
def _as_input_error(file: InputFile, door: Door) -> Iterator[None]:
    """Any error of a library becomes an InputFileError of the page; want of memory stays a MemoryError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (InputFileError, MemoryError):
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if "insufficient memory" in reason.lower():  # OpenCV and libjpeg say it in words
            raise MemoryError(reason) from error
        raise InputFileError(door.code, error=reason, file=file.name) from error


def is_writing(page: Page) -> bool:
    """True for a page of calculations: many signs, and no long straight line without signs along it.

    Lines too faint for a stroke count as well, so that a pale drawing beside writing remains a drawing.
    """
    share, long_side = _share_of_light(page)
    labels, boxes = connected(np.ascontiguousarray(share < (1.0 - _DARK) * 255).astype(np.uint8))
    wide, high = boxes[:, 2:].T / long_side
    extent = np.maximum(wide, high)
    is_sign = (extent > _SIGN[0]) & (extent < _SIGN[1])
    is_figure = (np.minimum(wide, high) > _FIGURE) & (extent < _RULED)
    if np.count_nonzero(is_sign) < _MANY_SIGNS or np.any(is_figure):
        return False
    found = cv2.createLineSegmentDetector(cv2.LSD_REFINE_STD).detect(share)[0]
    start, end = np.split(np.reshape([] if found is None else found, (-1, 4)), 2, axis=1)
    long = np.hypot(*(end - start).T) / long_side
    is_square = np.abs(end - start).min(axis=1) < _SQUARE_WITHIN * long * long_side
    drawn = (long > _LONG_STROKE) & ~(is_square & (long > _RULED))
    if np.any(drawn & ~is_square):
        return False
    reach = 2 * round(_BESIDE * long_side) + 1
    near = cv2.dilate(np.r_[False, is_sign][labels].astype(np.uint8), np.ones((reach, reach), np.uint8))
    along = np.linspace(0.0, 1.0, 25)[:, None, None]
    x, y = np.moveaxis((start[drawn] + along * (end - start)[drawn]).astype(int), -1, 0)
    return bool(
        np.all(near[y.clip(0, near.shape[0] - 1), x.clip(0, near.shape[1] - 1)].mean(axis=0) > _MOSTLY)
    )


def is_blank(page: Page) -> bool:
    """True for a page that nobody drew on: the back of a duplex scan, with show-through, dust and holes.

    Sums the extents of dark marks of at least 5 mm, away from the page's rim; a sheet with a single
    short line is not blank.
    """
    share, long_side = _share_of_light(page)
    dotted = is_dotted(page.grey)
    inner = np.ascontiguousarray(share < (1.0 - (_DOTTED_DARK if dotted else _DARK)) * 255).astype(np.uint8)
    if dotted:
        inner = np.asarray(cv2.dilate(inner, np.ones((_DOT_GAP_PX, _DOT_GAP_PX), np.uint8)), dtype=np.uint8)
    extent = np.hypot(*connected(inner)[1][:, 2:].T)
    return bool(extent[extent > _LONG * long_side].sum() < _ENOUGH * long_side)


def _share_of_light(page: Page) -> tuple[NDArray[np.uint8], int]:
    """Return the light that the ink leaves, 255 for paper, without the page's rim; and its long side, px."""
    scale = min(1.0, _LONG_SIDE_PX / max(page.grey.shape))
    small = shrink(page.grey, scale)
    paper = cv2.morphologyEx(small, cv2.MORPH_CLOSE, np.ones((31, 31), np.uint8))
    share = np.asarray(cv2.divide(small, paper, scale=255), dtype=np.uint8)
    # A strip narrower than two rims has no more than its middle.
    rim = min(int(_RIM * max(small.shape)), (min(small.shape) - 1) // 2)
    return share[rim : small.shape[0] - rim, rim : small.shape[1] - rim], max(small.shape)
