"""Doubtful vectors that an explanation predicts."""

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from reference.construction.mistakes import Mistake
from tests.hands import changed, sheet, task_for

PUMP = task_for("pump", 7)
MIRRORED = (Mistake("normal_reversed", "n_DC"),)


def verdicts(reading):
    return {one.name: one for one in judge(PUMP, Submission(readings=(reading,))).outcomes}


def test_what_follows_from_a_certain_mistake_is_believed_where_it_was_read_in_doubt():
    drawn = sheet(PUMP, mistakes=MIRRORED)
    assert verdicts(drawn)["a_D"].verdict == "follow_through"
    doubtful = verdicts(changed(drawn, "a_DC_t", confidence=0.6))["a_DC_t"]
    assert doubtful.verdict == "follow_through"
    assert doubtful.confidence > 0.9


def test_a_doubtful_vector_that_lies_elsewhere_stays_in_doubt():
    drawn = sheet(PUMP, mistakes=MIRRORED)
    vector = drawn.figures["acceleration_plan"].vectors["a_DC_t"]
    elsewhere = changed(drawn, "a_DC_t", confidence=0.6, length_mm=0.5 * vector.length_mm)
    assert verdicts(elsewhere)["a_DC_t"].verdict == "review"
