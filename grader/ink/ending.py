"""Where a stroke begins and ends, and how much of it is inked."""

import numpy as np

from grader.pixels import BoolArray, Flat
from grader.records import FloatArray

_BEYOND_MM = 12.0
_STEP_MM = 0.08
_GAP_MM = 0.9
_DASH_GAP_MM = 3.5
_INKED = 0.45
"""Of the stroke's own darkness."""


def find_ends(
    flat: Flat, ends: FloatArray, width: float, darkness: float, px_per_mm: float
) -> tuple[FloatArray, float]:
    """((2, 2) ends in pixels moved to where the ink stops, share of the length that is inked).

    The line is followed outward through its own ink; a gap of 0.9 mm ends it.
    """
    length = float(np.hypot(*(ends[1] - ends[0])))
    u = (ends[1] - ends[0]) / length
    step = _STEP_MM * px_per_mm
    beyond = _BEYOND_MM * px_per_mm
    t = np.arange(-beyond, length + beyond, step)
    inked = _inked(flat, ends[0], u, t, width, darkness)
    low = int(np.searchsorted(t, 0.0))
    high = int(np.searchsorted(t, length)) - 1
    gap = round(_GAP_MM / _STEP_MM)
    first, last = _follow(inked, low, -1, gap), _follow(inked, high, 1, gap)
    if last <= first:
        return ends, 0.0
    coverage = float(inked[first : last + 1].mean())
    return np.stack([ends[0] + t[first] * u, ends[0] + t[last] * u]), coverage


def _inked(
    flat: Flat, origin: FloatArray, u: FloatArray, t: FloatArray, width: float, darkness: float
) -> BoolArray:
    normal = np.array([-u[1], u[0]])
    across = np.linspace(-0.25, 0.25, 3) * width
    x = origin[0] + t[:, None] * u[0] + across[None, :] * normal[0]
    y = origin[1] + t[:, None] * u[1] + across[None, :] * normal[1]
    return np.asarray(flat.contrast(x, y).mean(axis=1) > _INKED * darkness)


def _follow(inked: BoolArray, start: int, step: int, gap: int) -> int:
    """Index of the last ink met from `start` in one direction before a gap; looks back inside first."""
    position = start
    stop = 0 if step < 0 else len(inked) - 1
    # The guess may end in paper: go back to ink.
    while not inked[position] and 0 < position < len(inked) - 1:
        position -= step
    last, missing = position, 0
    while position != stop and missing <= gap:
        position += step
        missing = 0 if inked[position] else missing + 1
        last = position if inked[position] else last
    return last
