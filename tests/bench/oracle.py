"""The exact motion of a mechanism in 50 digits, computed without the closed forms.

Positions solve the closure equations (lengths of links, lines of guides) by mpmath's `findroot` at any time;
velocities and accelerations are their derivatives by `diff`. A group's assembly is set by the starting point
of the root search, which the law of cosines gives. A mechanism's doubles are taken as exact.
"""

from collections.abc import Callable, Mapping, Sequence
from functools import cached_property
from typing import Any

from mpmath import mp, mpc, mpf

from reference.construction.graph import Vector
from reference.mechanism import (
    Crank,
    CrossSlider,
    Driver,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    MovingGuide,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
    moving_guides,
)
from tests.bench.peers import one_of

DIGITS = 60
"""50 digits of the results, and some for what near-singular positions cost."""
IN_LINE = mpf(10) ** -9
"""Relative: a plate's lengths that sum up this nearly are meant to be in line."""
AXIS = "axis of "
"""Before a point's name: a vector that is fixed in the link which carries the point."""


class ExactMotion:
    """Places, velocities and accelerations by joint, SI, as mpmath's complex numbers.

    Raises ArithmeticError if the variant cannot be assembled.
    """

    def __init__(self, mechanism: Mechanism, index: int = 0) -> None:
        self._data: Mechanism = one_of(mechanism, index, mp.mpmathify)
        self._fixed: dict[str, Any] = {}
        """By name, what is constant in a rigid link, computed at time 0."""
        self._known: dict[tuple[Any, int], dict[str, Any]] = {}
        self.position = self._of_joints(0)

    @cached_property
    def velocity(self) -> dict[str, Any]:
        """By joint, m/s."""
        return self._of_joints(1)

    @cached_property
    def acceleration(self) -> dict[str, Any]:
        """By joint, m/s^2."""
        return self._of_joints(2)

    def vector(self, vector: Vector) -> complex:
        """A named vector of the plans, rounded once at the end."""
        kind, _, joint = vector.name.partition("_")
        rates = self.velocity if kind == "v" else self.acceleration
        if vector.link is None:
            return complex(rates[joint])
        with mp.workdps(DIGITS):
            tail, head = vector.link
            whole, speed = rates[head] - rates[tail], self.velocity[head] - self.velocity[tail]
            if kind == "v" or not vector.part:
                return complex(whole)
            if vector.part in "nt":
                arm = self.position[head] - self.position[tail]
                share = -arm * (abs(speed) / abs(arm)) ** 2
            else:
                carried = next(AXIS + point for point in (head, tail) if AXIS + point in self._at(mpf(0)))
                share = 2j * self.turning(carried)[0] * speed
            return complex(share if vector.part in "nc" else whole - share)

    def rate(self, vector: Vector) -> float:
        """The angular velocity or acceleration of the link that a vector belongs to."""
        tail, head = vector.link or ("", "")
        return float(self.turning(head, tail)[0 if vector.name.startswith("v") else 1])

    def turning(self, head: str, tail: str | None = None) -> tuple[Any, Any]:
        """The angular velocity and acceleration of a link, by two of its joints or a vector fixed in it."""
        with mp.workdps(DIGITS):
            arm, *rates = (
                self._rate(head, order) - (0 if tail is None else self._rate(tail, order))
                for order in (0, 1, 2)
            )
            omega, epsilon = (_cross(arm, rate) / abs(arm) ** 2 for rate in rates)
        return omega, epsilon

    def _of_joints(self, order: int) -> dict[str, Any]:
        return {joint: self._rate(joint, order) for joint in self._data.joints}

    def _rate(self, name: str, order: int) -> Any:
        with mp.workdps(DIGITS):
            return mp.diff(lambda time: self._at(time)[name], 0, order)

    def _at(self, time: Any) -> dict[str, Any]:
        """Every joint at a time, seconds, in the working precision."""
        key = time, mp.prec
        if key not in self._known:
            at = dict(self._data.ground_m)
            at[self._data.driver.pin] = _driving(self._data.driver, at, time)
            for group in self._data.groups:
                self._assemble(group, at)
            self._known[key] = at
        return self._known[key]

    def _constant(self, name: str, value: Any) -> Any:
        """A constant of a rigid link, computed once, at time 0."""
        return self._fixed.setdefault(name, value)

    def _assemble(self, group: Group, at: dict[str, Any]) -> None:
        node = group.node
        match group:
            case Dyad(pins=(p, q), lengths_m=(first, second)):
                start = at[p] + _corner(group, abs(at[q] - at[p])) * (at[q] - at[p])
                at[node] = _root([_link(at[p], first), _link(at[q], second)], start)
            case Plate(base=(p, q)):
                ratio = self._constant(node, _corner(group, abs(at[q] - at[p])))
                at[node] = at[p] + ratio * (at[q] - at[p])
            case PointOnLine(base=(p, q)):
                at[node] = at[p] + group.ratio * (at[q] - at[p])
            case Slider():
                foot, along = _line(at, group.guide)
                pin = (at[group.pin] - foot) / along * abs(along)
                reach = pin.real + group.side * _half(group.length_m, pin.imag)
                equations = [_link(at[group.pin], group.length_m), _on(foot, along)]
                at[node] = _root(equations, foot + reach * along / abs(along))
            case CrossSlider(guides=guides):
                lines = [_line(at, guide) for guide in guides]
                at[node] = _root([_on(*line) for line in lines], lines[0][0])
            case Yoke(guide=MovingGuide() as guide):
                foot, along = _line(at, guide)
                pin = (at[group.pin] - foot) / along * abs(along)
                at[node] = foot + mpc(pin.real, self._constant(node, pin.imag)) * along / abs(along)
                at[AXIS + node] = along
            case Yoke():
                at[AXIS + node] = mp.expj(group.slot_rad)
                slot = at[group.pin], at[AXIS + node]
                at[node] = _root([_on(*slot), _on(*_line(at, group.guide))], at[group.pin])
            case SlottedLink():
                self._turn_slot(group, at)
            case SlotPoint(slotted=slotted):
                at[node] = at[f"pivot of {slotted}"] + at[AXIS + slotted] * group.local_m
        for guide in moving_guides(group):
            foot, along = _line(at, guide)
            ratio = self._constant(guide.coincident, (at[node] - foot) / along)
            at[guide.coincident], at[AXIS + guide.coincident] = foot + ratio * along, along

    def _turn_slot(self, group: SlottedLink, at: dict[str, Any]) -> None:
        """Solve for the guide's direction e: |e| = 1 and e x (pin - pivot) = offset."""
        arm, offset = at[group.pin] - at[group.pivot], group.offset_m
        reach = group.side * _half(abs(arm), offset)
        equations = [_link(mpf(0), mpf(1)), lambda e: _cross(e, arm) - offset]
        along = _root(equations, arm / mpc(reach, offset))
        at[f"pivot of {group.node}"], at[AXIS + group.node] = at[group.pivot], along
        at[group.node] = at[group.pivot] + along * mpc(self._constant(group.node, reach), offset)
        if group.foot is not None:
            at[group.foot] = at[group.pivot] + along * mpc(0, offset)


Equation = Callable[[Any], Any]


def _driving(driver: Driver, at: Mapping[str, Any], time: Any) -> Any:
    if isinstance(driver, Crank):
        angle = driver.angle_rad + (driver.omega + driver.epsilon * time / 2) * time
        return at[driver.pivot] + driver.length_m * mp.expj(angle)
    path = driver.displacement_m + (driver.speed + driver.acceleration * time / 2) * time
    return driver.guide_m + path * mp.expj(driver.guide_rad)


def _root(equations: Sequence[Equation], start: Any) -> Any:
    """The point that satisfies both equations, near the starting point."""
    try:
        x, y = mp.findroot(lambda x, y: [each(mpc(x, y)) for each in equations], (start.real, start.imag))
    except ValueError as error:
        raise ArithmeticError("the closure equations have no root here") from error
    return mpc(x, y)


def _corner(group: Dyad | Plate, span: Any) -> Any:
    """(node - p) / (q - p) of a triangle by the law of cosines; real where a plate's points are in line."""
    first, second = (length / span for length in group.lengths_m)
    along = (1 + first**2 - second**2) / 2
    gaps = 1 - first - second, first - 1 - second, second - 1 - first
    if isinstance(group, Plate) and min(map(abs, gaps)) < IN_LINE:
        return mp.sign(along) * first
    return mpc(along, group.side * _half(first, along))


def _half(hypotenuse: Any, leg: Any) -> Any:
    """The other leg of a right triangle. Raises ArithmeticError where it does not close."""
    square = (hypotenuse - leg) * (hypotenuse + leg)
    if square < 0:
        raise ArithmeticError("a group does not assemble")
    return mp.sqrt(square)


def _line(at: Mapping[str, Any], guide: Guide) -> tuple[Any, Any]:
    """A point of a guide and a vector along it."""
    if isinstance(guide, FixedGuide):
        return guide.through_m, mp.expj(guide.angle_rad)
    first, second = (at[joint] for joint in guide.base)
    return first, second - first


def _link(pin: Any, length: Any) -> Equation:
    return lambda node: abs(node - pin) ** 2 - length**2


def _on(foot: Any, along: Any) -> Equation:
    return lambda node: _cross(along, node - foot)


def _cross(u: Any, v: Any) -> Any:
    return u.real * v.imag - u.imag * v.real
