"""The benchmark: what it counts, and that it counts rightly."""

import json

import pytest

from tests.bench import solver
from tests.bench.__main__ import Report, main
from tests.bench.branches import BranchRow
from tests.bench.judging_tally import JudgingFigures
from tests.bench.reading_tally import ReadingTally, row_of
from tests.bench.singular import KINDS
from tests.bench.solver import SolverBench, measure_errors
from tests.bench.speed import SpeedRow, measure_speed, speed_rows
from tests.bench.stability import DISTANCES_QUICK, measure_stability

SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size."""

READING = row_of("plain", "a plain sheet", ReadingTally(refused=7), 123.0)


@pytest.mark.slow
def test_every_built_in_assignment_is_held_against_fifty_digits():
    rows = {row.assignment: row for row in measure_errors()}
    assert rows.keys() >= {"pump", "press", "engine", "shaper"}
    for row in rows.values():
        assert 0.0 < row.velocity <= SHARE_OF_PLAN
        assert 0.0 < row.acceleration <= SHARE_OF_PLAN
        assert 0.0 < row.rates <= SHARE_OF_PLAN
        assert row.construction <= SHARE_OF_PLAN


@pytest.mark.slow
def test_the_speed_of_ours_stands_beside_scipys_with_the_errors_of_each():
    rows = list(measure_speed(quick=True, batches=(1, 30)))
    assert len(rows) == speed_rows()
    timed = [row for row in rows if row.accelerations and set(row.us) == {1, 30}]
    assert {row.solver for row in timed} >= {"closed form", "construction", "scipy fsolve"}
    assert all(0.0 < us < 1e6 for row in timed for us in row.us.values())
    errors = {row.solver: row.acceleration_error for row in timed}
    assert errors["closed form"] <= SHARE_OF_PLAN
    assert errors["closed form"] < errors["scipy fsolve"] < 1e-6


@pytest.mark.slow
def test_the_bench_of_the_solver_measures_as_many_rows_as_it_says(monkeypatch):
    few = KINDS[:1]
    monkeypatch.setattr(solver, "KINDS", few)
    monkeypatch.setattr(
        solver, "measure_stability", lambda *, quick: measure_stability(quick=quick, kinds=few)
    )
    monkeypatch.setattr(solver, "measure_speed", lambda *, quick: measure_speed(quick=quick, batches=(1,)))
    bench = SolverBench(quick=True)
    told = list(bench.run())
    assert len(told) == bench.steps
    figures = bench.figures
    assert len(figures.stability) == len(DISTANCES_QUICK)
    assert figures.branches[0].wrong == figures.branches[0].silent == 0
    text, document = Report(figures).as_text(), Report(figures).as_json()
    assert few[0].title in text
    assert "Reading" not in text
    assert json.loads(json.dumps(document))["solver"]["stability"][0]["kind"] == few[0].id


def test_the_report_shows_time_and_error_and_is_json_too():
    ours = SpeedRow("closed form", None, accelerations=True, us={30: 5.0}, velocity_error=1e-16)
    theirs = SpeedRow("peer", "1.0", accelerations=True, us={30: 7123.0}, velocity_error=1e-16)
    figures = solver.SolverFigures(speed=(ours, theirs), branches=(BranchRow("peer", 100, 3, 2, 1),))
    report = Report(figures, (READING,))
    text = report.as_text()
    assert "a plain sheet" in text
    assert "123" in text
    assert "7123 (1425)" in text
    assert json.loads(json.dumps(report.as_json()))["reading"][0]["refused"] == 7


@pytest.mark.parametrize(
    "asked", [["solver", "reading", "judging"], ["solver"], ["reading"], ["judging", "reading"]]
)
def test_the_command_prints_the_figures_of_the_parts_asked_for(asked, monkeypatch, capsys):
    branch = BranchRow("closed form", 100, 0, 0, 0)

    class Bench:
        steps = 1
        figures = solver.SolverFigures(branches=(branch,))
        rows, foreign, curve, lines = (READING,), (), (), None

        def __init__(self, quick, students=None, whole=False):
            assert quick
            assert students is None
            if whole:
                self.figures = JudgingFigures()

        def run(self):
            yield "branches"

    monkeypatch.setattr("tests.bench.__main__.SolverBench", Bench)
    monkeypatch.setattr("tests.bench.__main__.ReadingBench", Bench)
    monkeypatch.setattr("tests.bench.__main__.JudgingBench", Bench)
    main(["--quick", "--json", *(f"--{part}" for part in asked)])
    told = json.loads(capsys.readouterr().out)
    assert (told["solver"] is not None) == ("solver" in asked)
    assert len(told["reading"]) == ("reading" in asked)
    assert (told["judging"] is not None) == ("judging" in asked)
