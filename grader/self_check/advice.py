"""Hints of a self-check on a value: how it is off, and what to look at; never the answer.

A mistake that the diagnosis names with certainty is explained by the law that it breaks.
"""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass

from grader.feedback.mistakes import (
    ACROSS_GUIDE,
    ALONG_GUIDE,
    CORIOLIS_END,
    DRIVING_ACROSS,
    DRIVING_ALONG,
    OF_FORCE,
    line_in,
)
from grader.language import N_, Tongue
from grader.options import Level
from grader.outcomes import Judgement, NamedMistake
from grader.records import Reason
from grader.self_check.results import Checked, Result, certain_mistakes, checked_values
from grader.texts.reasons import reason_sentence
from grader.texts.spoken import place
from reference.authored.assignment import SCALE_NAMES, Assignment
from reference.construction.mistakes import RIGHT_TRIANGLE, SLIP
from reference.quantities import kind_of

RESULTS: Mapping[Result, tuple[str, str]] = {
    "right": ("✓", N_("right")),
    "off": ("✗", N_("off")),
    "open": ("?", N_("cannot be told")),
}
"""Mark and word of each result."""

OWN_HINTS: dict[str, str] = {
    "follows": N_("It is consistent with your own earlier work."),
    "hand_may_miss": N_(
        "Its lines meet at so small an angle that even careful drawing can miss by this much."
    ),
    "near_limit": N_("It is too close to the limit of the tolerance to decide."),
    "entry_refused": N_("It depends on an unusable entry."),
}
"""Replaces sentences that mention points or a person who must look."""

_LINES = N_(
    "Look at the two lines that meet in its end: from which point, and along or across what, is each?"
)
_LETTERS = N_("Look at the letters of its name: from which point of the plan to which does it run?")
_ENTRY = N_("Look at this entry again: its number and its unit.")
_BY_MOMENTS = N_("The sum of moments about the inner joint gives the size and the sense of the part across.")
_LAID_OFF = N_(
    "Look at what it is: m·a against the acceleration of the centre of mass, m·g downwards, or the load as it"
    " is given; then at the scale kF."
)
_AS_IN_PLAN = N_("It must be parallel to the vector of the plan, of its sense, and as long.")
SIZE = {
    "sketch": _AS_IN_PLAN,
    "driving": N_(
        "Look at the real value that you computed for it, and at the scale that you divided it by."
    ),
    "n": N_("Look at v²/l again: which velocity, which length, and by which scale did you divide?"),
    "c": N_(
        "Look at 2·ω·v again: which link turns, what slides along it, and by which scale did you divide?"
    ),
    "laid off": _LAID_OFF,
    "across": _BY_MOMENTS,
    "": _LINES,
}
TURN = {
    "sketch": _AS_IN_PLAN,
    "driving": N_("Look at the driving link on your sketch: how does this vector lie to it?"),
    "n": N_("Look at the link that it lies along."),
    "t": N_("Look at the link that it stands perpendicular to."),
    "c": N_("Look at the sliding velocity that it is turned from."),
    "laid off": _LAID_OFF,
    "across": N_("Look at the link that it stands perpendicular to."),
    "": N_("Look at what sets the direction of its lines: which link, or which guide?"),
}
SENSE = {
    "sketch": _AS_IN_PLAN,
    "driving": N_("Look at the sense in which the driving link moves."),
    "n": N_("Look at the point that it must point towards."),
    "c": N_("Look at the sense in which the guide turns."),
    "laid off": _LAID_OFF,
    "across": _BY_MOMENTS,
    "force": N_("Look at which link acts on which, and at how the arrows follow one another."),
    "": _LETTERS,
}
VALUE = {
    "rate": N_("Look at the vector and the length that you divided, and at their units."),
    "moment": N_("Look at each force and its arm in metres, and at the unit of the moment, N m."),
    "": N_("Look at the drawn length, and at the scale that you multiplied it by."),
}
SENSE_OF_LINK = {
    "moment": N_("Look at your sketch: which way do the forces turn the link? The moment acts against them."),
    "": N_("Look at your sketch: which way does the relative vector turn the link?"),
}
ADVICE: dict[str, Mapping[str, str]] = {
    "too_long": SIZE,
    "too_short": SIZE,
    "turned_left": TURN,
    "turned_right": TURN,
    "reversed": SENSE,
    "value_too_large": VALUE,
    "value_too_small": VALUE,
    "value_reversed": SENSE_OF_LINK,
    "sense_wrong": SENSE_OF_LINK,
    "sense_missing": SENSE_OF_LINK,
    "place_off": {
        "": N_("Look at the triangle of the plan that it is found by: which sides, and in which sense?")
    },
    "should_be_zero": {"": N_("Look at which points stand still for an instant here.")},
    "not_measured": {"": N_("Measure what is missing, and enter it.")},
    "too_short_to_judge": {"": N_("Measure what is missing, and enter it.")},
    "unread": {"": _ENTRY},
    "entry_refused": {"": _ENTRY},
    "near_limit": {"": N_("Measure it again.")},
    "hand_may_miss": {"": _LINES},
    "other_variant": {"": N_("Look at your number, and at the data that belong to it.")},
    "data_misread": {"": N_("Look at the crank's angle: from which axis and in which sense it is measured.")},
    "data_unclear": {"": N_("Look at your number, and at the data that belong to it.")},
    "scale_off": {"": N_("Look at how it is made: real value divided by drawn length, each with its unit.")},
    "scale_assumed": {"": N_("Give the scale that you used, with its unit.")},
}
"""Advice by code of the reason and kind of the value; `""` for every other kind."""
ON_SHEET = {
    "unread": N_("Draw it clearly, with its arrow and letters, and photograph the sheet again."),
    "doubtful": N_("Draw it clearly, with its arrow and letters, and photograph the sheet again."),
    "not_drawn": N_("Draw it, with its arrow and letters."),
    "no_line": N_("Draw it, with its arrow and letters."),
    "near_limit": N_("Measure it on the sheet."),
    "scale_assumed": N_("Write the scale that you used on the sheet, with its unit."),
}
"""Advice on a drawing, by code, if it differs from that on a file of measurements."""

LAWS: dict[str, str] = {
    "parallel_for_perpendicular": N_(
        "Two points of one link can only turn about each other: one moves across the line that joins them."
    ),
    "wrong_link": N_(
        "The direction of a relative vector is set by the link that joins the two points in its name."
    ),
    "sense_reversed": N_("A link turns with its ends: each end moves the way in which the link turns."),
    "rpm_not_converted": N_(
        "ω = π·n/30 with n in rev/min gives ω in rad/s; behind a gear, n is divided by its ratio."
    ),
    "scale_wrong": N_(
        "A scale is the real value divided by the drawn length, one and the same for the whole plan."
    ),
    "normal_reversed": N_("a_n points towards the centre of rotation, always."),
    "normal_missing": N_("A point that turns has a_n = v²/l too; only where v = 0 there is none."),
    "normal_from_absolute": N_("a_n = v²/l of a link uses the relative velocity of its ends."),
    "other_variant": N_("Each number has its own data."),
    "data_misread": N_("The angle given says where the crank stands; all the rest follows from it."),
    "other_assembly": N_(
        "Two arcs meet in two points: the scheme of the assignment shows which one is meant."
    ),
    "image_mirrored": N_("The image of a link is similar to it, with its letters in the same sense."),
    "wrong_intersection": N_(
        "v_B = v_A + v_BA: each vector begins where the one before it ends, accelerations too."
    ),
    "labels_swapped": N_("The vector from the pole to a letter belongs to the point with that letter."),
    "figure_rotated": N_("All directions of a plan are taken from the mechanism in the same position."),
    "arithmetic": N_("Drawn length = real value / scale."),
    "inertia_reversed": N_("F_i = −m·a: an inertia force points against the acceleration."),
    "force_missing": N_("A force polygon holds every force that acts on the links of its group."),
    "force_reversed": N_("R_ij = −R_ji, and in a closed polygon all arrows follow one another."),
    "couple_missing": N_("The sum of moments holds every force and every moment on the link."),
    "couple_reversed": N_("M_i = −I·ε: it acts against the angular acceleration."),
    "wrong_arm": N_("An arm is the perpendicular from the joint to the force's line of action."),
    "units": N_(
        "Lengths are in millimetres, directions in degrees counter-clockwise from the +x axis, values in SI"
        " units."
    ),
}
"""The law that a mistake breaks, by its code."""
_TURNED = N_("a_c is the sliding velocity turned by 90° in the sense in which the guide turns.")
_CORIOLIS = {
    "normal_missing": N_("Where a block slides along a guide that turns there is a_c = 2·ω·v too."),
    "normal_reversed": _TURNED,
    "parallel_for_perpendicular": _TURNED,
    "arithmetic": N_("a_c = 2·ω·v."),
}
_BY_LINES = N_("Without friction a guide presses across itself; what moments leave acts along the link.")
_OF_FORCES = {
    "parallel_for_perpendicular": _BY_LINES,
    "wrong_link": _BY_LINES,
    "wrong_intersection": LAWS["force_missing"],
    "sense_reversed": _BY_MOMENTS,
    "arithmetic": _BY_MOMENTS,
}
_ACROSS = N_("A point that turns about a pivot moves across the line to the pivot.")
_BY_TRIANGLE = N_("The right triangle gives v²/l at the scale ka only where kL·ka = kv².")
_OF_LINE = {
    DRIVING_ACROSS: {"parallel_for_perpendicular": _ACROSS},
    DRIVING_ALONG: {"parallel_for_perpendicular": N_("a_n lies along the link, towards the pivot.")},
    ALONG_GUIDE: {
        "parallel_for_perpendicular": N_("A block can only move along its guide."),
        "wrong_link": N_("A block moves along its own guide."),
    },
    RIGHT_TRIANGLE: {"arithmetic": _BY_TRIANGLE},
    OF_FORCE: _OF_FORCES,
    ACROSS_GUIDE: _OF_FORCES,
}
"""The law that a mistake in a line of this kind breaks, by its code."""
_SAME = N_("The same mistake as at %(name)s.")


@dataclass(frozen=True, slots=True)
class CheckedLine:
    """The result of a self-check for one value, in a language; `advice` may be empty."""

    checked: Checked
    name: str
    hint: str
    advice: str

    @property
    def result(self) -> Result:
        """Right, off, or open."""
        return self.checked.result


def checked_lines(
    judgement: Judgement,
    level: Level,
    speaker: Tongue,
    assignment: Assignment,
    unread: Collection[str] | None = None,
) -> list[CheckedLine]:
    """Return the submitted values, each with its hint and one line of advice as the level allows.

    Arguments: `unread` are the vectors of a drawing that could not be read; None for entered measurements.
    """
    names, driving = assignment.names, assignment.mechanism_file.driver.pin
    values = checked_values(judgement, level, unread or ())
    other = next((one for one in judgement.mistakes if one.code == "other_variant"), None)
    of_other = [one for one in values if any(reason.code == "other_variant" for reason in one.reasons[:1])]
    if other is not None and of_other and level == "hint":
        # Said once: the verdict on each value by those data is of no use here.
        hint = _hint(of_other[0].reasons[0], speaker, level, names)
        advice = speaker.gettext(advice_on(of_other[0].reasons[:1], "", driving))
        return [CheckedLine(of_other[0], ", ".join(other.detail), hint, advice)]
    laws: dict[str, str] = {}
    told: dict[str, str] = {}
    lines = []
    for mistake in certain_mistakes(judgement) if level == "hint" else ():
        law = law_of(mistake)
        laws |= dict.fromkeys((one for one in mistake.explains if one not in laws), law)
    own = {} if unread is None else ON_SHEET
    for one in values:
        name = place(one.name, speaker, names)
        # A right value needs one reason: the others describe errors that were accepted.
        shown = one.reasons[:1] if one.result == "right" else one.reasons
        hint = " ".join(dict.fromkeys(_hint(reason, speaker, level, names) for reason in shown))
        advice = ""
        if level == "hint" and one.result != "right":
            law = laws.get(one.criterion, "")
            if law in told:
                advice = speaker.gettext(_SAME) % {"name": told[law]}
            else:
                on_sheet = next((own[reason.code] for reason in one.reasons if reason.code in own), "")
                advice = speaker.gettext(law or on_sheet or advice_on(one.reasons, one.name, driving))
            told.update({law: name} if law and law not in told else {})
        lines.append(CheckedLine(one, name, hint, advice))
    return lines


def _hint(reason: Reason, speaker: Tongue, level: Level, names: Mapping[str, str]) -> str:
    if level == "hint" and reason.code in OWN_HINTS:
        return speaker.gettext(OWN_HINTS[reason.code])
    return reason_sentence(reason, speaker, level, names)


def advice_on(reasons: Sequence[Reason], name: str, driving: str) -> str:
    """Return the advice, a key of the catalogues; empty if no reason has any."""
    known = next((ADVICE[reason.code] for reason in reasons if reason.code in ADVICE), {})
    return known.get(_kind(name, driving), known.get("", ""))


def _kind(name: str, driving: str) -> str:
    """Return a value's kind: scale, rate, moment, force, driving, sketch, part of acceleration, or none."""
    if name in SCALE_NAMES:
        return "scale"
    if name.startswith(("omega", "epsilon")):
        return "rate"
    if kind_of(name).name == "moment":
        return "moment"
    if kind_of(name).name == "force":
        is_laid_off = name[0] in "FG" and name != "F_b"
        return "laid off" if is_laid_off else "across" if name.endswith("_t") else "force"
    _, about, part = f"{name}__".split("_")[:3]
    return "driving" if about == driving and part != "sketch" else part


def law_of(mistake: NamedMistake) -> str:
    """Return the law that a mistake breaks, a key of the catalogues; empty for one without."""
    usual = LAWS.get(mistake.code, "")
    if mistake.at.startswith(CORIOLIS_END):
        return _CORIOLIS.get(mistake.code, usual)
    if _kind(mistake.at, "") == "laid off" and mistake.code in {SLIP, "force_reversed"}:
        return usual if mistake.code == SLIP else _LAID_OFF
    return _OF_LINE.get(line_in(mistake.detail), {}).get(mistake.code, usual)
