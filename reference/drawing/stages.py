"""A figure as it grows: what a step adds stands out, what was there before is grey."""

from collections.abc import Collection, Iterator
from dataclasses import replace
from itertools import pairwise

import numpy as np

from reference.canvas import PAPER, Area, Curve, Label, Ring, Shape, Stroke
from reference.drawing import symbols
from reference.drawing.links import unit
from reference.drawing.sketch import LETTER_MM, PLATE_FILL
from reference.drawing.subject import Figure, Subject
from reference.drawing.symbols import point
from reference.elements import Along
from reference.steps import ArcAndLine, Given, Similar, Step, TwoArcs, TwoLines

BEFORE, NOW = "#a3abb3", "#c8380a"
NOW_WIDTH_MM = 0.3
"""Least width of a line that a step adds."""
ARC_HALF_RAD = 0.22
MODEL_MM, LARGE_MM = 1.0, 90.0


def stage(figure: Figure, earlier: Collection[str], node: str) -> tuple[Shape, ...]:
    """The figure once a node's step is done, after the steps of the earlier nodes."""
    known = {*earlier, node}
    shown = [part for part in figure.parts if part.node in known and part.until not in known]
    plates = [part.shape for part in shown if _is_light(part.shape)]
    before = [inked(part.shape, BEFORE) for part in shown if part.node != node]
    now = [_wider(inked(part.shape, NOW)) for part in shown if part.node == node]
    return (*plates, *(shape for shape in (*before, *now) if not _is_light(shape)))


def grey(figure: Figure) -> tuple[Shape, ...]:
    """The finished figure without its caption, all of it grey."""
    return tuple(inked(part.shape, BEFORE) for part in figure.parts if part.node and not part.until)


def inked(shape: Shape, colour: str) -> Shape:
    """The shape in another ink; paper stays white, a light fill stays what it is."""
    match shape:
        case Ring():
            return replace(shape, colour=colour, fill=PAPER if shape.fill == PAPER else colour)
        case Area():
            kept = _is_light(shape) or shape.fill == PAPER
            return replace(shape, colour=colour, fill=shape.fill if kept else colour)
        case _:
            return replace(shape, colour=colour)


def _is_light(shape: Shape) -> bool:
    return isinstance(shape, Area) and shape.fill == PLATE_FILL


def _wider(shape: Shape) -> Shape:
    if isinstance(shape, Stroke | Curve) and not shape.dash:
        return replace(shape, width=max(shape.width, NOW_WIDTH_MM))
    return shape


def compasses(step: Step, nodes: dict[str, complex]) -> Iterator[Shape]:
    """The arcs that a point of the sketch is found by."""
    centres: tuple[str, ...] = ()
    if isinstance(step, TwoArcs):
        centres = step.centres
    elif isinstance(step, ArcAndLine):
        centres = (step.centre,)
    for centre in centres:
        arm = nodes[step.node] - nodes[centre]
        start = float(np.angle(arm)) - ARC_HALF_RAD
        yield symbols.arc(nodes[centre], abs(arm), start, 2 * ARC_HALF_RAD, NOW_WIDTH_MM, NOW)


def models(subject: Subject, step: Step) -> Iterator[Shape]:
    """What the step takes its directions or its triangle from, on the mechanism sketch."""
    nodes = subject.nodes("mechanism")
    for joints in _model_joints(step):
        corners = [point(nodes[joint]) for joint in joints]
        yield from (Stroke(p, q, MODEL_MM, NOW) for p, q in pairwise(corners))


def centre(subject: Subject, name: str) -> Iterator[Shape]:
    """An instantaneous centre or acceleration pole, with its triangle on the link that it belongs to."""
    nodes, at = subject.nodes("mechanism"), subject.centres[name]
    p, q = (nodes[joint] for joint in subject.plan.construction.centres[name].base)
    yield Stroke(point(p), point(q), MODEL_MM, NOW)
    for corner in (p, q):
        yield Stroke(point(corner), point(at), symbols.HAIR_MM, NOW)
    yield symbols.marked_point(at, NOW)
    # On a large picture, which is printed smaller, the letter is larger.
    size = LETTER_MM * max(1.0, abs(at - p) / LARGE_MM)
    away = unit(at - (p + q) / 2.0)
    x, y = point(at + 1.1 * size * away)
    yield Label((x, y + 0.35 * size), subject.letter(name), size, "middle", NOW, italic=True)


def _model_joints(step: Step) -> Iterator[tuple[str, ...]]:
    match step:
        case Similar(model=(p, q, r)):
            yield (p, q, r, p)
        case Given(along=Along(tail=tail, head=head)):
            yield (tail, head)
        case TwoLines(first=first, second=second):
            for line in (first, second):
                if isinstance(line.along, Along):
                    yield (line.along.tail, line.along.head)
        case _:
            return
