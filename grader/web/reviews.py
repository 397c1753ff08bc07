"""The pages of `planmark review`, for the publications of a server."""

import threading
import time
from collections import OrderedDict
from collections.abc import Iterable
from dataclasses import dataclass, field
from functools import partial

from sqlalchemy import select
from starlette.concurrency import run_in_threadpool
from starlette.requests import Request as HttpRequest
from starlette.responses import RedirectResponse, Response
from starlette.types import Receive, Scope, Send

from grader.feedback.words import VERDICTS
from grader.language import tongue
from grader.review.records import Request
from grader.review.server import application
from grader.review.session import Session
from grader.tables.decisions import DecisionFile
from grader.texts.spoken import RefusedError
from grader.web.places import batch_of
from grader.web.service import Call, Service
from grader.web.store import Publication, Regrading, unanswered

MOST = 4
"""Classes whose reviews are kept in memory; another one is opened again in a few seconds."""


@dataclass(slots=True)
class Reviews:
    """ASGI application below ``/review/KEY/``; a class is opened when somebody asks for it."""

    service: Service
    _open: "OrderedDict[tuple[int, int | None], Session]" = field(default_factory=OrderedDict)
    _lock: threading.Lock = field(default_factory=threading.Lock)

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI."""
        request = HttpRequest(scope, receive)
        key, _, path = scope["path"].removeprefix(scope.get("root_path", "")).strip("/").partition("/")
        session, name, lang = await run_in_threadpool(self._let_in, request, key)
        if not path and not scope["path"].endswith("/"):
            await RedirectResponse(f"{scope['path']}/", 307)(scope, receive, send)
            return
        app = application(session, lang, by=name, home=f"/publications/{key}")
        await app({**scope, "path": f"/{path}", "root_path": ""}, receive, send)
        if scope["method"] == "POST":
            await run_in_threadpool(self._answer, key, session, name)

    def _let_in(self, request: HttpRequest, key: str) -> tuple[Session, str, str]:
        """The class under review, who asks, and the language. Raises RefusedError for others."""
        with self.service.store.session() as store:
            visitor = self.service.guard.visitor(request, store)
            call = Call(self.service, store, visitor, request, Response())
            publication = call.own(key)
            job = call.idle(publication)
            requests = _requests(unanswered(store, publication))
            name, lang = call.account.name, call.lang
        with self._lock:
            session = self._session(publication, None if job is None else job.id, name)
        session.ask(requests)
        return session, name, lang

    def _session(self, publication: Publication, job: int | None, name: str) -> Session:
        known = self._open.get((publication.id, job))
        if known is None:
            batch = batch_of(self.service.settings.data, publication)
            if not (batch.out / "results.json").is_file():
                raise RefusedError(422, "results_missing", "no_result")
            note = partial(self.service.store.note_mark, publication.key)
            known = Session(batch, self.service.queue.workers, note=note)
            known.bring_up_to_date(lambda *_: None, name)
            self._open = OrderedDict(
                (which, session) for which, session in self._open.items() if which[0] != publication.id
            )
            self._open[publication.id, job] = known
        self._open.move_to_end((publication.id, job))
        while len(self._open) > MOST:
            self._open.popitem(last=False)
        return known

    def _answer(self, key: str, session: Session, name: str) -> None:
        """Answer the requests whose criteria have been decided since."""
        decided = DecisionFile(session.batch.decisions_path).all()
        rows = {(row.student_id, row.criterion): row for row in decided}
        with self.service.store.session() as store:
            publication = store.scalar(select(Publication).where(Publication.key == key))
            for request in unanswered(store, publication) if publication else ():
                row = rows.get((request.student_id, request.criterion))
                if row is None or not Request(request.text, request.created).is_answered(row):
                    continue
                verdict = tongue(session.batch.lang).gettext(VERDICTS.get(row.verdict, row.verdict))
                request.answer = ". ".join(part for part in (verdict, row.comment) if part)
                request.answered = time.time()
                self.service.store.note(store, name, "request answered", f"{key} {request.student_id}")


def _requests(rows: Iterable[Regrading]) -> dict[tuple[str, int | None], dict[str, Request]]:
    found: dict[tuple[str, int | None], dict[str, Request]] = {}
    for row in rows:
        if row.criterion:
            found.setdefault((row.student_id, row.position), {})[row.criterion] = Request(
                row.text, row.created
            )
    return found
