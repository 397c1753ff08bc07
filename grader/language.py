r"""Languages of the texts for students and instructors: English, Romanian, Russian.

English texts stand in the code and are the keys; `locale/<lang>/LC_MESSAGES/planmark.po` holds the
other languages. `docs/translating.md` says what to do after a text has changed.
"""

import gettext as gnu
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cache, lru_cache
from pathlib import Path

from markupsafe import Markup, escape

from reference.errors import CallError
from reference.quantities import GREEK, group_of, sort_of

LANGUAGES = ("en", "ro", "ru")
DOMAIN = "planmark"
ROOT_LANGUAGE = "en"


def N_(text: str) -> str:  # noqa: N802 - gettext's own name for it
    """Mark a text for the catalogues if it is only stored here and translated later."""
    return text


UNITS = (
    N_("mm"), N_("m"), N_("m/s"), N_("m/s²"), N_("rad/s"), N_("rad/s²"),
    N_("s"), N_("m/mm"), N_("(m/s)/mm"), N_("(m/s²)/mm"), N_("N"), N_("N m"), N_("N/mm"),
    N_("kg"), N_("kg m²"), N_("rev/min"), N_("cm"), N_("rad"), N_("°"),
)  # fmt: skip
"""Units as people read them; each has its letters in every language."""

SIDES = {"left": N_("on the left"), "right": N_("on the right"), "ahead": N_("ahead"), "behind": N_("behind")}
"""Side on which a joint lies, as a datum of a variant."""

NO_NAMES: Mapping[str, str] = {}
_LANGUAGE_NAMES = {"en": "English", "ro": "română", "ru": "русский"}


@dataclass(frozen=True, slots=True)
class Tongue:
    """A language in use: texts, plurals, numbers and units."""

    lang: str
    catalogue: gnu.NullTranslations

    def gettext(self, text: str) -> str:
        """Return the text in this language, or the text itself if the catalogue has none."""
        return self.catalogue.gettext(text) if text else ""

    def titled(self, titles: Mapping[str, str], figure: str, names: Mapping[str, str] = NO_NAMES) -> str:
        """Return the title of a figure, or what else is told of it: force plans share one with ``{group}``.

        Arguments: `names` are those that students know; a figure's is the key of a title of its own.
        """
        group = group_of(figure)
        title = titles.get(names.get(figure, ""), titles[sort_of(figure)])
        return self.gettext(title).replace("{group}", names.get(group, group))

    def ngettext(self, one: str, many: str, count: int) -> str:
        """Return the form that goes with `count`."""
        return self.catalogue.ngettext(one, many, count)

    def number(self, value: float, decimals: int) -> str:
        """Format a number with `decimals` decimals and the language's mark; no grouping, no minus zero."""
        # Adding zero turns minus zero into zero.
        text = f"{round(value, decimals) + 0.0:.{decimals}f}"
        return text.replace("-", "−").replace(".", self.decimal_mark)

    def trimmed(self, value: float, decimals: int) -> str:
        """Format a number with at most `decimals` decimals: 2, 2.5, 0.25."""
        text = self.number(value, decimals)
        return text.rstrip("0").rstrip(self.decimal_mark) if decimals else text

    @property
    def decimal_mark(self) -> str:
        """The language's decimal mark."""
        return "." if self.lang == ROOT_LANGUAGE else ","

    def significant(self, value: float, digits: int = 3) -> str:
        """Format a number with significant digits; large whole numbers keep all of theirs."""
        if value == 0.0 or not math.isfinite(value):
            return self.number(value, 0) if value == 0.0 else str(value)
        decimals = digits - 1 - math.floor(math.log10(abs(value)))
        return self.number(value, max(0, decimals))

    def quantity(self, value: float, decimals: int, unit: str) -> str:
        """Format a number and its unit, joined by a non-breaking space."""
        return f"{self.number(value, decimals)}\N{NO-BREAK SPACE}{self.unit(unit)}"

    def value(self, value: float, unit: str, digits: int = 4) -> str:
        """Format a number with significant digits, and its unit if it has one."""
        return f"{self.significant(value, digits)}\N{NO-BREAK SPACE}{self.unit(unit)}".rstrip()

    def unit(self, unit: str) -> str:
        """Return a unit in this language's letters; `m/s^2` and `m/s2` are written with a superscript."""
        return self.gettext(unit.replace("s^2", "s²").replace("s2", "s²"))

    @property
    def name(self) -> str:
        """The language's name in that language."""
        return _LANGUAGE_NAMES[self.lang]


@cache
def tongue(lang: str) -> Tongue:
    """Return the language for a code such as `ro` or `ro-RO`; raises CallError for others than en, ro, ru."""
    code = lang.replace("_", "-").partition("-")[0].lower()
    if code not in LANGUAGES:
        known = ", ".join(LANGUAGES)
        message = f"'{lang}' is no language of planmark; choose one of {known}"
        raise CallError("unknown_language", message, text=lang, names=known)
    return Tongue(code, _catalogue(code))


def _catalogue(code: str) -> gnu.NullTranslations:
    if code == ROOT_LANGUAGE:
        return gnu.NullTranslations()
    compiled = Path(__file__).parent / "locale" / code / "LC_MESSAGES" / f"{DOMAIN}.mo"
    with compiled.open("rb") as stream:
        return gnu.GNUTranslations(stream)


_NAME = re.compile(
    r"\b(?:([vank])_([A-Z][A-Za-z0-9]{0,7})(?:_([ntcr])\b)?|(omega|epsilon|phi)_([0-9A-Za-z]{1,4})(?![0-9A-Za-z])|([kμ])([LlvaF])(?=\b|²)"
    r"|([FGRM])_([0-9A-Za-z]{1,9}(?:-[0-9A-Za-z]{1,8})?)(?:_([nt]))?\b"
    r"|(O)([0-9])(?=[A-Z]?\b)|(a)_([ntcr])\b|([ωεφ])([0-9]|[b-km-quw-z](?![A-Za-z])))"
)
"""A name in running text: its letter, its index below, and perhaps one above; ωr and ωv are products."""


@lru_cache(4096)
def symbols(text: str) -> Markup:
    """Return text with names of vectors, rates and scales set with their indices; everything else escaped."""
    return Markup(_NAME.sub(_symbol, str(escape(text))))  # noqa: S704 - escaped


def _symbol(match: re.Match[str]) -> str:
    letter, below, *above = filter(None, match.groups())
    shown = letter if letter == "O" else f"<i>{GREEK.get(letter, letter)}</i>"
    return f"{shown}<sub>{below}</sub>" + "".join(f"<sup>{part}</sup>" for part in above)
