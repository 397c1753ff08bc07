"""Which stroke is which edge of a figure: a search that keeps the best partial explanations.

The nodes are a Gaussian belief. A stroke taken for an edge tells how far both its nodes lie off the
stroke's line (and, where the stroke ends at a node, where along it), which moves the belief of all
other nodes through their covariance (a Kalman update). Scores are log likelihoods against the same
stroke being there by chance, so that explanations with different numbers of strokes compare.
Partial explanations are rows of arrays: an edge is held against the strokes for all of them at once.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.reading.belief import Beliefs, Ends, Spans, Taken, ends_at, mahalanobis, offsets, updated
from grader.reading.expected import Edge, Expected
from grader.reading.lines import BoolArray, Lines
from grader.records import FloatArray, IntArray

BEAM = 10
GATE = 18.0
"""Squared Mahalanobis distance (two degrees of freedom) beyond which a stroke is not the edge."""
FIRST_GATE = 60.0
"""The same before anything was seen: what is seen of other edges moves what is expected of this one."""
TURN_SINE, FIRST_TURN_SINE = 0.7, 0.85
"""Of the angle at which a stroke is not the edge."""
PENALTY_OF_THIN = 2.0
"""Nats against a line drawn thinner than vectors are: it is likelier one that they were constructed by."""
INVISIBLE_MM = 0.8
COST_OF_SHARING = 0.3
COST_OF_BARENESS = 1e3
"""Of leaving an edge without the stroke that is settled to be its own."""
RUN_ON_EXPLAINED = 3.0
"""Nats given back when a second edge explains why a stroke runs on past the first."""
LITTLE_COMMON = 0.4
BAND_MM = 0.3
"""How far from the middle of a band of ink either of two lines in it may lie."""
SHARED_RADIUS2_MM2 = 1.0
"""Two edges share one stroke where their lines lie within about half a millimetre of each other."""


@dataclass(frozen=True, slots=True)
class Explanation:
    """One explanation of a figure by strokes.

    Attributes
    ----------
    expected : the figure with nodes and covariance as seen so far
    stroke : (edges,) row of `Lines` taken for each edge, -1 for none
    shared : (edges,) whether the stroke serves another edge as well
    score : log likelihood ratio, nats
    """

    expected: Expected
    stroke: IntArray
    shared: BoolArray
    score: float


@dataclass(frozen=True, slots=True)
class Settled:
    """What is not open any more.

    Attributes
    ----------
    kept : the stroke of an edge (a row of `Lines`, -1 for none) by the edge's place
    barred : an edge and a row that it must not take
    """

    kept: Mapping[int, int] = field(default_factory=dict)
    barred: tuple[int, int] | None = None


OPEN = Settled()


@dataclass(frozen=True, slots=True)
class _States:
    """Partial explanations, a row each; `figure` says of which figure, else as in `Explanation`."""

    figure: IntArray
    beliefs: Beliefs
    stroke: IntArray
    shared: BoolArray
    score: FloatArray


@dataclass(frozen=True, slots=True)
class _Choices:
    """Ways on from states, a row each: the state, the row of `Lines` taken (-1 for none), and how."""

    state: IntArray
    row: IntArray
    shared: BoolArray
    ended: BoolArray
    score: FloatArray

    def take(self, rows: BoolArray | IntArray) -> "_Choices":
        """Some of them."""
        return _Choices(*(getattr(self, name)[rows] for name in self.__slots__))

    def __add__(self, other: "_Choices") -> "_Choices":
        return _Choices(
            *(np.concatenate([getattr(self, name), getattr(other, name)]) for name in self.__slots__)
        )


@dataclass(frozen=True, slots=True)
class _Scene:
    """What does not change while edges are matched.

    Attributes
    ----------
    edges, lines, ends : common to all figures
    may_be : (figures, edges, lines) whether a stroke may be an edge at all
    bare : (figures, edges) whether an edge may be left without a stroke
    """

    edges: tuple[Edge, ...]
    lines: Lines
    ends: Ends
    may_be: BoolArray
    bare: BoolArray


def explain(expected: Expected, lines: Lines, ends: Ends, beam: int = BEAM) -> list[Explanation]:
    """The best explanations of a placed figure, best first."""
    return explain_each([expected], lines, ends, beam)[0]


def explain_each(
    figures: Sequence[Expected],
    lines: Lines,
    ends: Ends,
    beam: int = BEAM,
    settled: Sequence[Settled] | None = None,
) -> list[list[Explanation]]:
    """The best explanations of each of several figures of the same edges, best first.

    They are looked for side by side, not against one another: each has `beam` of its own.
    """
    told = [OPEN] * len(figures) if settled is None else settled
    edges = figures[0].edges
    beliefs = Beliefs(np.array([one.at for one in figures]), np.array([one.cov for one in figures]))
    scene = _Scene(edges, lines, ends, *_open_ways(beliefs, edges, lines, told))
    shape = (len(figures), len(edges))
    states = _States(
        np.arange(len(figures)), beliefs, np.full(shape, -1), np.zeros(shape, bool), np.zeros(len(figures))
    )
    for edge in _most_telling_first(beliefs, edges, told):
        choices = _nothing_taken(states, edge, scene) + _strokes_taken(states, edge, scene)
        states = _after(states, edge, choices, beam, scene)
    found: list[list[Explanation]] = [[] for _ in figures]
    for row, figure in enumerate(states.figure.tolist()):
        seen = replace(figures[figure], at=states.beliefs.at[row], cov=states.beliefs.cov[row])
        found[figure].append(
            Explanation(seen, states.stroke[row], states.shared[row], float(states.score[row]))
        )
    return found


def _most_telling_first(beliefs: Beliefs, edges: Sequence[Edge], told: Sequence[Settled]) -> list[int]:
    """What is settled, then long edges: they are mistaken for others least."""
    size = [np.nan_to_num(abs(beliefs.at[:, edge.head] - beliefs.at[:, edge.tail])).mean() for edge in edges]
    kept = [sum(edge in one.kept for one in told) for edge in range(len(edges))]
    return sorted(range(len(edges)), key=lambda edge: (-kept[edge], -size[edge]))


def _open_ways(
    beliefs: Beliefs, edges: Sequence[Edge], lines: Lines, told: Sequence[Settled]
) -> tuple[BoolArray, BoolArray]:
    """`may_be` and `bare` of a scene: strokes within reach, as far as nothing is settled."""
    may_be = np.zeros((len(told), len(edges), len(lines)), dtype=bool)
    bare = np.ones((len(told), len(edges)), dtype=bool)
    for place, edge in enumerate(edges):
        spans = beliefs.spans(edge.tail, edge.head)
        distance = mahalanobis(*offsets(spans, lines))[0]
        may_be[:, place] = _along(spans, lines, FIRST_TURN_SINE) & (distance < FIRST_GATE)
    for figure, one in enumerate(told):
        for place, row in one.kept.items():
            reached = row >= 0 and bool(may_be[figure, place, row])
            if row < 0 or reached:
                may_be[figure, place] = np.arange(len(lines)) == row
                bare[figure, place] = not reached
        if one.barred is not None:
            may_be[figure, one.barred[0], one.barred[1]] = False
    return may_be, bare


def _along(spans: Spans, lines: Lines, turn_sine: float) -> BoolArray:
    """Which lines go about the way of each edge (s, lines); none that of an edge too short to be seen."""
    span = (spans.head - spans.tail)[:, None]
    size = np.abs(span)
    turned = np.abs((lines.along * np.conj(span)).imag)
    return np.asarray((turned < turn_sine * size) & (size >= INVISIBLE_MM))


def _nothing_taken(states: _States, edge: int, scene: _Scene) -> _Choices:
    """Every state with no stroke for the edge."""
    count = len(states.score)
    tail, head = scene.edges[edge].tail, scene.edges[edge].head
    size = np.abs(states.beliefs.at[:, head] - states.beliefs.at[:, tail])
    seen = size >= INVISIBLE_MM
    cost = np.where(seen, -np.log(_missed(size)), 0.0)
    cost += np.where(scene.bare[states.figure, edge], 0.0, COST_OF_BARENESS)
    free = np.zeros((count, 2), dtype=bool)
    return _Choices(np.arange(count), np.full(count, -1), free[:, 0], free, states.score - cost)


def _strokes_taken(states: _States, edge: int, scene: _Scene) -> _Choices:
    """Every state with each of the strokes that the edge may be in it."""
    may_be = scene.may_be[states.figure, edge]
    rows = np.flatnonzero(may_be.any(axis=0))
    spans = states.beliefs.spans(scene.edges[edge].tail, scene.edges[edge].head)
    chance = _log_chance(spans, scene.lines)
    lines = scene.lines.take(rows)
    off, spread = offsets(spans, lines)
    distance, log_det = mahalanobis(off, spread)
    state, place = np.nonzero((distance < GATE) & _along(spans, lines, TURN_SINE) & may_be[:, rows])
    lines, spans = lines.take(place), spans.take(state)
    size = np.abs(spans.head - spans.tail)
    gains, ended, covers = ends_at(spans, lines, scene.ends)
    shared = np.asarray(_in_use(states, scene.lines)[state[:, None], lines.members].any(axis=1))
    own = -0.5 * (distance + log_det)[state, place] - np.log(2 * np.pi) + np.log(size) + gains - chance[state]
    own -= PENALTY_OF_THIN * lines.thin
    both = _log_of_sharing(off[:, state, place], spread[:, state, place])
    for one in np.flatnonzero(shared & covers):
        both[one] += RUN_ON_EXPLAINED * _explains_run_on(states, state[one], edge, rows[place[one]], scene)
    score = states.score[state] + np.where(shared, both, own)
    return _Choices(state, rows[place], shared, ended & ~shared[:, None], score).take(covers)


def _log_of_sharing(off: FloatArray, spread: FloatArray) -> FloatArray:
    """Log likelihood of edges lying on strokes that serve others already."""
    distance, log_det = mahalanobis(off, spread + np.array([BAND_MM**2, 0.0, BAND_MM**2])[:, None])
    density = np.exp(-0.5 * (distance + log_det)) / (2 * np.pi)
    return np.asarray(np.log(np.minimum(1.0, density * SHARED_RADIUS2_MM2) + 1e-12) - COST_OF_SHARING)


def _in_use(states: _States, lines: Lines) -> BoolArray:
    """Which strokes, by their number, serve an edge already (s, strokes)."""
    used = np.zeros((len(states.score), int(lines.members.max(initial=0)) + 1), dtype=bool)
    state, edge = np.nonzero(states.stroke >= 0)
    used[state[:, None], lines.members[states.stroke[state, edge]]] = True
    return used


def _explains_run_on(states: _States, state: int, edge: int, row: int, scene: _Scene) -> bool:
    """Whether the edge lies where a stroke runs on past the edges that it was taken for."""
    place = (states.beliefs.at[state] * np.conj(scene.lines.along[row])).real.tolist()
    stroke, own = states.stroke[state].tolist(), set(scene.lines.members[row].tolist())
    low, high = sorted((place[scene.edges[edge].tail], place[scene.edges[edge].head]))
    for other, taken in zip(scene.edges, stroke, strict=True):
        if taken >= 0 and own & set(scene.lines.members[taken].tolist()):
            first, last = sorted((place[other.tail], place[other.head]))
            if min(high, last) - max(low, first) > LITTLE_COMMON * (high - low):
                return False
    return True


def _log_chance(spans: Spans, lines: Lines) -> FloatArray:
    """Log density of strokes of about an edge's length that lie there for other reasons (s,).

    Per mm across, per mm along, per radian and per mm of length: letters and arrowheads crowd about
    nodes, so that a short stroke in the right place tells little.
    """
    size = np.abs(spans.head - spans.tail)
    middle = (spans.head + spans.tail) / 2.0
    radius = np.maximum(8.0, 1.5 * size)
    shortest, longest = 0.4 * size, 2.5 * size + 4.0
    alike = (lines.length > shortest[:, None]) & (lines.length < longest[:, None])
    alike &= np.abs(lines.middle - middle[:, None]) < radius[:, None]
    count = np.count_nonzero(alike, axis=1) + 1.0
    return np.asarray(np.log(count / (np.pi * radius**2 * np.pi * (longest - shortest))))


def _missed(size_mm: FloatArray) -> FloatArray:
    """Probability that a drawn edge has no stroke of its own."""
    return np.interp(size_mm, [1.0, 2.0, 4.0, 8.0], [0.7, 0.4, 0.12, 0.04])


def _after(states: _States, edge: int, choices: _Choices, beam: int, scene: _Scene) -> _States:
    """The best states of each figure after the choices, best first, each set of strokes once."""
    figure = states.figure[choices.state]
    order = np.lexsort((-choices.score, figure))
    order = order[_first_of_each(figure[order], 2 * beam)]
    choices, figure = choices.take(order), figure[order]
    stroke, shared = states.stroke[choices.state], states.shared[choices.state]
    stroke[:, edge], shared[:, edge] = choices.row, choices.shared
    rows = np.sort(np.unique(np.column_stack([figure, stroke]), axis=0, return_index=True)[1])
    rows = rows[_first_of_each(figure[rows], beam)]
    choices = choices.take(rows)
    beliefs = states.beliefs.take(choices.state)
    taken = np.flatnonzero(choices.row >= 0)
    if len(taken):
        seen = Taken(scene.lines.take(choices.row[taken]), choices.shared[taken], choices.ended[taken])
        joined = (scene.edges[edge].tail, scene.edges[edge].head)
        moved = updated(beliefs.take(taken), joined, seen, scene.ends)
        beliefs.at[taken], beliefs.cov[taken] = moved.at, moved.cov
    return _States(figure[rows], beliefs, stroke[rows], shared[rows], choices.score)


def _first_of_each(sorted_figures: IntArray, count: int) -> BoolArray:
    """Which rows are among the first so many of their figure."""
    rank = np.arange(len(sorted_figures)) - np.searchsorted(sorted_figures, sorted_figures)
    return np.asarray(rank < count)
