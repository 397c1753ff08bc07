"""The solver's run time per variant, and its error against 50-digit arithmetic."""

import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from reference.assembly import build_mechanism
from reference.assignment import Assignment, built_in, load_assignment
from reference.construction import evaluate
from reference.derivation import construction_of, parameters_of
from reference.geometry import FloatArray
from reference.mechanism import Mechanism
from reference.motion import move
from reference.plan import exact_plan

BATCHES = (1, 30, 10_000)
REPEATS = 21
LEAST_RUN_S = 0.02
"""A run is repeated inside until it takes so long, so that the clock's own steps do not count."""


@dataclass(frozen=True, slots=True)
class SolverRow:
    """Median microseconds per variant of one batch size, by each of the two roads."""

    variants: int
    closed_form_us: float
    construction_us: float


@dataclass(frozen=True, slots=True)
class ErrorRow:
    """Largest error of one assignment's vectors, relative to the longest of the same plan and variant."""

    assignment: str
    variants: int
    velocity: float
    acceleration: float
    construction: float
    """Of the construction's nodes against the closed form's."""


@dataclass(frozen=True, slots=True)
class SolverFigures:
    """Run time and error side by side."""

    times: tuple[SolverRow, ...]
    errors: tuple[ErrorRow, ...]

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return {"times": [asdict(row) for row in self.times], "errors": [asdict(row) for row in self.errors]}


def measure_solver(*, quick: bool = False, batches: Sequence[int] = BATCHES) -> SolverFigures:
    """Run times on the pump (four-bar, plate, rod and slider), errors on every built-in assignment."""
    repeats = 5 if quick else REPEATS
    times = tuple(_timed_batch(load_assignment("pump"), count, repeats) for count in batches)
    return SolverFigures(times, tuple(_errors(load_assignment(name)) for name in built_in()))


def _timed_batch(assignment: Assignment, count: int, repeats: int) -> SolverRow:
    mechanism = _spread(assignment, count)
    construction = construction_of(mechanism)
    scale = np.asarray(0.01)
    parameters = parameters_of(mechanism, scale, scale, scale)
    closed_form = _median_us(lambda: move(mechanism), repeats)
    drawn = _median_us(lambda: evaluate(construction, parameters), repeats)
    return SolverRow(count, closed_form / count, drawn / count)


def _spread(assignment: Assignment, count: int) -> Mechanism:
    """The assignment's mechanism at so many crank angles between those of its first and last variant."""
    variants = assignment.variants()
    known = assignment.values(variants)

    def between(values: FloatArray) -> FloatArray:
        return np.linspace(values[0], values[-1], count)

    values = {name: between(np.broadcast_to(value, (len(variants),))) for name, value in known.items()}
    return build_mechanism(assignment.mechanism_file, values, count)


def _median_us(run: Callable[[], object], repeats: int) -> float:
    run()
    start = time.perf_counter()
    run()
    loops = max(1, int(LEAST_RUN_S / max(time.perf_counter() - start, 1e-9)))
    spent = []
    for _ in range(repeats):
        start = time.perf_counter()
        for _ in range(loops):
            run()
        spent.append((time.perf_counter() - start) / loops)
    return statistics.median(spent) * 1e6


def _errors(assignment: Assignment) -> ErrorRow:
    from grader.bench.closure import exact_motion  # noqa: PLC0415 - mpmath is an extra

    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    truth = [exact_motion(assignment, variant) for variant in variants]
    worst = {}
    for figure in plan.construction.poles:
        vectors = plan.construction.vectors_of(figure)
        exact = np.array([[motion.vector(vector) for motion in truth] for vector in vectors])
        ours = np.array([plan.vectors_si[vector.name] for vector in vectors])
        worst[figure] = float(np.max(np.abs(ours - exact) / np.max(np.abs(exact), axis=0)))
    drawn = evaluate(plan.construction, plan.drawing.parameters)
    apart = max(
        float(np.max(np.abs(drawn[node] - place) / plan.size_mm(figure)))
        for figure, nodes in plan.nodes_mm.items()
        for node, place in nodes.items()
    )
    return ErrorRow(assignment.id, len(variants), worst["velocity_plan"], worst["acceleration_plan"], apart)
