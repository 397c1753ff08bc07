"""The construction draws what the closed form computes, for random mechanisms and scales."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from reference.construction import evaluate
from reference.derivation import construction_of, image_name, parameters_of
from reference.mechanism import Mechanism
from reference.motion import move

ROUNDING = 1e-9
"""Relative to the figure's size; lines may meet at 10 degrees, and errors add up over a dozen steps."""
a_mechanism = st.from_type(Mechanism)
a_scale = st.floats(1e-4, 10.0)


def drawn(mechanism, *scales, **how):
    construction = construction_of(mechanism, **how)
    return construction, evaluate(construction, parameters_of(mechanism, *map(np.asarray, scales)))


@given(a_mechanism, a_scale, a_scale, a_scale, st.booleans())
def test_the_plan_as_drawn_is_the_motion_as_computed(
    mechanism, k_length, k_velocity, k_acceleration, similar
):
    _, nodes = drawn(mechanism, k_length, k_velocity, k_acceleration, plate_by_similarity=similar)
    motion = move(mechanism)
    moving = [joint for joint in mechanism.joints if not mechanism.is_ground(joint)]
    for rates, scale, primed in (
        (motion.velocity, k_velocity, False),
        (motion.acceleration, k_acceleration, True),
    ):
        size = max(float(np.abs(rates[joint] / scale)[0]) for joint in moving)
        for joint in moving:
            place = nodes[image_name(joint, primed=primed)]
            assert np.abs(place - rates[joint] / scale)[0] <= ROUNDING * size
    for joint in mechanism.joints:
        assert np.abs(nodes[joint] - motion.position[joint] / k_length)[0] <= ROUNDING * 4.0 / k_length


@given(a_mechanism, st.floats(0.2, 5.0))
def test_a_plan_at_another_scale_is_the_same_plan_enlarged(mechanism, factor):
    construction, nodes = drawn(mechanism, 0.01, 0.1, 1.0)
    _, other = drawn(mechanism, 0.01, 0.1 / factor, 1.0 / factor)
    for figure in ("velocity_plan", "acceleration_plan"):
        names = [step.node for step in construction.figures[figure]]
        size = max(float(np.max(np.abs(other[name]))) for name in names)
        for name in names:
            assert np.max(np.abs(nodes[name] * factor - other[name])) <= ROUNDING * size


@given(a_mechanism)
def test_the_parts_of_every_relative_acceleration_are_square_to_each_other_and_add_up(mechanism):
    construction, nodes = drawn(mechanism, 0.01, 0.1, 1.0)
    size = max(float(np.max(np.abs(z))) for z in nodes.values())
    seen = 0
    for name, normal in construction.vectors.items():
        if not name.endswith("_n"):
            continue
        tangential = construction.vectors[name.removesuffix("_n") + "_t"]
        assert tangential.tail == normal.head
        one = nodes[normal.head] - nodes[normal.tail]
        other = nodes[tangential.head] - nodes[tangential.tail]
        assert abs((np.conj(one) * other).real[0]) <= ROUNDING * size**2
        seen += 1
    assert seen >= 6
