"""Read a velocity or acceleration plan by comparing each hypothesis of how it was drawn with the strokes."""

import math
from collections.abc import Callable, Collection, Hashable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, partial

import numpy as np

from grader.reading.by_ink import Look, held_against_ink
from grader.reading.expected import (
    LEFT_OUT,
    DraftingErrors,
    Expected,
    PlanHypothesis,
    Pose,
    Search,
    Slack,
    expect,
    mistaken,
    poses,
    regular,
    resized,
    slipped,
    tied,
    vectors_of,
)
from grader.reading.lettered_graph import lettered_graphs
from grader.reading.lettering import fitting_letters, lettering, primes_beside
from grader.reading.lines import BoolArray, Lines
from grader.reading.matching import (
    BEAM,
    UNCONSTRAINED,
    Constraint,
    EndPrior,
    StrokeAssignment,
    assign_groups,
    assign_strokes,
)
from grader.reading.nodes import NodeFit, fit_nodes
from grader.reading.orders import orders_by_ink, reordered, ring_of, to_usual
from grader.records import FloatArray, IntArray, Letters
from reference.construction.graph import ancestors, coincident
from reference.construction.mistakes import OF_FORCES, Drawing, affected
from reference.geometry import ComplexArray
from reference.quantities import group_of

DRAFTING_ERRORS = DraftingErrors()
FORCE_ERRORS = DraftingErrors(length_mm=0.4, relative=0.006, computed=0.03)
"""Given forces are laid off by the ruler alone, which tells their orders apart."""
FORCE_SLACK = 0.01
"""Error of a force polygon's size, which the declared scale gives: an arrowhead is longer than that."""
END_PRIOR = EndPrior()
FORCE_ENDS = EndPrior(marked_share=0.5)
"""Forces in one line, one after the other, often make one stroke."""
BY_LETTERS = "by letters"
"""Label of the hypotheses that follow letters and strokes instead of the construction."""
COST_OF_GRAPH = 6.0
LETTERED_MM = 2.0
"""Standard error of the nodes of such a hypothesis along x and y before strokes are assigned."""
COST_OF_ODD_NODE = 4.0
"""Nats for a node that is not where the construction puts it from the student's own nodes: one in fifty."""
ARROWS_PER_MM, MOST_BY_ARROWS = 1.25, 5.0
"""Nats for each millimetre of ink that arrowheads have in the sense of the forces, and most of them: of 164
polygons 4 mm tell the sense of all but one."""
EXPLAINED, NO_CHANCE = 0.85, 12.0
"""Support of a regular plan that is taken as drawn; nats that are no chance, with a mistake twice as many."""
ODD_NODE_NATS = 1.5
"""Nats of letters that each such node needs: without letters, others would fit as well."""
FOREIGN_PRIMES = 2
"""This many primes beside the nodes of a velocity plan mean that it is the acceleration plan: of 30 simulated
ones one had a prime near it, of 30 acceleration plans 26 had two and more."""
FAR_WORSE = 30.0
"""Largest deficit in nats that letters make up for."""
QUARTERS = (np.pi / 2, -np.pi / 2, np.pi)
"""A plan may be turned as a whole: velocities are perpendicular to links."""
COST_OF_TURN = 6.0
COST_OF_ORDER = 2.0
"""Nats for each order of forces other than the usual one."""
COST_OF_SIZE = 4.0
"""Nats for a plan turned by quarters, and for one at a scale that was not declared."""
SAME_SIZE = 0.06
"""Tolerance of a size's logarithm: a drawn crank and a ruler agree no better."""
POOR = 0.7
"""A plan supported over less of its length may be another one, drawn with a mistake."""
MOVING = OF_FORCES | {"wrong_arm", "sense_reversed"}
"""Mistakes that move many sides of a force polygon: it lies elsewhere than the right one, in other orders."""
BEAM_OF_MISTAKES = 4
"""Beam of the search if all vectors that the mistake does not affect are fixed."""
SMALLEST_MM, LARGEST_MM = 20.0, 280.0
LEAST_FIRST_MM = 15.0
"""Least length of a plan's longest vector, and of its first one: it fits on a sheet and can be measured."""
LEAST_LAID_MM = 4.0
"""A plan is not placed on shorter strokes: they are letters."""
SPECK_MM = 1e-6
"""A smaller plan is a point: there is nothing to place."""
FARTHEST_MM = 2000.0
"""Nodes farther away are on no sheet: with a mistake, lines may be nearly parallel."""
VAGUE_MM = 500.0
"""Nodes with a larger standard error cannot be found: their lines are nearly parallel."""
WORSE = 0.3
"""Poses supported by this much less of the plan's length are not examined."""
WORSE_WRONG = 0.12
"""The same for force polygons with a mistake, of which there are many: true ones are within 0.07."""
WORSE_BY_INK = 0.2
"""The same before such a polygon is placed, by the strokes along its sides in the best order."""
LEAST_VISIBLE_MM = 2.5
"""A shorter vector may have no stroke of its own."""
TWICE, LEAST_TWICE = 0.5, 40.0
"""A plan is drawn twice if other strokes give one of its size with this share of its score, and this much."""
CROSSED_OUT, LONG_SHARE, BY_NODE_MM, STEEP = 4.0, 0.3, 1.5, 0.2
"""Nats against a plan that is crossed out: by strokes of this share of its extent that cross vectors at an
angle of a larger sine, one of them past all nodes by more."""
RIVALS = 25
"""Number of explanations used for the confidences; the others weigh next to nothing."""
BEAM_OF_DOUBTS = 3
LEAST_DOUBT = 15.0
"""Nats: an explanation without a stroke that is worse by more is not a rival."""
SURE_MM = 30.0
"""Longer vectors are not taken for others when a neighbour's stroke is doubted."""
ALTERNATIVES = 4
NEARLY = 8.0
"""Most explanations of one pose that are rivals, and none that is worse by more nats."""
ASTRAY_MM = 0.8
"""A node this far from its stroke may be another node."""
MARGIN_MM = 12.0
"""Lines whose middle is farther from a plan's box are not its strokes."""


@dataclass(frozen=True, slots=True)
class PlanProblem:
    """The data from which a plan is read.

    Attributes
    ----------
    lines : of the sheet
    figure : which plan
    given : nodes already read (mechanism, velocity plan), complex mm, y up
    letters : of the sheet, None if they were not looked for
    renamed : what students write for a node, by name, if it is not the name
    elsewhere : strokes, by their number, that belong to the sketch
    look : tells where nodes lie by the sheet's ink; without it, as where it is only asked whether a sheet
        shows a drawing, mistaken force polygons are sought beside the right one only
    arrows : tells of a force polygon by how many millimetres of ink its arrowheads point as its forces do
    """

    lines: Lines
    figure: str
    given: Mapping[str, ComplexArray]
    letters: Letters | None = None
    renamed: Mapping[str, str] = field(default_factory=dict)
    elsewhere: IntArray = field(default_factory=lambda: np.zeros(0, np.int64))
    look: Look | None = None
    arrows: "Callable[[PlanReading], float | None] | None" = None

    @property
    def free(self) -> Lines:
        """The lines that no other figure needs."""
        return self.lines.take(np.flatnonzero(~np.isin(self.lines.members, self.elsewhere).any(axis=1)))

    @property
    def prior(self) -> EndPrior:
        """The prior for the ends of strokes."""
        return FORCE_ENDS if group_of(self.figure) else END_PRIOR

    def expected(self, hypothesis: PlanHypothesis) -> Expected | None:
        """Return the plan about its own pole; None if it cannot be drawn."""
        edges = vectors_of(tied(hypothesis), self.figure, hypothesis.absent)
        usual = FORCE_ERRORS if group_of(self.figure) else DRAFTING_ERRORS
        errors = replace(usual, slipped=hypothesis.slipped)
        expected = expect(hypothesis.drawing, self.figure, self.given, errors, edges)
        known = np.abs(expected.at).max() < FARTHEST_MM and expected.cov.max() < VAGUE_MM**2
        return expected if known else None


@dataclass(frozen=True)
class PlanReading:
    """A plan as read under one hypothesis.

    Attributes
    ----------
    hypothesis, pose : how it was drawn and where
    expected, placed : the expectation about its own pole, and there, before strokes were assigned
    assignment, lines : strokes by vector, and the lines whose rows it names
    score : log likelihood ratio less costs, nats
    rivals : other explanations, best first
    named : probability that its letters say the names, of one whose nodes the construction does not place
    told : the same of nodes that are near each other, where the construction may have either
    by_ink : the nodes by strokes and ink together, of the one that is chosen
    seen : of a force polygon the same without the data, which place its nodes where nothing marks them
    """

    hypothesis: PlanHypothesis
    pose: Pose
    expected: Expected
    placed: Expected
    assignment: StrokeAssignment
    score: float
    lines: Lines
    rivals: tuple["PlanReading", ...] = ()
    named: float = 1.0
    told: float = 1.0
    by_ink: NodeFit | None = None
    seen: NodeFit | None = None

    @cached_property
    def fit(self) -> NodeFit:
        """The nodes, by strokes and the construction, which places those whose ends nothing marks."""
        return self.by_ink or fit_nodes(self.assignment, self.lines, prior=self.placed)

    @property
    def figure(self) -> str:
        """The plan that is read."""
        return self.hypothesis.drawing.construction.figure_of(self.placed.names[0])

    @property
    def usual(self) -> FloatArray | None:
        """(n, n) that gives the nodes of the usual order from a force polygon's own; None without."""
        return to_usual(self.hypothesis.order) if self.hypothesis.order else None

    @property
    def members(self) -> IntArray:
        """The numbers of the strokes that it takes."""
        stroke = self.assignment.stroke
        return np.unique(self.lines.members[stroke[stroke >= 0]])

    @property
    def strokes(self) -> Hashable:
        """The assignment of strokes to vectors, as a key."""
        stroke = self.assignment.stroke
        taken = np.full((len(stroke), self.lines.members.shape[1]), -1)
        taken[stroke >= 0] = self.lines.members[stroke[stroke >= 0]]
        return self.placed.edges, self.hypothesis.slipped, taken.tobytes(), self.assignment.shared.tobytes()

    @property
    def sense(self) -> bytes:
        """The senses in which a polygon's forces run on their strokes, as a key; empty for other plans."""
        rows, at = np.flatnonzero(self.assignment.stroke >= 0), self.assignment.expected.at
        if not group_of(self.figure):
            return b""
        spans = np.array([at[self.placed.edges[row].head] - at[self.placed.edges[row].tail] for row in rows])
        along = self.lines.along[self.assignment.stroke[rows]]
        return bytes((spans * np.conj(along)).real > 0.0)


def regular_plans(problem: PlanProblem, drawing: Drawing, count: int = 2) -> list[PlanReading]:
    """Return readings of a plan as it should be drawn, best first.

    Arguments: `drawing` has the construction and the parameters of the student's variant; `count` is the
    number of poses of the expected size.
    """
    plans = _anywhere(problem, _regular(problem, drawing), count)
    sizes = {round(math.log(plan.pose.size), 1): plan.pose.size for plan in plans[:3]}
    for size in sizes.values():
        if abs(math.log(size)) <= SAME_SIZE:
            continue
        # Drafting errors are millimetres on paper: expect the plan again at the size it has there.
        larger = Drawing(drawing.construction, resized(drawing, problem.figure, size))
        bases = [replace(base, cost=base.cost + COST_OF_SIZE) for base in _regular(problem, larger)]
        plans.extend(_anywhere(problem, bases, count))
    return sorted(plans, key=lambda plan: -plan.score)


def _regular(problem: PlanProblem, drawing: Drawing) -> list[PlanHypothesis]:
    """Return the right hypotheses, a force polygon in every order of its sides that the strokes support."""
    usual, *others = regular(drawing, problem.figure)
    expected = problem.expected(usual) if group_of(problem.figure) else None
    orders = [] if expected is None else _in_orders(problem, usual, expected)
    return [usual, *others, *(one for one, _ in orders if one.order)]


def _in_orders(
    problem: PlanProblem, usual: PlanHypothesis, expected: Expected
) -> list[tuple[PlanHypothesis, float]]:
    """Return a force polygon in the usual order of its sides and in every other that the strokes support.

    Each has the share of the polygon that they support, infinite where orders cannot be sought. Arguments:
    `expected` is the polygon in its usual order.
    """
    drawing, figure = usual.drawing, problem.figure
    ring = ring_of(drawing.construction, figure)
    long = problem.lines.take(problem.lines.length > LEAST_LAID_MM)
    shares = {} if ring is None else orders_by_ink(expected, ring, long)
    if ring is None or not shares:
        return [(usual, math.inf)]
    found = [(usual, shares.pop(ring.usual, 0.0))]
    for order, share in shares.items():
        construction = reordered(drawing.construction, figure, ring, order)
        drawn, cost = Drawing(construction, drawing.parameters), usual.cost + COST_OF_ORDER
        found.append((replace(usual, drawing=drawn, cost=cost, order=order), share))
    return found


def best_plan(problem: PlanProblem, drawing: Drawing, plans: list[PlanReading]) -> PlanReading | None:
    """Return the best reading of a plan; the others are its rivals.

    If the regular plans leave something open, mistakes are tried in the best of them; then a force polygon is
    sought with mistakes in other places and orders, and another plan is read as a lettered graph.

    Arguments: `plans`, the regular ones, best first; `drawing`, the student's right drawing.
    """
    is_lettered = not group_of(problem.figure)
    plans, meant = _of_several(problem, plans) if plans and is_lettered else (plans, 1.0)
    everything = list(plans)
    if plans:
        bases = {plan.hypothesis.label: plan.hypothesis for plan in reversed(plans)}
        everything.extend(_with_mistakes(problem, plans[0], bases.values()))
        best = max(everything, key=lambda plan: plan.score)
        if is_lettered and best is not plans[0] and best.score > 2.0 * NO_CHANCE and _suspects(best):
            everything.extend(_with_mistakes(problem, best, [best.hypothesis]))
    is_open = not plans or plans[0].pose.score < EXPLAINED or bool(_suspects(plans[0]))
    # Reversed in part, other forces would leave the lines of the right polygon in the opposite sense.
    is_open |= bool(plans) and _nats_by_arrows(problem, plans[0]) <= -MOST_BY_ARROWS
    if is_open and not is_lettered and problem.look is not None:
        everything.extend(_mistaken_polygons(problem, drawing))
    elif is_open and is_lettered:
        lettered = [one for base in regular(drawing, problem.figure) for one in _by_letters(problem, base)]
        here = bool(plans) and plans[0].pose.score > EXPLAINED and plans[0].score > NO_CHANCE
        everything += [one for one in lettered if not here or np.isin(one.members, plans[0].members).any()]
    if not everything:
        return None
    best, *rivals = _weighed(problem, everything)
    rivals = [*rivals[: RIVALS - 1], *_without_each_stroke(best, problem.prior)]
    drawn = [best.placed.edges[index] for index in best.placed.required]
    by_ink = problem.look and held_against_ink(best.fit, drawn, problem.look)
    seen = None if is_lettered else fit_nodes(best.assignment, best.lines)
    if seen is not None and problem.look:
        seen = held_against_ink(seen, drawn, problem.look)
    return replace(best, rivals=tuple(rivals), by_ink=by_ink, seen=seen, named=min(best.named, meant))


def _of_several(problem: PlanProblem, plans: list[PlanReading]) -> tuple[list[PlanReading], float]:
    """Return the readings of the plan that counts where it is drawn twice, and the chance that it does.

    The other one is a first attempt, or crossed out: letters stand at the one that counts.
    """
    first = plans[0]
    apart = [
        plan
        for plan in plans
        if plan.score > max(TWICE * first.score, LEAST_TWICE)
        and abs(math.log(plan.pose.size / first.pose.size)) < SAME_SIZE
        and not np.isin(plan.members, first.members).any()
    ]
    if not apart:
        return plans, 1.0
    here, there = (
        _letters_nats(problem, plan) - CROSSED_OUT * _is_crossed_out(problem, plan)
        for plan in (first, apart[0])
    )
    kept = (apart[0] if there > here else first).members
    chance = 1.0 / (1.0 + math.exp(-abs(there - here)))
    return [plan for plan in plans if np.isin(plan.members, kept).any()], chance


def _is_crossed_out(problem: PlanProblem, plan: PlanReading) -> bool:
    """Return whether strokes run a long way across a plan's vectors, one of them past all its nodes.

    Lines of its construction pass through a node, as one that crosses it out from corner to corner may.
    """
    lines, at = problem.lines, plan.assignment.expected.at
    tails, heads = at[[(edge.tail, edge.head) for edge in plan.placed.edges]].T
    span = (heads - tails)[:, None]
    is_free = (lines.members[:, 0] == lines.members[:, 1]) & ~np.isin(lines.members[:, 0], plan.members)
    free = lines.take(is_free & (lines.length > LONG_SHARE * np.hypot(np.ptp(at.real), np.ptp(at.imag))))
    passes_by = (np.abs((np.conj(free.along) * (at[:, None] - free.start)).imag) > BY_NODE_MM).all(axis=0)
    turn = np.conj(free.along) * span
    steep = np.abs(turn.imag) > STEEP * np.abs(span)
    across = np.where(steep, turn.imag, np.inf)
    off = free.start - tails[:, None]
    on_vector = (np.conj(free.along) * off).imag / across
    on_stroke = (np.conj(span) * off).imag / across / free.length
    crosses = steep & (np.abs(on_vector - 0.5) < 0.5) & (np.abs(on_stroke - 0.5) < 0.5)
    is_across = crosses.any(axis=0)
    return int(is_across.sum()) > 1 and bool((is_across & passes_by).any())


def _letters_nats(problem: PlanProblem, plan: PlanReading) -> float:
    """Return the nats of the letters at the nodes of a plan."""
    expected, poles = plan.assignment.expected, plan.hypothesis.drawing.construction.poles.values()
    at = {(problem.figure, name): at for name, at in zip(expected.names, expected.at.tolist(), strict=True)}
    lettered = {} if group_of(problem.figure) else at
    writing = lettering(lettered, problem.letters, frozenset(poles), problem.renamed)
    return 0.0 if writing is None else writing.log()


# Where a plan may lie -----------------------------------------------------------------------------


def _anywhere(problem: PlanProblem, hypotheses: Sequence[PlanHypothesis], count: int) -> list[PlanReading]:
    """Return readings of some hypotheses in any position, best first."""
    cases = [*_posed(problem, hypotheses, count)]
    return sorted(_read(cases, problem.lines, problem.prior), key=lambda plan: -plan.score)


def _posed(problem: PlanProblem, hypotheses: Iterable[PlanHypothesis], count: int) -> Iterator["_PlanCase"]:
    """Yield each hypothesis at its likely poses."""
    for hypothesis in hypotheses:
        expected = problem.expected(hypothesis)
        if expected is not None:
            is_turnable = not group_of(problem.figure)
            found = _poses(expected, problem.lines, count, is_turnable=is_turnable)
            yield from (_PlanCase(hypothesis, expected, pose) for pose in found)


def _poses(expected: Expected, lines: Lines, count: int, *, is_turnable: bool) -> list[Pose]:
    """Return possible poses: upright at the expected size, upright at any size, turned by quarters.

    Each search has its own poses: a plan of nearly parallel vectors fits a bundle at any size.
    """
    largest = max(expected.length_mm(expected.edges[index]) for index in expected.required)
    if largest < SPECK_MM:
        return []
    # The student chose the length of the first vector so that it can be measured.
    first = min((edge for edge in expected.edges if edge.tail == 0), key=lambda edge: edge.head)
    smallest = max(SMALLEST_MM / largest, LEAST_FIRST_MM / max(expected.length_mm(first), SPECK_MM))
    any_size = Search(sizes=(0.0,), smallest=smallest, largest=max(smallest, LARGEST_MM / largest))
    turned = replace(any_size, turns_rad=QUARTERS, sizes=(1.0, 0.0))
    searches = ((Search(), count), (any_size, 2), (turned, 2))
    long = lines.take(lines.length > LEAST_LAID_MM)
    if is_turnable:
        laid = [pose for search, most in searches for pose in poses(expected, long, search, most)]
    else:
        laid = poses(expected, long, searches[0][0], count=3)
        if max((pose.score for pose in laid), default=0.0) < EXPLAINED:
            laid += poses(expected, long, any_size, count=2)
    best = max((pose.score for pose in laid), default=0.0)
    return [pose for pose in laid if pose.score > best - WORSE]


# Mistakes and doubts ------------------------------------------------------------------------------


def _with_mistakes(
    problem: PlanProblem, best: PlanReading, bases: Iterable[PlanHypothesis]
) -> list[PlanReading]:
    """Return the plan with a mistake or a short vector drawn wrongly, in the best one's position."""
    suspect = None if best.pose.score < POOR else _suspects(best)
    # The strokes give the plan's pole more exactly than the pose does.
    here = replace(best.pose, at=complex(best.assignment.expected.at[0]))
    tried = [] if group_of(problem.figure) else [*slipped(best.hypothesis, best.expected)]
    for hypothesis, mistake in (pair for base in bases for pair in mistaken(base, problem.figure)):
        touched = affected(mistake, hypothesis.drawing.construction)
        made_at = touched if mistake.code in OF_FORCES else {mistake.at}
        if suspect is None or made_at & suspect:
            tried.append((hypothesis, touched))
    cases = [
        _PlanCase(hypothesis, expected, here, touched)
        for hypothesis, touched in tried
        if (expected := problem.expected(hypothesis)) is not None
    ]
    return _read(cases, problem.lines, problem.prior, best)


def _mistaken_polygons(problem: PlanProblem, drawing: Drawing) -> list[PlanReading]:
    """Return readings of a force polygon with a mistake in what acts, wherever it lies, in any order."""
    usual, *_ = regular(drawing, problem.figure)
    known = [problem.expected(usual)]
    every: list[tuple[PlanHypothesis, float]] = []
    for wrong, mistake in mistaken(usual, problem.figure):
        expected = problem.expected(wrong) if mistake.code in MOVING else None
        # What acts on other links leaves this polygon as it is, and two mistakes may make the same one.
        if expected is not None and not any(one and np.allclose(expected.at, one.at) for one in known):
            known.append(expected)
            every.extend(_in_orders(problem, wrong, expected))
    supported = max((share for _, share in every if share < math.inf), default=0.0)
    cases = [*_posed(problem, (one for one, share in every if share > supported - WORSE_BY_INK), count=1)]
    best = max((case.pose.score for case in cases), default=0.0)
    likely = [case for case in cases if case.pose.score > best - WORSE_WRONG]
    return _read(likely, problem.lines, problem.prior)


def _suspects(plan: PlanReading) -> frozenset[str]:
    """Return the nodes at which a mistake could explain edges without a stroke, and large residuals."""
    fit, expected = plan.fit, plan.assignment.expected
    odd: set[str] = set()
    for index, edge in ((index, expected.edges[index]) for index in expected.required):
        size = abs(fit.at[edge.head] - fit.at[edge.tail])
        bare = plan.assignment.stroke[index] < 0 or plan.assignment.shared[index]
        residual = fit.residual_mm[index]
        astray = bool(np.isfinite(residual).all() and np.abs(residual).max() > ASTRAY_MM)
        if (bare and size > LEAST_VISIBLE_MM) or astray:
            odd.update((expected.names[edge.tail], expected.names[edge.head]))
    return ancestors(plan.hypothesis.drawing.construction, odd)


def _without_each_stroke(plan: PlanReading, prior: EndPrior) -> list[PlanReading]:
    """Return for every edge the best explanation in which it does not have its stroke."""
    assignment = plan.assignment
    edges = assignment.expected.edges
    size = [assignment.expected.length_mm(edge) for edge in edges]
    constraints = []
    for index in np.flatnonzero(assignment.stroke >= 0).tolist():
        ends = {edges[index].tail, edges[index].head}
        fixed = {
            other: int(assignment.stroke[other])
            for other, edge in enumerate(edges)
            if other != index and (size[other] > SURE_MM or not {edge.tail, edge.head} & ends)
        }
        constraints.append(Constraint(fixed, (index, int(assignment.stroke[index]))))
    if not constraints:
        return []
    doubted = [plan.placed] * len(constraints)
    best = assign_strokes(doubted, plan.lines, prior, BEAM_OF_DOUBTS, constraints)
    cost = assignment.score - plan.score
    return [
        replace(plan, assignment=rival, score=rival.score - cost)
        for rival, *_ in best
        if rival.score > assignment.score - LEAST_DOUBT
    ]


# Plans by their letters --------------------------------------------------------------------------


def _by_letters(problem: PlanProblem, base: PlanHypothesis) -> list[PlanReading]:
    """Return readings of the plan as a lettered graph, even if the construction contradicts it."""
    construction = base.drawing.construction
    poles = frozenset(construction.poles.values())
    nats = partial(fitting_letters, letters=problem.letters, poles=poles, renamed=problem.renamed)
    graphs = lettered_graphs(problem.free, nats, base.drawing, problem.figure, problem.given, base.absent)
    under = coincident(construction)
    cases = []
    is_primed = any("'" in step.node for step in construction.figures[problem.figure])
    for graph in graphs:
        at = np.array(list(graph.at.values()))
        if not is_primed and primes_beside(at, problem.letters) >= FOREIGN_PRIMES:
            continue
        absent = {**base.absent, **{node: LEFT_OUT.get(node[0], LEFT_OUT["n"]) for node in graph.absent}}
        cost = base.cost + COST_OF_GRAPH + COST_OF_ODD_NODE * graph.unexpected
        hypothesis = PlanHypothesis(BY_LETTERS, base.drawing, absent, cost)
        names = tuple(graph.at)
        pairs = tuple((names.index(name), names.index(under[name])) for name in names if name in under)
        cov = LETTERED_MM**2 * np.eye(2 * len(at))
        edges = vectors_of(tied(hypothesis), problem.figure, absent)
        expected = Expected(names, at, cov, edges, pairs)
        cases.append(_PlanCase(hypothesis, expected, Pose(0j, 1.0, 0.0, 0.0)))
    return _read(cases, problem.free, problem.prior)


def _named_by(letters_nats: float, hypothesis: PlanHypothesis, least: int = 0) -> float:
    """Return the probability that letters name a graph's nodes: strokes alone fit other names as well."""
    is_graph = hypothesis.label == BY_LETTERS
    odd = max(least, int((hypothesis.cost - COST_OF_GRAPH) / COST_OF_ODD_NODE)) if is_graph else 0
    return 1.0 / (1.0 + math.exp(ODD_NODE_NATS * odd - letters_nats)) if odd else 1.0


def _nats_by_arrows(problem: PlanProblem, plan: PlanReading) -> float:
    """Return the nats by which arrowheads support the sense of a force polygon; 0 for other plans."""
    forward_mm = problem.arrows(plan) if problem.arrows else None
    return max(-MOST_BY_ARROWS, min(ARROWS_PER_MM * (forward_mm or 0.0), MOST_BY_ARROWS))


def _weighed(problem: PlanProblem, plans: Sequence[PlanReading]) -> list[PlanReading]:
    """Return the best readings, best first, each set of strokes once, in either sense if that is open."""
    first = max(plans, key=lambda plan: plan.score)
    is_told = _nats_by_arrows(problem, first) >= MOST_BY_ARROWS
    least = first.score - FAR_WORSE
    least_of_arrows = math.inf if is_told else first.score - 2.0 * MOST_BY_ARROWS
    scored: dict[Hashable, PlanReading] = {}
    by_arrows: dict[Hashable, float] = {}
    for plan in sorted(plans, key=lambda plan: -plan.score):
        if plan.score >= least and (key := (plan.strokes, is_told or plan.sense)) not in scored:
            nats = _letters_nats(problem, plan)
            named, told = (_named_by(nats, plan.hypothesis, least) for least in (0, 1))
            alike = plan.hypothesis.label, plan.hypothesis.order, plan.sense
            if alike not in by_arrows:
                by_arrows[alike] = _nats_by_arrows(problem, plan) if plan.score >= least_of_arrows else 0.0
            nats += by_arrows[alike]
            scored[key] = replace(plan, score=plan.score + nats, named=named, told=told)
    return sorted(scored.values(), key=lambda plan: -plan.score)


# Strokes of a plan --------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _PlanCase:
    """A hypothesis at a pose: the expected plan, and the nodes that a mistake affects."""

    hypothesis: PlanHypothesis
    expected: Expected
    pose: Pose
    affected: Collection[str] = ()

    @property
    def has_expected_size(self) -> bool:
        """True if the pose has the expected size."""
        return abs(math.log(self.pose.size)) < SAME_SIZE

    @property
    def cost(self) -> float:
        """The prior cost, nats, before strokes are considered."""
        cost = self.hypothesis.cost + (0.0 if self.has_expected_size else COST_OF_SIZE)
        return cost + (0.0 if abs(self.pose.turn_rad) < np.pi / 4 else COST_OF_TURN)

    def placed(self) -> Expected:
        """The expected plan there, with the possible errors of the pose."""
        if self.hypothesis.label == BY_LETTERS:
            return self.expected
        of_forces = group_of(self.hypothesis.drawing.construction.figure_of(self.expected.names[0]))
        usual = FORCE_SLACK if of_forces else 0.03
        return self.expected.placed(self.pose, Slack(relative=usual if self.has_expected_size else 0.08))


def _read(
    cases: Sequence[_PlanCase], lines: Lines, prior: EndPrior, base: PlanReading | None = None
) -> list[PlanReading]:
    """Return the best explanations of plans at their poses: several of each if they are nearly as good.

    Arguments: `base` is the plan in which mistakes were made; its strokes stay if they do not affect it.
    """
    placed = [case.placed() for case in cases]

    def constrain(group: Sequence[int], around: Lines) -> list[Constraint]:
        if base is None:
            return [UNCONSTRAINED] * len(group)
        strokes = _strokes_among(around, base)
        return [_unaffected(strokes, placed[index], cases[index].affected) for index in group]

    beam = BEAM if base is None else BEAM_OF_MISTAKES
    plans: list[PlanReading] = []
    for index, best, around in assign_groups(placed, lines, _near, prior, beam, constrain):
        case = cases[index]
        plans.extend(
            PlanReading(
                case.hypothesis, case.pose, case.expected, placed[index], one, one.score - case.cost, around
            )
            for one in best[:ALTERNATIVES]
            if one.score > best[0].score - NEARLY
        )
    return plans


def _strokes_among(lines: Lines, plan: PlanReading) -> dict[str, int]:
    """Return the strokes of a plan's vectors, by name, as rows of other lines; -1 for none."""
    row_of = {tuple(pieces): row for row, pieces in enumerate(lines.members.tolist())}
    strokes = {}
    for edge, row in zip(plan.placed.edges, plan.assignment.stroke.tolist(), strict=True):
        known = -1 if row < 0 else row_of.get(tuple(plan.lines.members[row].tolist()))
        if known is not None:
            strokes[edge.name] = known
    return strokes


def _unaffected(strokes: Mapping[str, int], placed: Expected, affected_: Collection[str]) -> Constraint:
    """Fix the strokes of the vectors that a mistake does not affect."""
    return Constraint(
        {
            index: strokes[edge.name]
            for index, edge in enumerate(placed.edges)
            if edge.name in strokes
            and placed.names[edge.tail] not in affected_
            and placed.names[edge.head] not in affected_
        }
    )


def _near(lines: Lines, placed: Sequence[Expected]) -> BoolArray:
    """Return which lines lie near any of the figures."""
    middle = lines.middle
    near = np.zeros(len(lines), dtype=bool)
    for figure in placed:
        x, y = figure.at.real, figure.at.imag
        across = (middle.real > x.min() - MARGIN_MM) & (middle.real < x.max() + MARGIN_MM)
        near |= across & (middle.imag > y.min() - MARGIN_MM) & (middle.imag < y.max() + MARGIN_MM)
    return near
