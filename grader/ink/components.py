"""Connected pieces of ink: which are letters and dust, which can hold strokes."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.ink.regions import Field
from grader.ink.seeds import PX_PER_MM, Seeds
from grader.pixels import BoolArray, at_full_size, lengths_and_directions
from grader.records import FloatArray

_MARK_MM = 8.0
"""Larger pieces of ink are no single letter."""
_LONG_SEED_MM = 4.5
"""Ink without a straight border of this length holds letters, compass arcs and the like."""
_LEAST_STROKE_MM = 1.2
"""Shorter pieces are dots and dust."""
_THIN = 0.5
"""Spread across a stroke in pens: 0.29 for an even one."""
_LONG = 2.5
"""A stroke is so many times as long as wide."""
_LONE_MM = 6.0
"""A straight piece this long is a stroke, whatever stands beside it."""
_NEIGHBOUR_MM = 5.0
"""Letters of one word are closer to each other than this."""
_NEIGHBOURS = 2
"""A single letter beside a short stroke names it; two are a text of which it is part."""
_DUST_MM = 0.4
"""Smaller pieces are dust."""


@dataclass(frozen=True, slots=True)
class Components:
    """Pieces of ink at the working resolution.

    Attributes
    ----------
    box_px : (c, 4) left, top, width, height
    mark : (c,) too small or too crooked to hold a stroke
    dash : (c,) straight but short and beside letters: a stroke only as part of a dashed line
    of_seed : (n,) which piece each seed is of
    """

    box_px: FloatArray
    mark: BoolArray
    dash: BoolArray
    of_seed: NDArray[np.intp]


def find_components(seeds: Seeds) -> Components:
    """Label the ink and tell marks from what can hold strokes."""
    _, labels, stats, _ = cv2.connectedComponentsWithStats(seeds.mask, connectivity=8)
    box = stats[1:, :4].astype(np.float64)
    of_seed = labels[seeds.border[:, 0], seeds.border[:, 1]].astype(np.intp) - 1
    size = np.hypot(box[:, 2], box[:, 3]) / PX_PER_MM
    longest = np.zeros(len(box))
    length = lengths_and_directions(seeds.ends)[0] / PX_PER_MM
    np.maximum.at(longest, of_seed, length)
    major, minor = _spread(labels.astype(np.int32, copy=False), len(box))
    straight = (minor <= _THIN * seeds.pen_px) & (major >= _LONG * minor)
    small = longest < _LONG_SEED_MM
    stroke_like = straight & (size >= _LEAST_STROKE_MM) & (longest >= 0.6 * size)
    written = small & ~stroke_like & (size > 2.0 * _DUST_MM) & (size < _MARK_MM)
    text = small & stroke_like & (size < _LONE_MM)
    text[text] = _beside(box, written, np.flatnonzero(text))
    return Components(box, small & ~stroke_like, text, of_seed)


def _spread(labels: NDArray[np.int32], count: int) -> tuple[FloatArray, FloatArray]:
    """Standard deviations of each piece's pixels along and across it, (count,) each, px."""
    inked = np.flatnonzero(labels > 0)
    row, column = np.divmod(inked, labels.shape[1])
    label = labels.reshape(-1)[inked] - 1
    number = np.maximum(np.bincount(label, minlength=count), 1)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(label, weights=values, minlength=count) / number)

    x, y = column.astype(np.float64), row.astype(np.float64)
    mx, my = mean(x), mean(y)
    x, y = x - mx[label], y - my[label]
    xx, yy, xy = mean(x * x), mean(y * y), mean(x * y)
    half, root = (xx + yy) / 2.0, np.sqrt(((xx - yy) / 2.0) ** 2 + xy**2)
    return np.sqrt(half + root), np.sqrt(np.maximum(half - root, 0.0))


def _beside(box: FloatArray, written: BoolArray, rows: NDArray[np.intp]) -> BoolArray:
    """Which of the pieces `rows` have at least two letters close by."""
    centre = (box[:, :2] + box[:, 2:] / 2.0) / PX_PER_MM
    letters = centre[written]
    result = np.zeros(len(rows), dtype=bool)
    if len(letters) < _NEIGHBOURS:
        return result
    for index, at in enumerate(centre[rows]):
        near = np.hypot(*(letters - at).T) < _NEIGHBOUR_MM
        result[index] = near.sum() >= _NEIGHBOURS
    return result


def mark_boxes(components: Components, field: Field) -> FloatArray:
    """(j, 4) boxes x, y, w, h in sheet mm of the marks in the field, dust left out."""
    left, top, wide, high = components.box_px[components.mark | components.dash].T
    steps = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    corners = np.stack([np.column_stack([left + dx * wide, top + dy * high]) for dx, dy in steps], axis=1)
    # A box's edge lies between pixels.
    mm = field.to_mm(at_full_size(corners - 0.5, field.scale))
    low, far = mm.min(axis=1), mm.max(axis=1)
    inside = field.holds((low + far) / 2.0) & ((far - low).max(axis=1) > _DUST_MM)
    return np.column_stack([low[inside], (far - low)[inside]])
