"""What a student's own earlier values make of a later one.

The same construction, evaluated with the student's nodes in place of the computed ones; from
lengths alone where that is well defined: normal components from the student's own velocity, images
on a line through the pole, and the scale that the drawing follows.
"""

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.comparison.evidence import Evidence
from grader.comparison.task import SCALE_NAMES, Task
from reference.construction import AngularRate, Vector, ancestors, evaluate
from reference.steps import Divide, Given, Normal


@dataclass(frozen=True, slots=True)
class Expectation:
    """What follows rightly from the student's own values.

    Attributes
    ----------
    vector : complex millimetres
    what, of : ``nodes``, ``scale`` or ``vector``, and its name, for the reason `follows`
    relies_on : the nodes and scales of the student's that it follows from
    """

    vector: complex
    what: str
    of: str
    relies_on: frozenset[str]


def expectations(
    task: Task,
    evidence: Evidence,
    name: str,
    used: Mapping[str, float],
    followed: Mapping[str, float],
) -> Iterator[Expectation]:
    """Every expectation for a vector beside the exact one at the scales used; trivial ones barred."""
    vector = task.construction.vectors[name]
    wrong_scales = frozenset(scale for scale in SCALE_NAMES if followed[scale] != used[scale])
    found = []
    if vector.scale in wrong_scales:
        found.append(Expectation(task.drawn(name, followed), "scale", vector.scale, wrong_scales))
    found.extend(_turned_plan(task, evidence, vector, followed))
    found.extend(_from_own(task, evidence, vector, used))
    if wrong_scales:
        found.extend(
            replace(one, relies_on=one.relies_on | wrong_scales)
            for one in _from_own(task, evidence, vector, followed)
        )
    for one in found:
        if not _is_trivial(task, name, one.vector, (used, followed)):
            yield one


def _turned_plan(
    task: Task, evidence: Evidence, vector: Vector, scales: Mapping[str, float]
) -> Iterator[Expectation]:
    """The vector in a plan that is turned as a whole by quarter turns, as the crank's vector tells."""
    crank = f"{vector.name[0]}_{task.pin}"
    own = evidence.vector(crank)
    if vector.name == crank or own is None or own.direction_rad is None:
        return
    off = math.remainder(own.direction_rad - cmath.phase(task.real[crank]), math.tau)
    quarters = round(off / (math.pi / 2.0))
    slack = math.radians(task.rubric.tolerance.direction_deg * task.rubric.tolerance.partial_factor)
    if quarters and abs(off - quarters * math.pi / 2.0) <= slack:
        head = task.construction.vectors[crank].head
        yield Expectation(task.drawn(vector.name, scales) * 1j**quarters, "vector", crank, frozenset({head}))


def _from_own(
    task: Task, evidence: Evidence, vector: Vector, scales: Mapping[str, float]
) -> Iterator[Expectation]:
    for one in (_from_nodes(task, evidence, vector, scales), _from_vector(task, evidence, vector, scales)):
        if one is not None:
            yield one


def _is_trivial(task: Task, name: str, expected: complex, scales: Iterable[Mapping[str, float]]) -> bool:
    """Near zero, without a solution, or far shorter than the right one: nothing is left to show."""
    if not cmath.isfinite(expected):
        return True
    right = min(abs(task.drawn(name, one)) for one in scales)
    return abs(expected) < max(task.rubric.tolerance.least_mm, task.rubric.least_followed_share * right)


def _from_nodes(
    task: Task, evidence: Evidence, vector: Vector, scales: Mapping[str, float]
) -> Expectation | None:
    """The head constructed from the student's own nodes upstream."""
    upstream = ancestors(task.construction, [vector.head, vector.tail]) - {vector.head}
    own = {name: np.asarray(place) for name, place in evidence.nodes.items() if name in upstream}
    relies_on = frozenset(own) - frozenset(task.construction.poles.values())
    if not relies_on:
        return None
    parameters = {**task.parameters, **{name: np.asarray(scales[name]) for name in SCALE_NAMES}}
    if evidence.crank_mm is not None:
        parameters["kL"] = np.asarray(task.crank_m / evidence.crank_mm[0])
    nodes = evaluate(task.construction, parameters, given=own, wanted=[vector.head, vector.tail])
    found = complex(nodes[vector.head]) - complex(nodes[vector.tail])
    return Expectation(found, "nodes", "", relies_on)


def _from_vector(
    task: Task, evidence: Evidence, vector: Vector, scales: Mapping[str, float]
) -> Expectation | None:
    """A vector that hangs on one other alone, whose length is enough."""
    match task.construction.step(vector.head):
        case Given(length=Normal(tail=tail, head=head, length=link)):
            source = _named(task, tail, head)
            own = evidence.vector(source)
            if own is None:
                return None
            speed = own.length_mm * scales["kv"]
            length = speed**2 / (float(task.parameters[link]) * scales["ka"])
            right = task.real[vector.name]
            found = cmath.rect(length, cmath.phase(right)) if right else 0j
            return Expectation(found, "vector", source, frozenset({head}))
        case Divide(base=(p, q), ratio=ratio) if vector.tail in (p, q):
            pole, other = (p, q) if vector.tail == p else (q, p)
            share = float(task.parameters[ratio])
            share = share if pole == p else 1.0 - share
            source = _named(task, pole, other)
            own = evidence.vector(source)
            if own is None:
                return None
            along = own.direction_rad
            phase = cmath.phase(task.real[source]) if along is None else along
            found = cmath.rect(own.length_mm * share, phase)
            return Expectation(found, "vector", source, frozenset({other}))
    return None


def _named(task: Task, tail: str, head: str) -> str:
    """The vector from one node to another: what a step is made from always is one."""
    return next(v.name for v in task.construction.vectors.values() if (v.tail, v.head) == (tail, head))


def from_rate(task: Task, evidence: Evidence, rate: AngularRate, per_mm: float) -> float | None:
    """The angular rate that the student's own vector gives; None without one, or a trivial one.

    Arguments: `per_mm` is the rate per drawn millimetre, scale over the link's length. Where the own
    vector's direction is not known, the sense is the right one's.
    """
    own = evidence.vector(rate.vector)
    if own is None or own.length_mm < task.rubric.tolerance.least_mm:
        return None
    right = task.rates[rate.name]
    sense = math.copysign(1.0, right)
    along = task.real[rate.vector]
    if own.direction_rad is not None and along != 0:
        sense *= math.copysign(1.0, math.cos(own.direction_rad - cmath.phase(along)))
    return sense * own.length_mm * per_mm
