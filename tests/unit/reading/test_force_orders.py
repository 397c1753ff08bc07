"""Force polygons may be drawn in any order of their sides: the vectors stay, and the usual corners follow."""

import tempfile
from pathlib import Path

import numpy as np
import pytest

from grader.reading.orders import reordered, ring_of, to_usual
from reference.construction.graph import evaluate
from reference.plan import exact_plan
from tests.bench.force_sheets import MASSES, judged, read, task_with_forces, work

ROUNDING_MM = 1e-9
WIDTH_MM = 0.5


def an_order(ring, lot):
    """The sides of a ring in some order, the closing ones last, those in either order."""
    count = len(ring.vectors)
    chain, closing = np.arange(count - ring.closing), np.arange(count - ring.closing, count)
    return (*map(int, lot.permutation(chain)), *map(int, lot.permutation(closing)))


@pytest.mark.parametrize("name", list(MASSES))
def test_vectors_and_usual_corners_are_those_of_the_exact_plan_in_any_order(name):
    assignment, lot = task_with_forces(name), np.random.default_rng(3)
    plan = exact_plan(assignment, assignment.variants()[1:2])
    right = evaluate(plan.construction, plan.drawing.parameters)
    rings = {figure: ring_of(plan.construction, figure) for figure in plan.construction.poles}
    assert any(rings.values())
    for figure, ring in rings.items():
        for _ in range(6 if ring else 0):
            order = an_order(ring, lot)
            changed = reordered(plan.construction, figure, ring, order)
            names = [step.node for step in changed.figures[figure]]
            # What later plans take over is not asked here.
            nodes = evaluate(changed, plan.drawing.parameters, wanted=names)
            for vector in changed.vectors_of(figure):
                tail, tip = vector.arrow
                drawn = nodes[tip] - nodes[tail]
                assert abs(drawn - plan.drawn_mm(vector.name))[0] < ROUNDING_MM, (vector.name, order)
            sides = {one.name for one in ring.vectors}
            assert sides <= {vector.name for vector in changed.vectors_of(figure)}
            usual = to_usual(order) @ np.array([complex(np.ravel(nodes[node])[0]) for node in names])
            for node, at in zip(names, usual, strict=True):
                assert abs(at - complex(np.ravel(right[node])[0])) < ROUNDING_MM, (node, order)


def test_the_usual_order_changes_nothing():
    plan = exact_plan(task_with_forces("pump"), task_with_forces("pump").variants()[:1])
    ring = ring_of(plan.construction, "force_plan_B")
    assert reordered(plan.construction, "force_plan_B", ring, ring.usual) == plan.construction
    assert (to_usual(ring.usual) == np.eye(len(ring.vectors))).all()


@pytest.mark.slow
@pytest.mark.parametrize("order", ["mixed", "backwards", "parts last"])
def test_a_polygon_drawn_in_another_order_is_read(order):
    one = work("pump", 95006, order=order)
    with tempfile.TemporaryDirectory() as folder:
        pages = read(one, Path(folder))
    drawn = [vector for vector in judged(one, pages) if not vector.true.missing and not vector.short]
    assert sum(vector.error_mm < WIDTH_MM for vector in drawn) >= 0.85 * len(drawn)
    assert not any(vector.misread for vector in drawn)
    # Where the sides are laid off otherwise, the overlay needs their places on the sheet.
    figure = pages[0].reading.figures["force_plan_B"]
    assert figure.drawn.keys() >= {"R_13_t", "F_i3", "R_43", "F_i2"}
