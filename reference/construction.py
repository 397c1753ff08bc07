"""A plan as a construction: a short list of steps, each making one node from earlier nodes.

Mechanism sketch, velocity plan and acceleration plan are one construction in drawn millimetres,
y up, each figure about its own origin (the mechanism about the assignment's origin, a plan about
its pole). It is data, a directed acyclic graph, and one evaluator answers every question:

- the exact plan: `evaluate(construction, parameters)`, every node an array over variants;
- follow-through: the same with the student's nodes in `given` instead of the computed ones;
- a mistake: the same with a changed step or parameter (`reference.mistakes`);
- a diagnosis: the same step by step beside what was drawn, right and wrong ways (`reference.replay`);
- a hand: the same with `errors` on lines, lengths and arcs; its derivative is the tolerance
  (`reference.hand`);
- only what is needed: `wanted` names the nodes asked for, ancestors alone are evaluated.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

import numpy as np

from reference.elements import Errors, Nodes, Parameters, View
from reference.geometry import ComplexArray
from reference.steps import Coincide, Similar, Step

Part = Literal["", "n", "t", "c", "r"]


@dataclass(frozen=True, slots=True)
class Vector:
    """A named vector of a plan, from node `tail` to node `head`.

    Attributes
    ----------
    scale : ``kv`` or ``ka``
    link : the pair of joints (from, to) whose relative motion it is: of a turning link it is
        perpendicular or parallel to the line between them, and gives its angular rate; of a slider
        and the point under it (which lie in one place) it is along the guide
    part : of an acceleration: ``n`` normal, ``t`` tangential, ``c`` Coriolis, ``r`` along a guide
    turning : of a Coriolis component, the link that carries the guide
    """

    name: str
    tail: str
    head: str
    scale: str
    link: tuple[str, str] | None = None
    part: Part = ""
    turning: str | None = None


@dataclass(frozen=True, slots=True)
class AngularRate:
    """omega_k or epsilon_k from the vector that turns a link: (link x vector) / |link|^2."""

    name: str
    vector: str
    link: tuple[str, str]
    length: str


@dataclass(frozen=True, slots=True)
class Construction:
    """Steps in an order in which they can be drawn, with the figure each belongs to.

    Attributes
    ----------
    figures : steps by ``mechanism``, ``velocity_plan``, ``acceleration_plan``
    poles : the pole's node by plan
    vectors : named vectors by name
    rates : angular velocities and accelerations by name
    images : for each image of a plate's third point, the step that finds it by similarity, whichever
        way the construction itself finds it
    centres : on the sketch, by Mehmke's similarity from the finished plans: instantaneous centres
        (``I3``) and acceleration poles (``J3``) of links that turn about no fixed pivot
    """

    figures: Mapping[str, tuple[Step, ...]]
    poles: Mapping[str, str]
    vectors: Mapping[str, Vector]
    rates: Mapping[str, AngularRate]
    images: Mapping[str, Similar] = field(default_factory=dict)
    centres: Mapping[str, Similar] = field(default_factory=dict)
    steps: tuple[Step, ...] = field(init=False, repr=False, compare=False)
    """All steps in order."""
    _by_node: dict[str, tuple[str, Step]] = field(init=False, repr=False, compare=False)
    _upstream: dict[str, frozenset[str]] = field(init=False, repr=False, compare=False, default_factory=dict)

    def __post_init__(self) -> None:
        pairs = [(figure, step) for figure, steps in self.figures.items() for step in steps]
        object.__setattr__(self, "steps", tuple(step for _, step in pairs))
        object.__setattr__(self, "_by_node", {step.node: (figure, step) for figure, step in pairs})

    def step(self, node: str) -> Step:
        """The step that makes a node. Raises KeyError for a node that there is not."""
        return self._by_node[node][1]

    def figure_of(self, node: str) -> str:
        """The figure that a node belongs to. Raises KeyError for a node that there is not."""
        return self._by_node[node][0]

    def vectors_of(self, figure: str) -> tuple[Vector, ...]:
        """The vectors of one plan."""
        return tuple(v for v in self.vectors.values() if self._by_node[v.head][0] == figure)

    @property
    def links(self) -> Mapping[str, tuple[str, str]]:
        """The pairs of joints that are drawn as links of the sketch, by their names run together."""
        pairs = [one.link for one in self.vectors.values() if one.link and one.part != "r"]
        apart = {joint.node: joint.other for joint in self.steps if isinstance(joint, Coincide)}
        return {
            f"{tail}{head}": (tail, head)
            for tail, head in pairs
            if apart.get(tail, tail) != apart.get(head, head)
        }

    def upstream(self, node: str) -> frozenset[str]:
        """A node and everything that it is made from."""
        if node not in self._upstream:
            further = [self.upstream(need) for need in self.step(node).needs]
            self._upstream[node] = frozenset({node}).union(*further)
        return self._upstream[node]

    def with_step(self, changed: Step) -> "Construction":
        """The same construction with the step of one node replaced."""
        figures = {
            figure: tuple(changed if step.node == changed.node else step for step in steps)
            for figure, steps in self.figures.items()
        }
        return replace(self, figures=figures)


def ancestors(construction: Construction, wanted: Iterable[str]) -> frozenset[str]:
    """The nodes wanted and everything that they are made from."""
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
    parameters : floats or arrays that broadcast, see `Parameters`
    given : nodes to take as they are instead of constructing them (millimetres, y up)
    errors : the hand's errors; `NO_ERROR` where absent
    wanted : nodes asked for; all by default

    Returns the nodes, complex millimetres; nan where a step has no solution.
    """
    given = given or {}
    needed = None if wanted is None else ancestors(construction, wanted)
    nodes: dict[str, ComplexArray] = {}
    view = View(nodes, parameters, errors or {})
    with np.errstate(invalid="ignore", divide="ignore"):
        for step in construction.steps:
            if needed is not None and step.node not in needed:
                continue
            if step.node in given:
                nodes[step.node] = np.asarray(given[step.node])
            else:
                mark = view.error(step.node, 0, "x") + 1j * view.error(step.node, 0, "y")
                nodes[step.node] = np.asarray(step.place(view) + mark)
    return nodes
