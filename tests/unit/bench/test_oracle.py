"""The oracle: it has the textbook's values, and the closed form agrees with it for every group."""

from typing import get_args

import numpy as np
import pytest
from mpmath import mp, mpc

from reference.construction.derive import construction_of
from reference.construction.graph import Vector, evaluate, parameters_of
from reference.kinematics.motion import move
from reference.mechanism import Crank, Dyad, FixedGuide, Group, Mechanism, MovingGuide, Slider, Triad
from reference.plan import _measured
from tests import every_group
from tests.bench.oracle import DIGITS, ExactMotion, _root
from tests.bench.singular import KINDS

FAR = 0.1
"""A distance from the singular position at which nothing is lost."""
SHARE_OF_PLAN = 1e-11
ROUNDING = 1e-50
"""Metres, m/s, m/s^2: what is promised of numbers near 1."""


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


@pytest.mark.parametrize("name", MECHANISMS)
def test_the_closed_form_agrees_with_the_closure_equations(name):
    mechanism = MECHANISMS[name]
    motion, truth = move(mechanism), ExactMotion(mechanism)
    for ours, exact in (
        (motion.position, truth.position),
        (motion.velocity, truth.velocity),
        (motion.acceleration, truth.acceleration),
    ):
        assert ours.keys() == exact.keys()
        size = max(map(abs, exact.values()))
        assert max(abs(ours[joint][0] - complex(z)) for joint, z in exact.items()) <= SHARE_OF_PLAN * size


def test_a_slider_crank_moves_as_its_textbook_formula_differentiated_by_hand():
    crank = Crank("1", "O1", "A", *one(0.3, 0.7, 4.0, 0.0), accelerated=True)
    guide = FixedGuide(np.array([0j]), np.array([0.0]))
    mechanism = Mechanism({"O1": np.array([0j])}, crank, (Slider("B", "A", "2", np.array([0.9]), guide, 1),))
    motion = ExactMotion(mechanism)
    with mp.workdps(DIGITS):
        r, rod, angle, omega = (mp.mpmathify(number) for number in (0.3, 0.9, 0.7, 4.0))
        sine, cosine = mp.sin(angle), mp.cos(angle)
        across = mp.sqrt(rod**2 - (r * sine) ** 2)
        slope = -(r**2) * sine * cosine / across
        bend = -(r**2) * (cosine**2 - sine**2) / across - slope**2 / across
        assert abs(motion.position["B"] - (r * cosine + across)) < ROUNDING
        assert abs(motion.velocity["B"] - omega * (slope - r * sine)) < ROUNDING
        assert abs(motion.acceleration["B"] - omega**2 * (bend - r * cosine)) < ROUNDING


def test_a_point_on_a_moving_guide_slides_along_it_and_coriolis_is_across():
    motion = ExactMotion(inverted_slider())
    about = {part: motion.vector(Vector(f"a_DD2_{part}", "", "", "ka", ("D2", "D"), part)) for part in "cr"}
    guide = complex(motion.position["B"] - motion.position["A"])
    whole = complex(motion.acceleration["D"] - motion.acceleration["D2"])
    assert about["c"] + about["r"] == pytest.approx(whole, rel=1e-12)
    assert (about["r"] / guide).imag == pytest.approx(0.0, abs=1e-12 * abs(about["r"] / guide))
    assert (about["c"] / guide).real == pytest.approx(0.0, abs=1e-12 * abs(about["c"] / guide))


def test_every_vector_of_a_construction_of_all_groups_agrees_with_fifty_digits():
    mechanism = every_group.mechanism()
    # The truth of triads, which are not solved joint by joint, is in the reference's own tests.
    assert {type(group) for group in mechanism.groups} == {*get_args(Group)} - {Triad}
    construction, scale = construction_of(mechanism), np.array([0.01])
    measured = _measured(construction, move(mechanism))
    nodes = evaluate(construction, {**measured, **parameters_of(mechanism, scale, scale, scale)})
    truth = ExactMotion(mechanism)
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
        ExactMotion(far_off)


def test_closure_equations_without_a_root_are_an_arithmetic_error():
    with pytest.raises(ArithmeticError, match="no root"):
        _root([lambda node: abs(node) ** 2 + 1, lambda node: node.real], mpc("0.3", "0.2"))


def test_a_vector_fixed_in_a_link_tells_how_it_turns():
    crank = inverted_slider().crank
    omega, epsilon = ExactMotion(inverted_slider()).turning("A", "O1")
    assert float(omega) == pytest.approx(crank.omega[0])
    assert float(epsilon) == pytest.approx(crank.epsilon[0])
