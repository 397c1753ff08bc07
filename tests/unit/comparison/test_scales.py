"""Declared scales against the rule, the drawn crank and the data."""

import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.rubric import load_rubric
from reference.authored.assignment import library, load_assignment
from tests.hands import changed, drawn_nodes, measured, rule_scales, sheet, task_for, without
from tests.unit.comparison.rubrics import codes, outcome_of, with_rubric

TASK = task_for("pump", 7)
RULE = rule_scales(TASK)
ROUNDING = 1e-9


def declared(kv_factor=1.0, ka_factor=1.0):
    return {
        "kL": "1:5",
        "kv": f"{RULE['kv'] * kv_factor!r} (m/s)/mm",
        "ka": f"{RULE['ka'] * ka_factor!r} (m/s2)/mm",
    }


def test_undeclared_scales_follow_the_rule_and_are_told_as_assumed():
    comparison = compare(TASK, Submission(measured=measured(TASK)))
    for name in ("kL", "kv", "ka"):
        assert comparison.scales[name].used == pytest.approx(RULE[name], rel=ROUNDING)
        assert comparison.scales[name].assumed
        assert comparison.scales[name].declared is None
        outcome = outcome_of(comparison, name)
        assert outcome.verdict == "not_judged"


def test_an_undeclared_length_scale_comes_from_the_drawn_crank():
    smaller = {"kL": 0.006, "kv": TASK.omega * 0.006, "ka": TASK.omega**2 * 0.006}
    comparison = compare(TASK, Submission(readings=(sheet(TASK, smaller),)))
    for name in ("kL", "kv", "ka"):
        assert comparison.scales[name].used == pytest.approx(smaller[name], rel=ROUNDING)
    assert {one.verdict for one in comparison.outcomes} == {"full", "not_judged"}


def test_right_declared_scales_are_used_and_have_full_marks():
    comparison = compare(TASK, Submission(measured=measured(TASK), declared=declared()))
    for name in ("kL", "kv", "ka"):
        assert outcome_of(comparison, name).verdict == "full"
        assert not comparison.scales[name].assumed


def test_a_rule_as_declaration_is_evaluated():
    told = {"kL": "1:5", "kv": "kv = omega kL", "ka": "ω²kL"}
    comparison = compare(TASK, Submission(measured=measured(TASK), declared=told))
    for name in ("kL", "kv", "ka"):
        assert comparison.scales[name].declared == pytest.approx(RULE[name], rel=ROUNDING)
        assert outcome_of(comparison, name).verdict == "full"


def test_another_scale_than_the_rules_is_no_mistake_when_the_drawing_follows_it():
    own = {**RULE, "kv": 0.3, "ka": 20.0}
    told = {"kL": "1:5", "kv": "0,3 (м/с)/мм", "ka": "20 m/s2·mm"}
    comparison = compare(TASK, Submission(measured=measured(TASK, own), declared=told))
    assert {one.verdict for one in comparison.outcomes} == {"full", "not_judged"}


def test_a_scale_declared_without_unit_is_refused_and_reviewed_while_the_rest_is_marked():
    comparison = compare(TASK, Submission(measured=measured(TASK), declared={"kv": "0,2199"}))
    outcome = outcome_of(comparison, "kv")
    assert outcome.verdict == "review"
    assert codes(outcome)[0] == "scale_refused"
    assert comparison.scales["kv"].refused.code == "no_unit"
    assert comparison.scales["kv"].assumed
    assert outcome_of(comparison, "v_B").verdict == "full"


def test_a_blank_declaration_is_none():
    comparison = compare(TASK, Submission(measured=measured(TASK), declared={"kv": "  "}))
    assert comparison.scales["kv"].text is None


@pytest.mark.parametrize("factor", [0.1, 2.0, 9.549])
def test_a_wrong_scale_costs_once(factor):
    comparison = compare(TASK, Submission(measured=measured(TASK), declared=declared(kv_factor=factor)))
    lost = [one.criterion for one in comparison.outcomes if one.verdict in {"none", "partial", "review"}]
    assert lost == ["kv"]
    assert outcome_of(comparison, "v_A").verdict == "follow_through"
    assert outcome_of(comparison, "a_A").verdict == "full"
    reason = outcome_of(comparison, "v_B").reasons[0]
    assert (reason.code, reason.parameters["what"], reason.parameters["of"]) == ("follows", "scale", "kv")
    assert outcome_of(comparison, "kv").expected.value == pytest.approx(RULE["kv"], rel=ROUNDING)


def test_a_wrong_length_scale_is_told_by_the_drawn_crank():
    told = {"kL": "1:4", "kv": f"{RULE['kv']!r} (m/s)/mm", "ka": f"{RULE['ka']!r} (m/s2)/mm"}
    comparison = compare(TASK, Submission(readings=(sheet(TASK),), declared=told))
    outcome = outcome_of(comparison, "kL")
    assert outcome.verdict == "none"
    assert outcome.expected.value == pytest.approx(0.005, rel=ROUNDING)
    assert outcome_of(comparison, "a_BA_n").verdict == "full"


def test_a_wrong_vector_of_the_crank_does_not_make_a_right_scale_wrong():
    longer = changed(measured(TASK), "v_A", length_mm=70.0)
    comparison = compare(TASK, Submission(measured=longer, declared=declared()))
    assert outcome_of(comparison, "kv").verdict == "full"
    assert outcome_of(comparison, "v_A").verdict == "none"


def test_an_own_scale_and_a_wrong_vector_of_the_crank_cost_the_vector():
    own = {**RULE, "kv": 0.3}
    longer = changed(measured(TASK, own), "v_A", length_mm=70.0)
    told = {"kL": "1:5", "kv": "0.3 (m/s)/mm"}
    comparison = compare(TASK, Submission(measured=longer, declared=told))
    assert outcome_of(comparison, "kv").verdict == "full"
    assert outcome_of(comparison, "v_A").verdict == "none"


def test_one_vector_at_the_rules_scale_tells_that_the_declared_one_is_wrong():
    only = without(measured(TASK), *(name for name in TASK.real if name != "v_A"))
    comparison = compare(TASK, Submission(measured=only, declared=declared(kv_factor=2.0)))
    assert outcome_of(comparison, "kv").verdict == "none"
    assert outcome_of(comparison, "v_A").verdict == "follow_through"


def test_a_scale_that_nothing_was_drawn_at_is_held_against_the_rule_and_never_called_wrong():
    told = {"kL": "1:5", "kv": "0.3 (m/s)/mm", "ka": f"{RULE['ka']!r} (m/s2)/mm"}
    comparison = compare(TASK, Submission(declared=told))
    assert outcome_of(comparison, "kL").verdict == "full"
    assert outcome_of(comparison, "kv").verdict == "not_judged"
    assert outcome_of(comparison, "ka").verdict == "full"


def test_a_drawing_that_contradicts_an_assumed_scale_goes_to_a_person():
    other = {**RULE, "kv": 2.0 * RULE["kv"]}
    comparison = compare(TASK, Submission(measured=measured(TASK, other)))
    for name in ("v_A", "v_B", "v_D"):
        outcome = outcome_of(comparison, name)
        assert outcome.verdict == "review"
        assert outcome.possible[1] == "follow_through"
        assert "scale_assumed" in codes(outcome)
    assert outcome_of(comparison, "a_A").verdict == "full"


def test_a_bare_number_counts_where_the_assignment_says_its_unit(tmp_path):
    text = (library() / "pump.assignment.toml").read_text(encoding="utf-8")
    text = text.replace("[scales]", '[scales]\nbare_units = { kv = "(m/s)/mm" }')
    path = tmp_path / "bare.assignment.toml"
    path.write_text(text, encoding="utf-8")
    assignment = load_assignment(str(path))
    task = task_of(assignment, load_rubric("pump"), assignment.variant(7))
    comparison = compare(task, Submission(measured=measured(task), declared={"kv": f"{RULE['kv']!r}"}))
    assert comparison.scales["kv"].declared == pytest.approx(RULE["kv"], rel=ROUNDING)


def test_a_crank_drawn_too_long_beside_right_links_is_a_wrong_crank_and_no_wrong_scale():
    crank = drawn_nodes(TASK)["A"] - drawn_nodes(TASK)["O1"]
    reading = sheet(TASK, moved={"A": 0.12 * crank})
    comparison = compare(TASK, Submission(readings=(reading,), declared=declared()))
    assert outcome_of(comparison, "kL").verdict == "full"
    assert outcome_of(comparison, "O1A").verdict == "none"
    assert outcome_of(comparison, "O2B").verdict == "full"


def ten_times_smaller(**v_a):
    """A velocity plan at a tenth of the declared scale; `v_a`, what is changed of v_A as read."""
    drawn = sheet(TASK, {**RULE, "kv": 10.0 * RULE["kv"]})
    read = changed(drawn, "v_A", **v_a) if v_a else without(drawn, "v_A")
    return compare(TASK, Submission(readings=(read,), declared=declared()))


def test_a_doubtful_vector_of_the_crank_tells_the_scale_where_others_bear_it_out():
    comparison = ten_times_smaller(confidence=0.85)
    assert outcome_of(comparison, "kv").verdict == "none"
    assert outcome_of(comparison, "v_B").verdict == "follow_through"


def test_while_the_scale_of_a_plan_was_not_read_nothing_is_charged_at_it():
    comparison = ten_times_smaller()
    velocities = [one.verdict for one in comparison.outcomes if one.name in TASK.real and one.name[0] == "v"]
    assert outcome_of(comparison, "kv").verdict == "review"
    assert set(velocities) == {"review"}


@pytest.mark.parametrize(("scale_share", "verdict"), [(1.0, "full"), (1.25, "review")])
def test_vectors_that_miss_by_no_more_than_drafting_errors_show_a_scale_without_the_cranks(
    scale_share, verdict
):
    reading = without(sheet(TASK, {**RULE, "kv": scale_share * RULE["kv"]}), "v_A")
    for name in VELOCITIES:
        drawn = reading.figures["velocity_plan"].vectors[name]
        reading = changed(reading, name, length_mm=drawn.length_mm + 1.2)
    comparison = compare(TASK, Submission(readings=(reading,), declared=declared()))
    assert outcome_of(comparison, "kv").verdict == verdict


def test_links_are_not_judged_where_no_sketch_was_read():
    comparison = compare(TASK, Submission(measured=measured(TASK)))
    assert {one.verdict for one in comparison.outcomes if one.name in TASK.construction.links} == {
        "not_judged"
    }


@pytest.mark.parametrize("turn_deg", [0.0, 30.0])
def test_a_links_direction_counts_in_the_assignments_frame(turn_deg):
    right = compare(TASK, Submission(readings=(sheet(TASK, turn_deg=turn_deg),)))
    assert {outcome_of(right, name).verdict for name in TASK.construction.links} == {"full"}
    astray = drawn_nodes(TASK)["D"] + 6.0j
    reading = sheet(TASK, turn_deg=turn_deg, moved={"D": astray - drawn_nodes(TASK)["D"]})
    found = compare(TASK, Submission(readings=(reading,)))
    assert outcome_of(found, "CD").verdict == "none"
    assert outcome_of(found, "AB").verdict == "full"


def doubtful_crank(confidence, length_share=1.0):
    """A sheet on which v_A was read in doubt, and nothing else of the velocities tells the scale."""
    reading = without(sheet(TASK, figures=("mechanism", "velocity_plan")), *VELOCITIES)
    v_a = reading.figures["velocity_plan"].vectors["v_A"]
    return changed(reading, "v_A", confidence=confidence, length_mm=length_share * v_a.length_mm)


VELOCITIES = ("v_B", "v_BA", "v_C", "v_CA", "v_CB", "v_D", "v_DC")


@pytest.mark.parametrize("confidence", [0.2, 0.89])
def test_a_stroke_that_is_likelier_misread_than_the_scale_is_wrong_does_not_speak_against_it(confidence):
    told = Submission(readings=(doubtful_crank(confidence, 0.8),), declared=declared())
    outcome = outcome_of(compare(TASK, told), "kv")
    assert (outcome.verdict, outcome.proposed_verdict) == ("review", "full")
    assert outcome.probability > 0.5
    assert "scale_seems_off" not in codes(outcome)


def test_others_that_fit_the_scale_of_a_doubtful_stroke_speak_for_it():
    own = {**RULE, "kv": 1.25 * RULE["kv"]}
    reading = sheet(TASK, own, figures=("mechanism", "velocity_plan"))
    for name in reading.figures["velocity_plan"].vectors:
        reading = changed(reading, name, confidence=0.5)
    outcome = outcome_of(compare(TASK, Submission(readings=(reading,), declared=declared())), "kv")
    assert (outcome.verdict, outcome.proposed_verdict) == ("review", "none")
    assert outcome.probability > 0.9
    assert codes(outcome)[0] == "scale_seems_off"


@pytest.mark.parametrize(("name", "larger_by"), [("kL", -0.07), ("kv", -0.05)])
def test_what_follows_from_a_scale_that_waits_for_a_person_waits_too(name, larger_by):
    task = with_rubric(TASK, doubt=TASK.rubric.doubt.model_copy(update={"in_doubt": "person"}))
    drawn = sheet(task, {**RULE, name: RULE[name] * (1.0 + larger_by)}, se_mm=1.0)
    comparison = compare(task, Submission(readings=(drawn,), declared=declared()))
    assert outcome_of(comparison, name).verdict == "review"
    at_that_scale = [one for one in comparison.outcomes if one.name in {"O2B", "v_B"}]
    assert {one.verdict for one in at_that_scale} == {"review"}
    assert all(one.shares[-1] == 1.0 for one in at_that_scale)
