"""Values computed from vectors: by a scale, and by a slip of the pen."""

import statistics

from grader.comparison import verdicts
from grader.comparison.absent import absent
from grader.comparison.evidence import DrawnVector
from grader.comparison.following import NO_SPREAD
from grader.comparison.ledger import Against, Found, Ledger
from grader.comparison.limits import Mark, the_better
from grader.comparison.marking import mark_value, tolerances, widened
from grader.comparison.task import unit_of
from grader.outcomes import Outcome, Quantity, Reason, Tolerance
from grader.rubric import CriterionTable
from reference.hand import Spread

SO_MANY = 3
"""Values that are off by one factor were made with a wrong scale; fewer may be so by chance."""
ALIKE = 0.02
"""Relative: how near to each other their factors are, with rounding on the way."""
HALF = 0.5
"""The share of a criterion that a right drawing keeps where the rubric has no band of partial points."""


def mark_of_value(
    ledger: Ledger, criterion: CriterionTable, value: float, found: Found, drawn: DrawnVector
) -> Mark | None:
    """The mark on a computed value beside its drawing; None where it is right, or right by the drawing.

    A wrong value costs only the value: what the rubric's nearest band takes. A wrong factor in all
    values of a scale costs once.
    """
    one, table = ledger.task.segments[criterion.name], ledger.task.rubric.tolerance_of(criterion)
    scale = ledger.used[one.scale]
    rights = [abs(one.real), abs(found.expected) * scale, drawn.length_mm * scale]
    factor = common_factor(ledger, one.scale)
    if factor is not None and _is_charged(ledger, one.scale):
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
        ledger.charged.add(_name(one.scale))
    keeps = max(best.share, table.all_bands[0][1] if table.all_bands else HALF)
    return Mark(keeps, keeps, keeps, best.reasons)


def common_factor(ledger: Ledger, scale: str) -> float | None:
    """The factor by which all values of a scale are off, where they are off by one."""
    if scale not in ledger.factors:
        ledger.factors[scale] = _common_factor(ledger, scale)
    return ledger.factors[scale]


def _common_factor(ledger: Ledger, scale: str) -> float | None:
    task, evidence = ledger.task, ledger.evidence
    found = []
    for name, vector in task.construction.vectors.items():
        if vector.scale != scale or name not in evidence.values:
            continue
        drawn = evidence.vector(name)
        length = abs(task.drawn(name, ledger.used)) if drawn is None else drawn.length_mm
        if length > task.rubric.tolerance_of(name).least_mm:
            found.append(abs(evidence.values[name]) / (length * ledger.used[scale]))
    if len(found) < SO_MANY:
        return None
    factor = statistics.median(found)
    alike = [one for one in found if abs(one - factor) <= ALIKE * factor]
    is_off = abs(factor - 1.0) > 2.0 * task.rubric.tolerance_of(scale).scale_relative
    return factor if is_off and len(alike) >= max(SO_MANY, len(found) - 1) else None


def _name(scale: str) -> str:
    return f"values by {scale}"


def _is_charged(ledger: Ledger, scale: str) -> bool:
    return _name(scale) in ledger.charged


def value_alone(ledger: Ledger, criterion: CriterionTable) -> Outcome:
    """A vector of which only the computed value was handed in, or nothing."""
    one, values = ledger.task.segments[criterion.name], ledger.evidence.values
    scale = ledger.used[one.scale]
    if one.name not in values:
        exact = one.drawn(ledger.used)
        return absent(ledger, criterion, verdicts.expected_quantity(one.name, exact, scale, 0.0))
    value, unit = abs(values[one.name]), unit_of(one.name)

    def allowed(expected: complex, reach: Spread) -> Tolerance:
        plain = tolerances(ledger.task.rubric.tolerance_of(criterion), abs(expected), with_direction=False)
        if reach is NO_SPREAD:
            return Tolerance(value=(plain.length_mm or 0.0) * scale)
        wider = widened(plain, abs(expected), reach, ledger.task.rubric.hand.at_most)
        return Tolerance(value=(wider.length_mm or 0.0) * scale, widened=wider.widened)

    def against(expected: complex, reach: Spread = NO_SPREAD, se: Spread = NO_SPREAD) -> Mark:
        del se
        limit, table = allowed(expected, reach).value or 0.0, ledger.task.rubric.tolerance_of(criterion)
        plain = table.length_at(abs(expected)) * scale
        return mark_value(value, abs(expected) * scale, limit, plain, table, unit)

    follows = ledger.task.rubric.follows_through(criterion)
    found = ledger.best(one, against, follows_through=follows)
    if not found.mark.is_full and follows:
        found = _by_factor(ledger, one.scale, found, against)
    measured, right = Quantity(value=values[one.name], unit=unit), abs(found.expected) * scale
    return verdicts.outcome(
        criterion,
        found.mark,
        measured,
        Quantity(value=right, unit=unit),
        allowed(found.expected, found.reach),
        followed=found.is_followed,
    )


def _by_factor(ledger: Ledger, scale: str, found: Found, against: Against) -> Found:
    """A value that is off by the factor of all, after the first of them."""
    factor, exact = common_factor(ledger, scale), found.expected
    if factor is None:
        return found
    mark = against(exact * factor)
    if not _is_charged(ledger, scale):
        ledger.charged.add(_name(scale))
        return found
    if not mark.is_better(found.mark):
        return found
    told = Reason("follows", {"what": "scale", "of": scale})
    return Found(the_better(mark, found.mark, told), exact * factor, is_followed=True)
