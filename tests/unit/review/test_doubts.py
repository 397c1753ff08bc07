"""A person is asked about doubtful readings, and not about things that are known."""

from dataclasses import replace

import pytest

from grader.feedback.sentences import feedback_again
from grader.marking.answers import along_of
from grader.pipeline import mark
from grader.records import MECHANISM, Figure, PageRef, Reason, ScannedPage, Unread
from grader.review.doubts import doubts_of, figures_read
from grader.tables.decisions import Decision
from grader.tables.measurements import StudentSubmission
from reference.construction.mistakes import Mistake
from samples.simulation.wording import declared_texts
from tests.hands import changed, rule_scales, sheet, task_for, without

PUMP, ENGINE = task_for("pump", 7), task_for("engine", 3)
MISSING = Mistake("normal_missing", "n_BA")
LEFT_OUT = Reason("normal_left_out")


def unsure(reading, figure, node, confidence=0.3):
    """The reading with one node in doubt."""
    read = reading.figures[figure]
    nodes = {**read.nodes, node: replace(read.nodes[node], confidence=confidence)}
    return replace(reading, figures={**reading.figures, figure: Figure(nodes, read.vectors)})


def unread(reading, node, *, is_blank):
    """The reading without a node of the acceleration plan, and without the vector to it."""
    plan = reading.figures["acceleration_plan"]
    nodes = {name: one for name, one in plan.nodes.items() if name != node}
    vectors = {name: one for name, one in plan.vectors.items() if name != "a_BA_n"}
    gap = Unread("a_BA_n", LEFT_OUT if is_blank else Reason("no_stroke"), is_blank=is_blank)
    figures = {**reading.figures, "acceleration_plan": Figure(nodes, vectors)}
    return replace(reading, figures=figures, unread=(gap,))


def reviewed(task, reading, **decided):
    """The report of a sheet with this reading, and its questions."""
    rows = tuple(Decision("s01", None, name, verdict) for name, verdict in decided.items())
    told = declared_texts(rule_scales(task))
    submission = StudentSubmission("s01", task.variant, (), told, decided=rows)
    pages = [ScannedPage(PageRef("s01.jpg"), reading=reading)]
    report = mark(submission, pages, task.assignment, task.rubric)[0]
    return report, doubts_of(task, report, figures_read(report, pages))


def verdicts(report):
    return {one.id: one.verdict for one in report.criteria}


def test_a_component_that_the_reading_finds_left_out_is_charged_and_the_rest_follows():
    report, doubts = reviewed(PUMP, unread(sheet(PUMP, mistakes=(MISSING,)), "n_BA", is_blank=True))
    assert doubts == []
    assert verdicts(report)["a_BA_n"] == "none"
    assert verdicts(report)["a_B"] == "follow_through"
    assert report.score is not None


def test_a_component_that_was_not_read_is_one_question_before_all_that_hangs_on_it():
    report, doubts = reviewed(PUMP, unread(sheet(PUMP, mistakes=(MISSING,)), "n_BA", is_blank=False))
    waiting = {one.id for one in report.criteria if one.verdict == "review"}
    assert len(waiting) > 1
    assert doubts[0].id == "a_BA_n"
    assert set(doubts[0].criteria) == waiting
    after, left = reviewed(
        PUMP, unread(sheet(PUMP, mistakes=(MISSING,)), "n_BA", is_blank=False), a_BA_n="none"
    )
    assert left == []
    assert verdicts(after)["a_B"] == "follow_through"


def test_a_joint_from_which_a_right_vector_was_made_is_not_asked_for():
    wrong = sheet(PUMP, mistakes=(Mistake("normal_reversed", "n_BA"),))
    exact, none = reviewed(PUMP, wrong)
    report, doubts = reviewed(PUMP, unsure(wrong, MECHANISM, "B"))
    assert none == doubts == []
    of_vectors = {one.id for one in exact.criteria if one.vector}
    assert {name: one for name, one in verdicts(report).items() if name in of_vectors} == {
        name: one for name, one in verdicts(exact).items() if name in of_vectors
    }


def test_a_joint_at_which_it_is_known_what_was_done_is_not_asked_for():
    wrong = sheet(ENGINE, mistakes=(Mistake("other_assembly", "B"),))
    exact, _ = reviewed(ENGINE, wrong)
    report, doubts = reviewed(ENGINE, unsure(wrong, MECHANISM, "B"))
    assert doubts == []
    assert report.score == pytest.approx(exact.score)


def test_an_optional_vector_that_is_likelier_another_stroke_is_not_judged():
    reading = changed(sheet(PUMP), "a_CA_n", length_mm=30.0, confidence=0.3)
    report, doubts = reviewed(PUMP, reading)
    assert verdicts(report)["a_CA_n"] == "not_judged"
    assert doubts == []
    report, doubts = reviewed(PUMP, changed(sheet(PUMP), "a_CA_n", length_mm=30.0, confidence=0.7))
    assert verdicts(report)["a_CA_n"] == "review"
    (doubt,) = doubts
    assert dict(doubt.choices[-1].rows)["a_CA_n"] == "not_judged"


def test_a_stroke_is_told_as_its_vector_points_whichever_end_is_in_doubt():
    reading = unsure(sheet(PUMP), "acceleration_plan", "a'")
    reading = changed(reading, "a_BA_n", length_mm=20.0, confidence=0.3)
    report, doubts = reviewed(PUMP, reading)
    (doubt,) = (one for one in doubts if one.kind == "node")
    places = [one for one in doubt.choices if one.at is not None]
    assert {(one.vector, one.is_tail) for one in places} == {("a_BA_n", True)}
    expected = along_of(next(one.expected for one in report.criteria if one.id == "a_BA_n"))
    assert min(abs(one.along - expected) for one in places) < 0.1


def test_what_nothing_speaks_for_is_not_proposed():
    gap = Unread("v_D", Reason("torn_off"))
    reading = replace(without(sheet(PUMP), "v_D"), unread=(gap,))
    report, doubts = reviewed(PUMP, reading)
    (waiting,) = (one for one in report.criteria if one.verdict == "review")
    assert (waiting.id, waiting.probability) == ("v_D", 0.5)
    assert [one.probability for one in doubts[0].choices] == [None] * 4


@pytest.mark.parametrize(("se_mm", "is_proposed"), [(0.7, True), (2.0, False)])
def test_a_reading_that_is_right_by_its_own_error_alone_is_not_proposed(se_mm, is_proposed):
    reading = changed(sheet(PUMP), "v_A", length_mm=62.0, se_mm=se_mm, confidence=0.1)
    report, doubts = reviewed(PUMP, reading)
    (waiting,) = (one for one in report.criteria if one.verdict == "review")
    assert waiting.reasons == ["doubtful", "counted_for_you"]
    assert [doubt.default is not None for doubt in doubts] == [is_proposed]
    # What is not proposed is not told as within the accuracy either.
    told = feedback_again(waiting, "en"), waiting.feedback
    assert ["accuracy" in one for one in told] == [is_proposed] * 2
