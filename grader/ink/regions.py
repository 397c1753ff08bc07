"""What is not drawing: the frame and the title block."""

from collections.abc import Sequence

import numpy as np

from grader.pixels import BoolArray
from grader.records import Box, FloatArray, Sheet

_FRAME_MM = 1.5
_BLOCK_MM = (215.0, 80.0)
_SQUARE_MM = 0.03
_RULED_MM = 10.0
_TOUCH_MM = 2.0


def kept(ends: FloatArray, sheet: Sheet, boxes: Sequence[Box] | None) -> BoolArray:
    """Which pieces, (n, 2, 2) mm, are inside the frame, outside the title block and in the boxes."""
    x, y, w, h = sheet.drawable_mm
    middle = ends.mean(axis=1)
    inside = (
        (middle[:, 0] > x + _FRAME_MM)
        & (middle[:, 0] < x + w - _FRAME_MM)
        & (middle[:, 1] > y + _FRAME_MM)
        & (middle[:, 1] < y + h - _FRAME_MM)
    )
    block = title_block(ends, sheet)
    if block is not None:
        inside &= ~_in_box(middle, block)
    if boxes is not None:
        asked = np.zeros(len(ends), dtype=bool)
        for box in boxes:
            asked |= _in_box(middle, box)
        inside &= asked
    return np.asarray(inside)


def title_block(ends: FloatArray, sheet: Sheet) -> Box | None:
    """The grid of ruled lines at the bottom right, or None."""
    right, bottom = sheet.page_mm
    span = np.abs(ends[:, 1] - ends[:, 0])
    length = span.max(axis=1)
    square = span.min(axis=1) < np.maximum(_SQUARE_MM * length, 0.3)
    low, high = ends.min(axis=1), ends.max(axis=1)
    corner = (low[:, 0] > right - _BLOCK_MM[0]) & (low[:, 1] > bottom - _BLOCK_MM[1])
    candidate = np.flatnonzero(square & corner & (length >= _RULED_MM))
    candidate = candidate[np.argsort(-high[candidate].sum(axis=1))]
    lows, highs = low[candidate] - _TOUCH_MM, high[candidate] + _TOUCH_MM
    if len(candidate) < 3:
        return None
    start = int(np.argmax(highs[:, 0] + highs[:, 1]))
    member = np.zeros(len(candidate), dtype=bool)
    member[start] = True
    while True:
        touching = np.zeros(len(candidate), dtype=bool)
        for row in np.flatnonzero(member):
            touching |= (lows <= highs[row]).all(axis=1) & (highs >= lows[row]).all(axis=1)
        if (touching == member).all():
            break
        member |= touching
    chosen = candidate[member]
    flat_ones = span[chosen, 0] > span[chosen, 1]
    if flat_ones.sum() < 2 or (~flat_ones).sum() < 1:
        return None
    x0, y0 = low[chosen].min(axis=0) - 1.0
    return (float(x0), float(y0), right - float(x0), bottom - float(y0))


def _in_box(points: FloatArray, box: Box) -> BoolArray:
    x, y, w, h = box
    return np.asarray(
        (points[:, 0] >= x) & (points[:, 0] <= x + w) & (points[:, 1] >= y) & (points[:, 1] <= y + h)
    )
