"""A submission that no explanation reaches is said to be so; one with real mistakes in it is not."""

import numpy as np
import pytest

from grader.comparison.evidence import Submission
from grader.feedback.sentences import criterion_feedback
from grader.marking.mark import judge
from grader.marking.report import report_of
from reference.construction.mistakes import Mistake
from samples.simulation import SLOPPY, TYPICAL
from samples.simulation.wording import declared_texts
from tests.hands import SOURCES, drawn_by, handed_in, nonsense, rule_scales, task_for

PUMP = task_for("pump", 7)
DECLARED = declared_texts(rule_scales(PUMP))
SURE = 0.9


def random_sheet(seed, *, closed, directed, plans=None):
    reading = nonsense(PUMP, np.random.default_rng(seed), closed=closed, directed=directed, plans=plans)
    return judge(PUMP, Submission(measured=reading, declared=DECLARED))


@pytest.mark.parametrize("directed", [True, False])
@pytest.mark.parametrize("closed", [True, False])
def test_random_vectors_fit_nothing_and_no_mistake_is_named(closed, directed):
    judgement = random_sheet(0, closed=closed, directed=directed)
    assert judgement.unfit is not None
    assert judgement.unfit.vectors >= judgement.unfit.of / 2
    assert not [one for one in judgement.mistakes if one.confidence >= SURE]
    assert judgement.needs_review


def test_all_that_it_loses_goes_to_a_person():
    judgement = random_sheet(1, closed=False, directed=True)
    assert {one.verdict for one in judgement.outcomes} <= {"review", "full", "not_judged"}


def test_nothing_is_said_to_follow_where_nothing_belongs_together():
    for seed in range(3):
        judgement = random_sheet(seed, closed=True, directed=False)
        reasons = [{reason.code for reason in one.reasons} for one in judgement.outcomes]
        assert not any(codes >= {"not_explained", "follows"} for codes in reasons)


def test_the_report_and_the_sentence_count_the_vectors():
    judgement = random_sheet(1, closed=False, directed=True)
    (problem,) = (one for one in report_of(PUMP, judgement, "s1").problems if one.code == "not_explained")
    of = judgement.unfit.of
    assert (
        problem.message
        == f"These vectors do not belong together: {judgement.unfit.vectors} of {of} fit nothing."
    )
    waiting = next(one for one in judgement.outcomes if one.verdict == "review")
    assert f"{judgement.unfit.vectors} of {of}" in criterion_feedback(waiting, "en")


@pytest.mark.parametrize("directed", [True, False])
def test_one_plan_of_nonsense_leaves_the_other_one_as_it_is(directed):
    judgement = random_sheet(2, closed=True, directed=directed, plans=("acceleration_plan",))
    verdicts = {one.name: one.verdict for one in judgement.outcomes}
    assert judgement.unfit is not None
    assert verdicts["v_B"] == verdicts["v_BA"] == "full"
    assert "review" in {verdicts["a_B"], verdicts["a_BA_t"]}


SEVERAL = [
    (Mistake("sense_reversed", "a"), Mistake("normal_reversed", "n_BA")),
    (Mistake("parallel_for_perpendicular", "b", 0), Mistake("normal_missing", "n_B")),
    (
        Mistake("parallel_for_perpendicular", "b", 0),
        Mistake("normal_reversed", "n_BA"),
        Mistake("wrong_link", "d'", 0, other=("O2", "B")),
    ),
]


@pytest.mark.parametrize("hand", [TYPICAL, SLOPPY])
@pytest.mark.parametrize("mistakes", SEVERAL)
@pytest.mark.parametrize("source", SOURCES)
def test_two_or_three_mistakes_are_no_nonsense(hand, mistakes, source):
    nodes = drawn_by(PUMP, hand, np.random.default_rng(3), mistakes)
    assert judge(PUMP, handed_in(PUMP, nodes, source)).unfit is None
