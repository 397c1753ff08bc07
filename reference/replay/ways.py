"""The ways to make one step: the right one, the mistakes known for it, a slip, and something else."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from reference import geometry
from reference.construction import Construction
from reference.elements import Coriolis, Errors, Normal, View
from reference.geometry import ComplexArray, FloatArray
from reference.hand import SMALL, Skill, hand_errors
from reference.mistakes import Mistake, changed_step, mistakes_of_step
from reference.numbers import dot
from reference.replay.costs import RARITY
from reference.replay.sight import Sight
from reference.steps import Given, Step, TwoLines

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
            self._errors[step.node] = hand_errors(step, self.skill)
        return self._errors[step.node]


KEPT = 32
_kept: dict[tuple[int, Skill], Repertoire] = {}


def repertoire_of(construction: Construction, skill: Skill) -> Repertoire:
    """The repertoire of a construction, kept: a class draws one and the same."""
    key = (id(construction), skill)
    if key not in _kept or _kept[key].construction is not construction:
        if len(_kept) >= KEPT:
            _kept.clear()
        _kept[key] = Repertoire(construction, skill)
    return _kept[key]


@dataclass(frozen=True, slots=True)
class Ways:
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

    def made(self, way: int, branch: int) -> tuple[Mistake, ...]:
        """The mistake of a way in a branch, as a tuple of one or none."""
        mistake = self.mistakes[way]
        if mistake is None:
            return ()
        if mistake.code == SLIP and self.factors is not None:
            mistake = replace(mistake, factor=float(self.factors[branch]))
        return (mistake,)

    def is_something_else(self, way: int) -> bool:
        """Whether nobody knows what was done."""
        return way >= len(self.mistakes) - self.others

    def __add__(self, more: "Ways") -> "Ways":
        return Ways(
            np.concatenate((self.place, more.place)),
            np.concatenate((self.cost, more.cost)),
            np.concatenate((self.misfit, more.misfit)),
            self.mistakes + more.mistakes,
            self.factors if more.factors is None else more.factors,
            self.others + more.others,
        )


@dataclass(frozen=True, slots=True)
class Bench:
    """Where a step is made: the nodes so far in each branch, and what was seen of the new one."""

    nodes: Mapping[str, ComplexArray]
    known: Mapping[str, FloatArray]
    sight: Sight
    repertoire: Repertoire

    @property
    def count(self) -> int:
        """How many branches there are."""
        return len(self.sight.care)

    def right(self, step: Step) -> Ways:
        """The step as it should be made."""
        return self._ways(step, [(None, step)])

    def wrong(self, step: Step) -> Ways:
        """The step with each mistake in it."""
        return self._ways(step, self.repertoire.wrong(step))

    def slips(self, step: Given) -> Ways | None:
        """The right direction with a length that was computed wrongly, as long as it was drawn."""
        seen, view = self.sight.seen, View(self.nodes, self.known)
        one = next((one for one in seen if one.tail == step.start or one.has_direction), None)
        if one is None or not isinstance(step.length, Normal | Coriolis):
            return None
        right = step.factor * step.length.at(view)
        if one.has_direction:
            tail = 0.0 if one.tail is None else self.nodes[one.tail]
            drawn = dot(tail + self.sight.value(one) - self.nodes[step.start], step.along.at(view))
        else:
            drawn = np.abs(one.value) * np.sign(right)
        factors = np.asarray(drawn / right)
        is_within = (factors > LEAST_FACTOR) & (factors < MOST_FACTOR)
        factors = np.broadcast_to(np.where(is_within, factors, np.nan), (self.count,))
        changed = replace(step, factor=step.factor * factors)  # type: ignore[arg-type]
        return replace(self._ways(step, [(Mistake(SLIP, step.node), changed)]), factors=factors)

    def something_else(self, right: Ways) -> Ways:
        """The node where it was drawn, whatever made it; from lengths alone on either side."""
        sight, nodes = self.sight, self.nodes
        start = np.where(np.isfinite(right.place[0]), right.place[0], 0.0)
        starts = [start]
        if not sight.tells_place and len(sight.seen) > 1:
            tails = [0.0 if one.tail is None else nodes[one.tail] for one in sight.seen[:2]]
            base = np.asarray(tails[1] - tails[0])
            along = np.where(np.abs(base) > 0.0, base / np.abs(base), 1.0)
            starts.append(np.asarray(tails[0] + along**2 * np.conj(start - tails[0])))
        place = np.array([sight.settled(one, nodes) for one in starts])
        zero = np.zeros(place.shape)
        return Ways(place, zero + sight.anywhere, zero, (None,) * len(starts), others=len(starts))

    def _ways(self, step: Step, steps: Sequence[tuple[Mistake | None, Step]]) -> Ways:
        mistakes = tuple(mistake for mistake, _ in steps)
        if not steps:
            empty = np.zeros((0, self.count))
            return Ways(empty.astype(np.complex128), empty, empty, ())
        place, moved = self._placed(step, [changed for _, changed in steps])
        misfit, cost = self.sight.held_against(place, moved, self.nodes)
        rarity = np.array([0.0 if one is None else RARITY[one.code] for one in mistakes])
        return Ways(place, cost + rarity[:, None], misfit, mistakes)

    def _placed(self, step: Step, steps: Sequence[Step]) -> tuple[ComplexArray, ComplexArray | None]:
        """Where each puts the node, and how far each act of a usual hand moves it (ways, acts, branches)."""
        errors = self.repertoire.errors(step) if self.sight.tells_place else {}
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
