"""Time and error of finding strokes, over resolutions, on pencil strokes and on ideal ones.

A found segment belongs to a true stroke where it runs along it: within 0.6 mm and 2 degrees. A stroke is
found where such segments cover half of it; its error is that of the longest of them. Time is the processor's,
the picture already in memory and its millimetres known.
"""

import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from grader.records import GreyImage, Page, Sheet, Unread
from grader.scan.strokes.ink import find_ink
from reference.geometry import ComplexArray
from samples.simulation.raster import render
from samples.simulation.scanner import DrawnPaper, digitise
from samples.simulation.settings import PenStyle, Scan
from samples.simulation.sketch import DASHES, MAIN_LAYER
from samples.simulation.strokes import InkStroke, PenWidth, Rng, dashed, straight
from samples.simulation.view import PaperView, view_of
from tests.bench.plain_text import NOTHING, Table

RESOLUTIONS_DPI = (100.0, 150.0, 200.0, 300.0, 400.0, 600.0)
RESOLUTIONS_QUICK_DPI = (150.0,)
_NEAR_MM, _TURN_RAD, _FOUND = 0.6, np.radians(2.0), 0.5
Pair = tuple[float, float]
Segment = tuple[complex, complex]
"""Two ends, complex sheet millimetres, y up."""
SOLID, DASHED = 60, 24
_ROOM_MM = (25.0, 395.0, 20.0, 277.0)
_LENGTHS_MM = (8.0, 110.0)
_WIDTHS_MM = (0.3, 0.7)
_APART_MM, _APART_RAD = 1.5, 0.07
"""Nearly parallel strokes keep this distance: which of two is meant must be clear."""
_POLYGONS = 8
_RENDER_DPI = 300.0
_INK = 0.85


@dataclass(frozen=True, slots=True)
class LineSheet:
    """An image and its true strokes.

    Attributes
    ----------
    grey : (h, w) uint8, 255 = paper
    view : sheet millimetres to its pixels
    true : the strokes, solid ones first; `solid` says how many
    """

    grey: GreyImage
    view: PaperView
    true: Sequence[Segment]
    solid: int

    @property
    def page(self) -> Page:
        """The image as a page from intake."""
        return Page("generated", 1, self.grey)

    @property
    def sheet(self) -> Sheet:
        """The page registered without error, so that only the lines are measured."""
        return Sheet(
            mm_to_px=self.view.homography, page_mm=(420.0, 297.0), method="markers",
            px_per_mm=self.view.px_per_mm, rotation_deg=0.0, residual_mm=0.0, scale_se=0.0,
            drawable_mm=(10.0, 10.0, 400.0, 277.0),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class LinesRow:
    """One resolution; errors as (median, p95) over the found solid strokes.

    Attributes
    ----------
    recall_solid, recall_dashed : shares of the true strokes found
    fragments : segments per found stroke
    spurious : segments that belong to no true stroke
    """

    dpi: float
    ms: float
    recall_solid: float
    recall_dashed: float
    fragments: float
    spurious: int
    angle_deg: Pair | None
    offset_mm: Pair | None
    length_mm: Pair | None


@dataclass(frozen=True, slots=True)
class Noiseless:
    """Vertices as intersections of fitted strokes, on ideal strokes: errors in mm."""

    vertices: int
    missed: int
    median_mm: float
    p95_mm: float
    worst_mm: float


@dataclass(frozen=True, slots=True)
class LinesFigures:
    """Every resolution, and the vertices."""

    rows: Sequence[LinesRow]
    noiseless: Noiseless


def measure_lines(*, quick: bool = False) -> LinesFigures:
    """Measure each resolution, and vertices on noiseless strokes."""
    resolutions = RESOLUTIONS_QUICK_DPI if quick else RESOLUTIONS_DPI
    return LinesFigures(tuple(measure_resolution(dpi) for dpi in resolutions), measure_noiseless())


def measure_resolution(dpi: float) -> LinesRow:
    """Measure a sheet of pencil strokes at a resolution; the first run only warms up."""
    sheet = pencil_sheet(dpi)
    strokes_of(sheet)
    start = time.process_time()
    strokes = strokes_of(sheet)
    ms = 1000.0 * (time.process_time() - start)
    matches = [_match(true, strokes) for true in sheet.true]
    solid, dashed = matches[: sheet.solid], matches[sheet.solid :]
    matched = [match for match in solid if match is not None]
    used = {row for match in matches if match is not None for row in match["members"]}
    return LinesRow(
        dpi, ms,
        recall_solid=len(matched) / len(solid),
        recall_dashed=sum(match is not None for match in dashed) / max(1, len(dashed)),
        fragments=float(np.mean([len(match["members"]) for match in matched])) if matched else 0.0,
        spurious=len(strokes) - len(used),
        angle_deg=_pair([match["angle"] for match in matched]),
        offset_mm=_pair([match["offset"] for match in matched]),
        length_mm=_pair([match["length"] for match in matched]),
    )  # fmt: skip


def strokes_of(sheet: LineSheet) -> ComplexArray:
    """Run the whole ink stage with circles, arrowheads, marks and ink map; (n, 2) ends, mm, y up."""
    ink = find_ink(sheet.page, sheet.sheet)
    ends = np.zeros((0, 2, 2)) if isinstance(ink, Unread) else ink.strokes.ends
    return np.asarray(ends[..., 0] - 1j * ends[..., 1])


def _match(true: Segment, found: ComplexArray) -> dict[str, Any] | None:
    """The segments that run along a true stroke, and the errors of the longest; None if it is not found."""
    if not len(found):
        return None
    span = true[1] - true[0]
    length = abs(span)
    local = (found - true[0]) / (span / length)
    along = np.sort(local.real, axis=1)
    low, high = np.maximum(along[:, 0], 0.0), np.minimum(along[:, 1], length)
    turn = np.angle((local[:, 1] - local[:, 0]) ** 2) / 2.0
    near = np.abs(local.imag).max(axis=1) <= _NEAR_MM + np.maximum(along[:, 1] - length, -along[:, 0]).clip(0)
    members = np.flatnonzero((high > low) & (np.abs(turn) <= _TURN_RAD) & near)
    grid = np.linspace(0.0, length, 200)
    covered = ((grid[:, None] >= low[members]) & (grid[:, None] <= high[members])).any(axis=1)
    if covered.mean() < _FOUND:
        return None
    best = members[np.argmax(high[members] - low[members])]
    return {
        "members": members.tolist(),
        "angle": float(np.degrees(abs(turn[best]))),
        "offset": float(abs(local[best].imag.mean())),
        "length": float(abs(along[best, 1] - along[best, 0] - length)),
    }


def _pair(errors: Sequence[float]) -> Pair | None:
    return (float(np.quantile(errors, 0.5)), float(np.quantile(errors, 0.95))) if errors else None


def measure_noiseless(seed: int = 1) -> Noiseless:
    """Measure our strokes on ideal polygons; the vertices are intersections of neighbouring sides."""
    sheet, joints = noiseless_sheet(seed)
    strokes = strokes_of(sheet)
    lines = [_longest(true, strokes) for true in sheet.true]
    errors, missed = [], 0
    for before, after in joints:
        one, other = lines[before], lines[after]
        if one is None or other is None:
            missed += 1
        else:
            errors.append(abs(_meeting(one, other) - sheet.true[after][0]))
    median, p95, worst = (float(np.quantile(errors, q)) if errors else np.inf for q in (0.5, 0.95, 1.0))
    return Noiseless(len(joints), missed, median, p95, worst)


def _longest(true: Segment, found: ComplexArray) -> ComplexArray | None:
    match = _match(true, found)
    if match is None:
        return None
    rows = found[match["members"]]
    return np.asarray(rows[np.argmax(np.abs(rows[:, 1] - rows[:, 0]))])


def _meeting(one: ComplexArray, other: ComplexArray) -> complex:
    """The intersection of two lines."""
    u, v = one[1] - one[0], other[1] - other[0]
    share = ((other[0] - one[0]) * np.conj(v)).imag / (u * np.conj(v)).imag
    return complex(one[0] + share * u)


def pencil_sheet(dpi: float, seed: int = 1) -> LineSheet:
    """Random pencil strokes, solid and dashed, scanned askew with noise: the same at each resolution."""
    rng = np.random.default_rng([seed, 1])
    true = _scattered(rng, SOLID + DASHED)
    strokes: list[InkStroke] = []
    for number, (p, q) in enumerate(true):
        dark = rng.uniform(0.45, 0.8)
        stroke = straight(rng, PenWidth(MAIN_LAYER, rng.uniform(*_WIDTHS_MM), dark, 0.12, 0.0), p, q)
        strokes.extend([stroke] if number < SOLID else dashed(rng, stroke, DASHES))
    scan = Scan(dpi=dpi, skew_deg=0.6, stretch=0.0)
    scanner = np.random.default_rng([seed, 2])
    view = view_of(scan, scanner)
    pens = PenStyle(grain=0.35, smudges=1)
    grey = digitise(DrawnPaper(strokes, pens), scan, view, scanner)
    return LineSheet(grey, view, true, SOLID)


def _scattered(rng: Rng, count: int) -> list[Segment]:
    """Segments that may cross, but are not nearly parallel neighbours."""
    kept: list[Segment] = []
    left, right, low, high = _ROOM_MM
    while len(kept) < count:
        middle = complex(rng.uniform(left, right), -rng.uniform(low, high))
        half = 0.5 * rng.uniform(*_LENGTHS_MM) * np.exp(1j * rng.uniform(0.0, np.pi))
        one = complex(middle - half), complex(middle + half)
        inside = all(left < end.real < right and low < -end.imag < high for end in one)
        if inside and not any(_close(one, other) for other in kept):
            kept.append(one)
    return kept


def _close(one: Segment, other: Segment) -> bool:
    """Return whether two segments run side by side, or one continues the other."""
    span, turn = one[1] - one[0], abs(np.sin(np.angle((one[1] - one[0]) / (other[1] - other[0]))))
    if turn > _APART_RAD:
        return False
    local = (np.array(other) - one[0]) / (span / abs(span))
    beside = np.abs(local.imag).min() < _APART_MM or local.imag[0] * local.imag[1] < 0
    return bool(beside and local.real.max() > -8.0 and local.real.min() < abs(span) + 8.0)


def noiseless_sheet(seed: int = 1) -> tuple[LineSheet, list[list[int]]]:
    """Polygons in ideal anti-aliased strokes, and for each vertex the two strokes that meet in it."""
    rng = np.random.default_rng([seed, 3])
    true: list[Segment] = []
    joints: list[list[int]] = []
    for number in range(_POLYGONS):
        centre = complex(70 + 93 * (number % 4), -85 - 125 * (number // 4))
        count = int(rng.integers(3, 6))
        angles = 2 * np.pi * (np.arange(count) + rng.uniform(-0.25, 0.25, count)) / count
        corners = centre + rng.uniform(22.0, 38.0, count) * np.exp(1j * (angles + rng.uniform(0, 6)))
        first = len(true)
        true += [(complex(p), complex(q)) for p, q in zip(corners, np.roll(corners, -1), strict=True)]
        joints += [[first + (k - 1) % count, first + k] for k in range(count)]
    strokes = [
        straight(rng, PenWidth(MAIN_LAYER, rng.uniform(*_WIDTHS_MM), _INK, 0.0, 0.0), p, q) for p, q in true
    ]
    scan = Scan(dpi=_RENDER_DPI, skew_deg=0.0, shift_mm=0.0, stretch=0.0)
    view = view_of(scan, rng)
    cover = render(strokes, view.to_px, view.size)
    return LineSheet(np.asarray(255 - cover, dtype=np.uint8), view, true, len(true)), joints


_HEADS = (
    "dpi", "ms", "recall solid / dashed", "fragments", "spurious", "angle, deg", "offset, mm",
    "length, mm",
)  # fmt: skip


def lines_tables(lines: LinesFigures | None) -> Iterator[Table]:
    """Both tables, where lines were measured."""
    if lines is None:
        return
    title = "Lines: time and error on the same pencil strokes (errors: median / p95)"
    yield title, _HEADS, [_cells(row) for row in lines.rows]
    ideal = lines.noiseless
    heads = ["vertices", "not found", "median, mm", "p95, mm", "worst, mm"]
    errors = [f"{error:.4f}" for error in (ideal.median_mm, ideal.p95_mm, ideal.worst_mm)]
    cells = [str(ideal.vertices), str(ideal.missed), *errors]
    yield "Lines: vertices of ideal strokes, 300 dpi, as intersections of strokes", heads, [cells]


def _cells(row: LinesRow) -> list[str]:
    return [
        f"{row.dpi:g}", f"{row.ms:.0f}",
        f"{row.recall_solid:.2f} / {row.recall_dashed:.2f}", f"{row.fragments:.1f}", str(row.spurious),
        _errors(row.angle_deg, 3), _errors(row.offset_mm, 4), _errors(row.length_mm, 2),
    ]  # fmt: skip


def _errors(pair: Pair | None, digits: int) -> str:
    return NOTHING if pair is None else f"{pair[0]:.{digits}f} / {pair[1]:.{digits}f}"
