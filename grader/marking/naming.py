"""Choose the mistakes of the explanations that are sure enough to be named, and what each explains.

The confidence in a mistake is its share of the probability of all explanations; a mistake that the evidence
does not distinguish from it is its rival.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial

from grader.marking.diagnosis import OF_THE_WHOLE, Case, Key, key_of
from grader.outcomes import NamedMistake
from grader.records import MECHANISM
from reference.authored.assignment import SCALE_NAMES
from reference.construction.elements import Along, Line, Scaled
from reference.construction.graph import Construction
from reference.construction.mistakes import (
    OF_FORCES,
    RPM_FACTOR,
    SLIP,
    Drawing,
    Mistake,
    affected,
    commit,
    laid_off,
    line_of,
    made_at,
)
from reference.construction.steps import Given, Step, TwoLines
from reference.quantities import group_of, kind_of
from reference.replay.replay import Replay

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
    drawing = case.drawing
    for one in certain:
        drawing = commit(one, drawing)
    wrong = frozenset(node for one in certain for node in made_at(one, drawing.construction))
    return drawing, (wrong - joints) | (frozenset({MECHANISM}) if wrong & joints else frozenset())


# The mistakes that are named -----------------------------------------------------------------------

LEAST_CONFIDENCE = 0.6
"""A mistake less certain than this is not named."""
SURE_TOGETHER = 0.8
"""A mistake is named with its rivals where their probability together is at least this."""
LEAST_RIVAL = 0.1
"""A rival less likely than this is not named."""
MOST_RIVALS = 3
ALL_THOUGHT_OF, ALL_THOUGHT_OF_BY_LENGTHS = 0.94, 0.89
"""Probability that the mistakes made are among those tried, where one mistake does not explain a drawing."""
EVEN = 0.5
"""A plan that is likelier than this to follow no construction goes to a person."""
MOST_SLIPS = 2
"""Most slips that are named: if more computed lengths do not fit, they have another cause."""
SUSPICIOUS, GROSS = 2.0, 3.0
"""RMS misfits of a step in standard deviations of this drawing's errors: between the two a mistake is too
slight to be named. (Below the first the mistake shows elsewhere.)"""


OF_MOMENTS = OF_FORCES | {"wrong_arm", SLIP}
"""Mistakes in moments, or in what acts on a link, and in any other computing."""


@dataclass(frozen=True, slots=True)
class Lost:
    """The criteria that lost points, or may lose some, by vector, link and scale; and the crank's gear.

    `right`: the vectors that are right by the exact plan, or by earlier work.
    """

    vectors: Mapping[str, str]
    scales: Mapping[str, str]
    gear_ratio: float | None = None
    right: frozenset[str] = frozenset()


def named(
    explanations: Sequence[Replay], construction: Construction, lost: Lost, *, has_directions: bool
) -> tuple[NamedMistake, ...]:
    """The mistakes of the likeliest explanation that are sure enough, in the order of construction."""
    if not explanations:
        return ()
    best, shares = explanations[0], _Shares(explanations)
    all_thought_of = ALL_THOUGHT_OF if has_directions else ALL_THOUGHT_OF_BY_LENGTHS
    known = all_thought_of if len(best.made) > 1 else 1.0
    slips = sum(one.code == SLIP and not one.other for one in best.made)
    explains, mistakes = _losses_explained(best, construction, lost), []
    record = partial(_record, construction, lost.gear_ratio)
    for mistake in _in_order(best.made, construction):
        key, share = key_of(mistake), shares.of(key_of(mistake))
        rivals = shares.rivals(key, {key_of(one) for one in best.made})
        together = share + sum(shares.instead(key, key_of(one)) for one in rivals)
        is_sure = share >= LEAST_CONFIDENCE or (together >= SURE_TOGETHER and rivals)
        is_shown = explains[mistake] and (mistake.code != SLIP or mistake.other or slips <= MOST_SLIPS)
        is_shown = is_shown and not _is_refuted(mistake, construction, lost.right)
        if is_shown and is_sure and not _is_slight(mistake, best):
            others = tuple(record(one, (), known * shares.instead(key, key_of(one))) for one in rivals)
            mistakes.append(record(mistake, tuple(explains[mistake]), known * share, others))
    return tuple(mistakes)


def sure_of(explanations: Sequence[Replay], least: float) -> list[Mistake]:
    """The mistakes of the likeliest explanation that are this sure, unless they are slight.

    Mistakes of one line, or of one vector laid off, are one here: all of them explain what was drawn there.
    """
    if not explanations:
        return []
    shares = _Shares(explanations)
    return [
        one
        for one in explanations[0].made
        if shares.made_at(one) >= least and not _is_slight(one, explanations[0])
    ]


def not_explained(explanations: Sequence[Replay]) -> frozenset[str]:
    """The figures in which, more likely than not, nothing belongs together."""
    whole = _Shares(explanations) if explanations else None
    figures = {figure for one in explanations for figure in one.not_explained}
    return frozenset(one for one in figures if whole is not None and whole.of_nothing(one) > EVEN)


def _is_slight(mistake: Mistake, explanation: Replay) -> bool:
    """Return whether the residual at the mistake's step is small enough for drafting errors."""
    if mistake.code in OF_THE_WHOLE or mistake.parameters:
        # With other data the step of that explanation is right.
        return False
    return SUSPICIOUS < explanation.right.get(mistake.at, 0.0) < GROSS


def _is_refuted(mistake: Mistake, construction: Construction, right: frozenset[str]) -> bool:
    """Return whether the forces are right that a mistake in moments or in what acts on a link makes wrong."""
    steps = [construction.step(construction.vectors[name].head) for name in right]
    laid = {one.node for one in steps if isinstance(one, Given) and laid_off(one, construction) in right}
    return mistake.code in OF_MOMENTS and made_at(mistake, construction) <= laid


class _Shares:
    """The share of the probability that explanations with a mistake have."""

    def __init__(self, explanations: Sequence[Replay]) -> None:
        least = explanations[0].cost
        weights = [math.exp((least - explanation.cost) / 2.0) for explanation in explanations]
        whole = sum(weights)
        self._weights = [
            ({key_of(one): one for one in explanation.made}, weight / whole)
            for explanation, weight in zip(explanations, weights, strict=True)
        ]
        self._nothing = [explanation.not_explained for explanation in explanations]

    def of_nothing(self, figure: str) -> float:
        """The share of the explanations in which nothing belongs together in a figure."""
        found = zip(self._weights, self._nothing, strict=True)
        return sum(weight for (_, weight), figures in found if figure in figures)

    def of(self, key: Key) -> float:
        """The share of the explanations with a mistake."""
        return sum(weight for made, weight in self._weights if key in made)

    def made_at(self, mistake: Mistake) -> float:
        """The share of the explanations with some mistake where one was made."""
        if mistake.code in OF_THE_WHOLE | NO_STEPS:
            return self.of(key_of(mistake))
        place = mistake.at, mistake.slot
        return sum(
            weight
            for made, weight in self._weights
            if any(
                (one.at, one.slot) == place and one.code not in OF_THE_WHOLE | NO_STEPS
                for one in made.values()
            )
        )

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
    """The lost criteria that each mistake explains: each is given to the last mistake upstream.

    A mistake for which that leaves nothing has all that it touches, together with later ones.
    """
    made = _in_order(explanation.made, construction)
    explains: dict[Mistake, list[str]] = {
        mistake: [name for scale, name in lost.scales.items() if mistake.at == scale] for mistake in made
    }
    reach = {mistake: affected(mistake, construction) for mistake in made}
    touched: dict[Mistake, list[str]] = {mistake: [] for mistake in made}
    for name, criterion in lost.vectors.items():
        scale, tail, head = _ends_of(name, construction)
        if head in explanation.unexplained:
            continue
        ends = {tail, head}
        touching = [one for one in made if _touches(one, scale, ends, reach[one])]
        step = construction.laid_off(tail, head) if name in construction.vectors else None
        if step is not None:
            # Wherever a force begins, its size and direction follow from other nodes.
            of = {*step.needs} - {tail}
            touching = [
                one
                for one in touching
                if one.code not in OF_MOMENTS or head in made_at(one, construction) or of & reach[one]
            ]
        own = [one for one in touching if one.at == head]
        for mistake in (own or touching)[-1:]:
            explains[mistake].append(criterion)
        for mistake in touching:
            touched[mistake].append(criterion)
    return {mistake: explains[mistake] or touched[mistake] for mistake in made}


def _ends_of(name: str, construction: Construction) -> tuple[str, str, str]:
    """The scale of a vector or link, its tail and its head."""
    if name in construction.vectors:
        vector = construction.vectors[name]
        return vector.scale, vector.tail, vector.head
    return ("kL", *construction.links[name])


def _touches(mistake: Mistake, scale: str, ends: set[str], reach: frozenset[str]) -> bool:
    if mistake.at in SCALE_NAMES:
        return mistake.at in {scale, "kL"}
    if mistake.code == "labels_swapped":
        return bool(ends & set(mistake.other))
    return bool(ends & reach)


SPEED_SLIPS: Mapping[str, tuple[str, float]] = {
    "not_converted": ("n", RPM_FACTOR),
    "seconds_forgotten": ("2π·n", 60.0),
    "turn_forgotten": ("n/60", 0.5 / math.pi),
    "half_turn": ("π·n/60", 0.5),
    "sixty_forgotten": ("π·n", 30.0),
    "turn_twice": ("2π·n/30", 2.0),
    "pi_forgotten": ("n/30", 1.0 / math.pi),
    "degrees": ("6·n", 180.0 / math.pi),
}
"""Wrong formulas for omega, with n in rev/min, and the factors by which it is wrong."""
SHOWN_BY_SCALES = ("", "not_converted", "seconds_forgotten", "turn_forgotten")
"""A scale that is half or twice the right one has other causes than omega."""
RIGHT_SPEED = "π·n/30"
RPM_WITHIN = 0.03
"""Relative: a scale wrong by such a factor (squared for accelerations) this nearly was computed from it."""
LINE_MISTAKES = frozenset({"parallel_for_perpendicular", "wrong_link", "wrong_intersection"})


def _record(
    construction: Construction,
    ratio: float | None,
    mistake: Mistake,
    explains: tuple[str, ...],
    confidence: float,
    rivals: tuple[NamedMistake, ...] = (),
) -> NamedMistake:
    if mistake.code == "scale_wrong":
        mistake = speed_mistake(mistake, ratio)
    is_line = mistake.code in LINE_MISTAKES
    line = _line_of(construction.step(mistake.at), mistake.slot) if is_line else {}
    vector = _vector_of(mistake, construction)
    if vector:
        # Nodes of force polygons have no letters.
        letters = mistake.other if mistake.code == "wrong_link" or mistake.other[:1] == (vector,) else ()
        across = is_line and _is_across(construction.step(mistake.at), mistake.slot)
        line = {"line": "force across a guide" if across else "force"}
        mistake = replace(mistake, at=vector, other=letters)
    return NamedMistake(mistake, explains, min(confidence, 1.0), line, rivals)


def _is_across(step: Step, slot: int) -> bool:
    """Return whether a line of a force plan is across a guide: all others run along links."""
    return isinstance(step, TwoLines) and (step.first, step.second)[slot].along.quarters % 2 == 1


def _vector_of(mistake: Mistake, construction: Construction) -> str:
    """The vector of a force plan in which a mistake was made at a node; empty for any other mistake."""
    try:
        step = construction.step(mistake.at)
    except KeyError:
        return ""
    if not group_of(construction.figure_of(mistake.at)):
        return ""
    if isinstance(step, Given):
        return laid_off(step, construction)
    here = [one for one in construction.vectors.values() if one.head == mistake.at]
    line = (step.first, step.second)[mistake.slot] if isinstance(step, TwoLines) else None
    return next((one.name for one in here if line_of(one, construction) == line), here[0].name)


def _line_of(step: Step, slot: int) -> dict[str, str]:
    """The parameters that describe a step's line: ``from`` a node, its ``link``, ``line`` of which kind."""
    if isinstance(step, Given) and isinstance(step.length, Scaled) and isinstance(step.along, Along):
        across = step.along.quarters % 2
        return {"line": "driving across" if across else "driving along"}
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


def speed_mistake(mistake: Mistake, ratio: float | None) -> Mistake:
    """Return a wrong omega, or a scale from it, as a mistake in the conversion of rev/min if it is one.

    Arguments: `ratio` of the gear, that may be forgotten or multiplied by.
    """
    of_scale = mistake.at in SCALE_NAMES
    power = kind_of(mistake.at).omegas if of_scale else 1
    if not power:
        return mistake
    gears = {"": (" / U" if ratio else "", 1.0)}
    gears |= {"ratio_forgotten": ("", ratio), "ratio_multiplied": (" · U", ratio**2)} if ratio else {}
    formulas = {"": (RIGHT_SPEED, 1.0), **SPEED_SLIPS}
    residual = {
        (slip, gear): abs(math.log(abs(mistake.factor)) - power * math.log(by * more))
        for slip, (_, by) in formulas.items()
        for gear, (_, more) in gears.items()
        if (slip or gear) and not (of_scale and (slip not in SHOWN_BY_SCALES or (slip and gear)))
    }
    fitting = [(all(names), off, names) for names, off in residual.items() if off <= RPM_WITHIN]
    if not fitting:
        return mistake
    slip, gear = min(fitting)[-1]
    formula, instead_of = formulas[slip][0] + gears[gear][0], RIGHT_SPEED + gears[""][0]
    return replace(mistake, code="rpm_not_converted", other=(f"{slip} {gear}".strip(), formula, instead_of))
