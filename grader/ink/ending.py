"""Where strokes begin and end: followed outward through their own ink."""

import numpy as np

from grader.ink.centreline import Fitted
from grader.pixels import BoolArray, Flat, cut_across
from grader.records import FloatArray

_BEYOND_MM = 9.0
_INSIDE_MM = 2.0
_STEP_MM = 0.1
_GAP_MM = 0.9
_CROSSING_MM = 1.6
"""Ink whose borders are not the stroke's is passed over this far: another stroke, a letter, a joint."""
_OFF_MM = 0.11
_REACH_MM = 0.8
_INKED = 0.45
"""Of the stroke's own darkness."""
_OWN, _OTHER, _PAPER = 2, 1, 0


def find_ends(flat: Flat, fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, BoolArray]:
    """((k, 2, 2) ends where each stroke's own ink stops, (k, 2) whether other ink goes on there)."""
    span = fitted.ends[:, 1] - fitted.ends[:, 0]
    length = np.maximum(fitted.length, 1e-9)
    u = span / length[:, None]
    ends = fitted.ends.copy()
    merged = np.zeros((len(fitted), 2), dtype=bool)
    inside = np.minimum(_INSIDE_MM * px_per_mm, 0.5 * length)
    count = round((_BEYOND_MM + _INSIDE_MM) / _STEP_MM)
    for side, sign in ((0, -1.0), (1, 1.0)):
        outward = sign * u
        start = fitted.ends[:, side] - inside[:, None] * outward
        reach = start + (_BEYOND_MM + _INSIDE_MM) * px_per_mm * outward
        state = _along(flat, np.stack([start, reach], axis=1), fitted, px_per_mm, count)
        last, other = _last_own(state)
        distance = (last + 1.0) * _STEP_MM * px_per_mm
        ends[:, side] = np.where((last >= 0)[:, None], start + distance[:, None] * outward, ends[:, side])
        merged[:, side] = other
    return ends, merged


def _along(flat: Flat, ends: FloatArray, fitted: Fitted, px_per_mm: float, count: int) -> FloatArray:
    """(k, n) of own ink, other ink or paper along lines from inside a stroke outward."""
    level = _INKED * fitted.darkness
    reach = _REACH_MM * px_per_mm + float(fitted.width.max(initial=1.0))
    cuts = cut_across(flat, ends, count, reach, 0.35 * fitted.width, level)
    seen = np.isfinite(cuts.left)
    pen = fitted.width[:, None]
    limit = np.maximum(_OFF_MM * px_per_mm, 2.0 * fitted.noise)[:, None]
    off = np.minimum.reduce(
        [
            np.abs(np.where(seen, cuts.offset, 0.0)),
            np.abs(np.where(seen, cuts.left + pen / 2.0, 0.0)),
            np.abs(np.where(seen, cuts.right - pen / 2.0, 0.0)),
        ]
    )
    return np.where(seen, np.where(off <= limit, _OWN, _OTHER), _PAPER)


def _last_own(state: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Per row: index of the last own ink before a gap, and whether other ink follows it."""
    gap, crossing = round(_GAP_MM / _STEP_MM), round(_CROSSING_MM / _STEP_MM)
    n = state.shape[1]
    last = np.full(len(state), -1)
    paper = np.zeros(len(state), dtype=int)
    other = np.zeros(len(state), dtype=int)
    going = np.ones(len(state), dtype=bool)
    for index in range(n):
        now = state[:, index]
        own = going & (now == _OWN)
        last[own] = index
        paper = np.where(now == _PAPER, paper + 1, 0)
        other = np.where(now == _OWN, 0, np.where(now == _OTHER, other + 1, other))
        going &= (paper <= gap) & (other <= crossing)
    after = np.minimum(last[:, None] + 1 + np.arange(4)[None, :], n - 1)
    beyond = np.take_along_axis(state, np.maximum(after, 0), axis=1)
    return last, (beyond == _OTHER).sum(axis=1) >= 2


def coverage(flat: Flat, fitted: Fitted, px_per_mm: float, count: int = 100) -> FloatArray:
    """(k,) share of each stroke's length that is inked."""
    cuts = cut_across(
        flat,
        fitted.ends,
        count,
        float(fitted.width.max(initial=1.0)),
        0.4 * fitted.width,
        _INKED * fitted.darkness,
    )
    del px_per_mm
    return np.asarray(np.isfinite(cuts.left).mean(axis=1), dtype=np.float64)
