"""The outcome of a criterion: its verdict, with what was measured and what was expected."""

import cmath
from collections.abc import Iterator, Mapping
from dataclasses import replace

from grader.comparison.task import Task
from grader.comparison.verdicts import FULL, NONE, MarkRange
from grader.documents import Quantity, Tolerance, Verdict
from grader.outcomes import CREDITED, EVEN, Outcome
from grader.records import Reason
from grader.rubric import CriterionTable
from reference.construction.elements import Line
from reference.construction.graph import Construction
from reference.construction.steps import Divide, Given, Similar, TwoLines
from reference.geometry import degrees
from reference.quantities import unit_of

RANKS: dict[Verdict, int] = {"none": 0, "partial": 1, "follow_through": 2, "full": 2}


def quantity(name: str, length_mm: float, direction_rad: float | None, value: float) -> Quantity:
    """The quantity of a vector; `direction_rad` on the sheet."""
    direction = None if direction_rad is None else degrees(direction_rad)
    return Quantity(length_mm=length_mm, direction_deg=direction, value=value, unit=unit_of(name))


def expected_quantity(name: str, expected: complex, scale: float, turn_rad: float) -> Quantity:
    """The quantity of an expected vector (complex mm); a zero vector has no direction."""
    direction = cmath.phase(expected) + turn_rad if abs(expected) > 1e-9 else None
    return quantity(name, abs(expected), direction, abs(expected) * scale)


def verdict_of(share: float, *, followed: bool) -> Verdict:
    """The verdict for a share of the points."""
    if share == FULL:
        return "follow_through" if followed else "full"
    return "none" if share == NONE else "partial"


def outcome_of(  # noqa: PLR0913 - one argument per field of the record
    criterion: CriterionTable,
    mark: MarkRange,
    measured: Quantity,
    expected: Quantity,
    tolerance: Tolerance,
    *,
    confidence: float = 1.0,
    followed: bool = False,
    mistake: str | None = None,
) -> Outcome:
    """The outcome of a marked criterion: under review where its mark is not certain."""
    lost = mark.share != FULL or not mark.is_certain or followed
    likely, probability = mark.share, mark.sure
    if not mark.is_certain and probability < EVEN:
        # Most probably misread: what is off as read is right, and the other way round.
        likely, probability = (mark.worst if likely == mark.best else mark.best), 1.0 - probability
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict_of(mark.share, followed=followed) if mark.is_certain else "review",
        measured=measured,
        expected=expected,
        tolerance=tolerance,
        confidence=confidence,
        reasons=mark.reasons if lost else (Reason("right"), *mark.reasons),
        possible=(verdict_of(mark.worst, followed=followed), verdict_of(mark.best, followed=followed)),
        shares=(mark.worst, mark.best),
        mistake=mistake,
        probability=probability,
        proposed=likely,
    )


def unjudged(
    criterion: CriterionTable,
    verdict: Verdict,
    reasons: tuple[Reason, ...],
    *,
    expected: Quantity,
    sure: float | None = None,
) -> Outcome:
    """The outcome of a criterion for which nothing was handed in, or nothing could be read."""
    is_open = verdict == "review"
    likely = EVEN if is_open else 1.0
    return Outcome(
        criterion=criterion.id,
        name=criterion.name,
        verdict=verdict,
        measured=Quantity(),
        expected=expected,
        tolerance=Tolerance(),
        confidence=0.0 if is_open else 1.0,
        reasons=reasons,
        possible=("none", "full") if is_open else (verdict, verdict),
        shares=(NONE, FULL if is_open else NONE),
        probability=likely if sure is None else sure,
    )


def settled_as(
    judged: Outcome, verdict: Verdict, share: float, reasons: tuple[Reason, ...], sure: float = 1.0
) -> Outcome:
    """The outcome with a verdict that stands, of this share of the points."""
    return replace(
        judged,
        verdict=verdict,
        possible=(verdict, verdict),
        shares=(share, share),
        proposed=share,
        probability=sure,
        reasons=reasons,
    )


def left_open(
    judged: Outcome, best: Verdict, share: float, reasons: tuple[Reason, ...], sure: float = EVEN
) -> Outcome:
    """The outcome left to a person, between nothing and the share of the points that a verdict gives."""
    return replace(
        judged,
        verdict="review",
        possible=("none", best),
        shares=(NONE, share),
        probability=sure,
        reasons=reasons,
    )


def without_drawing(judged: Outcome) -> Outcome:
    """The outcome of a value without the drawn vector that is asked for: no points, right or wrong."""
    return settled_as(judged, "none", NONE, (Reason("value_alone"), *judged.reasons))


def entry_refused(judged: Outcome, entries: tuple[str, ...]) -> Outcome:
    """The outcome left to a person, because the `entries` for it cannot be used."""
    reasons = [reason for reason in judged.reasons if reason.code != "right"]
    if judged.measured == Quantity():
        # The refused entry is the reason why nothing was judged.
        reasons = []
    refused = Reason("entry_refused", {"entries": entries})
    return replace(left_open(judged, "full", FULL, (refused, *reasons)), confidence=0.0, mistake=None)


def both(first: Outcome, second: Outcome, allowed_mm: float) -> Outcome:
    """The outcome of a vector with scan and measurement: for review where they differ in the verdict.

    Where one of them shows nothing to judge, the other is the outcome.
    """
    for one, other in ((first, second), (second, first)):
        if one.verdict == "not_judged":
            return other
    lengths = first.measured.length_mm or 0.0, second.measured.length_mm or 0.0
    params: dict[str, float | str] = {"first": lengths[0], "second": lengths[1], "unit": "mm"}
    differ = Reason("readings_disagree", params)
    if (first.verdict, first.possible, first.shares) == (second.verdict, second.possible, second.shares):
        if abs(lengths[0] - lengths[1]) <= allowed_mm:
            return first
        return replace(first, reasons=(*first.reasons, differ))
    ends = (*first.possible, *second.possible)
    low, high = min(ends, key=RANKS.__getitem__), max(ends, key=RANKS.__getitem__)
    shares = (*first.shares, *second.shares)
    return replace(
        first,
        verdict="review",
        possible=(low, high),
        shares=(min(shares), max(shares)),
        reasons=(differ, *first.reasons),
        confidence=0.5,
        probability=EVEN,
    )


# Components that a right image of a link's point replaces: they need not be drawn ------------------

LEFT_OUT = frozenset({"not_measured", "not_drawn", "no_line", "unread"})
"""Reasons why a vector was not judged: it was left out, or not found."""


def with_images(task: Task, outcomes: Mapping[str, Outcome]) -> dict[str, Outcome]:
    """The outcomes by criterion, with full marks for components that a right image replaces.

    None of the components of a point may be drawn, and the point's own vector must be right.
    """
    found = dict(outcomes)
    by_name = {one.name: key for key, one in outcomes.items()}
    for node in task.construction.images:
        replaced = [name for name in _replaced(task.construction, node) if name in by_name]
        own = [
            outcomes[by_name[vector.name]]
            for vector in task.construction.vectors.values()
            if vector.head == node and vector.name not in replaced and vector.name in by_name
        ]
        is_right = any(one.verdict in CREDITED and one.measured.length_mm is not None for one in own)
        if is_right and all(outcomes[by_name[name]].measured.length_mm is None for name in replaced):
            for name in replaced:
                found[by_name[name]] = _earned(outcomes[by_name[name]], own[0].name)
    return found


def _replaced(construction: Construction, node: str) -> Iterator[str]:
    """The components by which a point's image is made with perpendiculars, or which join it to its base."""
    step = construction.step(node)
    feet: set[str] = set()
    match step:
        case TwoLines(first=first, second=second):
            feet = {line.through for line in (first, second) if isinstance(line, Line)}
        case Similar(base=base) | Divide(base=base):
            feet = set(base)
    components = {foot for foot in feet if isinstance(construction.step(foot), Given)}
    poles = construction.poles.values()
    for vector in construction.vectors.values():
        is_component = vector.head in components and vector.part == "n"
        if is_component or (vector.head == node and vector.tail in feet and vector.tail not in poles):
            yield vector.name


def _earned(outcome: Outcome, of: str) -> Outcome:
    if outcome.verdict == "not_judged" or not LEFT_OUT & outcome.codes:
        return outcome
    earned = settled_as(outcome, "full", FULL, (Reason("by_similarity", {"of": of}),))
    return replace(earned, confidence=1.0)
