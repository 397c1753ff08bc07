"""Which stroke is which edge of a figure: a search that keeps the best partial explanations.

The nodes are a Gaussian belief. A stroke taken for an edge tells how far both its nodes lie off the
stroke's line (and, where the stroke ends at a node, where along it), which moves the belief of all
other nodes through their covariance (a Kalman update). Scores are log likelihoods against the same
stroke being there by chance, so that explanations with different numbers of strokes compare.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from grader.reading.belief import NOTHING, Ends, Taken, ends_at, mahalanobis, offsets, updated
from grader.reading.expected import Expected
from grader.reading.lines import BoolArray, Lines
from grader.records import IntArray

BEAM = 10
GATE = 18.0
"""Squared Mahalanobis distance (two degrees of freedom) beyond which a stroke is not the edge."""
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
    ended : (edges, 2) whether the stroke ends at the edge's tail and head
    score : log likelihood ratio, nats
    """

    expected: Expected
    stroke: IntArray
    shared: BoolArray
    ended: BoolArray
    score: float


@dataclass(frozen=True, slots=True)
class _Choice:
    state: int
    score: float
    taken: Taken = NOTHING


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


def explain(
    expected: Expected, lines: Lines, ends: Ends, beam: int = BEAM, settled: Settled | None = None
) -> list[Explanation]:
    """The best explanations of a placed figure, best first."""
    told = settled or Settled()
    edges = expected.edges
    start = Explanation(
        expected,
        np.full(len(edges), -1),
        np.zeros(len(edges), dtype=bool),
        np.zeros((len(edges), 2), dtype=bool),
        0.0,
    )
    states = [start]
    for edge in sorted(_most_telling_first(expected), key=lambda one: one not in told.kept):
        choices = [one for n, state in enumerate(states) for one in _choices(state, n, edge, lines, ends)]
        if told.barred is not None and edge == told.barred[0]:
            choices = [one for one in choices if one.taken.row != told.barred[1]]
        if edge in told.kept:
            choices = [one for one in choices if one.taken.row == told.kept[edge]] or choices
        choices.sort(key=lambda choice: -choice.score)
        states = _distinct([_after(states[c.state], edge, c, lines, ends) for c in choices[: 2 * beam]], beam)
    return states


def _distinct(states: list[Explanation], beam: int) -> list[Explanation]:
    found: dict[bytes, Explanation] = {}
    for state in states:
        found.setdefault(state.stroke.tobytes(), state)
    return list(found.values())[:beam]


def _most_telling_first(expected: Expected) -> list[int]:
    """Long edges are mistaken for others least."""
    size = [abs(expected.at[edge.head] - expected.at[edge.tail]) for edge in expected.edges]
    return sorted(range(len(size)), key=lambda index: -size[index] if np.isfinite(size[index]) else 0.0)


def _choices(state: Explanation, index: int, edge: int, lines: Lines, ends: Ends) -> list[_Choice]:
    tail, head = state.expected.edges[edge].tail, state.expected.edges[edge].head
    span = state.expected.at[head] - state.expected.at[tail]
    size = abs(span)
    if not np.isfinite(size) or size < INVISIBLE_MM:
        return [_Choice(index, state.score)]
    found = [_Choice(index, state.score + np.log(_missed(size)))]
    off, spread = offsets(state.expected, tail, head, lines)
    distance, log_det = mahalanobis(off, spread)
    turned = np.abs((lines.along * np.conj(span / size)).imag)
    near = np.flatnonzero((distance < GATE) & (turned < 0.7))
    gains, ended, kept = ends_at(state.expected, tail, head, lines.take(near), ends)
    near, off, spread = near[kept], off[near[kept]], spread[near[kept]]
    if not len(near):
        return found
    shared = np.asarray(_in_use(state, lines)[lines.members[near]].any(axis=1))
    chance = _log_chance(state.expected.at[tail] + span / 2.0, size, lines)
    own = -0.5 * distance[near] - 0.5 * log_det[near] - np.log(2 * np.pi) + np.log(size) + gains - chance
    own -= PENALTY_OF_THIN * lines.thin[near]
    wide_distance, wide_log_det = mahalanobis(off, spread + BAND_MM**2 * np.eye(2))
    density = np.exp(-0.5 * (wide_distance + wide_log_det)) / (2 * np.pi)
    both = np.log(np.minimum(1.0, density * SHARED_RADIUS2_MM2) + 1e-12) - COST_OF_SHARING
    for twice in np.flatnonzero(shared):
        both[twice] += RUN_ON_EXPLAINED * _explains_run_on(state, lines, int(near[twice]), tail, head)
    gains = state.score + np.where(shared, both, own)
    for place, row in enumerate(near.tolist()):
        at_ends = (False, False) if shared[place] else (bool(ended[place, 0]), bool(ended[place, 1]))
        taken = Taken(row, bool(shared[place]), at_ends)
        found.append(_Choice(index, float(gains[place]), taken))
    return found


def _in_use(state: Explanation, lines: Lines) -> BoolArray:
    """Which strokes, by their number, serve an edge already."""
    used = np.zeros(int(lines.members.max()) + 1, dtype=bool)
    used[lines.members[state.stroke[state.stroke >= 0]].ravel()] = True
    return used


def _explains_run_on(state: Explanation, lines: Lines, row: int, tail: int, head: int) -> bool:
    """Whether the edge lies where a stroke runs on past the edges that it was taken for."""
    along, own = lines.along[row], set(lines.members[row].tolist())

    def span(first: int, second: int) -> tuple[float, float]:
        ends = sorted(float((state.expected.at[node] * np.conj(along)).real) for node in (first, second))
        return ends[0], ends[1]

    low, high = span(tail, head)
    for edge, taken in zip(state.expected.edges, state.stroke.tolist(), strict=True):
        if taken >= 0 and own & set(lines.members[taken].tolist()):
            other = span(edge.tail, edge.head)
            if min(high, other[1]) - max(low, other[0]) > LITTLE_COMMON * (high - low):
                return False
    return True


def _log_chance(middle: complex, size: float, lines: Lines) -> float:
    """Log density of strokes of about this length that lie here for other reasons.

    Per mm across, per mm along, per radian and per mm of length: letters and arrowheads crowd about
    nodes, so that a short stroke in the right place tells little.
    """
    radius = max(8.0, 1.5 * size)
    shortest, longest = 0.4 * size, 2.5 * size + 4.0
    alike = (lines.length > shortest) & (lines.length < longest) & (np.abs(lines.middle - middle) < radius)
    count = float(np.count_nonzero(alike)) + 1.0
    return float(np.log(count / (np.pi * radius**2 * np.pi * (longest - shortest))))


def _missed(size_mm: float) -> float:
    """Probability that a drawn edge has no stroke of its own."""
    return float(np.interp(size_mm, [1.0, 2.0, 4.0, 8.0], [0.7, 0.4, 0.12, 0.04]))


def _after(state: Explanation, edge: int, choice: _Choice, lines: Lines, ends: Ends) -> Explanation:
    """The state after the choice."""
    stroke, shared, ended = state.stroke.copy(), state.shared.copy(), state.ended.copy()
    taken = choice.taken
    stroke[edge], shared[edge], ended[edge] = taken.row, taken.shared, taken.ended
    if taken.row < 0:
        return replace(state, stroke=stroke, score=choice.score)
    seen = updated(state.expected, edge, taken, lines, ends)
    return Explanation(seen, stroke, shared, ended, choice.score)
