"""Passwords, their change and reset, the second factor, and the end of a session."""

import time
from types import SimpleNamespace

import pyotp
import pytest
from sqlalchemy import select, text

from grader.web.app import first_invitation
from grader.web.guard import address_of
from grader.web.store import Account, Visit
from tests.unit.web.conftest import ADDRESS, PASSWORD, Browser

NEW = "quite another sentence"


def number_of(admin, name):
    return next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == name)


COMMON = [
    "password1234", "qwertyuiop12", "aaaaaaaaaaaa", "123456789012", "Ion Ion Ion Ion", "planmark planmark",
]  # fmt: skip


def test_a_password_that_everybody_has_is_refused(admin, visitor):
    token = admin.act("POST", "/accounts?name=Ion").json()["address"].partition("token=")[2]
    for password in COMMON:
        said = {"token": token, "name": "Ion", "password": password}
        answer = visitor.act("POST", "/accounts/join", json=said)
        assert (answer.status_code, answer.json()["code"]) == (422, "password_common"), password
    assert visitor.act("POST", "/accounts/join", json={**said, "password": PASSWORD}).status_code == 200


def test_a_password_is_changed_by_who_knows_it_and_ends_the_other_visits(admin, colleague, app):
    other, token = Browser(app), colleague.act("POST", "/tokens?title=script").json()["token"]
    assert other.sign_in("Ion").status_code == 200
    wrong = colleague.act("PUT", "/account/password", json={"old": "wrong wrong wrong", "password": NEW})
    assert (wrong.status_code, wrong.json()["code"]) == (403, "password")
    changed = colleague.act("PUT", "/account/password", json={"old": PASSWORD, "password": NEW})
    assert changed.status_code == 200
    assert colleague.get("/api/v1/publications").status_code == 200
    assert other.get("/api/v1/publications").status_code == 401
    head = {"Authorization": f"Bearer {token}"}
    assert other.get("/api/v1/publications", headers=head).status_code == 200
    program = other.put("/api/v1/account/password", json={"old": NEW, "password": PASSWORD}, headers=head)
    assert program.status_code == 403
    assert other.sign_in("Ion").status_code == 401
    assert other.sign_in("Ion", NEW).status_code == 200
    assert "password changed" in admin.get("/api/v1/audit").text


def test_an_administrators_link_gives_a_new_password_once(admin, colleague, app, service):
    number = number_of(admin, "Ion")
    assert colleague.act("POST", f"/accounts/{number}/reset").status_code == 403
    links = [admin.act("POST", f"/accounts/{number}/reset").json()["address"] for _ in range(2)]
    tokens = [one.removeprefix(f"{ADDRESS}/reset?token=") for one in links]
    browser = Browser(app)
    assert "Choose a new password" in browser.get(links[0].removeprefix(ADDRESS)).text
    assert (
        browser.get("/api/v1/accounts", headers={"Authorization": f"Bearer {tokens[0]}"}).status_code == 401
    )
    joined = {"token": tokens[0], "name": "Eve", "password": NEW}
    assert browser.act("POST", "/accounts/join", json=joined).status_code == 403
    said = {"token": tokens[0], "password": NEW}
    assert browser.act("POST", "/accounts/reset", json={**said, "password": "short"}).status_code == 422
    assert browser.act("POST", "/accounts/reset", json=said).status_code == 200
    assert colleague.get("/api/v1/publications").status_code == 401
    for token in tokens:
        again = browser.act("POST", "/accounts/reset", json={**said, "token": token})
        assert again.status_code == 403
    assert browser.sign_in("Ion").status_code == 401
    assert browser.sign_in("Ion", NEW).status_code == 200
    late = admin.act("POST", f"/accounts/{number}/reset").json()["address"].partition("token=")[2]
    with service.store.session() as session:
        session.query(Visit).filter_by(title="reset").update({"created": time.time() - 8 * 86400.0})
    assert browser.act("POST", "/accounts/reset", json={**said, "token": late}).status_code == 403


@pytest.mark.usefixtures("admin")
def test_wrong_tries_from_elsewhere_do_not_keep_the_owner_out(visitor, app, monkeypatch):
    monkeypatch.setattr("grader.web.guard.address_of", lambda _scope: "203.0.113.5")
    tries = [visitor.sign_in("Ana", "wrong wrong wrong").status_code for _ in range(12)]
    assert (tries[:9], tries[-1]) == ([401] * 9, 429)
    monkeypatch.setattr("grader.web.guard.address_of", lambda _scope: "198.51.100.7")
    assert Browser(app).sign_in("Ana").status_code == 200


@pytest.mark.parametrize(
    ("client", "counted"),
    [
        (("203.0.113.5", 4000), "203.0.113.5"), (("2001:db8:1:2:3:4:5:6", 4000), "2001:db8:1:2::/64"),
        (("2001:db8:1:2::9", 4001), "2001:db8:1:2::/64"), (("fe80::1%eth0", 1), "fe80::/64"), (None, ""),
    ],
)  # fmt: skip
def test_one_household_counts_as_one_address(client, counted):
    assert address_of({"client": client}) == counted


def test_a_session_ends_after_a_week_however_it_is_used(admin, graded, service):
    key, links = graded
    with service.store.session() as session:
        for visit in session.query(Visit).filter(Visit.account_id.is_not(None)):
            visit.created -= 6 * 86400.0
    assert admin.get(links["s09"]).status_code == 200  # which gives the visit a new secret
    assert admin.get(f"/api/v1/publications/{key}").status_code == 200
    with service.store.session() as session:
        for visit in session.query(Visit).filter(Visit.account_id.is_not(None)):
            visit.created -= 1.1 * 86400.0
    assert admin.get(f"/api/v1/publications/{key}").status_code == 401


def test_the_only_administrator_is_let_in_again_by_whoever_runs_the_machine(admin, service, settings, app):
    key = admin.publish()
    assert first_invitation(settings) is None
    with service.store.session() as session:
        session.execute(text("UPDATE accounts SET password = '', totp = '' WHERE name = 'Ana'"))
    again = Browser(app)
    assert again.join(first_invitation(settings), "Ana").status_code == 200
    assert [one["name"] for one in again.get(f"/api/v1/publications/{key}").json()["members"]] == ["Ana"]


# The second factor --------------------------------------------------------------------------------


@pytest.fixture
def clock(monkeypatch):
    """The time that codes are made for; it goes on by itself no further."""
    now = [1_800_000_000.0]
    monkeypatch.setattr("grader.web.accounts.time", SimpleNamespace(time=lambda: now[0]))
    return now


@pytest.fixture
def secured(colleague, clock):
    """Ion, whose device makes codes."""
    offered = colleague.act("POST", "/account/second-factor").json()
    assert offered["address"].startswith("otpauth://totp/planmark:Ion?secret=")
    assert offered["picture"].startswith("data:image/svg+xml")
    device = pyotp.TOTP(offered["secret"])
    said = {"secret": offered["secret"], "password": PASSWORD}
    for wrong in ({"code": "000000"}, {"code": device.at(clock[0]), "password": "wrong wrong wrong"}):
        assert colleague.act("PUT", "/account/second-factor", json={**said, **wrong}).status_code in {
            401,
            403,
        }
    right = {**said, "code": device.at(clock[0])}
    assert colleague.act("PUT", "/account/second-factor", json=right).status_code == 200
    return device


def entered(browser, code):
    said = {"name": "Ion", "password": PASSWORD, "code": code}
    return browser.act("POST", "/session", json=said).status_code


def test_the_password_alone_lets_nobody_in_where_there_is_a_second_factor(secured, clock, app, service):
    browser = Browser(app)
    refused = browser.sign_in("Ion")
    assert (refused.status_code, refused.json()["code"]) == (401, "second_factor")
    assert entered(browser, secured.at(clock[0])) == 401, "it was used when it was set"
    clock[0] += 30.0
    assert entered(browser, secured.at(clock[0] - 3600.0)) == 401
    assert browser.get("/api/v1/publications").status_code == 401
    code = secured.at(clock[0])
    assert entered(browser, code) == 200
    assert entered(Browser(app), code) == 401, "a code is good once"
    with service.store.session() as session:
        assert session.scalar(select(Account.totp).where(Account.name == "Ana")) == ""


def test_codes_are_not_tried_out(secured, clock, app, monkeypatch):
    monkeypatch.setattr("grader.web.guard.address_of", lambda scope: str(id(scope)))
    browser = Browser(app)
    clock[0] += 60.0
    wrong = f"{(int(secured.at(clock[0])) + 1) % 1_000_000:06}"
    assert [entered(browser, wrong) for _ in range(22)][-1] == 429


def test_an_administrator_takes_away_the_second_factor_of_a_lost_device(secured, admin, colleague, app):
    _ = secured
    number = number_of(admin, "Ion")
    assert colleague.act("DELETE", f"/accounts/{number}/second-factor").status_code == 403
    assert "Remove the second factor" in admin.get("/account").text
    assert admin.act("DELETE", f"/accounts/{number}/second-factor").status_code == 200
    assert Browser(app).sign_in("Ion").status_code == 200
