"""A velocity or acceleration plan: the hypotheses of how it was drawn, held against the strokes."""

import math
from collections.abc import Collection, Hashable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.expected import (
    REGULAR,
    Edge,
    Expected,
    Hand,
    Hypothesis,
    Place,
    Search,
    Slack,
    expect,
    mistaken,
    places,
    regular,
    resized,
    tied,
    vectors_of,
)
from grader.reading.lines import BoolArray, Lines
from grader.reading.matching import BEAM, Ends, Explanation, Settled, explain_each
from grader.reading.nodes import Fit, fit_nodes
from reference.construction.graph import ancestors
from reference.construction.mistakes import Drawing, affected
from reference.geometry import ComplexArray

HAND = Hand()
PLAN_ENDS = Ends()
QUARTERS = (np.pi / 2, -np.pi / 2, np.pi)
COST_OF_TURN = 6.0
COST_OF_SIZE = 4.0
SAME_SIZE = 0.06
POOR = 0.7
"""A plan supported over less of its length may be another one, drawn with a mistake."""
CLEARLY = 0.08
BEAM_OF_MISTAKES = 4
SMALLEST_MM, LARGEST_MM = 20.0, 280.0
LEAST_FIRST_MM = 15.0
"""Of a plan's longest vector: what fits on a sheet and can be measured."""
LEAST_LAID_MM = 4.0
SPECK_MM = 1e-6
FARTHEST_MM = 2000.0
VAGUE_MM = 500.0
"""Nodes that a hand's errors move this far are not to be found: lines meet there at next to no angle."""
"""Nodes farther off are on no sheet, at any scale: with a mistake made, lines may be nearly parallel."""
WORSE = 0.3
"""Places supported by this much less of the plan's length are not looked at."""
LEAST_SEEN_MM = 2.5
LONG_MM = 8.0
RIVALS = 25
BEAM_OF_DOUBTS = 3
LEAST_DOUBT = 15.0
SURE_MM = 30.0
"""Longer vectors are not taken for others when a neighbour's stroke is doubted."""
ALTERNATIVES = 4
NEARLY = 8.0
"""Nats: explanations of one place that are worse by more are no rivals."""
ASTRAY_MM = 0.8


@dataclass(frozen=True, slots=True)
class Plan:
    """A plan as read under its best hypothesis.

    Attributes
    ----------
    hypothesis, place : how it was drawn and where
    placed : what was expected there before strokes were looked at
    found, fit : strokes by vector, and nodes
    score : log likelihood ratio less costs
    rivals : other explanations, best first
    lines : the strokes that `found` counts in
    """

    hypothesis: Hypothesis
    place: Place
    placed: Expected
    found: Explanation
    score: float
    lines: Lines
    rivals: tuple["Plan", ...] = ()

    @property
    def fit(self) -> Fit:
        """The nodes by the strokes alone."""
        return fit_nodes(self.found, self.lines)

    @property
    def strokes(self) -> Hashable:
        """Which stroke it takes for which vector."""
        found = self.found
        taken = np.where(found.stroke[:, None] < 0, -1, self.lines.members[found.stroke])
        return found.expected.edges, taken.tobytes(), found.shared.tobytes()

    @property
    def refined(self) -> Place:
        """Where the plan lies by its strokes: pole as fitted; size and turn of all nodes together."""
        return replace(self.place, at=complex(self.found.expected.at[0]))


def regular_plans(
    lines: Lines, drawing: Drawing, figure: str, given: Mapping[str, ComplexArray]
) -> list[Plan]:
    """The plan of one figure among the strokes of a sheet as it should be drawn, best first.

    Arguments
    ---------
    drawing : construction and parameters of the student's variant
    given : nodes already read (mechanism, velocity plan), complex mm, y up
    """
    plans = _as_regular(regular(drawing, figure), lines, figure, given)
    sizes = {round(math.log(plan.place.size), 1): plan.place.size for plan in plans[:3]}
    for size in (one for one in sizes.values() if abs(math.log(one)) > SAME_SIZE):
        # The hand's errors are millimetres on paper: expect the plan again at the size it has there.
        larger = Drawing(drawing.construction, resized(drawing, figure, size))
        bases = [replace(one, cost=one.cost + COST_OF_SIZE) for one in regular(larger, figure)]
        plans.extend(_as_regular(bases, lines, figure, given))
    return sorted(plans, key=lambda plan: -plan.score)


def _as_regular(
    bases: list[Hypothesis], lines: Lines, figure: str, given: Mapping[str, ComplexArray]
) -> list[Plan]:
    cases: list[_Case] = []
    for hypothesis in bases:
        expected = _expected(hypothesis, figure, given)
        if expected is not None:
            cases.extend(_Case(hypothesis, expected, place) for place in _laid(expected, lines))
    return sorted(_read(cases, lines), key=lambda plan: -plan.score)


def best_plan(plans: list[Plan], lines: Lines, figure: str, given: Mapping[str, ComplexArray]) -> Plan | None:
    """The best of the regular plans and of the same with mistakes made; the others are its rivals."""
    if not plans:
        return None
    first = {plan.hypothesis.label: plan.hypothesis for plan in reversed(plans)}
    bases = list(first.values())
    everything = [*plans, *_with_mistakes(plans[0], bases, figure, lines, given)]
    best = max(everything, key=lambda plan: plan.score)
    if best.hypothesis.label not in REGULAR and _leaves_long_ones(best):
        everything.extend(_with_mistakes(best, [best.hypothesis], figure, lines, given))
    everything.sort(key=lambda plan: -plan.score)
    best = everything[0]
    return replace(best, rivals=(*everything[1:RIVALS], *_without_each_stroke(best)))


def _leaves_long_ones(plan: Plan) -> bool:
    """Whether a vector too long to be overlooked has no stroke."""
    at = plan.found.expected.at
    return any(
        row < 0 and abs(at[edge.head] - at[edge.tail]) > LONG_MM
        for edge, row in zip(plan.found.expected.edges, plan.found.stroke, strict=True)
    )


def _without_each_stroke(plan: Plan) -> list[Plan]:
    """For every edge the best explanation in which the stroke taken for it is not it."""
    edges = plan.found.expected.edges
    size = [abs(plan.found.expected.at[edge.head] - plan.found.expected.at[edge.tail]) for edge in edges]
    cost = plan.found.score - plan.score
    doubted, settled = [], []
    for index, edge in enumerate(edges):
        row = int(plan.found.stroke[index])
        if row < 0:
            continue
        ends = {edge.tail, edge.head}
        kept = {
            other: int(plan.found.stroke[other])
            for other, one in enumerate(edges)
            if other != index and (size[other] > SURE_MM or not {one.tail, one.head} & ends)
        }
        doubted.append(plan.placed)
        settled.append(Settled(kept, (index, row)))
    if not doubted:
        return []
    best = [each[0] for each in explain_each(doubted, plan.lines, PLAN_ENDS, BEAM_OF_DOUBTS, settled)]
    return [
        replace(plan, found=found, score=found.score - cost)
        for found in best
        if found.score > plan.found.score - LEAST_DOUBT
    ]


def _with_mistakes(
    best: Plan, bases: list[Hypothesis], figure: str, lines: Lines, given: Mapping[str, ComplexArray]
) -> list[Plan]:
    """The same plan with a mistake made, where it was found; elsewhere too if that is poor."""
    poor = best.place.score < POOR and best.hypothesis.label in REGULAR
    suspect = None if poor else _suspects(best, best.fit)
    here: list[_Case] = []
    elsewhere: list[_Case] = []
    for hypothesis, mistake in (one for base in bases for one in mistaken(base, figure)):
        if suspect is not None and mistake.at not in suspect:
            continue
        expected = _expected(hypothesis, figure, given)
        if expected is None:
            continue
        if poor:
            laid = _better_laid(expected, lines, best.place)
            elsewhere.extend(_Case(hypothesis, expected, place) for place in laid)
        moved = affected(mistake, hypothesis.drawing.construction)
        here.append(_Case(hypothesis, expected, best.refined, moved))
    return [*_read(elsewhere, lines), *_read(here, lines, best)]


def _suspects(plan: Plan, fit: Fit) -> frozenset[str]:
    """The nodes at which a mistake could explain what the regular form does not."""
    names = plan.found.expected.names
    odd: set[str] = set()
    for index, edge in enumerate(plan.found.expected.edges):
        size = abs(fit.at[edge.head] - fit.at[edge.tail])
        unseen = size > LEAST_SEEN_MM and (plan.found.stroke[index] < 0 or plan.found.shared[index])
        off = fit.residual_mm[index]
        astray = bool(np.isfinite(off).all() and np.abs(off).max() > ASTRAY_MM)
        if unseen or astray:
            odd.update((names[edge.tail], names[edge.head]))
    return ancestors(plan.hypothesis.drawing.construction, odd)


def _expected(hypothesis: Hypothesis, figure: str, given: Mapping[str, ComplexArray]) -> Expected | None:
    """What is expected of the plan about its own pole; None where that cannot be drawn."""
    edges = vectors_of(tied(hypothesis), figure, hypothesis.absent)
    expected = expect(hypothesis.drawing, figure, given, HAND, edges)
    known = np.abs(expected.at).max() < FARTHEST_MM and expected.cov.max() < VAGUE_MM**2
    return expected if known else None


def _better_laid(expected: Expected, lines: Lines, than: Place) -> list[Place]:
    """Where a mistaken plan finds clearly more of its length drawn than the regular one did."""
    search = Search(turns_rad=tuple({0.0, than.turn_rad}), sizes=tuple({1.0, than.size}))
    found = places(expected, lines.take(lines.length > LEAST_LAID_MM), search, count=2)
    return [place for place in found if place.score > than.score + CLEARLY]


def _laid(expected: Expected, lines: Lines, count: int = 2) -> list[Place]:
    """Where the plan may lie: upright at the size expected, upright at any size, turned by quarters.

    Each way has places of its own: a plan of nearly parallel vectors fits a bundle at any size.
    """
    largest = max(abs(expected.at[edge.head] - expected.at[edge.tail]) for edge in expected.edges)
    if largest < SPECK_MM:
        return []
    long = lines.take(lines.length > LEAST_LAID_MM)
    first = _first_length(expected)
    smallest = max(SMALLEST_MM / largest, LEAST_FIRST_MM / first)
    bounds = {"smallest": smallest, "largest": max(smallest, LARGEST_MM / largest)}
    ways = (
        Search(sizes=(1.0,)),
        Search(sizes=(0.0,), **bounds),
        Search(turns_rad=QUARTERS, sizes=(1.0, 0.0), **bounds),
    )
    found = [place for way in ways for place in places(expected, long, way, count=count)]
    best = max((place.score for place in found), default=0.0)
    return [place for place in found if place.score > best - WORSE]


def _first_length(expected: Expected) -> float:
    """The length of the plan's first vector, which the student chose so that it can be measured."""
    edge = min((one for one in expected.edges if one.tail == 0), key=lambda one: one.head)
    return max(float(abs(expected.at[edge.head] - expected.at[edge.tail])), SPECK_MM)


@dataclass(frozen=True, slots=True)
class _Case:
    """A plan to be read at a place: how it was drawn, what is expected then, which nodes a mistake moved."""

    hypothesis: Hypothesis
    expected: Expected
    place: Place
    moved: Collection[str] = ()

    @property
    def as_expected(self) -> bool:
        """Whether the place has the size that is expected."""
        return abs(math.log(self.place.size)) < SAME_SIZE

    @property
    def cost(self) -> float:
        """Nats, how unlikely it is before looking."""
        cost = self.hypothesis.cost + (0.0 if self.as_expected else COST_OF_SIZE)
        return cost + (0.0 if abs(self.place.turn_rad) < np.pi / 4 else COST_OF_TURN)

    def placed(self) -> Expected:
        """What is expected there, with the freedom left to it."""
        relative = 0.03 if self.as_expected else 0.08
        slack = Slack(shift_mm=2.0, turn_rad=float(np.radians(1.0)), relative=relative)
        return self.expected.placed(self.place.at, self.place.size, self.place.turn_rad, slack)


def _read(cases: Sequence[_Case], lines: Lines, known_before: Plan | None = None) -> list[Plan]:
    """The best explanations of plans laid at places: several of each, where they are nearly as good.

    Plans of the same vectors are read side by side. `known_before` is the plan that mistakes were made
    in: what they do not touch is settled.
    """
    groups: dict[tuple[Edge, ...], list[_Case]] = {}
    for case in cases:
        groups.setdefault(case.expected.edges, []).append(case)
    plans: list[Plan] = []
    for group in groups.values():
        placed = [case.placed() for case in group]
        around = lines.take(_near(lines, placed))
        beam, settled = BEAM, None
        if known_before is not None:
            beam = BEAM_OF_MISTAKES
            kept = _kept(known_before, placed[0], around)
            settled = [
                Settled(_untouched(kept, one, case.moved)) for one, case in zip(placed, group, strict=True)
            ]
        each = explain_each(placed, around, PLAN_ENDS, beam, settled)
        for case, at, explained in zip(group, placed, each, strict=True):
            plans.extend(
                Plan(case.hypothesis, case.place, at, found, found.score - case.cost, around)
                for found in explained[:ALTERNATIVES]
                if found.score > explained[0].score - NEARLY
            )
    return plans


def _kept(base: Plan, placed: Expected, lines: Lines) -> dict[int, int]:
    """The strokes of vectors as rows of `lines`, by the place of their edge."""
    row_of = {tuple(pair): row for row, pair in enumerate(lines.members.tolist())}
    by_name = {edge.name: index for index, edge in enumerate(base.found.expected.edges)}
    kept = {}
    for index, edge in enumerate(placed.edges):
        known = by_name.get(edge.name)
        if known is None:
            continue
        row = int(base.found.stroke[known])
        if row < 0:
            kept[index] = -1
        elif tuple(base.lines.members[row]) in row_of:
            kept[index] = row_of[tuple(base.lines.members[row])]
    return kept


def _untouched(kept: Mapping[int, int], placed: Expected, moved: Collection[str]) -> dict[int, int]:
    """Those of them that a mistake does not touch."""
    nodes = {index for index, name in enumerate(placed.names) if name in moved}
    return {
        index: row
        for index, row in kept.items()
        if not {placed.edges[index].tail, placed.edges[index].head} & nodes
    }


def _near(lines: Lines, placed: Sequence[Expected]) -> BoolArray:
    """Which lines lie about any of the figures."""
    margin = 12.0
    middle = lines.middle
    near = np.zeros(len(lines), dtype=bool)
    for one in placed:
        low = complex(one.at.real.min() - margin, one.at.imag.min() - margin)
        high = complex(one.at.real.max() + margin, one.at.imag.max() + margin)
        across = (middle.real > low.real) & (middle.real < high.real)
        near |= across & (middle.imag > low.imag) & (middle.imag < high.imag)
    return near
