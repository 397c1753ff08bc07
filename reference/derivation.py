"""The construction of a mechanism's plans, derived from the mechanism by one function.

Node names: a joint's image is its letter in lower case (``B`` -> ``b``, ``b'`` in the acceleration
plan), ground joints have the pole for their image, a normal component a_BA_n ends in ``n_BA``, a
Coriolis component a_B3B_c in ``k_B3B``.
"""

from collections.abc import Mapping

import numpy as np

from reference.construction import AngularRate, Construction
from reference.draft import (
    ACCELERATION_POLE,
    VELOCITY_POLE,
    Draft,
    absolute,
    guide_line,
    images_at,
    images_on_line,
    in_slot,
    normal_component,
    note_similar_images,
    rates_of,
    rigid_images,
    rotations,
    similar_images,
    slides,
    sliding,
    turning,
)
from reference.elements import Along, Fixed, FixedLine, Line, Normal, Scaled
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivenSlider,
    Driver,
    Dyad,
    Group,
    Mechanism,
    Plate,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
    form_of,
    moving_guides,
)
from reference.parameters import pair
from reference.steps import (
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


def construction_of(
    mechanism: Mechanism, *, accelerations: bool = True, plate_by_similarity: bool = False
) -> Construction:
    """Write down how the mechanism and its plans are drawn, step by step.

    Arguments
    ---------
    accelerations : without it, only the mechanism and the velocity plan
    plate_by_similarity : images of plate points by similar triangles instead of perpendiculars
        (collinear plates always are: their perpendiculars coincide)
    """
    form = (_form_of(mechanism), accelerations, plate_by_similarity)
    if form not in _written:
        if len(_written) >= KEPT:
            _written.clear()
        _written[form] = _write_down(mechanism, accelerations, plate_by_similarity)
    return _written[form]


KEPT = 256
"""Constructions that are kept: it is the same for all variants, and for the same mechanism again."""
_written: dict[tuple[object, ...], Construction] = {}


def _form_of(mechanism: Mechanism) -> tuple[object, ...]:
    """All that the construction depends on: names, kinds, sides, and which points are in line."""
    in_line = tuple(
        (group.is_ever_flat, group.line_ratio is None)
        for group in mechanism.groups
        if isinstance(group, Plate)
    )
    sides = tuple(
        side.tobytes()
        for group in mechanism.groups
        if isinstance(side := getattr(group, "side", 1), np.ndarray)
    )
    return (form_of(mechanism), in_line, sides)


def _write_down(mechanism: Mechanism, accelerations: bool, plate_by_similarity: bool) -> Construction:
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
    return Construction(figures, poles, vectors, rates, images, _centres(draft, rates))


def _centres(draft: Draft, rates: Mapping[str, AngularRate]) -> dict[str, Similar]:
    """I: triangle I A B similar to o a b; J: triangle J A B similar to o' a' b' (Mehmke)."""
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
    """Names of vectors: velocities first, joint by joint, the absolute one before its parts."""
    joints = draft.mechanism.joints

    def place(name: str) -> tuple[bool, int, str, str]:
        kind, about, *part = name.split("_")
        joint = max((joint for joint in joints if about.startswith(joint)), key=len)
        other = about.removeprefix(joint)
        pin = "" if other == "" and not part else f"{joints.index(other) if other else 99:03d}"
        return kind == "a", joints.index(joint), pin, "".join(part)

    return sorted(draft.vectors, key=place)


def _draw_driver(draft: Draft, driver: Driver) -> None:
    match driver:
        case Crank():
            _draw_crank(draft, driver)
        case DrivenSlider(pin=pin):
            guide = FixedLine(f"guide {pin}")
            draft.sketch.append(OnGuide(pin, guide, Scaled(f"s {pin}", "kL")))
            a, a_primed = draft.image(pin), draft.image(pin, primed=True)
            draft.velocity.append(Given(a, VELOCITY_POLE, Scaled(f"v_{pin}", "kv"), guide.along))
            draft.acceleration.append(
                Given(a_primed, ACCELERATION_POLE, Scaled(f"a_{pin}", "ka"), guide.along)
            )
            absolute(draft, pin)


def _draw_crank(draft: Draft, crank: Crank) -> None:
    pivot, pin = crank.pivot, crank.pin
    length = f"{pivot}{pin}"
    draft.sketch.append(Given(pin, pivot, Scaled(length, "kL"), Fixed("angle crank")))
    a, a_primed = draft.image(pin), draft.image(pin, primed=True)
    across = Along(pivot, pin, 1)
    draft.velocity.append(Given(a, VELOCITY_POLE, Scaled(f"v_{pin}", "kv"), across))
    draft.vector(f"v_{pin}", VELOCITY_POLE, a, link=(pivot, pin))
    inward = Along(pin, pivot)
    normal = Scaled(f"a_{pin}_n", "ka")
    if crank.accelerated:
        end = f"n_{pin}"
        draft.acceleration.append(Given(end, ACCELERATION_POLE, normal, inward))
        draft.acceleration.append(Given(a_primed, end, Scaled(f"a_{pin}_t", "ka"), across))
        draft.vector(f"a_{pin}_n", ACCELERATION_POLE, end, link=(pivot, pin), part="n")
        draft.vector(f"a_{pin}_t", end, a_primed, link=(pivot, pin), part="t")
    else:
        draft.acceleration.append(Given(a_primed, ACCELERATION_POLE, normal, inward))
    draft.vector(f"a_{pin}", ACCELERATION_POLE, a_primed)


def _draw_group(draft: Draft, group: Group) -> None:
    match group:
        case Dyad(node=node, pins=(p, q), links=(link_p, link_q)):
            radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
            draft.sketch.append(TwoArcs(node, (p, q), radii, group.side))
            images_at(draft, node, rotations(draft, node, {p: link_p, q: link_q}))
        case Plate(node=node, base=(p, q), link=link):
            _draw_plate(draft, group)
            note_similar_images(draft, node, (p, q))
            if group.is_ever_flat or draft.plate_by_similarity:
                similar_images(draft, node, (p, q))
            else:
                images_at(draft, node, rotations(draft, node, {p: link, q: link}))
        case PointOnLine(node=node, base=(p, q)):
            draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
            images_on_line(draft, node, (p, q))
        case Slider(node=node, pin=pin, link=link, guide=guide):
            radius = Scaled(pair(pin, node), "kL")
            draft.sketch.append(ArcAndLine(node, pin, radius, guide_line(node, guide), group.side))
            turns = rotations(draft, node, {pin: link})
            images_at(draft, node, turns + slides(draft, node, (guide,)))
        case CrossSlider(node=node, guides=guides):
            draft.sketch.append(TwoLines(node, *(guide_line(node, guide) for guide in guides)))
            images_at(draft, node, slides(draft, node, guides))
        case Yoke(node=node, pin=pin, guide=guide):
            slot = Fixed(f"angle slot {node}")
            draft.sketch.append(TwoLines(node, Line(pin, slot), guide_line(node, guide)))
            images_at(draft, node, [in_slot(draft, node, pin, slot), *slides(draft, node, (guide,))])
        case SlottedLink():
            _draw_slotted_link(draft, group)
        case SlotPoint(node=node):
            _draw_slot_point(draft, group)


def _draw_plate(draft: Draft, group: Plate) -> None:
    node, (p, q) = group.node, group.base
    if group.line_ratio is not None:
        draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
        return
    radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
    draft.sketch.append(TwoArcs(node, (p, q), radii, group.side))


def _slot_axis(group: SlottedLink) -> Along:
    """The direction of a slotted link's guide on the sketch."""
    behind = bool(np.ravel(group.side)[0] < 0)
    return Along(group.foot or group.pivot, group.pin, 2 if behind else 0)


def _draw_slotted_link(draft: Draft, group: SlottedLink) -> None:
    node, pin, pivot = group.node, group.pin, group.pivot
    if group.foot is not None:
        offset = Scaled(f"offset {node}", "kL")
        draft.sketch.append(Tangent(group.foot, pivot, offset, pin, group.side))
    draft.sketch.append(Coincide(node, pin))
    length = Normal(draft.image(pivot), draft.image(node), pair(pivot, node), measured=(pivot, node))
    end = normal_component(draft, node, pivot, length)
    turn = (draft.image(pivot), draft.image(node))
    lines = (
        turning(draft, (pivot, node), end, Along(pivot, node, 1)),
        sliding(draft, (pin, node), _slot_axis(group), turn, (group.link, pivot, node)),
    )
    images_at(draft, node, lines)
    rates_of(draft, group.link, draft.relative(node, pivot), (pivot, node))
    if group.foot is not None and _is_used(draft.mechanism, group.foot):
        rigid_images(draft, group.foot, (pivot, node))


def _is_used(mechanism: Mechanism, joint: str) -> bool:
    """Whether another group stands on a joint."""
    several = [getattr(group, key, ()) for group in mechanism.groups for key in ("pins", "base")]
    single = [getattr(group, key, "") for group in mechanism.groups for key in ("pin", "pivot")]
    guides = [guide.base for group in mechanism.groups for guide in moving_guides(group)]
    return any(joint in joints for joints in (*several, single, *guides))


def _draw_slot_point(draft: Draft, group: SlotPoint) -> None:
    node = group.node
    slotted = next(
        one for one in draft.mechanism.groups if isinstance(one, SlottedLink) and one.node == group.slotted
    )
    x, y = Scaled(f"x {node}", "kL"), Scaled(f"y {node}", "kL")
    draft.sketch.append(Local(node, slotted.pivot, _slot_axis(slotted), x, y))
    rigid_images(draft, node, (slotted.pivot, slotted.node))
