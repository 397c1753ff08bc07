"""The bend that a camera's lens gives to straight lines, found from a printed sheet's markers.

Model (Brown 1966, first radial term): a point that a lens without bend would put at u is stored at
c + (u - c)(1 + bend |u - c|^2 / r^2), c the image's middle and r half its diagonal.
"""

from dataclasses import replace

import cv2
import numpy as np
from scipy.optimize import minimize_scalar

from grader.records import FloatArray, GreyImage, Page, Sheet
from grader.sheet.projection import Marked, Projection, fit_projection

MAX_BEND = 0.06
"""Phones bend by 0.02 at most, wide-angle lenses more."""
_WORTH_MM = 0.04
"""Misfit below this is no lens: corners, paper and printer make it too."""
_WORTH_SHARE = 0.7
"""The bend is believed where the misfit falls to this share of what it was, or lower."""
_LEAST_POINTS = 16
"""Four markers: a bend takes the part of a slanted view where there are fewer."""
_ROUNDS = 12


def straight(points_px: FloatArray, bend: float, shape: tuple[int, int]) -> FloatArray:
    """Where points (n, 2) would be stored without the bend; the inverse of the model, by iteration."""
    centre, radius = _middle(shape)
    stored = (points_px - centre) / radius
    found = stored
    for _ in range(_ROUNDS):
        found = stored / (1.0 + bend * (found**2).sum(axis=1, keepdims=True))
    return np.asarray(centre + found * radius)


def straightened(grey: GreyImage, bend: float) -> GreyImage:
    """The picture as a lens without bend would have stored it."""
    (cx, cy), radius = _middle(grey.shape)
    camera = np.array([[radius, 0.0, cx], [0.0, radius, cy], [0.0, 0.0, 1.0]])
    size = (grey.shape[1], grey.shape[0])
    x, y = cv2.initUndistortRectifyMap(
        camera, np.array([bend, 0.0, 0.0, 0.0]), np.eye(3), camera, size, cv2.CV_16SC2
    )
    return np.asarray(
        cv2.remap(grey, x, y, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), dtype=np.uint8
    )


def find_bend(marked: Marked, plain: Projection, shape: tuple[int, int]) -> tuple[float, Projection]:
    """The bend that best explains marked points, and the map of the straightened picture.

    Arguments: `plain` is the map without a bend, given back with 0 where a bend explains little.
    """
    if plain.rms_mm < _WORTH_MM or len(marked) < _LEAST_POINTS:
        return 0.0, plain

    def misfit(bend: float) -> float:
        return fit_projection(replace(marked, px=straight(marked.px, bend, shape))).rms_mm

    found = minimize_scalar(misfit, bounds=(-MAX_BEND, MAX_BEND), method="bounded", options={"xatol": 1e-5})
    if found.fun > _WORTH_SHARE * plain.rms_mm:
        return 0.0, plain
    bend = float(found.x)
    return bend, fit_projection(replace(marked, px=straight(marked.px, bend, shape)))


def straighten(page: Page, sheet: Sheet) -> tuple[Page, Sheet]:
    """The page as a lens without bend would have stored it, and its sheet; the same where none was found.

    To be done before strokes are looked for: a bent stroke is not straight, and its place is off by
    half a millimetre on usual phones. `sheet.lens.stored` keeps the map of the stored picture.
    """
    if sheet.lens is None or sheet.mm_to_px is sheet.lens.straight:
        return page, sheet
    lens = sheet.lens
    grey = straightened(page.grey, lens.bend)
    straight = replace(sheet, mm_to_px=lens.straight, residual_mm=lens.residual_mm, scale_se=lens.scale_se)
    return replace(page, grey=grey), straight


def _middle(shape: tuple[int, ...]) -> tuple[FloatArray, float]:
    centre = np.array([(shape[1] - 1) / 2.0, (shape[0] - 1) / 2.0])
    return centre, float(np.hypot(shape[1] / 2.0, shape[0] / 2.0))
