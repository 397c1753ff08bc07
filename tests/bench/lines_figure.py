"""Time against error of line detectors as an SVG figure: a panel each for offset and for length."""

import math
from collections.abc import Callable, Iterator, Sequence

from tests.bench.lines import LinesFigures, LinesRow, Pair

WIDTH, HEIGHT = 920, 430
_PANEL = (330.0, 300.0)
_TOP, _LEFTS = 52.0, (74.0, 496.0)
_COLOURS = ("#00725c", "#c2410c", "#9a6700", "#1d5fa8", "#6d3fb5")
_SHAPES = ("circle", "square", "diamond", "up", "cross")
"""Colour and shape both tell the detector."""
_TEXT, _RULE = 'font-family="sans-serif" font-size="11" fill="#24303c"', "#d8dde3"


class _Axis:
    """A logarithmic axis from decade to decade."""

    def __init__(self, values: Sequence[float], length: float) -> None:
        self.low = math.floor(math.log10(min(values)) + 0.05)
        self.high = max(self.low + 1, math.ceil(math.log10(max(values)) - 0.05))
        self.length = length

    def at(self, value: float) -> float:
        """Where a value stands, from the axis' start."""
        return self.length * (math.log10(value) - self.low) / (self.high - self.low)

    @property
    def decades(self) -> list[float]:
        """The values ruled."""
        return [10.0**power for power in range(self.low, self.high + 1)]


def lines_svg(lines: LinesFigures) -> str:
    """The figure; errors are medians, thin lines reach up to p95, numbers are dpi."""
    panels: Sequence[tuple[str, Callable[[LinesRow], Pair | None]]] = (
        ("offset from the stroke's centre line, mm", lambda row: row.offset_mm),
        ("error of length, mm", lambda row: row.length_mm),
    )
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {HEIGHT}" {_TEXT}>',
        f'<rect width="{WIDTH}" height="{HEIGHT}" fill="#ffffff"/>',
    ]
    for left, (title, error_of) in zip(_LEFTS, panels, strict=True):
        parts.extend(_panel(lines.rows, left, title, error_of))
    parts.extend(_legend(lines.rows))
    return "\n".join([*parts, "</svg>\n"])


def _panel(
    rows: Sequence[LinesRow], left: float, title: str, error_of: Callable[[LinesRow], Pair | None]
) -> Iterator[str]:
    shown = [(row, pair) for row in rows if (pair := error_of(row)) is not None]
    wide, high = _PANEL
    x = _Axis([row.ms for row, _ in shown], wide)
    y = _Axis([error for _, pair in shown for error in pair], high)
    yield f'<g transform="translate({left:g} {_TOP:g})"><text y="-12" font-size="13">{title}</text>'
    for value in x.decades:
        at = x.at(value)
        yield f'<path d="M{at:.1f} 0V{high}" stroke="{_RULE}"/>'
        yield f'<text x="{at:.1f}" y="{high + 16}" text-anchor="middle">{value:g}</text>'
    for value in y.decades:
        at = high - y.at(value)
        yield f'<path d="M0 {at:.1f}H{wide}" stroke="{_RULE}"/>'
        yield f'<text x="-8" y="{at + 4:.1f}" text-anchor="end">{value:g}</text>'
    told = "processor milliseconds per A3 sheet"
    yield f'<text x="{wide / 2}" y="{high + 34}" text-anchor="middle">{told}</text>'
    for number, name in enumerate(dict.fromkeys(row.detector for row, _ in shown)):
        points = [
            (x.at(row.ms), high - y.at(pair[0]), high - y.at(pair[1]), row.dpi)
            for row, pair in shown
            if row.detector == name
        ]
        yield from _series(points, _COLOURS[number % 5], _SHAPES[number % 5])
    yield "</g>"


def _series(points: Sequence[tuple[float, float, float, float]], colour: str, shape: str) -> Iterator[str]:
    """One detector: its resolutions joined, each with its p95 and its dpi."""
    path = "L".join(f"{x:.1f} {y:.1f}" for x, y, _, _ in points)
    yield f'<path d="M{path}" fill="none" stroke="{colour}" stroke-width="1.4" opacity="0.6"/>'
    for x, y, top, dpi in points:
        yield f'<path d="M{x:.1f} {y:.1f}V{top:.1f}" stroke="{colour}" stroke-width="0.8" opacity="0.55"/>'
        yield _mark(x, y, colour, shape)
        if dpi in {points[0][3], points[-1][3]}:
            yield f'<text x="{x + 6:.1f}" y="{y + 12:.1f}" font-size="9" fill="{colour}">{dpi:g}</text>'


def _mark(x: float, y: float, colour: str, shape: str) -> str:
    outline = {
        "square": "M-4 -4H4V4H-4Z", "diamond": "M0 -5.5L5.5 0L0 5.5L-5.5 0Z", "up": "M0 -5.5L5 4H-5Z",
        "cross": "M-4.5 -4.5L4.5 4.5M-4.5 4.5L4.5 -4.5",
        "circle": "M-4.5 0A4.5 4.5 0 1 0 4.5 0A4.5 4.5 0 1 0 -4.5 0Z",
    }[shape]  # fmt: skip
    return (
        f'<path transform="translate({x:.1f} {y:.1f})" d="{outline}" fill="{colour}"'
        f' stroke="{colour}" stroke-width="1.6"/>'
    )


def _legend(rows: Sequence[LinesRow]) -> Iterator[str]:
    at = _LEFTS[0]
    for number, name in enumerate(dict.fromkeys(row.detector for row in rows)):
        yield _mark(at, HEIGHT - 18.0, _COLOURS[number % 5], _SHAPES[number % 5])
        yield f'<text x="{at + 10:g}" y="{HEIGHT - 14}" font-size="12">{name}</text>'
        at += 44.0 + 7.0 * len(name)
