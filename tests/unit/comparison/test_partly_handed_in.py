"""Submissions of which a part is missing: what is judged by the rest, and what is not judged at all."""

import cmath
import math
from dataclasses import replace

import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.comparison.outcomes import both
from grader.comparison.task import task_of
from grader.documents import Quantity
from grader.marking.mark import judge
from grader.records import Figure, ReadVector, Reason, Unread
from grader.rubric import CriterionTable
from reference.authored.toml_file import Text
from reference.construction.mistakes import Mistake
from samples.simulation.wording import declared_texts
from tests.drawn import planned
from tests.hands import changed, drawn_nodes, measured, rule_scales, sheet, task_for, without
from tests.unit.comparison.rubrics import with_rubric
from tests.whole_rubric import rubric_for

PUMP, SHAPER = task_for("pump", 7), task_for("shaper", 5)


def outcome_of(task, submission, name):
    return next(one for one in compare(task, submission).outcomes if one.name == name)


def test_a_measurement_counts_where_the_scan_shows_nothing_to_judge():
    right = outcome_of(PUMP, Submission(measured=measured(PUMP)), "v_CA")
    nothing = replace(right, verdict="not_judged", possible=("not_judged", "not_judged"), measured=Quantity())
    assert both(nothing, right, 1.0) == both(right, nothing, 1.0) == right


def test_a_value_with_a_slip_of_its_own_does_not_follow_the_factor_of_all():
    names = [name for name, vector in PUMP.construction.vectors.items() if vector.scale == "kv"]
    values = {name: 2.0 * abs(PUMP.real[name]) for name in names}
    values["v_DC"] *= 3.0
    reading, task = without(measured(PUMP), *names), with_rubric(PUMP, values_alone=True)
    outcomes = {one.name: one for one in compare(task, Submission(measured=reading, values=values)).outcomes}
    assert outcomes["v_DC"].verdict == "none"
    assert outcomes["v_D"].verdict == "follow_through"


def test_a_link_is_not_judged_without_a_sketch():
    link = CriterionTable(id="AB", link="AB", points=2.0, title=Text(en="AB"))
    task = with_rubric(PUMP, criterion=[*PUMP.rubric.criterion, link])
    assert outcome_of(task, Submission(measured=measured(PUMP)), "AB").verdict == "not_judged"
    assert outcome_of(task, Submission(readings=(sheet(PUMP),)), "AB").verdict == "full"


def test_a_vector_between_two_nodes_that_were_read_is_known_to_be_left_out():
    whole = judge(PUMP, Submission(readings=(sheet(PUMP),)))
    blank = (Unread("v_DC", Reason("blank", {"start": "c", "end": "d"}), is_blank=True),)
    part = judge(PUMP, Submission(readings=(replace(without(sheet(PUMP), "v_DC"), unread=blank),)))
    unread = judge(PUMP, Submission(readings=(without(sheet(PUMP), "v_DC"),)))
    assert whole.mistakes == unread.mistakes == ()
    found = {one.name: one for one in part.outcomes}["v_DC"]
    assert (found.verdict, [reason.code for reason in found.reasons]) == ("none", ["not_drawn"])
    assert {one.name: one for one in unread.outcomes}["v_DC"].verdict == "review"
    assert [(one.code, one.at, one.explains) for one in part.mistakes] == [
        ("vector_missing", "v_DC", ("v_DC",))
    ]


def test_a_vector_is_missing_if_no_line_leads_to_where_similarity_puts_its_point():
    task = task_for("piston", 7)
    blank = (Unread("v_C", Reason("blank", {"start": "o", "end": "c"}), is_blank=True),)
    drawn = replace(without(sheet(task), "v_C"), unread=blank)
    figures = {key: replace(one, nodes={**one.nodes}) for key, one in drawn.figures.items()}
    figures["velocity_plan"].nodes.pop("c")
    found = outcome_of(task, Submission(readings=(replace(drawn, figures=figures),)), "v_C")
    assert (found.verdict, [reason.code for reason in found.reasons]) == ("none", ["no_line"])
    figures["velocity_plan"].nodes.pop("b")
    found = outcome_of(task, Submission(readings=(replace(drawn, figures=figures),)), "v_C")
    assert (found.verdict, found.proposed_verdict) == ("review", "none")


def test_a_scale_of_ones_own_is_open_where_the_vector_that_shows_it_was_not_read():
    own = 0.7 * rule_scales(PUMP)["kv"]
    few = [name for name, one in PUMP.construction.vectors.items() if one.scale == "kv" and name != "v_D"]
    drawn = sheet(PUMP, {**rule_scales(PUMP), "kv": 1.9 * own})
    declared = {"kv": f"{own!r} (m/s)/mm"}
    outcome = outcome_of(PUMP, Submission(readings=(without(drawn, *few),), declared=declared), "kv")
    assert (outcome.verdict, outcome.reasons[0].code) == ("review", "unread")


@pytest.mark.parametrize("share", [1.2, 0.8])
def test_a_coriolis_component_follows_the_own_angular_velocity_where_no_velocity_is_given(share):
    name = next(name for name, one in SHAPER.construction.vectors.items() if one.part == "c")
    rate = f"omega_{SHAPER.construction.vectors[name].turning}"
    velocities = [other for other, one in SHAPER.construction.vectors.items() if one.scale == "kv"]
    length = share * abs(SHAPER.real[name]) / rule_scales(SHAPER)["ka"]
    alone = Submission(measured=changed(without(measured(SHAPER), *velocities), name, length_mm=length))
    assert outcome_of(SHAPER, alone, name).verdict in {"none", "partial"}
    follows = replace(alone, values={rate: share * SHAPER.rates[rate]})
    assert outcome_of(SHAPER, follows, name).verdict == "follow_through"


def test_an_angular_velocity_turns_as_the_own_vector_turns_the_own_link():
    made = (Mistake("other_assembly", "B"),)
    read, nodes = sheet(PUMP, mistakes=made, turn_deg=20.0), drawn_nodes(PUMP, mistakes=made)
    link, vector = nodes["B"] - nodes["A"], nodes["b"] - nodes["a"]
    omega = abs(vector) * rule_scales(PUMP)["kv"] / (abs(link) * rule_scales(PUMP)["kL"])
    sense = math.copysign(1.0, math.sin(cmath.phase(vector) - cmath.phase(link)))
    rate = next(name for name, one in PUMP.construction.rates.items() if one.vector == "v_BA")
    for factor, verdicts in ((1.0, {"full", "follow_through"}), (-1.0, {"none"})):
        submission = Submission(readings=(read,), values={rate: factor * sense * omega})
        assert outcome_of(PUMP, submission, rate).verdict in verdicts


def test_a_vector_drawn_along_its_link_leaves_the_sense_of_the_angular_velocity_open():
    reading = measured(PUMP, mistakes=(Mistake("parallel_for_perpendicular", "b", 0),))
    size = reading.figures["velocity_plan"].vectors["v_BA"].length_mm * rule_scales(PUMP)["kv"] / 0.4
    submission = Submission(measured=reading, values={"omega_3": size})
    assert outcome_of(PUMP, submission, "omega_3").verdict == "follow_through"


def test_a_component_too_short_to_tell_is_not_taken_for_left_out_because_it_was_not_entered():
    task = task_for("pump", 1)
    scales = {**rule_scales(task), "ka": abs(task.real["a_CB_n"]) / 1.3}
    reading = without(measured(task, scales, mistakes=(Mistake("normal_reversed", "n_B"),)), "a_CB_n")
    outcomes = judge(task, Submission(measured=reading, declared=declared_texts(scales))).outcomes
    assert {one.name for one in outcomes if one.verdict in {"none", "partial"}} <= {"a_B_n", "a_CB_n"}


def test_what_is_measured_of_no_known_vector_is_passed_over():
    reading = changed(measured(PUMP, directions=False), "v_D", length_mm=99.0)
    plan = reading.figures["velocity_plan"]
    more = Figure(plan.nodes, {**plan.vectors, "v_XY": ReadVector(50.0, 0.0, None, None, 1.0)})
    with_it = type(reading)({**reading.figures, "velocity_plan": more})
    known, unknown = (compare(PUMP, Submission(measured=one)).outcomes for one in (reading, with_it))
    assert known == unknown


def test_of_an_assignment_with_one_variant_no_other_is_named(tmp_path_factory):
    assignment, plan = planned("yoke", tmp_path_factory.mktemp("one"))
    task = task_of(assignment, rubric_for("yoke", assignment.file.title, plan.mechanism), plan.variants[0])
    reading = changed(measured(task), "v_B", length_mm=0.6 * abs(task.real["v_B"]) / rule_scales(task)["kv"])
    judged = judge(task, Submission(measured=reading))
    assert {"none", "partial"} & {one.verdict for one in judged.outcomes}
    assert "other_variant" not in {one.code for one in judged.mistakes}
