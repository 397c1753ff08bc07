"""The results of a student's check of their own measurements, without the answer.

There are three levels: ``symbol`` says right or off; ``hint`` also how (too long, turned left); ``full``, for
instructors, has the numbers and the most likely mistake. A result holds nothing that its level must not show.
"""

from collections.abc import Collection
from dataclasses import dataclass, replace
from typing import Literal, get_args

from grader.documents import Quantity, Tolerance
from grader.marking.drawn import NEARLY_CERTAIN
from grader.options import Level
from grader.outcomes import CHARGED, CREDITED, Judgement, NamedMistake, Outcome
from grader.records import Reason
from reference.authored.assignment import SCALE_NAMES

LEVELS: tuple[Level, ...] = get_args(Level)
Result = Literal["right", "off", "open"]

TELLING = frozenset({"what", "of"})
"""Parameters of reasons that are names, not numbers: a hint may have them."""


@dataclass(frozen=True, slots=True)
class Checked:
    """The check of one value.

    Attributes
    ----------
    criterion, name : as in the rubric
    result : right, off, or open if the verdict is open
    reasons : the most important first; without numbers at level ``hint``, empty at ``symbol``
    measured, expected, tolerance, mistake : the evidence, at level ``full`` only
    """

    criterion: str
    name: str
    result: Result
    reasons: tuple[Reason, ...] = ()
    measured: Quantity | None = None
    expected: Quantity | None = None
    tolerance: Tolerance | None = None
    mistake: str | None = None


def checked_values(judgement: Judgement, level: Level, unread: Collection[str] = ()) -> tuple[Checked, ...]:
    """Return the part of a judgement that a level may show.

    Arguments: `unread` are vectors of a drawing: those that could not be read are open, at any level.
    """
    return tuple(
        _checked(one, level if _is_handed_in(one) else "hint")
        for one in judgement.outcomes
        if _is_handed_in(one) or (one.name in unread and one.reasons[0].code == "unread")
    )


def likely_mistakes(judgement: Judgement | None, level: Level) -> tuple[NamedMistake, ...]:
    """Return the mistakes that explain errors, at level `full`; values left out are no mistake here."""
    mistakes = () if judgement is None or level != "full" else judgement.mistakes
    return tuple(one for one in mistakes if one.code != "vector_missing")


def certain_mistakes(judgement: Judgement) -> tuple[NamedMistake, ...]:
    """Return the mistakes that nothing else explains nearly as well: a hint may state the law they break."""
    return tuple(one for one in judgement.mistakes if one.confidence >= NEARLY_CERTAIN and not one.rivals)


def _is_handed_in(outcome: Outcome) -> bool:
    absent = {"not_measured", "optional", "unread", "scale_assumed"}
    if outcome.measured == Quantity() and outcome.name not in SCALE_NAMES:
        # A value that depends only on a refused entry was not handed in, nor a centre off the sheet.
        absent |= {"entry_refused", "off_sheet"}
    return outcome.verdict not in {"not_judged", "review", "none"} or not (
        absent & {reason.code for reason in outcome.reasons[:1]}
    )


def _checked(outcome: Outcome, level: Level) -> Checked:
    known = Checked(outcome.criterion, outcome.name, _result(outcome))
    if level == "symbol":
        return known
    if level == "hint":
        return replace(known, reasons=tuple(_without_numbers(reason) for reason in outcome.reasons))
    shown = ("reasons", "measured", "expected", "tolerance", "mistake")
    return replace(known, **{name: getattr(outcome, name) for name in shown})


def _result(outcome: Outcome) -> Result:
    is_right = {"right", "follows"} & outcome.codes
    is_right_alone = outcome.reasons[:1] == (Reason("value_alone"),) and bool(is_right)
    if outcome.verdict in CREDITED or is_right_alone:
        return "right"
    return "off" if outcome.verdict in CHARGED else "open"


def _without_numbers(reason: Reason) -> Reason:
    """Return a reason without the numbers that give the answer away; a refused scale keeps its text."""
    if reason.code in {"scale_refused", "unread"}:
        return reason
    return Reason(reason.code, {key: value for key, value in reason.parameters.items() if key in TELLING})
