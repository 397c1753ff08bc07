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
from reference.solving import Solution, one_variant, solve, some_variants

EPSILON = float(np.finfo(np.float64).eps)
EXTENDED = float(np.finfo(np.longdouble).eps)
"""As `EPSILON` where the processor or compiler has no wider floats."""
LOSSY = 1e-9
"""A predicted relative error from which a variant is solved again: 4e-7 mm in a plan of 400 mm, which nobody
can draw. Ordinary mechanisms stay far below, and solving again takes ten times as long."""
EXTENDED_ENOUGH = LOSSY * EPSILON / EXTENDED
"""A predicted relative error up to which extended floats bring it below `LOSSY`; beyond, eighty digits."""
LEAST_SINE = 8e-16
"""Of a transmission angle; below it (as between guides at 0 and 180 degrees) nothing is told: the data's
last digit decides how the mechanism moves."""
DIGITS = 80

Put = Callable[[Solution, NDArray[np.intp]], None]
"""Takes a solution of some variants over into the motion."""


def refine(
    mechanism: Mechanism, predicted: FloatArray, sine: FloatArray, put: Put, *, accelerations: bool
) -> NDArray[np.bool_]:
    """Solve again what has lost digits, and say which variants those were.

    `predicted` (N,) is brought up to date in place: infinite where there is no solution. `sine` (N,) is
    the least of each variant's transmission angles.
    """
    predicted[~(sine >= LEAST_SINE)] = np.inf
    again = (predicted > LOSSY) & np.isfinite(predicted)
    wide = again & (predicted <= EXTENDED_ENOUGH)
    rows = np.flatnonzero(wide)
    if rows.size:
        put(solve(mechanism, some_variants(rows), accelerations=accelerations, anew=True), rows)
        predicted[rows] = np.maximum(predicted[rows] * (EXTENDED / EPSILON), EPSILON)
    for index in np.flatnonzero(again & ~wide):
        row = np.array([index])
        solution = _in_digits(mechanism, int(index), accelerations)
        predicted[index] = EPSILON if solution is not None else np.inf
        if solution is not None:
            put(solution, row)
    return again


def _in_digits(mechanism: Mechanism, index: int, accelerations: bool) -> Solution | None:
    """One variant in eighty digits; None where it divides by zero even so, or does not close."""
    from mpmath import mp  # noqa: PLC0415 - seldom needed, and slow to import

    with mp.workdps(DIGITS):
        try:
            solution = solve(
                mechanism, one_variant(index, mp.mpmathify), accelerations=accelerations, anew=True
            )
        except ZeroDivisionError:
            return None
    rates: list[Any] = [
        number for joint in solution.joints.values() for number in (joint.velocity, joint.acceleration)
    ]
    return solution if all(mp.isfinite(rate) for rate in rates) else None
