"""Which mistakes explain what is off: the drawing replayed with and without them.

`reference.replay` gives accounts of the drawing, each with the mistakes that it supposes; the simplest
one that fits is told. First the drawing is replayed step by step. Only where that leaves something off
are mistakes of the whole drawing tried as well (another variant's data, a plan turned as a whole,
letters swapped) and mistakes at steps of which nothing was seen. How sure a mistake is, is its share
among all accounts; what is not told apart from it is named as its rival. A hand that errs everywhere is
measured by its own carelessness: a drawing that is right is never accused.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from grader.diagnosis.case import Case
from grader.diagnosis.telling import SCALES, told
from grader.outcomes import NamedMistake
from grader.records import MECHANISM
from reference.mistakes import Drawing, Mistake, commit
from reference.parameters import parameters_of
from reference.replay import RARITY, Account, Root, Work, replay

__all__ = ["LEAST_CONFIDENCE", "Case", "Diagnosis", "diagnose"]

LEAST_CONFIDENCE = 0.6
"""An explanation less certain than this is not told."""
FURTHER_SCALE = 4.0
"""What it costs to suppose a further wrong scale: it often comes from the first."""
CERTAIN = 0.9
"""From this confidence on what follows from a mistake that nothing else shows is credited."""
NO_STEPS = frozenset({"scale_wrong", "labels_swapped"})
"""Mistakes that change no step: what follows from them is told by the scales and by the letters."""
BEYOND_DOUBT = 20.0
"""A mistake is named only where the drawing made rightly by any hand costs this much more: 1 in 20,000."""
LEAST_WRONG = 0.06
"""A scale off by a smaller share than this is nobody's mistake by name: a hand may draw so."""
USUAL = 1.0
HANDS = (0.6, USUAL, 1.6, 2.5, 4.0)
"""The hands supposed, as multiples of a usual one's standard deviations."""


@dataclass(frozen=True, slots=True)
class Diagnosis:
    """What explains a drawing.

    Attributes
    ----------
    mistakes : those that explain what was lost, in the order of construction; none where nothing does
    drawn : the drawing with those mistakes in it that are certain, and
    wrong : the nodes at which it is wrong, or the mechanism; none where it is the right one
    """

    mistakes: tuple[NamedMistake, ...] = ()
    drawn: Drawing | None = None
    wrong: frozenset[str] = frozenset()


def diagnose(case: Case) -> Diagnosis:
    """The mistakes of the simplest account that fits, where a right drawing would not be believed."""
    if not case.lost and not case.followed:
        return Diagnosis()
    roots = [Root(), *_other_scales(case)]
    accounts = replay(case.drawing, case.work, roots, case.skill, cares=HANDS)
    innocent = _innocent(accounts)
    if accounts and not _is_clear(accounts, case):
        accounts = _looked_into(case, roots, accounts)
    if not accounts or innocent - accounts[0].cost < BEYOND_DOUBT:
        return Diagnosis()
    mistakes = told(accounts, case, LEAST_CONFIDENCE)
    sure = {(one.code, one.at) for one in mistakes if one.confidence >= CERTAIN}
    certain = [one for one in accounts[0].made if one.code not in NO_STEPS and (one.code, one.at) in sure]
    joints = {step.node for step in case.drawing.construction.figures[MECHANISM]}
    wrong = {MECHANISM if one.at in joints or one.code == "other_variant" else one.at for one in certain}
    return Diagnosis(mistakes, _with(certain, case.drawing), frozenset(wrong))


def _with(mistakes: Sequence[Mistake], drawing: Drawing) -> Drawing:
    """A drawing with mistakes in it, at its own scales."""
    for one in mistakes:
        if one.code == "other_variant":
            drawing = Drawing(drawing.construction, {**drawing.parameters, **one.parameters})
        else:
            drawing = commit(one, drawing)
    return drawing


def _looked_into(case: Case, roots: Sequence[Root], accounts: Sequence[Account]) -> list[Account]:
    """The accounts with mistakes of the whole drawing among them, and with guesses at what was not seen.

    A careless hand is also taken for a usual one that has made some mistake. What one mistake explains,
    places and all, is not sought in the whole drawing.
    """
    best = accounts[0]
    if not _is_explained(best) or not all(one.has_direction for one in case.work.seen):
        roots = [*roots, *_of_the_whole(case)]
    cares = sorted({best.care, min(best.care, USUAL)})
    found = replay(case.drawing, case.work, roots, case.skill, cares=cares, blind=True) or [*accounts]
    for swap in _swaps(case.drawing, found[0]):
        root, work = Root((swap,), cost=RARITY[swap.code]), _renamed(case.work, swap.other)
        found += replay(case.drawing, work, [root], case.skill, cares=cares)
    return sorted(found, key=lambda account: account.cost)


def _is_explained(account: Account) -> bool:
    """Whether a usual hand and one mistake at most explain everything."""
    return not account.unexplained and len(account.made) <= 1 and account.care <= USUAL


def _innocent(accounts: Sequence[Account]) -> float:
    """What the account costs in which everything was made rightly; infinite where it is beyond belief."""
    return min((account.cost for account in accounts if account.is_innocent), default=math.inf)


def _is_clear(accounts: Sequence[Account], case: Case) -> bool:
    """Whether a usual hand made everything rightly, or one mistake at a step whose beginnings were seen.

    What goes wrong in a mechanism that nobody saw shows in more than one step.
    """
    best, construction = accounts[0], case.drawing.construction
    if not _is_explained(best):
        return False
    if not best.made:
        return True
    places = {one.node for one in case.work.seen if one.has_direction} | {*construction.poles.values()}
    joints = {step.node for step in construction.figures[MECHANISM]}
    step = next((one for one in construction.steps if one.node == best.made[0].at), None)
    return step is not None and places.issuperset({step.node, *step.needs} - joints)


# Mistakes of the whole drawing --------------------------------------------------------------------


def _other_scales(case: Case) -> Iterator[Root]:
    """The drawing at the scales that it follows, where others were declared.

    A plan may be drawn to another scale throughout, or start from a crank's vector that is, while what is
    computed from it is computed at the scale declared.
    """
    factors = {
        name: float(case.drawing.parameters[name]) / followed for name, followed in case.followed.items()
    }
    made = tuple(
        Mistake("scale_wrong", name, factor=factor)
        for name, factor in factors.items()
        if abs(math.log(factor)) > LEAST_WRONG
    )
    if not made:
        return
    scales = {name: np.asarray(followed) for name, followed in case.followed.items()}
    starts = {
        name: value * factor
        for name, value in case.drawing.parameters.items()
        for scale, factor in factors.items()
        if name.startswith(f"{scale[1]}_")
    }
    for parameters in (scales, starts):
        yield Root(made, parameters, cost=RARITY["scale_wrong"] + FURTHER_SCALE * (len(made) - 1))


def _of_the_whole(case: Case) -> Iterator[Root]:
    """A plan turned as a whole; another variant's data."""
    for plan in case.drawing.construction.poles:
        for quarters in (1, 2, 3):
            turned = Mistake("figure_rotated", plan, quarters=quarters)
            yield Root((turned,), turned={plan: 1j**quarters}, cost=RARITY["figure_rotated"])
    yield from _other_variants(case)


def _other_variants(case: Case) -> Iterator[Root]:
    """Another student's data, all else right."""
    variants = case.assignment.variants()
    scales = case.assignment.scales(variants, kL=float(case.drawing.parameters["kL"]))
    together = parameters_of(case.assignment.mechanism(variants), scales.kL, scales.kv, scales.ka)
    table = {
        name: np.broadcast_to(value, (len(variants),))
        for name, value in together.items()
        if name not in SCALES - case.assumed and np.ndim(value) and np.ptp(value) > 0.0
    }
    for index, variant in enumerate(variants):
        if variant != case.variant and table:
            parameters = {name: np.asarray(value[index]) for name, value in table.items()}
            other = Mistake(
                "other_variant", "mechanism", n=variant.n, position=variant.position, parameters=parameters
            )
            yield Root((other,), parameters, cost=RARITY["other_variant"])


def _swaps(drawing: Drawing, account: Account) -> Iterator[Mistake]:
    """Two images of a plan with each other's letters, both of which are off by the likeliest account."""
    construction = drawing.construction
    off = {*account.unexplained, *(mistake.at for mistake in account.made)}
    for figure, pole in construction.poles.items():
        images = sorted(
            v.head for v in construction.vectors_of(figure) if v.tail == pole and v.part not in {"n", "c"}
        )
        for pair in combinations(images, 2):
            if off >= set(pair):
                yield Mistake("labels_swapped", pair[0], other=pair)


def _renamed(work: Work, pair: tuple[str, ...]) -> Work:
    """What was drawn, under the right names where two letters were swapped."""
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    seen = (
        replace(one, node=other.get(one.node, one.node), tail=other.get(one.tail or "", one.tail))
        for one in work.seen
    )
    return replace(work, seen=tuple(seen))
