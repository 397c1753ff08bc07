"""All that is measured of the solver: speed, errors, stability near singular positions, branches."""

from collections.abc import Iterator, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.cli.benchmark import construction_error
from reference.authored.assignment import Assignment, built_in, load_assignment
from reference.plan import Plan, exact_plan
from tests.bench.branches import BranchRow, count_branches
from tests.bench.oracle import ExactMotion
from tests.bench.singular import KINDS
from tests.bench.speed import SpeedRow, measure_speed, speed_rows
from tests.bench.stability import (
    DISTANCES,
    DISTANCES_QUICK,
    StabilityRow,
    measure_stability,
)


@dataclass(frozen=True, slots=True)
class ErrorRow:
    """Largest errors of one assignment over its variants.

    Attributes
    ----------
    velocity, acceleration : of the vectors, relative to the longest of the same plan
    rates : of angular velocities and accelerations, relative to the largest of the same kind
    construction : of the construction's nodes against the closed form's, relative to the plan's size
    """

    assignment: str
    variants: int
    velocity: float
    acceleration: float
    rates: float
    construction: float


@dataclass(frozen=True, slots=True)
class SolverFigures:
    """Run time, error and stability side by side."""

    speed: tuple[SpeedRow, ...] = ()
    errors: tuple[ErrorRow, ...] = ()
    stability: tuple[StabilityRow, ...] = ()
    branches: tuple[BranchRow, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return asdict(self)


@dataclass(slots=True)
class SolverBench:
    """All that is measured of the solver, a row after another, so that progress can be shown."""

    quick: bool = False
    speed: list[SpeedRow] = field(default_factory=list)
    errors: list[ErrorRow] = field(default_factory=list)
    stability: list[StabilityRow] = field(default_factory=list)
    branches: list[BranchRow] = field(default_factory=list)

    @property
    def steps(self) -> int:
        """How many rows there will be."""
        distances = DISTANCES_QUICK if self.quick else DISTANCES
        return speed_rows() + len(built_in()) + len(KINDS) * len(distances) + 2

    def run(self) -> Iterator[str]:
        """Measure; each item says what was measured."""
        for speed in measure_speed(quick=self.quick):
            self.speed.append(speed)
            yield f"speed of {speed.solver}"
        for error in measure_errors():
            self.errors.append(error)
            yield f"errors of {error.assignment}"
        for stability in measure_stability(quick=self.quick):
            self.stability.append(stability)
            yield f"stability: {stability.kind}"
        for row in count_branches(quick=self.quick):
            self.branches.append(row)
            yield f"branches of {row.solver}"

    @property
    def figures(self) -> SolverFigures:
        """What was measured so far."""
        return SolverFigures(
            tuple(self.speed), tuple(self.errors), tuple(self.stability), tuple(self.branches)
        )


def measure_solver(*, quick: bool = False) -> SolverFigures:
    """All of it."""
    bench = SolverBench(quick)
    for _ in bench.run():
        pass
    return bench.figures


def measure_errors() -> Iterator[ErrorRow]:
    """Every variant of every built-in assignment."""
    for name in built_in():
        yield _errors(load_assignment(name))


def _errors(assignment: Assignment) -> ErrorRow:
    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    truth = [ExactMotion(plan.mechanism, index) for index in range(len(variants))]
    worst = {}
    for figure in plan.construction.poles:
        vectors = plan.construction.vectors_of(figure)
        exact = np.array([[motion.vector(vector) for motion in truth] for vector in vectors])
        worst[figure] = _largest([plan.vectors_si[vector.name] for vector in vectors], exact)
    return ErrorRow(
        assignment.id,
        len(variants),
        worst["velocity_plan"],
        worst["acceleration_plan"],
        max(_error_of_rates(plan, truth, kind) for kind in ("omega", "epsilon")),
        construction_error(plan),
    )


def _error_of_rates(plan: Plan, truth: list[ExactMotion], kind: str) -> float:
    rates = [rate for rate in plan.construction.rates if rate.startswith(kind)]
    vectors = [plan.construction.vectors[plan.construction.rates[rate].vector] for rate in rates]
    exact = np.array([[motion.rate(vector) for motion in truth] for vector in vectors])
    return _largest([plan.rates[rate] for rate in rates], exact)


def _largest(ours: Sequence[NDArray[Any]], exact: NDArray[Any]) -> float:
    """The largest error; rows are quantities, columns variants."""
    return float(np.max(np.abs(np.array(ours) - exact) / np.max(np.abs(exact), axis=0)))
