"""One value compared with one expectation: residual, tolerance, mark, verdict."""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

from grader.comparison.evidence import DrawnVector
from grader.documents import Quantity, Tolerance, Verdict
from grader.outcomes import Outcome
from grader.records import Reason
from grader.rubric import CriterionTable, ToleranceTable
from reference.construction.uncertainty import EndSpread
from reference.quantities import unit_of

FULL, NONE = 1.0, 0.0
ROUNDING = 1e-9
"""Relative excess over a tolerance that still counts as within it."""


# Limits and marks ----------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Limit:
    """A residual and its tolerance.

    Attributes
    ----------
    what : ``length``, ``direction``, ``value`` or ``scale``
    residual : without its sign, in the unit of `tolerance`
    plain : the tolerance before it was widened
    se : standard error of the residual
    table : the rubric's: bands of partial marks, and how many standard errors a verdict must be away
        from changing
    reason : said where the mark is not full
    """

    what: str
    residual: float
    tolerance: float
    plain: float
    se: float
    table: ToleranceTable
    reason: Reason

    @property
    def share(self) -> float:
        """The share of the points at the residual."""
        return self.share_at(self.residual)

    @property
    def worst(self) -> float:
        """The share at the upper end of the residual's error."""
        return self.share_at(self.residual + self.table.certain_errors * self.se)

    @property
    def best(self) -> float:
        """The share at the lower end of the residual's error."""
        return self.share_at(max(self.residual - self.table.certain_errors * self.se, 0.0))

    def share_at(self, residual: float) -> float:
        """The share of the points at a residual; bands are multiples of the plain tolerance."""
        slack = 1.0 + ROUNDING
        if residual <= self.tolerance * slack:
            return FULL
        for factor, share in self.table.all_bands:
            if residual <= (self.tolerance + (factor - 1.0) * self.plain) * slack:
                return share
        return NONE


@dataclass(frozen=True, slots=True)
class MarkRange:
    """The mark of one or several limits together, of which the worst counts.

    Attributes
    ----------
    share : of the points, as measured
    worst, best : the shares that are left open
    reasons : the losses, worst first; then remarks that cost nothing
    sure : the probability that `share` is right
    """

    share: float
    worst: float
    best: float
    reasons: tuple[Reason, ...] = ()
    sure: float = 1.0

    @property
    def is_certain(self) -> bool:
        """Whether the standard errors leave only one verdict."""
        return self.worst == self.best

    @property
    def is_full(self) -> bool:
        """Whether it is full marks for certain."""
        return self.worst == FULL

    def is_better(self, other: "MarkRange") -> bool:
        """Whether it leaves more than another, first for certain, then at best."""
        return (self.worst, self.best) > (other.worst, other.best)


ALL_RIGHT = MarkRange(FULL, FULL, FULL)


def mark(limits: Sequence[Limit], remarks: tuple[Reason, ...] = ()) -> MarkRange:
    """The mark that several limits give; full where there are none."""
    if not limits:
        return MarkRange(FULL, FULL, FULL, remarks)
    by_loss = sorted(limits, key=lambda limit: limit.share)
    losses = tuple(limit.reason for limit in by_loss if limit.share != FULL)
    near = tuple(
        Reason(
            "near_limit",
            {
                "what": limit.what,
                "off": limit.residual,
                "tolerance": limit.tolerance,
                "se": limit.se,
                "good_to": limit.table.certain_errors * limit.se,
            },
        )
        for limit in by_loss
        if limit.worst != limit.best
    )
    return MarkRange(
        min(limit.share for limit in limits),
        min(limit.worst for limit in limits),
        min(limit.best for limit in limits),
        (*losses, *near, *remarks),
    )


OPENING = frozenset(
    {"doubtful", "near_limit", "unread", "hand_may_miss", "readings_disagree", "letters_unclear"}
)
"""Reasons why a verdict is open."""


def at_worst(mark: MarkRange) -> MarkRange:
    """A mark that was open, settled at its worst: a mistake is known to have been made there."""
    reasons = tuple(one for one in mark.reasons if one.code not in OPENING)
    return MarkRange(mark.worst, mark.worst, mark.worst, reasons, 1.0)


EVEN = 0.5
"""The probability of a mark that is open for a reason which no probability is known of."""


def open_between(
    low: float, high: float, first: MarkRange, *reasons: Reason, sure: float = EVEN
) -> MarkRange:
    """A mark that is open between two shares whatever was measured, with the reasons first."""
    return MarkRange(first.share, low, high, (*reasons, *first.reasons), min(sure, first.sure))


COUNTED: Mapping[str, str] = {"student": "counted_for_you", "strict": "not_certainly_within"}
"""The reason that tells of a decision rule, by its name."""


def by_rule(first: MarkRange, rule: str) -> MarkRange:
    """The mark by a decision rule (`DoubtTable.in_doubt`): what the reading's error leaves open is decided.

    Source: ISO 14253-1, JCGM 106: acceptance with the uncertainty in favour of one side.
    """
    if first.is_certain or rule == "person":
        return first
    share = first.best if rule == "student" else first.worst
    near = [reason for reason in first.reasons if reason.code == "near_limit"]
    others = tuple(reason for reason in first.reasons if reason.code != "near_limit")
    if share == first.share:
        return MarkRange(share, share, share, others, first.sure)
    decided = tuple(
        _decided(reason, rule) for reason in near if (_beyond(reason) > 0.0) == (rule == "student")
    )
    losses = others if share != FULL else tuple(one for one in others if one.code == "too_short_to_judge")
    return MarkRange(share, share, share, (*decided, *losses), first.sure)


def _beyond(near: Reason) -> float:
    """By how much a residual is beyond its limit; negative within."""
    off, tolerance = (cast("float", near.parameters[key]) for key in ("off", "tolerance"))
    return off - tolerance


def _decided(near: Reason, rule: str) -> Reason:
    known = {key: near.parameters[key] for key in ("what", "good_to")}
    return Reason(COUNTED[rule], {**known, "beyond": abs(_beyond(near))})


def left_open(first: MarkRange, by_hand: MarkRange) -> MarkRange:
    """A mark, open where drafting errors beyond `at_most` explain the loss; `by_hand` allows all of them."""
    if by_hand.best <= first.best:
        return first
    return open_between(first.worst, by_hand.best, first, Reason("hand_may_miss"))


def the_better(first: MarkRange, other: MarkRange, *reasons: Reason) -> MarkRange:
    """The better of two marks; its reasons are `reasons`, then the losses of `other`."""
    return MarkRange(
        max(first.share, other.share),
        max(first.worst, other.worst),
        max(first.best, other.best),
        (*reasons, *(one for one in other.reasons if one.code != "too_short_to_judge")),
        first.sure if first.share >= other.share else other.sure,
    )


def the_worse(first: MarkRange, other: MarkRange) -> MarkRange:
    """The worse of two marks, with the reasons of both."""
    return MarkRange(
        min(first.share, other.share),
        min(first.worst, other.worst),
        min(first.best, other.best),
        (*first.reasons, *other.reasons),
        min(first.sure, other.sure),
    )


WRONG_CREDIT, WRONG_COUNTED, WRONG_CHARGE = 0.05, 0.15, 1.0
"""How often a reading without any confidence makes the verdict wrong. What is taken for a vector lies seldom
within the tolerance of the right one unless that is there: of simulated vectors credited with a confidence
below 0.2 one in 20 was wrong, of 900 from 0.2 to 0.9 none (other students than those of the docs). What is
within the tolerance by the reading's error alone is less surely so. A misreading makes a right vector wrong
much more often."""


MOSTLY_MISREAD = 0.7
"""Of vectors that are off as read and were read without any confidence, this share was misread. On simulated
flatbed sheets 31 of 39 read with 0.3 to 0.9 were read rightly, and all of 59 from 0.9 on."""


SHORT_MM, WRONG_SHORT = 5.0, 0.03
"""What is expected shorter than this may be hidden by the marks of its ends; there is little to misread."""


def with_confidence(
    mark: MarkRange, confidence: float, settle: float, expected_mm: float = math.inf
) -> MarkRange:
    """A mark, wholly open where a misreading is too likely to have made it.

    Arguments: `confidence` is the probability that the vector is read rightly, `settle` the least
    probability of a verdict that stands.
    """
    if not mark.is_certain:
        return mark if confidence == 1.0 else replace(mark, sure=min(mark.sure, confidence))
    misread = 1.0 - confidence
    if mark.share != FULL:
        wrong = min(WRONG_CHARGE * misread, MOSTLY_MISREAD)
    elif any(one.code == COUNTED["student"] for one in mark.reasons):
        wrong = WRONG_COUNTED * misread
    else:
        wrong = (WRONG_SHORT if expected_mm < SHORT_MM else WRONG_CREDIT) * misread**2
    sure = min(mark.sure, 1.0 - wrong)
    if sure >= settle:
        return replace(mark, sure=sure)
    return open_between(NONE, FULL, mark, Reason("doubtful", {"confidence": confidence}), sure=sure)


# Vectors and values --------------------------------------------------------------------------------

REVERSED_WITHIN_DEG = 20.0
"""A direction this near the opposite one is called reversed, not turned by so much."""


def tolerances(tolerance: ToleranceTable, expected_mm: float, *, with_direction: bool) -> Tolerance:
    """Both tolerances as the rubric states them."""
    turn = tolerance.direction_at(expected_mm) if with_direction else None
    return Tolerance(length_mm=tolerance.length_at(expected_mm), direction_deg=turn)


def widened(
    plain: Tolerance, expected_mm: float, uncertainty: EndSpread, at_most: float = math.inf
) -> Tolerance:
    """The tolerance of a vector, widened to its propagated drafting error (mm) where that is more.

    An error across a vector makes it longer too; a zero vector becomes as long as its error.

    Arguments: `at_most` bounds it to a multiple of the plain one.
    """
    plain_mm, plain_deg = plain.length_mm or 0.0, plain.direction_deg
    length_mm = math.hypot(expected_mm + uncertainty.along, uncertainty.across) - expected_mm
    length_mm = max(plain_mm, min(length_mm, at_most * plain_mm))
    direction = plain_deg
    if plain_deg is not None:
        turned = math.degrees(math.atan2(uncertainty.across, expected_mm))
        direction = max(plain_deg, min(turned, at_most * plain_deg))
    is_wider = length_mm > plain_mm or direction != plain_deg
    return Tolerance(length_mm=length_mm, direction_deg=direction, widened=is_wider)


def mark_vector(
    drawn: DrawnVector, expected: complex, allowed: Tolerance, table: ToleranceTable, se: EndSpread
) -> MarkRange:
    """The mark of a drawn vector against the expected one, both in millimetres.

    Arguments: `allowed` has a direction where one is judged; `se` are standard errors of what is expected.
    """
    expected_mm = abs(expected)
    residual_mm = drawn.length_mm - expected_mm
    se_mm = math.hypot(drawn.se_mm, se.along)
    is_asked = allowed.direction_deg is not None and drawn.direction_rad is not None
    is_judged = is_asked and drawn.length_mm >= table.least_mm
    residual_deg = se_deg = 0.0
    if is_judged and drawn.direction_rad is not None:
        residual_deg = math.degrees(math.remainder(drawn.direction_rad - cmath.phase(expected), math.tau))
        se_deg = (
            math.hypot(drawn.se_deg, math.degrees(se.across / expected_mm)) if se.across else drawn.se_deg
        )
    length_mm, direction_deg = allowed.length_mm or 0.0, allowed.direction_deg or math.inf
    margin = table.certain_errors
    if (
        abs(residual_mm) + margin * se_mm <= length_mm
        and is_judged
        and abs(residual_deg) + margin * se_deg <= direction_deg
    ):
        return ALL_RIGHT
    plain = tolerances(table, expected_mm, with_direction=True)
    reason = _length_reason(drawn, expected_mm, length_mm)
    limits = [Limit("length", abs(residual_mm), length_mm, plain.length_mm or 0.0, se_mm, table, reason)]
    remarks: tuple[Reason, ...] = ()
    if is_judged:
        reason = _direction_reason(drawn, expected, residual_deg, direction_deg)
        plain_deg = plain.direction_deg or direction_deg
        limits.append(Limit("direction", abs(residual_deg), direction_deg, plain_deg, se_deg, table, reason))
    elif drawn.direction_rad is not None and min(expected_mm, drawn.length_mm) < table.least_mm:
        shorter = min(expected_mm, drawn.length_mm)
        remarks = (Reason("too_short_to_judge", {"length_mm": shorter, "least_mm": table.least_mm}),)
    return mark(limits, remarks)


def _length_reason(drawn: DrawnVector, expected_mm: float, allowed_mm: float) -> Reason:
    residual = drawn.length_mm - expected_mm
    params: dict[str, float | str] = {"measured_mm": drawn.length_mm, "tolerance_mm": allowed_mm}
    if expected_mm <= 1e-9 * allowed_mm:
        return Reason("should_be_zero", params)
    params |= {"expected_mm": expected_mm, "off_mm": abs(residual)}
    return Reason("too_long" if residual > 0.0 else "too_short", params)


def _direction_reason(
    drawn: DrawnVector, expected: complex, residual_deg: float, allowed_deg: float
) -> Reason:
    params: dict[str, float | str] = {
        "measured_deg": degrees((drawn.direction_rad or 0.0) + drawn.turn_rad),
        "expected_deg": degrees(cmath.phase(expected) + drawn.turn_rad),
        "off_deg": abs(residual_deg),
        "tolerance_deg": allowed_deg,
    }
    if abs(residual_deg) >= 180.0 - REVERSED_WITHIN_DEG:
        return Reason("reversed", params)
    return Reason("turned_left" if residual_deg > 0.0 else "turned_right", params)


def degrees(angle_rad: float) -> float:
    """Degrees from 0 up to, not including, 360."""
    return math.degrees(angle_rad) % 360.0 % 360.0


def mark_value(
    value: float, expected: float, allowed: float, plain: float, table: ToleranceTable, unit: str
) -> MarkRange:
    """The mark of a computed value against the expected one, SI, with its sign.

    Arguments: `plain` is the tolerance before it was widened.
    """
    residual = abs(value - expected)
    if residual <= allowed:
        return ALL_RIGHT
    params: dict[str, float | str] = {"measured": value, "expected": expected, "unit": unit}
    if value * expected < 0.0:
        reason = Reason("value_reversed", params)
    else:
        params |= {"off": residual, "tolerance": allowed}
        large = abs(value) > abs(expected)
        reason = Reason("value_too_large" if large else "value_too_small", params)
    return mark([Limit("value", residual, allowed, plain, 0.0, table, reason)])


# Outcomes ------------------------------------------------------------------------------------------

RANKS: dict[Verdict, int] = {"none": 0, "partial": 1, "follow_through": 2, "full": 2}


def quantity(name: str, length_mm: float, direction_rad: float | None, value: float) -> Quantity:
    """The quantity of a vector; `direction_rad` on the sheet."""
    direction = None if direction_rad is None else degrees(direction_rad)
    return Quantity(length_mm=length_mm, direction_deg=direction, value=value, unit=unit_of(name))


def expected_quantity(name: str, expected: complex, scale: float, turn_rad: float) -> Quantity:
    """The quantity of an expected vector (complex mm); a zero vector has no direction."""
    direction = cmath.phase(expected) + turn_rad if abs(expected) > 1e-9 else None
    return quantity(name, abs(expected), direction, abs(expected) * scale)


def verdict_of(share: float, *, followed: bool) -> Verdict:
    """The verdict for a share of the points."""
    if share == FULL:
        return "follow_through" if followed else "full"
    return "none" if share == NONE else "partial"


def outcome(  # noqa: PLR0913 - one argument per field of the record
    criterion: CriterionTable,
    mark: MarkRange,
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
    likely, probability = mark.share, mark.sure
    if not mark.is_certain and probability < EVEN:
        # Most probably misread: what is off as read is right, and the other way round.
        likely, probability = (mark.worst if likely == mark.best else mark.best), 1.0 - probability
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
        probability=probability,
        proposed=likely,
    )


def unjudged(
    criterion: CriterionTable,
    verdict: Verdict,
    reasons: tuple[Reason, ...],
    *,
    expected: Quantity,
    sure: float | None = None,
) -> Outcome:
    """The outcome of a criterion for which nothing was handed in, or nothing could be read."""
    is_open = verdict == "review"
    likely = EVEN if is_open else 1.0
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
        probability=likely if sure is None else sure,
    )


def without_drawing(judged: Outcome) -> Outcome:
    """The outcome of a value without the drawn vector that is asked for: no points, right or wrong."""
    return replace(
        judged,
        verdict="none",
        possible=("none", "none"),
        shares=(NONE, NONE),
        proposed=NONE,
        probability=1.0,
        reasons=(Reason("value_alone"), *judged.reasons),
    )


def entry_refused(judged: Outcome, entries: tuple[str, ...]) -> Outcome:
    """The outcome left to a person, because the `entries` for it cannot be used."""
    reasons = [reason for reason in judged.reasons if reason.code != "right"]
    if judged.measured == Quantity():
        # The refused entry is the reason why nothing was judged.
        reasons = []
    return replace(
        judged,
        verdict="review",
        possible=("none", "full"),
        shares=(NONE, FULL),
        confidence=0.0,
        probability=EVEN,
        reasons=(Reason("entry_refused", {"entries": entries}), *reasons),
        mistake=None,
    )


def both(first: Outcome, second: Outcome, allowed_mm: float) -> Outcome:
    """The outcome of a vector with scan and measurement: for review where they differ in the verdict.

    Where one of them shows nothing to judge, the other is the outcome.
    """
    for one, other in ((first, second), (second, first)):
        if one.verdict == "not_judged":
            return other
    lengths = first.measured.length_mm or 0.0, second.measured.length_mm or 0.0
    params: dict[str, float | str] = {"first": lengths[0], "second": lengths[1], "unit": "mm"}
    differ = Reason("readings_disagree", params)
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
        probability=EVEN,
    )
