"""Whose data a drawing follows: what may be chosen freely does not change the answer."""

from dataclasses import replace

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.comparison.evidence import Submission, gather
from grader.comparison.task import task_of
from grader.given_data.owner import owner_of
from grader.marking.mark import judge
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Figure, Reading
from samples.simulation import CAREFUL, TYPICAL
from samples.simulation.wording import declared_texts
from tests.bench.judging_students import ASSIGNMENTS, assignment_named
from tests.hands import drawn_by, drawn_nodes, handed_in, measured, sheet

FEW = 20
APART = 4
"""Variants of nearer numbers may draw the same."""
PLANS = (VELOCITY_PLAN, ACCELERATION_PLAN)


@st.composite
def copies(draw):
    """The own task, and that of another variant whose drawing differs."""
    assignment, rubric = assignment_named(draw(st.sampled_from(ASSIGNMENTS)))
    variants = assignment.variants()
    own = draw(st.integers(0, len(variants) - 1))
    step = draw(st.integers(min(APART, len(variants) // 2), max(len(variants) // 2, 1)))
    return tuple(task_of(assignment, rubric, variants[k]) for k in (own, (own + step) % len(variants)))


def owner(task, submission):
    return owner_of(task, gather(task, submission), submission.declared)


def seen(found):
    return None if found is None else (found.data.kind, found.data.variant, found.part)


def scaled(reading, by):
    """A reading with each plan drawn at another scale."""
    figures = {}
    for plan, figure in reading.figures.items():
        vectors = {
            name: replace(one, length_mm=by[plan] * one.length_mm) for name, one in figure.vectors.items()
        }
        figures[plan] = Figure(figure.nodes, vectors)
    return replace(reading, figures=figures)


@settings(max_examples=FEW)
@given(copies(), st.floats(0.5, 2.0), st.floats(0.5, 2.0))
def test_no_declared_scale_hides_whose_data_a_drawing_follows(tasks, kv, ka):
    task, other = tasks
    plain = Submission(measured=measured(other))
    declared = {"kv": kv * task.rule_scales["kv"], "ka": ka * task.rule_scales["ka"]}
    told, beside = owner(task, plain), owner(task, replace(plain, declared=declared_texts(declared)))
    assert told is not None
    assert beside is not None
    assert told.not_own > 0.5
    assert beside.not_own > 0.5


@settings(max_examples=FEW)
@given(copies(), st.floats(0.7, 1.4), st.floats(0.7, 1.4))
def test_the_scales_drawn_with_do_not_change_whose_data_they_are(tasks, kv, ka):
    task, other = tasks
    by = {VELOCITY_PLAN: kv, ACCELERATION_PLAN: ka}
    for directions in (True, False):
        for drawn in (task, other):
            reading = measured(drawn, directions=directions)
            first, second = (owner(task, Submission(measured=one)) for one in (reading, scaled(reading, by)))
            assert (first is None) == (second is None)


@settings(max_examples=FEW)
@given(copies(), st.floats(-20.0, 20.0))
def test_a_sheet_turned_on_the_scanner_has_the_same_owner(tasks, turn_deg):
    task, other = tasks
    for drawn in (task, other):
        upright, turned = (
            owner(task, Submission(readings=(sheet(drawn, turn_deg=one),))) for one in (0.0, turn_deg)
        )
        assert (upright is None) == (turned is None)


@settings(max_examples=FEW)
@given(copies(), st.sampled_from(["sheet", "directions"]), st.integers(0, 10_000))
def test_what_is_copied_wholly_is_never_marked_without_a_person(tasks, source, seed):
    task, other = tasks
    nodes = drawn_by(other, CAREFUL, np.random.default_rng(seed))
    copied = replace(handed_in(other, nodes, source), declared=declared_texts(task.rule_scales))
    assert judge(task, copied).score.total is None


@settings(max_examples=FEW)
@given(copies(), st.sampled_from(["sheet", "directions", "lengths"]), st.integers(0, 10_000))
def test_own_data_are_nobody_elses(tasks, source, seed):
    task, _ = tasks
    drawn = handed_in(task, drawn_by(task, TYPICAL, np.random.default_rng(seed)), source)
    assert owner(task, drawn) is None


@settings(max_examples=FEW)
@given(copies(), st.sampled_from(PLANS))
def test_half_a_copy_waits_for_a_person_whichever_half_it_is(tasks, plan):
    task, other = tasks
    own, theirs = (handed_in(one, drawn_nodes(one), "directions").measured for one in (task, other))
    half = Reading({**own.figures, plan: theirs.figures[plan]})
    found = owner(task, Submission(measured=half))
    whole = owner(task, Submission(measured=theirs))
    told = seen(found) is not None
    # Of a plan with few directions the other half says too little.
    few = sum(one.direction_deg is not None for one in theirs.figures[plan].vectors.values()) < 6
    assert told or few or whole is None
