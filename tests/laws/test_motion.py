"""Laws that any plane mechanism's motion obeys, on random mechanisms."""

from dataclasses import replace

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from reference.geometry import cross, dot
from reference.mechanism import Dyad, FixedGuide, Mechanism, Plate, PointOnLine, Slider
from reference.motion import move

ROUNDING = 1e-9
"""Relative to the largest velocity or acceleration; 1/transmission^2 may be 50, digits are 16."""
STEP_RAD = 2e-5
DIFFERENCE = 1e-5
"""Error of a slope over four steps of the crank, relative."""

LINKS = [("O1", "A"), ("A", "B"), ("O2", "B"), ("A", "C"), ("B", "C"), ("C", "D"), ("C", "E"), ("O2", "F")]
a_mechanism = st.from_type(Mechanism)


def speed(motion):
    return max(float(np.abs(v)[0]) for v in motion.velocity.values())


def acceleration(motion):
    return max(float(np.abs(a)[0]) for a in motion.acceleration.values())


def near(one, other, size, share=ROUNDING):
    return float(np.max(np.abs(one - other))) <= share * size


@given(a_mechanism)
def test_the_ends_of_a_link_neither_part_nor_approach(mechanism):
    motion = move(mechanism)
    for tail, head in LINKS:
        arm = motion.position[head] - motion.position[tail]
        v = motion.velocity[head] - motion.velocity[tail]
        a = motion.acceleration[head] - motion.acceleration[tail]
        reach = max(float(np.abs(arm)[0]), 1e-3)
        assert abs(dot(arm, v)[0]) <= ROUNDING * reach * speed(motion)
        assert abs((dot(arm, a) + dot(v, v))[0]) <= ROUNDING * (
            reach * acceleration(motion) + speed(motion) ** 2
        )


@given(a_mechanism)
def test_points_of_one_link_turn_alike(mechanism):
    motion = move(mechanism)
    for link, pairs in (
        ("3", [("A", "B"), ("A", "C"), ("B", "C")]),
        ("2", [("O2", "B")]),
        ("4", [("C", "D")]),
    ):
        for tail, head in pairs:
            arm = motion.position[head] - motion.position[tail]
            v = motion.velocity[head] - motion.velocity[tail]
            a = motion.acceleration[head] - motion.acceleration[tail]
            assert near(v, 1j * motion.omega[link] * arm, speed(motion))
            rigid = (1j * motion.epsilon[link] - motion.omega[link] ** 2) * arm
            assert near(a, rigid, acceleration(motion) + speed(motion) ** 2)


@given(a_mechanism)
def test_a_slider_stays_on_its_guide(mechanism):
    motion = move(mechanism)
    guide = next(group for group in mechanism.groups if isinstance(group, Slider))
    along = np.exp(1j * guide.guide.angle_rad)
    assert near(cross(along, motion.position["D"] - guide.guide.through_m), 0.0, 1.0)
    assert near(cross(along, motion.velocity["D"]), 0.0, speed(motion))
    assert near(cross(along, motion.acceleration["D"]), 0.0, acceleration(motion))


@given(a_mechanism, st.floats(-20, 20), st.floats(-20, 20))
def test_velocities_add_up_with_the_cranks_speed(with_crank, mechanism, first, second):
    one, two, both = (with_crank(mechanism, omega=omega) for omega in (first, second, first + second))
    size = speed(one) + speed(two) + 1e-9
    for joint in both.velocity:
        assert near(both.velocity[joint], one.velocity[joint] + two.velocity[joint], size)


@given(a_mechanism)
def test_accelerations_are_those_of_the_speed_plus_those_of_the_cranks_acceleration(with_crank, mechanism):
    whole = move(mechanism)
    uniform = with_crank(mechanism, epsilon=0.0)
    started = with_crank(mechanism, omega=0.0)
    size = acceleration(uniform) + acceleration(started)
    for joint, a in whole.acceleration.items():
        assert near(a, uniform.acceleration[joint] + started.acceleration[joint], size)


@given(a_mechanism)
def test_backwards_in_time_velocities_turn_round_and_accelerations_stay(with_crank, mechanism):
    forth, back = move(mechanism), with_crank(mechanism, omega=-mechanism.crank.omega[0])
    for joint in forth.velocity:
        assert near(forth.velocity[joint], -back.velocity[joint], speed(forth))
        assert near(forth.acceleration[joint], back.acceleration[joint], acceleration(forth))


def transformed(mechanism, turn, *, mirror=False, factor=1.0):
    """The mechanism turned by a unit number, mirrored in the x axis before, and enlarged."""

    def place(z):
        return (np.conj(z) if mirror else z) * turn * factor

    sign = -1 if mirror else 1

    def group(one):
        match one:
            case PointOnLine():
                return one
            case Slider():
                angle_rad = sign * one.guide.angle_rad + np.angle(turn)
                guide = FixedGuide(place(one.guide.through_m), angle_rad)
                return replace(one, length_m=one.length_m * factor, guide=guide, side=one.side)
            case Plate():
                lengths = tuple(length * factor for length in one.lengths_m)
                shape = np.conj(one.shape) if mirror else one.shape
                return replace(one, lengths_m=lengths, side=sign * one.side, shape=shape)
            case Dyad():
                lengths = tuple(length * factor for length in one.lengths_m)
                return replace(one, lengths_m=lengths, side=sign * one.side)

    crank = mechanism.crank
    driven = replace(
        crank,
        length_m=crank.length_m * factor,
        angle_rad=sign * crank.angle_rad + np.angle(turn),
        omega=sign * crank.omega,
        epsilon=sign * crank.epsilon,
    )
    ground = {joint: place(z) for joint, z in mechanism.ground_m.items()}
    return Mechanism(ground, driven, tuple(group(one) for one in mechanism.groups)), place


@given(a_mechanism, st.floats(-3.1, 3.1), st.booleans(), st.sampled_from([1e-6, 0.01, 1.0, 39.37, 1e5]))
def test_turned_mirrored_and_enlarged_mechanisms_move_alike(mechanism, angle, mirror, factor):
    image, place = transformed(mechanism, np.exp(1j * angle), mirror=mirror, factor=factor)
    motion, other = move(mechanism), move(image)
    for joint in motion.position:
        assert near(place(motion.position[joint]), other.position[joint], 4.0 * factor)
        assert near(place(motion.velocity[joint]), other.velocity[joint], speed(other))
        assert near(place(motion.acceleration[joint]), other.acceleration[joint], acceleration(other))
    for link, omega in motion.omega.items():
        sign = -1 if mirror else 1
        scale = float(np.max([np.abs(w) for w in motion.omega.values()]))
        assert near(sign * omega, other.omega[link], scale)


@given(a_mechanism)
def test_velocities_and_accelerations_are_the_slopes_of_positions_and_velocities(with_crank, mechanism):
    crank = mechanism.crank
    omega, epsilon, angle = crank.omega[0], crank.epsilon[0], crank.angle_rad[0]
    step = STEP_RAD / max(abs(omega), np.sqrt(abs(epsilon)))
    at = {
        k: with_crank(
            mechanism,
            angle_rad=angle + omega * k * step + epsilon * (k * step) ** 2 / 2,
            omega=omega + epsilon * k * step,
        )
        for k in (-2, -1, 0, 1, 2)
    }

    def slope(what, joint):
        early, late = (getattr(at[-1], what)[joint], getattr(at[1], what)[joint])
        before, after = (getattr(at[-2], what)[joint], getattr(at[2], what)[joint])
        return (8 * (late - early) - (after - before)) / (12 * step)

    now = at[0]
    for joint in now.position:
        assert near(slope("position", joint), now.velocity[joint], speed(now) + abs(omega), DIFFERENCE)
        size = acceleration(now) + omega**2
        assert near(slope("velocity", joint), now.acceleration[joint], size, DIFFERENCE)
