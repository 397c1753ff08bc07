"""Where figures stand on a sheet: in rows with even space between, else wherever there is room."""

from collections.abc import Sequence
from itertools import product

import numpy as np
from numpy.typing import NDArray

from reference.canvas import Bounds, Label, Point, Shape
from reference.drawing.labelling import segments_of
from reference.drawing.subject import Figure

LEAST_GAP_MM = 6.0
CELL_MM = 2.0
HALF_A_CELL = 0.5
CORNERS = (None, (0.0, 0.0), (0.0, 1.0), (1.0, 1.0), (1.0, 0.0))
"""Where the largest figure of a crowded sheet is tried: amid, and in each corner (right, down)."""
Mask = NDArray[np.bool_]


def lay_out(figures: Sequence[Figure], room: Bounds, column: Bounds) -> tuple[list[Point], bool]:
    """How far each figure is moved from its own origin, and whether all have their place.

    Arguments: `room` is the sheet inside its frame, `column` the part of it that the table takes, at
    its right.
    """
    beside = (room[0], room[1], column[0], room[3])
    found = _in_rows(figures, beside) or _where_there_is_room(figures, room, column)
    return (found, True) if found else (_one_on_another(figures, room), False)


def _sizes(figures: Sequence[Figure]) -> list[tuple[float, float]]:
    return [(box[2] - box[0], box[3] - box[1]) for box in (figure.bounds for figure in figures)]


def _in_rows(figures: Sequence[Figure], room: Bounds) -> list[Point] | None:
    """In rows, the spare room shared out evenly: as many to a row as leaves the widest spaces.

    None where every way leaves too little.
    """
    ways = [_rows(figures, breaks, room) for breaks in product((False, True), repeat=len(figures) - 1)]
    gap, moves = max(ways, key=lambda way: way[0])
    return moves if gap >= LEAST_GAP_MM else None


def _rows(figures: Sequence[Figure], breaks: Sequence[bool], room: Bounds) -> tuple[float, list[Point]]:
    """The least space and the places where a new row starts after each figure marked so."""
    left, top, right, bottom = room
    sizes, rows = _sizes(figures), [[0]]
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


def _where_there_is_room(figures: Sequence[Figure], room: Bounds, kept_free: Bounds) -> list[Point] | None:
    """The largest figure in the middle or in a corner, each other where it keeps farthest from all there.

    Of these ways the one whose figures keep farthest apart; None where none has room for all.
    """
    sizes = _sizes(figures)
    if any(width > room[2] - room[0] or height > room[3] - room[1] for width, height in sizes):
        return None
    ways = [_packed(figures, room, kept_free, corner) for corner in CORNERS]
    gap, moves = max(ways, key=lambda way: way[0])
    return moves if gap > 0.0 else None


def _packed(
    figures: Sequence[Figure], room: Bounds, kept_free: Bounds, corner: tuple[float, float] | None
) -> tuple[float, list[Point]]:
    """How far the figures keep apart, zero where one has no place, and their moves."""
    taken = np.zeros((int((room[3] - room[1]) / CELL_MM), int((room[2] - room[0]) / CELL_MM)), dtype=bool)
    x0, y0, x1, y1 = (int((side - room[k % 2]) / CELL_MM) for k, side in enumerate(kept_free))
    taken[y0 : y1 + 1, x0 : x1 + 1] = True
    moves: dict[int, Point] = {}
    least = np.inf
    for k in sorted(range(len(figures)), key=lambda k: -float(np.prod(_sizes([figures[k]])[0]))):
        mask, first = _mask(figures[k])
        (row, column), depth = _roomiest(taken, mask, None if moves else corner)
        if depth == 0.0:
            return 0.0, []
        taken[row : row + mask.shape[0], column : column + mask.shape[1]] |= mask
        moves[k] = (room[0] + column * CELL_MM - first[0], room[1] + row * CELL_MM - first[1])
        least = min(least, depth)
    return float(least), [moves[k] for k in range(len(figures))]


def _mask(figure: Figure) -> tuple[Mask, Point]:
    """The cells that a figure's ink needs, with the least gap around; the corner of the first cell."""
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
    """Points along every stroke and in every letter, no farther apart than a cell."""
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
    """A free place for a mask, and how far it is from all that is taken: zero for none.

    The place farthest from everything, or the free one nearest to a corner (shares of the room).
    """
    from scipy import ndimage, signal  # noqa: PLC0415 - needed for crowded sheets alone

    rows, columns = (taken.shape[axis] - mask.shape[axis] + 1 for axis in (0, 1))
    if rows <= 0 or columns <= 0:
        return (0, 0), 0.0
    overlap = signal.fftconvolve(taken.astype(float), mask[::-1, ::-1].astype(float), mode="valid")
    # A rim of places that are not to be had keeps the figure off the edges as well.
    depth = ndimage.distance_transform_edt(np.pad(overlap < HALF_A_CELL, 1))[1:-1, 1:-1]
    if corner is not None:
        down, across = np.indices(depth.shape)
        away = np.hypot(down - corner[1] * (rows - 1), across - corner[0] * (columns - 1))
        row, column = np.unravel_index(int(np.argmin(np.where(depth > 0.0, away, np.inf))), depth.shape)
        return (int(row), int(column)), 1e3 * float(depth[row, column] > 0.0)
    row, column = np.unravel_index(int(np.argmax(depth)), depth.shape)
    return (int(row), int(column)), float(depth[row, column])


def _one_on_another(figures: Sequence[Figure], room: Bounds) -> list[Point]:
    """All from the room's top left corner: what does not fit is at least seen."""
    return [(room[0] - box[0], room[1] - box[1]) for box in (figure.bounds for figure in figures)]
