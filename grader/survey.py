"""What a folder holds, before anything is marked: files, pages, blank backs, QR codes, measurements."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.documents import UnmatchedDocument
from grader.intake import InputFile, count_pages, is_blank, load, page_of
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
    broken : why a page cannot be decoded, by its source
    refused : a measurement file that cannot be used at all
    digest : of the content of a file with pages
    """

    pages: tuple[PageSource, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    broken: Mapping[PageSource, str] = field(default_factory=dict)
    refused: UnmatchedDocument | None = None
    digest: str = ""


def survey(path: Path, name: str, names: Names) -> Survey:
    """Look at one file; `name` is its path as the user knows it. Never raises for a bad file."""
    if path.suffix.lower() not in MEASUREMENT_TYPES:
        try:
            return survey_pages(load(path), name)
        except InputFileError as error:
            return refused(error, name)
    try:
        return Survey(measurements=read_measurements(path, names))
    except InputFileError as error:
        return Survey(refused=UnmatchedDocument(file=name, code=error.code, message=error.message))


def survey_pages(file: InputFile, name: str) -> Survey:
    """All pages of one file, with the digest of the bytes that they were decoded from."""
    try:
        count = count_pages(file)
    except InputFileError as error:
        return replace(refused(error, name), digest=file.digest)
    found = [_look(file, PageSource(name, number, count)) for number in range(1, count + 1)]
    broken = {source: told for source, told in found if told is not None}
    return Survey(pages=tuple(source for source, _ in found), broken=broken, digest=file.digest)


def refused(error: InputFileError, name: str) -> Survey:
    """A file that cannot be used at all: one page that cannot be decoded, so that its owner is told."""
    page = PageSource(name, 1, 1)
    return Survey(pages=(page,), broken={page: error.message})


def _look(file: InputFile, source: PageSource) -> tuple[PageSource, str | None]:
    """What is seen on one page, or why it cannot be decoded."""
    try:
        page = page_of(file, source.page)
    except InputFileError as error:
        return source, error.message
    # Rows that a decoder has filled with white are not blank.
    blank = is_blank(page) and not page.damage
    return replace(source, blank=blank, identity=None if blank else whose(page)), None
