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
from grader.feedback.student_page import environment, score_text
from grader.feedback.words import STATES, VERDICTS, problem_sentence, unmatched_sentence
from grader.files import write_whole
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


def share_followed(results: ResultsDocument) -> Followed:
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
    who = _Who(results, student_names)
    followed = share_followed(results)
    return environment(speaker.lang).get_template("index.html").render(
        results=results,
        title=title or results.assignment,
        rows=_rows(results, who, speaker),
        has_positions=any(report.position is not None for report in results.reports),
        has_n=any("n" in report.variant for report in results.reports),
        unmatched=[unmatched_sentence(one, speaker) for one in results.unmatched],
        states=states(results),
        chart=distribution_svg(results, speaker),
        spread=spread(results),
        has_open=bool(open_shares(results)),
        hardest=hardest(results),
        commonest=[
            (MISTAKES[code].title, len(found), [who.link(index) for index in found])
            for code, found in commonest(results)
            if code in MISTAKES
        ],
        followed=followed,
        followers=[who.link(index) for index in followed.reports],
        waiting=[
            (who.link(one.index), one, results.reports[one.index]) for one in waiting(results)
        ],
        scales=[
            (who.link(index), [_scale(one, speaker) for one in lost], refused)
            for index, lost, refused in wrong_scales(results)
        ],
        alike=[_alike(one, who, speaker) for one in results.alike],
        moved=[_moved(one, who, speaker) for one in results.moved],
        causes=_causes(results.moved),
        score_text=lambda report: score_text(report, speaker),
        shown=SHOWN,
        colours=COLOURS,
    )  # fmt: skip


def folders_of(reports: Sequence[ReportDocument]) -> list[str]:
    """Each report's folder below the output folder: the student, with several positions also that."""
    counts = Counter(report.student_id for report in reports)
    return [
        report.student_id
        if counts[report.student_id] == 1
        else f"{report.student_id}/{'unknown' if report.position is None else report.position}"
        for report in reports
    ]


# Students -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Link:
    """A student's name as a link; `picture` of the first page, empty where there is none."""

    text: str
    page: str
    picture: str


class _Who:
    """Links to students, by the index of their report or by id and position."""

    def __init__(self, results: ResultsDocument, names: Mapping[str, str]) -> None:
        reports, folders = results.reports, folders_of(results.reports)
        several = {student for student, count in Counter(r.student_id for r in reports).items() if count > 1}
        self.names = names
        self.links = [
            Link(
                f"{report.student_id}, {report.position}"
                if report.student_id in several
                else report.student_id,
                f"{quote(folder)}/feedback.html",
                f"{quote(folder)}/overlay.png" if report.reading.sheets else "",
            )
            for report, folder in zip(reports, folders, strict=True)
        ]
        self.index = {(report.student_id, report.position): k for k, report in enumerate(reports)}

    def link(self, index: int) -> Link:
        """Of a report."""
        return self.links[index]

    def of(self, student: str, position: int | None) -> Link:
        """Of a student, who may be gone."""
        index = self.index.get((student, position))
        return Link(student, "", "") if index is None else self.links[index]


def _rows(results: ResultsDocument, who: _Who, speaker: Tongue) -> list[dict[str, object]]:
    return [
        {
            "report": report,
            "name": who.names.get(report.student_id, ""),
            "link": who.link(index).page,
            "score": score_text(report, speaker),
            "waiting": sum(criterion.verdict == "review" for criterion in report.criteria),
            "problems": Counter(
                problem_sentence(problem, speaker, brief=True) for problem in report.problems
            ),
            "best": report.score if report.score is not None else (report.score_range or (-1.0, -1.0))[0],
        }
        for index, report in enumerate(results.reports)
    ]


def _scale(criterion: CriterionDocument, speaker: Tongue) -> str:
    """A scale that was not right: what was declared, and what it is."""
    told = [
        speaker.value(one.value, one.unit or "")
        for one in (criterion.measured, criterion.expected)
        if one.value is not None
    ]
    return f"{criterion.title}: {' ≠ '.join(told)}"


# Sheets that look alike, and what moved -----------------------------------------------------------


def _alike(one: AlikeDocument, who: _Who, speaker: Tongue) -> dict[str, object]:
    chance = "" if one.measure is None else speaker.gettext(CHANCE) % {"chance": _small(one.measure, speaker)}
    return {
        "students": [who.of(*key) for key in zip(one.students, one.positions, strict=True)],
        "why": [speaker.gettext(SIGNS[sign]) for sign in one.why],
        "share": None if one.share is None else f"{speaker.number(100.0 * one.share, 0)}\N{NO-BREAK SPACE}%",
        "compared": one.compared,
        "chance": chance,
    }


def _small(value: float, speaker: Tongue) -> str:
    """A small number in words of tens: 0,0004, or under the least that means anything."""
    return speaker.significant(value, 1) if value >= 1e-6 else f"< {speaker.number(1e-6, 6)}"


def _moved(one: MovedDocument, who: _Who, speaker: Tongue) -> dict[str, object]:
    return {
        "student": who.of(one.student_id, one.position),
        "before": _standing(one.before, speaker),
        "after": _standing(one.after, speaker),
        "why": [speaker.gettext(CAUSES[cause]) for cause in one.why],
        "criteria": [
            (
                criterion.title,
                _verdict(criterion.before, criterion.points_before, speaker),
                _verdict(criterion.after, criterion.points_after, speaker),
            )
            for criterion in one.criteria
        ],
    }


def _standing(one: StandingDocument | None, speaker: Tongue) -> str:
    if one is None:
        return "–"
    if one.score is not None:
        return speaker.trimmed(one.score, 2)
    if one.status == "needs_review" and one.score_range is not None:
        return "–".join(speaker.trimmed(value, 2) for value in dict.fromkeys(one.score_range))
    return speaker.gettext(STATES[one.status])


def _verdict(verdict: str | None, points: float | None, speaker: Tongue) -> str:
    if verdict is None:
        return "–"
    told = f"{MARKS[verdict]} {speaker.gettext(VERDICTS[verdict])}"
    return told if points is None else f"{told} ({speaker.trimmed(points, 2)})"


def _causes(moved: Sequence[MovedDocument]) -> list[tuple[str, int]]:
    """Why marks moved, and how often."""
    times = Counter(cause for one in moved for cause in one.why)
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
