"""Extras that people leave on a sheet: helper lines, dimensions, corrections, other figures."""

from collections.abc import Mapping, Sequence
from typing import get_args

import numpy as np

from samples.simulation import symbols
from samples.simulation.figures import extent
from samples.simulation.hand import DrawingTask, Nodes
from samples.simulation.page import free_place
from samples.simulation.settings import MECHANISM, Box, Habit
from samples.simulation.sketch import MAIN_LAYER, Segment, SheetSketch
from samples.simulation.strokes import PenWidth

HABITS: tuple[str, ...] = get_args(Habit)
_NEARER = 0.45
"""Shift of an overlapping plan towards the sketch, as a share of their distance."""
_LEAST_MM = 12.0
"""Shorter vectors are not drawn twice, and shorter links have no dimension."""


def overlapped(origins: Mapping[str, complex], room: Box) -> dict[str, complex]:
    """Origins with the plans moved so that they overlap the sketch, or the first figure."""
    to = origins.get(MECHANISM, next(iter(origins.values())))
    inside = complex(room[0], -room[1] - room[3]), complex(room[0] + room[2], -room[1])
    moved = {name: at + _NEARER * (to - at) for name, at in origins.items()}
    return moved if all(_within(at, inside) for at in moved.values()) else dict(origins)


def _within(at: complex, corners: tuple[complex, complex]) -> bool:
    low, high = corners
    return low.real < at.real < high.real and low.imag < at.imag < high.imag


def add(
    sketch: SheetSketch,
    task: DrawingTask,
    nodes: Mapping[str, Nodes],
    habits: Sequence[Habit],
    space: tuple[Box, list[Box]],
) -> None:
    """Draw what the habits say onto a sheet that has its figures.

    Arguments: `nodes` of each figure on the sheet; `space` is where figures may go, and what is taken.
    """
    room, taken = space
    for figure, own in nodes.items():
        vectors = [(f, v) for f, v in sketch.lines.items() if f[0] == figure and abs(v[1] - v[0]) > _LEAST_MM]
        if figure != MECHANISM:
            pole = own[task.wrong.construction.poles[figure]]
            if "erased" in habits:
                _erased(sketch, [line for _, line in vectors])
            if "struck" in habits and vectors:
                _struck(sketch, vectors[sketch.rng.integers(len(vectors))][1])
            if "long helpers" in habits:
                _long_helpers(sketch, figure, pole, [line for _, line in vectors], room)
        if "dimensions" in habits:
            low, high = extent(own)
            for _, line in vectors[:3]:
                _dimension(sketch, line, (low + high) / 2.0)
    if "hatched sections" in habits:
        for _ in range(2):
            _section(sketch, room, taken)
    if "third figure" in habits:
        _third_figure(sketch, room, taken)


def _turned(sketch: SheetSketch, line: Segment, low_deg: float, high_deg: float) -> complex:
    """The end of a line redrawn from its start in another direction, somewhat longer or shorter."""
    angle = np.radians(sketch.rng.uniform(low_deg, high_deg) * sketch.rng.choice([-1.0, 1.0]))
    return line[0] + (line[1] - line[0]) * complex(np.exp(1j * angle)) * float(sketch.rng.uniform(0.8, 1.2))


def _erased(sketch: SheetSketch, lines: Sequence[Segment]) -> None:
    """Draw wrong vectors that were rubbed out: lines and heads still visible."""
    pen = PenWidth(MAIN_LAYER, 1.3 * sketch.style.line_mm, sketch.rng.uniform(0.12, 0.22), 0.5, 0.06)
    for line in lines:
        if sketch.chance(0.6):
            tip = _turned(sketch, line, 3.0, 20.0)
            sketch.line(pen, line[0], tip)
            symbols.arrowhead(sketch, pen, line[0], tip, sketch.style.arrow_mm)


def _struck(sketch: SheetSketch, line: Segment) -> None:
    """Draw a wrong vector beside the right one, struck through by three or four slashes."""
    pen, tip = sketch.pen("line", plan=True), _turned(sketch, line, 5.0, 22.0)
    sketch.line(pen, line[0], tip)
    symbols.arrowhead(sketch, pen, line[0], tip, sketch.style.arrow_mm)
    along = (tip - line[0]) / abs(tip - line[0])
    slash = along * complex(np.exp(1j * sketch.rng.uniform(0.8, 1.3)))
    for share in np.linspace(0.35, 0.7, int(sketch.rng.integers(3, 5))):
        middle = line[0] + share * (tip - line[0])
        reach = sketch.rng.uniform(1.8, 3.2, 2)
        sketch.line(pen, middle - reach[0] * slash, middle + reach[1] * slash)


def _long_helpers(
    sketch: SheetSketch, figure: str, pole: complex, lines: Sequence[Segment], room: Box
) -> None:
    """Draw thin lines through the pole along two of the vectors, to the edge of the drawing."""
    for index in sketch.rng.permutation(len(lines))[:2].tolist():
        span = lines[index][1] - lines[index][0]
        along = span / abs(span)
        ends = pole - sketch.rng.uniform(3.0, 15.0) * along, pole + _to_edge(pole, along, room) * along
        sketch.line(sketch.pen("thin", plan=True), *ends)
        sketch.construction.setdefault(figure, []).append(ends)


def _to_edge(at: complex, along: complex, room: Box) -> float:
    """The distance from a point in a direction to the side of a box."""
    x, y, w, h = room
    across = ((x + w if along.real > 0 else x) - at.real) / along.real if along.real else np.inf
    down = ((-y if along.imag > 0 else -y - h) - at.imag) / along.imag if along.imag else np.inf
    return float(max(min(across, down), 0.0))


def _dimension(sketch: SheetSketch, line: Segment, middle: complex) -> None:
    """Draw a dimension outside a figure: its line, two extension lines, arrowheads and digits."""
    p, q = line
    along = (q - p) / abs(q - p)
    out = 1j * along if ((1j * along).conjugate() * ((p + q) / 2.0 - middle)).real > 0 else -1j * along
    gap = out * sketch.rng.uniform(8.0, 13.0)
    pen = sketch.pen("thin")
    for end in (p, q):
        sketch.line(pen, end + 1.5 * out, end + gap + 2.0 * out)
    for tail, tip in ((p + gap, q + gap), (q + gap, p + gap)):
        symbols.arrowhead(sketch, pen, tail, tip, 2.5)
    sketch.line(pen, p + gap, q + gap)
    height = 0.75 * sketch.page.letter_mm
    sketch.text((p + q) / 2.0 + gap + 1.2 * out - height, f"{abs(q - p):.0f}", height)


def _section(sketch: SheetSketch, room: Box, taken: list[Box]) -> None:
    """Draw a hatched cross-section of some part, which nobody asked for."""
    wide, high = sketch.rng.uniform(16.0, 40.0), sketch.rng.uniform(10.0, 22.0)
    place = free_place((wide + 4.0, high + 4.0), room, taken, sketch.rng)
    if place is None:
        return
    taken.append((*place, wide + 4.0, high + 4.0))
    low = complex(place[0] + 2.0, -place[1] - 2.0 - high)
    corners = (low, low + wide, low + complex(wide, high), low + 1j * high)
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        sketch.line(sketch.pen("line"), p, q)
    gap = sketch.rng.uniform(1.2, 3.0)
    for half in (corners[:3], (corners[2], corners[3], corners[0])):
        symbols.inside_hatching(sketch, half, gap)


def _third_figure(sketch: SheetSketch, room: Box, taken: list[Box]) -> None:
    """Draw a force polygon with arrowheads and letters: a plan, but none of those asked for."""
    size = float(sketch.rng.uniform(35.0, 60.0))
    place = free_place((size + 16.0, size + 16.0), room, taken, sketch.rng)
    if place is None:
        return
    taken.append((*place, size + 16.0, size + 16.0))
    middle = complex(place[0], -place[1]) + complex(1.0, -1.0) * (size / 2.0 + 8.0)
    angles = np.sort(sketch.rng.uniform(0.0, 2.0 * np.pi, 5))
    corners = middle + size / 2.0 * sketch.rng.uniform(0.6, 1.0, 5) * np.exp(1j * angles)
    pen = sketch.pen("line", plan=True)
    for number, (p, q) in enumerate(zip(corners, np.roll(corners, -1), strict=True), start=1):
        sketch.line(pen, complex(p), complex(q))
        symbols.arrowhead(sketch, pen, complex(p), complex(q), sketch.style.arrow_mm)
        half = complex(p + q) / 2.0
        sketch.letter(half, f"F_{number}", 0.9 * sketch.page.letter_mm, names="", distance_mm=1.0)
