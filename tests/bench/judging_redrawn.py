"""A drawing with any mistakes in it, by a perfect hand: what a mistake looks like, and what looks like it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.outcomes import NamedMistake as Named
from reference.authored.assignment import Assignment, Variant
from reference.construction.graph import evaluate, parameters_of
from reference.construction.mistakes import RPM_FACTOR, Drawing, Mistake, commit, single_mistakes
from samples.simulation.hand import scalars

SCALES = ("kL", "kv", "ka")


def with_mistakes(right: Drawing, mistakes: Sequence[Mistake]) -> Drawing:
    """The drawing as somebody makes it who makes these mistakes; letters swapped are only written so.

    Revolutions per minute taken for radians per second change the scales too: the plan keeps its size.
    Raises ValueError where a mistake cannot be made.
    """
    drawing = right
    for mistake in mistakes:
        if mistake.code == "rpm_not_converted":
            known = drawing.parameters
            faster = {
                "kv": np.asarray(known["kv"] * RPM_FACTOR),
                "ka": np.asarray(known["ka"] * RPM_FACTOR**2),
            }
            drawing = Drawing(drawing.construction, {**known, **faster})
        if mistake.code not in {"labels_swapped", "vector_missing"}:
            drawing = commit(mistake, drawing)
    return drawing


def vectors_of(right: Drawing, mistakes: Sequence[Mistake]) -> dict[str, complex]:
    """Every vector and link, mm, under the names written beside them. Raises ValueError as above."""
    drawing = with_mistakes(right, mistakes)
    nodes = evaluate(drawing.construction, drawing.parameters)
    swaps = [(one.other[0], one.other[1]) for one in mistakes if one.code == "labels_swapped"]
    named = relabelled({name: complex(place) for name, place in nodes.items()}, swaps)
    vectors = {name: (one.tail, one.head) for name, one in right.construction.vectors.items()}
    ends = {**vectors, **right.construction.links}
    return {name: named[head] - named[tail] for name, (tail, head) in ends.items()}


def relabelled(nodes: Mapping[str, complex], swaps: Sequence[tuple[str, str]]) -> dict[str, complex]:
    """Nodes under the names that stand beside them."""
    named = dict(nodes)
    for first, second in swaps:
        if first in named and second in named:
            named[first], named[second] = named[second], named[first]
    return named


# What a report names ------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Asked:
    """Whose drawing it is."""

    assignment: Assignment
    variant: Variant
    right: Drawing


def meant(asked: Asked, named: Named) -> Iterator[Mistake]:
    """What a mistake named in a report may mean: itself, in whichever line of its step it was made.

    A factor is told from either side.
    """
    mistake = named.mistake
    match mistake.code:
        case "vector_missing" | "labels_swapped" | "figure_rotated":
            yield mistake
        case "other_variant":
            yield from _other_variant(asked, mistake)
        case "scale_wrong" | "rpm_not_converted" | "arithmetic":
            yield from (replace(mistake, factor=one) for one in (mistake.factor, 1.0 / mistake.factor))
        case _:
            for figure in asked.right.construction.figures:
                for one in single_mistakes(asked.right, figure):
                    if (one.code, one.at, one.other) == (mistake.code, mistake.at, mistake.other):
                        yield one


def _other_variant(asked: Asked, named: Mistake) -> Iterator[Mistake]:
    other = Variant(named.n, named.position)
    if other == asked.variant or other not in asked.assignment.variants():
        return
    scales = asked.assignment.scales([other])
    parameters = parameters_of(asked.assignment.mechanism([other]), scales.kL, scales.kv, scales.ka)
    yield replace(named, parameters=scalars(parameters))


def is_same(made: Mistake, named: Named) -> bool:
    """Whether a report names this mistake: its code and its place."""
    if made.code != named.code:
        return False
    match made.code:
        case "labels_swapped":
            return set(made.other) == set(named.mistake.other)
        case "other_variant":
            return (named.mistake.n, named.mistake.position) == (made.n, made.position)
        case "rpm_not_converted":
            return True
        case "figure_rotated":
            return made.at == named.at and named.mistake.quarters % 4 == made.quarters % 4
    return made.at == named.at
