"""Where a PDF page places its one image, and whether it shows anything else."""

import math
from dataclasses import dataclass
from typing import cast

import numpy as np
import pikepdf

from grader.records import FloatArray

_COVERS = 0.9
"""An image over this share of the page, alone on it, is the page."""
_SHOWN = 0.94
"""Of an image; where the page hides more, what a viewer shows is another picture."""
_SQUARE = 1e-3
_PAINTS = frozenset(("S", "s", "f", "F", "f*", "B", "B*", "b", "b*", "sh", "BI", "INLINE IMAGE"))
_SHOWS_TEXT = frozenset(("Tj", "TJ", "'", '"'))
_INVISIBLE_TEXT = 3

Matrix = tuple[float, float, float, float, float, float]
_UNIT: Matrix = (1.0, 0.0, 0.0, 1.0, 0.0, 0.0)


@dataclass(frozen=True, slots=True)
class Placement:
    """A page's only image: its size on paper along its own rows and columns, and how viewers turn it."""

    image: pikepdf.PdfImage
    width_pt: float
    height_pt: float
    turn_deg: int


def only_image(page: pikepdf.Page) -> Placement | None:
    """The image that is the whole page, or None where the page shows more, less or a mirrored one."""
    found: list[tuple[pikepdf.Stream, Matrix]] = []
    matrix, stack, text_mode = _UNIT, [], 0
    try:
        for instruction in pikepdf.parse_content_stream(page):
            operands, name = instruction.operands, str(instruction.operator)
            if name == "q":
                stack.append(matrix)
            elif name == "Q" and stack:
                matrix = stack.pop()
            elif name == "cm":
                matrix = _times(tuple(float(value) for value in operands), matrix)
            elif name == "Tr":
                text_mode = int(operands[0])
            elif name == "Do":
                found.append((cast("pikepdf.Stream", page.resources.XObject[str(operands[0])]), matrix))
            elif name in _PAINTS or (name in _SHOWS_TEXT and text_mode != _INVISIBLE_TEXT):
                return None
    except (pikepdf.PdfError, AttributeError, KeyError, TypeError, ValueError):
        return None
    if len(found) != 1 or found[0][0].get("/Subtype") != "/Image" or "/Annots" in page.obj:
        return None
    return _placed(page, *found[0])


def _placed(page: pikepdf.Page, image: pikepdf.Stream, matrix: Matrix) -> Placement | None:
    a, b, c, d, e, f = matrix
    width, height = math.hypot(a, b), math.hypot(c, d)
    box = [float(value) for value in page.mediabox]
    area = abs((box[2] - box[0]) * (box[3] - box[1]))
    upright = a * d - b * c > 0
    square = min(abs(a), abs(b)) <= _SQUARE * width and abs(a * c + b * d) <= _SQUARE * width * height
    if not upright or not square or width * height < _COVERS * area:
        return None
    corners = np.array([(e, f), (e + a + c, f + b + d)])
    shown = _overlap(corners, [float(value) for value in page.cropbox])
    if shown < _SHOWN * width * height:
        return None
    drawn_turn = round(math.degrees(math.atan2(b, a)) / 90.0) * 90
    page_turn = int(page.obj.get("/Rotate", 0))
    unit = float(page.obj.get("/UserUnit", 1.0))
    turn_deg = (drawn_turn - page_turn) % 360
    return Placement(pikepdf.PdfImage(image), width * unit, height * unit, turn_deg)


def _overlap(corners: FloatArray, box: list[float]) -> float:
    """Area that a rectangle, by opposite corners, shares with a box."""
    low = np.maximum(corners.min(axis=0), np.minimum(box[:2], box[2:]))
    high = np.minimum(corners.max(axis=0), np.maximum(box[:2], box[2:]))
    return float(np.prod(np.maximum(high - low, 0.0)))


def _times(first: tuple[float, ...], second: Matrix) -> Matrix:
    a, b, c, d, e, f = first
    g, h, i, j, k, m = second
    return (a * g + b * i, a * h + b * j, c * g + d * i, c * h + d * j, e * g + f * i + k, e * h + f * j + m)
