"""Verdicts: tolerance, sense, zero vectors, doubt, what is missing, follow-through."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.comparison.follow_through import ReplayResult
from grader.comparison.own import PlanBasis
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.records import Figure, OtherReading, Reading, ReadNode, Reason, Unread
from grader.rubric import Band, CriterionTable, DoubtTable, ToleranceTable, load_rubric
from grader.self_check.results import checked_values
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import Mistake
from tests.hands import changed, drawn_nodes, measured, rule_scales, sheet, task_for, without
from tests.unit.comparison.rubrics import codes, outcome_of, with_criterion, with_rubric, without_hand

PUMP = task_for("pump", 7)
PRESS = task_for("press", position=1)
DEAD = task_for("press", position=0)
ROUNDING = 1e-9


def verdicts(comparison):
    return {one.criterion: one.verdict for one in comparison.outcomes}


def lost(comparison):
    return [one.criterion for one in comparison.outcomes if one.verdict not in {"full", "not_judged"}]


BARE = without_hand(PUMP)
UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}
DECLARED = {name: f"{value!r} {UNITS[name]}" for name, value in rule_scales(PUMP).items()}


# The original data --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("off_mm", "verdict", "code"),
    [
        (0.9, "full", "right"),
        (1.5, "partial", "too_long"),
        (-1.5, "partial", "too_short"),
        (3.0, "none", "too_long"),
    ],
)
def test_a_length_off_costs_half_and_then_all(off_mm, verdict, code):
    reading = measured(BARE)
    length = reading.figures["acceleration_plan"].vectors["a_BA_t"].length_mm
    comparison = compare(BARE, Submission(measured=changed(reading, "a_BA_t", length_mm=length + off_mm)))
    outcome = outcome_of(comparison, "a_BA_t")
    assert outcome.verdict == verdict
    assert codes(outcome)[0] == code


@pytest.mark.parametrize(
    ("turn_deg", "verdict", "code"),
    [
        (1.4, "full", "right"),
        (2.0, "partial", "turned_left"),
        (-2.0, "partial", "turned_right"),
        (90.0, "none", "turned_left"),
        (179.0, "none", "reversed"),
    ],
)
def test_a_direction_off_is_told_with_its_side(turn_deg, verdict, code):
    reading = measured(BARE)
    degrees = reading.figures["velocity_plan"].vectors["v_D"].direction_deg
    turned = changed(reading, "v_D", direction_deg=(degrees + turn_deg) % 360.0)
    outcome = outcome_of(compare(BARE, Submission(measured=turned)), "v_D")
    assert outcome.verdict == verdict
    assert codes(outcome)[0] == code


def test_the_record_holds_what_was_measured_expected_and_allowed():
    outcome = outcome_of(compare(PUMP, Submission(measured=measured(PUMP))), "v_A")
    assert outcome.expected.length_mm == pytest.approx(60.0, rel=ROUNDING)
    assert outcome.expected.direction_deg == pytest.approx(44.0 + 90.0, rel=ROUNDING)
    assert outcome.expected.value == pytest.approx(PUMP.omega * 0.3, rel=ROUNDING)
    assert outcome.measured.length_mm == pytest.approx(60.0, rel=ROUNDING)
    assert outcome.measured.direction_deg == pytest.approx(134.0, rel=ROUNDING)
    assert outcome.expected.unit == "m/s"
    assert outcome.tolerance.length_mm == pytest.approx(1.2, rel=ROUNDING)
    assert outcome.tolerance.direction_deg == pytest.approx(1.5, rel=ROUNDING)


def test_lengths_alone_are_judged_on_their_length_alone():
    comparison = compare(PUMP, Submission(measured=measured(PUMP, directions=False)))
    assert lost(comparison) == []
    assert outcome_of(comparison, "v_D").tolerance.direction_deg is None


def test_a_rubric_may_leave_a_direction_out():
    task = with_criterion(PUMP, "v_D", direction=False)
    turned = changed(measured(task), "v_D", direction_deg=77.0)
    assert outcome_of(compare(task, Submission(measured=turned)), "v_D").verdict == "full"


def test_a_short_vector_has_no_direction_that_could_be_wrong():
    lengths = {n: abs(task_for("pump", n).real["v_DC"]) for n in range(1, 31)}
    task = task_for("pump", min(lengths, key=lengths.__getitem__))
    reading = changed(measured(task), "v_DC", direction_deg=123.0)
    drawn = reading.figures["velocity_plan"].vectors["v_DC"].length_mm
    assert drawn < task.rubric.tolerance.least_mm
    outcome = outcome_of(compare(task, Submission(measured=reading)), "v_DC")
    assert outcome.verdict == "full"
    assert "too_short_to_judge" in codes(outcome)


def test_at_a_dead_point_nothing_drawn_is_right_and_something_drawn_is_not():
    reading = measured(DEAD)
    assert lost(compare(DEAD, Submission(measured=reading))) == []
    outcome = outcome_of(compare(DEAD, Submission(measured=changed(reading, "v_B", length_mm=5.0))), "v_B")
    assert outcome.verdict == "none"
    assert codes(outcome)[0] == "should_be_zero"
    rates = {name: rate for name, rate in DEAD.rates.items() if name.startswith("omega") and abs(rate) < 1e-9}
    entered = compare(DEAD, Submission(measured=reading, values=dict.fromkeys(rates, 9.0)))
    assert [outcome_of(entered, name).expected.value for name in rates] == [0.0] * len(rates)
    assert any(rates.values())
    assert outcome.expected.direction_deg is None


def test_bands_give_their_shares():
    bands = [Band(factor=1.5, share=0.75), Band(factor=3.0, share=0.25)]
    task = with_rubric(BARE, tolerance=ToleranceTable(bands=bands))
    reading = measured(task)
    length = reading.figures["acceleration_plan"].vectors["a_BA_t"].length_mm
    for off_mm, share in ((0.9, 1.0), (1.4, 0.75), (2.9, 0.25), (3.1, 0.0)):
        longer = changed(reading, "a_BA_t", length_mm=length + off_mm)
        assert outcome_of(compare(task, Submission(measured=longer)), "a_BA_t").shares == (share, share)


def test_a_tolerance_is_wider_where_small_errors_add_up_and_says_so():
    reading = measured(PUMP, directions=False)
    length = reading.figures["acceleration_plan"].vectors["a_D"].length_mm
    allowed = outcome_of(compare(PUMP, Submission(measured=reading)), "a_D").tolerance
    assert not allowed.widened
    longer = changed(reading, "a_D", length_mm=length + 1.5 * allowed.length_mm)
    outcome = outcome_of(compare(PUMP, Submission(measured=longer)), "a_D")
    assert outcome.verdict == "full"
    assert outcome.tolerance.widened
    assert 1.5 * allowed.length_mm < outcome.tolerance.length_mm
    assert outcome.tolerance.length_mm <= PUMP.rubric.hand.at_most * allowed.length_mm * (1.0 + ROUNDING)


@pytest.mark.parametrize(
    ("others", "verdict"),
    [
        ([], "review"),
        ([(75.0, 0.98)], "none"),
        ([(75.0, 0.8), (90.0, 0.98)], "none"),
        ([(75.0, 0.8)], "review"),
        ([(None, 0.98)], "review"),
    ],
)
def test_a_doubtful_vector_is_charged_where_it_is_wrong_whichever_was_drawn(others, verdict):
    read = sheet(PUMP, rule_scales(PUMP))
    vector = read.figures["velocity_plan"].vectors["v_C"]
    told = tuple(
        OtherReading(vector.length_mm if mm is None else mm, vector.direction_deg, confidence)
        for mm, confidence in others
    )
    doubtful = changed(read, "v_C", length_mm=vector.length_mm + 20.0, confidence=0.6, others=told)
    outcome = outcome_of(compare(PUMP, Submission(readings=(doubtful,), declared=DECLARED)), "v_C")
    assert outcome.verdict == verdict


def test_what_a_careful_hand_may_miss_beyond_that_goes_to_a_person():
    task = task_for("pump-230", 29)
    reading = measured(task, directions=False)
    length = reading.figures["acceleration_plan"].vectors["a_D"].length_mm
    longer = changed(reading, "a_D", length_mm=length + 10.0)
    outcome = outcome_of(compare(task, Submission(measured=longer)), "a_D")
    assert (outcome.verdict, codes(outcome)[0]) == ("review", "hand_may_miss")
    gone = changed(reading, "a_D", length_mm=length + 40.0)
    assert outcome_of(compare(task, Submission(measured=gone)), "a_D").verdict == "none"


# What standard errors leave open ------------------------------------------------------------------


BEYOND, WITHIN = 0.06, -0.06
"""Distances from a limit, less than 1.645 standard errors of 0.1 mm."""


@pytest.mark.parametrize(
    ("in_doubt", "off_mm", "verdict", "said"),
    [
        ("student", BEYOND, "full", "counted_for_you"),
        ("student", WITHIN, "full", None),
        ("person", BEYOND, "review", "near_limit"),
        ("person", WITHIN, "review", "near_limit"),
        ("strict", BEYOND, "partial", None),
        ("strict", WITHIN, "partial", "not_certainly_within"),
    ],
)
def test_what_straddles_a_limit_is_decided_by_the_rule_of_the_rubric(in_doubt, off_mm, verdict, said):
    task = with_rubric(BARE, doubt=DoubtTable(in_doubt=in_doubt))
    limit_mm = 60.0 + task.rubric.tolerance_of("v_A").length_at(60.0)
    longer = changed(measured(task), "v_A", length_mm=limit_mm + off_mm, se_mm=0.1)
    outcome = outcome_of(compare(task, Submission(measured=longer)), "v_A")
    assert outcome.verdict == verdict
    rules = {"counted_for_you", "not_certainly_within", "near_limit"}
    assert rules & set(codes(outcome)) == ({said} if said else set())


def test_what_straddles_the_limit_of_partial_marks_is_not_called_nearly_right():
    table = BARE.rubric.tolerance_of("v_A")
    limit_mm = 60.0 + table.all_bands[-1][0] * table.length_at(60.0)
    longer = changed(measured(BARE), "v_A", length_mm=limit_mm + BEYOND, se_mm=0.1)
    outcome = outcome_of(compare(BARE, Submission(measured=longer)), "v_A")
    assert (outcome.verdict, codes(outcome)) == ("partial", ["too_long"])


def test_an_error_that_cannot_change_the_verdict_does_not():
    longer = changed(measured(PUMP), "v_A", length_mm=61.1, se_mm=0.04)
    assert outcome_of(compare(PUMP, Submission(measured=longer)), "v_A").verdict == "full"


@pytest.mark.parametrize("name", ["v_A", "a_CA_n"])
@pytest.mark.parametrize(("confidence", "verdict"), [(0.49, "review"), (0.5, "full"), (0.8, "full")])
def test_a_doubtful_reading_that_lies_where_it_must_is_right_unless_it_is_likelier_another_stroke(
    name, confidence, verdict
):
    doubtful = changed(measured(PUMP), name, confidence=confidence)
    outcome = outcome_of(compare(PUMP, Submission(measured=doubtful)), name)
    assert outcome.verdict == verdict
    assert PUMP.rubric.doubt.settle <= outcome.probability < 1.0


def test_a_doubtful_reading_that_is_off_goes_to_a_person():
    doubtful = changed(measured(PUMP), "v_A", confidence=0.8, length_mm=50.0)
    outcome = outcome_of(compare(PUMP, Submission(measured=doubtful)), "v_A")
    assert outcome.verdict == "review"
    assert outcome.possible == ("none", "full")
    assert codes(outcome)[0] == "doubtful"


# What is not there --------------------------------------------------------------------------------


@pytest.mark.parametrize("missing", ["review", "none", "not_judged"])
def test_what_was_not_handed_in_is_as_the_rubric_says(missing):
    task = with_rubric(PUMP, missing=missing)
    outcome = outcome_of(compare(task, Submission(measured=without(measured(task), "v_D"))), "v_D")
    # A blank in a table leaves nothing to look at.
    assert outcome.verdict == ("none" if missing == "review" else missing)
    assert codes(outcome) == ["not_measured"]


def test_what_is_optional_is_not_judged_where_it_is_not_there():
    comparison = compare(PUMP, Submission(measured=without(measured(PUMP), "v_CA")))
    assert outcome_of(comparison, "v_CA").verdict == "not_judged"
    assert outcome_of(comparison, "omega_3").verdict == "not_judged"


def test_a_scale_that_is_asked_for_and_not_declared_is_missing():
    task = with_criterion(PUMP, "kv", optional=False)
    assert outcome_of(compare(task, Submission(measured=measured(task))), "kv").verdict == "none"
    assert outcome_of(compare(task, Submission(readings=(sheet(task),))), "kv").verdict == "review"


def test_a_vector_too_short_to_draw_is_not_asked_for():
    outcome = outcome_of(compare(DEAD, Submission(measured=without(measured(DEAD), "v_D"))), "v_D")
    assert outcome.verdict == "not_judged"


@pytest.mark.parametrize("named", ["v_D", "d"])
def test_what_was_not_read_goes_to_a_person_with_the_reason(named):
    reading = replace(without(sheet(PUMP), "v_D"), unread=(Unread(named, Reason("torn_off")),))
    outcome = outcome_of(compare(PUMP, Submission(readings=(reading,))), "v_D")
    assert outcome.verdict == "review"
    assert outcome.reasons[0].parameters["why"] == "torn_off"


def entered(task, name, *change, **values):
    """All vectors measured, with something that was entered for a name refused."""
    reading = change[0] if change else measured(task)
    return Submission(
        measured=replace(reading, unread=(Unread(name, Reason("entry", {"entries": (f"{name}: 'x'",)})),)),
        **values,
    )


def test_a_vector_of_which_the_direction_was_refused_waits_for_a_person():
    lengths = changed(measured(PUMP), "v_B", direction_deg=None)
    comparison = compare(PUMP, entered(PUMP, "v_B", lengths))
    outcome = outcome_of(comparison, "v_B")
    assert (outcome.verdict, outcome.possible, outcome.shares) == ("review", ("none", "full"), (0.0, 1.0))
    assert outcome.reasons[0].parameters["entries"] == ("v_B: 'x'",)
    assert lost(comparison) == ["v_B"]


def test_a_vector_of_which_the_length_was_refused_waits_although_the_rubric_gives_nothing_for_it():
    task = with_rubric(PUMP, missing="none")
    outcome = outcome_of(compare(task, entered(task, "v_D", without(measured(task), "v_D"))), "v_D")
    assert (outcome.verdict, codes(outcome)) == ("review", ["entry_refused"])


@pytest.mark.parametrize("name", ["v_CA", "omega_3", "kv"])
def test_what_is_optional_waits_where_something_was_entered_and_refused(name):
    comparison = compare(PUMP, entered(PUMP, name, without(measured(PUMP), name)))
    assert codes(outcome_of(comparison, name)) == ["entry_refused"]
    assert lost(comparison) == [name]


def test_what_follows_from_a_vector_that_was_refused_is_open():
    wrong = measured(PUMP, mistakes=(Mistake("sense_reversed", "a"),))
    turned = changed(wrong, "v_A", direction_deg=None)
    known, refused = compare(PUMP, Submission(measured=wrong)), compare(PUMP, entered(PUMP, "v_A", turned))
    assert outcome_of(known, "v_A").verdict == "none"
    assert outcome_of(known, "v_B").verdict == "follow_through"
    assert outcome_of(refused, "v_A").verdict == outcome_of(refused, "v_B").verdict == "review"


def test_what_is_lost_at_a_disputed_scale_waits_and_what_is_right_does_not():
    long = changed(measured(PUMP), "v_D", length_mm=1.2 * abs(PUMP.segments["v_D"].drawn(rule_scales(PUMP))))
    comparison = compare(PUMP, entered(PUMP, "kv", long))
    assert lost(comparison) == ["kv", "v_D"]
    assert {outcome_of(comparison, name).verdict for name in ("kv", "v_D")} == {"review"}


def test_a_plan_that_is_on_no_sheet_goes_to_a_person():
    reading = sheet(PUMP, figures=("mechanism", "velocity_plan"))
    outcome = outcome_of(compare(PUMP, Submission(readings=(reading,))), "a_D")
    assert outcome.verdict == "review"
    assert codes(outcome) == ["unread"]


# Values -------------------------------------------------------------------------------------------


def test_a_wrong_value_beside_a_right_drawing_is_arithmetic():
    value = abs(PUMP.real["v_B"])
    comparison = compare(PUMP, Submission(measured=measured(PUMP), values={"v_B": 1.3 * value}))
    outcome = outcome_of(comparison, "v_B")
    assert outcome.verdict == "partial"
    assert outcome.mistake == "arithmetic"
    assert codes(outcome)[0] == "value_too_large"
    assert outcome.measured.value == pytest.approx(1.3 * value)


@pytest.mark.parametrize("factor", [2.0, 30.0 / math.pi, 0.1])
@pytest.mark.parametrize("segments", [True, False], ids=["with segments", "values alone"])
def test_a_factor_in_all_values_costs_once(factor, segments):
    names = [name for name, vector in PUMP.construction.vectors.items() if vector.scale == "kv"]
    values = {name: factor * abs(PUMP.real[name]) for name in names}
    values |= {f"omega_{k}": factor * PUMP.rates[f"omega_{k}"] for k in (2, 3, 4)}
    reading = measured(PUMP) if segments else without(measured(PUMP), *names)
    task = with_rubric(PUMP, values_alone=True)
    found = verdicts(compare(task, Submission(measured=reading, values=values)))
    off = [name for name in values if found[name] in {"none", "partial"}]
    assert len(off) == 1
    assert off[0] in names


def test_two_values_off_by_one_factor_are_two_slips():
    values = {name: 2.0 * abs(PUMP.real[name]) for name in ("v_B", "v_C")}
    found = verdicts(compare(PUMP, Submission(measured=measured(PUMP), values=values)))
    assert found["v_B"] == found["v_C"] == "partial"


@pytest.mark.parametrize(("factor", "verdict", "mistake"), [(1.0, "full", None), (1.3, "none", "arithmetic")])
def test_a_value_with_a_criterion_of_its_own_costs_there_and_nowhere_else(factor, verdict, mistake):
    values = {"v_D": factor * abs(PUMP.real["v_D"])}
    comparison = compare(PUMP, Submission(measured=measured(PUMP), values=values))
    outcome = outcome_of(comparison, "v_D_value")
    assert (outcome.verdict, outcome.mistake) == (verdict, mistake)
    assert lost(comparison) == ([] if factor == 1.0 else ["v_D_value"])
    # The page shows the drawn vector's own value beside it.
    assert outcome_of(comparison, "v_D").measured.value == pytest.approx(abs(PUMP.real["v_D"]), rel=0.01)


@pytest.mark.parametrize("scale", [1.0, 1.1], ids=["scale of the rule", "own scale"])
def test_a_value_follows_from_the_own_segment_and_the_own_scale(scale):
    own = {**rule_scales(PUMP), "kv": scale * rule_scales(PUMP)["kv"]}
    reading = changed(measured(PUMP, own), "v_D", length_mm=70.0)
    declared = {name: f"{value!r} {UNITS[name]}" for name, value in own.items()}
    values = {"v_D": 70.0 * own["kv"]}
    comparison = compare(PUMP, Submission(measured=reading, values=values, declared=declared))
    outcome = outcome_of(comparison, "v_D_value")
    assert lost(comparison) == ["v_D", "v_D_value"]
    assert (outcome.verdict, codes(outcome)) == ("follow_through", ["follows", "value_too_large"])
    strict = compare(with_criterion(PUMP, "v_D_value", follow_through=False), Submission(
        measured=reading, values=values, declared=declared))  # fmt: skip
    assert outcome_of(strict, "v_D_value").verdict == "none"


def test_a_value_beside_its_own_segment_does_not_follow_from_another_node():
    turned = measured(PUMP).figures["velocity_plan"].vectors["v_C"].direction_deg + 30.0
    reading = without(changed(measured(PUMP), "v_C", direction_deg=turned), "v_CA", "v_CB")
    for given, verdict in ((reading, "none"), (without(reading, "v_D"), "follow_through")):
        found = verdicts(compare(PUMP, Submission(measured=given, values={"v_D": 7.95})))
        assert found["v_D_value"] == verdict


def test_what_was_drawn_after_a_mistyped_entry_is_judged_by_the_vectors_that_agree():
    reading = changed(measured(PUMP), "v_C", length_mm=5.0)
    assert lost(compare(PUMP, Submission(measured=reading))) == ["v_C"]


def test_values_follow_from_the_drawing_and_not_from_a_mistyped_entry():
    """The crank's vector is reversed, and so is the drawing; one of its vectors is written tenfold."""
    reversed_deg = {
        name: one.direction_deg + 180.0
        for name, one in measured(PUMP).figures["velocity_plan"].vectors.items()
    }
    reading = measured(PUMP)
    for name, turned in reversed_deg.items():
        reading = changed(reading, name, direction_deg=turned % 360.0)
    values = {"omega_4": -PUMP.rates["omega_4"], "v_D": abs(PUMP.segments["v_D"].real)}
    for name in ("v_DC", "v_D"):
        length = reading.figures["velocity_plan"].vectors[name].length_mm
        found = verdicts(compare(PUMP, Submission(
            measured=changed(reading, name, length_mm=10.0 * length), values=values)))  # fmt: skip
        assert (found[name], found["omega_4"], found["v_D_value"]) == ("none", "follow_through", "full")


def test_a_value_without_its_segment_earns_what_is_asked_of_the_value():
    reading = without(measured(PUMP), "v_D")
    found = verdicts(compare(PUMP, Submission(measured=reading, values={"v_D": abs(PUMP.real["v_D"])})))
    assert (found["v_D"], found["v_D_value"]) == ("none", "full")


def test_who_gives_no_values_has_the_share_of_the_score_that_they_had():
    plain = with_rubric(PUMP, criterion=[one for one in PUMP.rubric.criterion if one.value is None])
    submission = Submission(measured=changed(measured(PUMP), "v_D", length_mm=70.0))
    shares = [judge(task, submission).score.total / task.rubric.max_score for task in (plain, PUMP)]
    assert shares[0] < 1.0
    assert shares[1] == pytest.approx(shares[0], abs=1e-6)


def test_an_unusable_value_is_open_where_it_is_asked_for_and_nowhere_else():
    gap = Unread("v_D", Reason("entry", {"entries": ("v_D_value: 'x'",)}))
    reading = replace(measured(PUMP), unread=(gap,))
    assert lost(compare(PUMP, Submission(measured=reading))) == ["v_D_value"]


@pytest.mark.parametrize(
    ("factor", "sure", "verdict"),
    [
        (1.0, 0.999, "full"),
        (1.3, 0.999, "review"),
        (1.3, 0.9, "review"),
        (1.3, 0.4, "review"),
        (1.0, 0.0, "review"),
    ],
)
def test_a_value_in_a_sheets_cells_that_is_off_or_unsure_waits_for_a_person(factor, sure, verdict):
    written = {"v_D_value": (factor * abs(PUMP.real["v_D"]), sure)}
    reading = replace(sheet(PUMP), lengths=written)
    comparison = compare(PUMP, Submission(readings=(reading,), declared=DECLARED))
    assert outcome_of(comparison, "v_D_value").verdict == verdict
    assert set(lost(comparison)) <= {"v_D_value", *PUMP.construction.rates}


def test_a_value_in_the_cells_says_nothing_of_a_vector_that_could_not_be_read():
    reading = replace(without(sheet(PUMP), "v_D"), lengths={"v_D_value": (abs(PUMP.real["v_D"]), 0.999)})
    found = verdicts(compare(PUMP, Submission(readings=(reading,), declared=DECLARED)))
    assert (found["v_D"], found["v_D_value"]) == ("review", "full")


def test_a_value_right_by_the_own_wrong_drawing_costs_nothing_more():
    longer = changed(measured(PUMP), "v_D", length_mm=70.0)
    value = 70.0 * rule_scales(PUMP)["kv"]
    comparison = compare(PUMP, Submission(measured=longer, values={"v_D": value}))
    outcome = outcome_of(comparison, "v_D")
    assert codes(outcome)[0] in {"too_long", "too_short"}
    assert not [code for code in codes(outcome) if code.startswith("value")]
    assert outcome.mistake is None


@pytest.mark.parametrize(
    ("factor", "verdict", "code"),
    [
        (1.0, "full", "right"),
        (-1.0, "full", "right"),
        (1.03, "partial", "value_too_large"),
        (0.5, "none", "value_too_small"),
    ],
)
def test_a_value_alone_is_judged_where_the_rubric_says_so(factor, verdict, code):
    task = with_rubric(PUMP, missing="not_judged", values_alone=True)
    value = factor * abs(PUMP.real["v_A"])
    outcome = outcome_of(compare(task, Submission(values={"v_A": value})), "v_A")
    assert outcome.verdict == verdict
    assert codes(outcome)[0] == code


@pytest.mark.parametrize(("factor", "result"), [(1.0, "right"), (0.5, "off")])
def test_a_value_without_its_drawn_vector_has_no_points_and_is_still_checked(factor, result):
    values = {name: factor * abs(PUMP.real[name]) for name in ("v_D", "a_D")}
    reading = without(measured(PUMP), "v_D", "a_D")
    judgement = judge(PUMP, Submission(measured=reading, values=values))
    for name in values:
        outcome = next(one for one in judgement.outcomes if one.name == name)
        assert outcome.verdict == "none"
        assert codes(outcome)[0] == "value_alone"
        assert judgement.score.points[name] == 0.0
    checked = {one.name: one.result for one in checked_values(judgement, "symbol")}
    assert checked["v_D"] == checked["a_D"] == result


@pytest.mark.parametrize(
    ("factor", "verdict", "code"),
    [(1.0, "full", "right"), (-1.0, "none", "value_reversed"), (1.3, "none", "value_too_large")],
)
def test_an_angular_velocity_has_its_sign(factor, verdict, code):
    values = {"omega_3": factor * PUMP.rates["omega_3"]}
    outcome = outcome_of(compare(PUMP, Submission(measured=measured(PUMP), values=values)), "omega_3")
    assert outcome.verdict == verdict
    assert codes(outcome)[0] == code
    assert outcome.expected.unit == "rad/s"


# Following through --------------------------------------------------------------------------------


WRONG_B = Mistake("wrong_link", "b", 1, other=("C", "D"))


def test_what_follows_rightly_from_a_wrong_node_has_full_marks():
    reading = measured(PUMP, mistakes=(WRONG_B,))
    comparison = compare(PUMP, Submission(measured=reading))
    found = verdicts(comparison)
    # The line of v_B is the wrong one; v_BA lies on its own line, as far as that.
    assert {name for name, verdict in found.items() if verdict == "none"} == {"v_B"}
    assert found["v_BA"] == found["v_C"] == found["v_D"] == found["a_BA_n"] == "follow_through"
    assert outcome_of(comparison, "v_C").reasons[0].code == "follows"


def test_a_rubric_may_leave_following_through_out():
    task = with_rubric(PUMP, follow_through=False)
    comparison = compare(task, Submission(measured=measured(task, mistakes=(WRONG_B,))))
    assert "follow_through" not in verdicts(comparison).values()


def test_a_reversed_velocity_costs_once():
    reading = measured(PUMP, mistakes=(Mistake("sense_reversed", "a"),))
    assert [n for n, v in verdicts(compare(PUMP, Submission(measured=reading))).items() if v == "none"] == [
        "v_A"
    ]


@pytest.mark.parametrize("quarters", [1, 2, 3])
@pytest.mark.parametrize("plan", ["velocity_plan", "acceleration_plan"])
def test_a_plan_turned_as_a_whole_costs_once(plan, quarters):
    reading = measured(PUMP, mistakes=(Mistake("figure_rotated", plan, quarters=quarters),))
    comparison = compare(PUMP, Submission(measured=reading))
    none = [
        name for name, verdict in verdicts(comparison).items() if verdict in {"none", "partial", "review"}
    ]
    assert none == ["v_A" if plan == "velocity_plan" else "a_A"]


def test_a_crooked_plan_is_no_turned_one():
    reading = measured(PUMP)
    for name in PUMP.construction.vectors:
        if name.startswith("v"):
            degrees = reading.figures["velocity_plan"].vectors[name].direction_deg
            reading = changed(reading, name, direction_deg=(degrees + 70.0) % 360.0)
    found = verdicts(compare(PUMP, Submission(measured=reading)))
    assert found["v_D"] == "none"


def asking_for_no_link(task):
    criteria = [one for one in task.rubric.criterion if one.link is None]
    return with_rubric(task, criterion=criteria)


def test_another_assembly_costs_the_link_that_is_drawn_so_and_nothing_else():
    reading = sheet(PUMP, mistakes=(Mistake("other_assembly", "D"),))
    comparison = compare(PUMP, Submission(readings=(reading,)))
    assert [n for n, verdict in verdicts(comparison).items() if verdict in {"none", "partial"}] == ["CD"]
    assert outcome_of(comparison, "v_D").verdict == outcome_of(comparison, "v_DC").verdict == "follow_through"


def test_another_assembly_costs_once_although_no_criterion_is_the_mechanism():
    task = asking_for_no_link(PUMP)
    reading = sheet(task, mistakes=(Mistake("other_assembly", "D"),))
    comparison = compare(task, Submission(readings=(reading,)))
    none = [name for name, verdict in verdicts(comparison).items() if verdict == "none"]
    assert none == ["v_D"]
    assert outcome_of(comparison, "v_DC").verdict == "follow_through"
    assert outcome_of(comparison, "v_DC").reasons[0].parameters["of"] in {"mechanism", "v_D"}


def test_a_normal_component_follows_from_the_own_velocity_by_its_length_alone():
    reading = measured(PUMP, directions=False, mistakes=(Mistake("wrong_link", "d", 0, other=("A", "B")),))
    comparison = compare(PUMP, Submission(measured=reading))
    assert outcome_of(comparison, "v_DC").verdict == "none"
    outcome = outcome_of(comparison, "a_DC_n")
    assert outcome.verdict == "follow_through"
    assert outcome.reasons[0].parameters["of"] == "v_DC"


@pytest.mark.parametrize("directions", [True, False])
def test_an_image_on_a_line_follows_from_its_base(directions):
    reading = changed(measured(PRESS, directions=directions), "v_B", length_mm=40.0)
    reading = changed(reading, "v_C", length_mm=80.0)
    outcome = outcome_of(compare(PRESS, Submission(measured=reading)), "v_C")
    assert outcome.verdict == "follow_through"


@pytest.mark.parametrize(("task", "source", "name"), [(PUMP, "v_DC", "a_DC_n"), (PRESS, "v_B", "v_C")])
def test_nothing_follows_from_what_is_not_there(task, source, name):
    reading = changed(without(measured(task, directions=False), source), name, length_mm=99.0)
    assert outcome_of(compare(without_hand(task), Submission(measured=reading)), name).verdict == "none"


def test_nothing_follows_from_own_nodes_that_determine_nothing():
    nodes = drawn_nodes(PUMP)
    folded = sheet(PUMP, moved={"D": nodes["C"] - nodes["D"], "d": 20j})
    assert outcome_of(compare(PUMP, Submission(readings=(folded,))), "v_D").verdict == "none"


def doubled(extra_mm=0.0):
    """v_B too long within its tolerance, and v_C, twice v_B, with it; an own error beside."""
    task = min((task_for("press", position=p) for p in range(1, 4)), key=lambda task: abs(task.real["v_B"]))
    reading = measured(task, directions=False)
    vectors = reading.figures["velocity_plan"].vectors
    reading = changed(reading, "v_B", length_mm=vectors["v_B"].length_mm + 0.9)
    return task, changed(reading, "v_C", length_mm=vectors["v_C"].length_mm + 1.8 + extra_mm)


def test_errors_within_tolerance_that_add_up_in_a_later_node_cost_nothing():
    task, reading = doubled()
    outcome = outcome_of(compare(task, Submission(measured=reading)), "v_C")
    assert outcome.verdict == "full"
    assert codes(outcome) == ["right"]
    strict = without_hand(with_rubric(task, follow_through=False))
    assert outcome_of(compare(strict, Submission(measured=reading)), "v_C").verdict == "partial"


def test_an_error_of_its_own_is_not_excused_by_a_small_earlier_one():
    task, reading = doubled(extra_mm=1.5)
    assert outcome_of(compare(without_hand(task), Submission(measured=reading)), "v_C").verdict == "partial"


def test_an_error_at_the_crank_is_not_excused_by_a_wrong_mechanism():
    reading = sheet(PUMP, moved={"A": 8.0 + 0j, "a": 8.0 + 0j})
    assert outcome_of(compare(PUMP, Submission(readings=(reading,))), "v_A").verdict == "none"


def test_a_loss_is_open_while_what_it_may_follow_from_is_not_known():
    reading = sheet(PUMP, moved={"d": 6.0 + 0j, "c": 9.0 + 7j})
    plan = reading.figures["velocity_plan"]
    doubtful = {**plan.nodes, "c": replace(plan.nodes["c"], confidence=0.4)}
    unsure = {name: replace(plan.vectors[name], confidence=0.4) for name in ("v_C", "v_CA", "v_CB", "v_DC")}
    figures = {**reading.figures, "velocity_plan": Figure(doubtful, {**plan.vectors, **unsure})}
    comparison = compare(PUMP, Submission(readings=(replace(reading, figures=figures),)))
    outcome = outcome_of(comparison, "v_D")
    assert outcome.verdict == "review"
    assert outcome.possible == ("none", "follow_through")
    known = outcome.reasons[-1].parameters
    assert known["why"] == "upstream_unsure"
    assert "c" in known["nodes"]
    certain = compare(PUMP, Submission(readings=(reading,)))
    # The other line, of v_DC, is the wrong one: the guide is right.
    assert outcome_of(certain, "v_DC").verdict == "none"
    assert outcome_of(certain, "v_D").verdict == "follow_through"


def test_a_computed_length_is_charged_only_while_the_velocity_is_certain_that_it_is_computed_from():
    reading = sheet(PUMP, moved={"c": 9.0 + 7j, "n_DC": 9.0 + 0j})
    plan = reading.figures["velocity_plan"]
    unsure = {name: replace(plan.vectors[name], confidence=0.8) for name in ("v_C", "v_CA", "v_CB", "v_DC")}
    figures = {**reading.figures, "velocity_plan": Figure(plan.nodes, {**plan.vectors, **unsure})}
    open_ = outcome_of(compare(PUMP, Submission(readings=(replace(reading, figures=figures),))), "a_DC_n")
    assert (open_.verdict, open_.reasons[-1].parameters["nodes"]) == ("review", ("c", "d"))
    assert outcome_of(compare(PUMP, Submission(readings=(reading,))), "a_DC_n").verdict == "none"


def test_a_loss_is_open_while_nothing_of_the_plan_that_it_follows_from_was_read_for_certain():
    reading = sheet(PUMP, moved={"n_BA": 9.0 + 0j})
    assert outcome_of(compare(PUMP, Submission(readings=(reading,))), "a_BA_n").verdict == "none"
    for name, one in reading.figures["velocity_plan"].vectors.items():
        reading = changed(reading, name, confidence=0.4, length_mm=one.length_mm + 30.0)
    plan = reading.figures["velocity_plan"]
    unsure = {name: replace(node, confidence=0.4) for name, node in plan.nodes.items()}
    figures = {**reading.figures, "velocity_plan": Figure(unsure, plan.vectors)}
    outcome = outcome_of(compare(PUMP, Submission(readings=(replace(reading, figures=figures),))), "a_BA_n")
    assert (outcome.verdict, set(outcome.reasons[-1].parameters["nodes"])) == ("review", {"a", "b"})


def test_what_an_earlier_answer_makes_trivial_is_neither_credited_nor_charged():
    reading = measured(PUMP, directions=False)
    reading = changed(reading, "v_BA", length_mm=2.0)
    reading = changed(reading, "a_BA_n", length_mm=0.1)
    outcome = outcome_of(compare(PUMP, Submission(measured=reading)), "a_BA_n")
    assert (outcome.verdict, codes(outcome)) == ("not_judged", ["made_trivial"])


def test_a_value_from_a_vector_that_an_earlier_answer_makes_trivial_is_not_charged_again():
    reading = changed(measured(PUMP), "v_BA", length_mm=2.0)
    value = PUMP.rates["omega_3"] * 2.0 / abs(PUMP.segments["v_BA"].drawn(rule_scales(PUMP)))
    for entered, verdict in ((value, "not_judged"), (-3.0 * value, "none")):
        comparison = compare(PUMP, Submission(measured=reading, values={"omega_3": entered}))
        assert outcome_of(comparison, "omega_3").verdict == verdict


def test_no_vector_follows_the_opposite_way_because_its_own_length_is_just_too_short():
    by_length = {n: abs(task_for("press", position=n).real["a_BA_n"]) for n in range(8)}
    task = task_for("press", position=max(by_length, key=by_length.__getitem__))
    exact = abs(task.segments["a_BA_n"].drawn(rule_scales(task)))
    task = with_rubric(task, tolerance=task.rubric.tolerance.model_copy(update={"least_mm": exact - 0.01}))
    reading = measured(task)
    shorter = reading.figures["velocity_plan"].vectors["v_BA"].length_mm - 0.1
    drawn = reading.figures["acceleration_plan"].vectors["a_BA_n"]
    reading = changed(reading, "v_BA", length_mm=shorter)
    reading = changed(reading, "a_BA_n", direction_deg=(drawn.direction_deg + 180.0) % 360.0)
    assert outcome_of(compare(task, Submission(measured=reading)), "a_BA_n").verdict == "none"


def test_a_component_too_short_for_its_direction_is_charged_where_its_wrong_sense_shows():
    exact = abs(PUMP.segments["a_BA_n"].drawn(rule_scales(PUMP)))
    least = PUMP.rubric.tolerance.model_copy(update={"least_mm": exact + 1.0})
    task = with_rubric(PUMP, tolerance=least)
    reading = measured(task, mistakes=(Mistake("normal_reversed", "n_BA"),))
    comparison = compare(task, Submission(measured=reading))
    assert outcome_of(comparison, "a_BA_n").verdict == "full"
    assert len([one for one in verdicts(comparison).values() if one in {"none", "partial"}]) == 1


def test_what_hangs_on_a_doubtful_node_is_doubtful_too():
    reading = measured(PUMP, mistakes=(WRONG_B,))
    reading = changed(changed(reading, "v_B", confidence=0.5), "v_BA", confidence=0.5)
    outcome = outcome_of(compare(PUMP, Submission(measured=reading)), "v_C")
    assert outcome.verdict == "review"
    assert outcome.possible[0] == "none"


def test_an_angular_velocity_follows_from_the_own_vector():
    reading = measured(PUMP, mistakes=(WRONG_B,))
    own = reading.figures["velocity_plan"].vectors["v_BA"].length_mm
    per_mm = rule_scales(PUMP)["kv"] / 0.4
    for sign, verdict in ((1.0, "follow_through"), (-1.0, "partial")):
        # The wrong line reverses v_BA here or not: its own sense counts. A number without a sign has none.
        right = PUMP.rates["omega_3"]
        values = {"omega_3": sign * own * per_mm * own_sense(reading) * (1 if right > 0 else -1)}
        outcome = outcome_of(compare(PUMP, Submission(measured=reading, values=values)), "omega_3")
        assert outcome.verdict == verdict


def own_sense(reading):
    drawn = math.radians(reading.figures["velocity_plan"].vectors["v_BA"].direction_deg)
    return math.copysign(1.0, math.cos(drawn - cmath.phase(PUMP.real["v_BA"])))


@pytest.mark.parametrize("length", [None, 1.0])
def test_an_angular_velocity_follows_from_no_vector_and_from_none_that_is_trivial(length):
    reading = (
        without(measured(PUMP), "v_BA") if length is None else changed(measured(PUMP), "v_BA", length_mm=1.0)
    )
    values = {"omega_3": 0.5 * PUMP.rates["omega_3"]}
    comparison = compare(PUMP, Submission(measured=reading, values=values))
    assert outcome_of(comparison, "omega_3").verdict == "none"


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_an_angular_velocity_follows_in_either_sense_from_the_length_of_a_wrong_vector(sense):
    reading = measured(PUMP, directions=False, mistakes=(WRONG_B,))
    own = reading.figures["velocity_plan"].vectors["v_BA"].length_mm
    value = sense * own * rule_scales(PUMP)["kv"] / 0.4
    comparison = compare(PUMP, Submission(measured=reading, values={"omega_3": value}))
    assert outcome_of(comparison, "omega_3").verdict == "follow_through"


# Sheets -------------------------------------------------------------------------------------------


@pytest.mark.parametrize("turn_deg", [0.0, 12.0, 90.0, -35.0])
def test_a_sketch_turned_on_its_sheet_is_legitimate(turn_deg):
    comparison = compare(PUMP, Submission(readings=(sheet(PUMP, turn_deg=turn_deg),)))
    assert lost(comparison) == []
    outcome = outcome_of(comparison, "v_A")
    assert outcome.expected.direction_deg == pytest.approx((134.0 + turn_deg) % 360.0)
    assert outcome.measured.direction_deg == pytest.approx((134.0 + turn_deg) % 360.0)


def test_a_plan_turned_against_its_mechanism_is_not():
    upright, turned = sheet(PUMP), sheet(PUMP, turn_deg=10.0)
    reading = Reading({**turned.figures, "mechanism": upright.figures["mechanism"]})
    assert outcome_of(compare(PUMP, Submission(readings=(reading,))), "v_A").verdict == "none"


def test_without_a_mechanism_the_sheets_own_axis_counts():
    reading = sheet(PUMP, turn_deg=10.0, figures=("velocity_plan", "acceleration_plan"))
    assert outcome_of(compare(PUMP, Submission(readings=(reading,))), "v_A").verdict == "none"


def test_two_sheets_each_have_their_own_turn():
    first = sheet(PUMP, turn_deg=5.0, figures=("mechanism", "velocity_plan"))
    second = sheet(PUMP, turn_deg=-8.0, figures=("mechanism", "acceleration_plan"))
    assert lost(compare(PUMP, Submission(readings=(first, second)))) == []


def test_of_a_plan_on_two_sheets_the_surer_reading_counts():
    wrong = changed(sheet(PUMP, confidence=0.95), "v_D", length_mm=99.0)
    for order in ((wrong, sheet(PUMP)), (sheet(PUMP), wrong)):
        assert outcome_of(compare(PUMP, Submission(readings=order)), "v_D").verdict == "full"


def test_scan_and_measurement_that_agree_are_one():
    comparison = compare(PUMP, Submission(readings=(sheet(PUMP),), measured=measured(PUMP)))
    assert lost(comparison) == []
    assert codes(outcome_of(comparison, "v_D")) == ["right"]


def test_scan_and_measurement_that_differ_within_a_verdict_are_told():
    entered = changed(
        measured(PUMP),
        "a_DC_n",
        length_mm=measured(PUMP).figures["acceleration_plan"].vectors["a_DC_n"].length_mm - 0.9,
    )
    drawn = sheet(PUMP, se_mm=0.001)
    drawn = changed(
        drawn, "a_DC_n", length_mm=drawn.figures["acceleration_plan"].vectors["a_DC_n"].length_mm + 0.9
    )
    outcome = outcome_of(compare(PUMP, Submission(readings=(drawn,), measured=entered)), "a_DC_n")
    assert outcome.verdict == "full"
    assert "readings_disagree" in codes(outcome)


def test_scan_and_measurement_of_different_verdicts_go_to_a_person():
    entered = changed(measured(PUMP), "v_D", length_mm=99.0)
    outcome = outcome_of(compare(PUMP, Submission(readings=(sheet(PUMP),), measured=entered)), "v_D")
    assert outcome.verdict == "review"
    assert outcome.possible == ("none", "full")
    assert codes(outcome)[0] == "readings_disagree"


# The search for what was done ---------------------------------------------------------------------


def searches(task, reading):
    """The number of times that a comparison asks for a search."""
    asked = []

    def explain(*case):
        asked.append(case)
        return ReplayResult()

    compare(task, Submission(measured=reading), explain)
    return len(asked)


def test_a_right_drawing_needs_no_search_for_what_was_done():
    assert searches(PUMP, measured(PUMP)) == 0
    assert searches(PUMP, measured(PUMP, directions=False)) == 0


def test_a_wrong_drawing_is_searched_once():
    two = (Mistake("sense_reversed", "a"), Mistake("normal_missing", "n_BA"))
    assert searches(PUMP, measured(PUMP, mistakes=two)) == 1


def test_what_follows_from_a_mechanism_that_the_search_is_sure_of_is_credited():
    wrong = {**PUMP.parameters, "AB": PUMP.parameters["AB"] * 0.85}
    drawn = Submission(measured=measured(replace(PUMP, parameters=wrong), directions=False))
    basis = PlanBasis("instead", PUMP.construction, wrong)
    unknown, known = compare(PUMP, drawn), compare(PUMP, drawn, lambda *_case: ReplayResult(basis=basis))
    credited = [list(verdicts(one).values()).count("follow_through") for one in (unknown, known)]
    assert credited[1] > credited[0] + 3


# Rubrics ------------------------------------------------------------------------------------------


def test_a_velocity_only_rubric_solves_no_accelerations():
    assignment = load_assignment("pump")
    task = task_of(assignment, load_rubric("pump-velocity"), assignment.variant(7))
    assert "acceleration_plan" not in task.construction.figures
    reading = measured(task)
    assert lost(compare(task, Submission(measured=reading))) == []


def test_a_criterion_may_have_its_own_tolerance():
    wide = PUMP.rubric.tolerance.model_copy(update={"length_mm": 5.0})
    task = with_criterion(PUMP, "a_BA_t", tolerance=wide)
    reading = measured(task)
    length = reading.figures["acceleration_plan"].vectors["a_BA_t"].length_mm
    comparison = compare(task, Submission(measured=changed(reading, "a_BA_t", length_mm=length + 4.0)))
    assert outcome_of(comparison, "a_BA_t").verdict == "full"
    assert isinstance(task.rubric.criterion[0], CriterionTable)


def asking_for(task, name, **change):
    """The same task with one criterion more, for a vector."""
    title = task.rubric.criterion[0].title
    one = CriterionTable(id=name, vector=name, title=title, points=1.0, **change)
    return with_rubric(task, criterion=[*task.rubric.criterion, one])


def test_a_full_relative_acceleration_is_judged_by_itself_and_puts_nothing_else_in_doubt():
    task = asking_for(PUMP, "a_BA")
    reading = measured(task)
    assert lost(compare(task, Submission(measured=reading))) == []
    length = reading.figures["acceleration_plan"].vectors["a_BA"].length_mm
    wrong = changed(reading, "a_BA", length_mm=2.0 * length)
    assert lost(compare(task, Submission(measured=wrong))) == ["a_BA"]
    assert lost(compare(task, Submission(measured=without(reading, "a_BA")))) == ["a_BA"]
    left = compare(asking_for(PUMP, "a_BA", optional=True), Submission(measured=without(reading, "a_BA")))
    assert outcome_of(left, "a_BA").verdict == "not_judged"


def test_a_full_relative_acceleration_follows_from_the_students_own_components():
    task = asking_for(PUMP, "a_BA")
    reading = measured(task, mistakes=(Mistake("normal_reversed", "n_BA"),))
    comparison = compare(task, Submission(measured=reading))
    assert outcome_of(comparison, "a_BA_n").verdict == "none"
    assert outcome_of(comparison, "a_BA").verdict == "follow_through"


OWN_TOLERANCES = [
    (Mistake("wrong_link", "b", 1, other=("C", "D")),),
    (Mistake("normal_missing", "n_BA"), Mistake("sense_reversed", "a")),
    (Mistake("scale_wrong", "kv", factor=1.3),),
    (Mistake("figure_rotated", "velocity_plan", quarters=1),),
    (),
]


@pytest.mark.parametrize("mistakes", OWN_TOLERANCES)
@pytest.mark.parametrize("source", ["sheet", "directions"])
def test_nothing_asks_for_the_rubrics_tolerance_where_every_criterion_has_its_own(mistakes, source):
    usual = PUMP.rubric.tolerance
    unlike = ToleranceTable(length_mm=25.0, direction_deg=40.0, least_mm=30.0, scale_relative=0.6)
    asked = {one.name: one for one in PUMP.rubric.criterion}
    template = PUMP.rubric.criterion[0].model_dump() | {"vector": None, "link": None, "scale": None}
    names = {
        "vector": PUMP.construction.vectors,
        "link": PUMP.construction.links,
        "scale": ("kL", "kv", "ka"),
    }
    unasked = [
        CriterionTable.model_validate({**template, "id": f"also_{name}", kind: name, "optional": True})
        for kind, each in names.items()
        for name in each
        if name not in asked
    ]
    same = with_rubric(PUMP, criterion=[*PUMP.rubric.criterion, *unasked])
    each = [one.model_copy(update={"tolerance": usual}) for one in same.rubric.criterion]
    own = with_rubric(same, criterion=each, tolerance=unlike)
    if source == "sheet":
        handed_in = Submission(readings=(sheet(PUMP, mistakes=mistakes),), declared=DECLARED)
    else:
        handed_in = Submission(measured=measured(PUMP, mistakes=mistakes), declared=DECLARED)
    assert compare(own, handed_in).outcomes == compare(same, handed_in).outcomes


def test_a_scale_with_a_tolerance_of_its_own_is_held_against_the_drawing_by_it():
    drawn = measured(PUMP, scales={**rule_scales(PUMP), "kv": rule_scales(PUMP)["kv"] / 1.05})
    handed_in = Submission(measured=drawn, declared=DECLARED)
    assert outcome_of(compare(BARE, handed_in), "kv").verdict != "full"
    wide = PUMP.rubric.tolerance.model_copy(update={"length_relative": 0.08})
    assert outcome_of(compare(with_criterion(BARE, "kv", tolerance=wide), handed_in), "kv").verdict == "full"


# Readings that lack something ---------------------------------------------------------------------


def test_a_direction_without_a_length_is_no_measurement():
    reading = changed(measured(PUMP), "v_D", length_mm=None)
    assert outcome_of(compare(PUMP, Submission(measured=reading)), "v_D").verdict == "none"
    drawn = changed(sheet(PUMP), "v_D", length_mm=None)
    assert outcome_of(compare(PUMP, Submission(readings=(drawn,))), "v_D").verdict == "review"


def test_vectors_without_nodes_or_a_pole_are_judged_all_the_same():
    reading = sheet(PUMP)
    bare = Reading({plan: Figure({}, figure.vectors) for plan, figure in reading.figures.items()})
    assert lost(compare(PUMP, Submission(readings=(bare,)))) == []


def sketch_of(**nodes):
    return Figure({name: ReadNode(at, np.eye(2) * 1e-4, 0.99) for name, at in nodes.items()}, {})


@pytest.mark.parametrize(
    "sketch",
    [
        sketch_of(O1=100 - 90j),
        sketch_of(O1=100 - 90j, A=100 - 90j),
        sketch_of(O1=100 - 90j, B=103 - 90j),
        sketch_of(B=100 - 90j, C=150 - 90j),
    ],
)
def test_a_mechanism_read_in_part_tells_no_turn_and_breaks_nothing(sketch):
    plans = sheet(PUMP, figures=("velocity_plan", "acceleration_plan"))
    reading = Reading({**plans.figures, "mechanism": sketch})
    comparison = compare(PUMP, Submission(readings=(reading,)))
    assert comparison.scales["kL"].used == pytest.approx(0.005)


def test_pivots_alone_tell_the_turn_where_the_mechanism_is_a_wrong_one():
    reading = sheet(PUMP, turn_deg=20.0, mistakes=(Mistake("other_assembly", "B"),))
    comparison = compare(PUMP, Submission(readings=(reading,)))
    assert outcome_of(comparison, "v_A").verdict == "full"


# Senses of angular quantities ---------------------------------------------------------------------


@pytest.mark.parametrize(
    ("values", "share", "why"),
    [
        ({"omega_2": 1.0}, 0.5, "sense_missing"),
        ({"omega_2": -1.0}, 1.0, "right"),
        ({"omega_2": -1.0, "omega_2_sense": -1.0}, 1.0, "right"),
        ({"omega_2": 1.0, "omega_2_sense": 1.0}, 0.0, "value_reversed"),
        ({"omega_2": 1.5}, 0.0, "sense_missing"),
        ({"omega_2": 1.03}, 0.5, "sense_missing"),
    ],
)
def test_a_magnitude_without_its_sense_loses_only_the_sense(values, share, why):
    assert PRESS.rates["omega_2"] < 0.0
    size = abs(PRESS.rates["omega_2"])
    values = {name: value if name.endswith("_sense") else value * size for name, value in values.items()}
    outcome = outcome_of(compare(PRESS, Submission(values=values)), "omega_2")
    assert (outcome.shares, outcome.reasons[0].code) == ((share, share), why)


def test_a_sense_that_was_asked_for_and_left_blank_is_missing_whatever_the_sign():
    right = PRESS.rates["omega_1"]
    for sense, verdict in ((None, "full"), (0.0, "partial"), (1.0, "full")):
        values = {"omega_1": right} | ({} if sense is None else {"omega_1_sense": sense})
        assert outcome_of(compare(PRESS, Submission(values=values)), "omega_1").verdict == verdict


@pytest.mark.parametrize(
    ("values", "verdict"),
    [
        ({"omega_2_sense": -1.0}, "full"),
        ({"omega_2_sense": 1.0}, "none"),
        ({"omega_2": -9.0}, "full"),
        ({"omega_2": 9.0}, "none"),
        ({}, "none"),
    ],
)
def test_a_criterion_may_ask_for_the_sense_alone(values, verdict):
    asked = {"angular": None, "sense": "omega_2", "optional": False}
    task = with_criterion(PRESS, "omega_2", **asked)
    outcome = outcome_of(compare(task, Submission(values=values)), "omega_2")
    assert (outcome.name, outcome.verdict) == ("omega_2_sense", verdict)


def test_a_sense_follows_from_the_own_vector():
    task = with_criterion(PUMP, "omega_3", angular=None, sense="omega_3")
    reading = measured(task, mistakes=(WRONG_B,))
    sense = own_sense(reading) * math.copysign(1.0, PUMP.rates["omega_3"])
    outcome = outcome_of(
        compare(task, Submission(measured=reading, values={"omega_3_sense": sense})), "omega_3"
    )
    assert outcome.verdict == ("full" if own_sense(reading) > 0.0 else "follow_through")
