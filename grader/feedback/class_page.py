"""The class's page: states, scores, criteria, mistakes, what waits. Readable offline and on paper."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from math import floor
from pathlib import Path
from statistics import mean, median
from urllib.parse import quote

from markupsafe import Markup

from grader.documents import (
    AlikeDocument,
    Cause,
    CriterionDocument,
    MovedDocument,
    ReportDocument,
    ResultsDocument,
    Sign,
    StandingDocument,
)
from grader.feedback.mistakes import MISTAKES
from grader.feedback.words import (
    STATES,
    VERDICTS,
    environment,
    problem_sentence,
    score_text,
    unmatched_sentence,
)
from grader.files import result_folders, write_whole
from grader.language import N_, Tongue, tongue
from grader.overlay.scene import COLOURS, MARKS

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
class ScoreSpread:
    """Mean, median, least and largest of the final scores, as shares of the maximum."""

    mean: float
    median: float
    least: float
    largest: float


def spread(results: ResultsDocument) -> ScoreSpread | None:
    """How the final scores spread; None while there are none."""
    values = shares(results)
    return ScoreSpread(mean(values), median(values), min(values), max(values)) if values else None


# Criteria -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Hardness:
    """How a criterion went: the share of its points that was earned where it was judged."""

    title: str
    vector: str | None
    earned: float
    judged: int


def hardest(results: ResultsDocument) -> list[Hardness]:
    """The criteria at which most points were lost, worst first; those that everybody got are left out."""
    judged: dict[str, list[CriterionDocument]] = {}
    first: dict[str, CriterionDocument] = {}
    for report in results.reports:
        for criterion in report.criteria:
            first.setdefault(criterion.id, criterion)
            if criterion.verdict in _JUDGED and criterion.points is not None:
                judged.setdefault(criterion.id, []).append(criterion)
    hardness = []
    for name, criteria in judged.items():
        earned = sum(criterion.points or 0.0 for criterion in criteria)
        possible = sum(criterion.max_points for criterion in criteria)
        if earned < possible:
            hardness.append(Hardness(first[name].title, first[name].vector, earned / possible, len(criteria)))
    return sorted(hardness, key=lambda criterion: criterion.earned)[:HARDEST]


@dataclass(frozen=True, slots=True)
class Followed:
    """What counts as right because it follows from an own earlier value: each criterion, how often."""

    points: float
    reports: list[ReportDocument]
    criteria: list[tuple[str, int]]


def follow_through(results: ResultsDocument) -> Followed:
    """Follow-through granted, with the reports."""
    points, reports, times = 0.0, [], Counter[str]()
    for report in results.reports:
        given = [criterion for criterion in report.criteria if criterion.verdict == "follow_through"]
        points += sum(criterion.points or 0.0 for criterion in given)
        times.update(criterion.title for criterion in given)
        reports += [report] if given else []
    return Followed(points, reports, times.most_common(HARDEST))


# Mistakes -----------------------------------------------------------------------------------------


def commonest(results: ResultsDocument) -> list[tuple[str, list[ReportDocument]]]:
    """Codes of mistakes with the reports that show them, commonest first."""
    reports: dict[str, list[ReportDocument]] = {}
    for report in results.reports:
        for code in dict.fromkeys(mistake.code for mistake in report.mistakes):
            reports.setdefault(code, []).append(report)
    return sorted(reports.items(), key=lambda item: -len(item[1]))[:COMMONEST]


def wrong_scales(results: ResultsDocument) -> list[tuple[ReportDocument, list[CriterionDocument], list[str]]]:
    """Reports whose scales were not right: the criteria lost, and the scales not understood."""
    wrong = []
    for report in results.reports:
        # A criterion asks for a scale where it expects something per millimetre on paper.
        asked = [each for each in report.criteria if each.vector is None]
        asked = [each for each in asked if (each.expected.unit or "").endswith("/mm")]
        lost = [criterion for criterion in asked if criterion.verdict in _LOST]
        refused = [
            f"{name} = {scale.text}" for name, scale in report.scales.items() if scale.refused and scale.text
        ]
        if lost or refused:
            wrong.append((report, lost, refused))
    return wrong


# What waits ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Waiting:
    """A report that a person must review, the points at stake, and the criteria that wait."""

    report: ReportDocument
    points: float
    criteria: list[CriterionDocument]


def waiting(results: ResultsDocument) -> list[Waiting]:
    """The reports that wait for a person, those with the most points at stake first."""
    reports = [report for report in results.reports if report.status in {"needs_review", "unreadable"}]
    return sorted(
        (
            Waiting(report, _stake(report), [one for one in report.criteria if one.verdict == "review"])
            for report in reports
        ),
        key=lambda item: -item.points,
    )


def _stake(report: ReportDocument) -> float:
    """Points between the least and the largest score that are still possible."""
    if report.status == "unreadable" or report.score_range is None:
        return report.max_score
    return report.score_range[1] - report.score_range[0]


# The page -----------------------------------------------------------------------------------------

_NO_NAMES: Mapping[str, str] = {}
SHOWN = 12
"""Students named at once; the others unfold."""
SIGNS: Mapping[Sign, str] = {
    "hand_errors": N_("the same small errors of the hand"),
    "same_place": N_("figures lie in the same places on the sheet"),
    "same_numbers": N_("the same measured values"),
    "same_picture": N_("the ink lies in the same places"),
    "other_number": N_("drawn with the other's number"),
}
CHANCE = N_("By chance a class like this shows %(chance)s such pairs.")
CAUSES: Mapping[Cause, str] = {
    "assignment": N_("the assignment was changed"),
    "rubric": N_("the rubric was changed"),
    "submission": N_("other files were handed in"),
    "roster": N_("the roster was changed"),
    "decision": N_("a person decided"),
    "program": N_("another version of the program"),
    "new": N_("new"),
    "gone": N_("no longer there"),
}


def write_index(
    results: ResultsDocument,
    out_dir: Path,
    lang: str,
    *,
    title: str = "",
    student_names: Mapping[str, str] = _NO_NAMES,
) -> None:
    """Write `index.html`, the class at a glance, into a folder; `student_names` by student_id."""
    write_whole(out_dir / "index.html", index_page(results, lang, title=title, student_names=student_names))


def index_page(
    results: ResultsDocument, lang: str, *, title: str = "", student_names: Mapping[str, str] = _NO_NAMES
) -> str:
    """The class's page."""
    speaker = tongue(lang)
    links = _links(results.reports)
    followed = follow_through(results)

    def link(student: ReportDocument | MovedDocument) -> Link:
        return links.get((student.student_id, student.position), Link(student.student_id))

    return environment(speaker.lang).get_template("index.html").render(
        results=results,
        title=title or results.assignment,
        rows=[_row(report, student_names, link(report), speaker) for report in results.reports],
        has_positions=any(report.position is not None for report in results.reports),
        has_n=any("n" in report.variant for report in results.reports),
        unmatched=[unmatched_sentence(page, speaker) for page in results.unmatched],
        states=states(results),
        chart=distribution_svg(results, speaker),
        spread=spread(results),
        has_open=bool(open_shares(results)),
        hardest=hardest(results),
        commonest=[
            (MISTAKES[code].title, len(reports), [link(report) for report in reports])
            for code, reports in commonest(results)
            if code in MISTAKES
        ],
        followed=followed,
        followers=[link(report) for report in followed.reports],
        waiting=[(link(waiting.report), waiting) for waiting in waiting(results)],
        scales=[
            (link(report), [_scale(criterion, speaker) for criterion in lost], refused)
            for report, lost, refused in wrong_scales(results)
        ],
        alike=[_similar_row(pair, links, speaker) for pair in results.alike],
        moved=[_change_row(change, link(change), speaker) for change in results.moved],
        causes=_causes(results.moved),
        score_text=lambda report: score_text(report, speaker),
        shown=SHOWN,
        colours=COLOURS,
    )  # fmt: skip


# Students -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Link:
    """A student's name as a link; `page` is empty for one who is gone, `picture` where there is no scan."""

    text: str
    page: str = ""
    picture: str = ""


Links = Mapping[tuple[str, int | None], Link]
"""By student and position."""


def _links(reports: Sequence[ReportDocument]) -> Links:
    count = Counter(report.student_id for report in reports)
    links = {}
    for report, folder in zip(reports, result_folders(reports), strict=True):
        student, position = report.student_id, report.position
        text = f"{student}, {position}" if count[student] > 1 else student
        picture = f"{quote(folder)}/overlay.png" if report.reading.sheets else ""
        links[student, position] = Link(text, f"{quote(folder)}/feedback.html", picture)
    return links


def _row(report: ReportDocument, names: Mapping[str, str], link: Link, speaker: Tongue) -> dict[str, object]:
    return {
        "report": report,
        "name": names.get(report.student_id, ""),
        "link": link.page,
        "score": score_text(report, speaker),
        "waiting": sum(criterion.verdict == "review" for criterion in report.criteria),
        "problems": Counter(problem_sentence(problem, speaker, brief=True) for problem in report.problems),
        "best": report.score if report.score is not None else (report.score_range or (-1.0, -1.0))[0],
    }


def _scale(criterion: CriterionDocument, speaker: Tongue) -> str:
    """A scale that was not right: what was declared, and what it is."""
    quantities = (criterion.measured, criterion.expected)
    values = [speaker.value(each.value, each.unit or "") for each in quantities if each.value is not None]
    return f"{criterion.title}: {' ≠ '.join(values)}"


# Similar sheets, and changes since the last run -----------------------------------------------------------


def _similar_row(pair: AlikeDocument, links: Links, speaker: Tongue) -> dict[str, object]:
    chance, share = "", None
    if pair.measure is not None:
        small = pair.measure < 1e-6
        number = f"< {speaker.number(1e-6, 6)}" if small else speaker.significant(pair.measure, 1)
        chance = speaker.gettext(CHANCE) % {"chance": number}
    if pair.share is not None:
        share = f"{speaker.number(100.0 * pair.share, 0)}\N{NO-BREAK SPACE}%"
    return {
        "students": [links.get(key, Link(key[0])) for key in zip(pair.students, pair.positions, strict=True)],
        "why": [speaker.gettext(SIGNS[sign]) for sign in pair.why],
        "share": share,
        "compared": pair.compared,
        "chance": chance,
    }


def _change_row(change: MovedDocument, link: Link, speaker: Tongue) -> dict[str, object]:
    return {
        "student": link,
        "before": _standing(change.before, speaker),
        "after": _standing(change.after, speaker),
        "why": [speaker.gettext(CAUSES[cause]) for cause in change.why],
        "criteria": [
            (
                criterion.title,
                _verdict(criterion.before, criterion.points_before, speaker),
                _verdict(criterion.after, criterion.points_after, speaker),
            )
            for criterion in change.criteria
        ],
    }


def _standing(standing: StandingDocument | None, speaker: Tongue) -> str:
    if standing is None:
        return "–"
    if standing.score is not None:
        return speaker.trimmed(standing.score, 2)
    if standing.status == "needs_review" and standing.score_range is not None:
        return "–".join(speaker.trimmed(value, 2) for value in dict.fromkeys(standing.score_range))
    return speaker.gettext(STATES[standing.status])


def _verdict(verdict: str | None, points: float | None, speaker: Tongue) -> str:
    if verdict is None:
        return "–"
    told = f"{MARKS[verdict]} {speaker.gettext(VERDICTS[verdict])}"
    return told if points is None else f"{told} ({speaker.trimmed(points, 2)})"


def _causes(changes: Sequence[MovedDocument]) -> list[tuple[str, int]]:
    """Why marks changed, and how often."""
    times = Counter(cause for change in changes for cause in change.why)
    return [(CAUSES[cause], count) for cause, count in times.most_common()]


# The distribution of scores ----------------------------------------------------------------------

_STEP, _WIDE, _HIGH, _FOOT = 34, 28, 80.0, 100.0


def distribution_svg(results: ResultsDocument, speaker: Tongue) -> Markup:
    """The distribution of scores; empty where there are none.

    Final scores are full bars; what waits stands on top in dashes, at the middle of its range.
    """
    final, waiting = histogram(shares(results)), histogram(open_shares(results))
    tallest = max(a + b for a, b in zip(final, waiting, strict=True))
    if not tallest:
        return Markup("")
    parts = [_bar(index, final[index], waiting[index], tallest) for index in range(BINS)]
    parts.append(Markup('<text class="axis" x="343" y="115">100</text>'))
    summary = speaker.gettext("Scores in per cent of the maximum: how many students in each tenth.")
    return Markup(
        '<svg class="chart" viewBox="0 0 352 122" role="img" aria-label="{}">{}'
        '<line class="foot" x1="2" y1="100.5" x2="350" y2="100.5"/></svg>'
    ).format(summary, Markup("").join(parts))


def _bar(index: int, final: int, waiting: int, tallest: int) -> Markup:
    x, label = 6 + index * _STEP, f"{10 * index}–{10 * (index + 1)}"
    parts = []
    foot = _FOOT
    for count, kind in ((final, "final"), (waiting, "waits")):
        if count:
            height = _HIGH * count / tallest
            foot -= height
            place = Markup('x="{}" y="{:.1f}" width="{}" height="{:.1f}"').format(x, foot, _WIDE, height)
            told = f"{label} %: {count}"
            parts.append(Markup('<rect class="{}" {}><title>{}</title></rect>').format(kind, place, told))
    if final + waiting:
        parts.append(Markup('<text x="{}" y="{:.1f}">{}</text>').format(x + 14, foot - 5, final + waiting))
    parts.append(Markup('<text class="axis" x="{}" y="115">{}</text>').format(x - 3, 10 * index))
    return Markup("").join(parts)
