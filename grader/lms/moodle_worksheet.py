"""Moodle's offline grading worksheet, as the teacher downloaded it, filled in.

Only the cells of *Grade* and *Feedback comments* change; everything else stays to the byte. Moodle
takes `7,5` for 7, `abc` for 0, skips what is above the maximum and rejects ragged files without saying
what is wrong: all of that is refused here.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from grader.lms.draft import Draft, ready, withheld
from grader.lms.faults import listed, not_as_meant
from grader.lms.finding import Evidence, Found, Rows, find, held_already
from grader.lms.grades import Grade, Person, rescaled
from grader.lms.options import Options
from grader.lms.raw_csv import RawTable, parse
from grader.lms.table import number
from reference.errors import InputFileError

COLUMNS: dict[str, tuple[str, ...]] = {
    "identifier": ("Identifier", "Identificator", "Идентификатор"),
    "name": ("Full name", "Nume complet", "Nume / Prenume", "Полное имя", "ФИО", "Имя / Фамилия"),
    "id": ("ID number", "Număr ID", "Cod numeric", "Индивидуальный номер"),
    "username": ("Username", "Nume utilizator", "Логин"),
    "email": ("Email address", "Adresă de email", "Adresa de email", "Адрес электронной почты"),
    "grade": ("Grade", "Notă", "Nota", "Оценка"),
    "maximum": ("Maximum grade", "Notă maximă", "Nota maximă", "Максимальная оценка"),
    "scale": ("Scale", "Scală", "Scala", "Шкала"),
    "changeable": ("Grade can be changed", "Nota poate fi schimbată", "Оценка может быть изменена"),
    "modified": (
        "Last modified (grade)", "Ultima modificare (nota)", "Ultima modificare (notă)",
        "Последнее изменение (оценка)",
    ),
    "feedback": (
        "Feedback comments", "Comentarii de feedback", "Comentarii feedback",
        "Feedback sub formă de comentarii", "Отзыв в виде комментария", "Отзыв в виде комментариев",
    ),
}  # fmt: skip
"""Moodle's column names in the languages in which worksheets are likely to be downloaded."""

_REQUIRED = ("identifier", "grade", "modified")
_NO = {"no", "nu", "нет"}
_PARTICIPANT = re.compile(r"\s*\D*?(\d+)\s*")
_EMPTY = {"", "-"}
LOCKED = "Moodle says that this grade cannot be changed"


@dataclass(slots=True)
class Worksheet:
    """A worksheet that Moodle would take, and its columns by our names."""

    table: RawTable
    columns: Mapping[str, int]
    file: str
    notes: list[str] = field(default_factory=list)

    def value(self, row: int, name: str) -> str:
        """A cell's text; empty where the worksheet has no such column."""
        column = self.columns.get(name)
        return "" if column is None else self.table.value(row, column).strip()

    def participant(self, row: int) -> int | None:
        """The participant's number, by which Moodle knows the row."""
        found = _PARTICIPANT.fullmatch(self.value(row, "identifier"))
        return None if found is None else int(found[1])

    def is_locked(self, row: int) -> bool:
        """Whether Moodle says that the grade cannot be changed."""
        return self.value(row, "changeable").casefold() in _NO

    @property
    def people(self) -> list[int]:
        """The rows of participants; Moodle skips empty lines."""
        return [row for row in range(1, len(self.table.rows)) if self.table.rows[row] != [""]]

    def whose(self, students: Mapping[str, Person]) -> Found:
        """The rows of students, by participant number, address, number, username, name."""
        known = [name for name in ("email", "id", "username", "name") if name in self.columns]
        cells = [
            (
                row,
                {
                    "participant": str(self.participant(row)),
                    **{name: self.value(row, name) for name in known},
                },
            )
            for row in self.people
        ]
        evidence = {student: _evidence(student, person) for student, person in students.items()}
        return find(Rows.of(cells), evidence, "the worksheet")


def _evidence(student_id: str, person: Person) -> Evidence:
    return (
        ("participant", "" if person.participant is None else str(person.participant)),
        ("email", person.email),
        ("id", student_id),
        ("username", person.username),
        ("name", person.name),
    )


def fill(
    data: bytes, file: str, grades: Sequence[Grade], options: Options, comments: Mapping[str, str]
) -> Draft:
    """Fill in a worksheet; only cells of those who have a grade change, the rest to the byte.

    `comments` are HTML by student_id; not written where the worksheet has no column for them. Students
    are found among the whole class: a row that fits two of them is given to neither.

    Raises InputFileError with everything that is wrong with the worksheet, CallError where its
    maximum is not the rubric's and nobody asks for rescaling.
    """
    sheet = open_worksheet(data, file)
    told = ready(grades)
    here = {one.student_id: options.person(one.student_id) for one in grades}
    found = sheet.whose({**options.people, **here})
    held = {row: cell for row in sheet.people if (cell := sheet.value(row, "grade")) not in _EMPTY}
    meant, missing = _put(sheet, told, found, comments, rescale=options.rescale)
    written = tuple(one.student_id for one in told if one.student_id not in missing)
    filled = sheet.table.text().encode("utf-8")
    _check(filled, file, meant)
    notes = (*sheet.notes, *found.notes_on(written), *held_already(withheld(grades), found, held))
    return Draft(filled, written, withheld=withheld(grades), not_found=missing, notes=notes)


def _put(
    sheet: Worksheet, grades: Sequence[Grade], found: Found, comments: Mapping[str, str], *, rescale: bool
) -> tuple[dict[int, str], dict[str, str]]:
    """Put grades and comments into their cells: what stands in which row then, and why others have none."""
    meant, missing, replaced, said = dict[int, str](), dict[str, str](), 0, 0
    for grade in grades:
        student, row = grade.student_id, found.rows.get(grade.student_id)
        if row is None or sheet.is_locked(row):
            missing[student] = LOCKED if row is not None else found.missing[student]
            continue
        meant[row] = number(rescaled(grade, _maximum(sheet, row, grade), rescale=rescale) or 0.0)
        before = sheet.value(row, "grade")
        if before in _EMPTY or number(_amount(before) or 0.0) != meant[row]:
            replaced += before not in _EMPTY
            sheet.table.put(row, sheet.columns["grade"], meant[row])
        if "feedback" in sheet.columns and student in comments:
            said += sheet.value(row, "feedback") not in {"", comments[student]}
            sheet.table.put(row, sheet.columns["feedback"], comments[student])
    if "feedback" not in sheet.columns:
        sheet.notes.append("the worksheet has no column for feedback comments: only grades are filled in")
    if said:
        sheet.notes.append(f"{said} comment(s) that Moodle holds already are replaced")
    if replaced:
        sheet.notes.append(
            f"{replaced} grade(s) that Moodle holds already are changed: it skips them unless the box for"
            " updating records is ticked at the upload, or the worksheet was downloaded afresh"
        )
    return meant, missing


def _check(filled: bytes, file: str, told: Mapping[int, str]) -> None:
    """Read what was filled in as Moodle will, and find the grades in it that were meant."""
    again = open_worksheet(filled, file)
    if any(number(_amount(again.value(row, "grade")) or 0.0) != text for row, text in told.items()):
        raise not_as_meant("the worksheet")


# The worksheet ------------------------------------------------------------------------------------


def open_worksheet(data: bytes, file: str) -> Worksheet:
    """A worksheet as downloaded; InputFileError with everything that Moodle would not take."""
    table = parse(data, file)
    if not table.rows:
        raise InputFileError("worksheet", f"{file}: the worksheet is empty; download it from Moodle again")
    header = [table.value(0, column).strip() for column in range(len(table.rows[0]))]
    columns, faults = _columns(header)
    faults += list(_ragged(table))
    sheet = Worksheet(table, {**_unnamed(table, columns), **columns}, file)
    if not faults:
        faults += list(_row_faults(sheet))
    if faults:
        raise InputFileError(
            "worksheet",
            f"{file}: Moodle would not take this worksheet; download it again, with Moodle in English,"
            f" Romanian or Russian, and do not resave it{listed(faults)}",
        )
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
    if "scale" in columns:
        faults.append(
            "row 1: the assignment is graded by a scale, and Moodle would skip points: let it be points"
        )
    if columns.get("feedback") == 0:
        faults.append("row 1: feedback comments stand in the first column, where Moodle drops them")
    return columns, faults


def _unnamed(table: RawTable, columns: Mapping[str, int]) -> dict[str, int]:
    """Columns of people that bear other names than those known, by what stands in them.

    Full names follow the identifier, unless the worksheet is anonymous; addresses have an @.
    """
    others = [place for place in range(len(table.rows[0])) if place not in columns.values()]
    found = {}
    after = columns.get("identifier", -2) + 1
    if after in others:
        found["name"] = after
    for place in others:
        cells = [
            table.value(row, place).strip()
            for row in range(1, len(table.rows))
            if place < len(table.rows[row])
        ]
        told = [cell for cell in cells if cell not in _EMPTY]
        if told and all(re.fullmatch(r"[^@\s]+@[^@\s]+", cell) for cell in told):
            found.setdefault("email", place)
    return found


def _ragged(table: RawTable) -> Iterator[str]:
    wide = len(table.rows[0])
    for row, cells in enumerate(table.rows):
        if len(cells) != wide and cells != [""]:
            yield f"row {row + 1}: has {len(cells)} cells, the first row has {wide}"


def _row_faults(sheet: Worksheet) -> Iterator[str]:
    seen: dict[int, int] = {}
    comma = sheet.table.value(0, sheet.columns["grade"]).strip() != COLUMNS["grade"][0]
    for row in sheet.people:
        participant = sheet.participant(row)
        if participant is None:
            yield f"row {row + 1}: '{sheet.value(row, 'identifier')}' is not 'Participant' and a number"
            continue
        if participant in seen:
            yield f"row {row + 1}: the same participant as in row {seen[participant] + 1}"
        seen[participant] = row
        stated, maximum = sheet.value(row, "maximum"), _amount(sheet.value(row, "maximum"))
        if "maximum" in sheet.columns and not maximum:
            yield f"row {row + 1}: the maximum grade '{stated}' is no positive number"
        yield from _grade_faults(sheet.value(row, "grade"), row, maximum, comma=comma)


def _grade_faults(text: str, row: int, maximum: float | None, *, comma: bool) -> Iterator[str]:
    """What Moodle would misread among the grades that stand there already."""
    value = _amount(text)
    if text in _EMPTY:
        return
    if value is None:
        yield f"row {row + 1}: the grade '{text}' is no number; Moodle would store 0"
    elif "," in text and not comma:
        yield f"row {row + 1}: the grade '{text}' has a comma; Moodle would store {text.partition(',')[0]}"
    elif maximum and value > maximum:
        yield f"row {row + 1}: the grade '{text}' is above the maximum; Moodle would skip it"


def _amount(text: str) -> float | None:
    """A number that is not negative as Moodle writes it: 10.00, or 10,00 in many languages."""
    plain = text.strip().replace("\u00a0", "").replace(",", ".")
    return float(plain) if re.fullmatch(r"\d+(\.\d+)?", plain) else None


def _maximum(sheet: Worksheet, row: int, grade: Grade) -> float:
    return _amount(sheet.value(row, "maximum")) or grade.max_score
