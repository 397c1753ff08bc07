"""Sheets of pencil strokes whose true lines are known, at any resolution, and noiseless ones."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.records import FloatArray, GreyImage, Page, Sheet
from reference.geometry import ComplexArray
from samples.simulation.raster import render
from samples.simulation.scanner import DrawnPaper, digitise
from samples.simulation.settings import PenStyle, Scan
from samples.simulation.sketch import DASHES, MAIN_LAYER
from samples.simulation.strokes import Pen, Rng, Stroke, dashed, straight
from samples.simulation.view import View, view_of

Segment = tuple[complex, complex]
"""Two ends, complex sheet millimetres, y up."""
SOLID, DASHED = 60, 24
_ROOM_MM = (25.0, 395.0, 20.0, 277.0)
_LENGTHS_MM = (8.0, 110.0)
_WIDTHS_MM = (0.3, 0.7)
_APART_MM, _APART_RAD = 1.5, 0.07
"""Nearly parallel strokes keep this distance: which of two is meant must be clear."""
_POLYGONS = 8
_RENDER_DPI = 300.0
_INK = 0.85


@dataclass(frozen=True, slots=True)
class LineSheet:
    """An image and where its strokes lie.

    Attributes
    ----------
    grey : (h, w) uint8, 255 = paper
    view : sheet millimetres to its pixels
    true : the strokes, solid ones first; `solid` says how many
    """

    grey: GreyImage
    view: View
    true: Sequence[Segment]
    solid: int

    @property
    def page(self) -> Page:
        """As intake gives it."""
        return Page("generated", 1, self.grey)

    @property
    def sheet(self) -> Sheet:
        """Registered without error: what is measured is the lines alone."""
        return Sheet(
            mm_to_px=self.view.homography, page_mm=(420.0, 297.0), method="markers",
            px_per_mm=self.view.px_per_mm, rotation_deg=0.0, residual_mm=0.0, scale_se=0.0,
            drawable_mm=(10.0, 10.0, 400.0, 277.0),
        )  # fmt: skip


def pencil_sheet(dpi: float, seed: int = 1) -> LineSheet:
    """Random pencil strokes, solid and dashed, scanned askew with noise: the same at each resolution."""
    rng = np.random.default_rng([seed, 1])
    true = _scattered(rng, SOLID + DASHED)
    strokes: list[Stroke] = []
    for number, (p, q) in enumerate(true):
        dark = rng.uniform(0.45, 0.8)
        stroke = straight(rng, Pen(MAIN_LAYER, rng.uniform(*_WIDTHS_MM), dark, 0.12, 0.0), p, q)
        strokes.extend([stroke] if number < SOLID else dashed(rng, stroke, DASHES))
    scan = Scan(dpi=dpi, skew_deg=0.6, stretch=0.0)
    scanner = np.random.default_rng([seed, 2])
    view = view_of(scan, scanner)
    pens = PenStyle(grain=0.35, smudges=1)
    grey = digitise(DrawnPaper(strokes, pens), scan, view, scanner)
    return LineSheet(grey, view, true, SOLID)


def _scattered(rng: Rng, count: int) -> list[Segment]:
    """Segments that may cross, but are not nearly parallel neighbours."""
    kept: list[Segment] = []
    left, right, low, high = _ROOM_MM
    while len(kept) < count:
        middle = complex(rng.uniform(left, right), -rng.uniform(low, high))
        half = 0.5 * rng.uniform(*_LENGTHS_MM) * np.exp(1j * rng.uniform(0.0, np.pi))
        one = complex(middle - half), complex(middle + half)
        inside = all(left < end.real < right and low < -end.imag < high for end in one)
        if inside and not any(_close(one, other) for other in kept):
            kept.append(one)
    return kept


def _close(one: Segment, other: Segment) -> bool:
    """Whether two segments run side by side, or one goes on where the other ends."""
    span, turn = one[1] - one[0], abs(np.sin(np.angle((one[1] - one[0]) / (other[1] - other[0]))))
    if turn > _APART_RAD:
        return False
    local = (np.array(other) - one[0]) / (span / abs(span))
    beside = np.abs(local.imag).min() < _APART_MM or local.imag[0] * local.imag[1] < 0
    return bool(beside and local.real.max() > -8.0 and local.real.min() < abs(span) + 8.0)


def noiseless_sheet(seed: int = 1) -> tuple[LineSheet, list[list[int]]]:
    """Polygons in ideal anti-aliased strokes, and for each vertex the two strokes that meet in it."""
    rng = np.random.default_rng([seed, 3])
    true: list[Segment] = []
    joints: list[list[int]] = []
    for number in range(_POLYGONS):
        centre = complex(70 + 93 * (number % 4), -85 - 125 * (number // 4))
        count = int(rng.integers(3, 6))
        angles = 2 * np.pi * (np.arange(count) + rng.uniform(-0.25, 0.25, count)) / count
        corners = centre + rng.uniform(22.0, 38.0, count) * np.exp(1j * (angles + rng.uniform(0, 6)))
        first = len(true)
        true += [(complex(p), complex(q)) for p, q in zip(corners, np.roll(corners, -1), strict=True)]
        joints += [[first + (k - 1) % count, first + k] for k in range(count)]
    strokes = [
        straight(rng, Pen(MAIN_LAYER, rng.uniform(*_WIDTHS_MM), _INK, 0.0, 0.0), p, q) for p, q in true
    ]
    scan = Scan(dpi=_RENDER_DPI, skew_deg=0.0, shift_mm=0.0, stretch=0.0)
    view = view_of(scan, rng)
    cover = render(strokes, view.to_px, view.size)
    return LineSheet(np.asarray(255 - cover, dtype=np.uint8), view, true, len(true)), joints


def to_mm(view: View, px: FloatArray) -> ComplexArray:
    """Pixel segments (n, 2, 2) to complex sheet millimetres (n, 2), y up."""
    flat = view.to_mm(px.reshape(-1, 2))
    return np.asarray((flat[:, 0] - 1j * flat[:, 1]).reshape(-1, 2))
