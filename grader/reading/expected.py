"""Expected figures with their errors, hypotheses of mistakes, and poses of a figure among the strokes."""

from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.lines import Lines
from grader.records import MECHANISM, FloatArray, Reason
from reference.construction.elements import Normal, Same, Scaled
from reference.construction.graph import Construction, bars, coincident, evaluate
from reference.construction.mistakes import (
    Drawing,
    Mistake,
    affected,
    commit,
    line_of,
    mistakes_of_forces,
    single_mistakes,
)
from reference.construction.steps import Given, Similar, Step
from reference.construction.uncertainty import acts_of
from reference.geometry import ComplexArray

STEP_OF_DERIVATIVE = 1e-5
"""Step of numerical derivatives, mm or rad: small against any curvature, large against rounding."""


SLIP = {"angle": float(np.radians(20.0)), "length": 1.5}
"""Standard errors of a short vector that is drawn wrongly in no known way, rad and mm."""


@dataclass(frozen=True, slots=True)
class DraftingErrors:
    """Standard errors of a student who draws without much care.

    Attributes
    ----------
    angle_rad, shift_mm : of a line's direction, and of its foot to the side
    length_mm, relative : of a length laid off, and in addition this share of it
    computed : that share of a length that is computed from others
    mark_mm : of a point's mark, along x and along y
    slipped : the node of a step, and the index of its line, that is drawn with larger errors
    """

    angle_rad: float = float(np.radians(0.8))
    shift_mm: float = 0.35
    length_mm: float = 0.7
    relative: float = 0.02
    computed: float = 0.04
    mark_mm: float = 0.15
    slipped: tuple[str, int] | None = None

    def of(self, step: Step, slot: int, kind: str, size_mm: float) -> float:
        """Return the standard error of one act of a step, mm or rad.

        Arguments: `slot`, `kind` as in `reference.construction.elements.Errors`; `size_mm` is the length
        that the step draws.
        """
        if (step.node, slot) == self.slipped and kind in SLIP:
            return SLIP[kind]
        match kind:
            case "angle":
                return self.angle_rad
            case "shift":
                return self.shift_mm
            case "length" if isinstance(step, Given):
                # A computed length is laid off after one more measurement than a given one.
                share = self.relative if isinstance(step.length, Scaled | Same) else self.computed
                return self.length_mm + share * size_mm
            case _:
                return self.length_mm if kind == "length" or isinstance(step, Similar) else self.mark_mm


@dataclass(frozen=True, slots=True)
class Pose:
    """The pose of a figure on the sheet.

    Attributes
    ----------
    at : its origin, complex mm
    size, turn_rad : relative to the expected figure, counter-clockwise
    score : share of the figure that has strokes there, 0..1
    """

    at: complex
    size: float
    turn_rad: float
    score: float


@dataclass(frozen=True, slots=True)
class Slack:
    """Standard errors of a figure's pose before its strokes are assigned."""

    shift_mm: float = 2.0
    turn_rad: float = float(np.radians(1.0))
    relative: float = 0.04


@dataclass(frozen=True, slots=True)
class Edge:
    """A straight piece of a figure between two of its nodes, by their index in the figure's list.

    An optional one, the sum of components, is drawn by few students.
    """

    name: str
    tail: int
    head: int
    optional: bool = False


@dataclass(frozen=True, slots=True)
class Expected:
    """Nodes expected of one figure.

    Attributes
    ----------
    names : nodes in order
    at : (n,) complex mm; a plan about its own pole until it is placed
    cov : (2n, 2n) covariance, x and y of each node in turn
    edges : what should be drawn between them
    tied : pairs of nodes that lie at one point
    """

    names: tuple[str, ...]
    at: ComplexArray
    cov: FloatArray
    edges: tuple[Edge, ...]
    tied: tuple[tuple[int, int], ...] = ()

    @property
    def required(self) -> list[int]:
        """Indices of the edges that have to be drawn."""
        return [index for index, edge in enumerate(self.edges) if not edge.optional]

    def length_mm(self, edge: Edge) -> float:
        """Return the expected length of an edge."""
        return float(abs(self.at[edge.head] - self.at[edge.tail]))

    def placed(self, pose: Pose, slack: Slack) -> "Expected":
        """Return the figure at a pose on the sheet, with the possible errors of the pose."""
        spin = pose.size * np.exp(1j * pose.turn_rad)
        arm = spin * self.at
        rotate = np.kron(np.eye(len(arm)), np.array([[spin.real, -spin.imag], [spin.imag, spin.real]]))
        everywhere = np.full(len(arm), slack.shift_mm)
        free = [everywhere, 1j * everywhere, 1j * slack.turn_rad * arm, slack.relative * arm]
        moves = np.column_stack([xy(move) for move in free])
        return replace(self, at=pose.at + arm, cov=rotate @ self.cov @ rotate.T + moves @ moves.T)


def expect(
    drawing: Drawing,
    figure: str,
    given: Mapping[str, ComplexArray],
    errors: DraftingErrors,
    edges: Iterable[Edge],
) -> Expected:
    """Return the nodes of one figure, from known nodes of others, with the covariance of drafting errors.

    Arguments: `given` are nodes that are already read, complex mm, by name.
    """
    construction, parameters = drawing.construction, drawing.parameters
    steps = construction.figures[figure]
    names = tuple(step.node for step in steps)
    acts = [(step, slot, kind) for step in steps for slot, kind in acts_of(step)]
    # The first column is drawn without an error, each other with one.
    columns = STEP_OF_DERIVATIVE * np.eye(len(acts), len(acts) + 1, 1)
    tried = {(step.node, slot, kind): row for (step, slot, kind), row in zip(acts, columns, strict=True)}
    bent = evaluate(construction, parameters, given=given, errors=tried, wanted=names)
    place = {name: complex(np.ravel(at)[0]) for name, at in bent.items()}
    deviation = [errors.of(step, slot, kind, _size_mm(step, place)) for step, slot, kind in acts]
    at = np.array([place[name] for name in names])
    with np.errstate(invalid="ignore"):
        drawn = np.stack([np.broadcast_to(bent[name], len(acts) + 1) for name in names])
        moves = drawn[:, 1:] - at[:, None]
    moves = np.where(np.isfinite(moves), moves, 0.0) / STEP_OF_DERIVATIVE * deviation
    slopes = np.stack([moves.real, moves.imag], axis=1).reshape(2 * len(names), -1)
    under = coincident(construction)
    tied = tuple((names.index(name), names.index(under[name])) for name in names if name in under)
    return Expected(names, at, slopes @ slopes.T, tuple(edges), tied)


def _size_mm(step: Step, place: Mapping[str, complex]) -> float:
    """Return the length that a step draws."""
    return abs(place[step.node] - place[step.start]) if isinstance(step, Given) else 0.0


def xy(values: ComplexArray) -> FloatArray:
    """Return (2n,) x and y in turn of (n,) complex numbers."""
    return np.column_stack([values.real, values.imag]).ravel()


def links_of(construction: Construction) -> tuple[Edge, ...]:
    """Return the links of a mechanism sketch: every bar that its steps draw between two joints."""
    index = {step.node: row for row, step in enumerate(construction.figures[MECHANISM])}
    return tuple(Edge(f"{tail}{head}", index[tail], index[head]) for tail, head in bars(construction))


def vectors_of(construction: Construction, figure: str, absent: Iterable[str] = ()) -> tuple[Edge, ...]:
    """Return the vectors of a plan, optional ones last, without those at nodes that are not drawn."""
    index = {step.node: row for row, step in enumerate(construction.figures[figure])}
    gone = set(absent)
    own = construction.vectors_of(figure)
    # Two opposite forces have one line.
    ends = [(vector.tail, vector.head) for vector in own if not vector.is_sum]
    again = {one.name for one in own if one.reversed and ends.count((one.tail, one.head)) > 1}
    return tuple(
        Edge(vector.name, index[tail], index[head], vector.is_sum or vector.name in again)
        for vector in sorted(own, key=lambda vector: vector.is_sum)
        for tail, head in [vector.arrow]
        if not {tail, head} & gone and vector.tail in index
    )


# Hypotheses of how a plan was drawn ----------------------------------------------------------------

REGULAR = ("as constructed", "plates by similarity")
"""Labels of the hypotheses without a mistake."""
COST_OF_SIMILARITY = 0.7
"""Nats for odds of one in two, against perpendiculars throughout."""
COST_OF_MISTAKE = 8.0
"""Nats: a third of plans have a mistake, one of some forty; strokes of one student err alike."""
LEFT_OUT = {"n": Reason("normal_left_out"), "k": Reason("coriolis_left_out")}
"""Reason by the first letter of the node at the end of a component left out."""
COST_OF_SLIP, SLIPPED_MM = 4.0, (2.0, 9.0)
"""Nats for a short vector drawn wrongly in no known way, and its expected lengths: the sides of its arrowhead
look like the right one's stroke."""
OF_THE_WHOLE = {"figure_rotated", "scale_wrong", "rpm_not_converted", "vector_missing"}
"""Mistakes that the search for the plan's pose finds anyway, because it turns and scales the plan."""


@dataclass(frozen=True, slots=True)
class PlanHypothesis:
    """One way in which the plan may have been drawn.

    Attributes
    ----------
    label : for people
    drawing : the construction as this student would follow it
    absent : nodes that are not drawn then, with the reason
    cost : nats, the prior cost before strokes are considered
    order : of a force polygon's sides, if it is not the usual one
    slipped : as in `DraftingErrors`
    """

    label: str
    drawing: Drawing
    absent: Mapping[str, Reason]
    cost: float
    order: tuple[int, ...] = ()
    slipped: tuple[str, int] | None = None

    def is_side(self, name: str) -> bool:
        """Return whether a similar triangle's side is drawn where the vector of this name would be."""
        reason = self.absent.get(self.drawing.construction.vectors[name].tail)
        return reason is not None and reason not in LEFT_OUT.values()


def regular(drawing: Drawing, figure: str) -> list[PlanHypothesis]:
    """Return the right hypotheses: by perpendiculars throughout, and with plates by similarity."""
    hypotheses = [PlanHypothesis(REGULAR[0], drawing, {}, 0.0)]
    changed, absent = _by_similarity(drawing.construction, figure)
    if changed is not drawing.construction:
        similar = Drawing(changed, drawing.parameters)
        hypotheses.append(PlanHypothesis(REGULAR[1], similar, absent, COST_OF_SIMILARITY))
    return hypotheses


def mistaken(base: PlanHypothesis, figure: str) -> Iterator[tuple[PlanHypothesis, Mistake]]:
    """Yield every single mistake that can be made on top of a hypothesis."""
    construction = base.drawing.construction
    own = frozenset(step.node for step in construction.figures[figure])
    of_forces = (one for one in mistakes_of_forces(base.drawing) if affected(one, construction) & own)
    for mistake in (*single_mistakes(base.drawing, figure), *of_forces):
        if mistake.code in OF_THE_WHOLE or mistake.at in base.absent:
            continue
        absent = dict(base.absent)
        if mistake.code == "normal_missing":
            absent[mistake.at] = LEFT_OUT[mistake.at[0]]
        try:
            changed = commit(mistake, base.drawing)
        except ValueError:
            continue
        label = " ".join([mistake.code, mistake.at, *mistake.other])
        label = label if base.label in REGULAR else f"{base.label}, {label}"
        cost = base.cost + COST_OF_MISTAKE
        yield replace(base, label=label, drawing=changed, absent=absent, cost=cost), mistake


def slipped(base: PlanHypothesis, expected: Expected) -> Iterator[tuple[PlanHypothesis, frozenset[str]]]:
    """Yield a plan with each of its short vectors drawn wrongly in no known way, and the nodes it moves."""
    construction = base.drawing.construction
    for edge in expected.edges:
        head, line = expected.names[edge.head], line_of(construction.vectors[edge.name], construction)
        if line is not None and SLIPPED_MM[0] < expected.length_mm(edge) < SLIPPED_MM[1]:
            slot = int(line == getattr(construction.step(head), "second", None))
            moved = frozenset(one for one in expected.names if head in construction.upstream(one))
            yield replace(base, slipped=(head, slot), cost=base.cost + COST_OF_SLIP), moved


def _by_similarity(construction: Construction, figure: str) -> tuple[Construction, dict[str, Reason]]:
    """Return the construction with every plate's image by similarity, and the nodes that vanish."""
    steps = {step.node: step for step in construction.figures[figure]}
    changed, absent = construction, {}
    for node, image in construction.images.items():
        if node not in steps or steps[node] == image:
            continue
        changed = changed.with_step(image)
        for vector in construction.vectors_of(figure):
            tail = steps.get(vector.tail)
            if vector.head == node and isinstance(tail, Given) and isinstance(tail.length, Normal):
                absent[vector.tail] = Reason("by_similarity", {"node": node})
    return changed, absent


def tied(hypothesis: PlanHypothesis) -> Construction:
    """Start vectors from the start of a component that was left out; a similar triangle's sides run so."""
    construction = hypothesis.drawing.construction
    vectors = dict(construction.vectors)
    for node in hypothesis.absent:
        step = construction.step(node)
        if not isinstance(step, Given):
            continue
        for name, vector in vectors.items():
            if vector.tail == node:
                vectors[name] = replace(vector, tail=step.start)
    return replace(construction, vectors=vectors)


def resized(drawing: Drawing, figure: str, size: float) -> dict[str, FloatArray]:
    """Return the parameters at the scale at which the plan is `size` times as large."""
    scale = next(v.scale for v in drawing.construction.vectors_of(figure))
    return {**drawing.parameters, scale: np.asarray(drawing.parameters[scale] / size)}


# Poses of a figure among the strokes ---------------------------------------------------------------

RESIDUAL_MM = 1.6
"""Standard residual of strokes at a roughly placed figure: a few drafting errors."""
RESIDUAL_PER_MM = 0.03
"""The same for each mm from the anchor of the figure: a degree of turn, and scale."""
HIGHEST_WEIGHT_MM = 40.0
"""Longer edges count no more than this: one long stroke must not decide alone."""
LEAST_EDGE_MM = 8.0
"""Shorter edges fit letters and arrowheads as well."""
OVERRUN_MM = 25.0
"""Largest excess of a stroke's length over its edge: lines extend past nodes."""
PROPOSING_EDGES = 4
"""Number of long edges of a figure that propose poses: one of them is nearly always drawn."""
SHORT_LIST = 60
"""Poses judged by all edges, by the rough score: the right one is far up."""
SAME_POSE_MM = 4.0
"""Poses that differ at no node by more than this are the same."""
PAIRS = 1 << 13
"""Segments and strokes compared at a time: their arrays stay in a processor's own cache."""
FARTHEST_SQUARED = 40.0
"""Squared sigmas: the fit of a stroke this far off is less than 3e-9."""
SPECK_MM = 2.0
"""Shorter edges have no usable direction."""


@dataclass(frozen=True, slots=True)
class Search:
    """The poses to try.

    Attributes
    ----------
    turns_rad : turns of the whole figure
    give_rad : freedom about each
    sizes : sizes relative to the expected; 0 stands for "as long as the stroke"
    smallest, largest : bounds of free sizes
    short_mm : how much shorter than its edge a stroke may be (links stop at joint circles)
    """

    turns_rad: tuple[float, ...] = (0.0,)
    give_rad: float = float(np.radians(3.0))
    sizes: tuple[float, ...] = (1.0,)
    smallest: float = 0.3
    largest: float = 3.0
    short_mm: float = 3.0


def poses(expected: Expected, lines: Lines, search: Search, count: int = 3) -> list[Pose]:
    """Return the best poses of a figure among the strokes, best first."""
    longest = _longest(expected)
    proposed = _proposals(expected, lines, search, longest)
    if not len(proposed):
        return []
    # The longest edges on long strokes give few proposals, which are then checked in full.
    rough = _scores(expected, lines, proposed, longest)
    proposed = proposed[np.argsort(-rough)[:SHORT_LIST]]
    scores = _scores(expected, lines, proposed, expected.required)
    return _apart(proposed, scores, float(np.abs(expected.at).max()), count)


def _longest(expected: Expected) -> list[int]:
    """Return indices of the longest edges."""
    edges = np.array(expected.required)
    size = np.nan_to_num([expected.length_mm(expected.edges[edge]) for edge in edges], posinf=0.0)
    order = np.argsort(-size)[:PROPOSING_EDGES]
    return [int(edges[row]) for row in order if size[row] >= LEAST_EDGE_MM]


def _proposals(expected: Expected, lines: Lines, search: Search, edges: Sequence[int]) -> FloatArray:
    """Return (m, 4) origin x, y, size, turn: each of the edges laid on each stroke."""
    proposed = [np.zeros((0, 4))]
    for edge in (expected.edges[index] for index in edges):
        ends = complex(expected.at[edge.tail]), complex(expected.at[edge.head])
        proposed.append(lay(ends, lines, search))
    return np.concatenate(proposed)


def lay(edge: tuple[complex, complex], lines: Lines, search: Search) -> FloatArray:
    """Return (m, 4) origin x, y, size, turn: an edge laid on each stroke."""
    laid = [np.zeros((0, 4))]
    # A stroke has no sense: it may lie either way.
    for start, end in ((lines.start, lines.end), (lines.end, lines.start)):
        turn_all = np.angle((end - start) / (edge[1] - edge[0]))
        for turn in search.turns_rad:
            rest = np.abs(np.angle(np.exp(1j * (turn_all - turn))))
            turned = np.flatnonzero(rest < search.give_rad)
            for size in search.sizes:
                laid.extend(_laid(edge, (start[turned], end[turned]), size, search))
    return np.concatenate(laid)


def _laid(
    edge: tuple[complex, complex], strokes: tuple[ComplexArray, ComplexArray], size: float, search: Search
) -> list[FloatArray]:
    """Return poses with the edge's tail on the stroke's start, and with its head on the stroke's end."""
    (tail, head), (start, end) = edge, strokes
    span = head - tail
    drawn = np.abs(end - start)
    if size > 0.0:
        wanted = size * abs(span)
        fits = (drawn > wanted * 0.9 - search.short_mm) & (drawn < wanted * 1.1 + OVERRUN_MM)
        sizes = np.full(len(drawn), size)
    else:
        sizes = drawn / abs(span)
        fits = (sizes > search.smallest) & (sizes < search.largest)
    sizes, start, end = sizes[fits], start[fits], end[fits]
    turn = np.angle((end - start) / span)
    spin = sizes * np.exp(1j * turn)
    origins = (start - spin * tail, end - spin * head)
    return [np.column_stack([at.real, at.imag, sizes, turn]) for at in origins]


def _scores(expected: Expected, lines: Lines, proposed: FloatArray, edges: Sequence[int]) -> FloatArray:
    """Return (m,) share of the figure's edges (by length, capped) that have a stroke, for every pose."""
    origin = proposed[:, 0] + 1j * proposed[:, 1]
    spin = proposed[:, 2] * np.exp(1j * proposed[:, 3])
    total, weights = np.zeros(len(proposed)), np.zeros(len(proposed))
    for edge in (expected.edges[index] for index in edges):
        tail, head = (origin + spin * expected.at[node] for node in (edge.tail, edge.head))
        size = np.abs(head - tail)
        if not np.isfinite(size).all():
            continue
        weight = np.minimum(size, HIGHEST_WEIGHT_MM) * (size > SPECK_MM)
        farthest = np.maximum(np.abs(tail - origin), np.abs(head - origin))
        long = lines.length > 0.3 * size.min()
        strokes = lines.start[long], lines.along[long], lines.length[long]
        total += weight * support(strokes, tail, head, RESIDUAL_MM + RESIDUAL_PER_MM * farthest)
        weights += weight
    return np.asarray(total / np.maximum(weights, 1e-9))


def support(
    strokes: tuple[ComplexArray, ComplexArray, FloatArray],
    tail: ComplexArray,
    head: ComplexArray,
    sigma: FloatArray,
) -> FloatArray:
    """Return how well the best stroke matches each segment, 0..1.

    Arguments: strokes' starts, directions and lengths (n,); segments (m,) with sigma mm (m,).
    """
    start, along, length = strokes
    support = np.zeros(len(tail))
    ends = np.stack([tail, head])
    # Distances of the ends from each stroke's line, less its own from the origin.
    across, off = np.stack([-along.imag, along.real]), (start * np.conj(along)).imag
    rows = max(1, PAIRS // max(1, len(start)))
    for first in range(0, len(tail), rows):
        part = slice(first, first + rows)
        from_tail, from_head = (xy(node[part]).reshape(-1, 2) @ across - off for node in ends)
        squared = from_tail**2 + from_head**2
        segment, stroke = np.nonzero(squared < FARTHEST_SQUARED * sigma[part, None] ** 2)
        one, other = ((ends[:, part][:, segment] - start[stroke]) * np.conj(along[stroke])).real
        low, high = np.minimum(one, other), np.maximum(one, other)
        shared = np.minimum(high, length[stroke]) - np.maximum(low, 0.0)
        true_span = np.abs(head[part] - tail[part])[segment]
        share = np.clip(shared / np.maximum(true_span, np.maximum(high - low, 1e-6)), 0.0, 1.0)
        fit = np.exp(-0.5 * squared[segment, stroke] / sigma[part][segment] ** 2) * share
        np.maximum.at(support[part], segment, fit)
    return support


def _apart(proposed: FloatArray, scores: FloatArray, radius: float, count: int) -> list[Pose]:
    """Return the best poses that differ from each other."""
    chosen: list[int] = []
    origin = proposed[:, 0] + 1j * proposed[:, 1]
    spin = proposed[:, 2] * np.exp(1j * proposed[:, 3])
    for index in np.argsort(-scores):
        apart = np.abs(origin[index] - origin[chosen]) + radius * np.abs(spin[index] - spin[chosen])
        if (apart > SAME_POSE_MM).all():
            chosen.append(int(index))
        if len(chosen) == count:
            break
    return [
        Pose(complex(origin[row]), float(proposed[row, 2]), float(proposed[row, 3]), float(scores[row]))
        for row in chosen
    ]
