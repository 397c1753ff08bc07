"""Registration by the printed markers of an answer sheet, and the sheet's identity by its QR code."""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
import zxingcpp
from numpy.typing import NDArray

from grader.printed.layout import (
    CALIBRATION,
    CODE_MM,
    DRAWING_MM,
    MARKER_CELLS,
    MARKER_CORNERS,
    MARKER_DICTIONARY,
    MARKER_MM,
    MARKERS_PER_TEMPLATE,
    PAGE_MM,
    Template,
    identity_of,
    template_of,
)
from grader.records import FloatArray, GreyImage, Identity, Lens, Page, Reason, Sheet
from grader.scan.pixels import (
    BoolArray,
    at_full_size,
    cut_out,
    local_axes,
    mapped,
    robust_lines,
    sampled,
    shrink,
    through_corners,
)
from grader.scan.register.distortion import find_bend
from grader.scan.register.fitting import MarkedPoints, Projection, fit_projection
from grader.scan.register.homography import rotation_deg
from reference.drawing.canvas import MM_PER_INCH

# The code -----------------------------------------------------------------------------------------

_LONG_SIDES_PX = (1700, 3400)
"""At about 4 px/mm a module has 3 pixels; a phone's photo may need twice as many."""
_CLOSE_UP_PX_PER_MM = 10.0
"""A module of the code has about 8 pixels."""
_MARGIN_MM = 3.0
"""Around the code's place: how far a map by two markers may be off, and more of the quiet zone."""
_BLUR_PX, _SHARPER = 6.0, 1.5
"""Three quarters of a module in the close-up, and how much of the difference is added."""


def identify(page: Page, mm_to_px: FloatArray | None = None) -> Identity | None:
    """Return the identity in the page's code; None without a code of ours, or with two that differ.

    Arguments: `mm_to_px` is the printed sheet's map, where known: its place is then searched first.
    """
    for picture in _code_pictures(page.grey, mm_to_px):
        identities = _read(picture)
        if identities:
            return identities.pop() if len(identities) == 1 else None
    return None


def _code_pictures(grey: GreyImage, mm_to_px: FloatArray | None) -> Iterator[GreyImage]:
    """Pictures in which the code may be read, the cheapest first."""
    if mm_to_px is not None:
        x, y, wide, high = CODE_MM
        box = x - _MARGIN_MM, y - _MARGIN_MM, wide + 2.0 * _MARGIN_MM, high + 2.0 * _MARGIN_MM
        close_up = cut_out(grey, mm_to_px, box, _CLOSE_UP_PX_PER_MM, outside=255)
        if close_up.size:
            yield close_up
            # Unsharp mask: brings back the modules of a code scanned out of focus.
            soft = cv2.GaussianBlur(close_up, (0, 0), _BLUR_PX)
            sharp = cv2.addWeighted(close_up, 1.0 + _SHARPER, soft, -_SHARPER, 0.0)
            yield np.asarray(sharp, dtype=np.uint8)
    # On a page that is not known to be a printed sheet a closer look would cost more than it finds.
    for long_side in _LONG_SIDES_PX if mm_to_px is not None else _LONG_SIDES_PX[:1]:
        yield shrink(grey, long_side / max(grey.shape))
        if long_side >= max(grey.shape):
            return


def _read(grey: GreyImage) -> set[Identity]:
    """Identities in all codes seen; what is no code of ours is passed over."""
    codes = zxingcpp.read_barcodes(
        np.ascontiguousarray(grey), formats=zxingcpp.BarcodeFormats(zxingcpp.BarcodeFormat.QRCode)
    )
    identities = (identity_of(code.text) for code in codes)
    return {identity for identity in identities if identity is not None}


# The markers --------------------------------------------------------------------------------------

_DETECTION_PX = 1600
"""Long side of the picture on which markers are looked for: on A3 a marker's cell has 7 pixels."""
_CLOSER_PX = 3200
"""The second time, for photos in which the sheet is a small part."""
_LEAST_MARKERS = 2
"""One marker settles a map too badly far from it."""
_LEAST_APART_MM = 100.0
"""Markers closer together do not settle the far end of the sheet."""
_OFF_MM = 3.0
"""A marker farther off than this from where the others put it is a foreign one; no lens bends as much."""
_LEAST_PX_PER_MM = 2.0
"""A stroke of 0.3 mm is less than a pixel wide below this."""
_MAX_RMS_MM = 1.5
"""A wide lens bends the sheet as much; what no lens explains is in `scale_se`."""
_MAX_SE_MM = 0.6
"""A map less sure than this at the edge of the drawing area cannot be measured by."""
_MAX_UNEVEN = 2.5
"""Largest over smallest scale on the sheet; a photo any more slanted cannot be measured."""
_PRINTER_SE, _SCANNER_SE = 0.002, 0.002
"""Relative error of a printer's scale, rollers and paper included, and of a scanner's stated resolution.

Markers are printed by the same printer, so that what it does to lengths shows in them only against the
stated resolution, and there together with what the scanner does."""
_USUAL_LENGTH_MM = 60.0
"""Length of a vector: what the map leaves unexplained is an error of lengths over this distance."""
_FLAT_MM = 0.12
"""Misfit from which paper is reported as not flat; printers and flatbeds stay under 0.1."""
_SCALE_REPORTED = 0.004
"""Printers and scanners together stay below this."""
_SCALE_NEAR = 0.1
"""Up to here a printed page may pass for the right size."""
_SCALE_FAR = 1.6
"""Between A3 and A4 lies a factor of 1.41; what is farther off is a wrong resolution."""

_REACH = 0.9 / MARKER_CELLS
"""Reach of profiles outward and inward, in sides: within the border's cell and the quiet zone."""
_ACROSS, _SAMPLES = 37, 40
"""Places across a side at which the grey is taken, and profiles along it."""
_ENDS = 0.12
"""Share of a side left out at each end, where blur rounds the corner."""
_LEAST_CONTRAST = 30.0
"""Grey levels from a marker's black to the paper's white; less is a shadow or a smear."""
_LEAST_SHARE = 0.5
"""Share of the places along a side at which an edge must be seen."""
_ROUNDS = 2
"""Guesses may be off by half a cell: the second time profiles run straight across the sides."""
_NOISE_FLOOR = 0.0005
"""Least noise of an edge's place, in sides: 0.006 mm."""

_START = np.array([(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)])
_ALONG = np.roll(_START, -1, axis=0) - _START
_OUTWARD = np.stack([_ALONG[:, 1], -_ALONG[:, 0]], axis=1)


@dataclass(frozen=True, slots=True)
class _Markers:
    """Refined corners of one template's markers, and the marker (n,) that each is of."""

    template: Template
    corners: MarkedPoints
    owner: NDArray[np.intp]

    def take(self, keep: BoolArray) -> "_Markers":
        """Some of the corners."""
        corners = MarkedPoints(self.corners.mm[keep], self.corners.px[keep], self.corners.outward[keep])
        return _Markers(self.template, corners, self.owner[keep])

    @property
    def numbers(self) -> list[int]:
        """The markers that have corners here."""
        return sorted(map(int, set(self.owner)))


def register(page: Page) -> Sheet | None:
    """The sheet of a printed page; None where its markers are too few, or not ours."""
    for long_side in (_DETECTION_PX, _CLOSER_PX):
        quads = _quads(page.grey, long_side)
        if not quads:
            return None
        markers = _markers(page.grey, quads)
        agreed = None if markers is None else _agreed(markers)
        if agreed is not None:
            return _sheet(page, *agreed)
        if long_side >= max(page.grey.shape):
            break
    return None


def middles(page: Page) -> tuple[FloatArray, FloatArray]:
    """Middles of the markers that are whole: (n, 2) on the sheet, mm, and (n, 2) as seen, px.

    Ink that spreads moves opposite sides alike and leaves the middle where it is.
    """
    quads = _quads(page.grey, _DETECTION_PX) or _quads(page.grey, _CLOSER_PX)
    markers = _markers(page.grey, quads) if quads else None
    if markers is None:
        return np.zeros((0, 2)), np.zeros((0, 2))
    single = [markers.take(markers.owner == number).corners for number in markers.numbers]
    whole = [corners for corners in single if len(corners) == 4]
    return (
        np.array([_crossing(corners.mm) for corners in whole]).reshape(-1, 2),
        np.array([_crossing(corners.px) for corners in whole]).reshape(-1, 2),
    )


def _crossing(corners: FloatArray) -> FloatArray:
    """Return the intersection of the diagonals of four corners in order."""
    a, b, c, d = corners
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    return np.asarray(a + share[0] * (c - a))


def _quads(grey: GreyImage, long_side: int) -> dict[int, FloatArray]:
    """Rough corners (4, 2) in full pixels of the markers whose ids are in use and seen once."""
    small = shrink(grey, min(1.0, long_side / max(grey.shape)))
    corners, ids, _ = _detector().detectMarkers(small)
    numbers = [] if ids is None else [int(number) for number in np.ravel(ids)]
    scale = np.array([small.shape[1] / grey.shape[1], small.shape[0] / grey.shape[0]])
    return {
        number: at_full_size(np.asarray(quad.reshape(4, 2), dtype=np.float64), scale)
        for number, quad in zip(numbers, corners, strict=True)
        if numbers.count(number) == 1 and template_of(number) is not None
    }


def _markers(grey: GreyImage, quads: dict[int, FloatArray]) -> _Markers | None:
    """The refined markers of the template that most of them belong to."""
    votes = Counter(number // MARKERS_PER_TEMPLATE for number in quads)
    chosen, count = votes.most_common(1)[0]
    template = template_of(chosen * MARKERS_PER_TEMPLATE)
    if template is None or count < _LEAST_MARKERS:
        return None
    ours = [number for number in sorted(quads) if number in template.marker_ids]
    px, whole = _refined(grey, np.stack([quads[number] for number in ours]))
    places = np.array(ours) - template.marker_ids.start
    mm = MARKER_CORNERS[places]
    outward = (mm - mm.mean(axis=1, keepdims=True)) / (MARKER_MM / 2.0)
    owner = np.broadcast_to(places[:, None], whole.shape)
    return _Markers(template, MarkedPoints(mm[whole], px[whole], outward[whole]), owner[whole])


def _detector() -> cv2.aruco.ArucoDetector:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    settings.adaptiveThreshWinSizeMin = 15
    settings.adaptiveThreshWinSizeMax = 45
    settings.adaptiveThreshWinSizeStep = 30
    settings.minMarkerPerimeterRate = 0.02
    settings.maxMarkerPerimeterRate = 0.4
    settings.errorCorrectionRate = 0.3
    dictionary = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, MARKER_DICTIONARY))
    return cv2.aruco.ArucoDetector(dictionary, settings)


def _agreed(markers: _Markers) -> tuple[_Markers, Projection] | None:
    """The markers that agree, those far off left out one by one, and their map; None if there is none."""
    while True:
        count = len(markers.numbers)
        if count < _LEAST_MARKERS or np.ptp(markers.corners.mm, axis=0).max() < _LEAST_APART_MM:
            return None
        fit = fit_projection(markers.corners)
        if fit.misfit_mm.max() <= _OFF_MM:
            return (markers, fit) if _plausible(fit) else None
        if count <= _LEAST_MARKERS + 1:
            return None
        # Without a foreign marker the others agree best.
        rests = [markers.take(markers.owner != number) for number in markers.numbers]
        markers = min(rests, key=lambda rest: fit_projection(rest.corners).rms_mm)


def _plausible(fit: Projection) -> bool:
    """Return whether a camera or scanner could have made this map, and it is good enough to measure by."""
    if fit.rms_mm > _MAX_RMS_MM or fit.se_mm(_GRID_MM).max() > _MAX_SE_MM:
        return False
    scales = _local_scales(fit.mm_to_px)
    return bool(scales.min() >= _LEAST_PX_PER_MM and scales.max() / scales.min() <= _MAX_UNEVEN)


_GRID_MM = np.stack(
    np.meshgrid(
        np.linspace(DRAWING_MM[0], DRAWING_MM[0] + DRAWING_MM[2], 5),
        np.linspace(DRAWING_MM[1], DRAWING_MM[1] + DRAWING_MM[3], 4),
    ),
    axis=-1,
).reshape(-1, 2)


def _local_scales(mm_to_px: FloatArray) -> FloatArray:
    """Pixels per mm along x and along y at points of the sheet; negative where the sheet is mirrored."""
    right, down = local_axes(mm_to_px, _GRID_MM)
    side = np.sign(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    return np.concatenate([np.hypot(*right.T) * side, np.hypot(*down.T) * side])


def _sheet(page: Page, markers: _Markers, fit: Projection) -> Sheet:
    px_per_mm = float(np.sqrt(np.mean(np.abs(_local_scales(fit.mm_to_px)) ** 2)))
    printed_se, problems = _against_resolution(page, fit, px_per_mm)
    lens = _lens(page, markers.corners, fit, printed_se)
    return Sheet(
        mm_to_px=fit.mm_to_px,
        page_mm=PAGE_MM,
        method="markers",
        px_per_mm=px_per_mm,
        rotation_deg=rotation_deg(fit.mm_to_px),
        residual_mm=fit.rms_mm,
        scale_se=_scale_se(fit, printed_se),
        drawable_mm=DRAWING_MM,
        zones=dict(markers.template.zones),
        identity=identify(page, fit.mm_to_px),
        problems=(*problems, *_problems(page, markers.template, fit if lens is None else None)),
        lens=lens,
    )


def _lens(page: Page, corners: MarkedPoints, plain: Projection, printed_se: float) -> Lens | None:
    bend, fit = find_bend(corners, plain, (page.grey.shape[0], page.grey.shape[1]))
    if not bend:
        return None
    return Lens(bend, plain.mm_to_px, fit.mm_to_px, fit.rms_mm, _scale_se(fit, printed_se))


def _scale_se(fit: Projection, printed_se: float) -> float:
    """Relative error of lengths: print, map, and what the map leaves unexplained between the markers."""
    stretch = fit.se_mm(_GRID_MM).max() / (DRAWING_MM[2] / 2.0)
    return float(np.linalg.norm([printed_se, stretch, fit.rms_mm / _USUAL_LENGTH_MM]))


def _problems(page: Page, template: Template, plain: Projection | None) -> Iterator[Reason]:
    if template is CALIBRATION:
        yield Reason("calibration_page", {}, page.source)
    if plain is not None and plain.rms_mm > _FLAT_MM:
        yield Reason("sheet_not_flat", {"off_mm": float(plain.misfit_mm.max())}, page.source)


def _against_resolution(page: Page, fit: Projection, px_per_mm: float) -> tuple[float, tuple[Reason, ...]]:
    """Scale error by the stated resolution: a printer that fits pages to its paper shrinks them.

    A camera's resolution means nothing, and it is known by its slanted view.
    """
    if page.dpi is None or fit.is_slanted:
        return _PRINTER_SE, ()
    stated = float(np.sqrt(page.dpi[0] * page.dpi[1])) / MM_PER_INCH
    size = px_per_mm / stated
    if not 1.0 / _SCALE_FAR < size < _SCALE_FAR:
        return _PRINTER_SE, ()
    if abs(size - 1.0) < _SCALE_REPORTED:
        return _printed_se(float(np.log(size))), ()
    # Another format of paper cannot pass for the right size; a few per cent can.
    unsure = abs(size - 1.0) / 2.0 if abs(size - 1.0) < _SCALE_NEAR else 0.0
    return float(np.hypot(_PRINTER_SE, unsure)), (
        Reason("print_scaled", {"size_percent": 100.0 * size}, page.source),
    )


def _printed_se(off: float) -> float:
    """Root mean square of the printer's scale error, where printer and scanner together have the error `off`.

    The printer's likeliest share of it is p = off P^2 / (P^2 + S^2), with variance P^2 S^2 / (P^2 + S^2);
    lengths are not corrected by p, so that its square counts as error.
    """
    both = _PRINTER_SE**2 + _SCANNER_SE**2
    share = off * _PRINTER_SE**2 / both
    return float(np.hypot(share, _PRINTER_SE * _SCANNER_SE / np.sqrt(both)))


# Corners ------------------------------------------------------------------------------------------


def _refined(grey: GreyImage, guess_px: FloatArray) -> tuple[FloatArray, BoolArray]:
    """((k, 4, 2) corners in pixels, (k, 4) whether both sides that meet there could be fitted).

    Straight lines are fitted to a marker's four sides, from guesses (k, 4, 2) that are good to half a
    cell. Across each side the place where the grey passes half-way from the marker's black to the paper's
    white is found by interpolation; a line is fitted to these places, two lines meet in a corner. Blur
    and ink gain move opposite sides by the same amount and leave the marker's middle where it is.

    Everything is done in the marker's own unit square (corners (0,0), (1,0), (1,1), (0,1)), where a
    slanted marker's sides stay straight lines.
    """
    px = np.asarray(guess_px, dtype=np.float64)
    whole = np.zeros(px.shape[:2], dtype=bool)
    for _ in range(_ROUNDS):
        to_px = [through_corners(_START, corners) for corners in px]
        offsets, crossed = _edges(grey, to_px)
        along = np.broadcast_to(_T, offsets.shape)
        lines = robust_lines(along, offsets, crossed.astype(np.float64), _NOISE_FLOOR)
        good = (crossed.mean(axis=1) >= _LEAST_SHARE).reshape(-1, 4)
        whole = good & np.roll(good, 1, axis=1)
        unit = _corners(lines.a.reshape(-1, 4), lines.b.reshape(-1, 4))
        refined = np.stack([mapped(matrix, corners) for matrix, corners in zip(to_px, unit, strict=True)])
        px = np.where(whole[..., None], refined, px)
    return px, whole


_T = np.linspace(_ENDS, 1.0 - _ENDS, _SAMPLES)
_Y = np.linspace(-_REACH, _REACH, _ACROSS)
_PLACES = (
    _START[:, None, None, :]
    + _T[None, :, None, None] * _ALONG[:, None, None, :]
    + _Y[None, None, :, None] * _OUTWARD[:, None, None, :]
).reshape(-1, 2)
"""All places of the four sides, in the marker's own square."""


def _edges(grey: GreyImage, to_px: list[FloatArray]) -> tuple[FloatArray, BoolArray]:
    """(4k, samples) how far outward the sides are crossed, and where a crossing was seen."""
    at = np.concatenate([mapped(matrix, _PLACES) for matrix in to_px]).reshape(-1, _ACROSS, 2)
    values = sampled(grey, at[..., 0], at[..., 1])
    return _crossings(values.astype(np.float64).reshape(-1, _SAMPLES, _ACROSS))


def _crossings(values: FloatArray) -> tuple[FloatArray, BoolArray]:
    """Return where profiles (sides, samples, across) pass half-way from black inside to white outside."""
    third = _ACROSS // 3
    black = np.median(values[:, :, :third], axis=(1, 2))[:, None]
    white = np.median(values[:, :, -third:], axis=(1, 2))[:, None]
    level = (black + white) / 2.0
    light = values > level[..., None]
    change = light[:, :, 1:] & ~light[:, :, :-1]
    # The crossing next to the guess: strokes of the student farther out are of no matter.
    distance = np.where(change, np.abs(_Y[:-1] + _Y[1:])[None, None, :], np.inf)
    at = distance.argmin(axis=2)
    crossed = np.isfinite(distance.min(axis=2)) & (white - black > _LEAST_CONTRAST)
    below = np.take_along_axis(values, at[..., None], axis=2)[..., 0]
    above = np.take_along_axis(values, at[..., None] + 1, axis=2)[..., 0]
    share = np.clip((level - below) / np.maximum(above - below, 1e-9), 0.0, 1.0)
    return np.asarray(_Y[at] + share * (_Y[1] - _Y[0])), crossed


def _corners(a: FloatArray, b: FloatArray) -> FloatArray:
    """(k, 4, 2) where each side's line y = a + b t meets that of the side before it."""
    origin = _START + a[..., None] * _OUTWARD
    along = _ALONG + b[..., None] * _OUTWARD
    before, u = np.roll(origin, 1, axis=1), np.roll(along, 1, axis=1)
    gap = before - origin
    # origin + s along = before + r u
    cross = along[..., 0] * u[..., 1] - along[..., 1] * u[..., 0]
    s = (gap[..., 0] * u[..., 1] - gap[..., 1] * u[..., 0]) / cross
    return np.asarray(origin + s[..., None] * along)
