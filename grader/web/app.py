"""The application of ``planmark serve``: its routes, its errors, its start and end."""

import asyncio
import logging
from collections.abc import AsyncIterator
from contextlib import asynccontextmanager, closing, suppress
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse, Response
from pydantic import BaseModel
from sqlalchemy import select
from starlette.concurrency import run_in_threadpool
from starlette.exceptions import HTTPException

from grader import __version__
from grader.language import tongue
from grader.review.server import LOOPBACK
from grader.texts.spoken import RefusedError, told_of
from grader.web import accounts, claims, instructors, lti, pages, students
from grader.web.guard import Guard, Rim, language_of
from grader.web.mail import Mail
from grader.web.queue import Photo, Queue
from grader.web.reviews import Reviews
from grader.web.self_check import checked_photo
from grader.web.service import Call, Service
from grader.web.settings import Settings
from grader.web.store import Account, Store
from reference.errors import PlanmarkError

LOG = logging.getLogger("planmark")
DAY_S = 86400.0
DESCRIPTION = """
Everything that the pages of planmark do. A program sends a token, made on the account's page, as
`Authorization: Bearer TOKEN`. Errors are `{"code", "message"}`: what is wrong, where, and what to do.
"""

REFUSALS = (400, 401, 403, 404, 408, 409, 413, 415, 421, 422, 429, 503)
"""Statuses of refused requests, each with a `Fault`."""


class Fault(BaseModel):
    """An error: what is wrong, where, and what to do."""

    code: str
    message: str


def application(settings: Settings, photo: Photo = checked_photo) -> FastAPI:
    """Return the web application.

    Raises CallError for a data base that cannot be opened.
    """
    store = Store(settings.database)
    jobs, mail = Queue(settings, store, photo), Mail(settings, store)
    service = Service(settings, store, Guard(settings, store), jobs, mail)

    @asynccontextmanager
    async def running(_app: FastAPI) -> AsyncIterator[None]:
        service.queue.start()
        service.mail.start()
        ended = asyncio.Event()
        forgetting = asyncio.create_task(_forget(store, settings.keep_days, ended))
        yield
        ended.set()
        await forgetting
        service.queue.stop()
        store.close()

    app = FastAPI(
        title="planmark", version=__version__, description=DESCRIPTION, lifespan=running,
        docs_url=None, redoc_url=None, openapi_url="/api/v1/openapi.json",
        responses={code: {"description": HTTPStatus(code).phrase, **_refusal(code)} for code in REFUSALS},
    )  # fmt: skip
    app.state.service = service
    for part in (students, accounts, instructors, lti, claims, pages):
        app.include_router(part.router)
    app.mount("/review", Reviews(service))
    app.add_exception_handler(PlanmarkError, _told)
    app.add_exception_handler(RequestValidationError, _invalid)
    app.add_exception_handler(HTTPException, _refused)
    app.add_exception_handler(Exception, _fault)
    app.add_middleware(Rim, settings=settings, hosts=LOOPBACK if settings.is_local else frozenset())
    return app


def _refusal(code: int) -> dict[str, Any]:
    """Return the schema of an error: the model for one status, for the others a reference to it.

    FastAPI would copy the model for each route and status.
    """
    if code == HTTPStatus.UNPROCESSABLE_ENTITY:
        return {"model": Fault}
    return {"content": {"application/json": {"schema": {"$ref": "#/components/schemas/Fault"}}}}


async def _forget(store: Store, days: float, ended: asyncio.Event) -> None:
    """Delete once a day what is older than it is kept, until the server ends."""
    while not ended.is_set():
        await run_in_threadpool(store.forget, days=days)
        with suppress(TimeoutError):
            await asyncio.wait_for(ended.wait(), DAY_S)


def first_invitation(settings: Settings) -> str | None:
    """Return the address to create the first administrator's account; None once one has a password."""
    with closing(Store(settings.database)) as store, store.session() as session:
        admins = session.scalars(select(Account).where(Account.is_admin)).all()
        if any(one.password for one in admins):
            return None
        token = accounts.invitation(session, admins[0].name if admins else "admin", is_admin=True)
    return f"{settings.address}/join?token={token}"


# Errors -------------------------------------------------------------------------------------------


async def _told(request: Request, error: Exception) -> Response:
    assert isinstance(error, PlanmarkError)  # noqa: S101 - these alone are told here
    status = error.status if isinstance(error, RefusedError) else HTTPStatus.UNPROCESSABLE_ENTITY
    speaker = tongue(language_of(request))
    told = told_of(error, speaker)
    return _answer(request, status, error.code, told)


async def _invalid(request: Request, error: Exception) -> Response:
    faults = error.errors() if isinstance(error, RequestValidationError) else []
    lines = [f"{'.'.join(map(str, fault['loc']))}: {fault['msg']}" for fault in faults[:10]]
    return _answer(request, HTTPStatus.UNPROCESSABLE_ENTITY, "invalid", "; ".join(lines)[:2000])


async def _refused(request: Request, error: Exception) -> Response:
    status = error.status_code if isinstance(error, HTTPException) else HTTPStatus.NOT_FOUND
    return _answer(request, status, "refused", HTTPStatus(status).phrase)


async def _fault(request: Request, error: Exception) -> Response:
    LOG.error("a fault of planmark at %s", request.url.path, exc_info=error)
    why = "a fault of planmark: it is in the log"
    return _answer(request, HTTPStatus.INTERNAL_SERVER_ERROR, "internal_error", why)


def _answer(request: Request, status: int, code: str, message: str) -> Response:
    """Return an error as JSON; on the pages as a page, with a link to sign in where that helps."""
    service: Service = request.app.state.service
    path = request.url.path
    message = service.settings.without_folder(message.encode(errors="replace").decode())
    if path.startswith(("/api/", "/lti/", "/review/", "/static/")):
        return JSONResponse({"code": code, "message": message}, status)
    with service.store.session() as session:
        visitor = service.guard.visitor(_without_token(request), session)
        call = Call(service, session, visitor, request, Response())
        return pages.page(call, "error.html", status, code=code, message=message)


def _without_token(request: Request) -> Request:
    """Return the request without its token: the page of an error shows nobody's data."""
    headers = [(name, value) for name, value in request.scope["headers"] if name != b"authorization"]
    return Request({**request.scope, "headers": headers})
