"""Compressed streams of a PDF, unpacked only as far as they can be of use: a bomb is told, not set off."""

import zlib
from pathlib import Path
from typing import cast

import numpy as np
import pikepdf

from grader.intake.limits import damaged
from grader.records import GreyImage
from reference.errors import InputFileError

MAX_CONTENT = 32_000_000
"""Bytes of drawing commands on a page; a drawing exported as vectors has a few millions."""
_FORMS_DEEP = 4
_SLACK = 1 << 16
_EIGHT, _ONE = 8, 1


def unpacked(stream: pikepdf.Stream, most: int) -> bytes | None:
    """A stream's bytes, at most `most` and one more; None where it is not packed by deflation alone.

    The one byte more tells that there would have been more.
    """
    filters = _filters(stream)
    if any(name != "/FlateDecode" for name in filters) or (filters and "/DecodeParms" in stream):
        return None
    data = stream.read_raw_bytes()
    for _ in filters:
        try:
            data = zlib.decompressobj().decompress(data, most + 1)
        except zlib.error:
            return None
    return data[: most + 1]


def _filters(stream: pikepdf.Stream) -> list[str]:
    named = stream.get("/Filter")
    if named is None:
        return []
    if isinstance(named, pikepdf.Array):
        return [str(one) for one in named]
    return [str(named)]


def check_content(path: Path, number: int, page: pikepdf.Page) -> None:
    """Raise InputFileError for a page with more drawing commands than a drawing can have."""
    contents = page.obj.get("/Contents")
    parts = list(contents) if isinstance(contents, pikepdf.Array) else [contents]
    streams = [part for part in parts if isinstance(part, pikepdf.Stream)]
    left = MAX_CONTENT
    for stream in (*streams, *_forms(page.obj, _FORMS_DEEP)):
        known = unpacked(stream, left)
        left -= len(known) if known is not None else len(stream.read_raw_bytes())
        if left < 0:
            raise InputFileError(
                "pdf_too_heavy",
                f"{path.name}, page {number}: its drawing commands unpack to more than"
                f" {MAX_CONTENT // 1_000_000} MB; export the page as an image (PNG, 300 dpi)",
            )


def _forms(holder: pikepdf.Object, deep: int) -> list[pikepdf.Stream]:
    """Forms that a page draws, and those that they draw."""
    found: list[pikepdf.Stream] = []
    try:
        objects = dict(holder.Resources.XObject) if deep else {}
    except (AttributeError, KeyError, TypeError, ValueError):
        return found
    for one in objects.values():
        if isinstance(one, pikepdf.Stream) and one.get("/Subtype") == "/Form":
            found += [one, *_forms(one, deep - 1)]
    return found


def plain_pixels(path: Path, number: int, image: pikepdf.PdfImage) -> GreyImage | None:
    """(h, w) or (h, w, 3) pixels of an image stored by deflation alone, None for one stored otherwise.

    Raises InputFileError for one whose data are not what its size asks for.
    """
    bits, space = image.bits_per_component, str(image.colorspace)
    channels = {"/DeviceGray": 1, "/CalGray": 1, "/DeviceRGB": 3, "/CalRGB": 3}.get(space)
    if channels is None or image.indexed or bits not in {_ONE, _EIGHT} or (bits == _ONE and channels != 1):
        return None
    per_row = (image.width * channels * bits + 7) // 8
    size = per_row * image.height
    data = unpacked(cast("pikepdf.Stream", image.obj), size + _SLACK)
    if data is None:
        return None
    if len(data) < size:
        raise damaged(path, number, "its data end before its last row")
    if len(data) > size + _SLACK:
        raise damaged(path, number, "its data are more than its size asks for")
    rows = np.frombuffer(data, np.uint8, size).reshape(image.height, per_row)
    if bits == _ONE:
        return np.unpackbits(rows, axis=1)[:, : image.width] * np.uint8(255)
    return rows if channels == 1 else rows.reshape(image.height, image.width, channels)
