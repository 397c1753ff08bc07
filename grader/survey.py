"""What a folder holds, before anything is marked: files, pages, blank backs, QR codes, measurements."""

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

from grader.documents import UnmatchedDocument
from grader.intake import count_pages, is_blank, page_of
from grader.measurements import Measurements, Names, read_measurements
from grader.ownership import PageSource
from grader.sheet import whose
from reference.errors import InputFileError

MEASUREMENT_TYPES = {".csv", ".json"}


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found in one file.

    Attributes
    ----------
    pages : a source for each page; a page that cannot be decoded has one too, so that its owner is told
    measurements : of a measurement file
    refused : a file that cannot be used at all
    """

    pages: tuple[PageSource, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    refused: UnmatchedDocument | None = None


def survey(path: Path, name: str, names: Names) -> Survey:
    """Look at one file; `name` is its path as the user knows it. Never raises for a bad file."""
    try:
        if path.suffix.lower() in MEASUREMENT_TYPES:
            return Survey(measurements=read_measurements(path, names))
        count = count_pages(path)
    except InputFileError as error:
        page = PageSource(name, 1, 1)
        if path.suffix.lower() in MEASUREMENT_TYPES:
            return Survey(refused=UnmatchedDocument(file=name, code=error.code, message=error.message))
        return Survey(pages=(page,))
    return Survey(pages=tuple(_pages(path, name, count)))


def _pages(path: Path, name: str, count: int) -> Iterator[PageSource]:
    for number in range(1, count + 1):
        try:
            page = page_of(path, number)
        except InputFileError:
            yield PageSource(name, number, count)
            continue
        blank = is_blank(page)
        yield PageSource(name, number, count, blank, None if blank else whose(page))
