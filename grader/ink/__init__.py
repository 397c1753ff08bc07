"""Pixels to strokes in millimetres: straight strokes, their tips, circles, marks and an ink map.

Ink is looked for at about 6 px/mm and strokes are fitted at full resolution. The frame and the title
block are told apart and left out.
"""

from collections.abc import Sequence

import numpy as np

from grader.ink.circles import arcs, find_circles, led_to
from grader.ink.components import find_components, mark_boxes
from grader.ink.regions import brightness, field_of
from grader.ink.seeds import find_seeds, without_squares, working_scale
from grader.ink.strokes import boxes_around, find_strokes, hatching, take
from grader.ink.tips import find_tips
from grader.pixels import cut_out, flatten
from grader.records import Box, GreyImage, Ink, InkMap, Page, Sheet, Unread

__all__ = ["find_ink"]

_DARK = 64.0
"""Of 255, a quarter of white: paper in photos is brighter than 130, a negative's darker than 20."""
_MAP_PX_PER_MM = 6.0
"""Resolution of the ink map: a stroke of 0.3 mm is two pixels wide."""


def find_ink(page: Page, sheet: Sheet, boxes: Sequence[Box] | None = None) -> Ink | Unread:
    """Everything drawn inside the frame of a registered page, or, false in a condition, why it is no drawing.

    Arguments
    ---------
    boxes : where to look, in sheet mm; all of `sheet.drawable_mm` by default
    """
    grey = brightness(page, sheet, boxes)
    if grey < _DARK:
        return Unread(
            "ink",
            f"half of it is as dark as {grey:.0f} of 255 or darker: a picture with its tones inverted, a"
            " pattern, or a photo taken in the dark? Scan the sheet in greyscale, dark lines on white paper",
        )
    flat = flatten(page.grey)
    scale = working_scale(sheet.px_per_mm)
    contrast = without_squares(flat.reduced(scale))
    seeds = find_seeds(contrast)
    components = find_components(seeds)
    field = field_of(seeds, sheet, scale, boxes)
    strokes = find_strokes(flat, seeds, components, field)
    if isinstance(strokes, Unread):
        return strokes
    circles = find_circles(flat, seeds, components, field)
    circles = circles[led_to(circles, strokes)]
    strokes = take(strokes, ~arcs(strokes, circles))
    hatched = hatching(strokes)
    marks = np.concatenate([mark_boxes(components, field), boxes_around(strokes, hatched)])
    strokes = take(strokes, ~hatched)
    tips = find_tips(flat, strokes, sheet.mm_to_px)
    return Ink(strokes, circles, marks, _ink_map(contrast, scale, sheet), tips=tips)


def _ink_map(contrast: GreyImage, scale: float, sheet: Sheet) -> InkMap:
    """Contrast of the whole sheet, upright, from the page reduced by `scale`."""
    reduced = np.array([[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0.0, 0.0, 1.0]])
    # The centre of the map's pixel q is at q / 6 mm.
    box = (-0.5 / _MAP_PX_PER_MM, -0.5 / _MAP_PX_PER_MM, *sheet.page_mm)
    return InkMap(cut_out(contrast, reduced @ sheet.mm_to_px, box, _MAP_PX_PER_MM, outside=0), _MAP_PX_PER_MM)
