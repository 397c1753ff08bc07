"""Strokes to pixels: the ink's coverage of each pixel, computed on the final image's grid.

A stroke is cut into short capsules; a pixel's coverage follows from the distance of its centre to
the capsule's axis, so that a stroke's position is exact to about a thousandth of a pixel.
Pixel coordinates: the centre of the top left pixel is (0, 0), x right, y down.
"""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from samples.simulation.strokes import ComplexArray, FloatArray, GreyImage, InkStroke

Mapping = Callable[[FloatArray], FloatArray]
"""Sheet millimetres (n, 2), y down, to pixels (n, 2)."""

_PIECE_PX = 10.0
_BATCH = 4_000_000
"""Pixels looked at in one go: bounds the memory."""


def render(strokes: Sequence[InkStroke], mapping: Mapping, shape: tuple[int, int]) -> GreyImage:
    """Coverage times darkness, 0 .. 255; where strokes overlap, the larger value.

    Arguments: `mapping` takes sheet millimetres to pixels, `shape` is (height, width).
    """
    canvas = np.zeros(shape, np.uint8)
    if not strokes:
        return canvas
    pieces = _pieces(strokes, mapping)
    p, q = pieces[:, 0:2], pieces[:, 2:4]
    reach = np.abs(q - p).max(axis=1) + 2.0 * pieces[:, 4:6].max(axis=1) + 4.0
    window = (np.ceil(reach / 4.0) * 4).astype(int)
    near = _touches(p, q, reach, shape)
    for size in np.unique(window[near]):
        chosen = pieces[near & (window == size)]
        step = max(1, _BATCH // int(size) ** 2)
        for start in range(0, len(chosen), step):
            _splat(canvas, chosen[start : start + step].astype(np.float32), int(size))
    return canvas


def _touches(p: FloatArray, q: FloatArray, reach: FloatArray, shape: tuple[int, int]) -> NDArray[np.bool_]:
    middle = (p + q) / 2.0
    inside = (middle > -reach[:, None]) & (middle < np.array([shape[1], shape[0]]) + reach[:, None])
    return np.asarray(inside.all(axis=1))


def _pieces(strokes: Sequence[InkStroke], mapping: Mapping) -> FloatArray:
    """Capsules (x0, y0, x1, y1, radius0, radius1, dark0, dark1) in pixels, each a few pixels long."""
    points = np.concatenate([stroke.points for stroke in strokes])
    widths = np.concatenate([stroke.width for stroke in strokes])
    darks = np.concatenate([stroke.dark for stroke in strokes])
    px = mapping(np.column_stack([points.real, -points.imag]))
    scale = _local_scale(points, mapping)
    counts = np.array([len(stroke.points) for stroke in strokes])
    first = np.ones(len(points), bool)
    first[np.cumsum(counts) - 1] = False
    start = np.flatnonzero(first)
    values = np.column_stack([px, widths * scale / 2.0, darks])
    return _subdivided(values[start], values[start + 1])


def _local_scale(points: ComplexArray, mapping: Mapping) -> FloatArray:
    """Pixels per millimetre at each point (geometric mean of the two axes)."""
    xy = np.column_stack([points.real, -points.imag])
    here = mapping(xy)
    along_x = mapping(xy + np.array([1.0, 0.0])) - here
    along_y = mapping(xy + np.array([0.0, 1.0])) - here
    area = along_x[:, 0] * along_y[:, 1] - along_x[:, 1] * along_y[:, 0]
    return np.asarray(np.sqrt(np.abs(area)))


def _subdivided(tail: FloatArray, head: FloatArray) -> FloatArray:
    length = np.hypot(*(head - tail)[:, :2].T)
    parts = np.maximum(1, np.ceil(length / _PIECE_PX).astype(int))
    index = np.repeat(np.arange(len(tail)), parts)
    within = np.arange(len(index)) - np.repeat(np.cumsum(parts) - parts, parts)
    low = (within / parts[index])[:, None]
    high = ((within + 1) / parts[index])[:, None]
    a = tail[index] + (head - tail)[index] * low
    b = tail[index] + (head - tail)[index] * high
    return np.column_stack([a[:, :2], b[:, :2], a[:, 2], b[:, 2], a[:, 3], b[:, 3]])


def _splat(canvas: GreyImage, pieces: NDArray[np.float32], size: int) -> None:
    """Lay capsules that all fit a window of `size` pixels onto the canvas."""
    p, q = pieces[:, 0:2], pieces[:, 2:4]
    corner = np.floor((p + q) / 2.0 - (size - 1) / 2.0).astype(np.int64)
    grid = np.arange(size, dtype=np.float32)
    x = (corner[:, 0].astype(np.float32) - p[:, 0])[:, None, None] + grid[None, None, :]
    y = (corner[:, 1].astype(np.float32) - p[:, 1])[:, None, None] + grid[None, :, None]
    axis = (q - p)[:, :, None, None]
    length2 = np.maximum((axis**2).sum(axis=1), 1e-9)
    t = np.clip((x * axis[:, 0] + y * axis[:, 1]) / length2, 0.0, 1.0)
    distance = np.hypot(x - t * axis[:, 0], y - t * axis[:, 1])
    radius = pieces[:, 4, None, None] + t * (pieces[:, 5] - pieces[:, 4])[:, None, None]
    dark = pieces[:, 6, None, None] + t * (pieces[:, 7] - pieces[:, 6])[:, None, None]
    cover = np.clip(radius - distance + 0.5, 0.0, 1.0) - np.clip(0.5 - radius - distance, 0.0, 1.0)
    value = (cover * dark * 255.0 + 0.5).astype(np.uint8)
    rows = corner[:, 1, None, None] + np.arange(size)[None, :, None]
    columns = corner[:, 0, None, None] + np.arange(size)[None, None, :]
    height, width = canvas.shape
    kept = (value > 0) & (rows >= 0) & (rows < height) & (columns >= 0) & (columns < width)
    where = (rows * width + columns)[kept]
    np.maximum.at(canvas.reshape(-1), where, value[kept])
