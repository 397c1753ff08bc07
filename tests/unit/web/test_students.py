"""Actions of students: checks, attempts, personal links, feedback, requests, sheets."""

import time
from concurrent.futures import ThreadPoolExecutor
from datetime import UTC, datetime
from functools import partial

import pytest

from grader.web import store
from grader.web.store import Link, Regrading
from tests.unit.web.conftest import SAMPLES, Browser
from tests.waiting import PATIENCE_S, until

CELLS = {"v_A": "60,0", "kv": "0,219911", "v_B": "12"}


def checked(browser, key, cells, **known):
    return browser.act("POST", f"/publications/{key}/checks", json={"n": 12, "cells": cells, **known})


def lines_of(answer):
    return {line["name"]: line for line in answer.json()["lines"]}


def test_values_are_checked_with_decimal_commas_and_the_units_of_the_form(admin, visitor):
    told = checked(visitor, admin.publish(), CELLS)
    assert told.status_code == 200, told.text
    lines = lines_of(told)
    assert (lines["v_A"]["result"], lines["kv"]["result"], lines["v_B"]["result"]) == (
        "right",
        "right",
        "off",
    )
    assert lines["v_B"]["advice"]
    assert told.json()["attempts_left"] is None


def test_no_answer_is_given_away(admin, visitor):
    key = admin.publish()
    far = checked(visitor, key, {"v_B": "12", "v_B_deg": "10"})
    assert "mm" not in lines_of(far)["v_B"]["hint"]
    assert "expected" not in far.text
    symbol = checked(visitor, admin.publish(level="symbol"), {"v_B": "12"})
    assert (lines_of(symbol)["v_B"]["hint"], lines_of(symbol)["v_B"]["advice"]) == ("", "")
    assert visitor.act("POST", "/publications", json={"level": "full"}).status_code in {401, 422}


def test_the_plan_is_drawn_as_measured(admin, visitor):
    key = admin.publish()
    (drawing,) = checked(visitor, key, {"v_A": "60", "v_A_deg": "200"}).json()["drawing"]
    assert drawing.startswith("<svg")
    assert checked(visitor, key, {"v_A": "60"}).json()["drawing"] == []


def test_what_cannot_be_used_is_told_in_the_students_language(admin, visitor):
    key = admin.publish()
    told = checked(visitor, key, {"v_A": "sixty", "v_Q": "3"}, lang="ro").json()
    assert "sixty" in told["fields"]["v_A"]
    assert any("v_Q" in problem for problem in told["problems"])
    for n in (0, 99, None):
        refused = checked(visitor, key, CELLS, n=n)
        assert refused.status_code == 422
        assert "1" in refused.json()["message"]


def test_a_closed_self_check_is_the_instructors_alone(admin, visitor):
    key = admin.publish(is_open=False)
    assert checked(visitor, key, CELLS).status_code == 403
    assert visitor.get(f"/c/{key}").status_code == 403
    assert checked(admin, key, CELLS).status_code == 200


def test_students_behind_one_address_do_not_count_as_one(admin, app):
    key = admin.publish()
    for _ in range(5):
        student = Browser(app)
        assert student.get(f"/c/{key}").status_code == 200
        statuses = {checked(student, key, {}).status_code for _ in range(15)}
        assert statuses == {200}


@pytest.fixture
def one_connection(monkeypatch):
    """A data base that answers one request at a time."""
    monkeypatch.setattr(store, "create_engine", partial(store.create_engine, pool_timeout=PATIENCE_S))
    monkeypatch.setattr(store, "CONNECTIONS", 1)


@pytest.mark.slow
@pytest.mark.usefixtures("one_connection")
def test_requests_do_not_keep_a_connection_while_they_wait_for_each_other(admin, app):
    key = admin.publish()
    students = [Browser(app) for _ in range(60)]
    with ThreadPoolExecutor(60) as crowd:
        pages = list(crowd.map(lambda one: one.get(f"/c/{key}").status_code, students))
        checks = list(crowd.map(lambda one: checked(one, key, CELLS).status_code, students))
    assert set(pages) == set(checks) == {200}


def test_a_student_who_has_left_the_roster_sees_the_own_page(admin, graded, student):
    key, _ = graded
    roster = b"student_id,name,n\ns11,Student 11,5\n"
    assert admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster).status_code == 200
    page = student.get(f"/c/{key}")
    assert (page.status_code, "s09" in page.text) == (200, True)


def test_there_is_no_list_of_publications_for_visitors(visitor, admin):
    admin.publish()
    assert visitor.get("/api/v1/publications/wrong/form").status_code == 404
    statuses = [visitor.get(f"/api/v1/publications/try{number}/form").status_code for number in range(70)]
    assert statuses[-1] == 429


def test_limited_attempts_need_a_personal_link_and_are_counted_by_variant(admin, graded, student, visitor):
    key, _ = graded
    admin.act("PATCH", f"/publications/{key}", json={"attempts": 2})
    assert checked(visitor, key, CELLS).status_code == 401
    left = [checked(student, key, CELLS, n=27).json()["attempts_left"] for _ in range(2)]
    assert left == [1, 0]
    refused = checked(student, key, CELLS, n=27)
    assert (refused.status_code, refused.json()["code"]) == (403, "attempts_used")
    assert checked(student, key, CELLS, n=5).status_code == 200
    assert checked(admin, key, CELLS, n=27).json()["attempts_left"] is None
    admin.act("PATCH", f"/publications/{key}", json={"attempts": 0})
    assert checked(visitor, key, CELLS).status_code == 200


def test_a_photo_is_checked_in_the_queue_and_deleted(admin, visitor, settings, app, monkeypatch):
    key = admin.publish()
    photo = (SAMPLES / "s02_1.jpg").read_bytes()[:900_000]
    monkeypatch.setattr(app.state.service.queue, "photo", _looked_at)
    job = visitor.act("POST", f"/publications/{key}/photos?n=12&lang=ro", content=photo).json()
    found = visitor.ended("/photos", job)
    assert (found["state"], found["result"]["lang"], found["result"]["n"]) == ("done", "ro", 12)
    assert not list((settings.data / "publications" / key / "photos").glob("*"))
    other = Browser(app)
    other.get("/")
    assert other.get(f"/api/v1/photos/{job['key']}").status_code == 404


def _looked_at(path, asked):
    return {"is_there": path.is_file(), **asked}


def test_only_pictures_are_taken_as_photos(admin, visitor, settings):
    key = admin.publish()
    for body in (b"", b"<svg/>", b"MZ\x90", b"<html>", b"%!PS", b"PK\x03\x04"):
        answer = visitor.act("POST", f"/publications/{key}/photos?n=12", content=body)
        assert (answer.status_code, answer.json()["code"]) == (415, "file_type"), body
    assert not list(settings.data.rglob("photos/*"))


def test_a_personal_link_opens_the_own_feedback_alone(graded, app):
    key, links = graded
    student = Browser(app)
    assert student.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert student.get(links["s11"], follow_redirects=False).headers["location"] == f"/c/{key}"
    (own,) = student.get(f"/api/v1/publications/{key}/feedback").json()
    assert own["report"]["student_id"] == "s11"
    page = student.get(f"/api/v1/publications/{key}/feedback/0/feedback.html")
    assert "Student 11" in page.text
    assert "sandbox" in page.headers["Content-Security-Policy"]
    for place, name in (
        ("1", "feedback.html"),
        ("0", "report.json"),
        ("0", "..%2F..%2Fresults.json"),
        ("9", "x"),
    ):
        assert student.get(f"/api/v1/publications/{key}/feedback/{place}/{name}").status_code == 404


def test_a_link_is_refused_when_it_is_forged_revoked_or_too_old(graded, app, admin, service):
    key, links = graded
    own = links["s09"]
    number, _, signature = own.removeprefix("/s/").rpartition(".")
    forged = [f"/s/{number}.{signature[::-1]}", f"/s/Mg.{signature}", "/s/1", "/s/.", f"{own}x"]
    assert [Browser(app).get(one).status_code for one in forged] == [404] * len(forged)
    student = Browser(app)
    assert student.get(own).status_code == 200
    listed = admin.get(f"/api/v1/publications/{key}/links").json()
    first = next(one["id"] for one in listed if one["student_id"] == "s09")
    assert admin.act("DELETE", f"/publications/{key}/links/{first}").status_code == 200
    assert student.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert Browser(app).get(own).status_code == 404
    with service.store.session() as session:
        session.query(Link).filter_by(student_id="s11").update({"expires": time.time() - 1.0})
    assert Browser(app).get(links["s11"]).status_code == 404
    (new,) = admin.act("POST", f"/publications/{key}/links?student=s11").json()
    assert Browser(app).get(new["address"].partition(":8000")[2]).status_code == 200


def test_what_cannot_be_used_is_told_of_its_field_and_nothing_else_is(graded, visitor):
    cells = {"v_A": "abc", "v_A_deg": "400", "kv": "0.2 furlongs", "v_B": "12,5"}
    told = visitor.act("POST", f"/publications/{graded[0]}/checks", json={"n": 7, "cells": cells}).json()
    assert set(told["fields"]) == {"v_A", "v_A_deg", "kv"}
    assert told["fields"]["v_A"] == "'abc' is no number"
    assert "360 degrees" in told["fields"]["v_A_deg"]
    assert told["problems"] == []
    assert not told["is_right"]
    assert "kv" not in [line["name"] for line in told["lines"]]
    assert "file" not in str(told)


def test_feedback_is_seen_when_it_is_released(graded, admin, student):
    key, _ = graded
    admin.act("PATCH", f"/publications/{key}", json={"is_released": False})
    assert student.get(f"/api/v1/publications/{key}/feedback").status_code == 403
    assert "Your feedback" not in student.get(f"/c/{key}").text


def test_feedback_that_is_released_is_seen_from_its_date_on(graded, admin, student):
    key, _ = graded

    def told(release_at):
        answer = admin.act("PATCH", f"/publications/{key}", json={"release_at": release_at})
        page = student.get(f"/c/{key}").text
        return answer.json().get("release_at"), student.get(f"/api/v1/publications/{key}/feedback"), page

    at, answer, page = told("2126-12-01T08:00+02:00")
    assert at == datetime(2126, 12, 1, 6, tzinfo=UTC).astimezone().isoformat(timespec="minutes")
    assert answer.status_code == 403
    assert "Your feedback" not in page
    assert "You will see your feedback here from 2126-12-01 " in page
    for past in ("2026-11-01T08:00", ""):
        _, answer, page = told(past)
        assert answer.status_code == 200
        assert "Your feedback" in page
    for wrong in ("soon", "2026-12-01", "0000-01-01T00:00"):
        refused = admin.act("PATCH", f"/publications/{key}", json={"release_at": wrong})
        assert (refused.status_code, refused.json()["code"]) == (422, "time_refused")


@pytest.mark.usefixtures("grades_here")
def test_a_release_with_open_criteria_warns_with_their_number(graded, admin):
    key, _ = graded
    assert "warning" not in admin.act("PATCH", f"/publications/{key}", json={"is_released": True}).json()
    illegible = b"student_id,n,kL,v_A,v_DC\ns11,5,1:5,60,12 or 13\n"
    admin.act("PUT", f"/publications/{key}/files/m.csv", content=illegible)
    admin.act("DELETE", f"/publications/{key}/files/s11.json")
    job = admin.act("POST", f"/publications/{key}/jobs").json()
    assert admin.ended(f"/publications/{key}/jobs", job)["state"] == "done"
    answer = admin.act("PATCH", f"/publications/{key}", json={"is_released": True}).json()
    assert answer["is_released"]
    assert answer["warning"] == "Submissions without a final mark: 1; criteria still open: 2."
    assert f'data-warn="{answer["warning"]}' in admin.get(f"/publications/{key}").text


def test_nothing_is_handed_in_after_the_deadline(graded, admin, student, settings):
    key, _ = graded
    path = f"/publications/{key}/sheets"
    admin.act("PATCH", f"/publications/{key}", json={"deadline": "2126-12-01T23:59"})
    assert "Hand in until 2126-12-01 23:59" in student.get(f"/c/{key}").text
    assert student.act("POST", path, content=b"\xff\xd8\xff").status_code == 201
    admin.act("PATCH", f"/publications/{key}", json={"deadline": "2026-11-01T23:59"})
    refused = student.act("POST", path, content=b"\xff\xd8\xff late")
    zone = datetime.fromisoformat("2026-11-01T23:59").astimezone().strftime("%Z")
    assert refused.status_code == 403
    assert refused.json()["message"].startswith(f"the deadline was 2026-11-01 23:59:00 {zone}: nothing")
    page = student.get(f"/c/{key}").text
    assert "The deadline was 2026-11-01 23:59:00" in page
    assert "hand-in" not in page
    assert len(list(settings.data.rglob("s09_sent*"))) == 1


def test_a_request_waits_for_the_instructor_and_is_answered(graded, admin, student, app):
    key, links = graded
    asked = {"text": "<script>alert(1)</script> please", "criterion": "v_A"}
    assert student.act("POST", f"/publications/{key}/regrading", json=asked).status_code == 201
    unknown = {"text": "x", "criterion": "v_Z"}
    assert student.act("POST", f"/publications/{key}/regrading", json=unknown).status_code == 404
    (request,) = admin.get(f"/api/v1/publications/{key}/requests").json()
    page = admin.get(f"/publications/{key}").text
    assert "<script>alert" not in page
    assert "&lt;script&gt;alert" in page
    for shown in (page, student.get(f"/c/{key}").text):
        assert "Velocity of A: &lt;script" in shown.replace("<b>", "").replace("</b>", "")
    rows = admin.get(f"/review/{key}/api/class").json()["students"]
    assert [(row["student"], row["criterion"]) for one in rows for row in one["rows"] if row["asked"]] == [
        ("s09", "v_A")
    ]
    path = f"/publications/{key}/requests/{request['id']}"
    assert admin.act("PUT", path, json={"answer": "It stays."}).status_code == 200
    (own,) = student.get(f"/api/v1/publications/{key}/regrading").json()
    assert own["answer"] == "It stays."
    other = Browser(app)
    other.get(links["s11"])
    assert other.get(f"/api/v1/publications/{key}/regrading").json() == []


def test_a_decision_in_the_review_answers_the_request(graded, admin, student, service):
    key, _ = graded
    student.act("POST", f"/publications/{key}/regrading", json={"text": "again", "criterion": "v_A"})
    rows = admin.get(f"/review/{key}/api/class").json()["students"]
    seen = next(row["seen"] for one in rows for row in one["rows"] if row["asked"])
    answer = {"student": "s09", "criterion": "v_A", "verdict": "none", "comment": "measured", "seen": seen}
    head = {"X-Planmark": "review", "Origin": str(admin.base_url)}
    said = {"window": "w", "by": "Ana", "answers": [answer]}
    answered = admin.post(f"/review/{key}/api/decide", json=said, headers=head)
    assert answered.status_code == 200, answered.text

    def told():
        with service.store.session() as session:
            return session.query(Regrading).one().answer

    assert until(told) == "wrong. measured"
    assert admin.post(f"/review/{key}/api/decide", json=said).status_code == 403


def test_sheets_are_handed_in_under_the_students_own_name(graded, admin, student, visitor, settings):
    key, _ = graded
    for _ in range(2):
        sent = student.act("POST", f"/publications/{key}/sheets", content=b"\xff\xd8\xff first")
        assert sent.status_code == 201
    assert visitor.act("POST", f"/publications/{key}/sheets", content=b"\xff\xd8\xff").status_code == 401
    assert len(list(settings.data.rglob("s09_sent*.jpg"))) == 2
    admin.act("PATCH", f"/publications/{key}", json={"takes_sheets": False})
    assert student.act("POST", f"/publications/{key}/sheets", content=b"\xff\xd8\xff").status_code == 403


def test_a_handed_in_sheet_is_a_version_that_nothing_replaces(graded, admin, student, settings):
    """Three are sent and the first is deleted: the next one is a fourth, and no name comes back."""
    key, _ = graded
    path = f"/publications/{key}/sheets"
    sent = [
        student.act("POST", f"{path}?name=план {one}.jpg", content=b"\xff\xd8\xff%d" % one)
        for one in range(3)
    ]
    first, *others = [one.json()["file"] for one in sent]
    assert admin.act("DELETE", f"/publications/{key}/files/{first}").status_code == 200
    last = student.act("POST", path, content=b"\xff\xd8\xff0")
    again = last.json()["file"]
    there = {one.name: one.read_bytes() for one in settings.data.rglob("s09_sent*")}
    assert there == {others[0]: b"\xff\xd8\xff1", others[1]: b"\xff\xd8\xff2", again: b"\xff\xd8\xff0"}
    assert again not in {first, *others}
    for name in (first, again):
        taken = admin.act("PUT", f"/publications/{key}/files/{name}?replace=true", content=b"\xff\xd8\xff9")
        assert taken.status_code == 409, name
    own = student.get(f"/api/v1{path}").json()
    assert [one["name"] for one in own] == ["план 1.jpg", "план 2.jpg", ""]
    assert [one["code"] for one in own] == [one.json()["code"] for one in (*sent[1:], last)]
    assert len({one["code"] for one in own}) == 3
    find = f"/api/v1/publications/{key}/receipts"
    typed = own[0]["code"].lower().replace("-", " ")
    found = admin.get(find, params={"code": typed}).json()
    assert (found["student_id"], found["file"]) == ("s09", others[0])
    assert own[0]["at"] in found["told"]
    # The receipt of a version that was deleted still names it.
    assert admin.get(find, params={"code": sent[0].json()["code"]}).json()["file"] == first
    assert admin.get(find, params={"code": "AAAA-AAAA"}).json()["code"] == "not_found"
    assert student.get(find, params={"code": typed}).status_code == 401
    assert own[0]["code"] in student.get(f"/c/{key}").text
    assert [one["sent"] for one in own] == sorted(one["sent"] for one in own)
    listed = {one["name"]: one for one in admin.get(f"/api/v1/publications/{key}").json()["files"]}
    assert listed[others[0]]["shown"] == "план 1.jpg"
    assert listed[others[0]]["at"] == pytest.approx(own[0]["sent"], abs=5.0)
    for page in (student.get(f"/c/{key}").text, admin.get(f"/publications/{key}").text):
        assert "план 1.jpg" in page
        assert time.strftime("%Y-%m-%d %H:%M:%S %Z", time.localtime(own[0]["sent"])) in page


def test_all_of_a_student_is_deleted_and_nothing_of_the_others(graded, admin, student, settings, app):
    key, links = graded
    student.act("POST", f"/publications/{key}/regrading", json={"text": "again", "criterion": "v_A"})
    assert admin.act("DELETE", f"/publications/{key}/students/s09").json() == {"state": "removed", "kept": []}
    top = settings.data / "publications" / key
    left = [path for path in top.rglob("*") if path.is_file()]
    assert not [path for path in left if "s09" in path.name or b"s09" in path.read_bytes()]
    assert [path for path in left if path.name == "s11.json"]
    assert student.get(f"/api/v1/publications/{key}/feedback").status_code == 401
    assert Browser(app).get(links["s09"]).status_code == 404
    assert admin.get(f"/api/v1/publications/{key}/requests").json() == []
    assert "s09" not in admin.get("/api/v1/audit").text
    other = Browser(app)
    assert other.get(links["s11"]).status_code == 200
    assert len(other.get(f"/api/v1/publications/{key}/feedback").json()) == 1
    assert admin.act("DELETE", f"/publications/{key}/students/..%2F..").status_code in {404, 422}


def test_platform_files_are_downloaded(graded, admin):
    key, _ = graded
    for platform in ("csv", "json", "canvas", "gradescope", "lti"):
        answer = admin.get(f"/api/v1/publications/{key}/exports/{platform}")
        assert answer.status_code == 200, answer.text
        assert answer.headers["content-disposition"].startswith('attachment; filename="export-')
    assert admin.get(f"/api/v1/publications/{key}/exports/nothing").status_code == 404
