"""Overlay pictures: what was read, drawn on the upright scan; and the cleaned scan by itself.

Pixels of the output: sheet point (x, y) mm lies at (x s - 0.5, y s - 0.5) from the centre of the
top left pixel, s = width / paper's width.
"""

import itertools
import math
from collections.abc import Mapping

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.labels import Label, labels_of
from grader.outcomes import Outcome
from grader.records import Backdrop, Box, FloatArray, GreyImage, Page, Reading, Sheet
from grader.scene import (
    ARROW_WIDTH_MM,
    COLOURS,
    GHOST_COLOUR,
    GHOST_DASH_MM,
    GHOST_WIDTH_MM,
    LEAST_ARROW_MM,
    MARK_STROKES,
    NODE_COLOUR,
    XY,
    Arrow,
    Dot,
    Ghost,
    Picture,
    Scene,
    scene_of,
)
from reference.construction import Vector

ColourImage = NDArray[np.uint8]
Colour = tuple[int, int, int]

WIDTH_PX = 2000
INK_STRENGTH = 1.25
"""Pencil is shown darker than it is, so that it can be followed under the overlay,"""
DARKEST = 0.8
"""and ink lighter, so that the overlay stands out."""
PAPER_FROM = 0.90
"""Share of the local paper's brightness from which everything is shown white."""
_TONES = np.array(
    [
        255.0 - 255.0 * min(INK_STRENGTH * (1.0 - min(share / 255.0 / PAPER_FROM, 1.0)), DARKEST)
        for share in range(256)
    ],
    dtype=np.uint8,
)
"""What is shown for each share of the paper's brightness, 0..255."""
PNG_COMPRESSION = 1
_FEW_TONES = np.array([17 * round(tone / 17) for tone in range(256)], dtype=np.uint8)
"""Sixteen tones: pencil and ink look the same, and a PNG is half a JPEG."""
_FLAT_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE,
]  # fmt: skip
"""Of pictures that are white for the most part."""
OPACITY = 0.82
FRACTION_BITS = 4
JPEG_QUALITY = 78


def backdrop(page: Page, sheet: Sheet | None, *, width_px: int = WIDTH_PX) -> Backdrop:
    """The scan to draw on; `sheet` is None where the page could not be registered."""
    if sheet is None:
        scan = _clean(_turned(page, width_px))
        height, width = scan.shape
        return Backdrop(page.source, page.page, scan, (420.0, 420.0 * height / width), registered=False)
    scan = _clean(_upright(page.grey, sheet, width_px))
    return Backdrop(page.source, page.page, scan, sheet.page_mm, registered=True)


def overlay(
    behind: Backdrop,
    reading: Reading | None,
    vectors: Mapping[str, Vector],
    outcomes: Mapping[str, Outcome],
    links: Mapping[str, tuple[str, str]] | None = None,
    *,
    show_expected: bool = False,
) -> Picture:
    """A page with what was read on it.

    Arguments
    ---------
    reading : None where the page could not be read: the scan alone is shown
    vectors : the construction's vectors, which say from what node to what node each goes
    outcomes : by vector name; read vectors without an outcome are shown as not judged
    links : the joints of the mechanism's links by name; those with an outcome are shown
    show_expected : whether wrong vectors have the expected one ghosted in
    """
    scan = behind.scan
    height, width = scan.shape
    scene = Scene(behind.page_mm)
    if behind.registered and reading is not None:
        scene = scene_of(
            behind.page_mm, reading, vectors, outcomes, show_expected=show_expected, links=links or {}
        )
    plain = _grey(cv2.LUT(scan, _FEW_TONES))
    png = _encode(".png", paint(plain, scene), _FLAT_PNG)
    return Picture(behind.source, behind.page, png, _smaller(scan, plain), width, height, scene)


def _smaller(scan: GreyImage, plain: GreyImage) -> bytes:
    """A cleaned scan as a small file: pencil on white paper needs few tones, a photo's shades many."""
    jpeg = _encode(".jpg", scan, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return min(jpeg, _encode(".png", plain, _FLAT_PNG), key=len)


def _encode(kind: str, image: NDArray[np.uint8], options: list[int]) -> bytes:
    encoded, data = cv2.imencode(kind, image, options)
    if not encoded:
        raise ValueError(f"expected an image that can be stored as {kind}, got shape {image.shape}")
    return bytes(data.tobytes())


# The scan -----------------------------------------------------------------------------------------


def _turned(page: Page, width_px: int) -> GreyImage:
    """The page turned as its file asks, at most so wide."""
    grey = np.rot90(page.grey, page.turn_deg // 90)
    scale = min(1.0, width_px / grey.shape[1])
    size = (max(1, round(grey.shape[1] * scale)), max(1, round(grey.shape[0] * scale)))
    return _grey(cv2.resize(np.ascontiguousarray(grey), size, interpolation=cv2.INTER_AREA))


def _upright(grey: GreyImage, sheet: Sheet, width_px: int) -> GreyImage:
    """The sheet upright, the paper's width across `width_px`."""
    scale = width_px / sheet.page_mm[0]
    size = (width_px, max(1, round(sheet.page_mm[1] * scale)))
    shrink = max(1, int(sheet.px_per_mm / scale))
    if shrink > 1:
        # Averaging before the warp: a warp alone would skip pixels, and with them thin lines.
        smaller = (max(1, grey.shape[1] // shrink), max(1, grey.shape[0] // shrink))
        grey = _grey(cv2.resize(grey, smaller, interpolation=cv2.INTER_AREA))
    to_mm = np.array([[1 / scale, 0, 0.5 / scale], [0, 1 / scale, 0.5 / scale], [0, 0, 1]])
    # The centre of pixel i of the shrunken image lies at shrink * i + (shrink - 1) / 2 of the stored one.
    offset = (shrink - 1) / 2
    shrunk = np.array([[1 / shrink, 0, -offset / shrink], [0, 1 / shrink, -offset / shrink], [0, 0, 1]])
    output_to_stored: FloatArray = shrunk @ sheet.mm_to_px @ to_mm
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return _grey(
        cv2.warpPerspective(
            grey, output_to_stored, size, flags=flags, borderMode=cv2.BORDER_CONSTANT, borderValue=(255.0,)
        )
    )


def _clean(grey: GreyImage) -> GreyImage:
    """Shadows evened out, paper white, strokes of one strength."""
    height, width = grey.shape
    small = cv2.resize(grey, (max(1, width // 8), max(1, height // 8)), interpolation=cv2.INTER_AREA)
    paper = cv2.GaussianBlur(cv2.dilate(small, np.ones((7, 7), np.uint8)), (0, 0), 5)
    level = cv2.resize(paper, (width, height), interpolation=cv2.INTER_LINEAR)
    return _grey(cv2.LUT(cv2.divide(grey, level, scale=255.0), _TONES))


def _grey(image: NDArray[np.generic]) -> GreyImage:
    return np.asarray(image, dtype=np.uint8)


# The painter --------------------------------------------------------------------------------------


def paint(scan: GreyImage, scene: Scene) -> ColourImage:
    """The scene drawn on a scan that shows exactly its page; (h, w, 3) uint8, blue green red."""
    image: ColourImage = np.asarray(cv2.cvtColor(scan, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    px_per_mm = scan.shape[1] / scene.page_mm[0]
    brush = _Brush(image.copy(), px_per_mm)
    for ghost in scene.ghosts:
        # What waits for a person may well be right: its ghost is for a closer look.
        if ghost.verdict != "review":
            brush.ghost(ghost)
    for arrow in scene.arrows:
        brush.arrow(arrow)
    for dot in scene.dots:
        brush.dot(dot)
    blended = np.asarray(cv2.addWeighted(brush.image, OPACITY, image, 1.0 - OPACITY, 0.0), dtype=np.uint8)
    labels = _Brush(blended, px_per_mm)
    named = [arrow for arrow in scene.arrows if arrow.is_named]
    for label in labels_of(named, (0.0, 0.0, *scene.page_mm)):
        labels.label(label)
    return labels.image


def _bgr(colour: str) -> Colour:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return (blue, green, red)


class _Brush:
    """Draws in millimetres, with sub-pixel ends."""

    def __init__(self, image: ColourImage, px_per_mm: float) -> None:
        self.image, self.px_per_mm = image, px_per_mm

    def arrow(self, arrow: Arrow) -> None:
        colour = _bgr(COLOURS[arrow.verdict])
        if arrow.length < LEAST_ARROW_MM:
            return
        self.line(arrow.tail, arrow.neck(), colour, ARROW_WIDTH_MM[arrow.verdict], arrow.dash)
        if not arrow.is_link:
            self.fill(arrow.head(), colour)

    def ghost(self, ghost: Ghost) -> None:
        self.line(ghost.tail, ghost.tip, _bgr(GHOST_COLOUR), GHOST_WIDTH_MM, GHOST_DASH_MM)
        self.ring(ghost.tip, 0.9, _bgr(GHOST_COLOUR), 0.3)

    def dot(self, dot: Dot) -> None:
        colour = _bgr(COLOURS["review"] if dot.doubtful else NODE_COLOUR)
        self.ring(dot.at, 0.8, colour, 0.3)

    def label(self, label: Label) -> None:
        """The mark in a filled disc, the name beside it on a whitened ground."""
        colour = _bgr(COLOURS[label.arrow.verdict])
        self._whiten(label.box)
        if label.leader is not None:
            self.line(*label.leader, colour, 0.2, None)
        centre, radius = label.badge
        self.disc(centre, radius, colour)
        self.mark(label.arrow.verdict, centre)
        self.name(label.arrow.name, label.foot, colour)

    def mark(self, verdict: str, centre: XY) -> None:
        """✓ ✗ ~ ? → – as strokes: the drawing font has no such letters."""
        for stroke in MARK_STROKES[verdict]:
            points = [(centre[0] + 0.95 * px, centre[1] + 0.95 * py) for px, py in stroke]
            for start, end in itertools.pairwise(points):
                self.line(start, end, (255, 255, 255), 0.42, None)

    def name(self, name: str, at: XY, colour: Colour) -> None:
        """A vector's name with its indices small: v_BA, a_BA_n."""
        letter, _, rest = name.partition("_")
        size = self.px_per_mm * 0.125
        x, y = self.to_px(at)
        for text, scale, drop in ((letter, 1.0, 0.0), (rest.replace("_", ""), 0.72, 0.25)):
            thick = max(1, round(size * scale * 2.2))
            place = (round(x), round(y + drop * self.px_per_mm * 2))
            cv2.putText(
                self.image, text, place, cv2.FONT_HERSHEY_SIMPLEX, size * scale, colour, thick, cv2.LINE_AA
            )
            (wide, _high), _base = cv2.getTextSize(text, cv2.FONT_HERSHEY_SIMPLEX, size * scale, thick)
            x += wide

    def to_px(self, at: XY) -> tuple[float, float]:
        return (at[0] * self.px_per_mm - 0.5, at[1] * self.px_per_mm - 0.5)

    def _fixed(self, at: XY) -> tuple[int, int]:
        x, y = self.to_px(at)
        return (round(x * 2**FRACTION_BITS), round(y * 2**FRACTION_BITS))

    def line(
        self, start: XY, end: XY, colour: Colour, width_mm: float, dash: tuple[float, float] | None
    ) -> None:
        thick = max(1, round(width_mm * self.px_per_mm))
        for a, b in _dashes(start, end, dash):
            cv2.line(self.image, self._fixed(a), self._fixed(b), colour, thick, cv2.LINE_AA, FRACTION_BITS)

    def fill(self, points: tuple[XY, ...], colour: Colour) -> None:
        corners = np.array([self._fixed(point) for point in points], dtype=np.int32)
        cv2.fillPoly(self.image, [corners], colour, cv2.LINE_AA, FRACTION_BITS)

    def ring(self, at: XY, radius_mm: float, colour: Colour, width_mm: float) -> None:
        radius = round(radius_mm * self.px_per_mm * 2**FRACTION_BITS)
        thick = max(1, round(width_mm * self.px_per_mm))
        cv2.circle(self.image, self._fixed(at), radius, colour, thick, cv2.LINE_AA, FRACTION_BITS)

    def disc(self, at: XY, radius_mm: float, colour: Colour) -> None:
        radius = round(radius_mm * self.px_per_mm * 2**FRACTION_BITS)
        cv2.circle(self.image, self._fixed(at), radius, colour, -1, cv2.LINE_AA, FRACTION_BITS)

    def _whiten(self, box: Box) -> None:
        """Whiten the ground of a label, leaving the drawing faintly visible."""
        x0, y0 = self.to_px((box[0], box[1]))
        x1, y1 = self.to_px((box[0] + box[2], box[1] + box[3]))
        rows = slice(max(0, round(y0)), max(0, round(y1) + 1))
        columns = slice(max(0, round(x0)), max(0, round(x1) + 1))
        part = self.image[rows, columns]
        part[:] = (part * 0.2 + 255 * 0.8).astype(np.uint8)


def _dashes(start: XY, end: XY, dash: tuple[float, float] | None) -> list[tuple[XY, XY]]:
    length = math.dist(start, end)
    if dash is None or length < dash[0]:
        return [(start, end)]
    on, off = dash
    along = ((end[0] - start[0]) / length, (end[1] - start[1]) / length)
    count = max(1, round((length + off) / (on + off)))
    pitch = (length + off) / count
    pieces = []
    for index in range(count):
        first, last = index * pitch, index * pitch + pitch - off
        pieces.append(tuple((start[0] + at * along[0], start[1] + at * along[1]) for at in (first, last)))
    return [(a, b) for a, b in pieces]
