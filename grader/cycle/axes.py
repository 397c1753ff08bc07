"""Axes of a diagram in millimetres on paper: round ticks, curves cut at the frame, places for labels."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from reference.canvas import Bounds, Label, Point
from reference.geometry import FloatArray

ROUND = (1.0, 2.0, 2.5, 5.0, 10.0)
DEGREES = (1.0, 2.0, 5.0, 10.0, 15.0, 30.0, 45.0, 60.0, 90.0, 180.0)
DENSE_MM = 0.6
AWAY_MM = (0.9, 2.2, 4.0, 6.5)
"""How far from its curve a label may stand, the nearest first."""
MARGIN_MM = 0.6
NEARBY_MM = 2.5
CELL_MM = 0.25
ON_INK, ON_LABEL, BY_OTHER, FARTHER = 10.0, 40.0, 1.5, 1.2
"""What it costs a label: a point of a curve under it, another label, another curve nearby, a millimetre."""


@dataclass(frozen=True, slots=True)
class Frame:
    """A panel: its box on paper and the values at its edges."""

    box: Bounds
    x: tuple[float, float]
    y: tuple[float, float]

    def across(self, x: FloatArray) -> FloatArray:
        """Millimetres from the sheet's left."""
        left, _, right, _ = self.box
        return np.asarray(left + (x - self.x[0]) * ((right - left) / (self.x[1] - self.x[0])))

    def down(self, y: FloatArray) -> FloatArray:
        """Millimetres from the sheet's top."""
        _, top, _, bottom = self.box
        return np.asarray(bottom - (y - self.y[0]) * ((bottom - top) / (self.y[1] - self.y[0])))

    def place(self, x: float, y: float) -> Point:
        """A point on paper."""
        return float(self.across(np.asarray(x))), float(self.down(np.asarray(y)))


def step_of(span: float, most: float, steps: Sequence[float] | None = None) -> float:
    """The smallest round step that gives at most so many ticks; of `steps`, where they are given."""
    least = span / most
    if steps is not None:
        return next((step for step in steps if step >= least), steps[-1])
    power = 10.0 ** math.floor(math.log10(least))
    return next(part * power for part in ROUND if part * power >= least * (1.0 - 1e-9))


def ticks(low: float, high: float, step: float) -> FloatArray:
    """Multiples of a step from low to high."""
    first, last = math.ceil(low / step - 1e-9), math.floor(high / step + 1e-9)
    return np.asarray(np.arange(first, last + 1) * step, dtype=np.float64)


def decimals_of(step: float) -> int:
    """So many decimals tell multiples of a step exactly."""
    return next(digits for digits in range(16) if abs(step * 10**digits - round(step * 10**digits)) < 1e-6)


def cut(frame: Frame, x: FloatArray, y: FloatArray) -> Iterator[tuple[Point, ...]]:
    """A curve on paper, in the pieces that lie within the frame; samples without a value are passed over."""
    told = np.isfinite(y)
    x, y = x[told], y[told]
    low, high = frame.y
    piece: list[Point] = []
    for k in range(len(x) - 1):
        ends = _within(((x[k], y[k]), (x[k + 1], y[k + 1])), low, high)
        if ends is None:
            if len(piece) > 1:
                yield tuple(piece)
            piece = []
            continue
        start, end = (frame.place(*end) for end in ends)
        if not piece or piece[-1] != start:
            if len(piece) > 1:
                yield tuple(piece)
            piece = [start]
        if end != piece[-1]:
            piece.append(end)
    if len(piece) > 1:
        yield tuple(piece)


def _within(ends: tuple[Point, Point], low: float, high: float) -> tuple[Point, Point] | None:
    """The part of a segment between two heights."""
    (x0, y0), (x1, y1) = ends
    if max(y0, y1) < low or min(y0, y1) > high:
        return None

    def clipped(x: float, y: float) -> Point:
        bound = min(max(y, low), high)
        return (x, y) if bound == y else (x0 + (x1 - x0) * (bound - y0) / (y1 - y0), bound)

    return clipped(x0, y0), clipped(x1, y1)


def dense(pieces: Sequence[Sequence[Point]]) -> NDArray[np.float64]:
    """Points along polylines, no farther apart than a letter's stroke is wide, (P, 2)."""
    found = [np.zeros((0, 2))]
    for piece in pieces:
        line = np.array(piece)
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(line, axis=0).T))])
        at = np.linspace(0.0, along[-1], int(along[-1] / DENSE_MM) + 2)
        found.append(np.column_stack([np.interp(at, along, line[:, 0]), np.interp(at, along, line[:, 1])]))
    return np.concatenate(found)


@dataclass(slots=True)
class Labelling:
    """Labels beside curves, clear of all ink of the panel and of each other, as far as there is room."""

    box: Bounds
    curves: list[NDArray[np.float64]]
    """Points along each curve, (P, 2)."""
    other: NDArray[np.float64]
    """Points along other lines, (P, 2)."""
    taken: list[Bounds]

    def beside(self, curve: int, label: Label) -> Label:
        """The label in the best place beside a curve; it is written at its middle."""
        left, top, right, bottom = label.bounds
        half = np.array([(right - left) / 2.0, (bottom - top) / 2.0])
        middles, far = self._places(self.curves[curve], half)
        if not len(middles):
            return label
        ink = _Ink(self.box, np.concatenate([*self.curves, self.other]))
        others = np.concatenate([np.zeros((0, 2)), *(c for k, c in enumerate(self.curves) if k != curve)])
        cost = FARTHER * far + ON_INK * ink.within(middles, half + MARGIN_MM)
        cost = cost + BY_OTHER * _Ink(self.box, others).within(middles, half + NEARBY_MM)
        for box in self.taken:
            centre, reach = np.array([box[0] + box[2], box[1] + box[3]]) / 2.0, _half(box)
            cost = cost + ON_LABEL * np.all(np.abs(middles - centre) < half + reach + MARGIN_MM, axis=1)
        x, y = middles[int(np.argmin(cost))]
        best = (x - half[0], y - half[1], x + half[0], y + half[1])
        self.taken.append(best)
        rise = label.at[1] - top
        return Label((best[0], best[1] + rise), label.text, label.size, "start", label.colour, label.italic)

    def _places(
        self, points: NDArray[np.float64], half: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], FloatArray]:
        """Middles of labels beside points of a curve, (P, 2), and how far-fetched each is."""
        near = points[:: max(1, len(points) // 150)]
        middles, far = [], []
        for away in AWAY_MM:
            for way in ((0, -1), (0, 1), (1, 0), (-1, 0), (0.8, -0.8), (-0.8, -0.8), (0.8, 0.8), (-0.8, 0.8)):
                middles.append(near + np.array(way) * (half + away))
                far.append(np.full(len(near), away + 0.2 * abs(way[0])))
        every, cost = np.concatenate(middles), np.concatenate(far)
        low, high = np.array(self.box[:2]) + half + 0.5, np.array(self.box[2:]) - half - 0.5
        fits = np.all((every >= low) & (every <= high), axis=1)
        return every[fits], cost[fits]


def _half(box: Bounds) -> NDArray[np.float64]:
    return np.array([box[2] - box[0], box[3] - box[1]]) / 2.0


class _Ink:
    """How much ink there is in boxes: points counted in cells, summed up from the box's corner."""

    def __init__(self, box: Bounds, points: NDArray[np.float64]) -> None:
        self.corner = np.array(box[:2])
        shape = np.ceil((np.array(box[2:]) - self.corner) / CELL_MM).astype(int) + 1
        cells = np.clip(((points - self.corner) / CELL_MM).astype(int), 0, shape - 1)
        counted = np.zeros(shape + 1)
        np.add.at(counted, (cells[:, 0] + 1, cells[:, 1] + 1), 1.0)
        self.summed = counted.cumsum(axis=0).cumsum(axis=1)

    def within(self, middles: NDArray[np.float64], half: NDArray[np.float64]) -> FloatArray:
        """Points in each box about a middle, (P,)."""
        most = np.array(self.summed.shape) - 1
        low = np.clip(np.floor((middles - half - self.corner) / CELL_MM).astype(int), 0, most)
        high = np.clip(np.ceil((middles + half - self.corner) / CELL_MM).astype(int), 0, most)
        summed = self.summed
        return np.asarray(
            summed[high[:, 0], high[:, 1]]
            - summed[low[:, 0], high[:, 1]]
            - summed[high[:, 0], low[:, 1]]
            + summed[low[:, 0], low[:, 1]]
        )
