"""Shapes and texts on paper in millimetres (x right, y down), and their SVG, true to size.

Text widths are those of DejaVu Sans Condensed, the font that the PDF embeds and the SVG asks for first.
"""

import re
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from html import escape

from reference.quantities import GREEK

INDEX_SIZE = 0.7
"""Size of an index relative to that of its line."""
RISES = {-1: -0.26, 0: 0.0, 1: 0.44}
"""Rise of a piece, in sizes of its line."""
ASCENT, DESCENT = 0.76, 0.24
CACHE_SIZE = 4096
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
    """A stretch of text at one height: 0 on the line, -1 an index below, +1 above."""

    text: str
    height: int = 0

    def size(self, size: float) -> float:
        """Its own letter size."""
        return size if self.height == 0 else INDEX_SIZE * size

    def rise(self, size: float) -> float:
        """Rise of the piece above its line, for a size of the line."""
        return RISES[self.height] * size


Text = str | tuple[Piece, ...]


def pieces_of(name: str) -> tuple[Piece, ...]:
    """Typeset a name: ``a_BA_n`` as a with BA below and n above, ``O1A`` with its 1 below."""
    stem, *indices = name.split("_")
    if indices and stem:
        indexed = (Piece(index, height) for index, height in zip(indices, (-1, 1), strict=False))
        return (Piece(GREEK.get(stem, stem)), *indexed)
    parts = re.split(r"((?<=^[ωεφ])\w+$|(?<=[^\W\d_])\d+)", name)
    return tuple(Piece(part, -1 if index % 2 else 0) for index, part in enumerate(parts) if part)


def scale_pieces(name: str) -> tuple[Piece, ...]:
    """Typeset a scale's name: the letter k (or μ) with L, v or a below it."""
    return (Piece(name[:1]), Piece(name[1:], -1)) if len(name) > 1 else (Piece(name),)


@dataclass(frozen=True, slots=True)
class Placed:
    """A piece at its position: to the right of the text's start, above the line."""

    text: str
    right: float
    above: float
    size: float


def set_pieces(text: Text, size: float) -> Iterator[Placed]:
    """Position the pieces; an index above stands over the index below that it follows."""
    right, below_from, below_to = 0.0, 0.0, 0.0
    for piece in (Piece(text),) if isinstance(text, str) else text:
        own = piece.size(size)
        wide = _width(piece.text, own)
        start = below_from if piece.height > 0 and below_to == right else right
        yield Placed(piece.text, start, piece.rise(size), own)
        if piece.height < 0:
            below_from, below_to = start, start + wide
        right = max(right, start + wide)


@lru_cache(maxsize=CACHE_SIZE)
def width_of(text: Text, size: float) -> float:
    """Return the width of a text as set."""
    return max(
        (piece.right + _width(piece.text, piece.size) for piece in set_pieces(text, size)), default=0.0
    )


def _width(text: str, size: float) -> float:
    return sum(_WIDTH.get(letter, _WIDTH_OF_OTHERS) for letter in text) * size


@lru_cache(maxsize=CACHE_SIZE)
def rise_and_fall(text: Text, size: float) -> tuple[float, float]:
    """Return how far a text extends above and below its line."""
    rise, fall = 0.0, 0.0
    for piece in set_pieces(text, size):
        rise = max(rise, piece.above + ASCENT * piece.size)
        if _DESCENDING.intersection(piece.text):
            fall = max(fall, DESCENT * piece.size - piece.above)
        fall = max(fall, -piece.above)
    return rise, fall


def wrapped(text: str, size: float, wide: float) -> Sequence[str]:
    """Break a text at spaces into lines no wider than `wide`."""
    lines: list[str] = []
    for word in text.split(" "):
        longer = f"{lines[-1]} {word}" if lines else word
        if lines and width_of(longer, size) <= wide:
            lines[-1] = longer
        else:
            lines.append(word)
    return lines


# Shapes --------------------------------------------------------------------------------------------


A3_MM = (420.0, 297.0)
MM_PER_INCH = 25.4

INK = "#1b1f24"
CONSTRUCTION = "#7d8791"
PAPER = "#ffffff"
SLANT = 0.21
"""Slant of letters to the right, as a share of their height (12 degrees)."""
FONTS = "'DejaVu Sans Condensed', 'DejaVu Sans', Arial, sans-serif"
Point = tuple[float, float]
Bounds = tuple[float, float, float, float]
"""Left, top, right, bottom."""


@dataclass(frozen=True, slots=True)
class Stroke:
    """A straight line."""

    start: Point
    end: Point
    width: float = 0.35
    colour: str = INK
    dash: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Ring:
    """A circle, filled with paper white or with a colour."""

    centre: Point
    radius: float
    width: float = 0.35
    colour: str = INK
    fill: str = PAPER


@dataclass(frozen=True, slots=True)
class Area:
    """A filled polygon."""

    points: tuple[Point, ...]
    fill: str
    width: float = 0.0
    colour: str = INK


@dataclass(frozen=True, slots=True)
class Curve:
    """A line through many points, as an arc is drawn."""

    points: tuple[Point, ...]
    width: float = 0.35
    colour: str = INK
    dash: tuple[float, ...] = ()


@dataclass(frozen=True, slots=True)
class Label:
    """A text whose line starts at, ends at, or is centred on a point; `size` is the height of its line."""

    at: Point
    text: Text
    size: float = 4.0
    anchor: str = "start"
    colour: str = INK
    italic: bool = False

    @property
    def left(self) -> float:
        """The x coordinate where the line starts."""
        share = {"start": 0.0, "middle": 0.5, "end": 1.0}[self.anchor]
        return self.at[0] - share * width_of(self.text, self.size)

    @property
    def bounds(self) -> Bounds:
        """The box that its letters fill."""
        rise, fall = rise_and_fall(self.text, self.size)
        right = self.left + width_of(self.text, self.size) + (SLANT * rise if self.italic else 0.0)
        return (self.left, self.at[1] - rise, right, self.at[1] + fall)


Shape = Stroke | Ring | Area | Curve | Label


def shifted(shape: Shape, by: Point) -> Shape:
    """Return the shape shifted on the sheet."""

    def shift(point: Point) -> Point:
        return (point[0] + by[0], point[1] + by[1])

    match shape:
        case Stroke():
            return replace(shape, start=shift(shape.start), end=shift(shape.end))
        case Ring():
            return replace(shape, centre=shift(shape.centre))
        case Area() | Curve():
            return replace(shape, points=tuple(shift(point) for point in shape.points))
        case _:
            return replace(shape, at=shift(shape.at))


def bounds(shapes: Iterable[Shape]) -> Bounds:
    """Return the box that shapes fill; raises ValueError for none."""
    lefts, tops, rights, bottoms = zip(*map(_bounds_of, shapes), strict=True)
    return (min(lefts), min(tops), max(rights), max(bottoms))


def _bounds_of(shape: Shape) -> Bounds:
    match shape:
        case Label():
            return shape.bounds
        case Ring(centre=(x, y), radius=reach):
            return (x - reach, y - reach, x + reach, y + reach)
        case Stroke():
            points: Sequence[Point] = (shape.start, shape.end)
        case _:
            points = shape.points
    xs, ys = zip(*points, strict=True)
    return (min(xs), min(ys), max(xs), max(ys))


# SVG -----------------------------------------------------------------------------------------------


def svg(sheets: Sequence[Sequence[Shape]], page_mm: tuple[float, float] = A3_MM) -> str:
    """Return the sheets, one under another, as one SVG; one user unit is one millimetre."""
    width, height = page_mm
    total = height * len(sheets)
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', _svg_tag((0.0, 0.0, width, total))]
    lines.append(f'<rect width="{width:g}" height="{total:g}" fill="{PAPER}"/>')
    for row, shapes in enumerate(sheets):
        lines.append(f'<g transform="translate(0 {row * height:g})">')
        lines.extend(elements(shapes))
        lines.append("</g>")
    return "\n".join([*lines, "</svg>"]) + "\n"


def picture_svg(shapes: Sequence[Shape], box: Bounds) -> str:
    """Return shapes as an SVG element of a page, true to size, clipped to a box."""
    return "\n".join([_svg_tag(box), *elements(shapes), "</svg>"])


def _svg_tag(box: Bounds) -> str:
    left, top, width, height = box[0], box[1], box[2] - box[0], box[3] - box[1]
    size = f'width="{width:g}mm" height="{height:g}mm" viewBox="{left:g} {top:g} {width:g} {height:g}"'
    return f'<svg xmlns="http://www.w3.org/2000/svg" {size} font-family="{FONTS}">'


def elements(shapes: Iterable[Shape]) -> Iterator[str]:
    """Yield each shape as an element of an SVG."""
    return (_element(shape) for shape in shapes)


def _element(shape: Shape) -> str:
    match shape:
        case Stroke(start=(x1, y1), end=(x2, y2), width=width, colour=colour, dash=dash):
            return (
                f'<line x1="{x1:.3f}" y1="{y1:.3f}" x2="{x2:.3f}" y2="{y2:.3f}" stroke="{colour}"'
                f' stroke-width="{width:g}" stroke-linecap="round"{_dashes(dash)}/>'
            )
        case Ring(centre=(x, y), radius=radius, width=width, colour=colour, fill=fill):
            return (
                f'<circle cx="{x:.3f}" cy="{y:.3f}" r="{radius:g}" fill="{fill}" stroke="{colour}"'
                f' stroke-width="{width:g}"/>'
            )
        case Area(points=points, fill=fill, width=width, colour=colour):
            edge = f' stroke="{colour}" stroke-width="{width:g}"' if width else ""
            return f'<polygon points="{_corners(points)}" fill="{fill}"{edge}/>'
        case Curve(points=points, width=width, colour=colour, dash=dash):
            return (
                f'<polyline points="{_corners(points)}" fill="none" stroke="{colour}"'
                f' stroke-width="{width:g}" stroke-linecap="round"{_dashes(dash)}/>'
            )
        case _:
            return _text(shape)


def _dashes(dash: tuple[float, ...]) -> str:
    return f' stroke-dasharray="{" ".join(f"{d:g}" for d in dash)}"' if dash else ""


def _corners(points: Sequence[Point]) -> str:
    return " ".join(f"{x:.3f},{y:.3f}" for x, y in points)


def _text(label: Label) -> str:
    """Return a text with its indices as spans, each positioned, so that every viewer stacks them alike."""
    style = ' font-style="italic"' if label.italic else ""
    placed = list(set_pieces(label.text, label.size))
    x, y = label.left, label.at[1]
    attributes = f'font-size="{label.size:g}" fill="{label.colour}"{style}'
    if len(placed) == 1:
        anchor = f'x="{label.at[0]:.3f}" y="{y:.3f}" text-anchor="{label.anchor}"'
        return f"<text {anchor} {attributes}>{escape(placed[0].text, quote=False)}</text>"
    spans = (
        f'<tspan x="{x + piece.right:.3f}" y="{y - piece.above:.3f}" font-size="{piece.size:g}">'
        f"{escape(piece.text, quote=False)}</tspan>"
        for piece in placed
    )
    return f'<text x="{x:.3f}" y="{y:.3f}" {attributes}>{"".join(spans)}</text>'
