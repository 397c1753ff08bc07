"""The task of one variant: its exact plan, its construction, and the rubric."""

from collections import deque
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import reduce
from typing import TypeVar, cast

import numpy as np

from grader.rubric import RubricFile, ToleranceTable, plans_asked
from reference.authored.assignment import Assignment, Variant
from reference.construction.elements import Inertia, Parameters
from reference.construction.graph import Construction, evaluate
from reference.construction.uncertainty import Skill, TracedDrawing, trace
from reference.mechanism import Crank, Dyad, Mechanism, Slider
from reference.plan import exact_plan
from reference.quantities import kind_of

Made = TypeVar("Made")

CACHE_SIZE = 64
"""Results in the cache of one task, at students' own scales."""
TASK_CACHE_SIZE = 256
"""Tasks in the cache: students of the same variant have the same one."""


@dataclass(frozen=True, slots=True)
class Yardstick:
    """A link of given length whose drawn length shows the scale kL, from joint `tail` to `head`."""

    tail: str
    head: str
    length_m: float


@dataclass(frozen=True, slots=True)
class TaskSegment:
    """Something drawn from one node to another: a vector of a plan, or a link of the sketch.

    Attributes
    ----------
    real : exact, complex SI, in the order of drawing
    scale : ``kL``, ``kv``, ``ka`` or ``kF``
    turn_rad : from the order of drawing to the vector's own sense
    """

    name: str
    tail: str
    head: str
    scale: str
    real: complex
    turn_rad: float = 0.0

    def drawn(self, scales: Mapping[str, float]) -> complex:
        """The exact one on paper, millimetres, at these scales."""
        return self.real / scales[self.scale]


@dataclass(frozen=True, slots=True)
class Task:
    """One student's task with its right answer.

    Attributes
    ----------
    construction, parameters : how it is drawn; the parameters' scales are those of the rule
    real : exact vectors, complex SI, by name, in the order of drawing
    segments : the vectors and the links of the sketch, by name
    rates : exact angular quantities, rad/s and rad/s^2, and moments, N m
    lengths_m : by angular quantity, the real length of its link
    pin : of the driving link
    yardstick : the crank; where a slider drives, the first link of given length; None without any
    omega : of the crank, None where a slider drives
    gear_ratio : of the gear before the crank, None where none is given
    cache : results, by everything on which they depend
    """

    assignment: Assignment
    rubric: RubricFile
    variant: Variant
    construction: Construction
    parameters: Parameters
    real: Mapping[str, complex]
    segments: Mapping[str, TaskSegment]
    rates: Mapping[str, float]
    lengths_m: Mapping[str, float]
    pin: str
    yardstick: Yardstick | None
    omega: float | None
    gear_ratio: float | None
    ground: Mapping[str, complex]
    cache: dict[tuple[object, ...], object] = field(
        init=False, repr=False, compare=False, default_factory=dict
    )

    def __repr__(self) -> str:
        return f"Task({self.assignment.file.id}, {self.variant})"

    def driving_vector(self, name: str) -> str:
        """The vector by the data of the kind of a vector or scale: it shows the scale and the turn.

        It is the driving link's; of forces, which have none, the largest of `vectors_by_data`.
        """
        return max(self.vectors_by_data(name), key=lambda one: abs(self.real.get(one, 0.0)), default=name)

    def vectors_by_data(self, name: str) -> Sequence[str]:
        """The vectors by the data of the kind of a scale, or of that of a vector in its plan.

        That is the driving link's alone; of forces, those that do not follow from accelerations as drawn, and
        that are asked for, if there are any.
        """
        kind, vectors, figure = kind_of(name), self.construction.vectors, self.construction.figure_of
        if kind.omegas is not None:
            return (f"{kind.letter}_{self.pin}",)
        given = [one for one in vectors.values() if one.scale == kind.scale and one.name in self.parameters]
        if name in vectors:
            given = [one for one in given if figure(one.head) == figure(vectors[name].head)]
        lengths = {step.node: getattr(step, "length", None) for step in self.construction.steps}
        given = [one for one in given if not isinstance(lengths[one.head], Inertia)] or given
        names = [one.name for one in given]
        return [one for one in names if one in self.rubric.vectors] or names

    def tolerance_at(self, node: str) -> ToleranceTable:
        """The tolerance of a node's position: that of the vector or link asked for that ends there.

        The vector from the pole comes first; where none ends there, it is the rubric's.
        """
        asked = {criterion.name for criterion in self.rubric.criterion}
        ends = [one for one in self.segments.values() if one.head == node and one.name in asked]
        ends.sort(key=lambda one: one.tail not in self.construction.poles.values())
        return self.rubric.tolerance_of(ends[0].name) if ends else self.rubric.tolerance

    @property
    def skill(self) -> Skill:
        """The drafting errors for which tolerances are widened."""
        hand = self.rubric.hand
        return Skill(hand.angle_deg, hand.place_mm, hand.mark_mm)

    @property
    def rule_scales(self) -> dict[str, float]:
        """The scales that the assignment's rule gives."""
        return {name: float(self.parameters[name]) for name in self.assignment.scale_names}

    def at(self, scales: Mapping[str, float]) -> dict[str, np.ndarray[tuple[int, ...], np.dtype[np.float64]]]:
        """The parameters with other scales."""
        return {**self.parameters, **{name: np.asarray(scale) for name, scale in scales.items()}}

    def nodes(self, scales: Mapping[str, float]) -> Mapping[str, complex]:
        """All nodes at these scales."""

        def evaluated() -> Mapping[str, complex]:
            nodes = evaluate(self.construction, self.at(scales))
            return {name: complex(np.ravel(node)[0]) for name, node in nodes.items()}

        return self.cached(("nodes", *scales.values()), evaluated)

    def traced(self, scales: Mapping[str, float]) -> TracedDrawing:
        """The whole drawing with its propagated drafting errors, at these scales.

        The sketch is at the rule's scale: its size hardly changes the errors of the plans.
        """
        rule = {**scales, "kL": float(self.parameters["kL"])}
        key = ("traced", *rule.values(), self.skill)
        return self.cached(key, lambda: trace(self.construction, self.at(rule), self.skill))

    @property
    def by_similarity(self) -> Construction:
        """The construction with every image of a plate's point found by similarity."""
        images = self.construction.images.values()
        return self.cached(
            ("by similarity",), lambda: reduce(Construction.with_step, images, self.construction)
        )

    def cached(self, key: tuple[object, ...], make: Callable[[], Made]) -> Made:
        """A result from the cache, or made now; `key` holds everything on which it depends."""
        if key not in self.cache:
            made = make()
            if len(self.cache) >= CACHE_SIZE:
                self.cache.clear()
            self.cache[key] = made
        return cast("Made", self.cache[key])


_tasks: deque[Task] = deque(maxlen=TASK_CACHE_SIZE)


def task_of(assignment: Assignment, rubric: RubricFile, variant: Variant) -> Task:
    """The task of one variant; the same one for the same assignment and rubric.

    Raises MechanismError where the variant does not assemble.
    """
    for task in _tasks:
        if task.variant == variant and task.assignment is assignment and task.rubric is rubric:
            return task
    task = _made(assignment, rubric, variant)
    _tasks.append(task)
    return task


def tasks_at_speed(task: Task, speed: tuple[float, float]) -> tuple[Task, ...]:
    """The task with a student's own omega and epsilon of the crank, at scales by these, or at the given ones.

    Arguments: `speed` is factors of the right omega and epsilon.
    """
    own = replace(task.assignment, speed=speed)
    kinds = (own, replace(own, is_at_given_scales=True))
    return task.cached(
        ("speed", speed), lambda: tuple(_made(one, task.rubric, task.variant) for one in kinds)
    )


def _made(assignment: Assignment, rubric: RubricFile, variant: Variant) -> Task:
    plan = exact_plan(assignment, [variant], **plans_asked(assignment, rubric))
    construction, driver = plan.construction, plan.mechanism.driver
    ratio = driver.gear_ratio if isinstance(driver, Crank) else None
    parameters = {name: np.asarray(np.ravel(value)[0]) for name, value in plan.drawing.parameters.items()}
    back = {name for name, one in construction.vectors.items() if one.reversed}
    real = {name: complex(one[0]) * (-1.0 if name in back else 1.0) for name, one in plan.vectors_si.items()}
    places = {name: complex(np.ravel(place)[0]) for name, place in plan.motion.position.items()}
    segments = {
        v.name: TaskSegment(v.name, v.tail, v.head, v.scale, real[v.name], v.turn_rad)
        for v in construction.vectors.values()
    }
    segments |= {
        name: TaskSegment(name, tail, head, "kL", places[head] - places[tail])
        for name, (tail, head) in construction.links.items()
    }
    return Task(
        assignment=assignment,
        rubric=rubric,
        variant=variant,
        construction=construction,
        parameters=parameters,
        real=real,
        segments=segments,
        rates={name: float(rate[0]) for name, rate in plan.rates.items()},
        lengths_m={name: float(parameters[rate.length]) for name, rate in construction.rates.items()},
        pin=driver.pin,
        yardstick=_yardstick(plan.mechanism),
        omega=float(driver.omega[0]) if isinstance(driver, Crank) else None,
        gear_ratio=None if ratio is None else float(ratio[0]),
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
