"""Ends of strokes: the end of the ink, its darkness, and the tips of arrowheads."""

from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import NO_TIPS, FloatArray, IntArray, Strokes, Tips
from grader.scan.pixels import BoolArray, Flat, Float32Array, cut_across, lengths_and_directions
from grader.scan.strokes.centreline import Fitted
from grader.scan.strokes.regions import near_pairs

_BEYOND_MM = 9.0
"""Farthest that a stroke may go on beyond a fitted end: over a joint's circle and a gap."""
_INSIDE_MM = 2.0
"""Start of following inside a fitted end: fitted ends may lie outside of the ink."""
_STEP_MM = 0.15
"""Half of a pen's width: no gap is stepped over."""
_GAP_MM = 0.9
"""Paper over this length ends a stroke; dashes are joined before."""
_CROSSING_MM = 1.6
"""Ink whose borders are not the stroke's is passed over this far: another stroke, a letter, a joint."""
_OFF_MM = 0.11
"""Ink is the stroke's own where its middle or a border is this near to where it should be."""
_REACH_MM = 0.8
"""Beyond its width, how far to either side the ink is looked at."""
_INKED = 0.45
"""Least darkness of ink, as a share of the stroke's own."""
_BAND_MM = 40.0
"""A stroke is followed through another's ink over at most this length."""
_BAND_STEP_MM = 0.3
"""About a pen's width."""
_BAND_GAP, _BAND_PAPER = 5, 0.5
"""Steps over which paper is averaged, and its share from which the ink has ended."""
_BAND_OFF_MM = 0.1
"""Beyond its width, how near another stroke runs whose ink hides this one."""
_LEAST_BAND_MM = 2.5
"""Ink of two strokes over less than this is a crossing."""
_LEAST_LED_MM = 8.0
"""The direction of a shorter stroke is not known well enough to follow it."""
_PROBES = np.array([-0.4, 0.0, 0.4])
"""Places across a stroke at which ink is looked for, as shares of its width."""
_OWN, _OTHER, _PAPER = 2, 1, 0
_ACROSS = np.linspace(-0.6, 0.6, 5)
"""Places across a stroke, a little beyond both borders, as shares of its width."""
_LIGHT = 0.6
"""Darkest light part, as a share of the dark level; a pencil's grain varies less over a millimetre."""
_DARK_QUANTILE = 0.75
"""Quantile of the levels along a stroke: its dark part's level, if that is a quarter of it."""
_SMOOTH_MM = 1.05
"""Running median: a crossing stroke is narrower than half of this."""
_LEAST_LIGHT_MM = 1.5
"""Shorter light ends are a pen lifted slowly."""
_LEAST_PART_MM = 2.0
"""Shorter light parts are not kept as strokes."""


def find_ends(flat: Flat, fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, BoolArray]:
    """((k, 2, 2) ends where each stroke's own ink stops, (k, 2) whether other ink goes on there)."""
    length, u = lengths_and_directions(fitted.ends)
    ends = fitted.ends.copy()
    merged = np.zeros((len(fitted), 2), dtype=bool)
    inside = np.minimum(_INSIDE_MM * px_per_mm, 0.5 * length)
    count = round((_BEYOND_MM + _INSIDE_MM) / _STEP_MM)
    for side, sign in ((0, -1.0), (1, 1.0)):
        outward = sign * u
        start = fitted.ends[:, side] - inside[:, None] * outward
        reach = start + (_BEYOND_MM + _INSIDE_MM) * px_per_mm * outward
        state = _along(flat, np.stack([start, reach], axis=1), fitted, px_per_mm, count)
        last, other = _last_own(state)
        distance = (last + 1.0) * _STEP_MM * px_per_mm
        ends[:, side] = np.where((last >= 0)[:, None], start + distance[:, None] * outward, ends[:, side])
        merged[:, side] = other
    return ends, merged


def _along(flat: Flat, ends: FloatArray, fitted: Fitted, px_per_mm: float, count: int) -> FloatArray:
    """(k, n) of own ink, other ink or paper along lines from inside a stroke outward."""
    level = _INKED * fitted.darkness
    reach = _REACH_MM * px_per_mm + float(fitted.width.max(initial=1.0))
    cuts = cut_across(flat, ends, count, reach, 0.35 * fitted.width, level)
    inked = np.isfinite(cuts.left)
    pen = fitted.width[:, None]
    limit = np.maximum(_OFF_MM * px_per_mm, 2.0 * fitted.noise)[:, None]
    off = np.minimum.reduce(
        [
            np.abs(np.where(inked, cuts.offset, 0.0)),
            np.abs(np.where(inked, cuts.left + pen / 2.0, 0.0)),
            np.abs(np.where(inked, cuts.right - pen / 2.0, 0.0)),
        ]
    )
    return np.where(inked, np.where(off <= limit, _OWN, _OTHER), _PAPER)


def _last_own(state: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Per row: index of the last own ink before a gap, and whether other ink follows it."""
    gap, crossing = round(_GAP_MM / _STEP_MM), round(_CROSSING_MM / _STEP_MM)
    n = state.shape[1]
    last = np.full(len(state), -1)
    paper = np.zeros(len(state), dtype=int)
    other = np.zeros(len(state), dtype=int)
    going = np.ones(len(state), dtype=bool)
    for index in range(n):
        now = state[:, index]
        own = going & (now == _OWN)
        last[own] = index
        paper = np.where(now == _PAPER, paper + 1, 0)
        other = np.where(now == _OWN, 0, np.where(now == _OTHER, other + 1, other))
        going &= (paper <= gap) & (other <= crossing)
    after = np.minimum(last[:, None] + 1 + np.arange(4)[None, :], n - 1)
    beyond = np.take_along_axis(state, np.maximum(after, 0), axis=1)
    return last, ((beyond == _OTHER).sum(axis=1) >= 2) | (last >= n - 2)


def through_bands(
    flat: Flat, fitted: Fitted, ends: FloatArray, merged: BoolArray, px_per_mm: float
) -> FloatArray:
    """(k, 2, 2) ends, led on where a stroke ran into another at a small angle.

    Such strokes mostly meet at the node that both lead to: they end where the ink along them does.
    """
    result = ends.copy()
    length, along = lengths_and_directions(ends)
    count = round(_BAND_MM / _BAND_STEP_MM)
    steps = np.asarray((np.arange(count) + 1.0) * _BAND_STEP_MM * px_per_mm, dtype=np.float64)
    for side, sign in ((0, -1.0), (1, 1.0)):
        u = sign * along
        rows = np.flatnonzero(merged[:, side] & (length > _LEAST_LED_MM * px_per_mm))
        rows = rows[_beside_another(fitted, ends[rows, side], u[rows], rows, px_per_mm)]
        if len(rows) == 0:
            continue
        inked = _inked_on(flat, ends[rows, side], u[rows], steps, fitted.take(rows))
        paper = scipy.ndimage.uniform_filter1d((~inked).astype(np.float32), _BAND_GAP, axis=1, mode="nearest")
        going = np.minimum.accumulate(paper < _BAND_PAPER, axis=1)
        reached = np.where(going & inked, np.arange(1, count + 1), 0).max(axis=1)
        led = (reached * _BAND_STEP_MM > _LEAST_BAND_MM) & (reached < count)
        on = np.where(led, reached * _BAND_STEP_MM * px_per_mm, 0.0)
        result[rows, side] += on[:, None] * u[rows]
    return result


def _beside_another(
    fitted: Fitted, tips: FloatArray, outward: FloatArray, rows: NDArray[np.intp], px_per_mm: float
) -> BoolArray:
    """(m,) whether another stroke runs past each tip, near it both before and behind."""
    length, u = lengths_and_directions(fitted.ends)
    limit = fitted.width + _BAND_OFF_MM * px_per_mm
    reach = _LEAST_BAND_MM * px_per_mm + float(limit.max(initial=0.0))
    first, second = near_pairs(np.stack([tips, tips], axis=1), fitted.ends, reach)
    beside = rows[first] != second
    for way in (-1.0, 0.5):
        at = tips + way * _LEAST_BAND_MM * px_per_mm * outward
        relative = at[first] - fitted.ends[second, 0]
        along = (relative * u[second]).sum(axis=1)
        off = np.abs(relative[:, 0] * u[second, 1] - relative[:, 1] * u[second, 0])
        beside &= (off < limit[second]) & (along > 0) & (along < length[second])
    result = np.zeros(len(rows), dtype=bool)
    result[first[beside]] = True
    return result


def _inked_on(
    flat: Flat, start: FloatArray, way: FloatArray, steps: FloatArray, strokes: Fitted
) -> BoolArray:
    """(k, n) whether there is ink within 0.4 of each stroke's width of `start + steps way`."""
    size = np.maximum(np.hypot(way[:, 0], way[:, 1]), 1e-9)
    across = _PROBES * (strokes.width / size)[:, None]
    middle = start[:, None] + steps[:, None] * way[:, None]
    x = middle[..., 0, None] - (way[:, 1, None] * across)[:, None, :]
    y = middle[..., 1, None] + (way[:, 0, None] * across)[:, None, :]
    level = flat.contrast(x.reshape(-1, len(_PROBES)), y.reshape(-1, len(_PROBES))).max(axis=1)
    return np.asarray(level.reshape(len(start), len(steps)) > _INKED * strokes.darkness[:, None])


# Dark and light parts -----------------------------------------------------------------------------


def split_by_darkness(flat: Flat, fitted: Fitted, px_per_mm: float) -> tuple[FloatArray, NDArray[np.intp]]:
    """((m, 2, 2) ends in pixels, (m,) row of the stroke that each part is of).

    A vector drawn over its construction line has dark and light parts. Light runs at either end of a
    stroke are cut off it; those of 2 mm and more stay as strokes.
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
    length, u = lengths_and_directions(fitted.ends)
    middle = fitted.ends[row, 0] + (share * length[row])[:, None] * u[row]
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
    if dark[:least].any() and dark[-least:].any():
        return [(0, n)]
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


# Tips of arrowheads -------------------------------------------------------------------------------

STEP_MM = 0.15
"""Step between a band's pixels, along and across."""
HALF = 15
"""Pixels of a band to either side of its stroke."""
BEYOND_MM = 3.0
"""Length of a band past its stroke's ends: an arrowhead is shorter."""
GAP = 20
"""Empty columns between bands."""
CELL = 2
"""Pixels along for each answer."""
STRIP = 4096
"""Columns that the network is given at a time."""
APART = 48
"""Columns at either side of a strip, whose answers do not know all that they should."""
FULL_INK = 1.3
"""Contrast that counts as 1, of the stroke's mean."""
LEAST_DARK, MOST_INK = 0.08, 1.5
"""Contrast below which a stroke counts as so dark, and the most that ink counts."""
LEAST_MM = 2.0
"""No vector is drawn shorter."""
CERTAINTY = (2.76, 1.61)
"""The network's log odds times the first, and the second more: trained by focal loss, it says 0.7 where it
is right in 97 of 100. Logistic regression on 4,900 peaks along the vectors of 99 simulated sheets."""
LEAST_SURE, MOST_SURE = 0.04, 0.9
"""Bounds of a tip's probability. Above the second 97 of 100 are right, but errors are shared by all
that follows from the network."""
ASIDE_MM = 0.5
"""A tip lies in its own cell or the next."""
KINDS = 4
"""Heads and tails, ahead and back."""


def find_tips(flat: Flat, strokes: Strokes, mm_to_px: FloatArray) -> Tips:
    """Heads and tails of vectors along strokes of at least 2 mm."""
    rows = np.flatnonzero(lengths_and_directions(strokes.ends)[0] >= LEAST_MM)
    if not len(rows):
        return NO_TIPS
    strip = strip_of(flat, strokes.ends[rows], strokes.darkness[rows], mm_to_px)
    return _peaks(strip, answers(strip.ink), rows)


@dataclass(frozen=True, slots=True)
class Strip:
    """Bands laid end to end.

    Attributes
    ----------
    ink : (31, t) contrast over that of the band's own stroke, 0..1.5, in single precision
    band : (t,) which stroke each column is of
    along : (t,) mm from that stroke's first end
    """

    ink: Float32Array
    band: IntArray
    along: FloatArray


def strip_of(flat: Flat, ends: FloatArray, darkness: FloatArray, mm_to_px: FloatArray) -> Strip:
    """The strokes `ends` (k, 2, 2) mm straightened, 3 mm beyond their ends."""
    length, unit = lengths_and_directions(ends)
    count = np.ceil((length + 2.0 * BEYOND_MM) / STEP_MM / CELL).astype(np.int64) * CELL
    band = np.repeat(np.arange(len(ends)), count + GAP)
    first = np.concatenate([[0], np.cumsum(count + GAP)[:-1]])
    along = (np.arange(len(band)) - first[band]) * STEP_MM - BEYOND_MM
    middle = ends[band, 0] + along[:, None] * unit[band]
    aside = np.arange(-HALF, HALF + 1) * STEP_MM
    # In homogeneous coordinates a line goes on in even steps.
    start = middle @ mm_to_px[:, :2].T + mm_to_px[:, 2]
    step = unit[band, ::-1] @ (mm_to_px[:, :2] * (1.0, -1.0)).T
    x, y, w = (start[:, axis, None] + step[:, axis, None] * aside for axis in range(3))
    ink = flat.contrast(x / w, y / w)
    ink /= (FULL_INK * np.maximum(darkness, LEAST_DARK)).astype(np.float32)[band, None]
    ink[along >= length[band] + BEYOND_MM] = 0.0
    return Strip(np.minimum(ink, np.float32(MOST_INK)).T, band, along)


@cache
def _network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(str(Path(__file__).with_name("tips.onnx")))


def answers(ink: Float32Array) -> Float32Array:
    """(8, t/2): for each kind the log odds of a tip at a cell, then how far it is from there, mm."""
    wide = ink.shape[1]
    useful = STRIP - 2 * APART
    result = np.empty((2 * KINDS, wide // CELL), dtype=np.float32)
    padded = np.pad(ink, ((0, 0), (APART, STRIP)))
    for start in range(0, wide, useful):
        network = _network()
        network.setInput(np.ascontiguousarray(padded[None, None, :, start : start + STRIP]))
        output = network.forward()[0]
        part = slice(start // CELL, min(start + useful, wide) // CELL)
        result[:, part] = output[:, APART // CELL : APART // CELL + part.stop - part.start]
    return result


def _peaks(strip: Strip, scores: Float32Array, rows: IntArray) -> Tips:
    """Cells likelier than their neighbours on the same band."""
    odds = CERTAINTY[0] * scores[:KINDS] + CERTAINTY[1]
    sure = np.minimum(1.0 / (1.0 + np.exp(-np.clip(odds, -30.0, 30.0))), MOST_SURE)
    near = np.stack([np.roll(sure, shift, axis=1) for shift in (-2, -1, 1, 2)]).max(axis=0)
    kind, cell = np.nonzero((sure > LEAST_SURE) & (sure >= near))
    column = cell * CELL
    along = strip.along[column] + np.clip(scores[KINDS + kind, cell], -ASIDE_MM, ASIDE_MM)
    return Tips(
        rows[strip.band[column]],
        along.astype(np.float64),
        kind.astype(np.int64),
        sure[kind, cell].astype(float),
    )
