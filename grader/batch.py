"""A folder of submissions: survey, owners, marking in parallel, results. One bad file stops nothing."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path

from pydantic import ValidationError

from grader.documents import ReportDocument, ResultsDocument, UnmatchedDocument
from grader.feedback.class_page import write_index
from grader.feedback.pages import About, write_feedback
from grader.feedback.sentences import Level
from grader.files import make_folder, write_whole
from grader.folder import submissions, told_name
from grader.jobs import Job, folders_of, inputs_of_run, similar_of_run
from grader.kept import digest_of, keep_looked, keep_maps, kept_looked
from grader.lms.table import write_summary
from grader.measurements import names_of
from grader.moved import earlier, moved, note_inputs, noted_inputs
from grader.ownership import Unmatched, assign_pages
from grader.pipeline import Looked, Work, asked_of, look, mark_looked
from grader.records import Problem
from grader.reports import unjudged_report
from grader.roster import Roster, read_roster
from grader.rubric import RubricFile
from grader.survey import Progress, Survey, survey_folder
from grader.workers import ENDED, Limits, Pool, Workers
from grader.works import Unusable, works_of
from reference.assignment import Assignment, Variant
from reference.errors import CallError, PlanmarkError

KEPT_FOLDER = ".planmark"
_PASSING = "file_changed"
"""A problem that the next run need not have: nothing that has it is cached."""


class InterruptedRunError(PlanmarkError):
    """A run was interrupted; what it marked is there."""

    exit_status = 130


@dataclass(frozen=True, slots=True)
class Batch:
    """What to grade, and how.

    Attributes
    ----------
    folder, out : where the submissions are, and where results go
    roster : path of the roster, or None (a `roster.csv` in the folder is taken)
    pages_per_student : pages of each student in one class file, blank ones not counted
    jobs, limits : worker processes, and what a file or a sheet may take in one
    lang, level : of feedback, where the roster does not say
    with_ghosts : whether pictures show expected vectors beside wrong ones, at level `full`
    """

    assignment: Assignment
    rubric: RubricFile
    folder: Path
    out: Path
    roster: Path | None = None
    pages_per_student: int | None = None
    jobs: int = 1
    limits: Limits = field(default_factory=Limits)
    lang: str = "en"
    level: Level = "full"
    with_ghosts: bool = True


def grade(batch: Batch, progress: Progress, workers: Pool | None = None) -> ResultsDocument:
    """Grade all that was handed in, and write the reports, pages and results.

    Arguments: `workers` are made as the batch says where they are not given.

    Raises CallError for a folder that is not there or holds nothing, AuthoredFileError for a roster
    with faults, OutputError where results cannot be written, InterruptedRunError for an interrupt.
    """
    roster = _roster(batch)
    files = _files(batch)
    if not files and roster is None:
        raise _nothing(batch)
    make_folder(batch.out)
    if workers is not None:
        return _graded(batch, roster, files, progress, workers)
    with Workers(batch.jobs, batch.limits, __name__) as pool:
        return _graded(batch, roster, files, progress, pool)


def _graded(
    batch: Batch, roster: Roster | None, files: Sequence[Path], progress: Progress, workers: Pool
) -> ResultsDocument:
    notes = batch.out / KEPT_FOLDER
    names = names_of(batch.assignment)
    surveys = survey_folder(files, batch.folder, names, workers, progress, notes / "surveys")
    works, unmatched = _works(batch, roster, files, surveys)
    if not works and not unmatched:
        raise _nothing(batch)
    before = earlier(batch.out / "results.json", batch.assignment.id)
    jobs = _jobs(batch, works)
    reports = _marked(batch, jobs, progress, workers)
    inputs = inputs_of_run(batch.assignment, batch.rubric, jobs, surveys)
    results = ResultsDocument(
        assignment=batch.assignment.id,
        reports=reports,
        unmatched=unmatched,
        moved=moved(before, reports, [job.folder for job in jobs], (noted_inputs(notes), inputs)),
        alike=similar_of_run(batch.assignment, jobs, reports, notes / "readings"),
    )
    _write_results(batch, results, works)
    note_inputs(notes, inputs)
    return results


def _nothing(batch: Batch) -> CallError:
    return CallError("nothing_to_grade", f"{batch.folder}: there is nothing to grade in this folder")


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
    paths = {told_name(path, batch.folder): path for path in files}
    refused = [(survey.refused, survey.students) for survey in surveys if survey.refused is not None]
    unusable = [Unusable((Problem(file.code, file.message, file.file),), who) for file, who in refused]
    works, strangers = works_of(
        batch.assignment, roster, ownership, measured, paths, batch.lang, refused=unusable
    )
    unmatched = [_unmatched(one) for one in ownership.unmatched]
    told = [
        UnmatchedDocument(file=one.file or "", code=one.code, message=one.message)
        for one in ownership.problems
    ]
    return works, [*(file for file, _ in refused), *unmatched, *strangers, *told]


def _unmatched(one: Unmatched) -> UnmatchedDocument:
    broken = one.source.problem
    message = one.problem.message if broken is None else f"{one.problem.message}; {broken.message}"
    return UnmatchedDocument(
        file=one.source.file, page=one.source.page, code=one.problem.code, message=message
    )


# Marking ------------------------------------------------------------------------------------------


def _jobs(batch: Batch, works: Sequence[Work]) -> list[Job]:
    """The works with digests of what they depend on."""
    assignment = (batch.assignment.file.model_dump_json(), batch.assignment.mechanism_file.model_dump_json())
    read = digest_of((*assignment, *asked_of(batch.assignment, batch.rubric)))
    marked = digest_of((*assignment, batch.rubric.model_dump_json(), batch.level, batch.with_ghosts))
    return [_job(work, folder, (read, marked)) for work, folder in zip(works, folders_of(works), strict=True)]


def _job(work: Work, folder: str, depends: tuple[str, str]) -> Job:
    """A submission's job; `depends` are digests of what all readings, and all marks, depend on."""
    read, marked = depends
    pages = [(place.name, place.page, place.digest, place.problem) for place in work.pages]
    reading_key = digest_of((read, work.student_id, work.variant, sorted(work.declared.items()), pages))
    key = digest_of((marked, reading_key, replace(work, pages=())))
    return Job(work, folder, reading_key, key)


def _marked(batch: Batch, jobs: Sequence[Job], progress: Progress, workers: Pool) -> list[ReportDocument]:
    """Reports in the order of the jobs; each with its files written."""
    reports = {index: known for index, job in enumerate(jobs) if (known := _known(batch, job)) is not None}
    progress("marking", len(reports), len(jobs))
    waiting = [(index, job) for index, job in enumerate(jobs) if index not in reports]
    try:
        for index, report in _marked_anew(batch, waiting, workers):
            reports[index] = report
            progress("marking", len(reports), len(jobs))
    except KeyboardInterrupt as error:
        kept = f"{len(reports)} of {len(jobs)} submissions are marked and kept in {batch.out}"
        raise InterruptedRunError("interrupted", f"interrupted; {kept}; the same command goes on") from error
    return [reports[index] for index in range(len(jobs))]


def _marked_anew(
    batch: Batch, jobs: Sequence[tuple[int, Job]], workers: Pool
) -> Iterator[tuple[int, ReportDocument]]:
    """Reports as they come, with the jobs' numbers.

    A job that ended its worker is marked without the pages that do so alone.
    """
    ended: list[tuple[int, Job, Problem]] = []
    sheets = [len(job.work.pages) for _, job in jobs]
    for number, result in workers.run(_mark_one, [(batch, job) for _, job in jobs], sheets):
        index, job = jobs[number]
        if not isinstance(result, Problem):
            yield index, result
        elif result.code in ENDED and job.work.pages:
            ended.append((index, job, result))
        else:
            yield index, _failed(batch, job, result)
    again = [(batch, _without(job, problem, batch, workers)) for _, job, problem in ended]
    for number, result in workers.run(_mark_one, again):
        index, job, problem = ended[number]
        yield index, _failed(batch, job, problem) if isinstance(result, Problem) else result


def _without(job: Job, problem: Problem, batch: Batch, workers: Pool) -> Job:
    """The job with the problem at those of its pages that end a worker alone."""
    pages = job.work.pages
    calls = [(batch, replace(job.work, pages=(page,), measured=None)) for page in pages]
    alone = dict(workers.run(_look_only, calls)) if len(pages) > 1 else {0: problem}
    marked = tuple(
        replace(page, problem=replace(result, file=page.name)) if isinstance(result, Problem) else page
        for page, result in ((page, alone[index]) for index, page in enumerate(pages))
    )
    return _job(replace(job.work, pages=marked), job.folder, (job.reading_key, job.key))


def _look_only(batch: Batch, work: Work) -> None:
    look(work, batch.assignment, batch.rubric)


def _mark_one(batch: Batch, job: Job) -> ReportDocument:
    """Mark one submission and write its files; its key last, so that it stands for all of them."""
    work, where = job.work, batch.out / job.folder
    marked = mark_looked(
        work, batch.assignment, batch.rubric, _looked(batch, job), batch.level, with_ghosts=batch.with_ghosts
    )
    write_feedback(marked.report, marked.pictures, where, work.lang, batch.level, _about(batch, work))
    write_whole(where / "report.json", marked.report.model_dump_json(indent=2))
    if not any(problem.code == _PASSING for problem in marked.report.problems):
        write_whole(_key_file(batch, job), job.key)
    return marked.report


def _about(batch: Batch, work: Work) -> About:
    """How the feedback calls the assignment, the student and the names in it."""
    title = batch.assignment.file.title.in_language(work.lang)
    return About(title, work.name, batch.assignment.file.names)


def _looked(batch: Batch, job: Job) -> Sequence[Looked]:
    """The pages as read by an earlier run, else now."""
    folder = batch.out / KEPT_FOLDER / "readings"
    kept = kept_looked(folder, job.name, job.reading_key)
    if kept is not None:
        return kept
    looked = look(job.work, batch.assignment, batch.rubric)
    passing = any(problem.code == _PASSING for page in looked for problem in page.problems)
    if looked and not passing:
        keep_looked(folder, job.name, job.reading_key, looked)
        keep_maps(folder, job.name, looked)
    return looked


def _failed(batch: Batch, job: Job, problem: Problem) -> ReportDocument:
    work, where = job.work, batch.out / job.folder
    report = unjudged_report(
        batch.assignment, batch.rubric, work.variant or Variant(), work.student_id, "unreadable",
        problems=(*work.problems, problem),
    )  # fmt: skip
    write_feedback(report, [], where, work.lang, batch.level, _about(batch, work))
    write_whole(where / "report.json", report.model_dump_json(indent=2))
    return report


def _write_results(batch: Batch, results: ResultsDocument, works: Sequence[Work]) -> None:
    write_summary(results, batch.out / "summary.csv")
    names = {work.student_id: work.name for work in works}
    title = batch.assignment.file.title.in_language(batch.lang)
    write_index(results, batch.out, batch.lang, title=title, student_names=names)
    write_whole(batch.out / "results.json", results.model_dump_json(indent=2))


# What need not be done again ----------------------------------------------------------------------


def _key_file(batch: Batch, job: Job) -> Path:
    return batch.out / KEPT_FOLDER / f"{job.name}.key"


def _known(batch: Batch, job: Job) -> ReportDocument | None:
    """The report of an earlier run over the same inputs, with all its files still there."""
    where = batch.out / job.folder
    try:
        if _key_file(batch, job).read_text(encoding="utf-8") != job.key:
            return None
        if not (where / "feedback.html").is_file():
            return None
        return ReportDocument.model_validate_json((where / "report.json").read_bytes())
    except (OSError, UnicodeDecodeError, ValidationError):
        return None
