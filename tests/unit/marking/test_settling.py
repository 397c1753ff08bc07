"""Verdicts that are settled once verdicts and mistakes are known together."""

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.rubric import DoubtTable
from reference.authored.assignment import Variant
from reference.construction.mistakes import Mistake
from tests.hands import changed, measured, sheet, task_for
from tests.unit.comparison.rubrics import with_rubric

PUMP = task_for("pump", 7)
OTHER = task_of(PUMP.assignment, PUMP.rubric, Variant(n=PUMP.variant.n + 3))


def by_name(judgement):
    return {one.name: one for one in judgement.outcomes}


def with_doubt(**change):
    return with_rubric(PUMP, doubt=DoubtTable(**change))


@pytest.mark.parametrize(("rule", "verdicts"), [("person", {"review"}), ("none", {"none"})])
def test_another_students_drawing_earns_nothing_without_a_person(rule, verdicts):
    judgement = judge(with_doubt(other_variant=rule), Submission(measured=measured(OTHER)))
    assert "other_variant" in [one.code for one in judgement.mistakes]
    judged = [one for one in judgement.outcomes if one.verdict != "not_judged"]
    assert {one.verdict for one in judged} <= verdicts | {"none"}
    assert judgement.score.low == 0.0
    assert any(reason.code == "other_variant" for one in judged for reason in one.reasons)


def test_another_students_omega_is_that_of_the_data_and_no_slip_beside_them():
    values = {"omega_1": OTHER.rates["omega_1"]}
    judgement = judge(with_doubt(), Submission(measured=measured(OTHER), values=values))
    assert [(one.code, one.mistake.n) for one in judgement.mistakes] == [("other_variant", OTHER.variant.n)]


def test_another_students_omega_costs_once_where_the_rubric_marks_it_as_any_mistake():
    scales = zip(OTHER.rule_scales.items(), ("m/mm", "(m/s)/mm", "(m/s2)/mm"), strict=True)
    declared = {name: f"{scale!r} {unit}" for (name, scale), unit in scales}
    both = {"measured": measured(OTHER), "declared": declared}
    follow = with_doubt(other_variant="follow")
    values = {"omega_1": OTHER.rates["omega_1"]}
    judgement = judge(follow, Submission(**both, values=values))
    assert judgement.score.total > judge(follow, Submission(**both)).score.total


def test_another_students_drawing_is_marked_as_any_mistake_where_the_rubric_says_so():
    judgement = judge(with_doubt(other_variant="follow"), Submission(measured=measured(OTHER)))
    assert judgement.score.total > 0.5 * judgement.score.maximum


def one_open(stake):
    """A drawing of which the last vector is 1.5 times too long and was read without confidence."""
    task = with_doubt(stake=stake)
    expected = abs(task.segments["a_D"].drawn(task.rule_scales))
    reading = changed(sheet(task), "a_D", length_mm=1.5 * expected, confidence=0.5)
    return task, judge(task, Submission(readings=(reading,)))


def test_what_is_worth_less_than_the_stake_is_settled_for_the_student():
    task, judgement = one_open(stake=0.0)
    assert by_name(judgement)["a_D"].verdict == "review"
    share = task.rubric.points["a_D"] / task.rubric.max_score
    _, settled = one_open(stake=1.01 * share)
    outcome = by_name(settled)["a_D"]
    assert (outcome.verdict, outcome.reasons[0].code) == ("full", "at_stake")
    assert settled.score.total == pytest.approx(settled.score.maximum)
    assert outcome.probability < 1.0


def test_the_expected_score_counts_what_is_likely():
    _, judgement = one_open(stake=0.0)
    assert judgement.score.low - 0.1 < judgement.score.expected < judgement.score.high
    sure = judge(PUMP, Submission(readings=(sheet(PUMP),))).score
    assert sure.expected == pytest.approx(sure.total, rel=0.01)


@pytest.mark.parametrize(("confidence", "verdict"), [(0.96, "none"), (0.6, "none")])
def test_a_mistake_that_is_nearly_certain_is_charged_however_doubtful_its_vector(confidence, verdict):
    drawn = sheet(PUMP, mistakes=(Mistake("sense_reversed", "a'", slot=0),))
    doubtful = changed(drawn, "a_A", confidence=confidence)
    found = by_name(judge(PUMP, Submission(readings=(doubtful,))))
    assert found["a_A"].verdict == verdict
    assert {found[name].verdict for name in ("a_B", "a_C", "a_D")} <= {"follow_through", "full"}


def test_a_neighbours_sheet_is_told_though_nearly_all_of_it_is_within_the_tolerances():
    other = task_of(PUMP.assignment, PUMP.rubric, Variant(n=PUMP.variant.n + 2))
    judgement = judge(with_doubt(other_variant="person"), Submission(readings=(sheet(other),)))
    assert [(one.code, one.mistake.n) for one in judgement.mistakes] == [("other_variant", other.variant.n)]
    assert judgement.score.total is None
