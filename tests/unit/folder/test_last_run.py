"""The last run is found again by the folder of results or of submissions."""

import shutil

import pytest

from grader.folder.batch import Batch, grade, noted_batch
from grader.rubric import load_rubric
from reference.authored.assignment import load_assignment
from reference.errors import CallError
from tests.inline import Inline

PUMP = load_assignment("pump")


@pytest.fixture
def graded(tmp_path):
    folder = tmp_path / "in"
    folder.mkdir()
    (folder / "roster.csv").write_text("student_id,name,n\ns1,Ana,4\n", encoding="utf-8")
    roster = tmp_path / "class.csv"
    shutil.copy(folder / "roster.csv", roster)
    batch = Batch(
        PUMP,
        load_rubric("pump"),
        folder,
        tmp_path / "out",
        roster=roster,
        lang="ro",
        level="hint",
        with_ghosts=False,
    )
    grade(batch, lambda *_: None, Inline())
    return tmp_path


@pytest.mark.parametrize("which", ["in", "out"])
def test_both_folders_lead_to_the_last_run(graded, which):
    batch = noted_batch(graded / which)
    assert (batch.folder, batch.out) == (graded / "in", graded / "out")
    assert (batch.assignment.id, batch.roster) == ("pump", graded / "class.csv")
    assert (batch.lang, batch.level, batch.with_ghosts) == ("ro", "hint", False)


def test_grading_leaves_nothing_among_the_submissions(graded):
    assert [path.name for path in (graded / "in").iterdir()] == ["roster.csv"]


def test_results_that_were_moved_are_found_where_they_are(graded):
    (graded / "out").rename(graded / "elsewhere")
    assert noted_batch(graded / "elsewhere").out == graded / "elsewhere"
    assert noted_batch(graded / "in").out == graded / "elsewhere"


def test_of_two_folders_of_results_the_last_one_counts(graded):
    batch = noted_batch(graded / "out")
    grade(Batch(batch.assignment, batch.rubric, batch.folder, graded / "again"), lambda *_: None, Inline())
    assert noted_batch(graded / "in").out == graded / "again"


@pytest.mark.parametrize(
    ("change", "which", "code"),
    [
        (lambda top: shutil.rmtree(top / "out" / ".planmark"), "out", "run_unknown"),
        (lambda top: shutil.rmtree(top / "out"), "in", "run_unknown"),
        (lambda top: (top / "out" / ".planmark" / "run.json").write_text("{}"), "out", "run_unknown"),
        (lambda top: (top / "in").rename(top / "moved"), "out", "submissions_moved"),
        (lambda _top: None, "nothing", "folder_missing"),
    ],
)
def test_what_is_not_known_is_told(graded, change, which, code):
    change(graded)
    with pytest.raises(CallError) as told:
        noted_batch(graded / which)
    assert told.value.code == code
    assert str(graded / which) in told.value.message
