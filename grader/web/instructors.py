"""Actions of instructors: publish, upload, grade, release, export, answer, delete."""

import pathlib
import re
import secrets
import shutil
import tempfile
import time
from collections.abc import Mapping
from contextlib import suppress
from functools import lru_cache
from pathlib import PurePath
from types import MappingProxyType
from typing import Annotated, Any

from fastapi import APIRouter, Path, Query
from fastapi.responses import FileResponse, Response
from pydantic import BaseModel, Field
from sqlalchemy import select

from grader.authoring.lint import lint, lint_document
from grader.documents import LintDocument
from grader.feedback.class_statistics import states, waiting
from grader.files import write_whole
from grader.folder.archives import ENDING, unpack
from grader.folder.inventory import FILE_TYPES, MEASUREMENT_TYPES
from grader.folder.workers import result_of
from grader.language import N_, tongue
from grader.lms.export import TARGETS, export, read_results, usual_name
from grader.lms.grades import Delivery, Options, people_of
from grader.lms.table import with_ids
from grader.options import ExportOptions, PublicationOptions, model_of, offered
from grader.records import Reason
from grader.rubric import rubric_of
from grader.tables.roster import read_roster
from grader.texts.spoken import RefusedError, told, told_of
from grader.web.arrived import owners, picture
from grader.web.erase import erase_student
from grader.web.guard import missing
from grader.web.places import (
    AUTHORED,
    Places,
    assignment_of,
    person_name,
    safe_name,
    store,
    stored_name,
)
from grader.web.service import (
    FILE_BODY,
    LARGEST_ROW,
    Body,
    Call,
    Called,
    Files,
    Key,
    Own,
    Route,
    Row,
    moment,
    text_of,
    time_of,
)
from grader.web.store import (
    UNFINISHED,
    Account,
    Audit,
    Job,
    Link,
    LtiActivity,
    Publication,
    Regrading,
    Sheet,
    columns_of,
    digest_of,
    last_job,
    unanswered,
)
from grader.web.students import (
    HANDING_IN,
    WITHOUT_NUL,
    JobState,
    Strict,
    check_pages,
    pages_in,
    queued,
    receipt_of,
    state_of,
    trial_of,
)
from reference.authored.assignment import built_in
from reference.errors import PlanmarkError

router = APIRouter(route_class=Route, prefix="/api/v1", tags=["instructors"])
LONGEST = 400
FileName = Annotated[str, Path(max_length=LONGEST)]
"""As people's systems allow them, with the folders above; see `grader.web.places.person_name`."""
StudentId = Annotated[str, Path(pattern=r"^[A-Za-z0-9._-]{1,80}$")]


# Publications -------------------------------------------------------------------------------------


SETTINGS = tuple(one.name for one, _ in offered(PublicationOptions))
TIMES = {"deadline", "release_at"}
OPEN_ONES = N_("Submissions without a final mark: %(waiting)s; criteria still open: %(open)s.")


class Settings(model_of("Settings", PublicationOptions, Strict, SETTINGS)):  # type: ignore[misc]
    """The settings of a publication; what is left out stays."""


@router.get("/assignments")
def assignments(call: Called) -> list[str]:
    """The built-in assignments."""
    _ = call.account
    return built_in()


@router.get("/publications")
def publications(call: Called) -> list[dict[str, Any]]:
    """The instructor's publications, the newest first."""
    return [facts(one) for one in call.all_own()]


@router.post("/publications", status_code=201)
def publish(call: Called, settings: Settings) -> dict[str, Any]:
    """Create a publication; with a built-in assignment it can be opened at once."""
    publication = Publication(members=[call.account])
    call.session.add(publication)
    call.session.flush()
    change_settings(call, publication, settings)
    call.note("published", publication.key)
    return facts(publication)


@router.get("/publications/{key}")
def publication(call: Called, own: Own) -> dict[str, Any]:
    """A publication: settings, files, roster, the last job, requests that wait."""
    places = call.places(own)
    job = last_job(call.session, own)
    of_own = LtiActivity.publication_id == own.id
    files, students = files_of(call, own, places), students_of(places)
    having = {student for file in files for student in file["students"]}
    return {
        **facts(own),
        "authored": sorted(path.name for path in places.authored.glob("*")),
        "files": files,
        "students": students,
        "missing": [one for one in students if one["student_id"] not in having],
        "job": None if job is None else state_of(call, job).model_dump(),
        "requests": len(unanswered(call.session, own)),
        "has_results": (places.results / "results.json").is_file(),
        "standing": standing_of(places),
        "has_activities": call.session.scalar(select(LtiActivity.id).where(of_own).limit(1)) is not None,
    }


@router.get("/publications/{key}/lint")
def lint_assignment(call: Called, own: Own) -> LintDocument:
    """Run `planmark lint` on the assignment: every variant's figures, and findings."""
    service = call.service
    asked = (service.settings.data, own.key, own.assignment, call.lang)
    return result_of(service.queue.workers, linted, *asked)


@router.patch("/publications/{key}")
def change(call: Called, own: Own, settings: Settings) -> dict[str, Any]:
    """Change settings; the answer to a release has a ``warning`` where a person must still look."""
    change_settings(call, own, settings)
    call.note("changed", f"{own.key} {', '.join(settings.model_fields_set)}")
    told = open_ones(standing_of(call.places(own)), call.lang) if own.is_released else ""
    return {**facts(own), **({"warning": told} if told else {})}


@router.delete("/publications/{key}")
def remove(call: Called, own: Own) -> dict[str, str]:
    """Delete a publication with all that was handed in."""
    _remove(call, own)
    return {"state": "removed"}


@router.delete("/terms/{term}")
def remove_term(
    call: Called, term: Annotated[str, Path(max_length=40, pattern=WITHOUT_NUL)]
) -> dict[str, int]:
    """Delete all publications of a term that are the instructor's own."""
    own = [one for one in call.all_own() if one.term == term]
    if not own:
        raise missing("term")
    for one in own:
        _remove(call, one)
    return {"removed": len(own)}


@router.put("/publications/{key}/members/{number}")
def add_member(call: Called, own: Own, number: Row) -> dict[str, Any]:
    """Let a colleague in."""
    account = call.row(Account, number, "account")
    if account not in own.members:
        own.members.append(account)
    call.note("member added", f"{own.key} {account.name}")
    return facts(own)


@router.delete("/publications/{key}/members/{number}")
def remove_member(call: Called, own: Own, number: Row) -> dict[str, Any]:
    """Let a colleague out; one always stays."""
    left = [one for one in own.members if one.id != number]
    if not left:
        raise RefusedError(409, "last_member")
    own.members = left
    call.note("member removed", f"{own.key} {number}")
    return facts(own)


def change_settings(call: Call, publication: Publication, settings: Settings) -> None:
    """Set what is given. Raises RefusedError, AuthoredFileError for an assignment that cannot be used."""
    given = settings.model_dump(exclude_none=True)
    for name in ("attempts", "pages_per_student"):
        if given.get(name) == 0:
            given[name] = None
    for name in TIMES & given.keys():
        given[name] = time_of(given[name])
    for name, value in given.items():
        setattr(publication, name, value)
    if "assignment" in given or given.get("is_open"):
        data = call.service.settings.data
        result_of(call.service.queue.workers, check_assignment, data, publication.key, publication.assignment)
        if not publication.title:
            title = assignment_of(data, publication).file.title
            publication.title = title.in_language(publication.lang)[:120]


def check_assignment(data: pathlib.Path, key: str, name: str) -> None:
    """Load an assignment and its rubric, in a worker, whose limits bound hostile files."""
    rubric_of(assignment_of(data, Publication(key=key, assignment=name)))


def linted(data: pathlib.Path, key: str, name: str, lang: str) -> LintDocument:
    """Return what `planmark lint` finds, in a worker."""
    assignment = assignment_of(data, Publication(key=key, assignment=name))
    return lint_document(lint(assignment, rubric_of(assignment)), tongue(lang))


def standing_of(places: Places) -> dict[str, Any] | None:
    """Return how a class stands by its results, and whether there are later decisions; None without any.

    ``states`` counts the submissions, of which ``waiting`` wait for a person with ``open`` criteria, whose
    ``titles`` are there by their ids.
    """
    with suppress(OSError, PlanmarkError):  # the class can be graded again
        at = (places.results / "results.json").stat().st_mtime_ns
        decisions = places.handed_in / "decisions.csv"
        return {
            **_standing(places.results, at),
            "is_behind": decisions.is_file() and decisions.stat().st_mtime_ns > at,
        }
    return None


def open_ones(standing: dict[str, Any] | None, lang: str) -> str:
    """Return how much a person must still look at, in words; empty if there is nothing."""
    return tongue(lang).gettext(OPEN_ONES) % standing if standing and standing["waiting"] else ""


@lru_cache(maxsize=64)
def _standing(out: pathlib.Path, _written_ns: int) -> dict[str, Any]:
    results = read_results(out)
    left = waiting(results)
    return {
        "states": {state: count for state, count in states(results).items() if count},
        "unmatched": len(results.unmatched), "waiting": len(left),
        "open": sum(len(one.criteria) for one in left), "titles": results.titles,
    }  # fmt: skip


def facts(publication: Publication) -> dict[str, Any]:
    """A publication's settings."""
    members = [{"id": one.id, "name": one.name} for one in publication.members]
    times = {name: text_of(getattr(publication, name)) for name in TIMES}
    return {**columns_of(publication, "key", *SETTINGS, "created"), **times, "members": members}


def students_of(places: Places) -> list[dict[str, Any]]:
    """Return the students on the roster, each once."""
    names = {row.student_id: row.name for row in places.students()}
    return [{"student_id": student, "name": name} for student, name in names.items()]


def files_of(call: Call, publication: Publication, places: Places) -> list[dict[str, Any]]:
    """The files handed in, with time and students; of a student's version also the student's name of it."""
    sheets = call.session.scalars(select(Sheet).where(Sheet.publication_id == publication.id)).all()
    shown = {one.file: one.shown for one in sheets}
    pages = {one.file: one.pages for one in sheets}
    whose = owners(call.service.settings.data, publication, places, pages)
    return [
        {
            "name": name, "bytes": stat.st_size, "at": stat.st_mtime, "shown": shown.get(path.name, ""),
            "students": whose.get(name, ()), "is_picture": path.suffix.lower() not in MEASUREMENT_TYPES,
        }
        for path, name, stat in ((path, name, path.stat()) for path, name in places.called().items())
    ]  # fmt: skip


def _remove(call: Call, publication: Publication) -> None:
    call.idle(publication)
    places = call.places(publication)
    call.session.delete(publication)
    call.note("publication removed", publication.key)
    call.session.commit()
    places.remove()


# Files --------------------------------------------------------------------------------------------


@router.put("/publications/{key}/assignment/files/{name}", openapi_extra=FILE_BODY)
def put_authored(call: Called, own: Own, name: FileName, body: Body) -> dict[str, Any]:
    """Store a file of the assignment; it is checked when it is chosen."""
    safe = safe_name(name, AUTHORED)
    is_same = store(call.places(own).authored / safe, body, replace=True)
    call.note("assignment file", f"{own.key} {safe}")
    return {"name": safe, "is_same": is_same}


@router.put("/publications/{key}/roster/files/roster.csv", openapi_extra=FILE_BODY)
def put_roster(call: Called, own: Own, body: Body) -> dict[str, Any]:
    """Store the roster, if nothing is wrong with it."""
    with tempfile.TemporaryDirectory() as folder:
        trial = pathlib.Path(folder) / "roster.csv"
        store(trial, body)
        count = len(read_roster(trial, "roster.csv").rows)
    store(call.places(own).roster, body, replace=True)
    call.note("roster", f"{own.key}: {count} lines")
    return {"lines": count}


@router.put("/publications/{key}/files/{name:path}", openapi_extra=FILE_BODY)
def put_file(call: Called, own: Own, name: FileName, body: Body, *, replace: bool = False) -> dict[str, Any]:
    """Store a sheet, a class file or measurements; of a ZIP all files, but those that are `refused`."""
    call.count("upload")
    called = person_name(name, (*FILE_TYPES, ENDING))
    if PurePath(called).suffix.lower() == ENDING:
        answer = _put_archive(call, own, called, body, replace=replace)
    else:
        answer = _put(call, own, called, body, replace=replace)
    call.note("file", f"{own.key} {called}")
    return answer


def _put_archive(call: Call, own: Publication, called: str, body: bytes, *, replace: bool) -> dict[str, Any]:
    files, refused, speaker = list[dict[str, Any]](), list[dict[str, str]](), tongue(call.lang)
    with trial_of(call, own, ENDING, body) as trial, tempfile.TemporaryDirectory(dir=trial.parent) as into:
        for name, file in result_of(call.service.queue.workers, unpack, trial, pathlib.Path(into)):
            try:
                if isinstance(file, Reason) or len(name) > LONGEST:
                    why = file if isinstance(file, Reason) else Reason("archive_name")
                    raise RefusedError(422, why.code, **dict[str, Any](why.parameters))
                content = (pathlib.Path(into) / file).read_bytes()
                files.append(_put(call, own, person_name(name, FILE_TYPES), content, replace=replace))
            except PlanmarkError as error:
                refused.append({"name": name or called, "message": told_of(error, speaker)})
        trial.unlink()
    return {
        "name": called,
        "is_same": all(one["is_same"] for one in files),
        "files": files,
        "refused": refused,
    }


def _put(call: Call, own: Publication, called: str, body: bytes, *, replace: bool) -> dict[str, Any]:
    """Store one file that was handed in."""
    if PurePath(called).name.lower() in {"roster.csv", "decisions.csv"}:
        raise RefusedError(422, "file_name", "file_reserved")
    stored = stored_name(called)
    with trial_of(call, own, PurePath(stored).suffix, body) as trial:
        pages = pages_in(call, own, trial, called)
        with HANDING_IN:
            known = select(Sheet).where(Sheet.publication_id == own.id, Sheet.file == stored)
            sheet = call.session.scalar(known) or Sheet(publication_id=own.id, student_id="", file=stored)
            if sheet.student_id:
                raise RefusedError(409, "file_exists", "file_of_student", name=called)
            check_pages(call, own, pages, replaced=stored)
            is_same = call.places(own).keep(called, body, replace=replace)
            sheet.pages = pages
            call.session.add(sheet)
            call.session.commit()
            trial.unlink()
    return {"name": called, "is_same": is_same}


@router.get("/publications/{key}/receipts")
def find_receipt(
    call: Called, own: Own, code: Annotated[str, Query(max_length=20, description="as on the receipt")]
) -> dict[str, str]:
    """The version that a student's receipt names; its file may have been deleted since."""
    wanted = re.sub(r"[^A-Z2-7]", "", code.upper().translate(str.maketrans("01", "OI")))
    for sheet in call.session.scalars(select(Sheet).where(Sheet.publication_id == own.id)):
        if sheet.student_id and receipt_of(sheet).replace("-", "") == wanted:
            shown = f" ({sheet.shown})" if sheet.shown else ""
            told = f"{sheet.student_id}, {moment(sheet.sent)}: {sheet.file}{shown}"
            return {"student_id": sheet.student_id, "file": sheet.file, "told": told}
    raise missing("receipt")


@router.get("/publications/{key}/thumbnails/{name:path}")
def thumbnail(call: Called, own: Own, name: FileName) -> Response:
    """A small picture of a file's first page, as JPEG."""
    places = call.places(own)
    path = places.file(name)
    small = places.thumbnail(path)
    if not small.is_file() or small.stat().st_mtime < path.stat().st_mtime:
        write_whole(small, result_of(call.service.queue.workers, picture, path, name))
    return Response(small.read_bytes(), media_type="image/jpeg")


@router.delete("/publications/{key}/files/{name:path}")
def remove_file(call: Called, own: Own, name: FileName) -> dict[str, str]:
    """Delete a file that was handed in."""
    places = call.places(own)
    places.delete(places.file(name))
    call.note("file removed", f"{own.key} {name}")
    return {"state": "removed"}


# Grading ------------------------------------------------------------------------------------------


@router.post("/publications/{key}/jobs", status_code=202)
def grade_class(call: Called, own: Own) -> JobState:
    """Grade what is new or has changed."""
    assignment_of(call.service.settings.data, own)
    job = last_job(call.session, own)
    if job is not None and job.state in UNFINISHED:
        return state_of(call, job)
    call.note("grading", own.key)
    return queued(call, Job(publication=own, kind="grade", asked={"by": call.account.name}))


@router.get("/publications/{key}/jobs/{job}")
def job_state(call: Called, own: Own, job: Key) -> JobState:
    """Return the progress of a job."""
    return state_of(call, _job(call, own, job))


@router.delete("/publications/{key}/jobs/{job}")
def cancel(call: Called, own: Own, job: Key) -> dict[str, str]:
    """Cancel a job; what was marked is kept."""
    found = _job(call, own, job)
    call.note("grading cancelled", own.key)
    call.session.commit()
    call.service.queue.cancel(found.id)
    return {"state": "cancelled"}


@router.get("/publications/{key}/results")
def results(call: Called, own: Own) -> Response:
    """`results.json` of the last run."""
    path = call.places(own).results / "results.json"
    if not path.is_file():
        raise missing("result")
    return Response(path.read_bytes(), media_type="application/json")


CHOSEN = (
    "what", "item", "position", "combine", "maximum", "rescale", "groups", "course_id", "assignment_id",
)  # fmt: skip
GIVEN = {
    "form": (".csv", ".xls", ".txt", ".zip"), "ids": (".csv",), "criteria": (".csv", ".json"),
    "submissions": (".json",),
}  # fmt: skip
"""The files that an export may be given, with the ends of their names."""
_FIELDS = {"type": "object", "properties": {name: {"type": "string", "format": "binary"} for name in GIVEN}}
FORM_BODY = {"requestBody": {"content": {"multipart/form-data": {"schema": _FIELDS}}}}
KEPT_S = 3600.0
"""Seconds for which a file for a platform can be downloaded."""


class Chosen(model_of("Chosen", ExportOptions, BaseModel, CHOSEN)):  # type: ignore[misc]
    """The options of an export that are no files."""


@router.get("/publications/{key}/exports/{platform}")
def export_file(call: Called, own: Own, platform: str, chosen: Annotated[Chosen, Query()]) -> Response:
    """The file for a platform, as `planmark export` writes it without the platform's own file."""
    return _download(_exported(call, own, platform, chosen)[0])


@router.post("/publications/{key}/exports/{platform}/files/{name}", openapi_extra=FILE_BODY)
def filled_in(
    call: Called,
    own: Own,
    platform: str,
    name: FileName,
    body: Body,
    chosen: Annotated[Chosen, Query()],
) -> Response:
    """The platform's own worksheet or gradebook, which is sent as the body, filled in."""
    return _download(_exported(call, own, platform, chosen, {"form": (name, body)})[0])


@router.post("/publications/{key}/exports/{platform}", status_code=201, openapi_extra=FORM_BODY)
def export_told(
    call: Called, own: Own, platform: str, files: Files, chosen: Annotated[Chosen, Query()]
) -> dict[str, Any]:
    """Make the file for a platform, and tell who is not in it and what to look at.

    Files of the form: `form` (the platform's own worksheet or gradebook), `ids`, `criteria`, `submissions`.
    The file is at `address` for an hour.
    """
    path, delivery = _exported(call, own, platform, chosen, files)
    speaker = tongue(call.lang)
    answer: dict[str, Any] = {"withheld": {}, "unplaced": {}}
    for student, state, reasons in delivery.left_out():
        answer[state][student] = [told(reason, speaker) for reason in reasons]
    return {
        "name": path.name,
        "address": f"/api/v1/publications/{own.key}/exported/{path.parent.name}",
        "written": delivery.written,
        **answer,
        "notes": [told(note, speaker) for note in delivery.notes],
    }


@router.get("/publications/{key}/exported/{name}")
def exported(call: Called, own: Own, name: Key) -> Response:
    """A file for a platform that was made within the last hour."""
    path = next((call.places(own).exports / name).glob("export-*"), None)
    if path is None:
        raise missing("file")
    return _download(path)


def _download(path: pathlib.Path) -> Response:
    return FileResponse(path, filename=path.name, media_type="application/octet-stream")


def _exported(
    call: Call,
    own: Publication,
    platform: str,
    chosen: Chosen,
    files: Mapping[str, tuple[str, bytes]] = MappingProxyType({}),
) -> tuple[pathlib.Path, Delivery]:
    """Write a file for a platform into a folder of its own; delete those that nobody downloads any more."""
    if platform not in TARGETS:
        raise RefusedError(404, "not_found", "no_export", known=", ".join(TARGETS))
    if wrong := ", ".join(sorted(files.keys() - GIVEN.keys())):
        raise RefusedError(422, "file_name", "file_field", name=wrong[:60], known=", ".join(GIVEN))
    places = call.places(own)
    for old in places.exports.glob("*"):
        with suppress(FileNotFoundError):  # another request has deleted it
            if old.stat().st_mtime < time.time() - KEPT_S:
                shutil.rmtree(old, ignore_errors=True)
    folder = places.exports / secrets.token_hex(12)
    given: dict[str, Any] = chosen.model_dump(exclude_none=True)
    try:
        for field, endings in GIVEN.items():
            if field in files:
                ending = PurePath(person_name(files[field][0], endings)).suffix.lower()
                given[field] = folder / "given" / f"{field}{ending}"
                store(given[field], files[field][1])
        people = people_of(places.roster) if places.roster.is_file() else {}
        if ids := given.pop("ids", None):
            people = with_ids(people, ids)
        called = person_name(files["form"][0], GIVEN["form"]) if "form" in files else ""
        given |= {"out": places.results, "lang": own.lang, "people": people, "called": called}
        options = Options(to=platform, **given)
        path = folder / usual_name(options)
        delivery = export(read_results(places.results), path, options)
    finally:
        shutil.rmtree(folder / "given", ignore_errors=True)
    call.note("exported", f"{own.key} {path.name}")
    return path, delivery


def _job(call: Call, own: Publication, job: str) -> Job:
    found = call.session.scalar(select(Job).where(Job.key == job, Job.publication_id == own.id))
    if found is None:
        raise missing("job")
    return found


# Links, requests, deletion ------------------------------------------------------------------------


@router.post("/publications/{key}/links", status_code=201)
def make_links(call: Called, own: Own, student: str | None = None) -> list[dict[str, str]]:
    """Create a personal link for one student of the roster, or for all that have no valid one."""
    known = [one["student_id"] for one in students_of(call.places(own))]
    if student is not None and student not in known:
        raise missing("student")
    there = call.session.scalars(select(Link).where(Link.publication_id == own.id))
    valid = {one.student_id for one in there if one.is_valid}
    wanted = [student] if student is not None else [one for one in known if one not in valid]
    expires = time.time() + call.service.settings.link_days * 86400.0
    links = [Link(publication=own, student_id=one, expires=expires) for one in wanted]
    call.session.add_all(links)
    call.session.flush()
    call.note("links made", f"{own.key}: {len(links)}")
    guard = call.service.guard
    return [
        {"id": str(one.id), "student_id": one.student_id, "address": guard.link_text(one)} for one in links
    ]


@router.get("/publications/{key}/links")
def links(call: Called, own: Own) -> list[dict[str, Any]]:
    """The personal links, with their addresses."""
    found = call.session.scalars(select(Link).where(Link.publication_id == own.id).order_by(Link.id))
    guard, names = call.service.guard, ("id", "student_id", "expires", "is_revoked")
    return [{**columns_of(one, *names), "address": guard.link_text(one)} for one in found]


@router.delete("/publications/{key}/links/{number}")
def revoke(call: Called, own: Own, number: Row) -> dict[str, str]:
    """Revoke a personal link at once."""
    link = call.row_of(own, Link, number, "link")
    link.is_revoked = True
    call.note("link revoked", f"{own.key} {link.student_id}")
    return {"state": "revoked"}


class Answer(Strict):
    """An instructor's answer to a request."""

    answer: Annotated[str, Field(min_length=1, max_length=2000, pattern=WITHOUT_NUL)]


@router.get("/publications/{key}/requests")
def requests(call: Called, own: Own) -> list[dict[str, Any]]:
    """Students' requests for regrading, those that wait first."""
    found = call.session.scalars(select(Regrading).where(Regrading.publication_id == own.id))
    names = ("id", "student_id", "position", "criterion", "text", "answer", "created", "answered")
    rows = [columns_of(one, *names) for one in found]
    return sorted(rows, key=lambda row: (row["answered"] is not None, row["created"]))


@router.put("/publications/{key}/requests/{number}")
def answer(call: Called, own: Own, number: Row, said: Answer) -> dict[str, str]:
    """Answer a request."""
    request = call.row_of(own, Regrading, number, "request")
    request.answer, request.answered = said.answer, time.time()
    call.note("request answered", f"{own.key} {request.student_id}")
    return {"state": "answered"}


@router.delete("/publications/{key}/students/{student}")
def remove_student(call: Called, own: Own, student: StudentId) -> dict[str, Any]:
    """Delete all that is kept of a student; files that hold other students, too, are told and stay."""
    call.idle(own)
    kept = erase_student(call.session, own, call.places(own), student)
    call.note("student removed", f"{own.key} {digest_of(student)[:8]}")
    return {"state": "removed", "kept": kept}


@router.get("/audit")
def audit(
    call: Called, before: Annotated[int | None, Query(ge=1, le=LARGEST_ROW)] = None
) -> list[dict[str, Any]]:
    """The audit trail, 200 entries a call, the newest first."""
    _ = call.admin
    asked = select(Audit).order_by(Audit.id.desc()).limit(200)
    asked = asked if before is None else asked.where(Audit.id < before)
    names = ("id", "at", "who", "act", "about", "before", "after")
    return [columns_of(one, *names) for one in call.session.scalars(asked)]
