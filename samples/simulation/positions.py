"""A student's mechanism in all positions on one sheet, and its plans on another, plain or printed.

One set of fixed pivots is drawn with all mechanisms about it. Plans stand in the zones of a printed sheet,
or on plain paper in rows, their poles numbered. They have the directions of the student's own sketches.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, Literal

import numpy as np

from reference.authored.assignment import Assignment, PageTable, Variant
from reference.construction.graph import evaluate
from samples.simulation import figures, page, symbols, truth, wording
from samples.simulation.desk import Printed, PrintedSheet
from samples.simulation.drawing import drawn_nodes
from samples.simulation.hand import DrawingTask, DrawnFigure, DrawnSheet, task_of
from samples.simulation.lettering import any_handwriting
from samples.simulation.scanner import DrawnPaper, digitise
from samples.simulation.settings import MECHANISM, Box, Settings
from samples.simulation.sketch import SheetSketch
from samples.simulation.strokes import Rng
from samples.simulation.student import SimulatedSheet
from samples.simulation.view import view_of

_SHEET_ROOM: Box = (24.0, 26.0, 382.0, 204.0)
"""The part of a plain sheet in which plans stand: above the title block, below the caption."""


@dataclass(frozen=True, slots=True)
class Numbering:
    """A student numbers and orders the plans on plain paper in one way.

    Attributes
    ----------
    marks : the number behind every letter, behind the pole's alone, in a ring beside the pole, or nowhere
    order : of the plans' places, row after row: as indexes of positions; None in the assignment's order
    first : the number of the first position, None for the assignment's own
    left_out : positions without a plan
    """

    marks: Literal["letters", "pole", "ring", "none"] = "letters"
    order: tuple[int, ...] | None = None
    first: int | None = None
    left_out: tuple[int, ...] = ()


def any_numbering(seed: int, positions: Sequence[int], columns: int = 3) -> Numbering:
    """Return a random student's habits; a quarter count from another number, or leave out a plan."""
    rng = np.random.default_rng([seed, 6])
    marks = ("letters", "pole", "ring", "none")[rng.choice(4, p=[0.3, 0.25, 0.25, 0.2])]
    count = len(positions)
    rows = -(-count // columns)
    by_columns = [row + rows * column for row in range(rows) for column in range(columns)]
    mixed = [*range(count)], [one for one in by_columns if one < count], rng.permutation(count).tolist()
    order = tuple(mixed[rng.choice(3, p=[0.7, 0.15, 0.15])])
    first = None if rng.random() < 0.75 else 1 - min(positions[0], 1)
    left_out = () if rng.random() < 0.75 else (int(rng.choice(positions)),)
    return Numbering(marks, order, first, left_out)  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class PositionsSheet:
    """One page with all positions: the page as scanned, and the truth of each position's drawing on it."""

    sheet: SimulatedSheet
    truths: Mapping[int, dict[str, Any]]


def simulate_positions(  # noqa: PLR0913
    assignment: Assignment,
    n: int | None,
    seed: int,
    settings: Settings,
    *,
    student_id: str = "s01",
    printed: Printed | None = None,
    numbering: Numbering | None = None,
) -> list[PositionsSheet]:
    """Draw and scan the pages of an assignment whose pages have all positions, without mistakes."""
    rng = np.random.default_rng([seed, 1])
    student = replace(settings.student, mistakes=())
    tasks = [
        task_of(assignment, Variant(n, position), student, np.random.default_rng([seed, 0, index]))
        for index, position in enumerate(assignment.shared_positions)
    ]
    drawn: list[Mapping[str, complex]] = []
    for task in tasks:
        ground = {
            name: at for name, at in (drawn[0] if drawn else {}).items() if task.mechanism.is_ground(name)
        }
        drawn.append(drawn_nodes(task.wrong.construction, task.wrong.parameters, settings.hand, rng, ground))
    told = seed, settings, student_id, printed, numbering or Numbering()
    return [
        _scanned(table, number, list(zip(tasks, drawn, strict=True)), told)
        for number, table in enumerate(assignment.file.page, start=1)
    ]


Drawn = Sequence[tuple[DrawingTask, Mapping[str, complex]]]


def _scanned(
    table: PageTable,
    number: int,
    drawn: Drawn,
    told: tuple[int, Settings, str, Printed | None, Numbering],
) -> PositionsSheet:
    """Draw one page with all positions and scan it."""
    seed, settings, student_id, printed, numbering = told
    rng, writing = np.random.default_rng([seed, 2, number]), any_handwriting(np.random.default_rng([seed, 5]))
    sketch = SheetSketch(rng, settings.hand, settings.pen, settings.page, writing)
    paper, task, figure = None if printed is None else printed[table.kind], drawn[0][0], table.figures[0]
    written: dict[str, str] = {}
    frame = None
    if paper is None:
        frame = _head(sketch, task, figure, written, f"{student_id}, {number}")
    else:
        _fill_boxes(sketch, task, paper, written)
    truths = {}
    order = numbering.order if paper is None and numbering.order else range(len(drawn))
    for one, whole, origin in _placed(table, [drawn[at] for at in order], paper, rng):
        sheet = whole
        sketch.lines, sketch.construction, sketch.labels = {}, {}, []
        place = [task.variant for task, _ in drawn].index(one.variant)
        said = str(one.variant.position if numbering.first is None else numbering.first + place)
        sketch.index = said if numbering.marks == "letters" else ""
        sketch.pole_index = said if numbering.marks == "pole" else ""
        nodes = figures.at_origin(sheet.figures[0], origin)
        missing: dict[str, dict[str, str]] = {}
        if figure == MECHANISM:
            figures.draw_mechanism(sketch, one, nodes, settings.student)
            sketch.with_supports = False
        elif one.variant.position in numbering.left_out:
            nodes, sheet = {}, _without_drawing(whole)
            missing[figure] = dict.fromkeys(one.right.construction.vectors, "left out")
        else:
            missing[figure] = figures.draw_plan(sketch, one, figure, nodes, settings.student)
            if numbering.marks == "ring":
                _ringed(sketch, said, nodes[one.wrong.construction.poles[figure]])
        truths[one.variant.position or 0] = truth.drawing_truth(one, sheet, sketch, {figure: origin}, missing)
    view = view_of(settings.scan, np.random.default_rng([seed, 3, number]))
    background = None if paper is None else paper.background
    ink = DrawnPaper(
        sketch.strokes, settings.pen, background, settings.page.squares, settings.page.squares_broken
    )
    image = digitise(ink, settings.scan, view, np.random.default_rng([seed, 4, number]))
    about = {
        "student_id": student_id,
        "seed": seed,
        "page": number,
        **truth.scan_truth(view, frame, settings),
    }
    for told_of in truths.values():
        told_of.update(about)
        told_of["scales"]["written"] = written
    return PositionsSheet(SimulatedSheet(image, dict(about), settings), truths)


def _placed(
    table: PageTable, drawn: Drawn, paper: PrintedSheet | None, rng: Rng
) -> Iterator[tuple[DrawingTask, DrawnSheet, complex]]:
    """Yield each position's drawing, and where its origin is on the sheet."""
    name, (columns, rows) = table.figures[0], table.grid or [1, 1]
    every = [nodes[step.node] for task, nodes in drawn for step in task.wrong.construction.figures[name]]
    for index, (task, nodes) in enumerate(drawn):
        exact = evaluate(task.wrong.construction, task.wrong.parameters)
        own = {step.node: nodes[step.node] for step in task.wrong.construction.figures[name]}
        sheet = DrawnSheet(
            table.kind, (DrawnFigure(name, own, {node: complex(exact[node]) for node in own}),)
        )
        box = (
            paper.positions[task.variant.position or 0]
            if paper is not None
            else _cell(index % (columns * rows), columns, rows)
        )
        shared = columns * rows == 1
        low, high = figures.extent(dict(enumerate(every)) if shared else own)  # type: ignore[arg-type]
        slack = 0.0 if shared else 0.3
        free = max(box[2] - (high - low).real - 20.0, 0.0), max(box[3] - (high - low).imag - 20.0, 0.0)
        aside = complex(*(rng.uniform(-slack, slack, 2) * free))
        yield task, sheet, complex(box[0] + box[2] / 2, -box[1] - box[3] / 2) + aside - (low + high) / 2.0


def _without_drawing(sheet: DrawnSheet) -> DrawnSheet:
    """Return a sheet whose figures have no nodes."""
    return replace(sheet, figures=tuple(replace(one, nodes={}, intended={}) for one in sheet.figures))


def _ringed(sketch: SheetSketch, said: str, pole: complex) -> None:
    """Write the number of a plan in a ring beside its pole."""
    height = 0.9 * sketch.page.letter_mm
    sketch.letter(pole, said, height, names="number", distance_mm=2.5)
    label = sketch.labels[-1]
    symbols.circle(sketch, (label.low + label.high) / 2, 0.85 * height, sketch.pen("text"))


def _cell(index: int, columns: int, rows: int) -> Box:
    """Return the place of a plan on a plain sheet: rows of them, as people draw them one after the other."""
    x, y, wide, high = _SHEET_ROOM if rows > 1 else page.FRAMES_MM["iso"]
    row, column = divmod(index, columns)
    return (x + column * wide / columns, y + row * high / rows, wide / columns, high / rows)


def _head(
    sketch: SheetSketch, task: DrawingTask, figure: str, written: dict[str, str], who: str
) -> page.Frame:
    """Draw frame, title block and caption of a plain sheet."""
    page.print_squares(sketch)
    frame = page.draw_frame(sketch)
    x, y, wide, high = page.FRAMES_MM[sketch.page.frame]
    corner = frame.corners[2] if frame.corners else complex(x + wide, -y - high)
    in_title = written if sketch.page.title_block != "none" else {}
    rows = wording.title_rows(task, sketch.page, sketch.rng, in_title)
    rows[1] = [f"{wording.WORDS[sketch.page.language]['name']}: {who}"]
    page.title_block(sketch, rows, corner)
    height = 0.95 * sketch.page.letter_mm
    for index, text in enumerate(wording.caption(figure, task, sketch.page, sketch.rng, written)):
        sketch.text(complex(x + 10.0 + 90.0 * index, -y - 9.0), text, height)
    return frame


def _fill_boxes(sketch: SheetSketch, task: DrawingTask, paper: PrintedSheet, written: dict[str, str]) -> None:
    """Write the scales into the boxes of a printed sheet."""
    for name, (x, y, w, h) in paper.fields.items():
        text = wording.scale_text(name, task.declared[name], task, sketch.page, sketch.rng).split("= ")[-1]
        height = min(0.5 * h, 1.5 * w / max(1, len(text)), 4.5)
        sketch.text(complex(x + 1.5, -y - h / 2 - 0.4 * height), text, height, names=name)
        written[name] = wording.plain(text)
