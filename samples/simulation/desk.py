"""A student at the desk: figures laid out on a sheet, plain or printed, and drawn out with the pen."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from reference.construction.elements import View
from reference.construction.graph import evaluate
from reference.quantities import FORCE_PLANS, zone_of
from samples.simulation import figures, forces, habits, page, symbols, truth, wording
from samples.simulation.hand import DrawingTask, DrawnFigure, DrawnSheet
from samples.simulation.lettering import any_handwriting
from samples.simulation.scanner import Background
from samples.simulation.settings import FORCES, MECHANISM, VELOCITY, Box, PageStyle, Settings
from samples.simulation.sketch import SheetSketch
from samples.simulation.strokes import Rng

_FRAME_GAP_MM = 4.0
_ZONE_GAP_MM = 8.0


@dataclass(frozen=True, slots=True)
class PrintedSheet:
    """A printed answer sheet to draw on: its raster and, per figure or field, the box to use.

    Attributes
    ----------
    background : the page as printed
    zones : boxes in sheet millimetres by figure (``mechanism``, ``velocity_plan``, ...)
    fields : boxes to write in, by scale (``kL``) or vector (``v_A``)
    cells : of the boxes that have one for each digit, the last for the tenths
    values : by vector or moment, the cells of its computed value, how many of them are for decimals, and the
        boxes to tick for its sense
    positions : the zone of each position, where the sheet has all of them
    """

    background: Background
    zones: Mapping[str, Box]
    fields: Mapping[str, Box] = field(default_factory=dict)
    cells: Mapping[str, Sequence[Box]] = field(default_factory=dict)
    values: Mapping[str, tuple[Sequence[Box], int, Sequence[Box]]] = field(default_factory=dict)
    positions: Mapping[int, Box] = field(default_factory=dict)


Printed = Mapping[str, PrintedSheet]
"""Answer sheets by kind of page: ``all``, ``velocity``, ``acceleration``."""


@dataclass(frozen=True, slots=True)
class Desk:
    """A drawing task, the student's settings and the paper to draw on."""

    task: DrawingTask
    settings: Settings
    printed: Printed | None
    student_id: str
    seed: int

    def fits(self, sheet: DrawnSheet) -> bool:
        """Return whether the figures have room on the sheet, or in its zones."""
        if self.printed is None:
            return self._layout(sheet) is not None
        zones = self.printed[sheet.kind].zones
        plans = tuple(figure for figure in sheet.figures if zone_of(figure.name) == FORCE_PLANS)
        if len(plans) > 1:
            rng = np.random.default_rng([self.seed, 4])
            if page.place_figures(plans, zones[FORCE_PLANS], [], rng) is None:
                return False
        for figure in sheet.figures:
            low, high = figures.extent(figure.nodes)
            _, _, wide, tall = zones[zone_of(figure.name)]
            if (high - low).real > wide - _ZONE_GAP_MM or (high - low).imag > tall - _ZONE_GAP_MM:
                return False
        return True

    def draw_out(
        self, sheet: DrawnSheet, number: tuple[int, int]
    ) -> tuple[SheetSketch, dict[str, Any], page.Frame | None]:
        """Draw the sheet: the sketch, the truth about it, the frame of a plain sheet.

        Arguments: `number` is the sheet's number and the number of sheets.
        """
        rng = np.random.default_rng([self.seed, 2, number[0] - 1])
        writing = any_handwriting(np.random.default_rng([self.seed, 5]))
        sketch = SheetSketch(rng, self.settings.hand, self.settings.pen, self.settings.page, writing)
        told = self._plain(sketch, sheet, number) if self.printed is None else self._on_print(sketch, sheet)
        return sketch, told, told.pop("frame", None)

    # Plain paper ------------------------------------------------------------------------------

    def _plain(self, sketch: SheetSketch, sheet: DrawnSheet, number: tuple[int, int]) -> dict[str, Any]:
        written: dict[str, str] = {}
        page.print_squares(sketch)
        frame = page.draw_frame(sketch)
        room, taken = self._room()
        corner = frame.corners[2] if frame.corners else complex(room[0] + room[2], -room[1] - room[3])
        in_title = written if self.settings.page.title_block != "none" else {}
        rows = wording.title_rows(self.task, self.settings.page, sketch.rng, in_title)
        words = wording.WORDS[self.settings.page.language]
        rows[1].insert(0, f"{words['name']}: {self.student_id}")
        rows[-1].append(f"{words['sheet']} {number[0]}/{number[1]}")
        page.title_block(sketch, rows, corner)
        origins = self._layout(sheet) or _stacked(sheet.figures, room)
        missing = self._figures(sketch, sheet, origins)
        boxes = taken + [_box(figure, origins[figure.name]) for figure in sheet.figures]
        for figure in sheet.figures:
            nodes = figures.at_origin(figure, origins[figure.name])
            page.write_caption(sketch, self.task, figure.name, nodes, written)
        if self.settings.page.calculations:
            velocities = next((f.nodes for f in sheet.figures if f.name == VELOCITY), {})
            lines = wording.calculations(self.task, self.settings.page, velocities)
            page.write_block(sketch, lines, room, boxes)
        drawn = {figure.name: figures.at_origin(figure, origins[figure.name]) for figure in sheet.figures}
        habits.add(sketch, self.task, drawn, self.settings.student.habits, (room, boxes))
        crossed = self._abandoned(sketch, sheet, room, boxes) if self.settings.student.abandoned else None
        told = truth.drawing_truth(self.task, sheet, sketch, origins, missing)
        told["scales"]["written"] = written
        return {**told, "frame": frame, "crossed_out": crossed}

    def _layout(self, sheet: DrawnSheet) -> dict[str, complex] | None:
        room, taken = self._room()
        # A stream of its own for each kind of sheet: asked twice, it gives the same layout.
        rng = np.random.default_rng([self.seed, 4, len(sheet.kind)])
        origins = page.place_figures(sheet.figures, room, taken, rng)
        if origins is not None and "overlapping" in self.settings.student.habits:
            return habits.overlapped(origins, room)
        return origins

    def _room(self) -> tuple[Box, list[Box]]:
        """The area for figures, and the boxes taken by the title block."""
        x, y, w, h = page.FRAMES_MM[self.settings.page.frame]
        wide, high = page.TITLE_MM[self.settings.page.title_block]
        gap = _FRAME_GAP_MM
        taken: list[Box] = []
        if wide:
            taken.append((x + w - wide - gap, y + h - high - gap, wide + gap, high + gap))
        return (x + gap, y + gap, w - 2 * gap, h - 2 * gap), taken

    def _abandoned(
        self, sketch: SheetSketch, sheet: DrawnSheet, room: Box, taken: list[Box]
    ) -> list[float] | None:
        """Draw a plan at a wrong place and cross it out; return its box, None where it had no room."""
        plan = next((figure for figure in sheet.figures if figure.name != MECHANISM), None)
        if plan is None:
            return None
        low, high = figures.extent(plan.nodes)
        w, h = (high - low).real + 12, (high - low).imag + 12
        place = page.free_place((w, h), room, taken, sketch.rng)
        if place is None:
            return None
        taken.append((*place, w, h))
        origin = complex(place[0] + 6, -place[1] - 6) - complex(low.real, high.imag)
        whole = self.settings.student.abandoned_whole
        for vector in self.task.wrong.construction.polygon_of(plan.name)[: None if whole else 3]:
            p, q = (origin + plan.nodes[node] for node in (vector.tail, vector.head))
            slip = complex(*sketch.rng.normal(0.0, 0.5 if whole else 2.0, 2))
            sketch.line(sketch.pen("line"), p, q + slip)
            if whole:
                symbols.arrowhead(sketch, sketch.pen("line"), p, q + slip, sketch.style.arrow_mm)
        symbols.cross_out(sketch, origin + low, origin + high)
        return [round(v, 3) for v in (*place, w, h)]

    # Printed paper ----------------------------------------------------------------------------

    def _on_print(self, sketch: SheetSketch, sheet: DrawnSheet) -> dict[str, Any]:
        paper = (self.printed or {})[sheet.kind]
        origins = page.place_in_zones(sheet.figures, paper.zones, sketch.rng)
        missing = self._figures(sketch, sheet, origins)
        filled = self._fill_fields(sketch, sheet, paper)
        told = truth.drawing_truth(self.task, sheet, sketch, origins, missing)
        told["scales"]["written"] = {n: text for n, text in filled.items() if n in self.task.declared}
        return {**told, "fields": filled}

    def _figures(
        self, sketch: SheetSketch, sheet: DrawnSheet, origins: Mapping[str, complex]
    ) -> dict[str, dict[str, str]]:
        """Draw the figures; return the vectors that are not drawn, with the reason, by plan."""
        missing = {}
        joints = {f.name: figures.at_origin(f, origins[f.name]) for f in sheet.figures}.get(MECHANISM)
        for figure in sheet.figures:
            nodes = figures.at_origin(figure, origins[figure.name])
            if figure.name == MECHANISM:
                figures.draw_mechanism(sketch, self.task, nodes, self.settings.student)
            elif figure.name.startswith(FORCES):
                student = self.settings.student
                missing[figure.name] = forces.draw_force_plan(sketch, self.task, figure.name, nodes, student)
            else:
                student = self.settings.student
                missing[figure.name] = figures.draw_plan(sketch, self.task, figure.name, nodes, student)
                if student.helpers and joints is not None:
                    figures.draw_helpers(sketch, self.task, joints, nodes, student.helpers)
        return missing

    def _fill_fields(self, sketch: SheetSketch, sheet: DrawnSheet, paper: PrintedSheet) -> dict[str, str]:
        """Write the scales and measured lengths into the printed boxes; return the texts by box."""
        task, style = self.task, sketch.page
        texts = {}
        for name, value in task.declared.items():
            texts[name] = wording.scale_text(name, value, task, style, sketch.rng).split("= ")[-1]
        for figure in sheet.figures:
            for vector in task.wrong.construction.vectors_of(figure.name):
                length = abs(figure.nodes[vector.head] - figure.nodes[vector.tail])
                texts[vector.name] = ruler_text(
                    length, style, sketch.rng, in_cells=vector.name in paper.cells
                )
        filled = self._compute(sketch, sheet, paper)
        for name, (x, y, w, h) in paper.fields.items():
            if name in texts and name in paper.cells:
                _write_digits(sketch, texts[name], paper.cells[name], name)
                filled[name] = texts[name]
            elif name in texts:
                height = min(0.5 * h, 1.5 * w / max(1, len(texts[name])), 4.5)
                sketch.text(complex(x + 1.5, -y - h / 2 - 0.4 * height), texts[name], height, names=name)
                filled[name] = wording.plain(texts[name])
        return filled

    def _compute(self, sketch: SheetSketch, sheet: DrawnSheet, paper: PrintedSheet) -> dict[str, str]:
        """Write the values computed from the lengths at the declared scales; return the texts by column."""
        task, values = self.task.wrong, dict[str, float]()
        for figure in sheet.figures:
            for vector in task.construction.vectors_of(figure.name):
                if vector.name in paper.values and vector.scale in self.task.declared:
                    length = abs(figure.nodes[vector.head] - figure.nodes[vector.tail])
                    values[vector.name] = round(2.0 * length) / 2.0 * self.task.declared[vector.scale]
        for name in paper.values.keys() & task.construction.moments.keys():
            drawn = {node: np.asarray(at) for figure in sheet.figures for node, at in figure.nodes.items()}
            view = View(evaluate(task.construction, task.parameters, given=drawn), task.parameters)
            values[name] = float(task.construction.moments[name].at(view))
        return {f"{name}_value": _write_value(sketch, name, values[name], paper) for name in values}


def ruler_text(length_mm: float, style: PageStyle, rng: Rng, *, in_cells: bool = False) -> str:
    """A length as read off a ruler, to half a millimetre; cells have room for its tenths, zero too."""
    read = max(0.0, round(2.0 * (length_mm + rng.normal(0.0, 0.2))) / 2.0)
    if in_cells:
        return f"{read:.1f}".replace(".", "," if style.decimal_comma else ".")
    return wording.number(read, style)


def _write_value(sketch: SheetSketch, name: str, value: float, paper: PrintedSheet) -> str:
    """Write a computed value into its cells, tick its sense; return its text."""
    cells, decimals, senses = paper.values[name]
    # Nobody computes more than three digits from a ruler's millimetres.
    text = f"{float(f'{abs(value):.3g}'):.{min(decimals, 2)}f}"
    whole, _, behind = text.partition(".")
    _write_digits(sketch, whole + behind, cells[: len(cells) - decimals + len(behind)], name)
    for x, y, w, h in [senses[int(value < 0.0)]] if senses else []:
        low = complex(x + 0.4 * w, -y - 0.75 * h)
        for end in (complex(-0.2 * w, 0.25 * h), complex(0.4 * w, 0.55 * h)):
            sketch.line(sketch.pen("text"), low, low + end)
    return f"-{text}" if senses and value < 0.0 else text


def _write_digits(sketch: SheetSketch, text: str, cells: Sequence[Box], name: str) -> None:
    """Write one digit a cell, right-aligned, each somewhat off its cell's middle."""
    digits = [letter for letter in text if letter.isdigit()][-len(cells) :]
    for digit, (x, y, w, h) in zip(digits, cells[-len(digits) :], strict=True):
        height = min(0.72 * h, 0.95 * w) * float(sketch.rng.uniform(0.85, 1.1))
        middle = complex(x + w / 2.0, -y - h / 2.0) + complex(*sketch.rng.normal(0.0, 0.06 * w, 2))
        sketch.text(middle - complex(0.25, 0.5) * height, digit, height, names=name)


def _stacked(drawn: tuple[DrawnFigure, ...], room: Box) -> dict[str, complex]:
    """Origins that centre each figure on the sheet, for figures that are too large for it."""
    middle = complex(room[0] + room[2] / 2, -room[1] - room[3] / 2)
    return {figure.name: middle - sum(figures.extent(figure.nodes)) / 2 for figure in drawn}


def _box(figure: DrawnFigure, origin: complex) -> Box:
    low, high = (corner + origin for corner in figures.extent(figure.nodes))
    return (low.real - 8, -high.imag - 8, (high - low).real + 16, (high - low).imag + 16)
