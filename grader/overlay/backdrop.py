"""The cleaned scan of a page, upright, to be drawn on.

Pixels: sheet point (x, y) mm lies at (x s - 0.5, y s - 0.5) from the centre of the top left pixel,
s = width / paper's width.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import Backdrop, GreyImage, Page, Sheet
from grader.scan.pixels import averaged, cut_out, reduction

WIDTH_PX = 2000
INK_STRENGTH = 1.25
"""Pencil is darkened, so that it can be followed under the overlay,"""
DARKEST = 0.8
"""and ink is lightened, so that the overlay stands out."""
PAPER_FROM = 0.90
"""Share of the local paper's brightness from which everything is shown white."""
_TONES = np.array(
    [
        255.0 - 255.0 * min(INK_STRENGTH * (1.0 - min(share / 255.0 / PAPER_FROM, 1.0)), DARKEST)
        for share in range(256)
    ],
    dtype=np.uint8,
)
"""The tone shown for each share of the paper's brightness, 0..255."""


def backdrop(page: Page, sheet: Sheet | None, *, width_px: int = WIDTH_PX) -> Backdrop:
    """Return the scan to draw on; `sheet` is None if the page could not be registered."""
    if sheet is None:
        scan = _clean(_turned(page, width_px))
        height, width = scan.shape
        return Backdrop(page.source, page.page, scan, (420.0, 420.0 * height / width), registered=False)
    scan = _clean(_upright(page.grey, sheet, width_px))
    return Backdrop(page.source, page.page, scan, sheet.page_mm, registered=True)


def _turned(page: Page, width_px: int) -> GreyImage:
    """Return the page turned as its file asks, at most `width_px` wide."""
    grey = np.rot90(page.grey, page.turn_deg // 90)
    scale = min(1.0, width_px / grey.shape[1])
    size = (max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale)))
    return _grey(cv2.resize(np.ascontiguousarray(grey), size, interpolation=cv2.INTER_AREA))


def _upright(grey: GreyImage, sheet: Sheet, width_px: int) -> GreyImage:
    """Return the upright sheet, `width_px` wide."""
    scale = width_px / sheet.page_mm[0]
    less = max(1, int(sheet.px_per_mm / scale))
    to_px = reduction(1.0 / less) @ sheet.mm_to_px
    return cut_out(averaged(grey, less), to_px, (0.0, 0.0, *sheet.page_mm), scale, outside=255)


def _clean(grey: GreyImage) -> GreyImage:
    """Even out shadows, make paper white and strokes equally strong."""
    height, width = grey.shape
    small = cv2.resize(grey, (max(1, width // 8), max(1, height // 8)), interpolation=cv2.INTER_AREA)
    paper = cv2.GaussianBlur(cv2.dilate(small, np.ones((7, 7), np.uint8)), (0, 0), 5)
    level = cv2.resize(paper, (width, height), interpolation=cv2.INTER_LINEAR)
    return _grey(cv2.LUT(cv2.divide(grey, level, scale=255.0), _TONES))


def _grey(image: NDArray[np.generic]) -> GreyImage:
    return np.asarray(image, dtype=np.uint8)
