import json

import cv2
import numpy as np
import pytest

from grader import batch as batch_module
from grader import kept as kept_module
from grader.batch import Batch, grade
from grader.kept import keep_looked, kept_looked, packed, unpacked
from grader.moved import told_standing
from grader.picture import backdrop
from grader.pipeline import Looked, Place, Seen, Work, documents_of
from grader.plan_document import plan_document
from grader.records import Figure, Page, Problem, Reading, ReadNode, ReadVector, Unread
from grader.rubric import load_rubric
from reference.assignment import Variant, load_assignment
from reference.plan import exact_plan

PUMP = load_assignment("pump")
RUBRIC = load_rubric("pump-velocity")
SCALES = "1:5,kv = omega kL"


def drawn_exactly(n, off_mm=0.0):
    """What is read of a velocity plan without fault, but for one vector."""
    plan = plan_document(PUMP, exact_plan(PUMP, [Variant(n=n)]))
    vectors = {
        name: ReadVector(
            one.drawn_mm + (off_mm if name == "v_D" else 0.0), 0.05, one.direction_deg, 0.05, 0.99
        )
        for name, one in plan.vectors.items()
        if name.startswith("v")
    }
    nodes = {"o": ReadNode(100.0 - 80.0j, 0.01 * np.eye(2), 0.99)}
    return Reading({"velocity_plan": Figure(nodes, vectors)}, (Unread("v_CB", "hidden"),))


class Reader:
    """Stands for reading scans, and knows whose it has read."""

    def __init__(self):
        self.read = []

    def __call__(self, work, _assignment, _rubric):
        self.read.append(work.student_id)
        looked = []
        for place in work.pages:
            reading = drawn_exactly(work.variant.n, off_mm=4.0)
            page = Page(place.name, place.page, np.full((60, 80), 255, np.uint8))
            (document,) = documents_of([Seen(place, page)], [reading], work.student_id)
            problems = (Problem("told", "something", place.name),)
            looked.append(Looked(document, reading, problems, backdrop(page, None)))
        return tuple(looked)


@pytest.fixture
def reader(monkeypatch):
    found = Reader()
    monkeypatch.setattr(batch_module, "look", found)
    return found


def scan(path, x):
    grey = np.full((200, 300), 245, np.uint8)
    cv2.line(grey, (x, 20), (x + 90, 170), 40, 3)
    cv2.imwrite(str(path), grey)


@pytest.fixture
def class_folder(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    for x, student in enumerate(("s1", "s2"), start=1):
        scan(folder / f"{student}.png", 40 * x)
    roster(folder, s1=4, s2=9)
    return folder


def roster(folder, **numbers):
    lines = [f"{student},{student.upper()},{n},{SCALES}" for student, n in numbers.items()]
    (folder / "roster.csv").write_text("\n".join(["student_id,name,n,kL,kv", *lines]) + "\n")


def run(folder, out, rubric=RUBRIC, progress=lambda *_: None):
    return grade(Batch(PUMP, rubric, folder, out), progress)


def wider(rubric):
    """The rubric of a teacher who thought again."""
    table = rubric.tolerance.model_copy(update={"length_mm": 6.0, "across_mm": 6.0})
    return rubric.model_copy(update={"tolerance": table})


def test_a_changed_rubric_marks_everybody_again_and_reads_no_scan_again(class_folder, tmp_path, reader):
    first = run(class_folder, tmp_path / "out")
    assert sorted(reader.read) == ["s1", "s2"]
    second = run(class_folder, tmp_path / "out", wider(RUBRIC))
    assert sorted(reader.read) == ["s1", "s2"]
    fresh = run(class_folder, tmp_path / "other", wider(RUBRIC))
    assert second.reports == fresh.reports
    assert second.reports != first.reports


@pytest.mark.usefixtures("reader")
def test_what_moved_is_told_with_the_standing_before_and_after(class_folder, tmp_path):
    out = tmp_path / "out"
    assert run(class_folder, out).moved == []
    again = run(class_folder, out, wider(RUBRIC))
    assert {one.student_id for one in again.moved} == {"s1", "s2"}
    assert {told_standing(one.before) for one in again.moved} == {"16.25..20 needs review"}
    assert {told_standing(one.after) for one in again.moved} == {"20"}
    assert json.loads((out / "results.json").read_text())["moved"][0]["after"]["status"] == "graded"
    assert run(class_folder, out, wider(RUBRIC)).moved == []
    scan(class_folder / "s3.png", 130)
    roster(class_folder, s1=4, s3=5)
    (class_folder / "s2.png").unlink()
    changed = {one.student_id: one for one in run(class_folder, out, wider(RUBRIC)).moved}
    assert changed.keys() == {"s2", "s3"}
    assert changed["s2"].after is None
    assert changed["s3"].before is None
    assert told_standing(None) == "-"


def test_a_changed_line_of_the_roster_reads_only_that_students_scan_again(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    roster(class_folder, s1=4, s2=10)
    assert [one.student_id for one in run(class_folder, tmp_path / "out").moved] in ([], ["s2"])
    assert reader.read == ["s2"]


def test_an_added_file_is_read_and_no_other(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    scan(class_folder / "s3.png", 130)
    roster(class_folder, s1=4, s2=9, s3=5)
    run(class_folder, tmp_path / "out")
    assert reader.read == ["s3"]


def test_a_file_with_other_content_is_read_again_and_one_only_touched_is_not(class_folder, tmp_path, reader):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    (class_folder / "s1.png").touch()
    scan(class_folder / "s2.png", 150)
    run(class_folder, tmp_path / "out")
    assert reader.read == ["s2"]


@pytest.mark.usefixtures("reader")
def test_pages_are_surveyed_once(class_folder, tmp_path, monkeypatch):
    seen = []

    def noted(path, name, names, survey=kept_module.survey):
        seen.append(name)
        return survey(path, name, names)

    monkeypatch.setattr(kept_module, "survey", noted)
    run(class_folder, tmp_path / "out")
    assert seen == ["s1.png", "s2.png"]
    scan(class_folder / "s2.png", 150)
    run(class_folder, tmp_path / "out", wider(RUBRIC))
    assert seen == ["s1.png", "s2.png", "s2.png"]
    assert len(list((tmp_path / "out" / ".planmark" / "surveys").iterdir())) == 2


def test_an_interrupted_run_goes_on_where_it_was(class_folder, tmp_path, reader):
    def interrupt(what, done, _total):
        if what == "marking" and done == 1:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        run(class_folder, tmp_path / "out", progress=interrupt)
    assert reader.read == ["s1"]
    results = run(class_folder, tmp_path / "out")
    assert reader.read == ["s1", "s2"]
    assert results.reports == run(class_folder, tmp_path / "other").reports


@pytest.mark.parametrize("damage", [b"", b"{", b'{"key": 1}', b"[]"])
def test_notes_that_are_damaged_are_not_relied_on(class_folder, tmp_path, reader, damage):
    first = run(class_folder, tmp_path / "out")
    for note in (tmp_path / "out" / ".planmark").rglob("*.json"):
        note.write_bytes(damage)
    (tmp_path / "out" / "s1" / "feedback.html").unlink()
    reader.read.clear()
    assert run(class_folder, tmp_path / "out").reports == first.reports
    assert reader.read == ["s1"]


def test_another_version_of_the_program_reads_again(class_folder, tmp_path, reader, monkeypatch):
    run(class_folder, tmp_path / "out")
    reader.read.clear()
    monkeypatch.setattr(kept_module, "code_version", lambda: "another")
    run(class_folder, tmp_path / "out")
    assert sorted(reader.read) == ["s1", "s2"]


def test_records_come_back_as_they_were():
    reading = drawn_exactly(4)
    back = unpacked(json.loads(json.dumps(packed(reading))))
    assert back.unread == reading.unread
    assert back.figures["velocity_plan"].vectors == reading.figures["velocity_plan"].vectors
    node, kept = reading.figures["velocity_plan"].nodes["o"], back.figures["velocity_plan"].nodes["o"]
    assert (kept.at, kept.confidence) == (node.at, node.confidence)
    assert np.array_equal(kept.cov, node.cov)


def test_pictures_of_one_reading_are_never_found_beside_another(tmp_path, monkeypatch):
    work = Work("s1", Variant(n=4), (Place(tmp_path / "s1.png", 1, "s1.png"),))
    looked = Reader()(work, PUMP, RUBRIC)
    keep_looked(tmp_path, "s1", "one", looked)
    assert kept_looked(tmp_path, "s1", "one") is not None
    assert kept_looked(tmp_path, "s1", "two") is None

    def full_disk(*_):
        raise OSError("no room")

    monkeypatch.setattr(kept_module, "write_whole", full_disk)
    with pytest.raises(OSError, match="no room"):
        keep_looked(tmp_path, "s1", "two", looked)
    assert kept_looked(tmp_path, "s1", "one") is None
