"""The student's own nodes, from the sheet or from measured lengths, and the mechanism they belong to."""

import cmath
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import TypeGuard

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.task import Task
from grader.records import MECHANISM
from grader.rubric import ToleranceTable
from reference.construction.elements import Normal, Parameters, View, is_computed, is_force
from reference.construction.graph import AngularRate, Construction, Vector, evaluate
from reference.construction.steps import ArcAndLine, Given, Step, TwoArcs
from reference.construction.uncertainty import OwnNode
from reference.geometry import ComplexArray, FloatArray


@dataclass(frozen=True, slots=True)
class PlanBasis:
    """A construction with its parameters from which plans may have been drawn, under a name of its own.

    Attributes
    ----------
    wrong : the nodes whose steps are wrong ones, or the mechanism
    lines : the vectors on the wrong lines of those steps
    quarters : by which its plan is turned as a whole, counter-clockwise
    """

    name: str
    construction: Construction
    parameters: Parameters
    wrong: frozenset[str] = frozenset({MECHANISM})
    lines: frozenset[str] = frozenset()
    quarters: int = 0

    def blames(self, vector: str, head: str) -> bool:
        """Return whether the mistake was made in this vector, which ends at the node `head`."""
        if head not in self.wrong:
            return False
        on_lines = {name for name in self.lines if self.construction.vectors[name].head == head}
        return vector in on_lines or not on_lines


Nodes = Mapping[str, Mapping[str, OwnNode]]
"""By figure and node."""


def own_nodes(task: Task, evidence: Evidence, sketch: PlanBasis) -> Nodes:
    """The student's own nodes by figure, without poles; `sketch` places nodes measured by lengths."""
    if evidence.has_sheets:
        return _from_sheets(task, evidence)
    if evidence.measured:
        return _by_figure(task, nodes_from_lengths(task, evidence, sketch))
    return {}


def _from_sheets(task: Task, evidence: Evidence) -> Nodes:
    """The nodes as read; a plan has the sketch that is beside it."""
    names = [name for name in evidence.nodes if name not in task.construction.poles.values()]
    shifts = {name: np.zeros(2 * len(names), np.complex128) for name in names}
    for column, name in enumerate(names):
        shifts[name][2 * column : 2 * column + 2] = evidence.se_mm.get(name, 0.0) * np.array([1.0, 1j])
    positions = {name: OwnNode(evidence.nodes[name], shifts[name]) for name in names}
    found = dict(_by_figure(task, positions))
    for plan, joints in evidence.sketches.items():
        sketch = {name: OwnNode(place, shifts.get(name)) for name, place in joints.items()}
        found[plan] = {**found.get(plan, {}), **sketch}
    return found


def _by_figure(task: Task, positions: Mapping[str, OwnNode]) -> dict[str, dict[str, OwnNode]]:
    found: dict[str, dict[str, OwnNode]] = {}
    for name, place in positions.items():
        found.setdefault(task.construction.figure_of(name), {})[name] = place
    return found


def known(nodes: Nodes) -> frozenset[str]:
    """The names of all own nodes."""
    return frozenset(name for positions in nodes.values() for name in positions)


# From measured lengths -----------------------------------------------------------------------------

LEAST_SINE = 0.2
"""Least sine of the angle at which two lengths meet; in a flatter triangle the corner lies on the base."""
GAP_MM = 3.0
"""Largest gap between two lengths that should meet, from errors of drawing and measuring."""
BRANCHES = 32
"""Explanations that are continued."""
COST_WINDOW = 26.0
"""Explanations that cost more than the cheapest by two unexpected nodes and a little are dropped."""
UNKNOWN = 1.0
"""Cost of a node that is taken as not known."""
AS_EXPECTED = 3.0
"""Standard deviations within which a node lies where its step puts it."""
UNEXPECTED = 12.0
"""Cost of a node that lies elsewhere; the most that one length adds."""
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True, slots=True)
class _Measured:
    """A measured vector that ends in a node."""

    vector: Vector
    drawn: DrawnVector


def nodes_from_lengths(task: Task, evidence: Evidence, sketch: PlanBasis) -> dict[str, OwnNode]:
    """The nodes that measured vectors determine, with the errors of measuring them."""
    tracking = _LengthBranches(task, evidence.measured)
    view = View(tracking.nodes, sketch.parameters)
    poles = task.construction.poles.values()
    with np.errstate(all="ignore"):
        for step in sketch.construction.steps:
            ends = tracking.ends.get(step.node, [])
            image = sketch.construction.images.get(step.node, step)
            ways = [step] if image == step else [step, image]
            made = [np.asarray(way.place(view)) + np.zeros(len(tracking.cost)) for way in ways]
            if ends:
                tracking.settle(step, made, ends)
            elif _is_component(step) and step.node not in poles and tracking.may_be_missed(step, made[0]):
                tracking.guessed[step.node] = step.start
                tracking.part(step.node, [tracking.nodes[step.start]], made, [], [])
            else:
                tracking.nodes[step.node] = made[0]
    return tracking.best()


@dataclass(slots=True)
class _LengthBranches:
    """All explanations so far, arrays of shape (branches,).

    Attributes
    ----------
    ends : the measured vectors by the node where they end
    cost : as in `reference.replay.explanations`
    sources : by node, the vectors from which its position was taken
    is_known : by node, whether its position was taken from vectors
    guessed : components that were not entered, left out of the drawing or drawn rightly, and their starts
    """

    task: Task
    measured: Mapping[str, DrawnVector]
    ends: dict[str, list[_Measured]] = field(default_factory=dict)
    nodes: dict[str, ComplexArray] = field(default_factory=dict)
    cost: FloatArray = field(default_factory=lambda: np.zeros(1))
    sources: dict[str, Sequence[_Measured]] = field(default_factory=dict)
    is_known: dict[str, BoolArray] = field(default_factory=dict)
    guessed: dict[str, str] = field(default_factory=dict)

    def __post_init__(self) -> None:
        vectors = self.task.construction.vectors
        for name, drawn in self.measured.items():
            if name in vectors:
                self.ends.setdefault(vectors[name].head, []).append(_Measured(vectors[name], drawn))

    @property
    def sigma_mm(self) -> float:
        """A rough standard error of a node by drawing and measuring: half the tolerance."""
        return self.task.rubric.tolerance.length_mm / 2.0

    def may_be_missed(self, step: Given, made: ComplexArray) -> bool:
        """Return whether a component is so long that lengths tell whether it was left out."""
        size = np.abs(made - self.nodes[step.start])
        return bool(np.any(size > AS_EXPECTED * self.sigma_mm))

    def settle(self, step: Step, made: Sequence[ComplexArray], ends: Sequence[_Measured]) -> None:
        """Place a node in each branch; branches divide where its lengths admit several positions.

        Arguments: `made` is where its step puts it, and where similar triangles would.
        """
        directed = [one for one in ends if one.drawn.direction_rad is not None]
        if directed:
            directed.sort(key=lambda one: one.vector.tail in self.guessed)
            self.direct(step.node, made, directed)
        elif len(ends) == 1:
            positions = [place for one in made for place in self._along(step, one, ends[0])]
            self.part(step.node, positions, made, ends, ends)
        else:
            pair, positions = self._meeting(ends)
            self.part(step.node, positions, made, pair, ends)

    def direct(self, node: str, made: Sequence[ComplexArray], ends: Sequence[_Measured]) -> None:
        """Place a node at the end of a vector with a direction; branches divide where several end apart.

        One that points the opposite way from where another ends comes last. Branches in which its step or the
        other vectors put it elsewhere cost more.
        """
        tails, drawn = (
            [self.nodes[one.vector.tail] for one in ends],
            [one.drawn.as_complex or 0j for one in ends],
        )
        positions = [tail + vector for tail, vector in zip(tails, drawn, strict=True)]
        back, near = tails[0] - drawn[0], AS_EXPECTED * self.sigma_mm
        is_back = [float(np.abs(back - place).min()) <= near < abs(drawn[0]) for place in positions]
        apart = list[ComplexArray]()
        for _, place, one in sorted(zip(is_back, positions, ends, strict=True), key=lambda each: not each[0]):
            is_apart = all(float(np.abs(place - other).max()) > near for other in apart)
            if is_apart and not (apart and one.vector.tail in self.guessed):
                apart.append(place)
        index = np.tile(np.arange(len(self.cost)), len(apart))
        every = np.concatenate(apart)
        residuals = [_nearest([one[index] for one in made], every)]
        for one, place, vector in zip(ends, positions, drawn, strict=True):
            # A vector that should follow a component may have been drawn from the start of that.
            step = self.task.construction.step(one.vector.tail)
            start = step.start if isinstance(step, Given) else one.vector.tail
            elsewhere = np.abs(self.nodes[start][index] + vector - every)
            residuals.append(np.fmin(np.abs(place[index] - every), elsewhere))
        total = self.cost[index] + self._apart(residuals)
        self._continue(node, every, total, index, np.ones(len(index), np.bool_))
        self.sources[node] = ends

    def _apart(self, residuals: Sequence[FloatArray]) -> FloatArray:
        """The cost of distances at which a node's step and vectors put it elsewhere."""
        squared = (np.array(residuals) / self.sigma_mm) ** 2
        return np.asarray(np.where(squared <= AS_EXPECTED**2, squared, UNEXPECTED).sum(axis=0))

    def _along(self, step: Step, made: ComplexArray, one: _Measured) -> list[ComplexArray]:
        """Positions at one length along the step's direction; for components laid off, also reversed."""
        start = self.nodes[one.vector.tail]
        step_vector = made - start
        along = np.where(np.abs(step_vector) > 1e-9, step_vector / np.abs(step_vector), np.nan)
        senses = (1.0, -1.0) if isinstance(step, Given) else (1.0,)
        return [start + sense * one.drawn.length_mm * along for sense in senses]

    def _meeting(self, ends: Sequence[_Measured]) -> tuple[Sequence[_Measured], list[ComplexArray]]:
        """The pair of lengths that cross at the best angle, and the two points where they meet."""
        pairs = [(one, other) for index, one in enumerate(ends) for other in ends[:index]]
        crossings = [_crossing(self.nodes, pair) for pair in pairs]
        best = max(range(len(pairs)), key=lambda index: float(np.nan_to_num(crossings[index][2]).min()))
        first, second, _ = crossings[best]
        return pairs[best], [first, second]

    def part(
        self,
        node: str,
        positions: Sequence[ComplexArray],
        made: Sequence[ComplexArray],
        sources: Sequence[_Measured],
        ends: Sequence[_Measured],
    ) -> None:
        """Continue with each position and, where none is as expected, with the one that the step gives."""
        count, ways = len(self.cost), len(positions) + 1
        every, index = np.concatenate([*positions, made[0]]), np.tile(np.arange(count), ways)
        is_known = np.arange(len(index)) < count * len(positions)
        residual = _nearest([one[index] for one in made], every) / self.sigma_mm
        is_expected = residual <= AS_EXPECTED
        total = (
            self.cost[index]
            + np.where(is_expected, residual**2, UNEXPECTED)
            + np.where(is_known, 0.0, UNKNOWN)
        )
        for one in ends:
            length = np.abs(every - self.nodes[one.vector.tail][index])
            total += np.minimum(((length - one.drawn.length_mm) / self.sigma_mm) ** 2, UNEXPECTED)
        found = np.asarray((is_expected & is_known).reshape(ways, count).any(axis=0))
        total = np.where(np.isfinite(total) & (is_known | ~found[index]), total, np.inf)
        self._continue(node, every, total, index, is_known)
        self.sources[node] = sources

    def _continue(
        self, node: str, every: ComplexArray, total: FloatArray, index: IntArray, is_known: BoolArray
    ) -> None:
        """Continue with the cheapest of all places of a node, each in the branch of its index."""
        order = np.argsort(total, kind="stable")[:BRANCHES]
        order = order[(total[order] < total[order[0]] + COST_WINDOW) | (np.arange(len(order)) == 0)]
        self.take(index[order])
        self.cost, self.nodes[node], self.is_known[node] = total[order], every[order], is_known[order]

    def take(self, index: IntArray) -> None:
        """Keep these branches, in this order."""
        for name, positions in self.nodes.items():
            self.nodes[name] = positions[index]
        for name, flags in self.is_known.items():
            self.is_known[name] = flags[index]

    def best(self) -> dict[str, OwnNode]:
        """The nodes that are known in the cheapest explanation."""
        self.take(np.argsort(self.cost, kind="stable")[:1])
        columns = {name: 2 * index for index, name in enumerate(self.measured)}
        found: dict[str, OwnNode] = {}
        shifts: dict[str, ComplexArray] = {
            pole: np.zeros(2 * len(columns), np.complex128) for pole in self.task.construction.poles.values()
        }
        for name, sources in self.sources.items():
            place = complex(self.nodes[name][0])
            sources = self._taken(sources, place)  # noqa: PLW2901 - those of them that count
            tails = [one.vector.tail for one in sources] or [self.guessed[name]]
            if self.is_known[name][0] and shifts.keys() >= set(tails):
                shifts[name] = self._shifts(place, sources, columns, shifts) if sources else shifts[tails[0]]
                found[name] = OwnNode(place, shifts[name])
        return found

    def _taken(self, ends: Sequence[_Measured], place: complex) -> Sequence[_Measured]:
        """Return the vectors from which a place was taken: all lengths, or the first that points there."""
        for one in ends:
            vector, tail = one.drawn.as_complex, complex(self.nodes[one.vector.tail][0])
            if vector is not None and abs(tail + vector - place) <= AS_EXPECTED * self.sigma_mm:
                return [one]
        return ends

    def _shifts(
        self,
        place: complex,
        sources: Sequence[_Measured],
        columns: Mapping[str, int],
        shifts: Mapping[str, ComplexArray],
    ) -> ComplexArray:
        """Return the shift of a node by one standard deviation of each measurement, complex mm."""
        hand = self.task.rubric.hand
        rows = []
        for one in sources:
            step_vector = place - complex(self.nodes[one.vector.tail][0])
            along = step_vector / abs(step_vector) if abs(step_vector) > 0.0 else 1.0 + 0j
            row = np.array(shifts[one.vector.tail])
            column = columns[one.vector.name]
            row[column] += hand.ruler_mm * along
            rows.append((along, row, column, step_vector))
        if len(rows) == 1:
            along, row, column, step_vector = rows[0]
            # Across: the error of the direction, measured or drawn.
            deg = hand.protractor_deg if sources[0].drawn.direction_rad is not None else hand.angle_deg
            row[column + 1] += 1j * step_vector * math.radians(deg)
            return row
        (u, first, _, p), (v, second, column, q) = rows
        # |x - p| and |x - q| are given: u.dx = u.dp + dr, v.dx = v.dq + ds.
        r, s = (first * np.conj(u)).real, (second * np.conj(v)).real
        cross = (np.conj(u) * v).imag
        if abs(cross) >= LEAST_SINE:
            return np.asarray((1j * (u * s - v * r)) / cross)
        apart = max(abs(p - q), 1e-9)
        across = 1j * u * math.sqrt(2.0 * hand.ruler_mm * abs(p) * abs(q) / apart)
        row = np.asarray(u * r)
        row[column + 1] += across
        return row


def _nearest(made: Sequence[ComplexArray], place: ComplexArray) -> FloatArray:
    """The distances to the nearest of the places where a node may have been made, mm."""
    return np.asarray(np.fmin.reduce([np.abs(one - place) for one in made]))


def _is_component(step: Step) -> TypeGuard[Given]:
    """Return whether a step lays off a component or a force: it may be missing, or reversed."""
    return isinstance(step, Given) and (is_computed(step.length) or is_force(step.length))


def _crossing(
    nodes: Mapping[str, ComplexArray], pair: tuple[_Measured, _Measured]
) -> tuple[ComplexArray, ComplexArray, FloatArray]:
    """Both points at two distances from two nodes, and the sine of the angle between them there.

    Of a flat triangle both are the same, on the line; two lengths that do not meet have none (nan).
    """
    (p, r), (q, s) = ((nodes[one.vector.tail], one.drawn.length_mm) for one in pair)
    base = q - p
    distance = np.abs(base)
    along = 0.5 + 0.5 * (r - s) * (r + s) / distance**2
    across2 = (r / distance) ** 2 - along**2
    across = np.sqrt(np.maximum(across2, 0.0))
    sine = across * distance**2 / (r * s) if r and s else 0.0 * across
    is_flat = sine < LEAST_SINE
    gap_mm = np.maximum(np.maximum(distance - r - s, np.abs(r - s) - distance), 0.0)
    across = np.where(is_flat, 0.0, across)
    base = np.where(gap_mm > GAP_MM, np.nan, base)
    return p + base * (along + 1j * across), p + base * (along - 1j * across), sine


# A link's own angular rate -------------------------------------------------------------------------


def own_length(task: Task, evidence: Evidence, rate: AngularRate) -> float:
    """The real length of a rate's link, m: on the student's own sketch where it must be measured there.

    That is the distance of a slotted link's point; all other links' lengths are among the data.
    """
    tail, head = (evidence.nodes.get(joint) for joint in rate.link)
    lengths = (step.length for step in task.construction.steps if isinstance(step, Given))
    is_given = not any(isinstance(one, Normal) and one.measured == rate.link for one in lengths)
    if is_given or tail is None or head is None or task.yardstick is None or evidence.yardstick_mm is None:
        return task.lengths_m[rate.name]
    return abs(head - tail) * task.yardstick.length_m / evidence.yardstick_mm[0]


def own_rate(
    task: Task, evidence: Evidence, rate: AngularRate, scale: float, instead: Mapping[str, complex]
) -> float | None:
    """The angular rate that the student's own vector gives; None without one.

    It turns its link as that was drawn, where it was read. Where the vector's direction is not known, the
    sense is the right one's, or that of another mechanism.

    Arguments: `scale` is the vector's, real units per drawn millimetre; `instead` are the nodes of another
    mechanism that was certainly drawn and not handed in.
    """
    own, along = evidence.vector(rate.vector), task.real[rate.vector]
    if own is None:
        return None
    vector, direction, right = (
        task.construction.vectors[rate.vector],
        own.direction_rad,
        task.rates[rate.name],
    )
    joints = instead or evidence.sketches.get(task.construction.figure_of(vector.head), evidence.nodes)
    tail, head = (joints.get(joint) for joint in rate.link)
    if direction is None and instead:
        direction = cmath.phase(instead[vector.head] - instead[vector.tail])
    sense = right
    if direction is not None and tail is not None and head is not None:
        sense = math.sin(direction - cmath.phase(head - tail))
    elif direction is not None and along:
        sense = math.copysign(1.0, right) * math.cos(direction - cmath.phase(along))
    return math.copysign(own.length_mm * scale / own_length(task, evidence, rate), sense)


# Another mechanism that the vectors fit ------------------------------------------------------------

BETTER_BY = 3
"""Number of vectors that a wrong mechanism must explain beyond those of the right one."""
LEAST_SHARE = 0.6
"""Least share of the measured vectors that it explains."""


def other_mechanism(
    task: Task, evidence: Evidence, scales: tuple[Mapping[str, float], Mapping[str, float]]
) -> PlanBasis | None:
    """The wrong assembly for which the vectors were drawn; None where the right one explains them.

    Arguments: `scales` are those used, and those that the drawing seems to follow.
    """
    known = {name: drawn for name in task.real if (drawn := evidence.vector(name)) is not None}
    if evidence.has_sketch or len(known) < BETTER_BY:
        return None
    each = [scales[0]] if scales[0] == scales[1] else list(scales)
    tried = [one for scale in each for one in _tried(task, scale)]
    counted = [(basis, _fitting(task, vectors, known)) for basis, vectors in tried]
    right = max(count for basis, count in counted if basis.construction is task.construction)
    least, best = max(right + BETTER_BY, math.ceil(LEAST_SHARE * len(known))), None
    for basis, count in counted:
        if basis.construction is not task.construction and count >= least:
            best, least = basis, count + 1
    return best


def _tried(task: Task, scales: Mapping[str, float]) -> list[tuple[PlanBasis, Mapping[str, complex]]]:
    """The right mechanism and every wrong assembly, each with its vectors, complex millimetres by name."""
    key = ("plans", *scales.values())

    def tried() -> list[tuple[PlanBasis, Mapping[str, complex]]]:
        known = task.at(scales)
        others = [
            task.construction.with_step(replace(step, side=-step.side))
            for step in task.construction.figures[MECHANISM]
            if isinstance(step, TwoArcs | ArcAndLine)
        ]
        return [
            (PlanBasis("other", one, known), _vectors(one, known)) for one in (task.construction, *others)
        ]

    return task.cached(key, tried)


def _vectors(construction: Construction, parameters: Parameters) -> dict[str, complex]:
    nodes = evaluate(construction, parameters)
    return {
        one.name: complex(np.ravel(nodes[one.head] - nodes[one.tail])[0])
        for one in construction.vectors.values()
    }


def _fitting(task: Task, vectors: Mapping[str, complex], known: Mapping[str, DrawnVector]) -> int:
    """Count the vectors that lie within twice their tolerance."""
    return sum(fits(drawn, vectors[name], task.rubric.tolerance_of(name)) for name, drawn in known.items())


def fits(drawn: DrawnVector, exact: complex, table: ToleranceTable) -> bool:
    """Return whether a measured vector is another, mm, up to twice its tolerances."""
    size = abs(exact)
    if not abs(size - drawn.length_mm) <= 2.0 * table.length_at(size):
        return False
    if drawn.direction_rad is None:
        return True
    across = table.across_mm / max(size, 1e-9)
    turned = abs(math.remainder(cmath.phase(exact) - drawn.direction_rad, math.tau))
    return turned <= 2.0 * max(math.radians(table.direction_deg), across)
