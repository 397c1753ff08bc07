"""What an earlier run read and a later one need not read again.

Everything is kept beside the results, in small files that are written whole, each with a digest of
all that it depends on: the file's content, the assignment, the code that reads. What does not
match, or cannot be understood, is found out again.
"""

import hashlib
import json
import zlib
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import fields, is_dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.documents import ReadingDocument
from grader.files import write_whole
from grader.picture import Backdrop, restored, stored
from grader.pipeline import Looked
from grader.records import Figure, Identity, Problem, Reading, ReadNode, ReadVector, Swapped, Unread, Written
from grader.similarity import CELLS, ink_map

RECORDS: Mapping[str, type] = {
    one.__name__: one
    for one in (Figure, Identity, Problem, Reading, ReadNode, ReadVector, Swapped, Unread, Written)
}
_PACKAGES = ("grader", "reference")
_SOURCES = (".py", ".npz")


@cache
def code_version() -> str:
    """A digest of the program itself: another version may find something else."""
    digest = hashlib.sha256()
    top = Path(__file__).parent.parent
    for package in _PACKAGES:
        for path in sorted((top / package).rglob("*")):
            if path.suffix in _SOURCES:
                digest.update(path.relative_to(top).as_posix().encode())
                digest.update(path.read_bytes())
    return digest.hexdigest()


def digest_of(parts: Iterable[object]) -> str:
    """A digest of what is told; the program's own version goes into it."""
    digest = hashlib.sha256(code_version().encode())
    for part in parts:
        # Sets have another order in every process.
        told = sorted(part) if isinstance(part, set | frozenset) else part
        digest.update(repr(told).encode())
        digest.update(b"\0")
    return digest.hexdigest()


# Records as JSON ----------------------------------------------------------------------------------


def packed(value: Any) -> Any:  # noqa: ANN401 - any of the records, down to their numbers
    """A record as JSON-like data, numbers to the last digit."""
    if is_dataclass(value) and not isinstance(value, type):
        told = {one.name: packed(getattr(value, one.name)) for one in fields(value)}
        return {"record": type(value).__name__, **told}
    if isinstance(value, complex):
        return {"record": "complex", "parts": [value.real, value.imag]}
    if isinstance(value, np.ndarray):
        return {"record": "array", "values": value.tolist()}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Mapping):
        return {"record": "mapping", "items": [[key, packed(one)] for key, one in value.items()]}
    if isinstance(value, list | tuple):
        return [packed(one) for one in value]
    return value


def unpacked(data: Any) -> Any:  # noqa: ANN401 - as above
    """The record again; lists come back as tuples.

    Raises KeyError, TypeError or ValueError for what is no packed record.
    """
    if isinstance(data, list):
        return tuple(unpacked(one) for one in data)
    if not isinstance(data, dict):
        return data
    kind = data["record"]
    if kind == "complex":
        return complex(*data["parts"])
    if kind == "array":
        return np.array(data["values"], dtype=np.float64)
    if kind == "mapping":
        return {key: unpacked(one) for key, one in data["items"]}
    return RECORDS[kind](**{name: unpacked(one) for name, one in data.items() if name != "record"})


# Readings -----------------------------------------------------------------------------------------


def keep_looked(folder: Path, name: str, key: str, looked: Sequence[Looked]) -> None:
    """Keep a submission's pages as read, in place of what was kept of it before."""
    note = folder / f"{name}.json"
    # Pictures of one reading must never be found beside another's.
    note.unlink(missing_ok=True)
    pages = []
    for index, one in enumerate(looked):
        behind = one.backdrop
        if behind is not None:
            write_whole(folder / f"{name}.{index}.png", stored(behind))
        about = None if behind is None else [behind.source, behind.page, behind.page_mm, behind.registered]
        pages.append(
            {
                "document": one.document.model_dump(mode="json"),
                "reading": packed(one.reading),
                "problems": packed(one.problems),
                "backdrop": about,
            }
        )
    write_whole(note, json.dumps({"key": key, "pages": pages}))


def kept_looked(folder: Path, name: str, key: str) -> tuple[Looked, ...] | None:
    """A submission's pages as an earlier run read them; None where anything has changed since."""
    try:
        told = json.loads((folder / f"{name}.json").read_bytes())
        if told["key"] != key:
            return None
        return tuple(
            Looked(
                ReadingDocument.model_validate_json(json.dumps(page["document"])),
                unpacked(page["reading"]),
                unpacked(page["problems"]),
                _backdrop(folder / f"{name}.{index}.png", page["backdrop"]),
            )
            for index, page in enumerate(told["pages"])
        )
    except (OSError, KeyError, TypeError, ValueError):
        return None


# Ink maps -----------------------------------------------------------------------------------------


def keep_maps(folder: Path, name: str, looked: Sequence[Looked]) -> None:
    """Keep where the ink lies on a submission's registered pages, for holding a class's sheets together."""
    maps = [
        ink_map(one.backdrop.scan, one.backdrop.page_mm)
        for one in looked
        if one.backdrop is not None and one.backdrop.registered
    ]
    if maps:
        write_whole(folder / f"{name}.ink", zlib.compress(np.array(maps).tobytes()))


def kept_maps(folder: Path, name: str) -> list[NDArray[np.uint8]]:
    """The ink maps of a submission's pages; none where there are none, or they are damaged."""
    try:
        data = zlib.decompress((folder / f"{name}.ink").read_bytes())
        return list(np.frombuffer(data, np.uint8).reshape(-1, *CELLS))
    except (OSError, ValueError, zlib.error):
        return []


def _backdrop(path: Path, about: Sequence[Any] | None) -> Backdrop | None:
    if about is None:
        return None
    scan = restored(path.read_bytes())
    if scan is None:
        raise ValueError(f"{path} is damaged")
    source, page, (wide, high), registered = about
    return Backdrop(source, page, scan, (wide, high), registered=registered)
