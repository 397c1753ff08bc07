"""The cycle as a diagram: panels of velocities, accelerations and rates over one axis, paths to scale.

Everything in millimetres from the page's top left corner, x right, y down.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from grader.cycle.axes import DEGREES, Frame, Labelling, cut, decimals_of, dense, step_of, ticks
from grader.cycle.marks import Mark, marks_of
from grader.cycle.paths import path_panel
from grader.cycle.quantities import Asked, Kind, Quantity, Subject
from grader.cycle.strokes import unbounded_ends
from grader.i18n import N_, Tongue
from reference.assignment import Assignment, Variant
from reference.canvas import PAPER, Area, Bounds, Curve, Label, Point, Ring, Shape, Stroke
from reference.geometry import FloatArray
from reference.lettering import Piece, Text, pieces_of, width_of

LANDSCAPE_MM, PORTRAIT_MM, WIDE_MM = (297.0, 210.0), (210.0, 297.0), (420.0, 297.0)
LEFT_MM, RIGHT_MM, TOP_MM, BOTTOM_MM = 26.0, 12.0, 22.0, 17.0
BETWEEN_MM = 12.0
ROW_MM = 4.3
TITLE_MM, TEXT_MM, TICK_MM, NAME_MM = 5.0, 3.4, 3.1, 3.8
GRID, AXIS, GREY, SHADE = "#dfe3e8", "#5b6470", "#5b6470", "#eceff2"
COLOURS = ("#0b62a8", "#c8501e", "#11806a", "#8e3b8c", "#b07a00", "#4a4f57", "#d1306e", "#3f8fd0")
DASHES: dict[str, tuple[float, ...]] = {"": (), "x": (3.0, 1.2), "y": (0.6, 1.2)}
TITLES: dict[Kind, str] = {
    "velocity": N_("Velocities"),
    "acceleration": N_("Accelerations"),
    "omega": N_("Angular velocities"),
    "epsilon": N_("Angular accelerations"),
}
DRAWN_AT_MOST = 1500
CALM = 0.8
"""So much of its samples is shown at least of a curve that grows without bound, with all of its humps."""
SPIKE = 8.0
"""A value so many times the calm ones is beyond the frame as well."""
TIPS = 33
"""Positions about a least length, where its curve has a sharp tip that samples would blunt."""


@dataclass(frozen=True, slots=True)
class Diagram:
    """A page: its shapes and its size."""

    shapes: tuple[Shape, ...]
    page_mm: tuple[float, float]


@dataclass(frozen=True, slots=True)
class Setting:
    """Whose cycle it is, and in what language it is told."""

    assignment: Assignment
    variant: Variant
    words: Tongue

    def shown(self, name: str) -> Text:
        """A name as students see it."""
        return pieces_of(self.assignment.file.names.get(name, name))


@dataclass(slots=True)
class _Sheet:
    """What the panels of a page share."""

    subject: Subject
    setting: Setting
    across: FloatArray
    """The driven coordinate as told, degrees or millimetres, of the samples drawn."""
    chosen: NDArray[np.intp]
    view: tuple[float, float]
    marks: Sequence[Mark]
    colours: dict[str, str] = field(default_factory=dict)

    def colour(self, quantity: Quantity) -> str:
        """One for each vector's or link's own, the same in every panel."""
        whose = quantity.of.partition("_")[2]
        return self.colours.setdefault(whose, COLOURS[len(self.colours) % len(COLOURS)])


def cycle_diagram(subject: Subject, asked: Asked, setting: Setting) -> Diagram:
    """The diagram of what is asked for."""
    kinds = [kind for kind in TITLES if any(one.kind == kind for one in asked.quantities)]
    page = _page_of(len(kinds), bool(asked.points))
    sheet = _sheet_of(subject, setting)
    left, right = LEFT_MM, page[0] - RIGHT_MM
    if kinds and asked.points:
        left, right = LEFT_MM, 0.6 * page[0]
    shapes = list(_heading(sheet))
    rows = list(_flagged(sheet.marks, sheet.view, (left, right))) if kinds else []
    top = TOP_MM + ROW_MM * (1 + max((row for row, _ in rows), default=-1)) + 8.0
    if kinds:
        high = (page[1] - BOTTOM_MM - top - BETWEEN_MM * (len(kinds) - 1)) / len(kinds)
        frames = [
            (left, top + k * (high + BETWEEN_MM), right, top + k * (high + BETWEEN_MM) + high)
            for k in range(len(kinds))
        ]
        shapes += _flags(sheet, rows, (left, right), (TOP_MM + 3.0, frames[-1][3]))
        for kind, box in zip(kinds, frames, strict=True):
            quantities = [one for one in asked.quantities if one.kind == kind]
            shapes += _panel(sheet, kind, quantities, box)
        shapes += _below(sheet, frames[-1])
    if asked.points:
        start = right + LEFT_MM if kinds else LEFT_MM
        room = (start, TOP_MM + 10.0, page[0] - RIGHT_MM, page[1] - BOTTOM_MM)
        colours = {point: sheet.colours.get(point, "") for point in asked.points}
        free = [colour for colour in COLOURS if colour not in sheet.colours.values()] or list(COLOURS)
        for k, point in enumerate(point for point in asked.points if not colours[point]):
            colours[point] = free[k % len(free)]
        shapes += path_panel(subject, colours, room, setting.words)
    return Diagram(tuple(shapes), page)


def _page_of(panels: int, has_paths: bool) -> tuple[float, float]:
    if panels and has_paths:
        return WIDE_MM
    return LANDSCAPE_MM if panels <= 2 else PORTRAIT_MM


def _sheet_of(subject: Subject, setting: Setting) -> _Sheet:
    cycle = subject.cycle
    told = as_told(subject, cycle.driven)
    step = max(1, math.ceil(told.size / DRAWN_AT_MOST))
    chosen = np.unique(np.append(np.arange(0, told.size, step), told.size - 1))
    margin = 0.0 if cycle.turns else 0.035 * float(told[-1] - told[0])
    view = (float(told[0]) - margin, float(told[-1]) + margin)
    return _Sheet(subject, setting, told[chosen], chosen, view, marks_of(subject, setting.words))


def as_told(subject: Subject, driven: FloatArray) -> FloatArray:
    """Driven coordinates in degrees or millimetres."""
    return np.asarray(np.degrees(driven) if subject.cycle.is_turned else 1e3 * driven)


def _heading(sheet: _Sheet) -> Iterator[Shape]:
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
    yield Label((LEFT_MM - 14.0, 11.0), ", ".join([title, *told]), TITLE_MM)
    rates = [("ω", "omega", "rad/s"), ("ε", "epsilon", "rad/s²")]
    if not sheet.subject.cycle.is_turned:
        rates = [("v", "speed", "m/s"), ("a", "acceleration", "m/s²")]
    x = LEFT_MM - 14.0
    for letter, name, unit in rates:
        value = float(getattr(driver, name)[0])
        if name in {"epsilon", "acceleration"} and value == 0.0:
            continue
        link = driver.link if sheet.subject.cycle.is_turned else driver.pin
        number = words.significant(value, 4)
        text = (Piece(letter), Piece(link, -1), Piece(f" = {number}\N{NO-BREAK SPACE}{words.unit(unit)}"))
        yield Label((x, 17.0), text, TEXT_MM, colour=GREY)
        x += width_of(text, TEXT_MM) + 6.0


# Marks over the panels ----------------------------------------------------------------------------


def _flagged(
    marks: Sequence[Mark], view: tuple[float, float], sides: tuple[float, float]
) -> Iterator[tuple[int, tuple[Mark, float, float]]]:
    """Each mark that has a text: its row, and where its line and its text stand; rows fill from below."""
    ends: list[float] = []
    for mark in sorted((mark for mark in marks if mark.text), key=lambda mark: mark.at):
        line = sides[0] + (mark.at - view[0]) * (sides[1] - sides[0]) / (view[1] - view[0])
        wide = width_of(mark.text, TICK_MM)
        start = min(max(line - wide / 2.0, sides[0] - 14.0), sides[1] + 8.0 - wide)
        row = next((row for row, end in enumerate(ends) if end + 2.5 < start), len(ends))
        if row == len(ends):
            ends.append(0.0)
        ends[row] = start + wide
        yield row, (mark, line, start)


def _flags(
    sheet: _Sheet,
    rows: Sequence[tuple[int, tuple[Mark, float, float]]],
    sides: tuple[float, float],
    heights: tuple[float, float],
) -> Iterator[Shape]:
    """Lines of the marks down through all panels, and their texts over them."""
    foot = heights[0] + ROW_MM * (1 + max((row for row, _ in rows), default=0)) - 1.0
    for mark in sheet.marks:
        x = sides[0] + (mark.at - sheet.view[0]) * (sides[1] - sides[0]) / (sheet.view[1] - sheet.view[0])
        yield Stroke((x, foot), (x, heights[1]), mark.width, mark.colour, mark.dash)
    for row, (mark, line, start) in rows:
        y = foot - 1.2 - ROW_MM * row
        if row:
            yield Stroke((line, y + 1.0), (line, foot), 0.13, mark.colour)
        yield Label((start, y), mark.text, TICK_MM, colour=mark.colour)


# A panel ------------------------------------------------------------------------------------------


def _panel(sheet: _Sheet, kind: Kind, quantities: Sequence[Quantity], box: Bounds) -> Iterator[Shape]:
    subject = sheet.subject
    lines = [_line(sheet, one) for one in quantities]
    own = [float(subject.values_at(one, np.array([subject.cycle.start]))[0]) for one in quantities]
    low, high = _heights(sheet, quantities, [values for _, values in lines], own)
    frame = Frame(box, sheet.view, (low, high))
    yield from _grid(sheet, frame, kind)
    curves = [list(cut(frame, across, values)) for across, values in lines]
    for one, pieces in zip(quantities, curves, strict=True):
        for piece in pieces:
            yield Curve(piece, 0.5, sheet.colour(one), DASHES[one.axis])
    (start,) = as_told(subject, np.array([subject.cycle.start]))
    for one, value in zip(quantities, own, strict=True):
        if low <= value <= high:
            yield Ring(frame.place(float(start), value), 0.8, 0.35, sheet.colour(one))
    yield from _names(sheet, frame, quantities, curves)


def _line(sheet: _Sheet, quantity: Quantity) -> tuple[FloatArray, FloatArray]:
    """Driven coordinates as told and values to draw; finer about the least lengths."""
    subject, driven = sheet.subject, sheet.subject.cycle.driven[sheet.chosen]
    values = subject.values(quantity)[sheet.chosen]
    inner = (values[1:-1] < values[:-2]) & (values[1:-1] <= values[2:])
    tips = np.flatnonzero(inner) + 1
    if quantity.axis or quantity.kind in {"omega", "epsilon"} or not 0 < tips.size <= TIPS:
        return sheet.across, values
    more = np.concatenate([np.linspace(driven[k - 1], driven[k + 1], TIPS)[1:-1] for k in tips])
    every = np.append(driven, more)
    order = np.argsort(every, kind="stable")
    found = np.append(values, subject.values_at(quantity, more))
    return as_told(subject, every[order]), found[order]


def _names(
    sheet: _Sheet, frame: Frame, quantities: Sequence[Quantity], curves: Sequence[Sequence[Sequence[Point]]]
) -> Iterator[Shape]:
    """The curves' names beside them."""
    _, top, _, bottom = frame.box
    lines = [
        ((float(frame.across(np.asarray(mark.at))), top), (float(frame.across(np.asarray(mark.at))), bottom))
        for mark in sheet.marks
    ]
    if frame.y[0] < 0.0 < frame.y[1]:
        zero = float(frame.down(np.asarray(0.0)))
        lines.append(((frame.box[0], zero), (frame.box[2], zero)))
    points = [dense(pieces) for pieces in curves]
    labelling = Labelling(frame.box, points, dense(lines), [])
    order = sorted(range(len(quantities)), key=lambda k: len(points[k]))
    for k in order:
        text = sheet.setting.shown(quantities[k].name)
        yield labelling.beside(k, Label((0.0, 0.0), text, NAME_MM, colour=sheet.colour(quantities[k])))


def _heights(
    sheet: _Sheet, quantities: Sequence[Quantity], values: Sequence[FloatArray], own: Sequence[float]
) -> tuple[float, float]:
    """Round values below and above all curves; of one without bound, its calm part and the variant's own."""
    lows, highs = [0.0], [0.0]
    for quantity, one, here in zip(quantities, values, own, strict=True):
        told = one[np.isfinite(one)]
        if not told.size:
            continue
        least, most = float(told.min()), float(told.max())
        size = np.abs(told)
        humps = size[1:-1][(size[1:-1] >= size[:-2]) & (size[1:-1] >= size[2:])]
        calm = max(float(np.quantile(size, CALM)), abs(here) if math.isfinite(here) else 0.0)
        reach = 1.15 * max([calm, *(hump for hump in humps if hump < SPIKE * calm)])
        if any(unbounded_ends(sheet.subject, quantity)) or max(-least, most) > SPIKE * reach:
            least, most = max(least, -reach), min(most, reach)
        lows.append(least)
        highs.append(most)
    low, high = min(lows), max(highs)
    span = high - low or 1.0
    step = step_of(span, 6.0)
    low, high = (low - 0.04 * span if low < 0.0 else 0.0), high + 0.04 * span
    return math.floor(low / step + 1e-6) * step, math.ceil(high / step - 1e-6) * step


def _grid(sheet: _Sheet, frame: Frame, kind: Kind) -> Iterator[Shape]:
    """Beyond the range shaded; thin lines at round values; the frame, the zero line; numbers and title."""
    left, top, right, bottom = frame.box
    words = sheet.setting.words
    first, last = (float(frame.across(np.asarray(end))) for end in (sheet.across[0], sheet.across[-1]))
    for start, end in ((left, first), (last, right)):
        if end - start > 0.01:
            yield Area(((start, top), (end, top), (end, bottom), (start, bottom)), SHADE)
    step = step_of(frame.y[1] - frame.y[0], 6.0)
    power = _power_of(max(abs(frame.y[0]), abs(frame.y[1])))
    digits = decimals_of(step / 10.0**power)
    for value in ticks(*frame.y, step):
        y = float(frame.down(np.asarray(value)))
        yield Stroke((left, y), (right, y), 0.13, GRID)
        text = words.number(float(value) / 10.0**power, digits)
        yield Label((left - 1.6, y + 0.36 * TICK_MM), text, TICK_MM, "end", GREY)
    for at in across_ticks(sheet.subject, sheet.view, right - left):
        x = float(frame.across(np.asarray(at)))
        yield Stroke((x, top), (x, bottom), 0.13, GRID)
        yield Stroke((x, bottom), (x, bottom + 1.0), 0.18, AXIS)
    if frame.y[0] < 0.0 < frame.y[1]:
        y = float(frame.down(np.asarray(0.0)))
        yield Stroke((left, y), (right, y), 0.25, AXIS)
    corners = ((left, top), (right, top), (right, bottom), (left, bottom), (left, top))
    yield Curve(corners, 0.25, AXIS)
    unit = words.unit(
        {"velocity": "m/s", "acceleration": "m/s²", "omega": "rad/s", "epsilon": "rad/s²"}[kind]
    )
    title: Text = (Piece(f"{words.gettext(TITLES[kind])}, "), Piece(unit))
    if power:
        title = (*title[:1], Piece("10"), Piece(str(power).replace("-", "−"), 1), Piece(f" {unit}"))
    label = Label((left, top - 1.8), title, TEXT_MM)
    _, above, end, below = label.bounds
    yield Area(((left - 0.3, above), (end + 0.5, above), (end + 0.5, below), (left - 0.3, below)), PAPER)
    yield label


def _power_of(largest: float) -> int:
    """The power of ten that stands with the unit, where numbers would be long."""
    if largest == 0.0 or 0.1 <= largest < 1e5:
        return 0
    return 3 * math.floor(math.log10(largest) / 3.0)


def across_ticks(subject: Subject, view: tuple[float, float], wide_mm: float) -> FloatArray:
    """Round driven coordinates, no nearer to each other than their numbers need."""
    steps = DEGREES if subject.cycle.is_turned else None
    return ticks(*view, step_of(view[1] - view[0], wide_mm / 13.0, steps))


def _below(sheet: _Sheet, box: Bounds) -> Iterator[Shape]:
    """Numbers and title of the axis that all panels share."""
    left, _, right, bottom = box
    frame = Frame(box, sheet.view, (0.0, 1.0))
    words = sheet.setting.words
    at = across_ticks(sheet.subject, sheet.view, right - left)
    digits = decimals_of(float(at[1] - at[0])) if at.size > 1 else 1
    for one in at:
        x = float(frame.across(np.asarray(one)))
        yield Label((x, bottom + 1.8 + TICK_MM), words.number(float(one), digits), TICK_MM, "middle", GREY)
    title = (
        words.gettext("crank angle, °")
        if sheet.subject.cycle.is_turned
        else words.gettext("displacement, mm")
    )
    yield Label((right, bottom + 3.4 + 2 * TICK_MM), title, TEXT_MM, "end")
