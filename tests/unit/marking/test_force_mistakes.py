"""Entered force sheets: one mistake costs one criterion, what follows is credited, and it is named."""

import numpy as np
import pytest

from grader.comparison.task import task_of
from grader.feedback.mistakes import MISTAKES
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import mistake_feedback
from grader.language import LANGUAGES
from grader.marking.mark import judge
from grader.marking.report import report_of
from grader.outcomes import CHARGED, CREDITED
from grader.overlay.measured import measured_picture
from reference.construction.mistakes import OF_FORCES, affected, made_at, mistakes_of_forces
from reference.plan import exact_plan
from tests.bench.force_students import HANDS, ForceMistake, StudentForces, force_task
from tests.bench.judging_forces import measure_forces

MADE = {
    ForceMistake("reversed", "F_i3"): ("inertia_reversed", "F_i3", {"F_i3"}),
    ForceMistake("missing", "F_i3"): ("force_missing", "F_i3", {"F_i3"}),
    ForceMistake("reversed", "F_D"): ("force_reversed", "F_D", {"F_D"}),
    ForceMistake("reversed", "R_43"): ("force_reversed", "R_43", {"R_43"}),
    ForceMistake("wrong_arm", "3 R_43"): ("wrong_arm", "R_13_t", {"R_13_t"}),
    ForceMistake("part", "R_13_t", factor=-1.0): ("sense_reversed", "R_13_t", {"R_13_t"}),
    ForceMistake("line", "R_0D", turn_deg=90.0): ("parallel_for_perpendicular", "R_0D", {"R_0D"}),
    ForceMistake("slip", "F_i3", factor=1.4): ("arithmetic", "F_i3", {"F_i3"}),
    ForceMistake("slip", "M_b", factor=1.5): ("arithmetic", "M_b", {"M_b"}),
    ForceMistake("scale", "kF", factor=2.0): ("scale_wrong", "kF", {"kF"}),
    ForceMistake("arrow", "R_13"): ("force_reversed", "R_13", {"R_13"}),
    ForceMistake("turned", "F_i3", turn_deg=40.0): (None, "", {"F_i3"}),
}


def pump(mistake=None, seed=5):
    """A student's sheet of the pump, and its judgement."""
    assignment, rubric = force_task("pump")
    student = StudentForces(
        assignment, assignment.variants()[4], HANDS["careful"], mistake, np.random.default_rng(seed)
    )
    return student, judge(task_of(assignment, rubric, student.variant), student.submission)


@pytest.mark.parametrize("mistake", MADE, ids=str)
def test_a_mistake_costs_where_it_was_made_and_is_named(mistake):
    code, at, charged = MADE[mistake]
    _, judgement = pump(mistake)
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == charged
    assert [(one.code, one.at) for one in judgement.mistakes] == ([(code, at)] if code else [])


def test_every_order_of_the_given_forces_is_right():
    for seed in range(4):
        _, judgement = pump(seed=seed)
        assert {one.verdict for one in judgement.outcomes} == {"full"}


def test_a_vector_that_closes_a_polygon_has_its_own_sense_wherever_it_is_told():
    student, judgement = pump(ForceMistake("arrow", "R_13"))
    plan = exact_plan(student.task, [student.variant])
    assert plan.construction.vectors["R_13"].reversed
    told = next(one for one in judgement.outcomes if one.name == "R_13")
    assert told.expected.direction_deg == pytest.approx(plan.direction_deg("R_13")[0])
    assert told.measured.direction_deg == pytest.approx(student.entered["R_13"][1])
    (why,) = [one for one in told.reasons if one.code == "reversed"]
    assert why.parameters["measured_deg"] == pytest.approx(student.entered["R_13"][1])
    right, judgement = pump()
    outcomes = {one.name: one for one in judgement.outcomes}
    picture = measured_picture("", right.submission.measured, plan.construction, outcomes, show_expected=True)
    (arrow,) = [one for one in picture.scene.arrows if one.name == "R_13"]
    drawn = complex(arrow.tip[0] - arrow.tail[0], arrow.tail[1] - arrow.tip[1])
    assert abs(np.angle(drawn / plan.drawn_mm("R_13")[0], deg=True)) < 3.0
    assert not any(dot.lettered for dot in picture.scene.dots)


def test_no_node_of_a_polygon_is_named_in_a_report_or_a_sentence():
    assignment, rubric = force_task("pump")
    nodes = {
        step.node
        for figure, steps in task_of(
            assignment, rubric, assignment.variants()[4]
        ).construction.figures.items()
        if figure.startswith("force_plan")
        for step in steps
    }
    for mistake in MADE:
        student, judgement = pump(mistake)
        task = task_of(assignment, rubric, student.variant)
        for lang in LANGUAGES:
            report = report_of(task, judgement, "s", language=lang)
            report = with_mistakes_explained(report, judgement, assignment, student.variant, lang)
            said = [report.model_dump_json(), *(mistake_feedback(one, lang) for one in judgement.mistakes)]
            assert not [node for node in nodes for text in said if f" {node} " in text or f'"{node}"' in text]


def test_a_mistake_in_what_acts_moves_nodes_and_is_made_at_some():
    assignment, _ = force_task("pump")
    drawing = exact_plan(assignment, [assignment.variants()[4]]).drawing
    nodes = {step.node for step in drawing.construction.steps}
    for mistake in mistakes_of_forces(drawing):
        assert affected(mistake, drawing.construction) <= nodes
        assert made_at(mistake, drawing.construction) <= nodes | {"M_b"}


def test_every_mistake_of_forces_has_words():
    assert OF_FORCES | {"wrong_arm"} <= MISTAKES.keys()


def test_a_magnitude_of_the_moment_loses_its_sense_alone():
    student, _ = pump()
    assignment, rubric = force_task("pump")
    task = task_of(assignment, rubric, student.variant)
    entered = student.submission
    verdicts = {}
    for sign in (1.0, -1.0):
        entered.values["M_b"] = sign * student.moment
        judgement = judge(task, entered)
        verdicts[sign] = next(one for one in judgement.outcomes if one.name == "M_b")
    assert verdicts[1.0].verdict in CREDITED
    assert "value_reversed" in verdicts[-1.0].codes


def test_the_bench_judges_right_sheets_right():
    tally = measure_forces(1, 97001, ["right"])["right"]
    assert tally.clear > 100
    assert not tally.wrong
    assert not tally.false
