"""Moodle's gradebook import: a row per user, users by id, idnumber, email or username.

The first bad row aborts Moodle's whole import, so every row is checked here. Who has no grade yet has
no row: in a new grade item Moodle would store a blank as 0, and in an old one `-` takes back what a
teacher has entered. Decimal dots, whatever the language of the site.
"""

import re
from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated

from pydantic import Field

from grader.lms.comments import comment
from grader.lms.documents import Filled, Number, Payload
from grader.lms.draft import Draft, document, ready, withheld
from grader.lms.faults import listed
from grader.lms.grades import Grade, Person, rescaled
from grader.lms.options import Options
from grader.lms.table import csv_text, is_formula, number
from reference.errors import CallError

IDENTITIES = ("idnumber", "email", "username", "id")
_SHAPES = {
    "email": re.compile(r"[^@\s]+@[^@\s]+\.[^@\s]+"),
    "id": re.compile(r"[1-9][0-9]*"),
    # Moodle's own rule for usernames: lower case, digits, and these marks.
    "username": re.compile(r"[a-z0-9._@-]+"),
}
_USUAL_LIMIT = 100.0
"""Above it Moodle aborts the import, unless the site allows unlimited grades."""


class Row(Payload):
    """A row as Moodle reads it."""

    user: Filled
    grade: Number
    feedback: Annotated[str, Field(max_length=60_000)]


def gradebook(grades: Sequence[Grade], options: Options) -> Draft:
    """The import file.

    Raises CallError with every student who cannot be named, named twice, or whose grade does not fit.
    """
    identity = options.identity or "idnumber"
    if identity not in IDENTITIES:
        raise CallError("identity", f"users are found by {', '.join(IDENTITIES)}, not by '{identity}'")
    item = _item(options, grades)
    told = ready(grades)
    faults = list(_faults(told, options.people, identity))
    if faults:
        raise CallError("gradebook", f"Moodle would abort this import; nothing was written{listed(faults)}")
    rows = [_row(grade, options, identity) for grade in told]
    text = csv_text(
        [identity, item, f"{item} (feedback)"], ([row.user, row.grade, row.feedback] for row in rows)
    )
    notes = ["who is withheld has no row: the import leaves their grade as it is"] if withheld(grades) else []
    if any(float(row.grade) > _USUAL_LIMIT for row in rows):
        notes.append("some grades are above 100: Moodle takes them only where the site allows it")
    return Draft(text, tuple(one.student_id for one in told), withheld=withheld(grades), notes=tuple(notes))


def _item(options: Options, grades: Sequence[Grade]) -> str:
    item = options.item.strip() or grades[0].reports[0].assignment
    if is_formula(item):
        raise CallError("gradebook", f"'{item}' is no name for a grade item: a spreadsheet would run it")
    return item


def _row(grade: Grade, options: Options, identity: str) -> Row:
    maximum = grade.max_score if options.maximum is None else options.maximum
    score = rescaled(grade, maximum, rescale=options.rescale)
    told = {
        "user": _name(grade.student_id, options.people, identity),
        "grade": number(score or 0.0),
        "feedback": comment(grade.reports, options.lang_of(grade.student_id)),
    }
    return document(Row, told, f"the row of {grade.student_id}")


def _name(student_id: str, people: Mapping[str, Person], identity: str) -> str:
    person = people.get(student_id, Person())
    known = {"email": person.email, "username": person.username, "id": person.platform_id or student_id}
    return known.get(identity, student_id)


def _faults(grades: Sequence[Grade], people: Mapping[str, Person], identity: str) -> Iterator[str]:
    owner: dict[str, str] = {}
    source = {"email": "the roster gives", "username": "the table of ids gives"}.get(identity, "there is")
    for grade in grades:
        name = _name(grade.student_id, people, identity)
        shape = _SHAPES.get(identity)
        if not name:
            yield f"{grade.student_id}: {source} no {identity}"
        elif is_formula(name):
            yield f"{grade.student_id}: {identity} '{name}' would be run as a formula by a spreadsheet"
        elif shape is not None and not shape.fullmatch(name):
            yield f"{grade.student_id}: '{name}' is no {identity} that Moodle knows"
        elif name.casefold() in owner:
            yield f"{grade.student_id}: has the same {identity} as {owner[name.casefold()]}, '{name}'"
        owner.setdefault(name.casefold(), grade.student_id)
