"""The roster: who the students are, their variants, and which scans are theirs.

A CSV file with the columns ``student_id,name`` and optionally ``n,position,email,kL,kv,ka,lang,scans``;
a student with several positions has a line for each. Comma or semicolon separated; in a
semicolon-separated file numbers have decimal commas, and a `scans` field of several files is quoted.
"""

import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from grader.files import shown_text, unguarded
from grader.language import LANGUAGES
from grader.records import Reason, Value
from grader.tables.reader import Row, TableKind, at, check_rows, near, short
from grader.tables.scale_text import MAX_LENGTH as LONGEST_SCALE
from reference.authored.assignment import SCALE_NAMES
from reference.errors import MOST_FINDINGS

COLUMNS = ("student_id", "name", "n", "position", "email", *SCALE_NAMES, "lang", "scans")
DRAFT_COLUMNS = ("why", "sure")
"""Columns that `planmark match` adds for the person who checks its draft; ignored here."""
ROSTER = TableKind("authored_file", COLUMNS, ("student_id", "name"), most_bytes=20_000_000, most_lines=20_000)
"""No class has more students and positions; so many lines of a thousand characters."""
_ALMOST = 0.75
"""Similarity from which an unknown column is taken for a misspelt one."""


@dataclass(frozen=True, slots=True)
class ScanRef:
    """A file of the folder, or one page of it (from 1)."""

    file: str
    page: int | None = None

    def __str__(self) -> str:
        return self.file if self.page is None else f"{self.file}#{self.page}"

    def covers(self, file: str, page: int) -> bool:
        """Return whether it names this page of the file."""
        return self.file == file and self.page in (None, page)


@dataclass(frozen=True, slots=True)
class RosterRow:
    """A student, in one position where the assignment has positions.

    Attributes
    ----------
    scales : as declared, text with a unit, by ``kL``, ``kv``, ``ka``; only those given
    line : line of the file, from 1
    """

    student_id: str
    name: str = ""
    n: int | None = None
    position: int | None = None
    email: str | None = None
    scales: Mapping[str, str] = field(default_factory=dict)
    lang: str | None = None
    scans: tuple[ScanRef, ...] = ()
    line: int = 0


@dataclass(frozen=True)
class Roster:
    """All rows in the file's order.

    Attributes
    ----------
    file : name of the file
    rows : a row per student and position
    problems : what a person should know, such as columns passed over
    """

    file: str
    rows: tuple[RosterRow, ...]
    problems: tuple[Reason, ...] = ()

    @cached_property
    def by_student(self) -> dict[str, list[RosterRow]]:
        """The rows of each student."""
        return _grouped((row.student_id, row) for row in self.rows)

    @cached_property
    def by_scan(self) -> dict[str, list[RosterRow]]:
        """The rows of each file among the scans."""
        return _grouped((file, row) for row in self.rows for file in {ref.file: None for ref in row.scans})

    @property
    def student_ids(self) -> tuple[str, ...]:
        """Every student once, in the roster's order."""
        return tuple(self.by_student)

    def rows_of(self, student_id: str) -> tuple[RosterRow, ...]:
        """The rows of one student."""
        return tuple(self.by_student.get(student_id, ()))


def _grouped(pairs: Iterable[tuple[str, RosterRow]]) -> dict[str, list[RosterRow]]:
    groups: dict[str, list[RosterRow]] = {}
    for key, row in pairs:
        groups.setdefault(key, []).append(row)
    return groups


def read_roster(path: Path | str, name: str = "") -> Roster:
    """Read a roster; `name` is the one that the user knows it by, if that is not the path's own.

    Raises TableError with every fault of the file, each with the number of its line.
    """
    return parse_roster(ROSTER.text(Path(path), name or str(path)), name or Path(path).name)


def parse_roster(text: str, file: str = "roster.csv") -> Roster:
    """The roster in a text; raises as `read_roster` does."""
    table = ROSTER.table(text, file, _misspelt)
    rows = [row for row in map(_row, table.rows) if row is not None]
    check_rows(ROSTER, file, table.rows, _check_together(rows))
    return Roster(file, tuple(rows), tuple(_passed_over(_unknown(table.header), file)))


def _unknown(header: Sequence[str]) -> list[str]:
    return [name for name in header if name and name not in (*COLUMNS, *DRAFT_COLUMNS)]


def _misspelt(header: Sequence[str]) -> Iterator[Reason]:
    for name in _unknown(header)[:MOST_FINDINGS]:
        meant = near(name.replace(" ", "_"), COLUMNS, cutoff=_ALMOST)
        if meant and not {*header}.intersection(meant["near"]):
            yield Reason("column_unknown", {"line": 1, "name": short(name), **meant})


def _passed_over(unknown: list[str], file: str) -> Iterator[Reason]:
    if unknown:
        columns = tuple(short(name) for name in unknown[:MOST_FINDINGS])
        more = {"more": len(unknown) - MOST_FINDINGS} if len(unknown) > MOST_FINDINGS else {}
        yield Reason("roster_columns", {"columns": columns, **more}, file)


def _row(row: Row) -> RosterRow | None:
    """A line's row, or None for one with faults."""
    if row.is_too_wide():
        return None
    row.text = {name: unguarded(text) for name, text in row.text.items()}
    for name in SCALE_NAMES:
        if len(row[name]) > LONGEST_SCALE:
            row.fault(name, Reason("too_long", {"most": LONGEST_SCALE}))
    student, n, position = row.student(), row.whole("n"), row.whole("position")
    lang = row["lang"].lower() or None
    if lang is not None and lang not in LANGUAGES:
        row.fault("lang", Reason("lang_unknown", {"text": short(row["lang"]), "names": LANGUAGES}))
    scans = [parse_scan(part.strip()) for part in row["scans"].split(";") if part.strip()]
    for why in scans:
        if isinstance(why, Reason):
            row.fault("scans", why)
    if row.faults or student is None:
        return None
    return RosterRow(
        student_id=student,
        name=row["name"],
        n=n,
        position=position,
        email=row["email"] or None,
        scales={name: row[name] for name in SCALE_NAMES if row[name]},
        lang=lang,
        scans=tuple(ref for ref in scans if isinstance(ref, ScanRef)),
        line=row.line,
    )


def parse_scan(text: str) -> ScanRef | Reason:
    """`class.pdf#3` or `extra.jpg`; what is wrong where it is neither."""
    text = shown_text(text)
    file, mark, page = text.rpartition("#")
    is_page = re.fullmatch(r"\d{1,6}", page, re.ASCII) is not None
    if mark and is_page and file and int(page) > 0:
        return ScanRef(file, int(page))
    # A file's own name may have a # in it; what follows one in `#3-4` is a page written wrongly.
    if not mark or (not is_page and "." in page):
        return ScanRef(text)
    return Reason("no_scan", {"text": short(text)})


def _check_together(rows: Sequence[RosterRow]) -> Iterator[Reason]:
    """Faults between lines: a student twice, two in one folder, positions missing, a file of two students."""
    first: dict[tuple[str, int | None], int] = {}
    for row in rows:
        key = (row.student_id, row.position)
        if key in first:
            where = {} if row.position is None else {"position": row.position}
            yield _at("student_twice", row, "student_id", student=row.student_id, first=first[key], **where)
        first.setdefault(key, row.line)
    yield from _check_case(rows)
    yield from _check_positions(rows)
    yield from _check_scans(rows)


def _at(code: str, row: RosterRow, column: str, **known: Value) -> Reason:
    return at(Reason(code, known), row.line, column)


def _check_case(rows: Sequence[RosterRow]) -> Iterator[Reason]:
    """Folders of results are named by the ids: where case does not count, two of them would be one."""
    spelled: dict[str, RosterRow] = {}
    for row in rows:
        other = spelled.setdefault(row.student_id.lower(), row)
        if other.student_id != row.student_id:
            known = {"student": row.student_id, "other": other.student_id}
            yield _at("student_case", row, "student_id", first=other.line, **known)


def _check_positions(rows: Sequence[RosterRow]) -> Iterator[Reason]:
    """A student with several lines needs a position on each."""
    for several in _grouped((row.student_id, row) for row in rows).values():
        if len(several) > 1 and any(row.position is not None for row in several):
            for row in several:
                if row.position is None:
                    yield _at("position_missing", row, "position", student=row.student_id)


def _check_scans(rows: Sequence[RosterRow]) -> Iterator[Reason]:
    """Files and pages of two students, or named twice on a line; a whole file holds each of its pages.

    A student's positions may share a sheet.
    """
    owners: dict[str, dict[int | None, tuple[ScanRef, RosterRow]]] = {}
    for row in rows:
        for ref in row.scans:
            named = owners.setdefault(ref.file, {})
            clash = (
                next(iter(named.values()), None)
                if ref.page is None
                else named.get(ref.page) or named.get(None)
            )
            if clash is not None:
                other, first = clash
                if first is row or first.student_id != row.student_id:
                    yield _at("scan_twice", row, "scans", scan=str(ref), first=first.line, other=str(other))
            named[ref.page] = ref, row
