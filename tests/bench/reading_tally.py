"""Results of reading a scene, counted sheet by sheet, and as tables.

A standard error is right if |error| / se is below 1 in 68.3 % and below 1.96 in 95 % of cases; the robust
root mean square (1.4826 times the median of |error| / se) is then 1. A confidence is right if it equals the
share of right readings among all reported with it.
"""

import statistics
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from grader.records import Figure, FloatArray, Reading, ScannedPage
from tests.bench.plain_text import NOTHING, Table
from tests.bench.reading_truth import NEAR_MM, SURE, Judged, OnPaper, TrueFigure, each_vector

BINS = ((0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.0 + 1e-9))
NORMAL_SHARES = (0.683, 0.95)
_TO_SPREAD = 1.4826
"""The median of |x| to the standard deviation of a Gaussian."""


@dataclass(frozen=True, slots=True)
class ErrorSpread:
    """Errors in units of their standard error: how many, shares below 1 and 1.96, robust rms."""

    count: int
    under_1: float | None
    under_196: float | None
    rms: float | None

    @classmethod
    def of(cls, ratios: Sequence[float]) -> "ErrorSpread":
        """From errors over standard errors, of either sign."""
        if not ratios:
            return cls(0, None, None, None)
        size = np.abs(np.array(ratios))
        return cls(
            len(size), float((size < 1.0).mean()), float((size < 1.96).mean()),
            float(_TO_SPREAD * np.median(size)),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bin:
    """Readings with a confidence from `low` to below `high`, and the share within 0.5 mm."""

    low: float
    high: float
    count: int
    mean: float | None
    right: float | None


def calibration(reported: Sequence[tuple[float, float]]) -> list[Bin]:
    """Bins of (confidence, error in mm), each with the share that was right."""
    values = np.array(reported, dtype=float).reshape(-1, 2)
    found = []
    for low, high in BINS:
        inside = values[(values[:, 0] >= low) & (values[:, 0] < high)]
        mean = float(inside[:, 0].mean()) if len(inside) else None
        right = float((inside[:, 1] <= NEAR_MM).mean()) if len(inside) else None
        found.append(Bin(low, min(high, 1.0), len(inside), mean, right))
    return found


def whitened(error: complex, cov: FloatArray) -> list[float]:
    """A position's error along the two principal axes of its covariance, in standard errors."""
    variances, axes = np.linalg.eigh(cov)
    along = np.array([error.real, error.imag]) @ axes
    return [float(x) for x in along / np.sqrt(np.maximum(variances, 1e-12))]


@dataclass(frozen=True, slots=True)
class Honesty:
    """Spreads of confidently read lengths (node to node) and of nodes."""

    lengths: ErrorSpread
    nodes: ErrorSpread
    confidence: Sequence[Bin]


STAGES = ("decode", "sheet", "ink", "reading", "judging", "picture", "page")
"""Stages of a page, from its file to the student's page; the blankness test is only in the sum."""
UPRIGHT_DEG = 45.0
SCALE_SHARE = 0.01


@dataclass(slots=True)
class ReadingTally:
    """Counts of all pages so far.

    Attributes
    ----------
    judged : the vectors asked for, by sheet
    node_errors_mm : errors of confidently read nodes of the plans
    joint_errors_mm : the same for the sketch's joints
    node_ratios : errors of nodes along principal axes, in standard errors
    """

    refused: int = 0
    failed: int = 0
    turned: int = 0
    off_scale: int = 0
    students: int = 0
    judged: list[list[Judged]] = field(default_factory=list)
    node_errors_mm: list[float] = field(default_factory=list)
    joint_errors_mm: list[float] = field(default_factory=list)
    node_ratios: list[float] = field(default_factory=list)
    times_ms: dict[str, list[float]] = field(default_factory=lambda: {stage: [] for stage in STAGES})
    processor_ms: list[float] = field(default_factory=list)

    def add_times(self, timing_ms: Mapping[str, float], share: float, spent_ms: float) -> None:
        """Add one page's times: stages by the clock, and the processor's share of them."""
        for stage in STAGES:
            self.times_ms[stage].append(share * timing_ms.get(stage, 0.0))
        self.processor_ms.append(spent_ms)

    def add_sheet(
        self, truth: Mapping[str, Any], figures: Mapping[str, TrueFigure], wanted: Sequence[str],
        seen: ScannedPage, reading: Reading,
    ) -> None:  # fmt: skip
        """Add one page with its reading."""
        turn_deg = truth.get("turn_deg", 0.0) if seen.ref.tilt_rad else 0.0
        self.judged.append(list(each_vector(figures, wanted, reading.figures, turn_deg)))
        if seen.sheet is None or seen.image is None:
            self.refused += 1
            return
        turn = (seen.sheet.rotation_deg - truth["rotation_deg"] + 180.0) % 360.0 - 180.0
        self.turned += abs(turn) > UPRIGHT_DEG
        self.off_scale += abs(seen.sheet.px_per_mm / truth["px_per_mm"] - 1.0) > SCALE_SHARE
        on_paper = OnPaper(truth, seen.sheet, seen.image.grey.shape)
        for name, drawn in truth["figures"].items():
            found = reading.figures.get(name)
            if found is not None:
                self._add_nodes(drawn, found, on_paper, is_plan=name in figures)

    def _add_nodes(
        self, drawn: Mapping[str, Any], found: Figure, on_paper: OnPaper, *, is_plan: bool
    ) -> None:
        """Add the confidently read nodes of a plan, or joints of the sketch, by position on the paper."""
        nodes = {name: complex(x, -y) for name, (x, y) in drawn["nodes"].items()}
        sure = [n for n in nodes if n in found.nodes and found.nodes[n].confidence >= SURE]
        if not sure:
            return
        read = on_paper(np.array([found.nodes[name].at for name in sure]))
        for name, at in zip(sure, read.tolist(), strict=True):
            error = at - nodes[name]
            if not is_plan:
                self.joint_errors_mm.append(abs(error))
                continue
            self.node_errors_mm.append(abs(error))
            self.node_ratios.extend(whitened(error, found.nodes[name].cov))


@dataclass(frozen=True, slots=True)
class SceneRow:
    """One scene's figures. Shares are of 1; None where there was nothing to count.

    Attributes
    ----------
    refused, failed : pages refused; students at whose sheets the reader broke down
    sheets_right : share of sheets on which every asked vector of 5 mm or more is right, without any
        silent misread
    vectors, right, confident, doubtful, unread : asked vectors of 5 mm and more: how many, and shares
    right_and_confident : share that is right and needs no person
    short, short_right : the same for shorter vectors
    misreads, confidently : silent misreads, and the vectors reported with confidence
    node_mm, joint_mm : median and p95 of confidently read nodes, see `ReadingTally`
    times_ms, processor_ms : medians per page of processor time, by stage and in total
    peak_mb : peak memory of a process that reads one student's sheets
    """

    scene: str
    title: str
    students: int
    sheets: int
    refused: int
    failed: int
    turned: int
    off_scale: int
    sheets_right: float | None
    vectors: int
    right: float | None
    confident: float | None
    right_and_confident: float | None
    doubtful: float | None
    unread: float | None
    short: int
    short_right: float | None
    misreads: int
    confidently: int
    node_mm: tuple[float | None, float | None]
    joint_mm: tuple[float | None, float | None]
    honesty: Honesty
    times_ms: Mapping[str, float]
    processor_ms: float
    peak_mb: float | None


def row_of(scene: str, title: str, tally: ReadingTally, peak_mb: float | None) -> SceneRow:
    """A scene's figures from its counts."""
    everything = [one for sheet in tally.judged for one in sheet]
    drawn = [one for one in everything if not one.true.missing]
    long, short = ([one for one in drawn if one.short is is_short] for is_short in (False, True))
    counting = [one for one in everything if one.counts and one.sure]
    return SceneRow(
        scene=scene,
        title=title,
        students=tally.students,
        sheets=len(tally.judged),
        refused=tally.refused,
        failed=tally.failed,
        turned=tally.turned,
        off_scale=tally.off_scale,
        sheets_right=_share(_sheet_is_right(sheet) for sheet in tally.judged),
        vectors=len(long),
        right=_share(one.right for one in long),
        confident=_share(one.sure for one in long),
        right_and_confident=_share(one.right and one.sure for one in long),
        doubtful=_share(one.reported and not one.sure for one in long),
        unread=_share(not one.reported for one in long),
        short=len(short),
        short_right=_share(one.right for one in short),
        misreads=sum(one.misread for one in everything),
        confidently=len(counting),
        node_mm=_quantiles(tally.node_errors_mm),
        joint_mm=_quantiles(tally.joint_errors_mm),
        honesty=honesty_of(tally),
        times_ms={stage: _median(spent) for stage, spent in tally.times_ms.items()},
        processor_ms=_median(tally.processor_ms),
        peak_mb=peak_mb,
    )


def honesty_of(tally: ReadingTally) -> Honesty:
    """Spreads of confident readings, and the share of right ones by confidence."""
    everything = [one for sheet in tally.judged for one in sheet if one.reported and one.counts]
    sure = [one for one in everything if one.sure and not one.true.missing and one.se_mm > 0.0]
    return Honesty(
        ErrorSpread.of([one.node_error_mm / one.se_mm for one in sure if one.node_error_mm is not None]),
        ErrorSpread.of(tally.node_ratios),
        calibration([(one.confidence, one.error_mm) for one in everything]),
    )


def _sheet_is_right(sheet: Sequence[Judged]) -> bool:
    return all((one.right or one.short or bool(one.true.missing)) and not one.misread for one in sheet)


def _share(flags: Iterable[bool]) -> float | None:
    told = list(flags)
    return sum(told) / len(told) if told else None


def _median(values: Sequence[float]) -> float:
    return statistics.median(values) if values else 0.0


def _quantiles(errors: Sequence[float]) -> tuple[float | None, float | None]:
    """Median and p95."""
    if not errors:
        return None, None
    return float(np.quantile(errors, 0.5)), float(np.quantile(errors, 0.95))


Column = tuple[str, Callable[[SceneRow], str]]


def reading_tables(reading: Sequence[SceneRow]) -> Iterator[Table]:
    """All tables of the scenes, if any was measured."""
    if reading:
        yield _table("Reading: sheets and vectors", reading, _VECTORS)
        yield _table("Reading: error of confidently read nodes, mm (median / p95)", reading, _NODES)
        shares = " and ".join(f"{100 * share:.1f} %" for share in NORMAL_SHARES)
        title = "Reading: errors over their standard errors: shares below 1 and 1.96, robust rms"
        yield _table(f"{title} (honest: {shares}, 1)", reading, _SPREADS)
        yield _confidence(reading)
        yield _table("Reading: processor milliseconds per page, and peak memory", reading, _TIMES)


def paper_tables(reading: Sequence[SceneRow]) -> Iterator[Table]:
    """The scenes of paper and habits as one short table."""
    yield _table("Reading: paper, habits and copies, each by itself", reading, _PAPER)


def _table(title: str, rows: Sequence[SceneRow], columns: Sequence[Column]) -> Table:
    return title, [head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows]


def percent(share: float | None) -> str:
    """A share in per cent, or a dash for None."""
    return NOTHING if share is None else f"{100 * share:.0f} %"


def pair(errors: tuple[float | None, float | None]) -> str:
    """Median and p95 as text, or a dash for None."""
    return NOTHING if errors[0] is None else f"{errors[0]:.3f} / {errors[1]:.3f}"


def _spread(spread: ErrorSpread) -> str:
    if spread.rms is None:
        return NOTHING
    return f"{percent(spread.under_1)}, {percent(spread.under_196)}, {spread.rms:.2f}"


_SCENE: Column = ("scene", lambda row: row.title)
_VECTORS: Sequence[Column] = (
    _SCENE,
    ("sheets", lambda row: str(row.sheets)),
    ("entirely right", lambda row: percent(row.sheets_right)),
    ("vectors", lambda row: str(row.vectors)),
    ("right", lambda row: percent(row.right)),
    ("confident", lambda row: percent(row.confident)),
    ("doubtful", lambda row: percent(row.doubtful)),
    ("unread", lambda row: percent(row.unread)),
    ("under 5 mm: right", lambda row: f"{percent(row.short_right)} of {row.short}"),
    ("silent misreads", lambda row: f"{row.misreads} of {row.confidently}"),
)
_PAPER: Sequence[Column] = (
    _SCENE,
    ("sheets", lambda row: str(row.sheets)),
    ("vectors", lambda row: str(row.vectors)),
    ("right", lambda row: percent(row.right)),
    ("believed", lambda row: percent(row.confident)),
    ("misread", lambda row: f"{row.misreads} of {row.confidently}"),
    ("refused", lambda row: str(row.refused)),
    ("ms a page", lambda row: f"{row.processor_ms:.0f}"),
)
_NODES: Sequence[Column] = (
    _SCENE,
    ("nodes of the plans", lambda row: pair(row.node_mm)),
    ("joints of the sketch", lambda row: pair(row.joint_mm)),
)
_SPREADS: Sequence[Column] = (
    _SCENE,
    ("lengths", lambda row: _spread(row.honesty.lengths)),
    ("nodes", lambda row: _spread(row.honesty.nodes)),
    ("lengths, nodes counted", lambda row: f"{row.honesty.lengths.count}, {row.honesty.nodes.count}"),
)


def _stage(name: str) -> Column:
    return name, lambda row: f"{row.times_ms[name]:.0f}"


_TIMES: Sequence[Column] = (
    _SCENE,
    *(_stage(name) for name in STAGES),
    ("in all", lambda row: f"{row.processor_ms:.0f}"),
    ("peak MB", lambda row: NOTHING if row.peak_mb is None else f"{row.peak_mb:.0f}"),
    ("refused, broken down", lambda row: f"{row.refused}, {row.failed}"),
    ("turned wrongly", lambda row: str(row.turned)),
    ("scale off by > 1 %", lambda row: str(row.off_scale)),
)


def _confidence(reading: Sequence[SceneRow]) -> Table:
    """Confidences of all scenes together: a bin of one scene is too small."""
    lines = []
    for bins in zip(*(row.honesty.confidence for row in reading), strict=True):
        count = sum(one.count for one in bins)
        mean = sum((one.mean or 0.0) * one.count for one in bins)
        right = sum((one.right or 0.0) * one.count for one in bins)
        told = [f"{mean / count:.3f}", f"{100 * right / count:.1f} %"] if count else [NOTHING, NOTHING]
        lines.append([f"{bins[0].low:g} to {bins[0].high:g}", str(count), *told])
    heads = ["confidence", "vectors reported", "mean confidence", "within 0.5 mm"]
    return "Reading: confidence against what came true (all scenes)", heads, lines
