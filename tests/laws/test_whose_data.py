"""The data that a drawing follows are found whatever a student may choose freely."""

from dataclasses import replace
from typing import NamedTuple

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from grader.comparison.evidence import Submission, gather
from grader.comparison.task import task_of
from grader.given_data.owner import owner_of
from grader.marking.mark import judge
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Figure, Reading
from samples.simulation import CAREFUL, TYPICAL
from samples.simulation.wording import declared_texts
from tests.bench.judging_students import ASSIGNMENTS, assignment_named
from tests.examples import examples
from tests.hands import drawn_by, drawn_nodes, handed_in, measured, sheet

FEW = 20
APART = 4
"""Variants of nearer numbers may draw the same."""
PLANS = (VELOCITY_PLAN, ACCELERATION_PLAN)


class Copy(NamedTuple):
    """The own variant, and another one whose drawing differs, by their places among all."""

    assignment: str
    own: int
    other: int

    @property
    def tasks(self):
        assignment, rubric = assignment_named(self.assignment)
        variants = assignment.variants()
        return tuple(task_of(assignment, rubric, variants[place]) for place in (self.own, self.other))


@st.composite
def copies(draw):
    name = draw(st.sampled_from(ASSIGNMENTS))
    count = len(assignment_named(name)[0].variants())
    own = draw(st.integers(0, count - 1))
    step = draw(st.integers(min(APART, count // 2), max(count // 2, 1)))
    return Copy(name, own, (own + step) % count)


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


@settings(max_examples=examples(FEW))
@given(copies(), st.floats(0.5, 2.0), st.floats(0.5, 2.0))
def test_no_declared_scale_hides_whose_data_a_drawing_follows(copy, kv, ka):
    task, other = copy.tasks
    plain = Submission(measured=measured(other))
    declared = {"kv": kv * task.rule_scales["kv"], "ka": ka * task.rule_scales["ka"]}
    told, beside = owner(task, plain), owner(task, replace(plain, declared=declared_texts(declared)))
    assert told is not None
    assert beside is not None
    assert told.not_own > 0.5
    assert beside.not_own > 0.5


@settings(max_examples=examples(FEW))
@given(copies(), st.floats(0.7, 1.4), st.floats(0.7, 1.4))
def test_the_scales_drawn_with_do_not_change_whose_data_they_are(copy, kv, ka):
    task, other = copy.tasks
    by = {VELOCITY_PLAN: kv, ACCELERATION_PLAN: ka}
    for directions in (True, False):
        for drawn in (task, other):
            reading = measured(drawn, directions=directions)
            first, second = (owner(task, Submission(measured=one)) for one in (reading, scaled(reading, by)))
            assert (first is None) == (second is None)


@settings(max_examples=examples(FEW))
@given(copies(), st.floats(-20.0, 20.0))
@example(Copy("shaper", 1, 6), -8.46)
def test_a_sheet_turned_on_the_scanner_has_the_same_owner(copy, turn_deg):
    task, other = copy.tasks
    for drawn in (task, other):
        upright, turned = (
            owner(task, Submission(readings=(sheet(drawn, turn_deg=one),))) for one in (0.0, turn_deg)
        )
        assert (upright is None) == (turned is None)


@settings(max_examples=examples(FEW))
@given(copies(), st.sampled_from(["sheet", "directions"]), st.integers(0, 10_000))
def test_what_is_copied_wholly_is_never_marked_without_a_person(copy, source, seed):
    task, other = copy.tasks
    nodes = drawn_by(other, CAREFUL, np.random.default_rng(seed))
    copied = replace(handed_in(other, nodes, source), declared=declared_texts(task.rule_scales))
    assert judge(task, copied).score.total is None


@settings(max_examples=examples(FEW))
@given(copies(), st.sampled_from(["sheet", "directions", "lengths"]), st.integers(0, 10_000))
def test_own_data_are_nobody_elses(copy, source, seed):
    task, _ = copy.tasks
    drawn = handed_in(task, drawn_by(task, TYPICAL, np.random.default_rng(seed)), source)
    assert owner(task, drawn) is None


@settings(max_examples=examples(FEW))
@given(copies(), st.sampled_from(PLANS))
def test_half_a_copy_waits_for_a_person_whichever_half_it_is(copy, plan):
    task, other = copy.tasks
    own, theirs = (handed_in(one, drawn_nodes(one), "directions").measured for one in (task, other))
    half = Reading({**own.figures, plan: theirs.figures[plan]})
    found = owner(task, Submission(measured=half))
    whole = owner(task, Submission(measured=theirs))
    told = seen(found) is not None
    # Of a plan with few directions the other half says too little.
    few = sum(one.direction_deg is not None for one in theirs.figures[plan].vectors.values()) < 6
    assert told or few or whole is None
