"""Microsoft Teams through Graph: the rubric, its place in an assignment, levels, points and feedback."""

import math
from collections.abc import Mapping, Sequence
from typing import Any
from urllib.parse import quote

from grader.lms.api.requests import Plan, place_of, rubric_at, students_submissions
from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import Criterion, Mark, class_criteria, plain_comment, platform_marks, read_answer
from grader.lms.table import number
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError

_TYPE = "#microsoft.graph.education"
"""Start of every `@odata.type`."""


def _text(content: str) -> dict[str, str]:
    return {"content": content, "contentType": "text"}


_SHARES = (100.0, 75.0, 50.0, 25.0, 0.0)
"""Per cent; levels are the same for all qualities, so that points between them stand in the feedback."""
_OUTCOMES = ("rubric", "points", "feedback")
"""In the order in which they are sent: the levels would set the points anew."""


def ms_education(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric and the call that attaches it; with Graph's answer for it (`--criteria`) that call alone.

    With the answer and the submissions the students' outcomes: levels, points and feedback.
    """
    course, assignment = place_of(options, "course_id", "assignment_id")
    base = f"/v1.0/education/classes/{course}/assignments/{assignment}"
    about = "https://learn.microsoft.com/graph/api"
    plan = Plan(
        "Microsoft Graph",
        "https://graph.microsoft.com",
        [
            f"{about}/educationuser-post-rubrics",
            f"{about}/educationassignment-put-rubric",
            f"{about}/educationoutcome-update",
        ],
    )
    ask = f"{base}/submissions?$expand=outcomes"
    if options.criteria is None:
        criteria = class_criteria(grades, options)
        # Without a rubric Graph answers 404 (educationassignment-get-rubric).
        unless = rubric_at(f"{base}/rubric", criteria, absent=404)
        body = _graph_rubric(criteria, options.item.strip() or grades[0].assignment)
        plan.add("POST /v1.0/education/me/rubrics", body, "rubric", unless=unless)
        plan.add(f"PUT {base}/rubric/$ref", _reference("{id}"), "attach")
        why = Reason("rubric_first")
        return plan.delivery(grades, unplaced={grade.student_id: why for grade in ready(grades)})
    answer = read_answer(options.criteria)
    _, marked = platform_marks(grades, options, options.criteria)
    levels = _graph_levels(answer)
    known, missing = students_submissions(grades, options, ask)
    rubric_id = answer.get("id") if isinstance(answer, dict) else None
    if not levels or not isinstance(rubric_id, str):
        raise failure(CallError, "criteria", "no_rubric", file=options.criteria)
    if options.submissions is None:
        plan.add(f"PUT {base}/rubric/$ref", _reference(quote(rubric_id)), "attach")
    for grade, marks in marked:
        if submission := known.get(grade.student_id):
            outcomes = {
                kind: submission.outcomes.get(f"education{kind.title()}Outcome") for kind in _OUTCOMES
            }
            if not all(outcomes.values()):
                missing[grade.student_id] = Reason("outcomes_absent", {"asked": ask})
                continue
            score = grade.out_of(options.maximum, rescale=options.rescale)
            bodies = _graph_outcomes(grade, marks, levels, score)
            for kind in _OUTCOMES:
                outcome = quote(outcomes[kind] or "", safe="")
                path = f"{base}/submissions/{quote(submission.id, safe='')}/outcomes/{outcome}"
                plan.add(f"PATCH {path}", bodies[kind], kind, grade.student_id)
    most = {"most_points": options.maximum or grades[0].max_score}
    own = Reason("rubric_of_its_own", {"asked": f"{base}/rubric"})
    return plan.delivery(
        grades, unplaced=missing, notes=(Reason("maximum_there", most), Reason("quarters"), own)
    )


def _reference(rubric: str) -> dict[str, str]:
    """The body that attaches a rubric; the sender puts in an ``{id}`` that Graph gives."""
    return {"@odata.id": f"https://graph.microsoft.com/v1.0/education/me/rubrics/{rubric}"}


def _graph_rubric(criteria: Sequence[Criterion], title: str) -> dict[str, Any]:
    total = math.fsum(each.max_points for each in criteria)
    kind = {"@odata.type": f"{_TYPE}AssignmentPointsGradeType"}
    return {
        "displayName": title,
        "description": _text(title),
        "levels": [
            {"displayName": f"{share:g} %", "description": _text(""), "grading": {**kind, "maxPoints": share}}
            for share in _SHARES
        ],
        "qualities": [
            {
                "description": _text(each.name),
                "criteria": [
                    {"description": _text(number(each.max_points * share / 100.0))} for share in _SHARES
                ],
                "weight": 100.0 * each.max_points / total,
            }
            for each in criteria
        ],
        "grading": kind,
    }


def _graph_levels(answer: object) -> dict[str, float]:
    """The share of the best level that each level of a rubric is, by its id."""
    levels = answer.get("levels") if isinstance(answer, dict) else None
    points = {
        str(each["levelId"]): float(each["grading"]["maxPoints"])
        for each in (levels if isinstance(levels, list) else [])
        if isinstance(each, dict) and isinstance(each.get("grading"), dict) and "levelId" in each
        if isinstance(each["grading"].get("maxPoints"), int | float)
    }
    best = max(points.values(), default=0.0)
    return {level: one / best for level, one in points.items()} if best > 0.0 else {}


def _nearest(levels: Mapping[str, float], mark: Mark) -> str:
    """The level of some points: all and none alone have the outer ones, where there are others."""
    share = 1.0 if mark.is_full else min(mark.points / mark.max_points, 1.0)
    inner = [level for level in levels if 0.0 < levels[level] < 1.0]
    return min((0.0 < share < 1.0 and inner) or levels, key=lambda level: abs(levels[level] - share))


def _graph_outcomes(
    grade: Grade, marks: Mapping[str, Mark], levels: Mapping[str, float], score: float
) -> dict[str, dict[str, Any]]:
    """The bodies of a student's three outcomes."""
    nearest = {quality: _nearest(levels, mark) for quality, mark in marks.items()}
    said = {
        quality: f"{number(mark.points)} / {number(mark.max_points)}. {mark.remark}"
        for quality, mark in marks.items()
    }
    return {
        "rubric": {
            "@odata.type": f"{_TYPE}RubricOutcome",
            "rubricQualityFeedback": [
                {"qualityId": quality, "feedback": _text(text)} for quality, text in said.items()
            ],
            "rubricQualitySelectedLevels": [
                {"qualityId": quality, "columnId": level} for quality, level in nearest.items()
            ],
        },
        "points": {
            "@odata.type": f"{_TYPE}PointsOutcome",
            "points": {"@odata.type": f"{_TYPE}AssignmentPointsGrade", "points": round(score, 5)},
        },
        "feedback": {
            "@odata.type": f"{_TYPE}FeedbackOutcome",
            "feedback": {"text": _text(plain_comment(grade))},
        },
    }
