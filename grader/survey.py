"""What a folder holds, before anything is marked: files, pages, blank backs, QR codes, measurements.

Each file is opened and each page is scanned in a worker: a page that ends its worker is that page's
problem alone. What an earlier run found on a page of the same content is not looked for again.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader.documents import UnmatchedDocument
from grader.folder import told_name
from grader.intake import count_pages, load
from grader.kept import PageCache
from grader.measurements import Measurements, Names, read_measurements, students_in
from grader.records import PageRef, Problem
from grader.workers import Pool
from reference.errors import InputFileError

MEASUREMENT_TYPES = {".csv", ".json"}
Progress = Callable[[str, int, int], None]
"""Called with what is being done, how many are done, and of how many."""


@dataclass(frozen=True, slots=True)
class FileContent:
    """What was found in one file.

    Attributes
    ----------
    pages : also those that cannot be decoded, so that their owner is told
    measurements : of a measurement file
    refused : a measurement file that cannot be used at all
    students : whom such a file names in itself
    """

    pages: tuple[PageRef, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    refused: UnmatchedDocument | None = None
    students: tuple[str, ...] = ()


def survey_folder(
    files: Sequence[Path], folder: Path, names: Names, workers: Pool, progress: Progress, cache: PageCache
) -> list[FileContent]:
    """What each of a folder's files holds; never raises for a bad file.

    Arguments: `cache` takes the pages as scanned; pages that are not there any more are dropped from it.
    """
    contents = [FileContent()] * len(files)
    calls = [(path, told_name(path, folder), names) for path in files]
    for done, (index, result) in enumerate(workers.run(open_file, calls), start=1):
        contents[index] = _failed(calls[index][1], result) if isinstance(result, Problem) else result
        progress("opening", done, len(calls))
    waiting = [
        (index, page) for index, content in enumerate(contents) for page in content.pages if not page.problem
    ]
    pages = {
        index: [page for page in content.pages if page.problem] for index, content in enumerate(contents)
    }
    scans = workers.run(identify_page, [(cache, page) for _, page in waiting])
    for done, (number, page) in enumerate(scans, start=1):
        index, ref = waiting[number]
        pages[index].append(
            replace(ref, problem=replace(page, file=ref.file)) if isinstance(page, Problem) else page
        )
        progress("looking", done, len(waiting))
    contents = [
        replace(content, pages=tuple(sorted(pages[index], key=lambda page: page.page)))
        for index, content in enumerate(contents)
    ]
    cache.drop_others(page for content in contents for page in content.pages)
    return contents


def open_file(path: Path, name: str, names: Names) -> FileContent:
    """A measurement file's content, or a file's pages, counted. Raises InputFileError."""
    if path.suffix.lower() in MEASUREMENT_TYPES:
        try:
            return FileContent(measurements=read_measurements(path, names, name))
        except InputFileError as error:
            refused = UnmatchedDocument(file=name, code=error.code, message=error.message)
            return FileContent(refused=refused, students=students_in(path))
    file = load(path)
    count = count_pages(file)
    return FileContent(
        tuple(PageRef(name, page, count, digest=file.digest, path=path) for page in range(1, count + 1))
    )


def identify_page(cache: PageCache, page: PageRef) -> PageRef:
    """A page with what is on it: blank, or whose by its QR code."""
    return cache.identified(page)


def _failed(name: str, problem: Problem) -> FileContent:
    """What is known of a file that could not be opened: it is there, and why."""
    if Path(name).suffix.lower() in MEASUREMENT_TYPES:
        return FileContent(refused=UnmatchedDocument(file=name, code=problem.code, message=problem.message))
    return FileContent((PageRef(name, problem=replace(problem, file=name)),))
