"""How verdicts, states, names and problems are written for people."""

import re
from dataclasses import dataclass
from functools import cache, lru_cache

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup, escape

from grader.documents import ProblemDocument, UnmatchedDocument
from grader.feedback.sentences import BETWEEN_RIVALS, RIVALS
from grader.language import N_, ROOT_LANGUAGE, Tongue, tongue
from grader.overlay.scene import COLOURS, MARKS

VERDICTS = {
    "full": N_("right"),
    "partial": N_("nearly right"),
    "none": N_("wrong"),
    "follow_through": N_("follows rightly"),
    "review": N_("waits for a person"),
    "not_judged": N_("not judged"),
}
STATES = {
    "graded": N_("graded"),
    "needs_review": N_("needs review"),
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

_GREEK = {"omega": "ω", "epsilon": "ε"}
_NAME = re.compile(
    r"\b(?:(?P<vector>[vank])_(?P<points>[A-Z][A-Za-z0-9]{0,7})(?:_(?P<part>[ntcr])\b)?"
    r"|(?P<rate>omega|epsilon)_(?P<link>\w{1,4})|(?P<letter>[kμ])(?P<scale>[Llva])\b"
    r"|O(?P<pivot>[0-9])(?=[A-Z]?\b))"
)


@lru_cache(4096)
def symbols(text: str) -> Markup:
    """Text with names of vectors, rates and scales set with their indices; everything else escaped."""
    parts: list[Markup] = []
    end = 0
    for match in _NAME.finditer(text):
        parts += [escape(text[end : match.start()]), _symbol(match)]
        end = match.end()
    return Markup("").join([*parts, escape(text[end:])])


def _symbol(match: re.Match[str]) -> Markup:
    if match["vector"]:
        part = Markup("<sup>{}</sup>").format(match["part"]) if match["part"] else Markup("")
        return Markup("<i>{}</i><sub>{}</sub>{}").format(match["vector"], match["points"], part)
    if match["pivot"]:
        return Markup("O<sub>{}</sub>").format(match["pivot"])
    if match["rate"]:
        return Markup("<i>{}</i><sub>{}</sub>").format(_GREEK[match["rate"]], match["link"])
    return Markup("<i>{}</i><sub>{}</sub>").format(match["letter"], match["scale"])


# Templates ----------------------------------------------------------------------------------------


TURNING = (*range(0x202A, 0x202F), *range(0x2066, 0x206A))
"""Unicode's marks of direction that hold until they are ended."""


def _in_order(value: object) -> object:
    """A text without the signs that turn the order of what follows it on the page: names may have them."""
    return value.translate(dict.fromkeys(TURNING)) if isinstance(value, str) else value


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
        finalize=_in_order,
    )
    made.install_gettext_callables(  # type: ignore[attr-defined]
        speaker.gettext, speaker.ngettext, newstyle=True
    )
    made.filters["symbols"] = symbols
    made.filters["first_up"] = lambda text: text[:1].upper() + text[1:]
    made.filters["points"] = lambda value: speaker.trimmed(value, 2)
    made.globals.update(
        speaker=speaker, verdicts=VERDICTS, states_words=STATES, state_marks=STATE_MARKS,
        tones=STATE_TONES, colours=COLOURS, dark_colours=DARK_COLOURS, marks=MARKS,
        rivals=speaker.gettext(RIVALS), either=speaker.gettext(BETWEEN_RIVALS),
    )  # fmt: skip
    return made


# Problems -----------------------------------------------------------------------------------------

PROBLEMS: dict[str, str] = {
    "file_missing": N_("The file could not be opened."),
    "link_leads_out": N_("This is a link to a file elsewhere; hand in the file itself."),
    "file_empty": N_("The file is empty; hand it in again."),
    "file_type_unsupported": N_("The file is of a type that is not read: use JPEG, PNG, TIFF or PDF."),
    "image_too_large": N_("The image is too large; scan at 600 dpi or less."),
    "file_too_large": N_("The file is too large; split it, or scan at 300 dpi."),
    "file_changed": N_("The file changed while the folder was read; grade again."),
    "storage_unreadable": N_("The file could not be read from where it is stored; grade again."),
    "image_too_small": N_("The image is too small or too narrow for a drawing; scan the whole sheet."),
    "image_damaged_rows": N_("Rows of the image are damaged; scan it again, or grade it by hand."),
    "image_damaged": N_("The image is damaged; scan or export it again."),
    "image_truncated": N_("The image is cut off before its end; upload it again."),
    "pdf_encrypted": N_("The PDF asks for a password; save it without one."),
    "pdf_damaged": N_("The PDF is damaged; export it again."),
    "pdf_too_heavy": N_("The page has too many drawing commands; export it as an image."),
    "page_missing": N_("The file has no such page."),
    "pages_none": N_("The document has no pages."),
    "pages_too_many": N_("The document has too many pages; split it."),
    "page_blank": N_("The page is blank and was passed over."),
    "page_not_a_drawing": N_(
        "The page is no drawing: it has far too many lines, or its tones are inverted. Scan it in greyscale."
    ),
    "squared_paper": N_(
        "The paper is squared: its printed lines were taken out. Strokes along one may be lost if no darker."
    ),
    "title_block_unsure": N_("A large area at the lower right was taken for the title block and left out."),
    "calibration_page": N_("This is the calibration page, not a drawing."),
    "print_scaled": N_("The sheet was printed or copied at another scale than 1:1."),
    "resolution_wrong": N_("The resolution that the file states is wrong."),
    "resolution_assumed": N_("The file states no resolution; a usual one was assumed."),
    "registration_disagrees": N_("Frame, paper and resolution disagree about the sheet's size."),
    "paper_assumed": N_("Only the paper's edges give the scale; the paper was taken for A3."),
    "frame_missing": N_("No drawing frame was found; positions on the sheet are rough."),
    "scale_by_drawing": N_("The page's scale was corrected by lengths that are known: links, v_A and a_A."),
    "scale_doubtful": N_("Lengths that are known contradict the page's scale: lengths may be off."),
    "scale_unknown": N_("Only the drawing can tell the page's scale, with kL, kv and ka declared."),
    "upright_unsure": N_("No title block shows which way up the sheet is."),
    "sheet_refused": N_("The sheet could not be placed: no frame, paper edge or marker settles it."),
    "nothing_handed_in": N_("Nothing was handed in."),
    "nothing_usable": N_("Nothing that was handed in can be used."),
    "nothing_read": N_("No figure of this assignment could be read on the pages handed in."),
    "variant_unknown": N_("Nothing says this student's number or position; add it to the roster."),
    "n_disagrees": N_("Sources disagree about the student's number."),
    "position_disagrees": N_("Sources disagree about the student's position."),
    "n_range": N_("The assignment has no such number."),
    "position_range": N_("The assignment has no such position."),
    "number_read": N_("The number was read on the sheet; check it."),
    "number_differs": N_(
        "The sheet has another number than the roster, and the drawing differs from the roster's."
    ),
    "number_contradicted": N_("The number on the sheet is not the one that the drawing follows."),
    "number_doubtful": N_("The number on the sheet could not be read surely; add it to the roster."),
    "n_needed": N_("Nothing says this student's number or position; add it to the roster."),
    "position_needed": N_("Nothing says this student's number or position; add it to the roster."),
    "does_not_assemble": N_("The mechanism does not assemble with these data."),
    "singular": N_("The velocities are not determined in this position of the mechanism."),
    "sheet_boxes": N_("The answer sheet's boxes are too small for this assignment."),
    "sheet_zone_small": N_("The answer sheet's zones are too small for this assignment."),
    "sheet_not_flat": N_("The sheet was not flat when it was photographed or scanned."),
    "measurements": N_("The file of measurements has faults."),
    "measurements_encoding": N_("The file of measurements is not UTF-8 text."),
    "measurements_unreadable": N_("The file of measurements could not be read."),
    "measurement_fault": N_("A measured value could not be used."),
    "measurement_columns": N_("Columns of the measurements that are not known were passed over."),
    "measurement_not_used": N_("A measured value is not asked for in this assignment."),
    "roster_columns": N_("Columns of the roster without meaning here were passed over."),
    "scale_refused": N_("A declared scale could not be understood."),
    "scale_box_unread": N_("A scale written on the sheet could not be read."),
    "scale_box_doubtful": N_("A scale written on the sheet could not be read surely; it was not used."),
    "scale_box_disagrees": N_("A scale written on the sheet contradicts another declaration of it."),
    "scale_disagrees": N_("Sources disagree about a scale; none of them is used."),
    "measurements_twice": N_("There are several sets of measurements; they were taken together."),
    "measurements_disagree": N_("Sets of measurements disagree; what they disagree about is not used."),
    "measurements_unmatched": N_("Nothing says whose measurements these are."),
    "not_explained": N_("The vectors do not belong together: no explanation fits them. A person must look."),
    "owner_unknown": N_("Nothing says whose page this is."),
    "owner_disagree": N_("Sources disagree about whose page this is."),
    "owner_not_listed": N_("The page names a student who is not on the roster."),
    "owner_ambiguous": N_("The student has several positions, and nothing says which one this is."),
    "owner_other_assignment": N_("The page belongs to another assignment."),
    "order_refused": N_("The roster's order cannot be used for these pages."),
    "scan_missing": N_("A scan that the roster names is not there."),
    "decision_fault": N_("A line of the decisions cannot be used."),
    "decision_not_applied": N_("A person's decision could not be applied."),
    "crashed": N_("The file ended the program that read it; scan or export it again."),
    "too_slow": N_("Reading the file took too long; scan or export it again."),
    "too_much_memory": N_("Reading the file took too much memory; scan or export it again."),
    "internal_error": N_("This could not be processed because of an error in the program."),
}
"""By code; a code that is not here is told by its own message, in English."""


@dataclass(frozen=True, slots=True)
class ProblemText:
    """A problem as a page shows it: what it is, and the program's own words where they say more."""

    text: str
    detail: str
    file: str


def problem_sentence(problem: ProblemDocument, speaker: Tongue, *, brief: bool = False) -> ProblemText:
    """A problem of a submission; `brief` leaves the program's own words out where a sentence says it."""
    if brief and problem.code in PROBLEMS:
        return ProblemText(speaker.gettext(PROBLEMS[problem.code]), "", problem.file or "")
    return _text_of(problem.code, problem.message, problem.file or "", speaker)


def unmatched_sentence(unmatched: UnmatchedDocument, speaker: Tongue) -> ProblemText:
    """A page or file that is nobody's."""
    place = unmatched.file
    if unmatched.page is not None:
        place = f"{place}, {speaker.gettext('page')} {unmatched.page}"
    return _text_of(unmatched.code, unmatched.message, place, speaker)


def _text_of(code: str, message: str, file: str, speaker: Tongue) -> ProblemText:
    known = PROBLEMS.get(code)
    # The English message is the more precise one: no summary is needed before it.
    if known is None or (speaker.lang == ROOT_LANGUAGE and message):
        return ProblemText(message or code, "", file)
    return ProblemText(speaker.gettext(known), message, file)
