"""A folder of submissions: inventory, owners, marking in parallel, results. One bad file stops nothing."""

import json
import logging
from collections.abc import Iterator, Mapping, Sequence
from contextlib import nullcontext
from dataclasses import KW_ONLY, dataclass, field, replace
from functools import partial
from pathlib import Path
from zipfile import is_zipfile

from pydantic import TypeAdapter, ValidationError

from grader.documents import (
    AlikeDocument,
    LikeDocument,
    ReportDocument,
    ResultsDocument,
    TrustDocument,
    UnmatchedDocument,
)
from grader.feedback.class_page import index_page
from grader.feedback.student_page import About, feedback_page, write_feedback
from grader.files import remove_parts, result_folders, write_parts, write_whole
from grader.folder.archives import is_archive
from grader.folder.cache import (
    MARK_STAGE,
    READ_STAGE,
    SCAN_STAGE,
    PageCache,
    cached_maps,
    cached_reading,
    digest_of,
    stage_digest,
    store_reading,
)
from grader.folder.changes import (
    CACHE_FOLDER,
    RunNote,
    changes_since,
    earlier,
    inputs_of,
    note_inputs,
    note_run,
    note_standings,
    noted_inputs,
    noted_run,
)
from grader.folder.decisions import ClassDecisions, class_decisions, decisions_path
from grader.folder.inventory import FileContent, Progress, natural_key, submissions, take_inventory
from grader.folder.lock import only_run
from grader.folder.submissions import Unusable, submissions_of
from grader.folder.workers import ENDED, Limits, Pool, Whole, Workers
from grader.lms.assessments import rubric_document, write_documents
from grader.lms.table import summary_text
from grader.marking.report import unjudged_report
from grader.marking.trust import opened_in, trust_of
from grader.options import ClassOptions, taken
from grader.overlay.scene import Picture
from grader.owners.pages import Unmatched, assign_pages
from grader.owners.title_block import with_written_numbers, written_owners
from grader.pipeline import mark, read_submission
from grader.records import PageRef, Reason, ScannedPage
from grader.rubric import RubricFile, asked_of, rubric_of
from grader.similarity.groups import by_chance, compared_together, find_similar
from grader.similarity.submission import compared_submission
from grader.tables.measurements import StudentSubmission, names_of
from grader.tables.roster import Roster, read_roster
from grader.texts.spoken import failure, unmatched_document
from reference.authored.assignment import Assignment, Variant, load_assignment
from reference.errors import CallError, PlanmarkError

LOG = logging.getLogger("planmark")
ALIKE_NOTE = "alike.json"
"""The similar sheets, and a digest of what they were found in: every sheet is compared with every other."""
OPENED_NOTE = "opened.json"
_OPENED = TypeAdapter(dict[str, tuple[LikeDocument, ...]])
_PASSING = "file_changed"
"""A problem that the next run need not have: nothing that has it is cached."""


class InterruptedRunError(PlanmarkError):
    """A run was interrupted; what it marked is there."""

    exit_status = 130


@dataclass(frozen=True, slots=True)
class Batch(ClassOptions):
    """A class to grade: its options, its folders, and the means.

    Attributes
    ----------
    folder, out : where the submissions are, and where results go
    jobs, limits : worker processes, and what a file or a sheet may take in one
    growing : files that are still being written: this run passes them over
    called : what people call files that are stored under other names
    addresses : of the review and of the export, on a server
    """

    assignment: Assignment
    rubric: RubricFile
    folder: Path
    out: Path
    _: KW_ONLY
    jobs: int = 1
    limits: Limits = field(default_factory=Limits)
    growing: tuple[Path, ...] = ()
    called: Mapping[Path, str] = field(default_factory=dict)
    addresses: tuple[str, ...] = ()

    @property
    def base(self) -> Path:
        """The folder that the names of the files are below: the one that a single archive lies in."""
        return self.folder if self.folder.is_dir() else self.folder.parent

    @property
    def roster_path(self) -> Path:
        """The path of the roster, whether there is such a file or not."""
        return self.roster or self.base / "roster.csv"

    @property
    def decisions_path(self) -> Path:
        """The path of the decisions, whether there is such a file or not."""
        return self.decisions or decisions_path(self.folder)


@dataclass(frozen=True, slots=True)
class Graded:
    """A class as a run left it.

    Attributes
    ----------
    jobs : in the order of the results' reports
    pages : every page handed in, whoever's it is
    """

    results: ResultsDocument
    jobs: tuple["Job", ...]
    pages: tuple[PageRef, ...]
    cache: PageCache


def grade(batch: Batch, progress: Progress, workers: Pool | None = None) -> ResultsDocument:
    """Grade all that was handed in, and write the reports, pages and results; arguments as of `graded`."""
    return graded(batch, progress, workers).results


def graded(batch: Batch, progress: Progress, workers: Pool | None = None) -> Graded:
    """The class as `grade` leaves it, with what a review needs beside the results.

    Arguments: `workers` are made as the batch says where they are not given.

    Raises CallError for a folder that is not there or holds nothing, AuthoredFileError for a roster
    with faults, InputFileError for a file of decisions that cannot be read, OutputError where results
    cannot be written, InterruptedRunError for an interrupt; as `only_run` for a folder of results that
    another run, or another class, has.
    """
    path = batch.roster_path
    roster = read_roster(path) if batch.roster is not None or path.is_file() else None
    decisions = class_decisions(batch.decisions_path)
    files = files_of(batch)
    if not files and roster is None:
        raise failure(CallError, "nothing_to_grade", folder=batch.folder)
    with only_run(batch.out, batch.folder, batch.assignment.id):
        note_run(_note_of(batch), batch.out / CACHE_FOLDER)
        return _graded(batch, (roster, decisions), files, progress, workers)


def _graded(
    batch: Batch,
    listed: tuple[Roster | None, ClassDecisions],
    files: Sequence[Path],
    progress: Progress,
    workers: Pool | None,
) -> Graded:
    decisions = listed[1]
    notes = batch.out / CACHE_FOLDER
    names, cache = names_of(batch.assignment), _page_cache(batch)
    before = earlier(batch.out / "results.json", batch.assignment.id)
    try:
        with Workers(batch.jobs, batch.limits, __name__) if workers is None else nullcontext(workers) as some:
            pool = Whole(some)
            contents = take_inventory(
                files, batch.base, names, pool, progress, cache, decisions.place, batch.called
            )
            students, unmatched = _submissions(batch, listed, contents, cache, pool)
            if not students and not unmatched:
                raise failure(CallError, "nothing_to_grade", folder=batch.folder)
            jobs, reports, trust = _audited(batch, cache, students, progress, pool)
    except (KeyboardInterrupt, InterruptedRunError):
        remove_parts(batch.out)
        raise
    pages = tuple(page for content in contents for page in content.pages)
    authored = {
        "assignment": repr(_authored(batch.assignment)),
        "rubric": batch.rubric.model_dump_json(),
        "program": stage_digest(MARK_STAGE),
    }
    submitted = {job.folder: job.submission for job in jobs}
    inputs = inputs_of(authored, submitted, {page.file: page.digest for page in pages}, decisions.pages)
    decisions.note_failures(reports)
    results = ResultsDocument(
        assignment=batch.assignment.id,
        titles={one.id: one.title.in_language(batch.lang) for one in batch.rubric.criterion},
        lang=batch.lang,
        rubric=rubric_document(batch.assignment, batch.rubric),
        reports=reports,
        unmatched=[*unmatched, *decisions.problems()],
        moved=changes_since(before, reports, list(submitted), (noted_inputs(notes), inputs)),
        alike=_similar(batch.assignment, jobs, reports, notes),
        stale=sorted(decisions.stale, key=lambda decision: decision.line),
        expected_wrong=_expected_wrong(reports),
        trust=trust,
    )
    _write_results(batch, results, students)
    note_inputs(notes, inputs)
    return Graded(results, tuple(jobs), pages, cache)


def _note_of(batch: Batch) -> RunNote:
    options = taken(ClassOptions, batch)
    options |= {name: path.resolve() for name, path in options.items() if isinstance(path, Path)}
    where = batch.folder.resolve(), batch.out.resolve()
    return RunNote(str(batch.assignment.path), *where, assignment_id=batch.assignment.id, **options)


def noted_batch(folder: Path) -> Batch:
    """The last run whose folder of results, or of submissions, this is.

    Raises CallError where nothing says so, AuthoredFileError for an assignment with faults.
    """
    note = noted_run(folder)
    assignment = load_assignment(note.assignment)
    return Batch(assignment, rubric_of(assignment), note.folder, note.out, **taken(ClassOptions, note))


def _expected_wrong(reports: Sequence[ReportDocument]) -> float:
    """Return the expected number of wrong settled verdicts, by their probabilities."""
    settled = [one for report in reports for one in report.criteria if one.verdict != "review"]
    return round(sum(1.0 - one.probability for one in settled if one.probability is not None), 3)


def needs_person(results: ResultsDocument) -> bool:
    """Return whether anything is left for a person."""
    return bool(results.unmatched or results.stale) or any(
        report.status != "graded" for report in results.reports
    )


# What there is ------------------------------------------------------------------------------------


def files_of(batch: Batch) -> list[Path]:
    """The files handed in, or the archive of them. Raises CallError where there is neither."""
    folder = batch.folder
    if is_archive(folder) and folder.is_file():
        if not is_zipfile(folder):
            raise CallError("archive_damaged", file=str(folder))
        return [folder]
    if not folder.is_dir():
        cause = "archive_missing" if is_archive(folder) else "submissions_missing"
        cause = "submissions_in_file" if folder.is_file() else cause
        raise failure(CallError, "folder_missing", cause, folder=folder, near=folder.parent)
    others = (batch.out, batch.decisions_path, *batch.growing, *batch.assignment.own_files)
    files = submissions(folder, batch.roster, passed_over=others)
    if batch.called:
        files.sort(key=lambda path: natural_key(batch.called.get(path, path.name)))
    return files


def _submissions(
    batch: Batch,
    listed: tuple[Roster | None, ClassDecisions],
    contents: Sequence[FileContent],
    cache: PageCache,
    workers: Pool,
) -> tuple[list[StudentSubmission], list[UnmatchedDocument]]:
    """Every student's submission, and what is nobody's."""
    roster, decisions = listed
    measured = [row for content in contents for row in content.measurements]
    assigned = partial(
        assign_pages,
        [page for content in contents for page in content.pages],
        roster,
        batch.assignment.id,
        pages_per_student=batch.pages_per_student,
        student_ids=[row.student_id for row in measured if row.student_id],
        shared_positions=batch.assignment.shared_positions,
        decided=decisions.owners(roster),
    )
    owners = assigned()
    written = written_owners(owners.unmatched, roster, cache, workers.run)
    owners = assigned(written=written) if written else owners
    refused = [(content.refused, content.students) for content in contents if content.refused is not None]
    unusable = [Unusable((problem,), who) for problem, who in refused]
    students, strangers = submissions_of(
        batch.assignment, roster, owners, measured, batch.lang, refused=unusable
    )
    unmatched = [_unmatched(page) for page in owners.unmatched]
    missing = map(unmatched_document, owners.problems)
    students = with_written_numbers(students, roster, batch.assignment, cache, workers.run)
    students = decisions.give(students, batch.assignment, batch.rubric)
    return students, [
        *(unmatched_document(problem) for problem, _ in refused),
        *unmatched,
        *strangers,
        *missing,
    ]


def _unmatched(page: Unmatched) -> UnmatchedDocument:
    broken = page.source.problem
    problem = page.problem
    if broken is not None:
        problem = replace(problem, parameters={**problem.parameters, "also": broken.code})
    return unmatched_document(replace(problem, file=page.source.file), page.source.page)


# Jobs ---------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Job:
    """One submission to mark.

    Attributes
    ----------
    folder : below the results: the student's, with several positions one for each
    reading_key : a digest of everything that the reading of its pages depends on
    key : a digest of everything that its report depends on
    """

    submission: StudentSubmission
    folder: str
    reading_key: str
    key: str

    @property
    def name(self) -> str:
        """The name of its files in the cache."""
        return self.folder.replace("/", "#")


def _authored(assignment: Assignment) -> tuple[str, str]:
    """The texts of the assignment and its mechanism."""
    return assignment.file.model_dump_json(), assignment.mechanism_file.model_dump_json()


def _similar(
    assignment: Assignment, jobs: Sequence[Job], reports: Sequence[ReportDocument], notes: Path
) -> list[AlikeDocument]:
    """The similar sheets among those that were marked; the last run's where it was the same class."""
    key = digest_of([(job.key, bool(report.criteria)) for job, report in zip(jobs, reports, strict=True)])
    try:
        known, alike = json.loads((notes / ALIKE_NOTE).read_bytes())
        if known == key:
            return [AlikeDocument.model_validate(one) for one in alike]
    except (OSError, TypeError, ValueError):
        pass
    similar = _compared(assignment, jobs, reports, notes / "readings")
    write_whole(notes / ALIKE_NOTE, json.dumps((key, [one.model_dump(mode="json") for one in similar])))
    return similar


def _compared(
    assignment: Assignment, jobs: Sequence[Job], reports: Sequence[ReportDocument], readings: Path
) -> list[AlikeDocument]:
    marked = [
        (job, compared_submission(report, job.submission.variant, job.submission.measured))
        for job, report in zip(jobs, reports, strict=True)
        if job.submission.variant is not None and report.criteria
    ]
    similar: list[AlikeDocument] = []
    for part in compared_together([submission.variant for _, submission in marked]):
        some = [marked[k] for k in part]
        maps = [cached_maps(readings, job.name) for job, _ in some]
        similar += find_similar(assignment, [submission for _, submission in some], maps)
    return sorted(similar, key=by_chance)


# Marking ------------------------------------------------------------------------------------------


def _page_cache(batch: Batch) -> PageCache:
    asked = asked_of(batch.assignment, batch.rubric)
    key = digest_of((stage_digest(SCAN_STAGE), asked.figures, asked.units))
    cells = digest_of((asked.entries, batch.assignment.file.model_dump_json()))
    return PageCache(batch.out / CACHE_FOLDER / "pages", asked, key, cells)


def _jobs(batch: Batch, cache: PageCache, students: Sequence[StudentSubmission]) -> list[Job]:
    """The submissions with digests of what they depend on."""
    assignment = _authored(batch.assignment)
    read = digest_of((stage_digest(READ_STAGE), cache.key, *assignment, cache.asked.vectors))
    settings = (batch.rubric.model_dump_json(), batch.level, batch.with_ghosts)
    marked = digest_of((stage_digest(MARK_STAGE), *assignment, *settings))
    return [
        _job(submission, folder, (read, marked))
        for submission, folder in zip(students, result_folders(students), strict=True)
    ]


def _audited(
    batch: Batch, cache: PageCache, students: Sequence[StudentSubmission], progress: Progress, workers: Pool
) -> tuple[list[Job], list[ReportDocument], TrustDocument | None]:
    """The jobs and their reports, with what an audit of the class opens, and what the audit shows.

    What is opened follows from the reports; that of the last run is noted, so that nothing is marked twice.
    """
    note = batch.out / CACHE_FOLDER / OPENED_NOTE
    opened, folders = _noted_opened(note), result_folders(students)
    for is_last in (False, True):
        students = [
            replace(one, opened=opened.get(folder, ())) for one, folder in zip(students, folders, strict=True)
        ]
        jobs = _jobs(batch, cache, students)
        reports = _marked(batch, cache, jobs, progress, workers)
        trust = trust_of(reports, batch.rubric.doubt.settle)
        found = {
            folder: likes
            for folder, report in zip(folders, reports, strict=True)
            if (likes := opened_in(report, trust))
        }
        if is_last or found == {folder: opened[folder] for folder in folders if folder in opened}:
            break
        opened = found
        write_whole(note, _OPENED.dump_json(opened))
    return jobs, reports, trust


def _noted_opened(note: Path) -> dict[str, tuple[LikeDocument, ...]]:
    """Return what the last run opened, by the submission's folder."""
    try:
        return _OPENED.validate_json(note.read_bytes())
    except (OSError, ValidationError):
        return {}


def _job(submission: StudentSubmission, folder: str, depends: tuple[str, str]) -> Job:
    """A submission's job; `depends` are digests of what all readings, and all marks, depend on."""
    read, marked = depends
    pages = [
        (page.file, page.page, page.digest, page.problem, page.turn_deg, page.corners_px)
        for page in submission.pages
    ]
    declared = (sorted(submission.declared.items()), submission.undeclared)
    reading_key = digest_of((read, submission.variant, declared, pages))
    key = digest_of((marked, reading_key, replace(submission, pages=())))
    return Job(submission, folder, reading_key, key)


def _marked(
    batch: Batch, cache: PageCache, jobs: Sequence[Job], progress: Progress, workers: Pool
) -> list[ReportDocument]:
    """Reports in the order of the jobs; each with its files written."""
    reports = {index: known for index, job in enumerate(jobs) if (known := _known(batch, job)) is not None}
    for index, report in reports.items():
        LOG.debug("%s: %s, as in the last run", jobs[index].folder, report.status)
    progress("marking", len(reports), len(jobs))
    waiting = [(index, job) for index, job in enumerate(jobs) if index not in reports]
    try:
        for index, report in _marked_anew(batch, cache, waiting, workers):
            reports[index] = report
            points = "no score" if report.score is None else f"{report.score:g} of {report.max_score:g}"
            LOG.debug("%s: %s, %s", jobs[index].folder, report.status, points)
            progress("marking", len(reports), len(jobs))
    except KeyboardInterrupt as error:
        counts = {"done": len(reports), "total": len(jobs)}
        raise failure(InterruptedRunError, "interrupted", folder=batch.out, **counts) from error
    return [reports[index] for index in range(len(jobs))]


def _marked_anew(
    batch: Batch, cache: PageCache, jobs: Sequence[tuple[int, Job]], workers: Pool
) -> Iterator[tuple[int, ReportDocument]]:
    """Reports as they come, with the jobs' numbers.

    A job that ended its worker is marked without the pages that do so alone.
    """
    ended: list[tuple[int, Job, Reason]] = []
    sheets = [len(job.submission.pages) for _, job in jobs]
    for number, result in workers.run(_mark_one, [(batch, cache, job) for _, job in jobs], sheets):
        index, job = jobs[number]
        if not isinstance(result, Reason):
            yield index, result
        elif result.code in ENDED and job.submission.pages:
            ended.append((index, job, result))
        else:
            yield index, _failed(batch, job, result)
    again = [(batch, cache, _without(job, problem, batch, cache, workers)) for _, job, problem in ended]
    for number, result in workers.run(_mark_one, again):
        index, job, problem = ended[number]
        yield index, _failed(batch, job, problem) if isinstance(result, Reason) else result


def _without(job: Job, problem: Reason, batch: Batch, cache: PageCache, workers: Pool) -> Job:
    """The job with the problem at those of its pages that end a worker alone."""
    pages = job.submission.pages
    calls = [(batch, cache, replace(job.submission, pages=(page,), measured=None)) for page in pages]
    alone = dict(workers.run(_read_only, calls)) if len(pages) > 1 else {0: problem}
    marked = tuple(
        replace(page, problem=replace(result, file=page.file)) if isinstance(result, Reason) else page
        for page, result in ((page, alone[index]) for index, page in enumerate(pages))
    )
    return _job(replace(job.submission, pages=marked), job.folder, (job.reading_key, job.key))


def _read_only(batch: Batch, cache: PageCache, submission: StudentSubmission) -> None:
    _read(batch, cache, submission)


def _read(batch: Batch, cache: PageCache, submission: StudentSubmission) -> list[ScannedPage]:
    """A submission's pages as scanned, with what was drawn on them."""
    pages = [cache.page(ref) for ref in submission.pages]
    return read_submission(submission, pages, batch.assignment, cache.asked)


def _mark_one(batch: Batch, cache: PageCache, job: Job) -> ReportDocument:
    """Mark one submission and write its files; its key last, so that it stands for all of them."""
    pages = pages_read(batch, cache, job)
    report, painted = mark(job.submission, pages, batch.assignment, batch.rubric, batch.level)
    _write_report(batch, job, report, painted(batch.level if batch.with_ghosts else "hint"))
    if not any(problem.code == _PASSING for problem in report.problems):
        write_whole(_key_file(batch, job), job.key)
    return report


def pages_read(batch: Batch, cache: PageCache, job: Job) -> list[ScannedPage]:
    """The pages as read by an earlier run, else now."""
    folder = batch.out / CACHE_FOLDER / "readings"
    known = cached_reading(folder, job.name, job.reading_key, cache)
    if known is not None:
        return known
    pages = _read(batch, cache, job.submission)
    if pages and not any(problem.code == _PASSING for page in pages for problem in page.problems):
        store_reading(folder, job.name, job.reading_key, pages, cache)
    return pages


def _failed(batch: Batch, job: Job, problem: Reason) -> ReportDocument:
    submission = job.submission
    report = unjudged_report(
        batch.assignment, batch.rubric, submission.variant or Variant(), submission.student_id, "unreadable",
        problems=(*submission.problems, problem),
    )  # fmt: skip
    _write_report(batch, job, report, [])
    return report


def _write_report(batch: Batch, job: Job, report: ReportDocument, pictures: Sequence[Picture]) -> None:
    """Write the page and the report of a submission."""
    submission, where = job.submission, batch.out / job.folder
    title = batch.assignment.file.title.in_language(submission.lang)
    about = About(title, submission.name, batch.assignment.names)
    page = feedback_page(report, pictures, submission.lang, batch.level, about)
    write_feedback(page, pictures, where)
    write_whole(where / "report.json", report.model_dump_json(indent=2))


def _write_results(batch: Batch, results: ResultsDocument, students: Sequence[StudentSubmission]) -> None:
    write_whole(batch.out / "summary.csv", summary_text(results))
    write_documents(batch.out, results)
    names = {submission.student_id: submission.name for submission in students}
    title = batch.assignment.file.title.in_language(batch.lang)
    page = index_page(
        results, batch.lang, title=title, student_names=names, out=str(batch.out), addresses=batch.addresses
    )
    write_whole(batch.out / "index.html", page)
    write_parts(batch.out / "results.json", _results_text(batch.out, results))
    note_standings(batch.out / "results.json", results)


def _results_text(out: Path, results: ResultsDocument) -> Iterator[str]:
    """The results as JSON, part after part: their reports are those in the files."""
    none = '\n  "reports": []'
    head, _, tail = results.model_copy(update={"reports": []}).model_dump_json(indent=2).partition(none)
    folders = result_folders(results.reports)
    yield head + none[:-1]
    for index, folder in enumerate(folders):
        text = (out / folder / "report.json").read_text(encoding="utf-8")
        yield (",\n    " if index else "\n    ") + text.replace("\n", "\n    ")
    yield ("\n  ]" if folders else "]") + tail


# What need not be done again ----------------------------------------------------------------------


def _key_file(batch: Batch, job: Job) -> Path:
    return batch.out / CACHE_FOLDER / f"{job.name}.key"


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
