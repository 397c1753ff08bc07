"""Verdicts, states, names and problems as written for people."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import cache, partial

from jinja2 import Environment, PackageLoader, StrictUndefined

from grader.documents import ProblemDocument, UnmatchedDocument
from grader.feedback.numbers import (
    added_text,
    points_text,
    quantity_cells,
    scale_text,
    score_line,
    score_text,
)
from grader.feedback.sentences import BETWEEN_RIVALS, RIVALS
from grader.language import N_, ROOT_LANGUAGE, Tongue, symbols, tongue
from grader.overlay.scene import COLOURS, MARKS
from grader.texts.spoken import Coded, sentence

VERDICTS = {
    "full": N_("right"),
    "partial": N_("nearly right"),
    "none": N_("wrong"),
    "follow_through": N_("consistent with earlier work"),
    "review": N_("waiting for review"),
    "not_judged": N_("not judged"),
}
STATES = {
    "graded": N_("graded"),
    "needs_review": N_("waiting for review"),
    "unreadable": N_("unreadable"),
    "missing": N_("nothing handed in"),
}
METHODS = {
    "markers": N_("placed by its markers"),
    "combined": N_("placed by frame, paper and resolution together"),
    "corners": N_("placed by the corners that a person gave"),
}
SOURCES = {
    "roster": N_("from the roster"),
    "measurements": N_("from the measurements"),
    "box": N_("read on the sheet"),
}
DARK_COLOURS = {
    "full": "#4fc3ad",
    "partial": "#e3b341",
    "none": "#ff8b77",
    "follow_through": "#8ab6ff",
    "review": "#dd9fe6",
    "not_judged": "#a9afb7",
}
"""Colours of the verdicts on a dark page; drawings stay on white paper."""
STATE_TONES = {
    "graded": "v-full", "needs_review": "v-review", "unreadable": "v-none", "missing": "v-not_judged"
}  # fmt: skip
STATE_MARKS = {"graded": "✓", "needs_review": "?", "unreadable": "✗", "missing": "–"}

UNITS = N_(
    "Lengths are millimetres on paper; directions count counter-clockwise from the horizontal to the right."
)

# Templates ----------------------------------------------------------------------------------------


TURNING = (*range(0x202A, 0x202F), *range(0x2066, 0x206A))
"""Unicode's marks of direction that apply until they are ended."""


def _in_order(value: object) -> object:
    """Return a text without the marks that reverse the order of the text after it: names may contain them."""
    return value.translate(dict.fromkeys(TURNING)) if isinstance(value, str) else value


@cache
def environment(lang: str) -> Environment:
    """Return the environment of templates, with the sentences and numbers of a language."""
    speaker = tongue(lang)
    made = Environment(
        loader=PackageLoader("grader.feedback"),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
        extensions=["jinja2.ext.i18n"],
        finalize=_in_order,
    )
    made.install_gettext_callables(  # type: ignore[attr-defined]
        speaker.gettext, speaker.ngettext, newstyle=True
    )
    made.filters["symbols"] = symbols
    made.filters["first_up"] = lambda text: text[:1].upper() + text[1:]
    said: dict[str, Callable[..., object]] = {
        "points": points_text, "score": score_text, "score_line": score_line, "added": added_text,
        "scale": scale_text, "quantity": quantity_cells, "problem": problem_sentence,
    }  # fmt: skip
    made.filters |= {name: partial(say, speaker=speaker) for name, say in said.items()}
    made.globals.update(
        speaker=speaker, verdicts=VERDICTS, states_words=STATES, state_marks=STATE_MARKS,
        tones=STATE_TONES, colours=COLOURS, dark_colours=DARK_COLOURS, marks=MARKS,
        rivals=speaker.gettext(RIVALS), either=speaker.gettext(BETWEEN_RIVALS), units=speaker.gettext(UNITS),
    )  # fmt: skip
    return made


# Problems -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class ProblemText:
    """A problem as a page shows it: its sentence, and the program's own words if they say more."""

    text: str
    detail: str
    file: str


def problem_sentence(problem: ProblemDocument, speaker: Tongue, *, brief: bool = False) -> ProblemText:
    """Return the sentence of a submission's problem; `brief` leaves out numbers and an error's own words."""
    return _text_of(problem, problem.message, problem.file or "", speaker, brief=brief)


def unmatched_sentence(unmatched: UnmatchedDocument, speaker: Tongue) -> ProblemText:
    """Return the sentence on a page or file without an owner."""
    place = unmatched.file
    if unmatched.page is not None:
        place = f"{place}, {speaker.gettext('page')} {unmatched.page}"
    return _text_of(unmatched, unmatched.message, place, speaker)


def _text_of(problem: Coded, message: str, file: str, speaker: Tongue, *, brief: bool = False) -> ProblemText:
    told = sentence(problem, speaker, brief=brief)
    if brief or not told:
        return ProblemText(told or message or problem.code, "", file)
    # The message is in English, and an error's own words are more precise than a summary.
    if speaker.lang == ROOT_LANGUAGE and message:
        return ProblemText(message, "", file)
    is_all_said = problem.parameters.keys() - {"detail", "page", "line"} and "more" not in problem.parameters
    return ProblemText(told, "" if is_all_said else str(problem.parameters.get("detail", "")), file)
