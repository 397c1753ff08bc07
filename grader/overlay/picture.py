"""Overlay pictures: the reading drawn on the upright scan; and parts of a page as scanned."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files

import cv2
import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont

from grader.outcomes import Outcome
from grader.overlay.scene import XY, Picture, Scene, between, layers_of, scene_of
from grader.records import Backdrop, Box, GreyImage, Page, Reading, Sheet
from grader.scan.pixels import averaged, cut_out, reduction
from reference.construction.graph import Vector
from reference.drawing.canvas import Area, Curve, Label, Ring, Shape, Stroke, set_pieces

ColourImage = NDArray[np.uint8]
Colour = tuple[int, int, int]

PNG_COMPRESSION = 1
_FEW_TONES = np.array([17 * round(tone / 17) for tone in range(256)], dtype=np.uint8)
"""Sixteen tones: pencil and ink look the same, and a PNG is half a JPEG."""
_PNG_FILTER, _NO_FILTER = 19, 8
"""OpenCV's IMWRITE_PNG_FILTER and its IMWRITE_PNG_FILTER_NONE; versions before 4.12 ignore them."""
_FLAT_PNG = [
    cv2.IMWRITE_PNG_COMPRESSION, PNG_COMPRESSION, cv2.IMWRITE_PNG_STRATEGY, cv2.IMWRITE_PNG_STRATEGY_RLE,
    _PNG_FILTER, _NO_FILTER,
]  # fmt: skip
"""Options for mostly white pictures: choosing filters row by row takes four times as long."""
FRACTION_BITS = 4
JPEG_QUALITY = 78
CUT_QUALITY = 90
"""JPEG quality of close-ups: blocks of a coarser file show beside thin lines."""


def overlay(
    behind: Backdrop,
    reading: Reading | None,
    vectors: Mapping[str, Vector],
    outcomes: Mapping[str, Outcome],
    links: Mapping[str, tuple[str, str]] | None = None,
    *,
    show_expected: bool = False,
) -> Picture:
    """Return a page with the reading drawn on it.

    Arguments
    ---------
    reading : None if the page could not be read: the scan alone is shown
    vectors : the construction's vectors, with the nodes that each connects
    outcomes : by vector name; read vectors without an outcome are shown as not judged
    links : the joints of the mechanism's links by name; those with an outcome are shown
    show_expected : whether wrong vectors have the expected one ghosted in
    """
    scan = behind.scan
    scene = Scene(behind.page_mm)
    if behind.registered and reading is not None:
        scene = scene_of(
            behind.page_mm, reading, vectors, outcomes, show_expected=show_expected, links=links or {}
        )
    scene = replace(scene, ink=behind.ink)
    plain = np.asarray(cv2.LUT(scan, _FEW_TONES), dtype=np.uint8)
    png = encode(".png", paint(plain, scene), _FLAT_PNG)
    return Picture(behind.source, behind.page, png, _smaller(scan, plain), scene)


def _smaller(scan: GreyImage, plain: GreyImage) -> bytes:
    """Return a cleaned scan as a small file: pencil on white paper needs few tones, a photo's shades many."""
    jpeg = encode(".jpg", scan, [cv2.IMWRITE_JPEG_QUALITY, JPEG_QUALITY])
    return min(jpeg, encode(".png", plain, _FLAT_PNG), key=len)


def encode(kind: str, image: NDArray[np.uint8], options: list[int]) -> bytes:
    """Encode a picture as a file of this kind, `.png` or `.jpg`, without any metadata."""
    encoded, data = cv2.imencode(kind, image, options)
    if not encoded:
        raise ValueError(f"expected an image that can be stored as {kind}, got shape {image.shape}")
    return bytes(data.tobytes())


# The scan -----------------------------------------------------------------------------------------


def cut(page: Page, sheet: Sheet | None, box: Box, px_per_mm: float) -> bytes:
    """Return a part of a page as scanned, as JPEG.

    Arguments
    ---------
    sheet : of a page in the form that `straighten` gives; None if it was not registered
    box : in sheet millimetres; in stored pixels without a sheet
    px_per_mm : wanted resolution of the picture; pixels per stored pixel without a sheet
    """
    to_px, stored = (np.eye(3), 1.0) if sheet is None else (sheet.mm_to_px, sheet.px_per_mm)
    scale = min(px_per_mm, 2.0 * stored)
    less = max(1, int(stored / scale))
    part = cut_out(averaged(page.grey, less), reduction(1.0 / less) @ to_px, box, scale, outside=255)
    if not part.size:  # the box lies outside the page
        part = np.full((1, 1), 255, np.uint8)
    return encode(".jpg", part, [cv2.IMWRITE_JPEG_QUALITY, CUT_QUALITY])


# The painter --------------------------------------------------------------------------------------


def paint(scan: GreyImage, scene: Scene) -> ColourImage:
    """Paint the scene on a scan that shows exactly its page; (h, w, 3) uint8, blue green red."""
    image: ColourImage = np.asarray(cv2.cvtColor(scan, cv2.COLOR_GRAY2BGR), dtype=np.uint8)
    px_per_mm = scan.shape[1] / scene.page_mm[0]
    # A vector under review may well be right: its ghost appears only in close-ups.
    ghosts = tuple(ghost for ghost in scene.ghosts if ghost.verdict != "review")
    named = [arrow for arrow in scene.arrows if arrow.is_named]
    for layer in layers_of(replace(scene, ghosts=ghosts), (0.0, 0.0, *scene.page_mm), named, {}):
        over = image if layer.opacity == 1.0 else image.copy()
        for shape in layer.shapes:
            _paint_shape(over, shape, px_per_mm)
        if over is not image:
            cv2.addWeighted(over, layer.opacity, image, 1.0 - layer.opacity, 0.0, dst=image)
    return image


def _paint_shape(image: ColourImage, shape: Shape, px_per_mm: float) -> None:
    """Paint one shape with sub-pixel ends, in place."""
    smooth = (cv2.LINE_AA, FRACTION_BITS)

    def thick(width_mm: float) -> int:
        return max(1, round(width_mm * px_per_mm))

    match shape:
        case Stroke(start=start, end=end, width=width, colour=colour, dash=dash):
            for piece in _dashes(start, end, dash):
                first, last = _fixed_point(piece, px_per_mm).tolist()
                cv2.line(image, first, last, _bgr(colour), thick(width), *smooth)
        case Ring(centre=centre, radius=radius, width=width, colour=colour, fill=fill):
            (at,), reach = _fixed_point((centre,), px_per_mm).tolist(), radius * px_per_mm * 2**FRACTION_BITS
            if fill != "none":
                cv2.circle(image, at, round(reach), _bgr(fill), cv2.FILLED, *smooth)
            if width > 0.0:
                cv2.circle(image, at, round(reach), _bgr(colour), thick(width), *smooth)
        case Area(points=points, fill=fill):
            cv2.fillPoly(image, [_fixed_point(points, px_per_mm)], _bgr(fill), *smooth)
        case Curve(points=points, width=width, colour=colour):
            corners, is_closed = _fixed_point(points, px_per_mm), False
            cv2.polylines(image, [corners], is_closed, _bgr(colour), thick(width), *smooth)
        case Label():
            _write(image, shape, px_per_mm)


def _write(image: ColourImage, label: Label, px_per_mm: float) -> None:
    """Paint a text, in place."""
    for piece in set_pieces(label.text, label.size):
        x = (label.left + piece.right) * px_per_mm - 0.5
        y = (label.at[1] - piece.above) * px_per_mm - 0.5
        font = _font(round(piece.size * px_per_mm, 1))
        left, top, right, bottom = font.getbbox(piece.text, anchor="ls")
        rows = slice(max(0, math.floor(y + top)), max(0, math.ceil(y + bottom) + 1))
        columns = slice(max(0, math.floor(x + left)), max(0, math.ceil(x + right) + 1))
        picture = Image.fromarray(image[rows, columns])
        pen = ImageDraw.Draw(picture)
        at = (x - columns.start, y - rows.start)
        pen.text(at, piece.text, _bgr(label.colour), font, anchor="ls")
        image[rows, columns] = np.asarray(picture)


@cache
def _font(size_px: float) -> ImageFont.FreeTypeFont:
    file = files("grader") / "data" / "fonts" / "DejaVuSansCondensed-Bold.ttf"
    return ImageFont.truetype(str(file), size_px)


def _bgr(colour: str) -> Colour:
    red, green, blue = (int(colour[i : i + 2], 16) for i in (1, 3, 5))
    return (blue, green, red)


def _fixed_point(points: Sequence[XY], px_per_mm: float) -> NDArray[np.int32]:
    """Return (n, 2) pixels times 2**FRACTION_BITS, as cv2 takes them."""
    pixels = (np.array(points) * px_per_mm - 0.5) * 2**FRACTION_BITS
    return np.asarray(np.rint(pixels), dtype=np.int32)


def _dashes(start: XY, end: XY, dash: tuple[float, ...]) -> Iterator[tuple[XY, XY]]:
    """Split a line into dashes of equal length, the first and last at its ends; cv2 has no dashed lines."""
    length = math.dist(start, end)
    if not dash or length < dash[0]:
        yield start, end
        return
    on, off = dash
    count = max(1, round((length + off) / (on + off)))
    pitch = (length + off) / count
    for index in range(count):
        first, last = index * pitch, (index + 1) * pitch - off
        yield between(start, end, first / length), between(start, end, last / length)
