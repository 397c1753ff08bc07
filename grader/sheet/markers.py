"""Registration of a printed answer sheet by its markers.

Markers are found on a reduced picture, their corners refined at full resolution. Their ids say which
template the page follows, hence where its zones are. Two markers well apart suffice, so that one
torn off or drawn over is not missed; foreign markers fit no template and register nothing.
"""

from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader import aruco
from grader.layout import (
    CALIBRATION,
    DRAWING_MM,
    MARKER_CORNERS,
    MARKER_MM,
    MARKERS_PER_TEMPLATE,
    PAGE_MM,
    Template,
    template_of,
)
from grader.pixels import BoolArray, shrink
from grader.records import FloatArray, GreyImage, Lens, Page, Problem, Sheet
from grader.sheet.identity import identify
from grader.sheet.lens import find_bend
from grader.sheet.marker_edges import refine
from grader.sheet.projection import Marked, Projection, fit_projection

_DETECTION_PX = 1600
"""Long side of the picture on which markers are looked for: on A3 a marker's cell has 7 pixels."""
_CLOSER_PX = 3200
"""Second look, for photos in which the sheet is a small part."""
_LEAST_MARKERS = 2
_LEAST_APART_MM = 100.0
_OFF_MM = 3.0
"""A marker farther off than this from where the others put it is a foreign one; no lens bends as much."""
_LEAST_PX_PER_MM = 2.0
_MAX_RMS_MM = 1.5
"""A wide lens bends the sheet as much; what no lens explains is in `scale_se`."""
_MAX_SE_MM = 0.6
_MAX_UNEVEN = 2.5
"""Largest over smallest scale on the sheet; a photo any more slanted cannot be measured."""
_PRINTER_SE, _SCANNER_SE = 0.002, 0.002
"""Relative error of a printer's scale, rollers and paper included, and of a scanner's stated resolution.

Markers are printed by the same printer, so that what it does to lengths shows in them only against the
stated resolution, and there together with what the scanner does."""
_USUAL_LENGTH_MM = 60.0
_FLAT_MM = 0.12
"""Misfit from which paper that is not flat is told; printers and flatbeds stay under 0.1."""
_MM_PER_INCH = 25.4
_SCALE_TOLD = 0.004
_SCALE_NEAR = 0.1
_SCALE_FAR = 1.6
"""Between A3 and A4 lies a factor of 1.41; what is farther off is a wrong resolution."""


@dataclass(frozen=True, slots=True)
class _Seen:
    """Refined corners of one template's markers, and whose they are (n,)."""

    template: Template
    marked: Marked
    marker: NDArray[np.intp]

    def kept(self, keep: BoolArray) -> Marked:
        """Some of the corners."""
        return Marked(self.marked.mm[keep], self.marked.px[keep], self.marked.outward[keep])


def register(page: Page) -> Sheet | None:
    """The sheet of a printed page; None where its markers are too few, or not ours."""
    for long_side in (_DETECTION_PX, _CLOSER_PX):
        quads = _quads(page.grey, long_side)
        if not quads:
            return None
        seen = _seen(page.grey, quads)
        fit = None if seen is None else _agreed(seen)
        if seen is not None and fit is not None:
            return _sheet(page, seen.template, fit)
        if long_side >= max(page.grey.shape):
            break
    return None


def middles(page: Page) -> tuple[FloatArray, FloatArray]:
    """Middles of the markers that are whole: (n, 2) on the sheet, mm, and (n, 2) as seen, px.

    Ink that spreads moves opposite sides alike and leaves the middle where it is.
    """
    quads = _quads(page.grey, _DETECTION_PX) or _quads(page.grey, _CLOSER_PX)
    seen = _seen(page.grey, quads) if quads else None
    if seen is None:
        return np.zeros((0, 2)), np.zeros((0, 2))
    whole = [seen.marker == number for number in sorted(set(seen.marker)) if sum(seen.marker == number) == 4]
    return (
        np.array([_crossing(seen.marked.mm[own]) for own in whole]).reshape(-1, 2),
        np.array([_crossing(seen.marked.px[own]) for own in whole]).reshape(-1, 2),
    )


def _crossing(corners: FloatArray) -> FloatArray:
    """Where the diagonals of four corners in a row meet."""
    a, b, c, d = corners
    share = np.linalg.solve(np.column_stack([c - a, b - d]), b - a)
    return np.asarray(a + share[0] * (c - a))


def _quads(grey: GreyImage, long_side: int) -> dict[int, FloatArray]:
    """Rough corners (4, 2) in full pixels of the markers whose ids are in use and seen once."""
    small = shrink(grey, min(1.0, long_side / max(grey.shape)))
    corners, ids, _ = _detector().detectMarkers(small)
    numbers = [] if ids is None else [int(number) for number in np.ravel(ids)]
    # Pixel centres are whole numbers: a reduced pixel's centre lies between the centres it averages.
    steps = np.array([grey.shape[1] / small.shape[1], grey.shape[0] / small.shape[0]])
    return {
        number: (quad.reshape(4, 2) + 0.5) * steps - 0.5
        for number, quad in zip(numbers, corners, strict=True)
        if numbers.count(number) == 1 and template_of(number) is not None
    }


def _seen(grey: GreyImage, quads: dict[int, FloatArray]) -> _Seen | None:
    """The refined markers of the template that most of them belong to."""
    votes = Counter(number // MARKERS_PER_TEMPLATE for number in quads)
    chosen, count = votes.most_common(1)[0]
    template = template_of(chosen * MARKERS_PER_TEMPLATE)
    if template is None or count < _LEAST_MARKERS:
        return None
    ours = [number for number in sorted(quads) if number in template.marker_ids]
    corners = refine(grey, np.stack([quads[number] for number in ours]))
    places = np.array(ours) - template.marker_ids.start
    owner = np.broadcast_to(places[:, None], corners.seen.shape)
    at = MARKER_CORNERS[places]
    outward = (at - at.mean(axis=1, keepdims=True)) / (MARKER_MM / 2.0)
    marked = Marked(at[corners.seen], corners.px[corners.seen], outward[corners.seen])
    return _Seen(template, marked, owner[corners.seen])


def _detector() -> cv2.aruco.ArucoDetector:
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = cv2.aruco.CORNER_REFINE_NONE
    settings.adaptiveThreshWinSizeMin = 15
    settings.adaptiveThreshWinSizeMax = 45
    settings.adaptiveThreshWinSizeStep = 30
    settings.minMarkerPerimeterRate = 0.02
    settings.maxMarkerPerimeterRate = 0.4
    settings.errorCorrectionRate = 0.3
    return cv2.aruco.ArucoDetector(aruco.dictionary(), settings)


@dataclass(frozen=True, slots=True)
class _Agreed:
    """The map on which markers agree, and the markers that do."""

    fit: Projection
    marked: Marked


def _agreed(seen: _Seen) -> _Agreed | None:
    """The map on which the markers agree, leaving out at most those far off; None if there is none."""
    keep = np.ones(len(seen.marked), dtype=bool)
    while True:
        if len(set(seen.marker[keep])) < _LEAST_MARKERS:
            return None
        kept = seen.kept(keep)
        if np.ptp(kept.mm, axis=0).max() < _LEAST_APART_MM:
            return None
        fit = fit_projection(kept)
        if fit.misfit_mm.max() <= _OFF_MM:
            return _Agreed(fit, kept) if _plausible(fit) else None
        if len(set(seen.marker[keep])) <= _LEAST_MARKERS + 1:
            return None
        keep &= seen.marker != _odd_one(seen, keep)


def _odd_one(seen: _Seen, keep: BoolArray) -> int:
    """The marker without which the others agree best."""
    numbers = sorted(set(seen.marker[keep]))
    rests = [keep & (seen.marker != number) for number in numbers]
    rms = [fit_projection(seen.kept(rest)).rms_mm for rest in rests]
    return int(numbers[int(np.argmin(rms))])


def _plausible(fit: Projection) -> bool:
    """Whether a camera or scanner could have made this map, well enough to measure by."""
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
    at = _apply(mm_to_px, _GRID_MM)
    right, down = (_apply(mm_to_px, _GRID_MM + step) - at for step in np.eye(2))
    side = np.sign(right[:, 0] * down[:, 1] - right[:, 1] * down[:, 0])
    return np.concatenate([np.hypot(*right.T) * side, np.hypot(*down.T) * side])


def _apply(matrix: FloatArray, points: FloatArray) -> FloatArray:
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def _sheet(page: Page, template: Template, agreed: _Agreed) -> Sheet:
    fit = agreed.fit
    middle = np.array(PAGE_MM) / 2.0
    ends = _apply(fit.mm_to_px, middle + np.array([(-50.0, 0.0), (50.0, 0.0)]))
    right = ends[1] - ends[0]
    px_per_mm = float(np.sqrt(np.mean(np.abs(_local_scales(fit.mm_to_px)) ** 2)))
    printed_se, problems = _against_resolution(page, fit, px_per_mm)
    lens = _lens(page, agreed, printed_se)
    return Sheet(
        mm_to_px=fit.mm_to_px,
        page_mm=PAGE_MM,
        method="markers",
        px_per_mm=px_per_mm,
        # Seen with y down, the sheet's x axis points at this angle; turning back by it is counter-clockwise.
        rotation_deg=float(np.degrees(np.arctan2(right[1], right[0]))) % 360.0 % 360.0,
        residual_mm=fit.rms_mm,
        scale_se=_scale_se(fit, printed_se),
        drawable_mm=DRAWING_MM,
        zones=dict(template.zones),
        identity=identify(page, fit.mm_to_px),
        problems=(*problems, *_told(page, template, fit if lens is None else None)),
        lens=lens,
    )


def _lens(page: Page, agreed: _Agreed, printed_se: float) -> Lens | None:
    shape = page.grey.shape[0], page.grey.shape[1]
    bend, fit = find_bend(agreed.marked, agreed.fit, shape)
    if not bend:
        return None
    return Lens(bend, agreed.fit.mm_to_px, fit.mm_to_px, fit.rms_mm, _scale_se(fit, printed_se))


def _scale_se(fit: Projection, printed_se: float) -> float:
    """Relative error of lengths: print, map, and what the map leaves unexplained between the markers."""
    stretch = fit.se_mm(_GRID_MM).max() / (DRAWING_MM[2] / 2.0)
    return float(np.linalg.norm([printed_se, stretch, fit.rms_mm / _USUAL_LENGTH_MM]))


def _told(page: Page, template: Template, plain: Projection | None) -> Iterator[Problem]:
    if template is CALIBRATION:
        yield Problem("calibration_page", "this is the calibration page, not a drawing", page.source)
    if plain is not None and plain.rms_mm > _FLAT_MM:
        off = f"the printed markers are up to {plain.misfit_mm.max():.1f} mm off one plane"
        yield Problem("sheet_not_flat", f"{off}: the sheet was not flat", page.source)


def _against_resolution(page: Page, fit: Projection, px_per_mm: float) -> tuple[float, tuple[Problem, ...]]:
    """Scale error by the stated resolution: a printer that fits pages to its paper shrinks them.

    A camera's resolution means nothing, and it is known by its slanted view.
    """
    if page.dpi is None or fit.is_slanted:
        return _PRINTER_SE, ()
    stated = float(np.sqrt(page.dpi[0] * page.dpi[1])) / _MM_PER_INCH
    size = px_per_mm / stated
    if not 1.0 / _SCALE_FAR < size < _SCALE_FAR:
        return _PRINTER_SE, ()
    if abs(size - 1.0) < _SCALE_TOLD:
        return _printed_se(float(np.log(size))), ()
    told = (
        f"by the file's resolution the printed sheet has {100 * size:.1f} % of its size:"
        " it was printed or copied at another scale, or the resolution is wrong"
    )
    # Another format of paper cannot pass for the right size; a few per cent can.
    unsure = abs(size - 1.0) / 2.0 if abs(size - 1.0) < _SCALE_NEAR else 0.0
    return float(np.hypot(_PRINTER_SE, unsure)), (Problem("print_scaled", told, page.source),)


def _printed_se(seen: float) -> float:
    """Root mean square of the printer's scale error, where printer and scanner together are off by `seen`.

    The printer's likeliest share of it is p = seen P^2 / (P^2 + S^2), with variance P^2 S^2 / (P^2 + S^2);
    lengths are not corrected by p, so that its square counts as error.
    """
    both = _PRINTER_SE**2 + _SCANNER_SE**2
    share = seen * _PRINTER_SE**2 / both
    return float(np.hypot(share, _PRINTER_SE * _SCANNER_SE / np.sqrt(both)))
