"""Run a checkout's benchmarks: `python -m tests.bench --help`."""

import argparse
import sys
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path

import cv2

from tests.bench import settling
from tests.bench.collected import measured
from tests.bench.judging import measure_class, measure_judging
from tests.bench.judging_scans import SHEET_KINDS
from tests.bench.judging_tally import judging_tables
from tests.bench.lines import lines_tables, measure_lines
from tests.bench.plain_text import Table, as_text
from tests.bench.reading import curve_tables, measure_curve, measure_reading
from tests.bench.reading_scenes import PAPER_SCENES, foreign_tables, measure_foreign
from tests.bench.reading_tally import paper_tables, reading_tables
from tests.bench.solver import measure_solver, solver_tables

STUDENTS, STUDENTS_QUICK = 6, 1
"""Students of each scene of the reading."""
SETTLING, SETTLING_QUICK = 50, 1
"""Students of each kind of sheet."""
ROWS, ROWS_QUICK = 1000, 50
"""Rows of a class's measurements."""


def _reading(students: int | None, quick: bool) -> Iterable[Table]:
    rows = tuple(measure_reading(_few(students, quick), quick=quick))
    return [*reading_tables(rows), *foreign_tables(tuple(measure_foreign(quick=quick)))]


def _paper(students: int | None, quick: bool) -> Iterable[Table]:
    return paper_tables(tuple(measure_reading(_few(students, quick), PAPER_SCENES)))


def _curve(students: int | None, quick: bool) -> Iterable[Table]:
    return curve_tables(tuple(measure_curve(_few(students, quick), quick=quick)))


def _few(students: int | None, quick: bool) -> int:
    return students or (STUDENTS_QUICK if quick else STUDENTS)


def _judging(students: int | None, quick: bool) -> Iterable[Table]:
    figures = measure_judging(students, quick=quick)
    figures.classes.append(measure_class(ROWS_QUICK if quick else ROWS))
    return judging_tables(figures)


def _settling(students: int | None, quick: bool) -> Iterable[Table]:
    count = students or (SETTLING_QUICK if quick else SETTLING)
    return settling.tables(settling.measure(count, list(SHEET_KINDS), None, 1))


PARTS: Mapping[str, Callable[[int | None, bool], Iterable[Table]]] = {
    "solver": lambda _, quick: solver_tables(measure_solver(quick=quick)),
    "reading": _reading,
    "paper": _paper,
    "curve": _curve,
    "lines": lambda _, quick: lines_tables(measure_lines(quick=quick)),
    "judging": _judging,
    "settling": _settling,
}
"""Measurements by name: functions of the number of students, and whether a few cases are enough."""
USUAL = ("solver", "reading", "curve", "lines", "judging")


def main(arguments: list[str]) -> None:
    """Measure the parts asked for, and print their tables."""
    asked = _parser().parse_args(arguments)
    if asked.collected is not None:
        print(measured(asked.collected, asked.assignment))
        return
    cv2.setNumThreads(1)
    for part in [part for part in PARTS if getattr(asked, part)] or USUAL:
        print(as_text(PARTS[part](asked.students, asked.quick)), flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m tests.bench", description=__doc__)
    for part in PARTS:
        parser.add_argument(f"--{part}", action="store_true", help="measured as usual" * (part in USUAL))
    parser.add_argument("--students", type=int, help="per scene, kind of sheet, or kind of class")
    parser.add_argument(
        "--collected", type=Path, metavar="F.zip", help="only this: points on sheets of `planmark collect`"
    )
    parser.add_argument("--assignment", help="of --collected, where it is not a built-in one: its file")
    parser.add_argument("--quick", action="store_true", help="a few sheets and cases only")
    return parser


if __name__ == "__main__":
    main(sys.argv[1:])
