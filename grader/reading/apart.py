"""Tell the plans of several positions on one plain sheet apart.

Every position has candidates: its plan as it should be drawn, wherever strokes support it. Candidates of
different positions that take the same strokes exclude each other, so the positions are placed together. Two
dead points have one shape: letters tell them, and the numbers written behind letters or beside the pole.
"""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.lettering import gaps, lettering
from grader.reading.lines import BoolArray, Lines
from grader.reading.plans import PlanProblem, PlanReading, regular_plans
from grader.records import FloatArray, Letters
from reference.construction.mistakes import Drawing
from reference.geometry import ComplexArray

POSES = 4
"""Poses tried of each plan: two dead points have one shape, and either end of a stroke may be the pole."""
CANDIDATES = 8
"""Most candidates of a position: the right one is far up."""
SAME_MM = 4.0
"""Candidates that differ at no node by more are one."""
NOT_THERE = 6.0
"""Nats for no candidate of a position: it may be drawn with a mistake, or not at all."""
UNPLACED = 0.85
"""Most confidence in a plan without a candidate of its own: the rest of the sheet's ink."""
MOST_SHARED = 0.5
"""Share of a candidate's strokes that another position may take as well: both may use a line or two."""
BEAM = 40
"""Placements of some positions that are continued."""
TEMPERATURE = 3.0
"""Scores are divided by this: errors of one student's strokes are not independent."""
APART_MM = 15.0
"""Strokes as near to another position's plan belong to it, unless the own plan is nearer."""
NUMBER_MM = 6.0
"""Writing farther from every node is not the plan's number."""
STRAY = 0.3
"""Share of digits that say nothing of the position: misread letters, numbers of other things."""
MOST_BY_NUMBER = 8.0
"""Most nats of a plan's numbers together: a student may count from another one."""


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A plan that may be a position's: its strokes as bits, and its nats with letters and numbers."""

    plan: PlanReading
    strokes: int
    nats: float

    def excludes(self, other: "_Candidate") -> bool:
        """Return whether both take the same strokes."""
        least = min(self.strokes.bit_count(), other.strokes.bit_count())
        return (self.strokes & other.strokes).bit_count() > MOST_SHARED * least


def told_apart(problem: PlanProblem, drawings: Mapping[int, Drawing], own: int) -> tuple[PlanProblem, float]:
    """Return the problem without other positions' strokes, and the chance that the rest is the own plan.

    Arguments: `drawings` has each position's, by number, the own one's too.
    """
    exact = replace(problem, given={})
    found = {number: _candidates(exact, drawing, number, drawings) for number, drawing in drawings.items()}
    mine = found.pop(own)
    others = sorted(filter(None, found.values()), key=lambda those: -those[0].nats)
    placed = [_best_with(one, others) for one in (*mine, None)]
    totals = np.array([total for total, _ in placed])
    best = int(totals.argmax())
    beside = [one.plan for one in placed[best][1]]
    chosen = mine[best].plan if best < len(mine) else None
    kept = problem.lines.take(np.flatnonzero(_may_be_own(problem.lines, chosen, beside)))
    if chosen is None:
        return replace(problem, lines=kept), UNPLACED
    weight = np.exp((totals - totals[best]) / TEMPERATURE)
    poles = np.array([*(complex(one.plan.fit.at[0]) for one in mine), math.inf])
    chance = weight[np.abs(poles - poles[best]) < APART_MM].sum() / weight.sum()
    return replace(problem, lines=kept), float(chance)


def _candidates(
    problem: PlanProblem, drawing: Drawing, number: int, numbers: Collection[int]
) -> list[_Candidate]:
    """Return a position's candidates, best first."""
    found: list[_Candidate] = []
    poles = frozenset(drawing.construction.poles.values())
    for plan in regular_plans(problem, drawing, POSES):
        at = plan.fit.at
        alike = (one.plan.fit.at for one in found if len(one.plan.fit.at) == len(at))
        if len(found) == CANDIDATES or any(np.abs(at - other).max() < SAME_MM for other in alike):
            continue
        nodes = {(problem.figure, name): complex(at[row]) for row, name in enumerate(plan.placed.names)}
        writing = lettering(nodes, problem.letters, poles, problem.renamed)
        nats = plan.score + (0.0 if writing is None else writing.log())
        nats += _numbered(at, problem.letters, number, numbers)
        found.append(_Candidate(plan, sum(1 << stroke for stroke in plan.members.tolist()), nats))
    return sorted(found, key=lambda one: -one.nats)


def _numbered(at: ComplexArray, letters: Letters | None, number: int, numbers: Collection[int]) -> float:
    """Return the nats by which digits beside a plan say its number rather than any of the numbers."""
    if letters is None or not len(letters):
        return 0.0
    # Zero and the letter o share a column: it says nothing.
    signs = sorted(set("123456789").intersection("".join(map(str, numbers))))
    near = gaps(letters.box_mm, at).min(axis=1) < NUMBER_MM
    chance = np.array([letters.chance(sign)[near] for sign in signs]).reshape(len(signs), -1)
    share = np.array([[str(one).count(sign) / len(str(one)) for sign in signs] for one in (number, *numbers)])
    own, *each = share @ chance
    ratio = STRAY + (1.0 - STRAY) * own / np.maximum(np.mean(each, axis=0), 1e-9)
    nats = float(np.log1p(chance.sum(axis=0) * (ratio - 1.0)).sum())
    return max(-MOST_BY_NUMBER, min(MOST_BY_NUMBER, nats))


def _best_with(
    own: _Candidate | None, others: Sequence[Sequence[_Candidate]]
) -> tuple[float, tuple[_Candidate, ...]]:
    """Return the most nats of all positions with one candidate of the own, and the others' candidates."""
    always = () if own is None else (own,)
    beam: list[tuple[float, tuple[_Candidate, ...]]] = [(NOT_THERE if own is None else own.nats, ())]
    for candidates in others:
        following = [(total + NOT_THERE, placed) for total, placed in beam]
        following += [
            (total + one.nats, (*placed, one))
            for total, placed in beam
            for one in candidates
            if not any(one.excludes(other) for other in (*always, *placed))
        ]
        beam = sorted(following, key=lambda one: -one[0])[:BEAM]
    return beam[0]


def _may_be_own(lines: Lines, own: PlanReading | None, others: Sequence[PlanReading]) -> BoolArray:
    """Return which lines may be the own plan's: none that others take, or that lie nearer to those."""
    near = (
        np.min([_distance(lines, other) for other in others], axis=0, initial=APART_MM)
        if others
        else APART_MM
    )
    taken = np.isin(lines.members, [stroke for other in others for stroke in other.members]).any(axis=1)
    if own is None:
        return np.asarray(~taken & (near >= APART_MM))
    mine = np.isin(lines.members, own.members).any(axis=1)
    return np.asarray(mine | ~(taken | ((near < APART_MM) & (near < _distance(lines, own)))))


def _distance(lines: Lines, plan: PlanReading) -> FloatArray:
    """Return (n,) distances of the lines' middles from points along a plan's vectors, mm."""
    tail, head = (plan.fit.at[[getattr(e, end) for e in plan.placed.edges]] for end in ("tail", "head"))
    points = (tail + np.linspace(0.0, 1.0, 9)[:, None] * (head - tail)).ravel()
    off = np.abs(lines.middle[:, None] - points[np.isfinite(points)])
    return np.asarray(off.min(axis=1, initial=np.inf))
