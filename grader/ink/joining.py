"""Segments near each other, and pieces on one line joined into one stroke."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from grader.pixels import BoolArray, Float32Array, lengths_and_directions, parts, reached
from grader.records import FloatArray

_TURN = 0.16
"""Pieces that differ by more than 9 degrees are never joined."""
_ROUNDS = 6
"""A line grows as it becomes better known; more rounds change nothing."""
_MOST_OFF = 1.7
"""Of the distance allowed beside a line: so far off are pieces that lie far beyond its ends."""
PROBES = 13
"""Places along a segment at which its distance from another is taken."""
_SLACK_PX = 1.0
"""Callers compare in single precision: pairs at the limit are in."""
_NEIGHBOURHOOD = 256
"""Pairs of samples around one segment, at most as a rule."""

Rows = NDArray[np.intp]


# Near each other ----------------------------------------------------------------------------------


def near_pairs(ends: FloatArray, others: FloatArray, reach_px: float) -> tuple[Rows, Rows]:
    """Rows of all pairs of a segment (k, 2, 2) and another (t, 2, 2) within `reach_px` of each other.

    Returns (n,) rows of `ends`, in order, and (n,) rows of `others`, in order for each segment. Pairs up
    to two and a half times as far apart may be among them: the caller's own formula decides.
    """
    step = reach_px + _SLACK_PX
    count = len(others)
    at, row = _samples(others, step)
    tree = KDTree(at)
    pairs = [np.zeros(0, dtype=np.intp)]
    for part in parts(len(ends), _NEIGHBOURHOOD):
        own_at, own = _samples(ends[part], step)
        # No point of a segment is further than half a step from a sample.
        close = KDTree(own_at).sparse_distance_matrix(tree, reach_px + step, output_type="ndarray")
        pairs.append(np.unique((part.start + own[close["i"]]) * count + row[close["j"]]))
    first, second = np.divmod(np.concatenate(pairs), max(count, 1))
    return first, second


def _samples(ends: FloatArray, step: float) -> tuple[FloatArray, Rows]:
    """((n, 2) places along segments, at most `step` apart, both ends among them; (n,) their segments)."""
    span = ends[:, 1] - ends[:, 0]
    count = np.ceil(np.hypot(span[:, 0], span[:, 1]) / step).astype(np.intp) + 1
    row = np.repeat(np.arange(len(ends)), count)
    number = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return ends[row, 0] + (number / np.maximum(count[row] - 1, 1))[:, None] * span[row], row


def distances(ends: FloatArray, first: Rows, second: Rows) -> Float32Array:
    """(n, p) distances of places along the `first` (n,) of segments (k, 2, 2) from the `second`."""
    ends = ends.astype(np.float32)
    share = np.linspace(0.04, 0.96, PROBES, dtype=np.float32)
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), np.float32(1e-6))
    u = span / length[:, None]
    points = ends[:, None, 0] + share[:, None] * span[:, None, :]
    x = points[first, :, 0] - ends[second, 0, 0, None]
    y = points[first, :, 1] - ends[second, 0, 1, None]
    u = u[second, :, None]
    along = x * u[:, 0] + y * u[:, 1]
    along -= np.clip(along, np.float32(0.0), length[second, None])
    across = x * u[:, 1] - y * u[:, 0]
    return np.asarray(np.hypot(along, across))


# On one line --------------------------------------------------------------------------------------


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
    length = lengths_and_directions(ends)[0]
    free = np.ones(len(ends), dtype=bool)
    middle = ends.mean(axis=1)
    joined = np.zeros((len(ends), 2, 2))
    widths = np.zeros(len(ends))
    groups: list[NDArray[np.intp]] = []
    for first in map(int, np.argsort(-length)):
        if not free[first]:
            continue
        line, members = ends[first], np.array([first])
        for _ in range(_ROUNDS):
            candidates = np.flatnonzero(free & _may_lie_on(middle, line, off_px))
            grown = candidates[_on_line(ends[candidates], line, off_px, gap_px)]
            grown = grown if first in grown else np.sort(np.append(grown, first))
            if np.array_equal(grown, members):
                break
            members, line = grown, _fitted(ends[grown], length[grown])
        free[members] = False
        joined[len(groups)] = line
        widths[len(groups)] = width[members] @ length[members] / length[members].sum()
        groups.append(members)
    return Pieces(joined[: len(groups)], widths[: len(groups)], tuple(groups))


def _may_lie_on(middle: FloatArray, line: FloatArray, off_px: float) -> BoolArray:
    """Which pieces, by their middles, are near enough to a line (2, 2) to be looked at."""
    u = line[1] - line[0]
    v = np.array([-u[1], u[0]]) / float(np.sqrt(u @ u))
    return np.asarray(np.abs(middle @ v - float(line[0] @ v)) <= _MOST_OFF * off_px)


def _on_line(ends: FloatArray, line: FloatArray, off_px: float, gap_px: float) -> NDArray[np.intp]:
    """Rows of the pieces near a line and reached from it without too large a gap."""
    u = line[1] - line[0]
    size = float(np.sqrt(u @ u))
    u = u / size
    relative = ends - line[0]
    t, d = relative @ u, relative @ np.array([-u[1], u[0]])
    turn = np.abs(d[:, 1] - d[:, 0]) <= _TURN * np.abs(t[:, 1] - t[:, 0])
    # A short line does not know its direction: allow for half a pixel at its ends, growing outward.
    beyond = np.maximum(np.maximum(-t, t - size), 0.0)
    allowed = off_px + np.minimum(0.5 * beyond / size, (_MOST_OFF - 1.0) * off_px)
    near = np.flatnonzero(turn & (np.abs(d) <= allowed).all(axis=1))
    return near[reached(np.sort(t[near], axis=1), np.array([0.0, size]), gap_px)]


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
