"""Statistics of a class: states, scores, criteria, mistakes, open reports."""

from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass
from math import floor
from statistics import mean, median

from grader.documents import CriterionDocument, CriterionMovedDocument, ReportDocument, ResultsDocument
from grader.feedback.mistakes import MISTAKES, mistake_title
from grader.feedback.numbers import shown
from grader.outcomes import CHARGED, CREDITED

BINS = 10
HARDEST = 8
COMMONEST = 8

_JUDGED = CREDITED | CHARGED


def states(results: ResultsDocument) -> Counter[str]:
    """Count the reports in each state."""
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
    """Return the middle of the score's range for each report that waits for a person, as a share."""
    return [
        sum(report.score_range) / 2.0 / report.max_score
        for report in results.reports
        if report.status == "needs_review" and report.score is None
        if report.score_range is not None and report.max_score > 0.0
    ]


def histogram(values: Iterable[float]) -> list[int]:
    """Count values in ten equal bins of 0..1; full marks belong to the last."""
    counts = [0] * BINS
    for value in values:
        counts[min(BINS - 1, max(0, floor(value * BINS + 1e-9)))] += 1
    return counts


@dataclass(frozen=True, slots=True)
class ScoreSpread:
    """Mean, median, smallest and largest of the final scores, as shares of the maximum."""

    mean: float
    median: float
    least: float
    largest: float


def spread(results: ResultsDocument) -> ScoreSpread | None:
    """Return the spread of the final scores; None while there are none."""
    values = shares(results)
    return ScoreSpread(mean(values), median(values), min(values), max(values)) if values else None


# Criteria -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Hardness:
    """Difficulty of a criterion: the share of its points that was earned when it was judged."""

    title: str
    earned: float


def title_of(results: ResultsDocument, criterion: CriterionDocument | CriterionMovedDocument) -> str:
    """Return a criterion's title in the language of the class."""
    return results.titles.get(criterion.id, criterion.title)


def hardest(results: ResultsDocument) -> list[Hardness]:
    """Return the criteria that lost most points, worst first; those that everybody got are left out."""
    judged: dict[str, list[CriterionDocument]] = {}
    for report in results.reports:
        for criterion in report.criteria:
            if criterion.verdict in _JUDGED and criterion.points is not None:
                judged.setdefault(criterion.id, []).append(criterion)
    hardness = []
    for criteria in judged.values():
        earned = sum(criterion.points or 0.0 for criterion in criteria)
        possible = sum(criterion.max_points for criterion in criteria)
        if earned < possible:
            hardness.append(Hardness(title_of(results, criteria[0]), earned / possible))
    return sorted(hardness, key=lambda criterion: criterion.earned)[:HARDEST]


def settled(results: ResultsDocument) -> int:
    """Count the verdicts that the program settled itself."""
    criteria = (criterion for report in results.reports for criterion in report.criteria)
    return sum(criterion.verdict in _JUDGED and criterion.decided is None for criterion in criteria)


@dataclass(frozen=True, slots=True)
class Followed:
    """A criterion judged right because it follows from the student's own earlier value, and how often."""

    points: float
    reports: list[ReportDocument]
    criteria: list[tuple[str, int]]


def follow_through(results: ResultsDocument) -> Followed:
    """Follow-through granted, with the reports."""
    points, reports, times = 0.0, [], Counter[str]()
    for report in results.reports:
        given = [criterion for criterion in report.criteria if criterion.verdict == "follow_through"]
        points += sum(criterion.points or 0.0 for criterion in given)
        times.update(title_of(results, criterion) for criterion in given)
        reports += [report] if given else []
    return Followed(points, reports, times.most_common(HARDEST))


# Mistakes -----------------------------------------------------------------------------------------


def commonest(results: ResultsDocument) -> list[tuple[str, list[ReportDocument]]]:
    """Return titles of mistakes, keys of the catalogues, with the reports that show them, commonest first."""
    reports: dict[str, list[ReportDocument]] = {}
    for report in results.reports:
        for title in dict.fromkeys(mistake_title(one) for one in report.mistakes if one.code in MISTAKES):
            reports.setdefault(title, []).append(report)
    return sorted(reports.items(), key=lambda item: -len(item[1]))[:COMMONEST]


def wrong_scales(results: ResultsDocument) -> list[tuple[ReportDocument, list[CriterionDocument], list[str]]]:
    """Return reports whose scales were not right: the criteria lost, and the scales not understood."""
    wrong = []
    for report in results.reports:
        # A criterion asks for a scale where it expects something per millimetre on paper.
        asked = [each for each in report.criteria if each.vector is None]
        asked = [each for each in asked if (each.expected.unit or "").endswith("/mm")]
        lost = [criterion for criterion in asked if criterion.verdict in CHARGED]
        refused = [
            f"{name} = {scale.text}" for name, scale in report.scales.items() if scale.refused and scale.text
        ]
        if lost or refused:
            wrong.append((report, lost, refused))
    return wrong


# What waits ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Waiting:
    """A report that a person must review, the points at stake, and its open criteria."""

    report: ReportDocument
    points: float
    criteria: list[CriterionDocument]


def waiting(results: ResultsDocument) -> list[Waiting]:
    """Return the reports that wait for a person, those with the most points at stake first."""
    reports = [report for report in results.reports if report.status in {"needs_review", "unreadable"}]
    return sorted(
        (
            Waiting(report, _stake(report), [one for one in report.criteria if one.verdict == "review"])
            for report in reports
        ),
        key=lambda item: -item.points,
    )


def _stake(report: ReportDocument) -> float:
    """Return the difference between the largest and the smallest score that are still possible."""
    if report.status == "unreadable" or report.score_range is None:
        return report.max_score
    return shown(report.score_range[1]) - shown(report.score_range[0])
