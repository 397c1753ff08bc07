"""Hatching: many parallel strokes side by side, under a support, along a guide, across a plate."""

import numpy as np
from scipy.sparse import coo_matrix
from scipy.sparse.csgraph import connected_components

from grader.ink.pairs import Rows
from grader.pixels import BoolArray, parts
from grader.records import FloatArray, Strokes

_ALIKE_DEG = 11.0
_LONG_ALIKE_DEG = 5.0
_SHORT_MM = 6.0
_APART_MM = (0.5, 6.0)
_LEAST_ALIKE = 4
_LEAST_LONG = 6
"""A slider, its guide and a link along it make five level lines."""
_LONGEST_MM = 60.0
_RATIO = 2.5
_WEIGHT_RATIO = 1.35


def hatching(strokes: Strokes) -> BoolArray:
    """Which strokes are hatching.

    At least five short or seven long parallel ones of like length and weight, each within 6 mm of
    the next, side by side. A plan has no such family.
    """
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    length = np.hypot(span[:, 0], span[:, 1])
    rows = np.flatnonzero(length < _LONGEST_MM)
    result = np.zeros(len(strokes), dtype=bool)
    if len(rows) <= _LEAST_ALIKE:
        return result
    weight = (strokes.width * strokes.darkness)[rows]
    first, second, aside = _linked(strokes.ends[rows], length[rows], weight)
    left, right = np.zeros((2, len(rows)), dtype=bool)
    left[first[aside > 0]] = right[first[aside < 0]] = True
    # The last of a family may be the link or the side that runs along it: short ones alone are safe.
    family, short, between = _family_size(first, second, len(rows)), length[rows] < _SHORT_MM, left & right
    result[rows] = np.where(short, family > _LEAST_ALIKE, (family > _LEAST_LONG) & between)
    return result


def _linked(ends: FloatArray, length: FloatArray, weight: FloatArray) -> tuple[Rows, Rows, FloatArray]:
    """Pairs of parallel strokes side by side, of like length and weight; how far to the side, signed."""
    span = ends[:, 1] - ends[:, 0]
    span = np.where((span[:, :1] < 0) | ((span[:, :1] == 0) & (span[:, 1:] < 0)), -span, span)
    u = span / np.maximum(length, 1e-9)[:, None]
    middle, count = ends.mean(axis=1), len(ends)
    found = [np.zeros(0, dtype=np.intp)]
    for part in parts(count, 4 * count):
        apart = middle[None, :] - middle[part, None]
        along = np.abs((apart * u[part, None]).sum(axis=2))
        aside = np.abs(apart[..., 0] * u[part, None, 1] - apart[..., 1] * u[part, None, 0])
        beside = (aside > _APART_MM[0]) & (aside < _APART_MM[1])
        beside &= along < 0.5 * (length[part, None] + length[None, :])
        found.append(part.start * count + np.flatnonzero(beside))
    first, second = np.divmod(np.concatenate(found), count)
    sine = np.abs(u[first, 0] * u[second, 1] - u[first, 1] * u[second, 0])
    shorter, longer = np.minimum(length[first], length[second]), np.maximum(length[first], length[second])
    limit = np.where(shorter < _SHORT_MM, np.sin(np.radians(_ALIKE_DEG)), np.sin(np.radians(_LONG_ALIKE_DEG)))
    linked = (sine < limit) & (longer < _RATIO * shorter)
    lighter, heavier = np.minimum(weight[first], weight[second]), np.maximum(weight[first], weight[second])
    linked &= heavier < _WEIGHT_RATIO * lighter
    first, second = first[linked], second[linked]
    mutual = np.isin(first * count + second, second * count + first)
    first, second = first[mutual], second[mutual]
    apart = middle[second] - middle[first]
    return first, second, apart[:, 0] * u[first, 1] - apart[:, 1] * u[first, 0]


def _family_size(first: Rows, second: Rows, count: int) -> Rows:
    """(count,) how many strokes hang together with each through links."""
    links = coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    _, label = connected_components(links, directed=False)
    return np.asarray(np.bincount(label, minlength=count)[label], dtype=np.intp)


def boxes_around(strokes: Strokes, which: BoolArray) -> FloatArray:
    """(j, 4) boxes x, y, w, h of the chosen strokes."""
    low, high = strokes.ends[which].min(axis=1), strokes.ends[which].max(axis=1)
    return np.column_stack([low, high - low]).reshape(-1, 4)
