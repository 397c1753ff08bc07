"""The comparison of line detectors as tables of text."""

from collections.abc import Iterator

from tests.bench.lines import LinesFigures, LinesRow, Pair
from tests.bench.plain_text import Table
from tests.bench.tables import NOTHING

_HEADS = (
    "detector", "dpi", "ms", "recall solid / dashed", "fragments", "spurious", "angle, deg", "offset, mm",
    "length, mm",
)  # fmt: skip


def lines_tables(lines: LinesFigures | None) -> Iterator[Table]:
    """Both tables, where lines were measured."""
    if lines is None:
        return
    title = "Lines: time against error on the same pencil strokes (errors: median / p95)"
    yield title, _HEADS, [_cells(row) for row in lines.rows]
    ideal = lines.noiseless
    heads = ["vertices", "not found", "median, mm", "p95, mm", "worst, mm"]
    errors = [f"{error:.4f}" for error in (ideal.median_mm, ideal.p95_mm, ideal.worst_mm)]
    cells = [str(ideal.vertices), str(ideal.missed), *errors]
    yield "Lines: vertices of ideal strokes, 300 dpi, as intersections of ours", heads, [cells]


def _cells(row: LinesRow) -> list[str]:
    return [
        row.detector, f"{row.dpi:g}", f"{row.ms:.0f}",
        f"{row.recall_solid:.2f} / {row.recall_dashed:.2f}", f"{row.fragments:.1f}", str(row.spurious),
        _pair(row.angle_deg, 3), _pair(row.offset_mm, 4), _pair(row.length_mm, 2),
    ]  # fmt: skip


def _pair(pair: Pair | None, digits: int) -> str:
    return NOTHING if pair is None else f"{pair[0]:.{digits}f} / {pair[1]:.{digits}f}"
