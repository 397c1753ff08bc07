"""The owner of the data that a drawing follows is found from things that a student may not choose."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.evidence import Submission, gather
from grader.comparison.task import Task, task_of
from grader.given_data.owner import owner_of
from grader.given_data.sets import AT_SCALE_ONE, CRANK, drawn_with_mistakes, mistakes_in_plans
from grader.language import tongue
from grader.marking.mark import judge
from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN, Reading
from grader.rubric import DoubtTable
from grader.texts.reasons import reason_sentence
from reference.authored.assignment import Variant
from reference.construction.graph import evaluate
from reference.construction.mistakes import Drawing, Mistake, commit
from samples.simulation import TYPICAL
from samples.simulation.wording import declared_texts
from tests.hands import drawn_by, drawn_nodes, handed_in, measured, rule_scales, sheet, task_for
from tests.unit.comparison.rubrics import with_rubric

PUMP = task_for("pump", 7)
OTHER = task_for("pump", 20)
PRESS = task_for("press", position=2)
SOURCES = ("sheet", "directions", "lengths")
DECLARED = (None, 0.2, 1.0, 3.0)
"""Multiples of the rule's scales that are declared, None for nothing."""


def owner(task: Task, submission: Submission):
    return owner_of(task, gather(task, submission), submission.declared)


def misread_by(task: Task, angle_rad: float) -> Task:
    """The task with the crank at another angle."""
    return replace(task, parameters={**task.parameters, CRANK: np.asarray(angle_rad)})


def with_plan(own: Submission, other: Submission, plan: str) -> Submission:
    """The own submission with another's plan in it."""
    if own.measured is not None and other.measured is not None:
        figures = {**own.measured.figures, plan: other.measured.figures[plan]}
        return replace(own, measured=Reading(figures))
    figures = {**own.readings[0].figures, plan: other.readings[0].figures[plan]}
    return replace(own, readings=(Reading(figures),))


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("times", DECLARED)
def test_another_variants_drawing_is_known_whatever_scales_are_declared(source, times):
    nodes = drawn_nodes(OTHER)
    scales = {} if times is None else {name: times * one for name, one in rule_scales(PUMP).items()}
    copied = replace(handed_in(PUMP, nodes, source), declared=declared_texts(scales) if scales else {})
    found = owner(PUMP, copied)
    assert (found.data.kind, found.data.variant, found.part) == ("other_variant", Variant(n=20), MECHANISM)
    assert found.not_own > 0.99


@pytest.mark.parametrize("turn_deg", [-20.0, -6.0, 6.0, 20.0])
def test_a_turned_sketch_hides_no_owner_and_accuses_nobody(turn_deg):
    assert owner(PUMP, Submission(readings=(sheet(PUMP, turn_deg=turn_deg),))) is None
    found = owner(PUMP, Submission(readings=(sheet(OTHER, turn_deg=turn_deg),)))
    assert (found.data.kind, found.data.variant) == ("other_variant", Variant(n=20))


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("plan", [VELOCITY_PLAN, ACCELERATION_PLAN])
def test_half_a_copy_is_known_with_the_plan_that_was_copied(source, plan):
    own, other = (handed_in(PUMP, drawn_nodes(task), source) for task in (PUMP, OTHER))
    found = owner(PUMP, with_plan(own, other, plan))
    assert (found.data.variant, found.part) == (Variant(n=20), plan)
    assert found.is_sure


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize("task", [PUMP, PRESS])
def test_own_data_with_a_mistake_or_two_stay_own(source, task):
    for mistakes in (
        (),
        (Mistake("sense_reversed", "a"),),
        (Mistake("normal_missing", "n_BA"),),
        (Mistake("figure_rotated", VELOCITY_PLAN, quarters=1),),
        (Mistake("normal_reversed", "n_BA"), Mistake("parallel_for_perpendicular", "b")),
        (Mistake("other_assembly", task.construction.figures[MECHANISM][-1].node),),
    ):
        for seed in range(3):
            lot = np.random.default_rng(seed)
            drawn = handed_in(task, drawn_by(task, TYPICAL, lot, mistakes), source)
            assert owner(task, drawn) is None, mistakes


@pytest.mark.parametrize(
    ("angle", "source"),
    [
        (lambda right: -right, "sheet"),
        (lambda right: -right, "directions"),
        (lambda right: math.pi - right, "sheet"),
        (lambda right: right - 0.35, "directions"),
        (lambda right: right + 0.5, "sheet"),
    ],
)
def test_a_crank_at_another_angle_is_never_followed_in_silence(angle, source):
    drawn = misread_by(PUMP, angle(float(PUMP.parameters[CRANK])))
    submission = handed_in(PUMP, drawn_nodes(drawn), source)
    judgement = judge(PUMP, submission)
    assert judgement.score.total is None
    # An angle that is another variant's may be read in either way.
    assert judgement.mistakes[0].code in {"data_misread", "other_variant"}
    assert all(one.verdict in {"review", "not_judged"} for one in judgement.outcomes)


def test_a_misread_angle_says_where_the_crank_stands():
    drawn = misread_by(PUMP, -float(PUMP.parameters[CRANK]))
    (named, *_) = judge(PUMP, handed_in(PUMP, drawn_nodes(drawn), "sheet")).mistakes
    degrees = math.degrees(-float(PUMP.parameters[CRANK])) % 360.0
    assert (named.code, named.detail) == ("data_misread", {"crank_deg": pytest.approx(degrees, abs=0.1)})


@pytest.mark.parametrize("plan", [VELOCITY_PLAN, ACCELERATION_PLAN])
def test_of_half_a_copy_only_the_copied_plan_waits_for_a_person(plan):
    own, other = (handed_in(PUMP, drawn_nodes(task), "directions") for task in (PUMP, OTHER))
    judgement = judge(PUMP, with_plan(own, other, plan))
    (named,) = judgement.mistakes
    assert (named.code, named.at, named.mistake.n) == ("other_variant", plan, 20)
    assert named.detail == {"n": 20, "part": plan}
    scale = PUMP.construction.vectors_of(plan)[0].scale
    for one in judgement.outcomes:
        vector = PUMP.construction.vectors.get(one.name)
        if vector is not None and vector.scale == scale and one.verdict != "not_judged":
            assert one.verdict == "review"
            assert one.reasons[0].code == "other_variant"


def test_another_variants_data_earn_none_where_the_rubric_says_so_whatever_is_declared():
    task = with_rubric(PUMP, doubt=DoubtTable(other_variant="none"))
    copied = replace(handed_in(task, drawn_nodes(OTHER), "sheet"), declared=declared_texts(rule_scales(PUMP)))
    assert judge(task, copied).score.total == 0.0


def test_what_is_less_sure_is_left_to_a_person_with_the_number_without_a_name(monkeypatch):
    monkeypatch.setattr("grader.given_data.owner.NAMED", 1.1)
    judgement = judge(PUMP, Submission(measured=measured(OTHER)))
    assert judgement.score.total is None
    assert "other_variant" not in {one.code for one in judgement.mistakes}
    first = [one.reasons[0] for one in judgement.outcomes if one.verdict == "review"]
    asked = [one for one in first if one.code == "data_unclear"]
    assert asked
    assert str(asked[0].parameters["whose"]).startswith("n = 20")
    assert "(n = 20" in reason_sentence(asked[0], tongue("en"), "full")


def test_all_mistakes_together_draw_what_each_draws_by_itself():
    right = Drawing(PUMP.construction, {**PUMP.parameters, **AT_SCALE_ONE})
    made, together = mistakes_in_plans(PUMP), drawn_with_mistakes(PUMP)
    assert {"labels_swapped", "wrong_link", "image_mirrored", "normal_missing"} <= {one.code for one in made}
    for row, mistake in enumerate(made):
        drawing = commit(mistake, right)
        nodes = evaluate(drawing.construction, drawing.parameters)
        for name, vector in drawing.construction.vectors.items():
            with np.errstate(invalid="ignore"):
                alone = complex(nodes[vector.head] - nodes[vector.tail])
            np.testing.assert_allclose(together.real[name][row], alone, atol=1e-9, err_msg=f"{mistake}")


@pytest.mark.parametrize("plan", [VELOCITY_PLAN, ACCELERATION_PLAN])
def test_a_plan_that_does_not_follow_the_error_of_its_own_sketch_is_known(plan):
    near = task_of(PUMP.assignment, PUMP.rubric, Variant(n=9))
    off = misread_by(PUMP, float(PUMP.parameters[CRANK]) - math.radians(1.6))
    own, other = (handed_in(task, drawn_nodes(task), "sheet") for task in (off, near))
    assert owner(PUMP, own) is None
    found = owner(PUMP, with_plan(own, other, plan))
    assert (found.data.variant, found.part) == (Variant(n=9), plan)
    assert found.is_sure


def test_on_two_sheets_the_sketches_have_errors_of_their_own(monkeypatch):
    read = [sheet(misread_by(PUMP, float(PUMP.parameters[CRANK]) + off)).figures for off in (-0.035, 0.035)]
    pages = tuple(
        Reading({name: figures[name] for name in (MECHANISM, plan)})
        for figures, plan in zip(read, (VELOCITY_PLAN, ACCELERATION_PLAN), strict=True)
    )
    found = owner(PUMP, Submission(readings=pages))
    assert found is None or not found.is_sure
    monkeypatch.setattr("grader.given_data.owner._has_one_sketch", lambda *_: True)
    assert owner(PUMP, Submission(readings=pages)).is_sure


def test_neighbours_that_drafting_errors_may_make_of_each_other_are_not_accused():
    near = task_of(PUMP.assignment, PUMP.rubric, Variant(n=8))
    found = owner(PUMP, Submission(measured=measured(near)))
    assert found is None or not found.is_sure


def test_little_evidence_accuses_nobody():
    few = measured(OTHER)
    plan = few.figures[VELOCITY_PLAN]
    one = replace(plan, vectors={"v_B": plan.vectors["v_B"]})
    found = owner(PUMP, Submission(measured=Reading({VELOCITY_PLAN: one})))
    assert found is None or not found.is_sure
    assert owner(PUMP, Submission()) is None


@pytest.mark.parametrize("degrees", [4.0, -4.5])
def test_a_crank_beyond_every_tolerance_is_not_followed_without_a_person(degrees):
    right = drawn_nodes(PUMP)
    turned = {name: right[name] for name in ("O1", "O2")}
    turned["A"] = right["O1"] + (right["A"] - right["O1"]) * np.exp(1j * math.radians(degrees))
    given = {name: np.asarray(one) for name, one in turned.items()}
    nodes = {
        name: complex(one) for name, one in evaluate(PUMP.construction, PUMP.parameters, given=given).items()
    }
    judgement = judge(PUMP, handed_in(PUMP, nodes, "sheet"))
    assert judgement.score.total is None
