"""A3 drawings scanned in two halves on an A4 scanner: refused, with what to do instead."""

import numpy as np

from grader.records import Page, Sheet, Unread

_A4_MM = (297.0, 210.0)
_A4_WITHIN_MM = 6.0
_SCANNERS_DPI = (100.0, 150.0, 200.0, 240.0, 300.0, 400.0, 600.0)
_MM_PER_INCH = 25.4
_UNSET_DPI = 100.0
"""Below this a stated resolution is what programs write that do not know."""
_LEAST_SEEN = 0.95
_BESIDE_MM = 3.0
_ADVICE = (
    "an A3 drawing scanned in two halves on A4 cannot be put together:"
    " scan it on an A3 scanner or photograph it whole"
)


def looks_a4(page: Page) -> bool:
    """Whether the picture is as large as A4, by its resolution or, without one, by a scanner's usual."""
    high, wide = page.grey.shape
    if page.dpi is not None and min(page.dpi) >= _UNSET_DPI:
        return _is_a4(wide / page.dpi[0], high / page.dpi[1])
    return any(_is_a4(wide / dpi, high / dpi) for dpi in _SCANNERS_DPI)


def _is_a4(wide_in: float, high_in: float) -> bool:
    size = sorted((wide_in * _MM_PER_INCH, high_in * _MM_PER_INCH), reverse=True)
    return all(abs(found - wanted) < _A4_WITHIN_MM for found, wanted in zip(size, _A4_MM, strict=True))


def half_hint(page: Page) -> str:
    """What to add to a refusal of a page that may be half a drawing."""
    return f"; the page is as large as A4, and {_ADVICE}" if looks_a4(page) else ""


def whole(page: Page, sheet: Sheet) -> Sheet | Unread:
    """The sheet, or why not where a part of its drawing area lies outside the picture."""
    x, y, wide, high = sheet.drawable_mm
    share_x, share_y = np.meshgrid(np.linspace(0.0, 1.0, 31), np.linspace(0.0, 1.0, 21))
    mm = np.stack([x + share_x.ravel() * wide, y + share_y.ravel() * high, np.ones(share_x.size)])
    mapped = sheet.mm_to_px @ mm
    at = mapped[:2] / mapped[2]
    beside = _BESIDE_MM * sheet.px_per_mm
    size = np.array([[page.grey.shape[1]], [page.grey.shape[0]]])
    seen = float(np.mean(np.all((at > -beside) & (at < size + beside), axis=0)))
    if seen >= _LEAST_SEEN:
        return sheet
    return Unread("sheet", f"only {100.0 * seen:.0f} % of the sheet is in the picture; {_ADVICE}")
