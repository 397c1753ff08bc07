"""Check a launch from a learning platform: state, nonce, claims, then the signature (LTI Core 1.3).

State, nonce, platform and browser are one record, good for one message. The platform's keys are fetched
only for a message in which all is right that can be seen without them.
"""

import json
import secrets
import time
from collections.abc import Mapping
from typing import Annotated, Any, Literal
from urllib.parse import urlencode

import jwt
import requests
from fastapi.responses import RedirectResponse, Response
from pydantic import BaseModel, ConfigDict, Field, ValidationError
from sqlalchemy import delete, select

from grader.texts.spoken import RefusedError
from grader.web.outside import caller
from grader.web.service import Call
from grader.web.store import LtiPlatform, LtiState, digest_of
from grader.web.students import WITHOUT_NUL

CLAIM = "https://purl.imsglobal.org/spec/lti/claim/"
AGS = "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint"
DEEP = "https://purl.imsglobal.org/spec/lti-dl/claim/deep_linking_settings"
MEMBERSHIP = "http://purl.imsglobal.org/vocab/lis/v2/membership#"
TEACHES = frozenset(
    f"{start}{role}" for start in (MEMBERSHIP, "") for role in ("Instructor", "Administrator")
)
"""Roles in the course itself, in full or short (LTI Core 1.3, A.2.3). What somebody is in the institution, or
on the platform, says nothing of this course: Canvas sends both of a student who teaches elsewhere."""
STATE_S = 600.0
"""A person may have to sign in to the platform between the two requests of a launch."""
LEEWAY_S = 60.0
"""Between the platform's clock and the server's."""
ALGORITHMS = ("RS256", "RS384", "RS512", "PS256", "PS384", "PS512", "ES256", "ES384", "ES512")
"""Signatures by a key of which the public half is enough to check them."""
Text = Annotated[str, Field(max_length=255, pattern=WITHOUT_NUL)]
Moment = Annotated[float, Field(allow_inf_nan=False)]


class _Part(BaseModel):
    model_config = ConfigDict(strict=True)


class _Link(_Part):
    id: Annotated[Text, Field(min_length=1)]


class _Person(_Part):
    person_sourcedid: Text | None = None


class _Grades(_Part):
    scope: list[str] = []
    lineitems: str | None = None
    lineitem: str | None = None


class _Choice(_Part):
    model_config = ConfigDict(strict=True, extra="allow")

    deep_link_return_url: Annotated[str, Field(pattern=r"^https?://")]


class Message(_Part):
    """The claims of a launch; those that planmark does not use are ignored."""

    iss: str
    sub: Annotated[Text, Field(min_length=1)]
    aud: str | Annotated[list[str], Field(min_length=1)]
    azp: str | None = None
    exp: Moment
    iat: Moment
    nonce: str
    name: Text | None = None
    email: Text | None = None
    kind: Literal["LtiResourceLinkRequest", "LtiDeepLinkingRequest"] = Field(alias=f"{CLAIM}message_type")
    version: Literal["1.3.0"] = Field(alias=f"{CLAIM}version")
    deployment: Annotated[str, Field(max_length=200)] = Field(alias=f"{CLAIM}deployment_id")
    roles: list[str] = Field(alias=f"{CLAIM}roles")
    link: _Link | None = Field(default=None, alias=f"{CLAIM}resource_link")
    person: _Person | None = Field(default=None, alias=f"{CLAIM}lis")
    custom: dict[str, Any] | None = Field(default=None, alias=f"{CLAIM}custom")
    grades: _Grades | None = Field(default=None, alias=AGS)
    choice: _Choice | None = Field(default=None, alias=DEEP)

    @property
    def is_teacher(self) -> bool:
        """True if the person teaches the course of the activity."""
        return not TEACHES.isdisjoint(self.roles)


def began(call: Call, platform: LtiPlatform, hints: Mapping[str, str]) -> Response:
    """Send the browser to the platform, and keep a record of the launch that has begun."""
    state, nonce, browser = (secrets.token_urlsafe(32) for _ in range(3))
    now = time.time()
    call.session.execute(delete(LtiState).where(LtiState.expires < now))
    record = {"nonce": digest_of(nonce), "browser": digest_of(browser), "platform": platform.id}
    call.session.add(LtiState(id=digest_of(state), expires=now + STATE_S, what=record))
    asked = {
        "scope": "openid", "response_type": "id_token", "response_mode": "form_post", "prompt": "none",
        "client_id": platform.client_id, "redirect_uri": f"{call.service.settings.address}/lti/launch",
        "state": state, "nonce": nonce,
        **{name: hint for name, hint in hints.items() if hint},
    }  # fmt: skip
    joint = "&" if "?" in platform.auth_login_url else "?"
    response = RedirectResponse(f"{platform.auth_login_url}{joint}{urlencode(asked)}", 303)
    secure = call.service.settings.is_https
    # A launch is posted by another site, so that the cookie must be sent from there, too.
    response.set_cookie(
        _cookie_of(state), browser, max_age=int(STATE_S), secure=secure, httponly=True,
        samesite="none" if secure else "lax", path="/lti",
    )  # fmt: skip
    return response


def checked(call: Call, state: str, token: str) -> tuple[Message, LtiPlatform]:
    """Return the checked claims of a launch and its platform. Raises RefusedError."""
    record = _taken(call, state)
    platform = call.session.get(LtiPlatform, record["platform"])
    if platform is None:
        raise _refused("launch_unregistered")
    try:
        header = jwt.get_unverified_header(token)
        message = Message.model_validate(jwt.decode(token, options={"verify_signature": False}))
    except ValidationError as error:
        fault = error.errors(include_url=False, include_context=False, include_input=False)[0]
        where = ".".join(str(part).removeprefix(CLAIM) for part in fault["loc"])
        raise _refused("launch_fault", 400, where=where, fault=fault["msg"]) from error
    except (jwt.PyJWTError, ValueError, RecursionError) as error:
        raise _refused("launch_no_message", 400) from error
    _check(message, platform, record["nonce"])
    if header.get("alg") not in ALGORITHMS or not isinstance(header.get("kid"), str):
        raise _refused("launch_unsigned")
    try:
        jwt.decode(
            token, _key(call, platform, header["kid"]), algorithms=[header["alg"]],
            audience=platform.client_id, issuer=platform.issuer, leeway=LEEWAY_S,
            options={"require": ["exp", "iat", "nonce"]},
        )  # fmt: skip
    except (jwt.PyJWTError, TypeError, ValueError) as error:
        raise _refused("launch_forged") from error
    return message, platform


def _taken(call: Call, state: str) -> dict[str, Any]:
    """Return the record of a launch that this browser began, and delete it."""
    name, session = digest_of(state), call.session
    record = session.get(LtiState, name)
    browser = call.request.cookies.get(_cookie_of(state), "")
    if record is None or record.expires < time.time() or "nonce" not in record.what:
        raise _refused("launch_late")
    if not secrets.compare_digest(record.what["browser"], digest_of(browser)):
        raise _refused("launch_other_browser")
    taken = session.execute(delete(LtiState).where(LtiState.id == name))
    session.commit()
    if not taken.rowcount:  # type: ignore[attr-defined]
        raise _refused("launch_used")
    return record.what


def _check(message: Message, platform: LtiPlatform, nonce: str) -> None:
    """Raise RefusedError for claims that are wrong whoever has signed them."""
    now = time.time()
    audiences = [message.aud] if isinstance(message.aud, str) else message.aud
    party = message.azp or (audiences[0] if len(audiences) == 1 else None)
    wrong = {
        "nonce": not secrets.compare_digest(digest_of(message.nonce), nonce),
        "iss": message.iss != platform.issuer,
        "aud": platform.client_id not in audiences,
        "azp": party != platform.client_id,
        "exp": message.exp < now - LEEWAY_S,
        "iat": not now - STATE_S - LEEWAY_S < message.iat < now + LEEWAY_S,
        "deployment_id": message.deployment not in platform.deployments,
    }
    if message.kind == "LtiResourceLinkRequest":
        wrong["resource_link"] = message.link is None
    else:
        wrong["deep_linking_settings"] = message.choice is None
    found = [name for name, is_wrong in wrong.items() if is_wrong]
    if found:
        raise _refused("launch_claims", claims=", ".join(found))


def _key(call: Call, platform: LtiPlatform, name: str) -> Any:  # noqa: ANN401 - of each algorithm its own
    """Fetch a key of the platform."""
    try:
        answer = caller(is_local=call.service.settings.is_local).get(platform.key_set_url)
        keys = jwt.PyJWKSet.from_dict(json.loads(answer.content))
    except (requests.RequestException, jwt.PyJWTError, ValueError, TypeError, AttributeError, RecursionError):
        raise _refused("launch_no_keys") from None
    try:
        return keys[name].key
    except KeyError:
        raise _refused("launch_no_key") from None


def platform_of(call: Call, issuer: str, client_id: str) -> LtiPlatform | None:
    """Return a registered platform; `client_id` may be empty if its issuer is registered once."""
    own = select(LtiPlatform).where(LtiPlatform.issuer == issuer)
    found = call.session.scalars(
        own if not client_id else own.where(LtiPlatform.client_id == client_id)
    ).all()
    return found[0] if len(found) == 1 else None


def _cookie_of(state: str) -> str:
    return f"planmark-lti-{digest_of(state)[:16]}"


def _refused(why: str, status: int = 403, **parameters: str) -> RefusedError:
    return RefusedError(status, "lti_launch", why, **parameters)
