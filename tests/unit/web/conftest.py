import json
import re
import shutil

import pytest
from argon2 import PasswordHasher
from starlette.testclient import TestClient

from grader.files import samples_folder
from grader.folder.batch import grade
from grader.folder.workers import Limits
from grader.web import guard, queue
from grader.web.app import application, first_invitation
from grader.web.places import batch_of
from grader.web.settings import Settings
from grader.web.store import Store
from tests.inline import Inline
from tests.waiting import until

ADDRESS = "http://127.0.0.1:8000"
PASSWORD = "four words make one"  # noqa: S105 - of a test
SAMPLES = samples_folder() / "pump"
QUICK = PasswordHasher(time_cost=1, memory_cost=8, parallelism=1)
"""Hashes take memory and time on purpose, which tests of other things need not pay."""


class Browser(TestClient):
    """A browser with cookies of its own that sends what our script sends."""

    def __init__(self, app):
        super().__init__(app, base_url=ADDRESS, raise_server_exceptions=False)
        self.portal = app.state.portal
        self._token = self._token_for = None

    def _held(self):
        return sorted((one.name, one.value) for one in self.cookies.jar)

    @property
    def token(self):
        """The token of the forms, asked for once for the cookies that are held."""
        if self._token is None or self._token_for != self._held():
            self._token = re.search(r'name="form-token" content="(\w+)"', self.get("/").text)[1]
            self._token_for = self._held()
        return self._token

    def act(self, method, path, **known):
        headers = {"X-Planmark-Form": self.token, "Origin": ADDRESS, **known.pop("headers", {})}
        return self.request(method, f"/api/v1{path}", headers=headers, **known)

    def join(self, address, name):
        token = address.partition("token=")[2]
        return self.act("POST", "/accounts/join", json={"token": token, "name": name, "password": PASSWORD})

    def sign_in(self, name, password=PASSWORD):
        return self.act("POST", "/session", json={"name": name, "password": password})

    def publish(self, **settings):
        settings = {"assignment": "pump", "is_open": True, **settings}
        return self.act("POST", "/publications", json=settings).json()["key"]

    def ended(self, path, job):
        """The job when it has ended."""

        def told():
            now = self.get(f"/api/v1{path}/{job['key']}").json()
            return None if now["state"] in {"queued", "running"} else now

        return until(told)


@pytest.fixture(scope="session")
def empty(tmp_path_factory):
    """A data base without rows."""
    path = tmp_path_factory.mktemp("empty") / "test.sqlite"
    Store(f"sqlite:///{path}").close()
    return path


@pytest.fixture
def settings(empty, tmp_path):
    shutil.copy(empty, tmp_path)
    return Settings(
        tmp_path / "data", f"sqlite:///{tmp_path / 'test.sqlite'}", "s" * 40, ADDRESS,
        limits=Limits(60.0, 3000), upload_mb=2, photo_mb=1,
    )  # fmt: skip


@pytest.fixture
def app(settings, monkeypatch):
    monkeypatch.setattr(queue, "Workers", Inline)
    monkeypatch.setattr(queue, "Judges", Inline)
    monkeypatch.setattr(guard, "_HASHER", QUICK)
    settings.data.mkdir(exist_ok=True)
    made = application(settings)
    with TestClient(made, base_url=ADDRESS) as server:
        # All browsers share the server's loop and its threads.
        made.state.portal = server.portal
        yield made


@pytest.fixture
def service(app):
    return app.state.service


@pytest.fixture
def admin(app, settings):
    browser = Browser(app)
    assert browser.join(first_invitation(settings), "Ana").status_code == 200
    return browser


@pytest.fixture
def colleague(app, admin):
    """Another instructor, who is no administrator."""
    invited = admin.act("POST", "/accounts?name=Ion").json()
    browser = Browser(app)
    assert browser.join(invited["address"], "Ion").status_code == 200
    return browser


@pytest.fixture
def visitor(app):
    return Browser(app)


def graded_here(_queue, job):
    """Grades in the test itself: a process of its own takes seconds to start."""
    grade(batch_of(_queue.settings.data, job.publication), lambda *_: None, Inline())
    return {"states": {}, "unmatched": 0}


@pytest.fixture
def grades_here(monkeypatch):
    """Lets jobs be graded in the test itself."""
    monkeypatch.setattr(queue.Queue, "_grade", graded_here)


@pytest.fixture(scope="session")
def results(tmp_path_factory):
    """A folder for the results of `graded`: graded once, for all later tests nothing has changed."""
    return tmp_path_factory.mktemp("results")


@pytest.fixture
def graded(admin, monkeypatch, results):
    """A publication with two students, who entered measurements, graded and released; and their links."""
    key = admin.publish()
    roster = b"student_id,name,n\ns09,Student 9,27\ns11,Student 11,5\n"
    assert admin.act("PUT", f"/publications/{key}/roster/files/roster.csv", content=roster).status_code == 200
    for student, n in (("s09", 27), ("s11", 5)):
        entered = {"student_id": student, "n": n, "scales": {"kL": "1:5"}, "segments_mm": {"v_A": 60}}
        admin.act("PUT", f"/publications/{key}/files/{student}.json", content=json.dumps(entered).encode())

    def graded_once(queue_, job):
        out = batch_of(queue_.settings.data, job.publication).out
        shutil.copytree(results, out, dirs_exist_ok=True)
        told = graded_here(queue_, job)
        shutil.copytree(out, results, dirs_exist_ok=True)
        return told

    with monkeypatch.context() as patched:
        patched.setattr(queue.Queue, "_grade", graded_once)
        job = admin.act("POST", f"/publications/{key}/jobs").json()
        assert admin.ended(f"/publications/{key}/jobs", job)["state"] == "done"
    admin.act("PATCH", f"/publications/{key}", json={"is_released": True, "takes_sheets": True})
    links = admin.act("POST", f"/publications/{key}/links").json()
    return key, {one["student_id"]: one["address"].removeprefix(ADDRESS) for one in links}


@pytest.fixture
def student(app, graded):
    """A student who has opened the personal link."""
    browser = Browser(app)
    assert browser.get(graded[1]["s09"]).status_code == 200
    return browser
