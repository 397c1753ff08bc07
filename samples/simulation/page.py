"""A sheet of A3: frame, title block, layout of the figures, captions and calculations."""

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from reference.quantities import FORCE_PLANS, zone_of
from samples.simulation import wording
from samples.simulation.figures import extent
from samples.simulation.hand import DrawingTask, DrawnFigure
from samples.simulation.settings import Box
from samples.simulation.sketch import SQUARES_LAYER, SheetSketch
from samples.simulation.strokes import ComplexArray, PenWidth, Rng, straight

PAPER_MM = (420.0, 297.0)
FRAMES_MM: Mapping[str, Box] = {
    "iso": (20.0, 10.0, 390.0, 277.0),
    "gost": (20.0, 5.0, 395.0, 287.0),
    "none": (12.0, 12.0, 396.0, 273.0),
}
TITLE_MM = {"rows": (178.0, 44.0), "form": (185.0, 55.0), "none": (0.0, 0.0)}
_MARGIN_MM = 13.0
"""Room for letters and arrows around a figure's nodes."""


@dataclass(frozen=True, slots=True)
class Frame:
    """The frame as drawn: its kind and its four corners (top left first, clockwise), None where absent."""

    kind: str
    by: str
    corners: tuple[complex, ...] | None


def print_squares(sketch: SheetSketch) -> None:
    """Print the fine lines of squared paper, skewed, turned and bent as the page says."""
    style = sketch.page
    pitch = style.squared_mm
    if pitch <= 0.0:
        return
    turn = complex(np.exp(1j * (sketch.rng.normal(0.0, 0.003) + np.radians(style.squares_turn_deg))))
    start = sketch.rng.uniform(0.0, pitch, 2)
    w, h = PAPER_MM
    # Turned paper is larger than the sheet.
    more = abs(turn.imag) * w
    low, beyond = start - pitch * np.ceil(more / pitch), more + 4.0
    lines = [(complex(x, beyond), complex(x, -h - beyond)) for x in np.arange(low[0], w + more, pitch)]
    level = [(complex(-beyond, -y), complex(w + beyond, -y)) for y in np.arange(low[1], h + more, pitch)]
    for number, (p, q) in [*enumerate(lines), *enumerate(level)]:
        dark = style.squares_dark * (1.0 if pitch > 2.0 or number % 5 == 0 else 7.0 / 12.0)
        pen = PenWidth(SQUARES_LAYER, style.squares_width_mm, dark, 0.0, 0.0)
        line = straight(sketch.rng, pen, p * turn, q * turn)
        sketch.strokes.append(replace(line, points=line.points + _bend(line.points, style.squares_bent_mm)))


def _bend(points: ComplexArray, by_mm: float) -> ComplexArray:
    """Displacements of points on paper fed unevenly by a copier, or distorted by a lens."""
    x, y = points.real / PAPER_MM[0], points.imag / PAPER_MM[1]
    return np.asarray(by_mm * (np.sin(4.1 * y + 0.7 * x) + 1j * np.sin(3.7 * x - 1.1 * y + 0.5)))


def draw_frame(sketch: SheetSketch) -> Frame:
    """Draw the frame, ruled by hand with small errors, or printed exactly."""
    style = sketch.page
    if style.frame == "none":
        return Frame("none", "nobody", None)
    x, y, w, h = FRAMES_MM[style.frame]
    corners = [complex(x, -y), complex(x + w, -y), complex(x + w, -y - h), complex(x, -y - h)]
    printed = style.frame_by == "print"
    if not printed:
        miss = max(0.12, 1.4 * sketch.hand.reading_mm)
        corners = [c + complex(*sketch.rng.normal(0.0, miss, 2)) for c in corners]
    pen = sketch.pen("print" if printed else "line")
    for p, q in zip(corners, corners[1:] + corners[:1], strict=True):
        past = (q - p) / abs(q - p) * (0.0 if printed else float(sketch.rng.exponential(0.6)))
        sketch.line(pen, p - past, q + past)
    return Frame(style.frame, style.frame_by, tuple(corners))


def title_block(sketch: SheetSketch, rows: list[list[str]], corner: complex) -> Box | None:
    """Draw a title block in the frame's lower right corner; its box in sheet millimetres, y down."""
    kind = sketch.page.title_block
    if kind == "none":
        return None
    wide, high = TITLE_MM[kind]
    printed = sketch.page.frame_by == "print"
    low = corner - wide
    pen = sketch.pen("print" if printed else "line")
    x0 = low.real + (62.0 if kind == "form" else 0.0)
    top = low + 1j * high
    sketch.line(pen, low, top)
    sketch.line(pen, top, top + wide)
    if sketch.page.frame == "none":
        sketch.line(pen, low, corner)
        sketch.line(pen, corner, corner + 1j * high)
    if kind == "form":
        _form_columns(sketch, low, high, x0)
    depth = high / len(rows)
    for index, cells in enumerate(rows):
        y = top.imag - index * depth
        if index:
            sketch.line(pen, complex(x0, y), complex(corner.real, y))
        _cells(sketch, cells, (x0, y, corner.real - x0, depth))
    return (low.real, -top.imag, wide, high)


def _form_columns(sketch: SheetSketch, low: complex, high: float, x1: float) -> None:
    """Draw the narrow columns of signatures at the left of a form."""
    thin = sketch.pen("print" if sketch.page.frame_by == "print" else "thin")
    thick = sketch.pen("print" if sketch.page.frame_by == "print" else "line")
    for x in (low.real + 7.0, low.real + 17.0, low.real + 40.0, x1):
        sketch.line(thick, complex(x, low.imag), complex(x, low.imag + high))
    for index in range(1, 11):
        y = low.imag + index * high / 11.0
        sketch.line(thin, complex(low.real, y), complex(x1, y))


def _cells(sketch: SheetSketch, cells: list[str], box: Box) -> None:
    x, y, w, h = box
    shares = np.cumsum([0.0, *(len(cell) + 6.0 for cell in cells)])
    shares /= shares[-1]
    pen = sketch.pen("print" if sketch.page.frame_by == "print" else "line")
    height = min(sketch.page.letter_mm * 0.9, 0.45 * h)
    for index, cell in enumerate(cells):
        left, right = x + w * shares[index], x + w * shares[index + 1]
        if index:
            sketch.line(pen, complex(left, y), complex(left, y - h))
        fitting = min(height, (right - left - 4.0) / max(1, len(cell)) / 0.62)
        base = complex(left + 2.0, y - 0.5 * h - 0.4 * fitting)
        sketch.text(base, cell, fitting)


# Layout -------------------------------------------------------------------------------------------


def place_figures(
    figures: tuple[DrawnFigure, ...], room: Box, taken: list[Box], rng: Rng
) -> dict[str, complex] | None:
    """Origins of the figures, at random without overlap; None where they do not fit.

    Arguments: `room` and `taken` are boxes in sheet millimetres, y down.
    """
    for margin in (_MARGIN_MM, 0.75 * _MARGIN_MM, 0.5 * _MARGIN_MM):
        for _ in range(150):
            origins = _one_layout(figures, room, list(taken), rng, margin)
            if origins is not None:
                return origins
    return None


def _one_layout(
    figures: tuple[DrawnFigure, ...], room: Box, taken: list[Box], rng: Rng, margin: float
) -> dict[str, complex] | None:
    origins: dict[str, complex] = {}
    order = sorted(figures, key=lambda f: -_size(f) * rng.uniform(0.6, 1.4))
    for figure in order:
        low, high = extent(figure.nodes)
        w, h = (high - low).real + 2 * margin, (high - low).imag + 2 * margin
        if w > room[2] or h > room[3]:
            return None
        for _ in range(12):
            x = room[0] + rng.uniform(0.0, room[2] - w)
            y = room[1] + rng.uniform(0.0, room[3] - h)
            if not any(overlap((x, y, w, h), box) for box in taken):
                taken.append((x, y, w, h))
                origins[figure.name] = complex(x + margin, -y - margin) - complex(low.real, high.imag)
                break
        else:
            return None
    return origins


def _size(figure: DrawnFigure) -> float:
    low, high = extent(figure.nodes)
    return abs(high - low)


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share area."""
    return (
        one[0] < other[0] + other[2]
        and other[0] < one[0] + one[2]
        and one[1] < other[1] + other[3]
        and other[1] < one[1] + one[3]
    )


def place_in_zones(
    figures: tuple[DrawnFigure, ...], zones: Mapping[str, Box], rng: Rng
) -> dict[str, complex]:
    """Origins of the figures near the middles of a printed sheet's zones; force plans share theirs."""
    origins = {}
    plans = tuple(figure for figure in figures if zone_of(figure.name) == FORCE_PLANS)
    if len(plans) > 1:
        origins = place_figures(plans, zones[FORCE_PLANS], [], rng) or {}
    for figure in (one for one in figures if one.name not in origins):
        x, y, w, h = zones[zone_of(figure.name)]
        low, high = extent(figure.nodes)
        slack = max(0.0, w - (high - low).real - 16.0), max(0.0, h - (high - low).imag - 16.0)
        middle = complex(x + w / 2, -y - h / 2) + complex(
            rng.uniform(-0.4, 0.4) * slack[0], rng.uniform(-0.4, 0.4) * slack[1]
        )
        origins[figure.name] = middle - (low + high) / 2.0
    return origins


def write_caption(
    sketch: SheetSketch, task: DrawingTask, figure: str, nodes: Mapping[str, complex], written: dict[str, str]
) -> None:
    """Write the figure's caption above it (or below), with its scale if the student writes it there."""
    low, high = extent(nodes)
    lines = wording.caption(figure, task, sketch.page, sketch.rng, written)
    height = 0.95 * sketch.page.letter_mm
    top = high.imag + 9.0 + 1.6 * height * (len(lines) - 1)
    if top > -12.0:
        top = low.imag - 9.0 - height
    for index, text in enumerate(lines):
        sketch.text(complex(max(low.real, 26.0), top - 1.6 * height * index), text, height)


def write_block(sketch: SheetSketch, lines: list[str], room: Box, taken: list[Box]) -> None:
    """Write calculations where there is room for them, or not at all."""
    if not lines:
        return
    height = 0.8 * sketch.page.letter_mm
    size = max(len(line) for line in lines) * 0.5 * height, len(lines) * 1.9 * height
    place = free_place(size, room, taken, sketch.rng)
    if place is None:
        return
    taken.append((*place, *size))
    for index, line in enumerate(lines):
        sketch.text(complex(place[0], -place[1] - (index + 1) * 1.9 * height), line, height)


def free_place(
    size: tuple[float, float], room: Box, taken: list[Box], rng: Rng
) -> tuple[float, float] | None:
    """The top left corner of a free box of this size, None where none was found."""
    if size[0] > room[2] or size[1] > room[3]:
        return None
    for _ in range(60):
        x = room[0] + rng.uniform(0.0, room[2] - size[0])
        y = room[1] + rng.uniform(0.0, room[3] - size[1])
        if not any(overlap((x, y, *size), box) for box in taken):
            return x, y
    return None
