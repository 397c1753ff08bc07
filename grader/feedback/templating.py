"""How pages are made of templates: one environment per language, and what all pages say alike."""

from functools import cache

from jinja2 import Environment, PackageLoader, StrictUndefined

from grader.documents import ReportDocument
from grader.feedback import words
from grader.feedback.sentences import OR, RIVALS
from grader.i18n import Tongue, tongue
from grader.scene import MARKS


@cache
def environment(lang: str) -> Environment:
    """Templates with the sentences and numbers of a language."""
    speaker = tongue(lang)
    made = Environment(
        loader=PackageLoader("grader.feedback"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
    )
    made.install_gettext_callables(  # type: ignore[attr-defined]
        speaker.gettext, speaker.ngettext, newstyle=True
    )
    made.filters["symbols"] = words.symbols
    made.filters["first_up"] = lambda text: text[:1].upper() + text[1:]
    made.filters["points"] = lambda value: speaker.trimmed(value, 2)
    made.globals.update(
        speaker=speaker, verdicts=words.VERDICTS, states_words=words.STATES, state_marks=words.STATE_MARKS,
        marks=MARKS, rivals=speaker.gettext(RIVALS), either=speaker.gettext(OR),
    )  # fmt: skip
    return made


def score_text(report: ReportDocument, speaker: Tongue) -> str:
    """The score, the range it lies in, or a dash."""
    if report.score is not None:
        return speaker.trimmed(report.score, 2)
    if report.score_range is None or report.status in {"missing", "unreadable"}:
        return "–"
    low, high = (speaker.trimmed(value, 2) for value in report.score_range)
    return low if low == high else f"{low}–{high}"
