"""A Gaussian belief of where a figure's nodes are, and what a stroke says about it."""

from dataclasses import dataclass, replace

import numpy as np

from grader.reading.expected import Expected
from grader.reading.lines import BoolArray, Lines
from grader.records import FloatArray, IntArray

REDRAW_MM = 0.3
"""How far a stroke misses the nodes that it joins, one standard error."""
SHARED_MM = 0.4
"""And further where it serves two edges, that lie this near to each other."""
TIP_MM = 0.2
"""Standard error of an arrowhead's tip, or of what else marks a node, along its vector."""
END_MM, END_SHARE = 0.3, 0.4
RUN_ON_FAR = 4e-4
"""Density per mm of ends anywhere: the stroke goes on as another edge, or as a line drawn through."""


@dataclass(frozen=True, slots=True)
class Ends:
    """How strokes end at nodes: log densities (per mm) of an end at, beyond and short of its node."""

    at_mm: float = 0.3
    at_share: float = 0.57
    beyond_mm: float = 3.0
    beyond_share: float = 0.36
    short_mm: float = 1.5
    short_share: float = 0.07


def offsets(expected: Expected, tail: int, head: int, lines: Lines) -> tuple[FloatArray, FloatArray]:
    """(s, 2) distance of both nodes from each line, and their (s, 2, 2) covariance."""
    across = 1j * lines.along
    normal = np.column_stack([across.real, across.imag])
    off = np.column_stack(
        [((expected.at[node] - lines.start) * np.conj(lines.along)).imag for node in (tail, head)]
    )
    arm = np.column_stack(
        [((expected.at[node] - lines.middle) * np.conj(lines.along)).real for node in (tail, head)]
    )
    spread = np.empty((len(lines), 2, 2))
    for a in (0, 1):
        for b in (0, 1):
            first, second = 2 * (tail, head)[a], 2 * (tail, head)[b]
            block = expected.cov[first : first + 2, second : second + 2]
            nodes = np.einsum("si,ij,sj->s", normal, block, normal)
            line = lines.se_offset**2 + lines.se_angle**2 * arm[:, a] * arm[:, b]
            spread[:, a, b] = nodes + line + (REDRAW_MM**2 if a == b else 0.0)
    return off, spread


def mahalanobis(off: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances (n,) of pairs (n, 2) by their covariances (n, 2, 2), and log determinants."""
    a, b, c = spread[:, 0, 0], spread[:, 0, 1], spread[:, 1, 1]
    det = np.maximum(a * c - b * b, 1e-9)
    distance = (c * off[:, 0] ** 2 - 2 * b * off[:, 0] * off[:, 1] + a * off[:, 1] ** 2) / det
    return distance, np.log(det)


def ends_at(
    expected: Expected, tail: int, head: int, lines: Lines, ends: Ends
) -> tuple[FloatArray, BoolArray, IntArray]:
    """How the strokes that cover an edge end about its nodes.

    Returns log densities (n,), whether they end at the nodes (n, 2), and which strokes these are (n,).
    """
    span = expected.at[head] - expected.at[tail]
    along = np.where((lines.along * np.conj(span)).real > 0, lines.along, -lines.along)
    place = np.column_stack(
        [((end - expected.at[tail]) * np.conj(along)).real for end in (lines.start, lines.end)]
    )
    first, last = place.min(axis=1), place.max(axis=1)
    size = (span * np.conj(along)).real
    kept = np.flatnonzero((last > 0.35 * size) & (first < 0.65 * size) & (last - first > 0.3 * size))
    along, size, gaps = along[kept], size[kept], np.column_stack([-first, last])[kept]
    gaps[:, 1] -= size
    direction = np.column_stack([along.real, along.imag])
    total, ended = np.zeros(len(kept)), np.zeros((len(kept), 2), dtype=bool)
    forward = (lines.along[kept] * np.conj(along)).real > 0
    own = lines.se_end[kept]
    errors = np.where(forward[:, None], own, own[:, ::-1])
    for slot, node in enumerate((tail, head)):
        block = expected.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]
        variance = np.einsum("si,ij,sj->s", direction, block, direction)
        variance += errors[:, slot] ** 2 + ends.at_mm**2
        ahead = (lines.along[kept] * np.conj(along)).real > 0
        if slot == 0:
            ahead = ~ahead
        tips, sure = lines.tips_towards(kept, ahead, head=slot == 1)
        at = lines.start[kept, None] + tips * lines.along[kept, None]
        off = ((at - expected.at[node]) * np.conj(along)[:, None]).real
        marked = _marked(off, sure, variance)
        score, ended[:, slot] = _end_score(gaps[:, slot], variance, ends, marked)
        total += score
    return total, ended, kept


def _marked(off: FloatArray, sure: FloatArray, variance: FloatArray) -> FloatArray:
    """Density per mm of tips `off` (n, t) mm from a node, with their probabilities."""
    spread = (variance + TIP_MM**2)[:, None]
    each = sure * np.exp(-0.5 * off**2 / spread) / np.sqrt(2.0 * np.pi * spread)
    return np.asarray(each.sum(axis=1))


def _end_score(
    gap: FloatArray, variance: FloatArray, ends: Ends, marked: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Log density per mm of an end `gap` mm beyond its node, with that of tips there."""
    sigma = np.sqrt(variance)
    at = ends.at_share * np.exp(-0.5 * gap**2 / variance) / (sigma * np.sqrt(2 * np.pi))
    # Beyond and short, smeared by what is not known of the node.
    reach = np.where(gap > 0, ends.beyond_mm, ends.short_mm)
    share = np.where(gap > 0, ends.beyond_share, ends.short_share)
    off = share * np.exp(-np.maximum(np.abs(gap) - sigma, 0.0) / reach) / (reach + sigma)
    return np.asarray(np.log(at + off + marked + RUN_ON_FAR)), np.asarray(at + marked > 2.0 * off)


def _end_of(expected: Expected, edge: int, slot: int, lines: Lines, row: int) -> tuple[complex, float]:
    """Where a vector ends on its stroke, with the standard error: the likelier of ink's end and tips."""
    ends = (expected.edges[edge].tail, expected.edges[edge].head)
    node, other = complex(expected.at[ends[slot]]), complex(expected.at[ends[1 - slot]])
    along = complex(lines.along[row])
    forward = np.array([((node - other) * np.conj(along)).real > 0])
    tips, sure = lines.tips_towards(np.array([row]), forward, head=slot == 1)
    end, error = lines.nearer_end(row, node)
    if not sure.any():
        return end, error
    at = lines.start[row] + tips[0] * along
    block = expected.cov[2 * ends[slot] : 2 * ends[slot] + 2, 2 * ends[slot] : 2 * ends[slot] + 2]
    direction = np.array([along.real, along.imag])
    variance = float(direction @ block @ direction)
    off = np.append(((at - node) * np.conj(along)).real, ((end - node) * np.conj(along)).real)
    spread = np.append(np.full(len(at), variance + TIP_MM**2), variance + error**2 + END_MM**2)
    density = np.append(sure[0], END_SHARE) * np.exp(-0.5 * off**2 / spread) / np.sqrt(spread)
    best = int(np.argmax(density))
    return (end, error) if best == len(at) else (complex(at[best]), TIP_MM)


@dataclass(frozen=True, slots=True)
class Taken:
    """A stroke taken for an edge.

    Attributes
    ----------
    row : of `Lines`, -1 for none
    shared : whether it serves another edge already
    ended : whether it ends at the edge's tail and at its head
    """

    row: int = -1
    shared: bool = False
    ended: tuple[bool, bool] = (False, False)


NOTHING = Taken()


def updated(expected: Expected, edge: int, taken: Taken, lines: Lines, ends: Ends) -> Expected:
    """The belief after a stroke was seen for an edge (Kalman)."""
    row, (tail, head) = taken.row, (expected.edges[edge].tail, expected.edges[edge].head)
    along = lines.along[row]
    count = 2 * len(expected.at)
    rows, values = [], []
    middle = lines.middle[row]
    arms = [((expected.at[node] - middle) * np.conj(along)).real for node in (tail, head)]
    noise = np.zeros((4, 4))
    loose = REDRAW_MM + (SHARED_MM if taken.shared else 0.0)
    for slot, node in enumerate((tail, head)):
        h = np.zeros(count)
        h[2 * node : 2 * node + 2] = (-along.imag, along.real)
        rows.append(h)
        values.append(-((expected.at[node] - middle) * np.conj(along)).imag)
        for other in (0, 1):
            turned = lines.se_angle[row] ** 2 * arms[slot] * arms[other]
            noise[slot, other] = lines.se_offset[row] ** 2 + turned
        noise[slot, slot] += loose**2
    for slot, node in enumerate((tail, head)):
        if not taken.ended[slot]:
            continue
        end, error = _end_of(expected, edge, slot, lines, row)
        h = np.zeros(count)
        h[2 * node : 2 * node + 2] = (along.real, along.imag)
        noise[len(rows), len(rows)] = error**2 + ends.at_mm**2
        rows.append(h)
        values.append(((end - expected.at[node]) * np.conj(along)).real)
    design, innovation = np.array(rows), np.array(values)
    used = len(rows)
    projected = expected.cov @ design.T
    spread = design @ projected + noise[:used, :used]
    gain = np.linalg.solve(spread, projected.T).T
    step = gain @ innovation
    cov = expected.cov - gain @ projected.T
    return replace(expected, at=expected.at + step[0::2] + 1j * step[1::2], cov=(cov + cov.T) / 2.0)
