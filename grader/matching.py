"""A draft of the roster's `scans` where nothing says whose page is whose, for a person to check.

What is known for certain (QR code, the roster's own `scans`, file names) is taken over; the rest is
suggested by what the drawing looks like (crank angle, directions of links and plans: the student's
own variant) and by the roster's order, and marked to be checked. Nothing is assigned here: the draft
counts only once a person hands it in as the roster.
"""

import csv
import io
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from grader.likeness import likeness
from grader.ownership import How, Owned, PageSource, assign_pages
from grader.records import FloatArray, Problem
from grader.roster import COLUMNS, DRAFT_COLUMNS, SCALES, Roster, RosterRow
from reference.assignment import Assignment, Variant
from reference.errors import CallError

SURE, CHECK = "yes", "check"
_LIKE_MM = 150.0
"""Length of lines matched, less half of those missed, from which a likeness is told."""
_CLEAR = 0.75
"""The next best variant must match this share of it, or less, to be told apart."""
_NAMED = 6

Look = Callable[[PageSource], FloatArray | None]
"""The strokes (n, 2, 2) of a page in sheet millimetres, y down; None where there are none to be had."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A page and the row it may belong to.

    Attributes
    ----------
    row : None where nothing suggests one
    why : the evidence, a sentence
    sure : a source that decides says so, not a likeness
    among : rows between which a likeness leaves the choice
    """

    source: PageSource
    row: RosterRow | None
    why: str
    sure: bool
    among: tuple[RosterRow, ...] = ()


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
    look: Look | None = None,
    pages_per_student: int | None = None,
) -> Draft:
    """Who each page may belong to.

    Arguments
    ---------
    look : gives the strokes of a page whose owner is not certain, to see whose variant they look like
    pages_per_student : how many pages each student has, if the file is in the roster's order
    """
    known = assign_pages(pages, roster, assignment.id, pages_per_student=pages_per_student)
    settled = {owned.source: _certain(owned, roster) for owned in known.owned}
    reasons = {loose.source: loose.problem for loose in known.unmatched}
    if pages_per_student is None:
        settled |= _by_likely_order(pages, roster, assignment, settled)
    variants = _variants(roster, assignment)
    found: list[Suggestion] = []
    for page in pages:
        first = settled.get(page)
        if first is None and page not in reasons:
            continue
        contested = page in reasons and reasons[page].code in {"owner_disagree", "owner_other_assignment"}
        if (first is None or not first.sure) and not contested and look is not None and variants:
            first = _by_likeness(page, look(page), assignment, variants, first) or first
        found.append(first or Suggestion(page, None, _reason(reasons[page], page), sure=False))
    return Draft(tuple(_in_order(found, roster)), known.problems)


def _certain(owned: Owned, roster: Roster) -> Suggestion:
    row = next(
        (row for row in roster.rows_of(owned.student_id) if row.position in (None, owned.position)), None
    )
    sure = owned.how[0] in {How.CODE, How.SCANS, How.NAME}
    return Suggestion(owned.source, row, ", ".join(how.value for how in owned.how), sure)


def _variants(roster: Roster, assignment: Assignment) -> dict[Variant, list[RosterRow]]:
    """The rows of each variant; rows whose variant is unknown have none."""
    found: dict[Variant, list[RosterRow]] = {}
    for row in roster.rows:
        try:
            found.setdefault(assignment.variant(row.n, row.position), []).append(row)
        except CallError:
            continue
    return found


def _by_likeness(
    page: PageSource,
    strokes: FloatArray | None,
    assignment: Assignment,
    variants: Mapping[Variant, list[RosterRow]],
    before: Suggestion | None,
) -> Suggestion | None:
    """The row whose variant is drawn, where it stands out from those of all others."""
    if strokes is None or len(variants) < 2:
        return None
    matched = likeness(strokes, assignment, list(variants))
    if matched.max() < _LIKE_MM:
        return None
    near = [
        variant for variant, score in zip(variants, matched, strict=True) if score > _CLEAR * matched.max()
    ]
    rows = [row for variant in near for row in variants[variant]]
    names = ", ".join(_who(row) for row in rows[:_NAMED]) + (", ..." if len(rows) > _NAMED else "")
    why = f"the drawing looks like the variant of {names}"
    if before is None or before.row is None:
        return Suggestion(page, rows[0] if len(rows) == 1 else None, why, sure=False, among=tuple(rows))
    if before.row in rows:
        return replace(before, why=f"{before.why}; {why}")
    # What is drawn speaks louder than an order that one missing sheet shifts.
    row = rows[0] if len(rows) == 1 else None
    return Suggestion(page, row, f"{why}; by {before.why}: {_who(before.row)}", sure=False)


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


def _in_order(found: list[Suggestion], roster: Roster) -> list[Suggestion]:
    """Choices left open settled by the roster's order, where all pages that have a row follow it."""
    place = {id(row): index for index, row in enumerate(roster.rows)}
    reached = 0
    settled: list[Suggestion] = []
    for suggestion in found:
        row = suggestion.row
        if row is None and suggestion.among:
            row = next((row for row in suggestion.among if place[id(row)] >= reached), None)
            if row is not None:
                why = f"{suggestion.why}; by the roster's order {_who(row)}"
                suggestion = replace(suggestion, row=row, why=why)  # noqa: PLW2901
        if row is not None:
            if place[id(row)] < reached:
                return found
            reached = place[id(row)]
        settled.append(suggestion)
    return settled


def _reason(problem: Problem, page: PageSource) -> str:
    return problem.message.removeprefix(f"{page}: ")


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
