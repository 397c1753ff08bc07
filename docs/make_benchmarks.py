"""Measure, print, and put the main tables into benchmarks.md: `python -m docs.make_benchmarks`, half an hour.

With `solver`, `reading`, `paper`, `curve`, `lines`, `judging` or `settling` only that part is measured and
replaced; a number is that of students: for each scene, for each kind, hand and mechanism, for each kind of
sheet.
"""

import sys
from collections.abc import Callable, Iterable
from pathlib import Path

import cv2

from tests.bench.judging import JudgingBench
from tests.bench.judging_scans import SHEET_KINDS
from tests.bench.judging_tally import judging_tables
from tests.bench.lines import lines_tables, measure_lines
from tests.bench.plain_text import Table, as_text
from tests.bench.reading import STUDENTS, curve_picture, curve_tables, measure_curve, measure_reading
from tests.bench.reading_scenes import PAPER_SCENES, foreign_tables, measure_foreign
from tests.bench.reading_tally import paper_tables, reading_tables
from tests.bench.settling import measure
from tests.bench.solver import measure_solver, solver_tables

PAGE = Path(__file__).resolve().parent / "benchmarks.md"


def _reading(students: int | None) -> Iterable[Table]:
    cv2.setNumThreads(1)
    rows = tuple(measure_reading(students=students or STUDENTS))
    return [*reading_tables(rows), *foreign_tables(tuple(measure_foreign()))]


def _paper(students: int | None) -> Iterable[Table]:
    cv2.setNumThreads(1)
    return paper_tables(tuple(measure_reading(students=students or STUDENTS, scenes=PAPER_SCENES)))


def _curve(students: int | None) -> Iterable[Table]:
    cv2.setNumThreads(1)
    rows = tuple(measure_curve(students or STUDENTS))
    curve_picture(rows, PAGE.with_name("reading-time.svg"))
    return curve_tables(rows)


def _lines(_: int | None) -> Iterable[Table]:
    cv2.setNumThreads(1)
    return lines_tables(measure_lines())


def _judging(students: int | None) -> Iterable[Table]:
    bench = JudgingBench(students=students, whole=True)
    for _ in bench.run():
        pass
    return judging_tables(bench.figures)


def _settling(students: int | None) -> Iterable[Table]:
    cv2.setNumThreads(1)
    return measure(students or 50, list(SHEET_KINDS), None, 1).tables()


PARTS: dict[str, Callable[[int | None], Iterable[Table]]] = {
    "solver": lambda _: solver_tables(measure_solver()),
    "reading": _reading,
    "paper": _paper,
    "curve": _curve,
    "lines": _lines,
    "judging": _judging,
    "settling": _settling,
}
SHOWN = (
    "Solver: median microseconds per variant (pump; positions",
    "Solver: largest error",
    "Stability: largest error",
    "Stability: branches",
    "Reading: sheets and vectors",
    "Reading: confidence against",
    "Lines: time and error",
    "Judging: verdicts",
    "Judging: the first mistake named",
    "Judging: single mistakes",
    "Settling: a class of scans",
)
"""How the titles of the page's tables begin; those `by mechanism` are left out, too."""


def main(wanted: list[str]) -> None:
    """Measure, print all tables of each part, and replace those of the page."""
    students = next((int(told) for told in wanted if told.isdigit()), None)
    parts = [told for told in wanted if not told.isdigit()]
    for part in parts or list(PARTS):
        tables = list(PARTS[part](students))
        sys.stdout.write(as_text(tables) + "\n")
        write(part, [one for one in tables if one[0].startswith(SHOWN) and "by mechanism" not in one[0]])


def write(part: str, tables: list[Table]) -> None:
    """Put a part's tables between its marks, where the page has any of them."""
    if tables:
        first, last = f"<!-- {part}: written by make_benchmarks.py -->\n", f"<!-- {part}: end -->"
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(first)
        _, _, after = rest.partition(last)
        shown = as_text((f"### {title}", heads, rows) for title, heads, rows in tables)
        PAGE.write_text(f"{before}{first}\n{shown.rstrip()}\n\n{last}{after}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
