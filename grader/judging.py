"""Judging one submission: comparison, diagnosis and scoring in their order."""

from collections.abc import Sequence
from dataclasses import replace

from grader.comparison import Comparison, Sketch, Submission, Task, compare, task_of
from grader.diagnosis import LEAST_CONFIDENCE, diagnose
from grader.outcomes import Judgement, NamedMistake, Outcome
from grader.scoring import score
from grader.witness import case_of
from reference.mistakes import Mistake

__all__ = ["Submission", "Task", "judge", "task_of"]


def judge(task: Task, submission: Submission) -> Judgement:
    """Verdicts, mistakes and points of one submission for one variant."""
    comparison = compare(task, submission)
    diagnosis = diagnose(case_of(task, comparison))
    is_turned = bool(diagnosis.wrong & task.construction.poles.keys())
    if diagnosis.drawn and diagnosis.wrong and (is_turned or not comparison.evidence.has_sheets):
        # Where no sheet shows what was drawn, or a plan is turned, diagnosis tells what follows from what.
        drawn = diagnosis.drawn
        drawn_by = Sketch("told", drawn.construction, drawn.parameters, diagnosis.wrong)
        comparison = compare(task, submission, drawn_by)
    mistakes = diagnosis.mistakes
    mistakes = (*mistakes, *_swaps_seen(task, submission, mistakes), *_not_drawn(task, comparison))
    outcomes = tuple(_with_mistake(outcome, mistakes) for outcome in comparison.outcomes)
    return Judgement(outcomes, mistakes, comparison.scales, score(task.rubric, outcomes))


def _swaps_seen(task: Task, submission: Submission, known: Sequence[NamedMistake]) -> list[NamedMistake]:
    """Letters seen at each other's node on a sheet: lines tell nothing of them, so diagnosis cannot."""
    vectors = task.construction.vectors
    told = {one.mistake.other for one in known if one.code == "labels_swapped"}
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
        mistake = Mistake("labels_swapped", swap.first, other=pair)
        found.append(NamedMistake(mistake, explains, swap.confidence))
    return found


def _not_drawn(task: Task, comparison: Comparison) -> list[NamedMistake]:
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
            mistake = Mistake("vector_missing", one.name)
            found.append(NamedMistake(mistake, (one.criterion,), LEFT_OUT))
    return found


LEAST_LEFT_OUT_MM = 5.0
"""A shorter one may hide in its ends' marks."""
LEFT_OUT = 0.9
"""How sure it is: of 368 vectors drawn between two ends read for certain, none was overlooked."""


def _with_mistake(outcome: Outcome, mistakes: Sequence[NamedMistake]) -> Outcome:
    """The outcome with the mistake that explains its loss."""
    if outcome.verdict not in {"none", "partial"}:
        return outcome
    found = next((one for one in mistakes if outcome.criterion in one.explains), None)
    if found is None or outcome.mistake is not None:
        return outcome
    return replace(outcome, mistake=found.code, cause=found)
