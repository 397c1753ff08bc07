"""Canvas: its gradebook filled in or made anew, its rubric, and students' points in it by its API.

Gradebook: Canvas finds columns by their places: Student, ID, SIS User ID, SIS Login ID, Section, then
assignments as `title (number)`; below the header are the points possible, which become the assignment's.
It reads `1,234` as 1.234, and a blank takes a grade back: in a file that is filled in only the cells of
students with a grade change, and a new file has no other students.

Rubric: Canvas rounds points to two decimals, and takes no byte order mark.
"""

import math
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Annotated, Literal, Self

from pydantic import Field, model_validator

from grader.lms.grades import Delivery, Grade, Options, Person, ready
from grader.lms.marks import (
    CLOSE,
    Filled,
    NotNegative,
    Number,
    Payload,
    PlatformCriterion,
    Version,
    check_points,
    check_unique,
    class_criteria,
    json_document,
    plain_comment,
    platform_marks,
)
from grader.lms.table import Evidence, Form, bytes_of, csv_text, fill_in, is_formula, number, parse
from reference.errors import CallError, InputFileError, lines_of

HEADER = ("Student", "ID", "SIS User ID", "SIS Login ID", "Section")
_ABOUT = (*HEADER, "Integration ID", "Root Account", "LastName", "FirstName")
_NUMBERED = re.compile(r"(?P<title>.*\S)\s*\((?P<id>\d+)\)\s*", re.DOTALL)
_POINTS = "Points Possible"
_MANUAL = re.compile(r"\s*(Muted|Manual Posting.*)?\s*", re.IGNORECASE)
_MANGLED = re.compile(r"-?[0-9.,]*[.,][0-9.,]*%?")
"""What Canvas takes for a number and writes anew, in any column."""


# A new gradebook ----------------------------------------------------------------------------------


def gradebook(grades: Sequence[Grade], options: Options) -> Delivery:
    """A gradebook file made anew, with those who have a grade.

    Raises CallError with every student whom Canvas would not find.
    """
    item = options.item.strip() or grades[0].assignment
    faults = list(_faults(ready(grades)))
    if is_formula(item) or item in _ABOUT:
        faults.append(f"'{item}' is no title of an assignment")
    if faults:
        raise CallError("gradebook", f"Canvas would misread this; nothing was written\n{lines_of(faults)}")
    table = [["    " + _POINTS, "", "", "", "", number(options.maximum or grades[0].max_score)]]
    for grade in ready(grades):
        person = grade.person
        score = grade.out_of(options.maximum, rescale=options.rescale)
        name = person.name or grade.student_id
        table.append([name, person.platform_id, grade.student_id, person.username, "", number(score)])
    notes = ["Canvas sets the assignment's points possible to those of the file's second row"]
    if not _NUMBERED.fullmatch(item):
        notes.append(
            f"Canvas takes '{item}' for a new assignment: give --item as it stands in an exported gradebook,"
            " 'title (number)', or that file itself (--gradebook)"
        )
    return Delivery(csv_text([*HEADER, item], table), notes=tuple(notes))


def _faults(grades: Sequence[Grade]) -> Iterator[str]:
    owner: dict[str, str] = {}
    for grade in grades:
        person = grade.person
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


# The teacher's own gradebook ----------------------------------------------------------------------


@dataclass(slots=True)
class Gradebook(Form):
    """An exported gradebook."""

    name = "the gradebook"
    platform = "Canvas"

    @classmethod
    def opened(cls, data: bytes, file: str, item: str) -> Self:
        """A gradebook as Canvas exports it, and the column of an assignment in it."""
        table = parse(data, file, delimiter=None)
        if len(table.rows) < 2:
            raise _refused(file, ["it has no students"])
        header = [table.value(0, column).strip() for column in range(len(table.rows[0]))]
        about = {name: header.index(name) for name in _ABOUT if name in header}
        faults = []
        if "ID" not in about or "Section" not in about or not {"Student", "LastName"} & set(about):
            faults.append(
                f"row 1: not the columns Student, ID, ..., Section (found: {', '.join(header[:8])})"
            )
        faults += table.ragged()
        points = next((row for row in range(1, min(len(table.rows), 4)) if _POINTS in table.value(row, 0)), 0)
        if not points:
            faults.append(f"there is no row '{_POINTS}' below the first")
        if faults:
            raise _refused(file, faults)
        assignment = _assignment(header, max(about.values()), item.strip(), file)
        stated = table.value(points, assignment).strip()
        possible = cls.amount(stated) or 0.0
        if possible <= 0.0:
            raise _refused(file, [f"row {points + 1}: '{header[assignment]}' has '{stated}' points possible"])
        return cls(table, {**about, "grade": assignment}, points, possible=possible)

    @staticmethod
    def amount(text: str) -> float | None:
        """A number as Canvas reads it: the last comma or dot is the decimal mark, the others group."""
        if not re.fullmatch(r"[0-9.,]*[0-9]", text):
            return None
        *whole, last = re.split("[.,]", text)
        return float("".join(whole) + "." + last) if whole else float(last)

    def why_fixed(self, row: int) -> str:
        """Whether Canvas wants no grade here."""
        grade = self.value(row, "grade")
        is_out = grade.casefold() in {"ex", "n/a"}
        return f"Canvas says '{grade}': excused, or not given this assignment" if is_out else ""

    def identity(self, row: int) -> Mapping[str, str]:
        """Canvas's numbers of the student, the and the name."""
        cells = {name: self.value(row, name) for name in HEADER[1:4] if name in self.columns}
        name = self.value(row, "Student")
        if "LastName" in self.columns and "FirstName" in self.columns:
            name = f"{self.value(row, 'LastName')}, {self.value(row, 'FirstName')}"
        if all(_MANUAL.fullmatch(cell) for cell in (*cells.values(), name)):
            return {}
        return {**cells, "name": name}

    @staticmethod
    def evidence(student_id: str, person: Person) -> Evidence:
        """Names are the weakest."""
        return (
            ("ID", person.platform_id),
            ("SIS User ID", student_id),
            ("SIS Login ID", person.username or student_id),
            ("SIS Login ID", person.email),
            ("name", person.name),
        )


def grades_file(grades: Sequence[Grade], options: Options) -> Delivery:
    """The exported gradebook filled in where there is one, else one made anew."""
    if options.form is None:
        return gradebook(grades, options)
    return fill_gradebook(bytes_of(options.form, "form_missing"), options.form.name, grades, options)


def fill_gradebook(data: bytes, file: str, grades: Sequence[Grade], options: Options) -> Delivery:
    """Fill in an exported gradebook.

    Raises InputFileError for a file that is none, CallError where the assignment is not named or its
    maximum is another.
    """
    if options.maximum is not None:
        raise CallError("option_unused", "--maximum has no meaning beside --gradebook: it states its own")
    return fill_in(Gradebook.opened(data, file, options.item), file, grades, options, {})


def _refused(file: str, faults: Sequence[str]) -> InputFileError:
    message = f"{file}: is no gradebook as Canvas exports it; export it again and do not resave it"
    return InputFileError("canvas_gradebook", f"{message}\n{lines_of(faults)}")


def _assignment(header: Sequence[str], last: int, wanted: str, file: str) -> int:
    """The assignment's column after `last`: named by its whole header, title or number, or the only one."""
    known = {
        place: match
        for place, title in enumerate(header)
        if place > last and (match := _NUMBERED.fullmatch(title))
    }
    fitting = [place for place in known if not wanted or header[place] == wanted]
    if wanted and not fitting:
        fitting = [place for place, match in known.items() if wanted in (match["title"], match["id"])]
    if len(fitting) == 1:
        return fitting[0]
    choices = ", ".join(f"'{header[place]}'" for place in known) or "none"
    raise CallError(
        "item",
        f"{file}: {len(fitting)} assignments fit '{wanted}': name one with --item out of {choices}"
        if wanted
        else f"{file}: which assignment? Name it with --item: {choices}",
    )


# The rubric ---------------------------------------------------------------------------------------

_RATING = ("Rating Name", "Rating Description", "Rating Points")
RUBRIC_HEADER = (
    "Rubric Name", "Criteria Name", "Criteria Description", "Criteria Enable Range", *_RATING, *_RATING,
)  # fmt: skip


def rubric(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric as Canvas imports it: each criterion a range of points from nothing to its maximum.

    Raises CallError for points that Canvas would round.
    """
    criteria = class_criteria(grades, options)
    rough = [
        f"{each.name}: {each.max_points:g}"
        for each in criteria
        if round(each.max_points, 2) != each.max_points
    ]
    if rough:
        message = "Canvas keeps two decimals of a rubric's points; nothing was written"
        raise CallError("points", f"{message}\n{lines_of(rough)}")
    name = options.item.strip() or grades[0].assignment
    ratings = ("true", "Full marks", "", "{}", "No marks", "", "0")
    rows = [
        (name, each.name, each.titles[0], *(cell.format(number(each.max_points)) for cell in ratings))
        for each in criteria
    ]
    return Delivery(csv_text(RUBRIC_HEADER, rows))


# Points in the rubric -----------------------------------------------------------------------------

CanvasUser = Annotated[str, Field(pattern=r"^([1-9][0-9]*|sis_(user|login|integration)_id:[^/?#\s]+)$")]


class CanvasMark(Payload):
    """Points and comment on a criterion of the rubric."""

    points: NotNegative
    comments: str


class CanvasSubmission(Payload):
    """The grade."""

    posted_grade: Number


class CanvasComment(Payload):
    """The comment beside it."""

    text_comment: Filled


class CanvasBody(Payload):
    """What is put to a submission."""

    submission: CanvasSubmission
    comment: CanvasComment
    rubric_assessment: dict[str, CanvasMark]


class CanvasCall(Payload):
    """One student's grade, to be put to its path."""

    student_id: str
    method: Literal["PUT"] = "PUT"
    path: Filled
    body: CanvasBody


class CanvasGrade(Payload):
    """One student in a call for all."""

    posted_grade: Number
    text_comment: Filled
    rubric_assessment: dict[str, CanvasMark]


class CanvasGrades(Payload):
    """By Canvas's number of the student, or `sis_user_id:` and the institution's."""

    grade_data: dict[CanvasUser, CanvasGrade]


class CanvasBulk(Payload):
    """All students' grades in one call."""

    method: Literal["POST"] = "POST"
    path: Filled
    body: CanvasGrades


class CanvasMarksDocument(Payload):
    """Grades with points by criterion: a call for each student, and the same in one call."""

    schema_version: Version = 1
    assignment: str
    criteria: list[PlatformCriterion]
    calls: list[CanvasCall]
    bulk: CanvasBulk

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((each.id for each in self.criteria), "criterion")
        check_unique((call.path for call in self.calls), "submission")
        if len(self.bulk.body.grade_data) != len(self.calls):
            raise ValueError("the calls and the one call hold different students")
        for call in self.calls:
            points = {name: mark.points for name, mark in call.body.rubric_assessment.items()}
            check_points(self.criteria, points)
            total = math.fsum(points.values())
            if not math.isclose(total, float(call.body.submission.posted_grade), abs_tol=CLOSE):
                raise ValueError(f"{call.student_id}: the criteria give {total:g} together, not the grade")
        return self


_PLACES = "the paths hold :course_id and :assignment_id: give --course-id and --assignment-id, or put them in"


def assessments(grades: Sequence[Grade], options: Options) -> Delivery:
    """Everybody's grade, comment and points in the rubric: a call for each student, and one for all.

    Raises CallError where the criteria's numbers are not given, InputFileError where they are not the
    rubric's.
    """
    if options.criteria is None:
        raise CallError(
            "criteria_needed",
            "Canvas's numbers of the criteria are needed (--criteria): its answer for the rubric"
            " (/api/v1/courses/:course_id/rubrics/:id), or a CSV table criterion,id",
        )
    criteria, marked = platform_marks(grades, options, options.criteria)
    course, assignment = options.course_id or ":course_id", options.assignment_id or ":assignment_id"
    path = f"/api/v1/courses/{course}/assignments/{assignment}/submissions"
    calls, bulk = [], {}
    for grade, marks in marked:
        # By Canvas's own number, else by the institution's.
        user = grade.person.platform_id or f"sis_user_id:{grade.student_id}"
        score = {"posted_grade": number(grade.score or 0.0)}
        remark = {"text_comment": plain_comment(grade)}
        points = {each: {"points": mark.points, "comments": mark.remark} for each, mark in marks.items()}
        body = {"submission": score, "comment": remark, "rubric_assessment": points}
        calls.append({"student_id": grade.student_id, "path": f"{path}/{user}", "body": body})
        bulk[user] = {**score, **remark, "rubric_assessment": points}
    if len(bulk) < len(calls):
        raise CallError("ids", "two students have the same number in Canvas (--ids)")
    content = {
        "assignment": grades[0].assignment,
        "criteria": criteria,
        "calls": calls,
        "bulk": {"path": f"{path}/update_grades", "body": {"grade_data": bulk}},
    }
    text = json_document(CanvasMarksDocument, content, "the rubric's points")
    return Delivery(text, notes=(_PLACES,) if ":" in path else ())
