"""Letters exchanged in a plan: charged once, the drawing judged under the right letters."""

import pytest

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from grader.records import Swapped
from reference.construction.mistakes import Mistake
from samples.simulation.wording import declared_texts
from tests.hands import drawn_nodes, handed_in, rule_scales, sheet, task_for

PUMP = task_for("pump", 7)
EXCHANGED = Mistake("labels_swapped", "b", other=("b", "c"))


def judged(submission):
    judgement = judge(PUMP, submission)
    return judgement, {one.name: one for one in judgement.outcomes if one.verdict != "not_judged"}


@pytest.mark.parametrize("source", ["sheet", "directions", "lengths"])
def test_exchanged_letters_cost_one_vector_as_it_is_lettered(source):
    judgement, found = judged(handed_in(PUMP, drawn_nodes(PUMP, mistakes=(EXCHANGED,)), source))
    lost = [one for one in found.values() if one.verdict not in {"full", "follow_through"}]
    assert [one.mistake for one in lost] == ["labels_swapped"]
    assert [one.code for one in judgement.mistakes] == ["labels_swapped"]
    (charged,) = lost
    # Shown as measured is what stands under the wrong letters: the page does not contradict itself.
    drawn, right = charged.measured.length_mm, charged.expected.length_mm
    assert abs(drawn - right) > 1.0 or charged.measured.direction_deg != pytest.approx(
        charged.expected.direction_deg, abs=1.5
    )
    others = [one for one in found.values() if one is not charged]
    assert any(reason.code == "letters_exchanged" for one in others for reason in one.reasons)


def test_letters_read_at_each_others_node_cost_one_vector_too():
    reading = sheet(PUMP)
    swapped = (Swapped("velocity_plan", "b", "c", 0.97),)
    submission = Submission(
        readings=(type(reading)(reading.figures, swapped=swapped),),
        declared=declared_texts(rule_scales(PUMP)),
    )
    _, found = judged(submission)
    lost = [one for one in found.values() if one.verdict not in {"full", "follow_through"}]
    assert [(one.mistake, one.verdict) for one in lost] == [("labels_swapped", "none")]
    assert lost[0].measured != lost[0].expected


def test_letters_that_are_doubtful_leave_one_vector_to_a_person():
    reading = sheet(PUMP)
    swapped = (Swapped("velocity_plan", "b", "c", 0.7),)
    judgement, found = judged(Submission(readings=(type(reading)(reading.figures, swapped=swapped),)))
    assert judgement.score.high == judgement.score.maximum
    (waiting,) = (one for one in found.values() if one.verdict not in {"full", "follow_through"})
    assert (waiting.verdict, waiting.proposed_verdict, waiting.probability) == ("review", "none", 0.7)
    assert waiting.reasons[0].code == "letters_unclear"
    # Shown is what stands under the letters, as the proposal has it.
    assert waiting.measured != waiting.expected
