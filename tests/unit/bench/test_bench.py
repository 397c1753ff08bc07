"""The benchmark: what it counts, and that it counts rightly."""

import importlib.util
import json

import pytest

from grader.bench import branches, solver, speed, stability
from grader.bench.branches import BranchRow
from grader.bench.peers import PEERS, Package
from grader.bench.reading import MISREAD_MM, ReadingRow, _kind
from grader.bench.report import Report
from grader.bench.singular import KINDS
from grader.bench.solver import SolverBench, measure_errors
from grader.bench.speed import NOT_INSTALLED, SpeedRow, measure_speed, speed_rows
from grader.bench.stability import DISTANCES_QUICK, measure_stability
from grader.cli.benchmark import show_benchmark
from grader.records import ReadVector

SURE, UNSURE = 0.95, 0.5
LEAST = 0.9
SHARE_OF_PLAN = 1e-12
"""Error allowed, relative to the plan's size."""
DRAWN = {"length_mm": 50.0, "direction_deg": 90.0, "line_mm": [[10.0, 100.0], [10.0, 52.0]]}
ABSENT = Package("no such solver", "no-such-solver", "no_such_solver", "Solver")

READING = ReadingRow(
    dpi=300.0, sheets=2, turned=0, off_scale=1, vectors=40,
    times_ms={"decode": 20.0, "sheet": 100.0, "ink": 700.0, "reading": 300.0},
    node_median_mm=0.1, node_p95_mm=0.4, node_worst_mm=None,
    read=0.75, doubtful=0.2, unread=0.05, misreads=0,
)  # fmt: skip


def found(length_mm=50.0, direction_deg=90.0, confidence=SURE):
    return ReadVector(length_mm, 0.1, direction_deg, 0.1, confidence)


@pytest.mark.parametrize(
    ("truth", "read_as", "kind"),
    [
        (DRAWN, found(), "read"),
        (DRAWN, found(50.0 + 0.9 * MISREAD_MM), "read"),
        (DRAWN, found(48.2), "read"),  # 1.8 mm off its nodes, 0.2 mm off its stroke
        (DRAWN, found(50.0 + 1.1 * MISREAD_MM), "misread"),
        (DRAWN, found(direction_deg=270.0), "misread"),
        (DRAWN, found(direction_deg=92.0), "misread"),
        (DRAWN, found(60.0, confidence=UNSURE), "doubtful"),
        (DRAWN, None, "unread"),
        (DRAWN, ReadVector(None, 0.1, 90.0, 0.1, SURE), "unread"),
        ({**DRAWN, "length_mm": 2.0}, found(40.0), "beside"),
        (None, found(), "misread"),
        (None, found(confidence=UNSURE), "beside"),
        (None, None, "beside"),
    ],
)
def test_a_vector_is_counted_for_what_became_of_it(truth, read_as, kind):
    assert _kind(truth, read_as, LEAST) == kind


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
    monkeypatch.setattr(speed, "PYLINKAGE", ABSENT)


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
    assert "1120" in text
    assert "75 %" in text
    assert "7123 (1425)" in text
    assert json.loads(json.dumps(report.as_json()))["reading"][0]["misreads"] == 0


@pytest.mark.parametrize("peer", PEERS, ids=lambda peer: peer.name)
def test_a_peers_version_is_known_where_it_is_installed(peer):
    assert (peer.version is not None) == (importlib.util.find_spec(peer.module) is not None)


@pytest.mark.parametrize("solver_only", [True, False])
def test_the_command_prints_the_solvers_figures_and_the_readings_unless_told_otherwise(
    solver_only, monkeypatch, capsys
):
    branch = BranchRow("closed form", 100, 0, 0, 0)

    class Bench:
        steps = 1
        figures = solver.SolverFigures(branches=(branch,))

        def __init__(self, quick):
            assert quick

        def run(self):
            yield "branches"

    monkeypatch.setattr("grader.bench.solver.SolverBench", Bench)
    monkeypatch.setattr("grader.bench.reading.measure_reading", lambda *, quick: iter([READING] * quick))
    show_benchmark(quick=True, as_json=True, solver_only=solver_only)
    told = json.loads(capsys.readouterr().out)
    assert told["solver"]["branches"][0]["cases"] == 100
    assert len(told["reading"]) == (0 if solver_only else 1)
