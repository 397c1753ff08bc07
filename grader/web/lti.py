"""LTI 1.3: launches from a learning platform, and grades returned to it (1EdTech LTI Core 1.3, AGS 2.0).

A platform is registered by an administrator. Its instructors get accounts, its students their personal
links, by launches; which publication an activity shows is chosen at an instructor's first launch, or by
deep linking. PyLTI1p3 checks messages; states and nonces are kept here, and each is good for one launch.
"""

import json
import secrets
import time
from collections.abc import Iterator, Mapping
from ipaddress import ip_address
from typing import Annotated, Any
from urllib.parse import urlsplit

import requests
from fastapi import APIRouter, Form
from fastapi.responses import JSONResponse, RedirectResponse, Response
from jwcrypto.jwk import JWK
from pydantic import AfterValidator, Field
from pylti1p3.assignments_grades import AssignmentsGradesService
from pylti1p3.cookie import CookieService
from pylti1p3.deep_link_resource import DeepLinkResource
from pylti1p3.deployment import Deployment
from pylti1p3.exception import LtiException, LtiServiceException, OIDCException
from pylti1p3.grade import Grade
from pylti1p3.launch_data_storage.base import LaunchDataStorage
from pylti1p3.lineitem import LineItem
from pylti1p3.message_launch import MessageLaunch
from pylti1p3.oidc_login import OIDCLogin
from pylti1p3.redirect import Redirect
from pylti1p3.registration import Registration
from pylti1p3.request import Request
from pylti1p3.service_connector import ServiceConnector
from pylti1p3.session import SessionService
from pylti1p3.tool_config.abstract import ToolConfAbstract
from sqlalchemy import delete, select

from grader.files import write_whole
from grader.inputs.roster import RosterRow, read_roster
from grader.language import N_
from grader.lms.export import draft, read_results
from grader.lms.grades import Options, Person
from grader.web.guard import RefusedError, missing
from grader.web.service import Call, Called, Key, Route
from grader.web.settings import Settings
from grader.web.store import (
    Account,
    Link,
    LtiActivity,
    LtiPlatform,
    LtiState,
    LtiUser,
    Publication,
    digest_of,
)
from grader.web.students import Strict
from reference.errors import PlanmarkError

router = APIRouter(route_class=Route, tags=["lti"])
CLAIM = "https://purl.imsglobal.org/spec/lti/claim/"
AGS = "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint"
DEEP = "https://purl.imsglobal.org/spec/lti-dl/claim/deep_linking_settings"
STATE_S = 600.0
"""A person may have to sign in to the platform between the two requests of a launch."""
TIMEOUT_S = (5.0, 20.0)
"""For a platform to answer: to connect, and to send."""
LOOPBACK = frozenset({"localhost", "127.0.0.1", "::1"})


# What a platform is registered with ---------------------------------------------------------------


def checked_url(url: str) -> str:
    """An address of a platform, over https; for tests on the own machine http. Raises ValueError.

    An address within the own network is refused: the server would be asked to reach into it.
    """
    parts = urlsplit(url)
    host = parts.hostname or ""
    if parts.scheme == "http" and host in LOOPBACK:
        return url
    if parts.scheme != "https" or not host or parts.username:
        raise ValueError("must begin with https://")
    try:
        is_inside = not ip_address(host).is_global
    except ValueError:
        is_inside = host == "localhost" or host.endswith((".local", ".internal"))
    if is_inside:
        raise ValueError("is an address within a network")
    return url


Url = Annotated[str, Field(max_length=500), AfterValidator(checked_url)]


class Platform(Strict):
    """A platform's own data, as it shows them when planmark is registered there."""

    issuer: Annotated[str, Field(min_length=1, max_length=500)]
    client_id: Annotated[str, Field(min_length=1, max_length=200)]
    auth_login_url: Url
    auth_token_url: Url
    key_set_url: Url
    deployments: Annotated[list[Annotated[str, Field(min_length=1, max_length=200)]], Field(min_length=1)]


@router.post("/api/v1/lti/platforms", status_code=201)
def register(call: Called, platform: Platform) -> dict[str, Any]:
    """Register a platform; one that is there already has its data changed."""
    admin = call.admin
    known = _platform(call, platform.issuer, platform.client_id)
    if known is None:
        known = LtiPlatform()
        call.session.add(known)
    for name, value in platform.model_dump().items():
        setattr(known, name, value)
    call.session.flush()
    call.note("platform registered", f"{platform.issuer} by {admin.name}")
    return {"id": known.id, **platform.model_dump()}


@router.get("/api/v1/lti/platforms")
def platforms(call: Called) -> list[dict[str, Any]]:
    """The registered platforms."""
    _ = call.admin
    names = ("id", *Platform.model_fields)
    return [{name: getattr(one, name) for name in names} for one in call.session.scalars(select(LtiPlatform))]


@router.delete("/api/v1/lti/platforms/{number}")
def unregister(call: Called, number: int) -> dict[str, str]:
    """Remove a platform; the accounts of its instructors stay, and nobody launches from it any more."""
    admin, found = call.admin, call.session.get(LtiPlatform, number)
    if found is None:
        raise missing("platform")
    call.session.delete(found)
    call.note("platform removed", f"{found.issuer} by {admin.name}")
    return {"state": "removed"}


@router.get("/lti/config")
def config(call: Called) -> dict[str, Any]:
    """What the platform asks for when planmark is registered there."""
    address = call.service.settings.address
    return {
        "title": "planmark",
        "description": "Velocity and acceleration plans: self-check, hand-in, feedback",
        "oidc_initiation_url": f"{address}/lti/login",
        "target_link_uri": f"{address}/lti/launch",
        "redirect_uris": [f"{address}/lti/launch"],
        "public_jwk_url": f"{address}/lti/jwks",
        "scopes": [
            "https://purl.imsglobal.org/spec/lti-ags/scope/lineitem",
            "https://purl.imsglobal.org/spec/lti-ags/scope/score",
        ],
        "messages": ["LtiResourceLinkRequest", "LtiDeepLinkingRequest"],
        "opens_in": "a new window",
    }


@router.get("/lti/jwks")
def jwks(call: Called) -> dict[str, Any]:
    """The server's public key."""
    return {
        "keys": [{**own_key(call.service.settings).export_public(as_dict=True), "alg": "RS256", "use": "sig"}]
    }


def own_key(settings: Settings) -> JWK:
    """The server's key pair, made once."""
    path = settings.data / "lti-key.json"
    if not path.is_file():
        made = JWK.generate(kty="RSA", size=2048, kid=secrets.token_hex(8))
        write_whole(path, made.export(private_key=True))
        path.chmod(0o600)
    return JWK.from_json(path.read_text(encoding="utf-8"))


# PyLTI1p3 at work on our requests -------------------------------------------------------------------


class _Request(Request):
    def __init__(self, call: Call, form: Mapping[str, Any]) -> None:
        self.call, self.form = call, form

    @property
    def session(self) -> dict[str, Any]:
        return {}

    def is_secure(self) -> bool:
        return self.call.service.settings.is_https

    def get_param(self, key: str) -> str:
        value = self.form.get(key, self.call.request.query_params.get(key, ""))
        return value if isinstance(value, str) else ""


class _Cookies(CookieService):
    """The state's cookie; a launch is posted by another site, so that it must be sent from there, too."""

    def __init__(self, call: Call) -> None:
        self.call, self.wanted = call, dict[str, str]()

    def get_cookie(self, name: str) -> str | None:
        return self.call.request.cookies.get(f"planmark-{name}")

    def set_cookie(self, name: str, value: str | int, exp: int | None = 3600) -> None:
        del exp
        self.wanted[f"planmark-{name}"] = str(value)

    def put_on(self, response: Response) -> Response:
        secure = self.call.service.settings.is_https
        for name, value in self.wanted.items():
            response.set_cookie(
                name, value, max_age=int(STATE_S), secure=secure, httponly=True,
                samesite="none" if secure else "lax", path="/lti",
            )  # fmt: skip
        return response


class _Storage(LaunchDataStorage[Any]):
    """Nonces in the data base, each good for one launch."""

    def __init__(self, call: Call) -> None:
        self.call = call

    def get_session_cookie_name(self) -> str | None:
        return None

    def can_set_keys_expiration(self) -> bool:
        return False

    def get_value(self, key: str) -> Any:  # noqa: ANN401 - PyLTI1p3's own
        del key

    def set_value(self, key: str, value: Any, exp: int | None = None) -> None:  # noqa: ANN401 - as above
        del value, exp
        if "nonce" in key:
            expires = time.time() + STATE_S
            self.call.session.add(LtiState(id=digest_of(key), expires=expires))

    def check_value(self, key: str) -> bool:
        now, session = time.time(), self.call.session
        session.execute(delete(LtiState).where(LtiState.expires < now))
        taken = session.execute(delete(LtiState).where(LtiState.id == digest_of(key)))
        session.commit()
        return bool(taken.rowcount)  # type: ignore[attr-defined]


class _Tool(ToolConfAbstract[_Request]):
    """The registered platforms as PyLTI1p3 asks for them."""

    def __init__(self, call: Call) -> None:
        self.call = call

    def check_iss_has_one_client(self, iss: str) -> bool:
        del iss
        return False

    def check_iss_has_many_clients(self, iss: str) -> bool:
        del iss
        return True

    def find_registration_by_issuer(self, iss: str, *_rest: object, **_known: object) -> Registration:
        return self.find_registration_by_params(iss, None)

    def find_registration_by_params(
        self, iss: str, client_id: str | None, *_rest: object, **_known: object
    ) -> Registration:
        found = _platform(self.call, iss, client_id)
        if found is None:
            raise LtiException("the platform is not registered here")
        return registration_of(found, self.call.service.settings)

    def find_deployment(self, iss: str, deployment_id: str) -> Deployment | None:
        return self.find_deployment_by_params(iss, deployment_id, "")

    def find_deployment_by_params(
        self, iss: str, deployment_id: str, client_id: str, *_rest: object, **_known: object
    ) -> Deployment | None:
        found = _platform(self.call, iss, client_id)
        if found is None or deployment_id not in found.deployments:
            return None
        return Deployment().set_deployment_id(deployment_id)


class _Redirect(Redirect[Response]):
    def __init__(self, address: str, cookies: _Cookies) -> None:
        self.address, self.cookies = address, cookies

    def do_redirect(self) -> Response:
        return self.cookies.put_on(RedirectResponse(self.address, 303))

    def do_js_redirect(self) -> Response:
        return self.do_redirect()

    def set_redirect_url(self, location: str) -> None:
        self.address = location

    def get_redirect_url(self) -> str:
        return self.address


class _Login(OIDCLogin[_Request, _Tool, SessionService, _Cookies, Response]):
    def get_redirect(self, url: str) -> _Redirect:
        return _Redirect(url, self._cookie_service)


class _Launch(MessageLaunch[_Request, _Tool, SessionService, _Cookies]):
    def _get_request_param(self, key: str) -> str:
        return self._request.get_param(key)


class _Registration(Registration):
    """A platform with our key; the key's name goes into the header of what we sign."""

    kid = ""

    def get_kid(self) -> str:
        return self.kid


def registration_of(platform: LtiPlatform, settings: Settings) -> Registration:
    """A platform with our key, as PyLTI1p3 takes it."""
    key = own_key(settings)
    made = _Registration()
    made.kid = str(key["kid"])
    made.set_issuer(platform.issuer).set_client_id(platform.client_id)
    made.set_auth_login_url(platform.auth_login_url).set_auth_token_url(platform.auth_token_url)
    made.set_key_set_url(platform.key_set_url)
    made.set_tool_private_key(key.export_to_pem(private_key=True, password=None).decode())
    made.set_tool_public_key(key.export_to_pem().decode())
    return made


def caller() -> requests.Session:
    """What asks a platform: with limits of time, and without being led elsewhere."""

    class Bounded(requests.Session):
        def request(self, *arguments: Any, **known: Any) -> requests.Response:  # noqa: ANN401 - as requests has it
            known |= {"timeout": TIMEOUT_S, "allow_redirects": False}
            return super().request(*arguments, **known)

    return Bounded()


def _platform(call: Call, issuer: str, client_id: str | None) -> LtiPlatform | None:
    own = select(LtiPlatform).where(LtiPlatform.issuer == issuer)
    found = call.session.scalars(
        own if not client_id else own.where(LtiPlatform.client_id == client_id)
    ).all()
    return found[0] if len(found) == 1 else None


# Launches -------------------------------------------------------------------------------------------


def _login(call: Call, form: Mapping[str, Any]) -> Response:
    request, cookies = _Request(call, form), _Cookies(call)
    try:
        login = _Login(request, _Tool(call), SessionService(request), cookies, _Storage(call))
        return login.redirect(f"{call.service.settings.address}/lti/launch")
    except (OIDCException, LtiException, KeyError) as error:
        raise RefusedError(400, "lti_login", f"the platform's login is refused: {error}") from error


@router.get("/lti/login")
def login_by_address(call: Called) -> Response:
    """The first request of a launch."""
    return _login(call, {})


@router.post("/lti/login")
def login(
    call: Called,
    iss: Annotated[str, Form(max_length=500)] = "",
    login_hint: Annotated[str, Form(max_length=4000)] = "",
    client_id: Annotated[str, Form(max_length=200)] = "",
    lti_message_hint: Annotated[str, Form(max_length=4000)] = "",
) -> Response:
    """The first request of a launch, as a form."""
    form = {
        "iss": iss,
        "login_hint": login_hint,
        "client_id": client_id,
        "lti_message_hint": lti_message_hint,
    }
    return _login(call, form)


@router.post("/lti/launch")
def launch(
    call: Called,
    id_token: Annotated[str, Form(max_length=50_000)] = "",
    state: Annotated[str, Form(max_length=200)] = "",
    error: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    """The second request of a launch, which the platform has signed."""
    if error:
        raise RefusedError(400, "lti_launch", f"the platform does not launch: {error}")
    data, message = _validated(call, {"id_token": id_token, "state": state})
    platform = _platform(call, data["iss"], message.get_client_id())
    if platform is None:
        raise missing("platform")
    is_teacher = message.check_teacher_access() or message.check_staff_access()
    user = _user(call, platform, data, is_teacher=is_teacher)
    if is_teacher:
        return _taught(call, message, user, data)
    return _learnt(call, user, data)


def _validated(call: Call, form: Mapping[str, str]) -> tuple[dict[str, Any], _Launch]:
    request, cookies = _Request(call, form), _Cookies(call)
    message = _Launch(
        request, _Tool(call), SessionService(request), cookies, _Storage(call), requests_session=caller()
    )
    try:
        return dict(message.get_launch_data()), message
    except (LtiException, KeyError, TypeError, ValueError, AttributeError) as error:
        why = f"the launch is refused: {error}"
        if "State not found" in str(error):
            why += ": allow cookies of this server, or open the activity in a new window"
        raise RefusedError(403, "lti_launch", why) from error


def _user(call: Call, platform: LtiPlatform, data: Mapping[str, Any], *, is_teacher: bool) -> LtiUser:
    """The platform's user as known here; a teacher gets an account at the first launch."""
    subject = str(data["sub"])[:255]
    own = select(LtiUser).where(LtiUser.platform_id == platform.id, LtiUser.subject == subject)
    user = call.session.scalar(own)
    if user is None:
        user = LtiUser(platform_id=platform.id, subject=subject)
        call.session.add(user)
    if is_teacher and user.account is None:
        name = str(data.get("name") or subject)[:60]
        taken = call.session.scalar(select(Account).where(Account.name == name))
        account = Account(name=name if taken is None else f"{name} {secrets.token_hex(4)}")
        call.session.add(account)
        user.account = account
    call.session.flush()
    return user


def _activity(call: Call, user: LtiUser, data: Mapping[str, Any]) -> LtiActivity:
    """The platform's activity, with where its grades go; made at its first launch."""
    link = str(data.get(f"{CLAIM}resource_link", {}).get("id", ""))[:255]
    deployment = str(data[f"{CLAIM}deployment_id"])[:200]
    own = select(LtiActivity).where(
        LtiActivity.platform_id == user.platform_id, LtiActivity.deployment == deployment,
        LtiActivity.resource_link == link,
    )  # fmt: skip
    activity = call.session.scalar(own)
    if activity is None:
        activity = LtiActivity(platform_id=user.platform_id, deployment=deployment, resource_link=link)
        call.session.add(activity)
    activity.grades = data.get(AGS) or {}
    return activity


def _taught(call: Call, message: _Launch, user: LtiUser, data: Mapping[str, Any]) -> Response:
    """An instructor's launch: to the publication, or to the choice of one."""
    account = user.account
    if account is None:
        raise missing("account")
    call.service.guard.begin(call.session, call.visitor, account)
    call.note("launched")
    if message.is_deep_link_launch():
        waiting = {"settings": dict(data[DEEP])}
        waiting |= {"platform": user.platform_id, "deployment": data[f"{CLAIM}deployment_id"]}  # type: ignore[dict-item]
        return _led(call, f"/lti/choose?for={_kept(call, waiting)}")
    activity = _activity(call, user, data)
    custom = str(data.get(f"{CLAIM}custom", {}).get("publication", ""))
    if activity.publication_id is None and custom:
        wanted = call.session.scalar(select(Publication).where(Publication.key == custom))
        if wanted is not None and call.visitor.is_member(wanted):
            activity.publication_id = wanted.id
    call.session.flush()
    if activity.publication_id is None:
        return _led(call, f"/lti/choose?for={_kept(call, {'activity': activity.id})}")
    publication = call.session.get_one(Publication, activity.publication_id)
    if not call.visitor.is_member(publication):
        # Who teaches the activity on the platform works on its class here.
        publication.members.append(account)
        call.note("member added", f"{publication.key} {account.name}")
    return _led(call, f"/publications/{publication.key}")


def _learnt(call: Call, user: LtiUser, data: Mapping[str, Any]) -> Response:
    """A student's launch: to the publication, as the student of its roster who has the same id or e-mail."""
    activity = _activity(call, user, data)
    publication = (
        None if activity.publication_id is None else call.session.get(Publication, activity.publication_id)
    )
    if publication is None:
        why = N_("your instructor has not chosen yet what this activity shows")
        raise RefusedError(404, "lti_unchosen", why)
    row = _row_of(call, publication, data)
    visit = call.service.guard.begin(call.session, call.visitor)
    if row is not None:
        user.students = {**user.students, str(publication.id): row.student_id}
        expires = time.time() + call.service.settings.link_days * 86400.0
        link = Link(publication=publication, student_id=row.student_id, expires=expires)
        call.session.add(link)
        call.session.flush()
        visit.links = {**visit.links, str(publication.id): link.id}
    return _led(call, f"/c/{publication.key}")


def _row_of(call: Call, publication: Publication, data: Mapping[str, Any]) -> RosterRow | None:
    """The student's line of the roster: by the platform's id of the person, or by e-mail."""
    roster = call.places(publication).roster
    try:
        rows = read_roster(roster).rows if roster.is_file() else ()
    except PlanmarkError:
        return None
    lis = data.get(f"{CLAIM}lis") or {}
    ids = {str(one) for one in (lis.get("person_sourcedid"), data["sub"]) if one}
    email = str(data.get("email") or "").casefold()
    named = [row for row in rows if row.student_id in ids]
    mailed = [row for row in rows if email and (row.email or "").casefold() == email]
    found = {row.student_id: row for row in (named or mailed)}
    return next(iter(found.values())) if len(found) == 1 else None


def _led(call: Call, path: str) -> Response:
    response = RedirectResponse(path, 303)
    call.service.guard.set_cookie(response, call.visitor)
    return response


# What an activity shows -----------------------------------------------------------------------------


def _kept(call: Call, what: Mapping[str, Any]) -> str:
    """A name for what an instructor is asked about now."""
    name = secrets.token_urlsafe(24)
    visit = call.visitor.visit
    said = {**what, "visit": "" if visit is None else visit.id}
    call.session.add(LtiState(id=digest_of(name), expires=time.time() + STATE_S, what=said))
    return name


def choices(call: Call, name: str) -> list[Publication]:
    """The publications that the instructor may choose. Raises RefusedError without a launch that waits."""
    _asked(call, name)
    found = call.session.scalars(select(Publication).order_by(Publication.id.desc()))
    return [one for one in found if call.visitor.is_member(one)]


@router.post("/api/v1/lti/chosen/{name}")
def choose(call: Called, name: Key, key: str) -> Response:
    """Say which publication an activity shows; to a deep link the signed answer is given."""
    state, publication = _asked(call, name), call.own(key)
    what = state.what
    call.session.delete(state)
    if "activity" in what:
        call.session.get_one(LtiActivity, what["activity"]).publication_id = publication.id
        call.note("activity chosen", key)
        return JSONResponse({"address": f"/publications/{key}"})
    platform = call.session.get(LtiPlatform, what["platform"])
    if platform is None:
        raise missing("platform")
    answer = _deep_link(call, platform, what, publication)
    call.note("deep link", key)
    return JSONResponse({"address": what["settings"]["deep_link_return_url"], "JWT": answer})


def _asked(call: Call, name: str) -> LtiState:
    account, state = call.account, call.session.get(LtiState, digest_of(name))
    visit = call.visitor.visit
    if state is None or visit is None or state.what.get("visit") != visit.id or account is None:
        raise RefusedError(404, "lti_choice", "open the activity on the platform again, then choose")
    return state


def _deep_link(call: Call, platform: LtiPlatform, what: Mapping[str, Any], publication: Publication) -> str:
    """The signed answer to a deep linking request."""
    from pylti1p3.deep_link import DeepLink  # noqa: PLC0415 - used here alone

    settings = call.service.settings
    registration = registration_of(platform, settings)
    resource = DeepLinkResource().set_url(f"{settings.address}/lti/launch").set_title(publication.title)
    resource.set_custom_params({"publication": publication.key})
    made = DeepLink(registration, what["deployment"], what["settings"])
    return str(made.get_response_jwt([resource]))


# Grades ---------------------------------------------------------------------------------------------


@router.post("/api/v1/publications/{key}/lti/scores")
def send_scores(call: Called, key: Key) -> dict[str, Any]:
    """Send the grades that are new or have changed to the activities that show the publication.

    What a platform refuses is told for each student, and sent again the next time; who waits for a person, or
    has never launched the activity, is told, too.
    """
    own = call.own(key)
    activities = call.session.scalars(select(LtiActivity).where(LtiActivity.publication_id == own.id)).all()
    if not activities:
        raise RefusedError(404, "lti_activity", "no activity of a platform shows this assignment")
    results = read_results(call.places(own).results)
    told: dict[str, Any] = {"sent": [], "same": [], "refused": {}, "withheld": {}}
    for activity in activities:
        users = {
            user.students[str(own.id)]: user.subject
            for user in call.session.scalars(
                select(LtiUser).where(LtiUser.platform_id == activity.platform_id)
            )
            if str(own.id) in user.students
        }
        people = {student: Person(platform_id=subject) for student, subject in users.items()}
        delivery = draft(results, Options(to="lti", people=people, item=own.title))
        told["withheld"] |= {**delivery.withheld, **delivery.unplaced}
        document = json.loads(str(delivery.content))
        students = {subject: student for student, subject in users.items()}
        for student, why in _sent(call, activity, document, students):
            match why:
                case "sent" | "same":
                    told[why].append(student)
                case _:
                    told["refused"][student] = why
    call.note("grades sent", f"{key}: {len(told['sent'])}")
    return told


def _sent(
    call: Call, activity: LtiActivity, document: Mapping[str, Any], students: Mapping[str, str]
) -> Iterator[tuple[str, str]]:
    """Each student with ``sent``, ``same``, or why the platform did not take the grade."""
    platform = call.session.get_one(LtiPlatform, activity.platform_id)
    registration = registration_of(platform, call.service.settings)
    endpoint: Any = {"scope": [], **activity.grades}
    service = AssignmentsGradesService(ServiceConnector(registration, caller()), endpoint)
    item = document["lineItem"]
    line = None
    for score in document["scores"]:
        student = students[score["userId"]]
        if score["gradingProgress"] != "FullyGraded":
            continue
        mark = digest_of(json.dumps({**score, "timestamp": ""}, sort_keys=True))
        if activity.sent.get(student) == mark:
            yield student, "same"
            continue
        try:
            if line is None and not activity.grades.get("lineitem"):
                wanted = LineItem().set_label(item["label"]).set_score_maximum(item["scoreMaximum"])
                wanted.set_tag(item["tag"]).set_resource_id(item["resourceId"])
                line = service.find_or_create_lineitem(wanted)
            grade = Grade().set_score_given(score["scoreGiven"]).set_score_maximum(score["scoreMaximum"])
            grade.set_activity_progress(score["activityProgress"]).set_user_id(score["userId"])
            grade.set_grading_progress(score["gradingProgress"]).set_timestamp(score["timestamp"])
            service.put_grade(grade.set_comment(score["comment"]), line)
        except (LtiException, LtiServiceException, requests.RequestException, KeyError, ValueError) as error:
            response = getattr(error, "response", None)
            yield student, f"{error}" if response is None else f"the platform answers {response.status_code}"
        else:
            activity.sent = {**activity.sent, student: mark}
            call.session.commit()
            yield student, "sent"
