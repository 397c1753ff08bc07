"""From pages with owners, measurements and the roster to each student's submission.

What cannot be used, and what two students may have handed in, stands in the reports of both: nobody
is missing where a file of theirs lies in the folder. Codes of the problems of measurements, beside
those of `grader.owners.pages`:

| code | meaning |
|---|---|
| measurements_unmatched | of nobody on the roster, or of nobody who is named |
| position_disagrees | the student is on the roster, with other positions |
"""

import re
from collections import ChainMap
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import PurePath
from typing import Any

from grader.documents import UnmatchedDocument
from grader.owners.pages import How, Owned, PageOwners, student_of_name
from grader.owners.platforms import owners_by_platform
from grader.records import Reason, Value, of_error
from grader.tables.measurements import Measurements, StudentSubmission, combined
from grader.tables.reader import why_no_id
from grader.tables.roster import Roster, RosterRow
from grader.texts.spoken import unmatched_document
from reference.authored.assignment import Assignment, Variant
from reference.errors import CallError

Key = tuple[str, int | None]
"""student_id and position."""
_DIGITS = re.compile(r"[0-9]+")


@dataclass(frozen=True, slots=True)
class Unusable:
    """A file, page or line that cannot be used, and the students whose it may be.

    Attributes
    ----------
    position : of those students, None where it is not known or they have it not
    """

    problems: tuple[Reason, ...]
    students: tuple[str, ...] = ()
    position: int | None = None


@dataclass(slots=True)
class _Gathered:
    """Everything handed in by one student for one position."""

    row: RosterRow | None = None
    owned: list[Owned] = field(default_factory=list)
    measured: list[Measurements] = field(default_factory=list)
    unusable: list[Reason] = field(default_factory=list)


@dataclass(slots=True)
class _Submissions:
    """Everybody's, by student and position, in the order in which they were added."""

    roster: Roster | None
    by_key: dict[Key, _Gathered] = field(default_factory=dict)
    keys: dict[str, list[Key]] = field(default_factory=dict)
    spelled: dict[str, str] = field(default_factory=dict)
    """Ids by their letters in lower case: folders whose names differ in case only may be one."""
    said: dict[str, set[str]] = field(default_factory=dict)
    """The students whom each measurement file names in itself."""
    everybody: dict[str, None] = field(default_factory=dict)
    """The students whom any measurement file names."""
    platforms: Mapping[str, str | Reason] = field(default_factory=dict)
    """As `owners_by_platform` finds them."""
    named: dict[str, str | None] = field(default_factory=dict)
    """The student whom each file's name tells."""

    def at(self, key: Key) -> _Gathered:
        """One student's for one position, new where there is none yet."""
        if key not in self.by_key:
            self.by_key[key] = _Gathered()
            self.keys.setdefault(key[0], []).append(key)
            self.spelled.setdefault(key[0].lower(), key[0])
        return self.by_key[key]

    def take(self, entered: Measurements) -> Unusable | None:
        """Add measurements to their owner's; or what keeps them from being used."""
        student, named = entered.student_id, self.student_of_file(entered.source)
        if student is not None and named not in {None, student}:
            claims = {"by_name": str(named), "by_content": student}
            problem = Reason("owner_disagree", {**_line(entered), **claims}, entered.source)
            return Unusable((problem,), (str(named), student), entered.position)
        student = named if student is None and entered.line is None else student
        if student is None and isinstance(why := self.platforms.get(entered.source), Reason):
            return Unusable((replace(why, file=entered.source),))
        if student is None:
            first, *others = entered.problems or [Reason("")]
            more: dict[str, Value] = {"more": len(others)} if others else {}
            return Unusable((_unmatched(entered, {**first.parameters, **more}),))
        if not entered.is_usable:
            return Unusable(entered.problems, (student,), entered.position)
        key = self.key_of(student, entered)
        if isinstance(key, Unusable):
            return key
        self.at(key).measured.append(entered)
        return None

    def student_of_file(self, file: str) -> str | None:
        """The student whom a measurement file's name tells; none of a class's file.

        Without a roster that is also the whole stem of a JSON file that names nobody, or somebody
        whose id is made as the stem is.
        """
        said = self.said.get(file, set())
        if file not in self.named:
            ids = self.keys if self.roster is not None else ChainMap[str, Any](self.keys, self.everybody)
            self.named[file] = student_of_name(file, ids) if len(said) <= 1 else None
            platforms = self.platforms.get(file)
            if self.named[file] is None and isinstance(platforms, str) and len(said) <= 1:
                self.named[file] = platforms
            stem = PurePath(file).stem
            is_json = file.lower().endswith(".json") and self.roster is None and why_no_id(stem) is None
            if self.named[file] is None and is_json:
                made = {_DIGITS.sub("0", student) for student in said}
                self.named[file] = stem if made <= {_DIGITS.sub("0", stem)} else None
        return self.named[file]

    def key_of(self, student: str, entered: Measurements) -> Key | Unusable:
        """The student and position that measurements belong to, or why there is none."""
        keys = self.keys.get(student, [])
        exact = (student, entered.position)
        if entered.position is None and len(keys) == 1:
            return keys[0]
        if exact in self.by_key:
            return exact
        if self.roster is None:
            other = self.spelled.get(student.lower(), student)
            if other == student:
                return exact
            return Unusable((_unmatched(entered, {"student": student, "other": other}),))
        if (student, None) in self.by_key:
            return student, None
        if not keys:
            return Unusable((_unmatched(entered, {"student": student}),))
        known: dict[str, Value] = {**_line(entered), "student": student}
        known["positions"] = tuple(str(position) for _, position in keys)
        if entered.position is None:
            return Unusable((Reason("owner_ambiguous", known, entered.source),), (student,))
        known["given"] = entered.position
        return Unusable((Reason("position_disagrees", known, entered.source),), (student,))

    def report(self, unusable: Unusable) -> None:
        """Note it with everybody whose it may be; with a roster, with those on it alone."""
        for student in unusable.students:
            keys = self.keys.get(student, [])
            exact = [key for key in keys if key[1] == unusable.position]
            if not keys and self.roster is None and self.spelled.get(student.lower(), student) == student:
                keys = [(student, unusable.position)]
            for key in exact or keys:
                self.at(key).unusable.extend(unusable.problems)


def submissions_of(
    assignment: Assignment,
    roster: Roster | None,
    owners: PageOwners,
    measured: Sequence[Measurements],
    lang: str,
    *,
    refused: Sequence[Unusable] = (),
) -> tuple[list[StudentSubmission], list[UnmatchedDocument]]:
    """Each student's submission (with a roster: of everybody on it), and measurements that are nobody's.

    Arguments
    ---------
    lang : where the roster does not say
    refused : measurement files that cannot be used, with the students whom they name in themselves
    """
    files = [*(one.source for one in measured), *(one.problems[0].file or "" for one in refused)]
    submissions = _Submissions(roster, platforms=owners_by_platform(dict.fromkeys(files), roster))
    for row in () if roster is None else roster.rows:
        submissions.at((row.student_id, row.position)).row = row
    for owned in (*owners.owned, *_blank_only(owners, roster)):
        submissions.at((owned.student_id, owned.position)).owned.append(owned)
    for entered in measured:
        said = submissions.said.setdefault(entered.source, set())
        said.update([] if entered.student_id is None else [entered.student_id])
        submissions.everybody.update(dict.fromkeys(said))
    unusable = [refusal for refusal in map(submissions.take, measured) if refusal is not None]
    pages = [Unusable((page.problem,), page.students) for page in owners.unmatched]
    for refusal in (*unusable, *(_by_name(submissions, file) for file in refused), *pages):
        submissions.report(refusal)
    students = [_submission(assignment, key, gathered, lang) for key, gathered in submissions.by_key.items()]
    strangers = [unmatched_document(problem) for refusal in unusable for problem in refusal.problems]
    return students, strangers


def _by_name(submissions: _Submissions, refused: Unusable) -> Unusable:
    """A file that cannot be used, with the student whom its name tells among those whose it may be."""
    file = refused.problems[0].file or ""
    submissions.said[file] = set(refused.students)
    submissions.everybody.update(dict.fromkeys(refused.students))
    named = submissions.student_of_file(file)
    students = [named] if named is not None and named not in refused.students else []
    return replace(refused, students=(*students, *refused.students))


def _line(entered: Measurements) -> dict[str, Value]:
    return {} if entered.line is None else {"line": entered.line}


def _unmatched(entered: Measurements, known: Mapping[str, Value]) -> Reason:
    return Reason("measurements_unmatched", {**_line(entered), **known}, entered.source)


def _blank_only(owners: PageOwners, roster: Roster | None) -> list[Owned]:
    """Blank pages whose file's name names a student who has no other page: they are the student's."""
    having = {owned.student_id for owned in owners.owned}
    pages: dict[str, Owned] = {}
    for source in owners.blank:
        stem = PurePath(source.file).stem
        improvised = [stem] if why_no_id(stem) is None else []
        student = student_of_name(source.file, improvised if roster is None else roster.by_student)
        if student is not None and student not in having:
            rows = () if roster is None else roster.rows_of(student)
            position = rows[0].position if len(rows) == 1 else None
            pages.setdefault(source.file, Owned(source, student, None, position, (How.NAME,)))
    return list(pages.values())


def _submission(assignment: Assignment, key: Key, gathered: _Gathered, lang: str) -> StudentSubmission:
    student_id, position = key
    row = gathered.row or RosterRow(student_id)
    problems = list(gathered.unusable)
    numbers = [row.n, *(owned.n for owned in gathered.owned), *(entered.n for entered in gathered.measured)]
    positions = [position, *(entered.position for entered in gathered.measured)]
    n = _agreed("n", numbers, problems)
    agreed_position = _agreed("position", positions, problems)
    variant = _variant(assignment, n, agreed_position, problems)
    # A line of a class's table with nothing in it is not handed in.
    filled = [one for one in gathered.measured if one.numbers or one.scales or one.problems]
    return StudentSubmission(
        student_id=student_id,
        variant=variant,
        pages=tuple(owned.source for owned in gathered.owned),
        declared=row.scales,
        measured=combined(filled) if filled else None,
        lang=row.lang or lang,
        name=row.name,
        problems=tuple(problems),
        has_unusable=bool(gathered.unusable),
    )


def _agreed(name: str, values: Iterable[int | None], problems: list[Reason]) -> int | None:
    """The number that all sources give; where they differ, None and a problem: it is not guessed."""
    known = list(dict.fromkeys(value for value in values if value is not None))
    if len(known) > 1:
        problems.append(Reason(f"{name}_disagrees", {"numbers": tuple(map(str, known))}))
        return None
    return known[0] if known else None


def _variant(
    assignment: Assignment, n: int | None, position: int | None, problems: list[Reason]
) -> Variant | None:
    """The variant with these numbers; None where one is missing, which is told when it is to be judged."""
    try:
        return assignment.variant(n, position)
    except CallError as error:
        if error.parameters["cause"] != "number_needed":
            problems.append(of_error(error))
        return None
