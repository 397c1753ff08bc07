"""One line of writing as a lattice: every way in which its pieces of ink may be parted into signs."""

from dataclasses import dataclass
from itertools import pairwise

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.letters.features import normalised
from grader.letters.model import recognise
from grader.records import FloatArray, GreyImage

_LEAST_PEAK = 40
"""Of 255: a line whose darkest ink is fainter is empty."""
_INK = 0.3
"""Of the darkest: pencil's grain leaves gaps at half."""
_SOFT_MM = 0.06
"""Less than a pencil's stroke: its grain fades."""
_DUST_MM = 0.22
"""Smaller pieces are dust."""
_WIDE = 0.95
"""Wider than so many heights of the line: probably two signs that touch."""
_MOST_PIECES = 60
"""No scale is written with so many signs."""
_SHARED = 0.7
"""Of the smaller one's extent: two pieces of one sign share so much of it."""
_BROKEN_PX = 2
"""Gap of a stroke that the pencil's grain broke."""
_MERGED = 3
"""A sign is of at most so many pieces of ink."""


_Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True)
class Segment:
    """A candidate sign: the pieces from `first` up to, not including, `last`.

    Attributes
    ----------
    log : (signs,) log probabilities
    box : left, top, width, height, px
    """

    first: int
    last: int
    log: FloatArray
    box: _Box


@dataclass(frozen=True, slots=True)
class Lattice:
    """Pieces in the order of writing, and the signs that neighbours may make up."""

    count: int
    segments: tuple[Segment, ...]

    def starting(self, piece: int) -> list[Segment]:
        """The candidates whose first piece this is."""
        return [segment for segment in self.segments if segment.first == piece]


def lattice_of(grey: GreyImage, px_per_mm: float) -> Lattice:
    """The lattice of a line of writing.

    Arguments: `grey` (h, w) uint8 contrast of the line alone, 255 = ink, upright.
    """
    pieces = _pieces(grey, px_per_mm)
    boxes, crops, spans = [], [], []
    for first in range(len(pieces)):
        for last in range(first + 1, min(first + _MERGED, len(pieces)) + 1):
            box = _around(pieces[first:last])
            if last > first + 1 and not _may_be_one(pieces[first:last]):
                continue
            boxes.append(box)
            crops.append(normalised(_cut(grey, pieces[first:last], box)))
            spans.append((first, last))
    sizes = np.array([box[2:] for box in boxes], dtype=np.float64).reshape(-1, 2)
    log = np.log(np.maximum(recognise(crops, sizes), 1e-6))
    segments = tuple(
        Segment(first, last, row, box) for (first, last), row, box in zip(spans, log, boxes, strict=True)
    )
    return Lattice(len(pieces), segments)


@dataclass(frozen=True, slots=True)
class _Piece:
    """Connected ink, or a part of it: its box and its own pixels there, grown by one pixel within it."""

    box: _Box
    own: NDArray[np.uint8]

    @property
    def middle(self) -> float:
        return self.box[0] + self.box[2] / 2.0


def _pieces(grey: GreyImage, unit: float) -> list[_Piece]:
    """Pieces of ink from left to right, wide ones cut where they are thinnest."""
    if grey.size == 0:
        return []
    soft = cv2.GaussianBlur(grey, (0, 0), _SOFT_MM * unit)
    peak = float(np.quantile(soft, 0.997))
    if peak < _LEAST_PEAK:
        return []
    mask = (soft > _INK * peak).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    kept = [row for row in range(1, len(stats)) if stats[row, 2:4].max() > _DUST_MM * unit]
    if not kept or len(kept) > _MOST_PIECES:
        return []
    line = float(np.quantile(stats[kept, 3], 0.8))
    found: list[_Piece] = []
    for row in kept:
        x, y, w, h = (int(side) for side in stats[row, :4])
        own = (labels[y : y + h, x : x + w] == row).astype(np.uint8)
        found.extend(_parted(_Piece((x, y, w, h), own), line))
    return sorted(found, key=lambda piece: piece.middle)


def _parted(piece: _Piece, line: float) -> list[_Piece]:
    """A piece cut at the thin places where two signs may touch; they are candidates together as well."""
    x, y, w, h = piece.box
    if w <= _WIDE * line or h < 0.35 * line:
        return [piece]
    ink = piece.own.sum(axis=0).astype(np.float64)
    parts = min(3, max(2, round(w / (0.65 * line))))
    cuts = [0]
    for number in range(1, parts):
        low, high = round((number - 0.35) * w / parts), round((number + 0.35) * w / parts)
        cuts.append(low + int(ink[low : high + 1].argmin()))
    edges = [*cuts, w]
    found = []
    for left, right in pairwise(edges):
        own = piece.own[:, left:right]
        rows = np.flatnonzero(own.any(axis=1))
        if right - left < 2 or len(rows) == 0:
            continue
        top, bottom = int(rows[0]), int(rows[-1]) + 1
        found.append(_Piece((x + left, y + top, right - left, bottom - top), own[top:bottom]))
    return found


def _around(pieces: list[_Piece]) -> _Box:
    left = min(piece.box[0] for piece in pieces)
    top = min(piece.box[1] for piece in pieces)
    right = max(piece.box[0] + piece.box[2] for piece in pieces)
    bottom = max(piece.box[1] + piece.box[3] for piece in pieces)
    return left, top, right - left, bottom - top


def _may_be_one(pieces: list[_Piece]) -> bool:
    """Whether pieces stand over one another, or side by side without a gap, as those of one sign do."""
    return all(_over(one.box, other.box) or _beside(one.box, other.box) for one, other in pairwise(pieces))


def _over(one: _Box, other: _Box) -> bool:
    shared = min(one[0] + one[2], other[0] + other[2]) - max(one[0], other[0])
    small, tall = sorted((one, other), key=lambda box: box[3])
    # A small piece at the foot of a tall one is a point or a comma of its own.
    at_foot = small[3] < 0.5 * tall[3] and small[1] + small[3] / 2.0 > tall[1] + 0.75 * tall[3]
    return shared >= _SHARED * min(one[2], other[2]) and not at_foot


def _beside(one: _Box, other: _Box) -> bool:
    shared = min(one[1] + one[3], other[1] + other[3]) - max(one[1], other[1])
    gap = max(one[0], other[0]) - min(one[0] + one[2], other[0] + other[2])
    return shared >= _SHARED * min(one[3], other[3]) and gap <= _BROKEN_PX


def _cut(grey: GreyImage, pieces: list[_Piece], box: _Box) -> GreyImage:
    left, top, wide, high = box
    own = np.zeros((high + 2, wide + 2), dtype=np.uint8)
    for piece in pieces:
        x, y, w, h = piece.box
        part = own[y - top + 1 : y - top + 1 + h, x - left + 1 : x - left + 1 + w]
        np.maximum(part, piece.own, out=part)
    grown = cv2.dilate(own, np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    return np.asarray(grey[top : top + high, left : left + wide] * grown, dtype=np.uint8)
