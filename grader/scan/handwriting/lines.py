"""Find lines of writing on plain paper: pieces of ink in a row that belong to no drawn line."""

from collections.abc import Callable
from dataclasses import dataclass

import cv2
import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import Box, FloatArray, GreyImage, InkMap
from grader.scan.handwriting.fields import PX_PER_MM
from grader.scan.handwriting.model import Lattice, lattice_of
from grader.scan.pixels import BoolArray

_COARSE = 2
"""Reduction of the map for finding lines: letters of one word may touch there."""
_FAINT = 30
"""Contrast of 255: fainter ink is paper, or show-through."""
_SHARE = 0.4
"""Share of the darkest ink in a letter's surroundings: anything fainter is its blur."""
_PEAK_MM = 3.0
"""Surroundings of a letter: its neighbours are as dark."""
_ACROSS_MM, _UPRIGHT_MM = 16.0, 8.0
"""Longer runs of ink along a row and along a column of pixels are ruled lines: letters of a broad pen touch
along the first, none is as high as the second."""
_LEAST_MM, _HIGHEST_MM, _LONGEST_MM = 1.0, 9.0, 25.0
"""Least and largest height of letters, and the longest word whose letters touch."""
_LEVEL = 0.45
"""Neighbours in a line share this much of the lower one's height."""
_LIKE = 3.0
"""Neighbours in a line differ in height by this factor at most: indices are two thirds."""
_GAP = 2.6
"""Gaps wider than this many heights of the higher neighbour separate two lines of writing."""
_AROUND = 0.45
"""Margin above and below a line, as a share of its height: raised powers and lowered indices."""
_LEAST_SIGNS = 3
"""Shorter lines are letters of nodes and vectors; `n=7` has three signs."""
_MOST_PIECES, _MOST_LINES = 1500, 80
"""Limits that no drawing reaches: squared paper and hatching do."""
_THIN = 0.25
"""Share of a line's height: wider pieces are no remains of a ruled line."""
_WORD, _TEXT = 0.32, 1.3
"""Shares of a line's height: wider gaps separate words, and texts."""


@dataclass(frozen=True, slots=True)
class Line:
    """A line of writing.

    Attributes
    ----------
    box : its position, sheet mm
    signs : its possible signs, in the order of writing
    gaps : (signs.count + 1,) free room before each piece, in line heights; infinite at both ends
    thin : (signs.count + 1,) whether a thin piece stands before, perhaps the rest of a ruled line
    """

    box: Box
    signs: Lattice
    gaps: FloatArray
    thin: BoolArray

    @property
    def firsts(self) -> BoolArray:
        """(signs.count + 1,) whether a text may begin before this piece."""
        behind = np.concatenate([[False], self.parts[:-1]])
        return self.parts | (behind & self.thin)

    @property
    def begins(self) -> BoolArray:
        """(signs.count + 1,) whether a word may begin, or end, before this piece."""
        return (self.gaps > _WORD) | self.firsts

    @property
    def parts(self) -> BoolArray:
        """(signs.count + 1,) whether a text of several words may begin, or end, before this piece."""
        return self.gaps > _TEXT


Look = Callable[[Box], GreyImage]
"""Returns the contrast inside a box of the sheet, 255 = ink, 12 px/mm."""


def find_lines(where: InkMap, look: Look | None = None) -> list[Line]:
    """Return the lines of writing on a page, in no order.

    Arguments: `look` shows signs on the page; without it they are read from the map, where narrow ones touch.
    """
    unit = where.px_per_mm / _COARSE
    labels, pieces = _pieces(where)
    lines = []
    for row in _rows(pieces, unit):
        left, top, right, bottom = row.box
        box = left / unit, top / unit, (right - left) / unit, (bottom - top) / unit
        grey = look(box) if look is not None else _enlarged(where, row.box)
        if grey.size:
            own = np.isin(labels[top:bottom, left:right], row.labels).astype(np.uint8)
            own = np.asarray(cv2.dilate(own, np.ones((3, 3), np.uint8)), dtype=np.uint8)
            mask = cv2.resize(own, grey.shape[::-1], interpolation=cv2.INTER_NEAREST)
            lattice = lattice_of(np.asarray(cv2.multiply(grey, mask), dtype=np.uint8), PX_PER_MM)
            if lattice.count >= _LEAST_SIGNS:
                lines.append(_line(box, lattice, PX_PER_MM * row.high / unit))
    return lines


def _enlarged(where: InkMap, box: tuple[int, int, int, int]) -> GreyImage:
    """Return a part of the map, given by its sides on the coarse one, enlarged to 12 px/mm."""
    left, top, right, bottom = (_COARSE * side for side in box)
    finer = PX_PER_MM / where.px_per_mm
    grey = cv2.resize(
        where.ink[top:bottom, left:right], None, fx=finer, fy=finer, interpolation=cv2.INTER_CUBIC
    )
    return np.asarray(grey, dtype=np.uint8)


def _pieces(where: InkMap) -> tuple[NDArray[np.int32], NDArray[np.int32]]:
    """Return labels of the pieces of ink on a coarse map without ruled lines, and (n, 5) their extents.

    Extents are left, top, right and bottom, px, and the label.
    """
    size = where.ink.shape[1] // _COARSE, where.ink.shape[0] // _COARSE
    grey = cv2.resize(where.ink, size, interpolation=cv2.INTER_AREA)
    unit = where.px_per_mm / _COARSE
    whole = np.asarray(grey >= _FAINT, dtype=np.uint8)
    ruled = np.zeros_like(whole)
    across, upright = round(_ACROSS_MM * unit), round(_UPRIGHT_MM * unit)
    # A pencil's grain breaks ruled lines: they are thickened across, which closes no gap between letters.
    for thick, long in (((3, 1), (1, across)), ((1, 3), (upright, 1))):
        thickened = cv2.dilate(whole, np.ones(thick, np.uint8))
        runs = cv2.morphologyEx(thickened, cv2.MORPH_OPEN, np.ones(long, np.uint8))
        ruled = np.maximum(ruled, np.asarray(runs, dtype=np.uint8))
    grey[cv2.dilate(ruled, np.ones((5, 5), np.uint8)) > 0] = 0
    side = 2 * round(_PEAK_MM * unit / 2.0) + 1
    peak = cv2.dilate(grey, np.ones((side, side), np.uint8))
    ink = np.asarray(grey >= np.maximum(peak * np.float32(_SHARE), np.float32(_FAINT)), dtype=np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(ink, connectivity=8)
    wide, high = stats[:, 2] / unit, stats[:, 3] / unit
    labels_kept = np.flatnonzero((high <= _HIGHEST_MM) & (wide <= _LONGEST_MM))
    labels_kept = labels_kept[labels_kept > 0]
    extents = np.column_stack([stats[labels_kept, :4], labels_kept])
    extents[:, 2:4] += extents[:, :2]
    return np.asarray(labels, dtype=np.int32), np.asarray(extents, dtype=np.int32)


@dataclass(frozen=True, slots=True)
class _Row:
    """Pieces in a row: their labels, and left, top, right and bottom of the larger ones, coarse px."""

    labels: NDArray[np.int32]
    box: tuple[int, int, int, int]
    high: int


def _rows(pieces: NDArray[np.int32], unit: float) -> list[_Row]:
    """Return pieces that stand in a row, each with the points, signs and indices around it."""
    is_letter = pieces[:, 3] - pieces[:, 1] >= _LEAST_MM * unit
    letters, small = pieces[is_letter], pieces[~is_letter]
    if not 0 < len(letters) <= _MOST_PIECES:
        return []
    left, top, right, bottom = letters[:, :4].astype(np.float32).T[:, :, None]
    high = bottom - top
    lower, higher = np.minimum(high, high.T), np.maximum(high, high.T)
    beside = np.maximum(left, left.T) - np.minimum(right, right.T) < _GAP * higher
    level = np.minimum(bottom, bottom.T) - np.maximum(top, top.T) > _LEVEL * lower
    alike = beside & level & (higher < _LIKE * lower)
    count, of_row = scipy.sparse.csgraph.connected_components(alike, directed=False)
    own = [letters[of_row == number] for number in range(count)]
    boxes = [(*some[:, :2].min(axis=0).tolist(), *some[:, 2:4].max(axis=0).tolist()) for some in own]
    several = np.array([len(some) > 1 for some in own])
    is_row = several & np.array([box[2] - box[0] > box[3] - box[1] for box in boxes])
    loose = np.concatenate([small, letters[~is_row[of_row]]])
    middle = (loose[:, :2] + loose[:, 2:4]) / 2.0
    whose, nearest = np.full(len(loose), -1), np.full(len(loose), np.inf)
    for number in np.flatnonzero(is_row):
        x, y, right, bottom = boxes[number]
        high = bottom - y
        off = np.abs(middle[:, 1] - (y + bottom) / 2.0)
        inside = (middle[:, 0] > x - high) & (middle[:, 0] < right + high)
        near = inside & (off < (0.5 + _AROUND) * high) & (loose[:, 3] - loose[:, 1] < high) & (off < nearest)
        whose[near], nearest[near] = number, off[near]
    rows = []
    for number in np.flatnonzero(is_row):
        every = np.concatenate([own[number], loose[whose == number]])
        whole = (*(every[:, :2].min(axis=0) - 1).clip(0).tolist(), *(every[:, 2:4].max(axis=0) + 1).tolist())
        rows.append(_Row(every[:, 4], whole, boxes[number][3] - boxes[number][1]))
    return rows if len(rows) <= _MOST_LINES else []


def _line(box: Box, signs: Lattice, high: float) -> Line:
    """Return a line, with the free room between its pieces, for a height of `high` px."""
    alone = {s.first: s.box for s in signs.segments if s.last == s.first + 1}
    gaps, thin = np.full(signs.count + 1, np.inf), np.zeros(signs.count + 1, dtype=np.bool_)
    reached = -np.inf
    for piece in range(signs.count):
        left, _, wide, _ = alone[piece]
        gaps[piece], thin[piece + 1] = (left - reached) / high, wide < _THIN * high
        reached = max(reached, left + wide)
    return Line(box, signs, gaps, thin)
