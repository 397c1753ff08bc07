"""Measure run time per variant and errors, side by side with another solver.

All solve the same mechanism, the pump (four-bar, plate, rod and slider), at crank angles between those of
its first and its last variant. The time to build a mechanism is not counted for any of them.
"""

import statistics
import time
from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from importlib.metadata import version
from typing import Any, TypeVar

import numpy as np

from reference.authored.assembly import build_mechanism
from reference.authored.assignment import Assignment, load_assignment
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of
from reference.geometry import FloatArray
from reference.kinematics.motion import Motion, move
from reference.mechanism import Mechanism
from tests.bench.oracle import ExactMotion
from tests.bench.peers import FSOLVE, Answer, Fsolve, Places, answer_of, error_of, sketch

LEAST_RUN_S = 0.02
"""A run is repeated inside until it takes so long, so that the clock's own steps do not count."""
SLOW_S = 0.2
"""A run that takes longer is timed in the first few rounds only."""
FEW_ROUNDS = 5

Key = TypeVar("Key", bound=Hashable)


def medians_us(runs: Mapping[Key, Callable[[], object]], rounds: int) -> dict[Key, float]:
    """Median microseconds of each run over these rounds; a round takes each run once.

    The clock is the thread's own processor time: other work on the machine does not count.
    """
    once = {key: _once(run) for key, run in runs.items()}
    spent: dict[Key, list[float]] = {key: [] for key in runs}
    for number in range(rounds):
        for key, run in runs.items():
            if once[key] < SLOW_S or number < FEW_ROUNDS:
                spent[key].append(_mean(run, max(1, int(LEAST_RUN_S / once[key]))))
    return {key: statistics.median(times) * 1e6 for key, times in spent.items()}


def _once(run: Callable[[], object]) -> float:
    """Time the second of two runs; the first one warms up."""
    run()
    return max(_mean(run, 1), 1e-9)


def _mean(run: Callable[[], object], loops: int) -> float:
    start = time.thread_time()
    for _ in range(loops):
        run()
    return (time.thread_time() - start) / loops


BATCHES = (1, 30, 10_000)
CLASS = 30
ROUNDS, ROUNDS_QUICK = 21, 5
PEER_VARIANTS = 300
"""fsolve takes as long for each of many variants: so many are timed for a larger batch."""
ASSIGNMENT = "pump"


@dataclass(frozen=True, slots=True)
class SpeedRow:
    """One solver: median microseconds per variant by batch size, and its largest errors in a class.

    Attributes
    ----------
    us : by the number of variants at once
    velocity_error, acceleration_error : of the joints, relative to the largest of each plan
    """

    solver: str
    version: str | None
    us: Mapping[int, float]
    velocity_error: float | None = None
    acceleration_error: float | None = None


@dataclass(frozen=True, slots=True)
class _Entry:
    """The runs to time for one row: by batch size, a run and its number of variants."""

    solver: str
    version: str | None
    runs: Mapping[int, tuple[Callable[[], object], int]] = field(default_factory=dict)
    answers: Sequence[Answer] = ()


def measure_speed(*, quick: bool = False, batches: Sequence[int] = BATCHES) -> Iterator[SpeedRow]:
    """Measure each of our methods, then scipy: positions, velocities and accelerations."""
    bench = _Bench(load_assignment(ASSIGNMENT), batches)
    entries = list(bench.entries())
    runs = {(row, count): run for row, one in enumerate(entries) for count, (run, _) in one.runs.items()}
    medians = medians_us(runs, ROUNDS_QUICK if quick else ROUNDS)
    for row, entry in enumerate(entries):
        us = {count: medians[row, count] / solved for count, (_, solved) in entry.runs.items()}
        yield bench.row(entry, us)


class _Bench:
    """The mechanisms of each batch size, and the truth of a class."""

    def __init__(self, assignment: Assignment, batches: Sequence[int]) -> None:
        self.assignment = assignment
        self.mechanisms = {count: spread(assignment, count) for count in batches}
        self.reference = spread(assignment, CLASS)
        self.truth = [_rounded(ExactMotion(self.reference, index)) for index in range(CLASS)]

    def entries(self) -> Iterator[_Entry]:
        """All rows in their order."""
        yield self._closed_form()
        yield self._construction()
        yield self._fsolve()

    def _closed_form(self) -> _Entry:
        """The closed form: all variants of a batch by one call."""
        runs = {count: (partial(move, one), count) for count, one in self.mechanisms.items()}
        return _Entry("closed form", None, runs, _answers(move(self.reference)))

    def _construction(self) -> _Entry:
        """The construction: the steps of mechanism and plans, evaluated."""
        runs, scale = {}, np.asarray(0.01)
        for count, one in self.mechanisms.items():
            run = partial(evaluate, construction_of(one), parameters_of(one, scale, scale, scale))
            runs[count] = run, count
        return _Entry("construction", None, runs)

    def _fsolve(self) -> _Entry:
        """Scipy: one variant after another."""
        solver, starts = Fsolve(self.reference), _starts(self.reference)
        answers = [solver.solve(index, start)() for index, start in enumerate(starts)]
        runs = {}
        for count in self.mechanisms:
            timed = spread(self.assignment, min(count, PEER_VARIANTS))
            starts = _starts(timed)
            runs[count] = _one_after_another(Fsolve(timed), starts), len(starts)
        return _Entry(FSOLVE, version("scipy"), runs, answers)

    def row(self, entry: _Entry, us: Mapping[int, float]) -> SpeedRow:
        """An entry's measurements as a row."""
        velocity = acceleration = None
        if entry.answers:
            pairs = list(zip(entry.answers, self.truth, strict=True))
            velocity = max(error_of(found.velocity, exact.velocity) for found, exact in pairs)
            acceleration = max(error_of(found.acceleration, exact.acceleration) for found, exact in pairs)
        return SpeedRow(entry.solver, entry.version, us, velocity, acceleration)


def spread(assignment: Assignment, count: int) -> Mechanism:
    """The assignment's mechanism at this many crank angles between its first and last variant."""
    variants = assignment.variants()
    known = assignment.values(variants)

    def between(values: FloatArray) -> FloatArray:
        return np.linspace(values[0], values[-1], count)

    values = {name: between(np.broadcast_to(value, (len(variants),))) for name, value in known.items()}
    return build_mechanism(assignment.mechanism_file, values, count)


def _rounded(motion: ExactMotion) -> Answer:
    def read(rates: Mapping[str, Any]) -> Places:
        return {joint: complex(rate) for joint, rate in rates.items()}

    return Answer(read(motion.position), read(motion.velocity), read(motion.acceleration))


def _starts(mechanism: Mechanism) -> list[Places]:
    """Positions of the joints in a sketch, by variant."""
    drawn = sketch(mechanism, move(mechanism, accelerations=False).position)
    count = drawn[mechanism.driver.pin].size
    return [{joint: complex(at[index]) for joint, at in drawn.items()} for index in range(count)]


def _one_after_another(solver: Fsolve, starts: Sequence[Places]) -> Callable[[], None]:
    def run() -> None:
        for index, start in enumerate(starts):
            solver.solve(index, start)

    return run


def _answers(motion: Motion) -> list[Answer]:
    return [answer_of(motion, index) for index in range(motion.predicted_error.size)]
