"""Canvas's rubric: its definition as a CSV file, and students' points in it for the submissions API.

Canvas rounds a rubric's points to two decimals, and takes no byte order mark.
"""

from collections.abc import Sequence

from grader.exports.comments import plain_comment
from grader.exports.draft import Draft, document, json_text, ready, withheld
from grader.exports.faults import listed
from grader.exports.grades import Grade
from grader.exports.marks import Criterion, Mark, class_criteria, class_marks
from grader.exports.options import Options
from grader.exports.platform_ids import numbered
from grader.exports.table import csv_text, number
from grader.platform_documents import CanvasMarksDocument
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
    course = options.course_id or ":course_id"
    assignment = options.assignment_id or ":assignment_id"
    path = f"/api/v1/courses/{course}/assignments/{assignment}/submissions"
    told = {
        user(grade, options): _told(grade, marks, numbers, options.lang_of(grade.student_id))
        for grade, marks in marked
    }
    if len(told) < len(marked):
        raise CallError("ids", "two students have the same number in Canvas (--ids)")
    calls = [
        {
            "student_id": grade.student_id,
            "path": f"{path}/{who}",
            "body": {
                "submission": {"posted_grade": one["posted_grade"]},
                "comment": {"text_comment": one["text_comment"]},
                "rubric_assessment": one["rubric_assessment"],
            },
        }
        for (grade, _), (who, one) in zip(marked, told.items(), strict=True)
    ]
    bulk = {"path": f"{path}/update_grades", "body": {"grade_data": told}}
    whole = {
        "assignment": grades[0].reports[0].assignment, "criteria": criteria, "calls": calls, "bulk": bulk,
    }  # fmt: skip
    notes = [] if options.course_id and options.assignment_id else [
        "the paths hold :course_id and :assignment_id: give --course-id and --assignment-id, or put them in"
    ]  # fmt: skip
    return Draft(
        json_text(document(CanvasMarksDocument, whole, "the rubric's points")),
        tuple(grade.student_id for grade in ready(grades)),
        withheld=withheld(grades),
        notes=tuple(notes),
    )


def user(grade: Grade, options: Options) -> str:
    """A student as Canvas's API names one: by its own number, else by the institution's."""
    return options.person(grade.student_id).platform_id or f"sis_user_id:{grade.student_id}"


def _told(grade: Grade, marks: Sequence[Mark], numbers: dict[str, str], lang: str) -> dict[str, object]:
    return {
        "posted_grade": number(grade.score or 0.0),
        "text_comment": plain_comment(grade.reports, lang),
        "rubric_assessment": {
            numbers[mark.criterion]: {"points": mark.points, "comments": mark.remark} for mark in marks
        },
    }
