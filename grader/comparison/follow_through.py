"""Values that follow from a student's own earlier values.

The construction is evaluated with the student's nodes in place of the computed ones. Lengths alone are
enough for normal and Coriolis components (from the student's own velocities or computed angular
velocity), for images of a link's points that start from a common node, and for the scale that the
drawing follows.
"""

import cmath
import math
from collections.abc import Callable, Iterable, Iterator, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from itertools import combinations
from typing import cast

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.own import Nodes, PlanBasis, fits, known, other_mechanism, own_nodes
from grader.comparison.scales import Scale
from grader.comparison.task import Made, Task, TaskSegment
from grader.comparison.verdicts import NO_SPREAD, Expectation
from grader.records import MECHANISM
from reference.construction.elements import (
    Balance,
    Coriolis,
    Fixed,
    Force,
    Moments,
    Normal,
    Parallel,
    Same,
    Scaled,
    View,
    data_in,
    is_force,
)
from reference.construction.graph import AngularRate, Vector
from reference.construction.mistakes import Drawing, Mistake, commit, laid_off, line_of
from reference.construction.steps import Divide, Given, Similar, TwoLines
from reference.construction.uncertainty import EndSpread, OwnNode, TracedDrawing, spread, trace
from reference.geometry import ComplexArray, FloatArray
from reference.numbers import dot
from reference.replay.replay import Replay

LEAST_ACROSS = 0.2
"""Least share of a vector across its link that tells which way it turns it."""
_MOST_SHARE = 1e6
"""Past this share of the right one a computed value gives no vector that fits; its square may overflow."""


@dataclass(frozen=True, slots=True)
class ReplayResult:
    """The result of the search for what was done.

    Attributes
    ----------
    explanations : of the drawing, the likeliest first; none where it may be right
    basis : the other construction by which the plans were drawn, where that is certain
    blamed : vectors in which a mistake was made, nearly certainly
    explained : nodes at which it was made
    left_out : those of them that are the ends of components left out
    repeated : the nodes of each mistake that was made at several: all forces of inertia reversed
    """

    explanations: tuple[Replay, ...] = ()
    basis: PlanBasis | None = None
    blamed: frozenset[str] = frozenset()
    explained: frozenset[str] = frozenset()
    left_out: frozenset[str] = frozenset()
    repeated: tuple[frozenset[str], ...] = ()


Explain = Callable[[Task, Evidence, Mapping[str, Scale]], ReplayResult]
"""Searches for what was done, from the evidence and the settled scales."""


def nothing_explained(_task: Task, _evidence: Evidence, _settled: Mapping[str, Scale]) -> ReplayResult:
    """No explanation: the drawing is compared with the right one and with the own nodes alone."""
    return ReplayResult()


@dataclass(slots=True)
class FollowThrough:
    """Expectations that follow from one submission's own values, at the scales used and those it follows.

    Attributes
    ----------
    explain : searches for what was done; it is asked once, when it is needed
    found : what it has found
    cache : by scales and basis the own nodes and the traced drawing, turned plans, causes of nodes
    """

    task: Task
    evidence: Evidence
    used: Mapping[str, float]
    followed: Mapping[str, float]
    explain: Callable[[], ReplayResult]
    found: ReplayResult | None = None
    cache: dict[tuple[object, ...], object] = field(default_factory=dict)

    def _cached(self, key: tuple[object, ...], make: Callable[[], Made]) -> Made:
        if key not in self.cache:
            self.cache[key] = make()
        return cast("Made", self.cache[key])

    @property
    def explanation(self) -> ReplayResult:
        """The result of the search for what was done."""
        if self.found is None:
            self.found = self.explain()
        return self.found

    @property
    def instead(self) -> PlanBasis | None:
        """The basis of the plans: by the search for what was done, else by counting vectors; or None."""
        scales = (self.used, self.followed)
        return self.explanation.basis or self._cached(
            ("instead",), lambda: other_mechanism(self.task, self.evidence, scales)
        )

    # A criterion's expectations -------------------------------------------------------------------

    def expectations(
        self, segment: TaskSegment, wrong: frozenset[str] = frozenset(), *, follows_through: bool
    ) -> Iterator[Expectation]:
        """Yield the expectations of a vector or link, each made when it is asked for.

        The given one, those from the student's own earlier values, and each explanation's prediction.

        Arguments: `wrong` are nodes whose wrong line has been charged to another vector, or is in doubt.
        """
        exact, others = segment.drawn(self.used), self.wrong_scales
        yield Expectation(exact)
        yield Expectation(exact, uncertainty=self.uncertainty_of(segment, exact))
        if not follows_through:
            return
        if segment.scale in others:
            at_scale, name = segment.drawn(self.followed), segment.scale
            yield Expectation(at_scale, "scale", name, others, self.uncertainty_of(segment, at_scale))
        own = self.from_nodes(segment, self.used)
        if own.relies_on:
            yield replace(own, may_add_up=True)
        if segment.scale == "kL":
            return
        if segment.head in wrong:
            yield from filter(None, (self.on_own_line(segment), self.between_own_nodes(segment)))
        yield from self.turned_plan(segment)
        if segment.head in self.task.construction.images:
            # Of a wrong base, lines and similarity give different images of a plate's point.
            yield self.from_nodes(segment, self.followed, by_similarity=True)
        yield from self.joined(segment, wrong)
        yield from self.from_vectors(segment, self.used)
        yield from self.taken_over(segment, wrong)
        basis = self.instead
        if basis is not None and not basis.blames(segment.name, segment.head):
            one = self.from_nodes(segment, self.followed, basis)
            yield replace(one, causes=others | self.causes_of(segment.head, basis))
        basis = self.own_forces(segment.head, wrong)
        if basis is not None:
            yield replace(self.from_nodes(segment, self.followed, basis), causes=others | basis.wrong)
        if others:
            yield replace(self.from_nodes(segment, self.followed), causes=others)
            for one in self.from_vectors(segment, self.followed):
                yield replace(one, causes=others)
        for heads, other in self.entered_otherwise(segment.head, wrong):
            basis = other.own_forces(segment.head, wrong)
            made, causes = other.from_nodes(segment, self.followed, basis), others | heads
            for one in (made, *other.joined(segment, wrong)):
                yield replace(one, causes=causes | basis.wrong if basis else causes)

    @property
    def wrong_scales(self) -> frozenset[str]:
        """The scales that the drawing does not follow."""
        return frozenset(scale for scale, used in self.used.items() if self.followed[scale] != used)

    def causes_of(self, node: str, basis: PlanBasis) -> frozenset[str]:
        """The wrong nodes of a basis from which a node is made; a turned plan is wrong at its first node."""
        construction = self.task.construction
        upstream = construction.upstream(node)
        figures = {construction.figure_of(node) for node in upstream}
        first = {figure: self.first_node(figure) for figure in construction.poles if figure in figures}
        wrong = {first.get(name, name) for name in basis.wrong}
        return frozenset(name for name in wrong if name in upstream or name == MECHANISM)

    def first_node(self, figure: str) -> str:
        """The first node that is laid off in a plan: there a plan turned as a whole is wrong."""
        pole = self.task.construction.poles[figure]
        return next(step.node for step in self.task.construction.figures[figure] if step.node != pole)

    # From nodes -----------------------------------------------------------------------------------

    def own(self, scales: Mapping[str, float], basis: PlanBasis | None = None) -> Nodes:
        """The student's own nodes, by figure; measured ones as they lie in plans drawn by the basis."""
        key = "own", basis and basis.name, *scales.values()
        return self._cached(key, lambda: own_nodes(self.task, self.evidence, basis or self.right(scales)))

    def right(self, scales: Mapping[str, float]) -> PlanBasis:
        """The right construction, with the mechanism at the scale that the sketch follows."""
        drawn = {**scales, "kL": self.followed["kL"]}
        return PlanBasis("right", self.task.construction, self.task.at(drawn))

    def traced(
        self, scales: Mapping[str, float], basis: PlanBasis | None = None, *, by_similarity: bool = False
    ) -> TracedDrawing:
        """The drawing traced from the student's own nodes; with plates' images by similarity if asked."""
        own, task = self.own(scales, basis), self.task
        if not own and basis is None:
            return task.traced(scales)

        def traced() -> TracedDrawing:
            drawn = basis or self.right(scales)
            construction = task.by_similarity if by_similarity else drawn.construction
            return trace(construction, drawn.parameters, task.skill, own)

        key = "traced", basis and basis.name, by_similarity, *scales.values()
        return self._cached(key, traced)

    def from_nodes(
        self,
        segment: TaskSegment,
        scales: Mapping[str, float],
        basis: PlanBasis | None = None,
        *,
        by_similarity: bool = False,
    ) -> Expectation:
        """The vector constructed from the student's own nodes upstream; the exact one without any."""
        found, own = self.traced(scales, basis, by_similarity=by_similarity), self.own(scales, basis)
        construction = self.task.construction
        upstream, step = construction.upstream, construction.laid_off(segment.tail, segment.head)
        ends: tuple[str, ...] = segment.head, segment.tail
        if step is not None:
            # Laid off, wherever it starts.
            ends = (*step.length.needs, *step.along.needs)
        relies_on = (known(own) & frozenset[str]().union(*map(upstream, ends))) - {segment.head}
        if not relies_on and basis is None:
            exact = segment.drawn(scales)
            return Expectation(exact, "nodes", "", relies_on, self.uncertainty_of(segment, exact))
        vector = found.vector(segment.tail, segment.head)
        uncertainty, se = self.spreads(found.shifts(segment.tail, segment.head), found.drafting_count, vector)
        return Expectation(vector, "nodes", "", relies_on, uncertainty, se)

    def own_forces(self, at: str, wrong: frozenset[str]) -> PlanBasis | None:
        """The right construction with the own wrong forces from which a node or moment is made; None without.

        Arguments: `wrong` are nodes that are wrong, among them where such forces end.
        """
        construction, changed = self.task.construction, dict[str, FloatArray]()
        forces = self._wrong_forces(at, wrong)
        for vector, step in forces.items():
            changed |= self._own_force(construction.vectors[vector], step)
        if not forces:
            return None
        heads = frozenset(step.node for step in forces.values())
        right, name = self.right(self.followed), f"forces {' '.join(sorted(heads))}"
        return PlanBasis(name, construction, {**right.parameters, **changed}, heads)

    def _wrong_forces(self, at: str, wrong: frozenset[str]) -> dict[str, Given]:
        """The steps of wrong forces from which a node or moment is made, by vector."""
        construction = self.task.construction
        data = construction.data_of(at)
        return {
            laid_off(step, construction): step
            for step in construction.steps
            if isinstance(step, Given) and step.node != at and step.node in wrong
            if is_force(step.length) and not data.isdisjoint(data_in(step.length))
        }

    def entered_otherwise(
        self, at: str, wrong: frozenset[str]
    ) -> Iterator[tuple[frozenset[str], "FollowThrough"]]:
        """Yield what follows if wrong vectors are wrong in their entry alone, with the nodes where they end.

        One or two point the other way; one that is laid off was drawn as it is due.
        """
        if self.evidence.has_sheets:
            return
        construction, measured = self.task.construction, self.evidence.measured
        forces = self._wrong_forces(at, wrong)
        steps = map(construction.step, (construction.sources(at) & wrong) - {at})
        laid = forces | {laid_off(step, construction): step for step in steps if isinstance(step, Given)}
        turned, due = dict[str, DrawnVector](), dict[str, DrawnVector]()
        for name in laid:
            one = measured.get(name)
            if one is None or one.direction_rad is None:
                continue
            right = self.task.segments[name].drawn(self.followed)
            turned[name] = replace(one, direction_rad=one.direction_rad + math.pi)
            right = (
                right if name in forces else self.from_nodes(self.task.segments[name], self.followed).vector
            )
            due[name] = replace(one, length_mm=abs(right), direction_rad=cmath.phase(right))
        ways = [{name: each[name]} for each in (turned, due) for name in each]
        ways += [{one: turned[one], other: turned[other]} for one, other in combinations(turned, 2)]
        for entries in ways:
            evidence = replace(self.evidence, measured={**measured, **entries})
            make = partial(replace, self, evidence=evidence, cache={})
            other = self._cached(("entered", *entries.items()), make)
            yield frozenset(laid[name].node for name in entries), other

    def _own_force(self, vector: Vector, step: Given) -> dict[str, FloatArray]:
        """The data by which a force is what the student has drawn; zero for one that was not."""
        own, traced = self.evidence.vector(vector.name), self.traced(self.followed)
        made = traced.made[vector.head].at - traced.nodes[vector.tail].at
        drawn = 0j if own is None else own.as_complex
        drawn = cmath.rect(own.length_mm, cmath.phase(made)) if drawn is None and own else drawn or 0j
        (datum,) = data_in(step.length)
        known = self.right(self.followed).parameters
        if isinstance(step.length, Scaled) and isinstance(step.along, Fixed):
            size = np.asarray(abs(drawn) * self.followed[vector.scale])
            return {datum: size, step.along.angle: np.asarray(cmath.phase(drawn))}
        share = (drawn * made.conjugate()).real / max(abs(made) ** 2, 1e-9)
        return {datum: np.asarray(share * known.get(datum, 1.0))}

    def moment(
        self, name: str, per_mm: float, basis: PlanBasis | None = None, *, as_laid_off: bool = False
    ) -> Expectation:
        """The moment that the student's own nodes give, as millimetres of so many N m.

        Arguments: with `as_laid_off` it is of the forces as the student laid them off in the last plan.
        """
        moment, relies_on = self.task.construction.moments[name], self.task.construction.sources(name)
        if as_laid_off:
            moment, relies_on = self._as_laid_off(moment)
        one = self._evaluated(lambda view: moment.at(view) / per_mm, moment.needs, relies_on, basis)
        return one if basis is None else replace(one, causes=basis.wrong)

    def _as_laid_off(self, moments: Moments) -> tuple[Moments, frozenset[str]]:
        """The moments of forces that are taken over, as they are laid off in this plan; and their ends."""
        vectors, forces, heads = self.task.construction.vectors, list[Force](), set[str]()
        for one in moments.forces:
            own = vectors.get(one.name)
            if isinstance(one.size, Same) and own and self.evidence.vector(one.name):
                size = replace(one.size, tail=own.tail, head=own.head)
                along = Parallel(own.tail, own.head)
                one = replace(one, size=size, along=along)  # noqa: PLW2901 - the same force
                heads.add(own.head)
            forces.append(one)
        return replace(moments, forces=tuple(forces)), frozenset(heads)

    def _evaluated(
        self,
        at: Callable[[View], FloatArray | ComplexArray],
        needs: Iterable[str],
        relies_on: frozenset[str],
        basis: PlanBasis | None = None,
    ) -> Expectation:
        """An expectation by a formula, millimetres, from the student's own nodes among those it needs."""
        traced, parameters = self.traced(self.used, basis), (basis or self.right(self.used)).parameters
        nodes = {node: traced.nodes[node] for node in needs}
        placed = {node: np.asarray(one.at) for node, one in nodes.items()}
        shifted = {node: np.asarray(one.at + one.shifts) for node, one in nodes.items()}
        found, moved = (at(View(where, parameters)) for where in (placed, shifted))
        shifts = np.asarray(moved - found, dtype=np.complex128)
        relies_on &= known(self.own(self.used))
        uncertainty, se = self.spreads(shifts, traced.drafting_count, complex(found))
        return Expectation(complex(found), "nodes", "", relies_on, uncertainty, se)

    def spreads(
        self, shifts: ComplexArray, drafting_count: int, along: complex
    ) -> tuple[EndSpread, EndSpread]:
        """The propagated drafting error, and the standard errors of reading.

        Errors of measuring by hand are the student's own and count with the drafting errors.
        """
        if not cmath.isfinite(along):
            return NO_SPREAD, NO_SPREAD
        if not self.evidence.has_sheets:
            return self.by_hand(spread(shifts, along), along), NO_SPREAD
        drafting, reading = shifts[:drafting_count], shifts[drafting_count:]
        return self.by_hand(spread(drafting, along), along), spread(reading, along)

    def by_hand(self, end: EndSpread, along: complex) -> EndSpread:
        """The rubric's number of a spread; off a sheet, with the errors of measuring the vector by hand."""
        hand = self.task.rubric.hand
        if not self.evidence.has_sheets:
            turned = abs(along) * math.radians(hand.protractor_deg)
            end = EndSpread(math.hypot(end.along, hand.ruler_mm), math.hypot(end.across, turned))
        return EndSpread(hand.sigmas * end.along, hand.sigmas * end.across)

    # From lengths and values ----------------------------------------------------------------------

    def nodes_instead(self) -> Mapping[str, complex]:
        """The nodes by another mechanism that was certainly drawn, and whose sketch was not handed in."""
        basis = None if self.evidence.has_sketch else self.instead
        if basis is None or MECHANISM not in basis.wrong:
            return {}
        return {name: node.at for name, node in self.traced(self.followed, basis).made.items()}

    def is_trivial(self, segment: TaskSegment, expected: complex) -> bool:
        """Return whether an expectation is near zero, unsolvable, or far shorter than the right vector."""
        if not cmath.isfinite(expected):
            return True
        rubric = self.task.rubric
        right = min(abs(segment.drawn(one)) for one in (self.used, self.followed))
        least = min(rubric.tolerance_of(segment.name).least_mm, right / 2.0)
        return abs(expected) < max(least, rubric.least_followed_share * right)

    def turned_plan(self, segment: TaskSegment) -> Iterator[Expectation]:
        """The vector in a plan that is turned as a whole by quarter turns, as the crank's vector is."""
        crank, basis = self.task.driving_vector(segment.name), self.turned_basis(segment.name)
        if basis is not None and segment.head not in basis.wrong:
            quarters = basis.quarters
            turned = segment.drawn(self.followed) * 1j**quarters
            uncertainty = self.uncertainty_of(segment, turned)
            yield Expectation(turned, "vector", crank, basis.wrong, uncertainty, causes=basis.wrong)
            one = self.from_nodes(segment, self.followed, basis)
            yield replace(one, what="vector", of=crank, causes=basis.wrong)

    def turned_basis(self, name: str) -> PlanBasis | None:
        """Return a vector's plan turned whole like the driving link's vector, None where that is right."""
        crank = self.task.driving_vector(name)
        return self._cached(("turned", crank), lambda: self._turned_basis(crank))

    def _turned_basis(self, crank: str) -> PlanBasis | None:
        task, own = self.task, self.evidence.vector(crank)
        if own is None or own.direction_rad is None or not task.real.get(crank):
            return None
        turn = math.remainder(own.direction_rad - cmath.phase(task.real[crank]), math.tau)
        quarters = round(turn / (math.pi / 2.0))
        tolerance = task.rubric.tolerance_of(crank)
        slack = math.radians(tolerance.direction_deg * tolerance.farthest)
        if not quarters or abs(turn - quarters * math.pi / 2.0) > slack:
            return None
        head = task.construction.vectors[crank].head
        figure, right = task.construction.figure_of(head), self.right(self.followed)
        mistake = Mistake("figure_rotated", figure, quarters=quarters % 4)
        drawing = commit(mistake, Drawing(right.construction, right.parameters))
        name, wrong = f"{figure} {quarters}", frozenset({self.first_node(figure)})
        basis = PlanBasis(name, drawing.construction, right.parameters, wrong, quarters=quarters)
        return basis if self._explains_more(figure, basis) else None

    def _explains_more(self, figure: str, basis: PlanBasis) -> bool:
        """Return whether a basis makes every node of the plan that the right construction makes, and more."""
        own = self.own(self.followed).get(figure, {})
        turned, right = self.traced(self.followed, basis), self.traced(self.followed)
        made = {node for node in own if self._makes(node, turned)}
        return made > {node for node in own if self._makes(node, right)}

    # At the end of a wrong line ----------------------------------------------------------------------

    def on_own_line(self, segment: TaskSegment) -> Expectation | None:
        """The vector as far as its own line reaches to the student's node, where another line is wrong.

        None for a vector that is not on a line of its head's step, or whose direction is not known.
        """
        construction, own = self.task.construction, self.evidence.vector(segment.name)
        drawn = None if own is None else own.as_complex
        line = line_of(construction.vectors[segment.name], construction)
        if drawn is None or line is None or not isinstance(construction.step(segment.head), TwoLines):
            return None
        made, nodes = self.from_nodes(segment, self.followed), self.traced(self.followed).nodes
        view = View(
            {name: np.asarray(one.at) for name, one in nodes.items()}, self.right(self.followed).parameters
        )
        along = complex(line.along.at(view))
        vector = along * (drawn * along.conjugate()).real
        return replace(made, vector=vector, causes=frozenset({segment.head}))

    def starts_elsewhere(self, segment: TaskSegment, own: DrawnVector) -> bool:
        """Return whether a vector runs to its own head from the start of the component before it."""
        step, nodes = self.task.construction.step(segment.tail), self.traced(self.followed).nodes
        if not isinstance(step, Given):
            return False
        table, head = self.task.rubric.tolerance_of(segment.name), nodes[segment.head].at
        whole, part = head - nodes[step.start].at, head - nodes[segment.tail].at
        return fits(own, whole, table) and not fits(own, part, table)

    def between_own_nodes(self, segment: TaskSegment) -> Expectation | None:
        """The vector between the student's own nodes, for one that joins what other vectors have made."""
        construction, own = self.task.construction, self.own(self.followed)
        if not self._joins(segment):
            return None
        nodes = {name: node for figure in construction.poles for name, node in own.get(figure, {}).items()}
        nodes |= {pole: OwnNode(0j) for pole in construction.poles.values()}
        if segment.head not in nodes or segment.tail not in nodes:
            return None
        vector = nodes[segment.head].at - nodes[segment.tail].at
        made = self.from_nodes(segment, self.followed)
        return replace(made, vector=vector, causes=frozenset({segment.head}))

    def _joins(self, segment: TaskSegment) -> bool:
        """Return whether a vector joins nodes that other vectors have made."""
        construction, step = self.task.construction, self.task.construction.step(segment.head)
        if isinstance(step, Given):
            return laid_off(step, construction) != segment.name
        return line_of(construction.vectors[segment.name], construction) is None

    def causes_at(self, node: str, wrong: frozenset[str], *, only_sense: bool = False) -> frozenset[str]:
        """The causes of an own node's position beside the student's own earlier nodes.

        None where its step leads there; wrong scales, the first node of a turned plan, or wrong steps or
        forces that lead there; the node itself where no known way does.

        Arguments: `wrong` as in `own_forces`; with `only_sense` a step lays the node off to the same side.
        """
        makes, own = self._lays_off if only_sense else self._makes, self.own_forces(node, wrong)

        def found() -> frozenset[str]:
            for causes, scales, basis, by_similarity in self._ways(node):
                if makes(node, self.traced(scales, basis, by_similarity=by_similarity)):
                    return causes
            is_of_forces = own is not None and makes(node, self.traced(self.followed, own))
            return own.wrong | self.wrong_scales if own and is_of_forces else frozenset({node})

        return self._cached(("causes", node, only_sense, own and own.name), found)

    def _ways(
        self, node: str
    ) -> Iterator[tuple[frozenset[str], Mapping[str, float], PlanBasis | None, bool]]:
        """The ways to make a node: their causes, scales and basis, and whether images are by similarity."""
        construction, wrong = self.task.construction, self.wrong_scales
        figure = construction.figure_of(node)
        yield frozenset(), self.used, None, False
        if wrong:
            yield wrong, self.followed, None, False
        if node in construction.images:
            yield wrong, self.followed, None, True
        if figure in construction.poles:
            turned = self.turned_basis(construction.vectors_of(figure)[0].name)
            if turned is not None and node not in turned.wrong:
                yield turned.wrong | wrong, self.followed, turned, False
            basis = self.instead
            if basis is not None and node not in basis.wrong:
                yield self.causes_of(node, basis) | wrong, self.followed, basis, False

    def _lays_off(self, node: str, traced: TracedDrawing) -> bool:
        """Return whether a drawing lays a node off to the student's side; a short one may lie on either."""
        step = self.task.construction.step(node)
        start = traced.nodes[step.start].at if isinstance(step, Given) else 0j
        own, made = traced.nodes[node].at - start, traced.made[node].at - start
        return abs(own) < self.task.tolerance_at(node).least_mm or dot(own, made) > 0.0

    def _makes(self, node: str, traced: TracedDrawing) -> bool:
        """Return whether a drawing puts a node where the student has it, by tolerance or drafting errors."""
        made, own = traced.made[node], traced.nodes[node]
        residual = own.at - made.at
        if not cmath.isfinite(residual):
            return False
        exact = self.task.nodes(self.used)[node]
        if abs(residual) <= self.task.tolerance_at(node).length_at(abs(exact)):
            return True
        count = traced.drafting_count
        shifts = np.concatenate((made.shifts[:count], (own.shifts - made.shifts)[count:]))
        return abs(residual) <= self.task.rubric.hand.sigmas * spread(shifts, residual).along

    def uncertainty_of(self, segment: TaskSegment, along: complex) -> EndSpread:
        """The propagated drafting error of a vector since the start of the drawing."""
        scales = (scale for name, scale in self.used.items() if name != "kL")
        key = ("reach", segment.name, abs(along), cmath.phase(along), *scales, self.evidence.has_sheets)

        def found() -> EndSpread:
            shifts = self.task.traced(self.used).shifts(segment.tail, segment.head)
            turned = shifts * np.exp(1j * (cmath.phase(along) - cmath.phase(segment.real)))
            return self.by_hand(spread(turned, along), along)

        return self.task.cached(key, found)

    def from_vectors(self, segment: TaskSegment, scales: Mapping[str, float]) -> Iterator[Expectation]:
        """A vector that depends on one or two others alone, whose lengths are enough."""
        task = self.task
        match task.construction.step(segment.head):
            case Given(length=Balance(moments=moments) as length, along=line) as step:
                moments, heads = self._as_laid_off(moments)
                length = replace(length, moments=moments)
                if heads and step.start == segment.tail:
                    yield self._evaluated(
                        lambda view: length.at(view) * line.at(view), (*length.needs, *line.needs), heads
                    )
            case Given(length=Normal(tail=tail, head=head)):
                yield from self.normal(segment, self.named(tail, head), scales)
            case Given(length=Coriolis() as length):
                yield from self.coriolis(segment, length, scales)
            case Divide(base=base) | Similar(base=base) if segment.tail in base:
                pole, other = base if segment.tail == base[0] else base[::-1]
                source = self.named(pole, other)
                own = None if source is None else self.evidence.vector(source)
                if source is not None and own is not None and task.real[source]:
                    along = own.direction_rad
                    phase = cmath.phase(task.real[source]) if along is None else along
                    found = cmath.rect(own.length_mm, phase) * (segment.real / task.real[source])
                    yield Expectation(found, "vector", source, frozenset({other}))

    def taken_over(self, segment: TaskSegment, wrong: frozenset[str]) -> Iterator[Expectation]:
        """A vector taken over, also from a plan at another scale: the one followed, or of wrong forces."""
        task, step = self.task, self.task.construction.step(segment.head)
        if not isinstance(step, Given) or not isinstance(same := step.length, Same):
            return
        source, head = self.named(same.tail, same.head), same.head
        forces, shares = self._wrong_forces(head, wrong), list[tuple[float, frozenset[str]]]()
        own = self.evidence.vector(source or "")
        for one in task.construction.vectors_of(task.construction.figure_of(head)):
            drawn, due_mm = self.evidence.vector(one.name), abs(task.segments[one.name].drawn(self.used))
            if one.name in forces and drawn and drawn.length_mm and due_mm:
                shares.append((due_mm / drawn.length_mm, frozenset({one.head})))
        other = self.followed[segment.scale] / self.used[segment.scale]
        shares += [(share, self.wrong_scales) for share in (other, 1.0 / other) if other != 1.0]
        if own is not None and own.as_complex is not None:
            for share, causes in ((1.0, frozenset[str]()), *shares):
                found = own.as_complex * 1j**step.along.quarters * share
                yield Expectation(found, "vector", source or "", frozenset({head}), causes=causes)

    def joined(self, segment: TaskSegment, wrong: frozenset[str]) -> Iterator[Expectation]:
        """The sum of measured vectors from tail to head of one that joins nodes that they have made.

        Arguments: at `wrong` nodes a vector may have been left out.
        """
        construction, hand = self.task.construction, self.task.rubric.hand
        if self.evidence.has_sheets or not self._joins(segment):
            return
        own = [
            (one, drawn.as_complex if drawn else 0j if one.head in wrong else None)
            for one in construction.vectors.values()
            for drawn in (self.evidence.vector(one.name),)
            if one.name != segment.name
        ]
        # Those that were left out come last.
        own.sort(key=lambda pair: pair[1] == 0j)
        ways: dict[str, tuple[tuple[str, complex], ...]] = {segment.tail: ()}
        for node in (queue := [segment.tail]):
            for one, vector in own:
                end = one.head if node == one.tail else one.tail
                if vector is not None and node in {one.tail, one.head} and end not in ways:
                    ways[end] = (*ways[node], (one.head, vector if node == one.tail else -vector))
                    queue.append(end)
        if way := ways.get(segment.head):
            parts, heads = np.array([vector for _, vector in way]), {head for head, _ in way}
            upstream = frozenset[str]().union(*map(construction.upstream, heads))
            relies_on = (upstream & known(self.own(self.used))) | heads
            along = hand.ruler_mm * np.exp(1j * np.angle(parts))
            shifts = np.concatenate((along, 1j * parts * math.radians(hand.protractor_deg)))
            found = complex(parts.sum())
            yield Expectation(found, "nodes", "", relies_on, *self.spreads(shifts, len(shifts), found))

    def normal(
        self, segment: TaskSegment, source: str | None, scales: Mapping[str, float]
    ) -> Iterator[Expectation]:
        """v^2 / l from the own velocity; omega^2 l from the own computed angular velocity."""
        task, right = self.task, segment.drawn(scales)
        if source is None:
            return
        if (share := self.own_share(source, scales)) is not None:
            head = task.construction.vectors[source].head
            yield Expectation(right * share**2, "vector", source, frozenset({head}))
        rate = next((one for one in task.construction.rates.values() if one.vector == source), None)
        if rate is not None and (turned := self.own_turn(rate)) is not None:
            yield Expectation(right * turned**2, "value", rate.name, frozenset({rate.name}))

    def coriolis(
        self, segment: TaskSegment, length: Coriolis, scales: Mapping[str, float]
    ) -> Iterator[Expectation]:
        """2 omega v from the own sliding velocity and the guide's own velocity or computed omega.

        Each counts as its ratio to the right one, with its sense.
        """
        vectors, right = self.task.construction.vectors, segment.drawn(scales)
        slide = self.named(*length.slide)
        rate = self.task.construction.rates.get(f"omega_{vectors[segment.name].turning}")
        sources = [one for one in (slide, rate.vector if rate else None) if one is not None]
        shares = {one: share for one in sources if (share := self.own_share(one, scales)) is not None}
        if shares:
            farthest = max(shares, key=lambda one: abs(shares[one] - 1.0))
            relies_on = frozenset(vectors[one].head for one in shares)
            sizes, own = [right * math.prod(shares.values())], self.evidence.vector(slide) if slide else None
            if slide and own and own.direction_rad is not None:
                # Across the own sliding velocity, wherever that points.
                turn = own.direction_rad - cmath.phase(self.task.real[slide] * shares.get(slide, 1.0))
                sizes.append(sizes[0] * cmath.rect(1.0, turn))
            if rate is not None and self.turns_neither_way(rate.vector):
                sizes += [-size for size in sizes]
            for size in sizes:
                yield Expectation(size, "vector", farthest, relies_on)
        if rate is not None and (turned := self.own_turn(rate)) is not None:
            slid = {one: share for one, share in shares.items() if one == slide}
            relies_on = frozenset({rate.name, *(vectors[one].head for one in slid)})
            yield Expectation(right * turned * math.prod(slid.values()), "value", rate.name, relies_on)

    def own_share(self, name: str, scales: Mapping[str, float]) -> float | None:
        """The student's own velocity as a share of the right one, negative where it is reversed."""
        own, right = self.evidence.vector(name), self.task.real[name]
        if own is None or not right:
            return None
        share = own.length_mm * scales[self.task.segments[name].scale] / abs(right)
        if own.direction_rad is None:
            return share
        return math.copysign(share, math.cos(own.direction_rad - cmath.phase(right)))

    def turns_neither_way(self, name: str) -> bool:
        """Return whether a vector lies so near its link's direction that it turns that no way."""
        own, right = self.evidence.vector(name), self.task.real[name]
        if own is None or own.direction_rad is None:
            return False
        return abs(math.cos(own.direction_rad - cmath.phase(right))) < LEAST_ACROSS

    def own_turn(self, rate: AngularRate) -> float | None:
        """The student's own computed angular velocity as a share of the right one."""
        own, right = self.evidence.values.get(rate.name), self.task.rates[rate.name]
        if own is None or not right or abs(own) > _MOST_SHARE * abs(right):
            return None
        return own / right

    def named(self, tail: str, head: str) -> str | None:
        """The vector from one node to another, either way round; None where it has no name."""
        ends = {tail, head}
        vectors = self.task.construction.vectors.values()
        return next((v.name for v in vectors if {v.tail, v.head} == ends), None)
