"""The mistakes that planmark names: a title, what was done, what to redo.

`%(at)s` is the node, vector, scale or figure where it was made. Some have other words if a link carries a
guide: a Coriolis component, and the line along the guide.
"""

import re
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

from grader.documents import MistakeDocument, RivalDocument
from grader.language import N_
from reference.construction.mistakes import RIGHT_TRIANGLE, SLIP

ALONG_GUIDE = "guide"
"""Value of a mistake's detail `line` for a line along a moving guide."""
DRIVING_ACROSS, DRIVING_ALONG = "driving across", "driving along"
"""Its values for the driving link's vectors: one is perpendicular to the link, one points along it."""
OF_FORCE, ACROSS_GUIDE = "force", "force across a guide"
"""Its values in force plans."""
HALVED = "half"
"""Its value for a computed length that is half of the right one."""
CORIOLIS_END, NORMAL_END = "k_", "n_"
"""First letters of the nodes at the ends of Coriolis and normal components."""
_NAMED = re.compile(r"%\((\w+)\)s")


@dataclass(frozen=True, slots=True)
class Words:
    """English texts, keys of the catalogues."""

    title: str
    what: str
    redo: str


MISTAKES: dict[str, Words] = {
    "parallel_for_perpendicular": Words(
        N_("parallel instead of perpendicular"),
        N_("At %(at)s, a line was drawn along its link instead of perpendicular to it."),
        N_("Points of one link can only turn about each other: draw the line perpendicular to the link,"
           " then redo what starts from its end."),
    ),
    "wrong_link": Words(
        N_("line drawn by the wrong link"),
        N_("At %(at)s, a line was taken perpendicular to another link than its own."),
        N_("Take the link that joins the two points in the vector's name, and redraw the line by it."),
    ),
    "sense_reversed": Words(
        N_("sense reversed"),
        N_("At %(at)s, the vector was laid off the wrong way round."),
        N_("Take its sense from the sense in which the link turns, and lay it off from the same start."),
    ),
    "rpm_not_converted": Words(
        N_("rev/min not converted"),
        N_("The drawing fits a crank speed that was not converted from rev/min to rad/s."),
        N_("Compute ω = π·n/30 first, divided by the gear's ratio if there is one, then the velocity and the"
           " acceleration of the crank pin, then the scales."),
    ),
    "scale_wrong": Words(
        N_("wrong scale"),
        N_("All lengths that depend on %(at)s are off by one and the same factor."),
        N_("Compute the scale again as real value divided by drawn length, and use it throughout."),
    ),
    "normal_reversed": Words(
        N_("normal component reversed"),
        N_("At %(at)s, the normal component was laid off away from the centre of rotation."),
        N_("A normal component points from the moving point towards the point about which it turns:"
           " lay it off the other way, then draw the perpendicular through its end."),
    ),
    "normal_missing": Words(
        N_("normal component left out"),
        N_("At %(at)s, the perpendicular was drawn without the normal component."),
        N_("Lay off v²/l along the link first, then draw the perpendicular through its end."),
    ),
    "normal_from_absolute": Words(
        N_("normal component from the absolute velocity"),
        N_("At %(at)s, the normal component was computed from an absolute velocity."),
        N_("Use the velocity of one end of the link relative to the other in v²/l."),
    ),
    "other_variant": Words(
        N_("another variant's data"),
        N_("The drawing fits the data of another variant."),
        N_("Check your number and the data that belong to it."),
    ),
    "data_misread": Words(
        N_("crank angle misread"),
        N_("The drawing follows another crank angle than the one given."),
        N_("Look at the angle given, at the axis from which it is measured and in which sense; then draw"
           " the mechanism and the plans again."),
    ),
    "other_assembly": Words(
        N_("mechanism assembled the other way"),
        N_("At %(at)s, the links were assembled in their other possible position."),
        N_("Two arcs meet in two points: take the one on the side that the assignment shows,"
           " and redraw the mechanism and the plans."),
    ),
    "image_mirrored": Words(
        N_("image of the plate mirrored"),
        N_("At %(at)s, the triangle in the plan is the mirror image of what it should be."),
        N_("Going round the triangle in the plan and round the plate in the mechanism, the letters must"
           " follow in the same sense."),
    ),
    "wrong_intersection": Words(
        N_("wrong intersection"),
        N_("At %(at)s, a line was drawn through the wrong point, and so meets the other one in"
           " the wrong place."),
        N_("Draw each line through the end of the vector that comes before it, and take the point where"
           " these two lines meet."),
    ),
    "vector_missing": Words(
        N_("vector missing"),
        N_("%(at)s is not drawn."),
        N_("Complete the plan with it."),
    ),
    "labels_swapped": Words(
        N_("letters swapped"),
        N_("At %(at)s, letters were swapped."),
        N_("The lines can stay; put the letters right and compute the values again."),
    ),
    "figure_rotated": Words(
        N_("figure turned"),
        N_("All of %(at)s is turned by the same angle against the mechanism."),
        N_("Take the directions of parallels and perpendiculars from the mechanism on the same sheet."),
    ),
    "arithmetic": Words(
        N_("slip in the arithmetic"),
        N_("The number at %(at)s does not follow from what it was computed from."),
        N_("Compute it once more; the drawing before it can stay."),
    ),
    "inertia_reversed": Words(
        N_("inertia force along the acceleration"),
        N_("Laid off in the sense of the acceleration, not against it: %(at)s."),
        N_("An inertia force points against the acceleration of the centre of mass: lay it off the other way,"
           " and compute its moment anew."),
    ),
    "force_missing": Words(
        N_("force left out"),
        N_("Left out of the force plan: %(at)s."),
        N_("On a link act its inertia force, its weight, the loads and what other links exert on it: add what"
           " is missing to the polygon and to the moments."),
    ),
    "force_reversed": Words(
        N_("force with the opposite sense"),
        N_("Drawn with the opposite sense: %(at)s."),
        N_("A reaction taken over from another group changes its sense (R_43 = −R_34), and in a closed"
           " polygon all arrows follow one another: turn it round, then redo what follows from it."),
    ),
    "couple_missing": Words(
        N_("moment left out"),
        N_("Left out of the sum of moments: %(at)s."),
        N_("A link with an angular acceleration has the moment −I·ε of its inertia forces: add what is"
           " missing to the sum of moments, then redo what follows from it."),
    ),
    "couple_reversed": Words(
        N_("moment with the opposite sense"),
        N_("Counted with the opposite sign in the sum of moments: %(at)s."),
        N_("The moment of the inertia forces acts against the angular acceleration: change its sign, then"
           " redo what follows from it."),
    ),
    "wrong_arm": Words(
        N_("wrong arm of a moment"),
        N_("In the sum of moments for %(at)s, an arm was measured to a force's point instead of to its"
           " line."),
        N_("The arm is the perpendicular from the joint to the force's line of action: measure it anew, and"
           " compute the sum of moments again."),
    ),
    "units": Words(
        N_("other units or signs"),
        N_("%(at)s were entered in other units, or with other signs, than the assignment asks for."),
        N_("Check the unit, the sense and the axis, and enter them again."),
    ),
}  # fmt: skip

_UNITS: dict[str, Words] = {
    "radians": Words(
        N_("directions in radians"),
        N_("The directions were entered in radians instead of degrees."),
        N_("Multiply each direction by 180/π."),
    ),
    "clockwise": Words(
        N_("directions clockwise"),
        N_("The directions were measured clockwise instead of counter-clockwise: their signs are reversed."),
        N_("Directions count counter-clockwise from the +x axis: reverse the sign of each."),
    ),
    "axis": Words(
        N_("directions from another axis"),
        N_("The directions were measured from the %(axis)s axis instead of the +x axis."),
        N_("Directions count counter-clockwise from the +x axis: measure them from there."),
    ),
    "lengths": Words(
        N_("lengths in another unit"),
        N_("The lengths were entered in %(unit)s instead of mm."),
        N_("Enter the lengths in millimetres."),
    ),
    "values": Words(
        N_("values in another unit"),
        N_("The values were computed in %(unit)s instead of SI units."),
        N_("Enter velocities in m/s, accelerations in m/s², angular velocities in rad/s."),
    ),
    "moment": Words(
        N_("values in another unit"), N_("%(at)s was entered in %(unit)s, not N m."), N_("Enter it in N m.")
    ),
    "exchanged": Words(
        N_("kv and ka exchanged"),
        N_("The scales kv and ka were exchanged: each was declared as the other one."),
        N_("kv is the scale of velocities, ka that of accelerations: write each in its own place."),
    ),
    "typing": Words(
        N_("typing slip"),
        N_("The entry of %(at)s looks like a typing slip."),
        N_("Compare it with your drawing, and enter it again."),
    ),
    "entries": Words(
        N_("entries exchanged"),
        N_("The entries of %(at)s and %(other)s seem to be exchanged."),
        N_("Write each in its own place."),
    ),
}  # fmt: skip
"""Words by the kind of unit slip."""

_CORIOLIS: dict[str, Words] = {
    "normal_missing": Words(
        N_("Coriolis component left out"),
        N_("At %(at)s, the Coriolis component was left out."),
        N_("Where a block slides along a turning guide, lay off 2·ω·v first, then draw the line along"
           " the guide through its end."),
    ),
    "normal_reversed": Words(
        N_("Coriolis component reversed"),
        N_("At %(at)s, the Coriolis component was laid off the wrong way round."),
        N_("Turn the sliding velocity of the guide's point relative to the block by 90° in the sense in"
           " which the guide turns: that is its direction."),
    ),
    "parallel_for_perpendicular": Words(
        N_("Coriolis component along the sliding velocity"),
        N_("At %(at)s, the Coriolis component was laid off along the sliding velocity, not across it."),
        N_("Turn the sliding velocity of the guide's point relative to the block by 90° in the sense in"
           " which the guide turns: that is its direction."),
    ),
    "arithmetic": Words(
        N_("Coriolis component without its factor 2"),
        N_("At %(at)s, the Coriolis component is half of what it should be."),
        N_("It is 2·ω·v, not ω·v: lay it off twice as long, and redo what starts from its end."),
    ),
}  # fmt: skip
_ALONG_GUIDE: dict[str, Words] = {
    "parallel_for_perpendicular": Words(
        N_("perpendicular instead of along the guide"),
        N_("At %(at)s, a line was drawn perpendicular to the guide instead of along it."),
        N_("A block can only slide along its guide: draw the line along the guide, then redo what starts"
           " from its end."),
    ),
    "wrong_link": Words(
        N_("line drawn by the wrong link"),
        N_("At %(at)s, a line was taken along another link than the one that carries the guide."),
        N_("The block slides along its own guide: redraw the line by it."),
    ),
}  # fmt: skip
_DRIVING_ACROSS: dict[str, Words] = {
    "parallel_for_perpendicular": Words(
        N_("vector along the link instead of perpendicular to it"),
        N_("At %(at)s, the driving link's vector was drawn along the link instead of perpendicular to it."),
        N_("A point that turns about a pivot moves perpendicular to the line from the pivot: lay its vector"
           " off so, in the sense of rotation, then redo the plan."),
    ),
}  # fmt: skip
_DRIVING_ALONG: dict[str, Words] = {
    "parallel_for_perpendicular": Words(
        N_("vector perpendicular to the link instead of along it"),
        N_("At %(at)s, the driving link's vector was drawn perpendicular to the link instead of along it."),
        N_("A normal acceleration points along the link, from the moving point to the pivot: lay it off so,"
           " then redo the plan."),
    ),
}  # fmt: skip
_BY_TRIANGLE: dict[str, Words] = {
    "arithmetic": Words(
        N_("right triangle at scales that do not allow it"),
        N_("At %(at)s, the normal component was drawn by the right triangle on the sketch."),
        N_("The triangle gives the component at the scale ka only where kL·ka = kv². With your scales compute"
           " v²/l, divide it by ka, and lay that off."),
    ),
}  # fmt: skip
_TRIANGLE_WRONG: dict[str, Words] = {
    "arithmetic": Words(
        N_("right triangle drawn wrongly"),
        N_("At %(at)s, the normal component was taken from a right triangle on the sketch that is wrong."),
        N_("Lay off the velocity at the joint, perpendicular to the link and as long as in the plan; draw the"
           " right angle at its end."),
    ),
}  # fmt: skip
_NOT_CARRIED_OVER: dict[str, Words] = {
    "arithmetic": Words(
        N_("wrong length taken from the right triangle"),
        N_("At %(at)s, the normal component is not as long as the right triangle on the sketch makes it."),
        N_("Take the distance from the joint to the point where the triangle meets the link's line, and lay"
           " that off."),
    ),
}  # fmt: skip
_DRIVING = Words(
    N_("sense reversed"),
    N_("%(at)s turns the other way."),
    N_("Take the sense in which the driving link turns from the assignment."),
)
_FORCE: dict[str, Words] = {
    "parallel_for_perpendicular": Words(
        N_("perpendicular to the link instead of along it"),
        N_("Drawn perpendicular to the link instead of along it: %(at)s."),
        N_("The part across a link is found from moments, the other part acts along the link: draw it so, and"
           " close the polygon again."),
    ),
    "wrong_link": Words(
        N_("line drawn by the wrong link"),
        N_("Drawn by another link than its own: %(at)s."),
        N_("Take its line along its own link, or across its own guide, and close the polygon again."),
    ),
    "wrong_intersection": Words(
        N_("polygon closed from the wrong point"),
        N_("Its line was drawn through the wrong point of the polygon: %(at)s."),
        N_("Lay off all known forces head to tail; the two closing lines pass through the two ends of this"
           " chain."),
    ),
    "sense_reversed": Words(
        N_("sense reversed"),
        N_("Laid off the wrong way round: %(at)s."),
        N_("Its sense follows from the sum of moments about the inner joint, each moment with its sign."),
    ),
    "arithmetic": Words(
        N_("slip in the arithmetic"),
        N_("Its size does not follow from what it was computed from: %(at)s."),
        N_("Compute it once more: m·a for an inertia force, m·g for a weight, the sum of moments divided by"
           " its arm for the part across a link; then redo what follows from it."),
    ),
}  # fmt: skip
_ACROSS_GUIDE: dict[str, Words] = {
    **_FORCE,
    "parallel_for_perpendicular": Words(
        N_("reaction along the guide instead of across it"),
        N_("Drawn along the guide instead of perpendicular to it: %(at)s."),
        N_("Without friction a guide only presses across itself: draw its reaction perpendicular to it, and"
           " close the polygon again."),
    ),
}  # fmt: skip
_GIVEN_REVERSED = N_(
    "An inertia force points against the acceleration of the centre of mass, a weight downwards, a load as"
    " the task says: turn it round, then redo what follows from it."
)
_CLOSING_REVERSED = N_(
    "In a closed polygon all arrows follow one another: turn it round, then redo what follows from it."
)
_TAKEN_OVER = re.compile(r"R_(?!0)[^_]+")
"""A reaction between two links, which another group's polygon has the other way round."""
_BY_LINE = {
    ALONG_GUIDE: _ALONG_GUIDE, DRIVING_ACROSS: _DRIVING_ACROSS, DRIVING_ALONG: _DRIVING_ALONG,
    OF_FORCE: _FORCE, ACROSS_GUIDE: _ACROSS_GUIDE, RIGHT_TRIANGLE: _BY_TRIANGLE,
    "triangle_wrong": _TRIANGLE_WRONG, "not_carried_over": _NOT_CARRIED_OVER,
    "driven across": _DRIVING_ACROSS, "driven along": _DRIVING_ALONG,  # earlier versions
}  # fmt: skip


PRECISE: dict[str, tuple[str, ...]] = {
    "rpm_not_converted": (N_("ω was computed as %(formula)s instead of %(instead_of)s."),),
    "parallel_for_perpendicular": (
        N_("The line from %(from)s to %(at)s was drawn along %(link)s instead of perpendicular to it."),
    ),
    "wrong_link": (
        N_("The line from %(from)s to %(at)s was drawn perpendicular to %(other)s instead of to %(link)s."),
    ),
    "wrong_intersection": (
        N_("The line to %(at)s was drawn from %(other)s instead of from %(from)s, and so meets the other one"
           " in the wrong place."),
        N_("%(at)s was taken on the line of %(instead)s instead of on its own line from %(from)s."),
    ),
    "sense_reversed": (N_("The vector %(vector)s was laid off the wrong way round."),),
    "normal_reversed": (
        N_("The normal component %(vector)s was laid off away from the centre of rotation."),
    ),
    "normal_missing": (N_("The perpendicular was drawn without the normal component %(vector)s."),),
    "normal_from_absolute": (
        N_("The normal component %(vector)s was computed from an absolute velocity."),
    ),
    "scale_wrong": (
        N_("All lengths that depend on %(at)s are %(factor)s times what they should be."),
    ),
    "image_mirrored": (
        N_("At %(centre)s, the triangle on the mechanism is the mirror image of the one in the plan: their"
           " letters follow in opposite senses."),
    ),
    "labels_swapped": (N_("The letters %(first)s and %(second)s stand at each other's point."),),
    "figure_rotated": (
        N_("All of %(at)s is turned by %(degrees)s° counter-clockwise against the mechanism."),
    ),
    "data_misread": (
        N_("The drawing follows a crank that stands at %(crank_deg)s°, counter-clockwise from the axis to the"
           " right; that is not the angle given."),
    ),
    "other_variant": (
        N_("Only this part of the drawing fits the data of number %(n)s: %(part)s."),
        N_("Only this part of the drawing fits the data of position %(position)s: %(part)s."),
        N_("The drawing fits the data of number %(n)s."),
        N_("The drawing fits the data of position %(position)s."),
    ),
}  # fmt: skip
_PRECISE_UNITS: dict[str, tuple[str, ...]] = {
    "typing": (N_("The entry of %(at)s looks like a typing slip: %(entered)s for %(meant)s."),),
    "radians": (
        N_("The directions were entered in radians instead of degrees: each is %(factor)s times too small."),
    ),
    "lengths": (
        N_("The lengths were entered in %(unit)s instead of mm: each is %(factor)s times too small."),
    ),
    "values": (
        N_("The values were computed in %(unit)s instead of SI units: each is %(factor)s times too large."),
    ),
}  # fmt: skip
"""More precise than `Words.what` if every name is known: the first text with all of its names counts."""
PRECISE_ALONG_GUIDE: dict[str, tuple[str, ...]] = {
    "parallel_for_perpendicular": (
        N_("The line from %(from)s to %(at)s was drawn perpendicular to the guide instead of along it."),
    ),
    "wrong_link": (
        N_("The line from %(from)s to %(at)s was drawn along %(other)s instead of along the guide."),
    ),
}  # fmt: skip
_PRECISE_BY_TRIANGLE = (N_("The normal component %(vector)s was drawn by the right triangle on the sketch."),)
GIVING_AWAY = frozenset({"factor", "degrees", "n", "position", "crank_deg", "meant"})
"""Details of a mistake that are shown only to those who may see the answers."""


def precise(code: str, at: str, line: str, known: Collection[str]) -> str | None:
    """Return the text that says what was done, with all known details; None if too little is known."""
    if at.startswith(CORIOLIS_END):
        return None
    texts = PRECISE.get(code, ())
    if code == "units":
        texts = _PRECISE_UNITS.get(line, ())
    elif line in {OF_FORCE, ACROSS_GUIDE}:
        texts = ()
    elif line == ALONG_GUIDE:
        texts = PRECISE_ALONG_GUIDE.get(code, texts)
    elif line == RIGHT_TRIANGLE:
        texts = _PRECISE_BY_TRIANGLE
    return next((text for text in texts if set(_NAMED.findall(text)) <= set(known)), None)


def words_of(code: str, at: str = "", line: str = "") -> Words:
    """Return the words for a mistake of this code made there, in a `line` along a guide or across a link.

    For a slip of units, `line` is its kind; for a wrong length, its cause, or `HALVED`.

    Raises KeyError for an unknown code.
    """
    usual = MISTAKES[code]
    if at.startswith(CORIOLIS_END) and (code != SLIP or line == HALVED):
        return _CORIOLIS.get(code, usual)
    if code == "units":
        return _UNITS.get(line, usual)
    if code == "sense_reversed" and at.startswith(("omega", "epsilon")):
        return _DRIVING
    if code == "force_reversed" and not _TAKEN_OVER.fullmatch(at):
        is_closing = at.startswith("R_") or at == "F_b"
        return replace(usual, redo=_CLOSING_REVERSED if is_closing else _GIVEN_REVERSED)
    return _BY_LINE.get(line, {}).get(code, usual)


def line_in(details: Mapping[str, object]) -> str:
    """Return the kind of line or slip among a mistake's details, as `words_of` takes it; empty if none."""
    half = HALVED if details.get("factor") == 0.5 else ""
    return str(details.get("line", details.get("slip", half)))


def mistake_title(cause: MistakeDocument | RivalDocument) -> str:
    """Return the title of a report's mistake, a key of the catalogues."""
    return words_of(cause.code, cause.at, line_in(cause.parameters)).title


QUESTIONS: dict[str, str] = {
    "parallel_for_perpendicular": N_("Along which direction did you draw the line to %(at)s?"),
    "wrong_link": N_("To which link did you draw the line to %(at)s perpendicular?"),
    "sense_reversed": N_("Which way did you lay off the vector that ends in %(at)s?"),
    "rpm_not_converted": N_("With which value of ω did you compute?"),
    "scale_wrong": N_("With which scale %(at)s did you compute the lengths that you drew?"),
    "normal_reversed": N_("Which way did you lay off the component that ends in %(at)s?"),
    "normal_missing": N_("Did you lay off the component that ends in %(at)s?"),
    "normal_from_absolute": N_("From which velocity did you compute the component that ends in %(at)s?"),
    "other_variant": N_("Whose number and data did you draw with?"),
    "data_misread": N_("At which angle did you draw the crank, and from which axis did you measure it?"),
    "other_assembly": N_("On which side does %(at)s lie on your sketch of the mechanism?"),
    "image_mirrored": N_(
        "Going round the triangle with %(at)s, do the letters follow in the same sense as on the plate?"
    ),
    "wrong_intersection": N_("From which point did you draw each of the two lines that meet in %(at)s?"),
    "vector_missing": N_("Did you draw %(at)s?"),
    "labels_swapped": N_("At which points of your plan do the letters %(first)s and %(second)s stand?"),
    "figure_rotated": N_("Is all of %(at)s turned against the mechanism, or only its first vector?"),
    "arithmetic": N_("What length did you compute for the component that ends in %(at)s, and from what?"),
    "inertia_reversed": N_("In which sense did you lay off %(at)s?"),
    "force_missing": N_("Did you lay off %(at)s?"),
    "force_reversed": N_("In which sense did you lay off %(at)s?"),
    "couple_missing": N_("Did you count %(at)s in the sum of moments?"),
    "couple_reversed": N_("With which sign did you count %(at)s in the sum of moments?"),
    "wrong_arm": N_("How did you measure the arms in the sum of moments for %(at)s?"),
    "units": N_("In which unit, in which sense and from which axis did you measure?"),
}
"""A question to the student that distinguishes a mistake from others with the same effect."""
LEAST_KNOWN: dict[str, str] = {
    "labels_swapped": N_("At which points of your plan do the letters stand?"),
}
"""Replaces a question that names an unknown detail."""


def question_of(code: str, known: Collection[str]) -> str:
    """Return the question that distinguishes a mistake from its rivals; empty for a code without one."""
    text = QUESTIONS.get(code, "")
    return text if set(_NAMED.findall(text)) <= set(known) else LEAST_KNOWN.get(code, "")
