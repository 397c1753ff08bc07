import json
import re

import pytest

from grader.files import OutputError
from grader.folder.batch import Batch, grade, needs_person
from grader.rubric import load_rubric
from grader.solution.document import plan_document
from reference.authored.assignment import Variant, load_assignment
from reference.errors import CallError
from reference.plan import exact_plan
from tests.inline import Inline

PUMP = load_assignment("pump")
RUBRIC = load_rubric("pump-velocity")


def perfect(n):
    plan = plan_document(PUMP, exact_plan(PUMP, [Variant(n=n)]))
    return {
        "n": n,
        "scales": {"kL": "1:5", "kv": "kv = omega kL"},
        "segments_mm": {name: one.drawn_mm for name, one in plan.vectors.items() if name.startswith("v")},
    }


@pytest.fixture
def class_folder(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    for student, n in (("s1", 4), ("s2", 9)):
        (folder / f"{student}.json").write_text(json.dumps({"student_id": student, **perfect(n)}))
    (folder / "roster.csv").write_text("student_id,name,n\ns1,Ana,4\ns2,Ion,9\ns3,Ilie,5\n")
    return folder


def run(folder, out, **changes):
    told = []
    batch = Batch(PUMP, RUBRIC, folder, out, **changes)
    workers = None if "jobs" in changes else Inline()
    return grade(batch, lambda *progress: told.append(progress), workers), told


def test_perfect_measurements_have_full_marks_and_nothing_handed_in_is_missing(class_folder, tmp_path):
    results, _ = run(class_folder, tmp_path / "out")
    states = {report.student_id: (report.status, report.score) for report in results.reports}
    assert states == {"s1": ("graded", 20.5), "s2": ("graded", 20.5), "s3": ("missing", None)}
    assert needs_person(results)
    for name in ("results.json", "summary.csv", "index.html", "s1/report.json", "s1/feedback.html"):
        assert (tmp_path / "out" / name).is_file()


def test_a_broken_file_stops_nobody_else(class_folder, tmp_path):
    (class_folder / "s3.jpg").write_bytes(b"")
    (class_folder / "s9.json").write_text("{")
    results, _ = run(class_folder, tmp_path / "out")
    assert [report.status for report in results.reports] == ["graded", "graded", "unreadable"]
    assert "The file is empty" in results.reports[2].problems[0].message
    assert [one.file for one in results.unmatched] == ["s9.json"]


def test_a_file_that_is_nobodys_and_no_drawing_is_told_as_both(class_folder, tmp_path):
    (class_folder / "notes.txt").write_text("hello")
    results, _ = run(class_folder, tmp_path / "out")
    (told,) = [one.message for one in results.unmatched if one.file == "notes.txt"]
    assert "Nothing says whose page this is" in told
    assert "JPEG, PNG, TIFF, HEIC or PDF" in told


def test_progress_is_told_to_the_end(class_folder, tmp_path):
    _, told = run(class_folder, tmp_path / "out")
    assert told[-1] == ("marking", 3, 3)
    assert ("opening", 2, 2) in told


def test_several_processes_give_the_same_results(class_folder, tmp_path):
    alone, _ = run(class_folder, tmp_path / "one")
    together, _ = run(class_folder, tmp_path / "two", jobs=2)
    assert together == alone


def test_results_inside_the_folder_are_no_submissions(class_folder):
    out = class_folder / "results"
    first, _ = run(class_folder, out)
    second, _ = run(class_folder, out)
    assert second == first


def test_a_folder_that_is_not_there_or_empty_is_told(tmp_path):
    with pytest.raises(CallError, match=r"nothing\.zip: there is no such archive"):
        run(tmp_path / "nothing.zip", tmp_path / "out")
    (tmp_path / "cut.zip").write_bytes(b"PK\x03\x04")
    with pytest.raises(CallError) as told:
        run(tmp_path / "cut.zip", tmp_path / "out")
    assert told.value.code == "archive_damaged"
    (tmp_path / "cut.zip").unlink()
    with pytest.raises(CallError, match="nothing to grade"):
        run(tmp_path, tmp_path / "out")
    (tmp_path / "roster.csv").write_text("student_id,name,n\ns01,Ana,4\n")
    with pytest.raises(CallError, match=f"is a file; .*{re.escape(str(tmp_path))}\\)"):
        run(tmp_path / "roster.csv", tmp_path / "out")


def test_results_that_cannot_be_written_are_told_before_anything_is_marked(class_folder, tmp_path):
    (tmp_path / "taken").write_text("a file")
    told = []
    batch = Batch(PUMP, RUBRIC, class_folder, tmp_path / "taken" / "out")
    with pytest.raises(OutputError, match="choose another place"):
        grade(batch, lambda *progress: told.append(progress))
    assert not any(what == "marking" for what, *_ in told)


def test_the_results_are_written_part_by_part_as_they_would_be_whole(class_folder, tmp_path):
    results, _ = run(class_folder, tmp_path / "out")
    assert (tmp_path / "out" / "results.json").read_text() == results.model_dump_json(indent=2)
