"""Run time per variant, side by side with other programs, with the error of each beside it.

All solve the same mechanism, the pump (four-bar, plate, rod and slider), at so many crank angles between
those of its first and its last variant. Building a mechanism is no part of the time, for none. The
clock is the thread's own processor time: other work on the machine does not count.
"""

import importlib.util
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from grader.bench.closure import exact_motion_of, rounded
from grader.bench.peers import PEERS, PYLINKAGE, Answer, Package, Peer, error_of, plain, sketch
from reference.assembly import build_mechanism
from reference.assignment import Assignment, load_assignment
from reference.construction import evaluate
from reference.derivation import construction_of, parameters_of
from reference.geometry import FloatArray
from reference.mechanism import Mechanism
from reference.motion import Motion, move
from reference.plan import exact_plan

BATCHES = (1, 30, 10_000)
CLASS = 30
REPEATS, REPEATS_QUICK = 21, 5
LEAST_RUN_S = 0.02
"""A run is repeated inside until it takes so long, so that the clock's own steps do not count."""
SLOW_S = 0.2
"""A run that takes longer is repeated a few times only."""
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


def measure_speed(*, quick: bool = False, batches: Sequence[int] = BATCHES) -> Iterator[SpeedRow]:
    """Ours by each road, then the peers, then the same for velocities alone, then a class's plans."""
    bench = _Bench(load_assignment(ASSIGNMENT), batches, REPEATS_QUICK if quick else REPEATS)
    for accelerations in (True, False):
        yield bench.closed_form(accelerations=accelerations)
        yield bench.construction(accelerations=accelerations)
        for peer in PEERS:
            if accelerations or peer.velocities_alone:
                yield bench.peer(peer, accelerations=accelerations)
    yield bench.cycle()
    yield bench.plans()


def speed_rows() -> int:
    """How many rows `measure_speed` gives."""
    return 6 + sum(1 + peer.velocities_alone for peer in PEERS)


class _Bench:
    """The mechanisms of each batch size, and the truth of a class."""

    def __init__(self, assignment: Assignment, batches: Sequence[int], repeats: int) -> None:
        self.assignment, self.repeats = assignment, repeats
        self.mechanisms = {count: spread(assignment, count) for count in batches}
        self.reference = spread(assignment, CLASS)
        exact = [exact_motion_of(self.reference, index) for index in range(CLASS)]
        self.truth = [
            Answer(
                *(
                    {joint: rounded(pair) for joint, pair in rates.items()}
                    for rates in (one.position, one.velocity, one.acceleration)
                )
            )
            for one in exact
        ]

    def closed_form(self, *, accelerations: bool) -> SpeedRow:
        """On arrays, as it is used everywhere."""
        us = {
            count: self._median_us(partial(move, one, accelerations=accelerations)) / count
            for count, one in self.mechanisms.items()
        }
        answers = _answers(move(self.reference))
        return self._row("closed form", None, us, answers, accelerations)

    def construction(self, *, accelerations: bool) -> SpeedRow:
        """The steps of mechanism and plans, evaluated."""
        us, scale = {}, np.asarray(0.01)
        for count, one in self.mechanisms.items():
            steps = construction_of(one, accelerations=accelerations)
            given = parameters_of(one, scale, scale, scale)
            us[count] = self._median_us(partial(evaluate, steps, given)) / count
        return SpeedRow("construction", None, accelerations, us)

    def peer(self, peer: Package, *, accelerations: bool) -> SpeedRow:
        """One variant after another."""
        if peer.version is None:
            return SpeedRow(peer.name, None, accelerations, {}, note=NOT_INSTALLED)
        solver, starts = peer.build(self.reference), _starts(self.reference)
        answers = [solver.solve(index, start)() for index, start in enumerate(starts)]
        us = {}
        for count in self.mechanisms:
            timed = spread(self.assignment, min(count, PEER_VARIANTS))
            run = _one_after_another(peer.build(timed), _starts(timed), accelerations=accelerations)
            us[count] = self._median_us(run) / min(count, PEER_VARIANTS)
        return self._row(peer.name, peer.version, us, answers, accelerations)

    def cycle(self) -> SpeedRow:
        """The compiled road of pylinkage, where numba is installed too."""
        package = PYLINKAGE
        name = f"{package.name}, a cycle (numba)"
        if package.version is None or importlib.util.find_spec("numba") is None:
            return SpeedRow(name, package.version, accelerations=True, us={}, note=NOT_INSTALLED)
        from grader.bench.adapters.pylinkage_adapter import PylinkageCycle  # noqa: PLC0415 - an extra

        answers = PylinkageCycle(plain(self.reference)).answers(_starts(self.reference)[0])
        us = {}
        for count, mechanism in self.mechanisms.items():
            solver, start = PylinkageCycle(plain(mechanism)), _starts(mechanism)[0]
            us[count] = self._median_us(partial(solver.run, start)) / count
        return self._row(name, package.version, us, answers, accelerations=True)

    def plans(self) -> SpeedRow:
        """A class with both plans: all nodes, vectors and rates, from the variants on."""
        variants = self.assignment.variants()[:CLASS]
        us = self._median_us(partial(exact_plan, self.assignment, variants)) / len(variants)
        return SpeedRow(PLANS, None, accelerations=True, us={len(variants): us})

    def _row(
        self, name: str, version: str | None, us: dict[int, float], answers: list[Answer], accelerations: bool
    ) -> SpeedRow:
        velocity, acceleration = (
            max(
                error_of(getattr(answer, rates), getattr(truth, rates))
                for answer, truth in zip(answers, self.truth, strict=True)
            )
            for rates in ("velocity", "acceleration")
        )
        return SpeedRow(name, version, accelerations, us, velocity, acceleration if accelerations else None)

    def _median_us(self, run: Callable[[], object]) -> float:
        run()
        start = time.thread_time()
        run()
        once = max(time.thread_time() - start, 1e-9)
        loops, spent = max(1, int(LEAST_RUN_S / once)), []
        for _ in range(self.repeats if once < SLOW_S else min(self.repeats, REPEATS_QUICK)):
            start = time.thread_time()
            for _ in range(loops):
                run()
            spent.append((time.thread_time() - start) / loops)
        return statistics.median(spent) * 1e6


def spread(assignment: Assignment, count: int) -> Mechanism:
    """The assignment's mechanism at so many crank angles between those of its first and last variant."""
    variants = assignment.variants()
    known = assignment.values(variants)

    def between(values: FloatArray) -> FloatArray:
        return np.linspace(values[0], values[-1], count)

    values = {name: between(np.broadcast_to(value, (len(variants),))) for name, value in known.items()}
    return build_mechanism(assignment.mechanism_file, values, count)


def _starts(mechanism: Mechanism) -> list[dict[str, complex]]:
    """By variant, where the joints are in a sketch."""
    drawn = sketch(mechanism, move(mechanism, accelerations=False).position)
    return [{joint: complex(at[index]) for joint, at in drawn.items()} for index in range(drawn["A"].size)]


def _one_after_another(
    solver: Peer, starts: Sequence[Mapping[str, complex]], *, accelerations: bool
) -> Callable[[], None]:
    def run() -> None:
        for index, start in enumerate(starts):
            solver.solve(index, start, accelerations=accelerations)

    return run


def _answers(motion: Motion) -> list[Answer]:
    count = motion.predicted_error.size
    return [
        Answer(
            *(
                {joint: complex(values[index]) for joint, values in getattr(motion, rates).items()}
                for rates in ("position", "velocity", "acceleration")
            )
        )
        for index in range(count)
    ]
