"""The ink map of a sheet, and straight pieces of lines in it: the seeds of strokes."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage
from grader.scan.pixels import Float32Array, lattice, lengths_and_directions, parts

PX_PER_MM = 6.0
"""Resolution at which ink is looked for; strokes of 0.3 mm are two pixels wide."""
_WHOLE = 0.08
"""Relative difference up to which a whole fraction of the resolution is near enough."""
_FAINT = 20
"""Of 255: fainter than a construction line drawn with a hard pencil is paper."""
_PEAK_WINDOW_PX = 7
"""Wider than a stroke with its blur, narrower than the distance of two strokes."""
_DARK = 0.62
"""Of the darkest strokes' contrast: construction lines are lighter."""
_DARK_QUANTILE = 0.85
"""Of the ink's contrast: that of the darkest strokes."""
_POLYGON_PX = 1.0
"""Distance of a border from the straight runs that replace it."""
_LEAST_PX = 5.0
"""0.8 mm: shorter runs have no direction."""
_SOFTEN_PX = 0.7
"""Less than a stroke's width: grain fades and gaps stay open."""
_WIDEST_PX = 12
"""2 mm: a wider band is a blot."""
_PEN_PX = 2.0
"""A pen of 0.35 mm, where a sheet has no long stroke to tell."""
_BUNDLE = 1.6
"""An ink band this many pens wide is more than one stroke."""
_STRIP_MM, _STRIPS, _EVERY = 4.0, 5, 2
"""Strips narrow enough that a line 2 degrees askew stays within its own width over half of one."""
_LEAST_PEAK = 6.0
"""Of 255: fainter squares do not disturb."""
_LEAST_LINES = 12
"""A table has fewer lines; 10 mm of a strip have as many squares."""
_FILLED = 0.75
"""Share of a lattice's places that have a line: what is drawn hides some, and adds others between."""
_SPANNED = 0.6
"""Of a strip's length, from the first to the last line of the lattice."""
_DARKER = 1.35
"""Drawn lines are so much darker than printed squares."""
_DARKEST = 0.9
"""Quantile of a strip's lines: every fifth or tenth is printed darker."""


@dataclass(frozen=True, slots=True)
class Seeds:
    """Guesses of strokes at the working resolution, a row each.

    Attributes
    ----------
    ends : (n, 2, 2) px on the guessed middle line
    width : (n,) px, the guessed width of the single stroke
    border : (n, 2) row and column of an ink pixel on the run, telling which piece of ink it is of
    pen_px : usual width of a stroke on the sheet
    mask : (h, w) uint8, 1 = ink
    soft : (h, w) uint8 contrast, softened
    """

    ends: FloatArray
    width: FloatArray
    border: NDArray[np.intp]
    pen_px: float
    mask: GreyImage
    soft: GreyImage


def working_scale(px_per_mm: float) -> float:
    """Share of the full resolution at which ink is looked for: a whole fraction where one is near.

    Averages over 2 x 2 or 4 x 4 pixels are quick; 300 and 600 dpi come to 5.9 px/mm.
    """
    ratio = px_per_mm / PX_PER_MM
    whole = max(1.0, float(round(ratio)))
    return 1.0 / whole if abs(ratio / whole - 1.0) < _WHOLE else min(1.0, 1.0 / ratio)


def find_seeds(contrast: GreyImage) -> Seeds:
    """Straight runs of at least 0.8 mm along the borders of the ink."""
    soft = np.asarray(cv2.GaussianBlur(contrast, (0, 0), _SOFTEN_PX), dtype=np.uint8)
    mask = ink_mask(soft)
    first = _runs_of(mask)
    # Vectors drawn dark over faint construction lines show their own borders only in the dark.
    second = _runs_of(mask & dark_mask(soft, mask), first.pen_px)
    return Seeds(
        np.concatenate([first.ends, second.ends]),
        np.concatenate([first.width, second.width]),
        np.concatenate([first.border, second.border]),
        first.pen_px,
        mask,
        soft,
    )


@dataclass(frozen=True, slots=True)
class _Runs:
    ends: FloatArray
    width: FloatArray
    border: NDArray[np.intp]
    pen_px: float


def _runs_of(mask: GreyImage, pen_px: float | None = None) -> _Runs:
    """Straight runs of the borders of a mask, moved to the middle of their strokes."""
    edges = _border_runs(mask)
    border = edges[:, 0, ::-1].astype(np.intp)
    if len(edges) == 0:
        return _Runs(edges, np.zeros(0), border, _PEN_PX if pen_px is None else pen_px)
    inward, width = _band_width(mask, edges)
    length = np.hypot(*(edges[:, 1] - edges[:, 0]).T)
    long_enough = length >= 2.0 * PX_PER_MM
    usual = _usual(width[long_enough], length[long_enough]) if long_enough.any() else _PEN_PX
    pen = usual if pen_px is None else pen_px
    single = np.where(width <= _BUNDLE * pen, width, pen)
    # Border pixels are ink: the band's edge lies half a pixel further out.
    shift = (single - 1.0) / 2.0
    return _Runs(edges + (inward * shift[:, None])[:, None, :], single, border, pen)


def dark_mask(soft: GreyImage, mask: GreyImage) -> GreyImage:
    """What is nearly as dark as the darkest strokes of the sheet, as 1."""
    inked = soft[mask.view(bool)]
    level = _DARK * float(np.quantile(inked[::7], _DARK_QUANTILE)) if len(inked) else 255.0
    return np.asarray((soft >= level).astype(np.uint8))


def ink_mask(soft: GreyImage) -> GreyImage:
    """Ink as 1: darker than half of the darkest ink nearby.

    So faint and dark strokes both keep their width, and neighbours their gap.
    """
    peak = cv2.dilate(soft, np.ones((_PEAK_WINDOW_PX, _PEAK_WINDOW_PX), np.uint8))
    half = np.asarray(peak) // 2
    return np.asarray(((soft >= half) & (soft >= _FAINT)).astype(np.uint8))


def _border_runs(mask: GreyImage) -> FloatArray:
    """(n, 2, 2) straight runs of the borders, with the ink on one fixed hand."""
    contours, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
    polygons = [
        cv2.approxPolyDP(contour, _POLYGON_PX, closed=True)
        for contour in contours
        if len(contour) >= 2 * _LEAST_PX
    ]
    if not polygons:
        return np.zeros((0, 2, 2))
    corners = np.concatenate(polygons)[:, 0].astype(np.float64)
    size = np.array([len(polygon) for polygon in polygons])
    after = np.arange(1, len(corners) + 1)
    after[np.cumsum(size) - 1] -= size
    edges = np.stack([corners, corners[after]], axis=1)
    return np.asarray(edges[np.hypot(*(edges[:, 1] - edges[:, 0]).T) >= _LEAST_PX])


def _band_width(mask: GreyImage, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
    """((n, 2) unit normals into the ink, (n,) median width of the ink band there, px)."""
    share = np.linspace(0.1, 0.9, 9)
    direction = lengths_and_directions(edges)[1]
    normal = np.column_stack([direction[:, 1], -direction[:, 0]])
    points = edges[:, None, 0] + share[None, :, None] * (edges[:, None, 1] - edges[:, None, 0])
    depth = np.arange(1.0, _WIDEST_PX + 1.0)
    inner = np.empty((len(edges), len(share)))
    for part in parts(len(edges), 2 * len(share) * len(depth)):
        inner[part] = _run(mask, points[part], normal[part], depth)
    return normal, np.median(inner, axis=1) + 1.0


def _run(mask: GreyImage, points: FloatArray, normal: FloatArray, depth: FloatArray) -> FloatArray:
    """How many pixels of ink follow each border point along its normal."""
    at = points[:, :, None, :] + depth[None, None, :, None] * normal[:, None, None, :]
    column = np.clip(np.rint(at[..., 0]), 0, mask.shape[1] - 1).astype(int)
    row = np.clip(np.rint(at[..., 1]), 0, mask.shape[0] - 1).astype(int)
    return np.asarray(np.minimum.accumulate(mask[row, column], axis=2).sum(axis=2), dtype=np.float64)


def _usual(width: FloatArray, weight: FloatArray) -> float:
    """Weighted lower quartile: bundles are wider than a pen, nothing is narrower."""
    order = np.argsort(width)
    cumulated = np.cumsum(weight[order])
    return float(width[order][np.searchsorted(cumulated, 0.35 * cumulated[-1])])


# Graph paper --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Squares:
    """The printed squares of graph paper.

    Attributes
    ----------
    dark : 0..255, the contrast of their darker lines
    pitch_px : distance of two lines, the smaller of both directions
    """

    dark: float
    pitch_px: float


def find_squares(contrast: GreyImage) -> Squares | None:
    """Printed squares, None where there are none.

    Arguments: `contrast` is 0 (paper) to 255 (black), at about 6 px/mm.

    Lines that fill most of a strip, at equal distances, in most strips of both directions. Slanted
    strokes never fill a strip, and a table's lines are too few.
    """
    level, upright = _of_strips(contrast), _of_strips(np.ascontiguousarray(contrast.T))
    if level is None or upright is None:
        return None
    return Squares(min(level.dark, upright.dark), min(level.pitch_px, upright.pitch_px))


def without_squares(contrast: GreyImage, squares: Squares | None) -> GreyImage:
    """Contrast with all that is no darker than printed squares left out; as given where there are none."""
    if squares is None:
        return contrast
    _, drawn = cv2.threshold(contrast, _DARKER * squares.dark, 0, cv2.THRESH_TOZERO)
    return np.asarray(drawn, dtype=np.uint8)


def _of_strips(contrast: GreyImage) -> Squares | None:
    """Lines at equal distances in most strips across the picture."""
    high = contrast.shape[0]
    deep = round(_STRIP_MM * PX_PER_MM)
    strips = []
    for top in np.linspace(0.08 * high, 0.92 * high - deep, _STRIPS).astype(int):
        strip = contrast[top : top + deep : _EVERY]
        strips.append(_regular_peaks(np.median(strip, axis=0).astype(np.float32)))
    squared = [squares for squares in strips if squares is not None]
    if 2 * len(squared) <= len(strips):
        return None
    middle = np.median([(squares.dark, squares.pitch_px) for squares in squared], axis=0)
    return Squares(float(middle[0]), float(middle[1]))


def _regular_peaks(profile: Float32Array) -> Squares | None:
    """The peaks of a profile that are at equal distances, where they are many and few are missing."""
    above = profile - _floor(profile)
    inner = above[1:-1]
    at = 1 + np.flatnonzero((inner >= _LEAST_PEAK) & (inner >= above[:-2]) & (inner > above[2:]))
    if len(at) < _LEAST_LINES:
        return None
    before, after = above[at - 1], above[at + 1]
    place = at + (after - before) / (before + above[at] + after)
    index = lattice(place)
    on = index >= 0.0
    found, places = np.count_nonzero(on), index.max() + 1.0
    if found < max(_LEAST_LINES, _FILLED * places):
        return None
    first, last = place[on][[0, -1]]
    if last - first < _SPANNED * len(profile):
        return None
    return Squares(float(np.quantile(profile[at[on]], _DARKEST)), float(last - first) / (places - 1.0))


def _floor(profile: Float32Array) -> FloatArray:
    wide = round(2.0 * PX_PER_MM) | 1
    row = profile[None, :]
    return np.asarray(cv2.erode(row, np.ones((1, wide), np.uint8))[0], dtype=np.float64)
