"""One student, or one class, does not stop the others: budgets of pages and seconds, and turns."""

import io
import time
from dataclasses import replace
from types import SimpleNamespace

import pytest
from reportlab.pdfgen.canvas import Canvas

from grader.web import queue
from grader.web.queue import Queue, Turns, _TurnOverError
from grader.web.store import Job, Publication, Store
from tests.inline import Inline
from tests.unit.web.conftest import Browser
from tests.waiting import until


def pdf(pages):
    content = io.BytesIO()
    canvas = Canvas(content)
    for _ in range(pages):
        canvas.showPage()
    canvas.save()
    return content.getvalue()


@pytest.fixture
def settings(settings):
    return replace(settings, student_pages=6, class_pages=8, upload_pages=12, photo_pages=3)


def sent(browser, key, pages):
    answer = browser.act("POST", f"/publications/{key}/sheets", content=pdf(pages))
    return answer.status_code, answer.json().get("message", "")


def test_pages_that_a_student_may_hand_in_are_counted_and_told_at_once(graded, admin, student, app, settings):
    key, links = graded
    status, message = sent(student, key, 7)
    assert (status, "7 in this file, and 6 may" in message) == (403, True)
    assert sent(student, key, 4)[0] == 201
    assert "and 2 may" in sent(student, key, 3)[1]
    assert sent(student, key, 2)[0] == 201
    other = Browser(app)
    other.get(links["s11"])
    assert "and 2 may" in sent(other, key, 3)[1], "the class has eight"
    assert sent(other, key, 2)[0] == 201
    first = student.get(f"/api/v1/publications/{key}/sheets").json()[0]["file"]
    assert admin.act("DELETE", f"/publications/{key}/files/{first}").status_code == 200
    assert sent(student, key, 4)[0] == 201
    assert not list(settings.data.rglob("photos/*"))


def test_a_file_that_cannot_be_counted_is_told_to_its_sender(graded, student, settings):
    key, _ = graded
    answer = student.act("POST", f"/publications/{key}/sheets", content=b"%PDF-1.4 and nothing else")
    assert answer.status_code == 422
    assert "cut off" in answer.json()["message"]
    answer = student.act("POST", f"/publications/{key}/sheets?lang=ro", content=b"%PDF-1.4 and nothing else")
    message = "PDF-ul este deteriorat: este trunchiat; exportați-l sau încărcați-l din nou."
    assert answer.json() == {"code": "pdf_damaged", "message": message}
    assert not list(settings.data.rglob("s09_sent*"))
    assert not list(settings.data.rglob("photos/*"))


def test_a_photo_is_no_book(graded, student, settings):
    key, _ = graded
    path = f"/publications/{key}/photos?n=27"
    answer = student.act("POST", path, content=pdf(4))
    assert (answer.status_code, answer.json()["code"]) == (413, "pages")
    assert not list(settings.data.rglob("photos/*"))


def uploaded(browser, key, name, pages, how=""):
    answer = browser.act("PUT", f"/publications/{key}/files/{name}{how}", content=pdf(pages))
    return answer.status_code, answer.json().get("message", "")


def test_pages_that_instructors_upload_are_counted_and_told_at_once(admin, graded, student, settings):
    key, _ = graded  # with two files of measurements
    assert uploaded(admin, key, "class.pdf", 6) == (200, "")
    assert sent(student, key, 3)[0] == 201
    status, message = uploaded(admin, key, "more.pdf", 2)
    assert (status, "2 in this file, and 1 may" in message) == (403, True)
    assert "and 1 may" in sent(student, key, 2)[1]
    assert uploaded(admin, key, "class.pdf", 7, "?replace=true") == (200, "")
    assert uploaded(admin, key, "one.pdf", 1)[0] == 403
    assert admin.act("DELETE", f"/publications/{key}/files/class.pdf").status_code == 200
    assert uploaded(admin, key, "one.pdf", 1) == (200, "")
    broken = admin.act("PUT", f"/publications/{key}/files/broken.pdf", content=b"%PDF-1.4 and nothing else")
    assert (broken.status_code, "cut off" in broken.json()["message"]) == (422, True)
    assert not list(settings.data.rglob("photos/*"))
    assert not list(settings.data.rglob("broken.pdf"))


def test_seconds_of_counting_pages_are_the_senders_own(admin, colleague, graded, service):
    key, _ = graded
    number = next(one["id"] for one in admin.get("/api/v1/accounts").json() if one["name"] == "Ion")
    assert admin.act("PUT", f"/publications/{key}/members/{number}").status_code == 200
    assert uploaded(admin, key, "first.pdf", 1) == (200, "")
    with service.store.session() as session:
        job = session.query(Job).filter_by(kind="count").one()
        job.started -= service.settings.sender_seconds + 1.0
    status, message = uploaded(admin, key, "second.pdf", 1)
    assert (status, "in an hour" in message) == (429, True)
    assert uploaded(colleague, key, "second.pdf", 1) == (200, "")


def checked_for(service, key, sender, seconds):
    now = time.time()
    with service.store.session() as session:
        own = session.query(Publication).filter_by(key=key).one()
        times = {"started": now - seconds, "ended": now}
        session.add(Job(publication_id=own.id, kind="photo", state="done", sender=sender, **times))


def test_seconds_of_photos_are_a_students_own_and_the_strangers_share_theirs(graded, student, app, service):
    key, links = graded
    path = f"/publications/{key}/photos?n=27"
    other, stranger = Browser(app), Browser(app)
    other.get(links["s11"])

    def status(browser):
        return browser.act("POST", path, content=b"\xff\xd8\xff").status_code

    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(type(service.queue), "put", lambda *_: None)
        checked_for(service, key, "student:s09", 301.0)
        student.get(links["s09"])  # a new visit is the same student
        assert [status(one) for one in (student, other, stranger)] == [429, 202, 202]
        for number in range(13):
            checked_for(service, key, f"visit:{number}", 290.0)
        assert [status(one) for one in (other, stranger)] == [202, 429]


def job(number, publication):
    return SimpleNamespace(id=number, publication_id=publication)


def test_classes_take_turns():
    turns = Turns()
    jobs = [job(1, 7), job(2, 7), job(3, 7), job(4, 8), job(5, 9), job(6, 8)]
    for one in jobs:
        turns.put(one)
    assert [turns.before(one) for one in jobs] == [0, 3, 5, 1, 2, 4]
    assert [turns.get() for _ in jobs] == [1, 4, 5, 2, 6, 3]
    assert turns.is_empty()
    turns.end()
    assert turns.get() is None


@pytest.fixture
def store(settings):
    settings.data.mkdir(exist_ok=True)
    made = Store(settings.database)
    with made.session() as session:
        for number in (1, 2):
            session.add(Publication(id=number, key=f"publication{number}", assignment="pump"))
            session.flush()
            session.add(Job(id=number, publication_id=number, kind="grade"))
    yield made
    made.close()


def test_a_class_that_is_graded_for_long_lets_another_go_first(settings, store, monkeypatch):
    ran = []

    def graded(_jobs, one):
        ran.append(one.id)
        if one.id == 1 and ran.count(1) == 1:
            raise _TurnOverError
        return {}

    monkeypatch.setattr(queue, "Workers", Inline)
    monkeypatch.setattr(queue, "Judges", Inline)
    monkeypatch.setattr(Queue, "_grade", graded)
    jobs = Queue(settings, store, lambda *_: {})
    jobs.start()
    try:

        def are_done():
            with store.session() as session:
                return [one.state for one in session.query(Job)] == ["done", "done"]

        until(are_done)
    finally:
        jobs.stop()
    assert ran == [1, 2, 1]


def test_a_turn_ends_only_where_another_class_waits_and_is_longer_the_next_time(settings, store, monkeypatch):
    said = [("progress", "marking", 1, 9)] * 3 + [("done", {})]
    clock = iter(range(0, 10_000, 200))
    monkeypatch.setattr(queue, "time", SimpleNamespace(monotonic=lambda: next(clock), time=time.time))
    jobs = Queue(settings, store, lambda *_: {})
    with store.session() as session:
        first, second = session.query(Job).order_by(Job.id)
        first.state = "running"

    def followed():
        return jobs._followed(first, SimpleNamespace(recv=iter(said).__next__))

    assert followed() == {}
    jobs.put(second)
    with pytest.raises(_TurnOverError):
        followed()
    jobs._turns[first.id] = 100
    assert followed() == {}
