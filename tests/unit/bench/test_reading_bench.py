"""The benchmark of reading: its rules of right and misread, its spreads, its strokes."""

from dataclasses import replace

import numpy as np
import pytest

from grader.records import VELOCITY_PLAN, Figure, ReadVector, Sheet
from reference.authored.assignment import load_assignment
from reference.construction.derive import construction_of
from samples.simulation import Scan, simulate
from samples.simulation.settings import PERFECT, Settings
from tests.bench.lines import (
    LinesFigures,
    Noiseless,
    lines_tables,
    measure_noiseless,
    measure_resolution,
)
from tests.bench.reading import CurveRow, curve_picture, curve_tables, measure_scene
from tests.bench.reading_scenes import scene_named
from tests.bench.reading_tally import NORMAL_SHARES, ErrorSpread, ReadingTally, calibration, row_of, whitened
from tests.bench.reading_truth import (
    LEAST_MM,
    MISREAD_MM,
    OnPaper,
    TrueVector,
    each_vector,
    figures_of,
    judged,
)

SURE, UNSURE = 0.95, 0.5
ENDS, STROKE = (10 - 100j, 10 - 50j), (10 - 100j, 10 - 52j)
"""50 mm between its nodes, 48 mm as ruled."""
DRAWN = TrueVector("v_B", VELOCITY_PLAN, ENDS, STROKE)
OFFSET_MM = 0.01
"""The median distance of strokes from where they were drawn is 0.003 mm at 100 dpi."""
VERTEX_MM = 0.003
"""Largest error of the intersections of ideal strokes."""
PLACE_MM = 1e-3
IDEAL = Noiseless(4, 0, 0.001, 0.002, 0.003)


def found(length_mm=50.0, direction_deg=90.0, confidence=SURE):
    return ReadVector(length_mm, 0.1, direction_deg, 0.1, confidence)


@pytest.mark.parametrize(
    ("read_as", "right", "misread"),
    [
        (found(), True, False),
        (found(50.29), True, False),
        (found(50.31), False, False),
        (found(48.2), True, False),  # 1.8 mm off its nodes, 0.2 mm off its stroke
        (found(49.0), False, False),  # between the two, near neither
        (found(direction_deg=90.29), True, False),
        (found(direction_deg=90.4), False, False),
        (found(50.0 + 1.1 * MISREAD_MM), False, True),
        (found(direction_deg=270.0), False, True),
        (found(60.0, confidence=UNSURE), False, False),
        (None, False, False),
        (ReadVector(None, 0.1, 90.0, 0.1, SURE), False, False),
    ],
)
def test_a_vector_is_right_by_its_nodes_or_its_stroke_and_misread_when_confidently_far_off(
    read_as, right, misread
):
    one = judged(DRAWN, read_as)
    assert (one.right, one.misread) == (right, misread)
    assert one.reported == (read_as is not None and read_as.length_mm is not None)


def test_directions_of_a_turned_drawing_are_judged_relative_to_it():
    read_as = found(direction_deg=92.5)
    assert judged(DRAWN, read_as).misread
    assert judged(DRAWN, read_as, turn_deg=-2.5).right
    assert judged(DRAWN, found(), turn_deg=-2.5).misread


def test_a_short_vector_may_turn_as_far_as_its_end_stays_within_the_limit_across():
    short = TrueVector("v_B", VELOCITY_PLAN, (0j, 4 + 0j), None)
    assert judged(short, found(4.0, 4.0)).right
    assert not judged(short, found(4.0, 5.0)).right
    assert judged(short, found(4.0, 4.0)).short


def drawn_plan(**changed):
    plan = {
        "nodes": {"o": [0, 0], "a": [60, 0], "b": [60, 0.3], "c": [30, 0], "d": [30, 40]},
        "vectors": {
            "v_A": {"line_mm": [[0, 0], [60, 0]]}, "v_D": {"line_mm": [[0, 0], [30, 40]]},
        },
        "missing": {"v_C": "not drawn out", "v_BA": "too short to draw", "v_DC": "mistake"},
    }  # fmt: skip
    return {"figures": {VELOCITY_PLAN: {**plan, **changed}}}


@pytest.mark.parametrize(
    ("name", "read_as", "misread"),
    [
        ("v_C", found(30.0, 0.0), False),  # covered by v_A's stroke
        ("v_C", found(33.0, 0.0), True),  # not what lies between the nodes
        ("v_BA", found(0.4, 270.0), False),  # nodes that coincide
        ("v_BA", found(9.0, 270.0), True),
        ("v_DC", found(40.0, 270.0), True),  # left out, on bare paper
        ("v_DC", found(40.0, 270.0, UNSURE), False),
        ("v_DC", None, False),
    ],
)
def test_an_undrawn_vector_is_a_misread_unless_real_geometry_stands_in_its_place(name, read_as, misread):
    construction = construction_of(load_assignment("pump").mechanism([load_assignment("pump").variants()[0]]))
    figures = figures_of(drawn_plan(), construction)
    reading = {VELOCITY_PLAN: Figure({}, {name: read_as} if read_as else {})}
    one = next(one for one in each_vector(figures, [name], reading))
    assert one.misread == misread
    assert not one.right


def test_a_construction_line_that_was_not_drawn_over_covers_what_is_read_there():
    construction = construction_of(load_assignment("pump").mechanism([load_assignment("pump").variants()[0]]))
    thin = drawn_plan(construction=[[[30, -5], [30, 45]]])
    figures = figures_of(thin, construction)
    reading = {VELOCITY_PLAN: Figure({}, {"v_DC": found(40.0, 270.0)})}
    one = next(one for one in each_vector(figures, ["v_DC"], reading))
    assert not one.misread
    assert not one.counts


def test_a_sheet_is_right_only_where_all_long_vectors_are_and_nothing_is_misread():
    good = judged(DRAWN, found())
    short = judged(TrueVector("v_C", VELOCITY_PLAN, (0j, 0.9 * LEAST_MM + 0j), None), None)
    invented = judged(TrueVector("v_D", VELOCITY_PLAN, None, None, "mistake"), found(20.0))
    row = row_of("", "", ReadingTally(judged=[[good, short], [good, invented], [judged(DRAWN, None)]]), None)
    assert row.sheets_right == pytest.approx(1 / 3)
    assert (row.vectors, row.short, row.misreads, row.confidently) == (3, 1, 1, 3)
    assert row.unread == pytest.approx(1 / 3)


def test_gaussian_errors_have_the_spread_that_they_should():
    rng = np.random.default_rng(4)
    spread = ErrorSpread.of(list(rng.standard_normal(20_000)))
    assert spread.under_1 == pytest.approx(NORMAL_SHARES[0], abs=0.01)
    assert spread.under_196 == pytest.approx(NORMAL_SHARES[1], abs=0.01)
    assert spread.rms == pytest.approx(1.0, abs=0.02)
    assert ErrorSpread.of([]).rms is None


def test_a_place_is_judged_along_the_axes_of_its_covariance():
    turn = np.array([[0.8, -0.6], [0.6, 0.8]])
    cov = turn @ np.diag([0.01, 4.0]) @ turn.T
    assert np.abs(whitened(2.0 * complex(*turn[:, 1]), cov)) == pytest.approx([0.0, 1.0])
    assert np.abs(whitened(0.1 * complex(*turn[:, 0]), cov)) == pytest.approx([1.0, 0.0])


def test_a_confidence_is_held_against_what_came_true():
    bins = {one.low: one for one in calibration([(0.92, 0.1), (0.94, 0.7), (0.3, 9.0), (1.0, 0.2)])}
    assert (bins[0.9].count, bins[0.9].right) == (2, 0.5)
    assert bins[0.99].count == 1
    assert bins[0.5].right is None


@pytest.mark.parametrize("device", ["flatbed", "phone"])
def test_a_place_read_is_followed_to_the_paper_by_its_pixel(device):
    scan = Scan(device=device, dpi=20.0, quarter_turns=1, lens_k1=0.02, tilt_deg=5.0)
    assignment = load_assignment("engine")
    one = simulate(assignment, assignment.variants()[1], 2, Settings(PERFECT, scan=scan))[0]
    shift = np.array([[1.0, 0.0, 3.0], [0.0, 1.0, -2.0], [0.0, 0.0, 1.0]])
    truth = {**one.truth, "lens": None}
    sheet = Sheet(np.array(truth["homography"]) @ shift, (420, 297), "markers", 1, 90, 0, 0, (0, 0, 1, 1))
    on_paper = OnPaper(truth, sheet, one.image.shape)
    read = np.array([50 - 60j, 300 - 200j])
    assert np.abs(on_paper(read) - (read + 3 + 2j)).max() < PLACE_MM
    assert np.abs(on_paper.back(on_paper(read)) - read).max() < PLACE_MM
    assert np.abs(on_paper.scale_and_turn()[0]).max() < PLACE_MM


def test_vertices_of_ideal_strokes_are_where_lines_meet():
    ideal = measure_noiseless()
    assert ideal.missed == 0
    assert ideal.p95_mm < VERTEX_MM


@pytest.mark.slow
def test_strokes_are_measured_against_the_pencil_strokes_that_were_drawn():
    row = measure_resolution(120.0)
    assert row.recall_solid > 0.9
    assert row.offset_mm[0] < OFFSET_MM
    assert row.fragments < 2.0
    assert str(row.spurious) in next(lines_tables(LinesFigures([row], IDEAL)))[2][0]


@pytest.mark.slow
def test_a_scene_is_timed_from_the_file_to_the_students_page():
    row = measure_scene(replace(scene_named("plain"), dpi=100.0), 1, memory=False)
    assert all(spent > 0.0 for spent in row.times_ms.values())
    assert sum(row.times_ms.values()) < row.processor_ms * 1.2


def test_the_curve_of_time_against_error_is_a_table_and_a_picture(tmp_path):
    row = row_of("plain", "a scene", ReadingTally(node_errors_mm=[0.1, 0.3], processor_ms=[800.0]), None)
    rows = [CurveRow("one way", dpi, row) for dpi in (150, 300)]
    ((_, heads, cells),) = curve_tables(rows)
    assert cells[1][:4] == ["one way", "300", "800", "0.200 / 0.290"]
    assert len(heads) == len(cells[0])
    curve_picture(rows, tmp_path / "curve.svg")
    assert "one way" in (tmp_path / "curve.svg").read_text(encoding="utf-8")
