"""A velocity or acceleration plan: its vectors with arrowheads, thin construction lines, letters."""

from collections.abc import Iterator

import numpy as np

from reference.canvas import CONSTRUCTION, Shape, Stroke
from reference.drawing import symbols
from reference.drawing.labelling import Style, letters
from reference.drawing.sketch import captioned
from reference.drawing.subject import PLAN_COLOURS, Figure, Part, Subject
from reference.drawing.symbols import HAIR_MM, point
from reference.elements import Line, View
from reference.steps import Step, TwoLines

LETTER_MM, SMALL_LETTER_MM = 4.2, 3.4
OVERRUN_MM = 5.0
"""A construction line goes on past its foot and past the node that it finds."""
ABSOLUTE_MM, RELATIVE_MM = 0.5, 0.3
"""Widths of vectors from the pole, and of all others."""


def polygon(subject: Subject, figure: str) -> Figure:
    """One plan of one variant."""
    colour, nodes = PLAN_COLOURS[figure], subject.nodes(figure)
    drawn = [*_lines(subject, figure, nodes), *_vectors(subject, figure, nodes)]
    pole = subject.plan.construction.poles[figure]
    drawn.append(Part(pole, symbols.marked_point(nodes[pole], colour)))
    style = Style(LETTER_MM, SMALL_LETTER_MM, colour, symbols.POINT_RADIUS_MM)
    named = letters(subject, nodes, [part.shape for part in drawn], style)
    return captioned(subject, figure, (*drawn, *named), colour)


def _lines(subject: Subject, figure: str, nodes: dict[str, complex]) -> Iterator[Part]:
    view = subject.view
    for step in subject.plan.construction.figures[figure]:
        for shape in construction_lines(step, view, nodes):
            yield Part(step.node, shape)


def construction_lines(step: Step, view: View, nodes: dict[str, complex]) -> Iterator[Shape]:
    """The lines that a node is found by, thin, going on a little at both ends."""
    lines = (step.first, step.second) if isinstance(step, TwoLines) else ()
    drawn = [(line.through, complex(line.along.at(view))) for line in lines if isinstance(line, Line)]
    for through, along in drawn:
        foot, node = nodes[through], nodes[step.node]
        sign = 1.0 if (np.conj(along) * (node - foot)).real >= 0.0 else -1.0
        over = sign * OVERRUN_MM * along
        yield Stroke(point(foot - over), point(node + over), HAIR_MM, CONSTRUCTION)


def _vectors(subject: Subject, figure: str, nodes: dict[str, complex]) -> Iterator[Part]:
    """Each vector that is longer than nothing; of several along one line the longest undermost."""
    pole, colour = subject.plan.construction.poles[figure], PLAN_COLOURS[figure]
    for vector in subject.plan.construction.vectors_of(figure):
        if subject.is_zero(vector.name):
            continue
        width = ABSOLUTE_MM if vector.tail == pole else RELATIVE_MM
        for shape in symbols.arrow(nodes[vector.tail], nodes[vector.head], width, colour):
            yield Part(vector.head, shape)
