"""Exact motion in closed form, one Assur group after another, on arrays.

Positions by Heron's formula and the half chord; velocities and accelerations by eliminating one
unknown of the rigid-body (Euler) equations of the group, v_B = v_A + i omega (B - A). This road
knows nothing of drawings: the construction of `reference.construction` is held against it.
"""

from dataclasses import dataclass

import numpy as np

from reference import geometry
from reference.errors import MechanismError
from reference.geometry import ComplexArray, FloatArray, cross, dot
from reference.mechanism import Crank, Dyad, Group, Mechanism, Plate, PointOnLine, Slider


@dataclass(frozen=True, slots=True)
class Motion:
    """Positions and their derivatives, SI, complex arrays of shape (N,) by joint; links by name.

    Attributes
    ----------
    position, velocity, acceleration : by joint; acceleration empty when not asked for
    omega, epsilon : by link, counter-clockwise positive
    transmission : |sin| of the angle on which each group's accuracy hangs, by its node: 1 is best,
        0 is singular; the relative error of velocities is about eps / transmission^2
    """

    position: dict[str, ComplexArray]
    velocity: dict[str, ComplexArray]
    acceleration: dict[str, ComplexArray]
    omega: dict[str, FloatArray]
    epsilon: dict[str, FloatArray]
    transmission: dict[str, FloatArray]


def move(mechanism: Mechanism, *, accelerations: bool = True) -> Motion:
    """Solve the mechanism for every variant at once.

    Raises MechanismError naming the group, the first variant (by its index) and by how much the
    group does not assemble, or that its velocities are not determined there.
    """
    motion = Motion({}, {}, {}, {}, {}, {})
    for joint, place in mechanism.ground_m.items():
        _put(motion, joint, place, np.zeros_like(place), np.zeros_like(place))
    _drive(motion, mechanism.crank)
    for group in mechanism.groups:
        _assemble(motion, group)
        _set_in_motion(motion, group)
        if accelerations:
            _accelerate(motion, group)
    if not accelerations:
        return Motion(motion.position, motion.velocity, {}, motion.omega, {}, motion.transmission)
    return motion


def _put(motion: Motion, joint: str, r: ComplexArray, v: ComplexArray, a: ComplexArray) -> None:
    motion.position[joint], motion.velocity[joint], motion.acceleration[joint] = r, v, a


def _drive(motion: Motion, crank: Crank) -> None:
    arm = crank.length_m * geometry.direction(crank.angle_rad)
    velocity = 1j * crank.omega * arm
    acceleration = (1j * crank.epsilon - crank.omega**2) * arm
    _put(motion, crank.pin, motion.position[crank.pivot] + arm, velocity, acceleration)
    motion.omega[crank.link] = crank.omega
    motion.epsilon[crank.link] = crank.epsilon


def _assemble(motion: Motion, group: Group) -> None:
    """The group's node, from its pins."""
    at = motion.position
    match group:
        case Dyad():
            p, q = (at[pin] for pin in group.pins)
            node = geometry.two_arcs(p, group.lengths_m[0], q, group.lengths_m[1], group.side)
            _refuse_open(group.node, node, _gap_of_triangle(p, q, group.lengths_m))
            sine = np.abs(cross(node - p, node - q)) / (np.abs(node - p) * np.abs(node - q))
        case Plate():
            p, q = (at[pin] for pin in group.base)
            node = _plate_corner(p, q, group)
            _refuse_open(group.node, node, _gap_of_triangle(p, q, group.lengths_m))
            sine = np.ones_like(group.lengths_m[0])
        case PointOnLine():
            p, q = (at[pin] for pin in group.base)
            node, sine = p + (q - p) * group.ratio, np.ones_like(group.ratio)
        case Slider():
            pin, along = at[group.pin], geometry.direction(group.guide_rad)
            node = geometry.arc_and_line(pin, group.length_m, group.guide_m, along, group.side)
            gap = np.abs(cross(along, pin - group.guide_m)) - group.length_m
            _refuse_open(group.node, node, gap)
            sine = np.abs(dot(node - pin, along)) / group.length_m
    motion.position[group.node] = node
    motion.transmission[group.node] = np.asarray(sine)


def _plate_corner(p: ComplexArray, q: ComplexArray, group: Plate) -> ComplexArray:
    """A plate's third point; exactly in line with its base where the lengths say so."""
    if group.line_ratio is not None:
        return np.asarray(p + (q - p) * group.line_ratio)
    return geometry.two_arcs(p, group.lengths_m[0], q, group.lengths_m[1], group.side)


def _gap_of_triangle(p: ComplexArray, q: ComplexArray, sides: tuple[FloatArray, FloatArray]) -> FloatArray:
    distance = np.abs(q - p)
    too_far = distance - (sides[0] + sides[1])
    return np.asarray(np.maximum(too_far, np.abs(sides[0] - sides[1]) - distance))


def _refuse_open(node: str, place: ComplexArray, gap_m: FloatArray) -> None:
    broken = np.atleast_1d(~np.isfinite(place))
    if not broken.any():
        return
    first = int(np.argmax(broken))
    gap = float(np.atleast_1d(np.broadcast_to(gap_m, place.shape))[first])
    raise MechanismError(
        "does_not_assemble",
        f"the group of {node} does not assemble: its links miss each other by {max(gap, 0.0):.6g} m"
        f" ({int(broken.sum())} of {broken.size} variant(s), the first at index {first});"
        " check the lengths, the crank angle and the side",
    )


def _set_in_motion(motion: Motion, group: Group) -> None:
    """The velocity of the group's node and the angular velocities of its links."""
    at, v, omega = motion.position, motion.velocity, motion.omega
    node = at[group.node]
    match group:
        case Dyad(pins=(p, q), links=(link_p, link_q)):
            first, second = _two_turns(node - at[p], node - at[q], v[q] - v[p], group.node)
            omega[link_p] = first
            omega[link_q] = second
            velocity = v[p] + 1j * first * (node - at[p])
        case Slider():
            along = geometry.direction(group.guide_rad)
            turn, speed = _turn_and_slide(node - at[group.pin], along, v[group.pin], group.node)
            omega[group.link] = turn
            velocity = speed * along
        case Plate(base=(p, q)) | PointOnLine(base=(p, q)):
            velocity = geometry.similar(v[p], v[q], at[p], at[q], node)
            omega[group.link] = _turn_of(at[q] - at[p], v[q] - v[p])
    v[group.node] = velocity


def _accelerate(motion: Motion, group: Group) -> None:
    """The acceleration of the group's node and the angular accelerations of its links."""
    at, a, omega, epsilon = motion.position, motion.acceleration, motion.omega, motion.epsilon
    node = at[group.node]
    match group:
        case Dyad(pins=(p, q), links=(link_p, link_q)):
            u, w = node - at[p], node - at[q]
            known = a[q] - a[p] + omega[link_p] ** 2 * u - omega[link_q] ** 2 * w
            first, second = _two_turns(u, w, known, group.node)
            epsilon[link_p] = first
            epsilon[link_q] = second
            acceleration = a[p] + (1j * first - omega[link_p] ** 2) * u
        case Slider():
            along, u = geometry.direction(group.guide_rad), node - at[group.pin]
            known = a[group.pin] - omega[group.link] ** 2 * u
            turn, slide = _turn_and_slide(u, along, known, group.node)
            epsilon[group.link] = turn
            acceleration = slide * along
        case Plate(base=(p, q)) | PointOnLine(base=(p, q)):
            acceleration = geometry.similar(a[p], a[q], at[p], at[q], node)
            epsilon[group.link] = _turn_of(at[q] - at[p], a[q] - a[p])
    a[group.node] = acceleration


def _two_turns(
    u: ComplexArray, w: ComplexArray, known: ComplexArray, node: str
) -> tuple[FloatArray, FloatArray]:
    """X and y of i (x u - y w) = known: dotted with w, then with u."""
    area = cross(u, w)
    with np.errstate(invalid="ignore", divide="ignore"):
        x, y = dot(known, w) / area, dot(known, u) / area
    _refuse_singular(node, x + y)
    return np.asarray(x), np.asarray(y)


def _turn_and_slide(
    u: ComplexArray, along: ComplexArray, known: ComplexArray, node: str
) -> tuple[FloatArray, FloatArray]:
    """X and s of known + i x u = s along (along is a unit vector)."""
    with np.errstate(invalid="ignore", divide="ignore"):
        x = -cross(along, known) / dot(u, along)
    _refuse_singular(node, x)
    return np.asarray(x), dot(known + 1j * x * u, along)


def _turn_of(arm: ComplexArray, relative: ComplexArray) -> FloatArray:
    """The angular rate of a rigid arm from the relative velocity (or acceleration) of its ends."""
    return np.asarray(cross(arm, relative) / dot(arm, arm))


def _refuse_singular(node: str, rates: FloatArray) -> None:
    broken = np.atleast_1d(~np.isfinite(rates))
    if broken.any():
        raise MechanismError(
            "singular",
            f"the velocities of the group of {node} are not determined: its links (or rod and guide's"
            f" perpendicular) are in line ({int(broken.sum())} of {broken.size} variant(s), the first at"
            f" index {int(np.argmax(broken))}); choose another crank angle",
        )
