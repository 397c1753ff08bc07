"""The crank's omega is the first result: a wrong one is named, costs once, and is followed."""

import math
from dataclasses import replace

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of, tasks_at_speed
from grader.feedback.sentences import mistake_feedback
from grader.marking.mark import judge
from reference.quantities import unit_of
from tests.hands import measured, rule_scales, task_for

PRESS, PUMP = task_for("press", position=1), task_for("pump", 7)
U = 23.5


def worked(task, factor, scales="own", *, omega=True):
    """All that a student hands in who computes with a wrong omega and does everything else right.

    Scales are those that follow from it, those of the assignment, or none that is declared.
    """
    own = tasks_at_speed(task, (factor, 1.0))[0]
    used = rule_scales(task if scales != "own" else own)
    texts = {name: f"{value!r} {unit_of(name)}" for name, value in used.items()}
    values = {name: abs(real) for name, real in own.real.items()} | dict(own.rates)
    if not omega:
        del values["omega_1"]
    return Submission(
        measured=measured(own, used), values=values, declared={} if scales == "undeclared" else texts
    )


def lost(judgement):
    return [one.name for one in judgement.outcomes if one.verdict in {"none", "partial", "review"}]


@pytest.mark.parametrize("scales", ["own", "kept", "undeclared"])
@pytest.mark.parametrize("task", [PRESS, PUMP], ids=["press", "pump"])
@pytest.mark.parametrize("factor", [1.3, 0.5])
def test_a_wrong_omega_costs_its_own_points_and_all_else_follows(task, factor, scales):
    judgement = judge(task, worked(task, factor, scales))
    assert lost(judgement) == ["omega_1"]
    by_name = {one.name: one for one in judgement.outcomes}
    if scales == "kept":
        assert {by_name[name].verdict for name in ("v_A", "v_B", "a_A", "omega_2")} == {"follow_through"}
        assert by_name["v_A"].expected.length_mm == pytest.approx(
            factor * abs(task.real["v_A"]) / rule_scales(task)["kv"]
        )
        assert by_name["kv"].verdict in {"full", "follow_through"}
    elif scales == "own":
        assert by_name["kv"].verdict == "follow_through"
        assert by_name["v_A"].measured.value == pytest.approx(factor * abs(task.real["v_A"]))


@pytest.mark.parametrize(
    ("task", "factor", "slip", "formula"),
    [
        (PUMP, 30.0 / math.pi, "not_converted", "n"),
        (PUMP, 0.5, "half_turn", "π·n/60"),
        (PUMP, 60.0, "seconds_forgotten", "2π·n"),
        (PUMP, 0.5 / math.pi, "turn_forgotten", "n/60"),
        (PRESS, U, "ratio_forgotten", "π·n/30"),
        (PRESS, U**2, "ratio_multiplied", "π·n/30 · U"),
        (PRESS, 30.0 / math.pi, "not_converted", "n / U"),
        (PRESS, U * 30.0 / math.pi, "not_converted ratio_forgotten", "n"),
    ],
)
def test_how_omega_was_computed_is_told(task, factor, slip, formula):
    judgement = judge(task, worked(task, factor))
    (mistake,) = judgement.mistakes
    assert (mistake.code, mistake.at, mistake.explains) == ("rpm_not_converted", "omega_1", ("omega_1",))
    assert (mistake.detail["slip"], mistake.detail["formula"]) == (slip, formula)
    for lang in ("en", "ro", "ru"):
        assert formula in mistake_feedback(mistake, lang)
    assert lost(judgement) == ["omega_1"]


def test_two_pi_n_by_sixty_is_right_and_a_slip_in_the_arithmetic_has_no_formula():
    right = judge(PUMP, worked(PUMP, 1.0))
    assert (right.mistakes, lost(right)) == ((), [])
    (slip,) = judge(PUMP, worked(PUMP, 1.3)).mistakes
    assert (slip.code, slip.at, slip.detail) == ("arithmetic", "omega_1", {"factor": pytest.approx(1.3)})


def test_a_crank_taken_to_turn_the_other_way_costs_once():
    judgement = judge(PUMP, worked(PUMP, -1.0))
    (mistake,) = judgement.mistakes
    assert (mistake.code, mistake.at, lost(judgement)) == ("sense_reversed", "omega_1", ["omega_1"])
    assert "the other way" in mistake_feedback(mistake, "en")


def test_only_omega_is_wrong_where_all_else_was_done_with_the_right_one():
    submission = worked(PUMP, 1.0)
    submission = replace(submission, values={**submission.values, "omega_1": 1.5 * PUMP.rates["omega_1"]})
    judgement = judge(PUMP, submission)
    assert lost(judgement) == ["omega_1"]
    assert {one.verdict for one in judgement.outcomes} == {"none", "full", "not_judged"}


def test_a_forgotten_ratio_is_seen_from_the_scales_alone():
    judgement = judge(PRESS, worked(PRESS, U, omega=False))
    assert {(one.code, one.at) for one in judgement.mistakes} == {
        ("rpm_not_converted", "kv"),
        ("rpm_not_converted", "ka"),
    }
    assert all(one.detail["slip"] == "ratio_forgotten" for one in judgement.mistakes)


def test_a_rubric_without_omega_charges_the_first_that_shows_it():
    kept = [one for one in PUMP.rubric.criterion if one.angular != "omega_1"]
    rubric = PUMP.rubric.model_copy(update={"criterion": kept})
    task = task_of(PUMP.assignment, rubric, PUMP.variant)
    judgement = judge(task, worked(task, 30.0 / math.pi))
    (name,) = lost(judgement)
    assert name == "kv"
    assert [one.code for one in judgement.mistakes] == ["rpm_not_converted"]


def test_a_rubric_without_follow_through_follows_no_omega():
    rubric = PUMP.rubric.model_copy(update={"follow_through": False})
    task = task_of(PUMP.assignment, rubric, PUMP.variant)
    assert {"omega_1", "v_A", "v_B"} <= set(lost(judge(task, worked(task, 1.3, "kept"))))


def test_a_submission_without_omega_keeps_its_share():
    submission = worked(PUMP, 1.0, omega=False)
    score = judge(PUMP, submission).score
    assert score.total == score.maximum


def test_what_is_missing_does_not_speak_for_the_right_omega():
    submission = worked(PRESS, U)
    velocities = {
        name: figure for name, figure in submission.measured.figures.items() if name == "velocity_plan"
    }
    submission = replace(submission, measured=replace(submission.measured, figures=velocities))
    judgement = judge(PRESS, submission)
    assert [one.at for one in judgement.mistakes if one.code == "rpm_not_converted"] == ["omega_1"]
    assert {one.verdict for one in judgement.outcomes if one.name in {"kv", "v_A", "v_B"}} == {
        "follow_through"
    }
