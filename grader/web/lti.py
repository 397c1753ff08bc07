"""LTI 1.3: launches from a learning platform, and grades returned to it (1EdTech LTI Core 1.3, AGS 2.0).

A platform is registered by an administrator. Its instructors get accounts, its students their personal
links, by launches (`grader.web.launch`, `grader.web.claims`); which publication an activity shows is chosen
at an instructor's first launch, or by deep linking. PyLTI1p3 speaks with the platform's services.
"""

import json
import secrets
import time
from collections.abc import Iterator, Mapping
from typing import Annotated, Any

import requests
from fastapi import APIRouter, Form, Query
from fastapi.responses import JSONResponse, RedirectResponse, Response
from jwcrypto.jwk import JWK
from pydantic import BaseModel, Field
from pylti1p3.assignments_grades import AssignmentsGradesService
from pylti1p3.deep_link_resource import DeepLinkResource
from pylti1p3.exception import LtiException
from pylti1p3.grade import Grade
from pylti1p3.lineitem import LineItem
from pylti1p3.registration import Registration
from pylti1p3.service_connector import ServiceConnector
from sqlalchemy import delete, select

from grader.files import write_whole
from grader.language import tongue
from grader.lms.export import draft, read_results
from grader.lms.grades import Options, Person
from grader.records import Reason
from grader.rubric import rubric_of
from grader.texts.spoken import RefusedError, told
from grader.web.claims import claimed, row_of, take_back_links
from grader.web.guard import missing
from grader.web.launch import STATE_S, Message, began, checked, platform_of
from grader.web.outside import caller, why_not_asked
from grader.web.places import assignment_of
from grader.web.service import Call, Called, Key, Own, Route, Row
from grader.web.settings import Settings
from grader.web.store import (
    Account,
    Link,
    LtiActivity,
    LtiClaim,
    LtiPlatform,
    LtiState,
    LtiUser,
    Member,
    Publication,
    Visit,
    columns_of,
    digest_of,
)
from grader.web.students import Strict

router = APIRouter(route_class=Route, tags=["lti"])


# What a platform is registered with ---------------------------------------------------------------


Url = Annotated[str, Field(min_length=1, max_length=500)]


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
    for name in ("auth_login_url", "auth_token_url", "key_set_url"):
        wrong = why_not_asked(getattr(platform, name), is_local=call.service.settings.is_local)
        if wrong is not None:
            raise RefusedError(422, "address", wrong, field=name)
    known = platform_of(call, platform.issuer, platform.client_id)
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
    found = call.session.scalars(select(LtiPlatform))
    return [columns_of(one, "id", *Platform.model_fields) for one in found]


@router.delete("/api/v1/lti/platforms/{number}")
def unregister(call: Called, number: Row) -> dict[str, str]:
    """Remove a platform, and with it what launches from it gave: membership, visits, students' links."""
    admin, found = call.admin, call.row(LtiPlatform, number, "platform")
    session, users = call.session, select(LtiUser.id).where(LtiUser.platform_id == number)
    take_back_links(call, session.scalars(select(LtiClaim.id).where(LtiClaim.user_id.in_(users))).all())
    session.execute(delete(Member).where(Member.platform_id == number))
    accounts = select(LtiUser.account_id).where(LtiUser.platform_id == number)
    session.execute(delete(Visit).where(Visit.account_id.in_(accounts)))
    session.delete(found)
    call.note("platform removed", f"{found.issuer} by {admin.name}")
    return {"state": "removed"}


@router.get("/api/v1/lti/members")
def members(call: Called) -> list[dict[str, Any]]:
    """The publications that people from platforms work on, and whether a launch let them in."""
    _ = call.admin
    found = call.session.execute(
        select(Publication, Account, LtiPlatform, Member)
        .join(Member, Member.publication_id == Publication.id)
        .join(Account, Account.id == Member.account_id)
        .join(LtiUser, LtiUser.account_id == Account.id)
        .join(LtiPlatform, LtiPlatform.id == LtiUser.platform_id)
        .order_by(Publication.id, Account.id)
    )
    return [
        {"publication": one.key, "title": one.title, "id": account.id, "name": account.name,
         "platform": platform.issuer, "by_launch": member.platform_id is not None}
        for one, account, platform, member in found
    ]  # fmt: skip


@router.get("/lti/config")
def config(call: Called) -> dict[str, Any]:
    """Return what a platform asks for when planmark is registered there."""
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


# Launches -------------------------------------------------------------------------------------------


class Login(BaseModel):
    """The first request of a launch."""

    iss: Annotated[str, Field(max_length=500)] = ""
    login_hint: Annotated[str, Field(max_length=4000)] = ""
    client_id: Annotated[str, Field(max_length=200)] = ""
    lti_message_hint: Annotated[str, Field(max_length=4000)] = ""


@router.get("/lti/login")
def login_by_address(call: Called, asked: Annotated[Login, Query()]) -> Response:
    """Begin a launch, asked for by an address."""
    return login(call, asked)


@router.post("/lti/login")
def login(call: Called, asked: Annotated[Login, Form()]) -> Response:
    """Begin a launch, asked for by a form."""
    platform = platform_of(call, asked.iss, asked.client_id)
    if platform is None or not asked.login_hint:
        why = "login_unregistered" if platform is None else "login_for_nobody"
        raise RefusedError(400, "lti_login", why)
    return began(call, platform, asked.model_dump(include={"login_hint", "lti_message_hint"}))


@router.post("/lti/launch")
def launch(
    call: Called,
    id_token: Annotated[str, Form(max_length=50_000)] = "",
    state: Annotated[str, Form(max_length=200)] = "",
    error: Annotated[str, Form(max_length=200)] = "",
) -> Response:
    """Take the second request of a launch, which the platform has signed."""
    if error:
        raise RefusedError(400, "lti_launch", "launch_ended")
    call.service.guard.count("address", call.visitor.address)
    message, platform = checked(call, state, id_token)
    user = _user(call, platform, message)
    return _taught(call, user, message) if message.is_teacher else _learnt(call, user, message)


def _user(call: Call, platform: LtiPlatform, message: Message) -> LtiUser:
    """The platform's user as known here; a teacher gets an account at the first launch."""
    own = select(LtiUser).where(LtiUser.platform_id == platform.id, LtiUser.subject == message.sub)
    user = call.session.scalar(own)
    if user is None:
        user = LtiUser(platform_id=platform.id, subject=message.sub)
        call.session.add(user)
    if message.is_teacher and user.account is None:
        name = (message.name or message.sub)[:60]
        taken = call.session.scalar(select(Account).where(Account.name == name))
        account = Account(name=name if taken is None else f"{name} {secrets.token_hex(4)}")
        call.session.add(account)
        user.account = account
    call.session.flush()
    return user


def _activity(call: Call, user: LtiUser, message: Message) -> LtiActivity:
    """The platform's activity, with where its grades go; made at its first launch."""
    link = "" if message.link is None else message.link.id
    own = select(LtiActivity).where(
        LtiActivity.platform_id == user.platform_id, LtiActivity.deployment == message.deployment,
        LtiActivity.resource_link == link,
    )  # fmt: skip
    activity = call.session.scalar(own)
    if activity is None:
        activity = LtiActivity(
            platform_id=user.platform_id, deployment=message.deployment, resource_link=link
        )
        call.session.add(activity)
    activity.grades = {} if message.grades is None else message.grades.model_dump(exclude_none=True)
    return activity


def _taught(call: Call, user: LtiUser, message: Message) -> Response:
    """An instructor's launch: to the publication, or to the choice of one."""
    account = user.account
    if account is None:
        raise missing("account")
    call.service.guard.begin(call.session, call.visitor, account)
    call.note("launched")
    if message.choice is not None and message.link is None:
        waiting = {"settings": message.choice.model_dump(), "platform": user.platform_id}
        return _led(call, f"/lti/choose?for={_kept(call, {**waiting, 'deployment': message.deployment})}")
    activity = _activity(call, user, message)
    custom = str((message.custom or {}).get("publication", ""))
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
        own = Member(publication_id=publication.id, account_id=account.id, platform_id=user.platform_id)
        call.session.add(own)
        call.note("member added", f"{publication.key} {account.name}")
    return _led(call, f"/publications/{publication.key}")


def _learnt(call: Call, user: LtiUser, message: Message) -> Response:
    """A student's launch: to the publication, as the student of its roster who has the same id or e-mail."""
    activity = _activity(call, user, message)
    publication = (
        None if activity.publication_id is None else call.session.get(Publication, activity.publication_id)
    )
    if publication is None:
        raise RefusedError(404, "lti_unchosen")
    _let_out(call, user, publication)
    visit = call.visitor.visit
    if visit is not None:  # whoever used this browser before is not the one who comes now
        visit.links = {name: link for name, link in visit.links.items() if name != str(publication.id)}
    row = row_of(call, publication, message)
    link = None
    if row is not None:
        claim = claimed(call, user, publication, row.student_id, message)
        expires = time.time() + call.service.settings.link_days * 86400.0
        link = Link(publication=publication, student_id=row.student_id, expires=expires, claim_id=claim.id)
        call.session.add(link)
        call.session.flush()
    call.service.guard.begin(call.session, call.visitor, link=link)
    return _led(call, f"/c/{publication.key}")


def _let_out(call: Call, user: LtiUser, publication: Publication) -> None:
    """End the membership that an earlier launch gave to somebody who does not teach the course now."""
    ended = call.session.execute(
        delete(Member).where(
            Member.publication_id == publication.id, Member.account_id == user.account_id,
            Member.platform_id == user.platform_id,
        )
    )  # fmt: skip
    if ended.rowcount:  # type: ignore[attr-defined]
        name = "" if user.account is None else user.account.name
        call.note("member removed", f"{publication.key} {name}: no role in the course")


def _led(call: Call, path: str) -> Response:
    response = RedirectResponse(path, 303)
    call.service.guard.set_cookie(response, call.visitor)
    return response


# What an activity shows -----------------------------------------------------------------------------


def _kept(call: Call, what: Mapping[str, Any]) -> str:
    """Store a question to an instructor; return its name."""
    name = secrets.token_urlsafe(24)
    visit = call.visitor.visit
    said = {**what, "visit": "" if visit is None else visit.id}
    call.session.add(LtiState(id=digest_of(name), expires=time.time() + STATE_S, what=said))
    return name


def choices(call: Call, name: str) -> list[Publication]:
    """The publications that the instructor may choose. Raises RefusedError without a launch that waits."""
    _asked(call, name)
    return call.all_own()


@router.post("/api/v1/lti/chosen/{name}")
def choose(call: Called, name: Key, key: str) -> Response:
    """Set the publication that an activity shows; return the signed answer to a deep link."""
    state, publication = _asked(call, name), call.own(key)
    what = state.what
    call.session.delete(state)
    if "activity" in what:
        call.session.get_one(LtiActivity, what["activity"]).publication_id = publication.id
        call.note("activity chosen", key)
        return JSONResponse({"address": f"/publications/{key}"})
    platform = call.row(LtiPlatform, what["platform"], "platform")
    answer = _deep_link(call, platform, what, publication)
    call.note("deep link", key)
    return JSONResponse({"address": what["settings"]["deep_link_return_url"], "JWT": answer})


def _asked(call: Call, name: str) -> LtiState:
    _ = call.account
    state, visit = call.session.get(LtiState, digest_of(name)), call.visitor.visit
    if state is None or visit is None or state.what.get("visit") != visit.id:
        raise RefusedError(404, "lti_choice")
    return state


def _deep_link(call: Call, platform: LtiPlatform, what: Mapping[str, Any], publication: Publication) -> str:
    """The signed answer to a deep linking request."""
    from pylti1p3.deep_link import DeepLink  # noqa: PLC0415 - used here alone

    settings = call.service.settings
    registration = registration_of(platform, settings)
    resource = DeepLinkResource().set_url(f"{settings.address}/lti/launch").set_title(publication.title)
    resource.set_custom_params({"publication": publication.key})
    if publication.assignment:
        # Without it Moodle makes an activity out of 100.
        assignment = assignment_of(settings.data, publication)
        item = LineItem().set_score_maximum(rubric_of(assignment).max_score).set_tag("grade")
        resource.set_lineitem(item.set_label(publication.title).set_resource_id(assignment.id))
    made = DeepLink(registration, what["deployment"], what["settings"])
    return str(made.get_response_jwt([resource]))


# Grades ---------------------------------------------------------------------------------------------


@router.post("/api/v1/publications/{key}/lti/scores")
def send_scores(call: Called, own: Own) -> dict[str, Any]:
    """Send the grades that are new or have changed to the activities that show the publication.

    What a platform refuses is told for each student, and sent again the next time; who waits for a person, or
    has never launched the activity, is told, too.
    """
    activities = call.session.scalars(select(LtiActivity).where(LtiActivity.publication_id == own.id)).all()
    if not activities:
        raise RefusedError(404, "lti_activity")
    results = read_results(call.places(own).results)
    answer: dict[str, Any] = {"sent": [], "same": [], "refused": {}, "withheld": {}}
    speaker = tongue(call.lang)
    for activity in activities:
        holding = select(LtiClaim.student_id, LtiUser.subject).join(LtiUser, LtiUser.id == LtiClaim.user_id)
        of_activity = (
            LtiClaim.publication_id == own.id, LtiClaim.holds,
            LtiUser.platform_id == activity.platform_id,
        )  # fmt: skip
        found = call.session.execute(holding.where(*of_activity))
        users: dict[str, str] = {row.student_id: row.subject for row in found}
        people = {student: Person(platform_id=subject) for student, subject in users.items()}
        delivery = draft(results, Options(to="lti", people=people, item=own.title))
        for student, _, reasons in delivery.left_out():
            answer["withheld"][student] = told(reasons[0], speaker)
        document = json.loads(str(delivery.content))
        students = {subject: student for student, subject in users.items()}
        for student, why in _sent(call, activity, document, students):
            if isinstance(why, Reason):
                answer["refused"][student] = told(why, speaker)
            else:
                answer[why].append(student)
    call.note("grades sent", f"{own.key}: {len(answer['sent'])}")
    return answer


def _sent(
    call: Call, activity: LtiActivity, document: Mapping[str, Any], students: Mapping[str, str]
) -> Iterator[tuple[str, str | Reason]]:
    """Send grades; yield each student with ``sent``, ``same``, or the reason of a refusal."""
    platform = call.session.get_one(LtiPlatform, activity.platform_id)
    settings = call.service.settings
    registration = registration_of(platform, settings)
    endpoint: Any = {"scope": [], **activity.grades}
    service = AssignmentsGradesService(
        ServiceConnector(registration, caller(is_local=settings.is_local)), endpoint
    )
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
        except (
            LtiException,
            requests.RequestException,
            LookupError,
            AttributeError,
            TypeError,
            ValueError,
        ) as error:
            response = getattr(error, "response", None)
            known = {} if response is None else {"status": response.status_code}
            yield student, Reason("platform_refuses", known)
        else:
            activity.sent = {**activity.sent, student: mark}
            call.session.commit()
            yield student, "sent"
