"""JPEG files: one page, decoded to luma directly."""

import io
from collections.abc import Iterator
from pathlib import Path

import simplejpeg
from PIL import Image

from grader.intake.grey import from_pillow
from grader.intake.limits import Door, check_size, damaged, truncated
from grader.intake.tags import of_image, opened
from grader.records import GreyImage, Page

_HARMLESS = ("extraneous bytes", "Invalid SOS parameters", "unknown Adobe color transform")
"""Warnings of libjpeg that leave the picture whole."""
_END = b"\xff\xd9"
_LEAST_BYTES = 600
"""A header with its tables is longer than this."""
_CUT_OFF = ("remature end", "exhausted", "mpty input")


def _pages(path: Path, first: int) -> Iterator[Page]:
    if first > 1:
        return
    data = path.read_bytes()
    if not data.rstrip(b"\0").endswith(_END) and len(data) < _LEAST_BYTES:
        raise truncated(path, 1)
    with opened(path, data) as image:
        tags = of_image(image)
        four_inks = image.mode == "CMYK"
    grey = _four_inks(path, data) if four_inks else decode(path, 1, data)
    yield Page(path.name, 1, tags.unmirrored(grey), tags.dpi, tags.turn_deg)


def decode(path: Path, page: int, data: bytes) -> GreyImage:
    """Luma of a JPEG stream, (h, w) uint8; raises InputFileError where it is cut off or damaged.

    libjpeg fills what is missing with grey and only warns: the warning is an error here.
    """
    try:
        high, wide, _, _ = simplejpeg.decode_jpeg_header(data, strict=False)
    except ValueError as error:
        raise damaged(path, page, str(error)) from error
    check_size(path, page, wide, high)
    try:
        return _plane(simplejpeg.decode_jpeg(data, colorspace="GRAY", strict=True))
    except ValueError as error:
        message = str(error)
    if any(sign in message for sign in _CUT_OFF):
        raise truncated(path, page)
    if not any(harmless in message for harmless in _HARMLESS):
        raise damaged(path, page, message)
    try:
        return _plane(simplejpeg.decode_jpeg(data, colorspace="GRAY", strict=False))
    except ValueError as error:
        raise damaged(path, page, str(error)) from error


def _plane(image: GreyImage) -> GreyImage:
    """The only channel of a (h, w, 1) image."""
    return image[..., 0]


def _four_inks(path: Path, data: bytes) -> GreyImage:
    try:
        with Image.open(io.BytesIO(data)) as image:
            return from_pillow(image)
    except (OSError, ValueError, SyntaxError) as error:
        raise damaged(path, 1, str(error)) from error


def _count(path: Path) -> int:
    del path
    return 1


DOOR = Door(_pages, _count)
