"""Parts of a sheet given from the truth, for what perfect ones would bring."""

from pathlib import Path

import numpy as np
import pytest

from grader.records import (
    HEAD_AHEAD,
    HEAD_BACK,
    NO_TIPS,
    TAIL_AHEAD,
    TAIL_BACK,
    Ink,
    InkMap,
    PageRef,
    ScannedPage,
    Strokes,
)
from tests.bench.given_truth import TruePage, along, with_both, with_tips

STROKE = np.array([[10.0, 10.0], [50.0, 10.0]])
OTHER = np.array([[10.0, 30.0], [10.0, 60.0]])
VECTOR = np.array([[45.0, 10.1], [20.0, 10.2]])


def test_a_vector_lies_along_a_stroke_in_either_sense_and_not_beside_it():
    assert along(STROKE, VECTOR) == pytest.approx((35.0, 10.0))
    assert along(STROKE[::-1], VECTOR) == pytest.approx((5.0, 30.0))
    assert along(STROKE, VECTOR + np.array([0.0, 1.0])) is None
    assert along(STROKE, VECTOR + np.array([40.0, 0.0])) is None
    assert along(STROKE, np.array([[20.0, 10.0], [20.5, 10.0]])) is None


@pytest.fixture
def page():
    """A page with two strokes, on the first of which a vector was drawn."""
    same = np.full(2, 0.3)
    strokes = Strokes(np.stack([STROKE, OTHER]), same, same, same, np.full((2, 2), 0.8), same)
    where = InkMap(np.zeros((9, 9), np.uint8), 6.0)
    ink = Ink(strokes, np.zeros((0, 3)), np.zeros((0, 4)), where, tips=NO_TIPS)
    return TruePage(ScannedPage(PageRef("sheet", path=Path("sheet.png")), ink=ink), {}, VECTOR[None])


def test_tips_lie_where_the_vector_ends_on_its_stroke(page):
    tips = with_tips(page).ink.tips
    assert tips.stroke.tolist() == [0, 0]
    assert dict(zip(tips.kind.tolist(), tips.along.tolist(), strict=True)) == pytest.approx(
        {HEAD_BACK: 10.0, TAIL_BACK: 35.0}
    )


def test_a_vector_given_as_a_stroke_replaces_what_was_found_along_it(page):
    ink = with_both(page).ink
    other, given = ink.strokes.ends
    assert other.tolist() == OTHER.tolist()
    assert given[0] - VECTOR[0] == pytest.approx([0.15, 0.0], abs=0.01)
    assert sorted(ink.tips.kind.tolist()) == [HEAD_AHEAD, TAIL_AHEAD]
    assert ink.tips.stroke.tolist() == [1, 1]
