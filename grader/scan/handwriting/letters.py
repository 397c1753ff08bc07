"""Find letters on a drawing, beside its nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import Box, FloatArray, GreyImage, Ink, IntArray, Letters
from grader.scan.handwriting.model import COLUMN, JUNK, SIGNS
from grader.scan.pixels import BoolArray, Float32Array, lengths_and_directions

DETECTED = (*"o123456789", *"aAbBcdDeEfFgGhHJkLmMnNprRstTuvxyz", *"πωεμ", "'")
"""The signs that the detector knows; points, dashes and brackets resemble ends and pieces of lines."""
PX_PER_MM = 6.0
"""Resolution of the ink map that the detector uses."""
_COARSE = 1.1
"""Maps of coarser pages by this factor are refined: the networks know signs by their size."""
CELL_PX = 4
"""Side of the cells for which the detector answers."""
TILE_PX, _MARGIN_PX = 96, 16
"""Side of the detector's tiles; signs nearer to a tile's border are left to the neighbour."""
_AT_ONCE = 16
"""Number of tiles whose planes fit into the processor's cache together."""
UNIT_PX = 8.0
"""Unit of its distances to a sign's borders."""
_LEAST = -2.0
"""Positions with lower log odds are no sign's middle."""
CROP_PX, _AROUND, _LEAST_CROP_PX = 32, 1.4, 9.0
"""A box with its surroundings is scaled to this size; a prime has at least this many pixels around it."""
_COOLING, _STRANGE = 1.05, 0.005
"""Calibration for unknown handwriting: factor of the signs' scores, and share of signs of which nothing is
known. Fitted to fonts left out."""
_WEIGHTS = (1.26, 0.64, -0.35)
"""Weights of both networks' log odds that it is a sign, and a constant. Fitted as well."""
_SAME = 0.5
"""Boxes that share this much of the smaller one's area are one sign."""
_FAINT = 20
"""Contrast of 255: fainter ink is paper."""
_SHARE = 0.2
"""Share of the usual darkness of the sheet's ink: anything fainter is squared paper, or show-through."""
_GROWN_MM = 0.16
"""Strokes are removed with this much more than their width: wobble and blur."""
_LONG_MM = 6.0
"""Shorter strokes may be the letters' own."""
_REST_PX, _REST = 8, 0.1
"""Squares of this side are examined if this share of them is ink that no long stroke explains."""
_ABOUT_MM = 9.0
"""Letters of nodes are no farther from a long stroke."""
_GAP, _LEVEL = 0.9, 0.4
"""Signs of one line: largest gap in heights, and least common height as a share of the lower one."""
_FEW, _ENOUGH = 8, 32
"""Fewer signs do not show which way up they stand; of more, only the likeliest signs are used."""
_NATS, STAND_UPRIGHT = 3.0, 6.0
"""Most nats of a single sign: a p on its head is a d; and the total from which they decide."""
_WORDS = 7
"""More signs in a line are words or a calculation, no letter of a node."""


def find_letters(ink: Ink, boxes: Sequence[Box] | None = None) -> Letters:
    """Return every sign that can be a node's letter, with its probabilities, even if lines run through it.

    Words and calculations are left out.

    Arguments: `boxes` are the areas to search, sheet mm; the whole sheet by default.
    """
    unit = ink.where.px_per_mm
    left, top, grey = _window(ink, boxes)
    ruled = _drawn(ink, (left, top), grey.shape)
    finer = PX_PER_MM / unit
    if finer > _COARSE:
        size = round(finer * grey.shape[1]), round(finer * grey.shape[0])
        grey, ruled = (np.asarray(cv2.resize(plane, size), dtype=np.uint8) for plane in (grey, ruled))
        unit, left, top = finer * unit, round(finer * left), round(finer * top)
    box, probability = _signs(grey, _tiles(grey, ruled))
    likely = np.flatnonzero(probability[:, COLUMN[JUNK]] < 0.5)
    alone = np.setdiff1d(np.arange(len(box)), likely[_in_words(box[likely])])
    box, probability = box[alone], probability[alone]
    x, y, right, low = np.column_stack([box[:, :2], box[:, :2] + box[:, 2:] + 1]).astype(np.int64).clip(0).T
    touched = [ruled[part].any() for part in map(_part, y, low, x, right)]
    # The centre of the map's pixel q is at q / unit mm.
    box[:, :2] += [left, top]
    return Letters(box / unit, probability, ~np.array(touched, dtype=bool), COLUMN)


def upright_nats(ink: Ink | None) -> float | None:
    """Return how much better the likeliest signs are read upright than upside down; None for few signs.

    On 23 sheets it was 8 to 25 for upright ones, at most 1 for others.
    """
    if ink is None or ink.letters is None or len(ink.letters) < _FEW:
        return None
    no_sign = ink.letters.probability[:, COLUMN[JUNK]]
    chosen = np.argsort(no_sign, kind="stable")[:_ENOUGH]
    chosen = chosen[no_sign[chosen] < 0.5]
    if len(chosen) < _FEW:
        return None
    pictures = crops(ink.where.ink, ink.letters.box_mm[chosen] * ink.where.px_per_mm)
    best = []
    for turned in (pictures, np.ascontiguousarray(pictures[:, ::-1, ::-1])):
        scores = answers("signs", turned).astype(np.float64)
        best.append(scores[:, :-1].max(axis=1) - np.logaddexp.reduce(scores, axis=1))
    return float(np.clip(best[0] - best[1], -_NATS, _NATS).sum())


def _part(top: int, low: int, left: int, right: int) -> tuple[slice, slice]:
    return slice(top, low), slice(left, right)


def _window(ink: Ink, boxes: Sequence[Box] | None) -> tuple[int, int, GreyImage]:
    """Return left column, top row and contrast of the part of the map that holds the boxes."""
    picture, unit = ink.where.ink, ink.where.px_per_mm
    if boxes is None:
        return 0, 0, picture
    left, top = (max(0, round(unit * min(box[side] for box in boxes))) for side in (0, 1))
    right, bottom = (round(unit * max(box[side] + box[side + 2] for box in boxes)) for side in (0, 1))
    return left, top, picture[top : max(top, bottom), left : max(left, right)]


def _tiles(grey: GreyImage, drawn: GreyImage) -> list[tuple[int, int]]:
    """Return left columns and top rows of tiles that hold all ink that long strokes do not explain."""
    some = grey[::11, ::11]
    some = some[some > 2 * _FAINT]
    if len(some) == 0:
        return []
    least = max(2 * _FAINT, round(_SHARE * float(np.median(some))))
    dark = cv2.threshold(grey, least, 255, cv2.THRESH_BINARY)[1]
    rest = _coarse(np.asarray(cv2.subtract(dark, drawn), dtype=np.uint8)) > 255 * _REST
    # The long side of a square's neighbourhood is odd.
    about = 2 * round(_ABOUT_MM * PX_PER_MM / _REST_PX) + 1
    near = cv2.dilate(_coarse(drawn), np.ones((about, about), np.uint8)) > 0
    wanted = rest & near
    inner = (TILE_PX - 2 * _MARGIN_PX) // _REST_PX
    tiles = []
    for row in range(0, wanted.shape[0], inner):
        columns = np.flatnonzero(wanted[row : row + inner].any(axis=0))
        while len(columns):
            tiles.append((int(columns[0]) * _REST_PX - _MARGIN_PX, row * _REST_PX - _MARGIN_PX))
            columns = columns[columns >= columns[0] + inner]
    return tiles


def _coarse(plane: GreyImage) -> GreyImage:
    """Return means over squares, those at the right and lower border filled up with paper."""
    beyond = [-side % _REST_PX for side in plane.shape]
    whole = cv2.copyMakeBorder(plane, 0, beyond[0], 0, beyond[1], cv2.BORDER_CONSTANT)
    size = whole.shape[1] // _REST_PX, whole.shape[0] // _REST_PX
    return np.asarray(cv2.resize(whole, size, interpolation=cv2.INTER_AREA), dtype=np.uint8)


@cache
def network(name: str) -> cv2.dnn.Net:
    """Load one of the two networks: `detector` or `signs`."""
    # OpenCV 5's other engine, its default, takes twice as long.
    classic = {"engine": cv2.dnn.ENGINE_CLASSIC} if hasattr(cv2.dnn, "ENGINE_CLASSIC") else {}
    return cv2.dnn.readNetFromONNX(str(Path(__file__).with_name(f"{name}.onnx")), **classic)


def answers(name: str, pictures: NDArray[np.uint8]) -> Float32Array:
    """Return a network's answers for (n, h, w) pictures, 255 = ink."""
    of = network(name)
    parts = []
    for first in range(0, len(pictures), _AT_ONCE):
        of.setInput(pictures[first : first + _AT_ONCE, None].astype(np.float32) / np.float32(255.0))
        parts.append(np.array(of.forward(), dtype=np.float32))
    return np.concatenate(parts)


def _signs(grey: GreyImage, tiles: Sequence[tuple[int, int]]) -> tuple[FloatArray, FloatArray]:
    """Return boxes (k, 4) x, y, w, h in pixels of `grey`, and (k, signs) probabilities, of all signs."""
    if not tiles:
        return np.zeros((0, 4)), np.zeros((0, len(SIGNS)))
    around = np.pad(grey, TILE_PX)
    corners = np.array(tiles)
    pictures = np.stack([around[y : y + TILE_PX, x : x + TILE_PX] for x, y in corners + TILE_PX])
    found = peaks(spread(answers("detector", pictures)), _MARGIN_PX // CELL_PX)
    box = found.box + np.pad(corners[found.tile], ((0, 0), (0, 2)))
    once = _distinct(box, found.odds)
    box = box[once]
    if not len(box):
        return box, np.zeros((0, len(SIGNS)))
    return box, probabilities(found.odds[once], answers("signs", crops(grey, box)))


def crops(grey: GreyImage, box: FloatArray) -> NDArray[np.uint8]:
    """Return (k, 32, 32) pictures of the contents of boxes (k, 4) x, y, w, h, with a margin."""
    side = np.maximum(_AROUND * box[:, 2:].max(axis=1), _LEAST_CROP_PX)
    corner = box[:, :2] + box[:, 2:] / 2.0 - side[:, None] / 2.0
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    size = (CROP_PX, CROP_PX)
    pictures = []
    for (x, y), scale in zip(corner.tolist(), (side / CROP_PX).tolist(), strict=True):
        # Pixel q of the crop covers q to q + 1 of its side.
        to_grey = np.array([[scale, 0.0, x + 0.5 * scale], [0.0, scale, y + 0.5 * scale]])
        pictures.append(cv2.warpAffine(grey, to_grey, size, flags=flags, borderMode=cv2.BORDER_CONSTANT))
    return np.array(pictures, dtype=np.uint8).reshape(-1, CROP_PX, CROP_PX)


def spread(told: Float32Array) -> Float32Array:
    """Return (n, planes, high, wide) answers by cell: the network gives those of 2 x 2 cells together."""
    count, planes, high, wide = told.shape
    told = told.reshape(count, planes // 4, 2, 2, high, wide).transpose(0, 1, 4, 2, 5, 3)
    return np.ascontiguousarray(told).reshape(count, planes // 4, 2 * high, 2 * wide)


@dataclass(frozen=True, slots=True)
class Peaks:
    """Positions that are likelier the middle of a sign than those around them.

    Attributes
    ----------
    tile : (k,) index of the tile
    box : (k, 4) x, y, w, h of the sign in the tile's pixels
    odds : (k,) log odds that it is a sign
    """

    tile: IntArray
    box: FloatArray
    odds: FloatArray


def peaks(told: Float32Array, margin: int) -> Peaks:
    """Return the peaks in tiles; `told` as `spread` gives it, without `margin` cells at the border."""
    odds = told[:, 0]
    highest = np.stack([cv2.dilate(plane, np.ones((3, 3), np.uint8)) for plane in odds])
    inner = np.zeros(odds.shape[1:], dtype=bool)
    inner[margin:-margin, margin:-margin] = True
    tile, row, column = np.nonzero((odds >= highest) & (odds > _LEAST) & inner)
    border = told[tile, 1:5, row, column].astype(np.float64)
    middle = CELL_PX * np.column_stack([column, row]) + (CELL_PX - 1) / 2.0
    low, far = middle - UNIT_PX * border[:, :2], middle + UNIT_PX * border[:, 2:]
    box = np.concatenate([low, np.maximum(far - low, 1.0)], axis=1)
    return Peaks(tile, box, odds[tile, row, column].astype(np.float64))


def probabilities(odds: FloatArray, scores: Float32Array) -> FloatArray:
    """Combine the two networks' answers to (k, signs) probabilities, tempered."""
    named = np.exp(_COOLING * (scores[:, :-1] - scores[:, :-1].max(axis=1, keepdims=True)).astype(np.float64))
    against = np.logaddexp.reduce(scores[:, :-1].astype(np.float64), axis=1) - scores[:, -1]
    sign = 1.0 / (1.0 + np.exp(-(_WEIGHTS[0] * odds + _WEIGHTS[1] * against + _WEIGHTS[2])))
    share = (1.0 - _STRANGE) * named / named.sum(axis=1, keepdims=True) + _STRANGE / len(DETECTED)
    probability = np.zeros((len(scores), len(SIGNS)))
    probability[:, [COLUMN[name] for name in DETECTED]] = sign[:, None] * share
    probability[:, COLUMN[JUNK]] = 1.0 - sign
    return probability


def _distinct(box: FloatArray, odds: FloatArray) -> IntArray:
    """Return one row for each sign: of overlapping boxes the one that is likeliest a sign."""
    order = np.argsort(-odds, kind="stable")
    low, far = box[order, :2], box[order, :2] + box[order, 2:]
    shared = np.maximum(np.minimum(far[:, None], far) - np.maximum(low[:, None], low), 0.0).prod(axis=2)
    area = box[order, 2:].prod(axis=1)
    same = shared > _SAME * np.minimum(area[:, None], area)
    kept = np.zeros(len(order), dtype=bool)
    for row in range(len(order)):
        kept[row] = not (same[row] & kept).any()
    return np.asarray(order[kept], dtype=np.int64)


def _in_words(box: FloatArray) -> BoolArray:
    """Return which boxes stand in a line with many others."""
    x, y, w, h = box.T[:, :, None]
    beside = x.T - x - w < _GAP * np.maximum(h, h.T)
    level = np.minimum(y + h, (y + h).T) - np.maximum(y, y.T) > _LEVEL * np.minimum(h, h.T)
    beside_left = scipy.sparse.coo_matrix(beside & level & (x < x.T))
    line = scipy.sparse.csgraph.connected_components(beside_left, directed=False)[1]
    return np.asarray(np.bincount(line, minlength=1)[line] > _WORDS)


def _drawn(ink: Ink, corner: tuple[int, int], shape: Sequence[int]) -> GreyImage:
    """Return 255 where a long fitted stroke runs; rings are excluded: a letter o is one."""
    unit, shift = ink.where.px_per_mm, 4
    fine = 1 << shift
    drawn = np.zeros(tuple(shape), dtype=np.uint8)

    def px(points: FloatArray) -> NDArray[np.int32]:
        return np.rint((points * unit - corner) * fine).astype(np.int32)

    long = lengths_and_directions(ink.strokes.ends)[0] >= _LONG_MM
    for ends, width in zip(px(ink.strokes.ends[long]), ink.strokes.width[long], strict=True):
        pen = max(1, round((width + _GROWN_MM) * unit))
        cv2.line(drawn, ends[0].tolist(), ends[1].tolist(), 255, pen, cv2.LINE_8, shift)
    return drawn
