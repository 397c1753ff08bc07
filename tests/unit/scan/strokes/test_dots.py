"""Lines of which a black and white scan leaves dots are joined; dots that make no line are not."""

import cv2
import numpy as np
import pytest

from grader.records import Page
from grader.scan.decode.pages import is_blank
from grader.scan.pixels import is_dotted
from grader.scan.strokes.ink import joined_dots
from grader.scan.strokes.seeds import find_seeds

PX_PER_MM = 11.81
ENDS = ((150, 130), (1000, 620))


def line_page(left):
    """One bit, a line of 0.35 mm of which this share of the pixels is left, at random."""
    page = np.full((780, 1180), 255, np.uint8)
    cv2.line(page, *ENDS, 0, 4)
    lost = np.random.default_rng(3).random(page.shape) > left
    page[lost] = 255
    return page


def dithered(tone):
    """An area of a light tone, by error diffusion on average: dots at random places of a grid."""
    page = np.full((780, 1180), 255, np.uint8)
    lot = np.random.default_rng(5).random((260, 394)) < tone
    page[::3, ::3][lot] = 0
    return page


def pieces(page):
    """Lengths of straight runs, mm, found on a page at 300 dpi."""
    ends = find_seeds(cv2.resize(255 - page, None, fx=0.5, fy=0.5, interpolation=cv2.INTER_AREA)).ends
    return np.hypot(*(ends[:, 1] - ends[:, 0]).T) / 6.0


@pytest.mark.parametrize("left", [0.25, 0.35, 0.5])
def test_a_row_of_dots_becomes_a_line(left):
    page = line_page(left)
    assert is_dotted(page)
    joined = joined_dots(page, PX_PER_MM)
    along = np.linspace(0.1, 0.9, 60)[:, None] * (np.array(ENDS[1]) - ENDS[0]) + ENDS[0]
    column, row = np.rint(along).astype(int).T
    # Darker than the faintest ink that counts, nowhere interrupted.
    assert joined[row, column].max() < 255 - 25
    assert pieces(joined).max() > 2.0 * pieces(page).max(initial=0.5)


def test_dots_of_stretched_contrast_are_joined_and_those_on_grey_paper_are_not():
    tones = np.random.default_rng(7).integers(-40, 1, (780, 1180))
    page = np.where(line_page(0.35) == 0, 140 + tones, 255).astype(np.uint8)
    assert is_dotted(page)
    assert pieces(joined_dots(page, PX_PER_MM)).max() > 2.0 * pieces(page).max(initial=0.5)
    assert not is_dotted(np.minimum(page, 245))


def test_a_line_of_dots_ends_where_its_dots_end():
    joined = joined_dots(line_page(0.5), PX_PER_MM)
    along = (np.array(ENDS[1]) - ENDS[0]) / np.hypot(*np.subtract(ENDS[1], ENDS[0]))
    inside, outside = (np.rint(ENDS[1] + mm * PX_PER_MM * along).astype(int) for mm in (-0.7, 0.9))
    middle = 255 - int(joined[375, 575])
    assert 255 - int(joined[inside[1], inside[0]]) > 0.5 * middle
    assert 255 - int(joined[outside[1], outside[0]]) < 0.5 * middle


@pytest.mark.parametrize("tone", [0.05, 0.2, 0.5])
def test_a_dithered_area_gives_no_lines(tone):
    page = dithered(tone)
    assert is_dotted(page)
    found = pieces(joined_dots(page, PX_PER_MM))
    assert found.max(initial=0.0) < 4.0


def test_any_other_page_is_left_as_it_is():
    copy = line_page(1.0)
    grey = cv2.GaussianBlur(line_page(0.35), (0, 0), 1.0)
    for page in (copy, grey):
        assert not is_dotted(page)
        assert joined_dots(page, PX_PER_MM) is page


def test_a_page_of_faint_lines_is_not_blank_and_one_of_pepper_is():
    page = np.full((3508, 4961), 255, np.uint8)
    for row in range(800, 2800, 400):
        cv2.line(page, (900, row), (2900, row + 300), 0, 4)
    page[np.random.default_rng(3).random(page.shape) > 0.2] = 255
    assert not is_blank(Page("copy.tif", 1, page))
    pepper = np.full(page.shape, 255, np.uint8)
    pepper.reshape(-1)[np.random.default_rng(4).integers(0, pepper.size, 150)] = 0
    assert is_blank(Page("back.tif", 1, pepper))
