"""The roster: who the students are, their variants, and which scans are theirs.

A CSV file with the columns ``student_id,name`` and optionally ``n,position,email,kL,kv,ka,lang,scans``;
a student with several positions has a line for each. Comma or semicolon separated; in a
semicolon-separated file numbers have decimal commas, and a `scans` field of several files is quoted.
"""

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.files import shown_text, unguarded
from grader.inputs.scale_text import MAX_LENGTH as LONGEST_SCALE
from grader.language import ID_RULES, LANGUAGES, N_, ROOT_LANGUAGE, Tongue, tongue
from grader.records import Reason
from reference.authored.assignment import SCALE_NAMES
from reference.authored.variant_table import delimiter_of, table_lines
from reference.errors import MOST_FINDINGS, AuthoredFileError, Finding, near_names

_STUDENT_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device in place of a file or folder of such a name, whatever its extension."""
_RESULT_FILES = frozenset({"results.json", "summary.csv", "index.html", "decisions.csv"})
"""What lies beside the students' folders of results."""
COLUMNS = ("student_id", "name", "n", "position", "email", *SCALE_NAMES, "lang", "scans")
DRAFT_COLUMNS = ("why", "sure")
"""What `planmark match` adds for the person who checks its draft; without meaning here."""
_REQUIRED = ("student_id", "name")
MAX_LINES = 20_000
"""No class has more students and positions."""
_MAX_BYTES = 20_000_000
"""So many lines of a thousand characters."""
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
        """Whether a page of a file is meant."""
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


@dataclass(frozen=True, slots=True)
class Roster:
    """All rows in the file's order.

    Attributes
    ----------
    file : name of the file
    rows : a row per student and position
    problems : what a person should know, such as columns passed over
    by_student, by_scan : the rows of each student, and of each file among the scans
    """

    file: str
    rows: tuple[RosterRow, ...]
    problems: tuple[Reason, ...] = ()
    by_student: dict[str, tuple[RosterRow, ...]] = field(init=False, repr=False, compare=False)
    by_scan: dict[str, tuple[RosterRow, ...]] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Sort the rows: a class may have thousands, and each of its pages asks for some."""
        by_student: dict[str, list[RosterRow]] = {}
        by_scan: dict[str, list[RosterRow]] = {}
        for row in self.rows:
            by_student.setdefault(row.student_id, []).append(row)
            for file in dict.fromkeys(ref.file for ref in row.scans):
                by_scan.setdefault(file, []).append(row)
        for name, rows in (("by_student", by_student), ("by_scan", by_scan)):
            object.__setattr__(self, name, {key: tuple(of_key) for key, of_key in rows.items()})

    @property
    def student_ids(self) -> tuple[str, ...]:
        """Every student once, in the roster's order."""
        return tuple(self.by_student)

    def rows_of(self, student_id: str) -> tuple[RosterRow, ...]:
        """The rows of one student."""
        return self.by_student.get(student_id, ())


def why_no_id(text: str) -> Reason | None:
    """Why a text cannot be a student's id, which names the student's folder of results; None where it can."""
    if _STUDENT_ID.fullmatch(text) is None:
        return Reason("id_letters")
    if text.startswith(".") or text.endswith("."):
        return Reason("id_dot")
    if _DEVICES.fullmatch(text):
        return Reason("id_device")
    if text.lower() in _RESULT_FILES:
        return Reason("id_result")
    return None


def read_roster(path: Path | str, name: str = "") -> Roster:
    """Read a roster; `name` is the one that the user knows it by, if that is not the path's own.

    Raises AuthoredFileError with every fault of the file, each with the number of its line.
    """
    path = Path(path)
    return parse_roster(_text_of(path, name or str(path)), name or path.name)


def parse_roster(text: str, file: str = "roster.csv") -> Roster:
    """The roster in a text; raises as `read_roster` does."""
    delimiter = delimiter_of(text)
    lines, findings = table_lines(text, delimiter, MAX_LINES)
    if not lines:
        findings = findings or [Finding("line 1", "the file is empty; its first line must name the columns")]
        raise AuthoredFileError(file, tuple(findings))
    header = [name.strip() for name in lines[0][1]]
    findings.extend(_check_header(header))
    rows: list[RosterRow] = []
    if not findings:
        read = (_row(number, header, cells, delimiter, findings) for number, cells in lines[1:])
        rows = [row for row in read if row is not None]
        findings.extend(_check_together(rows))
        if not rows and not findings:
            findings.append(Finding("line 2", "there are no students below the line of column names"))
    if findings:
        raise AuthoredFileError(file, tuple(findings))
    return Roster(file, tuple(rows), tuple(_passed_over(header, file)))


def _text_of(path: Path, name: str) -> str:
    try:
        if path.stat().st_size > _MAX_BYTES:
            finding = Finding("$", f"is larger than {_MAX_BYTES // 1_000_000} MB: no class's list is")
            raise AuthoredFileError(name, (finding,))
        return path.read_bytes().decode("utf-8-sig")
    except OSError as error:
        finding = Finding("$", f"cannot be read: {error.strerror or error}")
        raise AuthoredFileError(name, (finding,)) from error
    except UnicodeDecodeError as error:
        advice = "is not UTF-8 text; save it as CSV in UTF-8"
        raise AuthoredFileError(name, (Finding("$", advice),)) from error


# Tables, of a roster and of measurements ----------------------------------------------------------


_ENGLISH = tongue(ROOT_LANGUAGE)
OF_TABLES = (
    N_("line %(number)s"),
    N_("more than %(most)s lines are no table"),
    N_("is no CSV: %(error)s; check its quotes"),
)
"""What `table_lines` says, to be translated."""


def surplus_of(
    header: Sequence[str], cells: Sequence[str], delimiter: str, speaker: Tongue = _ENGLISH
) -> str | None:
    """What is wrong with a line of more fields than there are columns; None for any other."""
    if not any(cell.strip() for cell in cells[len(header) :]):
        return None
    text = N_(
        "has %(fields)s fields, the first line names %(columns)s columns;"
        " quote a field that holds a '%(mark)s'"
    )
    known = {"fields": len(cells), "columns": len(header), "mark": delimiter}
    return speaker.gettext(text) % known


def whole_number(text: str, delimiter: str) -> int | None:
    """A whole number; spreadsheets may have added zeros as decimals (7.0, or 7,0 beside semicolons)."""
    mark = "," if delimiter == ";" else r"\."
    digits = re.fullmatch(rf"([+-]?\d{{1,9}})(?:{mark}0+)?", text, re.ASCII)
    return None if digits is None else int(digits[1])


# The roster's own columns -------------------------------------------------------------------------


def _check_header(header: list[str]) -> Iterator[Finding]:
    for name in _REQUIRED:
        if name not in header:
            yield Finding("line 1", f"column {name} is missing")
    for name, count in sorted(Counter(filter(None, header)).items()):
        if count > 1:
            yield Finding("line 1", f"column {short(name)} is there {count} times")
    names = frozenset(header)
    for name in _unknown(header)[:MOST_FINDINGS]:
        near = _near(name)
        if near is not None and near not in names:
            yield Finding("line 1", f"column '{short(name)}' is not known; did you mean {near}?")


def _unknown(header: list[str]) -> list[str]:
    return [name for name in header if name and name not in COLUMNS and name not in DRAFT_COLUMNS]


def _near(name: str) -> str | None:
    near = near_names(name.replace(" ", "_"), COLUMNS, most=1, cutoff=_ALMOST)
    return near[0] if near else None


def _passed_over(header: list[str], file: str) -> Iterator[Reason]:
    unknown = _unknown(header)
    if unknown:
        columns = tuple(short(name) for name in unknown[:MOST_FINDINGS])
        more = {"more": len(unknown) - MOST_FINDINGS} if len(unknown) > MOST_FINDINGS else {}
        yield Reason("roster_columns", {"columns": columns, **more}, file)


def _row(
    number: int, header: list[str], cells: list[str], delimiter: str, findings: list[Finding]
) -> RosterRow | None:
    """A line's row, or None with its faults added to `findings`."""
    surplus = surplus_of(header, cells, delimiter)
    if surplus is not None:
        findings.append(Finding(f"line {number}", surplus))
        return None
    text = dict.fromkeys(COLUMNS, "")
    text |= {
        name: unguarded(cell.strip()) for name, cell in zip(header, cells, strict=False) if name in COLUMNS
    }
    scans = [parse_scan(part.strip()) for part in text["scans"].split(";") if part.strip()]
    row = RosterRow(
        student_id=text["student_id"],
        name=text["name"],
        n=whole_number(text["n"], delimiter),
        position=whole_number(text["position"], delimiter),
        email=text["email"] or None,
        scales={name: text[name] for name in SCALE_NAMES if text[name]},
        lang=text["lang"].lower() or None,
        scans=tuple(ref for ref in scans if isinstance(ref, ScanRef)),
        line=number,
    )
    faults = list(_faults_of(row, text))
    faults += [("scans", why) for why in scans if isinstance(why, str)]
    findings.extend(Finding(f"line {number}, {column}", why) for column, why in faults)
    return None if faults else row


def _faults_of(row: RosterRow, text: Mapping[str, str]) -> Iterator[tuple[str, str]]:
    """The columns of a row whose text cannot be used, and why."""
    for name in SCALE_NAMES:
        if len(text[name]) > LONGEST_SCALE:
            yield name, f"has more than {LONGEST_SCALE} characters"
    why = why_no_id(row.student_id)
    if not row.student_id:
        yield "student_id", "is empty"
    elif why is not None:
        yield "student_id", f"'{short(row.student_id)}' is refused: {ID_RULES[why.code]}"
    for name, value in (("n", row.n), ("position", row.position)):
        if text[name] and value is None:
            yield name, f"'{short(text[name])}' is no whole number"
    if row.lang is not None and row.lang not in LANGUAGES:
        yield "lang", f"'{short(text['lang'])}' is not known; there are {', '.join(LANGUAGES)}"


def parse_scan(text: str) -> ScanRef | str:
    """`class.pdf#3` or `extra.jpg`; a sentence about what is wrong where it is neither."""
    text = shown_text(text)
    file, mark, page = text.rpartition("#")
    if not mark:
        return ScanRef(text)
    if re.fullmatch(r"\d{1,6}", page, re.ASCII):
        if not file or int(page) < 1:
            return f"'{short(text)}': a page is FILE#NUMBER, from 1"
        return ScanRef(file, int(page))
    # A file's own name may have a # in it; what follows one in `#3-4` is a page written wrongly.
    if "." in page:
        return ScanRef(text)
    return f"'{short(text)}': after # one page number is expected, from 1"


def _check_together(rows: list[RosterRow]) -> Iterator[Finding]:
    """Faults between lines: a student twice, two in one folder, positions missing, a file of two students."""
    first: dict[tuple[str, int | None], int] = {}
    for row in rows:
        key = (row.student_id, row.position)
        if key in first:
            where = "" if row.position is None else f" in position {row.position}"
            message = f"{row.student_id}{where} is on line {first[key]} already"
            yield Finding(f"line {row.line}, student_id", message)
        first.setdefault(key, row.line)
    yield from _check_case(rows)
    yield from _check_positions(rows)
    yield from _check_scans(rows)


def _check_case(rows: list[RosterRow]) -> Iterator[Finding]:
    """Folders of results are named by the ids: where case does not count, two of them would be one."""
    spelled: dict[str, RosterRow] = {}
    for row in rows:
        other = spelled.setdefault(row.student_id.lower(), row)
        if other.student_id != row.student_id:
            clash = f"{row.student_id} differs in case only from {other.student_id} on line {other.line}"
            yield Finding(f"line {row.line}, student_id", f"{clash}: the two would share a folder")


def _check_positions(rows: list[RosterRow]) -> Iterator[Finding]:
    """A student with several lines needs a position on each."""
    lines: dict[str, list[RosterRow]] = {}
    for row in rows:
        lines.setdefault(row.student_id, []).append(row)
    for several in lines.values():
        if len(several) > 1 and any(row.position is not None for row in several):
            for row in several:
                if row.position is None:
                    message = f"is empty, but {row.student_id} has other lines with positions"
                    yield Finding(f"line {row.line}, position", message)


def _check_scans(rows: list[RosterRow]) -> Iterator[Finding]:
    """Files and pages that two lines name, or one line twice; a whole file holds each of its pages."""
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
                message = f"{ref} is named on line {clash[1].line} already ({clash[0]})"
                yield Finding(f"line {row.line}, scans", message)
            named.setdefault(ref.page, (ref, row))


def short(text: str) -> str:
    """The text, not longer than a message should quote it."""
    return text if len(text) <= 40 else text[:37] + "..."
