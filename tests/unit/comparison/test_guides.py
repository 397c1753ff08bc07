"""Marking where blocks slide on turning links, and where a slider drives instead of a crank."""

import cmath
from dataclasses import replace

import numpy as np
import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.comparison.own import own_length
from grader.marking.mark import judge
from grader.records import Figure, Reading
from grader.rubric import DoubtTable
from grader.tables.measurements import names_of
from reference.authored.assignment import load_assignment
from reference.construction.graph import evaluate
from reference.construction.mistakes import Mistake
from tests.hands import changed, drawn_nodes, measured, sheet, task_for
from tests.unit.comparison.rubrics import with_rubric

SHAPER = task_for("shaper", 7)
PISTON = task_for("piston", 5)
PUMP = task_for("pump", 7)
LONGER = 1.25
"""Factor by which a vector is made longer: far beyond its tolerance."""
ROUNDING = 1e-9
ASTRAY_RAD = 0.1
"""By which a crank is drawn in a wrong position."""


def verdicts(judgement):
    return {one.criterion: one.verdict for one in judgement.outcomes}


def stretched(reading, names):
    """Lengths alone, some of them by a share too long."""
    lengths = {
        name: one.length_mm for figure in reading.figures.values() for name, one in figure.vectors.items()
    }
    for name, share in names.items():
        reading = changed(reading, name, length_mm=share * lengths[name])
    return reading


@pytest.mark.parametrize(
    ("source", "share"), [("v_A3A", LONGER), ("v_A3", LONGER)], ids=["sliding velocity", "turning velocity"]
)
def test_a_coriolis_component_follows_from_lengths_alone(source, share):
    reading = stretched(measured(SHAPER, directions=False), {source: share, "a_A3A_c": share})
    found = verdicts(judge(SHAPER, Submission(measured=reading)))
    assert found[source] == "none"
    assert found["a_A3A_c"] == "follow_through"


def test_a_coriolis_component_that_follows_from_nothing_is_wrong():
    reading = stretched(measured(SHAPER, directions=False), {"a_A3A_c": LONGER})
    assert verdicts(judge(SHAPER, Submission(measured=reading)))["a_A3A_c"] == "none"


def test_a_coriolis_component_follows_from_both_velocities_wrong():
    wrong = {"v_A3A": 1.2, "v_A3": 0.8, "a_A3A_c": 1.2 * 0.8}
    found = verdicts(judge(SHAPER, Submission(measured=stretched(measured(SHAPER, directions=False), wrong))))
    # Nothing in their plan fits their lengths: they are wrong, or a person looks.
    assert {found["v_A3A"], found["v_A3"]} <= {"none", "review"}
    assert found["a_A3A_c"] in {"full", "follow_through"}


def test_a_coriolis_component_follows_from_the_own_value_of_omega():
    values = {"omega_3": SHAPER.rates["omega_3"] * LONGER}
    reading = stretched(measured(SHAPER), {"a_A3A_c": LONGER})
    outcomes = {
        one.criterion: one for one in judge(SHAPER, Submission(measured=reading, values=values)).outcomes
    }
    assert outcomes["omega_3"].verdict == "none"
    assert outcomes["a_A3A_c"].verdict == "follow_through"
    assert ("follows", "omega_3") in {
        (one.code, one.parameters.get("of")) for one in outcomes["a_A3A_c"].reasons
    }


def test_a_normal_component_follows_from_the_own_value_of_omega():
    values = {"omega_3": PUMP.rates["omega_3"] * LONGER}
    reading = stretched(measured(PUMP, directions=False), {"a_BA_n": LONGER**2})
    assert verdicts(judge(PUMP, Submission(measured=reading)))["a_BA_n"] == "none"
    found = verdicts(judge(PUMP, Submission(measured=reading, values=values)))
    assert (found["omega_3"], found["a_BA_n"]) == ("none", "follow_through")


@pytest.mark.parametrize("by_deg", [180.0, 40.0, 90.0])
def test_the_coriolis_component_stands_across_the_own_sliding_velocity(by_deg):
    right = measured(SHAPER)
    reading = right
    for name, figure in (("v_A3A", "velocity_plan"), ("a_A3A_c", "acceleration_plan")):
        turned = (right.figures[figure].vectors[name].direction_deg + by_deg) % 360.0
        reading = changed(reading, name, direction_deg=turned)
    found = verdicts(judge(SHAPER, Submission(measured=reading)))
    assert found["v_A3A"] == "none"
    assert found["a_A3A_c"] == "follow_through"


@pytest.mark.parametrize("sense", [1.0, -1.0])
def test_the_coriolis_component_has_either_sense_where_the_own_velocity_turns_the_guide_neither_way(sense):
    reading = measured(SHAPER)
    for name, figure, by_deg in (
        ("v_A3", "velocity_plan", 90.0),
        ("a_A3A_c", "acceleration_plan", 90.0 - 90.0 * sense),
    ):
        turned = (reading.figures[figure].vectors[name].direction_deg + by_deg) % 360.0
        reading = changed(reading, name, direction_deg=turned)
    found = verdicts(judge(SHAPER, Submission(measured=reading)))
    assert found["v_A3"] == "none"
    assert found["a_A3A_c"] in {"full", "follow_through"}


def test_a_point_of_the_slotted_link_follows_from_the_length_of_another():
    reading = stretched(measured(SHAPER, directions=False), {"v_A3": LONGER, "v_D": LONGER})
    found = verdicts(judge(SHAPER, Submission(measured=reading)))
    assert (found["v_A3"], found["v_D"]) == ("none", "follow_through")


def test_a_missing_coriolis_component_costs_it_and_the_acceleration_that_shows_it():
    made = (Mistake("normal_missing", "k_A3A"),)
    found = verdicts(judge(SHAPER, Submission(readings=(sheet(SHAPER, mistakes=made),))))
    lost = {name for name, verdict in found.items() if verdict == "none"}
    assert "a_A3A_c" in lost
    assert lost <= {"a_A3A_c", "a_A3"}
    assert found["a_D"] == "follow_through"


def test_the_distance_of_the_slotted_links_point_is_that_of_the_own_sketch():
    moved = {"A": 3.0 + 0j, "A3": 3.0 + 0j}
    evidence = compare(SHAPER, Submission(readings=(sheet(SHAPER, moved=moved),))).evidence
    drawn = evidence.nodes
    rate = SHAPER.construction.rates["omega_3"]
    crank_mm = abs(drawn["A"] - drawn["O1"])
    expected = abs(drawn["A3"] - drawn["O2"]) * SHAPER.yardstick.length_m / crank_mm
    assert own_length(SHAPER, evidence, rate) == pytest.approx(expected, rel=ROUNDING)
    assert own_length(SHAPER, evidence, SHAPER.construction.rates["omega_4"]) == SHAPER.lengths_m["omega_4"]


def test_the_components_of_a_guide_can_be_measured_and_others_are_told():
    names = names_of(load_assignment("shaper"))
    assert {"v_A3A", "a_A3A_c", "a_A3A_r", "a_A3_n", "a_A3_t"} <= names.vectors.keys() - names.unused
    assert {"v_AA3", "a_AA3_c", "a_AA3_r"} <= names.unused
    assert not {"v_A3A2", "a_ED_c"} & names.vectors.keys()


# A slider that drives ------------------------------------------------------------------------------


def test_without_a_crank_the_first_link_of_given_length_tells_the_scale_of_lengths():
    assert PISTON.omega is None
    assert (PISTON.yardstick.tail, PISTON.yardstick.head) == ("B", "A")
    declared = {"kL": "1:5"}
    right = judge(PISTON, Submission(readings=(sheet(PISTON),), declared=declared))
    assert verdicts(right)["kL"] == "full"
    wrong = judge(PISTON, Submission(readings=(sheet(PISTON),), declared={"kL": "1:4"}))
    assert verdicts(wrong)["kL"] == "none"


def test_a_scale_by_the_cranks_omega_is_refused_where_there_is_no_crank():
    declared = {"kL": "1:5", "kv": "kv = omega kL"}
    judgement = judge(PISTON, Submission(measured=measured(PISTON), declared=declared))
    refused = judgement.scales["kv"].refused
    assert refused.code == "no_omega"
    assert refused.parameters["examples"] == ("0.036 (m/s)/mm",)
    assert judgement.scales["kv"].assumed


def test_a_reversed_driving_velocity_is_charged_once():
    made = (Mistake("sense_reversed", "b"),)
    judgement = judge(PISTON, Submission(readings=(sheet(PISTON, mistakes=made),)))
    found = verdicts(judgement)
    assert found["v_B"] == "none"
    assert {found[name] for name in ("v_A", "v_AB", "v_C")} == {"follow_through"}
    assert [(one.code, one.at) for one in judgement.mistakes] == [("sense_reversed", "b")]


def test_a_sketch_without_pivots_still_has_its_plans_marked():
    whole = sheet(PISTON)
    sketch = whole.figures["mechanism"]
    joints = {name: node for name, node in sketch.nodes.items() if name != "O1"}
    reading = replace(whole, figures={**whole.figures, "mechanism": Figure(joints, {})})
    judgement = judge(PISTON, Submission(readings=(Reading(reading.figures),)))
    assert set(verdicts(judgement).values()) <= {"full", "not_judged"}


def test_what_follows_from_a_wrong_sketch_with_its_own_distances_is_charged_once():
    right = drawn_nodes(SHAPER)
    astray = right["O1"] + (right["A"] - right["O1"]) * cmath.rect(1.0, ASTRAY_RAD)
    found = evaluate(SHAPER.construction, SHAPER.parameters, given={"A": np.asarray(astray)})
    moved = {name: complex(at) - right[name] for name, at in found.items()}
    task = with_rubric(SHAPER, doubt=DoubtTable(other_variant="follow"))
    judgement = judge(task, Submission(readings=(sheet(task, moved=moved),)))
    found_verdicts = verdicts(judgement)
    assert {name for name, verdict in found_verdicts.items() if verdict in {"none", "partial"}} == {"v_A"}
    assert {found_verdicts["a_A3A_c"], found_verdicts["a_A3_n"]} <= {"full", "follow_through"}
