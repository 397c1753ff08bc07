"""Registration of a plain sheet by frame, paper and stated resolution, weighed together."""

from dataclasses import dataclass

import numpy as np

from grader.pixels import flatten
from grader.records import FloatArray, Page, Problem, Sheet, Unread
from grader.sheet.fitting import Fit, affine_of, apply, fit_sides
from grader.sheet.hypotheses import Hypothesis, hypotheses
from grader.sheet.longlines import LongLine, long_lines
from grader.sheet.models import PAGE_MM, Model, drawable
from grader.sheet.upright import title_block_mm

_MM_PER_INCH = 25.4
_LEAST_PX_PER_MM = 3.0
_USUAL_DPI = (100.0, 150.0, 200.0, 240.0, 250.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1200.0)
_UNSET_DPI = (72.0, 96.0)
"""What programs write when they do not know; no evidence either way."""
_A3_SLACK_MM = (16.0, 14.0)
"""A scanner's window may be this much larger than the sheet; paper that is cut off is not A3."""
_A3_SHORT_MM = 5.0
_WINDOW_SE = 0.004
_DPI_OFF = 0.02
_BAD_FIT = 4.0
_FAR_OFF_MM = 1.5
_ASSUMED_PAPER_SE = 0.004


@dataclass(frozen=True, slots=True)
class Resolution:
    """The resolution to start from: as stated, or as the image's size and a usual dpi suggest."""

    dpi: tuple[float, float]
    stated: bool


def register_plain(page: Page) -> Sheet | Unread:
    """The map of a plain sheet, or why there is none."""
    long_px = max(page.grey.shape)
    if long_px < _LEAST_PX_PER_MM * PAGE_MM[0]:
        return Unread("sheet", f"{long_px} pixels along the long side are too few for an A3 drawing")
    lines = long_lines(flatten(page.grey))
    problems: list[Problem] = []
    resolution = _resolution(page, problems)
    dpi = resolution.dpi if resolution is not None and resolution.stated else None
    shape = (page.grey.shape[0], page.grey.shape[1])
    ranked = hypotheses(lines, shape, dpi)
    if ranked:
        return _from_lines(page, ranked[0], lines, dpi, problems)
    if resolution is None:
        return Unread("sheet", "no drawing frame, no paper edges and no resolution that fits A3 were found")
    return _from_resolution(page, resolution, lines, problems)


def _resolution(page: Page, problems: list[Problem]) -> Resolution | None:
    """The stated resolution where the page is about A3 by it, else a usual one by which it is."""
    if page.dpi is not None and _is_a3(page, page.dpi):
        return Resolution(page.dpi, stated=True)
    if page.dpi is not None and page.dpi[0] not in _UNSET_DPI:
        size = " x ".join(
            f"{n / d * _MM_PER_INCH:.0f}" for n, d in zip(page.grey.shape[::-1], page.dpi, strict=True)
        )
        problems.append(
            Problem(
                "resolution_wrong", f"by its stated resolution the page is {size} mm, not A3", page.source
            )
        )
    for usual in _USUAL_DPI:
        if _is_a3(page, (usual, usual)):
            return Resolution((usual, usual), stated=False)
    return None


def _is_a3(page: Page, dpi: tuple[float, float]) -> bool:
    high, wide = page.grey.shape
    size = sorted((wide / dpi[0] * _MM_PER_INCH, high / dpi[1] * _MM_PER_INCH), reverse=True)
    return all(
        -_A3_SHORT_MM <= found - wanted <= slack
        for found, wanted, slack in zip(size, PAGE_MM, _A3_SLACK_MM, strict=True)
    )


def _from_lines(
    page: Page,
    best: Hypothesis,
    lines: list[LongLine],
    dpi: tuple[float, float] | None,
    problems: list[Problem],
) -> Sheet | Unread:
    fit, frame = _settled(best, dpi), best.frame
    block_mm = title_block_mm(fit.mm_to_px, lines)
    if block_mm == 0.0:
        problems.append(
            Problem("upright_unsure", "no title block shows which way up the sheet is", page.source)
        )
    if frame is None and block_mm == 0.0 and dpi is None:
        return Unread("sheet", "neither a drawing frame nor a title block shows that this is an A3 drawing")
    if fit.freedom > 0 and fit.chi2 / fit.freedom > _BAD_FIT:
        message = f"frame, paper and resolution disagree by {fit.rms_mm:.1f} mm"
        problems.append(Problem("registration_disagrees", message, page.source))
    scale_se = fit.scale_se
    if frame is None and dpi is None:
        scale_se = float(np.hypot(scale_se, _ASSUMED_PAPER_SE))
        problems.append(
            Problem("paper_assumed", "only the paper's edges give the scale; taken for A3", page.source)
        )
    return _sheet(fit, frame, scale_se, problems)


def _settled(best: Hypothesis, dpi: tuple[float, float] | None) -> Fit:
    """Refit with the sides that agree; a side far off after the fit is dropped, once."""
    sides = list(best.sides)
    fit = fit_sides(best.mm_to_px, sides, dpi, perspective=best.perspective)
    keep = [side for side, off in zip(sides, fit.side_mm, strict=True) if abs(off) < _FAR_OFF_MM]
    return (
        fit if len(keep) == len(sides) else fit_sides(fit.mm_to_px, keep, dpi, perspective=best.perspective)
    )


def _from_resolution(
    page: Page, resolution: Resolution, lines: list[LongLine], problems: list[Problem]
) -> Sheet | Unread:
    """Scale from the resolution alone, skew from ruled lines, place from the image's middle."""
    high, wide = page.grey.shape
    tilt = _tilt(lines)
    quarter = 0.0 if wide >= high else np.pi / 2.0
    best: tuple[float, FloatArray] | None = None
    for half in (0.0, np.pi):
        angle = tilt + quarter + half
        params = np.array([*np.log(np.array(resolution.dpi) / _MM_PER_INCH), angle, wide / 2.0, high / 2.0])
        matrix = affine_of(params)
        block = title_block_mm(matrix, lines)
        if best is None or block > best[0]:
            best = (block, matrix)
    assert best is not None
    block, matrix = best
    if block == 0.0 and not resolution.stated:
        return Unread(
            "sheet", "no drawing frame, no title block and no stated resolution: not known to be A3"
        )
    if block == 0.0:
        problems.append(
            Problem("upright_unsure", "no title block shows which way up the sheet is", page.source)
        )
    if not resolution.stated:
        message = f"no stated resolution: {resolution.dpi[0]:.0f} dpi assumed, by which the page is A3"
        problems.append(Problem("resolution_assumed", message, page.source))
    problems.append(
        Problem("frame_missing", "no drawing frame: the place on the sheet is rough", page.source)
    )
    scale_se = 0.0015 if resolution.stated else _WINDOW_SE
    fit = Fit(matrix, 0.0, 0, 0.0, scale_se, np.zeros(0))
    return _sheet(fit, None, scale_se, problems)


def _tilt(lines: list[LongLine]) -> float:
    """Weighted median tilt of the long lines from the image's axes, radians."""
    angles, weights = [], []
    for line in lines:
        d = line.ends[1] - line.ends[0]
        angle = np.arctan2(d[1], d[0]) if line.across else -np.arctan2(d[0], d[1])
        if abs(angle) < np.radians(5.0):
            angles.append(float(angle))
            weights.append(line.length * line.inked)
    if not angles:
        return 0.0
    order = np.argsort(angles)
    cumulated = np.cumsum(np.array(weights)[order])
    return float(np.array(angles)[order][np.searchsorted(cumulated, cumulated[-1] / 2.0)])


def _sheet(fit: Fit, frame: Model | None, scale_se: float, problems: list[Problem]) -> Sheet:
    matrix = fit.mm_to_px / fit.mm_to_px[2, 2]
    middle = np.array([[PAGE_MM[0] / 2.0, PAGE_MM[1] / 2.0]])
    right = apply(matrix, middle + [10.0, 0.0]) - apply(matrix, middle)
    down = apply(matrix, middle + [0.0, 10.0]) - apply(matrix, middle)
    px_per_mm = float(np.sqrt(abs(right[0, 0] * down[0, 1] - right[0, 1] * down[0, 0])) / 10.0)
    # Seen with y down, the sheet's x axis points at this angle; turning back by it is counter-clockwise.
    rotation = float(np.degrees(np.arctan2(right[0, 1], right[0, 0])))
    return Sheet(
        mm_to_px=matrix,
        page_mm=PAGE_MM,
        method="combined",
        px_per_mm=px_per_mm,
        rotation_deg=rotation % 360.0,
        residual_mm=fit.rms_mm,
        scale_se=scale_se,
        drawable_mm=drawable(frame),
        problems=tuple(problems),
    )
