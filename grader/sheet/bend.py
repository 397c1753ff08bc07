"""The bend of a phone's lens on a plain sheet, from how straight its frame and edges are."""

from dataclasses import dataclass

import numpy as np

from grader.pixels import Flat, cut_across
from grader.records import FloatArray, Lens
from grader.sheet.edges import bright_towards, edge_offsets
from grader.sheet.fitting import (
    Side,
    apply,
    gauss_newton,
    homography_of,
    homography_params,
    inverted,
    log_scale,
)
from grader.sheet.lens import straight
from grader.sheet.longlines import RIDGE

_BINS = 15
_CUTS = 300
_REACH_PX = 14.0
_POINT_MM = 0.06
"""A ruled line's or a cut edge's own waves."""
_BEND_SE = 0.02
_WORTH = 3.0
"""A bend of fewer standard errors is not believed."""
_LEAST_SIDES = 4


@dataclass(frozen=True, slots=True)
class Trace:
    """A side followed at full resolution: (n, 2) pixels, and (n,) place along it from -1 to 1."""

    side: Side
    points: FloatArray
    along: FloatArray


def find_lens(flat: Flat, stored: FloatArray, sides: list[Side]) -> Lens | None:
    """The lens's bend, with the map of the straightened picture, or None where none shows.

    Unknowns: the homography, the bend, and each side's own offset and tilt (a hand's error) within
    `Model.side_se_mm`; what remains bent on all sides alike is the lens.
    """
    traces = [trace for side in sides if (trace := _traced(flat, side)) is not None]
    if len(traces) < _LEAST_SIDES:
        return None
    shape = (flat.grey.shape[0], flat.grey.shape[1])
    start = np.concatenate([homography_params(stored), [0.0], np.zeros(2 * len(traces))])

    def residuals(params: FloatArray) -> FloatArray:
        inverse = inverted(homography_of(params[:8]))
        own = params[9:].reshape(-1, 2)
        parts = [params[8:9] / _BEND_SE]
        for trace, (offset, tilt) in zip(traces, own, strict=True):
            mm = apply(inverse, straight(trace.points, float(params[8]), shape))[:, trace.side.axis]
            parts.append((mm - trace.side.value - offset - tilt * trace.along) / _POINT_MM)
            parts.append(np.array([offset, tilt]) * np.sqrt(2.0) / trace.side.model.side_se_mm)
        return np.concatenate(parts)

    params, jacobian = gauss_newton(residuals, start)
    final = residuals(params)
    inflate = max(1.0, float(final @ final) / (len(final) - len(params)))
    covariance: FloatArray = np.asarray(np.linalg.pinv(jacobian.T @ jacobian) * inflate, dtype=np.float64)
    bend = float(params[8])
    if abs(bend) < _WORTH * np.sqrt(covariance[8, 8]):
        return None
    matrix = homography_of(params[:8])
    own = params[9:].reshape(-1, 2)
    residual_mm = float(np.sqrt(np.mean(own[:, 0] ** 2 + own[:, 1] ** 2 / 3.0)))
    return Lens(bend, stored, matrix / matrix[2, 2], residual_mm, _scale_se(params[:8], covariance[:8, :8]))


def _scale_se(params: FloatArray, covariance: FloatArray) -> float:
    gradient = np.empty(8)
    for index in range(8):
        step = 1e-6 * max(abs(params[index]), 1.0)
        up, down = params.copy(), params.copy()
        up[index] += step
        down[index] -= step
        gradient[index] = (log_scale(homography_of(up)) - log_scale(homography_of(down))) / (2.0 * step)
    return float(np.sqrt(gradient @ covariance @ gradient))


def _traced(flat: Flat, side: Side) -> Trace | None:
    """Median places of a side in 15 bins along it; None where it is seen in too few."""
    ends = side.line.ends
    along = (np.arange(_CUTS) + 0.5) / _CUTS
    if side.line.kind == RIDGE:
        offset = _ridge_offset(flat, ends)
    else:
        bright = bright_towards(ends, side.line.bright, across=side.line.across)
        offset = edge_offsets(flat, ends, bright, _CUTS, _REACH_PX)
    bins = np.array_split(np.arange(_CUTS), _BINS)
    middles = np.array([along[one].mean() for one in bins])
    known = np.array([np.isfinite(offset[one]).mean() > 0.5 for one in bins])
    if known.sum() < _BINS // 2:
        return None
    off = np.array(
        [np.nanmedian(offset[one]) if good else np.nan for one, good in zip(bins, known, strict=True)]
    )
    span = ends[1] - ends[0]
    u = span / np.hypot(*span)
    points = ends[0] + middles[:, None] * span + off[:, None] * np.array([-u[1], u[0]])
    return Trace(side, points[known], 2.0 * middles[known] - 1.0)


def _ridge_offset(flat: Flat, ends: FloatArray) -> FloatArray:
    cuts = cut_across(flat, ends[None], _CUTS, _REACH_PX, np.array([0.8 * _REACH_PX]))
    usual = np.nanmedian(cuts.width)
    return np.asarray(np.where(cuts.width < 1.6 * usual, cuts.offset, np.nan)[0])
