"""What the class's page says of sheets that look alike and of marks that moved."""

from collections.abc import Mapping

from grader.documents import Cause, Sign
from grader.i18n import N_

SIGNS: Mapping[Sign, str] = {
    "hand_errors": N_("the same small errors of the hand"),
    "same_place": N_("figures lie in the same places on the sheet"),
    "same_numbers": N_("the same measured values"),
    "same_picture": N_("the ink lies in the same places"),
    "other_number": N_("drawn with the other's number"),
}
CHANCE = N_("By chance a class like this shows %(chance)s such pairs.")
CAUSES: Mapping[Cause, str] = {
    "assignment": N_("the assignment was changed"),
    "rubric": N_("the rubric was changed"),
    "submission": N_("other files were handed in"),
    "roster": N_("the roster was changed"),
    "program": N_("another version of the program"),
    "new": N_("new"),
    "gone": N_("no longer there"),
}
