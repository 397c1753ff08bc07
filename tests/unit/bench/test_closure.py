"""The 50-digit road: it keeps its own laws, and the closed forms agree with it for every group."""

import tomllib
from dataclasses import replace
from types import SimpleNamespace
from typing import get_args

import numpy as np
import pytest
from mpmath import mp, mpf

from reference.assembly import build_mechanism
from reference.assignment import Variant, load_assignment
from reference.authored import validate
from reference.construction import Vector, evaluate
from reference.derivation import construction_of
from reference.mechanism import Crank, Dyad, FixedGuide, Group, Mechanism, MovingGuide, Slider
from reference.mechanism_file import MechanismFile
from reference.motion import move
from reference.parameters import parameters_of
from reference.plan import _measured
from tests.bench.closure import ExactMotion, _solve, exact_motion, exact_motion_of, rounded, turning
from tests.bench.exact_data import DIGITS, authored_exactly, exactly
from tests.bench.jets import Jet, dot, fixed, follow
from tests.bench.singular import KINDS

FAR = 0.1
"""A distance from the singular position at which nothing is lost."""
SHARE_OF_PLAN = 1e-11
DATA_ROUNDING = 1e-13
"""What the roundings of the data move, relative to the largest, away from singular positions."""
STEP_S = mpf(10) ** -12
DIFFERENCE = mpf(10) ** -15
"""What central differences of second order leave at that step, relative."""


ALL_GROUPS = """
schema_version = 1
id = "all"
length_unit = "cm"
[title]
en = "All groups"
[ground]
O1 = [0, 0]
O2 = [110.1, 0.7]
O3 = [40.3, -10.9]
[crank]
link = "1"
pivot = "O1"
pin = "A"
length = 30.3
angle_deg = 40.1
rpm = 1350
gear_ratio = 23.5
epsilon = -2.7
[[group]]
type = "RRR"
node = "B"
pins = ["A", "O2"]
lengths = [90.7, 80.9]
links = ["2", "3"]
side = "left"
[[group]]
type = "plate"
node = "C"
base = ["A", "B"]
link = "2"
lengths = [35.7, 70.1]
side = "right"
[[group]]
type = "point"
node = "P"
base = ["A", "B"]
link = "2"
at = [20.3, -7.7]
[[group]]
type = "point_on_line"
node = "Q"
base = ["A", "B"]
link = "2"
ratio = 0.3
[[group]]
type = "RRP"
node = "D"
pin = "O3"
link = "4"
length = 60.7
guide = { joints = ["A", "B"], coincident = "D2" }
side = "ahead"
[[group]]
type = "RPR"
node = "C5"
pin = "C"
pivot = "O3"
link = "5"
offset = 1.1
foot = "F"
[[group]]
type = "point"
node = "S"
base = ["O3", "C5"]
link = "5"
at = [33.3, 4.1]
[[group]]
type = "PRP"
node = "X"
guides = [{ joints = ["O1", "A"], coincident = "X1" }, { through = [70.1, 0], angle_deg = 80.3 }]
[[group]]
type = "RPP"
node = "Y"
pin = "P"
slot_deg = 80.7
guide = { through = [3.3, -20.1], angle_deg = 5.3 }
"""


def far(kind):
    return kind.draw(np.random.default_rng(3), FAR).mechanism


def one(*numbers):
    return [np.array([number]) for number in numbers]


def inverted_slider():
    """A rod whose slider runs on the coupler of a four-bar: a guide on a moving link."""
    crank = Crank("1", "O1", "A", *one(0.3, 0.7, 4.0, -9.0), accelerated=True)
    dyad = Dyad("B", ("A", "O2"), ("2", "3"), tuple(one(0.9, 0.8)), 1)
    guide = MovingGuide("2", ("A", "B"), "D2")
    slider = Slider("D", "O3", "4", np.array([0.6]), guide, 1)
    places = dict(zip(("O1", "O2", "O3"), one(0j, 1.1 + 0j, 0.4 - 0.1j), strict=True))
    return Mechanism(places, crank, (dyad, slider))


MECHANISMS = {kind.id: far(kind) for kind in KINDS} | {"moving_guide": inverted_slider()}


def at_time(mechanism: Mechanism, seconds) -> ExactMotion:
    data = exactly(mechanism, 0)
    crank = data.driver
    angle = crank.angle_rad + crank.omega * seconds + crank.epsilon * seconds**2 / 2
    return _solve(replace(data, driver=replace(crank, angle_rad=angle)))


@pytest.mark.parametrize("name", MECHANISMS)
def test_velocity_and_acceleration_are_differences_of_positions_in_time(name):
    mechanism = MECHANISMS[name]
    coincident = {"A3", "B1", "D2"}  # another point of the link lies there at each instant
    with mp.workdps(DIGITS):
        before, now, after = (at_time(mechanism, step * STEP_S) for step in (-1, 0, 1))
        largest = max(mp.hypot(*rates) for rates in now.acceleration.values())
        for joint in now.position.keys() - coincident:
            for axis in (0, 1):
                x0, x1, x2 = (motion.position[joint][axis] for motion in (before, now, after))
                fastest = max(mp.hypot(*rates) for rates in now.velocity.values())
                assert abs((x2 - x0) / (2 * STEP_S) - now.velocity[joint][axis]) <= DIFFERENCE * fastest
                assert (
                    abs((x2 - 2 * x1 + x0) / STEP_S**2 - now.acceleration[joint][axis])
                    <= DIFFERENCE * largest
                )


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_closed_form_agrees_with_the_closure_equations(name):
    mechanism = MECHANISMS[name]
    motion, truth = move(mechanism), exact_motion_of(mechanism)
    for found, exact in (
        (motion.position, truth.position),
        (motion.velocity, truth.velocity),
        (motion.acceleration, truth.acceleration),
    ):
        assert found.keys() == exact.keys()
        size = max(abs(rounded(pair)) for pair in exact.values())
        assert (
            max(abs(found[joint][0] - rounded(pair)) for joint, pair in exact.items()) <= SHARE_OF_PLAN * size
        )


def test_a_point_on_a_moving_guide_slides_along_it_and_coriolis_is_across():
    motion = exact_motion_of(inverted_slider())
    about = {part: motion.vector(Vector(f"a_DD2_{part}", "", "", "ka", ("D2", "D"), part)) for part in "cr"}
    guide = complex(*map(float, (motion.points["B"] - motion.points["A"]).place))
    whole = rounded(motion.acceleration["D"]) - rounded(motion.acceleration["D2"])
    assert about["c"] + about["r"] == pytest.approx(whole, rel=1e-12)
    assert (about["r"] / guide).imag == pytest.approx(0.0, abs=1e-12 * abs(about["r"] / guide))
    assert (about["c"] / guide).real == pytest.approx(0.0, abs=1e-12 * abs(about["c"] / guide))


def test_decimals_of_the_file_are_read_as_written_not_as_doubles():
    press = load_assignment("press")
    with mp.workdps(DIGITS):
        data = authored_exactly(press, press.variant(None, 1))
        assert data.driver.length_m == mpf(3) / 10
        assert data.driver.omega == mp.pi * 1350 / (30 * mpf("23.5"))


def test_the_two_ways_of_taking_data_differ_by_the_roundings_of_the_data_only():
    shaper = load_assignment("shaper")
    written, doubles = (
        exact_motion(shaper, shaper.variant(7)),
        exact_motion_of(shaper.mechanism([shaper.variant(7)])),
    )
    largest = max(abs(rounded(pair)) for pair in written.acceleration.values())
    apart = {
        abs(rounded(pair) - rounded(doubles.acceleration[joint]))
        for joint, pair in written.acceleration.items()
    }
    assert max(apart) <= 1e-14 * largest


def test_every_group_of_an_authored_file_is_read_in_decimal():
    file = validate(MechanismFile, tomllib.loads(ALL_GROUPS), "all.toml")
    mechanism = build_mechanism(file, {}, 1)
    assert {type(group) for group in mechanism.groups} == set(get_args(Group))
    assignment = SimpleNamespace(
        mechanism_file=file,
        mechanism=lambda _: mechanism,
        file=SimpleNamespace(variant=SimpleNamespace(values={})),
    )
    written, doubles = exact_motion(assignment, Variant(None, None)), exact_motion_of(mechanism)
    for exact, rounded_data in (
        (written.position, doubles.position),
        (written.velocity, doubles.velocity),
        (written.acceleration, doubles.acceleration),
    ):
        assert exact.keys() == rounded_data.keys()
        largest = max(abs(rounded(pair)) for pair in exact.values())
        apart = [abs(rounded(pair) - rounded(rounded_data[joint])) for joint, pair in exact.items()]
        assert 0.0 < max(apart) <= DATA_ROUNDING * largest


def test_every_vector_of_a_construction_of_all_groups_agrees_with_fifty_digits():
    mechanism = build_mechanism(validate(MechanismFile, tomllib.loads(ALL_GROUPS), "all.toml"), {}, 1)
    construction, scale = construction_of(mechanism), np.array([0.01])
    measured = _measured(construction, move(mechanism))
    nodes = evaluate(construction, {**measured, **parameters_of(mechanism, scale, scale, scale)})
    truth = exact_motion_of(mechanism)
    for figure in construction.poles:
        vectors = construction.vectors_of(figure)
        exact = np.array([truth.vector(vector) for vector in vectors])
        drawn = np.array([(nodes[vector.head] - nodes[vector.tail])[0] * scale[0] for vector in vectors])
        assert np.max(np.abs(drawn - exact)) <= SHARE_OF_PLAN * np.max(np.abs(exact))
    assert {vector.part for vector in construction.vectors.values()} == {"", "n", "t", "c", "r"}


def test_what_does_not_assemble_is_an_arithmetic_error():
    crank = Crank("1", "O1", "A", *one(0.3, 0.7, 4.0, 0.0), accelerated=True)
    guide = FixedGuide(np.array([2.0j]), np.array([0.0]))
    far_off = Mechanism({"O1": np.array([0j])}, crank, (Slider("B", "A", "2", np.array([0.5]), guide, 1),))
    with pytest.raises(ArithmeticError, match="does not assemble"):
        exact_motion_of(far_off)


def test_newtons_method_that_finds_no_root_says_so():
    def never(point):
        return dot(point, point) + Jet(mpf(1)), point.x

    with pytest.raises(ArithmeticError, match="converge"):
        follow(never, (mpf("0.3"), mpf("0.2")), mpf(1))


def test_a_vector_fixed_in_a_link_tells_how_it_turns():
    motion = exact_motion_of(inverted_slider())
    crank = inverted_slider().crank
    omega, epsilon = turning(motion.points["A"] - motion.points["O1"])
    assert float(omega) == pytest.approx(crank.omega[0])
    assert float(epsilon) == pytest.approx(crank.epsilon[0])
    assert turning(fixed((mpf(1), mpf(2)))) == (0, 0)
