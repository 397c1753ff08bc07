"""Criteria that nothing was handed in for, or that were not read."""

from grader.comparison import verdicts
from grader.comparison.ledger import Ledger
from grader.outcomes import Outcome, Quantity, Reason
from grader.rubric import CriterionTable


def absent(ledger: Ledger, criterion: CriterionTable, expected: Quantity) -> Outcome:
    """The outcome of a criterion that there is nothing to hold against."""
    unread = _why_unread(ledger, criterion)
    reason = Reason("not_measured") if unread is None else Reason("unread", {"reason": unread})
    if criterion.optional:
        return verdicts.unjudged(criterion, "not_judged", (Reason("optional"), reason), expected=expected)
    if criterion.link is not None and not ledger.evidence.has_sketch:
        # Links are drawn, not measured: without a sketch that was read nothing is asked of them.
        return verdicts.unjudged(criterion, "not_judged", (reason,), expected=expected)
    least, length = ledger.task.rubric.tolerance_of(criterion).least_mm, expected.length_mm
    if length is not None and length < least:
        short = Reason("too_short_to_judge", {"length_mm": length, "least_mm": least})
        return verdicts.unjudged(criterion, "not_judged", (short, reason), expected=expected)
    segment = ledger.task.segments.get(criterion.name)
    if segment is not None:
        # Later criteria may hang on what nobody has seen.
        ledger.doubtful.add(segment.head)
    verdict = ledger.task.rubric.missing if unread is None else "review"
    return verdicts.unjudged(criterion, verdict, (reason,), expected=expected)


def _why_unread(ledger: Ledger, criterion: CriterionTable) -> str | None:
    """Why a vector or link was not read, None where no sheet could show it."""
    segment, evidence = ledger.task.segments.get(criterion.name), ledger.evidence
    if segment is None or not evidence.has_sheets:
        return None
    for name in (segment.name, segment.head, segment.tail):
        if name in evidence.unread:
            return evidence.unread[name]
    return f"{segment.name} was not found on the sheets"
