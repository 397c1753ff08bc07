"""Access rights and rate limits: visits, forms, bodies, headers.

A browser's visit is a random cookie, of which the data base has the digest. Whatever changes something needs
a header with the visit's own token, which a page of another site can neither read nor send; a program's
token in the header `Authorization` needs none, because no browser sends it by itself.
"""

import asyncio
import contextlib
import hashlib
import hmac
import re
import secrets
import time
from collections import Counter
from dataclasses import dataclass, field
from ipaddress import ip_address, ip_network
from math import inf
from urllib.parse import urlsplit

from argon2 import PasswordHasher
from argon2.exceptions import VerificationError
from fastapi import Request, Response
from itsdangerous import BadSignature, URLSafeSerializer
from limits import RateLimitItem, RateLimitItemPerHour, RateLimitItemPerMinute
from limits.storage import MemoryStorage
from limits.strategies import MovingWindowRateLimiter
from sqlalchemy import select
from sqlalchemy.orm import Session
from starlette.datastructures import Headers
from starlette.responses import JSONResponse
from starlette.types import ASGIApp, Message, Receive, Scope, Send
from zxcvbn import zxcvbn

from grader.language import LANGUAGES, tongue
from grader.review.server import HEADERS as REVIEW_HEADERS
from grader.review.server import with_headers
from grader.texts.spoken import RefusedError, told_of
from grader.web.settings import Settings
from grader.web.store import Account, Link, Publication, Store, Visit, digest_of

COOKIE = "planmark_visit"
FORM_HEADER = "X-Planmark-Form"
INVITATION = "invitation"
"""The title of a visit that stands for an invitation: it makes an account, and opens nothing else."""
RESET = "reset"
"""The title of a visit that stands for a link to a new password."""
MAILED = "mailed"
"""The same of a link that was sent by e-mail."""
NO_TOKENS = frozenset({"", INVITATION, RESET, MAILED})
"""Titles of visits that are no program's token."""
SESSION_S = 7 * 86400.0
"""A visit in which an instructor is signed in ends after a week, however it is used."""
IDLE_S = 12 * 3600.0
"""A working day: an instructor who was away longer signs in again."""
LEAST_GUESSES = 1e10
"""Guesses to find a password by words, names and patterns: more than years of trying on a stolen hash."""
LEAST_PASSWORD = 12
"""Signs of a password (NIST SP 800-63B asks for at least 8, and for 15 where nothing else is asked)."""
HEADERS = {
    **REVIEW_HEADERS,
    "Content-Security-Policy": "default-src 'none'; img-src 'self' data: blob:; style-src 'self';"
    " script-src 'self'; connect-src 'self'; form-action 'self'; base-uri 'none'; frame-ancestors 'none'",
    "Cross-Origin-Opener-Policy": "same-origin",
    "Permissions-Policy": "geolocation=(), microphone=()",
    "X-Robots-Tag": "noindex",
}
SECURE = {"Strict-Transport-Security": "max-age=31536000"}
RATES: dict[str, RateLimitItem] = {
    "sign_in": RateLimitItemPerMinute(10),
    "code": RateLimitItemPerHour(20),
    "forgotten": RateLimitItemPerHour(20),
    "check": RateLimitItemPerMinute(60),
    "photo": RateLimitItemPerMinute(10),
    "key": RateLimitItemPerMinute(60),
    "upload": RateLimitItemPerMinute(3000),
    "address": RateLimitItemPerMinute(1500),
}
"""For each visitor; a class behind one address of a school is let through by the visit's cookie. All
visits of an address count as `address`, too: new cookies cost nothing. That lets 200 students of a school
open a page and check values some times in a minute."""
_HASHER = PasswordHasher()
_LOOKED_AT = 72
"""Signs of a password that are weighed: the time grows with their square."""
_NOBODY = _HASHER.hash(secrets.token_urlsafe())
"""Compared with if there is no such account, so that the time does not tell."""


def forbidden(why: str) -> RefusedError:
    """Return the error for visitors without the right."""
    return RefusedError(403, "forbidden", why)


def missing(what: str = "page") -> RefusedError:
    """Return the error for what is not there, or not the visitor's to see: both read the same."""
    return RefusedError(404, "not_found", f"no_{what}")


def language_of(request: Request) -> str:
    """Return the language that a visitor chose, else the browser's, else English."""
    chosen = request.query_params.get("lang") or request.cookies.get("planmark_lang", "")
    wanted = [chosen, *request.headers.get("accept-language", "").split(",")]
    codes = (one.strip()[:2].lower() for one in wanted)
    return next((code for code in codes if code in LANGUAGES), LANGUAGES[0])


def hash_of(password: str, name: str) -> str:
    """Return the hash of a password, to be stored. Raises RefusedError for a short or a common one."""
    if not LEAST_PASSWORD <= len(password) <= 200:
        raise RefusedError(422, "password_short", least=LEAST_PASSWORD)
    if zxcvbn(password[:_LOOKED_AT], [name, "planmark"])["guesses"] < LEAST_GUESSES:
        raise RefusedError(422, "password_common")
    return _HASHER.hash(password)


def is_password(account: Account | None, password: str) -> bool:
    """Return whether a password is an account's; takes as long where there is no account."""
    stored = account.password if account is not None and account.password else _NOBODY
    try:
        return _HASHER.verify(stored, password[:200]) and account is not None and bool(account.password)
    except VerificationError:
        return False


def address_of(scope: Scope) -> str:
    """Return the sender's address, for counting; of IPv6 the network that one household has."""
    text = str((scope.get("client") or ("",))[0])
    try:
        if ip_address(text).version == 4:
            return text
        return str(ip_network(f"{text.partition('%')[0]}/64", strict=False))
    except ValueError:  # a socket of this machine
        return text


def issued(session: Session, account: Account, title: str) -> str:
    """Return a new secret, shown once, and store its digest as a visit: of an invitation, link or token."""
    token = secrets.token_urlsafe(32)
    session.add(Visit(id=digest_of(token), account=account, title=title))
    return token


def _is_over(visit: Visit) -> bool:
    """Return whether an instructor must sign in again; a student's personal link expires by itself."""
    now = time.time()
    is_old = now - visit.used > IDLE_S or now - visit.created > SESSION_S
    return visit.account_id is not None and is_old


@dataclass(slots=True)
class Visitor:
    """The sender of a request.

    Attributes
    ----------
    secret : of the browser's cookie, or a program's token
    visit : as stored; None while nothing is
    is_program : whether it came by a token
    """

    secret: str
    visit: Visit | None
    is_program: bool = False
    address: str = ""

    @property
    def account(self) -> Account | None:
        """The instructor who is signed in."""
        return None if self.visit is None else self.visit.account

    @property
    def name(self) -> str:
        """The name for the audit trail."""
        return self.account.name if self.account is not None else f"visitor {digest_of(self.secret)[:8]}"

    def is_member(self, publication: Publication) -> bool:
        """Return whether the instructor may change a publication: a member, or an administrator."""
        account = self.account
        return account is not None and (
            account.is_admin or any(one.id == account.id for one in publication.members)
        )


@dataclass(slots=True)
class Guard:
    """Decides who a request is from, and whether it may be made."""

    settings: Settings
    store: Store
    _limiter: MovingWindowRateLimiter = field(
        default_factory=lambda: MovingWindowRateLimiter(MemoryStorage())
    )

    @property
    def _links(self) -> URLSafeSerializer:
        return URLSafeSerializer(self.settings.secret, salt="personal link")

    # Visits ---------------------------------------------------------------------------------------

    def visitor(self, request: Request, session: Session) -> Visitor:
        """Return the sender of a request. Raises RefusedError for an unknown token."""
        address = address_of(request.scope)
        kind, _, token = request.headers.get("authorization", "").partition(" ")
        if kind.lower() == "bearer":
            visit = session.get(Visit, digest_of(token.strip()))
            if visit is None or visit.title in NO_TOKENS:
                raise RefusedError(401, "token")
            return Visitor(token, visit, is_program=True, address=address)
        secret = request.cookies.get(COOKIE, "")
        visit = session.get(Visit, digest_of(secret)) if secret else None
        if visit is not None and (visit.title or _is_over(visit)):
            visit = None
        if visit is not None and time.time() - visit.used > 60.0:
            visit.used = time.time()
        return Visitor(secret or secrets.token_urlsafe(32), visit, address=address)

    def begin(
        self, session: Session, visitor: Visitor, account: Account | None = None, link: Link | None = None
    ) -> Visit:
        """Return the visit as stored; a sign-in and a personal link give it a new secret.

        Whoever put the cookie into a browser that many use does not know the new one.
        """
        before = visitor.visit
        if account is not None or (link is not None and not visitor.is_program):
            if before is not None and not visitor.is_program:
                session.delete(before)
            visitor.secret, visitor.visit = secrets.token_urlsafe(32), None
        if visitor.visit is None:
            known = before if link is not None else None
            visitor.visit = Visit(
                id=digest_of(visitor.secret), account=account or (known.account if known else None),
                links=dict(known.links) if known else {}, created=known.created if known else time.time(),
            )  # fmt: skip
            session.add(visitor.visit)
        if link is not None:
            visitor.visit.links = {**visitor.visit.links, str(link.publication_id): link.id}
        session.flush()
        return visitor.visit

    def set_cookie(self, response: Response, visitor: Visitor) -> None:
        """Let the browser keep its visit."""
        if not visitor.is_program:
            response.set_cookie(
                COOKIE, visitor.secret, max_age=90 * 86400, httponly=True, secure=self.settings.is_https,
                samesite="lax", path="/",
            )  # fmt: skip

    # Forms ----------------------------------------------------------------------------------------

    def form_token(self, visitor: Visitor) -> str:
        """Return the text that our pages must send with every change."""
        key = self.settings.secret.encode()
        return hmac.new(key, b"form " + visitor.secret.encode(), hashlib.sha256).hexdigest()

    def check_form(self, request: Request, visitor: Visitor) -> None:
        """Raise RefusedError for a request that none of our pages has made."""
        if visitor.is_program:
            return
        origin = request.headers.get("origin")
        given = request.headers.get(FORM_HEADER, "")
        is_own = origin is None or origin.partition("://")[2] == request.headers.get("host", "")
        if not is_own or not hmac.compare_digest(given.encode(), self.form_token(visitor).encode()):
            raise forbidden("form_old")

    # How often ------------------------------------------------------------------------------------

    def count(self, rate: str, who: str) -> None:
        """Count a use of something. Raises RefusedError where there are too many in a minute."""
        if not self._limiter.hit(RATES[rate], rate, who):
            raise RefusedError(429, "too_often")

    # Links ----------------------------------------------------------------------------------------

    def link_text(self, link: Link) -> str:
        """Return the address of a personal link."""
        return f"{self.settings.address}/s/{self._links.dumps(link.id)}"

    def opened(self, session: Session, token: str) -> Link:
        """Return the link of a token. Raises RefusedError for one that is forged, revoked or too old."""
        try:
            number = self._links.loads(token)
        except BadSignature:
            number = None
        link = session.get(Link, number) if isinstance(number, int) else None
        if link is None or not link.is_valid:
            raise RefusedError(404, "link")
        return link

    @staticmethod
    def own_link(session: Session, visitor: Visitor, publication: Publication) -> Link | None:
        """Return the personal link by which a visitor came to a publication, while it is valid."""
        number = None if visitor.visit is None else visitor.visit.links.get(str(publication.id))
        found = select(Link).where(Link.id == number, Link.publication_id == publication.id)
        link = None if number is None else session.scalar(found)
        return link if link is not None and link.is_valid else None


# Around every request -----------------------------------------------------------------------------


@dataclass(slots=True)
class Rim:
    """Refuses other hosts, and bodies that are too large, too slow or too many; adds the headers of safety.

    Arguments: `most` are the bytes of a body that is no file, `room` those of all bodies at one time.
    """

    app: ASGIApp
    settings: Settings
    most: int = 1_000_000
    room: int = 1_000_000_000
    hosts: frozenset[str] = field(default_factory=frozenset)
    _held: Counter[str] = field(default_factory=Counter)
    """Bytes of bodies, by the sender's address."""
    _sending: Counter[str] = field(default_factory=Counter)
    """Bodies that are not all there yet, by address."""

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """ASGI."""
        if scope["type"] != "http":
            await self.app(scope, receive, send)
            return
        host = Headers(scope=scope).get("host", "")
        if host != self.settings.host and _name_of(host) not in self.hosts:
            await _refusal(scope, RefusedError(421, "refused", "other_host"))(scope, receive, send)
            return
        most, sender = self._most(scope["path"]), address_of(scope)
        taken, until = 0, 0.0
        refused: RefusedError | None = None

        async def bounded() -> Message:
            nonlocal taken, until, refused
            if until == inf:  # all of it is there: the application waits for the end of the connection
                return await receive()
            if not until:
                until = asyncio.get_running_loop().time() + GRACE_S
                self._sending[sender] += 1
            refused = _crowded() if self._sending[sender] > MOST_SENDING else None
            if refused is None:
                message, refused = await _in_time(receive, until + taken / LEAST_PACE)
                size = len(message.get("body", b""))
                taken += size
                self._held[sender] += size
                held = self._held.total() > self.room or self._held[sender] > SHARE * self.room
                too_large = RefusedError(413, "refused", "too_large", most=most // 1_000_000)
                refused = refused or (too_large if taken > most else _crowded() if held else None)
            if refused is not None:
                raise refused
            if not message.get("more_body"):
                until = self._ended(sender)
            return message

        answer = with_headers(send, {**HEADERS, **SECURE} if self.settings.is_https else HEADERS)

        async def unless_refused(message: Message) -> None:
            if refused is None:  # else whatever the application answers to that
                await answer(message)

        try:
            with contextlib.suppress(RefusedError):
                await self.app(scope, bounded, unless_refused)
        finally:
            self._held -= Counter({sender: taken})
            if 0.0 < until < inf:
                self._ended(sender)
        if refused is not None:
            await _refusal(scope, refused)(scope, receive, send)

    def _ended(self, sender: str) -> float:
        """Forget a body that was being sent; return a time that never comes."""
        self._sending[sender] -= 1
        self._sending = +self._sending
        return inf

    def _most(self, path: str) -> int:
        files = _FILES.fullmatch(path)
        if files is None:
            return self.most
        return 1_000_000 * (self.settings.photo_mb if files["photo"] else self.settings.upload_mb)


GRACE_S = 30.0
"""Seconds for a body to arrive, besides the time that it needs at `LEAST_PACE`."""
LEAST_PACE = 50_000.0
"""Bytes a second of a bad mobile network: a photo of 5 MB then takes 100 s."""
MOST_SENDING = 60
"""Bodies that come from one address at one time: a class behind a school's address that sends its photos."""
SHARE = 2 / 3
"""Part of the room for all bodies that one address may take."""
_FILES = re.compile(
    r"/api/v1/publications/[^/]+/(?:(?P<photo>photos|sheets)|(?:assignment/|roster/|exports/[^/]+/)?files/.+|exports/[^/]+)/?"
)
"""Addresses to which files are sent."""


def _name_of(host: str) -> str | None:
    """Return the name in a host header, without its port; None if it has none."""
    try:
        return urlsplit(f"//{host}").hostname
    except ValueError:
        return None


def _crowded() -> RefusedError:
    return RefusedError(503, "refused", "crowded")


async def _in_time(receive: Receive, until: float) -> tuple[Message, RefusedError | None]:
    """Return the next part of a body, or the error of one that came too slowly."""
    try:
        async with asyncio.timeout_at(until):
            return await receive(), None
    except TimeoutError:
        return {}, RefusedError(408, "refused", "too_slow_body")


def _refusal(scope: Scope, error: RefusedError) -> JSONResponse:
    told = told_of(error, tongue(language_of(Request({"query_string": b"", **scope}))))
    return JSONResponse({"code": error.code, "message": told}, error.status, {"connection": "close"})
