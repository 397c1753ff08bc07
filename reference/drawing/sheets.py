"""The reference drawing: mechanism, velocity plan and acceleration plan on A3 sheets.

Figures stand in rows with even space between them, else wherever there is room. For the step by step
view a figure grows: what a step adds stands out, what was there before is grey.
"""

from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise, product

import numpy as np
from numpy.typing import NDArray

from reference.authored.assignment import Assignment
from reference.construction.elements import Along
from reference.construction.steps import ArcAndLine, Given, Similar, Step, TwoArcs, TwoLines
from reference.drawing import symbols
from reference.drawing.canvas import (
    PAPER,
    Area,
    Bounds,
    Curve,
    Label,
    Point,
    Ring,
    Shape,
    Stroke,
    shifted,
)
from reference.drawing.forces import with_scheme
from reference.drawing.labels import segments_of
from reference.drawing.sketch import LETTER_MM, PLATE_FILL, polygon, sketch
from reference.drawing.subject import DrawnFigure, Subject, Wording
from reference.drawing.symbols import point, unit
from reference.drawing.tables import column
from reference.plan import Plan
from reference.quantities import group_of

FRAME: Bounds = (20.0, 10.0, 410.0, 287.0)
WARNING_COLOUR, WARNING_MM = "#c00000", 5.0
ENGLISH = Wording()


@dataclass(frozen=True, slots=True)
class DrawnSheet:
    """One A3 sheet of the reference drawing; `fits` is False if a figure is too large for it."""

    shapes: tuple[Shape, ...]
    fits: bool


def reference_drawing(
    assignment: Assignment,
    plan: Plan,
    index: int = 0,
    wording: Wording = ENGLISH,
    *,
    altitude: bool = False,
) -> list[DrawnSheet]:
    """Return the drawing of one variant of a plan on A3, true to scale.

    All on one sheet if it fits, else on the sheets that the assignment asks for, else on as many as are
    needed. If a figure is still too large at its scales, the drawing says so in red.

    Arguments: `altitude` draws the right triangles of the normal components on the sketch; raises CallError
    if the scales do not allow that.
    """
    subject = Subject(assignment, plan, index, wording, altitude)
    figures = figures_of(subject)
    every = _sheet(subject, list(figures.values()))
    if every.fits:
        return [every]
    asked = [
        _sheet(subject, [figures[name] for name in page.figures if name in figures])
        for page in assignment.file.page
        if not figures.keys().isdisjoint(page.figures)
    ]
    return (
        asked if all(sheet.fits for sheet in asked) else _on_several_sheets(subject, list(figures.values()))
    )


def _on_several_sheets(subject: Subject, figures: Sequence[DrawnFigure]) -> list[DrawnSheet]:
    """Return sheets with as many figures each, in their order, as fit."""
    sheets: list[tuple[DrawnSheet, list[DrawnFigure]]] = []
    for figure in figures:
        together = _sheet(subject, [*sheets[-1][1], figure]) if sheets else None
        if together is not None and together.fits:
            sheets[-1] = together, [*sheets[-1][1], figure]
        else:
            sheets.append((_sheet(subject, [figure]), [figure]))
    return [sheet for sheet, _ in sheets]


def figures_of(subject: Subject) -> dict[str, DrawnFigure]:
    """Return each figure of a plan by its name."""
    figures = {}
    for name in subject.plan.nodes_mm:
        figure = sketch(subject) if name == "mechanism" else polygon(subject, name)
        figures[name] = with_scheme(subject, figure) if group_of(name) else figure
    return figures


def _sheet(subject: Subject, figures: Sequence[DrawnFigure]) -> DrawnSheet:
    left, top, right, bottom = FRAME
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    shapes: list[Shape] = [Stroke(corner, corners[(i + 1) % 4], 0.7) for i, corner in enumerate(corners)]
    beside = column(subject, [figure.name for figure in figures], (right, top), bottom)
    shapes.extend(beside.shapes)
    moves, placed = lay_out(figures, FRAME, beside.box)
    for figure, by in zip(figures, moves, strict=True):
        shapes.extend(shifted(shape, by) for shape in figure.shapes)
    if not (placed and beside.fits):
        at = (left + 5, bottom - 5)
        shapes.append(Label(at, subject.wording.too_large, WARNING_MM, colour=WARNING_COLOUR))
    return DrawnSheet(tuple(shapes), placed and beside.fits)


# Where figures stand on a sheet --------------------------------------------------------------------

LEAST_GAP_MM = 6.0
CELL_MM = 2.0
HALF_A_CELL = 0.5
CORNERS = (None, (0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))
"""Positions tried for the largest figure of a crowded sheet: the middle, and each corner (right, down)."""
Mask = NDArray[np.bool_]


def lay_out(figures: Sequence[DrawnFigure], room: Bounds, column: Bounds) -> tuple[list[Point], bool]:
    """Return the shift of each figure from its own origin, and whether all have room.

    Arguments: `room` is the sheet inside its frame, `column` the part of it that the table occupies, at its
    right.
    """
    beside = (room[0], room[1], column[0], room[3])
    found = _in_rows(figures, beside) or _packed_by_size(figures, room, column)
    if found:
        return found, True
    # All into the top left corner, so that what does not fit is visible.
    return [(room[0] - box[0], room[1] - box[1]) for box in (figure.bounds for figure in figures)], False


def _in_rows(figures: Sequence[DrawnFigure], room: Bounds) -> list[Point] | None:
    """Return shifts in rows with equal spaces, in the layout with the widest spaces; None without room."""
    layouts = [_rows(figures, breaks, room) for breaks in product((False, True), repeat=len(figures) - 1)]
    gap, moves = max(layouts, key=lambda layout: layout[0])
    return moves if gap >= LEAST_GAP_MM else None


def _rows(figures: Sequence[DrawnFigure], breaks: Sequence[bool], room: Bounds) -> tuple[float, list[Point]]:
    """Return the least space, and flags for the figures after which a new row starts."""
    left, top, right, bottom = room
    sizes, rows = [figure.size for figure in figures], [[0]]
    for k, new in enumerate(breaks, start=1):
        if new:
            rows.append([])
        rows[-1].append(k)
    heights = [max(sizes[k][1] for k in row) for row in rows]
    down = (bottom - top - sum(heights)) / (len(rows) + 1)
    gap, y, moves = down, top + down, []
    for row, height in zip(rows, heights, strict=True):
        across = (right - left - sum(sizes[k][0] for k in row)) / (len(row) + 1)
        gap, x = min(gap, across), left + across
        for k in row:
            box = figures[k].bounds
            moves.append((x - box[0], y + (height - sizes[k][1]) / 2.0 - box[1]))
            x += sizes[k][0] + across
        y += height + down
    return gap, moves


def _packed_by_size(figures: Sequence[DrawnFigure], room: Bounds, reserved: Bounds) -> list[Point] | None:
    """Return shifts with the largest figure in the middle or a corner, the others as far away as possible.

    Of these layouts the one whose figures are farthest apart; None if none has room for all.
    """
    sizes = [figure.size for figure in figures]
    if any(width > room[2] - room[0] or height > room[3] - room[1] for width, height in sizes):
        return None
    layouts = [_packed(figures, room, reserved, corner) for corner in CORNERS]
    gap, moves = max(layouts, key=lambda layout: layout[0])
    return moves if gap > 0.0 else None


def _packed(
    figures: Sequence[DrawnFigure], room: Bounds, reserved: Bounds, corner: tuple[float, float] | None
) -> tuple[float, list[Point]]:
    """Return the least distance between figures, zero if one has no room, and their shifts."""
    taken = np.zeros((int((room[3] - room[1]) / CELL_MM), int((room[2] - room[0]) / CELL_MM)), dtype=bool)
    x0, y0, x1, y1 = (int((side - room[k % 2]) / CELL_MM) for k, side in enumerate(reserved))
    taken[y0 : y1 + 1, x0 : x1 + 1] = True
    moves: dict[int, Point] = {}
    least = np.inf
    for k in sorted(range(len(figures)), key=lambda k: -float(np.prod(figures[k].size))):
        mask, first = _mask(figures[k])
        (row, column), depth = _roomiest(taken, mask, None if moves else corner)
        if depth == 0.0:
            return 0.0, []
        taken[row : row + mask.shape[0], column : column + mask.shape[1]] |= mask
        moves[k] = (room[0] + column * CELL_MM - first[0], room[1] + row * CELL_MM - first[1])
        least = min(least, depth)
    return float(least), [moves[k] for k in range(len(figures))]


def _mask(figure: DrawnFigure) -> tuple[Mask, Point]:
    """Return the cells that a figure's ink and the least gap need, and the corner of the first cell."""
    x0, y0, x1, y1 = figure.bounds
    corner = (x0 - LEAST_GAP_MM, y0 - LEAST_GAP_MM)
    shape = (int((y1 - y0 + 2 * LEAST_GAP_MM) / CELL_MM) + 1, int((x1 - x0 + 2 * LEAST_GAP_MM) / CELL_MM) + 1)
    mask = np.zeros(shape, dtype=bool)
    for x, y in _ink(figure.shapes):
        row, column = ((np.array([y, x]) - corner[::-1]) / CELL_MM).astype(int)
        reach = int(LEAST_GAP_MM / CELL_MM)
        mask[max(row - reach, 0) : row + reach + 1, max(column - reach, 0) : column + reach + 1] = True
    return mask, corner


def _ink(shapes: Sequence[Shape]) -> Sequence[Point]:
    """Return points along every stroke and in every letter, no farther apart than a cell."""
    points: list[Point] = []
    for x0, y0, x1, y1, _half in segments_of(shapes):
        count = int(np.hypot(x1 - x0, y1 - y0) / CELL_MM) + 2
        points += zip(np.linspace(x0, x1, count), np.linspace(y0, y1, count), strict=True)
    for shape in shapes:
        if isinstance(shape, Label):
            left, top, right, bottom = shape.bounds
            across = np.linspace(left, right, int((right - left) / CELL_MM) + 2)
            points += [(float(x), y) for x in across for y in (top, bottom)]
    return points


def _roomiest(taken: Mask, mask: Mask, corner: tuple[float, float] | None) -> tuple[tuple[int, int], float]:
    """Return a free position for a mask, and its distance from all that is taken: zero for none.

    The position farthest from everything, or the free one nearest to a corner (shares of the room).
    """
    from scipy import ndimage, signal  # noqa: PLC0415 - needed for crowded sheets alone

    rows, columns = (taken.shape[axis] - mask.shape[axis] + 1 for axis in (0, 1))
    if rows <= 0 or columns <= 0:
        return (0, 0), 0.0
    overlap = signal.fftconvolve(taken.astype(float), mask[::-1, ::-1].astype(float), mode="valid")
    # A rim of occupied cells keeps the figure off the edges as well.
    depth = ndimage.distance_transform_edt(np.pad(overlap < HALF_A_CELL, 1))[1:-1, 1:-1]
    if corner is not None:
        down, across = np.indices(depth.shape)
        away = np.hypot(down - corner[1] * (rows - 1), across - corner[0] * (columns - 1))
        row, column = np.unravel_index(int(np.argmin(np.where(depth > 0.0, away, np.inf))), depth.shape)
        return (int(row), int(column)), 1e3 * float(depth[row, column] > 0.0)
    row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return (int(row), int(column)), float(depth[row, column])


# A figure after each of its steps ------------------------------------------------------------------

BEFORE, NOW = "#a3abb3", "#c8380a"
NOW_WIDTH_MM = 0.3
"""Least width of a line that a step adds."""
ARC_HALF_RAD = 0.22
MODEL_MM, LARGE_MM = 1.0, 90.0


def stage(figure: DrawnFigure, earlier: Collection[str], node: str) -> tuple[Shape, ...]:
    """Return the figure once a node's step is done, after the steps of the earlier nodes."""
    known = {*earlier, node}
    shown = [part for part in figure.parts if part.node in known and part.until not in known]
    plates = [part.shape for part in shown if _is_light(part.shape)]
    before = [inked(part.shape, BEFORE) for part in shown if part.node != node]
    now = [_wider(inked(part.shape, NOW)) for part in shown if part.node == node]
    return (*plates, *(shape for shape in (*before, *now) if not _is_light(shape)))


def grey(figure: DrawnFigure) -> tuple[Shape, ...]:
    """Return the finished figure without its caption, all of it grey."""
    return tuple(inked(part.shape, BEFORE) for part in figure.parts if part.node and not part.until)


def inked(shape: Shape, colour: str) -> Shape:
    """Return the shape in another ink; paper stays white, a light fill stays unchanged."""
    match shape:
        case Ring():
            return replace(shape, colour=colour, fill=PAPER if shape.fill == PAPER else colour)
        case Area():
            kept = _is_light(shape) or shape.fill == PAPER
            return replace(shape, colour=colour, fill=shape.fill if kept else colour)
        case _:
            return replace(shape, colour=colour)


def _is_light(shape: Shape) -> bool:
    return isinstance(shape, Area) and shape.fill == PLATE_FILL


def _wider(shape: Shape) -> Shape:
    if isinstance(shape, Stroke | Curve) and not shape.dash:
        return replace(shape, width=max(shape.width, NOW_WIDTH_MM))
    return shape


def compasses(step: Step, nodes: dict[str, complex]) -> Iterator[Shape]:
    """Yield the arcs that determine a point of the sketch."""
    centres: tuple[str, ...] = ()
    if isinstance(step, TwoArcs):
        centres = step.centres
    elif isinstance(step, ArcAndLine):
        centres = (step.centre,)
    for centre in centres:
        arm = nodes[step.node] - nodes[centre]
        start = float(np.angle(arm)) - ARC_HALF_RAD
        yield symbols.arc(nodes[centre], abs(arm), start, 2 * ARC_HALF_RAD, NOW_WIDTH_MM, NOW)


def models(subject: Subject, step: Step) -> Iterator[Shape]:
    """Yield the links or triangle on the mechanism sketch from which the step takes its directions."""
    nodes = subject.nodes("mechanism")
    for joints in _model_joints(step):
        corners = [point(nodes[joint]) for joint in joints]
        yield from (Stroke(p, q, MODEL_MM, NOW) for p, q in pairwise(corners))


def _model_joints(step: Step) -> Iterator[tuple[str, ...]]:
    match step:
        case Similar(model=(p, q, r)):
            yield (p, q, r, p)
        case Given(along=Along(tail=tail, head=head)):
            yield (tail, head)
        case TwoLines(first=first, second=second):
            for line in (first, second):
                if isinstance(line.along, Along):
                    yield (line.along.tail, line.along.head)
        case _:
            return


def centre(subject: Subject, name: str) -> Iterator[Shape]:
    """Yield an instantaneous centre or acceleration pole, with its triangle on the link it belongs to."""
    nodes, at = subject.nodes("mechanism"), subject.centres[name]
    p, q = (nodes[joint] for joint in subject.plan.construction.centres[name].base)
    yield Stroke(point(p), point(q), MODEL_MM, NOW)
    for corner in (p, q):
        yield Stroke(point(corner), point(at), symbols.HAIR_MM, NOW)
    yield symbols.marked_point(at, NOW)
    # On a large picture, which is printed smaller, the letter is larger.
    size = LETTER_MM * max(1.0, abs(at - p) / LARGE_MM)
    away = unit(at - (p + q) / 2.0)
    x, y = point(at + 1.1 * size * away)
    yield Label((x, y + 0.35 * size), subject.letter(name), size, "middle", NOW, italic=True)
