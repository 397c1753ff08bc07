"""A right drawing loses nothing, whatever the mechanism and its condition: small errors are no mistakes."""

from collections import Counter

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.comparison.criteria import compare
from grader.comparison.task import task_of
from grader.rubric import rubric_of
from reference.authored.assignment import built_in, load_assignment
from reference.mechanism import Mechanism
from samples.simulation import CAREFUL, TYPICAL
from tests.examples import examples
from tests.hands import SOURCES, drawn_by, handed_in
from tests.laws.test_marking_any_mechanism import task_for

CHARGED = {"none", "partial"}
DRAWINGS = 24
"""By a careful and by a typical hand, of each assignment."""
SLIPS = 0.01
"""One slip in forty is over 3.5 times its size: such a share of criteria may lose a part of its marks."""
OPEN = 0.05
"""Share of criteria that a person may have to look at."""


def verdicts_of(task, hand, lot, sources=SOURCES):
    """All verdicts on one right drawing, handed in every way."""
    nodes = drawn_by(task, hand, lot)
    for source in sources:
        for outcome in compare(task, handed_in(task, nodes, source)).outcomes:
            if outcome.verdict != "not_judged":
                yield outcome


@pytest.mark.parametrize("name", built_in())
def test_right_drawings_of_careful_hands_lose_nothing_and_of_typical_ones_next_to_nothing(name):
    assignment = load_assignment(name)
    rubric, variants = rubric_of(assignment), assignment.variants()
    lot = np.random.default_rng(5)
    typical: Counter[str] = Counter()
    for index in range(examples(DRAWINGS)):
        task = task_of(assignment, rubric, variants[index % len(variants)])
        careful = {one.name: one.verdict for one in verdicts_of(task, CAREFUL, lot) if one.verdict in CHARGED}
        assert not careful, (task.variant, careful)
        typical.update(one.verdict for one in verdicts_of(task, TYPICAL, lot))
    assert sum(typical[one] for one in CHARGED) <= SLIPS * typical.total()
    assert typical["none"] == 0
    assert typical["review"] <= OPEN * typical.total()


@given(mechanism=..., seed=st.integers(0, 10_000))
@settings(max_examples=examples(15))
def test_a_careful_hands_right_drawing_of_any_mechanism_loses_nothing(mechanism: Mechanism, seed):
    task = task_for(mechanism)
    charged = [
        one
        for one in verdicts_of(task, CAREFUL, np.random.default_rng(seed), SOURCES[:1])
        if one.verdict in CHARGED
    ]
    assert not charged
