"""Counts of wrong branches in many random mechanisms, near singular positions and far from them.

All solvers get four-bars and slider-cranks; ours gets slotted links as well.

A tenth of the cases lies nearer than 0.1 to a singular position, down to 1e-14. The assembly that a solver
found is told by the signed distance of the group's node from the line of symmetry of both assemblies.
"""

import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from reference.geometry import ComplexArray, FloatArray, cross, direction, dot
from reference.kinematics.motion import move_where_possible
from reference.mechanism import Crank, Dyad, FixedGuide, Group, Mechanism, Slider, SlotPoint, SlottedLink
from tests.bench.peers import FSOLVE, Fsolve, NoAnswerError, Places, one_of, sketch

CASES, CASES_QUICK = 100_000, 2_000
PEER_CASES, PEER_CASES_QUICK = 2_000, 100
NEAR_SHARE = 0.1
SEED = 7


@dataclass(frozen=True, slots=True)
class BranchRow:
    """Counts of one solver's outcomes in random cases."""

    solver: str
    cases: int
    wrong: int
    refused: int
    silent: int


def count_branches(*, quick: bool = False) -> Iterator[BranchRow]:
    """Count ours in many cases, then scipy's `fsolve` in fewer: it takes hundreds of times as long."""
    yield count_ours(quick=quick)
    yield count_peer(quick=quick)


def count_ours(*, quick: bool = False) -> BranchRow:
    """Count the outcomes of the closed form, on arrays."""
    count = CASES_QUICK if quick else CASES
    wrong = refused = silent = 0
    for mechanism in _all_kinds(count):
        motion = move_where_possible(mechanism)
        told = np.isfinite(motion.predicted_error)
        numbers = (*motion.position.values(), *motion.velocity.values(), *motion.acceleration.values())
        finite = np.isfinite(sum(numbers))
        share = _side_share(mechanism, motion.position)
        refused += int(np.sum(~told))
        silent += int(np.sum(told & ~finite))
        wrong += int(np.sum(told & finite & (share < 0.0)))
    return BranchRow("closed form", count, wrong, refused, silent)


def count_peer(*, quick: bool = False) -> BranchRow:
    """Count scipy's outcomes, each case a mechanism of its own."""
    count = PEER_CASES_QUICK if quick else PEER_CASES
    tally = dict.fromkeys(("wrong", "refused", "silent"), 0)
    for mechanism in _both_kinds(count):
        starts = sketch(mechanism, move_where_possible(mechanism).position)
        for index in range(count // 2):
            one = one_of(mechanism, index, np.atleast_1d)
            start = {joint: complex(places[index]) for joint, places in starts.items()}
            outcome = _outcome(one, start)
            if outcome:
                tally[outcome] += 1
    return BranchRow(FSOLVE, count, **tally)


def _outcome(mechanism: Mechanism, start: Places) -> str | None:
    """The kind of failure (refused, silent or wrong); None if the answer is right."""
    try:
        answer = Fsolve(mechanism).solve(0, start)()
    except NoAnswerError:
        return "refused"
    numbers = (*answer.position.values(), *answer.velocity.values(), *answer.acceleration.values())
    if not all(math.isfinite(abs(number)) for number in numbers):
        return "silent"
    at = {joint: np.atleast_1d(place) for joint, place in answer.position.items()}
    return "wrong" if _side_share(mechanism, at)[0] < -0.5 else None


def _side_share(mechanism: Mechanism, at: Mapping[str, ComplexArray]) -> FloatArray:
    """The node's signed distance from the line of symmetry over the right one: 1 right, -1 mirrored."""
    group = mechanism.groups[0]
    if isinstance(group, Dyad):
        p, q = (at[pin] for pin in group.pins)
        base, (first, second) = np.abs(q - p), group.lengths_m
        area = (first + second - base) * (first + second + base)
        area = area * (base - first + second) * (base + first - second)
        meant = 0.5 * np.sqrt(np.maximum(area, 0.0))
        found = cross(q - p, at[group.node] - p)
    elif isinstance(group, Slider) and isinstance(group.guide, FixedGuide):
        along, pin = direction(group.guide.angle_rad), at[group.pin]
        height = cross(along, pin - group.guide.through_m)
        meant = np.sqrt(np.maximum((group.length_m - height) * (group.length_m + height), 0.0))
        found = dot(at[group.node] - pin, along)
    elif isinstance(group, SlottedLink):
        arm = at[group.pin] - at[group.pivot]
        points = [one for one in mechanism.groups if isinstance(one, SlotPoint)]
        along = (at[points[0].node] - at[group.pivot]) / points[0].local_m
        meant = np.sqrt(np.maximum(np.abs(arm) - group.offset_m, 0.0) * (np.abs(arm) + group.offset_m))
        found = dot(along, arm)
    else:
        raise TypeError(f"a dyad or a slider on a fixed guide is expected, not {group!r}")
    with np.errstate(all="ignore"):
        return np.asarray(group.side * found / meant)


def _all_kinds(count: int) -> tuple[Mechanism, Mechanism, Mechanism]:
    """A third each of four-bars, slider-cranks and slotted links."""
    rng = np.random.default_rng(SEED)
    third = count // 3
    return _four_bars(rng, third), _slider_cranks(rng, third), _slotted_links(rng, count - 2 * third)


def _both_kinds(count: int) -> tuple[Mechanism, Mechanism]:
    """Half four-bars, half slider-cranks, one on arrays each."""
    rng = np.random.default_rng(SEED)
    return _four_bars(rng, count // 2), _slider_cranks(rng, count // 2)


def _crank(rng: np.random.Generator, count: int) -> tuple[Crank, ComplexArray]:
    length, angle = rng.uniform(0.2, 1.0, count), rng.uniform(-np.pi, np.pi, count)
    omega, epsilon = rng.uniform(1.0, 20.0, count), rng.uniform(-50.0, 50.0, count)
    crank = Crank("1", "O1", "A", length, angle, omega, epsilon, accelerated=True)
    return crank, length * direction(angle)


def _sides(rng: np.random.Generator, count: int) -> Any:
    return rng.choice((-1, 1), count)


def _shares(rng: np.random.Generator, count: int) -> FloatArray:
    """Relative distances from a singular position: uniform, and for some logarithmic down to 1e-14."""
    near = rng.uniform(size=count) < NEAR_SHARE
    return np.where(near, 10.0 ** rng.uniform(-14.0, -1.0, count), rng.uniform(0.0, 1.0, count))


def _mechanism(crank: Crank, ground: Mapping[str, ComplexArray], *groups: Group) -> Mechanism:
    origin = np.zeros(crank.length_m.size, dtype=np.complex128)
    return Mechanism({"O1": origin, **ground}, crank, groups)


def _four_bars(rng: np.random.Generator, count: int) -> Mechanism:
    crank, pin = _crank(rng, count)
    first = rng.uniform(0.5, 2.0, count)
    second = first * rng.uniform(1.2, 3.0, count) ** _sides(rng, count)
    share, low, high = _shares(rng, count), np.abs(first - second), first + second
    room = high - low
    span = np.where(rng.uniform(size=count) < 0.5, low + room * share, high - room * share)
    pivot = pin + span * direction(rng.uniform(-np.pi, np.pi, count))
    dyad = Dyad("B", ("A", "O2"), ("2", "3"), (first, second), _sides(rng, count))
    return _mechanism(crank, {"O2": pivot}, dyad)


def _slider_cranks(rng: np.random.Generator, count: int) -> Mechanism:
    crank, pin = _crank(rng, count)
    length, angle = rng.uniform(0.5, 2.0, count), rng.uniform(-np.pi, np.pi, count)
    height = length * (1.0 - _shares(rng, count)) * _sides(rng, count)
    along = direction(angle)
    through = pin - 1j * along * height + along * rng.uniform(-1.0, 1.0, count)
    slider = Slider("B", "A", "2", length, FixedGuide(through, angle), _sides(rng, count))
    return _mechanism(crank, {}, slider)


def _slotted_links(rng: np.random.Generator, count: int) -> Mechanism:
    """Slotted links with offset, the pin ahead of the pivot or behind; another point shows the direction."""
    crank, pin = _crank(rng, count)
    offset = rng.uniform(0.2, 1.0, count)
    distance = offset * (1.0 + 2.0 * _shares(rng, count))
    pivot = pin - distance * direction(rng.uniform(-np.pi, np.pi, count))
    link = SlottedLink("A3", "A", "O2", "3", offset, "F", _sides(rng, count))
    point = SlotPoint("S", "A3", "3", np.asarray(rng.uniform(0.5, 1.0, count) + 0.2j, np.complex128))
    return _mechanism(crank, {"O2": pivot}, link, point)
