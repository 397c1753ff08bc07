"""Laws that any plane mechanism's motion obeys, on random mechanisms of all groups."""

import itertools

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from reference.geometry import cross, dot
from reference.kinematics.motion import move
from reference.mechanism import CrossSlider, FixedGuide, Mechanism, SlottedLink, Triad, Yoke, moving_guides
from tests.laws.mechanisms import after, driven, points_of_links, rates_of, transformed

ROUNDING = 1e-9
"""Relative to the largest velocity or acceleration: sines of a quarter, squared, over six groups."""
STEP = 1e-4
"""Between the instants of a finite difference: of a radian, or of a metre, of the driver's motion."""
DIFFERENCE = 1e-5
"""Error of a slope over four such steps, relative."""

a_mechanism = st.from_type(Mechanism)


def speed(motion):
    return max(float(np.abs(v)[0]) for v in motion.velocity.values())


def acceleration(motion):
    """The largest acceleration, or what the largest speed makes of one over a metre."""
    return max(speed(motion) ** 2, *(float(np.abs(a)[0]) for a in motion.acceleration.values()))


def near(one, other, size, share=ROUNDING):
    return float(np.max(np.abs(one - other))) <= share * size


def arms(mechanism, motion):
    """Every two points of one link: the link, and their differences of place, velocity, acceleration."""
    for link, joints in points_of_links(mechanism).items():
        for tail, head in itertools.pairwise(joints):
            what = (motion.position, motion.velocity, motion.acceleration)
            yield link, *(rate[head] - rate[tail] for rate in what)


@given(a_mechanism)
def test_points_of_one_link_turn_alike(mechanism):
    motion = move(mechanism)
    for link, arm, v, a in arms(mechanism, motion):
        assert near(v, 1j * motion.omega[link] * arm, speed(motion))
        assert near(a, (1j * motion.epsilon[link] - motion.omega[link] ** 2) * arm, acceleration(motion))


def fixed_guides(mechanism):
    for group in mechanism.groups:
        guides = group.guides if isinstance(group, CrossSlider) else (getattr(group, "guide", None),)
        yield from ((group.node, guide) for guide in guides if isinstance(guide, FixedGuide))


@given(a_mechanism)
def test_a_slider_stays_on_its_fixed_guide(mechanism):
    motion = move(mechanism)
    for node, guide in fixed_guides(mechanism):
        along = np.exp(1j * guide.angle_rad)
        assert near(cross(along, motion.position[node] - guide.through_m), 0.0, 4.0)
        assert near(cross(along, motion.velocity[node]), 0.0, speed(motion))
        assert near(cross(along, motion.acceleration[node]), 0.0, acceleration(motion))


@given(a_mechanism)
def test_a_yokes_slot_does_not_turn(mechanism):
    motion = move(mechanism)
    for group in mechanism.groups:
        if isinstance(group, Yoke) and isinstance(group.guide, FixedGuide):
            slot = np.exp(1j * group.slot_rad)
            for rate, size in (
                (motion.position, 4.0),
                (motion.velocity, speed(motion)),
                (motion.acceleration, acceleration(motion)),
            ):
                assert near(cross(slot, rate[group.node] - rate[group.pin]), 0.0, size)


def slides(mechanism, motion):
    """Sliding pairs on turning guides: link, its point, the point that slides on it, the direction."""
    at = motion.position
    for group in mechanism.groups:
        for guide in moving_guides(group):
            g, h = guide.base
            yield guide.link, guide.coincident, group.node, (at[h] - at[g]) / np.abs(at[h] - at[g])
        if isinstance(group, Yoke) and moving_guides(group):
            g, h = group.guide.base
            across = 1j * (at[h] - at[g]) / np.abs(at[h] - at[g])
            yield group.guide.link, group.pin, group.node, across
        if isinstance(group, SlottedLink):
            start = at[group.foot or group.pivot]
            along = group.side * (at[group.pin] - start) / np.abs(at[group.pin] - start)
            yield group.link, group.node, group.pin, along


@given(a_mechanism)
def test_what_slides_on_a_turning_guide_has_the_guides_motion_a_coriolis_and_a_sliding_part(mechanism):
    motion = move(mechanism)
    for link, under, over, along in slides(mechanism, motion):
        assert near(motion.position[under], motion.position[over], 4.0)
        sliding = motion.velocity[over] - motion.velocity[under]
        assert near(cross(along, sliding), 0.0, speed(motion))
        coriolis = 2j * motion.omega[link] * sliding
        rest = motion.acceleration[over] - motion.acceleration[under] - coriolis
        assert near(dot(along, coriolis), 0.0, acceleration(motion))
        assert near(cross(along, rest), 0.0, acceleration(motion))


@given(a_mechanism)
def test_the_guide_of_a_slotted_link_passes_its_pivot_at_the_offset(mechanism):
    motion = move(mechanism)
    for group in mechanism.groups:
        if isinstance(group, SlottedLink) and group.foot is not None:
            at = motion.position
            arm, aside = at[group.pin] - at[group.foot], at[group.foot] - at[group.pivot]
            assert near(dot(arm, aside), 0.0, 4.0)
            assert near(np.abs(aside), np.abs(group.offset_m), 4.0)
            assert near(cross(group.side * arm, aside), np.abs(arm) * group.offset_m, 4.0)


@given(a_mechanism, st.floats(-20, 20), st.floats(-20, 20))
def test_velocities_add_up_with_the_drivers_speed(mechanism, first, second):
    one, two, both = (move(driven(mechanism, rate, 0.0)) for rate in (first, second, first + second))
    size = speed(one) + speed(two) + 1e-9
    for joint in both.velocity:
        assert near(both.velocity[joint], one.velocity[joint] + two.velocity[joint], size)


@given(a_mechanism)
def test_accelerations_are_those_of_the_speed_plus_those_of_the_drivers_acceleration(mechanism):
    rate, growth = rates_of(mechanism)
    whole = move(mechanism)
    uniform = move(driven(mechanism, rate, 0.0))
    started = move(driven(mechanism, 0.0, growth))
    size = acceleration(uniform) + acceleration(started)
    for joint, a in whole.acceleration.items():
        assert near(a, uniform.acceleration[joint] + started.acceleration[joint], size)


BACKWARDS = -1.0


@given(a_mechanism, st.floats(0.1, 10.0) | st.just(BACKWARDS))
def test_at_another_speed_velocities_grow_once_and_accelerations_twice(mechanism, factor):
    rate, growth = rates_of(mechanism)
    slow, fast = move(mechanism), move(driven(mechanism, factor * rate, factor**2 * growth))
    for joint in slow.velocity:
        assert near(factor * slow.velocity[joint], fast.velocity[joint], speed(fast))
        assert near(factor**2 * slow.acceleration[joint], fast.acceleration[joint], acceleration(fast))


SIZES = [1e-6, 0.01, 1.0, 39.37, 1e5]
PLACES = [0j, 30 - 40j]


@given(a_mechanism, st.floats(-3.1, 3.1), st.booleans(), st.sampled_from(SIZES), st.sampled_from(PLACES))
def test_shifted_turned_mirrored_and_enlarged_mechanisms_move_alike(mechanism, angle, mirror, factor, shift):
    turn = np.exp(1j * angle)
    image, place = transformed(mechanism, turn, mirror=mirror, factor=factor, shift=shift * factor)
    motion, other = move(mechanism), move(image)

    def rate(z):
        return place(z) - shift * factor

    for joint in motion.position:
        assert near(place(motion.position[joint]), other.position[joint], 4.0 * factor)
        assert near(rate(motion.velocity[joint]), other.velocity[joint], speed(motion) * factor)
        assert near(
            rate(motion.acceleration[joint]), other.acceleration[joint], acceleration(motion) * factor
        )
    sign = -1 if mirror else 1
    for rates, images in ((motion.omega, other.omega), (motion.epsilon, other.epsilon)):
        scale = max((float(np.abs(rate)[0]) for rate in rates.values()), default=0.0)
        scale = max(scale, speed(motion), acceleration(motion))
        assert all(near(sign * rate, images[link], scale) for link, rate in rates.items())


@given(a_mechanism)
def test_velocities_and_accelerations_are_the_slopes_of_positions_and_velocities(mechanism):
    rate, growth = rates_of(mechanism)
    step = STEP / max(abs(rate), np.sqrt(abs(growth)), speed(move(mechanism)))
    at = {k: move(after(mechanism, k * step)) for k in (-2, -1, 0, 1, 2)}

    def slope(what, joint):
        early, late = (getattr(at[k], what)[joint] for k in (-1, 1))
        before, behind = (getattr(at[k], what)[joint] for k in (-2, 2))
        return (8 * (late - early) - (behind - before)) / (12 * step)

    now = at[0]
    moments = {joint for _, joint, _, _ in slides(mechanism, now)}
    moments |= {one.node for one in mechanism.groups if isinstance(one, Yoke) and moving_guides(one)}
    moments |= {one.assur_point for one in mechanism.groups if isinstance(one, Triad)}
    for joint in now.position.keys() - moments:
        assert near(slope("position", joint), now.velocity[joint], speed(now) + abs(rate), DIFFERENCE)
        size = acceleration(now) + rate**2 + abs(growth)
        assert near(slope("velocity", joint), now.acceleration[joint], size, DIFFERENCE)
