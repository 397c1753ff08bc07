"""The altitude construction of normal components, drawn thin over the mechanism sketch."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reference.altitude import Triangle, altitude_nodes, triangles
from reference.canvas import CONSTRUCTION, Curve, Stroke
from reference.drawing import symbols
from reference.drawing.labelling import Wanted
from reference.drawing.subject import PLAN_COLOURS, Part, Subject
from reference.drawing.symbols import HAIR_MM, MEDIUM_MM, point
from reference.lettering import Piece, pieces_of

LETTER_MM = 2.8
RIGHT_ANGLE_MM = 1.8


@dataclass(frozen=True, slots=True)
class Altitudes:
    """Thin lines for under the links, vectors for over them, letters to be placed."""

    lines: tuple[Part, ...] = ()
    vectors: tuple[Part, ...] = ()
    letters: tuple[Wanted, ...] = ()


def altitudes(subject: Subject, nodes: dict[str, complex]) -> Altitudes:
    """The triangles that are not of zero size, where the subject asks for them.

    Raises CallError where the scales do not allow the method.
    """
    if not subject.altitude:
        return Altitudes()
    made = {
        node: complex(np.broadcast_to(at, (len(subject.plan.variants),))[subject.index])
        for node, at in altitude_nodes(subject.plan).items()
    }
    known = {**nodes, **made}
    shown = [one for one in triangles(subject.plan.construction) if not subject.is_zero(one.vector.name)]
    joints = [triangle.joint for triangle in shown]
    return Altitudes(
        tuple(part for triangle in shown for part in _lines(triangle, known)),
        tuple(part for triangle in shown for part in _vectors(triangle, known)),
        tuple(
            letter
            for triangle in shown
            for letter in _letters(triangle, known, several=joints.count(triangle.joint) > 1)
        ),
    )


def _lines(triangle: Triangle, nodes: dict[str, complex]) -> Iterator[Part]:
    pin, joint, end = nodes[triangle.pin], nodes[triangle.joint], nodes[triangle.end]
    beyond = nodes[triangle.beyond]
    name = triangle.vector.head
    for start, stop in ((pin, end), (end, beyond), (joint, beyond)):
        yield Part(name, Stroke(point(start), point(stop), HAIR_MM, CONSTRUCTION))
    yield Part(name, _right_angle(end, pin, beyond))
    half_turn = symbols.arc(
        joint, abs(beyond - joint), float(np.angle(beyond - joint)), np.pi, HAIR_MM, CONSTRUCTION
    )
    yield Part(name, half_turn)


def _vectors(triangle: Triangle, nodes: dict[str, complex]) -> Iterator[Part]:
    """The velocity put at the joint, and the normal component found."""
    for tip, figure in ((triangle.end, "velocity_plan"), (triangle.turned, "acceleration_plan")):
        colour = PLAN_COLOURS[figure]
        for shape in symbols.arrow(nodes[triangle.joint], nodes[tip], MEDIUM_MM, colour):
            yield Part(triangle.vector.head, shape)


def _right_angle(at: complex, p: complex, q: complex) -> Curve:
    one, other = ((end - at) / abs(end - at) * RIGHT_ANGLE_MM for end in (p, q))
    return Curve(tuple(point(at + corner) for corner in (one, one + other, other)), HAIR_MM, CONSTRUCTION)


def _letters(triangle: Triangle, nodes: dict[str, complex], *, several: bool) -> Iterator[Wanted]:
    """Letters at the triangle's nodes, with the component's index where the joint has several."""
    about = (Piece(triangle.vector.name.split("_")[1], -1),) if several else ()
    letter = pieces_of(triangle.joint.lower())
    for node, mark, figure in (
        (triangle.end, Piece("''"), "velocity_plan"),
        (triangle.beyond, Piece("'''"), ""),
        (triangle.turned, Piece("IV", 1), "acceleration_plan"),
    ):
        text = (*letter, mark, *about) if mark.height == 0 else (*letter, *about, mark)
        colour = PLAN_COLOURS.get(figure, CONSTRUCTION)
        yield Wanted(triangle.vector.head, point(nodes[node]), text, LETTER_MM, colour, 0.5)
