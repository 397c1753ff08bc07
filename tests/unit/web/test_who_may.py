"""Permissions: visits, forms, hosts, rates, passwords, invitations, tokens."""

import time

import pytest

from grader.web.guard import COOKIE, HEADERS
from grader.web.store import Audit, Visit
from tests.unit.web.conftest import ADDRESS, PASSWORD, Browser


def test_an_invitation_makes_one_account_once(admin, visitor, service):
    address = admin.act("POST", "/accounts?name=Ion").json()["address"]
    assert visitor.join(address, "Ion").status_code == 200
    assert Browser(visitor.app).join(address, "Eve").status_code == 403
    assert "Ion" in [one["name"] for one in admin.get("/api/v1/accounts").json()]
    late = admin.act("POST", "/accounts?name=Late").json()["address"]
    with service.store.session() as session:
        for visit in session.query(Visit).filter_by(title="invitation"):
            visit.created -= 8 * 86400.0
    assert "too old" in Browser(visitor.app).join(late, "Late").json()["message"]


def test_nobody_signs_in_with_a_wrong_or_a_short_password(admin, visitor):
    assert visitor.sign_in("Ana", "wrong wrong wrong").status_code == 401
    assert visitor.sign_in("Nobody", PASSWORD).status_code == 401
    token = admin.act("POST", "/accounts?name=Ion").json()["address"].partition("token=")[2]
    short = visitor.act("POST", "/accounts/join", json={"token": token, "name": "Ion", "password": "short"})
    assert (short.status_code, short.json()["code"]) == (422, "password_short")


def test_an_invited_account_has_no_password_to_guess(admin, visitor):
    admin.act("POST", "/accounts?name=Ion")
    assert visitor.sign_in("Ion", "").status_code == 422
    assert visitor.sign_in("Ion", " ").status_code == 401


@pytest.mark.usefixtures("admin")
def test_a_visit_begins_anew_with_the_sign_in(visitor):
    visitor.get("/")
    before = visitor.cookies[COOKIE]
    assert visitor.sign_in("Ana").status_code == 200
    assert visitor.cookies[COOKIE] != before
    fixed = Browser(visitor.app)
    fixed.cookies.set(COOKIE, before)
    assert fixed.get("/api/v1/publications").status_code == 401


def test_who_signs_out_is_out(admin):
    secret = admin.cookies[COOKIE]
    assert admin.act("DELETE", "/session").status_code == 200
    again = Browser(admin.app)
    again.cookies.set(COOKIE, secret)
    assert again.get("/api/v1/publications").status_code == 401


def test_who_was_away_for_a_day_signs_in_again(admin, service):
    with service.store.session() as session:
        for visit in session.query(Visit):
            visit.used -= 86400.0
    assert admin.get("/api/v1/publications").status_code == 401


def test_what_changes_something_must_come_from_our_own_page(admin):
    for headers in (
        {},
        {"X-Planmark-Form": "0" * 64},
        {"X-Planmark-Form": admin.token, "Origin": "http://evil.example"},
        {"X-Planmark-Form": admin.token, "Origin": "null"},
    ):
        answer = admin.post("/api/v1/publications", json={"assignment": "pump"}, headers=headers)
        assert answer.status_code == 403, headers
    assert admin.get("/api/v1/publications").json() == []


def test_a_form_token_is_of_one_visit_alone(admin, visitor):
    stolen = {"X-Planmark-Form": visitor.token, "Origin": ADDRESS}
    assert admin.post("/api/v1/publications", json={}, headers=stolen).status_code == 403


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example", "", "evil.example:8000"])
def test_only_requests_for_this_host_are_answered(visitor, host):
    assert visitor.get("/", headers={"Host": host}).status_code == 421


def test_every_answer_has_the_headers_of_safety(visitor):
    for path in ("/", "/api/v1/publications", "/static/app.js", "/nowhere", "/review/x/"):
        answer = visitor.get(path)
        missing = [name for name in HEADERS if name not in answer.headers]
        assert not missing, path
        assert "unsafe" not in answer.headers["Content-Security-Policy"]


def test_the_cookie_is_no_scripts_and_over_https_alone_where_there_is_https(visitor, app):
    said = visitor.get("/").headers["set-cookie"]
    assert "HttpOnly" in said
    assert "SameSite=lax" in said
    assert "Secure" not in said
    service = app.state.service
    object.__setattr__(service.settings, "address", "https://marks.example.org")
    try:
        answer = Browser(app).get("/", headers={"Host": "marks.example.org"})
    finally:
        object.__setattr__(service.settings, "address", ADDRESS)
    assert "Secure" in answer.headers["set-cookie"]
    assert answer.headers["Strict-Transport-Security"] == "max-age=31536000"


def test_a_token_does_what_its_instructor_may_until_it_is_taken_back(admin, colleague, app):
    made = admin.act("POST", "/tokens?title=grading%20script").json()
    program = Browser(app)
    head = {"Authorization": f"Bearer {made['token']}"}
    answer = program.post("/api/v1/publications", json={"assignment": "pump"}, headers=head)
    assert answer.status_code == 201
    (listed,) = admin.get("/api/v1/tokens").json()
    assert made["token"] not in str(listed)
    assert colleague.act("DELETE", f"/tokens/{listed['id']}").status_code == 404
    assert admin.act("DELETE", f"/tokens/{listed['id']}").status_code == 200
    assert program.get("/api/v1/publications", headers=head).status_code == 401
    assert program.get("/api/v1/publications", headers={"Authorization": "Bearer "}).status_code == 401


def test_a_visits_cookie_is_no_token_and_a_token_no_cookie(admin, app):
    head = {"Authorization": f"Bearer {admin.cookies[COOKIE]}"}
    assert Browser(app).get("/api/v1/publications", headers=head).status_code == 401
    token = admin.act("POST", "/tokens?title=script").json()["token"]
    browser = Browser(app)
    browser.cookies.set(COOKIE, token)
    assert browser.get("/api/v1/publications").status_code == 401


def test_only_administrators_invite_remove_and_read_the_audit_trail(admin, colleague):
    assert colleague.act("POST", "/accounts?name=Eve").status_code == 403
    assert colleague.get("/api/v1/audit").status_code == 403
    number = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Ion")
    assert colleague.act("DELETE", f"/accounts/{number}").status_code == 403
    assert admin.act("DELETE", f"/accounts/{number}").status_code == 200
    assert colleague.get("/api/v1/publications").status_code == 401


def test_the_audit_trail_says_who_did_what(admin, colleague, service):
    key = admin.publish()
    colleague.sign_in("Ion", "wrong wrong wrong")
    said = [(one["who"], one["act"], one["about"]) for one in admin.get("/api/v1/audit").json()]
    assert ("Ana", "published", key) in said
    assert any(act == "sign-in refused" and about == "Ion" for _, act, about in said)
    with service.store.session() as session:
        session.query(Audit).update({"at": time.time() - 400 * 86400.0})
    service.store.forget(days=365)
    assert admin.get("/api/v1/audit").json() == []


def test_an_instructor_sees_and_changes_the_own_publications_alone(admin, colleague):
    key = admin.publish()
    assert colleague.get("/api/v1/publications").json() == []
    top = f"/publications/{key}"
    tries = [
        ("GET", top), ("PATCH", top), ("DELETE", top), ("GET", f"{top}/results"), ("GET", f"{top}/links"),
        ("GET", f"{top}/requests"), ("POST", f"{top}/jobs"), ("GET", f"{top}/exports/csv"),
        ("GET", f"{top}/lint"), ("DELETE", f"{top}/students/s01"), ("PUT", f"{top}/files/a.jpg"),
        ("PUT", f"{top}/roster/files/roster.csv"), ("PUT", f"{top}/assignment/files/a.rubric.toml"),
        ("POST", f"{top}/links"),
    ]  # fmt: skip
    for method, path in tries:
        body = {"json": {}} if method == "PATCH" else {}
        assert colleague.act(method, path, **body).status_code == 404, path
    for page in (f"/publications/{key}", f"/publications/{key}/results/index.html", f"/review/{key}/"):
        assert colleague.get(page).status_code == 404, page
    number = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Ion")
    assert admin.act("PUT", f"/publications/{key}/members/{number}").status_code == 200
    assert colleague.get(f"/api/v1/publications/{key}").status_code == 200
    assert admin.act("DELETE", f"/publications/{key}/members/{number}").status_code == 200
    assert colleague.get(f"/api/v1/publications/{key}").status_code == 404


def test_students_reach_nothing_of_the_instructors(student, graded):
    key, _ = graded
    for path in ("", "/results", "/links", "/requests", "/exports/csv"):
        assert student.get(f"/api/v1/publications/{key}{path}").status_code == 401, path
    for path in (
        f"/publications/{key}",
        f"/publications/{key}/results/index.html",
        f"/review/{key}/",
        "/account",
    ):
        assert student.get(path).status_code == 401, path
    assert student.act("POST", f"/publications/{key}/jobs").status_code == 401
