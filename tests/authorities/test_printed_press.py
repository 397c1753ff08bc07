"""The course work's printed table, read off its own drawings, entered as a student's work: full marks."""

import pytest

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from grader.records import Figure, Reading, ReadVector
from tests.hands import task_for
from tests.unit.comparison.rubrics import with_rubric

DECLARED = {"kL": "0.3 m / 45 mm", "kv": "0.036 (m/s)/mm", "ka": "0.108 (m/s2)/mm"}
SEGMENTS = {
    0: {
        "v_A": 50.0, "v_BA": 50.0, "v_B": 0.0, "v_C": 0.0, "v_D": 0.0, "v_DC": 0.0,
        "a_A": 100.0, "a_BA_n": 25.0,
    },
    1: {
        "v_A": 50.0, "v_B": 46.4, "v_BA": 47.17, "v_C": 92.8, "v_D": 89.36, "v_DC": 21.61,
        "a_A": 100.0, "a_BA_n": 22.2, "a_B_n": 32.4, "a_DC_n": 15.7,
    },
}  # fmt: skip
"""Millimetres, by position; a dash of the table is nothing drawn."""
VALUES = {
    0: {"v_A": 1.8, "v_BA": 1.8, "v_B": 0.0, "v_C": 0.0, "v_D": 0.0, "v_DC": 0.0},
    1: {"v_A": 1.8, "v_B": 1.67, "v_BA": 1.7, "v_C": 3.34, "v_D": 3.22, "v_DC": 0.78},
}
"""Metres per second, rounded on the way as printed."""


def entered(position, **changed):
    lengths = {**SEGMENTS[position], **changed}
    vectors = {name: ReadVector(length, 0.0, None, None, 1.0) for name, length in lengths.items()}
    return Reading({"all": Figure({}, vectors)})


@pytest.mark.parametrize("position", [0, 1])
@pytest.mark.parametrize("declared", [DECLARED, {}], ids=["declared", "not declared"])
def test_the_printed_table_has_full_marks(position, declared):
    submission = Submission(measured=entered(position), values=VALUES[position], declared=declared)
    # The table has none of the tangential components, and no more of the plan than it prints.
    task = with_rubric(task_for("press", position=position), missing="not_judged")
    judgement = judge(task, submission)
    asked = {one.name for one in judgement.outcomes} & SEGMENTS[position].keys()
    marked = {one.name: one.verdict for one in judgement.outcomes if one.name in asked}
    assert set(marked.values()) == {"full"}
    assert not judgement.mistakes
    if declared:
        assert {one.verdict for one in judgement.outcomes if one.name in declared} == {"full"}


def test_normal_components_from_rounded_velocities_are_right():
    """1.67^2 / 0.8 = 3.5 and 3.5 / 0.108 = 32.4, where exactly it is 32.29."""
    task = task_for("press", position=1)
    normals = {
        "a_BA_n": round(round(1.7**2 / 1.2, 1) / 0.108, 1),
        "a_B_n": round(round(1.67**2 / 0.8, 1) / 0.108, 1),
        "a_DC_n": round(round(0.78**2 / 0.35, 1) / 0.108, 1),
    }
    judgement = judge(task, Submission(measured=entered(1, **normals), values=VALUES[1], declared=DECLARED))
    assert {one.verdict for one in judgement.outcomes if one.name in normals} == {"full"}
