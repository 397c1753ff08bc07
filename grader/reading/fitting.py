"""Nodes from the strokes alone: each node lies on the lines of its strokes, near the ends they have."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from grader.reading.lines import Lines
from grader.reading.matching import Explanation
from grader.records import FloatArray
from reference.geometry import ComplexArray

ROUNDS = 5
LEAST_REDRAW_MM = 0.12
MOST_REDRAW_MM = 0.6
END_MM = 0.25
END_REACH_MM = 4.0
CENTRE_MM = 0.2
"""How far a circle drawn around a node is off it."""
RUN_ON = 0.25
"""Density of ends run on past their node, relative to that of ends at it."""
LOOSE_MM = 6.0
"""Standard error of the belief that keeps unseen nodes from running away: it decides nothing else."""


@dataclass(frozen=True, slots=True)
class Fit:
    """Nodes fitted to strokes.

    Attributes
    ----------
    at, cov : (n,) complex mm and (2n, 2n) covariance
    redraw_mm : how far strokes miss their nodes on this figure
    residual_mm : (edges, 2) distance of the tail and the head from the edge's stroke, nan without one
    """

    at: ComplexArray
    cov: FloatArray
    redraw_mm: float
    residual_mm: FloatArray


def fit_nodes(
    found: Explanation,
    lines: Lines,
    end_mm: float = END_MM,
    centres: Mapping[int, complex] | None = None,
) -> Fit:
    """Weighted least squares over all strokes taken, repeated with large misfits held back.

    A stroke's end that lies near its node may be the node or a line run on past it: it counts by the
    probability of the former, given where the node now is.

    Arguments: `centres` of circles drawn around nodes, by node.
    """
    expected = found.expected
    redraw = 0.3
    at = expected.at.copy()
    cov = np.eye(2 * len(at)) * LOOSE_MM**2
    for _ in range(ROUNDS):
        design, values, sigma, is_end = _observations(found, lines, at, redraw, end_mm)
        design, values, sigma, is_end = _with_centres(design, values, sigma, is_end, at, centres or {})
        scaled = np.abs(values / sigma)
        weights = np.where(is_end, _end_weight(scaled), np.minimum(1.0, 2.0 / np.maximum(scaled, 1e-9)))
        rows = design * (np.sqrt(weights) / sigma)[:, None]
        normal = rows.T @ rows + np.eye(2 * len(at)) / LOOSE_MM**2
        cov = np.asarray(np.linalg.inv(normal), dtype=np.float64)
        prior = _pairs(expected.at - at) / LOOSE_MM**2
        step = cov @ (rows.T @ (values * np.sqrt(weights) / sigma) + prior)
        at = at + step[0::2] + 1j * step[1::2]
        redraw = _redraw(found, lines, at, design.shape)
    return Fit(at, cov, redraw, _residuals(found, lines, at))


def _with_centres(  # noqa: PLR0913
    design: FloatArray,
    values: FloatArray,
    sigma: FloatArray,
    is_end: np.ndarray,
    at: ComplexArray,
    centres: Mapping[int, complex],
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    rows, missing = [], []
    for node, centre in centres.items():
        for axis, value in enumerate(((centre - at[node]).real, (centre - at[node]).imag)):
            row = np.zeros(2 * len(at))
            row[2 * node + axis] = 1.0
            rows.append(row)
            missing.append(value)
    if not rows:
        return design, values, sigma, is_end
    return (
        np.vstack([design, rows]),
        np.append(values, missing),
        np.append(sigma, np.full(len(rows), CENTRE_MM)),
        np.append(is_end, np.zeros(len(rows), dtype=bool)),
    )


def _end_weight(scaled: FloatArray) -> FloatArray:
    """Probability that an end this many standard errors off its node is meant to be at it."""
    at_node = np.exp(-0.5 * scaled**2)
    return np.asarray(at_node / (at_node + RUN_ON))


def _pairs(values: ComplexArray) -> FloatArray:
    return np.column_stack([values.real, values.imag]).ravel()


def _observations(
    found: Explanation, lines: Lines, at: ComplexArray, redraw: float, end_mm: float
) -> tuple[FloatArray, FloatArray, FloatArray, np.ndarray]:
    """Rows of the design, what is missing in each (mm), standard errors, whether it is of an end."""
    rows, values, sigmas, of_end = [], [], [], []
    middles = lines.middle
    for index, edge in enumerate(found.expected.edges):
        row = int(found.stroke[index])
        if row < 0:
            continue
        along, middle = complex(lines.along[row]), complex(middles[row])
        loose = 0.5 if found.shared[index] else redraw
        for slot, node in enumerate((edge.tail, edge.head)):
            off = (at[node] - middle) * np.conj(along)
            h = np.zeros(2 * len(at))
            h[2 * node : 2 * node + 2] = (-along.imag, along.real)
            rows.append(h)
            values.append(-off.imag)
            sigmas.append(np.sqrt(loose**2 + lines.se_offset[row] ** 2 + (lines.se_angle[row] * off.real) ** 2))
            of_end.append(False)
            end, error = lines.nearer_end(row, complex(at[node]))
            if not found.shared[index] and abs(end - at[node]) < END_REACH_MM:
                h = np.zeros(2 * len(at))
                h[2 * node : 2 * node + 2] = (along.real, along.imag)
                rows.append(h)
                values.append(((end - at[node]) * np.conj(along)).real)
                sigmas.append(np.sqrt(end_mm**2 + error**2))
                of_end.append(True)
    if not rows:
        rows, values, sigmas, of_end = [np.zeros(2 * len(at))], [0.0], [1.0], [False]
    return np.array(rows), np.array(values), np.array(sigmas), np.array(of_end)


def _residuals(found: Explanation, lines: Lines, at: ComplexArray) -> FloatArray:
    off = np.full((len(found.stroke), 2), np.nan)
    middles = lines.middle
    for index, edge in enumerate(found.expected.edges):
        row = int(found.stroke[index])
        if row >= 0:
            for slot, node in enumerate((edge.tail, edge.head)):
                off[index, slot] = ((at[node] - middles[row]) * np.conj(lines.along[row])).imag
    return off


def _redraw(found: Explanation, lines: Lines, at: ComplexArray, shape: tuple[int, ...]) -> float:
    """How far strokes miss nodes here, from what is left over beyond the unknowns."""
    off = _residuals(found, lines, at)
    seen = off[np.isfinite(off)]
    spare = len(seen) - shape[1]
    if spare <= 0:
        return 0.3
    usual = np.sqrt(np.sum(np.minimum(seen**2, 1.0)) + 4 * 0.2**2) / np.sqrt(spare + 4)
    return float(np.clip(usual, LEAST_REDRAW_MM, MOST_REDRAW_MM))
