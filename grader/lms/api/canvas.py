"""Canvas: the rubric, its place in an assignment, and students' grades and points.

Canvas keeps the ids of criteria that it is given (app/models/rubric.rb, `generate_criteria`), so that the
points can follow at once; where they are others, the sender puts them in.
"""

import re
from collections.abc import Mapping, Sequence
from itertools import chain
from typing import Any

from grader.lms.api.requests import Plan, place_of, rubric_at
from grader.lms.grades import Delivery, Grade, Options
from grader.lms.marks import (
    CLOSE,
    Criterion,
    Mark,
    class_criteria,
    plain_comment,
    platform_marks,
    ready_marks,
)
from grader.lms.table import csv_text, number
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError

_RATING = ("Rating Name", "Rating Description", "Rating Points")
RUBRIC_HEADER = (
    "Rubric Name", "Criteria Name", "Criteria Description", "Criteria Enable Range", *(3 * _RATING),
)  # fmt: skip


def _ratings(criterion: Criterion) -> list[tuple[str, float]]:
    """A criterion's ratings, the best first.

    Canvas shows the one whose range has the points: from its own down to above those of the next one
    (app/models/rubric_association.rb, `assess`). Points have two decimals.
    """
    most = criterion.max_points
    return [("Full marks", most), ("Partial marks", round(most - 0.01, 2)), ("No marks", 0.0)]


def _canvas_criteria(grades: Sequence[Grade], options: Options) -> list[Criterion]:
    """The rubric; CallError for points that Canvas would round."""
    criteria = class_criteria(grades, options)
    rough = [each for each in criteria if abs(round(each.max_points, 2) - each.max_points) > CLOSE]
    if rough:
        lines = [Reason("points_rough", {"cell": one.name, "given_points": one.max_points}) for one in rough]
        raise failure(CallError, "points", faults=lines)
    return criteria


def rubric(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric as Canvas imports it: each criterion a range of points from nothing to its maximum."""
    name = options.item.strip() or grades[0].assignment
    rows = []
    for each in _canvas_criteria(grades, options):
        ratings = [(called, "", number(points)) for called, points in _ratings(each)]
        rows.append((name, each.name, each.titles[0], "true", *chain.from_iterable(ratings)))
    return Delivery(csv_text(RUBRIC_HEADER, rows))


_CANVAS_USER = re.compile(r"[1-9][0-9]*|sis_(user|login|integration)_id:[^/?#\s{}]+")


def _canvas_user(grade: Grade) -> str:
    """By Canvas's own number, else by the institution's; CallError for what is none of Canvas's."""
    user = grade.person.platform_id or f"sis_user_id:{grade.student_id}"
    if not _CANVAS_USER.fullmatch(user):
        raise failure(CallError, "ids", student=grade.student_id, text=user, platform="Canvas")
    return user


def _canvas_body(grade: Grade, marks: Mapping[str, Mark]) -> dict[str, dict[str, Any]]:
    return {
        "submission": {"posted_grade": number(grade.score or 0.0)},
        "comment": {"text_comment": plain_comment(grade)},
        "rubric_assessment": {
            each: {"points": mark.points, "comments": mark.remark} for each, mark in marks.items()
        },
    }


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
    path = f"/api/v1/courses/{course}/assignments/{assignment}"
    if options.criteria is None:
        criteria = _canvas_criteria(grades, options)
        rubric_body = {
            "title": options.item.strip() or grades[0].assignment,
            "free_form_criterion_comments": False,
            # Lists of Canvas's forms are objects by index: it passes over a JSON list.
            "criteria": {
                str(index): {
                    "id": each.id,
                    "description": each.name,
                    "long_description": each.titles[0],
                    "points": each.max_points,
                    "criterion_use_range": True,
                    "ratings": {
                        str(place): {"description": called, "points": points}
                        for place, (called, points) in enumerate(_ratings(each))
                    },
                }
                for index, each in enumerate(criteria)
            },
        }
        place = {
            "association_id": int(assignment), "association_type": "Assignment", "use_for_grading": True,
            "purpose": "grading",
        }  # fmt: skip
        made = {"rubric": rubric_body, "rubric_association": place}
        plan.add(f"POST /api/v1/courses/{course}/rubrics", made, "rubric", unless=rubric_at(path, criteria))
        marked = [
            (grade, {mark.criterion: mark for mark in marks}) for grade, marks in ready_marks(grades, options)
        ]
        notes = [Reason("points_become", {"platform": "Canvas", "most_points": grades[0].max_score})]
    else:
        _, marked = platform_marks(grades, options, options.criteria)
        notes = []
    for grade, marks in marked:
        body = _canvas_body(grade, marks)
        plan.add(f"PUT {path}/submissions/{_canvas_user(grade)}", body, "grade", grade.student_id)
    return plan.delivery(grades, notes=tuple(notes))
