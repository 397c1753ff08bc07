"""Strokes fitted to the middle of their ink at full resolution, with standard errors."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grader.pixels import BoolArray, Cuts, Flat, Lines, cut_across, robust_lines
from grader.records import FloatArray

_REACH_MM = 0.9
_CAPTURE_MM = 0.1
_SINGLE = 1.5
_THIN = 0.4
_NEAR_MM = 0.18
_BUNDLED_WEIGHT = 0.3
_WOBBLE_MM = 2.0
"""A hand's wobble along a ruler keeps its sign over about this length."""
_FLOOR_MM = 0.008
_LEAST_CUTS = 6
_USED = 0.05
_COUNTS = ((6.0, 24), (20.0, 64), (np.inf, 160))
"""Cuts for strokes up to so many millimetres long."""


@dataclass(frozen=True, slots=True)
class Fitted:
    """k strokes in full pixels.

    Attributes
    ----------
    ends : (k, 2, 2) on the centre line
    width : (k,) px
    noise : (k,) px, robust standard deviation of the ink's middle about the line
    support : (k,) share of the cuts that agree with the line; 0 where no line was found
    darkness : (k,) contrast to the paper
    """

    ends: FloatArray
    width: FloatArray
    noise: FloatArray
    support: FloatArray
    darkness: FloatArray

    def __len__(self) -> int:
        return len(self.width)

    @property
    def length(self) -> FloatArray:
        """(k,) px."""
        span = self.ends[:, 1] - self.ends[:, 0]
        return np.asarray(np.hypot(span[:, 0], span[:, 1]))

    def take(self, which: BoolArray | NDArray[np.intp]) -> "Fitted":
        """The chosen rows."""
        return Fitted(
            self.ends[which], self.width[which], self.noise[which], self.support[which], self.darkness[which]
        )

    def with_ends(self, ends: FloatArray) -> "Fitted":
        """The same strokes between other ends."""
        return replace(self, ends=ends)


def fit_centre(flat: Flat, ends: FloatArray, width: FloatArray, px_per_mm: float) -> Fitted:
    """Lines through the middle of the ink near guesses (k, 2, 2) of width (k,), in pixels.

    In a band of several strokes a cut has no middle of its own: then the nearer border, less half
    of the pen's width, stands for it.
    """
    span = ends[:, 1] - ends[:, 0]
    length_mm = np.hypot(span[:, 0], span[:, 1]) / px_per_mm
    fitted = Fitted(ends.copy(), width.copy(), np.zeros(len(ends)), np.zeros(len(ends)), np.zeros(len(ends)))
    low = 0.0
    for high, count in _COUNTS:
        rows = np.flatnonzero((length_mm > low) & (length_mm <= high))
        low = high
        if len(rows):
            part = _fit_group(flat, ends[rows], width[rows], px_per_mm, count)
            for name in ("ends", "width", "noise", "support", "darkness"):
                getattr(fitted, name)[rows] = getattr(part, name)
    return fitted


def _fit_group(flat: Flat, ends: FloatArray, width: FloatArray, px_per_mm: float, count: int) -> Fitted:
    for _ in range(2):
        reach = _REACH_MM * px_per_mm + float(width.max())
        cuts = cut_across(flat, ends, count, reach, 0.5 * width + _CAPTURE_MM * px_per_mm)
        middle, weight = _middles(cuts, width, px_per_mm)
        lines = robust_lines(cuts.along, middle, weight, 0.03 * px_per_mm)
        ends = _moved(ends, lines)
        width = _lone_width(cuts, weight, width)
    known = weight > 0
    enough = known.sum(axis=1) >= _LEAST_CUTS
    agrees = known & (lines.weight > _USED * weight)
    support = np.where(enough, agrees.mean(axis=1), 0.0)
    dark = np.where(known, cuts.dark, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return Fitted(ends, width, lines.scale, support, dark)


def _middles(cuts: Cuts, width: FloatArray, px_per_mm: float) -> tuple[FloatArray, FloatArray]:
    """Each cut's offset of the stroke's middle, and its weight: 1 for a lone stroke, 0 for no say."""
    pen = width[:, None]
    seen = np.isfinite(cuts.left)
    across = np.where(seen, cuts.width, 0.0)
    single = seen & (across <= _SINGLE * pen) & (across >= _THIN * pen)
    from_left, from_right = cuts.left + pen / 2.0, cuts.right - pen / 2.0
    nearer = np.where(np.abs(from_left) <= np.abs(from_right), from_left, from_right)
    bundled = seen & (across > _SINGLE * pen) & (np.abs(np.where(seen, nearer, 0.0)) <= _NEAR_MM * px_per_mm)
    middle = np.where(single, cuts.offset, nearer)
    return middle, np.where(single, 1.0, np.where(bundled, _BUNDLED_WEIGHT, 0.0))


def _moved(ends: FloatArray, lines: Lines) -> FloatArray:
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)
    u = span / length[:, None]
    normal = np.column_stack([-u[:, 1], u[:, 0]])
    shift = np.stack([lines.a, lines.a + lines.b * length], axis=1)
    return np.asarray(ends + shift[:, :, None] * normal[:, None, :])


def _lone_width(cuts: Cuts, weight: FloatArray, width: FloatArray) -> FloatArray:
    """Mean width where the stroke is alone; as guessed where it never is."""
    lone = weight == 1.0
    count = lone.sum(axis=1)
    mean = np.where(lone, cuts.width, 0.0).sum(axis=1) / np.maximum(count, 1)
    return np.where(count >= _LEAST_CUTS, mean, width)


def standard_errors(fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, FloatArray]:
    """(across at the middle in px, direction in radians), (k,) each.

    The wobble is averaged only over pieces longer than its own waves, and the pixels' and paper's
    own error stays.
    """
    length = fitted.length
    independent = np.maximum(1.0, fitted.support * length / (_WOBBLE_MM * px_per_mm))
    noise = np.maximum(fitted.noise, _FLOOR_MM * px_per_mm)
    across = np.hypot(noise / np.sqrt(independent), _FLOOR_MM * px_per_mm)
    return across, np.sqrt(12.0) * across / np.maximum(length, 1e-9)
