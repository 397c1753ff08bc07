"""Least squares for the map from sheet to pixels, over all the evidence with its uncertainty."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from grader.records import FloatArray
from grader.sheet.longlines import RIDGE, LongLine
from grader.sheet.models import PAGE_MM, PAPER, Model

_POINTS = 5
_FIRST, _LAST = 0.05, 0.95
_STEPS = 12
_CENTRE_MM = np.array([PAGE_MM[0] / 2.0, PAGE_MM[1] / 2.0])
_LOOSE = np.array([0.1, 0.1, 0.1, 20.0, 20.0])
"""How far a scanner's map may be from its first guess, mm for the place: keeps what no line settles."""
DPI_SE = 0.002
"""Relative error of a scanner's or copier's stated resolution along one axis."""
_MM_PER_INCH = 25.4


@dataclass(frozen=True, slots=True)
class Side:
    """A long line taken for one side of a model: sheet coordinate `axis` (0 x, 1 y) is `value` mm on it."""

    line: LongLine
    model: Model
    axis: int
    value: float


@dataclass(frozen=True, slots=True)
class Fit:
    """A fitted map.

    Attributes
    ----------
    mm_to_px : (3, 3)
    chi2, freedom : of the evidence
    rms_mm : root mean square distance of the sides' points
    scale_se : relative standard error of the mean scale
    side_mm : (n,) distance of each side's middle, mm
    """

    mm_to_px: FloatArray
    chi2: float
    freedom: int
    rms_mm: float
    scale_se: float
    side_mm: FloatArray


def inverted(homography: FloatArray) -> FloatArray:
    """The inverse homography."""
    return np.asarray(np.linalg.inv(homography), dtype=np.float64)


def apply(homography: FloatArray, points: FloatArray) -> FloatArray:
    """(n, 2) points through a homography."""
    mapped = np.column_stack([points, np.ones(len(points))]) @ homography.T
    return np.asarray(mapped[:, :2] / mapped[:, 2:])


def affine_of(params: FloatArray) -> FloatArray:
    """Map of a scanner: log scales along the image's x and y, rotation, where the centre goes."""
    log_x, log_y, angle, x, y = params
    c, s = np.cos(angle), np.sin(angle)
    linear = np.diag([np.exp(log_x), np.exp(log_y)]) @ np.array([[c, -s], [s, c]])
    shift = np.array([x, y]) - linear @ _CENTRE_MM
    return np.vstack([np.column_stack([linear, shift]), [0.0, 0.0, 1.0]])


def affine_params(homography: FloatArray) -> FloatArray:
    """The nearest scanner's map to a homography, at the sheet's middle."""
    centre = apply(homography, _CENTRE_MM[None, :])[0]
    step = 100.0
    dx = (apply(homography, (_CENTRE_MM + np.array([step, 0.0]))[None, :])[0] - centre) / step
    dy = (apply(homography, (_CENTRE_MM + np.array([0.0, step]))[None, :])[0] - centre) / step
    angle = np.arctan2(dx[1] - dy[0], dx[0] + dy[1])
    c, s = np.cos(angle), np.sin(angle)
    # Rows of diag(sx, sy) R are sx (c, -s) and sy (s, c).
    scale_x = max(c * dx[0] - s * dy[0], 1e-9)
    scale_y = max(s * dx[1] + c * dy[1], 1e-9)
    return np.array([np.log(scale_x), np.log(scale_y), angle, *centre])


def homography_of(params: FloatArray) -> FloatArray:
    """Map of a camera from eight numbers, well scaled around the sheet's middle."""
    centred = np.append(params, 1.0).reshape(3, 3)
    norm = np.array([[0.01, 0.0, -0.01 * _CENTRE_MM[0]], [0.0, 0.01, -0.01 * _CENTRE_MM[1]], [0.0, 0.0, 1.0]])
    return np.asarray(centred @ norm)


def homography_params(homography: FloatArray) -> FloatArray:
    """Inverse of `homography_of`."""
    norm = np.array([[100.0, 0.0, _CENTRE_MM[0]], [0.0, 100.0, _CENTRE_MM[1]], [0.0, 0.0, 1.0]])
    centred = homography @ norm
    return np.asarray((centred / centred[2, 2]).ravel()[:8])


def fit_sides(
    start: FloatArray, sides: list[Side], dpi: tuple[float, float] | None, *, perspective: bool
) -> Fit:
    """Map by least squares from a first guess, the sides found and (for a scan) the stated resolution."""
    to_matrix, params = (
        (homography_of, homography_params(start)) if perspective else (affine_of, affine_params(start))
    )
    stated = None if dpi is None or perspective else np.log(np.array(dpi) / _MM_PER_INCH)
    guess = params
    loose = _LOOSE * np.array([1.0, 1.0, 1.0, *np.exp(params[:2])]) if not perspective else None

    def residuals(p: FloatArray) -> FloatArray:
        inverse = inverted(to_matrix(p))
        parts = [_off(inverse, side) / (side.model.side_se_mm * np.sqrt(_POINTS / 2.0)) for side in sides]
        if stated is not None:
            parts.append((p[:2] - stated) / DPI_SE)
        if loose is not None:
            parts.append((p - guess) / loose)
        return np.concatenate(parts) if parts else np.zeros(0)

    params, jacobian = gauss_newton(residuals, params)
    matrix = to_matrix(params)
    final = residuals(params)
    freedom = 2 * len(sides) + (2 if stated is not None else 0) - len(params)
    chi2 = float(final @ final)
    inverse = inverted(matrix)
    off = np.array([_off(inverse, side) for side in sides]).reshape(-1, _POINTS)
    inflate = max(1.0, chi2 / max(freedom, 1))
    covariance = np.linalg.pinv(jacobian.T @ jacobian) * inflate
    gradient = _derivative(lambda p: np.array([log_scale(to_matrix(p))]), params)[0]
    scale_se = float(np.sqrt(max(gradient @ covariance @ gradient, 0.0)))
    rms = float(np.sqrt(np.mean(off**2))) if len(sides) else 0.0
    return Fit(matrix / matrix[2, 2], chi2, freedom, rms, scale_se, off.mean(axis=1))


def _off(inverse: FloatArray, side: Side) -> FloatArray:
    """(points,) mm by which a side's points miss it."""
    share = np.linspace(_FIRST, _LAST, _POINTS)[:, None]
    ends = side.line.ends
    mm = apply(inverse, ends[0] + share * (ends[1] - ends[0]))
    return mm[:, side.axis] - side.value + _shadow_mm(side, mm)


def _shadow_mm(side: Side, mm: FloatArray) -> float:
    """A paper edge seen as a dark line is its shadow: the sheet ends at the shadow's inner border."""
    if side.model is not PAPER or side.line.kind != RIDGE:
        return 0.0
    px_per_mm = side.line.length * (_LAST - _FIRST) / float(np.hypot(*(mm[-1] - mm[0])))
    inward = 1.0 if side.value < 1.0 else -1.0
    return inward * 0.5 * side.line.width / px_per_mm


def log_scale(matrix: FloatArray) -> float:
    """Logarithm of the mean pixels per millimetre around the sheet's middle."""
    corners = _CENTRE_MM + 60.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    mapped = apply(matrix, corners)
    x, y = mapped[:, 0], mapped[:, 1]
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    return 0.5 * float(np.log(max(abs(area), 1e-12)))


def gauss_newton(
    residuals: Callable[[FloatArray], FloatArray], params: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Least squares from a good first guess: (parameters, Jacobian there)."""
    jacobian = _derivative(residuals, params)
    for _ in range(_STEPS):
        step = np.linalg.lstsq(jacobian, -residuals(params), rcond=None)[0]
        params = params + step
        jacobian = _derivative(residuals, params)
        if np.abs(jacobian @ step).max(initial=0.0) < 1e-6:
            break
    return params, jacobian


def _derivative(function: Callable[[FloatArray], FloatArray], params: FloatArray) -> FloatArray:
    columns = []
    for index, value in enumerate(params):
        step = 1e-6 * max(abs(value), 1.0)
        up, down = params.copy(), params.copy()
        up[index] += step
        down[index] -= step
        columns.append((function(up) - function(down)) / (2.0 * step))
    return np.column_stack(columns)
