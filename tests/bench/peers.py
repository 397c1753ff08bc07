"""scipy's `fsolve`, which solves any mechanism of four-bars and slider-cranks as a user would ask it to.

It solves the closure equations with their Jacobian, then two linear systems for velocities and accelerations.
It takes a starting point and not an assembly: it gets the points of a sketch in which each dyad and rod is
opened a little further (`sketch`), so that the nearer of two assemblies is the one meant.
"""

import cmath
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np
from scipy.optimize import fsolve

from reference.geometry import ComplexArray
from reference.kinematics.motion import Motion
from reference.mechanism import Dyad, FixedGuide, Mechanism, Plate, Slider


def one_of(record: Any, index: int, number: Callable[[Any], Any]) -> Any:
    """A record with the numbers of one variant, as `number` makes them, in place of its arrays."""
    match record:
        case np.ndarray():
            return number(record.item(0 if record.size == 1 else index))
        case tuple():
            return tuple(one_of(item, index, number) for item in record)
        case dict():
            return {name: one_of(item, index, number) for name, item in record.items()}
    if not is_dataclass(record) or isinstance(record, type):
        return record
    told = {each.name: one_of(getattr(record, each.name), index, number) for each in fields(record)}
    return type(record)(**told)


def stacked(records: Sequence[Any]) -> Any:
    """Records that differ only in their numbers, of one variant each, as one record of many variants."""
    first = records[0]
    match first:
        case np.ndarray():
            return np.concatenate(records)
        case tuple():
            return tuple(stacked(items) for items in zip(*records, strict=True))
        case dict():
            return {name: stacked([record[name] for record in records]) for name in first}
    if not is_dataclass(first) or isinstance(first, type):
        return first if len(set(records)) == 1 else np.array(records)
    told = {each.name: stacked([getattr(one, each.name) for one in records]) for each in fields(first)}
    return type(first)(**told)


FSOLVE = "scipy fsolve"
OPENED = 0.05
"""A sketch opens a group by this share of its link's length."""

Places = Mapping[str, complex]


class NoAnswerError(Exception):
    """Raised if the solver reports that it has no answer, with the reason."""


@dataclass(frozen=True, slots=True)
class Answer:
    """A solver's result for one variant, by joint, SI; nan where it gives no number.

    `predicted_error`, if it gives one, is relative to the largest of each plan.
    """

    position: Places
    velocity: Places
    acceleration: Places
    predicted_error: float | None = None


def answer_of(motion: Motion, index: int) -> Answer:
    """The closed form's answer for one variant."""

    def read(rates: Mapping[str, ComplexArray]) -> Places:
        return {joint: complex(values[index]) for joint, values in rates.items()}

    predicted = float(motion.predicted_error[index])
    return Answer(read(motion.position), read(motion.velocity), read(motion.acceleration), predicted)


def error_of(found: Places, truth: Places) -> float:
    """The largest error, relative to the largest of the plan; nan where a joint has no number."""
    errors = [abs(found[joint] - exact) for joint, exact in truth.items() if joint in found]
    return math.nan if any(map(math.isnan, errors)) else max(errors) / max(map(abs, truth.values()))


@dataclass(frozen=True, slots=True)
class Triangle:
    """A node held by two lengths to two joints."""

    node: str
    pins: tuple[str, str]
    lengths: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Rod:
    """A node held by a length to a joint and by a fixed guide."""

    node: str
    pin: str
    length: float
    through: complex
    angle: float


@dataclass(frozen=True, slots=True)
class Plain:
    """A mechanism in plain Python numbers, as a user of other programs would have it: metres, radians.

    The lengths are the same in all variants; the crank's angle, speed and acceleration are by variant.
    """

    ground: Places
    pivot: str
    pin: str
    length: float
    angle: list[float]
    omega: list[float]
    epsilon: list[float]
    groups: tuple[Triangle | Rod, ...]

    def arm(self, index: int) -> complex:
        """The vector from the crank's pivot to its pin."""
        return cmath.rect(self.length, self.angle[index])


def plain_of(mechanism: Mechanism) -> Plain:
    """The plain form of a mechanism. Raises NoAnswerError for groups that have none."""
    crank = mechanism.crank
    angle, omega, epsilon = np.broadcast_arrays(crank.angle_rad, crank.omega, crank.epsilon)
    return Plain(
        ground={joint: complex(place.flat[0]) for joint, place in mechanism.ground_m.items()},
        pivot=crank.pivot,
        pin=crank.pin,
        length=float(crank.length_m.flat[0]),
        angle=angle.ravel().tolist(),
        omega=omega.ravel().tolist(),
        epsilon=epsilon.ravel().tolist(),
        groups=tuple(map(_plain_group, mechanism.groups)),
    )


def _plain_group(group: object) -> Triangle | Rod:
    match group:
        case Slider(guide=FixedGuide(through_m=through, angle_rad=angle)):
            numbers = float(group.length_m.flat[0]), complex(through.flat[0]), float(angle.flat[0])
            return Rod(group.node, group.pin, *numbers)
        case Dyad(pins=pins) | Plate(base=pins):
            first, second = (float(length.flat[0]) for length in group.lengths_m)
            return Triangle(group.node, pins, (first, second))
    raise NoAnswerError(f"no plain form of {type(group).__name__}")


def sketch(mechanism: Mechanism, position: Mapping[str, ComplexArray]) -> dict[str, ComplexArray]:
    """Positions of the joints in a sketch that clearly shows each group's assembly."""
    told = dict(position)
    for group in mechanism.groups:
        if isinstance(group, Dyad):
            p, q = (position[pin] for pin in group.pins)
            away = 1j * (q - p) / np.abs(q - p)
            length = np.minimum(*group.lengths_m)
        elif isinstance(group, Slider) and isinstance(group.guide, FixedGuide):
            away, length = np.exp(1j * group.guide.angle_rad), group.length_m
        else:
            continue
        told[group.node] = position[group.node] + OPENED * length * group.side * away
    return told


class Fsolve:
    """Solve for the nodes' coordinates: (N - P).(N - P) = l^2 for a link, u x (N - G) = 0 for a guide."""

    def __init__(self, mechanism: Mechanism) -> None:
        plain = self.plain = plain_of(mechanism)
        self.rows = [row for group in plain.groups for row in _rows(group)]
        self.names = [group.node for group in plain.groups]
        self.columns = {name: 2 * k for k, name in enumerate(self.names)}
        self.known: dict[str, complex] = dict(plain.ground)
        self.still = dict.fromkeys(plain.ground, 0j)

    def _gaps(self, x: Any) -> list[float]:
        at = self._places(x)
        told = []
        for node, pin, datum in self.rows:
            if pin is None:
                told.append(_cross(datum[1], at[node] - datum[0]))
            else:
                arm = at[node] - at[pin]
                told.append(arm.real * arm.real + arm.imag * arm.imag - datum * datum)
        return told

    def _jacobian(self, x: Any) -> Any:
        at, column = self._places(x), self.columns
        matrix = np.zeros((len(self.rows), len(self.rows)))
        for row, (node, pin, datum) in enumerate(self.rows):
            if pin is None:
                gradient = 1j * datum[1]
            else:
                gradient = 2.0 * (at[node] - at[pin])
                if pin in column:
                    matrix[row, column[pin]], matrix[row, column[pin] + 1] = -gradient.real, -gradient.imag
            matrix[row, column[node]], matrix[row, column[node] + 1] = gradient.real, gradient.imag
        return matrix

    def _places(self, x: Any) -> dict[str, complex]:
        return self.known | self._pairs(x)

    def _pairs(self, x: Any) -> dict[str, complex]:
        values = x.tolist()
        return {name: complex(values[2 * k], values[2 * k + 1]) for k, name in enumerate(self.names)}

    def solve(self, index: int, start: Places) -> Callable[[], Answer]:
        """Solve for positions from the sketch; velocities and accelerations by differentiated equations."""
        plain, pin = self.plain, self.plain.pin
        arm, omega, epsilon = plain.arm(index), plain.omega[index], plain.epsilon[index]
        self.known[pin] = plain.ground[plain.pivot] + arm
        guess = np.array([part for name in self.names for part in (start[name].real, start[name].imag)])
        x, _, flag, message = fsolve(self._gaps, guess, fprime=self._jacobian, full_output=True)
        if flag != 1:
            raise NoAnswerError(message)
        at, matrix = self._places(x), self._jacobian(x)
        moved = self.still | {pin: 1j * omega * arm}
        pushed = self.still | {pin: (1j * epsilon - omega**2) * arm}
        try:
            moved |= self._pairs(np.linalg.solve(matrix, self._pull(at, moved)))
            pushed |= self._pairs(np.linalg.solve(matrix, self._pull(at, pushed, moved)))
        except np.linalg.LinAlgError as error:
            raise NoAnswerError(str(error)) from error
        return lambda: Answer(at, moved, pushed)

    def _pull(self, at: Places, known: Places, speeds: Places | None = None) -> Any:
        """The right-hand side from the known joints' rates; with `speeds`, of the second derivative."""
        told = np.zeros(len(self.rows))
        for row, (node, pin, _) in enumerate(self.rows):
            if pin is None:
                continue
            if pin in known:
                told[row] = 2.0 * _dot(at[node] - at[pin], known[pin])
            if speeds is not None:
                between = speeds[node] - speeds[pin]
                told[row] -= 2.0 * _dot(between, between)
        return told


def _rows(group: Triangle | Rod) -> list[tuple[str, str | None, Any]]:
    """(node, pin, length) for a link; (node, None, (through, along)) for a guide."""
    if isinstance(group, Rod):
        line = group.through, cmath.rect(1.0, group.angle)
        return [(group.node, group.pin, group.length), (group.node, None, line)]
    return [(group.node, pin, length) for pin, length in zip(group.pins, group.lengths, strict=True)]


def _dot(u: complex, v: complex) -> float:
    return u.real * v.real + u.imag * v.imag


def _cross(u: complex, v: complex) -> float:
    return u.real * v.imag - u.imag * v.real
