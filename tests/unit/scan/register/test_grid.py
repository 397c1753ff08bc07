"""Graph paper: drawn lines are told from its grid."""

from pathlib import Path

import cv2
import numpy as np
import pytest

from grader.scan.decode.pages import page_of
from grader.scan.pixels import flatten
from grader.scan.register.lines import long_lines, without_grid

REAL = Path(__file__).resolve().parents[5] / "shared" / "real" / "hdBPMN"


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


def lines_of(grey):
    """All long lines, and those that are no grid's."""
    lines = long_lines(flatten(grey))
    return lines, without_grid(lines, grey.shape)


@pytest.mark.parametrize("pitch", [(29.53, 29.53), (39.5, 39.3), (31.0, 31.12)])
def test_printed_squares_are_no_lines_of_the_sheet(pitch):
    lines, drawn = lines_of(squared(pitch))
    assert len(lines) > 80
    assert len(drawn) <= 8


def test_a_frame_ruled_on_grid_lines_is_no_part_of_the_grid():
    _, drawn = lines_of(squared((39.0, 39.0)))
    assert sum(line.dark > 0.4 for line in drawn) >= 4


def test_a_title_block_is_no_grid():
    grey = np.full((1754, 2480), 250, np.uint8)
    for k in range(5):
        cv2.line(grey, (1400, 1500 + 40 * k), (2400, 1500 + 40 * k), 60, 3)
    lines, drawn = lines_of(grey)
    assert len(lines) >= 4
    assert drawn == lines


@pytest.mark.skipif(not REAL.is_dir(), reason="the real images are not here")
@pytest.mark.parametrize("name", ["ex07_writer0049", "ex08_writer0049", "ex10_writer0077"])
def test_the_squares_of_a_real_pad_are_left_out(name):
    lines, drawn = lines_of(page_of(REAL / f"{name}.jpg", 1).grey)
    assert len(drawn) < 0.5 * len(lines)
