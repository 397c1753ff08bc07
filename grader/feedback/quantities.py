"""Lengths, directions, values and tolerances, as a table's cells."""

from grader.documents import QuantityDocument, ToleranceDocument
from grader.i18n import Tongue

SCALE_UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s²)/mm"}


def told(quantity: QuantityDocument, speaker: Tongue) -> list[str]:
    """Length and direction on paper, real value."""
    drawn = []
    if quantity.length_mm is not None:
        drawn.append(speaker.quantity(quantity.length_mm, 1, "mm"))
    if quantity.direction_deg is not None:
        # 359.96 is written as 0.0, not as 360.0.
        rounded = round(quantity.direction_deg, 1) % 360.0
        drawn.append(f"∠\N{NO-BREAK SPACE}{speaker.number(rounded, 1)}°")
    parts = [" ".join(drawn)] if drawn else []
    if quantity.value is not None:
        unit = speaker.unit(quantity.unit or "")
        parts.append(f"{speaker.significant(quantity.value, 4)}\N{NO-BREAK SPACE}{unit}".rstrip())
    return parts


def tolerance(allowed: ToleranceDocument, unit: str, speaker: Tongue) -> list[str]:
    """What full marks allow, in length and direction or in the value, which is in this unit."""
    drawn = []
    if allowed.length_mm is not None:
        drawn.append(f"±{speaker.quantity(allowed.length_mm, 1, 'mm')}")
    if allowed.direction_deg is not None:
        drawn.append(f"±{speaker.number(allowed.direction_deg, 1)}°")
    if allowed.value is not None and not drawn:
        drawn.append(
            f"±{speaker.significant(allowed.value, 2)}\N{NO-BREAK SPACE}{speaker.unit(unit)}".rstrip()
        )
    return [" ".join(drawn)] if drawn else []


def scale(value: float | None, name: str, speaker: Tongue) -> str:
    """A scale with its unit; a dash where there is none."""
    if value is None:
        return "–"
    return f"{speaker.significant(value, 4)}\N{NO-BREAK SPACE}{speaker.unit(SCALE_UNITS[name])}"
