"""The exact plan of a variant as the published JSON document, with centres and conditioning."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal, cast

import numpy as np
from pydantic import BaseModel, ConfigDict

from reference.authored.assignment import Assignment
from reference.construction.graph import Construction
from reference.geometry import ComplexArray, FloatArray, degrees
from reference.kinematics.motion import Motion
from reference.kinetics import Forces, Given, Reaction
from reference.mechanism import Crank, Mechanism
from reference.plan import Plan, conditioning
from reference.quantities import unit_of

# Centres and poles --------------------------------------------------------------------------------

NO_TURN = 1e-12
"""A link that turns more slowly, relative to the mechanism's reach and largest speed, does not turn."""


def instantaneous_centres(
    mechanism: Mechanism, construction: Construction, motion: Motion
) -> dict[str, ComplexArray]:
    """Return centres ``I3`` of links relative to the ground, ``I34`` of two links; complex metres, (N,).

    nan if there is none: links that do not turn, or turn alike.
    """
    joints = _joints_of_links(mechanism, construction)
    fields = {link: _spin(motion, joint, motion.omega[link]) for link, joint in joints.items()}
    still = (np.zeros(1, dtype=np.complex128), np.zeros(1))
    least = NO_TURN * _largest(motion.velocity) / _largest(motion.position)
    centres = {f"I{link}": _common_point(field, still, least) for link, field in fields.items()}
    for first, second in combinations(fields, 2):
        centres[f"I{first}{second}"] = _common_point(fields[first], fields[second], least)
    return centres


def acceleration_poles(
    mechanism: Mechanism, construction: Construction, motion: Motion
) -> dict[str, ComplexArray]:
    """Return ``J3`` of every link that turns; complex metres, nan if it neither turns nor accelerates."""
    poles = {}
    least = NO_TURN * _largest(motion.acceleration) / _largest(motion.position)
    for link, joint in _joints_of_links(mechanism, construction).items():
        swing = np.asarray(1j * motion.epsilon[link] - motion.omega[link] ** 2)
        poles[f"J{link}"] = motion.position[joint] - _divided(motion.acceleration[joint], swing, least)
    return poles


def _largest(of_joints: Mapping[str, ComplexArray]) -> FloatArray:
    return np.asarray(np.max([np.abs(values) for values in of_joints.values()], axis=0))


def _joints_of_links(mechanism: Mechanism, construction: Construction) -> Mapping[str, str]:
    """Return a joint of each link that turns."""
    driver = mechanism.driver
    links = {driver.link: driver.pin} if isinstance(driver, Crank) else {}
    rates = {name.partition("_")[2]: rate for name, rate in construction.rates.items()}
    return {**links, **{link: rate.link[1] for link, rate in rates.items()}}


def _spin(motion: Motion, joint: str, omega: FloatArray) -> tuple[ComplexArray, FloatArray]:
    """Return a link's velocities as c + i omega z: c and omega."""
    at, velocity = motion.position[joint], motion.velocity[joint]
    return np.asarray(velocity - 1j * omega * at), omega


def _common_point(
    first: tuple[ComplexArray, FloatArray], second: tuple[ComplexArray, FloatArray], least: FloatArray
) -> ComplexArray:
    return _divided(second[0] - first[0], np.asarray(1j * (first[1] - second[1])), least)


def _divided(over: ComplexArray, under: ComplexArray, least: FloatArray) -> ComplexArray:
    with np.errstate(all="ignore"):
        return np.where(np.abs(under) > least, over / under, np.nan)


# The document ----------------------------------------------------------------------------------


class _Document(BaseModel):
    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False, defer_build=True)


class PlanVector(_Document):
    """An exact vector; a zero vector's direction is null."""

    value: float
    unit: str
    drawn_mm: float
    direction_deg: float | None


class ForceDocument(_Document):
    """The force of link `by` on link `on`, N; a zero force's direction is null."""

    on: str
    by: str
    x_N: float  # noqa: N815 - the unit
    y_N: float  # noqa: N815
    value_N: float  # noqa: N815
    direction_deg: float | None


class GuideDocument(ForceDocument):
    """The force of a guide across it; its moment about the slider's joint, or its point of action instead.

    `at_m` is in the mechanism's coordinates; null where the force is zero.
    """

    moment_Nm: float  # noqa: N815
    at_m: tuple[float, float] | None


class InertiaDocument(_Document):
    """The inertia force of a link, against the acceleration of its centre of mass `at`, and its couple."""

    force_N: float  # noqa: N815
    direction_deg: float | None
    moment_Nm: float  # noqa: N815
    at: str


class BalancingMoment(_Document):
    """The balancing moment on the driving crank, counter-clockwise positive."""

    on: str
    moment_Nm: float  # noqa: N815


class ForcesDocument(_Document):
    """The forces of a mechanism with bodies or loads; links are named as in its file, 0 is the frame.

    `joints` are named by joint, a further hinge there by joint and link (``B_4``); `guides` by the slider's
    joint. Where a slider or a cylinder drives, the balancing force is along its guide.
    """

    joints: dict[str, ForceDocument]
    guides: dict[str, GuideDocument]
    inertia: dict[str, InertiaDocument]
    balancing: BalancingMoment | ForceDocument
    power_residual: float


class PlanDocument(_Document):
    """The exact plan of one variant; plan nodes relative to their pole, y up.

    `centres_m`: instantaneous centres (``I3``, of two links ``I34``) and acceleration poles (``J3``) in the
    mechanism's coordinates; null if a link does not turn. Without bodies and loads there are no `forces`.
    """

    schema_version: Literal[1] = 1
    assignment: str
    variant: dict[str, int]
    position: int | None
    scales: dict[str, float]
    """Real units per millimetre on paper: m/mm, (m/s)/mm, (m/s^2)/mm, N/mm."""
    points_m: dict[str, tuple[float, float]]
    vectors: dict[str, PlanVector]
    nodes_mm: dict[str, dict[str, tuple[float, float]]]
    angular: dict[str, float]
    centres_m: dict[str, tuple[float, float] | None]
    conditioning: dict[str, float | dict[str, float]]
    forces: ForcesDocument | None = None

    @property
    def unused(self) -> set[str]:
        """Fields that are left out of the JSON: the forces where there are none."""
        return {"forces"} if self.forces is None else set()


def plan_document(assignment: Assignment, plan: Plan) -> PlanDocument:
    """Return the plan of one variant, the first."""
    return plan_documents(assignment, plan)[0]


def plan_documents(assignment: Assignment, plan: Plan) -> list[PlanDocument]:
    """Return the plans of all variants; everything is evaluated once."""
    columns = _columns(plan)
    return [_document(assignment, plan, columns, index) for index in range(len(plan.variants))]


@dataclass(frozen=True, slots=True)
class _Columns:
    """The contents of a plan's documents, each a list over variants."""

    numbers: Mapping[str, Mapping[str, list[float]]]
    """By quantity (``value``, ``drawn_mm``, ``direction_deg``, ``rate``, ...) and name."""
    points: Mapping[str, Mapping[str, list[complex]]]
    """By figure (``mechanism``, ``centres``, the plans) and node."""


def _columns(plan: Plan) -> _Columns:
    count = len(plan.variants)

    def lists(arrays: Mapping[str, np.ndarray]) -> dict[str, list[Any]]:
        # Adding zero turns minus zero into zero.
        return {name: (np.broadcast_to(array, (count,)) + 0.0).tolist() for name, array in arrays.items()}

    vectors, driver = plan.construction.vectors, plan.mechanism.driver
    is_derived = isinstance(driver, Crank) and driver.rpm is not None
    told: frozenset[str] = frozenset() if is_derived else plan.construction.driving
    numbers = {
        "value": lists({name: np.abs(plan.vectors_si[name]) for name in vectors}),
        "drawn_mm": lists({name: np.abs(plan.drawn_mm(name)) for name in vectors}),
        "direction_deg": lists({name: plan.direction_deg(name) for name in vectors}),
        "scale": lists(plan.scales.by_name),
        "rate": lists({name: rate for name, rate in plan.rates.items() if name not in told}),
        "conditioning": lists(conditioning(plan)),
    }
    of_plan = (plan.mechanism, plan.construction, plan.motion)
    poles = acceleration_poles(*of_plan) if plan.motion.acceleration else {}
    centres = {**instantaneous_centres(*of_plan), **poles}
    points = {"mechanism": lists(plan.motion.position), "centres": lists(centres)}
    points |= {figure: lists(plan.nodes_mm[figure]) for figure in plan.construction.poles}
    return _Columns(numbers, points)


def _document(assignment: Assignment, plan: Plan, columns: _Columns, index: int) -> PlanDocument:
    def numbers(what: str) -> dict[str, float]:
        return {name: values[index] for name, values in columns.numbers[what].items()}

    def points(figure: str) -> dict[str, tuple[float, float]]:
        return {name: (at[index].real, at[index].imag) for name, at in columns.points[figure].items()}

    variant = plan.variants[index]
    value, drawn, direction = numbers("value"), numbers("drawn_mm"), numbers("direction_deg")
    return PlanDocument(
        assignment=assignment.id,
        variant={} if variant.n is None else {"n": variant.n},
        position=variant.position,
        scales=numbers("scale"),
        points_m=points("mechanism"),
        vectors={
            name: PlanVector(
                value=value[name],
                unit=unit_of(name),
                drawn_mm=drawn[name],
                direction_deg=None if math.isnan(direction[name]) else direction[name],
            )
            for name in plan.construction.vectors
        },
        nodes_mm={figure: points(figure) for figure in plan.construction.poles},
        angular=numbers("rate"),
        centres_m={
            name: point if all(map(math.isfinite, point)) else None
            for name, point in points("centres").items()
        },
        conditioning=_grouped(numbers("conditioning")),
        forces=None if plan.forces is None else _forces(plan.forces, plan.motion, index),
    )


def _forces(forces: Forces, motion: Motion, index: int) -> ForcesDocument:
    """Return the forces of one variant."""
    acting = [*(one.force for one in forces.given), *(one.force for one in forces.hinges.values())]
    least = NO_TURN * max(abs(complex(force[index])) for force in acting)

    def directed(force: ComplexArray) -> tuple[float, float | None]:
        size, angle = abs(force[index]), degrees(np.angle(force[index]))
        return float(size), float(angle) if size > least else None

    def reaction(one: Reaction) -> dict[str, Any]:
        (size, direction), force = directed(one.force), complex(one.force[index])
        x, y = force.real + 0.0, force.imag + 0.0
        links = {"on": one.on, "by": one.by}
        return {**links, "x_N": x, "y_N": y, "value_N": size, "direction_deg": direction}

    def guide(one: Reaction) -> GuideDocument:
        point = motion.position[one.joint][index] + one.lever_m[index] * np.asarray(one.along)[index]
        acts = directed(one.force)[1] is not None
        at = (float(point.real), float(point.imag)) if acts else None
        return GuideDocument(**reaction(one), moment_Nm=float(one.moment[index]) + 0.0, at_m=at)

    def inertia(one: Given) -> InertiaDocument:
        (size, direction), couple = directed(one.force), float(one.couple[index]) + 0.0
        return InertiaDocument(force_N=size, direction_deg=direction, moment_Nm=couple, at=one.point)

    last = forces.balancing
    moment = BalancingMoment(on=last.on, moment_Nm=float(last.moment[index]) + 0.0)
    return ForcesDocument(
        joints={name: ForceDocument(**reaction(joint)) for name, joint in forces.hinges.items()},
        guides={name: guide(slider) for name, slider in forces.guides.items()},
        inertia={one.link: inertia(one) for one in forces.given if one.kind == "inertia"},
        balancing=ForceDocument(**reaction(last)) if last.along is not None else moment,
        power_residual=float(forces.power_residual[index]),
    )


def _grouped(values: Mapping[str, float]) -> dict[str, float | dict[str, float]]:
    """Group ``transmission B`` and similar names under ``transmission``."""
    groups: dict[str, float | dict[str, float]] = {}
    for name, value in values.items():
        kind, _, node = name.partition(" ")
        if node:
            cast("dict[str, float]", groups.setdefault(kind, {}))[node] = value
        else:
            groups[kind] = value
    return groups
