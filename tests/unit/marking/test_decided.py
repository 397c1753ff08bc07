"""A person's verdict in the place of the program's: its points, what is said of it, and the mistakes left."""

from dataclasses import replace

import pytest

from grader.documents import Quantity, Tolerance
from grader.marking.decided import decide
from grader.marking.mark import score
from grader.outcomes import Judgement, NamedMistake, Outcome
from grader.records import Reason
from grader.rubric import load_rubric
from grader.tables.decisions import Decision
from reference.construction.mistakes import Mistake

RUBRIC = load_rubric("pump-velocity")
DOUBTFUL, LONG, RIGHT = Reason("doubtful"), Reason("too_long"), Reason("right")
FOLLOWS, SHORT = Reason("follows", {"what": "nodes"}), Reason("too_short_to_judge")


def outcome(name, verdict="review", *reasons):
    possible = ("none", "full") if verdict == "review" else (verdict, verdict)
    shares = (0.0, 1.0) if verdict == "review" else ()
    return Outcome(
        name, name, verdict, Quantity(), Quantity(), Tolerance(), 0.8, reasons, possible, shares=shares
    )


def judged(*changed, mistakes=()):
    by_id = {one.criterion: one for one in changed}
    rest = [outcome(one.id, "full", RIGHT) for one in RUBRIC.criterion if one.id not in by_id]
    outcomes = (*changed, *rest)
    return Judgement(outcomes, tuple(mistakes), {}, score(RUBRIC, outcomes))


def decided(judgement, verdict, points=None, criterion="v_D"):
    found = decide(judgement, RUBRIC, [Decision("s1", None, criterion, verdict, points)])
    return found, next(one for one in found.outcomes if one.criterion == criterion)


@pytest.mark.parametrize(
    ("reasons", "verdict", "said"),
    [
        ((DOUBTFUL,), "full", ["right"]),
        ((DOUBTFUL, RIGHT), "full", ["right"]),
        ((DOUBTFUL, SHORT), "full", ["too_short_to_judge"]),
        ((DOUBTFUL, LONG), "full", ["decided"]),
        ((DOUBTFUL, LONG), "none", ["too_long"]),
        ((DOUBTFUL, FOLLOWS, LONG), "partial", ["too_long"]),
        ((DOUBTFUL, FOLLOWS, LONG), "follow_through", ["follows"]),
        ((DOUBTFUL, RIGHT), "none", ["decided"]),
        ((DOUBTFUL, LONG), "follow_through", ["decided"]),
        ((LONG,), "not_judged", ["decided"]),
    ],
)
def test_what_was_read_is_said_as_far_as_it_fits_the_persons_verdict(reasons, verdict, said):
    _, found = decided(judged(outcome("v_D", "review", *reasons)), verdict)
    assert [reason.code for reason in found.reasons] == said


def test_a_verdict_that_is_confirmed_keeps_all_that_is_said_of_it():
    _, found = decided(judged(outcome("v_D", "partial", LONG, FOLLOWS)), "partial")
    assert found.reasons == (LONG, FOLLOWS)


def test_points_are_the_rubrics_share_or_those_given():
    worth = RUBRIC.points["v_D"]
    for verdict, points, expected in (
        ("full", None, worth), ("follow_through", None, worth), ("none", None, 0.0),
        ("partial", None, 0.5 * worth), ("partial", 0.2, 0.2), ("follow_through", 0.2, 0.2),
    ):  # fmt: skip
        found, _ = decided(judged(outcome("v_D", "review", DOUBTFUL)), verdict, points)
        assert found.score.points["v_D"] == pytest.approx(expected)
        assert not found.needs_review


def test_a_mistake_that_explained_only_what_is_right_is_not_named():
    mistakes = [
        NamedMistake(Mistake("sense_reversed", "d"), ("v_D",), 0.9),
        NamedMistake(Mistake("wrong_link", "c"), ("v_D", "v_C"), 0.9),
    ]
    found, _ = decided(
        judged(outcome("v_D", "none", LONG), outcome("v_C", "none", LONG), mistakes=mistakes), "full"
    )
    assert [(one.code, one.explains) for one in found.mistakes] == [("wrong_link", ("v_C",))]


def test_a_mistake_is_the_cause_of_what_a_person_decided_to_be_wrong():
    mistake = NamedMistake(Mistake("sense_reversed", "d"), ("v_D",), 0.9)
    _, found = decided(judged(outcome("v_D", "review", DOUBTFUL, LONG), mistakes=[mistake]), "none")
    assert (found.mistake, found.cause) == ("sense_reversed", mistake)


def test_what_is_left_open_is_settled_where_too_little_is_at_stake():
    least = min(RUBRIC.points, key=RUBRIC.points.get)
    rubric = RUBRIC.model_copy(
        update={"doubt": RUBRIC.doubt.model_copy(update={"stake": RUBRIC.points[least] / RUBRIC.max_score})}
    )
    both = judged(outcome("v_D", "review", DOUBTFUL), outcome(least, "review", DOUBTFUL))
    found = decide(both, rubric, [Decision("s1", None, "v_D", "none")])
    left = next(one for one in found.outcomes if one.criterion == least)
    assert (left.verdict, left.reasons[0].code) == ("full", "at_stake")


def test_nothing_decided_changes_nothing():
    before = judged(outcome("v_D", "review", DOUBTFUL))
    assert decide(before, RUBRIC, [Decision("s1", None, "comment", "", comment="Well.")]) is before
    assert replace(before) == before
