"""All that is measured of the solver, and its tables: speed, errors, stability near singular positions."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, field
from itertools import groupby
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.cli.benchmark import construction_error
from reference.authored.assignment import Assignment, built_in, load_assignment
from reference.plan import Plan, exact_plan
from tests.bench.branches import BranchRow, count_branches
from tests.bench.oracle import ExactMotion
from tests.bench.plain_text import NOTHING, Table
from tests.bench.singular import KINDS
from tests.bench.speed import PLANS, SpeedRow, measure_speed, speed_rows
from tests.bench.stability import (
    DISTANCES,
    DISTANCES_QUICK,
    OURS,
    Cell,
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


OUTCOMES = {"wrong": "wrong", "refused": "refused", "silent": "nan", "beyond": "beyond"}
"""What is counted of each cell, and the word for it in the tables."""


def solver_tables(solver: SolverFigures) -> Iterator[Table]:
    """All tables of the solver."""
    timed = [row for row in solver.speed if row.solver != PLANS]
    for accelerations, told in ((True, "positions, velocities, accelerations"), (False, "velocities only")):
        rows = [row for row in timed if row.accelerations == accelerations]
        yield _speed(f"Solver: median microseconds per variant (pump; {told}; in brackets over ours)", rows)
    yield _plans([row for row in solver.speed if row.solver == PLANS])
    yield _error_table(solver.errors)
    yield _summary(solver.stability)
    yield _branches(solver.branches)
    for _, rows_of_kind in groupby(solver.stability, key=lambda row: row.kind):
        yield _stability(list(rows_of_kind))


def _speed(title: str, rows: Sequence[SpeedRow]) -> Table:
    counts = list(rows[0].us) if rows else []
    heads = ["solver", *(f"{count} at once" for count in counts), "error of v", "error of a"]
    lines = []
    for row in rows:
        name = f"{row.solver} {row.version}" if row.version else row.solver
        times = [_time(row, rows[0], count) for count in counts]
        errors = [_figure(row.velocity_error, ".1e"), _figure(row.acceleration_error, ".1e")]
        lines.append([name, *times, *errors])
    return title, heads, lines


def _time(row: SpeedRow, ours: SpeedRow, count: int) -> str:
    if count not in row.us:
        return NOTHING
    ratio = "" if row is ours else f" ({_digits(row.us[count] / ours.us[count], 2)})"
    return f"{_digits(row.us[count], 3)}{ratio}"


def _digits(number: float, digits: int) -> str:
    """So many digits at least, never as a power of ten."""
    return f"{number:.0f}" if number >= 10.0 ** (digits - 1) else f"{number:.{digits}g}"


def _plans(rows: Sequence[SpeedRow]) -> Table:
    lines = [[str(count), f"{us * count / 1e3:.2f}"] for row in rows for count, us in row.us.items()]
    return "Solver: a class with both plans (pump)", ["variants", "ms in all"], lines


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
    """Over all distances: the largest error of ours, and what every solver failed at."""
    lines, solvers = [], [OURS]
    for _, group in groupby(rows, key=lambda row: row.kind):
        told = list(group)
        cells = {
            name: [cell for row in told for cell in row.cells if cell.solver == name] for name in _names(told)
        }
        solvers = max(solvers, list(cells), key=len)
        unit = "eps" if told[0].smooth else "eps/delta"
        lines.append([told[0].title, unit, *(_overall(cells[name]) for name in cells)])
    padded = [line + [NOTHING] * (2 + len(solvers) - len(line)) for line in lines]
    return "Stability: largest error over all distances", ["position", "unit", *solvers], padded


def _names(rows: Sequence[StabilityRow]) -> list[str]:
    return [cell.solver for cell in rows[0].cells]


def _overall(cells: Sequence[Cell]) -> str:
    counts = (sum(getattr(cell, what) for cell in cells) for what in OUTCOMES)
    answered = any(cell.velocity for cell in cells)
    return _outcome(_units(max(cell.worst for cell in cells)) if answered else NOTHING, *counts)


def _branches(rows: Iterable[BranchRow]) -> Table:
    heads = ["solver", "random cases", "wrong branch", "refused", "silent nan"]
    lines = [[row.solver, str(row.cases), str(row.wrong), str(row.refused), str(row.silent)] for row in rows]
    return "Stability: branches in random mechanisms", heads, lines


def _stability(rows: Sequence[StabilityRow]) -> Table:
    unit = "eps" if rows[0].smooth else "eps/delta"
    title = f"Stability: {rows[0].title} (error over {unit}, median / largest)"
    lines = [[f"{row.delta:.0e}", *(_cell(cell) for cell in row.cells)] for row in rows]
    return title, ["delta", *_names(rows)], lines


def _cell(cell: Cell) -> str:
    """The larger of the errors of velocities and accelerations, and what failed."""
    pairs = [pair for pair in (cell.velocity, cell.acceleration) if pair is not None]
    error = NOTHING
    if pairs:
        error = f"{_units(max(pair[0] for pair in pairs))} / {_units(max(pair[1] for pair in pairs))}"
    return _outcome(error, *(getattr(cell, what) for what in OUTCOMES))


def _units(error: float) -> str:
    """An error in its unit; a thousandth of a rounding is none."""
    return "0" if error < 1e-3 else f"{error:.2g}"


def _outcome(error: str, *counts: int) -> str:
    told = zip(counts, OUTCOMES.values(), strict=True)
    return "; ".join([error, *(f"{count} {what}" for count, what in told if count)])


def _figure(value: float | None, form: str) -> str:
    return NOTHING if value is None else format(value, form)
