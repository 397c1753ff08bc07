"""Jobs: they survive the end of the server, are cancelled, and fail with words."""

import os
import signal
import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from starlette.testclient import TestClient

from grader.records import Reason
from grader.web.app import application
from grader.web.queue import Judges, Queue
from grader.web.store import Job, Publication, Store
from reference.errors import CallError, InputFileError
from tests.inline import Inline
from tests.unit.web.conftest import ADDRESS
from tests.waiting import until


@pytest.fixture
def store(settings):
    settings.data.mkdir()
    made = Store(settings.database)
    with made.session() as session:
        session.add(Publication(id=1, key="publication1", assignment="pump"))
    yield made
    made.close()


def photo_job(store, settings, state="queued"):
    folder = settings.data / "publications" / "publication1" / "photos"
    folder.mkdir(parents=True, exist_ok=True)
    (folder / "a.jpg").write_bytes(b"photo")
    with store.session() as session:
        session.add(Job(id=1, publication_id=1, kind="photo", state=state, asked={"file": "a.jpg"}))
    return folder / "a.jpg"


def ended(store):
    def told():
        with store.session() as session:
            job = session.get_one(Job, 1)
        return None if job.state in {"queued", "running"} else job

    return until(told)


@pytest.fixture(autouse=True)
def inline(monkeypatch):
    for name in ("web.queue.Workers", "web.queue.Judges", "folder.batch.Workers"):
        monkeypatch.setattr(f"grader.{name}", Inline)


@pytest.mark.parametrize("state", ["queued", "running"])
def test_what_an_earlier_server_left_begins_again(store, settings, state):
    path = photo_job(store, settings, state)
    jobs = Queue(settings, store, lambda file, _asked: {"bytes": file.stat().st_size})
    jobs.start()
    try:
        job = ended(store)
    finally:
        jobs.stop()
    assert (job.state, job.result) == ("done", {"bytes": 5})
    assert not path.exists()


def test_a_photo_that_cannot_be_used_is_told(store, settings):
    def refused(_path, _asked):
        raise InputFileError("too_dark", "the photo is too dark: take it in the light")

    photo_job(store, settings)
    jobs = Queue(settings, store, refused)
    jobs.start()
    try:
        job = ended(store)
    finally:
        jobs.stop()
    assert (job.state, job.message) == ("failed", "the photo is too dark: take it in the light")


def test_a_cancelled_job_is_never_run(store, settings):
    photo_job(store, settings)
    jobs = Queue(settings, store, lambda *_: {})
    jobs.cancel(1)
    jobs.start()
    jobs.stop()
    with store.session() as session:
        assert session.get_one(Job, 1).state == "cancelled"


def test_a_class_with_nothing_in_it_fails_with_words(admin, settings):
    key = admin.publish()
    job = admin.ended(f"/publications/{key}/jobs", admin.act("POST", f"/publications/{key}/jobs").json())
    assert job["state"] == "failed"
    assert "nothing to grade" in job["message"]
    assert str(settings.data) not in str(job)


def test_two_requests_to_grade_are_one_job(graded, admin, monkeypatch):
    key, _ = graded
    monkeypatch.setattr(Queue, "put", lambda *_: None)
    one = admin.act("POST", f"/publications/{key}/jobs").json()
    two = admin.act("POST", f"/publications/{key}/jobs").json()
    assert one["key"] == two["key"]
    refused = admin.act("DELETE", f"/publications/{key}")
    assert (refused.status_code, refused.json()["code"]) == (409, "job_runs")
    assert admin.get(f"/review/{key}/").status_code == 409
    assert admin.act("DELETE", f"/publications/{key}/jobs/{one['key']}").status_code == 200
    assert admin.get(f"/api/v1/publications/{key}/jobs/{one['key']}").json()["state"] == "cancelled"


@pytest.mark.slow
def test_a_class_goes_on_with_the_next_server(graded, settings, service):
    key, _ = graded
    with service.store.session() as session:
        own = session.query(Publication).filter_by(key=key).one()
        session.add(Job(key="left-behind", publication_id=own.id, kind="grade", state="running"))
    with TestClient(application(settings), base_url=ADDRESS) as again:

        def is_done():
            with service.store.session() as session:
                return session.query(Job).filter_by(key="left-behind").one().state == "done"

        until(is_done)
        assert again.get("/").status_code == 200


def test_a_data_base_that_cannot_be_opened_is_told():
    for url in ("nonsense", "sqlite://", "sqlite:////nowhere/at/all.sqlite", "mysql://x/y"):
        with pytest.raises(CallError, match="--database"):
            Store(url)


def hangs_at_first(path):
    """Nothing, unless it is the first call: that one writes its process's number, and waits to be killed."""
    if not path.exists():
        path.with_suffix(".part").write_text(str(os.getpid()))
        path.with_suffix(".part").rename(path)
        time.sleep(600.0)


def kills_its_process():
    os.kill(os.getpid(), signal.SIGKILL)


@pytest.fixture
def judges():
    made = Judges(1)
    yield made
    made.end()


@pytest.mark.slow
def test_a_pool_whose_process_was_killed_is_made_anew(judges):
    ((_, first),) = judges.run(os.getpid, [()])
    os.kill(first, signal.SIGKILL)
    (_, second), (_, third) = judges.run(os.getpid, [(), ()])
    assert len({os.getpid(), first, second}) == 3
    assert second == third
    assert isinstance(next(judges.run(int, [("x",)]))[1], Reason)


@pytest.mark.slow
def test_what_waits_in_a_pool_that_breaks_goes_on_in_the_new_one(judges, tmp_path):
    path = tmp_path / "first"
    with ThreadPoolExecutor() as asking:
        waiting = [asking.submit(list, judges.run(hangs_at_first, [(path,)])) for _ in range(3)]
        while not path.exists():
            time.sleep(0.01)
        os.kill(int(path.read_text()), signal.SIGKILL)
        assert [one.result() for one in waiting] == [[(0, None)]] * 3


@pytest.mark.slow
def test_a_call_that_kills_every_process_is_told_and_harms_no_other(judges):
    ((_, told),) = judges.run(kills_its_process, [()])
    assert told == Reason("crashed", {"why": "killed"})
    assert list(judges.run(int, [("7",)])) == [(0, 7)]
