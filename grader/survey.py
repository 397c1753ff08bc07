"""What a folder holds, before anything is marked: files, pages, blank backs, QR codes, measurements."""

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

from grader.documents import UnmatchedDocument
from grader.intake import count_pages, is_blank, page_of
from grader.measurements import Measurements, Names, read_measurements, students_in
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
    students : whom such a file names in itself
    digest : of the content of a file with pages
    """

    pages: tuple[PageSource, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    broken: Mapping[PageSource, str] = field(default_factory=dict)
    refused: UnmatchedDocument | None = None
    digest: str = ""
    students: tuple[str, ...] = ()


def survey(path: Path, name: str, names: Names) -> Survey:
    """Look at one file; `name` is its path as the user knows it. Never raises for a bad file."""
    try:
        if path.suffix.lower() in MEASUREMENT_TYPES:
            return Survey(measurements=read_measurements(path, names, name))
        count = count_pages(path)
    except InputFileError as error:
        if path.suffix.lower() in MEASUREMENT_TYPES:
            refused = UnmatchedDocument(file=name, code=error.code, message=error.message)
            return Survey(refused=refused, students=students_in(path))
        page = PageSource(name, 1, 1)
        return Survey(pages=(page,), broken={page: error.message})
    found = [_look(path, PageSource(name, number, count)) for number in range(1, count + 1)]
    broken = {source: told for source, told in found if told is not None}
    return Survey(pages=tuple(source for source, _ in found), broken=broken)


def _look(path: Path, source: PageSource) -> tuple[PageSource, str | None]:
    """What is seen on one page, or why it cannot be decoded."""
    try:
        page = page_of(path, source.page)
    except InputFileError as error:
        return source, error.message
    blank = is_blank(page)
    return replace(source, blank=blank, identity=None if blank else whose(page)), None
