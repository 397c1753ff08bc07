"""Draft the roster's `scans` for pages whose owner is not known, for a person to check.

What is known for certain (QR code, the roster's own `scans`, file names) is kept; the rest is suggested by
the look of the drawing (crank angle, directions of links and plans: the student's own variant) and by the
roster's order, and marked to be checked. Nothing is assigned here: the draft counts only once a person hands
it in as the roster. A contact sheet shows all pages small.

A variant's figure is laid on the strokes by an anchor, one of its longest lines: each stroke of about its
direction and length proposes a pose and a scale. Its similarity is the length of the figure's lines that then
match. Students who made mistakes match their own variant less well.
"""

import base64
import contextlib
import io
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from PIL import Image

from grader.feedback.words import environment
from grader.files import guarded
from grader.language import Tongue, tongue
from grader.owners.pages import How, Owned, assign_pages, who
from grader.records import FloatArray, GreyImage, PageRef, Reason
from grader.scan.pixels import shrink
from grader.tables.reader import written
from grader.tables.roster import COLUMNS, DRAFT_COLUMNS, Roster, RosterRow
from grader.texts.spoken import ENGLISH, clause, clauses, sentence
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.construction.graph import Construction, bars, evaluate
from reference.errors import CallError
from reference.geometry import ComplexArray
from reference.plan import construction_for, parameters_for

SURE, CHECK = "yes", "check"
LIKE_MM = 150.0
"""Length of lines matched, less half of those missed, from which a suggestion is made."""
CLEAR = 0.75
"""A suggestion needs the next best variant to match this share of it, or less."""
_NAMED = 6

StrokesOf = Callable[[PageRef], FloatArray | None]
"""Returns the strokes (n, 2, 2) of a page in sheet millimetres, y down; None if there are none."""


@dataclass(frozen=True, slots=True)
class Suggestion:
    """A page and the row it may belong to.

    Attributes
    ----------
    row : None where nothing suggests one
    why : the evidence
    sure : a source that decides says so, not similarity
    among : rows between which similarity leaves the choice
    """

    source: PageRef
    row: RosterRow | None
    why: tuple[Reason, ...]
    sure: bool
    among: tuple[RosterRow, ...] = ()


@dataclass(frozen=True, slots=True)
class RosterDraft:
    """Suggestions for every page that is not blank, and what a person should know."""

    suggestions: tuple[Suggestion, ...]
    problems: tuple[Reason, ...] = field(default=())


def suggest(
    pages: Sequence[PageRef],
    roster: Roster,
    assignment: Assignment,
    *,
    strokes_of: StrokesOf | None = None,
    pages_per_student: int | None = None,
) -> RosterDraft:
    """Suggest the owner of each page.

    Arguments
    ---------
    strokes_of : returns the strokes of a page whose owner is not certain, to compare it with variants
    pages_per_student : how many pages each student has, if the file is in the roster's order
    """
    known = assign_pages(
        pages, roster, assignment.id, pages_per_student=pages_per_student,
        shared_positions=assignment.shared_positions,
    )  # fmt: skip
    settled = {owned.source: _certain(owned, roster) for owned in known.owned}
    reasons = {loose.source: loose.problem for loose in known.unmatched}
    if pages_per_student is None:
        settled |= _by_likely_order(pages, roster, assignment, settled)
    variants = _variants(roster, assignment)
    suggestions: list[Suggestion] = []
    for page in pages:
        first = settled.get(page)
        if first is None and page not in reasons:
            continue
        contested = page in reasons and reasons[page].code in {"owner_disagree", "owner_other_assignment"}
        if (first is None or not first.sure) and not contested and strokes_of is not None and variants:
            first = _by_similarity(page, strokes_of(page), assignment, variants, first) or first
        if first is None:
            first = Suggestion(page, None, (reasons[page],), sure=False)
        suggestions.append(first)
    return RosterDraft(tuple(_in_order(suggestions, roster)), known.problems)


def _certain(owned: Owned, roster: Roster) -> Suggestion:
    row = next(
        (row for row in roster.rows_of(owned.student_id) if row.position in (None, owned.position)), None
    )
    sure = owned.how[0] in {How.CODE, How.SCANS, How.NAME, How.PLATFORM}
    return Suggestion(owned.source, row, tuple(Reason(how.value) for how in owned.how), sure)


def _variants(roster: Roster, assignment: Assignment) -> dict[Variant, list[RosterRow]]:
    """Return the rows of each variant; rows whose variant is unknown are left out."""
    variants: dict[Variant, list[RosterRow]] = {}
    for row in roster.rows:
        with contextlib.suppress(CallError):
            variants.setdefault(assignment.variant(row.n, row.position), []).append(row)
    return variants


def _by_similarity(
    page: PageRef,
    strokes: FloatArray | None,
    assignment: Assignment,
    variants: Mapping[Variant, list[RosterRow]],
    before: Suggestion | None,
) -> Suggestion | None:
    """Return the row whose variant is drawn, if it stands out from those of all others."""
    if strokes is None or len(variants) < 2:
        return None
    matched = figure_similarity(strokes, assignment, list(variants))
    if matched.max() < LIKE_MM:
        return None
    near = [
        variant for variant, score in zip(variants, matched, strict=True) if score > CLEAR * matched.max()
    ]
    rows = [row for variant in near for row in variants[variant]]
    names = tuple(who(row) for row in rows[:_NAMED]) + (("...",) if len(rows) > _NAMED else ())
    why = (Reason("looks_like", {"students": names}),)
    if before is None or before.row is None:
        return Suggestion(page, rows[0] if len(rows) == 1 else None, why, sure=False, among=tuple(rows))
    if before.row in rows:
        return replace(before, why=before.why + why)
    # What is drawn speaks louder than an order that one missing sheet shifts.
    row = rows[0] if len(rows) == 1 else None
    others = tuple(Reason(how.code, {"claim": who(before.row)}) for how in before.why)
    return Suggestion(page, row, why + others, sure=False)


def _by_likely_order(
    pages: Sequence[PageRef],
    roster: Roster,
    assignment: Assignment,
    settled: Mapping[PageRef, Suggestion],
) -> dict[PageRef, Suggestion]:
    """Suggest by the roster's order, if the pages of one class file come out even and no code contradicts."""
    drawn = sum(page.pages > 1 and not page.blank for page in pages)
    each, rest = divmod(drawn, max(len(roster.rows), 1))
    if not each or rest:
        return {}
    dealt = assign_pages(pages, roster, assignment.id, pages_per_student=each)
    if any(loose.problem.code in {"owner_disagree", "order_refused"} for loose in dealt.unmatched):
        return {}
    return {owned.source: _certain(owned, roster) for owned in dealt.owned if owned.source not in settled}


def _in_order(suggestions: list[Suggestion], roster: Roster) -> list[Suggestion]:
    """Settle open choices by the roster's order, if all pages that have a row follow it."""
    place = {id(row): index for index, row in enumerate(roster.rows)}
    reached = 0
    settled: list[Suggestion] = []
    for suggestion in suggestions:
        row = suggestion.row
        if row is None and suggestion.among:
            row = next((row for row in suggestion.among if place[id(row)] >= reached), None)
            if row is not None:
                why = (*suggestion.why, Reason(How.ORDER.value, {"claim": who(row)}))
                suggestion = replace(suggestion, row=row, why=why)  # noqa: PLW2901
        if row is not None:
            if place[id(row)] < reached:
                return suggestions
            reached = place[id(row)]
        settled.append(suggestion)
    return settled


def draft_csv(roster: Roster, draft: RosterDraft) -> str:
    """Return the roster with `scans` suggested, and the columns `why` and `sure` (`yes` or `check`).

    Pages without a suggestion are on the contact sheet alone: a line without a student would make the roster
    invalid.
    """
    scales = [name for name in SCALE_NAMES if name != "kF" or any(name in row.scales for row in roster.rows)]
    rows = [[*(name for name in COLUMNS if name in scales or name not in SCALE_NAMES), *DRAFT_COLUMNS]]
    for row in roster.rows:
        mine = [suggestion for suggestion in draft.suggestions if suggestion.row is row]
        rows.append([*_cells(row, scales), *_judged(row, mine)])
    return written((map(guarded, row) for row in rows), end="\n")


def _cells(row: RosterRow, scales: Iterable[str]) -> list[str]:
    """Return the roster's own columns unchanged, except `scans`."""
    whole = ["" if value is None else str(value) for value in (row.n, row.position)]
    return [
        row.student_id,
        row.name,
        *whole,
        row.email or "",
        *(row.scales.get(name, "") for name in scales),
        row.lang or "",
    ]


def _judged(row: RosterRow, mine: list[Suggestion]) -> list[str]:
    """Return `scans`, `why` and `sure` of a row."""
    pages = list(dict.fromkeys([*map(str, row.scans), *(str(suggestion.source) for suggestion in mine)]))
    whole = {ref.file for ref in row.scans if ref.page is None}
    pages = [page for page in pages if page in whole or page.rpartition("#")[0] not in whole]
    why = said([one for suggestion in mine for one in suggestion.why] or [Reason("no_page_found")], ENGLISH)
    sure = SURE if mine and all(suggestion.sure for suggestion in mine) else CHECK
    return [";".join(pages), why, sure]


def said(why: Sequence[Reason], speaker: Tongue) -> str:
    """The evidence in words."""
    told = (clause(one, speaker) if clauses(one.code) else sentence(one, speaker) for one in why)
    return "; ".join(dict.fromkeys(told))


# Similarity of strokes and figures ------------------------------------------------------------------


_ANCHOR_OFF_RAD = np.radians(2.5)
_SCALES = (0.4, 1.6)
"""Range of the drawn size relative to the size that the assignment proposes."""
_LEAST_ANCHOR_MM = 15.0
_LEAST_LINE_MM = 8.0
"""Shorter lines are found anywhere."""
_OFF_MM = 0.6
"""Usual drafting error of a line's ends, across."""
_COVERED = 0.6
_AMISS = 0.5
"""Cost of a line without a stroke, as a share of the gain of one with a stroke."""
_ANCHORS = 4
_TRIED = 24
"""Strokes tried as the anchor, those nearest in direction."""


def figure_similarity(ends_mm: FloatArray, assignment: Assignment, variants: Sequence[Variant]) -> FloatArray:
    """Return how well a sheet's strokes match each variant's figures.

    Arguments: `ends_mm` (n, 2, 2) strokes in sheet millimetres, y down. Returns (variants,), the length of
    lines that lie on strokes less half of that of lines that do not, mm, summed over the figures: a dead
    point's few matched lines count less than a whole plan.
    """
    strokes = ends_mm[..., 0] - 1j * ends_mm[..., 1]
    strokes = strokes[np.abs(strokes[:, 1] - strokes[:, 0]) >= _LEAST_LINE_MM]
    outlines = _outlines(assignment, list(variants))
    if not len(strokes) or not len(variants):
        return np.zeros(len(variants))
    matched = [
        [_most_matched(outline[..., index], strokes) for outline in outlines]
        for index in range(len(variants))
    ]
    return np.asarray(np.sum(matched, axis=1))


def _outlines(assignment: Assignment, variants: list[Variant]) -> list[ComplexArray]:
    """(lines, 2, variants) ends of the lines of each figure, in drawn mm at the proposed scales, y up."""
    construction = construction_for(assignment, variants)
    nodes = evaluate(construction, parameters_for(assignment, variants, assignment.scales(variants)))
    shape = (len(variants),)
    return [
        np.array([[np.broadcast_to(nodes[name], shape) for name in pair] for pair in pairs])
        for pairs in _pairs(construction)
        if pairs
    ]


def _pairs(construction: Construction) -> list[list[tuple[str, str]]]:
    """Return the lines of each figure by their ends."""
    plans = [
        [(vector.tail, vector.head) for vector in construction.polygon_of(plan)]
        for plan in construction.poles
    ]
    return [list(bars(construction)), *plans]


def _most_matched(outline: ComplexArray, strokes: FloatArray) -> float:
    """Return the best match of the figure's lines over all poses that its anchors propose; 0 at least."""
    tails, heads = outline.T
    size = np.abs(heads - tails)
    if not np.isfinite(size).all():
        return 0.0
    judged = size >= _LEAST_LINE_MM
    best = 0.0
    for anchor in np.argsort(-size)[:_ANCHORS]:
        placed = _proposed(heads[anchor] - tails[anchor], strokes)
        if size[anchor] < _LEAST_LINE_MM or not len(placed):
            continue
        begin, scale = placed[:, :1], placed[:, 1:].real
        # One row per place, one column per line.
        tail = begin + scale * (tails[judged] - tails[anchor])
        head = begin + scale * (heads[judged] - tails[anchor])
        good = _on_strokes(tail, head, strokes)
        net = (good - _AMISS * (1.0 - good)) @ size[judged]
        best = max(best, float(net.max()))
    return best


def _proposed(anchor: complex, strokes: FloatArray) -> FloatArray:
    """Return (poses, 2) start and scale of the anchor, for strokes of about its direction and length."""
    run = strokes[:, 1] - strokes[:, 0]
    off = np.abs(np.angle((run / anchor) ** 2)) / 2.0
    scale = np.abs(run) / abs(anchor)
    fit = (
        (off < _ANCHOR_OFF_RAD)
        & (scale > _SCALES[0])
        & (scale < _SCALES[1])
        & (np.abs(run) >= _LEAST_ANCHOR_MM)
    )
    chosen = np.flatnonzero(fit)
    chosen = chosen[np.argsort(off[chosen])][:_TRIED]
    forward = (run[chosen] / anchor).real > 0
    begin = np.where(forward, strokes[chosen, 0], strokes[chosen, 1])
    return np.stack([begin, scale[chosen].astype(np.complex128)], axis=1)


def _on_strokes(tail: FloatArray, head: FloatArray, strokes: FloatArray) -> FloatArray:
    """Return (poses, lines) how well the best stroke matches each line, 0..1."""
    start, run = strokes[:, 0], strokes[:, 1] - strokes[:, 0]
    length = np.abs(run)
    along = run / length
    # Both ends of a line in each stroke's own axes: along it, and across.
    p = (tail[..., None] - start) * np.conj(along)
    q = (head[..., None] - start) * np.conj(along)
    across = np.maximum(np.abs(p.imag), np.abs(q.imag))
    low, high = np.minimum(p.real, q.real), np.maximum(p.real, q.real)
    covered = np.minimum(high, length) - np.maximum(low, 0.0)
    good = np.exp(-0.5 * (across / (2.0 * _OFF_MM)) ** 2)
    return np.asarray(np.where(covered >= _COVERED * (high - low), good, 0.0).max(axis=-1))


# The contact sheet --------------------------------------------------------------------------------

_THUMBNAIL_PX = 640
_QUALITY = 60


def thumbnail(grey: GreyImage) -> bytes:
    """Return a page reduced, as JPEG."""
    small = shrink(grey, min(1.0, _THUMBNAIL_PX / max(grey.shape)))
    picture = io.BytesIO()
    Image.fromarray(small).save(picture, "JPEG", quality=_QUALITY)
    return picture.getvalue()


def contact_sheet(entries: Sequence[tuple[Suggestion, bytes]], lang: str = "en") -> str:
    """A self-contained HTML page: every page's picture, its file, the student suggested, and why."""
    shown = [
        (suggestion, said(suggestion.why, tongue(lang)), base64.b64encode(picture).decode("ascii"))
        for suggestion, picture in entries
    ]
    return environment(lang).get_template("contact_sheet.html").render(entries=shown)
