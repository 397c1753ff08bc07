"""Measure and put the figures into benchmarks.md: `python docs/make_benchmarks.py`, some ten minutes.

With `solver` or `reading` only that part is measured and replaced.
"""

import re
import sys
from collections.abc import Callable, Iterable
from pathlib import Path

from grader.bench.reading import measure_reading
from grader.bench.report import as_text, reading_tables
from grader.bench.solver import measure_solver
from grader.bench.tables import Table, solver_tables

PAGE = Path(__file__).resolve().parent / "benchmarks.md"
PARTS: dict[str, Callable[[], Iterable[Table]]] = {
    "solver": lambda: solver_tables(measure_solver()),
    "reading": lambda: reading_tables(tuple(measure_reading())),
}


def main(wanted: list[str]) -> None:
    """Measure, and replace what stands between the marks of each part."""
    for part in wanted or list(PARTS):
        figures = re.sub(r"(?m)^(Solver|Stability|Reading): (.*)$", r"### \1: \2", as_text(PARTS[part]()))
        first, last = f"<!-- {part}: written by make_benchmarks.py -->\n", f"<!-- {part}: end -->"
        before, _, rest = PAGE.read_text(encoding="utf-8").partition(first)
        _, _, after = rest.partition(last)
        PAGE.write_text(f"{before}{first}\n{figures.rstrip()}\n\n{last}{after}", encoding="utf-8")


if __name__ == "__main__":
    main(sys.argv[1:])
