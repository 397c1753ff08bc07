"""The dictionary of printed markers: 4 x 4 cells in a black border, so few that a phone reads them."""

from functools import cache

import cv2
import numpy as np
from numpy.typing import NDArray

CELLS = 6
"""Cells along a marker's side, its black border included."""


@cache
def dictionary() -> cv2.aruco.Dictionary:
    """OpenCV's DICT_4X4_250 (Garrido-Jurado et al., Pattern Recognition 47, 2014)."""
    return cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_4X4_250)


def cells(marker_id: int) -> NDArray[np.bool_]:
    """(6, 6), True where a marker's cell is white, upright, rows downwards."""
    image = cv2.aruco.generateImageMarker(dictionary(), marker_id, CELLS, borderBits=1)
    return np.asarray(image > 127)
