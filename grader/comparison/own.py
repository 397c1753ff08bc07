"""A student's own nodes, as later steps start from them, with the errors of reading or measuring.

From sheets they are what was read; from measured vectors with directions, where these lead. Lengths
alone lead to nodes too (`lengths`), at the scales that they were drawn at.
"""

from collections.abc import Mapping

import numpy as np

from grader.comparison.evidence import Evidence
from grader.comparison.lengths import nodes_from_lengths
from grader.comparison.sketches import Sketch
from grader.comparison.task import Task
from grader.records import MECHANISM
from reference.hand import Own

Nodes = Mapping[str, Mapping[str, Own]]
"""By figure and node."""


def own_nodes(task: Task, evidence: Evidence, sketch: Sketch) -> Nodes:
    """The student's own nodes by figure, poles apart; measured ones as plans drawn for a sketch have them."""
    if evidence.has_sheets:
        return _from_sheets(task, evidence)
    if evidence.measured:
        return _by_figure(task, nodes_from_lengths(task, evidence, sketch))
    return {}


def _from_sheets(task: Task, evidence: Evidence) -> Nodes:
    """As read; a plan with the sketch that is beside it."""
    names = [name for name in evidence.nodes if name not in task.construction.poles.values()]
    moved = {name: np.zeros(2 * len(names), np.complex128) for name in names}
    for column, name in enumerate(names):
        moved[name][2 * column : 2 * column + 2] = evidence.se_mm.get(name, 0.0) * np.array([1.0, 1j])
    places = {name: Own(evidence.nodes[name], moved[name]) for name in names}
    found = dict(_by_figure(task, places))
    for plan, joints in evidence.sketches.items():
        sketch = {name: Own(place, moved.get(name)) for name, place in joints.items()}
        found[plan] = {**found.get(plan, {}), **sketch}
    return found


def _by_figure(task: Task, places: Mapping[str, Own]) -> dict[str, dict[str, Own]]:
    found: dict[str, dict[str, Own]] = {}
    for name, place in places.items():
        found.setdefault(task.construction.figure_of(name), {})[name] = place
    return found


def known(nodes: Nodes) -> frozenset[str]:
    """The names of all own nodes."""
    return frozenset(
        name for figure, places in nodes.items() for name in places if figure != MECHANISM
    ) | frozenset(nodes.get(MECHANISM, ()))
