"""Records of a review: students and their requests, what people post, and the decisions in force."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field
from pydantic.dataclasses import dataclass as posted

from grader.documents import CriterionDocument, ReportDocument
from grader.folder.batch import Job
from grader.records import PageRef, ScannedPage
from grader.review.doubts import Doubt
from grader.tables.decisions import Decision, Key
from grader.texts.spoken import RefusedError
from reference.errors import PlanmarkError

OPEN = "review"
Corner = tuple[str, str, tuple[float, float]]
"""A node that a person may move: its name, what people call it, its place on the sheet."""


class ChangedError(PlanmarkError):
    """The question was decided by somebody else (`there`) after it had been shown."""

    exit_status = 1

    def __init__(self, there: Decision | None) -> None:
        super().__init__("decision_clash", "decided by somebody else in the meantime")
        self.there = there


@dataclass(frozen=True, slots=True)
class Request:
    """A student's request to look again at a criterion; `at` in seconds since 1970."""

    text: str
    at: float

    def is_answered(self, row: Decision | None) -> bool:
        """Return whether a row was decided after the request."""
        return row is not None and seconds_of(row) > self.at


def seconds_of(row: Decision) -> float:
    """Return when a row was decided, seconds since 1970; -inf for no time: people write this file, too."""
    try:
        return datetime.fromisoformat(row.at).timestamp()
    except ValueError:
        return -math.inf


@dataclass(slots=True)
class Student:
    """One submission under review; `number` is its place in the class, from 0."""

    number: int
    job: Job
    report: ReportDocument
    name: str
    version: int = 0
    pages: list[ScannedPage] | None = None
    requests: Mapping[str, Request] = field(default_factory=dict)
    """By criterion."""
    doubts: tuple[int, list[Doubt]] | None = None
    """The open questions, and the version of the student that they are of."""
    place: int = 0
    """The person's place in the class, from 0, the same at all positions: a class is shared by it."""

    @property
    def key(self) -> str:
        """The name used between page and server; it stays when others come to the class."""
        return self.job.folder

    def criterion(self, name: str) -> CriterionDocument:
        """Return a criterion by its id. Raises RefusedError."""
        for criterion in self.report.criteria:
            if criterion.id == name:
                return criterion
        raise RefusedError(400, "criterion_unknown", student=self.job.folder, name=name)


class Said(BaseModel):
    """The fields of every post: who decides, and in which window."""

    model_config = ConfigDict(extra="forbid", strict=True)

    by: str = ""
    window: str = ""


MOST_POINTS = 250
"""Points of a stroke: as many as a cell of the file holds."""
Coordinate = Annotated[float, Field(ge=0.0, le=9999.0)]
Place = Annotated[tuple[Coordinate, Coordinate], Field(strict=False)]
Points = Annotated[float, Field(gt=-1e5, lt=1e5, allow_inf_nan=False)] | None
"""Points of a criterion; None where the rubric's share counts."""


@posted(config=Said.model_config, frozen=True, slots=True)
class Answer:
    """A person's decision on one criterion.

    Attributes
    ----------
    student : the key
    criterion, verdict : ``node:FIGURE:NODE`` with ``x,y`` in sheet mm puts a node somewhere else,
        ``audit:CRITERION`` with an answer of the audit checks a settled verdict
    seen : `mark_of` what stood decided when the question was shown
    """

    student: str
    criterion: str
    verdict: str
    comment: str = ""
    seen: str = ""
    points: Points = None


class Kept(Said):
    """A comment kept for reuse, and what it is to be for all who have it.

    Attributes
    ----------
    criterion, verdict, points, comment : what decisions have in common that use it
    students : the keys of those whom the person was shown
    words, worth : the new comment and points
    """

    criterion: str
    verdict: str
    comment: str
    points: Points = None
    students: list[str]
    words: str = ""
    worth: Points = None


class Drawn(Said):
    """Strokes of ink on a student's page, points in sheet mm; none takes the ink of the page away."""

    student: str
    sheet: Annotated[int, Field(ge=0)]
    strokes: list[Annotated[list[Place], Field(min_length=2, max_length=MOST_POINTS)]]


class Whole(Said):
    """A person's remarks on a whole submission: a comment, points added, the marks of what stood there."""

    student: str
    comment: str = ""
    added: Annotated[float, Field(gt=-1e5, lt=1e5, allow_inf_nan=False)] = 0.0
    seen: Annotated[tuple[str, str], Field(strict=False)] = ("", "")


@dataclass(frozen=True, slots=True)
class Change:
    """Rows that were written, and those that they stand in the place of."""

    written: tuple[Decision, ...]
    before: tuple[Decision, ...]


class Standing:
    """The decisions in force, by their subject."""

    def __init__(self, rows: Sequence[Decision]) -> None:
        self.rows = {row.key: row for row in rows}

    def key(self, student: Student, criterion: str) -> Key:
        """The subject of a row on a student's criterion; people may leave the position blank."""
        report = student.report
        blank = (report.student_id, None, criterion)
        return blank if blank in self.rows else (report.student_id, report.position, criterion)

    def of(self, student: Student, criterion: str) -> Decision | None:
        """The row on a student's criterion."""
        return self.rows.get(self.key(student, criterion))


def page_criterion(ref: PageRef) -> str:
    """Return the name of a page in decisions."""
    return f"page:{ref.file}#{ref.page}"


def mark_of(row: Decision | None) -> str:
    """Return a text by which a decision is recognised; empty if there is none."""
    return "" if row is None else f"{row.at} {row.by} {row.verdict} {row.points} {row.comment}"
