"""Canvas: the rubric, its place in an assignment, and students' grades and points.

Canvas keeps the ids of criteria that it is given (app/models/rubric.rb, `generate_criteria`), so that the
points can follow at once; its answer tells the ids it took.
"""

import math
import re
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self

from pydantic import Field, model_validator

from grader.lms.api.requests import NOT_EMPTY, Plan, place_of, ready_marks
from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import (
    CLOSE,
    Criterion,
    Filled,
    Id,
    Mark,
    NotNegative,
    Number,
    Payload,
    Positive,
    check_unique,
    class_criteria,
    plain_comment,
    platform_marks,
)
from grader.lms.table import csv_text, number
from reference.errors import CallError, lines_of

_RATING = ("Rating Name", "Rating Description", "Rating Points")
RUBRIC_HEADER = (
    "Rubric Name", "Criteria Name", "Criteria Description", "Criteria Enable Range", *_RATING, *_RATING,
)  # fmt: skip


def _canvas_criteria(grades: Sequence[Grade], options: Options) -> list[Criterion]:
    """The rubric; CallError for points that Canvas would round."""
    criteria = class_criteria(grades, options)
    rough = [each for each in criteria if abs(round(each.max_points, 2) - each.max_points) > CLOSE]
    if rough:
        message = "Canvas keeps two decimals of a rubric's points; nothing was written"
        lines = lines_of([f"{each.name}: {each.max_points:g}" for each in rough])
        raise CallError("points", f"{message}\n{lines}")
    return criteria


def rubric(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric as Canvas imports it: each criterion a range of points from nothing to its maximum."""
    name = options.item.strip() or grades[0].assignment
    ratings = ("true", "Full marks", "", "{}", "No marks", "", "0")
    rows = [
        (name, each.name, each.titles[0], *(cell.format(number(each.max_points)) for cell in ratings))
        for each in _canvas_criteria(grades, options)
    ]
    return Delivery(csv_text(RUBRIC_HEADER, rows))


_CANVAS_USER = re.compile(r"[1-9][0-9]*|sis_(user|login|integration)_id:[^/?#\s]+")


class CanvasMark(Payload):
    """Points and comment on a criterion of the rubric."""

    points: NotNegative
    comments: str


class CanvasBody(Payload):
    """Grade, comment and points in the rubric, as put to a submission.

    Source: canvas.instructure.com/doc/api/submissions.html, Grade or comment on a submission.
    """

    submission: Annotated[dict[Literal["posted_grade"], Number], NOT_EMPTY]
    comment: Annotated[dict[Literal["text_comment"], Filled], NOT_EMPTY]
    rubric_assessment: Annotated[dict[str, CanvasMark], NOT_EMPTY]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        total = math.fsum(mark.points for mark in self.rubric_assessment.values())
        if not math.isclose(total, float(self.submission["posted_grade"]), abs_tol=CLOSE):
            raise ValueError(f"the criteria give {total:g} together, not the grade")
        return self


def _canvas_user(grade: Grade) -> str:
    """By Canvas's own number, else by the institution's; CallError for what is none of Canvas's."""
    user = grade.person.platform_id or f"sis_user_id:{grade.student_id}"
    if not _CANVAS_USER.fullmatch(user):
        raise CallError("ids", f"{grade.student_id}: '{user}' is no number of a Canvas user (--ids)")
    return user


def _canvas_body(grade: Grade, marks: Mapping[str, Mark]) -> dict[str, dict[str, Any]]:
    return {
        "submission": {"posted_grade": number(grade.score or 0.0)},
        "comment": {"text_comment": plain_comment(grade)},
        "rubric_assessment": {
            each: {"points": mark.points, "comments": mark.remark} for each, mark in marks.items()
        },
    }


class CanvasRating(Payload):
    """A level of a criterion."""

    description: Filled
    points: NotNegative


_Index = Annotated[str, Field(pattern=r"^[0-9]+$")]
"""Lists of Canvas's forms are objects by index: it passes over a JSON list (`generate_criteria`)."""


class CanvasCriterion(Payload):
    """A criterion; its points are those of its best rating."""

    id: Filled
    description: Filled
    long_description: str
    points: Positive
    criterion_use_range: bool = True
    ratings: Annotated[dict[_Index, CanvasRating], Field(min_length=2)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if max(rating.points for rating in self.ratings.values()) != self.points:
            raise ValueError("the best rating is not the criterion's points")
        return self


class CanvasRubric(Payload):
    """The rubric."""

    title: Filled
    free_form_criterion_comments: bool = False
    criteria: Annotated[dict[_Index, CanvasCriterion], NOT_EMPTY]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((each.id for each in self.criteria.values()), "criterion")
        return self


class CanvasAssociation(Payload):
    """What ties the rubric to an assignment."""

    association_id: Id
    association_type: Literal["Assignment"] = "Assignment"
    use_for_grading: bool = True
    purpose: Literal["grading"] = "grading"


class CanvasRubricBody(Payload):
    """The body of ``POST /api/v1/courses/:course_id/rubrics``.

    Source: canvas.instructure.com/doc/api/rubrics.html, Create a single rubric.
    """

    rubric: CanvasRubric
    rubric_association: CanvasAssociation


def canvas_api(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric with its assignment, then each student's points in it.

    With `--criteria`, Canvas's answer for the rubric, only the points, to the ids that it tells.
    """
    course, assignment = place_of(options, "course_id", "assignment_id")
    plan = Plan(
        "Canvas",
        "https://canvas.example.org",
        [
            "https://canvas.instructure.com/doc/api/rubrics.html (Create a single rubric)",
            "https://canvas.instructure.com/doc/api/submissions.html (Grade or comment on a submission)",
        ],
    )
    if options.criteria is None:
        rubric_body = {
            "title": options.item.strip() or grades[0].assignment,
            "criteria": {
                str(index): {
                    "id": each.id,
                    "description": each.name,
                    "long_description": each.titles[0],
                    "points": each.max_points,
                    "ratings": {
                        "0": {"description": "Full marks", "points": each.max_points},
                        "1": {"description": "No marks", "points": 0.0},
                    },
                }
                for index, each in enumerate(_canvas_criteria(grades, options))
            },
        }
        made = {"rubric": rubric_body, "rubric_association": {"association_id": assignment}}
        plan.add(f"POST /api/v1/courses/{course}/rubrics", CanvasRubricBody, made, "rubric")
        marked = [
            (grade, {mark.criterion: mark for mark in ready_marks(grade, options)}) for grade in ready(grades)
        ]
        notes = [
            "Canvas sets the assignment's points possible to the rubric's",
            "its answer tells the criteria's ids: where they are others, export again with it (--criteria)",
        ]
    else:
        _, marked = platform_marks(grades, options, options.criteria)
        notes = []
    path = f"/api/v1/courses/{course}/assignments/{assignment}/submissions"
    for grade, marks in marked:
        body = _canvas_body(grade, marks)
        plan.add(f"PUT {path}/{_canvas_user(grade)}", CanvasBody, body, "grade", grade.student_id)
    return plan.delivery(grades, notes=tuple(notes))
