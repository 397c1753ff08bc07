"""Entered force sheets: one mistake costs one criterion, what follows is credited, and it is named."""

from cmath import phase
from dataclasses import replace
from math import degrees
from types import SimpleNamespace

import numpy as np
import pytest

from grader.comparison.criteria import compare
from grader.comparison.evidence import Submission
from grader.comparison.task import task_of
from grader.feedback.mistakes import MISTAKES
from grader.feedback.redo_steps import with_mistakes_explained
from grader.feedback.sentences import mistake_feedback
from grader.language import LANGUAGES
from grader.marking.drawn import explain
from grader.marking.mark import judge
from grader.marking.naming import Lost, named
from grader.marking.report import report_of
from grader.outcomes import CHARGED, CREDITED
from grader.overlay.measured import measured_picture
from grader.rubric import load_both
from grader.tables.measurements import measurements_in, names_of
from reference.authored.assignment import Variant
from reference.construction.graph import evaluate
from reference.construction.mistakes import (
    OF_FORCES,
    Drawing,
    Mistake,
    affected,
    commit,
    made_at,
    mistakes_of_forces,
)
from reference.plan import exact_plan
from tests.bench.force_students import HANDS, ForceMistake, StudentForces, force_task
from tests.bench.judging_forces import Tally, count, measure_forces, sheets

MADE = {
    ForceMistake("reversed", "F_i3"): ("inertia_reversed", "F_i3", {"F_i3"}),
    ForceMistake("missing", "F_i3"): ("force_missing", "F_i3", {"F_i3"}),
    ForceMistake("reversed", "F_D"): ("force_reversed", "F_D", {"F_D"}),
    ForceMistake("reversed", "R_43"): ("force_reversed", "R_43", {"R_43"}),
    ForceMistake("wrong_arm", "3 R_43"): ("wrong_arm", "R_13_t", {"R_13_t"}),
    ForceMistake("part", "R_13_t", factor=-1.0): ("sense_reversed", "R_13_t", {"R_13_t"}),
    ForceMistake("line", "R_0D", turn_deg=90.0): ("parallel_for_perpendicular", "R_0D", {"R_0D"}),
    ForceMistake("slip", "F_i3", factor=1.4): ("arithmetic", "F_i3", {"F_i3"}),
    ForceMistake("slip", "M_b", factor=1.5): ("arithmetic", "M_b", {"M_b"}),
    ForceMistake("slip", "M_b", factor=0.001): ("units", "M_b", {"M_b"}),
    ForceMistake("slip", "M_b", factor=0.0012): ("arithmetic", "M_b", {"M_b"}),
    ForceMistake("scale", "kF", factor=2.0): ("scale_wrong", "kF", {"kF"}),
    ForceMistake("arrow", "R_13"): ("force_reversed", "R_13", {"R_13"}),
    ForceMistake("turned", "F_i3", turn_deg=40.0): (None, "", {"F_i3"}),
}


def pump(mistake=None, seed=5):
    """A student's sheet of the pump, and its judgement."""
    assignment, rubric = force_task("pump")
    student = StudentForces(
        assignment, assignment.variants()[4], HANDS["careful"], mistake, np.random.default_rng(seed)
    )
    return student, judge(task_of(assignment, rubric, student.variant), student.submission)


@pytest.mark.parametrize("mistake", MADE, ids=str)
def test_a_mistake_costs_where_it_was_made_and_is_named(mistake):
    code, at, charged = MADE[mistake]
    _, judgement = pump(mistake)
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == charged
    assert [(one.code, one.at) for one in judgement.mistakes] == ([(code, at)] if code else [])


@pytest.mark.parametrize(
    ("name", "made", "named_too", "arrow"),
    [
        ("pump", ForceMistake("slip", "F_D", factor=2.0), {("arithmetic", "F_D")}, "R_34"),
        ("pump", ForceMistake("reversed", "R_43"), {("force_reversed", "R_43")}, "R_13"),
        ("press", ForceMistake("slip", "F_D", factor=2.0), {("arithmetic", "F_D")}, "R_13_t"),
        ("pump", ForceMistake("turned", "F_D", turn_deg=40.0), set(), "R_13"),
    ],
)
def test_a_reversed_entry_beside_another_mistake_is_told_as_reversed(name, made, named_too, arrow):
    assignment, rubric = force_task(name)
    variant, rng = assignment.variants()[4], np.random.default_rng(7)
    student = StudentForces(assignment, variant, HANDS["typical"], made, rng)
    length, turn = student.entered[arrow]
    student.entered[arrow] = length, turn + 180.0
    judgement = judge(task_of(assignment, rubric, variant), student.submission)
    assert {(one.code, one.at) for one in judgement.mistakes} == named_too | {("force_reversed", arrow)}
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == {made.at, arrow}


def test_a_force_that_is_laid_off_reversed_is_named_beside_what_closes_its_polygon():
    assignment, rubric = force_task("shaper")
    variant, made = assignment.variants()[4], ForceMistake("reversed", "R_A1")
    student = StudentForces(assignment, variant, HANDS["careful"], made, np.random.default_rng(5))
    judgement = judge(task_of(assignment, rubric, variant), student.submission)
    assert [(one.code, one.at) for one in judgement.mistakes] == [("force_reversed", "R_A1")]


def test_a_moment_in_another_unit_is_told_with_that_unit():
    for factor, unit in {0.001: "kN m", 1000.0: "N mm", -0.001: "kN m"}.items():
        (named_slip,) = pump(ForceMistake("slip", "M_b", factor=factor))[1].mistakes
        told = mistake_feedback(named_slip, "en", "hint")
        assert told == f"M_b was entered in {unit}, not N m. Enter it in N m."


def test_a_wrong_arm_explains_neither_given_forces_nor_what_stands_beside_a_right_part():
    assignment, _ = force_task("pump")
    construction = exact_plan(assignment, [assignment.variants()[4]]).construction
    made = Mistake("wrong_arm", construction.vectors["R_13_t"].head)
    replay = SimpleNamespace(cost=0.0, made=(made,), unexplained=(), not_explained=frozenset(), right={})

    def explained(lost, right=()):
        found = named([replay], construction, Lost(lost, {}, right=frozenset(right)), has_directions=True)
        return [one.explains for one in found]

    assert explained({"F_i3": "F_i3", "R_02": "R_02"}) == [("R_02",)]
    assert explained({"F_i3": "F_i3"}) == []
    assert explained({"R_02": "R_02"}, right=["R_13_t"]) == []


def test_every_order_of_the_given_forces_is_right():
    for seed in range(4):
        _, judgement = pump(seed=seed)
        assert {one.verdict for one in judgement.outcomes} == {"full"}


def test_a_vector_that_closes_a_polygon_has_its_own_sense_wherever_it_is_told():
    student, judgement = pump(ForceMistake("arrow", "R_13"))
    plan = exact_plan(student.task, [student.variant])
    assert plan.construction.vectors["R_13"].reversed
    told = next(one for one in judgement.outcomes if one.name == "R_13")
    assert told.expected.direction_deg == pytest.approx(plan.direction_deg("R_13")[0])
    assert told.measured.direction_deg == pytest.approx(student.entered["R_13"][1])
    (why,) = [one for one in told.reasons if one.code == "reversed"]
    assert why.parameters["measured_deg"] == pytest.approx(student.entered["R_13"][1])
    right, judgement = pump()
    outcomes = {one.name: one for one in judgement.outcomes}
    picture = measured_picture("", right.submission.measured, plan.construction, outcomes, show_expected=True)
    (arrow,) = [one for one in picture.scene.arrows if one.name == "R_13"]
    drawn = complex(arrow.tip[0] - arrow.tail[0], arrow.tail[1] - arrow.tip[1])
    assert abs(np.angle(drawn / plan.drawn_mm("R_13")[0], deg=True)) < 3.0
    assert not any(dot.lettered for dot in picture.scene.dots)


def test_no_node_of_a_polygon_is_named_in_a_report_or_a_sentence():
    assignment, rubric = force_task("pump")
    nodes = {
        step.node
        for figure, steps in task_of(
            assignment, rubric, assignment.variants()[4]
        ).construction.figures.items()
        if figure.startswith("force_plan")
        for step in steps
    }
    for mistake in MADE:
        student, judgement = pump(mistake)
        task = task_of(assignment, rubric, student.variant)
        for lang in LANGUAGES:
            report = report_of(task, judgement, "s", language=lang)
            report = with_mistakes_explained(report, judgement, assignment, student.variant, lang)
            said = [report.model_dump_json(), *(mistake_feedback(one, lang) for one in judgement.mistakes)]
            assert not [node for node in nodes for text in said if f" {node} " in text or f'"{node}"' in text]


def test_a_mistake_in_what_acts_moves_nodes_and_is_made_at_some():
    assignment, _ = force_task("pump")
    drawing = exact_plan(assignment, [assignment.variants()[4]]).drawing
    nodes = {step.node for step in drawing.construction.steps}
    for mistake in mistakes_of_forces(drawing):
        assert affected(mistake, drawing.construction) <= nodes
        assert made_at(mistake, drawing.construction) <= nodes | {"M_b"}


def test_every_mistake_of_forces_has_words():
    assert OF_FORCES | {"wrong_arm"} <= MISTAKES.keys()


def test_a_magnitude_of_the_moment_loses_its_sense_alone():
    student, _ = pump()
    assignment, rubric = force_task("pump")
    task = task_of(assignment, rubric, student.variant)
    entered = student.submission
    verdicts = {}
    for sign in (1.0, -1.0):
        entered.values["M_b"] = sign * student.moment
        judgement = judge(task, entered)
        verdicts[sign] = next(one for one in judgement.outcomes if one.name == "M_b")
    assert verdicts[1.0].verdict in CREDITED
    assert "value_reversed" in verdicts[-1.0].codes


def test_the_bench_judges_right_sheets_right():
    tally = measure_forces(1, 97001, ["right"])["right"]
    assert tally.clear > 100
    assert not tally.wrong
    assert not tally.false


@pytest.mark.parametrize(
    ("name", "seed", "kinds", "made"),
    [
        pytest.param("press", 98101, "others", ("entry", "G_3"), id="a moment after a wrong entry"),
        pytest.param("press", 98404, "known", ("missing", "F_D"), id="a reaction beside the one it equals"),
        pytest.param("pump", 98052, "known", ("missing", "F_i"), id="a reaction that closes a triangle"),
        pytest.param("pump", 98101, "known", ("reversed", "F_i"), id="what follows is too short to judge"),
        pytest.param("shaper", 133501, "known", ("reversed", "F_i"), id="one of many is too short to judge"),
        pytest.param("pump", 166004, "others", ("turned", "F_i2"), id="a part that its moment makes short"),
    ],
)
def test_what_was_drawn_rightly_after_a_mistake_is_not_charged(name, seed, kinds, made):
    task, rubric = force_task(name)
    every = dict(sheets(name, "typical", seed, kinds)).items()
    (found,) = (
        (text, one) for text, one in every if one.mistake and (one.mistake.kind, one.mistake.at) == made
    )
    tally = Tally()
    count(tally, *found, judge(task_of(task, rubric, found[1].variant), found[1].submission))
    assert tally.clear > 10
    assert tally.wrong == []


@pytest.mark.parametrize(
    ("name", "seed", "at"), [("pump", 165014, "F_i"), ("pump", 165004, "F_i"), ("press", 165105, "F_i2")]
)
def test_what_follows_without_forces_is_not_charged_and_a_blank_is_no_slip(name, seed, at):
    (task, rubric), made = force_task(name), ForceMistake("missing", at)
    variant = task.variants()[int(np.random.default_rng(seed).integers(len(task.variants())))]
    hand, rng = HANDS["typical" if seed == 165004 else "careful"], np.random.default_rng((seed, 1))
    student, tally = StudentForces(task, variant, hand, made, rng), Tally()
    judgement = judge(task_of(task, rubric, variant), student.submission)
    count(tally, "", student, judgement)
    assert (tally.wrong, [one for one in judgement.mistakes if one.code == "arithmetic"]) == ([], [])


@pytest.mark.parametrize(
    ("seed", "made"),
    [
        (98415, ForceMistake("scale", "kF", factor=1.25)),
        (98416, ForceMistake("line", "R_0D", turn_deg=90.0)),
    ],
    ids=str,
)
def test_no_computing_is_called_wrong_where_its_vector_is_credited(seed, made):
    task, rubric = force_task("press")
    (student,) = (one for _, one in sheets("press", "typical", seed, "known") if one.mistake == made)
    judgement = judge(task_of(task, rubric, student.variant), student.submission)
    assert [one.at for one in judgement.mistakes] == [made.at]


def test_a_wrong_entry_of_a_reaction_between_right_ones_is_charged():
    student, judgement = pump(ForceMistake("entry", "R_34", factor=1.4, turn_deg=40.0))
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == student.wrong == {"R_34"}


MECHANISM = """schema_version = 1
id = "crank"
length_unit = "mm"
title = { en = "Offset crank" }
ground = { O1 = [0, 0] }
[crank]
link = "1"
pivot = "O1"
pin = "A"
length = 70
angle_deg = "15 + 11*n"
rpm = 420
[[group]]
type = "RRP"
node = "B"
pin = "A"
link = "2"
length = 260
guide = { through = [0, -40], angle_deg = 0 }
side = "ahead"
"""
ASSIGNMENT = """schema_version = 1
id = "crank"
mechanism = "crank"
rubric = "crank"
gravity = 9.81
title = { en = "Forces" }
task = { en = "Draw." }
variant = { n = { from = 1, to = 30 } }
scales = { kL = 0.004, kv = 0.05, ka = 2.0, kF = 20 }
[[body]]
link = "2"
mass = 4
inertia = 0.03
centre = { base = ["A", "B"], ratio = 0.4 }
[[body]]
link = "slider_B"
mass = 5
[[load]]
link = "slider_B"
force = "900 + 20*n"
motion = "against"
[[page]]
kind = "forces"
figures = ["mechanism", "force_plan_B", "force_plan_A"]
"""
ENTERED = {
    "mass of the rod 0.4 kg": (
        26,
        {"R_12_t": (3.7, 93.5), "F_i2": (2.1, 316.1), "G_2": (0.4, 285.4), "F_B": (70.8, 180.0)}
        | {"F_iB": (17.4, 0.9), "G_B": (2.3, 268.9), "R_0B": (3.5, 270.7), "R_12_n": (52.4, 4.8)}
        | {"R_12": (52.4, 8.2), "R_B2": (53.7, 186.7), "R_21": (52.6, 188.4), "R_01": (52.4, 8.7)},
    ),
    "F_i2 turned by 25 degrees": (
        30,
        {"R_12_t": (4.5, 265.9), "F_i2": (29.1, 16.4), "G_2": (2.0, 272.1), "F_B": (75.1, 179.9)}
        | {"F_iB": (41.9, 359.7), "G_B": (2.5, 270.5), "R_0B": (1.8, 94.7), "R_12_n": (5.3, 357.1)}
        | {"R_12": (6.8, 316.0), "R_B2": (33.4, 182.1), "R_21": (6.9, 136.0), "R_01": (6.8, 316.4)},
    ),
}


CHARGED_ALONE = {
    "F_B twice as long, and entered the other way": (
        19,
        {"R_12_t": (10.0, 92.9), "F_i2": (21.6, 212.6), "G_2": (1.8, 263.6), "F_B": (127.7, 0.4)}
        | {"F_iB": (20.4, 180.7), "G_B": (2.1, 269.7), "R_0B": (1.9, 85.5), "R_12_n": (167.4, 1.8)}
        | {"R_12": (167.4, 4.3), "R_B2": (148.2, 180.7), "R_21": (167.3, 184.4), "R_01": (167.0, 4.3)},
        {"F_B"},
    ),
    "inertia along the accelerations, F_B entered the other way": (
        15,
        {"R_12_t": (1.0, 247.0), "F_i2": (24.5, 359.5), "G_2": (2.5, 277.0), "F_B": (60.5, 0.0)}
        | {"F_iB": (24.0, 359.5), "G_B": (2.5, 272.0), "R_0B": (8.0, 89.5), "R_12_n": (11.5, 351.0)}
        | {"R_12": (11.0, 345.0), "R_B2": (36.0, 171.0), "R_21": (12.0, 164.5), "R_01": (12.0, 344.5)},
        {"F_i2", "F_iB", "F_B"},
    ),
    "F_iB twice as long, and R_12_t entered the other way": (
        29,
        {"R_12_t": (6.1, 267.8), "F_i2": (27.3, 344.7), "G_2": (1.8, 273.3), "F_B": (73.6, 179.9)}
        | {"F_iB": (76.7, 359.8), "G_B": (2.6, 265.1), "R_0B": (5.3, 91.3), "R_12_n": (29.6, 178.3)}
        | {"R_12": (30.2, 166.2), "R_B2": (3.4, 36.6), "R_21": (29.9, 346.6), "R_01": (30.1, 166.2)},
        {"F_iB", "R_12_t"},
    ),
}


def crank(folder, n, drawn, moment=None):
    """Return the judgement of a student's sheet of the offset crank."""
    asked = {one: f'vector = "{one}"' for one in drawn} | ({"M_b": 'moment = "M_b"'} if moment else {})
    rows = "".join(
        f'[[criterion]]\nid = "{one}"\ntitle = {{ en = "x" }}\npoints = 1\n{key}\n'
        for one, key in asked.items()
    )
    head = 'schema_version = 1\nid = "crank"\ntitle = { en = "Forces" }\n'
    files = {"mechanism": MECHANISM, "assignment": ASSIGNMENT, "rubric": head + rows}
    for kind, text in files.items():
        (folder / f"crank.{kind}.toml").write_text(text, encoding="utf-8")
    assignment, rubric = load_both(folder / "crank.assignment.toml")
    cells = {name: str(one[0]) for name, one in drawn.items()} | {"kF": "20 N/mm"}
    cells |= {f"{name}_deg": str(one[1]) for name, one in drawn.items()}
    cells |= {"M_b_value": moment} if moment else {}
    entered = measurements_in(cells, names_of(assignment), "", "en")
    handed_in = Submission(measured=entered.reading, values=entered.values, declared=entered.scales)
    return judge(task_of(assignment, rubric, Variant(n)), handed_in)


@pytest.mark.parametrize("made", ENTERED)
def test_an_unknown_mistake_in_one_force_is_neither_another_variant_nor_another_unit(made, tmp_path):
    found = crank(tmp_path, *ENTERED[made])
    assert not {"other_variant", "data_misread", "units"} & {one.code for one in found.mistakes}


@pytest.mark.parametrize("made", CHARGED_ALONE)
def test_what_follows_beside_a_vector_that_was_entered_the_other_way_is_credited(made, tmp_path):
    n, drawn, charged = CHARGED_ALONE[made]
    found = crank(tmp_path, n, drawn)
    assert {one.name for one in found.outcomes if one.verdict in CHARGED} == charged


def test_a_couple_of_the_other_sense_is_named_beside_a_wrong_load(tmp_path):
    drawn = {"R_12_t": (2.4, 76.7), "G_2": (1.9, 273.4), "F_i2": (24.2, 166.3), "F_iB": (26.5, 180.2)}
    drawn |= {"F_B": (116.4, 0.1), "G_B": (2.2, 273.2), "R_0B": (21.6, 270.6), "R_12_n": (69.5, 165.1)}
    drawn |= {"R_12": (69.7, 163.5), "R_B2": (93.3, 344.8), "R_21": (69.7, 343.3), "R_01": (69.7, 163.6)}
    found = crank(tmp_path, 13, drawn)
    assert {(one.code, one.at) for one in found.mistakes} == {
        ("arithmetic", "F_B"),
        ("couple_reversed", "M_i2"),
    }


def test_a_couple_left_out_is_named_beside_a_wrong_arm_whose_part_was_not_entered():
    (assignment, rubric), variant = force_task("press"), force_task("press")[0].variants()[4]
    drawing = exact_plan(assignment, [variant], accelerations=False).drawing
    vectors, known = drawing.construction.vectors, {k: v.ravel()[0] for k, v in drawing.parameters.items()}
    drawn = commit(Mistake("wrong_arm", vectors["R_13_t"].head), Drawing(drawing.construction, known))
    couples = (one for one in mistakes_of_forces(drawn) if one.at == "M_i2")
    drawn = commit(next(one for one in couples if one.code == "couple_missing"), drawn)
    nodes = evaluate(drawn.construction, drawn.parameters)
    spans = {name: complex(nodes[one.arrow[1]] - nodes[one.arrow[0]]) for name, one in vectors.items()}
    cells = {name: str(round(abs(span), 1)) for name, span in spans.items() if name != "R_13_t"}
    cells |= {f"{name}_deg": str(round(degrees(phase(spans[name])) % 360.0, 1)) for name in cells}
    entered = measurements_in(cells | {"kF": f"{known['kF']} N/mm"}, names_of(assignment), "", "en")
    handed_in = Submission(measured=entered.reading, declared=entered.scales)
    named_too = judge(task_of(assignment, rubric, variant), handed_in).mistakes
    assert {("couple_missing", "M_i2"), ("wrong_arm", "R_13_t")} < {(one.code, one.at) for one in named_too}


def test_a_moment_waits_while_a_force_from_which_it_follows_cannot_be_used(tmp_path):
    drawn = {"R_12_t": (8.1, 89.2), "R_0B": (59793.1, 269.8), "R_12_n": (59798.7, 89.5)}
    (found,) = (one for one in crank(tmp_path, 18, drawn, "-69850").outcomes if one.name == "M_b")
    assert found.verdict == "review"


@pytest.mark.parametrize(("name", "joint", "scale"), [("shaper", "E", "none"), ("pump", "D", "full")])
def test_a_force_taken_over_from_a_plan_at_another_scale_is_credited(name, joint, scale):
    assignment, rubric = force_task(name)
    made, rng = ForceMistake("reversed", f"F_{joint}"), np.random.default_rng(5)
    student = StudentForces(assignment, assignment.variants()[4], HANDS["careful"], made, rng)
    task = task_of(assignment, rubric, student.variant)
    for one in task.construction.vectors_of(f"force_plan_{joint}"):
        length, turn = student.entered[one.name]
        student.entered[one.name] = 2.0 * length, turn
    said = {one.name: one.verdict for one in judge(task, student.submission).outcomes}
    assert (said["kF"], said["R_43"]) == (scale, "follow_through")


@pytest.mark.parametrize(("declared", "charged"), [(50, {"F_D"}), (100, {"F_D", "kF"})])
def test_a_scale_is_shown_by_most_given_forces_and_not_by_a_wrong_one(declared, charged):
    student, _ = pump(ForceMistake("slip", "F_D", factor=2.0))
    entered = replace(student.submission, declared={"kF": f"{declared} N/mm"})
    judgement = judge(task_of(*force_task("pump"), student.variant), entered)
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == charged


def test_a_scale_is_shown_by_no_force_that_is_too_short_to_tell_it():
    (task, rubric), made = force_task("shaper"), ForceMistake("scale", "kF", factor=2.0)
    (student,) = (one for _, one in sheets("shaper", "typical", 166102, "known") if one.mistake == made)
    judgement = judge(task_of(task, rubric, student.variant), student.submission)
    assert {one.name for one in judgement.outcomes if one.verdict in CHARGED} == {"kF"}


def test_of_two_vectors_that_end_where_a_force_was_laid_off_only_that_force_is_blamed():
    task, rubric = force_task("shaper")
    made = ForceMistake("reversed", "R_43")
    student = StudentForces(task, task.variants()[4], HANDS["careful"], made, np.random.default_rng(5))
    drawn = task_of(task, rubric, student.variant)
    explanation = compare(drawn, student.submission, explain).explanation
    assert explanation is not None
    assert explanation.blamed == {"R_43"}
