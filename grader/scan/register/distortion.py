"""The lens's distortion and the bend of a sheet, found on lines that must be straight."""

from dataclasses import dataclass, replace

import cv2
import numpy as np

from grader.records import FloatArray, GreyImage, Lens, Page, Sheet
from grader.scan.pixels import Flat, cut_across, inverted, lengths_and_directions, mapped
from grader.scan.register.fitting import (
    MarkedPoints,
    Projection,
    Side,
    fit_projection,
    homography_of,
    homography_params,
    scale_error,
    solve,
)
from grader.scan.register.lines import RIDGE, edge_offsets

MAX_BEND = 0.06
"""Phones bend by 0.02 at most, wide-angle lenses more."""
_WORTH_MM = 0.04
"""Misfit below this is no lens: corners, paper and printer make it too."""
_WORTH_SHARE = 0.7
"""The bend is believed where the misfit falls to this share of what it was, or lower."""
_LEAST_POINTS = 16
"""Four markers: a bend takes the part of a slanted view where there are fewer."""
_ROUNDS = 12
"""Each makes the error eight times smaller at the corner of a picture with the strongest bend."""
_BAND_ROWS = 64
"""Number of rows whose maps fit the processor's cache together."""
_BINS = 15
"""Pieces of a side whose median place is taken: letters and stains on it do not count."""
_CUTS = 300
"""Places at which a side is followed."""
_REACH_PX = 14.0
"""Distance to either side of its straight line at which a bent side is looked for."""
_POINT_MM = 0.06
"""A ruled line's or a cut edge's own waves."""
_BEND_SE = 0.02
"""Bends of usual cameras scatter about 0 by this much."""
_WORTH_SE = 3.0
"""A bend of fewer standard errors is not believed."""
_LEAST_SIDES = 4
"""Fewer sides do not tell a bend from sides that were ruled askew."""


# The picture --------------------------------------------------------------------------------------


def straight(points_px: FloatArray, bend: float, shape: tuple[int, int]) -> FloatArray:
    """Return where points (n, 2) would be stored without the bend; the inverse of the model, by iteration."""
    centre, radius = _middle(shape)
    stored = (points_px - centre) / radius
    unbent = stored
    for _ in range(_ROUNDS):
        unbent = stored / (1.0 + bend * (unbent**2).sum(axis=1, keepdims=True))
    return np.asarray(centre + unbent * radius)


def straightened(grey: GreyImage, bend: float) -> GreyImage:
    """The picture as a lens without bend would have stored it."""
    (cx, cy), radius = _middle(grey.shape)
    across = np.arange(grey.shape[1], dtype=np.float32) - np.float32(cx)
    result = np.empty_like(grey)
    for top in range(0, len(grey), _BAND_ROWS):
        band = result[top : top + _BAND_ROWS]
        down = (np.arange(len(band), dtype=np.float32) + np.float32(top - cy))[:, None]
        share = np.float32(1.0) + np.float32(bend / radius**2) * (across**2 + down**2)
        x, y = across * share + np.float32(cx), down * share + np.float32(cy)
        cv2.remap(grey, x, y, cv2.INTER_LINEAR, dst=band, borderMode=cv2.BORDER_REPLICATE)
    return result


def straighten(page: Page, sheet: Sheet) -> tuple[Page, Sheet]:
    """The page as a lens without bend would have stored it, and its sheet; the same where none was found.

    To be done before strokes are searched: a bent stroke is not straight, and its place is off by
    half a millimetre on usual phones. `sheet.lens.stored` keeps the map of the stored picture.
    """
    if sheet.lens is None or sheet.mm_to_px is sheet.lens.straight:
        return page, sheet
    lens = sheet.lens
    grey = straightened(page.grey, lens.bend)
    straight = replace(sheet, mm_to_px=lens.straight, residual_mm=lens.residual_mm, scale_se=lens.scale_se)
    return replace(page, grey=grey), straight


def _middle(shape: tuple[int, ...]) -> tuple[FloatArray, float]:
    centre = np.array([(shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0])
    return centre, float(np.hypot(shape[1] / 2.0, shape[0] / 2.0))


# By markers ---------------------------------------------------------------------------------------


def find_bend(marked: MarkedPoints, plain: Projection, shape: tuple[int, int]) -> tuple[float, Projection]:
    """The bend that best explains marked points, and its map; 0 and the `plain` one where that is little."""
    if plain.rms_mm < _WORTH_MM or len(marked) < _LEAST_POINTS:
        return 0.0, plain

    def off_px(params: FloatArray) -> FloatArray:
        matrix = homography_of(params[2:], plain.centre_mm, plain.size_mm)
        at = mapped(matrix, marked.mm + params[1] * marked.outward)
        return (at - straight(marked.px, float(params[0]), shape)).ravel()

    start = np.concatenate([np.zeros(2), plain.params, np.zeros(8 - len(plain.params))])
    bend = float(solve(off_px, start).params[0])
    if abs(bend) > MAX_BEND:
        return 0.0, plain
    best = fit_projection(replace(marked, px=straight(marked.px, bend, shape)))
    return (0.0, plain) if best.rms_mm > _WORTH_SHARE * plain.rms_mm else (bend, best)


# By the sides of a plain sheet --------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Trace:
    """A side followed at full resolution: (n, 2) pixels, and (n,) place along it from -1 to 1."""

    side: Side
    points: FloatArray
    along: FloatArray


def find_lens(flat: Flat, stored: FloatArray, sides: list[Side]) -> Lens | None:
    """The lens's bend, with the map of the straightened picture, or None where none shows.

    Unknowns: the homography, the bend, and each side's own offset and tilt (a hand's error) within
    `Outline.side_se_mm`; what remains bent on all sides alike is the lens.
    """
    traces = [trace for side in sides if (trace := _traced(flat, side)) is not None]
    if len(traces) < _LEAST_SIDES:
        return None
    shape = (flat.grey.shape[0], flat.grey.shape[1])

    points, along = (
        np.concatenate([getattr(trace, name) for trace in traces]) for name in ("points", "along")
    )
    of = np.repeat(np.arange(len(traces)), [len(trace.along) for trace in traces])
    axis, value = np.array([(trace.side.axis, trace.side.value) for trace in traces]).T
    own_se = np.array([[trace.side.model.side_se_mm] for trace in traces]) / np.sqrt(2.0)
    rows, column = np.arange(len(of)), axis[of].astype(np.intp)

    def residuals(params: FloatArray) -> FloatArray:
        own = params[9:].reshape(-1, 2)
        inverse = inverted(homography_of(params[:8]))
        mm = mapped(inverse, straight(points, float(params[8]), shape))[rows, column]
        off = (mm - value[of] - own[of, 0] - own[of, 1] * along) / _POINT_MM
        return np.concatenate([params[8:9] / _BEND_SE, off, (own / own_se).ravel()])

    start = np.concatenate([homography_params(stored), [0.0], np.zeros(2 * len(traces))])
    fit = solve(residuals, start)
    bend, own = float(fit.params[8]), fit.params[9:].reshape(-1, 2)
    inflate = np.sqrt(max(1.0, fit.chi2 / (len(residuals(start)) - len(start))))
    if abs(bend) < _WORTH_SE * inflate * np.sqrt(fit.covariance[8, 8]):
        return None
    matrix = homography_of(fit.params[:8])
    residual_mm = float(np.sqrt(np.mean(own[:, 0] ** 2 + own[:, 1] ** 2 / 3.0)))
    scale_se = float(inflate) * scale_error(lambda params: homography_of(params[:8]), fit)
    return Lens(bend, stored, matrix / matrix[2, 2], residual_mm, scale_se)


def _traced(flat: Flat, side: Side) -> Trace | None:
    """Median places of a side in 15 bins along it; None where it is seen in too few."""
    line = side.line
    offset = (
        _ridge_offset(flat, line.ends) if line.kind == RIDGE else edge_offsets(flat, line, _CUTS, _REACH_PX)
    )
    bins = offset.reshape(_BINS, -1)
    known = np.isfinite(bins).mean(axis=1) > 0.5
    if known.sum() < _BINS // 2:
        return None
    along = ((np.arange(_BINS) + 0.5) / _BINS)[known]
    (length,), (u,) = lengths_and_directions(line.ends[None])
    aside = np.nanmedian(bins[known], axis=1)
    points = line.ends[0] + along[:, None] * length * u + aside[:, None] * np.array([-u[1], u[0]])
    return Trace(side, points, 2.0 * along - 1.0)


def _ridge_offset(flat: Flat, ends: FloatArray) -> FloatArray:
    """(cuts,) how far across a drawn line the middle of its ink lies, px; nan where other ink is beside."""
    cuts = cut_across(flat, ends[None], _CUTS, _REACH_PX, np.array([0.8 * _REACH_PX]))
    usual = np.nanmedian(cuts.width)
    return np.asarray(np.where(cuts.width < 1.6 * usual, cuts.offset, np.nan)[0])
