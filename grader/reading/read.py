"""Read a student's sheets: from strokes in millimetres to named vectors with standard errors."""

import cmath
import math
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from functools import cache, partial

import numpy as np

from grader.reading.apart import told_apart
from grader.reading.by_ink import Look
from grader.reading.expected import Edge
from grader.reading.lettering import lettered, support
from grader.reading.lines import Lines, lines_of
from grader.reading.nodes import NodeFit
from grader.reading.on_sketch import SketchPage, with_additions
from grader.reading.page_scale import given_length, no_surer
from grader.reading.plans import EXPLAINED, PlanProblem, PlanReading, best_plan, regular_plans
from grader.reading.sketch import SketchReading, drawings, find_sketch
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Figure,
    FloatArray,
    Ink,
    InkMap,
    NodePlaces,
    NodeView,
    OtherReading,
    Reading,
    ReadNode,
    ReadVector,
    Reason,
    Sheet,
    Unread,
    Value,
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
WILD = 3.0
"""If the drawn scale differs by more than this factor, the declared one was surely not followed."""
Nodes = dict[str, ComplexArray]
"""Nodes already read, complex mm on the sheet, by name."""


@dataclass(slots=True)
class _PageReading:
    """The figures read on one sheet so far."""

    lines: Lines
    ink: Ink
    sheet: Sheet
    look: Look | None
    position: int | None
    """The student's own one."""
    least: float
    """Least nats of a plan there."""
    beside: Mapping[int, Drawing] = field(default_factory=dict)
    """Drawings of all positions, by number, if all of them may stand on the sheet."""
    told: float = 1.0
    """The chance that the plan read there is the own position's."""
    sketch: SketchReading | None = None
    plans: dict[str, PlanReading] = field(default_factory=dict)


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
        no_surer(lettered(reading, page.ink.letters, drawing.construction, renamed), page.told)
        for reading, page in zip(_readings(pages, drawing, wanted), pages, strict=True)
    ]
    added = [name for name in wanted if name in drawing.construction.on_sketch]
    return with_additions(readings, [*map(_sketch_page, pages)], drawing, added) if added else readings


def _sketch_page(page: _PageReading) -> SketchPage:
    circles = page.ink.circles[:, 0] - 1j * page.ink.circles[:, 1]
    if page.sketch is None:
        return SketchPage(page.lines, np.zeros(0, np.int64), circles, 0.0)
    return SketchPage(lines_of(page.ink), page.sketch.members, circles, page.sketch.guide_turn_rad)


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
    return velocities if acceleration is None else {**velocities, **_nodes(acceleration)}


def _find_forces(
    pages: Sequence[_PageReading], drawing: Drawing, known: Nodes, renamed: Mapping[str, str]
) -> None:
    """Find the force plans, one after another: each takes reactions over from those before it."""
    for figure in filter(group_of, drawing.construction.figures):
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
        problem = PlanProblem(page.lines, figure, given, page.ink.letters, renamed, links, page.look)
        for drawing in at_scales:
            turned = Drawing(drawing.construction, {**drawing.parameters, "turn": np.asarray(guide_turn)})
            if page.beside and page.position is not None:
                every = {**page.beside, page.position: turned}
                problem, page.told = told_apart(problem, every, page.position)
            laid.append(_LaidPlan(page, problem, turned, regular_plans(problem, turned)))
        if zone_of(figure) in page.sheet.zones and any(one.is_explained for one in laid):
            break
    laid.sort(key=lambda one: -one.score)
    # If no sheet shows the right plan, a mistaken one may be on either.
    if laid and laid[0].is_explained:
        laid = laid[:1]
    elif figure == VELOCITY_PLAN:
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
    return {name: np.asarray(at) for name, at in zip(names, _in_usual_order(plan).at, strict=True)}


# Readings of the sheets ----------------------------------------------------------------------------


def _readings(pages: Sequence[_PageReading], drawing: Drawing, wanted: Collection[str]) -> list[Reading]:
    """Return one Reading per sheet; requested items found nowhere are unread on the last sheet."""
    readings = []
    is_backwards = False
    for page in pages:
        figures: dict[str, Figure] = {}
        unread: list[Unread] = []
        if page.sketch is not None:
            figures[MECHANISM] = figure_of_sketch(page.sketch)
        for figure, plan in page.plans.items():
            figures[figure], missing = figure_of_plan(plan, page.sheet.scale_se, page.ink.where)
            is_backwards |= bool(group_of(figure)) and points_backwards(plan, page.ink.where)
            if is_backwards:
                # Later polygons take forces over in their sense.
                figures[figure] = no_surer(Reading({figure: figures[figure]}), MOST_OPEN).figures[figure]
            unread.extend(gap for gap in missing if not wanted or gap.name in wanted)
        readings.append(Reading(figures, tuple(unread)))
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


# Named nodes and vectors with their errors ---------------------------------------------------------

BLANK = 0.25
"""Share of a vector's length that other lines may ink if the vector itself is not drawn."""
INKED = 0.9
"""Share from which it is drawn, even if its stroke is another's too; it is read from its nodes."""
DASHED = 0.75
"""Share under which a sum of components is not drawn: 68 dashed ones had 0.83 and more, 36 of 38 not drawn
had less."""
ON_IT_PX = 1
"""Offset at which such a stroke's ink may begin: of vectors a degree apart only one may be drawn."""
LEAST_PLACED = 0.6
"""The prediction says nothing about the reading of a force that its strokes place less surely."""
AGREES_MM, AGREES_SHARE = 0.5, 0.005
"""A force this near to its prediction, and in addition this share of it, was drawn and read so."""
ODDS_AGREES, ODDS_OFF = 12.0, 0.45
"""Factors of the odds that a force is right if it lies as near, and if it lies off: of 261 vectors of
simulated sheets that lay off 26 were misread, none of the 103 that were surer than 0.95."""
BEYOND_MM = (0.7, 4.0)
LEAST_ARROWED_MM = 12.0
BARB_MM, ASIDE_MM = (1.0, 3.4), 0.45
"""Forces whose arrowheads are looked for: their least length; where barbs' ink is along and beside them."""
BACKWARDS = -0.5
"""A sum of more ink at heads than at tails, below which the arrowheads stand at the tails."""
MIDDLE = 0.3, 0.7
"""Arrowheads in the middle of a force have their ink between these shares of its length."""
MOST_OPEN = 0.8
"""Most confidence in a line of two opposite forces with ink behind its end, of an arrowhead perhaps; and in a
tiny force or a sum without its own stroke: many are left out."""
LEAST_VECTOR_MM = 2.0
"""A shorter vector is read from its nodes, with or without a stroke."""


def figure_of_sketch(sketch: SketchReading) -> Figure:
    """Return joints of the mechanism."""
    fit = sketch.fit
    names = sketch.assignment.expected.names
    nodes = {name: _node(fit, row, within(_node_cov(fit, row))) for row, name in enumerate(names)}
    return Figure(nodes, {})


def figure_of_plan(plan: PlanReading, scale_se: float, where: InkMap) -> tuple[Figure, list[Unread]]:
    """Return nodes and vectors of a plan; for those not drawn, the reason.

    Arguments: `scale_se` is the sheet's relative standard error of lengths, `where` its ink.
    """
    fit, names = plan.fit, plan.assignment.expected.names
    explanations = _explanations(plan, fit)
    absent = dict(plan.hypothesis.absent)
    vectors, unread = _vectors(plan, fit, explanations, scale_se, where)
    fit, at = _in_usual_order(plan), explanations.at
    at = at if plan.usual is None else at @ plan.usual.T
    nodes = {
        name: _node(fit, row, Signs(within(_node_cov(fit, row)), named).confidence())
        for row, name in enumerate(names)
        if name not in absent and np.isfinite(fit.at[row])
        for _, named in explanations.of(at[:, row])[:1]
    }
    unread.extend(Unread(name, reason) for name, reason in absent.items())
    construction = plan.hypothesis.drawing.construction
    for vector in construction.vectors_of(construction.figure_of(names[0])):
        reason = absent.get(vector.head, absent.get(vector.tail))
        if reason is not None and vector.name not in vectors:
            unread.append(Unread(vector.name, reason, is_blank=vector.head in absent))
    edges = plan.assignment.expected.edges if plan.usual is not None else ()
    drawn = {edge.name: (complex(plan.fit.at[edge.tail]), complex(plan.fit.at[edge.head])) for edge in edges}
    return Figure(_no_surer(nodes, vectors, plan), vectors, drawn), unread


def _in_usual_order(plan: PlanReading) -> NodeFit:
    """Return the nodes of a plan; of a force polygon where its vectors put them in the usual order."""
    fit, rows = plan.fit, plan.usual
    if rows is None:
        return fit
    both = np.kron(rows, np.eye(2))
    return replace(fit, at=rows @ fit.at, cov=both @ fit.cov @ both.T)


def _no_surer(
    nodes: Mapping[str, ReadNode], vectors: Mapping[str, ReadVector], plan: PlanReading
) -> dict[str, ReadNode]:
    """Limit the nodes' confidence to that of the surest vector that starts or ends there."""
    best = dict.fromkeys(nodes, 0.0)
    for name, read in vectors.items():
        vector = plan.hypothesis.drawing.construction.vectors[name]
        for end in (vector.tail, vector.head):
            best[end] = max(best.get(end, 0.0), read.confidence)
    return {name: replace(node, confidence=min(node.confidence, best[name])) for name, node in nodes.items()}


def _node_cov(fit: NodeFit, index: int) -> FloatArray:
    """Return (2, 2) covariance of one node."""
    rows = slice(2 * index, 2 * index + 2)
    return fit.cov[rows, rows]


def _node(fit: NodeFit, index: int, confidence: float) -> ReadNode:
    return ReadNode(complex(fit.at[index]), _node_cov(fit, index), confidence)


def _vectors(
    plan: PlanReading, fit: NodeFit, explanations: "_Explanations", scale_se: float, where: InkMap
) -> tuple[dict[str, ReadVector], list[Unread]]:
    expected = plan.assignment.expected
    vectors: dict[str, ReadVector] = {}
    unread: list[Unread] = []
    is_polygon = bool(group_of(plan.figure))
    for index, edge in enumerate(expected.edges):
        if plan.hypothesis.is_side(edge.name):
            continue
        span = complex(fit.at[edge.head] - fit.at[edge.tail])
        row = int(plan.assignment.stroke[index])
        if row < 0 and abs(span) > LEAST_VECTOR_MM:
            # The corners of a force polygon have no letters.
            between: dict[str, Value] = {"name": edge.name}
            if not is_polygon:
                between = {"start": expected.names[edge.tail], "end": expected.names[edge.head]}
            at = complex(fit.at[edge.tail]), complex(fit.at[edge.head])
            on_it = where.share_inked(*at, ON_IT_PX)
            if on_it < DASHED if edge.optional else where.share_inked(*at) <= BLANK:
                unread.append(
                    Unread(edge.name, Reason("not_found" if is_polygon else "blank", between), is_blank=True)
                )
                continue
            if not edge.optional and on_it < INKED:
                unread.append(Unread(edge.name, Reason("not_found" if is_polygon else "no_stroke", between)))
                continue
        cov = _difference_cov(fit, edge, span, scale_se)
        spans = explanations.at[:, edge.head] - explanations.at[:, edge.tail]
        is_double = is_polygon and _is_double(plan, edge)
        (_, named), *others = explanations.of(spans, EITHER_MM if is_double else NEAR_MM)
        signs = Signs(within(cov), named, off_mm=0.0)
        if row >= 0:
            off_mm = float(np.abs(fit.residual_mm[index]).max())
            signs = replace(signs, off_mm=off_mm, marked=_marked(plan, fit, edge, row))
        # A long vector is never more certain than the sheet's scale.
        most = math.erf(NEAR_MM / max(math.sqrt(2.0) * scale_se * abs(span), 1e-9))
        sure = signs.confidence()
        if is_polygon:
            seen = within(_difference_cov(plan.seen or fit, edge, span, scale_se))
            sure = _weighed(sure, span, _predicted(plan, edge), seen)
            is_tiny = min(abs(span), abs(_predicted(plan, edge))) < LEAST_VECTOR_MM
            has_own = row >= 0 and not plan.assignment.shared[index]
            is_inferred = edge.optional and not (has_own or is_double)
            if is_tiny or is_inferred or (is_double and _goes_on(where, complex(fit.at[edge.tail]), span)):
                sure = min(sure, MOST_OPEN)
        read = vector_of(span, cov, min(sure, most, HIGHEST))
        rivals = (
            OtherReading(abs(other), _degrees(other), replace(signs, named=together).confidence())
            for other, together in others
        )
        vectors[edge.name] = replace(read, others=tuple(rivals))
    return vectors, unread


def _predicted(plan: PlanReading, edge: Edge) -> complex:
    """Return a vector as it follows from the data and from the figures read before."""
    at, spin = plan.placed.at, plan.pose.size * np.exp(1j * plan.pose.turn_rad)
    return complex((at[edge.head] - at[edge.tail]) * plan.pose.size / spin)


def _weighed(sure: float, span: complex, predicted: complex, placed: float) -> float:
    """Return the confidence in a force, more where it lies as predicted, less where it lies off.

    Data give it, or another figure where it was drawn as well: a misread would seldom come as near. If the
    strokes hardly place it, it lies there because it was looked for there.
    """
    off, near = abs(span - predicted), AGREES_MM + AGREES_SHARE * abs(predicted)
    odds = ODDS_AGREES if off < near and placed >= LEAST_PLACED else ODDS_OFF
    return sure * odds / (sure * odds + 1.0 - sure)


def _is_double(plan: PlanReading, edge: Edge) -> bool:
    """Return whether another vector, an opposite force, has the same two ends."""
    edges = plan.assignment.expected.edges
    return sum({one.tail, one.head} == {edge.tail, edge.head} for one in edges) > 1


def points_backwards(plan: PlanReading, where: InkMap) -> bool:
    """Return whether the arrowheads of a force polygon stand at the tails of its forces.

    Sides in another order and the opposite sense leave the same lines. Two opposite forces in one line have
    an arrowhead at both ends in either sense.
    """
    forward = 0.0
    for edge in plan.assignment.expected.edges:
        tail, head = complex(plan.fit.at[edge.tail]), complex(plan.fit.at[edge.head])
        if edge.optional or _is_double(plan, edge) or not abs(head - tail) > LEAST_ARROWED_MM:
            continue
        first, last = (tail + share * (head - tail) for share in MIDDLE)
        middle = _beside(where, first, last)
        if min(middle) == 0.0:
            forward += _barbs(where, head, tail) - _barbs(where, tail, head)
    return forward < BACKWARDS


def _barbs(where: InkMap, end: complex, other: complex) -> float:
    """Return the share of ink beside a vector near its end, on both sides."""
    out = (other - end) / abs(other - end)
    near, far = (end + along * out for along in BARB_MM)
    return sum(_beside(where, near, far))


def _beside(where: InkMap, first: complex, last: complex) -> list[float]:
    """Return the share of ink along a segment, at its left and at its right."""
    aside = 1j * ASIDE_MM * (last - first) / abs(last - first)
    return [where.share_inked(first + one, last + one, 0) for one in (aside, -aside)]


def _goes_on(where: InkMap, tail: complex, span: complex) -> bool:
    """Return whether there is ink in line with a vector behind one of its ends."""
    out = span / max(abs(span), LEAST_VECTOR_MM)
    ends = ((tail - near * out, tail + span + near * out) for near in BEYOND_MM)
    return any(where.share_inked(*piece) > BLANK for piece in zip(*ends, strict=True))


def _difference_cov(fit: NodeFit, edge: Edge, span: complex, scale_se: float) -> FloatArray:
    """Return the covariance (2, 2) of a vector, from both its nodes and the sheet's scale."""
    difference = np.zeros((2, fit.cov.shape[0]))
    for axis in (0, 1):
        difference[axis, 2 * edge.head + axis], difference[axis, 2 * edge.tail + axis] = 1.0, -1.0
    scaled = scale_se * np.array([span.real, span.imag])
    return np.asarray(difference @ fit.cov @ difference.T + np.outer(scaled, scaled))


def vector_of(span: complex, cov: FloatArray, confidence: float) -> ReadVector:
    """Return length and direction with their standard errors."""
    length = float(abs(span))
    along = np.array([span.real, span.imag]) / max(length, 1e-9)
    across = np.array([-along[1], along[0]])
    se_along, se_across = (math.sqrt(max(float(axis @ cov @ axis), 0.0)) for axis in (along, across))
    se_deg = math.degrees(math.atan2(se_across, max(length, 1e-9)))
    direction = _degrees(span) if length > se_across else None
    return ReadVector(length, se_along, direction, se_deg, confidence)


def _degrees(span: complex) -> float:
    return math.degrees(cmath.phase(span)) % 360.0


# Confidence ----------------------------------------------------------------------------------------

MARKED_MM = 0.5
"""A tip within this of a node marks it."""
NEAR_MM = 0.5
"""Largest error of a right node: a pencil stroke's width."""
EITHER_MM = 1.5
"""The same of two lines side by side, for opposite forces: either is the vector as drawn."""
RIVAL_NATS = 12.0
"""Rivals with a score lower by more are left out."""
MOST_OTHERS = 3
"""Most alternatives of one vector that are reported: the rest has a share of a few hundredths."""
TEMPERATURE = 3.0
"""Scores are divided by this: errors of one student's strokes are not independent."""
WEIGHTS = {"placed": 0.2, "named": 0.5, "off_mm": -2.2, "marked": 2.4}
CONSTANT = -1.85
"""Coefficients of a logistic regression on 1,800 vectors of eleven kinds of sheets, each kind judged by the
other ten, the constant lowered by 0.6, since a wrong mark costs more than a check. A line's thinness, a
mistaken plan, further tips, and how surely the ink has a node at both ends add nothing to them."""
PLACED_AND = 0.3
"""Largest excess of a confidence over the geometric probability, whose standard errors are wide."""
HIGHEST = 0.985
"""Highest confidence: of those predicted higher, 98 of 100 were right."""
WORST_MM = 1.5
"""Larger residuals lower the confidence no further."""


@dataclass(frozen=True, slots=True)
class Signs:
    """The features from which the confidence in a vector (or node) is computed.

    Attributes
    ----------
    placed : geometric probability of lying within half a millimetre, from the fit's covariance
    named : share of the explanations that have it there
    off_mm : largest distance of its nodes from its stroke
    marked : probability of the less likely of the tips that mark the vector's two ends on its stroke
    """

    placed: float
    named: float
    off_mm: float = 0.1
    marked: float = 0.4

    def confidence(self) -> float:
        """Return the probability that the name is right and the vector read within half a millimetre."""
        inputs = asdict(self) | {
            "placed": _log_odds(self.placed),
            "named": _log_odds(self.named),
            "off_mm": min(self.off_mm, WORST_MM),
        }
        score = CONSTANT + sum(weight * inputs[name] for name, weight in WEIGHTS.items())
        return min(1.0 / (1.0 + math.exp(-score)), self.placed + PLACED_AND, HIGHEST)


def _log_odds(probability: float) -> float:
    return math.log((probability + 0.002) / (1.002 - probability))


def within(cov: FloatArray, radius_mm: float = NEAR_MM) -> float:
    """Return the probability that a Gaussian error of this covariance (2, 2) is shorter than the radius."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 1e-12))
    first, second = (math.erf(radius_mm / (s * math.sqrt(2.0))) for s in spread)
    return float(first * second)


@dataclass(frozen=True, slots=True)
class _Explanations:
    """A plan and its rivals: weights by their scores (k,), the plan's own 1 first, and nodes (k, n), mm.

    A node that an explanation lacks is nan.
    """

    weight: FloatArray
    at: ComplexArray
    named: float

    def of(self, values: ComplexArray, near_mm: float = NEAR_MM) -> list[tuple[complex, float]]:
        """Return the alternatives for a value (k,): the plan's own, then others, likeliest first.

        Each has the probability of it and those before it, among all explanations, including those that lack
        it; values within `near_mm` are one.
        """
        left = np.isfinite(values)
        total, together = self.weight.sum(), 0.0
        found: list[tuple[complex, float]] = []
        while left.any() and len(found) <= MOST_OTHERS:
            near = left & (np.abs(values - values[:, None]) < near_mm)
            share = near @ self.weight / total
            row = int(np.argmax(np.where(left, share, 0.0))) if found else 0
            together += float(share[row])
            found.append((complex(values[row]), self.named * min(together, 1.0)))
            left = left & ~near[row]
        return found


def _explanations(plan: PlanReading, fit: NodeFit) -> _Explanations:
    names = plan.assignment.expected.names
    # Many hypotheses name the same strokes, and so have their nodes in the same places.
    nodes_by_strokes = {plan.strokes: fit.at}
    weight, places = [1.0], [fit.at]
    # In the order of this plan's sides, whatever that of its rivals.
    own = None if plan.usual is None else np.linalg.inv(plan.usual)
    for rival in plan.rivals:
        if rival.score <= plan.score - RIVAL_NATS:
            continue
        if rival.strokes not in nodes_by_strokes:
            there = _in_usual_order(rival).at
            nodes_by_strokes[rival.strokes] = there if own is None else own @ there
        at = dict(zip(rival.assignment.expected.names, nodes_by_strokes[rival.strokes], strict=True))
        weight.append(math.exp(min(0.0, rival.score - plan.score) / TEMPERATURE))
        places.append(np.array([at.get(name, np.nan) for name in names]))
    return _Explanations(np.array(weight), np.array(places), plan.named)


def _marked(plan: PlanReading, fit: NodeFit, edge: Edge, row: int) -> float:
    """Return how clearly tips mark a vector's two ends on its stroke."""
    marked = []
    along = complex(plan.lines.along[row])
    for node, other in ((edge.tail, edge.head), (edge.head, edge.tail)):
        forward = np.array([((fit.at[node] - fit.at[other]) * np.conj(along)).real > 0])
        tips, sure = plan.lines.tips_towards(np.array([row]), forward)
        apart = np.abs(tips[0] - ((fit.at[node] - plan.lines.start[row]) * np.conj(along)).real)
        marked.append(float(sure[0, apart < MARKED_MM].max(initial=0.0)))
    return min(marked)
