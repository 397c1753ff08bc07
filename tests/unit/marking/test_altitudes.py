"""Right triangles read on the sketch, as the source of normal components that are wrong or unread."""

from dataclasses import replace

import pytest

from grader.feedback.sentences import criterion_feedback
from grader.marking.mark import judge
from grader.records import Altitude, Reason, Unread
from reference.construction.mistakes import Mistake
from reference.construction.triangles import triangles
from samples.simulation.wording import declared_texts
from tests.hands import drawn_nodes, handed_in, rule_scales, task_for

OF_TRIANGLES = {"triangle_shows", "half_turn_missing", "right_triangle", "triangle_wrong", "not_carried_over"}
NBSP = "\N{NO-BREAK SPACE}"
PUMP, PRESS = task_for("pump", 7), task_for("press", position=1)


def altitude(task, name, velocity_factor=1.0):
    """The triangle of a component as a perfect hand draws it, from a velocity so many times too long."""
    nodes = drawn_nodes(task)
    one = next(one for one in triangles(task.construction) if one.vector.name == name)
    tail, head = (nodes[node] for node in one.velocity)
    velocity = velocity_factor * abs(head - tail)
    return Altitude(velocity, velocity**2 / abs(nodes[one.joint] - nodes[one.pin]))


def judged(task, mistake, name="a_B_n", velocity_factor=1.0, unread=False):
    """The outcome on a component of a sheet with its triangle."""
    nodes = drawn_nodes(task, mistakes=(mistake,) if mistake else ())
    submission = handed_in(task, nodes, "sheet")
    (sheet,) = submission.readings
    if unread:
        plan = sheet.figures["acceleration_plan"]
        kept = {key: one for key, one in plan.vectors.items() if key != name}
        ends = {key: one for key, one in plan.nodes.items() if key != task.construction.vectors[name].head}
        figures = {**sheet.figures, "acceleration_plan": replace(plan, vectors=kept, nodes=ends)}
        sheet = replace(sheet, figures=figures, unread=(Unread(name, Reason("no_stroke")),))
    read = replace(sheet, altitudes={name: altitude(task, name, velocity_factor)})
    judgement = judge(task, replace(submission, readings=(read,)))
    without = judge(task, replace(submission, readings=(sheet,)))
    assert judgement.score == without.score
    return next(one for one in judgement.outcomes if one.name == name)


@pytest.mark.parametrize(
    ("task", "mistake", "velocity_factor", "said"),
    [
        (PUMP, None, 1.0, None),
        (PUMP, None, 1.3, None),
        (PUMP, Mistake("normal_reversed", "n_B"), 1.0, "half_turn_missing"),
        (PUMP, Mistake("normal_reversed", "n_B"), 1.3, None),
        (PUMP, Mistake("arithmetic", "n_B", factor=1.3), 1.0, "not_carried_over"),
        (PUMP, Mistake("arithmetic", "n_B", factor=1.69), 1.3, "triangle_wrong"),
        (PUMP, Mistake("arithmetic", "n_B", factor=1.3), 1.5, None),
        (PUMP, Mistake("arithmetic", "n_B", factor=1.3), 1.03, None),
        (PRESS, Mistake("arithmetic", "n_B", other=("right_triangle",)), 1.0, "right_triangle"),
        (PRESS, Mistake("arithmetic", "n_B", factor=1.5), 1.0, None),
    ],
    ids=str,
)
def test_it_is_said_which_of_triangle_and_plan_is_wrong_and_nothing_where_that_is_in_doubt(
    task, mistake, velocity_factor, said
):
    outcome = judged(task, mistake, velocity_factor=velocity_factor)
    assert outcome.codes & OF_TRIANGLES == ({said} if said else set())
    if said:
        assert "the right triangle" in criterion_feedback(outcome, "en").replace("The", "the")


def test_an_unread_component_has_the_length_of_its_triangle():
    outcome = judged(PUMP, None, unread=True)
    assert "By the right triangle at B on the sketch it is 41.3 mm long." in criterion_feedback(
        outcome, "en"
    ).replace(NBSP, " ")
    assert not judged(PRESS, None, unread=True).codes & OF_TRIANGLES


def test_the_cause_of_a_wrong_length_is_told_instead_of_a_slip_in_the_arithmetic():
    wrong = judged(PUMP, Mistake("arithmetic", "n_B", factor=1.69), velocity_factor=1.3)
    assert wrong.cause.detail == {"slip": "triangle_wrong"}
    assert "Likely cause: right triangle drawn wrongly." in criterion_feedback(wrong, "en")
    other = judged(PUMP, Mistake("arithmetic", "n_B", factor=0.5))
    assert other.cause.detail == {"slip": "not_carried_over"}
    assert (
        "The right triangle at B on the sketch gives 41.3 mm, the plan has 20.7 mm: it was taken over"
        " wrongly. Likely cause: wrong length taken from the right triangle."
    ) in criterion_feedback(other, "en").replace(NBSP, " ")


def test_the_triangle_decides_between_a_usual_slip_and_scales_that_do_not_allow_it():
    """Without the triangle a slip is named, with the right triangle as its rival."""
    scales = {**rule_scales(PUMP), "ka": 2.0 * rule_scales(PUMP)["ka"]}
    nodes = drawn_nodes(PUMP, scales, (Mistake("arithmetic", "n_B", factor=2.0),))
    submission = handed_in(PUMP, nodes, "sheet", declared_texts(scales))
    (found,) = judge(PUMP, submission).mistakes
    assert found.detail == {"factor": 2.0}
    (sheet,) = submission.readings
    read = replace(sheet, altitudes={"a_B_n": altitude(PUMP, "a_B_n")})
    (found,) = judge(PUMP, replace(submission, readings=(read,))).mistakes
    assert (found.detail, found.rivals) == ({"slip": "right_triangle"}, ())
