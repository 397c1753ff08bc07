"""A student's score as JSON: Gradescope's `results.json`, and Scores of LTI Advantage.

Gradescope: criteria are test cases. Gradescope guesses a missing status from the points, so each test has
a status. A criterion that was not judged has neither passed nor failed: it is no test, and is named in the
output. Students without a grade have no file.

LTI (Assignment and Grade Services 2.0): a sheet that waits for a person is `PendingManual`, without a
score: anything but `FullyGraded` takes a grade back. Students who have handed in nothing have no Score:
posting a Score would hand in for them.
"""

import math
from collections.abc import Sequence
from typing import Annotated, Literal, Self, get_args

from pydantic import Field, model_validator

from grader.lms.grades import Delivery, Grade, Options, ready
from grader.lms.marks import (
    CLOSE,
    Filled,
    Mark,
    NotNegative,
    Payload,
    Positive,
    Version,
    check_unique,
    json_document,
    marks_of,
    plain_comment,
)
from grader.lms.table import number
from reference.errors import CallError

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
    """The assignment and the student of the results."""

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


def results(grades: Sequence[Grade], options: Options) -> Delivery:
    """A folder for each student with its results.json; raises CallError for an unknown visibility."""
    visibility = options.visibility or "visible"
    known = get_args(Visibility)
    if visibility not in known:
        raise CallError("visibility", f"'{visibility}' is no visibility: choose {', '.join(known)}")
    return Delivery(
        {
            f"{grade.student_id}/results.json": _results(grade, visibility, options).encode()
            for grade in ready(grades)
        }
    )


def _results(grade: Grade, visibility: str, options: Options) -> str:
    parts = len(grade.reports) if options.combine == "mean" else 1
    marks = marks_of(grade)
    judged = [mark for mark in marks if mark.verdict != "not_judged"]
    others = [f"{_name(mark)}: {mark.remark}" for mark in marks if mark.verdict == "not_judged"]
    content = {
        "score": float(number(grade.score or 0.0)),
        "output": "\n".join([plain_comment(grade), *others]),
        "visibility": visibility,
        "tests": [_test(index, mark, parts, visibility) for index, mark in enumerate(judged, start=1)],
        "extra_data": {
            "assignment": grade.assignment,
            "student_id": grade.student_id,
            "max_score": grade.max_score,
        },
    }
    return json_document(GradescopeDocument, content, f"results.json of {grade.student_id}")


def _test(index: int, mark: Mark, parts: int, visibility: str) -> dict[str, object]:
    return {
        "name": _name(mark),
        "number": str(index),
        "score": mark.points / parts,
        "max_score": mark.max_points / parts,
        "status": "passed" if mark.is_full else "failed",
        "output": mark.remark,
        "visibility": visibility,
        "extra_data": {"criterion": mark.criterion, "position": mark.position, "verdict": mark.verdict},
    }


def _name(mark: Mark) -> str:
    where = "" if mark.position is None else f" ({mark.position})"
    return f"{mark.criterion}: {mark.title}{where}"


# LTI ----------------------------------------------------------------------------------------------

_DECIMALS = 5
"""Of a score, as in the tables."""


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


class LtiLineItem(Payload):
    """The line item that the Scores belong to, for a platform that has none yet; it cannot hold a rubric."""

    label: Filled
    scoreMaximum: Positive  # noqa: N815
    resourceId: Filled  # noqa: N815
    tag: Filled


class LtiDocument(Payload):
    """A class's line item and Scores, each to be posted by itself."""

    schema_version: Version = 1
    assignment: str
    lineItem: LtiLineItem | None = None  # noqa: N815
    scores: list[LtiScore]

    @model_validator(mode="after")
    def _is_whole(self) -> Self:
        check_unique((score.userId for score in self.scores), "userId")
        if self.lineItem and {score.scoreMaximum for score in self.scores} - {
            None,
            self.lineItem.scoreMaximum,
        }:
            raise ValueError("a Score has another maximum than the line item")
        return self


def scores(grades: Sequence[Grade], options: Options) -> Delivery:
    """A Score for everybody who has handed in."""
    is_mapped = any(person.platform_id for person in options.people.values())
    missing, posted = {}, []
    for grade in grades:
        user = grade.person.platform_id
        if grade.score is None and all(report.status == "missing" for report in grade.reports):
            continue
        if is_mapped and not user:
            missing[grade.student_id] = "the table of ids (--ids) has no id: the platform's userId"
            continue
        posted.append(
            {
                "userId": user or grade.student_id,
                "timestamp": options.moment.isoformat(timespec="milliseconds"),
                "activityProgress": "Completed",
                **_graded(grade, options),
            }
        )
    notes = []
    if not is_mapped:
        notes.append("userId is the student_id: where the platform knows users otherwise, give --ids")
    if pending := sum("scoreGiven" not in score for score in posted):
        notes.append(f"{pending} of the withheld are told as PendingManual: the platform shows no grade")
    assignment = grades[0].assignment
    line_item = {
        "label": options.item.strip() or assignment,
        "scoreMaximum": options.maximum or grades[0].max_score,
        "resourceId": assignment,
        "tag": "grade",
    }
    content = {"assignment": assignment, "lineItem": line_item, "scores": posted}
    return Delivery(json_document(LtiDocument, content, "the Scores"), unplaced=missing, notes=tuple(notes))


def _graded(grade: Grade, options: Options) -> dict[str, object]:
    if grade.score is None:
        return {"gradingProgress": "PendingManual"}
    return {
        "gradingProgress": "FullyGraded",
        "scoreGiven": round(grade.out_of(options.maximum, rescale=options.rescale), _DECIMALS),
        "scoreMaximum": options.maximum or grade.max_score,
        "comment": plain_comment(grade),
    }
