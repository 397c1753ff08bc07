"""Very many variants, a stretch of them after another; data that all of them share."""

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings

from reference.authored.assignment import load_assignment
from reference.kinematics.motion import move, move_where_possible
from reference.mechanism import with_arrays
from tests.laws.mechanisms import after, mechanisms

QUANTITIES = ("position", "velocity", "acceleration", "omega", "epsilon", "transmission")
MOMENTS = np.linspace(0.0, 0.6, 150)
"""Seconds; no multiple of the stretch below."""


@pytest.fixture
def short_stretches(monkeypatch):
    monkeypatch.setattr("reference.kinematics.motion.MANY", 100)
    monkeypatch.setattr("reference.kinematics.motion.STRETCH", 64)


def assert_equal(one, other):
    assert np.array_equal(one.predicted_error, other.predicted_error)
    for quantity in QUANTITIES:
        ours, theirs = getattr(one, quantity), getattr(other, quantity)
        assert list(ours) == list(theirs)
        for name, values in theirs.items():
            assert ours[name].dtype == values.dtype
            assert np.array_equal(ours[name], values, equal_nan=True), (quantity, name)


@pytest.mark.usefixtures("short_stretches")
@pytest.mark.parametrize("accelerations", [True, False])
@settings(max_examples=20, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(mechanism=mechanisms())
def test_stretches_of_variants_move_as_each_of_them(mechanism, accelerations):
    many, half = after(mechanism, MOMENTS), after(mechanism, MOMENTS[90:])
    motion, end = (move_where_possible(one, accelerations=accelerations) for one in (many, half))
    assert_equal(with_variants(motion, slice(90, None)), end)


def with_variants(motion, rows):
    kept = {name: {one: x[rows] for one, x in getattr(motion, name).items()} for name in QUANTITIES}
    return type(motion)(
        **kept, predicted_error=motion.predicted_error[rows], recomputed=motion.recomputed[rows]
    )


@pytest.mark.parametrize("count", [1, 3, 30, 300])
def test_data_that_all_variants_share_are_as_good_as_a_copy_for_each(count):
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism((assignment.variants() * 10)[:count])
    shared, copied = mechanism.groups[0].lengths_m[0], with_arrays(mechanism, np.array)
    assert shared.shape == (count,)
    assert count == 1 or shared.strides == (0,)
    assert copied.groups[0].lengths_m[0].strides != (0,)
    assert_equal(move(mechanism), move(copied))
