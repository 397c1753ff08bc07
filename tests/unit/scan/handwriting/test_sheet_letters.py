"""Letters found on drawings whose letters are known; written by the simulated hand, never trained on."""

from dataclasses import replace

import numpy as np
import pytest

from grader.reading.page_scale import UPRIGHT_UNSURE
from grader.records import Page, PageRef, Sheet
from grader.scan.handwriting.letters import (
    CROP_PX,
    STAND_UPRIGHT,
    _in_words,
    _tiles,
    crops,
    find_letters,
    upright_nats,
)
from grader.scan.handwriting.model import COLUMN, JUNK, SIGNS, TWINS, normalised, recognise
from grader.scan.page import open_page
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink
from reference.authored.assignment import load_assignment
from samples.simulation import CAREFUL, CLEAN_SCAN, PageStyle, Settings, simulate

READ_SHARE, TOUCHING_SHARE = 0.85, 0.45
"""Least share read of a careful drawing's node letters; of those that touch lines."""


def sheet_of(page_style, seed):
    assignment = load_assignment("pump")
    settings = Settings(hand=CAREFUL, scan=CLEAN_SCAN, page=page_style)
    sheet = simulate(assignment, assignment.variant(7), seed, settings)[0]
    page = Page("s.png", 1, np.ascontiguousarray(sheet.image), (300.0, 300.0))
    placed = rectify(page)
    assert isinstance(placed, Sheet)
    return find_ink(page, placed), sheet.truth


@pytest.fixture(scope="module")
def drawn():
    return sheet_of(PageStyle(language="en"), 5)


def share_read(ink, truth):
    """The share of nodes' letters that are read."""
    letters = find_letters(ink)
    named = letters.probability.argmax(axis=1)
    x, y = letters.at.real, -letters.at.imag
    nodes = {name for figure in truth["figures"].values() for name in figure["nodes"]}
    signs = [label["signs"][0] for label in truth["labels"] if label["names"] in nodes]
    read = 0
    for sign, left, top, right, bottom in signs:
        here = (x > left - 0.4) & (x < right + 0.4) & (y > top - 0.4) & (y < bottom + 0.4)
        read += bool((named[here] == letters.column[sign]).any())
    assert len(signs) >= 12
    return read / len(signs)


def test_most_letters_of_a_careful_drawing_are_read(drawn):
    assert share_read(*drawn) >= READ_SHARE


def test_letters_on_lines_are_read():
    drawings = [sheet_of(PageStyle(language="en", letters_touch=1.0), seed) for seed in (5, 6)]
    assert np.mean([share_read(*drawing) for drawing in drawings]) >= TOUCHING_SHARE


def test_letters_tell_a_sheet_without_a_title_block_that_was_scanned_upside_down(tmp_path):
    assignment = load_assignment("pump")
    scan = replace(
        CLEAN_SCAN, dpi=150.0, dpi_tag=150.0, quarter_turns=2, container="png", paper=(255, 255, 255)
    )
    settings = Settings(hand=CAREFUL, scan=scan, page=PageStyle(language="en", title_block="none"))
    sheet = simulate(assignment, assignment.variant(7), 5, settings)[0]
    page = open_page(PageRef("scan.png", path=sheet.save(tmp_path / "scan")))
    assert page.sheet is not None
    assert page.sheet.rotation_deg == pytest.approx(180.0, abs=1.0)
    assert UPRIGHT_UNSURE not in {problem.code for problem in page.problems}
    assert upright_nats(page.ink) > STAND_UPRIGHT


def test_blank_paper_has_no_letters(drawn):
    ink, _ = drawn
    blank = replace(ink, where=replace(ink.where, ink=np.zeros_like(ink.where.ink)))
    assert len(find_letters(blank)) == 0
    assert find_letters(blank).probability.shape == (0, len(SIGNS))


def test_words_are_no_letters_of_nodes():
    in_a_row = [[20.0 * column, 50.0, 14.0, 20.0] for column in range(9)]
    alone = [[300.0, 50.0, 14.0, 20.0], [20.0, 150.0, 14.0, 20.0]]
    assert _in_words(np.array(in_a_row + alone)).tolist() == 9 * [True] + 2 * [False]


def test_ink_beside_strokes_lies_within_a_tile_and_ink_far_off_is_passed_over():
    grey = np.zeros((400, 900), dtype=np.uint8)
    drawn = np.zeros_like(grey)
    grey[200:203, 40:300] = drawn[200:203, 40:300] = 255
    for x, y in ((60, 170), (295, 230), (800, 60)):
        grey[y : y + 14, x : x + 12] = 255
    tiles = np.array(_tiles(grey, drawn))

    def looked_at(x, y):
        # The tiles' margins are left to the neighbours.
        return ((tiles + 16 <= [x, y]) & (tiles + 80 > [x, y])).all(axis=1).any()

    assert looked_at(66, 177)
    assert looked_at(301, 237)
    assert not looked_at(806, 67)


def test_a_crop_is_centred_on_its_box():
    grey = np.zeros((100, 100), dtype=np.uint8)
    grey[40:60, 30:40] = 255
    (picture,) = crops(grey, np.array([[30.0, 40.0, 10.0, 20.0]]))
    rows, columns = np.flatnonzero(picture.max(axis=1) > 127), np.flatnonzero(picture.max(axis=0) > 127)
    assert picture.shape == (CROP_PX, CROP_PX)
    assert rows[0] + rows[-1] == pytest.approx(CROP_PX - 1, abs=1)
    assert columns[0] + columns[-1] == pytest.approx(CROP_PX - 1, abs=1)
    assert len(rows) == pytest.approx(20.0 / (1.4 * 20.0) * CROP_PX, abs=1.5)


def test_a_row_of_probabilities_is_one_and_boxes_lie_on_the_paper(drawn):
    ink, _ = drawn
    letters = find_letters(ink)
    assert len(letters) > 12
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
