"""Which division of the sheet suits an assignment: its figures' exact extents over all variants."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.layout import TEMPLATES, Template
from grader.records import ACCELERATION_PLAN, MECHANISM
from reference.assignment import Assignment, Variant
from reference.construction import Construction, evaluate
from reference.derivation import construction_of
from reference.geometry import ComplexArray
from reference.parameters import parameters_of

MARGIN_MM = 12.0
"""Around a figure: letters, arrowheads, hatching of the guides."""


@dataclass(frozen=True, slots=True)
class Fit:
    """A template for a page and how well it holds the figures.

    Attributes
    ----------
    template : the best of all
    room : zone over need by figure, the lesser of width and height; below 1 it is too small in some variant
    need_mm : widest and highest of any variant by figure, margins included
    """

    template: Template
    room: dict[str, float]
    need_mm: dict[str, tuple[float, float]]


def construction_for(assignment: Assignment, figures: Sequence[str]) -> Construction:
    """The construction of an assignment, without accelerations where no figure needs them."""
    return construction_of(
        assignment.mechanism(assignment.variants()),
        accelerations=ACCELERATION_PLAN in figures,
        plate_by_similarity=assignment.file.plate_images == "similarity",
    )


def places_mm(
    assignment: Assignment, figures: Sequence[str], variants: list[Variant]
) -> dict[str, ComplexArray]:
    """Where the nodes of each figure are about its pole, at the assignment's own scales.

    (nodes, variants) complex millimetres by figure, y up; a sketch's about its own origin.
    """
    scales = assignment.scales(variants)
    construction = construction_for(assignment, figures)
    parameters = parameters_of(assignment.mechanism(variants), scales.kL, scales.kv, scales.ka)
    nodes = evaluate(construction, parameters)
    return {
        figure: np.stack(
            [np.broadcast_to(nodes[step.node], (len(variants),)) for step in construction.figures[figure]]
        )
        for figure in figures
    }


def extents_mm(
    assignment: Assignment, figures: Sequence[str], variants: list[Variant]
) -> dict[str, tuple[float, float]]:
    """Largest width and height of each figure over variants, at the assignment's own scales."""
    return {
        figure: (float(np.ptp(places.real, axis=0).max()), float(np.ptp(places.imag, axis=0).max()))
        for figure, places in places_mm(assignment, figures, variants).items()
    }


def poles_mm(
    assignment: Assignment, template: Template, variants: list[Variant]
) -> dict[str, list[tuple[float, float]]]:
    """Where the poles of a template's plans are best put, sheet millimetres for each variant.

    A plan begun there is in the middle of its zone. None of a plan that is larger than its zone, at
    least in one variant: the student will choose another scale.
    """
    plans = [figure for figure in template.zones if figure != MECHANISM]
    poles = {}
    for figure, places in places_mm(assignment, plans, variants).items():
        x, y, wide, high = template.zones[figure]
        low = places.real.min(axis=0) + 1j * places.imag.min(axis=0)
        top = places.real.max(axis=0) + 1j * places.imag.max(axis=0)
        room = complex(wide - 2 * MARGIN_MM, high - 2 * MARGIN_MM)
        if np.all((top - low).real <= room.real) and np.all((top - low).imag <= room.imag):
            pole = complex(x + wide / 2.0, -y - high / 2.0) - (low + top) / 2.0
            poles[figure] = [(float(at.real), float(-at.imag)) for at in pole]
    return poles


def best_template(assignment: Assignment, figures: Sequence[str]) -> Fit:
    """The division with the most room for the figure that has the least; a sketch may be drawn smaller."""
    return template_for(extents_mm(assignment, figures, assignment.variants()))


def template_for(extents: Mapping[str, tuple[float, float]]) -> Fit:
    """The same for figures whose largest width and height (millimetres) are known already."""
    figures = tuple(extents)
    need = {figure: (wide + 2 * MARGIN_MM, high + 2 * MARGIN_MM) for figure, (wide, high) in extents.items()}

    def room(template: Template, figure: str) -> float:
        _, _, wide, high = template.zones[figure]
        return min(wide / need[figure][0], high / need[figure][1])

    def worth(template: Template) -> tuple[float, float]:
        # A plan's scale is the assignment's; the sketch's is often the student's choice.
        plans = [room(template, figure) for figure in figures if figure != MECHANISM]
        least = min(min(plans, default=np.inf), 1.0)
        return (round(least, 6), min(room(template, figure) for figure in figures))

    best = max((template for template in TEMPLATES if template.figures == set(figures)), key=worth)
    return Fit(best, {figure: room(best, figure) for figure in figures}, need)
