"""What can be expected on a sheet: figures, hypotheses of mistakes, and poses of a figure on the strokes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.lines import Lines
from grader.records import FloatArray
from reference.construction.elements import Normal, Scaled
from reference.construction.graph import Construction, bars, coincident, evaluate
from reference.construction.mistakes import Drawing, Mistake, commit, single_mistakes
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from reference.geometry import ComplexArray

STEP_OF_DERIVATIVE = 1e-5


@dataclass(frozen=True, slots=True)
class Hand:
    """Standard errors of a hand that draws without much care."""

    angle_rad: float = float(np.radians(0.8))
    shift_mm: float = 0.35
    length_mm: float = 0.7
    relative: float = 0.02
    mark_mm: float = 0.15


@dataclass(frozen=True, slots=True)
class Edge:
    """A straight piece of a figure between two of its nodes, by their places in the figure's list."""

    name: str
    tail: int
    head: int
    drawn: bool = True
    """False for a helping line that nobody needs to draw (and whose absence costs nothing)."""


@dataclass(frozen=True, slots=True)
class Expected:
    """Nodes expected of one figure.

    Attributes
    ----------
    names : nodes in order
    at : (n,) complex mm; a plan about its own pole until it is placed
    cov : (2n, 2n) covariance, x and y of each node in turn
    edges : what should be drawn between them
    tied : pairs of nodes that lie in one place
    """

    names: tuple[str, ...]
    at: ComplexArray
    cov: FloatArray
    edges: tuple[Edge, ...]
    tied: tuple[tuple[int, int], ...] = ()

    def placed(self, at: complex, size: float, turn_rad: float, slack: "Slack") -> "Expected":
        """The same figure somewhere on the sheet, with the freedom left to it."""
        spin = size * np.exp(1j * turn_rad)
        moved = at + spin * self.at
        rotate = np.kron(np.eye(len(self.at)), np.array([[spin.real, -spin.imag], [spin.imag, spin.real]]))
        arm = moved - at
        free = np.column_stack(
            [
                _pairs(np.full(len(moved), slack.shift_mm + 0j)),
                _pairs(np.full(len(moved), slack.shift_mm * 1j)),
                _pairs(1j * slack.turn_rad * arm),
                _pairs(slack.relative * arm),
            ]
        )
        return replace(self, at=moved, cov=rotate @ self.cov @ rotate.T + free @ free.T)


@dataclass(frozen=True, slots=True)
class Slack:
    """How well a figure's place is known before its strokes are told apart."""

    shift_mm: float = 2.0
    turn_rad: float = float(np.radians(1.0))
    relative: float = 0.04


def expect(
    drawing: Drawing, figure: str, given: Mapping[str, ComplexArray], hand: Hand, edges: Iterable[Edge]
) -> Expected:
    """The nodes of one figure, given the nodes of others, with the covariance of a hand's errors."""
    construction, parameters = drawing.construction, drawing.parameters
    steps = construction.figures[figure]
    names = tuple(step.node for step in steps)
    nominal = evaluate(construction, parameters, given=given, wanted=names)
    sources = list(_sources(steps, nominal, hand))
    errors = {}
    for row, (key, _) in enumerate(sources):
        errors[key] = np.zeros(len(sources))
        errors[key][row] = STEP_OF_DERIVATIVE
    at = np.array([complex(np.ravel(nominal[name])[0]) for name in names])
    bent = evaluate(construction, parameters, given=given, errors=errors, wanted=names)
    with np.errstate(invalid="ignore"):
        moves = np.stack([np.broadcast_to(bent[name], len(sources)) for name in names]) - at[:, None]
    moves = np.where(np.isfinite(moves), moves, 0.0) / STEP_OF_DERIVATIVE
    moves = moves * np.array([sigma for _, sigma in sources])
    slopes = np.concatenate([_pairs(column)[:, None] for column in moves.T], axis=1) if sources else None
    cov = np.zeros((2 * len(names), 2 * len(names))) if slopes is None else slopes @ slopes.T
    under = coincident(construction)
    tied = tuple((names.index(one), names.index(under[one])) for one in names if one in under)
    return Expected(names, at, cov, tuple(edges), tied)


def _pairs(values: ComplexArray) -> FloatArray:
    """X and y in turn."""
    return np.column_stack([values.real, values.imag]).ravel()


def _sources(
    steps: Iterable[Step], nominal: Mapping[str, ComplexArray], hand: Hand
) -> Iterable[tuple[tuple[str, int, str], float]]:
    """Every error of the hand in these steps, with its standard error."""
    for step in steps:
        node = step.node
        if isinstance(step, Coincide):
            continue
        mark = hand.length_mm if isinstance(step, Similar) else hand.mark_mm
        yield (node, 0, "x"), mark
        yield (node, 0, "y"), mark
        match step:
            case Given():
                size = abs(complex(np.ravel(nominal[node])[0]) - complex(np.ravel(nominal[step.start])[0]))
                share = hand.relative if isinstance(step.length, Scaled) else 2.0 * hand.relative
                yield (node, 0, "length"), hand.length_mm + share * size
                yield (node, 0, "angle"), hand.angle_rad
                yield (node, 0, "shift"), hand.shift_mm
            case TwoLines():
                for slot in (0, 1):
                    yield (node, slot, "angle"), hand.angle_rad
                    yield (node, slot, "shift"), hand.shift_mm
            case TwoArcs():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 1, "length"), hand.length_mm
            case ArcAndLine():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 1, "angle"), hand.angle_rad
                yield (node, 1, "shift"), hand.shift_mm
            case Divide() | Tangent():
                yield (node, 0, "length"), hand.length_mm
            case Local() | OnGuide():
                yield (node, 0, "length"), hand.length_mm
                yield (node, 0, "angle"), hand.angle_rad
                yield (node, 0, "shift"), hand.shift_mm


# What is drawn between the nodes ------------------------------------------------------------------


def links_of(construction: Construction) -> tuple[Edge, ...]:
    """The links of a mechanism sketch: every bar that its steps lay between two joints."""
    steps = construction.figures["mechanism"]
    place = {step.node: index for index, step in enumerate(steps)}
    return tuple(Edge(f"{tail}{head}", place[tail], place[head]) for tail, head in bars(construction))


def vectors_of(construction: Construction, figure: str, absent: Iterable[str] = ()) -> tuple[Edge, ...]:
    """The vectors of a plan, without those at nodes that are not drawn."""
    steps = construction.figures[figure]
    place = {step.node: index for index, step in enumerate(steps)}
    gone = set(absent)
    return tuple(
        Edge(vector.name, place[vector.tail], place[vector.head])
        for vector in construction.vectors_of(figure)
        if not {vector.tail, vector.head} & gone and vector.tail in place
    )


REGULAR = ("as constructed", "plates by similarity")
COST_OF_SIMILARITY = 0.7
COST_OF_MISTAKE = 8.0
"""Nats: a third of plans have a mistake, one of some forty; and strokes of one hand err alike."""
LEFT_OUT = {
    "n": "not drawn: the normal component is left out",
    "k": "not drawn: the Coriolis component is left out",
}
"""By the first letter of the node in which the component ends."""
OF_THE_WHOLE = {"figure_rotated", "scale_wrong", "rpm_not_converted", "vector_missing"}


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One way in which the plan may have been drawn.

    Attributes
    ----------
    label : for people
    drawing : the construction as this student would follow it
    absent : nodes that are not drawn then, with the reason
    cost : nats, how unlikely before looking
    """

    label: str
    drawing: Drawing
    absent: Mapping[str, str]
    cost: float


def regular(drawing: Drawing, figure: str) -> list[Hypothesis]:
    """As it should be: by perpendiculars throughout, and with plates by similarity."""
    by_similarity = similar(drawing.construction, figure)
    told = [Hypothesis(REGULAR[0], drawing, {}, 0.0)]
    if by_similarity is not None:
        changed, absent = by_similarity
        told.append(Hypothesis(REGULAR[1], Drawing(changed, drawing.parameters), absent, COST_OF_SIMILARITY))
    return told


def mistaken(base: Hypothesis, figure: str) -> Iterator[tuple[Hypothesis, Mistake]]:
    """Every single mistake on top of a hypothesis; the search for its place turns and scales it anyway."""
    for mistake in single_mistakes(base.drawing, figure):
        if mistake.code in OF_THE_WHOLE or mistake.at in base.absent:
            continue
        gone = dict(base.absent)
        if mistake.code == "normal_missing":
            gone[mistake.at] = LEFT_OUT[mistake.at[0]]
        try:
            changed = commit(mistake, base.drawing)
        except ValueError:
            continue
        told = _told(mistake) if base.label in REGULAR else f"{base.label}, {_told(mistake)}"
        yield Hypothesis(told, changed, gone, base.cost + COST_OF_MISTAKE), mistake


def _told(mistake: Mistake) -> str:
    return " ".join([mistake.code, mistake.at, *mistake.other])


def similar(construction: Construction, figure: str) -> tuple[Construction, dict[str, str]] | None:
    """The construction with every plate's image by similarity, and the nodes that vanish."""
    steps = {step.node: step for step in construction.figures[figure]}
    changed, absent = construction, {}
    for node, image in construction.images.items():
        if node not in steps or steps[node] == image:
            continue
        changed = changed.with_step(image)
        for vector in construction.vectors_of(figure):
            tail = steps.get(vector.tail)
            if vector.head == node and isinstance(tail, Given) and isinstance(tail.length, Normal):
                absent[vector.tail] = f"not drawn: {node} found by similarity"
    return None if changed is construction else (changed, absent)


def tied(hypothesis: Hypothesis) -> Construction:
    """Vectors that would start from a normal component left out start where it would have started."""
    construction = hypothesis.drawing.construction
    vectors = dict(construction.vectors)
    for node, reason in hypothesis.absent.items():
        step = construction.step(node)
        if reason not in LEFT_OUT.values() or not isinstance(step, Given):
            continue
        for name, vector in vectors.items():
            if vector.tail == node:
                vectors[name] = replace(vector, tail=step.start)
    return replace(construction, vectors=vectors)


def resized(drawing: Drawing, figure: str, size: float) -> dict[str, FloatArray]:
    """The parameters at the scale at which the plan comes out `size` times as large."""
    scale = next(v.scale for v in drawing.construction.vectors_of(figure))
    return {**drawing.parameters, scale: np.asarray(drawing.parameters[scale] / size)}


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
