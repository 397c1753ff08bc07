"""The equations behind a construction: of vectors, with what is known of each term, and of moments.

v_B = v_A + v_BA: v_A is drawn already, of v_B and v_BA the directions are known. Made from the steps of the
construction, by walking back from the node to the pole along what each step draws. The forces of a closed
polygon add up to zero, and so do their moments about a joint.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count

from reference import geometry
from reference.construction.elements import (
    Along,
    AnyLine,
    Balance,
    Couple,
    Direction,
    Force,
    Length,
    Line,
    Moments,
    View,
)
from reference.construction.graph import Construction, Vector
from reference.construction.steps import Divide, Given, Similar, Step, TwoLines
from reference.quantities import group_of


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
    is_negative : it is subtracted
    """

    vector: str
    tail: str
    head: str
    size: Length | Proportion | None = None
    along: Direction | None = None
    is_drawn: bool = False
    is_negative: bool = False

    @property
    def known(self) -> int:
        """The number of known properties, of size and direction."""
        if self.is_drawn or isinstance(self.size, Proportion):
            return 2
        return (self.size is not None) + (self.along is not None)


@dataclass(frozen=True, slots=True)
class Equation:
    """The absolute vector `left` as a sum of others, in one way or in two; without it, a sum that is zero.

    `nodes` are those that its terms add to the plan, in the order of the construction.
    """

    left: Term | None
    sums: tuple[tuple[Term, ...], ...]
    nodes: tuple[str, ...]

    @property
    def terms(self) -> tuple[Term, ...]:
        """All terms in the order in which they are written."""
        left = () if self.left is None else (self.left,)
        return (*left, *(term for terms in self.sums for term in terms))


def equations(construction: Construction) -> dict[str, Equation]:
    """Return the equation that each node of the plans, but for the poles, belongs to."""
    ends = _Ends(construction)
    found = [_equation(ends, vector) for vector in ends.absolute.values()]
    found += [one for figure in construction.poles if group_of(figure) for one in _closed(ends, figure)]
    return {node: equation for equation in found for node in equation.nodes}


class _Ends:
    """The vectors of a construction by their ends."""

    def __init__(self, construction: Construction) -> None:
        self.construction = construction
        self.poles = frozenset(pole for plan, pole in construction.poles.items() if not group_of(plan))
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


# Force plans ---------------------------------------------------------------------------------------


def _closed(ends: _Ends, figure: str) -> Iterator[Equation]:
    """Yield the sums of forces that a plan closes: first its group's, then those of a part of it."""
    construction, known = ends.construction, list[tuple[Vector, Term]]()
    for vector in construction.polygon_of(figure):
        term = _of_force(construction.step(vector.head), vector, [one for one, _ in known])
        start, end = (vector.head, vector.tail) if vector.reversed else (vector.tail, vector.head)
        way = _way([one for one, _ in known], end, start)
        known.append((vector, term))
        if way:
            terms = dict(zip((one.name for one, _ in known), (one for _, one in known), strict=True))
            total = [replace(terms[name], is_negative=backwards) for name, backwards in way]
            drawn = {one.head for one in (*total, term) if not one.is_drawn}
            nodes = tuple(step.node for step in construction.figures[figure] if step.node in drawn)
            if total[0].is_negative:
                # A sum begins with a term that is not subtracted.
                total = sorted(total, key=lambda one: one.is_negative)
            yield Equation(None, ((*total, term),), nodes)
            known = [(one, replace(its, is_drawn=True)) for one, its in known]


def _of_force(step: Step, vector: Vector, earlier: list[Vector]) -> Term:
    """Return the term of a force: laid off, on a line, or, between nodes that others make, unknown."""
    ends = vector.tail, vector.head
    before = sum((one.tail, one.head) == ends for one in earlier)
    match step:
        case Given(start=start) if start == vector.tail and not before:
            return Term(vector.name, *ends, step.length, step.along)
        case TwoLines(first=first, second=second):
            lines = [one for one in (first, second) if isinstance(one, Line) and one.through == vector.tail]
            if before < len(lines):
                return Term(vector.name, *ends, along=lines[before].along)
    return Term(vector.name, *ends)


def _way(vectors: list[Vector], start: str, end: str) -> list[tuple[str, bool]]:
    """Return the fewest vectors between two nodes, each with whether it runs backwards; none if apart."""
    ways: dict[str, list[tuple[str, bool]]] = {start: []}
    for _ in vectors:
        for one in vectors:
            for tail, head in ((one.tail, one.head), (one.head, one.tail)):
                way = [*ways.get(tail, ()), (one.name, (tail == one.tail) == one.reversed)]
                if tail in ways and len(way) < len(ways.get(head, (*vectors, one))):
                    ways[head] = way
    return ways.get(end, [])


@dataclass(frozen=True, slots=True)
class Arm:
    """The distance of a force's line from a joint; unnamed where it is the whole of a link."""

    name: str
    force: Force
    about: str

    def foot(self, view: View) -> complex:
        """Return the point of the force's line that is nearest to the joint, complex millimetres."""
        at, along = view.nodes[self.force.point], self.force.along.at(view)
        return complex(at + along * geometry.dot(along, view.nodes[self.about] - at))

    def mm(self, view: View) -> float:
        """Return its length."""
        return abs(self.foot(view) - complex(view.nodes[self.about]))

    def moment(self, view: View) -> float:
        """Return the force's moment, N m, counter-clockwise positive."""
        return float(self.force.moment(view, self.about) * view.parameters["kL"] * view.parameters["kF"])


@dataclass(frozen=True, slots=True)
class MomentSum:
    """The moments about a joint that an unknown force or moment balances.

    Attributes
    ----------
    lever : the arm of the unknown force; None of an unknown moment
    """

    about: str
    unknown: str
    arms: tuple[Arm, ...]
    couples: tuple[Couple, ...]
    lever: Arm | None = None

    @property
    def named_arms(self) -> tuple[Arm, ...]:
        """The arms that are measured, in the order of their numbers."""
        levers = () if self.lever is None or not self.lever.name else (self.lever,)
        return (*levers, *self.arms)


NO_ARM = 1e-9
"""Share of its point's distance below which a force's line passes through the joint."""


def moment_sums(construction: Construction, figure: str, view: View) -> list[MomentSum]:
    """Return the sums of moments of a force plan; arms are numbered in order."""
    found, number = list[MomentSum](), count(1)
    names = {(one.tail, one.head): one.name for one in reversed(construction.polygon_of(figure))}

    def arm(force: Force, about: str) -> Iterator[Arm]:
        one = Arm("", force, about)
        away = abs(complex(view.nodes[force.point] - view.nodes[about]))
        if one.mm(view) > NO_ARM * away and abs(float(force.size.at(view))) > 0.0:
            yield replace(one, name=f"h_{next(number)}")

    def told(name: str, moments: Moments, lever: Arm | None = None) -> MomentSum:
        arms = tuple(one for force in moments.forces for one in arm(force, moments.about))
        couples = tuple(one for one in moments.couples if float(one.at(view)) != 0.0)
        return MomentSum(moments.about, name, arms, couples, lever)

    for step in construction.figures[figure]:
        if isinstance(step, Given) and isinstance(balance := step.length, Balance):
            name = names[step.start, step.node]
            lever = Arm("", Force(name, balance, balance.along, balance.point), balance.moments.about)
            if balance.along != Along(balance.point, lever.about, 1):
                lever = replace(lever, name=f"h_{next(number)}")
            found.append(told(name, balance.moments, lever))
    if figure == [*construction.poles][-1]:
        found += [told(name, moments) for name, moments in construction.moments.items()]
    return found
