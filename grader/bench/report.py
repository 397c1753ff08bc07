"""The benchmark as one JSON document and as tables of text."""

import platform
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grader.bench.reading import STAGES, ReadingRow
from grader.bench.solver import SolverFigures
from grader.bench.tables import Table, solver_tables

SCHEMA_VERSION = 2


@dataclass(frozen=True, slots=True)
class Report:
    """All that was measured, and where."""

    solver: SolverFigures
    reading: tuple[ReadingRow, ...] = ()

    def as_json(self) -> dict[str, Any]:
        """One JSON object."""
        return {
            "schema_version": SCHEMA_VERSION,
            "machine": {
                "processor": platform.processor() or platform.machine(),
                "python": platform.python_version(),
                "numpy": np.__version__,
            },
            "solver": self.solver.as_json(),
            "reading": [row.as_json() for row in self.reading],
        }

    def as_text(self) -> str:
        """Tables that read well in a terminal and in Markdown."""
        return as_text([*solver_tables(self.solver), *reading_tables(self.reading)])


def as_text(tables: Iterable[Table]) -> str:
    """Tables one after another."""
    return "\n".join(line for table in tables for line in _table(*table))


def reading_tables(reading: Sequence[ReadingRow]) -> Iterator[Table]:
    """Both tables of the reading, where it was measured."""
    if reading:
        told = "Reading: median milliseconds per page, and pages not registered rightly"
        yield told, *_stages(reading)
        yield "Reading: error of nodes, and what became of the vectors drawn", *_vectors(reading)


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(cell) for cell in column) for column in zip(heads, *rows, strict=True)]
    yield from (title, "")
    for row in (heads, ["-" * width for width in widths], *rows):
        yield "| " + " | ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) + " |"
    yield ""


def _stages(reading: Sequence[ReadingRow]) -> tuple[list[str], list[list[str]]]:
    rows = [
        [
            f"{row.dpi:g}",
            str(row.sheets),
            *(f"{row.times_ms[stage]:.0f}" for stage in STAGES),
            f"{sum(row.times_ms.values()):.0f}",
            str(row.turned),
            str(row.off_scale),
        ]
        for row in reading
    ]
    return ["dpi", "pages", *STAGES, "sum", "turned wrongly", "scale off by > 1 %"], rows


def _vectors(reading: Sequence[ReadingRow]) -> tuple[list[str], list[list[str]]]:
    heads = [
        "dpi",
        "node error: median mm",
        "p95 mm",
        "worst mm",
        "vectors",
        "read",
        "doubtful",
        "unread",
        "misread",
    ]
    rows = [
        [
            f"{row.dpi:g}",
            *(_mm(value) for value in (row.node_median_mm, row.node_p95_mm, row.node_worst_mm)),
            str(row.vectors),
            *(f"{100 * share:.0f} %" for share in (row.read, row.doubtful, row.unread)),
            str(row.misreads),
        ]
        for row in reading
    ]
    return heads, rows


def _mm(value: float | None) -> str:
    return "-" if value is None else f"{value:.3f}"
