"""The construction draws what the closed form computes, for random mechanisms and scales."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from reference.authored.assignment import Scales
from reference.construction.derive import construction_of
from reference.construction.elements import View
from reference.construction.graph import evaluate, parameters_of
from reference.kinematics.motion import move
from reference.mechanism import Mechanism
from reference.plan import _nodes

ROUNDING = 1e-9
"""Relative to the figure's size; lines may meet at 14 degrees, and errors add up over a dozen steps."""
a_mechanism = st.from_type(Mechanism)
a_scale = st.floats(1e-4, 10.0)


def drawn(mechanism, *scales, **how):
    construction = construction_of(mechanism, **how)
    return construction, evaluate(construction, parameters_of(mechanism, *map(np.asarray, scales)))


def size_of(nodes):
    return max(float(np.max(np.abs(place))) for place in nodes)


@given(a_mechanism, a_scale, a_scale, a_scale, st.booleans())
def test_every_node_as_drawn_lies_where_the_closed_form_has_it(
    mechanism, k_length, k_velocity, k_acceleration, similar
):
    scales = Scales(*map(np.asarray, (k_length, k_velocity, k_acceleration)))
    construction, nodes = drawn(mechanism, k_length, k_velocity, k_acceleration, plate_by_similarity=similar)
    exact = _nodes(construction, mechanism, move(mechanism), scales)
    assert set(nodes) == {node for figure in exact.values() for node in figure}
    for figure in exact.values():
        size = size_of(figure.values())
        for node, place in figure.items():
            assert np.max(np.abs(nodes[node] - place)) <= ROUNDING * size, node


PARTS = {"n": "t", "c": "r"}
"""Each first part of a relative acceleration, and the second that starts where it ends."""


@given(a_mechanism)
def test_the_parts_of_every_relative_acceleration_are_square_to_each_other_and_add_up(mechanism):
    construction, nodes = drawn(mechanism, 0.01, 0.1, 1.0)
    vectors = construction.vectors
    size = size_of(nodes.values())

    def along(vector):
        return nodes[vector.head] - nodes[vector.tail]

    for name, first in vectors.items():
        if first.part not in PARTS:
            continue
        about = name.rpartition("_")[0]
        if about not in vectors:
            continue  # of an Assur point about a joint of its link: a part of its acceleration about a pin
        second = vectors[f"{about}_{PARTS[first.part]}"]
        assert second.tail == first.head
        assert abs((np.conj(along(first)) * along(second)).real[0]) <= ROUNDING * size**2
        velocity = vectors[about.replace("a", "v", 1)]
        assert abs((np.conj(along(velocity)) * along(first)).real[0]) <= ROUNDING * size**2
        if velocity.link is not None:
            # The relative acceleration of two joints is that of their images.
            images = {joint: vectors.get(f"a_{joint}") for joint in velocity.link}
            ends = [nodes[one.head] if one else 0.0 for one in images.values()]
            assert abs((along(first) + along(second) - (ends[1] - ends[0]))[0]) <= ROUNDING * size


@given(a_mechanism)
def test_centres_of_velocity_and_acceleration_are_at_rest_in_their_links_motion(mechanism):
    scales = (0.01, 0.1, 1.0)
    construction, nodes = drawn(mechanism, *scales)
    parameters = parameters_of(mechanism, *map(np.asarray, scales))
    motion = move(mechanism)
    for name, centre in construction.centres.items():
        link, (joint, _) = name[1:], centre.base
        omega, epsilon = motion.omega[link], motion.epsilon[link]
        turn = 1j * omega if name[0] == "I" else 1j * epsilon - omega**2
        rate = (motion.velocity if name[0] == "I" else motion.acceleration)[joint]
        with np.errstate(all="ignore"):
            arm = centre.place(View(nodes, parameters)) * scales[0] - motion.position[joint]
        size = max(np.abs(rate)[0], *(np.abs(one)[0] for one in motion.velocity.values()))
        if np.abs(turn)[0] * 1e3 > size:
            # A link that hardly turns has its centre beyond the horizon.
            assert np.abs(rate + turn * arm)[0] <= ROUNDING * 1e3 * size, name
