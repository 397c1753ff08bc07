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
_FLOOR_MM = 0.015
"""Strokes drawn over each other, and a pen that leans, shift the middle of the ink by this much."""
_LEAST_CUTS = 6
_SHORT_MM = 8.0
_SHORT_PENS = 1.35
_PENS = 2.4
_USED = 0.05
_COUNTS = ((20.0, 160), (6.0, 64), (0.0, 24))
"""Cuts for strokes of more than so many millimetres, the longest first."""
_SURE = 0.5
_TAKEN_MM = 0.13
_PARALLEL = 1e-6
_PAST_MM = 0.3


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


def fit_centre(flat: Flat, ends: FloatArray, width: FloatArray, px_per_mm: float, pen_px: float) -> Fitted:
    """Lines through the middle of the ink near guesses (k, 2, 2) of width (k,), in pixels.

    In a band of several strokes a cut has no middle of its own: then a border, less half of the
    pen's width, stands for it. Long strokes are fitted first; what is theirs is not the shorter
    ones'. A short stroke is no wider than the sheet's pen, `pen_px`, allows.
    """
    span = ends[:, 1] - ends[:, 0]
    length_mm = np.hypot(span[:, 0], span[:, 1]) / px_per_mm
    most = np.where(length_mm < _SHORT_MM, _SHORT_PENS, _PENS) * pen_px
    width = np.minimum(width, most)
    fitted = Fitted(ends.copy(), width.copy(), np.zeros(len(ends)), np.zeros(len(ends)), np.zeros(len(ends)))
    high, taken = np.inf, np.zeros((0, 2, 2))
    for low, count in _COUNTS:
        rows = np.flatnonzero((length_mm > low) & (length_mm <= high))
        high = low
        if len(rows):
            guess = Guess(ends[rows], width[rows], most[rows], taken, px_per_mm)
            part = _fit_group(flat, guess, count)
            for name in ("ends", "width", "noise", "support", "darkness"):
                getattr(fitted, name)[rows] = getattr(part, name)
            taken = np.concatenate([taken, part.ends[part.support > _SURE]])
    return fitted


@dataclass(frozen=True, slots=True)
class Guess:
    """Strokes to fit: ends, widths and the most they may be, px; longer strokes fitted already."""

    ends: FloatArray
    width: FloatArray
    most: FloatArray
    taken: FloatArray
    px_per_mm: float


def _fit_group(flat: Flat, guess: Guess, count: int) -> Fitted:
    ends, width, unit = guess.ends, guess.width, guess.px_per_mm
    for _ in range(2):
        reach = _REACH_MM * unit + float(width.max())
        cuts = cut_across(flat, ends, count, reach, 0.5 * width + _CAPTURE_MM * unit)
        others = _crossings(ends, cuts.along, guess.taken, unit)
        middle, weight = _middles(cuts, width, others, unit)
        lines = robust_lines(cuts.along, middle, weight, 0.03 * unit)
        ends = _moved(ends, lines)
        width = np.minimum(_lone_width(cuts, weight, width), guess.most)
    known = weight > 0
    enough = known.sum(axis=1) >= _LEAST_CUTS
    agrees = known & (lines.weight > _USED * weight)
    support = np.where(enough, agrees.mean(axis=1), 0.0)
    dark = np.where(known, cuts.dark, 0.0).sum(axis=1) / np.maximum(known.sum(axis=1), 1)
    return Fitted(ends, width, lines.scale, support, dark)


def _crossings(ends: FloatArray, along: FloatArray, taken: FloatArray, px_per_mm: float) -> FloatArray:
    """(k, n, t) offset at which each cut meets each stroke fitted already; inf where it does not."""
    span = ends[:, 1] - ends[:, 0]
    u = span / np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)[:, None]
    normal = np.column_stack([-u[:, 1], u[:, 0]])
    way = taken[:, 1] - taken[:, 0]
    length = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    way = way / length[:, None]
    points = ends[:, None, 0] + along[..., None] * u[:, None, :]
    apart = taken[None, None, :, 0] - points[:, :, None, :]
    across = normal[:, None, 0] * way[None, :, 1] - normal[:, None, 1] * way[None, :, 0]
    across = np.where(np.abs(across) < _PARALLEL, _PARALLEL, across)[:, None, :]
    offset = (apart[..., 0] * way[:, 1] - apart[..., 1] * way[:, 0]) / across
    at = (apart[..., 0] * normal[:, None, None, 1] - apart[..., 1] * normal[:, None, None, 0]) / across
    past = _PAST_MM * px_per_mm
    return np.where((at > -past) & (at < length + past), offset, np.inf)


def _middles(
    cuts: Cuts, width: FloatArray, others: FloatArray, px_per_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Each cut's offset of the stroke's middle, and its weight: 1 for a lone stroke, 0 for no say."""
    pen = width[:, None]
    seen = np.isfinite(cuts.left)
    across = np.where(seen, cuts.width, 0.0)
    single = seen & (across <= _SINGLE * pen) & (across >= _THIN * pen)
    from_left, from_right = cuts.left + pen / 2.0, cuts.right - pen / 2.0
    left_off = np.where(_is_other(from_left, others, px_per_mm), np.inf, np.abs(from_left))
    right_off = np.where(_is_other(from_right, others, px_per_mm), np.inf, np.abs(from_right))
    border = np.where(left_off <= right_off, from_left, from_right)
    near = np.minimum(left_off, right_off) <= _NEAR_MM * px_per_mm
    bundled = seen & (across > _SINGLE * pen) & near
    middle = np.where(single, cuts.offset, border)
    return middle, np.where(single, 1.0, np.where(bundled, _BUNDLED_WEIGHT, 0.0))


def _is_other(offset: FloatArray, others: FloatArray, px_per_mm: float) -> BoolArray:
    """(k, n) whether a place across is where a stroke fitted already runs."""
    if others.shape[2] == 0:
        return np.zeros(offset.shape, dtype=bool)
    return np.asarray((np.abs(others - offset[..., None]) < _TAKEN_MM * px_per_mm).any(axis=2))


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
