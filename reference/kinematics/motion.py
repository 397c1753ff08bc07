"""Exact motion in closed form, one Assur group after another.

Positions by Heron's formula and the half chord; velocities and accelerations by eliminating one
unknown of the rigid-body equations of the group (`reference.kinematics.assur`). This method does not use
drawings: tests compare the construction of `reference.construction.graph` with it.

Many variants are solved on arrays, a few on Python's numbers (faster there). Every result has a
predicted error. Variants near a singular position are solved again with more digits, their data
(doubles) taken as exact: first in the processor's extended floating point, on arrays, where it has
one; where that is not enough, in eighty digits one by one. Where a mechanism has no motion, the
error says which group fails to close, by how much, and what to do.
"""

import math
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.errors import MechanismError
from reference.geometry import ComplexArray, FloatArray
from reference.kinematics.solving import (
    Solution,
    as_it_is,
    directions_of,
    each_number_once,
    one_variant,
    rail_of,
    solve,
    some_variants,
)
from reference.mechanism import (
    Crank,
    CrossSlider,
    Driver,
    Dyad,
    Group,
    Mechanism,
    Plate,
    Slider,
    SlottedLink,
    Triad,
    Yoke,
    translated,
)
from reference.numbers import cross, larger

EPSILON = float(np.finfo(np.float64).eps)
SAFETY = 32.0
"""Rounding errors of the formulas in units of those of the data; tests compare them with 50 digits."""
FEW = 3
"""Up to this many variants, Python's numbers are faster than arrays."""
CLASSES = 200
"""From this many variants on, computing shared quantities once saves time."""
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
    """Return the motion of every variant; nan, with an infinite predicted error, for those without one."""
    count, origin = _count(mechanism.driver), _origin(mechanism)
    if origin.any():
        # Far from the origin, differences of positions lose digits: solve about the driving link.
        motion = _in_doubles(translated(mechanism, -origin), count, accelerations)
        motion.position.update({name: place + origin for name, place in motion.position.items()})
    else:
        motion = _in_doubles(mechanism, count, accelerations)
    if motion.predicted_error.max() > LOSSY:
        with np.errstate(all="ignore"):
            _refine(motion, mechanism, accelerations)
    return motion


def _origin(mechanism: Mechanism) -> ComplexArray:
    """The driving crank's pivot, or a point of the driving slider's guide."""
    driver = mechanism.driver
    return mechanism.ground_m[driver.pivot] if isinstance(driver, Crank) else driver.guide_m


def _count(driver: Driver) -> int:
    """The number of variants: the widest of the driver's numbers."""
    if isinstance(driver, Crank):
        return max(driver.angle_rad.size, driver.omega.size, driver.length_m.size, driver.epsilon.size)
    return max(driver.displacement_m.size, driver.speed.size, driver.acceleration.size)


# In doubles: on arrays, or on Python's numbers -----------------------------------------------------


def _in_doubles(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    if count <= FEW:
        return _in_python_numbers(mechanism, count, accelerations)
    with np.errstate(all="ignore"):
        return _on_arrays(mechanism, count, accelerations)


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


def _in_python_numbers(mechanism: Mechanism, count: int, accelerations: bool) -> Motion:
    """Solve a few variants on Python's numbers; if these divide by zero, on arrays."""
    try:
        solutions = [
            solve(mechanism, one_variant(index, among=count), accelerations=accelerations)
            for index in range(count)
        ]
    except (ZeroDivisionError, OverflowError):
        with np.errstate(all="ignore"):
            return _on_arrays(mechanism, count, accelerations)
    first = solutions[0]
    grown = [_amplification(solution) for solution in solutions]
    predicted = [np.inf if math.isnan(times) else SAFETY * EPSILON * times for times in grown]
    # One complex and one real array are faster than one array for each joint.
    states = iter(np.array([_states(solution) for solution in solutions]).T)
    rates = iter(np.array([_rates(solution, accelerations) for solution in solutions]).T)
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


def _states(solution: Solution) -> list[complex]:
    joints = solution.joints.values()
    positions, velocities = [joint.position for joint in joints], [joint.velocity for joint in joints]
    return positions + velocities + [joint.acceleration for joint in joints]


def _rates(solution: Solution, accelerations: bool) -> list[float]:
    epsilon = solution.epsilon.values() if accelerations else ()
    return [*solution.omega.values(), *epsilon, *solution.transmission.values()]


def _amplification(solution: Solution) -> Any:  # noqa: ANN401 - an array, or one number
    """The largest amplification of a rounding error at any joint."""
    return reduce(larger, [joint.amplification for joint in solution.joints.values()])


def _predicted_error(amplification: FloatArray) -> FloatArray:
    """(N,) predicted error from the amplification of rounding errors; infinite where that is nan."""
    predicted = SAFETY * EPSILON * amplification
    return np.where(np.isnan(predicted), np.inf, predicted)


# Again with more digits, near a singular position --------------------------------------------------

EXTENDED = float(np.finfo(np.longdouble).eps)
"""Relative precision of extended floats; equal to `EPSILON` if the processor or compiler has none wider."""
LOSSY = 1e-9
"""A predicted relative error from which a variant is solved again: 4e-7 mm in a plan of 400 mm, which nobody
can draw. Ordinary mechanisms stay far below, and solving again takes ten times as long."""
EXTENDED_ENOUGH = LOSSY * EPSILON / EXTENDED
"""A predicted relative error up to which extended floats bring it below `LOSSY`; beyond, eighty digits."""
LEAST_SINE = 8e-16
"""Least sine of a transmission angle; below it (guides at 0 and 180 degrees) there is no solution: the data's
last digit decides how the mechanism moves.
"""
DIGITS = 80
"""Decimal digits of the last resort."""


def _refine(motion: Motion, mechanism: Mechanism, accelerations: bool) -> None:
    """Solve the variants that have lost digits again, in place; nan for a variant without motion."""
    predicted = motion.predicted_error
    sine = reduce(np.minimum, motion.transmission.values(), np.ones(predicted.shape))
    motion.recomputed[:], solutions = refined(mechanism, predicted, sine, accelerations=accelerations)
    for solution, rows in solutions:
        _replace_rows(motion, solution, rows)
    broken = np.isinf(predicted)
    for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
        for values in rates.values():
            values[broken] = np.nan


def refined(
    mechanism: Mechanism, predicted: FloatArray, sine: FloatArray, *, accelerations: bool
) -> tuple[NDArray[np.bool_], list[tuple[Solution, NDArray[np.intp]]]]:
    """Return which variants have lost digits, and their new solutions with the rows that each is for.

    Arguments
    ---------
    predicted : (N,) relative errors; brought up to date in place, infinite where there is no solution
    sine : (N,) the least of each variant's transmission angles
    """
    predicted[~(sine >= LEAST_SINE)] = np.inf
    again = (predicted > LOSSY) & np.isfinite(predicted)
    wide = again & (predicted <= EXTENDED_ENOUGH)
    solutions = []
    rows = np.flatnonzero(wide)
    if rows.size:
        solutions.append(
            (solve(mechanism, some_variants(rows), accelerations=accelerations, anew=True), rows)
        )
        predicted[rows] = np.maximum(predicted[rows] * (EXTENDED / EPSILON), EPSILON)
    for index in np.flatnonzero(again & ~wide):
        solution = _in_digits(mechanism, int(index), accelerations)
        predicted[index] = EPSILON if solution is not None else np.inf
        if solution is not None:
            solutions.append((solution, np.array([index])))
    return again, solutions


def _in_digits(mechanism: Mechanism, index: int, accelerations: bool) -> Solution | None:
    """Solve one variant in eighty digits; None if it still divides by zero, or does not close."""
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
    is_flat = any(sine < LEAST_SINE for sine in solution.transmission.values())
    return solution if all(mp.isfinite(rate) for rate in rates) and not is_flat else None


def _replace_rows(motion: Motion, solution: Solution, rows: NDArray[np.intp]) -> None:
    """Replace the motion of some variants by their solution."""
    for name, joint in solution.joints.items():
        motion.position[name][rows] = _rounded(joint.position)
        motion.velocity[name][rows] = _rounded(joint.velocity)
        if motion.acceleration:
            motion.acceleration[name][rows] = _rounded(joint.acceleration)
    for quantity in ("omega", "epsilon", "transmission"):
        for name, values in getattr(motion, quantity).items():
            values[rows] = np.real(_rounded(getattr(solution, quantity)[name]))


def _rounded(number: Any) -> Any:  # noqa: ANN401 - of extended floats or of many digits
    return number if isinstance(number, np.ndarray) else complex(number)


# Why there is no motion ----------------------------------------------------------------------------

ROUNDING = 1e-14
"""Relative to the mechanism's reach."""
WHAT_IS_IN_LINE = {
    Dyad: "its links are in line",
    Slider: "its rod is perpendicular to the guide",
    SlottedLink: "the pin is at the link's pivot, or as near to it as the offset lets it",
    CrossSlider: "its guides are parallel",
    Yoke: "slot and guide are parallel",
    Triad: "the lines of its three legs meet in one point, or those of the first two are parallel",
}


def reason(mechanism: Mechanism, broken: NDArray[np.bool_]) -> MechanismError:
    """Return the error for the first of the broken variants, with the number of all."""
    first = int(np.argmax(broken))
    where = f" ({int(broken.sum())} of {broken.size} variant(s), the first at index {first})"
    return reason_at(mechanism, first, "" if broken.size == 1 else where)


def reason_at(mechanism: Mechanism, index: int, where: str = "") -> MechanismError:
    """Return the error for the variant at an index, from the first group that fails there."""
    take = one_variant(index, _quiet)
    groups = mechanism.groups
    driving = "crank angle" if isinstance(mechanism.driver, Crank) else "displacement of the driving slider"
    with np.errstate(all="ignore"):
        for count, group in enumerate(groups):
            before = solve(replace(mechanism, groups=groups[:count]), take)
            try:
                after = solve(replace(mechanism, groups=groups[: count + 1]), take)
            except ZeroDivisionError:
                break
            node = after.joints[group.node]
            if isinstance(group, Triad) and np.isnan(node.position):
                return _no_assembly(group, before, where)
            if not np.isfinite(node.position) or np.isnan(after.transmission.get(group.node, 1.0)):
                gap, reach = _gap(group, before), max(abs(one.position) for one in before.joints.values())
                # The gap is only rounding: the group is flat, as exactly as its data can be.
                if gap > ROUNDING * reach:
                    return _does_not_close(group, gap, where, driving)
                return _singular(group, where, driving)
            if not np.isfinite(node.amplification * np.abs(node.acceleration + node.velocity)):
                break
        else:
            group = min(groups, key=lambda one: float(after.transmission.get(one.node, 1.0)))
    return _singular(group, where, driving)


def _quiet(number: complex) -> np.generic:
    """Return a number as a NumPy scalar, which divides by zero without an error."""
    scalar: np.generic = np.asarray(number)[()]  # type: ignore[assignment]
    return scalar


def _does_not_close(group: Group, gap_m: float, where: str, driving: str) -> MechanismError:
    return MechanismError(
        "does_not_assemble",
        f"the group of {group.node} does not assemble: its links miss each other by {{gap}}{where};"
        f" check the lengths, the {driving}, and the sides of the groups before it",
        group=group.node,
        gap_m=gap_m,
    )


def _no_assembly(group: Triad, before: Solution, where: str) -> MechanismError:
    """Return the error for a triad that has no assembly, or none that its direction tells clearly."""
    found = directions_of(before, group)
    if not found.size:
        message = f"the triad of {group.node} does not assemble, or its legs' lines meet in one point{where}"
        return MechanismError("does_not_assemble", message, group=group.node)
    message = f"angle_deg of the triad of {group.node} tells no assembly clearly{where}; there are {{gap}}"
    degrees = ", ".join(f"{one:.1f}°" for one in np.sort(np.degrees(found)))
    return MechanismError("assembly_unclear", message, group=group.node, texts=degrees)


def _singular(group: Group, where: str, driving: str) -> MechanismError:
    advice = "give slot and guide two directions" if isinstance(group, Yoke) else f"choose another {driving}"
    why = WHAT_IS_IN_LINE.get(type(group), "its base has no length")
    message = f"the velocities of the group of {group.node} are not determined: {why}{where}; {advice}"
    return MechanismError("singular", message, group=group.node)


def _gap(group: Group, before: Solution) -> float:
    """Return the gap by which a group fails to close, m, with the pins at their positions in `before`."""
    at = {name: joint.position for name, joint in before.joints.items()}
    take = before.take
    match group:
        case Dyad(pins=(p, q)) | Plate(base=(p, q)):
            distance, first, second = abs(at[q] - at[p]), *map(take, group.lengths_m)
            gap = max(distance - (first + second), abs(first - second) - distance)
        case Slider(pin=pin):
            rail = rail_of(before, group.guide)
            gap = abs(cross(rail.along, at[pin] - rail.joint.position)) - take(group.length_m)
        case SlottedLink(pin=pin, pivot=pivot):
            gap = abs(take(group.offset_m)) - abs(at[pin] - at[pivot])
        case _:
            gap = 0.0
    return float(gap)
