"""Motion of many variants: those without one stand out by name and number, the others are untouched."""

import re
from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.errors import MechanismError
from reference.kinematics.motion import EPSILON, move, move_where_possible
from reference.mechanism import (
    Crank,
    CrossSlider,
    Dyad,
    FixedGuide,
    Mechanism,
    MovingGuide,
    Plate,
    PointOnLine,
    Slider,
    SlottedLink,
    Yoke,
    translated,
)

HALF_TURN = np.pi
FAR_OFF = 1e-8
"""A thousand kilometres away, places themselves are rounded to 1e-10 m, and links are 0.1 m long."""


def array(*values):
    return np.array(values)


def crank(*angles, **data) -> Crank:
    told = {"length_m": array(1.0), "omega": array(2.0), "epsilon": array(0.0), "accelerated": False}
    return Crank(link="1", pivot="O1", pin="A", angle_rad=array(*angles), **{**told, **data})


def mechanism(*groups, angles=(0.0,), o2=3 + 0j) -> Mechanism:
    return Mechanism({"O1": array(0j), "O2": array(o2)}, crank(*angles), groups)


def dyad(first, second) -> Dyad:
    return Dyad("B", ("A", "O2"), ("3", "2"), (array(first), array(second)), 1)


def rod(length, guide_y) -> Slider:
    return Slider("B", "A", "3", array(length), FixedGuide(array(guide_y * 1j), array(0.0)), 1)


FLAT_SLOT = MovingGuide("1", ("O1", "A"), "C1")
CASES = [
    (dyad(1.0, 0.5), "does_not_assemble", r"group of B .* miss each other by 0\.5 m"),
    (dyad(4.0, 1.5), "does_not_assemble", r"group of B .* miss each other by 0\.5 m"),
    (dyad(1.5, 0.5), "singular", "group of B .* its links are in line"),
    (rod(0.5, -2.0), "does_not_assemble", r"group of B .* miss each other by 1\.5 m"),
    (rod(2.0, -2.0), "singular", "group of B .* its rod is perpendicular to the guide"),
    (
        SlottedLink("A3", "A", "O2", "3", array(2.5), "F", 1),
        "does_not_assemble",
        r"group of A3 .* miss each other by 0\.5 m",
    ),
    (SlottedLink("A3", "A", "O2", "3", array(2.0), "F", 1), "singular", "group of A3 .* as near to it"),
    (
        CrossSlider("C", (FLAT_SLOT, FixedGuide(array(1j), array(0.0)))),
        "singular",
        "group of C .* its guides are parallel",
    ),
    (
        Yoke("C", "A", array(0.5), FixedGuide(array(0j), array(0.5))),
        "singular",
        "group of C .* slot and guide are parallel.* give slot and guide two directions",
    ),
]


@pytest.mark.parametrize(("group", "code", "words"), CASES)
@pytest.mark.parametrize("angles", [(0.0,), (0.0, 0.0, 0.0, 0.0, 0.0)])
def test_what_has_no_motion_is_refused_with_its_group_the_reason_and_the_gap(group, code, words, angles):
    with pytest.raises(MechanismError, match=words) as error:
        move(mechanism(group, angles=angles))
    assert (error.value.code, error.value.group) == (code, group.node)
    gap = re.search(r"each other by (\S+) m", error.value.message)
    assert error.value.gap_m == (pytest.approx(float(gap[1])) if gap else None)


def test_a_pin_at_the_pivot_of_its_slotted_link_is_refused():
    group = SlottedLink("A3", "A", "O2", "3", array(0.0), None, 1)
    with pytest.raises(MechanismError, match="the pin is at the link's pivot"):
        move(mechanism(group, o2=1 + 0j))


@pytest.mark.parametrize("count", [2, 3, 6])
def test_one_variant_without_a_motion_leaves_the_others_as_they_are(count):
    angles = np.linspace(0.4, 1.0, count)
    angles[1] = HALF_TURN
    whole = mechanism(dyad(1.5, 2.0), angles=tuple(angles))
    motion = move_where_possible(whole)
    broken = np.arange(count) == 1
    np.testing.assert_array_equal(np.isinf(motion.predicted_error), broken)
    for rates in (motion.velocity, motion.acceleration, motion.omega, motion.epsilon):
        for values in rates.values():
            np.testing.assert_array_equal(np.isnan(values), broken)
    alone = move(mechanism(dyad(1.5, 2.0), angles=(angles[0],)))
    np.testing.assert_allclose(motion.velocity["B"][0], alone.velocity["B"][0], rtol=1e-13)
    with pytest.raises(MechanismError, match=rf"\(1 of {count} variant\(s\), the first at index 1\)"):
        move(whole)


def test_near_a_singular_position_digits_are_won_back_and_that_is_told():
    near = mechanism(dyad(1.5, 0.5 + 1e-13))
    motion = move(near)
    assert motion.recomputed[0]
    assert motion.predicted_error[0] <= 2 * EPSILON
    assert motion.transmission["B"][0] < 1e-6
    assert not move(mechanism(dyad(1.5, 1.5))).recomputed[0]


def test_the_group_that_fails_is_named_not_one_that_stands_on_it():
    end = PointOnLine("E", ("A", "B"), "3", array(2.0))
    with pytest.raises(MechanismError, match="group of B does not assemble"):
        move(mechanism(dyad(1.0, 0.5), end))


def test_a_mechanism_far_from_the_origin_moves_as_exactly_as_at_home():
    assignment = load_assignment("shaper")
    at_home = assignment.mechanism(assignment.variants())
    far = move(translated(at_home, np.full(30, 2.0**20 + 2.0**20 * 1j)))
    near = move(at_home)
    for joint, velocity in near.velocity.items():
        assert np.all(np.abs(far.velocity[joint] - velocity) <= FAR_OFF * np.max(np.abs(velocity)))


def test_arrays_of_more_variants_than_the_driver_has_are_told():
    assignment = load_assignment("pump")
    one = assignment.mechanism(assignment.variants()[:1])
    many = assignment.mechanism(assignment.variants())
    with pytest.raises(ValueError, match="30 variants in a mechanism whose driver has 1"):
        move(replace(one, groups=many.groups))


def test_a_velocity_near_a_singular_position_is_as_exact_without_accelerations():
    near = mechanism(dyad(1.5, 0.5 + 1e-13))
    alone, whole = move(near, accelerations=False), move(near)
    assert alone.recomputed[0]
    np.testing.assert_array_equal(alone.velocity["B"], whole.velocity["B"])


def test_links_that_meet_in_doubles_alone_do_not_assemble():
    angle, apart = 1.9583015186258488, 0
    reach = abs(3 - np.exp(1j * angle))
    for first in np.linspace(0.3, 0.9, 60) * reach:
        links = dyad(first, np.nextafter(reach - first, 0.0))
        motion = move_where_possible(mechanism(links, angles=(angle,)))
        is_solved = np.isfinite(motion.velocity["B"][0])
        assert is_solved == np.isfinite(motion.predicted_error[0])
        apart += not is_solved
    assert apart


def test_pins_that_only_rounding_tells_apart_are_refused():
    ratios = {"B": ("A", 3.0), "C": ("B", 5.0), "D": ("A", 15.0)}
    points = [PointOnLine(node, ("O1", on), "1", array(ratio)) for node, (on, ratio) in ratios.items()]
    assert 5.0 * (3.0 * 0.1) != 15.0 * 0.1
    twice = Dyad("E", ("C", "D"), ("4", "5"), (array(0.05), array(0.05)), 1)
    short = replace(mechanism(*points, twice), driver=crank(0.0, length_m=array(0.1)))
    with pytest.raises(MechanismError) as error:
        move(short)
    assert error.value.group == "E"


def test_near_a_singular_position_a_point_lies_by_its_coordinates_not_by_their_rounded_ratio():
    local, rounded = array(0.3 + 0.4j), array((0.3 + 0.4j) / 1.5 * (1.0 + 1e-9))
    plate = Plate("C", ("A", "B"), "3", (array(0.5), array(1.3)), 1, rounded, local)
    motion = move(mechanism(dyad(1.5, 0.5 + 1e-13), plate))
    a, b, c = (motion.position[joint][0] for joint in "ABC")
    assert motion.recomputed[0]
    assert abs((c - a) * abs(b - a) / (b - a) - local[0]) <= 4 * EPSILON
