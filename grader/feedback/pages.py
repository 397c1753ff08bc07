"""A submission's page. Self-contained, readable offline and on paper."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    QuantityDocument,
    ReportDocument,
    SheetDocument,
    ToleranceDocument,
)
from grader.feedback import words
from grader.feedback.mistakes import Words, words_of
from grader.feedback.overlay import View, views
from grader.feedback.problems import problem_sentence
from grader.feedback.sentences import PLACES, Level, mistake_sentences, place
from grader.feedback.templating import environment, told_score
from grader.files import write_whole
from grader.i18n import N_, Tongue, tongue
from grader.scene import COLOURS, Picture

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
    return environment(speaker.lang).get_template("feedback.html").render(
        report=report,
        title=title or report.assignment,
        student_name=student_name,
        show_expected=level == "full",
        criteria=[_row(criterion, speaker, level) for criterion in report.criteria],
        mistakes=_mistakes(report, speaker, level, names),
        problems=[problem_sentence(problem, speaker) for problem in report.problems],
        scales=_scales(report, speaker, names),
        sheets=_sheets(report, pictures, speaker, level),
        score=told_score(report, speaker),
        colours=COLOURS,
    )  # fmt: skip


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


__all__ = ["feedback_page", "write_feedback"]
