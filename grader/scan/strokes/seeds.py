"""The ink map of a sheet, and straight pieces of lines in it: the seeds of strokes."""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage
from grader.scan.pixels import lengths_and_directions

PX_PER_MM = 6.0
"""Resolution at which ink is looked for; strokes of 0.3 mm are two pixels wide."""
_WHOLE = 0.08
"""Relative difference up to which a whole fraction of the resolution is near enough."""
_FAINT = 20
"""Contrast of 255: ink fainter than a construction line drawn with a hard pencil is paper."""
_PEAK_WINDOW_PX = 7
"""Wider than a stroke with its blur, narrower than the distance of two strokes."""
_DARK = 0.62
"""Share of the darkest strokes' contrast: construction lines are lighter."""
_DARK_QUANTILE = 0.85
"""Quantile of the ink's contrast that is the darkest strokes'."""
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
    """Return a mask of the ink that is nearly as dark as the darkest strokes of the sheet, as 1."""
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
    return normal, np.median(_run(mask, points, normal), axis=1) + 1.0


def _run(mask: GreyImage, points: FloatArray, normal: FloatArray) -> NDArray[np.intp]:
    """(n, m) how many pixels of ink follow each border point (n, m, 2) along its normal (n, 2)."""
    count, each = points.shape[:2]
    run, border = np.zeros(count * each, dtype=np.intp), np.arange(count * each)
    at, step = points.reshape(-1, 2).T.copy(), np.repeat(normal.T, each, axis=1)
    last = np.array(mask.shape[::-1])[:, None] - 1
    for depth in range(1, _WIDEST_PX + 1):
        column, row = np.clip(np.rint(at + depth * step).astype(np.intp), 0, last)
        inked = mask[row, column].view(bool)
        border, at, step = border[inked], at[:, inked], step[:, inked]
        run[border] += 1
    return run.reshape(count, each)


def _usual(width: FloatArray, weight: FloatArray) -> float:
    """Weighted lower quartile: bundles are wider than a pen, nothing is narrower."""
    order = np.argsort(width)
    cumulated = np.cumsum(weight[order])
    return float(width[order][np.searchsorted(cumulated, 0.35 * cumulated[-1])])
