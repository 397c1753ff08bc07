"""Judge what is added to the sketch from the finished plans: centres of links, and vectors at their points.

A centre (``I3`` with velocity zero, ``J3`` with acceleration zero) is the corner of a triangle on a link that
is similar to one of the plan, with the same sense of traversal (Mehmke). It is compared with the right
triangle on the student's own joints, then with the student's own triangle, then with the mirror image.
"""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.comparison.charges import Charges
from grader.comparison.evidence import DrawnVector
from grader.comparison.outcomes import expected_quantity, outcome_of, quantity, unjudged
from grader.comparison.verdicts import (
    FULL,
    Expectation,
    HeldVector,
    Limit,
    MarkRange,
    by_rule,
    mark,
    open_between,
    the_better,
    with_confidence,
)
from grader.documents import Quantity, Tolerance
from grader.outcomes import Outcome
from grader.records import MECHANISM, Reason
from grader.rubric import CriterionTable, RubricFile
from reference.construction.elements import View
from reference.construction.steps import Similar
from reference.construction.uncertainty import SMALL
from reference.geometry import degrees

ON_PAPER_MM = 297.0
"""Short side of an A3 sheet: a centre farther from the driving link's pivot is not asked for."""


def judged_on_sketch(charges: Charges, criterion: CriterionTable) -> Outcome | None:
    """The outcome of a point or vector of the sketch; None where it was not handed in."""
    drawn = charges.evidence.vector(criterion.name)
    if criterion.point and not abs(_corner(charges, criterion.point, _right_nodes(charges))) <= ON_PAPER_MM:
        left = unjudged(criterion, "not_judged", (Reason("off_sheet"),), expected=Quantity())
        return left if drawn is None else replace(left, measured=Quantity(length_mm=drawn.length_mm))
    if drawn is None or (criterion.point and drawn.as_complex is None):
        return None
    found = _point(charges, criterion, drawn) if criterion.point else _vector(charges, criterion, drawn)
    is_read = drawn is charges.evidence.drawn.get(criterion.name)
    if is_read and criterion.optional and found.verdict == "review":
        # The ink may be something else: what is not required is not asked of a person.
        reasons = (Reason("optional"), Reason("doubtful", {"confidence": drawn.confidence}))
        return unjudged(criterion, "not_judged", reasons, expected=Quantity())
    return found


def _chosen(
    charges: Charges, right: Expectation, own: Expectation | None, held: "HeldVector | HeldPoint"
) -> tuple[MarkRange, Expectation]:
    """The mark against the right expectation, or against what follows from the student's own plan."""
    best = held.against(right)
    if own is None or best.is_full or not charges.task.rubric.follows_through(held.criterion):
        return best, right
    candidate, shown = charges.credited(own, held.against(own))
    charges.charged |= shown
    if not candidate.is_better(best):
        return best, right
    what = own if charges.is_wrong(own) else replace(own, what="small_errors")
    return the_better(candidate, best, *charges.why(what)), own


def _vector(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """The outcome of a vector drawn again at its point: parallel to that of the plan, and as long."""
    following, name = charges.following, criterion.vector or ""
    source, exact = charges.task.segments[name], charges.task.segments[name].drawn(following.used)
    right = Expectation(exact, uncertainty=following.uncertainty_of(source, exact))
    in_plan = charges.evidence.vector(name)
    along = None if in_plan is None else in_plan.as_complex
    own = None if along is None else Expectation(along, "vector", name, frozenset({source.head}))
    held = HeldVector(charges.task.rubric, criterion, drawn)
    best, chosen = _chosen(charges, right, own, held)
    on_sheet = None if drawn.direction_rad is None else drawn.direction_rad + drawn.turn_rad
    scale = following.used[source.scale]
    return outcome_of(
        criterion,
        best,
        quantity(criterion.name, drawn.length_mm, on_sheet, drawn.length_mm * scale),
        expected_quantity(criterion.name, chosen.vector, scale, drawn.turn_rad),
        held.allowed(chosen),
        confidence=drawn.confidence,
        followed=chosen is own,
    )


# Points -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class HeldPoint:
    """A point of the sketch judged by its distance from where it should be.

    Attributes
    ----------
    size_mm : the longer way to a joint of its triangle: the tolerance is relative to it
    spread_mm : its propagated drafting error, the rubric's number of standard deviations
    """

    rubric: RubricFile
    criterion: CriterionTable
    drawn: DrawnVector
    size_mm: float
    spread_mm: float

    @property
    def allowed(self) -> Tolerance:
        """The tolerance of full marks."""
        plain = self.rubric.tolerance_of(self.criterion).length_at(self.size_mm)
        wide = max(plain, min(self.spread_mm, self.rubric.hand.at_most * plain))
        return Tolerance(length_mm=wide, widened=wide > plain)

    def against(self, one: Expectation) -> MarkRange:
        """The mark by tolerance, decision rule and confidence; open where drafting errors explain it."""
        table, limit_mm = self.rubric.tolerance_of(self.criterion), self.allowed.length_mm or 0.0
        residual = abs((self.drawn.as_complex or 0j) - one.vector)
        reason = Reason("place_off", {"off_mm": residual, "tolerance_mm": limit_mm})
        plain = table.length_at(self.size_mm)
        limit = Limit("length", residual, limit_mm, plain, self.drawn.se_mm, table, reason)
        found = by_rule(mark([limit]), self.rubric.doubt.in_doubt)
        if not found.is_full and residual <= self.spread_mm:
            return open_between(found.worst, FULL, found, Reason("hand_may_miss"))
        return with_confidence(found, self.drawn.confidence, self.rubric.doubt.settle)


def _point(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """The outcome of a centre, by the similar triangle on the student's own joints."""
    task, name = charges.task, criterion.name
    step, right = task.construction.centres[name], _right_nodes(charges)
    figure, pole = task.construction.figure_of(step.model[0]), step.model[-1]
    joints = charges.evidence.sketches.get(figure) or charges.evidence.nodes
    if {task.construction.pivot, *step.base} <= joints.keys():
        right |= {joint: joints[joint] - joints[task.construction.pivot] for joint in step.base}
    plan = charges.following.own(charges.following.used).get(figure, {})
    ways = [right]
    if set(step.model) - {pole} <= plan.keys():
        ways.append({**right, **{node: plan[node].at for node in step.model[:-1]}})
    first, *others = (_corner(charges, name, nodes) for nodes in ways)
    relies_on = frozenset(step.model) - {pole}
    own = next((Expectation(at, "nodes", relies_on=relies_on) for at in others), None)
    size = max(abs(first - right[joint]) for joint in step.base)
    held = HeldPoint(task.rubric, criterion, drawn, size, _spread(charges, step, size))
    best, chosen = _chosen(charges, Expectation(first), own, held)
    mirrored = (Expectation(_corner(charges, name, nodes, mirrored=True)) for nodes in ways)
    is_mirrored = best.share != FULL and any(held.against(one).is_full for one in mirrored)
    turn = cmath.rect(1.0, drawn.turn_rad)
    return outcome_of(
        criterion,
        best,
        _place((drawn.as_complex or 0j) * turn),
        _place(chosen.vector * turn),
        held.allowed,
        confidence=drawn.confidence,
        followed=chosen is own,
        mistake="image_mirrored" if is_mirrored else None,
    )


def _right_nodes(charges: Charges) -> dict[str, complex]:
    """The exact nodes, joints from the driving pivot."""
    nodes, construction = charges.task.nodes(charges.following.used), charges.task.construction
    joints = {step.node for step in construction.figures[MECHANISM]}
    return {name: at - nodes[construction.pivot] if name in joints else at for name, at in nodes.items()}


def _corner(charges: Charges, name: str, nodes: Mapping[str, complex], *, mirrored: bool = False) -> complex:
    """The third corner of a centre's triangle on its link, complex mm; nan where there is none."""
    step = replace(charges.task.construction.centres[name], mirrored=mirrored)
    with np.errstate(all="ignore"):
        return complex(step.place(View({need: np.asarray(nodes[need]) for need in step.needs}, {})))


def _spread(charges: Charges, step: Similar, size_mm: float) -> float:
    """The drafting error of a centre from the first line of the drawing on, mm."""
    task, used, hand = charges.task, charges.following.used, charges.task.rubric.hand
    traced = {name: task.traced(used).nodes[name] for name in step.needs}
    drawn = {name: np.array([one.at, *(one.at + SMALL * one.shifts)]) for name, one in traced.items()}
    with np.errstate(all="ignore"):
        corners = step.place(View(drawn, {}))
    of_plan = np.linalg.norm(corners[1:] - corners[0]) / SMALL * task.rule_scales["kL"] / used["kL"]
    return hand.sigmas * math.hypot(of_plan, size_mm * math.radians(hand.angle_deg), hand.place_mm)


def _place(from_pivot: complex) -> Quantity:
    return Quantity(length_mm=abs(from_pivot), direction_deg=degrees(cmath.phase(from_pivot)))
