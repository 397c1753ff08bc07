"""The drawing as the diagnosis uses it: nodes and vectors with their errors, and their explanations."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from grader.comparison.evidence import Evidence
from grader.comparison.follow_through import ReplayResult
from grader.comparison.own import PlanBasis
from grader.comparison.scales import Scale
from grader.comparison.task import Task
from grader.given_data.owner import Owner
from grader.marking.diagnosis import Case, explained
from grader.marking.naming import CERTAIN, LINE_MISTAKES, drawn_instead, sure_of
from grader.records import MECHANISM
from reference.construction.elements import Balance, Coriolis, Normal, Parameters, View, is_force
from reference.construction.graph import Construction, Vector
from reference.construction.mistakes import Drawing, Mistake, laid_off, line_of, made_at
from reference.construction.steps import Given, TwoLines
from reference.construction.uncertainty import acts, trace
from reference.geometry import ComplexArray, FloatArray
from reference.quantities import OF_MOTION, kind_of
from reference.replay.explanations import AREA_MM, Covariance, Observation, Observations

LEAST_ERROR_MM = 0.15
"""Least standard error of a node, however well it is drawn and read."""
NO_ERRORS: ComplexArray = np.zeros(0, np.complex128)


NEARLY_CERTAIN = 0.95
"""A mistake named with this confidence is charged where it was made, however doubtful what was read is."""


def explain(
    task: Task, evidence: Evidence, settled: Mapping[str, Scale], *, owner: Owner | None = None
) -> ReplayResult:
    """The explanations of a drawing, the basis of its plans where that is certain, and the wrong vectors.

    Arguments: `owner` is whose data the drawing follows, None for the student's own.
    """
    case = case_of(task, evidence, settled, owner)
    explanations = explained(case)
    drawn, wrong = drawn_instead(explanations, case)
    if owner is not None and owner.of_whole is not None:
        wrong |= {MECHANISM}
    construction = task.construction
    certain = sure_of(explanations, CERTAIN)
    # Where a sheet shows where the mistakes were made and no plan is turned, the own nodes are enough.
    is_unseen = any(one.at not in evidence.nodes for one in certain)
    is_needed = wrong and (wrong & construction.poles.keys() or not evidence.has_sheets or is_unseen)
    lines = _on_wrong_lines(certain, construction)
    basis = PlanBasis("instead", drawn.construction, drawn.parameters, wrong, lines) if is_needed else None
    nearly = sure_of(explanations, NEARLY_CERTAIN)
    left_out = frozenset(one.at for one in nearly if one.code == "normal_missing")
    made = [made_at(one, construction) for one in nearly]
    repeated = tuple(nodes for nodes in made if len(nodes) > 1)
    at = frozenset[str]().union(*made)
    return ReplayResult(explanations, basis, _blamed(nearly, construction), at, left_out, repeated)


def _on_wrong_lines(mistakes: Iterable[Mistake], construction: Construction) -> frozenset[str]:
    """The vectors that lie on lines drawn wrongly."""
    found = set()
    for mistake in mistakes:
        step = construction.step(mistake.at) if mistake.code in LINE_MISTAKES else None
        if isinstance(step, TwoLines):
            line = (step.first, step.second)[mistake.slot]
            vectors = (one for one in construction.vectors.values() if one.head == mistake.at)
            found |= {one.name for one in vectors if line_of(one, construction) == line}
    return frozenset(found)


def _blamed(mistakes: Iterable[Mistake], construction: Construction) -> frozenset[str]:
    """The vectors in which mistakes of single steps were made."""
    found: set[str] = set()
    for mistake in mistakes:
        at = made_at(mistake, construction)
        here = {one.name for one in construction.vectors.values() if one.head in at}
        steps = (step for step in construction.steps if step.node in at and isinstance(step, Given))
        made = {laid_off(step, construction) for step in steps} | _on_wrong_lines([mistake], construction)
        found |= (here & made) or here
    return frozenset(found)


def case_of(task: Task, evidence: Evidence, settled: Mapping[str, Scale], owner: Owner | None = None) -> Case:
    """The drawing to explain at the scales used, with the scales that the drawing follows instead.

    A drawing by other data is held against these, at the scales of its driving link's vectors.
    """
    taken = None if owner is None else owner.of_whole
    assumed = frozenset(name for name, scale in settled.items() if scale.used.assumed or taken is not None)
    others = {name: scale.other for name, scale in settled.items() if scale.other and taken is None}
    used = {
        name: np.asarray(others.get(name, scale.used.used) if name in assumed else scale.used.used)
        for name, scale in settled.items()
    }
    parameters = {**task.parameters, **used}
    if taken is not None:
        parameters |= taken.parameters
        parameters |= _scales_of_the_drawn_driver(task, evidence, parameters)
    # Lengths have the errors of what was drawn, at whatever scale that was.
    drawn_at = {name: np.asarray(other) for name, other in others.items()}
    entries = _lengths_observed(task, evidence, {**parameters, **drawn_at})
    directions = _directions_of_the_sketch(task, evidence, {name: float(one) for name, one in used.items()})
    blank = _components_left_blank(task, evidence)
    best, *otherwise = (
        Observations(
            (*_nodes_observed(task, evidence, nodes), *entries),
            evidence.sketches,
            nodes.cost,
            directions,
            nodes.apart,
            blank,
        )
        for nodes in _adjusted_nodes(task, evidence)
    )
    return Case(
        drawing=Drawing(task.construction, parameters),
        observations=best,
        otherwise=tuple(otherwise),
        skill=task.skill,
        followed={
            name: other
            for name, other in others.items()
            if name not in assumed and other != settled[name].used.used
        },
        assumed=assumed,
    )


def _scales_of_the_drawn_driver(
    task: Task, evidence: Evidence, parameters: Parameters
) -> dict[str, FloatArray]:
    """The scales of the plans as they follow from the drawn lengths of the driving link's vectors."""
    found = {}
    for scale in OF_MOTION:
        drawn = evidence.vector(task.driving_vector(scale))
        size = math.hypot(
            *(float(one) for name, one in parameters.items() if name.startswith(f"{kind_of(scale).letter}_"))
        )
        if drawn is not None and drawn.length_mm > 0.0 and size > 0.0:
            found[scale] = np.asarray(size / drawn.length_mm)
    return found


def _nodes_observed(task: Task, evidence: Evidence, nodes: "_Nodes") -> list[Observation]:
    """The student's own nodes."""
    return [
        Observation(name, None, place, _with_computing(task, evidence, name, nodes.spreads.get(name)))
        for name, place in nodes.places.items()
        if name not in task.ground and name not in task.construction.poles.values()
    ]


def _lengths_observed(task: Task, evidence: Evidence, parameters: Parameters) -> list[Observation]:
    """The vectors that do not run between the nodes."""
    construction, entries = task.construction, []
    traced, nodes = None, {*evidence.nodes, *task.construction.poles.values()}
    for name, vector in construction.vectors.items():
        drawn = evidence.vector(name)
        if drawn is None or drawn.confidence < task.rubric.least_confidence:
            continue
        # A plan's node that was read is known; the order of forces, and so where one starts, may not be.
        starts_anywhere = vector.scale == "kF" and vector.tail not in nodes
        if vector.head in nodes and (not starts_anywhere or drawn.direction_rad is None):
            continue
        value, read_mm = drawn.as_complex, math.hypot(LEAST_ERROR_MM, drawn.se_mm, task.rubric.hand.ruler_mm)
        if value is not None:
            entries.append(Observation(vector.head, vector.tail, value, _covariance(NO_ERRORS, read_mm)))
            continue
        # The nodes before a length are not known: it contains all earlier errors.
        traced = traced or trace(construction, parameters, task.skill)
        spread = _covariance(traced.shifts(vector.tail, vector.head), read_mm)
        entries.append(Observation(vector.head, vector.tail, drawn.length_mm, spread, has_direction=False))
    return entries


def _components_left_blank(task: Task, evidence: Evidence) -> frozenset[str]:
    """The nodes in which components end that are not there, though others of their plan are."""
    vectors = task.construction.vectors.values()
    drawn = {one.scale for one in vectors if evidence.vector(one.name) is not None}
    return frozenset(
        one.head
        for one in vectors
        if (one.part in {"n", "c"} or _acts(task, one))
        and one.scale in drawn
        and evidence.vector(one.name) is None
        and (one.name in evidence.blank or not evidence.has_sheets)
    )


def _acts(task: Task, vector: Vector) -> bool:
    """Return whether a vector is a force that is laid off, and not computed from moments."""
    step = task.construction.step(vector.head)
    return (
        isinstance(step, Given) and is_force(step.length) and laid_off(step, task.construction) == vector.name
    )


def _directions_of_the_sketch(
    task: Task, evidence: Evidence, scales: Mapping[str, float]
) -> dict[tuple[str, str], float]:
    """The standard error (rad) of each direction on a sketch that was not handed in, by pair of joints."""
    if evidence.has_sketch:
        return {}
    traced = task.traced(scales)
    found = {}
    links = {vector.link for vector in task.construction.vectors.values() if vector.link is not None}
    for link in links:
        for tail, head in (link, link[::-1]):
            along = traced.made[head].at - traced.made[tail].at
            if abs(along) > LEAST_LINK_MM:
                across = ((traced.made[head].shifts - traced.made[tail].shifts) / along).imag
                found[tail, head] = float(np.sqrt(across @ across))
    return found


LEAST_LINK_MM = 1.0
"""Two joints nearer than this have no direction between them."""


def _with_computing(task: Task, evidence: Evidence, node: str, read: Covariance | None) -> Covariance:
    """The covariance (mm^2) of a node by reading, and of what is computed from readings."""
    vector = next((one for one in task.construction.vectors.values() if one.head == node), None)
    drawn = None if vector is None else evidence.vector(vector.name)
    along = None if drawn is None else drawn.as_complex
    rows, step = NO_ERRORS, task.construction.step(node)
    if isinstance(step, Given) and isinstance(step.length, Balance):
        rows = _arms_measured(task, evidence, step)
    elif along:
        each_mm = LEAST_ERROR_MM if evidence.has_sheets else task.rubric.hand.ruler_mm
        rows = np.array([along * _computed_within(task, evidence, node, math.sqrt(2.0) * each_mm)])
    xx, xy, yy = _covariance(rows, LEAST_ERROR_MM)
    return (xx, xy, yy) if read is None else (xx + read[0], xy + read[1], yy + read[2])


def _arms_measured(task: Task, evidence: Evidence, step: Given) -> ComplexArray:
    """The shifts of a force that is computed from moments, by the errors of what it is made of.

    They are those of the sketch's points that were not read, and of reading the others and earlier forces.
    """
    traced = task.traced(task.rule_scales)
    of_sketch = [
        task.construction.figure_of(node) == MECHANISM and node not in evidence.nodes
        for node, *_ in acts(task.construction)
    ]
    shifts = traced.made[step.node].shifts - traced.nodes[step.start].shifts
    at = {name: np.asarray(one.at) for name, one in traced.nodes.items()}
    known = task.at(task.rule_scales)
    read = [
        complex(step.place(View({**at, name: at[name] + axis}, known)) - at[step.node]) * evidence.se_mm[name]
        for name in dict.fromkeys(step.needs)
        if name in evidence.se_mm and name != step.start
        for axis in (1.0, 1.0j)
    ]
    return np.concatenate([shifts[: traced.drafting_count] * of_sketch, read])


# Measured vectors that close polygons --------------------------------------------------------------

CLOSES = 5.0
"""Standard deviations by which a polygon of measured vectors may fail to close."""
WRONG_ENTRY = 30.0
"""Cost of a vector that was entered wrongly: rare, and it may be any (as in `reference.replay`)."""
ANY_VECTOR = 4.0 * math.log(AREA_MM)
"""Cost of a vector that may be any, where nothing in the plan belongs together."""
ENTRY_WINDOW = 40.0
"""Entries left out at a higher cost than the cheapest by this much are not tried."""


@dataclass(frozen=True, slots=True)
class _Nodes:
    """The own nodes of both plans, and their covariances by measuring, as far as they are measured.

    `cost` is that of the residuals, and of an entry that was left out; `apart`, by plan, how much less it is
    where the entries need not close polygons.
    """

    places: Mapping[str, complex]
    spreads: Mapping[str, Covariance] = field(default_factory=dict)
    cost: float = 0.0
    apart: Mapping[str, float] = field(default_factory=dict)


def _adjusted_nodes(task: Task, evidence: Evidence) -> list[_Nodes]:
    """The own nodes; measured vectors adjusted by least squares, where they close polygons.

    Where these do not close, the cheapest first: the nodes by all entries, and without one of them.
    """
    if evidence.has_sheets:
        read = {name: (se_mm**2, 0.0, se_mm**2) for name, se_mm in evidence.se_mm.items()}
        return [_Nodes(evidence.nodes, read)]
    found = [_Nodes({}, {}, 0.0)]
    for figure in task.construction.poles:
        plans = _adjusted_plan(task, evidence, figure)
        found = [
            _Nodes(
                {**one.places, **plan.places},
                {**one.spreads, **plan.spreads},
                one.cost + plan.cost,
                {**one.apart, **plan.apart},
            )
            for one in found
            for plan in plans
        ]
    least = min(one.cost for one in found)
    return sorted((one for one in found if one.cost <= least + ENTRY_WINDOW), key=lambda one: one.cost)


def _adjusted_plan(task: Task, evidence: Evidence, figure: str) -> list[_Nodes]:
    """The nodes of one plan, by all entries and, where its polygons do not close, without one of them."""
    known = [step.node for step in task.construction.figures[figure] if step.node in evidence.nodes]
    entries = {
        vector: along
        for vector in task.construction.vectors_of(figure)
        if {vector.tail, vector.head} <= set(known)
        and (drawn := evidence.measured.get(vector.name)) is not None
        and (along := drawn.as_complex)
    }
    nodes = [node for node in known if node != task.construction.poles[figure]]
    if not entries:
        return [_Nodes({})]
    rows, values = _equations(task, entries, nodes)
    whole, sigmas = _least_squares(rows, values, nodes)
    if sigmas <= CLOSES:
        return [replace(whole, cost=0.0)]
    kept = [np.delete(np.arange(len(values)), (2 * index, 2 * index + 1)) for index in range(len(entries))]
    others = [
        _least_squares(rows[keep], values[keep], nodes)[0]
        for keep in kept
        if np.linalg.matrix_rank(rows[keep]) == 2 * len(nodes)
    ]
    found = [whole, *(replace(one, cost=one.cost + WRONG_ENTRY) for one in others)]
    spare = len(entries) - len(nodes)
    return [replace(one, apart={figure: max(one.cost - spare * ANY_VECTOR, 0.0)}) for one in found]


def _equations(
    task: Task, entries: Mapping[Vector, complex], nodes: Sequence[str]
) -> tuple[FloatArray, FloatArray]:
    """Return two rows for each vector, along and across it, in standard deviations; and the measurements."""
    hand = task.rubric.hand
    rows, drawn = np.zeros((2 * len(entries), 2 * len(nodes))), np.zeros(2 * len(entries))
    for index, (vector, along) in enumerate(entries.items()):
        # Both ends of a vector are measured.
        sigmas = (
            math.sqrt(2.0) * math.hypot(hand.ruler_mm, LEAST_ERROR_MM),
            math.sqrt(2.0) * math.hypot(abs(along) * math.radians(hand.protractor_deg), LEAST_ERROR_MM),
        )
        unit = along / abs(along)
        for row, (axis, sigma) in enumerate(zip((unit, 1j * unit), sigmas, strict=True)):
            for end, sign in ((vector.head, 1.0), (vector.tail, -1.0)):
                if end in nodes:
                    column = 2 * nodes.index(end)
                    rows[2 * index + row, column : column + 2] = (
                        sign * np.array([axis.real, axis.imag]) / sigma
                    )
        drawn[2 * index] = abs(along) / sigmas[0]
    return rows, drawn


UNSEEN = 1e-9
"""Information, 1/mm², on a node that no entry ties to the others: it may be anywhere."""


def _least_squares(rows: FloatArray, drawn: FloatArray, nodes: Sequence[str]) -> tuple[_Nodes, float]:
    """Nodes by least squares, their squared residuals as cost; and the largest residual."""
    normal = np.linalg.inv(rows.T @ rows + UNSEEN * np.eye(2 * len(nodes)))
    places = normal @ (rows.T @ drawn)
    residuals = rows @ places - drawn
    found = {name: complex(*places[2 * i : 2 * i + 2]) for i, name in enumerate(nodes)}
    spreads = {
        name: (
            float(normal[2 * i, 2 * i]),
            float(normal[2 * i, 2 * i + 1]),
            float(normal[2 * i + 1, 2 * i + 1]),
        )
        for i, name in enumerate(nodes)
    }
    return _Nodes(found, spreads, float(residuals @ residuals)), float(np.abs(residuals).max())


# Errors -------------------------------------------------------------------------------------------


def _computed_within(task: Task, evidence: Evidence, node: str, each_mm: float) -> float:
    """The relative error of a component that is computed from read or measured velocities."""
    sources: tuple[tuple[str, str, float], ...]
    match task.construction.step(node):
        case Given(length=Normal(tail=tail, head=head)):
            sources = ((tail, head, 2.0),)
        case Given(length=Coriolis(slide=slide, turn=turn)):
            sources = ((*slide, 1.0), (*turn, 1.0))
        case _:
            return 0.0
    ends = {
        name: place for one in sources for name in one[:2] if (place := evidence.nodes.get(name)) is not None
    }
    errors = [
        power * each_mm / max(abs(ends[head] - ends[tail]), each_mm)
        for tail, head, power in sources
        if tail in ends and head in ends
    ]
    return math.hypot(*errors)


def _covariance(shifts: ComplexArray, least_mm: float) -> Covariance:
    """The covariance (mm^2) of an end from independent errors, and a least error along both axes."""
    x, y = shifts.real, shifts.imag
    return float(x @ x) + least_mm**2, float(x @ y), float(y @ y) + least_mm**2
