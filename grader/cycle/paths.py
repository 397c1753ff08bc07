"""The paths of points, true to a round scale, with the mechanism as this variant has it."""

import math
from collections.abc import Iterator, Mapping, Sequence

import numpy as np

from grader.cycle.axes import Frame, Labelling, decimals_of, dense, step_of, ticks
from grader.cycle.page import GREY, NAME_MM, TEXT_MM, TICK_MM
from grader.cycle.quantities import Subject
from grader.i18n import Tongue
from reference.canvas import Bounds, Curve, Label, Point, Ring, Shape, Stroke
from reference.geometry import ComplexArray
from reference.lettering import pieces_of
from reference.mechanism import Crank, Dyad, Plate, PointOnLine, Slider, SlotPoint, SlottedLink

SCALES = (1.0, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0)
LINK, GRID, AXIS = "#9aa3ad", "#e6e9ed", "#5b6470"
EVERY_DEG = 30
"""A dot on the path for so many degrees of the crank."""
ROOM = 0.93


def path_panel(subject: Subject, colours: Mapping[str, str], room: Bounds, words: Tongue) -> Iterator[Shape]:
    """Paths of some points, each in its colour, as large as a round scale allows in the room."""
    here = subject.motion_at(np.array([subject.cycle.start])).position
    places = {joint: complex(np.broadcast_to(at, (1,))[0]) for joint, at in here.items()}
    paths = {point: _path(subject, point) for point in colours}
    everything = np.concatenate([*paths.values(), np.array(list(places.values()))])
    frame, scale = _frame(everything[np.isfinite(everything)], room)
    yield from _grid(frame, words)
    title = words.gettext("Paths of points")
    yield Label(
        (frame.box[0], frame.box[1] - 1.8),
        f"{title}, {_ratio(scale, words)}",
        TEXT_MM,
    )
    bars = [[_at(frame, places[p]), _at(frame, places[q])] for p, q in _bars(subject)]
    for bar in bars:
        yield Stroke(bar[0], bar[1], 0.5, LINK)
    if subject.cycle.is_turned:
        told = words.gettext("a dot every 30° of the crank")
        yield Label((frame.box[0], frame.box[3] + 3.4 + 2 * TICK_MM), told, TICK_MM, colour=GREY)
    curves = []
    for point, path in paths.items():
        line = tuple(_at(frame, at) for at in path[np.isfinite(path)])
        curves.append(line)
        yield Curve(line, 0.5, colours[point])
        yield from _dots(subject, frame, point, colours[point])
    for joint, at in places.items():
        radius = 1.1 if subject.structure.is_ground(joint) else 0.7
        yield Ring(_at(frame, at), radius, 0.3, colours.get(joint, AXIS))
    yield from _names(subject, frame, places, colours, [*curves, *bars])


def _path(subject: Subject, point: str) -> ComplexArray:
    cycle = subject.cycle
    return np.array(np.broadcast_to(cycle.motion.position[point], cycle.driven.shape))


def _frame(everything: ComplexArray, room: Bounds) -> tuple[Frame, float]:
    """A frame about all points at a round scale; the scale, real metres per metre on paper."""
    wide, high = (room[2] - room[0]) * ROOM / 1e3, (room[3] - room[1]) * ROOM / 1e3
    x, y = (np.array([part.min(), part.max()]) for part in (everything.real, everything.imag))
    least = max(float(np.ptp(x)) / wide, float(np.ptp(y)) / high)
    power = 10.0 ** math.floor(math.log10(least)) if least > 0.0 else 1.0
    scale = next(part * power for part in (*SCALES, 10.0) if part * power >= least)
    pad = 8e-3 * scale
    x, y = x + np.array([-pad, pad]), y + np.array([-pad, pad])
    across, down = (1e3 * float(np.ptp(side)) / scale for side in (x, y))
    box = (room[0], room[1], room[0] + across, room[1] + down)
    return Frame(box, (float(x[0]), float(x[1])), (float(y[0]), float(y[1]))), scale


def _ratio(scale: float, words: Tongue) -> str:
    if scale >= 1.0:
        return f"1 : {words.trimmed(scale, 1)}"
    return f"{words.trimmed(1.0 / scale, 1)} : 1"


def _at(frame: Frame, place: complex) -> Point:
    return frame.place(place.real, place.imag)


def _grid(frame: Frame, words: Tongue) -> Iterator[Shape]:
    """Thin lines at round millimetres or metres, one step for both ways."""
    left, top, right, bottom = frame.box
    unit, factor = ("m", 1.0) if max(map(abs, (*frame.x, *frame.y))) >= 2.0 else ("mm", 1e3)
    step = step_of(factor * (frame.x[1] - frame.x[0]), max(2.0, (right - left) / 13.0))
    digits = decimals_of(step)
    for at in ticks(factor * frame.x[0], factor * frame.x[1], step):
        x = float(frame.across(np.asarray(at / factor)))
        yield Stroke((x, top), (x, bottom), 0.13, GRID)
        yield Label((x, bottom + 1.8 + TICK_MM), words.number(float(at), digits), TICK_MM, "middle", GREY)
    for at in ticks(factor * frame.y[0], factor * frame.y[1], step):
        y = float(frame.down(np.asarray(at / factor)))
        yield Stroke((left, y), (right, y), 0.13, GRID)
        yield Label((left - 1.6, y + 0.36 * TICK_MM), words.number(float(at), digits), TICK_MM, "end", GREY)
    yield Curve(((left, top), (right, top), (right, bottom), (left, bottom), (left, top)), 0.25, AXIS)
    yield Label((right, bottom + 3.4 + 2 * TICK_MM), f"x, y, {words.unit(unit)}", TEXT_MM, "end")


def _bars(subject: Subject) -> list[tuple[str, str]]:
    """Joints that a rigid link keeps apart, as lines of the sketch."""
    mechanism = subject.structure
    bars = []
    if isinstance(mechanism.driver, Crank):
        bars.append((mechanism.driver.pivot, mechanism.driver.pin))
    for group in mechanism.groups:
        match group:
            case Dyad(node=node, pins=ends) | Plate(node=node, base=ends) | PointOnLine(node=node, base=ends):
                bars += [(end, node) for end in ends]
            case Slider(node=node, pin=pin):
                bars.append((pin, node))
            case SlottedLink(node=node, pivot=pivot):
                bars.append((pivot, node))
            case SlotPoint(node=node, slotted=slotted):
                bars.append((slotted, node))
            case _:
                pass
    return bars


def _dots(subject: Subject, frame: Frame, point: str, colour: str) -> Iterator[Shape]:
    """Where the point is at round crank angles."""
    cycle = subject.cycle
    if not cycle.is_turned:
        return
    low, high = np.degrees(cycle.driven[[0, -1]])
    angles = ticks(float(low), float(high) - (1e-6 if cycle.turns else 0.0), EVERY_DEG)
    for at in subject.motion_at(np.radians(angles)).position[point]:
        if np.isfinite(at):
            yield Ring(_at(frame, complex(at)), 0.45, 0.2, colour, colour)


def _names(
    subject: Subject,
    frame: Frame,
    places: Mapping[str, complex],
    colours: Mapping[str, str],
    lines: Sequence[Sequence[Point]],
) -> Iterator[Shape]:
    """Letters of the pivots and of the points whose paths are drawn, beside them."""
    named = [joint for joint in places if joint in colours or subject.structure.is_ground(joint)]
    spots = [np.array([_at(frame, places[joint])]) for joint in named]
    rings = [_ring(_at(frame, at)) for at in places.values()]
    labelling = Labelling(frame.box, spots, dense([*lines, *rings]), [])
    for k, joint in enumerate(named):
        colour = colours.get(joint, GREY)
        yield labelling.beside(k, Label((0.0, 0.0), pieces_of(joint), NAME_MM, colour=colour))


def _ring(at: Point) -> list[Point]:
    """Points about a joint, where no letter should stand."""
    return [
        (at[0] + 1.3 * math.cos(turn * math.pi / 6.0), at[1] + 1.3 * math.sin(turn * math.pi / 6.0))
        for turn in range(13)
    ]
