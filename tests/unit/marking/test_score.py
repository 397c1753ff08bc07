"""Verdicts to points."""

import pytest

from grader.documents import Quantity, Tolerance
from grader.marking.mark import score
from grader.outcomes import Outcome
from grader.rubric import CriterionTable, RubricFile, ToleranceTable
from reference.authored.toml_file import Text


def criterion(name, points, **more):
    return CriterionTable(id=name, title=Text(en=name), points=points, vector=f"v_{name}", **more)


RUBRIC = RubricFile(
    schema_version=1,
    id="three",
    title=Text(en="three"),
    criterion=[criterion("A", 1.0), criterion("B", 3.0), criterion("C", 2.0)],
)


def outcome(name, verdict, possible=None):
    none = Quantity()
    ends = possible or (verdict, verdict)
    return Outcome(name, f"v_{name}", verdict, none, none, Tolerance(), 1.0, (), ends)


def scored(*verdicts):
    outcomes = [
        outcome(name, *one) if isinstance(one, tuple) else outcome(name, one)
        for name, one in zip("ABC", verdicts, strict=True)
    ]
    return score(RUBRIC, outcomes)


@pytest.mark.parametrize(
    ("verdicts", "total"),
    [
        (("full", "full", "full"), 6.0),
        (("full", "follow_through", "none"), 4.0),
        (("full", "partial", "none"), 2.5),
        (("none", "none", "none"), 0.0),
    ],
)
def test_points_add_up(verdicts, total):
    found = scored(*verdicts)
    assert (found.total, found.low, found.high, found.maximum) == (total, total, total, 6.0)


def test_what_is_not_judged_counts_neither_for_nor_against():
    found = scored("full", "partial", "not_judged")
    assert found.points == {"A": 1.0, "B": 1.5, "C": None}
    assert found.total == pytest.approx(6.0 * 2.5 / 4.0)


def test_there_is_no_total_while_anything_is_under_review():
    found = scored("full", ("review", ("none", "partial")), ("review", ("partial", "full")))
    assert found.total is None
    assert (found.low, found.high) == (2.0, 4.5)
    assert found.points == {"A": 1.0, "B": None, "C": None}


def test_a_review_beside_what_is_not_judged_is_scaled_too():
    found = scored("not_judged", ("review", ("none", "full")), "full")
    assert (found.total, found.low, found.high) == (None, pytest.approx(2.4), 6.0)


def test_where_nothing_was_judged_nothing_is_said():
    found = scored("not_judged", "not_judged", "not_judged")
    assert (found.total, found.low, found.high) == (None, 0.0, 6.0)


def test_half_points_are_the_rubrics_share():
    generous = RUBRIC.model_copy(update={"tolerance": ToleranceTable(partial_share=0.75)})
    outcomes = [outcome("A", "full"), outcome("B", "partial"), outcome("C", "none")]
    assert score(generous, outcomes).total == pytest.approx(1.0 + 0.75 * 3.0)
