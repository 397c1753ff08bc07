"""How names and texts are set on the drawing: indices, widths, the box that a text fills.

Widths are those of DejaVu Sans Condensed, the font that the PDF embeds and the SVG asks for first.
"""

import re
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache

GREEK = {"omega": "ω", "epsilon": "ε"}
INDEX_SIZE = 0.7
"""Size of an index to that of its line."""
RISES = {-1: -0.26, 0: 0.0, 1: 0.44}
"""How far a piece is raised, in sizes of its line."""
ASCENT, DESCENT = 0.76, 0.24
KEPT = 4096
_DESCENDING = frozenset("gjpqyQ,;()[]_/ȘșȚțДЦЩдцщруфμβφ")

_WIDTHS_PER_MILLE = {
    200: "′", 240: "'ijlî", 260: "IJÎ", 280: " ,.·\N{NO-BREAK SPACE}", 300: "/:;\\|", 320: "-f", 340: "″",
    360: "!()[]rt²³ț", 420: '"', 440: "*_`°∥–", 460: "sș", 480: "?zεгз", 500: "Lcсэ", 520: "Fkт",
    540: "PTYvxyπȚГРТУвкухчья", 560: "EaeoăâЕабеоёЁ", 580: "$0123456789KSbdghnpqu{}√μβȘЗийлнпр",
    600: "φα", 620: "ABCRVXZĂÂАБВСХЧЬЭЯдц", 640: "Къ", 660: "U", 680: "HNИЙЛНПм", 700: "&DGOQДОЦ",
    720: "ы", 740: "wЪ", 760: "#+<=>^~−×ωфю≈", 780: "M⊥МФ", 800: "Ы", 820: "жш", 840: "щ", 860: "%",
    880: "Wm", 900: "@…", 960: "ЖШ", 980: "ЩЮ",
}  # fmt: skip
_WIDTH = {letter: width / 1000.0 for width, letters in _WIDTHS_PER_MILLE.items() for letter in letters}
_WIDTH_OF_OTHERS = 0.7


@dataclass(frozen=True, slots=True)
class Piece:
    """A stretch of text on one height: 0 on the line, -1 an index below, +1 above."""

    text: str
    height: int = 0

    def size(self, size: float) -> float:
        """Its own letter size."""
        return size if self.height == 0 else INDEX_SIZE * size

    def rise(self, size: float) -> float:
        """How far it is raised."""
        return RISES[self.height] * size


Text = str | tuple[Piece, ...]


def pieces_of(name: str) -> tuple[Piece, ...]:
    """A name as it is set: ``a_BA_n`` as a with BA below and n above, ``O1A`` with its 1 below."""
    stem, *indices = name.split("_")
    if indices and stem:
        indexed = (Piece(index, height) for index, height in zip(indices, (-1, 1), strict=False))
        return (Piece(GREEK.get(stem, stem)), *indexed)
    parts = re.split(r"(?<=[^\W\d_])(\d+)", name)
    return tuple(Piece(part, -1 if index % 2 else 0) for index, part in enumerate(parts) if part)


def scale_pieces(name: str) -> tuple[Piece, ...]:
    """A scale's name: the letter k (or μ) with L, v or a below it."""
    return (Piece(name[:1]), Piece(name[1:], -1)) if len(name) > 1 else (Piece(name),)


def as_pieces(text: Text) -> tuple[Piece, ...]:
    """A text as pieces: a plain one is a single piece on the line."""
    return (Piece(text),) if isinstance(text, str) else text


@dataclass(frozen=True, slots=True)
class Placed:
    """A piece in its place: from the text's start to the right, above the line."""

    text: str
    right: float
    above: float
    size: float


def set_pieces(text: Text, size: float) -> Iterator[Placed]:
    """The pieces in their places; an index above stands over the index below that it follows."""
    right, below_from, below_to = 0.0, 0.0, 0.0
    for piece in as_pieces(text):
        own = piece.size(size)
        wide = sum(_WIDTH.get(letter, _WIDTH_OF_OTHERS) for letter in piece.text) * own
        start = below_from if piece.height > 0 and below_to == right else right
        yield Placed(piece.text, start, piece.rise(size), own)
        if piece.height < 0:
            below_from, below_to = start, start + wide
        right = max(right, start + wide)


@lru_cache(maxsize=KEPT)
def width_of(text: Text, size: float) -> float:
    """How wide a text is set."""
    return max((piece.right + _width(piece) for piece in set_pieces(text, size)), default=0.0)


def _width(piece: Placed) -> float:
    return sum(_WIDTH.get(letter, _WIDTH_OF_OTHERS) for letter in piece.text) * piece.size


@lru_cache(maxsize=KEPT)
def rise_and_fall(text: Text, size: float) -> tuple[float, float]:
    """How far a text reaches above and below its line."""
    rise, fall = 0.0, 0.0
    for piece in set_pieces(text, size):
        rise = max(rise, piece.above + ASCENT * piece.size)
        if _DESCENDING.intersection(piece.text):
            fall = max(fall, DESCENT * piece.size - piece.above)
        fall = max(fall, -piece.above)
    return rise, fall


def wrapped(text: str, size: float, wide: float) -> Sequence[str]:
    """Lines that are no wider than `wide`, broken at spaces."""
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width_of(longer, size) <= wide:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines
