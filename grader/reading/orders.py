"""The order in which the sides of a closed force polygon were drawn: given forces may stand in any.

The sides form a ring: the forces laid off one after another, then one or two that close it. In another order
the same sides make another polygon, whose corners bear the same names by their place. `to_usual` gives the
corners that the sides would have in the order of the construction: all other code knows only those.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np

from grader.reading.expected import (
    HIGHEST_WEIGHT_MM,
    RESIDUAL_MM,
    RESIDUAL_PER_MM,
    Expected,
    Search,
    lay,
    support,
)
from grader.reading.lines import Lines
from grader.records import Figure, FloatArray
from reference.construction.elements import Line
from reference.construction.graph import Construction, Vector
from reference.construction.steps import Given, Step, TwoLines
from reference.geometry import ComplexArray

TINY_MM = 1.5
"""A shorter side has no stroke that could tell its place: it stays beside its neighbour."""
MOST_ITEMS = 10
"""Polygons of more sides are read in the usual order only."""
LONGEST = 3
"""Number of long sides that propose where the polygon lies."""
MOST_PLACES = 24
"""Places that are looked at closely, by the best order of each."""
KEPT = 6
"""Orders kept of each set of sides, and of all."""
WORSE = 0.12
"""Orders supported by this much less of the polygon are left out."""
Order = tuple[int, ...]
"""Sides by their number in the usual ring; the closing ones stand last."""

_Supported = dict[tuple[int, int], tuple[FloatArray, Sequence[Order]]]
"""By a set of items, as bits, and the item laid off next: the support by place, and the better way."""


@dataclass(frozen=True, slots=True)
class Ring:
    """The sides of a polygon in the usual order, by their vectors, and how many of them close it."""

    vectors: tuple[Vector, ...]
    closing: int

    @property
    def usual(self) -> Order:
        """The order of the construction."""
        return tuple(range(len(self.vectors)))


def ring_of(construction: Construction, figure: str) -> Ring | None:
    """Return the sides of a force polygon; None if it is no single chain that can be closed."""
    steps = construction.figures[figure]
    chain = [step for step in steps if isinstance(step, Given)]
    corners = [step.node for step in steps]
    if [step.start for step in chain] != corners[: len(chain)] or len(chain) < 2:
        return None
    between = {
        frozenset((vector.tail, vector.head)): vector
        for vector in construction.vectors_of(figure)
        if not vector.is_sum
    }
    ends = [frozenset(pair) for pair in (*pairwise(corners), (corners[-1], corners[0]))]
    if any(pair not in between for pair in ends):
        return None
    return Ring(tuple(between[pair] for pair in ends), len(corners) - len(chain))


def ends_on_sheet(construction: Construction, name: str, figure: Figure) -> dict[str, complex]:
    """Return the place on the sheet of each node, complex mm.

    In a force polygon of another order it is the end of the force that ends there in the usual order.
    """
    ring = ring_of(construction, name) if figure.drawn else None
    if ring is None:
        return {node: read.at for node, read in figure.nodes.items()}
    corners = [step.node for step in construction.figures[name]]
    return {
        node: figure.drawn[side.name][side.arrow.index(node)]
        for side, node in zip(ring.vectors, (*corners[1:], corners[0]), strict=True)
        if side.name in figure.drawn
    }


def corners_of(construction: Construction, name: str, figure: Figure) -> dict[str, tuple[str, ...]]:
    """Return the nodes where each vector begins and ends on the sheet, as `ends_on_sheet` places them.

    A vector of a polygon in another order is left out if no node is at one of its ends.
    """
    if not figure.drawn:
        return {vector.name: vector.arrow for vector in construction.vectors_of(name)}
    there = {at: node for node, at in ends_on_sheet(construction, name, figure).items()}
    return {
        vector: (there[tail], there[head])
        for vector, (tail, head) in figure.drawn.items()
        if tail in there and head in there
    }


def to_usual(order: Order) -> FloatArray:
    """Return (n, n) that gives the corners of the usual order from those of an order."""
    count = len(order)
    rows = np.zeros((count, count))
    rows[:, 0] = 1.0
    for corner, side in enumerate(range(count - 1), start=1):
        place = order.index(side)
        rows[corner] = rows[corner - 1]
        rows[corner, (place + 1) % count] += 1.0
        rows[corner, place] -= 1.0
    return rows


def reordered(construction: Construction, figure: str, ring: Ring, order: Order) -> Construction:
    """Return the construction with a polygon in an order; sums that are no line in it are left out."""
    steps, chain = construction.figures[figure], order[: -ring.closing]
    corners = [step.node for step in steps]
    moved: list[Step] = [steps[0]]
    for place, side in enumerate(chain):
        step = steps[side + 1]
        if isinstance(step, Given):
            moved.append(replace(step, node=corners[place + 1], start=corners[place]))
    closing = steps[-1]
    if isinstance(closing, TwoLines):
        first, second = closing.first, closing.second
        if order[-2] > order[-1] and isinstance(first, Line) and isinstance(second, Line):
            first, second = replace(second, through=corners[-2]), replace(first, through=corners[0])
        moved.append(TwoLines(closing.node, first, second))
    rows, vectors = to_usual(order), {}
    for name, vector in construction.vectors.items():
        if construction.figure_of(vector.head) != figure:
            vectors[name] = vector
            continue
        ends = rows[corners.index(vector.head)] - rows[corners.index(vector.tail)]
        if np.abs(ends).sum() == 2.0:
            tail, head = corners[int(ends.argmin())], corners[int(ends.argmax())]
            vectors[name] = replace(vector, tail=tail, head=head)
    figures = {**construction.figures, figure: tuple(moved)}
    return replace(construction, figures=figures, vectors=vectors)


# The order by the ink -----------------------------------------------------------------------------


def orders_by_ink(expected: Expected, ring: Ring, lines: Lines) -> dict[Order, float]:
    """Return likely orders of a polygon's sides, likeliest first, with the share of it that strokes support.

    Wherever a long side may lie, all sets of the other sides are laid off from its end, each in the best
    orders of its members: the corner that a set ends in does not depend on their order.
    """
    spans = np.roll(expected.at, -1) - expected.at
    items = list(_items(spans, ring))
    if not np.isfinite(spans).all() or not 3 <= len(items) <= MOST_ITEMS:
        return {}
    search = _Sets(items, spans, lines)
    found: dict[Order, float] = {}
    for order, share in search.best():
        whole = _whole(order, spans, ring)
        if share > found.get(whole, 0.0):
            found[whole] = share
    best = max(found.values(), default=0.0)
    likely = sorted(found, key=lambda order: -found[order])
    kept = [order for order in likely if found[order] > best - WORSE][:KEPT]
    # Of the two orders of the closing sides only the better one was kept at each place.
    swapped = [(*order[:-2], order[-1], order[-2]) for order in kept[:1] if ring.closing == 2]
    return {order: found.get(order, best) for order in (*kept, *swapped)}


def _items(spans: ComplexArray, ring: Ring) -> Iterator[tuple[Order, ...]]:
    """Yield what may be laid off next: a side, or the closing ones in either order; no tiny ones."""
    chain = len(spans) - ring.closing
    yield from (((side,),) for side in range(chain) if abs(spans[side]) >= TINY_MM)
    closing = tuple(side for side in range(chain, len(spans)) if abs(spans[side]) >= TINY_MM)
    if closing:
        yield (closing, closing[::-1]) if len(closing) == 2 else (closing,)


def _whole(order: Order, spans: ComplexArray, ring: Ring) -> Order:
    """Return an order with the tiny sides beside their neighbours, the closing ones at its end."""
    count, whole = len(spans), list(order)
    chain = count - ring.closing

    def closes(place: int) -> bool:
        return whole[place % len(whole)] >= chain

    # Tiny closing sides first: a tiny part across a link then finds that along it.
    for side in reversed(range(count)):
        if side in whole:
            continue
        place = whole.index(_neighbour(side, whole, ring))
        is_behind = side == count - 1 if side >= chain else not closes(place) or not closes(place + 1)
        whole.insert(place + is_behind, side)
    turn = next(place for place in range(count) if closes(place) and not closes(place + 1))
    return (*whole[turn + 1 :], *whole[: turn + 1])


def _neighbour(side: int, placed: Sequence[int], ring: Ring) -> int:
    """Return the side beside which a tiny one stands: of two parts the other one, else that before it."""
    one, count = ring.vectors[side], len(ring.vectors)
    other = 2 * count - 3 - side
    if side >= count - ring.closing and ring.closing == 2 and other in placed:
        return other
    parts = [other for other in placed if one.part and ring.vectors[other].name[:-1] == one.name[:-1]]
    before = ((side - back) % count for back in range(1, count))
    return parts[0] if parts else next(other for other in before if other in placed)


@dataclass(frozen=True, slots=True)
class _Sets:
    """The search over sets of sides.

    Attributes
    ----------
    items : what is laid off at a time, each in one or two ways
    spans : the sides, complex mm
    lines : the strokes
    """

    items: Sequence[tuple[Order, ...]]
    spans: ComplexArray
    lines: Lines

    @property
    def weights(self) -> FloatArray:
        """The weight of each side: long ones count no more than `HIGHEST_WEIGHT_MM`."""
        return np.minimum(np.abs(self.spans), HIGHEST_WEIGHT_MM)

    def best(self) -> Iterator[tuple[Order, float]]:
        """Yield orders with the share of the polygon that has strokes, from every likely place."""
        total = sum(self.weights[side] for item in self.items for side in item[0])
        for item, way, start, spin in self._starts():
            scores = self._supported(item, start, spin)
            first = self._weighted(way, start, spin, start)
            ranked = self._ranked(item, first, scores)
            for place in np.argsort(-ranked)[:MOST_PLACES]:
                for order, score in self._orders(item, way, float(first[place]), scores, int(place)):
                    yield order, score / total

    def _starts(self) -> Iterator[tuple[int, Order, ComplexArray, ComplexArray]]:
        """Yield an item in one way, with the places and spins at which a long side of it lies on a stroke."""
        longest = sorted(range(len(self.spans)), key=lambda side: -abs(self.spans[side]))[:LONGEST]
        for number, item in enumerate(self.items):
            for side in (side for side in longest if side in item[0]):
                poses = lay((0j, complex(self.spans[side])), self.lines, Search())
                poses = poses[np.unique(np.round(poses[:, :2]), axis=0, return_index=True)[1]]
                spin = poses[:, 2] * np.exp(1j * poses[:, 3])
                at = poses[:, 0] + 1j * poses[:, 1]
                for way in item:
                    before = sum(self.spans[one] for one in way[: way.index(side)])
                    yield number, way, at - spin * before, spin

    def _weighted(self, way: Order, at: ComplexArray, spin: ComplexArray, start: ComplexArray) -> FloatArray:
        """Return how well some sides are supported one after another from a place, weighted.

        Arguments: `start`, where the polygon was laid: farther off it may lie less exactly.
        """
        score, strokes = np.zeros(len(at)), (self.lines.start, self.lines.along, self.lines.length)
        for side in way:
            end = at + spin * self.spans[side]
            sigma = RESIDUAL_MM + RESIDUAL_PER_MM * np.maximum(np.abs(at - start), np.abs(end - start))
            score += self.weights[side] * support(strokes, at, end, sigma)
            at = end
        return score

    def _supported(self, first: int, start: ComplexArray, spin: ComplexArray) -> _Supported:
        """Return the weighted support of each item after each set of others, in its better way by place."""
        sums = [sum(self.spans[side] for side in item[0]) for item in self.items]
        sets = [members for members in range(1 << len(self.items)) if members >> first & 1]
        ends = {
            members: start + spin * sum(one for item, one in enumerate(sums) if members >> item & 1)
            for members in sets
        }
        found: _Supported = {}
        for item, ways in enumerate(self.items):
            before = [members for members in sets if not members >> item & 1]
            if not before:
                continue
            at = np.concatenate([ends[members] for members in before])
            spins, starts = np.tile(spin, len(before)), np.tile(start, len(before))
            scores = [self._weighted(way, at, spins, starts).reshape(len(before), -1) for way in ways]
            better, best = np.argmax(scores, axis=0), np.max(scores, axis=0)
            for row, members in enumerate(before):
                found[members, item] = best[row], [ways[way] for way in better[row]]
        return found

    def _ranked(self, first: int, own: FloatArray, scores: _Supported) -> FloatArray:
        """Return the score of the best order at each place."""
        best = {1 << first: own}
        for members, item in sorted(scores, key=lambda key: key[0]):
            after = members | 1 << item
            score = best[members] + scores[members, item][0]
            best[after] = np.maximum(best[after], score) if after in best else score
        return best[(1 << len(self.items)) - 1]

    def _orders(
        self,
        first: int,
        way: Order,
        own: float,
        scores: _Supported,
        place: int,
    ) -> list[tuple[Order, float]]:
        """Return the best orders at one place."""
        kept: dict[int, list[tuple[Order, float]]] = {1 << first: [(way, own)]}
        for members, item in sorted(scores, key=lambda key: key[0]):
            gain, ways = scores[members, item]
            further = [((*order, *ways[place]), score + float(gain[place])) for order, score in kept[members]]
            after = members | 1 << item
            kept[after] = sorted([*kept.get(after, []), *further], key=lambda one: -one[1])[:KEPT]
        return kept[(1 << len(self.items)) - 1]
