"""Paths of a publication's files: the assignment's, submissions, results.

A name that somebody sends never reaches a path as it is. A sheet keeps the name that people gave it, in their
own script; where that is not plain, the file is stored under another and the name noted beside it. Files are
looked for among those that are there.
"""

import hashlib
import re
import shutil
import tomllib
import unicodedata
from dataclasses import dataclass
from pathlib import Path, PurePath

from grader.files import shown_text, write_whole
from grader.folder.batch import Batch
from grader.folder.inventory import FILE_TYPES, is_tool_file
from grader.rubric import rubric_of
from grader.tables.reader import why_no_id
from grader.tables.roster import Roster, RosterRow, read_roster
from grader.texts.spoken import RefusedError, failure
from grader.web.store import Publication
from reference.authored.assignment import Assignment, built_in, load_assignment
from reference.authored.toml_file import MAX_BYTES
from reference.errors import CallError, PlanmarkError

AUTHORED = (".toml", ".csv")
LONGEST_NAME = 120
"""Characters of a file's name: with its folder a path stays within every file system's limit."""
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
    def exports(self) -> Path:
        """Files for platforms, each in a folder of its own, for a while."""
        return self.top / "exports"

    @property
    def photos(self) -> Path:
        """Photos of self-checks, each until it has been checked."""
        return self.top / "photos"

    @property
    def roster(self) -> Path:
        """The roster, whether there is one or not."""
        return self.handed_in / "roster.csv"

    def listed(self) -> Roster | None:
        """Return the roster; None where there is no usable one."""
        try:
            return read_roster(self.roster) if self.roster.is_file() else None
        except PlanmarkError:
            return None

    def students(self) -> tuple[RosterRow, ...]:
        """Return the lines of the roster; none where there is no usable one."""
        roster = self.listed()
        return () if roster is None else roster.rows

    def submitted(self) -> list[Path]:
        """The files handed in, by name."""
        return sorted(
            path
            for path in self.handed_in.glob("*")
            if path.suffix.lower() in FILE_TYPES and not is_tool_file(path.name) and path != self.roster
        )

    def called(self) -> dict[Path, str]:
        """Return the people's own name of each file handed in."""
        names = {path: self._note_of(path) for path in self.submitted()}
        return {
            path: note.read_text(encoding="utf-8") if note.is_file() else path.name
            for path, note in names.items()
        }

    def keep(self, name: str, content: bytes, *, replace: bool = False) -> bool:
        """Store a file handed in under the people's own name of it; returns and raises as `store` does."""
        path = self.handed_in / stored_name(name)
        if path.name != name:
            write_whole(self._note_of(path), name)
        return store(path, content, replace=replace, shown=name)

    def delete(self, path: Path) -> None:
        """Delete a file handed in, with what it was called."""
        path.unlink(missing_ok=True)
        self._note_of(path).unlink(missing_ok=True)
        self.thumbnail(path).unlink(missing_ok=True)

    def file(self, name: str) -> Path:
        """Return a file handed in by what people call it. Raises RefusedError."""
        for path, called in self.called().items():
            if called == name:
                return path
        raise RefusedError(404, "not_found", "no_file")

    def thumbnail(self, path: Path) -> Path:
        """Return the path of a file's picture, whether there is one or not."""
        return self.top / "thumbnails" / f"{path.name}.jpg"

    def _note_of(self, path: Path) -> Path:
        return self.top / "names" / path.name

    def remove(self) -> None:
        """Delete all of it."""
        shutil.rmtree(self.top, ignore_errors=True)


def places_of(data: Path, publication: Publication) -> Places:
    """Return a publication's folders; they are made as they are needed."""
    if not _NAME_OF_KEY.fullmatch(publication.key):
        raise failure(CallError, "publication_key")
    return Places(data / "publications" / publication.key)


def person_name(name: str, endings: tuple[str, ...]) -> str:
    """Return the people's own name of a file: in any script, in one line, with the folders of an upload.

    Raises RefusedError for a file of another kind, and for one that a system or editor leaves behind.
    """
    parts = [shown_text(part) for part in re.split(r"[\\/]+", name) if part.strip() not in {"", ".", ".."}]
    last = PurePath(parts[-1] if parts else "-")
    if last.suffix.lower() not in endings:
        raise _other_kind(name, endings)
    if is_tool_file(last.name):
        raise RefusedError(422, "file_name", "file_of_program", name=last.name[:60])
    return "/".join(parts)


def stored_name(name: str) -> str:
    """Return the name to store a file under: its own name if that is plain, else one made of it."""
    if _PLAIN.fullmatch(name) and len(name) <= LONGEST_NAME and why_no_id(PurePath(name).stem) is None:
        return name
    made = hashlib.blake2b(name.encode(), digest_size=12).hexdigest()
    return f"file-{made}{PurePath(name).suffix.lower()}"


def _other_kind(name: str, endings: tuple[str, ...]) -> RefusedError:
    return RefusedError(422, "file_name", "file_ending", name=name[:60], endings=", ".join(endings))


def safe_name(name: str, endings: tuple[str, ...]) -> str:
    """Return the name to store an assignment's file under: letters, digits, ``.``, ``_``, ``-``.

    Raises RefusedError for a name of another kind, and for one without any of these.
    """
    plain = unicodedata.normalize("NFKD", name).encode("ascii", "ignore").decode()
    parts = [part for part in re.split(r"[\\/]+", plain) if part not in {"", ".", ".."}]
    text = re.sub(r"[^A-Za-z0-9._-]+", "-", "_".join(parts)).strip("-._")
    ending = next((one for one in endings if text.lower().endswith(one)), None)
    stem = "" if ending is None else text[: -len(ending)].strip("-._")
    if ending is None or not _PLAIN.fullmatch(stem or "-"):
        raise _other_kind(name, endings)
    return f"{stem[: LONGEST_NAME - len(ending)]}{ending}"


def stored(folder: Path, name: str) -> Path:
    """Return a file of a folder by its name. Raises RefusedError where there is none."""
    for path in folder.glob("*"):
        if path.name == name and path.is_file():
            return path
    raise RefusedError(422, "file_missing", "file_unknown", name=name[:60])


def store(path: Path, content: bytes, *, replace: bool = False, shown: str = "") -> bool:
    """Store a file; return whether it was there already with the same content.

    Raises RefusedError where another file has that name, `shown` to people, and may not be replaced.
    """
    if path.is_file():
        if path.read_bytes() == content:
            return True
        if not replace:
            raise RefusedError(422, "file_exists", name=shown or path.name)
    write_whole(path, content)
    return False


def assignment_of(data: Path, publication: Publication) -> Assignment:
    """Return the published assignment. Raises RefusedError without one, AuthoredFileError for faults."""
    if not publication.assignment:
        raise RefusedError(422, "assignment_missing")
    if publication.assignment in built_in():
        return load_assignment(publication.assignment)
    path = stored(places_of(data, publication).authored, publication.assignment)
    if far := _names_elsewhere(path):
        raise RefusedError(422, "file_elsewhere", file=path.name, name=far[:60])
    return load_assignment(path)


def _names_elsewhere(path: Path) -> str | None:
    """Return a file that an uploaded assignment names by a path: it may be another instructor's."""
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
    """Return the arguments for grading the class, as `planmark grade` would have them."""
    places, assignment = places_of(data, publication), assignment_of(data, publication)
    for folder in (places.handed_in, places.results):
        folder.mkdir(parents=True, exist_ok=True)
    return Batch(
        assignment, rubric_of(assignment), places.handed_in, places.results,
        pages_per_student=publication.pages_per_student, jobs=jobs, lang=publication.lang,
        called=places.called(),
        addresses=(f"/review/{publication.key}/", f"/publications/{publication.key}#export"),
    )  # fmt: skip
