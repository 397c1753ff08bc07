"""The mistake that explains what is off, and none for a hand that is only careless."""

import random
from dataclasses import replace

import pytest

from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.feedback.sentences import mistake_feedback
from grader.marking.mark import judge
from grader.rubric import rubric_of
from reference.authored.assignment import library, load_assignment
from reference.construction.graph import evaluate
from reference.construction.mistakes import Drawing, Mistake, commit
from samples.simulation.wording import declared_texts
from tests.hands import (
    SOURCES,
    changed,
    drawn_nodes,
    handed_in,
    measured,
    sheet,
    task_for,
    without,
)

PUMP = task_for("pump", 7)
PRESS = task_for("press", position=1)


def codes(judgement):
    return [one.code for one in judgement.mistakes]


@pytest.mark.parametrize(
    "mistake",
    [
        Mistake("parallel_for_perpendicular", "b", 0),
        Mistake("wrong_link", "b", 1, other=("C", "D")),
        Mistake("sense_reversed", "a"),
        Mistake("normal_reversed", "n_B"),
        Mistake("normal_missing", "n_DC"),
        Mistake("normal_from_absolute", "n_BA"),
        Mistake("wrong_intersection", "b'", 1, other=("o'",)),
        Mistake("image_mirrored", "c'"),
        Mistake("labels_swapped", "b", other=("b", "d")),
        Mistake("figure_rotated", "velocity_plan", quarters=1),
        Mistake("other_assembly", "B"),
    ],
    ids=lambda mistake: f"{mistake.code} at {mistake.at}",
)
@pytest.mark.parametrize("seen", ["sheet", "measured"])
def test_a_single_mistake_is_found_where_it_was_made(mistake, seen):
    if seen == "sheet":
        submission = Submission(readings=(sheet(PUMP, mistakes=(mistake,)),))
    else:
        submission = Submission(measured=measured(PUMP, mistakes=(mistake,)))
    judgement = judge(PUMP, submission)
    assert [(one.code, one.at) for one in judgement.mistakes] == [(mistake.code, mistake.at)]
    found = judgement.mistakes[0]
    lost = {one.criterion for one in judgement.outcomes if one.verdict in {"none", "partial"}}
    assert set(found.explains) & lost
    assert found.confidence > 0.6
    blamed = {one.criterion: one.mistake for one in judgement.outcomes}
    assert {blamed[name] for name in set(found.explains) & lost} == {mistake.code}


def test_two_mistakes_are_told_apart_from_the_own_nodes():
    made = (Mistake("normal_missing", "n_DC"), Mistake("parallel_for_perpendicular", "b", 0))
    judgement = judge(PUMP, Submission(readings=(sheet(PUMP, mistakes=made),)))
    assert set(codes(judgement)) == {"normal_missing", "parallel_for_perpendicular"}


@pytest.mark.parametrize(
    ("powers", "code"),
    [((1, 2), "rpm_not_converted"), ((0, 1), "scale_wrong"), ((1, 0), "rpm_not_converted")],
)
def test_a_wrong_declared_scale_is_told_as_what_it_is(powers, code):
    scales = PUMP.rule_scales
    factor = 9.5493 if code == "rpm_not_converted" else 0.1
    declared = {
        "kv": f"{scales['kv'] * factor ** powers[0]!r} (m/s)/mm",
        "ka": f"{scales['ka'] * factor ** powers[1]!r} (m/s2)/mm",
    }
    judgement = judge(PUMP, Submission(measured=measured(PUMP), declared=declared))
    assert set(codes(judgement)) == {code}
    wrong = {name for name, power in zip(("kv", "ka"), powers, strict=True) if power}
    assert {one.at for one in judgement.mistakes} == wrong
    assert all(one.at in one.explains for one in judgement.mistakes)


def test_another_students_data_are_recognised():
    other = task_for("pump", 20)
    reading = measured(other)
    declared = {name: f"{scale!r} {unit}" for (name, scale), unit in zip(
        other.rule_scales.items(), ("m/mm", "(m/s)/mm", "(m/s2)/mm"), strict=True)}  # fmt: skip
    judgement = judge(PUMP, Submission(measured=reading, declared=declared))
    assert codes(judgement)[0] == "other_variant"
    assert judgement.mistakes[0].detail["n"] == 20


def test_a_right_drawing_is_accused_of_nothing():
    for task in (PUMP, PRESS):
        assert judge(task, Submission(measured=measured(task))).mistakes == ()


@pytest.mark.parametrize("name", ["pump", "press"])
def test_a_careless_hand_is_accused_of_nothing(name):
    assignment = load_assignment(name)
    rubric = rubric_of(assignment)
    lot = random.Random(name)
    for _ in range(6):
        task = task_of(assignment, rubric, lot.choice(assignment.variants()))
        moved = {step.node: complex(lot.gauss(0, 0.7), lot.gauss(0, 0.7)) for step in task.construction.steps}
        reading = sheet(task, moved=moved)
        assert judge(task, Submission(readings=(reading,))).mistakes == ()


def test_what_no_mistake_explains_is_left_unexplained():
    reading = changed(measured(PUMP, directions=False), "v_D", length_mm=75.0)
    judgement = judge(PUMP, Submission(measured=reading))
    assert "v_D" not in {name for one in judgement.mistakes for name in one.explains}


def test_a_drawing_at_a_scale_that_nobody_declared_is_not_called_a_mistake():
    other = {**PUMP.rule_scales, "kv": 2.0 * PUMP.rule_scales["kv"]}
    assert judge(PUMP, Submission(measured=measured(PUMP, other))).mistakes == ()


def test_variants_that_do_not_assemble_are_passed_over(tmp_path):
    text = (library() / "press.assignment.toml").read_text(encoding="utf-8")
    mechanism = (library() / "press.mechanism.toml").read_text(encoding="utf-8")
    # At position 7 no rod is long enough.
    mechanism = mechanism.replace("length = 0.35", 'length = "0.35 - 0.34*floor(position/7)"')
    (tmp_path / "press.mechanism.toml").write_text(mechanism, encoding="utf-8")
    path = tmp_path / "short.assignment.toml"
    path.write_text(text, encoding="utf-8")
    assignment = load_assignment(str(path))
    task = task_of(assignment, rubric_of(assignment), assignment.variant(None, 1))
    reading = measured(task, mistakes=(Mistake("normal_reversed", "n_B"),))
    assert codes(judge(task, Submission(measured=reading))) == ["normal_reversed"]


@pytest.mark.parametrize("task", [PUMP, task_for("press", position=5)], ids=["pump", "press"])
@pytest.mark.parametrize("source", SOURCES)
def test_a_plan_started_at_another_scale_than_declared_is_one_wrong_scale(task, source):
    # v_A too short by a quarter, and everything drawn and computed from that rightly.
    known = {**task.parameters, "v_A": 0.75 * task.parameters["v_A"]}
    nodes = {name: complex(place) for name, place in evaluate(task.construction, known).items()}
    judgement = judge(task, handed_in(task, nodes, source))
    assert [(one.code, one.at) for one in judgement.mistakes] == [("scale_wrong", "kv")]
    assert {one.name for one in judgement.outcomes if one.verdict in {"none", "partial"}} == {"kv"}


@pytest.mark.parametrize(
    "mistake",
    [
        Mistake("parallel_for_perpendicular", "a", quarters=1),
        Mistake("parallel_for_perpendicular", "a'", quarters=3),
        Mistake("parallel_for_perpendicular", "d", 1),
        Mistake("wrong_link", "b", 0, other=("O1", "B")),
        Mistake("wrong_intersection", "c'", 1, other=("n_BA",)),
        Mistake("wrong_intersection", "d", 0, other=("v_BA",)),
    ],
    ids=lambda mistake: f"{mistake.code} at {mistake.at} {' '.join(mistake.other)}",
)
@pytest.mark.parametrize("source", ["sheet", "directions"])
def test_rarer_mistakes_are_found_where_they_were_made(mistake, source):
    judgement = judge(PUMP, handed_in(PUMP, drawn_nodes(PUMP, mistakes=(mistake,)), source))
    found = judgement.mistakes[0]
    assert [(one.code, one.at) for one in judgement.mistakes] == [(mistake.code, mistake.at)]
    assert found.mistake.other == mistake.other


@pytest.mark.parametrize("source", ["sheet", "directions"])
@pytest.mark.parametrize("quarters", [1, 3])
def test_a_coriolis_component_along_the_sliding_velocity_is_named(quarters, source):
    shaper = task_for("shaper", 3)
    mistake = Mistake("parallel_for_perpendicular", "k_A3A", quarters=quarters)
    judgement = judge(shaper, handed_in(shaper, drawn_nodes(shaper, mistakes=(mistake,)), source))
    (named,) = judgement.mistakes
    assert (named.code, named.at, named.line) == (mistake.code, "k_A3A", {})
    assert "sliding velocity" in mistake_feedback(named, "en")


def test_an_entered_direction_that_contradicts_the_other_entries_accuses_of_nothing_else():
    # The plan is right; only what was entered for v_A points the other way.
    for task in (PUMP, PRESS):
        reading = measured(task)
        entered = reading.figures["velocity_plan"].vectors["v_A"]
        turned = (entered.direction_deg + 180.0) % 360.0
        judgement = judge(task, Submission(measured=changed(reading, "v_A", direction_deg=turned)))
        assert {one.name for one in judgement.outcomes if one.verdict == "none"} == {"v_A"}
        assert [(one.code, one.at) for one in judgement.mistakes] == [("units", "v_A")]


@pytest.mark.parametrize("source", SOURCES)
def test_a_longer_crank_vector_and_a_reversed_component_are_both_named(source):
    known = {**PRESS.parameters, "v_A": 1.15 * PRESS.parameters["v_A"]}
    drawing = commit(Mistake("normal_reversed", "n_BA"), Drawing(PRESS.construction, known))
    nodes = {name: complex(one) for name, one in evaluate(drawing.construction, known).items()}
    named = [(one.code, one.at) for one in judge(PRESS, handed_in(PRESS, nodes, source)).mistakes]
    assert named == [("scale_wrong", "kv"), ("normal_reversed", "n_BA")]


@pytest.mark.parametrize("source", SOURCES)
def test_another_students_data_at_the_own_scales_are_recognised(source):
    other = task_for("pump", 20)
    nodes = drawn_nodes(other, PUMP.rule_scales)
    submission = replace(handed_in(PUMP, nodes, source), declared={})
    assert [(one.code, one.detail) for one in judge(PUMP, submission).mistakes] == [
        ("other_variant", {"n": 20})
    ]


def test_letters_swapped_are_told_by_lengths_alone():
    swapped = Mistake("labels_swapped", "b", other=("b", "c"))
    nodes = drawn_nodes(PUMP, mistakes=(swapped,))
    found = judge(PUMP, handed_in(PUMP, nodes, "lengths")).mistakes
    assert [(one.code, set(one.mistake.other)) for one in found] == [("labels_swapped", {"b", "c"})]


def test_one_factor_in_all_components_is_a_wrong_scale():
    # a_A at the declared scale, turned the wrong way; all that is computed at another scale.
    known = {**PUMP.parameters, "ka": PUMP.parameters["ka"] / 2.0}
    wrong = Mistake("parallel_for_perpendicular", "a'", quarters=1)
    drawing = commit(wrong, Drawing(PUMP.construction, known))
    nodes = {name: complex(one) for name, one in evaluate(drawing.construction, known).items()}
    named = {one.code for one in judge(PUMP, handed_in(PUMP, nodes, "sheet")).mistakes}
    assert "scale_wrong" in named
    assert "arithmetic" not in named


def test_a_wrong_value_beside_a_right_drawing_is_told_as_a_slip():
    nodes = drawn_nodes(PUMP)
    right = abs(PUMP.real["v_D"])
    submission = replace(handed_in(PUMP, nodes, "sheet"), values={"v_D": 10.0 * right})
    slip = judge(PUMP, submission).mistakes[0]
    assert (slip.code, slip.at, slip.explains) == ("arithmetic", "v_D", ("v_D_value",))
    assert slip.detail["factor"] == pytest.approx(10.0, rel=0.02)


def test_a_wrong_angular_velocity_from_a_right_vector_is_told_as_a_slip():
    submission = replace(
        handed_in(PUMP, drawn_nodes(PUMP), "sheet"), values={"omega_3": 2.0 * PUMP.rates["omega_3"]}
    )
    slips = [(one.code, one.at) for one in judge(PUMP, submission).mistakes]
    assert slips == [("arithmetic", "omega_3")]


def test_what_the_evidence_does_not_tell_apart_is_told_with_its_odds():
    # A short component drawn a tenth as long may as well have been left out.
    nodes = drawn_nodes(PRESS, mistakes=(Mistake("arithmetic", "n_DC", factor=0.1),))
    (found,) = judge(PRESS, handed_in(PRESS, nodes, "lengths")).mistakes
    (rival,) = found.rivals
    assert {found.code, rival.code} == {"arithmetic", "normal_missing"}
    assert 0.1 < rival.confidence < found.confidence
    assert found.confidence + rival.confidence == pytest.approx(1.0, abs=0.02)


def test_a_wrong_scale_is_named_beside_a_reversed_vector():
    scales = PRESS.rule_scales
    declared = declared_texts({**scales, "ka": 1.25 * scales["ka"]})
    reading = measured(PRESS, mistakes=(Mistake("sense_reversed", "a'"),))
    judgement = judge(PRESS, Submission(measured=reading, declared=declared))
    assert set(codes(judgement)) == {"scale_wrong", "sense_reversed"}


def test_a_component_left_blank_is_rather_left_out_than_computed_too_small():
    reading = without(measured(PUMP, mistakes=(Mistake("normal_missing", "n_BA"),)), "a_BA_n")
    judgement = judge(PUMP, Submission(measured=reading))
    assert codes(judgement) == ["normal_missing"]
