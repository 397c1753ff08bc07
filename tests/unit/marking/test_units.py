"""A submission entered in another unit, sense or axis is said to be so, and judged as it was meant."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.evidence import Submission
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import mistake_feedback
from grader.marking.mark import judge
from grader.marking.report import report_of
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import RPM_FACTOR, Mistake
from samples.simulation import CAREFUL, TYPICAL
from samples.simulation.wording import declared_texts
from tests.examples import slow
from tests.hands import changed, drawn_by, handed_in, measured, rule_scales, task_for

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


# Single entries ------------------------------------------------------------------------------------


def with_entry(submission, name, **change):
    return replace(submission, measured=changed(submission.measured, name, **change))


def entry_of(submission, name):
    return next(one.vectors[name] for one in submission.measured.figures.values() if name in one.vectors)


def lost_by(judgement):
    return [one.name for one in judgement.outcomes if one.verdict in {"none", "partial"}]


PARALLEL = Mistake("parallel_for_perpendicular", "b")


@pytest.mark.parametrize("made", [(), (PARALLEL,)], ids=["right", "beside a mistake"])
@pytest.mark.parametrize("change", ["ten times", "digits", "reversed"])
def test_a_mistyped_entry_costs_once_and_says_what_was_meant(change, made):
    submission = entered(PUMP, lambda one: one, *made, hand=CAREFUL)
    meant = entry_of(submission, "v_D")
    typed = {
        "ten times": {"length_mm": 10.0 * meant.length_mm},
        "digits": {"length_mm": float(f"{meant.length_mm:.1f}"[1::-1])},
        "reversed": {"direction_deg": (meant.direction_deg + 180.0) % 360.0},
    }[change]
    before, after = judge(PUMP, submission), judge(PUMP, with_entry(submission, "v_D", **typed))
    (named,) = slips_of(after)
    assert (named.at, named.detail["slip"], named.explains) == ("v_D", "typing", ("v_D",))
    assert sorted(lost_by(after)) == sorted([*lost_by(before), "v_D"])
    told = mistake_feedback(named, "en")
    assert f"{named.detail['entered']:.6g}" in told
    assert f"{named.detail['meant']:.6g}" in told
    shown = next(one for one in after.outcomes if one.name == "v_D").measured
    assert shown.length_mm == typed.get("length_mm", meant.length_mm)


def test_two_entries_exchanged_cost_one_of_them():
    submission = entered(PUMP, lambda one: one, hand=CAREFUL)
    first, second = (entry_of(submission, name) for name in ("v_B", "v_D"))
    for name, one in (("v_B", second), ("v_D", first)):
        submission = with_entry(submission, name, length_mm=one.length_mm, direction_deg=one.direction_deg)
    judgement = judge(PUMP, submission)
    (named,) = slips_of(judgement)
    assert named.detail == {"slip": "entries", "other": "v_D"}
    assert lost_by(judgement) == ["v_B"]
    report = report_of(PUMP, judgement, "s01", language="en", sentences={})
    told = with_mistakes_explained(report, judgement, load_assignment("pump"), PUMP.variant, "en", "full")
    assert told.mistakes[0].redo == []  # the drawing can stay


def test_an_entry_that_is_wrong_by_anything_else_is_no_typing_slip():
    submission = entered(PUMP, lambda one: one, hand=CAREFUL)
    for name in ("v_B", "v_D", "a_C"):
        longer = 1.37 * entry_of(submission, name).length_mm
        assert not slips_of(judge(PUMP, with_entry(submission, name, length_mm=longer)))


def test_one_polygon_alone_shows_no_typing_slip():
    submission = entered(PUMP, lambda one: one, hand=CAREFUL)
    kept = {"v_A", "v_B", "v_BA"}
    figures = dict(submission.measured.figures)
    figures["velocity_plan"] = replace(
        figures["velocity_plan"],
        vectors={name: one for name, one in figures["velocity_plan"].vectors.items() if name in kept},
    )
    submission = replace(submission, measured=replace(submission.measured, figures=figures))
    longer = 10.0 * entry_of(submission, "v_B").length_mm
    assert not slips_of(judge(PUMP, with_entry(submission, "v_B", length_mm=longer)))


def test_a_line_from_the_start_of_its_component_costs_there_and_not_where_it_ends():
    wrong = Mistake("wrong_intersection", "d'", other=("c'",))
    submission = entered(PUMP, lambda one: one, wrong, hand=CAREFUL)
    whole = sum(
        cmath.rect(one.length_mm, math.radians(one.direction_deg))
        for one in (entry_of(submission, "a_DC_n"), entry_of(submission, "a_DC_t"))
    )
    submission = with_entry(
        submission, "a_DC_t", length_mm=abs(whole), direction_deg=math.degrees(cmath.phase(whole)) % 360.0
    )
    judgement = judge(PUMP, submission)
    assert "a_DC_t" in lost_by(judgement)
    assert "a_D" not in lost_by(judgement)
