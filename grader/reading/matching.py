"""Which stroke is which edge of a figure: a search that keeps the best partial explanations.

The nodes are a Gaussian belief. A stroke taken for an edge tells how far both its nodes lie off the
stroke's line (and, where the stroke ends at a node, where along it), which moves the belief of all
other nodes through their covariance (a Kalman update). Scores are log likelihoods against the same
stroke being there by chance, so that explanations with different numbers of strokes compare.
Partial explanations are rows of arrays: an edge is held against the strokes for all of them at once.
"""

from collections.abc import Mapping
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


@dataclass(frozen=True, slots=True)
class _States:
    """Partial explanations, a row each, best first; the fields as in `Explanation`."""

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
    """What does not change while edges are matched; `near` has, by edge, the rows that it may be."""

    edges: tuple[Edge, ...]
    lines: Lines
    ends: Ends
    near: list[IntArray]


def explain(
    expected: Expected, lines: Lines, ends: Ends, beam: int = BEAM, settled: Settled | None = None
) -> list[Explanation]:
    """The best explanations of a placed figure, best first."""
    told = settled or Settled()
    count = len(expected.edges)
    belief = Beliefs(expected.at[None], expected.cov[None])
    scene = _Scene(expected.edges, lines, ends, _within_reach(belief, expected.edges, lines))
    states = _States(belief, np.full((1, count), -1), np.zeros((1, count), dtype=bool), np.zeros(1))
    for edge in sorted(_most_telling_first(expected), key=lambda one: one not in told.kept):
        choices = _ways_on(states, edge, scene, told)
        best = np.argsort(-choices.score, kind="stable")[: 2 * beam]
        states = _after(states, edge, choices.take(best), beam, scene)
    return [
        Explanation(replace(expected, at=at, cov=cov), stroke, shared, float(score))
        for at, cov, stroke, shared, score in zip(
            states.beliefs.at, states.beliefs.cov, states.stroke, states.shared, states.score, strict=True
        )
    ]


def _most_telling_first(expected: Expected) -> list[int]:
    """Long edges are mistaken for others least."""
    size = [abs(expected.at[edge.head] - expected.at[edge.tail]) for edge in expected.edges]
    return sorted(range(len(size)), key=lambda index: -size[index] if np.isfinite(size[index]) else 0.0)


def _within_reach(belief: Beliefs, edges: tuple[Edge, ...], lines: Lines) -> list[IntArray]:
    """For every edge the strokes that it may turn out to be."""
    tails, heads = (np.array([getattr(edge, end) for edge in edges], np.int64) for end in ("tail", "head"))
    off, spread = offsets(belief.spans(tails, heads), lines)
    fits = _along(belief.spans(tails, heads), lines, FIRST_TURN_SINE)
    return [np.flatnonzero(row) for row in fits & (mahalanobis(off, spread)[0] < FIRST_GATE)]


def _along(spans: Spans, lines: Lines, turn_sine: float) -> BoolArray:
    """Which lines go about the way of each edge (s, lines); none that of an edge too short to be seen."""
    span = (spans.head - spans.tail)[:, None]
    size = np.abs(span)
    turned = np.abs((lines.along * np.conj(span)).imag)
    return np.asarray((turned < turn_sine * size) & (size >= INVISIBLE_MM))


def _ways_on(states: _States, edge: int, scene: _Scene, told: Settled) -> _Choices:
    """What the edge may be, as far as it is not settled."""
    nothing = _nothing_taken(states, scene.edges[edge])
    row = told.kept.get(edge)
    if row is not None:
        kept = nothing if row < 0 else _strokes_taken(states, edge, np.array([row]), scene)
        if len(kept.row):
            return kept
    strokes = _strokes_taken(states, edge, scene.near[edge], scene)
    if told.barred is not None and edge == told.barred[0]:
        strokes = strokes.take(strokes.row != told.barred[1])
    return nothing + strokes


def _nothing_taken(states: _States, edge: Edge) -> _Choices:
    """Every state with no stroke for the edge."""
    count = len(states.score)
    size = np.abs(states.beliefs.at[:, edge.head] - states.beliefs.at[:, edge.tail])
    told = size >= INVISIBLE_MM
    score = states.score + np.where(told, np.log(_missed(size)), 0.0)
    free = np.zeros((count, 2), dtype=bool)
    return _Choices(np.arange(count), np.full(count, -1), free[:, 0], free, score)


def _strokes_taken(states: _States, edge: int, rows: IntArray, scene: _Scene) -> _Choices:
    """Every state with each of the strokes `rows` that the edge may be in it."""
    spans = states.beliefs.spans(scene.edges[edge].tail, scene.edges[edge].head)
    chance = _log_chance(spans, scene.lines)
    lines = scene.lines.take(rows)
    off, spread = offsets(spans, lines)
    distance, log_det = mahalanobis(off, spread)
    state, place = np.nonzero((distance < GATE) & _along(spans, lines, TURN_SINE))
    lines, spans = lines.take(place), spans.take(state)
    size = np.abs(spans.head - spans.tail)
    gains, ended, covers = ends_at(spans, lines, scene.ends)
    shared = _in_use(states, scene.lines)[state[:, None], lines.members].any(axis=1)
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
    """The states after the choices, best first, each set of strokes once."""
    stroke, shared = states.stroke[choices.state], states.shared[choices.state]
    stroke[:, edge], shared[:, edge] = choices.row, choices.shared
    rows = np.sort(np.unique(stroke, axis=0, return_index=True)[1])[:beam]
    choices, stroke, shared = choices.take(rows), stroke[rows], shared[rows]
    beliefs = states.beliefs.take(choices.state)
    taken = np.flatnonzero(choices.row >= 0)
    if len(taken):
        seen = Taken(scene.lines.take(choices.row[taken]), choices.shared[taken], choices.ended[taken])
        joined = (scene.edges[edge].tail, scene.edges[edge].head)
        moved = updated(beliefs.take(taken), joined, seen, scene.ends)
        beliefs.at[taken], beliefs.cov[taken] = moved.at, moved.cov
    return _States(beliefs, stroke, shared, choices.score)
