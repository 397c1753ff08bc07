"""Whatever is entered, for whatever mechanism: it is marked or refused, and nothing falls over."""

import csv
from collections.abc import Mapping

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.pipeline import mark
from grader.rubric import RubricFile, rubric_of
from grader.tables.measurements import StudentSubmission, measurements_in, names_of
from grader.web.self_check import checked_values
from reference.authored.assignment import Assignment, Variant, built_in, load_assignment
from reference.construction.mistakes import Drawing, single_mistakes
from reference.mechanism import Mechanism
from reference.quantities import unit_of
from tests.examples import examples
from tests.hands import measured, rule_scales, task_of
from tests.laws.test_marking_any_mechanism import asked_of

FEW = 8
"""Each marks a submission twice, in a second."""
ODD = ("0", "-0.0", "1e-320", "1e-9", "0.5", "60", "2000", "1e308", "nan", "inf", "-1", "180", "360", "-360")
SCALES = ("0", "-1", "1:5", "1:1e300", "1e-300 m/mm", "5 cm/cm", "kv = omega kL", "0.036 m/s·mm", "10", "x")


def entered(assignment: Assignment, rubric: RubricFile, variant: Variant, lot) -> dict[str, str]:
    """A drawing's numbers as a form has them: some left out, exchanged, or others instead."""
    task = task_of(assignment, rubric, variant)
    drawing = Drawing(task.construction, task.parameters)
    offered = [one for figure in task.construction.figures for one in single_mistakes(drawing, figure)]
    try:
        reading = measured(task, mistakes=tuple(lot.sample(offered, lot.choice([0, 1, 2]))))
    except ValueError:  # some have no drawing: parallel lines do not meet
        reading = measured(task)
    vectors = [item for figure in reading.figures.values() for item in figure.vectors.items()]
    cells = {name: repr(one.length_mm) for name, one in vectors}
    turned = [(name, one.direction_deg) for name, one in vectors if one.direction_deg is not None]
    cells |= {f"{name}_deg": repr(direction) for name, direction in turned}
    values = {**{name: abs(real) for name, real in task.real.items()}, **task.rates}
    cells |= {f"{name}_value": repr(float(value)) for name, value in values.items()}
    cells |= dict.fromkeys(sorted(names_of(assignment).unused)[:2], "5")
    share = lot.choice([0.0, 0.3, 1.0])
    kinds = lot.choice([("", "_deg", "_value"), ("", "_deg"), ("",), ("_deg",)])
    cells = {
        name: lot.choice(ODD) if lot.random() < share else text
        for name, text in cells.items()
        if ("_deg" if name.endswith("_deg") else "_value" if name.endswith("_value") else "") in kinds
    }
    cells = dict(lot.sample(sorted(cells.items()), max(1, round(len(cells) * lot.choice([0.1, 0.5, 1.0])))))
    for _ in range(lot.choice([0, 1, 4])):
        one, other = lot.choice(list(cells)), lot.choice(list(cells))
        cells[one], cells[other] = cells[other], cells[one]
    scales = {name: f"{scale!r} {unit_of(name)}" for name, scale in rule_scales(task).items()}
    return cells | {
        name: lot.choice([text, lot.choice(SCALES)]) for name, text in scales.items() if lot.random() < 0.7
    }


def marked(assignment: Assignment, rubric: RubricFile, variant: Variant, cells: Mapping[str, str]) -> None:
    measurements = measurements_in(cells, names_of(assignment), "values.csv", "en")
    report, _ = mark(StudentSubmission("s01", variant, measured=measurements), (), assignment, rubric)
    assert len(report.criteria) == len(rubric.criterion)
    assert 0.0 <= report.score_range[0] <= report.score_range[1] <= report.max_score


@given(name=st.sampled_from(built_in()), lot=st.randoms(use_true_random=False))
@settings(max_examples=examples(FEW))
def test_any_numbers_are_marked_for_every_built_in_assignment(name: str, lot):
    assignment = load_assignment(name)
    variant, rubric = lot.choice(assignment.variants()), rubric_of(assignment)
    cells = entered(assignment, rubric, variant, lot)
    marked(assignment, rubric, variant, cells)
    assert checked_values(str(assignment.path), variant, cells, "en", "hint")["lines"] is not None


@given(mechanism=..., lot=st.randoms(use_true_random=False))
@settings(max_examples=examples(FEW))
def test_any_numbers_are_marked_for_any_mechanism(mechanism: Mechanism, lot):
    assignment, rubric = asked_of(mechanism)
    marked(assignment, rubric, Variant(), entered(assignment, rubric, Variant(), lot))


@pytest.mark.parametrize(
    ("name", "n", "cells"),
    [
        # A length that only a computer can write: a scale followed it, infinitely wrong.
        ("pump-230", 6, {"v_A": "1e-320", "kv": "0.188 (m/s)/mm"}),
        # The driving link's vector without a length.
        ("pump-collinear", 17, {"v_A": "0", "a_A": "10", "kv": "10"}),
        # Values so large that their share of what is right is infinite.
        ("piston", 1, {"v_A_value": "1e308", "v_AB_value": "1e308"}),
        # Lines of another mechanism: one was sought through a node that nothing observed rests on.
        (
            "pump", 7,
            {
                "kv": "10", "ka": "10", "v_A": "50", "v_BA": "47.5", "v_BA_deg": "258", "v_C": "92.5",
                "a_A": "100", "a_B_n": "31.5", "a_B_n_deg": "104", "a_B_t": "70", "a_B_t_deg": "193",
                "a_D": "137.5", "a_D_deg": "180", "a_DC_n": "16", "a_DC_n_deg": "356",
            },
        ),
    ],
)  # fmt: skip
def test_numbers_that_once_ended_a_check_are_told(name, n, cells):
    assignment = load_assignment(name)
    assert checked_values(name, assignment.variant(n), cells, "en", "hint")["lines"]


def test_the_press_checked_as_the_pump_is_told_row_by_row(shared):
    path = shared / "hostile" / "press-table-checked-as-pump.csv"
    pump = load_assignment("pump")
    with path.open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file, delimiter=";"))
    for row in rows:
        cells = {name: text for name, text in row.items() if name not in {"student_id", "n", "position"}}
        assert checked_values("pump", pump.variant(7), cells, "en", "hint")["lines"]
        marked(pump, rubric_of(pump), pump.variant(7), cells)
