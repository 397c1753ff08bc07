"""Canvas's rubric: its definition as a CSV file, and students' points in it for the submissions API.

Canvas rounds a rubric's points to two decimals, and takes no byte order mark.
"""

from collections.abc import Mapping, Sequence

from grader.lms.comments import plain_comment
from grader.lms.documents import CanvasMarksDocument
from grader.lms.draft import Draft, document, json_text, withheld
from grader.lms.faults import listed
from grader.lms.grades import Grade
from grader.lms.marks import Criterion, Mark, class_criteria, class_marks
from grader.lms.options import Options
from grader.lms.platform_ids import numbered
from grader.lms.table import csv_text, number
from reference.errors import CallError

_RATING = ("Rating Name", "Rating Description", "Rating Points")
HEADER = (
    "Rubric Name", "Criteria Name", "Criteria Description", "Criteria Enable Range", *_RATING, *_RATING,
)  # fmt: skip
_FULL, _NONE = "Full marks", "No marks"


def rubric(grades: Sequence[Grade], options: Options) -> Draft:
    """The rubric as Canvas imports it: each criterion a range of points from nothing to its maximum.

    Raises CallError for points that Canvas would round.
    """
    criteria = class_criteria(grades, options)
    rough = [
        f"{one.name}: {one.max_points:g}" for one in criteria if round(one.max_points, 2) != one.max_points
    ]
    if rough:
        raise CallError(
            "points", f"Canvas keeps two decimals of a rubric's points; nothing was written{listed(rough)}"
        )
    name = options.item.strip() or grades[0].reports[0].assignment
    return Draft(csv_text(HEADER, [_row(name, one) for one in criteria]), ())


def _row(name: str, one: Criterion) -> list[str]:
    return [name, one.name, one.titles[0], "true", _FULL, "", number(one.max_points), _NONE, "", "0"]


def assessments(grades: Sequence[Grade], options: Options) -> Draft:
    """Everybody's grade, comment and points in the rubric: a call for each student, and one for all.

    Raises CallError where the criteria's numbers are not told, InputFileError where they are not the
    rubric's.
    """
    if options.criteria is None:
        raise CallError(
            "criteria_needed",
            "Canvas's numbers of the criteria are needed (--criteria): its answer for the rubric"
            " (/api/v1/courses/:course_id/rubrics/:id), or a CSV table criterion,id",
        )
    marked = class_marks(grades, options)
    criteria = numbered(class_criteria(grades, options), options.criteria)
    numbers = {one.criterion: one.id for one in criteria}
    told = {user(grade, options): _told(grade, marks, numbers, options) for grade, marks in marked}
    if len(told) < len(marked):
        raise CallError("ids", "two students have the same number in Canvas (--ids)")
    path = _path(options)
    calls = [
        {"student_id": grade.student_id, "path": f"{path}/{who}", "body": _body(one)}
        for (grade, _), (who, one) in zip(marked, told.items(), strict=True)
    ]
    whole = {
        "assignment": grades[0].reports[0].assignment,
        "criteria": criteria,
        "calls": calls,
        "bulk": {"path": f"{path}/update_grades", "body": {"grade_data": told}},
    }
    text = json_text(document(CanvasMarksDocument, whole, "the rubric's points"))
    written = tuple(grade.student_id for grade, _ in marked)
    return Draft(text, written, withheld=withheld(grades), notes=(_PLACES,) if ":" in path else ())


_PLACES = "the paths hold :course_id and :assignment_id: give --course-id and --assignment-id, or put them in"


def _path(options: Options) -> str:
    """Of the assignment's submissions, with Canvas's own placeholders for what is not told."""
    course = options.course_id or ":course_id"
    assignment = options.assignment_id or ":assignment_id"
    return f"/api/v1/courses/{course}/assignments/{assignment}/submissions"


def user(grade: Grade, options: Options) -> str:
    """A student as Canvas's API names one: by its own number, else by the institution's."""
    return options.person(grade.student_id).platform_id or f"sis_user_id:{grade.student_id}"


def _told(
    grade: Grade, marks: Sequence[Mark], numbers: Mapping[str, str], options: Options
) -> dict[str, object]:
    """A student in the call for all."""
    return {
        "posted_grade": number(grade.score or 0.0),
        "text_comment": plain_comment(grade.reports, options.lang_of(grade.student_id)),
        "rubric_assessment": {
            numbers[mark.criterion]: {"points": mark.points, "comments": mark.remark} for mark in marks
        },
    }


def _body(told: Mapping[str, object]) -> dict[str, object]:
    """The same for a call of its own."""
    return {
        "submission": {"posted_grade": told["posted_grade"]},
        "comment": {"text_comment": told["text_comment"]},
        "rubric_assessment": told["rubric_assessment"],
    }
