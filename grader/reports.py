"""The report of a submission: what was judged, as the published schema has it."""

from collections.abc import Mapping, Sequence

from grader.comparison import Task
from grader.documents import (
    CriterionDocument,
    MistakeDocument,
    ProblemDocument,
    QuantityDocument,
    ReadingDocument,
    ReadSheets,
    ReportDocument,
    RivalDocument,
    ScaleDocument,
    Status,
    ToleranceDocument,
)
from grader.outcomes import Judgement, NamedMistake, Outcome, Quantity
from grader.records import Problem
from grader.rubric import RubricFile
from reference.assignment import Assignment, Variant


def report_of(  # noqa: PLR0913 - what a report holds beside the judgement
    task: Task,
    judgement: Judgement,
    student_id: str,
    *,
    language: str = "en",
    sentences: Mapping[str, str] | None = None,
    problems: Sequence[Problem] = (),
    sheets: Sequence[ReadingDocument] = (),
) -> ReportDocument:
    """The report of a judged submission.

    Arguments: `sentences` are the feedback's, by criterion id, in the student's language.
    """
    told = sentences or {}
    titles = {one.id: one.title.in_language(language) for one in task.rubric.criterion}
    maxima = task.rubric.points
    refused = [
        Problem("scale_refused", f"{name}: {scale.refused}")
        for name, scale in judgement.scales.items()
        if scale.refused
    ]
    return ReportDocument(
        **_head(task.assignment, task.variant, student_id),
        status="needs_review" if judgement.needs_review else "graded",
        score=judgement.score.total,
        score_range=(judgement.score.low, judgement.score.high),
        max_score=judgement.score.maximum,
        criteria=[
            _criterion(
                one,
                titles[one.criterion],
                judgement.score.points[one.criterion],
                maxima[one.criterion],
                told.get(one.criterion, ""),
            )
            for one in judgement.outcomes
        ],
        mistakes=[_mistake(one) for one in judgement.mistakes],
        scales={
            name: ScaleDocument(
                declared=one.declared, used=one.used, assumed=one.assumed, text=one.text, refused=one.refused
            )
            for name, one in judgement.scales.items()
        },
        problems=_problems([*problems, *refused]),
        reading=ReadSheets(sheets=list(sheets)),
    )


def unjudged_report(  # noqa: PLR0913 - as above
    assignment: Assignment,
    rubric: RubricFile,
    variant: Variant,
    student_id: str,
    status: Status,
    *,
    problems: Sequence[Problem] = (),
    sheets: Sequence[ReadingDocument] = (),
) -> ReportDocument:
    """The report of a submission that is missing or unreadable: no score, the reasons in `problems`."""
    return ReportDocument(
        **_head(assignment, variant, student_id),
        status=status,
        score=None,
        score_range=None,
        max_score=rubric.max_score,
        problems=_problems(problems),
        reading=ReadSheets(sheets=list(sheets)),
    )


def _head(assignment: Assignment, variant: Variant, student_id: str) -> dict[str, object]:
    return {
        "student_id": student_id,
        "assignment": assignment.id,
        "variant": {} if variant.n is None else {"n": variant.n},
        "position": variant.position,
    }


def _problems(problems: Sequence[Problem]) -> list[ProblemDocument]:
    return [ProblemDocument(code=one.code, message=one.message, file=one.file) for one in problems]


def _criterion(
    outcome: Outcome, title: str, points: float | None, max_points: float, feedback: str
) -> CriterionDocument:
    is_vector = outcome.name not in {"kL", "kv", "ka"} and "_" in outcome.name
    return CriterionDocument(
        id=outcome.criterion,
        title=title,
        vector=outcome.name if is_vector else None,
        points=points,
        max_points=max_points,
        verdict=outcome.verdict,
        measured=_quantity(outcome.measured),
        expected=_quantity(outcome.expected),
        tolerance=ToleranceDocument(
            length_mm=outcome.tolerance.length_mm,
            direction_deg=outcome.tolerance.direction_deg,
            value=outcome.tolerance.value,
            widened=outcome.tolerance.widened,
        ),
        confidence=outcome.confidence,
        mistake=outcome.mistake,
        feedback=feedback,
        reasons=[reason.code for reason in outcome.reasons],
        link=outcome.name if outcome.name not in {"kL", "kv", "ka"} and not is_vector else None,
    )


def _quantity(one: Quantity) -> QuantityDocument:
    return QuantityDocument(
        length_mm=one.length_mm, direction_deg=one.direction_deg, value=one.value, unit=one.unit
    )


def _mistake(one: NamedMistake) -> MistakeDocument:
    return MistakeDocument(
        code=one.code,
        at=one.at,
        explains=list(one.explains),
        confidence=one.confidence,
        detail=_detail(one),
        rivals=[
            RivalDocument(code=rival.code, at=rival.at, confidence=rival.confidence, detail=_detail(rival))
            for rival in one.rivals
        ],
    )


def _detail(one: NamedMistake) -> str:
    return ", ".join(
        f"{key} = {value:.6g}" if isinstance(value, float) else f"{key} = {value}"
        for key, value in one.detail.items()
    )
