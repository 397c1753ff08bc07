"""Tables: CSV files that are written, platforms' own CSV files filled in, and the row of each student."""

import csv
import html
import io
import json
import re
import unicodedata
from abc import ABC, abstractmethod
from collections import Counter, defaultdict
from collections.abc import Callable, Collection, Iterable, Mapping, Sequence
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field, replace
from itertools import takewhile
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import TypeAdapter, ValidationError

from grader.documents import CriterionDocument, ReportDocument, ResultsDocument
from grader.files import OutputError, guarded
from grader.lms.grades import Delivery, Grade, Options, Person, ready
from grader.records import Reason, Value
from grader.tables.reader import Row, TableKind, check_rows, short, written
from grader.texts.spoken import failure
from reference.authored.variant_table import delimiter_of
from reference.errors import CallError, InputFileError

Cell = str | int | float | None

NO_GRADE = {"", "-"}
"""Cells with which platforms say that there is no grade."""


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """A table as CSV: UTF-8 without a mark, commas, decimal dots, CRLF.

    Texts that a spreadsheet would run as formulas get an apostrophe before.

    Raises OutputError where the text does not read back as the same table.
    """
    table = [[_cell_text(cell) for cell in row] for row in (header, *rows)]
    text = written(table)
    if list(csv.reader(io.StringIO(text, newline=""), strict=True)) != table:
        raise not_as_meant()
    return text


def _cell_text(cell: Cell) -> str:
    """A cell's text: numbers with a dot and without needless digits, texts guarded."""
    match cell:
        case None:
            return ""
        case float():
            return number(cell)
        case int():
            return str(cell)
    return guarded(cell)


def number(value: float, decimals: int = 5) -> str:
    """A decimal dot, at most so many decimals, no exponent, no grouping, no trailing zeros: 7.5, 0.33333."""
    text = f"{value:.{decimals}f}"
    text = text.rstrip("0").rstrip(".") if decimals else text
    return "0" if text == "-0" else text


def not_as_meant() -> OutputError:
    """The error of a file that is read back before it is written, and differs."""
    return failure(OutputError, "not_as_meant")


# Plain tables of the results ----------------------------------------------------------------------

_FIXED = ("student_id", "n", "position", "status", "score", "max_score", "score_low", "score_high")
_LAST = ("mistakes", "problems")


def summary_text(results: ResultsDocument) -> str:
    """A CSV row per student and position; a criterion's points are blank under review and if not judged."""
    criteria = list(dict.fromkeys(each.id for report in results.reports for each in report.criteria))
    # A criterion that is named as a fixed column must not hide it.
    names = [f"criterion_{name}" if name in {*_FIXED, *_LAST} else name for name in criteria]
    return csv_text([*_FIXED, *names, *_LAST], (_summary_row(report, criteria) for report in results.reports))


def _summary_row(report: ReportDocument, criteria: list[str]) -> list[Cell]:
    points = {criterion.id: criterion.points for criterion in report.criteria}
    return [
        report.student_id, report.variant.get("n"), report.position, report.status,
        report.score, report.max_score, *(report.score_range or (None, None)),
        *(points.get(criterion) for criterion in criteria),
        " ".join(f"{mistake.code}@{mistake.at}" for mistake in report.mistakes),
        " ".join(dict.fromkeys(problem.code for problem in report.problems)),
    ]  # fmt: skip


_LONG = (
    "student_id", "n", "position", "status", "criterion", "title", "name", "verdict", "points", "max_points",
    "measured_mm", "measured_deg", "measured_value", "expected_mm", "expected_deg", "expected_value", "unit",
    "tolerance_mm", "tolerance_deg", "confidence", "mistake", "feedback",
)  # fmt: skip


def criteria_text(results: ResultsDocument) -> str:
    """A row per student, position and criterion, with all that was measured and expected."""
    rows = (
        _criterion_row(report, criterion, results.titles.get(criterion.id, criterion.title))
        for report in results.reports
        for criterion in report.criteria
    )
    return csv_text(_LONG, rows)


def _criterion_row(report: ReportDocument, criterion: CriterionDocument, title: str) -> list[Cell]:
    measured, expected, tolerance = criterion.measured, criterion.expected, criterion.tolerance
    return [
        report.student_id, report.variant.get("n"), report.position, report.status,
        criterion.id, title, criterion.vector, criterion.verdict,
        criterion.points, criterion.max_points,
        measured.length_mm, measured.direction_deg, measured.value,
        expected.length_mm, expected.direction_deg, expected.value, expected.unit or measured.unit,
        tolerance.length_mm, tolerance.direction_deg,
        criterion.confidence, criterion.mistake, criterion.feedback,
    ]  # fmt: skip


# Small tables that the instructor writes ----------------------------------------------------------

STUDENT_COLUMNS = ("student_id", "id", "username", "participant")


def with_ids(people: Mapping[str, Person], path: Path) -> dict[str, Person]:
    """People with the platform's numbers: ``student_id``, and ``id``, ``username`` or ``participant``.

    Raises TableError with every fault of the table.
    """
    kind, rows = read_table(path, STUDENT_COLUMNS)
    line_of: dict[tuple[str, str], int] = {}
    joined = dict(people)
    for row in rows:
        for column, cell in row.text.items():
            first = line_of.setdefault((column, cell.casefold()), row.line)
            if cell and first != row.line:
                row.fault(column, Reason("value_twice", {"text": short(cell), "first": first}))
        participant = row["participant"]
        is_number = participant.isascii() and participant.isdigit()
        if participant and not is_number:
            row.fault("participant", Reason("no_participant", {"text": short(participant)}))
        person = joined.get(row["student_id"], Person())
        joined[row["student_id"]] = replace(
            person,
            platform_id=row["id"],
            username=row["username"] or person.username,
            participant=int(participant) if is_number else None,
        )
    check_rows(kind, str(path), rows)
    return joined


def read_table(path: Path, columns: tuple[str, ...]) -> tuple[TableKind, Sequence[Row]]:
    """Rows of a small table, and how it must be; a field for each column, the first one filled in.

    Raises TableError with the file's faults.
    """
    kind = TableKind("ids", columns, columns[:1], 5_000_000, 20_000, is_strict=True)
    table = kind.table(kind.text(path, str(path)), str(path))
    for row in table.rows:
        count, wide = len(row.cells), len(row.header)
        if count != wide:
            row.fault("", Reason("fields_missing", {"fields": count, "columns": wide}))
        elif not row[columns[0]]:
            row.fault(columns[0], Reason("cell_empty"))
    check_rows(kind, str(path), table.rows)
    return kind, table.rows


def bytes_of(path: Path, code: str) -> bytes:
    """A file's content; InputFileError of this code where it cannot be read."""
    try:
        return path.read_bytes()
    except OSError as error:
        raise failure(InputFileError, code, "unreadable", file=path, error=error.strerror) from error


_ANY: TypeAdapter[Any] = TypeAdapter(Any)


def parsed(data: bytes) -> Any:  # noqa: ANN401 - whatever a JSON file holds
    """A JSON file's content; ValueError for none, and for half of a surrogate pair in a text."""
    try:
        return _ANY.validate_json(data.decode(json.detect_encoding(data)))
    except ValidationError as error:
        raise ValueError(error.errors()[0]["ctx"]["error"]) from error


# Files changed in single cells, everything else the same to the byte ------------------------------


@dataclass(slots=True)
class RawTable:
    """Cells as they stand in the file, quotes included, with what stands between them.

    Attributes
    ----------
    mark : a byte order mark, or nothing
    rows : raw cells
    ends : each row's line end; nothing after the last where the file has none
    kept : the columns that are written; all where None
    """

    mark: str
    delimiter: str
    rows: list[list[str]] = field(default_factory=list)
    ends: list[str] = field(default_factory=list)
    kept: Sequence[int] | None = None

    def header(self) -> list[str]:
        """The first row's cells; none of an empty file."""
        return [self.value(0, column) for column in range(len(self.rows[0]))] if self.rows else []

    def value(self, row: int, column: int) -> str:
        """A cell's meaning."""
        cell = self.rows[row][column]
        return cell[1:-1].replace('""', '"') if cell.startswith('"') else cell

    def put(self, row: int, column: int, text: str) -> None:
        """Change one cell; one that already means this text stays as it is written.

        It is quoted where it must be, and where the whole header is.
        """
        if self.value(row, column) != text:
            is_quoted = all(cell.startswith('"') for cell in self.rows[0])
            self.rows[row][column] = quoted(text, self.delimiter, always=is_quoted)

    def text(self, rows: Iterable[int] | None = None) -> str:
        """The file, or these of its rows, with the columns that are kept."""
        chosen = range(len(self.rows)) if rows is None else rows
        return self.mark + "".join(self.delimiter.join(self._kept(row)) + self.ends[row] for row in chosen)

    def _kept(self, row: int) -> list[str]:
        cells = self.rows[row]
        return cells if self.kept is None or cells == [""] else [cells[column] for column in self.kept]

    def ragged(self) -> list[Reason]:
        """Faults of rows that have more or fewer cells than the first; empty lines are none."""
        wide = len(self.rows[0])
        return [
            Reason("fields_missing", {"table_row": row, "fields": len(cells), "columns": wide})
            for row, cells in enumerate(self.rows, 1)
            if len(cells) != wide and cells != [""]
        ]


def quoted(text: str, delimiter: str, *, always: bool = False) -> str:
    """A raw cell that means this text."""
    if always or any(mark in text for mark in (delimiter, '"', "\n", "\r")) or text != text.strip():
        return '"' + text.replace('"', '""') + '"'
    return text


_QUOTED = r'"[^"]*+(?:""[^"]*+)*+"'


def parse(data: bytes, file: str, delimiter: str | None = ",") -> RawTable:
    """Split a file into raw cells; where the delimiter is None, at the one that its first line has.

    Raises InputFileError for text that is not UTF-8, for an open quote and for text after a closed one.
    """
    try:
        text = data.decode("utf-8")
    except UnicodeDecodeError as error:
        raise failure(InputFileError, "not_utf8", file=file, byte=error.start) from error
    delimiter = delimiter or delimiter_of(text)
    pattern = re.compile(rf'({_QUOTED}|[^"{delimiter}\r\n][^{delimiter}\r\n]*+|)({delimiter}|\r\n|\r|\n|\Z)')
    table = RawTable("\ufeff" if text.startswith("\ufeff") else "", delimiter)
    at, row = len(table.mark), list[str]()
    while at < len(text) or row:
        cell = pattern.match(text, at)
        if cell is None:
            code = "quote_broken" if re.compile(_QUOTED).match(text, at) else "quote_open"
            raise failure(InputFileError, code, file=file, row=len(table.rows) + 1)
        row.append(cell[1])
        at = cell.end()
        if cell[2] != delimiter:
            table.rows.append(row)
            table.ends.append(cell[2])
            row = []
    return table


# The row of each student -------------------------------------------------------------------------------

Evidence = Sequence[tuple[str, str]]
"""Columns and what would stand there, the strongest first; an empty text is no evidence."""
NAME = "name"
"""The column that two people may share."""


@dataclass(slots=True)
class Matches:
    """The row of each student, and why others have none; `by_name` are students known by their name alone."""

    rows: dict[str, int] = field(default_factory=dict)
    missing: dict[str, Reason] = field(default_factory=dict)
    by_name: list[str] = field(default_factory=list)

    def notes_on(self, students: Iterable[str]) -> list[Reason]:
        """Return what a person should check about these students."""
        chosen = set(students)
        doubtful = tuple(student for student in self.by_name if student in chosen)
        return [Reason("by_name_alone", {"students": doubtful})] if doubtful else []


def match_rows(rows: Mapping[int, Mapping[str, str]], students: Mapping[str, Evidence]) -> Matches:
    """The row of each student in a table, without regard to case and spaces.

    Names also fit over accents, cedilla or comma below, the dots of ё, apostrophes, the order of their
    parts, and where one has a part more, as a patronymic.

    The strongest evidence that fits decides, unless stronger evidence speaks against that row: a
    namesake with another address. Only columns that know anybody of these students can speak so.

    Arguments: `rows` has cells by row and column.
    """
    cells = {
        row: {column: _key(column, text) for column, text in texts.items()} for row, texts in rows.items()
    }
    keys = {
        student: [(column, _key(column, text)) for column, text in evidence if text.strip()]
        for student, evidence in students.items()
    }
    rows_with = _rows_with(cells, {key for evidence in keys.values() for key in evidence})
    speaking = {key[0] for evidence in keys.values() for key in evidence if key in rows_with}
    matches = Matches()
    claims: dict[int, dict[str, str]] = defaultdict(dict)
    for student, evidence in keys.items():
        stronger = list(takewhile(lambda key: key not in rows_with, evidence))
        if len(stronger) == len(evidence):
            known = tuple(f"{column} '{text}'" for column, text in students[student] if text)
            matches.missing[student] = Reason("row_absent", {"known": known} if known else {})
            continue
        key = evidence[len(stronger)]
        row, *others = rows_with[key]
        contrary = [
            column
            for column, text in stronger
            if column in speaking - {key[0]} and cells[row].get(column) not in (None, "", text)
        ]
        if others:
            fitting = tuple(f"{each + 1} ({_who(rows[each])})" for each in (row, *others))
            matches.missing[student] = Reason("row_several", {"rows": fitting, "column": key[0]})
        elif contrary:
            found: dict[str, Value] = {"row": row + 1, "column": key[0], "other": contrary[0]}
            matches.missing[student] = Reason("row_contrary", found)
        else:
            claims[row][student] = key[0]
    for row, claiming in claims.items():
        if len(claiming) > 1:
            both = tuple(f"{student} ({_who(dict(students[student]))})" for student in claiming)
            found = {"row": row + 1, "who": _who(rows[row]), "students": both}
            matches.missing.update(dict.fromkeys(claiming, Reason("row_shared", found)))
        else:
            matches.rows.update(dict.fromkeys(claiming, row))
            matches.by_name += [student for student, column in claiming.items() if column == NAME]
    return matches


def match_class(
    rows: Mapping[int, Mapping[str, str]],
    grades: Sequence[Grade],
    options: Options,
    evidence: Callable[[str, Person], Evidence],
) -> Matches:
    """Match everybody of a class as `match_rows` does; `evidence` gives the cells of a student."""
    students = {**options.people, **{grade.student_id: grade.person for grade in grades}}
    return match_rows(rows, {student: evidence(student, who) for student, who in students.items()})


def _who(cells: Mapping[str, str]) -> str:
    """Name and address, or else all that is known."""
    known = [text for column in (NAME, "email") if (text := cells.get(column))]
    return ", ".join(known or filter(None, cells.values()))


_CellKey = tuple[str, str]
"""A column and what is compared of a cell in it."""


def _rows_with(
    cells: Mapping[int, Mapping[str, str]], wanted: AbstractSet[_CellKey]
) -> dict[_CellKey, list[int]]:
    """The rows of each cell; of a wanted name that no row has, those that have it in part."""
    rows_with: dict[_CellKey, list[int]] = defaultdict(list)
    parts: dict[str, set[int]] = defaultdict(set)
    for row, texts in cells.items():
        for cell in texts.items():
            rows_with[cell].append(row)
        for part in texts.get(NAME, "").split():
            parts[part].add(row)
    for column, name in wanted - rows_with.keys():
        if column == NAME and (rows := _rows_in_part(set(name.split()), parts)):
            rows_with[column, name] = rows
    return rows_with


def _rows_in_part(name: set[str], rows_with: Mapping[str, Collection[int]]) -> list[int]:
    """The rows of names that have all parts of this one, or of which it has all, two at least."""
    shared = Counter(row for part in name for row in rows_with.get(part, ()))
    several = {row for row, count in shared.items() if count > 1}
    longer = {
        row for part, rows in rows_with.items() if part not in name for row in several.intersection(rows)
    }
    return sorted(row for row in several if row not in longer or shared[row] == len(name))


def _key(column: str, text: str) -> str:
    """Return the part of a cell that is compared."""
    return (
        plain_name(text)
        if column == NAME
        else " ".join(unicodedata.normalize("NFKC", text).casefold().split())
    )


def plain_name(text: str) -> str:
    """Return a name's parts in alphabetical order, in small letters without marks."""
    letters = unicodedata.normalize("NFKD", text).casefold()
    # Of the apostrophes some are letters to Unicode: category Lm.
    plain = "".join(
        letter
        for letter in letters
        if letter in ",-" or letter.isspace() or (letter.isalnum() and unicodedata.category(letter) != "Lm")
    )
    return " ".join(sorted(plain.replace(",", " ").replace("-", " ").split()))


# A platform's own table, filled in ----------------------------------------------------------------


@dataclass(slots=True)
class Form(ABC):
    """A platform's own table of students, with a column in which grades are filled in.

    Attributes
    ----------
    columns : places of columns by our names, ``grade`` among them; ``feedback`` takes comments
    above : row of the table above the first student
    possible : the maximum of all grades; None where each row states its own
    """

    table: RawTable
    columns: Mapping[str, int]
    above: int = 0
    possible: float | None = None
    notes: list[Reason] = field(default_factory=list)
    platform: str = ""

    replaced: ClassVar[str] = "grades_changed"
    """The code of the note on changed grades that the platform holds already."""

    @classmethod
    @abstractmethod
    def opened(cls, data: bytes, file: str, item: str) -> Self:
        """A file of the platform; raises InputFileError with its faults, CallError for an unknown item."""

    @staticmethod
    @abstractmethod
    def amount(text: str) -> float | None:
        """A number that is not negative, as the platform writes it."""

    @abstractmethod
    def why_fixed(self, row: int) -> Reason | None:
        """Return why the grade of a row must not be changed; None where it may."""

    @abstractmethod
    def identity(self, row: int) -> Mapping[str, str]:
        """The cells that say who a row is; none for a row of nobody."""

    @staticmethod
    @abstractmethod
    def evidence(student_id: str, person: Person) -> Evidence:
        """Return the cells that a student's row would have."""

    def value(self, row: int, name: str) -> str:
        """A cell's text; empty where the table has no such column."""
        column = self.columns.get(name)
        return "" if column is None else self.table.value(row, column).strip()

    def decimals(self, row: int) -> int:  # noqa: ARG002 - of a platform that shows rows differently
        """Decimals with which grades are written; fewer where the platform shows fewer."""
        return 5

    def maximum(self, row: int) -> float | None:
        """The maximum grade of a row; None where the table does not state it."""
        return self.possible or self.amount(self.value(row, "maximum"))

    @property
    def people(self) -> list[int]:
        """The rows of students; platforms skip empty lines."""
        rows = self.table.rows
        return [row for row in range(self.above + 1, len(rows)) if rows[row] != [""]]

    def match(self, grades: Sequence[Grade], options: Options) -> Matches:
        """The rows of students, among the whole class: a row that fits two of them is given to neither."""
        rows = {row: cells for row in self.people if (cells := self.identity(row))}
        return match_class(rows, grades, options, self.evidence)

    def notes_on(self, changed: int, zeros: Sequence[str]) -> Sequence[Reason]:  # noqa: ARG002 - some platforms
        """Return what to check after the upload of so many changed grades; `zeros` are students who got 0."""
        return ()

    def put_grade(self, row: int, text: str) -> bool:
        """Put a grade into its cell; whether that is another one for the platform."""
        amount = self.amount(self.value(row, "grade"))
        if amount is not None and number(amount, self.decimals(row)) == text:
            return False
        self.table.put(row, self.columns["grade"], text)
        return True

    def put_comment(self, row: int, text: str) -> bool:
        """Put a comment into its cell, where the table has such a column; whether another one stood there."""
        if "feedback" not in self.columns:
            return False
        before = self.value(row, "feedback")
        self.table.put(row, self.columns["feedback"], text)
        return bool(before) and _words(before) != _words(text)


def _words(comment: str) -> str:
    """Return the part of a comment that is compared: platforms leave out its tags and change its spaces."""
    return "".join(html.unescape(re.sub(r"<[^>]*>", "", comment)).split())


def fill_in(
    form: Form, file: str, grades: Sequence[Grade], options: Options, comments: Mapping[str, str]
) -> Delivery:
    """Fill in grades, and comments by student_id; only cells of those who have a grade change.

    Raises CallError where the form's maximum is not the rubric's and nobody asks for rescaling, and
    where nothing states it; OutputError where the changed file, opened again, does not hold the grades
    that were meant.
    """
    matches = form.match(grades, options)
    held = {row: cell for row in form.people if (cell := form.value(row, "grade")) not in NO_GRADE}
    filled, unplaced, texts = list[str](), dict[str, Reason](), dict[int, str]()
    changed, zeros, comments_replaced = list[int](), list[str](), 0
    for grade in ready(grades):
        student, row = grade.student_id, matches.rows.get(grade.student_id)
        if why := matches.missing[student] if row is None else form.why_fixed(row):
            unplaced[student] = why
        if row is None or why:
            continue
        filled.append(student)
        maximum = form.maximum(row) or options.maximum
        if maximum is None:
            raise failure(CallError, "maximum_unknown", file=file, platform=form.platform)
        score = grade.out_of(maximum, rescale=options.rescale, file=file)
        texts[row] = number(score, form.decimals(row))
        zeros += [student] if texts[row] == "0" else []
        changed += [row] if form.put_grade(row, texts[row]) else []
        if student in comments:
            comments_replaced += form.put_comment(row, comments[student])
    # Moodle would take a comment that it wrote without its links for a changed one: no row of others stays.
    staying = [row for row in range(len(form.table.rows)) if row <= form.above or row in texts]
    content = form.table.text(staying).encode("utf-8")
    again = form.opened(content, file, options.item)
    for place, row in enumerate(staying):
        written = again.amount(again.value(place, "grade")) if row in texts else None
        if row in texts and (written is None or number(written) != texts[row]):
            raise not_as_meant()
    notes = [*form.notes, *form.notes_on(len(changed), zeros)]
    replaced = sum(row in held for row in changed)
    for code, count in ((form.replaced, replaced), ("comments_changed", comments_replaced)):
        notes += [Reason(code, {"platform": form.platform, "count": count})] if count else []
    notes += matches.notes_on(filled)
    waiting = {
        grade.student_id: matches.rows.get(grade.student_id) for grade in grades if grade.score is None
    }
    stays = tuple(f"{student} ({held[row]})" for student, row in waiting.items() if row in held)
    notes += [Reason("withheld_stay", {"students": stays})] if stays else []
    return Delivery(content, unplaced=unplaced, notes=tuple(notes))
