"""Quadrilaterals that are passed over without a map are those whose map would be refused."""

import numpy as np

from grader.scan.pixels import mapped
from grader.scan.register.fitting import affine_of
from grader.scan.register.homography import PAPER
from grader.scan.register.hypotheses import (
    _SCANNED_WITHIN,
    Resolution,
    _is_possible,
    _may_be_as_large,
)
from reference.drawing.canvas import MM_PER_INCH

KNOWN = Resolution((300.0, 300.0), stated=True, is_sure=True)
USUAL = np.log(300.0 / MM_PER_INCH)


def test_every_map_of_a_possible_scale_has_sides_that_are_looked_at():
    rng = np.random.default_rng(3)
    for _ in range(300):
        scales = USUAL + rng.uniform(-1.5, 1.5, 2) * _SCANNED_WITHIN
        params = np.array([*scales, rng.uniform(-np.pi, np.pi), 2480.0, 1754.0])
        corners = mapped(affine_of(params), PAPER.corners())
        assert _may_be_as_large(corners[None], PAPER, KNOWN).all() or not _is_possible(params, KNOWN)


def test_lines_of_a_drawing_that_are_no_frame_are_passed_over():
    inner = np.array([[100.0, 50.0], [300.0, 50.0], [300.0, 250.0], [100.0, 250.0]])
    assert not _may_be_as_large(inner[None] * np.exp(USUAL), PAPER, KNOWN).any()
