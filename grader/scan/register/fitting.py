"""A sheet's homography fitted to lines, and which way is up."""

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy

from grader.printed.layout import PAGE_MM
from grader.records import FloatArray
from grader.scan.pixels import inverted, local_axes, mapped
from grader.scan.register.homography import PAPER, Outline
from grader.scan.register.lines import RIDGE, LongLine
from reference.drawing.canvas import MM_PER_INCH

_POINTS = 5
"""Places along a side at which it is compared with the map: enough to notice a bent one."""
_FIRST, _LAST = 0.05, 0.95
"""Share of a side's length at the first and the last of them; ends are often hidden or rounded."""
_PLACES = np.linspace(_FIRST, _LAST, _POINTS)[:, None]
_CENTRE_MM = np.array(PAGE_MM) / 2.0
_SIZE_MM = 100.0
"""About which, and in units of which, a map is given by numbers: they are then of a usual size each."""
_LOOSE = np.array([0.1, 0.1, 0.1, 20.0, 20.0])
"""Standard errors of a scanner's map about its first guess, mm for the place: for what no line settles."""
DPI_SE = 0.002
"""Relative error of a scanner's or copier's stated resolution along one axis."""
_POINT_SE_MM = 0.02
"""Standard error of a corner found at 150 dpi or better; printers and paper do no better."""
_GAIN_SE_MM = 0.15
"""Standard deviation of the spread of ink on usual printers and copiers."""
_WORTH = 12.0
"""Fall of chi squared for each of two further parameters that makes them worth having."""
_FREEDOMS = (4, 6, 8)
"""Parameters of a similarity, of an affine map and of a perspective."""
_LEAST_POINTS = 4
"""One whole marker."""
_TOLERANCE = 1e-12
"""Relative change at which a fit is finished: what follows must not depend on where it stopped."""


# Least squares ------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class LeastSquares:
    """Parameters (p,) that fit best, their covariance (p, p) and chi squared."""

    params: FloatArray
    covariance: FloatArray
    chi2: float


def solve(residuals: Callable[[FloatArray], FloatArray], start: FloatArray) -> LeastSquares:
    """Least squares by Levenberg and Marquardt from a good first guess, residuals in standard errors.

    Raises numpy.linalg.LinAlgError for fewer residuals than parameters, and where they are not finite.
    """
    first = residuals(start)
    if len(first) < len(start) or not np.all(np.isfinite(first)):
        raise np.linalg.LinAlgError("too few residuals, or some that are not finite")
    tolerances = dict.fromkeys(("ftol", "xtol", "gtol"), _TOLERANCE)
    slope = partial(_derivative, residuals)
    fit = scipy.optimize.least_squares(residuals, start, slope, method="lm", x_scale="jac", **tolerances)
    covariance = np.linalg.pinv(fit.jac.T @ fit.jac)
    return LeastSquares(np.asarray(fit.x), np.asarray(covariance), 2.0 * float(fit.cost))


def _derivative(function: Callable[[FloatArray], FloatArray], params: FloatArray) -> FloatArray:
    """(values, p) how a smooth function changes with its parameters, by central differences."""
    steps = np.diag(1e-6 * np.maximum(np.abs(params), 1.0))
    columns = [(function(params + step) - function(params - step)) / (2.0 * step.max()) for step in steps]
    return np.stack(columns, axis=-1).reshape(-1, len(params))


def scale_error(to_matrix: Callable[[FloatArray], FloatArray], solution: LeastSquares) -> float:
    """Relative standard error of the mean scale of a fitted map."""
    gradient = _derivative(lambda params: np.array([log_scale(to_matrix(params))]), solution.params)[0]
    return float(np.sqrt(max(gradient @ solution.covariance @ gradient, 0.0)))


# Maps by numbers ----------------------------------------------------------------------------------


def affine_of(params: FloatArray) -> FloatArray:
    """Map of a scanner: log scales along the image's x and y, rotation, where the centre goes."""
    log_x, log_y, angle, x, y = params
    c, s = np.cos(angle), np.sin(angle)
    linear = np.diag([np.exp(log_x), np.exp(log_y)]) @ np.array([[c, -s], [s, c]])
    shift = np.array([x, y]) - linear @ _CENTRE_MM
    return np.vstack([np.column_stack([linear, shift]), [0.0, 0.0, 1.0]])


def affine_params(homography: FloatArray) -> FloatArray:
    """The nearest scanner's map to a homography, at the sheet's middle."""
    centre = mapped(homography, _CENTRE_MM)
    (dx,), (dy,) = local_axes(homography, _CENTRE_MM[None], 100.0)
    angle = np.arctan2(dx[1] - dy[0], dx[0] + dy[1])
    c, s = np.cos(angle), np.sin(angle)
    # Rows of diag(sx, sy) R are sx (c, -s) and sy (s, c).
    scale_x = max(c * dx[0] - s * dy[0], 1e-9)
    scale_y = max(s * dx[1] + c * dy[1], 1e-9)
    return np.array([np.log(scale_x), np.log(scale_y), angle, *centre])


def homography_of(
    params: FloatArray, centre_mm: FloatArray = _CENTRE_MM, size_mm: float = _SIZE_MM
) -> FloatArray:
    """Map by 4, 6 or 8 numbers: similarity, unequal axes and shear, perspective, about a middle."""
    a, b, x, y, e, f, g, h = np.append(params, np.zeros(8 - len(params))).tolist()
    # The similarity's turn and scale, times unequal axes and shear.
    upper, lower = (
        (a * (1.0 + e) - b * f, a * f - b * (1.0 - e)),
        (b * (1.0 + e) + a * f, b * f + a * (1.0 - e)),
    )
    matrix = np.array([[*upper, x], [*lower, y], [g, h, 1.0]])
    matrix[:, :2] /= size_mm
    matrix[:, 2] -= matrix[:, :2] @ centre_mm
    return matrix


def homography_params(homography: FloatArray) -> FloatArray:
    """Inverse of `homography_of` for eight numbers, about the sheet's middle."""
    to_mm = np.array([[_SIZE_MM, 0.0, _CENTRE_MM[0]], [0.0, _SIZE_MM, _CENTRE_MM[1]], [0.0, 0.0, 1.0]])
    about = homography @ to_mm
    about = about / about[2, 2]
    # On complex numbers the linear part is z -> turn (z + shear z*).
    turn = np.complex128(complex(about[0, 0] + about[1, 1], about[1, 0] - about[0, 1]) / 2.0)
    shear = complex(about[0, 0] - about[1, 1], about[1, 0] + about[0, 1]) / 2.0 / turn
    return np.array([turn.real, turn.imag, *about[:2, 2], shear.real, shear.imag, *about[2, :2]])


def log_scale(matrix: FloatArray) -> float:
    """Logarithm of the mean pixels per millimetre around the sheet's middle."""
    corners = _CENTRE_MM + 60.0 * np.array([[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]])
    x, y = mapped(matrix, corners).T
    area = 0.5 * np.sum(x * np.roll(y, -1) - y * np.roll(x, -1))
    return 0.5 * float(np.log(max(abs(area), 1e-12)))


# Along the sides of a plain sheet -----------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Side:
    """A long line taken for one side of a model: sheet coordinate `axis` (0 x, 1 y) is `value` mm on it."""

    line: LongLine
    model: Outline
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


def fit_sides(
    start: FloatArray, sides: list[Side], dpi: tuple[float, float] | None, *, perspective: bool
) -> Fit:
    """Map by least squares from a first guess, the sides found and (for a scan) the stated resolution.

    Raises numpy.linalg.LinAlgError where these do not settle it.
    """
    to_matrix = homography_of if perspective else affine_of
    guess = homography_params(start) if perspective else affine_params(start)
    stated = None if dpi is None or perspective else np.log(np.array(dpi) / MM_PER_INCH)

    se_mm = np.array([[side.model.side_se_mm] for side in sides]).reshape(-1, 1) * np.sqrt(_POINTS / 2.0)

    def residuals(params: FloatArray) -> FloatArray:
        parts = [(_off_mm(inverted(to_matrix(params)), sides) / se_mm).ravel()]
        if stated is not None:
            parts.append((params[:2] - stated) / DPI_SE)
        if not perspective:
            parts.append((params - guess) / (_LOOSE * np.array([1.0, 1.0, 1.0, *np.exp(guess[:2])])))
        return np.concatenate(parts)

    solution = solve(residuals, guess)
    matrix = to_matrix(solution.params)
    freedom = 2 * len(sides) + (2 if stated is not None else 0) - len(guess)
    inflate = max(1.0, solution.chi2 / max(freedom, 1))
    scale_se = scale_error(to_matrix, solution) * float(np.sqrt(inflate))
    off = _off_mm(inverted(matrix), sides)
    rms = float(np.sqrt(np.mean(off**2))) if len(sides) else 0.0
    return Fit(matrix / matrix[2, 2], solution.chi2, freedom, rms, scale_se, off.mean(axis=1))


def _off_mm(inverse: FloatArray, sides: list[Side]) -> FloatArray:
    """(sides, points) mm by which places along the sides miss them.

    A paper edge seen as a dark line is its shadow: the sheet ends at the shadow's inner border.
    """
    if not sides:
        return np.zeros((0, _POINTS))
    ends = np.array([side.line.ends for side in sides])
    mm = mapped(inverse, ends[:, :1] + _PLACES * (ends[:, 1:] - ends[:, :1]))
    mm_per_px = (
        np.hypot(*(mm[:, -1] - mm[:, 0]).T) / np.hypot(*(ends[:, 1] - ends[:, 0]).T) / (_LAST - _FIRST)
    )
    inward = [_shadow_px(side) for side in sides]
    axis, value = [side.axis for side in sides], np.array([[side.value] for side in sides])
    return np.asarray(mm[np.arange(len(sides)), :, axis] - value + (inward * mm_per_px)[:, None])


def _shadow_px(side: Side) -> float:
    """From the middle of a paper edge's shadow to its inner border, towards larger coordinates; else 0."""
    if side.model is not PAPER or side.line.kind != RIDGE:
        return 0.0
    return (0.5 if side.value < 1.0 else -0.5) * side.line.width


# Through the corners of printed markers -----------------------------------------------------------


@dataclass(frozen=True, slots=True)
class MarkedPoints:
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
    params, covariance : the numbers of `homography_of` (4, 6 or 8), and their covariance
    centre_mm, size_mm : of the points, about which and in units of which the numbers are
    """

    mm_to_px: FloatArray
    rms_mm: float
    misfit_mm: FloatArray
    params: FloatArray
    covariance: FloatArray
    centre_mm: FloatArray
    size_mm: float

    @property
    def is_slanted(self) -> bool:
        """True if a perspective was needed: the picture is a camera's, not a scanner's."""
        return len(self.params) == _FREEDOMS[-1]

    def se_mm(self, points_mm: FloatArray) -> FloatArray:
        """(n,) standard error of the place of points (n, 2)."""

        def placed(params: FloatArray) -> FloatArray:
            return mapped(homography_of(params, self.centre_mm, self.size_mm), points_mm).ravel()

        jacobian = _derivative(placed, self.params).reshape(len(points_mm), 2, -1)
        spread = np.einsum("nij,jk,nik->n", jacobian, self.covariance, jacobian)
        middle = homography_of(self.params, self.centre_mm, self.size_mm)
        return np.asarray(np.sqrt(spread / 2.0) / _px_per_mm(middle))


def fit_projection(marked: MarkedPoints) -> Projection:
    """The plainest map that explains at least four marked corners; ValueError for fewer.

    Few points cannot tell a perspective apart from noise and would extrapolate it wildly, so the freest
    map is taken only where it explains the points better by far. Ink that spreads, or a copier's
    threshold, moves all sides of a marker outward alike. This gain is fitted too: taken for scale it
    would bend a map that rests on two markers side by side.
    """
    if len(marked) < _LEAST_POINTS:
        raise ValueError(f"at least {_LEAST_POINTS} points are expected, not {len(marked)}")
    centre, size = marked.mm.mean(axis=0), float(np.ptp(marked.mm, axis=0).max()) / 2.0

    def off_px(params: FloatArray) -> FloatArray:
        at = mapped(homography_of(params[1:], centre, size), marked.mm + params[0] * marked.outward)
        return np.asarray(at - marked.px)

    def fitted(start: FloatArray) -> LeastSquares:
        se_px = _POINT_SE_MM * float(np.hypot(*start[1:3])) / size
        # What is known of the gain beforehand is one more datum.
        return solve(lambda p: np.append(off_px(p).ravel() / se_px, p[0] / _GAIN_SE_MM), start)

    best = last = fitted(np.array([0.0, *_similarity((marked.mm - centre) / size, marked.px)]))
    for freedom in _FREEDOMS[1:]:
        last = fitted(np.array([*last.params, 0.0, 0.0]))
        # The misfit that is left says how good the corners are where they are worse than usual.
        noise = max(1.0, last.chi2 / max(2 * len(marked) - freedom, 1))
        if best.chi2 - last.chi2 > 2 * _WORTH * noise:
            best = last
    matrix = homography_of(best.params[1:], centre, size)
    misfit = np.hypot(*off_px(best.params).T) / _px_per_mm(matrix)
    rms = float(np.sqrt(np.mean(misfit**2)))
    # A misfit beyond the corners' own error (bent paper, a lens) makes the map less sure by as much.
    covariance = best.covariance[1:, 1:] * max(1.0, (rms / (_POINT_SE_MM * np.sqrt(2.0))) ** 2)
    return Projection(matrix / matrix[2, 2], rms, misfit, best.params[1:], covariance, centre, size)


def _similarity(mm: FloatArray, px: FloatArray) -> FloatArray:
    """Closed form of the best w = s z + t on complex numbers: real and imaginary parts of s and t."""
    z, w = mm @ np.array([1.0, 1.0j]), px @ np.array([1.0, 1.0j])
    zc, wc = z - z.mean(), w - w.mean()
    s = np.vdot(zc, wc) / np.vdot(zc, zc)
    t = w.mean() - s * z.mean()
    return np.array([s.real, s.imag, t.real, t.imag])


def _px_per_mm(about: FloatArray) -> float:
    """Resolution in the middle about which a map was given by numbers."""
    return float(np.sqrt(abs(np.linalg.det(about[:2, :2]))))
