"""What a student is told of a photo that reads badly: what is wrong with it, and what to do."""

from grader.language import N_, Tongue, tongue
from grader.records import ACCELERATION_PLAN, VELOCITY_PLAN, Flaw, Problem, ScannedPage

CORNERS = {
    "upper_left": N_("the upper left corner"),
    "upper_right": N_("the upper right corner"),
    "lower_left": N_("the lower left corner"),
    "lower_right": N_("the lower right corner"),
}
"""Of the sheet, by the place of a flaw."""
AREAS = {
    "upper_left": N_("at the upper left"),
    "upper_middle": N_("at the top"),
    "upper_right": N_("at the upper right"),
    "middle_left": N_("at the left"),
    "middle": N_("in the middle"),
    "middle_right": N_("at the right"),
    "lower_left": N_("at the lower left"),
    "lower_middle": N_("at the bottom"),
    "lower_right": N_("at the lower right"),
}
"""On the sheet, by the place of a flaw."""
CORNER_CUT = (
    N_("%(corners)s is not in the picture: step back until all four corners of the sheet are in view."),
    N_("%(corners)s are not in the picture: step back until all four corners of the sheet are in view."),
)
"""For one corner, and for several."""
FLAWS = {
    "blurred": N_(
        "The picture is blurred: wipe the lens, tap on the sheet so that the camera focuses, and hold the"
        " phone still with both hands."
    ),
    "shadow": N_(
        "A shadow lies on the sheet (%(areas)s): put the lamp to one side, or stand so that neither you nor"
        " the phone shades the sheet."
    ),
    "too_dark": N_("The picture is too dark: photograph by daylight or under a bright lamp."),
    "overexposed": N_(
        "The picture is too bright, the lines fade: tap on the sheet to set the brightness, and switch the"
        " flash off."
    ),
    "glare": N_(
        "Light is reflected on the sheet (%(areas)s): switch the flash off, or move the sheet away from the"
        " lamp."
    ),
    "too_coarse": N_(
        "The picture has too few pixels (%(measured)s of the %(limit)s dots per inch of paper that are"
        " needed): send the original photo, not a reduced copy, or scan at 200 dpi or more."
    ),
    "far_away": N_("The sheet fills too little of the picture: go nearer until it fills the picture."),
    "too_tilted": N_(
        "The sheet was photographed from one side, so that its far side is too small: hold the phone level"
        " above the middle of the sheet."
    ),
    "not_placed": N_(
        "The sheet's edges could not be followed: lay it flat, with a strip of a darker table around it, and"
        " hold the phone level above its middle."
    ),
    "no_sheet": N_(
        "No sheet was found in the picture: lay the sheet flat on a table of another colour, and photograph"
        " it from above with all four corners in view."
    ),
}
"""By the code of the flaw: what is wrong, and what to do."""

PLANS_UNSEEN = {
    VELOCITY_PLAN: N_("No velocity plan was found: if it is on another sheet, check that one, too."),
    ACCELERATION_PLAN: N_("No acceleration plan was found: if it is on another sheet, check that one, too."),
}
"""Of a photo on which the plan of this name was not found."""


def flaw_sentence(flaw: Flaw, speaker: Tongue) -> str:
    """What is wrong with the picture, and what to do, in the student's language."""
    if flaw.code == "corner_cut":
        text = speaker.gettext(CORNER_CUT[len(flaw.places) > 1]) % {
            "corners": ", ".join(speaker.gettext(CORNERS[place]) for place in flaw.places)
        }
        return text[:1].upper() + text[1:]
    known = {
        "areas": ", ".join(speaker.gettext(AREAS[place]) for place in flaw.places),
        "measured": speaker.number(flaw.measured, 0),
        "limit": speaker.number(flaw.limit, 0),
    }
    return speaker.gettext(FLAWS[flaw.code]) % known


def flaw_problems(page: ScannedPage, lang: str) -> tuple[Problem, ...]:
    """The flaws of a page as problems of a report in a language."""
    speaker = tongue(lang)
    return tuple(Problem(flaw.code, flaw_sentence(flaw, speaker), page.ref.file) for flaw in page.flaws)
