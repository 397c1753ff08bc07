"""The subject of a drawing: one variant of an assignment's plan, its names and numbers, and the wording."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from reference.authored.assignment import Assignment, Variant
from reference.construction.elements import View
from reference.drawing.canvas import Bounds, Piece, Shape, Text, bounds, pieces_of, scale_pieces
from reference.geometry import ComplexArray, FloatArray
from reference.plan import ZERO_SHARE, Plan
from reference.quantities import group_of, scale_of, sort_of, unit_of

PLAN_COLOURS = {"velocity_plan": "#1456a0", "acceleration_plan": "#a03014", "force_plan": "#1a6b3c"}
FARTHEST_MM = 1e4
TOUCHING_MM = 0.05
"""Nodes closer than this are one point on paper."""


@dataclass(frozen=True, slots=True)
class Wording:
    """Words and the decimal mark of a language; English by default."""

    lang: str = "en"
    decimal_mark: str = "."
    titles: Mapping[str, str] = field(
        default_factory=lambda: {
            "mechanism": "Mechanism",
            "velocity_plan": "Velocity plan",
            "acceleration_plan": "Acceleration plan",
            "force_plan": "Force plan of the group of {group}",
            "driving_force_plan": "Force plan of the driving link",
            "scheme": "Links of the group of {group}",
            "driving_scheme": "Driving link",
            "lever": "Zhukovsky's lever",
        }
    )
    variant: Mapping[str, str] = field(default_factory=lambda: {"n": "n", "position": "position"})
    columns: tuple[str, str, str, str, str] = ("vector", "on paper", "mm", "real value", "direction")
    too_large: str = "does not fit A3 at these scales"
    units: Mapping[str, str] = field(default_factory=dict)
    sides: Mapping[str, str] = field(default_factory=dict)

    def unit(self, unit: str) -> str:
        """Return a unit in the language's letters, `m/s^2` with a superscript."""
        written = unit.replace("^2", "²")
        return self.units.get(written, written)

    def number(self, text: str) -> str:
        """Return a number, given with a point, as the language writes it."""
        return text.replace(".", self.decimal_mark).replace("-", "−")

    def variant_text(self, variant: Variant) -> str:
        """Return the student's number and position."""
        return ", ".join(f"{self.variant[name]} = {value}" for name, value in variant.numbers.items())


@dataclass(frozen=True, slots=True)
class Part:
    """A shape of a figure, and the node whose step draws it (none if it is there from the start).

    `until` is the node whose step replaces the shape: a letter to which one is added.
    """

    node: str
    shape: Shape
    until: str = ""


@dataclass(frozen=True, slots=True)
class DrawnFigure:
    """A figure about its own origin, sheet millimetres, y down."""

    name: str
    parts: tuple[Part, ...]

    @property
    def shapes(self) -> tuple[Shape, ...]:
        """All shapes of the finished figure."""
        return tuple(part.shape for part in self.parts if not part.until)

    @property
    def bounds(self) -> Bounds:
        """The box that it fills."""
        return bounds(self.shapes)

    @property
    def size(self) -> tuple[float, float]:
        """Width and height."""
        left, top, right, bottom = self.bounds
        return right - left, bottom - top


@dataclass(frozen=True, slots=True)
class Subject:
    """The variant at an index of a plan's arrays; `altitude` draws the triangles of normal components."""

    assignment: Assignment
    plan: Plan
    index: int = 0
    wording: Wording = field(default_factory=Wording)
    altitude: bool = False

    @property
    def title(self) -> str:
        """The assignment's title and the variant, in the wording's language."""
        title = self.assignment.file.title.in_language(self.wording.lang)
        variant_text = self.wording.variant_text(self.plan.variants[self.index])
        return f"{title}, {variant_text}" if variant_text else title

    def number(self, values: FloatArray) -> float:
        """Return the variant's number, from an array over variants or a number common to all."""
        return float(values[self.index] if np.ndim(values) else values)

    def vector(self, values: ComplexArray) -> complex:
        """Return the variant's complex number, from an array over variants or a number common to all."""
        return complex(np.broadcast_to(values, (len(self.plan.variants),))[self.index])

    def nodes(self, figure: str) -> dict[str, complex]:
        """Return a figure's nodes, complex millimetres about its origin, y up."""
        return {node: self.vector(at) for node, at in self.plan.nodes_mm[figure].items()}

    @property
    def view(self) -> View:
        """All nodes and parameters of this variant, as steps use them."""
        nodes = {
            node: np.asarray(at) for figure in self.plan.nodes_mm for node, at in self.nodes(figure).items()
        }
        count = len(self.plan.variants)
        known = {
            name: np.broadcast_to(value, (count,))[self.index]
            for name, value in self.plan.drawing.parameters.items()
        }
        return View(nodes, known)

    @property
    def centres(self) -> dict[str, complex]:
        """Instantaneous centres and acceleration poles on the sketch, if they lie on the paper."""
        view = self.view
        with np.errstate(all="ignore"):
            found = {
                name: complex(step.place(view)) for name, step in self.plan.construction.centres.items()
                if set(step.needs) <= view.nodes.keys()
            }  # fmt: skip
        return {name: at for name, at in found.items() if abs(at) < FARTHEST_MM}

    def is_zero(self, vector: str) -> bool:
        """Return whether a vector is too short, compared with its plan, to have a direction."""
        figure = self.plan.construction.figure_of(self.plan.construction.vectors[vector].head)
        size = self.number(self.plan.size_mm(figure))
        return self.number(np.abs(self.plan.drawn_mm(vector))) <= max(ZERO_SHARE * size, 1e-9)

    def shown(self, name: str) -> str:
        """Return a name as the assignment's students know it."""
        return self.assignment.file.names.get(name, name)

    def letter(self, name: str) -> tuple[Piece, ...]:
        """Return a node's or a vector's name, typeset."""
        return pieces_of(self.shown(name))

    def scale_with_value(self, scale: str, times: float = 1.0) -> tuple[Piece, ...]:
        """Return a scale with its value: kL = 0.005 m/mm."""
        value = self.wording.number(f"{self.number(getattr(self.plan.scales, scale)) * times:.5g}")
        unit = self.wording.unit(unit_of(scale))
        return (*scale_pieces(self.shown(scale)), Piece(f" = {value} {unit}"))

    def captioned(self, title: str, scale: str, times: float = 1.0) -> Text:
        """Return a title with a scale, or with some times it."""
        return (Piece(f"{title},  "), *self.scale_with_value(scale, times))

    def caption(self, figure: str) -> Text:
        """Return the caption above a figure: its title and scale."""
        return self.captioned(self.title_of(sort_of(figure), figure), scale_of(figure))

    def title_of(self, sort: str, figure: str) -> str:
        """Return the title of a figure, or of what stands beside it."""
        title = self.wording.titles[self.title_key(sort, figure)]
        return title.replace("{group}", self.shown(group_of(figure)))

    def title_key(self, sort: str, figure: str) -> str:
        """Return the key of that title: the driving link is no group."""
        return f"driving_{sort}" if group_of(figure) == self.plan.mechanism.driver.pin else sort
