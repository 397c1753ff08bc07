"""The benchmark of judging: drawings, verdicts due, and counting."""

from dataclasses import replace

import numpy as np
import pytest

from grader.authoring.lint import lint
from grader.comparison.task import task_of
from grader.marking.mark import judge
from grader.outcomes import NamedMistake as Named
from reference.authored.assignment import load_assignment
from reference.construction.mistakes import Mistake as Operator
from samples.simulation.hand import draw
from samples.simulation.hand import task_of as drawing_task
from samples.simulation.mistakes import Occasion, possible, with_mistake
from samples.simulation.mistakes import StudentMistake as Mistake
from samples.simulation.settings import PERFECT, Student
from tests.bench import judging
from tests.bench.judging import judged, main, measure_class, measure_judging
from tests.bench.judging_handed_in import Visible, computed, exact_rates, off, submission
from tests.bench.judging_naming import is_named, mistakes_due
from tests.bench.judging_students import (
    ASSIGNMENTS,
    SOURCES,
    StudentKey,
    StudentWork,
    assignment_named,
    student,
    vectors_of,
)
from tests.bench.judging_tally import (
    ClassTime,
    JudgingTally,
    MarkedCriterion,
    judging_tables,
    result_of,
    summed,
)
from tests.bench.judging_truth import verdicts_due
from tests.bench.plain_text import as_text

STEEP = StudentKey("pump", "careful", "single", 1)
ROUNDING_MM = 1e-9


def drawn(name, *mistakes, n=None, position=None, declares=True, letters=False, left_out=()):
    """A perfect hand's work with just these mistakes in it."""
    assignment, rubric = assignment_named(name)
    variant = assignment.variant(n, position)
    habits = Student(sheets=1)
    task = drawing_task(assignment, variant, habits, np.random.default_rng(1))
    wrong = task.right
    for mistake in mistakes:
        wrong = with_mistake(wrong, mistake)
    task = replace(task, wrong=wrong, mistakes=mistakes)
    sheets = draw(task, PERFECT, habits, np.random.default_rng(2))
    skipped = frozenset(left_out) | task.missing
    return StudentWork(STEEP, assignment, rubric, task, sheets, declares, letters, skipped)


def due(work, source="nodes"):
    """The verdicts due to each criterion, the mistakes due, and the vectors seen."""
    seen = Visible.of(submission(work, source), work.construction.links)
    return verdicts_due(work, source, seen), mistakes_due(work, source, seen), seen


def group(found, verdict):
    return {name for name, one in found.items() if one == verdict}


# Who drew what --------------------------------------------------------------------------------------


@pytest.mark.parametrize("name", [name for name in ASSIGNMENTS if name not in {"pump", "press"}])
def test_every_mechanism_of_the_benchmark_can_be_drawn_in_all_its_variants(name):
    assignment, rubric = assignment_named(name)
    found = lint(assignment, rubric)
    assert not [one for one in found.findings if one.severity == "fault"]


def test_a_key_gives_the_same_student_in_every_run_and_another_key_another():
    one, again, other = (student(StudentKey("press", "typical", "single", seed)) for seed in (3, 3, 4))
    assert one.sheets == again.sheets
    assert one.sheets != other.sheets
    assert submission(one, "directions") == submission(again, "directions")


def test_the_same_drawing_is_handed_in_from_its_nodes_with_directions_and_by_its_lengths_alone():
    work = student(StudentKey("engine", "careful", "right", 5))
    read, turned, ruled = (submission(work, source) for source in SOURCES)
    assert read.readings
    assert read.measured is None
    sketch = work.own("velocity_plan")
    pole, head = (read.readings[0].figures["velocity_plan"].nodes[name].at for name in ("o", "a"))
    assert abs(head - pole - (sketch["a"] - sketch["o"])) < 1.0
    lengths = ruled.measured.figures["velocity_plan"].vectors
    assert lengths["v_A"].direction_deg is None
    assert abs(lengths["v_A"].length_mm - abs(sketch["a"] - sketch["o"])) < 1.0
    assert turned.measured.figures["velocity_plan"].vectors["v_A"].direction_deg is not None


# What is due ----------------------------------------------------------------------------------------


@pytest.mark.parametrize("source", SOURCES)
@pytest.mark.parametrize(
    ("name", "n", "position"), [("pump", 4, None), ("press", None, 1), ("offset", 5, None)]
)
def test_all_of_a_right_drawing_is_due_full_marks(name, n, position, source):
    found, made, _ = due(drawn(name, n=n, position=position), source)
    assert set(found.values()) <= {"right", "absent"}
    assert not made


def test_where_a_line_is_drawn_wrongly_its_nodes_vectors_are_wrong_and_the_rest_follows():
    found, made, _ = due(drawn("press", Mistake("parallel_for_perpendicular", "b", 0), position=1))
    assert group(found, "wrong") == {"v_B", "v_BA"}
    assert group(found, "follows") >= {"v_C", "v_D", "a_BA_n", "a_B_n", "a_B", "a_D"}
    assert found["v_A"] == found["a_A"] == "right"
    assert [one.visible for one in made] == [True]


def test_a_normal_component_the_wrong_way_round_does_not_show_in_lengths_where_it_was_made():
    mistake = Mistake("normal_reversed", "n_B")
    seen_whole, _, _ = due(drawn("press", mistake, position=1))
    by_length, made, _ = due(drawn("press", mistake, position=1), "lengths")
    assert seen_whole["a_B_n"] == "wrong"
    assert seen_whole["a_B"] == "follows"
    assert by_length["a_B_n"] == "right"
    assert by_length["a_B"] == "either"
    assert made[0].visible


def test_of_a_plan_turned_as_a_whole_its_first_vector_is_wrong_and_lengths_show_nothing():
    mistake = Mistake("figure_rotated", "velocity_plan", quarters=1)
    found, _, _ = due(drawn("press", mistake, position=1))
    assert group(found, "wrong") == {"v_A"}
    assert found["v_B"] == found["v_DC"] == "follows"
    assert found["a_A"] == "right"
    by_length, made, _ = due(drawn("press", mistake, position=1), "lengths")
    assert not group(by_length, "wrong")
    assert not made[0].visible


def test_a_wrong_scale_is_due_a_charge_itself_and_none_of_its_vectors():
    mistake = Mistake("scale_wrong", "kv", factor=2.0)
    found, made, _ = due(drawn("press", mistake, position=1))
    assert group(found, "wrong") == {"kv"}
    assert found["v_A"] == found["v_B"] == "follows"
    assert made[0].visible
    undeclared, made, _ = due(drawn("press", mistake, position=1, declares=False))
    assert undeclared["kv"] == "absent"
    assert undeclared["v_A"] == "either"
    assert undeclared["v_B"] == "follows"
    assert not made[0].visible


def test_a_wrong_scale_may_be_charged_at_the_vector_from_which_its_plan_follows_instead():
    mistake = Mistake("scale_wrong", "kv", factor=2.0)
    there = result([mistake], kv="full", v_A="none")
    neither = result([mistake], kv="full", v_A="full")
    dues = [{one.criterion: one.due for one in marked.criteria} for marked in (there, neither)]
    assert (dues[0]["kv"], dues[0]["v_A"]) == ("either", "either")
    assert (dues[1]["kv"], dues[1]["v_A"]) == ("wrong", "follows")


def test_a_plates_image_by_similarity_has_fewer_vectors_than_the_rubric_asks_for():
    keys = (StudentKey("pump", "careful", "single", seed) for seed in range(200))
    works = (student(key) for key in keys)
    work = next(
        one for one in works if "a_CA_n" not in one.construction.vectors
        and one.declares and any(made.code == "scale_wrong" for made in one.task.mistakes)
    )  # fmt: skip
    (found, *_) = judged(work.key, sources=("nodes",))
    assert {one.criterion: one.due for one in found.criteria}["a_CA_n"] == "absent"


def test_a_wrong_assembly_is_charged_on_the_sketch_or_else_where_the_plan_first_shows_it():
    work = drawn("press", Mistake("other_assembly", "D"), position=1)
    found, _, _ = due(work)
    assert group(found, "wrong") == {"CD"}
    assert found["v_DC"] == found["a_DC_n"] == "follows"
    unseen, _, _ = due(work, "directions")
    assert group(unseen, "either") >= {"v_D", "v_DC"}
    assert not group(unseen, "wrong")
    assert unseen["CD"] == "absent"
    assert unseen["a_DC_n"] == "follows"


def test_of_another_students_data_the_crank_is_charged_or_else_the_first_vector_and_the_rest_follows():
    right = drawn("press", position=1)
    choices = possible("other_variant", Occasion(right.assignment, right.variant, right.task.right))
    work = drawn("press", next(one for one in choices if one.position == 3), position=1)
    found, made, _ = due(work)
    assert group(found, "wrong") == {"O1A"}
    assert found["v_A"] == found["v_B"] == found["v_D"] == "follows"
    assert made[0].visible
    unseen, _, _ = due(work, "directions")
    assert group(unseen, "wrong") == {"v_A"}
    assert unseen["a_A"] == "either"
    assert unseen["v_B"] == unseen["v_D"] == "follows"


def test_letters_swapped_are_wrong_in_every_vector_of_both_unless_told_as_letters():
    swap = Mistake("labels_swapped", "velocity_plan", other=("b", "c"))
    found, _, _ = due(drawn("pump", swap, n=4))
    assert group(found, "wrong") >= {"v_B", "v_BA", "v_C", "v_CA", "v_DC"}
    assert found["v_A"] == found["v_D"] == "right"
    told, made, _ = due(drawn("pump", swap, n=4, letters=True))
    assert told["v_B"] == "either"
    assert made[0].visible


def test_a_vector_that_is_not_drawn_shows_on_a_sheet_and_not_among_measurements():
    work = drawn("press", Mistake("vector_missing", "v_D"), position=1)
    found, made, _ = due(work)
    assert found["v_D"] == "absent"
    assert made[0].visible
    assert not due(work, "lengths")[1][0].visible


def test_a_force_drawn_the_wrong_way_is_wrong_itself_and_what_closes_its_polygon_follows():
    task = task_of(*assignment_named("press-forces"), load_assignment("press-forces").variant(None, 4))
    occasion = Occasion(task.assignment, task.variant, drawn("press-forces", position=4).task.right)
    mistake = next(one for one in possible("force_reversed", occasion) if one.at == "F_D")
    work = drawn("press-forces", mistake, position=4)
    assert work.changed_by(mistake) == {task.construction.vectors["F_D"].head}
    found, made, _ = due(work)
    assert group(found, "wrong") == {"F_D"}
    assert {"R_0D", "R_24", "R_13", "R_01"} <= group(found, "follows")
    assert [one.visible for one in made] == [True]


def test_what_a_hand_misses_by_itself_is_neither_right_nor_wrong():
    work = drawn("engine", n=3)
    first = work.sheets[0]
    plan = next(one for one in first.figures if one.name == "velocity_plan")
    moved = replace(plan, nodes={**plan.nodes, "b": plan.nodes["b"] + 2.0})
    figures = tuple(moved if one is plan else one for one in first.figures)
    found, _, _ = due(replace(work, sheets=(replace(first, figures=figures),)))
    assert found["v_B"] == "missed"
    assert found["v_A"] == "right"


def test_vectors_are_compared_by_the_rubrics_plain_tolerance():
    tolerance = assignment_named("press")[1].tolerance
    assert off(51.0 + 0j, 50.0 + 0j, tolerance, directed=True) == pytest.approx(1.0)
    assert off(202.0 + 0j, 200.0 + 0j, tolerance, directed=True) == pytest.approx(0.5)
    turned = 50.0 * np.exp(1j * np.radians(3.0))
    assert off(turned, 50.0 + 0j, tolerance, directed=True) == pytest.approx(2.0)
    assert off(turned, 50.0 + 0j, tolerance, directed=False) == pytest.approx(0.0, abs=ROUNDING_MM)
    assert off(1.0 + 0j, complex("nan"), tolerance, directed=True) == np.inf


# What a report names --------------------------------------------------------------------------------


def test_two_mistakes_that_draw_the_same_count_as_each_other():
    turned = Mistake("figure_rotated", "velocity_plan", quarters=2)
    work = drawn("press", turned, position=1)
    seen = Visible.of(submission(work, "nodes"), work.construction.links)
    right = work.task.right
    both = [vectors_of(right, [one]) for one in (turned, Mistake("sense_reversed", "a"))]
    assert all(abs(both[0][name] - both[1][name]) < ROUNDING_MM for name in both[0])
    assert is_named(work, "nodes", seen, turned, Named(Operator("sense_reversed", "a"), (), 0.9))
    assert not is_named(work, "nodes", seen, turned, Named(Operator("sense_reversed", "a'"), (), 0.9))
    itself = Named(Operator("figure_rotated", "velocity_plan", quarters=2), (), 0.9)
    assert is_named(work, "nodes", seen, turned, itself)


def test_a_mistake_that_differs_only_in_direction_is_as_good_in_lengths_alone():
    made = Mistake("image_mirrored", "c")
    work = drawn("engine", Mistake("sense_reversed", "a"), n=3)
    seen = Visible.of(submission(work, "lengths"), {})
    named = Named(Operator("figure_rotated", "velocity_plan", quarters=1), (), 0.9)
    assert is_named(work, "lengths", seen, work.task.mistakes[0], named)
    assert not is_named(work, "lengths", seen, made, Named(Operator("sense_reversed", "b"), (), 0.9))


# How it is counted ----------------------------------------------------------------------------------


def result(made=(), **verdicts):
    """A submission of the press with the right verdicts but for those given."""
    work = drawn("press", *made, position=1)
    handed_in = submission(work, "nodes")
    judgement = judge(task_of(work.assignment, work.rubric, work.variant), handed_in)
    outcomes = tuple(
        replace(one, verdict=verdicts.get(one.criterion, one.verdict)) for one in judgement.outcomes
    )
    return result_of(work, "nodes", handed_in, replace(judgement, outcomes=outcomes, mistakes=()))


def test_false_charges_and_false_credits_are_counted_apart():
    right = result(v_B="none", v_C="review")
    wrong = result([Mistake("parallel_for_perpendicular", "b", 0)], v_B="full", v_BA="full")
    tally = JudgingTally()
    tally.add(right)
    assert tally.false_charges.hits == 1
    assert tally.reviews.hits == 1
    assert tally.false_credits.of == 0
    assert tally.accused.of == 1
    tally.add(wrong)
    assert (tally.false_credits.hits, tally.false_credits.of) == (2, 2)
    assert (tally.named.hits, tally.named.of) == (0, 1)
    assert "v_B full (due: wrong)" in str(wrong)
    assert not right.is_clean


def test_a_mistake_charged_at_one_of_the_vectors_that_show_it_is_no_false_credit_at_the_other():
    tally = JudgingTally()
    tally.add(result([Mistake("parallel_for_perpendicular", "b", 0)], v_B="full", v_BA="none"))
    assert (tally.false_credits.hits, tally.false_credits.of) == (0, 1)


def test_credit_given_for_what_follows_is_counted_of_all_that_follows():
    tally = JudgingTally()
    for verdict in ("follow_through", "full", "none", "review", "not_judged"):
        tally._add_criterion(MarkedCriterion("v_C", "follows", verdict))
    assert (tally.followed.hits, tally.followed.of) == (2, 4)
    assert (tally.false_charges.hits, tally.false_charges.of) == (1, 4)


def test_students_of_each_kind_are_judged_from_each_source_and_shown(monkeypatch):
    monkeypatch.setattr(judging, "HANDS", ("careful",))
    figures = measure_judging(1, assignments=("engine",))
    assert len(figures.results) == 4 * len(SOURCES)
    assert {where for (where,) in summed(figures.results, ("kind",))} == {"right", "single", "pair", "slip"}
    figures.classes.append(ClassTime("engine", 1000, 50, 0.5, 1.0, 1.1))
    text = as_text(judging_tables(figures))
    assert "engine" in text
    assert "1000" in text
    assert "making the task" in text


def test_one_case_is_told_in_full(capsys):
    main(["--case", "engine", "careful", "single", "4"])
    told = capsys.readouterr().out
    assert "engine careful single 4" in told
    assert "due" in told
    assert judged(StudentKey("engine", "careful", "single", 4))


# Values computed, whole classes --------------------------------------------------------------


def test_a_slip_in_one_value_is_wrong_there_and_nowhere_else():
    work = student(StudentKey("shaper", "careful", "slip", 1))
    told = computed(work)
    assert told.values[told.slip] == pytest.approx(told.right[told.slip] * told.factor)
    assert {name for name in told.values if told.values[name] != told.right[name]} == {told.slip}
    found, made, _ = due(work)
    assert group(found, "wrong") == {told.slip}
    assert not made
    handed_in = submission(work, "nodes")
    judgement = judge(task_of(work.assignment, work.rubric, work.variant), handed_in)
    one = result_of(work, "nodes", handed_in, judgement)
    assert one.first.code == "arithmetic"
    assert one.first.at == told.slip


def test_values_computed_from_a_right_drawing_are_the_exact_ones_to_a_hands_errors():
    work = replace(drawn("shaper", n=4), key=StudentKey("shaper", "careful", "slip", 2))
    exact = exact_rates(work)
    told = computed(work)
    assert set(exact) <= set(told.right)
    for name, (value, per_mm) in exact.items():
        assert abs(told.right[name] - value) < 1.0 * per_mm + 0.005 * abs(value), name


def test_the_sense_of_a_value_is_due_only_where_it_can_be_told():
    mistake = Mistake("sense_reversed", "a")
    work = replace(drawn("press", mistake, position=1), key=StudentKey("press", "careful", "single", 0))
    seeds = (StudentKey("press", "careful", "single", seed) for seed in range(20))
    with_values = next(one for key in seeds if computed(one := replace(work, key=key)).values)
    found, _, _ = due(with_values, "directions")
    by_length, _, _ = due(with_values, "lengths")
    assert found["omega_2"] == "follows"
    assert by_length["omega_2"] == "either"


@pytest.mark.slow
def test_a_class_goes_through_the_whole_program():
    timed = measure_class(6, "engine")
    assert timed.graded == timed.rows == 6
    assert timed.processor_s > 0.0
