"""Feedback for students: levels, ghosts and print, as an instructor asks for them, and a student at home."""

import json
import re
from pathlib import Path

import pytest

from grader.cli.checking import check_measured
from grader.cli.grading import grade_folder
from grader.options import CheckOptions, GradeOptions
from reference.errors import CallError

SAMPLE = Path(__file__).parents[2] / "samples" / "pump" / "s08.json"


@pytest.fixture
def folder(tmp_path):
    """One student's measurements, one of them far off."""
    where = tmp_path / "folder"
    where.mkdir()
    measured = json.loads(SAMPLE.read_text(encoding="utf-8"))
    measured["segments_mm"]["v_BA"] *= 1.31
    (where / "s08.json").write_text(json.dumps(measured), encoding="utf-8")
    return where


def test_print_ghosts_and_levels_are_as_asked_for(planmark, folder, tmp_path):
    ran = planmark("grade", folder, "--assignment", "pump", "--out", "marks", "--jobs", 1)
    assert ran.returncode in {0, 1}, ran.stderr
    student = tmp_path / "marks" / "s08"
    assert {path.name for path in student.iterdir()} == {"feedback.html", "report.json"}
    page = (student / "feedback.html").read_text(encoding="utf-8")
    (expected,) = {
        f"{one['expected']['length_mm']:.1f}"
        for one in json.loads((student / "report.json").read_text(encoding="utf-8"))["criteria"]
        if one["vector"] == "v_BA"
    }
    ghost = 'class="line ghost"'
    assert f"{expected}\u00a0mm" in page
    assert ghost in page

    again = planmark("grade", folder, "--assignment", "pump", "--out", "marks", "--jobs", 1, "--no-ghosts")
    assert again.returncode == ran.returncode
    page = (student / "feedback.html").read_text(encoding="utf-8")
    assert f"{expected}\u00a0mm" in page
    assert ghost not in page

    planmark("grade", folder, "--assignment", "pump", "--out", "marks", "--jobs", 1, "--level", "hint")
    page = (student / "feedback.html").read_text(encoding="utf-8")
    assert f"{expected}\u00a0mm" not in page
    assert ghost not in page


def test_a_level_that_there_is_not_is_refused_before_anything_is_written(folder, tmp_path):
    out = tmp_path / "marks"
    with pytest.raises(CallError, match="symbol, hint, full"):
        grade_folder(folder, "pump", out, GradeOptions(jobs=1, level="all"))
    assert not out.exists()


def test_a_student_gets_a_page_of_values_measured_at_home(planmark, folder, tmp_path):
    ran = planmark("check", "pump", "--measured", folder / "s08.json", "--page", "mine.html", "--lang", "ru")
    assert ran.returncode == 1, ran.stderr
    page = (tmp_path / "mine.html").read_text(encoding="utf-8")
    assert re.search(r"<svg[^>]* class=.sheet.|<svg class=.sheet.", page)
    assert "План скоростей" in page


def test_one_page_is_of_one_student(tmp_path):
    page = tmp_path / "mine.html"
    with pytest.raises(CallError, match="holds 2"):
        check_measured("pump", CheckOptions(measured=SAMPLE.with_name("measurements.csv"), page=page))
    assert not page.exists()
