"""Read tables that people write: text, columns and lines, with each fault and its place.

Comma, semicolon or tab separated, whichever the first line has most of; beside semicolons numbers have
decimal commas. UTF-8, or UTF-16 with its mark. A fault is a `Reason` with the code of a clause of
`grader.texts.faults`, and its place: `line` from 1, and `cell`, a column or the path in a document.
"""

import csv
import io
import math
import re
import stat
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.language import Tongue
from grader.records import Reason, Value
from grader.tables.scale_text import number_with_unit
from grader.texts.spoken import ENGLISH, fault, lines_of
from reference.authored.variant_table import delimiter_of, number_of, table_lines
from reference.errors import InputFileError, near_names

_STUDENT_ID = re.compile(r"[A-Za-z0-9._-]{1,64}")
_DEVICES = re.compile(r"(con|prn|aux|nul|com[0-9]|lpt[0-9])(\..*)?", re.IGNORECASE)
"""Windows opens a device in place of a file or folder of such a name, whatever its extension."""
RESULT_FILES = frozenset(
    {"results.json", "rubric.json", "assessments.json", "summary.csv", "index.html", "decisions.csv"}
)
"""Files beside the students' folders of results."""
_COMMENT = re.compile(r'^[ \t]*"?#[^\n]*', re.MULTILINE)
MARK = "\ufeff"
"""The byte order mark: without it spreadsheets take letters with accents for others."""


def decoded(content: bytes, errors: str = "strict") -> str:
    """A file's text in UTF-8, or in UTF-16 with a byte order mark; behind its mark if it has one."""
    is_wide = content[:2] in {b"\xff\xfe", b"\xfe\xff"}
    return MARK + content.decode("utf-16", errors) if is_wide else content.decode("utf-8", errors)


class TableError(InputFileError):
    """A file of people's that cannot be used: `faults` say why; `parameters` tell the first one."""

    def __init__(self, code: str, file: str, faults: Sequence[Reason], speaker: Tongue = ENGLISH) -> None:
        first, *others = faults
        more: dict[str, Value] = {"more": len(others)} if others else {}
        said = [fault(one, speaker) for one in faults]
        message = f"{file}:\n{lines_of(said, speaker)}" if others else f"{file}: {said[0]}"
        super().__init__(code, message, why=first.code, **first.parameters, **more)
        self.file, self.faults = file, tuple(faults)

    def told(self, speaker: Tongue) -> "TableError":
        """The same error with its message in another language."""
        return TableError(self.code, self.file, self.faults, speaker)


Check = Callable[[Sequence[str]], Iterable[Reason]]


@dataclass(frozen=True, slots=True)
class TableKind:
    """The form that a table must have.

    Attributes
    ----------
    code, unreadable, encoding : of the error of one that cannot be used, opened, or is no UTF-8
    columns : names that are known, as messages list them
    required : those of them without which nothing can be read
    has_comments : lines that begin with ``#`` are passed over
    is_strict : a column that is not known is a fault
    """

    code: str
    columns: tuple[str, ...]
    required: tuple[str, ...]
    most_bytes: int
    most_lines: int
    has_comments: bool = False
    is_strict: bool = False
    unreadable: str = ""
    encoding: str = ""

    def text(self, path: Path, file: str) -> str:
        """A file's text, behind its byte order mark if it has one. Raises TableError."""

        def refused(why: str, code: str, **known: Value) -> TableError:
            return TableError(code or self.code, file, [Reason(why, known)])

        try:
            if not stat.S_ISREG(path.stat().st_mode):
                raise refused("no_file", self.unreadable)
            with path.open("rb") as stream:
                content = stream.read(self.most_bytes + 1)
        except FileNotFoundError as error:
            raise refused("not_there", self.unreadable, names=self.columns) from error
        except OSError as error:
            raise refused("not_readable", self.unreadable, error=str(error.strerror or error)) from error
        if len(content) > self.most_bytes:
            raise refused("too_large", self.unreadable, most=self.most_bytes // 1_000_000)
        try:
            return decoded(content)
        except UnicodeDecodeError as error:
            raise refused("not_utf8", self.encoding) from error

    def table(self, text: str, file: str, also: Check = lambda _: ()) -> "Table":
        """The table in a text; `also` says what else is wrong with its columns. Raises TableError."""
        plain = text.removeprefix(MARK)
        plain = _COMMENT.sub("", plain) if self.has_comments else plain
        delimiter = delimiter_of(plain)
        lines, broken = table_lines(plain, delimiter, self.most_lines)
        faults = [Reason(one.code, {"line": one.line, "most": self.most_lines}) for one in broken]
        header = tuple(map(self._named, lines[0][1])) if lines else ()
        if lines:
            faults += [*self._faults_of(header), *also(header)]
        elif not faults:
            faults = [Reason("table_empty", {"line": 1})]
        if faults:
            raise TableError(self.code, file, faults)
        rows = tuple(Row(number, tuple(cells), header, delimiter) for number, cells in lines[1:])
        return Table(file, header, rows, delimiter, has_mark=text.startswith(MARK))

    def _named(self, cell: str) -> str:
        """A column's name: case does not count where it is one of those in small letters."""
        name = cell.strip()
        return name.lower() if name not in self.columns and name.lower() in self.columns else name

    def _faults_of(self, header: Sequence[str]) -> Iterator[Reason]:
        for name in self.required:
            if name not in header:
                yield Reason("column_missing", {"line": 1, "name": name, "names": self.columns})
        for name, count in Counter(filter(None, header)).items():
            if count > 1:
                yield Reason("column_twice", {"line": 1, "name": short(name), "count": count})
            elif self.is_strict and name not in self.columns:
                meant = near(name, self.columns)
                yield Reason("column_unknown", {"line": 1, "name": short(name), **meant})


@dataclass(slots=True)
class Row:
    """A line below the names of the columns.

    Attributes
    ----------
    line : from 1; of a record of several lines the first
    cells : as they stand
    faults : what was found wrong in it so far
    text : by column, without blanks around it
    """

    line: int
    cells: tuple[str, ...]
    header: tuple[str, ...]
    delimiter: str
    faults: list[Reason] = field(default_factory=list)
    text: Mapping[str, str] = field(init=False)

    def __post_init__(self) -> None:
        """Give each cell its column."""
        pairs = zip(self.header, self.cells, strict=False)
        self.text = {name: cell.strip() for name, cell in pairs if name}

    def __getitem__(self, column: str) -> str:
        """The text of a column, empty where the line or the table has none."""
        return self.text.get(column, "")

    def is_too_wide(self) -> bool:
        """Return whether it has more fields than there are columns, which is noted as a fault."""
        count, wide = len(self.cells), len(self.header)
        is_too_wide = any(cell.strip() for cell in self.cells[wide:])
        if is_too_wide:
            self.fault(
                "", Reason("fields_surplus", {"fields": count, "columns": wide, "mark": self.delimiter})
            )
        return is_too_wide

    def fault(self, column: str, found: Reason) -> None:
        """Note what is wrong with a column, or with the whole line for none."""
        self.faults.append(at(found, self.line, column))

    def whole(self, column: str) -> int | None:
        """A whole number; None for a blank, and for what is none, which is a fault."""
        found = whole_number(self[column], self.delimiter)
        if isinstance(found, Reason) and self[column]:
            self.fault(column, found)
        return None if isinstance(found, Reason) else found

    def student(self, *, may_be_blank: bool = False) -> str | None:
        """The student's id; None for what cannot be one, which is a fault."""
        text = self["student_id"]
        why = refused_id(text) if text or not may_be_blank else None
        if why is not None:
            self.fault("student_id", why)
        return text if text and why is None else None


def check_rows(kind: TableKind, file: str, rows: Sequence[Row], also: Iterable[Reason] = ()) -> None:
    """Raise TableError with what was found wrong in the rows, and where there is none of them."""
    faults = [*(one for row in rows for one in row.faults), *also]
    if faults or not rows:
        raise TableError(kind.code, file, faults or [Reason("no_rows", {"line": 2})])


@dataclass(frozen=True, slots=True)
class Table:
    """A table that was read.

    Attributes
    ----------
    header : names of columns, some of which may be empty
    has_mark : whether a byte order mark comes first
    """

    file: str
    header: tuple[str, ...]
    rows: tuple[Row, ...]
    delimiter: str = ","
    has_mark: bool = True


def written(rows: Iterable[Iterable[str]], delimiter: str = ",", end: str = "\r\n") -> str:
    """Rows of cells as the text of a table."""
    text = io.StringIO()
    csv.writer(text, delimiter=delimiter, lineterminator=end).writerows(rows)
    return text.getvalue()


# Cells ----------------------------------------------------------------------------------------------


def at(found: Reason, line: int | None, cell: str = "") -> Reason:
    """A fault with its place."""
    where = {"line": line, "cell": cell}
    return Reason(found.code, {**{key: one for key, one in where.items() if one}, **found.parameters})


def whole_number(text: str, delimiter: str) -> int | Reason:
    """A whole number; spreadsheets may have added zeros as decimals (7.0, or 7,0 beside semicolons)."""
    mark = "," if delimiter == ";" else r"\."
    digits = re.fullmatch(rf"([+-]?\d{{1,9}})(?:{mark}0+)?", text, re.ASCII)
    return Reason("no_whole_number", {"text": short(text)}) if digits is None else int(digits[1])


def real_number(text: str, delimiter: str, unit: str = "") -> float | Reason:
    """A number, with a decimal comma beside semicolons; in a unit, also with that or another of its kind."""
    number = number_of(text, decimal_comma=delimiter == ";")
    if number is None and unit and not ("," in text and delimiter != ";"):
        number = number_with_unit(text, unit)
    if number is not None:
        return number
    if "," in text and delimiter == ",":
        return Reason("no_decimal_point", {"text": short(text)})
    # What is behind digits was meant as a unit.
    known: dict[str, Value] = {"unit": unit} if unit and re.search(r"\d\s*[^\W\d]", text) else {}
    return Reason("no_number", {"text": short(text), **known})


_SENSE = re.compile(
    r"(?:\b[îi]n\s+)?(?:\bsens(?:ul)?\s+)?(?:(?P<ccw>\bccw\b|\b(?:counter|anti)[-\s]?clockwise\b|↺|⟲|⥀"
    r"|\b(?:anti-?orar|trigonometric)\b|\bпротив\s+(?:хода\s+)?(?:час\w*(?:\s+стрел\w*)?|ч\.\s?с\.))"
    r"|\bcw\b|\bclockwise\b|↻|⟳|⥁|\borar\b|\bпо\s+(?:ходу\s+)?(?:час\w*(?:\s+стрел\w*)?|ч\.\s?с\.))",
    re.IGNORECASE,
)
"""A sense of rotation in words of the three languages, or as an arrow."""


def turned(text: str, delimiter: str, unit: str = "") -> tuple[float | None, float] | Reason:
    """An angular quantity, counter-clockwise positive, and the sense told with it in words: 1, -1, or 0.

    None for a sense alone. A sign is a sense as well: one that contradicts the words is a fault.
    """
    senses = {1.0 if found["ccw"] else -1.0 for found in _SENSE.finditer(text)}
    plain = _SENSE.sub(" ", text).strip()
    value = real_number(plain, delimiter, unit) if plain else None
    if isinstance(value, Reason):
        return replace(value, parameters={**value.parameters, "text": short(text)})
    signs = {math.copysign(1.0, value)} if value and plain[0] in "+-\N{MINUS SIGN}" else set[float]()
    if len(senses | signs) > 1:
        return Reason("two_senses", {"text": short(text)})
    told = next(iter(senses), 1.0 if plain.startswith("+") else 0.0)
    return (abs(value) * told if value and told else value), told


def why_no_id(text: str) -> Reason | None:
    """Return why a text cannot be a student's id, which names a folder of results; None if it can."""
    if _STUDENT_ID.fullmatch(text) is None:
        return Reason("id_letters")
    if text.startswith(".") or text.endswith("."):
        return Reason("id_dot")
    if _DEVICES.fullmatch(text):
        return Reason("id_device")
    if text.lower() in RESULT_FILES:
        return Reason("id_result")
    return None


def refused_id(text: str) -> Reason | None:
    """Return the fault of a cell that must hold a student's id; None if there is none."""
    why = why_no_id(text)
    if why is None or not text:
        return None if text else Reason("cell_empty")
    return Reason("id_refused", {"text": short(text), "advice": why.code})


def near(
    name: str, known: Iterable[str], *, most: int = 1, cutoff: float = 0.6
) -> dict[str, tuple[str, ...]]:
    """The names that a misspelt one may stand for, as a parameter; none where there are none."""
    found = near_names(name, known, most=most, cutoff=cutoff)
    return {"near": tuple(found)} if found else {}


def short(text: str) -> str:
    """The text, not longer than a message should quote it."""
    return text if len(text) <= 40 else text[:37] + "..."
