"""Normal components by right triangles: as long as computed ones, or refused."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.construction.graph import evaluate
from reference.construction.mistakes import Mistake, commit
from reference.construction.triangles import triangles
from reference.drawing.triangles import RATIO_TOLERANCE, altitude_nodes, with_triangles
from reference.errors import CallError
from reference.plan import exact_plan

RELATIVE = 1e-12
"""Error of the drawn normal component, relative to the largest length on the sketch."""


def plan_of(name, **scales):
    assignment = load_assignment(name)
    variants = assignment.variants()
    return exact_plan(assignment, variants, assignment.scales(variants, **scales))


@pytest.mark.parametrize("name", ["pump", "pump-230", "pump-collinear", "shaper", "piston"])
def test_the_last_point_of_the_triangle_ends_the_normal_component(name):
    plan = plan_of(name)
    nodes = altitude_nodes(plan)
    size = np.max(np.abs(list(plan.nodes_mm["mechanism"].values())))
    found = triangles(plan.construction)
    assert {one.vector.name for one in found} == {
        name
        for name, vector in plan.construction.vectors.items()
        if vector.part == "n" and name != f"a_{plan.mechanism.driver.pin}_n"
    }
    for triangle in found:
        drawn = nodes[triangle.turned] - plan.nodes_mm["mechanism"][triangle.joint]
        assert np.all(np.abs(drawn - plan.drawn_mm(triangle.vector.name)) <= RELATIVE * size)


def test_the_triangle_has_its_right_angle_at_the_end_of_the_velocity():
    plan = plan_of("pump")
    nodes = {**plan.nodes_mm["mechanism"], **altitude_nodes(plan)}
    for triangle in triangles(plan.construction):
        first = nodes[triangle.pin] - nodes[triangle.end]
        second = nodes[triangle.beyond] - nodes[triangle.end]
        cosine = (np.conj(first) * second).real / np.abs(first) / np.abs(second)
        assert np.all(np.abs(cosine) <= RELATIVE)


@pytest.mark.parametrize("name", ["pump", "press", "shaper", "piston"])
def test_used_at_other_scales_it_gives_the_mistaken_component(name):
    """The mistake is the triangle itself, drawn at scales at which it is not the normal component."""
    plan = plan_of(name, ka=6.0)
    known = plan.drawing.parameters
    ratio = known["kL"] * known["ka"] / known["kv"] ** 2
    assert np.any(np.abs(ratio - 1.0) > 0.1)
    nodes = evaluate(with_triangles(plan.construction), known)
    size = np.max(np.abs(list(plan.nodes_mm["mechanism"].values())))
    for triangle in triangles(plan.construction):
        at = triangle.vector.head
        wrong = commit(Mistake("arithmetic", at, other=("right_triangle",)), plan.drawing)
        mistaken = evaluate(wrong.construction, known)
        component = mistaken[at] - mistaken[triangle.vector.tail]
        drawn = nodes[triangle.turned] - nodes[triangle.joint]
        assert np.all(np.abs(component - drawn) <= RELATIVE * size)
        assert np.all(np.abs(component - ratio * plan.drawn_mm(triangle.vector.name)) <= RELATIVE * size)


def test_a_velocity_of_zero_gives_a_normal_component_of_zero():
    press = load_assignment("press")
    dead = [press.variant(None, 0)]
    scales = press.scales(dead)
    plan = exact_plan(press, dead, replace(scales, ka=scales.kv**2 / scales.kL))
    nodes = altitude_nodes(plan)
    assert all(np.all(np.isfinite(node)) for node in nodes.values())
    joint = plan.nodes_mm["mechanism"]["B"]
    assert np.abs(nodes["bIV_B"] - joint)[0] <= RELATIVE * abs(joint[0])


def test_scales_that_do_not_allow_it_are_refused_with_the_ratio_and_what_to_do():
    plan = plan_of("press")
    with pytest.raises(CallError, match=r"kL ka / kv\^2 = 0\.555556.*choose ka = kv\^2 / kL = 0\.195426"):
        altitude_nodes(plan)


@pytest.mark.parametrize(("off", "refused"), [(0.1, False), (10.0, True)])
def test_the_ratio_is_held_to_its_tolerance(off, refused):
    pump = load_assignment("pump")
    variants = pump.variants()
    scales = pump.scales(variants)
    plan = exact_plan(pump, variants, replace(scales, ka=scales.ka * (1.0 + off * RATIO_TOLERANCE)))
    if refused:
        with pytest.raises(CallError):
            altitude_nodes(plan)
    else:
        assert altitude_nodes(plan)


def test_the_triangles_follow_a_velocity_plan_of_the_students_own():
    plan = plan_of("pump")
    own = {"b": plan.nodes_mm["velocity_plan"]["b"] * 1.1}
    nodes = evaluate(with_triangles(plan.construction), plan.drawing.parameters, given=own)
    speed = np.abs(own["b"])
    arm = np.abs(nodes["B"] - nodes["O2"])
    drawn = np.abs(nodes["bIV_B"] - nodes["B"])
    assert np.all(np.abs(drawn - speed**2 / arm) <= RELATIVE * drawn)
