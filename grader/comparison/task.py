"""What is asked: one variant's exact plan, its construction, and the rubric."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grader.rubric import CriterionTable, RubricFile, ToleranceTable
from reference.assignment import Assignment, Variant
from reference.construction import Construction, evaluate
from reference.plan import exact_plan
from reference.steps import Nodes, Parameters

SCALE_NAMES = ("kL", "kv", "ka")
UNITS: Mapping[str, str] = {
    "kL": "m/mm",
    "kv": "(m/s)/mm",
    "ka": "(m/s^2)/mm",
    "v": "m/s",
    "a": "m/s^2",
    "omega": "rad/s",
    "epsilon": "rad/s^2",
}
"""By scale, or by the part of a name before its first underscore."""


def unit_of(name: str) -> str:
    """The SI unit of a vector, angular quantity or scale (per millimetre on paper)."""
    return UNITS[name.partition("_")[0]]


@dataclass(frozen=True, slots=True)
class Task:
    """One student's task with its right answer.

    Attributes
    ----------
    construction, parameters : how it is drawn; the parameters' scales are those of the rule
    real : exact vectors, complex SI, by name
    rates : exact angular quantities, rad/s and rad/s^2
    lengths_m : by angular quantity, the real length of its link
    """

    assignment: Assignment
    rubric: RubricFile
    variant: Variant
    construction: Construction
    parameters: Parameters
    real: Mapping[str, complex]
    rates: Mapping[str, float]
    lengths_m: Mapping[str, float]
    pivot: str
    pin: str
    crank_m: float
    omega: float
    ground: Mapping[str, complex]

    def tolerance(self, criterion: CriterionTable) -> ToleranceTable:
        """The tolerance of a criterion."""
        return self.rubric.tolerance_of(criterion)

    def scale_of(self, vector: str) -> str:
        """``kv`` or ``ka``."""
        return self.construction.vectors[vector].scale

    def drawn(self, vector: str, scales: Mapping[str, float]) -> complex:
        """The exact vector on paper, millimetres, at these scales."""
        return self.real[vector] / scales[self.scale_of(vector)]

    def nodes(self, scales: Mapping[str, float], own: Nodes | None = None) -> dict[str, complex]:
        """All nodes at these scales, with some taken as they are."""
        parameters = {**self.parameters, **{name: np.asarray(scales[name]) for name in SCALE_NAMES}}
        found = evaluate(self.construction, parameters, given=own)
        return {name: complex(np.ravel(node)[0]) for name, node in found.items()}


def task_of(assignment: Assignment, rubric: RubricFile, variant: Variant) -> Task:
    """The task of one variant.

    Raises MechanismError where the variant does not assemble.
    """
    plan = exact_plan(assignment, [variant], accelerations=rubric.needs_accelerations)
    construction, crank = plan.construction, plan.mechanism.crank
    parameters = {name: np.asarray(np.ravel(value)[0]) for name, value in plan.drawing.parameters.items()}
    return Task(
        assignment=assignment,
        rubric=rubric,
        variant=variant,
        construction=construction,
        parameters=parameters,
        real={name: complex(vector[0]) for name, vector in plan.vectors_si.items()},
        rates={name: float(rate[0]) for name, rate in plan.rates.items()},
        lengths_m={name: float(parameters[rate.length]) for name, rate in construction.rates.items()},
        pivot=crank.pivot,
        pin=crank.pin,
        crank_m=float(crank.length_m[0]),
        omega=float(crank.omega[0]),
        ground={name: complex(np.ravel(place)[0]) for name, place in plan.mechanism.ground_m.items()},
    )
