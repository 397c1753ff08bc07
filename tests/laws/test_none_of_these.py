"""Whatever the mechanism: vectors that follow no construction carry no name."""

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.comparison.evidence import Submission
from grader.marking.mark import judge
from reference.mechanism import Mechanism
from tests.examples import examples
from tests.hands import nonsense
from tests.laws.test_marking_any_mechanism import task_for

FEW = 8
LEAST_VECTORS = 8
"""Fewer vectors may fit something by chance."""
SURE = 0.9


@given(mechanism=..., seed=st.integers(0, 10_000), closed=st.booleans(), directed=st.booleans())
@settings(max_examples=examples(FEW))
def test_random_vectors_carry_no_name_on_any_mechanism(
    mechanism: Mechanism, seed: int, closed: bool, directed: bool
):
    task = task_for(mechanism)
    reading = nonsense(task, np.random.default_rng(seed), closed=closed, directed=directed)
    if sum(len(figure.vectors) for figure in reading.figures.values()) < LEAST_VECTORS:
        return
    judgement = judge(task, Submission(measured=reading))
    assert not [one for one in judgement.mistakes if one.confidence >= SURE and one.code != "vector_missing"]
