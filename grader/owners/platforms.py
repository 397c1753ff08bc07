"""Students whom platforms' names of files and folders tell, matched to the roster as platforms' tables are.

Known are the names of Moodle (mod/assign/classes/downloader.php), of Canvas (lib/content_zipper.rb), of
Gradescope with its list (`grader.folder.archives` writes into the name who it is), and folders with an id,
an address or a name.
"""

import re
from collections import defaultdict
from collections.abc import Iterable, Iterator
from itertools import permutations

from grader.lms.table import NAME, match_rows, plain_name
from grader.records import Reason
from grader.tables.roster import Roster, RosterRow

_MOODLE = re.compile(r"(?P<name>[^_]+)_(?P<number>\d+)_assignsubmission_[a-z]+(_.*)?", re.DOTALL)
_CANVAS = re.compile(r"(?P<joined>[^\W\d_]+)(_LATE)?_(?P<number>\d+)_\d+_.+", re.DOTALL)
_GRADESCOPE = re.compile(r"[^\[\]]* \[(?P<who>[^\[\]]*)\](\.\w+)?")
_JOINED = "joined"
"""Canvas writes "popescuana": last name first, small letters, no spaces or signs."""
_MOST_PARTS = 5
"""Parts of a name that are joined in every order; nobody has more."""

Cells = tuple[tuple[str, str], ...]


def owners_by_platform(files: Iterable[str], roster: Roster | None) -> dict[str, str | Reason]:
    """Return the student whom each name of a file tells, or that a platform's name fits nobody, or several.

    Names that no platform writes, and that fit nobody, are left out.
    """
    people = {} if roster is None else {student: rows[0] for student, rows in roster.by_student.items()}
    known: dict[str, dict[Cells, list[str]]] = defaultdict(lambda: defaultdict(list))
    told: dict[str, str | Reason] = {}
    for file in files:
        for where, who, cells in _people_of(file, people):
            known[where][cells].append(file)
            if who:
                told[file] = Reason("owner_name", {"name": who})
    for by_cells in known.values():
        rows = {row: dict(cells) for row, cells in enumerate(by_cells)}
        students = {student: list(_evidence(row)) for student, row in people.items()}
        found = {row: student for student, row in match_rows(rows, students).rows.items()}
        for row, those in enumerate(by_cells.values()):
            if row in found:
                told.update(dict.fromkeys(those, found[row]))
    return told


def _people_of(file: str, people: dict[str, RosterRow]) -> Iterator[tuple[str, str, Cells]]:
    """Yield where a file lies, whose it is by a platform's name (else empty), and what to look for."""
    parts = file.split("/")
    for at, part in enumerate(parts):
        where = "/".join(parts[:at])
        if match := _GRADESCOPE.fullmatch(part):
            several = [one for one in match["who"].split(";") if one.strip()]
            cells = tuple(_cell(text.strip(), people) for text in several[0].split(",")) if several else ()
            yield where, match["who"], cells if len(several) == 1 else ()
            return
        if match := _MOODLE.fullmatch(part):
            yield where, match["name"], (_cell(match["name"], people), ("number", match["number"]))
            return
        if at == len(parts) - 1 and (match := _CANVAS.fullmatch(part)):
            yield where, match[_JOINED], ((_JOINED, plain_name(match[_JOINED])), ("number", match["number"]))
            return
    if len(parts) > 1:
        yield "/".join(parts[:-2]), "", (_cell(parts[-2], people),)


def _cell(text: str, people: dict[str, RosterRow]) -> tuple[str, str]:
    return ("id" if text in people else "email" if "@" in text else NAME), text


def _evidence(row: RosterRow) -> Iterator[tuple[str, str]]:
    yield "id", row.student_id
    yield "email", row.email or ""
    yield NAME, row.name
    parts = plain_name(row.name).split()
    if len(parts) <= _MOST_PARTS:
        yield from ((_JOINED, joined) for joined in dict.fromkeys(map("".join, permutations(parts))))
