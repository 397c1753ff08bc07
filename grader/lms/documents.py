"""JSON that learning platforms take, as models: nothing that they do not know, numbers in their ranges.

The platforms themselves check little of it. Texts and limits are those of Moodle 4.5, of Canvas, of
Gradescope's results.json and of LTI Advantage's Assignment and Grade Services 2.0.
"""

import math
from collections.abc import Iterable
from typing import Annotated, Literal, Self

from pydantic import BaseModel, ConfigDict, Field, model_validator

Version = Literal[1]
Filled = Annotated[str, Field(min_length=1)]
Id = Annotated[int, Field(gt=0)]
NotNegative = Annotated[float, Field(ge=0.0)]
Positive = Annotated[float, Field(gt=0.0)]
Number = Annotated[str, Field(pattern=r"^[0-9]+(\.[0-9]{1,5})?$")]
"""Decimal dot, no grouping, no sign."""

CLOSE = 1e-4
"""Sums of points that were told to five decimals agree to this."""


class Payload(BaseModel):
    """A table that a platform takes: frozen, nothing unknown, only finite numbers."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)


def _once(names: Iterable[object], what: str) -> None:
    seen = set()
    for name in names:
        if name in seen:
            raise ValueError(f"{what} {name} stands twice")
        seen.add(name)


# LTI Assignment and Grade Services ----------------------------------------------------------------


class LtiScore(Payload):
    """A Score as it is posted to a line item's `scores`; while a person must look, without a score."""

    userId: Filled  # noqa: N815 - the platform's own names, here and below
    timestamp: Annotated[str, Field(pattern=r"^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d\.\d{3,6}(Z|[+-]\d\d:\d\d)$")]
    """With a fraction of a second and a time zone: platforms refuse a score that is not later than theirs."""
    activityProgress: Literal["Initialized", "Started", "InProgress", "Submitted", "Completed"]  # noqa: N815
    gradingProgress: Literal["FullyGraded", "Pending", "PendingManual", "Failed", "NotReady"]  # noqa: N815
    scoreGiven: NotNegative | None = None  # noqa: N815
    scoreMaximum: Positive | None = None  # noqa: N815
    comment: str | None = None

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if (self.gradingProgress == "FullyGraded") != (self.scoreGiven is not None):
            raise ValueError("scoreGiven goes with FullyGraded, and with nothing else")
        if (self.scoreGiven is None) != (self.scoreMaximum is None):
            raise ValueError("scoreGiven and scoreMaximum go together")
        if self.scoreGiven is not None and self.scoreGiven > (self.scoreMaximum or 0.0):
            raise ValueError(f"scoreGiven {self.scoreGiven:g} is above scoreMaximum {self.scoreMaximum:g}")
        return self


class LtiDocument(Payload):
    """A class's Scores, each to be posted by itself."""

    schema_version: Version = 1
    assignment: str
    scores: list[LtiScore]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        _once((score.userId for score in self.scores), "userId")
        return self


# Gradescope ---------------------------------------------------------------------------------------

Visibility = Literal["hidden", "after_due_date", "visible", "after_published"]
OutputFormat = Literal["text", "html", "simple_format", "md", "ansi"]


class GradescopeCriterion(Payload):
    """What a test stands for."""

    criterion: str
    position: int | None = None
    verdict: str


class GradescopeTest(Payload):
    """A criterion that was judged, as a test case."""

    name: Filled
    number: str
    score: NotNegative
    max_score: Positive
    status: Literal["passed", "failed"]
    output: str
    output_format: OutputFormat = "text"
    visibility: Visibility
    extra_data: GradescopeCriterion

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.score > self.max_score + CLOSE:
            raise ValueError(f"{self.score:g} of {self.max_score:g} points")
        if (self.status == "passed") != math.isclose(self.score, self.max_score, abs_tol=CLOSE):
            raise ValueError(f"'{self.status}' with {self.score:g} of {self.max_score:g} points")
        return self


class GradescopeOrigin(Payload):
    """Whose results they are."""

    schema_version: Version = 1
    assignment: str
    student_id: str
    max_score: Positive


class GradescopeDocument(Payload):
    """A student's `results.json`. The version stands in `extra_data`: Gradescope's own keys are all taken."""

    score: NotNegative
    output: str
    output_format: OutputFormat = "text"
    visibility: Visibility
    stdout_visibility: Visibility = "hidden"
    tests: Annotated[list[GradescopeTest], Field(min_length=1)]
    extra_data: GradescopeOrigin

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.score > self.extra_data.max_score + CLOSE:
            raise ValueError(f"{self.score:g} of {self.extra_data.max_score:g} points")
        total = math.fsum(test.score for test in self.tests)
        is_all = math.isclose(math.fsum(test.max_score for test in self.tests), self.extra_data.max_score)
        # The total is scaled up where criteria were not judged, and are no tests.
        if total > self.score + CLOSE or (is_all and total < self.score - CLOSE):
            raise ValueError(f"the tests give {total:g} points together, the score is {self.score:g}")
        return self


# Criteria of a platform's rubric ------------------------------------------------------------------


class PlatformCriterion(Payload):
    """A criterion, and its number on the platform."""

    criterion: str
    id: Filled
    max_points: Positive


def _check_points(criteria: Iterable[PlatformCriterion], given: Iterable[tuple[str, float]]) -> None:
    """Every criterion once, its points between 0 and its maximum."""
    points = dict(given)
    maxima = {one.id: one.max_points for one in criteria}
    if set(points) != set(maxima):
        raise ValueError(f"criteria {sorted(points)} are filled, {sorted(maxima)} are there")
    for name, value in points.items():
        if value > maxima[name] + CLOSE:
            raise ValueError(f"criterion {name}: {value:g} is above its maximum {maxima[name]:g}")


# Canvas -------------------------------------------------------------------------------------------


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
        _once((one.id for one in self.criteria), "criterion")
        _once((call.path for call in self.calls), "submission")
        if len(self.bulk.body.grade_data) != len(self.calls):
            raise ValueError("the calls and the one call hold different students")
        for call in self.calls:
            given = [(name, mark.points) for name, mark in call.body.rubric_assessment.items()]
            _check_points(self.criteria, given)
            total = math.fsum(points for _, points in given)
            if not math.isclose(total, float(call.body.submission.posted_grade), abs_tol=CLOSE):
                raise ValueError(f"{call.student_id}: the criteria give {total:g} together, not the grade")
        return self


# Moodle -------------------------------------------------------------------------------------------

PlainText = Literal[2]
Html = Literal[1]


class MoodleCriterion(Payload):
    """A criterion of a marking guide."""

    sortorder: Id
    shortname: Annotated[str, Field(min_length=1, max_length=255)]
    description: str
    descriptionformat: PlainText = 2
    descriptionmarkers: str
    descriptionmarkersformat: PlainText = 2
    maxscore: Positive


class MoodleComment(Payload):
    """A frequent comment; Moodle reads the list of them even where it is empty, so there is one."""

    sortorder: Id
    description: Filled
    descriptionformat: PlainText = 2


class MoodleGuide(Payload):
    """A marking guide's content."""

    guide_criteria: Annotated[list[MoodleCriterion], Field(min_length=1)]
    guide_comments: Annotated[list[MoodleComment], Field(min_length=1)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        _once((one.shortname for one in self.guide_criteria), "criterion")
        return self


class MoodleDefinition(Payload):
    """A marking guide ready for use. Who made it when is set by Moodle, but must be in the call."""

    method: Literal["guide"] = "guide"
    name: Filled
    description: str = ""
    descriptionformat: PlainText = 2
    status: Literal[20] = 20
    timecreated: Annotated[int, Field(ge=0)]
    usercreated: Literal[0] = 0
    timemodified: Annotated[int, Field(ge=0)]
    usermodified: Literal[0] = 0
    guide: MoodleGuide


class MoodleArea(Payload):
    """Where the guide belongs."""

    cmid: Id
    contextid: Id
    component: Literal["mod_assign"] = "mod_assign"
    areaname: Literal["submissions"] = "submissions"
    activemethod: Literal["guide"] = "guide"
    definitions: Annotated[list[MoodleDefinition], Field(min_length=1, max_length=1)]


class MoodleAreas(Payload):
    """Arguments of the call."""

    areas: Annotated[list[MoodleArea], Field(min_length=1, max_length=1)]


class MoodleRubricDocument(Payload):
    """The call that makes the rubric a marking guide of an assignment."""

    schema_version: Version = 1
    assignment: str
    wsfunction: Literal["core_grading_save_definitions"] = "core_grading_save_definitions"
    arguments: MoodleAreas


class MoodleFilling(Payload):
    """Points and remark on a criterion."""

    criterionid: Id
    score: NotNegative
    remark: str
    remarkformat: Html = 1


class MoodleFilled(Payload):
    """A criterion filled."""

    criterionid: Id
    fillings: Annotated[list[MoodleFilling], Field(min_length=1, max_length=1)]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        if self.fillings[0].criterionid != self.criterionid:
            raise ValueError(f"criterion {self.criterionid} is filled as {self.fillings[0].criterionid}")
        return self


class MoodleGuideFilled(Payload):
    """A marking guide filled."""

    criteria: list[MoodleFilled]


class MoodleAdvanced(Payload):
    """Advanced grading by marking guide."""

    guide: MoodleGuideFilled


class MoodleGrade(Payload):
    """Arguments of the call.

    `grade` is -1, none: Moodle works it out from the guide, and where the assignment has none it
    must not take points for a grade out of another maximum.
    """

    assignmentid: Id
    userid: Id
    grade: Literal[-1] = -1
    attemptnumber: Literal[-1] = -1
    """The latest."""
    addattempt: Literal[0] = 0
    workflowstate: Literal[""] = ""
    applytoall: Literal[0] = 0
    advancedgradingdata: MoodleAdvanced


class MoodleCall(Payload):
    """One student's call."""

    student_id: str
    wsfunction: Literal["mod_assign_save_grade"] = "mod_assign_save_grade"
    arguments: MoodleGrade


class MoodleMarksDocument(Payload):
    """Points by criterion of a marking guide: a call for each student."""

    schema_version: Version = 1
    assignment: str
    criteria: list[PlatformCriterion]
    calls: list[MoodleCall]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        _once((one.id for one in self.criteria), "criterion")
        _once((call.arguments.userid for call in self.calls), "user")
        for call in self.calls:
            filled = call.arguments.advancedgradingdata.guide.criteria
            _once((one.criterionid for one in filled), "criterion")
            given = [(str(one.criterionid), one.fillings[0].score) for one in filled]
            _check_points(self.criteria, given)
        return self
