"""Strokes fitted to the middle of their ink at full resolution, with standard errors."""

from dataclasses import dataclass

import numpy as np

from grader.pixels import BoolArray, Cuts, Flat, cut_across, robust_line
from grader.records import FloatArray

_REACH_MM = 0.9
_SINGLE = 1.5
_NEAR_MM = 0.18
_WOBBLE_MM = 2.0
"""A hand's wobble along a ruler keeps its sign over about this length."""
_FLOOR_MM = 0.008
_LEAST_CUTS = 6
_ROUNDS = 3


@dataclass(frozen=True, slots=True)
class Fitted:
    """One stroke in full pixels: ends on the centre line, and what the cuts say of it."""

    ends: FloatArray
    width: float
    se_offset: float
    se_angle: float
    support: float
    darkness: float


def fit_centre(flat: Flat, ends: FloatArray, width: float, px_per_mm: float) -> Fitted | None:
    """The line through the middle of the ink near a guess, or None where there is no such line.

    In a band of several strokes a cut has no middle of its own: then the nearer border, less half
    of the pen's width, stands for it.
    """
    start, end = ends
    for _ in range(_ROUNDS):
        length = float(np.hypot(*(end - start)))
        if length < 2.0:
            return None
        reach = _REACH_MM * px_per_mm + width
        cuts = cut_across(flat, start, end, reach, 0.5 * width + 0.1 * px_per_mm)
        offset, single = _middles(cuts, width, px_per_mm)
        good = np.isfinite(offset)
        if good.sum() < _LEAST_CUTS:
            return None
        weight = np.where(single[good], 1.0, 0.3)
        a, b, scale, used = robust_line(cuts.along[good], offset[good], 0.03 * px_per_mm, weight)
        u = (end - start) / length
        normal = np.array([-u[1], u[0]])
        start, end = start + a * normal, end + (a + b * length) * normal
        if np.count_nonzero(single) >= _LEAST_CUTS:
            width = float(np.median((cuts.right - cuts.left)[single]))
        if abs(a) + abs(b) * length < 0.05 * px_per_mm:
            break
    return _with_errors(np.stack([start, end]), cuts, good, used, scale, width, px_per_mm)


def _middles(cuts: Cuts, width: float, px_per_mm: float) -> tuple[FloatArray, BoolArray]:
    """Each cut's offset of the stroke's middle (nan where it says nothing), and whether it is a lone
    stroke there."""
    across = cuts.right - cuts.left
    single = np.isfinite(cuts.offset) & (across <= _SINGLE * width) & (across >= 0.4 * width)
    from_left, from_right = cuts.left + width / 2.0, cuts.right - width / 2.0
    nearer = np.where(np.abs(from_left) <= np.abs(from_right), from_left, from_right)
    bundled = np.isfinite(cuts.offset) & (across > _SINGLE * width) & (np.abs(nearer) <= _NEAR_MM * px_per_mm)
    return np.where(single, cuts.offset, np.where(bundled, nearer, np.nan)), single


def _with_errors(
    ends: FloatArray,
    cuts: Cuts,
    good: BoolArray,
    used: FloatArray,
    scale: float,
    width: float,
    px_per_mm: float,
) -> Fitted:
    length = float(np.hypot(*(ends[1] - ends[0])))
    support = float(np.count_nonzero(used > 0.05)) / len(good)
    independent = max(1.0, support * length / (_WOBBLE_MM * px_per_mm))
    noise = max(scale, _FLOOR_MM * px_per_mm)
    se_offset = float(np.hypot(noise / np.sqrt(independent), _FLOOR_MM * px_per_mm))
    se_angle = float(np.sqrt(12.0) * se_offset / length)
    darkness = float(np.median(cuts.dark[good]))
    return Fitted(ends, width, se_offset, se_angle, support, darkness)
