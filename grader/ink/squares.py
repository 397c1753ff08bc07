"""Graph paper: how dark its printed squares are, so that they are not taken for strokes."""

import cv2
import numpy as np

from grader.ink.seeds import PX_PER_MM
from grader.pixels import Float32Array
from grader.records import FloatArray, GreyImage

_STRIP_MM, _STRIPS, _EVERY = 10.0, 5, 3
"""Strips narrow enough that a skewed line stays within its own width over most of one."""
_LEAST_PEAK = 6.0
"""Of 255: fainter squares do not disturb."""
_LEAST_LINES = 12
_REGULAR, _ALIKE = 0.6, 0.2
_DARKER = 1.35
_DARKEST = 0.9
"""Quantile of a strip's lines: every fifth or tenth is printed darker."""


def squares_darkness(contrast: GreyImage) -> float:
    """Darkness of printed squares, 0..255 of contrast, 0 where there are none.

    Arguments
    ---------
    contrast : 0 = paper .. 255 = black, at about 6 px/mm

    Lines that fill most of a strip, at equal distances, in most strips of both directions. Slanted
    strokes never fill a strip, and a table's lines are too few.
    """
    found = [_of_strips(contrast), _of_strips(np.ascontiguousarray(contrast.T))]
    return min(found)


def without_squares(contrast: GreyImage) -> GreyImage:
    """Contrast with all that is no darker than printed squares left out; as given where there are none."""
    dark = squares_darkness(contrast)
    if dark == 0.0:
        return contrast
    _, drawn = cv2.threshold(contrast, _DARKER * dark, 0, cv2.THRESH_TOZERO)
    return np.asarray(drawn, dtype=np.uint8)


def _of_strips(contrast: GreyImage) -> float:
    high = contrast.shape[0]
    deep = round(_STRIP_MM * PX_PER_MM)
    told = []
    for top in np.linspace(0.08 * high, 0.92 * high - deep, _STRIPS).astype(int):
        strip = contrast[top : top + deep : _EVERY]
        told.append(_regular_peaks(np.median(strip, axis=0).astype(np.float32)))
    seen = [dark for dark in told if dark > 0.0]
    return float(np.median(seen)) if 2 * len(seen) > len(told) else 0.0


def _regular_peaks(profile: Float32Array) -> float:
    """Darkness of the peaks of a profile where they are many and at equal distances, else 0."""
    above = profile - _floor(profile)
    inner = above[1:-1]
    at = 1 + np.flatnonzero((inner >= _LEAST_PEAK) & (inner >= above[:-2]) & (inner > above[2:]))
    if len(at) < _LEAST_LINES:
        return 0.0
    gaps = np.diff(at).astype(np.float64)
    usual = np.median(gaps)
    off = np.abs(gaps / usual - np.maximum(np.rint(gaps / usual), 1.0))
    return float(np.quantile(profile[at], _DARKEST)) if np.mean(off < _ALIKE) > _REGULAR else 0.0


def _floor(profile: Float32Array) -> FloatArray:
    wide = round(2.0 * PX_PER_MM) | 1
    row = profile[None, :]
    return np.asarray(cv2.erode(row, np.ones((1, wide), np.uint8))[0], dtype=np.float64)
