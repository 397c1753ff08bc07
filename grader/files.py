"""Files written whole or not at all, folders of results, and the folder of bundled samples."""

import contextlib
import logging
import os
import re
import unicodedata
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol

from reference.errors import CallError, PlanmarkError

_FORMULA = re.compile("'*[ \u00a0\ufeff]*[=+\\-@\t\r\n＝＋－＠]")
"""Start of a text that a spreadsheet would run; an apostrophe before it marks it as text."""
_CONTROL = re.compile("[\x00-\x08\x0a-\x1f\x7f-\x9f\u2028\u2029\u202a-\u202e\u2066-\u2069]")
"""Signs that move a terminal's cursor, begin a line of a log, or turn the order of what is read."""
CANNOT_WRITE = "cannot_write"


class OutputError(PlanmarkError):
    """A file could not be written: folder missing, no room, no permission."""

    exit_status = 5


def _unwritten(path: object, error: OSError) -> OutputError:
    why = error.strerror or str(error)
    message = f"{path}: cannot be written ({why}); choose another place, or make room"
    return OutputError(CANNOT_WRITE, message, file=str(path), error=why)


@contextlib.contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A temporary file's path; what is written there takes the place of `path` at the end, if nothing failed.

    Missing folders are made. The temporary file lies beside the target, because a rename is atomic only
    within one file system. Raises OutputError with the system's reason; the target is then as it was.
    """
    temporary = path.with_name(f".{path.name[:40]}.{os.urandom(6).hex()}.part")
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        yield temporary
        temporary.replace(path)
    except OSError as error:
        raise _unwritten(path, error) from error
    finally:
        _remove(temporary)


def write_whole(path: Path, data: bytes | str) -> None:
    """Write a file so that readers see the old one or the new one, never a part.

    Text is stored as UTF-8 with its line ends as they are. Raises OutputError as `replacing` does.
    """
    write_parts(path, [data])


def write_parts(path: Path, parts: Iterable[bytes | str]) -> None:
    """Write a file as `write_whole` does, part after part: no more than one of them is in memory."""
    with replacing(path) as temporary:
        _write_parts(temporary, parts)


def is_formula(text: str) -> bool:
    """Return whether a spreadsheet would run this text."""
    return _FORMULA.match(text) is not None


def guarded(text: str) -> str:
    """The text for a cell of a table, with an apostrophe where a spreadsheet would take it for a formula."""
    return f"'{text}" if is_formula(text) else text


def unguarded(text: str) -> str:
    """The text of which `guarded` made this one."""
    return text[1:] if text.startswith("'") and is_formula(text) else text


def in_one_line(text: str) -> str:
    """The text with escapes in the place of signs that a terminal or a log would obey."""
    return _CONTROL.sub(lambda sign: sign[0].encode("unicode_escape").decode(), text)


def shown_text(name: str) -> str:
    """A name of a file as people read it and tables hold it: composed letters (NFC), in one line.

    Bytes that are no text stand as numbers: archives from systems with other alphabets unpack to such names.
    """
    text = name.encode("utf-8", "backslashreplace").decode()
    return in_one_line(unicodedata.normalize("NFC", text))


class _Lines(logging.Formatter):
    """A record is one line, and what follows it is indented: no name or message makes a record."""

    def formatMessage(self, record: logging.LogRecord) -> str:  # noqa: N802 - logging's own name
        """The line."""
        return in_one_line(super().formatMessage(record))

    def formatException(self, ei: Any) -> str:  # noqa: ANN401, N802 - logging's own
        """A traceback."""
        return "\n".join(f"    {in_one_line(line)}" for line in super().formatException(ei).split("\n"))


def log_to(path: Path) -> None:
    """Add what is logged to a file, from now on; raises OutputError with the system's reason."""
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        handler = logging.FileHandler(path, encoding="utf-8")
    except OSError as error:
        raise _unwritten(path, error) from error
    handler.setFormatter(_Lines("%(asctime)s %(process)d %(message)s"))
    logging.getLogger("planmark").addHandler(handler)


def remove_parts(folder: Path) -> None:
    """Remove the temporary files that killed processes left at any depth of a folder."""
    for path in folder.rglob(".*.part"):
        _remove(path)


def make_folder(path: Path) -> None:
    """Make a folder and those above it, before long work that will write there.

    Raises OutputError with the system's reason.
    """
    try:
        path.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise _unwritten(path, error) from error


def _write_parts(path: Path, parts: Iterable[bytes | str]) -> None:
    """Write a file that is not there yet; raises FileExistsError for one that is."""
    with path.open("xb") as file:
        for part in parts:
            file.write(part.encode("utf-8") if isinstance(part, str) else part)
        file.flush()
        os.fsync(file.fileno())


Stamp = tuple[int, int, int, int]
"""Size, times of the last change of content and of the entry (ns), number of the file."""


def stamp_of(path: Path) -> Stamp | None:
    """By what a file is known to be unchanged without opening it; None for what cannot be opened."""
    try:
        known = path.stat()
    except OSError:
        return None
    return known.st_size, known.st_mtime_ns, known.st_ctime_ns, known.st_ino


def sync_folder(path: Path) -> None:
    """Make sure that files renamed in a folder stay so after a power cut, where the system can say so."""
    if os.name == "posix":
        with contextlib.suppress(OSError):
            folder = os.open(path, os.O_RDONLY)
            try:
                os.fsync(folder)
            finally:
                os.close(folder)


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink()


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
            _remove(path)
        if isinstance(error, FileExistsError):
            raise _taken(Path(str(error.filename))) from error
        if isinstance(error, OSError):
            raise _unwritten(error.filename, error) from error
        raise


def _taken(path: Path) -> CallError:
    message = f"{path}: already exists; name another file, or remove it first"
    return CallError("file_exists", message, cause="file_taken", file=str(path))


class OfStudent(Protocol):
    """A report or a submission."""

    @property
    def student_id(self) -> str:
        """The student's id."""

    @property
    def position(self) -> int | None:
        """The position; None where there is none or it is not known."""


def result_folders(results: Iterable[OfStudent]) -> list[str]:
    """Each result's folder below the output folder: the student's, with several positions one for each."""
    results = list(results)
    count = Counter(result.student_id for result in results)
    return [
        result.student_id
        if count[result.student_id] == 1
        else f"{result.student_id}/{'unknown' if result.position is None else result.position}"
        for result in results
    ]


def samples_folder() -> Path:
    """The folder of samples. Raises CallError where an installation has none."""
    here = Path(__file__).resolve().parent
    for folder in (here / "samples", here.parent / "samples"):
        if folder.is_dir():
            return folder
    raise CallError("samples_missing", "the samples are not there; install planmark again")
