"""How verdicts, states and names are written for people."""

import re

from markupsafe import Markup, escape

from grader.i18n import N_

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
}
SOURCES = {
    "roster": N_("from the roster"),
    "measurements": N_("from the measurements"),
    "box": N_("read in the sheet's box"),
}
STATE_MARKS = {"graded": "✓", "needs_review": "?", "unreadable": "✗", "missing": "–"}

_GREEK = {"omega": "ω", "epsilon": "ε"}
_NAME = re.compile(
    r"\b(?:(?P<vector>[vank])_(?P<points>[A-Z][A-Za-z0-9]{0,7})(?:_(?P<part>[ntcr])\b)?"
    r"|(?P<rate>omega|epsilon)_(?P<link>\w{1,4})|(?P<letter>[kμ])(?P<scale>[Llva])\b"
    r"|O(?P<pivot>[0-9])(?=[A-Z]?\b))"
)


def symbols(text: str) -> Markup:
    """Text with names of vectors, rates and scales set with their indices; everything else escaped."""
    parts: list[Markup] = []
    end = 0
    for found in _NAME.finditer(text):
        parts += [escape(text[end : found.start()]), _symbol(found)]
        end = found.end()
    return Markup("").join([*parts, escape(text[end:])])


def _symbol(found: re.Match[str]) -> Markup:
    if found["vector"]:
        part = Markup("<sup>{}</sup>").format(found["part"]) if found["part"] else Markup("")
        return Markup("<i>{}</i><sub>{}</sub>{}").format(found["vector"], found["points"], part)
    if found["pivot"]:
        return Markup("O<sub>{}</sub>").format(found["pivot"])
    if found["rate"]:
        return Markup("<i>{}</i><sub>{}</sub>").format(_GREEK[found["rate"]], found["link"])
    return Markup("<i>{}</i><sub>{}</sub>").format(found["letter"], found["scale"])
