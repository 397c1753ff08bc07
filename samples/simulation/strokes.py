"""A pen's stroke, and the hand's wobble along it.

Positions are complex sheet millimetres, x - i y (y up).
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

ComplexArray = NDArray[np.complex128]
FloatArray = NDArray[np.float64]
GreyImage = NDArray[np.uint8]
Rng = np.random.Generator

_STEP_MM = 1.5
_WAVE_MM = (18.0, 90.0)
"""Wavelengths of a hand's wobble along a ruler or a free line."""


@dataclass(frozen=True, slots=True)
class PenWidth:
    """A pen: its width, darkness and unevenness.

    Attributes
    ----------
    layer : strokes of one layer share colour and grain
    width_mm, dark : mean width of the stroke and share of light it takes, 0..1
    pressure : relative variation of width and darkness along a stroke
    wobble_mm : standard deviation of the centre line about a straight line
    """

    layer: str
    width_mm: float
    dark: float
    pressure: float = 0.1
    wobble_mm: float = 0.04


@dataclass(frozen=True, slots=True)
class InkStroke:
    """A drawn polyline: points (n,), width (n,) mm and darkness (n,) 0..1, in a layer of ink."""

    points: ComplexArray
    width: FloatArray
    dark: FloatArray
    layer: str


@dataclass(frozen=True, slots=True)
class Dash:
    """Lengths of dash, gap (and dot) in millimetres; a dot of zero makes plain dashes."""

    dash_mm: float
    gap_mm: float
    dot_mm: float = 0.0


def wave(rng: Rng, along_mm: FloatArray, wavelengths_mm: tuple[float, float] = _WAVE_MM) -> FloatArray:
    """Smooth noise of unit variance along a stroke: four waves of random length and phase."""
    lengths = np.exp(rng.uniform(np.log(wavelengths_mm[0]), np.log(wavelengths_mm[1]), 4))
    phases = rng.uniform(0.0, 2.0 * np.pi, 4)
    waves = np.cos(2.0 * np.pi * along_mm[:, None] / lengths + phases)
    return np.asarray(waves.sum(axis=1) / np.sqrt(2.0))


def straight(rng: Rng, pen: PenWidth, p: complex, q: complex) -> InkStroke:
    """A line from p to q; its wobble has no share of offset or direction (least squares)."""
    length = abs(q - p)
    count = max(2, int(np.ceil(length / _STEP_MM)) + 1)
    share = np.linspace(0.0, 1.0, count)
    points: ComplexArray = np.asarray(p + (q - p) * share, dtype=np.complex128)
    if count > 4 and pen.wobble_mm > 0:
        offset = wave(rng, share * length) * pen.wobble_mm * min(1.0, length / 30.0)
        offset -= np.polyval(np.polyfit(share, offset, 1), share)
        points += 1j * (q - p) / length * offset
    return inked(rng, pen, points)


def inked(rng: Rng, pen: PenWidth, points: ComplexArray) -> InkStroke:
    """A stroke through given points, with the pressure of the hand."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(points)))])
    press = 1.0 + pen.pressure * np.clip(wave(rng, along), -2.0, 2.0)
    width = np.maximum(pen.width_mm * (1.0 + 0.6 * (press - 1.0)), 0.08)
    return InkStroke(points, width, np.clip(pen.dark * press, 0.02, 1.0), pen.layer)


def dashed(rng: Rng, stroke: InkStroke, dash: Dash) -> list[InkStroke]:
    """Cut a stroke into dashes (and dots) of unequal length."""
    along = np.concatenate([[0.0], np.cumsum(np.abs(np.diff(stroke.points)))])
    return [_cut(stroke, along, low, high) for low, high in _spans(rng, float(along[-1]), dash)]


def _spans(rng: Rng, length: float, dash: Dash) -> Iterator[tuple[float, float]]:
    at, dot = 0.0, False
    while at < length:
        ink = dash.dot_mm if dot else dash.dash_mm * rng.uniform(0.8, 1.2)
        yield at, min(at + max(ink, 0.2), length)
        at += ink + dash.gap_mm * rng.uniform(0.8, 1.25)
        dot = not dot and dash.dot_mm > 0


def _cut(stroke: InkStroke, along: FloatArray, low: float, high: float) -> InkStroke:
    inner = (along > low) & (along < high)
    at = np.concatenate([[low], along[inner], [high]])
    points = np.interp(at, along, stroke.points.real) + 1j * np.interp(at, along, stroke.points.imag)
    width, dark = np.interp(at, along, stroke.width), np.interp(at, along, stroke.dark)
    return InkStroke(points, width, dark, stroke.layer)


def arc(centre: complex, radius: float, start_rad: float, sweep_rad: float) -> ComplexArray:
    """Points of a circular arc, every half millimetre or finer."""
    count = max(8, int(np.ceil(abs(sweep_rad) * radius / 0.5)) + 1)
    return np.asarray(centre + radius * np.exp(1j * (start_rad + np.linspace(0.0, sweep_rad, count))))


def smooth(corners: ComplexArray, per_span: int = 6) -> ComplexArray:
    """A Catmull-Rom curve through the points."""
    if len(corners) < 3:
        return corners
    closed = abs(corners[0] - corners[-1]) < 1e-9
    before = corners[-2] if closed else 2 * corners[0] - corners[1]
    after = corners[1] if closed else 2 * corners[-1] - corners[-2]
    p = np.concatenate([[before], corners, [after]])
    t = (np.arange(per_span) / per_span)[None, :]
    p0, p1, p2, p3 = (p[k : len(p) - 3 + k, None] for k in range(4))
    curve = p1 + 0.5 * t * (p2 - p0 + t * (2 * p0 - 5 * p1 + 4 * p2 - p3 + t * (3 * (p1 - p2) + p3 - p0)))
    return np.concatenate([curve.reshape(-1), corners[-1:]])
