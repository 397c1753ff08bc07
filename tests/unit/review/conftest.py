import json
import shutil

import pytest
from starlette.testclient import TestClient

from grader.files import samples_folder
from grader.folder.batch import Batch
from grader.owners import title_block
from grader.review.server import application
from grader.review.session import Session
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment
from tests.inline import Inline

PUMP = load_assignment("pump")
AS_MARKED = load_rubric("pump")
DOUBT = AS_MARKED.doubt.model_copy(update={"settle": 0.9999, "stake": 0.0})
RUBRIC = AS_MARKED.model_copy(update={"doubt": DOUBT})
"""So strict that a scanned student has open questions."""
WINDOW = "window-1"


def silent(*_progress):
    """Nobody watches."""


@pytest.fixture(scope="session")
def scanned(tmp_path_factory):
    """A class that was graded: a student's two scans, entered measurements, a page that is nobody's."""
    folder = tmp_path_factory.mktemp("scanned") / "in"
    folder.mkdir()
    samples = samples_folder() / "pump"
    for name in ("s02_1.jpg", "s02_2.jpg"):
        shutil.copy(samples / name, folder)
    shutil.copy(samples / "s07_1.jpg", folder / "stranger.jpg")
    entered = {
        "student_id": "s09",
        "n": 27,
        "scales": {"kL": "1:5"},
        "segments_mm": {"v_A": 60.0, "v_B": 61.5},
    }
    (folder / "s09.json").write_text(json.dumps(entered), encoding="utf-8")
    roster = (
        "student_id,name,n,kv,ka\ns02,Student 2,12,0.219911 (m/s)/mm,9.67221 (m/s^2)/mm\ns09,Student 9,27,,\n"
    )
    (folder / "roster.csv").write_text(roster, encoding="utf-8")
    out = folder.parent / "out"
    Session(Batch(PUMP, RUBRIC, folder, out), Inline()).bring_up_to_date(silent)
    return folder.parent


READ = {}
"""Writing that was read, by page: each run reads it anew on pages of nobody, in half of a test's time."""


@pytest.fixture(autouse=True)
def writing_read_once(monkeypatch):
    read = title_block.writing_on

    def known(page, *, closely):
        ref = page.ref
        key = (ref.digest, ref.page, ref.turn_deg, ref.corners_px, closely)
        if key not in READ:
            READ[key] = read(page, closely=closely)
        return READ[key]

    monkeypatch.setattr(title_block, "writing_on", known)


@pytest.fixture
def session(scanned, tmp_path):
    """The class under review, each test with a copy of its own."""
    shutil.copytree(scanned, tmp_path / "class")
    batch = Batch(PUMP, RUBRIC, tmp_path / "class" / "in", tmp_path / "class" / "out")
    opened = Session(batch, Inline())
    opened.bring_up_to_date(silent)
    return opened


class Page(TestClient):
    """The page as the script uses it."""

    def said(self, path, **said):
        headers = {"X-Planmark": "review", "Origin": str(self.base_url)}
        return self.post(path, json={"window": WINDOW, "by": "Ana", **said}, headers=headers)

    def rows(self):
        students = self.get("/api/class").json()["students"]
        return {(row["student"], row["criterion"]): row for one in students for row in one["rows"]}

    def answer(self, student, criterion, verdict, **said):
        row = self.rows()[student, criterion]
        one = {"student": student, "criterion": criterion, "verdict": verdict, "seen": row["seen"], **said}
        return self.said("/api/decide", answers=[one])


@pytest.fixture
def page(session):
    return Page(application(session), base_url="http://127.0.0.1:8321")
