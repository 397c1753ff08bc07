"""Strokes as lines in the complex plane, y up, ready to be compared with vectors.

Pieces that lie on one line with a gap between them are offered joined as well as apart: whether
they are one vector or two in a row is for the figure to say.
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
"""No line of ink is known better: paper and pen are not ideal."""
CLEAR_END_MM, HIDDEN_END_MM = 0.2, 1.0
"""How well an end is seen: clear, or hidden in other ink. That strokes run on past nodes comes on top,
and is what the larger part of an end's stated error is made of."""
HIDDEN = 1.8
"""Ends stated this many times worse than the sheet's good ones are hidden."""
LONG_MM = 12.0
ENOUGH = 6
THIN = 0.62
MOST_PIECES = 5
JOIN_OFF_MM = 0.45
JOIN_GAP_MM = 14.0
JOIN_TURN_RAD = 0.03
PART = 256
"""Strokes compared with all others at a time, so that memory does not grow with their square."""

OTHER_SORT = 0.5
TIP_MM = 0.2
"""Standard error of an arrowhead's tip, or of what else marks a node, along its vector."""

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
    darkness, width : means over the stroke
    thin : much thinner or fainter than the long strokes of its sheet
    members : (n, k) the strokes it is made of, by their number, repeated to fill the row
    tip_along, tip_kind, tip_sure : (n, t) ends of vectors seen along it, as in `records.Tips`, from
        `start`; a probability of 0 fills the row
    """

    start: ComplexArray
    end: ComplexArray
    along: ComplexArray
    length: FloatArray
    se_offset: FloatArray
    se_angle: FloatArray
    se_end: FloatArray
    darkness: FloatArray
    width: FloatArray
    thin: BoolArray
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
        self, rows: IntArray, forward: BoolArray, *, head: bool
    ) -> tuple[FloatArray, FloatArray]:
        """(place along from `start` (r, t), probability (r, t)) of tips of vectors that come from behind.

        Arguments
        ---------
        rows, forward : lines (r,), and whether the vector's end in question is its farther one along it
        head : whether that end is the vector's head. A drawing without arrowheads tells ends, but not
            which: a tip of the other sort counts for less
        """
        kind = self.tip_kind[rows]
        ahead = forward[:, None]
        same = np.where(ahead, HEAD_AHEAD, HEAD_BACK) if head else np.where(ahead, TAIL_BACK, TAIL_AHEAD)
        other = np.where(ahead, TAIL_BACK, TAIL_AHEAD) if head else np.where(ahead, HEAD_AHEAD, HEAD_BACK)
        share = np.where(kind == same, 1.0, np.where(kind == other, OTHER_SORT, 0.0))
        return self.tip_along[rows], self.tip_sure[rows] * share

    def nearer_end(self, row: int, to: complex) -> tuple[complex, float]:
        """The end of one line that is nearer to a point, and its standard error along the line."""
        ends = (complex(self.start[row]), complex(self.end[row]))
        side = int(abs(ends[1] - to) < abs(ends[0] - to))
        return ends[side], float(self.se_end[row, side])

    def take(self, chosen: BoolArray | IntArray) -> "Lines":
        """Some of the rows; `members` keep their numbers."""
        return Lines(*(getattr(self, name)[chosen] for name in self.__slots__))


def lines_of(ink: Ink) -> Lines:
    """The strokes of a sheet as lines, with joined ones added."""
    strokes = ink.strokes
    ends = strokes.ends[..., 0] - 1j * strokes.ends[..., 1]
    ends = _without_caps(ends.reshape(-1, 2), strokes.width)
    kept = np.abs(ends[:, 1] - ends[:, 0]) >= LEAST_MM
    number = np.flatnonzero(kept)
    length = np.abs(ends[kept, 1] - ends[kept, 0])
    single = Lines(
        start=ends[kept, 0],
        end=ends[kept, 1],
        along=(ends[kept, 1] - ends[kept, 0]) / length,
        length=length,
        se_offset=np.maximum(strokes.se_offset[kept], SE_OFFSET_MM),
        se_angle=np.maximum(strokes.se_angle[kept], SE_OFFSET_MM / length),
        se_end=_seen(strokes.se_end)[kept],
        darkness=strokes.darkness[kept],
        width=strokes.width[kept],
        thin=_thin(strokes.width[kept] * strokes.darkness[kept], length),
        members=np.repeat(number[:, None], MOST_PIECES, axis=1),
        **_tips(ink.tips, number, strokes.ends, ends),
    )
    return _with_joined(single)


def _tips(tips: Tips, number: IntArray, as_found: FloatArray, ends: ComplexArray) -> dict[str, Any]:
    """The tips of each stroke kept, side by side; measured from its end without the cap."""
    full = np.hypot(*(as_found[:, 1] - as_found[:, 0]).T)
    cap = (full - np.abs(ends[:, 1] - ends[:, 0])) / 2.0
    found = [np.flatnonzero(tips.stroke == one) for one in number]
    most = max((len(one) for one in found), default=0)
    shape = (len(number), most)
    along, kind, sure = np.zeros(shape), np.zeros(shape, np.int64), np.zeros(shape)
    for row, chosen in enumerate(found):
        part = slice(0, len(chosen))
        along[row, part] = tips.along[chosen] - cap[number[row]]
        kind[row, part], sure[row, part] = tips.kind[chosen], tips.sure[chosen]
    return {"tip_along": along, "tip_kind": kind, "tip_sure": sure}


def _seen(stated: FloatArray) -> FloatArray:
    """How well ends are seen, from which of them are stated to be much worse than others."""
    good = float(np.quantile(stated, 0.1)) if stated.size else 0.0
    return np.where(stated > HIDDEN * good, HIDDEN_END_MM, CLEAR_END_MM)


def _thin(ink: FloatArray, length: FloatArray) -> BoolArray:
    """Strokes with much less ink per length than the heavier long ones have."""
    long = length > LONG_MM
    if np.count_nonzero(long) < ENOUGH:
        return np.zeros(len(ink), dtype=bool)
    return np.asarray(ink < THIN * np.quantile(ink[long], 0.7))


def _without_caps(ends: ComplexArray, width: FloatArray) -> ComplexArray:
    """Ends half a pen's width shorter: ink goes on that far beyond where the pen stopped."""
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.abs(span), 1e-9)
    cap = np.minimum(0.5 * width, 0.25 * length) * span / length
    return np.column_stack([ends[:, 0] + cap, ends[:, 1] - cap])


def _with_joined(single: Lines) -> Lines:
    """Add the strokes that pieces on one line make: every two, and every longest chain of more."""
    first, second = _in_line(single)
    chains = [[int(one), int(other)] for one, other in zip(first, second, strict=True)]
    chains.extend(_longest_chains(chains))
    if not chains:
        return single
    joined = [_joined(single, chain) for chain in chains]
    wide = max(single.tip_along.shape[1], *(len(one["tip_along"]) for one in joined))
    return Lines(
        *(
            np.concatenate(
                [_padded(getattr(single, name), wide), [_filled(one[name], wide) for one in joined]]
            )
            if name.startswith("tip_")
            else np.concatenate([getattr(single, name), np.array([one[name] for one in joined])])
            for name in Lines.__slots__
        )
    )


def _padded(rows: NDArray[Any], wide: int) -> NDArray[Any]:
    return np.pad(rows, ((0, 0), (0, wide - rows.shape[1])))


def _filled(row: NDArray[Any], wide: int) -> NDArray[Any]:
    return np.pad(row, (0, wide - len(row)))


def _longest_chains(pairs: list[list[int]]) -> list[list[int]]:
    """Pieces that are linked by pairs, where more than two are."""
    group: dict[int, set[int]] = {}
    for one, other in pairs:
        merged = group.get(one, {one}) | group.get(other, {other})
        for piece in merged:
            group[piece] = merged
    longest = {tuple(sorted(pieces)) for pieces in group.values() if 2 < len(pieces) <= MOST_PIECES}
    return [list(pieces) for pieces in sorted(longest)]


def _joined(single: Lines, chain: list[int]) -> dict[str, Any]:
    """One stroke from the one far end of its pieces to the other."""
    pieces = np.array(chain)
    along = single.along[pieces[np.argmax(single.length[pieces])]]
    ends = np.concatenate([single.start[pieces], single.end[pieces]])
    errors = np.concatenate([single.se_end[pieces, 0], single.se_end[pieces, 1]])
    place = (ends * np.conj(along)).real
    low, high = int(np.argmin(place)), int(np.argmax(place))
    length = float(abs(ends[high] - ends[low]))
    offset = float(single.se_offset[pieces].max())
    members = np.resize(single.members[pieces, 0], MOST_PIECES)
    return {
        **_joined_tips(single, pieces, complex(ends[low]), complex(along)),
        "start": ends[low],
        "end": ends[high],
        "along": (ends[high] - ends[low]) / length,
        "length": length,
        "se_offset": offset,
        "se_angle": (SE_OFFSET_MM + offset) / length,
        "se_end": np.array([errors[low], errors[high]]),
        "darkness": single.darkness[pieces].min(),
        "width": single.width[pieces].min(),
        "thin": bool(single.thin[pieces].any()),
        "members": members,
    }


def _joined_tips(single: Lines, pieces: IntArray, start: complex, along: complex) -> dict[str, Any]:
    """The tips of all pieces along the stroke that they make."""
    same_way = (single.along[pieces] * np.conj(along)).real > 0
    at = single.start[pieces, None] + single.tip_along[pieces] * single.along[pieces, None]
    kind = np.where(same_way[:, None], single.tip_kind[pieces], single.tip_kind[pieces] ^ 1)
    known = single.tip_sure[pieces] > 0.0
    return {
        "tip_along": ((at - start) * np.conj(along)).real[known],
        "tip_kind": kind[known],
        "tip_sure": single.tip_sure[pieces][known],
    }


def _in_line(single: Lines) -> tuple[IntArray, IntArray]:
    """Pairs of strokes, each over 4 mm, that continue one another."""
    long = np.flatnonzero(single.length >= 4.0)
    pairs = [np.zeros((0, 2), dtype=np.int64)]
    for start in range(0, len(long), PART):
        some = long[start : start + PART]
        first, second = np.nonzero(_continues(single, some, long))
        pairs.append(np.column_stack([start + first, second]))
    first, second = np.concatenate(pairs).T
    length = single.length[long]
    keep = (length[first] != length[second]) | (first < second)
    keep &= first != second
    return long[first[keep]], long[second[keep]]


def _continues(single: Lines, rows: IntArray, others: IntArray) -> BoolArray:
    """(r, n) whether each of the `others` lies on the line of each of the `rows` and goes on from it."""
    start, along, length = single.start[rows, None], single.along[rows, None], single.length[rows, None]
    turn = np.abs((along * np.conj(single.along[others])).imag)
    near = turn < JOIN_TURN_RAD + np.minimum(JOIN_OFF_MM / single.length[others], 0.05)
    relative_start = (single.start[others] - start) * np.conj(along)
    relative_end = (single.end[others] - start) * np.conj(along)
    off = np.maximum(np.abs(relative_start.imag), np.abs(relative_end.imag))
    low = np.minimum(relative_start.real, relative_end.real)
    high = np.maximum(relative_start.real, relative_end.real)
    gap = np.maximum(low - length, -high)
    shorter = single.length[others] <= length
    # Contained pieces add nothing; the longer stroke's line decides, the shorter must lie on it.
    beyond = np.maximum(high - length, -low)
    return np.asarray(near & shorter & (off < JOIN_OFF_MM) & (gap < JOIN_GAP_MM) & (beyond > 1.0))
