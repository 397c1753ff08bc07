"""Read handwriting on plain paper: scales, the student's number, a name of the roster.

Each line of writing is searched for the words that may stand there. A word's evidence is the logarithm of its
likelihood against that of any signs in any order, so that it is 0 at most; the text behind a label is then
read like that in a printed box.
"""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace

import numpy as np

from grader.records import InkMap, Written
from grader.scan.handwriting.fields import meaning_of, placed, read_scale
from grader.scan.handwriting.lines import Line, Look, find_lines
from grader.scan.handwriting.model import COLUMN, JUNK, Lattice
from grader.tables.scale_text import parse_scale

_STRANGE = 3e-4
"""Probability, for each sign, that it is written in a way unknown to the recogniser."""
_SKIPPED, _SIGN_SKIPPED = -3.0, -14.0
"""Log likelihood of ink within a word not of its letters: dust or a diacritic, and as high as a letter."""
_LOW = 0.35
"""Share of a line's height: lower pieces may be dust or diacritics."""
_UNKNOWN = -1.5
"""Log likelihood of a letter without a sign in the recogniser, against the likeliest sign."""
_LOST, _EACH_LOST = -12.0, -0.5
"""A word this much less likely than signs at will is not followed; the second is for each letter of it."""
_TELLING, _ALIKE = 3.0, 1.5
"""Nats by which a word's letter differs from signs at will: with a form of its own, and with another's."""
_PLACES, _FIRSTS = 5.0, 3.0
"""Logarithms of the number of words on a page, and of those that begin a line."""
_DOUBTFUL = -2.0
"""Log odds of a word from which it is examined."""
_LOOKS: Mapping[str, str] = {
    "и": "uH", "й": "uH", "н": "H", "т": "Tm", "к": "k", "в": "B", "г": "r", "л": "nπ", "п": "πn",
    "м": "Mm", "μ": "μum", "К": "k", "l": "1", "I": "1", "i": "1", "=": "=-", "W": "ω", "w": "ω", "5": "5s",
    "Y": "y", "L": "L1", "У": "y", "Г": "r", "П": "πn", "И": "uH", "Н": "H",
}  # fmt: skip
"""Signs of the recogniser that a letter of another form may resemble."""


_Places = dict[int, tuple[float, int]]
"""Log likelihood, and first piece, of the word that ends before a piece."""
_NOWHERE = (-np.inf, -1)


def spotters(where: InkMap, look: Look | None = None) -> list["Spotter"]:
    """Return the lines of writing on a page, ready to be searched; arguments as of `find_lines`."""
    return [Spotter(line) for line in find_lines(where, look)]


def surer(one: Written | None, other: Written | None) -> Written | None:
    """Return the surer of two readings of one thing."""
    return max((read for read in (one, other) if read), key=lambda read: read.confidence, default=None)


class Spotter:
    """A line of writing in which words are searched.

    Attributes
    ----------
    log : (segments, signs) log likelihood of each segment as each sign
    after : the segments that begin with each piece, by their row and the piece behind them
    free : log likelihood of any signs in any order up to before each piece
    skipped : the cost of each piece that is no letter of a word
    """

    def __init__(self, line: Line) -> None:
        known = placed(line.signs)
        self.line = line
        self.log = np.logaddexp(np.array([log for _, log in known]), np.log(_STRANGE))
        at_will = self.log.max(axis=1)
        self.best = self.log[:, : COLUMN[JUNK]].max(axis=1)
        self.after: list[list[tuple[int, int]]] = [[] for _ in range(line.signs.count)]
        for row, (segment, _) in enumerate(known):
            self.after[segment.first].append((row, segment.last))
        alone = {s.first: s.box[3] for s in line.signs.segments if s.last == s.first + 1}
        low = _LOW * float(np.quantile(list(alone.values()), 0.75))
        self.skipped = [_SKIPPED if alone[place] < low else _SIGN_SKIPPED for place in sorted(alone)]
        free = [0.0, *(-np.inf for _ in self.after)]
        for place, rows in enumerate(self.after):
            for row, last in rows:
                free[last] = max(free[last], free[place] + float(at_will[row]))
        self.free = free
        self._letters: dict[str, list[float]] = {}
        self._spotted: dict[tuple[int | None, str], _Places] = {}

    def spot(self, word: str, begin: int | None = None) -> "_Places":
        """Return possible ends of the word: by the piece behind it, its log likelihood and its first piece.

        Arguments: the word begins before the piece `begin`, by default wherever a word may begin.
        """
        key = begin, word
        if key not in self._spotted:
            if word:
                before = self.spot(word[:-1], begin)
                self._spotted[key] = self._followed(before, word) if before else {}
            else:
                begins = np.flatnonzero(self.line.begins).tolist() if begin is None else [begin]
                self._spotted[key] = {place: (self.free[place], place) for place in begins}
        return self._spotted[key]

    def _worth(self, letter: str) -> list[float]:
        """Return the log likelihood of each segment as this letter."""
        if letter not in self._letters:
            columns = [COLUMN[sign] for sign in _LOOKS.get(letter, letter) if sign in COLUMN]
            worth = self.log[:, columns].max(axis=1) if columns else self.best + _UNKNOWN
            self._letters[letter] = worth.tolist()
        return self._letters[letter]

    def _followed(self, before: "_Places", word: str) -> "_Places":
        """Extend the possible ends of a word without its last letter by that letter; dust may follow it."""
        worth, least = self._worth(word[-1]), _LOST + _EACH_LOST * len(word)
        behind: _Places = {}
        for place, (log, origin) in before.items():
            for row, last in self.after[place] if place < len(self.after) else ():
                through = log + worth[row]
                if through > self.free[last] + least and through > behind.get(last, _NOWHERE)[0]:
                    behind[last] = through, origin
        for place in sorted(behind):
            log, origin = behind[place]
            if place < len(self.after):
                through = log + self.free[place + 1] - self.free[place] + self.skipped[place]
                if through > behind.get(place + 1, _NOWHERE)[0]:
                    behind[place + 1] = through, origin
        return behind

    def label(self, word: str) -> Iterable[tuple[int, float]]:
        """Yield the pieces before which the word may end, and the log odds of each."""
        telling = sum(_TELLING if letter in COLUMN else _ALIKE * (letter in _LOOKS) for letter in word)
        reached = -np.inf
        for place, (log, origin) in sorted(self.spot(word).items(), reverse=True):
            chances = _FIRSTS if self.line.firsts[origin] else _PLACES
            odds = log - self.free[place] + telling - chances
            if odds > max(_DOUBTFUL, reached):
                yield place, odds
            reached = max(reached, odds)

    def part(self, begin: int, end: int) -> Lattice:
        """Return the signs from one piece up to, not including, another."""
        inside = [s for s in self.line.signs.segments if s.first >= begin and s.last <= end]
        shifted = (replace(s, first=s.first - begin, last=s.last - begin) for s in inside)
        return Lattice(end - begin, tuple(shifted))

    def ends(self, begin: int) -> list[int]:
        """Return possible ends of a text that begins before this piece: before wide gaps, and the end."""
        return [place for place in range(begin + 1, len(self.free)) if self.line.parts[place]]


# Scales -------------------------------------------------------------------------------------------

_SYMBOLS = ("k", "μ")
"""Letters that denote scales."""
_RATIO_WORDS = ("M", "Scara", "scara", "Scale", "scale", "Масштаб", "масштаб")
"""Words before a ratio such as 1:5."""
_LEAST = 0.01
"""Less probable texts are left out."""
_MOST_SURE = 0.98
"""Highest confidence of a caption: only the drawing shows whose scale it is."""


def captioned_scales(
    lines: Sequence[Spotter], names: Iterable[str], units: Mapping[str, str] | None = None
) -> dict[str, Written]:
    """Return the requested scales `kL`, `kv`, `ka` that stand on a page with their label.

    Arguments: `units` are the units of bare numbers if the assignment gives them, by scale.
    """
    scales = {}
    for name in names:
        read = [one for spotter in lines for one in _scales_in(spotter, name, (units or {}).get(name))]
        read = [one for one in read if one.confidence > _LEAST]
        if read:
            scales[name] = _together(name, read)
    return scales


def _scales_in(spotter: Spotter, name: str, unit: str | None) -> Iterable[Written]:
    """Yield the texts behind each label of a scale in a line."""
    symbol = "L" if name == "kL" else name[1]
    for letter in _SYMBOLS:
        for behind, odds in spotter.label(f"{letter}{symbol}="):
            if odds > 0.0:
                yield from _read_behind(spotter, name, (behind, odds), unit)
    if name == "kL":
        for word in _RATIO_WORDS:
            for behind, odds in spotter.label(word):
                yield from (
                    one for one in _read_behind(spotter, name, (behind, odds), unit) if ":" in one.text
                )


def _read_behind(
    spotter: Spotter, name: str, label: tuple[int, float], unit: str | None
) -> Iterable[Written]:
    """Yield the likeliest texts behind a label, up to where the text may end.

    Arguments: `label` is the piece behind it and the logarithm of its odds.
    """
    begin, odds = label
    read = [read_scale(spotter.part(begin, end), name, unit) for end in spotter.ends(begin)[-_ENDS:]]
    if read:
        best = max(read, key=lambda one: one.confidence)
        share = _MOST_SURE * _chance(odds)
        others = tuple((text, share * sure) for text, sure in best.others)
        yield Written(best.text, share * best.confidence, others)


_ENDS = 2
"""Number of possible ends of a text that are tried, from the line's own backwards."""


def _chance(odds: float) -> float:
    """Return the probability with these log odds."""
    return float(1.0 / (1.0 + np.exp(-odds)))


def _together(name: str, read: Sequence[Written]) -> Written:
    """Combine readings of one scale in several places: equal meanings support it, others contradict it."""
    chances: dict[object, tuple[Written, float, float]] = {}
    for one in read:
        meaning = meaning_of(parse_scale(name, one.text))
        before, wrong, sure = chances.get(meaning, (one, 1.0, 0.0))
        best = one if one.confidence > sure else before
        chances[meaning] = best, wrong * (1.0 - one.confidence), max(sure, one.confidence)
    weights = {
        meaning: (1.0 - wrong)
        * float(np.prod([w for other, (_, w, _) in chances.items() if other != meaning]))
        for meaning, (_, wrong, _) in chances.items()
    }
    none = float(np.prod([wrong for _, wrong, _ in chances.values()]))
    total = sum(weights.values()) + none
    ranked = sorted(chances, key=lambda meaning: -weights[meaning])
    best = chances[ranked[0]][0]
    others = [(chances[meaning][0].text, weights[meaning] / total) for meaning in ranked[1:4]]
    return Written(best.text, min(_MOST_SURE, weights[ranked[0]] / total), tuple(others) or best.others)


# The student's number -----------------------------------------------------------------------------

NUMBER_WORDS = (
    "n=", "N=", "nr", "Nr", "NR", "No", "no", "вариант", "Вариант", "вар", "Вар", "variant", "Variant",
    "varianta", "Varianta", "var", "Var", "Number", "number",
)  # fmt: skip
"""Words before the number of a variant, without their point or colon."""
POSITION_WORDS = (
    "position", "Position", "pos", "Pos", "pozitia", "Pozitia", "poz", "Poz", "положение", "Положение",
)  # fmt: skip
_BETWEEN = ("", ".", ":", "=", ".:")
_ANYTHING = -5.5
"""Log likelihood that the text behind the word is none of the numbers."""


def written_number(
    lines: Sequence[Spotter], numbers: Collection[int], words: Sequence[str]
) -> Written | None:
    """Return the number written behind one of the words, of those possible; None if there is none.

    Any other text there lowers its confidence.
    """
    found: dict[int, float] = {}
    for spotter in lines:
        for number, chance in _numbers_in(spotter, numbers, words).items():
            found[number] = 1.0 - (1.0 - found.get(number, 0.0)) * (1.0 - chance)
    if not found:
        return None
    odds = {number: chance / max(1.0 - chance, 1e-3) for number, chance in found.items()}
    total = 1.0 + sum(odds.values())
    ranked = sorted(((str(n), odd / total) for n, odd in odds.items()), key=lambda one: -one[1])
    return Written(ranked[0][0], min(_MOST_SURE, ranked[0][1]), tuple(ranked[1:4]))


def _numbers_in(spotter: Spotter, numbers: Collection[int], words: Sequence[str]) -> dict[int, float]:
    """Return the probability of each number by a line alone."""
    behind: dict[int, float] = {}
    for word in words:
        for place, odds in spotter.label(word):
            behind[place] = max(behind.get(place, -np.inf), odds)
    best: dict[int, float] = {}
    for begin, odds in behind.items():
        ends = spotter.ends(begin)[:1]
        logs = {}
        for number in numbers if ends else ():
            written = (spotter.spot(f"{between}{number}", begin) for between in _BETWEEN)
            found = [places[ends[0]][0] - spotter.free[ends[0]] for places in written if ends[0] in places]
            logs[number] = max(found, default=-np.inf)
        total = np.logaddexp.reduce([*logs.values(), _ANYTHING])
        for number, log in logs.items():
            chance = _chance(odds) * float(np.exp(log - total))
            if chance > _LEAST:
                best[number] = max(best.get(number, 0.0), chance)
    return best


# Names --------------------------------------------------------------------------------------------


def written_name(lines: Sequence[Spotter], names: Mapping[str, Collection[str]]) -> tuple[str | None, float]:
    """Return the person whose name stands on a page, and its probability; None if it is none of these.

    Arguments: `names` are the ways in which each person may write the name, by person.
    """
    odds: dict[str, float] = {}
    for person, spellings in names.items():
        for spelling in spellings:
            for spotter in lines:
                for place, chance in spotter.label(spelling):
                    if spotter.line.begins[place]:
                        odds[person] = max(odds.get(person, -np.inf), chance)
    if not odds:
        return None, 0.0
    person = max(odds, key=lambda one: odds[one])
    total = np.logaddexp.reduce([0.0, *odds.values()])
    return person, float(np.exp(odds[person] - total))
