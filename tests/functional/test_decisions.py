"""A class of scans that waits for a person: decided in every kind, graded again, and changed in every way."""

import csv
import json
import shutil
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.folder.batch import Batch, graded
from grader.folder.decisions import basis_of, page_basis
from grader.records import PageRef
from grader.rubric import rubric_of
from grader.scan.page import open_page
from grader.scan.pixels import mapped
from grader.scan.register.homography import PAPER
from grader.tables.decision_texts import PageDecision, place_text
from grader.tables.decisions import Decision, DecisionFile
from reference.authored.assignment import library, load_assignment
from tests.inline import Inline

SAMPLES = Path(__file__).resolve().parents[2] / "samples" / "pump"
ROSTER = """student_id,name,n,kL,kv,ka
s01,Student 1,7,0.005 m/mm,0.193732 (m/s)/mm,7.50638 (m/s^2)/mm
s07,Student 7,15,0.005 m/mm,0.235619 (m/s)/mm,11.1033 (m/s^2)/mm
s08,Student 8,21,,,
s09,Student 9,27,,,
"""
REFUSED = "IMG_0042.png"
CALL = ("grade", "in", "--assignment", "pump.assignment.toml", "--out", "out", "--jobs", 2)
pytestmark = pytest.mark.slow


def without_frame(path, to):
    """A photo whose sheet shows neither frame nor title block, upside down; returns the sheet's corners."""
    page = open_page(PageRef(path.name, path=path))
    grey = cv2.imread(str(path), cv2.IMREAD_GRAYSCALE)
    corners = mapped(page.sheet.mm_to_px, PAPER.corners())
    drawn = mapped(
        page.sheet.mm_to_px, np.array([[27.0, 17.0], [402.0, 17.0], [402.0, 215.0], [27.0, 215.0]])
    )
    inside = cv2.fillConvexPoly(np.zeros_like(grey), np.rint(drawn).astype(np.int32), 255)
    bare = np.where(inside > 0, grey, 235)
    margin = 200
    turned = cv2.rotate(
        cv2.copyMakeBorder(bare, *[margin] * 4, cv2.BORDER_CONSTANT, value=235), cv2.ROTATE_180
    )
    cv2.imwrite(str(to), turned)
    height, width = turned.shape
    return [(width - 1 - x - margin, height - 1 - y - margin) for x, y in corners]


class Class:
    """The class, and what its results say."""

    def __init__(self, path, planmark):
        self.path, self.planmark = path, planmark
        self.folder, self.file = path / "in", DecisionFile(path / "in" / "decisions.csv")

    def grade(self, *more):
        ran = self.planmark(*CALL, *more)
        assert ran.returncode in {0, 1}, ran.stderr
        self.results = json.loads((self.path / "out" / "results.json").read_text("utf-8"))
        self.status, self.told = ran.returncode, ran.stdout
        return self

    def report(self, student):
        return next(one for one in self.results["reports"] if one["student_id"] == student)

    def criterion(self, student, name):
        return next(one for one in self.report(student)["criteria"] if one["id"] == name)

    def waiting(self, student):
        return [one["id"] for one in self.report(student)["criteria"] if one["verdict"] == "review"]

    def node(self, student, figure, name):
        for sheet in self.report(student)["reading"]["sheets"]:
            if figure in sheet["figures"]:
                node = sheet["figures"][figure]["nodes"][name]
                return np.array([node["x_mm"], node["y_mm"]]), node["confidence"]
        return None

    def decide(self, *rows):
        """Write rows as the review page does, each with its basis."""
        assignment = load_assignment(self.path / "pump.assignment.toml")
        batch = Batch(assignment, rubric_of(assignment), self.folder, self.path / "out")
        run = graded(batch, lambda *_: None, Inline())
        pages = {f"page:{page.file}#{page.page}": page for page in run.pages}
        submissions = {job.submission.student_id: job.submission for job in run.jobs}
        for row in rows:
            basis = (
                page_basis(pages[row.criterion])
                if row.kind == "page"
                else basis_of(submissions[row.student_id], assignment, batch.rubric, row.criterion)
            )
            self.file.add(replace(row, by="S. Popa", at="2026-11-22T18:00:00+02:00", basis=basis))


@pytest.fixture
def the_class(tmp_path, planmark):
    folder = tmp_path / "in"
    folder.mkdir()
    for name in ("s01_1.jpg", "s01_2.jpg", "s07_2.jpg", "s08.json"):
        shutil.copy(SAMPLES / name, folder)
    (folder / "roster.csv").write_text(ROSTER, encoding="utf-8")
    for kind in ("assignment", "mechanism", "rubric"):
        shutil.copy(library() / f"pump.{kind}.toml", tmp_path)
    return Class(tmp_path, planmark)


def all_stand(found):
    """Return whether every decision of the test is applied."""
    page = found.report("s07")["reading"]["sheets"]
    return (
        found.results["stale"] == []
        and found.waiting("s01") == []
        and found.criterion("s01", "a_D")["verdict"] == "none"
        and found.criterion("s01", "v_C")["decided"]["before"] is None
        and [sheet["source"] for sheet in page] == [REFUSED, "s07_2.jpg"]
        and page[0]["sheet"]["method"] == "corners"
        and found.report("s08")["added"] == -1.0
        and found.report("s09")["comment"] == "Ill."
    )


def test_decisions_of_every_kind_survive_all_but_what_they_are_about(the_class):
    corners = without_frame(SAMPLES / "s07_1.jpg", the_class.folder / REFUSED)
    before = the_class.grade()
    assert before.status == 1
    assert [page["file"] for page in before.results["unmatched"]] == [REFUSED]
    read, _ = before.node("s01", "velocity_plan", "c")
    verdict = before.criterion("s01", "a_D")["verdict"]

    x, y = read
    the_class.decide(
        *(Decision("s01", None, name, "full") for name in before.waiting("s01")),
        Decision("s01", None, "a_D", "none", comment="not the driven point"),
        Decision("s01", None, "node:velocity_plan:c", place_text(x + 0.6, y - 0.5)),
        Decision("", None, f"page:{REFUSED}#1", str(PageDecision("s07", corners=tuple(corners)))),
        Decision("s08", None, "total", "", -1.0, "late"),
        Decision("s09", None, "comment", "", comment="Ill."),
    )
    after = the_class.grade()
    assert all_stand(after)
    decided = after.criterion("s01", "a_D")
    assert decided["decided"]["before"] == verdict
    assert (decided["decided"]["by"], decided["decided"]["comment"]) == ("S. Popa", "not the driven point")
    assert after.report("s01")["status"] == "graded"
    place, confidence = after.node("s01", "velocity_plan", "c")
    assert np.abs(place - read).max() < 0.4
    assert confidence == 1.0
    assert {"mechanism", "velocity_plan"} <= set(after.report("s07")["reading"]["sheets"][0]["figures"])
    assert after.criterion("s07", "v_A")["verdict"] == "full"
    moved = {one["student_id"]: one["why"] for one in after.results["moved"]}
    assert moved["s01"] == ["decision"]
    assert moved["s07"] == ["decision"]

    again = the_class.grade()
    assert all_stand(again)
    assert again.results["moved"] == []

    assert the_class.planmark("export", "out", "--to", "csv", "--file", "grades.csv").returncode in {0, 1}
    with (the_class.path / "grades.csv").open(encoding="utf-8-sig", newline="") as file:
        exported = {(row["student_id"], row["criterion"]): row for row in csv.DictReader(file)}
    assert (exported["s01", "a_D"]["verdict"], exported["s01", "a_D"]["points"]) == ("none", "0")

    maximum = after.report("s01")["max_score"]
    roster = the_class.folder / "roster.csv"
    roster.write_text(ROSTER.replace("Student 1", "Another name"), encoding="utf-8")
    rubric = the_class.path / "pump.rubric.toml"
    text = rubric.read_text(encoding="utf-8")
    rubric.write_text(
        text.replace("points = 3", "points = 4").replace('en = "', 'en = "The '), encoding="utf-8"
    )
    changed = the_class.grade()
    assert all_stand(changed)
    assert changed.report("s01")["max_score"] > maximum

    shutil.rmtree(the_class.path / "out")
    assert all_stand(the_class.grade())

    scan = the_class.folder / "s01_1.jpg"
    cv2.imwrite(str(scan), cv2.imread(str(scan), cv2.IMREAD_GRAYSCALE), [cv2.IMWRITE_JPEG_QUALITY, 70])
    rows = the_class.file.all()
    stale = the_class.grade()
    assert stale.status == 1
    assert {one["student_id"] for one in stale.results["stale"]} == {"s01"}
    assert "out of date" in stale.told
    assert stale.criterion("s01", "a_D")["decided"] is None
    assert stale.report("s08")["added"] == -1.0
    assert the_class.file.all() == rows
