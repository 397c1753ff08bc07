"""Which long lines are the sheet's edges and frame: every plausible quadrilateral is tried."""

from dataclasses import dataclass, replace
from itertools import combinations

import cv2
import numpy as np

from grader.records import FloatArray
from grader.sheet.fitting import Side, affine_of, affine_params, apply
from grader.sheet.longlines import RIDGE, STEP, LongLine
from grader.sheet.models import FRAMES, PAGE_MM, PAPER, Model
from grader.sheet.upright import drawn_ends, title_block_mm

_LINES_EACH_WAY = 12
_APART = 0.4
_LEAST_LENGTH = 0.4
"""Sides are at least this share of the image's width or height."""
_SCAN_BEND_MM = 1.2
"""A quadrilateral whose corners lie nearer than this to a scanner's map is a scan."""
_MATCH_MM = 2.0
_TILT_MM = 2.0
_UNEQUAL_SE = 0.004
_DPI_SE = 0.005
_CAMERA_SE = 0.015
_LOOKED_AT = 40
_BLOCK_MM = 200.0
_BLOCK_WORTH = 3.0
"""The title block's ruled lines count as much as three sides that agree."""
_FOCAL = np.geomspace(0.55, 3.0, 12)
"""Focal lengths in units of the image's long side: 20 mm to 108 mm of a full-frame camera."""


@dataclass(frozen=True, slots=True)
class Hypothesis:
    """A reading of the long lines: the map that it implies, and the sides that agree with it."""

    mm_to_px: FloatArray
    sides: tuple[Side, ...]
    frame: Model | None
    perspective: bool
    score: float
    block_mm: float = 0.0


def hypotheses(
    lines: list[LongLine], shape: tuple[int, int], dpi: tuple[float, float] | None
) -> list[Hypothesis]:
    """All plausible readings, best first, in each of the four quarter turns.

    Half turns differ by the title block and, where the paper's edges are seen too, by the margins.
    """
    found: list[Hypothesis] = []
    for quad in _quadrilaterals(lines, shape):
        kinds = [line.kind for line in quad]
        for model in (PAPER, *FRAMES):
            trust = _kind_trust(model, quad, kinds)
            if trust <= 0.0:
                continue
            for turns in range(4):
                hypothesis = _judged(quad, model, lines, shape, dpi, trust, turns)
                if hypothesis is not None:
                    found.append(hypothesis)
    drawn = drawn_ends(lines)
    best = sorted(found, key=lambda hypothesis: -hypothesis.score)[:_LOOKED_AT]
    judged = [
        replace(hypothesis, block_mm=block, score=hypothesis.score + min(block / _BLOCK_MM, _BLOCK_WORTH))
        for hypothesis in best
        for block in [title_block_mm(hypothesis.mm_to_px, drawn)]
    ]
    return sorted(judged, key=lambda hypothesis: -hypothesis.score)


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


def _kind_trust(model: Model, quad: tuple[LongLine, ...], kinds: list[str]) -> float:
    """How well the looks of four lines fit a model: frames are drawn, edges are steps."""
    if model is not PAPER:
        return 1.0 if kinds.count(RIDGE) >= 3 else 0.0
    inward = {0: 1, 1: 1, 2: -1, 3: -1}
    outward_bright = any(
        line.kind == STEP and line.bright != inward[index] for index, line in enumerate(quad)
    )
    # A copier shows paper edges as thin dark lines: possible, but less telling.
    return 0.0 if outward_bright else 0.6 + 0.1 * kinds.count(STEP)


def _judged(  # noqa: PLR0913
    quad: tuple[LongLine, ...],
    model: Model,
    lines: list[LongLine],
    shape: tuple[int, int],
    dpi: tuple[float, float] | None,
    trust: float,
    turns: int,
) -> Hypothesis | None:
    corners = np.roll(_corners(quad), turns, axis=0)
    mm_to_px = cv2.getPerspectiveTransform(
        model.corners().astype(np.float32), corners.astype(np.float32)
    ).astype(np.float64)
    if not np.all(np.isfinite(mm_to_px)) or abs(np.linalg.det(mm_to_px)) < 1e-9:
        return None
    params = affine_params(mm_to_px)
    if not np.all(np.isfinite(params)):
        return None
    bend = np.abs(apply(affine_of(params), model.corners()) - apply(mm_to_px, model.corners())).max()
    px_per_mm = float(np.exp(params[:2].mean()))
    perspective = bool(bend / px_per_mm > _SCAN_BEND_MM)
    penalty = _camera_misfit(mm_to_px, shape) if perspective else _scan_misfit(params, dpi)
    if penalty > 12.0:
        return None
    sides, frame = match_sides(mm_to_px, lines)
    score = trust + sum(_worth(side) for side in sides) - penalty
    return Hypothesis(mm_to_px, sides, frame, perspective, score)


def _corners(quad: tuple[LongLine, ...]) -> FloatArray:
    left, top, right, bottom = quad
    return np.array([_meet(top, left), _meet(top, right), _meet(bottom, right), _meet(bottom, left)])


def _meet(a: LongLine, b: LongLine) -> FloatArray:
    p, u = a.ends[0], a.ends[1] - a.ends[0]
    q, v = b.ends[0], b.ends[1] - b.ends[0]
    s = np.linalg.solve(np.column_stack([u, -v]), q - p)
    return np.asarray(p + s[0] * u)


def _scan_misfit(params: FloatArray, dpi: tuple[float, float] | None) -> float:
    unequal = (params[0] - params[1]) / _UNEQUAL_SE
    penalty = 0.5 * unequal**2
    if dpi is not None:
        wrong = (params[:2] - np.log(np.array(dpi) / 25.4)) / _DPI_SE
        penalty += min(3.0, 0.5 * float(wrong @ wrong) / 2.0)
    return float(penalty)


def _camera_misfit(mm_to_px: FloatArray, shape: tuple[int, int]) -> float:
    """How unlike a photo of a flat sheet: the two sheet axes must be at right angles and equal in scale
    before a camera of some focal length (Zhang 2000, principal point at the image's middle)."""
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
        1.0 if side.line.kind == RIDGE or side.model is PAPER else 0.4
    )


def match_sides(mm_to_px: FloatArray, lines: list[LongLine]) -> tuple[tuple[Side, ...], Model | None]:
    """Long lines that lie on a side of the paper or of one frame, and which frame that is."""
    inverse = np.linalg.inv(mm_to_px)
    by_model = {model.name: on_sides(inverse, model, lines) for model in (PAPER, *FRAMES)}
    frame = max(FRAMES, key=lambda model: len(by_model[model.name]))
    frame_sides = by_model[frame.name]
    if len(frame_sides) < 2:
        return tuple(by_model[PAPER.name]), None
    return tuple(by_model[PAPER.name] + frame_sides), frame


def on_sides(
    inverse: FloatArray, model: Model, lines: list[LongLine], within_mm: float = _MATCH_MM
) -> list[Side]:
    """For each side of a model the long line that lies on it best, where one does."""
    x0, y0, x1, y1 = model.box
    found: list[Side] = []
    for axis, value, outer in ((0, x0, -1), (1, y0, -1), (0, x1, 1), (1, y1, 1)):
        length = (y1 - y0) if axis == 0 else (x1 - x0)
        best: tuple[float, Side] | None = None
        for line in lines:
            ends = apply(inverse, line.ends)
            along = abs(ends[1, 1 - axis] - ends[0, 1 - axis])
            if abs(ends[1, axis] - ends[0, axis]) > _TILT_MM:
                continue
            off = float(np.abs(ends[:, axis] - value).max())
            if off > within_mm or along < 0.5 * length or along > 1.1 * length:
                continue
            if model is not PAPER and line.kind != RIDGE:
                continue
            if line.kind == STEP and not _bright_inside(inverse, line, axis, outer):
                continue
            if best is None or off < best[0]:
                best = (off, Side(line, model, axis, value))
        if best is not None:
            found.append(best[1])
    return found


def _bright_inside(inverse: FloatArray, line: LongLine, axis: int, outer: int) -> bool:
    middle = line.ends.mean(axis=0)
    step = np.array([0.0, 1.0]) if line.across else np.array([1.0, 0.0])
    two = apply(inverse, np.array([middle, middle + 5.0 * line.bright * step]))
    return bool((two[1, axis] - two[0, axis]) * outer < 0)
