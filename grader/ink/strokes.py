"""Straight strokes of a sheet, from seeds to millimetres."""

from collections.abc import Sequence

import numpy as np

from grader.ink.centreline import Fitted, fit_centre
from grader.ink.ending import find_ends
from grader.ink.joining import join
from grader.ink.regions import kept, mark_boxes
from grader.ink.seeds import PX_PER_MM, find_seeds
from grader.pixels import Flat
from grader.records import Box, FloatArray, Sheet, Strokes

_LEAST_MM = 1.0
_LEAST_SUPPORT = 0.3
_SE_END_MM = 0.3


def find_strokes(flat: Flat, sheet: Sheet, boxes: Sequence[Box] | None) -> tuple[Strokes, FloatArray]:
    """(strokes, mark boxes) in sheet millimetres."""
    scale = min(1.0, PX_PER_MM / sheet.px_per_mm)
    seeds = find_seeds(flat.reduced(scale))
    pieces = join(seeds.ends, seeds.width)
    full = (pieces.ends + 0.5) / scale - 0.5
    inside = kept(to_mm(sheet, full), sheet, boxes)
    fitted = []
    for ends, width in zip(full[inside], pieces.width[inside] / scale, strict=True):
        one = _fitted(flat, ends, float(width), sheet.px_per_mm)
        if one is not None:
            fitted.append(one)
    found = as_strokes(fitted, sheet)
    marks = mark_boxes(seeds.mask, found, sheet, scale)
    return found, marks


def _fitted(flat: Flat, ends: FloatArray, width: float, px_per_mm: float) -> tuple[Fitted, float] | None:
    first = fit_centre(flat, ends, width, px_per_mm)
    if first is None or first.support < _LEAST_SUPPORT:
        return None
    grown, coverage = find_ends(flat, first.ends, first.width, first.darkness, px_per_mm)
    length = float(np.hypot(*(grown[1] - grown[0])))
    if length < _LEAST_MM * px_per_mm:
        return None
    again = fit_centre(flat, grown, first.width, px_per_mm)
    return None if again is None else (again, coverage)


def as_strokes(fitted: Sequence[tuple[Fitted, float]], sheet: Sheet) -> Strokes:
    """Records of fitted strokes, in millimetres."""
    scale = sheet.px_per_mm
    ends = np.array([one.ends for one, _ in fitted]).reshape(-1, 2, 2)
    return Strokes(
        ends=to_mm(sheet, ends),
        width=np.array([one.width for one, _ in fitted]) / scale,
        se_offset=np.array([one.se_offset for one, _ in fitted]) / scale,
        se_angle=np.array([one.se_angle for one, _ in fitted]),
        se_end=np.full((len(fitted), 2), _SE_END_MM),
        coverage=np.array([coverage for _, coverage in fitted]),
        darkness=np.array([one.darkness for one, _ in fitted]),
    )


def to_mm(sheet: Sheet, ends: FloatArray) -> FloatArray:
    """(n, 2, 2) ends from pixels to sheet millimetres."""
    points = np.column_stack([ends.reshape(-1, 2), np.ones(ends.size // 2)])
    mapped = points @ np.linalg.inv(sheet.mm_to_px).T
    return np.asarray((mapped[:, :2] / mapped[:, 2:]).reshape(-1, 2, 2))
