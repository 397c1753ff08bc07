"""Figures of a sheet read: strokes in millimetres to named vectors with standard errors."""

import cmath
import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial

import numpy as np

from grader.reading import nodes as confidence
from grader.reading.expected import REGULAR, Edge
from grader.reading.lettering import lettered, support
from grader.reading.lines import Lines, lines_of
from grader.reading.nodes import Fit, Signs, sureness
from grader.reading.plans import Plan, best_plan, regular_plans
from grader.reading.sketch import Sketch, drawings, find_sketch
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Figure,
    FloatArray,
    Ink,
    Reading,
    ReadNode,
    ReadVector,
    Sheet,
    Unread,
)
from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.mistakes import Drawing
from reference.geometry import ComplexArray

LEAST_VECTOR_MM = 2.0
"""A shorter vector is known by its nodes, whether or not it has a stroke."""
MARKED_MM = 0.5
"""A tip within this of a node marks it."""
ELSEWHERE_MM = (0.8, 15.0)
"""A tip as far off as this may be the one that was meant."""


def figure_of_sketch(sketch: Sketch) -> Figure:
    """Joints of the mechanism."""
    places = confidence.of_places(sketch.fit)
    names = sketch.found.expected.names
    nodes = {name: _node(sketch.fit, index, float(places[index])) for index, name in enumerate(names)}
    return Figure(nodes, {})


def figure_of_plan(plan: Plan, scale_se: float) -> tuple[Figure, list[Unread]]:
    """Nodes and vectors of a plan; what is not drawn, with the reason.

    Arguments: `scale_se` is the sheet's relative standard error of lengths.
    """
    fit, names = plan.fit, plan.found.expected.names
    named = _named(plan, fit)
    placed = confidence.of_places(fit)
    absent = dict(plan.hypothesis.absent)
    nodes = {
        name: _node(fit, index, sureness(Signs(float(placed[index]), float(named[index]))))
        for index, name in enumerate(names)
        if name not in absent and np.isfinite(fit.at[index])
    }
    vectors, unread = _vectors(plan, fit, named, scale_se)
    unread.extend(Unread(name, reason) for name, reason in absent.items())
    for vector in plan.hypothesis.drawing.construction.vectors_of(figure_name(plan)):
        gone = next((absent[end] for end in (vector.head, vector.tail) if end in absent), None)
        if gone is not None and vector.name not in vectors:
            unread.append(Unread(vector.name, gone))
    return Figure(_no_surer(nodes, vectors, plan), vectors), unread


def _no_surer(
    nodes: Mapping[str, ReadNode], vectors: Mapping[str, ReadVector], plan: Plan
) -> dict[str, ReadNode]:
    """A node is no surer than the surest vector that starts or ends there: else its plan may be another."""
    best = dict.fromkeys(nodes, 0.0)
    for name, read in vectors.items():
        vector = plan.hypothesis.drawing.construction.vectors[name]
        for end in (vector.tail, vector.head):
            best[end] = max(best.get(end, 0.0), read.confidence)
    return {name: replace(node, confidence=min(node.confidence, best[name])) for name, node in nodes.items()}


def figure_name(plan: Plan) -> str:
    """Which plan it is."""
    return plan.hypothesis.drawing.construction.figure_of(plan.found.expected.names[0])


def _node(fit: Fit, index: int, sure: float) -> ReadNode:
    rows = slice(2 * index, 2 * index + 2)
    return ReadNode(complex(fit.at[index]), fit.cov[rows, rows], sure)


def _named(plan: Plan, fit: Fit) -> FloatArray:
    """How many of the explanations, by weight, have each node where it is read."""
    near = [other for other in plan.rivals if other.score > plan.score - confidence.FARTHEST]
    # Many hypotheses name the same strokes, and so have their nodes in the same places.
    places = {plan.strokes: fit.at}
    for other in near:
        if other.strokes not in places:
            places[other.strokes] = other.fit.at
    rivals = [
        confidence.Rival(
            dict(zip(other.found.expected.names, places[other.strokes], strict=True)), other.score
        )
        for other in near
    ]
    return confidence.of_names(plan.found.expected.names, fit.at, plan.score, rivals)


def _vectors(
    plan: Plan, fit: Fit, named: FloatArray, scale_se: float
) -> tuple[dict[str, ReadVector], list[Unread]]:
    vectors: dict[str, ReadVector] = {}
    unread: list[Unread] = []
    for index, edge in enumerate(plan.found.expected.edges):
        span = complex(fit.at[edge.head] - fit.at[edge.tail])
        row = int(plan.found.stroke[index])
        ends = f"{plan.found.expected.names[edge.tail]} and {plan.found.expected.names[edge.head]}"
        if row < 0 and abs(span) > LEAST_VECTOR_MM:
            unread.append(Unread(edge.name, f"no stroke between {ends} could be told apart"))
            continue
        cov = _difference_cov(fit, edge, span, scale_se)
        signs = Signs(
            placed=confidence.within(cov),
            named=float(min(named[edge.tail], named[edge.head])),
            off_mm=float(np.abs(fit.residual_mm[index]).max()) if row >= 0 else 0.0,
            thin=row >= 0 and bool(plan.lines.thin[row]),
            mistaken=plan.hypothesis.label not in REGULAR,
        )
        if row >= 0:
            marked, elsewhere = _marks(plan, fit, edge, row)
            signs = replace(signs, marked=marked, elsewhere=elsewhere)
        vectors[edge.name] = _vector(span, cov, sureness(signs))
    return vectors, unread


def _marks(plan: Plan, fit: Fit, edge: Edge, row: int) -> tuple[float, float]:
    """How clearly tips mark a vector's two ends on its stroke, and whether others might be meant."""
    marked, elsewhere = [], []
    along = complex(plan.lines.along[row])
    for node, other in ((edge.tail, edge.head), (edge.head, edge.tail)):
        forward = np.array([((fit.at[node] - fit.at[other]) * np.conj(along)).real > 0])
        tips, sure = plan.lines.tips_towards(np.array([row]), forward, head=node == edge.head)
        off = np.abs(tips[0] - ((fit.at[node] - plan.lines.start[row]) * np.conj(along)).real)
        near, far = off < MARKED_MM, (off >= ELSEWHERE_MM[0]) & (off < ELSEWHERE_MM[1])
        marked.append(float(sure[0, near].max(initial=0.0)))
        elsewhere.append(float(sure[0, far].max(initial=0.0)))
    return min(marked), max(elsewhere)


def _difference_cov(fit: Fit, edge: Edge, span: complex, scale_se: float) -> FloatArray:
    """Covariance (2, 2) of a vector, from both its nodes and the sheet's scale."""
    difference = np.zeros((2, fit.cov.shape[0]))
    for axis in (0, 1):
        difference[axis, 2 * edge.head + axis], difference[axis, 2 * edge.tail + axis] = 1.0, -1.0
    scaled = scale_se * np.array([span.real, span.imag])
    return np.asarray(difference @ fit.cov @ difference.T + np.outer(scaled, scaled))


def _vector(span: complex, cov: FloatArray, sure: float) -> ReadVector:
    """Length and direction with their standard errors."""
    length = float(abs(span))
    along = np.array([span.real, span.imag]) / max(length, 1e-9)
    across = np.array([-along[1], along[0]])
    se_along, se_across = (math.sqrt(max(float(axis @ cov @ axis), 0.0)) for axis in (along, across))
    se_deg = math.degrees(math.atan2(se_across, max(length, 1e-9)))
    direction = math.degrees(cmath.phase(span)) % 360.0 if length > se_across else None
    return ReadVector(length, se_along, direction, se_deg, sure)


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
