"""Files to pages: JPEG, PNG, TIFF and PDF, one page at a time, as grey pixels as stored.

Pixels are never turned here: the turn that a file asks for (EXIF, PDF) travels beside them.
What cannot be used raises `InputFileError` with a stable code and a message for people.
"""

from collections.abc import Iterator
from pathlib import Path

from grader.intake import jpeg, pdf, png, tiff
from grader.intake.blank import is_blank
from grader.intake.limits import Door, kind_of
from grader.records import Page
from reference.errors import InputFileError

__all__ = ["count_pages", "is_blank", "page_of", "pages_of"]

_DOORS: dict[str, Door] = {"jpeg": jpeg.DOOR, "png": png.DOOR, "tiff": tiff.DOOR, "pdf": pdf.DOOR}


def pages_of(path: Path | str) -> Iterator[Page]:
    """Pages of a file, decoded one at a time as they are asked for.

    Raises
    ------
    InputFileError
        at the first `next` for a file that cannot be used at all; at a later one for a page that is
        damaged. The codes are those of `grader.intake.limits`.
    """
    file = Path(path)
    yield from _DOORS[kind_of(file)].pages(file, 1)


def page_of(path: Path | str, number: int) -> Page:
    """One page of a file, from 1, decoding no other. Raises as `pages_of`, and for a number too high."""
    file = Path(path)
    page = next(_DOORS[kind_of(file)].pages(file, number), None)
    if page is None:
        raise InputFileError(
            "page_missing", f"{file.name}: there is no page {number}; it has {count_pages(file)}"
        )
    return page


def count_pages(path: Path | str) -> int:
    """Number of pages, found without decoding them. Raises as `pages_of` does."""
    file = Path(path)
    return _DOORS[kind_of(file)].count(file)
