"""The construction: held against the closed form, followed through, drawn by a hand that errs."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.construction import derive
from reference.construction.derive import construction_of
from reference.construction.graph import ancestors, bars, coincident, evaluate, parameters_of
from reference.construction.steps import Similar
from reference.plan import exact_plan
from tests import every_group

BUILT_IN = ["pump", "pump-230", "pump-collinear", "engine", "press", "shaper", "piston"]
SHARE_OF_PLAN = 1e-12


def plan_of(name, *, accelerations=True):
    assignment = load_assignment(name)
    return exact_plan(assignment, assignment.variants(), accelerations=accelerations)


def drawn_plan(name):
    """A plan by the closed form, and its nodes as the construction draws them."""
    plan = plan_of(name)
    return plan, evaluate(plan.construction, plan.drawing.parameters)


@pytest.mark.parametrize("name", BUILT_IN)
def test_the_construction_and_the_closed_form_give_the_same_plans(name):
    plan, drawn = drawn_plan(name)
    for figure, nodes in plan.nodes_mm.items():
        size = plan.size_mm(figure)
        assert set(nodes) == {step.node for step in plan.construction.figures[figure]}
        for node, place in nodes.items():
            assert np.max(np.abs(drawn[node] - place) / size) <= SHARE_OF_PLAN, node


@pytest.mark.parametrize("name", ["pump", "press"])
def test_without_accelerations_the_velocity_plan_is_the_same_and_nothing_else_is_solved(name):
    whole, part = plan_of(name), plan_of(name, accelerations=False)
    assert "acceleration_plan" not in part.nodes_mm
    assert not part.motion.acceleration
    assert not [vector for vector in part.vectors_si if vector.startswith("a_")]
    for node, place in part.nodes_mm["velocity_plan"].items():
        np.testing.assert_array_equal(place, whole.nodes_mm["velocity_plan"][node])


def test_what_follows_from_a_wrong_node_follows_the_wrong_node_and_the_rest_stays():
    plan, drawn = drawn_plan("pump")
    moved = evaluate(plan.construction, plan.drawing.parameters, given={"b": drawn["b"] + (3 - 2j)})
    downstream = {node for node in drawn if "b" in ancestors(plan.construction, [node])}
    assert {"b", "c", "d", "n_BA", "n_B", "b'", "c'", "d'"} <= downstream
    assert "n_DC" in downstream
    assert "a'" not in downstream
    for node in drawn:
        shift = np.max(np.abs(moved[node] - drawn[node]))
        assert (shift > 1e-6) == (node in downstream), node


@pytest.mark.parametrize("name", BUILT_IN)
def test_giving_the_right_nodes_changes_nothing(name):
    plan, drawn = drawn_plan(name)
    given = {node: drawn[node] for node in list(drawn)[::2]}
    again = evaluate(plan.construction, plan.drawing.parameters, given=given)
    for node in drawn:
        np.testing.assert_allclose(again[node], drawn[node], atol=1e-10)


def test_a_given_node_hides_its_own_makers():
    plan, drawn = drawn_plan("pump")
    both = evaluate(plan.construction, plan.drawing.parameters, given={"b": drawn["b"] + 5, "c": drawn["c"]})
    np.testing.assert_allclose(both["d"], drawn["d"], atol=1e-10)


def test_what_a_given_node_is_made_from_is_not_drawn():
    plan, drawn = drawn_plan("pump")
    joints = {step.node: drawn[step.node] for step in plan.construction.figures["mechanism"]}
    given = {**joints, "b": drawn["b"]}
    part = evaluate(plan.construction, plan.drawing.parameters, given=given, wanted=["b"])
    assert set(part) == {"b"}
    np.testing.assert_array_equal(part["b"], drawn["b"])


@pytest.mark.parametrize("wanted", [["v"], ["d"], ["b'"], ["n_B", "C"]])
def test_only_what_is_asked_for_and_its_ancestors_are_drawn(wanted):
    plan = plan_of("pump")
    if wanted == ["v"]:
        with pytest.raises(KeyError):
            evaluate(plan.construction, plan.drawing.parameters, wanted=wanted)
        return
    part = evaluate(plan.construction, plan.drawing.parameters, wanted=wanted)
    whole = evaluate(plan.construction, plan.drawing.parameters)
    assert set(part) == ancestors(plan.construction, wanted) < set(whole)
    for node, place in part.items():
        np.testing.assert_array_equal(place, whole[node])


def test_an_error_at_a_node_is_seen_at_that_node():
    plan, drawn = drawn_plan("pump")
    for node in ("b", "c'", "n_BA", "B"):
        off = evaluate(
            plan.construction,
            plan.drawing.parameters,
            errors={(node, 0, "x"): np.asarray(0.3), (node, 0, "y"): np.asarray(-0.2)},
        )
        np.testing.assert_allclose(off[node] - drawn[node], 0.3 - 0.2j, atol=1e-9)


def test_similar_triangles_and_perpendiculars_give_the_same_image_of_a_plate():
    pump = load_assignment("pump")
    plan = plan_of("pump")
    by_similarity = construction_of(plan.mechanism, plate_by_similarity=True)
    assert isinstance(by_similarity.step("c"), Similar)
    assert not isinstance(plan.construction.step("c"), Similar)
    one = evaluate(by_similarity, plan.drawing.parameters)
    other = evaluate(plan.construction, plan.drawing.parameters)
    for node in ("c", "d", "c'", "d'"):
        np.testing.assert_allclose(one[node], other[node], atol=1e-9)
    for node, step in plan.construction.images.items():
        swapped = evaluate(plan.construction.with_step(step), plan.drawing.parameters)
        np.testing.assert_allclose(swapped[node], other[node], atol=1e-9)
    assert pump.file.plate_images == "perpendiculars"


def test_a_flat_plate_comes_by_similarity_and_divides_the_image_as_it_divides_the_link():
    plan, drawn = drawn_plan("pump-collinear")
    assert isinstance(plan.construction.step("c"), Similar)
    np.testing.assert_allclose(drawn["c"], (drawn["a"] + drawn["b"]) / 2, atol=1e-10)
    np.testing.assert_allclose(drawn["c'"], (drawn["a'"] + drawn["b'"]) / 2, atol=1e-10)


def test_the_pump_has_the_names_that_students_use():
    construction = plan_of("pump").construction
    assert (
        list(construction.vectors)
        == (
            "v_A v_B v_BA v_C v_CA v_CB v_D v_DC a_A a_B a_BA a_BA_n a_BA_t a_B_n a_B_t a_C a_CA a_CA_n"
            " a_CA_t a_CB a_CB_n a_CB_t a_D a_DC a_DC_n a_DC_t"
        ).split()
    )
    assert list(construction.rates) == "omega_1 omega_2 omega_3 omega_4 epsilon_2 epsilon_3 epsilon_4".split()
    assert {step.node for step in construction.figures["acceleration_plan"]} == set(
        "o' a' b' c' d' n_BA n_B n_CA n_CB n_DC".split()
    )


def test_a_turned_sketch_turns_the_plans_with_it():
    plan, drawn = drawn_plan("pump")
    turn = np.radians(17.0)
    turned = evaluate(plan.construction, {**plan.drawing.parameters, "turn": np.asarray(turn)})
    for node, place in drawn.items():
        np.testing.assert_allclose(turned[node], place * np.exp(1j * turn), atol=1e-9)


def test_a_flat_plate_on_a_link_with_a_ground_pivot_divides_its_image():
    flat = {"type": "plate", "node": "M", "base": ["O3", "B"], "link": "7", "lengths": [100, 150]}
    whole = every_group.mechanism(flat)
    construction = construction_of(whole)
    scale = np.ones(1)
    drawn = evaluate(construction, parameters_of(whole, scale, scale, scale))
    np.testing.assert_allclose(drawn["m"], 0.4 * drawn["b"], rtol=1e-12)
    np.testing.assert_allclose(drawn["m'"], 0.4 * drawn["b'"], rtol=1e-12)
    assert [name for name in construction.vectors if name.startswith("v_M")] == ["v_M", "v_MB"]


@pytest.mark.parametrize(
    ("name", "told"),
    [
        ("pump", "O1-A A-B O2-B A-C B-C C-D"),
        ("pump-forces", "O1-A A-B O2-B A-C B-C C-D"),
        ("press", "O1-A A-B O2-B O2-C C-D"),
        ("shaper", "O1-A O2-A3 O2-D D-E"),
        ("piston", "B-A O1-A B-C"),
        (None, "O1-A O2-A3 O2-D D-E A-B O3-B A-C B-C O3-F C-G B-K O1-P O1-C9 A-L B-L"),
    ],
)
def test_bars_are_links_and_slots_and_guides_are_none(name, told):
    construction = plan_of(name).construction if name else construction_of(every_group.mechanism())
    assert sorted("-".join(bar) for bar in bars(construction)) == sorted(told.split())


def test_a_point_under_a_block_lies_where_the_block_does():
    assert coincident(plan_of("shaper").construction) == {"A3": "A"}
    assert not coincident(plan_of("pump").construction)


def test_no_more_constructions_are_kept_than_are_asked_for(monkeypatch):
    monkeypatch.setattr(derive, "CACHED", 1)
    monkeypatch.setattr(derive, "_cache", {})
    pump, press = (load_assignment(name) for name in ("pump", "press"))
    first = construction_of(pump.mechanism(pump.variants()[:1]))
    assert construction_of(pump.mechanism(pump.variants()[1:2])) is first
    construction_of(press.mechanism(press.variants()[:1]))
    assert len(derive._cache) == 1
    assert construction_of(pump.mechanism(pump.variants()[:1])) == first
