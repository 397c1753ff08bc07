"""Which mechanism plans were drawn for, where no sketch tells: the right one, or a wrong one throughout.

Another assembly, or another variant's data, moves nearly everything; where one of them explains the
measured vectors far better than the right mechanism does, what is drawn from it follows.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.task import SCALE_NAMES, Task
from grader.records import MECHANISM
from reference.construction import Construction, evaluate
from reference.elements import Parameters
from reference.errors import PlanmarkError
from reference.geometry import ComplexArray
from reference.parameters import parameters_of
from reference.steps import ArcAndLine, TwoArcs

BETTER_BY = 3
"""So many more vectors a wrong mechanism must explain."""
LEAST_SHARE = 0.6
"""Of the measured vectors that it explains."""


@dataclass(frozen=True, slots=True)
class Sketch:
    """What plans may have been drawn by: a construction with its parameters, under a name of its own.

    `wrong` are the nodes at which its steps are wrong ones, or the mechanism.
    """

    name: str
    construction: Construction
    parameters: Parameters
    wrong: frozenset[str] = frozenset({MECHANISM})


def other_sketch(
    task: Task, evidence: Evidence, scales: tuple[Mapping[str, float], Mapping[str, float]]
) -> Sketch | None:
    """The wrong mechanism that the vectors were drawn for; None where the right one explains them.

    Arguments: `scales` are those used, and those that the drawing seems to follow.
    """
    known = {name: one for name in task.real if (one := evidence.vector(name)) is not None}
    if evidence.has_sketch or len(known) < BETTER_BY:
        return None
    each = [scales[0]] if scales[0] == scales[1] else list(scales)
    tried = [one for scale in each for one in _tried(task, scale)]
    counts = [_fitting(task, plans, known) for _, plans in tried]
    right = max(int(count[0]) for (name, _), count in zip(tried, counts, strict=True) if name == "right")
    least, best = max(right + BETTER_BY, math.ceil(LEAST_SHARE * len(known))), None
    for (name, plans), count in zip(tried, counts, strict=True):
        most = int(np.argmax(count))
        if name != "right" and count[most] >= least:
            best, least = plans.sketch(most), int(count[most]) + 1
    return best


@dataclass(frozen=True, slots=True)
class _Plans:
    """What one construction makes of one or several variants' data: (vectors, variants), millimetres."""

    construction: Construction
    parameters: Parameters
    vectors: ComplexArray

    def sketch(self, index: int) -> Sketch:
        """One of them, as plans may have been drawn for it."""
        one = {
            name: np.asarray(np.ravel(value)[index if np.size(value) > 1 else 0])
            for name, value in self.parameters.items()
        }
        return Sketch("other", self.construction, one)


def _tried(task: Task, scales: Mapping[str, float]) -> list[tuple[str, _Plans]]:
    """The plans for the right mechanism and for every wrong one."""
    key = ("plans", *(scales[name] for name in SCALE_NAMES))
    if key not in task.memory:
        right = task.at(scales)
        found = [("right", _plans(task.construction, right))]
        found += [("assembly", _plans(one, right)) for one in _other_assemblies(task.construction)]
        found += [("variant", _plans(task.construction, one)) for one in _other_variants(task, scales)]
        task.keep(key, found)
    return task.memory[key]  # type: ignore[return-value]


def _plans(construction: Construction, parameters: Parameters) -> _Plans:
    nodes = evaluate(construction, parameters)
    vectors = [np.ravel(nodes[one.head] - nodes[one.tail]) for one in construction.vectors.values()]
    return _Plans(construction, parameters, np.array(np.broadcast_arrays(*vectors)))


def _other_assemblies(construction: Construction) -> list[Construction]:
    return [
        construction.with_step(replace(step, side=-step.side))
        for step in construction.figures["mechanism"]
        if isinstance(step, TwoArcs | ArcAndLine)
    ]


def _other_variants(task: Task, scales: Mapping[str, float]) -> list[Parameters]:
    """All other variants' data, at the scales given and at their own: arrays over variants."""
    key = ("variants",)
    if key not in task.memory:
        task.keep(key, _variants(task))
    together: Parameters = task.memory[key]  # type: ignore[assignment]
    if not together:
        return []
    fixed = {name: np.asarray(scales[name]) for name in SCALE_NAMES}
    return [together, {**together, **fixed}]


def _variants(task: Task) -> Parameters:
    others = [one for one in task.assignment.variants() if one != task.variant]
    if not others:
        return {}
    try:
        mechanism, scales = task.assignment.mechanism(others), task.assignment.scales(others)
    except PlanmarkError:
        return {}
    found = parameters_of(mechanism, scales.kL, scales.kv, scales.ka)
    return {
        **{name: np.asarray(value) for name, value in task.parameters.items() if name not in found},
        **found,
    }


def _fitting(
    task: Task, plans: _Plans, known: Mapping[str, DrawnVector]
) -> np.ndarray[tuple[int, ...], np.dtype[np.int64]]:
    """How many of the vectors lie within twice their tolerance, by variant."""
    count = np.zeros(plans.vectors.shape[1], np.int64)
    for row, name in enumerate(plans.construction.vectors):
        if name in known:
            drawn, table = known[name], task.rubric.tolerance_of(name)
            size = np.abs(plans.vectors[row])
            fits = np.abs(size - drawn.length_mm) <= 2.0 * np.array([table.length_at(mm) for mm in size])
            if drawn.direction_rad is not None:
                turned = np.abs(np.angle(plans.vectors[row] * np.exp(-1j * drawn.direction_rad)))
                across = table.across_mm / np.maximum(size, 1e-9)
                fits &= ~(turned > 2.0 * np.maximum(math.radians(table.direction_deg), across))
            count += fits
    return count
