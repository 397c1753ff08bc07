"""Formulas as trees, typeset as MathML, as shapes for SVG and PDF, and as text."""

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby

from markupsafe import Markup

from reference.drawing.canvas import INK, Curve, Label, Piece, Shape, Stroke, rise_and_fall, shifted, width_of

# Formulas -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Name:
    """A quantity's name with its indices; `plain` as reports write it. A vector has a bar on its letter."""

    pieces: tuple[Piece, ...]
    plain: str
    is_vector: bool = False


@dataclass(frozen=True, slots=True)
class Fraction:
    """One formula over another."""

    over: "Formula"
    under: "Formula"


Formula = str | Name | Fraction | tuple["Formula", ...]
"""A text (numbers, signs, words), a name, a fraction, or several side by side."""


@dataclass(frozen=True, slots=True)
class Grid:
    """An equation with what is known of its terms: rows of cells, the first of each its heading.

    `underlines` by column: two under a vector whose size and direction are known, one if one of them is.
    """

    rows: tuple[tuple[Formula, ...], ...]
    underlines: tuple[int, ...]


# As text ------------------------------------------------------------------------------------------

RAISED = {"n": "ⁿ", "t": "ᵗ", "r": "ʳ", "c": "ᶜ"}
LOWERED = str.maketrans("0123456789", "₀₁₂₃₄₅₆₇₈₉")
BAR = "\N{COMBINING OVERLINE}"


def unicode_name(name: Name) -> str:
    """Return a name as a terminal shows it: v̅_BA, a̅_BAⁿ, ω₁, O₂B."""
    texts = []
    for piece in name.pieces:
        below = piece.text.translate(LOWERED) if piece.text.isdecimal() else f"_{piece.text}"
        texts.append({0: piece.text, -1: below, 1: RAISED.get(piece.text, f"^{piece.text}")}[piece.height])
    return texts[0] + BAR * name.is_vector + "".join(texts[1:])


def plain(formula: Formula, *, in_unicode: bool = False) -> str:
    """Return a formula as text, names as reports write them (``a_BA_n``) or as a terminal shows them."""
    match formula:
        case str():
            return formula
        case Name():
            return unicode_name(formula) if in_unicode else formula.plain
        case Fraction(over=over, under=under):
            parts = zip((over, under), ("+−/", "·+−/"), strict=True)
            texts = ((plain(part, in_unicode=in_unicode), signs) for part, signs in parts)
            return " / ".join(f"({text})" if set(signs) & set(text) else text for text, signs in texts)
    return "".join(plain(part, in_unicode=in_unicode) for part in formula)


def grid_text(grid: Grid) -> str:
    """Return an equation as aligned lines for a terminal, known terms underlined by ═ or ─."""
    rows = [[plain(cell, in_unicode=True) for cell in row] for row in grid.rows]
    wide = [max(_columns(row[at]) for row in rows) for at in range(len(rows[0]))]
    rules = ["═─"[2 - count] * wide[at] if count else "" for at, count in enumerate(grid.underlines)]
    lines = [rows[0], rules, *rows[1:]]
    return "\n".join(
        " ".join(cell + " " * (wide[at] - _columns(cell)) for at, cell in enumerate(line)).rstrip()
        for line in lines
    )


def _columns(text: str) -> int:
    return len(text) - text.count(BAR)


# As MathML ----------------------------------------------------------------------------------------

SIGNS = frozenset("=+−·()")
MI = Markup('<mi mathvariant="normal">{}</mi>')
"""One letter looks as several do: the page slants all of them."""


def mathml(formula: Formula) -> Markup:
    """Return a formula as elements of MathML; a chain of equalities can be broken before each sign."""
    parts = formula if isinstance(formula, tuple) else (formula,)
    segments: list[list[Formula]] = [[]]
    for part in parts:
        if part == " = " and segments[0]:
            segments.append([])
        segments[-1].append(part)
    return Markup(" ").join(
        Markup("<math>{}</math>").format(Markup("").join(map(_element, segment))) for segment in segments
    )


def _element(formula: Formula) -> Markup:
    match formula:
        case str():
            text = formula.strip()
            if text in SIGNS:
                return Markup("<mo>{}</mo>").format(text)
            tag = "mn" if text[:1].isdecimal() else "mtext"
            before, after = ("\N{NO-BREAK SPACE}" * (end == " ") for end in (formula[:1], formula[-1:]))
            return Markup("<{0}>{1}{2}{3}</{0}>").format(tag, before, text, after)
        case Name():
            return _name(formula)
        case Fraction(over=over, under=under):
            return Markup("<mfrac>{}{}</mfrac>").format(_row(over), _row(under))
    return _row(formula)


def _row(formula: Formula) -> Markup:
    parts = formula if isinstance(formula, tuple) else (formula,)
    return Markup("<mrow>{}</mrow>").format(Markup("").join(map(_element, parts)))


def _name(name: Name) -> Markup:
    """Write each letter with the indices that follow it."""
    found = Markup("")
    for base, indices in _indexed(name.pieces):
        letter = MI.format(base)
        if name.is_vector and not found:
            letter = Markup('<mover accent="true">{}<mo stretchy="false">¯</mo></mover>').format(letter)
        below, above = (
            Markup("").join(MI.format(one.text) for one in indices if one.height == height)
            for height in (-1, 1)
        )
        tag = {(True, True): "msubsup", (True, False): "msub", (False, True): "msup"}.get(
            (bool(below), bool(above))
        )
        found += Markup("<{0}>{1}{2}{3}</{0}>").format(tag, letter, below, above) if tag else letter
    return found


def _indexed(pieces: Iterable[Piece]) -> Iterator[tuple[str, list[Piece]]]:
    base = ""
    for is_index, group in groupby(pieces, key=lambda piece: piece.height != 0):
        if is_index:
            yield base, list(group)
            base = ""
        else:
            base = "".join(piece.text for piece in group)
    if base:
        yield base, []


def grid_html(grid: Grid) -> Markup:
    """Return an equation as a table whose cells are MathML."""
    rows = []
    for number, row in enumerate(grid.rows):
        cells = [Markup("<th>{}</th>").format(row[0] if isinstance(row[0], str) else mathml(row[0]))]
        for count, cell in zip(grid.underlines[1:], row[1:], strict=True):
            mark = Markup(' class="known-{}"').format(count) if count and not number else ""
            cells.append(Markup("<td{}>{}</td>").format(mark, mathml(cell) if cell else ""))
        rows.append(Markup("<tr>{}</tr>").format(Markup("").join(cells)))
    return Markup('<div class="equation"><table>{}</table></div>').format(Markup("").join(rows))


# As shapes ----------------------------------------------------------------------------------------

SHARE_IN_FRACTION, AXIS, GAP = 0.86, 0.3, 0.14
"""Size of a fraction's parts; height of its line, and the gap above and below it, as shares of the size."""
LINE_MM = 0.16
TICK = "✓"
"""Drawn as a line: the embedded font has no such letter."""
SPACE = 0.5
"""Gap between the columns, as a share of the size."""


@dataclass(frozen=True, slots=True)
class Typeset:
    """A formula as shapes: its base line starts at (0, 0), millimetres, y down."""

    width: float
    rise: float
    fall: float
    shapes: tuple[Shape, ...]

    def at(self, x: float, y: float) -> tuple[Shape, ...]:
        """Return the shapes with their base line from a point on."""
        return tuple(shifted(shape, (x, y)) for shape in self.shapes)


def typeset(formula: Formula, size: float) -> Typeset:
    """Typeset a formula; `size` is the height of its letters' line, mm."""
    match formula:
        case str():
            if formula == TICK:
                tick = Curve(((0.1 * size, -0.3 * size), (0.3 * size, 0.0), (0.65 * size, -0.65 * size)), 0.3)
                return Typeset(0.75 * size, 0.65 * size, 0.0, (tick,))
            text = formula.strip()
            start = width_of(formula[: len(formula) - len(formula.lstrip())], size)
            label = (Label((start, 0.0), text, size),) if text else ()
            return Typeset(width_of(formula, size), *rise_and_fall(text, size), label)
        case Name(pieces=pieces):
            rise, fall = rise_and_fall(pieces, size)
            shapes: tuple[Shape, ...] = (Label((0.0, 0.0), pieces, size, italic=True),)
            if formula.is_vector:
                end = width_of(pieces[0].text, size) + 0.06 * size
                shapes += (Stroke((0.14 * size, -0.8 * size), (end, -0.8 * size), LINE_MM),)
            return Typeset(width_of(pieces, size) + 0.08 * size, max(rise, 0.85 * size), fall, shapes)
        case Fraction(over=over, under=under):
            return _fraction(
                typeset(over, SHARE_IN_FRACTION * size), typeset(under, SHARE_IN_FRACTION * size), size
            )
    return _side_by_side([typeset(part, size) for part in formula])


def _fraction(over: Typeset, under: Typeset, size: float) -> Typeset:
    width = max(over.width, under.width) + 0.2 * size
    up, down = -(AXIS + GAP) * size - over.fall, (GAP - AXIS) * size + under.rise
    line = Stroke((0.0, -AXIS * size), (width, -AXIS * size), LINE_MM)
    shapes = (
        *over.at((width - over.width) / 2.0, up), line, *under.at((width - under.width) / 2.0, down)
    )  # fmt: skip
    return Typeset(width, over.rise - up, down + under.fall, shapes)


def _side_by_side(parts: Sequence[Typeset]) -> Typeset:
    shapes: list[Shape] = []
    right = 0.0
    for part in parts:
        shapes += part.at(right, 0.0)
        right += part.width
    rise, fall = (max((getattr(part, side) for part in parts), default=0.0) for side in ("rise", "fall"))
    return Typeset(right, rise, fall, tuple(shapes))


def grid_shapes(grid: Grid, size: float) -> tuple[Shape, ...]:
    """Return an equation as shapes, its first base line from (0, 0) on."""
    cells = [[typeset(cell, size if at else 0.8 * size) for at, cell in enumerate(row)] for row in grid.rows]
    wide = [max(row[at].width for row in cells) for at in range(len(cells[0]))]
    shapes: list[Shape] = []
    y = 0.0
    for number, row in enumerate(cells):
        y += max(cell.rise for cell in row) if number else 0.0
        x = 0.0
        for at, cell in enumerate(row):
            shapes += cell.at(x + ((wide[at] - cell.width) / 2.0 if at else 0.0), y)
            for line in range(grid.underlines[at] if not number else 0):
                below = y + (0.42 + 0.14 * line) * size
                shapes.append(Stroke((x, below), (x + wide[at], below), LINE_MM, INK))
            x += wide[at] + SPACE * size
        y += max(cell.fall for cell in row) + (0.62 if not number else 0.3) * size
    return tuple(shapes)
