"""Parameters of every route: the visitor, the publication, the body, the parts of the server."""

from collections.abc import Awaitable, Callable, Iterator
from contextlib import suppress
from dataclasses import dataclass
from datetime import UTC, datetime
from functools import wraps
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Request, Response
from fastapi.routing import APIRoute
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.datastructures import UploadFile

from grader.texts.spoken import RefusedError
from grader.web.guard import Guard, Visitor, forbidden, language_of, missing
from grader.web.mail import Mail
from grader.web.places import Places, places_of
from grader.web.queue import Queue
from grader.web.settings import Settings
from grader.web.store import (
    UNFINISHED,
    Account,
    Job,
    Link,
    LtiClaim,
    Publication,
    Regrading,
    Store,
    Table,
    last_job,
)

AnyRow = TypeVar("AnyRow", bound=Table)
OfPublication = TypeVar("OfPublication", Link, LtiClaim, Regrading)
CHANGING = frozenset({"POST", "PUT", "PATCH", "DELETE"})


@dataclass(frozen=True, slots=True)
class Service:
    """The parts of a running server; one for all requests."""

    settings: Settings
    store: Store
    guard: Guard
    queue: Queue
    mail: Mail


@dataclass(slots=True)
class Call:
    """One request: who makes it, and a session of the data base that is committed after it."""

    service: Service
    session: Session
    visitor: Visitor
    request: Request
    response: Response

    @property
    def account(self) -> Account:
        """The instructor who is signed in. Raises RefusedError where nobody is."""
        if self.visitor.account is None:
            raise RefusedError(401, "sign_in")
        return self.visitor.account

    @property
    def admin(self) -> Account:
        """The administrator who is signed in. Raises RefusedError for everybody else."""
        if not self.account.is_admin:
            raise forbidden("administrators")
        return self.account

    @property
    def lang(self) -> str:
        """The visitor's language."""
        return language_of(self.request)

    def note(self, act: str, about: str = "") -> None:
        """Add to the audit trail."""
        self.service.store.note(self.session, self.visitor.name, act, about)

    def count(self, rate: str) -> None:
        """Count a use of something by this visitor. Raises RefusedError where it is too often.

        A cookie that is not stored says nothing of who it is: such visitors count by their address.
        """
        visit = self.visitor.visit
        who = f"address {self.visitor.address}" if visit is None else f"visit {visit.id}"
        self.service.guard.count(rate, who)
        if visit is not None and visit.account_id is None:
            self.service.guard.count("address", self.visitor.address)

    def publication(self, key: str) -> Publication:
        """Return a publication by its key. Raises RefusedError where there is none."""
        found = self.session.scalar(select(Publication).where(Publication.key == key))
        if found is None:
            self.count("key")
            raise missing("publication")
        return found

    def own(self, key: str) -> Publication:
        """Return a publication that the instructor may change. Raises RefusedError for any other."""
        _ = self.account
        found = self.publication(key)
        if not self.visitor.is_member(found):
            raise missing("publication")
        return found

    def all_own(self) -> list[Publication]:
        """Return the publications that the instructor may change, the newest first."""
        _ = self.account
        found = self.session.scalars(select(Publication).order_by(Publication.id.desc()))
        return [one for one in found if self.visitor.is_member(one)]

    def row(self, table: type[AnyRow], key: int | str, what: str) -> AnyRow:
        """Return a row by its primary key. Raises RefusedError where there is none."""
        row = self.session.get(table, key)
        if row is None:
            raise missing(what)
        return row

    def row_of(self, own: Publication, table: type[OfPublication], number: int, what: str) -> OfPublication:
        """Return a row that belongs to a publication. Raises RefusedError for any other."""
        row = self.row(table, number, what)
        if row.publication_id != own.id:
            raise missing(what)
        return row

    def idle(self, publication: Publication) -> Job | None:
        """Return the last job that graded a class. Raises RefusedError while it waits or runs."""
        job = last_job(self.session, publication)
        if job is not None and job.state in UNFINISHED:
            raise RefusedError(409, "job_runs")
        return job

    def link(self, publication: Publication) -> Link | None:
        """Return the personal link by which the visitor came, while it is valid."""
        return self.service.guard.own_link(self.session, self.visitor, publication)

    def places(self, publication: Publication) -> Places:
        """Return a publication's folders."""
        return places_of(self.service.settings.data, publication)


def moment(at: float) -> str:
    """Return a time as people read it, in the server's zone: ``2026-12-01 23:59:00 EET``."""
    return f"{datetime.fromtimestamp(at, UTC).astimezone():%Y-%m-%d %H:%M:%S %Z}"


def time_of(text: str) -> float | None:
    """Return a time, the server's if no zone is given; None for an empty text. Raises RefusedError."""
    with suppress(ValueError, OverflowError, OSError):
        if not text or ":" in text:  # a day alone would be its first minute
            return datetime.fromisoformat(text).timestamp() if text else None
    raise RefusedError(422, "time_refused", given=text)


def text_of(at: float | None) -> str:
    """Return a time so that `time_of` takes it, with the server's zone; empty for None."""
    return "" if at is None else datetime.fromtimestamp(at, UTC).astimezone().isoformat(timespec="minutes")


class Route(APIRoute):
    """A route that commits in the thread that runs it: between threads a request holds no connection.

    Threads that wait for a connection would otherwise keep those that hold one from going on.
    """

    def __init__(self, path: str, endpoint: Callable[..., Any], **known: Any) -> None:  # noqa: ANN401 - FastAPI's
        @wraps(endpoint)
        def committed(**asked: Any) -> Any:  # noqa: ANN401 - whatever the endpoint takes and gives
            answer = endpoint(**asked)
            if "call" in asked:
                asked["call"].session.commit()
            return answer

        super().__init__(path, committed, **known)


def called(request: Request, response: Response) -> Iterator[Call]:
    """Yield a request as routes take it; a change must come from our own page, or a program."""
    service: Service = request.app.state.service
    with service.store.session() as session:
        visitor = service.guard.visitor(request, session)
        # A platform's launch has a state and a signature of its own.
        if request.method in CHANGING and not request.url.path.startswith("/lti/"):
            service.guard.check_form(request, visitor)
        session.commit()
        yield Call(service, session, visitor, request, response)


Called = Annotated[Call, Depends(called, scope="function")]
LARGEST_ROW = 2**31 - 1
"""The largest number of a row in PostgreSQL."""
Row = Annotated[int, Path(ge=1, le=LARGEST_ROW)]
Key = Annotated[str, Path(pattern=r"^[A-Za-z0-9_-]{1,64}$", description="the publication's key")]


def own_of(call: Called, key: Key) -> Publication:
    """Return the instructor's own publication that a route is about, before its body is read."""
    own = call.own(key)
    call.session.commit()  # see Route
    return own


Own = Annotated[Publication, Depends(own_of)]


def body_after(asked: Callable[..., object]) -> Callable[..., Awaitable[bytes]]:
    """Return a reader of a request's body, which `grader.web.guard.Rim` bounds; `asked` permits it first."""

    async def body(request: Request, allowed: Annotated[object, Depends(asked)]) -> bytes:
        _ = allowed
        return await request.body()

    return body


async def files_after(request: Request, own: Own) -> dict[str, tuple[str, bytes]]:
    """Return the files of a form by their fields, each with its name; the form is read once it is allowed."""
    _ = own
    async with request.form() as form:
        sent = {name: one for name, one in form.items() if isinstance(one, UploadFile) and one.filename}
        return {name: (one.filename or "", await one.read()) for name, one in sent.items()}


Body = Annotated[bytes, Depends(body_after(own_of))]
Files = Annotated[dict[str, tuple[str, bytes]], Depends(files_after)]
FILE_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
"""The body of routes that take a file, for the OpenAPI document."""
