"""Reading measured on simulated sheets whose truth is known.

A vector counts as *read* where it is reported with at least the rubric's confidence, as *doubtful*
below it, as *unread* where it is not reported. A *misread* is reported with confidence and wrong by
more than 1 mm, or reported though it was not drawn. The error of a vector is taken to its nodes or
to its stroke, whichever is nearer: a stroke may miss the nodes that it joins, and no reader can know
which of the two was meant.
"""

import statistics
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from grader.pipeline import Place, read, see
from grader.records import Figure, ReadVector, Sheet
from grader.rubric import load_rubric
from grader.simulation import SimulatedSheet, any_settings, simulate
from reference.assignment import Assignment, load_assignment

RESOLUTIONS_DPI = (150.0, 300.0)
ASSIGNMENTS = ("pump", "press", "engine")
STUDENTS, STUDENTS_QUICK = 12, 2
LEAST_MM = 5.0
"""Shorter vectors are not counted: their ends lie under arrowheads and letters."""
MISREAD_MM = 1.0
UPRIGHT_DEG = 45.0
SCALE_SHARE = 0.01
STAGES = ("decode", "sheet", "ink", "reading")


@dataclass(slots=True)
class _Tally:
    """What was seen so far."""

    sheets: int = 0
    turned: int = 0
    off_scale: int = 0
    times_ms: dict[str, list[float]] = field(default_factory=lambda: {stage: [] for stage in STAGES})
    node_errors_mm: list[float] = field(default_factory=list)
    counts: dict[str, int] = field(
        default_factory=lambda: {"read": 0, "doubtful": 0, "unread": 0, "misread": 0, "beside": 0}
    )


@dataclass(frozen=True, slots=True)
class ReadingRow:
    """Reading at one resolution.

    Attributes
    ----------
    turned, off_scale : pages taken for upside down or sideways, pages whose scale is off by over 1 %
    times_ms : median milliseconds per page by stage
    node_median_mm, node_p95_mm, node_worst_mm : distance of confidently read nodes from the truth
    read, doubtful, unread : shares of the vectors drawn
    misreads : confident and wrong by more than 1 mm, or not drawn at all: a number, not a share
    """

    dpi: float
    sheets: int
    turned: int
    off_scale: int
    vectors: int
    times_ms: Mapping[str, float]
    node_median_mm: float | None
    node_p95_mm: float | None
    node_worst_mm: float | None
    read: float
    doubtful: float
    unread: float
    misreads: int

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return asdict(self)


def measure_reading(*, quick: bool = False, first_seed: int = 1) -> Iterator[ReadingRow]:
    """The figures of a mixed class on a flatbed, at each resolution; the same students at each."""
    students = STUDENTS_QUICK if quick else STUDENTS
    for dpi in RESOLUTIONS_DPI:
        tally = _Tally()
        for name in ASSIGNMENTS:
            for seed in range(first_seed, first_seed + students):
                _one_student(tally, load_assignment(name), seed, dpi)
        yield _row(dpi, tally)


def _one_student(tally: _Tally, assignment: Assignment, seed: int, dpi: float) -> None:
    variants = assignment.variants()
    variant = variants[seed % len(variants)]
    rubric = load_rubric(assignment.file.rubric, beside=assignment.path)
    sheets = simulate(assignment, variant, seed, any_settings(seed, device="flatbed", dpi=dpi))
    declared = {name: f"{value!r} {_UNITS[name]}" for name, value in _declared(sheets).items()}
    with tempfile.TemporaryDirectory() as folder:
        paths = [sheet.save(Path(folder) / f"s{index}") for index, sheet in enumerate(sheets)]
        seen = [see(Place(path, 1, path.name)) for path in paths]
    readings = read(seen, assignment, variant, declared, rubric.vectors)
    wanted = frozenset(rubric.vectors)
    for sheet, page, reading in zip(sheets, seen, readings, strict=True):
        _count_page(tally, sheet.truth, page.sheet)
        for stage in STAGES:
            tally.times_ms[stage].append(page.timing_ms.get(stage, 0.0))
        for name, truth in sheet.truth["figures"].items():
            _count(tally, truth, reading.figures.get(name), rubric.least_confidence, wanted)


_UNITS = {"kL": "m/mm", "kv": "(m/s)/mm", "ka": "(m/s^2)/mm"}


def _declared(sheets: Sequence[SimulatedSheet]) -> dict[str, float]:
    scales: dict[str, float] = sheets[0].truth["scales"]["declared"]
    return scales


def _count_page(tally: _Tally, truth: Mapping[str, Any], sheet: Sheet | None) -> None:
    tally.sheets += 1
    if sheet is not None:
        turn = (sheet.rotation_deg - truth["rotation_deg"] + 180.0) % 360.0 - 180.0
        tally.turned += abs(turn) > UPRIGHT_DEG
        tally.off_scale += abs(sheet.px_per_mm / truth["px_per_mm"] - 1.0) > SCALE_SHARE


def _count(
    tally: _Tally, truth: Mapping[str, Any], figure: Figure | None, least: float, wanted: frozenset[str]
) -> None:
    """One figure's nodes and vectors."""
    found = figure or Figure({}, {})
    for node, (x, y) in truth["nodes"].items():
        read_as = found.nodes.get(node)
        if read_as is not None and read_as.confidence >= least:
            tally.node_errors_mm.append(abs(read_as.at - complex(x, -y)))
    drawn = truth.get("vectors", {})
    for vector in wanted & {*drawn, *truth.get("missing", {})}:
        tally.counts[_kind(drawn.get(vector), found.vectors.get(vector), least)] += 1


def _kind(truth: Mapping[str, Any] | None, found: ReadVector | None, least: float) -> str:
    """How one vector fared; `beside` does not count."""
    length_mm = None if found is None else found.length_mm
    sure = found is not None and found.confidence >= least
    if truth is None:
        return "misread" if sure and (length_mm or 0.0) >= LEAST_MM else "beside"
    if truth["length_mm"] < LEAST_MM:
        return "beside"
    if found is None or length_mm is None:
        return "unread"
    if not sure:
        return "doubtful"
    return "misread" if _error_mm(truth, found) > MISREAD_MM else "read"


def _error_mm(truth: Mapping[str, Any], found: ReadVector) -> float:
    meant = [truth["length_mm"] * np.exp(1j * np.radians(truth["direction_deg"] or 0.0))]
    if truth["line_mm"] is not None:
        (x1, y1), (x2, y2) = truth["line_mm"]
        meant.append(complex(x2 - x1, y1 - y2))
    angle = np.radians(found.direction_deg or 0.0)
    return float(min(abs((found.length_mm or 0.0) * np.exp(1j * angle) - vector) for vector in meant))


def _row(dpi: float, tally: _Tally) -> ReadingRow:
    counts = tally.counts
    vectors = counts["read"] + counts["doubtful"] + counts["unread"] + counts["misread"]
    errors = np.array(tally.node_errors_mm)
    median, p95, worst = (float(np.quantile(errors, q)) if errors.size else None for q in (0.5, 0.95, 1.0))
    return ReadingRow(
        dpi=dpi,
        sheets=tally.sheets,
        turned=tally.turned,
        off_scale=tally.off_scale,
        vectors=vectors,
        times_ms={stage: statistics.median(spent) for stage, spent in tally.times_ms.items()},
        node_median_mm=median,
        node_p95_mm=p95,
        node_worst_mm=worst,
        read=counts["read"] / max(vectors, 1),
        doubtful=counts["doubtful"] / max(vectors, 1),
        unread=counts["unread"] / max(vectors, 1),
        misreads=counts["misread"],
    )
