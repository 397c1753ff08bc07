"""Time against error of finding strokes, beside what libraries offer, over resolutions.

The same sheets of pencil strokes go through every detector. A found segment belongs to a true stroke
where it runs along it: within 0.6 mm and 2 degrees. A stroke is found where such segments cover half
of it; its error is that of the longest of them. Time is the processor's, the picture already in memory
and its millimetres known.
"""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from reference.geometry import ComplexArray
from tests.bench.lines_detectors import DETECTORS, OURS, Detector
from tests.bench.lines_sheets import LineSheet, Segment, noiseless_sheet, pencil_sheet

RESOLUTIONS_DPI = (100.0, 150.0, 200.0, 300.0, 400.0, 600.0)
RESOLUTIONS_QUICK_DPI = (150.0,)
SLOW = frozenset({"scikit-image Hough"})
"""Left out of a quick run."""
_NEAR_MM, _TURN_RAD, _FOUND = 0.6, np.radians(2.0), 0.5
Pair = tuple[float, float]


@dataclass(frozen=True, slots=True)
class LinesRow:
    """One detector at one resolution; errors as (median, p95) over the found solid strokes.

    Attributes
    ----------
    recall_solid, recall_dashed : shares of the true strokes found
    fragments : segments per found stroke
    spurious : segments that belong to no true stroke
    """

    detector: str
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
    """The whole comparison."""

    rows: Sequence[LinesRow]
    noiseless: Noiseless

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return asdict(self)


def measure_lines(*, quick: bool = False) -> LinesFigures:
    """Every detector at each resolution, and our vertices on noiseless strokes."""
    return LinesFigures(tuple(_rows(quick=quick)), measure_noiseless())


def _rows(*, quick: bool) -> Iterator[LinesRow]:
    for dpi in RESOLUTIONS_QUICK_DPI if quick else RESOLUTIONS_DPI:
        sheet = pencil_sheet(dpi)
        for name, detector in DETECTORS.items():
            if not (quick and name in SLOW):
                yield measure_detector(name, detector, sheet, dpi)


def measure_detector(name: str, detector: Detector, sheet: LineSheet, dpi: float) -> LinesRow:
    """One detector on one sheet; the first of our own runs only warms up."""
    if name == OURS:
        detector(sheet)
    start = time.process_time()
    found = detector(sheet)
    ms = 1000.0 * (time.process_time() - start)
    matches = [_match(true, found) for true in sheet.true]
    solid, dashed = matches[: sheet.solid], matches[sheet.solid :]
    seen = [match for match in solid if match is not None]
    used = {row for match in matches if match is not None for row in match["members"]}
    return LinesRow(
        name, dpi, ms,
        recall_solid=len(seen) / len(solid),
        recall_dashed=sum(match is not None for match in dashed) / max(1, len(dashed)),
        fragments=float(np.mean([len(match["members"]) for match in seen])) if seen else 0.0,
        spurious=len(found) - len(used),
        angle_deg=_pair([match["angle"] for match in seen]),
        offset_mm=_pair([match["offset"] for match in seen]),
        length_mm=_pair([match["length"] for match in seen]),
    )  # fmt: skip


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
    """Our strokes on ideal polygons: the vertices are where the lines of neighbouring sides meet."""
    sheet, joints = noiseless_sheet(seed)
    found = DETECTORS[OURS](sheet)
    lines: Mapping[int, Any] = {n: _longest(true, found) for n, true in enumerate(sheet.true)}
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
    """Where two lines meet."""
    u, v = one[1] - one[0], other[1] - other[0]
    share = ((other[0] - one[0]) * np.conj(v)).imag / (u * np.conj(v)).imag
    return complex(one[0] + share * u)
