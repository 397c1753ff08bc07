"""How far a mechanism's sketch is turned on its sheet.

A sketch that is turned on its sheet is legitimate: directions on a sheet are turned back by the
turn of the mechanism as drawn there, where it was read; else the sheet's x axis counts.
"""

import cmath
import math
from collections.abc import Iterable, Iterator, Mapping

import numpy as np

from grader.comparison.task import Task
from grader.records import Figure, ReadNode

FIT_MM = 1.0
"""Root mean square misfit up to which the drawn mechanism is the right one, turned and scaled."""
LEAST_GROUND_MM = 20.0
"""Two pivots nearer than this do not tell the sketch's turn."""
CERTAINLY_UPRIGHT_RAD = 1e-3
"""A turn that no tolerance notices."""
LEAST_JOINTS = 3
"""That agree with each other tell the turn of a sketch whose other joints are wrong."""


def turn_of(task: Task, sketch: Figure) -> tuple[float, float]:
    """How far the mechanism is turned on its sheet, radians counter-clockwise, and its standard error.

    The whole mechanism tells it where it is the right one; where it is not, what is right without one
    of its joints and those drawn from it; else its pivots alone, that no mistake moves; where there are
    none, zero.
    """
    exact = task.nodes({"kL": 1.0, "kv": 1.0, "ka": 1.0})
    sure = {
        name: node
        for name, node in sketch.nodes.items()
        if name in exact and node.confidence >= task.rubric.least_confidence
    }
    for nodes in _without_one(task, sure):
        fit = _fit(nodes, exact)
        if fit is not None and fit[2] <= FIT_MM:
            return (0.0, fit[1]) if _is_hands(task, nodes, fit[0]) else (fit[0], fit[1])
    ground = _fit({name: node for name, node in sure.items() if name in task.ground}, exact)
    return (ground[0], ground[1]) if ground is not None else (0.0, 0.0)


def _is_hands(task: Task, nodes: Iterable[str], turn: float) -> bool:
    """Whether a turn is no more than a careful hand's errors make of an upright sketch."""
    if abs(turn) <= CERTAINLY_UPRIGHT_RAD:
        return True
    drawn = task.traced(task.rule_scales).nodes
    places = {name: drawn[name] for name in nodes}
    centre = sum(one.at for one in places.values()) / len(places)
    arms = np.array([one.at - centre for one in places.values()])
    moved = np.array([one.moved for one in places.values()])
    turned = np.imag(np.conj(arms) @ (moved - moved.mean(axis=0))) / np.sum(np.abs(arms) ** 2)
    return bool(abs(turn) <= task.rubric.hand.sigmas * np.sqrt(np.sum(turned**2)))


def _without_one(task: Task, sure: Mapping[str, ReadNode]) -> Iterator[Mapping[str, ReadNode]]:
    """All nodes, then what is left without one of them and all that are drawn from it, most first."""
    yield sure
    upstream = {name: task.construction.upstream(name) for name in sure}
    kept = [
        {name: node for name, node in sure.items() if wrong not in upstream[name]}
        for wrong in sure
        if wrong not in task.ground
    ]
    yield from (nodes for nodes in sorted(kept, key=len, reverse=True) if len(nodes) >= LEAST_JOINTS)


def _fit(nodes: Mapping[str, ReadNode], exact: Mapping[str, complex]) -> tuple[float, float, float] | None:
    """Turn, its standard error, and misfit in mm of the similarity from exact to drawn nodes."""
    if len(nodes) < 2:
        return None
    drawn = [node.at for node in nodes.values()]
    model = [exact[name] for name in nodes]
    centre, middle = sum(drawn) / len(drawn), sum(model) / len(model)
    drawn = [place - centre for place in drawn]
    model = [place - middle for place in model]
    spread = math.sqrt(sum(abs(place) ** 2 for place in drawn))
    if spread < LEAST_GROUND_MM / math.sqrt(2.0):
        return None
    turn_and_scale = sum(d * m.conjugate() for d, m in zip(drawn, model, strict=True))
    turn_and_scale /= sum(abs(m) ** 2 for m in model)
    misfit = [abs(d - turn_and_scale * m) ** 2 for d, m in zip(drawn, model, strict=True)]
    se = math.sqrt(sum(node.se_mm**2 for node in nodes.values()) / len(nodes)) / spread
    return cmath.phase(turn_and_scale), se, math.sqrt(sum(misfit) / len(misfit))
