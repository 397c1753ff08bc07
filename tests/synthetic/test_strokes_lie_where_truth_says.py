"""The renderer agrees with the truth it writes: the ink's centre of mass across a stroke."""

import numpy as np
import pytest

from reference.authored.assignment import load_assignment
from samples.simulation import CAREFUL, PenStyle, Scan, Settings, simulate
from samples.simulation.raster import render
from samples.simulation.strokes import PenWidth, straight
from samples.simulation.view import PaperView

pytestmark = pytest.mark.slow
RENDER_ERROR_MM = 0.01  # error of a centre of mass at 150 dpi from sampling by whole pixels
SCAN_ERROR_MM = 0.02


def along_and_across(image, p_px, q_px):
    """Each pixel's position along the line p q, as a share of its length, and offset from it, in pixels."""
    length = np.hypot(*(q_px - p_px))
    along = (q_px - p_px) / length
    rows, columns = np.indices(image.shape)
    x, y = columns - p_px[0], rows - p_px[1]
    return (x * along[0] + y * along[1]) / length, y * along[0] - x * along[1]


def centre_line_error_mm(image, p_px, q_px, px_per_mm):
    """Largest offset of the ink's centre line from the line p q, near its ends, millimetres."""
    share, across = along_and_across(image, p_px, q_px)
    near = (share > 0.1) & (share < 0.9) & (np.abs(across) < 1.2 * px_per_mm)
    fit = np.polyfit(share[near], across[near], 1, w=np.sqrt(image[near].astype(float)))
    return np.abs(np.polyval(fit, [0.1, 0.9])).max() / px_per_mm


@pytest.mark.parametrize("dpi", [150.0, 300.0])
@pytest.mark.parametrize("angle_deg", [0.0, 0.7, 31.0, 45.0, 88.0, 90.0, 133.0])
def test_a_ruled_stroke_lies_on_its_line(dpi, angle_deg):
    pitch = dpi / 25.4
    p = 21.37 - 20.11j
    q = p + 17.0 * np.exp(1j * np.radians(-angle_deg))
    if q.real < 2:
        q, p = q + 20, p + 20
    stroke = straight(np.random.default_rng(1), PenWidth("main", 0.43, 0.8, 0.0, 0.0), p, q)
    image = render([stroke], lambda xy: xy * pitch - 0.5, (int(45 * pitch), int(45 * pitch)))
    ends = [np.array([z.real, -z.imag]) * pitch - 0.5 for z in (p, q)]
    assert centre_line_error_mm(image, *ends, pitch) < RENDER_ERROR_MM


@pytest.mark.parametrize(
    "scan",
    [
        Scan(dpi=150.0, skew_deg=2.0, noise=0.0, tint_grain=0.0, dust=0, shading=0.0, quarter_turns=1),
        Scan(device="phone", dpi=120.0, mode="colour", tilt_deg=8.0, lens_k1=0.03, noise=0.0, dust=0),
    ],
    ids=["a skewed sheet on its side", "a phone with a lens"],
)
def test_a_scanned_vector_lies_where_truth_says(scan):
    pen = PenStyle(
        wobble_mm=0.0, pressure=0.0, grain=0.0, smudges=0, erased=0.0, construction_lines=0.0, arrow="none"
    )
    assignment = load_assignment("pump")
    sheet = simulate(assignment, assignment.variant(12), 3, Settings(hand=CAREFUL, pen=pen, scan=scan))[0]
    image = sheet.image if sheet.image.ndim == 2 else sheet.image[..., 1]
    line = np.array(sheet.truth["figures"]["velocity_plan"]["vectors"]["v_BA"]["line_mm"])
    view = view_told_by(sheet.truth)
    p, q = view.to_px(line)
    low = np.floor(np.minimum(p, q)).astype(int) - 20
    high = np.ceil(np.maximum(p, q)).astype(int) + 20
    window = 255 - image[low[1] : high[1], low[0] : high[0]]
    window = np.where(window > 60, window, 0)
    # The band is narrow, to exclude letters and neighbours beside the stroke.
    error = narrow_error_mm(window, p - low, q - low, sheet.truth["px_per_mm"])
    assert error < SCAN_ERROR_MM


def view_told_by(truth):
    width, height = truth["image_size"]
    k1 = truth["lens"]["k1"] if truth["lens"] else 0.0
    return PaperView(np.array(truth["homography"]), (height, width), k1, 0, (0.0, 0.0, 420.0, 297.0))


def narrow_error_mm(image, p_px, q_px, px_per_mm):
    """Offset of the ink's centre of mass from the middle of the line p q."""
    share, across = along_and_across(image, p_px, q_px)
    near = (share > 0.3) & (share < 0.7) & (np.abs(across) < 0.45 * px_per_mm)
    return abs(np.average(across[near], weights=image[near].astype(float) + 1e-9)) / px_per_mm
