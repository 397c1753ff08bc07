"""Whatever the mechanism: a perfect hand has full marks, a wrong component costs, nothing falls over."""

import contextlib
from pathlib import Path

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.comparison.evidence import Submission
from grader.comparison.task import Task, task_of
from grader.marking.mark import judge
from grader.rubric import RubricFile
from grader.tables.measurements import names_of
from reference.authored.assignment import Assignment, AssignmentFile, Variant
from reference.authored.toml_file import validate
from reference.construction.mistakes import Drawing, Mistake, single_mistakes
from reference.kinematics.motion import move
from reference.mechanism import Mechanism
from reference.plan import construction_for
from tests.examples import examples
from tests.hands import drawn_nodes, measured, sheet
from tests.laws.mechanisms import authored

LARGEST_MM = 120.0
"""Length of a plan's longest vector as drawn."""
FEW = 25


def largest(vectors) -> float:
    """The largest of a plan's vectors; 1 where all are zero."""
    size = max((float(np.abs(vector).max()) for vector in vectors.values()), default=0.0)
    return size or 1.0


def asked_of(mechanism: Mechanism) -> tuple[Assignment, RubricFile]:
    """The assignment of a random mechanism: everything asked for, at scales that suit the paper."""
    motion = move(mechanism)
    scales = {
        "kL": largest(motion.position) / LARGEST_MM,
        "kv": largest(motion.velocity) / LARGEST_MM,
        "ka": largest(motion.acceleration) / LARGEST_MM,
    }
    table = {
        "schema_version": 1,
        "id": "random",
        "title": {"en": "random"},
        "task": {"en": "Draw."},
        "mechanism": authored(mechanism),
        "rubric": "random",
        "scales": {name: repr(scale) for name, scale in scales.items()},
        "page": [{"kind": "all", "figures": ["mechanism", "velocity_plan", "acceleration_plan"]}],
    }
    file = validate(AssignmentFile, table, "random")
    assert not isinstance(file.mechanism, str)
    assignment = Assignment(file, file.mechanism, Path("random"))
    names = names_of(assignment)
    asked = [("vector", name) for name in construction_for(assignment).vectors if name not in names.unused]
    asked += [("angular", name) for name in names.rates]
    criteria = [{"id": name, kind: name, "points": 1.0, "title": {"en": name}} for kind, name in asked]
    rubric = {"schema_version": 1, "id": "random", "title": {"en": "random"}, "criterion": criteria}
    return assignment, validate(RubricFile, rubric, "random")


def task_for(mechanism: Mechanism) -> Task:
    """The task of a random mechanism."""
    return task_of(*asked_of(mechanism), Variant())


def lost(judgement) -> list[tuple[str, str]]:
    return [(one.criterion, one.verdict) for one in judgement.outcomes if one.verdict != "full"]


@given(mechanism=...)
@settings(max_examples=examples(FEW))
def test_a_perfect_hand_has_full_marks_on_any_mechanism(mechanism: Mechanism):
    task = task_for(mechanism)
    values = {**{name: abs(real) for name, real in task.real.items()}, **task.rates}
    for submission in (
        Submission(measured=measured(task), values=values),
        Submission(measured=measured(task, directions=False), values=values),
        Submission(readings=(sheet(task, se_mm=0.0),), values=values),
    ):
        judgement = judge(task, submission)
        assert not lost(judgement)
        assert not judgement.mistakes


@given(mechanism=..., lot=st.randoms())
@settings(max_examples=examples(FEW))
def test_any_mistake_on_any_mechanism_is_marked_and_told(mechanism: Mechanism, lot):
    task = task_for(mechanism)
    drawing = Drawing(task.construction, task.parameters)
    offered = [one for figure in task.construction.figures for one in single_mistakes(drawing, figure)]
    mistake: Mistake = lot.choice(offered)
    with contextlib.suppress(ValueError):  # some have no drawing: parallel lines do not meet
        nodes = drawn_nodes(task, mistakes=(mistake,))
        if all(np.isfinite(node) for node in nodes.values()):
            submission = Submission(readings=(sheet(task, mistakes=(mistake,)),))
            judgement = judge(task, submission)
            assert len(judgement.outcomes) == len(task.rubric.criterion)
            assert 0.0 <= judgement.score.low <= judgement.score.high <= judgement.score.maximum
            assert {one.code for one in judgement.mistakes} <= {one.code for one in offered} | {
                "arithmetic", "labels_swapped", "other_variant",
            }  # fmt: skip
