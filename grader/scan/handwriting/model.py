"""The letter recogniser: alphabet, features, a linear model over them, and letters of a line."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from itertools import pairwise
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage
from grader.scan.pixels import Float32Array

# Signs --------------------------------------------------------------------------------------------

JUNK = ""
"""No sign at all: pieces of strokes, arrowheads, arcs, crossings, two letters run together."""
SIGNS: tuple[str, ...] = (
    *"o123456789",
    *"aAbBcdDeEfFgGhHJkLmMnNprRstTuvxyz",
    *"πωεμ",
    *".'-/:=()",
    JUNK,
)
TWINS: dict[str, str] = {
    **dict.fromkeys("0OОо", "o"),
    **dict.fromkeys("lI|", "1"),
    **dict.fromkeys("CСс", "c"),
    **dict.fromkeys("SЅ", "s"),
    **dict.fromkeys("Vν", "v"),
    **dict.fromkeys("XХх×", "x"),
    **dict.fromkeys("KКк", "k"),
    **dict.fromkeys("wWϖ", "ω"),
    **dict.fromkeys("Мм", "M"),
    **dict.fromkeys(",’", "'"),
    **dict.fromkeys("·", "."),
    **dict.fromkeys("−–", "-"),
    **dict.fromkeys("а", "a"),
    **dict.fromkeys("А", "A"),
    **dict.fromkeys("В", "B"),
    **dict.fromkeys("Ее", "e"),
    **dict.fromkeys("PрР", "p"),
    **dict.fromkeys("Т", "T"),
    **dict.fromkeys("Н", "H"),
    **dict.fromkeys("у", "y"),
    **dict.fromkeys("п", "π"),
    **dict.fromkeys("²", "2"),
}
TWINS["Е"] = "E"
_OWN = {sign: column for column, sign in enumerate(SIGNS)}
COLUMN: dict[str, int] = {**_OWN, **{sign: _OWN[twin] for sign, twin in TWINS.items()}}
"""The column of each sign, and of those that look like it, among the probabilities."""


# Features -----------------------------------------------------------------------------------------

SIDE_PX = 28
"""Side of a sign's picture; the sign's longer side fills all but the margin."""
_MARGIN_PX = 3
"""Margin around the sign: its border's gradient lies inside the picture."""
_ORIENTATIONS = 8
"""Number of directions of borders."""
_CELLS, _ZONES = 6, 7
"""Cells along a side: for the directions of borders, and for the ink."""
_LOBE = 0.6
"""A border counts for a direction as far as its part along it exceeds this share of its strength."""
_LEAST_PX = 1.0
"""Least side of a crop that is used in a division."""
_AT_ONCE = 32
"""Number of pictures whose numbers fit into the processor's cache together."""


def normalised(crop: GreyImage) -> GreyImage:
    """Return (28, 28) uint8 picture of a sign: its crop, 255 = ink, at one size, proportions kept."""
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
    """Return (n, 338) features of (n, 28, 28) pictures with (n, 2) width and height of their crops."""
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
    """Return (n, 8 x 6 x 6) border strength by direction and cell, as square roots of unit length."""
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
    """Return (n, m, cells, cells) sums over overlapping cells, by nearness, of (n, m, 28, 28) planes."""
    weights = _weights(cells)
    return np.asarray(weights @ planes @ weights.T, dtype=np.float32)


def _weights(cells: int) -> Float32Array:
    pitch = SIDE_PX / cells
    centre = (np.arange(cells) + 0.5) * pitch - 0.5
    off = np.abs(np.arange(SIDE_PX)[None, :] - centre[:, None]) / pitch
    return np.asarray(np.clip(1.0 - off, 0.0, None), dtype=np.float32)


# The network --------------------------------------------------------------------------------------

MODEL = Path(__file__).with_name("letters.npz")


@dataclass(frozen=True, slots=True)
class Model:
    """Layers from features to scores of the signs.

    Attributes
    ----------
    weights, biases : a matrix (inputs, outputs) and a row for each layer
    cooling : factor of the scores before they become probabilities
    """

    weights: tuple[Float32Array, ...]
    biases: tuple[Float32Array, ...]
    cooling: float

    def scores(self, inputs: Float32Array) -> FloatArray:
        """Return (n, signs) scores of features (n, m)."""
        layer = inputs
        for weight, bias in zip(self.weights[:-1], self.biases[:-1], strict=True):
            layer = np.maximum(layer @ weight + bias, np.float32(0.0))
        return np.asarray(layer @ self.weights[-1] + self.biases[-1], dtype=np.float64)

    def probability(self, inputs: Float32Array) -> FloatArray:
        """Return (n, signs) probabilities, each row's sum 1."""
        scores = self.cooling * self.scores(inputs)
        grown = np.exp(scores - scores.max(axis=1, keepdims=True))
        return np.asarray(grown / grown.sum(axis=1, keepdims=True))

    def save(self, path: Path) -> None:
        """Write the layers, at half precision."""
        layers = {f"weight_{n}": layer.astype(np.float16) for n, layer in enumerate(self.weights)}
        layers |= {f"bias_{n}": layer.astype(np.float16) for n, layer in enumerate(self.biases)}
        np.savez_compressed(path, cooling=np.float64(self.cooling), signs=np.array(SIGNS), **layers)  # type: ignore[arg-type]

    @classmethod
    def load(cls, path: Path) -> "Model":
        """Read the layers. Raises ValueError if they were trained for other signs."""
        with np.load(path) as stored:
            if tuple(str(sign) for sign in stored["signs"]) != SIGNS:
                raise ValueError(f"{path} was trained for other signs than {''.join(SIGNS)}")
            count = sum(name.startswith("weight_") for name in stored.files)
            weights = tuple(stored[f"weight_{n}"].astype(np.float32) for n in range(count))
            biases = tuple(stored[f"bias_{n}"].astype(np.float32) for n in range(count))
            return cls(weights, biases, float(stored["cooling"]))


@cache
def shipped() -> Model:
    """Return the model that comes with the program, read once."""
    return Model.load(MODEL)


def recognise(pictures: NDArray[np.uint8] | list[GreyImage], sizes_px: FloatArray) -> FloatArray:
    """Return (n, signs) probability of each sign of `SIGNS` for (n, 28, 28) normalised pictures.

    Arguments
    ---------
    sizes_px : (n, 2) width and height of the crops
    """
    if len(pictures) == 0:
        return np.zeros((0, len(SIGNS)))
    return shipped().probability(features(pictures, sizes_px))


# Signs of a line ----------------------------------------------------------------------------------

_LEAST_PEAK = 40
"""Contrast of 255: a line whose darkest ink is fainter is empty."""
_INK = 0.3
"""Share of the darkest ink: at half, pencil's grain leaves gaps."""
_SOFT_MM = 0.06
"""Smoothing that removes a pencil's grain: less than its stroke."""
_DUST_MM = 0.22
"""Smaller pieces are dust."""
_WIDE = 0.95
"""Pieces wider than this many heights of the line are probably two signs that touch."""
_MOST_PIECES = 60
"""Most signs of a scale."""
_SHARED = 0.7
"""Two pieces of one sign share this much of the smaller one's extent."""
_BROKEN_PX = 2
"""Largest gap in a stroke broken by the pencil's grain."""
_MERGED = 3
"""Most pieces of ink in a sign."""


_Box = tuple[int, int, int, int]


@dataclass(frozen=True, slots=True)
class Segment:
    """A candidate sign: the pieces from `first` up to, not including, `last`.

    Attributes
    ----------
    log : (signs,) log probabilities
    box : left, top, width, height, px
    """

    first: int
    last: int
    log: FloatArray
    box: _Box


@dataclass(frozen=True, slots=True)
class Lattice:
    """Pieces in the order of writing, and the signs that neighbours may make up."""

    count: int
    segments: tuple[Segment, ...]


def lattice_of(grey: GreyImage, px_per_mm: float) -> Lattice:
    """Return the lattice of a line of writing.

    Arguments: `grey` (h, w) uint8 contrast of the line alone, 255 = ink, upright.
    """
    pieces = _pieces(grey, px_per_mm)
    boxes, crops, spans = [], [], []
    for first in range(len(pieces)):
        for last in range(first + 1, min(first + _MERGED, len(pieces)) + 1):
            box = _around(pieces[first:last])
            # The pieces of one sign stand over one another, or side by side without a gap.
            pairs = pairwise(piece.box for piece in pieces[first:last])
            if not all(_over(*pair) or _beside(*pair) for pair in pairs):
                continue
            boxes.append(box)
            crops.append(normalised(_cut(grey, pieces[first:last], box)))
            spans.append((first, last))
    sizes = np.array([box[2:] for box in boxes], dtype=np.float64).reshape(-1, 2)
    log = np.log(np.maximum(recognise(crops, sizes), 1e-6))
    segments = tuple(
        Segment(first, last, row, box) for (first, last), row, box in zip(spans, log, boxes, strict=True)
    )
    return Lattice(len(pieces), segments)


@dataclass(frozen=True, slots=True)
class _Piece:
    """Connected ink, or a part of it: its box and its own pixels there, grown by one pixel within it."""

    box: _Box
    own: NDArray[np.uint8]

    @property
    def middle(self) -> float:
        return self.box[0] + self.box[2] / 2.0


def _pieces(grey: GreyImage, unit: float) -> list[_Piece]:
    """Return pieces of ink from left to right, wide ones cut where they are thinnest."""
    if grey.size == 0:
        return []
    soft = cv2.GaussianBlur(grey, (0, 0), _SOFT_MM * unit)
    peak = float(np.quantile(soft, 0.997))
    if peak < _LEAST_PEAK:
        return []
    mask = (soft > _INK * peak).astype(np.uint8)
    _, labels, stats, _ = cv2.connectedComponentsWithStats(mask, connectivity=8)
    rows = [row for row in range(1, len(stats)) if stats[row, 2:4].max() > _DUST_MM * unit]
    if not rows or len(rows) > _MOST_PIECES:
        return []
    line = float(np.quantile(stats[rows, 3], 0.8))
    pieces: list[_Piece] = []
    for row in rows:
        x, y, w, h = (int(side) for side in stats[row, :4])
        own = (labels[y : y + h, x : x + w] == row).astype(np.uint8)
        pieces.extend(_parted(_Piece((x, y, w, h), own), line))
    return sorted(pieces, key=lambda piece: piece.middle)


def _parted(piece: _Piece, line: float) -> list[_Piece]:
    """Cut a piece at the thin places where two signs may touch; they are candidates together as well."""
    x, y, w, h = piece.box
    if w <= _WIDE * line or h < 0.35 * line:
        return [piece]
    ink = piece.own.sum(axis=0).astype(np.float64)
    parts = min(3, max(2, round(w / (0.65 * line))))
    cuts = [0]
    for number in range(1, parts):
        low, high = round((number - 0.35) * w / parts), round((number + 0.35) * w / parts)
        cuts.append(low + int(ink[low : high + 1].argmin()))
    edges = [*cuts, w]
    pieces = []
    for left, right in pairwise(edges):
        own = piece.own[:, left:right]
        rows = np.flatnonzero(own.any(axis=1))
        if right - left < 2 or len(rows) == 0:
            continue
        top, bottom = int(rows[0]), int(rows[-1]) + 1
        pieces.append(_Piece((x + left, y + top, right - left, bottom - top), own[top:bottom]))
    return pieces


def _around(pieces: list[_Piece]) -> _Box:
    left = min(piece.box[0] for piece in pieces)
    top = min(piece.box[1] for piece in pieces)
    right = max(piece.box[0] + piece.box[2] for piece in pieces)
    bottom = max(piece.box[1] + piece.box[3] for piece in pieces)
    return left, top, right - left, bottom - top


def _over(first: _Box, second: _Box) -> bool:
    shared = min(first[0] + first[2], second[0] + second[2]) - max(first[0], second[0])
    small, tall = sorted((first, second), key=lambda box: box[3])
    # A small piece at the foot of a tall one is a point or a comma of its own.
    at_foot = small[3] < 0.5 * tall[3] and small[1] + small[3] / 2.0 > tall[1] + 0.75 * tall[3]
    return shared >= _SHARED * min(first[2], second[2]) and not at_foot


def _beside(first: _Box, second: _Box) -> bool:
    shared = min(first[1] + first[3], second[1] + second[3]) - max(first[1], second[1])
    gap = max(first[0], second[0]) - min(first[0] + first[2], second[0] + second[2])
    return shared >= _SHARED * min(first[3], second[3]) and gap <= _BROKEN_PX


def _cut(grey: GreyImage, pieces: list[_Piece], box: _Box) -> GreyImage:
    left, top, wide, high = box
    own = np.zeros((high + 2, wide + 2), dtype=np.uint8)
    for piece in pieces:
        x, y, w, h = piece.box
        part = own[y - top + 1 : y - top + 1 + h, x - left + 1 : x - left + 1 + w]
        np.maximum(part, piece.own, out=part)
    grown = cv2.dilate(own, np.ones((3, 3), np.uint8))[1:-1, 1:-1]
    return np.asarray(grey[top : top + high, left : left + wide] * grown, dtype=np.uint8)
