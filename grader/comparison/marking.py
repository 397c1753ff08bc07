"""One vector or value against one expectation."""

import cmath
import math

from grader.comparison.evidence import DrawnVector
from grader.comparison.limits import Limit, Mark, mark
from grader.outcomes import Reason, Tolerance
from grader.rubric import ToleranceTable

REVERSED_WITHIN_DEG = 20.0
"""A direction this near the opposite one is told as reversed, not as turned by so much."""


def length_tolerance(tolerance: ToleranceTable, expected_mm: float) -> float:
    """Millimetres: the larger of the absolute and the relative tolerance."""
    return max(tolerance.length_mm, tolerance.length_relative * expected_mm)


def direction_tolerance(tolerance: ToleranceTable, expected_mm: float) -> float | None:
    """Degrees: the larger of the fixed one and that of the end across; None where too short to judge."""
    if expected_mm < tolerance.least_mm or expected_mm == 0.0:
        return None
    return max(tolerance.direction_deg, math.degrees(math.atan(tolerance.across_mm / expected_mm)))


def tolerances(tolerance: ToleranceTable, expected_mm: float, *, with_direction: bool) -> Tolerance:
    """Both tolerances, for the report."""
    turn = direction_tolerance(tolerance, expected_mm) if with_direction else None
    return Tolerance(length_tolerance(tolerance, expected_mm), turn)


def mark_vector(
    drawn: DrawnVector, expected: complex, tolerance: ToleranceTable, *, with_direction: bool
) -> Mark:
    """A vector as drawn against the expected one, both in millimetres."""
    limits = [_length_limit(drawn, abs(expected), tolerance)]
    remarks: tuple[Reason, ...] = ()
    if with_direction and drawn.direction_rad is not None:
        allowed = direction_tolerance(tolerance, abs(expected))
        if allowed is not None and drawn.length_mm >= tolerance.least_mm:
            limits.append(_direction_limit(drawn, expected, allowed, tolerance))
        else:
            shorter = min(abs(expected), drawn.length_mm)
            told = {"length_mm": shorter, "least_mm": tolerance.least_mm}
            remarks = (Reason("too_short_to_judge", told),)
    return mark(limits, remarks)


def _length_limit(drawn: DrawnVector, expected_mm: float, tolerance: ToleranceTable) -> Limit:
    allowed = length_tolerance(tolerance, expected_mm)
    off = drawn.length_mm - expected_mm
    told: dict[str, float | str] = {"measured_mm": drawn.length_mm, "tolerance_mm": allowed}
    if expected_mm <= 1e-9 * allowed:
        reason = Reason("should_be_zero", told)
    else:
        told |= {"expected_mm": expected_mm, "off_mm": abs(off)}
        reason = Reason("too_long" if off > 0.0 else "too_short", told)
    return Limit("length", abs(off), allowed, drawn.se_mm, tolerance, reason)


def _direction_limit(
    drawn: DrawnVector, expected: complex, allowed_deg: float, tolerance: ToleranceTable
) -> Limit:
    right = cmath.phase(expected)
    drawn_rad = drawn.direction_rad or 0.0
    off = math.degrees(math.remainder(drawn_rad - right, math.tau))
    told: dict[str, float | str] = {
        "measured_deg": degrees(drawn_rad + drawn.turn_rad),
        "expected_deg": degrees(right + drawn.turn_rad),
        "off_deg": abs(off),
        "tolerance_deg": allowed_deg,
    }
    if abs(off) >= 180.0 - REVERSED_WITHIN_DEG:
        reason = Reason("reversed", told)
    else:
        reason = Reason("turned_left" if off > 0.0 else "turned_right", told)
    return Limit("direction", abs(off), allowed_deg, drawn.se_deg, tolerance, reason)


def degrees(angle_rad: float) -> float:
    """Degrees from 0 up to, not including, 360."""
    return math.degrees(angle_rad) % 360.0 % 360.0


def mark_value(value: float, expected: float, allowed: float, tolerance: ToleranceTable, unit: str) -> Mark:
    """A computed value against the expected one, SI; its sign counts where the expected one has any."""
    told: dict[str, float | str] = {"measured": value, "expected": expected, "unit": unit}
    off = abs(value - expected)
    if value * expected < 0.0 and off > allowed:
        reason = Reason("value_reversed", told)
    else:
        told |= {"off": off, "tolerance": allowed}
        large = abs(value) > abs(expected)
        reason = Reason("value_too_large" if large else "value_too_small", told)
    return mark([Limit("value", off, allowed, 0.0, tolerance, reason)])
