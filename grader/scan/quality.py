"""Flaws of a picture that impair the reading of a sheet: cut corners, blur, bad light, too few pixels.

Each flaw has its measured figure and the limit that it passes:

- `corner_cut`: mm by which the farthest cut corner lies outside the picture
- `blurred`: mm across an edge of ink, in the direction in which edges are widest
- `too_coarse`, `far_away`: dots per inch of paper
- `too_tilted`: largest over smallest resolution on the sheet
- `too_dark`: brightness of the paper, 0..255
- `shadow`: brightness of the darkest part of the paper over that of the brightest
- `overexposed`: contrast of the ink, 0..1
- `glare`: share of the sheet
- `no_sheet`, `not_placed`: share of the picture that could be paper

Its `device` made the picture: `camera`, `scanner`, or `copier` (black and white alone). What to do depends on
it, and a flaw that the device cannot have is none, such as white paper on a scan.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace

import cv2
import numpy as np

from grader.printed.layout import MARKER_CORNERS, PAGE_MM
from grader.records import ZONE_SLACK_MM, Box, FloatArray, IntArray, Page, Reason, Sheet
from grader.scan.pixels import (
    BoolArray,
    Flat,
    Float32Array,
    at_full_size,
    connected,
    cut_out,
    flatten,
    is_black_and_white,
    local_axes,
    mapped,
    reduction,
    sampled,
    shrink,
    through_corners,
)
from grader.scan.register.homography import UNSET_DPI, is_as_large, looks_a4
from reference.drawing.canvas import MM_PER_INCH

_CORNERS_MM = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)]) * PAGE_MM
_INNER_MM = (_CORNERS_MM + np.array([(1.0, 1.0), (-1.0, 1.0), (-1.0, -1.0), (1.0, -1.0)]) * 10.0)[:, None]
"""(4, 1, 2) the corners of the drawing frame: it lies 10 mm inside the paper (ISO 5457)."""
_CORNERS = ("upper_left", "upper_right", "lower_right", "lower_left")
_ROWS, _COLUMNS = ("upper", "middle", "lower"), ("left", "middle", "right")


def flaws(page: Page, sheet: Sheet | None) -> tuple[Reason, ...]:
    """Return the flaws of a decoded page, the worst first.

    Arguments: `sheet` is its registration; if None, the paper's outline is used.
    """
    flat = flatten(page.grey)
    outline = None if sheet is not None else _paper(page)
    device = device_of(page, sheet, sees_edges=outline is not None)
    if sheet is not None:
        mm_to_px = sheet.mm_to_px
    elif outline is not None:
        mm_to_px = outline.mm_to_px
    else:
        mm_to_px = _whole_picture(page)
    light = _possible(_light(flat, mm_to_px, sheet), device)
    # In bad light the table may look like the paper.
    is_seen = sheet is not None or not light
    cut = list(_cut_corners(page, sheet, outline)) if is_seen else []
    stated = page.dpi if sheet is None and device != CAMERA and _is_stated(page) else None
    others = _possible([*_resolution(page, mm_to_px, stated, device), *_blur(flat, mm_to_px)], device)
    found = [*cut, *light, *others]
    if sheet is None and not found:
        share = 0.0 if outline is None else outline.share
        is_lost = outline is None or device != CAMERA
        found.append(_flaw("no_sheet" if is_lost else "not_placed", share, _LEAST_PAPER))
    return tuple(replace(flaw, parameters={**flaw.parameters, "device": device}) for flaw in found)


def _flaw(code: str, measured: float, limit: float, **places: tuple[str, ...]) -> Reason:
    return Reason(code, {"measured": measured, "limit": limit, **places})


# Devices ------------------------------------------------------------------------------------------

CAMERA, SCANNER, COPIER = "camera", "scanner", "copier"
_OF_SCANS = frozenset({"corner_cut", "too_coarse", "too_dark", "shadow", "no_sheet"})
FLAWS: Mapping[str, frozenset[str]] = {
    CAMERA: _OF_SCANS | {"blurred", "far_away", "too_tilted", "overexposed", "glare", "not_placed"},
    SCANNER: _OF_SCANS | {"blurred"},
    COPIER: _OF_SCANS,
}
"""The flaws that a picture of each device can have: scanners set the brightness, edges of 1 bit are sharp."""
_HELD = 1.02
"""Largest over smallest resolution: photos have 1.08 or more, a scan whose frame is ruled askew 1.01."""
_SHAPES = (1.0, 4 / 3, 3 / 2, 16 / 9)
"""Sides of cameras' pictures."""
_SHAPE_WITHIN = 0.004
"""Cameras round to whole blocks of 8 or 16 pixels."""
_SAME_MM = 1.0
"""A scan that states no resolution has the paper's size at a usual one, rounded to pixels."""


def device_of(page: Page, sheet: Sheet | None, *, sees_edges: bool = False) -> str:
    """Return by what a page was made: as its file says, else by projection, size, resolution and shape.

    Arguments: `sees_edges` of paper within a picture that could not be registered.
    """
    if is_black_and_white(page.grey):
        return COPIER
    if page.device:
        return page.device
    axes = np.ones(1) if sheet is None else _axes(sheet.mm_to_px)
    if axes.max() > _HELD * axes.min():
        return CAMERA
    if sheet is not None or _is_stated(page) or looks_a4(page) or is_as_large(page, PAGE_MM, _SAME_MM):
        return SCANNER
    shape = max(page.grey.shape) / min(page.grey.shape)
    return CAMERA if sees_edges or np.abs(np.divide(_SHAPES, shape) - 1.0).min() < _SHAPE_WITHIN else SCANNER


def _is_stated(page: Page) -> bool:
    """Return whether the file states a resolution as scanners do; that of a PDF follows from its paper."""
    return page.dpi is not None and page.paper_mm is None and min(page.dpi) >= UNSET_DPI


def _possible(found: Iterable[Reason], device: str) -> list[Reason]:
    return [flaw for flaw in found if flaw.code in FLAWS[device]]


# Where the sheet lies -----------------------------------------------------------------------------

_OUTLINE_PX = 480
"""Long side of the picture in which paper is separated from the table: 1 px is a millimetre or two."""
_LEAST_PAPER = 0.15
"""Least share of the picture: a smaller bright patch is no readable sheet."""
_FULL = 0.9
"""Least share of its hull: a bright patch with more holes or bays is no sheet."""
_RIM_PX = 1
"""A patch this close to the picture's rim continues beyond it."""
_LEAST_SIDE = 0.12
"""A side's line needs points along this share of the patch's size."""
_BEYOND = 0.1
"""A side outside the picture is assumed to lie this share of the sheet beyond the rim."""
_NO_VIEW = 4.0
"""Largest over smallest resolution: nobody photographs a sheet from such an angle."""
_SLACK = 0.01
"""Share of the long side, 4 mm on A3: where a lens bends the sides, corners are known no better."""
_PARALLEL = 1e-9
"""Cross product of lines in pixels that have no crossing."""
_BESIDE_MM = 2.0
"""The map's own error, and that of a frame ruled by hand."""


@dataclass(frozen=True, slots=True)
class _Outline:
    """The paper in a picture by its brightness; corners outside the picture are where its sides meet.

    `share`: the share of the picture that it fills; `cut`: numbers of the corners outside the picture.
    """

    mm_to_px: FloatArray
    share: float
    cut: tuple[int, ...]


def _whole_picture(page: Page) -> FloatArray:
    """Return the map of a sheet that fills the picture."""
    high, wide = page.grey.shape
    corners = np.array([(0.0, 0.0), (wide, 0.0), (wide, high), (0.0, high)]) - 0.5
    if high > wide:
        corners = np.roll(corners, 1, axis=0)
    return through_corners(_CORNERS_MM, corners)


def _paper(page: Page) -> _Outline | None:
    """Return the paper's outline, None if no bright patch has the shape of a sheet."""
    scale = min(1.0, _OUTLINE_PX / max(page.grey.shape))
    small = shrink(page.grey, scale)
    soft = cv2.medianBlur(small, 5)
    _, bright = cv2.threshold(soft, 0, 1, cv2.THRESH_BINARY + cv2.THRESH_OTSU)
    labels, boxes = connected(np.ascontiguousarray(bright, dtype=np.uint8))
    if len(boxes) == 0:
        return None
    sizes = np.bincount(labels.reshape(-1), minlength=len(boxes) + 1)[1:]
    patch = (labels == 1 + int(sizes.argmax())).astype(np.uint8)
    share = float(sizes.max()) / patch.size
    contours, _ = cv2.findContours(patch, cv2.RETR_EXTERNAL, cv2.CHAIN_APPROX_NONE)
    hull = cv2.convexHull(max(contours, key=cv2.contourArea))
    if share < _LEAST_PAPER or cv2.contourArea(hull) * _FULL > sizes.max():
        return None
    high, wide = patch.shape
    found = _four_corners(hull[:, 0].astype(np.float64), np.array([wide, high], dtype=np.float64))
    if found is None:
        return None
    corners, cut = found
    full = np.array(page.grey.shape[::-1], dtype=np.float64)
    corners, cut = _upright(at_full_size(corners, np.array([wide, high]) / full), cut, page.turn_deg)
    matrix = through_corners(_CORNERS_MM, corners)
    if not np.all(np.isfinite(matrix)):
        return None
    axes = _axes(matrix)
    if axes.max() > _NO_VIEW * axes.min():
        return None  # a shadow on the sheet was taken for its edge
    return _Outline(matrix, share, tuple(np.flatnonzero(cut).tolist()))


def _four_corners(hull: FloatArray, size: FloatArray) -> tuple[FloatArray, BoolArray] | None:
    """Return the corners of a convex patch (n, 2) where its sides meet, (4, 2), and which were not seen.

    None if no side is in the picture, or the patch is no quadrangle.
    """
    span = np.roll(hull, -1, axis=0) - hull
    length = np.hypot(*span.T)
    middle = hull.mean(axis=0)
    at = hull + span / 2.0
    inside = np.all((at > _RIM_PX) & (at < size - 1.0 - _RIM_PX), axis=1)
    box = cv2.boxPoints(cv2.minAreaRect(hull.astype(np.float32))).astype(np.float64)
    sides = np.roll(box, -1, axis=0) - box
    outward = np.stack([sides[:, 1], -sides[:, 0]], axis=1) / np.hypot(*sides.T)[:, None]
    outward *= np.sign(((box - middle) * outward).sum(axis=1))[:, None]
    normal = np.stack([span[:, 1], -span[:, 0]], axis=1)
    normal *= np.sign(((at - middle) * normal).sum(axis=1))[:, None]
    side_of = (normal @ outward.T).argmax(axis=1)
    lines = np.empty((4, 3))
    seen = np.zeros(4, dtype=bool)
    for k in range(4):
        own = inside & (side_of == k)
        seen[k] = length[own].sum() > _LEAST_SIDE * np.hypot(*sides[k])
        if seen[k]:
            steps = np.maximum(length[own], 1.0).astype(int)
            share = np.concatenate([np.linspace(0.0, 1.0, step) for step in steps])
            points = np.repeat(hull[own], steps, axis=0) + share[:, None] * np.repeat(
                span[own], steps, axis=0
            )
            vx, vy, x, y = (
                cv2.fitLine(points.astype(np.float32), cv2.DIST_HUBER, 0, 0.01, 0.01).reshape(-1).tolist()
            )
            lines[k] = -vy, vx, vy * x - vx * y
        else:
            # It lies beyond the rim, at an unknown distance.
            lines[k] = *outward[k], -(outward[k] @ (box[k] + _BEYOND * np.hypot(*sides[k - 1]) * outward[k]))
    if not seen.any():
        return None
    crossing = np.cross(np.roll(lines, 1, axis=0), lines)
    if np.any(np.abs(crossing[:, 2]) < _PARALLEL):
        return None
    corners = crossing[:, :2] / crossing[:, 2:]
    slack = _SLACK * size.max()
    cut = np.any((corners < -slack) | (corners > size - 1.0 + slack), axis=1)
    # Both ends of a side that was not seen are beyond the rim.
    cut |= ~seen | ~np.roll(seen, 1)
    return corners, cut


def _upright(corners: FloatArray, cut: BoolArray, turn_deg: int) -> tuple[FloatArray, BoolArray]:
    """Order corners around a sheet, from the upper left one of the picture as shown, clockwise."""
    x, y = (corners - corners.mean(axis=0)).T
    order = np.argsort(np.arctan2(y, x))
    # Shown turned counter-clockwise, another corner is the upper left one.
    turn = np.radians(turn_deg)
    shown = np.stack([x * np.cos(turn) + y * np.sin(turn), y * np.cos(turn) - x * np.sin(turn)], axis=1)[
        order
    ]
    first = int(shown.sum(axis=1).argmin())
    order = np.roll(order, -first)
    return corners[order], cut[order]


def _cut_corners(page: Page, sheet: Sheet | None, outline: _Outline | None) -> Iterator[Reason]:
    """Report the corners outside the picture."""
    size = np.array(page.grey.shape[::-1], dtype=np.float64)
    if sheet is None:
        if outline is not None and outline.cut:
            at = mapped(outline.mm_to_px, _CORNERS_MM)
            beyond = np.maximum(-at, at - (size - 1.0)).max(axis=1) / _px_per_mm(outline.mm_to_px)
            yield _flaw(
                "corner_cut", float(beyond.max()), 0.0, corners=tuple(_CORNERS[k] for k in outline.cut)
            )
        return
    # The frame, or the markers: all four corners must be visible.
    must = _INNER_MM if not sheet.zones else MARKER_CORNERS[[0, 3, 7, 4]].reshape(4, 4, 2)
    at = mapped(sheet.mm_to_px, must)
    beyond = np.maximum(-at, at - (size - 1.0)).max(axis=(1, 2)) / sheet.px_per_mm
    cut = np.flatnonzero(beyond > _BESIDE_MM)
    if len(cut):
        yield _flaw("corner_cut", float(beyond.max()), _BESIDE_MM, corners=tuple(_CORNERS[k] for k in cut))


# Resolution ---------------------------------------------------------------------------------------

LEAST_DPI = 150.0
"""Resolution that students are asked for. Usual pencils are read at 110, thin and faint ones are not."""
_DPI_SHARE = 0.97
"""Tolerated share of it: a scan at 150 dpi may come out at 149; a photo's resolution is less certain."""
_FAR = 0.5
"""Share of the picture: a sheet that fills less can be photographed from nearer."""
_MOST_UNEVEN = 2.0
"""Largest over smallest resolution: one side of the sheet then has half the pixels of the other."""


def _axes(mm_to_px: FloatArray) -> FloatArray:
    """Return (4,) pixels per mm at the sheet's corners."""
    right, down = local_axes(mm_to_px, _INNER_MM[:, 0])
    return np.asarray(np.sqrt(np.abs(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])))


def _px_per_mm(mm_to_px: FloatArray) -> float:
    return float(np.exp(np.log(np.maximum(_axes(mm_to_px), 1e-6)).mean()))


def _resolution(
    page: Page, mm_to_px: FloatArray, stated: tuple[float, float] | None, device: str
) -> Iterator[Reason]:
    """Report too few pixels on the sheet, or on a part of it; a `stated` resolution is not measured."""
    axes = _axes(mm_to_px)
    dpi = _px_per_mm(mm_to_px) * MM_PER_INCH if stated is None else min(stated)
    if dpi < _DPI_SHARE * LEAST_DPI:
        area = cv2.contourArea(mapped(mm_to_px, _CORNERS_MM).astype(np.float32)) / page.grey.size
        is_far = area < _FAR and device == CAMERA
        yield _flaw("far_away" if is_far else "too_coarse", round(dpi), round(LEAST_DPI))
    uneven = float(axes.max() / max(axes.min(), 1e-6))
    if uneven > _MOST_UNEVEN:
        yield _flaw("too_tilted", uneven, _MOST_UNEVEN)


# Light --------------------------------------------------------------------------------------------

_PART = 0.2
"""Share of a shadow or reflection: a ninth of the sheet that holds less is not named."""
_MAP_PX_PER_MM = 0.25
"""Resolution of the map of the light: shadows and glare are larger than 4 mm."""
_LEAST_PAPER_LEVEL = 85.0
"""Least paper level of 255: with a phone's noise nearly all vectors were right at 120, a quarter at 73."""
_SHADE, _LEAST_SHADE = 0.2, 0.04
"""Light in a shadow over that beside it (nearly all vectors were right at 0.18, a quarter at 0.1), and its
least share of the sheet: a hand's breadth."""
_WHITE = 253
"""Level of 255 at which a sensor is saturated."""
_MOST_WHITE = 0.5
"""Largest share of the sheet: a larger white area is no reflection."""
_LEAST_INK = 0.3
"""Least contrast of the ink where the paper is white: at 0.24, a quarter of the vectors was right."""
_INK_QUANTILE = 0.995
"""A drawing's ink covers about a hundredth of its paper."""
_GLARE, _AROUND_GLARE = 0.005, 247.0
"""Share of the sheet that is white, and the level below which the paper around it must be."""
_AROUND_MM = 16.0
"""The paper's brightness beside a reflection."""


def _light(flat: Flat, mm_to_px: FloatArray, sheet: Sheet | None) -> Iterator[Reason]:
    """Report too little light, too much of it, or uneven light."""
    step = np.array(flat.step)
    to_paper = np.array(
        [[1 / step[0], 0, 0.5 / step[0] - 0.5], [0, 1 / step[1], 0.5 / step[1] - 0.5], [0, 0, 1.0]]
    )
    inner = (*_INNER_MM[0, 0], *(_INNER_MM[2, 0] - _INNER_MM[0, 0]))
    light = cut_out(flat.paper, to_paper @ mm_to_px, inner, _MAP_PX_PER_MM)
    if light.size == 0:
        return
    level = float(np.quantile(light, 0.9))
    if level < _LEAST_PAPER_LEVEL:
        yield _flaw("too_dark", level, _LEAST_PAPER_LEVEL)
        return
    shaded = light < _SHADE * level
    if shaded.mean() > _LEAST_SHADE:
        yield _flaw("shadow", float(np.quantile(light, 0.02) / level), _SHADE, areas=_areas(shaded))
    white = light >= _WHITE
    if white.mean() > _MOST_WHITE:
        boxes = [inner] if sheet is None or not sheet.zones else list(sheet.zones.values())
        ink = max(_darkest(flat, mm_to_px, box) for box in boxes)
        if ink < _LEAST_INK:
            yield _flaw("overexposed", ink, _LEAST_INK)
    elif white.mean() > _GLARE:
        side = 2 * round(_AROUND_MM * _MAP_PX_PER_MM) + 1
        around = (cv2.dilate(white.astype(np.uint8), np.ones((side, side), np.uint8)) > 0) & ~white
        if np.median(light[around]) < _AROUND_GLARE:
            yield _flaw("glare", float(white.mean()), _GLARE, areas=_areas(white))


def _darkest(flat: Flat, mm_to_px: FloatArray, box: Box) -> float:
    """Return the contrast of the ink in a box of the sheet, away from the line around it, 0..1."""
    scale = min(1.0, _INK_PX / max(flat.grey.shape))
    x, y, wide, high = box
    edge = ZONE_SLACK_MM
    within = (x + edge, y + edge, wide - 2 * edge, high - 2 * edge)
    to_reduced = reduction(scale) @ mm_to_px
    contrast = cut_out(flat.reduced(scale), to_reduced, within, _INK_PX / PAGE_MM[0])
    return float(np.quantile(contrast, _INK_QUANTILE)) / 255.0 if contrast.size else 0.0


def _areas(mask: BoolArray) -> tuple[str, ...]:
    """Return the ninths of the sheet that hold at least a fifth of a mask."""
    rows, columns = (np.minimum(np.arange(side) * 3 // side, 2) for side in mask.shape)
    counts = np.zeros((3, 3))
    np.add.at(counts, (rows[:, None], columns[None, :]), mask)
    names = [
        "middle" if row == column == 1 else f"{_ROWS[row]}_{_COLUMNS[column]}"
        for row in range(3)
        for column in range(3)
    ]
    held = counts.reshape(-1) / counts.sum()
    chosen = [name for name, share in zip(names, held, strict=True) if share >= _PART]
    return tuple(chosen or [names[int(held.argmax())]])


# Blur ---------------------------------------------------------------------------------------------

_INK_PX = 1200
"""Long side of the picture in which ink is looked for."""
_INK = 38
"""Least contrast of 255: paper's texture and show-through stay below."""
_TILE_PX = 24
"""Side of a piece in that picture: 8 mm of the sheet."""
_TILES, _EVERY = 48, 4
"""Pieces with most ink, of which every fourth is used: some hundred edges in every direction."""
_ACROSS_MM = 1.2
"""Distance to either side of an edge: past the stroke's middle, and to the paper beside it."""
_LEAST_STEP = 0.15
"""Least step, as a share of the paper's brightness: texture and noise make smaller ones."""
_LEAST_EDGES = 60
"""Fewest edges in a direction for which its width is known to a tenth."""
_SHARPEST = 0.25
"""Share of the edges in one direction that is used: a soft pencil's are wider than the lens made them."""
_SECTORS = 4
"""Directions by 45 degrees: a shake blurs only the edges across it."""
MOST_BLUR_MM = 0.6
"""Sharp photos have 0.3 to 0.4; from 0.6 the share of right vectors falls, and sureness at 0.8."""
_MOST_BLUR_PX = 3.0
"""An edge that is no wider is as sharp as these pixels allow."""


def _blur(flat: Flat, mm_to_px: FloatArray) -> Iterator[Reason]:
    """Report edges of ink that are wider than the reader can follow."""
    px_per_mm = _px_per_mm(mm_to_px)
    width = _edge_width_px(flat, mm_to_px, px_per_mm)
    if width > max(MOST_BLUR_MM * px_per_mm, _MOST_BLUR_PX):
        yield _flaw("blurred", width / px_per_mm, MOST_BLUR_MM)


def _edge_width_px(flat: Flat, mm_to_px: FloatArray, px_per_mm: float) -> float:
    """Return the width of the sharpest edges of ink in the direction where it is largest; 0 without edges."""
    reach = max(4, round(_ACROSS_MM * px_per_mm))
    found = [_edges(tile, paper, reach) for tile, paper in _inked_tiles(flat, mm_to_px, reach)]
    if not found:
        return 0.0
    sector, width = map(np.concatenate, zip(*found, strict=True))
    in_sector = [width[sector == k] for k in range(_SECTORS)]
    return max(
        (float(np.quantile(one, _SHARPEST)) for one in in_sector if len(one) >= _LEAST_EDGES), default=0.0
    )


def _inked_tiles(flat: Flat, mm_to_px: FloatArray, reach: int) -> Iterator[tuple[Float32Array, float]]:
    """Yield pieces of the page at full resolution with most ink, and the paper's brightness there."""
    scale = min(1.0, _INK_PX / max(flat.grey.shape))
    ink = (flat.reduced(scale) > _INK).astype(np.float32)
    outline = np.zeros(ink.shape, np.uint8)
    corners = mapped(reduction(scale) @ mm_to_px, _INNER_MM[:, 0])
    if np.all(np.abs(corners) < 1e6):
        cv2.fillConvexPoly(outline, np.rint(corners).astype(np.int32), 1)
    ink *= outline
    rows, columns = (side // _TILE_PX for side in ink.shape)
    held = (
        ink[: rows * _TILE_PX, : columns * _TILE_PX]
        .reshape(rows, _TILE_PX, columns, _TILE_PX)
        .mean(axis=(1, 3))
    )
    # Filled areas have few edges.
    held[held > 0.5] = 0.0
    for place in held.reshape(-1).argsort()[::-1][:_TILES:_EVERY]:
        row, column = divmod(int(place), columns)
        if held[row, column] <= 0.0:
            return
        top, left, side = (round(value * _TILE_PX / scale) for value in (row, column, 1))
        tile = flat.grey[max(0, top - reach) : top + side + reach, max(0, left - reach) : left + side + reach]
        yield tile.astype(np.float32), float(np.quantile(tile, 0.9))


def _edges(tile: Float32Array, paper: float, reach: int) -> tuple[IntArray, FloatArray]:
    """Return (n,) sector of the direction across each edge of a piece, and its width in pixels."""
    soft = np.asarray(cv2.GaussianBlur(tile, (0, 0), 0.7), dtype=np.float32)
    gx, gy = (cv2.Sobel(soft, cv2.CV_32F, dx, 1 - dx, scale=0.125) for dx in (1, 0))
    slope = np.asarray(np.hypot(gx, gy), dtype=np.float32)
    inner = slope[reach:-reach, reach:-reach]
    if inner.size == 0:
        return np.zeros(0, dtype=int), np.zeros(0)
    # A shake leaves the edges along it sharp: those across it are the steepest of their own direction only,
    # of which the reverse is the same.
    angle = np.arctan2(gy, gx)[reach:-reach, reach:-reach] % np.pi
    sectors = (angle / np.pi * _SECTORS + 0.5).astype(int) % _SECTORS
    steepest = np.array([inner[sectors == k].max(initial=0.0) for k in range(_SECTORS)])
    is_steep = inner > np.maximum(0.03 * paper, 0.35 * steepest[sectors])
    steep, sector = np.argwhere(is_steep) + reach, sectors[is_steep]
    y, x = steep.T.astype(np.float32)
    at = slope[steep[:, 0], steep[:, 1]]
    ux, uy = gx[steep[:, 0], steep[:, 1]] / at, gy[steep[:, 0], steep[:, 1]] / at
    beside = sampled(slope, x[:, None] + ux[:, None] * [-1.0, 1.0], y[:, None] + uy[:, None] * [-1.0, 1.0])
    top = at >= beside.max(axis=1)
    x, y, ux, uy, at, sector = x[top], y[top], ux[top], uy[top], at[top], sector[top]
    along = np.arange(-reach, reach + 1, dtype=np.float32)
    across = sampled(soft, x[:, None] + ux[:, None] * along, y[:, None] + uy[:, None] * along)
    step = across[:, reach:].max(axis=1) - across[:, : reach + 1].min(axis=1)
    enough = step > _LEAST_STEP * paper
    return sector[enough], (step[enough] / at[enough]).astype(np.float64)
