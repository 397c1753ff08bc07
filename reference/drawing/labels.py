"""The positions of letters: beside their point, clear of every stroke, arrowhead and other letter.

Each letter has many candidates around its point; the nearest one that touches nothing is taken, outside
the figure first. A letter without room near its point stands farther away, with a thin line to it.
"""

import itertools
import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from reference.drawing.canvas import (
    CONSTRUCTION,
    SLANT,
    Area,
    Curve,
    Label,
    Piece,
    Point,
    Ring,
    Shape,
    Stroke,
    Text,
    rise_and_fall,
    width_of,
)
from reference.drawing.subject import TOUCHING_MM, Part, Subject
from reference.drawing.symbols import HAIR_MM, point
from reference.geometry import FloatArray

CLEAR_MM, APART_MM = 0.45, 1.1
"""Least distance of a letter's box from a stroke's edge, and from other letters."""
GAPS_MM, FAR_GAPS_MM = (0.5, 1.2, 2.2, 3.6, 5.5), (8.0, 11.0, 15.0, 20.0)
"""Distances from the point's mark that are tried, and those tried where these leave little choice."""
DIRECTIONS = 24
LEADER_FROM_MM, LEAST_LEADER_MM = 3.0, 2.0
"""A letter farther than the first from its point gets a thin line to it; farther than the second, where
another point is nearly as near."""
DOUBT_MM = 1.0
SAME_POINT_MM = 1e-6
TINY_MM = 1e-9
LEADER_DASH = (0.5, 0.8)
TOUCHING_COST, CROSSING_COST = 60.0, 12.0
"""Cost of a millimetre of stroke under a letter (and as much for each stroke); of overlapping letters."""
OTHERS_POINT_COST = 1.5
"""Cost of each millimetre by which a letter is nearer to another point than to its own."""


@dataclass(frozen=True, slots=True)
class Wanted:
    """A letter to be placed: its point (millimetres, y down), and the `radius` to keep clear around it."""

    node: str
    at: Point
    text: Text
    size: float
    colour: str
    radius: float = 1.0
    outward: complex = 0j
    """Preferred direction from the point, y up; zero if it does not matter."""
    italic: bool = True


@dataclass(frozen=True, slots=True)
class PlacedLabel:
    """A placed letter, with a thin line to its point if it stands far from it."""

    wanted: Wanted
    label: Label
    leader: Stroke | None

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """The shapes to draw."""
        return (self.label,) if self.leader is None else (self.label, self.leader)


def place_labels(wanted: Sequence[Wanted], obstacles: Iterable[Shape], rounds: int = 3) -> list[PlacedLabel]:
    """Choose the position of each letter: those with the least room first, then all again in turn."""
    segments = segments_of(obstacles)
    points = np.array([one.at for one in wanted]).reshape(-1, 2)
    tries = [_candidates_at(one, GAPS_MM, segments, points) for one in wanted]
    order = sorted(range(len(wanted)), key=lambda k: int(np.sum(tries[k].cost < TOUCHING_COST)))
    standing: dict[int, PlacedLabel] = {}
    crowded: set[int] = set()
    for _ in range(rounds):
        before = dict(standing)
        for k in order:
            others = [standing[other] for other in standing if other != k]
            standing[k], cost = tries[k].best(others)
            if cost >= CROSSING_COST and k not in crowded:
                crowded.add(k)
                tries[k] = tries[k].with_more(_candidates_at(wanted[k], FAR_GAPS_MM, segments, points))
                standing[k], _cost = tries[k].best(others)
        if before == standing:
            break
    return [standing[k] for k in range(len(wanted))]


@dataclass(frozen=True, slots=True)
class _Candidates:
    """Candidate positions for a letter: boxes (p, 4), and the cost of each by itself (p,)."""

    wanted: Wanted
    boxes: FloatArray
    leaders: FloatArray
    cost: FloatArray

    def with_more(self, far: "_Candidates") -> "_Candidates":
        """Return these positions and others farther off."""
        pairs = ((self.boxes, far.boxes), (self.leaders, far.leaders), (self.cost, far.cost))
        return _Candidates(self.wanted, *(np.concatenate(pair) for pair in pairs))

    def best(self, others: Sequence[PlacedLabel]) -> tuple[PlacedLabel, float]:
        """Return the cheapest position beside the letters placed so far, and its cost."""
        cost = self.cost.copy()
        if others:
            taken = np.array([other.label.bounds for other in others])
            cost += TOUCHING_COST * np.sum(_overlaps(self.boxes, taken, APART_MM), axis=1)
            led = np.any(np.isfinite(self.leaders), axis=1)
            cost += np.where(led, CROSSING_COST * np.sum(lengths_inside(taken, self.leaders), axis=0), 0.0)
            lines = segments_of(other.leader for other in others if other.leader)
            cost += TOUCHING_COST * np.sum(lengths_inside(self.boxes, lines), axis=1)
        k = int(np.argmin(cost))
        return self._placed(k), float(cost[k])

    def _placed(self, k: int) -> PlacedLabel:
        one = self.wanted
        left, top, _, _ = (float(value) for value in self.boxes[k])
        rise, _ = rise_and_fall(one.text, one.size)
        label = Label((left, top + rise), one.text, one.size, "start", one.colour, one.italic)
        if not np.all(np.isfinite(self.leaders[k])):
            return PlacedLabel(one, label, None)
        x0, y0, x1, y1 = (float(value) for value in self.leaders[k][:4])
        return PlacedLabel(one, label, Stroke((x0, y0), (x1, y1), HAIR_MM, CONSTRUCTION, LEADER_DASH))


def _candidates_at(
    wanted: Wanted, gaps: Sequence[float], segments: FloatArray, points: FloatArray
) -> _Candidates:
    """Return positions all round a point, at each of some distances from its mark."""
    boxes, gap, turn = _boxes_around(wanted, gaps)
    own, others = _distances(boxes, wanted, points)
    doubtful = (gap >= LEADER_FROM_MM) | ((others < own + DOUBT_MM) & (gap >= LEAST_LEADER_MM))
    aside = 0.0 if wanted.outward == 0 else 1.0 - np.cos(turn - np.angle(wanted.outward))
    touched = lengths_inside(boxes, segments)
    cost = gap + 0.9 * aside + OTHERS_POINT_COST * np.maximum(own + DOUBT_MM - others, 0.0)
    cost += TOUCHING_COST * np.sum(np.where(touched > 0.0, touched + 1.0, 0.0), axis=1)
    return _Candidates(wanted, boxes, _leaders(wanted, boxes, doubtful), cost)


def _boxes_around(wanted: Wanted, gaps: Sequence[float]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return boxes (p, 4), the distance of each from the point's mark (p,), the direction of each (p,)."""
    rise, fall = rise_and_fall(wanted.text, wanted.size)
    wide = width_of(wanted.text, wanted.size) + (SLANT * rise if wanted.italic else 0.0)
    half = np.array([wide, rise + fall]) / 2.0
    turns = np.arange(DIRECTIONS) * math.tau / DIRECTIONS
    gap, turn = (grid.ravel() for grid in np.meshgrid(gaps, turns, indexing="ij"))
    along = np.stack([np.cos(turn), -np.sin(turn)], axis=1)
    # The gap is measured from the mark to the box, not to its middle.
    steep = np.maximum(np.abs(along), TINY_MM)
    reach = np.minimum(half[0] / steep[:, 0], half[1] / steep[:, 1]) + wanted.radius + gap
    middles = np.asarray(wanted.at) + along * reach[:, None]
    return np.hstack([middles - half, middles + half]), gap, turn


def _distances(boxes: FloatArray, wanted: Wanted, points: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the distances of (p, 4) boxes from their own point and from the nearest other one, (p,)."""
    apart = points[:, None] - np.clip(points[:, None], boxes[:, :2], boxes[:, 2:])
    away = np.hypot(apart[..., 0], apart[..., 1])
    mine = np.hypot(*(points - np.asarray(wanted.at)).T) < SAME_POINT_MM
    others = np.min(away[~mine], axis=0) if np.any(~mine) else np.full(len(boxes), np.inf)
    return np.min(away[mine], axis=0), others


def _leaders(wanted: Wanted, boxes: FloatArray, doubtful: NDArray[np.bool_]) -> FloatArray:
    """Return the thin line from a point's mark to each box, as segments; nan if none is needed."""
    at = np.asarray(wanted.at)
    near = np.clip(at, boxes[:, :2], boxes[:, 2:])
    span = near - at
    length = np.hypot(span[:, 0], span[:, 1])
    unit = span / np.maximum(length, SAME_POINT_MM)[:, None]
    lines = np.hstack([at + unit * wanted.radius, near - unit * CLEAR_MM, np.zeros((len(boxes), 1))])
    return np.where(doubtful[:, None], lines, np.nan)


def segments_of(shapes: Iterable[Shape]) -> FloatArray:
    """Return every edge of shapes as (m, 5): both ends and half the stroke's width; letters have none."""
    rows = [(*start, *end, half) for shape in shapes for start, end, half in _edges(shape)]
    return np.array(rows, dtype=np.float64).reshape(-1, 5)


def _edges(shape: Shape) -> Iterator[tuple[Point, Point, float]]:
    match shape:
        case Stroke(start=start, end=end, width=width):
            yield start, end, width / 2.0
        case Curve(points=points, width=width):
            yield from ((p, q, width / 2.0) for p, q in itertools.pairwise(points))
        case Area(points=points, width=width):
            following = (*points[1:], points[0])
            yield from ((p, q, width / 2.0) for p, q in zip(points, following, strict=True))
        case Ring(centre=(x, y), radius=radius, width=width):
            turns = [k * math.tau / 12 for k in range(13)]
            rim = [(x + radius * math.cos(turn), y + radius * math.sin(turn)) for turn in turns]
            yield from ((p, q, width / 2.0) for p, q in itertools.pairwise(rim))
            yield (x - radius, y), (x + radius, y), width / 2.0
        case _:
            return


def lengths_inside(boxes: FloatArray, segments: FloatArray, clear: float = CLEAR_MM) -> FloatArray:
    """Return the length of each of (m, 5) segments in each of (p, 4) boxes grown by a clearance, (p, m).

    Liang and Barsky's clipping; a segment with nan is in no box.
    """
    enter: FloatArray | float = 0.0
    leave: FloatArray | float = 1.0
    steps = segments[:, 2:4] - segments[:, :2]
    grown = segments[:, 4] + clear
    for axis in (0, 1):
        # A segment along the other axis never meets these sides: a tiny step puts them at infinity.
        step = np.where(np.abs(steps[:, axis]) < TINY_MM, TINY_MM, steps[:, axis])
        low = (boxes[:, None, axis] - grown - segments[:, axis]) / step
        high = (boxes[:, None, axis + 2] + grown - segments[:, axis]) / step
        enter = np.maximum(np.minimum(low, high), enter)
        leave = np.minimum(np.maximum(low, high), leave)
    lengths = np.hypot(steps[:, 0], steps[:, 1])
    return np.asarray(np.nan_to_num(np.maximum(leave - enter, 0.0) * lengths))


def _overlaps(boxes: FloatArray, taken: FloatArray, clear: float) -> FloatArray:
    """Return the overlap of (p, 4) boxes with (t, 4) others, mm plus one, (p, t); zero if apart."""
    low = np.maximum(boxes[:, None, :2], taken[:, :2])
    high = np.minimum(boxes[:, None, 2:], taken[:, 2:])
    depth = np.min(high - low, axis=2) + clear
    return np.where(depth > 0.0, depth + 1.0, 0.0)


# Letters of nodes ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Style:
    """Style of a figure's letters, and the radius of its points' marks."""

    size: float
    small: float
    colour: str
    radius: float

    def of(self, nodes: Sequence[str]) -> float:
        """Return the size: ends of components are written smaller."""
        return self.small if all("_" in node for node in nodes) else self.size


def letters(
    subject: Subject,
    nodes: dict[str, complex],
    drawn: Sequence[Shape],
    style: Style,
    others: Sequence[Wanted] = (),
) -> Iterator[Part]:
    """Place the letters of nodes, and other texts with them, clear of what is drawn."""
    middle = sum(nodes.values()) / len(nodes)
    points = list(_together(nodes))
    wanted = [
        Wanted(same[0], point(at), text, style.of(same), style.colour, style.radius, at - middle)
        for same, at in points
        for text in (_joined(subject, same),)
    ]
    standing = place_labels([*wanted, *others], drawn)
    for (same, _), one in zip(points, standing, strict=False):
        for k, node in enumerate(same):
            label = replace(one.label, text=_joined(subject, same[: k + 1]))
            yield Part(node, label, same[k + 1] if k + 1 < len(same) else "")
        if one.leader is not None:
            yield Part(same[0], one.leader)
    for one in standing[len(points) :]:
        for shape in one.shapes:
            yield Part(one.wanted.node, shape)


def _together(nodes: dict[str, complex]) -> Iterator[tuple[tuple[str, ...], complex]]:
    """Group nodes that coincide on paper."""
    left = dict(nodes)
    while left:
        at = next(iter(left.values()))
        same = tuple(node for node, place in left.items() if abs(place - at) <= TOUCHING_MM)
        yield same, at
        for node in same:
            del left[node]


def _joined(subject: Subject, nodes: Sequence[str]) -> tuple[Piece, ...]:
    """Join the letters of nodes that coincide."""
    pieces: list[Piece] = []
    for node in nodes:
        pieces += [*([Piece(", ")] if pieces else []), *subject.letter(node)]
    return tuple(pieces)


# Names of vectors ----------------------------------------------------------------------------------

VECTOR_GAP_MM = 0.6


def names_of_vectors(
    subject: Subject, nodes: dict[str, complex], drawn: Sequence[Shape], style: Style
) -> Iterator[Part]:
    """Place the name of each vector beside its middle; those with the same ends share a place."""
    together: dict[tuple[str, str], list[str]] = {}
    for vector in subject.plan.construction.vectors.values():
        if {vector.tail, vector.head} <= nodes.keys() and not subject.is_zero(vector.name):
            together.setdefault((vector.tail, vector.head), []).append(vector.name)
    wanted = [
        Wanted(head, point((nodes[tail] + nodes[head]) / 2.0), _joined(subject, names), style.small,
               style.colour, VECTOR_GAP_MM)
        for (tail, head), names in together.items()
    ]  # fmt: skip
    for one in place_labels(wanted, drawn):
        yield from (Part(one.wanted.node, shape) for shape in one.shapes)
