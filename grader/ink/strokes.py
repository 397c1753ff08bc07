"""Straight strokes of a sheet, from seeds to millimetres."""

from dataclasses import fields

import numpy as np

from grader.ink.centreline import Fitted, fit_centre, standard_errors
from grader.ink.components import Components
from grader.ink.darkness import split_by_darkness
from grader.ink.ending import coverage, find_ends
from grader.ink.joining import Pieces, join
from grader.ink.regions import Field, to_mm
from grader.ink.seeds import PX_PER_MM, Seeds
from grader.pixels import BoolArray, Flat
from grader.records import FloatArray, Sheet, Strokes

_OFF_MM = 0.25
"""Pieces this near to one line are of it; strokes further apart are told apart."""
_GAP_MM = 2.3
_FITTED_OFF_MM = 0.16
_FITTED_GAP_MM = 3.5
"""Gaps of dashed lines, and of lines that stop at a joint's circle and go on behind it."""
_LEAST_DASHED_MM = 7.0
_LEAST_MM = 1.0
_LEAST_SUPPORT = 0.3
_SAME_MM = 0.2
_PROBES = 13
_SHORT_MM = 6.0
_LONG_MM = 8.0
_COVERED = 0.85
_SE_END_MM = 0.8
_SE_MERGED_MM = 2.5
"""Ends err by this much, measured on simulated students: lines run on along their neighbours."""


def find_strokes(flat: Flat, seeds: Seeds, components: Components, field: Field) -> Strokes:
    """Straight strokes in the field, in sheet millimetres."""
    full = (seeds.ends + 0.5) / field.scale - 0.5
    usable = field.holds(to_mm(field.sheet, full.mean(axis=1))) & ~components.mark[components.of_seed]
    pieces = _lines(full, seeds, components, usable, field.scale)
    fitted, merged = _settled(flat, pieces, field.sheet.px_per_mm, seeds.pen_px / field.scale)
    return _records(flat, fitted, merged, field.sheet)


def take(strokes: Strokes, which: BoolArray) -> Strokes:
    """The chosen strokes."""
    return Strokes(*(getattr(strokes, one.name)[which] for one in fields(Strokes)))


def _lines(full: FloatArray, seeds: Seeds, components: Components, usable: BoolArray, scale: float) -> Pieces:
    """Seeds joined to lines; short straight letters stay out unless they line up to a dashed line."""
    unit = PX_PER_MM / scale
    rows = np.flatnonzero(usable)
    pieces = join(full[rows], seeds.width[rows] / scale, _OFF_MM * unit, _GAP_MM * unit)
    dash = components.dash[components.of_seed[rows]]
    only_dashes = np.array([bool(dash[members].all()) for members in pieces.members], dtype=bool)
    span = pieces.ends[:, 1] - pieces.ends[:, 0]
    short = np.hypot(span[:, 0], span[:, 1]) < _LEAST_DASHED_MM * unit
    return pieces.take(~(only_dashes & short))


def _settled(flat: Flat, pieces: Pieces, unit: float, pen: float) -> tuple[Fitted, BoolArray]:
    """Fit, join what turns out to be one line, find the ends, fit again; no stroke twice."""
    fitted = _sound(fit_centre(flat, pieces.ends, pieces.width, unit, pen), unit)
    pen = _pen(fitted, unit, pen)
    pieces = join(fitted.ends, fitted.width, _FITTED_OFF_MM * unit, _FITTED_GAP_MM * unit)
    fitted = _sound(fit_centre(flat, pieces.ends, pieces.width, unit, pen), unit)
    grown, merged = find_ends(flat, fitted, unit)
    parts, owners = split_by_darkness(flat, fitted.with_ends(grown), unit)
    fitted, merged = fitted.take(owners).with_ends(parts), merged[owners]
    once = distinct(fitted, unit)
    fitted, merged = fitted.take(once), merged[once]
    final = fit_centre(flat, fitted.ends, fitted.width, unit, pen)
    # A short guess across a joint or a letter may have slid onto a stroke that is there already.
    good = (
        (final.support >= _LEAST_SUPPORT)
        & (final.length >= _LEAST_MM * unit)
        & distinct(final, unit, _COVERED)
    )
    return final.take(good), merged[good]


def _pen(fitted: Fitted, unit: float, guess: float) -> float:
    """Usual width of the long strokes, px; the guess where there are none."""
    rows = np.flatnonzero(fitted.length >= _LONG_MM * unit)
    if len(rows) == 0:
        return guess
    rows = rows[np.argsort(fitted.width[rows])]
    cumulated = np.cumsum(fitted.length[rows])
    return float(fitted.width[rows[np.searchsorted(cumulated, 0.4 * cumulated[-1])]])


def _sound(fitted: Fitted, unit: float) -> Fitted:
    return fitted.take((fitted.support >= _LEAST_SUPPORT) & (fitted.length >= 0.8 * _LEAST_MM * unit))


def distinct(fitted: Fitted, unit: float, covered_share: float = 1.0) -> BoolArray:
    """Which strokes, longest first, have ink of their own.

    A stroke that lies along a longer one is the same ink; a short one mostly inside others is what
    a joint, an arrowhead or a letter left over.
    """
    keep = np.zeros(len(fitted), dtype=bool)
    share = np.linspace(0.04, 0.96, _PROBES)
    for row in np.argsort(-fitted.length):
        taken = np.flatnonzero(keep)
        points = fitted.ends[row, 0] + share[:, None] * (fitted.ends[row, 1] - fitted.ends[row, 0])
        off = _distance(points, fitted.ends[taken])
        along = (off < _SAME_MM * unit).all(axis=0).any()
        covered = (off < 0.6 * fitted.width[taken]).any(axis=1).mean()
        short = fitted.length[row] < _SHORT_MM * unit
        keep[row] = not along and not (short and covered > covered_share)
    return keep


def _distance(points: FloatArray, ends: FloatArray) -> FloatArray:
    """(p, k) distances of points (p, 2) from segments (k, 2, 2)."""
    span = ends[:, 1] - ends[:, 0]
    squared = np.maximum((span**2).sum(axis=1), 1e-9)
    relative = points[:, None, :] - ends[None, :, 0]
    along = np.clip((relative * span).sum(axis=2) / squared, 0.0, 1.0)
    return np.asarray(np.hypot(*np.moveaxis(relative - along[..., None] * span, 2, 0)))


def _records(flat: Flat, fitted: Fitted, merged: BoolArray, sheet: Sheet) -> Strokes:
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
