"""The web application: its routes, and who may use it.

It listens on this machine alone, or asks for a token. A page of another site can neither read nor post: the
Host header must be one of this machine's (a name that was made to point here is refused), and what is posted
must come from the page itself (Origin, a header of its own, JSON).
"""

import getpass
import hmac
import math
import threading
import time
from collections.abc import Awaitable, Callable, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from importlib.resources import files
from pathlib import Path
from typing import Annotated, Any
from urllib.parse import urlsplit

from jinja2 import PackageLoader
from pydantic import Field, ValidationError
from starlette.applications import Starlette
from starlette.concurrency import run_in_threadpool
from starlette.datastructures import MutableHeaders
from starlette.middleware import Middleware
from starlette.requests import Request
from starlette.responses import FileResponse, JSONResponse, RedirectResponse, Response
from starlette.routing import Route
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from grader.feedback.class_page import change_lines
from grader.feedback.words import VERDICTS, environment
from grader.language import N_, Tongue, tongue
from grader.lms.export import export, usual_name
from grader.lms.grades import Options
from grader.review import asked, audit, questions
from grader.review.records import (
    Answer,
    ChangedError,
    Drawn,
    Kept,
    Said,
    Standing,
    Student,
    Whole,
    page_criterion,
)
from grader.review.scans import page_of
from grader.review.session import Run, Session
from grader.tables.decision_texts import PageDecision, place_text
from grader.tables.decisions import Decision
from grader.texts.spoken import RefusedError, told_of
from reference.errors import PlanmarkError

LOOPBACK = frozenset({"127.0.0.1", "localhost", "::1"})
COOKIE = "planmark"
MOST_BYTES = 1_000_000
"""The most of a post: a thousand answers have a tenth of it."""
LONGEST_PX = 2000.0
COUNTING_S = 2.0
"""A person waits so long for a class of hundreds; other questions are counted when they are asked."""
HEADERS = {
    "Content-Security-Policy": "default-src 'none'; img-src 'self' data:; style-src 'self';"
    " script-src 'self'; connect-src 'self'; form-action 'none'; base-uri 'none'; frame-ancestors 'none'",
    "X-Content-Type-Options": "nosniff",
    "Referrer-Policy": "no-referrer",
    "Cross-Origin-Resource-Policy": "same-origin",
    "Cache-Control": "no-store",
}
EXPORTS = ("moodle", "canvas", "gradescope")
WORKING = N_("Updating the pages: %(done)d of %(total)d")
UP_TO_DATE = N_("The pages are up to date.")
CLASS_PAGE, TABLE = N_("the class's page"), N_("the table of grades")


@dataclass(slots=True)
class Review:
    """The application's handlers.

    Attributes
    ----------
    token : asked for where the server can be reached from elsewhere
    by : who decides, where another application has let them in; None on the own machine
    home : there the address of the class's page
    """

    session: Session
    lang: str = "en"
    token: str = ""
    by: str | None = None
    home: str = ""

    @property
    def speaker(self) -> Tongue:
        """The interface's language."""
        return tongue(self.lang)

    # Pages of the interface -----------------------------------------------------------------------

    def index(self, _request: Request) -> Response:
        """Show the page itself."""
        return self._page("review.html", questions.texts(self.speaker))

    def audit_page(self, _request: Request) -> Response:
        """Show the page on which settled verdicts are checked."""
        return self._page("audit.html", audit.texts(self.speaker))

    def _page(self, name: str, texts: dict[str, Any]) -> Response:
        made = environment(self.lang).overlay(loader=PackageLoader("grader.review"))
        page = made.get_template(name).render(
            title=self.session.batch.assignment.file.title.in_language(self.lang),
            texts=texts,
            by=_user() if self.by is None else self.by,
            is_known=self.by is not None,
            home=self.home,
            verdicts=VERDICTS,
        )
        return Response(page, media_type="text/html")

    # The class ------------------------------------------------------------------------------------

    def class_facts(self, request: Request) -> Response:
        """Return all students, or those that changed since the version that the page has."""
        self.session.refresh()
        return JSONResponse(self._facts(_whole(request.query_params.get("since", "-1"))))

    def _facts(self, since: int) -> dict[str, Any]:
        session, standing = self.session, self.session.standing()
        changed = [student for student in session.students if student.version > since]
        return {
            "version": session.version,
            "keys": [student.key for student in session.students],
            "students": list(self._students(changed, standing)),
            "comments": list(questions.kept_facts(session, self.speaker)),
            "pages": len(session.waiting_pages()),
        }

    def audit_facts(self, _request: Request) -> Response:
        """Return the next settled verdict to check, and the results so far."""
        self.session.refresh()
        return JSONResponse(audit.audit_facts(self.session, self.speaker))

    def _students(self, students: Sequence[Student], standing: Standing) -> Iterator[dict[str, Any]]:
        """Yield the facts of each student; the consequences of questions are counted for `COUNTING_S`."""
        until = time.monotonic() + COUNTING_S
        for one in students:
            open_ones = asked.asked_facts(self.session, one, self.speaker, until=until)
            yield questions.student_facts(one, standing, self.session.batch.rubric, self.speaker, open_ones)

    def question(self, request: Request) -> Response:
        """Return one question."""
        wanted = request.query_params
        student = self.session.student(wanted.get("student", ""))
        return JSONResponse(
            asked.asked_question(self.session, student, wanted.get("criterion", ""), self.speaker)
        )

    def pages(self, _request: Request) -> Response:
        """Return the pages without an owner or that were refused."""
        return JSONResponse(questions.pages_facts(self.session, self.speaker))

    # Pictures -------------------------------------------------------------------------------------

    def scan(self, request: Request) -> Response:
        """Return a part of a registered page."""
        asked = request.query_params
        student, sheet = self.session.student(asked.get("student", "")), _whole(asked.get("sheet", ""))
        page = self.session.page(student, sheet)
        x, y, w, h, scale = (_number(asked.get(name, "")) for name in ("x", "y", "w", "h", "scale"))
        if not (0.5 <= w <= 2000.0 and 0.5 <= h <= 2000.0 and 0.1 <= scale <= 100.0):
            raise RefusedError(400, "part_refused")
        scale = min(scale, 4000.0 / max(w, h))
        picture = self.session.scans.part(page, (x, y, w, h), scale)
        return Response(picture, media_type="image/jpeg", headers={"Cache-Control": "private, max-age=600"})

    def page_picture(self, request: Request) -> Response:
        """Return a page as it is stored."""
        asked = request.query_params
        ref = page_of(self.session.pages, asked.get("file", ""), _whole(asked.get("page", "")))
        return Response(self.session.scans.whole(ref, LONGEST_PX), media_type="image/jpeg")

    def out(self, request: Request) -> Response:
        """Return a page of the results."""
        return result_file(self.session.batch.out, request.path_params["path"])

    # Decisions ------------------------------------------------------------------------------------

    def after(self, act: Callable[[Any], object]) -> Callable[[Any], dict[str, Any]]:
        """Return a handler that acts, and returns what has changed by it."""

        def handler(said: Said) -> dict[str, Any]:
            since = self.session.version
            act(said)
            return self._facts(since)

        return handler

    def check(self, said: audit.Checked) -> dict[str, Any]:
        """Take a check of a settled verdict."""
        audit.check(self.session, said)
        return audit.audit_facts(self.session, self.speaker)

    def second_facts(self, request: Request) -> Response:
        """Return the next criterion to mark a second time, for whoever asks."""
        self.session.refresh()
        by = request.query_params.get("by", "") if self.by is None else self.by
        share = min(max(_number(request.query_params.get("share", "20")), 1.0), 100.0)
        return JSONResponse(audit.second_facts(self.session, by, share, self.speaker))

    def second(self, said: audit.Marked) -> dict[str, Any]:
        """Take a second marking."""
        audit.mark_again(self.session, said)
        return audit.second_facts(self.session, said.by, said.share, self.speaker)

    def node(self, said: "Moved") -> None:
        """Put a node elsewhere; it snaps to the ink there."""
        figure = said.node.partition(":")[0]
        at = self.session.snapped(said.student, said.sheet, figure, (said.x, said.y))
        answer = Answer(said.student, f"node:{said.node}", place_text(*at), seen=said.seen)
        self.session.decide([answer], said.by, said.window)

    def page(self, said: "OnPage") -> None:
        """Set a page's owner, turn and corners."""
        ref = page_of(self.session.pages, said.file, said.page)
        owner = None if said.owner is None else self.session.student(said.owner).report
        student_id = None if owner is None else owner.student_id
        decision = PageDecision(student_id, said.turn, tuple(said.corners))
        if not str(decision):
            raise RefusedError(400, "answer_refused", "answer_empty")
        position = None if owner is None else owner.position
        row = Decision("", position, page_criterion(ref), str(decision), by=said.by)
        self.session.decide_page(ref, row, said.seen, said.window)

    def undo(self, said: Said) -> dict[str, Any]:
        """Take back the last decision of a window."""
        since = self.session.version
        students, row = self.session.undo(said.window, said.by)
        undone = "" if row is None else f"{students[0].key}/{row.criterion}" if students else row.criterion
        return {**self._facts(since), "undone": undone}

    # The end --------------------------------------------------------------------------------------

    def finish(self, said: Said) -> dict[str, Any]:
        """Start to bring all pages up to date and to export."""
        if not self.session.run.running:
            self.session.run = Run(running=True)
            threading.Thread(target=self._finish, args=(self.session.run, said.by), daemon=True).start()
        return {}

    def _finish(self, run: Run, by: str) -> None:
        speaker, out = self.speaker, self.session.batch.out

        def progress(_what: str, done: int, total: int) -> None:
            run.progress = speaker.gettext(WORKING) % {"done": done, "total": total}

        try:
            results = self.session.bring_up_to_date(progress, by).results
            run.changes = list(change_lines(results, speaker))
            run.summary = speaker.gettext(UP_TO_DATE)
            if num := len(run.changes):
                told = speaker.ngettext("%(num)d mark has changed:", "%(num)d marks have changed:", num)
                run.summary = told % {"num": num}
            if self.home:  # which has the exports
                return
            options = Options(to="csv", what="grades", out=out, lang=self.lang)
            table = out / usual_name(options)
            export(results, table, options)
            run.files = [
                {"href": f"out/{name}", "label": speaker.gettext(label), "path": str(out / name)}
                for name, label in (("index.html", CLASS_PAGE), (table.name, TABLE))
            ]
        except PlanmarkError as error:
            run.message = told_of(error, speaker)
        finally:
            run.running = False

    def finished(self, _request: Request) -> Response:
        """Return the progress of that run, its changes and files, and the page or commands that follow."""
        out, known = self.session.batch.out, asdict(self.session.run)
        if self.home:
            return JSONResponse({**known, "to": f"{self.home}#marks"})
        commands = [f"planmark export {_quoted(out)} --to {name}" for name in EXPORTS]
        return JSONResponse({**known, "to": "", "commands": commands})


def result_file(folder: Path, name: str) -> FileResponse:
    """Return a page, picture or table from a folder of results, by its path there.

    Raises RefusedError for any other file, a hidden one, or one that is not there.
    """
    top = folder.resolve()
    path = top if "\0" in name else (top / name).resolve()
    is_shown = path.suffix in {".html", ".png", ".csv"} and path.is_relative_to(top) and path.is_file()
    if not is_shown or any(part.startswith(".") for part in path.relative_to(top).parts):
        raise RefusedError(404, "not_found", "no_page")
    return page_file(path)


def page_file(path: Path) -> FileResponse:
    """Return a page or picture that `planmark grade` wrote, with its styles and its script in it.

    It is alone in a sandbox: whatever it does, it reaches neither cookies nor the server.
    """
    policy = (
        "default-src 'none'; img-src 'self' data:; style-src 'unsafe-inline'; script-src 'unsafe-inline';"
        " frame-ancestors 'none'; sandbox allow-scripts allow-popups allow-downloads"
    )
    return FileResponse(path, headers={"Content-Security-Policy": policy})


def _user() -> str:
    try:
        return getpass.getuser()
    except (OSError, KeyError):  # nobody is logged in
        return ""


def _quoted(path: Path) -> str:
    text = str(path)
    return f'"{text}"' if " " in text else text


# What a request holds -----------------------------------------------------------------------------

Number = Annotated[int, Field(ge=0, lt=100_000)]
Place = Annotated[float, Field(gt=-1e5, lt=1e5, allow_inf_nan=False)]


class Answers(Said):
    """Answers that are written together."""

    answers: Annotated[list[Answer], Field(min_length=1)]


class Moved(Said):
    """A node, ``FIGURE:NODE``, and the place on a sheet that a person points at, mm."""

    student: str
    sheet: Number
    node: str
    x: Place
    y: Place
    seen: str = ""


class OnPage(Said):
    """A page's owner (a student's key), its turn in degrees, its corners in stored pixels."""

    file: str
    page: Number
    owner: str | None = None
    turn: int | None = None
    seen: str = ""
    corners: list[Annotated[tuple[Place, Place], Field(strict=False)]] = Field(default_factory=list)


def _whole(value: object) -> int:
    number = _number(value)
    if number != int(number):
        raise RefusedError(400, "answer_refused", "no_whole_number", given=number)
    return int(number)


def _number(value: object) -> float:
    try:
        number = float(str(value))
    except ValueError:
        number = math.nan
    if not abs(number) < 1e6:
        raise RefusedError(400, "answer_refused", "no_number", given=str(value)[:40])
    return number


# The application ----------------------------------------------------------------------------------


def application(
    session: Session, lang: str = "en", token: str = "", by: str | None = None, home: str = ""
) -> Starlette:
    """Return the web application of a class; with a `token`, only for those who have it.

    Arguments: `by` is who decides, where another application has let them in, and guards this one; `home`
    the address of its page of the class.
    """
    review = Review(session, lang, token, by, home)
    gets: dict[str, Callable[[Request], Response]] = {
        "/": review.index,
        "/audit": review.audit_page,
        "/audit.js": _static("audit.js", "text/javascript"),
        "/api/audit": review.audit_facts,
        "/api/second": review.second_facts,
        "/api/class": review.class_facts,
        "/api/question": review.question,
        "/api/pages": review.pages,
        "/api/finish": review.finished,
        "/scan": review.scan,
        "/page": review.page_picture,
        "/out/{path:path}": review.out,
        "/review.js": _static("review.js", "text/javascript"),
        "/viewer.js": _static("viewer.js", "text/javascript"),
        "/review.css": _static("review.css", "text/css"),
    }
    posts: dict[str, tuple[type[Said], Callable[[Any], dict[str, Any]]]] = {
        "/api/audit": (audit.Checked, review.check),
        "/api/second": (audit.Marked, review.second),
        "/api/decide": (
            Answers,
            review.after(lambda said: session.decide(said.answers, said.by, said.window)),
        ),
        "/api/ink": (Drawn, review.after(session.draw)),
        "/api/comment": (Kept, review.after(session.change_kept)),
        "/api/whole": (Whole, review.after(session.decide_whole)),
        "/api/node": (Moved, review.after(review.node)),
        "/api/page": (OnPage, review.after(review.page)),
        "/api/undo": (Said, review.undo),
        "/api/finish": (Said, review.finish),
    }
    return Starlette(
        routes=[
            *(Route(path, act) for path, act in gets.items()),
            *(Route(path, _posted(review, *one), methods=["POST"]) for path, one in posts.items()),
        ],
        middleware=[Middleware(Guarded, review=review)],
        exception_handlers={PlanmarkError: lambda _request, error: _refused(error, review)},
    )


def _static(name: str, kind: str) -> Callable[[Request], Response]:
    text = (files("grader.review") / "static" / name).read_text(encoding="utf-8")
    return lambda _request: Response(text, media_type=kind)


def _posted(
    review: Review, model: type[Said], act: Callable[[Any], dict[str, Any]]
) -> Callable[[Request], Awaitable[Response]]:
    async def handler(request: Request) -> Response:
        body = bytearray()
        async for part in request.stream():
            body += part
            if len(body) > MOST_BYTES:
                return _refused(RefusedError(413, "refused", "too_much_posted"), review)
        try:
            said = model.model_validate_json(bytes(body))
        except ValidationError as error:
            fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
            where = ".".join(map(str, fault["loc"]))
            return JSONResponse({"message": f"{where}: {fault['msg']}".lstrip(": ")}, 400)
        if review.by is not None:  # who decides is known, and takes back what is their own
            said = said.model_copy(update={"by": review.by, "window": f"{review.by} {said.window}"})
        return JSONResponse(await run_in_threadpool(act, said))

    return handler


def _refused(error: Exception, review: Review) -> Response:
    """Return an error in words."""
    speaker = review.speaker
    if isinstance(error, ChangedError):
        return JSONResponse({"message": _clash(error.there, speaker), "clash": True}, 409)
    assert isinstance(error, PlanmarkError)  # noqa: S101 - these alone are handled here
    told = told_of(error, speaker)
    status = error.status if isinstance(error, RefusedError) else 400
    return JSONResponse({"message": told, "code": error.code}, status)


def _clash(there: Decision | None, speaker: Tongue) -> str:
    """Say what somebody else has decided in the meantime."""
    if there is None:
        return speaker.gettext(questions.TAKEN_BACK)
    verdict = speaker.gettext(VERDICTS[there.verdict]) if there.verdict in VERDICTS else there.verdict
    who = there.by or speaker.gettext(questions.SOMEBODY)
    return speaker.gettext(questions.CLASH) % {"who": who, "verdict": verdict}


# Who may use it -----------------------------------------------------------------------------------


@dataclass(slots=True)
class Guarded:
    """ASGI application that refuses requests of others, and adds `HEADERS` to every answer."""

    app: ASGIApp
    review: Review

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI."""
        answer = refusal(Request(scope), self.review) or self.app
        await answer(scope, receive, with_headers(send, HEADERS))


def with_headers(send: Send, added: Mapping[str, str]) -> Send:
    """Return what sends an answer with some headers more; those that it has itself stay."""

    async def sent(message: Message) -> None:
        if message["type"] == "http.response.start":
            headers = MutableHeaders(scope=message)
            for name, value in added.items():
                headers.setdefault(name, value)
        await send(message)

    return sent


def refusal(request: Request, review: Review) -> Response | None:
    """Return the answer to a request of somebody who may not make it; None to all others."""
    host, token, is_let_in = request.headers.get("host", ""), review.token, review.by is not None
    if not token and not is_let_in and urlsplit(f"//{host}").hostname not in LOOPBACK:
        return _refused(RefusedError(403, "refused", "review_host"), review)
    if token and not hmac.compare_digest(request.cookies.get(COOKIE, "").encode(), token.encode()):
        given = request.query_params.get("token", "")
        if request.url.path == "/" and hmac.compare_digest(given.encode(), token.encode()):
            query = request.url.remove_query_params("token").query
            response = RedirectResponse(f"/?{query}" if query else "/", 303)
            response.set_cookie(COOKIE, token, httponly=True, samesite="lax")
            return response
        return _refused(RefusedError(401, "refused", "review_token"), review)
    if request.method == "POST" and not _is_own_page(request, host):
        return _refused(RefusedError(403, "refused", "review_form"), review)
    return None


def _is_own_page(request: Request, host: str) -> bool:
    headers = request.headers
    origin = headers.get("origin")
    is_same = origin is None or urlsplit(origin).netloc == host
    is_json = headers.get("content-type", "").partition(";")[0].strip() == "application/json"
    return is_same and is_json and headers.get("x-planmark") == "review"
