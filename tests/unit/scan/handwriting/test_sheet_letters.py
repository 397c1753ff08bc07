"""Letters found on drawings whose letters are known; written by the simulated hand, never trained on."""

import numpy as np
import pytest

from grader.records import Page, Sheet
from grader.scan.handwriting.letters import find_letters
from grader.scan.handwriting.model import COLUMN, JUNK, SIGNS, TWINS, normalised, recognise
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink
from reference.authored.assignment import load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PageStyle, Settings, simulate

CLEAR_SHARE = 0.75
"""Of the letters clear of the lines of a careful drawing that are to be recognised."""
CLEAR_MM, LONG_MM = 0.6, 6.0


@pytest.fixture(scope="module")
def drawn():
    assignment = load_assignment("pump")
    settings = Settings(hand=CAREFUL, scan=CLEAN_SCAN, page=PageStyle(language="en"))
    sheet = simulate(assignment, assignment.variant(7), 5, settings)[0]
    page = Page("s.png", 1, np.ascontiguousarray(sheet.image), (300.0, 300.0))
    placed = rectify(page)
    assert isinstance(placed, Sheet)
    return find_ink(page, placed), sheet.truth["labels"]


def is_clear(box, strokes):
    """Whether no long stroke comes near a letter."""
    left, top, right, bottom = box
    ends = strokes.ends[np.hypot(*(strokes.ends[:, 1] - strokes.ends[:, 0]).T) >= LONG_MM]
    share = np.linspace(0.0, 1.0, 400)[:, None, None]
    x, y = np.moveaxis(ends[:, 0] + share * (ends[:, 1] - ends[:, 0]), 2, 0)
    near = (x > left - CLEAR_MM) & (x < right + CLEAR_MM) & (y > top - CLEAR_MM) & (y < bottom + CLEAR_MM)
    return not near.any()


def test_most_clear_letters_of_a_careful_drawing_are_recognised(drawn):
    ink, labels = drawn
    letters = find_letters(ink)
    named = letters.probability.argmax(axis=1)
    single = [label for label in labels if label["text"] in set("oabcdABCDp")]
    single = [label for label in single if is_clear(label["box_mm"], ink.strokes)]
    hits = 0
    for label in single:
        left, top, right, bottom = label["box_mm"]
        x, y = letters.at.real, -letters.at.imag
        here = (x > left - 0.4) & (x < right + 0.4) & (y > top - 0.4) & (y < bottom + 0.4)
        hits += bool((named[here] == letters.column[label["text"]]).any())
    assert len(single) >= 4
    assert hits >= CLEAR_SHARE * len(single)


def test_a_row_of_probabilities_is_one_and_boxes_lie_on_the_paper(drawn):
    ink, _ = drawn
    letters = find_letters(ink)
    np.testing.assert_allclose(letters.probability.sum(axis=1), 1.0, rtol=1e-6)
    assert (letters.box_mm[:, :2] > -1.0).all()
    assert (letters.box_mm[:, 0] + letters.box_mm[:, 2] < 421.0).all()
    assert letters.height_mm.max() < 10.0


def test_only_the_boxes_asked_for_are_looked_at(drawn):
    ink, _ = drawn
    everywhere = find_letters(ink)
    x, y = everywhere.at[len(everywhere) // 2].real, -everywhere.at[len(everywhere) // 2].imag
    here = find_letters(ink, [(x - 15.0, y - 15.0, 30.0, 30.0)])
    assert 0 < len(here) < len(everywhere)
    assert (np.abs(here.at.real - x) < 15.0).all()
    assert np.abs(here.at - everywhere.at[len(everywhere) // 2]).min() < 0.2


def test_signs_that_look_alike_share_a_column():
    assert COLUMN["O"] == COLUMN["0"] == COLUMN["o"]
    assert COLUMN["м"] == COLUMN["M"]
    assert set(TWINS.values()) <= set(SIGNS) - {JUNK}
    assert len(set(SIGNS)) == len(SIGNS)


def test_no_pieces_give_no_probabilities():
    assert recognise([], np.zeros((0, 2))).shape == (0, len(SIGNS))


@pytest.mark.parametrize("shape", [(1, 1), (3, 60), (60, 3), (200, 150)])
def test_a_picture_of_any_shape_is_brought_to_one_size(shape):
    picture = normalised(np.full(shape, 255, dtype=np.uint8))
    assert picture.shape == (28, 28)
    assert picture.max() == 255
