"""The coarse upright map of where there is ink."""

import cv2
import numpy as np

from grader.records import GreyImage, InkMap, Sheet

MAP_PX_PER_MM = 6.0


def ink_map(contrast: GreyImage, scale: float, sheet: Sheet) -> InkMap:
    """Contrast of the whole sheet, upright, 6 px/mm, from the page reduced by `scale`."""
    # Full pixel p is at (p + 0.5) s - 0.5 of the reduced image; map pixel q is at q / 6 mm.
    shrink = np.array([[scale, 0.0, 0.5 * scale - 0.5], [0.0, scale, 0.5 * scale - 0.5], [0.0, 0.0, 1.0]])
    to_mm = np.diag([1.0 / MAP_PX_PER_MM, 1.0 / MAP_PX_PER_MM, 1.0])
    size = round(sheet.page_mm[0] * MAP_PX_PER_MM), round(sheet.page_mm[1] * MAP_PX_PER_MM)
    ink = cv2.warpPerspective(
        contrast, shrink @ sheet.mm_to_px @ to_mm, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    )
    return InkMap(np.asarray(ink, dtype=np.uint8), MAP_PX_PER_MM)
