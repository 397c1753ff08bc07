"""Measure, print, and put the main tables into benchmarks.md: `python -m docs.make_benchmarks`, half an hour.

With names of parts (`python -m tests.bench --help`) only these are measured and replaced; a number is that of
students: for each scene, for each kind, hand and mechanism, for each kind of sheet.
"""

import sys
from pathlib import Path

import cv2

from tests.bench.__main__ import PARTS, STUDENTS
from tests.bench.plain_text import Table, as_text
from tests.bench.reading import curve_picture, curve_tables, measure_curve

PAGE = Path(__file__).resolve().parent / "benchmarks.md"
SHOWN = (
    "Solver: median microseconds per variant (pump; positions",
    "Solver: largest error",
    "Stability: largest error",
    "Reading: sheets and vectors",
    "Reading: confidence against",
    "Lines: time and error",
    "Judging: verdicts",
    "Judging: the first mistake named",
    "Judging: single mistakes",
    "Settling: a class of scans",
)
"""The beginnings of the titles of the page's tables."""


def main(wanted: list[str]) -> None:
    """Measure, print all tables of each part, and replace those of the page."""
    cv2.setNumThreads(1)
    quick = False
    students = next((int(told) for told in wanted if told.isdigit()), None)
    parts = [told for told in wanted if not told.isdigit()]
    for part in parts or PARTS:
        tables = list(_curve(students) if part == "curve" else PARTS[part](students, quick))
        sys.stdout.write(as_text(tables) + "\n")
        write(part, [one for one in tables if one[0].startswith(SHOWN)])


def _curve(students: int | None) -> list[Table]:
    """The table of time against error, and its picture beside the page."""
    rows = tuple(measure_curve(students or STUDENTS))
    curve_picture(rows, PAGE.with_name("reading-time.svg"))
    return list(curve_tables(rows))


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
