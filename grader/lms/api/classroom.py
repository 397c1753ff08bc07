"""Google Classroom: the rubric of a course work, and students' grades."""

from collections.abc import Sequence
from typing import Annotated, Self
from urllib.parse import quote

from pydantic import Field, model_validator

from grader.lms.api.requests import Plan, place_of, students_submissions
from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import (
    Filled,
    NotNegative,
    Payload,
    class_criteria,
    platform_marks,
)
from grader.lms.table import number


class GoogleLevel(Payload):
    """A level of a criterion."""

    title: Filled
    points: NotNegative


class GoogleCriterion(Payload):
    """A criterion: at most ten levels, of different points in one order."""

    title: Filled
    description: str
    levels: Annotated[list[GoogleLevel], Field(min_length=1, max_length=10)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        points = [level.points for level in self.levels]
        if points != sorted(set(points), reverse=True):
            raise ValueError("the levels' points are not in order, or stand twice")
        return self


class GoogleRubric(Payload):
    """The body of ``courses.courseWork.rubrics.create``.

    Source: developers.google.com/workspace/classroom, Rubrics structure and known limitations.
    """

    criteria: Annotated[list[GoogleCriterion], Field(min_length=1, max_length=50)]


class GoogleGrade(Payload):
    """The body of ``studentSubmissions.patch``: points by criterion are read-only there.

    Source: developers.google.com/workspace/classroom, REST reference.
    """

    draftGrade: NotNegative  # noqa: N815 - the platform's own names
    assignedGrade: NotNegative  # noqa: N815


def google_classroom(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric, unless `--criteria` shows that it is there, and grades of known submissions."""
    course, work = place_of(options, "course_id", "assignment_id")
    path = f"/v1/courses/{course}/courseWork/{work}"
    about = "https://developers.google.com/workspace/classroom"
    plan = Plan(
        "Google Classroom",
        "https://classroom.googleapis.com",
        [
            f"{about}/reference/rest/v1/courses.courseWork.rubrics",
            f"{about}/rubrics/limitations",
            f"{about}/reference/rest/v1/courses.courseWork.studentSubmissions/patch",
        ],
    )
    if options.criteria is None:
        body = {
            "criteria": [
                {
                    "title": each.name,
                    "description": each.titles[0],
                    "levels": [
                        {"title": f"{number(points)} / {number(each.max_points)}", "points": points}
                        for points in (each.max_points, each.max_points / 2.0, 0.0)
                    ],
                }
                for each in class_criteria(grades, options)
            ]
        }
        plan.add(f"POST {path}/rubrics", GoogleRubric, body, "rubric")
    else:
        platform_marks(grades, options, options.criteria)
    known, missing = students_submissions(grades, options, "courses.courseWork.studentSubmissions.list")
    for grade in ready(grades):
        if submission := known.get(grade.student_id):
            score = round(grade.out_of(options.maximum, rescale=options.rescale), 2)
            where = f"{path}/studentSubmissions/{quote(submission.id, safe='')}"
            call = f"PATCH {where}?updateMask=draftGrade,assignedGrade"
            fields = {"draftGrade": score, "assignedGrade": score}
            plan.add(call, GoogleGrade, fields, "grade", grade.student_id)
    notes = (
        f"the course work must be out of {number(options.maximum or grades[0].max_score)}",
        "grades have two decimals there; points by criterion are read-only for the API: --to csv has them",
    )
    return plan.delivery(grades, unplaced=missing, notes=notes)
