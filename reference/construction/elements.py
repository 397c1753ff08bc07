"""The directions, lengths and lines that a construction step consists of.

Everything is in drawn millimetres, complex, y up, and an array over variants. `at` gives the value in a
`View`: the nodes so far, the parameters, and the errors of drawing.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np

from reference import geometry
from reference.geometry import ComplexArray, FloatArray

Parameters = Mapping[str, FloatArray]
"""Real lengths (m) by the pair of joints (``"O1A"``), crank data and the scales kL, kv, ka; see
`reference.construction.graph.parameters_of`."""
Nodes = Mapping[str, ComplexArray]
Errors = Mapping[tuple[str, int, str], FloatArray]
"""Errors of drawing, by (node, which of the step's lines or lengths, kind); kinds are ``angle`` (radians, of
a line), ``shift`` (mm, of a line, to its left), ``length`` (mm, of a length transferred), ``x`` and ``y``
(mm, of the node's mark itself)."""

NO_ERROR: FloatArray = np.asarray(0.0)


@dataclass(frozen=True, slots=True)
class View:
    """The context of a step's evaluation: the nodes so far, the parameters, and the errors of drawing."""

    nodes: Nodes
    parameters: Parameters
    errors: Errors = field(default_factory=dict)

    def error(self, node: str, slot: int, kind: str) -> FloatArray:
        """Return one error of drawing, zero if there is none."""
        return self.errors.get((node, slot, kind), NO_ERROR)

    def real_length(self, tail: str, head: str) -> FloatArray:
        """Return the real length (m) between two joints, measured on the sketch."""
        return np.asarray(np.abs(self.nodes[head] - self.nodes[tail]) * self.parameters["kL"])


class FromNodes:
    """A part of a construction that is made from earlier nodes."""

    __slots__ = ()
    reads: ClassVar[tuple[str, ...]] = ()
    """Fields that hold names of nodes, or parts that are made from nodes themselves."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the nodes that the part is made from."""
        return _nodes_in(tuple([getattr(self, name) for name in self.reads]))


def _nodes_in(value: object) -> tuple[str, ...]:
    """Return the nodes that a field of a part names: one, several, those of another part, or none."""
    if isinstance(value, str):
        return (value,)
    if isinstance(value, FromNodes):
        return value.needs
    return tuple([node for inner in value for node in _nodes_in(inner)]) if isinstance(value, tuple) else ()


# Sides --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class VariantSide:
    """A side stored among the parameters because it differs between variants: +1 or -1."""

    parameter: str
    sign: int = 1

    def __neg__(self) -> "VariantSide":
        return VariantSide(self.parameter, -self.sign)


Side = int | VariantSide
"""Side of a group: the same for all variants, or one for each."""


def side_at(side: Side, view: View) -> int | FloatArray:
    """Return +1 for the left (ahead), -1 for the right (behind)."""
    return side.sign * view.parameters[side.parameter] if isinstance(side, VariantSide) else side


# Directions ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Along(FromNodes):
    """The direction of a link as drawn, from joint `tail` to joint `head`, turned by quarters ccw.

    On the other `side` it runs the opposite way.
    """

    reads = ("tail", "head")
    tail: str
    head: str
    quarters: int = 0
    side: Side = 1

    def at(self, view: View) -> ComplexArray:
        """Return the unit vector."""
        link = geometry.unit(view.nodes[self.head] - view.nodes[self.tail])
        return np.asarray(link * 1j**self.quarters * side_at(self.side, view))


@dataclass(frozen=True, slots=True)
class Fixed(FromNodes):
    """A direction given by an angle in radians among the parameters (crank, guide).

    The parameter ``turn`` (radians, 0 when absent) turns all fixed directions alike: a sketch that
    is turned on its sheet is legitimate.
    """

    angle: str
    quarters: int = 0

    def at(self, view: View) -> ComplexArray:
        """Return the unit vector."""
        turn = view.parameters.get("turn", NO_ERROR)
        return np.asarray(geometry.direction(view.parameters[self.angle] + turn) * 1j**self.quarters)


Direction = Along | Fixed

# Lengths ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Scaled(FromNodes):
    """A real quantity among the parameters, drawn at a scale."""

    quantity: str
    scale: str

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        return np.asarray(view.parameters[self.quantity] / view.parameters[self.scale])


@dataclass(frozen=True, slots=True)
class Normal(FromNodes):
    """A normal component v^2 / l, from a velocity as drawn and a real length, at the scale ka.

    `measured` are the sketch's joints between which the length is measured if the mechanism's data do not
    give it: the distance of a slotted link's point from its pivot. By the right triangle on the sketch its
    drawn length is made from drawn lengths alone, whatever the scales: right only where kL ka = kv^2.
    """

    reads = ("tail", "head", "measured")
    tail: str
    head: str
    length: str
    measured: tuple[str, str] | None = None
    by_triangle: bool = False

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        known = view.parameters
        drawn_mm = np.abs(view.nodes[self.head] - view.nodes[self.tail])
        length = known[self.length] if self.measured is None else view.real_length(*self.measured)
        if self.by_triangle:
            return np.asarray(drawn_mm**2 * known["kL"] / length)
        return np.asarray((drawn_mm * known["kv"]) ** 2 / (length * known["ka"]))


@dataclass(frozen=True, slots=True)
class Coriolis(FromNodes):
    """A Coriolis component 2 omega v, from two velocities as drawn, at the scale ka.

    Attributes
    ----------
    slide : the sliding velocity's ends in the velocity plan
    guide : the guide's direction, along which it slides
    turn : ends of the velocity that turns the guide's link about one of its joints
    link : those joints, in the same order, in the sketch
    quarters : quarter turns, counter-clockwise, of the velocity plan as a whole

    The length is positive to the left of `guide`: 2 omega v of the components along guide and across the
    link, with their signs.
    """

    reads = ("slide", "guide", "turn", "link")
    slide: tuple[str, str]
    guide: "Direction"
    turn: tuple[str, str]
    link: tuple[str, str]
    quarters: int = 0

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        known, nodes = view.parameters, view.nodes
        back = 1j**-self.quarters
        sliding, turning = ((nodes[head] - nodes[tail]) * back for tail, head in (self.slide, self.turn))
        arm = geometry.unit(nodes[self.link[1]] - nodes[self.link[0]])
        omega = geometry.cross(arm, turning) * known["kv"] / view.real_length(*self.link)
        speed = geometry.dot(self.guide.at(view), sliding) * known["kv"]
        return np.asarray(2.0 * omega * speed / known["ka"])


@dataclass(frozen=True, slots=True)
class Component(FromNodes):
    """The drawn length of a vector between two nodes along a direction, with its sign."""

    reads = ("tail", "head", "along")
    tail: str
    head: str
    along: "Direction"

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        return geometry.dot(view.nodes[self.head] - view.nodes[self.tail], self.along.at(view))


Length = Scaled | Normal | Coriolis | Component


@dataclass(frozen=True, slots=True)
class Line(FromNodes):
    """The line through a node along a direction."""

    reads = ("through", "along")
    through: str
    along: Direction

    def at(self, view: View, node: str, slot: int) -> tuple[ComplexArray, ComplexArray]:
        """Return a point of the line and its unit vector, with the errors of drawing it."""
        return drawn(view, node, slot, view.nodes[self.through], self.along.at(view))


def fixed_point(view: View, name: str) -> ComplexArray:
    """Return a fixed point of the mechanism (pivot, or a guide's point) at the scale kL."""
    known = view.parameters
    real = known[f"x {name}"] + 1j * known[f"y {name}"]
    return np.asarray(real / known["kL"] * geometry.direction(known.get("turn", NO_ERROR)))


@dataclass(frozen=True, slots=True)
class FixedLine(FromNodes):
    """A guide on the ground, by its name: its point and direction are parameters."""

    guide: str

    @property
    def along(self) -> Fixed:
        """The guide's direction."""
        return Fixed(f"angle {self.guide}")

    def at(self, view: View, node: str, slot: int) -> tuple[ComplexArray, ComplexArray]:
        """Return a point of the line and its unit vector, with the errors of drawing it."""
        return drawn(view, node, slot, fixed_point(view, self.guide), self.along.at(view))


AnyLine = Line | FixedLine


def drawn(
    view: View, node: str, slot: int, foot: ComplexArray, along: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """Return a line with the errors of drawing it: its foot shifted sideways, its direction turned."""
    tilted = along * geometry.direction(view.error(node, slot, "angle"))
    return np.asarray(foot + 1j * along * view.error(node, slot, "shift")), np.asarray(tilted)
