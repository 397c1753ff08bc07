"""How far a hand may miss each node: the derivative of the one construction by the hand's errors.

Each act of drawing (a line set along a direction, a length transferred, a point marked) has an error
of its own. One evaluation on arrays, an element for each act, tells how each error moves each node;
they are independent, so that a vector's variance is the sum of their squares. The same evaluation
with a student's own nodes in place of computed ones tells what follows from these, and how far the
later acts alone may miss it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

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
"""Node, which of its step's lines or lengths, and kind, as in `reference.construction.elements.Errors`."""
SMALL = 1e-4
"""Of a standard deviation: how large an error is tried. Small against any curvature, large against
the digits of a length."""
FOOT_SHARE = 0.5
"""A line's foot lies on a point that is there: it is missed by this share of a length's error."""


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
        """The standard deviation of one kind of act, millimetres or radians."""
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
    """The acts of drawing that a step consists of: which line or length, and kind."""
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


def hand_errors(step: Step, skill: Skill) -> Errors:
    """The errors of one step's acts, arrays (acts + 1, 1): none in the first row, then one in each.

    They are as small as `SMALL` says, in standard deviations.
    """
    own = acts_of(step)
    rows = SMALL * np.eye(len(own), 1 + len(own), 1)[:, :, None]
    return {
        (step.node, slot, kind): row * skill.deviation(kind)
        for (slot, kind), row in zip(own, rows, strict=True)
    }


@dataclass(frozen=True, slots=True)
class OwnNode:
    """A node as a student has drawn it, or as measurements lead to it.

    Attributes
    ----------
    at : complex millimetres
    moved : (r,) how it is moved by one standard deviation of each error of measuring; None without any
    """

    at: complex
    moved: ComplexArray | None = None


@dataclass(frozen=True, slots=True)
class TracedNode:
    """A node with all that may move it.

    Attributes
    ----------
    at : complex millimetres
    moved : (m,) by one standard deviation of each error of the hand, then of each of measuring
    """

    at: complex
    moved: ComplexArray


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
    made : each node as its step makes it from the nodes before it, own ones where they are known
    nodes : each node as it is: the own one where it is known, else as made
    hand : how many of the errors that may move them are the hand's; those of measuring come after
    """

    made: Mapping[str, TracedNode]
    nodes: Mapping[str, TracedNode]
    hand: int

    def vector(self, tail: str, head: str) -> complex:
        """What the step of `head` makes of a vector."""
        return self.made[head].at - self.nodes[tail].at

    def moved(self, tail: str, head: str) -> ComplexArray:
        """How its end is moved, by one standard deviation of each error."""
        return np.asarray(self.made[head].moved - self.nodes[tail].moved)


NO_OWN: Mapping[str, Mapping[str, OwnNode]] = {}


def trace(
    construction: Construction,
    parameters: Parameters,
    skill: Skill,
    own: Mapping[str, Mapping[str, OwnNode]] = NO_OWN,
) -> TracedDrawing:
    """Draw a construction with a hand's errors, from a student's own nodes where they are known.

    Arguments
    ---------
    parameters : scalars, see `reference.construction.elements.Parameters`
    own : the student's nodes as each figure is drawn from them, by figure and node: with two sheets the
        second has a sketch of its own

    A node that has no place is nan; what an error moves to no place is taken as not moved by it.
    """
    drawing = _Tracing(construction, parameters, skill, own)
    with np.errstate(all="ignore"):
        for figure, steps in construction.figures.items():
            drawing.trace(figure, steps)
    made = {name: drawing.told(place) for name, place in drawing.made.items()}
    nodes = {
        name: made[name] if place is drawing.made[name] else drawing.told(place)
        for name, place in drawing.nodes.items()
    }
    return TracedDrawing(made, nodes, drawing.hand)


@dataclass(slots=True)
class _Tracing:
    """A construction while it is traced: arrays with no error first, then one for each act."""

    construction: Construction
    parameters: Parameters
    skill: Skill
    own: Mapping[str, Mapping[str, OwnNode]]
    errors: Errors = field(init=False)
    hand: int = field(init=False)
    measuring: int = field(init=False)
    made: dict[str, ComplexArray] = field(default_factory=dict)
    nodes: dict[str, ComplexArray] = field(default_factory=dict)

    def __post_init__(self) -> None:
        every = acts(self.construction)
        counts = (
            len(one.moved) for nodes in self.own.values() for one in nodes.values() if one.moved is not None
        )
        self.hand, self.measuring = len(every), max(counts, default=0)
        rows = SMALL * np.eye(self.hand, 1 + self.hand + self.measuring, 1)
        self.errors = {act: row * self.skill.deviation(act[2]) for act, row in zip(every, rows, strict=True)}

    def trace(self, figure: str, steps: tuple[Step, ...]) -> None:
        """One figure, from the own nodes as it was drawn from them."""
        own = {name: self.placed(one) for name, one in self.own.get(figure, {}).items()}
        view = View({**self.nodes, **own}, self.parameters, self.errors)
        seen: dict[str, ComplexArray] = view.nodes  # type: ignore[assignment]
        for step in steps:
            node = step.node
            mark = view.error(node, 0, "x") + 1j * view.error(node, 0, "y")
            self.made[node] = np.asarray(step.place(view) + mark)
            seen[node] = self.nodes[node] = own.get(node, self.made[node])

    def placed(self, one: OwnNode) -> ComplexArray:
        """An own node, with its errors of measuring."""
        place = np.full(1 + self.hand + self.measuring, one.at)
        if one.moved is not None:
            place[1 + self.hand : 1 + self.hand + len(one.moved)] += SMALL * one.moved
        return place

    def told(self, place: ComplexArray) -> TracedNode:
        """A node's place without errors, and how each moves it."""
        moved = (place[1:] - place[0]) / SMALL
        return TracedNode(complex(place[0]), np.where(np.isfinite(moved), moved, 0.0))


def spread(moved: ComplexArray, along: complex) -> EndSpread:
    """The standard deviations of an end that independent errors move, about a vector's direction.

    Arguments: `along` is the vector; for a zero vector both are what the end is off in any direction.
    """
    if along == 0.0:
        whole = float(np.sqrt(np.sum(np.abs(moved) ** 2)))
        return EndSpread(whole, whole)
    turned = moved * np.conj(along / abs(along))
    return EndSpread(float(np.sqrt(np.sum(turned.real**2))), float(np.sqrt(np.sum(turned.imag**2))))
