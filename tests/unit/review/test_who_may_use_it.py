"""Only this machine's own page, or a holder of the token, may read and post."""

import pytest
from starlette.testclient import TestClient

from grader.folder.batch import Batch
from grader.review.server import HEADERS, application
from grader.review.session import Session
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment

PUMP = load_assignment("pump")
HERE = "http://127.0.0.1:8321"
OWN = {"X-Planmark": "review", "Origin": HERE}
TOKEN = "long-enough"  # noqa: S105 - of a test


@pytest.fixture
def empty(tmp_path):
    return Session(Batch(PUMP, load_rubric("pump"), tmp_path, tmp_path / "out"))


@pytest.fixture
def page(empty):
    return TestClient(application(empty), base_url=HERE)


@pytest.mark.parametrize("host", ["127.0.0.1:8321", "localhost:8321", "[::1]:8321", "localhost"])
def test_this_machine_is_answered(page, host):
    assert page.get("/api/class", headers={"Host": host}).status_code == 200


@pytest.mark.parametrize(
    "host", ["evil.example", "127.0.0.1.evil.example", "192.168.0.7:8321", "", "localhost.evil"]
)
@pytest.mark.parametrize("path", ["/", "/api/class", "/review.js", "/out/results.json", "/page", "/nowhere"])
def test_a_name_that_was_made_to_point_here_is_refused(page, host, path):
    assert page.get(path, headers={"Host": host}).status_code == 403


def test_the_own_page_may_post(page):
    assert page.post("/api/undo", json={"window": "w"}, headers=OWN).status_code == 200


@pytest.mark.parametrize(
    "headers",
    [
        {"X-Planmark": "review", "Origin": "http://evil.example"},
        {"X-Planmark": "review", "Origin": "null"},
        {"X-Planmark": "review", "Origin": "http://127.0.0.1:9999"},
        {"Origin": HERE},
        {"X-Planmark": "review", "Origin": HERE, "Content-Type": "text/plain"},
        {"X-Planmark": "review", "Origin": HERE, "Content-Type": "application/x-www-form-urlencoded"},
        {},
    ],
)
@pytest.mark.parametrize("path", ["decide", "whole", "node", "page", "undo", "finish"])
def test_no_other_page_may_post(page, headers, path):
    sent = {"Content-Type": "application/json", **headers}
    answer = page.post(f"/api/{path}", content=b'{"window": "w"}', headers=sent)
    assert answer.status_code == 403


@pytest.mark.parametrize("body", [b"", b"no json", b"[1]", b'"text"', b"\xff"])
def test_what_is_no_object_is_refused(page, body):
    answer = page.post("/api/undo", content=body, headers={**OWN, "Content-Type": "application/json"})
    assert answer.status_code == 400


def test_too_much_is_refused(page):
    answer = page.post("/api/undo", json={"window": "w" * 1_100_000}, headers=OWN)
    assert answer.status_code == 413


def test_every_answer_forbids_scripts_of_others(page):
    for path in ("/", "/api/class", "/review.js", "/nowhere"):
        answer = page.get(path)
        assert {name: answer.headers[name] for name in HEADERS} == HEADERS


def test_nothing_is_loaded_from_elsewhere(page):
    for path in ("/", "/viewer.js", "/review.js", "/review.css"):
        text = page.get(path).text.replace("http://www.w3.org/2000/svg", "")
        assert "http://" not in text
        assert "https://" not in text


# With a token ---------------------------------------------------------------------------------------


@pytest.fixture
def guarded(empty):
    return TestClient(
        application(empty, token=TOKEN), base_url="http://10.0.0.5:8321", follow_redirects=False
    )


@pytest.mark.parametrize(
    "path", ["/", "/api/class", "/?token=wrong", "/api/class?token=long-enough", "/?token="]
)
def test_without_the_token_nothing_is_told(guarded, path):
    answer = guarded.get(path)
    assert answer.status_code == 401
    assert "Pump" not in answer.text


def test_the_token_opens_it_once_and_a_cookie_keeps_it_open(guarded):
    answer = guarded.get(f"/?token={TOKEN}&part=2/3")
    assert (answer.status_code, answer.headers["location"]) == (303, "/?part=2%2F3")
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie
    assert "samesite=lax" in cookie
    assert guarded.get("/").status_code == 200
    own = {"X-Planmark": "review", "Origin": "http://10.0.0.5:8321"}
    assert guarded.post("/api/undo", json={"window": "w"}, headers=own).status_code == 200
    assert guarded.post("/api/undo", json={"window": "w"}, headers={**own, "Origin": HERE}).status_code == 403


@pytest.mark.parametrize(
    ("path", "code", "told"),
    [
        ("/page?file=a.jpg&page=1", "page_missing", "nu există această pagină"),
        ("/page?file=a.jpg&page=x", "answer_refused", "„x” nu este un număr care se poate folosi aici"),
        ("/page?file=a.jpg&page=1.5", "answer_refused", "1,5 nu este un număr întreg"),
        ("/api/question?student=s99", "student_unknown", "studentul s99 nu mai este în această grupă"),
    ],
)
def test_refusals_are_told_in_the_reviewers_language(empty, path, code, told):
    answer = TestClient(application(empty, "ro"), base_url=HERE).get(path)
    assert (answer.status_code, answer.json()) == (400, {"code": code, "message": told})
