"""Homographies, pictures with their light levelled, and strokes measured across at full resolution.

Shared by registration, strokes and handwriting. Pixel coordinates are (x right,
y down), the centre of the stored image's top left pixel is (0, 0). A homography is a (3, 3) array.
"""

from collections.abc import Iterator
from dataclasses import dataclass, fields

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import Box, FloatArray, GreyImage

Float32Array = NDArray[np.float32]
BoolArray = NDArray[np.bool_]

TITLE_BLOCK_MM = (215.0, 80.0)
"""Width and height of the corner of a sheet in which a title block may lie."""
_PAPER_LONG_SIDE_PX = 640
"""Resolution of the paper's brightness: about 1.5 px/mm on A3."""
_CLOSE_PX = 17
"""Closing window there (11 mm): wider than any stroke, letter or filled arrowhead."""
_ACROSS_STEP_PX = (0.5, 2.0)
"""Finer steps than half a pixel say nothing new; coarser ones than two miss a stroke."""
_ACROSS_STEPS = 16
"""Samples to one side of a cut, where that is neither finer nor coarser than the steps allow."""
_REMAP_ROWS = 32000
"""Image maps may not have more rows."""
_PART = 1 << 21
"""Values of each array of a computation in parts: 8 MB in single precision."""
_SAMPLED_ROWS = 37
"""Every such row tells whether a page has tones."""
_RIM = 0.06
"""Share of the long side: paper's edges on a copier's glass are broad and black."""
_INKED = 200
"""Brightness of 255: lines that an office scanner thinned are up to this bright."""
_BLEACHED = 253, 0.9
"""Brightness of paper that a scanner made white, and its share of a page: only then faint ink is in dots."""
_LONELY = 3
"""Most inked pixels among the nine around a dot. A line that is drawn through has more."""
_DOTTED = 0.12
"""Share of ink in such dots: copies have up to 0.06, faint ones 0.16 to 0.42, dithered pages over 0.3."""
_TUKEY_ROUNDS = 6
_TUKEY = 4.685
"""Tukey's constant: 95 % efficient for normal errors."""


# Homographies -------------------------------------------------------------------------------------


def mapped(homography: FloatArray, points: FloatArray) -> FloatArray:
    """(..., 2) points through a homography."""
    if points.size == 0:
        return np.zeros(points.shape)
    flat = np.ascontiguousarray(points, dtype=np.float64).reshape(-1, 1, 2)
    return np.asarray(cv2.perspectiveTransform(flat, homography), dtype=np.float64).reshape(points.shape)


def inverted(homography: FloatArray) -> FloatArray:
    """The inverse homography. Raises numpy.linalg.LinAlgError where there is none."""
    return np.asarray(np.linalg.inv(homography), dtype=np.float64)


def through_corners(corners: FloatArray, onto: FloatArray) -> FloatArray:
    """The homography that maps four corners (4, 2) onto four others; not finite where they span no area."""
    matrix = cv2.getPerspectiveTransform(corners.astype(np.float32), onto.astype(np.float32))
    return np.asarray(matrix, dtype=np.float64)


def local_axes(homography: FloatArray, at: FloatArray, step: float = 1.0) -> tuple[FloatArray, FloatArray]:
    """Return where steps along x and along y lead from points (n, 2): two (n, 2), per unit of the step."""
    origin = mapped(homography, at)
    right, down = (mapped(homography, at + step * axis) - origin for axis in np.eye(2))
    return right / step, down / step


def at_full_size(points: FloatArray, scale: float | FloatArray) -> FloatArray:
    """Points of a picture reduced by `scale` (along x and y, or both), in pixels of the full one."""
    return (points + 0.5) / scale - 0.5


def reduction(scale: float) -> FloatArray:
    """The homography from full pixels to those of the picture reduced by `scale`."""
    shift = 0.5 * scale - 0.5
    return np.array([[scale, 0.0, shift], [0.0, scale, shift], [0.0, 0.0, 1.0]])


def cut_out(
    grey: GreyImage, mm_to_px: FloatArray, box: Box, px_per_mm: float, outside: int | None = None
) -> GreyImage:
    """A box of the sheet resampled upright; empty where no part of it is in the picture.

    The centre of the result's pixel q lies (q + 0.5) / px_per_mm mm from the box's left or upper side.
    Beyond the picture it has the value `outside`, or without one that of the picture's nearest pixel.
    """
    x, y, wide, high = box
    size = round(wide * px_per_mm), round(high * px_per_mm)
    step = 1.0 / px_per_mm
    to_px = mm_to_px @ np.array([[step, 0.0, x + step / 2.0], [0.0, step, y + step / 2.0], [0.0, 0.0, 1.0]])
    corners = mapped(to_px, np.array([(0.0, 0.0), (size[0], 0.0), (0.0, size[1]), size]))
    if np.any(corners.max(axis=0) < 0.0) or np.any(corners.min(axis=0) > np.array(grey.shape[::-1]) - 1.0):
        return np.zeros((0, 0), dtype=np.uint8)
    border = cv2.BORDER_REPLICATE if outside is None else cv2.BORDER_CONSTANT
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    cut = cv2.warpPerspective(
        grey, to_px, size, flags=flags, borderMode=border, borderValue=(outside or 0,) * 4
    )
    return np.asarray(cut, dtype=np.uint8)


# Segments and stretches of lines ------------------------------------------------------------------


def reached(low: FloatArray, high: FloatArray, start: tuple[float, float], gap: float) -> BoolArray:
    """Return which stretches of a line, `low` to `high` (n,), are reached from another over gaps no wider."""
    at_once = (low <= start[1] + gap) & (high >= start[0] - gap)
    if at_once.all():
        return np.asarray(at_once)
    lows, highs = np.append(low, start[0]), np.append(high, start[1])
    order = lows.argsort()
    # A stretch that begins beyond all before it, and a gap, begins another group.
    far = np.maximum.accumulate(highs[order])
    group = np.empty(len(order), dtype=np.intp)
    group[order[0]], group[order[1:]] = 0, (lows[order[1:]] > far[:-1] + gap).cumsum()
    return np.asarray(group[:-1] == group[-1])


def lengths_and_directions(ends: FloatArray) -> tuple[FloatArray, FloatArray]:
    """((...) lengths, (..., 2) unit vectors from first to second end) of segments (..., 2, 2)."""
    span = ends[..., 1, :] - ends[..., 0, :]
    length = np.maximum(np.hypot(span[..., 0], span[..., 1]), 1e-9)
    return length, span / length[..., None]


# Levelled light -----------------------------------------------------------------------------------


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
        """Darkness against the paper at points (r, m) given in pixels, 0 = paper .. 1 = black.

        The paper's brightness is taken once for each row, at its middle: a row spans millimetres.
        """
        middle = x.shape[1] // 2
        level = self._paper_at(x[:, middle], y[:, middle])
        dark = sampled(self.grey, x, y)
        dark /= np.maximum(level, np.float32(1.0))[:, None]
        np.subtract(np.float32(1.0), dark, out=dark)
        return np.clip(dark, np.float32(0.0), np.float32(1.0), out=dark)

    def _paper_at(self, x: FloatArray, y: FloatArray) -> Float32Array:
        """(r,) brightness of the paper at points given in pixels."""
        reduced = (x + 0.5) / self.step[0] - 0.5, (y + 0.5) / self.step[1] - 0.5
        return sampled(self.paper, reduced[0][:, None], reduced[1][:, None])[:, 0]

    def reduced(self, scale: float) -> GreyImage:
        """Contrast of the whole page at `scale` times its resolution, 0 = paper .. 255 = black."""
        small = shrink(self.grey, scale)
        level = cv2.resize(self.paper, (small.shape[1], small.shape[0]), interpolation=cv2.INTER_LINEAR)
        return np.asarray(cv2.bitwise_not(cv2.divide(small, level, scale=255)), dtype=np.uint8)


def parts(count: int, each: int) -> Iterator[slice]:
    """Slices of `count` rows of `each` values: a computation in parts needs a bounded memory."""
    rows = max(1, _PART // max(each, 1))
    for start in range(0, count, rows):
        yield slice(start, min(start + rows, count))


def flatten(grey: GreyImage) -> Flat:
    """Level the light: the paper's brightness is what a closing wider than any stroke leaves."""
    scale = min(1.0, _PAPER_LONG_SIDE_PX / max(grey.shape))
    small = shrink(grey, scale)
    closed = cv2.morphologyEx(small, cv2.MORPH_CLOSE, np.ones((_CLOSE_PX, _CLOSE_PX), np.uint8))
    paper = np.asarray(cv2.GaussianBlur(closed, (0, 0), 2.0), dtype=np.uint8)
    step = grey.shape[1] / paper.shape[1], grey.shape[0] / paper.shape[0]
    return Flat(grey, paper, step)


def shrink(grey: GreyImage, scale: float) -> GreyImage:
    """The image at `scale` <= 1 times its resolution, averaged over areas.

    Exact halvings are thirty times faster than an average over areas of another size: they go first, and
    one interpolation makes the rest of the way. The whole image spans the whole result, so a pixel's
    centre lies at (x + 0.5) times the ratio of the sizes, less 0.5.
    """
    if scale >= 1.0:
        return grey
    wide, high = max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale))
    half, halvings = grey, 0
    while wide <= half.shape[1] // 2 and high <= half.shape[0] // 2:
        half = averaged(half, 2)
        halvings += 1
    if halvings == 0:
        return np.asarray(cv2.resize(grey, (wide, high), interpolation=cv2.INTER_AREA), dtype=np.uint8)
    ratio = np.array([grey.shape[1] / wide, grey.shape[0] / high]) / 2.0**halvings
    # A column or row left over when halving must not shift what follows: no plain resize.
    to_half = np.column_stack([np.diag(ratio), 0.5 * ratio - 0.5])
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpAffine(half, to_half, (wide, high), flags=flags, borderMode=cv2.BORDER_REPLICATE),
        dtype=np.uint8,
    )


def averaged(grey: GreyImage, side: int) -> GreyImage:
    """Averages over squares of so many pixels; what is left over at the right and below is left out."""
    size = max(1, grey.shape[1] // side), max(1, grey.shape[0] // side)
    squares = grey[: size[1] * side, : size[0] * side]
    return np.asarray(cv2.resize(squares, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


def is_black_and_white(grey: GreyImage) -> bool:
    """Return whether a page has no tones between black and white."""
    rows = grey[::_SAMPLED_ROWS]
    return not np.any((rows > 0) & (rows < 255))


def is_dotted(grey: GreyImage) -> bool:
    """Return whether paper was made white, by one bit or stretched contrast, and much of the ink is dots."""
    level, share = _BLEACHED
    if not is_black_and_white(grey) and np.mean(grey[::_SAMPLED_ROWS] >= level) < share:
        return False
    # A strip narrower than two rims has no more than its middle.
    rim = min(round(_RIM * max(grey.shape)), (min(grey.shape) - 1) // 2)
    ink = np.ascontiguousarray((grey[rim:-rim, rim:-rim] if rim else grey) < _INKED)
    around = cv2.boxFilter(ink.view(np.uint8), cv2.CV_8U, (3, 3), normalize=False)
    lonely = np.count_nonzero(ink & (np.asarray(around) <= _LONELY))
    return bool(lonely > _DOTTED * np.count_nonzero(ink))


# Pieces of ink ------------------------------------------------------------------------------------


def connected(mask: GreyImage) -> tuple[NDArray[np.int32], FloatArray]:
    """Return which piece each pixel of a mask of 0 and 1 is of, 0 for none, and the pieces' boxes.

    Boxes are (c, 4) left, top, width, height. OpenCV's own take six times as long on a page.
    """
    count, labels = cv2.connectedComponents(mask, connectivity=8)
    inked = np.flatnonzero(mask.view(bool))
    piece = np.asarray(labels.reshape(-1)[inked] - 1, dtype=np.intp)
    row, column = np.divmod(inked, mask.shape[1])
    low, high = np.full((2, count - 1), max(mask.shape)), np.zeros((2, count - 1), dtype=np.intp)
    for axis, at in enumerate((column, row)):
        np.minimum.at(low[axis], piece, at)
        np.maximum.at(high[axis], piece, at)
    return np.asarray(labels, dtype=np.int32), np.vstack([low, high + 1 - low]).T.astype(np.float64)


# Strokes cut across -------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Cuts:
    """k strokes cut across at n places each along guessed lines; distances in pixels.

    Attributes
    ----------
    along : (k, n) distance from each guess's start
    left, right : (k, n) the two borders of the ink nearest to the guess, positive towards
        (-dy, dx) of its direction; nan where the guess crosses no ink
    dark : (k, n) contrast at the middle of the ink, 0 where there is none
    """

    along: FloatArray
    left: FloatArray
    right: FloatArray
    dark: FloatArray

    @property
    def offset(self) -> FloatArray:
        """(k, n) middle of the ink."""
        return (self.left + self.right) / 2.0

    @property
    def width(self) -> FloatArray:
        """(k, n) width of the ink."""
        return self.right - self.left


def cut_across(
    flat: Flat,
    ends: FloatArray,
    count: int,
    reach_px: float,
    capture_px: FloatArray,
    level: FloatArray | None = None,
) -> Cuts:
    """Borders of the ink across lines from `ends[:, 0]` to `ends[:, 1]`, (k, 2, 2), `count` cuts each.

    Each cut looks `reach_px` to either side; the run of ink taken is the one nearest to the guess,
    within `capture_px` (k,). A border is where the contrast passes `level` (k,), by default half of
    the stroke's own.
    """
    samples = count * (2 * _ACROSS_STEPS + 1)
    cuts = [
        _cut_part(
            flat, ends[part], count, reach_px, (capture_px[part], None if level is None else level[part])
        )
        for part in parts(len(ends), samples)
    ] or [Cuts(*np.zeros((4, 0, count)))]
    return (
        cuts[0]
        if len(cuts) == 1
        else Cuts(*(np.concatenate([getattr(part, name.name) for part in cuts]) for name in fields(Cuts)))
    )


def _cut_part(
    flat: Flat, ends: FloatArray, count: int, reach_px: float, near: tuple[FloatArray, FloatArray | None]
) -> Cuts:
    """Some of the strokes cut across; `near` holds `capture_px` and `level`."""
    capture_px, level = near
    length, u = lengths_and_directions(ends)
    share = (np.arange(count) + 0.5) / count
    normal = np.column_stack([-u[:, 1], u[:, 0]])
    step = float(np.clip(reach_px / _ACROSS_STEPS, *_ACROSS_STEP_PX))
    half = int(np.ceil(reach_px / step))
    across = np.asarray(np.arange(-half, half + 1) * step, dtype=np.float32)
    middle = ends[:, None, 0] + share[None, :, None] * (ends[:, 1] - ends[:, 0])[:, None, :]
    contrast = _contrast_across(flat, middle, normal, across)
    k, n, m = contrast.shape
    captured = np.abs(across)[None, :] <= capture_px[:, None]
    if level is None:
        peak = np.where(captured[:, None, :], contrast, np.float32(0.0)).max(axis=2)
        level = 0.5 * np.median(np.sort(peak, axis=1)[:, int(0.3 * n) :], axis=1)
    left, right, dark = _borders(
        contrast.reshape(k * n, m), across, np.repeat(captured.T, n, axis=1), np.repeat(level, n)
    )
    along = share[None, :] * length[:, None]
    return Cuts(along, left.reshape(k, n), right.reshape(k, n), dark.reshape(k, n))


def _contrast_across(
    flat: Flat, middle: FloatArray, normal: FloatArray, across: Float32Array
) -> Float32Array:
    """(k, n, m) contrast at `middle` (k, n, 2) moved along `normal` (k, 2) by `across` (m,)."""
    k, n, _ = middle.shape
    centre, aside = middle.astype(np.float32), normal.astype(np.float32)
    x = centre[:, :, 0, None] + (aside[:, 0, None] * across[None, :])[:, None, :]
    y = centre[:, :, 1, None] + (aside[:, 1, None] * across[None, :])[:, None, :]
    m = len(across)
    return flat.contrast(x.reshape(k * n, m), y.reshape(k * n, m)).reshape(k, n, m)


def sampled(
    image: GreyImage | Float32Array, x: FloatArray | Float32Array, y: FloatArray | Float32Array
) -> Float32Array:
    """Bilinear values of an image at (r, m) points, in blocks that a remap can take."""
    x, y = np.ascontiguousarray(x, dtype=np.float32), np.ascontiguousarray(y, dtype=np.float32)
    result = np.empty(x.shape, dtype=np.float32)
    for first in range(0, len(x), _REMAP_ROWS):
        part = slice(first, first + _REMAP_ROWS)
        result[part] = cv2.remap(image, x[part], y[part], cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE)
    return result


def _borders(
    contrast: Float32Array, across: Float32Array, near: BoolArray, level: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Per row: left border, right border, contrast in the middle of the ink run nearest to 0.

    Arguments: `near` (m, r) tells where the run may be begun from.
    """
    level32, count = level.astype(np.float32), len(across)
    # Largest numbers of columns, rows side by side: a row alone is too short for numpy.
    paper = np.ascontiguousarray((contrast <= level32[:, None]).T)
    outward = np.abs(across).argsort(kind="stable")
    nearness = np.empty((count, 1), dtype=np.int16)
    nearness[outward, 0] = np.arange(count, 0, -1)
    nearest = ((near & ~paper) * nearness).max(axis=0)
    middle = np.where(nearest > 0, outward[count - np.maximum(nearest, 1)], -1).astype(np.int16)
    # The run reaches from the last paper before its middle to the first paper after it.
    column = np.arange(count, dtype=np.int16)[:, None]
    before = ((paper & (column < middle)) * (column + 1)).max(axis=0) - 1
    behind = count - ((paper & (column > middle)) * (count - column)).max(axis=0)
    row = np.flatnonzero(middle >= 0)
    borders = np.full((3, len(contrast)), np.nan)
    borders[0, row] = _crossing(contrast, across, row, before[row], 1, level32)
    borders[1, row] = _crossing(contrast, across, row, behind[row], -1, level32)
    borders[2] = 0.0
    borders[2, row] = contrast[row, middle[row]]
    return borders[0], borders[1], borders[2]


def _crossing(
    contrast: Float32Array,
    across: Float32Array,
    row: NDArray[np.intp],
    outer: NDArray[np.int16],
    inward: int,
    level: Float32Array,
) -> FloatArray:
    """Return where rows' contrast passes `level` between `outer` (paper) and its neighbour inward (ink)."""
    last = len(across) - 1
    beyond = (outer < 0) | (outer > last)
    outside, inside = np.clip(outer, 0, last), np.clip(outer + inward, 0, last)
    low, high = contrast[row, outside], contrast[row, inside]
    share = np.clip((level[row] - low) / np.maximum(high - low, np.float32(1e-6)), 0.0, 1.0)
    crossed = across[outside] + share * (across[inside] - across[outside])
    return np.where(beyond, across[outside], crossed).astype(np.float64)


# Robust lines -------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class FittedLines:
    """Straight lines y = a + b t, robustly fitted, one per row.

    Attributes
    ----------
    a, b : (k,)
    scale : (k,) robust standard deviation of the residuals
    weight : (k, n) final weights, 0 for strays
    """

    a: FloatArray
    b: FloatArray
    scale: FloatArray
    weight: FloatArray

    def shifted(self, ends: FloatArray) -> FloatArray:
        """Segments (k, 2, 2) shifted across onto the lines, which were fitted in their own coordinates."""
        length, u = lengths_and_directions(ends)
        shift = np.stack([self.a, self.a + self.b * length], axis=1)
        return np.asarray(ends + shift[:, :, None] * np.column_stack([-u[:, 1], u[:, 0]])[:, None, :])


def robust_lines(t: FloatArray, y: FloatArray, weight: FloatArray, noise_floor: float) -> FittedLines:
    """Lines by Tukey's biweight through (k, n) points with prior weights (0 leaves a point out).

    Starts from the line through the medians of the outer thirds, so that strays at one side cannot
    capture it.
    """
    known = (weight > 0) & np.isfinite(y)
    base = np.where(known, weight, 0.0)
    y = np.where(known, y, 0.0)
    a, b = _through_medians(t, y, known)
    scale = np.full(len(t), noise_floor)
    weights = base
    for _ in range(_TUKEY_ROUNDS):
        residual = y - a[:, None] - b[:, None] * t
        scale = np.maximum(1.4826 * _row_median(np.abs(residual), known), noise_floor)
        weights = base * np.clip(1.0 - (residual / (_TUKEY * scale[:, None])) ** 2, 0.0, None) ** 2
        total = np.maximum(weights.sum(axis=1), 1e-12)
        tm, ym = (weights * t).sum(axis=1) / total, (weights * y).sum(axis=1) / total
        dt = t - tm[:, None]
        spread = np.maximum((weights * dt**2).sum(axis=1), 1e-12)
        b = (weights * dt * (y - ym[:, None])).sum(axis=1) / spread
        a = ym - b * tm
    return FittedLines(a, b, scale, weights)


def _through_medians(t: FloatArray, y: FloatArray, known: BoolArray) -> tuple[FloatArray, FloatArray]:
    order = np.cumsum(known, axis=1)
    total = order[:, -1:]
    first, last = known & (order <= (total + 2) // 3), known & (order > total - (total + 2) // 3)
    t0, t1 = _row_median(t, first), _row_median(t, last)
    y0, y1 = _row_median(y, first), _row_median(y, last)
    gap = t1 - t0
    b = np.where(gap > 0, (y1 - y0) / np.where(gap > 0, gap, 1.0), 0.0)
    a = _row_median(y - b[:, None] * t, known)
    return a, b


def _row_median(values: FloatArray, known: BoolArray) -> FloatArray:
    """Median of the known values of each row; 0 for a row of none."""
    ordered = np.sort(np.where(known, values, np.inf), axis=1)
    count = known.sum(axis=1)
    rows = np.arange(len(values))
    below = ordered[rows, np.maximum(count - 1, 0) // 2]
    above = ordered[rows, np.minimum(count // 2, values.shape[1] - 1)]
    return np.where(count > 0, np.where(count % 2 == 1, below, (below + above) / 2.0), 0.0)
