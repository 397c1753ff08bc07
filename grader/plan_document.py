"""The exact plan of one variant as a JSON document."""

from collections.abc import Mapping

import numpy as np

from grader.documents import PlanDocument, PlanVector, ScalesDocument
from reference.assignment import Assignment, Variant
from reference.centres import acceleration_poles, instantaneous_centres
from reference.geometry import ComplexArray, FloatArray
from reference.plan import Plan, conditioning

UNITS = {"kv": "m/s", "ka": "m/s^2"}


def variant_numbers(variant: Variant) -> dict[str, int]:
    """The ``variant`` of documents: n where the assignment has one."""
    return {} if variant.n is None else {"n": variant.n}


def plan_document(assignment: Assignment, plan: Plan, index: int = 0) -> PlanDocument:
    """The plan of the variant at an index of a plan's arrays."""
    return _document(assignment, plan, index, conditioning(plan))


def plan_documents(assignment: Assignment, plan: Plan) -> list[PlanDocument]:
    """The plans of all variants, the conditioning evaluated once."""
    told = conditioning(plan)
    return [_document(assignment, plan, index, told) for index in range(len(plan.variants))]


def _document(assignment: Assignment, plan: Plan, index: int, told: Mapping[str, FloatArray]) -> PlanDocument:
    count = len(plan.variants)

    def pick(values: FloatArray) -> float:
        return float(np.broadcast_to(values, (count,))[index])

    def point(place: np.ndarray) -> tuple[float, float]:
        z = complex(np.broadcast_to(place, (count,))[index])
        return z.real + 0.0, z.imag + 0.0

    vectors = {
        name: PlanVector(
            value=pick(np.abs(plan.vectors_si[name])),
            unit=UNITS[vector.scale],
            drawn_mm=pick(np.abs(plan.drawn_mm(name))),
            direction_deg=_known(pick(plan.direction_deg(name))),
        )
        for name, vector in plan.construction.vectors.items()
    }
    return PlanDocument(
        assignment=assignment.id,
        variant=variant_numbers(plan.variants[index]),
        position=plan.variants[index].position,
        scales=ScalesDocument(kL=pick(plan.scales.kL), kv=pick(plan.scales.kv), ka=pick(plan.scales.ka)),
        points_m={joint: point(place) for joint, place in plan.motion.position.items()},
        vectors=vectors,
        nodes_mm={
            figure: {node: point(place) for node, place in plan.nodes_mm[figure].items()}
            for figure in plan.construction.poles
        },
        angular={name: pick(values) for name, values in plan.rates.items()},
        centres_m={name: _known_point(point(place)) for name, place in _centres(plan).items()},
        conditioning=_grouped({name: pick(values) for name, values in told.items()}),
    )


def _centres(plan: Plan) -> dict[str, ComplexArray]:
    found = (plan.mechanism, plan.construction, plan.motion)
    poles = acceleration_poles(*found) if plan.motion.acceleration else {}
    return {**instantaneous_centres(*found), **poles}


def _known_point(place: tuple[float, float]) -> tuple[float, float] | None:
    return place if np.isfinite(place).all() else None


def _known(value: float) -> float | None:
    return None if np.isnan(value) else value


def _grouped(told: Mapping[str, float]) -> dict[str, float | dict[str, float]]:
    """``transmission B`` and its like gathered under ``transmission``."""
    groups: dict[str, float | dict[str, float]] = {}
    for name, value in told.items():
        kind, _, node = name.partition(" ")
        if not node:
            groups[kind] = value
            continue
        group = groups.setdefault(kind, {})
        if isinstance(group, dict):
            group[node] = value
    return groups
