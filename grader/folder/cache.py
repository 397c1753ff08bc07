"""The cache of scans and readings, from which a later run takes unchanged ones.

Everything lies beside the results in small files that are written whole. A file's name or first line
is a digest of all that its content depends on: what was handed in, what is asked for, and the code of
the stage with its data (networks, templates, translations). What does not match, or cannot be
understood, is computed again.
"""

import hashlib
import io
import json
import re
import zipfile
import zlib
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, fields, is_dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader import records
from grader.files import write_whole
from grader.pipeline import scan
from grader.records import PageRef, ScannedPage
from grader.rubric import Asked
from grader.similarity.groups import CELLS, ink_map

RECORDS: Mapping[str, type] = {
    name: kind for name, kind in vars(records).items() if isinstance(kind, type) and is_dataclass(kind)
}

# What a stage depends on --------------------------------------------------------------------------

SCAN_STAGE = (
    "grader.scan.decode.pages", "grader.scan.register.registration", "grader.scan.strokes.ink",
    "grader.scan.handwriting.letters", "grader.scan.handwriting.fields", "grader.overlay.backdrop",
)  # fmt: skip
"""The modules that `grader.scan.page` and `grader.pipeline.scan` call."""
READ_STAGE = (
    "grader.reading.another", "grader.reading.read", "grader.tables.scale_text",
    "grader.scan.handwriting.captions", "grader.scan.strokes.nodes",
)  # fmt: skip
"""The modules that `grader.pipeline.read_submission` calls beside them."""
MARK_STAGE = ("grader.folder.batch",)
"""The module that marks and writes, with all that it rests on."""
ORDER = ("grader.pipeline", "grader.scan.page")
"""The order of all stages: each depends on its text, none on all that it imports."""
_PACKAGES = ("grader", "reference")
_IMPORT = re.compile(
    r"^\s*(?:from|import) ((?:grader|reference)[\w.]*)(?: import (\([^)]*\)|[^\n]*))?", re.MULTILINE
)


@cache
def stage_digest(modules: tuple[str, ...], top: Path = Path(__file__).parents[2]) -> str:
    """A digest of the code and data that modules rest on: all they import, the files beside it, and `ORDER`.

    Arguments: `top` is the folder of the packages.
    """
    sources = _closure(modules, top)
    paths = {*sources.values(), *_data_of(sources, top)}
    paths |= {top.joinpath(*name.split(".")).with_suffix(".py") for name in ORDER}
    digest = hashlib.sha256()
    for path in sorted(paths):
        digest.update(path.relative_to(top).as_posix().encode() + b"\0")
        digest.update(hashlib.sha256(path.read_bytes()).digest())
    return digest.hexdigest()


def _closure(modules: Iterable[str], top: Path) -> dict[str, Path]:
    """The modules, all modules that they import directly or not, and the packages that these are in."""
    sources: dict[str, Path] = {}
    waiting = list(modules)
    while waiting:
        name = waiting.pop()
        stem = top.joinpath(*name.split("."))
        path = next((p for p in (stem.with_suffix(".py"), stem / "__init__.py") if p.is_file()), None)
        if path is None or name in sources:
            continue
        sources[name] = path
        waiting += [name.rpartition(".")[0]]
        for module, names in _IMPORT.findall(path.read_text(encoding="utf-8")):
            waiting += [module, *(f"{module}.{part}" for part in re.findall(r"\w+", names))]
    return sources


def _data_of(sources: Mapping[str, Path], top: Path) -> set[Path]:
    """The files that are no code and that belong to modules.

    They lie in a module's room; those of the package as a whole (`data`, `locale`) belong to the modules that
    name the file, or its folder.
    """
    data = [
        path
        for package in _PACKAGES
        for path in (top / package).rglob("*")
        if path.is_file() and path.suffix not in {".py", ".pyc"}
    ]
    rooms = {path.parent for path in sources.values()}
    texts = "".join(path.read_text(encoding="utf-8") for path in sources.values())

    def belongs(path: Path) -> bool:
        room = next(folder for folder in path.parents if (folder / "__init__.py").is_file())
        if room.parent != top:
            return room in rooms
        return any(f'"{name}"' in texts for name in (path.name, path.relative_to(room).parts[0]))

    return {path for path in data if belongs(path)}


def digest_of(parts: Iterable[object]) -> str:
    """A digest of some values."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(repr(_ordered(part)).encode())
        digest.update(b"\0")
    return digest.hexdigest()


def _ordered(value: object) -> object:
    """Sets have another order in every process."""
    if isinstance(value, set | frozenset):
        return sorted(value)
    return (
        sorted((_ordered(key), item) for key, item in value.items()) if isinstance(value, Mapping) else value
    )


# Records in files ---------------------------------------------------------------------------------


def packed(value: Any, arrays: list[NDArray[Any]]) -> Any:  # noqa: ANN401 - any record, down to its numbers
    """A record as JSON-like data, numbers to the last digit; its arrays are added to `arrays`."""
    if is_dataclass(value) and not isinstance(value, type):
        items = {column.name: packed(getattr(value, column.name), arrays) for column in fields(value)}
        return {"record": type(value).__name__, **items}
    if isinstance(value, complex):
        return {"record": "complex", "parts": [value.real, value.imag]}
    if isinstance(value, np.ndarray):
        arrays.append(value)
        return {"record": "array", "number": len(arrays) - 1}
    if isinstance(value, np.generic):
        return value.item()
    if isinstance(value, Path):
        return {"record": "path", "text": str(value)}
    if isinstance(value, Mapping):
        return {"record": "mapping", "items": [[key, packed(item, arrays)] for key, item in value.items()]}
    if isinstance(value, list | tuple):
        return [packed(item, arrays) for item in value]
    return value


def unpacked(data: Any, arrays: Sequence[NDArray[Any]]) -> Any:  # noqa: ANN401 - as above
    """The record again; lists come back as tuples.

    Raises KeyError, IndexError, TypeError or ValueError for what is no packed record.
    """
    if isinstance(data, list):
        return tuple(unpacked(item, arrays) for item in data)
    if not isinstance(data, dict):
        return data
    match data["record"]:
        case "complex":
            return complex(*data["parts"])
        case "array":
            return arrays[data["number"]]
        case "path":
            return Path(data["text"])
        case "mapping":
            return {key: unpacked(item, arrays) for key, item in data["items"]}
        case kind:
            items = {name: unpacked(item, arrays) for name, item in data.items() if name != "record"}
            return RECORDS[kind](**items)


def dumped(value: object) -> bytes:
    """A record as the bytes of a file."""
    arrays: list[NDArray[Any]] = []
    record = json.dumps(packed(value, arrays)).encode()
    buffer = io.BytesIO()
    np.savez(buffer, np.frombuffer(record, np.uint8), *arrays)
    return zlib.compress(buffer.getvalue(), 1)


def loaded(data: bytes) -> Any:  # noqa: ANN401 - as above
    """The record in the bytes of a file. Raises ValueError for what is none."""
    try:
        with np.load(io.BytesIO(zlib.decompress(data)), allow_pickle=False) as file:
            record, *arrays = (file[f"arr_{number}"] for number in range(len(file.files)))
        return unpacked(json.loads(record.tobytes()), arrays)
    except (KeyError, IndexError, TypeError, OSError, EOFError, zlib.error, zipfile.BadZipFile) as error:
        raise ValueError(f"no record of a cache: {error}") from error


# Pages --------------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class PageCache:
    """Pages as scanned, by this run or an earlier one, and the way to scan others.

    Attributes
    ----------
    asked : what is read on them
    key : digest of all that a page's scan depends on, beside the page
    printed_key : the same of what is read in the cells of a printed sheet
    """

    folder: Path
    asked: Asked = Asked()  # noqa: RUF009 - frozen
    key: str = ""
    printed_key: str = ""

    def path_of(self, ref: PageRef) -> Path:
        """Return the path of a page's scan."""
        placed = (ref.turn_deg, ref.corners_px, ref.tilt_rad)
        return self.folder / f"{digest_of((self.key, ref.file, ref.page, ref.digest, *placed))}.page"

    def identified(self, ref: PageRef) -> PageRef:
        """The page with what is on it: whether it is blank, and whose by its QR code. Scans it if need be."""
        known = self._known(ref).ref
        return replace(
            ref, blank=known.blank, identity=known.identity, content=known.content, problem=known.problem
        )

    def page(self, ref: PageRef) -> ScannedPage:
        """The page as scanned by this run or an earlier one."""
        return replace(self._known(ref), ref=ref)

    def _known(self, ref: PageRef) -> ScannedPage:
        """The page from its file; if there is none, scanned now, and stored unless it has a problem."""
        with suppress(OSError, ValueError):
            (page,) = _pages_in(self.path_of(ref), "", self.printed_key)
            return page
        page = scan(ref, self.asked)
        if page.ref.problem is None:
            write_whole(self.path_of(ref), dumped(("", self.printed_key, [page])))
        return page

    def drop_others(self, refs: Iterable[PageRef]) -> None:
        """Delete the files of all other pages."""
        names = {self.path_of(ref).stem for ref in refs}
        for path in self.folder.glob("*"):
            if path.stem not in names:
                path.unlink(missing_ok=True)


def _pages_in(path: Path, key: str, printed_key: str) -> list[ScannedPage]:
    """The pages in a file of the cache.

    Arguments: `key` is what the file must be of, `printed_key` the same of printed sheets in it.

    Raises OSError where there is no file, ValueError for a damaged one and for another key.
    """
    match loaded(path.read_bytes()):
        case (known, of_printed, tuple(pages)) if all(isinstance(page, ScannedPage) for page in pages):
            is_printed = any(page.sheet is not None and page.sheet.zones for page in pages)
            if known == key and (of_printed == printed_key or not is_printed):
                return list(pages)
    raise ValueError("the file is of something else")


# Readings -----------------------------------------------------------------------------------------


def store_reading(folder: Path, name: str, key: str, pages: Sequence[ScannedPage], cache: PageCache) -> None:
    """Store a submission's pages as read, without what their scans hold already.

    The ink maps of registered pages are stored too, for comparing the sheets of a class.
    """
    bare = [replace(page, ink=None, backdrop=None) for page in pages]
    write_whole(folder / f"{name}.reading", dumped((key, cache.printed_key, bare)))
    scans = [page.backdrop for page in pages if page.backdrop is not None and page.backdrop.registered]
    maps = [ink_map(backdrop.scan, backdrop.page_mm) for backdrop in scans]
    if maps:
        write_whole(folder / f"{name}.ink", zlib.compress(np.array(maps).tobytes()))


def cached_reading(folder: Path, name: str, key: str, cache: PageCache) -> list[ScannedPage] | None:
    """A submission's pages as an earlier run read them; None where anything has changed since.

    Their ink is that of the page's scan, for nodes that people put in their places.
    """
    try:
        pages = _pages_in(folder / f"{name}.reading", key, cache.printed_key)
    except (OSError, ValueError):
        return None
    return [_with_scan(page, cache.page(page.ref)) for page in pages]


def _with_scan(page: ScannedPage, scan: ScannedPage) -> ScannedPage:
    """A page as read with the ink and the backdrop of its scan, at the scale at which it was read."""
    if page.sheet is not None and scan.sheet is not None:
        scan = scan.longer(scan.sheet.px_per_mm / page.sheet.px_per_mm, page.sheet.scale_se)
    ink = scan.ink if page.sheet is not None else None
    return replace(page, backdrop=scan.backdrop, ink=ink)


def cached_maps(folder: Path, name: str) -> list[NDArray[np.uint8]]:
    """The ink maps of a submission's pages; none where there are none, or they are damaged."""
    try:
        data = zlib.decompress((folder / f"{name}.ink").read_bytes())
        return list(np.frombuffer(data, np.uint8).reshape(-1, *CELLS))
    except (OSError, ValueError, zlib.error):
        return []
