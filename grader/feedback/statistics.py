"""The class in figures: states, scores, criteria, mistakes, what waits, what follows."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from math import floor
from statistics import mean, median

from grader.documents import CriterionDocument, ReportDocument, ResultsDocument

BINS = 10
HARDEST = 8
COMMONEST = 8

_JUDGED = {"full", "partial", "none", "follow_through"}
_LOST = {"none", "partial"}


def states(results: ResultsDocument) -> Counter[str]:
    """How many reports are in each state."""
    return Counter(report.status for report in results.reports)


# Scores -------------------------------------------------------------------------------------------


def shares(results: ResultsDocument) -> list[float]:
    """Final scores as shares of the maximum."""
    return [
        report.score / report.max_score
        for report in results.reports
        if report.score is not None and report.max_score > 0.0
    ]


def open_shares(results: ResultsDocument) -> list[float]:
    """Of what waits for a person, the middle of the range that the score lies in, as a share."""
    return [
        sum(report.score_range) / 2.0 / report.max_score
        for report in results.reports
        if report.status == "needs_review" and report.score is None
        if report.score_range is not None and report.max_score > 0.0
    ]


def histogram(values: Iterable[float]) -> list[int]:
    """Counts in ten equal bins of 0..1; full marks belong to the last."""
    counts = [0] * BINS
    for value in values:
        counts[min(BINS - 1, max(0, floor(value * BINS + 1e-9)))] += 1
    return counts


@dataclass(frozen=True, slots=True)
class Spread:
    """Mean, median, least and largest of the final scores, as shares of the maximum."""

    mean: float
    median: float
    least: float
    largest: float


def spread(results: ResultsDocument) -> Spread | None:
    """How the final scores spread; None while there are none."""
    values = shares(results)
    return Spread(mean(values), median(values), min(values), max(values)) if values else None


# Criteria -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Hardness:
    """How a criterion went: share of its points earned where it was judged."""

    title: str
    vector: str | None
    earned: float
    judged: int
    waiting: int


def hardest(results: ResultsDocument) -> list[Hardness]:
    """The criteria at which most points were lost, worst first; those that everybody got are left out."""
    earned: dict[str, float] = {}
    possible: dict[str, float] = {}
    judged: Counter[str] = Counter()
    waiting: Counter[str] = Counter()
    about: dict[str, tuple[str, str | None]] = {}
    for report in results.reports:
        for criterion in report.criteria:
            about.setdefault(criterion.id, (criterion.title, criterion.vector))
            if criterion.verdict == "review":
                waiting[criterion.id] += 1
            if criterion.verdict in _JUDGED and criterion.points is not None:
                judged[criterion.id] += 1
                earned[criterion.id] = earned.get(criterion.id, 0.0) + criterion.points
                possible[criterion.id] = possible.get(criterion.id, 0.0) + criterion.max_points
    found = [
        Hardness(*about[one], earned[one] / possible[one], judged[one], waiting[one])
        for one in judged
        if earned[one] < possible[one]
    ]
    return sorted(found, key=lambda one: one.earned)[:HARDEST]


@dataclass(frozen=True, slots=True)
class Followed:
    """What counts as right because it follows from an own earlier value: each criterion, how often."""

    points: float
    reports: list[int]
    criteria: list[tuple[str, int]]


def followed(results: ResultsDocument) -> Followed:
    """Follow-through granted, with the indices of the reports."""
    points, reports, times = 0.0, [], Counter[str]()
    for index, report in enumerate(results.reports):
        given = [one for one in report.criteria if one.verdict == "follow_through"]
        points += sum(one.points or 0.0 for one in given)
        times.update(one.title for one in given)
        reports += [index] if given else []
    return Followed(points, reports, times.most_common(HARDEST))


# Mistakes -----------------------------------------------------------------------------------------


def commonest(results: ResultsDocument) -> list[tuple[str, list[int]]]:
    """Codes of mistakes with the indices of the reports that show them, commonest first."""
    found: dict[str, list[int]] = {}
    for index, report in enumerate(results.reports):
        for code in dict.fromkeys(mistake.code for mistake in report.mistakes):
            found.setdefault(code, []).append(index)
    return sorted(found.items(), key=lambda item: -len(item[1]))[:COMMONEST]


def wrong_scales(results: ResultsDocument) -> list[tuple[int, list[CriterionDocument], list[str]]]:
    """Reports (by index) whose scales were not right: the criteria lost, and the scales not understood."""
    found = []
    for index, report in enumerate(results.reports):
        lost = [one for one in report.criteria if _is_scale(one) and one.verdict in _LOST]
        refused = [f"{name} = {one.text}" for name, one in report.scales.items() if one.refused and one.text]
        if lost or refused:
            found.append((index, lost, refused))
    return found


def _is_scale(criterion: CriterionDocument) -> bool:
    """Whether a criterion asks for a scale: something per millimetre on paper."""
    return criterion.vector is None and (criterion.expected.unit or "").endswith("/mm")


# What waits ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Waiting:
    """A report (by index) that a person must look at, what is at stake, and the criteria that wait."""

    index: int
    points: float
    criteria: list[CriterionDocument]


def waiting(results: ResultsDocument) -> list[Waiting]:
    """What waits for a person, that first which one look decides most of."""
    found = [
        Waiting(index, _stake(report), [one for one in report.criteria if one.verdict == "review"])
        for index, report in enumerate(results.reports)
        if report.status in {"needs_review", "unreadable"}
    ]
    return sorted(found, key=lambda one: -one.points)


def _stake(report: ReportDocument) -> float:
    """Points between the least and the largest score that are still possible."""
    if report.status == "unreadable" or report.score_range is None:
        return report.max_score
    return report.score_range[1] - report.score_range[0]
