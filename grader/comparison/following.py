"""What a student's own earlier values make of a later one.

The same construction, evaluated with the student's nodes in place of the computed ones; from
lengths alone where that is well defined: normal and Coriolis components from the student's own
velocities (or computed angular velocity), images of a link's points that start from a common node, and
the scale that the drawing follows.
"""

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.comparison.evidence import Evidence
from grader.comparison.task import SCALE_NAMES, Task
from reference.construction import AngularRate, Vector, ancestors, evaluate
from reference.elements import Coriolis, Normal
from reference.steps import Divide, Given, Similar


@dataclass(frozen=True, slots=True)
class Expectation:
    """What follows rightly from the student's own values.

    Attributes
    ----------
    vector : complex millimetres
    what, of : ``nodes``, ``scale``, ``vector`` or ``value``, and its name, for the reason `follows`
    relies_on : the nodes, scales and computed angular velocities of the student's that it follows from
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
    if vector.name == crank or own is None or own.direction_rad is None or not task.real[crank]:
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
    from_nodes = _from_nodes(task, evidence, vector, scales)
    if from_nodes is not None:
        yield from_nodes
    yield from _from_vectors(task, evidence, vector, scales)


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
    own_scales = with_own_lengths(task, evidence, scales)
    parameters = {**task.parameters, **{name: np.asarray(own_scales[name]) for name in SCALE_NAMES}}
    nodes = evaluate(task.construction, parameters, given=own, wanted=[vector.head, vector.tail])
    found = complex(nodes[vector.head]) - complex(nodes[vector.tail])
    return Expectation(found, "nodes", "", relies_on)


def with_own_lengths(task: Task, evidence: Evidence, scales: Mapping[str, float]) -> dict[str, float]:
    """The scales, with kL as the sketch was really drawn where that was read."""
    if task.yardstick is None or evidence.yardstick_mm is None:
        return dict(scales)
    return {**scales, "kL": task.yardstick.length_m / evidence.yardstick_mm[0]}


def _from_vectors(
    task: Task, evidence: Evidence, vector: Vector, scales: Mapping[str, float]
) -> Iterator[Expectation]:
    """A vector that hangs on one or two others alone, whose lengths are enough."""
    match task.construction.step(vector.head):
        case Given(length=Normal(tail=tail, head=head)):
            source = _named(task, tail, head)
            yield from _normal(task, evidence, vector, source, scales)
        case Given(length=Coriolis() as length):
            yield from _coriolis(task, evidence, vector, length, scales)
        case Divide(base=base) | Similar(base=base) if vector.tail in base:
            pole, other = base if vector.tail == base[0] else base[::-1]
            source = _named(task, pole, other)
            own = None if source is None else evidence.vector(source)
            if source is not None and own is not None and task.real[source]:
                along = own.direction_rad
                phase = cmath.phase(task.real[source]) if along is None else along
                shape = task.real[vector.name] / task.real[source]
                found = cmath.rect(own.length_mm, phase) * shape
                yield Expectation(found, "vector", source, frozenset({other}))


def _normal(
    task: Task, evidence: Evidence, vector: Vector, source: str | None, scales: Mapping[str, float]
) -> Iterator[Expectation]:
    """v^2 / l from the own velocity; omega^2 l from the own computed angular velocity."""
    if source is None or not task.real[source]:
        return
    right = task.drawn(vector.name, scales)
    own = evidence.vector(source)
    if own is not None:
        share = own.length_mm * scales["kv"] / abs(task.real[source])
        head = task.construction.vectors[source].head
        yield Expectation(right * share**2, "vector", source, frozenset({head}))
    rate = next((one for one in task.construction.rates.values() if one.vector == source), None)
    if rate is not None and (turned := _own_turn(task, evidence, rate)) is not None:
        yield Expectation(right * turned**2, "value", rate.name, frozenset({rate.name}))


def _coriolis(
    task: Task, evidence: Evidence, vector: Vector, length: Coriolis, scales: Mapping[str, float]
) -> Iterator[Expectation]:
    """2 omega v from the own sliding velocity and what turns the guide: a velocity, or the computed omega.

    Each counts as the share that it has of the right one, with its sense.
    """
    right = task.drawn(vector.name, scales)
    slide = _named(task, *length.slide)
    rate = task.construction.rates.get(f"omega_{vector.turning}")
    sources = [one for one in (slide, rate.vector if rate else None) if one is not None]
    shares = {one: share for one in sources if (share := _own_share(task, evidence, one, scales)) is not None}
    if shares:
        farthest = max(shares, key=lambda one: abs(shares[one] - 1.0))
        relies_on = frozenset(task.construction.vectors[one].head for one in shares)
        yield Expectation(right * math.prod(shares.values()), "vector", farthest, relies_on)
    if rate is not None and (turned := _own_turn(task, evidence, rate)) is not None:
        slid = {one: share for one, share in shares.items() if one == slide}
        relies_on = frozenset({rate.name, *(task.construction.vectors[one].head for one in slid)})
        yield Expectation(right * turned * math.prod(slid.values()), "value", rate.name, relies_on)


def _own_share(task: Task, evidence: Evidence, name: str | None, scales: Mapping[str, float]) -> float | None:
    """The student's own velocity as a share of the right one, negative where it is reversed."""
    own = None if name is None else evidence.vector(name)
    if name is None or own is None or not task.real[name]:
        return None
    share = own.length_mm * scales["kv"] / abs(task.real[name])
    if own.direction_rad is None:
        return share
    return math.copysign(share, math.cos(own.direction_rad - cmath.phase(task.real[name])))


def _own_turn(task: Task, evidence: Evidence, rate: AngularRate) -> float | None:
    """The student's own computed angular velocity as a share of the right one."""
    own, right = evidence.values.get(rate.name), task.rates[rate.name]
    return None if own is None or not right else own / right


def _named(task: Task, tail: str, head: str) -> str | None:
    """The vector from one node to another, either way round; None where it has no name."""
    ends = {tail, head}
    return next((v.name for v in task.construction.vectors.values() if {v.tail, v.head} == ends), None)


def own_length(task: Task, evidence: Evidence, rate: AngularRate) -> float:
    """The real length of a rate's link, m: on the student's own sketch where it must be measured there."""
    tail, head = (evidence.nodes.get(joint) for joint in rate.link)
    is_given = _is_given(task, rate)
    if is_given or tail is None or head is None or task.yardstick is None or evidence.yardstick_mm is None:
        return task.lengths_m[rate.name]
    return abs(head - tail) * task.yardstick.length_m / evidence.yardstick_mm[0]


def _is_given(task: Task, rate: AngularRate) -> bool:
    """Whether a link's length is among the data; the distance of a slotted link's point is not."""
    lengths = (step.length for step in task.construction.steps if isinstance(step, Given))
    return not any(isinstance(one, Normal) and one.measured == rate.link for one in lengths)


def from_rate(task: Task, evidence: Evidence, rate: AngularRate, scale: float) -> float | None:
    """The angular rate that the student's own vector gives; None without one, or a trivial one.

    Arguments: `scale` is the vector's, real units per drawn millimetre. Where the own vector's direction
    is not known, the sense is the right one's.
    """
    own = evidence.vector(rate.vector)
    if own is None or own.length_mm < task.rubric.tolerance.least_mm:
        return None
    right = task.rates[rate.name]
    sense = math.copysign(1.0, right)
    along = task.real[rate.vector]
    if own.direction_rad is not None and along != 0:
        sense *= math.copysign(1.0, math.cos(own.direction_rad - cmath.phase(along)))
    return sense * own.length_mm * scale / own_length(task, evidence, rate)
