"""What was drawn, as the diagnosis takes it: nodes and vectors with their errors, and what explains them."""

import math
from collections.abc import Mapping

import numpy as np

from grader.comparison.evidence import Evidence
from grader.comparison.follow_through import ReplayResult
from grader.comparison.own import PlanBasis
from grader.comparison.scales import Scale
from grader.comparison.task import Task
from grader.marking.diagnosis import Case, drawn_instead, explained
from reference.construction.elements import Coriolis, Normal, Parameters
from reference.construction.mistakes import Drawing
from reference.construction.steps import Given
from reference.construction.uncertainty import trace
from reference.geometry import ComplexArray
from reference.replay.explanations import Covariance, Observation, Observations

LEAST_ERROR_MM = 0.15
"""Least standard error of a node, however well it is drawn and read."""
NO_ERRORS: ComplexArray = np.zeros(0, np.complex128)


def explain(task: Task, evidence: Evidence, settled: Mapping[str, Scale]) -> ReplayResult:
    """The explanations of a drawing, and the basis of its plans where that is certain."""
    case = case_of(task, evidence, settled)
    explanations = explained(case)
    drawn, wrong = drawn_instead(explanations, case)
    # Where a sheet shows the drawn mechanism and no plan is turned, the own nodes are enough.
    is_needed = wrong and (wrong & task.construction.poles.keys() or not evidence.has_sheets)
    basis = PlanBasis("instead", drawn.construction, drawn.parameters, wrong) if is_needed else None
    return ReplayResult(explanations, basis)


def case_of(task: Task, evidence: Evidence, settled: Mapping[str, Scale]) -> Case:
    """The drawing to explain at the scales used, with the scales that the drawing follows instead."""
    assumed = frozenset(name for name, scale in settled.items() if scale.used.assumed)
    others = {name: scale.other for name, scale in settled.items() if scale.other}
    used = {
        name: np.asarray(others.get(name, scale.used.used) if name in assumed else scale.used.used)
        for name, scale in settled.items()
    }
    parameters = {**task.parameters, **used}
    return Case(
        drawing=Drawing(task.construction, parameters),
        observations=Observations(tuple(_observations(task, evidence, parameters)), evidence.sketches),
        assignment=task.assignment,
        variant=task.variant,
        skill=task.skill,
        followed={
            name: other
            for name, other in others.items()
            if name not in assumed and other != settled[name].used.used
        },
        assumed=assumed,
    )


def _observations(task: Task, evidence: Evidence, parameters: Parameters) -> list[Observation]:
    """The student's own nodes, and the vectors that lead to none of them."""
    construction = task.construction
    given = {*construction.poles.values(), *task.ground}
    entries = [
        Observation(name, None, place, _reading_covariance(task, evidence, name))
        for name, place in evidence.nodes.items()
        if name not in given
    ]
    traced = None
    for name, vector in construction.vectors.items():
        drawn = evidence.vector(name)
        if drawn is None or drawn.confidence < task.rubric.least_confidence or vector.head in evidence.nodes:
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


def _reading_covariance(task: Task, evidence: Evidence, node: str) -> Covariance:
    """The covariance (mm^2) of a node by reading, or by the measurements that give it."""
    vectors = [one for one in task.construction.vectors.values() if one.head == node]
    hand = task.rubric.hand
    rows: list[ComplexArray] = [NO_ERRORS]
    each_mm = LEAST_ERROR_MM if evidence.has_sheets else hand.ruler_mm
    for vector in vectors[:1]:
        drawn = evidence.vector(vector.name)
        along = None if drawn is None else drawn.as_complex
        if along and not evidence.has_sheets:
            # Both ends of a step are measured.
            turned = 1j * along * math.radians(hand.protractor_deg)
            rows.append(
                math.sqrt(2.0) * np.array([hand.ruler_mm * along / abs(along), turned], np.complex128)
            )
        if along:
            share = _computed_within(task, evidence, node, math.sqrt(2.0) * each_mm)
            rows.append(np.array([along * share], np.complex128))
    return _covariance(np.concatenate(rows), LEAST_ERROR_MM)


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
