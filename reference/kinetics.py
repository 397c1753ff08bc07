"""Forces of a mechanism in motion: its kinetostatics in closed form, from the last group to the driving link.

Every Assur group is statically determinate: with the inertia forces, weights and loads of its links and the
reactions of later groups known, its own reactions follow from moments about its joints and from the forces
along its guides, two linear equations at a time. A slider turns with its guide, so that its couple goes into
the guide's moment. Nothing is iterated, and all variants are solved on arrays; see docs/solver.md.

Forces are complex (x + i y, N), couples and moments counter-clockwise positive (N m). The predicted error is
a running bound: of the motion, of the arms, and of each pair of equations. Variants that have lost digits
are solved again with more, as motion is.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import reduce
from typing import Any, Literal

import numpy as np

from reference.geometry import ComplexArray, FloatArray
from reference.kinematics import assur
from reference.kinematics.motion import DIGITS, EPSILON, EXTENDED_ENOUGH, LOSSY, SAFETY, Motion, refined
from reference.kinematics.solving import Solution, Take, as_it_is
from reference.mechanism import (
    GROUND,
    Crank,
    CrossSlider,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Group,
    Guide,
    Mechanism,
    MovingGuide,
    Slider,
    SlottedLink,
    Yoke,
    carriers,
    named_links,
    short_names,
    sliders_of,
    with_arrays,
)
from reference.numbers import Complex, Number, cross, dot, larger, where


@dataclass(frozen=True, slots=True)
class Given:
    """An inertia force with its couple, a weight, or a load: on `link` at `point`."""

    kind: Literal["inertia", "weight", "load"]
    name: str
    """Its vector's: ``F_i3``, ``G_3``, ``F_D``."""
    link: str
    point: str
    force: ComplexArray
    couple: FloatArray


@dataclass(frozen=True, slots=True)
class Reaction:
    """The force of link `by` on link `on` at a joint.

    Attributes
    ----------
    moment : of a guide, about the joint; zero at a hinge
    along : the guide's direction, to which the force is perpendicular; None at a hinge
    """

    joint: str
    on: str
    by: str
    force: ComplexArray
    moment: FloatArray
    along: ComplexArray | None = None

    @property
    def lever_m(self) -> FloatArray:
        """The distance of a guide's force from the joint, along the guide; not finite without a force."""
        with np.errstate(all="ignore"):
            return np.asarray(self.moment / dot(1j * np.asarray(self.along), self.force))


@dataclass(frozen=True, slots=True)
class Balancing:
    """The moment on the driving crank or, where a slider or a cylinder drives, the force on it; else zero."""

    on: str
    by: str
    moment: FloatArray
    force: ComplexArray
    is_force: bool


@dataclass(frozen=True, slots=True)
class Forces:
    """All forces of a mechanism, arrays of shape (N,).

    Attributes
    ----------
    given : inertia forces, weights, loads
    hinges : by joint; a further hinge at a joint by joint and link, ``B_4``
    guides : by the slider's short name
    power_residual : the power of all given forces and of the balancing one, relative to the sum of the
        products of forces and speeds; zero apart from rounding
    predicted_error : of forces, relative to the largest one; of moments, relative to the largest force
        times the farthest joint's distance from the origin
    """

    given: tuple[Given, ...]
    hinges: Mapping[str, Reaction]
    guides: Mapping[str, Reaction]
    balancing: Balancing
    power_residual: FloatArray
    predicted_error: FloatArray


def forces_of(mechanism: Mechanism, motion: Motion) -> Forces:
    """Return the forces of every variant of a mechanism whose motion, with accelerations, is solved."""
    mechanism = _directed(mechanism, motion)
    count = motion.predicted_error.shape
    moving = _Moving(
        motion.position,
        motion.velocity,
        motion.acceleration,
        motion.omega,
        motion.epsilon,
        as_it_is,
        np.maximum(motion.predicted_error, SAFETY * EPSILON),
    )
    with np.errstate(all="ignore"):
        solved = _Statics(mechanism, moving).solve()
        forces: Forces = with_arrays(solved, lambda values: np.array(np.broadcast_to(values, count)))
        if forces.predicted_error.max() > LOSSY:
            _refine(forces, mechanism, motion)
    return forces


def _directed(mechanism: Mechanism, motion: Motion) -> Mechanism:
    """Return the mechanism with the directions of loads that follow a slider's motion.

    A slider at rest is about to move as it accelerates; one that stays at rest has no such load.
    """
    if not any(load.slider for load in mechanism.loads):
        return mechanism
    guides, loads = sliders_of(mechanism), []
    for load in mechanism.loads:
        guide = guides.get(load.link)
        if load.slider is not None and load.force is not None and isinstance(guide, FixedGuide):
            along = np.asarray(assur.heading(guide.angle_rad))
            speed, growth = (
                _sense(dot(along, rates[load.slider]), rates, motion.predicted_error)
                for rates in (motion.velocity, motion.acceleration)
            )
            sense = np.where(speed == 0.0, growth, speed)
            load = replace(load, force=np.asarray(load.force.real * sense * along), slider=None)  # noqa: PLW2901
        loads.append(load)
    return replace(mechanism, loads=tuple(loads))


def _sense(rate: FloatArray, rates: Mapping[str, ComplexArray], error: FloatArray) -> FloatArray:
    """Return the sign of a velocity or an acceleration; zero where it is no larger than its error."""
    largest = reduce(np.maximum, map(np.abs, rates.values()))
    return np.where(np.abs(rate) <= error * largest, 0.0, np.sign(rate))


# Again with more digits ----------------------------------------------------------------------------


def _refine(forces: Forces, mechanism: Mechanism, motion: Motion) -> None:
    """Replace the forces of variants that have lost digits, in place, from a motion in more digits."""
    from mpmath import mp  # noqa: PLC0415 - seldom needed, and slow to import

    predicted = forces.predicted_error
    sine = reduce(np.minimum, motion.transmission.values(), np.ones(predicted.shape))
    # Of a motion in more digits, the error in doubles is not known any more.
    least = np.where(motion.recomputed & (predicted > LOSSY), 2.0 * EXTENDED_ENOUGH, 0.0)
    np.maximum(predicted, least, out=predicted)
    _, solutions = refined(mechanism, predicted, sine, accelerations=True)
    kept = predicted.copy()
    for solution, rows in solutions:
        with mp.workdps(DIGITS):
            anew = _Statics(mechanism, _moving(solution)).solve()
            for array, number in zip(_numbers(forces), _numbers(anew), strict=True):
                exact = number if isinstance(number, np.ndarray) else complex(number)
                array[rows] = exact if np.iscomplexobj(array) else np.real(exact)
    predicted[:] = kept


def _numbers(part: Any) -> Iterator[Any]:  # noqa: ANN401 - forces, or a part of them
    """Yield all numbers of forces, of any kind, in the order of their fields."""
    if isinstance(part, Mapping):
        part = tuple(part.values())
    if isinstance(part, tuple):
        for one in part:
            yield from _numbers(one)
    elif is_dataclass(part):
        for each in fields(part):
            yield from _numbers(getattr(part, each.name))
    elif not isinstance(part, str | bool | None):
        yield part


# In numbers of any kind ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Moving:
    """A motion in numbers of any kind, and the relative error of its rates and places."""

    at: Mapping[str, Complex]
    velocity: Mapping[str, Complex]
    acceleration: Mapping[str, Complex]
    omega: Mapping[str, Number]
    epsilon: Mapping[str, Number]
    take: Take
    error: Number


def _moving(solution: Solution) -> _Moving:
    joints = solution.joints.items()
    at, velocity, acceleration = (
        {name: getattr(joint, what) for name, joint in joints}
        for what in ("position", "velocity", "acceleration")
    )
    return _Moving(at, velocity, acceleration, solution.omega, solution.epsilon, solution.take, EPSILON)


@dataclass(frozen=True, slots=True)
class _Sum:
    """The resultant of a link's forces, their moment about a point, and the errors of both."""

    force: Complex
    moment: Number
    slack: Number
    moment_slack: Number

    def __add__(self, other: "_Sum") -> "_Sum":
        return _Sum(*(getattr(self, each.name) + getattr(other, each.name) for each in fields(_Sum)))


Vector = tuple[Complex, Number]
"""An arm or a direction, and its error."""


def _from_moments(u: Vector, m: Vector, v: Vector, n: Vector) -> tuple[Complex, Number]:
    """Return the force R with u x R = m and v x R = n, and its error.

    With v = -i g, v x R is the part of R along g.
    """
    area = cross(u[0], v[0])
    force = (v[0] * m[0] - u[0] * n[0]) / area
    lost = abs(v[0]) * m[1] + abs(u[0]) * n[1] + abs(m[0]) * v[1] + abs(n[0]) * u[1]
    return force, (lost + abs(force) * (abs(u[0]) * v[1] + abs(v[0]) * u[1])) / abs(area)


@dataclass(frozen=True, slots=True)
class _Rail:
    """A guide: the link that has it, its direction, and the error of that."""

    link: str
    along: Complex
    slack: Number

    @property
    def across(self) -> Vector:
        """The arm for which the moment of a force is its part along the guide."""
        return -1j * self.along, self.slack

    def along_it(self, total: _Sum) -> Vector:
        """Return the part along the guide that balances some forces, and its error."""
        return -dot(self.along, total.force), total.slack + abs(total.force) * self.slack

    def normal(self, total: _Sum, other: Complex, slack: Number) -> tuple[Complex, Number]:
        """Return the guide's force that balances some forces and another one, and its error."""
        force = total.force + other
        across = -dot(1j * self.along, force)
        return across * (1j * self.along), slack + total.slack + 2.0 * abs(force) * self.slack


def _arms(mechanism: Mechanism) -> dict[str, tuple[str, str]]:
    """Return two joints of every link that turns by itself."""
    driver = mechanism.driver
    found = {driver.link: (driver.pivot, driver.pin)} if isinstance(driver, Crank) else {}
    for group in mechanism.groups:
        match group:
            case Dyad(pins=pins, links=links, node=node):
                found |= {link: (pin, node) for link, pin in zip(links, pins, strict=True)}
            case Slider(link=link, pin=pin, node=node) | SlottedLink(link=link, pivot=pin, node=node):
                found[link] = (pin, node)
    return found


def turning_with(mechanism: Mechanism) -> dict[str, str]:
    """Return the link with which each slider turns; none for those that do not turn."""
    guides = sliders_of(mechanism).items()
    found = {link: guide.link for link, guide in guides if isinstance(guide, MovingGuide)}
    for group in mechanism.groups:
        links = named_links(mechanism)[group.node]
        match group:
            case SlottedLink():
                found[links[1]] = links[0]
            case Yoke(guide=MovingGuide(link=link)):
                found[links[1]] = link
    return found


class _Statics:
    """The equilibrium of one mechanism: forces collected by link, reactions found so far."""

    def __init__(self, mechanism: Mechanism, moving: _Moving) -> None:
        self.mechanism, self.moving = mechanism, moving
        self.at, self.take = moving.at, moving.take
        self.named, self.carriers = named_links(mechanism), carriers(mechanism)
        self.names = short_names(mechanism)
        self.zero = 0.0 * self.at[mechanism.driver.pin]
        self.reach = reduce(larger, map(abs, self.at.values()))
        self.arm_slack = 2.0 * moving.error * self.reach
        """Error of the vector between two joints."""
        self.acting: dict[str, list[tuple[str, Complex, Number, Number, Number]]] = {}
        """On each link: point, force, couple, and the errors of both."""
        self.reactions: list[Reaction] = []
        self.size = self.slack = self.zero.real
        """The largest force, or moment over the mechanism's reach, and the largest error of one."""
        self.arms, self.turns_with = _arms(mechanism), turning_with(mechanism)

    def solve(self) -> Forces:
        """Return all forces, in the numbers of the motion."""
        given = tuple(self._given())
        driver = self.mechanism.driver
        cylinder: SlottedLink | None = None
        for group in reversed(self.mechanism.groups):
            if isinstance(group, SlottedLink) and group.link == getattr(driver, "cylinder", None):
                cylinder = group
            else:
                self._balance(group)
        balancing = self._drive(cylinder)
        hinges: dict[str, Reaction] = {}
        for one in reversed(self.reactions):
            if one.along is None:
                key = one.joint if one.joint not in hinges else f"{one.joint}_{self.names[one.on]}"
                hinges[key] = one
        guides = {self.names[one.on]: one for one in reversed(self.reactions) if one.along is not None}
        size = larger(self.size, larger(abs(balancing.force), abs(balancing.moment) / self.reach))
        predicted = self.slack / where(size == 0.0, 1.0, size)
        return Forces(given, hinges, guides, balancing, self._power(given, balancing, cylinder), predicted)

    # What acts on each link

    def _given(self) -> Iterator[Given]:
        """Yield inertia forces, weights and loads, and put them on their links."""
        mechanism, moving, take, none = self.mechanism, self.moving, self.take, self.zero.real
        most = moving.error * reduce(larger, map(abs, moving.acceleration.values()))
        for body in mechanism.bodies:
            mass, inertia = (none if one is None else take(one) for one in (body.mass, body.inertia))
            short = self.names[body.link]
            on = (body.link, body.centre)
            turns = self.turns_with.get(body.link, body.link)
            force, couple, slack = self.zero - mass * moving.acceleration[body.centre], none, none
            if turns in self.arms:
                p, q = self.arms[turns]
                couple = none - inertia * moving.epsilon[turns]
                slack = inertia * most / abs(self.at[q] - self.at[p])
            yield Given("inertia", f"F_i{short}", *on, force, couple)
            self._put(*on, force, couple, mass * most, slack)
            if mechanism.gravity is not None:
                weight = self.zero - 1j * (mass * take(mechanism.gravity))
                yield Given("weight", f"G_{short}", *on, weight, none)
                self._put(*on, weight, none)
        for load in mechanism.loads:
            force = self.zero + (none if load.force is None else take(load.force))
            couple = none + (none if load.couple is None else take(load.couple))
            yield Given("load", f"F_{load.name}", load.link, load.point, force, couple)
            self._put(load.link, load.point, force, couple)

    def _put(
        self,
        link: str,
        point: str,
        force: Complex,
        couple: Number,
        slack: Number = 0.0,
        couple_slack: Number = 0.0,
    ) -> None:
        slacks = (slack + abs(force) * self.moving.error, couple_slack + abs(couple) * self.moving.error)
        self.acting.setdefault(link, []).append((point, force, couple, *slacks))
        self.slack = larger(self.slack, larger(slacks[0], slacks[1] / self.reach))
        self.size = larger(self.size, larger(abs(force), abs(couple) / self.reach))

    def _sum(self, link: str, about: str) -> _Sum:
        """Return the resultant of what acts on a link, and its moment about a joint."""
        total = _Sum(self.zero, self.zero.real, self.zero.real, self.zero.real)
        for point, force, couple, slack, couple_slack in self.acting.get(link, ()):
            arm = self.at[point] - self.at[about]
            lost = abs(arm) * slack + abs(force) * self.arm_slack + couple_slack
            total += _Sum(force, cross(arm, force) + couple, slack, lost)
        return total

    def _pin(self, joint: str, on: str, force: Complex, slack: Number) -> None:
        """Add the reaction at an outer joint; its opposite acts on the link that carries the pin."""
        by = self.carriers[joint]
        self.reactions.append(Reaction(joint, on, by, force, self.zero.real))
        self._put(by, joint, -force, self.zero.real, slack)

    def _inner(self, joint: str, links: tuple[str, ...], force: Complex) -> None:
        """Add the reaction on the first of two links where they are hinged, or on the other by its pin."""
        on, by = links
        if self.carriers[joint] == on:
            on, by, force = by, on, -force
        self.reactions.append(Reaction(joint, on, by, force, self.zero.real))

    def _guided(
        self, joint: str, on: str, rail: _Rail, force: Complex, moment: Number, slacks: tuple[Number, Number]
    ) -> None:
        """Add the reaction of a guide; its opposite acts on the link that has the guide."""
        self.reactions.append(Reaction(joint, on, rail.link, force, moment, rail.along))
        self._put(rail.link, joint, -force, -moment, *slacks)

    def _rail(self, guide: Guide) -> _Rail:
        if isinstance(guide, FixedGuide):
            return _Rail(GROUND, self.zero + assur.heading(self.take(guide.angle_rad)), SAFETY * EPSILON)
        g, h = guide.base
        d = self.at[h] - self.at[g]
        return _Rail(guide.link, d / abs(d), self.arm_slack / abs(d))

    # Groups

    def _balance(self, group: Group) -> None:
        links = self.named[group.node]
        match group:
            case Dyad():
                self._dyad(group, links)
            case Slider():
                self._slider(group, links)
            case SlottedLink():
                self._slotted(group, links)
            case CrossSlider():
                self._cross_slider(group, links)
            case Yoke():
                self._yoke(group, links)

    def _dyad(self, group: Dyad, links: tuple[str, ...]) -> None:
        first, second = (self._sum(link, group.node) for link in links)
        both, slack = first + second, self.arm_slack
        u, v = (self.at[pin] - self.at[group.node] for pin in group.pins)
        far = second.moment - cross(v, both.force)
        far_slack = second.moment_slack + abs(v) * both.slack + abs(both.force) * slack
        near = (-first.moment, first.moment_slack)
        force, lost = _from_moments((u, slack), near, (v, slack), (far, far_slack))
        self._pin(group.pins[0], links[0], force, lost)
        self._pin(group.pins[1], links[1], -both.force - force, lost + both.slack)
        self._inner(group.node, links, -first.force - force)

    def _slider(self, group: Slider, links: tuple[str, ...]) -> None:
        rail, (rod, block) = self._rail(group.guide), (self._sum(link, group.node) for link in links)
        both = rod + block
        arm = (self.at[group.pin] - self.at[group.node], self.arm_slack)
        force, lost = _from_moments(arm, (-rod.moment, rod.moment_slack), rail.across, rail.along_it(both))
        self._pin(group.pin, links[0], force, lost)
        self._inner(group.node, links, -rod.force - force)
        normal, lost = rail.normal(both, force, lost)
        self._guided(group.node, links[1], rail, normal, -block.moment, (lost, block.moment_slack))

    def _slotted(self, group: SlottedLink, links: tuple[str, ...], crank: Crank | None = None) -> Number:
        """Balance a slotted link; return the thrust on its block if it is the cylinder that drives `crank`."""
        link, block = self._sum(links[0], group.pivot), self._sum(links[1], group.pin)
        d, slack = self.at[group.pin] - self.at[group.pivot], self.arm_slack
        reach, along, _ = assur.rpr_place(d, self.take(group.offset_m), self.take(group.side))
        rail, both, thrust = _Rail(links[0], along, slack / abs(reach)), link + block, self.zero.real
        moment = link.moment + block.moment + cross(d, block.force)
        moment_slack = both.moment_slack + abs(d) * block.slack + abs(block.force) * slack
        force, lost = _from_moments((d, slack), (-moment, moment_slack), rail.across, rail.along_it(block))
        if crank is not None:
            arm, driven = self.at[crank.pin] - self.at[crank.pivot], self._sum(crank.link, crank.pivot)
            lever = reach / cross(arm, d)
            thrust = (cross(arm, force) - driven.moment) * lever
            lost = lost + (abs(arm) * lost + driven.moment_slack + abs(force) * slack) * abs(lever)
            lost = lost + abs(thrust) * slack * (abs(arm) + abs(d)) * abs(lever / reach)
            force = force - thrust * d / reach
        self._pin(group.pin, links[1], force, lost)
        self._pin(group.pivot, links[0], -both.force - force, lost + both.slack)
        normal, _ = rail.normal(block, force, lost)
        self.reactions.append(Reaction(group.pin, links[1], links[0], normal, -block.moment, along))
        return thrust * along

    def _cross_slider(self, group: CrossSlider, links: tuple[str, ...]) -> None:
        blocks, rails = [self._sum(link, group.node) for link in links], [*map(self._rail, group.guides)]
        both, (g, h) = blocks[0] + blocks[1], (rail.along for rail in rails)
        area = cross(g, h)
        normals = (-dot(h, both.force) / area * 1j * g, dot(g, both.force) / area * 1j * h)
        slack = rails[0].slack + rails[1].slack
        self._inner(group.node, links, -blocks[0].force - normals[0])
        for link, rail, block, normal in zip(links, rails, blocks, normals, strict=True):
            lost = (both.slack + (abs(both.force) + abs(normal)) * slack) / abs(area)
            self._guided(group.node, link, rail, normal, -block.moment, (lost, block.moment_slack))

    def _yoke(self, group: Yoke, links: tuple[str, ...]) -> None:
        yoke, block = self._sum(links[0], group.node), self._sum(links[1], group.pin)
        rail, both = self._rail(group.guide), yoke + block
        if isinstance(group.guide, FixedGuide):
            slot = _Rail(links[0], self.zero + assur.heading(self.take(group.slot_rad)), SAFETY * EPSILON)
        else:
            slot = _Rail(links[0], 1j * rail.along, rail.slack)
        force, lost = _from_moments(rail.across, rail.along_it(both), slot.across, slot.along_it(block))
        self._pin(group.pin, links[1], force, lost)
        pressed, slack = slot.normal(block, force, lost)
        self.reactions.append(Reaction(group.pin, links[1], links[0], pressed, -block.moment, slot.along))
        normal, lost = rail.normal(both, force, lost)
        arm = self.at[group.pin] - self.at[group.node]
        moment = cross(arm, pressed) - block.moment - yoke.moment
        moment_slack = both.moment_slack + abs(arm) * slack + abs(pressed) * self.arm_slack
        self._guided(group.node, links[0], rail, normal, moment, (lost, moment_slack))

    # The driving link, and the check

    def _drive(self, cylinder: SlottedLink | None) -> Balancing:
        """Balance the driving link, and the cylinder that drives it."""
        driver, thrust = self.mechanism.driver, self.zero
        if isinstance(driver, DrivingSlider):
            total = self._sum(driver.link, driver.pin)
            rail = self._rail(FixedGuide(driver.guide_m, driver.guide_rad))
            normal, lost = rail.normal(total, self.zero, self.zero.real)
            self._guided(driver.pin, driver.link, rail, normal, -total.moment, (lost, total.moment_slack))
            force = -dot(rail.along, total.force) * rail.along
            return Balancing(driver.link, GROUND, self.zero.real, force, is_force=True)
        if cylinder is not None:
            cylinder_, block = self.named[cylinder.node]
            thrust = self._slotted(cylinder, (cylinder_, block), driver)
        total = self._sum(driver.link, driver.pivot)
        self._pin(driver.pivot, driver.link, -total.force, total.slack)
        self.slack = larger(self.slack, total.moment_slack / self.reach)
        if cylinder is not None:
            return Balancing(block, cylinder_, self.zero.real, thrust, is_force=True)
        return Balancing(driver.link, GROUND, -total.moment, self.zero, is_force=False)

    def _power(self, given: tuple[Given, ...], balancing: Balancing, cylinder: SlottedLink | None) -> Number:
        """Return the power of all given forces and of the balancing one, relative to what each could have."""
        velocity, driver, none = self.moving.velocity, self.mechanism.driver, self.zero.real
        rate = velocity[driver.pin] - (velocity[cylinder.node] if cylinder else 0.0)
        acts = [(one.force, velocity[one.point], one.couple, self._rate(one.link)) for one in given]
        acts.append((balancing.force, rate, balancing.moment, self._rate(driver.link)))
        power = sum((dot(force, v) + couple * omega for force, v, couple, omega in acts), none)
        most = sum((abs(force) * abs(v) + abs(couple * omega) for force, v, couple, omega in acts), none)
        return power / where(most == 0.0, 1.0, most)

    def _rate(self, link: str) -> Number:
        return self.moving.omega.get(self.turns_with.get(link, link), self.zero.real)
