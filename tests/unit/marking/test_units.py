"""A submission entered in another unit, sense or axis is said to be so, and judged as it was meant."""

import math
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.evidence import Submission
from grader.feedback.sentences import mistake_feedback
from grader.marking.mark import judge
from reference.construction.mistakes import RPM_FACTOR, Mistake
from samples.simulation import CAREFUL, TYPICAL
from samples.simulation.wording import declared_texts
from tests.examples import slow
from tests.hands import drawn_by, handed_in, measured, rule_scales, task_for

TASKS = [task_for("pump", 7), task_for("press", position=2), task_for("shaper", 3)]
PUMP = TASKS[0]
ONE_PRICE = 0.1
"""The most that one slip may cost, of all points."""


def entered(task, change, *mistakes, hand=TYPICAL, seed=1):
    """A hand's drawing as measured, every vector entered with a change."""
    nodes = drawn_by(task, hand, np.random.default_rng(seed), mistakes)
    submission = handed_in(task, nodes, "directions")
    reading = submission.measured
    figures = {
        plan: replace(figure, vectors={name: change(one) for name, one in figure.vectors.items()})
        for plan, figure in reading.figures.items()
    }
    return replace(submission, measured=replace(reading, figures=figures))


def turned(convention):
    def change(one):
        if one.direction_deg is None:
            return one
        return replace(one, direction_deg=convention(one.direction_deg) % 360.0)

    return change


def shorter(factor):
    return lambda one: replace(one, length_mm=one.length_mm / factor)


SLIPS = {
    "radians": (turned(lambda deg: round(math.radians(deg), 2)), {"slip": "radians"}),
    "signed radians": (
        turned(lambda deg: round(math.radians((deg + 180) % 360 - 180), 2)),
        {"slip": "radians"},
    ),
    "clockwise": (turned(lambda deg: -deg), {"slip": "clockwise"}),
    "from +y": (turned(lambda deg: deg - 90.0), {"slip": "axis", "axis": "+y"}),
    "from -x": (turned(lambda deg: deg - 180.0), {"slip": "axis", "axis": "-x"}),
    "cm": (shorter(10.0), {"slip": "lengths", "unit": "cm", "factor": 10.0}),
    "m": (shorter(1000.0), {"slip": "lengths", "unit": "m", "factor": 1000.0}),
}


def slips_of(judgement):
    return [one for one in judgement.mistakes if one.code == "units"]


@pytest.mark.parametrize("task", [TASKS[0], *slow(*TASKS[1:])], ids=lambda task: task.assignment.id)
@pytest.mark.parametrize("slip", SLIPS)
def test_a_slip_of_units_is_named_and_costs_one_criterion(task, slip):
    change, detail = SLIPS[slip]
    judgement = judge(task, entered(task, change, hand=CAREFUL))
    (named,) = judgement.mistakes
    assert named.code == "units"
    assert named.detail.items() >= detail.items()
    lost = [one for one in judgement.outcomes if one.verdict in {"none", "partial"}]
    assert [one.criterion for one in lost] == list(named.explains)
    assert judgement.score.total >= (1.0 - ONE_PRICE) * judgement.score.maximum


@pytest.mark.parametrize("slip", SLIPS)
def test_a_mistake_beside_it_is_named_too(slip):
    reversed_normal = Mistake("normal_reversed", "n_BA")
    judgement = judge(PUMP, entered(PUMP, SLIPS[slip][0], reversed_normal))
    assert [one.code for one in judgement.mistakes] == ["units", "normal_reversed"]


@pytest.mark.parametrize("task", TASKS, ids=lambda task: task.assignment.id)
@pytest.mark.parametrize("lang", ["en", "ro", "ru"])
def test_the_sentence_says_the_factor(task, lang):
    (named,) = slips_of(judge(task, entered(task, SLIPS["cm"][0])))
    told = mistake_feedback(named, lang)
    assert "cm" in told
    assert "10" in told


def test_what_is_drawn_to_the_units_asked_for_has_no_slip():
    for task in TASKS:
        for seed in range(3):
            assert not slips_of(judge(task, entered(task, lambda one: one, seed=seed)))


def test_both_plans_turned_by_a_quarter_are_measured_from_another_axis_and_one_is_turned():
    plan = Mistake("figure_rotated", "acceleration_plan", quarters=1)
    (named,) = judge(PUMP, entered(PUMP, lambda one: one, plan)).mistakes
    assert named.code == "figure_rotated"


@pytest.mark.parametrize("with_units", [True, False])
def test_exchanged_scales_are_told_as_such(with_units):
    right = declared_texts(rule_scales(PUMP))
    if not with_units:
        right = {"kL": right["kL"], **{name: f"{rule_scales(PUMP)[name]:.5g}" for name in ("kv", "ka")}}
    declared = {**right, "kv": right["ka"], "ka": right["kv"]}
    judgement = judge(PUMP, Submission(measured=measured(PUMP), declared=declared))
    if with_units:
        (named,) = judgement.mistakes
        assert named.detail == {"slip": "exchanged"}
        assert named.explains == ("kv",)
    assert not [one for one in judgement.mistakes if one.code == "rpm_not_converted"]


def test_values_in_centimetres_per_second_and_revolutions_are_told_as_such():
    values = {name: 100.0 * abs(PUMP.real[name]) for name in ("v_A", "v_B", "v_C", "a_B")}
    (named,) = slips_of(judge(PUMP, Submission(measured=measured(PUMP), values=values)))
    assert named.detail == {"slip": "values", "unit": "cm/s", "factor": 100.0}
    rates = {name: RPM_FACTOR * rate for name, rate in PUMP.rates.items() if name.startswith("omega")}
    (named,) = judge(PUMP, Submission(measured=measured(PUMP), values=rates)).mistakes
    assert (named.code, named.at) == ("rpm_not_converted", "omega_1")
    del rates["omega_1"]
    (named,) = slips_of(judge(PUMP, Submission(measured=measured(PUMP), values=rates)))
    assert named.detail["unit"] == "rev/min"
