"""Rubrics and students' points as requests to a platform's API: bodies as files, and a plan of the calls.

Each body is held against a model written from the platform's documentation, which the plan names. Nothing is
sent. A rubric that is there already (`--criteria`, the platform's answer) is not made again.

Canvas keeps the ids of criteria that it is given (app/models/rubric.rb, `generate_criteria`), so that the
points can follow at once; its answer tells the ids it took.
"""

import math
import re
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Annotated, Any, Literal, Self
from urllib.parse import quote
from xml.etree import ElementTree as ET

from pydantic import Field, model_validator

from grader.lms.grades import Delivery, Grade, Options, in_a_row, ready
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
    Version,
    check_unique,
    class_criteria,
    json_document,
    marks_of,
    plain_comment,
    platform_marks,
    read_answer,
    together,
)
from grader.lms.table import csv_text, match_rows, number
from reference.errors import CallError, lines_of

_ONE = Field(min_length=1)
"""Of an object or a list that is never empty."""

# The plan -----------------------------------------------------------------------------------------


class PlannedCall(Payload):
    """A request: the file of its body lies beside the plan."""

    method: Literal["POST", "PUT", "PATCH"]
    path: Annotated[str, Field(pattern=r"^/[^\s{}]+$")]
    body: Filled
    student_id: str | None = None


class PlanDocument(Payload):
    """The calls in the order in which they are to be made, to the platform's `server`."""

    schema_version: Version = 1
    platform: str
    assignment: str
    server: str
    sources: list[str]
    calls: list[PlannedCall]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((call.body for call in self.calls), "body")
        check_unique((call.path for call in self.calls), "the call")
        return self


@dataclass(slots=True)
class _Plan:
    """Files that are collected for a plan."""

    platform: str
    server: str
    sources: Sequence[str]
    calls: list[dict[str, str | None]] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)

    def add(
        self, call: str, model: type[Payload], body: Mapping[str, Any], what: str, student: str | None = None
    ) -> None:
        """Add a call, as ``POST /path``; `what` names its file, after the student."""
        method, _, path = call.partition(" ")
        name = "-".join(filter(None, (f"{len(self.calls) + 1:03}", student, what))) + ".json"
        self.files[name] = json_document(model, body, f"{name} for {self.platform}").encode()
        self.calls.append({"method": method, "path": path, "body": name, "student_id": student})

    def delivery(self, grades: Sequence[Grade], **more: Any) -> Delivery:  # noqa: ANN401 - fields of a delivery
        """The plan with its files."""
        content = {
            "platform": self.platform,
            "assignment": grades[0].assignment,
            "server": self.server,
            "sources": self.sources,
            "calls": self.calls,
        }
        plan = json_document(PlanDocument, content, "the plan").encode()
        return Delivery({"plan.json": plan, **self.files}, **more)


def _place(options: Options, *names: str) -> list[str]:
    """The platform's numbers of course and assignment, for a path; CallError where one is not given."""
    values = [getattr(options, name) for name in names]
    missing = [f"--{name.replace('_', '-')}" for name, value in zip(names, values, strict=True) if not value]
    if missing:
        raise CallError("place_needed", f"{options.to} needs {' and '.join(missing)}: where the rubric goes")
    return [quote(str(value), safe="") for value in values]


@dataclass(frozen=True, slots=True)
class Submission:
    """A student's submission as the platform names it; `outcomes` are ids by type, of Microsoft's alone."""

    id: str
    user: Mapping[str, str]
    outcomes: Mapping[str, str]


def submissions_in(answer: object) -> Iterator[Submission]:
    """Submissions in a platform's answer, wherever they are nested in it."""
    if isinstance(answer, list):
        for each in answer:
            yield from submissions_in(each)
    if not isinstance(answer, dict):
        return
    number_there = next(
        (answer[key] for key in ("submissionUUID", "submissionUuid", "id") if key in answer), None
    )
    recipient = answer.get("recipient")
    of_recipient = recipient if isinstance(recipient, dict) else {}
    cells = {
        "userId": answer.get("userId") or of_recipient.get("userId"),
        "username": answer.get("username"),
        "email": answer.get("email"),
    }
    user = {kind: cell for kind, cell in cells.items() if isinstance(cell, str) and cell}
    if isinstance(number_there, str) and user:
        outcomes = answer.get("outcomes")
        yield Submission(
            number_there,
            user,
            {
                str(each.get("@odata.type", "")).rpartition(".")[2]: str(each.get("id", ""))
                for each in (outcomes if isinstance(outcomes, list) else [])
                if isinstance(each, dict)
            },
        )
        return
    for inner in answer.values():
        yield from submissions_in(inner)


def _submissions(
    grades: Sequence[Grade], options: Options, ask: str
) -> tuple[dict[str, Submission], dict[str, str]]:
    """The submission of each student, and why others have none; `ask` is the request that lists them.

    Raises CallError for an answer without submissions.
    """
    if options.submissions is None:
        why = f"its submission is not known: ask the platform for {ask} and give the answer (--submissions)"
        return {}, {grade.student_id: why for grade in ready(grades)}
    known = list(submissions_in(read_answer(options.submissions)))
    if not known:
        message = f"{options.submissions}: no submissions are in this answer; ask for {ask}"
        raise CallError("submissions", message)
    students = {**options.people, **{grade.student_id: grade.person for grade in grades}}
    matches = match_rows(
        {row: submission.user for row, submission in enumerate(known)},
        {
            student: (
                ("userId", person.platform_id),
                ("email", person.email),
                ("username", person.username or student),
                ("userId", student),
            )
            for student, person in students.items()
        },
        options.submissions.name,
    )
    graded = {grade.student_id for grade in ready(grades)}
    return (
        {student: known[row] for student, row in matches.rows.items() if student in graded},
        {student: why for student, why in matches.missing.items() if student in graded},
    )


def _marks(grade: Grade, options: Options) -> list[Mark]:
    return together(marks_of(grade), options.combine)


# Canvas ------------------------------------------------------------------------------------------

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

    submission: Annotated[dict[Literal["posted_grade"], Number], _ONE]
    comment: Annotated[dict[Literal["text_comment"], Filled], _ONE]
    rubric_assessment: Annotated[dict[str, CanvasMark], _ONE]

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
    criteria: Annotated[dict[_Index, CanvasCriterion], _ONE]

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
    course, assignment = _place(options, "course_id", "assignment_id")
    plan = _Plan(
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
            (grade, {mark.criterion: mark for mark in _marks(grade, options)}) for grade in ready(grades)
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


# Open edX -----------------------------------------------------------------------------------------

Whole = Annotated[int, Field(ge=0, strict=True)]


class EdxOption(Payload):
    """A level of a criterion."""

    order_num: Whole
    name: Filled
    label: str
    explanation: str
    points: Whole


class EdxCriterion(Payload):
    """A criterion with all points that the class has in it."""

    order_num: Whole
    name: Filled
    label: str
    prompt: str
    feedback: Literal["disabled", "optional", "required"] = "optional"
    options: Annotated[list[EdxOption], Field(min_length=2)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((option.name for option in self.options), "option")
        return self


class EdxRubric(Payload):
    """The rubric's keys of what Studio's editor sends (edx-ora2, xblock/schema.py, EDITOR_UPDATE_SCHEMA)."""

    criteria: Annotated[list[EdxCriterion], _ONE]
    feedback_prompt: str = ""
    feedback_default_text: str = ""


class EdxMark(Payload):
    """The option that a student is given."""

    name: Filled
    feedback: str
    selectedOption: Filled  # noqa: N815 - the platform's own name, here and below


class EdxGrade(Payload):
    """A staff assessment (edx-platform, ora_staff_grader/serializers.py, StaffAssessSerializer)."""

    overallFeedback: str  # noqa: N815
    criteria: Annotated[list[EdxMark], _ONE]


_FACTORS = (1, 2, 4, 5, 10, 20, 25, 50, 100)
"""Of points that are to be whole; finer points than hundredths are rounded, and told."""


def openedx(grades: Sequence[Grade], options: Options) -> Delivery:
    """The rubric as JSON and as OLX, and the staff assessments of the students whose submissions are known.

    Open response assessments take whole points: all are times one number.
    """
    criteria = class_criteria(grades, options)
    marked = {grade.student_id: _marks(grade, options) for grade in ready(grades)}
    given = {each.id: {0.0, each.max_points} for each in criteria}
    for mark in (mark for marks in marked.values() for mark in marks):
        given[mark.criterion].add(mark.points)
    points = [one for each in given.values() for one in each]
    factor = next((one for one in _FACTORS if all(_is_whole(point * one) for point in points)), _FACTORS[-1])
    rubric_body = {
        "criteria": [
            {
                "order_num": at,
                "name": each.id,
                "label": each.titles[0],
                "prompt": each.titles[0],
                "options": [
                    {"order_num": place, "name": number(whole / factor), "label": number(whole / factor),
                     "explanation": "", "points": whole}
                    for place, whole in enumerate(sorted({round(one * factor) for one in given[each.id]}))
                ],
            }
            for at, each in enumerate(criteria)
        ],
    }  # fmt: skip
    plan = _Plan(
        "Open edX",
        "https://courses.example.org",
        [
            "openedx/edx-ora2: openassessment/xblock/schema.py (EDITOR_UPDATE_SCHEMA)",
            "openedx/edx-ora2: openassessment/xblock/xml.py (serialize_rubric)",
            "openedx/edx-platform: lms/djangoapps/ora_staff_grader (urls.py, StaffAssessSerializer)",
        ],
    )
    plan.files["rubric.json"] = json_document(EdxRubric, rubric_body, "rubric.json for Open edX").encode()
    plan.files["rubric.xml"] = _olx(rubric_body)
    known, missing = _submissions(grades, options, "/api/ora_staff_grader/initialize?oraLocation=...")
    (block,) = _place(options, "assignment_id") if known else ("",)
    by_id = {grade.student_id: grade for grade in grades}
    for student, submission in known.items():
        where = f"oraLocation={block}&submissionUUID={quote(submission.id, safe='')}"
        body = {
            "overallFeedback": plain_comment(by_id[student]),
            "criteria": [
                {
                    "name": mark.criterion,
                    "feedback": mark.remark,
                    "selectedOption": number(round(mark.points * factor) / factor),
                }
                for mark in marked[student]
            ],
        }
        base = "/api/ora_staff_grader/submission"
        plan.add(f"POST {base}/lock?{where}", Payload, {}, "lock", student)
        plan.add(f"POST {base}/grade?{where}", EdxGrade, body, "grade", student)
    notes = [
        (
            f"Open edX takes whole points: all are times {factor}, {number(_total(criteria))} become"
            f" {number(factor * _total(criteria))}; the grade is their share and stays the same"
        ),
        "the options are the points that this class has: after a regrade with others put the rubric in again",
    ]
    rough = [
        student
        for student, marks in marked.items()
        if not all(_is_whole(mark.points * factor) for mark in marks)
    ]
    if rough:
        notes.insert(1, f"rounded to hundredths: the points of {in_a_row(rough)}")
    return plan.delivery(grades, unplaced=missing, notes=tuple(notes))


def _is_whole(value: float) -> bool:
    return math.isclose(value, round(value), abs_tol=CLOSE)


def _total(criteria: Iterable[Criterion]) -> float:
    return math.fsum(each.max_points for each in criteria)


def _olx(rubric_body: Mapping[str, Any]) -> bytes:
    """The rubric as it stands in an exported course, to be put into its `openassessment`."""
    root = ET.Element("rubric")
    for criterion in rubric_body["criteria"]:
        element = ET.SubElement(root, "criterion", feedback="optional")
        for name in ("name", "label", "prompt"):
            ET.SubElement(element, name).text = criterion[name]
        for option in criterion["options"]:
            inner = ET.SubElement(element, "option", points=str(option["points"]))
            for name in ("name", "label", "explanation"):
                ET.SubElement(inner, name).text = option[name]
    ET.indent(root)
    return ET.tostring(root, encoding="unicode").encode() + b"\n"


# Google Classroom ---------------------------------------------------------------------------------


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
    course, work = _place(options, "course_id", "assignment_id")
    path = f"/v1/courses/{course}/courseWork/{work}"
    about = "https://developers.google.com/workspace/classroom"
    plan = _Plan(
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
    known, missing = _submissions(grades, options, "courses.courseWork.studentSubmissions.list")
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


# Microsoft ----------------------------------------------------------------------------------------


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
    criteria: list[Annotated[dict[Literal["description"], GraphText], _ONE]]
    weight: Positive


class GraphRubric(Payload):
    """The body of ``POST /education/me/rubrics`` (learn.microsoft.com/graph, educationuser-post-rubrics)."""

    displayName: Filled  # noqa: N815
    description: GraphText
    levels: Annotated[list[GraphLevel], _ONE]
    qualities: Annotated[list[GraphQuality], _ONE]
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
    feedback: Annotated[dict[Literal["text"], GraphText], _ONE]


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
    course, assignment = _place(options, "course_id", "assignment_id")
    base = f"/v1.0/education/classes/{course}/assignments/{assignment}"
    about = "https://learn.microsoft.com/graph/api"
    plan = _Plan(
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
    known, missing = _submissions(grades, options, ask)
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
    total = _total(criteria)
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
