"""Reasons and mistakes as sentences.

Three levels of feedback: ``full`` for instructors, with every number; ``hint``, which says in which way
something is off without giving the answer away; ``symbol``, which says nothing beside the mark.
Names of vectors stand in sentences as `v_BA`, `a_BA_n`; pages set them with indices.
"""

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Literal

from grader.documents import Quantity
from grader.feedback.mistakes import GIVING_AWAY, MISTAKES, NORMAL_END, precise, question_of, words_of
from grader.language import N_, Tongue, tongue
from grader.outcomes import NamedMistake, Outcome, Param, Reason

Level = Literal["symbol", "hint", "full"]

_NO_NAMES: Mapping[str, str] = {}

# Criteria -----------------------------------------------------------------------------------------

UNDECIDED = "scale_undecided"
"""Stands for `scale_assumed` and `follows` together, under review: neither alone says what is in doubt."""
UNSURE = "read_unsurely"
"""Stands for `unread` where something was read, though not surely, and for `doubtful` beside it."""
UNCHECKED = "unchecked"
"""Stands where nothing was judged and no reason is given."""
MISREAD = "misread"
"""Stands for what is off as read, where it is proposed as right: most probably it was misread."""
OPEN_ONLY = frozenset({"near_limit", "hand_may_miss", "doubtful", UNSURE})
"""Said of what waits alone: no doubt is left where there is a verdict."""
RESIDUALS = frozenset(
    {
        "too_long", "too_short", "turned_left", "turned_right", "reversed", "should_be_zero",
        "value_too_large", "value_too_small", "value_reversed", "scale_off", "not_drawn",
        "not_certainly_within",
    }
)  # fmt: skip
"""Said of what is off as it was read: not of what is proposed as right."""
IN_FAVOUR = frozenset({"counted_for_you", "at_stake", "right"})
"""Said of what counts: not of what is proposed as wrong."""

HINTS: dict[str, str] = {
    "right": N_("Right."),
    "too_long": N_("It is too long."),
    "too_short": N_("It is too short."),
    "turned_left": N_("Its direction is off: it is turned too far counter-clockwise."),
    "turned_right": N_("Its direction is off: it is turned too far clockwise."),
    "reversed": N_("It points the opposite way."),
    "should_be_zero": N_("Look at this position of the mechanism again: how large can it be here?"),
    "too_short_to_judge": N_("It is too short for its direction to be judged; only its length counts."),
    "value_too_large": N_("The value is too large."),
    "value_too_small": N_("The value is too small."),
    "value_reversed": N_("The sign is wrong: counter-clockwise is positive."),
    "not_measured": N_("Nothing was handed in for it."),
    "optional": N_("It was not handed in, and is not required."),
    "unread": N_("It could not be read on the sheet."),
    "entry_refused": N_("An entry that it rests on cannot be used: a person must look."),
    "doubtful": N_("It was read with too little certainty."),
    "found_wrong_elsewhere": N_("A verdict like this one was found wrong in this class: a person must look."),
    "near_limit": N_("It lies so near the limit of the tolerance that the scan cannot decide."),
    "counted_for_you": N_("It is beyond the limit by no more than the scan can tell: counted for you."),
    "not_certainly_within": N_("It is not certainly within the limit, as far as the scan can tell."),
    "at_stake": N_("What is open here is worth very little: counted for you."),
    "other_variant": N_("The drawing follows another student's data."),
    "not_explained": N_("The vectors of this plan do not belong together: a person must look."),
    "data_misread": N_("The drawing follows another crank angle than the one given."),
    "data_unclear": N_("It is not clear whether the drawing follows your own data: a person must look."),
    "not_drawn": N_("It is not drawn."),
    "value_alone": N_(
        "A value alone earns no points here: the vector must be drawn, and its length handed in."
    ),
    "by_similarity": N_("It need not be drawn: the point was found by similar triangles."),
    "letters_exchanged": N_("Two letters stand at each other's point: it is compared under the right ones."),
    "letters_unclear": N_("Two letters seem to stand at each other's point: a person must look."),
    "hand_may_miss": N_(
        "Its lines meet at so small an angle that a careful hand may be off by as much: a person must look."
    ),
    "readings_disagree": N_("The drawing and the entered measurement differ."),
    "written_disagrees": N_("The drawing and the length written on the sheet differ: a person must look."),
    "follows": N_(
        "It follows rightly from your own earlier work; the earlier mistake is charged once, there."
    ),
    "decided": N_("A person has decided this."),
    "scale_refused": N_("The declared scale could not be understood."),
    "scale_off": N_("The declared scale does not fit the drawing and the data."),
    "scale_assumed": N_("The scale was not declared; the assignment's own rule was assumed."),
    UNDECIDED: N_(
        "No scale was declared: it is off at the assignment's own, and right at the one"
        " that the drawing follows."
    ),
    UNSURE: N_("It was read with too little certainty."),
    MISREAD: N_("It was probably misread; a person will look."),
    "scale_seems_off": N_("The declared scale seems not to be the one that the drawing was made with."),
    UNCHECKED: N_("Nothing was drawn that it could be held against."),
}
"""What is said at level `hint`, by code of the reason."""

FULL: dict[str, str] = {
    "too_long": N_("It is too long by %(off)s (tolerance ±%(tolerance)s)."),
    "too_short": N_("It is too short by %(off)s (tolerance ±%(tolerance)s)."),
    "turned_left": N_("It is turned %(off)s too far counter-clockwise (tolerance ±%(tolerance)s)."),
    "turned_right": N_("It is turned %(off)s too far clockwise (tolerance ±%(tolerance)s)."),
    "should_be_zero": N_("It is zero in this position of the mechanism; %(measured)s were drawn."),
    "too_short_to_judge": N_(
        "It is too short for its direction to be judged (%(length)s, at least %(least)s are needed);"
        " only its length counts."
    ),
    "value_too_large": N_("The value is too large: %(measured)s instead of %(expected)s."),
    "value_too_small": N_("The value is too small: %(measured)s instead of %(expected)s."),
    "value_reversed": N_(
        "The sign is wrong: %(measured)s instead of %(expected)s; counter-clockwise is positive."
    ),
    "unread": N_("It could not be read on the sheet (%(reason)s)."),
    "entry_refused": N_("An entry that it rests on cannot be used (%(reason)s): a person must look."),
    "doubtful": N_("It was read with too little certainty (%(confidence)s)."),
    UNSURE: N_("It was read with too little certainty (%(reason)s)."),
    MISREAD: N_("It was probably misread; the dotted stroke may be the one meant."),
    "scale_seems_off": N_("%(declared)s is declared, %(expected)s was probably drawn with: %(factor)s."),
    "near_limit": N_(
        "It lies so near the limit of the tolerance that the scan cannot decide (standard error %(se)s)."
    ),
    "counted_for_you": N_(
        "It is %(beyond)s beyond the limit; the scan is good to %(good_to)s: counted for you."
    ),
    "not_certainly_within": N_(
        "It is %(beyond)s within the limit; the scan is good to %(good_to)s:"
        " only what is certainly within counts."
    ),
    "other_variant": N_("The drawing follows another student's data (%(whose)s)."),
    "data_unclear": N_(
        "It may follow other data than the student's own (%(whose)s; probability %(confidence)s):"
        " a person must look."
    ),
    "letters_exchanged": N_(
        "The letters %(first)s and %(second)s stand at each other's point:"
        " it is compared under the right ones."
    ),
    "letters_unclear": N_(
        "The letters %(first)s and %(second)s seem to stand at each other's point: a person must look."
    ),
    "not_explained": N_("These vectors do not belong together: %(unfit)s of %(of)s fit nothing."),
    "readings_disagree": N_("The drawing gives %(first)s, the entered measurement %(second)s."),
    "written_disagrees": N_("Drawn are %(drawn)s, written on the sheet %(written)s: a person must look."),
    "scale_refused": N_("The declared scale “%(text)s” could not be understood: %(why)s."),
    "scale_off": N_("%(declared)s is declared, %(expected)s was drawn with: %(factor)s."),
    "scale_assumed": N_("The scale was not declared; %(used)s was assumed."),
}
"""What is said at level `full` where that differs."""

FOLLOWS: dict[str, str] = {
    "nodes": N_(
        "It follows rightly from your own earlier points; the earlier mistake is charged once, there."
    ),
    "small_errors": N_(
        "It follows rightly from your own earlier points: their small errors, each within its tolerance,"
        " add up here."
    ),
    "scale": N_("It is right at the scale that you used; the scale is charged once, there."),
    "vector": N_("It follows rightly from your own %(of)s; that mistake is charged once, there."),
    "value": N_("It follows rightly from your own %(of)s; that mistake is charged once, there."),
}
"""Reason `follows`, by what it follows from."""

NEARLY = N_("Held against your own earlier work it is nearly right; held against the data:")
MAY_FOLLOW = N_("It may follow rightly from your own earlier work; held against the data:")
"""In place of `follows` where full marks do not follow, at level `full`."""
PROBABLY_FOLLOWS = N_("It probably follows rightly from your own earlier work.")
"""In place of `follows` where that is proposed."""

TOLD_BESIDE = frozenset({"follows", "counted_for_you", "at_stake", "letters_exchanged"})
"""Reasons that are told of what follows rightly."""

MOST_REASONS = 3
"""More would hide the important ones."""


def criterion_feedback(
    outcome: Outcome, lang: str, level: Level = "full", names: Mapping[str, str] = _NO_NAMES
) -> str:
    """What is to be said to one criterion; empty at level `symbol`.

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
    if outcome.mistake and outcome.verdict in {"none", "partial"} and outcome.mistake in MISTAKES:
        cause = outcome.cause
        words = words_of(cause.code, cause.at, line_of(cause)) if cause else MISTAKES[outcome.mistake]
        title = speaker.gettext(words.title)
        parts.append(speaker.gettext("Likely cause: %(cause)s.") % {"cause": title})
    return " ".join(part for part in parts if part)


def _worth_telling(outcome: Outcome, level: Level = "full") -> list[Reason]:
    """The reasons without those that say nothing beside the others, or too much."""
    if outcome.verdict == "not_judged" and not outcome.reasons:
        return [Reason(UNCHECKED)]
    codes = {reason.code for reason in outcome.reasons}
    by_scale = any(one.code == "follows" and one.params.get("what") == "scale" for one in outcome.reasons)
    if outcome.verdict == "review" and "scale_assumed" in codes and by_scale:
        return [Reason(UNDECIDED)]
    if outcome.verdict == "follow_through" and "follows" in codes:
        return [one for one in outcome.reasons if one.code in TOLD_BESIDE]
    needless = {"right"} if codes - {"right"} else set()
    if outcome.verdict == "review":
        needless |= RESIDUALS if outcome.proposed == 1.0 else IN_FAVOUR
        if outcome.proposed == 1.0 and codes & RESIDUALS and not codes & {"follows", "counted_for_you"}:
            return [
                Reason(MISREAD),
                *(one for one in outcome.reasons if one.code in {"doubtful", "other_variant"}),
            ]
    if outcome.verdict != "review":
        needless |= OPEN_ONLY
    if "doubtful" in codes:
        needless |= {"near_limit"}
    if level != "full" and codes & {"not_measured", "unread"}:
        # How short it should be is an answer, where nothing was drawn.
        needless |= {"too_short_to_judge"}
    if "optional" in codes:
        needless |= {"not_measured", "unread"}
    reasons = list(outcome.reasons)
    if "unread" in codes and outcome.measured != Quantity():
        needless |= {"doubtful", "near_limit"}
        reasons = [replace(one, code=UNSURE) if one.code == "unread" else one for one in reasons]
    near = next((reason for reason in reasons if reason.code == "near_limit"), None)
    return [
        reason
        for reason in reasons
        # Of several limits that are near, the first one is enough.
        if reason.code not in needless and (reason.code != "near_limit" or reason is near)
    ]


# Mistakes -----------------------------------------------------------------------------------------

RIVALS = N_("What was handed in does not tell this from something else:")
"""Stands between a mistake and those that explain the same nearly as well."""
BETWEEN_RIVALS = N_("or:")
"""Stands before each of those."""


def mistake_feedback(
    mistake: NamedMistake, lang: str, level: Level = "full", names: Mapping[str, str] = _NO_NAMES
) -> str:
    """What was done, most likely, and what to redo; empty at level `symbol` and for an unknown code.

    Where rivals explain the same nearly as well, they are told too, each after an "or".
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
    mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str] = _NO_NAMES
) -> list[str]:
    """What was done and what to redo, and the same of each rival, with its odds.

    After the last one stands the question that tells them apart. A rival that is told in the same words as
    one before it is empty.
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


def question(mistake: NamedMistake, speaker: Tongue, names: Mapping[str, str] = _NO_NAMES) -> str:
    """The one question that tells a mistake from its rivals."""
    where = {"at": place(mistake.at, speaker, names)}
    known = {**where, **_known(mistake, speaker, "hint", names)}
    return speaker.gettext(question_of(mistake.code, known)) % known


def mistake_sentence(
    mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str] = _NO_NAMES
) -> str:
    """What was done and what to redo, whatever its rivals."""
    words = words_of(mistake.code, mistake.at, line_of(mistake))
    where = {"at": place(mistake.at, speaker, names)}
    known = {**where, **_known(mistake, speaker, level, names)}
    what = precise(mistake.code, mistake.at, line_of(mistake), known) or words.what
    return f"{speaker.gettext(what) % known} {speaker.gettext(words.redo) % where}"


def _known(mistake: NamedMistake, speaker: Tongue, level: Level, names: Mapping[str, str]) -> dict[str, str]:
    """What is known of a mistake, in words; numbers only where they may be told."""
    told = {
        key: speaker.trimmed(value, 3) if isinstance(value, float) else place(str(value), speaker, names)
        for key, value in mistake.detail.items()
        if level == "full" or key not in GIVING_AWAY
    }
    if mistake.at.startswith(NORMAL_END):
        told["vector"] = f"a_{mistake.at.removeprefix(NORMAL_END)}_n"
    elif _IMAGE.fullmatch(mistake.at):
        told["vector"] = (
            f"{'a' if mistake.at.endswith(ACCELERATED) else 'v'}_{mistake.at.rstrip(ACCELERATED).upper()}"
        )
    return told


_IMAGE, ACCELERATED = re.compile("[a-z][0-9]?'?"), "'"
"""How the images of joints are named in the plans, and those in the acceleration plan."""


def line_of(mistake: NamedMistake) -> str:
    """Which kind of line or slip of units it is, as `words_of` takes it; empty where the code is enough."""
    return str(mistake.detail.get("line", mistake.detail.get("slip", "")))


PLACES = {
    "mechanism": N_("the mechanism"),
    "velocity_plan": N_("the velocity plan"),
    "acceleration_plan": N_("the acceleration plan"),
    "directions": N_("the directions"),
    "lengths": N_("the lengths"),
    "scales": N_("the scales"),
    "values": N_("the values"),
}


def place(at: str, speaker: Tongue, names: Mapping[str, str] = _NO_NAMES) -> str:
    """A node, vector, scale or figure as a sentence names it."""
    return speaker.gettext(PLACES[at]) if at in PLACES else names.get(at, at)


# Reasons ------------------------------------------------------------------------------------------


def reason_sentence(
    reason: Reason, speaker: Tongue, level: Level, names: Mapping[str, str] = _NO_NAMES
) -> str:
    """One reason; a code without a sentence is told by its name, so that nothing is lost."""
    said = _speak(reason.params, speaker, names)
    if reason.code == "follows":
        text = FOLLOWS.get(str(reason.params.get("what")), HINTS["follows"])
        return _fill(speaker.gettext(text), said, speaker.gettext(HINTS["follows"]))
    hint = speaker.gettext(HINTS[reason.code]) if reason.code in HINTS else reason.code
    if level == "full" and reason.code in FULL:
        return _fill(speaker.gettext(FULL[reason.code]), said, hint)
    return hint


def _fill(text: str, said: Mapping[str, str], otherwise: str) -> str:
    """The text with its numbers, or what needs none where one of them is not known."""
    try:
        return text % said
    except KeyError:
        return otherwise


def _speak(params: Mapping[str, Param], speaker: Tongue, names: Mapping[str, str]) -> dict[str, str]:
    """Parameters in words: `off_mm` becomes `off`, with its unit."""
    # `near_limit` says what it speaks of instead of a unit.
    unit_of_limit = {"length": "mm", "scale": "mm", "direction": "°"}.get(str(params.get("what", "")), "")
    unit = str(params.get("unit", unit_of_limit))
    said: dict[str, str] = {}
    for key, value in params.items():
        stem, _, suffix = key.rpartition("_")
        if key == "reason":
            said[key] = reader_reason(str(value), speaker)
        elif isinstance(value, str):
            said[key] = place(value, speaker, names)
        elif suffix in {"mm", "deg"} and stem:
            said[stem] = _UNIT_WRITERS[suffix](speaker, value)
        elif key == "confidence":
            said[key] = f"{speaker.number(100.0 * value, 0)}\N{NO-BREAK SPACE}%"
        else:
            said[key] = _real(speaker, value, unit)
    if {"declared", "expected"} <= params.keys():
        said["factor"] = _how_far_off(float(params["declared"]), float(params["expected"]), speaker)
    return said


TOO_LARGE, TOO_SMALL = N_("%(times)s times too large"), N_("%(times)s times too small")
SHARE_TOO_LARGE, SHARE_TOO_SMALL = N_("%(share)s too large"), N_("%(share)s too small")
SEVERAL_TIMES = 1.5
"""From this factor on a scale is said to be so many times too large, below it by so many per cent."""


def _how_far_off(declared: float, right: float, speaker: Tongue) -> str:
    """How far a declared scale is from the right one: "10 times too small", "5 % too large"."""
    factor = declared / right if right else 1.0
    ratio = max(factor, 1.0 / factor) if factor > 0.0 else 1.0
    if ratio >= SEVERAL_TIMES:
        text = TOO_LARGE if factor > 1.0 else TOO_SMALL
        return speaker.gettext(text) % {"times": speaker.trimmed(ratio, 1 if ratio < 20.0 else 0)}
    share = f"{speaker.number(100.0 * abs(factor - 1.0), 1)}\N{NO-BREAK SPACE}%"
    return speaker.gettext(SHARE_TOO_LARGE if factor > 1.0 else SHARE_TOO_SMALL) % {"share": share}


def _real(speaker: Tongue, value: float, unit: str) -> str:
    if unit == "mm":
        return speaker.quantity(value, 2, unit)
    if unit == "°":
        return f"{speaker.number(value, 2)}°"
    return speaker.value(value, unit)


_UNIT_WRITERS: dict[str, Callable[[Tongue, float], str]] = {
    "mm": lambda speaker, value: speaker.quantity(value, 1, "mm"),
    "deg": lambda speaker, value: f"{speaker.number(value, 1)}°",
}


# Reasons of the reader ----------------------------------------------------------------------------

REASONS: tuple[tuple[re.Pattern[str], str], ...] = tuple(
    (re.compile(pattern), text)
    for pattern, text in (
        (
            r"no stroke between (?P<start>\S+) and (?P<end>\S+) could be told apart",
            N_("no stroke between %(start)s and %(end)s could be told apart"),
        ),
        (
            r"(?P<nodes>.+), on which it hangs, was not read for certain",
            N_("%(nodes)s, on which it hangs, was not read for certain"),
        ),
        (
            r"nothing is drawn between (?P<start>\S+) and (?P<end>\S+)",
            N_("nothing is drawn between %(start)s and %(end)s"),
        ),
        (r"(?P<name>\S+) was not found on the sheets", N_("%(name)s was not found on the sheets")),
        (r"no mechanism sketch was found on the sheets", N_("no mechanism sketch was found on the sheets")),
        (r"no velocity plan was found on the sheets", N_("no velocity plan was found on the sheets")),
        (r"no acceleration plan was found on the sheets", N_("no acceleration plan was found on the sheets")),
        (r"not drawn: (?P<node>\S+) found by similarity", N_("not drawn: %(node)s found by similarity")),
        (r"not drawn: .*normal component.* left out", N_("not drawn: normal component left out")),
        (r"not drawn: .*Coriolis component.* left out", N_("not drawn: Coriolis component left out")),
    )
)


def reader_reason(reason: str, speaker: Tongue) -> str:
    """A reason of the reader, in a language."""
    for pattern, text in REASONS:
        match = pattern.fullmatch(reason)
        if match is not None:
            return speaker.gettext(text) % match.groupdict()
    return reason
