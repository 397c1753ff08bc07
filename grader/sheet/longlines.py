"""Long straight lines that run nearly along the image's axes: frame, paper edges, title block."""

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from grader.pixels import Flat, cut_across, robust_lines, shrink
from grader.records import FloatArray
from grader.sheet.borders import borders
from grader.sheet.edges import bright_towards, edge_offsets

_LONG_SIDE_PX = 1400
"""About 3.3 px/mm on A3: a frame's stroke is still two pixels wide."""
_STEEPEST = float(np.tan(np.radians(16.0)))
"""Skew, roll and the convergence of a photo together stay under this."""
_COLLINEAR_PX, _BENT_SHARE, _MOST_BENT_PX = 1.8, 0.003, 4.0
"""Distance of pieces of one line from it, and how much of its length a lens adds to that, at most."""
_GAP_PX = 80.0
_SEED_PX = 40.0
"""Of a chain's longest piece: dashes and letters in a row are no side of a sheet."""
_LEAST_SHARE = 0.12
"""Of the image's width or height; the title block's lines are kept too."""
_STROKE_PX = (0.3, 6.5)
"""Distance of the two borders of a drawn line at the reduced resolution."""

_CUTS = 400
_STEP_REACH = 3.0
_LEAST_CUTS = 20

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
    inked : share of the length that was seen
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
    found: list[LongLine] = []
    for across in (True, False):
        edges = borders(small if across else np.ascontiguousarray(small.T), _STEEPEST)
        chains = {sign: _chains(edges[edges[:, 4] == sign], small.shape, across=across) for sign in (-1, 1)}
        found += _paired(chains, across=across)
    full = [_full_size(line, scale) for line in found]
    steps = [_settled_step(flat, line, 1.0 / scale) for line in full if line.kind == STEP]
    drawn = _refined(flat, [line for line in full if line.kind == RIDGE], 1.0 / scale)
    return sorted(steps + drawn, key=lambda line: -line.length * line.inked)


def _chains(edges: FloatArray, shape: tuple[int, ...], *, across: bool) -> list[tuple[FloatArray, float]]:
    """Collinear edges joined: ((2, 2) ends as position, value; seen length share)."""
    least = _LEAST_SHARE * (shape[1] if across else shape[0])
    length = edges[:, 2] - edges[:, 0]
    order = np.argsort(-length)
    free = np.ones(len(edges), dtype=bool)
    chains: list[tuple[FloatArray, float]] = []
    for first in map(int, order):
        if length[first] < _SEED_PX:
            break
        if not free[first]:
            continue
        members = np.array([first])
        for _ in range(4):
            line = _weighted_line(edges[members], length[members])
            near = np.maximum(
                np.abs(edges[:, 1] - line[0] * edges[:, 0] - line[1]),
                np.abs(edges[:, 3] - line[0] * edges[:, 2] - line[1]),
            )
            span = edges[members, 2].max() - edges[members, 0].min()
            within = min(_COLLINEAR_PX + _BENT_SHARE * span, _MOST_BENT_PX)
            grown = _reached(edges, np.flatnonzero(free & (near <= within)), first)
            if len(grown) == 0 or np.array_equal(grown, members):
                break
            members = grown
        free[members] = False
        free[first] = False
        low, high = edges[members, 0].min(), edges[members, 2].max()
        if high - low >= least:
            ends = np.array([[low, np.polyval(line, low)], [high, np.polyval(line, high)]])
            chains.append((ends, min(1.0, float(length[members].sum() / (high - low)))))
    return chains


def _reached(edges: FloatArray, near: NDArray[np.intp], first: int) -> NDArray[np.intp]:
    """Those of the collinear edges that are reached from the first one without a large gap."""
    low, high = float(edges[first, 0]), float(edges[first, 2])
    taken = np.zeros(len(near), dtype=bool)
    while True:
        more = ~taken & (edges[near, 0] <= high + _GAP_PX) & (edges[near, 2] >= low - _GAP_PX)
        if not more.any():
            return near[taken]
        taken |= more
        low, high = min(low, float(edges[near[more], 0].min())), max(high, float(edges[near[more], 2].max()))


def _weighted_line(edges: FloatArray, length: FloatArray) -> FloatArray:
    """Slope and value at 0 of the line through both ends of all edges, weighed by their lengths."""
    x, y = edges[:, [0, 2]], edges[:, [1, 3]]
    weight = np.maximum(length, 1e-9)[:, None] / (2.0 * max(float(length.sum()), 1e-9))
    x_mean, y_mean = float((weight * x).sum()), float((weight * y).sum())
    slope = float(
        (weight * (x - x_mean) * (y - y_mean)).sum() / max((weight * (x - x_mean) ** 2).sum(), 1e-9)
    )
    return np.array([slope, y_mean - slope * x_mean])


def _paired(chains: dict[int, list[tuple[FloatArray, float]]], *, across: bool) -> list[LongLine]:
    """Two borders, bright outside both, are one drawn line; a border alone is a step."""
    lines: list[LongLine] = []
    used: set[int] = set()
    for ends, seen in chains[-1]:
        partner = None
        for index, (other, other_seen) in enumerate(chains[1]):
            low, high = max(ends[0, 0], other[0, 0]), min(ends[1, 0], other[1, 0])
            shorter = min(ends[1, 0] - ends[0, 0], other[1, 0] - other[0, 0])
            gap = _value(other, (low + high) / 2) - _value(ends, (low + high) / 2)
            if high - low > 0.6 * shorter and _STROKE_PX[0] < gap < _STROKE_PX[1]:
                partner = index
                both = np.array([min(ends[0, 0], other[0, 0]), max(ends[1, 0], other[1, 0])])
                middle = [(_value(ends, p) + _value(other, p)) / 2 for p in both]
                lines.append(_line(np.column_stack([both, middle]), max(seen, other_seen), across, RIDGE, 0))
                used.add(index)
                break
        if partner is None:
            lines.append(_line(ends, seen, across, STEP, -1))
    lines += [
        _line(ends, seen, across, STEP, 1)
        for index, (ends, seen) in enumerate(chains[1])
        if index not in used
    ]
    return lines


def _line(ends: FloatArray, seen: float, across: bool, kind: str, bright: int) -> LongLine:
    return LongLine(across, kind, bright, ends if across else ends[:, ::-1].copy(), seen)


def _value(ends: FloatArray, position: float) -> float:
    (p0, q0), (p1, q1) = ends
    return float(q0 + (position - p0) * (q1 - q0) / (p1 - p0))


def _full_size(line: LongLine, scale: float) -> LongLine:
    ends = (line.ends + 0.5) / scale - 0.5
    return LongLine(line.across, line.kind, line.bright, ends, line.inked)


def _settled_step(flat: Flat, line: LongLine, full_per_small: float) -> LongLine:
    """A border between bright and dark, through its steepest places at full resolution."""
    bright = bright_towards(line.ends, line.bright, across=line.across)
    offset = edge_offsets(flat, line.ends, bright, _CUTS, _STEP_REACH * full_per_small)
    along = np.asarray((np.arange(_CUTS) + 0.5) * (line.length / _CUTS), dtype=np.float64)
    known = np.isfinite(offset)
    if known.sum() < _LEAST_CUTS:
        return line
    fit = robust_lines(along[None], offset[None], known[None].astype(np.float64), 0.1)
    return _shifted(line, float(fit.a[0]), float(fit.b[0]))


def _shifted(line: LongLine, a: float, b: float) -> LongLine:
    """The line moved across by a at its start, and b px more for each px along."""
    u = (line.ends[1] - line.ends[0]) / line.length
    shift = a + b * np.array([0.0, line.length])
    return replace(line, ends=line.ends + shift[:, None] * np.array([-u[1], u[0]]))


def _refined(flat: Flat, lines: list[LongLine], full_per_small: float) -> list[LongLine]:
    """Drawn lines through the middle of their ink, at full resolution."""
    if not lines:
        return []
    ends = np.stack([line.ends for line in lines])
    reach = 4.0 * full_per_small
    cuts = cut_across(flat, ends, _CUTS, reach, np.full(len(lines), 0.6 * reach))
    usual = np.nanmedian(np.where(np.isfinite(cuts.width), cuts.width, 2.0 * reach), axis=1)
    good = np.isfinite(cuts.width) & (cuts.width < 1.8 * usual[:, None])
    fit = robust_lines(cuts.along, cuts.offset, good.astype(np.float64), 0.05)
    refined = []
    for index, line in enumerate(lines):
        if good[index].sum() < _LEAST_CUTS:
            refined.append(line)
            continue
        moved = _shifted(line, float(fit.a[index]), float(fit.b[index]))
        dark = float(np.median(cuts.dark[index][good[index]]))
        refined.append(replace(moved, inked=float(good[index].mean()), width=float(usual[index]), dark=dark))
    return refined
