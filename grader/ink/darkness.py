"""A vector drawn over its construction line: the dark part and the light parts are strokes of their own."""

import numpy as np
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
    for row, length in enumerate(fitted.length):
        levels = _profile(flat, fitted.ends[row], float(fitted.width[row]), float(length), px_per_mm)
        for low, high in _runs(levels):
            share = np.array([low, high]) / len(levels)
            span = fitted.ends[row, 1] - fitted.ends[row, 0]
            parts.append(fitted.ends[row, 0] + share[:, None] * span)
            owners.append(row)
    return np.array(parts).reshape(-1, 2, 2), np.array(owners, dtype=np.intp)


def _profile(flat: Flat, ends: FloatArray, width: float, length: float, px_per_mm: float) -> FloatArray:
    """Mean contrast over a little more than the pen's width, every 0.15 mm, smoothed by a running median."""
    count = max(4, round(length / (_STEP_MM * px_per_mm)))
    share = (np.arange(count) + 0.5) / count
    u = (ends[1] - ends[0]) / max(length, 1e-9)
    middle = ends[0] + share[:, None] * (ends[1] - ends[0])
    across = _ACROSS * width
    x = middle[:, 0, None] - u[1] * across[None, :]
    y = middle[:, 1, None] + u[0] * across[None, :]
    level = flat.contrast(x, y).mean(axis=1).astype(np.float64)
    window = min(round(_SMOOTH_MM / _STEP_MM) | 1, (count - 1) | 1)
    padded = np.pad(level, window // 2, mode="edge")
    return np.asarray(np.median(np.lib.stride_tricks.sliding_window_view(padded, window), axis=1)[:count])


def _runs(level: FloatArray) -> list[tuple[int, int]]:
    """Index ranges of the dark part and of the light parts worth keeping at its two ends."""
    n = len(level)
    dark = level >= _LIGHT * np.quantile(level, _DARK_QUANTILE)
    least = round(_LEAST_LIGHT_MM / _STEP_MM)
    first, last = int(np.argmax(dark)), n - int(np.argmax(dark[::-1]))
    first = first if first >= least else 0
    last = last if n - last >= least else n
    keep = round(_LEAST_PART_MM / _STEP_MM)
    inked = level > 0.3 * np.quantile(level, _DARK_QUANTILE)
    runs = [(first, last)]
    if first >= keep and inked[:first].mean() > 0.5:
        runs.append((0, first))
    if n - last >= keep and inked[last:].mean() > 0.5:
        runs.append((last, n))
    return runs
