"""Moodle's offline grading worksheet, as the teacher downloaded it, filled in.

Only the cells of *Grade* and *Feedback comments* change; everything else stays to the byte. Moodle
takes `7,5` for 7, `abc` for 0, skips what is above the maximum and rejects ragged files without saying
what is wrong: all of that is refused here.
"""

import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from grader.exports.grades import Grade, Person, rescaled
from grader.exports.raw_csv import RawTable, parse
from grader.exports.table import number
from reference.errors import InputFileError

COLUMNS: dict[str, tuple[str, ...]] = {
    "identifier": ("Identifier", "Identificator", "Идентификатор"),
    "name": ("Full name", "Nume complet", "Nume / Prenume", "Полное имя", "ФИО", "Имя / Фамилия"),
    "id": ("ID number", "Număr ID", "Cod numeric", "Индивидуальный номер"),
    "username": ("Username", "Nume utilizator", "Логин"),
    "email": ("Email address", "Adresă de email", "Adresa de email", "Адрес электронной почты"),
    "grade": ("Grade", "Notă", "Nota", "Оценка"),
    "maximum": ("Maximum grade", "Notă maximă", "Nota maximă", "Максимальная оценка"),
    "changeable": ("Grade can be changed", "Nota poate fi schimbată", "Оценка может быть изменена"),
    "modified": (
        "Last modified (grade)", "Ultima modificare (nota)", "Ultima modificare (notă)",
        "Последнее изменение (оценка)",
    ),
    "feedback": (
        "Feedback comments", "Comentarii feedback", "Feedback sub formă de comentarii",
        "Отзыв в виде комментария", "Отзыв в виде комментариев",
    ),
}  # fmt: skip
"""Moodle's column names in the languages in which worksheets are likely to be downloaded."""

_REQUIRED = ("identifier", "grade", "modified")
_NO = {"no", "nu", "нет"}
_PARTICIPANT = re.compile(r"\s*\D*?(\d+)\s*")


@dataclass(frozen=True, slots=True)
class Filled:
    """A worksheet filled in.

    Attributes
    ----------
    written : students with a grade in the file
    not_found : students with a grade who are not in the worksheet, with why
    locked : students whose grade Moodle says cannot be changed
    """

    data: bytes
    written: tuple[str, ...]
    not_found: Mapping[str, str]
    locked: tuple[str, ...]
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class _Worksheet:
    table: RawTable
    columns: Mapping[str, int]
    file: str
    notes: list[str] = field(default_factory=list)

    def value(self, row: int, name: str) -> str:
        column = self.columns.get(name)
        return "" if column is None else self.table.value(row, column).strip()

    @property
    def people(self) -> list[int]:
        """The rows of participants; Moodle skips empty lines."""
        return [row for row in range(1, len(self.table.rows)) if self.table.rows[row] != [""]]


def fill(
    data: bytes,
    file: str,
    grades: Sequence[Grade],
    people: Mapping[str, Person],
    comments: Mapping[str, str],
    *,
    rescale: bool = False,
) -> Filled:
    """Fill in a worksheet.

    Arguments
    ---------
    people : names and e-mail addresses by student_id, by which students are found in the worksheet
    comments : HTML by student_id; not written where the worksheet has no column for it

    Raises InputFileError with everything that is wrong with the worksheet, CallError where its
    maximum is not the rubric's and `rescale` is not asked for.
    """
    sheet = _open(data, file)
    replaced = 0
    rows, not_found = _matched(sheet, grades, people)
    written, locked = [], []
    for grade in grades:
        row = rows.get(grade.student_id)
        if row is None or grade.score is None:
            continue
        if sheet.value(row, "changeable").casefold() in _NO:
            locked.append(grade.student_id)
            continue
        score = rescaled(grade, _maximum(sheet, row, grade), rescale=rescale)
        text = number(score or 0.0)
        replaced += sheet.value(row, "grade") not in {"", "-", text}
        sheet.table.put(row, sheet.columns["grade"], text)
        if "feedback" in sheet.columns and grade.student_id in comments:
            sheet.table.put(row, sheet.columns["feedback"], comments[grade.student_id])
        written.append(grade.student_id)
    if replaced:
        sheet.notes.append(
            f"{replaced} grade(s) that Moodle holds already are changed: it skips them unless the box for"
            " updating records is ticked at the upload, or the worksheet was downloaded afresh"
        )
    return Filled(
        sheet.table.text().encode("utf-8"), tuple(written), not_found, tuple(locked), tuple(sheet.notes)
    )


# The worksheet ------------------------------------------------------------------------------------


def _open(data: bytes, file: str) -> _Worksheet:
    table = parse(data, file)
    if not table.rows:
        raise InputFileError("worksheet", f"{file}: the worksheet is empty; download it from Moodle again")
    header = [table.value(0, column).strip() for column in range(len(table.rows[0]))]
    columns, faults = _columns(header)
    faults += list(_ragged(table))
    sheet = _Worksheet(table, columns, file)
    if not faults:
        faults += list(_row_faults(sheet))
    if faults:
        told = "\n".join(f"  {fault}" for fault in faults)
        raise InputFileError(
            "worksheet", f"{file}: Moodle would not take this worksheet; download it again\n{told}"
        )
    if "feedback" not in columns:
        sheet.notes.append("the worksheet has no column for feedback comments: only grades are filled in")
    if "maximum" not in columns:
        sheet.notes.append("the worksheet does not state its maximum grade: taken to be the rubric's")
    return sheet


def _columns(header: list[str]) -> tuple[dict[str, int], list[str]]:
    columns: dict[str, int] = {}
    faults: list[str] = []
    for name, known in COLUMNS.items():
        places = [place for place, title in enumerate(header) if title in known]
        if len(places) > 1:
            faults.append(f"row 1: there are {len(places)} columns '{header[places[0]]}'")
        if places:
            columns[name] = places[0]
        elif name in _REQUIRED:
            faults.append(f"row 1: there is no column '{known[0]}' (columns: {', '.join(header)})")
    if columns.get("feedback") == 0:
        faults.append("row 1: feedback comments stand in the first column, where Moodle drops them")
    return columns, faults


def _ragged(table: RawTable) -> Iterator[str]:
    wide = len(table.rows[0])
    for row, cells in enumerate(table.rows):
        if len(cells) != wide and cells != [""]:
            yield f"row {row + 1}: has {len(cells)} cells, the first row has {wide}"


def _row_faults(sheet: _Worksheet) -> Iterator[str]:
    seen: dict[int, int] = {}
    for row in sheet.people:
        found = _PARTICIPANT.fullmatch(sheet.value(row, "identifier"))
        if found is None:
            yield f"row {row + 1}: '{sheet.value(row, 'identifier')}' is not 'Participant' and a number"
            continue
        if int(found[1]) in seen:
            yield f"row {row + 1}: the same participant as in row {seen[int(found[1])] + 1}"
        seen[int(found[1])] = row
        maximum = sheet.value(row, "maximum")
        if "maximum" in sheet.columns and _amount(maximum) is None:
            yield f"row {row + 1}: the maximum grade '{maximum}' is no positive number"


def _amount(text: str) -> float | None:
    """A positive number as Moodle writes it: 10.00, or 10,00 in many languages."""
    plain = text.strip().replace("\u00a0", "").replace(",", ".")
    if not re.fullmatch(r"\d+(\.\d+)?", plain) or float(plain) <= 0.0:
        return None
    return float(plain)


def _maximum(sheet: _Worksheet, row: int, grade: Grade) -> float:
    stated = _amount(sheet.value(row, "maximum"))
    return grade.max_score if stated is None else stated


# Who is who ---------------------------------------------------------------------------------------


def _matched(
    sheet: _Worksheet, grades: Sequence[Grade], people: Mapping[str, Person]
) -> tuple[dict[str, int], dict[str, str]]:
    """The row of each student, and why others have none. No row serves two students."""
    rows: dict[str, int] = {}
    not_found: dict[str, str] = {}
    for grade in grades:
        found = _rows_of(sheet, grade.student_id, people.get(grade.student_id, Person()))
        if len(found) == 1:
            rows[grade.student_id] = found[0]
        else:
            not_found[grade.student_id] = (
                "nobody in the worksheet has this number, e-mail address or name"
                if not found
                else f"rows {', '.join(str(row + 1) for row in found)} of the worksheet all fit"
            )
    for row in {row for row in rows.values() if list(rows.values()).count(row) > 1}:
        claimed = [student for student, own in rows.items() if own == row]
        for student in claimed:
            del rows[student]
            not_found[student] = f"row {row + 1} of the worksheet fits {' and '.join(claimed)} alike"
    return rows, not_found


def _rows_of(sheet: _Worksheet, student_id: str, person: Person) -> list[int]:
    """Rows that fit a student by the strongest evidence there is: what fits is not looked for weaker."""
    evidence = (
        ("identifier", "" if person.participant is None else str(person.participant)),
        ("email", person.email),
        ("id", student_id),
        ("username", person.username),
        ("name", person.name),
    )
    for column, wanted in evidence:
        if column not in sheet.columns or not wanted:
            continue
        found = [row for row in sheet.people if _fits(column, sheet.value(row, column), wanted)]
        if found:
            return found
    return []


def _fits(column: str, cell: str, wanted: str) -> bool:
    if column == "identifier":
        number_of = _PARTICIPANT.fullmatch(cell)
        return number_of is not None and number_of[1] == wanted
    return _folded(cell) == _folded(wanted)


def _folded(text: str) -> str:
    return " ".join(unicodedata.normalize("NFKC", text).casefold().split())
