"""The cycle as a diagram: panels of velocities, accelerations and rates over one axis, paths to scale.

Everything in millimetres from the page's top left corner, x right, y down.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from grader.cycle.flags import ROW_MM, Across, drawn, flags_of, rows_of
from grader.cycle.page import GREY, TEXT_MM, Setting, Sheet, sheet_of
from grader.cycle.panel import TITLES, below, panel
from grader.cycle.paths import path_panel
from grader.cycle.quantities import Asked, Kind, Subject
from reference.canvas import Bounds, Label, Shape
from reference.lettering import Piece, width_of

LANDSCAPE_MM, PORTRAIT_MM, WIDE_MM = (297.0, 210.0), (210.0, 297.0), (420.0, 297.0)
LEFT_MM, RIGHT_MM, TOP_MM, BOTTOM_MM = 26.0, 12.0, 22.0, 17.0
INDENT_MM = 12.0
BETWEEN_MM = 12.0
TITLE_MM = 5.0
PANELS_SHARE = 0.6
"""Of a page that has panels and paths, for the panels."""


@dataclass(frozen=True, slots=True)
class Diagram:
    """A page: its shapes and its size."""

    shapes: tuple[Shape, ...]
    page_mm: tuple[float, float]


def cycle_diagram(subject: Subject, asked: Asked, setting: Setting) -> Diagram:
    """The diagram of what is asked for."""
    kinds = [kind for kind in TITLES if any(one.kind == kind for one in asked.quantities)]
    wide, high = _page_of(len(kinds), bool(asked.points))
    sheet = sheet_of(subject, setting)
    shapes = list(_heading(sheet))
    right = PANELS_SHARE * wide if kinds and asked.points else wide - RIGHT_MM
    if kinds:
        shapes += _panels(sheet, asked, kinds, (LEFT_MM, TOP_MM, right, high - BOTTOM_MM))
    if asked.points:
        room = (right + LEFT_MM if kinds else LEFT_MM, TOP_MM + 10.0, wide - RIGHT_MM, high - BOTTOM_MM)
        shapes += path_panel(subject, sheet.colours_of(asked.points), room, setting.words)
    return Diagram(tuple(shapes), (wide, high))


def _page_of(panels: int, has_paths: bool) -> tuple[float, float]:
    if panels and has_paths:
        return WIDE_MM
    return LANDSCAPE_MM if panels <= 2 else PORTRAIT_MM


def _panels(sheet: Sheet, asked: Asked, kinds: Sequence[Kind], room: Bounds) -> Iterator[Shape]:
    """The panels one below another, under the texts of the marks."""
    left, top, right, bottom = room
    across = Across((left, right), sheet.view)
    flags = flags_of(sheet.marks, across)
    foot = top + 2.0 + ROW_MM * rows_of(flags)
    first = foot + 6.0
    high = (bottom - first - BETWEEN_MM * (len(kinds) - 1)) / len(kinds)
    tops = [first + k * (high + BETWEEN_MM) for k in range(len(kinds))]
    yield from drawn(sheet.marks, flags, across, (foot, tops[-1] + high))
    for kind, upper in zip(kinds, tops, strict=True):
        quantities = [one for one in asked.quantities if one.kind == kind]
        yield from panel(sheet, kind, quantities, (left, upper, right, upper + high))
    yield from below(sheet, (left, tops[-1], right, tops[-1] + high))


def _heading(sheet: Sheet) -> Iterator[Shape]:
    """Whose cycle it is, and at what speed."""
    setting, words, driver = sheet.setting, sheet.setting.words, sheet.subject.structure.driver
    title = f"{setting.assignment.file.title.in_language(words.lang)} ({setting.assignment.id})"
    variant = setting.variant
    told = [
        f"{key} = {value}"
        for key, value in (("n", variant.n), ("position", variant.position))
        if value is not None
    ]
    told = [one.replace("position", words.gettext("position")) for one in told]
    yield Label((INDENT_MM, 11.0), ", ".join([title, *told]), TITLE_MM)
    rates = [("ω", "omega", "rad/s"), ("ε", "epsilon", "rad/s²")]
    if not sheet.subject.cycle.is_turned:
        rates = [("v", "speed", "m/s"), ("a", "acceleration", "m/s²")]
    x = INDENT_MM
    for letter, name, unit in rates:
        value = float(getattr(driver, name)[0])
        if name in {"epsilon", "acceleration"} and value == 0.0:
            continue
        link = driver.link if sheet.subject.cycle.is_turned else driver.pin
        number = words.significant(value, 4)
        text = (Piece(letter), Piece(link, -1), Piece(f" = {number}\N{NO-BREAK SPACE}{words.unit(unit)}"))
        yield Label((x, 17.0), text, TEXT_MM, colour=GREY)
        x += width_of(text, TEXT_MM) + 6.0
