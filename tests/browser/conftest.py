"""A class of 30 under review in a real browser: Chromium without a window, skipped where there is none."""

import json
import os
import re
import shutil
import socket
import subprocess
import sys
import threading
from pathlib import Path
from urllib.parse import urlencode

import pytest
import uvicorn

from grader.files import samples_folder
from grader.folder.batch import Batch, grade
from grader.review.server import application
from grader.review.session import Session
from grader.solution.document import plan_document
from grader.tables.decisions import read_table
from reference.authored.assignment import Variant
from reference.plan import exact_plan
from tests.inline import Inline
from tests.unit.review.conftest import PUMP, RUBRIC

ROOT = Path(__file__).resolve().parents[2]
ENTERED = 29
"""Students with entered measurements, each with one or two entries that only a person can settle."""
SCANNED = ("s02",)
PATIENCE_MS = 240_000
"""A page is waited for as long as a busy machine may take; what is there ends the wait at once."""


def entered_class():
    """A table of right measurements, one or two of each student's illegible."""
    names, lines = [], []
    for number in range(1, ENTERED + 1):
        plan = plan_document(PUMP, exact_plan(PUMP, [Variant(n=number)]))
        drawn = {name: str(round(one.drawn_mm, 1)) for name, one in plan.vectors.items()}
        drawn["v_DC"] = "?"
        if number % 3 == 0:
            drawn["a_DC_t"] = "12 or 13"
        names = names or list(drawn)
        lines.append(",".join([f"m{number:02}", str(number), *(drawn[name] for name in names)]))
    return "\n".join([",".join(["student_id", "n", *names]), *lines]) + "\n"


@pytest.fixture(scope="session")
def class_of_30(tmp_path_factory):
    """The folder of submissions and that of results, as `planmark grade` left them."""
    top = tmp_path_factory.mktemp("class")
    folder = top / "in"
    folder.mkdir()
    (folder / "measurements.csv").write_text(entered_class(), encoding="utf-8")
    samples = samples_folder() / "pump"
    rows = (samples / "roster.csv").read_text(encoding="utf-8").splitlines()
    own = [row for row in rows[1:] if row.startswith(SCANNED)]
    entered = [f"m{number:02},Student,{number},,,,," for number in range(1, ENTERED + 1)]
    (folder / "roster.csv").write_text("\n".join([rows[0], *own, *entered]) + "\n", encoding="utf-8")
    for student in SCANNED:
        for path in samples.glob(f"{student}_*"):
            shutil.copy(path, folder)
    shutil.copy(samples / "s01_1.jpg", folder / "nobody.jpg")
    grade(Batch(PUMP, RUBRIC, folder, top / "out"), lambda *_: None, Inline())
    return top


def decisions_in(top):
    return {(row.student_id, row.criterion): row for row in read_table(top / "in" / "decisions.csv").rows}


class Server:
    """The review in a thread of the test."""

    def __init__(self, top):
        self.top = top
        self.session = Session(Batch(PUMP, RUBRIC, top / "in", top / "out"), Inline())
        self.session.bring_up_to_date(lambda *_: None)
        listener = socket.create_server(("127.0.0.1", 0))
        self.address = f"http://127.0.0.1:{listener.getsockname()[1]}/"
        config = uvicorn.Config(application(self.session), log_level="warning", lifespan="off", ws="none")
        self.uvicorn = uvicorn.Server(config)
        self.thread = threading.Thread(target=self.uvicorn.run, args=([listener],))
        self.thread.start()

    def stop(self):
        self.uvicorn.should_exit = True
        self.thread.join()

    def decisions(self):
        return decisions_in(self.top)


class Process:
    """`planmark review` in a process of its own."""

    def __init__(self, top):
        self.top, self.process, self.address = top, None, ""

    def start(self):
        environment = {**os.environ, "PYTHONPATH": str(ROOT), "OMP_NUM_THREADS": "1"}
        command = [sys.executable, "-u", "-m", "grader", "review", "out", "--port", "0", "--jobs", "1"]
        self.process = subprocess.Popen(  # noqa: S603 - our own program
            command, env=environment, stdout=subprocess.PIPE, text=True, encoding="utf-8", cwd=self.top
        )
        said = self.process.stdout.readline()
        self.address = re.search(r"http://\S+", said)[0]

    def kill(self):
        """As by a power cut: nothing is told, nothing is finished."""
        self.process.kill()
        self.process.wait()
        self.process.stdout.close()

    def decisions(self):
        return decisions_in(self.top)


@pytest.fixture
def own_class(class_of_30, tmp_path):
    """The class, each test with a copy of its own."""
    top = tmp_path / "class"
    shutil.copytree(class_of_30, top)
    note = top / "out" / ".planmark" / "run.json"
    said = {**json.loads(note.read_text(encoding="utf-8")), "folder": str(top / "in")}
    note.write_text(json.dumps(said), encoding="utf-8")
    return top


@pytest.fixture
def server(own_class):
    running = Server(own_class)
    yield running
    running.stop()


@pytest.fixture
def process(own_class):
    running = Process(own_class)
    running.start()
    yield running
    running.kill()


@pytest.fixture(scope="session")
def chromium():
    """The system's Chromium."""
    path = shutil.which("chromium") or shutil.which("chromium-browser")
    if path is None:
        pytest.skip("there is no Chromium")
    api = pytest.importorskip("playwright.sync_api")
    with api.sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=path, args=["--no-sandbox"])
        yield browser
        browser.close()


class Window:
    """A window of the browser with the review's page in it."""

    def __init__(self, page, address):
        self.page, self.keys, self.screens = page, 0, set()
        self.faults = []
        page.on("pageerror", lambda error: self.faults.append(str(error)))
        page.set_default_timeout(PATIENCE_MS)
        page.goto(address)
        self.ready()

    def ready(self):
        """Wait until a question is there to be answered, or there is none."""
        self.page.wait_for_function(
            "() => (document.body.dataset.shown || !document.getElementById('done').hidden)"
            " && !document.body.dataset.busy"
            " && (document.body.dataset.ready || document.getElementById('question').hidden)"
        )
        self.screens.add(self.shown)

    @property
    def shown(self):
        return self.page.evaluate("(document.body.dataset.shown || '').split(' ')[0]")

    @property
    def open(self):
        return int(self.page.get_attribute("#progress", "data-open"))

    @property
    def is_done(self):
        return self.page.is_visible("#done")

    def press(self, key):
        """Press a key, and wait for what comes of it."""
        before = self.page.evaluate("document.body.dataset.shown")
        self.page.keyboard.press(key)
        self.keys += 1
        self.page.wait_for_function(
            "before => !document.body.dataset.busy && (document.body.dataset.shown !== before"
            " || !document.getElementById('done').hidden)",
            arg=before,
        )
        self.ready()


@pytest.fixture
def open_window(chromium):
    """Opens windows on a server: each of a person's own, of a size in pixels."""
    contexts, windows = [], []

    def opened(server, width=1280, height=800, student="", part="", criterion="", **settings):
        context = chromium.new_context(viewport={"width": width, "height": height}, **settings)
        contexts.append(context)
        asked = {"student": student, "part": part, "criterion": criterion}
        query = urlencode({name: value for name, value in asked.items() if value})
        windows.append(Window(context.new_page(), f"{server.address}?{query}"))
        return windows[-1]

    yield opened
    faults = [fault for window in windows for fault in window.faults]
    for context in contexts:
        context.close()
    assert not faults
