"""Which mistake explains what is off: the operators of `reference.mistakes`, tried one by one.

First mistakes of the whole drawing (scale, another variant, a turned figure, letters swapped), held
against everything that was drawn; then mistakes of single steps, each step drawn from the student's
own earlier nodes where they are known, so that one mistake does not hide another. A mistake is an
explanation when the drawing with that mistake in it is what the student drew.

Explanations compete with each other and with "something else": each costs the squared misfit of all
vectors, bounded for each vector, and a little for being rare; the confidence is the share that the
mistake has among all of them. Only a loss beyond a careless hand is explained at all: a drawing that
is right is never accused.
"""

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np

from grader.outcomes import Mistake
from grader.records import VELOCITY_PLAN
from reference import mistakes as operators
from reference.assignment import Assignment, Variant
from reference.construction import ancestors, evaluate
from reference.elements import Along, Coriolis, Line, Nodes
from reference.mistakes import Drawing
from reference.parameters import parameters_of
from reference.steps import Given, Step, TwoLines

LEAST_CONFIDENCE = 0.6
"""An explanation less certain than this is not told."""
LEAST_SHARE = 0.5
"""Of the vectors off that a mistake would move, it must explain this share."""
AT_MOST = 4
"""Mistakes of one drawing that are looked for, one after the other."""
SIGMAS_PER_TOLERANCE = 2.0
"""A careful hand's standard deviation is taken for half the tolerance."""
OFF = 4.0
"""A vector is off from this cost on: two standard deviations, that is the tolerance."""
EXPLAINED = 9.0
"""Up to this cost a mistake explains a vector: lines drawn wrongly may cross worse than right ones."""
BOUND = 16.0
"""What one vector counts at most, at twice the tolerance."""
GROSS = 36.0
"""At three times the tolerance: what is off by less in every vector is a careless hand's."""
CARELESS = 4.0
"""What it costs to suppose a careless hand, of twice the standard deviation."""
RARITY: Mapping[str, float] = {"other_variant": 8.0, "labels_swapped": 6.0, "figure_rotated": 5.0}
USUAL_RARITY = 3.0
RPM_WITHIN = 0.03
"""Relative: a scale off by 30/pi (squared for accelerations) this nearly was made from rev/min."""


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
    """Whether it is off against the original data, or not followed through."""


@dataclass(frozen=True, slots=True)
class Case:
    """A drawing to explain: how it should have been drawn, at the scales declared, and what was.

    Attributes
    ----------
    followed : scales that the drawing follows although others were declared
    scale_criteria : the criterion of each of them, where it lost
    own : the student's own nodes, millimetres, plans about their poles
    assignment, variant : whose plan it should be
    """

    drawing: Drawing
    observed: Sequence[Observed]
    assignment: Assignment
    variant: Variant
    followed: Mapping[str, float] = field(default_factory=dict)
    scale_criteria: Mapping[str, str] = field(default_factory=dict)
    own: Mapping[str, complex] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class _Stage:
    """What has been explained so far: the drawing with those mistakes in it, and what is still lost."""

    case: Case
    drawing: Drawing
    own: Mapping[str, complex]
    lost: frozenset[str]

    def costs(self, drawing: Drawing) -> list[float]:
        """What each observed vector costs if this was the drawing meant."""
        whole = {} if self.own else evaluate(drawing.construction, drawing.parameters)
        return [_cost(one, self.meant(drawing, whole, one)) for one in self.case.observed]

    def costs_with(self, operator: operators.Mistake, before: Sequence[float]) -> list[float]:
        """The same with one more mistake; only what it moves is drawn anew."""
        drawing = operators.commit(operator, self.drawing)
        if operator.at not in self.own:
            return self.costs(drawing)
        vectors = drawing.construction.vectors
        return [
            _cost(one, self.meant(drawing, {}, one)) if vectors[one.vector].head == operator.at else cost
            for one, cost in zip(self.case.observed, before, strict=True)
        ]

    def meant(self, drawing: Drawing, whole: Nodes, one: Observed) -> complex:
        """A vector drawn from the student's own earlier nodes where they are known."""
        vector = drawing.construction.vectors[one.vector]
        nodes = whole
        if self.own:
            ends = [vector.head, vector.tail]
            upstream = ancestors(drawing.construction, ends) - {vector.head}
            own = {name: np.asarray(place) for name, place in self.own.items() if name in upstream}
            nodes = evaluate(drawing.construction, drawing.parameters, given=own, wanted=ends)
        return complex(nodes[vector.head]) - complex(nodes[vector.tail])


def diagnose(case: Case) -> tuple[Mistake, ...]:
    """The mistakes that explain what was lost, the surest first; none where nothing explains it."""
    lost = frozenset(one.criterion for one in case.observed if one.is_lost)
    stage = _Stage(case, case.drawing, {}, lost)
    found: list[Mistake] = []
    stage = _explain(stage, found, _of_the_whole)
    stage = _Stage(case, stage.drawing, _renamed(case, found), stage.lost)
    _explain(stage, found, _of_steps)
    return tuple(sorted(found, key=lambda mistake: -mistake.confidence))


def _explain(stage: _Stage, found: list[Mistake], candidates: "_Candidates") -> _Stage:
    """Add mistakes to `found` while they explain anything; what is left."""
    while stage.lost and len(found) < AT_MOST:
        best = _best(stage, candidates)
        if best is None:
            break
        operator, mistake = best
        found.append(mistake)
        drawing = operators.commit(operator, stage.drawing)
        stage = _Stage(stage.case, drawing, stage.own, stage.lost - set(mistake.explains))
    return stage


def _best(stage: _Stage, candidates: "_Candidates") -> tuple[operators.Mistake, Mistake] | None:
    """The likeliest further mistake, or None where nothing is likely enough."""
    before = stage.costs(stage.drawing)
    if max(before, default=0.0) < GROSS:
        return None
    tried = []
    for operator in candidates(stage):
        costs = stage.costs_with(operator, before)
        tried.append((_sum(costs) + RARITY.get(operator.code, USUAL_RARITY), operator, costs))
    tried.sort(key=lambda one: one[0])
    cost, operator, costs = tried[0]
    explained = [
        (one.criterion, was)
        for one, was, now in zip(stage.case.observed, before, costs, strict=True)
        if was > OFF and now <= min(was / 2.0, EXPLAINED) and one.criterion in stage.lost
    ]
    # What this mistake leaves tells how careless the hand is; of the whole, only the better part of it.
    hand = max(1.0, sorted(costs)[len(costs) // (2 if stage.own else 4)])
    is_gross = any(was >= GROSS * hand for _, was in explained)
    if not is_gross or len(explained) < LEAST_SHARE * _at_stake(stage, operator, before):
        return None
    rivals = [
        other for other, rival, _ in tried[1:] if (rival.code, rival.at) != (operator.code, operator.at)
    ]
    weights = [math.exp((cost - other) / 2.0) for other in (*rivals, _sum(before))]
    confidence = 1.0 / (1.0 + sum(weights))
    if confidence < LEAST_CONFIDENCE:
        return None
    return operator, _told(stage.case, operator, [name for name, _ in explained], confidence)


def _sum(costs: Sequence[float]) -> float:
    """What an explanation costs by a careful hand, or by a careless one if that costs less."""
    careful = sum(min(cost, BOUND) for cost in costs)
    careless = sum(min(cost / 4.0, BOUND) for cost in costs) + CARELESS
    return min(careful, careless)


def _at_stake(stage: _Stage, operator: operators.Mistake, before: Sequence[float]) -> int:
    """How many of the vectors lost that a mistake would move are off."""
    construction = stage.drawing.construction
    moved = operators.affected(operator, construction)
    if stage.own:
        moved &= {operator.at}
    if operator.at in {"kv", "ka"}:
        moved = frozenset(v.head for v in construction.vectors.values() if v.scale == operator.at)
    heads = construction.vectors
    return sum(
        cost > OFF and one.criterion in stage.lost and heads[one.vector].head in moved
        for one, cost in zip(stage.case.observed, before, strict=True)
    )


def _cost(one: Observed, meant: complex) -> float:
    """Squared misfit in standard deviations."""
    if not cmath.isfinite(meant):
        return GROSS
    cost = (SIGMAS_PER_TOLERANCE * (one.length_mm - abs(meant)) / one.allowed_mm) ** 2
    if one.direction_rad is not None and one.allowed_rad is not None and abs(meant) > one.allowed_mm:
        off = math.remainder(one.direction_rad - cmath.phase(meant), math.tau)
        cost += (SIGMAS_PER_TOLERANCE * off / one.allowed_rad) ** 2
    return cost


def _renamed(case: Case, found: Iterable[Mistake]) -> dict[str, complex]:
    """The student's nodes but the poles, under their right names where two were found swapped."""
    poles = case.drawing.construction.poles.values()
    nodes = {name: place for name, place in case.own.items() if name not in poles}
    for mistake in found:
        if mistake.code == "labels_swapped":
            first, second = str(mistake.detail["first"]), str(mistake.detail["second"])
            swapped = {second: nodes.pop(first, None), first: nodes.pop(second, None)}
            nodes.update({name: place for name, place in swapped.items() if place is not None})
    return nodes


def _told(case: Case, operator: operators.Mistake, explains: list[str], confidence: float) -> Mistake:
    """The mistake for the report; a wrong scale explains its own criterion too."""
    detail: dict[str, float | str] = {}
    code = operator.code
    match operator:
        case operators.Mistake(code="scale_wrong", at=scale) if scale in case.followed:
            detail["factor"] = 1.0 / operator.factor
            code = _code_of_scale(scale, 1.0 / operator.factor)
            explains = [*filter(None, [case.scale_criteria.get(scale)]), *explains]
        case operators.Mistake(code="labels_swapped", other=(first, second)):
            detail |= {"first": first, "second": second}
        case operators.Mistake(code="other_variant"):
            explains = [*case.scale_criteria.values(), *explains]
            detail |= {key: n for key in ("n", "position") if (n := getattr(operator, key)) is not None}
        case operators.Mistake(code="figure_rotated", quarters=quarters):
            detail["degrees"] = 90.0 * quarters
        case operators.Mistake(other=other) if other:
            detail["other"] = "".join(other)
    if code in LINE_MISTAKES and _is_along_guide(case.drawing.construction.step(operator.at), operator.slot):
        detail["line"] = "guide"
    return Mistake(code, operator.at, tuple(explains), confidence, detail)


LINE_MISTAKES = frozenset({"parallel_for_perpendicular", "wrong_link"})


def _is_along_guide(step: Step, slot: int) -> bool:
    """Whether a step's line runs along a link instead of across it."""
    line = (step.first, step.second)[slot] if isinstance(step, TwoLines) else None
    return isinstance(line, Line) and isinstance(line.along, Along) and line.along.quarters % 2 == 0


def _code_of_scale(name: str, factor: float) -> str:
    powers = {"kv": 1, "ka": 2}
    rpm = operators.RPM_FACTOR ** powers.get(name, 0)
    return "rpm_not_converted" if name in powers and abs(factor / rpm - 1.0) <= RPM_WITHIN else "scale_wrong"


# What could have gone wrong -----------------------------------------------------------------------

OF_THE_WHOLE = frozenset({"figure_rotated", "other_assembly"})
COMPONENTS = frozenset({"n", "c"})
"""Parts that end in nodes of their own, no joints' images."""


class _Candidates(Protocol):
    def __call__(self, stage: _Stage) -> Iterator[operators.Mistake]:
        """The mistakes to try."""


def _of_the_whole(stage: _Stage) -> Iterator[operators.Mistake]:
    """Mistakes that move (nearly) everything."""
    drawing, case = stage.drawing, stage.case
    for figure in drawing.construction.figures:
        for operator in operators.single_mistakes(drawing, figure):
            # A velocity plan turned by 180 degrees is one with v_A reversed: told as that.
            is_half_turn = operator.quarters == 2 and figure == VELOCITY_PLAN
            if operator.code in OF_THE_WHOLE and not is_half_turn:
                yield operator
    for name, followed in case.followed.items():
        factor = followed / float(drawing.parameters[name])
        if abs(factor - 1.0) > 1e-9:
            yield operators.Mistake("scale_wrong", name, factor=factor)
    yield from _swaps(drawing)
    yield from _other_variants(case)


def _of_steps(stage: _Stage) -> Iterator[operators.Mistake]:
    """Mistakes in one step of a plan."""
    for figure in stage.drawing.construction.poles:
        for operator in operators.single_mistakes(stage.drawing, figure):
            if operator.code not in OF_THE_WHOLE | {"scale_wrong", "rpm_not_converted"}:
                yield operator
    for step in stage.drawing.construction.steps:
        if isinstance(step, Given) and isinstance(step.length, Coriolis):
            yield operators.Mistake("arithmetic", step.node, factor=0.5)


def _swaps(drawing: Drawing) -> Iterator[operators.Mistake]:
    """Two images of a plan with each other's letters."""
    construction = drawing.construction
    for figure, pole in construction.poles.items():
        images = sorted(
            v.head for v in construction.vectors_of(figure) if v.tail == pole and v.part not in COMPONENTS
        )
        for index, first in enumerate(images):
            for second in images[index + 1 :]:
                yield operators.Mistake("labels_swapped", first, other=(first, second))


def _other_variants(case: Case) -> Iterator[operators.Mistake]:
    """Another student's data, all else right."""
    variants = case.assignment.variants()
    scales = case.assignment.scales(variants)
    together = parameters_of(case.assignment.mechanism(variants), scales.kL, scales.kv, scales.ka)
    spread = {name: np.broadcast_to(value, (len(variants),)) for name, value in together.items()}
    for index, variant in enumerate(variants):
        if variant != case.variant:
            parameters = {name: value[index] for name, value in spread.items()}
            n, position = variant.n, variant.position
            yield operators.Mistake(
                "other_variant", "mechanism", n=n, position=position, parameters=parameters
            )
