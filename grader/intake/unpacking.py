"""Compressed streams of a PDF, unpacked only as far as they can be of use: a bomb is told, not set off."""

import zlib
from typing import cast

import numpy as np
import pikepdf

from grader.intake.limits import InputFile, damaged
from grader.records import GreyImage

MAX_CONTENT = 32_000_000
"""Bytes of drawing commands on a page, each as often as it is carried out; exported drawings have 5 MB."""
_SLACK = 1 << 16
_EIGHT, _ONE = 8, 1


def unpacked(stream: pikepdf.Stream, most: int, filters: list[str] | None = None) -> bytes | None:
    """A stream's bytes, at most `most` and one more; None where they are packed by more than deflation.

    The one byte more tells that there would have been more. Of `filters`, by default all, those that
    come first may be named alone. Rows that a predictor has changed stay so. Raises zlib.error.
    """
    filters = filters_of(stream) if filters is None else filters
    if any(name != "/FlateDecode" for name in filters):
        return None
    data = stream.read_raw_bytes()
    for _ in filters:
        data = zlib.decompressobj().decompress(data, most + 1)
    return data[: most + 1]


def filters_of(stream: pikepdf.Stream) -> list[str]:
    """How a stream is packed, the outermost first."""
    named = stream.get("/Filter")
    if named is None:
        return []
    if isinstance(named, pikepdf.Array):
        return [str(one) for one in named]
    return [str(named)]


def plain_pixels(file: InputFile, number: int, image: pikepdf.PdfImage) -> GreyImage | None:
    """(h, w) or (h, w, 3) pixels of an image stored by deflation alone, None for one stored otherwise.

    Raises InputFileError for one whose data are not what its size asks for.
    """
    bits, space = image.bits_per_component, str(image.colorspace)
    channels = {"/DeviceGray": 1, "/CalGray": 1, "/DeviceRGB": 3, "/CalRGB": 3}.get(space)
    if channels is None or image.indexed or bits not in {_ONE, _EIGHT} or (bits == _ONE and channels != 1):
        return None
    per_row = (image.width * channels * bits + 7) // 8
    size = per_row * image.height
    if "/DecodeParms" in image.obj:
        return None
    data = unpacked(cast("pikepdf.Stream", image.obj), size + _SLACK)
    if data is None:
        return None
    if len(data) < size:
        raise damaged(file, number, "its data end before its last row")
    if len(data) > size + _SLACK:
        raise damaged(file, number, "its data are more than its size asks for")
    rows = np.frombuffer(data, np.uint8, size).reshape(image.height, per_row)
    if bits == _ONE:
        return np.unpackbits(rows, axis=1)[:, : image.width] * np.uint8(255)
    return rows if channels == 1 else rows.reshape(image.height, image.width, channels)
