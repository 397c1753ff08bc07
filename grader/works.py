"""From pages with owners, measurements and the roster to each student's work."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path, PurePath

from grader.documents import UnmatchedDocument
from grader.measurements import Measurements
from grader.ownership import How, Owned, Ownership, PageSource, student_of_name
from grader.pipeline import Place, Work
from grader.records import Problem
from grader.roster import STUDENT_ID, Roster, RosterRow
from reference.assignment import Assignment, Variant
from reference.errors import CallError

Key = tuple[str, int | None]
"""student_id and position."""


@dataclass(slots=True)
class _Gathered:
    """What was found for one student and position so far."""

    row: RosterRow | None = None
    owned: list[Owned] = field(default_factory=list)
    measured: list[Measurements] = field(default_factory=list)


def works_of(
    assignment: Assignment,
    roster: Roster | None,
    ownership: Ownership,
    measured: Sequence[Measurements],
    paths: Mapping[str, Path],
    lang: str,
) -> tuple[list[Work], list[UnmatchedDocument]]:
    """Each student's work (with a roster: of everybody on it), and measurements that are nobody's.

    Arguments
    ---------
    paths : of the files by their names in the folder
    lang : where the roster does not say
    """
    found: dict[Key, _Gathered] = {}
    if roster is not None:
        for row in roster.rows:
            found[row.student_id, row.position] = _Gathered(row)
    for owned in (*ownership.owned, *_blank_only(ownership, roster)):
        found.setdefault((owned.student_id, owned.position), _Gathered()).owned.append(owned)
    strangers = []
    for entered in measured:
        key = _owner(entered, found, roster)
        if key is None:
            strangers.append(_nobody(entered))
        else:
            found.setdefault(key, _Gathered()).measured.append(entered)
    works = [_work(assignment, key, one, paths, lang) for key, one in found.items()]
    return works, strangers


def _blank_only(ownership: Ownership, roster: Roster | None) -> list[Owned]:
    """Blank pages whose file's name tells a student who has no other page: to be told, not passed over."""
    having = {owned.student_id for owned in ownership.owned}
    found: dict[str, Owned] = {}
    for source in ownership.blank:
        stem = PurePath(source.file).stem
        improvised = [stem] if STUDENT_ID.fullmatch(stem) else []
        student = student_of_name(source.file, improvised if roster is None else roster.student_ids)
        if student is not None and student not in having:
            rows = () if roster is None else roster.rows_of(student)
            position = rows[0].position if len(rows) == 1 else None
            found.setdefault(source.file, Owned(source, student, None, position, (How.NAME,)))
    return list(found.values())


def _owner(entered: Measurements, found: Mapping[Key, _Gathered], roster: Roster | None) -> Key | None:
    """The student and position that measurements belong to; None where the roster knows nobody so."""
    if entered.student_id is None:
        return None
    places = [key for key in found if key[0] == entered.student_id]
    exact = (entered.student_id, entered.position)
    if exact in found or roster is None:
        if entered.position is None and len(places) == 1:
            return places[0]
        return exact
    if entered.position is None and len(places) == 1:
        return places[0]
    loose = (entered.student_id, None)
    return loose if loose in found else None


def _nobody(entered: Measurements) -> UnmatchedDocument:
    line = "" if entered.line is None else f", line {entered.line}"
    who = entered.student_id or "nobody"
    position = "" if entered.position is None else f", position {entered.position}"
    told = f"{entered.source}{line}: measurements of {who}{position}, who is not on the roster so"
    return UnmatchedDocument(file=entered.source, code="measurements_unmatched", message=told)


def _work(assignment: Assignment, key: Key, one: _Gathered, paths: Mapping[str, Path], lang: str) -> Work:
    student_id, position = key
    row = one.row or RosterRow(student_id)
    problems: list[Problem] = []
    numbers = [row.n, *(owned.n for owned in one.owned), *(entered.n for entered in one.measured)]
    positions = [position, *(entered.position for entered in one.measured)]
    n = _agreed("n", numbers, problems)
    place = _agreed("position", positions, problems)
    variant = _variant(assignment, n, place, problems)
    entered = one.measured[0] if one.measured else None
    for extra in one.measured[1:]:
        told = f"{extra.source}: further measurements of {student_id} are not counted, only those of"
        problems.append(Problem("measurements_twice", f"{told} {one.measured[0].source}", extra.source))
    pages = tuple(_place(owned.source, paths) for owned in one.owned)
    return Work(
        student_id=student_id,
        variant=variant,
        pages=pages,
        declared=row.scales,
        measured=entered,
        lang=row.lang or lang,
        name=row.name,
        problems=tuple(problems),
    )


def _place(source: PageSource, paths: Mapping[str, Path]) -> Place:
    return Place(paths[source.file], source.page, source.file, source.digest, source.problem)


def _agreed(name: str, values: Iterable[int | None], problems: list[Problem]) -> int | None:
    """The number that all sources give; where they differ, None and a problem: it is not guessed."""
    known = list(dict.fromkeys(value for value in values if value is not None))
    if len(known) > 1:
        told = " and ".join(str(value) for value in known)
        problems.append(Problem(f"{name}_disagrees", f"the sources give different {name}: {told}"))
        return None
    return known[0] if known else None


def _variant(
    assignment: Assignment, n: int | None, position: int | None, problems: list[Problem]
) -> Variant | None:
    try:
        return assignment.variant(n, position)
    except CallError as error:
        problems.append(Problem(error.code, error.message))
        return None
