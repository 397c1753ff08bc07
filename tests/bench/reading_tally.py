"""What reading came to on the sheets of one scene, counted sheet by sheet."""

import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

import numpy as np

from grader.records import Figure, Reading, ScannedPage
from tests.bench.honesty import Honesty, Spread, calibration, whitened
from tests.bench.reading_places import OnPaper
from tests.bench.reading_truth import SURE, Judged, TrueFigure, each_vector

STAGES = ("decode", "sheet", "ink", "reading")
UPRIGHT_DEG = 45.0
SCALE_SHARE = 0.01


@dataclass(slots=True)
class Tally:
    """What was seen so far.

    Attributes
    ----------
    judged : of every sheet, its asked vectors
    node_errors_mm, near_errors_mm : of confidently read nodes of the plans: to the node, and to the
        nearest of the node and the ends of the strokes that join there
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
    near_errors_mm: list[float] = field(default_factory=list)
    joint_errors_mm: list[float] = field(default_factory=list)
    node_ratios: list[float] = field(default_factory=list)
    times_ms: dict[str, list[float]] = field(default_factory=lambda: {stage: [] for stage in STAGES})
    processor_ms: list[float] = field(default_factory=list)

    def add_times(self, timing_ms: Mapping[str, float], share: float, spent_ms: float) -> None:
        """One page's times: stages by the clock, of which this share was the processor's own."""
        for stage in STAGES:
            self.times_ms[stage].append(share * timing_ms.get(stage, 0.0))
        self.processor_ms.append(spent_ms)

    def add_sheet(
        self, truth: Mapping[str, Any], figures: Mapping[str, TrueFigure], wanted: Sequence[str],
        seen: ScannedPage, reading: Reading,
    ) -> None:  # fmt: skip
        """One page with what was read on it."""
        self.judged.append(list(each_vector(figures, wanted, reading.figures)))
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
                self._add_nodes(drawn, found, figures.get(name), on_paper)

    def _add_nodes(
        self, drawn: Mapping[str, Any], found: Figure, figure: TrueFigure | None, on_paper: OnPaper
    ) -> None:
        """The confidently read nodes of a plan, or joints of the sketch, by their places on the paper."""
        nodes = {name: complex(x, -y) for name, (x, y) in drawn["nodes"].items()}
        sure = [n for n in nodes if n in found.nodes and found.nodes[n].confidence >= SURE]
        if not sure:
            return
        read = on_paper(np.array([found.nodes[name].at for name in sure]))
        for name, at in zip(sure, read.tolist(), strict=True):
            error = at - nodes[name]
            if figure is None:
                self.joint_errors_mm.append(abs(error))
                continue
            self.node_errors_mm.append(abs(error))
            places = [nodes[name], *_stroke_ends(figure, name)]
            self.near_errors_mm.append(min(abs(at - place) for place in places))
            self.node_ratios.extend(whitened(error, found.nodes[name].cov))


def _stroke_ends(figure: TrueFigure, node: str) -> Iterable[complex]:
    """Where the strokes of a node's vectors really begin or end."""
    for vector in figure.vectors.values():
        if vector.stroke is not None and vector.ends is not None:
            for place, end in zip(vector.ends, vector.stroke, strict=True):
                if place == figure.nodes[node]:
                    yield end


@dataclass(frozen=True, slots=True)
class ReadingRow:
    """One scene's figures. Shares are of 1; None where there was nothing to count.

    Attributes
    ----------
    refused, failed : pages refused; students at whose sheets the reader broke down
    sheets_right : share of sheets on which every asked vector of 5 mm or more is right and nothing is
        silently misread
    vectors, right, confident, doubtful, unread : asked vectors of 5 mm and more: how many, and shares
    right_and_confident : what needs no person and is right
    short, short_right : the shorter ones
    misreads, confidently : silent misreads, out of how many reported with confidence
    node_mm, near_mm, joint_mm : median and p95 of confidently read nodes, see `Tally`
    times_ms, processor_ms : medians per page of processor time, by stage and in all
    peak_mb : of a process of its own that reads one student's sheets
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
    near_mm: tuple[float | None, float | None]
    joint_mm: tuple[float | None, float | None]
    honesty: Honesty
    times_ms: Mapping[str, float]
    processor_ms: float
    peak_mb: float | None

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return asdict(self)


def row_of(scene: str, title: str, tally: Tally, peak_mb: float | None) -> ReadingRow:
    """A scene's figures from what was counted."""
    everything = [one for sheet in tally.judged for one in sheet]
    drawn = [one for one in everything if not one.true.missing]
    long, short = ([one for one in drawn if one.short is is_short] for is_short in (False, True))
    counting = [one for one in everything if one.counts and one.sure]
    return ReadingRow(
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
        near_mm=_quantiles(tally.near_errors_mm),
        joint_mm=_quantiles(tally.joint_errors_mm),
        honesty=honesty_of(tally),
        times_ms={stage: _median(spent) for stage, spent in tally.times_ms.items()},
        processor_ms=_median(tally.processor_ms),
        peak_mb=peak_mb,
    )


def honesty_of(tally: Tally) -> Honesty:
    """Spreads of what was read with confidence, and how often each confidence was right."""
    everything = [one for sheet in tally.judged for one in sheet if one.reported and one.counts]
    sure = [one for one in everything if one.sure and not one.true.missing and one.se_mm > 0.0]
    return Honesty(
        Spread.of([one.node_error_mm / one.se_mm for one in sure if one.node_error_mm is not None]),
        Spread.of([one.near_error_mm / one.se_mm for one in sure if one.near_error_mm is not None]),
        Spread.of(tally.node_ratios),
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
