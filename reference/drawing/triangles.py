"""Normal components by the right-triangle (altitude) method: its steps, drawn thin over the mechanism sketch.

At B put v_BA as drawn, perpendicular to AB; join its end b'' to A; the perpendicular to Ab'' through b''
meets the line AB beyond B in b'''; half a turn about B brings b''' to b^IV. By the altitude theorem
B b''' = v^2 / AB in drawn lengths, so that B b^IV, from B towards A, is a_BA^n as drawn, exactly where
kL ka = kv^2.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace

import numpy as np

from reference.construction.graph import Construction, evaluate
from reference.construction.triangles import Triangle, triangles
from reference.drawing import symbols
from reference.drawing.canvas import CONSTRUCTION, Curve, Piece, Stroke, pieces_of
from reference.drawing.labels import Wanted
from reference.drawing.subject import PLAN_COLOURS, Part, Subject
from reference.drawing.symbols import HAIR_MM, MEDIUM_MM, point, unit
from reference.errors import CallError
from reference.geometry import ComplexArray
from reference.plan import Plan

FIGURE = "altitude"
RATIO_TOLERANCE = 1e-6
"""Tolerance of kL ka / kv^2 about 1: far below what a ruler shows."""


def with_triangles(construction: Construction) -> Construction:
    """Return the construction with one figure more: the triangles on the mechanism sketch."""
    steps = tuple(step for triangle in triangles(construction) for step in triangle.steps)
    return replace(construction, figures={**construction.figures, FIGURE: steps})


def altitude_nodes(plan: Plan) -> Mapping[str, ComplexArray]:
    """Return the triangles' nodes on the sketch, complex millimetres.

    Raises CallError if the scales do not allow the method: kL ka is not kv^2.
    """
    check_scales(plan)
    nodes = evaluate(with_triangles(plan.construction), plan.drawing.parameters)
    made = (step.node for triangle in triangles(plan.construction) for step in triangle.steps)
    return {node: nodes[node] for node in made}


def check_scales(plan: Plan) -> None:
    """Raise CallError for scales at which B b^IV is not the normal component, with the ratio and a remedy."""
    scales = plan.scales
    ratios = np.atleast_1d(scales.kL * scales.ka / scales.kv**2)
    worst = float(ratios[np.argmax(np.abs(ratios - 1.0))])
    if abs(worst - 1.0) > RATIO_TOLERANCE:
        wanted = float(np.ravel(scales.kv**2 / scales.kL)[0])
        raise CallError(
            "altitude",
            f"the altitude method needs kL ka = kv^2, but kL ka / kv^2 = {worst:.6g}: normal components"
            f" would come out {worst:.4g} times as long as at the scale ka; choose"
            f" ka = kv^2 / kL = {wanted:.6g} (m/s^2)/mm, or lay off v^2/l computed",
        )


# How it is drawn -----------------------------------------------------------------------------------

LETTER_MM = 2.8
RIGHT_ANGLE_MM = 1.8


@dataclass(frozen=True, slots=True)
class Altitudes:
    """Thin lines under the links, vectors over them, and letters to be placed."""

    lines: tuple[Part, ...] = ()
    vectors: tuple[Part, ...] = ()
    letters: tuple[Wanted, ...] = ()


def altitudes(subject: Subject, nodes: dict[str, complex]) -> Altitudes:
    """Return the triangles that are not of zero size, if the subject asks for them.

    Raises CallError if the scales do not allow the method.
    """
    if not subject.altitude:
        return Altitudes()
    made = {node: subject.vector(at) for node, at in altitude_nodes(subject.plan).items()}
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
    """Yield the velocity drawn at the joint, and the normal component found."""
    for tip, figure in ((triangle.end, "velocity_plan"), (triangle.turned, "acceleration_plan")):
        colour = PLAN_COLOURS[figure]
        for shape in symbols.arrow(nodes[triangle.joint], nodes[tip], MEDIUM_MM, colour):
            yield Part(triangle.vector.head, shape)


def _right_angle(at: complex, p: complex, q: complex) -> Curve:
    one, other = (RIGHT_ANGLE_MM * unit(end - at) for end in (p, q))
    return Curve(tuple(point(at + corner) for corner in (one, one + other, other)), HAIR_MM, CONSTRUCTION)


def _letters(triangle: Triangle, nodes: dict[str, complex], *, several: bool) -> Iterator[Wanted]:
    """Yield letters at the triangle's nodes, with the component's index if the joint has several."""
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
