"""Canvas's gradebook: the file that the teacher exported filled in, or one made anew.

Canvas finds columns by their places: Student, ID, SIS User ID, SIS Login ID, Section, then assignments
as `title (number)`; below the header stand the points possible, and what is written there becomes the
assignment's. It reads `1,234` as 1.234, and a blank takes a grade back: so of a file that is filled
in only the cells of those who have a grade change, and a new file holds nobody else.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from grader.lms.documents import Filled, Number, Payload, Positive
from grader.lms.draft import Draft, document, ready, withheld
from grader.lms.faults import listed, not_as_meant
from grader.lms.finding import Evidence, Found, Rows, find, held_already
from grader.lms.grades import Grade, Person, rescaled
from grader.lms.options import Options
from grader.lms.raw_csv import RawTable, parse
from grader.lms.table import csv_text, is_formula, number
from reference.errors import CallError, InputFileError

HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
_ABOUT = (*HEADER, "Integration ID", "Root Account", "LastName", "FirstName")
_NUMBERED = re.compile(r"(?P<title>.*\S)\s*\((?P<id>\d+)\)\s*", re.DOTALL)
_POINTS = "Points Possible"
_MANUAL = re.compile(r"\s*(Muted|Manual Posting.*)?\s*", re.IGNORECASE)
_NO_GRADE = {"", "-"}
_MANGLED = re.compile(r"-?[0-9.,]*[.,][0-9.,]*%?")
"""What Canvas takes for a number and writes anew, in any column."""


class Row(Payload):
    """A row as Canvas reads it."""

    name: Filled
    id: str
    sis_user_id: Filled
    login: str
    grade: Number
    possible: Positive


# A new file ---------------------------------------------------------------------------------------


def gradebook(grades: Sequence[Grade], options: Options) -> Draft:
    """A gradebook file made anew, with those who have a grade.

    Raises CallError with every student whom Canvas would not find.
    """
    item = options.item.strip() or grades[0].reports[0].assignment
    told = ready(grades)
    faults = list(_faults(told, options))
    if is_formula(item) or item in _ABOUT:
        faults.append(f"'{item}' is no title of an assignment")
    if faults:
        raise CallError("gradebook", f"Canvas would misread this; nothing was written{listed(faults)}")
    rows = [_row(grade, options) for grade in told]
    possible = options.maximum or grades[0].max_score
    table = [["    " + _POINTS, "", "", "", "", number(possible)]]
    table += [[row.name, row.id, row.sis_user_id, row.login, "", row.grade] for row in rows]
    notes = ["Canvas sets the assignment's points possible to those of the file's second row"]
    if not _NUMBERED.fullmatch(item):
        notes.append(
            f"Canvas takes '{item}' for a new assignment: give --item as it stands in an exported gradebook,"
            " 'title (number)', or that file itself (--gradebook)"
        )
    return Draft(
        csv_text([*HEADER, item], table),
        tuple(one.student_id for one in told),
        withheld=withheld(grades),
        notes=tuple(notes),
    )


def _row(grade: Grade, options: Options) -> Row:
    person = options.person(grade.student_id)
    maximum = grade.max_score if options.maximum is None else options.maximum
    told = {
        "name": person.name or grade.student_id,
        "id": person.platform_id,
        "sis_user_id": grade.student_id,
        "login": person.username,
        "grade": number(rescaled(grade, maximum, rescale=options.rescale) or 0.0),
        "possible": maximum,
    }
    return document(Row, told, f"the row of {grade.student_id}")


def _faults(grades: Sequence[Grade], options: Options) -> Iterator[str]:
    owner: dict[str, str] = {}
    for grade in grades:
        person = options.person(grade.student_id)
        if _MANGLED.fullmatch(grade.student_id) and not person.platform_id:
            yield f"{grade.student_id}: Canvas takes this for a number; give Canvas's own (--ids)"
        if person.platform_id and not re.fullmatch(r"[1-9][0-9]*", person.platform_id):
            yield f"{grade.student_id}: '{person.platform_id}' is no number of a Canvas user"
        if _POINTS in person.name:
            yield f"{grade.student_id}: '{person.name}' would be read as the row of points"
        for text in (person.name, person.username):
            if is_formula(text):
                yield f"{grade.student_id}: '{text}' would be run as a formula by a spreadsheet"
        if person.platform_id and owner.setdefault(person.platform_id, grade.student_id) != grade.student_id:
            yield f"{grade.student_id}: the same number as {owner[person.platform_id]}"


# The teacher's own file ---------------------------------------------------------------------------


@dataclass(slots=True)
class _Gradebook:
    """An exported gradebook, and what was found in its header."""

    table: RawTable
    file: str
    about: Mapping[str, int]
    assignment: int
    possible: float
    points_row: int
    notes: list[str] = field(default_factory=list)

    @property
    def people(self) -> list[int]:
        """The rows of students."""
        return [
            row for row in range(self.points_row + 1, len(self.table.rows)) if self.table.rows[row] != [""]
        ]

    def grade(self, row: int) -> str:
        return self.table.value(row, self.assignment).strip()


def fill(data: bytes, file: str, grades: Sequence[Grade], options: Options) -> Draft:
    """Fill in an exported gradebook; only cells of those who have a grade change, the rest to the byte.

    Raises InputFileError for a file that is none, CallError where the assignment is not told or its
    maximum is another.
    """
    book = _open(data, file, options)
    told = ready(grades)
    here = {one.student_id: options.person(one.student_id) for one in grades}
    found = _whose(book, {**options.people, **here})
    held = {row: cell for row in book.people if (cell := book.grade(row)) not in _NO_GRADE}
    meant, missing = _put(book, told, found, rescale=options.rescale)
    written = tuple(one.student_id for one in told if one.student_id not in missing)
    book.notes.extend((*found.notes_on(written), *held_already(withheld(grades), found, held)))
    filled = book.table.text().encode("utf-8")
    again = _open(filled, file, options)
    if any(number(_amount(again.grade(row)) or 0.0) != score for row, score in meant.items()):
        raise not_as_meant("the gradebook")
    return Draft(filled, written, withheld=withheld(grades), not_found=missing, notes=tuple(book.notes))


def _put(
    book: _Gradebook, grades: Sequence[Grade], found: Found, *, rescale: bool
) -> tuple[dict[int, str], dict[str, str]]:
    """Put the grades into their cells: what stands in which row then, and why others have none."""
    meant, missing, replaced = dict[int, str](), dict[str, str](), 0
    for grade in grades:
        row = found.rows.get(grade.student_id)
        if row is None:
            missing[grade.student_id] = found.missing[grade.student_id]
            continue
        before = book.grade(row)
        if before.casefold() in {"ex", "n/a"}:
            missing[grade.student_id] = f"Canvas says '{before}': excused, or not given this assignment"
            continue
        meant[row] = number(rescaled(grade, book.possible, rescale=rescale) or 0.0)
        if _amount(before) is None or number(_amount(before) or 0.0) != meant[row]:
            replaced += before not in _NO_GRADE
            book.table.put(row, book.assignment, meant[row])
    if replaced:
        book.notes.append(f"{replaced} grade(s) that Canvas holds already are changed")
    return meant, missing


def _open(data: bytes, file: str, options: Options) -> _Gradebook:
    table = parse(data, file, _delimiter(data))
    if len(table.rows) < 2:
        raise _refused(file, ["it has no students"])
    header = [table.value(0, column).strip() for column in range(len(table.rows[0]))]
    about = {name: header.index(name) for name in _ABOUT if name in header}
    faults = []
    if "ID" not in about or "Section" not in about or not {"Student", "LastName"} & set(about):
        faults.append(f"row 1: not the columns Student, ID, ..., Section (found: {', '.join(header[:8])})")
    wide = len(header)
    faults += [
        f"row {row + 1}: has {len(cells)} cells, the first row has {wide}"
        for row, cells in enumerate(table.rows)
        if len(cells) != wide and cells != [""]
    ]
    points = [row for row in range(1, min(len(table.rows), 4)) if _POINTS in table.value(row, 0)]
    if not points:
        faults.append(f"there is no row '{_POINTS}' below the first")
    if faults:
        raise _refused(file, faults)
    assignment = _assignment(header, about, options.item, file)
    stated = table.value(points[0], assignment).strip()
    possible = _amount(stated)
    if possible is None or possible <= 0.0:
        raise _refused(file, [f"row {points[0] + 1}: '{header[assignment]}' has '{stated}' points possible"])
    return _Gradebook(table, file, about, assignment, possible, points[0])


def _refused(file: str, faults: Sequence[str]) -> InputFileError:
    return InputFileError(
        "canvas_gradebook",
        f"{file}: is no gradebook as Canvas exports it; export it again and do not resave it{listed(faults)}",
    )


def _delimiter(data: bytes) -> str:
    first = data.partition(b"\n")[0]
    return ";" if first.count(b";") > first.count(b",") else ","


def _assignment(header: Sequence[str], about: Mapping[str, int], item: str, file: str) -> int:
    """The assignment's column: named by its whole header, its title or its number, or the only one."""
    last = max(about.values())
    known = {
        place: found
        for place, title in enumerate(header)
        if place > last and (found := _NUMBERED.fullmatch(title))
    }
    wanted = item.strip()
    fitting = [place for place in known if not wanted or header[place] == wanted]
    if wanted and not fitting:
        fitting = [place for place, one in known.items() if wanted in (one["title"], one["id"])]
    if len(fitting) == 1:
        return fitting[0]
    choices = ", ".join(f"'{header[place]}'" for place in known) or "none"
    raise CallError(
        "item",
        f"{file}: {len(fitting)} assignments fit '{wanted}': name one with --item out of {choices}"
        if wanted
        else f"{file}: which assignment? Name it with --item: {choices}",
    )


def _amount(text: str) -> float | None:
    """A number as Canvas reads it: the last comma or dot is the decimal mark, the others group."""
    if not re.fullmatch(r"[0-9.,]*[0-9]", text):
        return None
    *whole, last = re.split("[.,]", text)
    return float("".join(whole) + "." + last) if whole else float(last)


def _whose(book: _Gradebook, students: Mapping[str, Person]) -> Found:
    titles = {"ID": "ID", "SIS User ID": "SIS User ID", "SIS Login ID": "SIS Login ID", "name": "Student"}
    known = {name: book.about[title] for name, title in titles.items() if title in book.about}
    cells = []
    for row in book.people:
        told = {name: book.table.value(row, column) for name, column in known.items()}
        if "LastName" in book.about and "FirstName" in book.about:
            last, first = (book.table.value(row, book.about[one]) for one in ("LastName", "FirstName"))
            told["name"] = f"{last}, {first}"
        if not all(_MANUAL.fullmatch(cell) for cell in told.values()):
            cells.append((row, {**told, "name turned": _turned(told.get("name", ""))}))
    evidence = {student: _evidence(student, person) for student, person in students.items()}
    return find(Rows.of(cells), evidence, "the gradebook")


def _turned(name: str) -> str:
    """`Popescu, Ion` as `Ion Popescu`."""
    last, comma, first = name.partition(",")
    return f"{first.strip()} {last.strip()}" if comma else name


def _evidence(student_id: str, person: Person) -> Evidence:
    return (
        ("ID", person.platform_id),
        ("SIS User ID", student_id),
        ("SIS Login ID", person.username or student_id),
        ("SIS Login ID", person.email),
        ("name", person.name),
        ("name turned", person.name),
    )
