"""Connected regions of ink, and pieces joined over gaps and crossings."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import cv2
import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import Box, FloatArray, Page, Sheet
from grader.scan.pixels import (
    TITLE_BLOCK_MM,
    BoolArray,
    Float32Array,
    at_full_size,
    connected,
    inverted,
    lengths_and_directions,
    mapped,
    parts,
    reached,
)
from grader.scan.strokes.seeds import PX_PER_MM, Seeds

_TURN = 0.16
"""Pieces that differ by more than 9 degrees are never joined."""
_ROUNDS = 6
"""A line grows as it becomes better known."""
_MOST_OFF = 1.7
"""Multiple of the distance allowed beside a line that is allowed far beyond its ends."""
_BLOCK = 64
"""Pieces of which it is found at once whether anything lies on their lines."""
PROBES = 13
"""Places along a segment at which its distance from another is taken."""
_SLACK_PX = 1.0
"""Callers compare in single precision: pairs at the limit are in."""
_NEIGHBOURHOOD = 2048
"""Pairs of samples around one segment, and segments that may be near it, at most as a rule."""

Rows = NDArray[np.intp]


# Near each other ----------------------------------------------------------------------------------


def near_pairs(ends: FloatArray, others: FloatArray, reach_px: float) -> tuple[Rows, Rows]:
    """Rows of all pairs of a segment (k, 2, 2) and another (t, 2, 2) within `reach_px` of each other.

    Returns (n,) rows of `ends`, in order, and (n,) rows of `others`, in order for each segment. Pairs up
    to three and a half times as far apart may be among them: the caller's own formula decides.
    """
    step = 2.0 * (reach_px + _SLACK_PX)
    at, row = _samples(others, step)
    tree = scipy.spatial.KDTree(at)
    pairs = [np.zeros((2, 0), dtype=np.intp)]
    for part in parts(len(ends), _NEIGHBOURHOOD):
        own_at, own = _samples(ends[part], step)
        # No point of a segment is further than half a step from a sample.
        own_tree = scipy.spatial.KDTree(own_at)
        close = own_tree.sparse_distance_matrix(tree, reach_px + step, output_type="ndarray")
        are_near = np.zeros((len(ends[part]), len(others)), dtype=bool)
        are_near[own[close["i"]], row[close["j"]]] = True
        rows, beside = are_near.nonzero()
        pairs.append(np.stack([part.start + rows, beside]))
    first, second = np.concatenate(pairs, axis=1)
    return first, second


def _samples(ends: FloatArray, step: float) -> tuple[FloatArray, Rows]:
    """((n, 2) places along segments, at most `step` apart, both ends among them; (n,) their segments)."""
    span = ends[:, 1] - ends[:, 0]
    count = np.ceil(np.hypot(span[:, 0], span[:, 1]) / step).astype(np.intp) + 1
    row = np.repeat(np.arange(len(ends)), count)
    number = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
    return ends[row, 0] + (number / np.maximum(count[row] - 1, 1))[:, None] * span[row], row


def distances(ends: FloatArray, first: Rows, second: Rows) -> Float32Array:
    """(n, p) distances of places along the `first` (n,) of segments (k, 2, 2) from the `second`."""
    ends = ends.astype(np.float32)
    share = np.linspace(0.04, 0.96, PROBES, dtype=np.float32)
    span = ends[:, 1] - ends[:, 0]
    length = np.maximum(np.hypot(span[:, 0], span[:, 1]), np.float32(1e-6))
    u = span / length[:, None]
    points = ends[:, None, 0] + share[:, None] * span[:, None, :]
    x = points[first, :, 0] - ends[second, 0, 0, None]
    y = points[first, :, 1] - ends[second, 0, 1, None]
    u = u[second, :, None]
    along = x * u[:, 0] + y * u[:, 1]
    along -= np.clip(along, np.float32(0.0), length[second, None])
    across = x * u[:, 1] - y * u[:, 0]
    return np.asarray(np.hypot(along, across))


# On one line --------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Pieces:
    """Strokes: (n, 2, 2) ends and (n,) widths, px, and the rows that each was joined from."""

    ends: FloatArray
    width: FloatArray
    members: tuple[NDArray[np.intp], ...]

    def take(self, which: BoolArray) -> "Pieces":
        """The chosen rows."""
        chosen = tuple(self.members[row] for row in np.flatnonzero(which))
        return Pieces(self.ends[which], self.width[which], chosen)


def join(ends: FloatArray, width: FloatArray, off_px: float, gap_px: float) -> Pieces:
    """Join, longest first, all free pieces within `off_px` of its line and no gap over `gap_px`."""
    length, way = lengths_and_directions(ends)
    free = np.ones(len(ends), dtype=bool)
    joined = np.zeros((len(ends), 2, 2))
    widths = np.zeros(len(ends))
    groups: list[NDArray[np.intp]] = []
    # Coordinates row by row, (x and y, first and second end, n): many short computations follow.
    points = np.ascontiguousarray(ends.transpose(2, 1, 0))
    middle = points.mean(axis=1)
    order = np.argsort(-length)
    for start in range(0, len(order), _BLOCK):
        block = order[start : start + _BLOCK]
        block = block[free[block]]
        # Pieces with nothing free on their line need no search.
        off = way[block, :1] * middle[1] - way[block, 1:] * middle[0]
        off -= off[np.arange(len(block)), block][:, None]
        row, second = (free & (np.abs(off) <= _MOST_OFF * off_px)).nonzero()
        own = block[row]
        lines = way[own, 0], way[own, 1], length[own]
        near, low, high = _lying_on(points[:, :, second] - points[:, :1, own], lines, off_px)
        near &= (low <= length[own] + gap_px) & (high >= -gap_px) & (own != second)
        search = np.bincount(row[near], minlength=len(block)) > 0
        for first, has_others in zip(block.tolist(), search.tolist(), strict=True):
            if not free[first]:
                continue
            line, members = ends[first], np.array([first])
            for _ in range(_ROUNDS if has_others else 0):
                grown = _on_line(points, middle, free, line, (off_px, gap_px))
                grown = grown if first in grown else np.sort(np.append(grown, first))
                if len(grown) == len(members) and (grown == members).all():
                    break
                members, line = grown, _fitted(points[:, :, grown], length[grown])
            free[members] = False
            joined[len(groups)] = line
            widths[len(groups)] = width[members] @ length[members] / length[members].sum()
            groups.append(members)
    return Pieces(joined[: len(groups)], widths[: len(groups)], tuple(groups))


def _on_line(
    points: FloatArray, middle: FloatArray, free: BoolArray, line: FloatArray, limits: tuple[float, float]
) -> NDArray[np.intp]:
    """Rows of the free pieces near a line (2, 2) and reached from it without too large a gap."""
    (x, y), (dx, dy) = line[0].tolist(), (line[1] - line[0]).tolist()
    size, (off_px, gap_px) = math.hypot(dx, dy), limits
    ux, uy = dx / size, dy / size
    # By their middles, which pieces are near enough to be looked at.
    off = np.abs(ux * middle[1] - uy * middle[0] - (ux * y - uy * x))
    rows = (free & (off <= _MOST_OFF * off_px)).nonzero()[0]
    near, low, high = _lying_on(points[:, :, rows] - line[0][:, None, None], (ux, uy, size), off_px)
    return np.asarray(rows[near][reached(low[near], high[near], (0.0, size), gap_px)])


def _lying_on(
    apart: FloatArray, line: tuple[float | FloatArray, ...], off_px: float
) -> tuple[BoolArray, FloatArray, FloatArray]:
    """Return which pieces lie near a line, and from where to where along it, (n,) each.

    Arguments: `apart` (2, 2, n) of both ends from the line's start; `line` its direction and length.
    """
    ux, uy, size = line
    t, d = ux * apart[0] + uy * apart[1], ux * apart[1] - uy * apart[0]
    turn = np.abs(d[1] - d[0]) <= _TURN * np.abs(t[1] - t[0])
    # A short line does not know its direction: allow for half a pixel at its ends, growing outward.
    beyond = np.maximum(np.abs(t - 0.5 * size) - 0.5 * size, 0.0)
    near = np.abs(d) <= off_px + np.minimum(beyond * (0.5 / size), (_MOST_OFF - 1.0) * off_px)
    return turn & near[0] & near[1], np.minimum(t[0], t[1]), np.maximum(t[0], t[1])


def _fitted(points: FloatArray, length: FloatArray) -> FloatArray:
    """Line by weighted total least squares through pieces (2, 2, n), ending where they end."""
    at, weight = points.reshape(2, -1), np.concatenate([length, length])
    weight /= weight.sum()
    centre = at @ weight
    off = at - centre[:, None]
    (xx, product), (_, yy) = ((off * weight) @ off.T).tolist()
    angle = 0.5 * math.atan2(2.0 * product, xx - yy)
    u = np.array([math.cos(angle), math.sin(angle)])
    t = u @ off
    return np.stack([centre + t.min() * u, centre + t.max() * u])


# The field of drawings --------------------------------------------------------------------

_FRAME_MM = 1.5
"""Inside of the frame's middle line: its pen and the registration's error."""
_SQUARE = 0.05
"""Largest skew of a ruled line, as a share of its length."""
_PIECE_MM = 3.0
"""Shorter pieces of borders are letters'."""
_RULED_MM = 6.0
"""Shorter joined lines are no part of a table."""
_OFF_MM = 0.5
"""Both borders of a ruled line are joined."""
_BROKEN_MM = 16.0
"""Letters that touch a ruled line break its border this far."""
_MEET_MM = 4.0
"""The block's lines are ruled to their corner no nearer than this."""
_REACH_MM = 18.0
"""The block's lines reach the frame, or end this far from it."""
_EDGE_MM = 2.5
"""Lines nearer to the sheet's right and lower edge are the paper's shadow."""
_LEAST_LINES = 4
"""Top, left and at least two rows."""
_LEAST_LETTERS = 3
"""A title block holds a number at least."""
_SAMPLES = 64
"""Places along each side of a box: 4096 tell a median to a few per cent."""


@dataclass(frozen=True, slots=True)
class Field:
    """The part of the sheet in which strokes are searched.

    Attributes
    ----------
    sheet : the page's map
    boxes : sheet mm, any of them
    block : the title block, left out
    scale : working pixels per full pixel
    """

    sheet: Sheet
    boxes: tuple[Box, ...]
    block: Box | None
    scale: float

    def to_mm(self, points: FloatArray) -> FloatArray:
        """(..., 2) full pixels to sheet millimetres."""
        return mapped(inverted(self.sheet.mm_to_px), points)

    def holds(self, points: FloatArray) -> BoolArray:
        """Return which points, (n, 2) mm, are in the field."""
        inside = np.zeros(len(points), dtype=bool)
        for box in self.boxes:
            inside |= _in_box(points, box)
        return inside if self.block is None else inside & ~_in_box(points, self.block)

    def mask(self, shape: tuple[int, ...]) -> BoolArray:
        """The field at the working resolution."""
        picture = np.zeros(shape, dtype=np.uint8)
        for box in self.boxes:
            cv2.fillConvexPoly(picture, self._outline(box), 1)
        if self.block is not None:
            cv2.fillConvexPoly(picture, self._outline(self.block), 0)
        return picture > 0

    def _outline(self, box: Box) -> np.ndarray:
        x, y, w, h = box
        corners = np.array([[x, y], [x + w, y], [x + w, y + h], [x, y + h]])
        return np.rint((mapped(self.sheet.mm_to_px, corners) + 0.5) * self.scale - 0.5).astype(np.int32)


def brightness(page: Page, sheet: Sheet, boxes: Sequence[Box] | None) -> float:
    """Median of the page, 0..255, at places every few millimetres of where drawings are looked for."""
    shares = (np.arange(_SAMPLES) + 0.5) / _SAMPLES
    across, down = (share.ravel() for share in np.meshgrid(shares, shares))
    mm = [np.column_stack([x + w * across, y + h * down]) for x, y, w, h in boxes or (_inner(sheet),)]
    last = np.array(page.grey.shape[::-1]) - 1
    column, row = np.clip(np.rint(mapped(sheet.mm_to_px, np.concatenate(mm))), 0, last).astype(np.intp).T
    return float(np.median(page.grey[row, column]))


def _inner(sheet: Sheet) -> Box:
    """The frame's inside, clear of its line."""
    x, y, w, h = sheet.drawable_mm
    return (x + _FRAME_MM, y + _FRAME_MM, w - 2.0 * _FRAME_MM, h - 2.0 * _FRAME_MM)


def field_of(
    seeds: Seeds, components: "Components", sheet: Sheet, scale: float, boxes: Sequence[Box] | None
) -> Field:
    """The frame's inside, or the boxes asked for, without the title block."""
    field = Field(sheet, (_inner(sheet),) if boxes is None else tuple(boxes), None, scale)
    if sheet.zones:
        return field
    block = title_block(field.to_mm(at_full_size(seeds.ends, scale)), sheet)
    # A table, and the corner of a drawing, have no text: what stands there is not left out.
    if block is None or _in_box(mark_boxes(components, field)[:, :2], block).sum() < _LEAST_LETTERS:
        return field
    return replace(field, block=block)


def title_block(ends: FloatArray, sheet: Sheet) -> Box | None:
    """The ruled table at the bottom right, from pieces of lines (n, 2, 2) mm; None without one.

    Its top line runs to the right side and its left line to the bottom, and the two meet: a plan
    drawn close by is not taken in.
    """
    lines = _ruled(ends, sheet)
    if len(lines) < _LEAST_LINES:
        return None
    low, high = lines.min(axis=1), lines.max(axis=1)
    level = (high - low)[:, 0] > (high - low)[:, 1]
    right, bottom = high.max(axis=0)
    tops = lines[level & (high[:, 0] > right - _REACH_MM)]
    lefts = lines[~level & (high[:, 1] > bottom - _REACH_MM)]
    best: Box | None = None
    for top in tops:
        for left in lefts:
            x, y = float(left[:, 0].mean()), float(top[:, 1].mean())
            meets = abs(top[:, 0].min() - x) < _MEET_MM and abs(left[:, 1].min() - y) < _MEET_MM
            inside = level & (low[:, 1] > y + _MEET_MM / 2.0) & (low[:, 0] > x - _MEET_MM)
            large = best is None or (right - x) * (bottom - y) > best[2] * best[3]
            if meets and large and inside.any():
                best = (x - 1.0, y - 1.0, sheet.page_mm[0] - x + 1.0, sheet.page_mm[1] - y + 1.0)
    return best


def _ruled(ends: FloatArray, sheet: Sheet) -> FloatArray:
    """(m, 2, 2) level and upright lines near the bottom right corner, pieces joined."""
    right, bottom = sheet.page_mm
    span = np.abs(ends[:, 1] - ends[:, 0])
    low, high = ends.min(axis=1), ends.max(axis=1)
    ruled = (span.min(axis=1) < np.maximum(_SQUARE * span.max(axis=1), 0.2)) & (span.max(axis=1) >= _PIECE_MM)
    ruled &= (low[:, 0] > right - TITLE_BLOCK_MM[0]) & (low[:, 1] > bottom - TITLE_BLOCK_MM[1])
    ruled &= (high[:, 0] < right - _EDGE_MM) & (high[:, 1] < bottom - _EDGE_MM)
    lines = join(ends[ruled], np.ones(int(ruled.sum())), _OFF_MM, _BROKEN_MM).ends
    size = np.abs(lines[:, 1] - lines[:, 0]).max(axis=1)
    return np.asarray(lines[size >= _RULED_MM])


def _in_box(points: FloatArray, box: Box) -> BoolArray:
    x, y, w, h = box
    return np.asarray(
        (points[:, 0] >= x) & (points[:, 0] <= x + w) & (points[:, 1] >= y) & (points[:, 1] <= y + h)
    )


# Pieces of ink ------------------------------------------------------------------------------------

_MARK_MM = 8.0
"""Larger pieces of ink are no single letter."""
_LONG_SEED_MM = 4.5
"""Ink without a straight border of this length holds letters, compass arcs and the like."""
_LEAST_STROKE_MM = 1.2
"""Shorter pieces are dots and dust."""
_THIN = 0.5
"""Spread across a stroke in pens: 0.29 for an even one."""
_LONG = 2.5
"""A stroke is so many times as long as wide."""
_LONE_MM = 6.0
"""A straight piece this long is a stroke, whatever stands beside it."""
_NEIGHBOUR_MM = 5.0
"""Letters of one word are closer to each other than this."""
_NEIGHBOURS = 2
"""A single letter beside a short stroke names it; two are a text of which it is part."""
_DUST_MM = 0.4
"""Smaller pieces are dust."""


@dataclass(frozen=True, slots=True)
class Components:
    """Pieces of ink at the working resolution.

    Attributes
    ----------
    box_px : (c, 4) left, top, width, height
    mark : (c,) too small or too crooked to hold a stroke
    dash : (c,) straight but short and beside letters: a stroke only as part of a dashed line
    of_seed : (n,) which piece each seed is of
    """

    box_px: FloatArray
    mark: BoolArray
    dash: BoolArray
    of_seed: NDArray[np.intp]


def find_components(seeds: Seeds) -> Components:
    """Label the ink and tell marks from what can hold strokes."""
    labels, box = connected(seeds.mask)
    of_seed = labels[seeds.border[:, 0], seeds.border[:, 1]].astype(np.intp) - 1
    size = np.hypot(box[:, 2], box[:, 3]) / PX_PER_MM
    longest = np.zeros(len(box))
    length = lengths_and_directions(seeds.ends)[0] / PX_PER_MM
    np.maximum.at(longest, of_seed, length)
    small = longest < _LONG_SEED_MM
    stroke_like = small & (size >= _LEAST_STROKE_MM) & (longest >= 0.6 * size)
    inked = np.flatnonzero(seeds.mask.view(bool))
    label = np.asarray(labels.reshape(-1)[inked] - 1, dtype=np.intp)
    of_these = stroke_like[label]
    major, minor = _spread(inked[of_these], label[of_these], labels.shape[1], len(box))
    stroke_like &= (minor <= _THIN * seeds.pen_px) & (major >= _LONG * minor)
    written = small & ~stroke_like & (size > 2.0 * _DUST_MM) & (size < _MARK_MM)
    text = small & stroke_like & (size < _LONE_MM)
    text[text] = _beside(box, written, np.flatnonzero(text))
    return Components(box, small & ~stroke_like, text, of_seed)


def _spread(
    place: NDArray[np.intp], label: NDArray[np.intp], wide: int, count: int
) -> tuple[FloatArray, FloatArray]:
    """Standard deviations of each piece's pixels along and across it, (count,) each, px.

    Arguments: `place` of each pixel in a picture that is `wide` pixels wide, and which piece it is of.
    """
    row, column = np.divmod(place, wide)
    number = np.maximum(np.bincount(label, minlength=count), 1)

    def mean(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(label, weights=values, minlength=count) / number)

    x, y = column.astype(np.float64), row.astype(np.float64)
    mx, my = mean(x), mean(y)
    x, y = x - mx[label], y - my[label]
    xx, yy, xy = mean(x * x), mean(y * y), mean(x * y)
    half, root = (xx + yy) / 2.0, np.sqrt(((xx - yy) / 2.0) ** 2 + xy**2)
    return np.sqrt(half + root), np.sqrt(np.maximum(half - root, 0.0))


def _beside(box: FloatArray, written: BoolArray, rows: NDArray[np.intp]) -> BoolArray:
    """Return which of the pieces `rows` have at least two letters close by."""
    centre = (box[:, :2] + box[:, 2:] / 2.0) / PX_PER_MM
    letters = centre[written]
    result = np.zeros(len(rows), dtype=bool)
    if len(letters) < _NEIGHBOURS:
        return result
    for index, at in enumerate(centre[rows]):
        near = np.hypot(*(letters - at).T) < _NEIGHBOUR_MM
        result[index] = near.sum() >= _NEIGHBOURS
    return result


def mark_boxes(components: Components, field: Field) -> FloatArray:
    """(j, 4) boxes x, y, w, h in sheet mm of the marks in the field, dust left out."""
    left, top, wide, high = components.box_px[components.mark | components.dash].T
    steps = ((0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0))
    corners = np.stack([np.column_stack([left + dx * wide, top + dy * high]) for dx, dy in steps], axis=1)
    # A box's edge lies between pixels.
    mm = field.to_mm(at_full_size(corners - 0.5, field.scale))
    low, far = mm.min(axis=1), mm.max(axis=1)
    inside = field.holds((low + far) / 2.0) & ((far - low).max(axis=1) > _DUST_MM)
    return np.column_stack([low[inside], (far - low)[inside]])
