"""Where figures lie on a sheet: an independent hand puts poles and sketch where it likes.

How near two placements come to each other by chance is told by the class itself: where a teacher or a
printed sheet says where the pole belongs, everybody's figures lie alike and that says nothing.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from grader.alike.nodes import Drawn
from grader.records import MECHANISM, FloatArray, IntArray
from reference.geometry import ComplexArray

NEAR_MM = 0.5
"""Nearer than this is not told apart."""
RINGS_MM = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Radii within which the class's own placements are counted."""
LAYOUT_MM, LAYOUT_SHARE = 16.0, 0.15
"""A class follows a layout where this share of its pairs has all figures so near. Figures of different
variants on the same poles have it (0.28), free ones do not (0.003), nor does one copy among ten pairs.
"""
LEAST_PAIRS = 10
TRUSTED = 3000.0
"""So many times the class's pairs the rarest placement may be: rarer ones no class can vouch for."""


def place_chance(
    drawn: Mapping[str, Drawn], printed: NDArray[np.bool_], variant: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Log of the chance that two placements come so near, and of what a layout explains.

    Two arrays (students, students). The first is 0 where places are not known. The second is nan for pairs
    of whom few lie in the same places; where the class follows a layout, or those of one variant do,
    it is the first, 0 where places are not known.

    Arguments: which students drew on a `printed` sheet, whose crosses say for each variant where poles
    are best put: there the sketch alone is placed freely. `variant` is each student's, as a number.

    What one figure is shifted by, from one student's sheet to another's, is held against the shift of
    the next: it does not matter how the sheets lay in the scanner.
    """
    shifts = {figure: _shift(one.at) for figure, one in drawn.items()}
    count = len(next(iter(drawn.values())).at)
    apart, freedom = np.zeros((count, count)), np.zeros((count, count), np.int64)
    for first, second in combinations(drawn, 2):
        together = drawn[first].sheet == drawn[second].sheet
        between = np.abs(shifts[first] - shifts[second])
        free = np.ones(len(printed), bool) if MECHANISM in {first, second} else ~printed
        known = np.isfinite(between) & together[:, None] & together[None, :] & free[:, None] & free[None, :]
        apart = np.maximum(apart, np.where(known, between, 0.0))
        freedom += 2 * known
    # Of three figures' distances two are free, beside prescribed poles one.
    most = np.where(printed[:, None] | printed[None, :], 2, 2 * (len(drawn) - 1))
    freedom = np.minimum(freedom, most)
    apart = np.maximum(apart, NEAR_MM)
    same = variant[:, None] == variant[None, :]
    # Those of one variant may have more in common than all.
    chance = _chance(apart, freedom)
    chance = np.where(same, np.maximum(chance, _chance(apart, freedom, same)), chance)
    known = (freedom > 0) & ~np.eye(count, dtype=bool)
    layout = np.full(apart.shape, np.nan)
    for among in (np.ones_like(same), same):
        distances = apart[known & among]
        if len(distances) >= 2 * LEAST_PAIRS and (distances < LAYOUT_MM).mean() > LAYOUT_SHARE:
            layout[among] = chance[among]
    return chance, layout


def _shift(at: ComplexArray) -> ComplexArray:
    """(students, students) by how much a figure is shifted, the median over the nodes that both have."""
    between = at[None, :, :] - at[:, None, :]
    known = np.isfinite(between)
    last = np.maximum(known.sum(axis=2) - 1, 0)[..., None] // 2
    x, y = (
        np.take_along_axis(np.sort(np.where(known, part, np.inf), axis=2), last, axis=2)[..., 0]
        for part in (between.real, between.imag)
    )
    shift = np.full(x.shape, complex(np.nan, np.nan))
    some = np.isfinite(x) & np.isfinite(y)
    shift[some] = x[some] + 1j * y[some]
    return shift


def _chance(apart: FloatArray, freedom: IntArray, among: NDArray[np.bool_] | None = None) -> FloatArray:
    """Log chances, by the densest ring about each placement that the class (or some pairs of it) shows.

    Too few pairs show nothing: 0 for the whole class, no objection (-inf) for some pairs of it.
    """
    chance = np.zeros(apart.shape) if among is None else np.full(apart.shape, -np.inf)
    for dimensions in (2, 4):
        of_these = (freedom == dimensions) & ~np.eye(len(apart), dtype=bool)
        of_these &= True if among is None else among
        if of_these.sum() < 2 * LEAST_PAIRS:
            continue
        pairs = np.maximum(_without_both(of_these), 1.0)
        found = np.full(apart.shape, -np.inf)
        for ring in RINGS_MM:
            others = _without_both(of_these & (apart <= ring))
            if ring == RINGS_MM[-1]:
                others = np.maximum(others, 1.0)
            nearer = dimensions * np.log(np.minimum(apart / ring, 1.0))
            with np.errstate(divide="ignore"):
                found = np.maximum(found, np.log(others / pairs) + nearer)
        least = -np.log(TRUSTED * pairs) if among is None else -np.inf
        chance = np.where(of_these, np.clip(found, least, 0.0), chance)
    return chance


def _without_both(near: NDArray[np.bool_]) -> FloatArray:
    """(students, students) how many pairs there are among all others than these two.

    The pair itself is no evidence on how others place their figures, nor is a third copy of its sheet.
    """
    each = near.sum(axis=1)
    return np.asarray(np.maximum(near.sum() / 2.0 - each[:, None] - each[None, :] + near, 0.0))
