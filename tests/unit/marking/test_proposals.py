"""The verdict proposed for a doubtful criterion agrees with the numbers and the sentence beside it."""

from dataclasses import replace

import numpy as np
import pytest

from grader.pipeline import mark
from grader.records import Figure, PageRef, ScannedPage
from grader.tables.measurements import StudentSubmission
from samples.simulation.wording import declared_texts
from tests.bench.contradictions import contradictions
from tests.examples import slow
from tests.hands import rule_scales, sheet, task_for

TASKS = {"pump": {"n": 7}, "press": {"position": 3}, "engine": {"n": 3}, "shaper": {"n": 4}}
SHEETS = 12
"""Sheets of each task; on each some nodes are misplaced and read without confidence."""
FAR_MM = 25.0


def doubtful(reading, lot, share):
    """The reading with a share of its nodes and vectors as uncertain as may be."""

    def unsure(one):
        return replace(one, confidence=float(lot.uniform(0.05, 0.99))) if lot.random() < share else one

    figures = {
        name: Figure(
            {node: unsure(one) for node, one in figure.nodes.items()},
            {vector: unsure(one) for vector, one in figure.vectors.items()},
        )
        for name, figure in reading.figures.items()
    }
    return replace(reading, figures=figures)


def report(task, reading, scales):
    """The report of a sheet with this reading."""
    submission = StudentSubmission("s01", task.variant, (), declared_texts(scales))
    page = ScannedPage(PageRef("s01.jpg"), reading=reading)
    return mark(submission, [page], task.assignment, task.rubric)[0]


def reports(name):
    """Sheets with nodes misplaced, doubts, and sometimes a scale declared ten times too small."""
    for seed in range(SHEETS):
        lot = np.random.default_rng([seed, len(name)])
        task = task_for(name, **TASKS[name])
        scales = rule_scales(task)
        nodes = [step.node for step in task.construction.steps if step.node not in task.ground]
        far = lot.choice(nodes, size=3, replace=False)
        moved = {node: complex(*lot.normal(0.0, FAR_MM / (1.0 + seed), 2)) for node in far}
        reading = doubtful(sheet(task, moved=moved), lot, 0.1 * (1 + seed % 6))
        wrong = "kv" if seed % 3 == 0 else "ka" if seed % 3 == 1 else None
        yield report(task, reading, {**scales, **({wrong: scales[wrong] / 10.0} if wrong else {})})


@pytest.mark.parametrize("name", ["press", *slow("engine", "pump", "shaper")])
def test_no_question_contradicts_itself(name):
    asked = 0
    for one in reports(name):
        assert list(contradictions(one)) == []
        asked += sum(criterion.verdict == "review" for criterion in one.criteria)
    assert asked > SHEETS


def test_a_scale_that_only_a_doubtful_vector_contradicts_is_told_with_both_values():
    task = task_for("pump", 7)
    scales = rule_scales(task)
    reading = sheet(task)
    figures = dict(reading.figures)
    plan = figures["velocity_plan"]
    unsure = {name: replace(one, confidence=0.5) for name, one in plan.vectors.items()}
    nodes = {name: replace(one, confidence=0.5) for name, one in plan.nodes.items()}
    figures["velocity_plan"] = Figure(nodes, unsure)
    found = report(task, replace(reading, figures=figures), {**scales, "kv": scales["kv"] / 10.0})
    (kv,) = (one for one in found.criteria if one.id == "kv")
    assert kv.verdict == "review"
    assert kv.measured.value == pytest.approx(scales["kv"] / 10.0, rel=1e-3)
    assert kv.expected.value == pytest.approx(scales["kv"], rel=0.02)
    assert "10 times too small" in kv.feedback
