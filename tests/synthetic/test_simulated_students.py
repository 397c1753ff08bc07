"""The simulated student: errors propagate, mistakes are followed through, the truth says so."""

from dataclasses import replace

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from reference.plan import exact_plan
from samples.simulation import (
    CLEAN_SCAN,
    PERFECT,
    SLOPPY,
    PenStyle,
    Scan,
    Settings,
    Student,
    any_settings,
    measured_by,
    simulate,
)
from samples.simulation.hand import draw, task_of
from samples.simulation.mistakes import CODES

pytestmark = pytest.mark.slow
ROUNDING_MM = 2e-4
TINY = replace(CLEAN_SCAN, dpi=12.0)
"""A scan of a few pixels, where only the truth matters."""


def nodes_of(sheets, figure):
    truth = next(sheet.truth for sheet in sheets if figure in sheet.truth["figures"])
    return {name: complex(x, -y) for name, (x, y) in truth["figures"][figure]["nodes"].items()}


def vectors_of(sheets):
    figures = [figure for sheet in sheets for figure in sheet.truth["figures"].values()]
    return {name: vector for figure in figures for name, vector in figure.get("vectors", {}).items()}


@pytest.mark.parametrize("name", ["pump", "press", "engine", "pump-collinear", "shaper", "piston"])
def test_a_perfect_hand_draws_the_exact_plan(name):
    assignment = load_assignment(name)
    variant = assignment.variants()[2]
    sheets = simulate(assignment, variant, 4, Settings(hand=PERFECT, scan=TINY))
    plan = exact_plan(assignment, [variant])
    shrunk = sheets[0].truth["scales"]["used"]
    for figure in ("velocity_plan", "acceleration_plan"):
        nodes = nodes_of(sheets, figure)
        pole = nodes[plan.construction.poles[figure]]
        scale = "kv" if figure == "velocity_plan" else "ka"
        ratio = float(getattr(plan.scales, scale)[0]) / shrunk[scale]
        for node, at in plan.nodes_mm[figure].items():
            assert abs(nodes[node] - pole - ratio * complex(at[0])) < 10 * ROUNDING_MM
    for vector in vectors_of(sheets).values():
        assert vector["length_mm"] == pytest.approx(vector["intended"]["length_mm"], abs=ROUNDING_MM)
        assert vector["direction_deg"] == pytest.approx(vector["intended"]["direction_deg"], abs=2e-3)


@pytest.mark.parametrize("code", CODES)
def test_every_mistake_is_drawn_and_told(code):
    assignment = load_assignment("pump")
    settings = Settings(hand=PERFECT, student=Student(mistakes=(code,)), scan=TINY)
    sheets = simulate(assignment, assignment.variant(9), 6, settings)
    right = simulate(assignment, assignment.variant(9), 6, replace(settings, student=Student()))
    assert [mistake["code"] for mistake in sheets[0].truth["mistakes"]] == [code]
    assert told(sheets) != told(right)


def told(sheets):
    """The things that a mistake can change: vectors, letters written, or scales."""
    vectors = {n: (v["length_mm"], v["direction_deg"]) for n, v in vectors_of(sheets).items()}
    letters = sorted(label["names"] + label["text"] for sheet in sheets for label in sheet.truth["labels"])
    return vectors, letters, sheets[0].truth["scales"]["declared"]


def test_the_signs_of_a_label_fill_its_box():
    assignment = load_assignment("pump")
    (sheet, *_) = simulate(assignment, assignment.variant(9), 1, Settings(hand=PERFECT, scan=TINY))
    labels = [label for label in sheet.truth["labels"] if label["names"]]
    assert {"A", "o", "b"} <= {label["signs"][0][0] for label in labels}
    for label in labels:
        boxes = np.array([sign[1:] for sign in label["signs"]])
        corners = [*boxes[:, :2].min(axis=0), *boxes[:, 2:].max(axis=0)]
        np.testing.assert_allclose(corners, label["box_mm"], atol=1e-3)


def test_errors_grow_along_the_construction():
    assignment = load_assignment("pump")
    spread = {"a'": [], "d'": []}
    for seed in range(40):
        rng = np.random.default_rng(seed)
        student = Student()
        task = task_of(assignment, assignment.variant(9), student, rng)
        plan = draw(task, SLOPPY, student, rng)[0].figures[2]
        for node, misses in spread.items():
            misses.append(abs(plan.nodes[node] - plan.intended[node]))
    assert 0.3 < np.median(spread["a'"]) < 2.0
    assert np.median(spread["d'"]) > 1.5 * np.median(spread["a'"])


def test_two_sheets_carry_two_sketches_of_one_mechanism():
    assignment = load_assignment("pump")
    sheets = simulate(assignment, assignment.variant(4), 3, Settings(student=Student(sheets=2), scan=TINY))
    assert [sheet.truth["kind"] for sheet in sheets] == ["velocity", "acceleration"]
    first, second = (nodes_of([sheet], "mechanism") for sheet in sheets)
    lengths = [abs(nodes["B"] - nodes["A"]) for nodes in (first, second)]
    assert lengths[0] != lengths[1]
    assert lengths[0] == pytest.approx(lengths[1], abs=3.0)


def test_the_same_seed_draws_the_same_sheet_whatever_the_scanner():
    assignment = load_assignment("pump")
    settings = any_settings(5, device="flatbed")
    coarse = replace(settings, scan=replace(settings.scan, dpi=20.0, mode="grey"))
    fine = replace(settings, scan=replace(settings.scan, dpi=40.0, mode="colour", skew_deg=3.0))
    one, same, other = (simulate(assignment, assignment.variant(8), 5, s) for s in (coarse, coarse, fine))
    assert [sheet.truth for sheet in one] == [sheet.truth for sheet in same]
    assert all(np.array_equal(a.image, b.image) for a, b in zip(one, same, strict=True))
    assert [sheet.truth["figures"] for sheet in one] == [sheet.truth["figures"] for sheet in other]
    different = simulate(assignment, assignment.variant(8), 6, coarse)
    assert different[0].truth["figures"] != one[0].truth["figures"]


@pytest.mark.parametrize("turns", [0, 1, 2, 3])
def test_a_turned_scan_says_by_how_much(turns):
    scan = Scan(dpi=20.0, quarter_turns=turns, skew_deg=0.0)
    assignment = load_assignment("pump")
    truth = simulate(assignment, assignment.variant(8), 5, Settings(scan=scan))[0].truth
    homography = np.array(truth["homography"])
    right = homography[:2, 0]
    # Counter-clockwise on a screen is from +x towards -y.
    stored = np.degrees(np.arctan2(-right[1], right[0])) % 360
    assert (stored + truth["rotation_deg"]) % 360 == pytest.approx(0.0, abs=0.01)


def test_a_ruler_reads_the_drawing_to_its_own_error():
    assignment = load_assignment("pump")
    sheets = simulate(assignment, assignment.variant(8), 5, Settings(student=Student(sheets=2), scan=TINY))
    measured = measured_by(sheets, np.random.default_rng(1), spread_mm=0.0, step_mm=0.1)
    vectors = vectors_of(sheets)
    assert set(vectors) <= set(measured)
    for name, vector in vectors.items():
        assert measured[name] == pytest.approx(vector["length_mm"], abs=0.051)


def test_every_stroke_of_a_vector_joins_its_nodes():
    assignment = load_assignment("press")
    settings = Settings(student=Student(sheets=2), scan=TINY, pen=PenStyle(wobble_mm=0.0))
    for sheet in simulate(assignment, assignment.variant(None, 2), 5, settings):
        for figure in sheet.truth["figures"].values():
            for vector in figure.get("vectors", {}).values():
                for end, node in zip(vector["line_mm"], ("tail", "head"), strict=True):
                    gap = np.subtract(end, figure["nodes"][vector[node]])
                    assert np.hypot(*gap) < 6 * settings.hand.redraw_mm


@pytest.mark.parametrize("name", ["pump", "press", "engine", "shaper", "piston"])
@pytest.mark.parametrize("seed", [1, 2, 3, 4])
def test_a_mixed_class_draws_inside_its_paper(name, seed):
    assignment = load_assignment(name)
    settings = any_settings(seed, mistakes=0.0)
    settings = replace(settings, scan=replace(settings.scan, dpi=12.0, dust=0))
    variants = assignment.variants()
    sheets = simulate(assignment, variants[seed % len(variants)], seed, settings)
    seen = {figure for sheet in sheets for figure in sheet.truth["figures"]}
    assert seen == {"mechanism", "velocity_plan", "acceleration_plan"}
    for sheet in sheets:
        places = [at for figure in sheet.truth["figures"].values() for at in figure["nodes"].values()]
        assert np.all(np.min(places, axis=0) > [15.0, 5.0])
        assert np.all(np.max(places, axis=0) < [415.0, 292.0])


def test_a_bowed_sheet_is_told_by_its_grid_of_points():
    assignment = load_assignment("pump")
    scan = Scan(device="phone", dpi=30.0, tilt_deg=5.0, lens_k1=0.02, curl_mm=4.0)
    truth = simulate(assignment, assignment.variant(8), 5, Settings(scan=scan))[0].truth
    grid = np.array(truth["grid_mm_px"])
    lifted = np.column_stack([grid[:, 0], np.ones(len(grid))]) @ np.array(truth["homography"]).T
    flat = lifted[:, :2] / lifted[:, 2:]
    arm = grid[:, 1] - truth["lens"]["centre"]
    undistorted = truth["lens"]["centre"] + arm * (
        1 + truth["lens"]["k1"] * (arm**2).sum(axis=1, keepdims=True) / truth["lens"]["r"] ** 2
    )
    miss_mm = np.hypot(*(undistorted - flat).T) / truth["px_per_mm"]
    middle = np.abs(grid[:, 0, 0] - 210.0) < 50.0
    assert 3.0 < miss_mm[middle].mean() < 5.0
    assert miss_mm[~middle].min() < 0.5
