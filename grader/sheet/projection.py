"""The map from sheet millimetres to pixels that fits marked points, no freer than they demand.

A flatbed's map is a similarity, a scanner with unequal axes or a skewed feed makes it affine, a
phone's photo is a perspective. Few points cannot tell a perspective apart from noise and would
extrapolate it wildly, so the freest map is taken only where it explains the points better by far.
"""

from dataclasses import dataclass

import numpy as np
from scipy.optimize import least_squares

from grader.records import FloatArray

_POINT_SE_MM = 0.02
"""Of a corner found at 150 dpi or better; printers and paper do no better."""
_WORTH = 12.0
"""Fall of chi squared for each of two further parameters that makes them worth having."""
_FREEDOMS = (4, 6, 8)
_LEAST_POINTS = 4


@dataclass(frozen=True, slots=True)
class Projection:
    """A fitted map.

    Attributes
    ----------
    mm_to_px : (3, 3), last element 1
    rms_mm : root mean square misfit of the points
    misfit_mm : (n,) misfit of each point
    cov : covariance of the parameters, see `_matrix`
    params : the parameters fitted, 4, 6 or 8
    centre, size : of the points, mm, by which parameters are made alike
    """

    mm_to_px: FloatArray
    rms_mm: float
    misfit_mm: FloatArray
    cov: FloatArray
    params: FloatArray
    centre: FloatArray
    size: float

    def se_mm(self, points_mm: FloatArray) -> FloatArray:
        """(n,) standard error of the place of points (n, 2)."""
        jacobian = _jacobian(self.params, (points_mm - self.centre) / self.size)
        scale = float(np.sqrt(abs(np.linalg.det(_matrix(self.params)[:2, :2])))) / self.size
        spread = np.einsum("nij,jk,nik->n", jacobian, self.cov, jacobian)
        return np.asarray(np.sqrt(spread / 2.0) / scale)


def fit_projection(points_mm: FloatArray, points_px: FloatArray) -> Projection:
    """The plainest map that explains the points (n, 2), n >= 4."""
    if len(points_mm) < _LEAST_POINTS:
        raise ValueError(f"at least {_LEAST_POINTS} points are expected, not {len(points_mm)}")
    centre, size = points_mm.mean(axis=0), float(np.ptp(points_mm, axis=0).max()) / 2.0
    unit = (points_mm - centre) / size
    params = _similarity(unit, points_px)
    params, cov, chi2 = _fit(params[: _FREEDOMS[0]], _FREEDOMS[0], unit, points_px, size)
    best = params, cov, chi2
    for freedom in _FREEDOMS[1:]:
        params, cov, chi2 = _fit(params[:freedom], freedom, unit, points_px, size)
        # The misfit that is left says how good the corners are where they are worse than usual.
        noise = max(1.0, chi2 / max(2 * len(unit) - freedom, 1))
        if best[2] - chi2 > 2 * _WORTH * noise:
            best = params, cov, chi2
    params, cov, _ = best
    matrix = _matrix(params)
    scale_px = float(np.sqrt(abs(np.linalg.det(matrix[:2, :2])))) / size
    misfit = np.hypot(*(_apply(matrix, unit) - points_px).T) / scale_px
    to_unit = np.array(
        [[1.0 / size, 0.0, -centre[0] / size], [0.0, 1.0 / size, -centre[1] / size], [0.0, 0.0, 1.0]]
    )
    whole = matrix @ to_unit
    rms = float(np.sqrt(np.mean(misfit**2)))
    # A misfit beyond the corners' own error (bent paper, a lens) makes the map less sure by as much.
    inflated = cov * max(1.0, (rms / (_POINT_SE_MM * np.sqrt(2.0))) ** 2)
    return Projection(whole / whole[2, 2], rms, misfit, inflated, params, centre, size)


def _similarity(unit: FloatArray, px: FloatArray) -> FloatArray:
    """Closed form of the best x' = s x + t on complex numbers, as the full eight parameters."""
    z, w = unit[:, 0] + 1j * unit[:, 1], px[:, 0] + 1j * px[:, 1]
    zc, wc = z - z.mean(), w - w.mean()
    s = np.vdot(zc, wc) / np.vdot(zc, zc)
    t = w.mean() - s * z.mean()
    return np.array([s.real, s.imag, t.real, t.imag, 0.0, 0.0, 0.0, 0.0])


def _matrix(params: FloatArray) -> FloatArray:
    """Similarity (s, t), unequal axes and shear (e, f), perspective (g, h), about the points' middle."""
    p = np.zeros(8)
    p[: len(params)] = params
    a, b, x, y, e, f, g, h = p
    turn = np.array([[a, -b], [b, a]])
    linear = turn @ np.array([[1.0 + e, f], [f, 1.0 - e]])
    return np.array([[linear[0, 0], linear[0, 1], x], [linear[1, 0], linear[1, 1], y], [g, h, 1.0]])


def _apply(matrix: FloatArray, points: FloatArray) -> FloatArray:
    mapped = points @ matrix[:, :2].T + matrix[:, 2]
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def _jacobian(params: FloatArray, unit: FloatArray) -> FloatArray:
    """(n, 2, p) by central differences; the map is smooth and eight evaluations are cheap."""
    steps = 1e-6 * np.where(np.arange(len(params)) < 4, max(float(np.abs(params[:2]).max()), 1.0), 1.0)
    columns = []
    for index, step in enumerate(steps):
        nudge = np.zeros(len(params))
        nudge[index] = step
        columns.append(
            (_apply(_matrix(params + nudge), unit) - _apply(_matrix(params - nudge), unit)) / (2 * step)
        )
    return np.stack(columns, axis=2)


def _fit(
    start: FloatArray, freedom: int, unit: FloatArray, px: FloatArray, size: float
) -> tuple[FloatArray, FloatArray, float]:
    """Least squares; parameters, their covariance, chi squared."""
    full = np.zeros(freedom)
    full[: len(start)] = start
    se_px = _POINT_SE_MM * float(np.hypot(*start[:2])) / size

    def misfit(params: FloatArray) -> FloatArray:
        return np.asarray((_apply(_matrix(params), unit) - px).ravel() / se_px)

    typical = np.where(np.arange(freedom) < 4, float(np.abs(full[:2]).max()), 1.0)
    found = least_squares(
        misfit,
        full,
        jac=lambda p: _jacobian(p, unit).reshape(-1, freedom) / se_px,
        x_scale=typical,
        max_nfev=30,
    )
    cov = np.linalg.pinv(found.jac.T @ found.jac)
    return np.asarray(found.x), np.asarray(cov), float(2.0 * found.cost)
