"""Google Classroom: the rubric of a course work, and students' grades."""

from collections.abc import Sequence
from urllib.parse import quote

from grader.lms.api.requests import Plan, place_of, rubric_at, students_submissions
from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import class_criteria, platform_marks
from grader.lms.table import number
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError

_MOST_CRITERIA = 50
"""Limit of a rubric (Google's guide, Rubrics structure and known limitations)."""


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
        criteria = class_criteria(grades, options)
        if len(criteria) > _MOST_CRITERIA:
            count = {"most": _MOST_CRITERIA, "count": len(criteria)}
            raise failure(CallError, "criteria", "criteria_many", platform=plan.platform, **count)
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
                for each in criteria
            ]
        }
        plan.add(f"POST {path}/rubrics", body, "rubric", unless=rubric_at(f"{path}/rubrics", criteria))
    else:
        platform_marks(grades, options, options.criteria)
    known, missing = students_submissions(grades, options, "courses.courseWork.studentSubmissions.list")
    for grade in ready(grades):
        if submission := known.get(grade.student_id):
            score = round(grade.out_of(options.maximum, rescale=options.rescale), 2)
            where = f"{path}/studentSubmissions/{quote(submission.id, safe='')}"
            call = f"PATCH {where}?updateMask=draftGrade,assignedGrade"
            fields = {"draftGrade": score, "assignedGrade": score}
            plan.add(call, fields, "grade", grade.student_id)
    most = options.maximum or grades[0].max_score
    notes = Reason("maximum_there", {"most_points": most}), Reason("two_decimals")
    return plan.delivery(grades, unplaced=missing, notes=notes)
