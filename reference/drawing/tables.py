"""The column beside the figures: title, given data, and the table of values."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from reference.drawing import symbols
from reference.drawing.canvas import (
    INK,
    Bounds,
    Label,
    Piece,
    Shape,
    Stroke,
    Text,
    pieces_of,
    width_of,
    wrapped,
)
from reference.drawing.subject import Subject
from reference.quantities import group_of, unit_of

COLUMN_MM = 96.0
EDGE_MM = 3.0
TITLE_MM, DATA_MM = 3.8, 3.2
LINE_HEIGHT = 1.45
ROW_MM, LEAST_ROW_MM = 4.6, 3.0
LETTER_SHARE = 0.68
"""Letter size as a share of a row's height."""
COLUMNS_MM = (0.0, 15.0, 33.0, 48.0, 75.0, 96.0)
WORDS, CELL_EDGE_MM = (0, 1), 1.3
RULE_COLOUR = "#9aa3ad"


@dataclass(frozen=True, slots=True)
class TableRow:
    """A row of the table: name, position on paper, drawn length, value, direction or sense."""

    name: Text
    segment: Text
    drawn: str
    value: str
    direction: str
    turns: float = 0.0
    """Above zero counter-clockwise, below clockwise; zero for anything that does not turn."""


@dataclass(frozen=True, slots=True)
class TableColumn:
    """The column beside the figures, its lower end, and whether it has room."""

    shapes: tuple[Shape, ...]
    box: Bounds
    fits: bool


def column(
    subject: Subject, figures: Sequence[str], corner: tuple[float, float], bottom: float
) -> TableColumn:
    """Draw title, data and table of a sheet's figures, from the column's top right corner down."""
    left, top = corner[0] - COLUMN_MM, corner[1]
    head, y = _heading(subject, (left + EDGE_MM, top + EDGE_MM))
    rows = list(table_rows(subject, figures))
    table: list[Shape] = []
    height = min(ROW_MM, (bottom - y) / len(rows))
    if len(rows) > 1:
        table = list(_table(rows, (left, y), max(height, LEAST_ROW_MM)))
        y += len(rows) * max(height, LEAST_ROW_MM)
    rules = [Stroke((left, top), (left, y), 0.3), Stroke((left, y), (corner[0], y), 0.3)]
    return TableColumn((*rules, *head, *table), (left, top, corner[0], y), height >= LEAST_ROW_MM)


def _heading(subject: Subject, at: tuple[float, float]) -> tuple[list[Shape], float]:
    """Draw title, variant and given data; return their lower end."""
    x, y = at
    shapes: list[Shape] = []
    lines: list[tuple[Text, float]] = []
    lang = subject.wording.lang
    title = subject.assignment.file.title.in_language(lang)
    lines += [(line, TITLE_MM) for line in wrapped(title, TITLE_MM, COLUMN_MM - 2 * EDGE_MM)]
    variant_text = subject.wording.variant_text(subject.plan.variants[subject.index])
    if variant_text:
        lines.append((variant_text, TITLE_MM))
    lines += [(datum, DATA_MM) for datum in _flowed(given_data(subject), COLUMN_MM - 2 * EDGE_MM)]
    for text, size in lines:
        y += LINE_HEIGHT * size
        shapes.append(Label((x, y), text, size))
    return shapes, y + EDGE_MM


def given_data(subject: Subject) -> Iterator[tuple[Piece, ...]]:
    """Yield the variant's data, each as label = value unit."""
    wording = subject.wording
    for datum, given in subject.assignment.given(subject.plan.variants[subject.index]):
        value = wording.sides.get(given, given) if isinstance(given, str) else wording.number(f"{given:.6g}")
        unit = subject.wording.unit(datum.unit)
        gap = "" if unit in {"", "°"} else "\N{NO-BREAK SPACE}"
        yield (*pieces_of(datum.label), Piece(f" = {value}{gap}{unit}"))


def _flowed(data: Iterator[tuple[Piece, ...]], wide: float) -> list[tuple[Piece, ...]]:
    """Set data side by side in as many lines as they need."""
    lines: list[tuple[Piece, ...]] = []
    for datum in data:
        longer = (*lines[-1], Piece(",  "), *datum) if lines else datum
        if lines and width_of(longer, DATA_MM) <= wide:
            lines[-1] = longer
        else:
            lines.append(datum)
    return lines


def table_rows(subject: Subject, figures: Sequence[str]) -> Iterator[TableRow]:
    """Yield headings, the vectors of these figures, and the rates that follow from them."""
    wording, plan = subject.wording, subject.plan
    yield TableRow(*wording.columns)
    shown = [vector for figure in figures for vector in plan.construction.vectors_of(figure)]
    for vector in shown:
        drawn = subject.number(np.abs(plan.drawn_mm(vector.name)))
        real = 0.0 if subject.is_zero(vector.name) else subject.number(np.abs(plan.vectors_si[vector.name]))
        angle = f"{subject.number(plan.direction_deg(vector.name)):.2f}°"
        yield TableRow(
            subject.letter(vector.name),
            ""
            if group_of(plan.construction.figure_of(vector.head))
            else (*subject.letter(vector.tail), Piece(" "), *subject.letter(vector.head)),
            wording.number(f"{drawn:.2f}"),
            wording.number(f"{four_digits(real)}") + f" {wording.unit(unit_of(vector.name))}",
            "–" if subject.is_zero(vector.name) else wording.number(angle),
        )
    names = {vector.name for vector in shown}
    for name, values in plan.rates.items():
        rate = plan.construction.rates.get(name)
        if rate.vector in names if rate else plan.mechanism.driver.pin in map(group_of, figures):
            turns = 0.0 if rate and subject.is_zero(rate.vector) else subject.number(values)
            unit = wording.unit(unit_of(name))
            value = wording.number(f"{four_digits(abs(turns))}")
            yield TableRow(subject.letter(name), "", "", f"{value} {unit}", "" if turns else "–", turns)


def four_digits(value: float) -> str:
    """Return a value with four significant digits, trailing zeros kept, or all digits before the point."""
    return f"{value:.0f}" if abs(value) >= 1e4 else f"{value:#.4g}".rstrip(".") if value else "0"


def _cell(column_at: int, text: Text, at: tuple[float, float], size: float) -> Label:
    """Set a text in its column: words left, numbers right-aligned; smaller if it is too long."""
    start, end = COLUMNS_MM[column_at] + CELL_EDGE_MM, COLUMNS_MM[column_at + 1] - CELL_EDGE_MM
    fitting = size * min(1.0, (end - start) / width_of(text, size))
    if column_at in WORDS:
        return Label((at[0] + start, at[1]), text, fitting)
    return Label((at[0] + end, at[1]), text, fitting, "end")


def _table(rows: Sequence[TableRow], at: tuple[float, float], height: float) -> Iterator[Shape]:
    left, top = at
    size = LETTER_SHARE * height
    for k, row in enumerate(rows):
        y = top + k * height
        base = y + 0.72 * height
        yield Stroke((left, y), (left + COLUMN_MM, y), 0.13 if k > 1 else 0.3, RULE_COLOUR if k > 1 else INK)
        cells: Sequence[Text] = (row.name, row.segment, row.drawn, row.value, row.direction)
        for column_at, text in enumerate(cells):
            if text:
                yield _cell(column_at, text, (left, base), size)
        if row.turns:
            yield from symbols.sense(complex(left + COLUMNS_MM[5] - 4.5, -(y + height / 2)), row.turns)
    bottom = top + len(rows) * height
    for edge in COLUMNS_MM[1:-1]:
        yield Stroke((left + edge, top), (left + edge, bottom), 0.13, RULE_COLOUR)
