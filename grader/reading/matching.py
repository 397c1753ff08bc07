"""Which stroke is which edge of a figure: a search that keeps the best partial explanations.

The nodes are a Gaussian belief. A stroke taken for an edge tells how far both its nodes lie off the
stroke's line (and, where the stroke ends at a node, where along it), which moves the belief of all
other nodes through their covariance (a Kalman update). Scores are log likelihoods against the same
stroke being there by chance, so that explanations with different numbers of strokes compare.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.expected import Expected
from grader.reading.lines import BoolArray, IntArray, Lines
from grader.records import FloatArray

BEAM = 10
REDRAW_MM = 0.3
"""How far a stroke misses the nodes that it joins, one standard error."""
GATE = 18.0
"""Squared Mahalanobis distance (two degrees of freedom) beyond which a stroke is not the edge."""
PENALTY_OF_THIN = 2.0
"""Nats against a line drawn thinner than vectors are: it is likelier one that they were constructed by."""
INVISIBLE_MM = 0.8
RUN_ON_FAR = 4e-4
"""Density per mm of ends anywhere: the stroke goes on as another edge, or as a line drawn through."""
COST_OF_SHARING = 0.3
RUN_ON_EXPLAINED = 3.0
"""Nats given back when a second edge explains why a stroke runs on past the first."""
LITTLE_COMMON = 0.4
SHARED_RADIUS2_MM2 = 1.0
"""Two edges share one stroke where their lines lie within about half a millimetre of each other."""


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
    row: int
    shared: bool
    ended: tuple[bool, bool]


def explain(  # noqa: PLR0913
    expected: Expected,
    lines: Lines,
    ends: Ends,
    beam: int = BEAM,
    kept: Mapping[int, int] | None = None,
    barred: tuple[int, int] | None = None,
) -> list[Explanation]:
    """The best explanations of a placed figure, best first.

    Arguments: `kept` are edges whose strokes are settled already (rows of `lines`, -1 for none);
    `barred` is an edge and a row that it must not take.
    """
    edges = expected.edges
    start = Explanation(
        expected,
        np.full(len(edges), -1),
        np.zeros(len(edges), dtype=bool),
        np.zeros((len(edges), 2), dtype=bool),
        0.0,
    )
    states = [start]
    settled = kept or {}
    order = _most_telling_first(expected)
    for edge in (*(one for one in order if one in settled), *(one for one in order if one not in settled)):
        choices = [
            choice for index, state in enumerate(states) for choice in _choices(state, index, edge, lines, ends)
        ]
        if barred is not None and edge == barred[0]:
            choices = [one for one in choices if one.row != barred[1]]
        if edge in settled:
            choices = [one for one in choices if one.row == settled[edge]] or choices
        choices.sort(key=lambda choice: -choice.score)
        states = _distinct([_taken(states[c.state], edge, c, lines, ends) for c in choices[: 2 * beam]], beam)
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
    if not np.isfinite(size):
        return [_Choice(index, state.score, -1, False, (False, False))]
    if size < INVISIBLE_MM:
        return [_Choice(index, state.score, -1, False, (False, False))]
    found = [_Choice(index, state.score + np.log(_missed(size)), -1, False, (False, False))]
    off, spread = _offsets(state.expected, tail, head, lines)
    distance, log_det = _mahalanobis(off, spread)
    turned = np.abs((lines.along * np.conj(span / size)).imag)
    near = np.flatnonzero((distance < GATE) & (turned < 0.7))  # noqa: PLR2004 - 45 degrees
    gains, ended, kept = _ends(state.expected, tail, head, lines.take(near), ends)
    near, off, spread = near[kept], off[near[kept]], spread[near[kept]]
    if not len(near):
        return found
    shared = _in_use(state, lines)[lines.members[near]].any(axis=1)
    chance = _log_chance(state.expected.at[tail] + span / 2.0, size, lines)
    own = -0.5 * distance[near] - 0.5 * log_det[near] - np.log(2 * np.pi) + np.log(size) + gains - chance
    own -= PENALTY_OF_THIN * lines.thin[near]
    wide_distance, wide_log_det = _mahalanobis(off, spread + 0.3**2 * np.eye(2))
    density = np.exp(-0.5 * (wide_distance + wide_log_det)) / (2 * np.pi)
    both = np.log(np.minimum(1.0, density * SHARED_RADIUS2_MM2) + 1e-12) - COST_OF_SHARING
    for place in np.flatnonzero(shared):
        both[place] += RUN_ON_EXPLAINED * _explains_run_on(state, lines, int(near[place]), tail, head)
    gains = state.score + np.where(shared, both, own)
    for place, row in enumerate(near):
        at_ends = (False, False) if shared[place] else (bool(ended[place, 0]), bool(ended[place, 1]))
        found.append(_Choice(index, float(gains[place]), int(row), bool(shared[place]), at_ends))
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


def _offsets(expected: Expected, tail: int, head: int, lines: Lines) -> tuple[FloatArray, FloatArray]:
    """(s, 2) distance of both nodes from each line, and their (s, 2, 2) covariance."""
    across = 1j * lines.along
    normal = np.column_stack([across.real, across.imag])
    off = np.column_stack([
        ((expected.at[node] - lines.start) * np.conj(lines.along)).imag for node in (tail, head)
    ])
    arm = np.column_stack([
        ((expected.at[node] - lines.middle) * np.conj(lines.along)).real for node in (tail, head)
    ])
    blocks = [[expected.cov[2 * a : 2 * a + 2, 2 * b : 2 * b + 2] for b in (tail, head)] for a in (tail, head)]
    spread = np.empty((len(lines), 2, 2))
    for a in (0, 1):
        for b in (0, 1):
            nodes = np.einsum("si,ij,sj->s", normal, blocks[a][b], normal)
            line = lines.se_offset**2 + lines.se_angle**2 * arm[:, a] * arm[:, b]
            spread[:, a, b] = nodes + line + (REDRAW_MM**2 if a == b else 0.0)
    return off, spread


def _mahalanobis(off: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    a, b, c = spread[:, 0, 0], spread[:, 0, 1], spread[:, 1, 1]
    det = np.maximum(a * c - b * b, 1e-9)
    distance = (c * off[:, 0] ** 2 - 2 * b * off[:, 0] * off[:, 1] + a * off[:, 1] ** 2) / det
    return distance, np.log(det)


def _ends(
    expected: Expected, tail: int, head: int, lines: Lines, ends: Ends
) -> tuple[FloatArray, BoolArray, IntArray]:
    """Log density of where strokes end, (n, 2) whether they end at the nodes, and which (n of s) cover the edge."""
    span = expected.at[head] - expected.at[tail]
    along = np.where((lines.along * np.conj(span)).real > 0, lines.along, -lines.along)
    place = np.column_stack([
        ((end - expected.at[tail]) * np.conj(along)).real for end in (lines.start, lines.end)
    ])
    first, last = place.min(axis=1), place.max(axis=1)
    size = (span * np.conj(along)).real
    kept = np.flatnonzero((last > 0.35 * size) & (first < 0.65 * size) & (last - first > 0.3 * size))
    along, size, gaps = along[kept], size[kept], np.column_stack([-first, last])[kept]
    gaps[:, 1] -= size
    direction = np.column_stack([along.real, along.imag])
    total, ended = np.zeros(len(kept)), np.zeros((len(kept), 2), dtype=bool)
    forward = (lines.along[kept] * np.conj(along)).real > 0
    own = lines.se_end[kept]
    errors = np.where(forward[:, None], own, own[:, ::-1])
    for slot, node in enumerate((tail, head)):
        block = expected.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]
        variance = np.einsum("si,ij,sj->s", direction, block, direction)
        variance += errors[:, slot] ** 2 + ends.at_mm**2
        score, ended[:, slot] = _end_score(gaps[:, slot], variance, ends)
        total += score
    return total, ended, kept


def _end_score(gap: FloatArray, variance: FloatArray, ends: Ends) -> tuple[FloatArray, BoolArray]:
    """Log density per mm of an end `gap` mm beyond its node."""
    sigma = np.sqrt(variance)
    at = ends.at_share * np.exp(-0.5 * gap**2 / variance) / (sigma * np.sqrt(2 * np.pi))
    # Beyond and short, smeared by what is not known of the node.
    reach = np.where(gap > 0, ends.beyond_mm, ends.short_mm)
    share = np.where(gap > 0, ends.beyond_share, ends.short_share)
    off = share * np.exp(-np.maximum(np.abs(gap) - sigma, 0.0) / reach) / (reach + sigma)
    return np.asarray(np.log(at + off + RUN_ON_FAR)), np.asarray(at > 2.0 * off)


def _taken(state: Explanation, edge: int, choice: _Choice, lines: Lines, ends: Ends) -> Explanation:
    """The state after the choice."""
    stroke, shared, ended = state.stroke.copy(), state.shared.copy(), state.ended.copy()
    stroke[edge], shared[edge], ended[edge] = choice.row, choice.shared, choice.ended
    if choice.row < 0:
        return replace(state, stroke=stroke, score=choice.score)
    seen = _updated(state.expected, edge, choice, lines, ends)
    return Explanation(seen, stroke, shared, ended, choice.score)


def _updated(expected: Expected, edge: int, choice: _Choice, lines: Lines, ends: Ends) -> Expected:
    """Kalman update by one stroke."""
    row, (tail, head) = choice.row, (expected.edges[edge].tail, expected.edges[edge].head)
    along = lines.along[row]
    count = 2 * len(expected.at)
    rows, values = [], []
    middle = lines.middle[row]
    arms = [((expected.at[node] - middle) * np.conj(along)).real for node in (tail, head)]
    noise = np.zeros((4, 4))
    loose = REDRAW_MM + (0.4 if choice.shared else 0.0)
    for slot, node in enumerate((tail, head)):
        h = np.zeros(count)
        h[2 * node : 2 * node + 2] = (-along.imag, along.real)
        rows.append(h)
        values.append(-((expected.at[node] - middle) * np.conj(along)).imag)
        for other in (0, 1):
            noise[slot, other] = lines.se_offset[row] ** 2 + lines.se_angle[row] ** 2 * arms[slot] * arms[other]
        noise[slot, slot] += loose**2
    for slot, node in enumerate((tail, head)):
        if not choice.ended[slot]:
            continue
        end, error = lines.nearer_end(row, complex(expected.at[node]))
        h = np.zeros(count)
        h[2 * node : 2 * node + 2] = (along.real, along.imag)
        noise[len(rows), len(rows)] = error**2 + ends.at_mm**2
        rows.append(h)
        values.append(((end - expected.at[node]) * np.conj(along)).real)
    design, innovation = np.array(rows), np.array(values)
    used = len(rows)
    projected = expected.cov @ design.T
    spread = design @ projected + noise[:used, :used]
    gain = np.linalg.solve(spread, projected.T).T
    step = gain @ innovation
    cov = expected.cov - gain @ projected.T
    return replace(expected, at=expected.at + step[0::2] + 1j * step[1::2], cov=(cov + cov.T) / 2.0)
