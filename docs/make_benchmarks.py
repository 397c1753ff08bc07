"""Measure and put the figures into benchmarks.md: `python docs/make_benchmarks.py`, some ten minutes."""

import re
from pathlib import Path

from grader.bench.reading import measure_reading
from grader.bench.report import Report
from grader.bench.solver import measure_solver

PAGE = Path(__file__).resolve().parent / "benchmarks.md"
MARK = "<!-- figures, written by make_benchmarks.py -->\n"


def main() -> None:
    """Measure, and replace all that stands below the mark."""
    report = Report(measure_solver(), tuple(measure_reading()))
    figures = re.sub(r"(?m)^(Solver|Reading): ", r"### \1: ", report.as_text())
    told, _, _ = PAGE.read_text(encoding="utf-8").partition(MARK)
    PAGE.write_text(told + MARK + "\n" + figures.rstrip() + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
