"""Pieces on one line joined into one stroke."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grader.pixels import BoolArray
from grader.records import FloatArray

_TURN = 0.16
"""Pieces that differ by more than 9 degrees are never joined."""
_ROUNDS = 6


@dataclass(frozen=True, slots=True)
class Pieces:
    """Strokes: (n, 2, 2) ends and (n,) widths, px, and the rows that each was joined from."""

    ends: FloatArray
    width: FloatArray
    members: tuple[NDArray[np.intp], ...]

    def take(self, which: BoolArray) -> "Pieces":
        """The chosen rows."""
        chosen = tuple(self.members[row] for row in np.flatnonzero(which))
        return Pieces(self.ends[which], self.width[which], chosen)


def join(ends: FloatArray, width: FloatArray, off_px: float, gap_px: float) -> Pieces:
    """Join, longest first, all free pieces within `off_px` of its line and no gap over `gap_px`."""
    length = np.hypot(*(ends[:, 1] - ends[:, 0]).T)
    free = np.ones(len(ends), dtype=bool)
    joined: list[FloatArray] = []
    widths: list[float] = []
    groups: list[NDArray[np.intp]] = []
    for first in np.argsort(-length):
        if not free[first]:
            continue
        line, members = _grown(ends, length, free, int(first), (off_px, gap_px))
        free[members] = False
        joined.append(line)
        groups.append(members)
        widths.append(float(np.average(width[members], weights=length[members])))
    if not joined:
        return Pieces(np.zeros((0, 2, 2)), np.zeros(0), ())
    return Pieces(np.stack(joined), np.array(widths), tuple(groups))


def _grown(
    ends: FloatArray, length: FloatArray, free: BoolArray, first: int, near: tuple[float, float]
) -> tuple[FloatArray, NDArray[np.intp]]:
    members = np.array([first])
    line = ends[first]
    for _ in range(_ROUNDS):
        grown = _on_line(ends, free, line, near)
        grown = np.union1d(grown, [first])
        if np.array_equal(grown, members):
            break
        members = grown
        line = _fitted(ends[members], length[members])
    return line, members


def _on_line(
    ends: FloatArray, free: BoolArray, line: FloatArray, nearness: tuple[float, float]
) -> NDArray[np.intp]:
    """Free pieces near the line and reached from it without too large a gap."""
    off_px, gap_px = nearness
    span = line[1] - line[0]
    size = float(np.hypot(*span))
    u = span / size
    v = np.array([-u[1], u[0]])
    relative = ends - line[0]
    t, d = relative @ u, relative @ v
    turn = np.abs(d[:, 1] - d[:, 0]) <= _TURN * np.abs(t[:, 1] - t[:, 0])
    # A short line does not know its direction: allow for half a pixel at its ends, growing outward.
    beyond = np.maximum(np.maximum(-t, t - size), 0.0)
    allowed = off_px + np.minimum(0.5 * beyond / size, 0.7 * off_px)
    near = np.flatnonzero(free & turn & (np.abs(d) <= allowed).all(axis=1))
    low, high = t[near].min(axis=1), t[near].max(axis=1)
    reach_low, reach_high = 0.0, size
    taken = np.zeros(len(near), dtype=bool)
    while True:
        more = ~taken & (low <= reach_high + gap_px) & (high >= reach_low - gap_px)
        if not more.any():
            return near[taken]
        taken |= more
        reach_low = min(reach_low, float(low[more].min()))
        reach_high = max(reach_high, float(high[more].max()))


def _fitted(ends: FloatArray, length: FloatArray) -> FloatArray:
    """Line by weighted total least squares through the pieces, ending where they end."""
    points = ends.reshape(-1, 2)
    weight = np.repeat(length, 2)
    centre = np.average(points, axis=0, weights=weight)
    off = points - centre
    _, vectors = np.linalg.eigh((off * weight[:, None]).T @ off)
    u = vectors[:, 1]
    t = off @ u
    return np.stack([centre + t.min() * u, centre + t.max() * u])
