"""Files handed in to a class, as its page lists them: whose each is by names and codes, and a picture."""

from collections.abc import Mapping
from contextlib import suppress
from pathlib import Path

import numpy as np

from grader.folder.changes import CACHE_FOLDER
from grader.folder.inventory import MEASUREMENT_TYPES, noted_pages
from grader.owners.draft_roster import thumbnail
from grader.owners.pages import assign_pages
from grader.records import PageRef
from grader.scan.decode.pages import decode
from grader.tables.measurements import students_in
from grader.web.places import Places, assignment_of
from grader.web.store import Publication
from reference.errors import PlanmarkError


def owners(
    data: Path, publication: Publication, places: Places, counted: Mapping[str, int]
) -> dict[str, tuple[str, ...]]:
    """Return the students of each file, by the people's name of it, as roster, names and known codes tell.

    Arguments: `counted` are the pages of files, by the names under which they are stored.
    """
    roster, called = places.listed(), places.called()
    if roster is None:
        return {}
    seen = noted_pages(places.results / CACHE_FOLDER)
    pages: list[PageRef] = []
    for path, name in called.items():
        count = counted.get(path.name, 1)
        pages += seen.get(name) or [PageRef(name, number, count) for number in range(1, count + 1)]
    assignment = ""
    if any(page.identity for page in pages):
        with suppress(PlanmarkError):
            assignment = assignment_of(data, publication).id
    known: dict[str, dict[str, None]] = {name: {} for name in called.values()}
    assigned = assign_pages(pages, roster, assignment, pages_per_student=publication.pages_per_student)
    for owned in assigned.owned:
        known[owned.source.file][owned.student_id] = None
    for page in assigned.unmatched:
        if page.problem.code == "owner_ambiguous":
            known[page.source.file] |= dict.fromkeys(page.students)
    for path, name in called.items():
        if path.suffix.lower() in MEASUREMENT_TYPES and not known[name]:
            known[name] = dict.fromkeys(one for one in students_in(path) if one in roster.by_student)
    return {name: tuple(students) for name, students in known.items()}


def picture(path: Path, shown: str) -> bytes:
    """Return the first page of a file, reduced, as viewers show it; for a worker. Raises InputFileError."""
    page = decode(PageRef(shown, path=path))
    return thumbnail(np.ascontiguousarray(np.rot90(page.grey, page.turn_deg // 90)))
