"""A page to millimetres on the upright sheet.

A printed answer sheet is registered by its markers. On a plain sheet the drawing frame, the paper's
edges and the file's stated resolution are weighed together by their uncertainty; what disagrees or
is missing is told as `Problem`, and what cannot be settled is refused with the reason.
"""

import numpy as np

from grader.pixels import mapped
from grader.records import Identity, Page, Sheet, Unread
from grader.sheet import markers
from grader.sheet.identity import identify
from grader.sheet.lens import straighten
from grader.sheet.markers import middles as marker_middles
from grader.sheet.models import HALVES_ADVICE, looks_a4
from grader.sheet.plain import register_plain

__all__ = ["marker_middles", "rectify", "register", "straighten"]


_LEAST_IN_PICTURE = 0.95
"""Share of the drawing area below which the picture shows a part of the sheet only."""
_BESIDE_MM = 3.0
"""A place so far beside the picture still counts: the map's own error, and a frame cut close."""


def register(page: Page) -> tuple[Sheet | Unread, Identity | None]:
    """The page's map from millimetres to pixels, or why there is none; and whose page it is by its code.

    A printed sheet's code is looked for in its place; elsewhere a quick look must do.
    """
    printed = markers.register(page)
    identity = (None if printed is None else printed.identity) or identify(page)
    sheet = printed or register_plain(page)
    if isinstance(sheet, Unread):
        hint = f"; the page is as large as A4, and {HALVES_ADVICE}" if looks_a4(page) else ""
        return Unread(sheet.name, f"{sheet.reason}{hint}"), identity
    share = _share_in_picture(page, sheet)
    if share < _LEAST_IN_PICTURE:
        reason = f"only {100.0 * share:.0f} % of the sheet is in the picture; {HALVES_ADVICE}"
        return Unread("sheet", reason), identity
    return sheet, identity


def rectify(page: Page) -> Sheet | Unread:
    """The page's map from millimetres to pixels, or, false in a condition, why there is none."""
    return register(page)[0]


def _share_in_picture(page: Page, sheet: Sheet) -> float:
    """Share of the drawing area that lies in the picture."""
    x, y, wide, high = sheet.drawable_mm
    mm = np.stack(np.meshgrid(np.linspace(x, x + wide, 31), np.linspace(y, y + high, 21)), axis=-1)
    at = mapped(sheet.mm_to_px, mm)
    beside = _BESIDE_MM * sheet.px_per_mm
    return float(np.mean(np.all((at > -beside) & (at < page.grey.shape[::-1] + np.array(beside)), axis=-1)))
