"""Simulated force polygons: whatever the order of drawing, the vectors are those of the exact plan."""

from dataclasses import replace

import numpy as np
import pytest

from reference.plan import exact_plan
from samples.simulation import PERFECT, Settings, Student
from samples.simulation.drawing import drawn_nodes
from samples.simulation.force_orders import HABITS
from samples.simulation.hand import task_of
from samples.simulation.mistakes import CODES_OF_FORCES, Occasion, possible
from samples.simulation.student import drawn_by
from tests.bench.force_sheets import MASSES, task_with_forces

pytestmark = pytest.mark.slow
ROUNDING_MM = 1e-6


@pytest.mark.parametrize("name", list(MASSES))
@pytest.mark.parametrize("habit", HABITS)
def test_exact_instruments_draw_the_exact_forces_in_every_order(name, habit):
    assignment = task_with_forces(name)
    variant = assignment.variants()[3]
    task = task_of(assignment, variant, Student(force_order=habit), np.random.default_rng(5))
    intent = task.right
    nodes = drawn_nodes(intent.construction, intent.parameters, PERFECT, np.random.default_rng(2))
    plan = exact_plan(assignment, [variant])
    for vector in intent.construction.vectors.values():
        tail, tip = vector.arrow
        exact = complex(plan.vectors_si[vector.name][0]) / float(intent.parameters["kF"])
        assert abs(nodes[tip] - nodes[tail] - exact) < ROUNDING_MM, vector.name


def test_another_order_moves_the_corners():
    assignment, orders = task_with_forces("pump"), []
    for habit in HABITS:
        student = Student(force_order=habit)
        task = task_of(assignment, assignment.variants()[3], student, np.random.default_rng(5))
        orders.append(
            tuple((one.name, one.tail, one.head) for one in task.right.construction.vectors.values())
        )
    assert len(set(orders)) > len(HABITS) // 2


def test_every_mistake_in_forces_can_be_made_and_changes_the_drawing():
    assignment = task_with_forces("press")
    settings, every = Settings(PERFECT), assignment.variants()
    rights = [task_of(assignment, one, Student(), np.random.default_rng(1)).right for one in every]
    for code in CODES_OF_FORCES:
        able = (
            one
            for one, right in zip(every, rights, strict=True)
            if possible(code, Occasion(assignment, one, right))
        )
        variant = next(able)
        wrong = replace(settings, student=Student(mistakes=(code,)))
        _, sheets = drawn_by(assignment, variant, 4, wrong)
        _, others = drawn_by(assignment, variant, 4, settings)
        assert [one.nodes for one in sheets[0].figures] != [one.nodes for one in others[0].figures], code
