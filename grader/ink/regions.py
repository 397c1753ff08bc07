"""What is not drawing: the frame, what lies outside it, and the title block."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np

from grader.ink.joining import join
from grader.ink.seeds import Seeds
from grader.pixels import BoolArray, at_full_size, inverted, mapped
from grader.records import Box, FloatArray, Page, Sheet

_FRAME_MM = 1.5
"""Inside of the frame's middle line: its pen and the registration's error."""
_BLOCK_MM = (215.0, 80.0)
"""Width and height of the corner in which a title block may lie."""
_SQUARE = 0.05
"""Of its length: how far askew a ruled line may be."""
_PIECE_MM = 3.0
"""Shorter pieces of borders are letters'."""
_RULED_MM = 6.0
"""Shorter joined lines are no part of a table."""
_OFF_MM = 0.5
"""Both borders of a ruled line are joined."""
_BROKEN_MM = 16.0
"""Letters that touch a ruled line break its border this far."""
_MEET_MM = 4.0
"""The block's lines are ruled to their corner no nearer than this."""
_REACH_MM = 18.0
"""The block's lines reach the frame, or end this far from it."""
_EDGE_MM = 2.5
"""Lines nearer to the sheet's right and lower edge are the paper's shadow."""
_LEAST_LINES = 4
"""Top, left and at least two rows."""
_SAMPLES = 64
"""Places along each side of a box: 4096 tell a median to a few per cent."""


@dataclass(frozen=True, slots=True)
class Field:
    """Where on the sheet drawings are looked for.

    Attributes
    ----------
    sheet : the page's map
    boxes : sheet mm, any of them
    block : the title block, left out
    scale : working pixels per full pixel
    """

    sheet: Sheet
    boxes: tuple[Box, ...]
    block: Box | None
    scale: float

    def to_mm(self, points: FloatArray) -> FloatArray:
        """(..., 2) full pixels to sheet millimetres."""
        return mapped(inverted(self.sheet.mm_to_px), points)

    def holds(self, points: FloatArray) -> BoolArray:
        """Which points, (n, 2) mm, are in the field."""
        inside = np.zeros(len(points), dtype=bool)
        for box in self.boxes:
            inside |= _in_box(points, box)
        return inside if self.block is None else inside & ~_in_box(points, self.block)

    def mask(self, shape: tuple[int, ...]) -> BoolArray:
        """The field at the working resolution."""
        picture = np.zeros(shape, dtype=np.uint8)
        for box in self.boxes:
            cv2.fillConvexPoly(picture, self._outline(box), 1)
        if self.block is not None:
            cv2.fillConvexPoly(picture, self._outline(self.block), 0)
        return picture > 0

    def _outline(self, box: Box) -> np.ndarray:
        x, y, w, h = box
        corners = np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]])
        return np.rint((mapped(self.sheet.mm_to_px, corners) + 0.5) * self.scale - 0.5).astype(np.int32)


def brightness(page: Page, sheet: Sheet, boxes: Sequence[Box] | None) -> float:
    """Median of the page, 0..255, at places every few millimetres of where drawings are looked for."""
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    across, down = (share.ravel() for share in np.meshgrid(shares, shares))
    mm = [np.column_stack([x + w * across, y + h * down]) for x, y, w, h in boxes or (_inner(sheet),)]
    last = np.array(page.grey.shape[::-1]) - 1
    column, row = np.clip(np.rint(mapped(sheet.mm_to_px, np.concatenate(mm))), 0, last).astype(np.intp).T
    return float(np.median(page.grey[row, column]))


def _inner(sheet: Sheet) -> Box:
    """The frame's inside, clear of its line."""
    x, y, w, h = sheet.drawable_mm
    return (x + _FRAME_MM, y + _FRAME_MM, w - 2.0 * _FRAME_MM, h - 2.0 * _FRAME_MM)


def field_of(seeds: Seeds, sheet: Sheet, scale: float, boxes: Sequence[Box] | None) -> Field:
    """The frame's inside, or the boxes asked for, without the title block."""
    field = Field(sheet, (_inner(sheet),) if boxes is None else tuple(boxes), None, scale)
    if sheet.zones:
        return field
    return replace(field, block=title_block(field.to_mm(at_full_size(seeds.ends, scale)), sheet))


def title_block(ends: FloatArray, sheet: Sheet) -> Box | None:
    """The ruled table at the bottom right, from pieces of lines (n, 2, 2) mm; None without one.

    Its top line runs to the right side and its left line to the bottom, and the two meet: a plan
    drawn close by is not taken in.
    """
    lines = _ruled(ends, sheet)
    if len(lines) < _LEAST_LINES:
        return None
    low, high = lines.min(axis=1), lines.max(axis=1)
    level = (high - low)[:, 0] > (high - low)[:, 1]
    right, bottom = high.max(axis=0)
    tops = lines[level & (high[:, 0] > right - _REACH_MM)]
    lefts = lines[~level & (high[:, 1] > bottom - _REACH_MM)]
    best: Box | None = None
    for top in tops:
        for left in lefts:
            x, y = float(left[:, 0].mean()), float(top[:, 1].mean())
            meets = abs(top[:, 0].min() - x) < _MEET_MM and abs(left[:, 1].min() - y) < _MEET_MM
            inside = level & (low[:, 1] > y + _MEET_MM / 2.0) & (low[:, 0] > x - _MEET_MM)
            large = best is None or (right - x) * (bottom - y) > best[2] * best[3]
            if meets and large and inside.any():
                best = (x - 1.0, y - 1.0, sheet.page_mm[0] - x + 1.0, sheet.page_mm[1] - y + 1.0)
    return best


def _ruled(ends: FloatArray, sheet: Sheet) -> FloatArray:
    """(m, 2, 2) level and upright lines near the bottom right corner, pieces joined."""
    right, bottom = sheet.page_mm
    span = np.abs(ends[:, 1] - ends[:, 0])
    low, high = ends.min(axis=1), ends.max(axis=1)
    ruled = (span.min(axis=1) < np.maximum(_SQUARE * span.max(axis=1), 0.2)) & (span.max(axis=1) >= _PIECE_MM)
    ruled &= (low[:, 0] > right - _BLOCK_MM[0]) & (low[:, 1] > bottom - _BLOCK_MM[1])
    ruled &= (high[:, 0] < right - _EDGE_MM) & (high[:, 1] < bottom - _EDGE_MM)
    lines = join(ends[ruled], np.ones(int(ruled.sum())), _OFF_MM, _BROKEN_MM).ends
    size = np.abs(lines[:, 1] - lines[:, 0]).max(axis=1)
    return np.asarray(lines[size >= _RULED_MM])


def _in_box(points: FloatArray, box: Box) -> BoolArray:
    x, y, w, h = box
    return np.asarray(
        (points[:, 0] >= x) & (points[:, 0] <= x + w) & (points[:, 1] >= y) & (points[:, 1] <= y + h)
    )
