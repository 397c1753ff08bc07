"""A mechanism solved group by group, on numbers of any kind (`reference.numbers`).

The closed forms of `reference.kinematics.assur` are applied to the mechanism's joints and links. Nothing is
checked here: what does not assemble is nan, and `reference.kinematics.motion` says why.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from reference.kinematics import assur, triad
from reference.mechanism import (
    Crank,
    CrossSlider,
    Driver,
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
)
from reference.numbers import Complex, Number, cross, dot, larger, root, where

Take = Callable[[Any], Any]
"""Selects the number to compute with from one that the mechanism holds: the array, or one variant's."""


def as_it_is(value: Any) -> Any:  # noqa: ANN401 - arrays of either kind
    """Return the value unchanged: all variants at once."""
    return value


@dataclass(slots=True)
class Joint:
    """Position (and its rounding error, if known), velocity, acceleration of a joint, SI.

    `amplification` is the factor by which a rounding error of the data may have grown up to this joint.
    """

    position: Complex
    velocity: Complex = 0j
    acceleration: Complex = 0j
    rest: Complex | None = None
    amplification: Number = 1.0


@dataclass(slots=True)
class Solution:
    """Joints and links of a mechanism in motion, and the |sin| of each group's transmission angle."""

    joints: dict[str, Joint] = field(default_factory=dict)
    omega: dict[str, Number] = field(default_factory=dict)
    epsilon: dict[str, Number] = field(default_factory=dict)
    transmission: dict[str, Number] = field(default_factory=dict)
    slots: dict[str, tuple[str, Complex]] = field(default_factory=dict)
    """By a slotted link's node: its pivot, and the direction of its guide."""
    take: Take = as_it_is
    accelerations: bool = True
    anew: bool = False
    """True if shapes of links are computed from their data, not taken as rounded."""

    def add(self, name: str, node: Joint, sine: Number, amplification: Number) -> None:
        """Add a group's node; rounding errors grow by 1 / sine^2 and by `amplification`."""
        node.amplification = amplification / (sine * sine)
        self.joints[name], self.transmission[name] = node, abs(sine)


@dataclass(slots=True)
class Rail:
    """A guide in motion: one of its points, its direction, and the rates of the link that carries it.

    Most guides are fixed: what does not turn moves as its point does, and nothing is calculated.
    """

    joint: Joint
    along: Complex
    amplification: Number = 1.0
    omega: Number = 0.0
    epsilon: Number = 0.0
    turns: bool = False

    def velocity(self, place: Complex) -> Complex:
        """Return the velocity of the link's point at a position."""
        if not self.turns:
            return self.joint.velocity
        return self.joint.velocity + 1j * self.omega * (place - self.joint.position)

    def acceleration(self, place: Complex) -> Complex:
        """Return the acceleration of the link's point at a position."""
        if not self.turns:
            return self.joint.acceleration
        swing = assur.turned(place - self.joint.position, self.omega, self.epsilon)
        return self.joint.acceleration + swing


def solve(
    mechanism: Mechanism, take: Take = as_it_is, *, accelerations: bool = True, anew: bool = False
) -> Solution:
    """Solve a mechanism in the numbers that `take` gives; epsilon stays empty without accelerations.

    `anew` computes the shapes of links in those numbers, from their lengths or coordinates: the mechanism
    holds them rounded to doubles.
    """
    solution = Solution(take=take, accelerations=accelerations, anew=anew)
    for name, place in mechanism.ground_m.items():
        solution.joints[name] = Joint(take(place))
    _drive(solution, mechanism.driver)
    for group in mechanism.groups:
        _add(solution, group)
    return solution


def _drive(solution: Solution, driver: Driver) -> None:
    take = solution.take
    match driver:
        case Crank():
            omega, epsilon = take(driver.omega), take(driver.epsilon)
            axis, rest = assur.arm(take(driver.length_m), take(driver.angle_rad))
            arm = axis + rest
            foot, lost = assur.exact_sum(solution.joints[driver.pivot].position, axis)
            place, lost_too = assur.exact_sum(foot, rest)
            pin = Joint(place, 1j * omega * arm, rest=lost + lost_too)
            if solution.accelerations:
                pin.acceleration = assur.turned(arm, omega, epsilon)
                solution.epsilon[driver.link] = epsilon
            solution.omega[driver.link] = omega
        case _:
            along = assur.heading(take(driver.guide_rad))
            place = take(driver.guide_m) + along * take(driver.displacement_m)
            pin = Joint(place, along * take(driver.speed))
            if solution.accelerations:
                pin.acceleration = along * take(driver.acceleration)
    solution.joints[driver.pin] = pin


def _add(solution: Solution, group: Group) -> None:
    match group:
        case Dyad():
            _add_dyad(solution, group)
        case Slider():
            _add_slider(solution, group)
        case SlottedLink():
            _add_slotted(solution, group)
        case CrossSlider(node=node, guides=(first, second)):
            rails = (rail_of(solution, first), rail_of(solution, second))
            _add_crossing(solution, node, rails)
            for guide, rail in zip(group.guides, rails, strict=True):
                _add_coincident(solution, guide, rail, node)
        case Yoke(node=node, guide=FixedGuide() as guide):
            pin = solution.joints[group.pin]
            slot = Rail(pin, assur.heading(solution.take(group.slot_rad)), pin.amplification)
            _add_crossing(solution, node, (rail_of(solution, guide), slot))
        case Yoke():
            _add_carried_yoke(solution, group)
        case SlotPoint():
            _add_slot_point(solution, group, solution.take(group.local_m))
        case Triad():
            _add_triad(solution, group)
        case _:
            _add_point(solution, group)


def _between(p: Joint, q: Joint) -> Complex:
    """Return the vector from p to q, with the rounding errors of both."""
    d = q.position - p.position
    if q.rest is not None:
        d = d + q.rest
    return d if p.rest is None else d - p.rest


def _nearness(size2: Number, p: Joint, q: Joint) -> Number:
    """The ratio of a length (given by its square) to its distance from the origin."""
    return root(size2 / (size2 + dot(p.position, p.position) + dot(q.position, q.position)))


def _amplification(size2: Number, p: Joint, q: Joint) -> Number:
    """The amplification of rounding errors in the vector between two joints (length given by its square)."""
    return larger(p.amplification, q.amplification) / _nearness(size2, p, q)


def _add_dyad(solution: Solution, group: Dyad) -> None:
    p, q = (solution.joints[pin] for pin in group.pins)
    link_p, link_q = group.links
    take, d = solution.take, _between(p, q)
    along, across, sine = assur.rrr_place(d, *map(take, (*group.lengths_m, group.side)))
    corner = along + 1j * across
    arm = d * corner
    square = dot(d, d)
    inverse = d.conjugate() / square
    stretch = (q.velocity - p.velocity) * inverse
    omega = assur.rrr_turns(along, across, stretch)
    solution.omega[link_p], solution.omega[link_q] = omega
    node = Joint(p.position + arm, p.velocity + 1j * omega[0] * arm)
    if solution.accelerations:
        growth = (q.acceleration - p.acceleration) * inverse
        epsilon = assur.rrr_accelerations(along, across, stretch, growth, omega)
        solution.epsilon[link_p], solution.epsilon[link_q] = epsilon
        node.acceleration = p.acceleration + assur.turned(arm, omega[0], epsilon[0])
    solution.add(group.node, node, sine, _amplification(square, p, q))


def _add_slider(solution: Solution, group: Slider) -> None:
    pin, rail = solution.joints[group.pin], rail_of(solution, group.guide)
    take, along, foot = solution.take, rail.along, rail.joint.position
    height = cross(along, pin.position - foot)
    lost = 0.0 if pin.rest is None else cross(along, pin.rest)
    length = take(group.length_m)
    reach, height, sine = assur.rrp_place(height, lost, length, take(group.side))
    place = foot + along * (dot(along, pin.position - foot) + reach)
    under = rail.velocity(place)
    omega, speed = assur.rrp_velocity(reach, height, along, pin.velocity - under)
    solution.omega[group.link] = omega
    node = Joint(place, under + along * speed)
    if solution.accelerations:
        under = rail.acceleration(place)
        coriolis = 2.0 * rail.omega * speed if rail.turns else 0.0
        epsilon, slide = assur.rrp_acceleration(
            reach, height, along, pin.acceleration - under, omega, coriolis
        )
        solution.epsilon[group.link] = epsilon
        node.acceleration = under + along * (slide + 1j * coriolis)
    grown = larger(pin.amplification, rail.amplification) / _nearness(length * length, pin, rail.joint)
    solution.add(group.node, node, sine, grown)
    _add_coincident(solution, group.guide, rail, group.node)


def _add_slotted(solution: Solution, group: SlottedLink) -> None:
    pin, pivot = solution.joints[group.pin], solution.joints[group.pivot]
    d, offset = _between(pivot, pin), solution.take(group.offset_m)
    reach, along, sine = assur.rpr_place(d, offset, solution.take(group.side))
    relative = pin.velocity - pivot.velocity
    omega, speed = assur.rpr_velocity(reach, offset, along, relative)
    solution.omega[group.link] = omega
    node = Joint(pin.position, pivot.velocity + 1j * omega * d, rest=pin.rest)
    if solution.accelerations:
        relative = pin.acceleration - pivot.acceleration
        epsilon = assur.rpr_acceleration(reach, offset, along, relative, (omega, speed))
        solution.epsilon[group.link] = epsilon
        node.acceleration = pivot.acceleration + assur.turned(d, omega, epsilon)
    solution.add(group.node, node, sine, _amplification(dot(d, d), pin, pivot))
    solution.slots[group.node] = (group.pivot, along)
    if group.foot is not None:
        foot = SlotPoint(group.foot, group.node, group.link, np.asarray(0j))
        _add_slot_point(solution, foot, 1j * offset)


def _add_slot_point(solution: Solution, group: SlotPoint, local: Complex) -> None:
    pivot_name, along = solution.slots[group.slotted]
    pivot, arm, omega = solution.joints[pivot_name], along * local, solution.omega[group.link]
    node = Joint(pivot.position + arm, pivot.velocity + 1j * omega * arm)
    if group.link in solution.epsilon:
        node.acceleration = pivot.acceleration + assur.turned(arm, omega, solution.epsilon[group.link])
    node.amplification = solution.joints[group.slotted].amplification
    solution.joints[group.node] = node


def _add_point(solution: Solution, group: Plate | PointOnLine) -> None:
    """Add a rigid link's point: the same combination of its base for position, velocity, acceleration."""
    p, q = (solution.joints[joint] for joint in group.base)
    shape = solution.take(group.shape if isinstance(group, Plate) else group.ratio)
    d, growth = _between(p, q), 1.0 + abs(shape)
    if isinstance(group, Plate) and group.local_m is None:
        growth = growth * assur.plate_growth(shape)
    if solution.anew:
        shape = _shape_anew(solution.take, group, shape, d)
    solution.joints[group.node] = Joint(
        p.position + shape * d,
        p.velocity + shape * (q.velocity - p.velocity),
        p.acceleration + shape * (q.acceleration - p.acceleration),
        amplification=larger(p.amplification, q.amplification) * growth,
    )


def _shape_anew(take: Take, group: Plate | PointOnLine, shape: Complex, d: Complex) -> Complex:
    """Return the shape of a link's point over its base `d`, from the data in the numbers of `d`."""
    if group.local_m is not None:
        return take(group.local_m) / abs(d)
    if isinstance(group, PointOnLine):
        return shape
    first, second, side = map(take, (*group.lengths_m, group.side))
    along, across, _ = assur.rrr_place(d, first, second, side)
    in_line = first / abs(d)
    return where(shape.imag == 0.0, where(shape.real < 0.0, -in_line, in_line), along + 1j * across)


def loops_of(solution: Solution, group: Triad) -> triad.Loops:
    """Return the loops of a triad, from the joints before it."""
    a, b, c = (solution.joints[pin] for pin in group.pins)
    side, far, near = map(solution.take, group.sides_m)
    shape = solution.take(group.shape)
    if solution.anew:
        along, across, _ = assur.rrr_place(side + 0j, near, far, solution.take(group.turned))
        shape = along + 1j * across
    first, second, third = map(solution.take, group.legs_m)
    return _between(b, a), _between(c, a), first, second, third, side, side * shape


def _doubles(value: Any) -> Any:  # noqa: ANN401 - numbers of any kind
    """Return an array of doubles."""
    array = value if isinstance(value, np.ndarray) else np.array([complex(value)])
    return array.astype(np.complex128 if np.iscomplexobj(array) else np.float64)


def directions_of(before: Solution, group: Triad) -> Any:  # noqa: ANN401 - an array of shape (M,)
    """Return the directions of D E (rad) in all M assemblies of a triad of one variant."""
    _, u = triad.assemblies(tuple(map(_doubles, loops_of(before, group))))
    return np.angle(u[np.isfinite(u)])


def _assembled(solution: Solution, group: Triad, loops: triad.Loops) -> tuple[Complex, Complex]:
    """Return D - A and the unit vector along D E, in the numbers of the solution."""
    direction = _doubles(solution.take(group.direction_rad)).real
    leg = None if group.leg_rad is None else _doubles(solution.take(group.leg_rad)).real
    near = triad.chosen(tuple(map(_doubles, loops)), direction, leg, group.sign)
    zero = loops[0] * 0.0
    z, u = (zero + (each if isinstance(zero, np.ndarray) else complex(each[0])) for each in near)
    return triad.polished(loops, z, u) if solution.anew else (z, u)


def _add_triad(solution: Solution, group: Triad) -> None:
    """Add the corners of a triad's ternary link and its Assur point: all are D plus an arm on that link."""
    pins, loops = [solution.joints[pin] for pin in group.pins], loops_of(solution, group)
    a, lengths, (z, u) = pins[0], loops[2:5], _assembled(solution, group, loops)
    legs = (z, *triad.parts(loops, z, u))
    arms = (0.0 * z, loops[5] * u, loops[6] * u, z * (cross(loops[5] * u, legs[1]) / cross(z, legs[1])))
    each = list(zip(pins, legs, lengths, arms[:3], strict=True))
    along = tuple(dot(leg, pin.velocity - a.velocity) / length for pin, leg, length, _ in each[1:])
    turn, omega = triad.turns(loops, z, u, along)
    joints = [Joint(a.position + z + arm, a.velocity + 1j * (turn * z + omega * arm)) for arm in arms]
    relative = [joint.velocity - pin.velocity for joint, pin in zip(joints[:3], pins, strict=True)]
    rates = [cross(leg, v) / dot(leg, leg) for leg, v in zip(legs, relative, strict=True)]
    solution.omega |= dict(zip(group.links, (*rates, omega), strict=True))
    if solution.accelerations:
        carried = a.acceleration - turn * turn * z
        along = tuple(
            (dot(leg, pin.acceleration - carried + omega * omega * arm) - dot(v, v)) / length
            for (pin, leg, length, arm), v in zip(each[1:], relative[1:], strict=True)
        )
        growth, epsilon = triad.turns(loops, z, u, along)
        for joint, arm in zip(joints, arms, strict=True):
            joint.acceleration = carried + 1j * growth * z + assur.turned(arm, omega, epsilon)
        relative = [
            joint.acceleration - pin.acceleration for joint, pin in zip(joints[:3], pins, strict=True)
        ]
        rates = [cross(leg, v) / dot(leg, leg) for leg, v in zip(legs, relative, strict=True)]
        solution.epsilon |= dict(zip(group.links, (*rates, epsilon), strict=True))
    square, sine = dot(z, z), triad.sine(loops, z, u)
    amplification = larger(*(_amplification(square, a, pin) for pin in pins[1:]))
    for name, joint in zip(group.corners, joints[:3], strict=True):
        solution.add(group.node, joint, sine, amplification)
        solution.joints[name] = joint
    crossing = cross(z, legs[1]) / (lengths[0] * lengths[1])
    solution.add(group.assur_point, joints[3], crossing, joints[0].amplification)


def rail_of(solution: Solution, guide: Guide) -> Rail:
    """Return a guide in motion; raises KeyError if its link is not placed yet."""
    if isinstance(guide, FixedGuide):
        through, angle = solution.take(guide.through_m), solution.take(guide.angle_rad)
        return Rail(Joint(through), assur.heading(angle))
    g, h = (solution.joints[joint] for joint in guide.base)
    d = _between(g, h)
    amplification = _amplification(dot(d, d), g, h)
    epsilon = solution.epsilon.get(guide.link, 0.0)
    return Rail(g, d / abs(d), amplification, solution.omega[guide.link], epsilon, turns=True)


def _add_coincident(solution: Solution, guide: Guide, rail: Rail, node: str) -> None:
    """Add the point of a moving guide's link that lies under a slider."""
    if isinstance(guide, FixedGuide):
        return
    over = solution.joints[node]
    solution.joints[guide.coincident] = Joint(
        over.position,
        rail.velocity(over.position),
        rail.acceleration(over.position),
        amplification=over.amplification,
    )


def _add_carried_yoke(solution: Solution, group: Yoke) -> None:
    """Add the point under the pin of a yoke that slides on a moving guide, its slot across the guide.

    All turn alike: the pin's motion about the guide's link is resolved along the guide and along the slot.
    """
    pin, rail = solution.joints[group.pin], rail_of(solution, group.guide)
    place, under = pin.position, rail.velocity(pin.position)
    slide, along = dot(rail.along, pin.velocity - under), rail.along
    node = Joint(place, under + along * slide, rest=pin.rest)
    if solution.accelerations:
        carried = rail.acceleration(place) + 2j * rail.omega * slide * along
        in_slot = pin.acceleration + 2j * rail.omega * (node.velocity - pin.velocity)
        node.acceleration = carried + along * dot(along, in_slot - carried)
    solution.add(group.node, node, 1.0, larger(pin.amplification, rail.amplification))
    _add_coincident(solution, group.guide, rail, group.node)


def _add_crossing(solution: Solution, node: str, rails: tuple[Rail, Rail]) -> None:
    first, second = rails
    across = second.joint.position - first.joint.position
    reach, sine = assur.cross_place(across, first.along, second.along)
    place = first.joint.position + first.along * reach
    under = (first.velocity(place), second.velocity(place))
    slides = assur.cross_slides(under[1] - under[0], first.along, second.along, sine)
    joint = Joint(place, under[0] + first.along * slides[0])
    if solution.accelerations:
        carried = tuple(
            rail.acceleration(place) + 2j * rail.omega * slide * rail.along
            for rail, slide in zip(rails, slides, strict=True)
        )
        slide, _ = assur.cross_slides(carried[1] - carried[0], first.along, second.along, sine)
        joint.acceleration = carried[0] + first.along * slide
    solution.add(node, joint, sine, larger(first.amplification, second.amplification))


# Some variants of a mechanism, in other kinds of numbers -------------------------------------------


def each_number_once(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
    """Return all variants at once; a number that they share (an array of stride 0) only once."""
    return values[:1] if type(values) is not int and values.strides == (0,) else values


def one_variant(index: int, number: Callable[[Any], Any] | None = None, *, among: int | None = None) -> Take:
    """Return a function that takes one variant's number from an array over variants or of one entry.

    Arguments: `number` converts a float or complex to another kind of number; `among`, if given, is the
    number of variants: an array of another size raises ValueError.
    """

    def take(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
        if type(values) is int:
            return values
        if values.size == 1:
            one = values.item()
        elif among in {None, values.size}:
            one = values.item(index)
        else:
            raise ValueError(f"data of {values.size} variants in a mechanism whose driver has {among}")
        return one if number is None else number(one)

    return take


def some_variants(rows: NDArray[np.intp]) -> Take:
    """Return a function that takes some variants from arrays over variants, in the widest floats."""

    def take(values: Any) -> Any:  # noqa: ANN401 - an array, or a side that all variants share
        if type(values) is int:
            return values
        chosen = values if values.size == 1 else values[rows]
        return chosen.astype(np.clongdouble if np.iscomplexobj(chosen) else np.longdouble)

    return take
