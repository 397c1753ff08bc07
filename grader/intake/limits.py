"""What is let in: kinds of file told by their first bytes, and bounds on their size.

Codes of `InputFileError` raised in this package:

| code | meaning |
|---|---|
| file_missing | no such file, or it cannot be opened |
| file_empty | 0 bytes |
| file_type_unsupported | neither JPEG, PNG, TIFF nor PDF, whatever its name says |
| image_truncated | the file ends before the image does |
| image_damaged | the image cannot be decoded |
| image_too_large | more pixels than a sheet can need |
| pdf_encrypted | a PDF that asks for a password |
| pdf_damaged | a PDF that cannot be opened |
| pdf_too_heavy | a page whose drawing commands are more than a drawing can have |
| pages_none | a document without pages |
| pages_too_many | more pages than one class can need |
"""

import errno
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.records import Page
from reference.errors import InputFileError

MAX_PIXELS = 220_000_000
"""A2 at 600 dpi is 139 million pixels; a decompression bomb is more."""
MAX_PAGES = 2000

_MAGIC = {
    b"\xff\xd8\xff": "jpeg",
    b"\x89PNG\r\n\x1a\n": "png",
    b"II*\x00": "tiff",
    b"MM\x00*": "tiff",
    b"II+\x00": "tiff",
    b"MM\x00+": "tiff",
}
_PDF_HEADER_WITHIN = 1024
"""Readers accept junk before `%PDF-`, so copiers that write some are let in."""
_NAMES = {".jpg": "JPEG", ".jpeg": "JPEG", ".png": "PNG", ".tif": "TIFF", ".tiff": "TIFF", ".pdf": "PDF"}


@dataclass(frozen=True, slots=True)
class Door:
    """How one kind of file is read."""

    pages: Callable[[Path, int], Iterator[Page]]
    """Pages of a file from a number on, counted from 1."""
    count: Callable[[Path], int]


def kind_of(path: Path) -> str:
    """`jpeg`, `png`, `tiff` or `pdf`, by content; raises InputFileError for anything else."""
    try:
        head = _head(path)
    except OSError as error:
        reason = error.strerror or str(error)
        raise InputFileError(
            "file_missing", f"{path.name}: cannot be opened ({reason}); check the path"
        ) from error
    if not head:
        raise InputFileError("file_empty", f"{path.name}: the file is empty (0 bytes); hand it in again")
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    if b"%PDF-" in head:
        return "pdf"
    named = _NAMES.get(path.suffix.lower())
    what = f"named {path.suffix} but is no {named} file" if named else "of a type that is not read"
    raise InputFileError(
        "file_type_unsupported",
        f"{path.name}: {what}; scan or export it as JPEG, PNG, TIFF or PDF",
    )


def _head(path: Path) -> bytes:
    """The first bytes. A pipe or device is not opened: it may never say anything, or never end."""
    if path.exists() and not path.is_file():
        raise OSError(errno.EISDIR, "it is a folder or a pipe, not a file")
    with path.open("rb") as file:
        return file.read(_PDF_HEADER_WITHIN)


def check_size(path: Path, page: int, width: int, height: int) -> None:
    """Raise InputFileError for an image without pixels or with more than a sheet can need."""
    if width <= 0 or height <= 0:
        raise damaged(path, page, "it has no pixels")
    if width * height > MAX_PIXELS:
        raise too_large(path, page)


def too_large(path: Path, page: int) -> InputFileError:
    """The error for an image of more pixels than a sheet can need."""
    return InputFileError(
        "image_too_large",
        f"{path.name}, page {page}: more than {MAX_PIXELS // 1_000_000} million pixels; "
        "scan A3 at 600 dpi or less",
    )


def check_pages(path: Path, pages: int) -> None:
    """Raise InputFileError for a document of no page or of too many."""
    if pages < 1:
        raise InputFileError("pages_none", f"{path.name}: the document has no pages; export it again")
    if pages > MAX_PAGES:
        raise InputFileError(
            "pages_too_many", f"{path.name}: {pages} pages, more than {MAX_PAGES}; split the file"
        )


def damaged(path: Path, page: int, why: str) -> InputFileError:
    """The error for an image that cannot be decoded."""
    return InputFileError(
        "image_damaged", f"{path.name}, page {page}: the image is damaged ({why}); scan or export it again"
    )


def truncated(path: Path, page: int) -> InputFileError:
    """The error for an image whose data end too early."""
    return InputFileError(
        "image_truncated",
        f"{path.name}, page {page}: the image is cut off before its end; copy or upload the file again",
    )
