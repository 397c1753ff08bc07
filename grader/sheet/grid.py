"""The printed grid of graph paper, found among long lines: evidence of scale, and ink to be passed over.

Squares are printed to about 0.3 % (pads measured: 4.98 to 5.01 mm for 5), as well as most scanners
state their resolution. Where the lines of a grid are told from drawn ones, a frame ruled upon a grid
line is known by its darkness.
"""

from collections import Counter
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray
from grader.sheet.longlines import LongLine

_LEAST_LINES = 8
_ON_LATTICE = 0.12
"""Of the pitch: a line farther off is no line of the grid."""
_MOSTLY = 0.6
_DARKER = 1.35
"""A drawn line on a grid line is so much darker than the grid is."""
_FOLLOWS = 0.3
_STRAYS, _FINE_PX = 4.0, 0.3
"""A line beside the lattice by more than four times the usual is a drawn one near it."""


@dataclass(frozen=True, slots=True)
class Family:
    """Parallel lines at equal distances.

    Attributes
    ----------
    pitch_px : distance of neighbours across, at the image's middle
    pitch_se : relative standard error of it, from the lines' misfit
    angle : radians from the image's axis that the lines run along, clockwise as seen
    rms_px : misfit of the lines to equal distances
    member : (n,) which of the lines given belong to it
    """

    pitch_px: float
    pitch_se: float
    angle: float
    rms_px: float
    member: NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Grid:
    """Squares, by their level and upright lines.

    Attributes
    ----------
    pitch_px : along the image's x and y
    pitch_se : relative, of each
    skew_rad : how far upright lines are from square to level ones
    rms_px : misfit of lines to equal distances, larger of the two
    lines : how many lines it rests on
    """

    pitch_px: tuple[float, float]
    pitch_se: tuple[float, float]
    skew_rad: float
    rms_px: float
    lines: int

    @property
    def unequal(self) -> float:
        """Relative difference of the scales along x and y, where the squares are square."""
        return self.pitch_px[0] / self.pitch_px[1] - 1.0


def find_grid(lines: list[LongLine], shape: tuple[int, int]) -> tuple[Grid | None, list[LongLine]]:
    """The grid that drawn lines make, None where there is none, and the lines that are not its own."""
    level, upright = (_family(lines, shape, across=across) for across in (True, False))
    if level is None or upright is None:
        return None, lines
    grid = Grid(
        pitch_px=(upright.pitch_px, level.pitch_px),
        pitch_se=(upright.pitch_se, level.pitch_se),
        skew_rad=level.angle + upright.angle,
        rms_px=max(level.rms_px, upright.rms_px),
        lines=int(np.count_nonzero(level.member) + np.count_nonzero(upright.member)),
    )
    own = level.member | upright.member
    usual = float(np.median([line.dark for line, mine in zip(lines, own, strict=True) if mine]))
    drawn = [line for line, mine in zip(lines, own, strict=True) if not mine or line.dark > _DARKER * usual]
    return grid, drawn


def _family(lines: list[LongLine], shape: tuple[int, int], *, across: bool) -> Family | None:
    middle = (shape[1] if across else shape[0]) / 2.0
    # Of a faint line often one border alone is seen; borders of one kind are at equal distances too.
    looks = Counter((line.kind, line.bright) for line in lines if line.across == across)
    if not looks:
        return None
    usual, _ = looks.most_common(1)[0]
    which = np.flatnonzero([line.across == across and (line.kind, line.bright) == usual for line in lines])
    if len(which) < _LEAST_LINES:
        return None
    at = np.array([lines[k].at(middle) for k in which])
    order = np.argsort(at)
    which, at = which[order], at[order]
    index = _indices(at)
    if index is None:
        return None
    on = index >= 0
    if np.count_nonzero(on) < max(_LEAST_LINES, _MOSTLY * len(at)):
        return None
    off = np.abs(at - np.polyval(np.polyfit(index[on], at[on], 1), index))
    on &= off <= _STRAYS * np.median(off[on]) + _FINE_PX
    line, spread = np.polyfit(index[on], at[on], 1, cov=True)
    slope = float(np.median([_slope(lines[k]) for k in which[on]]))
    rms = float(np.sqrt(np.mean((at[on] - np.polyval(line, index[on])) ** 2)))
    member = np.zeros(len(lines), dtype=bool)
    member[which[on]] = True
    # Lines are counted where they cross the middle; their distance across them is less.
    across_px = float(line[0]) * float(np.cos(np.arctan(slope)))
    return Family(across_px, float(np.sqrt(spread[0, 0]) / line[0]), float(np.arctan(slope)), rms, member)


def _indices(at: FloatArray) -> FloatArray | None:
    """(n,) number of each place on the lattice that most of them make, -1 for those beside it."""
    gaps = np.diff(at)
    gaps = gaps[gaps > 2.0]
    if len(gaps) < _LEAST_LINES - 1:
        return None
    pitch = _commonest(gaps)
    start = len(at) // 2
    best: FloatArray | None = None
    for first in range(max(0, start - 3), min(len(at), start + 4)):
        index = np.full(len(at), np.nan)
        index[first] = 0.0
        for step in (1, -1):
            last, here = first, pitch
            for k in range(first + step, len(at) if step > 0 else -1, step):
                ratio = abs(at[k] - at[last]) / here
                whole = round(ratio)
                if whole >= 1 and abs(ratio - whole) < _ON_LATTICE:
                    index[k] = index[last] + step * whole
                    here += _FOLLOWS * (abs(at[k] - at[last]) / whole - here)
                    last = k
        if best is None or np.count_nonzero(np.isfinite(index)) > np.count_nonzero(np.isfinite(best)):
            best = index
    if best is None:
        return None
    return np.where(np.isfinite(best), best - np.nanmin(best), -1.0)


def _commonest(gaps: FloatArray) -> float:
    """The gap that most gaps are near to."""
    near = np.abs(gaps[:, None] / gaps[None, :] - 1.0) < _ON_LATTICE
    chosen = near.sum(axis=0).argmax()
    return float(np.median(gaps[near[:, chosen]]))


def _slope(line: LongLine) -> float:
    """Of a line from the axis along which it runs."""
    d = line.ends[1] - line.ends[0]
    return float(d[1] / d[0] if line.across else d[0] / d[1])
