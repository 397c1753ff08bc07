"""Strokes as straight lines in complex millimetres (y up), ready to be compared with vectors.

Pieces that lie on one line with a gap between them are offered joined as well as apart: whether they
are one vector or two in a row is decided when strokes are assigned to a figure.
"""

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from grader.records import HEAD_AHEAD, HEAD_BACK, TAIL_AHEAD, TAIL_BACK, FloatArray, Ink, IntArray, Tips
from reference.geometry import ComplexArray

LEAST_MM = 1.2
"""Shorter strokes are left out: dots, serifs, sides of arrowheads."""
SE_OFFSET_MM = 0.04
"""Least standard error of a line: paper and pen are not ideal."""
CLEAR_END_MM, HIDDEN_END_MM = 0.2, 1.0
"""Standard error of a stroke's end, clear or hidden in other ink. The error stated by the ink stage mostly
concerns strokes that extend past nodes, which is modelled separately."""
HIDDEN = 1.8
"""Ends stated to be this many times worse than the sheet's good ones are hidden."""
JOINABLE_MM = 4.0
"""Shorter pieces have no direction that is good enough to extend them."""
JOIN_OFFSET_MM = 0.45
"""Largest distance of a piece's ends from the line that it continues: a pencil line's width."""
JOIN_GAP_MM = 14.0
"""The widest gap: a label or another figure's strokes over the line."""
JOIN_TURN_RAD = 0.03
"""Largest difference in direction of two pieces of one line."""
JOIN_BEYOND_MM = 1.0
"""A piece that adds less to another's length lies on it."""
PART = 256
"""Strokes compared with all others at a time, so that memory does not grow with their square."""
OTHER_SORT = 0.5
"""Weight of a head's tip for a tail, and the reverse: a drawing without arrowheads shows where vectors end,
but not which end it is."""
TIP_MM = 0.2
"""Standard error of an arrowhead's tip, or of another mark of a node, along its vector."""

BoolArray = NDArray[np.bool_]


@dataclass(frozen=True, slots=True)
class Lines:
    """Strokes (and joined strokes), a row each; complex millimetres, y up.

    Attributes
    ----------
    start, end : the two ends
    along : unit vector from start to end
    length : mm
    se_offset, se_angle : standard errors across (mm) and of direction (rad)
    se_end : (n, 2) standard errors along, of start and end (mm)
    members : (n, 2) the strokes it is made of, by their number: two different ones if it is joined
    tip_along, tip_kind, tip_sure : (n, t) ends of vectors visible along it, as in `records.Tips`, measured
        from `start`; a probability of 0 fills the row
    """

    start: ComplexArray
    end: ComplexArray
    along: ComplexArray
    length: FloatArray
    se_offset: FloatArray
    se_angle: FloatArray
    se_end: FloatArray
    members: IntArray
    tip_along: FloatArray
    tip_kind: IntArray
    tip_sure: FloatArray

    def __len__(self) -> int:
        return len(self.length)

    @property
    def middle(self) -> ComplexArray:
        """Midpoints."""
        return np.asarray((self.start + self.end) / 2.0)

    def tips_towards(
        self, rows: IntArray, forward: BoolArray, *, head: bool | None = None
    ) -> tuple[FloatArray, FloatArray]:
        """Return tips that may mark one end of a vector on each of some lines.

        Arguments
        ---------
        rows, forward : lines (r,), and whether the vector's end in question is its farther one along it
        head : whether that end is the vector's head: tips of the other sort then count for `OTHER_SORT`.
            Without it both sorts count alike, as if the strokes are given and only the position is asked

        Returns the distances from `start` (r, t), mm, and the probabilities (r, t).
        """
        kind = self.tip_kind[rows]
        ahead = forward[:, None]
        heads = np.where(ahead, HEAD_AHEAD, HEAD_BACK), 1.0 if head is not False else OTHER_SORT
        tails = np.where(ahead, TAIL_BACK, TAIL_AHEAD), 1.0 if head is not True else OTHER_SORT
        share = sum(weight * (kind == sort) for sort, weight in (heads, tails))
        return self.tip_along[rows], self.tip_sure[rows] * share

    def take(self, chosen: BoolArray | IntArray) -> "Lines":
        """Return some of the rows; `members` keep their numbers."""
        return Lines(*(getattr(self, name)[chosen] for name in self.__slots__))


def lines_of(ink: Ink) -> Lines:
    """Return the strokes of a sheet as lines, with joined ones added."""
    strokes = ink.strokes
    inked = strokes.ends[..., 0] - 1j * strokes.ends[..., 1]
    span = (inked[:, 1] - inked[:, 0]).ravel()
    full = np.maximum(np.abs(span), 1e-9)
    # Ink goes on half a pen's width beyond where the pen stopped.
    cap = np.minimum(0.5 * strokes.width, 0.25 * full)
    start, end = inked[:, 0] + cap * span / full, inked[:, 1] - cap * span / full
    number = np.flatnonzero(np.abs(end - start) >= LEAST_MM)
    length = np.abs(end - start)[number]
    tip_along, tip_kind, tip_sure = _tips(ink.tips, number, cap)
    single = Lines(
        start=start[number],
        end=end[number],
        along=(end - start)[number] / length,
        length=length,
        se_offset=np.maximum(strokes.se_offset[number], SE_OFFSET_MM),
        se_angle=np.maximum(strokes.se_angle[number], SE_OFFSET_MM / length),
        se_end=_end_errors(strokes.se_end)[number],
        members=np.repeat(number[:, None], 2, axis=1),
        tip_along=tip_along,
        tip_kind=tip_kind,
        tip_sure=tip_sure,
    )
    return _with_joined(single)


def _tips(tips: Tips, number: IntArray, cap: FloatArray) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return `tip_along`, `tip_kind` and `tip_sure` of some strokes, measured from their uncapped ends."""
    of_stroke = [np.flatnonzero(tips.stroke == stroke) for stroke in number]
    shape = (len(number), max((len(chosen) for chosen in of_stroke), default=0))
    along, kind, sure = np.zeros(shape), np.zeros(shape, np.int64), np.zeros(shape)
    for row, chosen in enumerate(of_stroke):
        part = slice(0, len(chosen))
        along[row, part] = tips.along[chosen] - cap[number[row]]
        kind[row, part], sure[row, part] = tips.kind[chosen], tips.sure[chosen]
    return along, kind, sure


def _end_errors(stated: FloatArray) -> FloatArray:
    """Return standard errors of ends, mm, according to which are stated to be much worse than others."""
    good = float(np.quantile(stated, 0.1)) if stated.size else 0.0
    return np.where(stated > HIDDEN * good, HIDDEN_END_MM, CLEAR_END_MM)


# Strokes in pieces --------------------------------------------------------------------------------


def _with_joined(single: Lines) -> Lines:
    """Add the strokes that two pieces on one line make."""
    pieces = _pairs_in_line(single)
    if not len(pieces):
        return single
    joined = _joined(single, pieces)
    return Lines(*(_stacked(getattr(single, name), getattr(joined, name)) for name in Lines.__slots__))


def _stacked(first: NDArray[Any], second: NDArray[Any]) -> NDArray[Any]:
    """Stack the rows of both; narrower ones are filled with zeros."""
    if first.ndim == 1:
        return np.concatenate([first, second])
    wide = max(first.shape[1], second.shape[1])
    return np.concatenate([np.pad(rows, ((0, 0), (0, wide - rows.shape[1]))) for rows in (first, second)])


def _joined(single: Lines, pieces: IntArray) -> Lines:
    """Return for each two pieces (p, 2) one stroke from the one far end to the other."""
    rows = np.arange(len(pieces))
    along = single.along[pieces[:, 0]]
    ends = np.concatenate([single.start[pieces], single.end[pieces]], axis=1)
    errors = np.concatenate([single.se_end[pieces, 0], single.se_end[pieces, 1]], axis=1)
    place = (ends * np.conj(along)[:, None]).real
    low, high = place.argmin(axis=1), place.argmax(axis=1)
    start, end = ends[rows, low], ends[rows, high]
    length = np.abs(end - start)
    offset = single.se_offset[pieces].max(axis=1)
    tip_along, tip_kind, tip_sure = _joined_tips(single, pieces, start, along)
    return Lines(
        start=start,
        end=end,
        along=(end - start) / length,
        length=length,
        se_offset=offset,
        se_angle=(SE_OFFSET_MM + offset) / length,
        se_end=np.column_stack([errors[rows, low], errors[rows, high]]),
        members=single.members[pieces, 0],
        tip_along=tip_along,
        tip_kind=tip_kind,
        tip_sure=tip_sure,
    )


def _joined_tips(
    single: Lines, pieces: IntArray, start: ComplexArray, along: ComplexArray
) -> tuple[FloatArray, IntArray, FloatArray]:
    """Return `tip_along`, `tip_kind` and `tip_sure` of joined strokes: the tips of both their pieces."""
    at = single.start[pieces, None] + single.tip_along[pieces] * single.along[pieces, None]
    places = ((at - start[:, None, None]) * np.conj(along)[:, None, None]).real
    same_way = (single.along[pieces] * np.conj(along)[:, None]).real > 0
    kinds = np.where(same_way[:, :, None], single.tip_kind[pieces], single.tip_kind[pieces] ^ 1)
    sure = single.tip_sure[pieces].reshape(len(pieces), -1)
    # Rows no wider than the fullest one.
    most = int(np.count_nonzero(sure, axis=1).max(initial=0))
    known = np.argsort(sure <= 0.0, axis=1, kind="stable")[:, :most]
    rows = np.arange(len(pieces))[:, None]
    return places.reshape(sure.shape)[rows, known], kinds.reshape(sure.shape)[rows, known], sure[rows, known]


def _pairs_in_line(single: Lines) -> IntArray:
    """Return (p, 2) strokes that continue one another, the longer one, which determines the line, first."""
    long = np.flatnonzero(single.length >= JOINABLE_MM)
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for start in range(0, len(long), PART):
        some = long[start : start + PART]
        first, second = np.nonzero(_continues(single, some, long))
        pairs.append(np.column_stack([start + first, second]))
    first, second = np.concatenate(pairs).T
    length = single.length[long]
    # Two strokes of equal length continue each other: the pair is used once.
    once = (length[first] != length[second]) | (first < second)
    once &= first != second
    return np.column_stack([long[first[once]], long[second[once]]])


def _continues(single: Lines, rows: IntArray, others: IntArray) -> BoolArray:
    """Return (r, n) whether each of the `others` lies on the line of each of the `rows` and continues it."""
    start, along, length = single.start[rows, None], single.along[rows, None], single.length[rows, None]
    turn = np.abs((along * np.conj(single.along[others])).imag)
    near = turn < JOIN_TURN_RAD + np.minimum(JOIN_OFFSET_MM / single.length[others], 0.05)
    relative_start = (single.start[others] - start) * np.conj(along)
    relative_end = (single.end[others] - start) * np.conj(along)
    residual = np.maximum(np.abs(relative_start.imag), np.abs(relative_end.imag))
    low = np.minimum(relative_start.real, relative_end.real)
    high = np.maximum(relative_start.real, relative_end.real)
    gap = np.maximum(low - length, -high)
    # The longer stroke's line decides, the shorter must lie on it.
    shorter = single.length[others] <= length
    beyond = np.maximum(high - length, -low) > JOIN_BEYOND_MM
    return np.asarray(near & shorter & (residual < JOIN_OFFSET_MM) & (gap < JOIN_GAP_MM) & beyond)
