"""Continuation of a mechanism from one position: how far its driving link goes, and where branches cross.

Each Assur group closes while its closures, smooth functions of the driving coordinate, are positive.
Where one changes its sign the driving link is stopped. Where one only touches zero (a parallelogram
stretched along its ground, a kite folded, an isosceles slider-crank at its guide's end) both branches
meet, and the motion goes on smoothly on the other branch: the group's side is reversed.
Sides thus follow from the closures' zeros and minima, not from one sample to the next: no step is too
coarse, and no near miss of a flat position is taken for a passage.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import NDArray

from reference.geometry import FloatArray, cross, dot
from reference.kinematics import triad
from reference.kinematics.motion import WHAT_IS_IN_LINE
from reference.kinematics.solving import Joint, Rail, Solution, loops_of, rail_of, solve
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivingSlider,
    Dyad,
    Group,
    Mechanism,
    Slider,
    SlottedLink,
    Triad,
    with_arrays,
)
from reference.numbers import Complex, Number

SCANNED = 3001
"""Samples at which closures are evaluated; of two events closer than a sample, one may be missed."""
ROUNDINGS = 32.0 * float(np.finfo(np.float64).eps)
"""A closure this small against the coordinates it comes from is zero."""
LARGEST_AMPLIFICATION = 1e6
"""Largest amplification of rounding errors counted in a closure's slack."""
GLANCES = 73
"""Samples of the quick check, 5 degrees apart on a full turn."""
NEARLY = 0.05
"""A closure that falls below this share of its largest sample may touch zero between two samples: over the
2.5 degrees to the nearest one a closure with a touch of zero grows by a tenth of that."""
NEAR = 1e-4
"""Flat positions of two groups so near to each other are one: the second is located only roughly."""
PARTS = 64
"""Number of parts into which an interval is divided at a time: one evaluation on an array each."""
FINEST = 2.0 * float(np.finfo(np.float64).eps)
"""Relative width of an interval that is not divided further: neighbouring numbers."""
TURN = 2.0 * np.pi
BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Event:
    """An event of a group: the driving coordinate (rad or m), the group's node, and the reason."""

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
class Track:
    """A triad's assembly along the driving coordinate: directions (rad), and its determinant's sign."""

    driving: FloatArray
    direction: FloatArray
    leg: FloatArray
    sign: int

    def of(self, group: Triad, driving: FloatArray) -> Triad:
        """Return the triad in its assembly at some driving coordinates; in none beyond the ends."""
        angles = (self.direction, self.leg)
        direction, leg = (np.interp(driving, self.driving, one, np.nan, np.nan) for one in angles)
        return replace(group, direction_rad=direction, leg_rad=leg, sign=self.sign)


@dataclass(frozen=True, slots=True)
class Continuation:
    """A mechanism of one variant, followed in both directions from its own position.

    Attributes
    ----------
    start : the driving coordinate that it is followed from: crank angle (rad) or displacement (m)
    low, high : how far the closures were followed
    stops : what ends the motion at `low` and at `high`, None where nothing does
    changes : flat positions that are passed, by the group's node, ascending
    tracks : the assemblies of triads, by the group's node
    """

    mechanism: Mechanism
    start: float
    low: float
    high: float
    stops: tuple[Event | None, Event | None]
    changes: Mapping[str, tuple[float, ...]]
    tracks: Mapping[str, Track] = field(default_factory=dict)

    def at(self, driving: FloatArray) -> Mechanism:
        """Return the mechanism at some driving coordinates, shape (N,), each group on its side there."""
        return _driving_at(self.mechanism, driving, self.start, self.changes, self.tracks)

    @property
    def events(self) -> tuple[Event, ...]:
        """Flat positions that are passed, in order."""
        events = [
            Event(at, group.node, _why(group))
            for group in self.mechanism.groups
            for at in self.changes.get(group.node, ())
        ]
        return tuple(sorted(events, key=lambda event: event.at))


def follow(mechanism: Mechanism, start: float, low: float, high: float) -> Continuation:
    """Follow a mechanism of one variant from `start`, where it assembles, at most to `low` and `high`."""
    changes: dict[str, tuple[float, ...]] = {}
    tracks: dict[str, Track] = {}
    ends = [low, high]
    stops: list[Event | None] = [None, None]
    for count, group in enumerate(mechanism.groups):
        before = replace(mechanism, groups=mechanism.groups[:count])

        def placed(driving: FloatArray, before: Mechanism = before) -> Solution:
            return _unit_speed(_driving_at(before, driving, start, changes, tracks))

        def closures(
            driving: FloatArray, placed: Callable[[FloatArray], Solution] = placed, group: Group = group
        ) -> list[Closure]:
            return closures_of(placed(driving), group)

        if isinstance(group, Triad):
            tracks[group.node], found = _track(placed, group, start, (ends[0], ends[1]))
            for end, stop in enumerate(found):
                if stop is not None:
                    ends[end], stops[end] = stop, Event(stop, group.node, _why(group))
        touched: set[float] = set()
        for index in range(len(closures(np.array([start])))):
            for end in (0, 1):
                walk = _walk(closures, index, (start, ends[end]), may_pass=not isinstance(group, CrossSlider))
                touched.update(_snapped(at, changes) for at in walk.touched)
                if walk.stop is not None:
                    ends[end] = walk.stop
                    stops[end] = Event(walk.stop, group.node, _why(group))
        changes[group.node] = tuple(sorted(touched))
    inside = {node: tuple(at for at in passed if ends[0] < at < ends[1]) for node, passed in changes.items()}
    return Continuation(mechanism, start, ends[0], ends[1], (stops[0], stops[1]), inside, tracks)


def signs_between(mechanism: Mechanism, start: float, ends: FloatArray) -> dict[str, FloatArray]:
    """Return by node -1 where a group passes an odd number of flat positions on its way to an end, else +1.

    Arguments: a mechanism of one variant, which assembles at `start`; driving coordinates, shape (N,). Only
    groups that pass flat positions are included; ends that the driving link cannot reach have +1.
    """
    following = follow(mechanism, start, min(start, *ends), max(start, *ends))
    reached = (ends >= following.low) & (ends <= following.high)
    return {
        node: np.where(reached, _sign(changes, ends, start), 1.0)
        for node, changes in following.changes.items()
        if changes
    }


def may_pass(mechanism: Mechanism, low: FloatArray, high: FloatArray) -> BoolArray:
    """Return whether some group comes near a flat position between two driving coordinates, shape (N,) each.

    A quick look at many variants at once: where it says no, `follow` finds no flat position.
    """
    count = low.size
    driving = np.linspace(low, high, GLANCES, axis=1).ravel()
    wide = with_arrays(mechanism, lambda values: np.repeat(np.broadcast_to(values, (count,)), GLANCES))
    near = np.zeros(count, dtype=np.bool_)
    for index, group in enumerate(wide.groups):
        before = _driving_at(replace(wide, groups=wide.groups[:index]), driving, 0.0, {}, {})
        for closure in closures_of(_unit_speed(before), group):
            value = np.abs(closure.value.reshape(count, GLANCES))
            with np.errstate(invalid="ignore"):
                near |= ~(value.min(axis=1) > NEARLY * value.max(axis=1))
            near |= np.any(np.diff(np.sign(closure.value.reshape(count, GLANCES)), axis=1) != 0.0, axis=1)
    return near


def _why(group: Group) -> str:
    return WHAT_IS_IN_LINE.get(type(group), "its base has no length")


def _driving_at(
    mechanism: Mechanism,
    driving: FloatArray,
    start: float,
    changes: Mapping[str, tuple[float, ...]],
    tracks: Mapping[str, Track],
) -> Mechanism:
    if isinstance(mechanism.driver, Crank):
        driver: Crank | DrivingSlider = replace(mechanism.driver, angle_rad=driving)
    else:
        driver = replace(mechanism.driver, displacement_m=driving)
    groups = tuple(
        tracks[group.node].of(group, driving)
        if isinstance(group, Triad) and group.node in tracks
        else _on_its_side(group, driving, start, changes.get(group.node, ()))
        for group in mechanism.groups
    )
    return replace(mechanism, driver=driver, groups=groups)


def _on_its_side(group: Group, driving: FloatArray, start: float, changes: tuple[float, ...]) -> Group:
    """Return the group on the side that it has after so many flat positions, counted from the start."""
    if not changes or not isinstance(group, Dyad | Slider | SlottedLink):
        return group
    return replace(group, side=np.asarray(group.side * _sign(changes, driving, start)))


def _sign(changes: tuple[float, ...], driving: FloatArray, start: float) -> FloatArray:
    """-1 if the number of flat positions between the start and a driving coordinate is odd, else +1."""
    passed = np.searchsorted(changes, driving) - np.searchsorted(changes, start)
    return np.where(passed % 2 == 0, 1.0, -1.0)


def _unit_speed(mechanism: Mechanism) -> Solution:
    """Return positions and their derivatives by the driving coordinate."""
    one = np.ones(1)
    if isinstance(mechanism.driver, Crank):
        driver: Crank | DrivingSlider = replace(mechanism.driver, omega=one)
    else:
        driver = replace(mechanism.driver, speed=one)
    with np.errstate(all="ignore"):
        return solve(replace(mechanism, driver=driver), accelerations=False)


# Triads ---------------------------------------------------------------------------------------------

FARTHEST_STEP_RAD = 0.01
"""Farthest turn of a triad's links from one position to the next; positions are set nearer to each other
until it is no farther. Where that does not help, the motion stops."""


def _track(
    placed: Callable[[FloatArray], Solution], group: Triad, start: float, span: tuple[float, float]
) -> tuple[Track, list[float | None]]:
    """Return a triad's assembly over a span of the driving coordinate, and where it stops at either end.

    From position to position it is the nearest assembly whose determinant has the same sign: two assemblies
    that meet at a stop have different ones.
    """

    def found(driving: FloatArray) -> Iterator[tuple[float, FloatArray, FloatArray]]:
        loops = tuple(np.broadcast_to(part, driving.shape) for part in loops_of(placed(driving), group))
        z, u = triad.assemblies(loops)
        sine = triad.sine(triad.columns(loops), z, u)
        # With a margin, so that the assembly is found again at the stop.
        signs = np.where(np.abs(sine) >= 2.0 * triad.LEAST_SINE, np.sign(sine), 0.0)
        return zip(driving.tolist(), np.stack([np.angle(u), np.angle(z)], axis=2), signs, strict=True)

    def follow_to(limit: float) -> tuple[list[float], list[FloatArray], float | None]:
        driving, angles = [start], [first]
        ahead = list(found(np.linspace(start, limit, SCANNED)[1:]))[::-1]
        while ahead:
            at, choices, signs = ahead[-1]
            turns = (choices - angles[-1] + np.pi) % TURN - np.pi
            off = np.where(signs == sign, np.abs(turns).sum(axis=1), np.inf)
            best = int(np.argmin(off))
            if off[best] < FARTHEST_STEP_RAD:
                driving.append(at)
                angles.append(angles[-1] + turns[best])
                ahead.pop()
            elif abs(at - driving[-1]) <= FINEST * max(abs(at), abs(start)):
                return driving, angles, driving[-1]
            else:
                ahead += list(found(np.linspace(driving[-1], at, PARTS + 1)[1:-1]))[::-1]
        return driving, angles, None

    loops = tuple(np.atleast_1d(part) for part in loops_of(placed(np.array([start])), group))
    z, u = triad.chosen(loops, group.direction_rad, group.leg_rad, group.sign)
    first, sign = np.array([np.angle(u[0]), np.angle(z[0])]), float(np.sign(triad.sine(loops, z, u)[0]))
    (before, low, stop), (after, high, other) = (follow_to(limit) for limit in span)
    driving, angles = np.array([*before[:0:-1], *after]), np.array([*low[:0:-1], *high])
    return Track(driving, angles[:, 0], angles[:, 1], int(sign)), [stop, other]


# Closures -----------------------------------------------------------------------------------------


def closures_of(solution: Solution, group: Group) -> list[Closure]:
    """Return a group's closures from the joints before it at unit speed of the driving link."""
    joints = solution.joints
    with np.errstate(all="ignore"):
        match group:
            case Dyad(pins=(p, q), lengths_m=(first, second)):
                longest, shortest = first + second, np.abs(first - second)
                return [
                    _distance(joints[p], joints[q], longest, -1),
                    _distance(joints[p], joints[q], shortest),
                ]
            case SlottedLink(pin=pin, pivot=pivot, offset_m=offset):
                return [_distance(joints[pivot], joints[pin], np.abs(offset))]
            case Slider(length_m=length):
                end, rail = joints[group.pin], rail_of(solution, group.guide)
                height = cross(rail.along, end.position - rail.joint.position)
                slope = cross(rail.along, end.velocity - rail.velocity(end.position))
                slack = _rounding(end, rail.joint) + ROUNDINGS * length
                return [_closure(length - height, -slope, slack), _closure(length + height, slope, slack)]
            case CrossSlider(guides=(first, second)):
                return [_crossing(rail_of(solution, first), rail_of(solution, second))]
    return []


def _distance(p: Joint, q: Joint, limit: FloatArray, sign: int = 1) -> Closure:
    """Two joints farther apart than a limit (with sign -1: nearer), as a difference of squares."""
    d, speed = q.position - p.position, q.velocity - p.velocity
    metres = np.abs(d)
    total = limit + metres
    slack = (_rounding(p, q) + ROUNDINGS * limit) * total
    return _closure(sign * (metres - limit) * total, sign * 2.0 * dot(d, speed), slack)


def _crossing(first: Rail, second: Rail) -> Closure:
    """The sine of the angle between two guides: where it is zero, the node is at infinity."""
    sine = cross(first.along, second.along)
    slope = dot(first.along, second.along) * (second.omega - first.omega)
    return _closure(sine, slope, ROUNDINGS)


def _rounding(p: Joint, q: Joint) -> Number:
    """The largest rounding error in the squared distance of two joints."""
    grown = np.fmin(np.maximum(p.amplification, q.amplification), LARGEST_AMPLIFICATION)
    return ROUNDINGS * grown * (np.abs(p.position) + np.abs(q.position))


def _closure(value: Complex, slope: Number, slack: Number) -> Closure:
    return Closure(*np.broadcast_arrays(value, slope, slack))


# Zeros and minima ---------------------------------------------------------------------------------

Closures = Callable[[FloatArray], list[Closure]]
"""A group's closures as functions of the driving coordinate."""


@dataclass(slots=True)
class _Walk:
    """Events along a closure: flat positions that are passed, and the stop."""

    touched: list[float]
    stop: float | None = None


def _walk(closures: Closures, index: int, span: tuple[float, float], *, may_pass: bool) -> _Walk:
    """Return the events from the start to a limit (`span`), or to where the closure ends the motion.

    Samples are denser at both ends, where the mechanism moves fastest near a stop.
    """

    def curve(driving: FloatArray) -> Closure:
        return closures(driving)[index]

    start, limit = span
    steps = start + (limit - start) * (0.5 - 0.5 * np.cos(np.linspace(0.0, np.pi, SCANNED)))
    scan = curve(steps)
    sign, ahead = np.sign(scan.value[0]), np.sign(limit - start)
    known = np.isfinite(scan.value) & np.isfinite(scan.slope)
    steps, value, slack = steps[known], sign * scan.value[known], scan.slack[known]
    slope = sign * ahead * scan.slope[known]
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
    """Return the neighbouring numbers between which a condition that holds inside ceases to hold."""
    low, high = inside, outside
    while abs(high - low) > FINEST * max(abs(inside), abs(outside)):
        points = low + (high - low) * np.linspace(0.0, 1.0, PARTS + 1)
        points[-1] = high
        held = holds(points[1:-1])
        first = int(np.argmin(held)) if not held.all() else PARTS - 1
        low, high = float(points[first]), float(points[first + 1])
    return low, high


def _is_passed(curve: Callable[[FloatArray], Closure], at: float, span: float) -> bool:
    """Return whether branches cross at a zero: the closure leaves zero as a square, not as a fourth power."""
    step = min(1e-3, 1e-4 * span)
    near, far = curve(np.array([at + step, at + 2.0 * step])).value
    return bool(abs(far) < 8.0 * abs(near))


def _snapped(at: float, changes: Mapping[str, tuple[float, ...]]) -> float:
    """Return the flat position of an earlier group if it is so near that both are one."""
    earlier = (known for passed in changes.values() for known in passed)
    return next((known for known in earlier if abs(known - at) < NEAR), at)
