"""Centres of links and vectors drawn again on the sketch: by the right, the own and the mirrored triangle."""

import cmath
import math
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.feedback.sentences import mistake_feedback
from grader.marking.mark import judge
from grader.records import MECHANISM, Figure, ReadVector
from grader.rubric import CriterionTable
from reference.construction.elements import View
from reference.construction.mistakes import Mistake
from tests.hands import changed, drawn_nodes, measured, sheet, task_for
from tests.unit.comparison.rubrics import codes, outcome_of, with_rubric, without_hand

CENTRES = ("J3", "J4", "I3", "I4")
AT_JOINTS = ("v_A", "a_A", "a_D")
PUMP = task_for("pump", 4)
WRONG_WAY = Mistake("normal_reversed", "n_DC")


def asking(task):
    """The same task with a criterion for every centre, and none of the built-in ones for them."""
    points = [
        CriterionTable.model_validate({"id": name, "title": {"en": name}, "points": 1.0, "point": name})
        for name in CENTRES
    ]
    others = [one for one in task.rubric.criterion if one.id not in CENTRES]
    return with_rubric(task, criterion=[*others, *points])


def corners(task, nodes, *, mirrored=False):
    """Each centre, mm from the driving link's pivot, by the triangles that a student copies."""
    view = View({name: np.asarray(at) for name, at in nodes.items()}, {})
    steps = {name: replace(task.construction.centres[name], mirrored=mirrored) for name in CENTRES}
    return {name: complex(step.place(view)) - nodes["O1"] for name, step in steps.items()}


def polar(points, turn=1.0, se_mm=0.0, confidence=1.0):
    """Centres as they are entered, or read: length and direction from the driving pivot."""
    return {
        name: ReadVector(abs(at), se_mm, math.degrees(cmath.phase(at * turn)) % 360.0, 0.0, confidence)
        for name, at in points.items()
    }


def entered(reading, points, vectors=None):
    """Measurements with centres and vectors of the sketch."""
    sketch = Figure({}, {**polar(points), **(vectors or {})})
    return replace(reading, figures={**reading.figures, MECHANISM: sketch})


def on_paper(reading, task, points, vectors=None):
    """A sheet as read, with centres beside its sketch."""
    sketch = reading.figures[MECHANISM]
    turn = sketch.nodes["A"].at - sketch.nodes["O1"].at
    turn /= drawn_nodes(task)["A"] - drawn_nodes(task)["O1"]
    added = {**polar(points, turn, 0.1, 0.99), **(vectors or {})}
    return replace(reading, figures={**reading.figures, MECHANISM: Figure(sketch.nodes, added)})


def verdicts(comparison, names=CENTRES):
    return [outcome_of(comparison, name).verdict for name in names]


@pytest.mark.parametrize("n", [1, 4, 5])
def test_right_centres_earn_all_points_entered_or_drawn_on_a_turned_sketch(n):
    task = asking(task_for("pump", n))
    places = corners(task, drawn_nodes(task))
    by_hand = compare(task, Submission(measured=entered(measured(task), places)))
    turned = compare(task, Submission(readings=(on_paper(sheet(task, turn_deg=7.0), task, places),)))
    assert verdicts(by_hand) == verdicts(turned) == ["full"] * 4
    assert outcome_of(by_hand, "J4").measured.length_mm == pytest.approx(abs(places["J4"]))


def test_a_centre_elsewhere_loses_its_points_and_says_how_far():
    task = without_hand(asking(PUMP))
    places = corners(task, drawn_nodes(task))
    comparison = compare(task, Submission(measured=entered(measured(task), {"J4": places["J4"] + 9.0})))
    outcome = outcome_of(comparison, "J4")
    assert (outcome.verdict, outcome.mistake) == ("none", None)
    assert outcome.reasons[0].code == "place_off"
    assert outcome.reasons[0].parameters["off_mm"] == pytest.approx(9.0)


def test_a_mirrored_triangle_is_named_with_what_to_redo():
    task = asking(PUMP)
    mirrored = corners(task, drawn_nodes(task), mirrored=True)
    judgement = judge(task, Submission(measured=entered(measured(task), mirrored)))
    assert [(one.code, one.at) for one in judgement.mistakes] == [
        ("image_mirrored", name) for name in CENTRES
    ]
    assert "opposite senses" in mistake_feedback(judgement.mistakes[0], "en")
    assert {one.mistake for one in judgement.outcomes if one.name in CENTRES} == {"image_mirrored"}


def test_a_centre_that_follows_from_the_own_wrong_plan_costs_nothing_more():
    task = asking(PUMP)
    wrong = (WRONG_WAY,)
    places = corners(task, drawn_nodes(task, mistakes=wrong))
    assert abs(places["J4"] - corners(task, drawn_nodes(task))["J4"]) > 20.0
    comparison = compare(task, Submission(measured=entered(measured(task, mistakes=wrong), places)))
    assert verdicts(comparison) == ["full", "follow_through", "full", "full"]
    drawn = on_paper(sheet(task, mistakes=wrong), task, places)
    assert verdicts(compare(task, Submission(readings=(drawn,)))) == verdicts(comparison)


def test_a_centre_by_its_distance_alone_was_not_handed_in():
    task = asking(PUMP)
    far = {"J4": ReadVector(38.6, 0.0, None, None, 1.0)}
    outcome = outcome_of(compare(task, Submission(measured=entered(measured(task), {}, far))), "J4")
    assert (outcome.verdict, codes(outcome)) == ("none", ["not_measured"])


def test_a_centre_off_the_sheet_is_not_judged():
    task = asking(task_for("pump", 16))
    places = corners(task, drawn_nodes(task))
    assert abs(places["J3"]) > 400.0
    outcome = outcome_of(compare(task, Submission(measured=entered(measured(task), places))), "J3")
    assert (outcome.verdict, codes(outcome)) == ("not_judged", ["off_sheet"])


def test_at_a_dead_point_the_rods_centre_is_the_joint_that_stands_still():
    task = task_for("press", position=0)
    table = {"id": "I3", "title": {"en": "x"}, "points": 1.0, "point": "I3"}
    task = with_rubric(task, criterion=[CriterionTable.model_validate(table)])
    nodes = drawn_nodes(task)
    right = entered(measured(task), {"I3": nodes["B"] - nodes["O1"]})
    assert outcome_of(compare(task, Submission(measured=right)), "I3").verdict == "full"


# Vectors drawn again ------------------------------------------------------------------------------


def at_joints(reading, names=AT_JOINTS, **change):
    """The vectors of a reading's plans as they are drawn again, or measured there."""
    vectors = {name: one for figure in reading.figures.values() for name, one in figure.vectors.items()}
    return {f"{name}_sketch": replace(vectors[name], **change) for name in names}


def test_vectors_drawn_again_as_in_the_plan_earn_all_points():
    names = [f"{name}_sketch" for name in AT_JOINTS]
    by_hand = measured(PUMP)
    comparison = compare(PUMP, Submission(measured=entered(by_hand, {}, at_joints(by_hand))))
    assert verdicts(comparison, names) == ["full"] * 3
    on_sheet = sheet(PUMP, turn_deg=-5.0)
    drawn = on_paper(on_sheet, PUMP, {}, at_joints(on_sheet))
    assert verdicts(compare(PUMP, Submission(readings=(drawn,))), names) == ["full"] * 3


def test_a_wrong_vector_of_the_plan_drawn_again_follows():
    wrong = measured(PUMP, mistakes=(WRONG_WAY,))
    comparison = compare(PUMP, Submission(measured=entered(wrong, {}, at_joints(wrong, ("a_D",)))))
    outcome = outcome_of(comparison, "a_D_sketch")
    assert outcome.verdict == "follow_through"
    assert outcome.reasons[0].parameters == {"what": "vector", "of": "a_D"}


def test_a_vector_drawn_again_the_wrong_way_is_told():
    reading = measured(PUMP)
    turned = at_joints(reading, ("a_D",), direction_deg=0.0)
    outcome = outcome_of(compare(PUMP, Submission(measured=entered(reading, {}, turned))), "a_D_sketch")
    assert (outcome.verdict, codes(outcome)) == ("none", ["reversed"])


def test_a_vector_drawn_again_does_not_stand_for_that_of_the_plan():
    reading = changed(measured(PUMP), "a_D", length_mm=None)
    comparison = compare(PUMP, Submission(measured=entered(reading, {}, at_joints(measured(PUMP), ("a_D",)))))
    assert outcome_of(comparison, "a_D").verdict == "none"
    assert outcome_of(comparison, "a_D_sketch").verdict == "full"


def test_directions_on_a_turned_sheet_are_told_as_they_lie_there():
    reading = sheet(PUMP, turn_deg=30.0)
    drawn = on_paper(reading, PUMP, {}, at_joints(reading, ("v_A",)))
    outcome = outcome_of(compare(PUMP, Submission(readings=(drawn,))), "v_A_sketch")
    exact = math.degrees(cmath.phase(PUMP.real["v_A"])) + 30.0
    assert outcome.measured.direction_deg == pytest.approx(exact % 360.0)
