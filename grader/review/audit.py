"""The audit's page: one settled verdict after another, and whether it is right; or a second marking.

Neither the probability nor why a verdict was chosen is shown: a person should judge the drawing. For a second
marking a share of what people decided is drawn in the audit's order, and the decision itself is not shown.
Agreement by chance is taken out by Gwet's AC1 [1]: Cohen's kappa is low where most verdicts are alike.

[1] K. Gwet: Computing inter-rater reliability and its variance in the presence of high agreement. British
    Journal of Mathematical and Statistical Psychology 61 (2008), 29-48.
"""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Annotated, Any

from pydantic import Field

from grader.documents import CriterionDocument
from grader.feedback.class_page import audit_sentence
from grader.feedback.words import VERDICTS
from grader.language import N_, Tongue
from grader.marking.trust import (
    Checkable,
    checkable,
    next_to_check,
    order_of,
    sample,
    trust_of,
)
from grader.overlay.scene import MARKS
from grader.review import questions
from grader.review.records import OPEN, Answer, Points, Said, Student, mark_of, seconds_of
from grader.review.session import Session
from grader.tables.decision_texts import ANSWERS, AuditAnswer
from grader.tables.decisions import VERDICTS as MARKED_WITH
from grader.tables.decisions import Decision
from grader.texts.spoken import RefusedError

SHORT = 24
"""Verdicts of the sample before the least sure ones are asked: if all are right, at most 12 % are wrong."""
SHOWN = ("title", "numbers", "sentence", "look", "seen", "student", "criterion")
"""Facts of a question that are shown: not the probability, nor why a person is asked."""
SAYS = N_("The program says: %(verdict)s. Is that right?")
ALL_CHECKED = N_("Every settled verdict has been checked.")
WHICH = N_("Second marking: which verdict is right?")
AGREED = N_("Equal verdicts: %(equal)s of %(count)s (%(share)s).")
POINTS_APART = N_("Points differ by %(difference)s on average (second minus first: %(bias)s).")
AC1 = N_("Agreement beyond chance (Gwet's AC1): %(value)s.")
LEAST_FOR_AC1 = 30
"""Criteria marked twice below which AC1 is not given: where 85 % agree, its standard error is 0.07 there."""
ALL_MARKED = N_("Nothing is left for you to mark a second time. Left for others: %(count)s.")
TEXTS = {
    **{name: questions.TEXTS[name] for name in ("gone", "no_scan", "no_picture", "close", "nothing_to_undo")},
    "instead": N_("What is right instead?"),
    "opened": N_("Similar verdicts are in the review now."),
}


Share = Annotated[float, Field(gt=0.0, le=100.0)]
"""Percentage of the decided criteria that is drawn."""


class Marked(Said):
    """A second person's verdict on a criterion; `seen` as in `Answer`."""

    student: str
    criterion: str
    verdict: str
    points: Points = None
    seen: str = ""
    share: Share


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
        **_about(student, speaker),
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


# A second marking ---------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Decided:
    """A criterion that a person decided: the decision, and the second marking if there is one."""

    student: Student
    criterion: CriterionDocument
    first: Decision
    second: Decision | None

    @property
    def differs(self) -> bool:
        """True if the two verdicts or their points differ, and nobody has decided since."""
        if self.second is None or not (self.second.points or len({*self.verdicts}) > 1):
            return False
        return seconds_of(self.first) <= seconds_of(self.second)

    @property
    def verdicts(self) -> tuple[str, str]:
        """The first verdict, as it was then, and the second."""
        told = (self.second or self.first).audited[1]
        return told.said, told.answer


def second_facts(session: Session, by: str, share: float, speaker: Tongue) -> dict[str, Any]:
    """Return the next criterion that a person is to mark a second time, and how far people agree so far.

    Arguments: `by` is the person, who is not asked about their own decisions; `share` in per cent.
    """
    drawn = _drawn(session, share)
    twice = [one for one in drawn if one.second is not None]
    others = [one for one in drawn if one.second is None and _is_anothers(one.first, by)]
    return {
        "checked": len(twice),
        "short": len(drawn),
        "found": agreement([(*one.verdicts, one.second.points) for one in twice if one.second], speaker),
        "none": speaker.gettext(ALL_MARKED) % {"count": len(drawn) - len(twice)},
        "question": _second_question(session, others[0], speaker) if others else None,
        "differ": [_differ(one, speaker) for one in twice if one.differs],
    }


def _drawn(session: Session, share: float) -> list[Decided]:
    """Return this share of what people decided, in the audit's order, and all that was marked twice."""
    standing, found = session.standing(), []
    for student in session.students:
        applied = {row.criterion for row in student.report.decisions}
        for one in student.report.criteria:
            name, first = f"second:{one.id}", standing.of(student, one.id)
            if one.decided is not None and first is not None:
                second = standing.of(student, name) if name in applied else None
                found.append(Decided(student, one, first, second))
    found.sort(key=lambda one: order_of(*one.first.key))
    count = math.ceil(share / 100.0 * len(found) - 1e-9)
    return [*found[:count], *(one for one in found[count:] if one.second is not None)]


def agreement(marks: Sequence[tuple[str, str, float | None]], speaker: Tongue) -> str:
    """Say how far two people agree, by both verdicts and the difference in points; empty without any."""
    if not marks:
        return ""
    count, equal = len(marks), sum(first == second for first, second, _ in marks)
    share = speaker.trimmed(100.0 * equal / count, 1)
    told = [
        speaker.gettext(AGREED) % {"equal": equal, "count": count, "share": f"{share}\N{NO-BREAK SPACE}%"}
    ]
    gaps = [gap for *_, gap in marks if gap is not None]
    if gaps:
        mean = {"difference": sum(map(abs, gaps)) / len(gaps), "bias": sum(gaps) / len(gaps)}
        told.append(
            speaker.gettext(POINTS_APART) % {key: speaker.trimmed(one, 2) for key, one in mean.items()}
        )
    if count >= LEAST_FOR_AC1:
        used = Counter(verdict for first, second, _ in marks for verdict in (first, second)).values()
        chance = sum(each / (2 * count) * (1 - each / (2 * count)) for each in used) / (len(MARKED_WITH) - 1)
        told.append(
            speaker.gettext(AC1) % {"value": speaker.trimmed((equal / count - chance) / (1 - chance), 2)}
        )
    return " ".join(told)


def _is_anothers(row: Decision, by: str) -> bool:
    return row.by.strip().casefold() != by.strip().casefold()


def _second_question(session: Session, one: Decided, speaker: Tongue) -> dict[str, Any]:
    student, name = one.student, one.criterion.id
    session.pages_of(student)  # so that they are not read again for the blind one
    report = session.report_if(student, (), without=name)
    blank = {"verdict": OPEN, "proposed": None, "probability": None, "points": None, "decided": None}
    criteria = [each.model_copy(update=blank) if each.id == name else each for each in report.criteria]
    blind = replace(student, report=report.model_copy(update={"criteria": criteria}))
    about = questions.question_facts(session, blind, name, speaker)
    seen, asks = mark_of(session.standing().of(student, f"second:{name}")), speaker.gettext(WHICH)
    facts = {fact: about[fact] for fact in (*SHOWN, "most")}
    facts["look"] = about["look"] and {**about["look"], "ink": ""}
    return {**facts, **_about(student, speaker), "sentence": "", "asks": asks, "seen": seen}


def _about(student: Student, speaker: Tongue) -> dict[str, Any]:
    label = questions.label_of(student, speaker)
    return {"student": student.key, "number": student.number + 1, "label": label}


def _differ(one: Decided, speaker: Tongue) -> dict[str, Any]:
    """Return a disagreement that nobody has settled: on what, and who said what."""
    who = (one.first.by, one.second.by if one.second else "")
    said = [
        f"{by or speaker.gettext(questions.SOMEBODY)}: {speaker.gettext(VERDICTS[verdict])}"
        for by, verdict in zip(who, one.verdicts, strict=True)
    ]
    title = questions.whole_title(one.criterion.title, one.criterion.drawn)
    return {
        **_about(one.student, speaker),
        "criterion": one.criterion.id,
        "title": title,
        "said": ", ".join(said),
    }


def mark_again(session: Session, said: Marked) -> None:
    """Write a person's second marking. Raises as `Session.decide`, and RefusedError for an own decision."""
    student = session.student(said.student)
    first, row = student.criterion(said.criterion), session.standing().of(student, said.criterion)
    if said.verdict not in MARKED_WITH:
        raise RefusedError(400, "answer_refused", "no_answer", given=said.verdict[:40])
    if row is None or first.decided is None or not _is_anothers(row, said.by):
        raise RefusedError(400, "second_own")
    session.check_points(replace(row, verdict=said.verdict, points=said.points))
    again = (said.criterion, said.verdict, said.points)
    alone = session.report_if(student, [again], without=said.criterion)
    points = next(one.points for one in alone.criteria if one.id == said.criterion)
    gap = None if points is None or first.points is None else points - first.points
    verdict = str(AuditAnswer(said.verdict, first.verdict))
    answer = Answer(said.student, f"second:{said.criterion}", verdict, seen=said.seen, points=gap)
    session.decide([answer], said.by, said.window)
