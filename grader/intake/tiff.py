"""TIFF files: one page or many; G4, LZW, deflate, JPEG; 1-bit, grey, colour."""

import io
import logging
import math
import struct
from collections.abc import Callable
from typing import Any

import imagecodecs
import numpy as np
import tifffile
from tifffile import COMPRESSION

from grader.intake import jpeg
from grader.intake.fax import Coding, damaged_row
from grader.intake.grey import of_four_inks, to_grey
from grader.intake.limits import (
    MAX_PAGES,
    Door,
    InputFile,
    check_memory,
    check_pages,
    check_size,
    damaged,
    truncated,
)
from grader.intake.tags import Dpi, from_unit, tags_of
from grader.records import GreyImage, Page

logging.getLogger("tifffile").setLevel(logging.CRITICAL)
"""What is wrong with a file is told by an error; the library's own words on it would be in the way."""

_MAX_SEGMENTS = 500_000
"""Strips or tiles: A2 at 600 dpi in tiles of 16 x 16 has 540,000, in strips of one row 14,000."""
_MAX_TAGS = 4096
"""Pages have about 20 tags."""
_THREADS = 2
"""Segments that are decoded at the same time."""
_MAX_RATIO: dict[int, int] = {
    COMPRESSION.NONE: 1, COMPRESSION.LZW: 1400, COMPRESSION.ADOBE_DEFLATE: 1040, COMPRESSION.DEFLATE: 1040,
    COMPRESSION.PACKBITS: 64,
}  # fmt: skip
"""Bytes that one byte can unpack to, by the coding itself; 4096 by 1.5 bytes would be LZW's longest."""
_UNCHECKED: dict[int, Callable[..., bytes | bytearray]] = {
    COMPRESSION.LZW: imagecodecs.lzw_decode,
    COMPRESSION.PACKBITS: imagecodecs.packbits_decode,
}
"""Codings without a checksum: what is damaged unpacks to another length."""
_FAX = (COMPRESSION.CCITTRLE, COMPRESSION.CCITT_T4, COMPRESSION.CCITT_T6)
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))


def _directories(file: InputFile) -> tuple[int, bool]:
    """Number of pages in the file's list, at most one more than allowed; whether the list has an end.

    A list that goes on outside of the file, or comes back to where it was, has none.
    """
    order = "<" if file.data.startswith(b"II") else ">"
    big = 43 in file.data[2:4]
    first, count, pointer, entry = (8, "Q", "Q", 20) if big else (4, "H", "I", 12)
    offsets: set[int] = set()
    try:
        (at,) = struct.unpack_from(order + pointer, file.data, first)
        while at and at not in offsets and len(offsets) <= MAX_PAGES:
            (tags,) = struct.unpack_from(order + count, file.data, at)
            behind = at + struct.calcsize(order + count) + tags * entry
            if not 0 < tags <= _MAX_TAGS:
                return len(offsets), False
            offsets.add(at)
            (at,) = struct.unpack_from(order + pointer, file.data, behind)
    except struct.error:
        return len(offsets), False
    return len(offsets), at not in offsets


def _page(file: InputFile, number: int) -> Page | None:
    whole, ended = _directories(file)
    if number > whole:
        if ended:
            return None
        # The list of pages stands at the end of most files, behind the pixels.
        raise truncated(file, number)
    with tifffile.TiffFile(io.BytesIO(file.data)) as tiff:
        page = tiff.pages[number - 1]
        if not isinstance(page, tifffile.TiffPage):
            raise damaged(file, number, "its directory cannot be read")
        _check_page(file, number, page)
        tags = tags_of(_dpi(page), int(_value(page, "Orientation", 1)))
        damage = _fax_damage(file, page) if page.compression in _FAX else ""
        grey = tags.unmirrored(_grey(page))
    return Page(file.name, number, grey, tags.dpi, tags.turn_deg, damage=damage)


def _check_page(file: InputFile, number: int, page: tifffile.TiffPage) -> None:
    """Raise InputFileError for a page that asks for too much, or whose data are not all there."""
    if page.dtype is None:
        raise damaged(file, number, f"pixels of {page.bitspersample} bits are not read")
    pixels = page.imagewidth * page.imagelength
    decoded = math.prod(page.shape) * page.dtype.itemsize
    segment = math.prod(page.chunks) * page.dtype.itemsize
    check_memory(file, number, pixels, max(decoded, _THREADS * segment))
    check_size(file, number, page.imagewidth, page.imagelength)
    wanted = math.prod(page.chunked)
    if wanted > _MAX_SEGMENTS:
        raise damaged(file, number, f"it is in {wanted} parts, more than {_MAX_SEGMENTS}")
    parts = list(zip(page.dataoffsets, page.databytecounts, strict=False))[:wanted]
    if len(parts) < wanted or not all(offset and length for offset, length in parts):
        raise damaged(file, number, f"{wanted} parts are asked for, and some are missing")
    if any(offset + length > len(file.data) for offset, length in parts):
        raise truncated(file, number)
    stored = sum(length for _, length in parts)
    packed_bytes = math.prod(page.shape) * max(page.bitspersample, 1) // 8
    if packed_bytes > stored * _MAX_RATIO.get(page.compression, math.inf):
        raise truncated(file, number)
    if page.compression in _UNCHECKED:
        _check_lengths(file, number, page, parts)
    if page.compression == COMPRESSION.JPEG and page.samplesperpixel <= 3 and page.bitspersample == 8:
        # tifffile's decoder fills what is damaged without a word.
        tables = bytes(page.jpegtables or b"")[:-2]
        for offset, length in parts:
            strip = file.data[offset : offset + length]
            jpeg.decode(file, number, tables + strip[2:] if tables else strip)


def _check_lengths(
    file: InputFile, number: int, page: tifffile.TiffPage, parts: list[tuple[int, int]]
) -> None:
    """Raise InputFileError where a part unpacks to more or less than its rows need."""
    decode = _UNCHECKED[page.compression]
    width = page.tilewidth if page.is_tiled else page.imagewidth
    samples = page.samplesperpixel if page.planarconfig == tifffile.PLANARCONFIG.CONTIG else 1
    row_bytes = -(-width * samples * page.bitspersample // 8)
    for index, (offset, length) in enumerate(parts):
        size = row_bytes * _rows(page, index)
        data = file.data[offset : offset + length]
        if page.fillorder == tifffile.FILLORDER.LSB2MSB:
            data = data.translate(_REVERSED)
        if len(decode(data, out=size + 1)) != size:
            raise damaged(file, number, f"its part {index + 1} does not unpack to its size")


def _rows(page: tifffile.TiffPage, index: int) -> int:
    """Rows of pixels in a strip or tile."""
    if page.is_tiled:
        return int(page.tilelength)
    strips = -(-page.imagelength // page.rowsperstrip)
    return int(min(page.rowsperstrip, page.imagelength - index % strips * page.rowsperstrip))


def _fax_damage(file: InputFile, page: tifffile.TiffPage) -> str:
    """Where the rows of a fax are damaged; empty where they are whole."""
    options = int(_value(page, "T4Options", 0))
    if page.compression == COMPRESSION.CCITT_T6:
        coding = Coding(k=-1)
    else:
        coding = Coding(k=options & 1, aligned=page.compression == COMPRESSION.CCITTRLE)
    width, across = page.imagewidth, 1
    if page.is_tiled:
        width, across = page.tilewidth, -(-page.imagewidth // page.tilewidth)
    for index, (offset, length) in enumerate(zip(page.dataoffsets, page.databytecounts, strict=True)):
        data = file.data[offset : offset + length]
        if page.fillorder == tifffile.FILLORDER.LSB2MSB:
            data = data.translate(_REVERSED)
        rows = _rows(page, index)
        row = damaged_row(data, width, rows, coding)
        if row is not None:
            first = index // across * (page.tilelength if page.is_tiled else page.rowsperstrip)
            return f"rows {first + row + 1} to {first + rows} of {page.imagelength}"
    return ""


def _grey(page: tifffile.TiffPage) -> GreyImage:
    pixels = np.squeeze(page.asarray(maxworkers=_THREADS))
    if page.planarconfig == tifffile.PLANARCONFIG.SEPARATE and pixels.ndim == 3:
        pixels = np.moveaxis(pixels, 0, -1)
    if page.photometric == tifffile.PHOTOMETRIC.SEPARATED and pixels.ndim == 3 and pixels.shape[2] >= 4:
        return of_four_inks(pixels)
    if page.photometric == tifffile.PHOTOMETRIC.PALETTE and page.colormap is not None:
        colours = (page.colormap.T[None] >> 8).astype(np.uint8)
        return np.asarray(to_grey(colours, rgb=True)[0][pixels], dtype=np.uint8)
    if page.photometric == tifffile.PHOTOMETRIC.MINISWHITE:
        pixels = ~pixels
    return to_grey(pixels, rgb=True)


def _dpi(page: tifffile.TiffPage) -> Dpi | None:
    x, y = _value(page, "XResolution", None), _value(page, "YResolution", None)
    if not (isinstance(x, tuple) and isinstance(y, tuple) and x[1] and y[1]):
        return None
    return from_unit(x[0] / x[1], y[0] / y[1], int(_value(page, "ResolutionUnit", 2)))


def _value(page: tifffile.TiffPage, name: str, default: Any) -> Any:  # noqa: ANN401 - as tagged
    tag = page.tags.get(name)
    return default if tag is None else tag.value


def _count(file: InputFile) -> int:
    whole, ended = _directories(file)
    pages = whole if ended else whole + 1
    check_pages(file, pages)
    return pages


DOOR = Door(_page, _count)
