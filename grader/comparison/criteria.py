"""All criteria of a rubric, in the order of construction, so that earlier mistakes are known.

`compare(task, submission)` marks each criterion against the original data at the student's scales
first, then against what follows from the student's own earlier values; the better counts. A mistake
from which later values follow costs once: where it was made, or, where no criterion asks for that, at
the first criterion that shows it. Small errors that are each within their tolerance and add up in a
later node are no mistake. Verdicts are `Outcome`s with reasons as data (`grader.outcomes`).
"""

import cmath
import math
import statistics
from collections.abc import Mapping
from dataclasses import dataclass, replace

from grader.comparison import verdicts
from grader.comparison.charges import Against, Charges, ComparedMark, new_charges
from grader.comparison.evidence import DrawnVector, Evidence, Submission, gather, held_against_cells
from grader.comparison.follow_through import (
    NO_SPREAD,
    Expectation,
    Explain,
    ReplayResult,
    nothing_explained,
)
from grader.comparison.images import with_images
from grader.comparison.scales import Scale, settle
from grader.comparison.task import Task, TaskSegment
from grader.comparison.verdicts import (
    ALL_RIGHT,
    EVEN,
    FULL,
    SHORT_MM,
    MarkRange,
    by_rule,
    left_open,
    mark_value,
    mark_vector,
    the_better,
    the_worse,
    tolerances,
    widened,
)
from grader.documents import Quantity, Tolerance, Verdict
from grader.outcomes import Outcome, UsedScale
from grader.records import Reason
from grader.rubric import CriterionTable
from reference.construction.elements import Normal
from reference.construction.graph import AngularRate
from reference.construction.steps import Given
from reference.construction.uncertainty import EndSpread
from reference.quantities import unit_of


@dataclass(frozen=True, slots=True)
class Comparison:
    """All outcomes in the rubric's order, the scales used, and the evidence."""

    outcomes: tuple[Outcome, ...]
    scales: Mapping[str, UsedScale]
    evidence: Evidence
    settled: Mapping[str, Scale]
    explanation: ReplayResult | None
    """The result of the search for what was done, where it was needed."""


def compare(task: Task, submission: Submission, explain: Explain = nothing_explained) -> Comparison:
    """Mark every criterion of the task's rubric.

    Arguments: `explain` searches for what was done; it is asked once, when something does not fit.
    """
    evidence = gather(task, submission)
    settled = settle(task, evidence, submission.declared)
    charges = new_charges(task, evidence, settled, explain)
    judged = {criterion.id: _outcome(charges, criterion) for criterion in _in_order(charges)}
    outcomes = with_images(task, judged)
    return Comparison(
        outcomes=tuple(outcomes[criterion.id] for criterion in task.rubric.criterion),
        scales={name: scale.used for name, scale in settled.items()},
        evidence=evidence,
        settled=settled,
        explanation=charges.following.explanation,
    )


def _in_order(charges: Charges) -> list[CriterionTable]:
    """The criteria as they are drawn: scales, sketch, velocities, omega, accelerations, epsilon.

    Of vectors that end at one node, those on wrong lines come first; the rubric's order changes nothing.
    """
    task, scales = charges.task, tuple(charges.settled)
    construction = task.construction
    steps = {step.node: place for place, step in enumerate(construction.steps)}
    names = list(task.segments)
    kinds = ("v", "omega", "a", "epsilon")

    def place(criterion: CriterionTable) -> tuple[int, ...]:
        name = criterion.name
        if name in scales:
            return -2, scales.index(name)
        kind = -1 if criterion.link else kinds.index(name.partition("_")[0])
        if name not in task.segments:
            return kind, 0
        one = task.segments[name]
        return kind, steps[one.head], charges.rank(one), names.index(name)

    return sorted(task.rubric.criterion, key=place)


def _outcome(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The verdict on one criterion, open where it depends on an entry that cannot be used."""
    outcome = _judged(charges, criterion)
    entry = charges.evidence.refused.get(criterion.name)
    if entry is None and outcome.verdict in {"none", "partial"}:
        entry = _refused_below(charges, criterion.name)
    if entry is None:
        if outcome.verdict == "review" and criterion.name in charges.evidence.verdicts:
            charges.decided(criterion.name, charges.evidence.verdicts[criterion.name])
        return outcome
    charges.leave_open(criterion.name)
    return verdicts.entry_refused(outcome, entry)


def _refused_below(charges: Charges, name: str) -> tuple[str, ...] | None:
    """The entry for the scale, or for a node from which a vector is made, that cannot be used."""
    task, evidence = charges.task, charges.evidence
    turned = task.construction.rates.get(name)
    segment = task.segments.get(name if turned is None else turned.vector)
    if segment is None or not evidence.refused:
        return None
    needs = {need for need in task.construction.step(segment.head).needs if need not in evidence.nodes}
    vectors = [vector.name for vector in task.segments.values() if vector.head in needs]
    below = [name for name in (segment.scale, segment.name, *vectors) if name in evidence.refused]
    return evidence.refused[below[0]] if below else None


def _judged(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The verdict on what can be used; its cost is recorded in the charges."""
    if criterion.scale is not None:
        return _scale(charges, criterion)
    if criterion.angular is not None:
        return rate(charges, criterion)
    sources = (charges.evidence.drawn.get(criterion.name), charges.evidence.measured.get(criterion.name))
    outcomes = [segment(charges, criterion, drawn) for drawn in sources if drawn is not None]
    if len(outcomes) == 2:
        return verdicts.both(outcomes[0], outcomes[1], charges.task.rubric.tolerance_of(criterion).length_mm)
    return outcomes[0] if outcomes else value_outcome(charges, criterion)


def _scale(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The outcome of a declared scale."""
    name, unit = criterion.name, unit_of(criterion.name)
    scale, right = charges.settled[name], charges.followed[name]
    expected = Quantity(value=right, unit=unit)
    if scale.mark is None:
        if scale.used.text is None and not criterion.optional:
            return absent(charges, criterion, expected)
        return verdicts.unjudged(criterion, "not_judged", scale.reasons, expected=expected)
    charges.remember(name, scale.mark)
    measured = Quantity(value=scale.used.declared, unit=unit)
    allowed = Tolerance(value=charges.task.rubric.tolerance_of(criterion).scale_relative * right)
    return verdicts.outcome(criterion, scale.mark, measured, expected, allowed)


# Vectors and links ---------------------------------------------------------------------------------


def segment(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """The outcome of a vector that was drawn (or measured), or of a link of the sketch."""
    one, rubric = charges.task.segments[criterion.name], charges.task.rubric
    follows = rubric.follows_through(criterion)
    with_direction = criterion.direction and drawn.direction_rad is not None
    marked = charges.best(one, _against(charges, criterion, drawn), follows_through=follows)
    mark = marked.mark
    if marked.is_trivial:
        return _too_short(charges, criterion, drawn)
    is_read = drawn is charges.evidence.drawn.get(one.name)
    if is_read:
        mark = charges.opened(one, mark, follows_through=follows)
    if is_read and criterion.optional and not mark.is_certain and drawn.confidence < EVEN:
        # Likelier another stroke than this vector, which need not be there.
        charges.forget(one.name)
        reasons = (Reason("optional"), Reason("doubtful", {"confidence": drawn.confidence}))
        return verdicts.unjudged(criterion, "not_judged", reasons, expected=Quantity())
    scale = charges.used[one.scale]
    value, wrong_value = drawn.length_mm * scale, None
    if one.name in charges.evidence.values:
        value = charges.evidence.values[one.name]
        wrong_value = mark_of_value(charges, criterion, abs(value), marked, drawn)
    is_arithmetic = wrong_value is not None and mark.share == FULL
    if wrong_value is not None:
        mark = the_worse(mark, wrong_value)
    direction = drawn.direction_rad
    on_sheet = None if direction is None else direction + drawn.turn_rad
    return verdicts.outcome(
        criterion,
        mark,
        verdicts.quantity(one.name, drawn.length_mm, on_sheet, value),
        verdicts.expected_quantity(one.name, marked.expected, scale, drawn.turn_rad),
        _full_tolerance(
            charges, criterion, marked.expected, marked.uncertainty, with_direction=with_direction
        ),
        confidence=drawn.confidence,
        followed=marked.is_followed,
        mistake="arithmetic" if is_arithmetic else None,
    )


def _too_short(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """The outcome of a vector that an earlier mistake leaves too short to show anything."""
    least = charges.task.rubric.least_followed_share * abs(
        charges.task.segments[criterion.name].drawn(charges.used)
    )
    short = Reason("too_short_to_judge", {"length_mm": drawn.length_mm, "least_mm": least})
    return verdicts.unjudged(criterion, "not_judged", (short,), expected=Quantity())


def _against(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Against:
    """A function that marks a drawn vector against an expectation, by the rubric and the sheet's cells."""
    rubric = charges.task.rubric
    table, least, rule = rubric.tolerance_of(criterion), rubric.least_confidence, rubric.doubt.in_doubt
    with_direction = criterion.direction and drawn.direction_rad is not None
    is_read = drawn is charges.evidence.drawn.get(criterion.name)
    written = charges.evidence.written.get(criterion.name) if is_read else None
    _, remarks = held_against_cells(drawn, written, table, least)

    def mark_of(one: DrawnVector, expected: complex, uncertainty: EndSpread, se: EndSpread) -> MarkRange:
        size = abs(expected)
        plain = tolerances(table, size, with_direction=with_direction)
        if uncertainty is NO_SPREAD:
            return by_rule(mark_vector(one, expected, plain, table, se), rule)
        allowed = widened(plain, size, uncertainty, rubric.hand.at_most)
        mark = by_rule(mark_vector(one, expected, allowed, table, se), rule)
        is_left_out = size >= SHORT_MM and one.length_mm <= table.length_mm / 2.0
        if mark.is_full or is_left_out:
            return mark
        by_hand = by_rule(mark_vector(one, expected, widened(plain, size, uncertainty), table, se), rule)
        return left_open(mark, ALL_RIGHT if _is_boundless(uncertainty, size) else by_hand)

    def against(
        expected: complex, uncertainty: EndSpread = NO_SPREAD, se: EndSpread = NO_SPREAD
    ) -> MarkRange:
        mark, confidence = mark_of(drawn, expected, uncertainty, se), drawn.confidence
        for other in drawn.if_others():
            # Whichever of them was drawn, the verdict is the same: their probabilities count together.
            same = mark_of(other, expected, uncertainty, se)
            if not mark.is_certain or (same.worst, same.best) != (mark.worst, mark.best):
                break
            confidence = max(confidence, other.confidence)
        mark = verdicts.with_confidence(mark, confidence, rubric.doubt.settle, abs(expected))
        return mark if mark.is_full else replace(mark, reasons=(*remarks, *mark.reasons))

    return against


BOUNDLESS_MM, BOUNDLESS_SHARE = 20.0, 0.5
"""Propagated uncertainty larger than this, and than this share of the vector: the linear propagation no
longer holds, and the error may be anything."""


def _is_boundless(uncertainty: EndSpread, size_mm: float) -> bool:
    """Whether lines cross so badly that the propagated uncertainty has no bound."""
    return max(uncertainty.along, uncertainty.across) > max(BOUNDLESS_MM, BOUNDLESS_SHARE * size_mm)


def _full_tolerance(
    charges: Charges,
    criterion: CriterionTable,
    expected: complex,
    uncertainty: EndSpread,
    *,
    with_direction: bool = False,
) -> Tolerance:
    """What full marks allow on paper; `expected` is complex millimetres."""
    size = abs(expected)
    plain = tolerances(charges.task.rubric.tolerance_of(criterion), size, with_direction=with_direction)
    if uncertainty is NO_SPREAD:
        return plain
    return widened(plain, size, uncertainty, charges.task.rubric.hand.at_most)


def _of_value(on_paper: Tolerance, per_mm: float) -> Tolerance:
    """The tolerance of a value from that of the length it stands for."""
    return Tolerance(value=(on_paper.length_mm or 0.0) * per_mm, widened=on_paper.widened)


# Computed values -----------------------------------------------------------------------------------

LEAST_VALUES = 3
"""So many values with one common factor were computed with a wrong scale; fewer may agree by chance."""
SAME_FACTOR = 0.02
"""Relative difference up to which two factors are the same, with rounding on the way."""
HALF = 0.5
"""The share of a criterion that a right drawing keeps where the rubric has no band of partial points."""


def mark_of_value(
    charges: Charges, criterion: CriterionTable, value: float, marked: ComparedMark, drawn: DrawnVector
) -> MarkRange | None:
    """The mark on a computed value beside its drawing; None where it is right, or right by the drawing.

    A wrong value costs only the value: what the rubric's nearest band takes. A wrong factor in all
    values of a scale costs once.
    """
    one, table = charges.task.segments[criterion.name], charges.task.rubric.tolerance_of(criterion)
    scale = charges.used[one.scale]
    rights = [abs(one.real), abs(marked.expected) * scale, drawn.length_mm * scale]
    factor = common_factor(charges, one.scale)
    if factor is not None and _is_charged(charges, one.scale):
        rights += [right * factor for right in rights]
    limits = [table.length_at(right / scale) * scale for right in rights]
    marks = [
        mark_value(value, right, limit, limit, table, unit_of(one.name))
        for right, limit in zip(rights, limits, strict=True)
    ]
    best = max(marks, key=lambda mark: mark.share)
    if best.is_full:
        return None
    if factor is not None:
        charges.charged.add(_charge_of(one.scale))
    keeps = max(best.share, table.all_bands[0][1] if table.all_bands else HALF)
    return MarkRange(keeps, keeps, keeps, best.reasons)


def value_outcome(charges: Charges, criterion: CriterionTable) -> Outcome:
    """A vector of which only the computed value was handed in, or nothing."""
    one, values = charges.task.segments[criterion.name], charges.evidence.values
    scale = charges.used[one.scale]
    if one.name not in values:
        exact = one.drawn(charges.used)
        return absent(charges, criterion, verdicts.expected_quantity(one.name, exact, scale, 0.0))
    value, unit = abs(values[one.name]), unit_of(one.name)

    def allowed(expected: complex, uncertainty: EndSpread) -> Tolerance:
        return _of_value(_full_tolerance(charges, criterion, expected, uncertainty), scale)

    def against(
        expected: complex, uncertainty: EndSpread = NO_SPREAD, se: EndSpread = NO_SPREAD
    ) -> MarkRange:
        del se
        limit, table = (
            allowed(expected, uncertainty).value or 0.0,
            charges.task.rubric.tolerance_of(criterion),
        )
        plain = table.length_at(abs(expected)) * scale
        return mark_value(value, abs(expected) * scale, limit, plain, table, unit)

    follows = charges.task.rubric.follows_through(criterion)
    marked = charges.best(one, against, follows_through=follows)
    if not marked.mark.is_full and follows:
        marked = _by_factor(charges, one.scale, marked, against)
    measured, right = Quantity(value=values[one.name], unit=unit), abs(marked.expected) * scale
    found = verdicts.outcome(
        criterion,
        marked.mark,
        measured,
        Quantity(value=right, unit=unit),
        allowed(marked.expected, marked.uncertainty),
        followed=marked.is_followed,
    )
    return found if charges.task.rubric.values_alone else verdicts.without_drawing(found)


def _by_factor(charges: Charges, scale: str, marked: ComparedMark, against: Against) -> ComparedMark:
    """The mark of a value that has the common factor: full marks from the second such value on."""
    factor, exact = common_factor(charges, scale), marked.expected
    if factor is None:
        return marked
    mark = against(exact * factor)
    if not _is_charged(charges, scale):
        charges.charged.add(_charge_of(scale))
        return marked
    if not mark.is_better(marked.mark):
        return marked
    follows = Reason("follows", {"what": "scale", "of": scale})
    return ComparedMark(the_better(mark, marked.mark, follows), exact * factor, is_followed=True)


def common_factor(charges: Charges, scale: str) -> float | None:
    """The common factor by which all values of a scale are wrong; None where there is none."""
    if scale not in charges.factors:
        charges.factors[scale] = _common_factor(charges, scale)
    return charges.factors[scale]


def _common_factor(charges: Charges, scale: str) -> float | None:
    task, evidence = charges.task, charges.evidence
    factors = []
    for name, vector in task.construction.vectors.items():
        if vector.scale != scale or name not in evidence.values:
            continue
        drawn = evidence.vector(name)
        length = abs(task.drawn(name, charges.used)) if drawn is None else drawn.length_mm
        if length > task.rubric.tolerance_of(name).least_mm:
            factors.append(abs(evidence.values[name]) / (length * charges.used[scale]))
    if len(factors) < LEAST_VALUES:
        return None
    factor = statistics.median(factors)
    near = [each for each in factors if abs(each - factor) <= SAME_FACTOR * factor]
    is_wrong = abs(factor - 1.0) > 2.0 * task.rubric.tolerance_of(scale).scale_relative
    return factor if is_wrong and len(near) >= max(LEAST_VALUES, len(factors) - 1) else None


def _charge_of(scale: str) -> str:
    return f"values by {scale}"


def _is_charged(charges: Charges, scale: str) -> bool:
    return _charge_of(scale) in charges.charged


# What was not handed in, or not read ---------------------------------------------------------------


PROBABLY_NOT_DRAWN = 0.9
"""That a vector was not drawn, where no ink lies along it and an end was not read for certain."""
NOT_DRAWN = 0.98
"""That a vector was not drawn, where both its ends were read for certain and no ink lies between them."""


def absent(charges: Charges, criterion: CriterionTable, expected: Quantity) -> Outcome:
    """The outcome of a criterion for which nothing was handed in or read."""
    rubric, evidence = charges.task.rubric, charges.evidence
    unread = _why_unread(charges, criterion)
    reason = (
        Reason("not_measured")
        if unread is None
        else Reason("unread", {"why": unread.code, **unread.parameters})
    )
    if criterion.optional:
        return verdicts.unjudged(criterion, "not_judged", (Reason("optional"), reason), expected=expected)
    if criterion.link is not None and not evidence.has_sketch:
        # Links are drawn, not measured: without a sketch that was read nothing is asked of them.
        return verdicts.unjudged(criterion, "not_judged", (reason,), expected=expected)
    least, length = rubric.tolerance_of(criterion).least_mm, expected.length_mm
    if length is not None and length < least:
        short = Reason("too_short_to_judge", {"length_mm": length, "least_mm": least})
        return verdicts.unjudged(criterion, "not_judged", (short, reason), expected=expected)
    segment = charges.task.segments.get(criterion.name)
    if not evidence.has_sheets:
        blank = "none" if rubric.missing == "review" else rubric.missing
        if segment is not None and _is_nothing(charges, criterion, segment):
            short = Reason("too_short_to_judge", {"length_mm": 0.0, "least_mm": least})
            return verdicts.unjudged(criterion, "not_judged", (short, reason), expected=expected)
        _leave_out(charges, segment, blank)
        return verdicts.unjudged(criterion, blank, (reason,), expected=expected)
    is_missing = is_not_drawn(charges.task, evidence, criterion.name, length or 0.0)
    if is_missing or (segment is not None and charges.following.is_left_out(segment.head)):
        _leave_out(charges, segment, rubric.missing)
        return verdicts.unjudged(
            criterion, rubric.missing, (Reason("not_drawn"),), expected=expected, sure=NOT_DRAWN
        )
    _leave_out(charges, segment, "review")
    sure = PROBABLY_NOT_DRAWN if criterion.name in evidence.blank else EVEN
    return verdicts.unjudged(criterion, "review", (reason,), expected=expected, sure=sure)


NOTHING = DrawnVector(0.0, 0.0, None, 0.0, 1.0)
"""A component left blank, as it is compared: a zero."""


def _is_nothing(charges: Charges, criterion: CriterionTable, segment: TaskSegment) -> bool:
    """Whether an earlier mistake leaves a component too short to be drawn."""
    follows = charges.task.rubric.follows_through(criterion)
    if not follows or not isinstance(charges.task.construction.step(segment.head), Given):
        return False
    marked = charges.best(segment, _against(charges, criterion, NOTHING), follows_through=True)
    return marked.is_trivial or marked.mark.is_full


def _leave_out(charges: Charges, segment: TaskSegment | None, verdict: Verdict) -> None:
    """Record what was not handed in: a component left out has cost its points, all else stays in doubt."""
    if segment is None:
        return
    is_component = isinstance(charges.task.construction.step(segment.head), Given)
    (charges.charged if is_component and verdict == "none" else charges.doubtful).add(segment.head)


def is_not_drawn(task: Task, evidence: Evidence, name: str, length_mm: float) -> bool:
    """Whether a vector of this expected length is not on the sheet, though both its ends were read."""
    vector = task.construction.vectors.get(name)
    if vector is None or name not in evidence.blank or length_mm < SHORT_MM:
        return False
    return {vector.tail, vector.head} <= {*evidence.nodes, *task.construction.poles.values()}


def _why_unread(charges: Charges, criterion: CriterionTable) -> Reason | None:
    """Why a vector or link was not read, None where no sheet could show it."""
    segment, evidence = charges.task.segments.get(criterion.name), charges.evidence
    if segment is None or not evidence.has_sheets:
        return None
    for name in (segment.name, segment.head, segment.tail):
        if name in evidence.unread:
            return evidence.unread[name]
    return Reason("not_found", {"name": segment.name})


# Angular quantities --------------------------------------------------------------------------------


NO_NODES: Mapping[str, complex] = {}


def rate(charges: Charges, criterion: CriterionTable) -> Outcome:
    """An angular quantity against the exact one, then against what the student's own vector gives."""
    task, name, unit = charges.task, criterion.name, unit_of(criterion.name)
    right = task.rates[name]
    if name not in charges.evidence.values:
        return absent(charges, criterion, Quantity(value=right, unit=unit))
    value, table = charges.evidence.values[name], task.rubric.tolerance_of(criterion)
    turned = task.construction.rates[name]
    segment = task.segments[turned.vector]
    scale = charges.used[segment.scale]
    per_mm = scale / task.lengths_m[name]
    plain = table.length_at(abs(right) / per_mm) * per_mm
    allowed = Tolerance(value=plain)
    mark, followed = mark_value(value, right, plain, plain, table, unit), False
    if not mark.is_full:
        # It is as uncertain as the vector that turns the link.
        exact = segment.drawn(charges.used)
        uncertainty = charges.following.uncertainty_of(segment, exact)
        allowed = _of_value(_full_tolerance(charges, criterion, exact, uncertainty), per_mm)
        mark = mark_value(value, right, allowed.value or 0.0, plain, table, unit)
    charges.remember(name, mark)
    follows = task.rubric.follows_through(criterion)
    own = None
    if follows and not mark.is_full:
        own = rate_from_vector(task, charges.evidence, turned, scale, charges.following.nodes_instead())
        drawn = charges.evidence.vector(turned.vector)
        is_made_wrongly = segment.head in charges.charged | charges.doubtful
        if own is not None and drawn is not None and drawn.direction_rad is None and is_made_wrongly:
            # Which way it points is not known.
            own = math.copysign(own, value)
    factor = common_factor(charges, segment.scale)
    if own is None and factor is not None and follows and not mark.is_full:
        own = right
    if own is not None:
        # A common factor of all values is also that of the angular one.
        own = own if factor is None else min(own, own * factor, key=lambda one: abs(one - value))
        limit = table.length_at(abs(own) / per_mm) * per_mm
        source = Expectation(own, "vector", turned.vector, frozenset({segment.head}))
        candidate = charges.allowed(source, mark_value(value, own, limit, limit, table, unit))
        if candidate.is_better(mark):
            follows_from = Reason("follows", {"what": "vector", "of": turned.vector})
            mark, right, followed = the_better(candidate, mark, follows_from), own, True
    measured, expected = Quantity(value=value, unit=unit), Quantity(value=right, unit=unit)
    return verdicts.outcome(criterion, mark, measured, expected, allowed, followed=followed)


def rate_from_vector(
    task: Task, evidence: Evidence, rate: AngularRate, scale: float, instead: Mapping[str, complex] = NO_NODES
) -> float | None:
    """The angular rate that the student's own vector gives; None without one, or a trivial one.

    Arguments: `scale` is the vector's, real units per drawn millimetre; `instead` are the nodes of another
    mechanism that was certainly drawn and not handed in. Where the own vector's direction is not known, the
    sense is the right one's, or the other mechanism's.
    """
    own = evidence.vector(rate.vector)
    if own is None or own.length_mm < task.rubric.tolerance_of(rate.vector).least_mm:
        return None
    sense = _own_sense(task, evidence, rate, instead)
    return sense * own.length_mm * scale / own_length(task, evidence, rate)


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


def _own_sense(task: Task, evidence: Evidence, rate: AngularRate, instead: Mapping[str, complex]) -> float:
    """+1 where the own vector turns its link counter-clockwise: the link as drawn where it was read."""
    own, along = evidence.vector(rate.vector), task.real[rate.vector]
    vector = task.construction.vectors[rate.vector]
    plan = task.construction.figure_of(vector.head)
    joints = instead or evidence.sketches.get(plan, evidence.nodes)
    tail, head = (joints.get(joint) for joint in rate.link)
    direction = None if own is None else own.direction_rad
    if direction is None and not instead:
        return math.copysign(1.0, task.rates[rate.name])
    if direction is None:
        direction = cmath.phase(instead[vector.head] - instead[vector.tail])
    if tail is not None and head is not None:
        return math.copysign(1.0, math.sin(direction - cmath.phase(head - tail)))
    sense = math.copysign(1.0, task.rates[rate.name])
    return sense if along == 0 else sense * math.copysign(1.0, math.cos(direction - cmath.phase(along)))
