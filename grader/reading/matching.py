"""Strokes assigned to the lines of a figure, and how sure each assignment is."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.reading.expected import Edge, Expected
from grader.reading.lines import TIP_MM, BoolArray, Lines
from grader.records import FloatArray, IntArray
from reference.geometry import ComplexArray

REDRAW_MM = 0.3
"""How far a stroke misses the nodes that it joins, one standard error."""
SHARED_MM = 0.4
"""And further where it serves two edges, that lie this near to each other."""
END_MM, END_SHARE = 0.3, 0.4
RUN_ON_FAR = 4e-4
"""Density per mm of ends anywhere: the stroke goes on as another edge, or as a line drawn through."""
UNTOLD_MM = 1e5
"""Standard error of what an end tells that is not at its node: nothing."""


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
class Spans:
    """Beliefs of the two nodes that an edge joins, a row each.

    Attributes
    ----------
    tail, head : (s,) complex mm
    cov : (3, s, 3) covariances of the tail, of tail with head, of the head; each as xx, xy + yx, yy,
        so that its product with `_squares` of a direction is the covariance along that direction
    """

    tail: ComplexArray
    head: ComplexArray
    cov: FloatArray

    def take(self, rows: IntArray) -> "Spans":
        """Some of the rows, also repeated."""
        return Spans(self.tail[rows], self.head[rows], self.cov[:, rows])


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs of a figure's nodes, a row each.

    Attributes
    ----------
    at : (s, n) complex mm
    cov : (s, 2n, 2n) covariance, x and y of each node in turn
    """

    at: ComplexArray
    cov: FloatArray

    def take(self, rows: IntArray) -> "Beliefs":
        """Some of the rows, also repeated."""
        return Beliefs(self.at[rows], self.cov[rows])

    def spans(self, tail: int, head: int) -> Spans:
        """What is believed of an edge's nodes."""
        cov = np.empty((3, len(self.cov), 3))
        for pair, (one, other) in enumerate(((tail, tail), (tail, head), (head, head))):
            cov[pair, :, 0] = self.cov[:, 2 * one, 2 * other]
            cov[pair, :, 1] = self.cov[:, 2 * one, 2 * other + 1] + self.cov[:, 2 * one + 1, 2 * other]
            cov[pair, :, 2] = self.cov[:, 2 * one + 1, 2 * other + 1]
        return Spans(self.at[:, tail], self.at[:, head], cov)


def _squares(direction: ComplexArray) -> FloatArray:
    """(s, 3) of unit vectors: x^2, x y, y^2."""
    x, y = direction.real, direction.imag
    squares = np.empty((len(x), 3))
    squares[:, 0], squares[:, 1], squares[:, 2] = x * x, x * y, y * y
    return squares


def offsets(spans: Spans, lines: Lines) -> tuple[FloatArray, FloatArray]:
    """Distances of both nodes from each line (2, s, lines), and their covariances (3, s, lines).

    The covariances are those of the tail, of tail with head, and of the head.
    """
    nodes = np.stack([spans.tail, spans.head])[:, :, None]
    from_middle = (nodes - lines.middle) * np.conj(lines.along)
    spread = spans.cov @ _squares(1j * lines.along).T
    arm = from_middle.real
    for pair, (one, other) in enumerate(((0, 0), (0, 1), (1, 1))):
        spread[pair] += lines.se_offset**2 + lines.se_angle**2 * arm[one] * arm[other]
    spread[::2] += REDRAW_MM**2
    return from_middle.imag, spread


def mahalanobis(off: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Squared distances of pairs (2, ...) by their covariances (3, ...), and log determinants."""
    a, b, c = spread
    det = np.maximum(a * c - b * b, 1e-9)
    distance = (c * off[0] ** 2 - 2 * b * off[0] * off[1] + a * off[1] ** 2) / det
    return distance, np.log(det)


def ends_at(spans: Spans, lines: Lines, ends: Ends) -> tuple[FloatArray, BoolArray, BoolArray]:
    """How strokes end about the nodes of an edge, stroke by stroke (n,).

    Returns log densities (n,), whether they end at the nodes (n, 2), and whether they cover the edge (n,).
    """
    span = spans.head - spans.tail
    forward = (lines.along * np.conj(span)).real > 0
    along = np.where(forward, lines.along, -lines.along)
    ways = np.stack([lines.start, lines.end]) - spans.tail
    places = (ways * np.conj(along)).real
    first, last = places.min(axis=0), places.max(axis=0)
    size = (span * np.conj(along)).real
    covers = (last > 0.35 * size) & (first < 0.65 * size) & (last - first > 0.3 * size)
    errors = np.where(forward[:, None], lines.se_end, lines.se_end[:, ::-1])
    total, ended = np.zeros(len(lines)), np.zeros((len(lines), 2), dtype=bool)
    for slot, (node, gap) in enumerate(((spans.tail, -first), (spans.head, last - size))):
        around = (spans.cov[2 * slot] * _squares(along)).sum(axis=1)
        variance = around + errors[:, slot] ** 2 + ends.at_mm**2
        off, sure = _tips_off(lines, node, forward == bool(slot), head=slot == 1)
        score, ended[:, slot] = _end_score(gap, variance, ends, _marked(off, sure, variance))
        total += score
    return total, ended, covers


def _tips_off(
    lines: Lines, node: ComplexArray, ahead: BoolArray, *, head: bool
) -> tuple[FloatArray, FloatArray]:
    """How far tips lie off nodes along their strokes (n, t), and their probabilities."""
    tips, sure = lines.tips_towards(np.arange(len(lines)), ahead, head=head)
    return tips + ((lines.start - node) * np.conj(lines.along)).real[:, None], sure


def _marked(off: FloatArray, sure: FloatArray, variance: FloatArray) -> FloatArray:
    """Density per mm of tips `off` (n, t) mm from a node, with their probabilities."""
    spread = (variance + TIP_MM**2)[:, None]
    each = sure * np.exp(-0.5 * off**2 / spread) / np.sqrt(2.0 * np.pi * spread)
    return np.asarray(each.sum(axis=1))


def _end_score(
    gap: FloatArray, variance: FloatArray, ends: Ends, marked: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Log density per mm of an end `gap` mm beyond its node, with that of tips there."""
    sigma = np.sqrt(variance)
    at = ends.at_share * np.exp(-0.5 * gap**2 / variance) / (sigma * np.sqrt(2 * np.pi))
    # Beyond and short, smeared by what is not known of the node.
    reach = np.where(gap > 0, ends.beyond_mm, ends.short_mm)
    share = np.where(gap > 0, ends.beyond_share, ends.short_share)
    off = share * np.exp(-np.maximum(np.abs(gap) - sigma, 0.0) / reach) / (reach + sigma)
    return np.asarray(np.log(at + off + marked + RUN_ON_FAR)), np.asarray(at + marked > 2.0 * off)


def _seen_ends(spans: Spans, lines: Lines, slot: int) -> tuple[FloatArray, FloatArray]:
    """How far off its node a vector ends on its stroke (s,), with the standard error.

    It is the likelier of the ink's end and of tips.
    """
    node, other = (spans.head, spans.tail) if slot else (spans.tail, spans.head)
    back = np.conj(lines.along)
    ink = np.stack([lines.start, lines.end], axis=1) - node[:, None]
    nearer = np.abs(ink).argmin(axis=1)
    rows = np.arange(len(lines))
    error = lines.se_end[rows, nearer]
    off, sure = _tips_off(lines, node, ((node - other) * back).real > 0, head=slot == 1)
    # Rounding may leave a settled node a variance just below zero.
    around = np.maximum((spans.cov[2 * slot] * _squares(lines.along)).sum(axis=1), 0.0)
    off = np.column_stack([(ink[rows, nearer] * back).real, off])
    spread = around[:, None] + np.full(off.shape, TIP_MM**2)
    spread[:, 0] = around + error**2 + END_MM**2
    sure = np.column_stack([np.full(len(lines), END_SHARE), sure])
    best = (sure * np.exp(-0.5 * off**2 / spread) / np.sqrt(spread)).argmax(axis=1)
    return off[rows, best], np.where(best == 0, error, TIP_MM)


@dataclass(frozen=True, slots=True)
class Taken:
    """Strokes taken for one edge, one for each belief.

    Attributes
    ----------
    lines : the strokes, a row each
    shared : (s,) whether it serves another edge already
    ended : (s, 2) whether it ends at the edge's tail and at its head
    """

    lines: Lines
    shared: BoolArray
    ended: BoolArray


def updated(beliefs: Beliefs, edge: tuple[int, int], taken: Taken, ends: Ends) -> Beliefs:
    """The beliefs after a stroke was seen for an edge, given by its nodes (Kalman)."""
    lines, (tail, head) = taken.lines, edge
    along = lines.along
    spans = beliefs.spans(tail, head)
    nodes = np.column_stack([spans.tail, spans.head])
    from_middle = (nodes - lines.middle[:, None]) * np.conj(along)[:, None]
    seen = [_seen_ends(spans, lines, slot) for slot in (0, 1)]
    innovation = np.column_stack([-from_middle.imag, *(off for off, _ in seen)])
    noise = np.zeros((len(lines), 4, 4))
    arms = from_middle.real
    noise[:, :2, :2] = (lines.se_angle**2)[:, None, None] * arms[:, :, None] * arms[:, None, :]
    noise[:, :2, :2] += (lines.se_offset**2)[:, None, None]
    for slot, (_, error) in enumerate(seen):
        noise[:, slot, slot] += (REDRAW_MM + SHARED_MM * taken.shared) ** 2
        told = np.sqrt(error**2 + ends.at_mm**2)
        noise[:, 2 + slot, 2 + slot] = np.where(taken.ended[:, slot], told, UNTOLD_MM) ** 2
    return _corrected(beliefs, edge, _design(along), innovation, noise)


def _design(along: ComplexArray) -> FloatArray:
    """(s, 4, 4): tail and head (x, y each) across the line, then along it."""
    design = np.zeros((len(along), 4, 4))
    for first, way in ((0, 1j * along), (2, along)):
        for slot in (0, 1):
            design[:, first + slot, 2 * slot] = way.real
            design[:, first + slot, 2 * slot + 1] = way.imag
    return design


def _corrected(
    beliefs: Beliefs, edge: tuple[int, int], design: FloatArray, innovation: FloatArray, noise: FloatArray
) -> Beliefs:
    columns = [2 * edge[0], 2 * edge[0] + 1, 2 * edge[1], 2 * edge[1] + 1]
    projected = design @ beliefs.cov[:, columns]
    spread = projected[:, :, columns] @ design.transpose(0, 2, 1) + noise
    gain = np.linalg.solve(spread, projected)
    step = (innovation[:, None] @ gain)[:, 0]
    cov = beliefs.cov - projected.transpose(0, 2, 1) @ gain
    return Beliefs(beliefs.at + step[:, 0::2] + 1j * step[:, 1::2], (cov + cov.transpose(0, 2, 1)) / 2.0)


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
