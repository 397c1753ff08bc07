"""The bundled classes: complete, small, of the students of their script, and read to their floors.

A floor is the number of vectors of 5 mm or more that must be read within 0.5 mm; the ceiling of
vectors reported with confidence but wrong by more than 1 mm is separate, and zero.
"""

import csv
import importlib.util
import json
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest

from grader.pipeline import mark, read_pages
from grader.records import PageRef
from grader.rubric import load_rubric, rubric_of
from grader.scan.decode.pages import is_blank, page_of
from grader.scan.page import open_page
from grader.tables.measurements import StudentSubmission, names_of, read_measurements
from grader.tables.roster import read_roster
from reference.authored.assignment import load_assignment
from tests.examples import slow
from tests.samples.counting import counted

SAMPLES = Path(__file__).resolve().parents[2] / "samples"
MOST_BYTES = 5_000_000


def truths_of(name):
    found = defaultdict(list)
    for line in (SAMPLES / name / "truth.jsonl").read_text(encoding="utf-8").splitlines():
        truth = json.loads(line)
        found[truth["student_id"]].append(truth)
    return found


@pytest.fixture(scope="module")
def script():
    spec = importlib.util.spec_from_file_location("make_samples", SAMPLES / "make_samples.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_samples_are_small_enough_to_travel():
    assert sum(path.stat().st_size for path in SAMPLES.rglob("*") if path.is_file()) < MOST_BYTES


@pytest.mark.parametrize("name", ["pump", "press", "pump-forces"])
def test_the_readme_names_every_sample(name):
    told = (SAMPLES / "README.md").read_text(encoding="utf-8")
    for path in (SAMPLES / name).iterdir():
        assert f"`{name}/{path.name}`" in told or f"`{path.name}`" in told, path.name


@pytest.mark.parametrize("name", ["pump", "press"])
def test_roster_truth_and_measurements_agree_on_who_is_who(name):
    roster = read_roster(SAMPLES / name / "roster.csv")
    known = {row.student_id for row in roster.rows}
    assert set(truths_of(name)) <= known
    assignment = load_assignment(name)
    for entered in read_measurements(SAMPLES / name / "measurements.csv", names_of(assignment)):
        assert entered.student_id in known
        assert not entered.problems
        assert len(entered.reading.figures) == 2


@pytest.mark.parametrize(("name", "student"), [("pump", "s04"), ("press", "s01")])
def test_the_script_makes_the_same_task_scales_and_scan_again(script, name, student):
    """The drawings differ: those of the bundled files were made with an earlier model of a hand."""
    pupil = next(p for p in {"pump": script.PUMP, "press": script.PRESS}[name] if p.student_id == student)
    sheets = script.sheets_of(load_assignment(name), pupil)
    made = [sheet.truth for sheet in sheets]
    told = {**script.roster_line(pupil, sheets), **script.measured_line(pupil, sheets)}
    with (SAMPLES / name / "roster.csv").open(encoding="utf-8", newline="") as file:
        bundled_line = next(line for line in csv.DictReader(file) if line["student_id"] == student)
    assert {key: str(told[key]) for key in bundled_line if key != "scans"} == {
        key: value for key, value in bundled_line.items() if key != "scans"
    }
    for again, bundled in zip(made, truths_of(name)[student], strict=True):
        assert again["scales"]["declared"] == bundled["scales"]["declared"]
        assert np.allclose(again["homography"], bundled["homography"], atol=1e-6)
        for figure, drawn in bundled["figures"].items():
            for vector, told in drawn.get("vectors", {}).items():
                assert again["figures"][figure]["vectors"][vector]["intended"] == told["intended"]


def test_the_script_makes_the_same_force_plans_again(script, tmp_path):
    script.make_forces(load_assignment("pump-forces"), tmp_path)
    for path in (SAMPLES / "pump-forces").iterdir():
        assert (tmp_path / path.name).read_bytes() == path.read_bytes()


def test_of_the_force_plans_two_are_right_and_two_have_an_inertia_force_along_the_acceleration():
    folder, assignment = SAMPLES / "pump-forces", load_assignment("pump-forces")
    rubric = rubric_of(assignment)
    told = {}
    for entered in read_measurements(folder / "measurements.csv", names_of(assignment)):
        variant = assignment.variant(entered.n)
        submission = StudentSubmission(entered.student_id, variant, measured=entered)
        report, _ = mark(submission, (), assignment, rubric)
        told[entered.student_id] = (report.score == report.max_score, {one.code for one in report.mistakes})
    assert [told[student][0] for student in ("s01", "s03")] == [True, True]
    assert [told[student][1] for student in ("s02", "s04")] == [{"inertia_reversed"}, {"inertia_reversed"}]


def test_the_backs_in_the_class_pdf_are_blank_and_the_fronts_are_not():
    blank = [is_blank(page_of(SAMPLES / "pump" / "class.pdf", number)) for number in range(1, 7)]
    assert blank == [False, True, False, True, False, True]


@pytest.mark.parametrize(
    ("name", "student", "floor"),
    [("pump", "s01", 18), ("pump", "s03", 18), ("pump", "s06", 18), ("press", "s01", 14)],
    ids=["flatbed at 200 dpi", "one-bit copy", "answer sheets", "press"],
)
def test_a_sample_is_read_to_its_floor_and_never_silently_wrong(name, student, floor):
    right, misread = marks(name, student)
    assert misread == []
    assert right >= floor


def test_a_hard_sample_is_never_silently_wrong():
    assert marks("pump", "s02")[1] == []


def marks(name, student):
    """Vectors read right, and those reported with confidence but wrong."""
    folder, assignment = SAMPLES / name, load_assignment(name)
    row = read_roster(folder / "roster.csv").rows_of(student)[0]
    truths = truths_of(name)[student]
    seen = [open_page(PageRef(truth["file"], truth["page"], path=folder / truth["file"])) for truth in truths]
    wanted = load_rubric(assignment.file.rubric).vectors
    variant = assignment.variant(row.n, row.position)
    readings = [page.reading for page in read_pages(seen, assignment, variant, row.scales, wanted)]
    return counted(truths, readings)


@pytest.mark.parametrize(("student", "n"), [("s01", 7), *slow(("s02", 12), ("s07", 15))])
def test_an_acceleration_plan_alone_is_read_as_no_velocity_plan_too(student, n):
    assignment = load_assignment("pump")
    ref = PageRef("second page", path=SAMPLES / "pump" / f"{student}_2.jpg")
    (page,) = read_pages([open_page(ref)], assignment, assignment.variant(n, None), {}, ())
    assert set(page.reading.figures) == {"mechanism", "acceleration_plan"}
