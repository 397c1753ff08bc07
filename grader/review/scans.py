"""Pages of a class as pictures, cut out on demand; recently viewed pages stay decoded."""

import threading
from collections import OrderedDict
from collections.abc import Sequence

from grader.overlay.picture import cut
from grader.records import Box, Page, PageRef, ScannedPage, Sheet
from grader.scan.decode.pages import decode
from grader.scan.register.distortion import straighten
from grader.texts.spoken import RefusedError

KEPT = 6
"""Pages: an A3 sheet at 300 dpi takes 17 MB."""


class Scans:
    """Decoded pages; safe for several threads."""

    def __init__(self) -> None:
        self._pages: OrderedDict[tuple[str, int, str, float], tuple[Page, Sheet | None]] = OrderedDict()
        self._lock = threading.Lock()

    def part(self, page: ScannedPage, box: Box, px_per_mm: float) -> bytes:
        """Return a part of a registered page as JPEG; `box` in sheet millimetres. Raises InputFileError."""
        pixels, sheet = self._opened(page.ref, page.sheet)
        return cut(pixels, sheet, box, px_per_mm)

    def whole(self, ref: PageRef, longest_px: float) -> bytes:
        """Return a page as it is stored, at most so many pixels long, as JPEG. Raises InputFileError."""
        pixels, _ = self._opened(ref, None)
        height, width = pixels.grey.shape
        scale = min(1.0, longest_px / max(height, width))
        return cut(pixels, None, (-0.5, -0.5, float(width), float(height)), scale)

    def format(self, ref: PageRef) -> tuple[int, int, int]:
        """Return a stored page's width and height in pixels, and the turn that its file asks viewers for.

        The turn is in degrees counter-clockwise. Raises InputFileError.
        """
        pixels, _ = self._opened(ref, None)
        height, width = pixels.grey.shape
        return width, height, pixels.turn_deg

    def _opened(self, ref: PageRef, sheet: Sheet | None) -> tuple[Page, Sheet | None]:
        bend = 0.0 if sheet is None or sheet.lens is None else sheet.lens.bend
        key = (ref.file, ref.page, ref.digest, bend)
        with self._lock:
            if key not in self._pages:
                pixels = decode(ref)
                opened = (pixels, None) if sheet is None or not bend else straighten(pixels, sheet)
                self._pages[key] = opened
                if len(self._pages) > KEPT:
                    self._pages.popitem(last=False)
            self._pages.move_to_end(key)
            pixels, straight = self._pages[key]
        return pixels, straight if bend else sheet


def page_of(pages: Sequence[PageRef], file: str, page: int) -> PageRef:
    """Return the page of a file's name and number. Raises RefusedError."""
    for ref in pages:
        if (ref.file, ref.page) == (file, page):
            return ref
    raise RefusedError(400, "page_missing", "no_page")
