"""Symbols of a mechanism sketch and of a plan, and the links that they stand for.

About points of the plane: complex millimetres, y up.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from reference.drawing.canvas import INK, PAPER, Area, Curve, Point, Ring, Shape, Stroke
from reference.drawing.subject import Subject
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    MovingGuide,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    moving_guides,
    slotted_links,
)

LINK_MM, MEDIUM_MM, THIN_MM, HAIR_MM = 0.6, 0.35, 0.18, 0.13
JOINT_RADIUS_MM = 1.3
POINT_RADIUS_MM = 0.7
ARROW_MM = (3.4, 0.62)
"""Length and half width of an arrowhead; on a short vector at most `ARROW_SHARE` of its length."""
ARROW_SHARE = 0.45
BLOCK_MM = (4.0, 2.5)
"""Half the length and half the width of a sliding block."""
PIVOT_MM = (2.6, 4.8, 3.8)
"""Sizes of a ground pivot: half its foot's width, its height, half the width of the ground."""
HATCH_MM = 1.5


def point(z: complex) -> Point:
    """Convert a point to paper coordinates, y down."""
    return (float(z.real), float(-z.imag))


def arrow(
    start: complex,
    end: complex,
    width: float,
    colour: str,
    head_mm: tuple[float, float] = ARROW_MM,
    dash: tuple[float, ...] = (),
) -> Iterator[Shape]:
    """Yield a vector: a line and a filled head (length and half width), smaller for a short vector."""
    along = (end - start) / abs(end - start)
    length = min(head_mm[0], ARROW_SHARE * abs(end - start))
    half = head_mm[1] * length / head_mm[0]
    neck = end - along * length
    yield Stroke(point(start), point(neck), width, colour, dash)
    yield Area((point(end), point(neck + 1j * along * half), point(neck - 1j * along * half)), colour)


def hatched(start: complex, end: complex) -> Iterator[Shape]:
    """Yield a ground line with hatching to its right-hand side."""
    yield Stroke(point(start), point(end), MEDIUM_MM)
    along = (end - start) / abs(end - start)
    count = max(1, int(abs(end - start) / HATCH_MM))
    for step in range(count):
        foot = start + along * (step + 0.8) * abs(end - start) / count
        yield Stroke(point(foot), point(foot - along * (1 + 1j) * HATCH_MM), HAIR_MM)


def pivot(at: complex, away: complex) -> Iterator[Shape]:
    """Yield a joint's support on the ground, which lies in the direction `away` (a unit vector)."""
    half, height, ground = PIVOT_MM
    across = 1j * away
    foot = at + away * height
    yield Area((point(at), point(foot + across * half), point(foot - across * half)), PAPER, MEDIUM_MM)
    yield from hatched(foot - across * ground, foot + across * ground)


def joint(at: complex) -> Ring:
    """Return a hinge."""
    return Ring(point(at), JOINT_RADIUS_MM)


def marked_point(at: complex, colour: str = INK) -> Ring:
    """Return a point of a link where nothing else is hinged, or the pole of a plan."""
    return Ring(point(at), POINT_RADIUS_MM, MEDIUM_MM, colour, colour)


def block(at: complex, along: complex) -> Area:
    """Return a sliding block on a guide along a unit vector."""
    length, width = BLOCK_MM
    corners = (length + 1j * width, -length + 1j * width, -length - 1j * width, length - 1j * width)
    return Area(tuple(point(at + along * corner) for corner in corners), PAPER, MEDIUM_MM * 1.3)


def guide(at: complex, along: complex, side: int, reach: tuple[float, float]) -> Iterator[Shape]:
    """Yield a fixed guide under a block, its ground to the left (side +1) or right (-1) of `along`.

    Arguments: `reach` is its extent behind and ahead of the block's middle.
    """
    offset = 1j * along * side * BLOCK_MM[1]
    behind, ahead = at + offset - along * reach[0], at + offset + along * reach[1]
    yield from hatched(behind, ahead) if side < 0 else hatched(ahead, behind)


def axis(start: complex, end: complex) -> Stroke:
    """Return the line along which a point moves, thin, dashed and dotted."""
    return Stroke(point(start), point(end), HAIR_MM, INK, (4.0, 1.0, 0.4, 1.0))


def weld(at: complex, along: complex, side: int) -> Curve:
    """Mark a rigid link that continues past a hinge at its middle: half a turn about the joint."""
    start = math.atan2(along.imag, along.real)
    return arc(at, 2.3, start, side * math.pi, LINK_MM * 0.8)


def arc(centre: complex, radius: float, start: float, sweep: float, width: float, colour: str = INK) -> Curve:
    """Return an arc of a circle from an angle over another, radians counter-clockwise."""
    count = max(8, math.ceil(abs(sweep) / 0.1))
    turns = (start + sweep * step / count for step in range(count + 1))
    points = tuple(point(centre + radius * complex(math.cos(turn), math.sin(turn))) for turn in turns)
    return Curve(points, width, colour)


def turning(centre: complex, radius: float, start: float, sweep: float, colour: str = INK) -> Iterator[Shape]:
    """Yield a curved arrow about a centre: the sense in which a link turns."""
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
    """Yield a small turning arrow, counter-clockwise for a sign above zero, clockwise below."""
    start = math.radians(-50.0 if sign > 0 else 230.0)
    yield from turning(at, 1.5, start, math.copysign(math.radians(290.0), sign))


# Links and blocks of a sketch ----------------------------------------------------------------------

BEYOND_MM = 13.0
"""Length of a rod beyond the block that slides on it."""


@dataclass(frozen=True, slots=True)
class Bar:
    """A straight stretch of a link, drawn at its node's step: the joints at its ends, and its end points."""

    node: str
    link: str
    joints: tuple[str, str]
    ends: tuple[complex, complex]


@dataclass(frozen=True, slots=True)
class Block:
    """A sliding block at a joint, along a unit vector; if on fixed ground, `rod` is its rod's direction."""

    node: str
    at: complex
    along: complex
    grounded: bool = False
    rod: complex = 0j


def unit(z: complex) -> complex:
    """Return the unit vector along z; along +x if z is zero."""
    return z / abs(z) if abs(z) > 0.0 else 1.0 + 0j


def bars(subject: Subject, nodes: dict[str, complex]) -> list[Bar]:
    """Return the links as straight stretches, without any to centres of mass that are no joints."""
    driver, dots = subject.plan.mechanism.driver, subject.plan.construction.dots
    found = []
    if isinstance(driver, Crank):
        found.append(_between(driver.pin, driver.link, driver.pivot, driver.pin, nodes))
    for group in subject.plan.mechanism.groups:
        found += _bars_of(subject, group, nodes) if group.node not in dots else ()
        found += _carriers(group, nodes)
    return found


def _between(node: str, link: str, p: str, q: str, nodes: dict[str, complex]) -> Bar:
    return Bar(node, link, (p, q), (nodes[p], nodes[q]))


def _bars_of(subject: Subject, group: Group, nodes: dict[str, complex]) -> Iterator[Bar]:
    match group:
        case Dyad(node=node, pins=pins, links=links):
            yield from (_between(node, link, pin, node, nodes) for pin, link in zip(pins, links, strict=True))
        case Plate(node=node, base=base, link=link):
            yield from (_between(node, link, pin, node, nodes) for pin in base)
        case PointOnLine(node=node, base=(p, q), link=link, ratio=ratio):
            share = subject.number(np.asarray(ratio))
            if not 0.0 <= share <= 1.0:
                yield _between(node, link, p if share < 0.0 else q, node, nodes)
        case Slider(node=node, pin=pin, link=link):
            yield _between(node, link, pin, node, nodes)
        case SlottedLink(node=node, pin=pin, pivot=pivot, link=link):
            start = group.foot or pivot
            end = nodes[pin] + BEYOND_MM * slot_direction(group, nodes)
            yield Bar(node, link, (start, node), (nodes[start], end))
            if group.foot:
                yield _between(node, link, pivot, group.foot, nodes)
        case SlotPoint(node=node, link=link):
            yield _between(node, link, slotted_links(subject.plan.mechanism)[link].pivot, node, nodes)
        case Triad():
            yield from (_between(end, link, start, end, nodes) for link, start, end in group.bars)
        case Yoke(node=node, pin=pin):
            foot, along = slot_of_yoke(subject, group, nodes)
            way = nodes[pin] - foot
            reach = way if abs(way) > 0.0 else along
            yield Bar(node, group.link, (node, node), (foot, nodes[pin] + BEYOND_MM * unit(reach)))


def _carriers(group: Group, nodes: dict[str, complex]) -> Iterator[Bar]:
    """Extend the link of a moving guide that its joints do not reach past the block."""
    for guide in moving_guides(group):
        g, h = (nodes[joint] for joint in guide.base)
        at = foot_on(guide, nodes[guide.coincident], nodes)
        near, far = (h, g) if abs(at - h) < abs(at - g) else (g, h)
        if abs(at - far) > abs(far - near):
            yield Bar(guide.coincident, guide.link, guide.base, (near, at + BEYOND_MM * unit(at - near)))


def slot_direction(group: SlottedLink, nodes: dict[str, complex]) -> complex:
    """Return the direction from a slotted link's pivot (or its guide's foot) towards the block."""
    return unit(nodes[group.pin] - nodes[group.foot or group.pivot])


def foot_on(guide: MovingGuide, at: complex, nodes: dict[str, complex]) -> complex:
    """Return the point of a moving guide's line that is nearest to a point."""
    g, h = (nodes[joint] for joint in guide.base)
    return g + unit(h - g) * ((at - g) * unit(h - g).conjugate()).real


def slot_of_yoke(subject: Subject, group: Yoke, nodes: dict[str, complex]) -> tuple[complex, complex]:
    """Return where a yoke's slot crosses its guide, and the slot's direction."""
    guide = group.guide
    if isinstance(guide, MovingGuide):
        return foot_on(guide, nodes[group.pin], nodes), 1j * _along(subject, guide, nodes)
    return nodes[group.node], complex(np.exp(1j * subject.number(np.asarray(group.slot_rad))))


def blocks(subject: Subject, nodes: dict[str, complex]) -> Iterator[Block]:
    """Yield the sliding blocks of the driving link and of every group."""
    driver = subject.plan.mechanism.driver
    if isinstance(driver, DrivingSlider):
        along = _along(subject, FixedGuide(driver.guide_m, driver.guide_rad), nodes)
        yield Block(driver.pin, nodes[driver.pin], along, grounded=True)
    for group in subject.plan.mechanism.groups:
        match group:
            case Slider(node=node, pin=pin, guide=guide):
                yield _block(subject, node, guide, nodes, nodes[pin] - nodes[node])
            case CrossSlider(node=node, guides=guides):
                yield from (_block(subject, node, guide, nodes) for guide in guides)
            case Yoke(node=node, pin=pin, guide=guide):
                foot, along = slot_of_yoke(subject, group, nodes)
                yield Block(node, nodes[pin], along)
                yield replace(_block(subject, node, guide, nodes, nodes[pin] - foot), at=foot)
            case SlottedLink(node=node, pin=pin):
                yield Block(node, nodes[pin], slot_direction(group, nodes))
            case _:
                pass


def _block(subject: Subject, node: str, guide: Guide, nodes: dict[str, complex], rod: complex = 0j) -> Block:
    along = _along(subject, guide, nodes)
    return Block(node, nodes[node], along, isinstance(guide, FixedGuide), rod)


def _along(subject: Subject, guide: Guide, nodes: dict[str, complex]) -> complex:
    if isinstance(guide, FixedGuide):
        return complex(np.exp(1j * subject.number(np.asarray(guide.angle_rad))))
    return unit(nodes[guide.base[1]] - nodes[guide.base[0]])
