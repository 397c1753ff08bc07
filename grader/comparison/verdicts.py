"""From marks to outcomes: what a criterion's verdict is when some of it is open or missing."""

import cmath
from dataclasses import replace

from grader.comparison.limits import LEVELS, Mark, better, worse
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
    return Mark(mark.level, "none", "full", (Reason("doubtful", {"confidence": confidence}), *mark.reasons))


def is_better(mark: Mark, other: Mark) -> bool:
    """Whether a mark leaves more than another, first for certain, then at best."""

    def rank(one: Mark) -> tuple[int, int]:
        return LEVELS.index(one.worst), LEVELS.index(one.best)

    return rank(mark) > rank(other)


def the_better(mark: Mark, other: Mark, *reasons: Reason) -> Mark:
    """Two marks of which the better counts; the reasons are those of `other`, after `reasons`."""
    return Mark(
        better((mark.level, other.level)),
        better((mark.worst, other.worst)),
        better((mark.best, other.best)),
        (*reasons, *other.reasons),
    )


def the_worse(mark: Mark, other: Mark) -> Mark:
    """Two marks of which the worse counts."""
    return Mark(
        worse((mark.level, other.level)),
        worse((mark.worst, other.worst)),
        worse((mark.best, other.best)),
        (*mark.reasons, *other.reasons),
    )


def quantity(name: str, length_mm: float, direction_rad: float | None, value: float) -> Quantity:
    """A vector's record; `direction_rad` on the sheet."""
    direction = None if direction_rad is None else degrees(direction_rad)
    return Quantity(length_mm, direction, value, unit_of(name))


def expected_quantity(name: str, expected: complex, scale: float, turn_rad: float) -> Quantity:
    """The record of an expected vector (millimetres); a zero vector has no direction."""
    direction = cmath.phase(expected) + turn_rad if abs(expected) > 1e-9 else None
    return quantity(name, abs(expected), direction, abs(expected) * scale)


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

    def verdict(level: Verdict) -> Verdict:
        return "follow_through" if followed and level == "full" else level

    lost = mark.level != "full" or not mark.is_certain or followed
    reasons = mark.reasons if lost else (Reason("right"), *mark.reasons)
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict(mark.level) if mark.is_certain else "review",
        measured=measured,
        expected=expected,
        tolerance=tolerance,
        confidence=confidence,
        reasons=reasons,
        possible=(verdict(mark.worst), verdict(mark.best)),
        mistake=mistake,
    )


def unjudged(
    criterion: CriterionTable, verdict: Verdict, reasons: tuple[Reason, ...], *, expected: Quantity
) -> Outcome:
    """The outcome of a criterion that nothing was handed in for, or nothing that could be read."""
    possible: tuple[Verdict, Verdict] = ("none", "full") if verdict == "review" else (verdict, verdict)
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict,
        measured=Quantity(),
        expected=expected,
        tolerance=Tolerance(),
        confidence=0.0 if verdict == "review" else 1.0,
        reasons=reasons,
        possible=possible,
    )


def both(first: Outcome, second: Outcome, allowed_mm: float) -> Outcome:
    """Scan and measurement of one vector: told where they differ, reviewed where it matters."""
    lengths = first.measured.length_mm or 0.0, second.measured.length_mm or 0.0
    told: dict[str, float | str] = {"first": lengths[0], "second": lengths[1], "unit": "mm"}
    differ = Reason("readings_disagree", told)
    if first.verdict == second.verdict and first.possible == second.possible:
        if abs(lengths[0] - lengths[1]) <= allowed_mm:
            return first
        return replace(first, reasons=(*first.reasons, differ))
    ends = (*first.possible, *second.possible)
    low, high = min(ends, key=RANKS.__getitem__), max(ends, key=RANKS.__getitem__)
    return replace(
        first, verdict="review", possible=(low, high), reasons=(differ, *first.reasons), confidence=0.5
    )
