"""What stands on a sketch as strokes and signs: bars between joints, blocks, guides."""

from collections.abc import Iterator

import numpy as np

from reference.construction.elements import FixedLine, Line
from reference.construction.steps import ArcAndLine, OnGuide, Step, TwoLines
from reference.mechanism import (
    Crank,
    Dyad,
    Group,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
    moving_guides,
)
from samples.simulation.hand import Task


def links_of(task: Task) -> Iterator[tuple[str, str, str]]:
    """Strokes of the sketch: name, tail and head joint."""
    driver = task.mechanism.driver
    if isinstance(driver, Crank):
        yield f"{driver.pivot}{driver.pin}", driver.pivot, driver.pin
    for group in task.mechanism.groups:
        for tail, head in _bars(task, group):
            yield f"{tail}{head}", tail, head


def _bars(task: Task, group: Group) -> Iterator[tuple[str, str]]:
    match group:
        case SlottedLink(pivot=pivot, foot=foot):
            yield foot or pivot, _end_of_slot(task, group)
            if foot is not None:
                yield pivot, foot
        case SlotPoint(node=node, slotted=slotted):
            link = _slotted_link(task, slotted)
            if node != _end_of_slot(task, link):
                yield link.pivot, node
        case PointOnLine(node=node, base=(p, q), ratio=ratio):
            if not 0.0 < float(np.mean(ratio)) < 1.0:
                yield (q if float(np.mean(ratio)) > 1.0 else p), node
        case Dyad(node=node, pins=pins) | Plate(node=node, base=pins):
            yield from ((pin, node) for pin in pins)
        case Slider(node=node, pin=pin) | Yoke(node=node, pin=pin):
            yield pin, node


def _slotted_link(task: Task, node: str) -> SlottedLink:
    return next(g for g in task.mechanism.groups if isinstance(g, SlottedLink) and g.node == node)


def _end_of_slot(task: Task, link: SlottedLink) -> str:
    """The point in which a slotted link's bar ends: beyond the block where the link goes on in line."""
    points = (g for g in task.mechanism.groups if isinstance(g, SlotPoint) and g.slotted == link.node)
    in_line = [one for one in points if np.all(one.local_m.imag == np.mean(link.offset_m))]
    ahead = [one for one in in_line if float(np.mean(one.local_m.real)) * float(np.mean(link.side)) > 0.0]
    return max(ahead, key=lambda one: float(np.mean(abs(one.local_m))), default=link).node


def coincident(task: Task) -> set[str]:
    """Joints that lie where another does and have no sign or letter of their own."""
    slotted = {g.node for g in task.mechanism.groups if isinstance(g, SlottedLink)}
    return slotted | {guide.coincident for g in task.mechanism.groups for guide in moving_guides(g)}


def blocks_of(task: Task, group: Group) -> Iterator[tuple[str, str, str]]:
    """Where a block sits on a moving guide, and two joints of that guide."""
    if isinstance(group, SlottedLink):
        yield group.pin, group.foot or group.pivot, _end_of_slot(task, group)
    yield from ((group.node, *guide.base) for guide in moving_guides(group))


def fixed_guides(step: Step) -> list[FixedLine]:
    """The guides on the ground along which a step's node slides."""
    match step:
        case ArcAndLine(guide=guide) | OnGuide(guide=guide):
            found = [guide]
        case TwoLines(first=first, second=second):
            found = [first, second]
        case _:
            found = []
    return [guide for guide in found if isinstance(guide, FixedLine)]


def lines_of(step: TwoLines) -> list[Line]:
    """The lines of a step that are drawn from a node."""
    return [line for line in (step.first, step.second) if isinstance(line, Line)]
