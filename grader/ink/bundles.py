"""Strokes that run together: each is fitted to the borders of the ink that are its own."""

import numpy as np
from numpy.typing import NDArray

from grader.ink.centreline import Fitted, Pen, lone_width, mean_of, moved, put, standard_errors
from grader.ink.pairs import Rows, near_pairs
from grader.pixels import BoolArray, Cuts, Flat, Float32Array, cut_across, parts, robust_lines
from grader.records import FloatArray

PROBES = 13
_SAME_MM = 0.13
_LEAST_JOINED_MM = 6.0
_ALIKE = 1.35
_COUNTS = ((20.0, 144), (6.0, 64), (0.0, 32))
"""Cuts for strokes of more than so many millimetres."""
_REACH_MM = 0.8
_CAPTURE_MM = 0.1
_SINGLE = 1.5
_THIN = 0.4
_BORDER_WEIGHT = 0.5
"""A border tells the middle only with the width known."""
_BLOT_WEIGHT = 0.3
_NEAR_MM = 0.18
_OUTER_MM = 0.05
"""A border belongs to a stroke that stands out of its neighbours by this much."""
_OFF_MM = 0.35
_ASIDE_MM = 0.3
_MOST_NEIGHBOURS = 6
_LONG_MM = 20.0
_PAST_MM = 0.2
_PARALLEL = 1e-6
_HIDDEN = 0.5
"""What a cut hidden in other strokes counts for a stroke that is said to be there."""
_LEAST_CUTS = 5
_USED = 0.05
_NOISE_MM = 0.03


def refined(flat: Flat, fitted: Fitted, pen: Pen) -> Fitted:
    """Strokes fitted anew where they are alone, and by their outer borders where others run beside."""
    if len(fitted) == 0:
        return fitted
    beside = _neighbours(fitted, pen)
    length_mm = fitted.length / pen.px_per_mm
    result, high = fitted.take(np.arange(len(fitted))), np.inf
    for low, count in _COUNTS:
        rows = np.flatnonzero((length_mm > low) & (length_mm <= high))
        high = low
        if len(rows):
            put(result, rows, _fitted(flat, fitted, (rows, beside[rows]), count, pen))
    return result


def rejoined(fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, BoolArray]:
    """((k, 2, 2) ends, (k,) which stay) where strokes that overlap on one line are made one.

    A band told only its one border at first; refined, its two ends turn out to be of one stroke. What
    only abuts stays apart: a dark vector and its faint construction line.
    """
    ends, stay = fitted.ends.copy(), np.ones(len(fitted), dtype=bool)
    length = fitted.length
    for row in np.argsort(-length):
        if not stay[row]:
            continue
        u = (ends[row, 1] - ends[row, 0]) / max(float(np.hypot(*(ends[row, 1] - ends[row, 0]))), 1e-9)
        relative = ends - ends[row, 0]
        t = np.sort(relative @ u, axis=1)
        off = np.abs(relative @ np.array([-u[1], u[0]]))
        reach = float((ends[row, 1] - ends[row, 0]) @ u)
        overlap = np.minimum(t[:, 1], reach) - np.maximum(t[:, 0], 0.0)
        beyond = np.maximum(-t[:, 0], t[:, 1] - reach)
        ratio = fitted.darkness / max(float(fitted.darkness[row]), 1e-9)
        one = stay & (off < _SAME_MM * px_per_mm).all(axis=1) & (overlap > px_per_mm) & (beyond > px_per_mm)
        one &= (length > _LEAST_JOINED_MM * px_per_mm) & (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE)
        one[row] = False
        if one.any():
            low, high = min(0.0, float(t[one].min())), max(reach, float(t[one].max()))
            ends[row] = ends[row, 0] + np.array([[low], [high]]) * u
            stay[one] = False
    return ends, stay


def _fitted(
    flat: Flat, strokes: Fitted, rows: tuple[NDArray[np.intp], NDArray[np.intp]], count: int, pen: Pen
) -> Fitted:
    own, beside = rows
    unit, ends, width = pen.px_per_mm, strokes.ends[own], strokes.width[own]
    reach = _REACH_MM * unit + float(width.max())
    cuts = cut_across(flat, ends, count, reach, 0.5 * width + _CAPTURE_MM * unit)
    low, high = _edges(strokes, own, beside, cuts.along, unit)
    middle, weight, lone = _middles(cuts, width, (low, high), unit)
    lines = robust_lines(cuts.along, middle, weight, _NOISE_MM * unit)
    known = weight > 0
    agrees = known & (lines.weight > _USED * weight)
    hidden = np.isfinite(cuts.left) & np.isfinite(low).any(axis=2) & ~known
    enough = known.sum(axis=1) >= _LEAST_CUTS
    across, turn = standard_errors(cuts.along, lines, unit)
    return Fitted(
        np.where(enough[:, None, None], moved(ends, lines), ends),
        np.minimum(lone_width(cuts, lone, width), np.maximum(width, 1.2 * pen.width)),
        np.where(enough, lines.scale, strokes.noise[own]),
        np.where(enough, agrees.mean(axis=1) + _HIDDEN * hidden.mean(axis=1), strokes.support[own] * _HIDDEN),
        np.where(enough, mean_of(cuts.dark, known), strokes.darkness[own]),
        across,
        turn,
    )


def _middles(
    cuts: Cuts, width: FloatArray, edges: tuple[FloatArray, FloatArray], unit: float
) -> tuple[FloatArray, FloatArray, BoolArray]:
    """Each cut's offset of the stroke's middle, its weight (0 for no say), and whether it is alone there."""
    pen, seen = width[:, None], np.isfinite(cuts.left)
    left, right = np.where(seen, cuts.left, 0.0), np.where(seen, cuts.right, 0.0)
    low, high = edges
    here = (low < right[..., None]) & (high > left[..., None])
    lowest = np.where(here, low, np.inf).min(axis=2, initial=np.inf)
    highest = np.where(here, high, -np.inf).max(axis=2, initial=-np.inf)
    own_left, own_right = lowest > _OUTER_MM * unit - pen / 2.0, highest < pen / 2.0 - _OUTER_MM * unit
    across = right - left
    lone = seen & own_left & own_right & (across <= _SINGLE * pen) & (across >= _THIN * pen)
    from_left, from_right = left + pen / 2.0, right - pen / 2.0
    blot = seen & own_left & own_right & (across > _SINGLE * pen)
    from_blot = np.where(np.abs(from_left) < np.abs(from_right), from_left, from_right)
    middle = np.select([lone, blot, own_left], [(left + right) / 2.0, from_blot, from_left], from_right)
    weight = np.select(
        [lone, blot, seen & (own_left ^ own_right)],
        [1.0, _BLOT_WEIGHT * (np.abs(from_blot) < _NEAR_MM * unit), _BORDER_WEIGHT],
        0.0,
    )
    return middle, np.where(np.abs(middle) < _OFF_MM * unit, weight, 0.0), lone


def _edges(
    strokes: Fitted, own: NDArray[np.intp], beside: NDArray[np.intp], along: FloatArray, unit: float
) -> tuple[FloatArray, FloatArray]:
    """(k, n, t) where the borders of each neighbour cross each cut; infinite where it does not reach."""
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    length = np.maximum(strokes.length, 1e-9)
    u = span / length[:, None]
    there = np.maximum(beside, 0)
    mine, way = u[own][:, None, :], u[there]
    sine = mine[..., 0] * way[..., 1] - mine[..., 1] * way[..., 0]
    cosine = (mine * way).sum(axis=2)
    cosine = np.where(np.abs(cosine) < _PARALLEL, _PARALLEL, cosine)
    start = strokes.ends[there, 0] - strokes.ends[own, 0][:, None, :]
    x, y = (start * mine).sum(axis=2), start[..., 1] * mine[..., 0] - start[..., 0] * mine[..., 1]
    at = (along[:, :, None] - x[:, None, :]) / cosine[:, None, :]
    offset = y[:, None, :] + at * sine[:, None, :]
    past = _PAST_MM * unit
    reached = (at > -past) & (at < length[there][:, None, :] + past) & (beside >= 0)[:, None, :]
    half = (0.5 * strokes.width[there] / np.abs(cosine))[:, None, :]
    return np.where(reached, offset - half, np.inf), np.where(reached, offset + half, -np.inf)


def _neighbours(fitted: Fitted, pen: Pen) -> NDArray[np.intp]:
    """(k, t) strokes that come near each stroke, those longest beside it first; -1 where there are fewer.

    A stroke's neighbours are no shorter than itself: barbs and letters do not tell where a link runs.
    """
    count, width, aside = len(fitted), fitted.width, _ASIDE_MM * pen.px_per_mm
    first, second = near_pairs(fitted.ends, fitted.ends, float(width.max()) + aside)
    near = np.zeros(len(first))
    for part in parts(len(first), PROBES):
        reach = 0.5 * (width[first[part]] + width[second[part]]) + aside
        near[part] = (distances(fitted.ends, first[part], second[part]) < reach[:, None]).mean(axis=1)
    near = np.maximum(near, near[np.argsort(second * count + first)])
    length = np.minimum(fitted.length, _LONG_MM * pen.px_per_mm)
    beside = (near > 0) & (first != second) & (fitted.length[second] >= length[first])
    first, second, near = first[beside], second[beside], near[beside]
    order = np.lexsort((-near, first))
    first, second = first[order], second[order]
    rank = np.arange(len(first)) - np.searchsorted(first, first)
    best = rank < _MOST_NEIGHBOURS
    result = np.full((count, _MOST_NEIGHBOURS), -1, dtype=np.intp)
    result[first[best], rank[best]] = second[best]
    return result


def distances(ends: FloatArray, first: Rows, second: Rows) -> Float32Array:
    """(n, p) distances of places along the `first` (n,) of segments (k, 2, 2) from the `second`."""
    ends = ends.astype(np.float32)
    share = np.linspace(0.04, 0.96, PROBES, dtype=np.float32)
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), np.float32(1e-6))
    u = span / length[:, None]
    points = ends[:, None, 0] + share[:, None] * span[:, None, :]
    x = points[first, :, 0] - ends[second, 0, 0, None]
    y = points[first, :, 1] - ends[second, 0, 1, None]
    u = u[second, :, None]
    along = x * u[:, 0] + y * u[:, 1]
    along -= np.clip(along, np.float32(0.0), length[second, None])
    across = x * u[:, 1] - y * u[:, 0]
    return np.asarray(np.hypot(along, across))
