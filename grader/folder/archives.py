"""ZIP archives of submissions, as platforms give all files of an assignment: unpacked within limits.

What cannot be taken is a problem under its name. Nothing is stored under a name from an archive.

| code | meaning |
|---|---|
| archive_damaged | the archive, or a file in it, cannot be unpacked |
| archive_encrypted | it asks for a password |
| archive_too_large | more files or bytes than a class can have, or a file that unpacks to far too much |
| archive_name | a name that leads out of the archive |
| archive_nested | an archive in an archive |
"""

import contextlib
import hashlib
import json
import lzma
import re
import shutil
import struct
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator
from pathlib import Path, PurePosixPath

from grader.files import Stamp, shown_text, stamp_of, write_whole
from grader.records import Reason
from grader.scan.decode.limits import MAX_FILE_BYTES

ENDING = ".zip"
MOST_FILES = 10_000
"""As many pages as a class may have on the web."""
_MOST_BYTES = 4_000_000_000
"""Eight classes of 50, scanned on both sides in colour."""
_MOST_RATIO, _SMALL = 200, 20_000_000
"""Times that a file may unpack to its packed size, if to more than some bytes: blank 1-bit TIFF has 100."""
_PACKED = (ENDING, ".rar", ".7z", ".tar", ".gz", ".tgz", ".bz2", ".xz")
_OF_PLATFORM = "submission_metadata.yml"
"""Gradescope's list of whose each file or folder is."""
_FAULTS = (
    zipfile.BadZipFile, zlib.error, lzma.LZMAError, struct.error, EOFError, OSError, RuntimeError, ValueError,
)  # fmt: skip
_LEADS_OUT = re.compile(r"(^|[\\/])\.\.([\\/]|$)|^[\\/]|^[A-Za-z]:")
_ENTRY = re.compile(r"^(?:(\S[^\n]*?):[ ]*$|[ ]*(-?)[ ]*:(?:name|sid|email):[ ]*(.*))", re.MULTILINE)
_UTF_8 = 0x800
_NOTE = "files.json"

Unpacked = list[tuple[str, str | Reason]]
"""Names in an archive, and of each the file in the folder, or why there is none; no name is all of it."""


def is_archive(path: Path) -> bool:
    """Return whether a file is an archive by its name."""
    return path.suffix.lower() == ENDING


def unpack(archive: Path, into: Path) -> Unpacked:
    """Unpack an archive into a folder; for a worker, whose limits bound what the archive takes.

    A file that is there with the same content is not written again; what is of no file is deleted.
    """
    try:
        with zipfile.ZipFile(archive) as opened:
            found = list(_files(opened, into)) or [("", Reason("archive_damaged"))]
    except _FAULTS as error:
        found = [("", Reason("archive_damaged", {"error": str(error)[:200]}))]
    kept = {file for _, file in found if isinstance(file, str)}
    for path in into.glob("*"):
        if path.name not in kept:
            path.unlink()
    return found


def unpacked(archive: Path, into: Path) -> Unpacked | None:
    """Return the files of an archive that an earlier run unpacked, if it has not changed since."""
    try:
        stamp, found = json.loads((into / _NOTE).read_bytes())
    except (OSError, ValueError):
        return None
    if tuple(stamp) != stamp_of(archive) or not all((into / file).is_file() for _, file in found):
        return None
    return [(name, file) for name, file in found]


def note_unpacked(stamp: Stamp | None, into: Path, found: Unpacked) -> None:
    """Note an archive that was unpacked whole, as it was before."""
    if found and all(isinstance(file, str) for _, file in found):
        write_whole(into / _NOTE, json.dumps((stamp, found)))


def drop_others(into: Path, known: set[Path]) -> None:
    """Delete the files of archives that are gone."""
    for folder in into.glob("*"):
        if folder not in known:
            shutil.rmtree(folder, ignore_errors=True)


def _files(opened: zipfile.ZipFile, into: Path) -> Iterator[tuple[str, str | Reason]]:
    """Yield the files of an archive, stored or not."""
    files = [info for info in opened.infolist() if not info.is_dir() and not _is_of_system(info)]
    size = sum(info.file_size for info in files)
    if len(files) > MOST_FILES or size > _MOST_BYTES:
        yield "", Reason("archive_too_large", {"count": len(files), "size": size // 1_000_000})
        return
    whose = dict(_whose(opened, files))
    times: Counter[str] = Counter()
    for info in files:
        name = "/".join(shown_text(whose.get(part, part)) for part in re.split(r"[\\/]+", _name_of(info)))
        times[name] += 1
        problem = _problem(info)
        if problem is None:
            with contextlib.suppress(*_FAULTS):
                yield name, _stored(opened.read(info), into, name, times[name])
                continue
            problem = Reason("archive_damaged")
        yield name, problem


def _problem(info: zipfile.ZipInfo) -> Reason | None:
    """Return why a file is not unpacked."""
    if _LEADS_OUT.search(info.filename):
        return Reason("archive_name")
    if info.flag_bits & 1:
        return Reason("archive_encrypted")
    if info.filename.lower().endswith(_PACKED):
        return Reason("archive_nested")
    size = info.file_size
    if size > MAX_FILE_BYTES or size > _MOST_RATIO * info.compress_size + _SMALL:
        return Reason("archive_too_large", {"size": size // 1_000_000})
    return None


def _stored(content: bytes, into: Path, name: str, time: int) -> str:
    """Return the file with the content, written unless it is there; its name follows from the one shown."""
    ending = PurePosixPath(name).suffix.lower()
    ending = ending if re.fullmatch(r"\.[a-z0-9]{1,5}", ending) else ""
    file = f"{hashlib.blake2b(f'{time}/{name}'.encode(), digest_size=12).hexdigest()}{ending}"
    path = into / file
    if not path.is_file() or path.read_bytes() != content:
        write_whole(path, content)
    return file


def _is_of_system(info: zipfile.ZipInfo) -> bool:
    """Return whether a system or a platform put it there: no student did."""
    *folders, last = re.split(r"[\\/]+", info.filename)
    return (
        last in {"Thumbs.db", "onlinetext.html", _OF_PLATFORM}
        or last.startswith(".")
        or "__MACOSX" in folders
    )


def _name_of(info: zipfile.ZipInfo) -> str:
    """Return the name of a file: UTF-8 if it can be, as Moodle and macOS write it, else DOS's letters."""
    if info.flag_bits & _UTF_8:
        return info.filename
    raw = info.filename.encode("cp437", "replace")
    with contextlib.suppress(UnicodeDecodeError):
        return raw.decode()
    russian = raw.decode("cp866")
    is_russian = all("Ѐ" <= letter <= "ӿ" for letter in russian if ord(letter) > 127)
    return russian if is_russian else info.filename


def _whose(opened: zipfile.ZipFile, files: list[zipfile.ZipInfo]) -> Iterator[tuple[str, str]]:
    """Yield Gradescope's names of files and folders, with id, address and name of whoever handed them in."""
    listed = [info for info in opened.infolist() if PurePosixPath(info.filename).name == _OF_PLATFORM]
    if not listed or listed[0].file_size > MAX_FILE_BYTES // 10:
        return
    known: dict[str, list[str]] = {}
    of_files = {part for info in files for part in re.split(r"[\\/]+", info.filename)}
    people: list[str] = []
    for key, is_first, text in _ENTRY.findall(opened.read(listed[0]).decode("utf-8", "replace")):
        if key:
            people = known.setdefault(key.strip("'\""), [])
        elif is_first or not people:
            people.append(_plain(text))
        else:
            people[-1] += f", {_plain(text)}"
    for part, who in known.items():
        if part in of_files and who:
            path = PurePosixPath(part)
            yield part, f"{path.stem} [{'; '.join(who)}]{path.suffix}"


def _plain(text: str) -> str:
    return re.sub(r"[\[\];,/\\'\"]", " ", text).strip()
