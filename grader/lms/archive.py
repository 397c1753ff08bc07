"""Several files as one archive, or in a folder; whole or not at all."""

import contextlib
import secrets
import zipfile
from collections.abc import Mapping
from pathlib import Path

from grader.files import OutputError, create_whole, write_whole
from grader.lms.faults import not_as_meant
from reference.errors import CallError

Content = Mapping[str, bytes | Path]
"""Names, and what stands under them: bytes, or a file that is read when its turn comes."""
_ONE_FILE = frozenset({".json", ".csv"})


def write_files(path: Path, content: Content) -> None:
    """Write an archive where the name ends with ``.zip``, else files below a new folder; one alone as it is.

    Raises CallError for a folder that holds such a file already and for a file's name for several,
    OutputError with the system's reason.
    """
    if path.suffix.lower() == ".zip":
        _write_archive(path, content)
    elif path.suffix.lower() in _ONE_FILE:
        if len(content) != 1:
            raise CallError("archive_name", f"{path}: {len(content)} files; name a .zip, or a folder")
        write_whole(path, *(_bytes(data) for data in content.values()))
    else:
        create_whole({path / name: _bytes(data).decode("utf-8") for name, data in content.items()})


def _bytes(data: bytes | Path) -> bytes:
    return data if isinstance(data, bytes) else data.read_bytes()


def _write_archive(path: Path, content: Content) -> None:
    """A class's pages may be a gigabyte: one at a time goes through the memory, twice to be compared."""
    temporary = path.with_name(f".{path.name[:40]}.{secrets.token_hex(6)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        with zipfile.ZipFile(temporary, "x", zipfile.ZIP_DEFLATED, compresslevel=1) as archive:
            for name, data in content.items():
                archive.writestr(_entry(name), _bytes(data), zipfile.ZIP_DEFLATED, 1)
        with zipfile.ZipFile(temporary) as archive:
            if archive.namelist() != list(content):
                raise not_as_meant("the archive")
            if any(archive.read(name) != _bytes(data) for name, data in content.items()):
                raise not_as_meant("the archive")
        temporary.replace(path)
    except OSError as error:
        raise OutputError(
            "cannot_write",
            f"{path}: cannot be written ({error.strerror or error}); choose another place or make room",
        ) from error
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def _entry(name: str) -> zipfile.ZipInfo:
    """A file's entry, of a fixed date: the same files make the same archive. Unpacked, all may read it."""
    entry = zipfile.ZipInfo(name)
    entry.external_attr = 0o644 << 16
    return entry
