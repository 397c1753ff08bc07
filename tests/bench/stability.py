"""Measure errors near singular positions in units of the unavoidable error; wrong branches; silent NaN.

At a relative distance delta from a singular position an error of one rounding, eps, in the data moves
the velocities by about eps/delta of the largest: no solver in double precision that takes its
data as known to eps does better. Here the doubles are taken as exact, and the truth is the exact motion
for exactly these doubles, in 50 digits (`oracle`): errors are given in units of eps/delta. Where the
motion is smooth through the position no accuracy need be lost, and errors are given in units of eps.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from reference.errors import MechanismError
from reference.kinematics.motion import Motion, move, move_where_possible
from reference.mechanism import Dyad, Group, Mechanism, Slider, SlottedLink
from tests.bench.oracle import ExactMotion
from tests.bench.peers import FSOLVE, Answer, Fsolve, NoAnswerError, answer_of, error_of, sketch, stacked
from tests.bench.singular import KINDS, Case, Kind

EPSILON = float(np.finfo(np.float64).eps)
DISTANCES = tuple(10.0**-k for k in range(1, 15))
DISTANCES_QUICK = (1e-1, 1e-4, 1e-8, 1e-12, 1e-14)
CASES, CASES_QUICK = 30, 5
OURS, OURS_ON_ARRAYS = "closed form", "on arrays"
SEED = 20


@dataclass(frozen=True, slots=True)
class Truth:
    """The exact motion of one case, rounded once, and the positions of its mirrored assembly."""

    position: Mapping[str, complex]
    velocity: Mapping[str, complex]
    acceleration: Mapping[str, complex]
    mirrored: Mapping[str, complex] | None


@dataclass(slots=True)
class Outcomes:
    """One solver's results at one distance from one kind of singular position.

    Attributes
    ----------
    velocity, acceleration : errors of the answers on the right branch, in units of eps/delta (eps for a
        smooth kind)
    wrong, refused, silent : answers on the mirrored branch; reported failures; nan
    beyond : answers whose error is larger than the solver predicts, and than one rounding
    """

    velocity: list[float] = field(default_factory=list)
    acceleration: list[float] = field(default_factory=list)
    wrong: int = 0
    refused: int = 0
    silent: int = 0
    beyond: int = 0

    @property
    def worst(self) -> float | None:
        """The largest error; None without such answers."""
        return max([*self.velocity, *self.acceleration], default=None)


@dataclass(frozen=True, slots=True)
class StabilityRow:
    """The outcomes by solver at one distance from one kind of singular position."""

    kind: str
    title: str
    smooth: bool
    delta: float
    outcomes: Mapping[str, Outcomes]


def measure_stability(*, quick: bool = False, kinds: Sequence[Kind] = KINDS) -> Iterator[StabilityRow]:
    """Measure each kind at each distance; the same random cases for every solver."""
    count = CASES_QUICK if quick else CASES
    for kind in kinds:
        rng = np.random.default_rng([SEED, *kind.id.encode()])
        for delta in DISTANCES_QUICK if quick else DISTANCES:
            yield _row(kind, delta, [kind.draw(rng, delta) for _ in range(count)])


def _row(kind: Kind, delta: float, cases: Sequence[Case]) -> StabilityRow:
    truths = [truth_of(case.mechanism) for case in cases]
    mechanisms = [case.mechanism for case in cases]
    answers = {
        OURS: [_by_numbers(one) for one in mechanisms],
        OURS_ON_ARRAYS: _all_at_once(move_where_possible(stacked(mechanisms))),
    }
    if kind.plain:
        answers[FSOLVE] = [_by_fsolve(*pair) for pair in zip(mechanisms, truths, strict=True)]
    outcomes = {name: Outcomes() for name in answers}
    for name, told in answers.items():
        for answer, case, truth in zip(told, cases, truths, strict=True):
            _count(outcomes[name], answer, truth, EPSILON if kind.smooth else EPSILON / case.delta)
    return StabilityRow(kind.id, kind.title, kind.smooth, delta, outcomes)


def truth_of(mechanism: Mechanism) -> Truth:
    """The exact motion of a mechanism of one variant, and its mirrored assembly where it has one."""
    motion = ExactMotion(mechanism)
    flipped = tuple(map(_flipped, mechanism.groups))
    mirrored = None
    if flipped != mechanism.groups:
        mirrored = _rounded(ExactMotion(replace(mechanism, groups=flipped)).position)
    return Truth(
        _rounded(motion.position), _rounded(motion.velocity), _rounded(motion.acceleration), mirrored
    )


def _flipped(group: Group) -> Group:
    """A group on its other side, where it has two."""
    if isinstance(group, Dyad | Slider | SlottedLink):
        return replace(group, side=-group.side)
    return group


def _rounded(exact: Mapping[str, Any]) -> dict[str, complex]:
    return {joint: complex(number) for joint, number in exact.items()}


def _by_numbers(mechanism: Mechanism) -> Answer | None:
    """Solve one variant by itself; None if it is refused."""
    try:
        return answer_of(move(mechanism), 0)
    except MechanismError:
        return None


def _all_at_once(motion: Motion) -> list[Answer | None]:
    """The answer of every case; None if it is refused."""
    told = np.isfinite(motion.predicted_error)
    return [answer_of(motion, index) if told[index] else None for index in range(told.size)]


def _by_fsolve(mechanism: Mechanism, truth: Truth) -> Answer | None:
    at = {joint: np.array([z]) for joint, z in truth.position.items()}
    start = {joint: complex(z[0]) for joint, z in sketch(mechanism, at).items()}
    try:
        return Fsolve(mechanism).solve(0, start)()
    except NoAnswerError:
        return None


def _count(outcomes: Outcomes, answer: Answer | None, truth: Truth, unit: float) -> None:
    if answer is None:
        outcomes.refused += 1
        return
    errors = [
        error_of(getattr(answer, rates), getattr(truth, rates)) for rates in ("velocity", "acceleration")
    ]
    if is_mirrored(answer.position, truth):
        outcomes.wrong += 1
    elif not all(math.isfinite(error) for error in errors):
        outcomes.silent += 1
    else:
        predicted = answer.predicted_error
        outcomes.beyond += predicted is not None and max(errors) > max(predicted, EPSILON)
        outcomes.velocity.append(errors[0] / unit)
        outcomes.acceleration.append(errors[1] / unit)


def is_mirrored(found: Mapping[str, complex], truth: Truth) -> bool:
    """Return whether some joint lies more than three quarters of the way to its mirrored position."""
    if truth.mirrored is None:
        return False
    for joint, right in truth.position.items():
        way = truth.mirrored[joint] - right
        if way and joint in found and ((found[joint] - right) / way).real > 0.75:
            return True
    return False
