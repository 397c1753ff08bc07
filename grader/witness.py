"""What diagnosis is given: a drawing as it was read or measured, and how far each part may be missed."""

import math

import numpy as np

from grader.comparison import Comparison, Task
from grader.comparison.evidence import Evidence
from grader.diagnosis import Case
from reference.elements import Coriolis, Normal, Parameters
from reference.geometry import ComplexArray
from reference.hand import trace
from reference.mistakes import Drawing
from reference.replay import Seen, Spread, Work
from reference.steps import Given

CHARGED = frozenset({"none", "partial"})
LOST = CHARGED | {"follow_through", "review"}
"""Verdicts whose cause is looked for: also where a person has still to decide."""
LEAST_MISS_MM = 0.15
"""However well a hand draws, and however well its drawing is read."""
NOTHING: ComplexArray = np.zeros(0, np.complex128)


def case_of(task: Task, comparison: Comparison) -> Case:
    """The drawing to explain, at the scales used, with what contradicts them."""
    scales, followed, vectors = comparison.scales, comparison.followed, task.construction.vectors
    used = {
        name: np.asarray(followed[name] if scale.assumed else scale.used) for name, scale in scales.items()
    }
    parameters = {**task.parameters, **used}
    lost = [one for one in comparison.outcomes if one.verdict in LOST]
    return Case(
        drawing=Drawing(task.construction, parameters),
        work=Work(tuple(_seen(task, comparison, parameters)), comparison.evidence.sketches),
        lost={one.name: one.criterion for one in lost if one.name in vectors},
        assignment=task.assignment,
        variant=task.variant,
        skill=task.skill,
        followed={
            name: other
            for name, other in followed.items()
            if other != scales[name].used and not scales[name].assumed
        },
        assumed=frozenset(name for name, scale in scales.items() if scale.assumed),
        scale_criteria={
            one.name: one.criterion for one in lost if one.name in scales and one.verdict in CHARGED
        },
    )


def _seen(task: Task, comparison: Comparison, parameters: Parameters) -> list[Seen]:
    """The student's own nodes, and the vectors that lead to none of them."""
    evidence, construction = comparison.evidence, task.construction
    given = {*construction.poles.values(), *task.ground}
    seen = [
        Seen(name, None, place, _missed_by(task, evidence, name))
        for name, place in evidence.nodes.items()
        if name not in given
    ]
    traced = None
    for name, vector in construction.vectors.items():
        drawn = evidence.vector(name)
        if drawn is None or drawn.confidence < task.rubric.least_confidence or vector.head in evidence.nodes:
            continue
        value, read_mm = drawn.as_complex, math.hypot(LEAST_MISS_MM, drawn.se_mm, task.rubric.hand.ruler_mm)
        if value is not None:
            seen.append(Seen(vector.head, vector.tail, value, _spread(NOTHING, read_mm)))
            continue
        # What leads to a length is not seen: all earlier errors are in it.
        traced = traced or trace(construction, parameters, task.skill)
        spread = _spread(traced.moved(vector.tail, vector.head), read_mm)
        seen.append(Seen(vector.head, vector.tail, drawn.length_mm, spread, has_direction=False))
    return seen


def _missed_by(task: Task, evidence: Evidence, node: str) -> Spread:
    """How far a node may be missed by being read, or by the measurements that lead to it."""
    vectors = [one for one in task.construction.vectors.values() if one.head == node]
    hand = task.rubric.hand
    rows: list[ComplexArray] = [NOTHING]
    each_mm = LEAST_MISS_MM if evidence.has_sheets else hand.ruler_mm
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
    return _spread(np.concatenate(rows), LEAST_MISS_MM)


def _computed_within(task: Task, evidence: Evidence, node: str, each_mm: float) -> float:
    """The relative error of a component that is computed from velocities as they were read or measured."""
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


def _spread(moved: ComplexArray, least_mm: float) -> Spread:
    """What independent errors make of an end together: variance along x, covariance, variance along y."""
    x, y = moved.real, moved.imag
    return float(x @ x) + least_mm**2, float(x @ y), float(y @ y) + least_mm**2
