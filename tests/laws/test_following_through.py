"""Vectors that follow rightly from a mistake are credited, and the mistake costs; pairs of mistakes too."""

import contextlib
from collections import Counter
from itertools import combinations

import numpy as np
import pytest

from grader.marking.mark import judge
from reference.construction.mistakes import Drawing, affected, single_mistakes
from samples.simulation import PERFECT, TYPICAL
from tests.examples import examples
from tests.hands import SOURCES, drawn_by, drawn_nodes, handed_in, task_for

CREDITED = {"full", "follow_through"}
LARGEST_MM = 350.0
"""Larger than that no plan is drawn."""
CLEAR = 3.0
"""Tolerances by which a vector is off so that the mistake must cost something."""
CASES = [
    ("pump", 7, None), ("pump", 24, None), ("press", None, 1), ("press", None, 3), ("engine", 7, None),
    ("shaper", 9, None), ("piston", 10, None),
]  # fmt: skip
LEAST_SINGLE = {"sheet": 0.99, "directions": 0.99, "lengths": 0.98}
LEAST_PAIR = {"sheet": 0.98, "directions": 0.98, "lengths": 0.96}
MISTAKES, PAIRS = 9, 6
"""Drawn by lot for each case and source."""


def mistakes_of(task):
    """Every mistake in one step of the plans that can be drawn on paper."""
    drawing = Drawing(task.construction, task.parameters)
    for figure in task.construction.poles:
        for mistake in single_mistakes(drawing, figure):
            if mistake.code in {"scale_wrong", "rpm_not_converted", "figure_rotated"}:
                continue
            with contextlib.suppress(ValueError):
                nodes = drawn_nodes(task, mistakes=(mistake,))
                if all(np.isfinite(node) and abs(node) < LARGEST_MM for node in nodes.values()):
                    yield mistake


def is_trivial(task, nodes, vector):
    """Return whether next to nothing is left of a vector, so that it cannot be credited."""
    right, own = drawn_nodes(task), nodes
    sizes = [abs(places[vector.head] - places[vector.tail]) for places in (own, right)]
    return sizes[0] < max(1.3 * task.rubric.least_followed_share * sizes[1], task.rubric.tolerance.least_mm)


def is_hidden(task, nodes, wrong):
    """Return whether lengths alone do not show a mistake at its node: it costs where it shows first."""
    right = drawn_nodes(task)
    for vector in task.construction.vectors.values():
        if vector.head in wrong:
            exact, own = (abs(places[vector.head] - places[vector.tail]) for places in (right, nodes))
            if abs(own - exact) > task.rubric.tolerance.length_at(exact):
                return False
    return True


def followed(task, mistakes, hand, lot, source):
    """For each vector that follows from mistakes, whether it is credited or waits for a person."""
    found = list(_followed(task, mistakes, hand, lot, source))
    nodes = drawn_nodes(task, mistakes=mistakes)
    if source == "lengths" and False in found and is_hidden(task, nodes, {one.at for one in mistakes}):
        found.remove(False)
    return found


def _followed(task, mistakes, hand, lot, source):
    nodes = drawn_by(task, hand, lot, mistakes)
    wrong = {mistake.at for mistake in mistakes}
    moved = frozenset().union(*(affected(one, task.construction) for one in mistakes)) - wrong
    vectors = task.construction.vectors
    for outcome in judge(task, handed_in(task, nodes, source)).outcomes:
        vector = vectors.get(outcome.name)
        if vector is None or vector.head not in moved or outcome.verdict == "not_judged":
            continue
        if not is_trivial(task, nodes, vector):
            yield outcome.verdict in CREDITED or outcome.verdict == "review"


def is_clear(task, mistake):
    """Return whether a vector that ends at the mistake's node is clearly off."""
    right, wrong = drawn_nodes(task), drawn_nodes(task, mistakes=(mistake,))
    table = task.rubric.tolerance
    for vector in task.construction.vectors.values():
        exact, own = (places[vector.head] - places[vector.tail] for places in (right, wrong))
        if vector.head != mistake.at or abs(exact) < table.least_mm or abs(own) < table.least_mm:
            continue
        turn = table.direction_at(abs(exact)) or 0.0
        if abs(abs(own) - abs(exact)) > CLEAR * table.length_at(abs(exact)):
            return True
        if abs(np.degrees(np.angle(own / exact))) > CLEAR * turn:
            return True
    return False


@pytest.mark.parametrize("source", SOURCES)
def test_what_follows_from_one_mistake_is_credited_and_the_mistake_costs(source):
    lot, found = np.random.default_rng(11), Counter()
    for case in CASES:
        task = task_for(*case)
        every = list(mistakes_of(task))
        for mistake in (every[index] for index in lot.permutation(len(every))[: examples(MISTAKES)]):
            for hand in (PERFECT, TYPICAL):
                with contextlib.suppress(ValueError):
                    found.update(followed(task, (mistake,), hand, lot, source))
            if source == "sheet" and is_clear(task, mistake):
                outcomes = judge(
                    task, handed_in(task, drawn_nodes(task, mistakes=(mistake,)), source)
                ).outcomes
                assert {one.verdict for one in outcomes} & {"none", "partial", "review"}, mistake
    assert found[True] >= LEAST_SINGLE[source] * found.total(), found


@pytest.mark.slow
@pytest.mark.parametrize("source", SOURCES)
def test_what_follows_from_two_mistakes_is_credited(source):
    lot, found = np.random.default_rng(12), Counter()
    for case in CASES:
        task = task_for(*case)
        pairs = [pair for pair in combinations(mistakes_of(task), 2) if pair[0].at != pair[1].at]
        for index in lot.permutation(len(pairs))[:PAIRS]:
            with contextlib.suppress(ValueError):
                nodes = drawn_nodes(task, mistakes=pairs[index])
                if all(np.isfinite(node) and abs(node) < LARGEST_MM for node in nodes.values()):
                    found.update(followed(task, pairs[index], PERFECT, lot, source))
    assert found[True] >= LEAST_PAIR[source] * found.total(), found
