"""Tables as text, readable in a terminal and as Markdown."""

from collections.abc import Iterable, Iterator, Sequence

Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]
"""Title, heads, rows."""
NOTHING = "-"
"""Stands where there is no figure."""


def as_text(tables: Iterable[Table]) -> str:
    """Tables one after another."""
    return "\n".join(line for table in tables for line in _table(*table))


def _table(title: str, heads: Sequence[str], rows: Sequence[Sequence[str]]) -> Iterator[str]:
    widths = [max(len(cell) for cell in column) for column in zip(heads, *rows, strict=True)]
    yield from (title, "")
    for row in (heads, ["-" * width for width in widths], *rows):
        yield "| " + " | ".join(cell.rjust(width) for cell, width in zip(row, widths, strict=True)) + " |"
    yield ""
