"""Forces of a mechanism in motion: its kinetostatics in closed form, from the last group to the driving link.

Every Assur group is statically determinate: with the inertia forces, weights and loads of its links and the
reactions of later groups known, its own reactions follow from moments about its joints and from the forces
along its guides, two linear equations at a time. A slider turns with its guide, so that its couple goes into
the guide's moment. Nothing is iterated, and all variants are solved on arrays; see docs/solver.md.

Forces are complex (x + i y, N), couples and moments counter-clockwise positive (N m). The predicted error is
a running bound: of the motion, of the arms, and of each pair of equations. Variants that have lost digits
are solved again with more, as motion is.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import reduce
from operator import mul
from typing import Any, Literal

import numpy as np

from reference.geometry import ComplexArray, FloatArray
from reference.kinematics import assur
from reference.kinematics.motion import DIGITS, EPSILON, EXTENDED_ENOUGH, LOSSY, SAFETY, Motion, refined
from reference.kinematics.solving import Joint, Solution
from reference.mechanism import (
    GROUND,
    Array,
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
    Triad,
    Yoke,
    carriers,
    named_links,
    short_names,
    sliders_of,
    slotted_links,
    turning,
    with_arrays,
)
from reference.numbers import Complex, Number, cross, dot, larger, where

GivenKind = Literal["inertia", "weight", "load"]


@dataclass(frozen=True, slots=True)
class Given:
    """An inertia force with its couple, a weight, or a load: on `link` at `point`."""

    kind: GivenKind
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
    along : the guide's direction; None at a hinge
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
class Forces:
    """All forces of a mechanism, arrays of shape (N,).

    Attributes
    ----------
    given : inertia forces, weights, loads
    hinges : by joint; a further hinge at a joint by joint and link, ``B_4``
    guides : by the slider's short name; their forces are across the guide
    balancing : the moment on the driving crank; or the force along its guide on the slider that drives, or
        on the block in the cylinder that does
    power_residual : the power of all given forces and of the balancing one, relative to the sum of the
        products of forces and speeds; zero apart from rounding
    predicted_error : of forces, relative to the largest one; of moments, relative to the largest force
        times the farthest joint's distance from the origin
    """

    given: tuple[Given, ...]
    hinges: Mapping[str, Reaction]
    guides: Mapping[str, Reaction]
    balancing: Reaction
    power_residual: FloatArray
    predicted_error: FloatArray


def forces_of(mechanism: Mechanism, motion: Motion) -> Forces:
    """Return the forces of every variant of a mechanism whose motion, with accelerations, is solved."""
    mechanism = _directed(mechanism, motion)
    rates = zip(motion.position.values(), motion.velocity.values(), motion.acceleration.values(), strict=True)
    joints = {name: Joint(*rate) for name, rate in zip(motion.position, rates, strict=True)}
    solution = Solution(joints, motion.omega, motion.epsilon)
    error = np.maximum(motion.predicted_error, SAFETY * EPSILON)
    with np.errstate(all="ignore"):
        solved = _Statics(mechanism, solution, error).solve()
        forces: Forces = with_arrays(solved, lambda values: np.array(np.broadcast_to(values, error.shape)))
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
        if load.force is not None and load.slider is not None and isinstance(guide, FixedGuide):
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
            anew = _Statics(mechanism, solution, EPSILON).solve()
        for array, exact in zip(_arrays(forces), _arrays(anew), strict=True):
            array[rows] = exact if np.iscomplexobj(array) else exact.real
    predicted[:] = kept


def _arrays(forces: Forces) -> list[Array]:
    """Return all arrays of forces, in the order of their fields."""
    found: list[Array] = []
    with_arrays(forces, found.append)
    return found


# In numbers of any kind ----------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class _Near:
    """A number or a vector, and a bound of its error, which grows as numbers are combined."""

    value: Any
    slack: Any = 0.0

    def __add__(self, other: "_Near") -> "_Near":
        return _Near(self.value + other.value, self.slack + other.slack)

    def __neg__(self) -> "_Near":
        return _Near(-self.value, self.slack)

    def by(self, other: "_Near", product: Callable[[Any, Any], Any] = mul) -> "_Near":
        """Return the product, the cross or the scalar product with another one."""
        lost = abs(self.value) * other.slack + abs(other.value) * self.slack
        return _Near(product(self.value, other.value), lost)

    def over(self, other: "_Near") -> "_Near":
        """Return the quotient."""
        value, size = self.value / other.value, abs(other.value)
        return _Near(value, (self.slack + abs(value) * other.slack) / size)

    @property
    def left(self) -> "_Near":
        """The vector turned by 90 degrees counter-clockwise."""
        return _Near(1j * self.value, self.slack)


def _from_moments(u: _Near, m: _Near, v: _Near, n: _Near) -> _Near:
    """Return the force R with u x R = m and v x R = n; with v = i g, n is minus the part of R along g."""
    return (v.by(m) + -u.by(n)).over(u.by(v, cross))


Rail = tuple[str, _Near]
"""The link that has a guide, and the guide's direction."""


class _Statics:
    """The equilibrium of one mechanism: what acts on its links, and the reactions found so far.

    Arguments: its motion; the relative error of that, of places as of rates.
    """

    def __init__(self, mechanism: Mechanism, solution: Solution, error: Number) -> None:
        self.mechanism, self.solution, self.error = mechanism, solution, error
        self.take, self.at = solution.take, {name: one.position for name, one in solution.joints.items()}
        self.named, self.carriers = named_links(mechanism), carriers(mechanism)
        self.names, self.turning = short_names(mechanism), turning(mechanism)
        self.zero = 0.0 * self.at[mechanism.driver.pin]
        self.reach = reduce(larger, map(abs, self.at.values()))
        self.acting: dict[str, list[tuple[str, _Near, _Near]]] = {}
        """On each link: point, force, couple."""
        self.reactions: list[Reaction] = []
        self.largest = _Near(self.zero.real, self.zero.real)
        """The largest force, or moment over the mechanism's reach, and the largest error of one."""

    def solve(self) -> Forces:
        """Return all forces as arrays."""
        given = tuple(self._given())
        cylinder = slotted_links(self.mechanism).get(getattr(self.mechanism.driver, "cylinder", ""))
        for group in reversed(self.mechanism.groups):
            if group is not cylinder:
                self._balance(group)
        balancing = self._drive(cylinder)
        hinges: dict[str, Reaction] = {}
        for one in reversed(self.reactions):
            if one.along is None:
                key = one.joint if one.joint not in hinges else f"{one.joint}_{self.names[one.on]}"
                hinges[key] = one
        guides = {self.names[one.on]: one for one in reversed(self.reactions) if one.along is not None}
        size = self.largest.value
        predicted = self.largest.slack / where(size == 0.0, 1.0, size)
        power = _rounded(self._power(given, balancing, cylinder))
        return Forces(given, hinges, guides, balancing, power, _rounded(predicted))

    def _given(self) -> Iterator[Given]:
        """Yield inertia forces, weights and loads, and put them on their links."""
        take, joints, none = self.take, self.solution.joints, _Near(self.zero.real)
        most = self.error * reduce(larger, [abs(joint.acceleration) for joint in joints.values()])
        for body in self.mechanism.bodies:
            mass, inertia = (none.value if one is None else take(one) for one in (body.mass, body.inertia))
            couple = none
            if body.link in self.turning:
                link, p, q = self.turning[body.link]
                slack = inertia * most / abs(self.at[q] - self.at[p])
                couple = _Near(none.value - inertia * self.solution.epsilon[link], slack)
            force = _Near(self.zero - mass * joints[body.centre].acceleration, mass * most)
            place, short = (body.link, body.centre), self.names[body.link]
            yield self._put("inertia", f"F_i{short}", *place, force, couple)
            if self.mechanism.gravity is not None:
                force = _Near(self.zero - 1j * (mass * take(self.mechanism.gravity)))
                yield self._put("weight", f"G_{short}", *place, force, none)
        for load in self.mechanism.loads:
            force, couple = (
                _Near(zero if one is None else zero + take(one))
                for zero, one in ((self.zero, load.force), (none.value, load.couple))
            )
            yield self._put("load", f"F_{load.name}", load.link, load.point, force, couple)

    def _put(self, kind: GivenKind, name: str, link: str, point: str, force: _Near, couple: _Near) -> Given:
        """Put a given force on its link, with the error of its rounding."""
        rounded = (_Near(one.value, one.slack + abs(one.value) * self.error) for one in (force, couple))
        self._act(link, point, *rounded)
        return Given(kind, name, link, point, _rounded(force.value), _rounded(couple.value))

    def _act(self, link: str, point: str, force: _Near, couple: _Near) -> None:
        self.acting.setdefault(link, []).append((point, force, couple))
        for one, per in ((force, 1.0), (couple, self.reach)):
            value, slack = larger(self.largest.value, abs(one.value) / per), one.slack / per
            self.largest = _Near(value, larger(self.largest.slack, slack))

    def _arm(self, tail: str, head: str) -> _Near:
        slack = 0.0 if tail == head else 2.0 * self.error * self.reach
        return _Near(self.at[head] - self.at[tail], slack)

    def _sum(self, link: str, about: str) -> tuple[_Near, _Near]:
        """Return the resultant of what acts on a link, and its moment about a joint."""
        force, moment = _Near(self.zero), _Near(self.zero.real)
        for point, one, couple in self.acting.get(link, ()):
            force, moment = force + one, moment + self._arm(about, point).by(one, cross) + couple
        return force, moment

    def _react(
        self, joint: str, on: str, by: str, force: _Near, moment: _Near | None = None, along: Complex = None
    ) -> None:
        """Add the reaction on a link by another, on which its opposite acts."""
        couple = moment or _Near(self.zero.real)
        self._act(on, joint, force, couple)
        self._act(by, joint, -force, -couple)
        if along is None and self.carriers[joint] == on:
            on, by, force = by, on, -force
        self.reactions.append(self._reaction(joint, on, by, force, couple, along))

    def _reaction(
        self, joint: str, on: str, by: str, force: _Near, moment: _Near, along: Complex
    ) -> Reaction:
        direction = None if along is None else _rounded(along)
        return Reaction(joint, on, by, _rounded(force.value), _rounded(moment.value), direction)

    def _close(self, joint: str, on: str, by: str = "") -> None:
        """Add the reaction at a hinge, by default on the link of its pin, that balances all other forces."""
        self._react(joint, on, by or self.carriers[joint], -self._sum(on, joint)[0])

    def _guide(self, joint: str, on: str, rail: Rail) -> None:
        """Add the reaction of a guide that balances a slider across the guide and in its moments."""
        (by, along), (force, moment) = rail, self._sum(on, joint)
        across = along.left.by(force, dot)
        self._react(joint, on, by, along.left.by(-across), -moment, along.value)

    def _rail(self, guide: Guide) -> Rail:
        if isinstance(guide, MovingGuide):
            base = self._arm(*guide.base)
            return guide.link, base.over(_Near(abs(base.value)))
        along = self.zero + assur.heading(self.take(guide.angle_rad))
        return GROUND, _Near(along, SAFETY * EPSILON)

    def _balance(self, group: Group) -> None:
        """Add the reactions of a group on which all but its own reactions act."""
        links = self.named[group.node]
        match group:
            case Dyad():
                self._balance_dyad(group, links)
            case Slider(node=node, pin=pin):
                rail = self._rail(group.guide)
                (rod, moment), (block, _) = (self._sum(link, node) for link in links)
                along = rail[1].by(rod + block, dot)
                force = _from_moments(self._arm(node, pin), -moment, rail[1].left, along)
                self._react(pin, links[0], self.carriers[pin], force)
                self._close(node, *links)
                self._guide(node, links[1], rail)
            case SlottedLink():
                self._balance_slotted(group, links)
            case CrossSlider(node=node):
                rails = [self._rail(guide) for guide in group.guides]
                (first, moment), (second, _) = (self._sum(link, node) for link in links)
                (by, g), (_, h) = rails
                normal = -h.by(first + second, dot).over(g.by(h, cross))
                self._react(node, links[0], by, g.left.by(normal), -moment, g.value)
                self._close(node, *links)
                self._guide(node, links[1], rails[1])
            case Yoke():
                self._balance_yoke(group, links)
            case Triad():
                self._balance_triad(group)

    def _balance_dyad(self, group: Dyad, links: tuple[str, ...]) -> None:
        (p, q), node = group.pins, group.node
        (first, moment), (second, far) = (self._sum(link, node) for link in links)
        u, v = self._arm(node, p), self._arm(node, q)
        force = _from_moments(u, -moment, v, far + -v.by(first + second, cross))
        self._react(p, links[0], self.carriers[p], force)
        self._close(node, *links)
        self._close(q, links[1])

    def _balance_triad(self, group: Triad) -> None:
        """Balance a triad: moments of a leg about its corner for the part across it, then of all about S."""
        s, ternary = group.assur_point, group.links[3]
        legs = list(zip(group.links[:3], group.pins, group.corners, strict=True))
        rest, moment = self._sum(ternary, s)
        arms, forces = list[_Near](), list[_Near]()
        for link, pin, corner in legs:
            arm = self._arm(corner, pin)
            force = arm.left.by(-self._sum(link, corner)[1]).over(arm.by(arm, dot))
            total, more = self._sum(link, s)
            rest, moment = rest + total + force, moment + more + self._arm(s, pin).by(force, cross)
            arms.append(arm)
            forces.append(force)
        last = -moment.over(self._arm(s, legs[2][1]).by(arms[2], cross))
        rest = rest + arms[2].by(last)
        crossing = arms[0].by(arms[1], cross)
        along = (rest.by(arms[1], cross).over(-crossing), rest.by(arms[0], cross).over(crossing), last)
        for (link, pin, corner), arm, force, one in zip(legs, arms, forces, along, strict=True):
            self._react(pin, link, self.carriers[pin], force + arm.by(one))
            self._close(corner, link, ternary)

    def _balance_yoke(self, group: Yoke, links: tuple[str, ...]) -> None:
        rail, pin = self._rail(group.guide), group.pin
        slot = rail[1].left
        if isinstance(group.guide, FixedGuide):
            slot = self._rail(replace(group.guide, angle_rad=group.slot_rad))[1]
        (yoke, _), (block, _) = (self._sum(link, pin) for link in links)
        along = rail[1].by(yoke + block, dot)
        force = _from_moments(rail[1].left, along, slot.left, slot.by(block, dot))
        self._react(pin, links[1], self.carriers[pin], force)
        self._guide(pin, links[1], (links[0], slot))
        self._guide(group.node, links[0], rail)

    def _balance_slotted(
        self, group: SlottedLink, links: tuple[str, ...], crank: Crank | None = None
    ) -> tuple[_Near, Complex]:
        """Balance a slotted link; return the force on its block if it drives the crank, and its direction."""
        d, offset, side = self._arm(group.pivot, group.pin), self.take(group.offset_m), self.take(group.side)
        reach, direction, _ = assur.rpr_place(d.value, offset, side)
        along, length = _Near(direction, d.slack / abs(reach)), _Near(reach, d.slack * abs(d.value / reach))
        (_, moment), (block, more) = (self._sum(link, group.pivot) for link in links)
        force = _from_moments(d, -(moment + more), along.left, along.by(block, dot))
        thrust = _Near(self.zero.real)
        if crank is not None:
            arm = self._arm(crank.pivot, crank.pin)
            needed = arm.by(force, cross) + -self._sum(crank.link, crank.pivot)[1]
            lever = d.over(length)
            thrust = needed.over(arm.by(lever, cross))
            force = force + -lever.by(thrust)
        self._react(group.pin, links[1], self.carriers[group.pin], force)
        for link, one in zip(links, (-thrust, thrust), strict=True):
            self._act(link, group.pin, along.by(one), _Near(self.zero.real))
        self._guide(group.pin, links[1], (links[0], along))
        self._close(group.pivot, links[0])
        return along.by(thrust), direction

    def _drive(self, cylinder: SlottedLink | None) -> Reaction:
        """Balance the driving link, and the cylinder that drives it."""
        driver, moment, force = self.mechanism.driver, _Near(self.zero.real), _Near(self.zero)
        on, by, along = driver.link, GROUND, None
        if isinstance(driver, DrivingSlider):
            rail = self._rail(FixedGuide(driver.guide_m, driver.guide_rad))
            self._guide(driver.pin, on, rail)
            force, along = rail[1].by(-rail[1].by(self._sum(on, driver.pin)[0], dot)), rail[1].value
        elif cylinder is not None:
            by, on = self.named[cylinder.node]
            force, along = self._balance_slotted(cylinder, (by, on), driver)
        else:
            moment = -self._sum(on, driver.pivot)[1]
        if isinstance(driver, Crank):
            self._close(driver.pivot, driver.link, GROUND)
        self._act(GROUND, driver.pin, force, moment)
        return self._reaction(driver.pin, on, by, force, moment, along)

    def _power(self, given: tuple[Given, ...], balancing: Reaction, cylinder: SlottedLink | None) -> Number:
        """Return the power of all given forces and of the balancing one, relative to what it could be."""
        speeds = {name: _rounded(joint.velocity) for name, joint in self.solution.joints.items()}
        rates = {link: _rounded(self.solution.omega[turns]) for link, (turns, *_) in self.turning.items()}
        rate = speeds[balancing.joint] - (speeds[cylinder.node] if cylinder else 0.0)
        acts = [(one.force, speeds[one.point], one.couple, rates.get(one.link, 0.0)) for one in given]
        acts.append((balancing.force, rate, balancing.moment, rates.get(balancing.on, 0.0)))
        power = sum(dot(force, v) + couple * omega for force, v, couple, omega in acts)
        most = sum(abs(force) * abs(v) + abs(couple * omega) for force, v, couple, omega in acts)
        return power / where(most == 0.0, 1.0, most)


def _rounded(number: Number) -> Any:  # noqa: ANN401 - an array of doubles, or of extended floats
    return number if isinstance(number, np.ndarray) else np.array([complex(number)])
