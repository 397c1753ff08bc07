"""One student's work from the task to the files: the run of a simulation, read top to bottom."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.records import Box
from grader.simulation import figures, page, truth, wording
from grader.simulation.hand import MECHANISM, VELOCITY, DrawnFigure, DrawnSheet, Task, draw, task_of
from grader.simulation.lettering import any_handwriting
from grader.simulation.scanner import Background, digitise
from grader.simulation.settings import Settings
from grader.simulation.sketch import Sketch
from grader.simulation.storing import encoded
from grader.simulation.strokes import Rng
from grader.simulation.view import view_of
from reference.assignment import Assignment, Variant

_FRAME_GAP_MM = 4.0
_SHRINK = (1.0, 0.9, 0.8, 0.66, 0.5, 0.4)
"""Lengths of the crank tried, as shares of the one wished for."""


@dataclass(frozen=True, slots=True)
class PrintedSheet:
    """A printed answer sheet to draw on: its raster and, per figure or field, the box to use.

    Attributes
    ----------
    background : the page as printed
    zones : boxes in sheet millimetres by figure (``mechanism``, ``velocity_plan``, ...)
    fields : boxes in which scales are written, by ``kL``, ``kv``, ``ka``
    """

    background: Background
    zones: Mapping[str, Box]
    fields: Mapping[str, Box] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class SimulatedSheet:
    """One page: its stored image, and the truth of it as JSON-like data."""

    image: NDArray[np.uint8]
    truth: dict[str, Any]
    settings: Settings

    @property
    def suffix(self) -> str:
        """The file name's ending."""
        return {"jpg": ".jpg", "png": ".png", "tif": ".tif", "pdf": ".jpg"}[self.settings.scan.container]

    def save(self, path: Path) -> Path:
        """Write the file (its ending set by the scan's container); the truth then names it."""
        target = path.with_suffix(self.suffix)
        target.write_bytes(encoded(self.image, self.settings.scan, exif=self.settings.scan.device == "phone"))
        self.truth["file"] = target.name
        return target


def simulate(
    assignment: Assignment,
    variant: Variant,
    seed: int,
    settings: Settings | None = None,
    *,
    student_id: str = "s01",
    printed: Mapping[str, PrintedSheet] | None = None,
) -> list[SimulatedSheet]:
    """A student's sheets.

    Arguments: `printed` gives answer sheets by kind of page (``all``, ``velocity``,
    ``acceleration``), drawn on instead of plain paper. Raises ValueError where a mistake asked for
    cannot be made.
    """
    chosen = settings or Settings()
    if printed is not None:
        chosen = replace(chosen, student=replace(chosen.student, sheets=1 if "all" in printed else 2))
    task, drawn, chosen = _drawn_to_fit(assignment, variant, seed, chosen, printed)
    sheets = []
    for index, sheet in enumerate(drawn):
        rng = np.random.default_rng([seed, 2, index])
        sketch, told, frame = _drawn_out(task, sheet, (index + 1, len(drawn)), chosen, rng, printed, student_id)
        sheets.append(_scanned(sketch, told, frame, chosen, np.random.default_rng([seed, 3, index]),
                               None if printed is None else printed[sheet.kind].background))
        sheets[-1].truth.update({"student_id": student_id, "page": index + 1, "seed": seed})
    return sheets


def _drawn_to_fit(
    assignment: Assignment, variant: Variant, seed: int, settings: Settings,
    printed: Mapping[str, PrintedSheet] | None,
) -> tuple[Task, list[DrawnSheet], Settings]:
    """The student's figures at the largest scale tried at which they go on the paper.

    Where none does, the sheets are split.
    """
    proposed = float(assignment.scales([variant]).kL[0])
    crank = float(assignment.mechanism([variant]).crank.length_m.reshape(-1)[0])
    wished = settings.student.crank_mm or crank / proposed
    for share in _SHRINK:
        tried = settings.student if share == 1.0 else replace(settings.student, crank_mm=round(wished * share))
        chosen = replace(settings, student=tried)
        task = task_of(assignment, variant, tried, np.random.default_rng([seed, 0]))
        drawn = draw(task, settings.hand, tried, np.random.default_rng([seed, 1]))
        if all(_fits(sheet, chosen, seed, printed) for sheet in drawn):
            return task, list(drawn), chosen
    return task, [one for sheet in drawn for one in _split(sheet)], chosen


def _fits(
    sheet: DrawnSheet, settings: Settings, seed: int, printed: Mapping[str, PrintedSheet] | None
) -> bool:
    if printed is None:
        return _layout(sheet, settings, np.random.default_rng([seed, 4])) is not None
    zones = printed[sheet.kind].zones
    sizes = ((zones[f.name], *figures.extent(f.nodes)) for f in sheet.figures)
    return all((high - low).real < zone[2] - 8 and (high - low).imag < zone[3] - 8 for zone, low, high in sizes)


def _split(sheet: DrawnSheet) -> list[DrawnSheet]:
    """The mechanism with the velocity plan, the acceleration plan apart."""
    if sheet.kind != "all":
        return [sheet]
    first = tuple(f for f in sheet.figures if f.name in {MECHANISM, VELOCITY})
    rest = tuple(f for f in sheet.figures if f not in first)
    return [DrawnSheet("velocity", first), DrawnSheet("acceleration", rest)]


def _layout(sheet: DrawnSheet, settings: Settings, rng: Rng) -> dict[str, complex] | None:
    room, taken = _room(settings)
    return page.place_figures(sheet.figures, room, taken, rng)


def _room(settings: Settings) -> tuple[Box, list[Box]]:
    """Where figures may go, and what is taken by the title block."""
    x, y, w, h = page.FRAMES_MM[settings.page.frame]
    wide, high = page.TITLE_MM[settings.page.title_block]
    gap = _FRAME_GAP_MM
    taken: list[Box] = [(x + w - wide - gap, y + h - high - gap, wide + gap, high + gap)] if wide else []
    return (x + gap, y + gap, w - 2 * gap, h - 2 * gap), taken


def _drawn_out(
    task: Task, sheet: DrawnSheet, number: tuple[int, int], settings: Settings, rng: Rng,
    printed: Mapping[str, PrintedSheet] | None, student_id: str,
) -> tuple[Sketch, dict[str, Any], page.Frame | None]:
    """Pen on paper."""
    writing = any_handwriting(np.random.default_rng([rng.integers(1 << 30)]))
    sketch = Sketch(rng, settings.hand, settings.pen, settings.page, writing)
    written: dict[str, str] = {}
    frame, filled = None, {}
    if printed is None:
        frame = page.draw_frame(sketch)
        room, taken = _room(settings)
        corner = frame.corners[2] if frame.corners else complex(room[0] + room[2], -room[1] - room[3])
        rows = wording.title_rows(task, settings.page, rng, number, student_id, written)
        page.title_block(sketch, rows, corner)
        origins = page.place_figures(sheet.figures, room, taken, rng) or _stacked(sheet.figures, room)
    else:
        origins = page.place_in_zones(sheet.figures, printed[sheet.kind].zones, rng)
    missing = _figures(task, sheet.figures, origins, sketch, settings, written, captions=printed is None)
    if printed is None and settings.page.calculations:
        boxes = taken + [_box(figure, origins[figure.name]) for figure in sheet.figures]
        velocities = next((f.nodes for f in sheet.figures if f.name == VELOCITY), {})
        page.write_block(sketch, wording.calculations(task, settings.page, velocities), room, boxes)
    elif printed is not None:
        filled = _fill_fields(sketch, task, sheet.figures, printed[sheet.kind].fields, written)
    told = truth.drawing_truth(task, sheet, sketch, origins, missing)
    told["scales"]["written"] = written
    told["fields"] = filled
    return sketch, told, frame


def _stacked(drawn: tuple[DrawnFigure, ...], room: Box) -> dict[str, complex]:
    """Too large for the sheet: each figure in the middle all the same."""
    middle = complex(room[0] + room[2] / 2, -room[1] - room[3] / 2)
    return {figure.name: middle - sum(figures.extent(figure.nodes)) / 2 for figure in drawn}


def _box(figure: DrawnFigure, origin: complex) -> Box:
    low, high = figures.extent(figure.nodes)
    low, high = low + origin, high + origin
    return (low.real - 8, -high.imag - 8, (high - low).real + 16, (high - low).imag + 16)


def _figures(
    task: Task, drawn: tuple[DrawnFigure, ...], origins: Mapping[str, complex], sketch: Sketch,
    settings: Settings, written: dict[str, str], *, captions: bool,
) -> dict[str, dict[str, str]]:
    missing = {}
    for figure in drawn:
        nodes = figures.at_origin(figure, origins[figure.name])
        if figure.name == MECHANISM:
            figures.draw_mechanism(sketch, task, nodes, settings.student)
        else:
            missing[figure.name] = figures.draw_plan(sketch, task, figure.name, nodes, settings.student)
        if captions:
            page.write_caption(sketch, task, figure.name, nodes, written)
    return missing


def _fill_fields(
    sketch: Sketch, task: Task, drawn: tuple[DrawnFigure, ...], fields: Mapping[str, Box], written: dict[str, str]
) -> dict[str, str]:
    """The scales and the measured lengths written into the printed boxes; what was written, by box."""
    texts = {}
    for name in task.declared:
        texts[name] = wording.scale_text(name, task.declared[name], task, sketch.page, sketch.rng).split("= ")[-1]
    for figure in drawn:
        for vector in task.wrong.construction.vectors_of(figure.name):
            length = abs(figure.nodes[vector.head] - figure.nodes[vector.tail]) + sketch.rng.normal(0.0, 0.2)
            texts[vector.name] = wording.number(max(0.0, round(2.0 * length) / 2.0), sketch.page)
    filled = {}
    for name, (x, y, w, h) in fields.items():
        if name in texts:
            height = min(0.5 * h, 1.5 * w / max(1, len(texts[name])), 4.5)
            sketch.text(complex(x + 1.5, -y - h / 2 - 0.4 * height), texts[name], height, names=name)
            filled[name] = wording.plain(texts[name])
    written.update({name: text for name, text in filled.items() if name in task.declared})
    return filled


def _scanned(
    sketch: Sketch, told: dict[str, Any], frame: page.Frame | None, settings: Settings, rng: Rng,
    background: Background | None,
) -> SimulatedSheet:
    """The sheet on the glass."""
    view = view_of(settings.scan, rng)
    image = digitise(sketch.strokes, settings.pen, settings.scan, view, rng, background)
    return SimulatedSheet(image, {**told, **truth.scan_truth(view, frame, settings)}, settings)


def measured_by(sheets: list[SimulatedSheet], rng: Rng, spread_mm: float = 0.2, step_mm: float = 0.5) -> dict[str, float]:
    """What the student's ruler and protractor say: lengths in mm by vector, ``NAME_deg`` directions."""
    measured: dict[str, float] = {}
    for sheet in sheets:
        for drawn in sheet.truth["figures"].values():
            for name, vector in drawn.get("vectors", {}).items():
                length = vector["length_mm"] + rng.normal(0.0, spread_mm)
                measured[name] = round(max(0.0, round(length / step_mm) * step_mm), 3)
                if vector["direction_deg"] is not None and vector["length_mm"] > 5.0:
                    measured[f"{name}_deg"] = round(vector["direction_deg"] + rng.normal(0.0, 0.4)) % 360
    return measured

