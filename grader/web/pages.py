"""The pages for browsers. All changes go through the routes of the API."""

import time
from functools import cache
from importlib.resources import files
from typing import Annotated, Any

import segno
from fastapi import APIRouter, Query
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from jinja2 import Environment, PackageLoader
from markupsafe import Markup

from grader.feedback.words import STATES, environment
from grader.folder.archives import ENDING
from grader.folder.inventory import FILE_TYPES
from grader.language import LANGUAGES, N_, tongue
from grader.lms.export import TARGETS
from grader.review.server import result_file
from grader.web import accounts, claims, instructors, lti, students
from grader.web.guard import HEADERS, missing
from grader.web.places import assignment_of
from grader.web.self_check import form_of
from grader.web.service import Call, Called, Key, Own, Route, moment
from reference.authored.assignment import built_in

router = APIRouter(route_class=Route, include_in_schema=False)
STATIC = {"app.js": "text/javascript", "app.css": "text/css"}
TEXTS = {
    "gone": N_("The server does not answer. Try again in a moment."),
    "sending": N_("Sending ..."),
    "waits": N_("Waiting: %(count)s before yours"),
    "looking": N_("Looking at the photo ..."),
    "left": N_("Attempts left: %(count)s"),
    "right": N_("All that you entered is right."),
    "right_read": N_("All that was read is right."),
    "nothing": N_("Nothing that this assignment asks for was entered."),
    "unread": N_("The drawing could not be read."),
    "uploaded": N_("%(done)s of %(total)s files are there"),
    "refused": N_("These files were not taken:"),
    "upload_ended": N_("All others are there. Load the page again to see them."),
    "sure": N_("This cannot be undone. Go on?"),
    "mailed": N_("If this is an account's address, a link to a new password is on its way."),
    "sent": N_("Your instructor has your request."),
    "receipt": N_("receipt"),
    "queued": N_("Waiting ..."),
    "opening": N_("Opening files"),
    "looking_at": N_("Looking at pages"),
    "marking": N_("Marking"),
    "in_file": N_("Students in the file: %(count)s."),
    "withheld": N_("withheld"),
    "unplaced": N_("no place in the file"),
    "copied": N_("Copied."),
}
QR_CODE = N_("The address as a QR code")


@cache
def _environment(lang: str) -> Environment:
    made = environment(lang).overlay(loader=PackageLoader("grader.web"))
    speaker = tongue(lang)
    made.globals["texts"] = {name: speaker.gettext(text) for name, text in TEXTS.items()}
    made.filters["moment"] = moment
    made.globals["languages"] = {one: tongue(one).name for one in LANGUAGES}
    return made


def page(call: Call, name: str, status: int = 200, /, **known: Any) -> Response:  # noqa: ANN401 - any facts
    """A page in the visitor's language; it has the token that its forms must send."""
    guard, lang = call.service.guard, call.lang
    text = (
        _environment(lang)
        .get_template(name)
        .render(
            token=guard.form_token(call.visitor),
            account=call.visitor.account,
            has_mail=bool(call.service.settings.mail),
            **known,
        )
    )
    response = HTMLResponse(text, status)
    guard.set_cookie(response, call.visitor)
    if call.request.query_params.get("lang") in LANGUAGES:
        response.set_cookie("planmark_lang", lang, max_age=31536000, samesite="lax", httponly=True)
    return response


@router.get("/")
def home(call: Called) -> Response:
    """An instructor's publications; for everybody else the way to a class and to sign in."""
    if call.visitor.account is None:
        return page(call, "home.html")
    return page(
        call, "publications.html", publications=instructors.publications(call), assignments=built_in()
    )


@router.get("/sign-in")
@router.get("/join")
@router.get("/reset")
@router.get("/forgotten")
def sign_in(call: Called, token: str = "") -> Response:
    """Show the form to sign in, to answer an invitation, or to choose or ask for a new password."""
    kind = call.request.url.path.strip("/")
    return page(call, "sign_in.html", secret=token[:200] if kind in {"join", "reset"} else "", kind=kind)


@router.get("/c/{key}")
def self_check(call: Called, key: Key) -> Response:
    """A student's page: check values or a photo, own feedback, requests."""
    publication = call.publication(key)
    if call.visitor.visit is None:
        # From now on a student counts by the own visit, not with all others behind the school's address.
        call.service.guard.count("address", call.visitor.address)
        call.service.guard.begin(call.session, call.visitor)
    link = call.link(publication)
    if link is None:
        students.open_for_checks(call, key)
        own, requests, sheets = [], [], list[dict[str, Any]]()
    else:
        own = students.own_reports(call, link) if publication.shows_feedback else []
        requests, sheets = students.own_requests(call, key), students.own_sheets(call, key)
    assignment = assignment_of(call.service.settings.data, publication)
    rows = call.places(publication).students() if link is not None else ()
    row = next((one for one in rows if link is not None and one.student_id == link.student_id), None)
    return page(
        call, "self_check.html", publication=publication, form=form_of(assignment, call.lang), link=link,
        own=own, requests=requests, sheets=sheets, row=row, takes_sheets=link and publication.takes_sheets,
        titles={one.id: one.title for _folder, report in own for one in report.criteria},
        is_open=publication.is_open or call.visitor.is_member(publication),
    )  # fmt: skip


@router.get("/s/{token}")
def open_link(call: Called, token: str) -> Response:
    """A personal link: it opens the class's page as the student's own."""
    link = students.enter(call, token)
    response = RedirectResponse(f"/c/{link.publication.key}", 303)
    call.service.guard.set_cookie(response, call.visitor)
    return response


@router.get("/publications/{key}")
def publication(call: Called, own: Own) -> Response:
    """Show an instructor's page of a class."""
    known = instructors.publication(call, own)
    names = {one["student_id"]: one["name"] for one in known["students"]}
    links = {one["student_id"]: one for one in instructors.links(call, own) if not one["is_revoked"]}
    address = f"{call.service.settings.address}/c/{own.key}"
    title = tongue(call.lang).gettext(QR_CODE)
    code = segno.make(address, micro=False).svg_inline(omitsize=True, light="#fff", title=title)
    return page(
        call, "publication.html", one=known, links=links, requests=instructors.requests(call, own),
        assignments=built_in(), colleagues=accounts.listed(call), platforms=TARGETS, states=STATES,
        open_ones=instructors.open_ones(known["standing"], call.lang),
        zone=moment(time.time()).split(" ", 2)[2],
        accepted=",".join((*FILE_TYPES, ENDING)), names=names,
        claims=claims.listed(call, own), address=address, picture=Markup(code),  # noqa: S704 - segno's
    )  # fmt: skip


@router.get("/publications/{key}/results/{path:path}")
def result_page(call: Called, own: Own, path: str) -> Response:
    """Show a page of the results, as `planmark grade` wrote it."""
    return result_file(call.places(own).results, path)


@router.get("/account")
def account(call: Called) -> Response:
    """The instructor's own account: tokens, and for administrators colleagues and the audit trail."""
    own = call.account
    return page(
        call, "account.html", tokens=accounts.tokens(call), accounts=accounts.listed(call),
        audit=instructors.audit(call) if own.is_admin else [], tool=lti.config(call),
        lti_platforms=lti.platforms(call) if own.is_admin else [],
        lti_members=lti.members(call) if own.is_admin else [],
    )  # fmt: skip


@router.get("/lti/choose")
def choose(call: Called, asked: Annotated[str, Query(alias="for", max_length=100)] = "") -> Response:
    """The choice of what a platform's activity shows; its answer may be posted to the platform."""
    response = page(call, "choose.html", choices=lti.choices(call, asked), name=asked)
    policy = HEADERS["Content-Security-Policy"].replace("form-action 'self'", "form-action https: http:")
    response.headers["Content-Security-Policy"] = policy
    return response


@router.get("/static/{name}")
def static(name: str) -> Response:
    """The script and the style sheet."""
    if name not in STATIC:
        raise missing()
    text = (files("grader.web") / "static" / name).read_text(encoding="utf-8")
    if name == "app.css":
        text = (files("grader.feedback") / "templates" / "style.css").read_text(encoding="utf-8") + text
    return Response(text, media_type=STATIC[name], headers={"Cache-Control": "public, max-age=300"})
