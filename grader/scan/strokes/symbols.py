"""Circles: rings of joints and poles, and the short strokes that are pieces of them."""

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage, Strokes
from grader.scan.pixels import BoolArray, Flat, Float32Array, at_full_size, lengths_and_directions
from grader.scan.strokes.regions import Components, Field
from grader.scan.strokes.seeds import PX_PER_MM, Seeds

_RADIUS_MM = (0.5, 4.0)
"""Radii of joints and poles as people draw them."""
_LEAST_HOLE_MM = 0.4
"""Inside a ring of the least radius, drawn with a pen."""
_LONG_HOLE = 1.7
"""Longer over shorter side of a ring's inside, drawn by hand."""
_CELL_PX = 2
"""Side of a cell in which normals are counted."""
_EVERY = 2
"""Every second border pixel votes."""
_VOTES = 0.3
"""Share of a full circle of the least radius whose normals must meet."""
_MOST = 120
"""Places at which most normals meet; the holes of the ink are tried too."""
_ANGLES = 48
"""Rays around a centre."""
_ROUNDS = 3
_RADIAL_MM = np.arange(0.3, 4.6, 0.1)
"""Distances from a centre at which ink is looked for."""
_ROUND_MM = 0.11
"""Rms distance of a hand-drawn ring from a circle, at most."""
_ROUND, _GRAIN_MM = 0.085, 0.04
"""The same of a small one: a share of its radius, and the pixels' grain. Letters' loops are less round."""
_DRAWN = 0.75
"""Share of the circle that is inked and round, but for where strokes cross it."""
_DRAWN_ALONE = 0.5
"""The same with the places counted where strokes cross it."""
_THICK = 0.7
"""Share of the places across the ring that are inked where a stroke runs along the ray."""
_POINTS_TO_MM = 0.35
"""Share of the radius: a line that leads to a circle passes its centre this near."""
_LEADS_TO_MM = 1.5
"""It ends at most so far from the ring."""
_LEAST_LINK_MM = 4.0
"""Shorter strokes belong to letters."""
_HOLLOW = 0.55
"""Share of a smaller circle that may be inked, and that circle's size: a ring is hollow, a dot is not."""
_HOLLOW_AT = 0.55
_EDGE_BYTES = 12.0
"""Rise of the contrast across a border of ink, at least."""
_CHORD = 0.65
"""Least distance of a piece of the ring from the centre, as a share of the radius."""
_TANGENT_MM = 0.35
"""Largest distance of a piece of the ring outside of it."""
_CHORD_MM = 6.0
"""Largest length of a piece of the ring."""
_CHORD_PAST_MM = 2.2
"""Largest distance of its ends outside of the ring."""


def find_circles(flat: Flat, seeds: Seeds, components: Components, field: Field) -> FloatArray:
    """(m, 3) x, y, r in sheet mm of rings drawn over at least 60 % and hollow inside.

    Rings that are part of a letter are left out.
    """
    unit = field.sheet.px_per_mm
    where = field.mask(seeds.mask.shape)
    guesses = at_full_size(np.concatenate([_holes(seeds, where), _meeting_points(seeds, where)]), field.scale)
    if len(guesses) == 0:
        return np.zeros((0, 3))
    rings = _distinct(_refined(flat, guesses, unit))
    rings = rings[~_in_letter(rings, components, field.scale)]
    return np.column_stack([field.to_mm(rings[:, :2]), rings[:, 2] / unit])


def led_to(circles: FloatArray, strokes: Strokes) -> BoolArray:
    """Return which circles a stroke of 4 mm or more leads to or through: joints and poles, not letters."""
    length, u = lengths_and_directions(strokes.ends)
    links = length >= _LEAST_LINK_MM
    result = np.zeros(len(circles), dtype=bool)
    for index, (x, y, radius) in enumerate(circles):
        along, off = _beside(strokes, u, (x, y))
        reach = radius + _LEADS_TO_MM
        on = (along > -reach) & (along < length + reach) & (off < _POINTS_TO_MM * radius + 0.2)
        result[index] = bool((on & links).any())
    return result


def arcs(strokes: Strokes, circles: FloatArray) -> BoolArray:
    """Return which strokes are short chords or tangents of a circle, pieces of its ring."""
    result = np.zeros(len(strokes), dtype=bool)
    length, u = lengths_and_directions(strokes.ends)
    for x, y, radius in circles:
        foot, off = _beside(strokes, u, (x, y))
        tangent = (off > _CHORD * radius) & (off < radius + _TANGENT_MM) & (foot > 0) & (foot < length)
        away = np.hypot(strokes.ends[..., 0] - x, strokes.ends[..., 1] - y).max(axis=1)
        result |= tangent & (length < _CHORD_MM) & (away < radius + _CHORD_PAST_MM)
    return result


def _beside(strokes: Strokes, u: FloatArray, at: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
    """Return a point's distance along each stroke, and beside it; `u` are the strokes' directions."""
    relative = np.array(at) - strokes.ends[:, 0]
    return (relative * u).sum(axis=1), np.abs(relative[:, 0] * u[:, 1] - relative[:, 1] * u[:, 0])


def _holes(seeds: Seeds, where: BoolArray) -> FloatArray:
    """(g, 2) working pixels, middles of paper enclosed by ink, as large and as round as a ring's inside."""
    contours, nested = cv2.findContours(seeds.mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    inner = np.reshape(nested, (-1, 4))[:, 3] >= 0 if contours else ()
    holes = [contours[int(row)] for row in np.flatnonzero(inner)]
    # A hole's contour runs along the ink around it.
    box = np.array([cv2.boundingRect(contour) for contour in holes], dtype=np.float64).reshape(-1, 4)
    left, top, wide, high = (box + np.array([1.0, 1.0, -2.0, -2.0])).T
    longer, shorter = np.maximum(wide, high), np.minimum(wide, high)
    good = (longer < 2.0 * _RADIUS_MM[1] * PX_PER_MM) & (shorter > _LEAST_HOLE_MM * PX_PER_MM)
    good &= longer < _LONG_HOLE * shorter + 1
    middle = np.column_stack([left + (wide - 1) / 2.0, top + (high - 1) / 2.0])[good]
    column, row = np.rint(middle).astype(np.intp).T
    return np.asarray(middle[where[row, column]])


def _meeting_points(seeds: Seeds, where: BoolArray) -> FloatArray:
    """(g, 2) working pixels where many normals of ink borders meet."""
    soft = seeds.soft
    border = seeds.mask - cv2.erode(seeds.mask, np.ones((3, 3), np.uint8))
    inner = border.view(bool) & where
    inner[[0, -1]] = inner[:, [0, -1]] = False
    row, column = np.divmod(np.flatnonzero(inner)[::_EVERY], inner.shape[1])
    gx = _slope(soft, row, column, (0, 1))
    gy = _slope(soft, row, column, (1, 0))
    size = np.hypot(gx, gy)
    strong = size > _EDGE_BYTES
    row, column, ux, uy = row[strong], column[strong], gx[strong] / size[strong], gy[strong] / size[strong]
    out = np.arange(_RADIUS_MM[0] * PX_PER_MM, _RADIUS_MM[1] * PX_PER_MM, 1.0)
    reach = np.concatenate([out, -out]).astype(np.float32) / np.float32(_CELL_PX)
    high, wide = soft.shape[0] // _CELL_PX + 1, soft.shape[1] // _CELL_PX + 1
    x = ((column / np.float32(_CELL_PX))[:, None] + ux[:, None] * reach).astype(np.int32)
    y = ((row / np.float32(_CELL_PX))[:, None] + uy[:, None] * reach).astype(np.int32)
    inside = (x >= 0) & (y >= 0) & (x < wide) & (y < high)
    counted = np.bincount((y * np.int32(wide) + x)[inside], minlength=high * wide).reshape(high, wide)
    votes = np.asarray(cv2.boxFilter(counted.astype(np.float32), -1, (3, 3), normalize=False))
    full = 2.0 * 2.0 * np.pi * _RADIUS_MM[0] * PX_PER_MM * 3.0 * _CELL_PX / _EVERY
    peak = np.asarray(cv2.dilate(votes, np.ones((5, 5), np.uint8)))
    at = np.argwhere(votes > _VOTES * full)
    at = at[votes[at[:, 0], at[:, 1]] == peak[at[:, 0], at[:, 1]]]
    at = at[np.argsort(-votes[at[:, 0], at[:, 1]])][:_MOST]
    return np.asarray((at[:, ::-1] + 0.5) * _CELL_PX, dtype=np.float64)


def _slope(
    soft: GreyImage, row: NDArray[np.intp], column: NDArray[np.intp], step: tuple[int, int]
) -> Float32Array:
    """Contrast's rise per pixel along `step` (rows, columns) at places inside the picture, by Sobel."""
    dy, dx = step
    rise = np.zeros(len(row), dtype=np.int32)
    for aside, weight in ((-1, 1), (0, 2), (1, 1)):
        r, c = row + aside * dx, column + aside * dy
        rise += weight * (soft[r + dy, c + dx].astype(np.int32) - soft[r - dy, c - dx])
    return rise * np.float32(0.25)


def _refined(flat: Flat, centres: FloatArray, px_per_mm: float) -> FloatArray:
    """Circles fitted to the middle of their rings at full resolution, those that fail left out."""
    radial = _RADIAL_MM * px_per_mm
    for round_number in range(_ROUNDS):
        polar = _polar(flat, centres, radial)
        inked = polar > 0.5 * _darkest(polar)[:, None, None]
        if round_number == 0:
            radius = radial[_best_ring(inked.mean(axis=1))]
        middle, good, crossed = _ring_middle(polar, inked, radial, radius, px_per_mm)
        centres, radius, rms = _circle_fit(centres, middle, good)
        drawn = good.sum(axis=1) / np.maximum(_ANGLES - crossed.sum(axis=1), 1)
        last = round_number == _ROUNDS - 1
        sound = (drawn >= (_DRAWN if last else 0.5)) & (good.mean(axis=1) >= (_DRAWN_ALONE if last else 0.35))
        most = np.minimum(_ROUND_MM * px_per_mm, np.hypot(_GRAIN_MM * px_per_mm, _ROUND * radius))
        sound &= rms < (most if last else 2.0 * most)
        sound &= (radius > _RADIUS_MM[0] * px_per_mm) & (radius < _RADIUS_MM[1] * px_per_mm) | (not last)
        centres, radius, inked = centres[sound], radius[sound], inked[sound]
    at = np.searchsorted(radial, _HOLLOW_AT * radius).clip(0, len(radial) - 1)
    inner = np.take_along_axis(inked.mean(axis=1), at[:, None], axis=1)[:, 0]
    return np.column_stack([centres, radius])[inner < _HOLLOW]


def _darkest(polar: FloatArray) -> FloatArray:
    """(g,) contrast that 3 % of the places around each centre pass."""
    flattened = polar.reshape(len(polar), polar.shape[1] * polar.shape[2])
    rank = int(0.97 * (flattened.shape[1] - 1))
    return np.asarray(np.partition(flattened, rank, axis=1)[:, rank])


def _polar(flat: Flat, centres: FloatArray, radial: FloatArray) -> FloatArray:
    """(g, angles, radii) contrast around each centre."""
    angle = np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES)
    x, y = (
        (centres[:, axis, None, None] + turned[:, None] * radial).astype(np.float32)
        for axis, turned in enumerate((np.cos(angle), np.sin(angle)))
    )
    return flat.contrast(x.reshape(-1, len(radial)), y.reshape(-1, len(radial))).reshape(x.shape)


def _best_ring(ring: FloatArray) -> np.ndarray:
    """Index of the radius that is inked all round while half of it is not."""
    inner = ring[:, (np.arange(ring.shape[1]) * 0.6).astype(int)]
    score = ring - 0.7 * inner
    low = int(np.searchsorted(_RADIAL_MM, _RADIUS_MM[0]))
    score[:, :low] = -1.0
    return np.asarray(score.argmax(axis=1))


def _ring_middle(
    polar: FloatArray, inked: BoolArray, radial: FloatArray, radius: FloatArray, px_per_mm: float
) -> tuple[FloatArray, BoolArray, BoolArray]:
    """Distance of the ring's ink near the radius, (g, angles), and where it is known.

    The third array tells where a stroke along the ray hides the ring.
    """
    near = np.abs(radial[None, :] - radius[:, None]) <= 0.45 * px_per_mm
    here = inked & near[:, None, :]
    weight = polar * here
    total = weight.sum(axis=2)
    middle = (weight * radial[None, None, :]).sum(axis=2) / np.maximum(total, 1e-6)
    crossed = here.sum(axis=2) > _THICK * near.sum(axis=1)[:, None]
    good = (total > 0) & ~crossed & (np.abs(middle - radius[:, None]) < 0.3 * px_per_mm)
    return middle, good, crossed


def _circle_fit(
    centres: FloatArray, middle: FloatArray, good: BoolArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """New (centres, radii, rms) by linear least squares: distance = r + dx cos + dy sin."""
    angle = np.arange(_ANGLES) * (2.0 * np.pi / _ANGLES)
    basis = np.column_stack([np.ones(_ANGLES), np.cos(angle), np.sin(angle)])
    weight = good.astype(np.float64)
    normal = np.einsum("ga,ai,aj->gij", weight, basis, basis) + 1e-6 * np.eye(3)
    right = np.einsum("ga,ai->gi", weight * np.where(good, middle, 0.0), basis)
    solved = np.linalg.solve(normal, right[..., None])[..., 0]
    residual = np.where(good, middle - solved @ basis.T, 0.0)
    rms = np.sqrt((residual**2).sum(axis=1) / np.maximum(weight.sum(axis=1), 1.0))
    return centres + solved[:, 1:], solved[:, 0], rms


def _distinct(rings: FloatArray) -> FloatArray:
    keep: list[FloatArray] = []
    for ring in rings:
        if all(np.hypot(*(ring[:2] - other[:2])) > 0.5 * max(ring[2], other[2]) for other in keep):
            keep.append(ring)
    return np.array(keep).reshape(-1, 3)


def _in_letter(rings: FloatArray, components: Components, scale: float) -> BoolArray:
    """Rings whose piece of ink is a letter: small, and larger than the ring."""
    box = components.box_px[components.mark]
    size = box[:, 2:].max(axis=1)
    result = np.zeros(len(rings), dtype=bool)
    for index, (x, y, radius) in enumerate(rings * scale):
        inside = (
            (box[:, 0] <= x - 0.7 * radius)
            & (box[:, 1] <= y - 0.7 * radius)
            & (box[:, 0] + box[:, 2] >= x + 0.7 * radius)
            & (box[:, 1] + box[:, 3] >= y + 0.7 * radius)
        )
        result[index] = bool((inside & (size > 2.0 * radius + 1.3 * PX_PER_MM)).any())
    return result
