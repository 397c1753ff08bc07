"""The assignment of strokes to the edges of a figure, and its likelihood."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.reading.expected import Edge, Expected
from grader.reading.lines import TIP_MM, BoolArray, Lines
from grader.records import FloatArray, IntArray
from reference.geometry import ComplexArray

REDRAW_MM = 0.3
"""Standard error of a stroke's distance from the nodes that it joins."""
SHARED_MM = 0.4
"""Added to it if one stroke serves two edges."""
END_MM, END_SHARE = 0.3, 0.4
"""The ink's end as the mark of a node: standard error along, and share of vectors that end with it."""
RUN_ON_FAR = 4e-4
"""Density per mm of ends elsewhere: the stroke continues as another edge, or as a line drawn through."""
UNKNOWN_MM = 1e5
"""Standard error along a stroke that does not end at the node: nothing is known."""


@dataclass(frozen=True, slots=True)
class EndPrior:
    """Prior for ends of strokes at nodes: shares of ends at, beyond and short of the node, and distances."""

    at_mm: float = 0.3
    at_share: float = 0.57
    beyond_mm: float = 3.0
    beyond_share: float = 0.36
    short_mm: float = 1.5
    short_share: float = 0.07
    marked_share: float = 0.0
    """Share of ends on a stroke that serves two edges that a tip shows."""


@dataclass(frozen=True, slots=True)
class Spans:
    """Beliefs about the two nodes that an edge joins, a row each.

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
        """Return some of the rows, also repeated."""
        return Spans(self.tail[rows], self.head[rows], self.cov[:, rows])


@dataclass(frozen=True, slots=True)
class Beliefs:
    """Beliefs about a figure's nodes, a row each.

    Attributes
    ----------
    at : (s, n) complex mm
    cov : (s, 2n, 2n) covariance, x and y of each node in turn
    """

    at: ComplexArray
    cov: FloatArray

    def take(self, rows: IntArray) -> "Beliefs":
        """Return some of the rows, also repeated."""
        return Beliefs(self.at[rows], self.cov[rows])

    def spans(self, tail: int, head: int) -> Spans:
        """Return the beliefs about an edge's two nodes."""
        cov = np.empty((3, len(self.cov), 3))
        for pair, (p, q) in enumerate(((tail, tail), (tail, head), (head, head))):
            cov[pair, :, 0] = self.cov[:, 2 * p, 2 * q]
            cov[pair, :, 1] = self.cov[:, 2 * p, 2 * q + 1] + self.cov[:, 2 * p + 1, 2 * q]
            cov[pair, :, 2] = self.cov[:, 2 * p + 1, 2 * q + 1]
        return Spans(self.at[:, tail], self.at[:, head], cov)


def _squares(direction: ComplexArray) -> FloatArray:
    """Return (s, 3) products of unit vectors: x^2, x y, y^2."""
    x, y = direction.real, direction.imag
    squares = np.empty((len(x), 3))
    squares[:, 0], squares[:, 1], squares[:, 2] = x * x, x * y, y * y
    return squares


def line_residuals(spans: Spans, lines: Lines) -> tuple[FloatArray, FloatArray]:
    """Return distances of both nodes from each line (2, s, lines), and covariances (3, s, lines).

    The covariances are those of the tail, of tail with head, and of the head.
    """
    nodes = np.stack([spans.tail, spans.head])[:, :, None]
    from_middle = (nodes - lines.middle) * np.conj(lines.along)
    spread = spans.cov @ _squares(1j * lines.along).T
    arm = from_middle.real
    for pair, (p, q) in enumerate(((0, 0), (0, 1), (1, 1))):
        spread[pair] += lines.se_offset**2 + lines.se_angle**2 * arm[p] * arm[q]
    spread[::2] += REDRAW_MM**2
    return from_middle.imag, spread


def mahalanobis(residual: FloatArray, spread: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return squared distances of pairs (2, ...) by their covariances (3, ...), and log determinants."""
    a, b, c = spread
    det = np.maximum(a * c - b * b, 1e-9)
    distance = (c * residual[0] ** 2 - 2 * b * residual[0] * residual[1] + a * residual[1] ** 2) / det
    return distance, np.log(det)


def ends_at(spans: Spans, lines: Lines, prior: EndPrior) -> tuple[FloatArray, BoolArray, BoolArray]:
    """Return how each stroke ends near the nodes of its edge; arguments of n rows each.

    Returns log densities (n,), whether it ends at the tail and at the head (n, 2), and whether it covers the
    edge (n,).
    """
    span = spans.head - spans.tail
    forward = (lines.along * np.conj(span)).real > 0
    along = np.where(forward, lines.along, -lines.along)
    places = ((np.stack([lines.start, lines.end]) - spans.tail) * np.conj(along)).real
    first, last = places.min(axis=0), places.max(axis=0)
    size = (span * np.conj(along)).real
    covers = (last > 0.35 * size) & (first < 0.65 * size) & (last - first > 0.3 * size)
    errors = np.where(forward[:, None], lines.se_end, lines.se_end[:, ::-1])
    total, ended = np.zeros(len(lines)), np.zeros((len(lines), 2), dtype=bool)
    for slot, (node, gap) in enumerate(((spans.tail, -first), (spans.head, last - size))):
        around = (spans.cov[2 * slot] * _squares(along)).sum(axis=1)
        variance = around + errors[:, slot] ** 2 + prior.at_mm**2
        tips, sure = _tips_from(lines, node, forward == bool(slot), head=slot == 1)
        score, ended[:, slot] = _end_score(gap, variance, prior, _tip_density(tips, sure, variance))
        total += score
    return total, ended, covers


def _tips_from(
    lines: Lines, node: ComplexArray, ahead: BoolArray, *, head: bool
) -> tuple[FloatArray, FloatArray]:
    """Return distances of tips from nodes along their strokes (n, t), mm, and their probabilities."""
    tips, sure = lines.tips_towards(np.arange(len(lines)), ahead, head=head)
    return tips + ((lines.start - node) * np.conj(lines.along)).real[:, None], sure


def _tip_density(tips: FloatArray, sure: FloatArray, variance: FloatArray) -> FloatArray:
    """Return the density per mm of tips (n, t) mm from a node, with their probabilities."""
    spread = (variance + TIP_MM**2)[:, None]
    each = sure * np.exp(-0.5 * tips**2 / spread) / np.sqrt(2.0 * np.pi * spread)
    return np.asarray(each.sum(axis=1))


def _end_score(
    gap: FloatArray, variance: FloatArray, prior: EndPrior, marked: FloatArray
) -> tuple[FloatArray, BoolArray]:
    """Return the log density per mm of an end `gap` mm beyond its node, and whether it is the node's.

    Arguments: `marked` is the density of tips there.
    """
    sigma = np.sqrt(variance)
    at = prior.at_share * np.exp(-0.5 * gap**2 / variance) / (sigma * np.sqrt(2 * np.pi))
    # Beyond and short, smeared by the node's own error.
    reach = np.where(gap > 0, prior.beyond_mm, prior.short_mm)
    share = np.where(gap > 0, prior.beyond_share, prior.short_share)
    elsewhere = share * np.exp(-np.maximum(np.abs(gap) - sigma, 0.0) / reach) / (reach + sigma)
    score = np.log(at + elsewhere + marked + RUN_ON_FAR)
    return np.asarray(score), np.asarray(at + marked > 2.0 * elsewhere)


def _vector_ends(spans: Spans, lines: Lines, slot: int) -> tuple[FloatArray, FloatArray]:
    """Return how far from its node a vector ends on its stroke (s,), mm, with the standard error.

    The end is the likeliest of the ink's end and of tips. `slot` is 0 for the tail, 1 for the head.
    """
    node, other = (spans.head, spans.tail) if slot else (spans.tail, spans.head)
    back = np.conj(lines.along)
    ink = np.stack([lines.start, lines.end], axis=1) - node[:, None]
    nearer = np.abs(ink).argmin(axis=1)
    rows = np.arange(len(lines))
    error = lines.se_end[rows, nearer]
    tips, sure = _tips_from(lines, node, ((node - other) * back).real > 0, head=slot == 1)
    # Rounding may leave a settled node a variance just below zero.
    around = np.maximum((spans.cov[2 * slot] * _squares(lines.along)).sum(axis=1), 0.0)
    gap = np.column_stack([(ink[rows, nearer] * back).real, tips])
    spread = around[:, None] + np.full(gap.shape, TIP_MM**2)
    spread[:, 0] = around + error**2 + END_MM**2
    sure = np.column_stack([np.full(len(lines), END_SHARE), sure])
    best = (sure * np.exp(-0.5 * gap**2 / spread) / np.sqrt(spread)).argmax(axis=1)
    return gap[rows, best], np.where(best == 0, error, TIP_MM)


def updated(
    beliefs: Beliefs, edge: tuple[int, int], lines: Lines, shared: BoolArray, ended: BoolArray, at_mm: float
) -> Beliefs:
    """Return the beliefs after assigning a stroke to an edge, one for each belief (a Kalman update).

    Arguments
    ---------
    edge : its tail and head, as indices of nodes
    lines, shared : (s,) the strokes, and whether each serves another edge already
    ended : (s, 2) whether the stroke ends at the edge's tail and at its head
    at_mm : standard error of such an end in addition to that of the ink
    """
    along, spans = lines.along, beliefs.spans(*edge)
    nodes = np.column_stack([spans.tail, spans.head])
    from_middle = (nodes - lines.middle[:, None]) * np.conj(along)[:, None]
    observed = [_vector_ends(spans, lines, slot) for slot in (0, 1)]
    innovation = np.column_stack([-from_middle.imag, *(gap for gap, _ in observed)])
    noise = np.zeros((len(lines), 4, 4))
    arms = from_middle.real
    noise[:, :2, :2] = (lines.se_angle**2)[:, None, None] * arms[:, :, None] * arms[:, None, :]
    noise[:, :2, :2] += (lines.se_offset**2)[:, None, None]
    for slot, (_, error) in enumerate(observed):
        noise[:, slot, slot] += (REDRAW_MM + SHARED_MM * shared) ** 2
        known = np.sqrt(error**2 + at_mm**2)
        noise[:, 2 + slot, 2 + slot] = np.where(ended[:, slot], known, UNKNOWN_MM) ** 2
    return _corrected(beliefs, edge, _design(along), innovation, noise)


def _design(along: ComplexArray) -> FloatArray:
    """Return (s, 4, 4): tail and head (x, y each) across the line, then along it."""
    design = np.zeros((len(along), 4, 4))
    for first, direction in ((0, 1j * along), (2, along)):
        for slot in (0, 1):
            design[:, first + slot, 2 * slot] = direction.real
            design[:, first + slot, 2 * slot + 1] = direction.imag
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


# The search for an assignment ----------------------------------------------------------------------

BEAM = 10
"""Partial assignments of a figure that are continued."""
GATE = 18.0
"""Squared Mahalanobis distance (two degrees of freedom) beyond which a stroke is not the edge."""
FIRST_GATE = 60.0
"""The same before any stroke is assigned: strokes of other edges change the expectation."""
TURN_SINE, FIRST_TURN_SINE = 0.7, 0.85
"""Sine of the angle to the edge at which a stroke is not the edge, later and at first."""
INVISIBLE_MM = 0.8
"""A shorter edge is a dot under its nodes."""
COST_OF_SHARING = 0.3
"""Nats for an edge on a stroke that serves another: two vectors in line are not rare."""
COST_OF_OPTIONAL = 5.0
"""Nats for a stroke of an optional edge: few students draw them. With 2.2 (one in ten) more strokes of wrong
drawings were taken for them."""
COST_OF_BARENESS = 1e3
"""Nats for leaving an edge without the stroke that is fixed to it: more than any evidence."""
STRAY_TIPS_MM = 40.0
"""Mean distance of tips along a stroke that mark no end of an edge."""
BAND_MM = 0.3
"""Distance of a line from the middle of a band of ink, if two lines lie in it."""
SHARED_RADIUS2_MM2 = 1.0
"""Two edges share one stroke if their lines are within about half a millimetre of each other."""
CHANCE_RADIUS_MM = 8.0
"""Strokes are counted at least this far around an edge: letters and arrowheads crowd near nodes."""


@dataclass(frozen=True, slots=True)
class StrokeAssignment:
    """An explanation of a figure by strokes.

    Attributes
    ----------
    expected : the figure, its nodes and covariance corrected by the strokes
    stroke : (edges,) row of `Lines` taken for each edge, -1 for none
    shared : (edges,) whether the stroke serves another edge as well
    score : log likelihood ratio, nats
    """

    expected: Expected
    stroke: IntArray
    shared: BoolArray
    score: float


@dataclass(frozen=True, slots=True)
class Constraint:
    """The knowledge before the search.

    Attributes
    ----------
    fixed : the stroke of an edge (a row of `Lines`, -1 for none) by the edge's index
    barred : an edge and a row that it must not take
    """

    fixed: Mapping[int, int] = field(default_factory=dict)
    barred: tuple[int, int] | None = None


UNCONSTRAINED = Constraint()
"""No prior knowledge."""


@dataclass(frozen=True, slots=True)
class _States:
    """Partial assignments, a row each; `figure` is the index of their figure."""

    figure: IntArray
    beliefs: Beliefs
    stroke: IntArray
    shared: BoolArray
    score: FloatArray


@dataclass(frozen=True, slots=True)
class _Choices:
    """Continuations of states, a row each: the state, the row of `Lines` taken (-1 for none), its kind."""

    state: IntArray
    row: IntArray
    shared: BoolArray
    ended: BoolArray
    score: FloatArray

    def take(self, rows: BoolArray | IntArray) -> "_Choices":
        """Return some of them."""
        return _Choices(*(getattr(self, name)[rows] for name in self.__slots__))

    def __add__(self, other: "_Choices") -> "_Choices":
        return _Choices(
            *(np.concatenate([getattr(self, name), getattr(other, name)]) for name in self.__slots__)
        )


@dataclass(frozen=True, slots=True)
class _AssignmentProblem:
    """The constants of the search.

    Attributes
    ----------
    edges, lines, prior : common to all figures
    allowed : (figures, edges, lines) whether a stroke may be an edge at all
    may_be_bare : (figures, edges) whether an edge may be left without a stroke
    """

    edges: tuple[Edge, ...]
    lines: Lines
    prior: EndPrior
    allowed: BoolArray
    may_be_bare: BoolArray


def assign_strokes(
    figures: Sequence[Expected],
    lines: Lines,
    prior: EndPrior,
    beam: int = BEAM,
    constraints: Sequence[Constraint] | None = None,
) -> list[list[StrokeAssignment]]:
    """Return the best assignments of each of several placed figures with the same edges, best first.

    The figures are searched side by side, not against one another: each has its own `beam`.

    Arguments: `constraints`, one for each figure.
    """
    constraints = constraints or [UNCONSTRAINED] * len(figures)
    edges = figures[0].edges
    beliefs = Beliefs(
        np.array([figure.at for figure in figures]), np.array([figure.cov for figure in figures])
    )
    problem = _AssignmentProblem(edges, lines, prior, *_allowed(beliefs, edges, lines, constraints))
    shape = (len(figures), len(edges))
    states = _States(
        np.arange(len(figures)), beliefs, np.full(shape, -1), np.zeros(shape, bool), np.zeros(len(figures))
    )
    for edge in _most_certain_first(beliefs, edges, constraints):
        choices = _nothing_taken(states, edge, problem) + _strokes_taken(states, edge, problem)
        states = _after(states, edge, choices, beam, problem)
    assignments: list[list[StrokeAssignment]] = [[] for _ in figures]
    for row, figure in enumerate(states.figure.tolist()):
        corrected = replace(figures[figure], at=states.beliefs.at[row], cov=states.beliefs.cov[row])
        score = float(states.score[row])
        assignments[figure].append(StrokeAssignment(corrected, states.stroke[row], states.shared[row], score))
    return assignments


def assign_groups(
    figures: Sequence[Expected],
    lines: Lines,
    near: Callable[[Lines, Sequence[Expected]], BoolArray],
    prior: EndPrior,
    beam: int = BEAM,
    constrain: Callable[[Sequence[int], Lines], list[Constraint]] | None = None,
) -> Iterator[tuple[int, list[StrokeAssignment], Lines]]:
    """Assign strokes to figures with different edges: those with the same edges are searched together.

    Arguments
    ---------
    near : which lines lie near any of some figures
    constrain : knowledge about some figures (by index) among some of the lines

    Yields each figure's index, its assignments, and the lines whose rows they name.
    """
    groups: dict[tuple[Edge, ...], list[int]] = {}
    for index, figure in enumerate(figures):
        groups.setdefault(figure.edges, []).append(index)
    for group in groups.values():
        members = [figures[index] for index in group]
        around = lines.take(near(lines, members))
        constraints = constrain and constrain(group, around)
        assignments = assign_strokes(members, around, prior, beam, constraints)
        for index, best in zip(group, assignments, strict=True):
            yield index, best, around


def _most_certain_first(
    beliefs: Beliefs, edges: Sequence[Edge], constraints: Sequence[Constraint]
) -> list[int]:
    """Return the order of the edges: fixed ones, then long ones, mistaken for others least; optional last."""
    size = [np.nan_to_num(abs(beliefs.at[:, edge.head] - beliefs.at[:, edge.tail])).mean() for edge in edges]
    fixed = [sum(index in constraint.fixed for constraint in constraints) for index in range(len(edges))]
    return sorted(range(len(edges)), key=lambda index: (-fixed[index], edges[index].optional, -size[index]))


def _allowed(
    beliefs: Beliefs, edges: Sequence[Edge], lines: Lines, constraints: Sequence[Constraint]
) -> tuple[BoolArray, BoolArray]:
    """Return `allowed` and `may_be_bare` of a problem: strokes within reach that the constraints leave."""
    allowed = np.zeros((len(constraints), len(edges), len(lines)), dtype=bool)
    bare = np.ones((len(constraints), len(edges)), dtype=bool)
    for index, edge in enumerate(edges):
        spans = beliefs.spans(edge.tail, edge.head)
        distance = mahalanobis(*line_residuals(spans, lines))[0]
        allowed[:, index] = _along(spans, lines, FIRST_TURN_SINE) & (distance < FIRST_GATE)
    for figure, constraint in enumerate(constraints):
        for index, row in constraint.fixed.items():
            reached = row >= 0 and bool(allowed[figure, index, row])
            if row < 0 or reached:
                allowed[figure, index] = np.arange(len(lines)) == row
                bare[figure, index] = not reached
        if constraint.barred is not None:
            allowed[figure, constraint.barred[0], constraint.barred[1]] = False
    return allowed, bare


def _along(spans: Spans, lines: Lines, turn_sine: float) -> BoolArray:
    """Return (s, lines) which lines run roughly along each edge; none if the edge is too short to see."""
    span = (spans.head - spans.tail)[:, None]
    size = np.abs(span)
    turned = np.abs((lines.along * np.conj(span)).imag)
    return np.asarray((turned < turn_sine * size) & (size >= INVISIBLE_MM))


def _nothing_taken(states: _States, edge: int, problem: _AssignmentProblem) -> _Choices:
    """Return every state without a stroke for the edge."""
    count = len(states.score)
    tail, head = problem.edges[edge].tail, problem.edges[edge].head
    size = np.abs(states.beliefs.at[:, head] - states.beliefs.at[:, tail])
    is_visible = (size >= INVISIBLE_MM) & (not problem.edges[edge].optional)
    cost = np.where(is_visible, -np.log(_missed(size)), 0.0)
    cost += np.where(problem.may_be_bare[states.figure, edge], 0.0, COST_OF_BARENESS)
    free = np.zeros((count, 2), dtype=bool)
    return _Choices(np.arange(count), np.full(count, -1), free[:, 0], free, states.score - cost)


def _strokes_taken(states: _States, edge: int, problem: _AssignmentProblem) -> _Choices:
    """Return every state with each of the strokes that the edge may have in it."""
    allowed = problem.allowed[states.figure, edge]
    rows = np.flatnonzero(allowed.any(axis=0))
    spans = states.beliefs.spans(problem.edges[edge].tail, problem.edges[edge].head)
    chance = _log_chance(spans, problem.lines)
    lines = problem.lines.take(rows)
    residual, spread = line_residuals(spans, lines)
    distance, log_det = mahalanobis(residual, spread)
    state, place = np.nonzero((distance < GATE) & _along(spans, lines, TURN_SINE) & allowed[:, rows])
    lines, spans = lines.take(place), spans.take(state)
    size = np.abs(spans.head - spans.tail)
    gains, ended, covers = ends_at(spans, lines, problem.prior)
    shared = np.asarray(_in_use(states, problem.lines)[state[:, None], lines.members].any(axis=1))
    alone = -0.5 * (distance + log_det)[state, place] - np.log(2 * np.pi) + np.log(size) + gains
    alone -= chance[state]
    both = _log_of_sharing(residual[:, state, place], spread[:, state, place])
    if problem.prior.marked_share:
        both += _log_of_marks(spans, lines, problem.prior)
    score = states.score[state] + np.where(shared, both, alone)
    score -= COST_OF_OPTIONAL if problem.edges[edge].optional else 0.0
    return _Choices(state, rows[place], shared, ended & ~shared[:, None], score).take(covers)


def _log_of_sharing(residual: FloatArray, spread: FloatArray) -> FloatArray:
    """Return the log likelihood of edges lying on strokes that serve others already."""
    distance, log_det = mahalanobis(residual, spread + np.array([BAND_MM**2, 0.0, BAND_MM**2])[:, None])
    density = np.exp(-0.5 * (distance + log_det)) / (2 * np.pi)
    return np.asarray(np.log(np.minimum(1.0, density * SHARED_RADIUS2_MM2) + 1e-12) - COST_OF_SHARING)


def _log_of_marks(spans: Spans, lines: Lines, prior: EndPrior) -> FloatArray:
    """Return the log likelihood of the tips near both nodes of edges that share their strokes."""
    forward = (lines.along * np.conj(spans.head - spans.tail)).real > 0
    total = np.zeros(len(lines))
    for slot, node in enumerate((spans.tail, spans.head)):
        variance = (spans.cov[2 * slot] * _squares(lines.along)).sum(axis=1) + prior.at_mm**2
        tips, sure = _tips_from(lines, node, forward == bool(slot), head=slot == 1)
        marked = _tip_density(tips, sure, variance) * STRAY_TIPS_MM
        total += np.log(1.0 - prior.marked_share + prior.marked_share * marked)
    return total


def _in_use(states: _States, lines: Lines) -> BoolArray:
    """Return which strokes, by their number, serve an edge already (s, strokes)."""
    used = np.zeros((len(states.score), int(lines.members.max(initial=0)) + 1), dtype=bool)
    state, edge = np.nonzero(states.stroke >= 0)
    used[state[:, None], lines.members[states.stroke[state, edge]]] = True
    return used


def _log_chance(spans: Spans, lines: Lines) -> FloatArray:
    """Return (s,) log density of chance strokes of about an edge's length in its position.

    Per mm across, per mm along, per radian and per mm of length: letters and arrowheads crowd about
    nodes, so that a short stroke in the right place is weak evidence.
    """
    size = np.abs(spans.head - spans.tail)
    middle = (spans.head + spans.tail) / 2.0
    radius = np.maximum(CHANCE_RADIUS_MM, 1.5 * size)
    shortest, longest = 0.4 * size, 2.5 * size + 4.0
    similar = (lines.length > shortest[:, None]) & (lines.length < longest[:, None])
    similar &= np.abs(lines.middle - middle[:, None]) < radius[:, None]
    count = np.count_nonzero(similar, axis=1) + 1.0
    return np.asarray(np.log(count / (np.pi * radius**2 * np.pi * (longest - shortest))))


def _missed(size_mm: FloatArray) -> FloatArray:
    """Return the probability that a drawn edge of this length has no stroke of its own."""
    return np.interp(size_mm, [1.0, 2.0, 4.0, 8.0], [0.7, 0.4, 0.12, 0.04])


def _after(states: _States, edge: int, choices: _Choices, beam: int, problem: _AssignmentProblem) -> _States:
    """Return the best states of each figure after the choices, best first, each set of strokes once."""
    figure = states.figure[choices.state]
    order = np.lexsort((-choices.score, figure))
    order = order[_first_of_each(figure[order], 2 * beam)]
    choices, figure = choices.take(order), figure[order]
    stroke, shared = states.stroke[choices.state], states.shared[choices.state]
    stroke[:, edge], shared[:, edge] = choices.row, choices.shared
    each = np.column_stack([figure, stroke])
    # Rows as single values: `unique` along an axis takes four times as long.
    _, rows = np.unique(each.view(np.dtype((np.void, each.strides[0]))).ravel(), return_index=True)
    rows = np.sort(rows)
    rows = rows[_first_of_each(figure[rows], beam)]
    choices = choices.take(rows)
    beliefs = states.beliefs.take(choices.state)
    taken = np.flatnonzero(choices.row >= 0)
    if len(taken):
        ends = (problem.edges[edge].tail, problem.edges[edge].head)
        lines = problem.lines.take(choices.row[taken])
        how = (choices.shared[taken], choices.ended[taken])
        corrected = updated(beliefs.take(taken), ends, lines, *how, problem.prior.at_mm)
        beliefs.at[taken], beliefs.cov[taken] = corrected.at, corrected.cov
    return _States(figure[rows], beliefs, stroke[rows], shared[rows], choices.score)


def _first_of_each(sorted_figures: IntArray, count: int) -> BoolArray:
    """Return which rows are among the first `count` of their figure."""
    rank = np.arange(len(sorted_figures)) - np.searchsorted(sorted_figures, sorted_figures)
    return np.asarray(rank < count)
