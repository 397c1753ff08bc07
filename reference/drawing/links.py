"""What a mechanism's links are on the sketch: straight bars between joints, guides, sliding blocks."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from reference.drawing.subject import Subject
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivenSlider,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
    moving_guides,
)

BEYOND_MM = 13.0
"""How far a rod goes on past the block that slides on it."""


@dataclass(frozen=True, slots=True)
class Bar:
    """A straight stretch of a link, drawn at its node's step: the joints at its ends, and where it ends."""

    node: str
    link: str
    joints: tuple[str, str]
    ends: tuple[complex, complex]


@dataclass(frozen=True, slots=True)
class Block:
    """A sliding block at a joint, along a unit vector; on fixed ground where `rod` says whence it comes."""

    node: str
    at: complex
    along: complex
    grounded: bool = False
    rod: complex = 0j


def unit(z: complex) -> complex:
    """The unit vector along z; along +x where it has no length."""
    return z / abs(z) if abs(z) > 0.0 else 1.0 + 0j


def bars(subject: Subject, nodes: dict[str, complex]) -> list[Bar]:
    """The links as straight stretches."""
    driver = subject.plan.mechanism.driver
    found = []
    if isinstance(driver, Crank):
        found.append(_between(driver.pin, driver.link, driver.pivot, driver.pin, nodes))
    for group in subject.plan.mechanism.groups:
        found += _bars_of(subject, group, nodes)
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
            share = subject.one(np.asarray(ratio))
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
        case SlotPoint(node=node, slotted=slotted, link=link):
            yield _between(node, link, slotted_link(subject, slotted).pivot, node, nodes)
        case Yoke(node=node, pin=pin):
            way = nodes[pin] - nodes[node]
            along = slot_of_yoke(subject, group)
            reach = way if abs(way) > 0.0 else along
            yield Bar(node, "", (node, node), (nodes[node], nodes[pin] + BEYOND_MM * unit(reach)))


def _carriers(group: Group, nodes: dict[str, complex]) -> Iterator[Bar]:
    """A moving guide that its link's joints do not reach: the link goes on past the block."""
    for guide in moving_guides(group):
        g, h = (nodes[joint] for joint in guide.base)
        at = nodes[guide.coincident]
        near, far = (h, g) if abs(at - h) < abs(at - g) else (g, h)
        if abs(at - far) > abs(far - near):
            yield Bar(guide.coincident, guide.link, guide.base, (near, at + BEYOND_MM * unit(at - near)))


def slotted_link(subject: Subject, node: str) -> SlottedLink:
    """The slotted link of a node."""
    groups = subject.plan.mechanism.groups
    return next(group for group in groups if isinstance(group, SlottedLink) and group.node == node)


def slot_direction(group: SlottedLink, nodes: dict[str, complex]) -> complex:
    """From a slotted link's pivot (or its guide's foot) towards the block."""
    return unit(nodes[group.pin] - nodes[group.foot or group.pivot])


def slot_of_yoke(subject: Subject, group: Yoke) -> complex:
    """The direction of a yoke's slot."""
    return complex(np.exp(1j * subject.one(np.asarray(group.slot_rad))))


def blocks(subject: Subject, nodes: dict[str, complex]) -> Iterator[Block]:
    """The sliding blocks of the driven link and of every group."""
    driver = subject.plan.mechanism.driver
    if isinstance(driver, DrivenSlider):
        along = _along(subject, FixedGuide(driver.guide_m, driver.guide_rad), nodes)
        yield Block(driver.pin, nodes[driver.pin], along, grounded=True)
    for group in subject.plan.mechanism.groups:
        match group:
            case Slider(node=node, pin=pin, guide=guide):
                yield _block(subject, node, guide, nodes, nodes[pin] - nodes[node])
            case CrossSlider(node=node, guides=guides):
                yield from (_block(subject, node, guide, nodes) for guide in guides)
            case Yoke(node=node, pin=pin, guide=guide):
                yield Block(node, nodes[pin], slot_of_yoke(subject, group))
                yield _block(subject, node, guide, nodes, nodes[pin] - nodes[node])
            case SlottedLink(node=node, pin=pin):
                yield Block(node, nodes[pin], slot_direction(group, nodes))
            case _:
                pass


def _block(subject: Subject, node: str, guide: Guide, nodes: dict[str, complex], rod: complex = 0j) -> Block:
    along = _along(subject, guide, nodes)
    return Block(node, nodes[node], along, isinstance(guide, FixedGuide), rod)


def _along(subject: Subject, guide: Guide, nodes: dict[str, complex]) -> complex:
    if isinstance(guide, FixedGuide):
        return complex(np.exp(1j * subject.one(np.asarray(guide.angle_rad))))
    return unit(nodes[guide.base[1]] - nodes[guide.base[0]])


def hinged_on(group: Group) -> tuple[str, ...]:
    """The joints at which a group's own links are hinged."""
    match group:
        case Dyad(pins=pins):
            return pins
        case Slider(pin=pin) | SlottedLink(pin=pin) | Yoke(pin=pin):
            return (pin,)
        case _:
            return ()
