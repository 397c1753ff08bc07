"""Gaussian beliefs of where a figure's nodes are, and what strokes say about them; many at a time."""

from dataclasses import dataclass

import numpy as np

from grader.reading.lines import TIP_MM, BoolArray, Lines
from grader.records import FloatArray, IntArray
from reference.geometry import ComplexArray

REDRAW_MM = 0.3
"""How far a stroke misses the nodes that it joins, one standard error."""
SHARED_MM = 0.4
"""And further where it serves two edges, that lie this near to each other."""
END_MM, END_SHARE = 0.3, 0.4
RUN_ON_FAR = 4e-4
"""Density per mm of ends anywhere: the stroke goes on as another edge, or as a line drawn through."""
UNTOLD_MM = 1e5
"""Standard error of what an end tells that is not at its node: nothing."""


@dataclass(frozen=True, slots=True)
class Ends:
    """How strokes end at nodes: log densities (per mm) of an end at, beyond and short of its node."""

    at_mm: float = 0.3
    at_share: float = 0.57
    beyond_mm: float = 3.0
    beyond_share: float = 0.36
    short_mm: float = 1.5
    short_share: float = 0.07


@dataclass(frozen=True, slots=True)
class Spans:
    """Beliefs of the two nodes that an edge joins, a row each.

    Attributes
    ----------
    tail, head : (s,) complex mm
    cov : (3, s, 3) covariances of the tail, of tail with head, of the head; each as xx, xy + yx, yy,
        so that its product with `_squares` of a direction is the covariance along that direction
    """

    tail: ComplexArray
    head: ComplexArray
    cov: FloatArray

    def take(self, rows: IntArray) -> "Spans":
        """Some of the rows, also repeated."""
        return Spans(self.tail[rows], self.head[rows], self.cov[:, rows])


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs of a figure's nodes, a row each.

    Attributes
    ----------
    at : (s, n) complex mm
    cov : (s, 2n, 2n) covariance, x and y of each node in turn
    """

    at: ComplexArray
    cov: FloatArray

    def take(self, rows: IntArray) -> "Beliefs":
        """Some of the rows, also repeated."""
        return Beliefs(self.at[rows], self.cov[rows])

    def spans(self, tail: int, head: int) -> Spans:
        """What is believed of an edge's nodes."""
        cov = np.empty((3, len(self.cov), 3))
        for pair, (one, other) in enumerate(((tail, tail), (tail, head), (head, head))):
            cov[pair, :, 0] = self.cov[:, 2 * one, 2 * other]
            cov[pair, :, 1] = self.cov[:, 2 * one, 2 * other + 1] + self.cov[:, 2 * one + 1, 2 * other]
            cov[pair, :, 2] = self.cov[:, 2 * one + 1, 2 * other + 1]
        return Spans(self.at[:, tail], self.at[:, head], cov)


def _squares(direction: ComplexArray) -> FloatArray:
    """(s, 3) of unit vectors: x^2, x y, y^2."""
    x, y = direction.real, direction.imag
    squares = np.empty((len(x), 3))
    squares[:, 0], squares[:, 1], squares[:, 2] = x * x, x * y, y * y
    return squares


def offsets(spans: Spans, lines: Lines) -> tuple[FloatArray, FloatArray]:
    """Distances of both nodes from each line (2, s, lines), and their covariances (3, s, lines).

    The covariances are those of the tail, of tail with head, and of the head.
    """
    nodes = np.stack([spans.tail, spans.head])[:, :, None]
    from_middle = (nodes - lines.middle) * np.conj(lines.along)
    spread = spans.cov @ _squares(1j * lines.along).T
    arm = from_middle.real
    for pair, (one, other) in enumerate(((0, 0), (0, 1), (1, 1))):
        spread[pair] += lines.se_offset**2 + lines.se_angle**2 * arm[one] * arm[other]
    spread[::2] += REDRAW_MM**2
    return from_middle.imag, spread


def mahalanobis(off: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances of pairs (2, ...) by their covariances (3, ...), and log determinants."""
    a, b, c = spread
    det = np.maximum(a * c - b * b, 1e-9)
    distance = (c * off[0] ** 2 - 2 * b * off[0] * off[1] + a * off[1] ** 2) / det
    return distance, np.log(det)


def ends_at(spans: Spans, lines: Lines, ends: Ends) -> tuple[FloatArray, BoolArray, BoolArray]:
    """How strokes end about the nodes of an edge, stroke by stroke (n,).

    Returns log densities (n,), whether they end at the nodes (n, 2), and whether they cover the edge (n,).
    """
    span = spans.head - spans.tail
    forward = (lines.along * np.conj(span)).real > 0
    along = np.where(forward, lines.along, -lines.along)
    ways = np.stack([lines.start, lines.end]) - spans.tail
    places = (ways * np.conj(along)).real
    first, last = places.min(axis=0), places.max(axis=0)
    size = (span * np.conj(along)).real
    covers = (last > 0.35 * size) & (first < 0.65 * size) & (last - first > 0.3 * size)
    errors = np.where(forward[:, None], lines.se_end, lines.se_end[:, ::-1])
    total, ended = np.zeros(len(lines)), np.zeros((len(lines), 2), dtype=bool)
    for slot, (node, gap) in enumerate(((spans.tail, -first), (spans.head, last - size))):
        around = (spans.cov[2 * slot] * _squares(along)).sum(axis=1)
        variance = around + errors[:, slot] ** 2 + ends.at_mm**2
        off, sure = _tips_off(lines, node, forward == bool(slot), head=slot == 1)
        score, ended[:, slot] = _end_score(gap, variance, ends, _marked(off, sure, variance))
        total += score
    return total, ended, covers


def _tips_off(
    lines: Lines, node: ComplexArray, ahead: BoolArray, *, head: bool
) -> tuple[FloatArray, FloatArray]:
    """How far tips lie off nodes along their strokes (n, t), and their probabilities."""
    tips, sure = lines.tips_towards(np.arange(len(lines)), ahead, head=head)
    return tips + ((lines.start - node) * np.conj(lines.along)).real[:, None], sure


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


def _seen_ends(spans: Spans, lines: Lines, slot: int) -> tuple[FloatArray, FloatArray]:
    """How far off its node a vector ends on its stroke (s,), with the standard error.

    It is the likelier of the ink's end and of tips.
    """
    node, other = (spans.head, spans.tail) if slot else (spans.tail, spans.head)
    back = np.conj(lines.along)
    ink = np.stack([lines.start, lines.end], axis=1) - node[:, None]
    nearer = np.abs(ink).argmin(axis=1)
    rows = np.arange(len(lines))
    error = lines.se_end[rows, nearer]
    off, sure = _tips_off(lines, node, ((node - other) * back).real > 0, head=slot == 1)
    # Rounding may leave a settled node a variance just below zero.
    around = np.maximum((spans.cov[2 * slot] * _squares(lines.along)).sum(axis=1), 0.0)
    off = np.column_stack([(ink[rows, nearer] * back).real, off])
    spread = around[:, None] + np.full(off.shape, TIP_MM**2)
    spread[:, 0] = around + error**2 + END_MM**2
    sure = np.column_stack([np.full(len(lines), END_SHARE), sure])
    best = (sure * np.exp(-0.5 * off**2 / spread) / np.sqrt(spread)).argmax(axis=1)
    return off[rows, best], np.where(best == 0, error, TIP_MM)


@dataclass(frozen=True, slots=True)
class Taken:
    """Strokes taken for one edge, one for each belief.

    Attributes
    ----------
    lines : the strokes, a row each
    shared : (s,) whether it serves another edge already
    ended : (s, 2) whether it ends at the edge's tail and at its head
    """

    lines: Lines
    shared: BoolArray
    ended: BoolArray


def updated(beliefs: Beliefs, edge: tuple[int, int], taken: Taken, ends: Ends) -> Beliefs:
    """The beliefs after a stroke was seen for an edge, given by its nodes (Kalman)."""
    lines, (tail, head) = taken.lines, edge
    along = lines.along
    spans = beliefs.spans(tail, head)
    nodes = np.column_stack([spans.tail, spans.head])
    from_middle = (nodes - lines.middle[:, None]) * np.conj(along)[:, None]
    seen = [_seen_ends(spans, lines, slot) for slot in (0, 1)]
    innovation = np.column_stack([-from_middle.imag, *(off for off, _ in seen)])
    noise = np.zeros((len(lines), 4, 4))
    arms = from_middle.real
    noise[:, :2, :2] = (lines.se_angle**2)[:, None, None] * arms[:, :, None] * arms[:, None, :]
    noise[:, :2, :2] += (lines.se_offset**2)[:, None, None]
    for slot, (_, error) in enumerate(seen):
        noise[:, slot, slot] += (REDRAW_MM + SHARED_MM * taken.shared) ** 2
        told = np.sqrt(error**2 + ends.at_mm**2)
        noise[:, 2 + slot, 2 + slot] = np.where(taken.ended[:, slot], told, UNTOLD_MM) ** 2
    return _corrected(beliefs, edge, _design(along), innovation, noise)


def _design(along: ComplexArray) -> FloatArray:
    """(s, 4, 4): tail and head (x, y each) across the line, then along it."""
    design = np.zeros((len(along), 4, 4))
    for first, way in ((0, 1j * along), (2, along)):
        for slot in (0, 1):
            design[:, first + slot, 2 * slot] = way.real
            design[:, first + slot, 2 * slot + 1] = way.imag
    return design


def _corrected(
    beliefs: Beliefs, edge: tuple[int, int], design: FloatArray, innovation: FloatArray, noise: FloatArray
) -> Beliefs:
    columns = [2 * edge[0], 2 * edge[0] + 1, 2 * edge[1], 2 * edge[1] + 1]
    projected = design @ beliefs.cov[:, columns]
    spread = projected[:, :, columns] @ design.transpose(0, 2, 1) + noise
    gain = np.linalg.solve(spread, projected)
    step = (innovation[:, None] @ gain)[:, 0]
    cov = beliefs.cov - projected.transpose(0, 2, 1) @ gain
    return Beliefs(beliefs.at + step[:, 0::2] + 1j * step[:, 1::2], (cov + cov.transpose(0, 2, 1)) / 2.0)
