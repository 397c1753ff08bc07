"""The benchmark: what it counts, and that it counts rightly."""

import json

import pytest

from grader.bench.reading import MISREAD_MM, ReadingRow, _kind
from grader.bench.report import Report
from grader.bench.solver import measure_solver
from grader.records import ReadVector

SURE, UNSURE = 0.95, 0.5
LEAST = 0.9
DRAWN = {"length_mm": 50.0, "direction_deg": 90.0, "line_mm": [[10.0, 100.0], [10.0, 52.0]]}


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


def test_the_solver_is_measured_against_fifty_digits():
    figures = measure_solver(quick=True, batches=(1, 30))
    assert [row.variants for row in figures.times] == [1, 30]
    assert all(0.0 < row.closed_form_us < 1e6 for row in figures.times)
    assert {row.assignment for row in figures.errors} >= {"pump", "press", "engine"}
    for row in figures.errors:
        assert 0.0 < row.velocity <= 1e-12
        assert 0.0 < row.acceleration <= 1e-12
        assert row.construction <= 1e-12


def test_the_report_shows_time_and_error_and_is_json_too():
    row = ReadingRow(
        dpi=300.0, sheets=2, turned=0, off_scale=1, vectors=40,
        times_ms={"decode": 20.0, "sheet": 100.0, "ink": 700.0, "reading": 300.0},
        node_median_mm=0.1, node_p95_mm=0.4, node_worst_mm=None,
        read=0.75, doubtful=0.2, unread=0.05, misreads=0,
    )  # fmt: skip
    report = Report(measure_solver(quick=True, batches=(1,)), (row,))
    text = report.as_text()
    assert "1120" in text
    assert "75 %" in text
    assert json.loads(json.dumps(report.as_json()))["reading"][0]["misreads"] == 0
