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


@dataclass(frozen=True, slots=True)
class Parallel(FromNodes):
    """The direction of a vector of a plan as drawn, turned by quarters ccw; of a zero vector that of +x."""

    reads = ("tail", "head")
    tail: str
    head: str
    quarters: int = 0

    def at(self, view: View) -> ComplexArray:
        """Return the unit vector."""
        vector = view.nodes[self.head] - view.nodes[self.tail]
        return np.where(vector == 0.0, 1.0, geometry.unit(vector)) * 1j**self.quarters


Direction = Along | Fixed | Parallel

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


# Forces -------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Same(FromNodes):
    """The length of a vector that is drawn already, at the same scale.

    `sense` is a parameter, -1 for the mistake of the wrong sense, else absent.
    """

    reads = ("tail", "head")
    sense: str
    tail: str
    head: str

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        size = np.abs(view.nodes[self.head] - view.nodes[self.tail])
        return np.asarray(size * view.parameters.get(self.sense, 1.0))


@dataclass(frozen=True, slots=True)
class Inertia(FromNodes):
    """An inertia force m a, from an acceleration as drawn, at the scale kF."""

    reads = ("tail", "head")
    mass: str
    tail: str
    head: str

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        known = view.parameters
        size = np.abs(view.nodes[self.head] - view.nodes[self.tail])
        return np.asarray(known[self.mass] * size * known["ka"] / known["kF"])


@dataclass(frozen=True, slots=True)
class Force(FromNodes):
    """A force on a link: its drawn length, its direction, and the joint at which it acts.

    `whole_arm` is for the mistake of taking the distance of that joint for the arm of the moment.
    """

    reads = ("size", "along", "point")
    name: str
    size: "Length"
    along: Direction
    point: str
    whole_arm: bool = False

    def moment(self, view: View, about: str) -> FloatArray:
        """Return its moment about a joint, in square millimetres of the drawing: of kL times kF."""
        arm = view.nodes[self.point] - view.nodes[about]
        force = self.along.at(view) * self.size.at(view)
        moment = geometry.cross(arm, force)
        return np.copysign(np.abs(arm) * np.abs(force), moment) if self.whole_arm else moment


@dataclass(frozen=True, slots=True)
class Couple(FromNodes):
    """A couple on a link, N m: a datum; or -I epsilon, epsilon from the tangential acceleration as drawn.

    Attributes
    ----------
    inertia : the moment of inertia's parameter; empty for a datum
    vector : ends of that acceleration in its plan
    link : the joints that it belongs to, in the sketch
    """

    reads = ("vector", "link")
    name: str
    inertia: str = ""
    vector: tuple[str, ...] = ()
    link: tuple[str, ...] = ()

    def at(self, view: View) -> FloatArray:
        """Return the couple, N m, counter-clockwise positive."""
        known, nodes = view.parameters, view.nodes
        if not self.inertia:
            return known[self.name]
        (tail, head), (first, second) = self.vector, self.link
        arm = geometry.unit(nodes[second] - nodes[first])
        epsilon = geometry.cross(arm, nodes[head] - nodes[tail]) * known["ka"]
        return np.asarray(-known[self.inertia] * epsilon / view.real_length(first, second))


@dataclass(frozen=True, slots=True)
class Moments(FromNodes):
    """The moments of forces and couples about a joint."""

    reads = ("about", "forces", "couples")
    about: str
    forces: tuple[Force, ...]
    couples: tuple[Couple, ...] = ()

    def at(self, view: View) -> FloatArray:
        """Return the moment that balances them, N m, counter-clockwise positive."""
        known = view.parameters
        drawn = sum((force.moment(view, self.about) for force in self.forces), np.asarray(0.0))
        couples = sum((couple.at(view) for couple in self.couples), np.asarray(0.0))
        return np.asarray(-drawn * known["kL"] * known["kF"] - couples)


@dataclass(frozen=True, slots=True)
class Balance(FromNodes):
    """A force at a joint, along a direction, that balances moments about another joint."""

    reads = ("point", "along", "moments")
    point: str
    along: Direction
    moments: Moments

    def at(self, view: View) -> FloatArray:
        """Return the length in drawn millimetres."""
        known, nodes = view.parameters, view.nodes
        lever = geometry.cross(nodes[self.point] - nodes[self.moments.about], self.along.at(view))
        return np.asarray(self.moments.at(view) / (lever * known["kL"] * known["kF"]))


Length = Scaled | Normal | Coriolis | Component | Same | Inertia | Balance


def is_force(length: Length) -> bool:
    """Return whether a length is that of a force that acts, whatever else does: not one from moments."""
    return isinstance(length, Inertia | Same) or (isinstance(length, Scaled) and length.scale == "kF")


def is_computed(length: Length) -> bool:
    """Return whether a length is computed by the student, so that it may have a slip."""
    return isinstance(length, Normal | Coriolis | Inertia | Balance) or (
        isinstance(length, Scaled) and length.scale == "kF"
    )


def data_in(length: "Length | Moments") -> frozenset[str]:
    """Return the names of the data of forces and couples on which a length or moment depends."""
    match length:
        case Scaled(quantity=name) | Inertia(mass=name) | Same(sense=name):
            return frozenset((name,))
        case Balance(moments=moments):
            return data_in(moments)
        case Moments(forces=forces, couples=couples):
            of_forces = (name for force in forces for name in data_in(force.size))
            return frozenset((*of_forces, *(one.inertia or one.name for one in couples)))
    return frozenset()


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
