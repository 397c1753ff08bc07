"""The figures of every variant as columns, and the table of them for spreadsheets.

Names are those of measurement files: ``v_A`` drawn millimetres, ``v_A_value`` SI, ``v_A_deg``
counter-clockwise from +x, ``omega_3_value`` counter-clockwise positive; besides them the scales (real
units per millimetre on paper) and the points of the mechanism, ``x_A`` and ``y_A`` in metres.
"""

import csv
import io
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from reference.assignment import Variant
from reference.geometry import FloatArray
from reference.plan import ZERO_SHARE, Plan

UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s²)/mm"}
BoolArray = NDArray[np.bool_]
Title = Literal["Scales", "Mechanism", "Velocities", "Accelerations"]
PLANS: dict[Title, str] = {"Velocities": "velocity_plan", "Accelerations": "acceleration_plan"}
VALUE_UNITS = {"kv": "m/s", "ka": "m/s²"}


@dataclass(frozen=True, slots=True)
class Column:
    """One figure of every variant.

    Attributes
    ----------
    key : its name in files
    over, under : its heading on paper: whose it is, and in what unit
    values : (N,), nan where a variant has none (the direction of a zero vector)
    digits, kind : on paper, so many decimals (``f``) or significant digits (``g``)
    """

    key: str
    over: str
    under: str
    values: FloatArray
    digits: int
    kind: Literal["f", "g"] = "f"


@dataclass(frozen=True, slots=True)
class Section:
    """Columns that belong together, in blocks that stay on one page."""

    title: Title
    blocks: tuple[tuple[Column, ...], ...]


def sections_of(plan: Plan) -> tuple[Section, ...]:
    """All columns of a plan's variants."""
    count = len(plan.variants)
    scales = [
        Column(name, name, unit, np.broadcast_to(getattr(plan.scales, name), (count,)), 5, "g")
        for name, unit in UNITS.items()
    ]
    rates = [
        Column(
            f"{name}_value",
            name,
            "rad/s" if name.startswith("omega") else "rad/s²",
            _rate(plan, name),
            5,
            "g",
        )
        for name in plan.rates
    ]
    sections = [
        Section("Scales", tuple((column,) for column in (*scales, *rates))),
        Section("Mechanism", tuple(_point(joint, at, count) for joint, at in plan.motion.position.items())),
    ]
    for title, figure in PLANS.items():
        if figure in plan.nodes_mm:
            names = [vector.name for vector in plan.construction.vectors_of(figure)]
            sections.append(Section(title, tuple(_vector(plan, name) for name in names)))
    return tuple(sections)


def _point(joint: str, at: np.ndarray, count: int) -> tuple[Column, ...]:
    place = np.broadcast_to(at, (count,))
    return (
        Column(f"x_{joint}", joint, "x, m", place.real + 0.0, 5),
        Column(f"y_{joint}", joint, "y, m", place.imag + 0.0, 5),
    )


def _is_zero(plan: Plan, vector: str) -> BoolArray:
    figure = plan.construction.figure_of(plan.construction.vectors[vector].head)
    return np.asarray(np.abs(plan.drawn_mm(vector)) <= ZERO_SHARE * plan.size_mm(figure))


def _rate(plan: Plan, name: str) -> FloatArray:
    """An angular quantity, exactly zero where the vector that it comes from is."""
    values = np.broadcast_to(plan.rates[name], (len(plan.variants),))
    return np.where(_is_zero(plan, plan.construction.rates[name].vector), 0.0, values) + 0.0


def _vector(plan: Plan, name: str) -> tuple[Column, ...]:
    drawn, value, is_zero = np.abs(plan.drawn_mm(name)), np.abs(plan.vectors_si[name]), _is_zero(plan, name)
    unit = VALUE_UNITS[plan.construction.vectors[name].scale]
    return (
        Column(name, name, "mm", np.where(is_zero, 0.0, drawn), 2),
        Column(f"{name}_value", name, unit, np.where(is_zero, 0.0, value), 4, "g"),
        Column(f"{name}_deg", name, "°", plan.direction_deg(name), 2),
    )


def identity(variants: Sequence[Variant]) -> list[tuple[str, list[int]]]:
    """``n`` and ``position`` of each variant, as far as the assignment has them."""
    columns = [(name, [getattr(variant, name) for variant in variants]) for name in ("n", "position")]
    return [(name, numbers) for name, numbers in columns if numbers and numbers[0] is not None]


def class_csv(plan: Plan, *, decimal_comma: bool = False) -> str:
    """A row for each variant; semicolons and decimal commas where the spreadsheet's language has them.

    Ten significant digits; a zero vector's direction is blank. UTF-8 without a mark, CRLF.
    """
    columns = [column for section in sections_of(plan) for block in section.blocks for column in block]
    known = identity(plan.variants)
    buffer = io.StringIO()
    writer = csv.writer(buffer, lineterminator="\r\n", delimiter=";" if decimal_comma else ",")
    writer.writerow([*(name for name, _ in known), *(column.key for column in columns)])
    for row in range(len(plan.variants)):
        figures = [_written(float(column.values[row]), decimal_comma) for column in columns]
        writer.writerow([*(numbers[row] for _, numbers in known), *figures])
    return buffer.getvalue()


def _written(value: float, decimal_comma: bool) -> str:
    if np.isnan(value):
        return ""
    text = f"{value:.10g}"
    return text.replace(".", ",") if decimal_comma else text
