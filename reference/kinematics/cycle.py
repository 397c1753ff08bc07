"""The motion over a cycle of the driving link, or over the range in which it can move.

The driving link takes the variant's own speed and acceleration in every position; sides are followed
through flat positions by `reference.kinematics.continuation`.
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace

import numpy as np

from reference.errors import CallError
from reference.geometry import FloatArray
from reference.kinematics.continuation import TURN, BoolArray, Continuation, Event, change, follow
from reference.kinematics.motion import Motion, move, move_where_possible
from reference.kinematics.solving import one_variant, solve
from reference.kinematics.triad import SAME
from reference.mechanism import (
    Crank,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Group,
    Mechanism,
    Plate,
    Slider,
    SlottedLink,
    Triad,
    guides_of,
)

FEWEST, MOST = 3, 100_001
"""Fewest samples of a cycle (start, middle, end), and more than any table or diagram needs."""
SEARCHED = 1441
"""Positions of a turn, a quarter of a degree apart, at which other ranges are searched."""
AT_IT = 1e-9
"""A sample this close to a singular position, as a share of the range, is singular."""


@dataclass(frozen=True, slots=True)
class Cycle:
    """A mechanism's motion over the cycle of its driving link, arrays of shape (N,).

    Attributes
    ----------
    following : how far the mechanism can go and where it passes flat positions; makes the mechanism at
        any other driving coordinate
    driving : crank angle, rad, or displacement of the driving slider, m; ascending
    mechanism : at every sample, each group with the side it is on
    motion : SI; nan in singular samples
    start : the variant's own driving coordinate
    turns : of the crank until all is as before: 1, seldom 2; 0 where it cannot turn fully
    elsewhere : other ranges in which the mechanism assembles with its authored sides
    undetermined : why a sample has no rates, by its index
    """

    following: Continuation
    driving: FloatArray
    mechanism: Mechanism
    motion: Motion
    start: float
    turns: int
    elsewhere: tuple[tuple[float, float], ...]
    undetermined: dict[int, str]

    @property
    def is_turned(self) -> bool:
        """True if a crank drives, so that driving coordinates are angles."""
        return isinstance(self.mechanism.driver, Crank)

    @property
    def passed(self) -> tuple[Event, ...]:
        """Flat positions on the cycle; one at the start of a full cycle is not repeated at its end."""
        low, high = float(self.driving[0]), float(self.driving[-1])
        slack = AT_IT * (high - low)
        last = high - slack if self.turns else high + slack
        return tuple(event for event in self.following.events if low - slack <= event.at < last)


def cycle(mechanism: Mechanism, samples: int = 361) -> Cycle:
    """Return the motion of one variant over 0..360 degrees of its crank, or over the range it can reach.

    A crank that returns to another assembly after one turn is followed over two turns; a driving slider over
    the range in which the mechanism assembles. A group stays on its authored side except at flat positions,
    which it passes smoothly (by velocity). Singular samples have no rates.

    Raises CallError for too few or too many samples, MechanismError if the variant itself has no motion.
    """
    if not FEWEST <= samples <= MOST:
        raise CallError("samples", f"{samples} samples: a whole number from {FEWEST} to {MOST} is needed")
    move(mechanism, accelerations=False)
    following, turns = _followed(mechanism)
    low, high = (0.0, turns * TURN) if turns else (following.low, following.high)
    driving = np.linspace(low, high, samples)
    undetermined = _singular(following, driving)
    at_samples = following.at(driving)
    motion = _motion(following, at_samples, driving, undetermined)
    elsewhere = () if turns else _elsewhere(following)
    return Cycle(following, driving, at_samples, motion, following.start, turns, elsewhere, undetermined)


def _followed(mechanism: Mechanism) -> tuple[Continuation, int]:
    """Follow the mechanism over its whole cycle; return it and the number of turns of the cycle."""
    driver = mechanism.driver
    if not isinstance(driver, Crank):
        start, reach = float(driver.displacement_m[0]), _largest_travel(mechanism, driver)
        return follow(mechanism, start, start - reach, start + reach), 0
    start = float(driver.angle_rad[0]) % TURN
    following = follow(mechanism, start, start - TURN, start + 2.0 * TURN)
    if following.stops == (None, None):
        reversed_once = any(
            sum(start < at < start + TURN for at in changes) % 2 for changes in following.changes.values()
        )
        tracks, after = following.tracks.values(), (start, start + TURN)
        angles = [np.interp(after, one.driving, each) for one in tracks for each in (one.direction, one.leg)]
        elsewhere = any(abs(np.exp(1j * one[1]) - np.exp(1j * one[0])) > SAME for one in angles)
        return following, 2 if reversed_once or elsewhere else 1
    # The middle of the range comes to lie between -90 and 270 degrees.
    middle = 0.5 * (following.low + following.high)
    shift = -TURN * np.floor((middle + 0.25 * TURN) / TURN)
    return _shifted(following, float(shift)), 0


def _shifted(following: Continuation, by: float) -> Continuation:
    """Shift the driving coordinates by an angle, so that the range lies about the first turn."""
    if by == 0.0:
        return following
    low, high = (stop and replace(stop, at=stop.at + by) for stop in following.stops)
    return replace(
        following,
        start=following.start + by,
        low=following.low + by,
        high=following.high + by,
        stops=(low, high),
        changes={node: tuple(at + by for at in changes) for node, changes in following.changes.items()},
        tracks={node: replace(track, driving=track.driving + by) for node, track in following.tracks.items()},
    )


def _largest_travel(mechanism: Mechanism, driver: DrivingSlider) -> float:
    """Upper bound of a driving slider's travel, m: all lengths in line, plus all distances on the ground."""
    take = one_variant(0)
    places = [complex(take(place)) for place in mechanism.ground_m.values()]
    guides = [guide for group in mechanism.groups for guide in guides_of(group)]
    places += [complex(take(guide.through_m)) for guide in guides if isinstance(guide, FixedGuide)]
    total = abs(float(take(driver.displacement_m)))
    total += sum(abs(place - complex(take(driver.guide_m))) for place in places)
    return 2.0 * (total + sum(_lengths(group) for group in mechanism.groups)) or 1.0


def _lengths(group: Group) -> float:
    match group:
        case Dyad(lengths_m=lengths) | Plate(lengths_m=lengths):
            return float(np.sum(lengths))
        case Triad(legs_m=legs, sides_m=sides):
            return float(np.sum(legs) + np.sum(sides))
        case Slider(length_m=length) | SlottedLink(offset_m=length):
            return float(np.abs(length[0]))
    return 0.0


def _singular(following: Continuation, driving: FloatArray) -> dict[int, str]:
    """Return samples in a flat position or at a stop, by index, with the reason why they have no rates."""
    within = AT_IT * float(driving[-1] - driving[0])
    stops = tuple(stop for stop in following.stops if stop is not None)
    undetermined: dict[int, str] = {}
    for event in (*following.events, *stops):
        for index in np.flatnonzero(np.abs(driving - event.at) <= within):
            undetermined.setdefault(int(index), f"{event.node}: {event.why}")
    return undetermined


def _motion(
    following: Continuation, at_samples: Mechanism, driving: FloatArray, undetermined: dict[int, str]
) -> Motion:
    """Return the motion at all samples; at singular ones, positions only."""
    singular = np.zeros(driving.size, dtype=np.bool_)
    singular[list(undetermined)] = True
    motion = move_where_possible(following.at(np.where(singular, following.start, driving)))
    with np.errstate(all="ignore"):
        for name, joint in solve(at_samples, accelerations=False).joints.items():
            place = np.broadcast_to(joint.position, driving.shape)
            motion.position[name][singular] = place[singular]
    for index in np.flatnonzero(~np.isfinite(motion.predicted_error)):
        undetermined.setdefault(int(index), "too near to a singular position to be determined")
    motion.predicted_error[singular] = np.inf
    for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
        for values in rates.values():
            values[singular] = np.nan
    return motion


def _elsewhere(following: Continuation) -> tuple[tuple[float, float], ...]:
    """Return other ranges in which the mechanism assembles as authored, to full accuracy."""
    authored = replace(following, changes={})
    driver = following.mechanism.driver
    if isinstance(driver, Crank):
        outside = [(following.high, following.low + TURN)]
    else:
        reach = _largest_travel(following.mechanism, driver)
        outside = [
            (following.start - reach, following.low),
            (following.high, following.start + reach),
        ]

    def assembles(driving: FloatArray) -> BoolArray:
        with np.errstate(all="ignore"):
            joints = solve(authored.at(driving), accelerations=False).joints.values()
        closed = [np.broadcast_to(np.isfinite(joint.position), driving.shape) for joint in joints]
        return np.asarray(np.all(closed, axis=0))

    ranges: list[tuple[float, float]] = []
    for low, high in outside:
        if high - low > AT_IT * TURN:
            ranges += _runs(np.linspace(low, high, SEARCHED)[1:-1], assembles)
    return tuple(ranges)


def _runs(grid: FloatArray, assembles: Callable[[FloatArray], BoolArray]) -> Iterator[tuple[float, float]]:
    """Yield the ranges of a grid in which the mechanism assembles, their ends to machine precision."""
    held = assembles(grid)
    edges = np.flatnonzero(np.diff(held.astype(np.int8), prepend=0, append=0))
    for first, after in edges.reshape(-1, 2):
        low, high = grid[first], grid[after - 1]
        if first > 0:
            low = change(assembles, low, grid[first - 1])[0]
        if after < grid.size:
            high = change(assembles, high, grid[after])[0]
        yield float(low), float(high)
