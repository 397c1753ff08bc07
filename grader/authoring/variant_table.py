"""Table of all variants for the instructor's records: CSV columns, and A3 pages with reference drawings.

Names are those of measurement files: ``v_A`` drawn millimetres, ``v_A_value`` SI, ``v_A_deg``
counter-clockwise from +x, ``omega_3_value`` counter-clockwise positive; besides them the scales (real
units per millimetre on paper) and the points of the mechanism, ``x_A`` and ``y_A`` in metres.

Pages are in millimetres from the top left corner, x right, y down.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from grader.files import guarded
from grader.language import Tongue
from grader.tables.reader import written
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.authored.variant_table import KEYS
from reference.drawing.canvas import (
    A3_MM,
    Area,
    Label,
    Shape,
    Stroke,
    Text,
    pieces_of,
    scale_pieces,
    width_of,
)
from reference.drawing.sheets import ENGLISH, reference_drawing
from reference.drawing.subject import Wording
from reference.geometry import FloatArray
from reference.plan import Plan
from reference.quantities import unit_of

Title = Literal["Scales", "Mechanism", "Velocities", "Accelerations", "Forces"]
PLANS: dict[str, Title] = {"kv": "Velocities", "ka": "Accelerations", "kF": "Forces"}
MARGIN_MM = 15.0
"""Margin inside the drawing frame, 10 mm, on all sides."""
BOTTOM_MM = A3_MM[1] - MARGIN_MM
"""The lower end of the last row."""
TITLE_MM, LETTER_MM, UNIT_MM = 4.4, 3.1, 2.7
"""Letter heights of titles, of cells, of units."""
ROW_MM = 5.6
"""Height of a row: a line of letters and room between two lines."""
CELL_GAP_MM = 3.0
"""Gap between two columns of a block."""
BLOCK_GAP_MM = 4.0
"""Gap between two blocks."""
HEAD_MM = 20.0
"""Height of a table's title and its two lines of headings."""
BETWEEN_MM = 8.0
"""Gap between two tables on one page."""
PAGE_ROWS = math.floor((BOTTOM_MM - MARGIN_MM - HEAD_MM) / ROW_MM)
"""Rows that fit a page: a table is broken only if it has more."""
STRIPE = "#f1f3f5"
GREY = "#5b6470"

Page = tuple[Shape, ...]
Tell = Callable[[int, int], None]
"""Called with the number of finished drawings and of all drawings."""


# Columns ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Column:
    """One figure of every variant.

    Attributes
    ----------
    key : its name in files
    over, under : its heading on paper: its name, and its unit
    values : (N,), nan if a variant has none (the direction of a zero vector)
    digits, kind : number of decimals (``f``) or significant digits (``g``) on paper
    """

    key: str
    over: str
    under: str
    values: FloatArray
    digits: int
    kind: Literal["f", "g"] = "f"


@dataclass(frozen=True, slots=True)
class Section:
    """Columns that belong together, in blocks that stay on one page."""

    title: Title
    blocks: tuple[tuple[Column, ...], ...]


def sections_of(plan: Plan) -> tuple[Section, ...]:
    """Return all columns of a plan's variants."""
    count = len(plan.variants)
    scales = [
        Column(name, name, unit_of(name), np.broadcast_to(scale, (count,)), 5, "g")
        for name, scale in plan.scales.by_name.items()
    ]
    rates = [Column(f"{name}_value", name, unit_of(name), _rate(plan, name), 5, "g") for name in plan.rates]
    sections = [
        Section("Scales", tuple((column,) for column in (*scales, *rates))),
        Section("Mechanism", tuple(_point(joint, at, count) for joint, at in plan.motion.position.items())),
    ]
    for scale, title in PLANS.items():
        names = [name for name, vector in plan.construction.vectors.items() if vector.scale == scale]
        if names:
            sections.append(Section(title, tuple(_vector(plan, name) for name in names)))
    return tuple(sections)


def _point(joint: str, at: np.ndarray, count: int) -> tuple[Column, ...]:
    place = np.broadcast_to(at, (count,))
    return (
        Column(f"x_{joint}", joint, "x, m", place.real + 0.0, 5),
        Column(f"y_{joint}", joint, "y, m", place.imag + 0.0, 5),
    )


def _rate(plan: Plan, name: str) -> FloatArray:
    """Return an angular quantity, exactly zero if the vector that it comes from is."""
    values = np.broadcast_to(plan.rates[name], (len(plan.variants),))
    rate = plan.construction.rates.get(name)
    return np.where(rate is not None and plan.is_zero(rate.vector), 0.0, values) + 0.0


def _vector(plan: Plan, name: str) -> tuple[Column, ...]:
    drawn, value, zero = np.abs(plan.drawn_mm(name)), np.abs(plan.vectors_si[name]), plan.is_zero(name)
    return (
        Column(name, name, "mm", np.where(zero, 0.0, drawn), 2),
        Column(f"{name}_value", name, unit_of(name), np.where(zero, 0.0, value), 4, "g"),
        Column(f"{name}_deg", name, "°", plan.direction_deg(name), 2),
    )


def identity(variants: Sequence[Variant]) -> list[tuple[str, list[int]]]:
    """Return ``n`` and ``position`` of each variant, as far as the assignment has them."""
    columns = [(name, [getattr(variant, name) for variant in variants]) for name in KEYS]
    return [(name, numbers) for name, numbers in columns if numbers and numbers[0] is not None]


def class_csv(plan: Plan, *, decimal_comma: bool = False) -> str:
    """Return a CSV with a row for each variant; semicolons and decimal commas if the language needs them.

    Ten significant digits; a zero vector's direction is blank. UTF-8 without a mark, CRLF.
    """
    columns = [column for section in sections_of(plan) for block in section.blocks for column in block]
    known = identity(plan.variants)
    rows = [[*(name for name, _ in known), *(guarded(column.key) for column in columns)]]
    for row in range(len(plan.variants)):
        figures = [_written(float(column.values[row]), decimal_comma) for column in columns]
        rows.append([*(str(numbers[row]) for _, numbers in known), *figures])
    return written(rows, ";" if decimal_comma else ",")


def _written(value: float, decimal_comma: bool) -> str:
    if np.isnan(value):
        return ""
    text = f"{value:.10g}"
    return text.replace(".", ",") if decimal_comma else text


# Pages --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Cells:
    """A column as text: its name, its unit, its cells, and its width."""

    over: Text
    under: Text
    texts: tuple[str, ...]

    @property
    def wide_mm(self) -> float:
        widths = [width_of(self.over, LETTER_MM), width_of(self.under, UNIT_MM)]
        return max(*widths, *(width_of(text, LETTER_MM) for text in self.texts)) + CELL_GAP_MM


@dataclass(frozen=True, slots=True)
class _VariantTable:
    """A table as wide as a page: the variants' numbers, then blocks of columns under one name each."""

    title: str
    named: tuple[_Cells, ...]
    blocks: tuple[tuple[_Cells, ...], ...]
    rows: int


def class_pages(
    tables: Sequence[Page],
    assignment: Assignment,
    plan: Plan,
    wording: Wording = ENGLISH,
    tell: Tell | None = None,
) -> list[Page]:
    """Return pages of tables, then the reference drawing of each variant."""
    pages = list(tables)
    for index in range(len(plan.variants)):
        pages.extend(sheet.shapes for sheet in reference_drawing(assignment, plan, index, wording))
        if tell is not None:
            tell(index + 1, len(plan.variants))
    return pages


def numbered(pages: Sequence[Page]) -> list[Page]:
    """Number the pages, below the drawing's frame."""
    corner = (A3_MM[0] - MARGIN_MM, A3_MM[1] - 4.5)
    return [
        (*page, Label(corner, f"{number} / {len(pages)}", LETTER_MM, "end", GREY))
        for number, page in enumerate(pages, 1)
    ]


def table_pages(assignment: Assignment, plan: Plan, words: Tongue) -> list[Page]:
    """Return the tables of all sections, one below another; headings are repeated on each page.

    Arguments: `words` is the language of titles, units and decimal marks.
    """
    pages: list[list[Shape]] = []
    y = BOTTOM_MM
    for table in _tables(assignment, plan, words):
        done = 0
        while done < table.rows:
            room = math.floor((BOTTOM_MM - y - HEAD_MM) / ROW_MM)
            if room < min(table.rows - done, PAGE_ROWS):
                pages.append([])
                y = MARGIN_MM
                continue
            rows = range(done, min(done + room, table.rows))
            pages[-1].extend(_drawn(table, rows, y))
            y += HEAD_MM + len(rows) * ROW_MM + BETWEEN_MM
            done = rows.stop
    return [tuple(page) for page in pages]


def _tables(assignment: Assignment, plan: Plan, words: Tongue) -> Iterator[_VariantTable]:
    """Yield each section's columns, split to the width of a page."""
    named = tuple(
        _Cells("", words.gettext(name), tuple(str(number) for number in numbers))
        for name, numbers in identity(plan.variants)
    )
    free = A3_MM[0] - 2 * MARGIN_MM - sum(cells.wide_mm for cells in named)
    title = assignment.file.title.in_language(words.lang)
    for section in sections_of(plan):
        heading = f"{title} ({assignment.id}). {words.gettext(section.title)}"
        for blocks in _spread(section, assignment, free, words):
            yield _VariantTable(heading, named, tuple(blocks), len(plan.variants))


def _spread(
    section: Section, assignment: Assignment, free: float, words: Tongue
) -> Iterator[list[tuple[_Cells, ...]]]:
    taken: list[tuple[_Cells, ...]] = []
    used = 0.0
    for columns in section.blocks:
        block = tuple(_column(column, assignment, words) for column in columns)
        wide = BLOCK_GAP_MM + sum(cells.wide_mm for cells in block)
        if taken and used + wide > free:
            yield taken
            taken, used = [], 0.0
        taken.append(block)
        used += wide
    if taken:
        yield taken


def _column(column: Column, assignment: Assignment, words: Tongue) -> _Cells:
    shown = assignment.file.names.get(column.over, column.over)
    over = scale_pieces(shown) if column.over in SCALE_NAMES else pieces_of(shown)
    digits = column.digits
    if column.kind == "g":
        largest = float(np.nanmax(np.abs(column.values), initial=0.0))
        digits = max(0, column.digits - 1 - math.floor(math.log10(largest))) if largest > 0.0 else 0
    texts = ["–" if np.isnan(value) else words.number(float(value), digits) for value in column.values]
    axis, _, unit = column.under.rpartition(", ")
    under = f"{axis}, {words.unit(unit)}" if axis else words.unit(unit)
    return _Cells(over, under, tuple(texts))


def _drawn(table: _VariantTable, rows: range, y: float) -> Iterator[Shape]:
    """Draw some rows of a table, from a height down."""
    top = y + HEAD_MM
    wide = sum(cells.wide_mm for block in (table.named, *table.blocks) for cells in block)
    right = MARGIN_MM + wide + BLOCK_GAP_MM * len(table.blocks)
    yield Label((MARGIN_MM, y + TITLE_MM), table.title, TITLE_MM)
    for line in range(1, len(rows), 2):
        low, high = top + line * ROW_MM, top + (line + 1) * ROW_MM
        yield Area(((MARGIN_MM, low), (right, low), (right, high), (MARGIN_MM, high)), STRIPE)
    yield Stroke((MARGIN_MM, top - 0.8), (right, top - 0.8), 0.35)
    bottom = top + len(rows) * ROW_MM
    yield Stroke((MARGIN_MM, bottom), (right, bottom), 0.18)
    x = MARGIN_MM
    for column in table.named:
        x += column.wide_mm
        yield from _cells(column, x, rows, top)
    for block in table.blocks:
        x += BLOCK_GAP_MM
        yield from _block(block, x, rows, top)
        x += sum(column.wide_mm for column in block)


def _block(block: Sequence[_Cells], left: float, rows: range, top: float) -> Iterator[Shape]:
    """Draw columns under one name."""
    start, right = left + CELL_GAP_MM, left + sum(column.wide_mm for column in block)
    several = len(block) > 1
    place, anchor = ((start + right) / 2.0, "middle") if several else (right, "end")
    yield Label((place, top - 7.8), block[0].over, LETTER_MM, anchor)
    if several:
        yield Stroke((start, top - 6.2), (right, top - 6.2), 0.13, GREY)
    x = left
    for column in block:
        x += column.wide_mm
        yield from _cells(column, x, rows, top)


def _cells(column: _Cells, right: float, rows: range, top: float) -> Iterator[Shape]:
    yield Label((right, top - 2.6), column.under, UNIT_MM, "end", GREY)
    for line, row in enumerate(rows):
        yield Label((right, top + line * ROW_MM + 4.0), column.texts[row], LETTER_MM, "end")
