"""Pictures of signs as a scan of a drawing shows them: pens, hands, remnants of strokes, noise."""

from dataclasses import dataclass

import cv2
import numpy as np

from grader.scan.handwriting.model import normalised
from tests.training.letters.glyphs import Glyph

_MOST_PX = 46.0
"""Longer side of a sign in a scan: 4 mm at 300 dpi."""
_SMALL = {".": 4.5, "'": 12.0, "-": 14.0, "=": 18.0, ":": 20.0}
"""Most pixels of signs that are small beside letters."""


@dataclass(frozen=True, slots=True)
class Trouble:
    """The difficulty of a scan.

    Attributes
    ----------
    least_px : longer side of the smallest signs
    wobble : wobble of the hand, as a share of the sign's size
    touched : probability that strokes touched the sign or were taken out of it
    grain : largest share of ink taken away by the paper's grain
    blur_px, noise : largest value of each
    copied : probability of hard compression or of one bit
    """

    least_px: float
    wobble: float
    touched: float
    grain: float
    blur_px: float
    noise: float
    copied: float


CLEAR = Trouble(18.0, 0.02, 0.0, 0.0, 0.7, 6.0, 0.2)
"""Letters of 2 mm and more clear of the lines, scanned at 300 dpi."""
HARD = Trouble(10.0, 0.035, 0.22, 0.7, 1.1, 12.0, 0.42)
"""Small ones, at 150 dpi, faint, touched by strokes, photocopied."""


def scanned(
    glyph: Glyph, rng: np.random.Generator, trouble: Trouble = HARD
) -> tuple[np.ndarray, tuple[int, int]] | None:
    """((28, 28) picture, (width, height) of its crop in pixels), None where no ink was left."""
    picture = _written(glyph, rng, trouble.wobble)
    most = _SMALL.get(glyph.sign, _MOST_PX)
    side = np.exp(rng.uniform(np.log(min(trouble.least_px, most / 2.0)), np.log(most)))
    ink = picture > 60
    rows, columns = np.flatnonzero(ink.any(axis=1)), np.flatnonzero(ink.any(axis=0))
    if len(rows) == 0:
        return None
    scale = min(1.0, side / max(np.ptp(rows) + 1, np.ptp(columns) + 1))
    small = cv2.resize(picture, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    small = cv2.copyMakeBorder(small, 5, 5, 5, 5, cv2.BORDER_CONSTANT).astype(np.float32)
    if glyph.sign not in _SMALL and rng.random() < trouble.touched:
        small = _beside_strokes(small, side, rng)
    return as_segmented(on_glass(small, rng, trouble))


def _written(glyph: Glyph, rng: np.random.Generator, most_wobble: float) -> np.ndarray:
    """Another hand's version of a sign: with another pen, slant, proportions and wobble."""
    picture = glyph.picture
    if glyph.bones is not None and rng.random() < 0.7:
        pen = round(rng.uniform(3.0, 13.0))
        picture = cv2.dilate(glyph.bones, cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (pen, pen)))
    high, wide = picture.shape
    turn = np.radians(rng.normal(0.0, 7.0))
    slant = rng.uniform(-0.1, 0.35) if rng.random() < 0.7 else 0.0
    stretch = np.exp(rng.uniform(-0.25, 0.25))
    cosine, sine = np.cos(turn), np.sin(turn)
    shape = np.array([[cosine, -sine], [sine, cosine]]) @ np.array([[1.0, -slant], [0.0, 1.0]])
    shape = np.linalg.inv(shape @ np.diag([stretch, 1.0]))
    side = int(1.35 * max(high, wide * stretch)) + 8
    y, x = np.mgrid[0:side, 0:side].astype(np.float32) - side / 2.0
    wobble = rng.normal(0.0, rng.uniform(0.0, most_wobble), (2, 5, 5)) * max(high, wide)
    dx, dy = (cv2.resize(plane, (side, side), interpolation=cv2.INTER_CUBIC) for plane in wobble)
    u = shape[0, 0] * x + shape[0, 1] * y + wide / 2.0 + dx
    v = shape[1, 0] * x + shape[1, 1] * y + high / 2.0 + dy
    return cv2.remap(picture, u.astype(np.float32), v.astype(np.float32), cv2.INTER_LINEAR)


def _beside_strokes(picture: np.ndarray, side: float, rng: np.random.Generator) -> np.ndarray:
    """The sign with pieces of strokes that touch it, and gaps where a stroke through it was removed."""
    high, wide = picture.shape
    pen = max(1, round(rng.uniform(0.06, 0.16) * side))
    if rng.random() < 0.6:
        angle = rng.uniform(0.0, 2.0 * np.pi)
        middle = np.array([wide, high]) / 2.0
        edge = middle + 0.52 * side * np.array([np.cos(angle), np.sin(angle)])
        along = rng.uniform(0.0, 2.0 * np.pi)
        far = edge + rng.uniform(0.1, 0.3) * side * np.array([np.cos(along), np.sin(along)])
        cv2.line(picture, _px(edge), _px(far), 255.0, pen, cv2.LINE_AA)
    else:
        ends = rng.uniform(0.0, 1.0, (2, 2)) * [wide, high]
        along = (ends[1] - ends[0]) / max(np.hypot(*(ends[1] - ends[0])), 1.0)
        cv2.line(picture, _px(ends[0] - 99.0 * along), _px(ends[1] + 99.0 * along), 0.0, pen, cv2.LINE_AA)
    return picture


def _px(point: np.ndarray) -> tuple[int, int]:
    return round(float(point[0])), round(float(point[1]))


def on_glass(picture: np.ndarray, rng: np.random.Generator, trouble: Trouble = HARD) -> np.ndarray:
    """The contrast as scanned: blurred, paler, noisy, sometimes compressed or of one bit."""
    sigma = rng.uniform(0.3, trouble.blur_px)
    soft = cv2.GaussianBlur(picture, (0, 0), sigma) * rng.uniform(0.35, 1.0)
    if rng.random() < 0.5 * (trouble.grain > 0.0):
        # Graphite catches on the paper's grain.
        grain = cv2.GaussianBlur(rng.random(soft.shape), (0, 0), rng.uniform(0.5, 1.5))
        soft *= 1.0 - rng.uniform(0.0, trouble.grain) * np.clip(
            (grain - grain.mean()) / grain.std() / 2.0 + 0.5, 0.0, 1.0
        )
    soft += rng.normal(0.0, rng.uniform(1.0, trouble.noise), soft.shape)
    grey = np.clip(soft, 0.0, 255.0).astype(np.uint8)
    lot = rng.random() / trouble.copied
    if lot < 0.7:
        coded = cv2.imencode(".jpg", 255 - grey, [cv2.IMWRITE_JPEG_QUALITY, int(rng.uniform(45, 90))])[1]
        grey = 255 - cv2.imdecode(coded, cv2.IMREAD_GRAYSCALE)
    elif lot < 1.0:
        grey = np.where(grey > 0.45 * grey.max(), 255, 0).astype(np.uint8)
    return grey


def as_segmented(contrast: np.ndarray) -> tuple[np.ndarray, tuple[int, int]] | None:
    """The picture cut out around its ink, as at run time."""
    mask = (contrast > 0.5 * cv2.GaussianBlur(contrast, (3, 3), 0).max()).astype(np.uint8)
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    if len(rows) == 0:
        return None
    near = cv2.dilate(mask, np.ones((3, 3), np.uint8))
    cut = (contrast * near)[rows[0] : rows[-1] + 1, columns[0] : columns[-1] + 1]
    return normalised(cut), (cut.shape[1], cut.shape[0])
