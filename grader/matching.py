"""A draft of the roster's `scans` where nothing says whose page is whose, for a person to check.

What is known for certain (QR code, the roster's own `scans`, file names) is taken over; the rest is
suggested by the crank's angle as drawn and by the roster's order, and marked to be checked. Nothing
is assigned here: the draft counts only once a person hands it in as the roster.
"""

import csv
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from grader.ownership import How, Owned, PageSource, assign_pages
from grader.records import Problem
from grader.roster import COLUMNS, DRAFT_COLUMNS, SCALES, Roster, RosterRow
from reference.assignment import Assignment
from reference.errors import CallError

SURE, CHECK = "yes", "check"
_CRANK_SE_DEG = 0.7
"""Of a crank of 60 mm drawn by hand."""
_CRANK_FAR = 3.0
"""Standard errors beyond which an angle speaks against a row."""
_CRANK_CLEAR = 2.0
"""The next row must be this many standard errors farther off to be told apart."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A page and the row it may belong to.

    Attributes
    ----------
    row : None where nothing suggests one
    why : the evidence, a sentence
    sure : a source that decides says so, not a likeness
    """

    source: PageSource
    row: RosterRow | None
    why: str
    sure: bool


@dataclass(frozen=True, slots=True)
class Draft:
    """Suggestions for every page that is not blank, and what a person should know."""

    suggestions: tuple[Suggestion, ...]
    problems: tuple[Problem, ...] = field(default=())


def suggest(
    pages: Sequence[PageSource],
    roster: Roster,
    assignment: Assignment,
    *,
    crank_deg: Mapping[PageSource, float] | None = None,
    pages_per_student: int | None = None,
) -> Draft:
    """Who each page may belong to.

    Arguments
    ---------
    crank_deg : the crank's direction as drawn, counter-clockwise, where it could be read
    pages_per_student : how many pages each student has, if the file is in the roster's order
    """
    known = assign_pages(pages, roster, assignment.id, pages_per_student=pages_per_student)
    settled = {owned.source: _certain(owned, roster) for owned in known.owned}
    reasons = {loose.source: loose.problem for loose in known.unmatched}
    if pages_per_student is None:
        settled |= _by_likely_order(pages, roster, assignment, settled)
    taken = {suggestion.row.line for suggestion in settled.values() if suggestion.row is not None}
    angles = _crank_angles(roster, assignment)
    found: list[Suggestion] = []
    for page in pages:
        if page in settled:
            found.append(settled[page])
        elif page in reasons:
            contested = reasons[page].code in {"owner_disagree", "owner_other_assignment"}
            by_crank = None if contested else _by_crank(page, (crank_deg or {}).get(page), roster, angles)
            found.append(by_crank or _open(page, roster, taken, reasons[page]))
    return Draft(tuple(found), known.problems)


def _certain(owned: Owned, roster: Roster) -> Suggestion:
    row = next(
        (row for row in roster.rows_of(owned.student_id) if row.position in (None, owned.position)), None
    )
    sure = owned.how[0] in {How.CODE, How.SCANS, How.NAME}
    return Suggestion(owned.source, row, ", ".join(how.value for how in owned.how), sure)


def _crank_angles(roster: Roster, assignment: Assignment) -> dict[int, float]:
    """The crank's exact angle in degrees, by the row's line; rows whose variant is unknown have none."""
    found: dict[int, float] = {}
    for row in roster.rows:
        try:
            variant = assignment.variant(row.n, row.position)
        except CallError:
            continue
        angle = np.degrees(assignment.mechanism([variant]).crank.angle_rad)
        found[row.line] = float(np.ravel(angle)[0])
    return found


def _by_crank(
    page: PageSource, drawn_deg: float | None, roster: Roster, angles: Mapping[int, float]
) -> Suggestion | None:
    """The row whose crank angle is drawn, where it stands out from all others."""
    if drawn_deg is None or not angles:
        return None
    off = {
        line: abs((drawn_deg - angle + 180.0) % 360.0 - 180.0) / _CRANK_SE_DEG
        for line, angle in angles.items()
    }
    ranked = sorted(off, key=lambda line: off[line])
    if off[ranked[0]] > _CRANK_FAR:
        return None
    near = [row for row in roster.rows if row.line in off and off[row.line] < off[ranked[0]] + _CRANK_CLEAR]
    why = f"the crank is drawn at {drawn_deg:.1f} degrees"
    if len(near) > 1:
        names = ", ".join(_who(row) for row in near[:6]) + (", ..." if len(near) > 6 else "")
        return Suggestion(page, None, f"{why}: {names} are all near", sure=False)
    told = f"{why}; {_who(near[0])} has {angles[near[0].line]:.1f}"
    return Suggestion(page, near[0], told, sure=False)


def _by_likely_order(
    pages: Sequence[PageSource],
    roster: Roster,
    assignment: Assignment,
    settled: Mapping[PageSource, Suggestion],
) -> dict[PageSource, Suggestion]:
    """The roster's order, where the pages of one class file come out even and no code speaks against it."""
    drawn = sum(page.pages > 1 and not page.blank for page in pages)
    each, rest = divmod(drawn, max(len(roster.rows), 1))
    if not each or rest:
        return {}
    dealt = assign_pages(pages, roster, assignment.id, pages_per_student=each)
    if any(loose.problem.code in {"owner_disagree", "order_refused"} for loose in dealt.unmatched):
        return {}
    return {owned.source: _certain(owned, roster) for owned in dealt.owned if owned.source not in settled}


def _open(page: PageSource, roster: Roster, taken: set[int], problem: Problem) -> Suggestion:
    """Nobody is suggested: the reason, and who has no pages so far."""
    free = [row for row in roster.rows if row.line not in taken]
    hint = f"; without pages so far: {', '.join(_who(row) for row in free[:6])}" if free else ""
    return Suggestion(page, None, problem.message.removeprefix(f"{page}: ") + hint, sure=False)


def _who(row: RosterRow) -> str:
    return row.student_id if row.position is None else f"{row.student_id} (position {row.position})"


def draft_csv(roster: Roster, draft: Draft) -> str:
    """The roster with `scans` suggested, and the columns `why` and `sure` (`yes` or `check`).

    Pages that nobody is suggested for stand on the contact sheet alone: a line without a student
    would be no roster.
    """
    text = io.StringIO(newline="")
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow([*COLUMNS, *DRAFT_COLUMNS])
    for row in roster.rows:
        mine = [suggestion for suggestion in draft.suggestions if suggestion.row is row]
        writer.writerow([*_cells(row), *_judged(row, mine)])
    return text.getvalue()


def _cells(row: RosterRow) -> list[str]:
    """The roster's own columns as they were, but for `scans`."""
    whole = ["" if value is None else str(value) for value in (row.n, row.position)]
    return [
        row.student_id,
        row.name,
        *whole,
        row.email or "",
        *(row.scales.get(name, "") for name in SCALES),
        row.lang or "",
    ]


def _judged(row: RosterRow, mine: list[Suggestion]) -> list[str]:
    """`scans`, `why` and `sure` of a row."""
    pages = list(dict.fromkeys([*map(str, row.scans), *(str(suggestion.source) for suggestion in mine)]))
    whole = {ref.file for ref in row.scans if ref.page is None}
    pages = [page for page in pages if page in whole or page.rpartition("#")[0] not in whole]
    why = "; ".join(dict.fromkeys(suggestion.why for suggestion in mine)) or "no page was found"
    sure = SURE if mine and all(suggestion.sure for suggestion in mine) else CHECK
    return [";".join(pages), why, sure]
