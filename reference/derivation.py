"""The construction of a mechanism's plans, derived from the mechanism by one function.

Node names: a joint's image is its letter in lower case (``B`` -> ``b``, ``b'`` in the acceleration
plan), ground joints have the pole for their image, a normal component a_BA_n ends in ``n_BA``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from reference.construction import AngularRate, Construction, Vector
from reference.geometry import FloatArray
from reference.mechanism import Crank, Dyad, Group, Mechanism, Plate, PointOnLine, Slider
from reference.steps import (
    Along,
    ArcAndLine,
    Divide,
    Fixed,
    Given,
    Line,
    Normal,
    Pivot,
    Pole,
    Scaled,
    Similar,
    Step,
    TwoArcs,
    TwoLines,
)

VELOCITY_POLE, ACCELERATION_POLE = "o", "o'"


@dataclass(slots=True)
class _Draft:
    """The construction while it is being written down."""

    mechanism: Mechanism
    plate_by_similarity: bool
    sketch: list[Step] = field(default_factory=list)
    velocity: list[Step] = field(default_factory=list)
    acceleration: list[Step] = field(default_factory=list)
    vectors: dict[str, Vector] = field(default_factory=dict)
    rates: dict[str, AngularRate] = field(default_factory=dict)
    images: dict[str, Similar] = field(default_factory=dict)

    def image(self, joint: str, *, primed: bool = False) -> str:
        """The node of a joint in the velocity (or acceleration) plan."""
        if self.mechanism.is_ground(joint):
            return ACCELERATION_POLE if primed else VELOCITY_POLE
        return image_name(joint, primed=primed)

    def relative(self, node: str, pin: str) -> str:
        """The subscript of a vector of `node` about `pin`: B about A is BA, about the ground B."""
        return node if self.mechanism.is_ground(pin) else f"{node}{pin}"

    def vector(self, name: str, tail: str, head: str, **about: object) -> None:
        scale = "kv" if name.startswith("v") else "ka"
        self.vectors[name] = Vector(name, tail, head, scale, **about)  # type: ignore[arg-type]


def image_name(joint: str, *, primed: bool = False) -> str:
    """The lower-case image of a moving joint, primed in the acceleration plan."""
    return joint.lower() + ("'" if primed else "")


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
    draft = _Draft(mechanism, plate_by_similarity)
    draft.velocity.append(Pole(VELOCITY_POLE))
    draft.acceleration.append(Pole(ACCELERATION_POLE))
    draft.sketch.extend(Pivot(joint) for joint in mechanism.ground_m)
    _draw_crank(draft, mechanism.crank)
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
    return Construction(figures, poles, vectors, rates, images)


def _in_order(draft: _Draft) -> list[str]:
    """Names of vectors: velocities first, joint by joint, the absolute one before its parts."""
    joints = draft.mechanism.joints

    def place(name: str) -> tuple[bool, int, str, str]:
        kind, about, *part = name.split("_")
        joint = max((joint for joint in joints if about.startswith(joint)), key=len)
        other = about.removeprefix(joint)
        pin = "" if other == "" and not part else f"{joints.index(other) if other else 99:03d}"
        return kind == "a", joints.index(joint), pin, "".join(part)

    return sorted(draft.vectors, key=place)


def _draw_crank(draft: _Draft, crank: Crank) -> None:
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
        draft.vector(f"a_{pin}_n", ACCELERATION_POLE, end, link=(pivot, pin), is_normal=True)
        draft.vector(f"a_{pin}_t", end, a_primed, link=(pivot, pin))
    else:
        draft.acceleration.append(Given(a_primed, ACCELERATION_POLE, normal, inward))
    draft.vector(f"a_{pin}", ACCELERATION_POLE, a_primed)


def _draw_group(draft: _Draft, group: Group) -> None:
    match group:
        case Dyad(node=node, pins=(p, q), links=(link_p, link_q)):
            radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
            draft.sketch.append(TwoArcs(node, (p, q), radii, group.side))
            _rotations(draft, node, {p: link_p, q: link_q})
        case Plate(node=node, base=(p, q), link=link):
            if group.line_ratio is not None:
                draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
            else:
                radii = (Scaled(pair(p, node), "kL"), Scaled(pair(q, node), "kL"))
                draft.sketch.append(TwoArcs(node, (p, q), radii, group.side))
            _note_similar_images(draft, node, (p, q))
            if group.line_ratio is not None or draft.plate_by_similarity:
                _similar_images(draft, node, (p, q))
            else:
                _rotations(draft, node, {p: link, q: link})
        case PointOnLine(node=node, base=(p, q)):
            draft.sketch.append(Divide(node, (p, q), f"ratio {node}"))
            _images_on_line(draft, node, (p, q))
        case Slider(node=node, pin=pin, link=link):
            radius = Scaled(pair(pin, node), "kL")
            draft.sketch.append(ArcAndLine(node, pin, radius, f"guide {node}", group.side))
            _rotations(draft, node, {pin: link}, guide=Fixed(f"angle guide {node}"))


def pair(pin: str, node: str) -> str:
    """The name of the real length between two joints among the parameters."""
    return f"{pin}{node}"


def _rotations(draft: _Draft, node: str, links: Mapping[str, str], guide: Fixed | None = None) -> None:
    """Both images of a node that turns about each pin (and, with a guide, slides along it)."""
    lines = [Line(draft.image(pin), Along(pin, node, 1)) for pin in links]
    ends = [_normal_component(draft, node, pin) for pin in links]
    primed = [Line(end, Along(pin, node, 1)) for end, pin in zip(ends, links, strict=True)]
    if guide is not None:
        lines.append(Line(VELOCITY_POLE, guide))
        primed.append(Line(ACCELERATION_POLE, guide))
    image, image_primed = draft.image(node), draft.image(node, primed=True)
    draft.velocity.append(TwoLines(image, *lines))
    draft.acceleration.append(TwoLines(image_primed, *primed))
    for (pin, link), end in zip(links.items(), ends, strict=True):
        about = draft.relative(node, pin)
        draft.vector(f"v_{about}", draft.image(pin), image, link=(pin, node))
        draft.vector(f"a_{about}_t", end, image_primed, link=(pin, node))
        _rates(draft, link, about, (pin, node))
    _absolute(draft, node)


def _normal_component(draft: _Draft, node: str, pin: str) -> str:
    """Lay off a_(node about pin)^n from the pin's image towards the pin; its end."""
    about = draft.relative(node, pin)
    end, start = f"n_{about}", draft.image(pin, primed=True)
    length = Normal(draft.image(pin), draft.image(node), pair(pin, node))
    draft.acceleration.append(Given(end, start, length, Along(node, pin)))
    draft.vector(f"a_{about}_n", start, end, link=(pin, node), is_normal=True)
    return end


def _note_similar_images(draft: _Draft, node: str, base: tuple[str, str]) -> None:
    """The similarity steps of a plate's third point, for both plans."""
    p, q = base
    for primed in (False, True):
        ends = (draft.image(p, primed=primed), draft.image(q, primed=primed))
        image = draft.image(node, primed=primed)
        draft.images[image] = Similar(image, ends, (p, q, node))


def _similar_images(draft: _Draft, node: str, base: tuple[str, str]) -> None:
    draft.velocity.append(draft.images[draft.image(node)])
    draft.acceleration.append(draft.images[draft.image(node, primed=True)])
    for pin in base:
        if not draft.mechanism.is_ground(pin):
            draft.vector(f"v_{node}{pin}", draft.image(pin), draft.image(node), link=(pin, node))
    _absolute(draft, node)


def _images_on_line(draft: _Draft, node: str, base: tuple[str, str]) -> None:
    p, q = base
    for primed, steps in ((False, draft.velocity), (True, draft.acceleration)):
        ends = (draft.image(p, primed=primed), draft.image(q, primed=primed))
        steps.append(Divide(draft.image(node, primed=primed), ends, f"ratio {node}"))
    _absolute(draft, node)


def _absolute(draft: _Draft, node: str) -> None:
    if f"v_{node}" not in draft.vectors:
        draft.vector(f"v_{node}", VELOCITY_POLE, draft.image(node))
    draft.vector(f"a_{node}", ACCELERATION_POLE, draft.image(node, primed=True))


def _rates(draft: _Draft, link: str, about: str, joints: tuple[str, str]) -> None:
    """Omega and epsilon of a link, from the first vector found that turns it."""
    for name, vector in ((f"omega_{link}", f"v_{about}"), (f"epsilon_{link}", f"a_{about}_t")):
        draft.rates.setdefault(name, AngularRate(name, vector, joints, pair(*joints)))


def parameters_of(
    mechanism: Mechanism, k_length: FloatArray, k_velocity: FloatArray, k_acceleration: FloatArray
) -> dict[str, FloatArray]:
    """The construction's parameters: real lengths, crank data, guides and the three scales.

    Arguments: scales in real units per millimetre on paper (m/mm, (m/s)/mm, (m/s^2)/mm).
    """
    crank = mechanism.crank
    arm = crank.length_m
    known: dict[str, FloatArray] = {
        "kL": k_length,
        "kv": k_velocity,
        "ka": k_acceleration,
        "angle crank": crank.angle_rad,
        pair(crank.pivot, crank.pin): arm,
        f"v_{crank.pin}": crank.omega * arm,
        f"a_{crank.pin}_n": crank.omega**2 * arm,
        f"a_{crank.pin}_t": crank.epsilon * arm,
    }
    for joint, place in mechanism.ground_m.items():
        known[f"x {joint}"], known[f"y {joint}"] = np.asarray(place.real), np.asarray(place.imag)
    for group in mechanism.groups:
        known.update(_group_parameters(group))
    return known


def _group_parameters(group: Group) -> dict[str, FloatArray]:
    match group:
        case Dyad(node=node, pins=pins, lengths_m=lengths) | Plate(node=node, base=pins, lengths_m=lengths):
            known = {pair(pin, node): length for pin, length in zip(pins, lengths, strict=True)}
            if isinstance(group, Plate) and group.line_ratio is not None:
                known[f"ratio {node}"] = group.line_ratio
            return known
        case PointOnLine(node=node, ratio=ratio):
            return {f"ratio {node}": ratio}
        case Slider(node=node):
            return {
                pair(group.pin, node): group.length_m,
                f"x guide {node}": np.asarray(group.guide_m.real),
                f"y guide {node}": np.asarray(group.guide_m.imag),
                f"angle guide {node}": group.guide_rad,
            }
