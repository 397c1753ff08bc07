"""Derive the force plans of a mechanism: for each Assur group a closed polygon, from the last to the crank.

On each link stand its inertia force, its weight, the loads, and what later groups exert on it. The part of
a reaction across a link is computed from the moments about the group's inner joint, the given forces follow
head to tail, and two lines of known direction close the polygon. Nodes are ``B.0``, ``B.1``, ... in the plan
``force_plan_B``. R_12 is the reaction of link 1 on link 2, R_12_n and R_12_t are its parts along and across.

Source of the method: any course of kinetostatics, as Artobolevsky, Theory of Mechanisms, chapter 13.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

from reference.construction.elements import (
    Along,
    Balance,
    Couple,
    Direction,
    Fixed,
    Force,
    Inertia,
    Line,
    Moments,
    Parallel,
    Same,
    Scaled,
    VariantSide,
)
from reference.construction.graph import Construction, Part, Vector
from reference.construction.steps import Given, Pole, Step, TwoLines
from reference.mechanism import (
    GROUND,
    Crank,
    CrossSlider,
    Driver,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    Slider,
    SlottedLink,
    Yoke,
    carriers,
    named_links,
    short_names,
    slotted_links,
    turning,
)
from reference.quantities import FORCE_PLAN

Ends = tuple[str, str]
"""Two joints of a link, or two nodes of a plan."""
Accelerations = str
"""``given``: data of the task; ``own``: taken from the acceleration plan as drawn."""


def with_force_plans(mechanism: Mechanism, plans: Construction, accelerations: Accelerations) -> Construction:
    """Return the construction with the mechanism's force plans.

    Where the accelerations are ``given``, velocity and acceleration plan are left out.
    """
    forces = ForcePlans(mechanism, plans, accelerations)
    forces.write_down()
    figures = {name: tuple(polygon.steps) for name, polygon in forces.figures.items()}
    poles = {name: polygon.steps[0].node for name, polygon in forces.figures.items()}
    vectors = {name: one for polygon in forces.figures.values() for name, one in polygon.vectors.items()}
    acting: dict[str, tuple[Force | Couple, ...]] = {
        link: (*one.forces, *one.couples) for link, one in forces.loaded.items()
    }
    if accelerations == "given":
        sketch = {"mechanism": plans.figures["mechanism"]}
        plans = Construction(sketch, {}, {}, {}, pairs=plans.pairs, dots=plans.dots)
    return replace(
        plans,
        figures={**plans.figures, **figures},
        poles={**plans.poles, **poles},
        vectors={**plans.vectors, **vectors},
        moments=forces.moments,
        acting=acting,
    )


def reaction(names: Mapping[str, str], by: str, on: str) -> str:
    """Return the name of the reaction of one link on another: ``R_12``, ``R_0-rod``."""
    short = (names[by], names[on])
    return "R_" + ("" if max(map(len, short)) == 1 else "-").join(short)


@dataclass(slots=True)
class Loaded:
    """Forces and couples that act on a link, as far as they are known."""

    forces: list[Force] = field(default_factory=list)
    couples: list[Couple] = field(default_factory=list)

    def about(self, joint: str) -> Moments:
        """Return their moments about a joint."""
        return Moments(joint, tuple(self.forces), tuple(self.couples))


@dataclass(slots=True)
class Polygon:
    """A force plan while it is written down."""

    joint: str
    steps: list[Step] = field(default_factory=list)
    vectors: dict[str, Vector] = field(default_factory=dict)

    @property
    def next(self) -> str:
        """The name of the node that is made next."""
        return f"{self.joint}.{len(self.steps)}"

    def start(self) -> str:
        """Add the first node, the plan's pole."""
        pole = self.next
        self.steps.append(Pole(pole))
        return pole

    def lay(
        self, start: str, force: Force, *, back: bool = False, part: Part = "", link: Ends | None = None
    ) -> str:
        """Lay off a force from a node, or `back` so that it ends there; return the new node."""
        node = self.next
        along = replace(force.along, quarters=force.along.quarters + 2) if back else force.along
        self.steps.append(Given(node, start, force.size, along))
        return self.add(force.name, start, node, back=back, part=part, link=link)

    def lay_all(self, start: str, forces: Iterable[Force], *, back: bool = False) -> str:
        """Lay off forces one after another; return the last node."""
        for force in forces:
            start = self.lay(start, force, back=back)
        return start

    def close(self, first: Line, second: Line) -> str:
        """Close the polygon by two lines; return their intersection."""
        node = self.next
        self.steps.append(TwoLines(node, first, second))
        return node

    def add(
        self,
        name: str,
        tail: str,
        head: str,
        *,
        back: bool = False,
        part: Part = "",
        link: Ends | None = None,
    ) -> str:
        """Add a vector in the order of drawing; return its head."""
        whole = f"{name}_{part}" if part else name
        self.vectors[whole] = Vector(whole, tail, head, "kF", link, part, reversed=back)
        return head


@dataclass(slots=True)
class ForcePlans:
    """The force plans of a mechanism while they are written down."""

    mechanism: Mechanism
    plans: Construction
    accelerations: Accelerations
    loaded: dict[str, Loaded] = field(default_factory=dict)
    figures: dict[str, Polygon] = field(default_factory=dict)
    moments: dict[str, Moments] = field(default_factory=dict)
    links: dict[str, tuple[str, ...]] = field(init=False)
    carriers: dict[str, str] = field(init=False)
    names: dict[str, str] = field(init=False)
    turning: dict[str, tuple[str, str, str]] = field(init=False)
    cylinder: SlottedLink | None = field(init=False)
    """The group of the cylinder that drives the crank: its thrust, F_b, balances the crank."""

    def __post_init__(self) -> None:
        self.links, self.carriers = named_links(self.mechanism), carriers(self.mechanism)
        self.names, self.turning = short_names(self.mechanism), turning(self.mechanism)
        self.cylinder = slotted_links(self.mechanism).get(getattr(self.mechanism.driver, "cylinder", ""))

    def reaction(self, by: str, on: str) -> str:
        """Return the name of the reaction of one link on another."""
        return reaction(self.names, by, on)

    def on(self, link: str) -> Loaded:
        """Return what acts on a link."""
        return self.loaded.setdefault(link, Loaded())

    def write_down(self) -> None:
        """Add the plans of all groups, from the last, and of the driving link."""
        self._given_forces()
        for group in reversed(self.mechanism.groups):
            if group is not self.cylinder and any(
                self.on(link).forces or self.on(link).couples for link in self.links[group.node]
            ):
                self._group(group)
        self._driver(self.mechanism.driver)

    # What is given -------------------------------------------------------------------------------

    def _given_forces(self) -> None:
        for body in self.mechanism.bodies:
            name, here = self.names[body.link], self.on(body.link)
            if body.mass is not None and not self.mechanism.is_ground(body.centre):
                here.forces.append(self._inertia_force(f"F_i{name}", body.centre, f"m_{name}"))
            if body.mass is not None and self.mechanism.gravity is not None:
                here.forces.append(_as_given(f"G_{name}", body.centre))
            if body.inertia is not None:
                here.couples += self._inertia_couple(body.link)
        for load in self.mechanism.loads:
            if load.force is not None:
                self.on(load.link).forces.append(_as_given(f"F_{load.name}", load.point))
            if load.couple is not None:
                self.on(load.link).couples.append(Couple(f"M_{load.name}"))

    def _inertia_force(self, name: str, centre: str, mass: str) -> Force:
        if self.accelerations == "given":
            return _as_given(name, centre)
        vector = self.plans.vectors[f"a_{centre}"]
        ends = vector.tail, vector.head
        return Force(name, Inertia(mass, *ends), Parallel(*ends, quarters=2), centre)

    def _inertia_couple(self, link: str) -> list[Couple]:
        """Return the couple -I epsilon of a link that turns; of a slider, that of the link of its guide."""
        name = f"M_i{self.names[link]}"
        if link not in self.turning:
            return []
        turns_with, *_ = self.turning[link]
        rate = self.plans.rates.get(f"epsilon_{turns_with}")
        if rate is None and not self._is_driven(turns_with):
            return []
        if self.accelerations == "given" or rate is None or rate.drives:
            return [Couple(name)]
        vector = self.plans.vectors[rate.vector]
        return [Couple(name, f"I_{self.names[link]}", (vector.tail, vector.head), rate.link)]

    def _is_driven(self, link: str) -> bool:
        driver = self.mechanism.driver
        return isinstance(driver, Crank) and driver.link == link and driver.accelerated

    # Groups --------------------------------------------------------------------------------------

    def _polygon(self, joint: str) -> Polygon:
        polygon = Polygon(joint)
        self.figures[f"{FORCE_PLAN}{joint}"] = polygon
        return polygon

    def _group(self, group: Group) -> None:
        polygon = self._polygon(group.node)
        match group:
            case Dyad():
                self._two_links(polygon, group.pins, group.links, group.node)
            case Slider():
                self._slider(polygon, group)
            case SlottedLink():
                self._slotted(polygon, group)
            case CrossSlider(node=node, guides=(first, second)):
                self._two_guides(polygon, group, (_across(node, first), _across(node, second)))
            case Yoke(node=node, guide=guide):
                self._yoke(polygon, group, _across(node, guide))

    def _part_across(self, polygon: Polygon, start: str, link: str, ends: Ends) -> str:
        """Lay off the part across a link of the reaction at its outer pin, if forces act on the link.

        It balances the moments about the inner joint. Arguments: `ends`, the outer pin and that joint.
        """
        here, (pin, inner) = self.on(link), ends
        if not here.forces and not here.couples:
            return start
        across = Along(pin, inner, 1)
        name, size = self.reaction(self.carriers[pin], link), Balance(pin, across, here.about(inner))
        return polygon.lay(start, Force(name, size, across, pin), part="t", link=ends)

    def _closed_at(
        self, polygon: Polygon, link: str, ends: Ends, nodes: tuple[str, str, str], *, back: bool
    ) -> None:
        """Add the part along a link of the reaction at its outer pin, and the whole reaction.

        Arguments: `nodes` are those where the part across starts and ends, and where the polygon closes.
        """
        name = self.reaction(self.carriers[ends[0]], link)
        first, second, closed = nodes
        has_parts = first != second
        if has_parts:
            polygon.add(name, first if back else second, closed, back=back, part="n", link=ends)
        polygon.add(name, second if back else first, closed, back=back, link=ends if has_parts else None)
        self._hand_over(polygon, link, ends[0])

    def _hand_over(self, polygon: Polygon, link: str, joint: str) -> None:
        """Let the reaction at a joint act, the other way round, on the link that carries it."""
        carrier = self.carriers[joint]
        self._act(polygon.vectors[self.reaction(carrier, link)], link, carrier, joint)

    def _act(
        self, vector: Vector, link: str, carrier: str, joint: str, couples: Iterable[Couple] = ()
    ) -> None:
        """Let the opposite of a reaction on a link act on the link that carries the joint."""
        if carrier == GROUND:
            return
        name = self.reaction(link, carrier)
        along = Parallel(vector.tail, vector.head, quarters=0 if vector.reversed else 2)
        size = Same(f"sense {name}", vector.tail, vector.head)
        self.on(carrier).forces.append(Force(name, size, along, joint))
        self.on(carrier).couples.extend(couples)

    def _two_links(self, polygon: Polygon, pins: Ends, links: Ends, inner: str, hinged: str = "") -> str:
        """Close the polygon of two links hinged together at `inner`; return the node that closes it.

        Arguments: `hinged` is the part of the first link that is hinged there, by default that link.
        """
        (p, q), (link_p, link_q) = pins, links
        start = polygon.start()
        second = self._part_across(polygon, start, link_p, (p, inner))
        middle = polygon.lay_all(second, self.on(link_p).forces)
        end = polygon.lay_all(middle, self.on(link_q).forces)
        last = self._part_across(polygon, end, link_q, (q, inner))
        closed = polygon.close(Line(last, Along(q, inner)), Line(start, Along(p, inner)))
        self._closed_at(polygon, link_q, (q, inner), (end, last, closed), back=False)
        self._closed_at(polygon, link_p, (p, inner), (start, second, closed), back=True)
        if middle not in {start, end}:
            # Without forces on either link, the other's reaction passes through it.
            polygon.add(self.reaction(link_q, hinged or link_p), middle, closed, link=(p, inner))
        return closed

    def _slider(self, polygon: Polygon, group: Slider) -> None:
        pin, inner, (rod, slider) = group.pin, group.node, self.links[group.node]
        start = polygon.start()
        second = self._part_across(polygon, start, rod, (pin, inner))
        middle = polygon.lay_all(second, self.on(rod).forces)
        end = polygon.lay_all(middle, self.on(slider).forces)
        closed = polygon.close(Line(end, _across(inner, group.guide)), Line(start, Along(pin, inner)))
        self._on_guide(polygon, slider, group.guide, (end, closed), inner)
        self._closed_at(polygon, rod, (pin, inner), (start, second, closed), back=True)
        if middle not in {start, end}:
            polygon.add(self.reaction(slider, rod), middle, closed, link=(pin, inner))

    def _on_guide(
        self, polygon: Polygon, slider: str, guide: Guide, ends: Ends, joint: str, *, back: bool = False
    ) -> None:
        """Add the reaction of a guide; let it and the couples act on the link that carries it."""
        carrier = GROUND if isinstance(guide, FixedGuide) else guide.link
        polygon.add(self.reaction(carrier, slider), *ends, back=back)
        vector = polygon.vectors[self.reaction(carrier, slider)]
        self._act(vector, slider, carrier, joint, self.on(slider).couples)

    def _slotted(self, polygon: Polygon, group: SlottedLink) -> None:
        pivot, pin, (link, block) = group.pivot, group.pin, self.links[group.node]
        axis = slot_axis(group)
        across = replace(axis, quarters=axis.quarters + 1)
        here, couples = self.on(link), (*self.on(link).couples, *self.on(block).couples)
        start = polygon.start()
        size = Balance(group.node, across, Moments(pivot, tuple(here.forces), couples))
        second = polygon.lay(start, Force(self.reaction(block, link), size, across, pin))
        end = polygon.lay_all(second, here.forces)
        polygon.add(self.reaction(self.carriers[pivot], link), start, end, back=True)
        self._hand_over(polygon, link, pivot)
        self._hinged_block(polygon, block, link, pin, (start, second))

    def _hinged_block(
        self, polygon: Polygon, block: str, link: str, pin: str, ends: Ends, *, back: bool = False
    ) -> None:
        """Let the reaction at a block's pin act on the link that carries the pin.

        It is the block's own reaction on its `link` where nothing else acts on the block. Arguments: `ends`
        of that reaction in the order of drawing.
        """
        carrier, forces = self.carriers[pin], self.on(block).forces
        tail, head = ends
        # The reaction on the link runs from `foot`, or to it; the block's forces stand before it.
        foot, tip = (head, tail) if back else (tail, head)
        first = polygon.lay_all(tip, reversed(forces), back=True)
        if not forces:
            # The block is in balance under two forces: the same vector stands for both.
            self._act(polygon.vectors[self.reaction(block, link)], block, carrier, pin)
            return
        polygon.add(self.reaction(carrier, block), foot, first)
        self._hand_over(polygon, block, pin)

    def _two_guides(self, polygon: Polygon, group: CrossSlider, across: tuple[Direction, Direction]) -> None:
        first, second = self.links[group.node]
        start = polygon.start()
        middle = polygon.lay_all(start, self.on(first).forces)
        end = polygon.lay_all(middle, self.on(second).forces)
        closed = polygon.close(Line(end, across[1]), Line(start, across[0]))
        self._on_guide(polygon, second, group.guides[1], (end, closed), group.node)
        self._on_guide(polygon, first, group.guides[0], (start, closed), group.node, back=True)
        if middle not in {start, end}:
            polygon.add(self.reaction(second, first), middle, closed)

    def _yoke(self, polygon: Polygon, group: Yoke, across: Direction) -> None:
        yoke, block = self.links[group.node]
        start = polygon.start()
        end = polygon.lay_all(start, self.on(yoke).forces)
        slot: Direction = (
            Fixed(f"angle slot {group.node}", 1)
            if isinstance(group.guide, FixedGuide)
            else Along(*group.guide.base)
        )
        closed = polygon.close(Line(end, across), Line(start, slot))
        self.on(yoke).couples.extend(self.on(block).couples)
        joint = group.node if isinstance(group.guide, FixedGuide) else group.pin
        self._on_guide(polygon, yoke, group.guide, (end, closed), joint)
        polygon.add(self.reaction(block, yoke), start, closed, back=True)
        self._hinged_block(polygon, block, yoke, group.pin, (start, closed), back=True)

    # The driving link ----------------------------------------------------------------------------

    def _cylinder(self, group: SlottedLink, driver: Crank) -> None:
        """Write down the plan of a cylinder on which forces act, and of its crank: of two links and a joint.

        The thrust is the part along the cylinder of the force between its tube and its rod.
        """
        polygon, (tube, rod), axis = self._polygon(driver.pin), self.links[group.node], slot_axis(group)
        own, of_rod = self.on(tube), self.on(rod)
        whole = Loaded([*own.forces, *of_rod.forces], [*own.couples, *of_rod.couples])
        self.loaded |= {tube: whole, rod: Loaded()}
        pivots = group.pivot, driver.pivot
        closed = self._two_links(polygon, pivots, (tube, driver.link), driver.pin, hinged=rod)
        after = polygon.steps[1 + len(own.forces)].node
        foot = polygon.close(Line(closed, axis), Line(after, replace(axis, quarters=axis.quarters + 1)))
        polygon.add("F_b", closed, foot)
        polygon.add(self.reaction(rod, tube), after, foot)

    def _driver(self, driver: Driver) -> None:
        here, cylinder = self.on(driver.link), self.cylinder
        if cylinder is not None and isinstance(driver, Crank):
            moved = [self.on(link) for link in self.links[cylinder.node]]
            if any(one.forces or one.couples for one in moved):
                self._cylinder(cylinder, driver)
                return
        if not here.forces and not here.couples:
            return
        polygon = self._polygon(driver.pin)
        start = polygon.start()
        end = polygon.lay_all(start, here.forces)
        name = self.reaction(GROUND, driver.link)
        if isinstance(driver, Crank):
            if cylinder is None:
                self.moments["M_b"] = here.about(driver.pivot)
            else:
                along = slot_axis(cylinder)
                balance = Balance(driver.pin, along, here.about(driver.pivot))
                end = polygon.lay(end, Force("F_b", balance, along, driver.pin))
            if end != start:
                polygon.add(name, start, end, back=True)
            return
        guide = Fixed(f"angle guide {driver.pin}")
        closed = polygon.close(Line(end, guide), Line(start, replace(guide, quarters=1)))
        polygon.add("F_b", end, closed)
        polygon.add(name, start, closed, back=True)


def _as_given(name: str, point: str) -> Force:
    """Return a force whose size and direction are data."""
    return Force(name, Scaled(name, "kF"), Fixed(f"angle {name}"), point)


def _across(node: str, guide: Guide) -> Direction:
    """Return the direction across a guide."""
    return Fixed(f"angle guide {node}", 1) if isinstance(guide, FixedGuide) else Along(*guide.base, 1)


def slot_axis(group: SlottedLink) -> Along:
    """Return the direction of a slotted link's guide on the sketch."""
    axis = Along(group.foot or group.pivot, group.pin)
    if isinstance(group.side, int):
        return replace(axis, quarters=1 - group.side)
    return replace(axis, side=VariantSide(f"side {group.node}"))
