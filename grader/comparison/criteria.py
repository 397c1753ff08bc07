"""All criteria of a rubric, marked in the order of construction so that earlier mistakes are known."""

from collections.abc import Mapping
from dataclasses import dataclass

from grader.comparison import verdicts
from grader.comparison.absent import absent
from grader.comparison.evidence import Evidence, Submission, gather
from grader.comparison.ledger import Ledger, open_ledger
from grader.comparison.rates import rate
from grader.comparison.scales import settle
from grader.comparison.segments import segment
from grader.comparison.sketches import Sketch
from grader.comparison.task import Task, unit_of
from grader.comparison.values import value_alone
from grader.outcomes import Outcome, Quantity, Tolerance, UsedScale
from grader.rubric import CriterionTable


@dataclass(frozen=True, slots=True)
class Comparison:
    """All outcomes in the rubric's order, the scales used, and the evidence they rest on."""

    outcomes: tuple[Outcome, ...]
    scales: Mapping[str, UsedScale]
    followed: Mapping[str, float]
    """The scales that the drawing follows, where they contradict those used."""
    evidence: Evidence


def compare(task: Task, submission: Submission, drawn_by: Sketch | None = None) -> Comparison:
    """Mark every criterion of the task's rubric.

    Arguments: `drawn_by` is what the plans were drawn by instead, where that is known.
    """
    evidence = gather(task, submission)
    settled = settle(task, evidence, submission.declared)
    ledger = open_ledger(task, evidence, settled, drawn_by)
    found = {criterion.id: _outcome(ledger, criterion) for criterion in _in_order(task, tuple(settled))}
    return Comparison(
        outcomes=tuple(found[criterion.id] for criterion in task.rubric.criterion),
        scales={name: scale.used for name, scale in settled.items()},
        followed=ledger.followed,
        evidence=evidence,
    )


def _in_order(task: Task, scales: tuple[str, ...]) -> list[CriterionTable]:
    """As things are drawn and found: scales, the sketch, velocities, angular ones, accelerations."""
    construction = task.construction
    steps = {step.node: place for place, step in enumerate(construction.steps)}
    kinds = ("v", "omega", "a", "epsilon")

    def place(criterion: CriterionTable) -> tuple[int, int]:
        name = criterion.name
        if name in scales:
            return -2, scales.index(name)
        kind = -1 if criterion.link else kinds.index(name.partition("_")[0])
        return kind, steps[task.segments[name].head] if name in task.segments else 0

    return sorted(task.rubric.criterion, key=place)


def _outcome(ledger: Ledger, criterion: CriterionTable) -> Outcome:
    """The verdict on one criterion, open where it rests on something entered that cannot be used."""
    outcome = _judged(ledger, criterion)
    entry = ledger.evidence.refused.get(criterion.name)
    if entry is None and outcome.verdict in {"none", "partial"}:
        entry = _refused_below(ledger, criterion.name)
    if entry is None:
        return outcome
    ledger.leave_open(criterion.name)
    return verdicts.entry_refused(outcome, entry)


def _refused_below(ledger: Ledger, name: str) -> str | None:
    """What was entered for the scale, or for a node that a vector is made from, and cannot be used."""
    task, evidence = ledger.task, ledger.evidence
    turned = task.construction.rates.get(name)
    segment = task.segments.get(name if turned is None else turned.vector)
    if segment is None or not evidence.refused:
        return None
    needs = {need for need in task.construction.step(segment.head).needs if need not in evidence.nodes}
    vectors = [vector.name for vector in task.segments.values() if vector.head in needs]
    below = [name for name in (segment.scale, segment.name, *vectors) if name in evidence.refused]
    return evidence.refused[below[0]] if below else None


def _judged(ledger: Ledger, criterion: CriterionTable) -> Outcome:
    """The verdict on what can be used; what it costs is remembered for the later ones."""
    if criterion.scale is not None:
        return _scale(ledger, criterion)
    if criterion.angular is not None:
        return rate(ledger, criterion)
    sources = (ledger.evidence.drawn.get(criterion.name), ledger.evidence.measured.get(criterion.name))
    outcomes = [segment(ledger, criterion, drawn) for drawn in sources if drawn is not None]
    if len(outcomes) == 2:
        return verdicts.both(outcomes[0], outcomes[1], ledger.task.rubric.tolerance_of(criterion).length_mm)
    return outcomes[0] if outcomes else value_alone(ledger, criterion)


def _scale(ledger: Ledger, criterion: CriterionTable) -> Outcome:
    """A declared scale, as it was settled."""
    name, unit = criterion.name, unit_of(criterion.name)
    scale, right = ledger.settled[name], ledger.followed[name]
    expected = Quantity(value=right, unit=unit)
    if scale.mark is None:
        if scale.used.text is None and not criterion.optional:
            return absent(ledger, criterion, expected)
        return verdicts.unjudged(criterion, "not_judged", scale.reasons, expected=expected)
    ledger.remember(name, scale.mark)
    measured = Quantity(value=scale.used.declared, unit=unit)
    allowed = Tolerance(value=ledger.task.rubric.tolerance_of(criterion).scale_relative * right)
    return verdicts.outcome(criterion, scale.mark, measured, expected, allowed)
