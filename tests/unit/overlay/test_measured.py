"""Plans drawn from entered measurements: the right ones close, what does not close is seen."""

import math
from itertools import pairwise

import numpy as np
import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.overlay.measured import measured_picture
from grader.records import Figure, Reading, ReadVector
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment

PEN_WIDTH_MM = 0.3


def measured(name="pump", n=7, position=None, *, directions=True, left_out=(), longer=None):
    """A task, and its exact plan as measured: without some vectors, some longer by a factor."""
    assignment = load_assignment(name)
    task = task_of(assignment, rubric_of(assignment), assignment.variant(n, position))
    scales = {scale: float(np.ravel(task.parameters[scale])[0]) for scale in assignment.scale_names}
    figures = {}
    for figure in task.construction.poles:
        vectors = {}
        for vector in task.construction.vectors_of(figure):
            segment = task.segments[vector.name]
            exact = segment.drawn(scales) * np.exp(1j * segment.turn_rad)
            direction = math.degrees(np.angle(exact)) % 360.0 if directions and abs(exact) > 1e-9 else None
            length = abs(exact) * (longer or {}).get(vector.name, 1.0)
            if vector.name not in left_out:
                vectors[vector.name] = ReadVector(length, 0.0, direction, 0.0, 1.0)
        figures[figure] = Figure({}, vectors)
    reading = Reading(figures)
    judgement = judge(task, Submission(measured=reading))
    return task, reading, {one.name: one for one in judgement.outcomes}


def drawn(task, reading, outcomes, *, show_expected=True):
    return measured_picture("m.csv", reading, task.construction, outcomes, show_expected=show_expected)


@pytest.mark.parametrize(
    ("name", "n", "position"), [("pump", 7, None), ("press", None, 1), ("press", None, 0)]
)
def test_an_exact_plan_closes_everywhere(name, n, position):
    task, reading, outcomes = measured(name, n, position)
    scene = drawn(task, reading, outcomes).scene
    nodes = {(dot.figure, dot.name): dot.at for dot in scene.dots}
    assert len(scene.arrows) >= 10
    for arrow in scene.arrows:
        vector = task.construction.vectors[arrow.name]
        assert math.dist(arrow.tail, nodes[arrow.figure, vector.tail]) < PEN_WIDTH_MM
        assert math.dist(arrow.tip, nodes[arrow.figure, vector.head]) < PEN_WIDTH_MM


def test_every_force_plan_is_drawn_also_where_its_first_force_was_not_entered():
    task, reading, outcomes = measured("pump-forces", left_out={"R_34_t", "R_02_t"})
    scene = drawn(task, reading, outcomes).scene
    entered = {name for figure in reading.figures.values() for name in figure.vectors}
    assert {arrow.name for arrow in scene.arrows} == entered
    tips = {arrow.name: arrow.tip for arrow in scene.arrows}
    tails = {arrow.name: arrow.tail for arrow in scene.arrows}
    # Head to tail, over what is missing.
    assert math.dist(tails["F_iD"], tips["F_i4"]) == pytest.approx(0.0)
    assert math.dist(tips["F_i2"], tails["R_02"]) == pytest.approx(0.0)


def test_what_is_off_does_not_close_and_has_its_ghost():
    task, reading, outcomes = measured(longer={"v_BA": 1.3})
    scene = drawn(task, reading, outcomes).scene
    ghosts = {ghost.name: ghost for ghost in scene.ghosts}
    arrow = next(arrow for arrow in scene.arrows if arrow.name == "v_BA")
    b = next(dot.at for dot in scene.dots if dot.name == "b")
    assert math.dist(arrow.tip, b) > 1.0 or math.dist(ghosts["v_BA"].tip, b) < PEN_WIDTH_MM
    assert math.dist(ghosts["v_BA"].tail, arrow.tail) == 0.0
    assert math.dist(ghosts["v_BA"].tip, arrow.tip) == pytest.approx(0.3 / 1.3 * arrow.length, abs=0.01)


def test_a_plan_lies_inside_its_page_and_beside_the_other():
    task, reading, outcomes = measured(longer={"a_D": 1.2})
    scene = drawn(task, reading, outcomes).scene
    wide, high = scene.page_mm
    spans = {}
    for one in (*scene.arrows, *scene.ghosts):
        for x, y in (one.tail, one.tip):
            assert 0.0 < x < wide
            assert 0.0 < y < high
            low, far = spans.get(one.figure, (x, x))
            spans[one.figure] = (min(low, x), max(far, x))
    assert len(spans) == 2
    for left, right in pairwise(sorted(spans.values())):
        assert left[1] < right[0]


def test_what_no_vector_leads_to_is_left_out():
    # v_CA and v_CB start at a and b: without v_A, v_B and v_BA nothing leads there.
    task, reading, outcomes = measured(left_out=("v_A", "v_B", "v_BA", "v_C"))
    names = {arrow.name for arrow in drawn(task, reading, outcomes).scene.arrows}
    assert "v_D" in names
    assert not {"v_CA", "v_CB"} & names


def test_lengths_alone_are_drawn_only_where_directions_may_be_shown():
    task, reading, outcomes = measured(directions=False)
    assert drawn(task, reading, outcomes, show_expected=False) is None
    assert len(drawn(task, reading, outcomes).scene.arrows) > 10


def test_values_alone_are_no_drawing():
    task, _, outcomes = measured()
    assert drawn(task, Reading({}), outcomes) is None
