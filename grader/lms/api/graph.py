"""Microsoft Teams through Graph: the rubric, its place in an assignment, levels, points and feedback."""

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, Any, Literal, Self
from urllib.parse import quote

from pydantic import Field, model_validator

from grader.lms.api.requests import NOT_EMPTY, Plan, place_of, students_submissions, total_of
from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import (
    CLOSE,
    Filled,
    Mark,
    NotNegative,
    Payload,
    Positive,
    class_criteria,
    plain_comment,
    platform_marks,
    read_answer,
)
from grader.lms.table import number
from reference.errors import CallError


class GraphText(Payload):
    """A text (itemBody)."""

    content: str
    contentType: Literal["text", "html"] = "text"  # noqa: N815 - the platform's own names, here and below


class GraphPointsType(Payload):
    """That points are given, and how many."""

    type: Literal["#microsoft.graph.educationAssignmentPointsGradeType"] = Field(
        "#microsoft.graph.educationAssignmentPointsGradeType", alias="@odata.type"
    )
    maxPoints: NotNegative | None = None  # noqa: N815


class GraphLevel(Payload):
    """A level, the same for all qualities."""

    displayName: Filled  # noqa: N815
    description: GraphText
    grading: GraphPointsType


class GraphQuality(Payload):
    """A criterion of ours; `weight` in per cent of the rubric."""

    description: GraphText
    criteria: list[Annotated[dict[Literal["description"], GraphText], NOT_EMPTY]]
    weight: Positive


class GraphRubric(Payload):
    """The body of ``POST /education/me/rubrics`` (learn.microsoft.com/graph, educationuser-post-rubrics)."""

    displayName: Filled  # noqa: N815
    description: GraphText
    levels: Annotated[list[GraphLevel], NOT_EMPTY]
    qualities: Annotated[list[GraphQuality], NOT_EMPTY]
    grading: GraphPointsType

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if any(len(quality.criteria) != len(self.levels) for quality in self.qualities):
            raise ValueError("a quality does not describe every level")
        total = math.fsum(quality.weight for quality in self.qualities)
        if not math.isclose(total, 100.0, abs_tol=CLOSE):
            raise ValueError(f"the weights are {total:g} per cent together")
        return self


class GraphReference(Payload):
    """The body of ``PUT .../rubric/$ref`` (learn.microsoft.com/graph/api/educationassignment-put-rubric)."""

    id: Annotated[str, Field(alias="@odata.id", pattern=r"^https://graph\.microsoft\.com/v1\.0/\S+$")]


class GraphFeedback(Payload):
    """What is said of a quality."""

    qualityId: Filled  # noqa: N815
    feedback: GraphText


class GraphSelected(Payload):
    """The level of a quality."""

    qualityId: Filled  # noqa: N815
    columnId: Filled  # noqa: N815


class GraphRubricOutcome(Payload):
    """A student's levels (learn.microsoft.com/graph/api/educationoutcome-update, as the next two)."""

    type: Literal["#microsoft.graph.educationRubricOutcome"] = Field(
        "#microsoft.graph.educationRubricOutcome", alias="@odata.type"
    )
    rubricQualityFeedback: list[GraphFeedback]  # noqa: N815
    rubricQualitySelectedLevels: list[GraphSelected]  # noqa: N815


class GraphPoints(Payload):
    """The grade."""

    type: Literal["#microsoft.graph.educationAssignmentPointsGrade"] = Field(
        "#microsoft.graph.educationAssignmentPointsGrade", alias="@odata.type"
    )
    points: Annotated[float, Field(ge=0.0, lt=9_999_999.0)]


class GraphPointsOutcome(Payload):
    """A student's grade."""

    type: Literal["#microsoft.graph.educationPointsOutcome"] = Field(
        "#microsoft.graph.educationPointsOutcome", alias="@odata.type"
    )
    points: GraphPoints


class GraphFeedbackOutcome(Payload):
    """A student's feedback."""

    type: Literal["#microsoft.graph.educationFeedbackOutcome"] = Field(
        "#microsoft.graph.educationFeedbackOutcome", alias="@odata.type"
    )
    feedback: Annotated[dict[Literal["text"], GraphText], NOT_EMPTY]


_SHARES = (100.0, 75.0, 50.0, 25.0, 0.0)
"""Per cent; levels are the same for all qualities, so that points between them stand in the feedback."""
_OUTCOMES: Mapping[str, type[Payload]] = {
    "rubric": GraphRubricOutcome,
    "points": GraphPointsOutcome,
    "feedback": GraphFeedbackOutcome,
}
"""In the order in which they are sent: the levels would set the points anew."""


def ms_education(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric; with Graph's answer for it (`--criteria`) the call that attaches it to the assignment.

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
        plan.add("POST /v1.0/education/me/rubrics", GraphRubric, _graph_rubric(grades, options), "rubric")
        why = "its points follow once the rubric is there: give Graph's answer for it (--criteria)"
        return plan.delivery(grades, unplaced={grade.student_id: why for grade in ready(grades)})
    answer = read_answer(options.criteria)
    _, marked = platform_marks(grades, options, options.criteria)
    levels = _graph_levels(answer)
    known, missing = students_submissions(grades, options, ask)
    rubric_id = answer.get("id") if isinstance(answer, dict) else None
    if not levels or not isinstance(rubric_id, str):
        raise CallError("criteria", f"{options.criteria}: is no educationRubric with its id and levels")
    if options.submissions is None:
        reference = {"@odata.id": f"https://graph.microsoft.com/v1.0/education/me/rubrics/{quote(rubric_id)}"}
        plan.add(f"PUT {base}/rubric/$ref", GraphReference, reference, "attach")
    for grade, marks in marked:
        if submission := known.get(grade.student_id):
            outcomes = {
                kind: submission.outcomes.get(f"education{kind.title()}Outcome") for kind in _OUTCOMES
            }
            if not all(outcomes.values()):
                missing[grade.student_id] = f"no outcomes of all kinds in the answer: ask for {ask}"
                continue
            score = grade.out_of(options.maximum, rescale=options.rescale)
            bodies = _graph_outcomes(grade, marks, levels, score)
            for kind, model in _OUTCOMES.items():
                outcome = quote(outcomes[kind] or "", safe="")
                path = f"{base}/submissions/{quote(submission.id, safe='')}/outcomes/{outcome}"
                plan.add(f"PATCH {path}", model, bodies[kind], kind, grade.student_id)
    notes = [
        f"the assignment must be out of {number(options.maximum or grades[0].max_score)} points",
        "a level is the nearest quarter; the points themselves are the grade's and stand in each feedback",
        f"a published assignment has a rubric of its own: give the answer to {base}/rubric then (--criteria)",
    ]
    return plan.delivery(grades, unplaced=missing, notes=tuple(notes))


def _graph_rubric(grades: Sequence[Grade], options: Options) -> dict[str, Any]:
    criteria = class_criteria(grades, options)
    total = total_of(criteria)
    title = options.item.strip() or grades[0].assignment
    return {
        "displayName": title,
        "description": {"content": title},
        "levels": [
            {"displayName": f"{share:g} %", "description": {"content": ""}, "grading": {"maxPoints": share}}
            for share in _SHARES
        ],
        "qualities": [
            {
                "description": {"content": each.name},
                "criteria": [
                    {"description": {"content": f"{number(each.max_points * share / 100.0)}"}}
                    for share in _SHARES
                ],
                "weight": 100.0 * each.max_points / total,
            }
            for each in criteria
        ],
        "grading": {},
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


def _graph_outcomes(
    grade: Grade, marks: Mapping[str, Mark], levels: Mapping[str, float], score: float
) -> dict[str, dict[str, Any]]:
    """The bodies of a student's three outcomes."""
    nearest = {
        quality: min(levels, key=lambda level: abs(levels[level] - mark.points / mark.max_points))
        for quality, mark in marks.items()
    }
    said = {
        quality: f"{number(mark.points)} / {number(mark.max_points)}. {mark.remark}"
        for quality, mark in marks.items()
    }
    return {
        "rubric": {
            "rubricQualityFeedback": [
                {"qualityId": quality, "feedback": {"content": text}} for quality, text in said.items()
            ],
            "rubricQualitySelectedLevels": [
                {"qualityId": quality, "columnId": level} for quality, level in nearest.items()
            ],
        },
        "points": {"points": {"points": round(score, 5)}},
        "feedback": {"feedback": {"text": {"content": plain_comment(grade)}}},
    }
