"""What is to be delivered, and how: the options of an export in one record."""

from collections.abc import Mapping
from dataclasses import dataclass, field, fields
from datetime import UTC, datetime
from pathlib import Path
from types import MappingProxyType
from typing import Literal

from grader.lms.grades import Person
from reference.errors import CallError

Target = Literal["csv", "moodle", "canvas", "gradescope", "lti"]
What = Literal["grades", "marks", "rubric", "feedback"]
TARGETS: tuple[Target, ...] = ("csv", "moodle", "canvas", "gradescope", "lti")


@dataclass(frozen=True, slots=True, kw_only=True)
class Options:
    """An export's options; what is not told is None or empty.

    Attributes
    ----------
    to : the platform, or ``csv`` for a plain table
    what : ``grades`` (a total for each student), ``marks`` (points by criterion), ``rubric`` (the
        criteria themselves) or ``feedback`` (the students' pages); the target's first if None
    out : the folder that was graded into; only ``feedback`` needs it
    people : names, addresses and platforms' numbers by student_id
    form : the platform's own file to fill in: Moodle's worksheet, Canvas's exported gradebook
    criteria : the platform's numbers of criteria, a CSV file or the platform's own JSON
    identity : how Moodle's gradebook names users: idnumber, email, username, id
    item : the grade item's name; the assignment's id where empty
    position, combine : which of a student's positions counts, or ``sum`` or ``mean`` of all
    maximum, rescale : the platform's maximum, and leave to convert to it
    visibility : of Gradescope's results
    course_id, assignment_id, cmid, context_id : the platform's numbers of places
    lang : of comments' few words of their own, where the roster says no other
    now : the time told to platforms; the clock's if None
    """

    to: str
    what: str | None = None
    out: Path | None = None
    people: Mapping[str, Person] = field(default_factory=lambda: MappingProxyType({}))
    form: Path | None = None
    criteria: Path | None = None
    identity: str | None = None
    item: str = ""
    position: int | None = None
    combine: str | None = None
    maximum: float | None = None
    rescale: bool = False
    visibility: str | None = None
    course_id: int | None = None
    assignment_id: int | None = None
    cmid: int | None = None
    context_id: int | None = None
    lang: str = "en"
    now: datetime | None = None

    @property
    def moment(self) -> datetime:
        """The time told to platforms, with its zone."""
        return self.now or datetime.now(UTC)

    def person(self, student_id: str) -> Person:
        """Who a student is outside, as far as known."""
        return self.people.get(student_id, Person())

    def lang_of(self, student_id: str) -> str:
        """The language of a student's comments."""
        return self.person(student_id).lang or self.lang

    def refuse_unused(self, used: frozenset[str], where: str) -> None:
        """CallError for an option that was given and has no meaning for this delivery."""
        common = {"to", "what", "out", "people", "lang", "now"}
        for one in fields(self):
            given = getattr(self, one.name)
            if one.name not in used | common and given not in (None, "", False):
                raise CallError(
                    "option_unused", f"{_told(one.name)} has no meaning for {where}: leave it out"
                )


def _told(name: str) -> str:
    option = {"form": "a file to fill in"}.get(name)
    return option or "--" + name.replace("_", "-")
