"""What is not drawing: the frame, what lies outside it, and the title block."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np

from grader.ink.seeds import Seeds
from grader.pixels import BoolArray
from grader.records import Box, FloatArray, Sheet

_FRAME_MM = 1.5
_BLOCK_MM = (215.0, 80.0)
_SQUARE = 0.03
_RULED_MM = 10.0
_TOUCH_MM = 2.0
_LEAST_LINES = 3


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
        return np.rint((to_px(self.sheet, corners) + 0.5) * self.scale - 0.5).astype(np.int32)


def field_of(seeds: Seeds, sheet: Sheet, scale: float, boxes: Sequence[Box] | None) -> Field:
    """The frame's inside, or the boxes asked for, without the title block."""
    x, y, w, h = sheet.drawable_mm
    inner = (x + _FRAME_MM, y + _FRAME_MM, w - 2.0 * _FRAME_MM, h - 2.0 * _FRAME_MM)
    block = None if sheet.zones else title_block(to_mm(sheet, (seeds.ends + 0.5) / scale - 0.5), sheet)
    return Field(sheet, (inner,) if boxes is None else tuple(boxes), block, scale)


def title_block(ends: FloatArray, sheet: Sheet) -> Box | None:
    """The grid of ruled lines at the bottom right, from pieces of lines (n, 2, 2) mm; None without one."""
    right, bottom = sheet.page_mm
    span = np.abs(ends[:, 1] - ends[:, 0])
    length = span.max(axis=1)
    low, high = ends.min(axis=1), ends.max(axis=1)
    ruled = (span.min(axis=1) < np.maximum(_SQUARE * length, 0.3)) & (length >= _RULED_MM)
    ruled &= (low[:, 0] > right - _BLOCK_MM[0]) & (low[:, 1] > bottom - _BLOCK_MM[1])
    x, y, w, h = sheet.drawable_mm
    ruled &= (high[:, 0] < x + w + _TOUCH_MM) & (high[:, 1] < y + h + _TOUCH_MM)
    rows = np.flatnonzero(ruled)
    if len(rows) < _LEAST_LINES:
        return None
    rows = rows[_connected(low[rows] - _TOUCH_MM, high[rows] + _TOUCH_MM)]
    level = span[rows, 0] > span[rows, 1]
    if level.sum() < _LEAST_LINES - 1 or (~level).sum() < 1:
        return None
    x0, y0 = low[rows].min(axis=0) - 1.0
    return (float(x0), float(y0), right - float(x0), bottom - float(y0))


def _connected(low: FloatArray, high: FloatArray) -> BoolArray:
    """Which boxes hang together with the one furthest to the bottom right."""
    member = np.zeros(len(low), dtype=bool)
    member[int(np.argmax(high.sum(axis=1)))] = True
    while True:
        touching = member.copy()
        for row in np.flatnonzero(member):
            touching |= (low <= high[row]).all(axis=1) & (high >= low[row]).all(axis=1)
        if (touching == member).all():
            return member
        member = touching


def _in_box(points: FloatArray, box: Box) -> BoolArray:
    x, y, w, h = box
    return np.asarray(
        (points[:, 0] >= x) & (points[:, 0] <= x + w) & (points[:, 1] >= y) & (points[:, 1] <= y + h)
    )


def to_mm(sheet: Sheet, points: FloatArray) -> FloatArray:
    """(..., 2) full pixels to sheet millimetres."""
    return _mapped(np.linalg.inv(sheet.mm_to_px), points)


def to_px(sheet: Sheet, points: FloatArray) -> FloatArray:
    """(..., 2) sheet millimetres to full pixels."""
    return _mapped(sheet.mm_to_px, points)


def _mapped(homography: FloatArray, points: FloatArray) -> FloatArray:
    flat = points.reshape(-1, 2)
    mapped = np.column_stack([flat, np.ones(len(flat))]) @ homography.T
    return np.asarray((mapped[:, :2] / mapped[:, 2:]).reshape(points.shape))
