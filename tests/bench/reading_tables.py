"""The reading's figures as tables of text: a title, the heads, the rows."""

from collections.abc import Callable, Iterator, Sequence

from tests.bench.honesty import NORMAL_SHARES, Spread
from tests.bench.plain_text import Table
from tests.bench.reading_tally import STAGES, ReadingRow
from tests.bench.tables import NOTHING

Column = tuple[str, Callable[[ReadingRow], str]]


def reading_tables(reading: Sequence[ReadingRow]) -> Iterator[Table]:
    """All tables of the scenes, where any was measured."""
    if reading:
        yield _table("Reading: sheets and vectors", reading, _VECTORS)
        yield _table("Reading: error of confidently read nodes, mm (median / p95)", reading, _NODES)
        shares = " and ".join(f"{100 * share:.1f} %" for share in NORMAL_SHARES)
        title = "Reading: errors over their standard errors: shares below 1 and 1.96, robust rms"
        yield _table(f"{title} (honest: {shares}, 1)", reading, _SPREADS)
        yield _confidence(reading)
        yield _table("Reading: processor milliseconds per page, and peak memory", reading, _TIMES)


def _table(title: str, rows: Sequence[ReadingRow], columns: Sequence[Column]) -> Table:
    return title, [head for head, _ in columns], [[cell(row) for _, cell in columns] for row in rows]


def _percent(share: float | None) -> str:
    return NOTHING if share is None else f"{100 * share:.0f} %"


def _pair(pair: tuple[float | None, float | None]) -> str:
    return NOTHING if pair[0] is None else f"{pair[0]:.3f} / {pair[1]:.3f}"


def _spread(spread: Spread) -> str:
    if spread.rms is None:
        return NOTHING
    return f"{_percent(spread.under_1)}, {_percent(spread.under_196)}, {spread.rms:.2f}"


_SCENE: Column = ("scene", lambda row: row.title)
_VECTORS: Sequence[Column] = (
    _SCENE,
    ("sheets", lambda row: str(row.sheets)),
    ("entirely right", lambda row: _percent(row.sheets_right)),
    ("vectors", lambda row: str(row.vectors)),
    ("right", lambda row: _percent(row.right)),
    ("confident", lambda row: _percent(row.confident)),
    ("doubtful", lambda row: _percent(row.doubtful)),
    ("unread", lambda row: _percent(row.unread)),
    ("under 5 mm: right", lambda row: f"{_percent(row.short_right)} of {row.short}"),
    ("silent misreads", lambda row: f"{row.misreads} of {row.confidently}"),
)
_NODES: Sequence[Column] = (
    _SCENE,
    ("from the node", lambda row: _pair(row.node_mm)),
    ("from the node or its strokes' ends", lambda row: _pair(row.near_mm)),
    ("joints of the sketch", lambda row: _pair(row.joint_mm)),
)
_SPREADS: Sequence[Column] = (
    _SCENE,
    ("lengths, node to node", lambda row: _spread(row.honesty.length_to_nodes)),
    ("lengths, nearer of nodes and stroke", lambda row: _spread(row.honesty.length_to_nearer)),
    ("nodes", lambda row: _spread(row.honesty.nodes)),
    ("lengths, nodes counted", lambda row: f"{row.honesty.length_to_nodes.count}, {row.honesty.nodes.count}"),
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


def _confidence(reading: Sequence[ReadingRow]) -> Table:
    """All scenes together: a bin of one scene is too small."""
    lines = []
    for bins in zip(*(row.honesty.confidence for row in reading), strict=True):
        count = sum(one.count for one in bins)
        mean = sum((one.mean or 0.0) * one.count for one in bins)
        right = sum((one.right or 0.0) * one.count for one in bins)
        told = [f"{mean / count:.3f}", f"{100 * right / count:.1f} %"] if count else [NOTHING, NOTHING]
        lines.append([f"{bins[0].low:g} to {bins[0].high:g}", str(count), *told])
    heads = ["confidence", "vectors reported", "mean confidence", "within 0.5 mm"]
    return "Reading: confidence against what came true (all scenes)", heads, lines
