"""Pages of calculations: told from drawings, kept, and without a say in the mark."""

from dataclasses import replace
from functools import cache

import cv2
import numpy as np
import pytest
from PIL import Image

from grader.files import samples_folder
from grader.pipeline import mark, read_submission, scan
from grader.records import PageRef
from grader.rubric import asked_of, rubric_of
from grader.scan.decode.pages import is_writing
from grader.scan.page import CALCULATIONS, open_page
from grader.tables.measurements import StudentSubmission
from reference.authored.assignment import Variant, load_assignment
from tests.bench.calculations import page_of_writing

PALE = 0.93
"""Share of light that a line leaves which no stroke is found in."""


page_of = cache(page_of_writing)


@pytest.fixture
def written():
    return page_of(12)


def with_line(page, start, end):
    """The page with a pale line between two places, shares of its width and height."""
    light, (high, wide) = np.full(page.grey.shape, 255, np.uint8), page.grey.shape
    ends = [(round(x * wide), round(y * high)) for x, y in (start, end)]
    cv2.line(light, *ends, round(255 * PALE), round(max(high, wide) / 700), cv2.LINE_AA)
    return replace(page, grey=cv2.multiply(page.grey, light, scale=1.0 / 255.0))


@pytest.fixture(scope="module")
def file(tmp_path_factory):
    path, page = tmp_path_factory.mktemp("calculations") / "s01_3.png", page_of(12)
    Image.fromarray(page.grey).save(path, dpi=page.dpi)
    return PageRef(path.name, path=path)


@pytest.mark.parametrize("seed", [7, 12, 15])
def test_pages_of_formulas_and_sentences_are_recognised(seed):
    assert is_writing(page_of(seed))


@pytest.mark.parametrize("line", [((0.6, 0.86), (0.9, 0.97)), ((0.93, 0.75), (0.93, 0.95))])
def test_a_pale_vector_beside_writing_makes_the_page_a_drawing(written, line):
    assert not is_writing(with_line(written, *line))


def test_a_short_text_is_no_page_of_calculations(written):
    top, high = np.full_like(written.grey, 245), len(written.grey)
    top[: high // 8] = written.grey[: high // 8]
    assert not is_writing(replace(written, grey=top))


def test_such_a_page_is_named_and_not_searched_for_strokes(file):
    page = open_page(file)
    assert [problem.code for problem in page.problems] == [CALCULATIONS]
    assert (page.ink, page.sheet, page.flaws) == (None, None, ())


def test_a_person_who_gives_the_corners_is_believed(file, written):
    high, wide = written.grey.shape
    corners = ((0.0, 0.0), (wide - 1.0, 0.0), (wide - 1.0, high - 1.0), (0.0, high - 1.0))
    assert CALCULATIONS not in [one.code for one in open_page(replace(file, corners_px=corners)).problems]


def test_calculations_change_neither_status_nor_points(file):
    pump = load_assignment("pump")
    rubric = rubric_of(pump)
    samples = samples_folder() / "pump"
    drawn = [PageRef(name, path=samples / name) for name in ("s01_1.jpg", "s01_2.jpg")]
    reports = []
    for refs in (drawn, [*drawn, file]):
        asked = asked_of(pump, rubric)
        submission = StudentSubmission("s01", Variant(7), tuple(refs), {})
        pages = read_submission(submission, [scan(ref, asked) for ref in refs], pump, asked)
        reports.append(mark(submission, pages, pump, rubric)[0])
    without, beside = reports
    assert (beside.status, beside.score, beside.criteria) == (without.status, without.score, without.criteria)
    (told,) = [one for one in beside.problems if one.file == file.file]
    assert told.code == CALCULATIONS
    assert len(beside.reading.sheets) == 3
