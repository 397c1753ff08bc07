"""Force plans drawn step by step agree with the closed form, and mistakes change what they should."""

from dataclasses import replace

import numpy as np
import pytest

from reference.construction.derive import construction_of
from reference.construction.elements import View
from reference.construction.graph import Construction, evaluate, parameters_of
from reference.construction.mistakes import Drawing, affected, commit, mistakes_of_forces, single_mistakes
from reference.kinematics.motion import move_where_possible
from reference.kinetics import Forces, forces_of
from reference.mechanism import Crank, Mechanism
from reference.plan import data_of_forces, force_nodes
from tests.laws.mechanisms import KINDS, array, loaded, random_mechanism

K_FORCE = 3.0


def cases(count: int, seed: int = 0):
    """Random mechanisms with bodies and loads, those that move, with what is exact about them.

    Of a triad, the last kind, no force plan is drawn.
    """
    lot, found = np.random.default_rng(seed), 0
    while found < count:
        seed += 1
        chain = [str(kind) for kind in lot.choice(KINDS[:-1], lot.integers(1, 6))]
        mechanism = loaded(random_mechanism(seed, chain, slider_drives=seed % 3 == 0), seed)
        motion = move_where_possible(mechanism)
        if np.all(motion.predicted_error < 1e-12):
            forces = forces_of(mechanism, motion)
            if np.all(forces.predicted_error < 1e-10):
                found += 1
                yield mechanism, motion, forces


def drawing_of(mechanism: Mechanism, motion, forces: Forces, accelerations: str) -> Drawing:
    """The drawing of its force plans, at round scales."""
    scales = array(0.01), array(0.02), array(0.3)
    known = {**parameters_of(mechanism, *scales), "kF": array(K_FORCE), **data_of_forces(mechanism, forces)}
    measured = {
        f"{tail}{head}": np.abs(motion.position[head] - motion.position[tail])
        for tail in motion.position
        for head in motion.position
    }
    construction = construction_of(mechanism, forces=accelerations)
    return Drawing(construction, {**measured, **known})


def moment(construction: Construction, nodes, parameters) -> float:
    (moments,) = construction.moments.values()
    return float(np.ravel(moments.at(View(nodes, parameters)))[0])


@pytest.mark.parametrize("accelerations", ["given", "own"])
def test_a_force_plan_is_the_closed_form(accelerations):
    drawn, by_cylinder = 0, 0
    for mechanism, motion, forces in cases(60, seed=0 if accelerations == "given" else 1000):
        drawing = drawing_of(mechanism, motion, forces, accelerations)
        nodes = evaluate(drawing.construction, drawing.parameters)
        exact = force_nodes(drawing.construction, mechanism, motion, forces, array(K_FORCE))
        size = max((abs(node[0]) for plan in exact.values() for node in plan.values()), default=0.0)
        for plan in exact.values():
            for name, node in plan.items():
                assert abs(nodes[name] - node)[0] <= 1e-9 * size, (mechanism, name)
                drawn += 1
        by_cylinder += "F_b" in drawing.construction.vectors and isinstance(mechanism.driver, Crank)
        if drawing.construction.moments:
            own, right = moment(drawing.construction, nodes, drawing.parameters), forces.balancing.moment[0]
            reach = max(abs(place[0]) for place in motion.position.values())
            assert abs(own - right) <= 1e-9 * max(size * K_FORCE * reach, abs(right))
    assert drawn > 500
    assert by_cylinder >= 2


def test_every_polygon_closes_and_every_node_is_named_by_a_vector():
    for mechanism, motion, forces in cases(20, seed=2000):
        construction = drawing_of(mechanism, motion, forces, "given").construction
        for plan, pole in construction.poles.items():
            vectors = construction.vectors_of(plan)
            assert {step.node for step in construction.figures[plan]} == {pole} | {
                end for one in vectors for end in (one.tail, one.head)
            }
            ends = [end for one in vectors if not one.is_sum for end in (one.tail, one.head)]
            assert all(ends.count(end) >= 2 for end in ends)


def test_mistakes_of_forces_move_what_they_affect_and_nothing_else():
    codes = set()
    for mechanism, motion, forces in cases(15, seed=3000):
        drawing = drawing_of(mechanism, motion, forces, "own")
        right = evaluate(drawing.construction, drawing.parameters)
        for mistake in mistakes_of_forces(drawing):
            wrong = commit(mistake, drawing)
            nodes = evaluate(wrong.construction, wrong.parameters)
            moved = {name for name, node in nodes.items() if np.any(abs(node - right[name]) > 1e-9)}
            assert moved <= affected(mistake, drawing.construction), mistake
            codes |= {mistake.code} if moved else set()
    assert codes == {
        "inertia_reversed", "force_missing", "force_reversed", "couple_missing", "couple_reversed",
    }  # fmt: skip


def test_a_wrong_arm_is_offered_at_a_part_from_moments():
    for mechanism, motion, forces in cases(30, seed=4000):
        drawing = drawing_of(mechanism, motion, forces, "given")
        for plan in drawing.construction.poles:
            for mistake in single_mistakes(replace(drawing), plan):
                if mistake.code == "wrong_arm":
                    wrong = commit(mistake, drawing)
                    own = evaluate(wrong.construction, wrong.parameters)[mistake.at]
                    right = evaluate(drawing.construction, drawing.parameters)[mistake.at]
                    assert abs(own - right)[0] > 1e-9
                    return
    pytest.fail("no wrong arm was offered")
