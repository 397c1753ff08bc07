"""From marks to outcomes: what a criterion's verdict is when some of it is open or missing."""

import cmath
from dataclasses import replace

from grader.comparison.limits import FULL, NONE, Mark, open_between
from grader.comparison.marking import degrees
from grader.comparison.task import unit_of
from grader.documents import Verdict
from grader.outcomes import Outcome, Quantity, Reason, Tolerance
from grader.rubric import CriterionTable

RANKS: dict[Verdict, int] = {"none": 0, "partial": 1, "follow_through": 2, "full": 2}


def with_confidence(mark: Mark, confidence: float, least: float) -> Mark:
    """Anything is possible where the reading is less certain than the rubric asks."""
    if confidence >= least:
        return mark
    return open_between(NONE, FULL, mark, Reason("doubtful", {"confidence": confidence}))


def quantity(name: str, length_mm: float, direction_rad: float | None, value: float) -> Quantity:
    """A vector's record; `direction_rad` on the sheet."""
    direction = None if direction_rad is None else degrees(direction_rad)
    return Quantity(length_mm, direction, value, unit_of(name))


def expected_quantity(name: str, expected: complex, scale: float, turn_rad: float) -> Quantity:
    """The record of an expected vector (millimetres); a zero vector has no direction."""
    direction = cmath.phase(expected) + turn_rad if abs(expected) > 1e-9 else None
    return quantity(name, abs(expected), direction, abs(expected) * scale)


def verdict_of(share: float, *, followed: bool) -> Verdict:
    """The verdict that a share of the points is told as."""
    if share == FULL:
        return "follow_through" if followed else "full"
    return "none" if share == NONE else "partial"


def outcome(  # noqa: PLR0913 - one argument per field of the record
    criterion: CriterionTable,
    mark: Mark,
    measured: Quantity,
    expected: Quantity,
    tolerance: Tolerance,
    *,
    confidence: float = 1.0,
    followed: bool = False,
    mistake: str | None = None,
) -> Outcome:
    """The outcome of a marked criterion: under review where its mark is not certain."""
    lost = mark.share != FULL or not mark.is_certain or followed
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict_of(mark.share, followed=followed) if mark.is_certain else "review",
        measured=measured,
        expected=expected,
        tolerance=tolerance,
        confidence=confidence,
        reasons=mark.reasons if lost else (Reason("right"), *mark.reasons),
        possible=(verdict_of(mark.worst, followed=followed), verdict_of(mark.best, followed=followed)),
        shares=(mark.worst, mark.best),
        mistake=mistake,
    )


def unjudged(
    criterion: CriterionTable, verdict: Verdict, reasons: tuple[Reason, ...], *, expected: Quantity
) -> Outcome:
    """The outcome of a criterion that nothing was handed in for, or nothing that could be read."""
    is_open = verdict == "review"
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict,
        measured=Quantity(),
        expected=expected,
        tolerance=Tolerance(),
        confidence=0.0 if is_open else 1.0,
        reasons=reasons,
        possible=("none", "full") if is_open else (verdict, verdict),
        shares=(NONE, FULL if is_open else NONE),
    )


def entry_refused(judged: Outcome, entry: str) -> Outcome:
    """The outcome left to a person, because something that was entered for it cannot be used.

    Arguments: `entry` is what was entered.
    """
    reasons = [reason for reason in judged.reasons if reason.code != "right"]
    if judged.measured == Quantity():
        # Why nothing was judged is that nothing of it can be used.
        reasons = []
    return replace(
        judged,
        verdict="review",
        possible=("none", "full"),
        shares=(NONE, FULL),
        confidence=0.0,
        reasons=(Reason("entry_refused", {"reason": entry}), *reasons),
        mistake=None,
    )


def both(first: Outcome, second: Outcome, allowed_mm: float) -> Outcome:
    """Scan and measurement of one vector: told where they differ, reviewed where it matters."""
    lengths = first.measured.length_mm or 0.0, second.measured.length_mm or 0.0
    told: dict[str, float | str] = {"first": lengths[0], "second": lengths[1], "unit": "mm"}
    differ = Reason("readings_disagree", told)
    if (first.verdict, first.possible, first.shares) == (second.verdict, second.possible, second.shares):
        if abs(lengths[0] - lengths[1]) <= allowed_mm:
            return first
        return replace(first, reasons=(*first.reasons, differ))
    ends = (*first.possible, *second.possible)
    low, high = min(ends, key=RANKS.__getitem__), max(ends, key=RANKS.__getitem__)
    shares = (*first.shares, *second.shares)
    return replace(
        first,
        verdict="review",
        possible=(low, high),
        shares=(min(shares), max(shares)),
        reasons=(differ, *first.reasons),
        confidence=0.5,
    )
