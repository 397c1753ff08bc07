"""A cycle: followed without jumps, through flat positions smoothly, to the very ends of its range."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from reference.authored.assignment import load_assignment
from reference.errors import CallError, MechanismError
from reference.geometry import direction
from reference.kinematics.cycle import Cycle, cycle
from reference.kinematics.motion import move
from reference.mechanism import (
    Crank,
    CrossSlider,
    DrivingSlider,
    Dyad,
    FixedGuide,
    Mechanism,
    MovingGuide,
    PointOnLine,
    Slider,
    SlotPoint,
    SlottedLink,
    Yoke,
    moving_guides,
)

ROUNDING = 1e-12
"""Relative, of what closed forms give far from singular positions."""
NEAR_FLAT = 1e-9
"""Relative, a degree from a flat position: a rounding error over its sine, squared."""
END_RAD = 1e-12


def one(value):
    return np.array([value])


def crank(length, angle_deg, omega=1.0):
    return Crank(
        "1", "O1", "A", one(length), one(np.radians(angle_deg)), one(omega), one(0.0), accelerated=False
    )


def four_bar(ground, lengths, angle_deg=40.0, side=1, omega=1.0):
    first, coupler, rocker = lengths
    dyad = Dyad("B", ("A", "O2"), ("2", "3"), (one(coupler), one(rocker)), side)
    return Mechanism({"O1": one(0j), "O2": one(ground + 0j)}, crank(first, angle_deg, omega), (dyad,))


def slider_crank(first, rod, angle_deg=40.0, offset=0.0, side=1):
    guide = FixedGuide(one(1j * offset), one(0.0))
    slider = Slider("B", "A", "2", one(rod), guide, side)
    return Mechanism({"O1": one(0j)}, crank(first, angle_deg), (slider,))


def whitworth(first, ground, angle_deg=40.0, offset=0.0):
    foot = "F" if offset else None
    slotted = SlottedLink("A3", "A", "O2", "3", one(offset), foot, 1)
    return Mechanism({"O1": one(0j), "O2": one(-1j * ground)}, crank(first, angle_deg), (slotted,))


def told(found: Cycle):
    """The samples at which something is told."""
    return np.array([index not in found.undetermined for index in range(found.driving.size)])


def moving_with_their_links(found: Cycle):
    """Joints that are material points: not those that name a link's point under a slider for an instant."""
    groups = found.mechanism.groups
    passing = {group.node for group in groups if isinstance(group, SlottedLink)}
    passing |= {guide.coincident for group in groups for guide in moving_guides(group)}
    return [joint for joint in found.motion.position if joint not in passing]


def assert_no_jump(found: Cycle):
    """Between told neighbours every joint goes on as its velocity says, up to its acceleration (Taylor)."""
    here = told(found)
    both = here[1:] & here[:-1]
    step = np.diff(found.driving) / found.mechanism.crank.omega[0]
    for joint in moving_with_their_links(found):
        place = found.motion.position[joint]
        v, a = found.motion.velocity[joint], found.motion.acceleration[joint]
        off = np.abs(np.diff(place) - 0.5 * step * (v[1:] + v[:-1]))[both]
        # The trapezium rule errs by a step squared times the change of acceleration, over twelve.
        bound = 0.5 * step[both] ** 2 * (np.abs(a[1:]) + np.abs(a[:-1]))[both]
        assert np.all(off <= bound + ROUNDING * (1.0 + np.nanmax(np.abs(place))))
        turn = np.abs(np.diff(v))[both]
        assert np.all(turn <= 4.0 * step[both] * np.maximum(np.abs(a[1:]), np.abs(a[:-1]))[both] + NEAR_FLAT)


@pytest.mark.parametrize("angle_deg", [1.0, 40.0, 100.0, 300.0, 359.0])
def test_the_coupler_of_a_parallelogram_never_turns(angle_deg):
    side = 1 if np.sin(np.radians(angle_deg)) < 0 else -1
    side = next(
        side
        for side in (side, -side)
        if abs(move(four_bar(3.0, (1.0, 3.0, 1.0), angle_deg, side)).omega["2"][0]) < ROUNDING
    )
    found = cycle(four_bar(3.0, (1.0, 3.0, 1.0), angle_deg, side))
    here = told(found)
    assert found.turns == 1
    assert list(found.undetermined) == [0, 180, 360]
    assert "in line" in found.undetermined[180]
    assert np.max(np.abs(found.motion.omega["2"][here])) < NEAR_FLAT
    assert np.max(np.abs(found.motion.omega["3"][here] - 1.0)) < NEAR_FLAT
    coupler = (found.motion.position["B"] - found.motion.position["A"])[here]
    assert np.max(np.abs(coupler - 3.0)) < NEAR_FLAT
    for rates in (found.motion.omega, found.motion.epsilon):
        assert all(np.isnan(rate[~here]).all() for rate in rates.values())


def test_an_antiparallelogram_stays_one():
    found = cycle(four_bar(3.0, (1.0, 3.0, 1.0), 40.0, 1))
    crossed = cycle(four_bar(3.0, (1.0, 3.0, 1.0), 40.0, -1))
    rates = [np.nanmax(one.motion.omega["2"]) for one in (found, crossed)]
    assert min(np.abs(rates)) < NEAR_FLAT
    assert max(np.abs(rates)) > 0.1
    assert_no_jump(found)
    assert_no_jump(crossed)


def test_a_kite_turns_its_rocker_once_in_two_turns():
    """Crank = ground = 1, coupler = rocker = 2: the axis of symmetry turns by half the crank's angle."""
    found = cycle(four_bar(1.0, (1.0, 2.0, 2.0), 70.0, 1), 721)
    here = told(found)
    phi = found.driving
    assert found.turns == 2
    assert phi[-1] == pytest.approx(4 * np.pi)
    assert list(found.undetermined) == [0, 360, 720]
    # B is on the axis, from O1 at distance cos(phi/2) + sqrt(4 - sin^2(phi/2)), or minus the root.
    axis = direction(phi / 2)
    roots = np.sqrt(4.0 - np.sin(phi / 2) ** 2)
    expected = [axis * (np.cos(phi / 2) + sign * roots) for sign in (1, -1)]
    off = min(np.max(np.abs(found.motion.position["B"] - place)[here]) for place in expected)
    assert off < NEAR_FLAT
    assert_no_jump(found)


def test_an_isosceles_slider_crank_passes_its_middle():
    found = cycle(slider_crank(1.0, 1.0, 20.0, side=1))
    here = told(found)
    assert list(found.undetermined) == [90, 270]
    assert np.max(np.abs(found.motion.position["B"] - 2.0 * np.cos(found.driving))[here]) < NEAR_FLAT
    assert np.max(np.abs(found.motion.velocity["B"] + 2.0 * np.sin(found.driving))[here]) < NEAR_FLAT
    assert found.turns == 1


def test_the_slotted_link_through_whose_pivot_the_pin_passes_turns_half_as_fast():
    found = cycle(whitworth(1.0, 1.0, 20.0), 721)
    here = told(found)
    assert found.turns == 2
    assert np.max(np.abs(found.motion.omega["3"][here] - 0.5)) < NEAR_FLAT
    assert np.max(np.abs(found.motion.epsilon["3"][here])) < 1e-6
    assert_no_jump(found)


def test_two_parallelograms_one_after_another_both_pass():
    first = four_bar(3.0, (1.0, 3.0, 1.0), 40.0, -1)
    coupler = move(first).omega["2"][0]
    first = first if abs(coupler) < ROUNDING else four_bar(3.0, (1.0, 3.0, 1.0), 40.0, 1)
    second = Dyad("C", ("B", "O3"), ("4", "5"), (one(3.0), one(1.0)), first.groups[0].side)
    chain = Mechanism({**first.ground_m, "O3": one(6.0 + 0j)}, first.driver, (*first.groups, second))
    found = cycle(chain)
    here = told(found)
    assert list(found.undetermined) == [0, 180, 360]
    for link, rate in (("2", 0.0), ("3", 1.0), ("4", 0.0), ("5", 1.0)):
        assert np.max(np.abs(found.motion.omega[link][here] - rate)) < 1e-6


@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-10])
def test_a_near_miss_of_a_flat_position_is_no_passage(gap):
    found = cycle(four_bar(3.0, (1.0, 3.0, 1.0 + gap), 40.0, 1))
    assert not found.following.events
    assert found.turns == 1


@pytest.mark.parametrize("gap", [1e-2, 1e-6, 1e-10])
def test_a_gap_ends_the_range_however_small(gap):
    found = cycle(four_bar(3.0 + gap, (1.0, 3.0, 1.0), 40.0, 1))
    low, high = found.following.low, found.following.high
    assert found.turns == 0
    # Cosine law at the stretched position: the distance of A and O2 is coupler + rocker.
    ground = 3.0 + gap
    # 2 sin^2(x/2) = 1 - cos x: without cancellation, from ground + 1 down to 4.
    sine = np.sqrt((ground + 1.0 - 4.0) * (ground + 1.0 + 4.0) / (4.0 * ground))
    assert high == pytest.approx(np.pi - 2.0 * np.arcsin(sine), abs=1e-9)
    assert low == pytest.approx(-high, abs=1e-9)


def test_the_pump_turns_as_far_as_its_links_reach():
    pump = load_assignment("pump")
    found = cycle(pump.mechanism([pump.variant(7)]))
    # A and O2 are 60 cos(phi/2) cm apart, and at least 40 - 30 = 10.
    limit = 2.0 * np.arccos(1.0 / 6.0)
    assert found.turns == 0
    assert [stop.node for stop in found.following.stops] == ["B", "B"]
    assert (found.following.low, found.following.high) == pytest.approx((-limit, limit), abs=END_RAD)


def test_a_range_ends_where_the_law_of_cosines_says():
    found = cycle(four_bar(2.0, (1.5, 1.2, 1.0), 70.0, 1))
    cosine = (1.5**2 + 2.0**2 - 2.2**2) / (2 * 1.5 * 2.0)
    assert found.following.high == pytest.approx(np.arccos(cosine), abs=END_RAD)
    least = (1.5**2 + 2.0**2 - 0.2**2) / (2 * 1.5 * 2.0)
    assert least > 1.0 or found.following.low == pytest.approx(np.arccos(least), abs=END_RAD)
    assert np.isnan(found.motion.velocity["B"][[0, -1]]).all()
    assert np.isfinite(found.motion.velocity["B"][1:-1]).all()
    move(found.following.at(one(found.following.high - 1e-6)))
    with pytest.raises(MechanismError):
        move(found.following.at(one(found.following.high + 1e-9)))


def test_another_range_is_told():
    """A four-bar whose rocker binds on both sides: above the ground, and below it."""
    found = cycle(four_bar(2.0, (1.5, 1.2, 0.3), 35.0, 1))
    assert found.turns == 0
    (other,) = found.elsewhere
    assert other[0] == pytest.approx(2 * np.pi - found.following.high, abs=END_RAD)
    assert other[1] == pytest.approx(2 * np.pi - found.following.low, abs=END_RAD)


@pytest.mark.parametrize("angle_deg", [-700.0, -10.0, 10.0, 350.0, 3610.0])
def test_a_range_is_told_about_the_first_turn_whichever_turn_the_variant_is_in(angle_deg):
    found = cycle(four_bar(2.0, (1.5, 1.2, 1.0), angle_deg, 1))
    assert found.following.low == pytest.approx(-found.following.high, abs=1e-9)
    assert found.start == pytest.approx(np.radians((angle_deg + 180.0) % 360.0 - 180.0))


def test_a_driving_slider_goes_as_far_as_rod_and_crank_reach():
    driver = DrivingSlider("1", "B", one(0j), one(0.0), one(2.5), one(0.5), one(0.0))
    dyad = Dyad("A", ("B", "O"), ("2", "3"), (one(2.0), one(1.0)), 1)
    found = cycle(Mechanism({"O": one(0j)}, driver, (dyad,)), 101)
    assert (found.driving[0], found.driving[-1]) == pytest.approx((1.0, 3.0), abs=1e-12)
    assert not found.is_turned
    assert found.elsewhere[0] == pytest.approx((-3.0, -1.0), abs=1e-12)


def driving(*groups, at=0.3, **ground):
    """A slider B that drives along the x axis at 0.5 m/s."""
    driver = DrivingSlider("1", "B", one(0j), one(0.0), one(at), one(0.5), one(0.0))
    return Mechanism({name: one(place) for name, place in ground.items()}, driver, groups)


def test_a_trammel_goes_from_end_to_end_of_its_rod():
    """Both ends of a rod on crossed guides: x^2 + y^2 = l^2."""
    upright = FixedGuide(one(0j), one(np.pi / 2))
    found = cycle(driving(Slider("D", "B", "2", one(1.0), upright, 1)), 101)
    x = found.driving
    assert (x[0], x[-1]) == pytest.approx((-1.0, 1.0), abs=END_RAD)
    middle = slice(1, -1)
    assert found.motion.position["D"][middle] == pytest.approx(1j * np.sqrt(1 - x[middle] ** 2), abs=1e-9)
    speed = -0.5 * x[middle] / np.sqrt(1 - x[middle] ** 2)
    assert found.motion.velocity["D"][middle].imag == pytest.approx(speed, abs=1e-9)


def test_a_driving_slider_that_nothing_stops_is_followed_some_way():
    slotted = SlottedLink("B3", "B", "O2", "3", one(0.0), None, 1)
    found = cycle(driving(slotted, O2=-1j), 101)
    assert found.following.stops == (None, None)
    assert found.elsewhere == ()
    assert found.driving[0] < found.start < found.driving[-1]
    assert found.motion.omega["3"] == pytest.approx(-0.5 / (1.0 + found.driving**2), abs=1e-12)
    yoke = Yoke("D", "B", one(1.0), FixedGuide(one(0j), one(0.5)))
    assert cycle(driving(yoke), 5).following.stops == (None, None)
    alone = cycle(driving(at=0.0), 5)
    assert alone.driving == pytest.approx([-1.0, -0.5, 0.0, 0.5, 1.0])


def test_crossed_guides_of_a_driving_slider():
    """The crossing of a line through the driving slider and a pivot with an upright guide: y = 1 - 1 / x."""
    rod = SlottedLink("B3", "B", "O2", "3", one(0.0), None, 1)
    guides = (FixedGuide(one(1.0 + 0j), one(np.pi / 2)), MovingGuide("3", ("O2", "B3"), "D3"))
    found = cycle(driving(rod, CrossSlider("D", guides), at=2.0, O2=1j), 101)
    assert found.following.low == pytest.approx(0.0, abs=1e-9)
    assert found.motion.position["D"][1:].imag == pytest.approx(1.0 - 1.0 / found.driving[1:], rel=1e-9)


def test_samples_very_near_a_flat_position_are_right_or_untold():
    """Two parallelograms whose ground is turned by a hundred-millionth of a radian."""
    off = 1e-8
    turned = np.exp(1j * off)
    side = 1 if abs(move(four_bar(3.0, (1.0, 3.0, 1.0), 40.0, 1)).omega["2"][0]) < ROUNDING else -1
    pins = [("A", "O2", "B", "2", "3"), ("B", "O3", "C", "4", "5")]
    groups = tuple(
        Dyad(node, (pin, pivot), (coupler, rocker), (one(3.0), one(1.0)), side)
        for pin, pivot, node, coupler, rocker in pins
    )
    ground = {"O1": one(0j), "O2": one(3.0 * turned), "O3": one(6.0 * turned)}
    found = cycle(Mechanism(ground, crank(1.0, 40.0), groups))
    assert [round(np.degrees(event.at)) for event in found.passed] == [0, 0, 180, 180]
    here = told(found)
    for link in ("3", "5"):
        assert np.max(np.abs(found.motion.omega[link][here] - 1.0)) < 1e-4
    assert all("determined" in reason or "in line" in reason for reason in found.undetermined.values())


def test_guides_that_become_parallel_end_the_range():
    """A line carried by the crank against a fixed upright one: x = tan(phi), infinite at 90 degrees."""
    guides = (FixedGuide(one(1.0 + 0j), one(np.pi / 2)), MovingGuide("1", ("O1", "A"), "D1"))
    found = cycle(Mechanism({"O1": one(0j)}, crank(0.4, 30.0), (CrossSlider("D", guides),)))
    assert found.turns == 0
    assert (found.following.low, found.following.high) == pytest.approx((-np.pi / 2, np.pi / 2), abs=END_RAD)
    assert "parallel" in found.following.stops[1].why
    middle = slice(1, -1)
    assert found.motion.position["D"][middle].imag == pytest.approx(np.tan(found.driving[middle]), rel=1e-9)


def test_guides_that_become_parallel_and_part_again_end_the_range_as_well():
    """A rocking slotted link against a fixed guide along its extreme position, 30 degrees from upright."""
    rocking = whitworth(0.5, 1.0)
    guides = (FixedGuide(one(1.0 + 0j), one(np.pi / 3)), MovingGuide("3", ("O2", "A3"), "D3"))
    found = cycle(replace(rocking, groups=(*rocking.groups, CrossSlider("D", guides))))
    assert found.turns == 0
    assert (found.following.low, found.following.high) == pytest.approx(
        (-np.pi / 6, 11 * np.pi / 6), abs=1e-6
    )


def test_what_comes_to_rest_in_its_flat_position_goes_back_on_its_own_side():
    """A pin that stops at its slotted link's pivot, and turns back: the link never moves."""
    yoke = Yoke("B", "A", one(np.pi / 2), FixedGuide(one(0j), one(0.0)))
    slotted = SlottedLink("B3", "B", "O2", "3", one(0.0), None, 1)
    point = SlotPoint("D", "B3", "3", one(0.5 + 0j))
    ground = {"O1": one(0j), "O2": one(1.0 + 0j)}
    found = cycle(Mechanism(ground, crank(1.0, 40.0), (yoke, slotted, point)))
    assert found.turns == 1
    here = told(found)
    assert np.max(np.abs(found.motion.position["D"][here] - 0.5)) < NEAR_FLAT
    assert not here[0]


def test_a_yoke_moves_harmonically():
    yoke = Yoke("B", "A", one(np.pi / 2), FixedGuide(one(0j), one(0.0)))
    found = cycle(Mechanism({"O1": one(0j)}, crank(0.3, 10.0, 2.0), (yoke,)))
    assert found.motion.velocity["B"].real == pytest.approx(-0.6 * np.sin(found.driving), abs=1e-12)
    assert not found.undetermined


def test_a_link_on_a_moving_guide_passes_as_on_a_fixed_one():
    """An isosceles slider-crank whose guide is a line of a link that turns with the parallelogram."""
    parallelogram = four_bar(3.0, (1.0, 3.0, 1.0), 40.0, -1)
    if abs(move(parallelogram).omega["2"][0]) > ROUNDING:
        parallelogram = four_bar(3.0, (1.0, 3.0, 1.0), 40.0, 1)
    slider = Slider("D", "O1", "4", one(2.0), MovingGuide("2", ("A", "B"), "D2"), 1)
    groups = (*parallelogram.groups, slider)
    found = cycle(replace(parallelogram, groups=groups))
    here = told(found)
    # The guide stays level at the height sin(phi); the rod of 2 from O1 reaches x = sqrt(4 - sin^2).
    expected = np.sqrt(4.0 - np.sin(found.driving) ** 2) + 1j * np.sin(found.driving)
    assert np.max(np.abs(found.motion.position["D"] - expected)[here]) < NEAR_FLAT


@pytest.mark.parametrize("name", ["press", "engine", "shaper"])
def test_the_built_in_mechanisms_turn_fully_and_without_jumps(name):
    assignment = load_assignment(name)
    found = cycle(assignment.mechanism(assignment.variants()[:1]))
    assert found.turns == 1
    assert not found.undetermined
    assert not found.following.events
    assert_no_jump(found)


def test_the_variants_own_position_is_on_the_cycle():
    press = load_assignment("press")
    mechanism = press.mechanism([press.variant(None, 3)])
    found, alone = cycle(mechanism), move(mechanism)
    index = round(np.degrees(found.start))
    for joint, velocity in alone.velocity.items():
        assert found.motion.velocity[joint][index] == pytest.approx(velocity[0], abs=1e-12)
        assert found.motion.acceleration[joint][index] == pytest.approx(
            alone.acceleration[joint][0], abs=1e-11
        )


lengths = st.integers(200, 3000).map(lambda thousandths: thousandths / 1000)
angles = st.integers(0, 359)
sides = st.sampled_from([-1, 1])


@given(ground=lengths, bars=st.tuples(lengths, lengths, lengths), angle_deg=angles, side=sides)
def test_four_bars_are_followed_without_jumps(ground, bars, angle_deg, side):
    mechanism = four_bar(ground, bars, angle_deg, side)
    check_following(mechanism)


few = st.sampled_from([1.0, 2.0, 3.0, 4.0])


@given(ground=few, bars=st.tuples(few, few, few), angle_deg=angles, side=sides)
def test_flat_positions_of_four_bars_with_whole_lengths_are_passed_without_jumps(
    ground, bars, angle_deg, side
):
    """With whole lengths many sums are equal: kites, parallelograms, and those flat once in a turn."""
    mechanism = four_bar(ground, bars, angle_deg, side)
    try:
        move(mechanism)
    except MechanismError:
        return
    found = cycle(mechanism, 721)
    if found.turns:
        assert_no_jump(found)


@given(first=lengths, rod=lengths, offset=lengths, angle_deg=angles, side=sides)
def test_slider_cranks_are_followed_without_jumps(first, rod, offset, angle_deg, side):
    check_following(slider_crank(first, rod, angle_deg, offset - 1.6, side))


@given(first=lengths, ground=lengths, offset=st.sampled_from([0.0, 0.1, -0.3]), angle_deg=angles)
def test_slotted_links_are_followed_without_jumps(first, ground, offset, angle_deg):
    check_following(whitworth(first, ground, angle_deg, offset))


@given(bars=st.tuples(lengths, lengths, lengths), ground=lengths, rod=lengths, ratio=lengths)
def test_six_bars_are_followed_without_jumps(bars, ground, rod, ratio):
    first = four_bar(ground, bars)
    point = PointOnLine("C", ("O2", "B"), "3", one(ratio))
    slider = Slider("D", "C", "4", one(rod), FixedGuide(one(-0.4j), one(0.3)), 1)
    check_following(replace(first, groups=(*first.groups, point, slider)))


def check_following(mechanism):
    """Followed as it moves: integrating the velocities from one sample to the next gives the next."""
    try:
        move(mechanism)
    except MechanismError:
        return
    found = cycle(mechanism, 721)
    following, here = found.following, told(found)
    assert following.low <= found.start <= following.high
    # Close to singular positions the accelerations change within a step: bounded away from them.
    sine = np.min([np.broadcast_to(s, here.shape) for s in found.motion.transmission.values()], axis=0)
    for node in moving_with_their_links(found):
        place = found.motion.position[node]
        v, a = found.motion.velocity[node], found.motion.acceleration[node]
        calm = (sine > 0.2) & here
        both = calm[1:] & calm[:-1]
        step = np.diff(found.driving)
        off = np.abs(np.diff(place) - 0.5 * step * (v[1:] + v[:-1]))[both]
        bound = step**2 * np.maximum(np.abs(a[1:]), np.abs(a[:-1]))
        assert np.all(off <= bound[both] + ROUNDING * (1.0 + np.nanmax(np.abs(place))))


@pytest.mark.parametrize("samples", [-1, 0, 2, 1_000_000])
def test_too_few_and_too_many_samples_are_refused(samples):
    with pytest.raises(CallError, match="samples"):
        cycle(four_bar(3.0, (1.0, 3.0, 2.0)), samples)


def test_a_variant_without_a_motion_is_refused_as_ever():
    with pytest.raises(MechanismError, match="does not assemble"):
        cycle(four_bar(3.0, (0.1, 1.0, 1.0)))
    with pytest.raises(MechanismError, match="not determined"):
        cycle(four_bar(3.0, (1.0, 3.0, 1.0), 180.0))


def test_a_pin_exactly_on_its_links_pivot_is_refused_in_words():
    slotted = SlottedLink("A3", "A", "O2", "3", one(0.0), None, 1)
    mechanism = Mechanism({"O1": one(0j), "O2": one(1.0 + 0j)}, crank(1.0, 0.0), (slotted,))
    with pytest.raises(MechanismError, match="the pin is at the link's pivot"):
        cycle(mechanism)
