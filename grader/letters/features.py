"""What a sign's picture is told by: where its borders run in which direction, and where its ink lies.

Histograms of gradients after Dalal and Triggs (2005), on pictures brought to one size first.
"""

from collections.abc import Sequence

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.pixels import Float32Array
from grader.records import FloatArray, GreyImage

SIDE_PX = 28
"""Side of the picture that is looked at; the sign's longer side fills all but the margin."""
_MARGIN_PX = 3
"""Around the sign: its border's gradient lies inside the picture."""
_ORIENTATIONS = 8
"""Directions that borders are sorted by."""
_CELLS = 6
"""Cells along a side for the directions of borders,"""
_ZONES = 7
"""and for the ink."""
_LOBE = 0.6
"""A border counts for a direction as far as its part along it exceeds this share of its strength."""
_LEAST_PX = 1.0
"""No side of a crop counts as shorter."""
_AT_ONCE = 32
"""Pictures whose numbers fit into the processor's cache together."""


def normalised(crop: GreyImage) -> GreyImage:
    """(28, 28) uint8 picture of a sign: its crop, 255 = ink, at the one size, proportions kept."""
    high, wide = crop.shape
    scale = (SIDE_PX - 2 * _MARGIN_PX) / max(high, wide)
    size = max(1, round(wide * scale)), max(1, round(high * scale))
    # The crop's middle comes to the picture's middle; areas are averaged where it becomes smaller.
    small = cv2.resize(crop, size, interpolation=cv2.INTER_AREA if scale < 1.0 else cv2.INTER_LINEAR)
    picture = np.zeros((SIDE_PX, SIDE_PX), dtype=np.uint8)
    top, left = (SIDE_PX - size[1]) // 2, (SIDE_PX - size[0]) // 2
    picture[top : top + size[1], left : left + size[0]] = small
    return picture


def features(pictures: Sequence[GreyImage] | NDArray[np.uint8], sizes_px: FloatArray) -> Float32Array:
    """(n, 338) what tells signs apart, from (n, 28, 28) pictures and (n, 2) width and height of the crops."""
    stacked = np.asarray(pictures, dtype=np.uint8)
    parts = [slice(first, first + _AT_ONCE) for first in range(0, len(stacked), _AT_ONCE)]
    return np.concatenate([_features(stacked[part], sizes_px[part]) for part in parts])


def _features(pictures: NDArray[np.uint8], sizes_px: FloatArray) -> Float32Array:
    grey = pictures.astype(np.float32) / np.float32(255.0)
    peak = np.maximum(grey.max(axis=(1, 2)), np.float32(0.05))
    grey = grey / peak[:, None, None]
    directions = _directions(grey)
    zones = _pooled(grey[:, None], _ZONES).reshape(len(grey), -1)
    zones /= np.maximum(np.linalg.norm(zones, axis=1, keepdims=True), 1e-6)
    shape = np.log(np.maximum(sizes_px[:, 0], _LEAST_PX) / np.maximum(sizes_px[:, 1], _LEAST_PX))
    return np.concatenate([directions, zones, shape[:, None].astype(np.float32)], axis=1)


def _directions(grey: Float32Array) -> Float32Array:
    """(n, 8 x 6 x 6) strength of the borders by direction and cell, as square roots of unit length."""
    padded = np.pad(grey, ((0, 0), (1, 1), (1, 1)))
    gx = padded[:, 1:-1, 2:] - padded[:, 1:-1, :-2]
    gy = padded[:, 2:, 1:-1] - padded[:, :-2, 1:-1]
    turned = np.float32(2.0 * np.pi / _ORIENTATIONS) * np.arange(_ORIENTATIONS, dtype=np.float32)
    aside = np.float32(_LOBE) * np.hypot(gx, gy)
    bins = np.empty((len(grey), _ORIENTATIONS, SIDE_PX, SIDE_PX), dtype=np.float32)
    for number, (cosine, sine) in enumerate(zip(np.cos(turned), np.sin(turned), strict=True)):
        np.maximum(gx * cosine + gy * sine - aside, np.float32(0.0), out=bins[:, number])
    pooled = _pooled(bins, _CELLS).reshape(len(grey), -1)
    pooled /= np.maximum(pooled.sum(axis=1, keepdims=True), 1e-6)
    return np.asarray(np.sqrt(pooled), dtype=np.float32)


def _pooled(planes: Float32Array, cells: int) -> Float32Array:
    """(n, m, cells, cells) sums over overlapping cells, weighted by nearness, of (n, m, 28, 28) planes."""
    weights = _weights(cells)
    return np.asarray(weights @ planes @ weights.T, dtype=np.float32)


def _weights(cells: int) -> Float32Array:
    pitch = SIDE_PX / cells
    centre = (np.arange(cells) + 0.5) * pitch - 0.5
    off = np.abs(np.arange(SIDE_PX)[None, :] - centre[:, None]) / pitch
    return np.asarray(np.clip(1.0 - off, 0.0, None), dtype=np.float32)
