"""Read a student's sheets: from strokes in millimetres to named vectors with standard errors."""

import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache, partial

import numpy as np

from grader.reading.altitudes import with_altitudes
from grader.reading.apart import UNPLACED, Apart, told_apart
from grader.reading.arrowheads import TOLD_MM, forward_mm
from grader.reading.by_ink import Look
from grader.reading.lettering import lettered, support
from grader.reading.lines import Lines, lines_of
from grader.reading.on_sketch import SketchPage, with_additions
from grader.reading.page_scale import given_length, no_surer
from grader.reading.plans import EXPLAINED, NO_CHANCE, PlanProblem, PlanReading, best_plan, regular_plans
from grader.reading.sketch import SketchReading, drawings, find_sketch
from grader.reading.vectors import MOST_OPEN, figure_of_plan, figure_of_sketch, in_usual_order
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Figure,
    Ink,
    InkMap,
    NodePlaces,
    NodeView,
    Reading,
    Reason,
    Sheet,
    Unread,
)
from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.mistakes import Drawing
from reference.geometry import ComplexArray
from reference.quantities import group_of, zone_of

LEAST_SKETCH = 15.0
LEAST_PLAN = 12.0
"""Nats: a figure with a smaller score may be chance."""
LEAST_EXPECTED = 8.0
"""The same where a sheet has a plan of each position: at a dead point it is one stroke."""
SURE_PLAN = 40.0
"""Nats from which a plan's strokes belong to no other plan."""
MOST_SHARED = 0.5
"""Share of a plan's strokes that another plan may take as well: both may use a line or two."""
LEAST_DRAWN_MM, MOST_DRAWN_MM = 15.0, 200.0
"""Lengths of the vectors given at the start of a plan: they fit on a sheet and can be measured."""
SAME_SCALE = 0.95
"""Ratio of the declared scale and the drawn one from which they are the same."""
BACKWARDS = 0.1
"""Most confidence in force polygons if all arrowheads of a sheet say the opposite, as of one sheet in 62."""
WILD = 3.0
"""If the drawn scale differs by more than this factor, the declared one was surely not followed."""
Nodes = dict[str, ComplexArray]
"""Nodes already read, complex mm on the sheet, by name."""


@dataclass(slots=True)
class _PageReading:
    """The figures read on one sheet so far."""

    strokes: Lines
    ink: Ink
    sheet: Sheet
    look: Look | None
    position: int | None
    """The student's own one."""
    least: float
    """Least nats of a plan there."""
    beside: Mapping[int, Drawing] = field(default_factory=dict)
    """Drawings of all positions, by number, if all of them may stand on the sheet."""
    apart: dict[str, Apart] = field(default_factory=dict)
    """The own position's part of it, by figure."""
    sketch: SketchReading | None = None
    plans: dict[str, PlanReading] = field(default_factory=dict)
    lines: Lines = field(init=False)
    """Those of the strokes that may belong to a figure not read yet."""

    def __post_init__(self) -> None:
        self.lines = self.strokes


def read_figures(
    drawn: Sequence[tuple[Ink, Sheet]],
    assignment: Assignment,
    variant: Variant | None,
    scales: Scales | None,
    wanted: Collection[str],
    places: Callable[[InkMap, Sequence[NodeView]], NodePlaces] | None = None,
) -> list[Reading]:
    """Name the drawn vectors of a student's sheets.

    Arguments
    ---------
    drawn : the ink of each sheet, and the sheet
    variant : the student's own, None where not known; the drawing may follow another one
    scales : as declared, None where not; the drawing may follow others
    wanted : names of vectors (and nodes) asked for: each is in a figure or in `unread` of one reading
    places : tells of nodes where an ink map has them; without it the strokes alone place them

    Returns one Reading per sheet.
    """
    every = _all_positions(assignment, variant, scales)
    own_position = None if variant is None else variant.position
    least = LEAST_EXPECTED if every else LEAST_PLAN
    pages = [
        _PageReading(lines_of(ink), ink, sheet, places and partial(places, ink.where), own_position, least)
        for ink, sheet in drawn
    ]
    for page in (one for one in pages if not one.sheet.zones):
        page.beside = every
    own, others = _drawings(assignment, variant, scales)
    renamed = assignment.file.names
    for page in pages:
        letters_nats = partial(support, letters=page.ink.letters, renamed=renamed)
        sketch = find_sketch(page.lines, page.ink.circles, own, others, letters_nats)
        if sketch is not None and sketch.score >= LEAST_SKETCH:
            page.sketch = sketch
    followed = [page.sketch.drawing for page in pages if page.sketch is not None] if variant is None else []
    drawing = _measurable((followed or own)[0], assignment, variant)
    if every and any(page.sketch is None for page in pages):
        # Such a sheet has one figure: the mechanisms, or the plans.
        for page in (one for one in pages if one.sketch is not None):
            page.lines = page.lines.take(np.zeros(0, np.int64))
    known: Nodes = {}
    if VELOCITY_PLAN in drawing.construction.figures:
        known = _find_motion(pages, drawing, renamed, accelerations=_asks_accelerations(wanted, drawing))
    _find_forces(pages, drawing, known, renamed)
    readings = [
        lettered(reading, page.ink.letters, drawing.construction, renamed)
        for reading, page in zip(_readings(pages, drawing, wanted), pages, strict=True)
    ]
    added = [name for name in wanted if name in drawing.construction.on_sketch]
    sketches = [*map(_sketch_page, pages)]
    readings = with_additions(readings, sketches, drawing, added) if added else readings
    return with_altitudes(readings, sketches, drawing.construction)


def _sketch_page(page: _PageReading) -> SketchPage:
    circles = page.ink.circles[:, 0] - 1j * page.ink.circles[:, 1]
    links = np.zeros(0, np.int64) if page.sketch is None else page.sketch.members
    turn = 0.0 if page.sketch is None else page.sketch.guide_turn_rad
    return SketchPage(page.strokes, links, circles, turn, page.ink.where)


# The drawing to look for ---------------------------------------------------------------------------


def _drawings(
    assignment: Assignment, variant: Variant | None, scales: Scales | None
) -> tuple[list[Drawing], Callable[[], list[Drawing]]]:
    """Return the student's own drawing (any variant's, if it is not known), and others' if requested."""
    everybody = assignment.variants()
    if variant is None:
        return drawings(assignment, everybody, scales), list
    # Drawn beside the student's own, another position is no mistake.
    same = {variant.position} if assignment.shared_positions else {one.position for one in everybody}
    others = [other for other in everybody if other != variant and other.position in same]
    return drawings(assignment, [variant], scales), cache(lambda: drawings(assignment, others, None))


def _all_positions(
    assignment: Assignment, variant: Variant | None, scales: Scales | None
) -> dict[int, Drawing]:
    """Return the drawings of the student's positions, by number, if a sheet may have all of them."""
    if variant is None or variant.position is None:
        return {}
    numbers = assignment.shared_positions
    every = drawings(assignment, [replace(variant, position=number) for number in numbers], scales)
    return dict(zip(numbers, every, strict=True))


def _measurable(drawing: Drawing, assignment: Assignment, variant: Variant | None) -> Drawing:
    """Return the drawing at the declared scales, or at the assignment's own if those do not fit the paper."""
    usual = assignment.scales([variant or assignment.variants()[0]])
    parameters = dict(drawing.parameters)
    longest: dict[str, float] = {}
    for vector in drawing.construction.vectors.values():
        real = given_length(parameters, vector.name)
        if real is not None:
            drawn_mm = real / float(np.ravel(parameters[vector.scale])[0])
            longest[vector.scale] = max(drawn_mm, longest.get(vector.scale, 0.0))
    for scale, drawn_mm in longest.items():
        if drawn_mm and not LEAST_DRAWN_MM < drawn_mm < MOST_DRAWN_MM:
            parameters[scale] = getattr(usual, scale)
    return Drawing(drawing.construction, parameters)


def _asks_accelerations(wanted: Collection[str], drawing: Drawing) -> bool:
    vectors = drawing.construction.vectors
    return not wanted or any(name in vectors and vectors[name].scale != "kv" for name in wanted)


def _at_velocity_scales(drawing: Drawing, at: Nodes) -> list[Drawing]:
    """Return the drawing at the velocity scale of the drawn plan, and at the declared one.

    Normal components are taken from drawn velocities: with a wrong scale they become wrong.
    """
    vectors = [v for v in drawing.construction.vectors_of(VELOCITY_PLAN) if v.name in drawing.parameters]
    declared = float(np.ravel(drawing.parameters["kv"])[0])
    for vector in vectors:
        real = float(np.ravel(drawing.parameters[vector.name])[0])
        drawn_mm = abs(complex(at[vector.head] - at[vector.tail]))
        if drawn_mm > 1.0 and real:
            followed = abs(real) / drawn_mm
            if SAME_SCALE < followed / declared < 1.0 / SAME_SCALE:
                return [drawing]
            own = Drawing(drawing.construction, {**drawing.parameters, "kv": np.array([followed])})
            return [own, drawing] if followed / declared < WILD and declared / followed < WILD else [own]
    return [drawing]


# Plans ---------------------------------------------------------------------------------------------


def _find_motion(
    pages: Sequence[_PageReading], drawing: Drawing, renamed: Mapping[str, str], *, accelerations: bool
) -> Nodes:
    """Find the velocity plan, and the acceleration plan if asked for; return their nodes."""
    velocity = _find_plan(pages, [drawing], VELOCITY_PLAN, {}, renamed)
    velocities = {} if velocity is None else _nodes(velocity)
    if not accelerations:
        return velocities
    _set_apart(pages, velocity)
    at_scales = [drawing] if velocity is None else _at_velocity_scales(drawing, velocities)
    acceleration = _find_plan(pages, at_scales, ACCELERATION_PLAN, velocities, renamed)
    for page in filter(_has_no_velocities, pages):
        page.plans.clear()
        acceleration = _find_plan(pages, [drawing], ACCELERATION_PLAN, {}, renamed)
        _set_apart(pages, acceleration)
        velocity = _find_plan(pages, [drawing], VELOCITY_PLAN, {}, renamed)
        velocities = {} if velocity is None else _nodes(velocity)
    return velocities if acceleration is None else {**velocities, **_nodes(acceleration)}


def _find_forces(
    pages: Sequence[_PageReading], drawing: Drawing, known: Nodes, renamed: Mapping[str, str]
) -> None:
    """Find the force plans, one after another: each takes reactions over from those before it."""
    figures = [*filter(group_of, drawing.construction.figures)]
    if figures and any(page.sketch is not None and page.sketch.score > SURE_PLAN for page in pages):
        # Strokes of polygons may look like a sketch beside the one on another sheet.
        for page in pages:
            page.sketch = page.sketch if page.sketch and page.sketch.score > SURE_PLAN else None
    for figure in figures:
        for found in [one for page in pages for one in page.plans.values()]:
            _set_apart(pages, found)
        plan = _find_plan(pages, [drawing], figure, known, renamed)
        if plan is not None:
            known = {**known, **_nodes(plan)}


def _find_plan(
    pages: Sequence[_PageReading],
    at_scales: Sequence[Drawing],
    figure: str,
    known: Nodes,
    renamed: Mapping[str, str],
) -> PlanReading | None:
    """Find the plan on the sheet that explains it best, and add it to that page.

    Arguments: `at_scales`, the drawing at likely scales; `known`, nodes of the plan before.
    """
    laid: list[_LaidPlan] = []
    # A printed sheet has a zone for the plan: it is searched first.
    for page in sorted(pages, key=lambda page: zone_of(figure) not in page.sheet.zones):
        joints, guide_turn = _sketched(page, pages)
        links = page.sketch.members if page.sketch is not None else np.zeros(0, np.int64)
        given = {**joints, **known}
        arrows = partial(forward_mm, where=page.ink.where) if group_of(figure) else None
        problem = PlanProblem(page.lines, figure, given, page.ink.letters, renamed, links, page.look, arrows)
        if group_of(figure) and page.sketch is not None and page.sketch.score > SURE_PLAN:
            # Reactions lie along links: their strokes would fit a force polygon as well.
            problem = replace(problem, lines=problem.free)
        for drawing in at_scales:
            turned = Drawing(drawing.construction, {**drawing.parameters, "turn": np.asarray(guide_turn)})
            if page.beside and page.position is not None and len(page.lines):
                page.apart[figure] = told_apart(problem, page.beside, page.position)
                problem = page.apart[figure].problem
            laid.append(_LaidPlan(page, problem, turned, regular_plans(problem, turned)))
        if zone_of(figure) in page.sheet.zones and any(one.is_explained for one in laid):
            break
    laid.sort(key=lambda one: -one.score)
    # If no sheet shows the right plan, a mistaken one may be on either.
    laid = laid[:1] if laid and laid[0].is_explained else laid
    if figure == VELOCITY_PLAN and laid and not (laid[0].is_explained and laid[0].score > NO_CHANCE):
        laid = [_without_accelerations(one) for one in laid]
    best: tuple[_PageReading, PlanReading] | None = None
    for one in laid:
        plan = best_plan(one.problem, one.drawing, one.plans)
        if plan is not None and (best is None or plan.score > best[1].score):
            best = one.page, plan
    if best is None or best[1].score < best[0].least:
        return None
    best[0].plans[figure] = best[1]
    return best[1]


@dataclass(frozen=True, slots=True)
class _LaidPlan:
    """The regular readings of a plan on one page at one scale, best first."""

    page: _PageReading
    problem: PlanProblem
    drawing: Drawing
    plans: list[PlanReading]

    @property
    def score(self) -> float:
        """Score of the best one."""
        return self.plans[0].score if self.plans else -math.inf

    @property
    def is_explained(self) -> bool:
        """True if the best one is taken as drawn."""
        return bool(self.plans) and self.plans[0].pose.score > EXPLAINED


def _without_accelerations(laid: _LaidPlan) -> _LaidPlan:
    """Exclude the strokes of a surely read acceleration plan from the velocities."""
    accelerations = regular_plans(replace(laid.problem, figure=ACCELERATION_PLAN), laid.drawing)
    if not accelerations or accelerations[0].score < max(SURE_PLAN, laid.score):
        return laid
    elsewhere = np.concatenate([laid.problem.elsewhere, accelerations[0].members])
    return replace(laid, problem=replace(laid.problem, elsewhere=elsewhere))


def _sketched(page: _PageReading, pages: Sequence[_PageReading]) -> tuple[Nodes, float]:
    """Return the drawn joints and the turn of the guides: of the same sheet's sketch, else of another's.

    Without a sketch there are no joints, and the exact ones are used.
    """
    sketch = next((other.sketch for other in (page, *pages) if other.sketch is not None), None)
    if sketch is None:
        return {}, 0.0
    names = sketch.assignment.expected.names
    return {
        name: np.asarray(at) for name, at in zip(names, sketch.fit.at, strict=True)
    }, sketch.guide_turn_rad


def _has_no_velocities(page: _PageReading) -> bool:
    """Return whether the velocity plan is made of strokes that the acceleration plan explains better."""
    velocity, acceleration = map(page.plans.get, (VELOCITY_PLAN, ACCELERATION_PLAN))
    if velocity is None or acceleration is None:
        return False
    shared = float(np.isin(velocity.members, acceleration.members).mean())
    return velocity.score < acceleration.score and shared > MOST_SHARED


def _set_apart(pages: Sequence[_PageReading], plan: PlanReading | None) -> None:
    """Remove the strokes of a certain plan from its page: they belong to no other figure."""
    page = next((page for page in pages if plan is not None and plan in page.plans.values()), None)
    if plan is None or page is None or plan.score < SURE_PLAN:
        return
    used = np.isin(page.lines.members, plan.members)
    page.lines = page.lines.take(np.flatnonzero(~used.any(axis=1)))


def _nodes(plan: PlanReading) -> Nodes:
    names = plan.assignment.expected.names
    return {name: np.asarray(at) for name, at in zip(names, in_usual_order(plan).at, strict=True)}


# Readings of the sheets ----------------------------------------------------------------------------


def _readings(pages: Sequence[_PageReading], drawing: Drawing, wanted: Collection[str]) -> list[Reading]:
    """Return one Reading per sheet; requested items found nowhere are unread on the last sheet."""
    readings = []
    is_told = is_backwards = False
    for page in pages:
        figures: dict[str, Figure] = {}
        unread: list[Unread] = []
        if page.sketch is not None:
            # Links of all positions lie across each other about the same pivots.
            sketched = Reading({MECHANISM: figure_of_sketch(page.sketch)})
            figures.update((no_surer(sketched, UNPLACED) if page.beside else sketched).figures)
        polygons = {figure: plan for figure, plan in page.plans.items() if group_of(figure)}
        forwards = {figure: forward_mm(plan, page.ink.where) for figure, plan in polygons.items()}
        # Polygons of one sheet that contradict each other are merely in doubt.
        is_opposite = sum(one or 0.0 for one in forwards.values()) < -TOLD_MM
        for figure, plan in page.plans.items():
            figures[figure], missing = figure_of_plan(plan, page.sheet, page.ink.where)
            forward = forwards.get(figure)
            if forward is not None:
                # Later polygons take forces over in their sense.
                is_told, is_backwards = forward > TOLD_MM, is_backwards or forward < -TOLD_MM
            if group_of(figure) and (is_backwards or not is_told):
                most = BACKWARDS if is_opposite else MOST_OPEN
                figures[figure] = no_surer(Reading({figure: figures[figure]}), most).figures[figure]
            if figure in page.apart:
                only = Reading({figure: figures[figure]})
                figures[figure] = no_surer(only, page.apart[figure].chance).figures[figure]
            unread.extend(gap for gap in missing if not wanted or gap.name in wanted)
        doubts = [one for figure, one in page.apart.items() if figure in figures and one.positions]
        problems = [Reason("position_unclear", {"positions": one.positions}) for one in doubts]
        readings.append(Reading(figures, tuple(unread), tuple(problems)))
    named = {gap.name for reading in readings for gap in reading.unread}
    for figure_read in (figure for reading in readings for figure in reading.figures.values()):
        named.update((*figure_read.nodes, *figure_read.vectors))
    read = {figure for page in pages for figure in page.plans}
    nowhere = tuple(_nowhere(drawing, [name for name in wanted if name not in named], read))
    if readings:
        readings[-1] = replace(readings[-1], unread=(*readings[-1].unread, *nowhere))
    return readings


_NO_PLAN = {"kv": "no_velocity_plan", "ka": "no_acceleration_plan", "kF": "no_force_plan"}


def _nowhere(drawing: Drawing, names: Sequence[str], read: Collection[str]) -> Iterator[Unread]:
    """Yield the requested items that are in no figure, nor among the unread ones, of those that were read."""
    on_sketch = drawing.construction.on_sketch
    for name in (name for name in names if name not in on_sketch):
        vector = drawing.construction.vectors.get(name)
        if vector is None:
            yield Unread(name, Reason("not_of_assignment"))
        elif group_of(figure := drawing.construction.figure_of(vector.head)) and figure in read:
            # A sum of sides that do not adjoin in the order of drawing.
            yield Unread(name, Reason("not_found", {"name": name}))
        else:
            yield Unread(name, Reason(_NO_PLAN[vector.scale]))
