"""Reasons and mistakes as sentences.

There are three levels of feedback: ``full`` for instructors, with every number; ``hint``, which describes the
error without giving the answer away; ``symbol``, which shows only the mark. Names of vectors stand in
sentences as `v_BA`, `a_BA_n`; pages set them with indices.
"""

import re
from collections.abc import Mapping
from dataclasses import replace

from grader.documents import CriterionDocument, Parameters, Quantity
from grader.feedback.mistakes import (
    GIVING_AWAY,
    MISTAKES,
    NORMAL_END,
    line_in,
    precise,
    question_of,
    words_of,
)
from grader.language import N_, NO_NAMES, Tongue, tongue
from grader.options import Level
from grader.outcomes import CHARGED, CREDITED, EVEN, NamedMistake, Outcome
from grader.records import Reason, Value
from grader.texts.reasons import LOSS_DOUBTFUL, MISREAD, UNCHECKED, UNDECIDED, UNSURE, reason_sentence
from grader.texts.spoken import place

# Criteria -----------------------------------------------------------------------------------------

OPEN_ONLY = frozenset({"near_limit", "hand_may_miss", "doubtful", UNSURE})
"""Used only for open criteria: a verdict leaves no doubt."""
RESIDUALS = frozenset(
    {
        "too_long", "too_short", "turned_left", "turned_right", "reversed", "should_be_zero", "place_off",
        "value_too_large", "value_too_small", "value_reversed", "sense_wrong", "scale_off", "not_drawn",
        "no_line", "not_certainly_within",
    }
)  # fmt: skip
"""Used for errors as read: not for a criterion proposed as right."""
IN_FAVOUR = frozenset({"counted_for_you", "at_stake", "right"})
"""Used for what counts: not for a criterion proposed as wrong."""

NEARLY = N_("Compared with your own earlier work it is nearly right; compared with the data:")
MAY_FOLLOW = N_("It may be consistent with your own earlier work; compared with the data:")
"""Replaces `follows` if full marks do not follow, at level `full`."""
PROBABLY_FOLLOWS = N_("It is probably consistent with your own earlier work.")
"""Replaces `follows` if that is only proposed."""

TOLD_BESIDE = frozenset({"follows", "counted_for_you", "at_stake", "letters_exchanged"})
"""Reasons that are shown beside `follows`."""

MOST_REASONS = 3
"""More would hide the important ones."""


def criterion_feedback(
    outcome: Outcome, lang: str, level: Level = "full", names: Mapping[str, str] = NO_NAMES
) -> str:
    """Return the sentences on one criterion; empty at level `symbol`.

    `names` renames nodes and scales as the assignment's students know them.
    """
    if level == "symbol":
        return ""
    speaker = tongue(lang)
    may = PROBABLY_FOLLOWS if outcome.verdict == "review" and outcome.proposed == 1.0 else MAY_FOLLOW
    in_part = NEARLY if outcome.verdict == "partial" else may
    told = (
        speaker.gettext(in_part)
        if reason.code == "follows" and outcome.verdict != "follow_through"
        else reason_sentence(reason, speaker, level, names)
        for reason in _worth_telling(outcome, level)
    )
    parts = list(dict.fromkeys(told))[:MOST_REASONS]
    if outcome.mistake and outcome.verdict in CHARGED and outcome.mistake in MISTAKES:
        cause = outcome.cause
        words = words_of(cause.code, cause.at, line_in(cause.detail)) if cause else MISTAKES[outcome.mistake]
        title = speaker.gettext(words.title)
        parts.append(speaker.gettext("Likely cause: %(cause)s.") % {"cause": title})
    return " ".join(part for part in parts if part)


def feedback_again(
    criterion: CriterionDocument, lang: str, level: Level = "full", names: Mapping[str, str] = NO_NAMES
) -> str:
    """Return the sentences on a report's open criterion in another language than the report's."""
    outcome = Outcome(
        criterion.id, criterion.drawn, criterion.verdict, criterion.measured, criterion.expected,
        criterion.tolerance, criterion.confidence,
        reasons=tuple(Reason(one.code, _as_before(one.parameters)) for one in criterion.why),
        possible=(criterion.verdict, criterion.verdict),
        proposed=1.0 if criterion.proposed in CREDITED else 0.0,
        probability=criterion.probability or EVEN,
    )  # fmt: skip
    return criterion_feedback(outcome, lang, level, names)


def _as_before(parameters: Parameters) -> dict[str, Value]:
    return {key: tuple(value) if isinstance(value, list) else value for key, value in parameters.items()}


def _worth_telling(outcome: Outcome, level: Level = "full") -> list[Reason]:
    """Return the reasons without those that add nothing to the others, or say too much."""
    if outcome.verdict == "not_judged" and not outcome.reasons:
        return [Reason(UNCHECKED)]
    codes = outcome.codes
    by_scale = any(one.code == "follows" and one.parameters.get("what") == "scale" for one in outcome.reasons)
    if outcome.verdict == "review" and "scale_assumed" in codes and by_scale:
        return [Reason(UNDECIDED)]
    if outcome.verdict == "follow_through" and "follows" in codes:
        return [one for one in outcome.reasons if one.code in TOLD_BESIDE]
    needless = {"right"} if codes - {"right"} else set()
    if outcome.verdict == "review":
        needless |= RESIDUALS if outcome.proposed == 1.0 else IN_FAVOUR
        needless |= {"counted_for_you"} if outcome.probability == EVEN else set()
        # What was entered was not read.
        may_be_misread = outcome.proposed == 1.0 and outcome.confidence < 1.0
        if may_be_misread and codes & RESIDUALS and not codes & {"follows", "counted_for_you"}:
            return [
                Reason(MISREAD),
                *(one for one in outcome.reasons if one.code in {"doubtful", "other_variant"}),
            ]
    if outcome.verdict != "review":
        needless |= OPEN_ONLY
    if "doubtful" in codes:
        needless |= {"near_limit"}
    if "should_be_zero" in codes or (level != "full" and codes & {"not_measured", "unread"}):
        # If nothing was drawn, the right length would be an answer.
        needless |= {"too_short_to_judge"}
    if "optional" in codes:
        needless |= {"not_measured", "unread"}
    reasons = list(outcome.reasons)
    if "unread" in codes and outcome.measured != Quantity():
        needless |= {"doubtful", "near_limit"}
        reasons = [replace(one, code=UNSURE) if one.code == "unread" else one for one in reasons]
    near = next((reason for reason in reasons if reason.code == "near_limit"), None)
    is_loss = outcome.proposed < 1.0 and outcome.probability != EVEN
    return [
        replace(reason, code=LOSS_DOUBTFUL) if is_loss and reason.code == "doubtful" else reason
        for reason in reasons
        # If several limits are near, the first one is enough.
        if reason.code not in needless and (reason.code != "near_limit" or reason is near)
    ]


# Mistakes -----------------------------------------------------------------------------------------

RIVALS = N_("Your submission fits other explanations nearly as well:")
"""Stands between a mistake and those that explain the same nearly as well."""
BETWEEN_RIVALS = N_("or:")
"""Stands before each of those."""


def mistake_feedback(
    mistake: NamedMistake, lang: str, level: Level = "full", names: Mapping[str, str] = NO_NAMES
) -> str:
    """Describe the likeliest mistake and what to redo; empty at level `symbol` and for an unknown code.

    Rivals that explain the same nearly as well follow, each after an "or".
    """
    if level == "symbol" or mistake.code not in MISTAKES:
        return ""
    speaker = tongue(lang)
    told, *others = mistake_sentences(mistake, speaker, level, names)
    if not any(others):
        return told
    either = speaker.gettext(BETWEEN_RIVALS)
    return " ".join((told, speaker.gettext(RIVALS), *(f"{either} {one}" for one in others if one)))


ODDS = N_("How likely that is: %(share)s.")
"""Stands after a mistake that has rivals, and after each of these."""


def mistake_sentences(
    mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str] = NO_NAMES
) -> list[str]:
    """Return what was done and what to redo, then the same for each rival, with its odds.

    The last one ends with the question that distinguishes them. A rival with the same words as one before it
    is empty.
    """
    told = mistake_sentence(mistake, speaker, level, names)
    found = {told: mistake.confidence}
    sentences = [told]
    for one in mistake.rivals:
        other = mistake_sentence(one, speaker, level, names) if one.code in MISTAKES else ""
        sentences.append("" if other in found else other)
        found.setdefault(other, one.confidence)
    last = max((index for index, text in enumerate(sentences) if text), default=0)
    if last == 0:
        return sentences
    sentences = [f"{text} {_odds(found[text], speaker)}" if text else "" for text in sentences]
    sentences[last] = f"{sentences[last]} {question(mistake, speaker, names)}".strip()
    return sentences


def _odds(share: float, speaker: Tongue) -> str:
    percent = f"{speaker.number(100.0 * share, 0)}\N{NO-BREAK SPACE}%"
    return speaker.gettext(ODDS) % {"share": percent}


def question(mistake: NamedMistake, speaker: Tongue, names: Mapping[str, str] = NO_NAMES) -> str:
    """Return the question that distinguishes a mistake from its rivals."""
    where = {"at": place(mistake.at, speaker, names)}
    known = {**where, **_known(mistake, speaker, "hint", names)}
    return speaker.gettext(question_of(mistake.code, known)) % known


def mistake_sentence(
    mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str] = NO_NAMES
) -> str:
    """Return what was done and what to redo, regardless of rivals."""
    line = line_in(mistake.detail)
    words = words_of(mistake.code, mistake.at, line)
    where = {"at": place(mistake.at, speaker, names)}
    known = {**where, **_known(mistake, speaker, level, names)}
    what = precise(mistake.code, mistake.at, line, known) or words.what
    return f"{speaker.gettext(what) % known} {speaker.gettext(words.redo) % where}"


def _known(mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str]) -> dict[str, str]:
    """Return the details of a mistake in words; numbers only if they may be shown."""
    told = {
        key: speaker.trimmed(value, 3) if isinstance(value, float) else place(str(value), speaker, names)
        for key, value in mistake.detail.items()
        if level == "full" or key not in GIVING_AWAY
    }
    if mistake.at.startswith(NORMAL_END):
        told["vector"] = f"a_{mistake.at.removeprefix(NORMAL_END)}_n"
    elif _CENTRE.fullmatch(mistake.at):
        told["centre"] = place(mistake.at, speaker, names)
    elif _IMAGE.fullmatch(mistake.at):
        told["vector"] = (
            f"{'a' if mistake.at.endswith(ACCELERATED) else 'v'}_{mistake.at.rstrip(ACCELERATED).upper()}"
        )
    return told


_IMAGE, ACCELERATED = re.compile("[a-z][0-9]?'?"), "'"
"""Names of images of joints in the plans, and the mark of those in the acceleration plan."""
_CENTRE = re.compile("[IJ][0-9A-Za-z]+")
"""Names of links' centres on the sketch, where a mirrored triangle is not one of the plan."""
