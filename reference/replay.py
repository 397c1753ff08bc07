"""A finished drawing replayed step by step: at each step the right way first, then the wrong ones.

The same construction once more, with what was drawn beside it. Every branch of the replay is one
account of the drawing: how each step was made, and where its node came to lie. A step that the right
way explains is left alone; where it does not, each mistake that `reference.mistakes` knows for that
step opens a branch, and "something else" one more. Later steps start from what was drawn, as the
student did, so that one mistake does not hide the next. Branches are arrays: all are drawn at once.

What an account costs is -2 log of its probability, up to a constant: the squared misfit of what was
seen, and for each mistake how rare it is.
"""

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from reference.construction import Construction
from reference.elements import Coriolis, Errors, Normal, Parameters, View
from reference.geometry import ComplexArray, FloatArray
from reference.hand import SMALL, Skill, hand_errors
from reference.mistakes import Drawing, Mistake, changed_step, mistakes_of_step
from reference.numbers import dot
from reference.steps import Given, Step

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]

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
"""What a mistake costs: one step in a hundred or so goes wrong, in one of ten or so ways, and a slip in
a computation may give any length."""
SOMETHING_ELSE = 9.0
"""What a step costs that went wrong in a way nobody knows, beside what it makes likely: any place."""
ANYWHERE = 2.0 * math.log(100.0)
"""A length may then be anything within some 100 mm; a place costs twice that."""
SUSPECT = 9.0
"""From this misfit on (three standard errors) wrong ways are tried."""
WITHIN = 24.0
"""Accounts dearer than the cheapest by more than this are dropped."""
AT_MOST = 48
TINY = 1e-6
"""Millimetres; a shorter vector has no direction."""
STIFFNESS = 1e-3
"""How little a node is held to where its step puts it, against what was seen of it."""
LEAST_FACTOR, MOST_FACTOR = 0.02, 30.0
"""A computed length off by more than that is something else than a slip."""


@dataclass(frozen=True, slots=True)
class Seen:
    """A node, or a vector that ends in it, as drawn.

    Attributes
    ----------
    node : where it ends
    tail : the node from which it is seen; None for a place about the figure's origin
    value : complex millimetres, or a length where it has no direction
    spread : mm^2, how far it may be missed: variance along x, covariance, variance along y; of what has
        a direction by its reading alone, the hand's own errors come to it
    """

    node: str
    tail: str | None
    value: complex
    spread: tuple[float, float, float]
    has_direction: bool = True


@dataclass(frozen=True, slots=True)
class Root:
    """Where an account begins: mistakes of the whole drawing, and what they change.

    Attributes
    ----------
    parameters : those that differ
    turned : by plan, the factor by which it is turned as a whole
    cost : of supposing it
    """

    made: tuple[Mistake, ...] = ()
    parameters: Parameters = field(default_factory=dict)
    turned: Mapping[str, complex] = field(default_factory=dict)
    cost: float = 0.0


@dataclass(frozen=True, slots=True)
class Account:
    """One way in which the drawing may have been made.

    Attributes
    ----------
    made : the mistakes, in the order of construction
    unexplained : nodes whose steps went wrong in no known way
    misfit : by node seen, root mean square in standard deviations
    right : the same if its step were made rightly
    """

    cost: float
    made: tuple[Mistake, ...]
    unexplained: tuple[str, ...]
    misfit: Mapping[str, float]
    right: Mapping[str, float]


@dataclass(slots=True)
class _Branches:
    """All accounts so far, arrays of shape (branches,)."""

    nodes: dict[str, ComplexArray]
    known: dict[str, FloatArray]
    turned: dict[str, ComplexArray]
    cost: FloatArray
    is_blind: np.ndarray[tuple[int, ...], np.dtype[np.bool_]]
    made: list[tuple[Mistake, ...]]
    unexplained: list[tuple[str, ...]]
    misfit: dict[str, FloatArray]
    right: dict[str, FloatArray]

    def take(self, index: IntArray) -> None:
        """Only these branches, in this order; one may be taken several times."""
        arrays: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]
        for arrays in (self.nodes, self.known, self.turned, self.misfit, self.right):  # type: ignore[assignment]
            arrays.update({name: array[index] for name, array in arrays.items() if np.ndim(array)})
        self.cost, self.is_blind = self.cost[index], self.is_blind[index]
        self.made = [self.made[i] for i in index]
        self.unexplained = [self.unexplained[i] for i in index]


@dataclass(frozen=True, slots=True)
class _Way:
    """One way to make a step: where it puts the node in each branch, and what it costs to suppose it.

    Attributes
    ----------
    misfit : squared, of what was seen; zero for "something else", that fits anything
    mistakes : one per branch (a slip has a factor of its own in each), or the same for all; none if right
    """

    place: ComplexArray
    cost: FloatArray
    misfit: FloatArray
    mistake: Mistake | None = None
    factors: FloatArray | None = None
    is_something_else: bool = False

    def made(self, branch: int) -> tuple[Mistake, ...]:
        """The mistake of a branch, as a tuple of one or none."""
        if self.mistake is None:
            return ()
        if self.factors is None:
            return (self.mistake,)
        return (replace(self.mistake, factor=float(self.factors[branch])),)


def replay(
    drawing: Drawing,
    seen: Iterable[Seen],
    roots: Sequence[Root],
    skill: Skill,
    *,
    care: float = 1.0,
    blind: bool = False,
) -> list[Account]:
    """The accounts of a drawing, the likeliest first.

    Arguments
    ---------
    drawing : the right one at its scales, parameters scalar
    skill : of a usual hand
    care : how many times its standard deviations this hand's are; costs for different hands may be
        compared
    blind : mistakes are also tried at steps of which what was seen tells no place, one to an account
    """
    by_node = _by_node(drawing.construction, seen)
    branches = _open(drawing, roots)
    needed = _seen_later(drawing.construction, by_node)
    with np.errstate(all="ignore"):
        for figure, steps in drawing.construction.figures.items():
            for step in steps:
                if step.node not in needed:
                    continue
                sight = _Sight(tuple(by_node.get(step.node, ())), branches.turned.get(figure), care)
                errors = hand_errors(step, skill) if sight.tells_place else {}
                ways = _ways(step, drawing.construction, branches, sight, errors, blind=blind)
                _go_on(step.node, branches, ways, sight)
    return _accounts(branches)


def _by_node(construction: Construction, seen: Iterable[Seen]) -> dict[str, list[Seen]]:
    """What was seen, by the end that is made later; vectors seen the other way round are turned."""
    order = {step.node: index for index, step in enumerate(construction.steps)}
    found: dict[str, list[Seen]] = {}
    for one in seen:
        if one.tail is not None and order[one.tail] > order[one.node]:
            value = -one.value if one.has_direction else one.value
            one = replace(one, node=one.tail, tail=one.node, value=value)  # noqa: PLW2901 - the same vector
        found.setdefault(one.node, []).append(one)
    return found


def _open(drawing: Drawing, roots: Sequence[Root]) -> _Branches:
    count = len(roots)
    known = {name: np.asarray(value) for name, value in drawing.parameters.items()}
    for name in {name for root in roots for name in root.parameters}:
        known[name] = np.array([float(np.ravel(root.parameters.get(name, known[name]))[0]) for root in roots])
    plans = {plan for root in roots for plan in root.turned}
    return _Branches(
        nodes={},
        known=known,
        turned={plan: np.array([root.turned.get(plan, 1.0) for root in roots]) for plan in plans},
        cost=np.array([root.cost for root in roots]),
        is_blind=np.zeros(count, np.bool_),
        made=[root.made for root in roots],
        unexplained=[()] * count,
        misfit={},
        right={},
    )


def _seen_later(construction: Construction, seen: Mapping[str, Sequence[Seen]]) -> frozenset[str]:
    """The nodes that were seen, or that something seen is made from or reckoned from."""
    wanted = set(seen) | {one.tail for ones in seen.values() for one in ones if one.tail is not None}
    for step in reversed(construction.steps):
        if step.node in wanted:
            wanted.update(step.needs)
    return frozenset(wanted)


# What was seen of one node ------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Sight:
    """What was seen of one node, in a plan that may be turned as a whole in some branches."""

    seen: tuple[Seen, ...]
    turned: ComplexArray | None
    care: float

    def __bool__(self) -> bool:
        return bool(self.seen)

    def value(self, one: Seen) -> ComplexArray:
        """As it would stand in a plan that is not turned."""
        if self.turned is None or not one.has_direction:
            return np.asarray(one.value)
        return np.asarray(one.value / self.turned)

    def held_against(
        self, place: ComplexArray, moved: ComplexArray | None, nodes: Mapping[str, ComplexArray]
    ) -> tuple[FloatArray, FloatArray]:
        """The squared misfit of a place in standard deviations, infinite where there is none, and its cost.

        The cost is -2 log of the density of what was seen, millimetres: wide errors make each place rarer.

        Arguments: `moved` (acts, branches) is how far the acts of a usual hand move the place.
        """
        misfit = np.where(np.isfinite(place), 0.0, np.inf)
        width = np.zeros(np.shape(place))
        for one in self.seen:
            vector = place if one.tail is None else place - nodes[one.tail]
            if one.has_direction:
                squared, variance = _off(self.value(one) - vector, one.spread, moved)
            else:
                squared, variance = _off_length(abs(one.value), vector, one.spread)
            misfit = misfit + squared
            width = width + np.log(variance)
        misfit = np.where(np.isfinite(misfit), misfit / self.care**2, np.inf)
        whole = misfit + width + self.freedom * math.log(math.tau * self.care**2)
        return misfit, np.where(np.isfinite(whole), whole, np.inf)

    @property
    def tells_place(self) -> bool:
        """Whether what was seen leaves the node only one place."""
        return any(one.has_direction for one in self.seen)

    @property
    def freedom(self) -> int:
        """How many numbers were seen."""
        return sum(2 if one.has_direction else 1 for one in self.seen)

    @property
    def anywhere(self) -> float:
        """What any place at all costs."""
        return SOMETHING_ELSE + ANYWHERE * min(self.freedom, 2)

    def settled(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """The place moved to what was seen, by as little as possible where that leaves it open."""
        first = self.seen[0]
        if first.has_direction:
            tail = 0.0 if first.tail is None else nodes[first.tail]
            return np.asarray(tail + self.value(first))
        moved = place
        for _ in range(2):
            moved = moved + self._shift(moved, nodes)
        return np.where(np.isfinite(moved), moved, place)

    def _shift(self, place: ComplexArray, nodes: Mapping[str, ComplexArray]) -> ComplexArray:
        """A Gauss-Newton step towards the lengths seen."""
        zero = np.zeros(np.shape(place))
        xx, yy, xy, rx, ry = zero + STIFFNESS, zero + STIFFNESS, zero, zero, zero
        for one in self.seen:
            vector = place if one.tail is None else place - nodes[one.tail]
            length = np.abs(vector)
            is_long = length > TINY
            along = np.where(is_long, vector / np.maximum(length, TINY), 0.0)
            off = np.where(is_long, abs(one.value) - length, 0.0)
            xx, yy = xx + along.real**2, yy + along.imag**2
            xy = xy + along.real * along.imag
            rx, ry = rx + along.real * off, ry + along.imag * off
        return np.asarray(((yy * rx - xy * ry) + 1j * (xx * ry - xy * rx)) / (xx * yy - xy**2))


def _off(
    off: ComplexArray, spread: tuple[float, float, float], moved: ComplexArray | None
) -> tuple[FloatArray, FloatArray]:
    """A deviation squared, in standard deviations, and the determinant of its covariance."""
    xx, xy, yy = (np.asarray(one) for one in spread)
    if moved is not None:
        across, up = moved.real, moved.imag
        xx, xy, yy = (
            xx + np.sum(across * across, axis=0),
            xy + np.sum(across * up, axis=0),
            yy + np.sum(up * up, axis=0),
        )
    x, y = off.real, off.imag
    determinant = xx * yy - xy**2
    return np.asarray((yy * x**2 - 2.0 * xy * x * y + xx * y**2) / determinant), np.asarray(determinant)


def _off_length(
    seen_mm: float, vector: ComplexArray, spread: tuple[float, float, float]
) -> tuple[FloatArray, FloatArray]:
    """A length's deviation squared, in standard deviations, and its variance."""
    length, x, y = np.abs(vector), vector.real, vector.imag
    xx, xy, yy = spread
    along = (xx * x**2 + 2.0 * xy * x * y + yy * y**2) / np.maximum(length, TINY) ** 2
    variance = np.where(length > TINY, along, xx + yy)
    return np.asarray((seen_mm - length) ** 2 / variance), variance


# One step -----------------------------------------------------------------------------------------


def _ways(
    step: Step, construction: Construction, branches: _Branches, sight: _Sight, errors: Errors, *, blind: bool
) -> list[_Way]:
    """The right way to make a step, and the wrong ones where that does not explain what was seen."""
    view = View(branches.nodes, branches.known, errors)
    count = len(branches.cost)

    def way(changed: Step, mistake: Mistake | None, factors: FloatArray | None = None) -> _Way:
        place, moved = _placed(changed, view, count)
        misfit, cost = sight.held_against(place, moved, branches.nodes)
        rarity = 0.0 if mistake is None else RARITY[mistake.code]
        if factors is not None:
            factors = np.broadcast_to(factors, (count,))
        return _Way(place, branches.cost + rarity + cost, misfit, mistake, factors)

    right = way(step, None)
    is_suspect = right.misfit > SUSPECT if sight else np.zeros(count, np.bool_)
    is_blind = blind and not sight.tells_place
    if not np.any(is_suspect) and not is_blind:
        return [right]
    wrong = [way(changed, mistake) for mistake, changed in _known(construction, step)]
    if is_blind:
        barred = branches.is_blind & ~is_suspect
        wrong = [replace(one, cost=np.where(barred, np.inf, one.cost)) for one in wrong]
    if not np.any(is_suspect):
        return [right, *wrong]
    slips = list(_slips(step, view, sight, way)) if isinstance(step, Given) else []
    if slips and not sight.tells_place:
        # Of a computed length seen as a length alone, whatever it is may be a slip.
        return [right, *wrong, *slips]
    return [right, *wrong, *slips, *_something_else(right, branches, sight)]


def _placed(step: Step, view: View, count: int) -> tuple[ComplexArray, ComplexArray | None]:
    """Where a step puts its node in each branch, and how far each act of a usual hand moves it there."""
    place = np.asarray(step.place(view))
    if not view.errors:
        return np.broadcast_to(place, (count,)), None
    place = place + view.error(step.node, 0, "x") + 1j * view.error(step.node, 0, "y")
    place = np.broadcast_to(place, (place.shape[0], count))
    return place[0], (place[1:] - place[0]) / SMALL


_WrongSteps = tuple[tuple[Mistake, Step], ...]
_of_steps: dict[int, tuple[Construction, dict[str, _WrongSteps]]] = {}
KEPT = 64
"""Constructions whose mistakes are kept: a class draws one and the same."""


def _known(construction: Construction, step: Step) -> _WrongSteps:
    """The mistakes that can be made in a step, with the step as each makes it."""
    kept = _of_steps.get(id(construction))
    if kept is None or kept[0] is not construction:
        if len(_of_steps) >= KEPT:
            _of_steps.clear()
        kept = _of_steps[id(construction)] = (construction, {})
    if step.node not in kept[1]:
        kept[1][step.node] = tuple(
            (mistake, changed_step(mistake, construction)) for mistake in mistakes_of_step(step, construction)
        )
    return kept[1][step.node]


def _slips(
    step: Given, view: View, sight: _Sight, way: Callable[[Step, Mistake, FloatArray], _Way]
) -> Iterator[_Way]:
    """The right direction with a length that was computed wrongly, as long as it was drawn."""
    one = next((one for one in sight.seen if one.tail == step.start or one.has_direction), None)
    right = step.factor * step.length.at(view)
    if one is None or not isinstance(step.length, Normal | Coriolis):
        return
    if one.has_direction:
        tail = 0.0 if one.tail is None else view.nodes[one.tail]
        drawn = dot(tail + sight.value(one) - view.nodes[step.start], step.along.at(view))
    else:
        drawn = np.abs(one.value) * np.sign(right)
    factors = np.asarray(drawn / right)
    within = (factors > LEAST_FACTOR) & (factors < MOST_FACTOR)
    factors = np.where(within, factors, np.nan)
    changed = replace(step, factor=step.factor * factors)  # type: ignore[arg-type]
    yield way(changed, Mistake("arithmetic", step.node), factors)


def _something_else(right: _Way, branches: _Branches, sight: _Sight) -> Iterator[_Way]:
    """The node where it was drawn, whatever made it; from lengths alone on either side."""
    start = np.where(np.isfinite(right.place), right.place, 0.0)
    starts = [start]
    if not sight.seen[0].has_direction and len(sight.seen) > 1:
        tails = [0.0 if one.tail is None else branches.nodes[one.tail] for one in sight.seen[:2]]
        base = tails[1] - tails[0]
        along = np.where(np.abs(base) > 0.0, base / np.abs(base), 1.0)
        starts.append(np.asarray(tails[0] + along**2 * np.conj(start - tails[0])))
    zero = np.zeros(len(branches.cost))
    for place in starts:
        settled = sight.settled(np.asarray(place), branches.nodes)
        yield _Way(
            np.broadcast_to(settled, zero.shape),
            branches.cost + sight.anywhere,
            zero,
            is_something_else=True,
        )


def _go_on(node: str, branches: _Branches, ways: Sequence[_Way], sight: _Sight) -> None:
    """The branches after a step: each way in each branch, the likeliest of them."""
    if len(ways) == 1:
        chosen, index, which = ways[0], np.arange(len(branches.cost)), None
        place, branches.cost, misfit, right = chosen.place, chosen.cost, chosen.misfit, chosen.misfit
    else:
        costs = np.array([way.cost for way in ways])
        flat = np.argsort(costs, axis=None, kind="stable")[:AT_MOST]
        least = costs.flat[flat[0]]
        flat = flat[costs.flat[flat] <= least + WITHIN] if np.isfinite(least) else flat[:1]
        which, index = np.unravel_index(flat, costs.shape)
        place = np.array([way.place for way in ways])[which, index]
        misfit = np.array([way.misfit for way in ways])[which, index]
        right = ways[0].misfit[index]
        branches.take(index)
        branches.cost = costs[which, index]
        for row, (one, branch) in enumerate(zip(which.tolist(), index.tolist(), strict=True)):
            branches.made[row] += ways[one].made(branch)
            if ways[one].is_something_else:
                branches.unexplained[row] += (node,)
        if not sight.tells_place:
            suspect = ways[0].misfit[index] > SUSPECT
            branches.is_blind |= (which > 0) & ~suspect
        if sight.turned is not None:
            sight = replace(sight, turned=sight.turned[index] if np.ndim(sight.turned) else sight.turned)
    branches.nodes[node] = sight.settled(place, branches.nodes) if sight else place
    if sight:
        branches.misfit[node] = np.sqrt(misfit / sight.freedom)
        branches.right[node] = np.sqrt(right / sight.freedom)


def _accounts(branches: _Branches) -> list[Account]:
    order = np.argsort(branches.cost, kind="stable")
    return [
        Account(
            float(branches.cost[i]),
            branches.made[i],
            branches.unexplained[i],
            {node: float(misfit[i]) for node, misfit in branches.misfit.items()},
            {node: float(misfit[i]) for node, misfit in branches.right.items()},
        )
        for i in order
        if np.isfinite(branches.cost[i])
    ]
