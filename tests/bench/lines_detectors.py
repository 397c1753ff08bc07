"""Ways to find straight strokes in a scan: ours and what libraries offer, on one footing.

Each takes a `LineSheet` and gives segments, complex sheet millimetres (n, 2), y up. Parameters of the
libraries' detectors are in millimetres, so that they mean the same at each resolution; Canny's
thresholds and the smoothing are the usual ones.
"""

from collections.abc import Callable, Mapping

import cv2
import numpy as np
from skimage.feature import canny
from skimage.transform import probabilistic_hough_line

from grader.ink import find_ink
from grader.records import FloatArray, GreyImage, Unread
from reference.geometry import ComplexArray
from tests.bench.lines_sheets import LineSheet, to_mm

LEAST_MM, GAP_MM, VOTES_MM = 4.0, 2.5, 4.0
_CANNY = (50, 150)
_ANGLES = 1440
"""Steps of direction over half a turn."""

Detector = Callable[[LineSheet], ComplexArray]
OURS = "planmark"


def ours(one: LineSheet) -> ComplexArray:
    """The ink stage as it is: with circles, arrowheads, marks and the ink map."""
    ink = find_ink(one.page, one.sheet)
    ends = np.zeros((0, 2, 2)) if isinstance(ink, Unread) else ink.strokes.ends
    return np.asarray(ends[..., 0] - 1j * ends[..., 1])


def lsd(one: LineSheet) -> ComplexArray:
    """Line segment detector (von Gioi et al. 2010) of OpenCV."""
    return to_mm(one.view, _lsd(one.grey))


def lsd_half(one: LineSheet) -> ComplexArray:
    """The same on the picture at half resolution."""
    height, width = one.grey.shape
    small = np.asarray(cv2.resize(one.grey, (width // 2, height // 2), interpolation=cv2.INTER_AREA))
    scale = np.array([width / (width // 2), height / (height // 2)])
    return to_mm(one.view, (_lsd(small.astype(np.uint8)) + 0.5) * scale - 0.5)


def _lsd(grey: GreyImage) -> FloatArray:
    found = cv2.createLineSegmentDetector().detect(grey)[0]
    return np.zeros((0, 2, 2)) if found is None else found.reshape(-1, 2, 2).astype(np.float64)


def hough(one: LineSheet) -> ComplexArray:
    """Progressive probabilistic Hough transform on Canny's edges, OpenCV."""
    unit = one.view.px_per_mm
    edges = cv2.Canny(cv2.GaussianBlur(one.grey, (0, 0), 1.0), *_CANNY)
    found = cv2.HoughLinesP(
        edges, 1.0, np.pi / _ANGLES, round(VOTES_MM * unit),
        minLineLength=LEAST_MM * unit, maxLineGap=GAP_MM * unit,
    )  # fmt: skip
    segments = np.zeros((0, 2, 2)) if found is None else found.reshape(-1, 2, 2).astype(np.float64)
    return to_mm(one.view, segments)


def hough_skimage(one: LineSheet) -> ComplexArray:
    """Probabilistic Hough transform on Canny's edges, scikit-image."""
    unit = one.view.px_per_mm
    angles = np.linspace(-np.pi / 2, np.pi / 2, _ANGLES // 4, endpoint=False)
    low, high = (level / 4 for level in _CANNY)
    edges = canny(one.grey, sigma=1.0, low_threshold=low, high_threshold=high)  # type: ignore[no-untyped-call]
    found = probabilistic_hough_line(  # type: ignore[no-untyped-call]
        edges,
        threshold=round(VOTES_MM * unit), line_length=round(LEAST_MM * unit), line_gap=round(GAP_MM * unit),
        theta=angles, rng=1,
    )  # fmt: skip
    return to_mm(one.view, np.array(found, dtype=np.float64).reshape(-1, 2, 2))


DETECTORS: Mapping[str, Detector] = {
    OURS: ours,
    "LSD": lsd,
    "LSD, half resolution": lsd_half,
    "HoughLinesP on Canny": hough,
    "scikit-image Hough": hough_skimage,
}
