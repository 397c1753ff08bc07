"""The price of a mistake: each of two costs once, anywhere in the rubric; blank costs as much as zero."""

import numpy as np
from hypothesis import assume, given, settings
from hypothesis import strategies as st

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from reference.construction.elements import View
from reference.construction.mistakes import Drawing, changed_step, single_mistakes
from reference.mechanism import Mechanism
from tests.examples import examples
from tests.hands import drawn_nodes, measured, sheet, without
from tests.laws.test_marking_any_mechanism import task_for
from tests.unit.comparison.rubrics import with_rubric

LARGEST_MM = 400.0
"""Larger than that no plan is drawn."""
CLEAR_MM, LEAST_MM = 8.0, 12.0
"""A mistake moves its node by so much, and the vectors that end there are so long: nobody can overlook it."""
OF_STEPS = frozenset(
    {"parallel_for_perpendicular", "wrong_link", "sense_reversed", "normal_reversed", "normal_missing"}
)
SAME_MM = 1.0
DEAREST = 1.5
"""Points that one mistake costs for certain, of one for each criterion: its own, and a partial mark."""
HALF = 0.5
"""The least share of its own price that the second of two mistakes costs."""
FEW = 40


def nodes_with(task, *mistakes):
    """All nodes with some mistakes; None where they do not fit on paper."""
    try:
        nodes = drawn_nodes(task, mistakes=mistakes)
    except ValueError:
        return None
    places = [place for name, place in nodes.items()]
    return nodes if all(np.isfinite(place) and abs(place) < LARGEST_MM for place in places) else None


def is_clear(task, mistake, nodes):
    """Return whether a mistake moves its node far from its right place, and its vectors are long."""
    view = View({name: np.asarray(place) for name, place in nodes.items()}, task.parameters)
    step = task.construction.step(mistake.at)
    right, wrong = (
        complex(np.ravel(one.place(view))[0]) for one in (step, changed_step(mistake, task.construction))
    )
    vectors = [one for one in task.construction.vectors.values() if one.head == mistake.at]
    sizes = [abs(place - nodes[one.tail]) for one in vectors for place in (right, wrong)]
    long_enough = (
        all(size > LEAST_MM for size in sizes) if mistake.code != "normal_missing" else sizes[0] > LEAST_MM
    )
    return bool(vectors) and abs(right - wrong) > CLEAR_MM and long_enough


def clear_mistakes(task):
    """The mistakes of single steps that nobody can overlook."""
    drawing, right = Drawing(task.construction, task.parameters), drawn_nodes(task)
    for figure in task.construction.poles:
        for mistake in single_mistakes(drawing, figure):
            if mistake.code in OF_STEPS and nodes_with(task, mistake) and is_clear(task, mistake, right):
                yield mistake


def loss(task, *mistakes, open_ones=0.5):
    """The points that a perfect hand loses by mistakes, as the sheet shows them.

    Arguments: `open_ones` is the share that counts as lost of what waits for a person.
    """
    outcomes = judge(task, Submission(readings=(sheet(task, mistakes=mistakes),))).outcomes
    asked = [one for one in outcomes if one.name in task.construction.vectors and one.verdict != "not_judged"]
    return sum(1.0 - one.shares[-1] + open_ones * (one.shares[-1] - one.shares[0]) for one in asked)


def is_turned_plan(task, nodes):
    """Return whether two mistakes together draw the same as one: a plan turned as a whole."""
    right = drawn_nodes(task)
    return any(
        all(abs(nodes[step.node] - 1j**quarters * right[step.node]) < SAME_MM for step in steps)
        for figure, steps in task.construction.figures.items()
        if figure in task.construction.poles
        for quarters in (1, 2, 3)
    )


def two_of(task, lot):
    """Two clear mistakes at different nodes, of which the second is clear after the first, too."""
    every = list(clear_mistakes(task))
    assume(len(every) > 1)
    order = [step.node for step in task.construction.steps]
    first, second = sorted(lot.sample(every, 2), key=lambda one: order.index(one.at))
    assume(first.at != second.at)
    before, both = nodes_with(task, first), nodes_with(task, first, second)
    assume(both is not None and is_clear(task, second, before) and not is_turned_plan(task, both))
    return first, second


@given(mechanism=..., lot=st.randoms())
@settings(max_examples=examples(FEW))
def test_the_second_of_two_mistakes_costs_at_least_half_of_what_it_costs_alone(mechanism: Mechanism, lot):
    task = task_for(mechanism)
    first, second = two_of(task, lot)
    alone, other, both = loss(task, first), loss(task, second), loss(task, first, second)
    assert both >= alone + HALF * other - 1e-6, (first, second)
    assert both >= other + HALF * alone - 1e-6, (first, second)


@given(mechanism=..., lot=st.randoms())
@settings(max_examples=examples(FEW))
def test_a_single_mistake_costs_one_criterion(mechanism: Mechanism, lot):
    task = task_for(mechanism)
    every = list(clear_mistakes(task))
    assume(every)
    assert loss(task, lot.choice(every), open_ones=0.0) <= DEAREST


@given(mechanism=..., lot=st.randoms())
@settings(max_examples=examples(FEW // 2))
def test_a_price_does_not_depend_on_the_order_of_the_rubric(mechanism: Mechanism, lot):
    task = task_for(mechanism)
    every = list(clear_mistakes(task))
    assume(every)
    submission = Submission(readings=(sheet(task, mistakes=(lot.choice(every),)),))
    shuffled = lot.sample(task.rubric.criterion, len(task.rubric.criterion))
    other = judge(with_rubric(task, criterion=shuffled), submission)
    assert other.score.points == judge(task, submission).score.points


@given(mechanism=..., lot=st.randoms())
@settings(max_examples=examples(FEW // 2))
def test_a_component_left_blank_costs_as_much_as_a_zero(mechanism: Mechanism, lot):
    task = task_for(mechanism)
    every = [one for one in clear_mistakes(task) if one.code == "normal_missing"]
    assume(every)
    mistake = lot.choice(every)
    (name,) = [one.name for one in task.construction.vectors.values() if one.head == mistake.at]
    reading = measured(task, mistakes=(mistake,))
    zero = judge(task, Submission(measured=reading)).score
    blank = judge(task, Submission(measured=without(reading, name))).score
    assert blank.points[name] == zero.points[name] == 0.0
    assert abs(blank.low - zero.low) <= HALF
