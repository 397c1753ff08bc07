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

__all__ = ["marker_middles", "rectify", "register", "straighten"]


def register(page: Page) -> tuple[Sheet | Unread, Identity | None]:
    """The page's map from millimetres to pixels, or why there is none; and whose page it is by its code.

    A printed sheet's code is looked for in its place; elsewhere a quick look must do.
    """
    printed = markers.register(page)
    identity = (None if printed is None else printed.identity) or identify(page)
    sheet = printed or register_plain(page)
    if isinstance(sheet, Unread):
        return Unread(sheet.name, f"{sheet.reason}{half_hint(page)}"), identity
    return whole(page, sheet), identity


def rectify(page: Page) -> Sheet | Unread:
    """The page's map from millimetres to pixels, or, false in a condition, why there is none."""
    return register(page)[0]
