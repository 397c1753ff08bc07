"""LTI 1.3 against the reference platform: launches, choices, grades, and messages that are not right."""

import time
from urllib.parse import parse_qs, urlsplit

import jwt
import pytest
from jwcrypto.jwk import JWK

from tests.unit.web.conftest import Browser
from tests.unit.web.platform import CLAIM, ROLE, Platform

TEACHER = {f"{CLAIM}roles": [f"{ROLE}Instructor"], "sub": "teacher-1", "name": "Doina"}


@pytest.fixture
def platform(admin):
    made = Platform()
    assert admin.act("POST", "/lti/platforms", json=made.registration).status_code == 201
    made.tool_keys = admin.get("/lti/jwks").text
    yield made
    made.stop()


def chosen(platform, browser, key):
    """The teacher launches the activity and chooses the publication."""
    answer = platform.launch(browser, **TEACHER)
    assert answer.status_code == 303, answer.text
    address = answer.headers["location"]
    assert address.startswith("/lti/choose?for=")
    name = parse_qs(urlsplit(address).query)["for"][0]
    page = browser.get(address)
    assert (page.status_code, 'id="publication"' in page.text) == (200, True), page.text
    return browser.act("POST", f"/lti/chosen/{name}?key={key}")


@pytest.fixture
def activity(platform, graded, admin, app):
    """An activity that shows the graded publication; and its teacher."""
    key, _ = graded
    teacher = Browser(app)
    platform.launch(teacher, **TEACHER)
    account = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Doina")
    assert admin.act("PUT", f"/publications/{key}/members/{account}").status_code == 200
    assert chosen(platform, teacher, key).json() == {"address": f"/publications/{key}"}
    return key, teacher


def test_a_teacher_gets_an_account_and_chooses_what_the_activity_shows(activity, platform, app):
    key, teacher = activity
    again = platform.launch(Browser(app), **TEACHER)
    assert again.headers["location"] == f"/publications/{key}"
    assert teacher.get(f"/api/v1/publications/{key}").status_code == 200
    assert teacher.get("/api/v1/audit").status_code == 403


def test_a_teacher_of_another_course_sees_nothing_of_it(activity, platform, app):
    key, _ = activity
    other = Browser(app)
    changed = {**TEACHER, "sub": "teacher-2", "name": "Radu", f"{CLAIM}resource_link": {"id": "activity-2"}}
    assert platform.launch(other, **changed).headers["location"].startswith("/lti/choose")
    assert other.get(f"/api/v1/publications/{key}").status_code == 404
    custom = {f"{CLAIM}custom": {"publication": key}}
    assert platform.launch(other, **changed, **custom).headers["location"].startswith("/lti/choose")


@pytest.mark.parametrize("who", [{"sub": "s09"}, {f"{CLAIM}lis": {"person_sourcedid": "s09"}}])
def test_a_student_of_the_roster_comes_to_the_own_feedback(activity, platform, app, who):
    key, _ = activity
    student = Browser(app)
    answer = platform.launch(student, **who)
    assert answer.headers["location"] == f"/c/{key}"
    (own,) = student.get(f"/api/v1/publications/{key}/feedback").json()
    assert own["report"]["student_id"] == "s09"


def test_a_student_who_is_on_no_roster_checks_values_alone(activity, platform, app):
    key, _ = activity
    stranger = Browser(app)
    assert platform.launch(stranger, sub="nobody").status_code == 303
    assert stranger.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert stranger.get(f"/c/{key}").status_code == 200


def test_a_student_is_told_where_nothing_is_chosen_yet(platform, visitor):
    answer = platform.launch(visitor, sub="s09")
    assert (answer.status_code, answer.json()["code"]) == (404, "lti_unchosen")


def test_deep_linking_answers_with_the_chosen_publication(platform, admin, app, graded):
    key, _ = graded
    settings = {
        "deep_link_return_url": f"{platform.address}/return", "accept_types": ["ltiResourceLink"],
        "accept_presentation_document_targets": ["window"], "data": "opaque",
    }  # fmt: skip
    changed = {
        **TEACHER, f"{CLAIM}message_type": "LtiDeepLinkingRequest", f"{CLAIM}resource_link": None,
        "https://purl.imsglobal.org/spec/lti-dl/claim/deep_linking_settings": settings,
    }  # fmt: skip
    teacher = Browser(app)
    platform.launch(teacher, **TEACHER)
    account = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Doina")
    admin.act("PUT", f"/publications/{key}/members/{account}")
    answer = platform.launch(teacher, **changed)
    name = parse_qs(urlsplit(answer.headers["location"]).query)["for"][0]
    told = teacher.act("POST", f"/lti/chosen/{name}?key={key}").json()
    assert told["address"] == f"{platform.address}/return"
    tool = JWK(**admin.get("/lti/jwks").json()["keys"][0]).export_to_pem()
    said = jwt.decode(told["JWT"], tool, algorithms=["RS256"], audience=platform.address)
    (item,) = said["https://purl.imsglobal.org/spec/lti-dl/claim/content_items"]
    assert item["custom"] == {"publication": key}
    assert teacher.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404


def test_a_choice_is_the_teachers_own(platform, admin, app):
    key = admin.publish()
    teacher = Browser(app)
    name = parse_qs(urlsplit(platform.launch(teacher, **TEACHER).headers["location"]).query)["for"][0]
    assert admin.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404
    assert teacher.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404


# Messages that are not right -----------------------------------------------------------------------

STRANGER = JWK.generate(kty="RSA", size=2048, kid="platform-key")


@pytest.mark.parametrize(
    "changed",
    [
        {"nonce": "another"}, {"nonce": None}, {"aud": "another-client"}, {"iss": "https://evil.example"},
        {"exp": int(time.time()) - 600}, {f"{CLAIM}deployment_id": "another"}, {f"{CLAIM}version": "1.1"},
        {f"{CLAIM}message_type": "Unknown"}, {f"{CLAIM}message_type": None}, {"sub": None},
        {f"{CLAIM}resource_link": None}, {f"{CLAIM}roles": None},
    ],
)  # fmt: skip
def test_a_message_that_is_not_right_is_refused(platform, visitor, changed):
    answer = platform.launch(visitor, **changed)
    assert answer.status_code in {403, 404}, answer.text
    assert visitor.get("/api/v1/publications").status_code == 401


def test_a_message_that_another_has_signed_is_refused(platform, visitor):
    asked = platform.begun(visitor)
    forged = [
        platform.signed(platform.claims(asked, **TEACHER), STRANGER),
        platform.signed(platform.claims(asked, **TEACHER), algorithm="none"),
        platform.signed(platform.claims(asked, **TEACHER))[:-6] + "AAAAAA",
        "a.b.c", "", "x" * 1000,
    ]  # fmt: skip
    for token in forged:
        answer = visitor.post("/lti/launch", data={"state": asked["state"], "id_token": token})
        assert answer.status_code == 403, token[:40]


def test_a_message_is_good_once(platform, visitor, app):
    asked = platform.begun(visitor)
    form = {"state": asked["state"], "id_token": platform.signed(platform.claims(asked, **TEACHER))}
    assert visitor.post("/lti/launch", data=form, follow_redirects=False).status_code == 303
    assert visitor.post("/lti/launch", data=form).status_code == 403
    assert Browser(app).post("/lti/launch", data=form).status_code == 403


def test_a_launch_that_another_browser_began_is_refused(platform, visitor, app):
    asked = platform.begun(visitor)
    form = {"state": asked["state"], "id_token": platform.signed(platform.claims(asked, **TEACHER))}
    answer = Browser(app).post("/lti/launch", data=form)
    assert answer.status_code == 403
    assert "cookies" in answer.json()["message"]


def test_a_login_of_a_platform_that_is_not_registered_is_refused(visitor):
    form = {"iss": "https://evil.example", "login_hint": "x", "client_id": "y"}
    assert visitor.post("/lti/login", data=form).status_code == 400
    assert visitor.get("/lti/login").status_code == 400
    assert visitor.post("/lti/launch", data={"error": "login_required"}).status_code == 400


@pytest.mark.parametrize(
    "address",
    [
        "http://platform.example/token", "https://10.0.0.5/token", "https://169.254.169.254/latest",
        "https://localhost/token", "https://[::1]/token", "file:///etc/passwd", "https://a:b@platform.example/",
        "https://printer.local/", "gopher://platform.example",
    ],
)  # fmt: skip
def test_the_server_is_not_sent_into_its_own_network(admin, address):
    registration = {
        "issuer": "https://platform.example", "client_id": "1", "deployments": ["1"],
        "auth_login_url": "https://platform.example/a", "key_set_url": "https://platform.example/k",
        "auth_token_url": address,
    }  # fmt: skip
    assert admin.act("POST", "/lti/platforms", json=registration).status_code == 422


def test_only_administrators_register_platforms(colleague, visitor, platform):
    for browser, status in ((colleague, 403), (visitor, 401)):
        assert browser.act("POST", "/lti/platforms", json=platform.registration).status_code == status
        assert browser.get("/api/v1/lti/platforms").status_code == status


# Grades --------------------------------------------------------------------------------------------


def test_grades_are_returned_once_and_refusals_are_told(activity, platform, app, admin):
    key, teacher = activity
    platform.launch(Browser(app), sub="s09")
    path = f"/publications/{key}/lti/scores"
    platform.broken = 500
    told = teacher.act("POST", path).json()
    assert told["refused"] == {"s09": "the platform answers 500"}
    assert "s11" in told["withheld"]
    platform.broken = None
    told = teacher.act("POST", path).json()
    assert (told["sent"], told["refused"]) == (["s09"], {})
    ((where, score),) = platform.scores
    assert where == "/items/1/scores"
    report = next(one for one in admin.get(f"/api/v1/publications/{key}/results").json()["reports"])
    assert (score["userId"], score["scoreGiven"]) == ("s09", pytest.approx(report["score"], abs=0.01))
    assert (score["gradingProgress"], score["scoreMaximum"]) == ("FullyGraded", report["max_score"])
    assert teacher.act("POST", path).json()["same"] == ["s09"]
    assert len(platform.scores) == 1


def test_there_are_no_grades_to_send_without_an_activity(graded, admin):
    key, _ = graded
    assert admin.act("POST", f"/publications/{key}/lti/scores").status_code == 404
