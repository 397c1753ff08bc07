"""The report of a submission, as the published schema has it."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields

from grader.comparison.task import Task
from grader.documents import ReadingDocument, ReasonDocument, ReportDocument, Status
from grader.outcomes import Judgement, NamedMistake, Outcome, UsedScale
from grader.records import Figure, Reason, ScannedPage, Sheet, on_sheet
from grader.rubric import RubricFile
from grader.texts.reasons import reason_sentence
from grader.texts.spoken import ENGLISH, as_json, clause, problem_documents, unread_document
from reference.authored.assignment import SCALE_NAMES, Assignment, Variant
from reference.quantities import vector_of_value

STAGES = ("decode", "sheet", "ink", "reading")


def reading_document(page: ScannedPage, student_id: str | None) -> ReadingDocument:
    """The document of one page."""
    timing = {stage: page.timing_ms.get(stage, 0.0) for stage in STAGES}
    of_sheet = () if page.sheet is None else page.sheet.problems
    return ReadingDocument.model_validate(
        {
            "source": page.ref.file,
            "page": page.ref.page,
            "student_id": student_id,
            "sheet": None if page.sheet is None else _sheet(page.sheet),
            "figures": {name: _figure(figure) for name, figure in page.reading.figures.items()},
            "altitudes": page.reading.altitudes,
            "unread": [unread_document(gap) for gap in page.reading.unread],
            "problems": [*problem_documents((*of_sheet, *page.problems, *page.reading.problems))],
            "timing_ms": {**timing, "total": sum(timing.values())},
        }
    )


def _sheet(sheet: Sheet) -> dict[str, object]:
    stored = sheet.mm_to_px if sheet.lens is None else sheet.lens.stored
    fields = {name: getattr(sheet, name) for name in ("method", "px_per_mm", "rotation_deg", "residual_mm")}
    return {**fields, "mm_to_px": stored.tolist()}


def _figure(figure: Figure) -> dict[str, object]:
    nodes = {
        name: {
            "x_mm": node.at.real,
            "y_mm": -node.at.imag,
            "se_mm": node.se_mm,
            "confidence": node.confidence,
        }
        for name, node in figure.nodes.items()
    }
    drawn = {name: [on_sheet(end) for end in ends] for name, ends in figure.drawn.items()}
    return {"nodes": nodes, "vectors": figure.vectors, "drawn": drawn}


def report_of(  # noqa: PLR0913 - what a report holds beside the judgement
    task: Task,
    judgement: Judgement,
    student_id: str,
    *,
    language: str = "en",
    sentences: Mapping[str, str] | None = None,
    problems: Sequence[Reason] = (),
    sheets: Sequence[ReadingDocument] = (),
    sources: Mapping[str, str] | None = None,
) -> ReportDocument:
    """The report of a judged submission.

    Arguments
    ---------
    sentences : the feedback's, by criterion id, in the student's language
    sources : where each scale was declared
    """
    titles = {one.id: one.title.in_language(language) for one in task.rubric.criterion}
    sections = {one.id: one.section for one in task.rubric.criterion if task.rubric.weight_of(one.section)}
    maxima = task.rubric.points
    refused = [
        Reason(
            "scale_refused",
            {"scale": name, "text": scale.text or "", "why": scale.refused.code, **scale.refused.parameters},
        )
        for name, scale in judgement.scales.items()
        if scale.refused
    ]
    return ReportDocument.model_validate(
        {
            **_head(task.assignment, task.variant, student_id),
            "status": "needs_review" if judgement.needs_review else "graded",
            "score": judgement.score.total,
            "score_range": (judgement.score.low, judgement.score.high),
            "max_score": judgement.score.maximum,
            "expected_score": judgement.score.expected,
            "criteria": [
                {
                    **_criterion(outcome, on_sketch=outcome.name in task.rubric.on_sketch),
                    "title": titles[outcome.criterion],
                    "points": judgement.score.points[outcome.criterion],
                    "max_points": maxima[outcome.criterion],
                    "section": sections.get(outcome.criterion),
                    "feedback": (sentences or {}).get(outcome.criterion, ""),
                }
                for outcome in judgement.outcomes
            ],
            "mistakes": [
                {
                    **_mistake(mistake),
                    "explains": mistake.explains,
                    "rivals": [*map(_mistake, mistake.rivals)],
                }
                for mistake in judgement.mistakes
            ],
            "scales": {
                name: _scale(scale) | {"source": (sources or {}).get(name)}
                for name, scale in judgement.scales.items()
            },
            "problems": [*problem_documents((*problems, *refused, *_unfit(judgement)))],
            "reading": {"sheets": sheets},
        }
    )


def _scale(scale: UsedScale) -> dict[str, object]:
    refused = scale.refused and clause(scale.refused, ENGLISH)
    return {**{one.name: getattr(scale, one.name) for one in fields(scale)}, "refused": refused}


def _unfit(judgement: Judgement) -> Iterator[Reason]:
    """The problem of a submission that no explanation reaches."""
    if judgement.unfit is not None:
        vectors, of = judgement.unfit.vectors, judgement.unfit.of
        yield Reason("not_explained", {"unfit": vectors, "of": of})


def unjudged_report(  # noqa: PLR0913 - what a report holds beside the status
    assignment: Assignment,
    rubric: RubricFile,
    variant: Variant,
    student_id: str,
    status: Status,
    *,
    problems: Sequence[Reason] = (),
    sheets: Sequence[ReadingDocument] = (),
) -> ReportDocument:
    """The report of a submission that is missing or unreadable: no score, the reasons in `problems`."""
    return ReportDocument.model_validate(
        {
            **_head(assignment, variant, student_id),
            "status": status,
            "score": None,
            "score_range": None,
            "max_score": rubric.max_score,
            "problems": [*problem_documents(problems)],
            "reading": {"sheets": sheets},
        }
    )


def _head(assignment: Assignment, variant: Variant, student_id: str) -> dict[str, object]:
    return {
        "student_id": student_id,
        "assignment": assignment.id,
        "variant": {} if variant.n is None else {"n": variant.n},
        "position": variant.position,
    }


def _criterion(outcome: Outcome, *, on_sketch: bool) -> dict[str, object]:
    """The fields of a criterion that come from its outcome."""
    kind = "on_sketch" if on_sketch else "vector" if "_" in outcome.name else "link"
    of_value = vector_of_value(outcome.name)
    about = {"value": of_value} if of_value else {} if outcome.name in SCALE_NAMES else {kind: outcome.name}
    return {
        "id": outcome.criterion,
        "vector": None,
        **about,
        "verdict": outcome.verdict,
        "measured": outcome.measured,
        "expected": outcome.expected,
        "tolerance": outcome.tolerance,
        "confidence": outcome.confidence,
        "probability": None if outcome.verdict == "not_judged" else outcome.probability,
        "proposed": outcome.proposed_verdict if outcome.verdict == "review" else None,
        "mistake": outcome.mistake,
        "reasons": [reason.code for reason in outcome.reasons],
        "why": [_reason(reason) for reason in outcome.reasons],
    }


def _reason(reason: Reason) -> ReasonDocument:
    said = reason_sentence(reason, ENGLISH, "full")
    return ReasonDocument(code=reason.code, message=said, parameters=as_json(reason.parameters))


def _mistake(mistake: NamedMistake) -> dict[str, object]:
    """The fields that a mistake and a rival have in common."""
    detail = ", ".join(
        f"{key} = {value:.6g}" if isinstance(value, float) else f"{key} = {value}"
        for key, value in mistake.detail.items()
    )
    return {
        "code": mistake.code,
        "at": mistake.at,
        "confidence": mistake.confidence,
        "detail": detail,
        "parameters": mistake.detail,
    }
