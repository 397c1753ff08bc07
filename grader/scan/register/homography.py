"""Homographies between the sheet's millimetres and pixels, and the evidence that they are fitted to."""

from dataclasses import dataclass

import numpy as np

from grader.printed.layout import FRAME_MM, PAGE_MM
from grader.records import Box, FloatArray, Page
from grader.scan.pixels import TITLE_BLOCK_MM, inverted, local_axes, mapped
from grader.scan.register.lines import RIDGE, LongLine
from reference.drawing.canvas import MM_PER_INCH
from reference.geometry import degrees

_MARGIN_MM = 10.0
"""Around a drawing without a frame: the least that ISO 5457 leaves."""
_INSET_MM = 7.0
"""The frame's own bottom line, and the paper's edge, are no part of the block."""
_SQUARE_MM = 2.5
"""A ruled line may be askew by this much from end to end."""
_LEAST_MM = 12.0
"""Shorter lines are letters or a drawing's."""
_LEAST_LEVEL = 2
"""A block has at least its top line and one row."""
_OTHERS = 0.8
"""Share of another corner's ruled lines that is taken off: squared paper has as many in each."""
_A4_MM = (297.0, 210.0)
"""ISO 216."""
_A4_WITHIN_MM = 6.0
"""A scanner's window is as much larger or smaller than the paper."""
_SCANNERS_DPI = (100.0, 150.0, 200.0, 240.0, 300.0, 400.0, 600.0)
"""Resolutions that scanners for A4 offer."""
UNSET_DPI = 100.0
"""Below this a stated resolution is what programs write that do not know."""


@dataclass(frozen=True, slots=True)
class Outline:
    """A rectangle on the upright sheet.

    Attributes
    ----------
    name : `paper`, `iso` or `gost`
    box : left, top, right, bottom, mm
    side_se_mm : how far one end of a side may be off (a hand and a ruler; a guillotine)
    """

    name: str
    box: tuple[float, float, float, float]
    side_se_mm: float

    def corners(self) -> FloatArray:
        """(4, 2) from the top left, clockwise on the sheet."""
        x0, y0, x1, y1 = self.box
        return np.array([[x0, y0], [x1, y0], [x1, y1], [x0, y1]])


PAPER = Outline("paper", (0.0, 0.0, *PAGE_MM), 0.35)
ISO = Outline("iso", (*FRAME_MM[:2], FRAME_MM[0] + FRAME_MM[2], FRAME_MM[1] + FRAME_MM[3]), 0.3)
GOST = Outline("gost", (20.0, 5.0, 415.0, 292.0), 0.3)
FRAMES = (ISO, GOST)


def drawable(model: Outline | None) -> Box:
    """The box inside a frame, or, without one, inside the least margin."""
    x0, y0, x1, y1 = (_MARGIN_MM, _MARGIN_MM, *ISO.box[2:]) if model is None else model.box
    return (x0, y0, x1 - x0, y1 - y0)


# Which way up -------------------------------------------------------------------------------------


def drawn_ends(lines: list[LongLine]) -> FloatArray:
    """(n, 2, 2) ends in pixels of the drawn lines among long lines."""
    return np.array([line.ends for line in lines if line.kind == RIDGE]).reshape(-1, 2, 2)


def title_block_mm(mm_to_px: FloatArray, drawn: FloatArray) -> float:
    """Length of ruled lines, mm, in the bottom right corner, where an upright sheet has its title block.

    What the other corners have too (squared paper has it everywhere) does not count.
    """
    mm, page = mapped(inverted(mm_to_px), drawn), np.array(PAGE_MM)
    others = [np.where(flip, page - mm, mm) for flip in ((True, True), (True, False), (False, True))]
    return max(0.0, _ruled_mm(mm) - _OTHERS * max(_ruled_mm(other) for other in others))


def _ruled_mm(ends: FloatArray) -> float:
    """Length of level and upright lines in the bottom right corner, 0 for fewer than two level ones."""
    if len(ends) == 0:
        return 0.0
    span = np.abs(ends[:, 1] - ends[:, 0])
    low, high = ends.min(axis=1), ends.max(axis=1)
    level = span[:, 0] > span[:, 1]
    near = (low[:, 0] > PAGE_MM[0] - TITLE_BLOCK_MM[0]) & (low[:, 1] > PAGE_MM[1] - TITLE_BLOCK_MM[1])
    inner = (high[:, 0] < PAGE_MM[0]) & (high[:, 1] < PAGE_MM[1] - np.where(level, _INSET_MM, 0.0))
    ruled = near & inner & (span.min(axis=1) < _SQUARE_MM) & (span.max(axis=1) > _LEAST_MM)
    if np.count_nonzero(ruled & level) < _LEAST_LEVEL:
        return 0.0
    return float(span[ruled].max(axis=1).sum())


def rotation_deg(mm_to_px: FloatArray) -> float:
    """The counter-clockwise turn that makes the stored image upright, 0 to 360 degrees.

    Seen with y down, the sheet's x axis points at this angle; turning back by it is counter-clockwise.
    """
    (right,), _ = local_axes(mm_to_px, np.array([PAGE_MM]) / 2.0, 10.0)
    return degrees(np.arctan2(right[1], right[0]))


def off_turn_deg(mm_to_px: FloatArray, turn_deg: int) -> float:
    """Return the angle, 0 to 180 degrees, between a map's upright and the turn that the file asks for.

    The file's turn (EXIF, PDF) is evidence if nothing drawn tells a half turn from none: people turn what
    they see upside down.
    """
    return abs((rotation_deg(mm_to_px) - turn_deg + 180.0) % 360.0 - 180.0)


# The paper's size ---------------------------------------------------------------------------------


def size_mm(page: Page, dpi: tuple[float, float]) -> tuple[float, float]:
    """Long and short side of a page at a resolution."""
    high, wide = page.grey.shape
    long, short = sorted((wide / dpi[0] * MM_PER_INCH, high / dpi[1] * MM_PER_INCH), reverse=True)
    return long, short


def looks_a4(page: Page) -> bool:
    """Return whether the picture is as large as A4, as far as scanners' windows are."""
    return is_as_large(page, _A4_MM, _A4_WITHIN_MM)


def is_as_large(page: Page, paper_mm: tuple[float, float], within_mm: float) -> bool:
    """Return whether a picture is as large as paper, by its resolution or else by one that scanners have."""
    stated = page.dpi is not None and min(page.dpi) >= UNSET_DPI
    tried = [page.dpi] if stated and page.dpi is not None else [(dpi, dpi) for dpi in _SCANNERS_DPI]
    return any(np.all(np.abs(np.subtract(size_mm(page, dpi), paper_mm)) < within_mm) for dpi in tried)
