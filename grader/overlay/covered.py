"""Pages with nothing left but the figures: everything else is painted over with paper.

The caller says what stays, not what goes: what was read as a figure, with the letters at its points. Within
it, lines of writing and signs away from points and strokes are painted over; points and strokes stay whole.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.overlay.picture import encode
from grader.records import Box, FloatArray, GreyImage, Page, Sheet
from grader.scan.pixels import mapped
from grader.scan.register.distortion import straighten
from reference.drawing.canvas import A3_MM

HULL_MM = 10.0
"""Margin around a figure: letters, arrowheads, supports, the ends of construction lines."""
STROKE_MM = 0.8
"""Margin on each side of a stroke that was read: its own ink, if writing runs through it."""
POINT_MM = 6.0
"""Margin around a point: its circle, its letter, the hatching of a support, which looks like writing."""
AT_NODE_MM, AT_STROKE_MM = 10.0, 5.0
"""Signs this close to a point, or a stroke, are its name."""
AROUND_MM = 1.0
"""Margin around what is painted over: the blur of ink."""
_REDUCED = 8
_SOLID_MM, _SMOOTH_MM = 40.0, 8.0
"""The paper's shade is the brightest within this distance, smoothed: a code of 28 mm must leave no trace."""


@dataclass(slots=True)
class Keep:
    """The parts of a page that stay, in sheet mm.

    Attributes
    ----------
    figures : (n, 2) the points of each figure that was read
    strokes : (2, 2) the two ends of each stroke that was read
    zones : the boxes in which figures stay; empty for the whole sheet
    writing : boxes of lines of writing
    signs : boxes of single signs
    block : the title block's box, or None; nothing of it stays
    """

    figures: list[FloatArray] = field(default_factory=list)
    strokes: list[FloatArray] = field(default_factory=list)
    zones: Sequence[Box] = ()
    writing: Sequence[Box] = ()
    signs: Sequence[Box] = ()
    block: Box | None = None


def upright_pixels(image: Page, sheet: Sheet) -> tuple[GreyImage, FloatArray]:
    """Return the picture without lens distortion, cut to the sheet, and the (3, 3) map from mm to pixels."""
    if sheet.lens is not None and sheet.lens.bend:
        image, sheet = straighten(image, sheet)
    wide, high = sheet.page_mm
    corners = mapped(sheet.mm_to_px, np.array([(0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high)]))
    size = np.array(image.grey.shape[::-1])
    low = np.clip(np.floor(corners.min(axis=0)), 0, size - 1).astype(int)
    top = np.clip(np.ceil(corners.max(axis=0)) + 1, low + 1, size).astype(int)
    shift = np.array([[1.0, 0.0, -low[0]], [0.0, 1.0, -low[1]], [0.0, 0.0, 1.0]])
    return np.ascontiguousarray(image.grey[low[1] : top[1], low[0] : top[0]]), shift @ sheet.mm_to_px


def covered(grey: GreyImage, mm_to_px: FloatArray, px_per_mm: float, keep: Keep) -> GreyImage:
    """Return the picture with everything but the kept parts painted over."""
    return _on_paper(grey, _mask(grey, mm_to_px, px_per_mm, keep))


def painted(grey: GreyImage, boxes: Sequence[Box]) -> GreyImage:
    """Return the picture with paper over boxes, which are in its pixels: x, y, width, height."""
    shows = np.ones(grey.shape, np.bool_)
    for x, y, wide, high in boxes:
        shows[max(0, int(y)) : max(0, round(y + high)), max(0, int(x)) : max(0, round(x + wide))] = False
    return _on_paper(grey, shows)


def _on_paper(grey: GreyImage, shows: NDArray[np.bool_]) -> GreyImage:
    """Return the picture with the paper's shade where the mask is false; ink leaves no shadow in it."""
    size = max(1, grey.shape[1] // _REDUCED), max(1, grey.shape[0] // _REDUCED)
    small = cv2.resize(grey, size, interpolation=cv2.INTER_AREA)
    unit = max(small.shape) / A3_MM[0]
    around = cv2.getStructuringElement(cv2.MORPH_RECT, (odd := 2 * round(_SOLID_MM * unit / 2.0) + 1, odd))
    even = cv2.GaussianBlur(cv2.morphologyEx(small, cv2.MORPH_CLOSE, around), (0, 0), _SMOOTH_MM * unit)
    paper = cv2.resize(even, grey.shape[::-1], interpolation=cv2.INTER_LINEAR)
    return np.asarray(np.where(shows, grey, paper), dtype=np.uint8)


def _mask(grey: GreyImage, mm_to_px: FloatArray, px_per_mm: float, keep: Keep) -> NDArray[np.bool_]:
    """Return (h, w) whether a pixel stays as it is."""

    def blank() -> GreyImage:
        return np.zeros(grey.shape, np.uint8)

    def draw(onto: GreyImage, places: FloatArray, reach_mm: float) -> None:
        corners = np.rint(mapped(mm_to_px, places)).astype(np.int32)
        hull = cv2.convexHull(corners)
        thick = max(1, round(2.0 * reach_mm * px_per_mm))
        cv2.fillConvexPoly(onto, hull, 1)
        cv2.polylines(onto, [hull], isClosed=True, color=1, thickness=thick)

    shows, strokes, away = blank(), blank(), blank()
    for points in keep.figures:
        draw(shows, points, HULL_MM)
        for point in points:
            draw(strokes, point[None], POINT_MM)
    if keep.zones:
        zones = blank()
        for box in keep.zones:
            draw(zones, corners_of(box), 0.0)
        shows &= zones
    for ends in keep.strokes:
        draw(strokes, ends, STROKE_MM)
    for box in (*keep.writing, *_loose(keep)):
        draw(away, corners_of(box), AROUND_MM)
    shows &= (1 - away) | strokes
    if keep.block is not None:
        over = blank()
        draw(over, corners_of(keep.block), 0.0)
        shows &= 1 - over
    return np.asarray(shows > 0)


def _loose(keep: Keep) -> Iterable[Box]:
    """Yield the signs that do not name a point or a stroke."""
    nodes = np.concatenate([*keep.figures, np.zeros((0, 2))])
    for box in keep.signs:
        middle = np.array([box[0] + box[2] / 2.0, box[1] + box[3] / 2.0])
        is_at_node = len(nodes) and np.min(np.linalg.norm(nodes - middle, axis=1)) < AT_NODE_MM
        if not is_at_node and all(_distance(middle, ends) > AT_STROKE_MM for ends in keep.strokes):
            yield box


def _distance(at: FloatArray, ends: FloatArray) -> float:
    """Return the distance of a point from a stroke."""
    along = ends[1] - ends[0]
    share = float(np.clip((at - ends[0]) @ along / max(along @ along, 1e-12), 0.0, 1.0))
    return float(np.linalg.norm(at - ends[0] - share * along))


def corners_of(box: Box) -> FloatArray:
    """Return (4, 2) the corners of a box."""
    x, y, wide, high = box
    return np.array([(x, y), (x + wide, y), (x + wide, y + high), (x, y + high)])


def bare_png(grey: GreyImage) -> bytes:
    """Return a picture as PNG: size and pixels, nothing else."""
    return encode(".png", grey, [])


def reopened(picture: bytes) -> GreyImage | None:
    """Return the pixels of a PNG file, which a person may have edited; None if it is none."""
    if not picture:
        return None
    grey = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_GRAYSCALE)
    return None if grey is None else np.asarray(grey, dtype=np.uint8)
