"""From strokes to named figures, sheet by sheet; a student's sheets are read together."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from grader.reading.figures import figure_of_plan, figure_of_sketch
from grader.reading.lettering import lettered, support
from grader.reading.lines import Lines, lines_of
from grader.reading.plans import Plan, best_plan, regular_plans
from grader.reading.sketch import Sketch, drawings, find_sketch
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Figure,
    Ink,
    Reading,
    Sheet,
    Unread,
)
from reference.assignment import Assignment, Scales, Variant
from reference.geometry import ComplexArray
from reference.mistakes import Drawing

LEAST_SKETCH = 15.0
LEAST_PLAN = 12.0
"""Nats: what less is explained by may be chance."""

SURE_PLAN = 40.0
CLEAR = 0.85
LEAST_DRAWN_MM, MOST_DRAWN_MM = 15.0, 200.0
"""Of the vectors given at the start of a plan."""
SAME_SCALE = 0.95
WILD = 3.0

Given = dict[str, ComplexArray]


@dataclass(slots=True)
class _Page:
    """What is found on one sheet so far."""

    lines: Lines
    ink: Ink
    sheet: Sheet
    sketch: Sketch | None = None
    plans: dict[str, Plan] = field(default_factory=dict)


def read_figures(
    inks: Sequence[Ink],
    sheets: Sequence[Sheet],
    assignment: Assignment,
    variant: Variant | None,
    scales: Scales | None,
    wanted: Collection[str],
) -> list[Reading]:
    """Name what was drawn on a student's sheets.

    Arguments
    ---------
    inks, sheets : one each per sheet, in order
    variant : the student's own, None where not known; the drawing may follow another one
    scales : as declared, None where not; the drawing may follow others
    wanted : names of vectors (and nodes) asked for: each is in a figure or in `unread` of one reading

    Returns one Reading per sheet.
    """
    pages = [_Page(lines_of(ink), ink, sheet) for ink, sheet in zip(inks, sheets, strict=True)]
    own, others = _drawings(assignment, variant, scales)
    for page in pages:
        told = partial(support, letters=page.ink.letters, renamed=assignment.file.names)
        sketch = find_sketch(page.lines, page.ink.circles, own, others, told)
        if sketch is not None and sketch.score >= LEAST_SKETCH:
            page.sketch = sketch
    followed = [page.sketch.drawing for page in pages if page.sketch is not None] if variant is None else []
    drawing = _measurable((followed or own)[0], assignment, variant)
    velocity = _find(pages, [drawing], VELOCITY_PLAN, {})
    known = {} if velocity is None else _nodes(velocity)
    paced = [drawing] if velocity is None else _paced(drawing, known)
    if _asks_accelerations(wanted, drawing):
        _set_apart(pages, velocity)
        _find(pages, paced, ACCELERATION_PLAN, known)
    return [
        lettered(reading, page.ink.letters, drawing.construction, assignment.file.names)
        for reading, page in zip(_readings(pages, drawing, wanted), pages, strict=True)
    ]


def _drawings(
    assignment: Assignment, variant: Variant | None, scales: Scales | None
) -> tuple[list[Drawing], list[Drawing]]:
    """The student's own drawing (any variant's, when it is not known), and other students'."""
    everybody = assignment.variants()
    if variant is None:
        return drawings(assignment, everybody, scales), []
    others = [one for one in everybody if one != variant]
    return drawings(assignment, [variant], scales), drawings(assignment, others, None)


def _measurable(drawing: Drawing, assignment: Assignment, variant: Variant | None) -> Drawing:
    """The drawing at the declared scales, or at the assignment's own where those would not fit the paper."""
    usual = assignment.scales([variant or assignment.variants()[0]])
    parameters = dict(drawing.parameters)
    for vector in drawing.construction.vectors.values():
        real = parameters.get(vector.name, parameters.get(f"{vector.name}_n"))
        if real is None:
            continue
        drawn = abs(float(np.ravel(real)[0]) / float(np.ravel(parameters[vector.scale])[0]))
        if drawn and not LEAST_DRAWN_MM < drawn < MOST_DRAWN_MM:
            parameters[vector.scale] = getattr(usual, vector.scale)
    return Drawing(drawing.construction, parameters)


def _asks_accelerations(wanted: Collection[str], drawing: Drawing) -> bool:
    vectors = drawing.construction.vectors
    return not wanted or any(name in vectors and vectors[name].scale == "ka" for name in wanted)


def _given(page: _Page, pages: Sequence[_Page]) -> Given:
    """The joints as drawn: on the same sheet, else on the student's other one; none to take the exact."""
    for one in (page, *pages):
        if one.sketch is not None:
            names = one.sketch.found.expected.names
            return {name: np.asarray(at) for name, at in zip(names, one.sketch.fit.at, strict=True)}
    return {}


def _turned(page: _Page, pages: Sequence[_Page], drawing: Drawing) -> Drawing:
    """The drawing with guides turned as the sketch is."""
    turn = next((one.sketch.guide_turn_rad for one in (page, *pages) if one.sketch is not None), 0.0)
    return Drawing(drawing.construction, {**drawing.parameters, "turn": np.asarray(turn)})


def _find(
    pages: Sequence[_Page], paced: Sequence[Drawing], figure: str, known: Mapping[str, ComplexArray]
) -> Plan | None:
    """The plan on the sheet that explains it best, kept there. `paced`: the drawing at likely scales."""
    laid = []
    for page in pages:
        given = {**_given(page, pages), **known}
        for drawing in paced:
            plans = regular_plans(page.lines, _turned(page, pages, drawing), figure, given)
            if plans:
                laid.append((page, given, plans))
    laid.sort(key=lambda one: -one[2][0].score)
    # Where no sheet shows the plan as it should be, a mistaken one may be on either.
    clear = bool(laid) and laid[0][2][0].place.score > CLEAR
    best: tuple[_Page, Plan] | None = None
    for page, given, plans in laid[:1] if clear else laid:
        plan = best_plan(plans, page.lines, figure, given)
        if plan is not None and (best is None or plan.score > best[1].score):
            best = page, plan
    if best is None or best[1].score < LEAST_PLAN:
        return None
    best[0].plans[figure] = best[1]
    return best[1]


def _set_apart(pages: Sequence[_Page], plan: Plan | None) -> None:
    """One stroke of ink cannot be in two figures: what surely is this plan's is no other's."""
    page = next((page for page in pages if plan is not None and plan in page.plans.values()), None)
    if plan is None or page is None or plan.score < SURE_PLAN:
        return
    used = {int(one) for row in plan.found.stroke if row >= 0 for one in plan.lines.members[row]}
    own = np.isin(page.lines.members, list(used)).any(axis=1)
    page.lines = page.lines.take(np.flatnonzero(~own))


def _nodes(plan: Plan) -> Given:
    return {name: np.asarray(at) for name, at in zip(plan.found.expected.names, plan.fit.at, strict=True)}


def _paced(drawing: Drawing, at: Given) -> list[Drawing]:
    """The drawing at the velocity scale that the drawn plan follows, and at the one declared.

    Normal components are taken from drawn velocities: with a wrong scale they come out wrong.
    """
    vectors = [v for v in drawing.construction.vectors_of(VELOCITY_PLAN) if v.name in drawing.parameters]
    declared = float(np.ravel(drawing.parameters["kv"])[0])
    for vector in vectors:
        real = float(np.ravel(drawing.parameters[vector.name])[0])
        drawn = abs(complex(at[vector.head] - at[vector.tail]))
        if drawn > 1.0 and real:
            followed = abs(real) / drawn
            if SAME_SCALE < followed / declared < 1.0 / SAME_SCALE:
                return [drawing]
            own = Drawing(drawing.construction, {**drawing.parameters, "kv": np.array([followed])})
            return [own, drawing] if followed / declared < WILD and declared / followed < WILD else [own]
    return [drawing]


def _readings(pages: Sequence[_Page], drawing: Drawing, wanted: Collection[str]) -> list[Reading]:
    """One Reading per sheet; what is nowhere is unread on the sheet where its figure is, else on the last."""
    readings = []
    named: set[str] = set()
    for page in pages:
        figures: dict[str, Figure] = {}
        unread: list[Unread] = []
        if page.sketch is not None:
            figures[MECHANISM] = figure_of_sketch(page.sketch)
        for figure, plan in page.plans.items():
            figures[figure], missing = figure_of_plan(plan, page.sheet.scale_se)
            unread.extend(one for one in missing if not wanted or one.name in wanted)
        named.update(name for one in figures.values() for name in (*one.nodes, *one.vectors))
        named.update(one.name for one in unread)
        readings.append(Reading(figures, tuple(unread)))
    nowhere = _nowhere(drawing, wanted, named)
    if nowhere and readings:
        last = readings[-1]
        readings[-1] = Reading(last.figures, (*last.unread, *nowhere), last.problems)
    return readings


def _nowhere(drawing: Drawing, wanted: Collection[str], named: set[str]) -> list[Unread]:
    told = {VELOCITY_PLAN: "velocity plan", ACCELERATION_PLAN: "acceleration plan"}
    missing = []
    for name in wanted:
        if name in named:
            continue
        vector = drawing.construction.vectors.get(name)
        if vector is None:
            missing.append(Unread(name, "it is no vector or node of this assignment"))
            continue
        figure = VELOCITY_PLAN if vector.scale == "kv" else ACCELERATION_PLAN
        missing.append(Unread(name, f"no {told[figure]} was found on the sheets"))
    return missing
