"""Run time per variant, side by side with other programs, with the error of each beside it.

All solve the same mechanism, the pump (four-bar, plate, rod and slider), at so many crank angles between
those of its first and its last variant. Building a mechanism is no part of the time, for none.
"""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from grader.bench.closure import ExactMotion, exact_motion_of, rounded
from grader.bench.jets import Pair
from grader.bench.peers import (
    PEERS,
    Answer,
    Package,
    Peer,
    Places,
    answer_of,
    error_of,
    sketch,
)
from grader.bench.timing import medians_us
from reference.assembly import build_mechanism
from reference.assignment import Assignment, load_assignment
from reference.construction import evaluate
from reference.derivation import construction_of
from reference.geometry import FloatArray
from reference.mechanism import Mechanism
from reference.motion import Motion, move
from reference.parameters import parameters_of
from reference.plan import exact_plan

BATCHES = (1, 30, 10_000)
CLASS = 30
ROUNDS, ROUNDS_QUICK = 21, 5
PEER_VARIANTS = 300
"""A peer without a road for many variants takes as long for each: so many are timed for a larger batch."""
ASSIGNMENT = "pump"
NOT_INSTALLED = "not installed"
PLANS = "a class with both plans"


@dataclass(frozen=True, slots=True)
class SpeedRow:
    """One solver: median microseconds per variant by batch size, and its largest errors in a class.

    Attributes
    ----------
    accelerations : positions, velocities and accelerations; False: velocities only
    us : by the number of variants at once; empty where the solver is not installed
    velocity_error, acceleration_error : of the joints, relative to the largest of each plan
    """

    solver: str
    version: str | None
    accelerations: bool
    us: Mapping[int, float]
    velocity_error: float | None = None
    acceleration_error: float | None = None
    note: str = ""


@dataclass(frozen=True, slots=True)
class _Entry:
    """What is to be timed for one row: by batch size, a run and how many variants it solves."""

    solver: str
    version: str | None
    accelerations: bool
    runs: Mapping[int, tuple[Callable[[], object], int]] = field(default_factory=dict)
    answers: Sequence[Answer] = ()
    note: str = ""


def measure_speed(*, quick: bool = False, batches: Sequence[int] = BATCHES) -> Iterator[SpeedRow]:
    """Ours by each road, then the peers; the same for velocities alone; then a class's plans."""
    bench = _Bench(load_assignment(ASSIGNMENT), batches)
    entries = list(bench.entries())
    runs = {(row, count): run for row, one in enumerate(entries) for count, (run, _) in one.runs.items()}
    medians = medians_us(runs, ROUNDS_QUICK if quick else ROUNDS)
    for row, entry in enumerate(entries):
        us = {count: medians[row, count] / solved for count, (_, solved) in entry.runs.items()}
        yield bench.row(entry, us)


def speed_rows() -> int:
    """How many rows `measure_speed` gives."""
    return 5 + sum(1 + peer.velocities_alone for peer in PEERS)


class _Bench:
    """The mechanisms of each batch size, and the truth of a class."""

    def __init__(self, assignment: Assignment, batches: Sequence[int]) -> None:
        self.assignment = assignment
        self.mechanisms = {count: spread(assignment, count) for count in batches}
        self.reference = spread(assignment, CLASS)
        self.truth = [_rounded(exact_motion_of(self.reference, index)) for index in range(CLASS)]

    def entries(self) -> Iterator[_Entry]:
        """All rows in their order."""
        for accelerations in (True, False):
            yield self._closed_form(accelerations=accelerations)
            yield self._construction(accelerations=accelerations)
            for peer in PEERS:
                if accelerations or peer.velocities_alone:
                    yield self._peer(peer, accelerations=accelerations)
        variants = self.assignment.variants()[:CLASS]
        run = partial(exact_plan, self.assignment, variants)
        yield _Entry(PLANS, None, accelerations=True, runs={len(variants): (run, len(variants))})

    def _closed_form(self, *, accelerations: bool) -> _Entry:
        """All variants of a batch by one call."""
        runs = {
            count: (partial(move, one, accelerations=accelerations), count)
            for count, one in self.mechanisms.items()
        }
        return _Entry("closed form", None, accelerations, runs, _answers(move(self.reference)))

    def _construction(self, *, accelerations: bool) -> _Entry:
        """The steps of mechanism and plans, evaluated."""
        runs, scale = {}, np.asarray(0.01)
        for count, one in self.mechanisms.items():
            steps = construction_of(one, accelerations=accelerations)
            runs[count] = partial(evaluate, steps, parameters_of(one, scale, scale, scale)), count
        return _Entry("construction", None, accelerations, runs)

    def _peer(self, peer: Package, *, accelerations: bool) -> _Entry:
        """One variant after another."""
        if peer.version is None:
            return _Entry(peer.name, None, accelerations, note=NOT_INSTALLED)
        solver, starts = peer.build(self.reference), _starts(self.reference)
        answers = [solver.solve(index, start)() for index, start in enumerate(starts)]
        runs = {}
        for count in self.mechanisms:
            timed = spread(self.assignment, min(count, PEER_VARIANTS))
            starts = _starts(timed)
            run = _one_after_another(peer.build(timed), starts, accelerations=accelerations)
            runs[count] = run, len(starts)
        return _Entry(peer.name, peer.version, accelerations, runs, answers)

    def row(self, entry: _Entry, us: Mapping[int, float]) -> SpeedRow:
        """What was measured of an entry."""
        velocity = acceleration = None
        if entry.answers:
            pairs = list(zip(entry.answers, self.truth, strict=True))
            velocity = max(error_of(found.velocity, exact.velocity) for found, exact in pairs)
            if entry.accelerations:
                acceleration = max(error_of(found.acceleration, exact.acceleration) for found, exact in pairs)
        return SpeedRow(
            entry.solver, entry.version, entry.accelerations, us, velocity, acceleration, entry.note
        )


def spread(assignment: Assignment, count: int) -> Mechanism:
    """The assignment's mechanism at so many crank angles between those of its first and last variant."""
    variants = assignment.variants()
    known = assignment.values(variants)

    def between(values: FloatArray) -> FloatArray:
        return np.linspace(values[0], values[-1], count)

    values = {name: between(np.broadcast_to(value, (len(variants),))) for name, value in known.items()}
    return build_mechanism(assignment.mechanism_file, values, count)


def _rounded(motion: ExactMotion) -> Answer:
    def read(rates: Mapping[str, Pair]) -> Places:
        return {joint: rounded(pair) for joint, pair in rates.items()}

    return Answer(read(motion.position), read(motion.velocity), read(motion.acceleration))


def _starts(mechanism: Mechanism) -> list[Places]:
    """By variant, where the joints are in a sketch."""
    drawn = sketch(mechanism, move(mechanism, accelerations=False).position)
    count = drawn[mechanism.driver.pin].size
    return [{joint: complex(at[index]) for joint, at in drawn.items()} for index in range(count)]


def _one_after_another(solver: Peer, starts: Sequence[Places], *, accelerations: bool) -> Callable[[], None]:
    def run() -> None:
        for index, start in enumerate(starts):
            solver.solve(index, start, accelerations=accelerations)

    return run


def _answers(motion: Motion) -> list[Answer]:
    return [answer_of(motion, index) for index in range(motion.predicted_error.size)]
