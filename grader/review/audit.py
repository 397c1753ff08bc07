"""The audit's page: one settled verdict after another, and whether it is right.

Neither the probability nor why a verdict was chosen is shown: a person should judge the drawing.
"""

from typing import Any

from grader.feedback.class_page import audit_sentence
from grader.feedback.words import VERDICTS
from grader.language import N_, Tongue
from grader.marking.trust import Checkable, checkable, next_to_check, sample, trust_of
from grader.overlay.scene import MARKS
from grader.review import questions
from grader.review.session import Answer, Said, Session, Student, mark_of
from grader.tables.decision_texts import ANSWERS, AuditAnswer
from grader.texts.spoken import RefusedError

SHORT = 24
"""Verdicts of the sample before the least sure ones are asked: if all are right, at most 12 % are wrong."""
SHOWN = ("title", "numbers", "sentence", "look", "seen", "student", "criterion")
"""Facts of a question that are shown: not the probability, nor why a person is asked."""
SAYS = N_("The program says: %(verdict)s. Is that right?")
ALL_CHECKED = N_("Every settled verdict has been checked.")
TEXTS = {
    **{name: questions.TEXTS[name] for name in ("gone", "no_scan", "no_picture", "close")},
    "instead": N_("What is right instead?"),
    "opened": N_("Similar verdicts are in the review now."),
    "undone": N_("Nothing was decided in this window."),
}


class Checked(Said):
    """A person's check of a settled verdict, `said`; `answer` is one of `ANSWERS`, `seen` as in `Answer`."""

    student: str
    criterion: str
    said: str
    answer: str
    seen: str = ""


def texts(speaker: Tongue) -> dict[str, str]:
    """Return the texts of the script in a language."""
    return {name: speaker.gettext(text) for name, text in TEXTS.items()}


def audit_facts(session: Session, speaker: Tongue) -> dict[str, Any]:
    """Return the results so far, and the next verdict to check."""
    reports = [student.report for student in session.students]
    verdicts = checkable(reports)
    trust = trust_of(reports, session.batch.rubric.doubt.settle)
    one = _next(verdicts)
    return {
        "checked": len(sample(verdicts)),
        "short": min(SHORT, len(verdicts)),
        "found": "" if trust is None else audit_sentence(trust, speaker),
        "none": speaker.gettext(ALL_CHECKED),
        "question": None if one is None else _question(session, one, speaker),
    }


def _next(verdicts: list[Checkable]) -> Checkable | None:
    """Return the next of the random sample; once that is long enough, first the least sure ones."""
    asked = next_to_check(verdicts, 1)
    least = asked[1:] if len(sample(verdicts)) >= SHORT else []
    return next(iter([*least, *asked]), None)


def _question(session: Session, one: Checkable, speaker: Tongue) -> dict[str, Any]:
    student = _student(session, one)
    about = questions.question_facts(session, student, one.criterion, speaker)
    verdict = speaker.gettext(VERDICTS[one.said.verdict])
    return {
        **{name: about[name] for name in SHOWN},
        "number": student.number + 1,
        "label": questions.label_of(student, speaker),
        "said": one.said.verdict,
        "checked": mark_of(session.standing().of(student, f"audit:{one.criterion}")),
        "mark": MARKS[one.said.verdict],
        "asks": speaker.gettext(SAYS) % {"verdict": verdict},
    }


def _student(session: Session, one: Checkable) -> Student:
    return next(
        student
        for student in session.students
        if (student.report.student_id, student.report.position) == (one.student, one.position)
    )


def check(session: Session, said: Checked) -> None:
    """Write a person's check. Raises as `Session.decide`."""
    if said.answer not in ANSWERS or said.said not in VERDICTS:
        raise RefusedError(400, "answer_refused", "no_answer", given=said.answer[:40])
    verdict = str(AuditAnswer(said.answer, said.said))
    answer = Answer(said.student, f"audit:{said.criterion}", verdict, seen=said.seen)
    session.decide([answer], said.by, said.window)
