"""A mechanism followed from one position: how far its driven link goes, and where branches cross.

Each Assur group closes while its closures, smooth functions of the driven coordinate, are positive.
Where one changes its sign the driven link is stopped. Where one only touches zero (a parallelogram
stretched along its ground, a kite folded, an isosceles slider-crank at its guide's end) both branches
meet, and the motion goes on smoothly on what is from there on the other branch: its side is reversed.
So sides are found once, from the closures' zeros and minima, not from one sample to the next: no
step is too coarse, and no near miss of a flat position is taken for a passage.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reference.geometry import FloatArray, cross, dot
from reference.kinematics.motion import WHAT_IS_IN_LINE
from reference.kinematics.solving import Joint, Rail, Solution, rail_of, solve
from reference.mechanism import Crank, CrossSlider, DrivenSlider, Dyad, Group, Mechanism, Slider, SlottedLink
from reference.numbers import Complex, Number

SCANNED = 3001
"""Samples in which closures are scanned; of two events nearer than a sample one may be overlooked."""
ROUNDINGS = 32.0 * float(np.finfo(np.float64).eps)
"""A closure this small against the coordinates it comes from is zero."""
LARGEST_AMPLIFICATION = 1e6
NEAR = 1e-4
"""Flat positions of two groups so near to each other are one: the second is found only roughly."""
PARTS = 64
FINEST = 2.0 * float(np.finfo(np.float64).eps)
TURN = 2.0 * np.pi
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Event:
    """Where something happens to a group: the driven coordinate (rad or m), its node, and why."""

    at: float
    node: str
    why: str


@dataclass(frozen=True, slots=True)
class Closure:
    """A group closes while `value` > 0; `slope` is its derivative, `slack` what rounding leaves open."""

    value: FloatArray
    slope: FloatArray
    slack: FloatArray


@dataclass(frozen=True, slots=True)
class Following:
    """A mechanism of one variant, followed both ways from its own position.

    Attributes
    ----------
    start : the driven coordinate that it is followed from: crank angle (rad) or displacement (m)
    low, high : how far the closures were followed
    stops : what ends the motion at `low` and at `high`, None where nothing does
    changes : flat positions that are passed, by the group's node, ascending
    """

    mechanism: Mechanism
    start: float
    low: float
    high: float
    stops: tuple[Event | None, Event | None]
    changes: Mapping[str, tuple[float, ...]]

    def at(self, driven: FloatArray) -> Mechanism:
        """The mechanism at some driven coordinates, shape (N,), each group on the side it is on there."""
        return _driven_at(self.mechanism, driven, self.start, self.changes)

    @property
    def events(self) -> tuple[Event, ...]:
        """The flat positions that are passed, in order."""
        found = [
            Event(at, group.node, _why(group))
            for group in self.mechanism.groups
            for at in self.changes.get(group.node, ())
        ]
        return tuple(sorted(found, key=lambda event: event.at))


def follow(mechanism: Mechanism, start: float, low: float, high: float) -> Following:
    """Follow a mechanism of one variant from `start`, where it assembles, at most to `low` and `high`."""
    changes: dict[str, tuple[float, ...]] = {}
    ends = [low, high]
    stops: list[Event | None] = [None, None]
    for count, group in enumerate(mechanism.groups):
        before = replace(mechanism, groups=mechanism.groups[:count])

        def closures(driven: FloatArray, before: Mechanism = before, group: Group = group) -> list[Closure]:
            return closures_of(_unit_speed(_driven_at(before, driven, start, changes)), group)

        touched: set[float] = set()
        for index in range(len(closures(np.array([start])))):
            curve = _Curve(closures, index)
            for end in (0, 1):
                found = _walk(curve, start, ends[end], may_pass=not isinstance(group, CrossSlider))
                touched.update(_snapped(at, changes) for at in found.touched)
                if found.stop is not None:
                    ends[end] = found.stop
                    stops[end] = Event(found.stop, group.node, _why(group))
        changes[group.node] = tuple(sorted(touched))
    inside = {node: tuple(at for at in found if ends[0] < at < ends[1]) for node, found in changes.items()}
    return Following(mechanism, start, ends[0], ends[1], (stops[0], stops[1]), inside)


def _why(group: Group) -> str:
    return WHAT_IS_IN_LINE.get(type(group), "its base has no length")


def _driven_at(
    mechanism: Mechanism, driven: FloatArray, start: float, changes: Mapping[str, tuple[float, ...]]
) -> Mechanism:
    if isinstance(mechanism.driver, Crank):
        driver: Crank | DrivenSlider = replace(mechanism.driver, angle_rad=driven)
    else:
        driver = replace(mechanism.driver, displacement_m=driven)
    groups = tuple(
        _on_its_side(group, driven, start, changes.get(group.node, ())) for group in mechanism.groups
    )
    return replace(mechanism, driver=driver, groups=groups)


def _on_its_side(group: Group, driven: FloatArray, start: float, changes: tuple[float, ...]) -> Group:
    """The group on the side it is on after so many flat positions, counted from the start."""
    if not changes or not isinstance(group, Dyad | Slider | SlottedLink):
        return group
    passed = np.searchsorted(changes, driven) - np.searchsorted(changes, start)
    return replace(group, side=np.asarray(group.side * np.where(passed % 2 == 0, 1.0, -1.0)))


def _unit_speed(mechanism: Mechanism) -> Solution:
    """Positions, and their derivatives by the driven coordinate."""
    one = np.ones(1)
    if isinstance(mechanism.driver, Crank):
        driver: Crank | DrivenSlider = replace(mechanism.driver, omega=one)
    else:
        driver = replace(mechanism.driver, speed=one)
    with np.errstate(all="ignore"):
        return solve(replace(mechanism, driver=driver), accelerations=False)


# Closures -----------------------------------------------------------------------------------------


def closures_of(solution: Solution, group: Group) -> list[Closure]:
    """A group's closures, from the joints before it at unit speed of the driven link."""
    with np.errstate(all="ignore"):
        match group:
            case Dyad(pins=(p, q), lengths_m=(first, second)):
                between = _Distance(solution.joints[p], solution.joints[q])
                return [between.short_of(first + second), between.beyond(np.abs(first - second))]
            case SlottedLink(pin=pin, pivot=pivot, offset_m=offset):
                return [_Distance(solution.joints[pivot], solution.joints[pin]).beyond(np.abs(offset))]
            case Slider():
                return _closures_of_slider(solution.joints[group.pin], rail_of(solution, group.guide), group)
            case CrossSlider(guides=(one, other)):
                return [_crossing(rail_of(solution, one), rail_of(solution, other))]
    return []


class _Distance:
    """Of two joints, and how it changes."""

    def __init__(self, p: Joint, q: Joint) -> None:
        d, speed = q.position - p.position, q.velocity - p.velocity
        self.metres = np.abs(d)
        self.slope = 2.0 * dot(d, speed)
        self.rounding = _rounding(p, q)

    def short_of(self, limit: FloatArray) -> Closure:
        total = limit + self.metres
        return _closure(
            (limit - self.metres) * total, -self.slope, (self.rounding + ROUNDINGS * limit) * total
        )

    def beyond(self, limit: FloatArray) -> Closure:
        total = limit + self.metres
        return _closure(
            (self.metres - limit) * total, self.slope, (self.rounding + ROUNDINGS * limit) * total
        )


def _closures_of_slider(pin: Joint, rail: Rail, group: Slider) -> list[Closure]:
    length = group.length_m
    height = cross(rail.along, pin.position - rail.joint.position)
    slope = cross(rail.along, pin.velocity - rail.velocity(pin.position))
    slack = _rounding(pin, rail.joint) + ROUNDINGS * length
    return [_closure(length - height, -slope, slack), _closure(length + height, slope, slack)]


def _crossing(first: Rail, second: Rail) -> Closure:
    """The sine between two guides: where it is zero the node is at infinity, on either side of it."""
    sine = cross(first.along, second.along)
    slope = dot(first.along, second.along) * (second.omega - first.omega)
    return _closure(sine, slope, ROUNDINGS)


def _rounding(p: Joint, q: Joint) -> Number:
    """What rounding may have added to the distance of two joints."""
    grown = np.fmin(np.maximum(p.amplification, q.amplification), LARGEST_AMPLIFICATION)
    return ROUNDINGS * grown * (np.abs(p.position) + np.abs(q.position))


def _closure(value: Complex, slope: Number, slack: Number) -> Closure:
    return Closure(*np.broadcast_arrays(value, slope, slack))


# Zeros and minima ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Curve:
    """One closure as a function of the driven coordinate."""

    closures: Callable[[FloatArray], list[Closure]]
    index: int

    def __call__(self, driven: FloatArray) -> Closure:
        return self.closures(driven)[self.index]


@dataclass(slots=True)
class _Walk:
    """What a walk along a closure meets: flat positions that are passed, and the stop."""

    touched: list[float]
    stop: float | None = None


def _walk(curve: _Curve, start: float, limit: float, *, may_pass: bool) -> _Walk:
    """From the start to a limit, or to where the closure ends the motion.

    Samples crowd at both ends, as near to a stop all others of the mechanism's motions do.
    """
    steps = start + (limit - start) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, SCANNED)))
    found = curve(steps)
    sign, ahead = np.sign(found.value[0]), np.sign(limit - start)
    told = np.isfinite(found.value) & np.isfinite(found.slope)
    steps, value, slack = steps[told], sign * found.value[told], found.slack[told]
    slope = sign * ahead * found.slope[told]
    # Between two samples a closure falls no lower than its slope can take it.
    reached = value[:-1] + 2.0 * slope[:-1] * np.abs(np.diff(steps))
    turns = (slope[:-1] < 0.0) & (slope[1:] >= 0.0) & (reached <= slack[:-1])
    ends = value[1:] < -slack[1:]
    walk = _Walk([])
    for k in np.flatnonzero(turns | ends):
        outside = steps[k + 1] if ends[k] else None
        if turns[k]:
            lowest = change(lambda x: sign * ahead * curve(x).slope < 0.0, steps[k], steps[k + 1])[1]
            least = curve(np.array([lowest]))
            depth, rounding = sign * least.value[0], least.slack[0]
            if depth < -rounding or (depth <= rounding and not may_pass):
                outside = lowest
            elif depth <= rounding and _is_passed(curve, lowest, abs(limit - start)):
                walk.touched.append(lowest)
        if outside is not None:
            walk.stop = change(lambda x: sign * curve(x).value > 0.0, steps[k], outside)[0]
            break
    return walk


def change(holds: Callable[[FloatArray], BoolArray], inside: float, outside: float) -> tuple[float, float]:
    """Neighbouring numbers between which what holds inside ceases to hold."""
    low, high = inside, outside
    while abs(high - low) > FINEST * max(abs(inside), abs(outside)):
        points = low + (high - low) * np.linspace(0.0, 1.0, PARTS + 1)
        points[-1] = high
        held = holds(points[1:-1])
        first = int(np.argmin(held)) if not held.all() else PARTS - 1
        low, high = float(points[first]), float(points[first + 1])
    return low, high


def _is_passed(curve: _Curve, at: float, span: float) -> bool:
    """Whether branches cross there: the closure leaves zero as a square, not as a fourth power."""
    step = min(1e-3, 1e-4 * span)
    near, far = curve(np.array([at + step, at + 2.0 * step])).value
    return bool(abs(far) < 8.0 * abs(near))


def _snapped(at: float, changes: Mapping[str, tuple[float, ...]]) -> float:
    """The flat position of an earlier group, where that is so near that both are one."""
    return next((known for known in _all(changes) if abs(known - at) < NEAR), at)


def _all(changes: Mapping[str, tuple[float, ...]]) -> Iterator[float]:
    return (at for found in changes.values() for at in found)
