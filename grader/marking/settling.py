"""Settle verdicts once all verdicts and mistakes are known together.

A verdict that waits is settled where so little is left open that no verdict changes the score by more than
the rubric's `stake`. Another student's data are never marked without saying so.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from grader.comparison.outcomes import left_open, settled_as, verdict_of
from grader.comparison.task import Task
from grader.comparison.verdicts import FULL, NONE, OPENING
from grader.given_data.owner import Owner
from grader.marking.drawn import NEARLY_CERTAIN
from grader.outcomes import CHARGED, NamedMistake, Outcome, Unfit
from grader.records import Reason
from grader.rubric import RubricFile
from reference.authored.assignment import SCALE_NAMES
from reference.quantities import sort_of, vector_of_value


def settled(outcome: Outcome, share: float, sure: float, *reasons: Reason) -> Outcome:
    """An outcome that is open, with the verdict of a share of its points."""
    followed = outcome.possible[1] == "follow_through" and share == FULL
    kept = outcome.reasons if share != FULL else ()
    told = (*reasons, *(one for one in kept if one.code not in OPENING))
    return settled_as(outcome, verdict_of(share, followed=followed), share, told, sure)


# Another student's data ----------------------------------------------------------------------------


def of_another(task: Task, outcomes: Sequence[Outcome], owner: Owner | None) -> tuple[Outcome, ...]:
    """The outcomes of a drawing by other data than the own, as the rubric's `other_variant` has it.

    Whatever is not sure, or was misread by the student, is left to a person.
    """
    if owner is None or task.rubric.doubt.other_variant == "follow":
        return tuple(outcomes)
    named = owner.named
    is_sure = named is not None and named.code == "other_variant" and owner.not_own >= NEARLY_CERTAIN
    earns_none = is_sure and task.rubric.doubt.other_variant == "none"

    def asked(one: Outcome) -> Outcome:
        if one.verdict == "not_judged" or not is_of(task, one.name, owner.part):
            return one
        return _unclear(one, owner) if named is None else _of_another(one, named, earns_none=earns_none)

    return tuple(map(asked, outcomes))


def is_of(task: Task, name: str, part: str) -> bool:
    """Return whether a criterion is about a part of the drawing: a plan, or all of it."""
    if part not in task.construction.poles:
        return True
    alike = frozenset(one for one in task.construction.poles if sort_of(one) == sort_of(part))
    return name == task.construction.vectors_of(part)[0].scale or _is_in(task, name, alike)


def _of_another(outcome: Outcome, named: NamedMistake, *, earns_none: bool) -> Outcome:
    whose = Reason(named.code, {"whose": _whose(named)})
    if earns_none:
        lost = settled(outcome, NONE, named.confidence, whose)
        return replace(lost, mistake=named.code, cause=named)
    return left_open(outcome, outcome.possible[1], outcome.shares[-1], (whose, *outcome.reasons))


def _unclear(outcome: Outcome, owner: Owner) -> Outcome:
    """Return an outcome left to a person, with the probability that the data are the student's own."""
    each = "; ".join(_whose(one) for one in (owner.likeliest, *owner.likeliest.rivals))
    why = Reason("data_unclear", {"whose": each, "confidence": owner.not_own})
    sure = outcome.probability * (1.0 - owner.not_own)
    return left_open(outcome, outcome.possible[1], outcome.shares[-1], (why, *outcome.reasons), sure)


def _whose(mistake: NamedMistake) -> str:
    """The number of another student, or the angle at which the crank stands."""
    return ", ".join(f"{key} = {value}" for key, value in mistake.detail.items() if key != "part")


# Nothing fits --------------------------------------------------------------------------------------

NOT_HANDED_IN = frozenset({"not_measured", "not_drawn"})
"""Reasons of a vector that nobody drew: nothing is there that could belong to the others."""
UNEXPLAINED = CHARGED | {"follow_through"}


def of_nothing(
    task: Task, outcomes: Sequence[Outcome], figures: frozenset[str]
) -> tuple[tuple[Outcome, ...], Unfit | None]:
    """The outcomes of a drawing of which nothing explains some figures, and how many vectors fit nothing.

    What such a figure loses goes to a person; so does what would follow rightly from wrong values in it.
    """
    lost = [
        one
        for one in outcomes
        if one.verdict in UNEXPLAINED and not NOT_HANDED_IN & one.codes and _is_in(task, one.name, figures)
    ]
    vectors = [one for one in outcomes if one.name in task.construction.vectors]
    unfit = Unfit(
        sum(one in lost for one in vectors), sum(one.measured.length_mm is not None for one in vectors)
    )
    if not lost or not unfit.vectors:
        return tuple(outcomes), None
    reason = Reason("not_explained", {"unfit": str(unfit.vectors), "of": str(unfit.of)})
    return tuple(_waiting(one, reason) if one in lost else one for one in outcomes), unfit


def _is_in(task: Task, name: str, figures: frozenset[str]) -> bool:
    """Return whether a vector, its value or an angular quantity belongs to these figures; a scale, to all."""
    construction, name = task.construction, vector_of_value(name) or name
    if name in SCALE_NAMES:
        return figures >= construction.poles.keys()
    if name in construction.rates:
        name = construction.rates[name].vector
    return name in construction.vectors and construction.figure_of(construction.vectors[name].head) in figures


def _waiting(outcome: Outcome, reason: Reason) -> Outcome:
    """An outcome that a person decides, between nothing and all points; it follows from nothing."""
    best = outcome.possible[1] if outcome.verdict != "none" else "full"
    return left_open(
        outcome, best, FULL, (reason, *(one for one in outcome.reasons if one.code != "follows"))
    )


# What is left --------------------------------------------------------------------------------------


def at_stake(rubric: RubricFile, outcomes: Sequence[Outcome]) -> tuple[Outcome, ...]:
    """The outcomes, settled in the student's favour where all that is open is worth less than the stake."""
    points: Mapping[str, float] = rubric.points
    waiting = [one for one in outcomes if one.verdict == "review"]
    open_points = {one.criterion: (one.shares[-1] - one.shares[0]) * points[one.criterion] for one in waiting}
    if not waiting or sum(open_points.values()) > rubric.doubt.stake * rubric.max_score:
        return tuple(outcomes)
    return tuple(
        settled(one, one.shares[-1], _probability_of_best(one), Reason("at_stake")) if one in waiting else one
        for one in outcomes
    )


def _probability_of_best(outcome: Outcome) -> float:
    is_proposed = outcome.proposed == outcome.shares[-1]
    return outcome.probability if is_proposed else 1.0 - outcome.probability
