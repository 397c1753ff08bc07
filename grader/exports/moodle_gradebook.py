"""Moodle's gradebook import: a row per user, users by id, idnumber, email or username.

The first bad row aborts Moodle's whole import, and a blank grade means none: so every row is checked
here, and what waits for a person stays blank. Decimal dots, whatever the language of the site.
"""

import re
from collections.abc import Iterator, Mapping
from typing import Literal

from grader.exports.grades import Grade, Person, rescaled
from grader.exports.table import csv_text, is_formula, number
from reference.errors import CallError

Identity = Literal["idnumber", "email", "username", "id"]
IDENTITIES = ("idnumber", "email", "username", "id")
_SHAPES = {
    "email": re.compile(r"[^@\s]+@[^@\s]+\.[^@\s]+"),
    "id": re.compile(r"[1-9][0-9]*"),
    # Moodle's own rule for usernames: lower case, digits, and these marks.
    "username": re.compile(r"[a-z0-9._@-]+"),
}


def gradebook_text(  # noqa: PLR0913 - all that the file holds
    grades: list[Grade],
    people: Mapping[str, Person],
    *,
    identity: str,
    item: str,
    maximum: float | None = None,
    rescale: bool = False,
    comments: Mapping[str, str] | None = None,
) -> str:
    """The import file.

    Raises CallError with every student who cannot be named, named twice, or whose grade does not fit.
    """
    if identity not in IDENTITIES:
        raise CallError("identity", f"users are found by {', '.join(IDENTITIES)}, not by '{identity}'")
    faults = list(_faults(grades, people, identity))
    if not item.strip() or is_formula(item):
        faults.append(f"'{item}' is no name for a grade item")
    if faults:
        raise CallError("gradebook", "nothing was written:\n" + "\n".join(f"  {fault}" for fault in faults))
    header = [identity, item.strip()]
    rows: list[list[str]] = []
    for grade in grades:
        score = rescaled(grade, grade.max_score if maximum is None else maximum, rescale=rescale)
        rows.append([_name(grade.student_id, people, identity), "" if score is None else number(score)])
    if comments is not None:
        header.append(f"{item.strip()} (feedback)")
        for row, grade in zip(rows, grades, strict=True):
            row.append("" if grade.score is None else comments.get(grade.student_id, ""))
    return csv_text(header, rows)


def _name(student_id: str, people: Mapping[str, Person], identity: str) -> str:
    person = people.get(student_id, Person())
    return {"email": person.email, "username": person.username}.get(identity, student_id)


def _faults(grades: list[Grade], people: Mapping[str, Person], identity: str) -> Iterator[str]:
    owner: dict[str, str] = {}
    for grade in grades:
        name = _name(grade.student_id, people, identity)
        shape = _SHAPES.get(identity)
        if not name:
            yield f"{grade.student_id}: the roster gives no {identity}"
        elif is_formula(name):
            yield f"{grade.student_id}: {identity} '{name}' would be run as a formula by a spreadsheet"
        elif shape is not None and not shape.fullmatch(name):
            yield f"{grade.student_id}: '{name}' is no {identity} that Moodle knows"
        elif name.casefold() in owner:
            yield f"{grade.student_id}: has the same {identity} as {owner[name.casefold()]}, '{name}'"
        owner.setdefault(name.casefold(), grade.student_id)
        if grade.score is not None and not 0.0 <= grade.score <= grade.max_score + 1e-9:
            yield f"{grade.student_id}: {grade.score:g} is not between 0 and {grade.max_score:g}"
