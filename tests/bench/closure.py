"""Motion in 50 digits by an independent road: the closure equations, differentiated.

Positions solve the equations of the links' lengths, (N - P).(N - P) = l^2, and of the guides by
Newton's method; velocities and accelerations solve the same equations differentiated (`jets`).
Nothing of the closed forms is used. A group's side is told by the place where Newton's method starts,
which elementary geometry gives in as many digits.

`exact_motion` takes the data from the authored file in decimal, so that rounding of the data
themselves counts as an error too; `exact_motion_of` takes the doubles of a mechanism as exact.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

from mpmath import mp, mpf

from reference.assignment import Assignment, Variant
from reference.construction import Vector
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivenSlider,
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
)
from tests.bench.exact_data import DIGITS, ExactMechanism, LocalPoint, authored_exactly, exactly
from tests.bench.jets import Equations, Jet, Pair, Point, cross, dot, fixed, follow, moving

IN_LINE = mpf(10) ** -9
"""Relative: a plate's lengths that sum up this nearly are meant to be in line."""


@dataclass(slots=True)
class ExactMotion:
    """The joints as moving points, SI, and how fast the links turn that carry a sliding point."""

    points: dict[str, Point] = field(default_factory=dict)
    axes: dict[str, Point] = field(default_factory=dict)
    """By coincident point: a vector that is fixed in the link which carries it."""
    slots: dict[str, str] = field(default_factory=dict)
    """By a slotted link's node: its pivot."""

    @property
    def position(self) -> dict[str, Pair]:
        """By joint, metres."""
        return {joint: point.place for joint, point in self.points.items()}

    @property
    def velocity(self) -> dict[str, Pair]:
        """By joint, m/s."""
        return {joint: point.velocity for joint, point in self.points.items()}

    @property
    def acceleration(self) -> dict[str, Pair]:
        """By joint, m/s^2."""
        return {joint: point.acceleration for joint, point in self.points.items()}

    def vector(self, vector: Vector) -> complex:
        """A named vector of the plans, rounded once at the end."""
        kind, _, joint = vector.name.partition("_")
        if vector.link is None:
            point = self.points[joint]
            return rounded(point.velocity if kind == "v" else point.acceleration)
        with mp.workdps(DIGITS):
            tail, head = vector.link
            between = self.points[head] - self.points[tail]
            if kind == "v":
                return rounded(between.velocity)
            return rounded(self._share(between, vector))

    def _share(self, between: Point, vector: Vector) -> Pair:
        """The acceleration of a point about another, or its part along or across the link or guide."""
        whole = between.acceleration
        match vector.part:
            case "":
                return whole
            case "n" | "t":
                speed2, length2 = _square(between.velocity), _square(between.place)
                taken = _scaled(between.place, -speed2 / length2)
            case _:
                turn = 2 * self._carried(vector)
                taken = -turn * between.velocity[1], turn * between.velocity[0]
        rest = whole[0] - taken[0], whole[1] - taken[1]
        return taken if vector.part in "nc" else rest

    def _carried(self, vector: Vector) -> Any:
        """The angular velocity of the link that carries the vector's coincident point."""
        joints = reversed(vector.link or ())
        return next(turning(self.axes[joint])[0] for joint in joints if joint in self.axes)

    def rate(self, vector: Vector) -> float:
        """The angular velocity or acceleration of the link that a vector turns."""
        tail, head = vector.link or ("", "")
        with mp.workdps(DIGITS):
            omega, epsilon = turning(self.points[head] - self.points[tail])
        return float(omega if vector.name.startswith("v") else epsilon)


def exact_motion(assignment: Assignment, variant: Variant) -> ExactMotion:
    """The motion of one variant, its data as written in the authored file.

    Raises ArithmeticError where it does not assemble.
    """
    with mp.workdps(DIGITS):
        return _solve(authored_exactly(assignment, variant))


def exact_motion_of(mechanism: Mechanism, index: int = 0) -> ExactMotion:
    """The motion of one variant of a mechanism, its doubles taken as exact.

    Raises ArithmeticError where it does not assemble.
    """
    with mp.workdps(DIGITS):
        return _solve(exactly(mechanism, index))


def _solve(mechanism: ExactMechanism) -> ExactMotion:
    motion = ExactMotion()
    for joint, place in mechanism.ground_m.items():
        motion.points[joint] = fixed(_pair(place))
    motion.points[mechanism.driver.pin] = _driven(motion, mechanism.driver)
    for group in mechanism.groups:
        _assemble(motion, group)
    return motion


def _driven(motion: ExactMotion, driver: Crank | DrivenSlider) -> Point:
    if isinstance(driver, DrivenSlider):
        along = mp.cos(driver.guide_rad), mp.sin(driver.guide_rad)
        path = Jet(driver.displacement_m, driver.speed, driver.acceleration)
        return fixed(_pair(driver.guide_m)) + Point(Jet(along[0]) * path, Jet(along[1]) * path)
    length, omega, epsilon = driver.length_m, driver.omega, driver.epsilon
    x, y = length * mp.cos(driver.angle_rad), length * mp.sin(driver.angle_rad)
    arm = moving((x, y), (-omega * y, omega * x), (-epsilon * y - omega**2 * x, epsilon * x - omega**2 * y))
    return motion.points[driver.pivot] + arm


def _assemble(motion: ExactMotion, group: Group | LocalPoint) -> None:
    at = motion.points
    match group:
        case (
            Dyad(pins=(p, q), lengths_m=lengths, side=side) | Plate(base=(p, q), lengths_m=lengths, side=side)
        ):
            ratio = _ratio_in_line(motion, group) if isinstance(group, Plate) else None
            if ratio is not None:
                at[group.node] = at[p] + (at[q] - at[p]).times((ratio, mpf(0)))
                return
            start = _two_arcs(at[p].place, lengths[0], at[q].place, lengths[1], side)
            at[group.node] = _follow(motion, _both(_link(at[p], lengths[0]), _link(at[q], lengths[1])), start)
        case PointOnLine(base=(p, q)):
            at[group.node] = at[p] + (at[q] - at[p]).times((group.ratio, mpf(0)))
        case LocalPoint(base=(p, q)):
            axis = at[q] - at[p]
            at[group.node] = at[p] + axis.times(_scaled(group.at, 1 / mp.hypot(*axis.place)))
        case Slider():
            _slide(motion, group)
        case CrossSlider(guides=(first, second)):
            lines = _both(_on(_line(motion, first)), _on(_line(motion, second)))
            at[group.node] = _follow(motion, lines, _line(motion, first)[0].place)
        case Yoke():
            slot = at[group.pin], _unit(group.slot_rad)
            lines = _both(_on(slot), _on(_line(motion, group.guide)))
            at[group.node] = _follow(motion, lines, at[group.pin].place)
            motion.axes[group.node] = slot[1]
        case SlottedLink():
            _turn_slot(motion, group)
        case SlotPoint():
            axis = motion.axes[group.slotted].times(_pair(group.local_m))
            at[group.node] = at[motion.slots[group.slotted]] + axis
    _carry(motion, group)


def _slide(motion: ExactMotion, group: Slider) -> None:
    pin = motion.points[group.pin]
    foot, along = _line(motion, group.guide)
    u = _scaled(along.place, 1 / mp.hypot(*along.place))
    to_pin = (pin - foot).place
    height = u[0] * to_pin[1] - u[1] * to_pin[0]
    half = _root(group.length_m**2 - height**2)
    reach = u[0] * to_pin[0] + u[1] * to_pin[1] + group.side * half
    start = foot.place[0] + reach * u[0], foot.place[1] + reach * u[1]
    both = _both(_link(pin, group.length_m), _on((foot, along)))
    motion.points[group.node] = _follow(motion, both, start)


def _turn_slot(motion: ExactMotion, group: SlottedLink) -> None:
    """Unknown is the guide's direction: |e|^2 = 1, e x (P - Q) = offset."""
    pivot, pin = motion.points[group.pivot], motion.points[group.pin]
    arm = pin - pivot
    length2 = _square(arm.place)
    reach = group.side * _root(length2 - group.offset_m**2)

    def equations(e: Point) -> tuple[Jet, Jet]:
        return dot(e, e) - Jet(mpf(1)), cross(e, arm) - Jet(group.offset_m)

    x, y = arm.place
    start = (x * reach + y * group.offset_m) / length2, (y * reach - x * group.offset_m) / length2
    axis = follow(equations, start, mpf(1))
    motion.points[group.node] = pivot + axis.times((reach, group.offset_m))
    motion.axes[group.node] = axis
    if group.foot is not None:
        motion.points[group.foot] = pivot + axis.times((mpf(0), group.offset_m))
    motion.slots[group.node] = group.pivot


def _carry(motion: ExactMotion, group: Group | LocalPoint) -> None:
    """The points of moving guides' links that lie under the group's node at this instant."""
    guides = group.guides if isinstance(group, CrossSlider) else (getattr(group, "guide", None),)
    for guide in guides:
        if isinstance(guide, MovingGuide):
            origin, axis = _line(motion, guide)
            length2 = _square(axis.place)
            between = (motion.points[group.node] - origin).place
            ratio = (between[0] * axis.place[0] + between[1] * axis.place[1]) / length2
            motion.points[guide.coincident] = origin + axis.times((ratio, mpf(0)))
            motion.axes[guide.coincident] = axis


def _line(motion: ExactMotion, guide: Guide) -> tuple[Point, Point]:
    """A point of a guide and a vector along it, both as they move."""
    if isinstance(guide, FixedGuide):
        return fixed(_pair(guide.through_m)), _unit(guide.angle_rad)
    first, second = (motion.points[joint] for joint in guide.base)
    return first, second - first


def _unit(angle: Any) -> Point:
    return fixed((mp.cos(angle), mp.sin(angle)))


Equation = Callable[[Point], Jet]


def _link(pin: Point, length: Any) -> Equation:
    """(N - P).(N - P) = l^2."""
    return lambda node: dot(node - pin, node - pin) - Jet(length**2)


def _on(line: tuple[Point, Point]) -> Equation:
    """The node on a line: u x (N - G) = 0."""
    through, along = line
    return lambda node: cross(along, node - through)


def _both(first: Equation, second: Equation) -> Equations:
    return lambda node: (first(node), second(node))


def _follow(motion: ExactMotion, equations: Equations, start: Pair) -> Point:
    size = max(mp.hypot(*point.place) for point in motion.points.values())
    return follow(equations, start, size)


def _two_arcs(p: Pair, first: Any, q: Pair, second: Any, side: Any) -> Pair:
    """A triangle's third corner, plainly, by the law of cosines."""
    x, y = q[0] - p[0], q[1] - p[1]
    square = x * x + y * y
    along = (square + first**2 - second**2) / (2 * square)
    across = side * _root(first**2 / square - along**2)
    return p[0] + along * x - across * y, p[1] + along * y + across * x


def _ratio_in_line(motion: ExactMotion, plate: Plate) -> Any:
    """Where a flat plate's point divides its base; None for a plate that is a triangle."""
    span = mp.hypot(*(motion.points[plate.base[1]] - motion.points[plate.base[0]]).place)
    first, second = plate.lengths_m
    for gap, ratio in (
        (span - first - second, first / span),
        (first - span - second, first / span),
        (second - span - first, -first / span),
    ):
        if abs(gap) < IN_LINE * span:
            return ratio
    return None


def turning(arm: Point) -> Pair:
    """The angular velocity and acceleration of a rigid link from a vector that is fixed in it."""
    (x, y), (vx, vy), (ax, ay) = arm.place, arm.velocity, arm.acceleration
    square = x * x + y * y
    return (x * vy - y * vx) / square, (x * ay - y * ax) / square


def rounded(pair: Pair) -> complex:
    """The nearest doubles."""
    return complex(float(pair[0]), float(pair[1]))


def _pair(number: Any) -> Pair:
    return mp.re(number), mp.im(number)


def _scaled(pair: Pair, factor: Any) -> Pair:
    return pair[0] * factor, pair[1] * factor


def _root(x: Any) -> Any:
    if x < 0:
        raise ArithmeticError("a group does not assemble")
    return mp.sqrt(x)


def _square(pair: Pair) -> Any:
    return pair[0] ** 2 + pair[1] ** 2
