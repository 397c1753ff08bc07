"""LTI 1.3 against the reference platform: launches, choices, grades, and messages that are not right."""

import time
from urllib.parse import parse_qs, urlsplit

import jwt
import pytest
from jwcrypto.jwk import JWK

from grader.rubric import load_rubric
from tests.unit.web.conftest import Browser
from tests.unit.web.platform import CLAIM, CLIENT, ROLE, Platform

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
    maximum = admin.get(f"/api/v1/publications/{key}/results").json()["reports"][0]["max_score"]
    title = admin.get(f"/api/v1/publications/{key}").json()["title"]
    told_item = {"scoreMaximum": maximum, "label": title, "resourceId": "pump", "tag": "grade"}
    assert (item["lineItem"], maximum) == (told_item, load_rubric("pump").max_score)
    assert teacher.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404


def test_a_choice_is_the_teachers_own(platform, admin, app):
    key = admin.publish()
    teacher = Browser(app)
    name = parse_qs(urlsplit(platform.launch(teacher, **TEACHER).headers["location"]).query)["for"][0]
    assert admin.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404
    assert teacher.act("POST", f"/lti/chosen/{name}?key={key}").status_code == 404


# Messages that are not right -----------------------------------------------------------------------

STRANGER = JWK.generate(kty="RSA", size=2048, kid="platform-key")


NOT_RIGHT = [
    {"nonce": "another"}, {"nonce": None}, {"aud": "another-client"}, {"iss": "https://evil.example"},
    {"exp": None}, {"iat": None}, {"azp": "another-client"}, {"aud": [CLIENT, "another-client"]},
    {"aud": [CLIENT, "another-client"], "azp": "another-client"}, {"aud": []},
    {f"{CLAIM}deployment_id": "another"}, {f"{CLAIM}version": "1.1"},
    {f"{CLAIM}message_type": "Unknown"}, {f"{CLAIM}message_type": None}, {"sub": None},
    {f"{CLAIM}resource_link": None}, {f"{CLAIM}roles": None},
]  # fmt: skip


def test_a_message_that_is_not_right_is_refused(platform, app):
    for changed in NOT_RIGHT:
        visitor = Browser(app)
        answer = platform.launch(visitor, **changed)
        assert answer.status_code in {400, 403}, changed
        assert visitor.get("/api/v1/publications").status_code == 401, changed


def test_a_message_of_another_time_is_refused(platform, app):
    for claim, later_s in (("exp", -600), ("iat", 600), ("iat", -3600)):
        visitor = Browser(app)
        answer = platform.launch(visitor, **{claim: int(time.time()) + later_s})
        assert answer.status_code in {400, 403}, claim
        assert visitor.get("/api/v1/publications").status_code == 401, claim


def test_a_message_for_several_says_who_may_use_it(platform, app):
    audiences = {"aud": ["another-client", CLIENT], "azp": CLIENT}
    assert platform.launch(Browser(app), **TEACHER, **audiences).status_code == 303


def test_odd_claims_are_told_even_where_they_are_signed(platform, visitor):
    grades = "https://purl.imsglobal.org/spec/lti-ags/claim/endpoint"
    for changed in (
        {f"{CLAIM}roles": [1]}, {f"{CLAIM}roles": "Instructor"}, {f"{CLAIM}roles": [["Instructor"]]},
        {"sub": {"a": 1}}, {"sub": "s09\0"}, {"name": [1]}, {"email": 7}, {"exp": "soon"}, {"exp": True},
        {"exp": 1e400}, {"aud": {"a": 1}}, {f"{CLAIM}resource_link": "x"}, {"nonce": 5},
        {f"{CLAIM}resource_link": {"id": 5}}, {f"{CLAIM}lis": [1]}, {f"{CLAIM}custom": "x"},
        {f"{CLAIM}deployment_id": [1]}, {grades: {"scope": "all", "lineitems": 1}},
    ):  # fmt: skip
        answer = platform.launch(visitor, **{**TEACHER, **changed})
        assert (answer.status_code, answer.json()["code"]) == (400, "lti_launch"), changed
    assert visitor.get("/api/v1/publications").status_code == 401


def test_state_nonce_and_platform_are_of_one_launch(platform, admin, app):
    """A message of platform B, or with the nonce of another browser, does not pass with A's state."""
    other = Platform()
    assert admin.act("POST", "/lti/platforms", json=other.registration).status_code == 201
    try:
        browser, second = Browser(app), Browser(app)
        asked = platform.begun(browser)
        form = {"state": asked["state"], "id_token": other.signed(other.claims(asked, **TEACHER))}
        assert browser.post("/lti/launch", data=form).status_code == 403
        mine, theirs = platform.begun(browser), platform.begun(second)
        token = platform.signed(platform.claims(theirs, **TEACHER))
        assert (
            browser.post("/lti/launch", data={"state": mine["state"], "id_token": token}).status_code == 403
        )
        token = platform.signed(platform.claims(mine, **TEACHER))
        again = browser.post("/lti/launch", data={"state": mine["state"], "id_token": token})
        assert again.status_code == 403
    finally:
        other.stop()


def test_the_state_alone_is_no_proof_of_the_browser(platform, app):
    """Whoever has read state and message on their way cannot make the cookie that belongs to them."""
    asked = platform.begun(Browser(app))
    thief = Browser(app)
    for name in (f"planmark-{asked['state']}", *(f"{one}" for one in thief.cookies)):
        thief.cookies.set(name, asked["state"])
    form = {"state": asked["state"], "id_token": platform.signed(platform.claims(asked, **TEACHER))}
    assert thief.post("/lti/launch", data=form).status_code == 403


# Roles in the course -------------------------------------------------------------------------------

INSTITUTION = "http://purl.imsglobal.org/vocab/lis/v2/institution/person#"


def test_what_somebody_is_elsewhere_is_no_role_in_the_course(activity, platform, app):
    key, _ = activity
    for role in (
        *(f"{INSTITUTION}{name}" for name in ("Instructor", "Staff", "Faculty", "Administrator")),
        "http://purl.imsglobal.org/vocab/lis/v2/system/person#Administrator",
        "http://purl.imsglobal.org/vocab/lis/v2/person#Instructor",
        f"{ROLE.removesuffix('#')}/Instructor#TeachingAssistant", f"{ROLE}Mentor", "instructor", "Staff",
    ):  # fmt: skip
        student = Browser(app)
        answer = platform.launch(student, sub="s09", **{f"{CLAIM}roles": [f"{ROLE}Learner", role]})
        assert answer.headers["location"] == f"/c/{key}", role
        assert student.get(f"/api/v1/publications/{key}").status_code == 401, role


def colleague_by_launch(platform, app):
    browser = Browser(app)
    platform.launch(browser, **{**TEACHER, "sub": "teacher-2", "name": "Radu"})
    return browser


def test_membership_by_a_launch_ends_with_a_later_launch_without_the_role(activity, platform, app, admin):
    key, _ = activity
    browser = colleague_by_launch(platform, app)
    assert browser.get(f"/api/v1/publications/{key}").status_code == 200
    assert platform.launch(Browser(app), sub="teacher-2").status_code == 303
    assert browser.get(f"/api/v1/publications/{key}").status_code == 404
    assert "no role in the course" in admin.get("/api/v1/audit").text


def test_a_colleague_whom_a_person_let_in_stays(activity, platform, app):
    key, teacher = activity
    assert platform.launch(Browser(app), sub="teacher-1").status_code == 303
    assert teacher.get(f"/api/v1/publications/{key}").status_code == 200


def test_what_a_platforms_launches_gave_ends_with_the_platform(activity, platform, app, admin):
    key, teacher = activity
    browser, student = colleague_by_launch(platform, app), Browser(app)
    platform.launch(student, sub="s09")
    (known,) = admin.get("/api/v1/lti/platforms").json()
    assert admin.act("DELETE", f"/lti/platforms/{known['id']}").status_code == 200
    assert browser.get(f"/api/v1/publications/{key}").status_code == 401
    assert teacher.get(f"/api/v1/publications/{key}").status_code == 401
    assert student.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    names = [one["name"] for one in admin.get(f"/api/v1/publications/{key}").json()["members"]]
    assert "Radu" not in names


def test_members_who_came_from_platforms_are_listed_to_the_administrator(activity, platform, app, admin):
    key, teacher = activity
    colleague_by_launch(platform, app)
    listed = {one["name"]: one for one in admin.get("/api/v1/lti/members").json()}
    assert (listed["Radu"]["publication"], listed["Radu"]["by_launch"]) == (key, True)
    assert listed["Doina"]["by_launch"] is False
    assert "Radu" in admin.get("/account").text
    assert teacher.get("/api/v1/lti/members").status_code == 403


# Who is which student ------------------------------------------------------------------------------


@pytest.fixture
def contested(activity, platform, app, admin):
    """Two who come as s09; the first has it."""
    key, _ = activity
    roster = b"student_id,name,n,email\ns09,Student 9,27,s09@example.org\ns11,Student 11,5,s11@example.org\n"
    assert admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster).status_code == 200
    first, second = Browser(app), Browser(app)
    mail = {"email": "S09@example.org"}
    assert platform.launch(first, sub="user-9", name="Vlad", **mail).status_code == 303
    refused = platform.launch(second, sub="user-8", name="Ovidiu", **mail)
    assert (refused.status_code, refused.json()["code"]) == (409, "lti_claimed")
    return key, first, second


def claims_of(admin, key):
    found = admin.get(f"/api/v1/publications/{key}/lti/claims").json()
    return {one["who"].partition(" ")[0]: one for one in found}


def test_a_second_one_who_comes_as_a_student_sees_and_gets_nothing(contested, platform, admin):
    key, first, second = contested
    assert first.get(f"/api/v1/publications/{key}/feedback").status_code == 200
    assert second.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert {who: one["holds"] for who, one in claims_of(admin, key).items()} == {
        "Vlad": True,
        "Ovidiu": False,
    }
    page = admin.get(f"/publications/{key}").text
    assert "Vlad" in page
    assert "Ovidiu" in page
    admin.act("POST", f"/publications/{key}/lti/scores")
    assert [score["userId"] for _, score in platform.scores] == ["user-9"]


def test_the_instructor_decides_who_the_student_is(contested, platform, admin):
    key, first, second = contested
    number = claims_of(admin, key)["Ovidiu"]["id"]
    assert first.act("PUT", f"/publications/{key}/lti/claims/{number}").status_code == 401
    assert admin.act("PUT", f"/publications/{key}/lti/claims/{number}").status_code == 200
    assert first.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert platform.launch(second, sub="user-8", email="s09@example.org").status_code == 303
    assert second.get(f"/api/v1/publications/{key}/feedback").status_code == 200
    assert platform.launch(first, sub="user-9", email="s09@example.org").status_code == 409
    admin.act("POST", f"/publications/{key}/lti/scores")
    assert [score["userId"] for _, score in platform.scores] == ["user-8"]


def test_nobody_is_two_students(contested, platform, admin, app):
    """A changed e-mail address makes nobody another student."""
    key, *_ = contested
    assert platform.launch(Browser(app), sub="user-9", email="s11@example.org").status_code == 409
    number = claims_of(admin, key)["Vlad"]["id"]
    assert admin.act("DELETE", f"/publications/{key}/lti/claims/{number}").status_code == 200
    assert platform.launch(Browser(app), sub="user-9", email="s09@example.org").status_code == 409


def test_the_next_one_at_the_same_computer_is_not_the_one_before(contested, platform):
    key, first, _ = contested
    assert platform.launch(first, sub="nobody").status_code == 303
    assert first.get(f"/api/v1/publications/{key}/feedback").status_code == 401


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


NOT_PUBLIC = [
    "http://platform.example/token", "https://10.0.0.5/token", "https://169.254.169.254/latest",
    "https://localhost/token", "https://localhost./token", "https://[::1]/token", "file:///etc/passwd",
    "https://a:b@platform.example/", "https://printer.local/", "gopher://platform.example", "https://0/",
    "https://2130706433/", "https://0x7f.1/", "https://127.1/", "https://[::ffff:127.0.0.1]/",
    "https://[64:ff9b::7f00:1]/", "https://[2002:7f00:1::]/", "https://224.0.0.1/", "https://x:99999/",
    "https://" + "a" * 300 + ".example/",
]  # fmt: skip


def test_the_server_is_not_sent_into_its_own_network(admin):
    for address in NOT_PUBLIC:
        registration = {
            "issuer": "https://platform.example", "client_id": "1", "deployments": ["1"],
            "auth_login_url": "https://platform.example/a", "key_set_url": "https://platform.example/k",
            "auth_token_url": address,
        }  # fmt: skip
        assert admin.act("POST", "/lti/platforms", json=registration).status_code == 422, address


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
    assert told["refused"]["s09"] == {
        "code": "platform_refuses",
        "message": "the platform answers 500",
        "parameters": {"status": 500},
    }
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
