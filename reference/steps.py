"""The steps of a construction: directions, lengths, and what makes one node from earlier nodes.

Everything is in drawn millimetres, complex, y up, and an array over variants.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Protocol

import numpy as np

from reference import geometry, groups
from reference.geometry import ComplexArray, FloatArray
from reference.mechanism import Side

Parameters = Mapping[str, FloatArray]
"""Real lengths (m) by the pair of joints (``"O1A"``), crank data and the scales kL, kv, ka; see
`reference.derivation.parameters_of`."""
Nodes = Mapping[str, ComplexArray]
Errors = Mapping[tuple[str, int, str], FloatArray]
"""What the hand does wrong, by (node, which of the step's lines or lengths, kind); kinds are
``angle`` (radians, of a line), ``shift`` (mm, of a line, to its left), ``length`` (mm, of a
length transferred), ``x`` and ``y`` (mm, of the node's mark itself)."""

NO_ERROR: FloatArray = np.asarray(0.0)


@dataclass(frozen=True, slots=True)
class View:
    """What a step sees: the nodes so far, the parameters, and the hand's errors."""

    nodes: Nodes
    parameters: Parameters
    errors: Errors = field(default_factory=dict)

    def error(self, node: str, slot: int, kind: str) -> FloatArray:
        """One error of the hand, zero where there is none."""
        return self.errors.get((node, slot, kind), NO_ERROR)

    def real_length(self, tail: str, head: str) -> FloatArray:
        """The real length (m) between two joints, measured on the sketch."""
        return np.asarray(np.abs(self.nodes[head] - self.nodes[tail]) * self.parameters["kL"])


# Directions ---------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Along:
    """The direction of a link as drawn, from joint `tail` to joint `head`, turned by quarters ccw."""

    tail: str
    head: str
    quarters: int = 0

    @property
    def needs(self) -> tuple[str, ...]:
        """Nodes it is read from."""
        return (self.tail, self.head)

    def at(self, view: View) -> ComplexArray:
        """The unit vector."""
        link = geometry.unit(view.nodes[self.head] - view.nodes[self.tail])
        return np.asarray(link * 1j**self.quarters)

    @property
    def perpendicular(self) -> "Along":
        """A quarter turn further."""
        return replace(self, quarters=self.quarters + 1)


@dataclass(frozen=True, slots=True)
class Fixed:
    """A direction given by an angle in radians among the parameters (crank, guide).

    The parameter ``turn`` (radians, 0 when absent) turns all fixed directions alike: a sketch that
    is turned on its sheet is legitimate.
    """

    angle: str
    quarters: int = 0

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return ()

    def at(self, view: View) -> ComplexArray:
        """The unit vector."""
        turn = view.parameters.get("turn", NO_ERROR)
        return np.asarray(geometry.direction(view.parameters[self.angle] + turn) * 1j**self.quarters)

    @property
    def perpendicular(self) -> "Fixed":
        """A quarter turn further."""
        return replace(self, quarters=self.quarters + 1)


Direction = Along | Fixed

# Lengths ------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Scaled:
    """A real quantity among the parameters, drawn at a scale."""

    quantity: str
    scale: str

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return ()

    def at(self, view: View) -> FloatArray:
        """Drawn millimetres."""
        return np.asarray(view.parameters[self.quantity] / view.parameters[self.scale])


@dataclass(frozen=True, slots=True)
class Normal:
    """A normal component v^2 / l, from a velocity as drawn and a real length, at the scale ka.

    `measured` are the sketch's joints between which the length is taken where the mechanism's data do
    not give it: the distance of a slotted link's point from its pivot.
    """

    tail: str
    head: str
    length: str
    measured: tuple[str, str] | None = None

    @property
    def needs(self) -> tuple[str, ...]:
        """The ends of the velocity, and those of a measured length."""
        return (self.tail, self.head, *(self.measured or ()))

    def at(self, view: View) -> FloatArray:
        """Drawn millimetres."""
        known = view.parameters
        speed = np.abs(view.nodes[self.head] - view.nodes[self.tail]) * known["kv"]
        length = known[self.length] if self.measured is None else view.real_length(*self.measured)
        return np.asarray(speed**2 / (length * known["ka"]))


@dataclass(frozen=True, slots=True)
class Coriolis:
    """A Coriolis component 2 omega v, from two velocities as drawn, at the scale ka.

    Attributes
    ----------
    slide : the sliding velocity's ends in the velocity plan
    guide : the guide's direction, along which it slides
    turn : ends of the velocity that turns the guide's link about one of its joints
    link : those joints, in the same order, in the sketch
    quarters : how the velocity plan is turned as a whole, by quarters counter-clockwise

    The length is positive to the left of `guide`: 2 omega v of the components along guide and across
    the link, with their signs.
    """

    slide: tuple[str, str]
    guide: "Direction"
    turn: tuple[str, str]
    link: tuple[str, str]
    quarters: int = 0

    @property
    def needs(self) -> tuple[str, ...]:
        """Both velocities' ends, the guide's and the link's joints."""
        return (*self.slide, *self.guide.needs, *self.turn, *self.link)

    def at(self, view: View) -> FloatArray:
        """Drawn millimetres."""
        known, nodes = view.parameters, view.nodes
        back = 1j**-self.quarters
        sliding, turning = ((nodes[head] - nodes[tail]) * back for tail, head in (self.slide, self.turn))
        arm = geometry.unit(nodes[self.link[1]] - nodes[self.link[0]])
        omega = geometry.cross(arm, turning) * known["kv"] / view.real_length(*self.link)
        speed = geometry.dot(self.guide.at(view), sliding) * known["kv"]
        return np.asarray(2.0 * omega * speed / known["ka"])


@dataclass(frozen=True, slots=True)
class Component:
    """The drawn length of a vector between two nodes along a direction, with its sign."""

    tail: str
    head: str
    along: "Direction"

    @property
    def needs(self) -> tuple[str, ...]:
        """The vector's ends, and what the direction is read from."""
        return (self.tail, self.head, *self.along.needs)

    def at(self, view: View) -> FloatArray:
        """Drawn millimetres."""
        return geometry.dot(view.nodes[self.head] - view.nodes[self.tail], self.along.at(view))


Length = Scaled | Normal | Coriolis | Component


@dataclass(frozen=True, slots=True)
class Line:
    """The line through a node along a direction."""

    through: str
    along: Direction

    @property
    def needs(self) -> tuple[str, ...]:
        """Its foot, and what its direction is read from."""
        return (self.through, *self.along.needs)

    def at(self, view: View, node: str, slot: int) -> tuple[ComplexArray, ComplexArray]:
        """A point of the line and its unit vector, with the hand's error in drawing it."""
        return drawn(view, node, slot, view.nodes[self.through], self.along.at(view))


@dataclass(frozen=True, slots=True)
class FixedLine:
    """A guide on the ground, by its name: its point and direction are parameters."""

    guide: str

    @property
    def along(self) -> Fixed:
        """Its direction."""
        return Fixed(f"angle {self.guide}")

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return ()

    def at(self, view: View, node: str, slot: int) -> tuple[ComplexArray, ComplexArray]:
        """A point of the line and its unit vector, with the hand's error in drawing it."""
        return drawn(view, node, slot, fixed_point(view, self.guide), self.along.at(view))


AnyLine = Line | FixedLine


def drawn(
    view: View, node: str, slot: int, foot: ComplexArray, along: ComplexArray
) -> tuple[ComplexArray, ComplexArray]:
    """A line as the hand draws it: its foot shifted sideways, its direction turned a little."""
    tilted = along * geometry.direction(view.error(node, slot, "angle"))
    return np.asarray(foot + 1j * along * view.error(node, slot, "shift")), np.asarray(tilted)


# Steps --------------------------------------------------------------------------------------------


class Step(Protocol):
    """Makes one node of one figure."""

    @property
    def node(self) -> str:
        """The node made."""

    @property
    def needs(self) -> tuple[str, ...]:
        """The nodes it is made from."""

    def place(self, view: View) -> ComplexArray:
        """Where the node lies, millimetres."""


@dataclass(frozen=True, slots=True)
class Pole:
    """The pole of a plan, its origin."""

    node: str

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return ()

    def place(self, view: View) -> ComplexArray:
        """Zero."""
        del view
        return np.asarray(0j)


@dataclass(frozen=True, slots=True)
class Pivot:
    """A fixed point of the mechanism, by its real coordinates among the parameters (``x O2``, ``y O2``)."""

    node: str

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return ()

    def place(self, view: View) -> ComplexArray:
        """Real place at the scale kL, turned with the sketch."""
        return fixed_point(view, self.node)


def fixed_point(view: View, name: str) -> ComplexArray:
    """A fixed point of the mechanism (pivot, or a guide's point) at the scale kL."""
    known = view.parameters
    real = known[f"x {name}"] + 1j * known[f"y {name}"]
    return np.asarray(real / known["kL"] * geometry.direction(known.get("turn", NO_ERROR)))


@dataclass(frozen=True, slots=True)
class Given:
    """A known vector laid off from a node: a length along a direction (a negative one backwards).

    `factor` multiplies the length: 1 for a right one, -1 for a wrong sense, 0 for one left out.
    """

    node: str
    start: str
    length: Length
    along: Direction
    factor: float = 1.0

    @property
    def needs(self) -> tuple[str, ...]:
        """Its start, and what its length and direction are read from."""
        return (self.start, *self.length.needs, *self.along.needs)

    def place(self, view: View) -> ComplexArray:
        """The vector's end."""
        foot, along = drawn(view, self.node, 0, view.nodes[self.start], self.along.at(view))
        length = self.factor * self.length.at(view) + view.error(self.node, 0, "length")
        return np.asarray(foot + along * length)


@dataclass(frozen=True, slots=True)
class OnGuide:
    """The driven slider: a length along a fixed guide from its point (a negative one backwards)."""

    node: str
    guide: FixedLine
    length: Length

    @property
    def needs(self) -> tuple[str, ...]:
        """No nodes."""
        return self.length.needs

    def place(self, view: View) -> ComplexArray:
        """The slider's place."""
        foot, along = self.guide.at(view, self.node, 0)
        return np.asarray(foot + along * (self.length.at(view) + view.error(self.node, 0, "length")))


@dataclass(frozen=True, slots=True)
class TwoLines:
    """Where two lines meet."""

    node: str
    first: AnyLine
    second: AnyLine

    @property
    def needs(self) -> tuple[str, ...]:
        """The nodes both lines start from, and those their directions are read from."""
        return (*self.first.needs, *self.second.needs)

    def place(self, view: View) -> ComplexArray:
        """The meeting point."""
        p, u = self.first.at(view, self.node, 0)
        q, v = self.second.at(view, self.node, 1)
        return geometry.meet(p, u, q, v)


@dataclass(frozen=True, slots=True)
class TwoArcs:
    """Where two compass arcs meet, on one side of the line between their centres."""

    node: str
    centres: tuple[str, str]
    radii: tuple[Length, Length]
    side: Side

    @property
    def needs(self) -> tuple[str, ...]:
        """The centres."""
        return (*self.centres, *self.radii[0].needs, *self.radii[1].needs)

    def place(self, view: View) -> ComplexArray:
        """The meeting point."""
        p, q = (view.nodes[centre] for centre in self.centres)
        r, s = (
            radius.at(view) + view.error(self.node, slot, "length") for slot, radius in enumerate(self.radii)
        )
        return geometry.two_arcs(p, r, q, s, self.side)


@dataclass(frozen=True, slots=True)
class ArcAndLine:
    """Where a compass arc meets a guide, ahead of (side +1) or behind its centre along the guide."""

    node: str
    centre: str
    radius: Length
    guide: AnyLine
    side: Side

    @property
    def needs(self) -> tuple[str, ...]:
        """The arc's centre, and what the guide is drawn from."""
        return (self.centre, *self.radius.needs, *self.guide.needs)

    def place(self, view: View) -> ComplexArray:
        """The meeting point."""
        foot, along = self.guide.at(view, self.node, 1)
        radius = self.radius.at(view) + view.error(self.node, 0, "length")
        return geometry.arc_and_line(view.nodes[self.centre], radius, foot, along, self.side)


@dataclass(frozen=True, slots=True)
class Coincide:
    """A point that lies where another does at this instant: on the link under a slider."""

    node: str
    other: str

    @property
    def needs(self) -> tuple[str, ...]:
        """The other point."""
        return (self.other,)

    def place(self, view: View) -> ComplexArray:
        """The same place."""
        return view.nodes[self.other]


@dataclass(frozen=True, slots=True)
class Tangent:
    """Where a line from a point touches a circle.

    From the centre the touching point lies a quarter turn to the left (for a positive radius) of the
    line's direction; `side` is +1 where that runs from the touching point to `start`, -1 the other way.
    """

    node: str
    centre: str
    radius: Length
    start: str
    side: Side

    @property
    def needs(self) -> tuple[str, ...]:
        """Centre and start."""
        return (self.centre, self.start, *self.radius.needs)

    def place(self, view: View) -> ComplexArray:
        """The touching point."""
        centre = view.nodes[self.centre]
        radius = self.radius.at(view) + view.error(self.node, 0, "length")
        _, along, _ = groups.rpr_place(view.nodes[self.start] - centre, radius, self.side)
        return np.asarray(centre + 1j * along * radius)


@dataclass(frozen=True, slots=True)
class Local:
    """A point by its coordinates in a link's own axes, x along a direction, y to its left."""

    node: str
    origin: str
    axis: Direction
    x: Length
    y: Length

    @property
    def needs(self) -> tuple[str, ...]:
        """The origin, and what the axis is read from."""
        return (self.origin, *self.axis.needs, *self.x.needs, *self.y.needs)

    def place(self, view: View) -> ComplexArray:
        """Origin + (x + i y) along the axis."""
        foot, along = drawn(view, self.node, 0, view.nodes[self.origin], self.axis.at(view))
        x = self.x.at(view) + view.error(self.node, 0, "length")
        return np.asarray(foot + along * (x + 1j * self.y.at(view)))


@dataclass(frozen=True, slots=True)
class Divide:
    """A point on the line through two nodes, dividing it in a ratio among the parameters."""

    node: str
    base: tuple[str, str]
    ratio: str

    @property
    def needs(self) -> tuple[str, ...]:
        """The base."""
        return self.base

    def place(self, view: View) -> ComplexArray:
        """base[0] + ratio (base[1] - base[0])."""
        p, q = (view.nodes[end] for end in self.base)
        along = geometry.unit(q - p)
        slip = np.where(np.isfinite(along), along, 0.0) * view.error(self.node, 0, "length")
        return np.asarray(p + (q - p) * view.parameters[self.ratio] + slip)


@dataclass(frozen=True, slots=True)
class Similar:
    """The image of a link's third point: the triangle of the plan similar to that of the mechanism.

    `mirrored` for the mistake of a triangle similar but traversed the other way round.
    """

    node: str
    base: tuple[str, str]
    model: tuple[str, str, str]
    mirrored: bool = False

    @property
    def needs(self) -> tuple[str, ...]:
        """The base in the plan and the model in the mechanism."""
        return (*self.base, *self.model)

    def place(self, view: View) -> ComplexArray:
        """The third corner."""
        p, q = (view.nodes[end] for end in self.base)
        corners = [view.nodes[corner] for corner in self.model]
        if self.mirrored:
            corners = [np.conj(corner) for corner in corners]
        return geometry.similar(p, q, *corners)
