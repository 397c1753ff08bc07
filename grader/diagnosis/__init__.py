"""Which mistake explains what is off: the operators of `reference.mistakes`, tried one by one.

A mistake is an explanation when the drawing with that mistake in it, everything after it followed
through, is what the student drew. Explanations compete with each other and with "something else":
each costs the squared misfit of all vectors, bounded for each vector, and a little for being rare;
the confidence is the share that the mistake has among all of them. A drawing that lost nothing is
never accused.
"""

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.outcomes import Mistake
from reference import mistakes as operators
from reference.assignment import Assignment, Variant
from reference.construction import Nodes, evaluate
from reference.derivation import parameters_of
from reference.errors import PlanmarkError
from reference.geometry import FloatArray
from reference.mistakes import Drawing

LEAST_CONFIDENCE = 0.6
"""An explanation less certain than this is not told."""
LEAST_SHARE = 0.5
"""Of the vectors off that a mistake would move, it must explain this share."""
AT_MOST = 3
"""Independent mistakes of one drawing that are looked for, one after the other."""
SIGMAS_PER_TOLERANCE = 2.0
"""A careful hand's standard deviation is taken for half the tolerance."""
BOUND = 16.0
"""What one vector costs at most: beyond four standard deviations it is simply off."""
OFF = 4.0
"""A vector is off from this cost on: two standard deviations, that is the tolerance."""
RARITY: Mapping[str, float] = {"other_variant": 8.0, "labels_swapped": 6.0, "figure_rotated": 5.0}
USUAL_RARITY = 3.0


@dataclass(frozen=True, slots=True)
class Observed:
    """One vector as drawn, of a criterion; tolerances as the rubric has them, None where not judged."""

    criterion: str
    vector: str
    length_mm: float
    direction_rad: float | None
    allowed_mm: float
    allowed_rad: float | None
    is_lost: bool
    """Whether points were lost, against the original data."""


@dataclass(frozen=True, slots=True)
class Case:
    """A drawing to explain: how it should have been drawn, at the scales it follows, and what was.

    `assignment` and `variant` say whose plan it could be instead.
    """

    drawing: Drawing
    observed: Sequence[Observed]
    assignment: Assignment
    variant: Variant


def diagnose(case: Case) -> tuple[Mistake, ...]:
    """The mistakes that explain what was lost, the surest first; none where nothing explains it."""
    found: list[Mistake] = []
    drawing = case.drawing
    lost = [one for one in case.observed if one.is_lost]
    while lost and len(found) < AT_MOST:
        step = _best(case, drawing)
        if step is None:
            break
        operator, mistake = step
        found.append(mistake)
        drawing = operators.commit(operator, drawing)
        lost = [one for one in lost if one.criterion not in mistake.explains]
    return tuple(sorted(found, key=lambda mistake: -mistake.confidence))


def _best(case: Case, drawing: Drawing) -> tuple[operators.Mistake, Mistake] | None:
    """The likeliest further mistake, or None where nothing is likely enough."""
    before = _costs(case, drawing)
    tried = []
    for operator in _operators(case, drawing):
        try:
            costs = _costs(case, operators.commit(operator, drawing))
        except ValueError:
            continue
        tried.append((sum(costs) + RARITY.get(operator.code, USUAL_RARITY), operator, costs))
    if not tried:
        return None
    tried.sort(key=lambda one: one[0])
    cost, operator, costs = tried[0]
    explained = [
        one.criterion
        for one, was, now in zip(case.observed, before, costs, strict=True)
        if was > OFF >= now and one.is_lost
    ]
    if not explained or len(explained) < LEAST_SHARE * _at_stake(case, drawing, operator, before):
        return None
    rivals = [other for other, rival, _ in tried if (rival.code, rival.at) != (operator.code, operator.at)]
    weights = [math.exp((cost - other) / 2.0) for other in (*rivals, sum(before))]
    confidence = 1.0 / (1.0 + sum(weights))
    if confidence < LEAST_CONFIDENCE:
        return None
    detail = _detail(operator)
    return operator, Mistake(operator.code, operator.at, tuple(explained), confidence, detail)


def _at_stake(case: Case, drawing: Drawing, operator: operators.Mistake, before: Sequence[float]) -> int:
    """How many of the vectors that a mistake would move are off."""
    moved = operators.affected(operator, drawing.construction)
    vectors = drawing.construction.vectors
    return sum(
        cost > OFF and vectors[one.vector].head in moved
        for one, cost in zip(case.observed, before, strict=True)
    )


def _costs(case: Case, drawing: Drawing) -> list[float]:
    """What each observed vector costs if this was the drawing meant."""
    nodes = evaluate(drawing.construction, drawing.parameters)
    return [_cost(one, drawing, nodes) for one in case.observed]


def _cost(one: Observed, drawing: Drawing, nodes: Nodes) -> float:
    vector = drawing.construction.vectors[one.vector]
    meant = complex(nodes[vector.head]) - complex(nodes[vector.tail])
    if not cmath.isfinite(meant):
        return BOUND
    cost = (SIGMAS_PER_TOLERANCE * (one.length_mm - abs(meant)) / one.allowed_mm) ** 2
    if one.direction_rad is not None and one.allowed_rad is not None and abs(meant) > one.allowed_mm:
        off = math.remainder(one.direction_rad - cmath.phase(meant), math.tau)
        cost += (SIGMAS_PER_TOLERANCE * off / one.allowed_rad) ** 2
    return min(cost, BOUND)


# What could have gone wrong -----------------------------------------------------------------------


def _operators(case: Case, drawing: Drawing) -> Iterator[operators.Mistake]:
    for figure in drawing.construction.figures:
        yield from operators.single_mistakes(drawing, figure)
    yield from _swaps(drawing)
    yield from _other_variants(case)


def _swaps(drawing: Drawing) -> Iterator[operators.Mistake]:
    """Two nodes of a plan with each other's letters."""
    construction = drawing.construction
    for figure, pole in construction.poles.items():
        ends = {v.head for v in construction.vectors_of(figure) if v.tail == pole and not v.is_normal}
        ordered = sorted(ends)
        for index, first in enumerate(ordered):
            for second in ordered[index + 1 :]:
                yield operators.Mistake("labels_swapped", first, other=(first, second))


def _other_variants(case: Case) -> Iterator[operators.Mistake]:
    """Another student's data, all else right."""
    for variant in case.assignment.variants():
        if variant == case.variant:
            continue
        try:
            parameters = _parameters(case.assignment, variant)
        except PlanmarkError:
            continue
        yield operators.Mistake(
            "other_variant", "mechanism", n=variant.n, position=variant.position, parameters=parameters
        )


def _parameters(assignment: Assignment, variant: Variant) -> dict[str, FloatArray]:
    scales = assignment.scales([variant])
    found = parameters_of(assignment.mechanism([variant]), scales.kL, scales.kv, scales.ka)
    return {name: np.asarray(np.ravel(value)[0]) for name, value in found.items()}


def _detail(operator: operators.Mistake) -> dict[str, float | str]:
    """What a sentence about the mistake can say more."""
    detail: dict[str, float | str] = {}
    if operator.other:
        detail["other"] = "".join(operator.other)
    if operator.factor != 1.0:
        detail["factor"] = operator.factor
    if operator.quarters:
        detail["degrees"] = 90.0 * operator.quarters
    for name in ("n", "position"):
        value = getattr(operator, name)
        if value is not None:
            detail[name] = value
    return detail


# Scales -------------------------------------------------------------------------------------------

RPM_WITHIN = 0.03
"""Relative: a scale off by 30/pi (squared for accelerations) this nearly was made from rev/min."""


def wrong_scale(name: str, declared: float, followed: float, explains: Iterable[str]) -> Mistake:
    """The mistake of a declared scale that the drawing contradicts."""
    factor = declared / followed
    powers = {"kv": 1, "ka": 2}
    rpm = operators.RPM_FACTOR ** powers.get(name, 0)
    is_rpm = name in powers and abs(factor / rpm - 1.0) <= RPM_WITHIN
    code = "rpm_not_converted" if is_rpm else "scale_wrong"
    return Mistake(code, name, tuple(explains), 0.95, {"factor": factor})
