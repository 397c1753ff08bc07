"""A judgement's mistakes in the student's words, put into the report: what was done, what to redo."""

from collections.abc import Mapping

from grader.documents import MistakeDocument, ReportDocument, RivalDocument
from grader.feedback.sentences import Level, one_mistake
from grader.i18n import Tongue, tongue
from grader.outcomes import Judgement, NamedMistake
from grader.plan_steps.redoing import redo
from grader.plan_steps.words import wording_of
from reference.assignment import Assignment, Variant
from reference.drawing.subject import Subject
from reference.plan import exact_plan


def with_mistakes_told(
    report: ReportDocument,
    judgement: Judgement,
    assignment: Assignment,
    variant: Variant,
    lang: str,
    level: Level = "full",
) -> ReportDocument:
    """The report with its mistakes told: `feedback` and, step by step, what to `redo`.

    Arguments: `report` is that of the `judgement`, its mistakes in the same order. At level `symbol`
    nothing is told, at `hint` no number.
    """
    if not judgement.mistakes or level == "symbol":
        return report
    speaker, names = tongue(lang), assignment.file.names
    subject = _subject(judgement, assignment, variant, speaker)
    told = [
        document.model_copy(
            update={
                "feedback": one_mistake(mistake, speaker, level, names),
                "rivals": _rivals(document, mistake, speaker, level, names),
                "redo": _redo(subject, mistake, speaker, level),
            }
        )
        for document, mistake in zip(report.mistakes, judgement.mistakes, strict=True)
    ]
    return report.model_copy(update={"mistakes": told})


def _rivals(
    document: MistakeDocument, mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str]
) -> list[RivalDocument]:
    return [
        rival.model_copy(update={"feedback": one_mistake(one, speaker, level, names)})
        for rival, one in zip(document.rivals, mistake.rivals, strict=True)
    ]


def _subject(judgement: Judgement, assignment: Assignment, variant: Variant, speaker: Tongue) -> Subject:
    """The right plan at the scales that the student drew at."""
    used = {name: scale.used for name, scale in judgement.scales.items()}
    plan = exact_plan(assignment, [variant], assignment.scales([variant], **used))
    return Subject(assignment, plan, 0, wording_of(speaker))


def _redo(subject: Subject, mistake: NamedMistake, speaker: Tongue, level: Level) -> list[str]:
    """The steps from the mistake on; none where there is no single step that it was made at."""
    vectors = subject.plan.construction.vectors
    node = vectors[mistake.at].head if mistake.at in vectors else mistake.at
    return redo(subject, speaker, node, with_numbers=level == "full")
