"""Which row of a platform's table is whose."""

import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

Evidence = Sequence[tuple[str, str]]
"""Columns and what would stand there, the strongest first; an empty text is no evidence."""


@dataclass(frozen=True, slots=True)
class Rows:
    """Rows by what stands in their columns, without regard to case, spaces and ways to write an accent."""

    by_cell: Mapping[str, Mapping[str, list[int]]]

    @staticmethod
    def of(cells: Iterable[tuple[int, Mapping[str, str]]]) -> "Rows":
        """Rows by number, each with its cells by column."""
        found: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
        for row, columns in cells:
            for column, cell in columns.items():
                found[column][folded(cell)].append(row)
        return Rows(found)

    def fitting(self, evidence: Evidence) -> Sequence[int]:
        """Rows that fit by the strongest evidence there is: where that fits, weaker is not asked."""
        for column, wanted in evidence:
            rows = self.by_cell.get(column, {}).get(folded(wanted), ()) if wanted else ()
            if rows:
                return rows
        return ()


@dataclass(slots=True)
class Found:
    """The row of each student, and why others have none. No row serves two students."""

    rows: dict[str, int] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)


def find(rows: Rows, students: Mapping[str, Evidence], table: str) -> Found:
    """The row of each student in a table; `table` is its name in words."""
    found = Found()
    owners: dict[int, list[str]] = defaultdict(list)
    for student, evidence in students.items():
        fitting = rows.fitting(evidence)
        if len(fitting) == 1:
            owners[fitting[0]].append(student)
        elif fitting:
            numbers = ", ".join(str(row + 1) for row in fitting)
            found.missing[student] = f"rows {numbers} of {table} all fit"
        else:
            known = ", ".join(f"{column} '{wanted}'" for column, wanted in evidence if wanted)
            found.missing[student] = f"nobody in {table} has {known or 'anything known of the student'}"
    for row, claimed in owners.items():
        if len(claimed) == 1:
            found.rows[claimed[0]] = row
        for student in claimed if len(claimed) > 1 else ():
            found.missing[student] = f"row {row + 1} of {table} fits {' and '.join(claimed)} alike"
    return found


def folded(text: str) -> str:
    """A text for comparison."""
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())
