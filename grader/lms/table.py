"""CSV as programs want it: UTF-8 without a mark, commas, decimal dots, CRLF; safe in spreadsheets."""

import csv
import io
from collections.abc import Iterable, Sequence

from grader.lms.faults import not_as_meant

Cell = str | int | float | None

FORMULA_STARTS = ("=", "+", "-", "@", "\t", "\r", "\n", "＝", "＋", "－", "＠")
"""What makes spreadsheets take a text for a formula; the full-width forms do so too."""


def csv_text(header: Sequence[str], rows: Iterable[Sequence[Cell]]) -> str:
    """A table as CSV text, read back once. Texts that a spreadsheet would run get an apostrophe before."""
    table = [[guarded(name) for name in header], *([written(cell) for cell in row] for row in rows)]
    buffer = io.StringIO()
    csv.writer(buffer, lineterminator="\r\n").writerows(table)
    text = buffer.getvalue()
    if list(csv.reader(io.StringIO(text, newline=""), strict=True)) != table:
        raise not_as_meant("the table")
    return text


def written(cell: Cell) -> str:
    """A cell's text: numbers with a dot and without needless digits, texts guarded."""
    if cell is None:
        return ""
    if isinstance(cell, float):
        return number(cell)
    return str(cell) if isinstance(cell, int) else guarded(cell)


def guarded(text: str) -> str:
    """The text, with an apostrophe where a spreadsheet would take it for a formula."""
    return f"'{text}" if is_formula(text) else text


def is_formula(text: str) -> bool:
    """Whether a spreadsheet would run this text."""
    return text.lstrip(" \u00a0\ufeff").startswith(FORMULA_STARTS)


def number(value: float, decimals: int = 5) -> str:
    """A decimal dot, no exponent, no grouping, no trailing zeros: 7.5, 10, 0.33333."""
    text = f"{value:.{decimals}f}".rstrip("0").rstrip(".")
    return "0" if text in {"-0", ""} else text
