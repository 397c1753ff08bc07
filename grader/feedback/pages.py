"""The pages: one per submission, one for the class. Self-contained, readable offline and on paper."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from urllib.parse import quote

from jinja2 import Environment, PackageLoader, StrictUndefined

from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    QuantityDocument,
    ReportDocument,
    ResultsDocument,
    SheetDocument,
    ToleranceDocument,
)
from grader.feedback import statistics, words
from grader.feedback.mistakes import MISTAKES, Words, words_of
from grader.feedback.overlay import View, views
from grader.feedback.problems import problem_sentence, unmatched_sentence
from grader.feedback.sentences import PLACES, Level, mistake_sentences, place
from grader.files import write_whole
from grader.i18n import N_, Tongue, tongue
from grader.scene import COLOURS, MARKS, Picture

SHEET = N_("the sheet")

_NO_NAMES: Mapping[str, str] = {}


def write_feedback(  # noqa: PLR0913 - all that the file holds
    report: ReportDocument,
    pictures: Sequence[Picture],
    out_dir: Path,
    lang: str,
    level: Level = "full",
    *,
    title: str = "",
    student_name: str = "",
    names: Mapping[str, str] = _NO_NAMES,
) -> None:
    """Write `feedback.html`, `overlay.png` and `overlay_2.png` ... of one submission into a folder.

    Arguments
    ---------
    report : its criteria's `feedback` is shown as it stands (see `criterion_feedback`)
    pictures : of its pages, in order; none for entered measurements
    level : `full` shows what was expected; `hint` and `symbol` do not
    title : of the assignment, in the language of the page; its id where empty
    names : nodes and scales as the assignment's students know them

    Raises OutputError where a file cannot be written.
    """
    files = ["overlay.png" if k == 1 else f"overlay_{k}.png" for k in range(1, len(pictures) + 1)]
    for file, picture in zip(files, pictures, strict=True):
        write_whole(out_dir / file, picture.png)
    for old in out_dir.glob("overlay*.png"):
        # Of an earlier run, when more pages were handed in.
        if old.name not in files:
            old.unlink(missing_ok=True)
    page = feedback_page(report, pictures, lang, level, title=title, student_name=student_name, names=names)
    write_whole(out_dir / "feedback.html", page)


def feedback_page(  # noqa: PLR0913 - all that the file holds
    report: ReportDocument,
    pictures: Sequence[Picture],
    lang: str,
    level: Level = "full",
    *,
    title: str = "",
    student_name: str = "",
    names: Mapping[str, str] = _NO_NAMES,
) -> str:
    """The page of one submission; arguments as of `write_feedback`."""
    speaker = tongue(lang)
    return _environment(speaker.lang).get_template("feedback.html").render(
        report=report,
        title=title or report.assignment,
        student_name=student_name,
        show_expected=level == "full",
        criteria=[_row(criterion, speaker, level) for criterion in report.criteria],
        mistakes=_mistakes(report, speaker, level, names),
        problems=[problem_sentence(problem, speaker) for problem in report.problems],
        scales=_scales(report, speaker, names),
        sheets=_sheets(report, pictures, speaker, level),
        score=_score(report, speaker),
        colours=COLOURS,
    )  # fmt: skip


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
    folders = folders_of(results.reports)
    rows = [
        {
            "report": report,
            "name": student_names.get(report.student_id, ""),
            "link": f"{quote(folder)}/feedback.html",
            "score": _score(report, speaker),
            "waiting": sum(criterion.verdict == "review" for criterion in report.criteria),
            "problems": Counter(
                problem_sentence(problem, speaker, brief=True) for problem in report.problems
            ),
            "best": report.score if report.score is not None else (report.score_range or (-1.0, -1.0))[0],
        }
        for report, folder in zip(results.reports, folders, strict=True)
    ]
    return _environment(speaker.lang).get_template("index.html").render(
        results=results,
        title=title or results.assignment,
        rows=rows,
        has_positions=any(report.position is not None for report in results.reports),
        has_n=any("n" in report.variant for report in results.reports),
        unmatched=[unmatched_sentence(one, speaker) for one in results.unmatched],
        states=statistics.states(results),
        chart=statistics.distribution_svg(results, speaker),
        hardest=statistics.hardest(results),
        commonest=[
            (MISTAKES[code].title, count) for code, count in statistics.commonest(results) if code in MISTAKES
        ],
        colours=COLOURS,
    )  # fmt: skip


def folders_of(reports: Sequence[ReportDocument]) -> list[str]:
    """Each report's folder below the output folder: the student, with several positions also that."""
    counts: dict[str, int] = {}
    for report in reports:
        counts[report.student_id] = counts.get(report.student_id, 0) + 1
    return [
        report.student_id
        if counts[report.student_id] == 1
        else f"{report.student_id}/{'unknown' if report.position is None else report.position}"
        for report in reports
    ]


@cache
def _environment(lang: str) -> Environment:
    speaker = tongue(lang)
    environment = Environment(
        loader=PackageLoader("grader.feedback"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
    )
    environment.install_gettext_callables(  # type: ignore[attr-defined]
        speaker.gettext, speaker.ngettext, newstyle=True
    )
    environment.filters["symbols"] = words.symbols
    environment.filters["first_up"] = lambda text: text[:1].upper() + text[1:]
    environment.filters["points"] = lambda value: speaker.trimmed(value, 2)
    environment.globals.update(
        speaker=speaker, verdicts=words.VERDICTS, states_words=words.STATES, state_marks=words.STATE_MARKS,
        marks=MARKS,
    )  # fmt: skip
    return environment


# What the templates show ---------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Row:
    criterion: CriterionDocument
    measured: list[str]
    expected: list[str]
    tolerance: list[str]


def _row(criterion: CriterionDocument, speaker: Tongue, level: Level) -> _Row:
    expected = _quantity(criterion.expected, speaker) if level == "full" else []
    measured = _quantity(criterion.measured, speaker)
    return _Row(criterion, measured, expected, _tolerance(criterion.tolerance, speaker))


def _quantity(quantity: QuantityDocument, speaker: Tongue) -> list[str]:
    """Length and direction on paper, real value."""
    drawn = []
    if quantity.length_mm is not None:
        drawn.append(speaker.quantity(quantity.length_mm, 1, "mm"))
    if quantity.direction_deg is not None:
        drawn.append(f"∠\N{NARROW NO-BREAK SPACE}{speaker.number(quantity.direction_deg, 1)}°")
    parts = [" ".join(drawn)] if drawn else []
    if quantity.value is not None:
        unit = speaker.unit(quantity.unit or "")
        parts.append(f"{speaker.significant(quantity.value, 4)}\N{NO-BREAK SPACE}{unit}".rstrip())
    return parts


def _tolerance(tolerance: ToleranceDocument, speaker: Tongue) -> list[str]:
    drawn = []
    if tolerance.length_mm is not None:
        drawn.append(f"±{speaker.quantity(tolerance.length_mm, 1, 'mm')}")
    if tolerance.direction_deg is not None:
        drawn.append(f"±{speaker.number(tolerance.direction_deg, 1)}°")
    return [" ".join(drawn)] if drawn else []


def _score(report: ReportDocument, speaker: Tongue) -> str:
    """The score, the range it lies in, or a dash."""
    if report.score is not None:
        return speaker.trimmed(report.score, 2)
    if report.score_range is None or report.status in {"missing", "unreadable"}:
        return "–"
    low, high = (speaker.trimmed(value, 2) for value in report.score_range)
    return low if low == high else f"{low}–{high}"


def _mistakes(
    report: ReportDocument, speaker: Tongue, level: Level, names: Mapping[str, str]
) -> list[dict[str, object]]:
    if level == "symbol":
        return []
    titles = {criterion.id: criterion.title for criterion in report.criteria}
    return [
        {
            "title": speaker.gettext(words.title),
            "text": mistake_sentences(words, mistake.at, speaker, names),
            "detail": mistake.detail if level == "full" else "",
            "at": place(mistake.at, speaker, names),
            "explains": [titles.get(one, one) for one in mistake.explains],
        }
        for mistake in report.mistakes
        for words in (_words_of(mistake),)
    ]


def _words_of(mistake: MistakeDocument) -> Words:
    known = dict(part.split(" = ", 1) for part in mistake.detail.split(", ") if " = " in part)
    return words_of(mistake.code, mistake.at, known.get("line", ""))


_SCALE_UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s²)/mm"}


def _scales(
    report: ReportDocument, speaker: Tongue, names: Mapping[str, str]
) -> list[dict[str, str | bool | None]]:
    def written(value: float | None, unit: str) -> str:
        if value is None:
            return "–"
        return f"{speaker.significant(value, 4)}\N{NO-BREAK SPACE}{speaker.unit(unit)}"

    return [
        {
            "name": names.get(name, name),
            "text": scale.text,
            "declared": written(scale.declared, _SCALE_UNITS[name]),
            "used": written(scale.used, _SCALE_UNITS[name]),
            "assumed": scale.assumed,
            "refused": scale.refused,
            "source": speaker.gettext(words.SOURCES[scale.source]) if scale.source else "",
        }
        for name, scale in report.scales.items()
    ]


def _sheets(
    report: ReportDocument, pictures: Sequence[Picture], speaker: Tongue, level: Level
) -> list[tuple[Picture, list[View], str]]:
    """Each page's picture, its looks, and for instructors how its millimetres were found."""
    captions = {kind: speaker.gettext(text) for kind, text in {**PLACES, "sheet": SHEET}.items()}
    placed = {(one.source, one.page): one.sheet for one in report.reading.sheets if level == "full"}
    return [
        (
            picture,
            views(picture, number, captions),
            _placed(placed.get((picture.source, picture.page)), speaker),
        )
        for number, picture in enumerate(pictures, start=1)
    ]


def _placed(sheet: SheetDocument | None, speaker: Tongue) -> str:
    if sheet is None or sheet.method not in words.METHODS:
        return ""
    method = speaker.gettext(words.METHODS[sheet.method])
    return f"{method}, ±{speaker.quantity(sheet.residual_mm, 2, 'mm')}"


__all__ = ["feedback_page", "folders_of", "index_page", "write_feedback", "write_index"]
