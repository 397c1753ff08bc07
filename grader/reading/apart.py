"""Tell the plans of several positions on one plain sheet apart.

Every position has candidates: its plan as it should be drawn, wherever strokes support it. Candidates of
different positions that take the same strokes exclude each other, so the positions are placed together. Two
dead points have one shape: letters tell them, the numbers written behind letters or beside the pole, which a
student may count from one, and the order in which the plans stand, if the others stand in order.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache

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
TEMPERATURE = 3.0
"""Scores of strokes and letters are divided by this: errors of one student's are not independent."""
NOT_THERE = 2.0
"""Nats for no candidate of a position: it may be drawn with a mistake, or not at all."""
UNPLACED = 0.85
"""Most confidence in a plan without a candidate of its own: the rest of the sheet's ink."""
MOST_SHARED = 0.5
"""Share of a candidate's strokes that another position may take as well: both may use a line or two."""
BEAM = 40
"""Placements of some positions that are continued."""
APART_MM = 15.0
"""Strokes as near to another position's plan belong to it, unless the own plan is nearer."""
NUMBER_MM = 6.0
"""Writing farther from every node is not the plan's number."""
STRAY = 0.3
"""Share of digits that say nothing of the position: misread letters, numbers of other things."""
MOST_BY_NUMBER = 3.0
"""Most nats of a plan's numbers together: a sign that is misread once is misread beside each node."""
COUNTED = (0.0, -3.0, -3.0)
"""Nats for numbers as the assignment has them, counted from one (or from zero), and of other things."""
BY_ROWS, BY_COLUMNS, OTHERWISE = 0.7, 0.15, 0.15
"""Shares of students who draw the plans in rows, in columns, or as they come."""
FOLLOWS = 0.95
"""Share of the plans that one who draws them in order draws behind the one before."""
BESIDE_MM = 8.0
"""Plans stand in one row if their middles are no farther apart than half the taller one, and this."""
LIKELY = 0.05
"""A placement of less probability is no doubt."""


@dataclass(frozen=True, slots=True)
class _Candidate:
    """A plan that may be a position's.

    Attributes
    ----------
    strokes : those that it takes, as bits
    nats : of its strokes and letters
    written : nats of the numbers beside it, by the ways of counting (`COUNTED`)
    middle, reach : middle of its nodes and half of their extent, complex mm
    """

    number: int
    plan: PlanReading
    strokes: int
    nats: float
    written: tuple[float, ...]
    middle: complex
    reach: complex

    def excludes(self, other: "_Candidate") -> bool:
        """Return whether both take the same strokes."""
        least = min(self.strokes.bit_count(), other.strokes.bit_count())
        return (self.strokes & other.strokes).bit_count() > MOST_SHARED * least


_Placed = tuple[_Candidate, ...]


@dataclass(frozen=True, slots=True)
class Apart:
    """A position's part of a sheet.

    Attributes
    ----------
    problem : the sheet without other positions' strokes
    chance : the chance that the rest is the own plan
    positions : the own one and those whose plan it may be instead, as said to people; empty if it is clear
    """

    problem: PlanProblem
    chance: float
    positions: tuple[str, ...] = ()


def told_apart(problem: PlanProblem, drawings: Mapping[int, Drawing], own: int) -> Apart:
    """Return the own position's part of a sheet; `drawings` has each position's, by number."""
    found = _every_candidate(_Sheet.of(replace(problem, given={}), drawings))
    mine = found[own]
    others = [those for number, those in found.items() if number != own and those]
    others.sort(key=lambda those: -those[0].nats)
    placed = [_best_with(one, others) for one in (*mine, None)]
    totals = np.array([total for total, _ in placed])
    best = int(totals.argmax())
    beside = [one.plan for one in placed[best][1] if one.number != own]
    chosen = mine[best] if best < len(mine) else None
    is_rest = _may_be_own(problem.lines, None if chosen is None else chosen.plan, beside)
    rest = replace(problem, lines=problem.lines.take(np.flatnonzero(is_rest)))
    if chosen is None:
        return Apart(rest, UNPLACED)
    weight = np.exp(totals - totals[best])
    weight /= weight.sum()
    poles = np.array([*(complex(one.plan.fit.at[0]) for one in mine), np.inf])
    here = np.abs(poles - poles[best]) < APART_MM
    instead = [placed[at][1] for at in np.flatnonzero(~here & (weight > LIKELY))]
    takers = {one.number for those in instead for one in those if one.excludes(chosen)} - {own}
    positions = tuple(str(one) for one in sorted({own, *takers})) if takers else ()
    return Apart(rest, float(weight[here].sum()), positions)


@dataclass(frozen=True, slots=True)
class _Sheet:
    """A sheet and what may stand on it: the same one where its strokes and all numbers are the same."""

    key: bytes
    problem: PlanProblem = field(compare=False)
    drawings: Mapping[int, Drawing] = field(compare=False)

    @classmethod
    def of(cls, problem: PlanProblem, drawings: Mapping[int, Drawing]) -> "_Sheet":
        """Return the sheet of a plan's problem."""
        numbers = (value for one in drawings.values() for value in one.parameters.values())
        written = () if problem.letters is None else (problem.letters.box_mm, problem.letters.probability)
        parts = (problem.lines.start, problem.lines.end, problem.elsewhere, *written, *numbers)
        key = b"".join(np.asarray(part).tobytes() for part in parts)
        steps = {number: one.construction.figures[problem.figure] for number, one in drawings.items()}
        return cls(repr((problem.figure, problem.renamed, steps)).encode() + key, problem, drawings)


@lru_cache(maxsize=2)
def _every_candidate(sheet: _Sheet) -> dict[int, list[_Candidate]]:
    """Return the candidates of each position, best first: all positions of a sheet have the same."""
    return {number: _candidates(sheet.problem, sheet.drawings, number) for number in sheet.drawings}


def _candidates(problem: PlanProblem, drawings: Mapping[int, Drawing], number: int) -> list[_Candidate]:
    """Return a position's candidates, best first."""
    drawing, numbers = drawings[number], [*drawings]
    found: list[_Candidate] = []
    shift = -1 if numbers[0] == 1 else 1 - numbers[0]
    poles = frozenset(drawing.construction.poles.values())
    for plan in regular_plans(problem, drawing, POSES):
        at = plan.fit.at
        alike = (one.plan.fit.at for one in found if len(one.plan.fit.at) == len(at))
        if len(found) == CANDIDATES or any(np.abs(at - other).max() < SAME_MM for other in alike):
            continue
        nodes = {(problem.figure, name): complex(at[row]) for row, name in enumerate(plan.placed.names)}
        writing = lettering(nodes, problem.letters, poles, problem.renamed)
        nats = (plan.score + (0.0 if writing is None else writing.log())) / TEMPERATURE
        counted = (_numbered(at, problem.letters, number, numbers, by) for by in (0, shift))
        low, high = (complex(side(at.real), side(at.imag)) for side in (np.nanmin, np.nanmax))
        taken = sum(1 << stroke for stroke in plan.members.tolist())
        middle, reach = (low + high) / 2.0, (high - low) / 2.0
        found.append(_Candidate(number, plan, taken, nats, (*counted, 0.0), middle, reach))
    return sorted(found, key=lambda one: -one.nats)


def _numbered(
    at: ComplexArray, letters: Letters | None, number: int, numbers: Sequence[int], shift: int
) -> float:
    """Return the nats by which digits beside a plan say its number and not just any; all of them shifted."""
    if letters is None or not len(letters):
        return 0.0
    # Zero and the letter o share a column: it says nothing.
    own_text, *texts = (str(one + shift) for one in (number, *numbers))
    signs = sorted(set("123456789").intersection("".join(texts)))
    near = gaps(letters.box_mm, at).min(axis=1) < NUMBER_MM
    chance = np.array([letters.chance(sign)[near] for sign in signs]).reshape(len(signs), -1)
    share = np.array([[one.count(sign) / len(one) for sign in signs] for one in (own_text, *texts)])
    own, *each = share @ chance
    ratio = STRAY + (1.0 - STRAY) * own / np.maximum(np.mean(each, axis=0), 1e-9)
    nats = float(np.log1p(chance.sum(axis=0) * (ratio - 1.0)).sum())
    return max(-MOST_BY_NUMBER, min(MOST_BY_NUMBER, nats))


def _best_with(own: _Candidate | None, others: Sequence[Sequence[_Candidate]]) -> tuple[float, _Placed]:
    """Return the most nats of all positions with one candidate of the own, and all candidates placed."""
    ends: list[tuple[float, _Placed]] = []
    for counted, prior in enumerate(COUNTED):
        first = (prior + NOT_THERE, ()) if own is None else (prior + own.nats + own.written[counted], (own,))
        beam: list[tuple[float, _Placed]] = [first]
        for candidates in others:
            following = [(total + NOT_THERE, placed) for total, placed in beam]
            following += [
                (total + one.nats + one.written[counted], (*placed, one))
                for total, placed in beam
                for one in candidates
                if not any(one.excludes(other) for other in placed)
            ]
            beam = sorted(following, key=lambda one: -one[0])[:BEAM]
        ends += beam
    return max(((total + _ordered(placed), placed) for total, placed in ends), key=lambda one: one[0])


def _ordered(placed: _Placed) -> float:
    """Return the nats by which plans stand in the order of their numbers, against random places."""
    in_turn = sorted(placed, key=lambda one: one.number)
    middle, reach = (np.array([getattr(one, name) for one in in_turn]) for name in ("middle", "reach"))
    across, down = middle.real, -middle.imag
    likelihood = OTHERWISE
    for share, along, lines, size in (
        (BY_ROWS, across, down, reach.imag),
        (BY_COLUMNS, down, across, reach.real),
    ):
        is_beside = np.abs(np.diff(lines)) < BESIDE_MM + np.maximum(size[1:], size[:-1])
        is_behind = np.where(is_beside, np.diff(along), np.diff(lines)) > 0.0
        likelihood += share * float(np.where(is_behind, 2.0 * FOLLOWS, 2.0 - 2.0 * FOLLOWS).prod())
    return math.log(likelihood)


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
