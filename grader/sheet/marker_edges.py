"""Corners of printed square markers, from straight lines fitted to their four sides.

Across each side the place where the grey passes half-way from the marker's black to the paper's
white is found by interpolation; a line is fitted to these places, two lines meet in a corner. Blur
and ink gain move opposite sides by the same amount and leave the marker's middle where it is.

Everything is done in the marker's own unit square (corners (0,0), (1,0), (1,1), (0,1)), where a
slanted marker's sides stay straight lines.
"""

from dataclasses import dataclass

import cv2
import numpy as np

from grader.aruco import CELLS
from grader.pixels import BoolArray, robust_lines
from grader.records import FloatArray, GreyImage

_REACH = 0.9 / CELLS
"""How far outward and inward to look, in sides: within the border's cell and the quiet zone."""
_ACROSS = 37
_SAMPLES = 40
_ENDS = 0.12
"""Share of a side left out at each end, where blur rounds the corner."""
_LEAST_CONTRAST = 30.0
_LEAST_SHARE = 0.5
"""Of the places along a side at which an edge must be seen."""
_ROUNDS = 2
_NOISE_FLOOR = 0.0005
"""Of an edge's place, in sides: 0.006 mm."""

_START = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
_ALONG = np.roll(_START, -1, axis=0) - _START
_OUTWARD = np.stack([_ALONG[:, 1], -_ALONG[:, 0]], axis=1)


@dataclass(frozen=True, slots=True)
class Corners:
    """Corners of k markers in the detector's order.

    Attributes
    ----------
    px : (k, 4, 2) pixels
    seen : (k, 4) whether both sides that meet there could be fitted
    """

    px: FloatArray
    seen: BoolArray


def refine(grey: GreyImage, guess_px: FloatArray) -> Corners:
    """Corners at sub-pixel accuracy, from guesses (k, 4, 2) that are good to half a cell."""
    px = np.asarray(guess_px, dtype=np.float64)
    seen = np.zeros(px.shape[:2], dtype=bool)
    for _ in range(_ROUNDS):
        to_px = np.stack([_square_to(corners) for corners in px])
        offsets, found = _edges(grey, to_px)
        lines = robust_lines(
            np.broadcast_to(_T, offsets.shape), offsets, found.astype(np.float64), _NOISE_FLOOR
        )
        good = (found.mean(axis=1) >= _LEAST_SHARE).reshape(-1, 4)
        a, b = lines.a.reshape(-1, 4), lines.b.reshape(-1, 4)
        seen = good & np.roll(good, 1, axis=1)
        unit = _corners(a, b)
        px = np.where(seen[..., None], _project(to_px[:, None], unit), px)
    return Corners(px, seen)


_T = np.linspace(_ENDS, 1.0 - _ENDS, _SAMPLES)
_Y = np.linspace(-_REACH, _REACH, _ACROSS)
_LOOKED_AT = (
    (
        _START[:, None, None, :]
        + _T[None, :, None, None] * _ALONG[:, None, None, :]
        + _Y[None, None, :, None] * _OUTWARD[:, None, None, :]
    )
    .reshape(-1, 2)
    .T.astype(np.float32)
)
"""(2, places) all places of the four sides, in the marker's own square."""


def _square_to(corners: FloatArray) -> FloatArray:
    matrix = cv2.getPerspectiveTransform(_START.astype(np.float32), corners.astype(np.float32))
    return np.asarray(matrix, dtype=np.float64)


def _edges(grey: GreyImage, to_px: FloatArray) -> tuple[FloatArray, BoolArray]:
    """(4k, samples) how far outward the sides are crossed, and where a crossing was seen."""
    matrix = to_px.astype(np.float32)
    mapped = matrix[:, :, :2] @ _LOOKED_AT + matrix[:, :, 2:]
    x, y = (np.ascontiguousarray(mapped[:, k] / mapped[:, 2]).reshape(-1, _ACROSS) for k in (0, 1))
    values = cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return _crossings(values.astype(np.float64).reshape(-1, _SAMPLES, _ACROSS))


def _crossings(values: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Where profiles (sides, samples, across) pass half-way from black inside to white outside."""
    third = _ACROSS // 3
    black = np.median(values[:, :, :third], axis=(1, 2))[:, None]
    white = np.median(values[:, :, -third:], axis=(1, 2))[:, None]
    level = (black + white) / 2.0
    light = values > level[..., None]
    change = light[:, :, 1:] & ~light[:, :, :-1]
    # The crossing next to the guess: strokes of the student farther out are of no matter.
    distance = np.where(change, np.abs(_Y[:-1] + _Y[1:])[None, None, :], np.inf)
    at = distance.argmin(axis=2)
    seen = np.isfinite(distance.min(axis=2)) & (white - black > _LEAST_CONTRAST)
    below = np.take_along_axis(values, at[..., None], axis=2)[..., 0]
    above = np.take_along_axis(values, at[..., None] + 1, axis=2)[..., 0]
    share = np.clip((level - below) / np.maximum(above - below, 1e-9), 0.0, 1.0)
    return np.asarray(_Y[at] + share * (_Y[1] - _Y[0])), seen


def _corners(a: FloatArray, b: FloatArray) -> FloatArray:
    """(k, 4, 2) where each side's line y = a + b t meets that of the side before it."""
    origin = _START + a[..., None] * _OUTWARD
    along = _ALONG + b[..., None] * _OUTWARD
    before, u = np.roll(origin, 1, axis=1), np.roll(along, 1, axis=1)
    gap = before - origin
    # origin + s along = before + r u
    cross = along[..., 0] * u[..., 1] - along[..., 1] * u[..., 0]
    s = (gap[..., 0] * u[..., 1] - gap[..., 1] * u[..., 0]) / cross
    return np.asarray(origin + s[..., None] * along)


def _project(matrix: FloatArray, points: FloatArray) -> FloatArray:
    """Points (..., 2) through homographies that broadcast against them (..., 3, 3)."""
    mapped = np.einsum("...ij,...j->...i", matrix[..., :2], points) + matrix[..., 2]
    return np.asarray(mapped[..., :2] / mapped[..., 2:])
