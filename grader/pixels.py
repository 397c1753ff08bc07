"""Pixels with their light levelled, and strokes measured across at full resolution.

Shared by the stages that look at pixels (`sheet`, `ink`). Pixel coordinates are (x right, y down),
the centre of the stored image's top left pixel is (0, 0).
"""

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage

Float32Array = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

_PAPER_LONG_SIDE_PX = 640
"""Resolution of the paper's brightness: about 1.5 px/mm on A3."""
_CLOSE_PX = 17
"""Closing window there (11 mm): wider than any stroke, letter or filled arrowhead."""
_ACROSS_STEP_PX = 0.5
_MAX_SAMPLES = 800
_TUKEY = 4.685
"""Tukey's constant: 95 % efficient for normal errors."""


@dataclass(frozen=True, slots=True)
class Flat:
    """A page with the brightness of its paper beside it.

    Attributes
    ----------
    grey : (h, w) uint8 as stored
    paper : brightness of the paper (or bed) around each place, reduced
    step : full pixels per pixel of `paper`, along x and y
    """

    grey: GreyImage
    paper: GreyImage
    step: tuple[float, float]

    def contrast(self, x: FloatArray, y: FloatArray) -> Float32Array:
        """Darkness against the paper at points given in pixels, 0 = paper .. 1 = black."""
        mapped = np.asarray(x, dtype=np.float32), np.asarray(y, dtype=np.float32)
        ink = cv2.remap(self.grey, *mapped, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        at = (mapped[0] + 0.5) / np.float32(self.step[0]) - np.float32(0.5), (
            mapped[1] + 0.5
        ) / np.float32(self.step[1]) - np.float32(0.5)
        level = cv2.remap(self.paper, *at, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
        share = ink.astype(np.float32) / np.maximum(level, 1).astype(np.float32)
        return np.asarray(np.clip(1.0 - share, 0.0, 1.0), dtype=np.float32)

    def reduced(self, scale: float) -> GreyImage:
        """Contrast of the whole page at `scale` times its resolution, 0 = paper .. 255 = black."""
        small = shrink(self.grey, scale)
        level = cv2.resize(self.paper, (small.shape[1], small.shape[0]), interpolation=cv2.INTER_LINEAR)
        return np.asarray(cv2.subtract(255, cv2.divide(small, level, scale=255)), dtype=np.uint8)


def flatten(grey: GreyImage) -> Flat:
    """Level the light: the paper's brightness is what a closing wider than any stroke leaves."""
    scale = min(1.0, _PAPER_LONG_SIDE_PX / max(grey.shape))
    small = shrink(grey, scale)
    closed = cv2.morphologyEx(small, cv2.MORPH_CLOSE, np.ones((_CLOSE_PX, _CLOSE_PX), np.uint8))
    paper = np.asarray(cv2.GaussianBlur(closed, (0, 0), 2.0), dtype=np.uint8)
    step = grey.shape[1] / paper.shape[1], grey.shape[0] / paper.shape[0]
    return Flat(grey, paper, step)


def shrink(grey: GreyImage, scale: float) -> GreyImage:
    """The image at `scale` <= 1 times its resolution, averaged over areas."""
    if scale >= 1.0:
        return grey
    size = max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale))
    return np.asarray(cv2.resize(grey, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


@dataclass(frozen=True, slots=True)
class Cuts:
    """A stroke cut across at many places along a guessed line.

    Attributes
    ----------
    along : (n,) distance from the guess's start, px
    offset : (n,) middle of the ink across the guess, px, positive to the left of its direction
        seen with y down (along (-dy, dx)); nan where the guess crosses no ink
    left, right : (n,) the two borders of the ink, px
    dark : (n,) contrast at the middle
    """

    along: FloatArray
    offset: FloatArray
    left: FloatArray
    right: FloatArray
    dark: FloatArray


def cut_across(
    flat: Flat, start: FloatArray, end: FloatArray, reach_px: float, capture_px: float
) -> Cuts:
    """Borders of the ink across the line from `start` to `end`, one cut about every pixel.

    Each cut looks `reach_px` to either side; the run of ink taken is the one nearest to the guess,
    within `capture_px`. A border is where the contrast passes half of the stroke's own.
    """
    length = float(np.hypot(*(end - start)))
    count = int(np.clip(length, 8, _MAX_SAMPLES))
    along = (np.arange(count) + 0.5) * (length / count)
    direction = (end - start) / max(length, 1e-9)
    normal = np.array([-direction[1], direction[0]])
    half = int(np.ceil(reach_px / _ACROSS_STEP_PX))
    across = np.arange(-half, half + 1) * _ACROSS_STEP_PX
    x = start[0] + along[:, None] * direction[0] + across[None, :] * normal[0]
    y = start[1] + along[:, None] * direction[1] + across[None, :] * normal[1]
    return _borders(flat.contrast(x, y), along, across, capture_px)


def _borders(contrast: Float32Array, along: FloatArray, across: FloatArray, capture_px: float) -> Cuts:
    near = np.abs(across) <= capture_px
    peak = contrast[:, near].max(axis=1)
    level = 0.5 * float(np.median(peak[peak >= np.quantile(peak, 0.3)]))
    inked = contrast > level
    rows = np.arange(len(along))
    columns = np.arange(len(across))
    distance = np.where(inked & near[None, :], np.abs(across)[None, :], np.inf)
    middle = distance.argmin(axis=1)
    found = np.isfinite(distance[rows, middle])
    before = np.maximum.accumulate(np.where(inked, -1, columns[None, :]), axis=1)[rows, middle]
    after = np.minimum.accumulate(np.where(inked, len(across), columns[None, :])[:, ::-1], axis=1)[
        :, ::-1
    ][rows, middle]
    left = _crossing(contrast, across, rows, before, 1, level)
    right = _crossing(contrast, across, rows, after, -1, level)
    offset = np.where(found, (left + right) / 2.0, np.nan)
    dark = np.where(found, contrast[rows, middle], 0.0).astype(np.float64)
    return Cuts(along, offset, np.where(found, left, np.nan), np.where(found, right, np.nan), dark)


def _crossing(
    contrast: Float32Array, across: FloatArray, rows: NDArray[np.intp], outer: NDArray[np.intp], inward: int, level: float
) -> FloatArray:
    """Where the contrast passes `level` between `outer` (paper) and its neighbour inward (ink)."""
    last = len(across) - 1
    beyond = (outer < 0) | (outer > last)
    outside = np.clip(outer, 0, last)
    inside = np.clip(outer + inward, 0, last)
    low, high = contrast[rows, outside].astype(np.float64), contrast[rows, inside].astype(np.float64)
    share = np.clip((level - low) / np.maximum(high - low, 1e-6), 0.0, 1.0)
    crossed = across[outside] + inward * share * _ACROSS_STEP_PX
    return np.where(beyond, across[outside], crossed)


def robust_line(
    t: FloatArray, y: FloatArray, noise_floor: float, weight: FloatArray | None = None
) -> tuple[float, float, float, FloatArray]:
    """Straight line y = a + b t by Tukey's biweight: (a, b, scale of the residuals, weights).

    Starts from the Theil-Sen-like line through the medians of the two halves, so that a third of
    strays on one side cannot capture it.
    """
    base = np.ones_like(t) if weight is None else weight
    middle = np.median(t)
    low, high = t <= middle, t >= middle
    t0, t1, y0, y1 = np.median(t[low]), np.median(t[high]), np.median(y[low]), np.median(y[high])
    b = (y1 - y0) / (t1 - t0) if t1 > t0 else 0.0
    a = float(np.median(y - b * t))
    weights, scale = base, noise_floor
    for _ in range(8):
        residual = y - a - b * t
        scale = max(1.4826 * float(np.median(np.abs(residual))), noise_floor)
        weights = base * np.clip(1.0 - (residual / (_TUKEY * scale)) ** 2, 0.0, None) ** 2
        total = weights.sum()
        if total <= 0:
            break
        tm, ym = (weights @ t) / total, (weights @ y) / total
        spread = weights @ (t - tm) ** 2
        b = float(weights @ ((t - tm) * (y - ym)) / spread) if spread > 0 else 0.0
        a = float(ym - b * tm)
    return float(a), float(b), scale, weights
