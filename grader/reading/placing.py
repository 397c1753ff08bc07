"""Where a figure may lie: its longest edges laid on strokes, each place then judged by all its edges."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.expected import Expected
from grader.reading.lines import Lines
from grader.records import FloatArray
from reference.geometry import ComplexArray

OFF_MM = 1.6
"""How far strokes may lie off a figure that is laid roughly."""
OFF_PER_MM = 0.03
"""And further, the further from where it was laid on."""
HIGHEST_WEIGHT_MM = 40.0
LEAST_EDGE_MM = 8.0
OVERRUN_MM = 25.0
PROPOSING_EDGES = 4
SHORT_LIST = 60
PAIRS = 1 << 13
"""Of segments and strokes compared at a time: their arrays stay in a processor's own cache."""
FARTHEST_SQUARED = 1500.0
"""Of sigma: the fit of a stroke so far off is zero, its exponential is less than the smallest number."""
SPECK_MM = 2.0
"""Shorter edges have no direction to speak of."""


@dataclass(frozen=True, slots=True)
class Place:
    """A figure's origin on the sheet (complex mm), its size relative to the expected, turn, score 0..1."""

    at: complex
    size: float
    turn_rad: float
    score: float


@dataclass(frozen=True, slots=True)
class Search:
    """Where to look.

    Attributes
    ----------
    turns_rad : turns of the whole figure to try
    give_rad : freedom about each
    sizes : sizes to try; 0 stands for "as long as the stroke"
    smallest, largest : bounds of free sizes
    short_mm : how much shorter a stroke may be than its edge (links stop at joint circles)
    """

    turns_rad: tuple[float, ...] = (0.0,)
    give_rad: float = float(np.radians(3.0))
    sizes: tuple[float, ...] = (1.0,)
    smallest: float = 0.3
    largest: float = 3.0
    short_mm: float = 3.0


def places(expected: Expected, lines: Lines, search: Search, count: int = 3) -> list[Place]:
    """The best places of a figure among the strokes, best first."""
    proposed = _proposals(expected, lines, search)
    if not len(proposed):
        return []
    # The longest edges, on long strokes alone, leave few proposals for a look at everything.
    rough = _scores(expected, lines, proposed, _longest(expected))
    proposed = proposed[np.argsort(-rough)[:SHORT_LIST]]
    scores = _scores(expected, lines, proposed, list(range(len(expected.edges))))
    return _apart(proposed, scores, float(np.abs(expected.at).max()), count)


def _proposals(expected: Expected, lines: Lines, search: Search) -> FloatArray:
    """(m, 4) origin x, y, size, turn."""
    found: list[FloatArray] = []
    for edge in (expected.edges[one] for one in _longest(expected)):
        tail, head = complex(expected.at[edge.tail]), complex(expected.at[edge.head])
        # A stroke has no sense: it may lie either way.
        for start, end in ((lines.start, lines.end), (lines.end, lines.start)):
            turn_all = np.angle((end - start) / (head - tail))
            for turn in search.turns_rad:
                off = np.abs(np.angle(np.exp(1j * (turn_all - turn))))
                turned = np.flatnonzero(off < search.give_rad)
                for size in search.sizes:
                    found.extend(_laid((tail, head), (start[turned], end[turned]), size, search))
    return np.concatenate(found) if found else np.zeros((0, 4))


def _longest(expected: Expected) -> list[int]:
    """The longest edges, by their place in the list, each in a direction of its own."""
    span = np.array([expected.at[edge.head] - expected.at[edge.tail] for edge in expected.edges])
    size = np.where(np.isfinite(span), np.abs(span), 0.0)
    chosen: list[int] = []
    for edge in np.argsort(-size):
        if size[edge] < LEAST_EDGE_MM or len(chosen) == PROPOSING_EDGES:
            break
        chosen.append(int(edge))
    return chosen


def _laid(
    edge: tuple[complex, complex], strokes: tuple[ComplexArray, ComplexArray], size: float, search: Search
) -> list[FloatArray]:
    """Origins with the edge's tail on the stroke's start, and with its head on the stroke's end."""
    (tail, head), (start, end) = edge, strokes
    span = head - tail
    drawn = np.abs(end - start)
    if size > 0.0:
        wanted = size * abs(span)
        fits = (drawn > wanted * 0.9 - search.short_mm) & (drawn < wanted * 1.1 + OVERRUN_MM)
        sizes = np.full(int(fits.sum()), size)
    else:
        sizes = drawn / abs(span)
        fits = (sizes > search.smallest) & (sizes < search.largest)
        sizes = sizes[fits]
    start, end = start[fits], end[fits]
    turn = np.angle((end - start) / span)
    spin = sizes * np.exp(1j * turn)
    by_tail = start - spin * tail
    by_head = end - spin * head
    return [np.column_stack([at.real, at.imag, sizes, turn]) for at in (by_tail, by_head)]


def _scores(expected: Expected, lines: Lines, proposed: FloatArray, edges: Sequence[int]) -> FloatArray:
    """Share of the figure's edges (by length, capped) that have a stroke, for every proposal."""
    origin = proposed[:, 0] + 1j * proposed[:, 1]
    spin = proposed[:, 2] * np.exp(1j * proposed[:, 3])
    total, weights = np.zeros(len(proposed)), np.zeros(len(proposed))
    for edge in (expected.edges[index] for index in edges):
        tail, head = (origin + spin * expected.at[node] for node in (edge.tail, edge.head))
        size = np.abs(head - tail)
        if not np.isfinite(size).all():
            continue
        weight = np.minimum(size, HIGHEST_WEIGHT_MM) * (size > SPECK_MM)
        reach = OFF_MM + OFF_PER_MM * np.maximum(np.abs(tail - origin), np.abs(head - origin))
        long = lines.take(lines.length > 0.3 * size.min())
        total += weight * best_support(long, tail, head, reach)
        weights += weight
    return np.asarray(total / np.maximum(weights, 1e-9))


def best_support(lines: Lines, tail: ComplexArray, head: ComplexArray, sigma: FloatArray) -> FloatArray:
    """How well the best stroke lies under each segment, 0..1. Arguments: segments (m,), sigma mm (m,)."""
    support = np.zeros(len(tail))
    rows = max(1, PAIRS // max(1, len(lines)))
    for first in range(0, len(tail), rows):
        part = slice(first, first + rows)
        from_start = (tail[part, None] - lines.start) * np.conj(lines.along)
        to_end = (head[part, None] - lines.start) * np.conj(lines.along)
        off2 = from_start.imag**2 + to_end.imag**2
        low = np.minimum(from_start.real, to_end.real)
        high = np.maximum(from_start.real, to_end.real)
        shared = np.minimum(high, lines.length) - np.maximum(low, 0.0)
        at = np.nonzero((shared > 0.0) & (off2 < FARTHEST_SQUARED * sigma[part, None] ** 2))
        span = np.maximum(high[at] - low[at], 1e-6)
        true_span = np.abs(head[part] - tail[part])[at[0]]
        share = np.clip(shared[at] / np.maximum(true_span, span), 0.0, 1.0)
        fit = np.exp(-0.5 * off2[at] / sigma[part][at[0]] ** 2) * share
        np.maximum.at(support[part], at[0], fit)
    return support


def _apart(proposed: FloatArray, scores: FloatArray, radius: float, count: int) -> list[Place]:
    """The best proposals that are not the same place again."""
    chosen: list[int] = []
    origin = proposed[:, 0] + 1j * proposed[:, 1]
    spin = proposed[:, 2] * np.exp(1j * proposed[:, 3])
    for index in np.argsort(-scores):
        moved = [abs(origin[index] - origin[one]) + radius * abs(spin[index] - spin[one]) for one in chosen]
        if all(distance > 4.0 for distance in moved):
            chosen.append(int(index))
        if len(chosen) == count:
            break
    return [
        Place(complex(origin[one]), float(proposed[one, 2]), float(proposed[one, 3]), float(scores[one]))
        for one in chosen
    ]
