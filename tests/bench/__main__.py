"""The whole benchmark, run from a checkout: `python -m tests.bench --help`."""

import argparse
import json
import platform
import sys
from dataclasses import asdict, dataclass
from itertools import chain
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import Progress

from tests.bench.collected import measured
from tests.bench.judging import JudgingBench
from tests.bench.judging_tally import JudgingFigures, judging_tables
from tests.bench.lines import LinesFigures, lines_tables
from tests.bench.plain_text import as_text
from tests.bench.reading import CurveRow, ReadingBench, curve_tables
from tests.bench.reading_scenes import ForeignRow, foreign_tables
from tests.bench.reading_tally import SceneRow, reading_tables
from tests.bench.solver import SolverBench, SolverFigures, solver_tables

PARTS = ("solver", "reading", "judging")
SCHEMA_VERSION = 5


@dataclass(frozen=True, slots=True)
class Report:
    """All that was measured, and where; None or nothing for what was not asked for."""

    solver: SolverFigures | None = None
    reading: tuple[SceneRow, ...] = ()
    foreign: tuple[ForeignRow, ...] = ()
    curve: tuple[CurveRow, ...] = ()
    lines: LinesFigures | None = None
    judging: JudgingFigures | None = None

    def as_json(self) -> dict[str, Any]:
        """One JSON object."""
        return {
            "schema_version": SCHEMA_VERSION,
            "machine": {
                "processor": platform.processor() or platform.machine(),
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
            "solver": None if self.solver is None else self.solver.as_json(),
            "reading": [asdict(row) for row in self.reading],
            "foreign": [asdict(row) for row in self.foreign],
            "curve": [asdict(row) for row in self.curve],
            "lines": None if self.lines is None else asdict(self.lines),
            "judging": None if self.judging is None else self.judging.as_json(),
        }

    def as_text(self) -> str:
        """Tables that read well in a terminal and in Markdown."""
        solver = [] if self.solver is None else solver_tables(self.solver)
        judging = [] if self.judging is None else judging_tables(self.judging)
        reading = (
            reading_tables(self.reading), curve_tables(self.curve), foreign_tables(self.foreign),
            lines_tables(self.lines),
        )  # fmt: skip
        return as_text(chain(solver, *reading, judging))


def main(arguments: list[str]) -> None:
    """Measure the parts asked for, all by default, and print the figures."""
    asked = _parser().parse_args(arguments)
    if asked.collected is not None:
        print(measured(asked.collected, asked.assignment))
        return
    parts = [part for part in PARTS if getattr(asked, part)] or PARTS
    quick, students = asked.quick, asked.students
    solver = SolverBench(quick) if "solver" in parts else None
    reading = ReadingBench(quick=quick, students=students) if "reading" in parts else None
    judging = None
    if "judging" in parts:
        judging = JudgingBench(quick=quick, students=students, whole=True)
    with Progress(console=Console(stderr=True), transient=True) as progress:
        benches: list[SolverBench | ReadingBench | JudgingBench | None] = [solver, reading, judging]
        for bench in benches:
            if bench is None:
                continue
            bar = progress.add_task("", total=bench.steps)
            for step in bench.run():
                progress.update(bar, advance=1, description=step)
    report = Report(
        None if solver is None else solver.figures,
        () if reading is None else tuple(reading.rows),
        () if reading is None else tuple(reading.foreign),
        () if reading is None else tuple(reading.curve),
        None if reading is None else reading.lines,
        None if judging is None else judging.figures,
    )
    print(json.dumps(report.as_json(), indent=2) if asked.json else report.as_text())


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser("python -m tests.bench", description=__doc__)
    parser.add_argument(
        "--solver", action="store_true", help="speed, errors, stability near singular positions"
    )
    parser.add_argument("--reading", action="store_true", help="simulated scenes, foreign pages, strokes")
    parser.add_argument("--judging", action="store_true", help="verdicts, mistakes named, time")
    parser.add_argument("--students", type=int, help="per scene of the reading, per kind of class")
    parser.add_argument(
        "--collected", type=Path, metavar="F.zip", help="only this: points on sheets of `planmark collect`"
    )
    parser.add_argument("--assignment", help="of --collected, where it is not a built-in one: its file")
    parser.add_argument("--quick", action="store_true", help="a few sheets and cases only")
    parser.add_argument("--json", action="store_true", help="print the figures as JSON")
    return parser


if __name__ == "__main__":
    main(sys.argv[1:])
