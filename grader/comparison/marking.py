"""One vector or value against one expectation."""

import cmath
import math

from grader.comparison.evidence import DrawnVector
from grader.comparison.limits import ALL_RIGHT, Limit, Mark, mark
from grader.outcomes import Reason, Tolerance
from grader.rubric import ToleranceTable
from reference.hand import Spread

REVERSED_WITHIN_DEG = 20.0
"""A direction this near the opposite one is told as reversed, not as turned by so much."""


def tolerances(tolerance: ToleranceTable, expected_mm: float, *, with_direction: bool) -> Tolerance:
    """Both tolerances as the rubric states them."""
    turn = tolerance.direction_at(expected_mm) if with_direction else None
    return Tolerance(tolerance.length_at(expected_mm), turn)


def widened(plain: Tolerance, expected_mm: float, reach: Spread, at_most: float = math.inf) -> Tolerance:
    """The tolerance of a vector that a careful hand may miss by `reach`, millimetres, where that is more.

    What the end is off across a vector makes it longer too, and a zero vector as long as it is off.

    Arguments: `at_most` bounds it to so many times the plain one.
    """
    plain_mm, plain_deg = plain.length_mm or 0.0, plain.direction_deg
    length_mm = math.hypot(expected_mm + reach.along, reach.across) - expected_mm
    length_mm = max(plain_mm, min(length_mm, at_most * plain_mm))
    direction = plain_deg
    if plain_deg is not None:
        turned = math.degrees(math.atan2(reach.across, expected_mm))
        direction = max(plain_deg, min(turned, at_most * plain_deg))
    is_wider = length_mm > plain_mm or direction != plain_deg
    return Tolerance(length_mm, direction, widened=is_wider)


def mark_vector(
    drawn: DrawnVector, expected: complex, allowed: Tolerance, table: ToleranceTable, se: Spread
) -> Mark:
    """A vector as drawn against the expected one, both in millimetres.

    Arguments: `allowed` has a direction where one is judged; `se` are standard errors of what is expected.
    """
    expected_mm = abs(expected)
    off_mm = drawn.length_mm - expected_mm
    se_mm = math.hypot(drawn.se_mm, se.along)
    is_asked = allowed.direction_deg is not None and drawn.direction_rad is not None
    is_judged = is_asked and drawn.length_mm >= table.least_mm
    off_deg = se_deg = 0.0
    if is_judged and drawn.direction_rad is not None:
        off_deg = math.degrees(math.remainder(drawn.direction_rad - cmath.phase(expected), math.tau))
        se_deg = (
            math.hypot(drawn.se_deg, math.degrees(se.across / expected_mm)) if se.across else drawn.se_deg
        )
    length_mm, direction_deg = allowed.length_mm or 0.0, allowed.direction_deg or math.inf
    margin = table.certain_errors
    if (
        abs(off_mm) + margin * se_mm <= length_mm
        and is_judged
        and abs(off_deg) + margin * se_deg <= direction_deg
    ):
        return ALL_RIGHT
    plain = tolerances(table, expected_mm, with_direction=True)
    reason = _length_reason(drawn, expected_mm, length_mm)
    limits = [Limit("length", abs(off_mm), length_mm, plain.length_mm or 0.0, se_mm, table, reason)]
    remarks: tuple[Reason, ...] = ()
    if is_judged:
        reason = _direction_reason(drawn, expected, off_deg, direction_deg)
        plain_deg = plain.direction_deg or direction_deg
        limits.append(Limit("direction", abs(off_deg), direction_deg, plain_deg, se_deg, table, reason))
    elif drawn.direction_rad is not None and min(expected_mm, drawn.length_mm) < table.least_mm:
        shorter = min(expected_mm, drawn.length_mm)
        remarks = (Reason("too_short_to_judge", {"length_mm": shorter, "least_mm": table.least_mm}),)
    return mark(limits, remarks)


def _length_reason(drawn: DrawnVector, expected_mm: float, allowed_mm: float) -> Reason:
    off = drawn.length_mm - expected_mm
    told: dict[str, float | str] = {"measured_mm": drawn.length_mm, "tolerance_mm": allowed_mm}
    if expected_mm <= 1e-9 * allowed_mm:
        return Reason("should_be_zero", told)
    told |= {"expected_mm": expected_mm, "off_mm": abs(off)}
    return Reason("too_long" if off > 0.0 else "too_short", told)


def _direction_reason(drawn: DrawnVector, expected: complex, off_deg: float, allowed_deg: float) -> Reason:
    told: dict[str, float | str] = {
        "measured_deg": degrees((drawn.direction_rad or 0.0) + drawn.turn_rad),
        "expected_deg": degrees(cmath.phase(expected) + drawn.turn_rad),
        "off_deg": abs(off_deg),
        "tolerance_deg": allowed_deg,
    }
    if abs(off_deg) >= 180.0 - REVERSED_WITHIN_DEG:
        return Reason("reversed", told)
    return Reason("turned_left" if off_deg > 0.0 else "turned_right", told)


def degrees(angle_rad: float) -> float:
    """Degrees from 0 up to, not including, 360."""
    return math.degrees(angle_rad) % 360.0 % 360.0


def mark_value(
    value: float, expected: float, allowed: float, plain: float, table: ToleranceTable, unit: str
) -> Mark:
    """A computed value against the expected one, SI; its sign counts where the expected one has any.

    Arguments: `plain` is the tolerance without what it was widened by.
    """
    off = abs(value - expected)
    if off <= allowed:
        return ALL_RIGHT
    told: dict[str, float | str] = {"measured": value, "expected": expected, "unit": unit}
    if value * expected < 0.0:
        reason = Reason("value_reversed", told)
    else:
        told |= {"off": off, "tolerance": allowed}
        large = abs(value) > abs(expected)
        reason = Reason("value_too_large" if large else "value_too_small", told)
    return mark([Limit("value", off, allowed, plain, 0.0, table, reason)])
