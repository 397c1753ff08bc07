"""The steps of a construction, as a student draws them: each makes one node from earlier nodes.

Everything is in drawn millimetres, complex, y up, and an array over variants.
"""

from dataclasses import dataclass
from typing import Protocol

import numpy as np

from reference import geometry
from reference.construction.elements import (
    AnyLine,
    Direction,
    FixedLine,
    FromNodes,
    Length,
    Side,
    View,
    drawn,
    fixed_point,
    side_at,
)
from reference.geometry import ComplexArray
from reference.kinematics import assur


class Step(Protocol):
    """A step that makes one node of one figure."""

    @property
    def node(self) -> str:
        """The node that the step makes."""

    @property
    def needs(self) -> tuple[str, ...]:
        """Names of the nodes that it is made from."""

    def place(self, view: View) -> ComplexArray:
        """Return the position of the node, complex millimetres."""


@dataclass(frozen=True, slots=True)
class Pole(FromNodes):
    """The pole of a plan, its origin."""

    node: str

    def place(self, view: View) -> ComplexArray:
        """Return zero."""
        del view
        return np.asarray(0j)


@dataclass(frozen=True, slots=True)
class Pivot(FromNodes):
    """A fixed point of the mechanism, by its real coordinates among the parameters (``x O2``, ``y O2``)."""

    node: str

    def place(self, view: View) -> ComplexArray:
        """Return the real position at the scale kL, turned with the sketch."""
        return fixed_point(view, self.node)


@dataclass(frozen=True, slots=True)
class Given(FromNodes):
    """A known vector drawn from a node: a length along a direction (a negative one backwards).

    `factor` multiplies the length: 1 if right, -1 for a wrong sense, 0 if left out.
    """

    reads = ("start", "length", "along")
    node: str
    start: str
    length: Length
    along: Direction
    factor: float = 1.0

    def place(self, view: View) -> ComplexArray:
        """Return the vector's end."""
        foot, along = drawn(view, self.node, 0, view.nodes[self.start], self.along.at(view))
        length = self.factor * self.length.at(view) + view.error(self.node, 0, "length")
        return np.asarray(foot + along * length)


@dataclass(frozen=True, slots=True)
class OnGuide(FromNodes):
    """The driving slider: a length along a fixed guide from its point (a negative one backwards)."""

    reads = ("length",)
    node: str
    guide: FixedLine
    length: Length

    def place(self, view: View) -> ComplexArray:
        """Return the slider's position."""
        foot, along = self.guide.at(view, self.node, 0)
        return np.asarray(foot + along * (self.length.at(view) + view.error(self.node, 0, "length")))


@dataclass(frozen=True, slots=True)
class TwoLines(FromNodes):
    """The intersection of two lines."""

    reads = ("first", "second")
    node: str
    first: AnyLine
    second: AnyLine

    def place(self, view: View) -> ComplexArray:
        """Return the intersection."""
        p, u = self.first.at(view, self.node, 0)
        q, v = self.second.at(view, self.node, 1)
        return geometry.meet(p, u, q, v)


@dataclass(frozen=True, slots=True)
class TwoArcs(FromNodes):
    """The intersection of two compass arcs, on one side of the line between their centres."""

    reads = ("centres", "radii")
    node: str
    centres: tuple[str, str]
    radii: tuple[Length, Length]
    side: Side

    def place(self, view: View) -> ComplexArray:
        """Return the intersection."""
        p, q = (view.nodes[centre] for centre in self.centres)
        r, s = (
            radius.at(view) + view.error(self.node, slot, "length") for slot, radius in enumerate(self.radii)
        )
        return geometry.two_arcs(p, r, q, s, side_at(self.side, view))


@dataclass(frozen=True, slots=True)
class ArcAndLine(FromNodes):
    """The intersection of a compass arc and a guide, ahead of (side +1) or behind the arc's centre."""

    reads = ("centre", "radius", "guide")
    node: str
    centre: str
    radius: Length
    guide: AnyLine
    side: Side

    def place(self, view: View) -> ComplexArray:
        """Return the intersection."""
        foot, along = self.guide.at(view, self.node, 1)
        radius = self.radius.at(view) + view.error(self.node, 0, "length")
        return geometry.arc_and_line(view.nodes[self.centre], radius, foot, along, side_at(self.side, view))


@dataclass(frozen=True, slots=True)
class Coincide(FromNodes):
    """A point that coincides with another at this instant: on the link under a slider."""

    reads = ("other",)
    node: str
    other: str

    def place(self, view: View) -> ComplexArray:
        """Return the position of the other point."""
        return view.nodes[self.other]


@dataclass(frozen=True, slots=True)
class Tangent(FromNodes):
    """The point where a line from a given point touches a circle.

    From the centre the touching point lies a quarter turn to the left (for a positive radius) of the
    line's direction; `side` is +1 where that runs from the touching point to `start`, -1 the other way.
    """

    reads = ("centre", "start", "radius")
    node: str
    centre: str
    radius: Length
    start: str
    side: Side

    def place(self, view: View) -> ComplexArray:
        """Return the point of contact."""
        centre = view.nodes[self.centre]
        radius = self.radius.at(view) + view.error(self.node, 0, "length")
        _, along, _ = assur.rpr_place(view.nodes[self.start] - centre, radius, side_at(self.side, view))
        return np.asarray(centre + 1j * along * radius)


@dataclass(frozen=True, slots=True)
class Local(FromNodes):
    """A point by its coordinates in a link's own axes, x along a direction, y to its left."""

    reads = ("origin", "axis", "x", "y")
    node: str
    origin: str
    axis: Direction
    x: Length
    y: Length

    def place(self, view: View) -> ComplexArray:
        """Return origin + (x + i y) along the axis."""
        foot, along = drawn(view, self.node, 0, view.nodes[self.origin], self.axis.at(view))
        x = self.x.at(view) + view.error(self.node, 0, "length")
        return np.asarray(foot + along * (x + 1j * self.y.at(view)))


@dataclass(frozen=True, slots=True)
class Divide(FromNodes):
    """A point on the line through two nodes, dividing it in a ratio among the parameters."""

    reads = ("base",)
    node: str
    base: tuple[str, str]
    ratio: str

    def place(self, view: View) -> ComplexArray:
        """Return base[0] + ratio (base[1] - base[0])."""
        p, q = (view.nodes[end] for end in self.base)
        along = geometry.unit(q - p)
        slip = np.where(np.isfinite(along), along, 0.0) * view.error(self.node, 0, "length")
        return np.asarray(p + (q - p) * view.parameters[self.ratio] + slip)


@dataclass(frozen=True, slots=True)
class Similar(FromNodes):
    """The image of a link's third point: the triangle of the plan similar to that of the mechanism.

    `mirrored` is for the mistake of a similar triangle traversed the other way round.
    """

    reads = ("base", "model")
    node: str
    base: tuple[str, str]
    model: tuple[str, str, str]
    mirrored: bool = False

    def place(self, view: View) -> ComplexArray:
        """Return the third corner."""
        p, q = (view.nodes[end] for end in self.base)
        corners = [view.nodes[corner] for corner in self.model]
        if self.mirrored:
            corners = [np.conj(corner) for corner in corners]
        return geometry.similar(p, q, *corners)
