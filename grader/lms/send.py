"""Send an export's calls to a platform, each once, and record every answer.

The record lies beside the export, under one name for all exports: a call is known by its address, which has
site, course and assignment in it. So an export that is written anew sends only what changed. Whether there
is a rubric the platform itself is asked, because a second one would take everybody's points away.
"""

import hashlib
import json
import re
import zipfile
from collections.abc import Callable, Mapping
from datetime import UTC, datetime
from pathlib import Path
from typing import Any, Literal
from urllib.parse import quote

from pydantic import BaseModel, Field

from grader.files import write_whole
from grader.lms.api.connection import Answer, Connection
from grader.lms.marks import Criterion, criteria_in, matched
from grader.lms.moodle_guide import fillings_in
from grader.lms.table import parsed
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError, InputFileError

TOKEN = "PLANMARK_TOKEN"  # noqa: S105 - the variable's name
_SITE = re.compile(
    r"(https?)://([a-z0-9._-]+|\[[0-9a-f:]+\])(:[0-9]+)?(/[\w.~/%-]*)?", re.ASCII | re.IGNORECASE
)
_HERE = {"localhost", "127.0.0.1", "[::1]"}
_IN_A_ROW = 3
"""Calls without an answer, or refused before any was accepted, after which no other is tried."""
_MOODLE, _POINTS = "/webservice/rest/server.php", "mod_assign_save_grade"


# The calls ----------------------------------------------------------------------------------------


class Look(BaseModel):
    """The place that shows an assignment's rubric, and its criteria; `absent` is the status of none."""

    path: str = Field(pattern="^/[!-~]+$")
    criteria: list[Criterion]
    absent: int | None = None


class Call(BaseModel):
    """A call; `what` is its kind, `function` Moodle's; it is not made where `unless` finds a rubric."""

    method: Literal["POST", "PUT", "PATCH"]
    path: str = Field(pattern="^/[!-~]+$")
    body: Any
    what: str
    student_id: str = ""
    function: Literal["", "core_grading_save_definitions", "mod_assign_save_grade"] = ""
    unless: Look | None = None


class Plan(BaseModel):
    """The calls in their order; `fillings_lost`: points that may go with a guide of Moodle that is there."""

    platform: str
    server: str = ""
    calls: list[Call]
    fillings_lost: int = -1


def read_plan(file: Path) -> tuple[Plan, Path]:
    """The calls in a ZIP, a folder or a JSON file, and where their record lies; InputFileError for none."""
    folder = file.parent if file.name == "plan.json" else file
    try:
        if folder.is_dir():
            files = {path.name: path.read_bytes() for path in folder.glob("*.json")}
        elif zipfile.is_zipfile(file):
            with zipfile.ZipFile(file) as archive:
                files = {name: archive.read(name) for name in archive.namelist()}
        else:
            return _of_moodle(parsed(file.read_bytes())), file.with_name("sent.json")
        document = parsed(files["plan.json"])
        for call in document["calls"]:
            call["what"] = call["body"].removesuffix(".json").rpartition("-")[2]
            call["body"] = parsed(files[call["body"]])
            if call["method"] == "POST" and "student_id" not in call:
                call["unless"]["path"]  # earlier exports do not say where to look for the rubric
        return Plan.model_validate(document), folder.with_name("sent.json")
    except OSError as error:
        raise failure(InputFileError, "no_plan", "unreadable", file=file, error=error.strerror) from error
    except (ValueError, LookupError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        raise failure(InputFileError, "no_plan", file=file) from error


def _of_moodle(document: Any) -> Plan:  # noqa: ANN401 - whatever a JSON file holds
    """Moodle's calls; their addresses differ in a part that is not sent."""
    calls = []
    for each in document.get("calls", [document]):
        body, function, unless = each["arguments"], each["wsfunction"], None
        if function == _POINTS:
            path = f"{_MOODLE}#{body['assignmentid']}-{body['userid']}"
        else:
            (area,) = body["areas"]
            path, wanted = f"{_MOODLE}#{area['cmid']}", area["definitions"][0]["guide"]["guide_criteria"]
            names = [(one["shortname"], one["maxscore"]) for one in wanted]
            unless = Look(path=path, criteria=[Criterion(name, (name,), most) for name, most in names])
        calls.append(Call(
            method="POST", path=path, body=body, what="rubric" if unless else "points", function=function,
            student_id=each.get("student_id", ""), unless=unless,
        ))  # fmt: skip
    return Plan(platform="Moodle", calls=calls, fillings_lost=document.get("fillings_lost", -1))


def checked_site(plan: Plan, given: str | None, *, allow_http: bool) -> str:
    """The address that calls go to; CallError where it is not told, or would show the token to others."""
    site = (given or plan.server).rstrip("/")
    found = _SITE.fullmatch(site)
    if not site or (found and found[2].endswith("example.org")):
        raise failure(CallError, "site", "site_needed", platform=plan.platform)
    if not found:
        raise failure(CallError, "site", text=site.rpartition("@")[2])
    if found[1] == "http" and found[2] not in _HERE and not allow_http:
        raise failure(CallError, "site", "https_needed", text=site)
    return site


def checked_token(text: str) -> str:
    """The token; CallError where it is not told, or has signs that would break a request."""
    token = text.strip()
    if not token or not token.isascii() or not token.isprintable() or " " in token:
        raise failure(CallError, "send_token", name=TOKEN)
    return token


# The record ---------------------------------------------------------------------------------------


class SentCall(BaseModel):
    """A call that was carried out: its digest, the answer's status, the ids that the platform gave."""

    digest: str
    status: int
    at: datetime
    id: str = ""
    criteria: dict[str, str] = {}


class SentDocument(BaseModel):
    """The calls that were carried out, by method and address."""

    schema_version: Literal[1] = 1
    calls: dict[str, SentCall] = {}


# Sending ------------------------------------------------------------------------------------------


class _EndError(Exception):
    """No further call is tried; why stands in what failed."""


class Sender:
    """Sends the calls of a plan that the record at a path does not have yet.

    Attributes
    ----------
    count : calls carried out
    failed, left : why others were not, and students whose calls were not tried
    rubric : the platform's answer that shows the assignment's rubric

    Raises InputFileError for a record that is none.
    """

    def __init__(self, plan: Plan, connection: Connection, path: Path) -> None:
        self.plan, self.site, self._connection, self._path = plan, connection.site, connection, path
        self.count, self.rubric = 0, None
        self.failed: list[Reason] = []
        self.left: list[str] = []
        self._own = [call for call in plan.calls if not call.student_id]
        self._row, self._made = 0, ""
        try:
            record = path.read_bytes() if path.exists() else b"{}"
            self._record = SentDocument.model_validate_json(record)
        except (OSError, ValueError) as error:
            raise failure(InputFileError, "no_record", file=path) from error

    def pending(self) -> list[list[Call]]:
        """The calls to be made: together those of the rubric, and all of a student if one of them changed."""
        groups: dict[str, list[Call]] = {}
        for call in self.plan.calls:
            groups.setdefault(call.student_id, []).append(call)
        return [group for group in groups.values() if not all(map(self._is_recorded, group))]

    def send(self, tell: Callable[[str, int, int], None]) -> None:
        """Make the calls; after each one the record is written. Raises OutputError where it cannot be."""
        tried: set[str] = set()
        try:
            if self.pending():
                self._make_rubric()
            groups = self.pending()
            for done, group in enumerate(groups, start=1):
                tried.add(group[0].student_id)
                all(map(self._is_made, group))  # each call rests on the one before
                tell("sent", done, len(groups))
        except _EndError:
            waiting = (group[0].student_id for group in self.pending())
            self.left = [student for student in waiting if student and student not in tried]

    def _make_rubric(self) -> None:
        """Make the rubric where the assignment has none; raises _EndError where it has none afterwards."""
        rubric = next((call for call in self._own if call.unless), None)
        if rubric is None or self._is_there(rubric):
            return
        # One that was made and not attached yet stays; a new one has nothing of what was sent before.
        calls = [call for call in self._own if not self._is_recorded(call)] or self._own
        if rubric not in calls:
            self._made = self._record.calls[self._key(rubric)].id
        for call in self.plan.calls:
            if call.student_id:
                self._record.calls.pop(self._key(call), None)
        if not all(map(self._is_made, calls)):
            raise _EndError
        if not self._is_there(rubric):
            self._fail(rubric, Reason("rubric_unseen"))

    def _is_made(self, call: Call) -> bool:
        """Make a call and record it, else keep why not; raises _EndError where others would fail, too."""
        is_safe = call.method != "POST" or call.function == _POINTS
        body = self._filled(call)
        if self._record.calls.pop(self._key(call), None):
            self._write()  # what the platform has is not known until it answers
        answer = self._connection.call(call.method, call.path, body, call.function, is_safe=is_safe)
        if answer.failed is None:
            self.count, self._row, self._made = self.count + 1, 0, _id_in(answer.body)
            self._note(call, answer)
            return True
        accepted = (self._key(one) in self._record.calls for one in self.plan.calls if one.student_id)
        is_open = (
            answer.status in {0, 429} or answer.status >= 500 or (answer.status == 403 and not any(accepted))
        )
        self._row = self._row + 1 if is_open else 0
        self._fail(call, answer.failed, ends=answer.ends or self._row == _IN_A_ROW)
        return False

    def _is_there(self, rubric: Call) -> bool:
        """Return whether the assignment has the rubric; raises _EndError where it has another one."""
        look = rubric.unless or Look(path="/", criteria=[])
        if rubric.function:
            (area,) = rubric.body["areas"]
            asked = {"cmids": [area["cmid"]], "areaname": area["areaname"]}
            answer = self._ask(rubric, "core_grading_get_definitions", asked)
        else:
            answer = self._ask(rubric)
        known = list(criteria_in(answer.body))
        found, faults = matched(look.criteria, known)
        if not faults:
            self.rubric = answer.body
            for call in self._own:
                self._note(call, answer, {each.criterion: each.id for each in found})
        elif rubric.function:
            self._check_fillings(rubric, answer.body)
        elif known:
            self._fail(rubric, Reason("rubric_other"), *faults)
        return not faults

    def _check_fillings(self, rubric: Call, definitions: Any) -> None:  # noqa: ANN401 - whatever Moodle answers
        """Raise _EndError where more points would go with a guide that is there than may."""
        function = "core_grading_get_gradingform_instances"
        try:
            for guide in [guide["id"] for area in definitions["areas"] for guide in area["definitions"]]:
                lost = fillings_in(self._ask(rubric, function, {"definitionid": guide}).body)
                if sum(lost) > self.plan.fillings_lost:
                    self._fail(rubric, Reason("guide_filled", {"count": sum(lost), "grades": len(lost)}))
        except (LookupError, TypeError, AttributeError):
            self._fail(rubric, Reason("answer_no_api", {"status": 200, "text": function}))

    def _ask(self, rubric: Call, function: str = "", asked: Mapping[str, Any] | None = None) -> Answer:
        """Ask what the platform shows of an assignment; raises _EndError where it does not answer."""
        path, absent = (rubric.unless.path, rubric.unless.absent) if rubric.unless else (rubric.path, None)
        answer = self._connection.call("POST" if function else "GET", path, asked, function, is_safe=True)
        if answer.failed and answer.status != absent:
            self._fail(rubric, answer.failed)
        return answer

    def _fail(self, call: Call, *why: Reason, ends: bool = True) -> None:
        whose = f"{call.student_id} ({call.what})" if call.student_id else call.what
        self.failed += [Reason(each.code, {"cell": whose, **each.parameters}) for each in why]
        if ends:
            raise _EndError

    # The record, and by it what is sent

    def _key(self, call: Call) -> str:
        return f"{call.method} {self.site}{(call.unless or call).path}"

    def _is_recorded(self, call: Call) -> bool:
        known = self._record.calls.get(self._key(call))
        return known is not None and known.digest == self._digest(call)

    def _digest(self, call: Call) -> str:
        body = self._filled(call) if call.student_id else call.body
        return hashlib.sha256(json.dumps(body, sort_keys=True).encode()).hexdigest()

    def _filled(self, call: Call) -> Any:  # noqa: ANN401 - JSON
        """The body with the ids that the platform gave to the rubric (Graph) and its criteria (Canvas)."""
        if not call.student_id:
            return json.loads(json.dumps(call.body).replace("{id}", quote(self._made)))
        keys = (self._key(one) for one in self._own if one.unless)
        ids = next((self._record.calls[key].criteria for key in keys if key in self._record.calls), {})
        if not ids or "rubric_assessment" not in call.body:
            return call.body
        points = {ids.get(name, name): each for name, each in call.body["rubric_assessment"].items()}
        return {**call.body, "rubric_assessment": points}

    def _note(self, call: Call, answer: Answer, criteria: dict[str, str] | None = None) -> None:
        self._record.calls[self._key(call)] = SentCall(
            digest=self._digest(call), status=answer.status, at=datetime.now(UTC), id=_id_in(answer.body),
            criteria=criteria or {},
        )  # fmt: skip
        self._write()

    def _write(self) -> None:
        write_whole(self._path, self._record.model_dump_json(indent=1))


def _id_in(body: Any) -> str:  # noqa: ANN401 - whatever a platform answers
    """The id of what an answer is about; of Canvas's assignment its rubric's."""
    known = body.get("rubric_settings", body) if isinstance(body, dict) else None
    return str(known.get("id", "")) if isinstance(known, dict) else ""
