"""Pixels to strokes in millimetres: straight strokes, circles, arrowheads, marks and an ink map.

Strokes are looked for at about 6 px/mm and fitted at full resolution. The frame and the title block
are told apart and left out.
"""

from collections.abc import Sequence

import numpy as np

from grader.ink.inkmap import ink_map
from grader.ink.strokes import find_strokes
from grader.pixels import flatten
from grader.records import Box, Ink, Page, Sheet

__all__ = ["find_ink"]


def find_ink(page: Page, sheet: Sheet, boxes: Sequence[Box] | None = None) -> Ink:
    """Everything drawn inside the frame of a registered page.

    Arguments
    ---------
    boxes : where to look, in sheet mm; all of `sheet.drawable_mm` by default
    """
    flat = flatten(page.grey)
    strokes, marks = find_strokes(flat, sheet, boxes)
    return Ink(strokes, np.zeros((0, 3)), np.zeros((0, 3)), marks, ink_map(flat, sheet))
