import numpy as np
import pytest

from grader.printed.layout import MARKER_CORNERS, MARKER_MM
from grader.scan.register.fitting import MarkedPoints, fit_projection
from tests.unit.scan.register.places import apply, off_mm

NOISE_MM = 0.02
GRID_MM = np.stack(np.meshgrid(np.linspace(25, 400, 6), np.linspace(50, 260, 5)), axis=-1).reshape(-1, 2)


def seen(matrix, markers, seed, noise_mm=NOISE_MM, gain_mm=0.0):
    corners = MARKER_CORNERS[list(markers)]
    outward = (corners - corners.mean(axis=1, keepdims=True)).reshape(-1, 2) / (MARKER_MM / 2)
    points = corners.reshape(-1, 2)
    scale = np.sqrt(abs(np.linalg.det(matrix[:2, :2])))
    noise = np.random.default_rng(seed).normal(0.0, noise_mm * scale, points.shape)
    return MarkedPoints(points, apply(matrix, points + gain_mm * outward) + noise, outward)


FLATBED = np.array([[11.8, 0.2, 30.0], [-0.2, 11.8, 90.0], [0.0, 0.0, 1.0]])
PHOTO = np.array([[7.8, -0.2, 382.0], [0.25, 8.2, 241.0], [-1e-4, 1e-4, 1.0]])


@pytest.mark.parametrize("matrix", [FLATBED, PHOTO])
def test_exact_points_give_the_exact_map(matrix):
    fit = fit_projection(seen(matrix, range(8), 0, noise_mm=0.0))
    assert np.allclose(apply(fit.mm_to_px, GRID_MM), apply(matrix, GRID_MM), atol=1e-4)


@pytest.mark.parametrize("markers", [(0, 7), (0, 3), (2, 5)])
def test_two_markers_on_a_flatbed_hold_the_whole_sheet(markers):
    # A perspective through two markers would be metres off at the far corner; a similarity is not.
    for seed in range(5):
        fit = fit_projection(seen(FLATBED, markers, seed))
        assert off_mm(fit.mm_to_px, FLATBED, GRID_MM) < 0.15


def test_the_standard_error_told_is_the_error_made():
    ratios = []
    for seed in range(40):
        fit = fit_projection(seen(PHOTO, (0, 3, 4, 7), seed))
        off_px = apply(fit.mm_to_px, GRID_MM) - apply(PHOTO, GRID_MM)
        off = np.hypot(*off_px.T) / 8.0 / np.sqrt(2.0)
        ratios.append(np.mean(off**2) / np.mean(fit.se_mm(GRID_MM) ** 2))
    assert 0.5 < np.mean(ratios) < 2.0


@pytest.mark.parametrize("markers", [(0, 3), (0, 7), range(8)])
def test_ink_that_spreads_moves_nothing(markers):
    fit = fit_projection(seen(FLATBED, markers, 1, gain_mm=0.12))
    assert off_mm(fit.mm_to_px, FLATBED, GRID_MM) < 0.15


def test_unequal_axes_are_followed():
    matrix = np.diag([11.86, 11.80, 1.0])
    fit = fit_projection(seen(matrix, range(8), 3))
    assert np.abs(apply(fit.mm_to_px, GRID_MM) - apply(matrix, GRID_MM)).max() < 0.6


def test_too_few_points_are_a_wrong_call():
    with pytest.raises(ValueError, match="4 points"):
        fit_projection(MarkedPoints(np.zeros((1, 2)), np.zeros((1, 2)), np.zeros((1, 2))))
