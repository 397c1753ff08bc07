"""The sentences of reasons: why a criterion has its verdict, with numbers and without."""

from collections.abc import Mapping

from grader.language import N_, NO_NAMES, Tongue
from grader.options import Level
from grader.texts.spoken import Coded, filled, spoken

UNDECIDED = "scale_undecided"
"""Replaces `scale_assumed` and `follows` together under review: neither alone says what is in doubt."""
UNSURE = "read_unsurely"
"""Replaces `unread` if something was read, though not surely, and `doubtful` beside it."""
LOSS_DOUBTFUL = "loss_doubtful"
"""Replaces `doubtful` where the vector is more probably wrong: that asks for more certainty."""
UNCHECKED = "unchecked"
"""Used if nothing was judged and no reason is given."""
MISREAD = "misread"
"""Used for an error that is proposed as right: most probably it was misread."""
HINTS: dict[str, str] = {
    "right": N_("Right."),
    "too_long": N_("It is too long."),
    "too_short": N_("It is too short."),
    "turned_left": N_("Its direction is off: it is turned too far counter-clockwise."),
    "turned_right": N_("Its direction is off: it is turned too far clockwise."),
    "reversed": N_("It points the opposite way."),
    "place_off": N_("It lies in the wrong place."),
    "off_sheet": N_("It lies off the sheet here, and is not asked for."),
    "should_be_zero": N_("Look at this position of the mechanism again: how large can it be here?"),
    "too_short_to_judge": N_("It is too short for its direction to be judged; only its length counts."),
    "made_trivial": N_("An earlier mistake makes the vector too short to show anything: it is not judged."),
    "value_too_large": N_("The value is too large."),
    "value_too_small": N_("The value is too small."),
    "value_reversed": N_("The sign is wrong: counter-clockwise is positive."),
    "sense_wrong": N_("It turns the other way."),
    "sense_missing": N_("The sense is missing: write it as cw or ccw, or as a sign."),
    "not_measured": N_("Nothing was handed in for it."),
    "optional": N_("It was not handed in, and is not required."),
    "unread": N_("It could not be read on the sheet."),
    "entry_refused": N_("It depends on an unusable entry; an instructor will check it."),
    "doubtful": N_("It was read with too little certainty."),
    LOSS_DOUBTFUL: N_("It was read with too little certainty."),
    "found_wrong_elsewhere": N_("A verdict like this one was found wrong in this class: a person must look."),
    "near_limit": N_("It is too close to the limit of the tolerance to decide from the scan."),
    "counted_for_you": N_("It is over the limit by less than the scan's accuracy."),
    "not_certainly_within": N_("At the scan's accuracy it is not certain to be within the limit."),
    "at_stake": N_("The points still open are negligible: accepted."),
    "other_variant": N_("The drawing follows another student's data."),
    "not_explained": N_("The vectors of this plan do not belong together: a person must look."),
    "data_misread": N_("The drawing follows another crank angle than the one given."),
    "data_unclear": N_("It is not clear whether the drawing follows your own data: a person must look."),
    "not_drawn": N_("It is not drawn."),
    "no_line": N_("No line ends where it must: it is not drawn, or drawn elsewhere."),
    "value_alone": N_(
        "A value alone earns no points here: the vector must be drawn, and its length handed in."
    ),
    "by_similarity": N_("It need not be drawn: the point was found by similar triangles."),
    "letters_exchanged": N_("Two letters stand at each other's point: it is compared under the right ones."),
    "letters_unclear": N_("Two letters seem to stand at each other's point: a person must look."),
    "hand_may_miss": N_(
        "Its lines meet at so small an angle that even careful drawing can miss by this much:"
        " a person must look."
    ),
    "triangle_shows": N_("The right triangle on the sketch shows its length."),
    "half_turn_missing": N_(
        "The right triangle on the sketch gives this length: the half turn about the joint is missing."
    ),
    "right_triangle": N_("It is as long as the right triangle on the sketch makes it."),
    "triangle_wrong": N_("It agrees with the right triangle on the sketch: that triangle is wrong."),
    "not_carried_over": N_(
        "The right triangle on the sketch gives another length: it was taken over wrongly."
    ),
    "readings_disagree": N_("The drawing and the entered measurement differ."),
    "written_disagrees": N_("The drawing and the length written on the sheet differ: a person must look."),
    "cells_off": N_("The number read in the sheet's cells does not fit: a person must look."),
    "follows": N_("It is consistent with your own earlier work; that mistake costs points only once."),
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
    UNCHECKED: N_("There is no drawing to compare it with."),
}
"""Sentences at level `hint`, by code of the reason."""

FULL: dict[str, str] = {
    "too_long": N_("It is too long by %(off)s (tolerance ±%(tolerance)s)."),
    "too_short": N_("It is too short by %(off)s (tolerance ±%(tolerance)s)."),
    "place_off": N_("It lies %(off)s from its place (tolerance %(tolerance)s)."),
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
    "unread": N_("It could not be read on the sheet (%(why)s)."),
    "entry_refused": N_("It depends on an unusable entry (%(entries)s); an instructor will check it."),
    "doubtful": N_("It was read with a certainty of %(confidence)s: too little to decide without a person."),
    LOSS_DOUBTFUL: N_(
        "It was read with a certainty of %(confidence)s: too little to take points away without a person."
    ),
    UNSURE: N_("It was read with too little certainty (%(why)s)."),
    MISREAD: N_("It was probably misread; the dotted stroke may be the one meant."),
    "scale_seems_off": N_("%(declared)s is declared, but %(expected)s was probably used: %(factor)s."),
    "near_limit": N_(
        "It is too close to the limit of the tolerance to decide from the scan (standard error %(se)s)."
    ),
    "counted_for_you": N_("It is %(beyond)s over the limit, less than the scan's accuracy (%(good_to)s)."),
    "not_certainly_within": N_(
        "It is %(beyond)s within the limit, less than the scan's accuracy (%(good_to)s):"
        " it counts only if it is certain."
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
    "triangle_shows": N_("By the right triangle at %(at)s on the sketch it is %(foot)s long."),
    "not_carried_over": N_(
        "The right triangle at %(at)s on the sketch gives %(foot)s, the plan has %(measured)s: it was taken"
        " over wrongly."
    ),
    "readings_disagree": N_("The drawing gives %(first)s, the entered measurement %(second)s."),
    "written_disagrees": N_("The drawing gives %(drawn)s, the sheet says %(written)s: a person must look."),
    "scale_refused": N_(
        "The declared scale “%(text)s” could not be understood: %(why)s. Write for example %(examples)s."
    ),
    "scale_off": N_("%(declared)s is declared, but the drawing was made with %(expected)s: %(factor)s."),
    "scale_assumed": N_("The scale was not declared; %(used)s was assumed."),
}
"""Sentences at level `full` that differ from those at level `hint`."""

FOLLOWS: dict[str, str] = {
    "nodes": N_("It is consistent with your own earlier points; that mistake costs points only once."),
    "small_errors": N_(
        "It is consistent with your own earlier points: their small errors, each within its tolerance,"
        " add up here."
    ),
    "scale": N_("It is right at the scale that you used; the wrong scale costs points only once."),
    "vector": N_("It is consistent with your own %(of)s; that mistake costs points only once."),
    "value": N_("It is consistent with your own %(of)s; that mistake costs points only once."),
}
"""Sentences for the reason `follows`, by what the result follows from."""


def reason_sentence(reason: Coded, speaker: Tongue, level: Level, names: Mapping[str, str] = NO_NAMES) -> str:
    """Return the sentence of one reason; a code without a sentence is shown by its name."""
    hint = HINTS.get(reason.code, reason.code)
    is_full = reason.code in FULL and (level == "full" or reason.code == "scale_refused")  # no answer in it
    texts = [FULL[reason.code], hint] if is_full else [hint]
    if reason.code == "follows":
        texts = [FOLLOWS.get(str(reason.parameters.get("what")), hint), hint]
    return filled(texts, spoken(reason.parameters, speaker, names), speaker)
