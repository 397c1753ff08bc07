"""What in a folder was handed in: everything but the roster and the files of tools."""

import os
import re
from collections.abc import Iterable
from pathlib import Path

_TOOL_NAMES = frozenset(
    {"thumbs.db", "desktop.ini", "layout.json", "results.json", "summary.csv", "index.html", "truth.jsonl"}
)
_TOOL_STARTS = (".", "~$", "__MACOSX")
_TOOL_ENDS = (".part", ".tmp", ".bak", ".crdownload", "~")
_FILE_TYPES = frozenset({".jpg", ".jpeg", ".png", ".tif", ".tiff", ".pdf", ".csv", ".json"})
_DIGITS = re.compile(r"(\d+)")


def is_tool_file(name: str) -> bool:
    """Whether a file's name is one that editors, systems or planmark itself leave behind."""
    lower = name.lower()
    return lower in _TOOL_NAMES or name.startswith(_TOOL_STARTS) or lower.endswith(_TOOL_ENDS)


def submissions(folder: Path, roster: Path | None = None, passed_over: Iterable[Path] = ()) -> list[Path]:
    """The files handed in, at any depth, in natural order (s2 before s10).

    Arguments
    ---------
    roster : the roster's path, which is no submission wherever it lies; a `roster.csv` at the
        folder's top is none either
    passed_over : files and folders that are none, such as the folder of results

    A folder that cannot be opened is one, and an empty folder named as a file: somebody must be told.
    Links that lead out of the folder are passed over: a submission is a file, not a way to others.
    """
    top = folder.resolve()
    none = {path.resolve() for path in (*passed_over, *([roster] if roster else []), folder / "roster.csv")}
    found: list[Path] = []
    shut: list[Path] = []
    for where, folders, files in os.walk(folder, onerror=lambda error: shut.append(Path(error.filename))):
        folders[:] = [
            name for name in folders if not is_tool_file(name) and (Path(where) / name).resolve() not in none
        ]
        for name in files:
            path = Path(where) / name
            real = path.resolve()
            if not is_tool_file(name) and real not in none and real.is_relative_to(top):
                found.append(path)
        found += [Path(where) / name for name in folders if _named_as_file(Path(where) / name)]
    return sorted(found + shut, key=lambda path: natural_key(path.relative_to(folder).as_posix()))


def told_name(path: Path, folder: Path) -> str:
    """A file's path in the folder as people are told it; bytes that are no text are told by number.

    Archives from systems with other alphabets unpack to such names.
    """
    return path.relative_to(folder).as_posix().encode("utf-8", "backslashreplace").decode()


def _named_as_file(folder: Path) -> bool:
    """Whether a folder without anything in it is named as scans and measurements are."""
    try:
        return folder.suffix.lower() in _FILE_TYPES and next(folder.iterdir(), None) is None
    except OSError:
        return False


def natural_key(name: str) -> tuple[tuple[int, int | str], ...]:
    """Sorts digits as numbers, letters without regard to case."""
    parts = (part for part in _DIGITS.split(name.lower()) if part)
    return tuple((0, int(part)) if part.isascii() and part.isdigit() else (1, part) for part in parts)
