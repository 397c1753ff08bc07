"""Exact motion in closed form, one Assur group after another.

Positions by Heron's formula and the half chord; velocities and accelerations by eliminating one
unknown of the rigid-body equations of the group (`reference.groups`). This road knows nothing of
drawings: the construction of `reference.construction` is held against it.

Many variants are solved on arrays, a few on Python's numbers (faster there). A predicted error goes
with every result; a variant where it exceeds `DOUBTFUL` is solved again in `DIGITS` digits, its
data taken as exact, and refused where even the data do not determine it.
"""

from dataclasses import dataclass
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Crank, Driver, Mechanism
from reference.numbers import larger
from reference.picking import one_variant
from reference.refusal import reason
from reference.solving import Solution, solve

EPSILON = float(np.finfo(np.float64).eps)
SAFETY = 8.0
"""Roundings of the formulas themselves, in units of the data's own; held against 50 digits in tests."""
DOUBTFUL = 1e-9
"""A predicted relative error beyond which a variant is solved again in many digits."""
REFUSED = 1e3
"""A predicted relative error of double precision beyond which the data, doubles themselves, do not
determine the motion: neighbouring doubles have quite another one, or none."""
DIGITS = 50
FEW = 3
"""So many variants are faster one by one, on Python's numbers."""

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Motion:
    """Positions and their derivatives, SI, complex arrays of shape (N,) by joint; links by name.

    Attributes
    ----------
    position, velocity, acceleration : by joint; acceleration empty when not asked for
    omega, epsilon : by link, counter-clockwise positive; epsilon empty when not asked for
    transmission : |sin| of the angle on which each group's accuracy hangs, by its node: 1 is best,
        0 is singular
    predicted_error : (N,) of velocities and accelerations, relative to the largest of each plan;
        infinite where there is no motion
    recomputed : (N,) whether the variant was solved in many digits
    """

    position: dict[str, ComplexArray]
    velocity: dict[str, ComplexArray]
    acceleration: dict[str, ComplexArray]
    omega: dict[str, FloatArray]
    epsilon: dict[str, FloatArray]
    transmission: dict[str, FloatArray]
    predicted_error: FloatArray
    recomputed: BoolArray


def move(mechanism: Mechanism, *, accelerations: bool = True) -> Motion:
    """Solve the mechanism for every variant at once.

    Raises MechanismError naming the group, the first variant (by its index) and by how much the
    group does not assemble, or that its velocities are not determined there.
    """
    motion = move_where_possible(mechanism, accelerations=accelerations)
    if motion.predicted_error.max(initial=0.0) > REFUSED:
        raise reason(mechanism, motion.predicted_error > REFUSED)
    return motion


def move_where_possible(mechanism: Mechanism, *, accelerations: bool = True) -> Motion:
    """As `move`, but nan (and an infinite predicted error) for variants without a motion."""
    count = _count(mechanism.driver)
    if count <= FEW:
        motion = _one_by_one(mechanism, count, accelerations)
    else:
        with np.errstate(all="ignore"):
            motion = _on_arrays(mechanism, count, accelerations)
    predicted = motion.predicted_error
    if predicted.max(initial=0.0) > DOUBTFUL:
        for index in np.flatnonzero((predicted > DOUBTFUL) & (predicted <= REFUSED)):
            _solve_in_digits(motion, mechanism, int(index), accelerations)
        _erase(motion, ~(predicted <= REFUSED))
    return motion


def _count(driver: Driver) -> int:
    """The number of variants: the widest of the driver's numbers."""
    if isinstance(driver, Crank):
        return max(driver.angle_rad.size, driver.omega.size, driver.length_m.size, driver.epsilon.size)
    return max(driver.displacement_m.size, driver.speed.size, driver.acceleration.size)


def _on_arrays(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    solution = solve(mechanism, accelerations=accelerations)
    shape = (count,)

    def wide(values: Any) -> Any:  # noqa: ANN401 - real or complex, array or number
        return values if np.shape(values) == shape else np.array(np.broadcast_to(values, shape))

    joints = solution.joints
    amplification = wide(reduce(larger, [joint.amplification for joint in joints.values()]))
    predicted = np.nan_to_num(SAFETY * EPSILON * amplification, nan=np.inf, copy=False)
    return Motion(
        {name: wide(joint.position) for name, joint in joints.items()},
        {name: wide(joint.velocity) for name, joint in joints.items()},
        {name: wide(joint.acceleration) for name, joint in joints.items()} if accelerations else {},
        {name: wide(+rate) for name, rate in solution.omega.items()},
        {name: wide(+rate) for name, rate in solution.epsilon.items()} if accelerations else {},
        {name: wide(sine) for name, sine in solution.transmission.items()},
        predicted,
        np.zeros(shape, dtype=np.bool_),
    )


def _one_by_one(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    """The same on Python's numbers, a variant after another; where they divide by zero, on arrays."""
    try:
        solutions = [
            solve(mechanism, one_variant(index), accelerations=accelerations) for index in range(count)
        ]
    except (ZeroDivisionError, OverflowError):
        with np.errstate(all="ignore"):
            return _on_arrays(mechanism, count, accelerations)
    first = solutions[0]
    grown = [reduce(larger, [joint.amplification for joint in one.joints.values()]) for one in solutions]
    predicted = [SAFETY * EPSILON * one if one == one else np.inf for one in grown]  # noqa: PLR0124 - nan

    states = np.array(
        [
            [(joint.position, joint.velocity, joint.acceleration) for joint in one.joints.values()]
            for one in solutions
        ]
    )
    position, velocity, acceleration = (
        {name: states[:, row, order] for row, name in enumerate(first.joints)} for order in range(3)
    )

    def links(what: str) -> dict[str, FloatArray]:
        rates: dict[str, float] = getattr(first, what)
        numbers = np.array([list(getattr(one, what).values()) for one in solutions])
        return {name: numbers[:, row] for row, name in enumerate(rates)}

    return Motion(
        position,
        velocity,
        acceleration if accelerations else {},
        links("omega"),
        links("epsilon") if accelerations else {},
        links("transmission"),
        np.array(predicted),
        np.zeros(count, dtype=np.bool_),
    )


def _solve_in_digits(motion: Motion, mechanism: Mechanism, index: int, accelerations: bool) -> None:
    """Put one variant, solved in many digits, in its place; as if beyond all bounds where it has none."""
    from mpmath import mp  # noqa: PLC0415 - seldom needed, and slow to import

    with mp.workdps(DIGITS):
        try:
            take = one_variant(index, mp.mpmathify)
            solution = solve(mechanism, take, accelerations=accelerations)
            _put(motion, solution, index)
        except ZeroDivisionError:
            motion.predicted_error[index] = np.inf
            return
    motion.recomputed[index] = True
    found = (*motion.velocity.values(), *motion.acceleration.values())
    motion.predicted_error[index] = EPSILON if all(np.isfinite(z[index]) for z in found) else np.inf


def _put(motion: Motion, solution: Solution, index: int) -> None:
    for name, joint in solution.joints.items():
        motion.position[name][index] = complex(joint.position)
        motion.velocity[name][index] = complex(joint.velocity)
        if motion.acceleration:
            motion.acceleration[name][index] = complex(joint.acceleration)
    for link, omega in solution.omega.items():
        motion.omega[link][index] = float(omega)
    for link, epsilon in solution.epsilon.items():
        motion.epsilon[link][index] = float(epsilon)
    for node, sine in solution.transmission.items():
        motion.transmission[node][index] = float(sine)


def _erase(motion: Motion, broken: BoolArray) -> None:
    """Nothing is told of a variant without a motion."""
    if not broken.any():
        return
    motion.predicted_error[broken] = np.inf
    for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
        for values in rates.values():
            values[broken] = np.nan
