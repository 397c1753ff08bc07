"""Derive the construction of a mechanism's plans from the mechanism.

A `Draft` is a construction while it is written down. Each condition on a joint (it turns about a pin,
it slides on a guide) gives a line of the velocity plan and one of the acceleration plan; two conditions
place the joint's images where their lines meet.

Node names: a joint's image is its letter in lower case (``B`` -> ``b``, ``b'`` in the acceleration
plan), ground joints have the pole for their image, a normal component a_BA_n ends in ``n_BA``, a
Coriolis component a_B3B_c in ``k_B3B``.
"""

from collections.abc import Callable, Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from reference.construction.elements import (
    Along,
    Coriolis,
    Fixed,
    FixedLine,
    Line,
    Normal,
    Scaled,
    Side,
    VariantSide,
)
from reference.construction.forces import Accelerations, slot_axis, with_force_plans
from reference.construction.graph import AngularRate, Construction, Part, Vector, pair
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
    Pivot,
    Pole,
    Similar,
    Step,
    Tangent,
    TwoArcs,
    TwoLines,
)
from reference.mechanism import (
    Crank,
    CrossSlider,
    Driver,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Triad,
    Yoke,
    form_of,
    moving_guides,
    slotted_links,
)

VELOCITY_POLE, ACCELERATION_POLE = "o", "o'"
"""Names of the plans' poles."""


@dataclass(slots=True)
class Draft:
    """A construction while it is being written down."""

    mechanism: Mechanism
    plate_by_similarity: bool
    sketch: list[Step] = field(default_factory=list)
    velocity: list[Step] = field(default_factory=list)
    acceleration: list[Step] = field(default_factory=list)
    vectors: dict[str, Vector] = field(default_factory=dict)
    rates: dict[str, AngularRate] = field(default_factory=dict)
    images: dict[str, Similar] = field(default_factory=dict)

    def image(self, joint: str, *, primed: bool = False) -> str:
        """Return the node of a joint in the velocity (or acceleration) plan."""
        if self.mechanism.is_ground(joint):
            return ACCELERATION_POLE if primed else VELOCITY_POLE
        return image_name(joint, primed=primed)

    def images_of(self, base: tuple[str, str], *, primed: bool) -> tuple[str, str]:
        """Return the nodes of two joints in that plan."""
        return self.image(base[0], primed=primed), self.image(base[1], primed=primed)

    def add_images(self, velocity: Step, acceleration: Step) -> None:
        """Add a step to each plan."""
        self.velocity.append(velocity)
        self.acceleration.append(acceleration)

    def relative(self, node: str, pin: str) -> str:
        """Return the subscript of a vector of `node` relative to `pin`: BA relative to A, B to the ground."""
        return node if self.mechanism.is_ground(pin) else f"{node}{pin}"

    def vector(
        self,
        name: str,
        tail: str,
        head: str,
        link: tuple[str, str] | None = None,
        part: Part = "",
        turning: str | None = None,
    ) -> None:
        """Add a vector, see `Vector`."""
        scale = "kv" if name.startswith("v") else "ka"
        self.vectors[name] = Vector(name, tail, head, scale, link, part, turning)


def image_name(joint: str, *, primed: bool = False) -> str:
    """Return the lower-case image of a moving joint, primed in the acceleration plan."""
    return joint.lower() + ("'" if primed else "")


# Conditions on a joint ----------------------------------------------------------------------------

Condition = tuple[Line, Line]
"""A line of the velocity plan and one of the acceleration plan, on which the joint's images lie."""


def images_at(draft: Draft, node: str, conditions: Sequence[Condition]) -> None:
    """Add both images of a node, at the intersection of the two lines of each plan."""
    velocity_lines, acceleration_lines = zip(*conditions, strict=True)
    draft.add_images(
        TwoLines(draft.image(node), *velocity_lines),
        TwoLines(draft.image(node, primed=True), *acceleration_lines),
    )
    absolute(draft, node)


def rotations(draft: Draft, node: str, links: Mapping[str, str]) -> list[Condition]:
    """Add a node that turns about each pin: across the link, from the pin's image."""
    conditions = []
    for pin, link in links.items():
        length = Normal(draft.image(pin), draft.image(node), pair(pin, node))
        conditions.append(turning(draft, (pin, node), length))
        rates_of(draft, link, draft.relative(node, pin), (pin, node))
    return conditions


def turning(draft: Draft, link: tuple[str, str], length: Normal) -> Condition:
    """Return the lines across a link: from a pin's image, and from the end of its normal component."""
    pin, node = link
    about, across = draft.relative(node, pin), Along(pin, node, 1)
    start, end = draft.image(pin, primed=True), f"n_{about}"
    draft.acceleration.append(Given(end, start, length, Along(node, pin)))
    draft.vector(f"a_{about}_n", start, end, link, "n")
    draft.vector(f"a_{about}_t", end, draft.image(node, primed=True), link, "t")
    relative(draft, link)
    return Line(draft.image(pin), across), Line(end, across)


def relative(draft: Draft, link: tuple[str, str]) -> None:
    """Add velocity and full acceleration of a joint relative to another: v_BA, a_BA; v_B to the ground."""
    pin, node = link
    about = draft.relative(node, pin)
    draft.vector(f"v_{about}", draft.image(pin), draft.image(node), link)
    if not draft.mechanism.is_ground(pin):
        draft.vector(f"a_{about}", draft.image(pin, primed=True), draft.image(node, primed=True), link)


def slides(draft: Draft, node: str, guides: Sequence[Guide], at: str = "") -> list[Condition]:
    """Add a node that slides on guides: along each, from the image of the point under it.

    Arguments: `at`, the joint with which the node itself coincides.
    """
    conditions = []
    for guide in guides:
        if isinstance(guide, FixedGuide):
            along = FixedLine(f"guide {node}").along
            conditions.append((Line(VELOCITY_POLE, along), Line(ACCELERATION_POLE, along)))
            continue
        under, (g, h) = guide.coincident, guide.base
        draft.sketch.append(Coincide(under, at or node))
        draft.add_images(*similar_images(draft, under, (g, h)))
        absolute(draft, under)
        turn = (draft.image(g), draft.image(h))
        conditions.append(sliding(draft, (under, node), Along(g, h), turn, (guide.link, g, h)))
    return conditions


def sliding(
    draft: Draft, link: tuple[str, str], guide: Along, turn: tuple[str, str], turning_: tuple[str, str, str]
) -> Condition:
    """Return the lines of a joint that slides along a turning guide: Coriolis, then along the guide.

    Arguments: `turn`, ends of a velocity that turns the guide's link; `turning_`, that link and the two
    joints of it that the velocity belongs to.
    """
    other, node = link
    about, name = draft.relative(node, other), turning_[0]
    start, end = draft.image(other, primed=True), f"k_{node}{other}"
    length = Coriolis((draft.image(other), draft.image(node)), guide, turn, turning_[1:])
    draft.acceleration.append(Given(end, start, length, replace(guide, quarters=guide.quarters + 1)))
    draft.vector(f"a_{about}_c", start, end, link, "c", name)
    draft.vector(f"a_{about}_r", end, draft.image(node, primed=True), link, "r")
    relative(draft, link)
    return Line(draft.image(other), guide), Line(end, guide)


def in_slot(draft: Draft, node: str, pin: str, slot: Fixed) -> Condition:
    """Return the lines of a yoke's point relative to the block: along the slot, which does not turn."""
    image, image_primed = draft.image(pin), draft.image(pin, primed=True)
    draft.vector(f"v_{node}{pin}", image, draft.image(node), (pin, node))
    draft.vector(f"a_{node}{pin}_r", image_primed, draft.image(node, primed=True), (pin, node), "r")
    return Line(image, slot), Line(image_primed, slot)


# Points of links ----------------------------------------------------------------------------------


def guide_line(node: str, guide: Guide) -> Line | FixedLine:
    """Return a guide on the sketch."""
    if isinstance(guide, FixedGuide):
        return FixedLine(f"guide {node}")
    return Line(guide.base[0], Along(*guide.base))


def similar_images(draft: Draft, node: str, base: tuple[str, str]) -> tuple[Similar, Similar]:
    """Return the similarity steps of a link's third point, for both plans."""
    velocity, acceleration = (
        Similar(draft.image(node, primed=primed), draft.images_of(base, primed=primed), (*base, node))
        for primed in (False, True)
    )
    return velocity, acceleration


def note_similar_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Record how both images of a plate's third point would be found by similarity."""
    draft.images.update({step.node: step for step in similar_images(draft, node, base)})


def rigid_images(draft: Draft, node: str, base: tuple[str, str]) -> None:
    """Add both images of a link's point by similarity, without relative vectors."""
    note_similar_images(draft, node, base)
    draft.add_images(*similar_images(draft, node, base))
    absolute(draft, node)


def absolute(draft: Draft, node: str) -> None:
    """Add the velocity and the acceleration of a joint, from the poles."""
    if f"v_{node}" not in draft.vectors:
        draft.vector(f"v_{node}", VELOCITY_POLE, draft.image(node))
    draft.vector(f"a_{node}", ACCELERATION_POLE, draft.image(node, primed=True))


def rates_of(draft: Draft, link: str, about: str, joints: tuple[str, str], *, drives: bool = False) -> None:
    """Add omega and epsilon of a link, from the first vector that turns it."""
    for name, vector in ((f"omega_{link}", f"v_{about}"), (f"epsilon_{link}", f"a_{about}_t")):
        draft.rates.setdefault(name, AngularRate(name, vector, joints, pair(*joints), drives))


# The whole construction ---------------------------------------------------------------------------

CACHED = 256
"""Constructions in the cache: all variants of a mechanism share one."""
_cache: dict[Hashable, Construction] = {}


def construction_of(
    mechanism: Mechanism,
    *,
    accelerations: bool = True,
    plate_by_similarity: bool = False,
    forces: Accelerations | None = None,
) -> Construction:
    """Return how the mechanism and its plans are drawn, step by step.

    Arguments
    ---------
    accelerations : without it, only the mechanism and the velocity plan
    plate_by_similarity : images of plate points by similar triangles instead of perpendiculars
        (collinear plates always are: their perpendiculars coincide)
    forces : with force plans, the accelerations being ``given`` (then the other plans are left out), or
        the student's ``own``, as drawn
    """
    # Couples of inertia need the links' angular accelerations, wherever these come from.
    accelerations = accelerations or forces is not None
    form = (_form_of(mechanism), accelerations, plate_by_similarity, forces)
    if form not in _cache:
        if len(_cache) >= CACHED:
            _cache.clear()
        _cache[form] = _write_down(mechanism, accelerations, plate_by_similarity, forces)
    return _cache[form]


def _form_of(mechanism: Mechanism) -> Hashable:
    """Return everything that the construction depends on: names, kinds, and which points are in line."""
    in_line = tuple(
        (group.is_ever_flat, group.line_ratio is None)
        for group in mechanism.groups
        if isinstance(group, Plate)
    )
    return (form_of(mechanism), in_line)


def _write_down(
    mechanism: Mechanism, accelerations: bool, plate_by_similarity: bool, forces: Accelerations | None
) -> Construction:
    draft = Draft(mechanism, plate_by_similarity)
    draft.velocity.append(Pole(VELOCITY_POLE))
    draft.acceleration.append(Pole(ACCELERATION_POLE))
    draft.sketch.extend(Pivot(joint) for joint in mechanism.ground_m)
    _draw_driver(draft, mechanism.driver)
    for group in mechanism.groups:
        _draw_group(draft, group)
    figures: dict[str, tuple[Step, ...]] = {
        "mechanism": tuple(draft.sketch),
        "velocity_plan": tuple(draft.velocity),
    }
    poles = {"velocity_plan": VELOCITY_POLE}
    if accelerations:
        figures["acceleration_plan"] = tuple(draft.acceleration)
        poles["acceleration_plan"] = ACCELERATION_POLE
    keep = {step.node for steps in figures.values() for step in steps}
    vectors = {name: draft.vectors[name] for name in _in_order(draft) if draft.vectors[name].head in keep}
    ordered = sorted(draft.rates.values(), key=lambda rate: (rate.name.startswith("epsilon"), rate.name))
    rates = {rate.name: rate for rate in ordered if rate.vector in vectors}
    images = {node: step for node, step in draft.images.items() if node in keep}
    links = [draft.vectors[name] for name in _in_order(draft) if name in draft.vectors]
    crossings = {group.assur_point for group in mechanism.groups if isinstance(group, Triad)}
    ends = (one.link for one in links if one.link and one.part != "r")
    pairs = tuple(dict.fromkeys(link for link in ends if crossings.isdisjoint(link)))
    centres, dots = _centres(draft, rates), mechanism.dots
    whole = Construction(figures, poles, vectors, rates, images, centres, pairs, dots)
    return whole if forces is None else with_force_plans(mechanism, whole, forces)


def _centres(draft: Draft, rates: Mapping[str, AngularRate]) -> dict[str, Similar]:
    """Return centres: I with triangle I A B similar to o a b, J with J A B similar to o' a' b' (Mehmke)."""
    centres = {}
    for name, rate in rates.items():
        kind, _, link = name.partition("_")
        tail, head = rate.link
        if not draft.mechanism.is_ground(tail):
            primed = kind == "epsilon"
            images = (draft.image(tail, primed=primed), draft.image(head, primed=primed))
            pole = ACCELERATION_POLE if primed else VELOCITY_POLE
            centre = f"{'J' if primed else 'I'}{link}"
            centres[centre] = Similar(centre, (tail, head), (*images, pole))
    return centres


def _in_order(draft: Draft) -> list[str]:
    """Order the names of vectors: velocities first, joint by joint, the absolute one before its parts."""
    joints = draft.mechanism.joints

    def place(name: str) -> tuple[bool, int, str, str]:
        kind, about, *part = name.split("_")
        joint = max((joint for joint in joints if about.startswith(joint)), key=len)
        other = about.removeprefix(joint)
        pin = "" if other == "" and not part else f"{joints.index(other) if other else 99:03d}"
        return kind == "a", joints.index(joint), pin, "".join(part)

    return sorted(draft.vectors, key=place)


def _draw_driver(draft: Draft, driver: Driver) -> None:
    if isinstance(driver, Crank):
        _draw_crank(draft, driver)
    else:
        _draw_driving_slider(draft, driver)


def _draw_driving_slider(draft: Draft, slider: DrivingSlider) -> None:
    pin, guide = slider.pin, FixedLine(f"guide {slider.pin}")
    draft.sketch.append(OnGuide(pin, guide, Scaled(f"s {pin}", "kL")))
    a, a_primed = draft.image(pin), draft.image(pin, primed=True)
    speed, acceleration = Scaled(f"v_{pin}", "kv"), Scaled(f"a_{pin}", "ka")
    draft.velocity.append(Given(a, VELOCITY_POLE, speed, guide.along))
    draft.acceleration.append(Given(a_primed, ACCELERATION_POLE, acceleration, guide.along))
    absolute(draft, pin)


def _draw_crank(draft: Draft, crank: Crank) -> None:
    pivot, pin = crank.pivot, crank.pin
    length = f"{pivot}{pin}"
    draft.sketch.append(Given(pin, pivot, Scaled(length, "kL"), Fixed("angle crank")))
    a, a_primed = draft.image(pin), draft.image(pin, primed=True)
    across = Along(pivot, pin, 1)
    draft.velocity.append(Given(a, VELOCITY_POLE, Scaled(f"v_{pin}", "kv"), across))
    draft.vector(f"v_{pin}", VELOCITY_POLE, a, (pivot, pin))
    inward = Along(pin, pivot)
    normal = Scaled(f"a_{pin}_n", "ka")
    if crank.accelerated:
        end = f"n_{pin}"
        draft.acceleration.append(Given(end, ACCELERATION_POLE, normal, inward))
        draft.acceleration.append(Given(a_primed, end, Scaled(f"a_{pin}_t", "ka"), across))
        draft.vector(f"a_{pin}_n", ACCELERATION_POLE, end, (pivot, pin), "n")
        draft.vector(f"a_{pin}_t", end, a_primed, (pivot, pin), "t")
    else:
        draft.acceleration.append(Given(a_primed, ACCELERATION_POLE, normal, inward))
    draft.vector(f"a_{pin}", ACCELERATION_POLE, a_primed)
    rates_of(draft, crank.link, pin, (pivot, pin), drives=True)


def _draw_group(draft: Draft, group: Group) -> None:
    match group:
        case Dyad(node=node, pins=(p, q), links=(link_p, link_q)):
            radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
            draft.sketch.append(TwoArcs(node, (p, q), radii, _side(group)))
            images_at(draft, node, rotations(draft, node, {p: link_p, q: link_q}))
        case Plate(node=node, base=(p, q), link=link):
            _draw_plate(draft, group)
            note_similar_images(draft, node, (p, q))
            if group.is_ever_flat or draft.plate_by_similarity:
                rigid_images(draft, node, (p, q))
                for pin in (p, q):
                    if not draft.mechanism.is_ground(pin):
                        relative(draft, (pin, node))
            else:
                images_at(draft, node, rotations(draft, node, {p: link, q: link}))
        case PointOnLine(node=node, base=(p, q)):
            ratio = f"ratio {node}"
            draft.sketch.append(Divide(node, (p, q), ratio))
            draft.add_images(
                *(
                    Divide(draft.image(node, primed=primed), draft.images_of((p, q), primed=primed), ratio)
                    for primed in (False, True)
                )
            )
            absolute(draft, node)
        case Slider(node=node, pin=pin, link=link, guide=guide):
            radius = Scaled(pair(pin, node), "kL")
            draft.sketch.append(ArcAndLine(node, pin, radius, guide_line(node, guide), _side(group)))
            turns = rotations(draft, node, {pin: link})
            images_at(draft, node, turns + slides(draft, node, (guide,)))
        case CrossSlider(node=node, guides=guides):
            draft.sketch.append(TwoLines(node, *(guide_line(node, guide) for guide in guides)))
            images_at(draft, node, slides(draft, node, guides))
        case _:
            _DRAWN[type(group)](draft, group)


def _side(group: Dyad | Plate | Slider | SlottedLink) -> Side:
    """Return the group's side or, if it may differ between variants, the name of its parameter."""
    return group.side if isinstance(group.side, int) else VariantSide(f"side {group.node}")


def _draw_plate(draft: Draft, group: Plate) -> None:
    node, (p, q) = group.node, group.base
    if group.line_ratio is not None:
        draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
        return
    radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
    draft.sketch.append(TwoArcs(node, (p, q), radii, _side(group)))


def _draw_yoke(draft: Draft, group: Yoke) -> None:
    node, pin, guide = group.node, group.pin, group.guide
    if isinstance(guide, FixedGuide):
        slot = Fixed(f"angle slot {node}")
        draft.sketch.append(TwoLines(node, Line(pin, slot), guide_line(node, guide)))
        images_at(draft, node, [in_slot(draft, node, pin, slot), *slides(draft, node, (guide,))])
        return
    draft.sketch.append(Coincide(node, pin))
    along, across = slides(draft, node, (guide,), at=pin), Along(*guide.base, 1)
    turn = draft.images_of(guide.base, primed=False)
    lines = sliding(draft, (pin, node), across, turn, (guide.link, *guide.base))
    images_at(draft, node, [*along, lines])


def _draw_slotted_link(draft: Draft, group: SlottedLink) -> None:
    node, pin, pivot = group.node, group.pin, group.pivot
    if group.foot is not None:
        offset = Scaled(f"offset {node}", "kL")
        draft.sketch.append(Tangent(group.foot, pivot, offset, pin, _side(group)))
    draft.sketch.append(Coincide(node, pin))
    length = Normal(draft.image(pivot), draft.image(node), pair(pivot, node), measured=(pivot, node))
    turn = (draft.image(pivot), draft.image(node))
    conditions = (
        turning(draft, (pivot, node), length),
        sliding(draft, (pin, node), slot_axis(group), turn, (group.link, pivot, node)),
    )
    images_at(draft, node, conditions)
    rates_of(draft, group.link, draft.relative(node, pivot), (pivot, node))
    if group.foot is not None and _is_used(draft.mechanism, group.foot):
        rigid_images(draft, group.foot, (pivot, node))


def _draw_triad(draft: Draft, group: Triad) -> None:
    """Draw a triad by its Assur point S, in which the lines of the first two legs A D and B E cross.

    v_S is across both lines; so is what is left of a_S after the normal components of D about A and of S
    about D, and of E about B and of S about E. From S and C follows F, from F the joints D and E.
    """
    (d, e, f), (a, b, c), s = group.corners, group.pins, group.assur_point
    _draw_ternary(draft, group)
    link, ternary = dict(zip((d, e, f), group.links[:3], strict=True)), group.links[3]
    lines, starts = dict[str, Condition](), list[Condition]()
    for pin, corner in ((a, d), (b, e)):
        length = Normal(draft.image(pin), draft.image(corner), pair(pin, corner))
        lines[corner] = turning(draft, (pin, corner), length)
        about, end = draft.relative(s, pin), f"n_{s}{corner}"
        length = Normal(draft.image(s), draft.image(corner), pair(corner, s), measured=(corner, s))
        draft.acceleration.append(Given(end, f"n_{draft.relative(corner, pin)}", length, Along(s, corner)))
        draft.vector(f"v_{corner}{s}", draft.image(s), draft.image(corner), (s, corner))
        draft.vector(f"a_{s}{corner}_n", f"n_{draft.relative(corner, pin)}", end, (corner, s), "n")
        draft.vector(f"a_{about}_t", end, draft.image(s, primed=True), (pin, s), "t")
        relative(draft, (pin, s))
        starts.append((lines[corner][0], Line(end, Along(pin, corner, 1))))
        rates_of(draft, link[corner], draft.relative(corner, pin), (pin, corner))
    images_at(draft, s, starts)
    length = Normal(draft.image(s), draft.image(f), pair(s, f), measured=(s, f))
    of_s = turning(draft, (s, f), length)
    images_at(draft, f, [of_s, *rotations(draft, f, {c: link[f]})])
    for corner in (d, e):
        images_at(draft, corner, [lines[corner], *rotations(draft, corner, {f: ternary})])


def _draw_ternary(draft: Draft, group: Triad) -> None:
    """Draw a triad's joints on the sketch, from the direction of its first leg, and its Assur point."""
    (d, e, f), (a, b, _), s = group.corners, group.pins, group.assur_point
    draft.sketch.append(Given(d, a, Scaled(pair(a, d), "kL"), Fixed(f"angle {pair(a, d)}")))
    names = {e: (pair(d, e), pair(b, e)), f: (pair(f, d), pair(f, e))}
    for node, centres in ((e, (d, b)), (f, (d, e))):
        radii = (Scaled(names[node][0], "kL"), Scaled(names[node][1], "kL"))
        draft.sketch.append(TwoArcs(node, centres, radii, VariantSide(f"side {node}")))
    draft.sketch.append(TwoLines(s, Line(a, Along(a, d)), Line(b, Along(b, e))))


def _is_used(mechanism: Mechanism, joint: str) -> bool:
    """Return whether another group is attached to a joint, or it is a centre of mass."""
    several = [getattr(group, key, ()) for group in mechanism.groups for key in ("pins", "base")]
    single = [getattr(group, key, "") for group in mechanism.groups for key in ("pin", "pivot")]
    guides = [guide.base for group in mechanism.groups for guide in moving_guides(group)]
    centres = [body.centre for body in mechanism.bodies]
    return any(joint in joints for joints in (*several, single, *guides, centres))


def _draw_slot_point(draft: Draft, group: SlotPoint) -> None:
    node = group.node
    slotted = slotted_links(draft.mechanism)[group.link]
    x, y = Scaled(f"x {node}", "kL"), Scaled(f"y {node}", "kL")
    draft.sketch.append(Local(node, slotted.pivot, slot_axis(slotted), x, y))
    rigid_images(draft, node, (slotted.pivot, slotted.node))


_DRAWN: Mapping[type, Callable[[Draft, Any], None]] = {
    Yoke: _draw_yoke,
    SlottedLink: _draw_slotted_link,
    SlotPoint: _draw_slot_point,
    Triad: _draw_triad,
}
"""The groups whose drawing takes a function of its own."""
