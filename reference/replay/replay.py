"""Replay a finished drawing step by step, to find how each step was made.

Every branch of the replay is one explanation of the drawing: how each step was made, and where its node lies.
If the right step does not explain the drawing, each mistake that `reference.construction.mistakes` has for
that step opens a branch, and an unknown way one more. Later steps start from what was drawn, as the student
did, so that one mistake does not hide the next. Branches are arrays and are evaluated together, for drafting
errors of several sizes. The alternatives for one step and their costs are in `reference.replay.explanations`.
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
    COST_WINDOW,
    MOST_BRANCHES,
    SUSPECT,
    BoolArray,
    NodeObservations,
    Observation,
    Observations,
    StepAlternatives,
    StepContext,
    by_node,
    measured_nodes,
    needed_nodes,
    repertoire_of,
)

IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]


@dataclass(frozen=True, slots=True)
class Root:
    """The start of an explanation: mistakes of the whole drawing, and what they change.

    Attributes
    ----------
    parameters : those that differ
    turned : by plan, the factor by which it is turned as a whole
    cost : of these mistakes
    unexplained : nodes whose steps were made in an unknown way, by data of their own
    """

    made: tuple[Mistake, ...] = ()
    parameters: Parameters = field(default_factory=dict)
    turned: Mapping[str, complex] = field(default_factory=dict)
    cost: float = 0.0
    unexplained: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Replay:
    """One explanation of a drawing.

    Attributes
    ----------
    care : drafting errors as a multiple of the usual ones
    made : the mistakes, in the order of construction
    unexplained : nodes whose steps were made in an unknown way
    spent : by figure, its part of the cost; the first one includes the cost of the whole drawing
    not_explained : the figures in which nothing belongs together, see `reference.replay.nothing`
    branches, index : all branches of the replay, and the index of this one
    """

    cost: float
    care: float
    made: tuple[Mistake, ...]
    unexplained: tuple[str, ...]
    branches: "_Branches" = field(repr=False)
    index: int
    spent: Mapping[str, float] = field(default_factory=dict)
    not_explained: frozenset[str] = frozenset()

    @property
    def is_innocent(self) -> bool:
        """True if it has no mistake and no unexplained step."""
        return not self.made and not self.unexplained

    @property
    def right(self) -> Mapping[str, float]:
        """By observed node the root mean square misfit of the right step in standard deviations."""
        return {node: float(misfit[self.index]) for node, misfit in self.branches.right.items()}


def replay(
    drawing: Drawing,
    observations: Observations,
    roots: Sequence[Root],
    skill: Skill,
    *,
    cares: Sequence[float] = (1.0,),
    blind: bool = False,
) -> list[Replay]:
    """Return the explanations of a drawing, the likeliest first.

    Arguments
    ---------
    drawing : the right one at its scales, parameters scalar
    skill : usual drafting errors
    cares : the sizes of drafting errors to try, as multiples of the usual ones
    blind : try mistakes also at steps whose node was not observed, one in each explanation
    """
    construction, by_name = drawing.construction, by_node(drawing.construction, observations.entries)
    branches = _open(drawing, roots, cares, observations.cost)
    needed = needed_nodes(construction, by_name)
    repertoire, rough = repertoire_of(construction, skill), measured_nodes(by_name)
    with np.errstate(all="ignore"):
        for figure, steps in construction.figures.items():
            sketch = {
                name: np.asarray(place) for name, place in observations.sketches.get(figure, {}).items()
            }
            measured = {step.node: rough[step.node] for step in steps if step.node in rough}
            for step in steps:
                if step.node in needed:
                    if isinstance(step, Given) and step.node not in by_name and step.start in measured:
                        # A drawn vector inherits the error of its start.
                        measured[step.node] = measured[step.start]
                    here, nodes = by_name.get(step.node, ()), ChainMap(sketch, branches.nodes)
                    observed = branches.observed(here, figure)
                    context = StepContext(
                        nodes,
                        branches.known,
                        observed,
                        repertoire,
                        measured,
                        observations.directions_rad,
                        observations.blank,
                    )
                    branches.go_on(
                        step, figure, here, _alternatives(step, context, branches.is_blind, blind=blind)
                    )
            branches.spent[figure] = branches.cost
    return branches.explanations()


def _alternatives(
    step: Step, context: StepContext, has_guessed: BoolArray, *, blind: bool
) -> StepAlternatives:
    """Return the right step, and the wrong ones if it does not explain the observations.

    Arguments: `has_guessed` marks the branches that already have a mistake without an observation.
    """
    right, observed = context.right(step), context.observed
    is_suspect = right.misfit[0] > SUSPECT
    is_guess = blind and not observed.fixes_place
    if not is_guess and not is_suspect.any():
        return right
    wrong = context.by_similarity(step, is_suspect) + context.wrong(step)
    if is_suspect.any() or isinstance(step, Given):
        rarer = context.rarer(step)
        if not isinstance(step, Given):
            rarer.cost[:, ~is_suspect] = np.inf
        wrong += rarer
    if is_guess:
        wrong.cost[:, has_guessed & ~is_suspect] = np.inf
    alternatives = right + wrong
    if not observed or not is_suspect.any():
        return alternatives
    slips = context.slips(step) if isinstance(step, Given) else None
    if slips is not None:
        alternatives += slips
        if not observed.fixes_place:
            # Where a computed length alone is observed, any value may be a slip.
            return alternatives
    return alternatives + context.something_else(right)


@dataclass(slots=True)
class _Branches:
    """All explanations so far, arrays of shape (branches,)."""

    nodes: dict[str, ComplexArray]
    known: dict[str, FloatArray]
    turned: dict[str, ComplexArray]
    cost: FloatArray
    care: FloatArray
    is_blind: BoolArray
    made: list[tuple[Mistake, ...]]
    unexplained: list[tuple[str, ...]]
    right: dict[str, FloatArray]
    spent: dict[str, FloatArray] = field(default_factory=dict)
    """By figure, the cost up to its end."""

    def observed(self, entries: tuple[Observation, ...], figure: str) -> NodeObservations:
        """Return the observations of a node, with the turn and the care of each branch."""
        return NodeObservations(entries, self.turned.get(figure), self.care)

    def go_on(
        self, step: Step, figure: str, entries: tuple[Observation, ...], alternatives: StepAlternatives
    ) -> None:
        """Continue with the likeliest pairs of an alternative and a branch."""
        costs, place, right = self.cost + alternatives.cost, alternatives.place[0], alternatives.misfit[0]
        if len(alternatives.mistakes) == 1:
            self.cost = costs[0]
        else:
            which, index = self._likeliest(costs)
            place, right = alternatives.place[which, index], right[index]
            self._take(index)
            self.cost = costs[which, index]
            if not any(one.has_direction for one in entries):
                self.is_blind = self.is_blind | ((which > 0) & (right <= SUSPECT))
            for row, (choice, branch) in enumerate(zip(which.tolist(), index.tolist(), strict=True)):
                self.made[row] += alternatives.made(choice, branch)
                if alternatives.is_something_else(choice):
                    self.unexplained[row] += (step.node,)
        if entries:
            observed = self.observed(entries, figure)
            place = observed.settled(place, self.nodes)
            self.right[step.node] = np.sqrt(right / observed.freedom)
        self.nodes[step.node] = place

    def _likeliest(self, costs: FloatArray) -> tuple[IntArray, IntArray]:
        """Return the alternatives and branches to continue, the likeliest first within each care."""
        chosen = []
        for care in sorted(set(self.care.tolist())):
            columns = np.flatnonzero(self.care == care)
            own = costs[:, columns]
            order = np.argsort(own, axis=None)[:MOST_BRANCHES]
            least = own.flat[order[0]]
            order = order[own.flat[order] <= least + COST_WINDOW] if np.isfinite(least) else order[:1]
            choice, column = np.unravel_index(order, own.shape)
            chosen.append((choice, columns[column]))
        which, index = (np.concatenate(parts) for parts in zip(*chosen, strict=True))
        return which, index

    def _take(self, index: IntArray) -> None:
        """Keep these branches, in this order; a branch may be kept several times."""
        arrays: dict[str, np.ndarray[tuple[int, ...], np.dtype[np.generic]]]
        for arrays in (self.nodes, self.known, self.turned, self.right, self.spent):  # type: ignore[assignment]
            arrays.update({name: array[index] for name, array in arrays.items() if np.ndim(array)})
        self.care, self.is_blind = self.care[index], self.is_blind[index]
        self.made = [self.made[i] for i in index]
        self.unexplained = [self.unexplained[i] for i in index]

    def explanations(self) -> list[Replay]:
        """Return the branches as explanations, the likeliest first."""
        before = [np.zeros(len(self.cost)), *self.spent.values()]
        spent = {
            figure: up_to - start for (figure, up_to), start in zip(self.spent.items(), before, strict=False)
        }
        return [
            Replay(
                float(self.cost[i]), float(self.care[i]), self.made[i], self.unexplained[i], self, i,
                {figure: float(part[i]) for figure, part in spent.items()},
            )
            for i in np.argsort(self.cost, kind="stable").tolist()
            if np.isfinite(self.cost[i])
        ]  # fmt: skip


def _open(drawing: Drawing, roots: Sequence[Root], cares: Sequence[float], cost: float) -> _Branches:
    """Open a branch for each root and care; `cost` is that of the observations."""
    starts = [(root, care) for care in cares for root in roots]
    known = {name: np.asarray(value) for name, value in drawing.parameters.items()}
    for name in {name for root in roots for name in root.parameters}:
        usual = known.get(name, np.asarray(1.0))
        known[name] = np.array([float(np.ravel(root.parameters.get(name, usual))[0]) for root, _ in starts])
    plans = {plan for root in roots for plan in root.turned}
    return _Branches(
        nodes={},
        known=known,
        turned={plan: np.array([root.turned.get(plan, 1.0) for root, _ in starts]) for plan in plans},
        cost=np.array([cost + root.cost for root, _ in starts]),
        care=np.array([care for _, care in starts]),
        is_blind=np.zeros(len(starts), np.bool_),
        made=[root.made for root, _ in starts],
        unexplained=[root.unexplained for root, _ in starts],
        right={},
    )
