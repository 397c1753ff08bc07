"""The ink of a sheet: strokes with ends and arrowheads, circles, hatching."""

from collections.abc import Sequence
from dataclasses import fields

import cv2
import numpy as np
import scipy

from grader.records import Box, FloatArray, GreyImage, Ink, InkMap, Page, Reason, Sheet, Strokes, Unread
from grader.scan.pixels import (
    BoolArray,
    Flat,
    at_full_size,
    averaged,
    cut_out,
    flatten,
    is_dotted,
    lengths_and_directions,
    parts,
    reduction,
)
from grader.scan.strokes.centreline import Fitted, Pen, fit_centre, refined, rejoined
from grader.scan.strokes.ends import find_ends, find_tips, split_by_darkness, through_bands
from grader.scan.strokes.regions import (
    PROBES,
    Components,
    Field,
    Pieces,
    Rows,
    brightness,
    distances,
    field_of,
    find_components,
    join,
    mark_boxes,
    near_pairs,
)
from grader.scan.strokes.seeds import (
    PX_PER_MM,
    Seeds,
    find_seeds,
    working_scale,
)
from grader.scan.strokes.symbols import arcs, find_circles, led_to

_DARK = 64.0
"""Brightness of 255, a quarter of white: paper in photos has more than 130, a negative's less than 20."""
_USUAL_BLOCK_MM = (200.0, 72.0)
"""From the paper's edges: the largest title blocks, of ISO 7200 and GOST 2.104, are 180 and 185 x 55 mm, in a
frame up to 10 mm from the edge."""
_MAP_PX_PER_MM = 6.0
"""Resolution of the ink map: a stroke of 0.3 mm is two pixels wide."""


def find_ink(page: Page, sheet: Sheet, boxes: Sequence[Box] | None = None) -> Ink | Unread:
    """Everything drawn inside the frame of a registered page; Unread with the reason where it is no drawing.

    Arguments: `boxes` is where strokes are searched, sheet mm; all of `sheet.drawable_mm` by default.
    """
    grey = brightness(page, sheet, boxes)
    if grey < _DARK:
        return Unread("ink", Reason("page_not_a_drawing", {"why": "dark", "grey": round(grey)}))
    flat = flatten(joined_dots(page.grey, sheet.px_per_mm))
    scale = working_scale(sheet.px_per_mm)
    reduced = flat.reduced(scale)
    seeds = find_seeds(reduced)
    components = find_components(seeds)
    field = field_of(seeds, components, sheet, scale, boxes)
    strokes = find_strokes(flat, seeds, components, field)
    if isinstance(strokes, Unread):
        return strokes
    circles = find_circles(flat, seeds, components, field)
    circles = circles[led_to(circles, strokes)]
    strokes = take(strokes, ~arcs(strokes, circles))
    hatched = hatching(strokes)
    marks = np.concatenate([mark_boxes(components, field), boxes_around(strokes, hatched)])
    strokes = take(strokes, ~hatched)
    tips = find_tips(flat, strokes, sheet.mm_to_px)
    problems = _left_out(field, page.source)
    return Ink(strokes, circles, marks, _ink_map(reduced, scale, sheet), tips=tips, problems=problems)


def _left_out(field: Field, file: str) -> tuple[Reason, ...]:
    """Return a problem for a person if an area larger than usual title blocks was left out."""
    if field.block is None or not np.any(np.array(field.block[2:]) > _USUAL_BLOCK_MM):
        return ()
    wide, high = field.block[2:]
    return (Reason("title_block_unsure", {"wide_mm": round(wide), "high_mm": round(high)}, file),)


def _ink_map(contrast: GreyImage, scale: float, sheet: Sheet) -> InkMap:
    """Contrast of the whole sheet, upright, from the page reduced by `scale`."""
    to_px = reduction(scale) @ sheet.mm_to_px
    # The centre of the map's pixel q is at q / 6 mm.
    box = (-0.5 / _MAP_PX_PER_MM, -0.5 / _MAP_PX_PER_MM, *sheet.page_mm)
    return InkMap(cut_out(contrast, to_px, box, _MAP_PX_PER_MM, outside=0), _MAP_PX_PER_MM)


# Strokes ------------------------------------------------------------------------------------------

_OFF_MM = 0.25
"""Pieces this near to a line belong to it; farther ones are other strokes."""
_GAP_MM = 2.3
"""Gaps within a stroke's border: where another crosses it, and in pencil."""
_FITTED_OFF_MM = 0.16
"""The same for fitted strokes, whose lines are known better."""
_FITTED_GAP_MM = 3.5
"""Gaps of dashed lines, and of lines that stop at a joint's circle and go on behind it."""
_LEAST_DASHED_MM = 7.0
"""A shorter row of dashes beside letters is a text."""
_LEAST_MM = 1.0
"""Shorter strokes have no direction."""
_MOST_STROKES = 3000
"""On a sheet: drawings of a class have up to 530 before fitting, real ones on A3 covered with ink 2,100."""
_MOST_RUNS = 16_000
"""Straight runs of border on a sheet: drawings have up to 2,300, A3 covered with ink 6,000, and the time to
join them grows with their square."""
_RUNS_OF_STROKE = 4
"""Straight runs of border per stroke: 2 to 7 were counted on scans of drawings, squared paper and text."""
_LEAST_SUPPORT = 0.3
"""Share of the cuts that must agree with a stroke's line."""
_SAME_MM = 0.2
"""A stroke this near to a longer one all along is the same ink."""
_SHORT_MM = 6.0
"""Joints, arrowheads and letters leave over no longer pieces."""
_LONG_MM = 8.0
"""The pen's width is taken from strokes of this length and more."""
_COVERED = 0.85
"""Share of a short stroke's length: with this much inside of others it is no stroke of its own."""
_SE_END_MM = 0.8
_SE_MERGED_MM = 2.5
"""Ends err by this much, measured on simulated students: lines run on along their neighbours."""


def find_strokes(flat: Flat, seeds: Seeds, components: Components, field: Field) -> Strokes | Unread:
    """Straight strokes in the field, in sheet mm; false where they are more than a drawing has."""
    full = at_full_size(seeds.ends, field.scale)
    usable = field.holds(field.to_mm(full.mean(axis=1))) & ~components.mark[components.of_seed]
    if usable.sum() > _MOST_RUNS:
        return _too_many(int(usable.sum()) // _RUNS_OF_STROKE)
    pieces = _lines(full, seeds, components, usable, field.scale)
    if len(pieces.width) > _MOST_STROKES:
        return _too_many(len(pieces.width))
    fitted, merged = _settled(flat, pieces, field.sheet.px_per_mm, seeds.pen_px / field.scale)
    return _records(fitted, merged, field)


def _too_many(count: int) -> Unread:
    return Unread("ink", Reason("page_not_a_drawing", {"why": "many_strokes", "strokes": count}))


def take(strokes: Strokes, which: BoolArray) -> Strokes:
    """The chosen strokes."""
    return Strokes(*(getattr(strokes, column.name)[which] for column in fields(Strokes)))


def _lines(full: FloatArray, seeds: Seeds, components: Components, usable: BoolArray, scale: float) -> Pieces:
    """Seeds joined to lines; short straight letters stay out unless they line up to a dashed line."""
    unit = PX_PER_MM / scale
    rows = np.flatnonzero(usable)
    pieces = join(full[rows], seeds.width[rows] / scale, _OFF_MM * unit, _GAP_MM * unit)
    dash = components.dash[components.of_seed[rows]]
    only_dashes = np.array([bool(dash[members].all()) for members in pieces.members], dtype=bool)
    short = lengths_and_directions(pieces.ends)[0] < _LEAST_DASHED_MM * unit
    return pieces.take(~(only_dashes & short))


def _settled(flat: Flat, pieces: Pieces, unit: float, pen: float) -> tuple[Fitted, BoolArray]:
    """Fit, join what turns out to be one line, find the ends, fit again; no stroke twice."""
    fitted = _sound(fit_centre(flat, pieces.ends, pieces.width, Pen(unit, pen)), unit)
    usual = Pen(unit, _pen(fitted, unit, pen))
    pieces = join(fitted.ends, fitted.width, _FITTED_OFF_MM * unit, _FITTED_GAP_MM * unit)
    fitted = _sound(fit_centre(flat, pieces.ends, pieces.width, usual), unit)
    grown, merged = find_ends(flat, fitted, unit)
    grown = through_bands(flat, fitted, grown, merged, unit)
    parts, owners = split_by_darkness(flat, fitted.with_ends(grown), unit)
    fitted, merged = fitted.take(owners).with_ends(parts), merged[owners]
    once = distinct(fitted, unit)
    fitted, merged = fitted.take(once), merged[once]
    fitted = refined(flat, fitted, usual)
    ends, stay = rejoined(fitted, unit)
    fitted, merged = fitted.with_ends(ends).take(stay), merged[stay]
    final = refined(flat, fitted, usual)
    # A short guess across a joint or a letter may have slid onto a stroke that is there already.
    good = (
        (final.support >= _LEAST_SUPPORT)
        & (final.length >= _LEAST_MM * unit)
        & distinct(final, unit, _COVERED)
    )
    return final.take(good), merged[good]


def _pen(fitted: Fitted, unit: float, guess: float) -> float:
    """Usual width of the long strokes, px; the guess where there are none."""
    rows = np.flatnonzero(fitted.length >= _LONG_MM * unit)
    if len(rows) == 0:
        return guess
    rows = rows[np.argsort(fitted.width[rows])]
    cumulated = np.cumsum(fitted.length[rows])
    return float(fitted.width[rows[np.searchsorted(cumulated, 0.4 * cumulated[-1])]])


def _sound(fitted: Fitted, unit: float) -> Fitted:
    return fitted.take((fitted.support >= _LEAST_SUPPORT) & (fitted.length >= 0.8 * _LEAST_MM * unit))


def distinct(fitted: Fitted, unit: float, covered_share: float = 1.0) -> BoolArray:
    """Return which strokes, longest first, have ink of their own.

    A stroke that lies along a longer one is the same ink; a short one mostly inside others is what
    a joint, an arrowhead or a letter left over.
    """
    keep = np.ones(len(fitted), dtype=bool)
    if len(fitted) == 0:
        return keep
    inner, order = 0.6 * fitted.width, np.argsort(-fitted.length)
    first, second = near_pairs(fitted.ends, fitted.ends, max(_SAME_MM * unit, float(inner.max())))
    rank = np.argsort(order)
    longer = rank[second] < rank[first]
    first, second = first[longer], second[longer]
    off = np.concatenate(
        [distances(fitted.ends, first[part], second[part]) for part in parts(len(first), PROBES)]
        or [np.zeros((0, PROBES), dtype=np.float32)]
    )
    along = np.asarray((off < _SAME_MM * unit).all(axis=1))
    inside = np.asarray(off < inner[second, None])
    short = (fitted.length < _SHORT_MM * unit) & (covered_share < 1.0)
    start = np.searchsorted(first, np.arange(len(fitted) + 1))
    doubted = np.bincount(first[along | short[first]], minlength=len(fitted)) > 0
    for row in order[doubted[order]]:
        others = slice(start[row], start[row + 1])
        kept = keep[second[others]]
        covered = short[row] and inside[others][kept].any(axis=0).mean() > covered_share
        keep[row] = not covered and not along[others][kept].any()
    return keep


def _records(fitted: Fitted, merged: BoolArray, field: Field) -> Strokes:
    unit = field.sheet.px_per_mm
    return Strokes(
        ends=field.to_mm(fitted.ends),
        width=fitted.width / unit,
        se_offset=fitted.se_across / unit,
        se_angle=fitted.se_turn,
        se_end=np.where(merged, _SE_MERGED_MM, _SE_END_MM),
        darkness=fitted.darkness,
    )


# Hatching -----------------------------------------------------------------------------------------


_SHORT_PARALLEL_DEG = 11.0
"""Largest angle between neighbours in hatching: short strokes are drawn freehand."""
_LONG_PARALLEL_DEG = 5.0
"""The same of long ones, which are drawn along a set square."""
_APART_MM = (0.5, 6.0)
"""Nearer strokes are one drawn twice, farther ones no hatching."""
_MOST_SHORT = 4
"""A family of short strokes in hatching has more members."""
_MOST_LONG = 6
"""A slider, its guide and a link along it make five level lines."""
_LONGEST_MM = 60.0
"""Across the largest plate."""
_RATIO = 2.5
"""Largest ratio of the lengths of two neighbours in hatching."""
_WEIGHT_RATIO = 1.35
"""Largest ratio of the width times darkness of two neighbours: one pen, one pressure."""


def hatching(strokes: Strokes) -> BoolArray:
    """Return which strokes are hatching.

    At least five short or seven long parallel ones of like length and weight, each within 6 mm of
    the next, side by side. A plan has no such family.
    """
    length = lengths_and_directions(strokes.ends)[0]
    rows = np.flatnonzero(length < _LONGEST_MM)
    result = np.zeros(len(strokes), dtype=bool)
    if len(rows) <= _MOST_SHORT:
        return result
    weight = (strokes.width * strokes.darkness)[rows]
    first, second, aside = _linked(strokes.ends[rows], length[rows], weight)
    left, right = np.zeros((2, len(rows)), dtype=bool)
    left[first[aside > 0]] = right[first[aside < 0]] = True
    # The last of a family may be the link or the side that runs along it: short ones alone are safe.
    family, short, between = _family_size(first, second, len(rows)), length[rows] < _SHORT_MM, left & right
    result[rows] = np.where(short, family > _MOST_SHORT, (family > _MOST_LONG) & between)
    return result


def _linked(ends: FloatArray, length: FloatArray, weight: FloatArray) -> tuple[Rows, Rows, FloatArray]:
    """Pairs of parallel strokes side by side, of like length and weight; how far to the side, signed."""
    span = ends[:, 1] - ends[:, 0]
    span = np.where((span[:, :1] < 0) | ((span[:, :1] == 0) & (span[:, 1:] < 0)), -span, span)
    u = span / np.maximum(length, 1e-9)[:, None]
    middle, count = ends.mean(axis=1), len(ends)
    pairs = [np.zeros(0, dtype=np.intp)]
    for part in parts(count, 4 * count):
        apart = middle[None, :] - middle[part, None]
        along = np.abs((apart * u[part, None]).sum(axis=2))
        aside = np.abs(apart[..., 0] * u[part, None, 1] - apart[..., 1] * u[part, None, 0])
        beside = (aside > _APART_MM[0]) & (aside < _APART_MM[1])
        beside &= along < 0.5 * (length[part, None] + length[None, :])
        pairs.append(part.start * count + np.flatnonzero(beside))
    first, second = np.divmod(np.concatenate(pairs), count)
    sine = np.abs(u[first, 0] * u[second, 1] - u[first, 1] * u[second, 0])
    shorter, longer = np.minimum(length[first], length[second]), np.maximum(length[first], length[second])
    limit = np.where(
        shorter < _SHORT_MM, np.sin(np.radians(_SHORT_PARALLEL_DEG)), np.sin(np.radians(_LONG_PARALLEL_DEG))
    )
    linked = (sine < limit) & (longer < _RATIO * shorter)
    lighter, heavier = np.minimum(weight[first], weight[second]), np.maximum(weight[first], weight[second])
    linked &= heavier < _WEIGHT_RATIO * lighter
    first, second = first[linked], second[linked]
    mutual = np.isin(first * count + second, second * count + first)
    first, second = first[mutual], second[mutual]
    apart = middle[second] - middle[first]
    return first, second, apart[:, 0] * u[first, 1] - apart[:, 1] * u[first, 0]


def _family_size(first: Rows, second: Rows, count: int) -> Rows:
    """(count,) how many strokes hang together with each through links."""
    links = scipy.sparse.coo_matrix((np.ones(len(first)), (first, second)), shape=(count, count))
    _, label = scipy.sparse.csgraph.connected_components(links, directed=False)
    return np.asarray(np.bincount(label, minlength=count)[label], dtype=np.intp)


def boxes_around(strokes: Strokes, which: BoolArray) -> FloatArray:
    """(j, 4) boxes x, y, w, h of the chosen strokes."""
    low, high = strokes.ends[which].min(axis=1), strokes.ends[which].max(axis=1)
    return np.column_stack([low, high - low]).reshape(-1, 4)


# Scans whose lines are rows of dots (faint copies, dithered tones, stretched contrast) ----------------

_SOFT_MM = 0.13
"""Dots of a line are this near to each other."""
_LINE_MM = 4.2
"""Long enough that a row of dots differs from dots at random, and a vector of 5 mm is still found."""
_DIRECTIONS = 24
"""A line as wide as its softened dots stays on one of them over its whole length."""
_AROUND = 2.0
"""Multiple of the mean over all directions: dots spread evenly, as in a dithered area, are no line."""
_GAIN = 2.5
"""A line a third of which is left becomes as dark as one drawn through."""


def joined_dots(grey: GreyImage, px_per_mm: float) -> GreyImage:
    """A dotted page in tones, with lines where rows of dots lie; any other page as it is given."""
    if not is_dotted(grey):
        return grey
    soft = np.asarray(cv2.GaussianBlur(grey, (0, 0), _SOFT_MM * px_per_mm), dtype=np.uint8)
    side = max(1, round(1.0 / working_scale(px_per_mm)))
    lines = cv2.resize(_along_lines(averaged(~grey, side)), None, fx=side, fy=side)
    part = soft[: lines.shape[0], : lines.shape[1]]
    part[:] = np.minimum(part, ~np.asarray(lines, dtype=np.uint8))
    return soft


def _along_lines(dark: GreyImage) -> GreyImage:
    """Return how much darker the darkest line through each place is than its surroundings.

    Arguments: `dark` is 0 (paper) to 255 (ink) at the working resolution.
    """
    soft = cv2.GaussianBlur(dark, (0, 0), 1.0)
    half = round(0.5 * _LINE_MM * PX_PER_MM)
    darkest, total = np.zeros_like(dark), np.zeros(dark.shape, dtype=np.float32)
    for angle in np.arange(_DIRECTIONS) * (np.pi / _DIRECTIONS):
        line = np.zeros((2 * half + 1, 2 * half + 1), dtype=np.float32)
        reach = np.rint(16.0 * half * np.array([np.cos(angle), np.sin(angle)])).astype(int)
        start, end = (16 * half - reach).tolist(), (16 * half + reach).tolist()
        cv2.line(line, start, end, 1.0, 1, cv2.LINE_AA, 4)
        mean = cv2.filter2D(soft, cv2.CV_8U, line / line.sum())
        darkest = np.asarray(cv2.max(darkest, mean), dtype=np.uint8)
        cv2.accumulate(mean, total)
    own = darkest.astype(np.float32) - np.float32(_AROUND / _DIRECTIONS) * total
    return np.asarray(np.clip(np.float32(_GAIN) * own, 0.0, 255.0), dtype=np.uint8)
