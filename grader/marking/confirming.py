"""What an explanation of the drawing says of the vectors that were read in doubt.

Where it is nearly certain what was done, the explanation predicts every vector of the drawing. One that was
read in doubt and lies just where it is predicted was read rightly, however wrong it is.
"""

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from grader.comparison.criteria import Comparison
from grader.comparison.evidence import DrawnVector, Submission
from grader.comparison.task import Task
from grader.marking.diagnosis import drawn_instead
from grader.marking.drawn import case_of
from grader.records import Figure
from reference.construction.graph import evaluate

AGREES, BY_CHANCE = 0.95, 0.03
"""Probabilities that a vector lies where it is predicted: of one read rightly, and of another stroke."""


def confirmed(task: Task, submission: Submission, comparison: Comparison) -> Submission | None:
    """The submission, surer of what its explanation predicts; None where that changes nothing."""
    explanations = () if comparison.explanation is None else comparison.explanation.explanations
    least, evidence = task.rubric.least_confidence, comparison.evidence
    doubtful = {name: one for name, one in evidence.drawn.items() if one.confidence < least}
    if not doubtful or not explanations:
        return None
    instead, wrong = drawn_instead(explanations, case_of(task, evidence, comparison.settled))
    if not wrong:
        return None
    own = {name: np.asarray(place) for name, place in evidence.nodes.items()}
    nodes = evaluate(instead.construction, instead.parameters, given=own)
    surer = {}
    for name, drawn in doubtful.items():
        vector = task.construction.vectors.get(name)
        if vector is not None and vector.tail in nodes and vector.head in nodes:
            predicted = complex(np.ravel(nodes[vector.head] - nodes[vector.tail])[0])
            if _lies_there(task, name, drawn, predicted):
                right = drawn.confidence * AGREES
                surer[name] = right / (right + (1.0 - drawn.confidence) * BY_CHANCE)
    if not surer:
        return None
    ends = {
        node: max(sure for name, sure in surer.items() if node in _ends(task, name))
        for node in {end for name in surer for end in _ends(task, name)}
    }
    readings = tuple(
        replace(one, figures={plan: _surer(figure, surer, ends) for plan, figure in one.figures.items()})
        for one in submission.readings
    )
    return replace(submission, readings=readings)


def _ends(task: Task, name: str) -> tuple[str, str]:
    vector = task.construction.vectors[name]
    return vector.tail, vector.head


def _lies_there(task: Task, name: str, drawn: DrawnVector, predicted: complex) -> bool:
    """Whether a vector was read within the tolerance of a length of where its end is predicted."""
    at, tolerance = drawn.as_complex, task.rubric.tolerance_of(name)
    is_long = abs(predicted) >= tolerance.least_mm
    return at is not None and is_long and abs(at - predicted) <= 2.0 * tolerance.length_at(abs(predicted))


def _surer(figure: Figure, surer: Mapping[str, float], ends: Mapping[str, float]) -> Figure:
    """A figure whose vectors and nodes have at least these confidences."""
    vectors = {
        name: replace(one, confidence=max(one.confidence, surer.get(name, 0.0)))
        for name, one in figure.vectors.items()
    }
    nodes = {
        name: replace(one, confidence=max(one.confidence, ends.get(name, 0.0)))
        for name, one in figure.nodes.items()
    }
    return Figure(nodes, vectors)
