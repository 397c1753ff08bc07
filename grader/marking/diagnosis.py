"""Diagnosis: which mistakes explain the residuals of a drawing.

`reference.replay.replay` gives explanations of the drawing, each with its mistakes. First the drawing is
replayed step by step. Only where that leaves residuals, mistakes of the whole drawing are tried as well
(a plan turned as a whole, letters swapped) and mistakes at steps without an
observation. The size of drafting errors is estimated on the drawing itself, so that a right drawing has no
mistake named.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations

import numpy as np

from grader.records import MECHANISM
from reference.construction.elements import Fixed, Nodes, Scaled, data_in, is_force
from reference.construction.graph import Construction, evaluate
from reference.construction.mistakes import (
    OF_FORCES,
    RIGHT_TRIANGLE,
    SLIP,
    Drawing,
    Mistake,
    commit,
    made_at,
    mistakes_of_forces,
)
from reference.construction.steps import Given
from reference.construction.uncertainty import Skill
from reference.quantities import OF_MOTION, group_of, kind_of, scale_of
from reference.replay.explanations import (
    BY_TRIANGLE,
    LEAST_FACTOR,
    MOST_FACTOR,
    NOT_THERE,
    RARER,
    RARITY,
    SLIPS,
    SOMETHING_ELSE,
    Observations,
    cost_of_any,
    rarity_of,
)
from reference.replay.nothing import with_nothing
from reference.replay.replay import Replay, Root, replay

OF_THE_WHOLE = frozenset({"labels_swapped", "figure_rotated"})
Key = tuple[str, str]


def key_of(mistake: Mistake) -> Key:
    """Return a mistake's code, with the cause of a slip, and place, which distinguish it from others."""
    cause = mistake.other if mistake.code == SLIP else ()
    return " ".join((mistake.code, *cause)), mistake.at


# The explanations of a drawing ---------------------------------------------------------------------

FURTHER_SCALE = 4.0
"""Cost of a further wrong scale: it often comes from the first."""
BEYOND_DOUBT = 8.0
"""A mistake is named only where the drawing made rightly by any hand costs this much more: 50 to 1."""
BEYOND_DOUBT_BY_LENGTHS = 14.0
"""The same where no direction is known: a thousand to one."""
LEAST_WRONG = 0.06
"""Least error of a scale's logarithm that is named a mistake: drafting errors reach smaller ones."""
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
    skill : usual drafting errors
    followed : scales that the drawing follows although others were declared
    assumed : scales that nobody declared
    otherwise : the drawing without a measurement that contradicts others, each a possible reading of it
    """

    drawing: Drawing
    observations: Observations
    skill: Skill
    followed: Mapping[str, float] = field(default_factory=dict)
    assumed: frozenset[str] = frozenset()
    otherwise: tuple[Observations, ...] = ()


def explained(case: Case) -> tuple[Replay, ...]:
    """The explanations of a drawing, the likeliest first; none where it may well be right."""
    roots = [Root(), *_other_scales(case)]
    explanations = replay(case.drawing, case.observations, roots, case.skill, cares=CARES)
    for observations in case.otherwise:
        others = replay(case.drawing, observations, roots, case.skill, cares=CARES)
        if others and (not explanations or others[0].cost < explanations[0].cost):
            case, explanations = replace(case, observations=observations), others
    innocent = _cost_if_right(explanations)
    if explanations and not _is_clear(explanations, case):
        explanations = _searched_further(case, roots, explanations)
    elif _may_be_assembled_otherwise(explanations, case):
        explanations = _by_cost(explanations, _replayed(case, roots, [explanations[0].care]))
    explanations = [one for one in explanations if not _is_by_chance(one, case.drawing.construction)]
    explanations = with_nothing(explanations, case.drawing.construction, case.observations)
    has_directions = any(one.has_direction for one in case.observations.entries)
    doubt = BEYOND_DOUBT if has_directions else BEYOND_DOUBT_BY_LENGTHS
    if not explanations or innocent - explanations[0].cost < doubt:
        return ()
    return tuple(explanations)


def _searched_further(case: Case, scales: Sequence[Root], explanations: Sequence[Replay]) -> list[Replay]:
    """The explanations with mistakes of the whole drawing, and at steps without an observation.

    Large drafting errors are also tried as usual ones with some mistake. Where one mistake explains all, and
    directions were observed, mistakes of the whole drawing are not tried. `scales` are the roots without
    other mistakes than in the scales.
    """
    best, construction = explanations[0], case.drawing.construction
    off = {*best.unexplained, *(one.at for one in best.made)} & {one.node for one in construction.steps}
    is_of_forces = best.care > USUAL or any(group_of(construction.figure_of(node)) for node in off)
    acting = [*_of_forces(case)] if is_of_forces else []
    whole = [Root(), *acting]
    scales = [*scales, *_scales_of_the_driver(case, best)]
    if not _is_explained(best) or not all(one.has_direction for one in case.observations.entries):
        whole += _of_the_whole(case)
    by_scale = [[_both(scale, one) for one in whole] for scale in scales]
    roots = [one for some in by_scale for one in some]
    own = [*_own_forces(case, Root())] if is_of_forces else []
    by_scale += [own] if own else []
    roots += own
    cares = sorted({best.care, min(best.care, USUAL)})
    # Apart, as a search drops what costs much before anything is observed.
    found = _by_cost(*(_replayed(case, some, cares) for some in by_scale)) or [*explanations]
    if acting and not _is_explained(found[0]):
        # Beside what explains most of it, a further mistake in what acts.
        start = _root_of(found[0], roots)
        further = [_both(start, one) for one in (*acting, *_own_forces(case, start))]
        found, roots = _by_cost(found, _replayed(case, further, cares)), roots + further
    swaps = [*_swaps(case, found[0])]
    found = _by_cost(found, *(_replayed(case, scales, cares, swap) for swap in swaps))
    scale = _scale_of_slips(case, found[0])
    if scale is not None:
        further = [_both(scale, one) for one in roots]
        found = _by_cost(found, *(_replayed(case, further, cares, swap) for swap in (None, *swaps)))
    found = _by_cost(found, _by_triangles(case, roots, found, cares))
    found = _by_cost(found, _with_a_guess(case, roots, swaps, found[0], cares))
    return _by_cost(found, _with_another_guess(case, roots, acting, found[0], cares))


def _replayed(
    case: Case, roots: Sequence[Root], cares: Sequence[float], swap: Mistake | None = None
) -> list[Replay]:
    """The explanations with mistakes at steps without an observation, or with two letters swapped."""
    if swap is None:
        return replay(case.drawing, case.observations, roots, case.skill, cares=cares, blind=True)
    swapped = Root((swap,), cost=RARITY[swap.code])
    observations = _renamed(case.observations, swap.other)
    return replay(case.drawing, observations, [_both(one, swapped) for one in roots], case.skill, cares=cares)


def _by_cost(*found: Sequence[Replay]) -> list[Replay]:
    """All explanations, the likeliest first."""
    return sorted((one for some in found for one in some), key=lambda explanation: explanation.cost)


SEVERAL = 2
"""So many wrong lengths may have one cause."""
ONE_FACTOR = 0.08
"""Largest difference of the logarithms of slips that are one wrong scale."""


def _scale_of_slips(case: Case, best: Replay) -> Root | None:
    """The scale that computed components follow, where several are off by one factor; else None."""
    slips = [one for one in best.made if one.code == SLIP and not one.other]
    logs = [math.log(one.factor) for one in slips]
    if len(logs) < SEVERAL or max(logs) - min(logs) > ONE_FACTOR:
        return None
    factor = math.exp(sum(logs) / len(logs))
    scale = scale_of(case.drawing.construction.figure_of(slips[-1].at))
    made = () if scale in case.assumed else (Mistake("scale_wrong", scale, factor=factor),)
    parameters = {scale: np.asarray(case.drawing.parameters[scale] / factor)}
    return Root(made, parameters, cost=RARITY["scale_wrong"])


def _by_triangles(
    case: Case, roots: Sequence[Root], found: Sequence[Replay], cares: Sequence[float]
) -> list[Replay]:
    """The explanations in which all wrong normal components were drawn by the right triangle: one mistake."""
    by_triangle = dict.fromkeys(one for some in found for one in some.made if one.other == (RIGHT_TRIANGLE,))
    slips = ({one.at for one in some.made if one.code == SLIP} for some in found)
    several = next((nodes for nodes in slips if len(nodes) >= SEVERAL), set())
    made = tuple(one for one in by_triangle if one.at in several)
    if len(made) < SEVERAL:
        return []
    drawing = case.drawing
    for one in made:
        drawing = commit(one, drawing)
    drawn = Root(made, cost=BY_TRIANGLE - RARER)
    return replay(drawing, case.observations, [_both(one, drawn) for one in roots], case.skill, cares=cares)


def _with_a_guess(
    case: Case, roots: Sequence[Root], swaps: Sequence[Mistake], best: Replay, cares: Sequence[float]
) -> list[Replay]:
    """The explanations with a mistake at a step without an observation, beside the best one's of the whole.

    Both together cost so much before anything is observed that a search from all roots drops them.
    """
    keys, root = {key_of(one) for one in best.made}, _root_of(best, roots)
    swap = next((one for one in swaps if key_of(one) in keys), None)
    if (swap is None and not root.made) or (len(best.made) == 1 and not best.unexplained):
        return []
    observations = case.observations
    if swap is not None:
        root = _both(root, Root((swap,), cost=RARITY[swap.code]))
        observations = _renamed(observations, swap.other)
    return replay(case.drawing, observations, [root], case.skill, cares=cares, blind=True)


def _with_another_guess(
    case: Case, roots: Sequence[Root], acting: Sequence[Root], best: Replay, cares: Sequence[float]
) -> list[Replay]:
    """The explanations with a second mistake at a step without an observation, on top of the first one.

    Or with one in what acts, `acting`, which moments have, too. Nothing where the best explanation has no
    such mistake, or leaves nothing to explain.
    """
    seen = {one.node for one in case.observations.entries}
    steps = {step.node for step in case.drawing.construction.steps}
    kept = {id(one) for root in roots for one in root.made}
    first = [one for one in best.made if one.at in steps - seen and id(one) not in kept]
    if not first or (len(best.made) == 1 and not best.unexplained):
        return []
    drawing = case.drawing
    for one in first:
        drawing = commit(one, drawing)
    kept &= {id(one) for one in best.made}
    start = next(root for root in roots if {id(one) for one in root.made} == kept)
    guessed = _both(start, Root(tuple(first), cost=sum(RARITY[one.code] for one in first)))
    beside = [_both(guessed, one) for one in acting]
    found = replay(drawing, case.observations, beside, case.skill, cares=cares) if beside else []
    return found + replay(drawing, case.observations, [guessed], case.skill, cares=cares, blind=True)


def _root_of(best: Replay, roots: Sequence[Root]) -> Root:
    """The root with the most mistakes of an explanation and no others."""
    keys = {key_of(one) for one in best.made}
    beside = [root for root in roots if root.made and keys >= {key_of(one) for one in root.made}]
    return max(beside, key=lambda one: len(one.made), default=Root())


def _both(one: Root, other: Root) -> Root:
    """Two roots at once; of what both change, as the second does."""
    return Root(
        (*one.made, *other.made),
        {**one.parameters, **other.parameters},
        {**one.turned, **other.turned},
        one.cost + other.cost,
        (*one.unexplained, *other.unexplained),
    )


def _is_explained(explanation: Replay) -> bool:
    """Return whether usual drafting errors and one mistake at most explain everything."""
    return not explanation.unexplained and len(explanation.made) <= 1 and explanation.care <= USUAL


def _cost_if_right(explanations: Sequence[Replay]) -> float:
    """The least cost of an explanation without mistakes; infinite where there is none."""
    return min(
        (explanation.cost for explanation in explanations if explanation.is_innocent), default=math.inf
    )


def _is_clear(explanations: Sequence[Replay], case: Case) -> bool:
    """Return whether the best explanation needs no further search.

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
    if isinstance(step, Given) and data_in(step.length):
        # What acts on a link may be wrong, and with it all that is computed from that.
        return False
    return step is not None and places.issuperset({step.node, *step.needs} - joints)


def _is_by_chance(explanation: Replay, construction: Construction) -> bool:
    """Return whether a mistake was made twice, which undoes it, or two in what makes one vector."""
    made = explanation.made
    acting = [node for one in made if one.code in OF_FORCES for node in made_at(one, construction)]
    others = {one.at for one in made if one.code not in OF_FORCES}
    is_twice = len({*acting}) < len(acting) or not others.isdisjoint(acting)
    return is_twice or len({*map(key_of, made)}) < len(made)


def _may_be_assembled_otherwise(explanations: Sequence[Replay], case: Case) -> bool:
    """Return whether a reversed component may fit another assembly of a mechanism not handed in."""
    made = explanations[0].made if explanations else ()
    return any(one.code == "normal_reversed" for one in made) and not case.observations.sketches


def _scales_of_the_driver(case: Case, best: Replay) -> Iterator[Root]:
    """Roots with the scale that the driving link's vector alone follows, where that vector is not explained.

    Beside another mistake too little else fits a wrong scale for it to be seen before.
    """
    construction, followed = case.drawing.construction, {}
    off = {*best.unexplained, *(one.at for one in best.made)}
    for plan, pole in construction.poles.items():
        scaled = [
            one.node
            for one in construction.figures[plan]
            if isinstance(one, Given) and isinstance(one.length, Scaled)
        ]
        scale = next((one.scale for one in construction.vectors_of(plan)), "")
        if (
            not scaled
            or scale not in OF_MOTION
            or scaled[-1] not in off
            or scale in {*case.assumed, *case.followed}
        ):
            continue
        nodes = evaluate(construction, case.drawing.parameters)
        right_mm = abs(complex(np.ravel(nodes[scaled[-1]] - nodes[pole])[0]))
        entries = case.observations.entries
        drawn = (abs(one.value) for one in entries if one.node == scaled[-1] and one.tail in {None, pole})
        drawn_mm = next(drawn, 0.0)
        if drawn_mm > 0.0 and right_mm > 0.0:
            followed[scale] = float(case.drawing.parameters[scale]) * right_mm / drawn_mm
    if followed:
        yield from _other_scales(replace(case, followed={**case.followed, **followed}))


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
        if name.partition("_")[0] in kind_of(scale).letters
    }
    for parameters in (scales, starts):
        yield Root(made, parameters, cost=RARITY["scale_wrong"] + FURTHER_SCALE * (len(made) - 1))


def _of_forces(case: Case) -> Iterator[Root]:
    """Roots with a mistake in what acts on links: moments have it, too."""
    for mistake in mistakes_of_forces(case.drawing):
        is_blank = mistake.code == "force_missing" and mistake.at in case.observations.blank
        cost = RARITY[mistake.code] - (NOT_THERE if is_blank else 0.0)
        yield Root((mistake,), mistake.parameters, cost=cost)


def _own_forces(case: Case, start: Root) -> Iterator[Root]:
    """Roots with a force as it was drawn, beside other mistakes: by a slip, or in an unknown way."""
    known = {**case.drawing.parameters, **start.parameters}
    drawn = {one.node: one for one in case.observations.entries}
    nodes = evaluate(case.drawing.construction, known) if drawn else {}
    for step in case.drawing.construction.steps:
        if not isinstance(step, Given) or not is_force(step.length) or step.node not in drawn:
            continue
        tail, one = drawn.get(step.start), drawn[step.node]
        right = complex(np.ravel(nodes[step.node] - nodes[step.start])[0])
        value = one.value if tail is None or one.tail is not None else one.value - tail.value
        share = value / right if right and one.has_direction else 1.0
        if not LEAST_FACTOR < abs(share) < MOST_FACTOR or abs(share - 1.0) < LEAST_WRONG:
            continue
        (datum,) = data_in(step.length)
        near = min((abs(abs(share) - by), by) for by in SLIPS)[1]
        is_known = abs(abs(value) - near * abs(right)) <= FIT_SHARE * abs(value) + 3.0 * math.sqrt(
            one.spread[0]
        )
        factor = near if is_known else abs(share)
        changed = {datum: np.asarray(factor * known.get(datum, 1.0))}
        slip = Mistake(SLIP, step.node, factor=factor, parameters=changed)
        yield Root((slip,), changed, cost=rarity_of(slip))
        if isinstance(step.along, Fixed):
            own = {**changed, step.along.angle: np.asarray(np.angle(value))}
            yield Root((), own, cost=SOMETHING_ELSE + cost_of_any([one]), unexplained=(step.node,))


def _of_the_whole(case: Case) -> Iterator[Root]:
    """Roots with a plan turned as a whole."""
    for plan in case.drawing.construction.poles:
        for quarters in (1, 2, 3):
            turned = Mistake("figure_rotated", plan, quarters=quarters)
            yield Root((turned,), turned={plan: 1j**quarters}, cost=RARITY["figure_rotated"])


def _swaps(case: Case, explanation: Replay) -> Iterator[Mistake]:
    """Pairs of images in one plan that may have each other's letters.

    Both are wrong in the explanation, or the right plan is more like what was drawn with the letters swapped.
    """
    construction = case.drawing.construction
    off = {*explanation.unexplained, *(mistake.at for mistake in explanation.made)}
    nodes = evaluate(construction, case.drawing.parameters)
    for figure, pole in construction.poles.items():
        if off & {figure, *(one.scale for one in construction.vectors_of(figure))}:
            # The whole plan is wrong as its first vector is, which may have another's letter.
            off.add(next(step.node for step in construction.figures[figure] if step.node != pole))
        images = sorted(
            v.head for v in construction.vectors_of(figure) if v.tail == pole and v.part not in {"n", "c"}
        )
        images = [] if group_of(figure) else images
        is_off = bool(off) or explanation.care > USUAL
        for pair in combinations(images, 2):
            if off >= set(pair) or (
                is_off
                and (
                    _lie_nearer_swapped(case, pole, pair, nodes)
                    or _has_lengths_swapped(case, figure, pair, nodes)
                )
            ):
                yield Mistake("labels_swapped", pair[0], other=pair)


def _lie_nearer_swapped(case: Case, pole: str, pair: tuple[str, str], nodes: Nodes) -> bool:
    """Return whether two nodes, as drawn, lie nearer to each other's right place than to their own."""
    drawn = {
        one.node: one.value for one in case.observations.entries if one.tail is None and one.has_direction
    }
    if not drawn.keys() >= set(pair):
        return False
    first, second = (complex(np.ravel(nodes[name] - nodes[pole])[0]) for name in pair)
    as_named = abs(drawn[pair[0]] - first) + abs(drawn[pair[1]] - second)
    return abs(drawn[pair[0]] - second) + abs(drawn[pair[1]] - first) < as_named


MOST_FIT, FIT_MM, FIT_SHARE = 0.9, 1.5, 0.03
"""So many of the lengths must fit, within so many millimetres or such a share, at whatever scale."""
LEAST_LENGTHS = 4


def _has_lengths_swapped(case: Case, figure: str, pair: tuple[str, str], nodes: Nodes) -> bool:
    """Return whether a right plan with two letters swapped has the lengths observed."""
    steps = {step.node for step in case.drawing.construction.figures[figure]}
    observed = [one for one in case.observations.entries if one.node in steps and not one.has_direction]
    if len(observed) < LEAST_LENGTHS:
        return False
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    right = np.array(
        [
            abs(
                complex(
                    nodes[other.get(one.node, one.node)] - nodes[other.get(one.tail or "", one.tail or "")]
                )
            )
            for one in observed
        ]
    )
    drawn = np.array([abs(one.value) for one in observed])
    is_long = right > FIT_MM
    if not is_long.any():
        return False
    right *= np.median(drawn[is_long] / right[is_long])
    fits = np.abs(drawn - right) <= np.maximum(FIT_MM, FIT_SHARE * right)
    return bool(np.mean(fits) >= MOST_FIT)


def _renamed(observations: Observations, pair: tuple[str, ...]) -> Observations:
    """The observations with the names of two nodes exchanged."""
    other = {pair[0]: pair[1], pair[1]: pair[0]}
    entries = (
        replace(one, node=other.get(one.node, one.node), tail=other.get(one.tail or "", one.tail))
        for one in observations.entries
    )
    return replace(observations, entries=tuple(entries))
