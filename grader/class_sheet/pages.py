"""The class sheet on paper: tables over A3 pages, then a reference drawing of every variant.

Everything in millimetres from the page's top left corner, x right, y down.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from grader.class_sheet.columns import Column, Section, identity, sections_of
from grader.i18n import Tongue
from reference.assignment import Assignment
from reference.canvas import A3_MM, Area, Label, Shape, Stroke
from reference.draw import ENGLISH, reference_drawing
from reference.drawing.subject import Wording
from reference.lettering import Text, pieces_of, scale_pieces, width_of
from reference.plan import Plan

MARGIN_MM = 15.0
BOTTOM_MM = A3_MM[1] - MARGIN_MM
ROW_MM = 5.6
TITLE_MM, LETTER_MM, UNIT_MM = 4.4, 3.1, 2.7
CELL_GAP_MM = 3.0
BLOCK_GAP_MM = 4.0
HEAD_MM = 20.0
"""A table's title and its two lines of headings."""
BETWEEN_MM = 8.0
PAGE_ROWS = math.floor((BOTTOM_MM - MARGIN_MM - HEAD_MM) / ROW_MM)
"""Rows that a page has room for: a table is broken only where it has more."""
STRIPE = "#f1f3f5"
GREY = "#5b6470"

Page = tuple[Shape, ...]
Tell = Callable[[int, int], None]
"""How many drawings are done, of how many."""


@dataclass(frozen=True, slots=True)
class _Cells:
    """A column as text: whose it is, its unit, its cells, and how wide it is."""

    over: Text
    under: Text
    texts: tuple[str, ...]

    @property
    def wide_mm(self) -> float:
        widths = [width_of(self.over, LETTER_MM), width_of(self.under, UNIT_MM)]
        return max(*widths, *(width_of(text, LETTER_MM) for text in self.texts)) + CELL_GAP_MM


@dataclass(frozen=True, slots=True)
class _Table:
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
    """Pages of tables, then the reference drawing of each variant."""
    pages = list(tables)
    for index in range(len(plan.variants)):
        pages.extend(sheet.shapes for sheet in reference_drawing(assignment, plan, index, wording))
        if tell is not None:
            tell(index + 1, len(plan.variants))
    return pages


def numbered(pages: Sequence[Page]) -> list[Page]:
    """The pages with their number and how many there are, below the drawing's frame."""
    corner = (A3_MM[0] - MARGIN_MM, A3_MM[1] - 4.5)
    return [
        (*page, Label(corner, f"{number} / {len(pages)}", LETTER_MM, "end", GREY))
        for number, page in enumerate(pages, 1)
    ]


def table_pages(assignment: Assignment, plan: Plan, words: Tongue) -> list[Page]:
    """The tables of all sections, one below another; the headings are there again on each page.

    Arguments: `words` the language of titles, units and decimal marks.
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


def _tables(assignment: Assignment, plan: Plan, words: Tongue) -> Iterator[_Table]:
    """Each section's columns, as many at a time as a page is wide."""
    named = tuple(
        _Cells("", words.gettext(name), tuple(str(number) for number in numbers))
        for name, numbers in identity(plan.variants)
    )
    free = A3_MM[0] - 2 * MARGIN_MM - sum(one.wide_mm for one in named)
    title = assignment.file.title.in_language(words.lang)
    for section in sections_of(plan):
        heading = f"{title} ({assignment.id}). {words.gettext(section.title)}"
        for blocks in _spread(section, assignment, free, words):
            yield _Table(heading, named, tuple(blocks), len(plan.variants))


def _spread(
    section: Section, assignment: Assignment, free: float, words: Tongue
) -> Iterator[list[tuple[_Cells, ...]]]:
    taken: list[tuple[_Cells, ...]] = []
    used = 0.0
    for columns in section.blocks:
        block = tuple(_column(column, assignment, words) for column in columns)
        wide = BLOCK_GAP_MM + sum(one.wide_mm for one in block)
        if taken and used + wide > free:
            yield taken
            taken, used = [], 0.0
        taken.append(block)
        used += wide
    if taken:
        yield taken


def _column(column: Column, assignment: Assignment, words: Tongue) -> _Cells:
    shown = assignment.file.names.get(column.over, column.over)
    over = scale_pieces(shown) if column.over in {"kL", "kv", "ka"} else pieces_of(shown)
    digits = column.digits
    if column.kind == "g":
        largest = float(np.nanmax(np.abs(column.values), initial=0.0))
        digits = max(0, column.digits - 1 - math.floor(math.log10(largest))) if largest > 0.0 else 0
    texts = ["–" if np.isnan(value) else words.number(float(value), digits) for value in column.values]
    axis, _, unit = column.under.rpartition(", ")
    under = f"{axis}, {words.unit(unit)}" if axis else words.unit(unit)
    return _Cells(over, under, tuple(texts))


def _drawn(table: _Table, rows: range, y: float) -> Iterator[Shape]:
    """So many rows of a table, from a height down."""
    top = y + HEAD_MM
    wide = sum(one.wide_mm for one in (*table.named, *(one for block in table.blocks for one in block)))
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
    """Columns under one name."""
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
