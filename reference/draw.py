"""The reference drawing: mechanism, velocity plan and acceleration plan as a good hand would draw them.

Figures and their parts are in `reference.drawing`; here they come together on A3 sheets.
"""

from collections.abc import Sequence
from dataclasses import dataclass

from reference.assignment import Assignment
from reference.canvas import INK, Bounds, Label, Shape, Stroke, moved
from reference.drawing.layout import lay_out
from reference.drawing.polygon import polygon
from reference.drawing.sketch import sketch
from reference.drawing.subject import PLAN_COLOURS, Figure, Subject, Wording
from reference.drawing.tables import column
from reference.plan import Plan

FRAME: Bounds = (20.0, 10.0, 410.0, 287.0)
COLOURS = {"mechanism": INK, **PLAN_COLOURS}
WARNING_COLOUR, WARNING_MM = "#c00000", 5.0
ENGLISH = Wording()


@dataclass(frozen=True, slots=True)
class Sheet:
    """One A3 sheet of the reference drawing; `fits` is False where a figure is too large for it."""

    shapes: tuple[Shape, ...]
    fits: bool


def reference_drawing(
    assignment: Assignment,
    plan: Plan,
    index: int = 0,
    wording: Wording = ENGLISH,
    *,
    altitude: bool = False,
) -> list[Sheet]:
    """The drawing of one variant of a plan on A3, true to scale.

    All on one sheet where it fits, else on the sheets that the assignment asks for, else on as many as
    are needed. A figure that is too large even so at its scales is told in red on the drawing.

    Arguments: `altitude` draws the right triangles of the normal components on the sketch; raises
    CallError where the scales do not allow that.
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
        asked if all(sheet.fits for sheet in asked) else _one_after_another(subject, list(figures.values()))
    )


def _one_after_another(subject: Subject, figures: Sequence[Figure]) -> list[Sheet]:
    """Sheets with as many figures each, in their order, as fit."""
    sheets: list[tuple[Sheet, list[Figure]]] = []
    for figure in figures:
        together = _sheet(subject, [*sheets[-1][1], figure]) if sheets else None
        if together is not None and together.fits:
            sheets[-1] = together, [*sheets[-1][1], figure]
        else:
            sheets.append((_sheet(subject, [figure]), [figure]))
    return [sheet for sheet, _ in sheets]


def figures_of(subject: Subject) -> dict[str, Figure]:
    """Each figure of a plan by its name."""
    return {
        name: sketch(subject) if name == "mechanism" else polygon(subject, name)
        for name in subject.plan.nodes_mm
    }


def _sheet(subject: Subject, figures: Sequence[Figure]) -> Sheet:
    left, top, right, bottom = FRAME
    corners = ((left, top), (right, top), (right, bottom), (left, bottom))
    shapes: list[Shape] = [Stroke(corner, corners[(i + 1) % 4], 0.7) for i, corner in enumerate(corners)]
    beside = column(subject, [figure.name for figure in figures], (right, top), bottom)
    shapes.extend(beside.shapes)
    moves, placed = lay_out(figures, FRAME, beside.box)
    for figure, by in zip(figures, moves, strict=True):
        shapes.extend(moved(shape, by) for shape in figure.shapes)
    if not (placed and beside.fits):
        at = (left + 5, bottom - 5)
        shapes.append(Label(at, subject.wording.too_large, WARNING_MM, colour=WARNING_COLOUR))
    return Sheet(tuple(shapes), placed and beside.fits)
