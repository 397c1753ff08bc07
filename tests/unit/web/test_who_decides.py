"""The person signed in decides, whatever a request says; every change of a mark is in the audit trail."""

import json

import pytest

from grader.folder.batch import grade
from grader.web.places import batch_of
from grader.web.queue import _graded
from grader.web.store import Audit, Job, Publication
from tests.inline import Inline
from tests.waiting import until


@pytest.fixture
def two(graded, admin, colleague):
    """A graded class of Ana and Ion."""
    key, _ = graded
    number = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Ion")
    assert admin.act("PUT", f"/publications/{key}/members/{number}").status_code == 200
    assert colleague.get(f"/api/v1/publications/{key}").status_code == 200
    return key


def said(browser, key, path, **body):
    head = {"X-Planmark": "review", "Origin": str(browser.base_url)}
    return browser.post(f"/review/{key}/api/{path}", json={"window": "w", **body}, headers=head)


def verdict(browser, key, verdict, **body):
    rows = browser.get(f"/review/{key}/api/class").json()["students"]
    (row,) = (
        row for one in rows for row in one["rows"] if (row["student"], row["criterion"]) == ("s09", "v_A")
    )
    answer = {"student": "s09", "criterion": "v_A", "verdict": verdict, "seen": row["seen"]}
    return said(browser, key, "decide", answers=[answer], **body)


def changes(admin, key):
    return [
        (one["who"], one["about"].removeprefix(f"{key} "), one["before"], one["after"])
        for one in reversed(admin.get("/api/v1/audit").json())
        if one["act"] == "mark changed" and " v_" in one["about"]
    ]


def decided_by(settings):
    (path,) = settings.data.rglob("decisions.csv")
    lines = path.read_text(encoding="utf-8").splitlines()[1:]
    return [line.split(",")[6] for line in lines]


def test_the_account_decides_whatever_the_request_says(two, admin, colleague, settings):
    assert verdict(colleague, two, "none", by="Ana").status_code == 200
    assert decided_by(settings) == ["Ion"]
    assert verdict(admin, two, "partial", by="Ion").status_code == 200
    assert decided_by(settings) == ["Ana"]
    whole = {"student": "s09", "comment": "see me", "added": 2.5, "by": "Ion"}
    assert said(admin, two, "whole", **whole).status_code == 200
    assert set(decided_by(settings)) == {"Ana"}


def test_every_change_of_a_mark_is_in_the_audit_trail(two, admin, colleague):
    verdict(colleague, two, "none")
    verdict(admin, two, "partial")
    said(admin, two, "undo")
    first, second, third = changes(admin, two)
    assert first[:2] == ("Ion", "s09 v_A")
    assert first[2] not in {"", "none"}
    assert first[3] == "none"
    assert second == ("Ana", "s09 v_A", "none", "partial")
    assert third == ("Ana", "s09 v_A", "partial", "none")
    assert "Mark before" in admin.get("/account").text


@pytest.mark.usefixtures("grades_here")
def test_the_end_of_the_review_leads_to_the_class_with_the_marks_as_decided(two, admin, settings):
    illegible = b"student_id,n,kL,v_A,v_DC\ns11,5,1:5,60,12 or 13\n"
    assert admin.act("PUT", f"/publications/{two}/files/m.csv", content=illegible).status_code == 200
    admin.act("DELETE", f"/publications/{two}/files/s11.json")
    job = admin.act("POST", f"/publications/{two}/jobs").json()
    assert admin.ended(f"/publications/{two}/jobs", job)["state"] == "done"

    def standing():
        now = admin.get(f"/api/v1/publications/{two}").json()["standing"]
        assert now.pop("titles")["v_A"] == "Velocity of A"
        return now

    was = {"states": {"graded": 1, "needs_review": 1}, "unmatched": 0, "waiting": 1, "open": 2}
    assert standing() == {**was, "is_behind": False}
    shown = admin.get(f"/publications/{two}/results/index.html").text
    assert f'href="/review/{two}/"' in shown
    assert f'href="/publications/{two}#export"' in shown
    assert "planmark review" not in shown
    assert str(settings.data) not in shown
    rows = [row for one in admin.get(f"/review/{two}/api/class").json()["students"] for row in one["rows"]]
    answers = [
        {"student": row["student"], "criterion": row["criterion"], "verdict": "none"}
        for row in rows
        if row["verdict"] == "review"
    ]
    assert said(admin, two, "decide", answers=answers).status_code == 200
    assert standing() == {**was, "is_behind": True}
    assert "grade what is new" in admin.get(f"/publications/{two}").text
    said(admin, two, "finish")

    def ended():
        run = admin.get(f"/review/{two}/api/finish").json()
        return None if run["running"] else run

    assert until(ended)["to"] == f"/publications/{two}#marks"
    after = {"states": {"graded": 2}, "unmatched": 0, "waiting": 0, "open": 0, "is_behind": False}
    assert standing() == after


def test_nobody_takes_back_what_another_decided(two, admin, colleague, settings):
    verdict(colleague, two, "none")
    assert said(admin, two, "undo", by="Ion").json()["undone"] == ""
    assert decided_by(settings) == ["Ion"]


def test_marks_that_a_run_changes_are_noted_with_who_asked_for_it(two, admin, settings, service):
    entered = {"student_id": "s09", "n": 27, "scales": {"kL": "1:5"}, "segments_mm": {"v_A": 6}}
    path = f"/publications/{two}/files/s09.json?replace=true"
    assert admin.act("PUT", path, content=json.dumps(entered).encode()).status_code == 200
    told = []

    class Pipe:
        send = told.append

        @staticmethod
        def recv():
            return told.pop(0)

    with service.store.session() as session:
        own = session.query(Publication).filter_by(key=two).one()
        job = Job(publication=own, kind="grade", asked={"by": "Ion"})
        session.add(job)
    batch = batch_of(settings.data, own)
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr("grader.web.queue.grade", lambda batch, tell: grade(batch, tell, Inline()))
        _graded(batch, Pipe)
    service.queue._followed(job, Pipe)
    with service.store.session() as session:
        (entry,) = (one for one in session.query(Audit).filter_by(act="mark changed") if one.who == "Ion")
    assert entry.about == f"{two} s09"
    assert float(entry.before) > float(entry.after)


def test_who_asks_for_a_run_is_kept_with_it(two, colleague, service):
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(type(service.queue), "put", lambda *_: None)
        colleague.act("POST", f"/publications/{two}/jobs")
    with service.store.session() as session:
        assert session.query(Job).order_by(Job.id.desc()).first().asked == {"by": "Ion"}
