"""Propagated drafting errors: the derivative of the construction by the error of each act of drawing.

Each act (a line set along a direction, a length transferred, a point marked) has an independent error.
One evaluation on arrays, an element for each act, gives how each error moves each node; a vector's
variance is the sum of the squares. The same evaluation with a student's own nodes in place of computed
ones gives what follows from these, with the errors of the later acts alone.
"""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from reference.construction.elements import Errors, Parameters, View
from reference.construction.graph import Construction
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from reference.geometry import ComplexArray

Act = tuple[str, int, str]
"""Node, index of its step's line or length, and kind, as in `reference.construction.elements.Errors`."""
SMALL = 1e-4
"""Size of the trial error in standard deviations: small against any curvature, large against the digits of a
length.
"""
FOOT_SHARE = 0.5
"""A line's foot lies on an existing point, so its error is this share of a length's error."""


@dataclass(frozen=True, slots=True)
class Skill:
    """Standard deviations of one act of drawing.

    Attributes
    ----------
    angle_deg : of a line set parallel or perpendicular to another
    place_mm : of a length transferred or an arc opened; half of it of the foot of a line
    mark_mm : of a point's mark, along x and along y
    """

    angle_deg: float
    place_mm: float
    mark_mm: float

    def deviation(self, kind: str) -> float:
        """Return the standard deviation of one kind of act, millimetres or radians."""
        match kind:
            case "angle":
                return float(np.radians(self.angle_deg))
            case "shift":
                return FOOT_SHARE * self.place_mm
            case "length":
                return self.place_mm
            case _:
                return self.mark_mm


def acts_of(step: Step) -> tuple[tuple[int, str], ...]:
    """Return the acts of drawing that a step consists of: index of the line or length, and kind."""
    mark = ((0, "x"), (0, "y"))
    match step:
        case Given() | Local() | OnGuide():
            return ((0, "angle"), (0, "shift"), (0, "length"), *mark)
        case TwoLines():
            return ((0, "angle"), (0, "shift"), (1, "angle"), (1, "shift"), *mark)
        case TwoArcs():
            return ((0, "length"), (1, "length"), *mark)
        case ArcAndLine():
            return ((0, "length"), (1, "angle"), (1, "shift"), *mark)
        case Divide() | Tangent():
            return ((0, "length"), *mark)
        case Coincide():
            return ()
        case _:
            return mark


def acts(construction: Construction) -> tuple[Act, ...]:
    """All acts of drawing, in order."""
    return tuple((step.node, slot, kind) for step in construction.steps for slot, kind in acts_of(step))


def step_errors(step: Step, skill: Skill) -> Errors:
    """Return the errors of one step's acts, (acts + 1, 1): none in the first row, then one in each row.

    Each is `SMALL` standard deviations.
    """
    own = acts_of(step)
    rows = SMALL * np.eye(len(own), 1 + len(own), 1)[:, :, None]
    return {
        (step.node, slot, kind): row * skill.deviation(kind)
        for (slot, kind), row in zip(own, rows, strict=True)
    }


@dataclass(frozen=True, slots=True)
class OwnNode:
    """A node as a student has drawn it, or as measurements give it.

    Attributes
    ----------
    at : complex millimetres
    shifts : (r,) its shift by one standard deviation of each error of measuring; None without any
    """

    at: complex
    shifts: ComplexArray | None = None


@dataclass(frozen=True, slots=True)
class TracedNode:
    """A node with its derivative by all errors.

    Attributes
    ----------
    at : complex millimetres
    shifts : (m,) by one standard deviation of each drafting error, then of each error of measuring
    """

    at: complex
    shifts: ComplexArray


@dataclass(frozen=True, slots=True)
class EndSpread:
    """Standard deviations of a vector's end, millimetres, along the vector and across it."""

    along: float
    across: float


@dataclass(frozen=True, slots=True)
class TracedDrawing:
    """A drawing traced step by step.

    Attributes
    ----------
    made : each node as its step makes it from the nodes before it, the student's own ones if known
    nodes : the student's own node if known, else as made
    drafting_count : number of drafting errors; errors of measuring come after them
    """

    made: Mapping[str, TracedNode]
    nodes: Mapping[str, TracedNode]
    drafting_count: int

    def vector(self, tail: str, head: str) -> complex:
        """Return the vector to `head` as the step of `head` makes it, complex mm."""
        return self.made[head].at - self.nodes[tail].at

    def shifts(self, tail: str, head: str) -> ComplexArray:
        """Return the shift of the vector's end by one standard deviation of each error, complex mm."""
        return np.asarray(self.made[head].shifts - self.nodes[tail].shifts)


NO_OWN: Mapping[str, Mapping[str, OwnNode]] = {}


def trace(
    construction: Construction,
    parameters: Parameters,
    skill: Skill,
    own: Mapping[str, Mapping[str, OwnNode]] = NO_OWN,
) -> TracedDrawing:
    """Draw a construction with drafting errors, from a student's own nodes where they are known.

    Arguments
    ---------
    parameters : scalars, see `reference.construction.elements.Parameters`
    own : the student's nodes as each figure is drawn from them, by figure and node: with two sheets the
        second has a sketch of its own

    A node without a solution is nan; an error that leaves no solution counts as no shift.
    """
    every = acts(construction)
    drafting = len(every)
    measuring = max(
        (len(one.shifts) for nodes in own.values() for one in nodes.values() if one.shifts is not None),
        default=0,
    )
    # Arrays over the errors: none first, then one act's in each element, then those of measuring.
    rows = SMALL * np.eye(drafting, 1 + drafting + measuring, 1)
    errors = {act: row * skill.deviation(act[2]) for act, row in zip(every, rows, strict=True)}

    def placed(one: OwnNode) -> ComplexArray:
        place = np.full(1 + drafting + measuring, one.at)
        if one.shifts is not None:
            place[1 + drafting : 1 + drafting + len(one.shifts)] += SMALL * one.shifts
        return place

    made: dict[str, ComplexArray] = {}
    nodes: dict[str, ComplexArray] = {}
    with np.errstate(all="ignore"):
        for figure, steps in construction.figures.items():
            here = {name: placed(one) for name, one in own.get(figure, {}).items()}
            known = {**nodes, **here}
            view = View(known, parameters, errors)
            for step in steps:
                node = step.node
                mark = view.error(node, 0, "x") + 1j * view.error(node, 0, "y")
                made[node] = np.asarray(step.place(view) + mark)
                known[node] = nodes[node] = here.get(node, made[node])
        traced = {name: _traced(place) for name, place in made.items()}
        taken = {
            name: traced[name] if place is made[name] else _traced(place) for name, place in nodes.items()
        }
    return TracedDrawing(traced, taken, drafting)


def _traced(place: ComplexArray) -> TracedNode:
    """Return a node's position without errors, and its shift by each of them."""
    shifts = (place[1:] - place[0]) / SMALL
    return TracedNode(complex(place[0]), np.where(np.isfinite(shifts), shifts, 0.0))


def spread(shifts: ComplexArray, along: complex) -> EndSpread:
    """Return the standard deviations of a vector's end along and across the vector, from independent errors.

    Arguments: `along` is the vector; for a zero vector both are the root of the sum over both axes.
    """
    if along == 0.0:
        whole = float(np.sqrt(np.sum(np.abs(shifts) ** 2)))
        return EndSpread(whole, whole)
    turned = shifts * np.conj(along / abs(along))
    return EndSpread(float(np.sqrt(np.sum(turned.real**2))), float(np.sqrt(np.sum(turned.imag**2))))
