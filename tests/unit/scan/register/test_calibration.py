"""The calibration page printed, scanned with known faults, and read back."""

import json
from functools import cache

import cv2
import numpy as np
import pytest
from PIL import Image

from grader.printed.answer_sheet import make_calibration
from grader.records import Unread
from grader.scan.register.calibration import calibrate, residual_map
from tests.inline import planmark
from tests.rendered import rendered

DPI = 200
SCALE = 0.0002
"""Bound on the relative error of a scale."""
ANGLE_DEG = 0.01
LENGTH_MM, PLACE_MM = 0.15, 0.02


@cache
def printed():
    return rendered(make_calibration().pdf, DPI)


def saved(path, grey, dpi=DPI):
    noisy = cv2.GaussianBlur(grey, (0, 0), 0.6) + np.random.default_rng(0).normal(0.0, 3.0, grey.shape)
    tags = {} if dpi is None else {"dpi": (dpi, dpi)}
    Image.fromarray(np.clip(noisy, 0, 255).astype(np.uint8)).save(path, quality=85, **tags)
    return path


def distorted(scale=(1.0, 1.0), shear=0.0, turn_deg=0.5):
    """The page sheared and stretched along its own axes, then laid askew."""
    grey = printed()
    size = np.array(grey.shape[::-1])
    c, s = np.cos(np.radians(turn_deg)), np.sin(np.radians(turn_deg))
    linear = np.array([[c, -s], [s, c]]) @ np.array([[scale[0], shear], [0.0, scale[1]]])
    shift = size / 2 - linear @ (size / 2)
    matrix = np.column_stack([linear, shift])
    return cv2.warpAffine(grey, matrix, grey.shape[::-1], flags=cv2.INTER_CUBIC, borderValue=255)


@pytest.mark.parametrize("turns", [0, 1])
def test_scales_and_skew_of_printer_and_scanner_come_back(tmp_path, turns):
    grey = np.ascontiguousarray(np.rot90(distorted((1.003, 0.999), 0.002), turns))
    found = calibrate(saved(tmp_path / "scan.jpg", grey))
    # The page's pixels are whole numbers: 420 mm at 200 dpi are 3307.09.
    whole = np.array(printed().shape[::-1]) / (np.array([420.0, 297.0]) / 25.4 * DPI)
    assert found.scale_x == pytest.approx(1.003 * whole[0], rel=SCALE)
    assert found.scale_y == pytest.approx(0.999 * whole[1], rel=SCALE)
    assert found.unequal == pytest.approx(1.003 / 0.999 * whole[0] / whole[1] - 1.0, abs=SCALE)
    assert found.skew_deg == pytest.approx(-np.degrees(0.002 / 0.999), abs=ANGLE_DEG)
    assert found.segments.read == found.segments.printed
    assert found.segments.length_worst_mm < 2 * LENGTH_MM
    assert found.segments.place_rms_mm < PLACE_MM
    assert any("from those across" in line for line in found.advice)
    assert residual_map(found).count("<circle") == len(found.points)


def test_a_faultless_scan_needs_nothing(tmp_path):
    found = calibrate(saved(tmp_path / "scan.jpg", printed()))
    assert found.advice == ["printer and scanner are fit for grading"]


def test_a_photo_is_not_taken_for_a_scanner(tmp_path):
    grey = printed()
    high, wide = grey.shape
    seen = np.float32([[90, 60], [wide - 140, 20], [wide - 40, high - 60], [30, high - 20]])
    matrix = cv2.getPerspectiveTransform(np.float32([[0, 0], [wide, 0], [wide, high], [0, high]]), seen)
    photo = cv2.warpPerspective(grey, matrix, (wide, high), borderValue=90)
    found = calibrate(saved(tmp_path / "photo.jpg", photo, dpi=72))
    assert found.camera
    assert (found.scale_x, found.unequal, found.skew_deg) == (None, None, None)
    assert found.segments.read > 0.9 * found.segments.printed
    assert found.segments.place_rms_mm < 2 * PLACE_MM


def test_another_page_says_nothing(tmp_path):
    found = calibrate(saved(tmp_path / "blank.jpg", np.full((2339, 3307), 250, np.uint8)))
    assert isinstance(found, Unread)


def test_the_command_tells_and_writes_what_was_measured(tmp_path):
    scan, svg = saved(tmp_path / "scan.jpg", distorted((1.003, 1.0))), tmp_path / "map.svg"
    told = planmark("calibrate", scan, "--json", "--svg", svg, cwd=tmp_path)
    assert told.returncode == 1
    (document,) = json.loads(told.stdout)
    assert document["unequal"] == pytest.approx(0.003, abs=2 * SCALE)
    assert svg.read_text().startswith("<svg")
    assert "unequal scale +0.3" in planmark("calibrate", scan, cwd=tmp_path).stdout
