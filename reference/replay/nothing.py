"""The explanation that what was drawn has nothing to do with the construction.

The explanations of `reference.replay.replay` are compared with each other, and the best of many is
always some explanation. This one has no mistakes and no steps: every node and length of a plan may be
anything. It has a prior of its own and pays for no single step, so an explanation that explains only a few
of many nodes costs more than this one.
"""

from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from itertools import chain, combinations

from reference.construction.graph import Construction
from reference.construction.mistakes import Mistake, affected
from reference.replay.explanations import COST_WINDOW, RARITY, Observations, by_node, cost_of_any
from reference.replay.replay import Replay

NOTHING_FITS, ONE_PLAN = 11.0, 15.0
"""Cost of a submission that follows no construction, one in about 250; of one plan alone, rarer."""
LEAST_NODES = 2
"""A plan with fewer observed nodes is not left unexplained on its own."""


def cost_of_anything(construction: Construction, observations: Observations) -> dict[str, float]:
    """Return by figure the cost of its observations if each node may be anywhere."""
    found: dict[str, float] = {}
    for node, entries in by_node(construction, observations.entries).items():
        figure = construction.figure_of(node)
        found[figure] = found.get(figure, 0.0) + cost_of_any(entries)
    return found


def with_nothing(
    explanations: Sequence[Replay], construction: Construction, observations: Observations
) -> list[Replay]:
    """Return the explanations, with those in which one or all plans are not explained, ordered by cost.

    The rest of an explanation without such a plan is kept once, from the cheapest one.
    """
    anything = cost_of_anything(construction, observations)
    nodes: dict[str, list[str]] = {figure: [] for figure in anything}
    for node in by_node(construction, observations.entries):
        nodes[construction.figure_of(node)].append(node)
    plans = [plan for plan in construction.poles if len(nodes.get(plan, ())) >= LEAST_NODES]
    left_out = [frozenset(some) for some in _subsets(plans, set(anything))]
    least = min((one.cost for one in explanations), default=0.0)
    cheapest: dict[tuple[object, ...], Replay] = {}
    for one in explanations:
        for figures in left_out:
            gain = sum(
                one.spent[figure] + observations.apart.get(figure, 0.0) - anything[figure]
                for figure in figures
            )
            gain -= NOTHING_FITS if figures.issuperset(plans) else ONE_PLAN
            if one.cost - gain > least + COST_WINDOW:
                continue
            other = _without(one, figures, construction, gain, anything.keys() - figures, nodes)
            key = (
                figures,
                frozenset((made.code, made.at) for made in other.made),
                frozenset(other.unexplained),
            )
            if key not in cheapest or other.cost < cheapest[key].cost:
                cheapest[key] = other
    return sorted((*explanations, *cheapest.values()), key=lambda one: one.cost)


def _subsets(plans: Sequence[str], figures: set[str]) -> Iterator[set[str]]:
    """Yield each plan alone, all plans, and all figures."""
    some = chain.from_iterable(combinations(plans, size) for size in range(1, len(plans) + 1))
    found = [set(one) for one in some]
    yield from found
    if plans and figures not in found:
        yield figures


def _without(
    explanation: Replay,
    figures: frozenset[str],
    construction: Construction,
    gain: float,
    others: Collection[str],
    nodes: Mapping[str, Sequence[str]],
) -> Replay:
    """Return an explanation with these figures unexplained, which costs less by the gain."""
    cost, kept = explanation.cost - gain, []
    for one in explanation.made:
        at, shown = _figures_of(one, construction)
        if shown.intersection(others):
            kept.append(one)
        elif at not in figures:
            cost -= RARITY[one.code]
    unexplained = (*explanation.unexplained, *(node for one in figures for node in nodes[one]))
    return replace(
        explanation,
        cost=cost,
        made=tuple(kept),
        unexplained=tuple(dict.fromkeys(unexplained)),
        not_explained=figures,
    )


def _figures_of(mistake: Mistake, construction: Construction) -> tuple[str, frozenset[str]]:
    """Return the figure of a mistake, empty for the whole drawing, and the figures that show it."""
    if mistake.at in {step.node for step in construction.steps}:
        at = construction.figure_of(mistake.at)
        if at in construction.poles:
            return at, frozenset({at})
    else:
        at = ""
    by_scale = {
        construction.figure_of(one.head) for one in construction.vectors.values() if one.scale == mistake.at
    }
    moved = by_scale or {construction.figure_of(node) for node in affected(mistake, construction)}
    return at, frozenset(moved)
