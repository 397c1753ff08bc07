"""Where on the paper something was read: by way of the picture's pixels, whatever the registration."""

from collections.abc import Mapping
from typing import Any

import numpy as np

from grader.records import FloatArray, Sheet
from reference.geometry import ComplexArray

_PAPER_WIDTH_MM = 420.0
_FAR_MM = (60 - 60j, 360 - 60j, 60 - 240j)
"""A corner of the drawing, and places far along and far down from it."""


class OnPaper:
    """Sheet millimetres as read, to the true millimetres of the paper.

    A hand-ruled frame or a paper's edge gives the sheet's millimetres another origin than the truth's.
    So a place is followed to its pixel and from there by the truth's own map: what is left is the error
    of the reading, not that of the origin. Scale and turn are told apart.
    """

    def __init__(self, truth: Mapping[str, Any], sheet: Sheet, shape: tuple[int, ...]) -> None:
        self.truth, self.sheet, self.shape = truth, sheet, shape

    def __call__(self, at: ComplexArray) -> ComplexArray:
        """Complex (n,) as read to complex (n,) in truth, y up."""
        px = self.pixels(at)
        lens = self.sheet.lens
        if lens is not None and self.sheet.mm_to_px is lens.straight:
            height, width = self.shape[:2]
            centre = np.array([(width - 1) / 2.0, (height - 1) / 2.0])
            arm = (px - centre) / np.hypot(width / 2.0, height / 2.0)
            px = centre + (px - centre) * (1.0 + lens.bend * (arm**2).sum(axis=1, keepdims=True))
        true = true_places(self.truth, np.asarray(px))
        return np.asarray(true[:, 0] - 1j * true[:, 1])

    def pixels(self, at: ComplexArray) -> FloatArray:
        """Pixels (n, 2) of the page as it was read."""
        lifted = np.column_stack([at.real, -at.imag, np.ones(len(at))]) @ self.sheet.mm_to_px.T
        return np.asarray(lifted[:, :2] / lifted[:, 2:])

    def back(self, true: ComplexArray) -> ComplexArray:
        """Places in truth as they would be read: by the affine map that undoes this one best."""
        grid = np.array([complex(x, -y) for x in (20, 150, 280, 400) for y in (20, 110, 200, 280)])
        there = self(grid)
        columns = np.column_stack([there, np.conj(there), np.ones(len(there))])
        weights = np.linalg.lstsq(columns, grid, rcond=None)[0]
        return np.asarray(np.column_stack([true, np.conj(true), np.ones(len(true))]) @ weights)

    def scale_and_turn(self) -> tuple[FloatArray, FloatArray]:
        """Errors of scale (relative) and turn (degrees), along the sheet and across it: (2,) each."""
        near, along, across = _FAR_MM
        ends = self(np.array(_FAR_MM))
        spans = (ends[1:] - ends[0]) / np.array([along - near, across - near])
        return np.asarray(np.abs(spans) - 1.0), np.degrees(np.angle(spans))


def true_places(truth: Mapping[str, Any], px: FloatArray) -> FloatArray:
    """Stored pixels (n, 2) to the sheet's true millimetres (n, 2), y down, by the truth's own map."""
    lens = truth.get("lens")
    if lens:
        centre = np.array(lens.get("centre") or (lens["cx"], lens["cy"]))
        arm = px - centre
        px = centre + arm * (1.0 + lens["k1"] * (arm**2).sum(axis=1, keepdims=True) / lens["r"] ** 2)
    lifted = np.column_stack([px, np.ones(len(px))]) @ np.linalg.inv(np.array(truth["homography"])).T
    flat = lifted[:, :2] / lifted[:, 2:]
    bow = truth.get("curl_mm") or 0.0
    lift = bow * np.sin(np.pi * np.clip(flat[:, 0] / _PAPER_WIDTH_MM, 0.0, 1.0))
    return np.asarray(flat + np.column_stack([np.zeros_like(lift), lift]))
