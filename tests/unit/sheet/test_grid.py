"""Graph paper: its grid is found as a ruler, and drawn lines are told from it."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.intake import page_of
from grader.pixels import flatten
from grader.sheet.grid import find_grid
from grader.sheet.longlines import long_lines

REAL = Path(__file__).resolve().parents[4] / "shared" / "real" / "hdBPMN"
PITCH_SHARE = 0.001
"""Bound on the relative error of the pitch, and on the unequal scale."""
INCH_MM = 25.4


def squared(pitch, skew=0.01, size=(1754, 2480)):
    """Paper with faint squares of (x, y) pixels, askew, and a dark frame upon two of its lines."""
    scale = 4
    grey = np.full(size, 248, np.uint8)
    for k in range(-5, 120):
        for across in (True, False):
            at = k * pitch[1 if across else 0]
            ends = [(-99.0, at - 99.0 * skew), (3000.0, at + 3000.0 * skew)]
            if not across:
                ends = [(at + 99.0 * skew, -99.0), (at - 3000.0 * skew, 3000.0)]
            dark = 60 if k in {8, 40} else 200
            fixed = np.rint(np.array(ends) * 2**scale).astype(np.int32)
            cv2.polylines(
                grey, [fixed], isClosed=False, color=dark, thickness=2, lineType=cv2.LINE_AA, shift=scale
            )
    noise = np.random.default_rng(2).normal(0.0, 2.0, size)
    return np.clip(cv2.GaussianBlur(grey, (0, 0), 0.7) + noise, 0, 255).astype(np.uint8)


def grid_of(grey):
    return find_grid(long_lines(flatten(grey)), grey.shape)


@pytest.mark.parametrize("pitch", [(29.53, 29.53), (39.5, 39.3), (31.0, 31.12)])
def test_the_pitch_of_squares_is_found_along_each_axis(pitch):
    grid, drawn = grid_of(squared(pitch))
    across = np.array(pitch) / np.hypot(1.0, 0.01)
    assert np.array(grid.pitch_px) == pytest.approx(across, rel=PITCH_SHARE)
    assert grid.unequal == pytest.approx(pitch[0] / pitch[1] - 1.0, abs=PITCH_SHARE)
    assert len(drawn) <= 8


def test_a_frame_ruled_on_grid_lines_is_no_part_of_the_grid():
    _, drawn = grid_of(squared((39.0, 39.0)))
    assert sum(line.dark > 0.4 for line in drawn) >= 4


def test_a_title_block_is_no_grid():
    grey = np.full((1754, 2480), 250, np.uint8)
    for k in range(5):
        cv2.line(grey, (1400, 1500 + 40 * k), (2400, 1500 + 40 * k), 60, 3)
    grid, drawn = grid_of(grey)
    assert grid is None
    assert len(drawn) >= 4


@pytest.mark.skipif(not REAL.is_dir(), reason="the real images are not here")
@pytest.mark.parametrize(
    ("name", "pitch_mm"),
    # Measured by hand on the pads, at the scanners' nominal 300 dpi.
    [
        ("ex07_writer0049", (None, 4.998)),
        ("ex08_writer0049", (None, None)),
        ("ex10_writer0077", (4.993, 4.987)),
    ],
)
def test_a_real_pad_is_a_ruler(name, pitch_mm):
    grid, _ = grid_of(page_of(REAL / f"{name}.jpg", 1).grey)
    found = np.array(grid.pitch_px) / 300.0 * INCH_MM
    for measured, wanted in zip(found, pitch_mm, strict=True):
        if wanted is not None:
            assert measured == pytest.approx(wanted, rel=PITCH_SHARE)
    assert 0.0 < grid.unequal < 0.004
