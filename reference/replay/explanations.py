"""What one step of a drawing may have been: the right step, a known mistake, a slip, something else.

Each explanation has a cost, -2 log of its probability up to a constant: the squared residual of the
drawn node, with its covariance, and for each mistake how rare it is.
"""

import math
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from reference import geometry
from reference.construction.elements import Coriolis, Errors, Normal, View
from reference.construction.graph import Construction
from reference.construction.mistakes import Mistake, changed_step, mistakes_of_step
from reference.construction.steps import Given, Step, TwoLines
from reference.construction.uncertainty import SMALL, Skill, step_errors
from reference.geometry import ComplexArray, FloatArray
from reference.numbers import dot

RARITY: Mapping[str, float] = {
    "parallel_for_perpendicular": 13.0,
    "wrong_link": 15.0,
    "sense_reversed": 12.0,
    "normal_reversed": 12.0,
    "normal_missing": 12.0,
    "normal_from_absolute": 12.5,
    "wrong_intersection": 14.0,
    "image_mirrored": 12.0,
    "other_assembly": 12.0,
    "other_variant": 14.0,
    "labels_swapped": 16.0,
    "figure_rotated": 14.0,
    "scale_wrong": 10.0,
    "arithmetic": 22.0,
}
"""One step in a hundred or so goes wrong, in one of ten or so ways; a slip in a computation may give any
length."""
SOMETHING_ELSE = 9.0
"""What a step costs that went wrong in a way nobody knows, beside what it makes likely: any place."""
ANYWHERE = 2.0 * math.log(100.0)
"""A length may then be anything within some 100 mm; a place costs twice that."""
SUSPECT = 9.0
"""From this squared misfit on (three standard errors) wrong ways are tried."""
COST_WINDOW = 24.0
"""Accounts dearer than the cheapest by a hand of the same care by more than this are dropped."""
MOST_BRANCHES = 40
"""Accounts kept by a hand of one care."""


STIFFNESS = 1e-3
"""How little a node is held to where its step puts it, against what was seen of it."""
TINY = 1e-6
"""Millimetres; a shorter vector has no direction."""
SETTLING = 2
"""Steps in which a node is moved to the lengths seen of it."""

Covariance = tuple[float, float, float]
"""mm^2: variance along x, covariance, variance along y."""


@dataclass(frozen=True, slots=True)
class Observation:
    """A node, or a vector that ends in it, as drawn.

    Attributes
    ----------
    node : where it ends
    tail : the node from which it is seen; None for a place about the figure's origin
    value : complex millimetres, or a length where it has no direction
    spread : how far it may be missed; of what has a direction by its reading alone, the hand's own errors
        come to it
    """

    node: str
    tail: str | None
    value: complex
    spread: Covariance
    has_direction: bool = True


@dataclass(frozen=True, slots=True)
class Observations:
    """What somebody drew.

    Attributes
    ----------
    entries : its nodes and vectors
    sketches : by plan, the mechanism's joints as drawn beside it, where that is a sketch of its own
    """

    entries: tuple[Observation, ...]
    sketches: Mapping[str, Mapping[str, complex]] = field(default_factory=dict)


def by_node(construction: Construction, entries: Iterable[Observation]) -> dict[str, tuple[Observation, ...]]:
    """What was seen, by the end that is made later; vectors seen the other way round are turned."""
    order = {step.node: index for index, step in enumerate(construction.steps)}
    found: dict[str, tuple[Observation, ...]] = {}
    for one in entries:
        if one.tail is not None and order[one.tail] > order[one.node]:
            value = -one.value if one.has_direction else one.value
            one = replace(one, node=one.tail, tail=one.node, value=value)  # noqa: PLW2901 - the same vector
        found[one.node] = (*found.get(one.node, ()), one)
    return found


def needed_nodes(
    construction: Construction, entries: Mapping[str, tuple[Observation, ...]]
) -> frozenset[str]:
    """The nodes that were seen, or that something seen is made from or reckoned from, rightly or wrongly."""
    wanted = set(entries) | {one.tail for ones in entries.values() for one in ones if one.tail is not None}
    # A wrong line may be taken by any link, and through a pole.
    wanted.update(step.node for step in construction.figures["mechanism"])
    wanted.update(construction.poles.values())
    for step in reversed(construction.steps):
        if step.node in wanted:
            wanted.update(step.needs)
    return frozenset(wanted)


@dataclass(frozen=True, slots=True)
class NodeObservations:
    """What was seen of one node. Arrays of places end in the branches' axis.

    Attributes
    ----------
    turned : (branches,) factor by which its plan is turned as a whole, None where in no branch
    care : (branches,) how many times a usual hand's standard deviations
    """

    entries: tuple[Observation, ...]
    turned: ComplexArray | None
    care: FloatArray

    def __bool__(self) -> bool:
        return bool(self.entries)

    def value(self, one: Observation) -> ComplexArray | complex:
        """As it would stand in a plan that is not turned."""
        if self.turned is None or not one.has_direction:
            return one.value
        return np.asarray(one.value / self.turned)

    @property
    def fixes_place(self) -> bool:
        """Whether what was seen leaves the node only one place."""
        return any(one.has_direction for one in self.entries)

    @property
    def freedom(self) -> int:
        """How many numbers were seen."""
        return sum(2 if one.has_direction else 1 for one in self.entries)

    @property
    def anywhere(self) -> float:
        """What any place at all costs."""
        return SOMETHING_ELSE + ANYWHERE * min(self.freedom, 2)

    def misfit_and_cost(
        self, place: ComplexArray, shifts: ComplexArray | None, nodes: Mapping[str, ComplexArray]
    ) -> tuple[FloatArray, FloatArray]:
        """The squared misfit of places in standard deviations, infinite where there is none, and its cost.

        The cost is -2 log of the density of what was seen, millimetres: wide errors make each place rarer.

        Arguments: `place` (ways, branches); `shifts` (ways, acts, branches) is how far the acts of a usual
        hand move it.
        """
        misfit, width = np.zeros(place.shape), np.zeros(place.shape)
        for one in self.entries:
            vector = place if one.tail is None else place - nodes[one.tail]
            if one.has_direction:
                squared, variance = _squared_residual(self.value(one) - vector, one.spread, shifts)
            else:
                squared, variance = _squared_length_residual(abs(one.value), vector, one.spread)
            misfit += squared
            width += np.log(variance)
        misfit /= self.care**2
        whole = misfit + width + self.freedom * np.log(math.tau * self.care**2)
        is_there = np.isfinite(whole)
        return np.where(is_there, misfit, np.inf), np.where(is_there, whole, np.inf)

    def settled(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """Places moved to what was seen, by as little as possible where that leaves it open."""
        first = self.entries[0]
        if first.has_direction:
            tail = 0.0 if first.tail is None else nodes[first.tail]
            return np.broadcast_to(tail + self.value(first), place.shape)
        for _ in range(SETTLING):
            shifts = place + self._shift(place, nodes)
            place = np.where(np.isfinite(shifts), shifts, place)
        return place

    def _shift(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """A Gauss-Newton step towards the lengths seen."""
        tails = [one.tail for one in self.entries]
        vectors = np.array([place if tail is None else place - nodes[tail] for tail in tails])
        lengths = np.abs(vectors)
        is_long = lengths > TINY
        along = np.where(is_long, vectors / np.maximum(lengths, TINY), 0.0)
        wanted = np.array([abs(one.value) for one in self.entries])[:, None]
        pull = (along * (wanted - lengths)).sum(axis=0)
        x, y = along.real, along.imag
        xx, yy, xy = (x * x).sum(axis=0) + STIFFNESS, (y * y).sum(axis=0) + STIFFNESS, (x * y).sum(axis=0)
        x, y = pull.real, pull.imag
        return np.asarray(((yy * x - xy * y) + 1j * (xx * y - xy * x)) / (xx * yy - xy**2))


def _squared_residual(
    residual: ComplexArray, spread: Covariance, shifts: ComplexArray | None
) -> tuple[FloatArray, FloatArray]:
    """Deviations squared, in standard deviations, and the determinants of their covariances."""
    x, y = residual.real, residual.imag
    xx, xy, yy = (np.asarray(one) for one in spread)
    if shifts is not None:
        across, up = shifts.real, shifts.imag
        xx = xx + np.einsum("kah,kah->kh", across, across)
        xy = xy + np.einsum("kah,kah->kh", across, up)
        yy = yy + np.einsum("kah,kah->kh", up, up)
    determinant = xx * yy - xy * xy
    return np.asarray((yy * x * x - 2.0 * xy * x * y + xx * y * y) / determinant), np.asarray(determinant)


def _squared_length_residual(
    drawn_mm: float, vector: ComplexArray, spread: Covariance
) -> tuple[FloatArray, FloatArray]:
    """Deviations of lengths squared, in standard deviations, and their variances."""
    length, x, y = np.abs(vector), vector.real, vector.imag
    xx, xy, yy = spread
    along = (xx * x * x + 2.0 * xy * x * y + yy * y * y) / np.maximum(length, TINY) ** 2
    variance = np.where(length > TINY, along, xx + yy)
    return np.asarray((drawn_mm - length) ** 2 / variance), variance


LEAST_FACTOR, MOST_FACTOR = 0.02, 30.0
"""A computed length off by more than that is something else than a slip."""
SLIP = "arithmetic"

WrongSteps = tuple[tuple[Mistake, Step], ...]


class Repertoire:
    """The wrong ways of a construction's steps and a usual hand's errors in them, kept for a whole class."""

    def __init__(self, construction: Construction, skill: Skill) -> None:
        self.construction = construction
        self.skill = skill
        self._wrong: dict[str, WrongSteps] = {}
        self._errors: dict[str, Errors] = {}

    def wrong(self, step: Step) -> WrongSteps:
        """The mistakes that can be made in a step, with the step as each makes it."""
        if step.node not in self._wrong:
            mistakes = mistakes_of_step(step, self.construction)
            self._wrong[step.node] = tuple((one, changed_step(one, self.construction)) for one in mistakes)
        return self._wrong[step.node]

    def errors(self, step: Step) -> Errors:
        """The errors of a step's acts."""
        if step.node not in self._errors:
            self._errors[step.node] = step_errors(step, self.skill)
        return self._errors[step.node]


CACHE_SIZE = 32
"""So many constructions' repertoires are kept: a class draws one, or one for each position."""
_repertoires: deque[Repertoire] = deque(maxlen=CACHE_SIZE)


def repertoire_of(construction: Construction, skill: Skill) -> Repertoire:
    """The repertoire of a construction, kept: a class draws one and the same."""
    for repertoire in _repertoires:
        if repertoire.construction is construction and repertoire.skill == skill:
            return repertoire
    repertoire = Repertoire(construction, skill)
    _repertoires.append(repertoire)
    return repertoire


@dataclass(frozen=True, slots=True)
class StepAlternatives:
    """Ways to make a step in each branch, the right one first; arrays (ways, branches).

    Attributes
    ----------
    cost : of what was seen by each way, with how rare it is
    misfit : squared, of what was seen; zero for something else, that fits anything
    mistakes : by way; None for the right one and for something else
    factors : of a slip, by branch
    others : how many ways at the end are something else
    """

    place: ComplexArray
    cost: FloatArray
    misfit: FloatArray
    mistakes: tuple[Mistake | None, ...]
    factors: FloatArray | None = None
    others: int = 0

    def made(self, choice: int, branch: int) -> tuple[Mistake, ...]:
        """The mistake of a way in a branch, as a tuple of one or none."""
        mistake = self.mistakes[choice]
        if mistake is None:
            return ()
        if mistake.code == SLIP and self.factors is not None:
            mistake = replace(mistake, factor=float(self.factors[branch]))
        return (mistake,)

    def is_something_else(self, choice: int) -> bool:
        """Whether nobody knows what was done."""
        return choice >= len(self.mistakes) - self.others

    def __add__(self, more: "StepAlternatives") -> "StepAlternatives":
        return StepAlternatives(
            np.concatenate((self.place, more.place)),
            np.concatenate((self.cost, more.cost)),
            np.concatenate((self.misfit, more.misfit)),
            self.mistakes + more.mistakes,
            self.factors if more.factors is None else more.factors,
            self.others + more.others,
        )


@dataclass(frozen=True, slots=True)
class StepContext:
    """Where a step is made: the nodes so far in each branch, and what was seen of the new one."""

    nodes: Mapping[str, ComplexArray]
    known: Mapping[str, FloatArray]
    observed: NodeObservations
    repertoire: Repertoire

    @property
    def count(self) -> int:
        """How many branches there are."""
        return len(self.observed.care)

    def right(self, step: Step) -> StepAlternatives:
        """The step as it should be made."""
        return self._alternatives(step, [(None, step)])

    def wrong(self, step: Step) -> StepAlternatives:
        """The step with each mistake in it."""
        return self._alternatives(step, self.repertoire.wrong(step))

    def slips(self, step: Given) -> StepAlternatives | None:
        """The right direction with a length that was computed wrongly, as long as it was drawn."""
        entries, view = self.observed.entries, View(self.nodes, self.known)
        one = next((one for one in entries if one.tail == step.start or one.has_direction), None)
        if one is None or not isinstance(step.length, Normal | Coriolis):
            return None
        right = step.factor * step.length.at(view)
        if one.has_direction:
            tail = 0.0 if one.tail is None else self.nodes[one.tail]
            drawn = dot(tail + self.observed.value(one) - self.nodes[step.start], step.along.at(view))
        else:
            drawn = np.abs(one.value) * np.sign(right)
        factors = np.asarray(drawn / right)
        is_within = (factors > LEAST_FACTOR) & (factors < MOST_FACTOR)
        factors = np.broadcast_to(np.where(is_within, factors, np.nan), (self.count,))
        changed = replace(step, factor=step.factor * factors)  # type: ignore[arg-type]
        return replace(self._alternatives(step, [(Mistake(SLIP, step.node), changed)]), factors=factors)

    def something_else(self, right: StepAlternatives) -> StepAlternatives:
        """The node where it was drawn, whatever made it; from lengths alone on either side."""
        observed, nodes = self.observed, self.nodes
        start = np.where(np.isfinite(right.place[0]), right.place[0], 0.0)
        starts = [start]
        if not observed.fixes_place and len(observed.entries) > 1:
            tails = [0.0 if one.tail is None else nodes[one.tail] for one in observed.entries[:2]]
            base = np.asarray(tails[1] - tails[0])
            along = np.where(np.abs(base) > 0.0, base / np.abs(base), 1.0)
            starts.append(np.asarray(tails[0] + along**2 * np.conj(start - tails[0])))
        place = np.array([observed.settled(one, nodes) for one in starts])
        zero = np.zeros(place.shape)
        return StepAlternatives(
            place, zero + observed.anywhere, zero, (None,) * len(starts), others=len(starts)
        )

    def _alternatives(self, step: Step, steps: Sequence[tuple[Mistake | None, Step]]) -> StepAlternatives:
        mistakes = tuple(mistake for mistake, _ in steps)
        if not steps:
            empty = np.zeros((0, self.count))
            return StepAlternatives(empty.astype(np.complex128), empty, empty, ())
        place, shifts = self._placed(step, [changed for _, changed in steps])
        misfit, cost = self.observed.misfit_and_cost(place, shifts, self.nodes)
        rarity = np.array([0.0 if one is None else RARITY[one.code] for one in mistakes])
        return StepAlternatives(place, cost + rarity[:, None], misfit, mistakes)

    def _placed(self, step: Step, steps: Sequence[Step]) -> tuple[ComplexArray, ComplexArray | None]:
        """Where each puts the node, and how far each act of a usual hand moves it (ways, acts, branches)."""
        errors = self.repertoire.errors(step) if self.observed.fixes_place else {}
        view = View(self.nodes, self.known, errors)
        if not errors:
            return np.array([_shaped(one, (self.count,)) for one in _places(steps, view)]), None
        mark = view.error(step.node, 0, "x") + 1j * view.error(step.node, 0, "y")
        shape = (len(mark) if np.ndim(mark) else 1, self.count)
        place = np.array([_shaped(one, shape) for one in _places(steps, view)]) + mark
        return place[:, 0], (place[:, 1:] - place[:, :1]) / SMALL


def _shaped(place: ComplexArray, shape: tuple[int, ...]) -> ComplexArray:
    return place if place.shape == shape else np.broadcast_to(place, shape)


def _places(steps: Sequence[Step], view: View) -> Iterator[ComplexArray]:
    """Where each of a step's versions puts its node; a line that several share is drawn once."""
    drawn: dict[tuple[int, int], tuple[ComplexArray, ComplexArray]] = {}
    for step in steps:
        if not isinstance(step, TwoLines):
            yield step.place(view)
            continue
        lines = []
        for slot, line in enumerate((step.first, step.second)):
            key = (slot, id(line))
            if key not in drawn:
                drawn[key] = line.at(view, step.node, slot)
            lines.append(drawn[key])
        (p, u), (q, v) = lines
        yield geometry.meet(p, u, q, v)
