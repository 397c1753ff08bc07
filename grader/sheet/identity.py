"""Whose page it is, by the QR code of a printed sheet."""

import cv2
import numpy as np
import zxingcpp

from grader.layout import CODE_MM
from grader.pixels import shrink
from grader.records import FloatArray, GreyImage, Identity, Page
from grader.sheet_code import identity_of

_LONG_SIDES_PX = (1700, 3400)
"""At about 4 px/mm a module has 3 pixels; a phone's photo may need a closer look."""
_CLOSE_UP_PX_PER_MM = 10.0
_MARGIN_MM = 3.0
_BLUR_PX, _SHARPER = 6.0, 1.5
"""Three quarters of a module in the close-up, and how much of the difference is added."""


def identify(page: Page, mm_to_px: FloatArray | None = None) -> Identity | None:
    """What the page's code says; None without a code of ours, or with two that differ.

    Arguments
    ---------
    mm_to_px : the printed sheet's map, where known: the code is then looked for in its place first
    """
    if mm_to_px is not None:
        close_up = _close_up(page.grey, mm_to_px)
        found = _read(close_up) or _read(_sharpened(close_up))
        if found:
            return found.pop() if len(found) == 1 else None
    # On a page that is not known to be a printed sheet a closer look would cost more than it finds.
    for long_side in _LONG_SIDES_PX if mm_to_px is not None else _LONG_SIDES_PX[:1]:
        scale = long_side / max(page.grey.shape)
        found = _read(shrink(page.grey, scale) if scale < 1.0 else page.grey)
        if found:
            return found.pop() if len(found) == 1 else None
        if scale >= 1.0:
            break
    return None


def _read(grey: GreyImage) -> set[Identity]:
    """Identities in all codes seen; what is no code of ours is passed over."""
    codes = zxingcpp.read_barcodes(
        np.ascontiguousarray(grey), formats=zxingcpp.BarcodeFormats(zxingcpp.BarcodeFormat.QRCode)
    )
    identities = (identity_of(code.text) for code in codes)
    return {identity for identity in identities if identity is not None}


def _sharpened(grey: GreyImage) -> GreyImage:
    """Unsharp mask: brings back the modules of a code scanned out of focus."""
    soft = cv2.GaussianBlur(grey, (0, 0), _BLUR_PX)
    return np.asarray(cv2.addWeighted(grey, 1.0 + _SHARPER, soft, -_SHARPER, 0.0), dtype=np.uint8)


def _close_up(grey: GreyImage, mm_to_px: FloatArray) -> GreyImage:
    """The code's place, upright."""
    x, y, w, h = CODE_MM
    to_sheet = np.array(
        [
            [1.0 / _CLOSE_UP_PX_PER_MM, 0.0, x - _MARGIN_MM],
            [0.0, 1.0 / _CLOSE_UP_PX_PER_MM, y - _MARGIN_MM],
            [0.0, 0.0, 1.0],
        ]
    )
    size = (int((w + 2 * _MARGIN_MM) * _CLOSE_UP_PX_PER_MM), int((h + 2 * _MARGIN_MM) * _CLOSE_UP_PX_PER_MM))
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    return np.asarray(
        cv2.warpPerspective(grey, mm_to_px @ to_sheet, size, flags=flags, borderValue=255), dtype=np.uint8
    )
