"""A plan as a construction: a short list of steps, each making one node from earlier nodes.

Mechanism sketch, velocity plan and acceleration plan are one construction in drawn millimetres,
y up, each figure about its own origin (the mechanism about the assignment's origin, a plan about
its pole). It is data, a directed acyclic graph, and one evaluator has all uses:

- the exact plan: `evaluate(construction, parameters)`, every node an array over variants;
- follow-through: the same with the student's nodes in `given` instead of the computed ones;
- a mistake: the same with a changed step or parameter (`reference.construction.mistakes`);
- a diagnosis: the same step by step beside what was drawn (`reference.replay.replay`);
- a tolerance: the same with `errors` on lines, lengths and arcs; its derivative is the propagated
  drafting error (`reference.construction.uncertainty`);
- only what is needed: `wanted` names the nodes asked for, ancestors alone are evaluated.
"""

import math
from collections.abc import Collection, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Literal

import numpy as np

from reference.construction.elements import (
    Couple,
    Errors,
    Fixed,
    Force,
    Length,
    Line,
    Moments,
    Nodes,
    Parameters,
    View,
    data_in,
)
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from reference.geometry import ComplexArray, FloatArray, cross
from reference.kinematics.motion import move_where_possible
from reference.mechanism import (
    Crank,
    Driver,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    guides_of,
)
from reference.quantities import group_of


def pair(pin: str, node: str) -> str:
    """Return the name of the real length between two joints among the parameters."""
    return f"{pin}{node}"


def parameters_of(
    mechanism: Mechanism, k_length: FloatArray, k_velocity: FloatArray, k_acceleration: FloatArray
) -> dict[str, FloatArray]:
    """Return the construction's parameters: real lengths, crank data, guides and the three scales.

    Arguments: scales in real units per millimetre on paper (m/mm, (m/s)/mm, (m/s^2)/mm).
    """
    known: dict[str, FloatArray] = {"kL": k_length, "kv": k_velocity, "ka": k_acceleration}
    known.update(_driver_parameters(mechanism.driver))
    for joint, place in mechanism.ground_m.items():
        known[f"x {joint}"], known[f"y {joint}"] = np.asarray(place.real), np.asarray(place.imag)
    for group in mechanism.groups:
        known.update(_group_parameters(group))
    if any(isinstance(group, Triad) for group in mechanism.groups):
        known.update(_assemblies(mechanism))
    return known


def _assemblies(mechanism: Mechanism) -> dict[str, FloatArray]:
    """Return what no ruler and compasses find: the direction of each triad's first leg, and its assembly."""
    at, known = move_where_possible(mechanism, accelerations=False).position, dict[str, FloatArray]()
    for group in mechanism.groups:
        if isinstance(group, Triad):
            (d, e, f), (a, b, _) = group.corners, group.pins
            known[f"angle {pair(a, d)}"] = np.angle(at[d] - at[a])
            for node, (p, q) in ((e, (d, b)), (f, (d, e))):
                known[f"side {node}"] = np.sign(cross(at[q] - at[p], at[node] - at[p]))
    return known


def _driver_parameters(driver: Driver) -> dict[str, FloatArray]:
    pin = driver.pin
    if isinstance(driver, Crank):
        arm = driver.length_m
        return {
            "angle crank": driver.angle_rad,
            pair(driver.pivot, pin): arm,
            f"v_{pin}": driver.omega * arm,
            f"a_{pin}_n": driver.omega**2 * arm,
            f"a_{pin}_t": driver.epsilon * arm,
        }
    return {
        f"s {pin}": driver.displacement_m,
        f"v_{pin}": driver.speed,
        f"a_{pin}": driver.acceleration,
        **_guide_parameters(pin, FixedGuide(driver.guide_m, driver.guide_rad)),
    }


def _guide_parameters(node: str, guide: Guide) -> dict[str, FloatArray]:
    if not isinstance(guide, FixedGuide):
        return {}
    return {
        f"x guide {node}": np.asarray(guide.through_m.real),
        f"y guide {node}": np.asarray(guide.through_m.imag),
        f"angle guide {node}": guide.angle_rad,
    }


def _group_parameters(group: Group) -> dict[str, FloatArray]:
    known: dict[str, FloatArray] = {}
    if isinstance(side := getattr(group, "side", 1), np.ndarray):
        known[f"side {group.node}"] = side
    for guide in guides_of(group):
        known.update(_guide_parameters(group.node, guide))
    match group:
        case Dyad(node=node, pins=pins, lengths_m=lengths) | Plate(node=node, base=pins, lengths_m=lengths):
            known |= {pair(pin, node): length for pin, length in zip(pins, lengths, strict=True)}
            if isinstance(group, Plate) and group.line_ratio is not None:
                known[f"ratio {node}"] = group.line_ratio
        case PointOnLine(node=node, ratio=ratio):
            known[f"ratio {node}"] = ratio
        case Slider(node=node, pin=pin, length_m=length):
            known[pair(pin, node)] = length
        case Yoke(node=node, slot_rad=slot):
            known[f"angle slot {node}"] = slot
        case SlottedLink(node=node, offset_m=offset):
            known[f"offset {node}"] = offset
        case Triad(corners=(d, e, f), pins=pins, legs_m=legs, sides_m=sides):
            known |= {pair(pin, end): leg for pin, end, leg in zip(pins, group.corners, legs, strict=True)}
            known |= dict(zip((pair(d, e), pair(f, e), pair(f, d)), sides, strict=True))
        case SlotPoint(node=node, local_m=local):
            known |= {f"x {node}": np.asarray(local.real), f"y {node}": np.asarray(local.imag)}
    return known


Part = Literal["", "n", "t", "c", "r"]


@dataclass(frozen=True, slots=True)
class Vector:
    """A named vector of a plan, from node `tail` to node `head`.

    Attributes
    ----------
    scale : ``kv``, ``ka`` or ``kF``
    link : the pair of joints (from, to) whose relative motion it is: of a turning link it is
        perpendicular or parallel to the line between them, and gives its angular rate; of a slider
        and the point under it (which lie in one place) it is along the guide
    part : of an acceleration: ``n`` normal, ``t`` tangential, ``c`` Coriolis, ``r`` along a guide
    turning : of a Coriolis component, the link that carries the guide
    reversed : its arrow points to `tail`: it closes a force polygon whose start it is drawn from
    """

    name: str
    tail: str
    head: str
    scale: str
    link: tuple[str, str] | None = None
    part: Part = ""
    turning: str | None = None
    reversed: bool = False

    @property
    def is_sum(self) -> bool:
        """Return whether it is the sum of others: a full relative acceleration, a reaction of parts."""
        return self.scale != "kv" and self.link is not None and not self.part

    @property
    def arrow(self) -> tuple[str, str]:
        """The nodes at which it begins and its arrow points."""
        return (self.head, self.tail) if self.reversed else (self.tail, self.head)

    @property
    def turn_rad(self) -> float:
        """The angle from its order of drawing to its own sense: half a turn if it is reversed."""
        return math.pi if self.reversed else 0.0


@dataclass(frozen=True, slots=True)
class AngularRate:
    """omega_k or epsilon_k from the vector that turns a link: (link x vector) / |link|^2.

    The driving link's own `drives`: there the vector follows from it.
    """

    name: str
    vector: str
    link: tuple[str, str]
    length: str
    drives: bool = False


ON_SKETCH = "_sketch"
"""Ends the name of a vector that is drawn again at its point on the sketch."""


@dataclass(frozen=True)
class Construction:
    """Steps in an order in which they can be drawn, with the figure that each belongs to.

    Attributes
    ----------
    figures : steps by ``mechanism``, ``velocity_plan``, ``acceleration_plan``, ``force_plan_B``
    poles : the pole's node by plan
    vectors : named vectors by name
    rates : angular velocities and accelerations by name
    images : for each image of a plate's third point, the step that finds it by similarity, even if the
        construction itself finds it by other means
    centres : on the sketch, by Mehmke's similarity from the finished plans: instantaneous centres (``I3``)
        and acceleration poles (``J3``) of links that turn about no fixed pivot
    pairs : the joints between which links, slots and slides run, from the earlier joint
    dots : as `reference.mechanism.Mechanism.dots`
    moments : the balancing moment (``M_b``) of what acts on the driving link, N m
    acting : what acts on each link but the reactions of its own group: given, or taken over
    """

    figures: Mapping[str, tuple[Step, ...]]
    poles: Mapping[str, str]
    vectors: Mapping[str, Vector]
    rates: Mapping[str, AngularRate]
    images: Mapping[str, Similar] = field(default_factory=dict)
    centres: Mapping[str, Similar] = field(default_factory=dict)
    pairs: tuple[tuple[str, str], ...] = ()
    dots: frozenset[str] = frozenset()
    moments: Mapping[str, Moments] = field(default_factory=dict)
    acting: Mapping[str, tuple[Force | Couple, ...]] = field(default_factory=dict)

    @cached_property
    def steps(self) -> tuple[Step, ...]:
        """All steps in order."""
        return tuple(step for steps in self.figures.values() for step in steps)

    @cached_property
    def _by_node(self) -> dict[str, tuple[str, Step]]:
        """Figure and step of each node."""
        return {step.node: (figure, step) for figure, steps in self.figures.items() for step in steps}

    @cached_property
    def _upstream(self) -> dict[str, frozenset[str]]:
        """For each node, itself and all nodes that it is made from, each after those that it needs."""
        upstream: dict[str, frozenset[str]] = {}
        for step in self.steps:
            upstream[step.node] = frozenset((step.node,)).union(*[upstream[need] for need in step.needs])
        return upstream

    def step(self, node: str) -> Step:
        """Return the step that makes a node. Raises KeyError for an unknown node."""
        return self._by_node[node][1]

    def laid_off(self, tail: str, head: str) -> Given | None:
        """Return the step that lays off a vector from its tail; None if its head is made otherwise."""
        step = self.step(head)
        return step if isinstance(step, Given) and step.start == tail else None

    def figure_of(self, node: str) -> str:
        """Return the figure that a node belongs to. Raises KeyError for an unknown node."""
        return self._by_node[node][0]

    def drawn_at(self, node: str) -> tuple[str, ...]:
        """Return a node's name; of a force plan, whose nodes have no letters, the vectors made with it."""
        if node not in self._by_node or not group_of(self.figure_of(node)):
            return (node,)
        return tuple(one.name for one in self.vectors.values() if one.head == node)

    def needed_for(self, nodes: Collection[str]) -> frozenset[str]:
        """Return the nodes from which some nodes are directly made."""
        return frozenset(need for step in self.steps if step.node in nodes for need in step.needs)

    def data_of(self, name: str) -> frozenset[str]:
        """Return the names of the data of forces and couples from which a node or a moment is made."""
        moments, steps = self.moments.get(name), map(self.step, self.sources(name))
        lengths = [step.length for step in steps if isinstance(step, Given)]
        parts: list[Length | Moments] = [*lengths, *((moments,) if moments else ())]
        return frozenset[str]().union(*map(data_in, parts))

    def upstream(self, node: str) -> frozenset[str]:
        """Return a node and all nodes that it is made from. Raises KeyError for an unknown node."""
        return self._upstream[node]

    def sources(self, name: str) -> frozenset[str]:
        """Return the nodes from which a node or a moment is made, with the node itself."""
        moments = self.moments.get(name)
        return frozenset[str]().union(*map(self.upstream, (name,) if moments is None else moments.needs))

    def vectors_of(self, figure: str) -> tuple[Vector, ...]:
        """Return the vectors of one plan."""
        return tuple(v for v in self.vectors.values() if self._by_node[v.head][0] == figure)

    def polygon_of(self, figure: str) -> tuple[Vector, ...]:
        """Return the vectors of one plan that have to be drawn: without the sums of components."""
        return tuple(v for v in self.vectors_of(figure) if not v.is_sum)

    @property
    def driving(self) -> frozenset[str]:
        """The names of the driving link's angular velocity and acceleration."""
        return frozenset(name for name, rate in self.rates.items() if rate.drives)

    @property
    def pivot(self) -> str:
        """The driving link's pivot; where a slider drives, the first fixed point."""
        steps = self.figures["mechanism"]
        return next((step.start for step in steps if isinstance(step, Given)), steps[0].node)

    @property
    def on_sketch(self) -> Mapping[str, str]:
        """The joint from which each vector of the finished plans is drawn again (``a_D_sketch``).

        Centres (``J3``) are told from the driving pivot.
        """
        joints = {step.node for step in self.figures["mechanism"]}
        own = (one.name for one in self.vectors.values() if one.tail in self.poles.values())
        vectors = {f"{name}{ON_SKETCH}": joint for name in own if (joint := name.partition("_")[2]) in joints}
        return {**vectors, **dict.fromkeys(self.centres, self.pivot)}

    @property
    def links(self) -> Mapping[str, tuple[str, str]]:
        """Pairs of joints that the sketch draws as links, by their joined names."""
        place = {joint.node: joint.other for joint in self.steps if isinstance(joint, Coincide)}
        return {
            f"{tail}{head}": (tail, head)
            for tail, head in self.pairs
            if place.get(tail, tail) != place.get(head, head)
        }

    @property
    def all_on_sketch(self) -> Mapping[str, tuple[str, str]]:
        """All links, and what is added to the sketch as a link without a joint at its end."""
        return {**self.links, **{name: (joint, "") for name, joint in self.on_sketch.items()}}

    def with_step(self, changed: Step) -> "Construction":
        """Return the construction with the step of one node replaced."""
        figures = {
            figure: tuple(changed if step.node == changed.node else step for step in steps)
            for figure, steps in self.figures.items()
        }
        return replace(self, figures=figures)


def ancestors(construction: Construction, wanted: Iterable[str]) -> frozenset[str]:
    """Return the requested nodes and all nodes that they are made from."""
    return frozenset().union(*(construction.upstream(node) for node in wanted))


def evaluate(
    construction: Construction,
    parameters: Parameters,
    *,
    given: Nodes | None = None,
    errors: Errors | None = None,
    wanted: Iterable[str] | None = None,
) -> dict[str, ComplexArray]:
    """Draw the construction.

    Arguments
    ---------
    parameters : floats or arrays that broadcast, see `reference.construction.elements.Parameters`
    given : nodes to use as they are instead of constructing them (millimetres, y up)
    errors : of drawing, see `reference.construction.elements.Errors`; zero if absent
    wanted : the requested nodes; all by default

    Returns the nodes, complex millimetres; nan if a step has no solution.
    """
    given = given or {}
    steps = construction.steps
    if wanted is not None:
        # Steps come after those they need; what a given node is made from is not asked for.
        needed = {construction.step(node).node for node in wanted}
        for step in reversed(steps):
            if step.node in needed and step.node not in given:
                needed.update(step.needs)
        steps = tuple(step for step in steps if step.node in needed)
    nodes: dict[str, ComplexArray] = {}
    view = View(nodes, parameters, errors or {})
    with np.errstate(invalid="ignore", divide="ignore"):
        for step in steps:
            if step.node in given:
                nodes[step.node] = np.asarray(given[step.node])
            else:
                mark = view.error(step.node, 0, "x") + 1j * view.error(step.node, 0, "y")
                nodes[step.node] = np.asarray(step.place(view) + mark)
    return nodes


def bars(construction: Construction) -> tuple[tuple[str, str], ...]:
    """Return every bar that the sketch's steps draw between two joints, from the earlier joint."""
    return tuple(
        (start, step.node)
        for step in construction.figures["mechanism"]
        if step.node not in construction.dots
        for start in _starts(step, construction)
    )


def _starts(step: Step, construction: Construction) -> Iterator[str]:
    match step:
        case Given(start=start):
            yield start
        case TwoArcs(node=node, centres=centres):
            yield from centres
            # The third leg of a triad; a side of its ternary link is drawn from its earlier corner.
            others = (pin for pin, end in construction.pairs if end == node and pin not in centres)
            yield from (pin for pin in others if node not in getattr(construction.step(pin), "centres", ()))
        case ArcAndLine(centre=centre) | Tangent(centre=centre):
            yield centre
        case Divide(base=base):
            yield base[0]
        case Local(origin=origin):
            yield origin
        case Coincide(node=node, other=other):
            # A slotted link's point turns about the link's pivot; a point under a slider has a bar already.
            here = {other, *(under for under, over in coincident(construction).items() if over == other)}
            yield from (pivot for pivot, head in construction.pairs if head == node and pivot not in here)
        case TwoLines(first=first, second=second):
            # The slot of a yoke; guides are no bars.
            lines = (line for line in (first, second) if isinstance(line, Line))
            yield from (line.through for line in lines if isinstance(line.along, Fixed))


def coincident(construction: Construction) -> Mapping[str, str]:
    """Return, by name, the joints that coincide with another joint at this instant."""
    steps = construction.figures["mechanism"]
    return {step.node: step.other for step in steps if isinstance(step, Coincide)}
