"""The vector equation behind each image of a joint: its terms, and what is known of each.

v_B = v_A + v_BA: v_A is drawn already, of v_B and v_BA the directions are known. Made from the steps of the
construction, by walking back from the node to the pole along what each step draws.
"""

from collections.abc import Mapping
from dataclasses import dataclass

from reference.construction.elements import Along, AnyLine, Direction, Length, Line
from reference.construction.graph import Construction, Vector
from reference.construction.steps import Divide, Given, Similar, Step, TwoLines


@dataclass(frozen=True, slots=True)
class Proportion:
    """A vector by similar figures: p'x' = p'q' PX / PQ, at the angle QPX to p'q'.

    `base` are p' and q' of the plan, `model` the joints Q, P and X.
    """

    base: tuple[str, str]
    model: tuple[str, str, str]


@dataclass(frozen=True, slots=True)
class Term:
    """A vector of an equation, from node `tail` to node `head`.

    Attributes
    ----------
    size : by which formula it is computed; None if it is unknown, or drawn already
    along : direction of its line; None if it is unknown, drawn already, or by similarity
    is_drawn : an earlier step has drawn it
    """

    vector: str
    tail: str
    head: str
    size: Length | Proportion | None = None
    along: Direction | None = None
    is_drawn: bool = False

    @property
    def known(self) -> int:
        """The number of known properties, of size and direction."""
        if self.is_drawn or isinstance(self.size, Proportion):
            return 2
        return (self.size is not None) + (self.along is not None)


@dataclass(frozen=True, slots=True)
class Equation:
    """The absolute vector `left` as a sum of others, in one way or in two.

    `nodes` are those that its terms add to the plan, in the order of the construction.
    """

    left: Term
    sums: tuple[tuple[Term, ...], ...]
    nodes: tuple[str, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """All terms in the order in which they are written."""
        return (self.left, *(term for terms in self.sums for term in terms))


def equations(construction: Construction) -> dict[str, Equation]:
    """Return the equation that each node of the plans, but for the poles, belongs to."""
    ends = _Ends(construction)
    found = [_equation(ends, vector) for vector in ends.absolute.values()]
    return {node: equation for equation in found for node in equation.nodes}


class _Ends:
    """The vectors of a construction by their ends."""

    def __init__(self, construction: Construction) -> None:
        self.construction = construction
        self.poles = frozenset(construction.poles.values())
        # Where a component fills the whole vector, as along a yoke's slot, the component is named.
        ordered = sorted(construction.vectors.values(), key=lambda vector: vector.part != "")
        self.names: Mapping[tuple[str, str], str] = {(one.tail, one.head): one.name for one in ordered}
        self.absolute = {one.head: one for one in ordered if one.tail in self.poles and not one.part}

    def drawn(self, node: str) -> Term:
        """Return the absolute vector of an earlier image."""
        vector = self.absolute[node]
        return Term(vector.name, vector.tail, node, is_drawn=True)

    def back(self, node: str) -> tuple[Term, ...]:
        """Return the terms that lead from the pole to a node from which a line starts."""
        if node in self.poles:
            return ()
        if node in self.absolute:
            return (self.drawn(node),)
        step = self.construction.step(node)
        return self.laid_off(step) if isinstance(step, Given) else ()

    def laid_off(self, step: Given) -> tuple[Term, ...]:
        """Return the terms up to the end of a vector that is laid off."""
        name = self.names[step.start, step.node]
        return (*self.back(step.start), Term(name, step.start, step.node, step.length, step.along))

    def along(self, line: AnyLine, node: str) -> tuple[Term, ...]:
        """Return the terms up to a node on a line."""
        if not isinstance(line, Line):
            raise TypeError(f"a line through a node of a plan is expected, not {type(line).__name__}")
        name = self.names[line.through, node]
        return (*self.back(line.through), Term(name, line.through, node, along=line.along))

    def similar(self, step: Similar | Divide, vector: Vector) -> tuple[Term, ...]:
        """Return the terms of a link's further point: of a moving point of its base, then relative to it."""
        kind, _, joint = vector.name.partition("_")
        sketch = self.construction.step(joint)
        joints = step.model[:2] if isinstance(step, Similar) else getattr(sketch, "base", ())
        pairs = list(zip(step.base, joints, strict=True))
        if step.base[0] in self.poles:
            pairs.reverse()
        (p, pin), (q, other) = pairs
        across = Along(pin, joint, 1) if kind == "v" else None
        name = self.names.get((p, step.node), f"{kind}_{joint}{pin}")
        return self.drawn(p), Term(name, p, step.node, Proportion((p, q), (other, pin, joint)), across)


def _equation(ends: _Ends, vector: Vector) -> Equation:
    step = ends.construction.step(vector.head)
    sums = _sums(ends, step, vector)
    own = [terms[0] for terms in sums if len(terms) == 1 and terms[0].vector == vector.name]
    left = own[0] if own else Term(vector.name, vector.tail, vector.head)
    sums = tuple(terms for terms in sums if terms not in [(one,) for one in own])
    added = {term.head for terms in sums for term in terms if not term.is_drawn} | {vector.head}
    nodes = tuple(one.node for one in ends.construction.steps if one.node in added)
    return Equation(left, sums, nodes)


def _sums(ends: _Ends, step: Step, vector: Vector) -> tuple[tuple[Term, ...], ...]:
    match step:
        case Given():
            return (ends.laid_off(step),)
        case TwoLines(first=first, second=second):
            # The vector itself first, as a sum of its own components.
            found = [ends.along(line, step.node) for line in (first, second)]
            return tuple(sorted(found, key=lambda terms: terms[0].is_drawn))
        case Similar() | Divide():
            return (ends.similar(step, vector),)
    raise ValueError(f"a step that makes a joint's image is expected, not {type(step).__name__}")
