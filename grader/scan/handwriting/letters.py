"""Letters on a drawing, beside its nodes."""

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import NDArray

from grader.records import Box, FloatArray, GreyImage, Ink, Letters
from grader.scan.handwriting.model import COLUMN, COOLING, STRANGE, normalised, recognise
from grader.scan.pixels import lengths_and_directions

_LEAST_MM, _MOST_MM = 1.0, 9.0
"""Longer side of what can be a letter: less is a point or a prime, more two letters run together."""
_FAINT = 20
"""Of 255: fainter is paper."""
_SHARE = 0.2
"""Of the usual darkness of the sheet's ink: fainter is squared paper, or the back showing through."""
_PEAK_MM = 0.9
"""Window of the darkest ink close by: three strokes wide."""
_GROWN_MM = 0.16
"""Strokes are taken out with so much more than their width: the hand's wobble and the blur."""
_LONG_MM = 6.0
"""Shorter strokes may be the letters' own."""
_STUB_MM = 0.9
"""Smaller pieces that strokes leave are their frayed borders."""
_TOUCHED = 0.08
"""A piece is cut free of strokes as well where so much of its ink is theirs."""
_THIN = 0.13
"""Of the longer side: thinner is a piece of a line."""
_GAP, _LEVEL = 0.9, 0.4
"""Signs of one line of writing: so many heights apart, so much of the lower one's height at one level."""
_WORDS = 7
"""More signs in a line are words or a calculation, no letter of a node."""
_MOST = 1000
"""No drawing has more signs: squared paper has, or a picture."""


def find_letters(ink: Ink, boxes: Sequence[Box] | None = None) -> Letters:
    """Every piece of ink that can be a letter of a node, with its probabilities; no words or calculations.

    A piece that touches strokes is given as it is and as it remains without them.

    Arguments: `boxes` is where to look, sheet mm; the whole sheet by default.
    """
    unit = ink.where.px_per_mm
    left, top, grey = _window(ink, boxes)
    mask = _mask(grey, unit)
    drawn = _drawn(ink, (left, top), mask.shape)
    pieces = _pieces(mask, unit, _LEAST_MM)
    rest = mask.copy()
    for piece in pieces:
        if drawn[piece.window][piece.own > 0].mean() < _TOUCHED:
            rest[piece.window] &= 1 - piece.own
    pieces = _but_words(pieces)
    cut = _pieces(_without(rest, drawn, _usual_px(ink)), unit, _STUB_MM)
    whole = np.arange(len(pieces) + len(cut)) < len(pieces)
    pieces = [*pieces, *cut]
    box = np.array([piece.box for piece in pieces], dtype=np.float64).reshape(-1, 4)
    pictures = [normalised(grey[piece.window] * piece.own) for piece in pieces]
    probability = recognise(pictures, box[:, 2:], COOLING, STRANGE)
    # A box's edge lies between pixels; the centre of pixel q is at q / unit mm.
    box[:, :2] += [left - 0.5, top - 0.5]
    return Letters(box / unit, probability, whole, COLUMN)


def _window(ink: Ink, boxes: Sequence[Box] | None) -> tuple[int, int, GreyImage]:
    """Left column, top row and contrast of the part of the map that holds the boxes."""
    picture, unit = ink.where.ink, ink.where.px_per_mm
    if boxes is None:
        return 0, 0, picture
    left, top = (max(0, round(unit * min(box[side] for box in boxes))) for side in (0, 1))
    right, bottom = (round(unit * max(box[side] + box[side + 2] for box in boxes)) for side in (0, 1))
    return left, top, picture[top : max(top, bottom), left : max(left, right)]


def _mask(grey: GreyImage, unit: float) -> GreyImage:
    """Ink as 1: at least half as dark as the darkest ink close by, so that faint letters are whole."""
    if grey.size == 0:
        return np.zeros((1, 1), dtype=np.uint8)
    some = grey[::11, ::11]
    some = some[some > 2 * _FAINT]
    least = max(_FAINT, round(_SHARE * float(np.median(some)))) if len(some) else 255
    side = 2 * round(_PEAK_MM * unit / 2.0) + 1
    peak = np.asarray(cv2.dilate(grey, np.ones((side, side), np.uint8)), dtype=np.uint8)
    half = np.maximum(peak >> 1, np.uint8(least))
    return np.asarray((grey >= half).view(np.uint8))


@dataclass(frozen=True, slots=True)
class _InkPiece:
    """A connected piece of ink: left, top, width, height in pixels, and 1 where it has ink."""

    box: tuple[int, int, int, int]
    own: GreyImage

    @property
    def window(self) -> tuple[slice, slice]:
        x, y, w, h = self.box
        return slice(y, y + h), slice(x, x + w)


def _pieces(mask: GreyImage, unit: float, least_mm: float) -> list[_InkPiece]:
    """The pieces of a mask that are neither too small nor too large for a sign."""
    contours, hierarchy = cv2.findContours(mask, cv2.RETR_CCOMP, cv2.CHAIN_APPROX_SIMPLE)
    pieces: list[_InkPiece] = []
    for index, contour in enumerate(contours):
        if hierarchy[0, index, 3] >= 0:
            continue
        x, y, w, h = cv2.boundingRect(contour)
        if not least_mm * unit <= max(w, h) <= _MOST_MM * unit or min(w, h) < _THIN * max(w, h):
            continue
        own = np.zeros((h, w), dtype=np.uint8)
        cv2.drawContours(own, [contour], 0, 1, cv2.FILLED, offset=(-x, -y))
        pieces.append(_InkPiece((x, y, w, h), own & mask[y : y + h, x : x + w]))
    return pieces if len(pieces) <= _MOST else []


def _but_words(pieces: list[_InkPiece]) -> list[_InkPiece]:
    """The pieces without those that stand in a line with many others."""
    if len(pieces) <= _WORDS:
        return pieces
    x, y, w, h = np.array([piece.box for piece in pieces], dtype=np.float32).T[:, :, None]
    beside = x.T - x - w < _GAP * np.maximum(h, h.T)
    level = np.minimum(y + h, (y + h).T) - np.maximum(y, y.T) > _LEVEL * np.minimum(h, h.T)
    line = np.arange(len(pieces))
    for first, second in np.argwhere(beside & level & (x < x.T)):
        if line[first] != line[second]:
            line[line == line[second]] = line[first]
    many = np.bincount(line)[line] > _WORDS
    return [piece for piece, is_word in zip(pieces, many, strict=True) if not is_word]


def _usual_px(ink: Ink) -> float:
    usual = float(np.median(ink.strokes.width)) if len(ink.strokes) else 0.4
    return (usual + _GROWN_MM) * ink.where.px_per_mm


def _drawn(ink: Ink, corner: tuple[int, int], shape: Sequence[int]) -> GreyImage:
    """1 where a long fitted stroke or a ring runs."""
    unit, shift = ink.where.px_per_mm, 4
    fine = 1 << shift
    drawn = np.zeros(tuple(shape), dtype=np.uint8)

    def px(points: FloatArray) -> NDArray[np.int32]:
        return np.rint((points * unit - corner) * fine).astype(np.int32)

    long = lengths_and_directions(ink.strokes.ends)[0] >= _LONG_MM
    for ends, width in zip(px(ink.strokes.ends[long]), ink.strokes.width[long], strict=True):
        pen = max(1, round((width + _GROWN_MM) * unit))
        cv2.line(drawn, ends[0].tolist(), ends[1].tolist(), 1, pen, cv2.LINE_8, shift)
    pen = max(1, round(_usual_px(ink)))
    for (x, y), radius in zip(px(ink.circles[:, :2]).tolist(), ink.circles[:, 2], strict=True):
        cv2.circle(drawn, (x, y), round(radius * unit * fine), 1, pen, cv2.LINE_8, shift)
    return drawn


def _without(mask: GreyImage, drawn: GreyImage, pen_px: float) -> GreyImage:
    """Ink left when strokes are taken out; across a stroke, ink between ink is put back."""
    rest = cv2.subtract(mask, drawn)
    across = round(pen_px) + 2
    bridged = cv2.morphologyEx(rest, cv2.MORPH_CLOSE, np.ones((across, across), np.uint8))
    back = cv2.bitwise_and(cv2.bitwise_and(bridged, drawn), mask)
    return np.asarray(cv2.bitwise_or(rest, back), dtype=np.uint8)
