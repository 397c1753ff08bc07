"""People's decisions on a submission: verdicts in place of the program's, nodes, points, a comment."""

import math
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import cast

from grader.comparison.outcomes import unjudged
from grader.comparison.verdicts import OPENING
from grader.documents import (
    AppliedDecisionDocument,
    CriterionDocument,
    DecidedDocument,
    ReportDocument,
    Verdict,
)
from grader.marking.mark import DECIMALS, score, with_mistake
from grader.marking.settling import at_stake
from grader.outcomes import CHARGED, Judgement, NamedMistake, Outcome
from grader.reading.corrected import corrected
from grader.records import PageRef, Reason, ScannedPage, Value
from grader.rubric import CriterionTable, RubricFile
from grader.tables.decisions import Decision
from grader.tables.measurements import StudentSubmission
from grader.texts.spoken import problem_documents
from reference.authored.assignment import Assignment
from reference.construction.graph import Construction
from reference.plan import construction_for

NOT_APPLIED = "decision_not_applied"
"""The problem of a decision that does not fit what was read; its parameter names the criterion."""


def why_not(row: Decision, criterion: CriterionTable, rubric: RubricFile) -> Reason | None:
    """Return why the points of a decision contradict its verdict or the rubric; None if they do not."""
    maximum, points = rubric.points[criterion.id], row.points
    if points is None:
        return None
    if points > maximum and not math.isclose(points, maximum, abs_tol=1e-6):
        known: dict[str, Value] = {"given_points": points, "most_points": maximum, "criterion": criterion.id}
        return Reason("points_above", known)
    right: Mapping[str, float] = {"full": maximum, "none": 0.0}
    if row.verdict in right and not math.isclose(points, right[row.verdict], abs_tol=1e-6):
        known = {"verdict": row.verdict, "most_points": right[row.verdict], "given_points": points}
        return Reason("points_contradict", known)
    return Reason("points_contradict") if row.verdict == "not_judged" else None


def decide(judgement: Judgement, rubric: RubricFile, rows: Sequence[Decision]) -> Judgement:
    """The judgement with the verdicts that people decided, and the score that follows.

    A mistake that explained only what was decided to be right is no longer named.
    """
    by_criterion = {row.criterion: row for row in rows if row.kind == "verdict"}
    if not by_criterion:
        return judgement
    outcomes: tuple[Outcome, ...] = tuple(
        _decided(outcome, by_criterion[outcome.criterion], rubric)
        if outcome.criterion in by_criterion
        else outcome
        for outcome in judgement.outcomes
    )
    acquitted = {
        one.criterion for one in outcomes if one.criterion in by_criterion and one.verdict not in CHARGED
    }
    mistakes = tuple(_left(judgement.mistakes, acquitted))
    outcomes = tuple(with_mistake(outcome, mistakes) for outcome in at_stake(rubric, outcomes))
    return replace(judgement, outcomes=outcomes, mistakes=mistakes, score=score(rubric, outcomes))


def _decided(outcome: Outcome, row: Decision, rubric: RubricFile) -> Outcome:
    verdict = cast("Verdict", row.verdict)
    share = None if row.points is None else row.points / rubric.points[outcome.criterion]
    keeps = verdict == outcome.verdict
    return replace(
        outcome,
        verdict=verdict,
        possible=(verdict, verdict),
        shares=() if share is None else (share, share),
        confidence=1.0,
        probability=1.0,
        reasons=outcome.reasons if keeps else tuple(_reasons(outcome.reasons, verdict)),
        mistake=outcome.mistake if verdict in CHARGED else None,
        cause=outcome.cause if verdict in CHARGED else None,
    )


FOR_THE_STUDENT = frozenset(
    {"counted_for_you", "not_certainly_within", "at_stake", "other_variant", "data_misread", "data_unclear"}
)
"""Reasons of rules that hold where nobody decides."""
REMARKS = frozenset({"right", "too_short_to_judge", "scale_assumed"})
"""Reasons that tell of no loss."""
FOLLOWED = "follows"


def _reasons(reasons: Sequence[Reason], verdict: Verdict) -> Sequence[Reason]:
    """Return the reasons that support a person's verdict; without any, that a person decided.

    Reasons that contradict the verdict, and those of the program's doubt, are left out.
    """
    said = [one for one in reasons if one.code not in OPENING | FOR_THE_STUDENT | {FOLLOWED}]
    losses = [one for one in said if one.code not in REMARKS]
    followed = [one for one in reasons if one.code == FOLLOWED]
    match verdict:
        case "full" if not losses:
            return said or [Reason("right")]
        case "none" | "partial" if losses:
            return said
        case "follow_through" if followed:
            return followed
    return [Reason("decided")]


def _left(mistakes: Sequence[NamedMistake], acquitted: set[str]) -> Iterator[NamedMistake]:
    for mistake in mistakes:
        explains = tuple(name for name in mistake.explains if name not in acquitted)
        if explains or not mistake.explains:
            yield replace(mistake, explains=explains)


def open_again(judgement: Judgement, rubric: RubricFile, submission: StudentSubmission) -> Judgement:
    """The judgement of a submission of which nothing could be read: what is asked for waits for a person."""
    why = Reason("unread" if submission.pages or submission.has_unusable else "not_measured")
    criteria = {one.id: one for one in rubric.criterion}
    outcomes = tuple(
        one
        if one.verdict == "not_judged"
        else unjudged(criteria[one.criterion], "review", (why,), expected=one.expected)
        for one in judgement.outcomes
    )
    return replace(judgement, outcomes=outcomes, mistakes=(), score=score(rubric, outcomes))


# Nodes ----------------------------------------------------------------------------------------------


def with_nodes(
    pages: Sequence[ScannedPage], submission: StudentSubmission, assignment: Assignment
) -> tuple[list[ScannedPage], list[Reason]]:
    """The pages with nodes where people put them, and what is wrong with those that lie on no page."""
    places = {row.node: row.place for row in submission.decided if row.kind == "node"}
    if not places:
        return list(pages), []
    construction = construction_for(assignment)
    changed, astray = corrected(pages, places, construction)
    return changed, [_not_applied(f"node:{figure}:{node}", "no_page_has_figure") for figure, node in astray]


def _not_applied(criterion: str, why: str) -> Reason:
    return Reason(NOT_APPLIED, {"criterion": criterion, "why": why})


def strokes_on(page: PageRef, rows: Sequence[Decision]) -> list[Decision]:
    """Return the strokes of ink that people drew on a page."""
    ink = [row for row in rows if row.kind == "ink"]
    return [row for row in ink if (row.scan.file, row.scan.page or 1) == (page.file, page.page)]


def with_ink(pages: Sequence[ScannedPage], rows: Sequence[Decision]) -> list[ScannedPage]:
    """The pages with what people drew on them for the student, if there is a picture to show it on."""
    return [
        replace(
            page, backdrop=replace(page.backdrop, ink=tuple(row.stroke for row in strokes_on(page.ref, rows)))
        )
        if page.backdrop is not None and page.backdrop.registered
        else page
        for page in pages
    ]


# The report -----------------------------------------------------------------------------------------


def with_decisions(
    report: ReportDocument,
    submission: StudentSubmission,
    before: Judgement | None = None,
    construction: Construction | None = None,
) -> ReportDocument:
    """Return the report with people's decisions: who decided what, the verdicts before, points, a comment.

    Arguments: `before`, the program's own judgement; the construction; neither for what was not judged.
    """
    rows = submission.decided
    if not rows:
        return report
    if report.score_range is None and any(row.kind == "total" for row in rows):
        problems = [*report.problems, *problem_documents([_not_applied("total", "nothing_judged")])]
        report = report.model_copy(update={"problems": problems})
    astray = {one.parameters["criterion"] for one in report.problems if one.code == NOT_APPLIED}
    kinds: dict[str, list[Decision]] = defaultdict(list)
    for row in rows:
        if row.criterion not in astray:
            kinds[row.kind].append(row)
    verdicts = {} if before is None else {one.criterion: one.verdict for one in before.outcomes}
    own = {row.criterion: row for row in kinds["verdict"]}
    moved = {row.node[1]: row for row in kinds["node"]}
    criteria = [
        _with_verdict(one, own[one.id], verdicts.get(one.id))
        if one.id in own
        else _with_node(one, moved, construction)
        for one in report.criteria
    ]
    if before is not None and all(
        one.confidence == 0.0 or one.verdict == "not_judged" for one in before.outcomes
    ):
        nothing = {"probability": None, "proposed": None}
        criteria = [one if one.verdict != "review" else one.model_copy(update=nothing) for one in criteria]
    comment = "\n".join(row.comment for row in (*kinds["total"], *kinds["comment"]) if row.comment)
    applied = [AppliedDecisionDocument.model_validate(row) for row in rows if row.criterion not in astray]
    report = report.model_copy(update={"criteria": criteria, "comment": comment, "decisions": applied})
    for row in kinds["total"]:
        report = _with_points(report, row)
    return report


def _with_verdict(one: CriterionDocument, row: Decision, before: Verdict | None) -> CriterionDocument:
    decided = DecidedDocument(by=row.by, at=row.at, before=before, comment=row.comment)
    return one.model_copy(update={"decided": decided, "probability": 1.0, "proposed": None})


def _with_node(
    one: CriterionDocument, moved: Mapping[str, Decision], construction: Construction | None
) -> CriterionDocument:
    """A criterion of a vector or link between nodes that a person put in their places."""
    if construction is None or not moved:
        return one
    vector = construction.vectors.get(one.vector or "")
    ends = construction.links.get(one.link or "", ()) if vector is None else (vector.tail, vector.head)
    row = next((moved[end] for end in ends if end in moved), None)
    if row is None:
        return one
    decided = DecidedDocument(by=row.by, at=row.at, before=None, comment=row.comment)
    return one.model_copy(update={"decided": decided})


def _with_points(report: ReportDocument, row: Decision) -> ReportDocument:
    """Return the report with points added or subtracted within its limits; `added` is their number."""
    if report.score_range is None:
        return report

    def moved(score: float) -> float:
        return round(min(max(score + (row.points or 0.0), 0.0), report.max_score), DECIMALS)

    low, high = report.score_range
    known = low if report.score is None else report.score
    update = {
        "score": None if report.score is None else moved(report.score),
        "score_range": (moved(low), moved(high)),
        "expected_score": None if report.expected_score is None else moved(report.expected_score),
        "added": round(moved(known) - known, DECIMALS),
    }
    return report.model_copy(update=update)
