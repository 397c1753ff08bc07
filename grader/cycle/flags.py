"""Marks over a diagram: their lines down through all panels, their texts in rows above."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grader.cycle.marks import Mark
from grader.cycle.page import TICK_MM
from reference.canvas import PAPER, Area, Label, Shape, Stroke
from reference.lettering import width_of

ROW_MM = 4.3
APART_MM = 2.5
OVERHANG_MM = (14.0, 8.0)
"""How far texts may reach beyond the panels, left and right."""


@dataclass(frozen=True, slots=True)
class Flag:
    """A mark's text in its row, counted from below; where its line is, where the text starts and ends."""

    mark: Mark
    row: int
    line: float
    start: float
    end: float


@dataclass(frozen=True, slots=True)
class Across:
    """The width of the panels, and what it shows."""

    sides: tuple[float, float]
    view: tuple[float, float]

    def at(self, told: float) -> float:
        """Where a driven coordinate is."""
        left, right = self.sides
        return left + (told - self.view[0]) * (right - left) / (self.view[1] - self.view[0])


def flags_of(marks: Sequence[Mark], across: Across) -> list[Flag]:
    """A row for each text: as few as possible, and no line through another mark's text."""
    order = sorted((mark for mark in marks if mark.text), key=lambda mark: mark.at)
    ways = [_placed(order, across), _placed(order[::-1], across)]
    flags, _ = min(ways, key=lambda way: (way[1], rows_of(way[0])))
    return flags


def rows_of(flags: Sequence[Flag]) -> int:
    """How many rows there are."""
    return max((flag.row for flag in flags), default=-1) + 1


def _placed(order: Sequence[Mark], across: Across) -> tuple[list[Flag], int]:
    """The flags one after another, and how many lines pass through texts."""
    flags: list[Flag] = []
    crossed = 0
    for mark in order:
        line, wide = across.at(mark.at), width_of(mark.text, TICK_MM)
        start = max(line - wide / 2.0, across.sides[0] - OVERHANG_MM[0])
        start = min(start, across.sides[1] + OVERHANG_MM[1] - wide)
        ways = [Flag(mark, row, line, start, start + wide) for row in range(len(flags) + 1)]
        best = min(ways, key=lambda one: (_overlaps(one, flags), _crossings(one, flags), one.row))
        crossed += _crossings(best, flags)
        flags.append(best)
    return flags, crossed


def _overlaps(flag: Flag, others: Sequence[Flag]) -> int:
    return sum(
        flag.row == one.row and flag.start < one.end + APART_MM and one.start < flag.end + APART_MM
        for one in others
    )


def _crossings(flag: Flag, others: Sequence[Flag]) -> int:
    """Lines of higher flags through texts of lower ones."""
    own = sum(one.row < flag.row and one.start - 1.0 < flag.line < one.end + 1.0 for one in others)
    return own + sum(one.row > flag.row and flag.start - 1.0 < one.line < flag.end + 1.0 for one in others)


def drawn(
    marks: Sequence[Mark], flags: Sequence[Flag], across: Across, heights: tuple[float, float]
) -> Iterator[Shape]:
    """Lines and texts; the lowest row stands on the first height, lines end at the second."""
    foot, end = heights
    for mark in marks:
        x = across.at(mark.at)
        yield Stroke((x, foot), (x, end), mark.width, mark.colour, mark.dash)
    for flag in flags:
        if flag.row:
            yield Stroke((flag.line, foot - ROW_MM * flag.row), (flag.line, foot), 0.13, flag.mark.colour)
    for flag in flags:
        label = Label(
            (flag.start, foot - 1.2 - ROW_MM * flag.row), flag.mark.text, TICK_MM, colour=flag.mark.colour
        )
        left, top, right, bottom = label.bounds
        yield Area(((left, top), (right, top), (right, bottom), (left, bottom)), PAPER)
        yield label
