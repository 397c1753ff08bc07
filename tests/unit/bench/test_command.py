"""`planmark bench`: the solver's two computations, and the samples read against their truth."""

import json

import pytest
import typer.testing

from grader.cli import benchmark
from grader.cli.app import app
from grader.cli.benchmark import (
    ReadingRow,
    SolverRow,
    construction_error,
    measure_reading,
    measure_solver,
    vector_results,
)
from grader.records import VELOCITY_PLAN, Figure, Reading, ReadVector
from reference.authored.assignment import load_assignment
from reference.plan import exact_plan

SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size."""
TRUTH = {
    "figures": {
        VELOCITY_PLAN: {
            "nodes": {"o": [0, 0], "b": [0, -50]},
            "vectors": {
                "v_B": {"tail": "o", "head": "b", "length_mm": 50.0, "line_mm": [[0, 0], [0, -48]]},
                "v_C": {"tail": "b", "head": "o", "length_mm": 50.0, "line_mm": None},
            },
        }
    }
}


@pytest.mark.parametrize(("length_mm", "error_mm"), [(50.25, 0.25), (48.5, 0.5), (47.0, 1.0)])
def test_a_vectors_error_is_that_to_its_nodes_or_to_its_stroke(length_mm, error_mm):
    read = Reading({VELOCITY_PLAN: Figure({}, {"v_B": ReadVector(length_mm, 0.1, 90.0, 0.1, 0.9)})})
    results = {result.name: result for result in vector_results(TRUTH, read)}
    assert results["v_B"].error_mm == pytest.approx(error_mm)
    assert results["v_B"].confidence == 0.9
    assert (results["v_C"].error_mm, results["v_C"].confidence) == (float("inf"), 0.0)


def test_the_construction_agrees_with_the_closed_form_and_an_error_of_either_shows():
    row = measure_solver("shaper", rounds=1)
    assert row.variants == 30
    assert 0.0 < row.error <= SHARE_OF_PLAN
    assert 0.0 < row.closed_form_us < 1e6
    shaper = load_assignment("shaper")
    plan = exact_plan(shaper, shaper.variants())
    plan.nodes_mm[VELOCITY_PLAN]["a"][4] += 1e-3 * plan.size_mm(VELOCITY_PLAN)[4]
    assert construction_error(plan) == pytest.approx(1e-3, rel=1e-6)


def test_a_students_samples_are_read_right_and_none_is_misread():
    row = measure_reading("press", students=1)
    assert row.pages == 2
    assert row.vectors == row.right == 16
    assert row.misread == 0


@pytest.fixture
def measured(monkeypatch):
    """The measuring replaced: what it was asked."""
    asked = []

    def solver(name, rounds):
        asked.append(rounds)
        return SolverRow(name, 30, 9.0, 18.0, 1e-15)

    def reading(name, students):
        asked.append(students)
        return ReadingRow(name, 13, 1372.0, 154, 140, 123, 0)

    monkeypatch.setattr(benchmark, "measure_solver", solver)
    monkeypatch.setattr(benchmark, "measure_reading", reading)
    return asked


def test_the_command_prints_a_document_with_both_parts(measured):
    result = typer.testing.CliRunner().invoke(app, ["bench", "--quick", "--json"])
    document = json.loads(result.stdout)
    assert document["schema_version"] == benchmark.SCHEMA_VERSION
    assert {row["assignment"] for row in document["solver"]} >= {"pump", "press"}
    assert [row["samples"] for row in document["reading"]] == list(benchmark.CLASSES)
    assert set(measured) == {benchmark.ROUNDS_QUICK, 1}


def test_the_command_prints_tables_and_measures_all_without_quick(measured):
    result = typer.testing.CliRunner().invoke(app, ["bench"])
    assert "pump-collinear" in result.stdout
    assert "1372" in result.stdout
    assert set(measured) == {benchmark.ROUNDS, None}
