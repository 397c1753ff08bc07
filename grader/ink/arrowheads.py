"""Arrowheads at the ends of strokes: filled, open, or a single barb."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grader.pixels import BoolArray, Flat
from grader.records import FloatArray, Strokes

_SHIFTS_MM = np.array([-1.6, -1.2, -0.8, -0.4, 0.0, 0.4])
"""A stroke found may run past the tip, along a construction line, or stop short of it."""
_ANGLE_DEG = np.arange(9.0, 37.0, 3.0)
_OUT_MM = np.arange(0.7, 6.0, 0.15)
_GAP_STEPS = 2
_BARB_MM = (1.2, 4.8)
_CLEAR_MM = 0.25
_ALIKE_MM = 1.6
_LEAST_STROKE_MM = 2.0
_LONG_MM = 5.0
_ALIKE_DEG = 8.0
_TIP_MM = 1.6
_SHARED_DEG = 30.0
_PASSES_MM = 0.8
_INKED = 0.45


def find_arrowheads(flat: Flat, strokes: Strokes, mm_to_px: FloatArray) -> FloatArray:
    """(k, 3) x, y mm of tips and direction, radians counter-clockwise (y up), that they point to.

    Around each end the ink is followed outward along rays back at 9 to 36 degrees on either side of
    the stroke: a barb is a ray inked for 1.2 to 4.8 mm and no further, a filled head many such rays.
    Rays along other strokes say nothing. Long strokes first: their barbs are no strokes with heads.
    """
    length = np.hypot(*(strokes.ends[:, 1] - strokes.ends[:, 0]).T)
    long_ones = _heads_of(flat, strokes, np.flatnonzero(length >= _LONG_MM), mm_to_px)
    short = (length >= _LEAST_STROKE_MM) & (length < _LONG_MM) & ~barbs(strokes, long_ones)
    short_ones = _heads_of(flat, strokes, np.flatnonzero(short), mm_to_px)
    return _distinct(np.concatenate([long_ones, short_ones]))[:, :3]


def _heads_of(flat: Flat, strokes: Strokes, rows: NDArray[np.intp], mm_to_px: FloatArray) -> FloatArray:
    found: list[FloatArray] = [np.zeros((0, 4))]
    if len(rows) == 0:
        return found[0]
    span = strokes.ends[rows, 1] - strokes.ends[rows, 0]
    u = span / np.hypot(span[:, 0], span[:, 1])[:, None]
    own = Own(_INKED * strokes.darkness[rows], 0.5 * strokes.width[rows] + _CLEAR_MM)
    for side, sign in ((0, -1.0), (1, 1.0)):
        outward = sign * u
        score, shift = _best_shift(flat, strokes, strokes.ends[rows, side], outward, own, mm_to_px)
        tips = strokes.ends[rows, side] + shift[:, None] * outward
        heads = np.column_stack([tips, np.arctan2(-outward[:, 1], outward[:, 0]), score])
        found.append(heads[score > 0.1])
    return np.concatenate(found)


@dataclass(frozen=True, slots=True)
class Own:
    """Of each stroke: (k,) contrast that counts as ink, (k,) mm to the side that is clear of it."""

    level: FloatArray
    clear: FloatArray


def _best_shift(
    flat: Flat, strokes: Strokes, tips: FloatArray, outward: FloatArray, own: Own, mm_to_px: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """(score of the best head at each end, 0 for none; how far along the stroke its tip is, mm)."""
    best, best_shift = np.zeros(len(tips)), np.zeros(len(tips))
    angles = np.radians(_ANGLE_DEG)
    for shift in _SHIFTS_MM:
        moved = tips + shift * outward
        others = _passing(strokes, moved, outward)
        sides = []
        for turn in (angles, -angles):
            runs = _runs(flat, moved, outward, turn, own.level, mm_to_px)
            sides.append(_barb(runs, _clear_of_others(runs, turn, others, own.clear), own.clear))
        score = _symmetric(*sides) - 0.05 * abs(shift)
        better = score > best
        best, best_shift = np.where(better, score, best), np.where(better, shift, best_shift)
    return best, best_shift


@dataclass(frozen=True, slots=True)
class Passing:
    """Strokes that pass a tip and go on: (p,) row of the tip, (p,) angle of the way from straight back."""

    row: NDArray[np.intp]
    angle: FloatArray


def _passing(strokes: Strokes, tips: FloatArray, outward: FloatArray) -> Passing:
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), 1e-9)
    u = span / length[:, None]
    relative = tips[:, None, :] - strokes.ends[None, :, 0]
    along = (relative * u[None]).sum(axis=2)
    off = np.abs(relative[..., 0] * u[None, :, 1] - relative[..., 1] * u[None, :, 0])
    rows, angles = [], []
    for sign, beyond in ((1.0, length[None, :] - along), (-1.0, along)):
        row, other = np.nonzero((off < _PASSES_MM) & (beyond > _BARB_MM[1]))
        way = sign * u[other]
        back = -outward[row]
        turn = np.arctan2(back[:, 0] * way[:, 1] - back[:, 1] * way[:, 0], (back * way).sum(axis=1))
        rows.append(row)
        angles.append(turn)
    return Passing(np.concatenate(rows), np.concatenate(angles))


def _clear_of_others(runs: FloatArray, angles: FloatArray, others: Passing, clear: FloatArray) -> BoolArray:
    """(k, angles) whether the far end of each ray's ink is to the side of all other strokes there."""
    turn = np.abs(others.angle[:, None] - angles[None, :])
    aside = runs[others.row] * np.sin(np.minimum(turn, np.pi / 2.0))
    blocked = np.zeros(runs.shape, dtype=bool)
    np.logical_or.at(blocked, others.row, aside < clear[others.row, None])
    return ~blocked


def _barb(runs: FloatArray, clear_of_others: BoolArray, clear: FloatArray) -> FloatArray:
    """(k, 2) length and angle in degrees of the barb on one side.

    Zeros for none, or where another stroke not known of spoils the side.
    """
    sideways = np.asarray(np.sin(np.radians(_ANGLE_DEG)))[None, :]
    barb = (
        (runs >= _BARB_MM[0]) & (runs <= _BARB_MM[1]) & (runs * sideways >= clear[:, None]) & clear_of_others
    )
    spoiled = np.asarray(((runs > _BARB_MM[1]) & clear_of_others).any(axis=1))
    length = np.where(barb, runs, 0.0).max(axis=1)
    longest = barb & (runs >= 0.8 * length[:, None])
    angle = (longest * _ANGLE_DEG).sum(axis=1) / np.maximum(longest.sum(axis=1), 1)
    return np.where(spoiled[:, None], 0.0, np.column_stack([length, angle]))


def _symmetric(left: FloatArray, right: FloatArray) -> FloatArray:
    """(k,) above 0.1 for two barbs alike in length and angle, more for longer and more alike ones."""
    longer, off = np.abs(left[:, 0] - right[:, 0]), np.abs(left[:, 1] - right[:, 1])
    both = (left[:, 0] > 0) & (right[:, 0] > 0) & (longer < _ALIKE_MM) & (off < _ALIKE_DEG)
    score = 1.0 + 0.1 * np.minimum(left[:, 0], right[:, 0]) - 0.2 * longer - 0.04 * off
    return np.where(both, score, 0.0)


def _runs(
    flat: Flat,
    tips: FloatArray,
    outward: FloatArray,
    angles: FloatArray,
    level: FloatArray,
    mm_to_px: FloatArray,
) -> FloatArray:
    """(k, angles) length in mm of the ink along each ray from the tip backward."""
    c, s = np.cos(angles), np.sin(angles)
    back_x = -(outward[:, 0, None] * c - outward[:, 1, None] * s)
    back_y = -(outward[:, 0, None] * s + outward[:, 1, None] * c)
    x = tips[:, 0, None, None] + back_x[..., None] * _OUT_MM
    y = tips[:, 1, None, None] + back_y[..., None] * _OUT_MM
    inked = _contrast_mm(flat, x, y, mm_to_px) > level[:, None, None]
    length = np.zeros(inked.shape[:2])
    missing = np.zeros(inked.shape[:2], dtype=int)
    for step, out in enumerate(_OUT_MM):
        missing = np.where(inked[..., step], 0, missing + 1)
        length = np.where((missing <= _GAP_STEPS) & inked[..., step] & (length >= out - 1.0), out, length)
    return length


def _contrast_mm(flat: Flat, x: FloatArray, y: FloatArray, mm_to_px: FloatArray) -> FloatArray:
    h = mm_to_px
    depth = h[2, 0] * x + h[2, 1] * y + h[2, 2]
    px = (h[0, 0] * x + h[0, 1] * y + h[0, 2]) / depth
    py = (h[1, 0] * x + h[1, 1] * y + h[1, 2]) / depth
    shape = px.shape
    return flat.contrast(px.reshape(-1, shape[-1]), py.reshape(-1, shape[-1])).reshape(shape)


def _distinct(heads: FloatArray) -> FloatArray:
    """Two heads cannot share a tip and half their barbs: the more symmetric one stays."""
    heads = heads[np.argsort(-heads[:, 3])]
    keep = np.ones(len(heads), dtype=bool)
    for index, head in enumerate(heads):
        if keep[index]:
            near = np.hypot(*(heads[:, :2] - head[:2]).T) < _TIP_MM
            turn = np.abs((heads[:, 2] - head[2] + np.pi) % (2.0 * np.pi) - np.pi) < np.radians(_SHARED_DEG)
            rival = near & turn
            rival[: index + 1] = False
            keep &= ~rival
    return heads[keep]


def barbs(strokes: Strokes, heads: FloatArray) -> BoolArray:
    """Which strokes are the barbs of an arrowhead: short, from near its tip back at 7 to 40 degrees."""
    result = np.zeros(len(strokes), dtype=bool)
    span = strokes.ends[:, 1] - strokes.ends[:, 0]
    length = np.hypot(span[:, 0], span[:, 1])
    for x, y, direction in heads[:, :3]:
        away = np.hypot(strokes.ends[..., 0] - x, strokes.ends[..., 1] - y)
        near = away.argmin(axis=1)
        sign = np.where(near == 0, 1.0, -1.0)
        angle = np.arctan2(-sign * span[:, 1], sign * span[:, 0]) - (direction + np.pi)
        turn = np.abs((angle + np.pi) % (2.0 * np.pi) - np.pi)
        result |= (
            (away.min(axis=1) < 1.0) & (length < 5.0) & (turn > np.radians(7.0)) & (turn < np.radians(40.0))
        )
    return result
