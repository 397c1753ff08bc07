"""What is asked: one variant's exact plan, its construction, and the rubric."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grader.rubric import CriterionTable, RubricFile, ToleranceTable
from reference.assignment import Assignment, Variant
from reference.construction import Construction, evaluate
from reference.elements import Nodes, Parameters
from reference.mechanism import Crank, Dyad, Mechanism, Slider
from reference.plan import exact_plan

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
class Yardstick:
    """A link of given length, whose drawing tells the scale of lengths, from joint `tail` to `head`."""

    tail: str
    head: str
    length_m: float


@dataclass(frozen=True, slots=True)
class Task:
    """One student's task with its right answer.

    Attributes
    ----------
    construction, parameters : how it is drawn; the parameters' scales are those of the rule
    real : exact vectors, complex SI, by name
    rates : exact angular quantities, rad/s and rad/s^2
    lengths_m : by angular quantity, the real length of its link
    pin : of the driven link
    yardstick : the crank; where a slider drives, the first link of given length; None without any
    omega : of the crank, None where a slider drives
    """

    assignment: Assignment
    rubric: RubricFile
    variant: Variant
    construction: Construction
    parameters: Parameters
    real: Mapping[str, complex]
    rates: Mapping[str, float]
    lengths_m: Mapping[str, float]
    pin: str
    yardstick: Yardstick | None
    omega: float | None
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
    construction, driver = plan.construction, plan.mechanism.driver
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
        pin=driver.pin,
        yardstick=_yardstick(plan.mechanism),
        omega=float(driver.omega[0]) if isinstance(driver, Crank) else None,
        ground={name: complex(np.ravel(place)[0]) for name, place in plan.mechanism.ground_m.items()},
    )


def _yardstick(mechanism: Mechanism) -> Yardstick | None:
    driver = mechanism.driver
    if isinstance(driver, Crank):
        return Yardstick(driver.pivot, driver.pin, float(driver.length_m[0]))
    for group in mechanism.groups:
        match group:
            case Dyad(node=node, pins=(pin, _), lengths_m=(length, _)):
                return Yardstick(pin, node, float(np.ravel(length)[0]))
            case Slider(node=node, pin=pin, length_m=length):
                return Yardstick(pin, node, float(np.ravel(length)[0]))
    return None
