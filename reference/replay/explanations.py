"""Explanations of one step of a drawing: the right step, a known mistake, a slip, something else.

Each explanation has a cost, -2 log of its probability up to a constant: the squared residual of the drawn
node, with its covariance, and for each mistake its rarity.
"""

import math
from collections import ChainMap, deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from reference import geometry
from reference.construction.elements import Along, Direction, Errors, Line, View, is_computed, is_force
from reference.construction.graph import Construction
from reference.construction.mistakes import (
    RIGHT_TRIANGLE,
    SLIP,
    Mistake,
    changed_step,
    mistakes_of_step,
    rarer_mistakes_of_step,
)
from reference.construction.steps import Given, Step, TwoLines
from reference.construction.uncertainty import SMALL, Skill, step_errors
from reference.geometry import ComplexArray, FloatArray
from reference.numbers import dot
from reference.quantities import kind_of

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
    "inertia_reversed": 11.0,
    "force_missing": 12.0,
    "force_reversed": 12.0,
    "couple_missing": 12.0,
    "couple_reversed": 13.0,
    "wrong_arm": 13.0,
}
"""Cost of each mistake: one step in about a hundred goes wrong, in one of about ten ways; a slip in a
computation may give any length."""
NOT_THERE = 5.0
"""Reduced cost of a component left out if it is not there: a component drawn is seldom left blank."""
KNOWN_SLIP = 11.0
"""Cost of a slip by one of `SLIPS`: less rare than any other."""
SLIPS = (0.1, 0.5, 2.0, 10.0)
"""A decimal point, a half or a double: the commonest slips in computing a length."""
BY_TRIANGLE = 13.0
"""Cost of a length drawn by the right triangle: if one of `SLIPS` fits as well, this is its rival."""
LEAST_RATIO = 0.1
"""Least logarithm of kL ka / kv^2 at which the right triangle is a mistake."""
RARER = 3.0
"""Extra cost of a mistake that is seldom made."""
ANOTHER_WAY = 2.0
"""Cost of an image found by similar triangles rather than by lines: one in three."""
AN_OTHER_LINE = 3.0
"""Extra cost of a whole line that belongs to another vector: there are many."""
SOMETHING_ELSE = 9.0
"""Cost of a step that went wrong in an unknown way, without the cost of its position."""
AREA_MM = 100.0
"""An unknown coordinate or length may have any value within this range, or within its own size."""
SUSPECT = 9.0
"""Mistakes are tried from this squared misfit on (three standard errors)."""
COST_WINDOW = 24.0
"""Explanations that cost this much more than the cheapest one of the same care are dropped."""
MOST_BRANCHES = 40
"""Explanations that are continued for each care."""
STIFFNESS = 1e-3
"""Weight of the position that the step gives, relative to the observation."""
TINY = 1e-6
"""Millimetres; a shorter vector has no direction."""
SETTLING = 2
"""Steps in which a node is moved to fit the observed lengths."""

BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
Covariance = tuple[float, float, float]
"""mm^2: variance along x, covariance, variance along y."""


@dataclass(frozen=True, slots=True)
class Observation:
    """The position of a node, or a vector that ends in it, as drawn.

    Attributes
    ----------
    node : the node, or the vector's head
    tail : the vector's tail; None for a position about the figure's origin
    value : complex millimetres, or a length if the direction is not known
    spread : its covariance; with a direction that of the reading alone, without drafting errors
    """

    node: str
    tail: str | None
    value: complex
    spread: Covariance
    has_direction: bool = True


@dataclass(frozen=True, slots=True)
class Observations:
    """A drawing as read or measured.

    Attributes
    ----------
    entries : its nodes and vectors
    sketches : by plan, the mechanism's joints as drawn beside it, if that is another sketch
    cost : cost of this version of the drawing: of measurements that contradict each other, or are left out
    directions_rad : by pair of joints, the standard error of the direction between them on a sketch that was
        not handed in
    blank : ends of components that are missing although others are drawn
    apart : by plan, how much less than `cost` its measurements cost if they need not close any polygon
    """

    entries: tuple[Observation, ...]
    sketches: Mapping[str, Mapping[str, complex]] = field(default_factory=dict)
    cost: float = 0.0
    directions_rad: Mapping[tuple[str, str], float] = field(default_factory=dict)
    apart: Mapping[str, float] = field(default_factory=dict)
    blank: frozenset[str] = frozenset()


def by_node(construction: Construction, entries: Iterable[Observation]) -> dict[str, tuple[Observation, ...]]:
    """Return the observations by the node made later; vectors that end at the earlier node are reversed."""
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
    """Return the observed nodes and all from which these may be made, with right or wrong steps."""
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
    """The observations of one node; the last axis of arrays is that of the branches.

    Attributes
    ----------
    turned : (branches,) factor by which its plan is turned as a whole, None if it is turned in no branch
    care : (branches,) drafting errors as multiples of the usual ones
    """

    entries: tuple[Observation, ...]
    turned: ComplexArray | None
    care: FloatArray

    def __bool__(self) -> bool:
        return bool(self.entries)

    def value(self, one: Observation) -> ComplexArray | complex:
        """Return the observed value in a plan that is not turned."""
        if self.turned is None or not one.has_direction:
            return one.value
        return np.asarray(one.value / self.turned)

    @property
    def fixes_place(self) -> bool:
        """True if the observations leave only one position for the node."""
        return any(one.has_direction for one in self.entries)

    @property
    def freedom(self) -> int:
        """The number of observed coordinates and lengths."""
        return _freedom(self.entries)

    @property
    def anywhere(self) -> float:
        """The cost of an arbitrary position, found in an unknown way."""
        return SOMETHING_ELSE + cost_of_any(self.entries)

    def misfit_and_cost(
        self, place: ComplexArray, shifts: ComplexArray | None, nodes: Mapping[str, ComplexArray]
    ) -> tuple[FloatArray, FloatArray]:
        """Return the squared misfit of positions in standard deviations (inf if there is none), and its cost.

        The cost is -2 log of the density of the observations per mm: wide errors make each position rarer.

        Arguments: `place` (alternatives, branches); `shifts` (alternatives, acts, branches), its shift by
        each usual drafting error.
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
        """Return positions moved to the observations, by as little as possible if only lengths are known."""
        first = self.entries[0]
        if first.has_direction:
            tail = 0.0 if first.tail is None else nodes[first.tail]
            return np.broadcast_to(tail + self.value(first), place.shape)
        for _ in range(SETTLING):
            settled = place + self._shift(place, nodes)
            place = np.where(np.isfinite(settled), settled, place)
        return place

    def _shift(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """Return a Gauss-Newton step towards the observed lengths."""
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


def _freedom(entries: Sequence[Observation]) -> int:
    return sum(2 if one.has_direction else 1 for one in entries)


def cost_of_any(entries: Sequence[Observation]) -> float:
    """Return the cost of a node's observations if it may be anywhere; two of them determine its position."""
    size_mm = max(AREA_MM, *(abs(one.value) for one in entries))
    return 2.0 * math.log(size_mm) * min(_freedom(entries), 2)


def _squared_residual(
    residual: ComplexArray, spread: Covariance, shifts: ComplexArray | None
) -> tuple[FloatArray, FloatArray]:
    """Return squared deviations, in standard deviations, and the determinants of their covariances."""
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
    """Return squared deviations of lengths, in standard deviations, and their variances."""
    length, x, y = np.abs(vector), vector.real, vector.imag
    xx, xy, yy = spread
    along = (xx * x * x + 2.0 * xy * x * y + yy * y * y) / np.maximum(length, TINY) ** 2
    variance = np.where(length > TINY, along, xx + yy)
    return np.asarray((drawn_mm - length) ** 2 / variance), variance


# Mistakes of a step, and their costs ---------------------------------------------------------------

LEAST_FACTOR, MOST_FACTOR = 0.02, 30.0
"""A computed length that is wrong by a factor outside this range is not a slip in its computation."""

WrongSteps = tuple[tuple[Mistake, Step], ...]


class Repertoire:
    """The mistakes in the steps of a construction and their usual drafting errors, computed once."""

    def __init__(self, construction: Construction, skill: Skill) -> None:
        self.construction = construction
        self.skill = skill
        self._wrong: dict[str, WrongSteps] = {}
        self._rarer: dict[str, WrongSteps] = {}
        self._errors: dict[tuple[str, type[Step], int], Errors] = {}

    def wrong(self, step: Step) -> WrongSteps:
        """Return the mistakes that can be made in a step, each with the step it leads to."""
        if step.node not in self._wrong:
            mistakes = mistakes_of_step(step, self.construction)
            self._wrong[step.node] = tuple((one, changed_step(one, self.construction)) for one in mistakes)
        return self._wrong[step.node]

    def rarer(self, step: Step) -> WrongSteps:
        """Return the seldom made mistakes in a step, each with the step it leads to."""
        if step.node not in self._rarer:
            mistakes = (*rarer_mistakes_of_step(step, self.construction), *_known_slips(step))
            self._rarer[step.node] = tuple((one, changed_step(one, self.construction)) for one in mistakes)
        return self._rarer[step.node]

    def errors(self, step: Step, further: int) -> Errors:
        """Return the errors of a step's acts, with `rows` free rows for further errors at the end."""
        key = (step.node, type(step), further)
        if key not in self._errors:
            free = np.zeros((further, 1))
            own = step_errors(step, self.skill)
            self._errors[key] = {act: np.concatenate((row, free)) for act, row in own.items()}
        return self._errors[key]


def _known_slips(step: Step) -> Iterator[Mistake]:
    """Yield the commonest slips in a computed length."""
    if isinstance(step, Given) and is_computed(step.length):
        yield from (Mistake(SLIP, step.node, factor=factor) for factor in SLIPS)


def rarity_of(mistake: Mistake) -> float:
    """Return the cost of a mistake."""
    if mistake.other == (RIGHT_TRIANGLE,):
        return BY_TRIANGLE
    if mistake.code == SLIP and mistake.factor in SLIPS:
        return KNOWN_SLIP
    is_line = mistake.code == "wrong_intersection" and kind_of(mistake.other[0]).name != "length"
    return RARITY[mistake.code] + (AN_OTHER_LINE if is_line else 0.0)


CACHE_SIZE = 32
"""Repertoires in the cache: a class draws one construction, or one for each position."""
_repertoires: deque[Repertoire] = deque(maxlen=CACHE_SIZE)


def repertoire_of(construction: Construction, skill: Skill) -> Repertoire:
    """Return the repertoire of a construction, from the cache if it is there."""
    for repertoire in _repertoires:
        if repertoire.construction is construction and repertoire.skill == skill:
            return repertoire
    repertoire = Repertoire(construction, skill)
    _repertoires.append(repertoire)
    return repertoire


@dataclass(frozen=True, slots=True)
class StepAlternatives:
    """The alternatives for a step in each branch, the right one first; arrays (alternatives, branches).

    Attributes
    ----------
    place : the node's position, complex mm
    cost : of the observations, with the cost of the mistake
    misfit : squared, of the observations; zero for an unknown way, which fits anything
    mistakes : by alternative; None for the right one and for an unknown way
    factors : of a slip, by branch
    others : number of alternatives at the end that are unknown ways
    """

    place: ComplexArray
    cost: FloatArray
    misfit: FloatArray
    mistakes: tuple[Mistake | None, ...]
    factors: FloatArray | None = None
    others: int = 0

    def made(self, choice: int, branch: int) -> tuple[Mistake, ...]:
        """Return the mistake of an alternative in a branch, as a tuple of one or none."""
        mistake = self.mistakes[choice]
        if mistake is None:
            return ()
        is_any = mistake.code == SLIP and mistake.factor == 1.0 and not mistake.other
        if is_any and self.factors is not None:
            mistake = replace(mistake, factor=float(self.factors[branch]))
        return (mistake,)

    def is_something_else(self, choice: int) -> bool:
        """Return whether an alternative is an unknown way."""
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
    """The data for comparing a step: the nodes so far in each branch, and the observations of the new one.

    `measured` are the nodes of its figure that were measured roughly, see `measured_nodes`; `blank` those of
    `Observations`.
    """

    nodes: Mapping[str, ComplexArray]
    known: Mapping[str, FloatArray]
    observed: NodeObservations
    repertoire: Repertoire
    measured: Mapping[str, ComplexArray] = field(default_factory=dict)
    directions_rad: Mapping[tuple[str, str], float] = field(default_factory=dict)
    blank: frozenset[str] = frozenset()

    @property
    def count(self) -> int:
        """The number of branches."""
        return len(self.observed.care)

    def right(self, step: Step) -> StepAlternatives:
        """Return the alternative of the right step."""
        return self._alternatives(step, [(None, step)])

    def by_similarity(self, step: Step, is_tried: BoolArray) -> StepAlternatives:
        """Return, for some branches, the image of a link's point by similar triangles if lines make it."""
        image = self.repertoire.construction.images.get(step.node)
        if image is None or not isinstance(step, TwoLines):
            return self._alternatives(step, [])
        found = self._alternatives(image, [(None, image)])
        return replace(found, cost=np.where(is_tried, found.cost + ANOTHER_WAY, np.inf))

    def wrong(self, step: Step) -> StepAlternatives:
        """Return the step with each usual mistake in it."""
        return self._alternatives(step, self.repertoire.wrong(step))

    def rarer(self, step: Step) -> StepAlternatives:
        """Return the step with each seldom made mistake in it."""
        found = self._alternatives(step, self.repertoire.rarer(step))
        return replace(found, cost=found.cost + RARER)

    def slips(self, step: Given) -> StepAlternatives | None:
        """Return the right direction with a wrongly computed length, as drawn; None if none is computed."""
        entries, view = self.observed.entries, View(self.nodes, self.known)
        one = next((one for one in entries if one.tail == step.start or one.has_direction), None)
        if one is None or not is_computed(step.length):
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
        """Return the node where it was drawn, made in an unknown way; from lengths alone, in both."""
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
        # Nodes on which nothing observed depends are not replayed: no line can have been drawn through them.
        steps = [one for one in steps if one[0] is None or self.nodes.keys() >= set(one[1].needs)]
        mistakes = tuple(mistake for mistake, _ in steps)
        if not steps:
            empty = np.zeros((0, self.count))
            return StepAlternatives(empty.astype(np.complex128), empty, empty, ())
        place, shifts = self._placed(step, [changed for _, changed in steps])
        misfit, cost = self.observed.misfit_and_cost(place, shifts, self.nodes)
        for row, mistake in enumerate(mistakes):
            cost[row] += 0.0 if mistake is None else self._rarity(step, mistake)
        return StepAlternatives(place, cost, misfit, mistakes)

    def _rarity(self, step: Step, mistake: Mistake) -> float | FloatArray:
        """Return the cost of a mistake; less for what was left out if it is not there, more for its slip.

        By the right triangle it is infinite in branches where the scales allow that.
        """
        if mistake.other == (RIGHT_TRIANGLE,):
            ratio = self.known["kL"] * self.known["ka"] / self.known["kv"] ** 2
            return np.where(np.abs(np.log(ratio)) < LEAST_RATIO, np.inf, rarity_of(mistake))
        is_laid_off = isinstance(step, Given) and is_force(step.length)
        less = {"normal_missing": 1, "force_missing": 1, SLIP: -is_laid_off}.get(mistake.code, 0)
        return rarity_of(mistake) - (NOT_THERE * less if mistake.at in self.blank else 0.0)

    def _placed(self, step: Step, steps: Sequence[Step]) -> tuple[ComplexArray, ComplexArray | None]:
        """Return positions that steps give, and shifts by usual errors (steps, errors, branches)."""
        if not self.observed.fixes_place:
            view = View(self.nodes, self.known)
            return np.array([_shaped(one, (self.count,)) for one in _places(steps, view)]), None
        groups = self._measured(step, steps)
        rows = 2 * (max(groups.values()) + 1) if groups else 0
        errors = self._with_sketch(step, self.repertoire.errors(step, rows))
        if not errors and not rows:
            view = View(self.nodes, self.known)
            return np.array([_shaped(one, (self.count,)) for one in _places(steps, view)]), None
        count = 1 + len(errors) + rows
        moved = {name: self._moved(name, count - rows + 2 * group, count) for name, group in groups.items()}
        view = View(ChainMap(moved, self.nodes) if moved else self.nodes, self.known, errors)  # type: ignore[arg-type]
        mark = view.error(step.node, 0, "x") + 1j * view.error(step.node, 0, "y")
        shape = (count, self.count)
        place = np.array([_shaped(one, shape) for one in _places(steps, view)]) + mark
        return place[:, 0], (place[:, 1:] - place[:, :1]) / SMALL

    def _with_sketch(self, step: Step, errors: Errors) -> Errors:
        """Return the errors with those of the sketch's directions, if these are known less well."""
        usual = self.repertoire.skill.deviation("angle")
        if not self.directions_rad or not usual:
            return errors
        found = {**errors}
        for slot, along in enumerate(_directions(step)):
            act = (step.node, slot, "angle")
            own = self.directions_rad.get((along.tail, along.head)) if isinstance(along, Along) else None
            if own and act in found:
                found[act] = found[act] * math.hypot(1.0, own / usual)
        return found

    def _measured(self, step: Step, steps: Sequence[Step]) -> dict[str, int]:
        """Return the measured nodes from which the steps start, by the group whose rows their errors have.

        The right step's first two nodes have rows of their own, all others share theirs: no step uses two.
        """
        groups: dict[str, int] = {}
        for name in (*step.needs, *(name for one in steps for name in one.needs)):
            if name in self.measured and name not in groups:
                groups[name] = min(len(groups), 2)
        return groups

    def _moved(self, name: str, row: int, count: int) -> ComplexArray:
        """Return a node, moved by its error along both axes of the covariance in two rows."""
        shifts = np.zeros((count, 1), np.complex128)
        shifts[row : row + 2, 0] = SMALL * self.measured[name]
        return np.asarray(self.nodes[name] + shifts)


def _directions(step: Step) -> tuple[Direction | None, ...]:
    """Return the directions of a step's lines, in the order of their slots."""
    match step:
        case TwoLines(first=first, second=second):
            return tuple(one.along if isinstance(one, Line) else None for one in (first, second))
        case Given(along=along):
            return (along,)
    return ()


LEAST_MEASURED_MM = 0.25
"""Nodes known better than this are taken as exact when a step starts from them."""


def measured_nodes(entries: Mapping[str, tuple[Observation, ...]]) -> dict[str, ComplexArray]:
    """Return the nodes whose positions were measured roughly, and how two independent errors move each."""
    found = {}
    for node, observed in entries.items():
        first = observed[0]
        if first.tail is None and first.has_direction:
            xx, xy, yy = first.spread
            if max(xx, yy) > LEAST_MEASURED_MM**2:
                along, across = math.sqrt(xx), max(yy - xy * xy / xx, 0.0)
                found[node] = np.array([along + 1j * xy / along, 1j * math.sqrt(across)])
    return found


def _shaped(place: ComplexArray, shape: tuple[int, ...]) -> ComplexArray:
    return place if place.shape == shape else np.broadcast_to(place, shape)


def _places(steps: Sequence[Step], view: View) -> Iterator[ComplexArray]:
    """Yield the node's position by each of the alternative steps; a line that several share is drawn once."""
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
