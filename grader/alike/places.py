"""Where figures lie on a sheet: an independent hand puts poles and sketch where it likes.

How near two placements come to each other by chance is told by the class itself: where a teacher or a
printed sheet says where the pole belongs, everybody's figures lie alike and that says nothing.
"""

from collections.abc import Mapping
from itertools import combinations

import numpy as np

from grader.alike.nodes import Drawn
from grader.records import FloatArray, IntArray
from reference.geometry import ComplexArray

NEAR_MM = 0.5
"""Nearer than this is not told apart."""
RINGS_MM = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Radii within which the class's own placements are counted."""
LEAST_PAIRS = 10
TRUSTED = 3000.0
"""So many times the class's pairs the rarest placement may be: rarer ones no class can vouch for."""


def place_chance(drawn: Mapping[str, Drawn]) -> FloatArray:
    """Log of the chance that two placements come so near, for every two students; 0 where not known.

    What one figure is shifted by, from one student's sheet to another's, is held against the shift of
    the next: it does not matter how the sheets lay in the scanner.
    """
    shifts = {figure: _shift(one.at) for figure, one in drawn.items()}
    count = len(next(iter(drawn.values())).at)
    apart, freedom = np.zeros((count, count)), np.zeros((count, count), np.int64)
    for first, second in combinations(drawn, 2):
        together = drawn[first].sheet == drawn[second].sheet
        between = np.abs(shifts[first] - shifts[second])
        known = np.isfinite(between) & together[:, None] & together[None, :]
        apart = np.maximum(apart, np.where(known, between, 0.0))
        freedom += 2 * known
    # Of three figures' distances two are free.
    return _chance(np.maximum(apart, NEAR_MM), np.minimum(freedom, 2 * (len(drawn) - 1)))


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


def _chance(apart: FloatArray, freedom: IntArray) -> FloatArray:
    """Log chances, by the densest ring about each placement that the class shows."""
    chance = np.zeros(apart.shape)
    upper = np.triu(np.ones(apart.shape, bool), 1)
    for dimensions in (2, 4):
        of_these = freedom == dimensions
        pairs = int((of_these & upper).sum())
        if pairs < LEAST_PAIRS:
            continue
        found = np.full(apart.shape, -np.inf)
        for ring in RINGS_MM:
            inside = int((of_these & upper & (apart <= ring)).sum())
            # The pair itself is no evidence on how others place their figures.
            others = np.maximum(inside - (apart <= ring), 1.0 if ring == RINGS_MM[-1] else 0.0)
            with np.errstate(divide="ignore"):
                found = np.maximum(
                    found, np.log(others / pairs) + dimensions * np.log(np.minimum(apart / ring, 1.0))
                )
        chance = np.where(of_these, np.clip(found, -np.log(TRUSTED * pairs), 0.0), chance)
    return chance
