"""Parameters of every route: the user, the publication, the server's parts."""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import wraps
from typing import Annotated, Any, TypeVar

from fastapi import Depends, Path, Request, Response
from fastapi.routing import APIRoute
from sqlalchemy import select
from sqlalchemy.orm import Session

from grader.texts.spoken import RefusedError
from grader.web.guard import Guard, Visitor, forbidden, language_of, missing
from grader.web.mail import Mail
from grader.web.places import Places, places_of
from grader.web.queue import Queue
from grader.web.settings import Settings
from grader.web.store import Account, Job, Link, LtiClaim, Publication, Regrading, Store, last_job

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
        self.service.guard.count(rate, [who])
        if visit is not None and visit.account_id is None:
            self.service.guard.count("address", [self.visitor.address])

    def publication(self, key: str) -> Publication:
        """A publication by its key. Raises RefusedError where there is none."""
        found = self.session.scalar(select(Publication).where(Publication.key == key))
        if found is None:
            self.count("key")
            raise missing("publication")
        return found

    def own(self, key: str) -> Publication:
        """A publication that the instructor may change. Raises RefusedError for any other."""
        _ = self.account
        found = self.publication(key)
        if not self.visitor.is_member(found):
            raise missing("publication")
        return found

    def own_row(self, key: str, table: type[OfPublication], number: int, what: str) -> OfPublication:
        """A row that belongs to a publication of the instructor. Raises RefusedError for any other."""
        own, row = self.own(key), self.session.get(table, number)
        if row is None or row.publication_id != own.id:
            raise missing(what)
        return row

    def idle(self, publication: Publication) -> Job | None:
        """The last job that graded a class. Raises RefusedError while it waits or runs."""
        job = last_job(self.session, publication)
        if job is not None and job.state in {"queued", "running"}:
            raise RefusedError(409, "job_runs")
        return job

    def link(self, publication: Publication) -> Link | None:
        """The personal link by which the visitor came, while it is valid."""
        return self.service.guard.own_link(self.session, self.visitor, publication)

    def places(self, publication: Publication) -> Places:
        """A publication's folders."""
        return places_of(self.service.settings.data, publication)


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
    """A request as routes take it; what changes something must come from our own page, or a program."""
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


async def body_of(request: Request, call: Called) -> bytes:
    """The whole body, whose size `grader.web.guard.Rim` bounds; of a stranger no class's file is read."""
    if "/files/" in request.url.path:
        _ = call.account
        call.session.commit()
    return await request.body()


Body = Annotated[bytes, Depends(body_of)]
FILE_BODY = {
    "requestBody": {
        "required": True,
        "content": {"application/octet-stream": {"schema": {"type": "string", "format": "binary"}}},
    }
}
"""Of routes that take a file as their body, for the OpenAPI document."""
