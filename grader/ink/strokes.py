"""Straight strokes of a sheet, from seeds to millimetres."""

from collections.abc import Sequence

import numpy as np

from grader.ink.centreline import Fitted, fit_centre, standard_errors
from grader.ink.components import find_components, mark_boxes
from grader.ink.ending import coverage, find_ends
from grader.ink.joining import join
from grader.ink.regions import kept
from grader.ink.seeds import PX_PER_MM, find_seeds
from grader.pixels import BoolArray, Flat
from grader.records import Box, FloatArray, Sheet, Strokes

_OFF_MM = 0.25
"""Pieces this near to one line are of it; strokes further apart are told apart."""
_GAP_MM = 2.3
_FITTED_OFF_MM = 0.16
_FITTED_GAP_MM = 3.5
"""Gaps of dashed lines, and of lines that stop at a joint's circle and go on behind it."""
_LEAST_MM = 1.0
_LEAST_SUPPORT = 0.3
_SAME_MM = 0.2
_SE_END_MM = 0.2
_SE_MERGED_MM = 1.0


def find_strokes(flat: Flat, sheet: Sheet, boxes: Sequence[Box] | None) -> tuple[Strokes, FloatArray]:
    """(strokes, mark boxes) in sheet millimetres."""
    scale = min(1.0, PX_PER_MM / sheet.px_per_mm)
    seeds = find_seeds(flat.reduced(scale))
    components = find_components(seeds)
    full = (seeds.ends + 0.5) / scale - 0.5
    usable = kept(to_mm(sheet, full), sheet, boxes) & ~components.mark[components.of_seed]
    unit = sheet.px_per_mm
    pieces = join(full[usable], seeds.width[usable] / scale, _OFF_MM * unit, _GAP_MM * unit)
    fitted = _settled(flat, pieces.ends, pieces.width, unit)
    return _records(flat, fitted, sheet), mark_boxes(components, sheet, scale)


def _settled(flat: Flat, ends: FloatArray, width: FloatArray, unit: float) -> tuple[Fitted, BoolArray]:
    """Fit, join what turns out to be one line, find the ends, fit again; no stroke twice."""
    fitted = _sound(fit_centre(flat, ends, width, unit), unit)
    pieces = join(fitted.ends, fitted.width, _FITTED_OFF_MM * unit, _FITTED_GAP_MM * unit)
    fitted = _sound(fit_centre(flat, pieces.ends, pieces.width, unit), unit)
    grown, merged = find_ends(flat, fitted, unit)
    fitted = fitted.with_ends(grown)
    once = distinct(fitted, unit)
    fitted, merged = fitted.take(once), merged[once]
    final = fit_centre(flat, fitted.ends, fitted.width, unit)
    good = (final.support >= _LEAST_SUPPORT) & (final.length >= _LEAST_MM * unit)
    return final.take(good), merged[good]


def _sound(fitted: Fitted, unit: float) -> Fitted:
    return fitted.take((fitted.support >= _LEAST_SUPPORT) & (fitted.length >= 0.8 * _LEAST_MM * unit))


def distinct(fitted: Fitted, unit: float) -> BoolArray:
    """Which strokes do not lie within the ink of a longer one."""
    keep = np.ones(len(fitted), dtype=bool)
    order = np.argsort(-fitted.length)
    for position, longer in enumerate(order):
        if not keep[longer]:
            continue
        shorter = order[position + 1 :]
        shorter = shorter[keep[shorter]]
        origin, span = fitted.ends[longer, 0], fitted.ends[longer, 1] - fitted.ends[longer, 0]
        length = float(np.hypot(*span))
        u = span / max(length, 1e-9)
        relative = fitted.ends[shorter] - origin
        t, d = relative @ u, relative @ np.array([-u[1], u[0]])
        within = (t > -0.5 * unit).all(axis=1) & (t < length + 0.5 * unit).all(axis=1)
        keep[shorter[within & (np.abs(d) < _SAME_MM * unit).all(axis=1)]] = False
    return keep


def _records(flat: Flat, found: tuple[Fitted, BoolArray], sheet: Sheet) -> Strokes:
    fitted, merged = found
    unit = sheet.px_per_mm
    across, angle = standard_errors(fitted, unit)
    return Strokes(
        ends=to_mm(sheet, fitted.ends),
        width=fitted.width / unit,
        se_offset=across / unit,
        se_angle=angle,
        se_end=np.where(merged, _SE_MERGED_MM, _SE_END_MM),
        coverage=coverage(flat, fitted, unit),
        darkness=fitted.darkness,
    )


def to_mm(sheet: Sheet, ends: FloatArray) -> FloatArray:
    """(n, 2, 2) ends from pixels to sheet millimetres."""
    points = np.column_stack([ends.reshape(-1, 2), np.ones(ends.size // 2)])
    mapped = points @ np.linalg.inv(sheet.mm_to_px).T
    return np.asarray((mapped[:, :2] / mapped[:, 2:]).reshape(-1, 2, 2))
