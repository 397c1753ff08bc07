"""TIFF files by Pillow: one page or many; G4, LZW, deflate, JPEG; 1-bit, grey, colour."""

import contextlib
import io
import struct

import numpy as np
from PIL.ExifTags import Base as Tag
from PIL.TiffImagePlugin import TiffImageFile

from grader.records import GreyImage, Page
from grader.scan.decode import pictures
from grader.scan.decode.fax import Coding, damaged_row
from grader.scan.decode.limits import (
    MAX_PAGES,
    Door,
    InputFile,
    check_pages,
    check_size,
    damaged,
    truncated,
)
from grader.scan.decode.pictures import from_pillow, from_unit, of_four_inks, tags_of, to_grey

_FAX = ("tiff_ccitt", "group3", "group4")
_REVERSED = bytes(int(f"{byte:08b}"[::-1], 2) for byte in range(256))
_PIXEL_BYTES = 8
"""Most bytes of a pixel as Pillow holds it and hands it over."""

Parts = list[tuple[int, int]]
"""Tags of the beginning of each strip or tile, and of its bytes."""


def _opened(file: InputFile, number: int) -> TiffImageFile | None:
    """A page, not decoded; None where the file has fewer. Raises SyntaxError for one of no known kind."""
    try:
        image = TiffImageFile(io.BytesIO(file.data))
        image.seek(number - 1)
    except EOFError:
        return None
    except (SyntaxError, TypeError) as error:
        if "dimensions" in str(error):
            # The list of pages stands at the end of most files, behind the pixels.
            raise truncated(file) from error
        raise
    return image


def _page(file: InputFile, number: int) -> Page | None:
    image = _opened(file, number)
    if image is None:
        return None
    known = image.tag_v2
    wide, high = known[Tag.ImageWidth], known[Tag.ImageLength]
    check_size(file, wide, high, _PIXEL_BYTES)
    x, y = (known.get(tag, 0) for tag in (Tag.XResolution, Tag.YResolution))
    about = tags_of(from_unit(x, y, known.get(Tag.ResolutionUnit, 2)), known.get(Tag.Orientation, 1))
    parts = _parts(file, image)
    damage = _fax_damage(file, image, parts) if image.info["compression"] in _FAX else ()
    # Pillow has turned the picture already.
    grey = np.ascontiguousarray(np.rot90(_grey(image), -about.turn_deg // 90))
    return Page(file.name, number, grey, about.dpi, about.turn_deg, damage=damage, device="scanner")


def _parts(file: InputFile, image: TiffImageFile) -> Parts:
    """The strips or tiles of a page; raises InputFileError for some that are not there, or damaged."""
    known = image.tag_v2
    tiled = Tag.TileOffsets in known
    starts = known.get(Tag.TileOffsets if tiled else Tag.StripOffsets, ())
    lengths = known.get(Tag.TileByteCounts if tiled else Tag.StripByteCounts, ())
    parts = list(zip(starts, lengths, strict=False))
    if any(start + length > len(file.data) for start, length in parts):
        raise truncated(file)
    if len(parts) * _size(image)[0] * _size(image)[1] < known[Tag.ImageWidth] * known[Tag.ImageLength]:
        raise damaged(file, "parts_missing")
    if image.info["compression"] == "jpeg" and image.mode in ("L", "RGB"):
        # libtiff fills what is damaged without a word.
        tables = bytes(known.get(Tag.JPEGTables, b""))[:-2]
        for start, length in parts:
            strip = file.data[start : start + length]
            pictures.decode(file, tables + strip[2:] if tables else strip)
    if image.info["compression"] == "packbits" and not tiled and known.get(Tag.PlanarConfiguration) != 2:
        row_bytes = -(-known[Tag.ImageWidth] * sum(known.get(Tag.BitsPerSample, (1,))) // 8)
        unpacked = sum(_unpacked_bytes(file.data[start : start + length]) for start, length in parts)
        if unpacked != known[Tag.ImageLength] * row_bytes:
            raise damaged(file, "wrong_amount")
    return parts


def _unpacked_bytes(packed: bytes) -> int:
    """Return the bytes that PackBits unpacks to: it has no checksum, and libtiff ignores what is too much."""
    size = at = 0
    while at < len(packed):
        code = packed[at]
        copied = code + 1 if code < 128 else 0
        size += copied or (257 - code) % 129
        at += 1 + (copied or code > 128)
    return size


def _size(image: TiffImageFile) -> tuple[int, int]:
    """Width and height of each tile or strip; the last strip may be lower."""
    known = image.tag_v2
    if Tag.TileOffsets in known:
        return known[Tag.TileWidth], known[Tag.TileLength]
    high = known[Tag.ImageLength]
    return known[Tag.ImageWidth], min(known.get(Tag.RowsPerStrip, high), high)


def _fax_damage(file: InputFile, image: TiffImageFile, parts: Parts) -> tuple[int, ...]:
    """The first and last damaged row of a fax; empty where all are whole."""
    known, kind = image.tag_v2, image.info["compression"]
    k = -1 if kind == "group4" else known.get(Tag.T4Options, 0) & 1
    coding = Coding(k, aligned=kind == "tiff_ccitt")
    width, rows = _size(image)
    across, high = -(-known[Tag.ImageWidth] // width), known[Tag.ImageLength]
    for index, (start, length) in enumerate(parts):
        data = file.data[start : start + length]
        if known.get(Tag.FillOrder) == 2:
            data = data.translate(_REVERSED)
        first = index // across * rows
        count = rows if Tag.TileOffsets in known else min(rows, high - first)
        row = damaged_row(data, width, count, coding)
        if row is not None:
            return first + row + 1, first + count
    return ()


def _grey(image: TiffImageFile) -> GreyImage:
    white_is_zero = image.tag_v2.get(Tag.PhotometricInterpretation) == 0
    if image.mode in ("P", "PA"):
        return from_pillow(image)
    pixels = np.array(image)
    if image.mode == "CMYK":
        return of_four_inks(pixels)
    if image.mode.startswith("I;16"):
        pixels = pixels.astype(np.uint16)
        pixels = ~pixels if white_is_zero else pixels
    return to_grey(pixels[..., :3] if image.mode == "RGBX" else pixels, rgb=True)


def _count(file: InputFile) -> int:
    image, pages = _opened(file, 1), 1
    while image is not None and pages <= MAX_PAGES:
        # A page that cannot be read is told when it is asked for.
        with contextlib.suppress(SyntaxError, TypeError, ValueError, KeyError, OSError, struct.error):
            try:
                image.seek(pages)
            except EOFError:
                break
        pages += 1
    check_pages(file, pages)
    return pages


TIFF = Door(_page, _count)
