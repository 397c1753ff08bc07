"""Black and white pages as office scanners put them into a PDF: JBIG2, one generic region."""

import io
import struct
from pathlib import Path

import numpy as np
import pikepdf
from numpy.typing import NDArray
from PIL import Image

_PAGE, _REGION = 48, 38
"""Types of segments (ITU-T T.88): page information, and an immediate generic region."""
_STRIP, _BYTES, _MMR = 273, 279, 1
"""TIFF's tags of where a strip begins, and of its size; a region coded as Group 4 fax, as Pillow does."""


def jbig2(page: NDArray[np.uint8]) -> bytes:
    """The segments of a page (h, w) of 0 and 255, as a PDF embeds them."""
    high, wide = page.shape
    stored = io.BytesIO()
    # Pillow writes 1 for white, fax has it for ink.
    Image.fromarray(255 - page).convert("1").save(stored, "TIFF", compression="group4", strip_size=page.size)
    with Image.open(stored) as image:
        (start,), (size,) = image.tag_v2[_STRIP], image.tag_v2[_BYTES]
    coded = stored.getvalue()[start : start + size]
    about = struct.pack(">IIIIBH", wide, high, 0, 0, 0, 0)
    region = struct.pack(">IIIIBB", wide, high, 0, 0, 0, _MMR) + coded
    return _segment(0, _PAGE, about) + _segment(1, _REGION, region)


def _segment(number: int, kind: int, data: bytes) -> bytes:
    """Number, type, no segments referred to, page 1, length; then the data."""
    return struct.pack(">IBBBI", number, kind, 0, 1, len(data)) + data


def write_jbig2_pdf(path: Path, page: NDArray[np.uint8], dpi: float) -> None:
    """A PDF of one such page."""
    document = pikepdf.new()
    high, wide = page.shape
    image = pikepdf.Stream(document, jbig2(page))
    image.stream_dict = pikepdf.Dictionary(
        Type=pikepdf.Name.XObject, Subtype=pikepdf.Name.Image, Width=wide, Height=high,
        ColorSpace=pikepdf.Name.DeviceGray, BitsPerComponent=1, Filter=pikepdf.Name.JBIG2Decode,
    )  # fmt: skip
    w, h = wide / dpi * 72.0, high / dpi * 72.0
    document.pages.append(pikepdf.Page(document.make_indirect(pikepdf.Dictionary(
        Type=pikepdf.Name.Page, MediaBox=[0, 0, w, h],
        Resources=pikepdf.Dictionary(XObject=pikepdf.Dictionary(Im0=document.make_indirect(image))),
        Contents=document.make_indirect(pikepdf.Stream(document, f"q {w} 0 0 {h} 0 0 cm /Im0 Do Q".encode())),
    ))))  # fmt: skip
    document.save(path)
