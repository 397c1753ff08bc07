"""What a run changed against the one before it: every student's standing and criteria, and why.

Beside the results lies a note of what they came from: digests of assignment, rubric and program, and of
each submission's files and line of the roster. What differs from the note of the run before is the why.
"""

import hashlib
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, get_args

from pydantic import ValidationError

from grader.documents import (
    Cause,
    CriterionMovedDocument,
    MovedDocument,
    ReportDocument,
    StandingDocument,
    Verdict,
)
from grader.files import write_whole
from grader.inputs.measurements import StudentSubmission

Key = tuple[str, int | None]
"""Student and position."""
NOTE = "inputs.json"
COMMON = ("assignment", "rubric", "program")
OWN = ("submission", "roster")


@dataclass(frozen=True, slots=True)
class MarkedCriterion:
    """A criterion as it was marked."""

    title: str
    verdict: Verdict
    points: float | None


@dataclass(frozen=True, slots=True)
class Earlier:
    """Where a student stood, and each criterion by its id."""

    standing: StandingDocument
    criteria: Mapping[str, MarkedCriterion]


@dataclass(frozen=True, slots=True)
class Inputs:
    """Digests of what a run's marks came from.

    Attributes
    ----------
    common : by ``assignment``, ``rubric`` and ``program``
    own : by the submission's folder, by ``submission`` and ``roster``
    """

    common: Mapping[str, str] = field(default_factory=dict)
    own: Mapping[str, Mapping[str, str]] = field(default_factory=dict)


def inputs_of(
    authored: Mapping[str, str],
    submissions: Sequence[StudentSubmission],
    folders: Sequence[str],
    digests: Mapping[str, str],
) -> Inputs:
    """What a run's marks come from.

    Arguments
    ---------
    authored : texts of the ``assignment``, the ``rubric`` and the version of the ``program``
    folders : of the submissions
    digests : of the files handed in, by their names
    """
    own = {
        folder: {
            "submission": _digest(
                [(page.file, page.page, digests.get(page.file)) for page in submission.pages],
                submission.measured,
            ),
            "roster": _digest(
                submission.variant, sorted(submission.declared.items()), submission.lang, submission.name
            ),
        }
        for submission, folder in zip(submissions, folders, strict=True)
    }
    return Inputs({name: _digest(text) for name, text in authored.items()}, own)


def _digest(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


# The run before -----------------------------------------------------------------------------------


def earlier(results: Path, assignment: str) -> Mapping[Key, Earlier] | None:
    """Where everybody stood at the end of the last run; None where there was none of this assignment."""
    try:
        told: Any = json.loads(results.read_bytes())
        if told["assignment"] != assignment:
            return None
        return {(one["student_id"], one["position"]): _earlier(one) for one in told["reports"]}
    except (OSError, KeyError, TypeError, ValueError, ValidationError):
        return None


def _earlier(told: Mapping[str, Any]) -> Earlier:
    standing = StandingDocument(status=told["status"], score=told["score"], score_range=told["score_range"])
    criteria = {
        one["id"]: MarkedCriterion(str(one["title"]), one["verdict"], one["points"])
        for one in told["criteria"]
        if one["verdict"] in get_args(Verdict)
    }
    return Earlier(standing, criteria)


def noted_inputs(folder: Path) -> Inputs:
    """What the last run's marks came from; empty where no note can be understood."""
    try:
        told: Any = json.loads((folder / NOTE).read_bytes())
        own = {str(name): {str(k): str(v) for k, v in one.items()} for name, one in told["own"].items()}
        return Inputs({str(name): str(one) for name, one in told["common"].items()}, own)
    except (OSError, KeyError, TypeError, ValueError, AttributeError):
        return Inputs()


def note_inputs(folder: Path, inputs: Inputs) -> None:
    """Leave a note for the next run."""
    write_whole(folder / NOTE, json.dumps({"common": dict(inputs.common), "own": dict(inputs.own)}))


# What moved ---------------------------------------------------------------------------------------


def moved(
    before: Mapping[Key, Earlier] | None,
    reports: Sequence[ReportDocument],
    folders: Sequence[str] = (),
    inputs: tuple[Inputs, Inputs] | None = None,
) -> list[MovedDocument]:
    """Who stands elsewhere than before, who is new and who is gone; nobody after a first run.

    Arguments: `folders` are the reports', `inputs` what the last run's and this one's marks came from.
    """
    if before is None:
        return []
    after = {(one.student_id, one.position): one for one in reports}
    where = dict(zip(after, folders, strict=False))
    found = []
    for key in dict.fromkeys((*after, *before)):
        then, now = before.get(key), after.get(key)
        criteria = _criteria_moved(then, now)
        if then is None or now is None or then.standing != standing(now) or criteria:
            found.append(
                MovedDocument(
                    student_id=key[0],
                    position=key[1],
                    before=None if then is None else then.standing,
                    after=None if now is None else standing(now),
                    why=_why(then, now, where.get(key, ""), inputs),
                    criteria=criteria,
                )
            )
    return found


def _criteria_moved(then: Earlier | None, now: ReportDocument | None) -> list[CriterionMovedDocument]:
    """The criteria marked otherwise; none where there was or is nothing to compare."""
    if then is None or now is None:
        return []
    after = {one.id: MarkedCriterion(one.title, one.verdict, one.points) for one in now.criteria}
    if not after or not then.criteria:
        return []
    return [
        CriterionMovedDocument(
            id=name,
            title=(new or old).title,  # type: ignore[union-attr]
            before=old.verdict if old else None,
            after=new.verdict if new else None,
            points_before=old.points if old else None,
            points_after=new.points if new else None,
        )
        for name in dict.fromkeys((*after, *then.criteria))
        for old, new in [(then.criteria.get(name), after.get(name))]
        if old is None or new is None or (old.verdict, old.points) != (new.verdict, new.points)
    ]


def _why(
    then: Earlier | None, now: ReportDocument | None, folder: str, inputs: tuple[Inputs, Inputs] | None
) -> list[Cause]:
    """What differs between the two runs' notes."""
    if then is None:
        return ["new"]
    if now is None:
        return ["gone"]
    if inputs is None:
        return []
    last, this = inputs
    own = last.own.get(folder, {}), this.own.get(folder, {})
    pairs = [(name, last.common.get(name), this.common.get(name)) for name in COMMON]
    pairs += [(name, own[0].get(name), own[1].get(name)) for name in OWN]
    return [
        cause for cause in get_args(Cause) for name, old, new in pairs if name == cause and old and old != new
    ]


def standing(report: ReportDocument) -> StandingDocument:
    """A report's standing."""
    return StandingDocument(status=report.status, score=report.score, score_range=report.score_range)


def told_standing(one: StandingDocument | None) -> str:
    """A standing in a few words: ``17.5``, ``12..18 needs review``, ``missing``."""
    if one is None:
        return "-"
    words = one.status.replace("_", " ")
    if one.score is not None:
        return f"{one.score:g}" if one.status == "graded" else f"{one.score:g} {words}"
    if one.score_range is not None:
        return f"{one.score_range[0]:g}..{one.score_range[1]:g} {words}"
    return words
