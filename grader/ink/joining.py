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
    middle = ends.mean(axis=1)
    joined: list[FloatArray] = []
    widths: list[float] = []
    groups: list[NDArray[np.intp]] = []
    for first in np.argsort(-length):
        if not free[first]:
            continue
        line, members = _grown(Loose(ends, middle, length, free), int(first), (off_px, gap_px))
        free[members] = False
        joined.append(line)
        groups.append(members)
        widths.append(float(width[members] @ length[members] / length[members].sum()))
    if not joined:
        return Pieces(np.zeros((0, 2, 2)), np.zeros(0), ())
    return Pieces(np.stack(joined), np.array(widths), tuple(groups))


@dataclass(frozen=True, slots=True)
class Loose:
    """Pieces while they are being joined: ends, middles, lengths, and which are still free."""

    ends: FloatArray
    middle: FloatArray
    length: FloatArray
    free: BoolArray


def _grown(loose: Loose, first: int, near: tuple[float, float]) -> tuple[FloatArray, NDArray[np.intp]]:
    members = np.array([first])
    line = loose.ends[first]
    for _ in range(_ROUNDS):
        grown = _on_line(loose, line, near)
        if first not in grown:
            grown = np.sort(np.append(grown, first))
        if np.array_equal(grown, members):
            break
        members = grown
        line = _fitted(loose.ends[members], loose.length[members])
    return line, members


def _on_line(loose: Loose, line: FloatArray, nearness: tuple[float, float]) -> NDArray[np.intp]:
    """Free pieces near the line and reached from it without too large a gap."""
    off_px, gap_px = nearness
    u = line[1] - line[0]
    size = float(np.sqrt(u @ u))
    u = u / size
    v = np.array([-u[1], u[0]])
    # A short line does not know its direction: allow for half a pixel at its ends, growing outward.
    most = 1.7 * off_px
    some = np.flatnonzero((np.abs(loose.middle @ v - float(line[0] @ v)) <= most) & loose.free)
    relative = loose.ends[some] - line[0]
    t, d = relative @ u, relative @ v
    turn = np.abs(d[:, 1] - d[:, 0]) <= _TURN * np.abs(t[:, 1] - t[:, 0])
    beyond = np.maximum(np.maximum(-t, t - size), 0.0)
    allowed = off_px + np.minimum(0.5 * beyond / size, 0.7 * off_px)
    kept = turn & (np.abs(d) <= allowed).all(axis=1)
    near, low, high = some[kept], t[kept].min(axis=1), t[kept].max(axis=1)
    reach_low, reach_high = 0.0, size
    taken = np.zeros(len(near), dtype=bool)
    while True:
        more = ~taken & (low <= reach_high + gap_px) & (high >= reach_low - gap_px)
        if not more.any():
            return np.asarray(near[taken])
        taken |= more
        reach_low = min(reach_low, float(low[more].min()))
        reach_high = max(reach_high, float(high[more].max()))


def _fitted(ends: FloatArray, length: FloatArray) -> FloatArray:
    """Line by weighted total least squares through the pieces, ending where they end."""
    points = ends.reshape(-1, 2)
    weight = np.repeat(length, 2)
    centre = weight @ points / weight.sum()
    off = points - centre
    spread = (off * weight[:, None]).T @ off
    angle = 0.5 * np.arctan2(2.0 * spread[0, 1], spread[0, 0] - spread[1, 1])
    u = np.array([np.cos(angle), np.sin(angle)])
    t = off @ u
    return np.stack([centre + t.min() * u, centre + t.max() * u])
