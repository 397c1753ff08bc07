"""The map from sheet millimetres to pixels that fits printed markers, no freer than they demand.

A flatbed's map is a similarity, a scanner with unequal axes or a skewed feed makes it affine, a
phone's photo is a perspective. Few points cannot tell a perspective apart from noise and would
extrapolate it wildly, so the freest map is taken only where it explains the points better by far.

Ink that spreads, or a copier's threshold, moves all sides of a marker outward alike. This gain is
fitted too: taken for scale it would bend a map that rests on two markers side by side.
"""

from dataclasses import dataclass

import numpy as np

from grader.records import FloatArray

_POINT_SE_MM = 0.02
"""Of a corner found at 150 dpi or better; printers and paper do no better."""
_GAIN_SE_MM = 0.15
"""How far ink spreads on usual printers and copiers."""
_WORTH = 12.0
"""Fall of chi squared for each of two further parameters that makes them worth having."""
_FREEDOMS = (4, 6, 8)
_LEAST_POINTS = 4
_ROUNDS = 12
_SETTLED = 1e-9


@dataclass(frozen=True, slots=True)
class Marked:
    """Corners of markers, on the sheet and as seen.

    Attributes
    ----------
    mm, px : (n, 2)
    outward : (n, 2) where the corner moves when its marker's sides move outward by one millimetre
    """

    mm: FloatArray
    px: FloatArray
    outward: FloatArray

    def __len__(self) -> int:
        return len(self.mm)


@dataclass(frozen=True, slots=True)
class Projection:
    """A fitted map.

    Attributes
    ----------
    mm_to_px : (3, 3), last element 1
    rms_mm : root mean square misfit of the points, the gain taken off
    misfit_mm : (n,) misfit of each point
    gain_mm : how far the markers' sides stand outward of where they should
    params, cov : parameters of `_matrix` (4, 6 or 8), and their covariance
    centre, size : of the points, mm, by which parameters are made alike
    """

    mm_to_px: FloatArray
    rms_mm: float
    misfit_mm: FloatArray
    gain_mm: float
    params: FloatArray
    cov: FloatArray
    centre: FloatArray
    size: float

    @property
    def is_slanted(self) -> bool:
        """Whether a perspective was needed: a camera's picture, no scanner's."""
        return len(self.params) == _FREEDOMS[-1]

    def se_mm(self, points_mm: FloatArray) -> FloatArray:
        """(n,) standard error of the place of points (n, 2)."""
        unit = (points_mm - self.centre) / self.size
        jacobian = _jacobian(np.array([0.0, *self.params]), unit, np.zeros_like(unit))[:, :, 1:]
        spread = np.einsum("nij,jk,nik->n", jacobian, self.cov, jacobian)
        return np.asarray(np.sqrt(spread / 2.0) / _px_per_mm(self.params, self.size))


@dataclass(frozen=True, slots=True)
class _Fit:
    """Gain and parameters of `_matrix` in one array, their covariance, chi squared."""

    found: FloatArray
    cov: FloatArray
    chi2: float


def fit_projection(marked: Marked) -> Projection:
    """The plainest map that explains at least four marked corners; ValueError for fewer."""
    if len(marked) < _LEAST_POINTS:
        raise ValueError(f"at least {_LEAST_POINTS} points are expected, not {len(marked)}")
    centre, size = marked.mm.mean(axis=0), float(np.ptp(marked.mm, axis=0).max()) / 2.0
    unit = Marked((marked.mm - centre) / size, marked.px, marked.outward / size)
    best = _plainest(unit, size)
    gain, params = float(best.found[0]), best.found[1:]
    matrix = _matrix(params)
    misfit = np.hypot(*(_placed(best.found, unit.mm, unit.outward) - unit.px).T) / _px_per_mm(params, size)
    to_unit = np.array([[1.0, 0.0, -centre[0]], [0.0, 1.0, -centre[1]], [0.0, 0.0, size]]) / size
    whole = matrix @ to_unit
    rms = float(np.sqrt(np.mean(misfit**2)))
    # A misfit beyond the corners' own error (bent paper, a lens) makes the map less sure by as much.
    noise = max(1.0, (rms / (_POINT_SE_MM * np.sqrt(2.0))) ** 2)
    cov = best.cov[1:, 1:] * noise
    return Projection(whole / whole[2, 2], rms, misfit, gain, params, cov, centre, size)


def _plainest(unit: Marked, size: float) -> _Fit:
    """The fit with the fewest parameters that a freer one does not beat by far."""
    best = last = _fit(np.array([0.0, *_similarity(unit)]), unit, size)
    for freedom in _FREEDOMS[1:]:
        last = _fit(np.concatenate([last.found, [0.0, 0.0]]), unit, size)
        # The misfit that is left says how good the corners are where they are worse than usual.
        noise = max(1.0, last.chi2 / max(2 * len(unit) - freedom, 1))
        if best.chi2 - last.chi2 > 2 * _WORTH * noise:
            best = last
    return best


def _similarity(unit: Marked) -> FloatArray:
    """Closed form of the best w = s z + t on complex numbers: real and imaginary parts of s and t."""
    z, w = unit.mm[:, 0] + 1j * unit.mm[:, 1], unit.px[:, 0] + 1j * unit.px[:, 1]
    zc, wc = z - z.mean(), w - w.mean()
    s = np.vdot(zc, wc) / np.vdot(zc, zc)
    t = w.mean() - s * z.mean()
    return np.array([s.real, s.imag, t.real, t.imag])


def _matrix(params: FloatArray) -> FloatArray:
    """Similarity (s, t), unequal axes and shear (e, f), perspective (g, h), about the points' middle."""
    p = np.zeros(8)
    p[: len(params)] = params
    a, b, x, y, e, f, g, h = p
    turn = np.array([[a, -b], [b, a]])
    linear = turn @ np.array([[1.0 + e, f], [f, 1.0 - e]])
    return np.array([[linear[0, 0], linear[0, 1], x], [linear[1, 0], linear[1, 1], y], [g, h, 1.0]])


def _px_per_mm(params: FloatArray, size: float) -> float:
    return float(np.sqrt(abs(np.linalg.det(_matrix(params)[:2, :2])))) / size


def _placed(found: FloatArray, unit: FloatArray, outward: FloatArray) -> FloatArray:
    """(n, 2) pixels of points, moved outward by the gain."""
    matrix = _matrix(found[1:])
    mapped = (unit + found[0] * outward) @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def _steps(found: FloatArray) -> FloatArray:
    """What is a usual size of each parameter: gain, scale and place in pixels, shape."""
    place = max(float(np.abs(found[1:3]).max()), 1.0)
    return np.array([_GAIN_SE_MM, *[place] * 4, *[1.0] * (len(found) - 5)])


def _jacobian(found: FloatArray, unit: FloatArray, outward: FloatArray) -> FloatArray:
    """(n, 2, p) by central differences; the map is smooth and its evaluation cheap."""
    nudges = np.diag(1e-6 * _steps(found))
    ends = [(_placed(found + by, unit, outward), _placed(found - by, unit, outward)) for by in nudges]
    return np.stack(
        [(high - low) / (2.0 * by.max()) for by, (high, low) in zip(nudges, ends, strict=True)], axis=2
    )


def _fit(start: FloatArray, unit: Marked, size: float) -> _Fit:
    """Least squares by Gauss and Newton, with what is known of the gain beforehand as one more datum."""
    se_px = _POINT_SE_MM * float(np.hypot(*start[1:3])) / size
    prior = np.zeros(len(start))
    prior[0] = 1.0 / _GAIN_SE_MM

    found = start
    for _ in range(_ROUNDS):
        off = np.append((_placed(found, unit.mm, unit.outward) - unit.px).ravel() / se_px, prior @ found)
        slope = _jacobian(found, unit.mm, unit.outward).reshape(-1, len(found)) / se_px
        # Columns of a usual size each keep the normal equations well conditioned.
        usual = _steps(found)
        weighted = np.vstack([slope, prior]) * usual
        step = np.linalg.lstsq(weighted, -off, rcond=None)[0]
        found = found + step * usual
        if np.abs(step).max() < _SETTLED:
            break
    off = np.append((_placed(found, unit.mm, unit.outward) - unit.px).ravel() / se_px, prior @ found)
    cov = np.linalg.pinv(weighted.T @ weighted) * np.outer(usual, usual)
    return _Fit(found, np.asarray(cov), float(off @ off))
