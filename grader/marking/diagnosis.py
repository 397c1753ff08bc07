"""Diagnosis: which mistakes explain the residuals of a drawing.

`reference.replay.replay` gives explanations of the drawing, each with its mistakes. First the drawing is
replayed step by step. Only where that leaves residuals, mistakes of the whole drawing are tried as well
(another variant's data, a plan turned as a whole, letters swapped) and mistakes at steps without an
observation. The confidence in a mistake is its share of the probability of all explanations; a mistake
that the evidence does not distinguish from it is its rival. The size of drafting errors is estimated on
the drawing itself, so that a right drawing has no mistake named.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from grader.outcomes import NamedMistake
from grader.records import MECHANISM
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.construction.elements import Along, Line
from reference.construction.graph import Construction, parameters_of
from reference.construction.mistakes import RPM_FACTOR, Drawing, Mistake, affected, commit
from reference.construction.steps import Step, TwoLines
from reference.construction.uncertainty import Skill
from reference.replay.explanations import RARITY, Observations
from reference.replay.replay import Replay, Root, replay

OF_THE_WHOLE = frozenset({"labels_swapped", "figure_rotated", "other_variant"})


# The explanations of a drawing ---------------------------------------------------------------------

FURTHER_SCALE = 4.0
"""What it costs to suppose a further wrong scale: it often comes from the first."""
BEYOND_DOUBT = 20.0
"""A mistake is named only where the drawing made rightly by any hand costs this much more: 1 in 20,000."""
LEAST_WRONG = 0.06
"""Of a scale's logarithm: a smaller error is no mistake to be named, drafting errors reach it."""
USUAL = 1.0
CARES = (0.6, USUAL, 1.6, 2.5, 4.0)
"""The sizes of drafting errors that are tried, as multiples of the usual ones."""


@dataclass(frozen=True, slots=True)
class Case:
    """A drawing to explain.

    Attributes
    ----------
    drawing : how it should have been drawn, at the scales declared
    observations : the drawing as read or measured
    assignment, variant : the student's
    skill : usual drafting errors
    followed : scales that the drawing follows although others were declared
    assumed : scales that nobody declared
    """

    drawing: Drawing
    observations: Observations
    assignment: Assignment
    variant: Variant
    skill: Skill
    followed: Mapping[str, float] = field(default_factory=dict)
    assumed: frozenset[str] = frozenset()


def explained(case: Case) -> tuple[Replay, ...]:
    """The explanations of a drawing, the likeliest first; none where it may well be right."""
    roots = [Root(), *_other_scales(case)]
    explanations = replay(case.drawing, case.observations, roots, case.skill, cares=CARES)
    innocent = _cost_if_right(explanations)
    if explanations and not _is_clear(explanations, case):
        explanations = _searched_further(case, roots, explanations)
    if not explanations or innocent - explanations[0].cost < BEYOND_DOUBT:
        return ()
    return tuple(explanations)


def _searched_further(case: Case, roots: Sequence[Root], explanations: Sequence[Replay]) -> list[Replay]:
    """The explanations with mistakes of the whole drawing, and at steps without an observation.

    Large drafting errors are also tried as usual ones with some mistake. Where one mistake explains all, and
    directions were observed, mistakes of the whole drawing are not tried.
    """
    best = explanations[0]
    if not _is_explained(best) or not all(one.has_direction for one in case.observations.entries):
        roots = [*roots, *_of_the_whole(case)]
    cares = sorted({best.care, min(best.care, USUAL)})
    found = replay(case.drawing, case.observations, roots, case.skill, cares=cares, blind=True) or [
        *explanations
    ]
    for swap in _swaps(case.drawing, found[0]):
        root, observations = Root((swap,), cost=RARITY[swap.code]), _renamed(case.observations, swap.other)
        found += replay(case.drawing, observations, [root], case.skill, cares=cares)
    return sorted(found, key=lambda explanation: explanation.cost)


def _is_explained(explanation: Replay) -> bool:
    """Whether usual drafting errors and one mistake at most explain everything."""
    return not explanation.unexplained and len(explanation.made) <= 1 and explanation.care <= USUAL


def _cost_if_right(explanations: Sequence[Replay]) -> float:
    """The least cost of an explanation without mistakes; infinite where there is none."""
    return min(
        (explanation.cost for explanation in explanations if explanation.is_innocent), default=math.inf
    )


def _is_clear(explanations: Sequence[Replay], case: Case) -> bool:
    """Whether the best explanation needs no further search.

    It has no mistake, or one at a step whose node and sources were observed: a mistake in a mechanism
    that was not handed in shows in more than one step.
    """
    best, construction = explanations[0], case.drawing.construction
    if not _is_explained(best):
        return False
    if not best.made:
        return True
    places = {one.node for one in case.observations.entries if one.has_direction} | {
        *construction.poles.values()
    }
    joints = {step.node for step in construction.figures[MECHANISM]}
    step = next((one for one in construction.steps if one.node == best.made[0].at), None)
    return step is not None and places.issuperset({step.node, *step.needs} - joints)


def _other_scales(case: Case) -> Iterator[Root]:
    """Roots with the scales that the drawing follows, where others were declared.

    A plan may be drawn to another scale throughout, or only its crank's vector, while what is computed
    from that is computed at the declared scale.
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
    """Roots with a plan turned as a whole, or with another variant's data."""
    for plan in case.drawing.construction.poles:
        for quarters in (1, 2, 3):
            turned = Mistake("figure_rotated", plan, quarters=quarters)
            yield Root((turned,), turned={plan: 1j**quarters}, cost=RARITY["figure_rotated"])
    yield from _other_variants(case)


def _other_variants(case: Case) -> Iterator[Root]:
    """Roots with another variant's data, all else right."""
    variants = case.assignment.variants()
    scales = case.assignment.scales(variants, kL=float(case.drawing.parameters["kL"]))
    together = parameters_of(case.assignment.mechanism(variants), scales.kL, scales.kv, scales.ka)
    table = {
        name: np.broadcast_to(value, (len(variants),))
        for name, value in together.items()
        if name not in set(SCALE_NAMES) - case.assumed and np.ndim(value) and np.ptp(value) > 0.0
    }
    for index, variant in enumerate(variants):
        if variant != case.variant and table:
            parameters = {name: np.asarray(value[index]) for name, value in table.items()}
            other = Mistake(
                "other_variant", "mechanism", n=variant.n, position=variant.position, parameters=parameters
            )
            yield Root((other,), parameters, cost=RARITY["other_variant"])


def _swaps(drawing: Drawing, explanation: Replay) -> Iterator[Mistake]:
    """Pairs of images in one plan that may have each other's letters: both are wrong in the explanation."""
    construction = drawing.construction
    off = {*explanation.unexplained, *(mistake.at for mistake in explanation.made)}
    for figure, pole in construction.poles.items():
        images = sorted(
            v.head for v in construction.vectors_of(figure) if v.tail == pole and v.part not in {"n", "c"}
        )
        for pair in combinations(images, 2):
            if off >= set(pair):
                yield Mistake("labels_swapped", pair[0], other=pair)


def _renamed(observations: Observations, pair: tuple[str, ...]) -> Observations:
    """The observations with the names of two nodes exchanged."""
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    entries = (
        replace(one, node=other.get(one.node, one.node), tail=other.get(one.tail or "", one.tail))
        for one in observations.entries
    )
    return replace(observations, entries=tuple(entries))


# What was drawn by mistake, where that is certain --------------------------------------------------

CERTAIN = 0.9
"""From this confidence on what follows from a mistake that nothing else shows is credited."""
NO_STEPS = frozenset({"scale_wrong", "labels_swapped"})
"""Mistakes that change no step: scales and letters already say what follows from them."""


def drawn_instead(explanations: Sequence[Replay], case: Case) -> tuple[Drawing, frozenset[str]]:
    """The drawing with those mistakes in it that are certain, and the nodes at which it is wrong.

    A wrong mechanism counts as a whole (`MECHANISM`); the right drawing has no wrong nodes.
    """
    joints = {step.node for step in case.drawing.construction.figures[MECHANISM]}
    certain = [one for one in sure_of(explanations, CERTAIN) if one.code not in NO_STEPS]
    wrong = {MECHANISM if one.at in joints or one.code == "other_variant" else one.at for one in certain}
    return _with(certain, case.drawing), frozenset(wrong)


def _with(mistakes: Sequence[Mistake], drawing: Drawing) -> Drawing:
    """A drawing with mistakes in it, at its own scales."""
    for one in mistakes:
        if one.code == "other_variant":
            drawing = Drawing(drawing.construction, {**drawing.parameters, **one.parameters})
        else:
            drawing = commit(one, drawing)
    return drawing


# The mistakes that are named -----------------------------------------------------------------------

LEAST_CONFIDENCE = 0.6
"""A mistake less certain than this is not named."""
SURE_TOGETHER = 0.8
"""A mistake is named with its rivals where their probability together is at least this."""
LEAST_RIVAL = 0.1
"""A rival less likely than this is not named."""
MOST_RIVALS = 3
SUSPICIOUS, GROSS = 2.0, 5.0
"""RMS misfits of a step in standard deviations of this drawing's errors: between the two a mistake is too
slight to be named. (Below the first the mistake shows elsewhere.)"""
Key = tuple[str, str]


@dataclass(frozen=True, slots=True)
class Lost:
    """The criteria that lost points, or may lose some, by the vector and by the scale they ask for."""

    vectors: Mapping[str, str]
    scales: Mapping[str, str]


def named(explanations: Sequence[Replay], construction: Construction, lost: Lost) -> tuple[NamedMistake, ...]:
    """The mistakes of the likeliest explanation that are sure enough, in the order of construction."""
    if not explanations:
        return ()
    best, shares = explanations[0], _Shares(explanations)
    explains, mistakes = _losses_explained(best, construction, lost), []
    for mistake in _in_order(best.made, construction):
        key, share = _key(mistake), shares.of(_key(mistake))
        rivals = shares.rivals(key, {_key(one) for one in best.made})
        together = share + sum(shares.instead(key, _key(one)) for one in rivals)
        is_sure = share >= LEAST_CONFIDENCE or (together >= SURE_TOGETHER and rivals)
        is_shown = explains[mistake] or mistake.code == "other_variant"
        if is_shown and is_sure and not _is_slight(mistake, best):
            others = tuple(_record(one, construction, (), shares.instead(key, _key(one))) for one in rivals)
            mistakes.append(_record(mistake, construction, tuple(explains[mistake]), share, others))
    return tuple(mistakes)


def sure_of(explanations: Sequence[Replay], least: float) -> list[Mistake]:
    """The mistakes of the likeliest explanation that are this sure, unless they are slight."""
    if not explanations:
        return []
    shares = _Shares(explanations)
    return [
        one
        for one in explanations[0].made
        if shares.of(_key(one)) >= least and not _is_slight(one, explanations[0])
    ]


def _key(mistake: Mistake) -> Key:
    return mistake.code, mistake.at


def _is_slight(mistake: Mistake, explanation: Replay) -> bool:
    """Whether the residual at the mistake's step is small enough for drafting errors."""
    if mistake.code in OF_THE_WHOLE:
        return False
    return SUSPICIOUS < explanation.right.get(mistake.at, 0.0) < GROSS


class _Shares:
    """The share of the probability that explanations with a mistake have."""

    def __init__(self, explanations: Sequence[Replay]) -> None:
        least = explanations[0].cost
        weights = [math.exp((least - explanation.cost) / 2.0) for explanation in explanations]
        whole = sum(weights)
        self._weights = [
            ({_key(one): one for one in explanation.made}, weight / whole)
            for explanation, weight in zip(explanations, weights, strict=True)
        ]

    def of(self, key: Key) -> float:
        """The share of the explanations with a mistake."""
        return sum(weight for made, weight in self._weights if key in made)

    def instead(self, key: Key, other: Key) -> float:
        """The share of the explanations with another mistake and without the first."""
        return sum(weight for made, weight in self._weights if other in made and key not in made)

    def rivals(self, key: Key, best: set[Key]) -> list[Mistake]:
        """The mistakes of explanations without a mistake, the likeliest first."""
        others = {name: one for made, _ in self._weights if key not in made for name, one in made.items()}
        likely = [name for name in others if name not in best and self.instead(key, name) >= LEAST_RIVAL]
        likely.sort(key=lambda name: -self.instead(key, name))
        return [others[name] for name in likely[:MOST_RIVALS]]


def _in_order(made: Sequence[Mistake], construction: Construction) -> list[Mistake]:
    """Mistakes of the whole first, then step by step."""
    order = [step.node for step in construction.steps]
    return sorted(made, key=lambda one: order.index(one.at) if one.at in order else -1)


def _losses_explained(
    explanation: Replay, construction: Construction, lost: Lost
) -> dict[Mistake, list[str]]:
    """The lost criteria that each mistake explains: each is given to the last mistake upstream."""
    made = _in_order(explanation.made, construction)
    explains: dict[Mistake, list[str]] = {
        mistake: [name for scale, name in lost.scales.items() if _is_about(mistake, scale)]
        for mistake in made
    }
    reach = {mistake: affected(mistake, construction) for mistake in made}
    for name, criterion in lost.vectors.items():
        vector = construction.vectors[name]
        if vector.head in explanation.unexplained:
            continue
        touching = [
            one for one in made if _touches(one, vector.scale, {vector.tail, vector.head}, reach[one])
        ]
        own = [one for one in touching if one.at == vector.head]
        for mistake in (own or touching)[-1:]:
            explains[mistake].append(criterion)
    return explains


def _touches(mistake: Mistake, scale: str, ends: set[str], reach: frozenset[str]) -> bool:
    if mistake.at in SCALE_NAMES:
        return mistake.at in {scale, "kL"}
    if mistake.code == "labels_swapped":
        return bool(ends & set(mistake.other))
    return bool(ends & reach)


def _is_about(mistake: Mistake, scale: str) -> bool:
    return mistake.at == scale or mistake.code == "other_variant"


RPM_WITHIN = 0.03
"""Relative: a scale wrong by 30/pi (squared for accelerations) this nearly was computed from rev/min."""
LINE_MISTAKES = frozenset({"parallel_for_perpendicular", "wrong_link", "wrong_intersection"})


def _record(
    mistake: Mistake,
    construction: Construction,
    explains: tuple[str, ...],
    confidence: float,
    rivals: tuple[NamedMistake, ...] = (),
) -> NamedMistake:
    if mistake.code == "scale_wrong":
        mistake = replace(mistake, code=_code_of_scale(mistake.at, mistake.factor))
    is_line = mistake.code in LINE_MISTAKES
    line = _line_of(construction.step(mistake.at), mistake.slot) if is_line else {}
    return NamedMistake(mistake, explains, min(confidence, 1.0), line, rivals)


def _line_of(step: Step, slot: int) -> dict[str, str]:
    """The parameters that describe a step's line: ``from`` a node, its ``link``, ``line`` of a guide."""
    line = (step.first, step.second)[slot] if isinstance(step, TwoLines) else None
    if not isinstance(line, Line):
        return {}
    params = {"from": line.through}
    if line.along.quarters % 2 == 0:
        # Perpendiculars belong to turning links, all other lines are along guides.
        params["line"] = "guide"
    if isinstance(line.along, Along):
        params["link"] = line.along.tail + line.along.head
    return params


def _code_of_scale(name: str, factor: float) -> str:
    powers = {"kv": 1, "ka": 2}
    rpm = RPM_FACTOR ** powers.get(name, 0)
    return "rpm_not_converted" if name in powers and abs(factor / rpm - 1.0) <= RPM_WITHIN else "scale_wrong"
