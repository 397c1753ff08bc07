"""The solver's figures as tables of text: a title, the heads, the rows."""

from collections.abc import Iterable, Iterator, Sequence
from itertools import groupby

from tests.bench.branches import BranchRow
from tests.bench.plain_text import Table
from tests.bench.solver import ErrorRow, SolverFigures
from tests.bench.speed import PLANS, SpeedRow
from tests.bench.stability import OURS, Cell, StabilityRow

NOTHING = "-"
OUTCOMES = {"wrong": "wrong", "refused": "refused", "silent": "nan", "beyond": "beyond"}
"""What is counted of each cell, and the word for it in the tables."""


def solver_tables(solver: SolverFigures) -> Iterator[Table]:
    """All tables of the solver."""
    timed = [row for row in solver.speed if row.solver != PLANS]
    for accelerations, told in ((True, "positions, velocities, accelerations"), (False, "velocities only")):
        rows = [row for row in timed if row.accelerations == accelerations]
        yield _speed(f"Solver: median microseconds per variant (pump; {told}; in brackets over ours)", rows)
    yield _plans([row for row in solver.speed if row.solver == PLANS])
    yield _errors(solver.errors)
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


def _errors(rows: Iterable[ErrorRow]) -> Table:
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
