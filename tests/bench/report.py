"""The benchmark as one JSON document and as tables of text."""

import platform
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from tests.bench.judging_tables import judging_tables
from tests.bench.judging_tally import JudgingFigures
from tests.bench.lines import LinesFigures, lines_tables
from tests.bench.plain_text import Table, as_text
from tests.bench.reading_foreign import ForeignRow, foreign_tables
from tests.bench.reading_tables import reading_tables
from tests.bench.reading_tally import ReadingRow
from tests.bench.solver import SolverFigures
from tests.bench.tables import solver_tables

SCHEMA_VERSION = 4


@dataclass(frozen=True, slots=True)
class Report:
    """All that was measured, and where; None or nothing for what was not asked for."""

    solver: SolverFigures | None = None
    reading: tuple[ReadingRow, ...] = ()
    foreign: tuple[ForeignRow, ...] = ()
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
            "reading": [row.as_json() for row in self.reading],
            "foreign": [row.as_json() for row in self.foreign],
            "lines": None if self.lines is None else self.lines.as_json(),
            "judging": None if self.judging is None else self.judging.as_json(),
        }

    def as_text(self) -> str:
        """Tables that read well in a terminal and in Markdown."""
        solver = [] if self.solver is None else solver_tables(self.solver)
        judging = [] if self.judging is None else judging_tables(self.judging)
        return as_text([*solver, *all_reading_tables(self.reading, self.foreign, self.lines), *judging])


def all_reading_tables(
    reading: Sequence[ReadingRow], foreign: Sequence[ForeignRow], lines: LinesFigures | None
) -> Iterator[Table]:
    """Scenes, foreign pages, strokes."""
    yield from reading_tables(reading)
    yield from foreign_tables(foreign)
    yield from lines_tables(lines)
