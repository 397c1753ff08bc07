"""Blank pages: the backs of a duplex scan, with show-through, dust and punched holes."""

import cv2
import numpy as np

from grader.pixels import shrink
from grader.records import Page

_LONG_SIDE_PX = 1700
"""About 4 px/mm on A3: strokes of 0.3 mm survive, dust and grain fade."""
_DARK = 0.16
"""Contrast of a pencil stroke at this resolution; what shows through paper stays under 0.1."""
_LONG = 0.012
"""Of the long side (5 mm on A3): longer than dust, hairs and letters that show through."""
_RIM = 0.03
_ENOUGH = 0.1
"""Of the long side (42 mm): all long marks together on a page that is drawn on."""


def is_blank(page: Page) -> bool:
    """True for a page that nobody drew on.

    Sums the extents of dark marks of at least 5 mm, away from the page's rim where scanners leave
    shadows; a sheet with a single short line is not blank.
    """
    scale = min(1.0, _LONG_SIDE_PX / max(page.grey.shape))
    small = shrink(page.grey, scale)
    paper = cv2.morphologyEx(small, cv2.MORPH_CLOSE, np.ones((31, 31), np.uint8))
    share = np.asarray(cv2.divide(small, paper, scale=255), dtype=np.uint8)
    # A strip narrower than two rims has no more than its middle.
    rim = min(int(_RIM * max(small.shape)), (min(small.shape) - 1) // 2)
    if rim > 0:
        share = share[rim:-rim, rim:-rim]
    inner = np.ascontiguousarray(share < (1.0 - _DARK) * 255).astype(np.uint8)
    _, _, stats, _ = cv2.connectedComponentsWithStats(inner, connectivity=8)
    extent = np.hypot(stats[1:, cv2.CC_STAT_WIDTH], stats[1:, cv2.CC_STAT_HEIGHT])
    long_side = max(small.shape)
    return bool(extent[extent > _LONG * long_side].sum() < _ENOUGH * long_side)
