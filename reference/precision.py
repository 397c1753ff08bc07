"""Variants near a singular position, solved again with more digits, their data (doubles) taken as exact.

First in the processor's extended floating point, on arrays, where it has one; where that is not enough,
in eighty digits one by one. The closed forms are the same: only the numbers differ.
"""

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.geometry import FloatArray
from reference.mechanism import Mechanism
from reference.picking import one_variant, some_variants
from reference.solving import Solution, solve

EPSILON = float(np.finfo(np.float64).eps)
EXTENDED = float(np.finfo(np.longdouble).eps)
"""As `EPSILON` where the processor or compiler has no wider floats."""
LOSSY = 3e-14
"""A predicted relative error from which extended floats are used: a digit or two are gone."""
DOUBTFUL = 1e-11
"""A predicted relative error from which eighty digits are used."""
REFUSED = 1e16
"""A predicted relative error beyond which nothing is told: the sine of a transmission angle is then
below 1e-15 (as between guides at 0 and 180 degrees), and the data's last digit decides how it moves."""
DIGITS = 80

Put = Callable[[Solution, NDArray[np.intp]], None]
"""Takes a solution of some variants over into the motion."""


def refine(
    mechanism: Mechanism, predicted: FloatArray, put: Put, *, accelerations: bool
) -> NDArray[np.bool_]:
    """Solve again what has lost digits, and say which variants those were.

    `predicted` (N,) is brought up to date in place: infinite where there is no solution.
    """
    again = (predicted > LOSSY) & (predicted <= REFUSED)
    if EXTENDED < EPSILON:
        rows = np.flatnonzero(again & (predicted <= DOUBTFUL))
        if rows.size:
            put(solve(mechanism, some_variants(rows), accelerations=accelerations), rows)
            predicted[rows] = np.maximum(predicted[rows] * (EXTENDED / EPSILON), EPSILON)
    else:
        again &= predicted > DOUBTFUL
    for index in np.flatnonzero(again & (predicted > DOUBTFUL)):
        row = np.array([index])
        solution = _in_digits(mechanism, int(index), accelerations)
        predicted[index] = EPSILON if solution is not None else np.inf
        if solution is not None:
            put(solution, row)
    predicted[~(predicted <= REFUSED)] = np.inf
    return again


def _in_digits(mechanism: Mechanism, index: int, accelerations: bool) -> Solution | None:
    """One variant in eighty digits; None where it divides by zero even so, or does not close."""
    from mpmath import mp  # noqa: PLC0415 - seldom needed, and slow to import

    with mp.workdps(DIGITS):
        try:
            solution = solve(mechanism, one_variant(index, mp.mpmathify), accelerations=accelerations)
        except ZeroDivisionError:
            return None
    rates: list[Any] = [
        number for joint in solution.joints.values() for number in (joint.velocity, joint.acceleration)
    ]
    return solution if all(mp.isfinite(rate) for rate in rates) else None
