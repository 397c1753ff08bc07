"""What a folder holds, before anything is marked: files, pages, blank backs, QR codes, measurements.

Each file is opened and each page is decoded in a worker: a page that ends its worker is that page's
problem alone. What an earlier run found in a file of the same content is not looked for again.
"""

import json
from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader.documents import UnmatchedDocument
from grader.files import write_whole
from grader.folder import told_name
from grader.intake import changed, count_pages, is_blank, load, page_of
from grader.kept import code_version, packed, unpacked
from grader.measurements import Measurements, Names, read_measurements, students_in
from grader.ownership import PageSource
from grader.records import Problem
from grader.sheet import whose
from grader.workers import Pool
from reference.errors import InputFileError

MEASUREMENT_TYPES = {".csv", ".json"}
Progress = Callable[[str, int, int], None]
"""Called with what is being done, how many are done, and of how many."""


@dataclass(frozen=True, slots=True)
class Survey:
    """What was found in one file.

    Attributes
    ----------
    pages : a source for each page; a page that cannot be decoded has one too, so that its owner is told
    measurements : of a measurement file
    refused : a measurement file that cannot be used at all
    students : whom such a file names in itself
    is_complete : whether the pages were looked at; otherwise they are only counted
    """

    pages: tuple[PageSource, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    refused: UnmatchedDocument | None = None
    students: tuple[str, ...] = ()
    is_complete: bool = True


def survey_folder(
    files: Sequence[Path], folder: Path, names: Names, workers: Pool, progress: Progress, notes: Path
) -> list[Survey]:
    """What each of a folder's files holds; never raises for a bad file.

    Arguments
    ---------
    notes : folder of what earlier runs found; notes on files that are not there any more are dropped
    """
    surveys: list[Survey] = [Survey()] * len(files)
    calls = [(path, told_name(path, folder), names, notes) for path in files]
    for done, (index, result) in enumerate(workers.run(open_file, calls), start=1):
        surveys[index] = _failed(calls[index][1], result) if isinstance(result, Problem) else result
        progress("opening", done, len(calls))
    waiting = [
        (index, page) for index, found in enumerate(surveys) if not found.is_complete for page in found.pages
    ]
    pages: dict[int, list[PageSource]] = {}
    looks = [(files[index], page) for index, page in waiting]
    for done, (number, view) in enumerate(workers.run(look_at, looks), start=1):
        index, page = waiting[number]
        page = replace(page, problem=replace(view, file=page.file)) if isinstance(view, Problem) else view
        pages.setdefault(index, []).append(page)
        progress("looking", done, len(looks))
    for index, found in pages.items():
        surveys[index] = Survey(tuple(sorted(found, key=lambda page: page.page)))
        _note(notes, surveys[index])
    _forget(notes, {page.digest for found in surveys for page in found.pages})
    return surveys


def open_file(path: Path, name: str, names: Names, notes: Path) -> Survey:
    """A measurement file's content, or a file's pages: as noted by an earlier run, else only counted."""
    if path.suffix.lower() in MEASUREMENT_TYPES:
        return _measured(path, name, names)
    file = load(path)
    known = _noted(notes, name, file.digest)
    if known is not None:
        return known
    count = count_pages(file)
    pages = tuple(PageSource(name, number, count, digest=file.digest) for number in range(1, count + 1))
    return Survey(pages, is_complete=False)


def _measured(path: Path, name: str, names: Names) -> Survey:
    try:
        return Survey(measurements=read_measurements(path, names, name))
    except InputFileError as error:
        refused = UnmatchedDocument(file=name, code=error.code, message=error.message)
        return Survey(refused=refused, students=students_in(path))


def look_at(path: Path, source: PageSource) -> PageSource:
    """A page with what is on it: blank, or whose by its QR code. Raises InputFileError."""
    file = load(path)
    if file.digest != source.digest:
        raise changed(source.file)
    page = page_of(file, source.page)
    # Rows that a decoder has filled with white are not blank.
    blank = is_blank(page) and not page.damage
    return replace(source, blank=blank, identity=None if blank else whose(page))


def _failed(name: str, problem: Problem) -> Survey:
    """What is known of a file that could not be opened: it is there, and why."""
    if Path(name).suffix.lower() in MEASUREMENT_TYPES:
        return Survey(refused=UnmatchedDocument(file=name, code=problem.code, message=problem.message))
    return Survey((PageSource(name, 1, 1, problem=replace(problem, file=name)),))


# Notes --------------------------------------------------------------------------------------------


def _noted(folder: Path, name: str, digest: str) -> Survey | None:
    try:
        note = json.loads((folder / f"{digest}.json").read_bytes())
        if note["code"] != code_version():
            return None
        pages = [(bool(blank), unpacked(identity)) for blank, identity in note["pages"]]
    except (OSError, KeyError, TypeError, ValueError):
        return None
    return Survey(
        tuple(
            PageSource(name, number, len(pages), blank, identity, digest)
            for number, (blank, identity) in enumerate(pages, start=1)
        )
    )


def _note(folder: Path, found: Survey) -> None:
    if not any(page.problem for page in found.pages):
        pages = [[page.blank, packed(page.identity)] for page in found.pages]
        note = json.dumps({"code": code_version(), "pages": pages})
        write_whole(folder / f"{found.pages[0].digest}.json", note)


def _forget(folder: Path, digests: Collection[str]) -> None:
    for note in folder.glob("*.json"):
        if note.stem not in digests:
            note.unlink(missing_ok=True)
