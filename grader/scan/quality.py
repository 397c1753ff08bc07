"""What of a picture spoils the reading of a sheet: cut corners, blur, bad light, too few pixels."""

from grader.records import Flaw, Page, Sheet
from reference.drawing.canvas import MM_PER_INCH

LEAST_DPI = 150.0
"""What answer sheets and students are told; below it thin pencil lines are less than a pixel wide."""


def flaws(page: Page, sheet: Sheet | None) -> tuple[Flaw, ...]:
    """What spoils the reading of a decoded page, the worst first.

    Arguments: `sheet` is its registration, None where it was refused.
    """
    found: list[Flaw] = []
    if sheet is not None:
        dpi = sheet.px_per_mm * MM_PER_INCH
        if dpi < LEAST_DPI:
            found.append(Flaw("too_coarse", dpi, LEAST_DPI))
    return tuple(found)
