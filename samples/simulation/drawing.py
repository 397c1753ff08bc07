"""A construction drawn step by step with instruments: each step starts from what is on the paper.

The construction is data (`reference.construction.graph`): each node and the step that gives it. This module
carries out the steps as a person does. Lengths that must be computed (normal and Coriolis components, sides
of similar triangles) come from ruler readings of the lines drawn so far.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from reference.construction.elements import (
    Along,
    AnyLine,
    Balance,
    Component,
    Coriolis,
    Couple,
    Direction,
    FixedLine,
    Force,
    Inertia,
    Length,
    Normal,
    Parallel,
    Parameters,
    Same,
    Scaled,
    Side,
    VariantSide,
)
from reference.construction.graph import Construction
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Pivot,
    Pole,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from samples.simulation.instruments import Instruments
from samples.simulation.settings import HandStyle
from samples.simulation.strokes import Rng

TRIES = 20
"""Times a drawing is begun again that does not close."""
NEARLY_FLAT = 0.05
"""Height over base below which a triangle is copied as a divided line, with the height measured."""


def drawn_nodes(
    construction: Construction,
    parameters: Parameters,
    hand: HandStyle,
    rng: Rng,
    given: Mapping[str, complex] | None = None,
) -> dict[str, complex]:
    """Every node as one person draws it, complex millimetres about each figure's own origin, y up.

    Arguments
    ---------
    parameters : scalars, as `reference.construction.graph` names them
    given : nodes that are on the paper already

    Raises ValueError if the drawing does not close in many tries.
    """
    numbers = {name: float(value) for name, value in parameters.items()}
    for _ in range(TRIES):
        paper = _Paper(numbers, Instruments(hand, rng), dict(given or {}))
        try:
            for step in construction.steps:
                if step.node not in paper.nodes:
                    paper.nodes[step.node] = paper.draw(step)
        except (ValueError, ZeroDivisionError):  # arcs that do not meet, a link of no length
            continue
        return paper.nodes
    raise ValueError("the drawing does not close with this hand")


@dataclass(slots=True)
class _Paper:
    """The drawing so far, with the person's data and instruments."""

    known: Mapping[str, float]
    tools: Instruments
    nodes: dict[str, complex]
    guides: dict[str, tuple[complex, complex]] = field(default_factory=dict)

    def draw(self, step: Step) -> complex:
        """Draw one node. Raises ValueError where a step has no solution."""
        tools, nodes = self.tools, self.nodes
        match step:
            case Pole():
                return 0j
            case Pivot(node=node):
                return self._fixed_point(node)
            case Coincide(other=other):
                return nodes[other]
            case Given(start=start, length=length, along=along, factor=factor):
                size = tools.length(factor * self._computed(length))
                return self._laid_off(nodes[start], self._direction(along), size)
            case OnGuide(guide=guide, length=length):
                foot, direction = self._line(guide)
                return self._laid_off(foot, direction, tools.length(self._computed(length)))
            case TwoLines(first=first, second=second):
                return tools.crossing(*self._line(first), *self._line(second))
            case TwoArcs(centres=(p, q), radii=(r, s), side=side):
                radii = (self._computed(r), self._computed(s))
                return tools.arcs((nodes[p], nodes[q]), radii, self._side(side))
            case ArcAndLine(centre=centre, radius=radius, guide=guide, side=side):
                size = self._computed(radius)
                return tools.arc_on_line(nodes[centre], size, self._line(guide), self._side(side))
            case Tangent():
                return self._tangent(step)
            case Local(origin=origin, axis=axis, x=x, y=y):
                local = complex(tools.length(self._computed(x)), tools.length(self._computed(y)))
                return tools.dot(nodes[origin] + self._direction(axis) * local)
            case Divide(base=base, ratio=ratio):
                return self._divided(base, self.known[ratio], 0.0)
            case Similar():
                return self._similar(step)
        raise TypeError(f"no way to draw a {type(step).__name__}")

    # Points and lines ---------------------------------------------------------------------------------

    def _turned(self) -> complex:
        turn = self.known.get("turn", 0.0)
        return complex(math.cos(turn), math.sin(turn))

    def _fixed_point(self, name: str) -> complex:
        """A point by its two coordinates on the sketch's own axes."""
        x, y = (self.tools.length(self.known[f"{axis} {name}"] / self.known["kL"]) for axis in "xy")
        return self.tools.dot(complex(x, y) * self._turned()) if x or y else 0j

    def _laid_off(self, foot: complex, along: complex, length_mm: float) -> complex:
        """The end of a length laid off along a line; for length zero, the same point."""
        return self.tools.dot(self.tools.beside(foot, along) + along * length_mm) if length_mm else foot

    def _direction(self, along: Direction) -> complex:
        """A direction as drawn, with its error."""
        if isinstance(along, Along):
            link = self.nodes[along.head] - self.nodes[along.tail]
            return self.tools.carried(link * self._side(along.side), along.quarters)
        if isinstance(along, Parallel):
            vector = self.nodes[along.head] - self.nodes[along.tail]
            return self.tools.carried(vector, along.quarters) if vector else 1.0 + 0j
        return self.tools.protracted(self.known[along.angle]) * self._turned() * 1j**along.quarters

    def _line(self, line: AnyLine) -> tuple[complex, complex]:
        """A point of a line and its direction; a guide on the ground is drawn once."""
        if isinstance(line, FixedLine):
            if line.guide not in self.guides:
                along = self._direction(line.along)
                self.guides[line.guide] = (self._fixed_point(line.guide), along)
            return self.guides[line.guide]
        along = self._direction(line.along)
        return self.tools.beside(self.nodes[line.through], along), along

    def _side(self, side: Side) -> float:
        return side.sign * self.known[side.parameter] if isinstance(side, VariantSide) else float(side)

    def _tangent(self, step: Tangent) -> complex:
        """The point of tangency of a line from a point to a circle."""
        radius = self.tools.length(self._computed(step.radius))
        reach = self.tools.dot(self.nodes[step.start]) - self.nodes[step.centre]
        beyond = math.sqrt(abs(reach) ** 2 - radius**2)
        along = reach / complex(self._side(step.side) * beyond, radius)
        return self.tools.dot(self.nodes[step.centre] + 1j * radius * along / abs(along))

    # Triangles ----------------------------------------------------------------------------------------

    def _divided(self, base: tuple[str, str], share: float, height_share: float) -> complex:
        """A point by its distances along a measured base and beside it, as shares of the base."""
        p, q = (self.nodes[end] for end in base)
        if p == q:
            return p
        size, along = self.tools.length(abs(q - p)), (q - p) / abs(q - p)
        at = self._laid_off(p, along, self.tools.length(share * size))
        return at + 1j * along * self.tools.length(height_share * size)

    def _similar(self, step: Similar) -> complex:
        """The third corner of a triangle like one of the sketch: its sides by proportion, two arcs."""
        p, q = (self.nodes[end] for end in step.base)
        first, second, third = (self.nodes[corner] for corner in step.model)
        shape = (third - first) / (second - first)
        if step.mirrored:
            shape = shape.conjugate()
        if abs(shape.imag) < NEARLY_FLAT or p == q:
            return self._divided(step.base, shape.real, shape.imag)
        sketched = self.tools.length(abs(second - first))
        sides = (self.tools.length(abs(third - first)), self.tools.length(abs(third - second)))
        ratio = self.tools.length(abs(q - p)) / sketched
        return self.tools.arcs((p, q), (sides[0] * ratio, sides[1] * ratio), shape.imag)

    # Lengths ------------------------------------------------------------------------------------------

    def _measured(self, tail: str, head: str) -> float:
        """The distance of two nodes as read off the ruler."""
        return self.tools.length(abs(self.nodes[head] - self.nodes[tail]))

    def _computed(self, length: Length) -> float:
        """A length to be drawn, from data or from what was measured; with its sign."""
        known = self.known
        match length:
            case Scaled(quantity=quantity, scale=scale):
                return known[quantity] / known[scale]
            case Normal(tail=tail, head=head, length=name, measured=joints):
                speed = self._measured(tail, head) * known["kv"]
                arm = known[name] if joints is None else self._measured(*joints) * known["kL"]
                return speed**2 / arm / known["ka"]
            case Component(tail=tail, head=head, along=along):
                vector = self.nodes[head] - self.nodes[tail]
                shadow = vector * self._direction(along).conjugate()
                return self.tools.length(shadow.real)
            case Coriolis():
                return self._coriolis(length)
            case Same(sense=sense, tail=tail, head=head):
                return self._measured(tail, head) * known.get(sense, 1.0)
            case Inertia(mass=mass, tail=tail, head=head):
                return known[mass] * self._measured(tail, head) * known["ka"] / known["kF"]
            case Balance():
                return self._balancing(length)

    def _balancing(self, balance: Balance) -> float:
        """A force by its arm: moments of forces, arms by the ruler on the sketch, and couples."""
        given, per_mm2 = balance.moments, self.known["kL"] * self.known["kF"]
        about = self.nodes[given.about]
        moments = [self._moment(force, about) for force in given.forces]
        moments += [self._couple(couple) / per_mm2 for couple in given.couples]
        lever = self._arm(self.nodes[balance.point] - about, self._direction(balance.along))
        return -sum(moments) / lever

    def _moment(self, force: Force, about: complex) -> float:
        """The moment of a force, mm of the sketch times mm of the force."""
        arm, along = self.nodes[force.point] - about, self._direction(force.along)
        size, lever = self._computed(force.size), self._arm(arm, along)
        whole = self.tools.length(abs(arm)) if force.whole_arm else abs(lever)
        return size * math.copysign(whole, lever)

    def _arm(self, arm: complex, along: complex) -> float:
        """The measured distance of a line of action, positive where the force turns counter-clockwise."""
        return self.tools.length((arm.conjugate() * along).imag)

    def _couple(self, couple: Couple) -> float:
        """A couple, N m: a datum, or -I epsilon with epsilon by the measured tangential acceleration."""
        if not couple.inertia:
            return self.known[couple.name]
        (tail, head), (first, second) = couple.vector, couple.link
        arm, pull = self.nodes[second] - self.nodes[first], self.nodes[head] - self.nodes[tail]
        across = self._arm(arm / abs(arm), pull) * self.known["ka"]
        return -self.known[couple.inertia] * across / (self._measured(first, second) * self.known["kL"])

    def _coriolis(self, length: Coriolis) -> float:
        """2 omega v_r: its magnitude by the ruler, its sign by the senses of rotation and sliding."""
        known, nodes = self.known, self.nodes
        back = 1j**-length.quarters
        slide, turn = ((nodes[head] - nodes[tail]) * back for tail, head in (length.slide, length.turn))
        arm = nodes[length.link[1]] - nodes[length.link[0]]
        guide = self._direction(length.guide)
        sliding = self.tools.length((slide * guide.conjugate()).real) * known["kv"]
        across = self.tools.length((turn * arm.conjugate()).imag / abs(arm)) * known["kv"]
        return 2.0 * across / (self._measured(*length.link) * known["kL"]) * sliding / known["ka"]
