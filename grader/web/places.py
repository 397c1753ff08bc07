"""Where a publication's files are: the assignment's, what was handed in, results.

A name that somebody sends never reaches a path as it is: it must be made of plain letters, and is looked
for among the files that are there.
"""

import re
import shutil
import tomllib
import unicodedata
from dataclasses import dataclass
from pathlib import Path

from grader.files import write_whole
from grader.folder.batch import Batch
from grader.folder.inventory import is_tool_file
from grader.rubric import rubric_of
from grader.web.store import Publication
from reference.authored.assignment import Assignment, built_in, load_assignment
from reference.authored.toml_file import MAX_BYTES
from reference.errors import CallError

AUTHORED = (".toml", ".csv")
SUBMITTED = (".jpg", ".jpeg", ".png", ".tif", ".tiff", ".pdf", ".csv", ".json")
LONGEST_NAME = 120
"""Of a file: with the folder before it a path stays within every file system's limit."""
_PLAIN = re.compile(r"[A-Za-z0-9][A-Za-z0-9._-]*")
_NAME_OF_KEY = re.compile(r"[A-Za-z0-9_-]{8,20}")


@dataclass(frozen=True, slots=True)
class Places:
    """The folders of one publication."""

    top: Path

    @property
    def authored(self) -> Path:
        """The assignment's own files."""
        return self.top / "assignment"

    @property
    def handed_in(self) -> Path:
        """The class folder that is graded: sheets, measurements, roster, decisions."""
        return self.top / "handed-in"

    @property
    def results(self) -> Path:
        """The folder of results."""
        return self.top / "results"

    @property
    def photos(self) -> Path:
        """Photos of self-checks, each until it has been checked."""
        return self.top / "photos"

    @property
    def roster(self) -> Path:
        """The roster, whether there is one or not."""
        return self.handed_in / "roster.csv"

    def submitted(self) -> list[Path]:
        """The files handed in, by name."""
        return sorted(
            path
            for path in self.handed_in.glob("*")
            if path.suffix.lower() in SUBMITTED and not is_tool_file(path.name) and path != self.roster
        )

    def remove(self) -> None:
        """Delete all of it."""
        shutil.rmtree(self.top, ignore_errors=True)


def places_of(data: Path, publication: Publication) -> Places:
    """A publication's folders; they are made as they are needed."""
    if not _NAME_OF_KEY.fullmatch(publication.key):
        raise CallError("publication_key", "this publication's key is no name of a folder")
    return Places(data / "publications" / publication.key)


def safe_name(name: str, endings: tuple[str, ...]) -> str:
    """The name under which a file is stored: letters, digits, ``.``, ``_``, ``-``, of a known kind.

    Folders of an uploaded folder become a part of the name. Raises CallError for a name of another kind.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    parts = [part for part in re.split(r"[\\/]+", plain) if part not in {"", ".", ".."}]
    text = re.sub(r"[^A-Za-z0-9._-]+", "-", "_".join(parts)).strip("-._")
    ending = next((one for one in endings if text.lower().endswith(one)), None)
    stem = "" if ending is None else text[: -len(ending)].strip("-._")
    if ending is None or not _PLAIN.fullmatch(stem or "-"):
        known = ", ".join(endings)
        raise CallError("file_name", f"'{name[:60]}': the file's name must end in one of {known}")
    return f"{stem[: LONGEST_NAME - len(ending)]}{ending}"


def stored(folder: Path, name: str) -> Path:
    """A file that is in a folder, by its name. Raises CallError where there is none."""
    for path in folder.glob("*"):
        if path.name == name and path.is_file():
            return path
    raise CallError("file_missing", f"there is no file '{name[:60]}'")


def store(folder: Path, name: str, content: bytes, *, replace: bool = False) -> bool:
    """Store a file; whether it was there already with the same content.

    Raises CallError where another file has that name and may not be replaced.
    """
    path = folder / name
    if path.is_file():
        if path.read_bytes() == content:
            return True
        if not replace:
            why = "a file of this name is there already with other content; rename it, or replace it"
            raise CallError("file_exists", f"{name}: {why}")
    write_whole(path, content)
    return False


def assignment_of(data: Path, publication: Publication) -> Assignment:
    """The published assignment. Raises CallError without one, AuthoredFileError for one with faults."""
    if not publication.assignment:
        raise CallError("assignment_missing", "no assignment is chosen yet")
    if publication.assignment in built_in():
        return load_assignment(publication.assignment)
    path = stored(places_of(data, publication).authored, publication.assignment)
    if far := _names_elsewhere(path):
        raise CallError(
            "file_elsewhere", f"{path.name}: '{far[:60]}' is not in its own folder; upload it beside it"
        )
    return load_assignment(path)


def _names_elsewhere(path: Path) -> str | None:
    """A file that an uploaded assignment names by a path: it may be another instructor's."""
    try:
        text = path.read_bytes()[: MAX_BYTES + 1].decode("utf-8-sig")
        known = tomllib.loads(text)
    except (ValueError, RecursionError):
        return None  # told when it is loaded
    variant = known.get("variant")
    table = variant.get("table") if isinstance(variant, dict) else None
    names = [
        known.get("mechanism"),
        known.get("rubric"),
        table.get("file") if isinstance(table, dict) else None,
    ]
    return next((name for name in names if isinstance(name, str) and re.search(r"[\\/:]", name)), None)


def batch_of(data: Path, publication: Publication, jobs: int = 1) -> Batch:
    """What `planmark grade` would be called with."""
    places, assignment = places_of(data, publication), assignment_of(data, publication)
    for folder in (places.handed_in, places.results):
        folder.mkdir(parents=True, exist_ok=True)
    return Batch(
        assignment, rubric_of(assignment), places.handed_in, places.results,
        pages_per_student=publication.pages_per_student, jobs=jobs, lang=publication.lang,
    )  # fmt: skip
