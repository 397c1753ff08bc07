"""Writing: letters as strokes, with subscripts, superscripts and a hand's unevenness.

Markup: ``_x`` or ``_{xy}`` lowers, ``^x`` or ``^{xy}`` raises; everything else is written as it is.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from samples.simulation.glyphs import GLYPHS, TWINS
from samples.simulation.strokes import ComplexArray, InkStroke, PenWidth, Rng, inked, smooth

BAR = "\u0304"
"""A bar over the letter before it, as over a vector's name."""
_SMALL = 0.66
_DROP, _RISE = -0.32, 0.52
_SPACE = 0.42
"""Widths and heights in capital heights."""


@dataclass(frozen=True, slots=True)
class Handwriting:
    """One person's handwriting.

    Attributes
    ----------
    slant : run per rise of upright strokes
    aspect : width to height, 1 as the alphabet
    jitter : standard deviation of a letter's corners, in capital heights
    unevenness : variation of size and base line from letter to letter
    gap : space between letters, in capital heights
    forms : which form of each letter this person uses, by letter
    """

    slant: float = 0.2
    aspect: float = 0.9
    jitter: float = 0.025
    unevenness: float = 0.05
    gap: float = 0.17
    forms: tuple[tuple[str, int], ...] = ()


def any_handwriting(rng: Rng) -> Handwriting:
    """A random person's handwriting."""
    forms = tuple((letter, int(rng.integers(len(ways)))) for letter, ways in GLYPHS.items() if len(ways) > 1)
    return Handwriting(
        slant=float(rng.choice([0.0, 0.05, 0.15, 0.27, 0.35])),
        aspect=float(rng.uniform(0.65, 1.05)),
        jitter=float(rng.uniform(0.01, 0.045)),
        unevenness=float(rng.uniform(0.02, 0.1)),
        gap=float(rng.uniform(0.1, 0.24)),
        forms=forms,
    )


@dataclass(frozen=True, slots=True)
class WrittenSign:
    """One sign of a text, as in the alphabet, and its box."""

    sign: str
    low: complex
    high: complex


@dataclass(frozen=True, slots=True)
class WrittenText:
    """Strokes of a text, its box and its signs: (left, bottom), (right, top), complex sheet millimetres."""

    strokes: tuple[InkStroke, ...]
    low: complex
    high: complex
    signs: tuple[WrittenSign, ...] = ()

    def moved(self, by: complex) -> "WrittenText":
        """The same text shifted."""
        strokes = tuple(InkStroke(s.points + by, s.width, s.dark, s.layer) for s in self.strokes)
        signs = tuple(WrittenSign(s.sign, s.low + by, s.high + by) for s in self.signs)
        return WrittenText(strokes, self.low + by, self.high + by, signs)


@dataclass(frozen=True, slots=True)
class _Letter:
    sign: str
    size: float
    lift: float


def _letters(text: str) -> Iterator[_Letter]:
    at = 0
    while at < len(text):
        if text[at] in "_^" and at + 1 < len(text):
            lift = _DROP if text[at] == "_" else _RISE
            if text[at + 1] == "{":
                end = text.index("}", at)
                small, at = text[at + 2 : end], end + 1
            else:
                small, at = text[at + 1], at + 2
            yield from (_Letter(sign, _SMALL, lift) for sign in small)
        else:
            yield _Letter(text[at], 1.0, 0.0)
            at += 1


def _strokes_of(sign: str, forms: dict[str, int]) -> list[tuple[bool, ComplexArray]]:
    ways = GLYPHS.get(sign) or GLYPHS.get(TWINS.get(sign, "?")) or GLYPHS["?"]
    form = ways[forms.get(sign, 0) % len(ways)]
    strokes: list[tuple[bool, ComplexArray]] = []
    for text in form.split("|"):
        pairs = [pair.split(",") for pair in text.lstrip("~").split()]
        corners = np.array([complex(float(x), float(y)) for x, y in pairs], dtype=np.complex128) / 100.0
        strokes.append((text.startswith("~"), np.asarray(corners, dtype=np.complex128)))
    return strokes


def write(rng: Rng, pen: PenWidth, text: str, height_mm: float, style: Handwriting) -> WrittenText:
    """Write a text whose base line starts at 0."""
    forms = dict(style.forms)
    at, strokes, signs = 0.0, list[InkStroke](), list[WrittenSign]()
    for letter in _letters(text):
        if letter.sign == " ":
            at += _SPACE * letter.size
            continue
        if letter.sign == BAR:
            at -= 0.55 * style.aspect + style.gap
        size = letter.size * (1.0 + style.unevenness * rng.standard_normal())
        lift = letter.lift + 0.4 * style.unevenness * rng.standard_normal()
        right, before = at, len(strokes)
        for curved, corners in _strokes_of(letter.sign, forms):
            shape = corners + style.jitter * (
                rng.standard_normal(len(corners)) + 1j * rng.standard_normal(len(corners))
            )
            points = smooth(shape, 4) if curved else shape
            x = at + points.real * size * style.aspect
            y = points.imag * size + lift
            place = (x + style.slant * y + 1j * y) * height_mm
            strokes.append(inked(rng, pen, np.asarray(place)))
            right = max(right, float(x.max()))
        at = right + style.gap * letter.size
        if strokes[before:]:
            signs.append(WrittenSign(letter.sign, *_box_of(strokes[before:])))
    if not strokes:
        return WrittenText((), 0j, 0j)
    return WrittenText(tuple(strokes), *_box_of(strokes), tuple(signs))


def _box_of(strokes: Sequence[InkStroke]) -> tuple[complex, complex]:
    points = np.concatenate([stroke.points for stroke in strokes])
    low = complex(points.real.min(), points.imag.min())
    return low, complex(points.real.max(), points.imag.max())
