"""Judge all criteria of a rubric in the order of construction, so that earlier mistakes are known.

`compare(task, submission)` marks each criterion in three steps. `FollowThrough.expectations` lists what may
be expected: the original data at the student's scales, what follows from the student's own earlier values,
what each explanation predicts. `choose` takes the one that counts, and `Charges.record` notes what that has
shown. A mistake from which later values follow costs once: where it was made, or, where no criterion asks for
that, at the first criterion that shows it. Small errors that are each within their tolerance and add up in a
later node are no mistake. Verdicts are `Outcome`s with reasons as data (`grader.outcomes`).
"""

import math
import statistics
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import partial

from grader.comparison.charges import Charges, Choice, choose
from grader.comparison.evidence import DrawnVector, Evidence, Submission, gather
from grader.comparison.follow_through import Explain, FollowThrough, ReplayResult, nothing_explained
from grader.comparison.on_sketch import judged_on_sketch
from grader.comparison.outcomes import (
    both,
    entry_refused,
    expected_quantity,
    outcome_of,
    quantity,
    unjudged,
    with_images,
    without_drawing,
)
from grader.comparison.own import fits, known, own_rate
from grader.comparison.scales import Scale, settle
from grader.comparison.task import Task, TaskSegment
from grader.comparison.verdicts import (
    FULL,
    HALF,
    NONE,
    SHORT_MM,
    Expectation,
    Held,
    HeldValue,
    HeldVector,
    MarkRange,
    open_between,
    the_better,
    the_worse,
    widened,
    with_confidence,
)
from grader.documents import Quantity, Tolerance, Verdict
from grader.outcomes import CHARGED, EVEN, Outcome, UsedScale
from grader.records import Reason
from grader.rubric import CriterionTable
from reference.authored.assignment import SCALE_NAMES
from reference.construction.elements import is_force
from reference.construction.graph import AngularRate
from reference.construction.mistakes import line_of
from reference.construction.steps import Divide, Given, Similar
from reference.construction.uncertainty import EndSpread
from reference.quantities import group_of, kind_of, unit_of, vector_of_value


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
    search = partial(explain, task, evidence, settled)
    used = {name: scale.used.used for name, scale in settled.items()}
    followed = {name: scale.followed for name, scale in settled.items()}
    following = FollowThrough(task, evidence, used, followed, search)
    charges = Charges(task, evidence, settled, following)
    judged = {criterion.id: _outcome(charges, criterion) for criterion in _in_order(following)}
    outcomes = with_images(task, judged)
    return Comparison(
        outcomes=tuple(outcomes[criterion.id] for criterion in task.rubric.criterion),
        scales={name: scale.used for name, scale in settled.items()},
        evidence=evidence,
        settled=settled,
        explanation=following.found,
    )


def _outcome(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The verdict on one criterion, open where it depends on an entry that cannot be used."""
    outcome, name, evidence = _judged(charges, criterion), criterion.name, charges.evidence
    entry = evidence.refused.get(criterion.turning or name)
    if entry is None and outcome.verdict in CHARGED:
        entry = _refused_below(charges, name)
    if entry is not None:
        charges.decided(name, "review")
        return entry_refused(outcome, entry)
    if outcome.verdict == "review" and name in evidence.verdicts:
        charges.decided(name, evidence.verdicts[name])
    return outcome


def _refused_below(charges: Charges, name: str) -> tuple[str, ...] | None:
    """The entry for the scale, or for a node from which a vector is made, that cannot be used."""
    task, evidence = charges.task, charges.evidence
    turned = task.construction.rates.get(name.removesuffix("_sense"))
    if turned is not None and turned.drives:
        return None
    segment = task.segments.get((vector_of_value(name) or name) if turned is None else turned.vector)
    moment = task.construction.moments.get(name.removesuffix("_sense"))
    if moment is not None:
        needs, own = moment.needs, ["kF"]
    elif segment is not None:
        needs, own = task.construction.step(segment.head).needs, [segment.scale, segment.name]
    else:
        return None
    ends = {need for need in needs if need not in evidence.nodes}
    vectors = [vector.name for vector in task.segments.values() if vector.head in ends]
    below = [name for name in (*own, *vectors) if name in evidence.refused]
    return evidence.refused[below[0]] if below else None


def _judged(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The verdict on what can be used; its cost is recorded in the charges."""
    if criterion.scale is not None:
        return _scale(charges, criterion)
    if criterion.turning is not None:
        return _rate(charges, criterion)
    if criterion.value is not None:
        return _computed(charges, criterion, criterion.value)
    if criterion.is_on_sketch:
        return judged_on_sketch(charges, criterion) or _absent(charges, criterion, Quantity())
    sources = (charges.evidence.drawn.get(criterion.name), charges.evidence.measured.get(criterion.name))
    outcomes = [_segment(charges, criterion, drawn) for drawn in sources if drawn is not None]
    if len(outcomes) == 2:
        return both(outcomes[0], outcomes[1], charges.task.rubric.tolerance_of(criterion).length_mm)
    return outcomes[0] if outcomes else _value(charges, criterion)


# The order of construction -------------------------------------------------------------------------

ORDER = ("length", "velocity", "omega", "acceleration", "epsilon", "force", "moment")
"""Kinds of quantities as they are drawn and computed."""


def _in_order(following: FollowThrough) -> list[CriterionTable]:
    """The criteria as they are drawn: the driving omega, scales, sketch, plans, what is added to the sketch.

    Forces that act come before what is made from them. Of vectors that end at one node, those on wrong lines
    come first; a computed value comes after its vector. The rubric's order changes nothing.
    """
    task = following.task
    steps = {step.node: place for place, step in enumerate(task.construction.steps)}
    names, plans = list(task.segments), list(task.construction.figures)

    def place(criterion: CriterionTable) -> tuple[int, ...]:
        name = criterion.value or criterion.name
        if criterion.turning in task.construction.driving:
            return (-2,)
        if criterion.scale is not None:
            return -1, SCALE_NAMES.index(name)
        if criterion.is_on_sketch:
            return (len(ORDER),)
        kind = ORDER.index("length" if criterion.link else kind_of(name).name)
        if name not in task.segments:
            return kind, 0
        one = task.segments[name]
        is_value, step = int(criterion.value is not None), task.construction.step(one.head)
        is_made = not (isinstance(step, Given) and is_force(step.length) and step.start == one.tail)
        where = plans.index(task.construction.figure_of(one.head)), int(is_made), steps[one.head]
        return kind, *where, _rank(following, one), names.index(name), is_value

    return sorted(task.rubric.criterion, key=place)


def _rank(following: FollowThrough, segment: TaskSegment) -> int:
    """The order of vectors that end at one node: first those on wrong lines, then those on right ones.

    A node that is made rightly needs no order.
    """
    task, evidence, head = following.task, following.evidence, segment.head
    is_known = head in evidence.nodes or head in known(following.own(following.used))
    if segment.scale == "kL" or not is_known or head not in following.causes_at(head, frozenset()):
        return 0
    if line_of(task.construction.vectors[segment.name], task.construction) is None:
        return 2
    line, own = following.on_own_line(segment), evidence.vector(segment.name)
    if line is None or own is None:
        basis = following.instead
        return int(basis is not None and not basis.blames(segment.name, head))
    if following.starts_elsewhere(segment, own):
        return 0
    # Whether it lies along its line, one way or the other; a very short one may.
    table, size = task.rubric.tolerance_of(segment.name), own.length_mm
    if size < table.least_mm:
        return 1
    allowed = widened(table, task.rubric.hand.at_most, replace(line, vector=size)).direction_deg
    return int(math.degrees(math.acos(min(abs(line.vector) / size, 1.0))) <= (allowed or 0.0))


# Scales, vectors and links -------------------------------------------------------------------------


def _scale(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The outcome of a declared scale."""
    name, unit = criterion.name, unit_of(criterion.name)
    scale, right = charges.settled[name], charges.following.followed[name]
    expected = Quantity(value=right, unit=unit)
    if scale.mark is None:
        if scale.used.text is None and not criterion.optional:
            return _absent(charges, criterion, expected)
        return unjudged(criterion, "not_judged", scale.reasons, expected=expected)
    charges.remember(name, scale.mark)
    measured = Quantity(value=scale.used.declared, unit=unit)
    allowed = Tolerance(value=charges.task.rubric.tolerance_of(criterion).scale_relative * right)
    return outcome_of(criterion, scale.mark, measured, expected, allowed)


def _chosen(charges: Charges, criterion: CriterionTable, held: Held) -> Choice:
    """The expectation of a vector or link that counts; what it has shown is recorded."""
    segment, follows = charges.task.segments[criterion.name], charges.task.rubric.follows_through(criterion)
    wrong = frozenset(charges.charged | charges.doubtful)
    expectations = charges.following.expectations(segment, wrong, follows_through=follows)
    choice = choose(charges, segment, expectations, held)
    charges.record(segment, choice)
    return choice


def _segment(charges: Charges, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """The outcome of a vector that was drawn (or measured), or of a link of the sketch."""
    one, rubric, evidence = charges.task.segments[criterion.name], charges.task.rubric, charges.evidence
    is_read = drawn is evidence.drawn.get(one.name)
    right_mm = abs(one.drawn(charges.following.used))
    held = HeldVector(rubric, criterion, drawn, right_mm)
    choice = _chosen(charges, criterion, held)
    mark, scale = choice.mark, charges.following.used[one.scale]
    if choice.is_trivial:
        return unjudged(criterion, "not_judged", (Reason("made_trivial"),), expected=Quantity())
    if is_read and rubric.follows_through(criterion):
        mark = charges.opened(one, mark)
    if is_read and criterion.optional and not mark.is_certain and drawn.confidence < EVEN:
        # Likelier another stroke than this vector, which need not be there.
        charges.forget(one.name)
        reasons = (Reason("optional"), Reason("doubtful", {"confidence": drawn.confidence}))
        return unjudged(criterion, "not_judged", reasons, expected=Quantity())
    wrong_value = _mark_of_value(charges, criterion, choice, drawn)
    is_arithmetic = wrong_value is not None and mark.share == FULL
    if wrong_value is not None:
        mark = the_worse(mark, wrong_value)
    on_sheet = None if drawn.direction_rad is None else drawn.direction_rad + drawn.turn_rad
    has_value = one.name in evidence.values and one.name not in rubric.values
    value = evidence.values[one.name] if has_value else drawn.length_mm * scale
    return outcome_of(
        criterion,
        mark,
        quantity(one.name, drawn.length_mm, on_sheet, value),
        expected_quantity(one.name, choice.expectation.vector, scale, drawn.turn_rad),
        held.allowed(choice.expectation),
        confidence=drawn.confidence,
        followed=choice.is_followed,
        mistake="arithmetic" if is_arithmetic else None,
    )


# Computed values -----------------------------------------------------------------------------------

LEAST_VALUES = 3
"""Number of values with one common factor that show a wrong scale; fewer may agree by chance."""
SAME_FACTOR = 0.02
"""Relative difference up to which two factors are the same, with rounding on the way."""


def _mark_of_value(
    charges: Charges, criterion: CriterionTable, choice: Choice, drawn: DrawnVector
) -> MarkRange | None:
    """The mark on a computed value beside its drawing; None where it is right, or right by the drawing.

    None, too, where it has a criterion of its own: it is judged there. A wrong value costs only the value:
    what the rubric's nearest band takes. A wrong factor in all values of a scale costs once.
    """
    one, rubric, values = charges.task.segments[criterion.name], charges.task.rubric, charges.evidence.values
    if one.name not in values or one.name in rubric.values:
        return None
    held = HeldValue(rubric, criterion, abs(values[one.name]), charges.following.used[one.scale])
    rights_mm = [abs(one.real) / held.per_mm, abs(choice.expectation.vector), drawn.length_mm]
    factor, charge = _common_factor(charges, one.scale), _charge_of(one.scale)
    if factor is not None and charge in charges.charged:
        rights_mm += [right * factor for right in rights_mm]
    best = max((held.against(Expectation(right)) for right in rights_mm), key=lambda mark: mark.share)
    if best.is_full:
        return None
    if factor is not None:
        charges.charged.add(charge)
    bands = rubric.tolerance_of(criterion).all_bands
    keeps = max(best.share, bands[0][1] if bands else HALF)
    return MarkRange(keeps, keeps, keeps, best.reasons)


def _value(charges: Charges, criterion: CriterionTable) -> Outcome:
    """The outcome of a vector of which only the computed value was handed in, or nothing."""
    one, values, rubric = charges.task.segments[criterion.name], charges.evidence.values, charges.task.rubric
    used, scale = charges.following.used, charges.following.used[one.scale]
    may_be_drawn = charges.evidence.has_sheets and one.name in rubric.values and not rubric.values_alone
    if one.name not in values or may_be_drawn:
        expected = expected_quantity(one.name, one.drawn(used), scale, one.turn_rad)
        return _absent(charges, criterion, expected)
    held = HeldValue(rubric, criterion, abs(values[one.name]), scale)
    choice = _chosen(charges, criterion, held)
    if not choice.mark.is_full and rubric.follows_through(criterion):
        choice = _by_factor(charges, one.scale, choice, held)
    found = _of_value(held, choice, choice.mark, values[one.name])
    return found if rubric.values_alone else without_drawing(found)


def _computed(charges: Charges, criterion: CriterionTable, name: str) -> Outcome:
    """The outcome of a computed value with a criterion of its own, beside its vector's.

    It is right by the data, by the length that was drawn times the scale used, or, where none was, by what
    follows. A number read in a sheet's cells that is off goes to a person: a digit may have been misread.
    """
    one, rubric, evidence = charges.task.segments[name], charges.task.rubric, charges.evidence
    following, follows = charges.following, rubric.follows_through(criterion)
    if name not in evidence.values:
        expected = Quantity(value=abs(one.real), unit=unit_of(name))
        length, least = abs(one.drawn(following.used)), rubric.tolerance_of(criterion).least_mm
        if length < least and not criterion.optional:
            short = Reason("too_short_to_judge", {"length_mm": length, "least_mm": least})
            return unjudged(criterion, "not_judged", (short, Reason("not_measured")), expected=expected)
        return _absent(charges, criterion, expected)
    value, drawn, sure = evidence.values[name], evidence.vector(name), evidence.sure.get(name, 1.0)
    held = HeldValue(rubric, criterion, abs(value), following.used[one.scale])
    wrong = frozenset(charges.charged | charges.doubtful)
    by_nodes = follows and (drawn is None or _may_be_mistyped(charges, one))
    choice = choose(charges, one, following.expectations(one, wrong, follows_through=by_nodes), held)
    charges.charged |= choice.shown
    if not choice.mark.is_full and follows and drawn is not None:
        own = Expectation(complex(drawn.length_mm), "vector", name, frozenset({one.head}))
        mark, shown = charges.credited(own, held.against(own))
        charges.charged |= shown
        if mark.is_better(choice.mark):
            choice = Choice(the_better(mark, choice.mark, *charges.why(own)), own, is_followed=True)
    if not choice.mark.is_full and follows:
        choice = _by_factor(charges, one.scale, choice, held)
    mark = with_confidence(choice.mark, sure, rubric.doubt.settle)
    if name in evidence.sure and not choice.mark.is_full:
        mark = open_between(NONE, FULL, choice.mark, Reason("cells_off"), sure=sure)
    is_slip = mark.best != FULL and drawn is not None and drawn.confidence >= rubric.least_confidence
    outcome = _of_value(held, choice, mark, value)
    return replace(outcome, confidence=sure, mistake="arithmetic" if is_slip else None)


def _of_value(held: HeldValue, choice: Choice, mark: MarkRange, value: float) -> Outcome:
    unit, one = unit_of(held.criterion.name), choice.expectation
    measured, expected = Quantity(value=value, unit=unit), Quantity(value=held.expected(one), unit=unit)
    return outcome_of(
        held.criterion, mark, measured, expected, held.allowed(one), followed=choice.is_followed
    )


def _by_factor(charges: Charges, scale: str, choice: Choice, held: HeldValue) -> Choice:
    """The choice for a value that has the common factor: full marks from the second such value on."""
    factor, charge = _common_factor(charges, scale), _charge_of(scale)
    if factor is None:
        return choice
    if charge not in charges.charged:
        charges.charged.add(charge)
        return choice
    one = Expectation(choice.expectation.vector * factor)
    mark = held.against(one)
    if not mark.is_better(choice.mark):
        return choice
    follows = Reason("follows", {"what": "scale", "of": scale})
    return Choice(the_better(mark, choice.mark, follows), one, is_followed=True)


def _charge_of(scale: str) -> str:
    return f"values by {scale}"


def _common_factor(charges: Charges, scale: str) -> float | None:
    """The common factor by which all values of a scale are wrong; None where there is none."""
    task, evidence, used = charges.task, charges.evidence, charges.following.used
    factors = []
    for name, vector in task.construction.vectors.items():
        is_sure = evidence.sure.get(name, 1.0) >= task.rubric.least_confidence
        if vector.scale != scale or name not in evidence.values or not is_sure:
            continue
        drawn = evidence.vector(name)
        length = abs(task.segments[name].drawn(used)) if drawn is None else drawn.length_mm
        if length > task.rubric.tolerance_of(name).least_mm:
            factors.append(abs(evidence.values[name]) / (length * used[scale]))
    if len(factors) < LEAST_VALUES:
        return None
    factor = statistics.median(factors)
    near = [each for each in factors if abs(each - factor) <= SAME_FACTOR * factor]
    is_wrong = abs(factor - 1.0) > 2.0 * task.rubric.tolerance_of(scale).scale_relative
    return factor if is_wrong and len(near) >= max(LEAST_VALUES, len(factors) - 1) else None


# What was not handed in, or not read ---------------------------------------------------------------

PROBABLY_NOT_DRAWN = 0.9
"""Probability that a vector was not drawn if no ink lies along it and an end was not read for certain."""
NOT_DRAWN = 0.98
"""Probability that it was not drawn if its ends are known for certain and no ink is between them.

Of 12 between a pole and a point by similarity, on 80 simulated sheets, none was drawn."""
NOTHING = DrawnVector(0.0, 0.0, None, 0.0, 1.0)
"""A component left blank, as it is compared: a zero."""


def _absent(charges: Charges, criterion: CriterionTable, expected: Quantity) -> Outcome:
    """The outcome of a criterion for which nothing was handed in or read."""
    rubric, evidence, following = charges.task.rubric, charges.evidence, charges.following
    segment, reason = charges.task.segments.get(criterion.name), _why_absent(charges, criterion)
    left = partial(unjudged, criterion, expected=expected)
    if criterion.optional:
        return left("not_judged", (Reason("optional"), reason))
    if criterion.link is not None and not evidence.has_sketch:
        # Links are drawn, not measured: without a sketch that was read nothing is asked of them.
        return left("not_judged", (reason,))
    least, length = rubric.tolerance_of(criterion).least_mm, expected.length_mm
    is_blank = segment is not None and not evidence.has_sheets
    if length is not None and length >= least and is_blank and _is_nothing(charges, criterion):
        length = 0.0
    if length is not None and length < least:
        short = Reason("too_short_to_judge", {"length_mm": length, "least_mm": least})
        if segment is not None and is_blank:
            # What follows without it counts.
            charges.either.add(segment.head)
        return left("not_judged", (short, reason))
    if not evidence.has_sheets:
        blank = "none" if rubric.missing == "review" else rubric.missing
        _leave_out(charges, segment, blank)
        return left(blank, (reason,))
    why_lost = _why_not_drawn(charges.task, evidence, criterion.name, length or 0.0)
    if segment is not None and segment.head in following.explanation.left_out:
        why_lost = Reason("not_drawn")
    if why_lost is not None:
        _leave_out(charges, segment, rubric.missing)
        return left(rubric.missing, (why_lost,), sure=NOT_DRAWN)
    _leave_out(charges, segment, "review")
    sure = PROBABLY_NOT_DRAWN if criterion.name in evidence.blank else EVEN
    return left("review", (reason,), sure=sure)


def _why_absent(charges: Charges, criterion: CriterionTable) -> Reason:
    """Return why a vector or link was not read, or that it was not measured if no sheet could show it."""
    segment, evidence = charges.task.segments.get(criterion.name), charges.evidence
    if segment is None or not evidence.has_sheets:
        return Reason("not_measured")
    names = (segment.name, segment.head, segment.tail)
    known_why = (evidence.unread[name] for name in names if name in evidence.unread)
    why = next(known_why, Reason("not_found", {"name": segment.name}))
    return Reason("unread", {"why": why.code, **why.parameters})


def _is_nothing(charges: Charges, criterion: CriterionTable) -> bool:
    """Return whether an earlier mistake leaves a component of a plan that was drawn too short to be drawn."""
    task, construction = charges.task, charges.task.construction
    head = task.segments[criterion.name].head
    if not isinstance(construction.step(head), Given) or not task.rubric.follows_through(criterion):
        return False
    plan = construction.vectors_of(construction.figure_of(head))
    if all(charges.evidence.vector(one.name) is None for one in plan):
        return False
    choice = _chosen(charges, criterion, HeldVector(task.rubric, criterion, NOTHING))
    return choice.is_trivial or choice.mark.is_full


def _leave_out(charges: Charges, segment: TaskSegment | None, verdict: Verdict) -> None:
    """Record what was not handed in: a component left out has cost its points, all else stays in doubt."""
    vector = None if segment is None else charges.task.construction.vectors.get(segment.name)
    if segment is None or (vector is not None and vector.is_sum):
        return
    is_component = isinstance(charges.task.construction.step(segment.head), Given)
    (charges.charged if is_component and verdict == "none" else charges.doubtful).add(segment.head)


def _why_not_drawn(task: Task, evidence: Evidence, name: str, length_mm: float) -> Reason | None:
    """Return why a vector of this expected length is surely not drawn rightly; None if it may be.

    Both its ends were read, or its head is the image of a link's point, and the other nodes of its link were
    read: it may be drawn elsewhere, wrongly. The sum of parts of a force can be measured between them.
    """
    construction, read = task.construction, evidence.nodes.keys()
    vector = construction.vectors.get(name)
    if vector is None or name not in evidence.blank or length_mm < SHORT_MM:
        return None
    if vector.is_sum and group_of(construction.figure_of(vector.head)):
        return None
    step = construction.step(vector.head)
    if {vector.tail, vector.head} <= read:
        return Reason("not_drawn")
    is_placed = isinstance(step, Divide | Similar) and {vector.tail, *step.base} <= read
    return Reason("no_line") if is_placed else None


# Angular quantities --------------------------------------------------------------------------------


def _rate(charges: Charges, criterion: CriterionTable) -> Outcome:
    """An angular quantity, a moment, or its sense, against the exact one, then what the own drawing gives.

    That of the driving link follows from the data alone. One read in a sheet's cells that is off goes to a
    person, as a computed value does.
    """
    task, following, values = charges.task, charges.following, charges.evidence.values
    name, unit = criterion.turning or "", unit_of(criterion.turning or "")
    rate, right = task.construction.rates.get(name), task.rates[name]
    value, sense = values.get(name), values.get(f"{name}_sense")
    if criterion.sense is not None:
        # A magnitude alone has none.
        value = sense or min(value or 0.0, 0.0) or None
    if value is None:
        expected = Quantity() if criterion.sense else Quantity(value=right, unit=unit)
        return _absent(charges, criterion, expected)
    table = task.rubric.tolerance_of(criterion)
    per_mm = table.scale_relative * abs(right) / table.length_mm or 1.0
    if rate is not None and not rate.drives:
        per_mm = following.used[task.segments[rate.vector].scale] / task.lengths_m[name]
    held = HeldValue(task.rubric, criterion, value, per_mm, sense)
    exact = Expectation(right / held.per_mm)
    right, mark = held.expected(exact), held.against(exact)
    is_drawn = rate is None or not rate.drives
    if not mark.is_full and is_drawn:
        exact = replace(exact, uncertainty=_uncertainty_of(charges, name, per_mm))
        mark = held.against(exact)
    charges.remember(criterion.name, mark)
    followed = False
    if not mark.is_full and is_drawn and task.rubric.follows_through(criterion):
        own, mark = _by_own_drawing(charges, held, name, mark)
        if own is not None:
            right, followed = own.vector.real * per_mm, True
            if mark.is_full and rate and following.is_trivial(task.segments[rate.vector], own.vector):
                return unjudged(criterion, "not_judged", (Reason("made_trivial"),), expected=Quantity())
    read = charges.evidence.sure
    sure = min(read.get(f"{name}_sense", 1.0), 1.0 if criterion.sense else read.get(name, 1.0))
    mark = with_confidence(mark, sure, task.rubric.doubt.settle)
    if criterion.sense is not None:
        return outcome_of(criterion, mark, Quantity(), Quantity(), Tolerance(), followed=followed)
    if name in read and not mark.is_full:
        mark = open_between(NONE, FULL, mark, Reason("cells_off"), sure=sure)
    measured, expected = Quantity(value=value, unit=unit), Quantity(value=right, unit=unit)
    allowed = held.allowed(exact)
    return outcome_of(criterion, mark, measured, expected, allowed, confidence=sure, followed=followed)


def _uncertainty_of(charges: Charges, name: str, per_mm: float) -> EndSpread:
    """The propagated drafting error: of an angular quantity, that of the vector that turns the link."""
    task, following = charges.task, charges.following
    if name in task.construction.moments:
        return following.moment(name, per_mm).uncertainty
    source = task.segments[task.construction.rates[name].vector]
    return following.uncertainty_of(source, source.drawn(following.used))


def _by_own_drawing(
    charges: Charges, held: HeldValue, name: str, mark: MarkRange
) -> tuple[Expectation | None, MarkRange]:
    """Return what the student's own drawing gives where that earns more than a mark; and the better mark."""
    best = None
    for one in _own_turnings(charges, name, held.value, held.per_mm):
        candidate, shown = charges.credited(one, held.against(one))
        charges.charged |= shown
        if candidate.is_better(mark):
            best, mark = one, the_better(candidate, mark, *charges.why(one))
    return best, mark


def _own_turnings(charges: Charges, name: str, value: float, per_mm: float) -> Iterator[Expectation]:
    """Yield the angular quantity or moment that the student's own drawing gives; none without any."""
    task, following = charges.task, charges.following
    if name in task.construction.moments:
        yield (by_nodes := following.moment(name, per_mm))
        if charges.is_wrong(by_nodes):
            yield following.moment(name, per_mm, as_laid_off=True)
        wrong = frozenset(charges.charged | charges.doubtful)
        scales = replace(following.right(following.followed), name="scales", wrong=following.wrong_scales)
        own = following.own_forces(name, wrong)
        for basis in (scales if scales.wrong else None, own, following.instead):
            if basis is not None:
                yield following.moment(name, per_mm, basis)
        for heads, other in following.entered_otherwise(name, wrong):
            yield replace(other.moment(name, per_mm), causes=heads)
        return
    rate = task.construction.rates[name]
    turned, source = _own_rate(charges, rate, value), task.segments[rate.vector]
    if turned is not None:
        yield Expectation(turned / per_mm, "vector", source.name, frozenset({source.head}))
    if _may_be_mistyped(charges, source) and source.real:
        right = task.rates[name] / per_mm / source.real
        wrong = frozenset(charges.charged | charges.doubtful)
        for one in following.expectations(source, wrong, follows_through=True):
            yield replace(one, vector=complex((right * one.vector * following.used[source.scale]).real))


def _may_be_mistyped(charges: Charges, one: TaskSegment) -> bool:
    """Return whether a vector may be wrong in its entry alone: values come from the drawing, not from it."""
    drawn, exact = charges.evidence.vector(one.name), one.drawn(charges.following.used)
    if drawn is None or one.head not in charges.charged or charges.evidence.has_sheets:
        return False
    return not fits(drawn, exact, charges.task.rubric.tolerance_of(one.name))


def _own_rate(charges: Charges, rate: AngularRate, value: float) -> float | None:
    """The angular rate that the student's own vector gives; of two senses or factors, the nearer.

    A common factor of all values is also that of the angular one. Arguments: `value` is the one computed.
    """
    task, evidence, following = charges.task, charges.evidence, charges.following
    segment, drawn = task.segments[rate.vector], evidence.vector(rate.vector)
    own = own_rate(task, evidence, rate, following.used[segment.scale], following.nodes_instead())
    is_made_wrongly = segment.head in charges.charged | charges.doubtful
    is_turned = drawn is not None and drawn.direction_rad is not None
    if own is not None and is_made_wrongly and (not is_turned or following.turns_neither_way(rate.vector)):
        own = math.copysign(own, value)
    factor = _common_factor(charges, segment.scale)
    if factor is None:
        return own
    own = task.rates[rate.name] if own is None else own
    return min(own, own * factor, key=lambda one: abs(one - value))
