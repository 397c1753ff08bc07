"""The exact plan of one variant as a JSON document."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from grader.documents import PlanDocument, PlanVector, ScalesDocument
from reference.assignment import Assignment, Variant
from reference.centres import acceleration_poles, instantaneous_centres
from reference.geometry import ComplexArray
from reference.plan import Plan, conditioning

UNITS = {"kv": "m/s", "ka": "m/s^2"}


def variant_numbers(variant: Variant) -> dict[str, int]:
    """The ``variant`` of documents: n where the assignment has one."""
    return {} if variant.n is None else {"n": variant.n}


def plan_document(assignment: Assignment, plan: Plan, index: int = 0) -> PlanDocument:
    """The plan of the variant at an index of a plan's arrays."""
    return _document(assignment, plan, _columns(plan), index)


def plan_documents(assignment: Assignment, plan: Plan) -> list[PlanDocument]:
    """The plans of all variants; everything is evaluated once."""
    columns = _columns(plan)
    return [_document(assignment, plan, columns, index) for index in range(len(plan.variants))]


@dataclass(frozen=True, slots=True)
class _Columns:
    """Everything that a plan's documents tell, a list over variants each."""

    numbers: Mapping[str, Mapping[str, list[float]]]
    """By what it is (``value``, ``drawn_mm``, ``direction_deg``, ``rate``, ...) and name."""
    points: Mapping[str, Mapping[str, list[complex]]]
    """By figure (``mechanism``, ``centres``, the plans) and node."""


def _columns(plan: Plan) -> _Columns:
    count = len(plan.variants)

    def lists(arrays: Mapping[str, np.ndarray]) -> dict[str, list[Any]]:
        # Adding zero turns minus zero into zero.
        return {name: (np.broadcast_to(array, (count,)) + 0.0).tolist() for name, array in arrays.items()}

    vectors = plan.construction.vectors
    numbers = {
        "value": lists({name: np.abs(plan.vectors_si[name]) for name in vectors}),
        "drawn_mm": lists({name: np.abs(plan.drawn_mm(name)) for name in vectors}),
        "direction_deg": lists({name: plan.direction_deg(name) for name in vectors}),
        "scale": lists({name: getattr(plan.scales, name) for name in ("kL", "kv", "ka")}),
        "rate": lists(plan.rates),
        "conditioning": lists(conditioning(plan)),
    }
    points = {"mechanism": lists(plan.motion.position), "centres": lists(_centres(plan))}
    points |= {figure: lists(plan.nodes_mm[figure]) for figure in plan.construction.poles}
    return _Columns(numbers, points)


def _document(assignment: Assignment, plan: Plan, columns: _Columns, index: int) -> PlanDocument:
    def numbers(what: str) -> dict[str, float]:
        return {name: values[index] for name, values in columns.numbers[what].items()}

    def points(figure: str) -> dict[str, tuple[float, float]]:
        return {name: (at[index].real, at[index].imag) for name, at in columns.points[figure].items()}

    value, drawn, direction = numbers("value"), numbers("drawn_mm"), numbers("direction_deg")
    return PlanDocument(
        assignment=assignment.id,
        variant=variant_numbers(plan.variants[index]),
        position=plan.variants[index].position,
        scales=ScalesDocument(**numbers("scale")),
        points_m=points("mechanism"),
        vectors={
            name: PlanVector(
                value=value[name],
                unit=UNITS[vector.scale],
                drawn_mm=drawn[name],
                direction_deg=_known(direction[name]),
            )
            for name, vector in plan.construction.vectors.items()
        },
        nodes_mm={figure: points(figure) for figure in plan.construction.poles},
        angular=numbers("rate"),
        centres_m={name: _known_point(place) for name, place in points("centres").items()},
        conditioning=_grouped(numbers("conditioning")),
    )


def _centres(plan: Plan) -> dict[str, ComplexArray]:
    found = (plan.mechanism, plan.construction, plan.motion)
    poles = acceleration_poles(*found) if plan.motion.acceleration else {}
    return {**instantaneous_centres(*found), **poles}


def _known_point(place: tuple[float, float]) -> tuple[float, float] | None:
    return place if all(map(math.isfinite, place)) else None


def _known(value: float) -> float | None:
    return None if math.isnan(value) else value


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
