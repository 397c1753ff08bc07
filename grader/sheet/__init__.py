"""A page to millimetres on the upright sheet.

A printed answer sheet is registered by its markers. On a plain sheet the drawing frame, the paper's
edges and the file's stated resolution are weighed together by their uncertainty; what disagrees or
is missing is told as `Problem`, and what cannot be settled is refused with the reason.
"""

from grader.records import Identity, Page, Sheet, Unread
from grader.sheet import markers
from grader.sheet.halves import half_hint, whole
from grader.sheet.identity import identify
from grader.sheet.lens import straighten
from grader.sheet.markers import middles as marker_middles
from grader.sheet.plain import register_plain

__all__ = ["marker_middles", "rectify", "straighten", "whose"]


def rectify(page: Page) -> Sheet | Unread:
    """The page's map from millimetres to pixels, or, false in a condition, why there is none."""
    sheet = markers.register(page) or register_plain(page)
    if isinstance(sheet, Unread):
        return Unread(sheet.name, f"{sheet.reason}{half_hint(page)}")
    return whole(page, sheet)


def whose(page: Page) -> Identity | None:
    """Whose page it is by its code: a quick look first, then one where a printed sheet has it."""
    found = identify(page)
    if found is not None:
        return found
    sheet = markers.register(page)
    return None if sheet is None else sheet.identity
