"""Requests to a platform: the plan of the calls, their addresses, and the owners of submissions."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any
from urllib.parse import quote

from grader.lms.grades import Delivery, Grade, Options, Person, ready
from grader.lms.marks import Criterion, check_unique, json_text, read_answer
from grader.lms.table import Evidence, match_class
from grader.records import Reason
from grader.texts.spoken import failure
from reference.errors import CallError

# The plan -----------------------------------------------------------------------------------------


@dataclass(slots=True)
class Plan:
    """Files that are collected for a plan."""

    platform: str
    server: str
    sources: Sequence[str]
    calls: list[dict[str, Any]] = field(default_factory=list)
    files: dict[str, bytes] = field(default_factory=dict)

    def add(
        self, call: str, body: Mapping[str, Any], what: str, student: str | None = None,
        unless: Mapping[str, Any] | None = None,
    ) -> None:  # fmt: skip
        """Add a call, as ``POST /path``; `what` names its file, after the student.

        It is not made where the assignment has a rubric: `unless` says where to look, see `rubric_at`.
        """
        method, _, path = call.partition(" ")
        name = "-".join(filter(None, (f"{len(self.calls) + 1:03}", student, what))) + ".json"
        self.files[name] = json_text(body).encode()
        whose = {} if student is None else {"student_id": student}
        looked = {} if unless is None else {"unless": unless}
        self.calls.append({"method": method, "path": path, "body": name, **whose, **looked})

    def delivery(self, grades: Sequence[Grade], **more: Any) -> Delivery:  # noqa: ANN401 - fields of a delivery
        """The plan with its files."""
        check_unique((call["path"] for call in self.calls), "the call")
        content = {
            "schema_version": 1,
            "platform": self.platform,
            "assignment": grades[0].assignment,
            "server": self.server,
            "sources": self.sources,
            "calls": self.calls,
        }
        return Delivery({"plan.json": json_text(content).encode(), **self.files}, **more)


def rubric_at(path: str, criteria: Sequence[Criterion], **more: int) -> dict[str, Any]:
    """The place where the platform shows an assignment's rubric, and the criteria that it has then.

    `absent` is the status of an answer that says that there is none.
    """
    return {"path": path, "criteria": [asdict(each) for each in criteria], **more}


def place_of(options: Options, *names: str) -> list[str]:
    """The platform's numbers of course and assignment, for a path; CallError where one is not given."""
    values = [getattr(options, name) for name in names]
    missing = [f"--{name.replace('_', '-')}" for name, value in zip(names, values, strict=True) if not value]
    if missing:
        raise failure(CallError, "place_needed", to=options.to, names=tuple(missing))
    return [quote(str(value), safe="") for value in values]


@dataclass(frozen=True, slots=True)
class Submission:
    """A student's submission as the platform names it; `outcomes` are ids by type, of Microsoft's alone."""

    id: str
    user: Mapping[str, str]
    outcomes: Mapping[str, str]


def submissions_in(answer: object) -> Iterator[Submission]:
    """Submissions in a platform's answer, wherever they are nested in it."""
    if isinstance(answer, list):
        for each in answer:
            yield from submissions_in(each)
    if not isinstance(answer, dict):
        return
    names = [answer[key] for key in ("submissionUUID", "submissionUuid", "id") if key in answer]
    recipient = answer.get("recipient")
    of_recipient = recipient if isinstance(recipient, dict) else {}
    cells = {
        "userId": answer.get("userId") or of_recipient.get("userId"),
        "username": answer.get("username"),
        "email": answer.get("email"),
    }
    user = {kind: cell for kind, cell in cells.items() if isinstance(cell, str) and cell}
    if user and names and isinstance(names[0], str):
        outcomes = answer.get("outcomes")
        ids = {
            str(each.get("@odata.type", "")).rpartition(".")[2]: str(each.get("id", ""))
            for each in (outcomes if isinstance(outcomes, list) else [])
            if isinstance(each, dict)
        }
        yield Submission(names[0], user, ids)
        return
    for inner in answer.values():
        yield from submissions_in(inner)


def students_submissions(
    grades: Sequence[Grade], options: Options, ask: str
) -> tuple[dict[str, Submission], dict[str, Reason]]:
    """The submission of each student, and why others have none; `ask` is the request that lists them.

    Raises CallError for an answer without submissions.
    """
    if options.submissions is None:
        why = Reason("submission_absent", {"asked": ask})
        return {}, {grade.student_id: why for grade in ready(grades)}
    known = list(submissions_in(read_answer(options.submissions)))
    if not known:
        raise failure(CallError, "submissions", file=options.submissions, asked=ask)
    rows = {row: submission.user for row, submission in enumerate(known)}
    matches = match_class(rows, grades, options, _evidence)
    graded = [grade.student_id for grade in ready(grades)]
    found = {student: known[matches.rows[student]] for student in graded if student in matches.rows}
    return found, {student: matches.missing[student] for student in graded if student not in found}


def _evidence(student: str, person: Person) -> Evidence:
    return (
        ("userId", person.platform_id),
        ("email", person.email),
        ("username", person.username or student),
        ("userId", student),
    )
