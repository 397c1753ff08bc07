"""The drafting errors of a hand: the construction's derivative, compared with random drawings."""

import numpy as np
import pytest

from reference.construction.elements import View, drawn
from reference.construction.graph import evaluate
from reference.construction.uncertainty import SMALL, OwnNode, Skill, acts, spread, step_errors, trace
from tests.hands import task_for

SKILL = Skill(angle_deg=0.3, place_mm=0.25, mark_mm=0.1)
DRAWINGS = 1500
WITHIN = 0.12
"""Relative: what 1,500 drawings tell of a standard deviation, and the curvature of what is drawn."""
ROUNDING_MM = 1e-6
CASES = [
    ("pump", 7, None),
    ("press", None, 1),
    ("shaper", 7, None),
    ("engine", 5, None),
    ("piston", 10, None),
]


def traced(task, own=None):
    return trace(task.construction, task.parameters, SKILL, own or {})


@pytest.mark.parametrize(("name", "n", "position"), CASES)
def test_many_drawings_scatter_as_the_derivative_says(name, n, position):
    task = task_for(name, n, position)
    lot = np.random.default_rng(7)
    errors = {act: SKILL.deviation(act[2]) * lot.standard_normal(DRAWINGS) for act in acts(task.construction)}
    sheets = evaluate(task.construction, task.parameters, errors=errors)
    found = traced(task)
    for vector in task.construction.vectors.values():
        exact = found.vector(vector.tail, vector.head)
        off = np.asarray(sheets[vector.head] - sheets[vector.tail]) - exact
        meant = spread(found.shifts(vector.tail, vector.head), exact)
        turned = off * np.conj(exact / abs(exact)) if exact else off
        assert np.std(turned.real) == pytest.approx(meant.along, rel=WITHIN), vector.name
        assert np.std(turned.imag) == pytest.approx(meant.across, rel=WITHIN), vector.name


@pytest.mark.parametrize(("name", "n", "position"), CASES)
def test_without_own_nodes_a_drawing_is_the_exact_one_and_every_act_moves_something(name, n, position):
    task = task_for(name, n, position)
    found, exact = traced(task), evaluate(task.construction, task.parameters)
    for node, place in exact.items():
        assert abs(found.made[node].at - complex(np.ravel(place)[0])) < ROUNDING_MM
    shifts = np.array([found.nodes[node].shifts for node in exact])
    assert np.all(np.abs(shifts).max(axis=0) > 0.0)


def test_a_line_is_drawn_as_far_to_its_left_and_turned_as_far_as_its_errors_say():
    errors = {("b", 0, "shift"): np.array([-0.5, 0.25]), ("b", 0, "angle"): np.array([0.0, 0.01])}
    foot, along = drawn(View({}, {}, errors), "b", 0, np.array(2.0 + 1j), np.array(1j))
    assert np.allclose(foot, [2.5 + 1j, 1.75 + 1j], rtol=0.0, atol=1e-15)
    assert np.allclose(np.angle(along) - np.pi / 2.0, [0.0, 0.01], rtol=0.0, atol=1e-15)


def test_own_nodes_are_taken_as_drawn_and_only_what_comes_after_may_be_missed():
    task = task_for("pump", 7)
    exact = evaluate(task.construction, task.parameters)
    own = {node: OwnNode(complex(np.ravel(place)[0])) for node, place in exact.items()}
    by_figure = {
        figure: {step.node: own[step.node] for step in steps if step.node != "d"}
        for figure, steps in task.construction.figures.items()
    }
    found = traced(task, by_figure)
    shifts = found.shifts("o", "d")
    of_d = [index for index, act in enumerate(acts(task.construction)) if act[0] == "d"]
    assert np.abs(shifts[of_d]).min() > 0.0
    assert np.abs(np.delete(shifts, of_d)).max() < ROUNDING_MM
    assert np.abs(shifts).max() < np.abs(traced(task).shifts("o", "d")).max() * 10.0


def test_what_measuring_leaves_open_is_told_after_the_hands_errors():
    task = task_for("pump", 7)
    places = evaluate(task.construction, task.parameters)
    at = complex(np.ravel(places["c"])[0])
    found = traced(task, {"velocity_plan": {"c": OwnNode(at, np.array([0.2, 0.2j]))}})
    assert found.drafting_count == len(acts(task.construction))
    shifts = found.made["d"].shifts
    assert len(shifts) == found.drafting_count + 2
    assert np.abs(shifts[found.drafting_count :]).max() > 0.0


def test_a_zero_vector_may_be_off_in_any_direction():
    both = spread(np.array([3.0 + 0j, 4.0j]), 0.0)
    assert both.along == both.across == pytest.approx(5.0)
    apart = spread(np.array([3.0 + 0j, 4.0j]), 2.0j)
    assert (apart.along, apart.across) == (pytest.approx(4.0), pytest.approx(3.0))


def test_a_steps_own_errors_are_small_and_one_at_a_time():
    task = task_for("pump", 7)
    step = task.construction.step("b")
    errors = step_errors(step, SKILL)
    for row, ((_, _, kind), values) in enumerate(errors.items(), start=1):
        assert np.count_nonzero(values) == 1
        assert values[row, 0] == pytest.approx(SMALL * SKILL.deviation(kind))
