"""The straight lines that a plain A3 sheet can have: its edges and its drawing frame, in mm."""

from dataclasses import dataclass

import numpy as np

from grader.records import Box, FloatArray

PAGE_MM = (420.0, 297.0)
SIDES = ("left", "top", "right", "bottom")


@dataclass(frozen=True, slots=True)
class Model:
    """A rectangle on the upright sheet.

    Attributes
    ----------
    name : `paper`, `iso` or `gost`
    box : left, top, right, bottom, mm
    side_se_mm : how far one end of a side may be off (a hand and a ruler; a guillotine)
    """

    name: str
    box: tuple[float, float, float, float]
    side_se_mm: float

    def corners(self) -> FloatArray:
        """(4, 2) from the top left, clockwise on the sheet."""
        x0, y0, x1, y1 = self.box
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


PAPER = Model("paper", (0.0, 0.0, *PAGE_MM), 0.35)
ISO = Model("iso", (20.0, 10.0, 410.0, 287.0), 0.3)
GOST = Model("gost", (20.0, 5.0, 415.0, 292.0), 0.3)
FRAMES = (ISO, GOST)
_MARGIN_MM = 10.0


def drawable(model: Model | None) -> Box:
    """The box inside a frame, or, without one, inside the least margin."""
    x0, y0, x1, y1 = (_MARGIN_MM, _MARGIN_MM, 410.0, 287.0) if model is None else model.box
    return (x0, y0, x1 - x0, y1 - y0)
