"""Pairs of segments near each other, so that nothing is computed for every two strokes of a sheet."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from grader.pixels import parts
from grader.records import FloatArray

_SLACK_PX = 1.0
"""Callers compare in single precision: pairs at the limit are in."""
_NEIGHBOURHOOD = 256
"""Pairs of samples around one segment, at most as a rule."""

Rows = NDArray[np.intp]


def near_pairs(ends: FloatArray, others: FloatArray, reach_px: float) -> tuple[Rows, Rows]:
    """Rows of all pairs of a segment (k, 2, 2) and another (t, 2, 2) within `reach_px` of each other.

    Returns (n,) rows of `ends`, in order, and (n,) rows of `others`, in order for each segment. Pairs up
    to two and a half times as far apart may be among them: the caller's own formula decides.
    """
    step = reach_px + _SLACK_PX
    count = len(others)
    at, row = _samples(others, step)
    tree = KDTree(at)
    pairs = [np.zeros(0, dtype=np.intp)]
    for part in parts(len(ends), _NEIGHBOURHOOD):
        own_at, own = _samples(ends[part], step)
        # No point of a segment is further than half a step from a sample.
        close = KDTree(own_at).sparse_distance_matrix(tree, reach_px + step, output_type="ndarray")
        pairs.append(np.unique((part.start + own[close["i"]]) * count + row[close["j"]]))
    first, second = np.divmod(np.concatenate(pairs), max(count, 1))
    return first, second


def _samples(ends: FloatArray, step: float) -> tuple[FloatArray, Rows]:
    """((n, 2) places along segments, at most `step` apart, both ends among them; (n,) their segments)."""
    span = ends[:, 1] - ends[:, 0]
    count = np.ceil(np.hypot(span[:, 0], span[:, 1]) / step).astype(np.intp) + 1
    row = np.repeat(np.arange(len(ends)), count)
    number = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return ends[row, 0] + (number / np.maximum(count[row] - 1, 1))[:, None] * span[row], row
