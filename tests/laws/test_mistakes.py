"""A single mistake moves what is drawn from it and nothing else, on random mechanisms of all groups."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from reference.construction.derive import construction_of
from reference.construction.graph import evaluate, parameters_of
from reference.construction.mistakes import Drawing, affected, commit, single_mistakes
from reference.mechanism import Mechanism

MOVED = 1e-9
"""Share of the drawing's size."""
TRIED = 12


@given(st.from_type(Mechanism), st.randoms(use_true_random=False), st.booleans())
def test_a_mistake_moves_only_what_is_drawn_from_it(mechanism, lot, similar):
    construction = construction_of(mechanism, plate_by_similarity=similar)
    parameters = parameters_of(mechanism, *map(np.asarray, (0.01, 0.1, 1.0)))
    right = evaluate(construction, parameters)
    size = max(float(np.max(np.abs(place))) for place in right.values())
    drawing = Drawing(construction, parameters)
    mistakes = [mistake for figure in construction.figures for mistake in single_mistakes(drawing, figure)]
    for mistake in lot.sample(mistakes, min(TRIED, len(mistakes))):
        wrong_drawing = commit(mistake, drawing)
        wrong = evaluate(wrong_drawing.construction, wrong_drawing.parameters)
        told = affected(mistake, construction)
        for node in right.keys() - told:
            assert np.max(np.abs(wrong[node] - right[node])) <= MOVED * size, (mistake, node)
        steps = {step.node: step for step in wrong_drawing.construction.steps}
        assert steps.keys() == right.keys()
