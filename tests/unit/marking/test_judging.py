"""Judging as a whole: what is seen on a sheet beside its lines."""

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.records import VELOCITY_PLAN, Reading, Swapped
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment

SEEN, DOUBTFUL = 0.97, 0.55


@pytest.fixture(scope="module")
def task():
    assignment = load_assignment("pump")
    return task_of(assignment, rubric_of(assignment), assignment.variants()[0])


def mistakes(task, *swapped: Swapped):
    return judge(task, Submission(readings=(Reading({}, swapped=swapped),))).mistakes


def test_letters_seen_at_each_others_node_are_a_mistake_of_all_vectors_that_end_there(task):
    (found,) = mistakes(task, Swapped(VELOCITY_PLAN, "b", "c", SEEN))
    assert (found.code, found.at, found.confidence) == ("labels_swapped", "b", SEEN)
    assert found.mistake.other == ("b", "c")
    named = {one.name for one in task.rubric.criterion if one.id in found.explains}
    assert {"v_B", "v_C"} <= named
    assert not named & {"v_A", "v_D", "a_B"}


def test_swapped_letters_are_told_once_and_not_where_they_are_doubtful(task):
    twice = [Swapped(VELOCITY_PLAN, "b", "c", SEEN), Swapped(VELOCITY_PLAN, "c", "b", SEEN)]
    assert len(mistakes(task, *twice)) == 1
    assert mistakes(task, Swapped(VELOCITY_PLAN, "b", "c", DOUBTFUL)) == ()
