"""Actions of students: check values and photos, see their feedback, hand in, ask for regrading."""

import base64
import contextlib
import hashlib
import re
import secrets
import threading
import time
from collections.abc import Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Annotated, Any, Literal

from fastapi import APIRouter, Depends, Query
from fastapi.responses import FileResponse
from pydantic import BaseModel, ConfigDict, Field
from sqlalchemy import func, select, update
from sqlalchemy.exc import IntegrityError

from grader.documents import ReportDocument
from grader.files import make_folder, result_folders, write_whole
from grader.folder.workers import guarded, result_of
from grader.language import tongue
from grader.lms.export import read_results
from grader.records import Reason, of_error
from grader.review.server import page_file
from grader.scan.decode.limits import InputFile, kind_of, load
from grader.scan.decode.pages import count_pages
from grader.texts.spoken import RefusedError, refusal
from grader.web.guard import forbidden, missing
from grader.web.places import assignment_of
from grader.web.self_check import checked_values, form_of, variant_of
from grader.web.service import FILE_BODY, Call, Called, Key, Route, body_after, moment
from grader.web.store import Attempt, Job, Link, Publication, Regrading, Sheet, columns_of
from reference.authored.assignment import Variant
from reference.errors import InputFileError

router = APIRouter(route_class=Route, prefix="/api/v1", tags=["students"])
Lang = Literal["en", "ro", "ru"]
Number = Annotated[int | None, Query(ge=0, le=1_000_000)]
MOST_CELLS = 400
"""Cells of a form: the largest assignment asks for a hundred and some."""
MOST_WAITING = 200
"""Photos in the queue: at two seconds each the last one would wait for seven minutes."""
MOST_SHEETS = 40
"""Sheets that one student may hand in: ten times a plan of four pages."""
HANDING_IN = threading.Lock()
"""Two sheets sent at once have two names, and count together."""
_ENDINGS = {"jpeg": ".jpg", "png": ".png", "tiff": ".tif", "heic": ".heic", "pdf": ".pdf"}
"""The endings under which the files that a student may send are stored, by kind."""


WITHOUT_NUL = r"^[^\x00]*$"
"""PostgreSQL cannot store NUL."""


class Strict(BaseModel):
    """A body without unknown fields."""

    model_config = ConfigDict(extra="forbid")


class Values(Strict):
    """Values that a student measured: texts by column; blank is not measured."""

    n: int | None = Field(default=None, ge=0, le=1_000_000)
    position: int | None = Field(default=None, ge=0, le=1_000_000)
    cells: dict[Annotated[str, Field(max_length=60)], Annotated[str, Field(max_length=100)]] = Field(
        max_length=MOST_CELLS
    )
    lang: Lang = "en"


class Line(BaseModel):
    """The check of one value; `html` and the sentences are escaped HTML with indices."""

    name: str
    html: str
    result: Literal["right", "off", "open"]
    mark: str
    word: str
    hint: str
    advice: str


class Told(BaseModel):
    """The result of a self-check.

    `fields` says by column what could not be used; `drawing` are SVG elements; `attempts_left` is null
    without a limit.
    """

    lines: list[Line]
    problems: list[str]
    fields: dict[str, str] = {}
    drawing: list[str]
    is_right: bool
    attempts_left: int | None = None


class JobState(BaseModel):
    """A job; `before` are the jobs that come first, `result` is there when its state is ``done``."""

    key: str
    kind: str
    state: Literal["queued", "running", "done", "failed", "cancelled"]
    stage: str
    done: int
    total: int
    before: int
    message: str
    result: dict[str, Any]
    seconds: float | None = None


class Again(Strict):
    """A student's request to look again at a mark."""

    text: str = Field(min_length=1, max_length=2000, pattern=WITHOUT_NUL)
    criterion: str = Field(default="", max_length=80)
    position: int | None = Field(default=None, ge=0, le=1_000_000)


@router.get("/publications/{key}/form")
def form(call: Called, key: Key, lang: Lang = "en") -> dict[str, Any]:
    """Return the form of a self-check: fields, ranges of n and position, the level of its hints."""
    publication = open_for_checks(call, key)
    assignment = assignment_of(call.service.settings.data, publication)
    return {**form_of(assignment, lang), "level": publication.level}


@router.post("/publications/{key}/checks")
def check(call: Called, key: Key, values: Values) -> Told:
    """Check values at once."""
    publication = open_for_checks(call, key)
    call.count("check")
    assignment = assignment_of(call.service.settings.data, publication)
    variant = variant_of(assignment, values.n, values.position)
    left = use_attempt(call, publication, variant)
    asked = (str(assignment.path), variant, values.cells, values.lang, _level(publication))
    call.session.commit()
    told = result_of(call.service.queue.judges, checked_values, *asked)
    return Told(**told, attempts_left=left)


def may_check_photo(call: Called, key: Key) -> Publication:
    """Return the publication, if a photo may be sent to it now, before any of it is read."""
    publication = open_for_checks(call, key)
    call.count("photo")
    waiting = select(func.count()).select_from(Job).where(Job.kind == "photo", Job.state == "queued")
    if (call.session.scalar(waiting) or 0) >= MOST_WAITING:
        raise RefusedError(503, "busy")
    _check_seconds(call, publication)
    call.session.commit()
    return publication


def _sender(call: Call, publication: Publication) -> str:
    """Return who is charged with a file's seconds: a cookie is free, a personal link is one student's."""
    link, visit = call.link(publication), call.visitor.visit
    if call.visitor.account is not None:
        return f"account:{call.visitor.account.id}"
    return f"student:{link.student_id}" if link is not None else f"visit:{visit.id if visit else ''}"


def _check_seconds(call: Call, publication: Publication) -> None:
    """Raise RefusedError where the files of an hour have taken as long as they may.

    Each student by a personal link has an own budget; all without one share that of the class.
    """
    settings, sender = call.service.settings, _sender(call, publication)
    spent = select(func.sum(Job.ended - Job.started)).where(
        Job.kind != "grade", Job.publication_id == publication.id, Job.created > time.time() - 3600.0
    )
    if (call.session.scalar(spent.where(Job.sender == sender)) or 0.0) > settings.sender_seconds:
        raise RefusedError(429, "seconds")
    strangers = spent.where(Job.sender.startswith("visit:"))
    is_stranger = sender.startswith("visit:")
    if is_stranger and (call.session.scalar(strangers) or 0.0) > settings.class_seconds:
        raise RefusedError(429, "seconds", "seconds_of_class")


@router.post("/publications/{key}/photos", status_code=202, openapi_extra=FILE_BODY)
def check_photo(
    call: Called,
    publication: Annotated[Publication, Depends(may_check_photo)],
    body: Annotated[bytes, Depends(body_after(may_check_photo))],
    n: Number = None,
    position: Number = None,
    lang: Lang = "en",
) -> JobState:
    """Check a photo or scan of a sheet; the answer is the job's result."""
    ending = ending_of(body)
    assignment = assignment_of(call.service.settings.data, publication)
    variant = variant_of(assignment, n, position)
    most = call.service.settings.photo_pages
    with trial_of(call, publication, ending, body) as path:
        pages = pages_in(call, publication, path)
        if pages > most:
            raise RefusedError(413, "pages", "pages_of_photo", pages=pages, most=most)
        left = use_attempt(call, publication, variant)
    asked = {
        "file": path.name, "assignment": str(assignment.path), "n": n, "position": position, "lang": lang,
        "level": _level(publication), "attempts_left": left,
    }  # fmt: skip
    visit = call.service.guard.begin(call.session, call.visitor)
    sender = _sender(call, publication)
    job = Job(publication=publication, kind="photo", asked=asked, visit_id=visit.id, sender=sender)
    return queued(call, job)


@router.get("/photos/{job}")
def photo(call: Called, job: Key) -> JobState:
    """Return the progress of the check of a photo, to its sender alone."""
    found = call.session.scalar(select(Job).where(Job.key == job, Job.kind == "photo"))
    if found is None or call.visitor.visit is None or found.visit_id != call.visitor.visit.id:
        raise missing("photo")
    return state_of(call, found)


@router.get("/s/{token}")
def open_link(call: Called, token: str) -> dict[str, str]:
    """Open a personal link: the visit is then the student's, for that publication alone."""
    publication = enter(call, token).publication
    return {"publication": publication.key}


@router.get("/publications/{key}/feedback")
def own_feedback(call: Called, key: Key) -> list[dict[str, Any]]:
    """The student's own reports, once they are released."""
    return [
        {"folder": folder, "report": report.model_dump(mode="json")}
        for folder, report in own_reports(call, released(call, key))
    ]


@router.get("/publications/{key}/feedback/{place}/{name}", response_class=FileResponse)
def own_page(call: Called, key: Key, place: str, name: str) -> FileResponse:
    """A file of the student's own feedback: the page, or a picture; `place` is the position, or ``0``."""
    link = released(call, key)
    top = call.places(link.publication).results
    for number, (folder, report) in enumerate(own_reports(call, link)):
        if place == str(report.position if report.position is not None else number):
            files = {path.name: path for path in (top / folder).iterdir()}
            if name in files and re.fullmatch(r"feedback\.html|overlay(_\d+)?\.png", name):
                return page_file(files[name])
    raise missing()


@router.get("/publications/{key}/regrading")
def own_requests(call: Called, key: Key) -> list[dict[str, Any]]:
    """The student's own requests, with the answers."""
    link = personal(call, call.publication(key))
    asked = select(Regrading).where(
        Regrading.publication_id == link.publication_id, Regrading.student_id == link.student_id
    )
    names = ("criterion", "position", "text", "answer", "created", "answered")
    return [columns_of(one, *names) for one in call.session.scalars(asked.order_by(Regrading.id))]


@router.post("/publications/{key}/regrading", status_code=201)
def ask_again(call: Called, key: Key, request: Again) -> dict[str, str]:
    """Ask for a mark to be looked at again; it waits in the instructor's queue."""
    link = released(call, key)
    call.count("photo")
    fitting = [
        report for _, report in own_reports(call, link)
        if request.position in {None, report.position}
        and (not request.criterion or any(one.id == request.criterion for one in report.criteria))
    ]  # fmt: skip
    if not fitting:
        raise missing("criterion")
    own = {"publication_id": link.publication_id, "student_id": link.student_id}
    call.session.add(Regrading(**own, **request.model_dump()))
    call.note("regrading asked", f"{key} {link.student_id} {request.criterion}")
    return {"state": "waits"}


def may_hand_in(call: Called, key: Key) -> Link:
    """Return the link of a student who may hand in a sheet now, before any of it is read."""
    link = personal(call, call.publication(key))
    if not link.publication.takes_sheets:
        raise forbidden("no_sheets_now")
    if link.publication.is_over:
        raise RefusedError(403, "forbidden", "deadline_over", at=moment(link.publication.deadline or 0.0))
    call.count("photo")
    call.session.commit()
    return link


@router.post("/publications/{key}/sheets", status_code=201, openapi_extra=FILE_BODY)
def hand_in(
    call: Called,
    link: Annotated[Link, Depends(may_hand_in)],
    body: Annotated[bytes, Depends(body_after(may_hand_in))],
    name: Annotated[
        str, Query(max_length=200, pattern=WITHOUT_NUL, description="as the student calls it")
    ] = "",
) -> dict[str, Any]:
    """Hand in a sheet: one more version, stored by its time and content; none is ever replaced."""
    publication = link.publication
    folder, ending = call.places(publication).handed_in, ending_of(body)
    with trial_of(call, publication, ending, body) as trial:
        pages = pages_in(call, publication, trial, name)
        with HANDING_IN:
            check_pages(call, publication, pages, student=link.student_id)
            at = datetime.now(UTC)
            digest = hashlib.sha256(body).hexdigest()[:8]
            file = f"{link.student_id}_sent{at:%Y%m%dT%H%M%S%f}-{digest}{ending}"
            sheet = Sheet(
                publication_id=publication.id, student_id=link.student_id, file=file, shown=name, pages=pages,
                sent=at.timestamp(),
            )  # fmt: skip
            call.session.add(sheet)
            call.session.flush()
            make_folder(folder)
            trial.replace(folder / file)
            call.session.commit()  # the next one counts it
    call.note("handed in", f"{publication.key} {file}")
    return version_of(sheet)


def check_pages(
    call: Call, publication: Publication, pages: int, *, student: str = "", replaced: str = ""
) -> None:
    """Raise RefusedError where a student, or the class, has handed in as much as may be handed in.

    Arguments: `student` is empty for an instructor, `replaced` a file whose pages are so many from now on.
    """
    settings = call.service.settings
    there = {path.name for path in call.places(publication).submitted()} - {replaced}
    sheets = call.session.scalars(select(Sheet).where(Sheet.publication_id == publication.id))
    known = [(one.student_id, one.pages) for one in sheets if one.file in there]
    own = [count for sender, count in known if sender == student]
    left = settings.upload_pages - sum(count for _, count in known)
    if student:
        if len(own) >= MOST_SHEETS:
            raise RefusedError(403, "sheets", count=len(own))
        of_students = sum(count for sender, count in known if sender)
        left = min(left, settings.student_pages - sum(own), settings.class_pages - of_students)
    if pages > left:
        raise RefusedError(403, "pages", pages=pages, left=max(0, left))


@router.get("/publications/{key}/sheets")
def own_sheets(call: Called, key: Key) -> list[dict[str, Any]]:
    """The versions that the student has handed in, in the order of their time."""
    link = personal(call, call.publication(key))
    there = {path.name for path in call.places(link.publication).submitted()}
    own = select(Sheet).where(
        Sheet.publication_id == link.publication_id, Sheet.student_id == link.student_id
    )
    return [version_of(one) for one in call.session.scalars(own.order_by(Sheet.id)) if one.file in there]


def version_of(sheet: Sheet) -> dict[str, Any]:
    """Return a version as pages show it."""
    known = {"file": sheet.file, "name": sheet.shown, "sent": sheet.sent}
    return {**known, "at": moment(sheet.sent), "code": receipt_of(sheet)}


def receipt_of(sheet: Sheet) -> str:
    """Return the code by which the student and the instructor name a version: ``K7MQ-2XA4``."""
    code = base64.b32encode(hashlib.sha256(sheet.file.encode()).digest()).decode()
    return f"{code[:4]}-{code[4:8]}"


# What they share ----------------------------------------------------------------------------------


def open_for_checks(call: Call, key: str) -> Publication:
    """Return a publication that is open for self-checks; to its instructors it always is."""
    publication = call.publication(key)
    if not publication.is_open and not call.visitor.is_member(publication):
        raise forbidden("not_open")
    return publication


def use_attempt(call: Call, publication: Publication, variant: Variant) -> int | None:
    """Count an attempt; return how many are left. Raises RefusedError where there are none."""
    if publication.attempts is None or call.visitor.is_member(publication):
        return None
    link = personal(call, publication)
    who, what = f"student:{link.student_id}", str(variant)[:60]
    own = (Attempt.publication_id == publication.id, Attempt.who == who, Attempt.variant == what)
    if call.session.scalar(select(Attempt.id).where(*own)) is None:
        with contextlib.suppress(IntegrityError), call.session.begin_nested():  # somebody was faster
            call.session.add(Attempt(publication_id=publication.id, who=who, variant=what, count=0))
    # One statement: attempts that are made at once are counted one after the other.
    more = update(Attempt).where(*own, Attempt.count < publication.attempts).values(count=Attempt.count + 1)
    count = call.session.scalar(more.returning(Attempt.count))
    if count is None:
        raise RefusedError(403, "attempts_used", count=publication.attempts)
    return publication.attempts - int(count)


def personal(call: Call, publication: Publication) -> Link:
    """Return the student's personal link. Raises RefusedError for a visitor without a valid one."""
    link = call.link(publication)
    if link is None:
        raise RefusedError(401, "link_needed")
    return link


def released(call: Call, key: str) -> Link:
    """Return the student's personal link. Raises RefusedError where the feedback is not released."""
    link = personal(call, call.publication(key))
    if not link.publication.shows_feedback:
        raise forbidden("not_released")
    return link


def own_reports(call: Call, link: Link) -> list[tuple[str, ReportDocument]]:
    """Return the student's own reports, each with its folder below the results."""
    results = read_results(call.places(link.publication).results)
    folders = result_folders(results.reports)
    return [
        (folder, report)
        for folder, report in zip(folders, results.reports, strict=True)
        if report.student_id == link.student_id
    ]


def enter(call: Call, token: str) -> Link:
    """Open a personal link: the visit is then the student's. Return the link."""
    call.count("key")
    link = call.service.guard.opened(call.session, token)
    call.service.guard.begin(call.session, call.visitor, link=link)
    call.service.guard.set_cookie(call.response, call.visitor)
    return link


def ending_of(body: bytes) -> str:
    """Return the ending of a picture's file, by its first bytes. Raises RefusedError for other files."""
    try:
        return _ENDINGS[kind_of(InputFile("", body, ""))]
    except InputFileError as error:
        raise RefusedError(415, "file_type") from error


def pages_in(call: Call, publication: Publication, path: Path, shown: str = "") -> int:
    """Return the pages of a stored file, called `shown`, counted in a worker in the sender's seconds.

    Raises RefusedError for a damaged one, and for a sender who has none left.
    """
    if path.suffix.lower() not in {".pdf", ".tif", ".tiff"}:
        return 1
    _check_seconds(call, publication)
    sender, now = _sender(call, publication), time.time()
    try:
        pages, seconds = result_of(call.service.queue.workers, counted, path, shown or "the file")
    except InputFileError as error:  # its worker was ended
        pages, seconds = of_error(error), call.service.settings.limits.seconds
    times = {"started": now - seconds, "ended": now}
    call.session.add(Job(publication=publication, kind="count", state="done", sender=sender, **times))
    call.session.commit()
    if isinstance(pages, Reason):
        raise RefusedError(422, pages.code, **dict[str, Any](pages.parameters))
    return pages


def counted(path: Path, shown: str) -> tuple[int | Reason, float]:
    """Return the pages of a file, or why they cannot be counted, and the seconds taken; in a worker."""
    began = time.process_time()
    return guarded(lambda: count_pages(load(path, shown))), time.process_time() - began


@contextlib.contextmanager
def trial_of(call: Call, publication: Publication, ending: str, body: bytes) -> Iterator[Path]:
    """Yield a stored file; it is deleted if what is done with it fails."""
    path = call.places(publication).photos / f"{secrets.token_hex(12)}{ending}"
    try:
        write_whole(path, body)
        yield path
    except BaseException:
        path.unlink(missing_ok=True)
        raise


def queued(call: Call, job: Job) -> JobState:
    """Store a job and let it wait; return its state."""
    call.session.add(job)
    call.session.flush()
    state = state_of(call, job)
    call.service.guard.set_cookie(call.response, call.visitor)
    call.session.commit()
    call.service.queue.put(job)
    return state


def state_of(call: Call, job: Job) -> JobState:
    """Return a job as a page shows it."""
    before = call.service.queue.waiting_before(job) if job.state == "queued" else 0
    told = job.message
    if job.state == "failed":
        code, parameters = job.result["code"], job.result.get("parameters", {})
        told = refusal(Reason(code, {"detail": job.message, **parameters}), tongue(call.lang))
    seconds = None if job.started is None or job.ended is None else round(job.ended - job.started, 2)
    known = columns_of(job, "key", "kind", "state", "stage", "done", "total", "result")
    return JobState(**known, before=before, message=told, seconds=seconds)


def _level(publication: Publication) -> Literal["symbol", "hint"]:
    """Return the level of hints; students are never told the answers."""
    return "symbol" if publication.level == "symbol" else "hint"
