"""Long straight lines of a page to sub-pixel: frame, borders, grid."""

from dataclasses import dataclass, replace

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage, IntArray
from grader.scan.pixels import (
    Flat,
    at_full_size,
    cut_across,
    lengths_and_directions,
    reached,
    robust_lines,
    sampled,
    shrink,
)

_LONG_SIDE_PX = 1400
"""About 3.3 px/mm on A3: a frame's stroke is still two pixels wide."""
_STEEPEST = float(np.tan(np.radians(16.0)))
"""Skew, roll and the convergence of a photo together stay under this."""

_ALONG_PX = 5
"""Averaged along the border: grain of paper fades, a border 16 degrees askew does not."""
_LEAST_CHANGE = 6
"""Grey levels over two pixels; a hard pencil's line at 3 px/mm changes by 20."""
_NOISES = 4.0
"""A border changes by so many standard deviations of the paper's noise."""
_NOISE_SHARE = 0.84
"""Share of normal noise below one standard deviation."""
_LEAST_PX = 12
"""Shorter borders are grain, letters and arrowheads."""
_CROOKED_PX, _CROOKED_SHARE = 0.7, 0.002
"""Root mean square distance from its line, or share of its length, by which a chain is not straight; a
wide lens bends the side of a sheet by 0.6 % of its length from end to end, half as much on the whole."""
_STRETCHES_PX = (240, 80, 30)
"""Lengths of the pieces into which a chain that is not straight is cut, the longest first."""

_COLLINEAR_PX, _BENT_LINE_SHARE, _MOST_BENT_PX = 1.8, 0.003, 4.0
"""Distance of pieces of one line from it, and how much of its length a lens adds to that, at most."""
_GAP_PX = 80.0
"""Letters that touch a frame, and clips on the paper's edge, leave a line out over less than this."""
_SEED_PX = 40.0
"""Least length of a chain's longest piece: dashes and letters in a row are no side of a sheet."""
_ROUNDS = 4
"""A chain grows as its line becomes better known."""
_LEAST_SHARE = 0.12
"""Least length as a share of the image's width or height; the title block's lines are kept too."""
_STROKE_PX = (0.3, 6.5)
"""Distance of the two borders of a drawn line at the reduced resolution."""
_SHARED = 0.6
"""Share of the shorter border along which both borders of a drawn line run side by side."""

_CUTS = 400
"""Places along a line at which it is followed at full resolution."""
_LEAST_CUTS = 20
"""Fewer places tell no better where a line runs than the reduced picture does."""
_STEP_REACH = 3.0
"""Reduced pixels to either side in which the steepest change of a step is looked for."""
_STROKE_REACH = 4.0
"""Reduced pixels to either side in which a drawn line's ink is looked for."""
_STEP_PX = 0.5
"""Distance of samples across an edge."""
_OVER = 4
"""Samples between which the change of brightness is taken: two pixels."""
_STRONG = 0.4
"""Share of a line's usual change below which a place shows no edge."""

RIDGE = "ridge"
STEP = "step"


@dataclass(frozen=True, slots=True)
class LongLine:
    """A long line, in full pixels.

    Attributes
    ----------
    across : True for a horizontal one (runs along x)
    kind : `ridge`, a drawn stroke; `step`, a border between bright and dark
    bright : for a step the side that is bright: +1 below or right of it, -1 above or left
    ends : (2, 2) left and right, or upper and lower, end
    inked : share of the length that is inked
    width : of a drawn line's ink, px; 0 for a step
    dark : contrast of a drawn line's ink, 0..1
    """

    across: bool
    kind: str
    bright: int
    ends: FloatArray
    inked: float
    width: float = 0.0
    dark: float = 0.0

    @property
    def length(self) -> float:
        """Distance of the ends, px."""
        return float(np.hypot(*(self.ends[1] - self.ends[0])))

    def at(self, position: float) -> float:
        """The y at x = position of a horizontal line, the x at y = position of a vertical one."""
        i = 0 if self.across else 1
        (p0, q0), (p1, q1) = self.ends[:, [i, 1 - i]]
        return float(q0 + (position - p0) * (q1 - q0) / (p1 - p0))


def long_lines(flat: Flat) -> list[LongLine]:
    """All long lines, longest first, with drawn strokes fitted to their middle at full resolution."""
    scale = min(1.0, _LONG_SIDE_PX / max(flat.grey.shape))
    small = shrink(flat.grey, scale)
    lines: list[LongLine] = []
    for across in (True, False):
        edges = _borders(small if across else np.ascontiguousarray(small.T))
        least = _LEAST_SHARE * small.shape[1 if across else 0]
        chains = {sign: _chains(edges[edges[:, 4] == sign], least) for sign in (-1, 1)}
        lines += _paired(chains, across=across)
    full = [replace(line, ends=at_full_size(line.ends, scale)) for line in lines]
    steps = [_settled_step(flat, line, 1.0 / scale) for line in full if line.kind == STEP]
    drawn = _settled_strokes(flat, [line for line in full if line.kind == RIDGE], 1.0 / scale)
    return sorted(steps + drawn, key=lambda line: -line.length * line.inked)


# Borders at the reduced resolution ----------------------------------------------------------------


def _borders(small: GreyImage) -> FloatArray:
    """(n, 5) of x, y of the left end, x, y of the right end, and the side that is bright.

    Level borders only: for upright ones give the transposed image. The bright side is +1 where it is
    below, -1 where it is above.
    """
    soft = np.asarray(cv2.blur(small, (_ALONG_PX, 1)), dtype=np.uint8)
    return np.concatenate([_one_sided(soft, sign) for sign in (1, -1)])


def _one_sided(soft: GreyImage, sign: int) -> FloatArray:
    """Borders that are brighter below (+1) or above (-1)."""
    above, below = (soft[:-2], soft[2:]) if sign > 0 else (soft[2:], soft[:-2])
    change = np.asarray(cv2.subtract(below, above), dtype=np.uint8)
    least = max(_LEAST_CHANGE, _NOISES * _noise(change))
    crest = np.zeros_like(change)
    middle = change[1:-1]
    crest[1:-1] = (middle > change[:-2]) & (middle >= change[2:]) & (middle >= least)
    crest[:, [0, -1]] = 0
    points = cv2.findNonZero(crest)
    if points is None:
        return np.zeros((0, 5))
    column, row = points.reshape(-1, 2).astype(np.int64).T
    label = cv2.connectedComponents(crest, connectivity=8)[1][row, column]
    long_enough = np.bincount(label)[label] >= _LEAST_PX
    row, column, label = row[long_enough], column[long_enough], label[long_enough]
    # The image of changes starts one row below the picture's first.
    ends = _straight(column, row + 1.0 + _within_row(change, row, column), label.astype(np.int64))
    span = ends[:, 2:] - ends[:, :2]
    good = (span[:, 0] >= _LEAST_PX) & (np.abs(span[:, 1]) <= _STEEPEST * span[:, 0])
    return np.column_stack([ends[good], np.full(np.count_nonzero(good), float(sign))])


def _noise(change: GreyImage) -> float:
    """Standard deviation of the change where there is only paper, a level too high rather than too low."""
    counts = np.cumsum(np.bincount(change[::7, ::3].ravel(), minlength=256))
    return float(np.searchsorted(counts, _NOISE_SHARE * counts[-1])) + 0.5


def _within_row(change: GreyImage, row: IntArray, column: IntArray) -> FloatArray:
    """Return the distance from its row's middle to where the change is greatest, by a parabola."""
    above, middle, below = (change[row + k, column].astype(np.float64) for k in (-1, 0, 1))
    return np.asarray(0.5 * (above - below) / np.minimum(above - 2.0 * middle + below, -1.0))


def _straight(x: IntArray, y: FloatArray, chain: IntArray) -> FloatArray:
    """(n, 4) ends of the lines through chains of points; a bent chain is cut until it is straight."""
    parts: list[FloatArray] = []
    for stretch in (*_STRETCHES_PX, 0):
        chain = np.cumsum(np.bincount(chain) > 0)[chain] - 1
        ends, rms = _lines_through(x, y, chain)
        straight = rms <= np.maximum(_CROOKED_PX, _CROOKED_SHARE * (ends[:, 2] - ends[:, 0]))
        parts.append(ends[straight])
        again = ~straight[chain]
        if not stretch or not again.any():
            break
        x, y, chain = x[again], y[again], chain[again]
        chain = chain * (int(x.max()) // stretch + 1) + x // stretch
    return np.concatenate(parts)


def _lines_through(x: IntArray, y: FloatArray, chain: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least squares lines y = a + b x of the points of each chain 0..n-1: (n, 4) ends, (n,) rms distance."""
    count = np.maximum(np.bincount(chain), 1).astype(np.float64)
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, chain, x)
    np.maximum.at(high, chain, x)
    x_mean, y_mean = np.bincount(chain, x) / count, np.bincount(chain, y) / count
    dx, dy = x - x_mean[chain], y - y_mean[chain]
    slope = np.bincount(chain, dx * dy) / np.maximum(np.bincount(chain, dx * dx), 1e-9)
    rms = np.sqrt(np.bincount(chain, (dy - slope[chain] * dx) ** 2) / count)
    ends = np.column_stack([low, y_mean + slope * (low - x_mean), high, y_mean + slope * (high - x_mean)])
    return ends, rms


# Borders to lines ---------------------------------------------------------------------------------

_Chain = tuple[FloatArray, float]
"""(2, 2) ends as position along the axis and value across it, and the share of the length seen."""


def _chains(edges: FloatArray, least: float) -> list[_Chain]:
    """Collinear edges joined, the longest first; chains of at least `least` pixels."""
    length = edges[:, 2] - edges[:, 0]
    free = np.ones(len(edges), dtype=bool)
    chains: list[_Chain] = []
    for first in map(int, np.argsort(-length)):
        if length[first] < _SEED_PX:
            break
        if not free[first]:
            continue
        members, line = _grown(edges, length, first, free)
        free[members] = free[first] = False
        low, high = edges[members, 0].min(), edges[members, 2].max()
        if high - low >= least:
            ends = np.array([[low, np.polyval(line, low)], [high, np.polyval(line, high)]])
            chains.append((ends, min(1.0, float(length[members].sum() / (high - low)))))
    return chains


def _grown(
    edges: FloatArray, length: FloatArray, first: int, free: NDArray[np.bool_]
) -> tuple[NDArray[np.intp], FloatArray]:
    """The free edges on one line with the first, no large gap between, and the line (slope, value at 0)."""
    members = np.array([first])
    for _ in range(_ROUNDS):
        line = _weighted_line(edges[members], length[members])
        off = np.abs(edges[:, [1, 3]] - line[0] * edges[:, [0, 2]] - line[1]).max(axis=1)
        span = edges[members, 2].max() - edges[members, 0].min()
        within = min(_COLLINEAR_PX + _BENT_LINE_SHARE * span, _MOST_BENT_PX)
        near = np.flatnonzero(free & (off <= within))
        start = edges[first, 0], edges[first, 2]
        grown = near[reached(edges[near, 0], edges[near, 2], start, _GAP_PX)]
        if len(grown) == 0 or np.array_equal(grown, members):
            break
        members = grown
    return members, line


def _weighted_line(edges: FloatArray, length: FloatArray) -> FloatArray:
    """Slope and value at 0 of the line through both ends of all edges, weighed by their lengths."""
    x, y = edges[:, [0, 2]], edges[:, [1, 3]]
    weight = np.maximum(length, 1e-9)[:, None] / (2.0 * max(float(length.sum()), 1e-9))
    x_mean, y_mean = float((weight * x).sum()), float((weight * y).sum())
    spread = max(float((weight * (x - x_mean) ** 2).sum()), 1e-9)
    slope = float((weight * (x - x_mean) * (y - y_mean)).sum()) / spread
    return np.array([slope, y_mean - slope * x_mean])


def _paired(chains: dict[int, list[_Chain]], *, across: bool) -> list[LongLine]:
    """Two borders, bright outside both, are one drawn line; a border alone is a step."""

    def line(ends: FloatArray, inked: float, kind: str, bright: int) -> LongLine:
        return LongLine(across, kind, bright, ends if across else ends[:, ::-1].copy(), inked)

    lines: list[LongLine] = []
    used: set[int] = set()
    for ends, inked in chains[-1]:
        for index, (other, other_inked) in enumerate(chains[1]):
            low, high = max(ends[0, 0], other[0, 0]), min(ends[1, 0], other[1, 0])
            shorter = min(ends[1, 0] - ends[0, 0], other[1, 0] - other[0, 0])
            if high - low <= _SHARED * shorter:
                continue
            gap = _value(other, (low + high) / 2) - _value(ends, (low + high) / 2)
            if _STROKE_PX[0] < gap < _STROKE_PX[1]:
                both = np.array([min(ends[0, 0], other[0, 0]), max(ends[1, 0], other[1, 0])])
                middle = [(_value(ends, p) + _value(other, p)) / 2 for p in both]
                lines.append(line(np.column_stack([both, middle]), max(inked, other_inked), RIDGE, 0))
                used.add(index)
                break
        else:
            lines.append(line(ends, inked, STEP, -1))
    lines += [line(*chain, STEP, 1) for index, chain in enumerate(chains[1]) if index not in used]
    return lines


def _value(ends: FloatArray, position: float) -> float:
    (p0, q0), (p1, q1) = ends
    return float(q0 + (position - p0) * (q1 - q0) / (p1 - p0))


# At full resolution -------------------------------------------------------------------------------


def _settled_step(flat: Flat, line: LongLine, full_per_small: float) -> LongLine:
    """A border between bright and dark, through its steepest places at full resolution."""
    offset = edge_offsets(flat, line, _CUTS, _STEP_REACH * full_per_small)
    along = np.asarray((np.arange(_CUTS) + 0.5) * (line.length / _CUTS), dtype=np.float64)
    known = np.isfinite(offset)
    if known.sum() < _LEAST_CUTS:
        return line
    fit = robust_lines(along[None], offset[None], known[None].astype(np.float64), 0.1)
    return replace(line, ends=fit.shifted(line.ends[None])[0])


def _settled_strokes(flat: Flat, lines: list[LongLine], full_per_small: float) -> list[LongLine]:
    """Drawn lines through the middle of their ink, at full resolution."""
    if not lines:
        return []
    ends = np.stack([line.ends for line in lines])
    reach = _STROKE_REACH * full_per_small
    cuts = cut_across(flat, ends, _CUTS, reach, np.full(len(lines), 0.6 * reach))
    usual = np.nanmedian(np.where(np.isfinite(cuts.width), cuts.width, 2.0 * reach), axis=1)
    good = np.isfinite(cuts.width) & (cuts.width < 1.8 * usual[:, None])
    shifted = robust_lines(cuts.along, cuts.offset, good.astype(np.float64), 0.05).shifted(ends)
    return [
        replace(
            line, ends=shifted[k], inked=float(good[k].mean()), width=float(usual[k]),
            dark=float(np.median(cuts.dark[k][good[k]])),
        )
        if good[k].sum() >= _LEAST_CUTS
        else line
        for k, line in enumerate(lines)
    ]  # fmt: skip


def edge_offsets(flat: Flat, line: LongLine, cuts: int, reach_px: float) -> FloatArray:
    """(cuts,) how far across a step its edge lies, px along (-dy, dx) of its ends; nan where none is."""
    (length,), (u,) = lengths_and_directions(line.ends[None])
    bright = line.bright * np.sign(u[0] if line.across else -u[1])
    across = np.arange(-reach_px, reach_px + _STEP_PX, _STEP_PX)
    share = (np.arange(cuts) + 0.5) / cuts
    normal = np.array([-u[1], u[0]])
    at = line.ends[0] + share[:, None, None] * length * u + across[None, :, None] * normal
    level = sampled(flat.grey, at[..., 0], at[..., 1]).astype(np.float64)
    rise = (level[:, _OVER:] - level[:, :-_OVER]) * bright
    places = across[_OVER // 2 : -_OVER // 2]
    strong = rise.max(axis=1)
    near = np.abs(np.arange(rise.shape[1]) - rise.argmax(axis=1)[:, None]) <= _OVER
    weight = np.clip(rise - 0.5 * strong[:, None], 0.0, None) * near
    offset = (weight * places).sum(axis=1) / np.maximum(weight.sum(axis=1), 1e-9)
    return np.where(strong > _STRONG * np.median(strong), offset, np.nan)
