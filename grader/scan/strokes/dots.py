"""Black and white scans whose lines are rows of dots: faint copies and dithered tones, joined to lines again."""

import cv2
import numpy as np

from grader.records import GreyImage
from grader.scan.pixels import averaged
from grader.scan.strokes.seeds import PX_PER_MM, working_scale

_SAMPLED = 37
"""Every such row tells whether a page has tones."""
_LONELY = 3
"""Of the nine pixels around a dot: so many are ink at most. A line that is drawn through has more."""
_DOTTED = 0.17
"""Share of ink in such dots: copies have up to 0.11, a faint one 0.25, a dithered page 0.35 and more."""
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


def is_dotted(grey: GreyImage) -> bool:
    """Whether a page is black and white, and much of its ink single dots."""
    rows = grey[::_SAMPLED]
    if np.any((rows > 0) & (rows < 255)):
        return False
    ink = np.asarray(cv2.compare(grey, 128, cv2.CMP_LT)) & 1
    around = cv2.boxFilter(ink, cv2.CV_8U, (3, 3), normalize=False)
    lonely = cv2.countNonZero(cv2.multiply(ink, np.asarray(around <= _LONELY).astype(np.uint8)))
    return lonely > _DOTTED * max(cv2.countNonZero(ink), 1)


def joined_dots(grey: GreyImage, px_per_mm: float) -> GreyImage:
    """A dotted page in tones, with lines where rows of dots lie; any other page as it is given."""
    if not is_dotted(grey):
        return grey
    dark = cv2.bitwise_not(cv2.GaussianBlur(grey, (0, 0), _SOFT_MM * px_per_mm))
    side = max(1, round(1.0 / working_scale(px_per_mm)))
    lines = _along_lines(averaged(cv2.bitwise_not(grey), side))
    lines = cv2.resize(lines, None, fx=side, fy=side, interpolation=cv2.INTER_LINEAR)
    part = dark[: lines.shape[0], : lines.shape[1]]
    part[:] = cv2.max(part, lines)
    return np.asarray(cv2.bitwise_not(dark), dtype=np.uint8)


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
