"""Numbers as pages write them: table cells, the score, and how it follows from the points of the rows."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace

from grader.documents import Quantity, ReportDocument, Tolerance
from grader.language import N_, Tongue
from reference.quantities import unit_of

SUM = N_("The points of all criteria add up to %(sum)s.")
SCALED = N_(
    "The points of all criteria add up to %(sum)s of %(judged)s. Criteria that were not judged do not"
    " count: %(sum)s × %(maximum)s / %(judged)s = %(result)s."
)
WEIGHTED = N_(
    "Criteria that were not judged do not count, and each part of the work keeps its weight:"
    " %(terms)s = %(result)s."
)
WAITS = N_("Criteria under review add %(low)s to %(high)s.")
ADDED = N_("A person added %(points)s.")
TAKEN = N_("A person took off %(points)s.")


# Cells --------------------------------------------------------------------------------------------


def quantity_cells(quantity: Quantity, speaker: Tongue) -> list[str]:
    """Return length and direction on paper, and real value, a line each."""
    drawn = []
    if quantity.length_mm is not None:
        drawn.append(speaker.quantity(quantity.length_mm, 1, "mm"))
    if quantity.direction_deg is not None:
        # 359.96 is written as 0.0, not as 360.0.
        rounded = round(quantity.direction_deg, 1) % 360.0
        drawn.append(f"∠\N{NO-BREAK SPACE}{speaker.number(rounded, 1)}°")
    lines = [" ".join(drawn)] if drawn else []
    if quantity.value is not None:
        lines.append(speaker.value(quantity.value, quantity.unit or ""))
    return lines


def tolerance_cells(tolerance: Tolerance, unit: str, speaker: Tongue) -> list[str]:
    """Return the tolerance of full marks, in length and direction, or in the value, whose unit is given."""
    drawn = []
    if tolerance.length_mm is not None:
        drawn.append(f"±{speaker.quantity(tolerance.length_mm, 1, 'mm')}")
    if tolerance.direction_deg is not None:
        drawn.append(f"±{speaker.number(tolerance.direction_deg, 1)}°")
    if tolerance.value is not None and not drawn:
        drawn.append(f"±{speaker.value(tolerance.value, unit, digits=2)}")
    return [" ".join(drawn)] if drawn else []


def scale_text(value: float | None, name: str, speaker: Tongue) -> str:
    """Return a scale with its unit; a dash if there is none."""
    return "–" if value is None else speaker.value(value, unit_of(name))


# The score ----------------------------------------------------------------------------------------


MOST_DECIMALS = 4
"""Decimals of points that are shown in full: a quarter of a share of 0.75 has so many."""


def shown(points: float) -> float:
    """Return points as pages show them, so that what is shown adds up: in full, or with two decimals.

    A total that was scaled has no end; the points of criteria have few decimals.
    """
    known = round(points, 6)
    return known if known == round(known, MOST_DECIMALS) else round(known, 2)


def points_text(points: float, speaker: Tongue) -> str:
    """Return points in a language, as `shown` has them."""
    return speaker.trimmed(shown(points), MOST_DECIMALS)


def score_text(report: ReportDocument, speaker: Tongue) -> str:
    """Return the score, its range, or a dash."""
    if report.score is not None:
        return points_text(report.score, speaker)
    if report.score_range is None or report.status in {"missing", "unreadable"}:
        return "–"
    low, high = (points_text(value, speaker) for value in report.score_range)
    return low if low == high else f"{low}–{high}"


@dataclass(frozen=True, slots=True)
class Part:
    """Points scaled together, of a section or of all without a weight: given, possible, and the factor."""

    section: str | None
    given: float
    judged: float
    factor: float

    @property
    def result(self) -> float:
        """Its contribution to the score."""
        return self.given * self.factor


def score_line(report: ReportDocument, speaker: Tongue) -> str:
    """Explain how the points of the rows add up to the score, so that a reader can recompute it.

    Empty if nothing was judged.
    """
    parts = parts_of(report)
    if not parts:
        return ""
    return " ".join((_settled(report, parts, speaker), *_open_and_added(report, parts, speaker)))


def parts_of(report: ReportDocument) -> list[Part]:
    """Return each section with a weight of its own in which anything was judged, and all others together."""
    parts = []
    for section in dict.fromkeys(criterion.section for criterion in report.criteria):
        own = [criterion for criterion in report.criteria if criterion.section == section]
        judged = sum(one.max_points for one in own if one.verdict != "not_judged")
        if judged:
            whole = judged if section is None else sum(one.max_points for one in own)
            parts.append(Part(section, sum(one.points or 0.0 for one in own), judged, whole / judged))
    in_full = sum(part.judged * part.factor for part in parts)
    return [replace(part, factor=part.factor * report.max_score / in_full) for part in parts]


def _settled(report: ReportDocument, parts: Sequence[Part], speaker: Tongue) -> str:
    def points(value: float) -> str:
        return points_text(value, speaker)

    first = parts[0].factor
    known = {
        "sum": points(sum(part.given for part in parts)),
        "judged": points(sum(part.judged for part in parts)),
        "maximum": points(report.max_score),
        "result": points(_result(report, parts)),
        "terms": " + ".join(f"{points(part.given)} × {speaker.trimmed(part.factor, 4)}" for part in parts),
    }
    is_one = all(math.isclose(part.factor, first) for part in parts)
    text = (SUM if math.isclose(first, 1.0) else SCALED) if is_one else WEIGHTED
    return speaker.gettext(text) % known


def _result(report: ReportDocument, parts: Sequence[Part]) -> float:
    """Return the points before a person added any: of a final score to its last decimal."""
    if report.score is not None:
        return report.score - report.added
    return sum(part.result for part in parts)


def _open_and_added(report: ReportDocument, parts: Sequence[Part], speaker: Tongue) -> Iterator[str]:
    """Yield the open points, and those that a person added or subtracted."""
    if report.score is None and report.score_range is not None:
        settled = shown(_result(report, parts)) + shown(report.added)
        low, high = (max(shown(end) - settled, 0.0) for end in report.score_range)
        yield speaker.gettext(WAITS) % {"low": points_text(low, speaker), "high": points_text(high, speaker)}
    if report.added:
        yield added_text(report, speaker)


def added_text(report: ReportDocument, speaker: Tongue) -> str:
    """Return the points that a person added or subtracted; empty if none."""
    text = ADDED if report.added > 0.0 else TAKEN
    points = points_text(abs(report.added), speaker)
    return speaker.gettext(text) % {"points": points} if report.added else ""
