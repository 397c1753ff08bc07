"""Find the long lines that are the sheet's edges and frame: every plausible quadrilateral is tried."""

from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from grader.printed.layout import PAGE_MM
from grader.records import FloatArray
from grader.scan.pixels import BoolArray, inverted, mapped, through_corners
from grader.scan.register.fitting import Side, affine_of, affine_params
from grader.scan.register.homography import FRAMES, PAPER, Outline, drawn_ends, title_block_mm
from grader.scan.register.lines import RIDGE, STEP, LongLine
from reference.drawing.canvas import MM_PER_INCH

_LINES_EACH_WAY = 12
"""Number of the longest lines in each direction: a title block adds a few to the four of paper and frame."""
_APART = 0.4
"""Share of the image's width or height: opposite sides of a sheet are farther apart than this."""
_LEAST_LENGTH = 0.4
"""Sides are at least this share of the image's width or height."""
_SCAN_BEND_MM = 1.2
"""A quadrilateral whose corners lie nearer than this to a scanner's map is a scan."""
_MATCH_MM = 2.0
"""A line lies on a side of a model if both its ends are nearer than this."""
_TILT_MM = 2.0
"""A side ruled by hand is askew by less from end to end."""
_UNEQUAL_SE = 0.004
"""Relative difference of a scanner's scales along its two axes."""
_DPI_SE = 0.005
"""Relative error of a stated resolution, with room for copies at a slightly other scale."""
_SCANNED_WITHIN = 0.03
"""A page that is A3 by its stated resolution has that scale, or a copier's, a per cent or two beside it."""
_WINDOW_SE = 0.02
"""Relative error of a resolution that was only guessed by the size of the image."""
_HOPELESS = 12.0
"""A reading with a larger penalty is no longer followed."""
_FLAT = 1e-9
"""Least determinant of a map that can be inverted."""
_CAMERA_SE = 0.015
"""Error of a camera's view by the lines' errors: of the right angle in radians, of the ratio of the axes."""
_MOST_READINGS = 80
"""Readings whose sides are compared with the lines, the best first."""
_BLOCK_MM = 200.0
"""Length of a title block's ruled lines that counts as much as one side that agrees."""
_BLOCK_WORTH = 3.0
"""The title block's ruled lines count as much as three sides that agree."""
_FOCAL = np.geomspace(0.55, 3.0, 12)
"""Focal lengths in units of the image's long side: 20 mm to 108 mm of a full-frame camera."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A reading of the long lines: the map that it implies, and the sides that agree with it."""

    mm_to_px: FloatArray
    perspective: bool
    score: float
    sides: tuple[Side, ...] = ()
    frame: Outline | None = None


@dataclass(frozen=True, slots=True)
class Resolution:
    """The resolution to go by: as stated, or as the image's size and a usual dpi suggest.

    `is_sure` where it is stated, and where the image has exactly A3's pixels by it; `copied` where it is
    that of a copy, whose drawing may be smaller or larger.
    """

    dpi: tuple[float, float]
    stated: bool
    is_sure: bool
    copied: bool = False


def hypotheses(
    lines: list[LongLine], shape: tuple[int, int], resolution: Resolution | None
) -> list[Hypothesis]:
    """The most plausible readings, best first, in each of the four quarter turns.

    Half turns differ by the title block and, where the paper's edges are seen too, by the margins.
    """
    readings: list[Hypothesis] = []
    quads = _quadrilaterals(lines, shape)
    corners = _corners(quads)
    known = resolution if _is_scan(resolution, shape) else None
    for model in (PAPER, *FRAMES):
        for turns in (0, 1):
            turned = np.roll(corners, turns, axis=1)
            possible = np.ones(len(quads), bool) if known is None else _may_be_as_large(turned, model, known)
            for row in np.flatnonzero(possible):
                trust = _kind_trust(model, quads[row])
                if trust > 0.0:
                    readings += _both_ways(turned[row], model, trust, shape, (resolution, known))
    drawn = drawn_ends(lines)
    best = sorted(readings, key=lambda hypothesis: -hypothesis.score)[:_MOST_READINGS]
    return sorted(
        (_agreed(reading, lines, drawn) for reading in best), key=lambda hypothesis: -hypothesis.score
    )


def _agreed(hypothesis: Hypothesis, lines: list[LongLine], drawn: FloatArray) -> Hypothesis:
    """With the sides that agree with it, and its score raised by them and by a title block in its place."""
    sides, frame = match_sides(hypothesis.mm_to_px, lines)
    block = min(title_block_mm(hypothesis.mm_to_px, drawn) / _BLOCK_MM, _BLOCK_WORTH)
    score = hypothesis.score + sum(_worth(side) for side in sides) + block
    return replace(hypothesis, sides=sides, frame=frame, score=score)


def _quadrilaterals(lines: list[LongLine], shape: tuple[int, int]) -> list[tuple[LongLine, ...]]:
    """(left, top, right, bottom) of long lines far enough apart."""
    high, wide = shape
    pairs = []
    for across, own, other in ((False, wide, high), (True, high, wide)):
        long_enough = [
            line for line in lines if line.across == across and line.length > _LEAST_LENGTH * other
        ]
        chosen = []
        for a, b in combinations(long_enough[:_LINES_EACH_WAY], 2):
            at = other / 2.0
            first, second = (a, b) if a.at(at) < b.at(at) else (b, a)
            if second.at(at) - first.at(at) > _APART * own:
                chosen.append((first, second))
        pairs.append(chosen)
    return [(left, top, right, bottom) for left, right in pairs[0] for top, bottom in pairs[1]]


def _kind_trust(model: Outline, quad: tuple[LongLine, ...]) -> float:
    """Return how well the kinds of four lines fit a model: frames are drawn, edges are steps."""
    kinds = [line.kind for line in quad]
    if model is not PAPER:
        return 1.0 if kinds.count(RIDGE) >= 3 else 0.0
    inward = (1, 1, -1, -1)
    if any(line.kind == STEP and line.bright != inner for line, inner in zip(quad, inward, strict=True)):
        return 0.0
    # A copier shows paper edges as thin dark lines: possible, but less telling.
    return 0.5 + 0.1 * kinds.count(STEP)


def _both_ways(
    corners: FloatArray,
    model: Outline,
    trust: float,
    shape: tuple[int, int],
    resolutions: tuple[Resolution | None, Resolution | None],
) -> list[Hypothesis]:
    """Readings of four corners (left top, clockwise) as those of a model, upright and on its head.

    Arguments: `resolutions` to go by, and the one that is known, each None without one.
    """
    resolution, known = resolutions
    map_px = _quad_map(model, corners)
    params = None if map_px is None else affine_params(map_px)
    if map_px is None or params is None or not np.all(np.isfinite(params)):
        return []
    bend = np.abs(mapped(affine_of(params), model.corners()) - mapped(map_px, model.corners())).max()
    perspective = bool(bend / np.exp(params[:2].mean()) > _SCAN_BEND_MM)
    if known is not None and (perspective or not _is_possible(params, known)):
        return []
    penalty = _camera_misfit(map_px, shape) if perspective else _scan_misfit(params, resolution)
    if penalty >= _HOPELESS:
        return []
    ways = (map_px, _quad_map(model, np.roll(corners, 2, axis=0)))
    return [Hypothesis(way, perspective, trust - penalty) for way in ways if way is not None]


def _is_scan(resolution: Resolution | None, shape: tuple[int, int]) -> bool:
    """Return whether the page is A3 by the resolution that its file states, and has the sheet's shape.

    Long lines of a drawing may be taken for a frame; the page itself says that it was scanned as it is. A
    camera's picture seldom has the shape of the sheet.
    """
    is_sheet = abs(np.log(max(shape) / min(shape) * PAGE_MM[1] / PAGE_MM[0])) < _SCANNED_WITHIN
    return resolution is not None and resolution.is_sure and bool(is_sheet)


def _is_possible(params: FloatArray, resolution: Resolution) -> bool:
    """Return whether a map has the scale of a scan of this resolution."""
    off = params[:2] - np.log(np.array(resolution.dpi) / MM_PER_INCH)
    return bool(np.all(np.abs(off) < _SCANNED_WITHIN))


def _may_be_as_large(corners: FloatArray, model: Outline, resolution: Resolution) -> BoolArray:
    """(q,) which corners (q, 4, 2) are far enough apart for such a map: most are not, and need no map."""
    px_per_mm = np.array(resolution.dpi) / MM_PER_INCH
    least, most = px_per_mm.min() * np.exp(-_SCANNED_WITHIN), px_per_mm.max() * np.exp(_SCANNED_WITHIN)
    sides_px, sides_mm = _sides(corners), _sides(model.corners())
    long_enough = sides_px >= least * (sides_mm - 2.0 * _SCAN_BEND_MM)
    return np.asarray(np.all(long_enough & (sides_px <= most * (sides_mm + 2.0 * _SCAN_BEND_MM)), axis=1))


def _sides(corners: FloatArray) -> FloatArray:
    """(..., 4) lengths of the sides from each of four corners (..., 4, 2) to the next."""
    side = np.roll(corners, -1, axis=-2) - corners
    return np.asarray(np.hypot(side[..., 0], side[..., 1]))


def _quad_map(model: Outline, corners: FloatArray) -> FloatArray | None:
    """Homography from a model's corners to pixels; None for corners that span no area."""
    matrix = through_corners(model.corners(), corners)
    good = bool(np.all(np.isfinite(matrix))) and abs(np.linalg.det(matrix)) > _FLAT
    return matrix if good else None


def _corners(quads: list[tuple[LongLine, ...]]) -> FloatArray:
    """(q, 4, 2) where the sides (left, top, right, bottom) meet: left top, and on clockwise."""
    ends = np.array([[line.ends for line in quad] for quad in quads]).reshape(-1, 4, 2, 2)
    level, upright = ends[:, [1, 1, 3, 3]], ends[:, [0, 2, 2, 0]]
    start, through = level[..., 0, :], upright[..., 0, :]
    u, v, apart = level[..., 1, :] - start, upright[..., 1, :] - through, through - start
    share = apart[..., 0] * v[..., 1] - apart[..., 1] * v[..., 0]
    share /= u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
    return np.asarray(start + share[..., None] * u)


def _scan_misfit(params: FloatArray, resolution: Resolution | None) -> float:
    unequal = (params[0] - params[1]) / _UNEQUAL_SE
    penalty = 0.5 * unequal**2
    if resolution is not None:
        se, most = (_DPI_SE, 3.0) if resolution.is_sure and not resolution.copied else (_WINDOW_SE, 1.5)
        wrong = (params[:2] - np.log(np.array(resolution.dpi) / MM_PER_INCH)) / se
        penalty += min(most, 0.25 * float(wrong @ wrong))
    return float(penalty)


def _camera_misfit(mm_to_px: FloatArray, shape: tuple[int, int]) -> float:
    """Return how unlike a photo of a flat sheet a map is.

    The sheet's axes must be at right angles and equal in scale before a camera of some focal length
    (Zhang 2000, principal point at the image's middle).
    """
    high, wide = shape
    long_side = max(high, wide)
    shift = np.array([[1.0, 0.0, -wide / 2.0], [0.0, 1.0, -high / 2.0], [0.0, 0.0, 1.0]])
    h = shift @ mm_to_px
    best = np.inf
    for focal in _FOCAL * long_side:
        ray = h / np.array([[focal], [focal], [1.0]])
        first, second = ray[:, 0], ray[:, 1]
        size = np.linalg.norm(first), np.linalg.norm(second)
        skewed = float(first @ second / (size[0] * size[1]))
        unequal = float(np.log(size[0] / size[1]))
        best = min(best, 0.5 * (skewed / _CAMERA_SE) ** 2 + 0.5 * (unequal / _CAMERA_SE) ** 2)
    return best


def _worth(side: Side) -> float:
    length_mm = PAGE_MM[1 - side.axis]
    return float(np.clip(side.line.length * side.line.inked / max(length_mm, 1.0), 0.0, None) > 0) * (
        1.0 if (side.line.kind == RIDGE) != (side.model is PAPER) else 0.5
    )


def match_sides(mm_to_px: FloatArray, lines: list[LongLine]) -> tuple[tuple[Side, ...], Outline | None]:
    """Long lines that lie on a side of the paper or of one frame, and which frame that is."""
    inverse = inverted(mm_to_px)
    by_model = {model.name: on_sides(inverse, model, lines) for model in (PAPER, *FRAMES)}
    frame = max(FRAMES, key=lambda model: len(by_model[model.name]))
    frame_sides = by_model[frame.name]
    if len(frame_sides) < 2:
        return tuple(by_model[PAPER.name]), None
    return tuple(by_model[PAPER.name] + frame_sides), frame


def on_sides(
    inverse: FloatArray, model: Outline, lines: list[LongLine], within_mm: float = _MATCH_MM
) -> list[Side]:
    """For each side of a model the long line that lies on it best, where one does."""
    if not lines:
        return []
    px = np.stack([line.ends for line in lines])
    mm = mapped(inverse, px)
    brighter = _brighter_mm(inverse, lines, px)
    drawn = np.array([line.kind == RIDGE for line in lines])
    x0, y0, x1, y1 = model.box
    sides: list[Side] = []
    for axis, value, outer in ((0, x0, -1), (1, y0, -1), (0, x1, 1), (1, y1, 1)):
        length = (y1 - y0) if axis == 0 else (x1 - x0)
        along = np.abs(mm[:, 1, 1 - axis] - mm[:, 0, 1 - axis])
        off = np.abs(mm[:, :, axis] - value).max(axis=1)
        fits = (np.abs(mm[:, 1, axis] - mm[:, 0, axis]) <= _TILT_MM) & (off <= within_mm)
        fits &= (along >= 0.5 * length) & (along <= 1.1 * length)
        fits &= drawn if model is not PAPER else drawn | (brighter[:, axis] * outer < 0)
        if fits.any():
            best = int(np.where(fits, off, np.inf).argmin())
            sides.append(Side(lines[best], model, axis, value))
    return sides


def _brighter_mm(inverse: FloatArray, lines: list[LongLine], px: FloatArray) -> FloatArray:
    """(n, 2) the way on the sheet from each line to its bright side; 0 for drawn lines."""
    middle = px.mean(axis=1)
    step = np.array([[0.0, 5.0 * line.bright] if line.across else [5.0 * line.bright, 0.0] for line in lines])
    return mapped(inverse, middle + step) - mapped(inverse, middle)
