"""A vector or a link as drawn, with the value computed from it."""

from grader.comparison import verdicts
from grader.comparison.evidence import DrawnVector
from grader.comparison.following import NO_SPREAD
from grader.comparison.ledger import Found, Ledger
from grader.comparison.limits import ALL_RIGHT, FULL, Mark, left_open, the_worse
from grader.comparison.marking import mark_vector, tolerances, widened
from grader.comparison.values import mark_of_value
from grader.comparison.written import held_against_written
from grader.outcomes import Outcome, Tolerance
from grader.rubric import CriterionTable
from reference.hand import Spread


def segment(ledger: Ledger, criterion: CriterionTable, drawn: DrawnVector) -> Outcome:
    """A vector that was drawn (or measured), or a link of the sketch."""
    one, rubric = ledger.task.segments[criterion.name], ledger.task.rubric
    follows = rubric.follows_through(criterion)
    with_direction = criterion.direction and drawn.direction_rad is not None
    found = ledger.best(one, _against(ledger, criterion, drawn), follows_through=follows)
    mark = found.mark
    is_read = drawn is ledger.evidence.drawn.get(one.name)
    if is_read:
        mark = ledger.opened(one, mark, follows_through=follows)
    scale = ledger.used[one.scale]
    value, wrong_value = drawn.length_mm * scale, None
    if one.name in ledger.evidence.values:
        value = ledger.evidence.values[one.name]
        wrong_value = mark_of_value(ledger, criterion, abs(value), found, drawn)
    is_arithmetic = wrong_value is not None and mark.share == FULL
    if wrong_value is not None:
        mark = the_worse(mark, wrong_value)
    direction = drawn.direction_rad
    on_sheet = None if direction is None else direction + drawn.turn_rad
    return verdicts.outcome(
        criterion,
        mark,
        verdicts.quantity(one.name, drawn.length_mm, on_sheet, value),
        verdicts.expected_quantity(one.name, found.expected, scale, drawn.turn_rad),
        _allowed(criterion, ledger, found, with_direction=with_direction),
        confidence=drawn.confidence,
        followed=found.is_followed,
        mistake="arithmetic" if is_arithmetic else None,
    )


class _against:  # noqa: N801 - used as a function
    """Marks a drawn vector against an expectation, as the rubric and the sheet's cells have it."""

    def __init__(self, ledger: Ledger, criterion: CriterionTable, drawn: DrawnVector) -> None:
        self.table, self.drawn = ledger.task.rubric.tolerance_of(criterion), drawn
        self.least, self.at_most = ledger.task.rubric.least_confidence, ledger.task.rubric.hand.at_most
        self.with_direction = criterion.direction and drawn.direction_rad is not None
        is_read = drawn is ledger.evidence.drawn.get(criterion.name)
        self.written = ledger.evidence.written.get(criterion.name) if is_read else None

    def __call__(self, expected: complex, reach: Spread = NO_SPREAD, se: Spread = NO_SPREAD) -> Mark:
        """The mark; `reach` is how far a careful hand may miss what is expected."""
        table, drawn, size = self.table, self.drawn, abs(expected)
        plain = tolerances(table, size, with_direction=self.with_direction)
        if reach is NO_SPREAD:
            found = mark_vector(drawn, expected, plain, table, se)
        else:
            found = mark_vector(drawn, expected, widened(plain, size, reach, self.at_most), table, se)
            if not found.is_full:
                by_hand = mark_vector(drawn, expected, widened(plain, size, reach), table, se)
                found = left_open(found, ALL_RIGHT if _is_boundless(reach, size) else by_hand)
        found = held_against_written(found, drawn, self.written, table, self.least)
        return verdicts.with_confidence(found, drawn.confidence, self.least)


BOUNDLESS_MM, BOUNDLESS_SHARE = 20.0, 0.5
"""A reach of so much, and of such a share of the vector: there errors no longer grow in proportion, and a
hand may miss by anything."""


def _is_boundless(reach: Spread, size_mm: float) -> bool:
    """Whether lines cross so badly that nothing tells how far a careful hand may miss."""
    return max(reach.along, reach.across) > max(BOUNDLESS_MM, BOUNDLESS_SHARE * size_mm)


def _allowed(criterion: CriterionTable, ledger: Ledger, found: Found, *, with_direction: bool) -> Tolerance:
    """What full marks allow, for the report."""
    size = abs(found.expected)
    plain = tolerances(ledger.task.rubric.tolerance_of(criterion), size, with_direction=with_direction)
    if found.reach is NO_SPREAD:
        return plain
    return widened(plain, size, found.reach, ledger.task.rubric.hand.at_most)
