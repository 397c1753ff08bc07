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

    Links that lead out of the folder are passed over: a submission is a file, not a way to others.
    """
    top = folder.resolve()
    none = {path.resolve() for path in (*passed_over, *([roster] if roster else []), folder / "roster.csv")}
    found: list[Path] = []
    for where, folders, files in os.walk(folder):
        folders[:] = [
            name for name in folders if not is_tool_file(name) and (Path(where) / name).resolve() not in none
        ]
        for name in files:
            path = Path(where) / name
            real = path.resolve()
            if not is_tool_file(name) and real not in none and real.is_relative_to(top):
                found.append(path)
    return sorted(found, key=lambda path: natural_key(path.relative_to(folder).as_posix()))


def natural_key(name: str) -> tuple[tuple[int, int | str], ...]:
    """Sorts digits as numbers, letters without regard to case."""
    parts = (part for part in _DIGITS.split(name.lower()) if part)
    return tuple((0, int(part)) if part.isascii() and part.isdigit() else (1, part) for part in parts)
