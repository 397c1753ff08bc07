"""Instantaneous centres and acceleration poles, by fields and by similarity."""

import numpy as np
import pytest

from grader.solution.document import acceleration_poles, instantaneous_centres
from reference.authored.assignment import load_assignment
from reference.construction.elements import View
from reference.construction.graph import evaluate
from reference.plan import exact_plan

ROUNDING = 1e-11
"""Share of the centre's own distance: centres may lie far away."""


def planned(name):
    assignment = load_assignment(name)
    plan = exact_plan(assignment, assignment.variants())
    found = (plan.mechanism, plan.construction, plan.motion)
    return plan, {**instantaneous_centres(*found), **acceleration_poles(*found)}


@pytest.mark.parametrize("name", ["pump", "press", "engine", "pump-collinear"])
def test_similarity_in_the_plans_finds_the_same_centres_as_the_fields_of_the_links(name):
    plan, exact = planned(name)
    view = View(evaluate(plan.construction, plan.drawing.parameters), plan.drawing.parameters)
    assert plan.construction.centres
    for centre, step in plan.construction.centres.items():
        drawn = step.place(view) * plan.scales.kL
        known = np.isfinite(exact[centre])
        assert np.count_nonzero(known) >= len(known) - 2
        assert np.all(np.abs(drawn - exact[centre])[known] <= ROUNDING * (1.0 + np.abs(exact[centre])[known]))


@pytest.mark.parametrize("name", ["pump", "engine"])
def test_hinges_are_the_centres_of_the_links_they_join_and_centres_of_three_links_are_in_line(name):
    plan, exact = planned(name)
    at = plan.motion.position
    assert np.allclose(exact["I1"], at["O1"], atol=1e-12)
    if name == "pump":
        assert np.allclose(exact["I13"], at["A"], atol=1e-12)
        assert np.allclose(exact["I34"], at["C"], atol=1e-12)
        # Kennedy: the three centres of any three links lie on one line.
        along, across = exact["I12"] - at["O1"], at["O2"] - at["O1"]
        assert np.max(np.abs((np.conj(along) * across).imag)) <= 1e-9 * np.max(np.abs(along * across))


def test_the_construction_finds_the_rocker_turning_about_its_own_pivot():
    plan, exact = planned("pump")
    assert np.allclose(exact["I2"], plan.motion.position["O2"], atol=1e-12)
    assert np.allclose(exact["J2"], plan.motion.position["O2"], atol=1e-12)
