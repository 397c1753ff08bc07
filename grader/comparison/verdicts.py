"""One value held against one expectation: residual, tolerance, mark."""

import cmath
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import cast

from grader.comparison.evidence import DrawnVector
from grader.documents import Tolerance
from grader.outcomes import EVEN
from grader.records import Reason
from grader.rubric import CriterionTable, RubricFile, ToleranceTable
from reference.construction.uncertainty import EndSpread
from reference.geometry import degrees
from reference.quantities import unit_of

FULL, NONE = 1.0, 0.0
HALF = 0.5
"""The share of a criterion that a part of it keeps where the rubric has no band of partial points."""
ROUNDING = 1e-9
"""Relative excess over a tolerance that still counts as within it."""
NO_SPREAD = EndSpread(0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Expectation:
    """A vector as it is given, or as it follows rightly from the student's own values.

    Attributes
    ----------
    vector : complex millimetres
    what, of : ``given``, ``nodes``, ``scale``, ``vector`` or ``value``, and its name, for `follows`
    relies_on : the student's nodes, scales and computed angular velocities from which it follows
    causes : nodes and scales among them that are wrong for certain, whatever their own residuals
    uncertainty : its propagated drafting error, the rubric's number of standard deviations, millimetres
    se : its standard errors, from the reading of its sources
    may_add_up : made by the right steps at the scales used: small errors of its sources may add up in it
    """

    vector: complex
    what: str = "given"
    of: str = ""
    relies_on: frozenset[str] = frozenset()
    uncertainty: EndSpread = NO_SPREAD
    se: EndSpread = NO_SPREAD
    causes: frozenset[str] = frozenset()
    may_add_up: bool = False


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
        """True if the standard errors leave only one verdict."""
        return self.worst == self.best

    @property
    def is_full(self) -> bool:
        """True if it is full marks for certain."""
        return self.worst == FULL

    def is_better(self, other: "MarkRange") -> bool:
        """Return whether it leaves more than another, first for certain, then at best."""
        return (self.worst, self.best) > (other.worst, other.best)


ALL_RIGHT = MarkRange(FULL, FULL, FULL)


def mark(limits: Sequence[Limit], remarks: tuple[Reason, ...] = ()) -> MarkRange:
    """Return the mark that one or several limits give together."""
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


def open_between(
    low: float, high: float, first: MarkRange, *reasons: Reason, sure: float = EVEN
) -> MarkRange:
    """A mark that is open between two shares whatever was measured, with the reasons first."""
    return MarkRange(first.share, low, high, (*reasons, *first.reasons), min(sure, first.sure))


COUNTED: Mapping[str, str] = {"student": "counted_for_you", "strict": "not_certainly_within"}
"""The code of the reason for each decision rule."""


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
    decided = tuple(chain.from_iterable(_decided(reason, rule) for reason in near))
    losses = others if share != FULL else tuple(one for one in others if one.code == "too_short_to_judge")
    return MarkRange(share, share, share, (*decided, *losses), first.sure)


def _decided(near: Reason, rule: str) -> Iterator[Reason]:
    """Yield that the error decides, where the limit of full marks is near and not that of partial ones."""
    off, tolerance, good_to = (cast("float", near.parameters[key]) for key in ("off", "tolerance", "good_to"))
    beyond = off - tolerance if rule == "student" else tolerance - off
    if 0.0 <= beyond <= good_to + ROUNDING * tolerance:
        known = {key: near.parameters[key] for key in ("what", "good_to", "tolerance")}
        yield Reason(COUNTED[rule], {**known, "beyond": beyond})


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
"""Probabilities that a reading without any confidence makes the verdict wrong. Another stroke seldom lies
within the tolerance of the right vector: of simulated vectors credited with a confidence below 0.2 one in 20
was wrong, of 900 from 0.2 to 0.9 none (other students than those of the docs). A vector that is within the
tolerance by the reading's error alone is less certain. A misreading makes a right vector wrong much more
often."""
WRONG_DOUBTED = 0.2
"""The same, by the share of doubt, for what is laid off in a force polygon that may be another one:
the reader looks for the right polygon, where one laid off the wrong way may seem right. Of 61 credited with
less than 0.9 on 130 simulated sheets 4 were wrong; of 35 closing sides none, of 152 in other polygons one."""
MOSTLY_MISREAD = 0.7
"""Share of misread vectors among those that are off and were read without any confidence. On simulated
flatbed sheets 31 of 39 read with 0.3 to 0.9 were read rightly, and all of 59 from 0.9 on."""


MOST_ERROR = 1.5
"""A reading's error of more than so many tolerances is most of the residual that counts as right: nearly any
stroke there would be right, and nothing is proposed. On a simulated class of force sheets all 6 such readings
that waited were off by 0.9 mm or more."""


SHORT_MM, WRONG_SHORT = 5.0, 0.03
"""A vector expected to be shorter may be hidden by the marks of its ends; there is little to misread."""


DIRECTED_MM = 3.0
"""A vector expected to be shorter has no direction to judge: its arrowhead shows all there is."""


def with_confidence(
    mark: MarkRange,
    confidence: float,
    settle: float,
    expected_mm: float = math.inf,
    *,
    is_doubted: bool = False,
) -> MarkRange:
    """Return a mark, open between nothing and full marks if the vector may have been misread.

    Arguments: `confidence` is the probability that the vector is read rightly, `settle` the least
    probability of a verdict that stands, `is_doubted` that of `DrawnVector`. What is likelier another stroke
    never stands: the reader looks where a vector should be, so that lying there proves nothing. One that the
    reading's own error makes right is even.
    """
    if not mark.is_certain:
        return mark if confidence == 1.0 else replace(mark, sure=min(mark.sure, confidence))
    misread = 1.0 - confidence
    if mark.share != FULL:
        wrong = min(WRONG_CHARGE * misread, MOSTLY_MISREAD)
    elif is_doubted and expected_mm >= SHORT_MM:
        wrong = WRONG_DOUBTED * misread
    elif any(one.code == COUNTED["student"] for one in mark.reasons):
        wrong = WRONG_COUNTED * misread
    else:
        wrong = (WRONG_SHORT if expected_mm < SHORT_MM else WRONG_CREDIT) * misread**2
    sure = min(mark.sure, 1.0 - wrong)
    is_likelier_another = confidence < EVEN and expected_mm >= DIRECTED_MM
    if sure >= settle and not is_likelier_another:
        return replace(mark, sure=sure)
    sure = EVEN if any(map(_is_mostly_error, mark.reasons)) else sure
    return open_between(NONE, FULL, mark, Reason("doubtful", {"confidence": confidence}), sure=sure)


def _is_mostly_error(reason: Reason) -> bool:
    """Return whether a residual was counted by an error that is far larger than the tolerance."""
    if reason.code != COUNTED["student"]:
        return False
    good_to, tolerance = (cast("float", reason.parameters[key]) for key in ("good_to", "tolerance"))
    return good_to > MOST_ERROR * tolerance


# Vectors and values --------------------------------------------------------------------------------

REVERSED_WITHIN_DEG = 20.0
"""A direction this near the opposite one is called reversed, not turned by so much."""


BOUNDLESS_MM, BOUNDLESS_SHARE = 20.0, 0.5
"""Propagated uncertainty larger than this, and than this share of the vector: the linear propagation no
longer holds, and the error may be anything."""


@dataclass(frozen=True, slots=True)
class HeldVector:
    """A drawn vector judged by the rubric; its remarks are added to its reasons unless it is right.

    `right_mm` is the length by the data. Where that is long enough to have a direction, what follows from
    own values has one down to half of it: none is excused because its own length is a little less.
    """

    rubric: RubricFile
    criterion: CriterionTable
    drawn: DrawnVector
    right_mm: float = 0.0

    def allowed(self, one: Expectation, at_most: float | None = None) -> Tolerance:
        """Return the tolerance of full marks on paper.

        Arguments: `at_most` bounds it to a multiple of the plain tolerance, by default the rubric's.
        """
        with_direction = self.criterion.direction and self.drawn.direction_rad is not None
        table, most = self.rubric.tolerance_of(self.criterion), at_most or self.rubric.hand.at_most
        if self.right_mm >= table.least_mm:
            least = min(table.least_mm, self.right_mm / 2.0)
            table = table.model_copy(update={"least_mm": least})
        return widened(table, most, one, with_direction=with_direction)

    def against(self, one: Expectation) -> MarkRange:
        """The mark by tolerance, decision rule and confidence."""
        mark, confidence = self._mark_of(self.drawn, one), self.drawn.confidence
        for other in self.drawn.if_others():
            # Whichever of them was drawn, the verdict is the same: their probabilities count together.
            same = self._mark_of(other, one)
            if not mark.is_certain or (same.worst, same.best) != (mark.worst, mark.best):
                break
            confidence = max(confidence, other.confidence)
        settle, is_doubted = self.rubric.doubt.settle, self.drawn.is_doubted
        mark = with_confidence(mark, confidence, settle, abs(one.vector), is_doubted=is_doubted)
        return mark if mark.is_full else replace(mark, reasons=(*self.drawn.remarks, *mark.reasons))

    def _mark_of(self, drawn: DrawnVector, one: Expectation) -> MarkRange:
        """The mark as if this were drawn; open where drafting errors beyond `at_most` explain the loss."""
        table, rule = self.rubric.tolerance_of(self.criterion), self.rubric.doubt.in_doubt
        size, spread = abs(one.vector), one.uncertainty
        mark = by_rule(mark_vector(drawn, one, self.allowed(one), table), rule)
        is_left_out = size >= SHORT_MM and drawn.length_mm <= table.length_mm / 2.0
        if mark.is_full or is_left_out or spread == NO_SPREAD:
            return mark
        by_hand = by_rule(mark_vector(drawn, one, self.allowed(one, math.inf), table), rule).best
        if max(spread.along, spread.across) > max(BOUNDLESS_MM, BOUNDLESS_SHARE * size):
            by_hand = FULL
        if by_hand <= mark.best:
            return mark
        return open_between(mark.worst, by_hand, mark, Reason("hand_may_miss"))


@dataclass(frozen=True, slots=True)
class HeldValue:
    """A computed value, SI, judged by the rubric; `per_mm` is the value of a millimetre of its vector.

    A vector's value has no sign, an angular quantity's has: the real part of an expectation is its value.
    `sense` is the one told beside an angular quantity: 1 counter-clockwise, -1, or 0 if it was left blank.
    """

    rubric: RubricFile
    criterion: CriterionTable
    value: float
    per_mm: float
    sense: float | None = None

    def allowed(self, one: Expectation) -> Tolerance:
        """Return the tolerance of full marks: that of the length that the value stands for."""
        table, most = self.rubric.tolerance_of(self.criterion), self.rubric.hand.at_most
        on_paper = widened(table, most, one, with_direction=False)
        return Tolerance(value=(on_paper.length_mm or 0.0) * self.per_mm, widened=on_paper.widened)

    def expected(self, one: Expectation) -> float:
        """Return the expected value; nothing but rounding is zero."""
        in_mm = one.vector.real if self.criterion.turning else abs(one.vector)
        return in_mm * self.per_mm if abs(in_mm) > ROUNDING else 0.0

    def against(self, one: Expectation) -> MarkRange:
        """The mark by the tolerance alone; a magnitude without its sense loses only the sense."""
        value, expected = self.value, self.expected(one)
        if self.criterion.sense is not None:
            return self._mark(one, math.copysign(expected, value), expected)
        is_bare = self.criterion.turning is not None and value > 0.0 and not self.sense
        if not is_bare or (expected >= 0.0 and self.sense is None):
            return self._mark(one, value, expected)
        size = self._mark(one, value, abs(expected))
        bands = self.rubric.tolerance_of(self.criterion).all_bands
        keeps = min(size.share, bands[0][1] if bands else HALF)
        return MarkRange(keeps, keeps, keeps, (Reason("sense_missing"), *size.reasons), size.sure)

    def _mark(self, one: Expectation, value: float, expected: float) -> MarkRange:
        """The mark of a value by its tolerance."""
        table, allowed = self.rubric.tolerance_of(self.criterion), self.allowed(one).value or 0.0
        residual = abs(value - expected)
        if residual <= allowed:
            return ALL_RIGHT
        params: dict[str, float | str]
        params = {"measured": value, "expected": expected, "unit": unit_of(self.criterion.name)}
        if value * expected < 0.0:
            reason = Reason("sense_wrong") if self.criterion.sense else Reason("value_reversed", params)
        else:
            params |= {"off": residual, "tolerance": allowed}
            large = abs(value) > abs(expected)
            reason = Reason("value_too_large" if large else "value_too_small", params)
        plain = table.length_at(abs(one.vector)) * self.per_mm
        found = mark([Limit("value", residual, allowed, plain, 0.0, table, reason)])
        on_paper = widened(table, math.inf, one, with_direction=False).length_mm or 0.0
        if self.criterion.moment is not None and residual <= on_paper * self.per_mm:
            # The arms are short: drafting errors beyond `at_most` explain it.
            return open_between(found.worst, FULL, found, Reason("hand_may_miss"))
        return found


Held = HeldVector | HeldValue
"""Something drawn or computed that can be held against expectations."""


def widened(
    table: ToleranceTable, at_most: float, one: Expectation, *, with_direction: bool = True
) -> Tolerance:
    """The tolerance of a vector, widened to its propagated drafting error (mm) where that is more.

    An error across a vector makes it longer too; a zero vector becomes as long as its error.

    Arguments: `at_most` bounds it to a multiple of the plain one.
    """
    size, spread = abs(one.vector), one.uncertainty
    plain_mm = table.length_at(size)
    length_mm = math.hypot(size + spread.along, spread.across) - size
    length_mm = max(plain_mm, min(length_mm, at_most * plain_mm))
    plain_deg = direction = table.direction_at(size) if with_direction else None
    if plain_deg is not None:
        turned = math.degrees(math.atan2(spread.across, size))
        direction = max(plain_deg, min(turned, at_most * plain_deg))
    is_wider = length_mm > plain_mm or direction != plain_deg
    return Tolerance(length_mm=length_mm, direction_deg=direction, widened=is_wider)


def mark_vector(drawn: DrawnVector, one: Expectation, allowed: Tolerance, table: ToleranceTable) -> MarkRange:
    """The mark of a drawn vector against an expectation; `allowed` has a direction where one is judged."""
    expected, se, expected_mm = one.vector, one.se, abs(one.vector)
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
    plain_mm, plain_deg = table.length_at(expected_mm), table.direction_at(expected_mm) or direction_deg
    reason = _length_reason(drawn, expected_mm, length_mm)
    limits = [Limit("length", abs(residual_mm), length_mm, plain_mm, se_mm, table, reason)]
    remarks: tuple[Reason, ...] = ()
    if is_judged:
        reason = _direction_reason(drawn, expected, residual_deg, direction_deg)
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
