"""The drawing of a mechanism's parts, one function for each kind of driving link and of Assur group."""

from functools import singledispatch

from reference.construction.draft import (
    ACCELERATION_POLE,
    VELOCITY_POLE,
    Condition,
    Draft,
    absolute,
    guide_line,
    images_at,
    in_slot,
    note_similar_images,
    rates_of,
    relative,
    rigid_images,
    rotations,
    slides,
    sliding,
    turning,
)
from reference.construction.elements import Along, Fixed, FixedLine, Line, Normal, Scaled, Side, VariantSide
from reference.construction.forces import slot_axis
from reference.construction.graph import pair
from reference.construction.steps import (
    ArcAndLine,
    Coincide,
    Divide,
    Given,
    Local,
    OnGuide,
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
    Mechanism,
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


@singledispatch
def draw(part: Driver | Group, draft: Draft) -> None:
    """Write down how a part of a mechanism is drawn: its joints on the sketch, their images in both plans."""
    raise NotImplementedError(type(part).__name__)


@draw.register
def _driving_slider(slider: DrivingSlider, draft: Draft) -> None:
    pin, guide = slider.pin, FixedLine(f"guide {slider.pin}")
    draft.sketch.append(OnGuide(pin, guide, Scaled(f"s {pin}", "kL")))
    a, a_primed = draft.image(pin), draft.image(pin, primed=True)
    speed, acceleration = Scaled(f"v_{pin}", "kv"), Scaled(f"a_{pin}", "ka")
    draft.velocity.append(Given(a, VELOCITY_POLE, speed, guide.along))
    draft.acceleration.append(Given(a_primed, ACCELERATION_POLE, acceleration, guide.along))
    absolute(draft, pin)


@draw.register
def _crank(crank: Crank, draft: Draft) -> None:
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


@draw.register
def _dyad(group: Dyad, draft: Draft) -> None:
    node, (p, q), (link_p, link_q) = group.node, group.pins, group.links
    radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
    draft.sketch.append(TwoArcs(node, (p, q), radii, _side(group)))
    images_at(draft, node, rotations(draft, node, {p: link_p, q: link_q}))


@draw.register
def _plate(group: Plate, draft: Draft) -> None:
    node, (p, q) = group.node, group.base
    if group.line_ratio is not None:
        draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
    else:
        radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
        draft.sketch.append(TwoArcs(node, (p, q), radii, _side(group)))
    note_similar_images(draft, node, (p, q))
    if group.is_ever_flat or draft.plate_by_similarity:
        rigid_images(draft, node, (p, q))
        for pin in (p, q):
            if not draft.mechanism.is_ground(pin):
                relative(draft, (pin, node))
    else:
        images_at(draft, node, rotations(draft, node, {p: group.link, q: group.link}))


@draw.register
def _point_on_line(group: PointOnLine, draft: Draft) -> None:
    node, (p, q), ratio = group.node, group.base, f"ratio {group.node}"
    draft.sketch.append(Divide(node, (p, q), ratio))
    velocity, acceleration = (
        Divide(draft.image(node, primed=primed), draft.images_of((p, q), primed=primed), ratio)
        for primed in (False, True)
    )
    draft.add_images(velocity, acceleration)
    absolute(draft, node)


@draw.register
def _slider(group: Slider, draft: Draft) -> None:
    node, pin, guide = group.node, group.pin, group.guide
    radius = Scaled(pair(pin, node), "kL")
    draft.sketch.append(ArcAndLine(node, pin, radius, guide_line(node, guide), _side(group)))
    images_at(draft, node, rotations(draft, node, {pin: group.link}) + slides(draft, node, (guide,)))


@draw.register
def _cross_slider(group: CrossSlider, draft: Draft) -> None:
    node, (first, second) = group.node, group.guides
    draft.sketch.append(TwoLines(node, guide_line(node, first), guide_line(node, second)))
    images_at(draft, node, slides(draft, node, group.guides))


@draw.register
def _yoke(group: Yoke, draft: Draft) -> None:
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


@draw.register
def _slotted_link(group: SlottedLink, draft: Draft) -> None:
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


@draw.register
def _triad(group: Triad, draft: Draft) -> None:
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


@draw.register
def _slot_point(group: SlotPoint, draft: Draft) -> None:
    node = group.node
    slotted = slotted_links(draft.mechanism)[group.link]
    x, y = Scaled(f"x {node}", "kL"), Scaled(f"y {node}", "kL")
    draft.sketch.append(Local(node, slotted.pivot, slot_axis(slotted), x, y))
    rigid_images(draft, node, (slotted.pivot, slotted.node))


def _side(group: Dyad | Plate | Slider | SlottedLink) -> Side:
    """Return the group's side or, if it may differ between variants, the name of its parameter."""
    return group.side if isinstance(group.side, int) else VariantSide(f"side {group.node}")


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
