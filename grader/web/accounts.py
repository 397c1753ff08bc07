"""Accounts of instructors: sign in, invite, passwords, the second factor, tokens for programs."""

import hmac
import time
from collections.abc import Collection
from typing import Annotated, Any

import pyotp
import segno
from fastapi import APIRouter, Query
from pydantic import Field
from sqlalchemy import delete, select
from sqlalchemy.orm import Session

from grader.texts.spoken import RefusedError
from grader.web.guard import INVITATION, MAILED, NO_TOKENS, RESET, hash_of, is_password, issued, missing
from grader.web.service import Call, Called, Key, Route, Row
from grader.web.store import Account, Visit, digest_of
from grader.web.students import Strict

router = APIRouter(route_class=Route, prefix="/api/v1", tags=["accounts"])
Name = Annotated[str, Field(min_length=1, max_length=80, pattern=r"^[^\x00-\x1f\x7f]+$")]
Password = Annotated[str, Field(min_length=1, max_length=200)]
Token = Annotated[str, Field(min_length=1, max_length=200)]
Code = Annotated[str, Field(pattern=r"^([0-9]{6})?$")]
Email = Annotated[str, Field(max_length=200, pattern=r"^[A-Za-z0-9.!#$%&'*+/=?^_`{|}~-]+@[A-Za-z0-9.-]+$")]
VALID_S = {INVITATION: 7 * 86400.0, RESET: 7 * 86400.0, MAILED: 3600.0}
"""Seconds for which an invitation or a link is valid: a letter is read soon, and lies about for long."""
STEP_S = 30
"""Seconds for which a code of a device is valid (RFC 6238)."""


class SignIn(Strict):
    """Name and password to sign in; `code` of the second factor, where the account has one."""

    name: Name
    password: Password
    code: Code = ""


class Reset(Strict):
    """A new password, chosen by a link."""

    token: Token
    password: Password


class Invited(Reset):
    """Name and password of a new account, made by an invitation."""

    name: Name


class NewPassword(Strict):
    """The current password and a new one."""

    old: Password
    password: Password


class Forgotten(Strict):
    """The e-mail address of an account whose password is forgotten."""

    email: Email


class OwnEmail(Forgotten):
    """An e-mail address for the own account, with its password."""

    password: Password


class SecondFactor(Strict):
    """A secret that a device has, proved by a code of it."""

    secret: Annotated[str, Field(pattern=r"^[A-Z2-7]{32,64}$")]
    code: Code
    password: Password


@router.post("/session")
def sign_in(call: Called, who: SignIn) -> dict[str, Any]:
    """Sign in; the visit begins anew.

    Tries count by address: nobody can keep the owner out by trying.
    """
    call.service.guard.count("sign_in", call.visitor.address)
    account = call.session.scalar(select(Account).where(Account.name == who.name))
    if not is_password(account, who.password) or account is None:
        call.note("sign-in refused", who.name)
        call.session.commit()
        raise RefusedError(401, "sign_in", "wrong_name_or_password")
    if account.totp:
        _check_code(call, account, account.totp, who.code)
    return _entered(call, account)


@router.delete("/session")
def sign_out(call: Called) -> dict[str, str]:
    """Sign out: the visit is deleted."""
    if call.visitor.visit is not None:
        call.session.delete(call.visitor.visit)
    call.response.delete_cookie("planmark_visit")
    return {"state": "signed out"}


@router.post("/accounts", status_code=201)
def invite(call: Called, name: Annotated[Name, Query()], *, is_admin: bool = False) -> dict[str, str]:
    """Invite an instructor; the token makes the account once, within a week."""
    admin = call.admin
    token = invitation(call.session, name, is_admin=is_admin)
    call.note("invited", f"{name} by {admin.name}")
    return {"name": name, "address": f"{call.service.settings.address}/join?token={token}"}


@router.post("/accounts/join")
def join(call: Called, who: Invited) -> dict[str, Any]:
    """Answer an invitation: the account gets its password."""
    waiting, account = _answered(call, who.token, {INVITATION})
    if account.password:
        raise RefusedError(403, "invitation")
    other = call.session.scalar(select(Account).where(Account.name == who.name, Account.id != account.id))
    if other is not None:
        raise RefusedError(409, "name_taken", name=who.name)
    account.name, account.password = who.name, hash_of(who.password, who.name)
    call.session.delete(waiting)
    call.note("joined", who.name)
    return _entered(call, account)


@router.post("/accounts/{number}/reset", status_code=201)
def allow_reset(call: Called, number: Row) -> dict[str, str]:
    """Create a link to choose a new password, once, within a week."""
    admin, account = call.admin, call.row(Account, number, "account")
    if not account.password:
        raise missing("account")
    token = issued(call.session, account, RESET)
    call.note("reset allowed", f"{account.name} by {admin.name}")
    return {"name": account.name, "address": f"{call.service.settings.address}/reset?token={token}"}


@router.post("/accounts/reset")
def reset(call: Called, who: Reset) -> dict[str, str]:
    """Choose a new password by a link; all visits and tokens of the account end."""
    _, account = _answered(call, who.token, {RESET, MAILED})
    account.password = hash_of(who.password, account.name)
    call.session.execute(delete(Visit).where(Visit.account_id == account.id))
    call.note("password reset", account.name)
    return {"state": "changed"}


@router.post("/accounts/forgotten", status_code=202)
def forgotten(call: Called, who: Forgotten) -> dict[str, str]:
    """Send a link to a new password, good for an hour; whether the address is an account's is not told."""
    if not call.service.settings.mail:
        raise missing()
    call.service.guard.count("forgotten", call.visitor.address)
    call.service.mail.put(who.email.lower(), call.lang)
    return {"state": "asked"}


@router.put("/account/email")
def set_email(call: Called, new: OwnEmail) -> dict[str, str]:
    """Set the e-mail address for links to a new password."""
    account = _proved(call, new.password)
    account.email = new.email.lower()
    call.note("e-mail set", account.name)
    return {"state": "set"}


@router.put("/account/password")
def change_password(call: Called, new: NewPassword) -> dict[str, Any]:
    """Change the own password; the account's other visits end."""
    account = _proved(call, new.old)
    account.password = hash_of(new.password, account.name)
    ended = delete(Visit).where(Visit.account_id == account.id, Visit.title.in_(NO_TOKENS))
    call.session.execute(ended)
    call.visitor.visit = None
    call.note("password changed", account.name)
    return _entered(call, account)


# The second factor --------------------------------------------------------------------------------


@router.post("/account/second-factor")
def offer_second_factor(call: Called) -> dict[str, str]:
    """Offer a new secret for a device, as text, address and picture; it counts once it is proved."""
    secret = pyotp.random_base32()
    address = pyotp.TOTP(secret).provisioning_uri(name=call.account.name, issuer_name="planmark")
    return {"secret": secret, "address": address, "picture": segno.make(address).svg_data_uri(scale=4)}


@router.put("/account/second-factor")
def set_second_factor(call: Called, new: SecondFactor) -> dict[str, str]:
    """Ask for codes of a device from now on."""
    account = _proved(call, new.password)
    _check_code(call, account, new.secret, new.code)
    account.totp = new.secret
    call.note("second factor set", account.name)
    return {"state": "set"}


@router.delete("/accounts/{number}/second-factor")
def remove_second_factor(call: Called, number: Row) -> dict[str, str]:
    """Remove the second factor of somebody whose device is lost."""
    admin, account = call.admin, call.row(Account, number, "account")
    account.totp = ""
    call.note("second factor removed", f"{account.name} by {admin.name}")
    return {"state": "removed"}


def _check_code(call: Call, account: Account, secret: str, code: str) -> None:
    """Raise RefusedError for a code that is wrong, or was used."""
    if not code:
        raise RefusedError(401, "second_factor", "code_needed")
    call.service.guard.count("code", f"account {account.id}")
    totp, now = pyotp.TOTP(secret), int(time.time()) // STEP_S
    for step in range(now - 1, now + 2):
        if step > account.totp_used and hmac.compare_digest(totp.generate_otp(step), code):
            account.totp_used = step
            return
    call.note("code refused", account.name)
    call.session.commit()
    raise RefusedError(401, "second_factor", "code_wrong")


@router.get("/accounts")
def listed(call: Called) -> list[dict[str, Any]]:
    """All instructors."""
    own = call.account
    found = call.session.scalars(select(Account).order_by(Account.name))
    return [
        {"id": one.id, "name": one.name, "is_admin": one.is_admin, "has_joined": bool(one.password),
         "has_second_factor": bool(one.totp)}
        for one in found if own.is_admin or one.password
    ]  # fmt: skip


@router.delete("/accounts/{number}")
def remove_account(call: Called, number: Row) -> dict[str, str]:
    """Remove an instructor; the publications stay."""
    if call.admin.id == number:
        raise RefusedError(409, "own_account")
    found = call.row(Account, number, "account")
    call.session.execute(delete(Visit).where(Visit.account_id == number))
    call.session.delete(found)
    call.note("account removed", found.name)
    return {"state": "removed"}


@router.post("/tokens", status_code=201)
def new_token(call: Called, title: Annotated[Name, Query()]) -> dict[str, str]:
    """Create a token for a program, shown once: it may do what its instructor may."""
    account = call.account
    if title in NO_TOKENS:
        raise RefusedError(422, "title", "token_title")
    token = issued(call.session, account, title)
    call.note("token made", title)
    return {"title": title, "token": token}


@router.get("/tokens")
def tokens(call: Called) -> list[dict[str, Any]]:
    """The instructor's tokens, without their secrets."""
    own = select(Visit).where(Visit.account_id == call.account.id, Visit.title.not_in(NO_TOKENS))
    return [{"id": one.id, "title": one.title, "created": one.created} for one in call.session.scalars(own)]


@router.delete("/tokens/{number}")
def remove_token(call: Called, number: Key) -> dict[str, str]:
    """Revoke a token."""
    found = call.row(Visit, number, "token")
    if found.account_id != call.account.id or not found.title:
        raise missing("token")
    call.session.delete(found)
    call.note("token removed", found.title)
    return {"state": "removed"}


def invitation(session: Session, name: str, *, is_admin: bool) -> str:
    """Return a token to create an account. Raises RefusedError where the name is taken."""
    account = session.scalar(select(Account).where(Account.name == name))
    if account is not None and account.password:
        raise RefusedError(409, "name_taken", name=name)
    return issued(session, account or Account(name=name, is_admin=is_admin), INVITATION)


def _answered(call: Call, token: str, kinds: Collection[str]) -> tuple[Visit, Account]:
    """Return the visit and the account of a link that was sent.

    Raises RefusedError for a link that is used, too old, or unknown.
    """
    call.service.guard.count("sign_in", call.visitor.address)
    waiting = call.session.get(Visit, digest_of(token))
    if waiting is None or waiting.title not in kinds or waiting.account is None:
        raise RefusedError(403, "invitation")
    if time.time() - waiting.created > VALID_S[waiting.title]:
        raise RefusedError(403, "invitation", "invitation_old")
    return waiting, waiting.account


def _proved(call: Call, password: str) -> Account:
    """Return the instructor who is signed in. Raises RefusedError for a program or a wrong password."""
    call.service.guard.count("sign_in", call.visitor.address)
    if call.visitor.is_program or not is_password(call.account, password):
        raise RefusedError(403, "password", "wrong_password")
    return call.account


def _entered(call: Call, account: Account) -> dict[str, Any]:
    call.service.guard.begin(call.session, call.visitor, account)
    call.service.guard.set_cookie(call.response, call.visitor)
    call.note("signed in")
    return {"name": account.name}
