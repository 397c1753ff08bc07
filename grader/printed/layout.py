"""The layout of a printed answer sheet: markers, zones, boxes, cells, the QR code's text.

The zones are as large as the assignment's figures need over all its variants. Millimetres from the
sheet's top left corner, x right, y down.
"""

import re
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import accumulate, combinations
from typing import Literal, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict

from grader.records import ACCELERATION_PLAN, MECHANISM, VELOCITY_PLAN, Box, FloatArray, Identity
from reference.authored.assignment import SCALE_NAMES, Assignment, PageKind, PageTable, Variant
from reference.construction.elements import View
from reference.construction.graph import Construction, Vector, evaluate
from reference.drawing.canvas import A3_MM
from reference.geometry import ComplexArray
from reference.plan import construction_for, parameters_for
from reference.quantities import FORCE_PLANS, group_of, scale_of, value_name, vector_of_value, zone_of

# The code's text ----------------------------------------------------------------------------------

VERSION = "planmark1"
KINDS = get_args(PageKind)
MAX_LENGTH = 200
_NAME = r"[A-Za-z0-9._-]{1,64}"
_NUMBER = r"(?:-?[0-9]{1,9})?"
_CODE = re.compile(
    rf"{VERSION}\|(?P<assignment>{_NAME})\|(?P<student>{_NAME})\|n=(?P<n>{_NUMBER})\|p=(?P<position>{_NUMBER})"
    rf"\|(?P<kind>{'|'.join(KINDS)})"
)


def code_of(identity: Identity) -> str:
    """Return the text of the code. Raises ValueError for an identity that could not be read back."""
    n = "" if identity.n is None else identity.n
    position = "" if identity.position is None else identity.position
    code = f"{VERSION}|{identity.assignment}|{identity.student_id}|n={n}|p={position}|{identity.kind}"
    if identity_of(code) != identity:
        raise ValueError(f"an identity with names of A-Z a-z 0-9 . _ - is expected, not {identity}")
    return code


def identity_of(code: str) -> Identity | None:
    """Return the identity in a code's text, None for anything that is no code of a printed page."""
    match = _CODE.fullmatch(code) if len(code) <= MAX_LENGTH else None
    if match is None or set(match["student"]) == {"."}:
        return None
    n, position = (int(match[name]) if match[name] else None for name in ("n", "position"))
    return Identity(match["assignment"], match["student"], n, position, match["kind"])


# The sheet and its zones --------------------------------------------------------------------------

PAGE_MM = A3_MM
FRAME_MM: Box = (20.0, 10.0, 390.0, 277.0)
"""ISO 5457: 20 mm at the left for filing, 10 mm elsewhere."""
DRAWING_MM: Box = (23.0, 51.0, 384.0, 212.0)
"""Area between the head and the foot of the sheet; the zones divide it."""

MARKER_MM = 12.0
MARKER_CELLS = 6
"""Cells along a marker's side, its black border included."""
MARKER_DICTIONARY: Literal["DICT_4X4_250"] = "DICT_4X4_250"
"""OpenCV's name of it (Garrido-Jurado et al., Pattern Recognition 47, 2014)."""
MARKERS_PER_TEMPLATE = 8
_MARKER_X_MM = (24.0, 144.0, 274.0, 394.0)
_MARKER_Y_MM = (14.0, 271.0)

CODE_MM: Box = (363.0, 13.0, 28.0, 28.0)
"""Position of the QR code, quiet zone included."""
SCALE_BOXES: dict[str, Box] = {
    name: (306.0, 13.0 + 9.5 * min(row, 2), 53.0, 8.0) for row, name in enumerate(SCALE_NAMES)
}
"""No sheet has accelerations and forces: their scales are written in the same place."""
_ZONE_GAP_MM = 4.0
"""Ink of one zone does not reach the next."""
_FIELD_COLUMNS = ((39.0, 103.0), (159.0, 113.0), (289.0, 103.0))
"""Left edge and width of the three stretches between the foot's markers."""
_FIELD_TOP_MM, _FIELD_HEIGHT_MM = 265.7, 20.2
_FIELD_TIERS = ((1, 3), (2, 3), (3, 3), (3, 4), (4, 4))
"""Rows, and boxes side by side in a stretch."""
_FIELD_GAP_MM, _FIELD_MOST_MM = 0.9, 7.5
EASY_FIELDS, MAX_FIELDS = 27, 48
"""Most boxes for which a cell fits anybody's digits, and most for which it can be written in at all."""
WHOLE_CELLS, TENTH_CELLS = 3, 1
"""Cells of a measured length: hundreds, tens and ones of millimetres, then tenths after the printed mark."""
_CELL_GAP_MM, _MARK_GAP_MM = 0.6, 2.2
_CELL_MOST_MM = 5.2
_LEAST_VALUE_MM, _VALUE_WIDE_MM, _HEADROOM = 4.0, 25.4, 1.1
"""Cells for computed values: least height, width, and ratio of the largest value to the exact one."""
_TICK_MM, _TICKS_FROM_MM = 4.5, (6.5, 18.0)
"""Side of the boxes to tick for the two senses of a moment; their left edges, from the end of its cells."""


@dataclass(frozen=True, slots=True)
class Template:
    """One way to divide the drawing area.

    Attributes
    ----------
    number : 0.. ; its markers have the ids 8 number .. 8 number + 7
    zones : boxes by figure
    """

    number: int
    zones: dict[str, Box]

    @property
    def figures(self) -> frozenset[str]:
        """The figures that have a zone."""
        return frozenset(self.zones)

    @property
    def marker_ids(self) -> range:
        """Ids of its markers, in the order of `MARKER_CORNERS`."""
        first = self.number * MARKERS_PER_TEMPLATE
        return range(first, first + MARKERS_PER_TEMPLATE)

    def of_one(self, grid: Sequence[int] | None) -> "Template":
        """Return the template with the zones of the first position in a grid."""
        return replace(self, zones={figure: _grid(box, grid)[0] for figure, box in self.zones.items()})


def _marker_corners() -> FloatArray:
    """Return (8, 4, 2) corners from the top left, clockwise on the sheet: the upper row, then the lower."""
    lefts = np.array([(x, y) for y in _MARKER_Y_MM for x in _MARKER_X_MM])
    square = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) * MARKER_MM
    return np.asarray(lefts[:, None, :] + square[None, :, :])


MARKER_CORNERS = _marker_corners()


def _cut(box: Box, shares: Iterable[float], *, across: bool) -> list[Box]:
    """Divide a box into columns (`across`) or rows by shares that sum up to 1, a gap between."""
    x, y, w, h = box
    parts = list(shares)
    free = (w if across else h) - _ZONE_GAP_MM * (len(parts) - 1)
    ends = list(accumulate(free * part + _ZONE_GAP_MM for part in parts))
    starts = [0.0, *ends[:-1]]
    sizes = [round(free * part, 3) for part in parts]
    if across:
        return [(round(x + start, 3), y, size, h) for start, size in zip(starts, sizes, strict=True)]
    return [(x, round(y + start, 3), w, size) for start, size in zip(starts, sizes, strict=True)]


def _grid(box: Box, grid: Sequence[int] | None) -> list[Box]:
    """Divide a box into equal zones, from the left, row after row."""
    columns, rows = grid or (1, 1)
    return [
        cell
        for row in _cut(box, [1.0 / rows] * rows, across=False)
        for cell in _cut(row, [1.0 / columns] * columns, across=True)
    ]


def position_zones(assignment: Assignment, zones: Mapping[str, Box]) -> dict[int, Box]:
    """Return the zone of each position on a page with these zones; empty where the page has one position."""
    gridded = (page for page in assignment.file.page if page.grid)
    page = next((one for one in gridded if set(map(zone_of, one.figures)) == set(zones)), None)
    if page is None:
        return {}
    cells = _grid(zones[zone_of(page.figures[0])], page.grid)
    positions = assignment.shared_positions
    return dict(zip(positions, cells * (len(positions) if len(cells) == 1 else 1), strict=False))


def _zones(figures: tuple[str, ...], box: Box, shares: tuple[float, ...], across: bool) -> dict[str, Box]:
    return dict(zip(figures, _cut(box, shares, across=across), strict=True))


def _divisions() -> list[dict[str, Box]]:
    """Return all divisions. Their places in this list are printed on paper: append, never reorder."""
    m, v, a = MECHANISM, VELOCITY_PLAN, ACCELERATION_PLAN
    columns, rows = True, False
    divisions = [_zones((figure,), DRAWING_MM, (1.0,), columns) for figure in (m, v, a)]
    for plan in (v, a):
        shares = ((share, 1.0 - share) for share in (0.28, 0.4, 0.5, 0.6, 0.72))
        divisions.extend(_zones((m, plan), DRAWING_MM, share, columns) for share in shares)
        divisions.append(_zones((m, plan), DRAWING_MM, (0.5, 0.5), rows))
    divisions.extend(_zones((v, a), DRAWING_MM, (share, 1.0 - share), columns) for share in (0.4, 0.5))
    divisions.append(_zones((m, v, a), DRAWING_MM, (1 / 3, 1 / 3, 1 / 3), columns))
    divisions.append(_zones((m, v, a), DRAWING_MM, (0.4, 0.25, 0.35), columns))
    for share in (0.35, 0.45, 0.55):
        left, right = _cut(DRAWING_MM, (share, 1.0 - share), across=True)
        divisions.extend(_zones((m, v), left, (top, 1.0 - top), rows) | {a: right} for top in (0.4, 0.55))
        divisions.append({m: left} | _zones((v, a), right, (0.45, 0.55), rows))
    divisions.append(_zones((m, FORCE_PLANS), DRAWING_MM, (0.36, 0.64), columns))
    divisions.append(_zones((FORCE_PLANS,), DRAWING_MM, (1.0,), columns))
    return divisions


TEMPLATES = tuple(Template(number, zones) for number, zones in enumerate(_divisions()))
CALIBRATION = Template(30, {})
"""The page that measures printer and scanner; 31 templates of 8 ids fill the dictionary of 250."""


def template_of(marker_id: int) -> Template | None:
    """Return the template that a marker belongs to, None for an unused id."""
    number = marker_id // MARKERS_PER_TEMPLATE
    if number == CALIBRATION.number:
        return CALIBRATION
    return TEMPLATES[number] if 0 <= number < len(TEMPLATES) else None


# Boxes to write in --------------------------------------------------------------------------------


def field_boxes(names: tuple[str, ...]) -> dict[str, Box]:
    """Return boxes for measured lengths in the sheet's foot, as large as their number allows.

    The label is printed left of the box, within the same cell. For more than `MAX_FIELDS` names there are
    none.
    """
    if len(names) > MAX_FIELDS:
        return {}
    rows, per_stretch = next(
        (rows, per_stretch)
        for rows, per_stretch in _FIELD_TIERS
        if rows * per_stretch * len(_FIELD_COLUMNS) >= len(names)
    )
    pitch = _FIELD_HEIGHT_MM / rows
    height = min(pitch - _FIELD_GAP_MM, _FIELD_MOST_MM)
    cells: list[Box] = []
    for row in range(rows):
        y = round(_FIELD_TOP_MM + row * pitch + (pitch - height) / 2.0, 3)
        for left, width in _FIELD_COLUMNS:
            share = width / per_stretch
            most = (WHOLE_CELLS + TENTH_CELLS) * (_CELL_MOST_MM + _CELL_GAP_MM) + _MARK_GAP_MM
            wide = min(most, 0.7 * share)
            cells.extend(
                (round(left + (k + 1) * share - wide - 0.5, 3), y, round(wide, 3), round(height, 3))
                for k in range(per_stretch)
            )
    return dict(zip(names, cells, strict=False))


def comb_cells(box: Box, decimals: int = TENTH_CELLS) -> tuple[Box, ...]:
    """Return the cells of a box for a number, a digit each, from the left; `decimals` behind the mark."""
    x, y, wide, high = box
    count = WHOLE_CELLS + TENTH_CELLS
    cell = (wide - _MARK_GAP_MM - (count - 2) * _CELL_GAP_MM) / count
    steps = [k * (cell + _CELL_GAP_MM) for k in range(count - decimals)]
    steps += [wide - (decimals - k) * cell - (decimals - 1 - k) * _CELL_GAP_MM for k in range(decimals)]
    return tuple((round(x + step, 3), y, round(cell, 3), high) for step in steps)


def combs_of(fields: Mapping[str, Box]) -> dict[str, tuple[Box, ...]]:
    """Return the cells of every box for a measured length among a page's boxes; scales are written freely."""
    return {name: comb_cells(box) for name, box in fields.items() if name not in SCALE_BOXES}


def cells_of(
    assignment: Assignment, figures: Sequence[str], asked: Collection[str] | None = None
) -> dict[str, tuple[Box, ...]]:
    """Return the cells for measured lengths on a page with these figures, by vector, in zone order."""
    table = _single(assignment, figures)
    if table is None:
        return {}
    vectors = measured_on(page_construction(assignment, table.figures), table.figures)
    return combs_of(boxes_of([vector.name for vector in vectors], asked))


def measured_on(construction: Construction, figures: Sequence[str]) -> list[Vector]:
    """Return the vectors of a page whose lengths students may write down, in zone order.

    Of motion the sums of components are left out, which few draw; of forces they are the reactions.
    """
    return [
        vector
        for figure in dict.fromkeys(figures)
        for vector in construction.vectors_of(figure)
        if group_of(figure) or not vector.is_sum
    ]


def _single(assignment: Assignment, figures: Sequence[str]) -> PageTable | None:
    """Return the page with these figures or zones, if it has them for one position."""
    zones = set(map(zone_of, figures))
    known = (page for page in assignment.file.page if not page.grid)
    return next((page for page in known if set(map(zone_of, page.figures)) == zones), None)


def boxes_of(names: Sequence[str], asked: Collection[str] | None) -> dict[str, Box]:
    """Return the boxes for the requested lengths.

    A vector's box is where it would be if all had one: a rubric that asks for others tomorrow finds those
    printed today in their places. Only if all would be too small, the requested ones alone are counted.
    """
    if asked is None:
        return field_boxes(tuple(names))
    wanted = [name for name in names if name in asked]
    boxes = field_boxes(tuple(names if len(names) <= EASY_FIELDS else wanted))
    return {name: boxes[name] for name in wanted if name in boxes}


# The calibration page -----------------------------------------------------------------------------

_LENGTHS_MM = (5.0, 10.0, 20.0, 40.0, 80.0)
_ANGLES_DEG = tuple(range(0, 180, 15))


def calibration_segments() -> FloatArray:
    """Return (n, 2, 2) ends of the printed segments, mm, y down: stars of directions, ladders of lengths.

    A star has twelve diameters of 60 mm, 15 degrees apart, with its middle left free; a ladder has horizontal
    or vertical segments of 5 to 80 mm.
    """
    segments: list[tuple[complex, complex]] = []
    for centre in (85.0 + 100.0j, 215.0 + 100.0j, 345.0 + 100.0j):
        for angle in _ANGLES_DEG:
            along = np.exp(-1j * np.radians(angle))
            segments.append((centre + 12.0 * along, centre + 40.0 * along))
            segments.append((centre - 12.0 * along, centre - 40.0 * along))
    for row, length in enumerate(_LENGTHS_MM):
        y = 165.0 + 18.0 * row
        segments.extend((x + 1j * y, x + length + 1j * y) for x in (40.0, 140.0, 240.0))
    for column, length in enumerate(_LENGTHS_MM):
        x = 335.0 + 14.0 * column
        segments.append((x + 160.0j, x + 1j * (160.0 + length)))
    return np.array([[(end.real, end.imag) for end in ends] for ends in segments])


# The file layout.json -----------------------------------------------------------------------------


class _Document(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid")


class MarkerPlace(_Document):
    """A printed marker: its id and its corners from the top left, clockwise."""

    id: int
    corners_mm: list[tuple[float, float]]


class ValuePlace(_Document):
    """The place of a computed value: its box, and its cells from the left, the last for decimals.

    `senses` are the boxes to tick for the sense of a moment: counter-clockwise, clockwise.
    """

    box: Box
    decimals: int
    cells: tuple[Box, ...]
    senses: tuple[Box, ...] = ()


class PageLayout(_Document):
    """The positions of everything on the pages of one kind. `zones` holds the figures' boxes and `fields`.

    `cells` holds, for each box of `fields` in which a measured length is written (millimetres), its cells
    from the left: three digits, then the tenths; `values` the places of computed values, by vector or moment;
    `positions` the zone of each position where one sheet has all.
    """

    kind: PageKind | Literal["calibration"]
    markers: list[MarkerPlace]
    zones: dict[str, Box | dict[str, Box]]
    cells: dict[str, tuple[Box, ...]] = {}
    values: dict[str, ValuePlace] = {}
    positions: dict[int, Box] = {}


class Layout(_Document):
    """`layout.json`: millimetres from the upright sheet's top left corner, x right, y down."""

    schema_version: Literal[1] = 1
    marker_dictionary: Literal["DICT_4X4_250"] = MARKER_DICTIONARY
    page_mm: tuple[float, float] = PAGE_MM
    pages: list[PageLayout]


def marker_places(template: Template) -> list[MarkerPlace]:
    """Return the markers of a template as they stand in `layout.json`."""
    return [
        MarkerPlace(id=number, corners_mm=[(float(x), float(y)) for x, y in corners])
        for number, corners in zip(template.marker_ids, MARKER_CORNERS, strict=True)
    ]


# Room for an assignment's figures -----------------------------------------------------------------

MARGIN_MM = 12.0
"""Margin around a figure: letters, arrowheads, hatching of the guides."""


@dataclass(frozen=True, slots=True)
class TemplateFit:
    """A template for a page and how well it holds the figures.

    Attributes
    ----------
    template : the best of all
    room : zone over need by zone, the smaller of width and height; below 1 it is too small in some variant
    need_mm : widest and highest of any variant by zone, margins included
    """

    template: Template
    room: dict[str, float]
    need_mm: dict[str, tuple[float, float]]


def page_construction(assignment: Assignment, figures: Sequence[str]) -> Construction:
    """Return the construction of an assignment, without accelerations if no figure needs them."""
    accelerations = ACCELERATION_PLAN in figures or assignment.forces == "own"
    return construction_for(assignment, assignment.variants(), accelerations=accelerations)


def places_mm(
    assignment: Assignment, figures: Sequence[str], variants: list[Variant]
) -> dict[str, ComplexArray]:
    """Return the positions of each figure's nodes about its pole, at the assignment's own scales.

    (nodes, variants) complex millimetres by figure, y up; a sketch's about its own origin.
    """
    construction = page_construction(assignment, figures)
    nodes = _drawn(assignment, construction, variants).nodes
    return {
        figure: np.stack(
            [np.broadcast_to(nodes[step.node], (len(variants),)) for step in construction.figures[figure]]
        )
        for figure in figures
    }


def _drawn(assignment: Assignment, construction: Construction, variants: list[Variant]) -> View:
    """Return the data of variants at the assignment's own scales, and all nodes drawn at them."""
    known = parameters_for(assignment, variants, assignment.scales(variants))
    return View(evaluate(construction, known), known)


def values_asked(
    assignment: Assignment, table: PageTable, construction: Construction, asked: Collection[str]
) -> list[str]:
    """Return the vectors of a page whose computed value is asked for, and the moments after its force plans.

    A moment follows from all force plans: it stands on the last page that has any.
    """
    with_forces = [page for page in assignment.file.page if any(map(group_of, page.figures))]
    moments = construction.moments if table in with_forces[-1:] else ()
    names = [vector.name for vector in measured_on(construction, table.figures)]
    return [name for name in (*names, *moments) if value_name(name) in asked]


def values_of(
    assignment: Assignment, figures: Sequence[str], asked: Collection[str]
) -> dict[str, ValuePlace]:
    """Return the places for the requested values on a page with these figures, by vector or moment.

    A value stands below its vector's length where the lengths fill one row, else, as a moment, in place of a
    scale that the page does not have; where there is not room for all vectors they have none, nor for a
    moment behind them. Each has as many cells before the mark as the largest one of all variants.

    Arguments: `asked` as `RubricFile.entries`, ``v_B_value`` for the value of v_B.
    """
    table = _single(assignment, figures)
    if table is None or not any(map(vector_of_value, asked)):
        return {}
    construction, variants = page_construction(assignment, table.figures), assignment.variants()
    vectors = {vector.name: vector for vector in measured_on(construction, table.figures)}
    wanted = values_asked(assignment, table, construction, asked)
    boxes = field_boxes(tuple(vectors)) if wanted and len(vectors) <= EASY_FIELDS else {}
    below = max((y + high for _, y, _, high in boxes.values()), default=np.inf) + _FIELD_GAP_MM
    left_mm = _FIELD_TOP_MM + _FIELD_HEIGHT_MM - below
    is_room = left_mm >= _LEAST_VALUE_MM
    places = {
        name: (boxes[name][0], below, boxes[name][2], left_mm) for name in wanted if is_room and name in boxes
    }
    used = {SCALE_BOXES[scale_of(figure)] for figure in table.figures}
    free = [box for box in dict.fromkeys(SCALE_BOXES.values()) if box not in used]
    for kind in (vectors, construction.moments):
        some = [name for name in wanted if name in kind and name not in places]
        if len(some) <= len(free):
            rows = [(x, y, _VALUE_WIDE_MM, _FIELD_MOST_MM) for x, y, _, _ in free[: len(some)]]
            places, free = places | dict(zip(some, rows, strict=True)), free[len(some) :]
    found, view = {}, _drawn(assignment, construction, variants)
    for name, (x, y, w, h) in places.items():
        moment, middle = construction.moments.get(name), y + (h - _TICK_MM) / 2.0
        ticks = tuple((x + w + right, middle, _TICK_MM, _TICK_MM) for right in _TICKS_FROM_MM)
        if moment is not None:
            most = np.nanmax(np.abs(moment.at(view)))
        else:
            drawn = view.nodes[vectors[name].head] - view.nodes[vectors[name].tail]
            most = np.nanmax(np.abs(drawn * view.parameters[vectors[name].scale]))
        decimals = WHOLE_CELLS + TENTH_CELLS - len(str(int(_HEADROOM * most)))
        if decimals >= 0:
            box = (x, round(y, 3), w, round(h, 3))
            cells = comb_cells(box, decimals)
            found[name] = ValuePlace(box=box, decimals=decimals, cells=cells, senses=ticks if moment else ())
    return found


Size = tuple[FloatArray, FloatArray]
"""Width and height of a figure in every variant, millimetres, (N,) each."""
Extents = Mapping[str, Size]
"""The size of each figure."""


def extents_mm(assignment: Assignment, figures: Sequence[str], variants: list[Variant]) -> dict[str, Size]:
    """Return width and height of each figure of every variant, at the assignment's own scales."""
    return {
        figure: (np.ptp(places.real, axis=0), np.ptp(places.imag, axis=0))
        for figure, places in places_mm(assignment, figures, variants).items()
    }


def poles_mm(
    assignment: Assignment, template: Template, variants: list[Variant]
) -> dict[str, list[tuple[float, float]]]:
    """Return the best positions of the poles of a template's plans, sheet millimetres for each variant.

    A plan begun there is in the middle of its zone, or of its position's. A plan that is larger than its
    zone in some variant has none: the student will choose another scale. Nor have force plans.
    """
    plans = [figure for figure in template.zones if figure not in {MECHANISM, FORCE_PLANS}]
    poles = {}
    for figure, places in places_mm(assignment, plans, variants).items():
        zone, own = template.zones[figure], position_zones(assignment, template.zones)
        x, y, wide, high = np.array([own.get(variant.position or 0, zone) for variant in variants]).T
        low = places.real.min(axis=0) + 1j * places.imag.min(axis=0)
        top = places.real.max(axis=0) + 1j * places.imag.max(axis=0)
        size, room = top - low, wide + 1j * high - complex(2 * MARGIN_MM, 2 * MARGIN_MM)
        if np.all(size.real <= room.real) and np.all(size.imag <= room.imag):
            pole = x + wide / 2.0 - 1j * (y + high / 2.0) - (low + top) / 2.0
            poles[figure] = [(float(at.real), float(-at.imag)) for at in pole]
    return poles


def best_template(
    assignment: Assignment, figures: Sequence[str], grid: Sequence[int] | None = None
) -> TemplateFit:
    """Return the division with the most room for the tightest figure; a sketch may be drawn smaller."""
    return template_for(extents_mm(assignment, figures, assignment.variants()), grid)


def template_for(extents: Extents, grid: Sequence[int] | None = None) -> TemplateFit:
    """Return that division for figures whose widths and heights (mm) are known already.

    Arguments: `grid` of the positions on the sheet; the room is that of one of its zones.
    """
    needs = {zone: _sizes_together(sizes) for zone, sizes in by_zone(extents).items()}

    def rooms(template: Template, zone: str) -> FloatArray:
        _, _, wide, high = template.of_one(grid).zones[zone]
        return np.array([np.minimum(wide / need[0], high / need[1]) for need in needs[zone]])

    def room(template: Template, zone: str) -> float:
        return float(np.min(np.max(rooms(template, zone), axis=0)))

    def worth(template: Template) -> tuple[float, float]:
        # A plan's scale is the assignment's; the sketch's is often the student's choice.
        plans = [room(template, zone) for zone in needs if zone != MECHANISM]
        least = min(min(plans, default=np.inf), 1.0)
        return (round(least, 6), min(room(template, zone) for zone in needs))

    best = max((template for template in TEMPLATES if template.figures == set(needs)), key=worth)
    need_mm = {}
    for zone, ways in needs.items():
        way = ways[int(np.argmax(np.min(rooms(best, zone), axis=1)))]
        need_mm[zone] = (float(np.max(way[0])), float(np.max(way[1])))
    return TemplateFit(best, {zone: room(best, zone) for zone in needs}, need_mm)


def by_zone(extents: Extents) -> dict[str, list[Size]]:
    """Return the sizes of the figures in each zone."""
    zones: dict[str, list[Size]] = {}
    for figure, size in extents.items():
        zones.setdefault(zone_of(figure), []).append(size)
    return zones


def lines_of(count: int) -> list[list[list[int]]]:
    """Return the ways to set some figures side by side on one line or on two: the indices on each."""
    every = range(count)
    first = (one for size in range(1, count // 2 + 1) for one in combinations(every, size))
    return [[[*every]], *([[*one], [k for k in every if k not in one]] for one in first)]


def _sizes_together(sizes: Sequence[Size]) -> list[Size]:
    """Return widths and heights of figures with margins: on one line or two, which are rows or columns."""
    found = []
    for lines in lines_of(len(sizes)):
        for along, across in ((0, 1), (1, 0)):
            long = [np.sum([sizes[k][along] + 2 * MARGIN_MM for k in line], axis=0) for line in lines]
            wide = [np.max([sizes[k][across] for k in line], axis=0) + 2 * MARGIN_MM for line in lines]
            both = (np.asarray(np.max(long, axis=0)), np.asarray(sum(wide)))
            found.append((both[along], both[across]))
    return found
