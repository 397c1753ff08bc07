"""A photocopy's drawing may be of any size: its frame tells, and without one the scale is told as rough."""

from dataclasses import replace

import numpy as np
import pytest

from grader.scan.decode.pages import page_of
from grader.scan.register.registration import rectify
from grader.texts.spoken import message
from reference.authored.assignment import load_assignment
from samples.simulation import any_settings, simulate

PUMP = load_assignment("pump")
RULED = 0.0005
"""Relative error of a scale by a printed frame."""
STANDARD_ERRORS = 3.0


def copied(frame, copy_scale, tmp_path):
    settings = any_settings(6, device="copier", dpi=200.0, mistakes=0.0)
    page = replace(settings.page, frame=frame, frame_by="print", title_block="rows", squared_mm=0.0)
    scan = replace(settings.scan, copy_scale=copy_scale, dpi_tag=200.0, quarter_turns=0)
    (drawn, *_) = simulate(PUMP, PUMP.variant(7), 6, replace(settings, page=page, scan=scan))
    return rectify(page_of(drawn.save(tmp_path / "copy"), 1)), drawn.truth["px_per_mm"]


@pytest.mark.parametrize("copy_scale", [0.98, 0.995, 1.01])
def test_the_frame_of_a_copy_tells_its_scale_alone(copy_scale, tmp_path):
    sheet, px_per_mm = copied("iso", copy_scale, tmp_path)
    assert sheet.px_per_mm == pytest.approx(px_per_mm, rel=RULED)


def test_a_copy_without_a_frame_says_how_little_its_scale_is_known(tmp_path):
    sheet, px_per_mm = copied("none", 0.98, tmp_path)
    assert abs(np.log(sheet.px_per_mm / px_per_mm)) < STANDARD_ERRORS * sheet.scale_se
    assert any("copy" in message(problem) for problem in sheet.problems)
