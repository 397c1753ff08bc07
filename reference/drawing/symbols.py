"""Symbols of a mechanism sketch and of a plan, about points of the plane (complex millimetres, y up)."""

import math
from collections.abc import Iterator

from reference.canvas import INK, PAPER, Area, Curve, Point, Ring, Shape, Stroke

LINK_MM, MEDIUM_MM, THIN_MM, HAIR_MM = 0.6, 0.35, 0.18, 0.13
JOINT_RADIUS_MM = 1.3
POINT_RADIUS_MM = 0.7
ARROW_MM = (3.4, 0.62)
"""Length and half the width of an arrowhead; a short vector's is at most `ARROW_SHARE` of it long."""
ARROW_SHARE = 0.45
BLOCK_MM = (4.0, 2.5)
"""Half the length and half the width of a sliding block."""
PIVOT_MM = (2.6, 4.8, 3.8)
"""Of a ground pivot: half its foot's width, its height, half the width of the ground."""
HATCH_MM = 1.5


def point(z: complex) -> Point:
    """On paper, y down."""
    return (float(z.real), float(-z.imag))


def arrow(start: complex, end: complex, width: float, colour: str) -> Iterator[Shape]:
    """A vector: a line and a filled head, shorter where the vector is short."""
    along = (end - start) / abs(end - start)
    length = min(ARROW_MM[0], ARROW_SHARE * abs(end - start))
    half = ARROW_MM[1] * length / ARROW_MM[0]
    neck = end - along * length
    yield Stroke(point(start), point(neck), width, colour)
    yield Area((point(end), point(neck + 1j * along * half), point(neck - 1j * along * half)), colour)


def hatched(start: complex, end: complex) -> Iterator[Shape]:
    """A ground line with hatching to its right-hand side."""
    yield Stroke(point(start), point(end), MEDIUM_MM)
    along = (end - start) / abs(end - start)
    count = max(1, int(abs(end - start) / HATCH_MM))
    for step in range(count):
        foot = start + along * (step + 0.8) * abs(end - start) / count
        yield Stroke(point(foot), point(foot - along * (1 + 1j) * HATCH_MM), HAIR_MM)


def pivot(at: complex, away: complex) -> Iterator[Shape]:
    """A joint's support on the ground, which lies in the direction `away` (a unit vector)."""
    half, height, ground = PIVOT_MM
    across = 1j * away
    foot = at + away * height
    yield Area((point(at), point(foot + across * half), point(foot - across * half)), PAPER, MEDIUM_MM)
    yield from hatched(foot - across * ground, foot + across * ground)


def joint(at: complex) -> Ring:
    """A hinge."""
    return Ring(point(at), JOINT_RADIUS_MM)


def marked_point(at: complex, colour: str = INK) -> Ring:
    """A point of a link where nothing else is hinged; the pole of a plan."""
    return Ring(point(at), POINT_RADIUS_MM, MEDIUM_MM, colour, colour)


def block(at: complex, along: complex) -> Area:
    """A sliding block on a guide along a unit vector."""
    length, width = BLOCK_MM
    corners = (length + 1j * width, -length + 1j * width, -length - 1j * width, length - 1j * width)
    return Area(tuple(point(at + along * corner) for corner in corners), PAPER, MEDIUM_MM * 1.3)


def guide(at: complex, along: complex, side: int, reach: tuple[float, float]) -> Iterator[Shape]:
    """A fixed guide under a block, its ground to the left (side +1) or right (-1) of `along`.

    Arguments: `reach` is how far it goes on behind and ahead of the block's middle.
    """
    offset = 1j * along * side * BLOCK_MM[1]
    behind, ahead = at + offset - along * reach[0], at + offset + along * reach[1]
    yield from hatched(behind, ahead) if side < 0 else hatched(ahead, behind)


def axis(start: complex, end: complex) -> Stroke:
    """The line along which a point moves, thin, dashed and dotted."""
    return Stroke(point(start), point(end), HAIR_MM, INK, (4.0, 1.0, 0.4, 1.0))


def weld(at: complex, along: complex, side: int) -> Curve:
    """A rigid link that goes on past a hinge at its middle: half a turn about the joint."""
    start = math.atan2(along.imag, along.real)
    return arc(at, 2.3, start, side * math.pi, LINK_MM * 0.8)


def arc(centre: complex, radius: float, start: float, sweep: float, width: float, colour: str = INK) -> Curve:
    """An arc of a circle from an angle over another, radians counter-clockwise."""
    count = max(8, math.ceil(abs(sweep) / 0.1))
    turns = (start + sweep * step / count for step in range(count + 1))
    points = tuple(point(centre + radius * complex(math.cos(turn), math.sin(turn))) for turn in turns)
    return Curve(points, width, colour)


def turning(centre: complex, radius: float, start: float, sweep: float, colour: str = INK) -> Iterator[Shape]:
    """A curved arrow about a centre: the sense in which a link turns."""
    head = min(2.6, 0.85 * radius)
    shaft = sweep - math.copysign(head / radius, sweep)
    yield arc(centre, radius, start, shaft, THIN_MM * 1.4, colour)
    last = start + shaft
    neck = centre + radius * complex(math.cos(last), math.sin(last))
    tip = centre + radius * complex(math.cos(start + sweep), math.sin(start + sweep))
    along = (tip - neck) / abs(tip - neck)
    half = 0.3 * head
    yield Area((point(tip), point(neck + 1j * along * half), point(neck - 1j * along * half)), colour)


def sense(at: complex, sign: float) -> Iterator[Shape]:
    """A small turning arrow, counter-clockwise for a sign above zero, clockwise below."""
    start = math.radians(-50.0 if sign > 0 else 230.0)
    yield from turning(at, 1.5, start, math.copysign(math.radians(290.0), sign))
