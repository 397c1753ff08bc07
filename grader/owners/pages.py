"""Assign pages to owners: every page goes to one student and position, or to "unmatched", never lost.

Sources, in order of precedence: the page's QR code; the roster's `scans`; the roster's order over one class
file (`--pages-per-student`); the file's name; the name that a platform gave the file or its folder. All that
give an owner must agree: a page on which two disagree is unmatched, and the problem names both. If none gives
one, a name of the roster that surely stands on the page decides. A person's decision goes before all.
Codes of the problems:

| code | meaning |
|---|---|
| owner_unknown | nothing says whose the page is |
| owner_disagree | two sources name different students, positions or numbers |
| owner_ambiguous | the student is known, but not which of the student's positions |
| owner_name | a platform's name of the file fits nobody on the roster, or several |
| owner_not_listed | the QR code names somebody who is not on the roster |
| owner_other_assignment | the QR code belongs to another assignment |
| order_refused | the roster's order cannot be trusted over this class file |
| scan_missing | the roster names a file, or a page, that is not there |
"""

from collections.abc import Callable, Container, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from pathlib import PurePath
from types import MappingProxyType
from typing import TypeVar

from grader.owners.platforms import owners_by_platform
from grader.records import Identity, PageRef, Reason, Value
from grader.tables.reader import why_no_id
from grader.tables.roster import Roster, RosterRow, ScanRef
from reference.errors import near_names

_ALMOST = 0.8
"""Similarity from which a name of a file is taken for another one, misspelt."""


class How(Enum):
    """Sources of a page's owner, in the order in which they decide: codes of clauses."""

    PERSON = "by_person"
    CODE = "by_code"
    SCANS = "by_scans"
    ORDER = "by_order"
    NAME = "by_name"
    PLATFORM = "by_platform"
    WRITTEN = "by_writing"


@dataclass(frozen=True, slots=True)
class Owned:
    """A page with its owner."""

    source: PageRef
    student_id: str
    n: int | None
    position: int | None
    how: tuple[How, ...]


@dataclass(frozen=True, slots=True)
class Unmatched:
    """A page without an owner, why, and its possible owners."""

    source: PageRef
    problem: Reason
    students: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class PageOwners:
    """The assignment of every page.

    Attributes
    ----------
    owned, unmatched, blank : each page is in exactly one of them, in the order given
    problems : those that concern no single page: files that the roster names and that are missing
    """

    owned: tuple[Owned, ...]
    unmatched: tuple[Unmatched, ...]
    blank: tuple[PageRef, ...]
    problems: tuple[Reason, ...] = ()


@dataclass(frozen=True, slots=True)
class _Claim:
    """One source's claim about a page: the rows it may belong to, and the name given."""

    how: How
    rows: tuple[RosterRow, ...]
    text: str

    @property
    def parameter(self) -> dict[str, Value]:
        """The claim, by the name of a problem's parameter."""
        return {self.how.value: self.text}


def assign_pages(  # noqa: PLR0913 - a source of owners each
    pages: Sequence[PageRef],
    roster: Roster | None,
    assignment_id: str,
    *,
    pages_per_student: int | None = None,
    student_ids: Iterable[str] = (),
    shared_positions: Sequence[int] = (),
    decided: Mapping[tuple[str, int], RosterRow] = MappingProxyType({}),
    written: Mapping[tuple[str, int], str] = MappingProxyType({}),
) -> PageOwners:
    """Give every page its owner.

    Arguments
    ---------
    roster : None if there is none; students are then those named by codes, file names and `student_ids` (of
        measurement files, for example)
    pages_per_student : pages that each student has in the one class file, blank ones not counted
    shared_positions : all positions, where a sheet may have all of them: it then belongs to each
    decided : the owners that a person gave, by file and page
    written : the students whose names stand on pages, by file and page
    """
    owners = [row.student_id for row in decided.values()]
    named = owners_by_platform(dict.fromkeys(page.file for page in pages), roster)
    listed = roster
    if listed is None:
        unnamed = [page for page in pages if page.file not in named]
        listed = _improvised(unnamed, [*student_ids, *owners], shared_positions)
    certain = [_certain_claims(page, listed, named.get(page.file)) for page in pages]
    order, refusals = _order_claims(pages, listed, certain, pages_per_student, shared=bool(shared_positions))
    refusals |= {file: found for file, found in named.items() if isinstance(found, Reason)}
    owned: list[Owned] = []
    unmatched: list[Unmatched] = []
    blank: list[PageRef] = []
    for index, page in enumerate(pages):
        row = decided.get((page.file, page.page))
        if row is not None:
            own = page.identity is not None and page.identity.student_id == row.student_id
            n = page.identity.n if own and row.n is None and page.identity is not None else row.n
            of_all = shared_positions and listed.rows_of(row.student_id)
            positions = [one.position for one in of_all or (row,)]
            owned += [Owned(page, row.student_id, n, position, (How.PERSON,)) for position in positions]
            continue
        if page.blank and page.identity is None:
            blank.append(page)
            continue
        claims = [*certain[index], *([order[index]] if index in order else [])]
        name = written.get((page.file, page.page))
        if name is not None and not claims:
            claims = [_Claim(How.WRITTEN, listed.rows_of(name), name)]
        settled = _settle(page, claims, listed, assignment_id, refusals.get(page.file))
        students = dict.fromkeys(row.student_id for claim in claims for row in claim.rows)
        if isinstance(settled, Owned):
            owned.append(settled)
        elif settled.code == "owner_ambiguous" and shared_positions:
            owned += _each_owned(page, claims)
        else:
            unmatched.append(Unmatched(page, settled, tuple(students)))
    return PageOwners(tuple(owned), tuple(unmatched), tuple(blank), tuple(_missing_scans(pages, listed)))


def _each_owned(page: PageRef, claims: Sequence[_Claim]) -> Iterable[Owned]:
    """Yield a page with all positions as each position's."""
    n, how = None if page.identity is None else page.identity.n, tuple(claim.how for claim in claims)
    for row in _common(claims):
        yield Owned(page, row.student_id, row.n if n is None else n, row.position, how)


def student_of_name(file: str, student_ids: Container[str]) -> str | None:
    """Return the student named by a file's name: its stem, or its longest part before a ``_``, is an id."""
    part = PurePath(file).stem
    while part:
        if part in student_ids:
            return part
        part = part.rpartition("_")[0]
    return None


def _improvised(
    pages: Sequence[PageRef], student_ids: Iterable[str], shared_positions: Sequence[int] = ()
) -> Roster:
    """Return a roster made from the pages, for a folder that has none.

    Students whose id could not name a folder are left out.
    """
    rows: dict[tuple[str, int | None], RosterRow] = {}
    spelled: dict[str, str] = {}
    ids: set[str] = set()

    def add(row: RosterRow) -> None:
        other = spelled.setdefault(row.student_id.lower(), row.student_id)
        ids.add(other)
        if other == row.student_id and why_no_id(row.student_id) is None:
            positions = shared_positions if row.position is None else ()
            for position in positions or (row.position,):
                rows[row.student_id, position] = replace(row, position=position)

    for page in pages:
        if page.identity is not None:
            identity = page.identity
            add(RosterRow(identity.student_id, n=identity.n, position=identity.position))
    known = {student for student, _ in rows}
    for student in student_ids:
        if student not in known:
            add(RosterRow(student))
    stems = {PurePath(page.file).stem for page in pages if page.identity is None and not page.blank}
    for stem in sorted(stems, key=lambda stem: (len(stem), stem)):
        # A second sheet's s07_2 belongs to s07, if there is an s07.
        if student_of_name(f"{stem}.x", ids) is None:
            add(RosterRow(stem))
    return Roster("", tuple(rows.values()))


def _certain_claims(page: PageRef, roster: Roster, named: str | Reason | None) -> list[_Claim]:
    """Return the claims of code, scans and name of the file, and of its platform: the student `named`."""
    claims: list[_Claim] = []
    if page.identity is not None:
        claims.append(_code_claim(page.identity, roster))
    rows = tuple(
        row
        for row in roster.by_scan.get(page.file, ())
        if any(ref.covers(page.file, page.page) for ref in row.scans)
    )
    if rows:
        lines = " / ".join(who(row) for row in rows)
        claims.append(_Claim(How.SCANS, rows, lines))
    student = student_of_name(page.file, roster.by_student)
    if student is not None:
        claims.append(_Claim(How.NAME, roster.rows_of(student), student))
    if isinstance(named, str):
        claims.append(_Claim(How.PLATFORM, roster.rows_of(named), named))
    return claims


def _code_claim(identity: Identity, roster: Roster) -> _Claim:
    rows = tuple(
        row
        for row in roster.rows_of(identity.student_id)
        if identity.position is None or row.position in (None, identity.position)
    )
    numbers = (("n", identity.n), ("position", identity.position))
    details = [f"{name} {value}" for name, value in numbers if value is not None]
    return _Claim(How.CODE, rows, ", ".join([identity.student_id, *details]))


def _order_claims(
    pages: Sequence[PageRef],
    roster: Roster,
    certain: Sequence[Sequence[_Claim]],
    each: int | None,
    *,
    shared: bool = False,
) -> tuple[dict[int, _Claim], dict[str, Reason]]:
    """Return the claims of the roster's order on the class file's pages, by index; or why not, by file."""
    if each is None:
        return {}, {}
    named = {
        page.file
        for page, claims in zip(pages, certain, strict=True)
        if any(c.how is How.NAME for c in claims)
    }
    files = list(dict.fromkeys(page.file for page in pages if page.pages > 1 and page.file not in named))
    if len(files) != 1:
        return {}, dict.fromkeys(files, _no_order("several_files", count=len(files), files=tuple(files)))
    file = files[0]
    indices = [
        index
        for index, page in enumerate(pages)
        if page.file == file and not any(claim.how is How.SCANS for claim in certain[index])
    ]
    rows = [row for row in roster.rows if all(ref.file != file for ref in row.scans)]
    rows = list({row.student_id: row for row in rows}.values()) if shared else rows
    elsewhere = {
        row.line
        for page, claims in zip(pages, certain, strict=True)
        if page.file != file and not page.blank
        for claim in claims
        for row in claim.rows
    }
    dealt = deal(
        [pages[index].blank for index in indices],
        rows,
        [row for row in rows if row.line not in elsewhere],
        each,
    )
    if isinstance(dealt, Reason):
        return {}, {file: dealt}
    claims_by_index = {
        indices[place]: _Claim(How.ORDER, roster.rows_of(row.student_id) if shared else (row,), who(row))
        for place, row in dealt.items()
    }
    for index, claim in claims_by_index.items():
        for other in certain[index]:
            if not pages[index].blank and not _common([claim, other]):
                claims = {**other.parameter, **claim.parameter}
                # Pages without another source may be shifted as well; those that agree keep their owner.
                agreeing = {i: c for i, c in claims_by_index.items() if certain[i]}
                return agreeing, {file: _no_order("disproved", at=pages[index].page, **claims)}
    return claims_by_index, {}


def _common(claims: Sequence[_Claim]) -> tuple[RosterRow, ...]:
    """Return the rows that all claims allow, in the first one's order."""
    first, *others = claims
    allowed = [{(row.student_id, row.position) for row in claim.rows} for claim in others]
    return tuple(row for row in first.rows if all((row.student_id, row.position) in rows for rows in allowed))


def _settle(
    page: PageRef, claims: list[_Claim], roster: Roster, assignment_id: str, refusal: Reason | None
) -> Owned | Reason:
    """Return the owner on whom all claims agree, or the problem."""
    claims = sorted(claims, key=lambda claim: list(How).index(claim.how))
    identity = page.identity

    def problem(code: str, **known: Value) -> Reason:
        where = {"page": page.page} if page.pages > 1 else {}
        return Reason(code, {**where, **known}, page.file)

    if identity is not None and identity.assignment != assignment_id:
        return problem("owner_other_assignment", printed=identity.assignment, assignment=assignment_id)
    if not claims:
        if refusal is not None:
            return problem(refusal.code, **refusal.parameters)
        why = None if roster.file else why_no_id(PurePath(page.file).stem)
        return problem("owner_unknown", **_near(page.file, roster), **({"why": why.code} if why else {}))
    common = _common(claims)
    if not common:
        if identity is not None and not claims[0].rows and len(claims) == 1:
            return problem("owner_not_listed", **claims[0].parameter)
        return problem("owner_disagree", **{k: v for claim in claims for k, v in claim.parameter.items()})
    if len(common) > 1:
        places = tuple(str(row.position) for row in common)
        return problem("owner_ambiguous", student=common[0].student_id, positions=places)
    return _owned(page, common[0], claims, problem)


def _owned(
    page: PageRef, row: RosterRow, claims: list[_Claim], problem: Callable[..., Reason]
) -> Owned | Reason:
    """Return the row's page, unless the code's number is another."""
    identity = page.identity
    n, position = row.n, row.position
    if identity is not None:
        if None not in (identity.n, n) and identity.n != n:
            listed = f"{row.student_id}, n {n}"
            return problem("owner_disagree", **claims[0].parameter, by_roster=listed)
        n = identity.n if n is None else n
        position = identity.position if position is None else position
    return Owned(page, row.student_id, n, position, tuple(claim.how for claim in claims))


def who(row: RosterRow) -> str:
    """A student, and the position where there are some."""
    return row.student_id if row.position is None else f"{row.student_id}, position {row.position}"


def _near(file: str, roster: Roster) -> dict[str, Value]:
    """Return a hint for a name that is almost an id; never more than a hint."""
    stem = PurePath(file).stem
    by_lower = {student.lower(): student for student in roster.student_ids}
    student = student_of_name(f"{stem.lower()}.x", by_lower)
    return {"near": by_lower[student]} if student else _nearest(stem, roster.student_ids)


def _nearest(name: str, known: Iterable[str]) -> dict[str, Value]:
    found = near_names(name, known, most=1, cutoff=_ALMOST)
    return {"near": found[0]} if found else {}


def _missing_scans(pages: Sequence[PageRef], roster: Roster) -> Iterable[Reason]:
    there: Mapping[str, int] = {page.file: page.pages for page in pages}
    for row in roster.rows:
        for ref in row.scans:
            missing = _missing_parts(ref, there)
            if missing is not None:
                known: dict[str, Value] = {"line": row.line, "student": who(row), "scan": str(ref)}
                yield Reason("scan_missing", {**known, **missing}, roster.file)


def _missing_parts(ref: ScanRef, there: Mapping[str, int]) -> dict[str, Value] | None:
    """Describe what exists in place of a scan: a similar file name, or fewer pages; None for the scan."""
    if ref.file not in there:
        return _nearest(ref.file, there)
    if ref.page is not None and ref.page > there[ref.file]:
        return {"pages": there[ref.file]}
    return None


# The roster's order over one class file -----------------------------------------------------------

Row = TypeVar("Row")


def deal(
    blank: Sequence[bool], rows: Sequence[Row], waiting: Sequence[Row], each: int
) -> dict[int, Row] | Reason:
    """Return the row of each page, by its index in the file; blank pages have none.

    Arguments
    ---------
    blank : for each page of the file
    rows : the roster's rows in order
    waiting : those of them that have no pages elsewhere; used if all `rows` do not come out even
    each : pages per row
    """
    if each < 1:
        raise ValueError(f"pages per student must be 1 or more, not {each}")
    drawn = [place for place, empty in enumerate(blank) if not empty]
    # The fronts of a duplex scan whose backs are all blank.
    fronts = list(range(0, len(blank), 2)) if len(blank) % 2 == 0 and all(blank[1::2]) else []
    for candidates in (rows, waiting):
        for places in (drawn, list(range(len(blank))), fronts):
            if candidates and len(places) == each * len(candidates):
                dealt = zip(places, (row for row in candidates for _ in range(each)), strict=True)
                return {place: row for place, row in dealt if not blank[place]}
    return _no_order("uneven", pages=len(drawn), each=each, rows=len(rows))


def _no_order(why: str, **known: Value) -> Reason:
    return Reason("order_refused", {"why": why, **known})
