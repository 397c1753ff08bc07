"""The class in figures: states, distribution of scores, hardest criteria, commonest mistakes."""

from collections import Counter
from dataclasses import dataclass
from math import floor

from markupsafe import Markup

from grader.documents import ResultsDocument
from grader.i18n import Tongue

BINS = 10
HARDEST = 6
COMMONEST = 6

_JUDGED = {"full", "partial", "none", "follow_through"}


def states(results: ResultsDocument) -> Counter[str]:
    """How many reports are in each state."""
    return Counter(report.status for report in results.reports)


def shares(results: ResultsDocument) -> list[float]:
    """Final scores as shares of the maximum; what waits for a person is not counted."""
    return [
        report.score / report.max_score
        for report in results.reports
        if report.score is not None and report.max_score > 0.0
    ]


def histogram(values: list[float]) -> list[int]:
    """Counts in ten equal bins of 0..1; full marks belong to the last."""
    counts = [0] * BINS
    for value in values:
        counts[min(BINS - 1, max(0, floor(value * BINS + 1e-9)))] += 1
    return counts


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
            about[criterion.id] = (criterion.title, criterion.vector)
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


def commonest(results: ResultsDocument) -> list[tuple[str, int]]:
    """Codes of mistakes with the number of submissions that show them, commonest first."""
    counts: Counter[str] = Counter()
    for report in results.reports:
        counts.update({mistake.code for mistake in report.mistakes})
    return counts.most_common(COMMONEST)


def distribution_svg(results: ResultsDocument, speaker: Tongue) -> Markup:
    """The distribution of scores as a bar chart; empty where nothing is graded yet."""
    values = shares(results)
    if not values:
        return Markup("")
    counts = histogram(values)
    tallest = max(counts)
    parts: list[Markup] = []
    for index, count in enumerate(counts):
        height = 80.0 * count / tallest
        x = 6 + index * 34
        label = f"{10 * index}–{10 * (index + 1)}"
        parts.append(
            Markup(
                '<rect x="{}" y="{:.1f}" width="28" height="{:.1f}" rx="2"><title>{} %: {}</title></rect>'
            ).format(x, 100 - height, height, label, count)
        )
        if count:
            parts.append(Markup('<text x="{}" y="{:.1f}">{}</text>').format(x + 14, 95 - height, count))
        parts.append(Markup('<text class="axis" x="{}" y="115">{}</text>').format(x - 3, 10 * index))
    parts.append(Markup('<text class="axis" x="343" y="115">100</text>'))
    summary = speaker.gettext("Scores in per cent of the maximum: how many students in each tenth.")
    return Markup(
        '<svg class="chart" viewBox="0 0 352 122" role="img" aria-label="{}">{}'
        '<line x1="2" y1="100.5" x2="350" y2="100.5"/></svg>'
    ).format(summary, Markup("").join(parts))
