"""Exact motion in closed form, one Assur group after another.

Positions by Heron's formula and the half chord; velocities and accelerations by eliminating one
unknown of the rigid-body equations of the group (`reference.groups`). This road knows nothing of
drawings: the construction of `reference.construction` is held against it.

Many variants are solved on arrays, a few on Python's numbers (faster there). A predicted error goes
with every result; variants where digits are lost are solved again (`reference.precision`).
"""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import reduce
from typing import Any, cast

import numpy as np
from numpy.typing import NDArray

from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Crank, Driver, Mechanism, moved
from reference.numbers import larger
from reference.precision import EPSILON, LOSSY, refine
from reference.refusal import reason
from reference.solving import Solution, a_stretch, as_it_is, each_number_once, one_variant, solve

SAFETY = 32.0
"""Roundings of the formulas themselves, in units of the data's own; held against 50 digits in tests."""
FEW = 3
"""So many variants are faster one by one, on Python's numbers."""

CLASSES = 200
"""From so many variants on it pays to calculate once what they share."""
MANY, STRETCH = 100_000, 8192
"""From so many variants on, arrays are taken so long at a time: what is between stays near the processor."""

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
    recomputed : (N,) whether the variant was solved again with more digits
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
    if np.isinf(motion.predicted_error.max()):
        raise reason(mechanism, np.isinf(motion.predicted_error))
    return motion


def move_where_possible(mechanism: Mechanism, *, accelerations: bool = True) -> Motion:
    """As `move`, but nan (and an infinite predicted error) for variants without a motion."""
    count, origin = _count(mechanism.driver), _origin(mechanism)
    if origin.any():
        # Far from the coordinates' origin, differences of places lose digits: solved about the driven link.
        motion = _in_doubles(moved(mechanism, -origin), count, accelerations)
        motion.position.update({name: place + origin for name, place in motion.position.items()})
    else:
        motion = _in_doubles(mechanism, count, accelerations)
    if motion.predicted_error.max() > LOSSY:
        with np.errstate(all="ignore"):
            _refine(motion, mechanism, accelerations)
    return motion


def _origin(mechanism: Mechanism) -> ComplexArray:
    """The driven crank's pivot, or a point of the driven slider's guide."""
    driver = mechanism.driver
    return mechanism.ground_m[driver.pivot] if isinstance(driver, Crank) else driver.guide_m


def _refine(motion: Motion, mechanism: Mechanism, accelerations: bool) -> None:
    """More digits for what has lost some; nothing is told of a variant without a motion."""

    def put(solution: Solution, rows: NDArray[np.intp]) -> None:
        _put(motion, solution, rows)

    predicted = motion.predicted_error
    sine = reduce(np.minimum, motion.transmission.values(), np.ones(predicted.shape))
    motion.recomputed[:] = refine(mechanism, predicted, sine, put, accelerations=accelerations)
    broken = np.isinf(predicted)
    if broken.any():
        for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
            for values in rates.values():
                values[broken] = np.nan


def _put(motion: Motion, solution: Solution, rows: NDArray[np.intp] | slice) -> None:
    """Take the solution of some variants over into the motion."""
    for name, joint in solution.joints.items():
        motion.position[name][rows] = _rounded(joint.position)
        motion.velocity[name][rows] = _rounded(joint.velocity)
        if motion.acceleration:
            motion.acceleration[name][rows] = _rounded(joint.acceleration)
    for given, found in (
        (motion.omega, solution.omega),
        (motion.epsilon, solution.epsilon),
        (motion.transmission, solution.transmission),
    ):
        for name in given:
            given[name][rows] = np.real(_rounded(found[name]))


def _rounded(number: Any) -> Any:  # noqa: ANN401 - of extended floats or of many digits
    return number if isinstance(number, np.ndarray) else complex(number)


def _count(driver: Driver) -> int:
    """The number of variants: the widest of the driver's numbers."""
    if isinstance(driver, Crank):
        return max(driver.angle_rad.size, driver.omega.size, driver.length_m.size, driver.epsilon.size)
    return max(driver.displacement_m.size, driver.speed.size, driver.acceleration.size)


def _in_doubles(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    if count <= FEW:
        return _one_by_one(mechanism, count, accelerations)
    with np.errstate(all="ignore"):
        if count < MANY:
            return _on_arrays(mechanism, count, accelerations)
        return _in_stretches(mechanism, count, accelerations)


def _in_stretches(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    """As `_on_arrays`, on a part of the variants after another: intermediate results stay near."""
    motion: Motion | None = None
    for start in range(0, count, STRETCH):
        rows = slice(start, start + STRETCH)
        solution = solve(mechanism, a_stretch(rows), accelerations=accelerations)
        motion = motion or _room_for(solution, count, accelerations)
        _put(motion, solution, rows)
        motion.predicted_error[rows] = _predicted_error(_amplification(solution))
    return cast("Motion", motion)


def _room_for(solution: Solution, count: int, accelerations: bool) -> Motion:
    """A motion not yet filled in, with the names of a solution."""

    def rows(names: Iterable[str], kind: type) -> Any:  # noqa: ANN401 - real or complex
        return {name: np.empty(count, dtype=kind) for name in names}

    return Motion(
        rows(solution.joints, complex),
        rows(solution.joints, complex),
        rows(solution.joints, complex) if accelerations else {},
        rows(solution.omega, float),
        rows(solution.epsilon, float) if accelerations else {},
        rows(solution.transmission, float),
        np.empty(count),
        np.zeros(count, dtype=np.bool_),
    )


def _amplification(solution: Solution) -> Any:  # noqa: ANN401 - an array, or one number
    """By how much a rounding error may have grown anywhere."""
    return reduce(larger, [joint.amplification for joint in solution.joints.values()])


def _predicted_error(amplification: Any) -> FloatArray:  # noqa: ANN401 - an array, or one number
    """What the growth of rounding errors up to a result says of it; infinite where it is nan."""
    predicted = np.atleast_1d(SAFETY * EPSILON * amplification)
    predicted[np.isnan(predicted)] = np.inf
    return predicted


def _on_arrays(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    take = as_it_is if count < CLASSES else each_number_once
    solution = solve(mechanism, take, accelerations=accelerations)
    shape = (count,)

    def wide(values: Any) -> Any:  # noqa: ANN401 - real or complex, array or number
        own = np.shape(values) == shape and values.flags.writeable
        return values if own else np.array(np.broadcast_to(values, shape))

    joints = solution.joints
    predicted = _predicted_error(wide(_amplification(solution)))
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
            solve(mechanism, one_variant(index, among=count), accelerations=accelerations)
            for index in range(count)
        ]
    except (ZeroDivisionError, OverflowError):
        with np.errstate(all="ignore"):
            return _on_arrays(mechanism, count, accelerations)
    first = solutions[0]
    grown = [_amplification(one) for one in solutions]
    predicted = [SAFETY * EPSILON * one if one == one else np.inf for one in grown]  # noqa: PLR0124 - nan
    states = iter(np.array([_states(one) for one in solutions]).T)
    rates = iter(np.array([_rates(one, accelerations) for one in solutions]).T)
    return Motion(
        dict(zip(first.joints, states, strict=False)),
        dict(zip(first.joints, states, strict=False)),
        dict(zip(first.joints if accelerations else (), states, strict=False)),
        dict(zip(first.omega, rates, strict=False)),
        dict(zip(first.epsilon if accelerations else (), rates, strict=False)),
        dict(zip(first.transmission, rates, strict=False)),
        np.array(predicted),
        np.zeros(count, dtype=np.bool_),
    )


def _states(one: Solution) -> list[complex]:
    joints = one.joints.values()
    positions, velocities = [joint.position for joint in joints], [joint.velocity for joint in joints]
    return positions + velocities + [joint.acceleration for joint in joints]


def _rates(one: Solution, accelerations: bool) -> list[float]:
    epsilon = one.epsilon.values() if accelerations else ()
    return [*one.omega.values(), *epsilon, *one.transmission.values()]
