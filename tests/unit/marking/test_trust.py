"""Checked verdicts as evidence for the others: the bound, the sample, which are opened and which not."""

import random

import numpy as np
import pytest

from grader.documents import LikeDocument, ReportDocument
from grader.marking.mark import judge
from grader.marking.report import report_of
from grader.marking.trust import (
    OPENED,
    checkable,
    next_to_check,
    opened_by_audit,
    opened_in,
    sample,
    trust_of,
    with_said,
    wrong_between,
)
from tests.hands import drawn_nodes, handed_in, task_for

SETTLE = 0.97


@pytest.mark.parametrize(("total", "wrong"), [(60, 3), (240, 12), (240, 30)])
def test_the_bounds_hold_whenever_the_teacher_stops(total, wrong):
    lots, known, too_low, too_high, classes = random.Random(5), {}, 0, 0, 600
    for _ in range(classes):
        verdicts = [True] * wrong + [False] * (total - wrong)
        lots.shuffle(verdicts)
        seen, ends = 0, []
        for count, is_wrong in enumerate(verdicts[:60], 1):
            seen += is_wrong
            if (count, seen) not in known:
                known[count, seen] = wrong_between(total, seen, count - seen)
            ends.append(known[count, seen])
        too_low += any(high < wrong for _, high in ends)
        too_high += any(low > wrong for low, _ in ends)
    # Each may happen to one class in twenty; three standard errors of 600 classes more.
    most = 0.05 + 3.0 * np.sqrt(0.05 * 0.95 / classes)
    assert too_low / classes < most
    assert too_high / classes < most


def test_what_is_checked_is_known():
    assert wrong_between(40, 2, 38) == (2, 2)
    assert wrong_between(40, 0, 0) == (0, 40)
    assert wrong_between(1, 0, 1) == (0, 0)


def test_twenty_four_right_ones_come_near_the_bound_of_a_sample_of_fixed_size():
    fixed = 1.0 - 0.05 ** (1.0 / 24.0)
    shown = wrong_between(100_000, 0, 24)[1] / 100_000
    assert fixed < shown < 1.1 * fixed


# A class ------------------------------------------------------------------------------------------


def criterion(name, *, verdict="full", probability=0.99, **other):
    empty = {"length_mm": None, "direction_deg": None, "value": None, "unit": None}
    return {
        "id": name, "title": name, "vector": name, "points": 1.0, "max_points": 1.0, "verdict": verdict,
        "measured": empty, "expected": empty, "tolerance": {}, "confidence": 1.0, "probability": probability,
        **other,
    }  # fmt: skip


def report(student, criteria, answers=(), said=None):
    rows = [
        {"criterion": name, "verdict": text, "points": None, "comment": "", "by": "", "at": ""}
        for name, text in answers
    ]
    return ReportDocument.model_validate(
        {
            "student_id": student, "assignment": "pump", "variant": {}, "position": None, "status": "graded",
            "score": 1.0, "score_range": (1.0, 1.0), "max_score": 1.0, "criteria": criteria,
            "decisions": rows,
            "said": said or {},
        }
    )  # fmt: skip


def a_class(answer_of=lambda _student, _name: None, count=30, **other):
    names = ("v_A", "v_B", "a_B")
    students = []
    for number in range(count):
        student = f"s{number:02}"
        answers = [(f"audit:{name}", answer) for name in names if (answer := answer_of(student, name))]
        criteria = [criterion(name, probability=0.97 + 0.0009 * number, **other) for name in names]
        students.append(report(student, criteria, answers))
    return students


def answered(count, wrong=(), said="full"):
    """The answers to the first ones of the random order, some of them wrong."""
    asked = checkable(a_class())[:count]
    found = {(one.student, one.criterion): index for index, one in enumerate(asked)}

    def answer(student, name):
        index = found.get((student, name))
        return None if index is None else f"{'wrong' if index in wrong else 'right'}; said={said}"

    return a_class(answer), asked


def test_the_sample_has_nothing_to_do_with_confidence_and_is_gone_on_with():
    first = checkable(a_class())
    asked = next_to_check(first, 10)
    assert asked[:10] == first[:10]
    sure = [one.said.probability for one in first[:30]]
    assert abs(np.mean(sure) - np.mean([one.said.probability for one in first])) < 0.01
    assert len(asked) <= 15
    assert {one.student for one in asked[10:]} <= {"s00", "s01"}
    reports, _ = answered(4)
    assert [one.order for one in next_to_check(checkable(reports), 6)[:6]] == [
        one.order for one in first[4:10]
    ]


def test_a_class_that_nobody_checked_has_no_such_document():
    assert trust_of(a_class(), SETTLE) is None


def test_twenty_four_right_ones_bound_the_wrong_ones():
    reports, _ = answered(24)
    trust = trust_of(reports, SETTLE)
    assert (trust.settled, trust.audited, trust.right, trust.opened) == (90, 24, 24, [])
    assert 0.0 < trust.at_most < 0.12
    assert trust.raised is None


def test_least_sure_ones_are_no_part_of_the_sample():
    reports = a_class(lambda student, name: "right; said=full" if (student, name) == ("s00", "a_B") else None)
    is_first = checkable(reports)[0].student == "s00"
    trust = trust_of(reports, SETTLE)
    assert not is_first
    assert (trust.audited, trust.least_sure, trust.least_sure_right, trust.at_most) == (0, 1, 1, None)


def test_a_wrong_one_opens_those_like_it_and_no_others():
    reports, asked = answered(5, wrong={2})
    found = asked[2]
    trust = trust_of(reports, SETTLE)
    (opened,) = trust.opened
    assert (opened.student_id, opened.like.criterion) == (found.student, found.criterion)
    number = int(found.student[1:])
    assert opened.count == number + 1
    for one in reports:
        assert bool(opened_in(one, trust)) == (int(one.student_id[1:]) <= number)


def test_an_answer_about_another_verdict_than_the_present_one_does_not_count():
    reports, _ = answered(5, wrong={2}, said="none")
    assert trust_of(reports, SETTLE) is None


def test_settle_is_raised_where_more_is_wrong_than_promised_for_sure():
    few, _ = answered(12, wrong={3})
    assert trust_of(few, SETTLE).raised is None
    many, asked = answered(30, wrong=set(range(0, 30, 3)))
    trust = trust_of(many, SETTLE)
    wrong = [one.said.probability for one in asked[::3]]
    assert trust.raised in wrong
    assert trust.raised >= SETTLE
    assert trust.opened[-1].like == LikeDocument(most=trust.raised)


def test_a_persons_verdict_on_a_settled_one_is_an_answer_of_the_sample():
    said = {"verdict": "full", "settled": True, "probability": 0.98}
    decided = {"by": "", "at": "", "before": "full"}
    first = checkable(a_class())[0]
    corrected = criterion(first.criterion, verdict="none", probability=1.0, decided=decided)
    reports = a_class()
    index = next(k for k, one in enumerate(reports) if one.student_id == first.student)
    own = [corrected if one.id == first.criterion else one.model_dump() for one in reports[index].criteria]
    reports[index] = report(first.student, own, [(first.criterion, "none")], {first.criterion: said})
    trust = trust_of(reports, SETTLE)
    assert (trust.audited, trust.right) == (1, 0)
    assert trust.opened == []
    assert [one.answer for one in sample(checkable(reports))] == ["wrong"]


def test_what_a_person_decided_says_more_than_the_answer_before():
    said = {"verdict": "full", "settled": True, "probability": 0.98}
    decided = {"by": "", "at": "", "before": "full"}
    kept = criterion("v_A", probability=1.0, decided=decided)
    trust = trust_of([report("s1", [kept], [("audit:v_A", "wrong; said=full")], {"v_A": said})], SETTLE)
    assert (trust.right, trust.opened) == (1, [])


# Marking ------------------------------------------------------------------------------------------


def test_what_is_opened_waits_between_nothing_and_everything_and_keeps_what_was_said():
    task = task_for("pump", n=7)
    judgement = judge(task, handed_in(task, drawn_nodes(task), "sheet"))
    first = next(one for one in judgement.outcomes if one.verdict == "full")
    like = LikeDocument(criterion=first.criterion, verdict="full", mistake=None, most=first.probability)
    opened = opened_by_audit(judgement, task.rubric, [like])
    (waits,) = [one for one in opened.outcomes if one.verdict == "review"]
    assert (waits.criterion, waits.shares, waits.proposed_verdict) == (first.criterion, (0.0, 1.0), "full")
    assert waits.reasons[0].code == OPENED
    assert opened.score.high == judgement.score.total
    assert opened.score.low < judgement.score.total
    assert opened.score.total is None
    told = with_said(report_of(task, opened, "s01"), judgement, set())
    (said,) = told.said.values()
    assert (said.verdict, said.settled, said.probability) == ("full", True, first.probability)
    assert [one.said for one in checkable([told])] == [
        one.said for one in checkable([report_of(task, judgement, "s01")])
    ]
    less = like.model_copy(update={"most": first.probability - 1e-6})
    assert opened_by_audit(judgement, task.rubric, [less]) is judgement


# Where from ---------------------------------------------------------------------------------------

STRAIGHT, SLANTED = [0.0, 0.0, 1.0], [2e-4, 0.0, 1.0]


def read_from(one, method, last_row):
    """The report as read from a page that was registered so."""
    sheet = {
        "method": method, "px_per_mm": 11.8, "rotation_deg": 0.0, "residual_mm": 0.05,
        "mm_to_px": [[11.8, 0.0, 0.0], [0.0, 11.8, 0.0], last_row],
    }  # fmt: skip
    page = {"source": "a.jpg", "page": 1, "student_id": None, "sheet": sheet, "figures": {}}
    return ReportDocument.model_validate({**one.model_dump(), "reading": {"sheets": [page]}})


def test_what_was_said_is_held_against_what_was_found_by_where_it_was_read():
    first, second, third, fourth, *_ = answered(90)[0]
    reports = [
        read_from(first, "markers", STRAIGHT), read_from(second, "frame", STRAIGHT),
        read_from(third, "markers", SLANTED), fourth,
    ]  # fmt: skip
    found = trust_of(reports, SETTLE).reliability
    assert [one.source for one in found] == ["printed", "plain", "photo", "entered"]
    assert all((one.count, one.right) == (3, 3) for one in found)
