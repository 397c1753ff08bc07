"""Angular velocities and accelerations that the student computed."""

import cmath
import math

from grader.comparison import verdicts
from grader.comparison.absent import absent
from grader.comparison.evidence import Evidence
from grader.comparison.ledger import Ledger
from grader.comparison.limits import the_better
from grader.comparison.marking import mark_value, tolerances, widened
from grader.comparison.task import Segment, Task, unit_of
from grader.comparison.values import common_factor
from grader.outcomes import Outcome, Quantity, Reason, Tolerance
from grader.rubric import CriterionTable
from reference.construction import AngularRate
from reference.elements import Normal
from reference.steps import Given


def rate(ledger: Ledger, criterion: CriterionTable) -> Outcome:
    """An angular quantity against the exact one, then against what the student's own vector gives."""
    task, name, unit = ledger.task, criterion.name, unit_of(criterion.name)
    right = task.rates[name]
    if name not in ledger.evidence.values:
        return absent(ledger, criterion, Quantity(value=right, unit=unit))
    value, table = ledger.evidence.values[name], task.rubric.tolerance_of(criterion)
    turned = task.construction.rates[name]
    segment = task.segments[turned.vector]
    scale = ledger.used[segment.scale]
    per_mm = scale / task.lengths_m[name]
    plain = table.length_at(abs(right) / per_mm) * per_mm
    allowed = Tolerance(value=plain)
    mark, followed = mark_value(value, right, plain, plain, table, unit), False
    if not mark.is_full:
        allowed = _widened(ledger, criterion, segment, per_mm)
        mark = mark_value(value, right, allowed.value or 0.0, plain, table, unit)
    ledger.remember(name, mark)
    follows = task.rubric.follows_through(criterion)
    own = from_rate(task, ledger.evidence, turned, scale) if follows and not mark.is_full else None
    factor = common_factor(ledger, segment.scale)
    if own is None and factor is not None and follows and not mark.is_full:
        own = right
    if own is not None:
        # Values that are all off by one factor give an angular one off by it, too.
        own = own if factor is None else min(own, own * factor, key=lambda one: abs(one - value))
        limit = table.length_at(abs(own) / per_mm) * per_mm
        candidate = ledger.allowed(
            frozenset({segment.head}), mark_value(value, own, limit, limit, table, unit)
        )
        if candidate.is_better(mark):
            told = Reason("follows", {"what": "vector", "of": turned.vector})
            mark, right, followed = the_better(candidate, mark, told), own, True
    measured, expected = Quantity(value=value, unit=unit), Quantity(value=right, unit=unit)
    return verdicts.outcome(criterion, mark, measured, expected, allowed, followed=followed)


def _widened(ledger: Ledger, criterion: CriterionTable, segment: Segment, per_mm: float) -> Tolerance:
    """The tolerance with what a careful hand may miss of the vector that turns the link."""
    exact = segment.drawn(ledger.used)
    plain = tolerances(ledger.task.rubric.tolerance_of(criterion), abs(exact), with_direction=False)
    reach = ledger.following.whole_reach(segment, exact)
    wider = widened(plain, abs(exact), reach, ledger.task.rubric.hand.at_most)
    return Tolerance(value=(wider.length_mm or 0.0) * per_mm, widened=wider.widened)


# From the own vector ----------------------------------------------------------------------------


def own_length(task: Task, evidence: Evidence, rate: AngularRate) -> float:
    """The real length of a rate's link, m: on the student's own sketch where it must be measured there."""
    tail, head = (evidence.nodes.get(joint) for joint in rate.link)
    is_given = _is_given(task, rate)
    if is_given or tail is None or head is None or task.yardstick is None or evidence.yardstick_mm is None:
        return task.lengths_m[rate.name]
    return abs(head - tail) * task.yardstick.length_m / evidence.yardstick_mm[0]


def _is_given(task: Task, rate: AngularRate) -> bool:
    """Whether a link's length is among the data; the distance of a slotted link's point is not."""
    lengths = (step.length for step in task.construction.steps if isinstance(step, Given))
    return not any(isinstance(one, Normal) and one.measured == rate.link for one in lengths)


def from_rate(task: Task, evidence: Evidence, rate: AngularRate, scale: float) -> float | None:
    """The angular rate that the student's own vector gives; None without one, or a trivial one.

    Arguments: `scale` is the vector's, real units per drawn millimetre. Where the own vector's direction
    is not known, the sense is the right one's.
    """
    own = evidence.vector(rate.vector)
    if own is None or own.length_mm < task.rubric.tolerance_of(rate.vector).least_mm:
        return None
    return _sense(task, evidence, rate) * own.length_mm * scale / own_length(task, evidence, rate)


def _sense(task: Task, evidence: Evidence, rate: AngularRate) -> float:
    """+1 where the own vector turns its link counter-clockwise: the link as drawn where it was read."""
    own, along = evidence.vector(rate.vector), task.real[rate.vector]
    sense = math.copysign(1.0, task.rates[rate.name])
    if own is None or own.direction_rad is None or along == 0:
        return sense
    plan = task.construction.figure_of(task.construction.vectors[rate.vector].head)
    joints = evidence.sketches.get(plan, evidence.nodes)
    tail, head = (joints.get(joint) for joint in rate.link)
    if tail is not None and head is not None:
        return math.copysign(1.0, math.sin(own.direction_rad - cmath.phase(head - tail)))
    return sense * math.copysign(1.0, math.cos(own.direction_rad - cmath.phase(along)))
