"""A finished drawing replayed step by step: at each step the right way first, then the wrong ones.

The same construction once more, with what was drawn beside it. Every branch of the replay is one
explanation of the drawing: how each step was made, and where its node came to lie. A step that the
right way explains is left alone; where it does not, each mistake that
`reference.construction.mistakes` knows for that step opens a branch, and "something else" one more.
Later steps start from what was drawn, as the student did, so that one mistake does not hide the next.
Branches are arrays: all are drawn at once, for drafting errors of every size. The ways to make one
step and what each costs are in `reference.replay.explanations`.
"""

from collections import ChainMap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from reference.construction.elements import Parameters
from reference.construction.mistakes import Drawing, Mistake
from reference.construction.steps import Given, Step
from reference.construction.uncertainty import Skill
from reference.geometry import ComplexArray, FloatArray
from reference.replay.explanations import (
    AT_MOST,
    SUSPECT,
    WITHIN,
    NodeObservations,
    Observation,
    Observations,
    StepAlternatives,
    StepContext,
    by_node,
    repertoire_of,
    seen_later,
)

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
BoolArray = np.ndarray[tuple[int, ...], np.dtype[np.bool_]]


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
class Replay:
    """One way in which the drawing may have been made.

    Attributes
    ----------
    care : how many times a usual hand's standard deviations
    made : the mistakes, in the order of construction
    unexplained : nodes whose steps went wrong in no known way
    branches, index : the replay that it comes from, and which of its branches it is
    """

    cost: float
    care: float
    made: tuple[Mistake, ...]
    unexplained: tuple[str, ...]
    branches: "_Branches" = field(repr=False)
    index: int

    @property
    def is_innocent(self) -> bool:
        """Whether everything was made rightly."""
        return not self.made and not self.unexplained

    @property
    def right(self) -> Mapping[str, float]:
        """By node seen, root mean square misfit in standard deviations if its step were made rightly."""
        return {node: float(misfit[self.index]) for node, misfit in self.branches.right.items()}


def replay(
    drawing: Drawing,
    work: Observations,
    roots: Sequence[Root],
    skill: Skill,
    *,
    cares: Sequence[float] = (1.0,),
    blind: bool = False,
) -> list[Replay]:
    """The accounts of a drawing, the likeliest first.

    Arguments
    ---------
    drawing : the right one at its scales, parameters scalar
    skill : of a usual hand
    cares : the hands supposed, as multiples of its standard deviations
    blind : mistakes are also tried at steps of which what was seen tells no place, one to an account
    """
    construction, told = drawing.construction, by_node(drawing.construction, work.seen)
    branches = _open(drawing, roots, cares)
    needed = seen_later(construction, told)
    repertoire = repertoire_of(construction, skill)
    with np.errstate(all="ignore"):
        for figure, steps in construction.figures.items():
            sketch = {name: np.asarray(place) for name, place in work.sketches.get(figure, {}).items()}
            for step in steps:
                if step.node in needed:
                    here, nodes = told.get(step.node, ()), ChainMap(sketch, branches.nodes)
                    bench = StepContext(nodes, branches.known, branches.sight(here, figure), repertoire)
                    branches.go_on(step, figure, here, _ways(step, bench, branches.is_blind, blind=blind))
    return branches.accounts()


def _ways(step: Step, bench: StepContext, has_guessed: BoolArray, *, blind: bool) -> StepAlternatives:
    """The right way to make a step, and the wrong ones where that does not explain what was seen.

    Arguments: `has_guessed` tells the branches that suppose a mistake that nothing told of.
    """
    right, sight = bench.right(step), bench.sight
    is_suspect = right.misfit[0] > SUSPECT
    is_guess = blind and not sight.tells_place
    if not is_guess and not is_suspect.any():
        return right
    wrong = bench.wrong(step)
    if is_guess:
        wrong.cost[:, has_guessed & ~is_suspect] = np.inf
    ways = right + wrong
    if not sight or not is_suspect.any():
        return ways
    slips = bench.slips(step) if isinstance(step, Given) else None
    if slips is not None:
        ways += slips
        if not sight.tells_place:
            # Of a computed length seen as a length alone, whatever it is may be a slip.
            return ways
    return ways + bench.something_else(right)


@dataclass(slots=True)
class _Branches:
    """All accounts so far, arrays of shape (branches,)."""

    nodes: dict[str, ComplexArray]
    known: dict[str, FloatArray]
    turned: dict[str, ComplexArray]
    cost: FloatArray
    care: FloatArray
    is_blind: BoolArray
    made: list[tuple[Mistake, ...]]
    unexplained: list[tuple[str, ...]]
    right: dict[str, FloatArray]

    def sight(self, seen: tuple[Observation, ...], figure: str) -> NodeObservations:
        """What was seen of a node of a figure."""
        return NodeObservations(seen, self.turned.get(figure), self.care)

    def go_on(self, step: Step, figure: str, seen: tuple[Observation, ...], ways: StepAlternatives) -> None:
        """Each way in each branch: the likeliest of them."""
        costs, place, right = self.cost + ways.cost, ways.place[0], ways.misfit[0]
        if len(ways.mistakes) == 1:
            self.cost = costs[0]
        else:
            which, index = self._likeliest(costs)
            place, right = ways.place[which, index], right[index]
            self._take(index)
            self.cost = costs[which, index]
            if not any(one.has_direction for one in seen):
                self.is_blind = self.is_blind | ((which > 0) & (right <= SUSPECT))
            for row, (way, branch) in enumerate(zip(which.tolist(), index.tolist(), strict=True)):
                self.made[row] += ways.made(way, branch)
                if ways.is_something_else(way):
                    self.unexplained[row] += (step.node,)
        if seen:
            sight = self.sight(seen, figure)
            place = sight.settled(place, self.nodes)
            self.right[step.node] = np.sqrt(right / sight.freedom)
        self.nodes[step.node] = place

    def _likeliest(self, costs: FloatArray) -> tuple[IntArray, IntArray]:
        """The ways and branches that go on, by hands of each care the likeliest first."""
        kept = []
        for care in np.unique(self.care):
            columns = np.flatnonzero(self.care == care)
            own = costs[:, columns]
            order = np.argsort(own, axis=None)[:AT_MOST]
            least = own.flat[order[0]]
            order = order[own.flat[order] <= least + WITHIN] if np.isfinite(least) else order[:1]
            way, column = np.unravel_index(order, own.shape)
            kept.append((way, columns[column]))
        which, index = (np.concatenate(parts) for parts in zip(*kept, strict=True))
        return which, index

    def _take(self, index: IntArray) -> None:
        """Only these branches, in this order; one may be taken several times."""
        arrays: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]
        for arrays in (self.nodes, self.known, self.turned, self.right):  # type: ignore[assignment]
            arrays.update({name: array[index] for name, array in arrays.items() if np.ndim(array)})
        self.care, self.is_blind = self.care[index], self.is_blind[index]
        self.made = [self.made[i] for i in index]
        self.unexplained = [self.unexplained[i] for i in index]

    def accounts(self) -> list[Replay]:
        """What the branches have come to, the likeliest first."""
        return [
            Replay(float(self.cost[i]), float(self.care[i]), self.made[i], self.unexplained[i], self, i)
            for i in np.argsort(self.cost, kind="stable").tolist()
            if np.isfinite(self.cost[i])
        ]


def _open(drawing: Drawing, roots: Sequence[Root], cares: Sequence[float]) -> _Branches:
    """A branch for each root and hand."""
    starts = [(root, care) for care in cares for root in roots]
    known = {name: np.asarray(value) for name, value in drawing.parameters.items()}
    for name in {name for root in roots for name in root.parameters}:
        usual = known[name]
        known[name] = np.array([float(np.ravel(root.parameters.get(name, usual))[0]) for root, _ in starts])
    plans = {plan for root in roots for plan in root.turned}
    return _Branches(
        nodes={},
        known=known,
        turned={plan: np.array([root.turned.get(plan, 1.0) for root, _ in starts]) for plan in plans},
        cost=np.array([root.cost for root, _ in starts]),
        care=np.array([care for _, care in starts]),
        is_blind=np.zeros(len(starts), np.bool_),
        made=[root.made for root, _ in starts],
        unexplained=[()] * len(starts),
        right={},
    )
