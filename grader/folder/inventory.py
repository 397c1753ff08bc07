"""Page inventory: list the pages of a folder before anything is marked.

Files, pages, blank backs, QR codes, measurements; everything but the roster and the files of tools. Each
file is opened and each page is decoded in a worker: a page that ends its worker is that page's problem
alone. A ZIP archive stands for the files in it. The contents of files that an earlier run has read are taken
from the cache.
"""

import json
import os
import re
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path, PurePath
from types import MappingProxyType

from grader.files import Stamp, shown_text, stamp_of, write_whole
from grader.folder import archives
from grader.folder.cache import PageCache, digest_of, packed, unpacked
from grader.folder.changes import CACHE_FOLDER, RUN_NOTE
from grader.folder.workers import ENDED, Pool
from grader.records import PageRef, Reason, of_error
from grader.scan.decode.limits import SUFFIXES, load
from grader.scan.decode.pages import count_pages, decode
from grader.scan.register.registration import register
from grader.tables.measurements import Measurements, Names, read_measurements, students_in
from grader.tables.reader import RESULT_FILES
from reference.errors import InputFileError

# The files handed in ------------------------------------------------------------------------------

_TOOL_NAMES = RESULT_FILES | {"thumbs.db", "desktop.ini", "layout.json", "truth.jsonl"}
_TOOL_STARTS = (".", "~$", "__MACOSX")
_TOOL_ENDS = (".part", ".tmp", ".bak", ".crdownload", ".log", ".toml", "~")
MEASUREMENT_TYPES = (".csv", ".json")
FILE_TYPES = (*SUFFIXES, *MEASUREMENT_TYPES)
"""Endings of the files that students hand in."""
_DIGITS = re.compile(r"(\d+)")


def is_tool_file(name: str) -> bool:
    """Return whether a file's name is one that editors, systems or planmark itself leave behind."""
    lower = name.lower()
    return lower in _TOOL_NAMES or name.startswith(_TOOL_STARTS) or lower.endswith(_TOOL_ENDS)


def submissions(folder: Path, roster: Path | None = None, passed_over: Iterable[Path] = ()) -> list[Path]:
    """The files handed in, at any depth, in natural order (s2 before s10).

    Arguments
    ---------
    roster : the roster's path, which is no submission wherever it lies; a `roster.csv` at the
        folder's top is none either
    passed_over : files and folders that are none, such as the folder of results

    Folders of results of other runs are none either: they hold a run's note, or its results and their table.
    A folder that cannot be opened counts as a file, and so do an empty folder named as one and a link to a
    folder elsewhere: they are reported.
    """
    none = {_real(path) for path in (*passed_over, *([roster] if roster else []), folder / "roster.csv")}
    paths: list[Path] = []
    shut: list[Path] = []
    for where, folders, files in os.walk(folder, onerror=lambda error: shut.append(Path(error.filename))):
        folders[:] = [
            name for name in folders
            if not is_tool_file(name)
            and _real(Path(where) / name) not in none
            and not _holds_results(Path(where) / name)
        ]  # fmt: skip
        for name in files:
            path = Path(where) / name
            if not is_tool_file(name) and _real(path) not in none:
                paths.append(path)
        paths += [
            path for path in (Path(where) / name for name in folders)
            if _named_as_file(path) or (path.is_symlink() and leads_out(path, folder))
        ]  # fmt: skip
    return sorted(paths + shut, key=lambda path: natural_key(path.relative_to(folder).as_posix()))


def shown_name(path: Path, folder: Path) -> str:
    """A file's path in the folder, as messages name it."""
    return shown_text(path.relative_to(folder).as_posix())


def shown_names(paths: Iterable[Path], folder: Path, called: Mapping[Path, str]) -> list[str]:
    """Return the name of each file in messages and tables: as it is `called`, else its path; each once.

    Two names may look the same: their letters are composed or not, or a sign is not shown.
    """
    names: dict[str, None] = {}
    for path in paths:
        name = plain = called.get(path) or shown_name(path, folder)
        number = 1
        while name in names:
            number += 1
            name = f"{PurePath(plain).with_suffix('')} ({number}){PurePath(plain).suffix}"
        names[name] = None
    return list(names)


def leads_out(path: Path, folder: Path) -> bool:
    """Return whether a file is a link to one elsewhere, or lies behind such a link."""
    return not _real(path).is_relative_to(_real(folder))


def _real(path: Path) -> Path:
    """Follow a path's links; links that lead in a circle lead nowhere, and the path stays."""
    return Path(os.path.realpath(path))


def _holds_results(folder: Path) -> bool:
    """Return whether a run has written its results into a folder."""
    is_noted = (folder / CACHE_FOLDER / RUN_NOTE).is_file()
    return is_noted or all((folder / name).is_file() for name in ("results.json", "summary.csv"))


def _named_as_file(folder: Path) -> bool:
    """Return whether an empty folder is named as scans and measurements are."""
    try:
        return folder.suffix.lower() in FILE_TYPES and next(folder.iterdir(), None) is None
    except OSError:
        return False


def natural_key(name: str) -> tuple[tuple[int, int | str], ...]:
    """Sorts digits as numbers, letters without regard to case."""
    parts = (part for part in _DIGITS.split(name.lower()) if part)
    return tuple((0, int(part)) if part.isascii() and part.isdigit() else (1, part) for part in parts)


# What is in them ----------------------------------------------------------------------------------

Progress = Callable[[str, int, int], None]
"""Called with what is being done, how many are done, and of how many."""


@dataclass(frozen=True, slots=True)
class FileContent:
    """The content of one file.

    Attributes
    ----------
    pages : also those that cannot be decoded: they belong to somebody
    measurements : of a measurement file
    refused : a measurement file that cannot be used at all
    students : whom such a file names in itself
    """

    pages: tuple[PageRef, ...] = ()
    measurements: tuple[Measurements, ...] = ()
    refused: Reason | None = None
    students: tuple[str, ...] = ()


def take_inventory(  # noqa: PLR0913, PLR0917 - what a folder is read with
    files: Sequence[Path],
    folder: Path,
    names: Names,
    workers: Pool,
    progress: Progress,
    cache: PageCache,
    place: Callable[[Sequence[PageRef]], Sequence[PageRef]] = tuple,
    called: Mapping[Path, str] = MappingProxyType({}),
) -> list[FileContent]:
    """Return the content of each of a folder's files, or of the files in it; never raises for a bad one.

    Arguments
    ---------
    cache : takes the pages as scanned; pages that are not there any more are dropped from it
    place : all pages with the turns and corners that people gave, in the same order
    called : what people call files that are stored under other names
    """
    own = {path for path in files if not archives.is_archive(path)}
    files, called, refused = _with_unpacked(files, folder, cache, workers, called)
    shown = shown_names(files, folder, called)
    stamps = [stamp_of(path) for path in files]
    noted = _noted(cache)
    contents = [FileContent()] * len(files)
    anew: list[int] = []
    for index, (name, stamp) in enumerate(zip(shown, stamps, strict=True)):
        known = noted.get(name)
        if files[index] in refused:
            contents[index] = _failed(name, refused[files[index]])
        elif files[index] in own and leads_out(files[index], folder):
            contents[index] = _failed(name, Reason("link_leads_out"))
        elif known is not None and stamp is not None and known.stamp == stamp:
            contents[index] = FileContent(tuple(replace(page, path=files[index]) for page in known.pages))
        else:
            anew.append(index)
    progress("opening", len(files) - len(anew), len(files))
    opened = workers.run(open_file, [(files[index], shown[index], names) for index in anew])
    for done, (number, result) in enumerate(opened, start=len(files) - len(anew) + 1):
        index = anew[number]
        contents[index] = _failed(shown[index], result) if isinstance(result, Reason) else result
        progress("opening", done, len(files))
    pages = [list(content.pages) for content in contents]
    waiting = [(index, at) for index in anew for at, page in enumerate(pages[index]) if not page.problem]
    total = sum(map(len, pages))
    if total:
        progress("looking", total - len(waiting), total)
    scans = workers.run(identify_page, [(cache, pages[index][at]) for index, at in waiting])
    for done, (number, found) in enumerate(scans, start=total - len(waiting) + 1):
        index, at = waiting[number]
        ref = pages[index][at]
        pages[index][at] = _with_problem(ref, found, workers) if isinstance(found, Reason) else found
        progress("looking", done, total)
    scanned = [page for several in pages for page in several]
    _note(cache, files, dict(zip(shown, map(Noted, stamps, map(tuple, pages)), strict=True)))
    placed = iter(place(scanned))
    contents = [
        replace(content, pages=tuple(next(placed) for _ in several))
        for content, several in zip(contents, pages, strict=True)
    ]
    cache.drop_others([*scanned, *(page for content in contents for page in content.pages)])
    return contents


def _with_unpacked(
    files: Sequence[Path], folder: Path, cache: PageCache, workers: Pool, called: Mapping[Path, str]
) -> tuple[list[Path], Mapping[Path, str], dict[Path, Reason]]:
    """Return the files, of archives those in them, their names, and what could not be unpacked."""
    into = cache.folder.with_name("unpacked")
    packed_files = [path for path in files if archives.is_archive(path) and not leads_out(path, folder)]
    folders = {path: into / digest_of(shown_name(path, folder)) for path in packed_files}
    known = {path: archives.unpacked(path, folders[path]) for path in packed_files}
    waiting = [path for path in packed_files if known[path] is None]
    stamps = {path: stamp_of(path) for path in waiting}
    for index, found in workers.run(archives.unpack, [(path, folders[path]) for path in waiting]):
        path = waiting[index]
        known[path] = [("", found)] if isinstance(found, Reason) else found
        archives.note_unpacked(stamps[path], folders[path], known[path] or [])
    archives.drop_others(into, {*folders.values()})
    result, names, refused = list[Path](), dict(called), dict[Path, Reason]()
    for path in files:
        for name, file in known.get(path) or [("", "")]:
            place = path
            if path in folders:
                place = folders[path] / (file if isinstance(file, str) else str(len(result)))
            names[place] = f"{called.get(path) or shown_name(path, folder)}/{name}".rstrip("/")
            result.append(place)
            if isinstance(file, Reason):
                refused[place] = file
    return result, names, refused


# Files as they were at the last run -----------------------------------------------------------------

FILE_NOTES = "files.json"
_SETTLED_NS = 2_000_000_000
"""A file changed more lately may change again without another time: the coarsest clock of a file system."""


@dataclass(frozen=True, slots=True)
class Noted:
    """A file as it was when its pages were looked at."""

    stamp: Stamp | None
    pages: tuple[PageRef, ...]


def _noted(cache: PageCache) -> dict[str, Noted]:
    """Return the last run's note on each file, by its name; empty if another program wrote it."""
    key, known = _notes(cache.folder.parent)
    return known if key == cache.key else {}


def noted_pages(folder: Path) -> dict[str, tuple[PageRef, ...]]:
    """Return the pages of each file as the last run saw them, with their codes; `folder` has its notes."""
    return {name: noted.pages for name, noted in _notes(folder)[1].items()}


def _notes(folder: Path) -> tuple[str, dict[str, Noted]]:
    """Return the key of the program that wrote the notes, and those on each file."""
    try:
        key, files = json.loads((folder / FILE_NOTES).read_bytes())
        return key, {name: Noted(tuple(stamp), unpacked(pages, ())) for name, (stamp, pages) in files.items()}
    except (OSError, KeyError, TypeError, ValueError):
        return "", {}


def _note(cache: PageCache, files: Sequence[Path], seen: Mapping[str, Noted]) -> None:
    """Note the pages of all files that did not change while they were read, and have no problem."""
    now = time.time_ns()
    settled = {
        name: (noted.stamp, packed([replace(page, path=Path()) for page in noted.pages], []))
        for path, (name, noted) in zip(files, seen.items(), strict=True)
        if noted.stamp is not None
        and noted.pages
        and not any(page.problem for page in noted.pages)
        and now - max(noted.stamp[1:3]) > _SETTLED_NS
        and noted.stamp == stamp_of(path)
    }
    write_whole(cache.folder.parent / FILE_NOTES, json.dumps((cache.key, settled)))


# Opening -------------------------------------------------------------------------------------------


def open_file(path: Path, name: str, names: Names) -> FileContent:
    """A measurement file's content, or a file's pages, counted. Raises InputFileError."""
    if path.suffix.lower() in MEASUREMENT_TYPES:
        try:
            return FileContent(measurements=read_measurements(path, names, name))
        except InputFileError as error:
            return FileContent(refused=of_error(error, name), students=students_in(path))
    file = load(path, name)
    count = count_pages(file)
    return FileContent(
        tuple(PageRef(name, page, count, digest=file.digest, path=path) for page in range(1, count + 1))
    )


def identify_page(cache: PageCache, page: PageRef) -> PageRef:
    """A page with what is on it: blank, or whose by its QR code."""
    return cache.identified(page)


def code_of(page: PageRef) -> PageRef:
    """A page with what its QR code says, and nothing else looked for. Raises InputFileError."""
    return replace(page, identity=register(decode(page))[1])


def _with_problem(page: PageRef, problem: Reason, workers: Pool) -> PageRef:
    """A page that could not be scanned, with its problem, and its code where that can still be read."""
    if problem.code in ENDED:
        ((_, known),) = workers.run(code_of, [(page,)])
        page = page if isinstance(known, Reason) else known
    return replace(page, problem=replace(problem, file=page.file))


def _failed(name: str, problem: Reason) -> FileContent:
    """Return the content of a file that could not be opened: its problem."""
    if PurePath(name).suffix.lower() in MEASUREMENT_TYPES:
        return FileContent(refused=replace(problem, file=name))
    return FileContent((PageRef(name, problem=replace(problem, file=name)),))
