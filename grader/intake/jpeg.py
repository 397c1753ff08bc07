"""JPEG files: one page, decoded to luma directly."""

import io

import simplejpeg
from PIL import Image

from grader.intake.grey import from_pillow
from grader.intake.limits import Door, InputFile, check_memory, check_size, damaged, truncated
from grader.intake.tags import tags_within
from grader.records import GreyImage, Page
from reference.errors import InputFileError

_HARMLESS = ("extraneous bytes", "Invalid SOS parameters", "unknown Adobe color transform")
"""Warnings of libjpeg that leave the picture whole."""
_END = b"\xff\xd9"
_SCAN = b"\xff\xda"
_MAX_SCANS = 100
"""Progressive files of cameras and programs have about 10; each scan costs a pass over all blocks."""
_PLANES = {"Gray": 1.0, "444": 3.0, "422": 2.0, "440": 2.0, "420": 1.5, "411": 1.5}
"""Coefficients for a pixel, of two bytes; held in memory where a file has more than one scan."""
_FOUR_INKS = ("CMYK", "YCCK")
_LEAST_BYTES = 600
"""A header with its tables is longer than this."""
_CUT_OFF = ("remature end", "exhausted", "mpty input")


def _page(file: InputFile, number: int) -> Page | None:
    if number > 1:
        return None
    if not file.data.rstrip(b"\0").endswith(_END) and len(file.data) < _LEAST_BYTES:
        raise truncated(file, 1)
    four_inks = check_header(file, 1, file.data) in _FOUR_INKS
    tags = tags_within(file.data)
    grey = _four_inks(file.data) if four_inks else decode(file, 1, file.data)
    return Page(file.name, 1, tags.unmirrored(grey), tags.dpi, tags.turn_deg)


def check_header(file: InputFile, page: int, data: bytes, *, least: bool = True) -> str:
    """Colour space of a JPEG stream; raises InputFileError for one that costs too much, or is too small.

    Arguments: it may be of any size without `least`, as a part of a page.
    """
    high, wide, space, sampling = simplejpeg.decode_jpeg_header(data, strict=False)
    # Counts those of a thumbnail too: more never harms a picture of a sheet's size.
    scans = data.count(_SCAN)
    if scans > _MAX_SCANS:
        raise InputFileError(
            "image_too_large",
            f"{file.name}, page {page}: the JPEG has {scans} scans, more than {_MAX_SCANS}; save it again",
        )
    planes = _PLANES.get(sampling, 3.0) if space not in _FOUR_INKS else 4.0
    decoded = 9.0 if space in _FOUR_INKS else 0.0
    pixel_bytes = decoded + (2.0 * planes if scans > 1 else 0.0)
    check_memory(file, page, wide * high, int(wide * high * pixel_bytes))
    if least:
        check_size(file, page, wide, high)
    return str(space)


def decode(file: InputFile, page: int, data: bytes) -> GreyImage:
    """Luma of a JPEG stream, (h, w) uint8; raises InputFileError where it is cut off or damaged.

    libjpeg fills what is missing with grey and only warns: the warning is an error here.
    """
    try:
        return _plane(simplejpeg.decode_jpeg(data, colorspace="GRAY", strict=True))
    except ValueError as error:
        message = str(error)
    if any(sign in message for sign in _CUT_OFF):
        raise truncated(file, page)
    if not any(harmless in message for harmless in _HARMLESS):
        raise damaged(file, page, message)
    return _plane(simplejpeg.decode_jpeg(data, colorspace="GRAY", strict=False))


def _plane(image: GreyImage) -> GreyImage:
    """The only channel of a (h, w, 1) image."""
    return image[..., 0]


def _four_inks(data: bytes) -> GreyImage:
    with Image.open(io.BytesIO(data)) as image:
        return from_pillow(image)


DOOR = Door(_page)
