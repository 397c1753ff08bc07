"""Strokes fitted to the middle of their ink at full resolution, with standard errors."""

from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from grader.ink.pairs import near_pairs
from grader.pixels import BoolArray, Cuts, Flat, Lines, cut_across, parts, robust_lines
from grader.records import FloatArray

_REACH_MM = 0.8
_CAPTURE_MM = 0.1
_SINGLE = 1.5
_THIN = 0.4
_NEAR_MM = 0.18
_BUNDLED_WEIGHT = 0.3
_WOBBLE_MM = 2.0
"""A hand's wobble along a ruler keeps its sign over about this length."""
_FLOOR_MM = 0.015
"""Strokes drawn over each other, and a pen that leans, shift the middle of the ink by this much."""
_GUESS_MM = 0.4
_LEAST_CUTS = 6
_SHORT_MM = 8.0
_SHORT_PENS = 1.35
_PENS = 2.4
_USED = 0.05
_COUNTS = ((20.0, 64), (6.0, 32), (0.0, 20))
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
    se_across, se_turn : (k,) standard errors of the place across at the middle, px, and of direction, radians
    """

    ends: FloatArray
    width: FloatArray
    noise: FloatArray
    support: FloatArray
    darkness: FloatArray
    se_across: FloatArray
    se_turn: FloatArray

    def __len__(self) -> int:
        return len(self.width)

    @property
    def length(self) -> FloatArray:
        """(k,) px."""
        span = self.ends[:, 1] - self.ends[:, 0]
        return np.asarray(np.hypot(span[:, 0], span[:, 1]))

    def take(self, which: BoolArray | NDArray[np.intp]) -> "Fitted":
        """The chosen rows."""
        return Fitted(*(getattr(self, one.name)[which] for one in fields(Fitted)))

    def with_ends(self, ends: FloatArray) -> "Fitted":
        """The same strokes between other ends."""
        return replace(self, ends=ends)


@dataclass(frozen=True, slots=True)
class Pen:
    """Resolution and the usual width of the sheet's strokes, px."""

    px_per_mm: float
    width: float


def fit_centre(flat: Flat, ends: FloatArray, width: FloatArray, pen: Pen) -> Fitted:
    """Lines through the middle of the ink near guesses (k, 2, 2) of width (k,), in pixels.

    In a band of several strokes a cut has no middle of its own: then a border, less half of the
    pen's width, stands for it. Long strokes are fitted first; what is theirs is not the shorter
    ones'. A short stroke is no wider than the sheet's pen allows.
    """
    span = ends[:, 1] - ends[:, 0]
    length_mm = np.hypot(span[:, 0], span[:, 1]) / pen.px_per_mm
    most = np.where(length_mm < _SHORT_MM, _SHORT_PENS, _PENS) * pen.width
    width = np.minimum(width, most)
    fitted = Fitted(ends.copy(), width.copy(), *np.zeros((5, len(ends))))
    high, taken = np.inf, np.zeros((0, 2, 2))
    for low, count in _COUNTS:
        rows = np.flatnonzero((length_mm > low) & (length_mm <= high))
        high = low
        if len(rows):
            guess = Guess(ends[rows], width[rows], most[rows], taken, pen.px_per_mm)
            part = _fit_group(flat, guess, count)
            put(fitted, rows, part)
            taken = np.concatenate([taken, part.ends[part.support > _SURE]])
    return fitted


def put(fitted: Fitted, rows: NDArray[np.intp], part: Fitted) -> None:
    """Write the strokes of a part into their rows."""
    for one in fields(Fitted):
        getattr(fitted, one.name)[rows] = getattr(part, one.name)


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
        middle, weight = _middles(cuts, width, (ends, guess.taken, reach), unit)
        lines = robust_lines(cuts.along, middle, weight, 0.03 * unit)
        ends = moved(ends, lines)
        width = np.minimum(lone_width(cuts, weight == 1.0, width), guess.most)
    known = weight > 0
    enough = known.sum(axis=1) >= _LEAST_CUTS
    agrees = known & (lines.weight > _USED * weight)
    support = np.where(enough, agrees.mean(axis=1), 0.0)
    across, turn = standard_errors(cuts.along, lines, unit)
    return Fitted(ends, width, lines.scale, support, mean_of(cuts.dark, known), across, turn)


def mean_of(values: FloatArray, which: BoolArray) -> FloatArray:
    """Row means of the values chosen, 0 where none is."""
    return np.asarray(np.where(which, values, 0.0).sum(axis=1) / np.maximum(which.sum(axis=1), 1))


def _crossings(ends: FloatArray, along: FloatArray, taken: FloatArray, px_per_mm: float) -> FloatArray:
    """(p, n) offset at which each cut of a stroke meets the stroke taken beside it; inf where it does not.

    Arguments: `ends` and `taken` (p, 2, 2) in pairs, `along` (p, n) of the cuts.
    """
    span = ends[:, 1] - ends[:, 0]
    u = span / np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)[:, None]
    normal = np.stack([-u[:, 1], u[:, 0]])[:, :, None]
    way = taken[:, 1] - taken[:, 0]
    length = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    way = (way / length[:, None]).T[:, :, None]
    points = ends[:, None, 0] + along[..., None] * u[:, None, :]
    apart = taken[:, None, 0] - points
    across = normal[0] * way[1] - normal[1] * way[0]
    across = np.where(np.abs(across) < _PARALLEL, _PARALLEL, across)
    offset = (apart[..., 0] * way[1] - apart[..., 1] * way[0]) / across
    at = (apart[..., 0] * normal[1] - apart[..., 1] * normal[0]) / across
    past = _PAST_MM * px_per_mm
    return np.where((at > -past) & (at < length[:, None] + past), offset, np.inf)


def _middles(
    cuts: Cuts, width: FloatArray, strokes: tuple[FloatArray, FloatArray, float], px_per_mm: float
) -> tuple[FloatArray, FloatArray]:
    """Each cut's offset of the stroke's middle, and its weight: 1 for a lone stroke, 0 for no say.

    Arguments: `strokes` are those cut (k, 2, 2), those fitted already (t, 2, 2), and the cuts' reach.
    """
    pen = width[:, None]
    seen = np.isfinite(cuts.left)
    across = np.where(seen, cuts.width, 0.0)
    single = seen & (across <= _SINGLE * pen) & (across >= _THIN * pen)
    from_left, from_right = cuts.left + pen / 2.0, cuts.right - pen / 2.0
    left_taken, right_taken = _taken(cuts.along, (from_left, from_right), strokes, px_per_mm)
    left_off = np.where(left_taken, np.inf, np.abs(from_left))
    right_off = np.where(right_taken, np.inf, np.abs(from_right))
    border = np.where(left_off <= right_off, from_left, from_right)
    near = np.minimum(left_off, right_off) <= _NEAR_MM * px_per_mm
    bundled = seen & (across > _SINGLE * pen) & near
    middle = np.where(single, cuts.offset, border)
    return middle, np.where(single, 1.0, np.where(bundled, _BUNDLED_WEIGHT, 0.0))


def _taken(
    along: FloatArray,
    offsets: tuple[FloatArray, FloatArray],
    strokes: tuple[FloatArray, FloatArray, float],
    px_per_mm: float,
) -> tuple[BoolArray, BoolArray]:
    """(k, n) each, whether a place across is where a stroke fitted already runs."""
    ends, taken, reach = strokes
    result = np.zeros(along.shape, dtype=bool), np.zeros(along.shape, dtype=bool)
    # A border is within the cut's reach, its stroke's middle not further than as much again.
    first, second = near_pairs(ends, taken, 2.0 * reach + (_TAKEN_MM + _PAST_MM) * px_per_mm)
    for part in parts(len(first), along.shape[1]):
        row, each = first[part], np.flatnonzero(np.diff(first[part], prepend=-1))
        others = _crossings(ends[row], along[row], taken[second[part]], px_per_mm)
        for offset, is_taken in zip(offsets, result, strict=True):
            close = np.abs(others - offset[row]) < _TAKEN_MM * px_per_mm
            is_taken[row[each]] |= np.logical_or.reduceat(close, each, axis=0)
    return result


def moved(ends: FloatArray, lines: Lines) -> FloatArray:
    """The strokes shifted onto the lines fitted to their cuts."""
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)
    u = span / length[:, None]
    normal = np.column_stack([-u[:, 1], u[:, 0]])
    shift = np.stack([lines.a, lines.a + lines.b * length], axis=1)
    return np.asarray(ends + shift[:, :, None] * normal[:, None, :])


def lone_width(cuts: Cuts, lone: BoolArray, width: FloatArray) -> FloatArray:
    """Mean width where the stroke is alone; as guessed where it never is."""
    mean = mean_of(cuts.width, lone)
    return np.where(lone.sum(axis=1) >= _LEAST_CUTS, mean, width)


def standard_errors(along: FloatArray, lines: Lines, px_per_mm: float) -> tuple[FloatArray, FloatArray]:
    """(across at the middle in px, direction in radians), (k,) each, of lines through cuts.

    Cuts nearer to each other than the wobble's own waves say nothing new; where a stroke was seen
    alone only at one end, the other end is known the less. The pixels' and paper's own error stays.
    """
    count = along.shape[1]
    length = np.maximum(along[:, 0] + along[:, -1], 1e-9)
    noise = np.maximum(lines.scale, _FLOOR_MM * px_per_mm)
    news = np.minimum(1.0, length / count / (_WOBBLE_MM * px_per_mm))
    weight = lines.weight * (news / noise**2)[:, None]
    t = along - length[:, None] / 2.0
    # Guesses are no worse than this: keeps lines that are hidden all along finite.
    guess = (_GUESS_MM * px_per_mm) ** -2.0
    s0, s1 = weight.sum(axis=1) + guess, (weight * t).sum(axis=1)
    s2 = (weight * t**2).sum(axis=1) + guess * length**2 / 12.0
    determinant = s0 * s2 - s1**2
    across = np.hypot(np.sqrt(s2 / determinant), _FLOOR_MM * px_per_mm)
    turn = np.hypot(np.sqrt(s0 / determinant), np.sqrt(12.0) * _FLOOR_MM * px_per_mm / length)
    return across, turn
