"""Strokes of what goes to and fro: dead points, travel, time ratio; and extremes of quantities."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

from grader.cycle.quantities import Quantity, Subject
from reference.cycle import Cycle
from reference.following import change
from reference.geometry import ComplexArray, FloatArray, direction, dot
from reference.mechanism import CrossSlider, Dyad, FixedGuide, Group, Slider, SlottedLink, Yoke
from reference.motion import Motion

POINTS = 17
ROUNDS = 11
APPROACH = np.array([1e-3, 1e-4, 1e-5])
"""Of the range, from its end: where a quantity is compared to see whether it grows without bound."""
GROWS = 1.8
"""At least, from each of these to the next: of 1 / sqrt(distance) it is 3.2."""
REST = 1e-9
"""A rate below this share of its largest is rounding: what should stand still, and does."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """To and fro between two dead points.

    Attributes
    ----------
    name : the slider's point, or the link that rocks
    is_angle : whether `travel` is an angle (rad) or a length (m)
    dead_points : driven coordinates at which it turns back, ascending
    travel : between its two ends, None where it turns back more than twice a cycle
    time_ratio : of the slower stroke to the faster one, at constant crank speed; None as above
    """

    name: str
    is_angle: bool
    dead_points: tuple[float, ...]
    travel: float | None
    time_ratio: float | None


@dataclass(frozen=True, slots=True)
class Extreme:
    """A largest or smallest value and where; infinite towards ends of the range, where unbounded."""

    value: float
    at: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class _Output:
    """What may go to and fro: its rate, and its place along the guide or its arm."""

    name: str
    is_angle: bool
    rate: Callable[[Motion], FloatArray]
    place: Callable[[Motion], ComplexArray]


def strokes_of(subject: Subject) -> tuple[Stroke, ...]:
    """Of all sliders on fixed guides and all links hinged to the ground that go to and fro."""
    found = (_stroke(subject, output) for output in _outputs(subject))
    return tuple(stroke for stroke in found if stroke.dead_points)


def _outputs(subject: Subject) -> Iterator[_Output]:
    for group in subject.structure.groups:
        match group:
            case Slider(guide=FixedGuide() as guide) | Yoke(guide=guide):
                yield _slider(group.node, guide)
            case CrossSlider(guides=guides):
                yield from (_slider(group.node, guide) for guide in guides if isinstance(guide, FixedGuide))
            case Dyad() | SlottedLink():
                yield from _rockers(subject, group)
            case _:
                pass


def _slider(node: str, guide: FixedGuide) -> _Output:
    along = direction(guide.angle_rad)

    def rate(motion: Motion) -> FloatArray:
        return dot(along, motion.velocity[node])

    def place(motion: Motion) -> ComplexArray:
        return np.asarray(dot(along, motion.position[node]) + 0j)

    return _Output(node, False, rate, place)  # noqa: FBT003 - the field's name says it


def _rockers(subject: Subject, group: Group) -> Iterator[_Output]:
    match group:
        case Dyad(pins=pins, links=links):
            arms = [(link, pin, group.node) for pin, link in zip(pins, links, strict=True)]
        case SlottedLink():
            arms = [(group.link, group.pivot, group.node)]
        case _:
            arms = []
    for link, pin, node in arms:
        if subject.structure.is_ground(pin):

            def rate(motion: Motion, link: str = link) -> FloatArray:
                return motion.omega[link]

            def place(motion: Motion, pin: str = pin, node: str = node) -> ComplexArray:
                return np.asarray(motion.position[node] - motion.position[pin])

            yield _Output(link, True, rate, place)  # noqa: FBT003 - as above


def _stroke(subject: Subject, output: _Output) -> Stroke:
    cycle = subject.cycle
    dead = tuple(sorted(set(_turning_points(subject, output))))
    if not cycle.turns or len(dead) != 2:
        return Stroke(output.name, output.is_angle, dead, None, None)
    first, second = dead
    period = float(cycle.driven[-1] - cycle.driven[0])
    ways = (second - first, period - (second - first))
    return Stroke(output.name, output.is_angle, dead, _travel(subject, output, dead), max(ways) / min(ways))


def _turning_points(subject: Subject, output: _Output) -> Iterator[float]:
    """Where the rate changes its sign, refined from the samples; over a full cycle its two ends are one."""
    cycle = subject.cycle
    samples, motion = subject.fine
    rate = output.rate(motion)
    told = np.isfinite(rate) & (np.abs(rate) > REST * np.nanmax(np.abs(rate), initial=0.0))
    driven, signs = samples[told], np.sign(rate[told])
    if cycle.turns and driven.size:
        period = cycle.driven[-1] - cycle.driven[0]
        driven, signs = np.append(driven, driven[0] + period), np.append(signs, signs[0])
    for k in np.flatnonzero(signs[1:] != signs[:-1]):

        def holds(points: FloatArray, sign: float = signs[k]) -> np.ndarray:
            return np.asarray(output.rate(subject.motion_at(points)) * sign > 0.0)

        at = change(holds, float(driven[k]), float(driven[k + 1]))[0]
        if cycle.turns:
            # A dead point at the cycle's end, but for rounding, is the one at its beginning.
            at = at % period
            at = 0.0 if period - at < REST * period else at
        yield at


def _travel(subject: Subject, output: _Output, dead: tuple[float, ...]) -> float:
    """Between two dead points, an angle followed from sample to sample."""
    driven, _ = subject.fine
    between = driven[(driven > dead[0]) & (driven < dead[1])]
    place = output.place(subject.motion_at(np.array([dead[0], *between, dead[1]])))
    if not output.is_angle:
        return abs(float((place[-1] - place[0]).real))
    turned = np.angle(place[1:] / place[:-1])
    return abs(float(np.nansum(turned)))


def extremes(subject: Subject, quantity: Quantity) -> tuple[Extreme, Extreme]:
    """The smallest and the largest value over the cycle, not only at its samples."""
    values = subject.values(quantity, subject.fine[1])
    smallest, largest = (_refined(subject, quantity, values, sign) for sign in (-1.0, 1.0))
    ends = list(unbounded_ends(subject, quantity))
    falls, grows = (tuple(end for end, way in ends if way == sign) for sign in (-1.0, 1.0))
    return (
        Extreme(-np.inf, falls) if falls else smallest,
        Extreme(np.inf, grows) if grows else largest,
    )


def _refined(subject: Subject, quantity: Quantity, values: FloatArray, sign: float) -> Extreme:
    driven, _ = subject.fine
    if not np.isfinite(values).any():
        return Extreme(np.nan, ())
    best = int(np.nanargmax(sign * values))
    at, value = float(driven[best]), float(values[best])
    low, high = driven[max(best - 1, 0)], driven[min(best + 1, driven.size - 1)]
    if np.ptp(values[np.isfinite(values)]) <= REST * abs(value):
        return Extreme(value, (at,))
    for _ in range(ROUNDS):
        points = np.linspace(low, high, POINTS)
        found = sign * subject.values_at(quantity, points)
        k = int(np.nanargmax(found)) if np.isfinite(found).any() else 0
        if found[k] > sign * value:
            at, value = float(points[k]), sign * float(found[k])
        low, high = points[max(k - 1, 0)], points[min(k + 1, POINTS - 1)]
    return Extreme(value, (at,))


def unbounded_ends(subject: Subject, quantity: Quantity) -> Iterator[tuple[float, float]]:
    """Ends of the range towards which a quantity grows without bound, and its sign there."""
    cycle: Cycle = subject.cycle
    low, high = float(cycle.driven[0]), float(cycle.driven[-1])
    for stop, inward in zip(cycle.following.stops, (1.0, -1.0), strict=True):
        if stop is None or cycle.turns:
            continue
        values = subject.values_at(quantity, stop.at + inward * (high - low) * APPROACH)
        if np.all(np.abs(values[1:]) > GROWS * np.abs(values[:-1])):
            yield stop.at, float(np.sign(values[-1]))
