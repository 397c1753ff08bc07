"""Reports that contradict themselves are found out, each kind by itself."""

import pytest

from grader.documents import DecidedDocument, MistakeDocument, Quantity
from tests.bench.contradictions import contradictions
from tests.unit.feedback.works import criterion, report

NEAR = Quantity(length_mm=46.9, direction_deg=13.0)
FAR = Quantity(length_mm=61.6, direction_deg=13.0)


def row(verdict="full", points=5.0, said="Right.", **changes):
    return criterion("v_B", verdict, points, feedback=said).model_copy(update={"measured": NEAR, **changes})


def found(*rows, **changes):
    fields = {"mistakes": [], "max_score": 5.0, "score": sum(one.points or 0.0 for one in rows), **changes}
    return [what.removeprefix("v_B: ") for what in contradictions(report(criteria=list(rows), **fields))]


def test_a_sound_report_has_none():
    assert found(row()) == []
    assert found(row("none", 0.0, "It is too long by 15.2 mm (tolerance ±1.0 mm).", measured=FAR)) == []


@pytest.mark.parametrize(
    ("one", "why"),
    [
        (row(measured=FAR), "right, but length_mm beyond the tolerance"),
        (row("none", 0.0, "It is too long."), "loses points, but is within the tolerance"),
        (row(points=4.0), "full, but 4.0 of 5.0 points"),
        (row("none", 0.0, "It could not be read on the sheet.", measured=FAR), "beside a measured value"),
        (row("none", 0.0, "It was read with too little certainty.", measured=FAR), "settled, but"),
        (row("none", 0.0, "It is too long by 3.0 mm.", measured=FAR), "but 15.2 by the numbers shown"),
        (row("none", 0.0, "It points the opposite way.", measured=FAR), "the directions shown are near"),
        (row("none", 0.0, "", measured=FAR), "nothing is said"),
    ],
)
def test_each_kind_is_found(one, why):
    assert any(why in what for what in found(one))


def test_what_a_person_decided_may_be_beyond_a_tolerance():
    decided = DecidedDocument(by="x", at="2026-11-22T10:00:00+00:00", before="none")
    assert found(row(measured=FAR, decided=decided)) == []


def test_numbers_held_against_the_data_are_not_those_of_the_row():
    said = (
        "It may be consistent with your own earlier work; compared with the data: It is too short by 9.0 mm."
    )
    assert found(row("review", None, said), score=None, score_range=(0.0, 5.0)) == []


def test_a_score_that_the_rows_do_not_give_is_found():
    assert any("the rows add up to 5.000" in what for what in found(row(), score=4.2))
    assert found(row(), score=5.5, added=0.5) == []
    waits = row("review", None, "It was read with too little certainty.")
    assert any(
        "settled rows alone" in what for what in found(row(), waits, score=None, score_range=(1.0, 5.0))
    )


def test_a_mistake_that_explains_only_what_is_right_is_found():
    mistake = MistakeDocument(code="wrong_link", at="b", explains=["v_B"], confidence=0.9)
    assert found(row(), mistakes=[mistake]) == ["wrong_link at b explains nothing but what is right"]
