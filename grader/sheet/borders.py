"""Straight borders between bright and dark that run nearly along the image's axes.

Only such borders can be edges and frame of a sheet, and for them a general line detector's sorting
of every gradient is not needed: the rows at which the brightness changes most are kept, joined to
their neighbours, and a line is fitted to each chain. A chain that is not straight, because two
borders meet or one is bent, is taken in short stretches.
"""

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage

IntArray = NDArray[np.int64]

_ALONG_PX = 5
"""Averaged along the border: grain of paper fades, a border 16 degrees askew does not."""
_LEAST_CHANGE = 6
"""Grey levels over two pixels; a hard pencil's line at 3 px/mm changes by 20."""
_NOISES = 4.0
_NOISE_SHARE = 0.84
"""Of normal noise this share is below one standard deviation."""
_LEAST_PX = 12
_BENT_PX, _BENT_SHARE = 0.7, 0.002
"""Root mean square distance from its line, or share of its length, by which a chain is not straight; a
wide lens bends the side of a sheet by 0.6 % of its length from end to end, half as much on the whole."""
_STRETCHES_PX = (240, 80, 30)


def borders(small: GreyImage, steepest: float) -> FloatArray:
    """(n, 5) of x, y of the left end, x, y of the right end, and the side that is bright.

    Level borders only: for upright ones give the transposed image. `steepest` is the largest slope;
    the bright side is +1 where it is below, -1 where it is above.
    """
    soft = np.asarray(cv2.blur(small, (_ALONG_PX, 1)), dtype=np.uint8)
    found = [_one_sided(soft, sign, steepest) for sign in (1, -1)]
    return np.concatenate(found)


def _one_sided(soft: GreyImage, sign: int, steepest: float) -> FloatArray:
    """Borders that are brighter below (+1) or above (-1)."""
    above, below = (soft[:-2], soft[2:]) if sign > 0 else (soft[2:], soft[:-2])
    change = np.asarray(cv2.subtract(below, above), dtype=np.uint8)
    least = max(_LEAST_CHANGE, _NOISES * _noise(change))
    crest = np.zeros_like(change)
    middle = change[1:-1]
    crest[1:-1] = (middle > change[:-2]) & (middle >= change[2:]) & (middle >= least)
    crest[:, [0, -1]] = 0
    points = cv2.findNonZero(crest)
    if points is None:
        return np.zeros((0, 5))
    column, row = points.reshape(-1, 2).astype(np.int64).T
    label = cv2.connectedComponents(crest, connectivity=8)[1][row, column]
    count = np.bincount(label)
    long_enough = count[label] >= _LEAST_PX
    row, column, label = row[long_enough], column[long_enough], label[long_enough]
    # The image of changes starts one row below the picture's first.
    ends = _straight(column, row + 1.0 + _within_row(change, row, column), label)
    span = ends[:, 2:] - ends[:, :2]
    good = (span[:, 0] >= _LEAST_PX) & (np.abs(span[:, 1]) <= steepest * span[:, 0])
    return np.column_stack([ends[good], np.full(np.count_nonzero(good), float(sign))])


def _noise(change: GreyImage) -> float:
    """Standard deviation of the change where there is only paper, a level too high rather than too low."""
    counts = np.cumsum(np.bincount(change[::7, ::3].ravel(), minlength=256))
    return float(np.searchsorted(counts, _NOISE_SHARE * counts[-1])) + 0.5


def _within_row(change: GreyImage, row: IntArray, column: IntArray) -> FloatArray:
    """How far beside its row's middle the change is greatest, by a parabola."""
    above, middle, below = (change[row + k, column].astype(np.float64) for k in (-1, 0, 1))
    return np.asarray(0.5 * (above - below) / np.minimum(above - 2.0 * middle + below, -1.0))


def _straight(x: IntArray, y: FloatArray, label: IntArray) -> FloatArray:
    """(n, 4) ends of the lines through chains of points; a bent chain is cut until it is straight."""
    found: list[FloatArray] = []
    chain = label.astype(np.int64)
    for stretch in (*_STRETCHES_PX, 0):
        _, chain = np.unique(chain, return_inverse=True)
        ends, rms = _lines(x, y, chain)
        straight = rms <= np.maximum(_BENT_PX, _BENT_SHARE * (ends[:, 2] - ends[:, 0]))
        found.append(ends[straight])
        again = ~straight[chain]
        if not stretch or not again.any():
            break
        x, y, chain = x[again], y[again], chain[again]
        chain = chain * (int(x.max()) // stretch + 1) + x // stretch
    return np.concatenate(found)


def _lines(x: IntArray, y: FloatArray, chain: IntArray) -> tuple[FloatArray, FloatArray]:
    """Least squares lines y = a + b x of the points of each chain 0..n-1: (n, 4) ends, (n,) rms distance."""
    count = np.maximum(np.bincount(chain), 1).astype(np.float64)
    low, high = np.full(len(count), np.inf), np.full(len(count), -np.inf)
    np.minimum.at(low, chain, x)
    np.maximum.at(high, chain, x)
    x_mean = np.bincount(chain, x) / count
    y_mean = np.bincount(chain, y) / count
    dx, dy = x - x_mean[chain], y - y_mean[chain]
    spread = np.maximum(np.bincount(chain, dx * dx), 1e-9)
    slope = np.bincount(chain, dx * dy) / spread
    rms = np.sqrt(np.bincount(chain, (dy - slope[chain] * dx) ** 2) / count)
    ends = np.column_stack([low, y_mean + slope * (low - x_mean), high, y_mean + slope * (high - x_mean)])
    return ends, rms
