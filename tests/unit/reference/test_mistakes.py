"""Mistakes: each changes what it says it changes, and nothing upstream."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.construction.derive import construction_of
from reference.construction.graph import evaluate
from reference.construction.mistakes import (
    CODES,
    OF_FORCES,
    RPM_FACTOR,
    Mistake,
    affected,
    changed_step,
    commit,
    line_of,
    rarer_mistakes_of_step,
    single_mistakes,
)
from reference.plan import exact_plan
from tests import every_group

MOVED_MM = 1e-6
FIGURES = ["mechanism", "velocity_plan", "acceleration_plan"]


def a_plan(name="pump", n=7, position=None):
    assignment = load_assignment(name)
    return exact_plan(assignment, [assignment.variant(n, position)])


def drawn(plan, mistake):
    """The nodes with a mistake, and without it."""
    drawings = commit(mistake, plan.drawing), plan.drawing
    return tuple(evaluate(one.construction, one.parameters) for one in drawings)


def shifts(plan, mistake):
    wrong, right = drawn(plan, mistake)
    return {node: float(np.max(np.abs(wrong[node] - right[node]))) for node in right}


@pytest.mark.parametrize(
    ("name", "n", "position"),
    [("pump", 7, None), ("press", None, 1), ("engine", 5, None), ("shaper", 4, None), ("piston", 2, None)],
)
@pytest.mark.parametrize("figure", FIGURES)
def test_every_single_mistake_moves_only_nodes_drawn_from_it_and_its_own(name, n, position, figure):
    plan = a_plan(name, n, position)
    offered = list(single_mistakes(plan.drawing, figure))
    assert offered
    for mistake in offered:
        told = affected(mistake, plan.construction)
        moved = {node for node, shift in shifts(plan, mistake).items() if not shift <= MOVED_MM}
        assert moved <= told, mistake
        if mistake.at in {step.node for step in plan.construction.steps}:
            # A line drawn wrongly may still pass through the node where two links are parallel.
            assert mistake.at in moved or mistake.code in {"wrong_link", "wrong_intersection"}, mistake


def test_a_mistake_at_b_moves_everything_drawn_from_b():
    plan = a_plan()
    mistake = Mistake("parallel_for_perpendicular", "b", 0)
    moved = {node for node, shift in shifts(plan, mistake).items() if shift > MOVED_MM}
    assert moved == affected(mistake, plan.construction)
    assert {"b", "c", "d", "b'", "d'"} <= moved


def test_every_code_of_the_contract_is_offered_or_can_be_committed():
    plan = a_plan()
    offered = {m.code for figure in FIGURES for m in single_mistakes(plan.drawing, figure)}
    by_hand = {"other_variant", "data_misread", "vector_missing", "labels_swapped", "arithmetic", "units"}
    by_hand |= OF_FORCES | {"wrong_arm"}  # tests/laws/test_force_plans.py
    assert offered | by_hand == set(CODES)
    assert not offered & by_hand


def test_rpm_for_radians_grows_velocities_once_and_accelerations_twice():
    plan = a_plan()
    wrong, right = drawn(plan, Mistake("rpm_not_converted", "velocity_plan", factor=RPM_FACTOR))
    for node in ("a", "b", "c", "d"):
        np.testing.assert_allclose(wrong[node], right[node] * RPM_FACTOR, rtol=1e-9)
    for node in ("a'", "b'", "c'", "d'"):
        np.testing.assert_allclose(wrong[node], right[node] * RPM_FACTOR**2, rtol=1e-9)


def test_a_missing_normal_component_leaves_its_end_at_its_start():
    plan = a_plan()
    nodes, _ = drawn(plan, Mistake("normal_missing", "n_BA"))
    np.testing.assert_allclose(nodes["n_BA"], nodes["a'"], atol=1e-12)


def test_a_reversed_normal_component_points_away_from_the_pin():
    plan = a_plan()
    nodes, right = drawn(plan, Mistake("normal_reversed", "n_BA"))
    np.testing.assert_allclose(nodes["n_BA"] - nodes["a'"], right["a'"] - right["n_BA"], atol=1e-12)


def test_a_normal_from_the_absolute_velocity_has_that_velocitys_square():
    plan = a_plan()
    nodes, _ = drawn(plan, Mistake("normal_from_absolute", "n_BA"))
    length_mm = abs(nodes["n_BA"] - nodes["a'"])[0]
    known = plan.drawing.parameters
    expected = abs(plan.vectors_si["v_B"][0]) ** 2 / (known["AB"][0] * known["ka"][0])
    assert length_mm == pytest.approx(expected, rel=1e-12)


def test_a_mirrored_image_lies_on_the_other_side_of_its_base():
    plan = a_plan()
    nodes, right = drawn(plan, Mistake("image_mirrored", "c"))

    def side(c):
        return ((nodes["b"] - nodes["a"]).conjugate() * (c - nodes["a"])).imag[0]

    assert side(nodes["c"]) == pytest.approx(-side(right["c"]), rel=1e-9)


def test_the_other_assembly_keeps_the_lengths_of_the_links():
    plan = a_plan()
    drawing = commit(Mistake("other_assembly", "B"), plan.drawing)
    nodes = evaluate(drawing.construction, drawing.parameters, wanted=["B"])
    right = evaluate(plan.construction, plan.drawing.parameters)
    for pin in ("A", "O2"):
        np.testing.assert_allclose(abs(nodes["B"] - nodes[pin]), abs(right["B"] - right[pin]), rtol=1e-12)
    assert abs(nodes["B"] - right["B"])[0] > 1.0


def test_another_students_variant_keeps_the_own_scales():
    pump = load_assignment("pump")
    mine, other = a_plan(n=7), a_plan(n=8)
    drawing = commit(Mistake("other_variant", "n", n=8, parameters=other.drawing.parameters), mine.drawing)
    nodes = evaluate(drawing.construction, drawing.parameters)
    ratio = other.scales.kv / mine.scales.kv
    np.testing.assert_allclose(nodes["d"], other.nodes_mm["velocity_plan"]["d"] * ratio, rtol=1e-12)
    assert pump.id == "pump"


def test_a_turned_plan_is_the_right_one_turned():
    plan = a_plan()
    nodes, _ = drawn(plan, Mistake("figure_rotated", "velocity_plan", quarters=1))
    for node, place in plan.nodes_mm["velocity_plan"].items():
        np.testing.assert_allclose(nodes[node], place * 1j, atol=1e-9)


def test_a_mistake_that_cannot_be_made_at_a_step_is_refused():
    plan = a_plan()
    with pytest.raises(ValueError, match="cannot be made at the step of b"):
        commit(Mistake("normal_missing", "b"), plan.drawing)


def test_a_guide_on_the_ground_cannot_be_drawn_by_mistake():
    construction = construction_of(every_group.mechanism())
    with pytest.raises(ValueError, match="line 1 of H is a guide on the ground"):
        changed_step(Mistake("parallel_for_perpendicular", "H", slot=1), construction)


def test_a_missing_vector_is_missing_by_name_and_moves_nothing():
    plan = a_plan()
    drawing = commit(Mistake("vector_missing", "v_DC"), plan.drawing)
    assert set(plan.construction.vectors) - set(drawing.construction.vectors) == {"v_DC"}
    assert max(shifts(plan, Mistake("vector_missing", "v_DC")).values()) == 0.0


def test_swapped_labels_exchange_the_ends_of_vectors_and_move_nothing():
    plan = a_plan()
    drawing = commit(Mistake("labels_swapped", "b", other=("b", "c")), plan.drawing)
    vectors = drawing.construction.vectors
    assert (vectors["v_B"].tail, vectors["v_B"].head) == ("o", "c")
    assert (vectors["v_DC"].tail, vectors["v_DC"].head) == ("b", "d")
    assert (vectors["v_CB"].tail, vectors["v_CB"].head) == ("c", "b")
    assert vectors["v_A"] == plan.construction.vectors["v_A"]


def test_an_arithmetic_slip_changes_the_length_that_was_computed():
    plan = a_plan()
    nodes, right = drawn(plan, Mistake("arithmetic", "n_B", factor=1.3))
    np.testing.assert_allclose(nodes["n_B"] - nodes["o'"], 1.3 * (right["n_B"] - right["o'"]), atol=1e-12)


def rarer(plan):
    return [
        one for step in plan.construction.steps for one in rarer_mistakes_of_step(step, plan.construction)
    ]


@pytest.mark.parametrize(
    ("name", "n", "position"), [("pump", 7, None), ("press", None, 1), ("shaper", 4, None)]
)
def test_rarer_mistakes_move_nothing_upstream_and_are_none_of_the_usual_ones(name, n, position):
    plan = a_plan(name, n, position)
    usual = [one for figure in FIGURES for one in single_mistakes(plan.drawing, figure)]
    offered = rarer(plan)
    assert offered
    assert not [one for one in offered if one in usual]
    for mistake in offered:
        moved = {node for node, shift in shifts(plan, mistake).items() if not shift <= MOVED_MM}
        assert moved <= affected(mistake, plan.construction), mistake


def test_the_driving_links_vector_may_lie_along_the_link():
    plan = a_plan()
    mistake = Mistake("parallel_for_perpendicular", "a", quarters=1)
    assert mistake in rarer(plan)
    nodes, _ = drawn(plan, mistake)
    crank = nodes["A"] - nodes["O1"]
    assert abs((crank.conjugate() * nodes["a"]).imag[0]) < MOVED_MM


def test_a_point_may_be_taken_on_another_vectors_line():
    plan = a_plan()
    nodes, _ = drawn(plan, Mistake("wrong_intersection", "c'", 1, other=("a_B_t",)))
    along, across = nodes["c'"] - nodes["n_B"], nodes["B"] - nodes["O2"]
    assert abs((along.conjugate() * across).real[0]) < MOVED_MM * abs(across)[0]
    construction = plan.construction
    assert line_of(construction.vectors["v_C"], construction) is None
    assert line_of(construction.vectors["a_BA_n"], construction).through == "a'"
