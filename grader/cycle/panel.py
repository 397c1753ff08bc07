"""One panel of a diagram: quantities of a kind over the driven coordinate."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from grader.cycle.axes import DEGREES, Frame, Labelling, cut, decimals_of, dense, step_of, ticks
from grader.cycle.page import GREY, NAME_MM, TEXT_MM, TICK_MM, Sheet, as_told
from grader.cycle.quantities import UNITS, Kind, Quantity, Subject
from grader.cycle.strokes import unbounded_ends
from grader.i18n import N_
from reference.canvas import PAPER, Area, Bounds, Curve, Label, Point, Ring, Shape, Stroke
from reference.geometry import FloatArray
from reference.lettering import Piece, Text

GRID, AXIS, SHADE = "#dfe3e8", "#5b6470", "#eceff2"
DASHES: dict[str, tuple[float, ...]] = {"": (), "x": (3.0, 1.2), "y": (0.6, 1.2)}
TITLES: dict[Kind, str] = {
    "velocity": N_("Velocities"),
    "acceleration": N_("Accelerations"),
    "omega": N_("Angular velocities"),
    "epsilon": N_("Angular accelerations"),
}
CALM = 0.8
"""So much of its samples is shown at least of a curve that grows without bound, with all of its humps."""
SPIKE = 8.0
"""A value so many times the calm ones is beyond the frame as well."""
TIPS = 33
"""Positions about a least length, where its curve has a sharp tip that samples would blunt."""


def panel(sheet: Sheet, kind: Kind, quantities: Sequence[Quantity], box: Bounds) -> Iterator[Shape]:
    """Curves of quantities of one kind, their names beside them, a ring on each where the variant is."""
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


def _line(sheet: Sheet, quantity: Quantity) -> tuple[FloatArray, FloatArray]:
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
    sheet: Sheet, frame: Frame, quantities: Sequence[Quantity], curves: Sequence[Sequence[Sequence[Point]]]
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
    sheet: Sheet, quantities: Sequence[Quantity], values: Sequence[FloatArray], own: Sequence[float]
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


def _grid(sheet: Sheet, frame: Frame, kind: Kind) -> Iterator[Shape]:
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
    unit = words.unit(UNITS[kind])
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


def below(sheet: Sheet, box: Bounds) -> Iterator[Shape]:
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
