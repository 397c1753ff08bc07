"""Scales as students declare them: text with a unit, parsed, never guessed.

Understood are quantities (``0.006 m/mm``, ``0,036 (м/с)/мм``, ``0.036 m/s·mm`` for "per mm",
``25 N/mm``), ratios for lengths (``1:5``, ``5 cm/cm``), correspondences (``1 mm = 0.05 m/s``), the
assignment's kind of rule (``kv = omega kL``), and chains of them (``ka = ω2kL = 16,59 (m/s2)/mm``:
the last part that says a value counts). The result is real SI units per millimetre on paper.

A declared scale that cannot be understood is a value, `Refused`, with the reason and what could be
written instead.
"""

import math
import re
import unicodedata
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

from grader.records import Reason, Value, Written
from reference.authored.assignment import SCALE_NAMES, Assignment, Scales, Variant
from reference.mechanism import Crank
from reference.quantities import DRAWN

SURE = 0.9
"""Probability from which a text read in a printed box is taken for what was written."""
MAX_LENGTH = 120
LEAST_PER_MM, MOST_PER_MM = 1e-9, 1e9
"""No drawing has a scale beyond these, SI per millimetre."""
MAX_EXPONENT = 6
MAX_DEPTH = 6
PAPER_MM_PER_M = 1000.0

DIMENSIONS: Mapping[str, tuple[int, int, int]] = {
    name: (0, -kind.omegas, 0) if kind.omegas is not None else (-1, 0, 1) for name, kind in DRAWN.items()
}
"""Powers of the metre, the second and the newton: real over paper, so that the metres of motions cancel."""
EXAMPLES: Mapping[str, tuple[str, ...]] = {
    "kL": ("1:5", "5 cm/cm", "0.005 m/mm"),
    "kv": ("0.036 (m/s)/mm", "kv = omega kL"),
    "ka": ("0.108 (m/s^2)/mm", "ka = omega^2 kL"),
    "kF": ("25 N/mm", "1 mm = 25 N"),
}
UNITS: Mapping[str, tuple[float, int, int, int]] = {
    "m": (1.0, 1, 0, 0),
    "dm": (0.1, 1, 0, 0),
    "cm": (0.01, 1, 0, 0),
    "mm": (0.001, 1, 0, 0),
    "km": (1000.0, 1, 0, 0),
    "s": (1.0, 0, 1, 0),
    "sec": (1.0, 0, 1, 0),
    "min": (60.0, 0, 1, 0),
    "N": (1.0, 0, 0, 1),
    "daN": (10.0, 0, 0, 1),
    "kN": (1000.0, 0, 0, 1),
    "Nm": (1.0, 1, 0, 1),
    "kNm": (1000.0, 1, 0, 1),
}
"""SI factor, powers of the metre, the second and the newton."""
CYRILLIC: Mapping[str, str] = {
    "м": "m",
    "дм": "dm",
    "см": "cm",
    "мм": "mm",
    "км": "km",
    "с": "s",
    "сек": "sec",
    "мин": "min",
    "Н": "N",
    "даН": "daN",
    "кН": "kN",
    "Нм": "Nm",
    "кНм": "kNm",
}


@dataclass(frozen=True, slots=True)
class Declared:
    """A scale declared as a value: real SI units per millimetre on paper."""

    per_mm: float


@dataclass(frozen=True, slots=True)
class ByRule:
    """A scale declared as a product of powers of ``omega`` (of the crank) and other scales."""

    powers: Mapping[str, int]

    def per_mm(self, known: Mapping[str, float]) -> float:
        """The value, from omega (rad/s) and the other scales per millimetre."""
        value = 1.0
        for name, power in self.powers.items():
            value *= abs(known[name]) ** power
        return value


@dataclass(frozen=True, slots=True)
class Refused:
    """A declared scale that is not accepted, and why. False in a condition."""

    why: Reason

    def __bool__(self) -> bool:
        return False


ParsedScale = Declared | ByRule | Refused


class TextError(ValueError):
    """A text that does not say what it must: the code of a clause, and what it names."""

    def __init__(self, code: str, said: str = "", **known: Value) -> None:
        super().__init__(code)
        self.reason = Reason(code, {**({"said": said} if said else {}), **known})


def parse_scale(name: str, text: str | float, *, bare_unit: str | None = None) -> ParsedScale:
    """Return the meaning of a declared scale.

    Arguments
    ---------
    name : ``kL``, ``kv``, ``ka`` or ``kF``
    text : as declared; a number counts as a text without a unit
    bare_unit : the unit of a bare number where the assignment says one, such as ``(m/s)/mm``
    """
    cleaned = _clean(str(text))
    if not cleaned:
        return _refused(name, Reason("nothing_written"))
    if len(cleaned) > MAX_LENGTH:
        return _refused(name, Reason("too_many_characters", {"most": MAX_LENGTH}))
    parts = [part.strip(" ;") for part in cleaned.split("=")]
    if any(not part for part in parts):
        return _refused(name, Reason("beside_equals"))
    try:
        return _parse_chain(name, parts, bare_unit)
    except TextError as error:
        return _refused(name, error.reason)
    except OverflowError:
        return _refused(name, Reason("too_large_number"))


def _refused(name: str, why: Reason) -> Refused:
    return Refused(replace(why, parameters={**why.parameters, "scale": name, "examples": EXAMPLES[name]}))


def _parse_chain(name: str, parts: list[str], bare_unit: str | None) -> ParsedScale:
    last = parts[-1]
    if len(parts) == 1:
        last = _without_label(name, last)
    powers = _powers(last, name)
    if powers is not None:
        return ByRule(powers)
    if re.search(r"omega|ω", last):
        raise TextError("no_rule", last)
    if ":" in last:
        return Declared(_ratio(name, last))
    quantities = _quantities(last)
    if bare_unit is not None and quantities[0].is_bare:
        quantities = _quantities(f"{last} {_clean(bare_unit)}")
    fitting = {q.value for q in quantities if q.fits(name)}
    if len(fitting) == 1:
        return Declared(_positive(fitting.pop() / PAPER_MM_PER_M, last))
    if len(parts) > 1:
        paired = _correspondence(name, parts[-2], quantities)
        if paired is not None:
            return Declared(_positive(paired / PAPER_MM_PER_M, last))
    raise TextError("no_unit" if quantities[0].is_bare else _NO_SUCH[name], last)


def _positive(value: float, text: str) -> float:
    if not value > 0.0:
        raise TextError("not_positive", text)
    if not LEAST_PER_MM <= value <= MOST_PER_MM:
        raise TextError("undrawable", text)
    return value


_NO_SUCH = {name: f"no_{kind.name}" for name, kind in DRAWN.items()}
"""The clause of a quantity with the wrong unit."""

# Cleaning -----------------------------------------------------------------------------------------

_SUPERSCRIPTS = str.maketrans("⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺", "0123456789-+")
_SUPERSCRIPT_RUN = re.compile("[⁰¹²³⁴⁵⁶⁷⁸⁹⁻⁺]+")
_SIGNS = str.maketrans({
    "·": "*", "⋅": "*", "∙": "*", "•": "*", "×": "*", "∗": "*", "÷": "/", "∕": "/", "⁄": "/",
    "−": "-", "–": "-", "≈": "=", "≙": "=", "≃": "=", "∶": ":", "[": "(", "]": ")", "µ": "μ",
})  # fmt: skip
_WORD = re.compile(r"[а-яё]+", re.IGNORECASE)


def _clean(text: str) -> str:
    """One spelling: powers as ``^2``, products ``*``, decimal points, Latin units."""
    text = text.translate(_SIGNS)
    text = _SUPERSCRIPT_RUN.sub(lambda run: "^" + run[0].translate(_SUPERSCRIPTS), text)
    text = unicodedata.normalize("NFKC", text).translate(_SIGNS).replace("**", "^")
    text = re.sub(r"(?<=\d),(?=\d)", ".", text)
    text = _WORD.sub(lambda word: CYRILLIC.get(word[0], word[0]), text)
    return " ".join(text.split()).strip(" .;")


_NAMES: Mapping[str, str] = {
    "kL": r"(?:k|mu|μ)[_ ]?[lL]",
    "kv": r"(?:k|mu|μ)[_ ]?[vV]",
    "ka": r"(?:k|mu|μ)[_ ]?[aA]",
    "kF": r"(?:k|mu|μ)[_ ]?[fFpP]",
    "omega": r"(?:omega|ω|w)(?:_?1)?",
}
_RATIO_WORDS = r"(?:M|М|m|sc|scale|scara|scară|масштаб)"


def _without_label(name: str, text: str) -> str:
    """Without a leading ``kv`` (its equals sign forgotten) or ``M`` before a ratio."""
    text = re.sub(rf"^{_NAMES[name]}\s+(?=[\d.])", "", text)
    return re.sub(rf"^{_RATIO_WORDS}\.?\s*(?=[\d.]+\s*:)", "", text)


# Rules --------------------------------------------------------------------------------------------

_FACTOR = re.compile(
    rf"\s*(?P<op>[*/])?\s*(?:(?P<omega>{_NAMES['omega']})|(?P<kL>{_NAMES['kL']})|(?P<kv>{_NAMES['kv']}))"
    r"(?:\s*\^\s*(?P<power>[1-4])|(?P<bare_power>[2-4]))?(?![\d.])"
)


def _powers(text: str, name: str) -> dict[str, int] | None:
    """The powers of a rule such as ``omega^2 kL`` or ``kv^2/kL``; None where it is no rule for `name`.

    ``ω2`` can mean the square, or link 2: it is the square where only that has the right unit.
    """
    powers: dict[str, int] = {}
    place = 0
    while place < len(text):
        factor = _FACTOR.match(text, place)
        if factor is None or (factor["op"] and place == 0):
            return None
        sign = -1 if factor["op"] == "/" else 1
        key = next(key for key in ("omega", "kL", "kv") if factor[key])
        power = int(factor["power"] or factor["bare_power"] or 1)
        powers[key] = powers.get(key, 0) + sign * power
        place = factor.end()
    time = -powers.get("omega", 0) - powers.get("kv", 0)
    scales = powers.get("kL", 0) + powers.get("kv", 0)
    if name in powers or (0, time, 0) != DIMENSIONS[name] or scales != 1:
        return None
    return powers


# Quantities ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Quantity:
    """A value in SI with the powers of its units; `is_bare` when no unit stood in the text."""

    value: float
    powers: tuple[int, int, int] = (0, 0, 0)
    is_bare: bool = True

    def times(self, other: "_Quantity", sign: int) -> "_Quantity":
        if sign < 0 and other.value == 0.0:
            raise TextError("division_by_zero")
        return _Quantity(
            self.value * other.value**sign,
            _sum(self.powers, other.powers, sign),
            self.is_bare and other.is_bare,
        )

    def fits(self, name: str) -> bool:
        return not self.is_bare and self.powers == DIMENSIONS[name]


def _sum(one: tuple[int, int, int], other: tuple[int, int, int], times: int) -> tuple[int, int, int]:
    first, second, third = (a + times * b for a, b in zip(one, other, strict=True))
    return first, second, third


_TOKEN = re.compile(
    r"\s*(?:(?P<number>\d+\.?\d*(?:[eE][+-]?\d+)?|\.\d+)|(?P<unit>[^\W\d_]+)|(?P<sign>[*/()^+-]))"
)


def _is_number(word: str) -> bool:
    return word[:1].isdigit() or word[:1] == "."


def _tokens(text: str) -> Iterator[str]:
    place = 0
    text = text.rstrip()
    while place < len(text):
        token = _TOKEN.match(text, place)
        if token is None:
            raise TextError("not_understood", text, sign=text[place:].strip()[0])
        yield token[0].strip()
        place = token.end()


class _Reader:
    """Recursive descent over the tokens.

    `rest_is_divisor`: after a slash, everything is in the denominator, as people mean who write
    ``m/s·mm``.
    """

    def __init__(self, text: str, *, rest_is_divisor: bool) -> None:
        self.text, self.rest_is_divisor = text, rest_is_divisor
        self.tokens = [*_tokens(text), ""]
        self.place = 0

    def read(self) -> _Quantity:
        quantity = self.product(depth=0)
        if self.tokens[self.place]:
            raise TextError("not_understood", self.text, sign=self.tokens[self.place])
        return quantity

    def product(self, depth: int) -> _Quantity:
        quantity = self.power(depth)
        divided = False
        while (word := self.tokens[self.place]) not in {"", ")", "+", "-", "^"}:
            sign = -1 if divided and self.rest_is_divisor else 1
            if word in "*/":
                self.place += 1
                if word == "/":
                    sign, divided = -1, True
            elif _is_number(word) and _is_number(self.tokens[self.place - 1]):
                raise TextError("two_numbers", self.text)
            quantity = quantity.times(self.power(depth), sign)
        return quantity

    def power(self, depth: int) -> _Quantity:
        is_unit = self.tokens[self.place].isalpha()
        base = self.atom(depth)
        exponent = self.exponent(is_unit=is_unit)
        if exponent == 1:
            return base
        if base.value == 0.0:
            raise TextError("zero_power", self.text)
        return _Quantity(base.value**exponent, _sum((0, 0, 0), base.powers, exponent), base.is_bare)

    def atom(self, depth: int) -> _Quantity:
        word = self.tokens[self.place]
        self.place += 1
        if word == "(" and depth < MAX_DEPTH:
            inside = self.product(depth + 1)
            if self.tokens[self.place] != ")":
                raise TextError("open_bracket", self.text)
            self.place += 1
            return inside
        if _is_number(word):
            return _Quantity(float(word))
        if word in UNITS:
            factor, *powers = UNITS[word]
            return _Quantity(factor, (powers[0], powers[1], powers[2]), is_bare=False)
        if not word:
            raise TextError("unfinished", self.text)
        raise TextError("not_understood", self.text, sign=word)

    def exponent(self, *, is_unit: bool) -> int:
        """``^2``, ``^-1``, ``^(-1)``; after a unit also ``s2`` and ``s-1``."""
        raised = self.tokens[self.place] == "^"
        if raised:
            self.place += 1
        bracket = raised and self.tokens[self.place] == "("
        self.place += bracket
        sign = self.tokens[self.place] if self.tokens[self.place] in {"-", "+"} else ""
        digits = self.tokens[self.place + bool(sign)]
        small = digits.isdigit() and 1 <= int(digits) <= MAX_EXPONENT
        if not (small and (raised or is_unit)):
            if raised or sign:
                raise TextError("odd_power", self.text)
            return 1
        self.place += 1 + bool(sign)
        if bracket and self.tokens[self.place] != ")":
            raise TextError("open_bracket", self.text)
        self.place += bracket
        return -int(digits) if sign == "-" else int(digits)


def _quantities(text: str) -> list[_Quantity]:
    """Return the quantities in a text: read strictly, then with all after a slash as the denominator."""
    return [_Reader(text, rest_is_divisor=later).read() for later in (False, True)]


_ANGLES: Mapping[str, float] = {
    "rad": 1.0, "рад": 1.0, "°": math.pi / 180.0, "deg": math.pi / 180.0,
    "rev": math.tau, "rot": math.tau, "об": math.tau,
}  # fmt: skip
_WITH_UNIT = re.compile(
    rf"([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*({'|'.join(_ANGLES)})?((?:[^\d]|(?<=[\^\w-])\d)*)"
)
"""A number, then an angle's unit, then others, with numbers only as their powers."""


def number_with_unit(text: str, unit: str) -> float | None:
    """Return the number in a text, in `unit`, where that unit or another of its kind follows; else None."""
    (own,) = _with_unit(f"1 {unit}").items()
    value = _with_unit(text).get(own[0])
    return None if value is None else float(f"{value / own[1]:.12g}")


def _with_unit(text: str) -> dict[tuple[int, int, int], float]:
    """Return a number with a unit, SI and radians, by its powers: as each way to read it has them."""
    parts = _WITH_UNIT.fullmatch(re.sub(r"(?<=[\d ]) 1/", "/", _clean(text)))
    if parts is None:
        return {}
    number = float(parts[1]) * _ANGLES.get(parts[2], 1.0)
    try:
        found = _quantities(f"1 {parts[3]}")
    except (TextError, OverflowError):
        return {}
    if parts[2]:
        found = [one for one in found if not any(one.powers[::2])]  # "5 rev m/s" is no velocity
    return {one.powers: number * one.value for one in found if parts[2] or any(one.powers)}


def _ratio(name: str, text: str) -> float:
    """Paper to real, ``1:5`` or ``1 cm : 5 cm``, per millimetre."""
    sides = [side.strip() for side in text.split(":")]
    if len(sides) != 2 or not all(sides):
        raise TextError("not_two_numbers", text)
    paper, real = (_quantities(side)[0] for side in sides)
    if paper.is_bare and real.is_bare:
        if name != "kL":
            raise TextError("ratio_of_lengths", text)
        if paper.value <= 0.0:
            raise TextError("not_positive", text)
        return _positive(real.value / paper.value / PAPER_MM_PER_M, text)
    is_one = re.fullmatch(r"1(?:\.0*)?\s*[^\W\d]+", sides[0]) is not None
    per_m = _correspondence(name, sides[0], [real]) if is_one else None
    if per_m is None:
        # "0.3 m : 60 mm" may be meant as a division: never guessed.
        raise TextError("not_one_unit", text)
    return _positive(per_m / PAPER_MM_PER_M, text)


def _correspondence(name: str, paper_text: str, real: list[_Quantity]) -> float | None:
    """``10 mm = 0.05 m``: real over paper, or None where it is no such pair."""
    try:
        paper = _quantities(paper_text)[0]
    except TextError:
        return None
    if paper.powers != (1, 0, 0) or paper.value <= 0.0:
        return None
    values = {q.times(paper, -1).value for q in real if q.times(paper, -1).fits(name)}
    return values.pop() if len(values) == 1 else None


# Scales that count before anything is marked --------------------------------------------------------


def sure_texts(readings: Sequence[Mapping[str, Written]]) -> dict[str, str]:
    """Return the surely read texts in the boxes of some pages, by scale; nothing else is read yet."""
    texts: dict[str, str] = {}
    for name in SCALE_NAMES:
        boxes = [written[name] for written in readings if name in written]
        if boxes and all(box.confidence >= SURE for box in boxes):
            texts[name] = max(boxes, key=lambda box: box.confidence).text
    return texts


def parsed_scales(assignment: Assignment, texts: Mapping[str, str]) -> dict[str, ParsedScale]:
    """Return the meaning of declared scales; bare numbers have the units that the assignment says."""
    units: Mapping[str, str] = dict(assignment.file.scales.bare_units.items())
    return {name: parse_scale(name, text, bare_unit=units.get(name)) for name, text in texts.items()}


def declared_scales(assignment: Assignment, variant: Variant, texts: Mapping[str, str]) -> Scales:
    """The scales that texts declare, where they can be understood; the others by the assignment's rule."""
    return assignment.scales([variant], **understood_scales(assignment, variant, texts))


def understood_scales(assignment: Assignment, variant: Variant, texts: Mapping[str, str]) -> dict[str, float]:
    """The scales that texts declare, as far as they can be understood without the assignment's rule."""
    known: dict[str, float] = {}
    driver = assignment.mechanism([variant]).driver
    omega = {"omega": abs(float(driver.omega[0]))} if isinstance(driver, Crank) else {}
    for name, parsed in parsed_scales(assignment, texts).items():
        match parsed:
            case Declared(per_mm=value):
                known[name] = value
            case ByRule() as rule if rule.powers.keys() <= {**omega, **known}.keys():
                known[name] = rule.per_mm({**omega, **known})
    return known
