"""Centre lines of strokes to sub-pixel, alone and in bundles of near parallels."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, fields, replace

import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray
from grader.scan.pixels import (
    BoolArray,
    Cuts,
    FittedLines,
    Flat,
    cut_across,
    lengths_and_directions,
    parts,
    robust_lines,
)
from grader.scan.strokes.regions import PROBES, distances, near_pairs

_COUNTS = ((20.0, 64), (6.0, 32), (0.0, 20))
"""Cuts for guesses of more than so many millimetres, the longest first."""
_FINE_COUNTS = ((20.0, 144), (6.0, 64), (0.0, 32))
"""The same for strokes that are known."""
_ROUNDS = 2
"""The second fit of a guess cuts across the line that the first one found."""
_REACH_MM = 0.8
"""Beyond its own width, how far to either side of a stroke its ink may reach in a band."""
_CAPTURE_MM = 0.1
"""Ink beside a guess by more than half its width and this is another's."""
_SINGLE, _THIN = 1.5, 0.4
"""Bounds of a cut's width relative to the pen: wider ink is of several strokes, thinner ink a border."""
_NEAR_MM = 0.18
"""A border of a band belongs to a stroke whose line it puts no farther off."""
_BLOT_WEIGHT = 0.3
"""A border of a band counts less than lone ink: it may be another stroke's."""
_BORDER_WEIGHT = 0.5
"""A border that no other stroke can have tells the middle only with the width known."""
_OUTER_MM = 0.05
"""A border belongs to a stroke that stands out of its neighbours by this much."""
_OFF_MM = 0.35
"""A known stroke's middle is no farther off."""
_TAKEN_MM = 0.13
"""A border that puts a stroke this near to a longer one is the longer one's."""
_TAKEN_PAST_MM, _PAST_MM = 0.3, 0.2
"""Strokes reach so far past their ends: those fitted as guesses, and those that are known."""
_ASIDE_MM = 0.3
"""Beyond their widths, how near strokes come that hide each other's borders."""
_MOST_NEIGHBOURS = 6
"""Those longest beside a stroke; others hide less of it."""
_LONG_MM = 20.0
"""Neighbours of a longer stroke need not be as long as itself."""
_HIDDEN = 0.5
"""Weight of a cut hidden in other strokes, for a stroke that is known to be there."""
_LEAST_CUTS, _LEAST_LONE = 5, 6
"""Cuts that a line needs, and those where a stroke is alone that its width needs."""
_USED = 0.05
"""Least share of its weight that a cut keeps if it agrees with the line."""
_NOISE_MM = 0.03
"""The middle of a stroke's ink is not known better in a single cut."""
_SURE = 0.5
"""Support from which a fitted guess takes its border from shorter ones."""
_SHORT_MM, _SHORT_PENS, _PENS = 8.0, 1.35, 2.4
"""Guesses shorter than this are no wider than so many pens; longer ones than so many."""
_WOBBLE_MM = 2.0
"""A hand's wobble along a ruler keeps its sign over about this length."""
_FLOOR_MM = 0.015
"""Strokes drawn over each other, and a pen that leans, shift the middle of the ink by this much."""
_GUESS_MM = 0.4
"""Guesses are no worse than this: keeps lines that are hidden all along finite."""
_SAME_MM = 0.13
"""Strokes this near to one line, and overlapping, are one."""
_LEAST_JOINED_MM = 6.0
"""Shorter strokes that overlap may be an arrowhead's barbs."""
_ALIKE = 1.35
"""Ratio of darkness up to which strokes may be one: a vector is darker than its construction line."""
_PARALLEL = 1e-6
"""Least cosine by which a crossing is divided."""


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
        return lengths_and_directions(self.ends)[0]

    def take(self, which: BoolArray | NDArray[np.intp]) -> "Fitted":
        """The chosen rows."""
        return Fitted(*(getattr(self, column.name)[which] for column in fields(Fitted)))

    def put(self, rows: NDArray[np.intp], part: "Fitted") -> None:
        """Write the strokes of a part into their rows."""
        for column in fields(Fitted):
            getattr(self, column.name)[rows] = getattr(part, column.name)

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

    Long strokes are fitted first; what is theirs is not the shorter ones'. A short stroke is no wider
    than the sheet's pen allows.
    """
    length_mm = lengths_and_directions(ends)[0] / pen.px_per_mm
    most = np.where(length_mm < _SHORT_MM, _SHORT_PENS, _PENS) * pen.width
    fitted = Fitted(ends.copy(), np.minimum(width, most), *np.zeros((5, len(ends))))
    taken = np.zeros((0, 2, 2))
    for rows, count in _by_length(length_mm, _COUNTS):
        part = fitted.take(rows)
        for _ in range(_ROUNDS):

            def middles(cuts: Cuts, part: Fitted = part, taken: FloatArray = taken) -> _Middles:
                return _of_guesses(cuts, part, taken, pen.px_per_mm)

            part = _fit(flat, part, count, pen.px_per_mm, middles)
            part = replace(part, width=np.minimum(part.width, most[rows]))
        fitted.put(rows, part)
        taken = np.concatenate([taken, part.ends[part.support > _SURE]])
    return fitted


def refined(flat: Flat, fitted: Fitted, pen: Pen) -> Fitted:
    """Strokes fitted anew where they are alone, and by their outer borders where others run beside."""
    if len(fitted) == 0:
        return fitted
    beside = _neighbours(fitted, pen)
    result = fitted.take(np.arange(len(fitted)))
    for rows, count in _by_length(fitted.length / pen.px_per_mm, _FINE_COUNTS):

        def middles(cuts: Cuts, rows: NDArray[np.intp] = rows) -> _Middles:
            return _beside_neighbours(cuts, fitted, rows, beside[rows], pen.px_per_mm)

        old = fitted.take(rows)
        new = _fit(flat, old, count, pen.px_per_mm, middles)
        hidden = new.support == 0.0
        new.ends[hidden], new.noise[hidden] = old.ends[hidden], old.noise[hidden]
        new.support[hidden], new.darkness[hidden] = _HIDDEN * old.support[hidden], old.darkness[hidden]
        width = np.minimum(new.width, np.maximum(old.width, 1.2 * pen.width))
        result.put(rows, replace(new, width=width))
    return result


def rejoined(fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, BoolArray]:
    """((k, 2, 2) ends, (k,) which stay) where strokes that overlap on one line are made one.

    A band showed only its one border at first; refined, its two ends turn out to be of one stroke. What
    only abuts stays apart: a dark vector and its faint construction line.
    """
    ends, stay = fitted.ends.copy(), np.ones(len(fitted), dtype=bool)
    length = fitted.length
    may_join = length > _LEAST_JOINED_MM * px_per_mm
    doubted, others = np.zeros(len(ends), dtype=bool), ends[may_join]
    for part in parts(len(ends), 4 * len(ends)):
        doubted[part] = _goes_on(ends[part, None], others, px_per_mm)[0].any(axis=1)
    for row in np.argsort(-length):
        if not stay[row] or not doubted[row]:
            continue
        same, t = _goes_on(ends[row], ends, px_per_mm)
        ratio = fitted.darkness / max(float(fitted.darkness[row]), 1e-9)
        same &= stay & may_join & (ratio < _ALIKE) & (ratio > 1.0 / _ALIKE)
        if same.any():
            (reach,), (u,) = lengths_and_directions(ends[row][None])
            low, high = min(0.0, float(t[same].min())), max(reach, float(t[same].max()))
            ends[row] = ends[row, 0] + np.array([[low], [high]]) * u
            stay[same] = False
            doubted |= _goes_on(ends, ends[row], px_per_mm)[0]
    return ends, stay


def _goes_on(own: FloatArray, others: FloatArray, px_per_mm: float) -> tuple[BoolArray, FloatArray]:
    """Return whether others lie on their segment's line, beside it and beyond its end; their ends along it.

    Arguments: segments (..., 2, 2) in pairs. A segment does not go on as itself.
    """
    reach, u = lengths_and_directions(own)
    relative = others - own[..., :1, :]
    x, y, ux, uy = relative[..., 0], relative[..., 1], u[..., :1], u[..., 1:]
    t, off = x * ux + y * uy, np.abs(y * ux - x * uy)
    low, high = t.min(axis=-1), t.max(axis=-1)
    overlap = np.minimum(high, reach) - np.maximum(low, 0.0)
    beyond = np.maximum(-low, high - reach)
    near = (off < _SAME_MM * px_per_mm).all(axis=-1)
    return near & (overlap > px_per_mm) & (beyond > px_per_mm), t


def _by_length(
    length_mm: FloatArray, counts: tuple[tuple[float, int], ...]
) -> Iterator[tuple[NDArray[np.intp], int]]:
    """Rows of strokes of like length, the longest first, and how many cuts they get."""
    high = np.inf
    for low, count in counts:
        rows = np.flatnonzero((length_mm > low) & (length_mm <= high))
        high = low
        if len(rows):
            yield rows, count


# One fit ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Middles:
    """Middles of strokes as cuts (k, n) show them.

    Attributes
    ----------
    offset : middle of the stroke across the cut, px
    weight : 1 for lone ink, less for a border alone, 0 for no say
    lone : whether the ink is the stroke's alone
    hidden : whether other strokes hide this one
    """

    offset: FloatArray
    weight: FloatArray
    lone: BoolArray
    hidden: BoolArray


def _fit(flat: Flat, strokes: Fitted, count: int, unit: float, middles: Callable[[Cuts], _Middles]) -> Fitted:
    """The strokes moved onto lines through the middles of `count` cuts each; `unit` is in px/mm."""
    reach = _REACH_MM * unit + float(strokes.width.max())
    cuts = cut_across(flat, strokes.ends, count, reach, 0.5 * strokes.width + _CAPTURE_MM * unit)
    middle = middles(cuts)
    lines = robust_lines(cuts.along, middle.offset, middle.weight, _NOISE_MM * unit)
    known = middle.weight > 0
    agrees = known & (lines.weight > _USED * middle.weight)
    support = agrees.mean(axis=1) + _HIDDEN * middle.hidden.mean(axis=1)
    across, turn = _standard_errors(cuts.along, lines, unit)
    width = np.where(middle.lone.sum(axis=1) >= _LEAST_LONE, _mean_of(cuts.width, middle.lone), strokes.width)
    return Fitted(
        lines.shifted(strokes.ends),
        width,
        lines.scale,
        np.where(known.sum(axis=1) >= _LEAST_CUTS, support, 0.0),
        _mean_of(cuts.dark, known),
        across,
        turn,
    )


def _mean_of(values: FloatArray, which: BoolArray) -> FloatArray:
    """Row means of the values chosen, 0 where none is."""
    return np.asarray(np.where(which, values, 0.0).sum(axis=1) / np.maximum(which.sum(axis=1), 1))


def _standard_errors(
    along: FloatArray, lines: FittedLines, px_per_mm: float
) -> tuple[FloatArray, FloatArray]:
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
    guess = (_GUESS_MM * px_per_mm) ** -2.0
    s0, s1 = weight.sum(axis=1) + guess, (weight * t).sum(axis=1)
    s2 = (weight * t**2).sum(axis=1) + guess * length**2 / 12.0
    determinant = s0 * s2 - s1**2
    across = np.hypot(np.sqrt(s2 / determinant), _FLOOR_MM * px_per_mm)
    turn = np.hypot(np.sqrt(s0 / determinant), np.sqrt(12.0) * _FLOOR_MM * px_per_mm / length)
    return across, turn


# What the cuts say --------------------------------------------------------------------------------


def _middles(
    cuts: Cuts,
    width: FloatArray,
    own: tuple[BoolArray, BoolArray],
    free: tuple[BoolArray, BoolArray],
    unit: float,
) -> _Middles:
    """Lone ink's middle, else a border less half of the width.

    Arguments
    ---------
    own : where the left and the right border stand out of the strokes beside
    free : where a border, if it is a band's, may be this stroke's
    """
    pen, inked = width[:, None], np.isfinite(cuts.left)
    left, right = np.where(inked, cuts.left, 0.0), np.where(inked, cuts.right, 0.0)
    (own_left, own_right), across = own, right - left
    both = inked & own_left & own_right
    lone = both & (across <= _SINGLE * pen) & (across >= _THIN * pen)
    from_left, from_right = left + pen / 2.0, right - pen / 2.0
    left_off, right_off = (
        np.where(may, np.abs(offset), np.inf)
        for may, offset in zip(free, (from_left, from_right), strict=True)
    )
    border = np.where(left_off <= right_off, from_left, from_right)
    blot = both & (across > _SINGLE * pen) & (np.minimum(left_off, right_off) <= _NEAR_MM * unit)
    offset = np.select([lone, both, own_left], [(left + right) / 2.0, border, from_left], from_right)
    sided = inked & (own_left ^ own_right)
    weight = np.select([lone, blot, sided], [1.0, _BLOT_WEIGHT, _BORDER_WEIGHT], 0.0)
    return _Middles(offset, weight, lone, np.zeros_like(inked))


def _of_guesses(cuts: Cuts, guesses: Fitted, taken: FloatArray, unit: float) -> _Middles:
    """Return the middles of guesses by their cuts, where the strokes `taken` (t, 2, 2) are fitted already."""
    every = np.ones(cuts.along.shape, dtype=bool)
    pen = guesses.width[:, None] / 2.0
    offsets = cuts.left + pen, cuts.right - pen
    free = (every.copy(), every.copy())
    reach = _REACH_MM * unit + float(guesses.width.max())
    # A border is within the cut's reach, its stroke's middle not further than as much again.
    first, second = near_pairs(guesses.ends, taken, 2.0 * reach + (_TAKEN_MM + _TAKEN_PAST_MM) * unit)
    for part in parts(len(first), cuts.along.shape[1]):
        row, each = first[part], np.flatnonzero(np.diff(first[part], prepend=-1))
        others = crossings(guesses.ends[row], taken[second[part]], cuts.along[row], _TAKEN_PAST_MM * unit)[0]
        for offset, is_free in zip(offsets, free, strict=True):
            close = np.abs(others - offset[row]) < _TAKEN_MM * unit
            is_free[row[each]] &= ~np.logical_or.reduceat(close, each, axis=0)
    return _middles(cuts, guesses.width, (every, every), free, unit)


def _beside_neighbours(
    cuts: Cuts, strokes: Fitted, rows: NDArray[np.intp], beside: NDArray[np.intp], unit: float
) -> _Middles:
    """Return the middles of some rows of known strokes, whose neighbours are `beside` (k, t), -1 for none."""
    own, there = strokes.ends[rows][:, None], np.maximum(beside, 0)
    at, cosine = crossings(own, strokes.ends[there], cuts.along[:, None], _PAST_MM * unit)
    at = np.where((beside >= 0)[..., None], at, np.inf)
    half = (0.5 * strokes.width[there] / np.abs(cosine))[..., None]
    reaches = np.isfinite(at)
    # Borders of the neighbours that lie in the same ink.
    inked = np.isfinite(cuts.left)[:, None]
    here = reaches & (at - half < np.where(inked, cuts.right[:, None], 0.0))
    here &= at + half > np.where(inked, cuts.left[:, None], 0.0)
    lowest = np.where(here, at - half, np.inf).min(axis=1)
    highest = np.where(here, at + half, -np.inf).max(axis=1)
    width = strokes.width[rows]
    clear = _OUTER_MM * unit - width[:, None] / 2.0
    every = np.ones(cuts.along.shape, dtype=bool)
    middle = _middles(cuts, width, (lowest > clear, highest < -clear), (every, every), unit)
    weight = np.where(np.abs(middle.offset) < _OFF_MM * unit, middle.weight, 0.0)
    hidden = np.isfinite(cuts.left) & reaches.any(axis=1) & (weight == 0.0)
    return replace(middle, weight=weight, hidden=hidden)


def crossings(
    own: FloatArray, others: FloatArray, along: FloatArray, past: float
) -> tuple[FloatArray, FloatArray]:
    """Return where cuts across segments meet others: offset across, inf if they do not; cosine of both.

    Arguments
    ---------
    own, others : (..., 2, 2) segments in pairs
    along : (..., n) distance of the cuts from the own segment's start
    past : how far the others reach beyond their ends
    """
    (_, u), (length, way) = lengths_and_directions(own), lengths_and_directions(others)
    start = others[..., 0, :] - own[..., 0, :]
    sine = u[..., 0] * way[..., 1] - u[..., 1] * way[..., 0]
    cosine = (u * way).sum(axis=-1)
    cosine = np.where(np.abs(cosine) < _PARALLEL, _PARALLEL, cosine)
    x, y = (start * u).sum(axis=-1), start[..., 1] * u[..., 0] - start[..., 0] * u[..., 1]
    at = (along - x[..., None]) / cosine[..., None]
    meets = (at > -past) & (at < length[..., None] + past)
    return np.where(meets, y[..., None] + at * sine[..., None], np.inf), cosine


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
