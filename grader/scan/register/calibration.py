"""Read the calibration page: the errors of scale, skew and length of printer and scanner.

The printed markers give the scales along the sheet's axes and their skew by a linear fit to their
middles, which ink that spreads does not move. Segments of known length, read as strokes of a drawing
are read, show what is left: errors of lengths, of directions, and of places over the page.
"""

from dataclasses import dataclass
from pathlib import Path
from typing import Literal

import numpy as np

from grader.documents import CalibrationDocument, CalibrationPoint, CalibrationSegments
from grader.language import N_, ROOT_LANGUAGE, Tongue, tongue
from grader.printed.layout import calibration_segments
from grader.records import FloatArray, Page, Reason, Unread
from grader.scan.decode.pages import page_of
from grader.scan.pixels import lengths_and_directions
from grader.scan.register.distortion import straighten
from grader.scan.register.homography import UNSET_DPI
from grader.scan.register.markers import middles
from grader.scan.register.registration import rectify
from grader.scan.strokes.ink import find_ink
from reference.drawing.canvas import MM_PER_INCH

_LEAST_MARKERS = 4
"""Two scales and a skew, with markers left over to tell their errors."""
_SCALE_REPORTED, _UNEQUAL_REPORTED, _SKEW_REPORTED_DEG = 0.003, 0.001, 0.05
"""Relative scale error, difference of the axes and skew that are worth a remedy."""
_RESIDUAL_REPORTED_MM = 0.12
"""Markers on a flat page stay below this."""
_LENGTH_REPORTED_MM = 0.15
ALL_IS_WELL = N_("printer and scanner are fit for grading")
_PHOTO_MM = 0.4
"""Markers farther off a linear map than this are a camera's view, not a scanner's."""
_NEAR_MM, _NEAR_RAD = 1.5, 0.03
"""Largest distance of a segment's stroke beside it, and its largest turn."""
_SHIFT_MM = 4.0
"""Ends of strokes are known less well than their lines."""


@dataclass(frozen=True, slots=True)
class _Linear:
    """Millimetres to pixels without perspective: (2, 2) matrix, its entries' covariance, markers' misfit."""

    matrix: FloatArray
    cov: FloatArray
    off_mm: FloatArray
    rms_mm: float


def calibrate(path: Path, number: int = 1) -> CalibrationDocument | Unread:
    """Measure one scan of the calibration page; Unread with the reason where it cannot be measured.

    Raises InputFileError for a file that cannot be used.
    """
    page = page_of(path, number)
    sheet = rectify(page)
    if isinstance(sheet, Unread):
        return sheet
    if all(problem.code != "calibration_page" for problem in sheet.problems):
        return Unread("sheet", Reason("sheet_refused", {"why": "not_calibration"}))
    mm, px = middles(page)
    if len(mm) < _LEAST_MARKERS:
        return Unread(
            "sheet",
            Reason("sheet_refused", {"why": "few_markers", "markers": len(mm), "least": _LEAST_MARKERS}),
        )
    linear = _linear(mm, px)
    scanned = sheet.lens is None and linear.rms_mm < _PHOTO_MM
    straight_page, straight_sheet = straighten(page, sheet)
    ink = find_ink(straight_page, straight_sheet)
    if isinstance(ink, Unread):
        return ink
    strokes = ink.strokes.ends
    known = calibration_segments()
    reads = _matched(known, strokes)
    segments = _segments(known, reads)
    scales = _scales(linear, page) if scanned else {}
    points = [
        *(_point("marker", at, off) for at, off in zip(mm, linear.off_mm, strict=True) if scanned),
        *(
            _point("segment", at.mean(axis=0), _aside(at, read))
            for at, read in zip(known, reads, strict=True)
            if read is not None
        ),
    ]
    document = CalibrationDocument(
        source=path.name, page=number, camera=not scanned, px_per_mm=sheet.px_per_mm,
        residual_mm=straight_sheet.residual_mm if not scanned else linear.rms_mm,
        segments=segments, points=points, advice=[], **scales,
    )  # fmt: skip
    return document.model_copy(update={"advice": advice_of(document, tongue(ROOT_LANGUAGE))})


def _linear(mm: FloatArray, px: FloatArray) -> _Linear:
    """Least squares of px = M mm + t over the markers' middles."""
    design = np.column_stack([mm - mm.mean(axis=0), np.ones(len(mm))])
    solved = np.linalg.lstsq(design, px, rcond=None)[0]
    matrix = solved[:2].T
    off_px = px - design @ solved
    off_mm = off_px @ np.linalg.inv(matrix).T
    freedom = max(2 * len(mm) - 6, 1)
    noise = float((off_px**2).sum()) / freedom
    cov = np.linalg.inv(design.T @ design)[:2, :2] * noise
    return _Linear(matrix, cov, off_mm, float(np.sqrt(np.mean((off_mm**2).sum(axis=1)))))


def _scales(linear: _Linear, page: Page) -> dict[str, float | None]:
    """Scales along the sheet's x and y, relative to the stated resolution where there is one."""
    stated = page.dpi if page.dpi is not None and min(page.dpi) >= UNSET_DPI else None
    per_px = MM_PER_INCH / np.array(stated) if stated is not None else np.ones(2)
    along = per_px[:, None] * linear.matrix
    size = np.hypot(*along)
    se = [float(np.sqrt(linear.cov[k, k]) / np.hypot(*linear.matrix[:, k])) for k in (0, 1)]
    square = float(np.degrees(np.arctan2(along[1, 1], along[0, 1]) - np.arctan2(along[1, 0], along[0, 0])))
    return {
        "scale_x": float(size[0]) if stated is not None else None,
        "scale_y": float(size[1]) if stated is not None else None,
        "unequal": float(size[0] / size[1] - 1.0),
        "scale_se": float(max(se)),
        "skew_deg": square - 90.0,
        "turn_deg": float(np.degrees(np.arctan2(along[1, 0], along[0, 0]))),
    }


def _matched(known: FloatArray, strokes: FloatArray) -> list[FloatArray | None]:
    """For each known segment the stroke that it was read as, ends in the same order, or None."""
    both = np.concatenate([strokes, strokes[:, ::-1]])
    if len(both) == 0:
        return [None] * len(known)
    reads: list[FloatArray | None] = []
    for segment in known:
        gap = np.hypot(*np.moveaxis(both - segment, -1, 0)).max(axis=1)
        nearest = both[int(gap.argmin())]
        reads.append(nearest if gap.min() < _SHIFT_MM and _lies_along(segment, nearest) else None)
    return reads


def _lies_along(segment: FloatArray, read: FloatArray) -> bool:
    """Return whether a stroke lies along a segment, not across its end."""
    along = segment[1] - segment[0]
    drawn = read[1] - read[0]
    cross = along[0] * drawn[1] - along[1] * drawn[0]
    off = np.hypot(*_aside(segment, read))
    return bool(abs(np.arctan2(cross, along @ drawn)) < _NEAR_RAD and off < _NEAR_MM)


def _aside(segment: FloatArray, read: FloatArray) -> FloatArray:
    """Return the offset of a stroke's middle beside its segment; the stroke's ends are known less well."""
    _, (u,) = lengths_and_directions(segment[None])
    normal = np.array([-u[1], u[0]])
    return np.asarray(((read - segment).mean(axis=0) @ normal) * normal)


def _segments(known: FloatArray, reads: list[FloatArray | None]) -> CalibrationSegments:
    """Errors of the segments that were read."""
    pairs = [(at, read) for at, read in zip(known, reads, strict=True) if read is not None]
    if not pairs:
        return CalibrationSegments(printed=len(known), read=0)
    true = np.array([at[1] - at[0] for at, _ in pairs])
    drawn = np.array([read[1] - read[0] for _, read in pairs])
    length = np.hypot(*drawn.T) - np.hypot(*true.T)
    cross = true[:, 0] * drawn[:, 1] - true[:, 1] * drawn[:, 0]
    turn = np.degrees(np.arctan2(cross, (true * drawn).sum(axis=1)))
    place = np.array([np.hypot(*_aside(at, read)) for at, read in pairs])
    return CalibrationSegments(
        printed=len(known),
        read=len(pairs),
        length_mean_mm=float(length.mean()),
        length_rms_mm=float(np.sqrt(np.mean(length**2))),
        length_worst_mm=float(np.abs(length).max()),
        direction_rms_deg=float(np.sqrt(np.mean(turn**2))),
        place_rms_mm=float(np.sqrt(np.mean(place**2))),
        place_worst_mm=float(place.max()),
    )


def _point(kind: Literal["marker", "segment"], at: FloatArray, off: FloatArray) -> CalibrationPoint:
    return CalibrationPoint(
        kind=kind, at_mm=(float(at[0]), float(at[1])), off_mm=(float(off[0]), float(off[1]))
    )


def advice_of(document: CalibrationDocument, speaker: Tongue) -> list[str]:
    """Return advice in words of a language; a single sentence if all is well."""
    advice: list[str] = []
    _ = speaker.gettext
    if document.camera:
        told = _("a photo: scale and skew are the camera's; scan the page to measure printer and scanner")
        advice.append(told)
    scale = (
        None
        if document.scale_x is None or document.scale_y is None
        else (document.scale_x + document.scale_y) / 2.0
    )
    if scale is not None and abs(scale - 1.0) > _SCALE_REPORTED:
        told = _(
            "lengths come out at %(share).2f %% of their size: print at 100 %% without fitting to the page,"
            " and scan without scaling; printed sheets stay right, plain ones are off by as much"
        )
        advice.append(told % {"share": 100.0 * scale})
    elif scale is None and not document.camera:
        advice.append(_("the file states no resolution: only the ratio of the scales is known"))
    if document.unequal is not None and abs(document.unequal) > _UNEQUAL_REPORTED:
        told = _(
            "lengths along the sheet differ by %(share)+.2f %% from those across it: use printed sheets,"
            " whose markers undo it, or rule the frame with care"
        )
        advice.append(told % {"share": 100.0 * document.unequal})
    if document.skew_deg is not None and abs(document.skew_deg) > _SKEW_REPORTED_DEG:
        told = _("right angles are off by %(skew)+.2f°: the paper is fed askew")
        advice.append(told % {"skew": document.skew_deg})
    if document.residual_mm > _RESIDUAL_REPORTED_MM:
        advice.append(_("markers are off any even map: the page was not flat, or its feed is uneven"))
    segments = document.segments
    if segments.read < 0.9 * segments.printed:
        few = _("only %(count)s of %(total)s segments are read: scan sharper and darker, at 300 dpi")
        advice.append(few % {"count": segments.read, "total": segments.printed})
    elif segments.length_rms_mm is not None and segments.length_rms_mm > _LENGTH_REPORTED_MM:
        advice.append(_("lengths of the segments scatter: scan at 300 dpi, grey, not black and white"))
    return advice or [_(ALL_IS_WELL)]


def residual_map(document: CalibrationDocument, magnified: float = 200.0) -> str:
    """An SVG of the page in mm: where points are off, and which way, `magnified` times."""
    marks = []
    for point in document.points:
        (x, y), (dx, dy) = point.at_mm, point.off_mm
        colour, size = ("#1d5fa8", 1.5) if point.kind == "marker" else ("#5b6470", 0.7)
        marks.append(
            f'<circle cx="{x:.2f}" cy="{y:.2f}" r="{size}" fill="{colour}"/>'
            f'<line x1="{x:.2f}" y1="{y:.2f}" x2="{x + magnified * dx:.2f}" y2="{y + magnified * dy:.2f}"'
            f' stroke="{colour}" stroke-width="0.6"/>'
        )
    bar = 0.1 * magnified
    return (
        '<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 420 297" width="420mm" height="297mm"'
        ' font-family="sans-serif" font-size="5">'
        '<rect width="420" height="297" fill="white" stroke="#7d8590" stroke-width="0.4"/>'
        f'{"".join(marks)}<line x1="180" y1="150" x2="{180 + bar:.1f}" y2="150" stroke="black"/>'
        f'<text x="{184 + bar:.1f}" y="152">0.1 mm</text></svg>\n'
    )
