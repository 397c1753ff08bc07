"""Registration of a page: by the markers of an answer sheet, else by frame, borders and grid.

Evidence that disagrees or is missing becomes a problem of the sheet. The most likely hypothesis of the
sheet's size and pose is taken; where none is sure enough, the page is refused.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from grader.printed.layout import PAGE_MM
from grader.records import FloatArray, Identity, Page, Reason, Sheet, Unread, Value
from grader.scan.pixels import (
    Flat,
    flatten,
    inverted,
    is_black_and_white,
    local_axes,
    mapped,
    through_corners,
)
from grader.scan.register import markers
from grader.scan.register.distortion import find_lens
from grader.scan.register.fitting import Fit, affine_of, affine_params, fit_sides
from grader.scan.register.homography import (
    PAPER,
    Outline,
    drawable,
    drawn_ends,
    looks_a4,
    off_turn_deg,
    rotation_deg,
    size_mm,
    title_block_mm,
)
from grader.scan.register.hypotheses import Hypothesis, Resolution, hypotheses, match_sides, on_sides
from grader.scan.register.lines import LongLine, long_lines
from grader.scan.register.markers import identify
from reference.drawing.canvas import MM_PER_INCH

_LEAST_IN_PICTURE = 0.95
"""Share of the drawing area below which the picture shows a part of the sheet only."""
_BESIDE_MM = 3.0
"""A place so far beside the picture still counts: the map's own error, and a frame cut close."""


def register(
    page: Page, corners_px: Sequence[tuple[float, float]] = ()
) -> tuple[Sheet | Unread, Identity | None]:
    """The page's map from millimetres to pixels, or why there is none; and whose page it is by its code.

    A sheet with the problem `scale_unknown` is one only if its drawing bears the scale out.

    A printed sheet's code is searched in its place; on other pages only a reduced picture is searched.

    Arguments: `corners_px` of the sheet, as in `PageRef`, where a person gave them: then they are taken.
    """
    printed = markers.register(page)
    identity = (None if printed is None else printed.identity) or identify(page)
    if corners_px:
        return printed or register_by_corners(page, corners_px), identity
    sheet = printed or _by_squares(page, register_plain(page))
    is_open = isinstance(sheet, Unread) or any(problem.code == "scale_unknown" for problem in sheet.problems)
    if is_open and _shows_two(page):
        return _refused("two_sheets"), identity
    if isinstance(sheet, Unread):
        return (_with_halves(sheet) if looks_a4(page) else sheet), identity
    share = _share_in_picture(page, sheet)
    if share < _LEAST_IN_PICTURE:
        return _with_halves(_refused("part_in_picture", share_percent=round(100.0 * share))), identity
    return sheet, identity


def _why(why: str, **known: Value) -> Reason:
    """Return the reason why a sheet cannot be placed, by the code of its clause and the values in it."""
    return Reason("sheet_refused", {"why": why, **known})


def _refused(why: str, **known: Value) -> Unread:
    return Unread("sheet", _why(why, **known))


def _with_halves(sheet: Unread) -> Unread:
    """The same, with what to do about a sheet that was scanned in two halves."""
    reason = sheet.reason
    return replace(sheet, reason=replace(reason, parameters={**reason.parameters, "advice": "halves"}))


def _shows_two(page: Page) -> bool:
    """Return whether each half of a picture has the whole frame of a sheet."""
    return any(
        all(
            isinstance(sheet := register_plain(replace(page, grey=half.copy(), ruling=None)), Sheet)
            and _FRAMELESS.isdisjoint(problem.code for problem in sheet.problems)
            for half in np.array_split(page.grey, 2, axis)
        )
        for axis in (0, 1)
    )


def rectify(page: Page) -> Sheet | Unread:
    """The page's map from millimetres to pixels; Unread with the reason where there is none."""
    return register(page)[0]


def _share_in_picture(page: Page, sheet: Sheet) -> float:
    """Share of the drawing area that lies in the picture."""
    x, y, wide, high = sheet.drawable_mm
    mm = np.stack(np.meshgrid(np.linspace(x, x + wide, 31), np.linspace(y, y + high, 21)), axis=-1)
    at = mapped(sheet.mm_to_px, mm)
    beside = _BESIDE_MM * sheet.px_per_mm
    return float(np.mean(np.all((at > -beside) & (at < page.grey.shape[::-1] + np.array(beside)), axis=-1)))


def _by_squares(page: Page, sheet: Sheet | Unread) -> Sheet | Unread:
    """A plain sheet, its printed squares a second witness of the scale; Unread where no paper has such."""
    if isinstance(sheet, Unread) or page.ruling is None:
        return sheet
    middle = (np.array([page.grey.shape[::-1]]) - 1.0) / 2.0
    right, down = local_axes(sheet.mm_to_px, mapped(inverted(sheet.mm_to_px), middle))
    lines_per_mm = page.ruling.lines_per_px @ np.vstack([right, down]).T
    pitch = float(np.exp(-np.log(np.hypot(*lines_per_mm.T)).mean()))
    usual = _PITCHES_MM[np.abs(np.log(pitch / _PITCHES_MM)).argmin()]
    off = float(np.log(pitch / usual))
    if abs(off) > _PITCH_WITHIN:
        return _refused("odd_squares", pitch_mm=pitch)
    told = Reason("squared_paper", {"pitch_mm": float(usual)}, page.source)
    sheet = replace(sheet, problems=(*sheet.problems, told))
    if abs(off) > _PITCH_AGREES * np.hypot(sheet.scale_se, _PITCH_SE):
        return sheet
    gain = sheet.scale_se**2 / (sheet.scale_se**2 + _PITCH_SE**2)
    return sheet.longer(float(np.exp(-gain * off)), float(sheet.scale_se * np.sqrt(1.0 - gain)))


# Plain sheets -------------------------------------------------------------------------------------

_LEAST_PX_PER_MM = 3.0
"""Along the long side: below this a pencil's stroke is less than a pixel wide."""
_USUAL_DPI = (100.0, 150.0, 200.0, 240.0, 250.0, 300.0, 400.0, 500.0, 600.0, 800.0, 1200.0)
"""Resolutions that scanners and copiers for A3 offer."""
_DEFAULT_DPI = (72.0, 96.0)
"""The value that programs write if they do not know the resolution; it is no evidence."""
_DPI_ROUNDING = 0.5
"""PNG stores pixels a metre, TIFF fractions: 72 may come back as 72.009."""
_WINDOW_SHAPE = 0.03
"""Tolerance of the logarithm of the sides' ratio for A3 scanners; cameras (4:3, 3:2) differ by 0.06."""
_SCANNED_SE = 0.008
"""Largest relative error of a scale: of a scanner 0.2 %, of a frame ruled by hand to a millimetre, thrice."""
_EDGE_SE = 0.002
"""Relative error of a stated resolution: edges that ask for another scale are none."""
_SAME_PX = 2.0
"""Scanners round A3's size in pixels up or down."""
_A3_SLACK_MM = (40.0, 22.0)
"""A scanner's window may be this much larger than the sheet; paper that is cut off is not A3."""
_A3_SHORT_MM = 5.0
"""A scanner may cut so much off the sheet's edges."""
_WINDOW_SE = 0.004
"""Relative error of a scale by a usual resolution that fits A3."""
_BAD_FIT = 4.0
"""Chi squared for each degree of freedom from which the evidence is said to disagree."""
_NO_FIT_MM = 1.5
"""Sides that disagree by more are not those of one A3 sheet."""
_VAGUE_SE = 0.02
"""A scale less sure than this is no better than a guess."""
_MOST_SIDES, _SOME_SIDES = 3, 2
"""A frame is known by three of its sides, if two sides of the paper are found too."""
_ALL_SIDES = 4
_COPY_SE = 0.02
"""Copiers enlarge or reduce by a per cent or two by default, to make a page fit by up to four."""
_PITCHES_MM = np.array([1.0, 2.0, 2.5, 4.0, 5.0, 6.35, 7.0, 8.0, 10.0])
"""Pitches of printed squares: pads, millimetre paper, quarter inches, French and double squares."""
_PITCH_WITHIN = 0.03
"""Printers and copiers change sizes by a per cent or two."""
_PITCH_SE = 0.004
"""Relative error of printed squares: those of three real pads were 0.1 to 0.4 per cent off."""
_PITCH_AGREES = 3.0
"""Standard errors; where scale and squares are farther apart, the pad is none of these, or a copy."""
_UNKNOWN_SE = 0.03
"""A page is about as large as this says, if it is an A3 sheet at all: to be borne out by its drawing."""
_CUT_OFF_MM = 60.0
"""A scanner's window may be so much smaller than the sheet."""
_FAR_OFF_MM = 1.5
"""A side farther off after the fit was taken for the wrong line."""
_EDGE_WITHIN_MM = 6.0
"""Without a frame the sheet's place is known no better before its edges are looked for."""
_TILT_SE = float(np.radians(1.0))
"""Standard error of the angle at which a sheet lies on a scanner's glass."""
_LEVEL_SE, _LEVEL_PEAK = float(np.radians(0.1)), 40.0
"""Standard error of lines that are ruled level, and by how much such a slope is likelier among them than any
one slope of links and vectors, of which as many lie within 5 degrees of the axes."""
_LEVEL_WITHIN = 3.0
"""Standard errors within which a line is one of the level ones."""
_ASSUMED_PAPER_SE = 0.004
"""Paper that looks like A3 may be a trimmed sheet or another format of nearly its ratio."""
_SCALE_DOUBTS = frozenset({"paper_assumed", "registration_disagrees"})
_FRAMELESS = frozenset({"paper_assumed", "frame_missing"})
_SAME = 1e-6
"""Scores of readings that the drawing does not tell apart differ by rounding only."""
_AS_LIKELY = 2.0
"""Scores of readings that differ by less: either may be the right one."""
_ANOTHER_SCALE = 0.012
"""Relative difference of two scales that is worth a warning."""
_NEAR_TURN_DEG = 45.0
"""A quarter turn that a person gave is the nearest one."""


def register_plain(page: Page) -> Sheet | Unread:
    """The map of a plain sheet, or why there is none."""
    long_px = max(page.grey.shape)
    if long_px < _LEAST_PX_PER_MM * PAGE_MM[0]:
        return _refused("too_few_pixels", long_side=long_px)
    flat = flatten(page.grey)
    shape = (page.grey.shape[0], page.grey.shape[1])
    lines = long_lines(flat)
    problems: list[Reason] = []
    resolution = _resolution(page, problems)
    dpi = resolution.dpi if resolution is not None and resolution.is_sure else None
    # Copiers send black and white pages: the drawing on one may be of any size.
    copied = is_black_and_white(page.grey)
    if resolution is not None and copied:
        resolution = replace(resolution, copied=True)
    ranked = hypotheses(lines, shape, resolution)
    if page.turn_is_sure:
        ranked = [
            reading for reading in ranked if off_turn_deg(reading.mm_to_px, page.turn_deg) < _NEAR_TURN_DEG
        ]
    if dpi is not None and not copied:
        ranked = _as_scanned(ranked, dpi)
    if ranked:
        if dpi is None and resolution is not None and _passes_for_frame(ranked, resolution.dpi):
            return _from_resolution(page, resolution, lines, problems)
        rival = None if dpi is not None and not copied else _rival_scale(ranked)
        best = _turned_as_stated(ranked, page.turn_deg)
        told = list(problems)
        sheet = _from_lines(page, best, lines, dpi, told)
        if isinstance(sheet, Unread) and resolution is not None:
            doubt = None if resolution.is_sure else sheet.reason
            return _from_resolution(page, resolution, lines, problems, doubt)
        if isinstance(sheet, Sheet) and rival is not None:
            sheet = _with_rival(sheet, rival)
        if isinstance(sheet, Unread) or not best.perspective:
            return sheet
        return _with_lens(flat, sheet, best)
    if resolution is None:
        return _refused("nothing_found")
    return _from_resolution(page, resolution, lines, problems)


def _as_scanned(ranked: list[Hypothesis], dpi: tuple[float, float]) -> list[Hypothesis]:
    """The readings that have the stated scale along both axes; without one, whole frames at one other scale.

    Lines of a drawing, a frame of another standard or a shadow may be taken for the sheet's sides. A copy
    that was scanned has a whole frame, larger or smaller along both axes alike.
    """
    off = [affine_params(reading.mm_to_px)[:2] - np.log(np.array(dpi) / MM_PER_INCH) for reading in ranked]
    stated = [reading for reading, axes in zip(ranked, off, strict=True) if np.abs(axes).max() < _SCANNED_SE]
    return stated or [
        reading
        for reading, axes in zip(ranked, off, strict=True)
        if abs(axes[0] - axes[1]) < _SCANNED_SE / 2.0
        and sum(side.model is not PAPER for side in reading.sides) == _ALL_SIDES
    ]


def _passes_for_frame(ranked: list[Hypothesis], dpi: tuple[float, float]) -> bool:
    """Return whether the best reading has an unusual resolution, and one about as likely a usual one.

    The edges of paper that fills a scanner's window may pass for a frame.
    """
    middle = float(np.log(np.array(dpi) / MM_PER_INCH).mean())
    likely = [reading for reading in ranked if reading.score > ranked[0].score - _AS_LIKELY]
    usual = [abs(np.log(_px_per_mm(one.mm_to_px, 1.0)) - middle) < _ANOTHER_SCALE for one in likely]
    return any(usual) and not usual[0]


def _turned_as_stated(ranked: list[Hypothesis], turn_deg: int) -> Hypothesis:
    """The best reading; of the half turns that the drawing does not tell apart, the one the file asks for."""
    best = [reading for reading in ranked if reading.score > ranked[0].score - _SAME]
    return min(best, key=lambda reading: off_turn_deg(reading.mm_to_px, turn_deg))


def _rival_scale(ranked: list[Hypothesis]) -> float | None:
    """Return the relative difference of the scale by a reading about as likely as the best; None if small.

    A sheet's edge may pass for a frame, their sides are nearly in the same ratio; a stated resolution
    tells them apart.
    """
    likely = [reading for reading in ranked if reading.score > ranked[0].score - _AS_LIKELY]
    scales = np.log([_px_per_mm(reading.mm_to_px, 1.0) for reading in likely])
    off = float(np.abs(scales - scales[0]).max())
    return off if off > _ANOTHER_SCALE else None


def _px_per_mm(mm_to_px: FloatArray, step_mm: float) -> float:
    """The mean resolution at the sheet's middle."""
    (right,), (down,) = local_axes(mm_to_px, np.array([PAGE_MM]) / 2.0, step_mm)
    return float(np.sqrt(abs(right[0] * down[1] - right[1] * down[0])))


def _with_rival(sheet: Sheet, rival: float) -> Sheet:
    file = sheet.problems[0].file if sheet.problems else None
    problem = Reason("registration_disagrees", {"rival_percent": round(100.0 * rival)}, file)
    scale_se = float(np.hypot(sheet.scale_se, rival))
    return replace(sheet, scale_se=scale_se, problems=(*sheet.problems, problem))


def _resolution(page: Page, problems: list[Reason]) -> Resolution | None:
    """The stated resolution where the page is about A3 by it, else a usual one by which it is.

    An image of exactly A3's pixels at a usual resolution comes from a scanner that was set to both.
    """
    if page.dpi is not None and _is_a3(page, page.dpi):
        return Resolution(page.dpi, stated=True, is_sure=True)
    if page.dpi is not None and not np.isclose(page.dpi[0], _DEFAULT_DPI, atol=_DPI_ROUNDING).any():
        high, wide = page.grey.shape
        size = {
            "wide_mm": round(wide / page.dpi[0] * MM_PER_INCH),
            "high_mm": round(high / page.dpi[1] * MM_PER_INCH),
        }
        problems.append(Reason("resolution_wrong", size, page.source))
        if _is_cut_off(page, page.dpi):
            return Resolution(page.dpi, stated=True, is_sure=False)
    high, wide = page.grey.shape
    has_shape = abs(np.log(max(high, wide) / min(high, wide) * PAGE_MM[1] / PAGE_MM[0])) < _WINDOW_SHAPE
    for usual in _USUAL_DPI if has_shape else ():
        if _is_a3(page, (usual, usual)):
            larger_px = np.subtract(size_mm(page, (usual, usual)), PAGE_MM) * usual / MM_PER_INCH
            is_exact = bool(np.abs(larger_px).max() < _SAME_PX)
            return Resolution((usual, usual), stated=False, is_sure=is_exact)
    return None


def _is_cut_off(page: Page, dpi: tuple[float, float]) -> bool:
    """Return whether by a resolution a page may be A3 with its borders cut off."""
    larger = np.subtract(size_mm(page, dpi), PAGE_MM)
    return bool(np.all((larger >= -_CUT_OFF_MM) & (larger <= _A3_SLACK_MM))) and not looks_a4(page)


def _is_a3(page: Page, dpi: tuple[float, float]) -> bool:
    larger = np.subtract(size_mm(page, dpi), PAGE_MM)
    return bool(np.all((larger >= -_A3_SHORT_MM) & (larger <= _A3_SLACK_MM)))


def _from_lines(
    page: Page,
    best: Hypothesis,
    lines: list[LongLine],
    dpi: tuple[float, float] | None,
    problems: list[Reason],
) -> Sheet | Unread:
    copied = is_black_and_white(page.grey)
    try:
        fit, frame = _settled(best, dpi, copied=copied), best.frame
    except np.linalg.LinAlgError:
        return _refused("no_one_sheet")
    block_mm = title_block_mm(fit.mm_to_px, drawn_ends(lines))
    stated_a3 = page.dpi is not None and page.dpi == dpi
    doubt = _doubt(best, fit, block_mm, stated_a3=stated_a3, stated_other=bool(problems))
    if doubt is None and dpi is not None and not copied and _is_at_another_scale(fit, dpi, block_mm):
        doubt = _why("other_scale")
    if doubt is not None:
        return Unread("sheet", doubt)
    if block_mm == 0.0 and not page.turn_is_sure:
        problems.append(_unsure_upright(page))
    if fit.freedom > 0 and fit.chi2 / fit.freedom > _BAD_FIT:
        problems.append(Reason("registration_disagrees", {"off_mm": float(fit.rms_mm)}, page.source))
    scale_se = fit.scale_se
    if frame is None and dpi is None:
        scale_se = float(np.hypot(scale_se, _ASSUMED_PAPER_SE))
        problems.append(Reason("paper_assumed", {}, page.source))
    if copied and sum(side.model is not PAPER for side in best.sides) < _ALL_SIDES:
        scale_se = float(np.hypot(scale_se, _COPY_SE))
    return _sheet(fit, frame, scale_se, problems)


def _doubt(
    best: Hypothesis, fit: Fit, block_mm: float, *, stated_a3: bool, stated_other: bool
) -> Reason | None:
    """Return the reason why the lines found do not determine the sheet, or None.

    Arguments: whether by its stated resolution the page is A3, or something else.
    """
    of_frame = sum(side.model is not PAPER for side in best.sides)
    of_paper = len(best.sides) - of_frame
    both = of_frame >= _MOST_SIDES and of_paper >= _SOME_SIDES
    if not np.isfinite(fit.scale_se) or fit.scale_se > _VAGUE_SE:
        return _why("scale_open")
    if fit.freedom > 0 and fit.rms_mm > _NO_FIT_MM:
        return _why("edges_disagree", off_mm=float(fit.rms_mm))
    if block_mm == 0.0 and not stated_a3 and not both:
        return _why("nothing_shows_a3")
    if stated_other and not (of_frame >= _MOST_SIDES and block_mm > 0.0):
        return _why("stated_not_a3")
    return None


def _is_at_another_scale(fit: Fit, dpi: tuple[float, float], block_mm: float) -> bool:
    """Return whether a fit has another scale than a scanner's resolution and does not look like a copy."""
    off = np.abs(affine_params(fit.mm_to_px)[:2] - np.log(np.array(dpi) / MM_PER_INCH)).max()
    return bool(off > _SCANNED_SE) and (block_mm == 0.0 or fit.chi2 > _BAD_FIT * fit.freedom)


def _unsure_upright(page: Page) -> Reason:
    return Reason("upright_unsure", {}, page.source)


def _with_lens(flat: Flat, sheet: Sheet, best: Hypothesis) -> Sheet:
    """A photo's sheet with the lens's bend, where one shows."""
    lens = find_lens(flat, sheet.mm_to_px, list(best.sides))
    if lens is None:
        return sheet
    # A straight picture does not settle whether the paper is A3, or which rectangle was seen.
    doubted = any(problem.code in _SCALE_DOUBTS for problem in sheet.problems)
    scale_se = max(lens.scale_se, sheet.scale_se) if doubted else lens.scale_se
    return replace(sheet, lens=replace(lens, scale_se=scale_se))


def _settled(best: Hypothesis, dpi: tuple[float, float] | None, *, copied: bool) -> Fit:
    """Refit with the sides that agree; a side far off after the fit is dropped, once.

    Neither the paper nor the resolution of a copy is its drawing's: where the frame has all four sides,
    they alone are fitted.
    """
    sides = list(best.sides)
    drawn = [side for side in sides if side.model is not PAPER]
    if copied and len(drawn) == _ALL_SIDES:
        sides, dpi = drawn, None
    fit = fit_sides(best.mm_to_px, sides, dpi, perspective=best.perspective)
    near = [side for side, off in zip(sides, fit.side_mm, strict=True) if abs(off) < _FAR_OFF_MM]
    if len(near) == len(sides):
        return fit
    return fit_sides(fit.mm_to_px, near, dpi, perspective=best.perspective)


def _from_resolution(
    page: Page,
    resolution: Resolution,
    lines: list[LongLine],
    problems: list[Reason],
    doubt: Reason | None = None,
) -> Sheet | Unread:
    """Scale from the resolution alone, skew from ruled lines, place from the image's middle.

    Where nothing shows that the page is A3 (`doubt` says so), its drawing is to bear the scale out.
    """
    high, wide = page.grey.shape
    tilt, turn_se = page.tilt_rad or _tilt_of_squares(page) or _tilt(lines)
    quarter = 0.0 if wide >= high else np.pi / 2.0
    drawn = drawn_ends(lines)
    tried: list[tuple[float, FloatArray]] = []
    for half in (0.0, np.pi):
        angle = tilt + quarter + half
        params = np.array([*np.log(np.array(resolution.dpi) / MM_PER_INCH), angle, wide / 2.0, high / 2.0])
        matrix = affine_of(params)
        tried.append((title_block_mm(matrix, drawn), matrix))
    if page.turn_is_sure:
        block, matrix = min(tried, key=lambda one: off_turn_deg(one[1], page.turn_deg))
    else:
        block, matrix = max(tried, key=lambda one: (one[0], -off_turn_deg(one[1], page.turn_deg)))
    if not resolution.is_sure if resolution.stated else block == 0.0:
        doubt = doubt or _why("not_known_a3")
    if (doubt is not None or not resolution.stated) and looks_a4(page):
        return Unread("sheet", doubt or _why("as_large_as_a4"))
    if block == 0.0 and not page.turn_is_sure:
        problems.append(_unsure_upright(page))
    if not resolution.stated:
        assumed = {"assumed_dpi": round(resolution.dpi[0])}
        problems.append(Reason("resolution_assumed", assumed, page.source))
    copied: dict[str, Value] = {}
    scale_se = 0.0015 if resolution.stated else _WINDOW_SE
    if is_black_and_white(page.grey):
        scale_se = float(np.hypot(scale_se, _COPY_SE))
        copied = {"copy_percent": round(100.0 * _COPY_SE)}
    problems.append(Reason("frame_missing", copied, page.source))
    if doubt is not None:
        problems.append(Reason("scale_unknown", doubt.parameters, page.source))
        scale_se = max(scale_se, _UNKNOWN_SE)
    fit = _placed(matrix, resolution, lines, scale_se)
    turn_se = turn_se if fit.mm_to_px is matrix else _LEVEL_SE
    return replace(_sheet(fit, None, scale_se, problems), turn_se_rad=turn_se)


def _placed(matrix: FloatArray, resolution: Resolution, lines: list[LongLine], scale_se: float) -> Fit:
    """The map moved to the paper's edges, where one to three of them are seen."""
    edges = on_sides(inverted(matrix), PAPER, lines, _EDGE_WITHIN_MM)
    if not edges:
        return Fit(matrix, 0.0, 0, 0.0, scale_se, np.zeros(0))
    fit = fit_sides(matrix, edges, resolution.dpi, perspective=False)
    axes = affine_params(fit.mm_to_px)[:2] - affine_params(matrix)[:2]
    # A shadow or the scanner's border is no edge of the paper: it would pull the scale.
    return replace(fit, mm_to_px=matrix) if np.abs(axes).max() > _EDGE_SE else fit


def _tilt_of_squares(page: Page) -> tuple[float, float] | None:
    """Tilt of a sheet with printed squares, radians, and its standard error; None without.

    A feeder turns few sheets by degrees: squares far from level are likely to be turned themselves.
    """
    if page.ruling is None:
        return None
    angles = np.arctan2(*page.ruling.lines_per_px.T[::-1])
    tilt = float(np.remainder(angles + np.pi / 4.0, np.pi / 2.0).mean() - np.pi / 4.0)
    return tilt, float(np.hypot(tilt, _LEVEL_SE))


def _tilt(lines: list[LongLine]) -> tuple[float, float]:
    """Tilt of the sheet in its image, radians, and its standard error: that of lines that agree on one.

    A link may slope by a few degrees, so one line far from the image's axes shows no tilt. Vectors lie along
    links and across them: agreeing with each other they may be as far from level.
    """
    angles, weights = [], []
    for line in lines:
        d = line.ends[1] - line.ends[0]
        angle = np.arctan2(d[1], d[0]) if line.across else -np.arctan2(d[0], d[1])
        if abs(angle) < np.radians(5.0):
            angles.append(float(angle))
            weights.append(line.length * line.inked)
    every = np.array(angles)
    tried = np.append(every, 0.0)
    apart = (every - tried[:, None]) / _LEVEL_SE
    likely = np.log1p(_LEVEL_PEAK * np.exp(-0.5 * apart**2)).sum(axis=1) - 0.5 * (tried / _TILT_SE) ** 2
    agree = np.abs(apart[likely.argmax()]) < _LEVEL_WITHIN
    if not agree.any():
        return 0.0, _TILT_SE
    order = np.argsort(every[agree])
    cumulated = np.cumsum(np.array(weights)[agree][order])
    tilt = float(every[agree][order][np.searchsorted(cumulated, cumulated[-1] / 2.0)])
    return tilt, float(np.hypot(tilt, _TILT_SE))


# By corners that a person gave -------------------------------------------------------------------

_CLICKED_SE = 0.005
"""Relative error of a scale by corners that a person points at: 1.5 mm at each of them."""
_CLICKED_MM = 4.0
"""Lines that move a corner by more than this are not the sheet's."""


def register_by_corners(page: Page, corners_px: Sequence[tuple[float, float]]) -> Sheet | Unread:
    """The map by the sheet's four corners; by frame and edges that lie there, where they are found."""
    corners = np.asarray(corners_px, dtype=np.float64)
    matrix = through_corners(PAPER.corners(), corners)
    if not np.all(np.isfinite(matrix)):
        return _refused("corners")
    pointed = _sheet(Fit(matrix, 0.0, 0, 0.0, _CLICKED_SE, np.zeros(0)), None, _CLICKED_SE, [])
    pointed = replace(pointed, method="corners")
    flat = flatten(page.grey)
    lines = long_lines(flat)
    sides, frame = match_sides(matrix, lines)
    if any(len({side.value for side in sides if side.axis == axis}) < 2 for axis in (0, 1)):
        return pointed
    try:
        fit = _settled(
            Hypothesis(matrix, perspective=True, score=0.0, sides=sides, frame=frame), None, copied=False
        )
    except np.linalg.LinAlgError:
        return pointed
    moved_px = np.abs(mapped(fit.mm_to_px, PAPER.corners()) - corners).max()
    if (
        not fit.scale_se < _CLICKED_SE
        or fit.rms_mm > _NO_FIT_MM
        or moved_px > _CLICKED_MM * pointed.px_per_mm
    ):
        return pointed
    sheet = replace(_sheet(fit, frame, fit.scale_se, []), method="corners")
    return _with_lens(flat, sheet, Hypothesis(fit.mm_to_px, perspective=True, score=0.0, sides=sides))


def _sheet(fit: Fit, frame: Outline | None, scale_se: float, problems: list[Reason]) -> Sheet:
    matrix = fit.mm_to_px / fit.mm_to_px[2, 2]
    return Sheet(
        mm_to_px=matrix,
        page_mm=PAGE_MM,
        method="combined",
        px_per_mm=_px_per_mm(matrix, 10.0),
        rotation_deg=rotation_deg(matrix),
        residual_mm=fit.rms_mm,
        scale_se=scale_se,
        drawable_mm=drawable(frame),
        problems=tuple(problems),
    )
