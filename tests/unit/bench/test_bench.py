"""The benchmark: what it counts, and that it counts rightly."""

import importlib.util
import json

import pytest

from grader.bench import branches, solver, speed, stability
from grader.bench.branches import BranchRow
from grader.bench.judging_tally import JudgingFigures
from grader.bench.peers import PEERS, Package
from grader.bench.reading_tally import Tally, row_of
from grader.bench.report import Report
from grader.bench.singular import KINDS
from grader.bench.solver import SolverBench, measure_errors
from grader.bench.speed import NOT_INSTALLED, SpeedRow, measure_speed, speed_rows
from grader.bench.stability import DISTANCES_QUICK, measure_stability
from grader.cli.benchmark import show_benchmark

SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size."""
ABSENT = Package("no such solver", "no-such-solver", "no_such_solver", "Solver")

READING = row_of("plain", "a plain sheet", Tally(refused=7), 123.0)


def test_every_built_in_assignment_is_held_against_fifty_digits():
    rows = {row.assignment: row for row in measure_errors()}
    assert rows.keys() >= {"pump", "press", "engine", "shaper"}
    for row in rows.values():
        assert 0.0 < row.velocity <= SHARE_OF_PLAN
        assert 0.0 < row.acceleration <= SHARE_OF_PLAN
        assert 0.0 < row.rates <= SHARE_OF_PLAN
        assert row.construction <= SHARE_OF_PLAN


@pytest.fixture
def only_scipy(monkeypatch):
    """Of the peers, the one that is always there, and one that never is."""
    scipy = next(peer for peer in PEERS if peer.module == "scipy")
    for module in (speed, stability, branches):
        monkeypatch.setattr(module, "PEERS", (ABSENT, scipy))


@pytest.mark.usefixtures("only_scipy")
def test_the_speed_of_ours_stands_beside_the_peers_with_the_errors_of_each():
    rows = list(measure_speed(quick=True, batches=(1, 30)))
    assert len(rows) == speed_rows()
    timed = [row for row in rows if row.accelerations and set(row.us) == {1, 30}]
    assert {row.solver for row in timed} >= {"closed form", "construction", "scipy fsolve"}
    assert all(0.0 < us < 1e6 for row in timed for us in row.us.values())
    errors = {row.solver: row.acceleration_error for row in timed}
    assert errors["closed form"] <= SHARE_OF_PLAN
    assert errors["closed form"] < errors["scipy fsolve"] < 1e-6


@pytest.mark.usefixtures("only_scipy")
def test_a_peer_that_is_not_installed_is_told_and_nothing_of_it_is_measured():
    rows = [row for row in measure_speed(quick=True, batches=(1,)) if row.solver.startswith(ABSENT.name)]
    assert rows
    assert all(row.note == NOT_INSTALLED and not row.us for row in rows)
    text = Report(solver.SolverFigures(speed=tuple(measure_speed(quick=True, batches=(1,))))).as_text()
    assert NOT_INSTALLED in text


@pytest.mark.usefixtures("only_scipy")
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


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_a_peers_version_is_known_where_it_is_installed(peer):
    assert (peer.version is not None) == (importlib.util.find_spec(peer.module) is not None)


@pytest.mark.parametrize(
    "asked", [["solver", "reading", "judging"], ["solver"], ["reading"], ["judging", "reading"]]
)
def test_the_command_prints_the_figures_of_the_parts_asked_for(asked, monkeypatch, capsys):
    branch = BranchRow("closed form", 100, 0, 0, 0)

    class Bench:
        steps = 1
        figures = solver.SolverFigures(branches=(branch,))
        rows, foreign, lines = (READING,), (), None

        def __init__(self, quick, students=None, whole_class=None, scan=None):
            assert quick
            assert students is None
            if whole_class is not None and scan is not None:
                self.figures = JudgingFigures()

        def run(self):
            yield "branches"

    monkeypatch.setattr("grader.bench.solver.SolverBench", Bench)
    monkeypatch.setattr("grader.bench.reading.ReadingBench", Bench)
    monkeypatch.setattr("grader.bench.judging.JudgingBench", Bench)
    show_benchmark(quick=True, as_json=True, parts=asked)
    told = json.loads(capsys.readouterr().out)
    assert (told["solver"] is not None) == ("solver" in asked)
    assert len(told["reading"]) == ("reading" in asked)
    assert (told["judging"] is not None) == ("judging" in asked)
