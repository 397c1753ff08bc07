"""A planar mechanism for one variant or for many: ground, a driving link, Assur groups in order.

All numbers are SI and arrays that broadcast over variants and positions, shape (N,). Angles are
counter-clockwise from +x. Branches are explicit signs, never starting guesses: `side` is +1 to the
left of the directed line between the group's pins (for a slider: ahead along its guide), -1 to the
right (behind); an array where it differs between variants.
"""

from collections.abc import Callable, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from types import NoneType
from typing import Any

import numpy as np

from reference.geometry import ComplexArray, FloatArray

Pins = tuple[str, str]
Side = int | FloatArray


@dataclass(frozen=True, slots=True)
class Crank:
    """The driving link: pivot on the ground, pin at its end; `omega` may be negative (clockwise).

    `rpm` (rev/min, before the gear) and `gear_ratio` are those from which omega was computed, if it was.
    """

    link: str
    pivot: str
    pin: str
    length_m: FloatArray
    angle_rad: FloatArray
    omega: FloatArray
    epsilon: FloatArray
    accelerated: bool
    """True if the crank has an angular acceleration: without one, a_A has no tangential part."""
    rpm: FloatArray | None = None
    gear_ratio: FloatArray | None = None
    cylinder: str | None = None
    """The cylinder that drives the crank, a slotted link, if one does."""


@dataclass(frozen=True, slots=True)
class DrivingSlider:
    """The driving link is a slider: its `pin` lies at `displacement_m` along a fixed guide."""

    link: str
    pin: str
    guide_m: ComplexArray
    guide_rad: FloatArray
    displacement_m: FloatArray
    speed: FloatArray
    acceleration: FloatArray


Driver = Crank | DrivingSlider


@dataclass(frozen=True, slots=True)
class FixedGuide:
    """A straight guide on the ground, given by one of its points (m) and its direction."""

    through_m: ComplexArray
    angle_rad: FloatArray


@dataclass(frozen=True, slots=True)
class MovingGuide:
    """A straight guide on a moving link: the line through two of its joints.

    `coincident` names the point of the link that lies under the slider at this instant.
    """

    link: str
    base: Pins
    coincident: str


Guide = FixedGuide | MovingGuide


@dataclass(frozen=True, slots=True)
class Dyad:
    """Assur group RRR: `node` joins two links, hinged at `pins`, of the lengths given."""

    node: str
    pins: Pins
    links: tuple[str, str]
    lengths_m: tuple[FloatArray, FloatArray]
    side: Side


@dataclass(frozen=True, slots=True)
class Slider:
    """Assur group RRP: `node` slides on a guide, a rod of `length_m` joins it to `pin`."""

    node: str
    pin: str
    link: str
    length_m: FloatArray
    guide: Guide
    side: Side


@dataclass(frozen=True, slots=True)
class SlottedLink:
    """Assur group RPR: `link` turns about `pivot`, and a block at `pin` slides along its guide.

    `node` is the point of the link that coincides with the pin at this instant. The guide passes the
    pivot at `offset_m`, the pin lying that far to the left of the pivot's parallel to the guide; then
    `foot` is the guide's nearest point to the pivot, a point of the link. `side` is +1 where the pin
    lies ahead of the pivot along the guide's direction.
    """

    node: str
    pin: str
    pivot: str
    link: str
    offset_m: FloatArray
    foot: str | None
    side: Side


@dataclass(frozen=True, slots=True)
class CrossSlider:
    """Assur group PRP: `node` hinges two blocks, each on a guide; at least one guide moves."""

    node: str
    guides: tuple[Guide, Guide]


@dataclass(frozen=True, slots=True)
class Yoke:
    """Assur group RPP: a block hinged at `pin` slides in a yoke's slot, the yoke on a guide.

    On a fixed guide `node` is the yoke's point where slot and guide cross, and `slot_rad` the slot's
    direction. On a moving guide, with which yoke and block turn, the slot is perpendicular to the guide, and
    `node` is the yoke's point that coincides with the pin at this instant.
    """

    node: str
    pin: str
    slot_rad: FloatArray
    guide: Guide
    link: str = ""
    """The yoke's name, on a moving guide."""


@dataclass(frozen=True, slots=True)
class Plate:
    """A third point of a link that already carries `base`, by its distances from both.

    Attributes
    ----------
    shape : (node - base[0]) / (base[1] - base[0]), constant in a rigid link, rounded; real where the
        three points are in line, nan where no such triangle closes
    local_m : where the file gives coordinates instead of distances: x + i y, x along the base
    """

    node: str
    base: Pins
    link: str
    lengths_m: tuple[FloatArray, FloatArray]
    side: Side
    shape: ComplexArray
    local_m: ComplexArray | None = None

    @property
    def line_ratio(self) -> FloatArray | None:
        """The ratio of `PointOnLine` if the three points are in line for every variant, else None."""
        return np.asarray(self.shape.real) if np.all(self.shape.imag == 0.0) else None

    @property
    def is_ever_flat(self) -> bool:
        """True if the three points are in line for some variant, so that the image comes by similarity."""
        return bool(np.any(self.shape.imag == 0.0))


@dataclass(frozen=True, slots=True)
class PointOnLine:
    """A point of a link on the line through `base`: node = base[0] + ratio (base[1] - base[0]).

    `local_m`, where the file gives coordinates: its distance from base[0]; `ratio` is then rounded.
    """

    node: str
    base: Pins
    link: str
    ratio: FloatArray
    local_m: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class SlotPoint:
    """A point of a slotted link in the link's own axes: origin its pivot, x along its guide.

    `slotted` is the node of the `SlottedLink`; `local_m` is x + i y, y to the guide's left.
    """

    node: str
    slotted: str
    link: str
    local_m: ComplexArray


@dataclass(frozen=True, slots=True)
class Triad:
    """Assur group of the third class: a ternary link on three legs from `pins`, all turning pairs.

    Attributes
    ----------
    corners : joints of the ternary link, in the order of the legs
    assur_point : the point of the ternary link where the lines of the first two legs cross
    links : the three legs, then the ternary link
    legs_m : lengths of the legs
    sides_m : |DE|, |EF|, |FD| of the ternary link D E F; `shape` is (F - D) / (E - D)
    direction_rad : roughly the direction of D E, which tells the assembly
    leg_rad : the direction of A D where it is followed, else None
    sign : that of the group's determinant where it is followed, else 0
    """

    corners: tuple[str, str, str]
    pins: tuple[str, str, str]
    assur_point: str
    links: tuple[str, str, str, str]
    legs_m: tuple[FloatArray, FloatArray, FloatArray]
    sides_m: tuple[FloatArray, FloatArray, FloatArray]
    turned: Side
    shape: ComplexArray
    direction_rad: FloatArray
    leg_rad: FloatArray | None = None
    sign: int = 0

    @property
    def node(self) -> str:
        """The third joint of the ternary link."""
        return self.corners[2]

    @property
    def bars(self) -> tuple[tuple[str, str, str], ...]:
        """Each leg and each side of the ternary link: its link, its earlier joint, its later joint."""
        (d, e, f), ternary = self.corners, self.links[3]
        legs = zip(self.links[:3], self.pins, self.corners, strict=True)
        return *legs, (ternary, d, e), (ternary, d, f), (ternary, e, f)


Group = Dyad | Slider | SlottedLink | CrossSlider | Yoke | Plate | PointOnLine | SlotPoint | Triad


@dataclass(frozen=True, slots=True)
class Body:
    """The mass of a link.

    Attributes
    ----------
    link : its name; a slider has that of its joint (``slider_B``)
    centre : the joint, or the further point of the link, that is its centre of mass
    mass : kg, shape (N,); None where it is neglected
    inertia : moment of inertia about the centre, kg m^2; None where it is neglected
    """

    link: str
    centre: str
    mass: FloatArray | None = None
    inertia: FloatArray | None = None


@dataclass(frozen=True, slots=True)
class Load:
    """A given force on a link at one of its points, or a given couple.

    Attributes
    ----------
    name : the force's subscript (``D`` of F_D)
    force : N, complex; where it follows a slider's motion its real part is the force, positive in the
        motion's sense, negative against it
    slider : the joint of that slider; None for a force of given direction
    couple : N m, counter-clockwise positive; a load has a force or a couple
    """

    name: str
    link: str
    point: str
    force: ComplexArray | None = None
    couple: FloatArray | None = None
    slider: str | None = None


@dataclass(frozen=True, slots=True)
class Mechanism:
    """Ground pivots (complex metres), the driving link, and the groups in order of assembly.

    For its forces: the bodies' masses, the given loads, the acceleration of gravity (m/s^2, downwards, None
    where weight is neglected), and `pins`: the link that carries the pin of a joint that three links share.
    """

    ground_m: Mapping[str, ComplexArray]
    driver: Driver
    groups: tuple[Group, ...]
    bodies: tuple[Body, ...] = ()
    loads: tuple[Load, ...] = ()
    gravity: FloatArray | None = None
    pins: Mapping[str, str] = field(default_factory=dict)

    @property
    def crank(self) -> Crank:
        """The driving crank; raises ValueError if a slider drives."""
        if not isinstance(self.driver, Crank):
            raise ValueError("this mechanism has a driving slider, not a crank")  # noqa: TRY004
        return self.driver

    @property
    def joints(self) -> tuple[str, ...]:
        """Names of all joints: ground pivots, the driving pin, then what each group adds."""
        added = (joint for group in self.groups for joint in joints_of(group))
        return (*self.ground_m, self.driver.pin, *added)

    @property
    def dots(self) -> frozenset[str]:
        """The centres of mass that are no joints: a sketch has dots there, and no bars to them."""
        hinged = {member.points[0] for _, member, _ in members(self)}
        return frozenset(one.centre for one in self.bodies if one.centre == f"S{one.link}") - hinged

    def is_ground(self, joint: str) -> bool:
        """Return whether a joint is fixed to the ground."""
        return joint in self.ground_m


def translated(mechanism: Mechanism, by: ComplexArray) -> Mechanism:
    """Return the mechanism translated by a vector, complex metres."""

    def onward(guide: Guide) -> Any:  # noqa: ANN401 - of the kind that it is given
        return replace(guide, through_m=guide.through_m + by) if isinstance(guide, FixedGuide) else guide

    def carried(group: Group) -> Group:
        match group:
            case Slider() | Yoke():
                return replace(group, guide=onward(group.guide))
            case CrossSlider(guides=(first, second)):
                return replace(group, guides=(onward(first), onward(second)))
        return group

    driver = mechanism.driver
    if isinstance(driver, DrivingSlider):
        driver = replace(driver, guide_m=driver.guide_m + by)
    ground = {joint: place + by for joint, place in mechanism.ground_m.items()}
    groups = tuple(carried(group) for group in mechanism.groups)
    return replace(mechanism, ground_m=ground, driver=driver, groups=groups)


def driving_of(driver: Driver) -> FloatArray:
    """The driving coordinate: a crank's angle (rad), a slider's displacement (m)."""
    return driver.angle_rad if isinstance(driver, Crank) else driver.displacement_m


def rows_of(mechanism: Mechanism, rows: Sequence[int] | np.ndarray) -> Mechanism:
    """Return the mechanism of some of its variants."""
    chosen: Mechanism = with_arrays(mechanism, lambda values: values[rows])
    return chosen


def guides_of(group: Group) -> tuple[Guide, ...]:
    """Guides on which a group slides."""
    return tuple(member.guide for member in members_of(group) if member.guide is not None)


def moving_guides(group: Group) -> tuple[MovingGuide, ...]:
    """The guides of a group that are carried by moving links."""
    return tuple(guide for guide in guides_of(group) if isinstance(guide, MovingGuide))


def joints_of(group: Group) -> tuple[str, ...]:
    """The joints that a group adds: its node, the points that coincide with it, a guide's foot."""
    if isinstance(group, Triad):
        return (*group.corners, group.assur_point)
    foot = (group.foot,) if isinstance(group, SlottedLink) and group.foot else ()
    return (*foot, group.node, *(guide.coincident for guide in moving_guides(group)))


# Links and the joints that they carry --------------------------------------------------------------

GROUND, SLIDER = "0", "slider_"
"""The frame's name among the links, and the start of a slider's."""


@dataclass(frozen=True, slots=True)
class Member:
    """A link that a group adds.

    Attributes
    ----------
    name : a slider has that of its joint
    points : the joints that are fixed on it, the one at which it is hinged to earlier links first
    turns_with : the link whose angular velocity it has: its own name, of a slider the link that carries its
        guide or its slot; empty where that does not turn
    guide : on which it slides; None for a block in a slot
    """

    name: str
    points: tuple[str, ...]
    turns_with: str
    guide: Guide | None = None

    @property
    def slides(self) -> bool:
        """True if it has no angular velocity of its own; it then carries a single joint."""
        return self.turns_with != self.name


def members_of(group: Group) -> tuple[Member, ...]:
    """Return the links that a group adds, in the order of its outer pins; a point of a link adds none."""
    match group:
        case Dyad(node=node, pins=pins, links=links):
            return tuple(Member(link, (pin, node), link) for pin, link in zip(pins, links, strict=True))
        case Slider(node=node, pin=pin, link=link, guide=guide):
            return Member(link, (pin, node), link), _slider(SLIDER + node, node, guide)
        case SlottedLink(pin=pin, pivot=pivot, link=link, foot=foot):
            return Member(link, (pivot, *([foot] if foot else [])), link), Member(SLIDER + pin, (pin,), link)
        case CrossSlider(node=node, guides=(first, second)):
            return _slider(SLIDER + node, node, first), _slider(f"{SLIDER}{node}2", node, second)
        case Yoke(node=node, pin=pin, link=link, guide=guide):
            yoke = _slider(link or SLIDER + node, node, guide)
            return yoke, Member(SLIDER + pin, (pin,), yoke.turns_with)
        case Triad(corners=corners, pins=pins, links=links):
            held = (*zip(pins, corners, strict=True), corners)
            return tuple(Member(link, ends, link) for link, ends in zip(links, held, strict=True))
    return ()


def _slider(name: str, joint: str, guide: Guide) -> Member:
    return Member(name, (joint,), guide.link if isinstance(guide, MovingGuide) else "", guide)


def named_links(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the links that each group adds, by the group's node, in the order of `members_of`.

    A further slider at a joint that has one already is numbered: ``slider_A``, then ``slider_A2``.
    """
    taken, named = {mechanism.driver.link}, dict[str, tuple[str, ...]]()
    for group in mechanism.groups:
        names: list[str] = []
        for member in members_of(group):
            name, count = member.name, 1
            while name in taken:
                count += 1
                name = f"{member.name}{count}"
            taken.add(name)
            names.append(name)
        named[group.node] = tuple(names)
    return named


def members(mechanism: Mechanism) -> Iterator[tuple[str, Member, Group]]:
    """Yield the links that groups add, each with its name as `named_links` has it, and its group."""
    named = named_links(mechanism)
    for group in mechanism.groups:
        for name, member in zip(named[group.node], members_of(group), strict=True):
            yield name, member, group


def slotted_links(mechanism: Mechanism) -> dict[str, SlottedLink]:
    """Return the slotted links by their names; among them the cylinder that drives a crank."""
    return {group.link: group for group in mechanism.groups if isinstance(group, SlottedLink)}


def short_name(link: str) -> str:
    """Return a link as it stands in names of forces; a slider by its joint."""
    return link.removeprefix(SLIDER)


def short_names(mechanism: Mechanism) -> dict[str, str]:
    """Return `short_name` of each link; a slider's whole name where a link is called as its joint."""
    links = [link for added in named_links(mechanism).values() for link in added]
    names = {GROUND: GROUND, mechanism.driver.link: mechanism.driver.link}
    names |= {link: link for link in links if not link.startswith(SLIDER)}
    taken = set(names)
    for link in links:
        names.setdefault(link, link if short_name(link) in taken else short_name(link))
    return names


def hinged_at(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the links that are hinged together, or fixed, at each joint by the group that adds it.

    The last one carries the joint's pin unless the mechanism's `pins` says otherwise. Points of a link are
    its own alone; so are those under a slider, for this instant.
    """
    driver = mechanism.driver
    found: dict[str, tuple[str, ...]] = dict.fromkeys(mechanism.ground_m, (GROUND,))
    found[driver.pin] = (driver.link,)
    named = named_links(mechanism)
    for group in mechanism.groups:
        found |= {guide.coincident: (guide.link,) for guide in moving_guides(group)}
        match group:
            case SlottedLink(link=link):
                found |= dict.fromkeys(joints_of(group), (link,))
            case CrossSlider():
                found[group.node] = named[group.node][::-1]
            case Yoke():
                found[group.node] = named[group.node][:1]
            case Dyad() | Slider():
                found[group.node] = named[group.node]
            case Triad(links=(*legs, ternary)):
                found |= {corner: (leg, ternary) for corner, leg in zip(group.corners, legs, strict=True)}
                found[group.assur_point] = (ternary,)
            case _:
                found[group.node] = (group.link,)
    return found


def carriers(mechanism: Mechanism) -> dict[str, str]:
    """Return the link that carries the pin of each joint, to which later groups are hinged.

    Of a joint of two links it is the second one (of a slider, the slider; of two blocks, the first), unless
    `pins` says otherwise.
    """
    return {**{joint: links[-1] for joint, links in hinged_at(mechanism).items()}, **mechanism.pins}


def points_of(mechanism: Mechanism) -> dict[str, tuple[str, ...]]:
    """Return the joints and points of every moving link that are fixed on it.

    A yoke on a moving guide has no such point; its node, the point under the pin, stands for one.
    """
    driver = mechanism.driver
    pivot = (driver.pivot,) if isinstance(driver, Crank) else ()
    held: dict[str, tuple[str, ...]] = {driver.link: (*pivot, driver.pin)}
    held |= {name: member.points for name, member, _ in members(mechanism)}
    for group in mechanism.groups:
        if isinstance(group, Plate | PointOnLine | SlotPoint):
            held[group.link] += (group.node,)
    return held


def sliders_of(mechanism: Mechanism) -> dict[str, Guide | None]:
    """Return the links that slide and carry a single joint, with their guides; None for a block in a slot."""
    driver = mechanism.driver
    found: dict[str, Guide | None] = {}
    if isinstance(driver, DrivingSlider):
        found[driver.link] = FixedGuide(driver.guide_m, driver.guide_rad)
    return found | {name: member.guide for name, member, _ in members(mechanism) if member.slides}


def turning(mechanism: Mechanism) -> dict[str, tuple[str, str, str]]:
    """Return for every link that turns the one whose rate it has (a slider: its guide's), and two joints."""
    driver = mechanism.driver
    found = {driver.link: (driver.link, driver.pivot, driver.pin)} if isinstance(driver, Crank) else {}
    for name, member, group in members(mechanism):
        if not member.slides:
            end = member.points[1] if isinstance(group, Triad) else group.node
            found[name] = (name, member.points[0], end)
        elif member.turns_with:
            found[name] = found[member.turns_with]
    return found


# A mechanism apart from its numbers ----------------------------------------------------------------


Array = np.ndarray[Any, np.dtype[Any]]
"""Real or complex numbers: one for all variants, or one for each."""
PLAIN = (str, int, float, complex, NoneType)
"""Types that a mechanism consists of besides records, tuples, mappings and arrays."""


def with_arrays(part: Any, change: Callable[[Array], Any]) -> Any:  # noqa: ANN401 - the same kind of part
    """Return a mechanism, or a part of it, with every array replaced, in the order of its fields."""
    if isinstance(part, np.ndarray):
        return change(part)
    if isinstance(part, PLAIN):
        return part
    if isinstance(part, tuple):
        return tuple([with_arrays(inner, change) for inner in part])
    if isinstance(part, Mapping):
        return {name: with_arrays(inner, change) for name, inner in part.items()}
    return type(part)(*[with_arrays(getattr(part, name), change) for name in part.__slots__])


def form_of(part: Any) -> Hashable:  # noqa: ANN401 - a mechanism, or whatever a part is made of
    """Return all of a mechanism except the values of its arrays; equal if they share a construction."""
    if isinstance(part, np.ndarray):
        return str(part.dtype.kind)
    if isinstance(part, PLAIN):
        return part
    if isinstance(part, tuple):
        return tuple([form_of(inner) for inner in part])
    if isinstance(part, Mapping):
        return tuple([(name, form_of(inner)) for name, inner in part.items()])
    return (type(part), *[form_of(getattr(part, name)) for name in part.__slots__])
