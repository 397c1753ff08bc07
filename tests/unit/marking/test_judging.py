"""Judging as a whole: what is seen on a sheet beside its lines."""

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.outcomes import CHARGED
from grader.records import VELOCITY_PLAN, Reading, Swapped
from grader.rubric import rubric_of
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import Mistake
from tests.hands import measured, task_for, without

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


# What one mistake costs, by lengths alone ------------------------------------------------------------


def charged_by_lengths(task, mistake, *, by_similarity=False, left_out=()):
    """The vectors that lose points of a perfect hand's lengths with one mistake."""
    reading = measured(task, directions=False, mistakes=(mistake,), by_similarity=by_similarity)
    judgement = judge(task, Submission(measured=without(reading, *left_out)))
    return {one.name for one in judgement.outcomes if one.verdict in CHARGED}


@pytest.mark.parametrize("n", range(1, 12, 2))
def test_what_follows_from_an_image_by_similar_triangles_is_not_charged(n):
    """The image of C was found from a wrong b' by similarity: d' follows from it rightly."""
    left_out = ("a_CA_n", "a_CA_t", "a_CB_n", "a_CB_t")
    mistake = Mistake("normal_from_absolute", "n_BA")
    assert charged_by_lengths(task_for("pump", n), mistake, by_similarity=True, left_out=left_out) <= {
        "a_BA_n"
    }
