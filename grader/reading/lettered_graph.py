"""Read a plan as a lettered graph: junctions of strokes, letters beside them, strokes with heads between.

The nodes of a plan are searched one after another, in the order of its construction: each may be any junction
of the sheet. The evidence for a junction is its letter, the strokes with arrowheads that join it to the nodes
found before, and, as a prior but no condition, the position where the construction puts the node. So a plan
is read even if no known mistake explains it.
"""

from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.lines import Lines
from grader.records import HEAD_AHEAD, HEAD_BACK, FloatArray, IntArray
from reference.construction.elements import View
from reference.construction.graph import Vector, evaluate
from reference.construction.mistakes import Drawing
from reference.construction.steps import Given, Step
from reference.geometry import ComplexArray

LEAST_STROKE_MM, MOST_STROKE_MM = 2.0, 260.0
"""Strokes that may be vectors: shorter ones are parts of letters and arrowheads, longer ones frames."""
CLEAR_TIP = 0.3
"""Probability from which a tip is a junction."""
SAME_MM = 1.2
"""Ends of strokes closer than this meet in one node: drafting errors are smaller."""
MOST_JUNCTIONS = 500
"""A drawing has 100 to 300; of more, those with letters and long strokes come first."""
ON_LINE_MM, PAST_END_MM = 0.9, 1.5
"""Largest distance of a junction beside a stroke, and beyond its end, for the stroke to pass through it."""
HEAD_MM = 1.0
"""A head within this of a junction points to it."""
DRAWN = 0.95
"""Share of vectors that have a stroke from node to node."""
HEADED = 0.75
"""Probability that a head is reported at the head."""
WRONG_HEAD = 0.06
"""Probability that a head is reported at the tail."""
CHANCE_OF_HEAD = 0.2
"""Share of ends of other strokes that have a head."""
ENDS_HERE, RUNS_ON = 0.4, -0.7
"""Nats for a stroke that ends at the node, and for one that runs on."""
EXPECTED, NEAR_LINE, ANYWHERE = 0.6, 0.2, 0.2
"""Shares of nodes near the position that the construction gives, in its direction alone, and anywhere."""
PLACE_MM, PLACE_SHARE = 1.5, 0.05
"""Standard error of that position: two drafting errors, and this share of the distance to the node before."""
DIRECTION_RAD = float(np.radians(2.0))
"""Standard error of a direction of a short vector."""
AREA_MM2 = 120.0**2
"""Area of a plan: the other possible positions of a node."""
HIDDEN_NATS = 0.7
"""Nats for a node without a junction at its expected position: half the evidence for a visible one."""
ABSENT_NATS = -5.0
"""Nats for a component that is left out: one normal in a hundred."""
SAME_POINT_NATS = -1.0
"""For two nodes at one junction: vectors of length zero are rare."""
FIRST_MM = (5.0, 210.0)
"""Length of the first vector: its scale was chosen so that it can be measured on a sheet."""
BEST = 6
"""Number of graphs compared with strokes: they differ in a node or two."""
BEAM = 60
"""Partial graphs that are continued: an unread letter costs one rank, a crossing line some ten."""
SHORT_MM = 3.0
"""A shorter vector may have no stroke of its own."""


@dataclass(frozen=True, slots=True)
class LetteredGraph:
    """The nodes of a plan, found by letters, strokes and heads.

    Attributes
    ----------
    at : complex mm, by node
    absent : components that are left out
    unexpected : number of nodes that are not where the construction puts them
    nats : evidence, against junctions taken at random
    """

    at: Mapping[str, complex]
    absent: frozenset[str]
    unexpected: int
    nats: float


@dataclass(frozen=True, slots=True)
class _Junctions:
    """Points where strokes end or meet: positions (j,), and nats of a vector from each to each (j, j)."""

    at: ComplexArray
    joined: FloatArray


@dataclass(frozen=True, slots=True)
class _Graphs:
    """Partial graphs, a row each: positions of nodes by name (b,), their junctions (-1: none), and scores."""

    places: Mapping[str, ComplexArray]
    junction: Mapping[str, IntArray]
    unexpected: IntArray
    nats: FloatArray

    def take(self, rows: IntArray) -> "_Graphs":
        """Return some of the rows, also repeated."""
        places = {name: at[rows] for name, at in self.places.items()}
        junction = {name: index[rows] for name, index in self.junction.items()}
        return _Graphs(places, junction, self.unexpected[rows], self.nats[rows])

    def with_node(self, name: str, at: ComplexArray, junction: IntArray) -> "_Graphs":
        """Return the graphs with one node more."""
        places, junctions = {**self.places, name: at}, {**self.junction, name: junction}
        return replace(self, places=places, junction=junctions)


def lettered_graphs(
    lines: Lines,
    letter_nats: Callable[[str, ComplexArray], FloatArray],
    drawing: Drawing,
    figure: str,
    given: Mapping[str, ComplexArray],
    left_out: Collection[str] = (),
) -> list[LetteredGraph]:
    """Return the likeliest graphs of a plan, best first.

    Arguments
    ---------
    letter_nats : evidence of the letters for each of some points (j,) as the node of a name
    drawing : its construction with the student's parameters
    given : nodes of other figures that are already read, complex mm
    left_out : nodes that this construction omits
    """
    steps = drawing.construction.figures[figure]
    junctions = _junctions(lines)
    if len(junctions.at) < 2:
        return []
    exact = evaluate(drawing.construction, drawing.parameters, given=given)
    known = {name: exact[name].ravel() for name in exact.keys() - {step.node for step in steps}}
    vectors = [v for v in drawing.construction.polygon_of(figure) if not {v.tail, v.head} & set(left_out)]
    search = _GraphSearch(drawing, known, vectors, junctions)
    pole, *others = steps
    every = np.arange(len(junctions.at))
    score = letter_nats(pole.node, junctions.at)
    graphs = _Graphs({pole.node: junctions.at}, {pole.node: every}, np.zeros_like(every), score)
    for step in others:
        if step.node in left_out:
            nowhere = np.full(len(graphs.nats), HIDDEN)
            graphs = graphs.with_node(step.node, search.start(step, graphs), nowhere)
        else:
            graphs = search.continued(graphs, step, letter_nats(step.node, junctions.at))
    best = np.argsort(-graphs.nats, kind="stable")[:BEST]
    return [_graph(graphs, row, steps) for row in best.tolist()]


def _graph(graphs: _Graphs, row: int, steps: Sequence[Step]) -> LetteredGraph:
    at = {name: complex(places[row]) for name, places in graphs.places.items()}
    absent = frozenset(step.node for step in steps if graphs.junction[step.node][row] == ABSENT)
    return LetteredGraph(at, absent, int(graphs.unexpected[row]), float(graphs.nats[row]))


# One node more -------------------------------------------------------------------------------------

HIDDEN, ABSENT = -1, -2
"""Replace a junction: none is visible; the component is left out."""


@dataclass(frozen=True, slots=True)
class _GraphSearch:
    """The constants of the search: the drawing, nodes of other figures, the plan's vectors, the junctions."""

    drawing: Drawing
    known: Mapping[str, ComplexArray]
    vectors: Sequence[Vector]
    junctions: _Junctions

    def start(self, step: Step, graphs: _Graphs) -> ComplexArray:
        """Return (b,) the node from which the step's node is drawn."""
        if isinstance(step, Given):
            return graphs.places[step.start]
        tails = [v.tail for v in self.vectors if v.head == step.node and v.tail in graphs.places]
        return graphs.places[tails[0]] if tails else next(iter(graphs.places.values()))

    def continued(self, graphs: _Graphs, step: Step, letter_nats: FloatArray) -> _Graphs:
        """Return the best graphs with the step's node: at any junction, where it is expected, or left out."""
        at, count = self.junctions.at, len(graphs.nats)
        here = {
            **{name: np.broadcast_to(place, count) for name, place in self.known.items()},
            **graphs.places,
        }
        with np.errstate(invalid="ignore", divide="ignore"):
            expected = np.broadcast_to(step.place(View(here, self.drawing.parameters, {})), count)
        start = self.start(step, graphs)
        prior = _of_place(at, expected, start)
        hidden, absent = np.full(count, -np.inf), np.full(count, -np.inf)
        if len(graphs.places) == 1:
            size = np.abs(at - start[:, None])
            prior = np.where((size > FIRST_MM[0]) & (size < FIRST_MM[1]), prior, -np.inf)
        else:
            drawn = np.isfinite(expected)
            unseen = graphs.nats + self._bare(graphs, step.node, expected) + HIDDEN_NATS
            hidden = np.where(drawn, unseen, -np.inf)
            if isinstance(step, Given):
                absent = graphs.nats + ABSENT_NATS
        seen = graphs.nats[:, None] + letter_nats + prior + self._joined(graphs, step.node)
        everything = np.column_stack([seen, hidden, absent])
        best = np.argsort(-everything, axis=None, kind="stable")[:BEAM]
        best = best[np.isfinite(everything.ravel()[best])]
        row, choice = np.divmod(best, everything.shape[1])
        junction = np.where(choice < len(at), choice, np.where(choice == len(at), HIDDEN, ABSENT))
        place = np.where(junction == HIDDEN, expected[row], start[row])
        is_seen = junction >= 0
        place[is_seen] = at[junction[is_seen]]
        chosen = graphs.take(row).with_node(step.node, place, junction)
        odd = is_seen & (prior[row, np.maximum(junction, 0)] < 0.0)
        return replace(chosen, unexpected=chosen.unexpected + odd, nats=everything.ravel()[best])

    def _ended(self, graphs: _Graphs, node: str) -> Iterator[tuple[str, bool]]:
        """Return the other ends of vectors that join a node to the graphs, and whether it is the head."""
        for vector in self.vectors:
            if vector.head == node and vector.tail in graphs.places:
                yield vector.tail, True
            elif vector.tail == node and vector.head in graphs.places:
                yield vector.head, False

    def _joined(self, graphs: _Graphs, node: str) -> FloatArray:
        """Return (b, j) nats of the strokes that join each junction, as this node, to the graphs."""
        total = np.zeros((len(graphs.nats), len(self.junctions.at)))
        for other, is_head in self._ended(graphs, node):
            index = graphs.junction[other]
            joined = self.junctions.joined[index] if is_head else self.junctions.joined[:, index].T
            bare = _without_stroke(self.junctions.at - graphs.places[other][:, None])
            total += np.where((index >= 0)[:, None] & np.isfinite(joined), joined, bare)
        return total

    def _bare(self, graphs: _Graphs, node: str, at: ComplexArray) -> FloatArray:
        """Return (b,) nats of the node's vectors without any stroke, the node at its position."""
        ends = [graphs.places[other] for other, _ in self._ended(graphs, node)]
        return sum((_without_stroke(at - end) for end in ends), np.zeros(len(at)))


def _without_stroke(span: ComplexArray) -> FloatArray:
    """Return nats of vectors that have no stroke; short ones have none more often."""
    return np.asarray(
        np.log(1.0 - DRAWN) * np.minimum(np.nan_to_num(np.abs(span), nan=SHORT_MM) / SHORT_MM, 1.0)
    )


def _of_place(at: ComplexArray, expected: ComplexArray, start: ComplexArray) -> FloatArray:
    """Return (b, j) nats of a node's position relative to the expected one, against a random position."""
    away = np.abs(at - expected[:, None])
    reach = np.abs(expected - start)[:, None]
    sigma2 = PLACE_MM**2 + (PLACE_SHARE * reach) ** 2
    place = AREA_MM2 / (2.0 * np.pi * sigma2) * np.exp(-0.5 * away**2 / sigma2)
    span = at - start[:, None]
    size = np.abs(span)
    turn = np.abs((span * np.conj(expected - start)[:, None]).imag) / np.maximum(size * reach, 1e-9)
    spread = DIRECTION_RAD + PLACE_MM / np.maximum(size, 1.0)
    along = np.pi / (np.sqrt(2.0 * np.pi) * 2.0 * spread) * np.exp(-0.5 * (turn / spread) ** 2)
    known = np.isfinite(place) & np.isfinite(along)
    density = np.where(known, EXPECTED * place + NEAR_LINE * along + ANYWHERE, 1.0)
    return np.asarray(np.log(density))


# Junctions -----------------------------------------------------------------------------------------


def _junctions(lines: Lines) -> _Junctions:
    """Return points where strokes end or meet, and the strokes that join them."""
    usable = lines.take((lines.length > LEAST_STROKE_MM) & (lines.length < MOST_STROKE_MM))
    row, column = np.nonzero(usable.tip_sure > CLEAR_TIP)
    tips = usable.start[row] + usable.tip_along[row, column] * usable.along[row]
    at = _clusters(np.concatenate([usable.start, usable.end, tips]))[:MOST_JUNCTIONS]
    return _Junctions(at, _joined(at, usable))


def _clusters(points: ComplexArray) -> ComplexArray:
    """Return means of points that are close to one another, the largest groups first."""
    near = np.abs(points[:, None] - points) < SAME_MM
    count, left, means = near.sum(axis=1), np.ones(len(points), dtype=bool), []
    while left.any():
        fullest = near[np.argmax(np.where(left, count, 0))] & left
        means.append(points[fullest].mean())
        count = count - near[:, fullest].sum(axis=1)
        left &= ~fullest
    return np.array(means, dtype=complex)


def _joined(at: ComplexArray, lines: Lines) -> FloatArray:
    """Return (j, j) nats of a vector between junctions by the best stroke between them; -inf without one."""
    joined = np.full((len(at), len(at)), -np.inf)
    from_start = (at - lines.start[:, None]) * np.conj(lines.along)[:, None]
    on = (np.abs(from_start.imag) < ON_LINE_MM) & (from_start.real > -PAST_END_MM)
    on &= from_start.real < lines.length[:, None] + PAST_END_MM
    usual = np.log(DRAWN * max(len(at), 1) ** 2 / (2.0 * max(len(lines), 1)))
    for row in range(len(lines)):
        nodes = np.flatnonzero(on[row])
        if len(nodes) < 2:
            continue
        place = from_start.real[row, nodes]
        ends = np.minimum(np.abs(place), np.abs(place - lines.length[row])) < SAME_MM
        nats = usual + _heads(place, lines, row)
        nats = nats + np.where(ends, ENDS_HERE, RUNS_ON)[:, None] + np.where(ends, ENDS_HERE, RUNS_ON)
        nats[np.abs(place[:, None] - place) < LEAST_STROKE_MM] = -np.inf
        joined[np.ix_(nodes, nodes)] = np.maximum(joined[np.ix_(nodes, nodes)], nats)
    np.fill_diagonal(joined, SAME_POINT_NATS)
    return joined


def _heads(place: FloatArray, lines: Lines, row: int) -> FloatArray:
    """Return (n, n) nats of the heads on a stroke for vectors between positions along it (mm)."""
    tip, kind, sure = lines.tip_along[row], lines.tip_kind[row], lines.tip_sure[row]
    near = np.abs(tip - place[:, None]) < HEAD_MM
    ahead, back = (
        np.where(near & (kind == sort), sure, 0.0).max(axis=1, initial=0.0)
        for sort in (HEAD_AHEAD, HEAD_BACK)
    )
    forward = place > place[:, None]
    at_head = np.where(forward, ahead, back[None, :])
    at_tail = np.where(forward, back[:, None], ahead[:, None])
    return _odds(at_head, HEADED) + _odds(at_tail, WRONG_HEAD)


def _odds(sure: FloatArray, share: float) -> FloatArray:
    """Return nats of a head seen with a probability, if this share of vectors shows one."""
    seen, unseen = share / CHANCE_OF_HEAD, (1.0 - share) / (1.0 - CHANCE_OF_HEAD)
    return np.asarray(np.log(sure * seen + (1.0 - sure) * unseen))
