"""Whose page it is, by the QR code of a printed sheet."""

from collections.abc import Iterator

import cv2
import numpy as np
import zxingcpp

from grader.layout import CODE_MM
from grader.pixels import cut_out, shrink
from grader.records import FloatArray, GreyImage, Identity, Page
from grader.sheet_code import identity_of

_LONG_SIDES_PX = (1700, 3400)
"""At about 4 px/mm a module has 3 pixels; a phone's photo may need a closer look."""
_CLOSE_UP_PX_PER_MM = 10.0
"""A module has 7 to 10 pixels."""
_MARGIN_MM = 3.0
"""Around the code's place: how far a map by two markers may be off, and more of the quiet zone."""
_BLUR_PX, _SHARPER = 6.0, 1.5
"""Three quarters of a module in the close-up, and how much of the difference is added."""


def identify(page: Page, mm_to_px: FloatArray | None = None) -> Identity | None:
    """What the page's code says; None without a code of ours, or with two that differ.

    Arguments
    ---------
    mm_to_px : the printed sheet's map, where known: the code is then looked for in its place first
    """
    for look in _looks(page.grey, mm_to_px):
        identities = _read(look)
        if identities:
            return identities.pop() if len(identities) == 1 else None
    return None


def _looks(grey: GreyImage, mm_to_px: FloatArray | None) -> Iterator[GreyImage]:
    """Pictures in which the code may be read, the cheapest first."""
    if mm_to_px is not None:
        x, y, wide, high = CODE_MM
        box = x - _MARGIN_MM, y - _MARGIN_MM, wide + 2.0 * _MARGIN_MM, high + 2.0 * _MARGIN_MM
        close_up = cut_out(grey, mm_to_px, box, _CLOSE_UP_PX_PER_MM, outside=255)
        if close_up.size:
            yield close_up
            # Unsharp mask: brings back the modules of a code scanned out of focus.
            soft = cv2.GaussianBlur(close_up, (0, 0), _BLUR_PX)
            sharp = cv2.addWeighted(close_up, 1.0 + _SHARPER, soft, -_SHARPER, 0.0)
            yield np.asarray(sharp, dtype=np.uint8)
    # On a page that is not known to be a printed sheet a closer look would cost more than it finds.
    for long_side in _LONG_SIDES_PX if mm_to_px is not None else _LONG_SIDES_PX[:1]:
        yield shrink(grey, long_side / max(grey.shape))
        if long_side >= max(grey.shape):
            return


def _read(grey: GreyImage) -> set[Identity]:
    """Identities in all codes seen; what is no code of ours is passed over."""
    codes = zxingcpp.read_barcodes(
        np.ascontiguousarray(grey), formats=zxingcpp.BarcodeFormats(zxingcpp.BarcodeFormat.QRCode)
    )
    identities = (identity_of(code.text) for code in codes)
    return {identity for identity in identities if identity is not None}
