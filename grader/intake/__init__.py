"""Files to pages: JPEG, PNG, TIFF and PDF, one page at a time, as grey pixels as stored.

Pixels are never turned here: the turn that a file asks for (EXIF, PDF) travels beside them.
What cannot be used raises `InputFileError` with a stable code and a message for people.
"""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from pathlib import Path

from grader.intake import jpeg, pdf, png, tiff
from grader.intake.blank import is_blank
from grader.intake.limits import Door, InputFile, changed, kind_of, load
from grader.records import Page, PageRef
from reference.errors import InputFileError

__all__ = ["InputFile", "count_pages", "decode", "is_blank", "load", "page_of", "pages_of"]

_DOORS: dict[str, Door] = {"jpeg": jpeg.DOOR, "png": png.DOOR, "tiff": tiff.DOOR, "pdf": pdf.DOOR}


def pages_of(source: InputFile | Path | str) -> Iterator[Page]:
    """Pages of a file, decoded one at a time as they are asked for.

    Raises
    ------
    InputFileError
        at the first `next` for a file that cannot be used at all; at a later one for a page that is
        damaged. The codes are those of `grader.intake.limits`.
    """
    file = _loaded(source)
    for number in range(1, count_pages(file) + 1):
        yield page_of(file, number)


def page_of(source: InputFile | Path | str, number: int) -> Page:
    """One page of a file, from 1, decoding no other. Raises as `pages_of`, and for a number too high."""
    file = _loaded(source)
    door = _DOORS[kind_of(file)]
    with _as_input_error(file, door, number):
        page = door.page(file, number)
    if page is None:
        raise InputFileError(
            "page_missing", f"{file.name}: there is no page {number}; it has {count_pages(file)}"
        )
    return page


def decode(ref: PageRef) -> Page:
    """The page's pixels. Raises as `pages_of`, and where the file is not what it was when it was listed."""
    file = load(ref.path)
    if ref.digest and ref.digest != file.digest:
        raise changed(ref.file)
    return replace(page_of(file, ref.page), source=ref.file)


def count_pages(source: InputFile | Path | str) -> int:
    """Number of pages, found without decoding them. Raises as `pages_of` does."""
    file = _loaded(source)
    door = _DOORS[kind_of(file)]
    with _as_input_error(file, door, 1):
        return door.count(file)


def _loaded(source: InputFile | Path | str) -> InputFile:
    return source if isinstance(source, InputFile) else load(source)


@contextmanager
def _as_input_error(file: InputFile, door: Door, number: int) -> Iterator[None]:
    """Any error of a library becomes an InputFileError of the page; want of memory stays a MemoryError."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            yield
    except (InputFileError, MemoryError):
        raise
    except Exception as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        if "insufficient memory" in reason.lower():  # OpenCV and libjpeg say it in words
            raise MemoryError(reason) from error
        raise InputFileError(
            door.code,
            f"{file.name}, page {number}: the {door.noun} is damaged ({reason}); scan or export it again",
        ) from error
