"""How a plan may have been drawn: as it should be, with plates by similarity, with mistakes."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from grader.records import FloatArray
from reference.construction import Construction
from reference.elements import Normal
from reference.mistakes import Drawing, Mistake, commit, single_mistakes
from reference.steps import Given

REGULAR = ("as constructed", "plates by similarity")
COST_OF_SIMILARITY = 0.7
COST_OF_MISTAKE = 8.0
"""Nats: a third of plans have a mistake, one of some forty; and strokes of one hand err alike."""
LEFT_OUT = {
    "n": "not drawn: the normal component is left out",
    "k": "not drawn: the Coriolis component is left out",
}
"""By the first letter of the node in which the component ends."""
OF_THE_WHOLE = {"figure_rotated", "scale_wrong", "rpm_not_converted", "vector_missing"}


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """One way in which the plan may have been drawn.

    Attributes
    ----------
    label : for people
    drawing : the construction as this student would follow it
    absent : nodes that are not drawn then, with the reason
    cost : nats, how unlikely before looking
    """

    label: str
    drawing: Drawing
    absent: Mapping[str, str]
    cost: float


def regular(drawing: Drawing, figure: str) -> list[Hypothesis]:
    """As it should be: by perpendiculars throughout, and with plates by similarity."""
    by_similarity = similar(drawing.construction, figure)
    told = [Hypothesis(REGULAR[0], drawing, {}, 0.0)]
    if by_similarity is not None:
        changed, absent = by_similarity
        told.append(Hypothesis(REGULAR[1], Drawing(changed, drawing.parameters), absent, COST_OF_SIMILARITY))
    return told


def mistaken(base: Hypothesis, figure: str) -> Iterator[tuple[Hypothesis, Mistake]]:
    """Every single mistake on top of a hypothesis; the search for its place turns and scales it anyway."""
    for mistake in single_mistakes(base.drawing, figure):
        if mistake.code in OF_THE_WHOLE or mistake.at in base.absent:
            continue
        gone = dict(base.absent)
        if mistake.code == "normal_missing":
            gone[mistake.at] = LEFT_OUT[mistake.at[0]]
        try:
            changed = commit(mistake, base.drawing)
        except ValueError:
            continue
        told = _told(mistake) if base.label in REGULAR else f"{base.label}, {_told(mistake)}"
        yield Hypothesis(told, changed, gone, base.cost + COST_OF_MISTAKE), mistake


def _told(mistake: Mistake) -> str:
    return " ".join([mistake.code, mistake.at, *mistake.other])


def similar(construction: Construction, figure: str) -> tuple[Construction, dict[str, str]] | None:
    """The construction with every plate's image by similarity, and the nodes that vanish."""
    steps = {step.node: step for step in construction.figures[figure]}
    changed, absent = construction, {}
    for node, image in construction.images.items():
        if node not in steps or steps[node] == image:
            continue
        changed = changed.with_step(image)
        for vector in construction.vectors_of(figure):
            tail = steps.get(vector.tail)
            if vector.head == node and isinstance(tail, Given) and isinstance(tail.length, Normal):
                absent[vector.tail] = f"not drawn: {node} found by similarity"
    return None if changed is construction else (changed, absent)


def tied(hypothesis: Hypothesis) -> Construction:
    """Vectors that would start from a normal component left out start where it would have started."""
    construction = hypothesis.drawing.construction
    vectors = dict(construction.vectors)
    for node, reason in hypothesis.absent.items():
        step = construction.step(node)
        if reason not in LEFT_OUT.values() or not isinstance(step, Given):
            continue
        for name, vector in vectors.items():
            if vector.tail == node:
                vectors[name] = replace(vector, tail=step.start)
    return replace(construction, vectors=vectors)


def resized(drawing: Drawing, figure: str, size: float) -> dict[str, FloatArray]:
    """The parameters at the scale at which the plan comes out `size` times as large."""
    scale = next(v.scale for v in drawing.construction.vectors_of(figure))
    return {**drawing.parameters, scale: np.asarray(drawing.parameters[scale] / size)}
