"""Where strokes begin and end: followed outward through their own ink."""

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from grader.ink.centreline import Fitted
from grader.ink.pairs import near_pairs
from grader.pixels import BoolArray, Flat, cut_across
from grader.records import FloatArray

_BEYOND_MM = 9.0
_INSIDE_MM = 2.0
_STEP_MM = 0.15
_GAP_MM = 0.9
_CROSSING_MM = 1.6
"""Ink whose borders are not the stroke's is passed over this far: another stroke, a letter, a joint."""
_OFF_MM = 0.11
_REACH_MM = 0.8
_INKED = 0.45
"""Of the stroke's own darkness."""
_BAND_MM = 40.0
_BAND_STEP_MM = 0.3
_BAND_GAP, _BAND_PAPER = 5, 0.5
_BAND_OFF_MM = 0.1
_LEAST_BAND_MM = 2.5
"""Ink of two strokes over less than this is a crossing."""
_LEAST_LED_MM = 8.0
_PROBES = np.array([-0.4, 0.0, 0.4])
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
    return last, ((beyond == _OTHER).sum(axis=1) >= 2) | (last >= n - 2)


def through_bands(
    flat: Flat, fitted: Fitted, ends: FloatArray, merged: BoolArray, px_per_mm: float
) -> FloatArray:
    """(k, 2, 2) ends, led on where a stroke ran into another at a small angle.

    Such strokes mostly meet at the node that both lead to: they end where the ink along them does.
    """
    result = ends.copy()
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)
    count = round(_BAND_MM / _BAND_STEP_MM)
    steps = np.asarray((np.arange(count) + 1.0) * _BAND_STEP_MM * px_per_mm, dtype=np.float64)
    for side, sign in ((0, -1.0), (1, 1.0)):
        u = sign * span / length[:, None]
        rows = np.flatnonzero(merged[:, side] & (length > _LEAST_LED_MM * px_per_mm))
        rows = rows[_beside_another(fitted, ends[rows, side], u[rows], rows, px_per_mm)]
        if len(rows) == 0:
            continue
        inked = _inked_on(flat, ends[rows, side], u[rows], steps, fitted.take(rows))
        paper = scipy.ndimage.uniform_filter1d((~inked).astype(np.float32), _BAND_GAP, axis=1, mode="nearest")
        going = np.minimum.accumulate(paper < _BAND_PAPER, axis=1)
        reached = np.where(going & inked, np.arange(1, count + 1), 0).max(axis=1)
        led = (reached * _BAND_STEP_MM > _LEAST_BAND_MM) & (reached < count)
        on = np.where(led, reached * _BAND_STEP_MM * px_per_mm, 0.0)
        result[rows, side] += on[:, None] * u[rows]
    return result


def _beside_another(
    fitted: Fitted, tips: FloatArray, outward: FloatArray, rows: NDArray[np.intp], px_per_mm: float
) -> BoolArray:
    """(m,) whether another stroke runs past each tip, near it both before and behind."""
    span = fitted.ends[:, 1] - fitted.ends[:, 0]
    u = span / np.maximum(fitted.length, 1e-9)[:, None]
    limit = fitted.width + _BAND_OFF_MM * px_per_mm
    reach = _LEAST_BAND_MM * px_per_mm + float(limit.max(initial=0.0))
    first, second = near_pairs(np.stack([tips, tips], axis=1), fitted.ends, reach)
    beside = rows[first] != second
    for way in (-1.0, 0.5):
        at = tips + way * _LEAST_BAND_MM * px_per_mm * outward
        relative = at[first] - fitted.ends[second, 0]
        along = (relative * u[second]).sum(axis=1)
        off = np.abs(relative[:, 0] * u[second, 1] - relative[:, 1] * u[second, 0])
        beside &= (off < limit[second]) & (along > 0) & (along < fitted.length[second])
    result = np.zeros(len(rows), dtype=bool)
    result[first[beside]] = True
    return result


def coverage(flat: Flat, fitted: Fitted, count: int = 100) -> FloatArray:
    """(k,) share of each stroke's length that is inked within 0.4 of its width."""
    share = (np.arange(count) + 0.5) / count
    span = fitted.ends[:, 1] - fitted.ends[:, 0]
    return np.asarray(_inked_on(flat, fitted.ends[:, 0], span, share, fitted).mean(axis=1), dtype=np.float64)


def _inked_on(
    flat: Flat, start: FloatArray, way: FloatArray, steps: FloatArray, strokes: Fitted
) -> BoolArray:
    """(k, n) whether there is ink within 0.4 of each stroke's width of `start + steps way`."""
    size = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    across = _PROBES * (strokes.width / size)[:, None]
    middle = start[:, None] + steps[:, None] * way[:, None]
    x = middle[..., 0, None] - (way[:, 1, None] * across)[:, None, :]
    y = middle[..., 1, None] + (way[:, 0, None] * across)[:, None, :]
    level = flat.contrast(x.reshape(-1, len(_PROBES)), y.reshape(-1, len(_PROBES))).max(axis=1)
    return np.asarray(level.reshape(len(start), len(steps)) > _INKED * strokes.darkness[:, None])
