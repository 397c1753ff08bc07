"""The solver's measurements and their tables: speed, errors, stability near singular positions."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.cli.benchmark import construction_error
from reference.authored.assignment import Assignment, built_in, load_assignment
from reference.plan import Plan, exact_plan
from tests.bench.oracle import ExactMotion
from tests.bench.plain_text import NOTHING, Table
from tests.bench.speed import SpeedRow, measure_speed
from tests.bench.stability import OURS, Outcomes, StabilityRow, measure_stability


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


def measure_solver(*, quick: bool = False) -> SolverFigures:
    """Measure speed, errors and stability."""
    return SolverFigures(
        tuple(measure_speed(quick=quick)),
        tuple(measure_errors()),
        tuple(measure_stability(quick=quick)),
    )


def measure_errors() -> Iterator[ErrorRow]:
    """Measure the errors of every variant of every built-in assignment with plans of motion.

    Force plans are held against Newton's and Euler's equations in 50 digits in `tests.laws.test_forces`.
    """
    assignments = map(load_assignment, built_in())
    yield from (_errors(assignment) for assignment in assignments if not assignment.forces)


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


OUTCOMES = {"wrong": "wrong", "refused": "refused", "silent": "nan", "beyond": "beyond"}
"""The outcomes that are counted for each solver, and their words in the tables."""


def solver_tables(solver: SolverFigures) -> Iterator[Table]:
    """All tables of the solver."""
    yield _speed(solver.speed)
    yield _error_table(solver.errors)
    yield _summary(solver.stability)


def _speed(rows: Sequence[SpeedRow]) -> Table:
    what = "pump; positions, velocities, accelerations; in brackets over ours"
    counts = list(rows[0].us) if rows else []
    heads = ["solver", *(f"{count} at once" for count in counts), "error of v", "error of a"]
    lines = []
    for row in rows:
        name = f"{row.solver} {row.version}" if row.version else row.solver
        times = [_time(row, rows[0], count) for count in counts]
        errors = [_figure(row.velocity_error, ".1e"), _figure(row.acceleration_error, ".1e")]
        lines.append([name, *times, *errors])
    return f"Solver: median microseconds per variant ({what})", heads, lines


def _time(row: SpeedRow, ours: SpeedRow, count: int) -> str:
    if count not in row.us:
        return NOTHING
    ratio = "" if row is ours else f" ({_digits(row.us[count] / ours.us[count], 2)})"
    return f"{_digits(row.us[count], 3)}{ratio}"


def _digits(number: float, digits: int) -> str:
    """A number with at least this many digits, never as a power of ten."""
    return f"{number:.0f}" if number >= 10.0 ** (digits - 1) else f"{number:.{digits}g}"


def _error_table(rows: Iterable[ErrorRow]) -> Table:
    heads = ["assignment", "variants", "velocities", "accelerations", "rates", "construction - closed form"]
    lines = [
        [
            row.assignment,
            str(row.variants),
            *(f"{error:.1e}" for error in (row.velocity, row.acceleration, row.rates, row.construction)),
        ]
        for row in rows
    ]
    return "Solver: largest error, relative to the plan's size", heads, lines


def _summary(rows: Iterable[StabilityRow]) -> Table:
    """A table over all distances: our largest error, and every solver's failures."""
    lines, solvers = [], [OURS]
    for _, group in groupby(rows, key=lambda row: row.kind):
        told = list(group)
        cells = {name: [row.outcomes[name] for row in told] for name in told[0].outcomes}
        solvers = max(solvers, list(cells), key=len)
        unit = "eps" if told[0].smooth else "eps/delta"
        lines.append([told[0].title, unit, *(_overall(cells[name]) for name in cells)])
    padded = [line + [NOTHING] * (2 + len(solvers) - len(line)) for line in lines]
    return "Stability: largest error over all distances", ["position", "unit", *solvers], padded


def _overall(cells: Sequence[Outcomes]) -> str:
    counts = ((sum(getattr(cell, what) for cell in cells), told) for what, told in OUTCOMES.items())
    errors = [cell.worst for cell in cells if cell.worst is not None]
    worst = _units(max(errors)) if errors else NOTHING
    return "; ".join([worst, *(f"{count} {told}" for count, told in counts if count)])


def _units(error: float) -> str:
    """An error in its unit; less than a thousandth of a rounding counts as zero."""
    return "0" if error < 1e-3 else f"{error:.2g}"


def _figure(value: float | None, form: str) -> str:
    return NOTHING if value is None else format(value, form)
