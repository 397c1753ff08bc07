"""Files written whole or not at all, and the folder of bundled samples."""

import contextlib
import os
import secrets
from collections.abc import Mapping
from importlib.resources import files
from pathlib import Path

from reference.errors import CallError, PlanmarkError


class OutputError(PlanmarkError):
    """A file could not be written: folder missing, no room, no permission."""

    exit_status = 5


def write_whole(path: Path, data: bytes | str) -> None:
    """Write a file so that readers see the old one or the new one, never a part.

    Text is stored as UTF-8 with its line ends as they are. Missing folders are made. The temporary
    file lies beside the target, because a rename is atomic only within one file system.

    Raises OutputError with the system's reason; the target is then as it was.
    """
    content = data.encode("utf-8") if isinstance(data, str) else data
    temporary = path.with_name(f".{path.name[:40]}.{secrets.token_hex(6)}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        _write_new(temporary, content)
        temporary.replace(path)
    except OSError as error:
        _forget(temporary)
        raise OutputError(
            "cannot_write",
            f"{path}: cannot be written ({error.strerror or error}); choose another place or make room",
        ) from error
    except BaseException:
        _forget(temporary)
        raise


def make_folder(path: Path) -> None:
    """Make a folder and those above it, before long work that will write there.

    Raises OutputError with the system's reason.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError(
            "cannot_write",
            f"{path}: cannot be made ({error.strerror or error}); choose another place",
        ) from error


def _write_new(path: Path, content: bytes) -> None:
    with path.open("xb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _forget(temporary: Path) -> None:
    with contextlib.suppress(OSError):
        temporary.unlink()


def create_whole(files: Mapping[Path, str]) -> None:
    """Create several text files, all of them or none, and never over what is there.

    Raises CallError naming a file that is there already, OutputError with the system's reason.
    """
    taken = [path for path in files if path.exists()]
    if taken:
        raise _taken(taken[0])
    created: list[Path] = []
    try:
        for path, text in files.items():
            path.parent.mkdir(parents=True, exist_ok=True)
            # Exclusive: a file that appears meanwhile is not touched.
            with path.open("xb") as file:
                created.append(path)
                file.write(text.encode("utf-8"))
                file.flush()
                os.fsync(file.fileno())
    except BaseException as error:
        for path in created:
            _forget(path)
        if isinstance(error, FileExistsError):
            raise _taken(Path(str(error.filename))) from error
        if isinstance(error, OSError):
            raise OutputError(
                "cannot_write",
                f"{error.filename}: cannot be written ({error.strerror or error}); choose another place",
            ) from error
        raise


def _taken(path: Path) -> CallError:
    told = "is there already and is left as it is; choose another name, or remove it first"
    return CallError("file_exists", f"{path}: {told}")


def samples_folder() -> Path:
    """The folder of samples. Raises CallError where an installation has none."""
    installed = Path(str(files("grader"))) / "samples"
    for folder in (installed, Path(__file__).resolve().parent.parent / "samples"):
        if folder.is_dir():
            return folder
    raise CallError("samples_missing", "the samples are not there; install planmark again")
