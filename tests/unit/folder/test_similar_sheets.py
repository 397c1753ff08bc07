"""A class in which two handed in the same values, from the folder to page and terminal."""

import json

import pytest

from grader.cli.grading import tell_class
from grader.folder.batch import Batch, grade
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment
from tests.inline import Inline
from tests.unit.similarity.classes import changed, drawing, measured

PRESS = load_assignment("press")
RUBRIC = load_rubric("press")


def handed_in(folder, student, numbers):
    rates = {name[:-4] for name in numbers if name.endswith("_deg")}
    told = {
        "student_id": student,
        "position": 1,
        "segments_mm": {name: value for name, value in numbers.items() if not name.endswith("_deg")},
        "directions_deg": {name: numbers[f"{name}_deg"] for name in rates},
    }
    (folder / f"{student}.json").write_text(json.dumps(told))


@pytest.fixture
def results(tmp_path):
    (tmp_path / "in").mkdir()
    made = [measured(drawing("press", 1, seed), seed) for seed in range(8)]
    for one in [*made, changed(made[3], 3, 2)]:
        handed_in(tmp_path / "in", one.student_id, one.numbers)
    return grade(Batch(PRESS, RUBRIC, tmp_path / "in", tmp_path / "out"), lambda *_: None, Inline())


def test_copied_values_are_told_in_results_on_the_page_and_in_the_terminal(results, tmp_path, capsys):
    (one,) = results.alike
    assert (set(one.students), one.why, one.positions) == ({"s3", "copy"}, ["same_numbers"], [1, 1])
    assert one.measure < 0.001
    told = json.loads((tmp_path / "out" / "results.json").read_text())
    assert told["alike"] == [one.model_dump(mode="json")]
    assert "the same measured values" in (tmp_path / "out" / "index.html").read_text()
    tell_class(results, tmp_path / "out")
    said = capsys.readouterr().out
    assert "Similar sheets (no accusation; compare them side by side):" in said
    assert "s3, position 1" in said


def test_a_regrade_tells_marks_and_why_in_the_terminal(results, tmp_path, capsys):
    tolerance = RUBRIC.tolerance.model_copy(update={"length_mm": 0.1, "length_relative": 0.0})
    strict = RUBRIC.model_copy(update={"tolerance": tolerance})
    again = grade(Batch(PRESS, strict, tmp_path / "in", tmp_path / "out"), lambda *_: None, Inline())
    assert again.alike == results.alike
    tell_class(again, tmp_path / "out")
    said = capsys.readouterr().out
    assert "→" in said
    assert "(the rubric was changed)" in said
