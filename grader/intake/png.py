"""PNG files: one page."""

import struct
import zlib

import cv2
import numpy as np

from grader.intake.grey import to_grey
from grader.intake.limits import Door, InputFile, check_memory, check_size, damaged, truncated
from grader.intake.tags import Tags, tags_within
from grader.records import Page

_SIGNATURE = b"\x89PNG\r\n\x1a\n"
_HEADER, _FRAME = struct.Struct(">IIBBxxx"), struct.Struct(">I4s")
_PIXELS, _END = (b"IHDR", b"PLTE", b"tRNS", b"IDAT"), b"IEND"
_DESCRIPTION = (b"pHYs", b"eXIf", b"tEXt", b"zTXt", b"iTXt")
_MAX_DESCRIPTION = 8_000_000
"""Bytes of resolution, EXIF and texts; a phone's EXIF with its thumbnail has 0.1 MB."""
_MAX_CHUNKS = 200_000
"""Some writers store 8 kB a chunk: a picture of 1 GB has 130,000."""
_CHANNELS = {0: 1, 2: 3, 3: 4, 4: 4, 6: 4}
"""As decoded, by the type of colour: palettes and grey with alpha come as four."""
_MAX_RATIO = 1040
"""Deflation packs at most 1032 bytes in one; the rest is for headers."""

Chunks = list[tuple[bytes, bytes]]


def _page(file: InputFile, number: int) -> Page | None:
    if number > 1:
        return None
    chunks = _chunks(file)
    if not chunks or chunks[0][0] != b"IHDR" or len(chunks[0][1]) != _HEADER.size:
        raise damaged(file, 1, "its header cannot be read")
    wide, high, bits, colour = _HEADER.unpack(chunks[0][1])
    if colour not in _CHANNELS or bits not in {1, 2, 4, 8, 16}:
        raise damaged(file, 1, "its header cannot be read")
    check_memory(file, 1, wide * high, wide * high * _CHANNELS[colour] * max(bits // 8, 1))
    check_size(file, 1, wide, high)
    packed = sum(len(data) for name, data in chunks if name == b"IDAT")
    if wide * high * bits // 8 > packed * _MAX_RATIO:
        raise truncated(file, 1)
    tags = _tags(file, chunks)
    # Profiles, texts and the frames of an animation never reach the decoder: they could unpack to anything.
    stored = np.frombuffer(_written([one for one in chunks if one[0] in _PIXELS]), dtype=np.uint8)
    pixels = cv2.imdecode(stored, cv2.IMREAD_UNCHANGED)
    if pixels is None:
        raise damaged(file, 1, "it cannot be decoded")
    return Page(file.name, 1, tags.unmirrored(to_grey(pixels)), tags.dpi, tags.turn_deg)


def _chunks(file: InputFile) -> Chunks:
    """Names and contents up to the end; raises InputFileError where one is cut off or its sum is wrong."""
    chunks: Chunks = []
    view, at = memoryview(file.data), len(_SIGNATURE)
    while len(chunks) < _MAX_CHUNKS:
        if at + _FRAME.size + 4 > len(view):
            raise truncated(file, 1)
        length, name = _FRAME.unpack_from(view, at)
        end = at + _FRAME.size + length
        if end + 4 > len(view):
            raise truncated(file, 1)
        if zlib.crc32(view[at + 4 : end]) != int.from_bytes(view[end : end + 4], "big"):
            raise damaged(file, 1, f"the checksum of its part {name!r} is wrong")
        if name == _END:
            return chunks
        chunks.append((name, bytes(view[at + _FRAME.size : end])))
        at = end + 4
    raise damaged(file, 1, f"it has more than {_MAX_CHUNKS} parts")


def _written(chunks: Chunks) -> bytes:
    """A PNG file of some chunks."""
    parts = [_SIGNATURE]
    for name, data in (*chunks, (_END, b"")):
        parts += [_FRAME.pack(len(data), name), data, zlib.crc32(data, zlib.crc32(name)).to_bytes(4, "big")]
    return b"".join(parts)


def _tags(file: InputFile, chunks: Chunks) -> Tags:
    """Resolution and orientation: those of one white pixel with the picture's description."""
    described = [one for one in chunks if one[0] in _DESCRIPTION]
    if sum(len(data) for _, data in described) > _MAX_DESCRIPTION:
        raise damaged(file, 1, f"its texts are longer than {_MAX_DESCRIPTION // 1_000_000} MB")
    header = (b"IHDR", _HEADER.pack(1, 1, 8, 0))
    described_pixel = _written([header, *described, (b"IDAT", zlib.compress(b"\0\xff"))])
    return tags_within(described_pixel)


DOOR = Door(_page)
