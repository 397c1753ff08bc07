"""The benchmark: what it counts, and that it counts rightly."""

import pytest

from tests.bench import solver
from tests.bench.__main__ import PARTS, USUAL, main
from tests.bench.plain_text import as_text
from tests.bench.reading_tally import ReadingTally, reading_tables, row_of
from tests.bench.singular import KINDS
from tests.bench.solver import SolverFigures, measure_solver, solver_tables
from tests.bench.speed import SpeedRow, measure_speed
from tests.bench.stability import DISTANCES_QUICK, measure_stability

SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size."""


@pytest.mark.slow
def test_the_speed_of_ours_stands_beside_scipys_with_the_errors_of_each():
    rows = list(measure_speed(quick=True, batches=(1, 30)))
    timed = [row for row in rows if set(row.us) == {1, 30}]
    assert {row.solver for row in timed} >= {"closed form", "construction", "scipy fsolve"}
    assert all(0.0 < us < 1e6 for row in timed for us in row.us.values())
    errors = {row.solver: row.acceleration_error for row in timed}
    assert errors["closed form"] <= SHARE_OF_PLAN
    assert errors["closed form"] < errors["scipy fsolve"] < 1e-6


@pytest.mark.slow
def test_the_solver_is_measured_with_a_row_for_each_distance(monkeypatch):
    few = KINDS[:1]
    monkeypatch.setattr(
        solver, "measure_stability", lambda *, quick: measure_stability(quick=quick, kinds=few)
    )
    monkeypatch.setattr(solver, "measure_speed", lambda *, quick: measure_speed(quick=quick, batches=(1,)))
    figures = measure_solver(quick=True)
    assert len(figures.stability) == len(DISTANCES_QUICK)
    assert few[0].title in as_text(solver_tables(figures))


def test_tables_show_time_beside_ours_and_pages_refused():
    ours = SpeedRow("closed form", None, us={30: 5.0}, velocity_error=1e-16)
    theirs = SpeedRow("peer", "1.0", us={30: 7123.0}, velocity_error=1e-16)
    figures = SolverFigures(speed=(ours, theirs))
    assert "7123 (1425)" in as_text(solver_tables(figures))
    text = as_text(reading_tables([row_of("plain", "a plain sheet", ReadingTally(refused=7), 123.0)]))
    assert "a plain sheet" in text
    assert "123" in text
    assert "7, 0" in text


@pytest.mark.parametrize(
    "asked", [["solver", "reading", "judging"], ["settling"], ["judging", "reading"], []]
)
def test_the_command_prints_the_tables_of_the_parts_asked_for(asked, monkeypatch, capsys):
    def measured(part):
        return lambda students, quick: [(f"{part} of {students}, {quick}", ["figure"], [["1"]])]

    monkeypatch.setattr("tests.bench.__main__.PARTS", {part: measured(part) for part in PARTS})
    main(["--quick", "--students", "3", *(f"--{part}" for part in asked)])
    told = capsys.readouterr().out
    assert {part for part in PARTS if f"{part} of 3, True" in told} == set(asked or USUAL)
