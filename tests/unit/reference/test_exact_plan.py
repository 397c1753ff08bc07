"""The closed form against 50-digit arithmetic by another road, and against what the sources print."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.plan import conditioning, exact_plan
from tests.bench.oracle import ExactMotion
from tests.examples import slow

SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size: the longest vector of the same plan."""
LAST_DIGIT_MM = 0.005
CHECK_VALUE_CM = 0.0005
REAL_VALUE_MPS = 0.001
"""Real values are told as segment times the velocity scale rounded to 0.0361 (m/s)/mm."""
SOURCE_ROUNDING = 0.02
"""The source rounds on the way, 1.67^2/0.8 = 3.5: its normal components carry up to 2 %."""

BUILT_IN = ["pump", "pump-230", "pump-collinear", "engine", "press", *slow("shaper", "piston")]


@pytest.mark.parametrize("name", BUILT_IN)
def test_vectors_places_and_rates_agree_with_fifty_digits_by_differentiating_places(name):
    assignment = load_assignment(name)
    variants = assignment.variants()
    plan = exact_plan(assignment, variants)
    truth = [ExactMotion(plan.mechanism, index) for index in range(len(variants))]
    for figure in plan.construction.poles:
        vectors = plan.construction.vectors_of(figure)
        exact = np.array([[motion.vector(vector) for motion in truth] for vector in vectors])
        ours = np.array([plan.vectors_si[vector.name] for vector in vectors])
        size = np.max(np.abs(exact), axis=0)
        assert len(vectors) > 3
        assert np.max(np.abs(ours - exact) / size) <= SHARE_OF_PLAN
    size = np.max([np.abs(place) for place in plan.motion.position.values()], axis=0)
    for joint, place in plan.motion.position.items():
        exact = np.array([complex(motion.position[joint]) for motion in truth])
        assert np.max(np.abs(place - exact) / size) <= SHARE_OF_PLAN
    for kind in ("omega", "epsilon"):
        rates = [rate for rate in plan.rates if rate.startswith(kind)]
        vectors = [plan.construction.vectors[plan.construction.rates[rate].vector] for rate in rates]
        exact = np.array([[motion.rate(vector) for motion in truth] for vector in vectors])
        ours = np.array([plan.rates[rate] for rate in rates])
        assert np.max(np.abs(ours - exact) / np.max(np.abs(exact), axis=0)) <= SHARE_OF_PLAN


def test_the_press_gives_what_the_source_prints():
    """Segments to their last digit, real values, and normals within the source's own rounding."""
    press = load_assignment("press")
    plan = exact_plan(press, [press.variant(None, 1)])
    segments = {"v_B": 46.40, "v_BA": 47.17, "v_C": 92.80, "v_D": 89.36, "v_DC": 21.61}
    segments |= {"a_BA_n": 22.25, "a_B_n": 32.29, "a_DC_n": 16.01}
    for vector, segment_mm in segments.items():
        assert abs(plan.drawn_mm(vector)[0]) == pytest.approx(segment_mm, abs=LAST_DIGIT_MM)
    for vector, value in {"v_B": 1.675, "v_BA": 1.703, "v_C": 3.350, "v_D": 3.226, "v_DC": 0.780}.items():
        assert abs(plan.vectors_si[vector][0]) == pytest.approx(value, abs=REAL_VALUE_MPS)
    for vector, printed_mm in {"a_BA_n": 22.2, "a_B_n": 32.4, "a_DC_n": 15.7}.items():
        assert abs(plan.drawn_mm(vector)[0]) == pytest.approx(printed_mm, rel=SOURCE_ROUNDING)


@pytest.mark.parametrize("position", [0, 4])
def test_at_the_dead_points_of_the_press_the_driven_side_stands_still(position):
    press = load_assignment("press")
    plan = exact_plan(press, [press.variant(None, position)])
    size = plan.size_mm("velocity_plan")[0]
    for vector in ("v_B", "v_C", "v_D", "v_DC"):
        assert abs(plan.drawn_mm(vector)[0]) <= SHARE_OF_PLAN * size
        assert np.isnan(plan.direction_deg(vector)[0])
    assert abs(plan.drawn_mm("v_BA")[0]) == pytest.approx(50.0, abs=1e-9)
    assert abs(plan.drawn_mm("a_BA_n")[0]) == pytest.approx(25.0, abs=1e-9)
    for vector in ("a_B_n", "a_DC_n"):
        assert abs(plan.drawn_mm(vector)[0]) <= SHARE_OF_PLAN * plan.size_mm("acceleration_plan")[0]
    a, b = plan.motion.position["A"][0], plan.motion.position["B"][0]
    assert abs((a.conjugate() * b).imag) <= 1e-12


def test_the_pump_has_the_stated_check_values_for_the_first_variant():
    pump = load_assignment("pump")
    plan = exact_plan(pump, [pump.variant(1)])
    told = {"A": 25.441 + 15.898j, "B": -13.497 + 25.053j, "C": 8.732 + 4.907j, "D": -10.657 + 0j}
    for joint, place_cm in told.items():
        assert abs(plan.motion.position[joint][0] * 100 - place_cm) <= 2 * CHECK_VALUE_CM
    assert pump.values([pump.variant(1)])["phi_deg"] == 32
    assert plan.mechanism.crank.omega[0] == pytest.approx(np.pi * 310 / 30)


def test_construction_lines_of_the_pump_never_meet_at_less_than_forty_degrees():
    for name in ("pump", "pump-230"):
        pump = load_assignment(name)
        told = conditioning(exact_plan(pump, pump.variants()))
        crossings = [values for key, values in told.items() if key.startswith("crossing")]
        assert crossings
        assert np.min(crossings) > 38.0
