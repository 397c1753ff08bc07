"""TIFF files: one page or many; G4, LZW, deflate, JPEG; 1-bit, grey, colour."""

import io
import logging
import math
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from itertools import product
from typing import Any

import imagecodecs
import numpy as np
import tifffile
from tifffile import COMPRESSION

from grader.records import GreyImage, Page
from grader.scan.decode import pictures
from grader.scan.decode.limits import (
    MAX_PAGES,
    Door,
    InputFile,
    check_memory,
    check_pages,
    check_size,
    damaged,
    truncated,
)
from grader.scan.decode.pictures import Dpi, from_unit, of_four_inks, tags_of, to_grey

logging.getLogger("tifffile").setLevel(logging.CRITICAL)
"""A damaged file raises an error of ours; the library's own messages would only repeat it."""

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
        damage = _fax_damage(file, page) if page.compression in _FAX else ()
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
            pictures.decode(file, number, tables + strip[2:] if tables else strip)


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


def _fax_damage(file: InputFile, page: tifffile.TiffPage) -> tuple[int, ...]:
    """The first and last damaged row of a fax; empty where all are whole."""
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
            return first + row + 1, first + rows
    return ()


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


TIFF = Door(_page, _count)


# Damaged rows of a fax (ITU-T T.4 and T.6) --------------------------------------------------------

_WHITE = """
00110101 000111 0111 1000 1011 1100 1110 1111 10011 10100 00111 01000 001000 000011 110100 110101 101010
101011 0100111 0001100 0001000 0010111 0000011 0000100 0101000 0101011 0010011 0100100 0011000 00000010
00000011 00011010 00011011 00010010 00010011 00010100 00010101 00010110 00010111 00101000 00101001
00101010 00101011 00101100 00101101 00000100 00000101 00001010 00001011 01010010 01010011 01010100
01010101 00100100 00100101 01011000 01011001 01011010 01011011 01001010 01001011 00110010 00110011
00110100 11011 10010 010111 0110111 00110110 00110111 01100100 01100101 01101000 01100111 011001100
011001101 011010010 011010011 011010100 011010101 011010110 011010111 011011000 011011001 011011010
011011011 010011000 010011001 010011010 011000 010011011
"""
"""ITU-T T.4, tables 2 and 3a: codes of white runs of 0 to 63 and of 64, 128 .. 1728 pixels."""
_BLACK = """
0000110111 010 11 10 011 0011 0010 00011 000101 000100 0000100 0000101 0000111 00000100 00000111
000011000 0000010111 0000011000 0000001000 00001100111 00001101000 00001101100 00000110111 00000101000
00000010111 00000011000 000011001010 000011001011 000011001100 000011001101 000001101000 000001101001
000001101010 000001101011 000011010010 000011010011 000011010100 000011010101 000011010110 000011010111
000001101100 000001101101 000011011010 000011011011 000001010100 000001010101 000001010110 000001010111
000001100100 000001100101 000001010010 000001010011 000000100100 000000110111 000000111000 000000100111
000000101000 000001011000 000001011001 000000101011 000000101100 000001011010 000001100110 000001100111
0000001111 000011001000 000011001001 000001011011 000000110011 000000110100 000000110101 0000001101100
0000001101101 0000001001010 0000001001011 0000001001100 0000001001101 0000001110010 0000001110011
0000001110100 0000001110101 0000001110110 0000001110111 0000001010010 0000001010011 0000001010100
0000001010101 0000001011010 0000001011011 0000001100100 0000001100101
"""
_LONG = """
00000001000 00000001100 00000001101 000000010010 000000010011 000000010100 000000010101 000000010110
000000010111 000000011100 000000011101 000000011110 000000011111
"""
"""Table 3b: runs of 1792, 1856 .. 2560 pixels of either colour."""
_WINDOW = 13
"""Bits of the longest code."""
_MODE = re.compile("(1+)|(001)|(011)|(010)|(0001)|(000011)|(000010)|(0000011)|(0000010)")
"""T.6, table 1: vertical modes on the spot; horizontal; vertical 1, -1; pass; vertical 2, -2, 3, -3."""
_STRAIGHT, _HORIZONTAL, _PASS = 1, 2, 5
_SHIFT = (0, 0, 0, 1, -1, 0, 2, -2, 3, -3)
_LINE_END = re.compile("0{11,}1")
_MAX_PADDING = 64
"""Zero bits behind the last row: to the byte, or to the word of a writer that aligns."""


@dataclass(frozen=True, slots=True)
class Coding:
    """How rows are coded.

    Attributes
    ----------
    k : below 0 two-dimensional (T.6), 0 one-dimensional, above 0 a bit behind each end-of-line says which
    aligned : each row starts at a byte
    """

    k: int = -1
    aligned: bool = False


class _DamageError(Exception):
    """No row of the declared width stands here."""


def damaged_row(data: bytes, width: int, rows: int, coding: Coding) -> int | None:
    """The first row, from 0, that is not coded as T.4 or T.6 ask; None where all rows are whole.

    A row is whole where all its codes exist and its runs fill its width exactly. Behind the last row there
    must be an end-of-block, or no more than padding. A code in place of another valid one that leaves all
    this in order (an edge that steps aside by some pixels, and stays there) cannot be told from a drawing.
    """
    bits = bin(int.from_bytes(b"\1" + data, "big"))[3:]
    line_ends = _LINE_END.match(bits) is not None
    end, bits = len(bits), bits + "0" * _WINDOW
    edges: list[int] = []
    at = 0
    for row in range(rows):
        try:
            flat, at = _row_start(bits, at, coding, line_ends=line_ends)
            edges, at = _flat_row(bits, at, width) if flat else _row_below(bits, at, edges, width)
        except _DamageError:
            return row
        if at > end:
            return row
    padded = end - at < _MAX_PADDING and "1" not in bits[at:]
    return None if padded or _LINE_END.match(bits, at) else rows - 1


def _row_start(bits: str, at: int, coding: Coding, *, line_ends: bool) -> tuple[bool, int]:
    """Whether the next row is one-dimensional, and where it starts."""
    if line_ends:
        line_end = _LINE_END.match(bits, at)
        if line_end is None:
            raise _DamageError
        at = line_end.end()
        if coding.k > 0:
            return bits[at : at + 1] == "1", at + 1
    elif coding.aligned:
        at = -(-at // 8) * 8
    return coding.k >= 0, at


def _flat_row(bits: str, at: int, width: int) -> tuple[list[int], int]:
    """A one-dimensional row's edges, white to black first, and where it ends."""
    edges: list[int] = []
    x, black = 0, 0
    while x < width:
        run, at = _run(bits, at, black)
        x, black = x + run, 1 - black
        _add(edges, x)
    return _within(edges, width), at


def _row_below(bits: str, at: int, above: list[int], width: int) -> tuple[list[int], int]:
    """A two-dimensional row's edges, by those of the row above, and where it ends."""
    last = len(above)
    above = [*above, width, width, width]
    edges: list[int] = []
    x, below = -1, 0  # how far the row has come; index above of the next edge of its colour
    while x < width:
        while below >= 2 and above[below - 2] > x:
            below -= 2
        while above[below] <= x:
            below += 2
        mode = _MODE.match(bits, at)
        if mode is None:
            raise _DamageError
        kind, at = mode.lastindex, mode.end()
        if kind == _STRAIGHT:
            # Each follows the edge above it; the one at the border ends the row.
            straight = mode.end() - mode.start()
            if below + straight > last + 1:
                at -= straight
                straight = last + 1 - below if below <= last else 1
                at += straight
            edges += above[below : below + straight]
            x, below = edges[-1], below + straight
        elif kind == _HORIZONTAL:
            black = len(edges) % 2
            first, at = _run(bits, at, black)
            second, at = _run(bits, at, 1 - black)
            x = max(x, 0) + first
            _add(edges, x)
            x += second
            _add(edges, x)
        elif kind == _PASS:
            x = above[below + 1]
            if x >= width:
                raise _DamageError
        else:
            shifted = above[below] + _SHIFT[kind or 0]
            if shifted <= x:
                raise _DamageError
            x, below = shifted, below + 1
            edges.append(x)
    return _within(edges, width), at


def _add(edges: list[int], x: int) -> None:
    """Add an edge; a run of no pixels takes the edge before it away."""
    if edges and edges[-1] == x:
        edges.pop()
    else:
        edges.append(x)


def _within(edges: list[int], width: int) -> list[int]:
    """The edges inside a row that must end at its width."""
    if edges and edges[-1] > width:
        raise _DamageError
    return edges[:-1] if edges and edges[-1] == width else edges


def _run(bits: str, at: int, black: int) -> tuple[int, int]:
    """A run's length in pixels, and where its codes end."""
    codes, total = _codes()[black], 0
    while True:
        code = codes.get(bits[at : at + _WINDOW])
        if code is None:
            raise _DamageError
        at += code[1]
        if code[0] < 64:
            return total + code[0], at
        total += code[0]


@cache
def _codes() -> tuple[dict[str, tuple[int, int]], ...]:
    """Run and length of the code that stands first in each possible window, for white and for black."""
    runs = [*range(64), *range(64, 2561, 64)]
    tables = []
    for text in (_WHITE + _LONG, _BLACK + _LONG):
        table = {}
        for code, run in zip(text.split(), runs, strict=True):
            for rest in product("01", repeat=_WINDOW - len(code)):
                table[code + "".join(rest)] = (run, len(code))
        tables.append(table)
    return tuple(tables)
