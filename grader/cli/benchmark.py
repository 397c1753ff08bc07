"""``planmark bench``: run time and error of the solver and of reading the bundled samples.

The solver's error is the distance between two independent computations of a plan: the construction, step by
step as it is drawn, and the closed form. The samples' truth, `truth.jsonl`, says what was drawn on each page.
`python -m tests.bench` in a checkout measures more: other solvers, singular positions, simulated classes.
"""

import json
import platform
import statistics
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console

from grader.cli import terminal
from grader.cli.app import new_table, progress
from grader.files import samples_folder
from grader.language import N_
from grader.pipeline import read_pages
from grader.records import PageRef, Reading
from grader.rubric import rubric_of
from grader.scan.page import open_page
from grader.tables.roster import read_roster
from reference.authored.assignment import built_in, load_assignment
from reference.construction.graph import evaluate
from reference.kinematics.motion import move
from reference.plan import Plan, exact_plan

SCHEMA_VERSION = 5
"""4 was the large benchmark's, with simulated classes."""
CLASSES = ("pump", "press")
ROUNDS, ROUNDS_QUICK = 21, 5
"""A median of so many runs varies by a few percent on a machine that does other work as well."""
RIGHT_MM = 0.5
"""Largest error of a vector that counts as right: a pencil stroke's width."""
WRONG_MM = 1.0
"""A believed vector with a larger error is misread: nobody draws with an error of two stroke widths."""
SURE = 0.9
"""The confidence from which a vector is believed without a person."""


@dataclass(frozen=True, slots=True)
class SolverRow:
    """One assignment, all variants at once: medians of processor time per variant, and the largest error.

    `error` is the largest distance between a node of the construction and the closed form's, as a share of
    the figure's size.
    """

    assignment: str
    variants: int
    closed_form_us: float
    construction_us: float
    error: float


@dataclass(frozen=True, slots=True)
class ReadingRow:
    """One class of samples: processor time per page, and the vectors asked for that were drawn.

    Attributes
    ----------
    vectors : all that were drawn and are asked for
    right : read with an error of at most `RIGHT_MM`
    believed : read with a confidence of at least `SURE`
    misread : believed, with an error above `WRONG_MM`
    """

    samples: str
    pages: int
    ms_per_page: float
    vectors: int
    right: int
    believed: int
    misread: int


def show_benchmark(*, quick: bool, as_json: bool) -> None:
    """Measure both and print the figures; a quick run reads one student's pages of each class."""
    solver, reading, names = [], [], built_in()
    with progress() as tell:
        for name in names:
            solver.append(measure_solver(name, rounds=ROUNDS_QUICK if quick else ROUNDS))
            tell("solver", len(solver), len(names))
        for name in CLASSES:
            reading.append(measure_reading(name, students=1 if quick else None))
            tell("reading", len(reading), len(CLASSES))
    if as_json:
        terminal.say(json.dumps(_document(solver, reading), indent=2))
    else:
        _print_tables(solver, reading)


def _document(solver: Sequence[SolverRow], reading: Sequence[ReadingRow]) -> dict[str, Any]:
    return {
        "schema_version": SCHEMA_VERSION,
        "machine": {
            "processor": platform.processor() or platform.machine(),
            "python": platform.python_version(),
            "numpy": np.__version__,
        },
        "solver": [asdict(row) for row in solver],
        "reading": [asdict(row) for row in reading],
    }


def _print_tables(solver: Sequence[SolverRow], reading: Sequence[ReadingRow]) -> None:
    times = N_("closed form, µs"), N_("construction, µs")
    solved = new_table(N_("assignment"), N_("variants"), *times, N_("error"))
    for one in solver:
        cells = (f"{time_us:.2f}" for time_us in (one.closed_form_us, one.construction_us))
        solved.add_row(one.assignment, str(one.variants), *cells, f"{one.error:.1e}")
    heads = N_("samples"), N_("pages"), N_("ms per page"), N_("vectors")
    read = new_table(*heads, N_("right"), N_("believed"), N_("misread"))
    for row in reading:
        counts = map(str, (row.vectors, row.right, row.believed, row.misread))
        read.add_row(row.samples, str(row.pages), f"{row.ms_per_page:.0f}", *counts)
    for table in (solved, read):
        Console().print(table)


# The solver ------------------------------------------------------------------------------------------


def measure_solver(name: str, *, rounds: int = ROUNDS) -> SolverRow:
    """All variants of a built-in assignment by both computations."""
    assignment = load_assignment(name)
    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    drawing = plan.drawing

    def per_variant_us(run: Callable[[], object]) -> float:
        return 1e6 * statistics.median(_seconds(run) for _ in range(rounds)) / len(variants)

    return SolverRow(
        assignment.id,
        len(variants),
        per_variant_us(lambda: move(plan.mechanism)),
        per_variant_us(lambda: evaluate(drawing.construction, drawing.parameters)),
        construction_error(plan),
    )


def construction_error(plan: Plan) -> float:
    """The largest distance of the construction's nodes from the closed form's, relative to their figure."""
    drawn = evaluate(plan.construction, plan.drawing.parameters)
    return max(
        float(np.max(np.abs(drawn[node] - place) / plan.size_mm(figure)))
        for figure, nodes in plan.nodes_mm.items()
        for node, place in nodes.items()
    )


def _seconds(run: Callable[[], object]) -> float:
    """The thread's own processor time: other work on the machine does not count."""
    start = time.thread_time()
    run()
    return time.thread_time() - start


# The reading -----------------------------------------------------------------------------------------


def measure_reading(name: str, *, students: int | None = None) -> ReadingRow:
    """The scans of a class of samples, of all students or of the first few."""
    folder, assignment = samples_folder() / name, load_assignment(name)
    roster, wanted = read_roster(folder / "roster.csv"), rubric_of(assignment).vectors
    pages, seconds, results = 0, 0.0, []
    for student, truths in list(_truths(folder).items())[:students]:
        row = roster.rows_of(student)[0]
        start = time.process_time()
        scans = [
            open_page(PageRef(truth["file"], truth["page"], path=folder / truth["file"])) for truth in truths
        ]
        read = read_pages(scans, assignment, assignment.variant(row.n, row.position), row.scales, wanted)
        seconds += time.process_time() - start
        pages += len(truths)
        for truth, page in zip(truths, read, strict=True):
            results += [result for result in vector_results(truth, page.reading) if result.name in wanted]
    believed = [result for result in results if result.confidence >= SURE]
    return ReadingRow(
        name,
        pages,
        1000.0 * seconds / pages,
        len(results),
        sum(result.error_mm <= RIGHT_MM for result in results),
        len(believed),
        sum(result.error_mm > WRONG_MM for result in believed),
    )


def _truths(folder: Path) -> dict[str, list[dict[str, Any]]]:
    """By student, the truth of each page."""
    lines = (folder / "truth.jsonl").read_text(encoding="utf-8").splitlines()
    truths: dict[str, list[dict[str, Any]]] = {}
    for truth in map(json.loads, lines):
        truths.setdefault(truth["student_id"], []).append(truth)
    return truths


@dataclass(frozen=True, slots=True)
class VectorResult:
    """A drawn vector and its reading: infinitely wrong, with no confidence, where it was not read."""

    name: str
    length_mm: float
    error_mm: float
    confidence: float


def vector_results(truth: Mapping[str, Any], reading: Reading) -> Iterator[VectorResult]:
    """Every vector drawn on a page, `truth` being its line of `truth.jsonl`.

    The error is the distance of the vector's end from where it was drawn: from node to node, or along its
    stroke, whichever is nearer, since a stroke misses the nodes that it joins and either may be meant.
    """
    for figure, drawn in truth["figures"].items():
        vectors = reading.figures[figure].vectors if figure in reading.figures else {}
        for name, vector in drawn.get("vectors", {}).items():
            as_read, length = vectors.get(name), float(vector["length_mm"])
            if as_read is None or as_read.length_mm is None:
                yield VectorResult(name, length, np.inf, 0.0)
                continue
            end = as_read.length_mm * complex(np.exp(1j * np.radians(as_read.direction_deg or 0.0)))
            nodes = [drawn["nodes"][vector["tail"]], drawn["nodes"][vector["head"]]]
            ends = [complex(q[0] - p[0], p[1] - q[1]) for p, q in (nodes, vector["line_mm"] or nodes)]
            yield VectorResult(name, length, min(abs(end - other) for other in ends), as_read.confidence)
