"""The reference drawing: mechanism, velocity plan and acceleration plan as a good hand would draw them."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from reference.assignment import Assignment
from reference.canvas import CONSTRUCTION, INK, Area, Label, Point, Ring, Shape, Stroke
from reference.geometry import direction
from reference.mechanism import Crank, Dyad, Plate, PointOnLine, Slider
from reference.plan import ZERO_SHARE, Plan
from reference.steps import TwoLines, View

FRAME = (20.0, 10.0, 410.0, 287.0)
GAP_MM = 16.0
JOINT_RADIUS_MM = 1.3
OVERRUN_MM = 7.0
ARROW_MM = (3.2, 0.75)
LETTER_MM = 3.6
COLOURS = {"mechanism": INK, "velocity_plan": "#1456a0", "acceleration_plan": "#a03014"}


@dataclass(frozen=True, slots=True)
class _Placed:
    """A figure's nodes on the sheet: complex millimetres, y up, negative below the sheet's top."""

    nodes: Mapping[str, complex]

    def at(self, node: str) -> Point:
        return _point(self.nodes[node])


def _point(z: complex) -> Point:
    return (float(z.real), float(-z.imag))


@dataclass(frozen=True, slots=True)
class Sheet:
    """One A3 sheet of the reference drawing; `fits` is False where a figure is too large for it."""

    shapes: tuple[Shape, ...]
    fits: bool


def reference_drawing(assignment: Assignment, plan: Plan, index: int = 0) -> list[Sheet]:
    """The drawing of one variant of a plan on A3, true to scale.

    All on one sheet where it fits, else on the sheets that the assignment asks for, else a figure a
    sheet. A figure that is too large even so at its scales is told in red on the drawing.
    """
    every = tuple(plan.nodes_mm)
    pages = tuple(tuple(name for name in page.figures if name in every) for page in assignment.file.page)
    for layout in ((every,), pages, tuple((name,) for name in every)):
        sheets = [_sheet(assignment, plan, names, index) for names in layout if names]
        if all(sheet.fits for sheet in sheets):
            break
    return sheets


def _sheet(assignment: Assignment, plan: Plan, names: tuple[str, ...], index: int) -> Sheet:
    count = len(plan.variants)
    figures = {
        name: {
            node: complex(np.broadcast_to(at, (count,))[index]) for node, at in plan.nodes_mm[name].items()
        }
        for name in names
    }
    placed, fits = _lay_out(figures)
    x0, y0, x1, y1 = FRAME
    corners = ((x0, y0), (x1, y0), (x1, y1), (x0, y1))
    shapes: list[Shape] = [Stroke(corner, corners[(i + 1) % 4], 0.7) for i, corner in enumerate(corners)]
    for name in names:
        if name == "mechanism":
            shapes.extend(_mechanism(plan, placed[name], index))
        else:
            shapes.extend(_plan_figure(assignment, plan, name, placed[name], index))
    shapes.extend(_table(assignment, plan, names, index))
    if not fits:
        message = "does not fit A3 at these scales"
        shapes.append(Label((x0 + 5, y1 - 5), message, 5.0, colour="#c00000"))
    return Sheet(tuple(shapes), fits)


def _lay_out(figures: Mapping[str, Mapping[str, complex]]) -> tuple[dict[str, _Placed], bool]:
    """Put the figures side by side in rows, the table's column on the right kept free."""
    left, top, right, bottom = FRAME[0] + GAP_MM, FRAME[1] + GAP_MM, FRAME[2] - 84.0, FRAME[3] - GAP_MM
    x, y, row = left, top, 0.0
    placed, fits = {}, True
    for name, nodes in figures.items():
        places = np.array(list(nodes.values()))
        width, height = np.ptp(places.real), np.ptp(places.imag)
        if x > left and x + width > right:
            x, y, row = left, y + row + 2 * GAP_MM, 0.0
        corner = complex(places.real.min(), places.imag.max())
        shift = complex(x, -y) - corner
        placed[name] = _Placed({node: z + shift for node, z in nodes.items()})
        fits = fits and x + width <= right and y + height <= bottom
        x, row = x + width + 2 * GAP_MM, max(row, height)
    return placed, bool(fits)


def _mechanism(plan: Plan, figure: _Placed, index: int) -> Iterator[Shape]:
    mechanism = plan.mechanism
    for group in mechanism.groups:
        match group:
            case Plate(node=node, base=(p, q)):
                yield Area((figure.at(p), figure.at(q), figure.at(node)), "#eef1f4")
            case Slider():
                yield from _guide(group, figure, index)
    for tail, head in _links(plan):
        yield Stroke(figure.at(tail), figure.at(head), 0.6)
    for joint in mechanism.ground_m:
        yield from _pivot(figure.at(joint))
    for joint in mechanism.joints:
        yield Ring(figure.at(joint), JOINT_RADIUS_MM)
    feet = [figure.nodes[joint] - 4j for joint in mechanism.ground_m]
    yield from _letters(figure.nodes, {}, INK, feet)
    yield Label(_caption_place(figure), f"kL = {_number(plan.scales.kL, index)} m/mm", 3.5)


def _links(plan: Plan) -> Iterator[tuple[str, str]]:
    crank: Crank = plan.mechanism.crank
    yield crank.pivot, crank.pin
    for group in plan.mechanism.groups:
        match group:
            case Dyad(node=node, pins=pins) | Plate(node=node, base=pins):
                yield from ((pin, node) for pin in pins)
            case PointOnLine(node=node, base=(p, q)):
                yield from ((p, node), (q, node))
            case Slider(node=node, pin=pin):
                yield pin, node


def _pivot(at: Point) -> Iterator[Shape]:
    x, y = at
    base = ((x - 3.0, y + 5.0), (x + 3.0, y + 5.0))
    yield Area((at, *base), "#ffffff", 0.35)
    yield from _hatching(complex(x - 4.5, -(y + 5.0)), complex(x + 4.5, -(y + 5.0)))


def _hatching(start: complex, end: complex) -> Iterator[Shape]:
    """A ground line with hatching to its right-hand side."""
    yield Stroke(_point(start), _point(end), 0.35)
    along = (end - start) / abs(end - start)
    for step in np.arange(0.0, abs(end - start), 1.8):
        foot = start + along * step
        yield Stroke(_point(foot), _point(foot - along * 1.4 - 1j * along * 1.8), 0.18)


def _guide(slider: Slider, figure: _Placed, index: int) -> Iterator[Shape]:
    along, at = complex(direction(np.asarray(_one(slider.guide_rad, index)))), figure.nodes[slider.node]
    for side in (1, -1):
        start, end = at - 14 * along, at + 14 * along
        offset = 1j * along * 3.0 * side
        yield from _hatching(
            *((start + offset, end + offset) if side < 0 else (end + offset, start + offset))
        )
    corners = (4 + 2.6j, -4 + 2.6j, -4 - 2.6j, 4 - 2.6j)
    yield Area(tuple(_point(at + along * corner) for corner in corners), "#ffffff", 0.5)


def _plan_figure(
    assignment: Assignment, plan: Plan, figure: str, placed: _Placed, index: int
) -> Iterator[Shape]:
    colour = COLOURS[figure]
    yield from _construction_lines(plan, figure, placed, index)
    size = float(plan.size_mm(figure)[index])
    for vector in plan.construction.vectors_of(figure):
        start, end = placed.nodes[vector.tail], placed.nodes[vector.head]
        if abs(end - start) > max(ZERO_SHARE * size, 1e-6):
            yield from _arrow(start, end, colour)
    yield from _letters(placed.nodes, assignment.file.names, colour)
    scale = "kv" if figure == "velocity_plan" else "ka"
    unit = "(m/s)/mm" if scale == "kv" else "(m/s²)/mm"
    told = assignment.file.names.get(scale, scale)
    value = _number(getattr(plan.scales, scale), index)
    yield Label(_caption_place(placed), f"{told} = {value} {unit}", 3.5, colour=colour)


def _construction_lines(plan: Plan, figure: str, placed: _Placed, index: int) -> Iterator[Shape]:
    view = View(
        {name: np.asarray(z[index]) for nodes in plan.nodes_mm.values() for name, z in _full(plan, nodes)},
        {
            name: np.broadcast_to(v, (len(plan.variants),))[index]
            for name, v in plan.drawing.parameters.items()
        },
    )
    for step in plan.construction.figures[figure]:
        if isinstance(step, TwoLines):
            for line in (step.first, step.second):
                foot, node = placed.nodes[line.through], placed.nodes[step.node]
                along = complex(line.along.at(view))
                sign = 1.0 if (np.conj(along) * (node - foot)).real >= 0 else -1.0
                yield Stroke(_point(foot), _point(node + sign * OVERRUN_MM * along), 0.13, CONSTRUCTION)


def _full(plan: Plan, nodes: Mapping[str, np.ndarray]) -> Iterator[tuple[str, np.ndarray]]:
    return ((name, np.broadcast_to(z, (len(plan.variants),))) for name, z in nodes.items())


def _arrow(start: complex, end: complex, colour: str) -> Iterator[Shape]:
    along = (end - start) / abs(end - start)
    length = min(ARROW_MM[0], 0.5 * abs(end - start))
    width = ARROW_MM[1] * length / ARROW_MM[0]
    neck = end - along * length
    yield Stroke(_point(start), _point(neck), 0.35, colour)
    yield Area((_point(end), _point(neck + 1j * along * width), _point(neck - 1j * along * width)), colour)


def _letters(
    nodes: Mapping[str, complex], names: Mapping[str, str], colour: str, occupied: Sequence[complex] = ()
) -> Iterator[Shape]:
    """A letter at each node: in the nearest free place, away from the middle of the figure first."""
    middle = sum(nodes.values()) / len(nodes)
    taken: list[tuple[complex, float]] = [(at, 1.5) for at in (*nodes.values(), *occupied)]
    for node, at in nodes.items():
        text = names.get(node, node)
        half_width = 0.31 * LETTER_MM * len(text)
        place = min(
            _places_around(at, middle, half_width),
            key=lambda place: _crowding(place, half_width, taken) + 0.1 * abs(place - at),
        )
        taken.append((place, half_width))
        yield Label((place.real, -place.imag + 1.2), text, LETTER_MM, "middle", colour, italic=True)


def _places_around(at: complex, middle: complex, half_width: float) -> Iterator[complex]:
    away = at - middle
    outward = away / abs(away) if abs(away) > 1e-9 else 1.0
    for reach in (3.4, 6.0, 9.0, 13.0):
        for turn in (0, 1, -1, 2, -2, 3, -3, 4):
            along = outward * np.exp(1j * np.pi / 4 * turn)
            yield at + complex(along.real * (reach + half_width), along.imag * reach)


def _crowding(place: complex, half_width: float, taken: list[tuple[complex, float]]) -> float:
    """How much a letter here would overlap what is there already, in millimetres."""
    overlaps = (
        min(half_width + width - abs((place - at).real), 3.2 - abs((place - at).imag)) for at, width in taken
    )
    return sum(max(overlap, 0.0) * 4.0 for overlap in overlaps)


def _caption_place(figure: _Placed) -> Point:
    places = np.array(list(figure.nodes.values()))
    return (float(places.real.min()), float(-places.imag.max()) - 9.0)


def _number(values: np.ndarray, index: int) -> str:
    return f"{_one(values, index):.5g}"


def _one(values: np.ndarray, index: int) -> float:
    """One variant's number, of an array over variants or of a number common to all."""
    return float(values[index] if np.ndim(values) else values)


def _table(assignment: Assignment, plan: Plan, figures: tuple[str, ...], index: int) -> Iterator[Shape]:
    """Values of the vectors and angular rates of these figures, in a column on the right."""
    x, y = FRAME[2] - 80.0, FRAME[1] + 8.0
    yield Label((x, y), assignment.id, 3.8)
    yield Label((x, y + 5.0), str(plan.variants[index]), 3.4)
    rows = [("", "mm", "real value", "deg")]
    shown = [vector for figure in figures for vector in plan.construction.vectors_of(figure)]
    for vector in shown:
        name = vector.name
        drawn = abs(plan.drawn_mm(name)[index])
        angle = plan.direction_deg(name)[index]
        unit = "m/s" if vector.scale == "kv" else "m/s²"
        real = abs(plan.vectors_si[name][index])
        rows.append((name, f"{drawn:.2f}", f"{real:.4g} {unit}", "-" if np.isnan(angle) else f"{angle:.2f}"))
    names = {vector.name for vector in shown}
    for name, values in plan.rates.items():
        if plan.construction.rates[name].vector not in names:
            continue
        unit = "rad/s" if name.startswith("omega") else "rad/s²"
        rows.append((name, "", f"{values[index]:.4g} {unit}", ""))
    for row, (name, drawn_mm, value, angle_deg) in enumerate(rows):
        height = y + 12.0 + 4.6 * row
        yield Label((x, height), name, 3.2)
        yield Label((x + 30.0, height), drawn_mm, 3.2, "end")
        yield Label((x + 58.0, height), value, 3.2, "end")
        yield Label((x + 75.0, height), angle_deg, 3.2, "end")
