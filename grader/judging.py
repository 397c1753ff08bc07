"""Judging one submission: comparison, diagnosis and scoring in their order, and the report of it."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from grader.comparison import Comparison, Sketch, Submission, Task, compare, task_of
from grader.comparison.evidence import Evidence
from grader.diagnosis import LEAST_CONFIDENCE, Case, diagnose
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
from grader.outcomes import Judgement, Mistake, Outcome, Quantity
from grader.records import Problem
from grader.rubric import RubricFile
from grader.scoring import score
from reference.assignment import Assignment, Variant
from reference.elements import Coriolis, Normal, Parameters
from reference.geometry import ComplexArray
from reference.hand import Skill, trace
from reference.mistakes import Drawing
from reference.replay import Seen, Spread, Work
from reference.steps import Given

__all__ = ["Submission", "Task", "judge", "report_of", "task_of", "unjudged_report"]


def judge(task: Task, submission: Submission) -> Judgement:
    """Verdicts, mistakes and points of one submission for one variant."""
    comparison = compare(task, submission)
    diagnosis = diagnose(_case(task, comparison))
    if diagnosis.drawn and diagnosis.wrong and not comparison.evidence.has_sheets:
        # No sheet shows what was drawn: the diagnosis tells what measured vectors follow from.
        drawn = diagnosis.drawn
        drawn_by = Sketch("told", drawn.construction, drawn.parameters, diagnosis.wrong)
        comparison = compare(task, submission, drawn_by)
    mistakes = diagnosis.mistakes
    mistakes = (*mistakes, *_swaps_seen(task, submission, mistakes), *_not_drawn(task, comparison))
    outcomes = tuple(_with_mistake(outcome, mistakes) for outcome in comparison.outcomes)
    return Judgement(outcomes, mistakes, comparison.scales, score(task.rubric, outcomes))


def _swaps_seen(task: Task, submission: Submission, known: Sequence[Mistake]) -> list[Mistake]:
    """Letters seen at each other's node on a sheet: lines tell nothing of them, so diagnosis cannot."""
    vectors = task.construction.vectors
    told = {(one.detail["first"], one.detail["second"]) for one in known if one.code == "labels_swapped"}
    found = []
    for swap in (swap for reading in submission.readings for swap in reading.swapped):
        pair = swap.first, swap.second
        if swap.confidence < LEAST_CONFIDENCE or {pair, pair[::-1]} & told:
            continue
        told.add(pair)
        explains = tuple(
            one.id
            for one in task.rubric.criterion
            if one.name in vectors and {vectors[one.name].tail, vectors[one.name].head} & set(pair)
        )
        detail = {"first": swap.first, "second": swap.second}
        found.append(Mistake("labels_swapped", swap.first, explains, swap.confidence, detail))
    return found


def _not_drawn(task: Task, comparison: Comparison) -> list[Mistake]:
    """Vectors that are asked for, long enough, and not on the sheet although both their ends were read.

    What was not measured says nothing: nobody need measure everything.
    """
    evidence, construction = comparison.evidence, task.construction
    known = {*evidence.nodes, *construction.poles.values()} if evidence.has_sheets else set()
    found = []
    for one in comparison.outcomes:
        vector = construction.vectors.get(one.name)
        if vector is None or one.verdict not in {"none", "review"} or evidence.vector(one.name) is not None:
            continue
        is_left_out = {vector.tail, vector.head} <= known
        if is_left_out and (one.expected.length_mm or 0.0) >= LEAST_LEFT_OUT_MM:
            found.append(Mistake("vector_missing", one.name, (one.criterion,), LEFT_OUT))
    return found


LEAST_LEFT_OUT_MM = 5.0
"""A shorter one may hide in its ends' marks."""
LEFT_OUT = 0.9
"""How sure it is: of 368 vectors drawn between two ends read for certain, none was overlooked."""


def _case(task: Task, comparison: Comparison) -> Case:
    """The drawing to explain, at the scales used, with what contradicts them."""
    scales, followed, vectors = comparison.scales, comparison.followed, task.construction.vectors
    used = {
        name: np.asarray(followed[name] if scale.assumed else scale.used) for name, scale in scales.items()
    }
    parameters = {**task.parameters, **used}
    hand = task.rubric.hand
    skill = Skill(hand.angle_deg, hand.place_mm, hand.mark_mm)
    lost = [one for one in comparison.outcomes if one.verdict in LOST]
    return Case(
        drawing=Drawing(task.construction, parameters),
        work=Work(tuple(_seen(task, comparison, parameters, skill)), comparison.evidence.sketches),
        lost={one.name: one.criterion for one in lost if one.name in vectors},
        assignment=task.assignment,
        variant=task.variant,
        skill=skill,
        followed={
            name: other
            for name, other in followed.items()
            if other != scales[name].used and not scales[name].assumed
        },
        assumed=frozenset(name for name, scale in scales.items() if scale.assumed),
        scale_criteria={
            one.name: one.criterion for one in lost if one.name in scales and one.verdict in CHARGED
        },
    )


CHARGED = frozenset({"none", "partial"})
LOST = CHARGED | {"follow_through", "review"}
"""Verdicts whose cause is looked for: also where a person has still to decide."""
LEAST_MISS_MM = 0.15
"""However well a hand draws, and however well its drawing is read."""


def _seen(task: Task, comparison: Comparison, parameters: Parameters, skill: Skill) -> list[Seen]:
    """The student's own nodes, and the vectors that lead to none of them."""
    evidence, construction = comparison.evidence, task.construction
    given = {*construction.poles.values(), *task.ground}
    seen = [
        Seen(name, None, place, _missed_by(task, evidence, name))
        for name, place in evidence.nodes.items()
        if name not in given
    ]
    traced = None
    for name, vector in construction.vectors.items():
        drawn = evidence.vector(name)
        if drawn is None or drawn.confidence < task.rubric.least_confidence or vector.head in evidence.nodes:
            continue
        value, read_mm = drawn.as_complex, math.hypot(LEAST_MISS_MM, drawn.se_mm, task.rubric.hand.ruler_mm)
        if value is not None:
            seen.append(Seen(vector.head, vector.tail, value, _spread(NOTHING, read_mm)))
            continue
        # What leads to a length is not seen: all earlier errors are in it.
        traced = traced or trace(construction, parameters, skill)
        spread = _spread(traced.moved(vector.tail, vector.head), read_mm)
        seen.append(Seen(vector.head, vector.tail, drawn.length_mm, spread, has_direction=False))
    return seen


def _missed_by(task: Task, evidence: Evidence, node: str) -> Spread:
    """How far a node may be missed by being read, or by the measurements that lead to it."""
    vectors = [one for one in task.construction.vectors.values() if one.head == node]
    hand = task.rubric.hand
    rows: list[ComplexArray] = [NOTHING]
    each_mm = LEAST_MISS_MM if evidence.has_sheets else hand.ruler_mm
    for vector in vectors[:1]:
        drawn = evidence.vector(vector.name)
        along = None if drawn is None else drawn.as_complex
        if along and not evidence.has_sheets:
            # Both ends of a step are measured.
            turned = 1j * along * math.radians(hand.protractor_deg)
            rows.append(
                math.sqrt(2.0) * np.array([hand.ruler_mm * along / abs(along), turned], np.complex128)
            )
        if along:
            share = _computed_within(task, evidence, node, math.sqrt(2.0) * each_mm)
            rows.append(np.array([along * share], np.complex128))
    return _spread(np.concatenate(rows), LEAST_MISS_MM)


def _computed_within(task: Task, evidence: Evidence, node: str, each_mm: float) -> float:
    """The relative error of a component that is computed from velocities as they were read or measured."""
    sources: tuple[tuple[str, str, float], ...]
    match task.construction.step(node):
        case Given(length=Normal(tail=tail, head=head)):
            sources = ((tail, head, 2.0),)
        case Given(length=Coriolis(slide=slide, turn=turn)):
            sources = ((*slide, 1.0), (*turn, 1.0))
        case _:
            return 0.0
    ends = {
        name: place for one in sources for name in one[:2] if (place := evidence.nodes.get(name)) is not None
    }
    errors = [
        power * each_mm / max(abs(ends[head] - ends[tail]), each_mm)
        for tail, head, power in sources
        if tail in ends and head in ends
    ]
    return math.hypot(*errors)


NOTHING: ComplexArray = np.zeros(0, np.complex128)


def _spread(moved: ComplexArray, least_mm: float) -> Spread:
    """What independent errors make of an end together: variance along x, covariance, variance along y."""
    x, y = moved.real, moved.imag
    return float(x @ x) + least_mm**2, float(x @ y), float(y @ y) + least_mm**2


def _with_mistake(outcome: Outcome, mistakes: Sequence[Mistake]) -> Outcome:
    """The outcome with the mistake that explains its loss."""
    if outcome.verdict not in {"none", "partial"}:
        return outcome
    found = next((one for one in mistakes if outcome.criterion in one.explains), None)
    if found is None or outcome.mistake is not None:
        return outcome
    return replace(outcome, mistake=found.code, cause=found)


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


def _mistake(one: Mistake) -> MistakeDocument:
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


def _detail(one: Mistake) -> str:
    return ", ".join(
        f"{key} = {value:.6g}" if isinstance(value, float) else f"{key} = {value}"
        for key, value in one.detail.items()
    )
