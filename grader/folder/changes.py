"""Changes of a run against the previous one: every student's status and criteria, and why.

Beside the results lies a note of what they came from: digests of assignment, rubric and program, and of
each submission's files and line of the roster. What differs from the note of the run before is the why.
"""

import hashlib
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, TypeAdapter, ValidationError, field_validator

from grader.documents import (
    Cause,
    CriterionMovedDocument,
    MovedDocument,
    ReportDocument,
    ResultsDocument,
    StandingDocument,
    Status,
    Verdict,
)
from grader.files import Stamp, stamp_of, write_whole
from grader.options import ClassOptions
from grader.tables.measurements import StudentSubmission
from grader.texts.spoken import failure
from reference.errors import CallError

Key = tuple[str, int | None]
"""Student and position."""
CACHE_FOLDER = ".planmark"
NOTE = "inputs.json"
STANDINGS = "standings.json"


class EarlierCriterion(BaseModel):
    """A criterion as the run before marked it."""

    id: str
    title: str
    verdict: Verdict
    points: float | None


class EarlierReport(BaseModel):
    """A report of the run before, perhaps of another version: the fields that are compared."""

    student_id: str
    position: int | None
    status: Status
    score: float | None
    score_range: tuple[float, float] | None
    criteria: list[EarlierCriterion]

    @field_validator("criteria", mode="before")
    @classmethod
    def _with_known_verdicts(cls, criteria: list[Any]) -> list[Any]:
        known = get_args(Verdict)
        return [
            criterion for criterion in criteria
            if (criterion["verdict"] if isinstance(criterion, dict) else criterion.verdict) in known
        ]  # fmt: skip


class EarlierResults(BaseModel):
    """The results of the run before: the fields that are compared."""

    assignment: str
    reports: list[EarlierReport]


class StandingsNote(BaseModel):
    """The same of the results that have this stamp."""

    stamp: Stamp | None
    results: EarlierResults | None = None


class Inputs(BaseModel):
    """Digests of what a run's marks came from.

    Attributes
    ----------
    common : by ``assignment``, ``rubric`` and ``program``
    own : by the submission's folder, by ``submission``, ``roster`` and ``decision``
    """

    common: dict[str, str] = {}
    own: dict[str, dict[str, str]] = {}


def inputs_of(
    authored: Mapping[str, str],
    submissions: Mapping[str, StudentSubmission],
    digests: Mapping[str, str],
    decided: Container[tuple[str, int]],
) -> Inputs:
    """Return digests of what a run's marks come from, for the next run to tell what has changed.

    Arguments
    ---------
    authored : texts of the ``assignment``, the ``rubric`` and the version of the ``program``
    submissions : by their folders
    digests : of the files handed in, by their names
    decided : pages, by file and number, of which a person decided something
    """

    def pages_of(submission: StudentSubmission, *, by_person: bool) -> list[object]:
        pages = [page for page in submission.pages if ((page.file, page.page) in decided) is by_person]
        return [
            (page.file, page.page, digests.get(page.file), page.turn_deg, page.corners_px) for page in pages
        ]

    own = {
        folder: {
            "submission": _digest(pages_of(submission, by_person=False), submission.measured),
            "decision": _digest(pages_of(submission, by_person=True), submission.decided, submission.opened),
            "roster": _digest(
                submission.variant, sorted(submission.declared.items()), submission.lang, submission.name
            ),
        }
        for folder, submission in submissions.items()
    }
    return Inputs(common={name: _digest(text) for name, text in authored.items()}, own=own)


def _digest(*parts: object) -> str:
    return hashlib.sha256(repr(parts).encode()).hexdigest()[:16]


# The run before -----------------------------------------------------------------------------------


_NO_RESULTS = (OSError, AttributeError, KeyError, TypeError, ValidationError)


def earlier(results: Path, assignment: str) -> Mapping[Key, EarlierReport] | None:
    """The last run's reports by student and position; None where there was no run of this assignment."""
    try:
        note = StandingsNote.model_validate_json((results.parent / CACHE_FOLDER / STANDINGS).read_bytes())
    except _NO_RESULTS:
        note = StandingsNote(stamp=None)
    try:
        before = note.results
        if before is None or note.stamp != stamp_of(results):
            before = EarlierResults.model_validate_json(results.read_bytes())
    except _NO_RESULTS:
        return None
    if before.assignment != assignment:
        return None
    return {(report.student_id, report.position): report for report in before.reports}


def note_standings(results: Path, document: ResultsDocument) -> None:
    """Leave what the next run needs of the results: those of thousands have hundreds of megabytes."""
    standings = EarlierResults.model_validate(document, from_attributes=True)
    note = StandingsNote(stamp=stamp_of(results), results=standings)
    write_whole(results.parent / CACHE_FOLDER / STANDINGS, note.model_dump_json())


def noted_inputs(folder: Path) -> Inputs:
    """Return what the last run's marks came from; empty where no note can be understood."""
    try:
        return Inputs.model_validate_json((folder / NOTE).read_bytes())
    except (OSError, ValidationError):
        return Inputs()


def note_inputs(folder: Path, inputs: Inputs) -> None:
    """Leave a note for the next run."""
    write_whole(folder / NOTE, inputs.model_dump_json())


# What was run -------------------------------------------------------------------------------------

RUN_NOTE = "run.json"


@dataclass(frozen=True, slots=True)
class RunNote(ClassOptions):
    """The last call of `planmark grade`; all paths absolute.

    Attributes
    ----------
    assignment_id : empty in notes of earlier versions
    was_at : where the results were when the note was written, if they are elsewhere now
    """

    assignment: str
    folder: Path
    out: Path
    assignment_id: str = ""
    was_at: Path | None = None


_NOTE = TypeAdapter(RunNote)


def note_run(note: RunNote, folder: Path) -> None:
    """Leave a note beside the results."""
    write_whole(folder / RUN_NOTE, _NOTE.dump_json(note, indent=1, exclude={"was_at"}))


def noted_run(folder: Path) -> RunNote:
    """The last run whose folder of results this is; of submissions, the last one with results near by.

    Near by is in the folder itself, beside it, beside the folder that it is in, and in the working folder.

    Raises CallError where none is noted, and where the submissions are no longer there.
    """
    if not folder.is_dir():
        raise failure(CallError, "folder_missing", folder=folder)
    own, here = earlier_run(folder), folder.resolve()
    if own is None:
        places = (here, here.parent, here.parent.parent, Path.cwd())
        outs = {path.parents[1] for top in places for path in top.glob(f"*/{CACHE_FOLDER}/{RUN_NOTE}")}
        notes = {out: note for out in outs if (note := earlier_run(out)) is not None and note.folder == here}
        last = max(notes, default=None, key=lambda out: (out / CACHE_FOLDER / RUN_NOTE).stat().st_mtime_ns)
        own = None if last is None else notes[last]
    if own is None:
        raise failure(CallError, "run_unknown", folder=folder)
    if not own.folder.exists():
        raise failure(CallError, "submissions_moved", folder=folder, was=own.folder)
    return own


def earlier_run(out: Path) -> RunNote | None:
    """The last run into a folder of results, which may have been moved since; None where nothing says."""
    try:
        note = _NOTE.validate_json((out / CACHE_FOLDER / RUN_NOTE).read_bytes())
    except (OSError, ValidationError):
        return None
    return replace(note, out=out.resolve(), was_at=note.out)


# Changes ---------------------------------------------------------------------------------------


def changes_since(
    before: Mapping[Key, EarlierReport] | None,
    reports: Sequence[ReportDocument],
    folders: Sequence[str],
    inputs: tuple[Inputs, Inputs],
) -> list[MovedDocument]:
    """The submissions whose status or points changed, new ones and dropped ones; none after a first run.

    Arguments: `folders` are the reports', `inputs` what the last run's and this one's marks came from.
    """
    if before is None:
        return []
    after = {(report.student_id, report.position): report for report in reports}
    folder_of = dict(zip(after, folders, strict=False))
    changes = []
    for key in dict.fromkeys((*after, *before)):
        then, now = before.get(key), after.get(key)
        change = MovedDocument(
            student_id=key[0],
            position=key[1],
            before=None if then is None else StandingDocument.model_validate(then),
            after=None if now is None else StandingDocument.model_validate(now),
            why=_why(then, now, folder_of.get(key, ""), inputs),
            criteria=[] if then is None or now is None else _criteria_changed(then, now),
        )
        if change.before != change.after or change.criteria:
            changes.append(change)
    return changes


def _criteria_changed(then: EarlierReport, now: ReportDocument) -> list[CriterionMovedDocument]:
    """The criteria marked otherwise; none where there was or is nothing to compare."""
    before = {criterion.id: criterion for criterion in then.criteria}
    after = {criterion.id: criterion for criterion in now.criteria}
    if not after or not before:
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
        for name in dict.fromkeys((*after, *before))
        for old, new in [(before.get(name), after.get(name))]
        if old is None or new is None or (old.verdict, old.points) != (new.verdict, new.points)
    ]


def _why(
    then: EarlierReport | None, now: ReportDocument | None, folder: str, inputs: tuple[Inputs, Inputs]
) -> list[Cause]:
    """Return the causes of a change: what differs between the two runs' notes."""
    if then is None:
        return ["new"]
    if now is None:
        return ["gone"]
    last, this = ({**one.common, **one.own.get(folder, {})} for one in inputs)
    return [cause for cause in get_args(Cause) if last.get(cause) and last[cause] != this.get(cause)]
