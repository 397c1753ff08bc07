"""What the form of an authored mechanism cannot show: joints, links and guides that do not fit together."""

import difflib
from collections.abc import Iterator
from itertools import permutations

from reference.authored import (
    AnyGroupTable,
    CrossSliderTable,
    DyadTable,
    GuideTable,
    MechanismFile,
    PlateTable,
    PointOnLineTable,
    PointTable,
    SliderTable,
    SlottedLinkTable,
    YokeTable,
)
from reference.errors import Finding

Keyed = Iterator[tuple[str, str]]
"""A key of the group's table, and the joint that stands there."""


class _Bodies:
    """Which joints each link carries, as far as the file has been read."""

    def __init__(self, file: MechanismFile) -> None:
        self.ground = set(file.ground)
        self.links: dict[str, set[str]] = {}
        self.slots: dict[str, set[str]] = {}
        """By slotted link: its pivot and its node, the base of its points."""

    def of(self, joints: list[str]) -> str | None:
        """The moving link that carries all these joints."""
        return next((link for link, held in self.links.items() if set(joints) <= held), None)


def check_mechanism(file: MechanismFile) -> Iterator[Finding]:
    """Joints not yet placed or placed twice, links named twice, bases and guides that are no one link's."""
    bodies = _Bodies(file)
    placed = {*file.ground}
    later = [joint for group in file.group for _, joint in _added(group)]
    if file.crank is not None:
        if file.crank.pivot not in file.ground:
            yield Finding("$.crank.pivot", _unknown(file.crank.pivot, set(file.ground), "a ground pivot"))
        bodies.links[file.crank.link] = {file.crank.pivot, file.crank.pin}
    driven = file.crank or file.driven_slider
    if driven is not None:
        if driven.pin in placed:
            where = "$.crank.pin" if file.crank else "$.driven_slider.pin"
            yield Finding(where, f"{driven.pin} is a ground pivot already")
        placed.add(driven.pin)
    for index, group in enumerate(file.group):
        where = f"$.group[{index}]"
        for key, joint in _needed(group):
            if joint in later and joint not in placed:
                told = f"{joint} is placed further down: groups stand in the order in which they assemble"
                yield Finding(f"{where}.{key}", told)
            elif joint not in placed:
                yield Finding(f"{where}.{key}", _unknown(joint, placed, "placed above"))
        for key, joint in _added(group):
            if joint in placed:
                yield Finding(f"{where}.{key}", f"{joint} has a place already: over-constrained")
            placed.add(joint)
            later.remove(joint)
        yield from _check_links(group, bodies, where)
    yield from _check_names(placed)


def _check_names(joints: set[str]) -> Iterator[Finding]:
    yield from _read_alike(joints)
    lower = [joint.lower() for joint in joints]
    for joint in sorted(joints):
        if lower.count(joint.lower()) > 1:
            yield Finding("$", f"joint {joint}: another one has the same letters in another case")


def _read_alike(joints: set[str]) -> Iterator[Finding]:
    """Names that run together: v_BA is B about A, so no third joint may be called BA."""
    read_as: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in sorted(joints)}
    for first, second in permutations(sorted(joints), 2):
        other = read_as.setdefault(first + second, (first, second))
        if other != (first, second):
            told = f"{first + second} would mean both {' about '.join(other)} and {first} about {second}"
            yield Finding("$", f"joints {', '.join(sorted({*other, first, second}))}: {told}; rename one")


def _guides(group: AnyGroupTable) -> list[tuple[str, GuideTable]]:
    match group:
        case SliderTable():
            return [("guide", group.guide)]
        case CrossSliderTable():
            return [(f"guides[{index}]", guide) for index, guide in enumerate(group.guides)]
        case _:
            return []


def _needed(group: AnyGroupTable) -> Keyed:
    """The joints that must have their place before the group."""
    match group:
        case DyadTable(pins=pins):
            yield from ((f"pins[{index}]", pin) for index, pin in enumerate(pins))
        case SliderTable(pin=pin) | YokeTable(pin=pin):
            yield "pin", pin
        case SlottedLinkTable(pin=pin, pivot=pivot):
            yield from (("pin", pin), ("pivot", pivot))
        case PlateTable(base=base) | PointOnLineTable(base=base) | PointTable(base=base):
            yield from ((f"base[{index}]", joint) for index, joint in enumerate(base))
    for key, guide in _guides(group):
        yield from ((f"{key}.joints[{index}]", joint) for index, joint in enumerate(guide.joints or []))


def _added(group: AnyGroupTable) -> Keyed:
    """The joints that the group places."""
    yield "node", group.node
    if isinstance(group, SlottedLinkTable) and group.foot is not None:
        yield "foot", group.foot
    yield from ((f"{key}.coincident", guide.coincident) for key, guide in _guides(group) if guide.coincident)


def _check_links(group: AnyGroupTable, bodies: _Bodies, where: str) -> Iterator[Finding]:
    """New links have new names; bases and moving guides are carried by one link."""
    for key, guide in _guides(group):
        if guide.joints and (guide.joints[0] == guide.joints[1] or bodies.of(guide.joints) is None):
            told = f"{guide.joints[0]} and {guide.joints[1]} must be two joints of one moving link"
            yield Finding(f"{where}.{key}.joints", told)
    match group:
        case DyadTable():
            if group.pins[0] == group.pins[1]:
                yield Finding(f"{where}.pins", "the two pins must be different joints")
            for index, (pin, link) in enumerate(zip(group.pins, group.links, strict=True)):
                yield from _add_link(link, {pin, group.node}, bodies, f"{where}.links[{index}]")
        case SliderTable():
            yield from _add_link(group.link, {group.pin, group.node}, bodies, f"{where}.link")
        case SlottedLinkTable():
            if group.pin == group.pivot:
                yield Finding(f"{where}.pivot", "pin and pivot must be different joints")
            carried = {group.pivot, *([group.foot] if group.foot else [])}
            yield from _add_link(group.link, carried, bodies, f"{where}.link")
            bodies.slots[group.link] = {group.pivot, group.node}
        case CrossSliderTable(guides=(first, second)):
            if not first.joints and not second.joints:
                told = "two fixed guides cross in a fixed point: one of them must be on a moving link"
                yield Finding(f"{where}.guides", told)
        case PlateTable() | PointOnLineTable() | PointTable():
            yield from _check_base(group, bodies, f"{where}.base")


def _check_base(
    group: PlateTable | PointOnLineTable | PointTable, bodies: _Bodies, where: str
) -> Iterator[Finding]:
    held = bodies.links.setdefault(group.link, set())
    on_slot = isinstance(group, PointTable) and set(group.base) == bodies.slots.get(group.link)
    if group.base[0] == group.base[1] or not (on_slot or set(group.base) <= held):
        told = ", ".join(sorted(held)) or "no joints yet"
        advice = ""
        if group.link in bodies.slots and not isinstance(group, PointTable):
            advice = '; points of a slotted link are given by type = "point", from its pivot along its guide'
        yield Finding(where, f"must be two joints of link {group.link} ({told}){advice}")
    elif on_slot and group.base[0] not in held:
        yield Finding(where, "the pivot comes first, then the slotted link's node")
    held.add(group.node)


def _add_link(link: str, joints: set[str], bodies: _Bodies, where: str) -> Iterator[Finding]:
    """A group's links are new bodies: under a name that is taken, two bodies would pass for one."""
    if link in bodies.links:
        yield Finding(where, f"there is a link {link} already: each link needs a name of its own")
    bodies.links.setdefault(link, joints)


def _unknown(joint: str, known: set[str], what: str) -> str:
    near = difflib.get_close_matches(joint, sorted(known), n=1, cutoff=0.5)
    meant = f" (did you mean {near[0]}?)" if near else ""
    return f"{joint} is not {what}{meant}: known so far are {', '.join(sorted(known))}"
