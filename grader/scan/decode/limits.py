"""Input files: read once, their kind known by their first bytes, their size and memory limited.

Sizes are checked before pixels are made. The memory of a page is that of the file, of the pixels as decoded,
and of their grey. What still takes too long, such as a PDF page of endless drawing commands, ends its worker.

Codes of `InputFileError` raised in this package:

| code | meaning |
|---|---|
| file_missing | no such file, or it cannot be opened |
| file_empty | 0 bytes |
| file_too_large | more bytes than the scans of one class can need |
| file_changed | the file was written to while it was read |
| file_type_unsupported | neither JPEG, PNG, TIFF, HEIC nor PDF, whatever its name says |
| heic_unreadable | HEIC, which is read with the extra `heic` |
| image_truncated | the file ends before the image does |
| image_damaged | the image cannot be decoded |
| image_too_large | more pixels, or more memory for them, than a sheet can need |
| image_too_small | a page too small or too narrow to be a drawing |
| pdf_encrypted | a PDF that asks for a password |
| pdf_damaged | a PDF that cannot be opened or has no pages, or a page of it that cannot be read |
| pages_too_many | more pages than one class can need |
"""

import hashlib
import os
import stat
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from grader.files import shown_text
from grader.records import Page
from reference.errors import InputFileError

MAX_FILE_BYTES = 800_000_000
"""A class of 50 scanned on both sides in colour has 500 MB; all of a file is held in memory."""
MAX_PIXELS = 178_000_000
"""A2 at 600 dpi is 139 million pixels; Pillow opens no image of more than 178."""
MAX_MEMORY_BYTES = 1_100_000_000
"""File, decoded pixels and grey of one page: leaves 400 MB of a worker's 1.5 GB to the program itself."""
MAX_PAGES = 2000
"""A class of 200 with five sheets each, scanned on both sides."""
_LEAST_SIDE_PX = 100
"""A sheet's short side at 9 dpi: no stroke can be read of less."""
_LEAST_SHARE = 0.1
"""Short side by long side; paper has 0.7, a crop of one figure at least 0.3."""

_MAGIC = {
    b"\xff\xd8\xff": "jpeg",
    b"\x89PNG\r\n\x1a\n": "png",
    b"II*\x00": "tiff",
    b"MM\x00*": "tiff",
    b"II+\x00": "tiff",
}
_HEIC = frozenset({b"heic", b"heix", b"heim", b"heis", b"mif1"})
"""Brands of a still picture, behind the length and the type of a file's first box (ISO/IEC 23008-12)."""
_PDF_HEADER_WITHIN = 1024
"""Readers accept junk before `%PDF-`, so copiers that write some are let in."""
_NO_WAIT = getattr(os, "O_NONBLOCK", 0) | getattr(os, "O_BINARY", 0)
"""Not every system knows both."""
SUFFIXES = {
    ".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG", ".tif": "TIFF", ".tiff": "TIFF", ".heic": "HEIC",
    ".heif": "HEIC", ".pdf": "PDF",
}  # fmt: skip
"""The kinds of files by the endings of their names."""


@dataclass(frozen=True, slots=True)
class InputFile:
    """A file as it was read, once: the bytes that are decoded are those of the digest.

    Attributes
    ----------
    name : without its folder
    digest : SHA-256 of `data`, hexadecimal
    """

    name: str
    data: bytes = field(repr=False)
    digest: str


def load(path: Path | str, shown: str = "") -> InputFile:
    """A file's content.

    Arguments: `shown` is what people call it, where that is not its own name.

    Raises InputFileError (`file_missing`, `file_empty`, `file_too_large`, `file_changed`).
    """
    path = Path(path)
    name = PurePath(shown).name or shown_text(path.name)
    try:
        data = _content(path, name)
    except OSError as error:
        raise InputFileError("file_missing", error=error.strerror or str(error), file=name) from error
    if not data:
        raise InputFileError("file_empty", file=name)
    return InputFile(name, data, hashlib.sha256(data).hexdigest())


def _content(path: Path, name: str) -> bytes:
    """All bytes of a regular file. A pipe or device is not read: it may never say anything, or end."""
    if path.exists() and not path.is_file():
        raise InputFileError("file_missing", why="no_regular_file", file=name)
    # Should a pipe take the file's place meanwhile, opening it must not wait for a writer.
    with os.fdopen(os.open(path, os.O_RDONLY | _NO_WAIT), "rb") as file:
        status = os.fstat(file.fileno())
        if not stat.S_ISREG(status.st_mode):
            raise InputFileError("file_missing", why="no_regular_file", file=name)
        if status.st_size > MAX_FILE_BYTES:
            size, most = status.st_size // 1_000_000, MAX_FILE_BYTES // 1_000_000
            raise InputFileError("file_too_large", size=size, most=most, file=name)
        data = file.read(status.st_size + 1)
    if len(data) != status.st_size:
        raise changed(name)
    return data


def changed(name: str) -> InputFileError:
    """The error for a file whose content is not what it was when the folder was read."""
    return InputFileError("file_changed", file=name)


@dataclass(frozen=True, slots=True)
class Door:
    """The functions that read one kind of file.

    Attributes
    ----------
    page : a page by its number from 1; None where the file has fewer
    count : number of pages, without decoding them
    code : of the error for a page that the libraries cannot read
    """

    page: Callable[[InputFile, int], Page | None]
    count: Callable[[InputFile], int] = lambda _: 1
    code: str = "image_damaged"


def kind_of(file: InputFile) -> str:
    """`jpeg`, `png`, `tiff`, `heic` or `pdf`, by content; raises InputFileError for anything else."""
    for magic, kind in _MAGIC.items():
        if file.data.startswith(magic):
            return kind
    if file.data[4:8] == b"ftyp" and file.data[8:12] in _HEIC:
        return "heic"
    if b"%PDF-" in file.data[:_PDF_HEADER_WITHIN]:
        return "pdf"
    suffix = Path(file.name).suffix
    named = SUFFIXES.get(suffix.lower())
    known = {"suffix": suffix, "kind": named} if named else {}
    raise InputFileError("file_type_unsupported", file=file.name, **known)


def check_size(file: InputFile, width: int, height: int, pixel_bytes: int = 0) -> None:
    """Raise InputFileError for a page that cannot be a drawing by its width and height in pixels.

    Arguments: decoding a pixel needs so many bytes besides the file and its grey; see `check_memory`.
    """
    check_memory(file, width * height, width * height * pixel_bytes)
    if min(width, height) < max(_LEAST_SIDE_PX, _LEAST_SHARE * max(width, height)):
        raise InputFileError("image_too_small", wide=width, high=height, file=file.name)


def check_memory(file: InputFile, pixels: int, decoded_bytes: int) -> None:
    """Raise InputFileError for an image without pixels, with too many, or with too many bytes for them.

    Arguments: what decoding needs besides the file and its grey is `decoded_bytes`.
    """
    if pixels <= 0:
        raise damaged(file, "no_pixels")
    if pixels > MAX_PIXELS or len(file.data) + decoded_bytes + pixels > MAX_MEMORY_BYTES:
        millions, unpacked = round(pixels / 1e6), round(decoded_bytes / 1e6)
        raise InputFileError("image_too_large", millions=millions, unpacked=unpacked, file=file.name)


def check_pages(file: InputFile, pages: int) -> None:
    """Raise InputFileError for a document of too many pages."""
    if pages > MAX_PAGES:
        raise InputFileError("pages_too_many", pages=pages, most=MAX_PAGES, file=file.name)


def damaged(file: InputFile, why: str) -> InputFileError:
    """The error for an image that cannot be decoded, with the code of the reason."""
    return InputFileError("image_damaged", why=why, file=file.name)


def truncated(file: InputFile) -> InputFileError:
    """The error for an image whose data end too early."""
    return InputFileError("image_truncated", file=file.name)
