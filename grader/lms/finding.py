"""Which row of a platform's table is whose."""

import unicodedata
from collections import defaultdict
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

from grader.lms.faults import in_a_row

Evidence = Sequence[tuple[str, str]]
"""Columns and what would stand there, the strongest first; an empty text is no evidence."""
NAMES = frozenset({"name", "name turned"})
"""Columns that two people may share."""


@dataclass(frozen=True, slots=True)
class Rows:
    """A table's rows, without regard to case, spaces and ways to write an accent.

    Attributes
    ----------
    cells : of each row by column, folded
    by_cell : rows by column and what stands there
    """

    cells: Mapping[int, Mapping[str, str]]
    by_cell: Mapping[str, Mapping[str, list[int]]]

    @staticmethod
    def of(rows: Iterable[tuple[int, Mapping[str, str]]]) -> "Rows":
        """Rows by number, each with its cells by column."""
        cells = {row: {column: folded(cell) for column, cell in told.items()} for row, told in rows}
        by_cell: dict[str, dict[str, list[int]]] = defaultdict(lambda: defaultdict(list))
        for row, told in cells.items():
            for column, cell in told.items():
                by_cell[column][cell].append(row)
        return Rows(cells, by_cell)

    def with_cell(self, column: str, wanted: str) -> Sequence[int]:
        """Rows where this stands in a column; none for an empty text."""
        return self.by_cell.get(column, {}).get(folded(wanted), ()) if wanted.strip() else ()


@dataclass(slots=True)
class Found:
    """The row of each student, and why others have none. No row serves two students.

    Attributes
    ----------
    by_name : students for whom nothing but their name speaks
    """

    rows: dict[str, int] = field(default_factory=dict)
    missing: dict[str, str] = field(default_factory=dict)
    by_name: list[str] = field(default_factory=list)

    def notes_on(self, written: Sequence[str]) -> list[str]:
        """What a person should look at among those who were written."""
        doubtful = [student for student in self.by_name if student in set(written)]
        if not doubtful:
            return []
        return [f"found by name alone, look whether they are these: {in_a_row(doubtful)}"]


def held_already(withheld: Iterable[str], found: Found, cells: Mapping[int, str]) -> list[str]:
    """Who is withheld and has a grade there all the same; `cells` are the grades that stand in rows."""
    held = [f"{one} ({cells[found.rows[one]]})" for one in withheld if cells.get(found.rows.get(one, -1))]
    return [f"withheld, and a grade is there already, which stays: {in_a_row(held)}"] if held else []


def find(rows: Rows, students: Mapping[str, Evidence], table: str) -> Found:
    """The row of each student in a table; `table` is its name in words.

    The strongest evidence that fits decides, unless stronger evidence speaks against that row: a
    namesake with another address. Only columns that know anybody of these students can speak so.
    """
    speaking = {
        column
        for evidence in students.values()
        for column, wanted in evidence
        if rows.with_cell(column, wanted)
    }
    found = Found()
    owners: dict[int, list[str]] = defaultdict(list)
    columns: dict[str, str] = {}
    for student, evidence in students.items():
        row, column, why = _row(rows, evidence, speaking)
        if row is None:
            found.missing[student] = why.format(table=table)
        else:
            owners[row].append(student)
            columns[student] = column
    for row, claimed in owners.items():
        if len(claimed) == 1:
            found.rows[claimed[0]] = row
        for student in claimed if len(claimed) > 1 else ():
            found.missing[student] = f"row {row + 1} of {table} fits {' and '.join(claimed)} alike"
    found.by_name = [student for student in found.rows if columns[student] in NAMES]
    return found


def _row(rows: Rows, evidence: Evidence, speaking: set[str]) -> tuple[int | None, str, str]:
    """A student's row and the column that decides, or why there is none."""
    for place, (column, wanted) in enumerate(evidence):
        fitting = rows.with_cell(column, wanted)
        if len(fitting) > 1:
            return None, column, f"rows {', '.join(str(row + 1) for row in fitting)} of {{table}} all fit"
        for row in fitting:
            for stronger, told in evidence[:place]:
                own = rows.cells[row].get(stronger)
                is_other = told and own and own != folded(told) and stronger != column
                if is_other and stronger in speaking:
                    why = f"row {row + 1} of {{table}} has the {column}, but another {stronger}"
                    return None, column, why
            return row, column, ""
    known = ", ".join(f"{column} '{wanted}'" for column, wanted in evidence if wanted)
    told = (known or "anything known of the student").replace("{", "{{").replace("}", "}}")
    return None, "", f"nobody in {{table}} has {told}"


def folded(text: str) -> str:
    """A text for comparison."""
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())
