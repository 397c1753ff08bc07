"""Data that all variants share."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.kinematics.motion import move
from reference.mechanism import with_arrays

QUANTITIES = ("position", "velocity", "acceleration", "omega", "epsilon", "transmission")


def assert_equal(one, other):
    assert np.array_equal(one.predicted_error, other.predicted_error)
    for quantity in QUANTITIES:
        ours, theirs = getattr(one, quantity), getattr(other, quantity)
        assert list(ours) == list(theirs)
        for name, values in theirs.items():
            assert ours[name].dtype == values.dtype
            assert np.array_equal(ours[name], values, equal_nan=True), (quantity, name)


@pytest.mark.parametrize("count", [1, 3, 30, 300])
def test_data_that_all_variants_share_are_as_good_as_a_copy_for_each(count):
    assignment = load_assignment("pump")
    mechanism = assignment.mechanism((assignment.variants() * 10)[:count])
    shared, copied = mechanism.groups[0].lengths_m[0], with_arrays(mechanism, np.array)
    assert shared.shape == (count,)
    assert count == 1 or shared.strides == (0,)
    assert copied.groups[0].lengths_m[0].strides != (0,)
    assert_equal(move(mechanism), move(copied))
