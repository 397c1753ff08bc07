"""Hatching: many parallel strokes side by side, under a support, along a guide, across a plate."""

import numpy as np

from grader.pixels import BoolArray
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
    linked, aside = _linked(strokes.ends[rows], length[rows])
    linked &= np.maximum(weight[:, None], weight[None, :]) < _WEIGHT_RATIO * np.minimum(
        weight[:, None], weight[None, :]
    )
    between = (linked & (aside > 0)).any(axis=1) & (linked & (aside < 0)).any(axis=1)
    # The last of a family may be the link or the side that runs along it: short ones alone are safe.
    family, short = _family_size(linked), length[rows] < _SHORT_MM
    result[rows] = np.where(short, family > _LEAST_ALIKE, (family > _LEAST_LONG) & between)
    return result


def _linked(ends: FloatArray, length: FloatArray) -> tuple[BoolArray, FloatArray]:
    """(n, n) pairs that are parallel, alike in length and side by side; how far to the side, signed."""
    span = ends[:, 1] - ends[:, 0]
    span = np.where((span[:, :1] < 0) | ((span[:, :1] == 0) & (span[:, 1:] < 0)), -span, span)
    u = span / np.maximum(length, 1e-9)[:, None]
    sine = np.abs(u[:, None, 0] * u[None, :, 1] - u[:, None, 1] * u[None, :, 0])
    shorter = np.minimum(length[:, None], length[None, :])
    limit = np.where(shorter < _SHORT_MM, np.sin(np.radians(_ALIKE_DEG)), np.sin(np.radians(_LONG_ALIKE_DEG)))
    middle = ends.mean(axis=1)
    apart = middle[None, :] - middle[:, None]
    along = np.abs((apart * u[:, None]).sum(axis=2))
    aside = apart[..., 0] * u[:, None, 1] - apart[..., 1] * u[:, None, 0]
    beside = (
        (np.abs(aside) > _APART_MM[0])
        & (np.abs(aside) < _APART_MM[1])
        & (along < 0.5 * (length[:, None] + length[None, :]))
    )
    longer = np.maximum(length[:, None], length[None, :])
    linked = (sine < limit) & beside & (longer < _RATIO * shorter)
    return linked & linked.T, aside


def _family_size(linked: BoolArray) -> np.ndarray:
    """(n,) how many strokes hang together with each through links."""
    count = len(linked)
    label = np.arange(count)
    while True:
        spread = np.where(linked, label[None, :], count).min(axis=1, initial=count)
        lower = np.minimum(label, spread)
        if np.array_equal(lower, label):
            break
        label = lower
    return np.bincount(label, minlength=count)[label]


def boxes_around(strokes: Strokes, which: BoolArray) -> FloatArray:
    """(j, 4) boxes x, y, w, h of the chosen strokes."""
    low, high = strokes.ends[which].min(axis=1), strokes.ends[which].max(axis=1)
    return np.column_stack([low, high - low]).reshape(-1, 4)
