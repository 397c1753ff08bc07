"""A folder of submissions: survey, owners, marking in parallel, results. One bad file stops nothing."""

import hashlib
import multiprocessing
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from concurrent.futures.process import BrokenProcessPool
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from pydantic import ValidationError

from grader import __version__
from grader.documents import ReportDocument, ResultsDocument, UnmatchedDocument
from grader.exports import write_summary
from grader.feedback import Level, write_feedback, write_index
from grader.files import make_folder, write_whole
from grader.folder import submissions
from grader.judging import unjudged_report
from grader.measurements import names_of
from grader.ownership import Unmatched, assign_pages
from grader.pipeline import Work, mark
from grader.records import Problem
from grader.roster import Roster, read_roster
from grader.rubric import RubricFile
from grader.survey import Survey, survey
from grader.works import works_of
from reference.assignment import Assignment, Variant
from reference.errors import CallError, PlanmarkError

Result = TypeVar("Result")
KEYS_FOLDER = ".planmark"
Progress = Callable[[str, int, int], None]
"""Told what is being done, how many are done, and of how many."""


@dataclass(frozen=True, slots=True)
class Batch:
    """What to grade, and how.

    Attributes
    ----------
    folder, out : where the submissions are, and where results go
    roster : path of the roster, or None (a `roster.csv` in the folder is taken)
    pages_per_student : pages of each student in one class file, blank ones not counted
    jobs : processes
    lang, level : of feedback, where the roster does not say
    """

    assignment: Assignment
    rubric: RubricFile
    folder: Path
    out: Path
    roster: Path | None = None
    pages_per_student: int | None = None
    jobs: int = 1
    lang: str = "en"
    level: Level = "full"


def grade(batch: Batch, progress: Progress) -> ResultsDocument:
    """Grade all that was handed in, and write the reports, pages and results.

    Raises CallError for a folder that is not there or holds nothing, AuthoredFileError for a roster
    with faults, OutputError where results cannot be written.
    """
    roster = _roster(batch)
    files = _files(batch)
    surveys = _surveys(batch, files, progress)
    works, unmatched = _works(batch, roster, files, surveys)
    if not works and not unmatched:
        raise CallError("nothing_to_grade", f"{batch.folder}: there is nothing to grade in this folder")
    make_folder(batch.out)
    reports = _marked(batch, works, progress)
    results = ResultsDocument(assignment=batch.assignment.id, reports=reports, unmatched=unmatched)
    _write_results(batch, results, works)
    return results


def needs_person(results: ResultsDocument) -> bool:
    """Whether anything is left for a person."""
    return bool(results.unmatched) or any(report.status != "graded" for report in results.reports)


# What there is ------------------------------------------------------------------------------------


def _roster(batch: Batch) -> Roster | None:
    path = batch.roster or batch.folder / "roster.csv"
    return read_roster(path) if batch.roster is not None or path.is_file() else None


def _files(batch: Batch) -> list[Path]:
    if not batch.folder.is_dir():
        raise CallError("folder_missing", f"{batch.folder}: there is no such folder")
    return submissions(batch.folder, batch.roster, passed_over=(batch.out,))


def _surveys(batch: Batch, files: Sequence[Path], progress: Progress) -> list[Survey]:
    names = names_of(batch.assignment)
    found: dict[int, Survey] = {}
    calls = [(path, path.relative_to(batch.folder).as_posix(), names) for path in files]
    for index, result in _in_parallel(survey, calls, batch.jobs):
        if isinstance(result, Problem):
            told = UnmatchedDocument(file=calls[index][1], code=result.code, message=result.message)
            found[index] = Survey(refused=told)
        else:
            found[index] = result
        progress("looking", len(found), len(calls))
    return [found[index] for index in range(len(files))]


def _works(
    batch: Batch, roster: Roster | None, files: Sequence[Path], surveys: Sequence[Survey]
) -> tuple[list[Work], list[UnmatchedDocument]]:
    """Every student's work, and what is nobody's."""
    sources = [source for one in surveys for source in one.pages]
    measured = [row for one in surveys for row in one.measurements]
    ownership = assign_pages(
        sources,
        roster,
        batch.assignment.id,
        pages_per_student=batch.pages_per_student,
        student_ids=[row.student_id for row in measured if row.student_id],
    )
    paths = {path.relative_to(batch.folder).as_posix(): path for path in files}
    works, strangers = works_of(batch.assignment, roster, ownership, measured, paths, batch.lang)
    broken = {source: why for one in surveys for source, why in one.broken.items()}
    unmatched = [_unmatched(one, broken.get(one.source)) for one in ownership.unmatched]
    told = [
        UnmatchedDocument(file=one.file or "", code=one.code, message=one.message)
        for one in ownership.problems
    ]
    refused = [one.refused for one in surveys if one.refused is not None]
    return works, [*refused, *unmatched, *strangers, *told]


def _unmatched(one: Unmatched, broken: str | None) -> UnmatchedDocument:
    told = one.problem.message if broken is None else f"{one.problem.message}; {broken}"
    return UnmatchedDocument(file=one.source.file, page=one.source.page, code=one.problem.code, message=told)


# Marking ------------------------------------------------------------------------------------------


def _marked(batch: Batch, works: Sequence[Work], progress: Progress) -> list[ReportDocument]:
    """Reports in the order of the works; each with its files written."""
    folders = folders_of(works)
    reports: dict[int, ReportDocument] = {}
    waiting: list[int] = []
    for index, (work, folder) in enumerate(zip(works, folders, strict=True)):
        known = _known(batch, work, folder)
        if known is None:
            waiting.append(index)
        else:
            reports[index] = known
    progress("marking", len(reports), len(works))
    calls = [(batch, works[index], folders[index]) for index in waiting]
    for number, result in _in_parallel(_mark_one, calls, batch.jobs):
        index = waiting[number]
        if isinstance(result, Problem):
            reports[index] = _failed(batch, works[index], folders[index], result)
        else:
            reports[index] = result
        progress("marking", len(reports), len(works))
    return [reports[index] for index in range(len(works))]


def folders_of(works: Iterable[Work]) -> list[str]:
    """Each work's folder below the results: the student's, with several positions one for each."""
    students = [work.student_id for work in works]
    return [
        work.student_id if students.count(work.student_id) == 1 else f"{work.student_id}/{_position(work)}"
        for work in works
    ]


def _position(work: Work) -> str:
    position = None if work.variant is None else work.variant.position
    return "unknown" if position is None else str(position)


def _mark_one(batch: Batch, work: Work, folder: str) -> ReportDocument:
    """Mark one submission and write its files; the report last, so that it stands for all of them."""
    marked = mark(work, batch.assignment, batch.rubric, batch.level)
    where = batch.out / folder
    title = batch.assignment.file.title.in_language(work.lang)
    names = batch.assignment.file.names
    write_feedback(
        marked.report, marked.pictures, where, work.lang, batch.level,
        title=title, student_name=work.name, names=names,
    )  # fmt: skip
    write_whole(where / "report.json", marked.report.model_dump_json(indent=2))
    write_whole(_key_file(batch, folder), _key(batch, work))
    return marked.report


def _failed(batch: Batch, work: Work, folder: str, problem: Problem) -> ReportDocument:
    report = unjudged_report(
        batch.assignment, batch.rubric, work.variant or Variant(), work.student_id, "unreadable",
        problems=(*work.problems, problem),
    )  # fmt: skip
    write_feedback(report, [], batch.out / folder, work.lang, batch.level, student_name=work.name)
    write_whole(batch.out / folder / "report.json", report.model_dump_json(indent=2))
    return report


def _write_results(batch: Batch, results: ResultsDocument, works: Sequence[Work]) -> None:
    write_summary(results, batch.out / "summary.csv")
    names = {work.student_id: work.name for work in works}
    title = batch.assignment.file.title.in_language(batch.lang)
    write_index(results, batch.out, batch.lang, title=title, student_names=names)
    write_whole(batch.out / "results.json", results.model_dump_json(indent=2))


# What need not be done again ----------------------------------------------------------------------


def _key_file(batch: Batch, folder: str) -> Path:
    return batch.out / KEYS_FOLDER / f"{folder.replace('/', '#')}.key"


def _key(batch: Batch, work: Work) -> str:
    """A digest of everything that a report depends on."""
    digest = hashlib.sha256()
    told = replace(work, pages=())
    pages = [(place.name, place.page) for place in work.pages]
    authored = (batch.assignment.file, batch.assignment.mechanism_file, batch.rubric)
    for part in (__version__, told, pages, batch.level, *(model.model_dump_json() for model in authored)):
        digest.update(repr(part).encode())
    for place in work.pages:
        digest.update(hashlib.sha256(place.path.read_bytes()).digest() if place.path.is_file() else b"-")
    return digest.hexdigest()


def _known(batch: Batch, work: Work, folder: str) -> ReportDocument | None:
    """The report of an earlier run over the same inputs, with all its files still there."""
    report, key = batch.out / folder / "report.json", _key_file(batch, folder)
    try:
        if key.read_text(encoding="utf-8") != _key(batch, work):
            return None
        if not (batch.out / folder / "feedback.html").is_file():
            return None
        return ReportDocument.model_validate_json(report.read_bytes())
    except (OSError, UnicodeDecodeError, ValidationError):
        return None


# Processes ----------------------------------------------------------------------------------------


def _in_parallel(
    function: Callable[..., Result], calls: Sequence[tuple[object, ...]], jobs: int
) -> Iterator[tuple[int, Result | Problem]]:
    """Results as they come, each with its index; a failure is a Problem in the place of its result."""
    if jobs <= 1 or len(calls) <= 1:
        for index, call in enumerate(calls):
            yield index, _guarded(function, *call)
        return
    context = multiprocessing.get_context("spawn")
    with ProcessPoolExecutor(min(jobs, len(calls)), mp_context=context, initializer=_one_thread) as pool:
        futures = {pool.submit(_guarded, function, *call): index for index, call in enumerate(calls)}
        for future in as_completed(futures):
            yield futures[future], _outcome(future)


def _outcome(future: Future[Result | Problem]) -> Result | Problem:
    try:
        return future.result()
    except BrokenProcessPool:
        told = "the process that worked on it was ended by the system, most likely for want of memory"
        return Problem("process_ended", f"{told}; grade again with fewer --jobs")


def _guarded(function: Callable[..., Result], *call: object) -> Result | Problem:
    """The function's result, or the Problem that stopped it: one bad file never stops the rest."""
    try:
        return function(*call)
    except PlanmarkError as error:
        return Problem(error.code, error.message)
    except Exception as error:  # noqa: BLE001 - whatever a hostile file brings about stays with that file
        return Problem("internal_error", f"could not be processed ({type(error).__name__}: {error})")


def _one_thread() -> None:
    """The processes share the machine: OpenCV must not start threads of its own in each."""
    import cv2  # noqa: PLC0415 - only in worker processes

    cv2.setNumThreads(1)
