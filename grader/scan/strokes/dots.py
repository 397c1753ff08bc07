"""Black and white scans whose lines are rows of dots (faint copies, dithered tones), joined to lines."""

import cv2
import numpy as np

from grader.records import GreyImage
from grader.scan.pixels import averaged, is_dotted
from grader.scan.strokes.seeds import PX_PER_MM, working_scale

_SOFT_MM = 0.13
"""Dots of a line are this near to each other."""
_LINE_MM = 4.2
"""Long enough that a row of dots differs from dots at random, and a vector of 5 mm is still found."""
_DIRECTIONS = 24
"""A line as wide as its softened dots stays on one of them over its whole length."""
_AROUND = 2.0
"""Of the mean over all directions: dots spread evenly, as in a dithered area, are no line."""
_GAIN = 2.5
"""A line a third of which is left becomes as dark as one drawn through."""


def joined_dots(grey: GreyImage, px_per_mm: float) -> GreyImage:
    """A dotted page in tones, with lines where rows of dots lie; any other page as it is given."""
    if not is_dotted(grey):
        return grey
    soft = np.asarray(cv2.GaussianBlur(grey, (0, 0), _SOFT_MM * px_per_mm), dtype=np.uint8)
    side = max(1, round(1.0 / working_scale(px_per_mm)))
    lines = cv2.resize(_along_lines(averaged(~grey, side)), None, fx=side, fy=side)
    part = soft[: lines.shape[0], : lines.shape[1]]
    part[:] = np.minimum(part, ~np.asarray(lines, dtype=np.uint8))
    return soft


def _along_lines(dark: GreyImage) -> GreyImage:
    """How much darker the darkest line through each place is than its surroundings.

    Arguments: `dark` is 0 (paper) to 255 (ink) at the working resolution.
    """
    soft = cv2.GaussianBlur(dark, (0, 0), 1.0)
    half = round(0.5 * _LINE_MM * PX_PER_MM)
    darkest, total = np.zeros_like(dark), np.zeros(dark.shape, dtype=np.float32)
    for angle in np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS):
        line = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
        reach = np.rint(16.0 * half * np.array([np.cos(angle), np.sin(angle)])).astype(int)
        start, end = (16 * half - reach).tolist(), (16 * half + reach).tolist()
        cv2.line(line, start, end, 1.0, 1, cv2.LINE_AA, 4)
        mean = cv2.filter2D(soft, cv2.CV_8U, line / line.sum())
        darkest = np.asarray(cv2.max(darkest, mean), dtype=np.uint8)
        cv2.accumulate(mean, total)
    own = darkest.astype(np.float32) - np.float32(_AROUND / _DIRECTIONS) * total
    return np.asarray(np.clip(np.float32(_GAIN) * own, 0.0, 255.0), dtype=np.uint8)
