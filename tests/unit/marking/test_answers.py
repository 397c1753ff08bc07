"""A person's decision on a doubtful verdict is evidence for the other doubtful ones."""

from dataclasses import replace

import pytest

from grader.pipeline import mark
from grader.records import Figure, PageRef, ScannedPage
from grader.tables.decisions import Decision
from grader.tables.measurements import StudentSubmission
from reference.construction.mistakes import Mistake
from samples.simulation.wording import declared_texts
from tests.hands import rule_scales, sheet, task_for

PUMP = task_for("pump", 7)
SCALES = rule_scales(PUMP)


def unsure(reading, *names, figure="velocity_plan", confidence=0.5):
    """The reading with some nodes of a plan, and the vectors that touch them, as good as unread."""
    read = reading.figures[figure]
    ends = {one.name: {one.tail, one.head} for one in PUMP.construction.vectors.values()}
    nodes = {
        name: replace(one, confidence=confidence) if name in names else one
        for name, one in read.nodes.items()
    }
    vectors = {
        name: replace(one, confidence=confidence) if ends[name] & set(names) else one
        for name, one in read.vectors.items()
    }
    return replace(reading, figures={**reading.figures, figure: Figure(nodes, vectors)})


def report(reading, scales=SCALES, **decided):
    """The report of a sheet with this reading, with verdicts by criterion and places by node."""
    names = {name.replace("__", ":"): verdict for name, verdict in decided.items()}
    rows = tuple(Decision("s01", None, name, verdict) for name, verdict in names.items())
    submission = StudentSubmission("s01", PUMP.variant, (), declared_texts(scales), decided=rows)
    page = ScannedPage(PageRef("s01.jpg"), reading=reading)
    return mark(submission, [page], PUMP.assignment, PUMP.rubric)[0]


def waiting(found):
    return {one.id for one in found.criteria if one.verdict == "review"}


def verdicts(found):
    return {one.id: one.verdict for one in found.criteria}


def test_a_scale_that_is_settled_settles_what_waits_for_it():
    reading = unsure(sheet(PUMP), "a", "b", "c", "d")
    wrong = {**SCALES, "kv": SCALES["kv"] / 10.0}
    before = waiting(report(reading, wrong))
    after = report(reading, wrong, kv="none")
    assert "kv" in before
    assert len(before) - len(waiting(after)) > len(before) / 2
    assert verdicts(after)["kv"] == "none"


def test_a_vector_that_was_misread_lies_where_it_is_expected():
    exact = {one.id for one in report(sheet(PUMP)).criteria if one.verdict == "full"}
    moved = sheet(PUMP, moved={"c": 12 + 9j})
    doubtful = unsure(moved, "c")
    before = waiting(report(doubtful))
    assert {"v_C", "v_CA", "v_CB"} <= before
    after = report(doubtful, v_C="full")
    assert not waiting(after) & {"v_CA", "v_CB"}
    assert verdicts(after)["v_CA"] == verdicts(after)["v_CB"] == "full"
    assert exact >= {"v_CA", "v_CB"}


def test_a_vector_that_was_read_rightly_is_followed_by_what_hangs_on_it():
    mistake = Mistake("sense_reversed", "a")
    doubtful = unsure(sheet(PUMP, mistakes=(mistake,)), "a")
    before = waiting(report(doubtful))
    after = report(doubtful, v_A="none")
    assert "v_A" in before
    assert len(waiting(after)) < len(before) - 1
    assert verdicts(after)["v_B"] in {"full", "follow_through"}


@pytest.mark.parametrize("verdict", ["full", "none", "not_judged"])
def test_a_verdict_in_the_place_of_a_settled_one_changes_no_other(verdict):
    reading = sheet(PUMP, moved={"c": 12 + 9j})
    before, after = verdicts(report(reading)), verdicts(report(reading, v_C=verdict))
    assert before["v_C"] != "review"
    assert {name: one for name, one in after.items() if name != "v_C"} == {
        name: one for name, one in before.items() if name != "v_C"
    }
