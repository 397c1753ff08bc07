"""A vector drawn over its construction line: the dark part and the light parts are strokes of their own."""

from itertools import pairwise

import numpy as np
import scipy.ndimage
from numpy.typing import NDArray

from grader.ink.centreline import Fitted
from grader.pixels import Flat
from grader.records import FloatArray

_STEP_MM = 0.15
_ACROSS = np.linspace(-0.6, 0.6, 5)
_LIGHT = 0.6
"""Of the stroke's dark level; a pencil's grain varies less over a millimetre."""
_DARK_QUANTILE = 0.75
_SMOOTH_MM = 1.05
_LEAST_LIGHT_MM = 1.5
_LEAST_PART_MM = 2.0


def split_by_darkness(flat: Flat, fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, NDArray[np.intp]]:
    """((m, 2, 2) ends in pixels, (m,) row of the stroke that each part is of).

    Light runs at either end of a stroke are cut off it; those of 2 mm and more stay as strokes.
    """
    parts: list[FloatArray] = []
    owners: list[int] = []
    for row, levels in enumerate(_profiles(flat, fitted, px_per_mm)):
        for low, high in _runs(levels):
            share = np.array([low, high]) / len(levels)
            span = fitted.ends[row, 1] - fitted.ends[row, 0]
            parts.append(fitted.ends[row, 0] + share[:, None] * span)
            owners.append(row)
    return np.array(parts).reshape(-1, 2, 2), np.array(owners, dtype=np.intp)


def _profiles(flat: Flat, fitted: Fitted, px_per_mm: float) -> list[FloatArray]:
    """Mean contrast over a little more than the pen's width, every 0.15 mm, smoothed by a running median."""
    count = np.maximum(4, np.rint(fitted.length / (_STEP_MM * px_per_mm))).astype(np.intp)
    if len(count) == 0:
        return []
    row = np.repeat(np.arange(len(count)), count)
    first = np.concatenate([[0], np.cumsum(count)])
    share = (np.arange(first[-1]) - first[row] + 0.5) / count[row]
    span = fitted.ends[:, 1] - fitted.ends[:, 0]
    u = span / np.maximum(fitted.length, 1e-9)[:, None]
    middle = fitted.ends[row, 0] + share[:, None] * span[row]
    across = _ACROSS[None, :] * fitted.width[row, None]
    level = flat.contrast(
        middle[:, 0, None] - u[row, 1, None] * across, middle[:, 1, None] + u[row, 0, None] * across
    ).mean(axis=1)
    smooth = scipy.ndimage.median_filter(level, round(_SMOOTH_MM / _STEP_MM) | 1, mode="nearest")
    return [smooth[low:high].astype(np.float64) for low, high in pairwise(first)]


def _runs(level: FloatArray) -> list[tuple[int, int]]:
    """Index ranges of the dark part and of the light parts worth keeping at its two ends."""
    n = len(level)
    usual = float(np.partition(level, int(_DARK_QUANTILE * (n - 1)))[int(_DARK_QUANTILE * (n - 1))])
    dark = level >= _LIGHT * usual
    least = round(_LEAST_LIGHT_MM / _STEP_MM)
    first, last = int(np.argmax(dark)), n - int(np.argmax(dark[::-1]))
    first = first if first >= least else 0
    last = last if n - last >= least else n
    keep = round(_LEAST_PART_MM / _STEP_MM)
    inked = level > 0.3 * usual
    runs = [(first, last)]
    if first >= keep and inked[:first].mean() > 0.5:
        runs.append((0, first))
    if n - last >= keep and inked[last:].mean() > 0.5:
        runs.append((last, n))
    return runs
