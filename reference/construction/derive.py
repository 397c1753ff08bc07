"""Derive the construction of a mechanism's plans from the mechanism.

The driving link and each Assur group write down their steps in a `Draft`; it becomes a `Construction`.
"""

from collections.abc import Hashable, Mapping

from reference.construction.draft import ACCELERATION_POLE, VELOCITY_POLE, Draft
from reference.construction.forces import Accelerations, with_force_plans
from reference.construction.graph import AngularRate, Construction
from reference.construction.groups import draw
from reference.construction.steps import Pivot, Pole, Similar, Step
from reference.mechanism import Mechanism, Plate, Triad, form_of

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
    for part in (mechanism.driver, *mechanism.groups):
        draw(part, draft)
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
