"""The perfect hand has full marks everywhere; 0.9 of a tolerance costs nothing, 1.1 that criterion alone."""

import cmath
import random

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.outcomes import CHARGED
from grader.rubric import HandTable, rubric_of
from reference.authored.assignment import built_in, load_assignment
from reference.construction.mistakes import Drawing, single_mistakes
from tests.examples import examples, sample, slow
from tests.hands import changed, drawn_nodes, measured, sheet, task_for

WITHIN, BEYOND = 0.9, 1.1
"""Shares of a tolerance."""
NO_HAND = HandTable(sigmas=0.0)
"""Tolerances as they stand, widened for nobody's hand."""
SAMPLE = 40
"""Perturbations tried per assignment, drawn by lot from all variants and criteria."""


def variants():
    for name in built_in():
        for variant in load_assignment(name).variants():
            yield pytest.param(name, variant.n, variant.position, id=f"{name} {variant}")


def lost(judgement):
    return [one.criterion for one in judgement.outcomes if one.verdict not in {"full", "not_judged"}]


@pytest.mark.parametrize(("name", "n", "position"), sample(variants()))
def test_a_perfect_hand_has_full_marks(name, n, position):
    task = task_for(name, n, position)
    values = {**{vector: abs(real) for vector, real in task.real.items()}, **task.rates}
    for directions in (True, False):
        reading = measured(task, directions=directions)
        judgement = judge(task, Submission(measured=reading, values=values))
        assert lost(judgement) == []
        assert judgement.score.total == judgement.score.maximum
        assert judgement.mistakes == ()


def perturbations(task, share):
    """Every vector made longer, shorter, turned left and right by a share of its tolerance."""
    reading = measured(task)
    for criterion in task.rubric.criterion:
        if criterion.vector is None:
            continue
        tolerance, name = task.rubric.tolerance_of(criterion), criterion.name
        drawn = next((f.vectors[name] for f in reading.figures.values() if name in f.vectors), None)
        if drawn is None:
            continue  # drawn again on the sketch
        step = share * tolerance.length_at(drawn.length_mm)
        turn = tolerance.direction_at(drawn.length_mm)
        for sign in (1.0, -1.0):
            if drawn.length_mm + sign * step >= 0.0:
                yield criterion.id, changed(reading, name, length_mm=drawn.length_mm + sign * step)
            if turn is not None:
                degrees = (drawn.direction_deg + sign * share * turn) % 360.0
                yield criterion.id, changed(reading, name, direction_deg=degrees)


@pytest.mark.parametrize("name", built_in())
def test_a_tolerance_is_where_the_rubric_has_it(name):
    assignment = load_assignment(name)
    rubric = rubric_of(assignment).model_copy(update={"hand": NO_HAND})
    lot = random.Random(name)
    variants = assignment.variants()
    for _ in range(examples(SAMPLE)):
        task = task_of(assignment, rubric, lot.choice(variants))
        for share in (WITHIN, BEYOND):
            criterion, reading = lot.choice(list(perturbations(task, share)))
            judgement = judge(task, Submission(measured=reading))
            assert lost(judgement) == ([] if share < 1.0 else [criterion]), (task.variant, criterion)


TASKS = [("pump", 8, None), ("shaper", 5, None)]


@pytest.mark.parametrize(("name", "n", "position"), TASKS)
@pytest.mark.parametrize("source", ["sheet", "lengths", *slow("directions")])
def test_one_mistake_of_a_perfect_hand_costs_the_vectors_of_one_node(name, n, position, source):
    """Whatever it is: what is drawn from there follows, and is not charged a second time."""
    task = task_for(name, n, position)
    drawing = Drawing(task.construction, task.parameters)
    every = (one for plan in task.construction.figures for one in single_mistakes(drawing, plan))
    for mistake in sample(every):
        if not all(map(cmath.isfinite, drawn_nodes(task, mistakes=(mistake,)).values())):
            continue
        if source == "sheet":
            submission = Submission(readings=(sheet(task, mistakes=(mistake,)),))
        else:
            directions = source == "directions"
            submission = Submission(measured=measured(task, directions=directions, mistakes=(mistake,)))
        charged = [one.name for one in judge(task, submission).outcomes if one.verdict in CHARGED]
        vectors = task.construction.vectors
        assert len({vectors[one].head for one in charged if one in vectors}) <= 1, (mistake, charged)
