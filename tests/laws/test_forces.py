"""Forces obey Newton and Euler: against one linear system of 50 digits, by their power, by superposition."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from mpmath import mp

from reference.kinematics.motion import move, move_where_possible
from reference.kinematics.solving import one_variant, solve
from reference.kinetics import forces_of
from reference.mechanism import (
    GROUND,
    CrossSlider,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Mechanism,
    Slider,
    SlottedLink,
    Triad,
    Yoke,
    carriers,
    named_links,
)
from tests.examples import slow
from tests.laws.mechanisms import KINDS, LEAST_SINE, after, loaded, random_mechanism, transformed

TRUE_DIGITS = 50
ROUNDING = 1e-9
"""Relative to the largest force: what a variant may have lost before it is solved again."""


def cross(u, v):
    return u.real * v.imag - u.imag * v.real


class Equations:
    """The equilibrium of every link: two equations of forces, one of moments about the origin."""

    def __init__(self, mechanism: Mechanism) -> None:
        self.solution = solve(mechanism, one_variant(0, mp.mpmathify), anew=True)
        self.at = {name: joint.position for name, joint in self.solution.joints.items()}
        self.mechanism, self.named, self.carriers = mechanism, named_links(mechanism), carriers(mechanism)
        self.turns: dict[str, str] = {}
        self.unknowns: list[tuple[str, str, str, str]] = []
        self.columns: list[dict[tuple[str, int], object]] = []
        self.given: dict[str, list] = {
            link: [mp.mpf(0)] * 3 for links in self.named.values() for link in links
        }
        self.given[mechanism.driver.link] = [mp.mpf(0)] * 3
        self.connect()
        self.load()

    def number(self, values):
        return self.solution.take(values)

    def force(self, kind: str, joint: str, on: str, by: str, direction) -> None:
        """An unknown force of a direction, on one link and against the other."""
        arm = self.at[joint]
        parts = (direction.real, direction.imag, cross(arm, direction))
        self.unknown(kind, joint, on, by, parts)

    def unknown(self, kind, joint, on, by, parts):
        self.unknowns.append((kind, joint, on, by))
        self.columns.append(
            {(link, row): sign * part for link, sign in ((on, 1), (by, -1)) for row, part in enumerate(parts)}
        )

    def hinge(self, joint, on, by):
        self.force("x", joint, on, by, mp.mpc(1))
        self.force("y", joint, on, by, mp.mpc(0, 1))

    def slide(self, joint, on, by, along):
        self.force("n", joint, on, by, 1j * along)
        self.unknown("m", joint, on, by, (0, 0, mp.mpf(1)))

    def line(self, guide):
        if isinstance(guide, FixedGuide):
            return GROUND, mp.expj(self.number(guide.angle_rad))
        g, h = guide.base
        d = self.at[h] - self.at[g]
        return guide.link, d / abs(d)

    def connect(self):
        driver = self.mechanism.driver
        cylinder = getattr(driver, "cylinder", None)
        if isinstance(driver, DrivingSlider):
            along = mp.expj(self.number(driver.guide_rad))
            self.slide(driver.pin, driver.link, GROUND, along)
            self.force("balancing", driver.pin, driver.link, GROUND, along)
        else:
            self.hinge(driver.pivot, driver.link, GROUND)
            if cylinder is None:
                self.unknown("balancing", "", driver.link, GROUND, (0, 0, mp.mpf(1)))
        for group in self.mechanism.groups:
            links = self.named[group.node]
            match group:
                case Dyad() | Triad():
                    self.connect_links(group, links)
                case Slider(pin=pin, node=node, guide=guide):
                    self.hinge(pin, links[0], self.carriers[pin])
                    self.hinge(node, *links)
                    by, along = self.line(guide)
                    self.slide(node, links[1], by, along)
                    self.turns[links[1]] = by
                case SlottedLink(pin=pin, pivot=pivot, node=node):
                    self.hinge(pin, links[1], self.carriers[pin])
                    self.hinge(pivot, links[0], self.carriers[pivot])
                    along = self.solution.slots[node][1]
                    self.slide(pin, links[1], links[0], along)
                    self.turns[links[1]] = links[0]
                    if links[0] == cylinder:
                        self.force("balancing", pin, links[1], links[0], along)
                case CrossSlider(node=node, guides=guides):
                    self.hinge(node, *links)
                    for link, guide in zip(links, guides, strict=True):
                        by, along = self.line(guide)
                        self.slide(node, link, by, along)
                        self.turns[link] = by
                case Yoke(node=node, pin=pin, guide=guide):
                    by, along = self.line(guide)
                    self.slide(node, links[0], by, along)
                    fixed = isinstance(guide, FixedGuide)
                    slot = mp.expj(self.number(group.slot_rad)) if fixed else 1j * along
                    self.slide(pin, links[1], links[0], slot)
                    self.hinge(pin, links[1], self.carriers[pin])
                    self.turns |= {links[0]: by, links[1]: by}

    def connect_links(self, group, links):
        for pin, link in zip(group.pins, links, strict=False):
            self.hinge(pin, link, self.carriers[pin])
        if isinstance(group, Dyad):
            self.hinge(group.node, *links)
        else:
            for corner, leg in zip(group.corners, links[:3], strict=True):
                self.hinge(corner, leg, links[3])

    def load(self):
        """Given forces, from the accelerations of 50 digits."""
        joints, mechanism = self.solution.joints, self.mechanism
        rates = self.solution.epsilon
        for body in mechanism.bodies:
            mass = self.number(body.mass)
            force = -mass * joints[body.centre].acceleration
            if mechanism.gravity is not None:
                force -= 1j * mass * self.number(mechanism.gravity)
            turning = self.turns.get(body.link, body.link)
            couple = -self.number(body.inertia) * rates.get(turning, mp.mpf(0))
            self.act(body.link, body.centre, force, couple)
        for load in mechanism.loads:
            force = mp.mpc(0) if load.force is None else self.number(load.force)
            couple = mp.mpf(0) if load.couple is None else self.number(load.couple)
            if load.slider is not None:
                slider = joints[load.slider]
                motion = slider.velocity or slider.acceleration
                force = force.real * motion / abs(motion) if motion else mp.mpc(0)
            self.act(load.link, load.point, force, couple)

    def act(self, link, point, force, couple):
        for row, part in enumerate((force.real, force.imag, cross(self.at[point], force) + couple)):
            self.given[link][row] += part

    def solved(self) -> dict[tuple[str, str, str], object]:
        """By joint and links, the force; by "moment" too, that of a guide about its joint; "balancing"."""
        links = [*self.given]
        assert len(self.unknowns) == 3 * len(links)
        matrix = mp.matrix(3 * len(links), 3 * len(links))
        right = mp.matrix(3 * len(links), 1)
        index = {link: 3 * place for place, link in enumerate(links)}
        for column, parts in enumerate(self.columns):
            for (link, row), part in parts.items():
                if link != GROUND:
                    matrix[index[link] + row, column] = part
        for link in links:
            for row in range(3):
                right[index[link] + row] = -self.given[link][row]
        values = mp.lu_solve(matrix, right)
        found = {}
        for unknown, parts, value in zip(self.unknowns, self.columns, values, strict=True):
            kind, joint, on, by = unknown
            if kind == "balancing":
                found["balancing"] = value * mp.mpc(parts[on, 0], parts[on, 1]) if joint else value
                continue
            for first, second, sign in ((on, by, 1), (by, on, -1)):
                key = ("moment" if kind == "m" else "force", joint, first, second)
                part = mp.mpf(1) if kind == "m" else mp.mpc(parts[on, 0], parts[on, 1])
                found[key] = found.get(key, mp.mpc(0)) + sign * value * part
        return found


def errors(mechanism: Mechanism) -> tuple[float, float] | None:
    """The largest error of a force, relative to the largest one, and its prediction; None without motion."""
    motion = move_where_possible(mechanism)
    if not np.isfinite(motion.predicted_error[0]):
        return None
    forces = forces_of(mechanism, motion)
    with mp.workdps(TRUE_DIGITS):
        equations = Equations(mechanism)
        truth = equations.solved()
        reach = max(map(abs, equations.at.values()))
        pairs = [(one.force, truth["force", one.joint, one.on, one.by], 1) for one in forces.hinges.values()]
        for one in forces.guides.values():
            pairs.append((one.force, truth["force", one.joint, one.on, one.by], 1))
            pairs.append((one.moment, truth["moment", one.joint, one.on, one.by], reach))
        one, is_force = forces.balancing, forces.balancing.along is not None
        pairs.append((one.force if is_force else one.moment, truth["balancing"], 1 if is_force else reach))
        assert len(truth) == 2 * len(pairs) - 1
        given = [abs(complex(one.force[0])) for one in forces.given]
        given += [abs(float(one.couple[0])) / reach for one in forces.given]
        size = max([*given, *(abs(exact) / share for _, exact, share in pairs)])
        if size == 0:
            return 0.0, 0.0
        error = max(abs(mp.mpmathify(complex(found[0])) - exact) / share for found, exact, share in pairs)
        return float(error / size), float(forces.predicted_error[0])


def random_loaded(number: int, least_sine: float = LEAST_SINE) -> Mechanism:
    """A mechanism with masses and loads; every kind of group stands first in some of them."""
    lot = np.random.default_rng(number)
    chain = list(lot.choice(KINDS, size=lot.integers(1, 7)))
    chain = [KINDS[number % len(KINDS)], *chain]
    mechanism = random_mechanism(
        int(lot.integers(2**31)), chain, slider_drives=number % 3 == 0, least_sine=least_sine
    )
    return loaded(mechanism, number)


BLOCKS = [0, *slow(*range(1, 10))]
"""Fifty mechanisms each."""


@pytest.mark.parametrize("block", BLOCKS)
@pytest.mark.parametrize("least_sine", [LEAST_SINE, *slow(1e-9)])
def test_forces_solve_all_equations_of_newton_and_euler(block, least_sine):
    checked = 0
    for number in range(50 * block, 50 * (block + 1)):
        found = errors(random_loaded(number, least_sine))
        if found is not None:
            error, predicted = found
            assert error <= predicted, number
            checked += 1
    assert checked > 30


@pytest.mark.parametrize("block", BLOCKS)
def test_all_given_forces_and_the_balancing_one_have_no_power_together(block):
    for number in range(50 * block, 50 * (block + 1)):
        mechanism = random_loaded(number)
        residual = forces_of(mechanism, move(mechanism)).power_residual[0]
        assert abs(residual) <= ROUNDING, number


def reactions(mechanism: Mechanism) -> dict[str, tuple[complex, complex]]:
    """Every reaction by name, and the balancing force: the force and the moment."""
    forces = forces_of(mechanism, move(mechanism))
    named = {**{f"hinge {name}": one for name, one in forces.hinges.items()}, "balancing": forces.balancing}
    named |= {f"guide {name}": one for name, one in forces.guides.items()}
    return {name: (complex(one.force[0]), complex(one.moment[0])) for name, one in named.items()}


def assert_alike(found, expected):
    assert found.keys() == expected.keys()
    size = max(abs(part) for parts in (*found.values(), *expected.values()) for part in parts)
    for name, parts in expected.items():
        for one, other in zip(found[name], parts, strict=True):
            assert abs(one - other) <= ROUNDING * size, name


numbers = st.integers(0, 2**31)


@given(numbers)
def test_reactions_add_up_with_the_forces_given(number):
    mechanism = random_loaded(number)
    masses, loads = (replace(mechanism, **{what: ()}) for what in ("loads", "bodies"))
    both = zip(reactions(masses).items(), reactions(loads).values(), strict=True)
    summed = {name: (force + more, moment + couple) for (name, (force, moment)), (more, couple) in both}
    assert_alike(reactions(mechanism), summed)


@given(numbers, st.floats(-3.1, 3.1), st.booleans())
def test_reactions_turn_and_are_mirrored_with_the_mechanism(number, angle, mirror):
    mechanism, turn = replace(random_loaded(number), gravity=None), np.exp(1j * angle)
    image, place = transformed(mechanism, turn, mirror=mirror)
    sign = -1 if mirror else 1
    expected = {name: (place(f), sign * m) for name, (f, m) in reactions(mechanism).items()}
    assert_alike(reactions(image), expected)


def test_many_variants_have_the_forces_of_each():
    for number in range(24):
        mechanism = random_loaded(number)
        many = after(mechanism, np.linspace(0.0, 1e-3, 4))
        motion = move(many)
        forces = forces_of(many, motion)
        for index, time in enumerate(np.linspace(0.0, 1e-3, 4)):
            alone = after(mechanism, time)
            one = forces_of(alone, move(alone))
            size = max(abs(each.force[0]) for each in (*one.given, *one.hinges.values()))
            for name, hinge in one.hinges.items():
                assert abs(hinge.force[0] - forces.hinges[name].force[index]) <= ROUNDING * size
