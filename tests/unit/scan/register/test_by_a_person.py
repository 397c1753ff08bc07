"""Pages whose corners or turn a person gave."""

import cv2
import numpy as np
import pytest

from grader.records import Page
from grader.scan.register.registration import register
from tests.unit.scan.register.places import apply
from tests.unit.scan.register.test_plain import GRID_MM, off_mm, painted, scale_off, scanner

CORNERS_MM = np.array([(0, 0), (420, 0), (420, 297), (0, 297)], dtype=float)
POINTED_MM = 2.5
"""A sheet known by corners that are pointed at with errors of one millimetre."""
RULED_MM = 0.4


def corners_of(matrix, error_px=0.0, seed=0):
    errors = np.random.default_rng(seed).normal(0, error_px, (4, 2))
    return [tuple(corner) for corner in (apply(matrix, CORNERS_MM) + errors).tolist()]


def registered(grey, corners=(), **about):
    return register(Page("photo.jpg", 1, grey, **about), corners)[0]


def part_of(matrix, shape):
    """A sheet without frame and title block in the middle of a larger picture of no known resolution."""
    small = np.diag([0.62, 0.62, 1.0]) @ matrix
    small[:2, 2] += 300
    grey = painted(small, (shape[0], shape[1]), frame=None, block=False, bed=248)
    return small, grey


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_page_of_unknown_scale_is_placed_by_its_corners(turns):
    matrix, grey = part_of(*scanner(turns=turns, skew_deg=3.0))
    unsure = registered(grey)
    assert "scale_unknown" in [problem.code for problem in unsure.problems]
    sheet = registered(grey, corners_of(matrix, error_px=2.0))
    assert sheet.method == "corners"
    assert off_mm(sheet, matrix) < POINTED_MM
    assert scale_off(sheet, matrix) < 3.0
    assert sheet.rotation_deg == pytest.approx((3.0 - 90.0 * turns) % 360.0, abs=1.0)


def test_corners_in_perspective_are_those_of_a_photo():
    matrix, shape = scanner()
    bent = np.array([[1, 0.03, 0], [-0.02, 1, 0], [3e-5, 4e-5, 1]]) @ matrix
    grey = painted(bent, shape, frame=None, block=False, bed=248)
    sheet = registered(grey, corners_of(bent))
    assert off_mm(sheet, bent) < 0.1


def test_a_frame_that_lies_there_makes_the_corners_better():
    matrix, shape = scanner(bed_mm=30, skew_deg=1.0)
    grey = painted(matrix, shape)
    sheet = registered(grey, corners_of(matrix, error_px=4.0))
    assert off_mm(sheet, matrix) < RULED_MM
    assert sheet.scale_se < 0.002


def test_corners_decide_against_what_lies_elsewhere():
    matrix, shape = scanner(bed_mm=30)
    grey = painted(matrix, shape)
    moved = np.array([[1, 0, 60.0], [0, 1, 45.0], [0, 0, 1]]) @ matrix
    sheet = registered(grey, corners_of(moved))
    assert np.abs(apply(sheet.mm_to_px, GRID_MM) - apply(moved, GRID_MM)).max() < 1.0


@pytest.mark.parametrize("turn", [0, 180])
def test_a_sheet_that_shows_nothing_of_its_turn_is_upright_as_a_person_says(turn):
    matrix, shape = scanner(turns=turn // 90, bed_mm=8)
    grey = painted(matrix, shape, block=False)
    sheet = registered(grey, dpi=(150.0, 150.0), turn_deg=turn, turn_is_sure=True)
    assert abs((sheet.rotation_deg - turn + 180.0) % 360.0 - 180.0) < 0.5
    assert "upright_unsure" not in {problem.code for problem in sheet.problems}


def test_a_person_is_right_against_the_title_block():
    matrix, shape = scanner(bed_mm=8)
    grey = painted(matrix, shape)
    sheet = registered(grey, dpi=(150.0, 150.0), turn_deg=180, turn_is_sure=True)
    assert sheet.rotation_deg == pytest.approx(180.0, abs=0.5)


def test_a_turn_that_the_picture_cannot_have_leaves_the_page_refused_or_by_its_resolution():
    matrix, shape = scanner(bed_mm=8)
    grey = cv2.GaussianBlur(painted(matrix, shape), (0, 0), 0.5)
    sheet = registered(grey, dpi=(150.0, 150.0), turn_deg=90, turn_is_sure=True)
    assert not sheet or sheet.method == "combined"
