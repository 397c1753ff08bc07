"""A mechanism as its author writes it: the tables of the file, and the checks between them.

Joints, links and guides that do not fit together are reported all at once, each with its path in the file.
"""

import difflib
from collections.abc import Iterator
from itertools import permutations
from typing import Annotated, Literal, Self, cast

from pydantic import AliasChoices, ConfigDict, Field, model_validator

from reference.authored.chain import GROUND, Chain, chain_of, refusal
from reference.authored.toml_file import (
    AHEAD_BEHIND,
    AheadBehind,
    Authored,
    FormulaText,
    Identifier,
    Joint,
    LeftRight,
    LinkName,
    Point,
    SideText,
    Text,
    ThreeJoints,
    TwoFormulas,
    TwoJoints,
)
from reference.errors import FaultError, Finding, Parameter

MOST_LINKS, MOST_NAMED = 40, 6
"""Links of a mechanism whose chain is examined; joints named in a message."""


class CylinderTable(Authored):
    """A cylinder between a ground pivot and the crank's pin, whose driven length moves the crank.

    `speed` and `acceleration` are those of its length.
    """

    pivot: Joint
    length: FormulaText
    speed: FormulaText
    acceleration: FormulaText | None = None
    side: LeftRight
    """Side of the pin, seen from the cylinder's pivot to the crank's."""


class CrankTable(Authored):
    """The driving crank. Its speed is `omega` (rad/s), or `rpm` through a gear of `gear_ratio`.

    Counter-clockwise positive. With a `cylinder`, its length gives angle, speed and acceleration.
    """

    link: LinkName = "1"
    pivot: Joint
    pin: Joint
    length: FormulaText
    angle_deg: FormulaText | None = None
    cylinder: CylinderTable | None = None
    omega: FormulaText | None = None
    rpm: FormulaText | None = None
    gear_ratio: FormulaText | None = None
    epsilon: FormulaText | None = None

    @model_validator(mode="after")
    def _has_one_speed(self) -> Self:
        if self.cylinder is not None:
            if any(one is not None for one in (self.angle_deg, self.omega, self.rpm, self.epsilon)):
                raise FaultError("motion_of_cylinder")
            return self
        if self.angle_deg is None:
            raise FaultError("crank_needs_angle")
        if (self.omega is None) == (self.rpm is None):
            raise FaultError("crank_needs_speed")
        if self.gear_ratio is not None and self.rpm is None:
            raise FaultError("ratio_without_rpm")
        return self


class GuideTable(Authored):
    """A straight guide: fixed (`through`, `angle_deg`), or the line through two joints of a moving link.

    `coincident` names the moving link's point under the slider, as in ``D5`` under ``D``.
    """

    through: Point | None = None
    angle_deg: FormulaText | None = None
    joints: TwoJoints | None = None
    coincident: Joint | None = None

    @model_validator(mode="after")
    def _is_one_kind(self) -> Self:
        fixed = (self.through is not None, self.angle_deg is not None)
        moving = (self.joints is not None, self.coincident is not None)
        if (all(fixed) and not any(moving)) or (all(moving) and not any(fixed)):
            return self
        raise FaultError("guide_needs")


class DrivingSliderTable(Authored):
    """The driving slider, in place of a crank: its position along its fixed guide, and its rates.

    In `length_unit`, `length_unit`/s and `length_unit`/s^2, along the guide's direction.
    """

    link: LinkName = "1"
    pin: Joint
    guide: GuideTable
    displacement: FormulaText
    speed: FormulaText
    acceleration: FormulaText | None = None

    @model_validator(mode="after")
    def _has_a_fixed_guide(self) -> Self:
        if self.guide.joints is not None:
            raise FaultError("driving_guide_moves")
        return self


class DyadTable(Authored):
    """Assur group RRR: two links that meet in `node`."""

    type: Literal["RRR"]
    node: Joint
    pins: TwoJoints
    links: Annotated[list[LinkName], Field(min_length=2, max_length=2)]
    lengths: TwoFormulas
    side: LeftRight
    """Side of the directed line pins[0] -> pins[1]."""


class SliderTable(Authored):
    """Assur group RRP: a rod from `pin` to the slider `node` on a guide."""

    type: Literal["RRP"]
    node: Joint
    pin: Joint
    link: LinkName
    length: FormulaText
    guide: GuideTable
    side: AheadBehind
    """Position of the slider, seen from the pin along the guide's direction."""


class SlottedLinkTable(Authored):
    """Assur group RPR: `link` turns about `pivot`; a block hinged at `pin` slides along its guide."""

    type: Literal["RPR"]
    node: Joint
    """The point of the link under the pin, as in ``B3`` under ``B``."""
    pin: Joint
    pivot: Joint
    link: LinkName
    offset: FormulaText | None = None
    """Distance of the pin to the left of the parallel to the guide through the pivot."""
    foot: Joint | None = None
    """The guide's nearest point to the pivot, if there is an offset."""
    side: AheadBehind = SideText(AHEAD_BEHIND, 1)
    """Position of the pin, seen from the pivot along the guide's direction."""

    @model_validator(mode="after")
    def _has_foot_and_offset(self) -> Self:
        if (self.offset is None) != (self.foot is None):
            raise FaultError("offset_and_foot")
        return self


class CrossSliderTable(Authored):
    """Assur group PRP: `node` hinges two blocks, each on a guide."""

    type: Literal["PRP"]
    node: Joint
    guides: Annotated[list[GuideTable], Field(min_length=2, max_length=2)]


class YokeTable(Authored):
    """Assur group RPP: a block hinged at `pin` slides in a yoke's slot, the yoke on a guide."""

    type: Literal["RPP"]
    node: Joint
    """The yoke's point where slot and fixed guide cross; on a moving guide, its point under the pin."""
    pin: Joint
    link: LinkName | None = None
    """The yoke's name, on a moving guide."""
    slot_deg: FormulaText | None = None
    """The slot's direction; on a moving guide it is perpendicular to the guide."""
    guide: GuideTable

    @model_validator(mode="after")
    def _has_slot_or_link(self) -> Self:
        fixed = self.guide.joints is None
        if fixed is not (self.slot_deg is not None) or fixed is not (self.link is None):
            raise FaultError("yoke_needs")
        return self


class TriadTable(Authored):
    """Assur group of the third class: a ternary link on three legs, all turning pairs."""

    type: Literal["triad"]
    nodes: ThreeJoints
    """Joints D, E, F of the ternary link, in the order of the legs."""
    pins: ThreeJoints
    """Joints A, B, C of the legs; the first one moves."""
    links: Annotated[list[LinkName], Field(min_length=4, max_length=4)]
    """The three legs, then the ternary link."""
    lengths: Annotated[list[FormulaText], Field(min_length=6, max_length=6)]
    """AD, BE, CF, then DE, EF, FD."""
    side: LeftRight
    """Side of F, seen from D to E."""
    angle_deg: FormulaText
    """Roughly the direction from D to E: it tells which of up to six assemblies is meant."""
    assur_point: Joint
    """A name for the point of the ternary link where the lines AD and BE cross, as ``S``."""

    @property
    def node(self) -> str:
        """The third joint of the ternary link, after which the group is called."""
        return self.nodes[2]


class PlateTable(Authored):
    """A third point of the link through `base`, by its distances from base[0] and base[1]."""

    type: Literal["plate"]
    node: Joint
    base: TwoJoints
    link: LinkName
    lengths: TwoFormulas
    side: LeftRight | None = None
    """Side of the directed line base[0] -> base[1]; needed unless the three are in line for every variant."""


class PointOnLineTable(Authored):
    """A point of the link through `base`: base[0] + ratio (base[1] - base[0])."""

    type: Literal["point_on_line"]
    node: Joint
    base: TwoJoints
    link: LinkName
    ratio: FormulaText


class PointTable(Authored):
    """A point of a link by local coordinates: x from base[0] towards base[1], y to the left of it.

    On a slotted link the base is its pivot and its node, and x runs along the guide.
    """

    type: Literal["point"]
    node: Joint
    base: TwoJoints
    link: LinkName
    at: Point


LinkPointTable = PlateTable | PointOnLineTable | PointTable
AnyGroupTable = (
    DyadTable | SliderTable | SlottedLinkTable | CrossSliderTable | YokeTable | TriadTable | LinkPointTable
)
GroupTable = Annotated[AnyGroupTable, Field(discriminator="type")]


class MechanismFile(Authored):
    """A mechanism: lengths in `length_unit`, numbers or formulas of the assignment's values."""

    model_config = ConfigDict(defer_build=False)  # so that AssignmentFile takes the same schema
    schema_version: Literal[1]
    id: Identifier
    title: Text
    length_unit: Literal["m", "cm", "mm"]
    ground: Annotated[dict[Joint, Point], Field(min_length=1)]
    crank: CrankTable | None = None
    driving_slider: DrivingSliderTable | None = Field(
        default=None, validation_alias=AliasChoices("driving_slider", "driven_slider")
    )
    """Older files say `driven_slider`."""
    group: list[GroupTable] = Field(default=[])

    @model_validator(mode="after")
    def _has_one_driver(self) -> Self:
        if (self.crank is None) == (self.driving_slider is None):
            raise FaultError("drivers")
        return self

    @property
    def driver(self) -> CrankTable | DrivingSliderTable:
        """The driving link."""
        return cast("CrankTable | DrivingSliderTable", self.crank or self.driving_slider)

    @property
    def in_order(self) -> list[tuple[int, AnyGroupTable]]:
        """Groups that can be placed, with their indices, each after those that place what it needs."""
        placed, waiting = {*self.ground, self.driver.pin}, list(enumerate(self.group))
        ordered: list[tuple[int, AnyGroupTable]] = []
        found = -1
        while found < len(ordered):
            found = len(ordered)
            for index, group in waiting:
                if all(joint in placed for _, joint in _needed(group)):
                    ordered.append((index, group))
                    placed.update(joint for _, joint in _added(group))
            taken = {index for index, _ in ordered}
            waiting = [each for each in waiting if each[0] not in taken]
        return ordered

    @property
    def chain(self) -> Chain | None:
        """Links and joints of the file; None if they are too many, or no link carries some guide."""
        links: dict[str, list[str]] = {GROUND: [*self.ground]}
        slides: list[tuple[str, str]] = []
        if self.crank is not None:
            links[self.crank.link] = [self.crank.pivot, self.crank.pin]
        else:
            links[self.driver.link] = [self.driver.pin]
            slides.append((GROUND, self.driver.link))
        parts = [part for group in self.group for part in _parts_of(group)]
        for link, joints, _ in parts:
            held = links.setdefault(link, [])
            held += [joint for joint in joints if joint not in held]
        for link, _, rail in parts:
            if isinstance(rail, str):
                slides.append((link, rail))
            elif rail is not None:
                carriers = [other for other, held in links.items() if {*(rail.joints or ())} <= {*held}]
                if rail.joints and not carriers:
                    return None
                slides.append((link, carriers[0]))
        return chain_of(links, slides, self.driver.link) if len(links) <= MOST_LINKS else None


def _parts_of(group: AnyGroupTable) -> Iterator[tuple[str, tuple[str, ...], GuideTable | str | None]]:
    """Yield the links and blocks of a group, each with joints on it and the guide or link it slides on."""
    block, node = f"block {group.node}", group.node
    match group:
        case DyadTable():
            yield from ((link, (pin, node), None) for pin, link in zip(group.pins, group.links, strict=True))
        case SliderTable():
            yield from ((group.link, (group.pin, node), None), (block, (node,), group.guide))
        case SlottedLinkTable():
            foot = [group.foot] if group.foot else []
            yield from ((group.link, (group.pivot, *foot), None), (block, (group.pin,), group.link))
        case CrossSliderTable():
            first, second = group.guides
            yield from ((block, (node,), first), (f"{block}1", (node,), second))
        case YokeTable():
            yoke = f"yoke {node}"
            yield from ((yoke, (node,), group.guide), (block, (group.pin,), yoke))
        case TriadTable(nodes=nodes, links=links):
            held = (*zip(group.pins, nodes, strict=True), tuple(nodes))
            yield from ((link, ends, None) for link, ends in zip(links, held, strict=True))
        case PointTable():
            yield group.link, (node,), None
        case _:
            yield group.link, (*group.base, node), None


# Checks of joints and links ------------------------------------------------------------------------


Keyed = Iterator[tuple[str, str]]
"""Pairs of a key of the group's table and the joint that it names."""


class _CarriedJoints:
    """Joints that each link carries, as far as the file has been read."""

    def __init__(self, file: MechanismFile) -> None:
        self.ground = set(file.ground)
        self.links: dict[str, set[str]] = {}
        self.slots: dict[str, set[str]] = {}
        """Pivot and node of each slotted link, the base of its points."""
        self.moments: dict[str, str] = {}
        """Points that lie under a slider at this instant only, and their links."""

    def body_of(self, joints: set[str]) -> str | None:
        """Return the link that carries all these joints; the ground is one."""
        link = next((link for link, held in self.links.items() if joints <= held), None)
        return GROUND if joints <= self.ground else link

    def of(self, joints: list[str]) -> str | None:
        """Return the moving link that carries all these joints."""
        return next((link for link, held in self.links.items() if set(joints) <= held), None)

    def carriers_of(self, joints: list[str]) -> dict[str, Parameter]:
        """Return, as parameters, the links that carry each joint, and one that does so for this instant."""
        links = {joint: [link for link, held in self.links.items() if joint in held] for joint in joints}
        momentary = [joint for joint in joints if joint in self.moments]
        known: dict[str, Parameter] = {
            "carriers": "; ".join(f"{a}: {', '.join(on) or '-'}" for a, on in links.items())
        }
        return known | ({"joint": momentary[0], "link": self.moments[momentary[0]]} if momentary else {})


def check_mechanism(file: MechanismFile) -> Iterator[Finding]:
    """Report unplaced or repeated joints, repeated links, and bases and guides that no one link carries."""
    bodies = _CarriedJoints(file)
    placed = {*file.ground}
    yield from _check_driver(file, bodies)
    placed.add(file.driver.pin)
    ordered = file.in_order
    done = {index for index, _ in ordered}
    left = [(index, group) for index, group in enumerate(file.group) if index not in done]
    known = placed.union(joint for group in file.group for _, joint in _added(group))
    if left and all(joint in known for _, group in left for _, joint in _needed(group)):
        yield _why_unplaced(file, [group for _, group in left]).at("$.group")
        left = []
    for index, group in ordered + left:
        where = f"$.group[{index}]"
        for key, joint in _needed(group):
            if joint not in known:
                yield _unknown("joint_unplaced", joint, known).at(f"{where}.{key}")
        for key, joint in _added(group):
            if joint in placed:
                counts = file.chain if key == "node" else None
                why = refusal(counts) if counts else None
                known_of = {**why.parameters, "why": why.code} if why else {}
                yield Finding(f"{where}.{key}", "joint_placed", {**known_of, "joint": joint})
            placed.add(joint)
        yield from _check_hinges(group, bodies, where)
        yield from _check_links(group, bodies, where)
    yield from _check_names(placed)


def _check_driver(file: MechanismFile, bodies: _CarriedJoints) -> Iterator[Finding]:
    """Check the joints of the driving link and of the cylinder that drives it."""
    if file.crank is not None:
        pivots = {"": file.crank.pivot}
        if file.crank.cylinder is not None:
            pivots[".cylinder"] = file.crank.cylinder.pivot
            slots = [(one.pivot, one.pin) for one in file.group if isinstance(one, SlottedLinkTable)]
            if (pivots[".cylinder"], file.crank.pin) not in slots:
                known = {"joint": file.crank.pin, "fixed": pivots[".cylinder"]}
                yield Finding("$.crank.cylinder", "cylinder_missing", known)
        for key, pivot in pivots.items():
            if pivot not in file.ground:
                yield _unknown("no_ground_pivot", pivot, {*file.ground}).at(f"$.crank{key}.pivot")
        if len({*pivots.values()}) < len(pivots):
            yield Finding("$.crank.cylinder.pivot", "cylinder_pivot")
        bodies.links[file.crank.link] = {file.crank.pivot, file.crank.pin}
    pin = file.driver.pin
    if pin in file.ground:
        where = "$.crank.pin" if file.crank else "$.driving_slider.pin"
        yield Finding(where, "pin_on_ground", {"joint": pin})


def _why_unplaced(file: MechanismFile, waiting: list[AnyGroupTable]) -> FaultError:
    """Return why groups wait for one another: the mechanism's mobility, or the class of its groups."""
    if (chain := file.chain) is not None:
        return refusal(chain)
    return FaultError("groups_wait", nodes=tuple(group.node for group in waiting[:MOST_NAMED]))


def _check_hinges(group: AnyGroupTable, bodies: _CarriedJoints, where: str) -> Iterator[Finding]:
    """Check that groups are hinged to points fixed on their links, and to two bodies in relative motion."""
    hinges = {joint for key, joint in _needed(group) if key.startswith(("pin", "pivot"))}
    for joint in sorted(hinges & bodies.moments.keys()):
        link = bodies.moments[joint]
        code = "hinge_of_instant" if bodies.links[link] else "hinge_of_yoke"
        yield Finding(where, code, {"joint": joint, "link": link})
    moving = [set(guide.joints) for _, guide in _guides(group) if guide.joints]
    match group:
        case CrossSliderTable():
            hinges = set().union(*moving) if len(moving) == len(group.guides) else set()
        case SliderTable() | YokeTable():
            hinges |= moving[0] if moving else set()
    # A single hinge beside a fixed guide moves unless it is itself on the ground.
    alone = len(hinges) == 1 and not hinges <= bodies.ground
    body = bodies.body_of(hinges) if hinges and not alone else None
    if body is not None:
        yield Finding(where, "all_on_link", {"link": body})


def _check_names(joints: set[str]) -> Iterator[Finding]:
    yield from _ambiguous_names(joints)
    lower = [joint.lower() for joint in joints]
    for joint in sorted(joints):
        if lower.count(joint.lower()) > 1:
            yield Finding("$", "joint_case", {"joint": joint})


def _ambiguous_names(joints: set[str]) -> Iterator[Finding]:
    """Report names that cannot be told apart: v_BA is B relative to A, so no third joint may be called BA."""
    read_as: dict[str, tuple[str, ...]] = {joint: (joint,) for joint in sorted(joints)}
    for first, second in permutations(sorted(joints), 2):
        other = read_as.setdefault(first + second, (first, second))
        if other != (first, second):
            alike = FaultError("joints_alike", name=first + second, first=first, second=second)
            yield alike.at("$", names=tuple(sorted({*other, first, second})))


def _guides(group: AnyGroupTable) -> list[tuple[str, GuideTable]]:
    match group:
        case SliderTable() | YokeTable():
            return [("guide", group.guide)]
        case CrossSliderTable():
            return [(f"guides[{index}]", guide) for index, guide in enumerate(group.guides)]
        case _:
            return []


def _needed(group: AnyGroupTable) -> Keyed:
    """Yield the joints that must be placed before the group."""
    match group:
        case DyadTable(pins=pins) | TriadTable(pins=pins):
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
    """Yield the joints that the group places."""
    if isinstance(group, TriadTable):
        yield from ((f"nodes[{index}]", node) for index, node in enumerate(group.nodes))
        yield "assur_point", group.assur_point
        return
    yield "node", group.node
    if isinstance(group, SlottedLinkTable) and group.foot is not None:
        yield "foot", group.foot
    yield from ((f"{key}.coincident", guide.coincident) for key, guide in _guides(group) if guide.coincident)


def _check_links(group: AnyGroupTable, bodies: _CarriedJoints, where: str) -> Iterator[Finding]:
    """Check that new links have new names, and that one link carries each base and moving guide."""
    yield from _check_guides(group, bodies, where)
    match group:
        case DyadTable():
            if group.pins[0] == group.pins[1]:
                yield Finding(f"{where}.pins", "joints_equal")
            for index, (pin, link) in enumerate(zip(group.pins, group.links, strict=True)):
                yield from _add_link(link, {pin, group.node}, bodies, f"{where}.links[{index}]")
        case SliderTable():
            yield from _add_link(group.link, {group.pin, group.node}, bodies, f"{where}.link")
        case SlottedLinkTable():
            if group.pin == group.pivot:
                yield Finding(f"{where}.pivot", "joints_equal")
            carried = {group.pivot, *([group.foot] if group.foot else [])}
            yield from _add_link(group.link, carried, bodies, f"{where}.link")
            bodies.slots[group.link] = {group.pivot, group.node}
            bodies.moments[group.node] = group.link
        case TriadTable():
            yield from _check_triad(group, bodies, where)
        case YokeTable(link=str(link)):
            yield from _add_link(link, set(), bodies, f"{where}.link")
            bodies.moments[group.node] = link
        case CrossSliderTable(guides=(first, second)):
            if not first.joints and not second.joints:
                yield Finding(f"{where}.guides", "guides_fixed")
        case PlateTable() | PointOnLineTable() | PointTable():
            yield from _check_base(group, bodies, f"{where}.base")


def _check_triad(group: TriadTable, bodies: _CarriedJoints, where: str) -> Iterator[Finding]:
    if len({*group.pins}) < len(group.pins):
        yield Finding(f"{where}.pins", "joints_equal")
    if (first := group.pins[0]) in bodies.ground:
        yield Finding(f"{where}.pins[0]", "first_leg_fixed", {"joint": first})
    held = [*({pin, node} for pin, node in zip(group.pins, group.nodes, strict=True)), {*group.nodes}]
    for index, (link, joints) in enumerate(zip(group.links, held, strict=True)):
        yield from _add_link(link, joints, bodies, f"{where}.links[{index}]")
    bodies.moments[group.assur_point] = group.links[3]


def _check_guides(group: AnyGroupTable, bodies: _CarriedJoints, where: str) -> Iterator[Finding]:
    for key, guide in _guides(group):
        if guide.joints and (guide.joints[0] == guide.joints[1] or bodies.of(guide.joints) is None):
            known = {"names": tuple(guide.joints), **bodies.carriers_of(guide.joints)}
            yield Finding(f"{where}.{key}.joints", "guide_joints", known)
        elif guide.joints and guide.coincident:
            bodies.moments[guide.coincident] = bodies.of(guide.joints) or ""


def _check_base(
    group: PlateTable | PointOnLineTable | PointTable, bodies: _CarriedJoints, where: str
) -> Iterator[Finding]:
    held = bodies.links.setdefault(group.link, set())
    on_slot = isinstance(group, PointTable) and set(group.base) == bodies.slots.get(group.link)
    if group.base[0] == group.base[1] or not (on_slot or set(group.base) <= held):
        known: dict[str, Parameter] = {"link": group.link}
        if held:
            known["names"] = tuple(sorted(held))
        if group.link in bodies.slots:
            known["base"] = tuple(sorted(bodies.slots[group.link], key=lambda joint: joint in bodies.moments))
        yield Finding(where, "base_joints", known)
    elif on_slot and group.base[0] not in held:
        yield Finding(where, "pivot_first")
    held.add(group.node)


def _add_link(link: str, joints: set[str], bodies: _CarriedJoints, where: str) -> Iterator[Finding]:
    """Add a group's links, and report used names: under one name, two bodies would pass for one."""
    if link in bodies.links:
        yield Finding(where, "link_taken", {"link": link})
    bodies.links.setdefault(link, joints)


def _unknown(code: str, joint: str, known: set[str]) -> FaultError:
    near = difflib.get_close_matches(joint, sorted(known), n=1, cutoff=0.5)
    meant: dict[str, Parameter] = {"near": near[0]} if near else {}
    return FaultError(code, joint=joint, names=tuple(sorted(known)), **meant)
