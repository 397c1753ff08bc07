"""Points on a sheet and in its picture, compared with a known map."""

import numpy as np


def apply(matrix, points):
    """(n, 2) points through a homography, by nothing that the program uses."""
    points = np.asarray(points, dtype=float)
    lifted = np.c_[points, np.ones(len(points))] @ np.asarray(matrix).T
    return lifted[:, :2] / lifted[:, 2:]


def off_mm(mm_to_px, truth, points):
    """Largest distance on the sheet between where points (n, 2) are and where a map says."""
    return np.hypot(*(apply(np.linalg.inv(truth), apply(mm_to_px, points)) - points).T).max()
