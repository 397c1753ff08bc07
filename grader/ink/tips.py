"""Where vectors end along the strokes found: by arrowheads, dots, circles, and lines that meet there.

Each stroke is straightened into a band of ink, and all bands are laid end to end as one strip. A small
convolutional network (31 000 weights, trained by `docs/train_tips.py` on simulated sheets) tells for
every 0.3 mm of the strip how likely a vector's head or tail lies there and how far from the cell's
middle, after the manner of detectors by key points (Zhou, Wang, Kraehenbuehl 2019, Objects as Points).
"""

from dataclasses import dataclass
from functools import cache
from pathlib import Path

import cv2
import numpy as np

from grader.pixels import Flat, lengths_and_directions, mapped
from grader.records import NO_TIPS, FloatArray, IntArray, Strokes, Tips

STEP_MM = 0.15
"""Of the bands' pixels, along and across."""
HALF = 15
"""Pixels of a band to either side of its stroke."""
BEYOND_MM = 3.0
"""Of a band past its stroke's ends: an arrowhead is shorter."""
GAP = 20
"""Empty columns between bands."""
CELL = 2
"""Pixels along for each answer."""
STRIP = 4096
"""Columns that the network is given at a time."""
APART = 48
"""Columns at either side of a strip, whose answers do not know all that they should."""
FULL_INK = 1.3
"""Contrast that counts as 1, of the stroke's mean."""
LEAST_DARK, MOST_INK = 0.08, 1.5
"""Contrast below which a stroke counts as so dark, and the most that ink counts."""
LEAST_MM = 2.0
"""No vector is drawn shorter."""
LEAST_SURE = 0.15
ASIDE_MM = 0.5
"""A tip lies in its own cell or the next."""
KINDS = 4
"""Heads and tails, ahead and back."""


def find_tips(flat: Flat, strokes: Strokes, mm_to_px: FloatArray) -> Tips:
    """Heads and tails of vectors along strokes of at least 2 mm."""
    rows = np.flatnonzero(lengths_and_directions(strokes.ends)[0] >= LEAST_MM)
    if not len(rows):
        return NO_TIPS
    strip = strip_of(flat, strokes.ends[rows], strokes.darkness[rows], mm_to_px)
    return _peaks(strip, answers(strip.ink), rows)


@dataclass(frozen=True, slots=True)
class Strip:
    """Bands laid end to end.

    Attributes
    ----------
    ink : (31, t) contrast over that of the band's own stroke, 0..1.5
    band : (t,) which stroke each column is of
    along : (t,) mm from that stroke's first end
    """

    ink: FloatArray
    band: IntArray
    along: FloatArray


def strip_of(flat: Flat, ends: FloatArray, darkness: FloatArray, mm_to_px: FloatArray) -> Strip:
    """The strokes `ends` (k, 2, 2) mm straightened, 3 mm beyond their ends."""
    length, unit = lengths_and_directions(ends)
    count = np.ceil((length + 2.0 * BEYOND_MM) / STEP_MM / CELL).astype(np.int64) * CELL
    band = np.repeat(np.arange(len(ends)), count + GAP)
    first = np.concatenate([[0], np.cumsum(count + GAP)[:-1]])
    along = (np.arange(len(band)) - first[band]) * STEP_MM - BEYOND_MM
    aside = np.arange(-HALF, HALF + 1) * STEP_MM
    x = (ends[band, 0, 0] + along * unit[band, 0])[:, None] + aside * unit[band, 1, None]
    y = (ends[band, 0, 1] + along * unit[band, 1])[:, None] - aside * unit[band, 0, None]
    px = mapped(mm_to_px, np.stack([x, y], axis=-1))
    contrast = flat.contrast(px[..., 0], px[..., 1])
    own = FULL_INK * np.maximum(darkness, LEAST_DARK)
    contrast[along >= length[band] + BEYOND_MM] = 0.0
    return Strip(np.clip(contrast / own[band, None], 0.0, MOST_INK).T, band, along)


@cache
def _network() -> cv2.dnn.Net:
    return cv2.dnn.readNetFromONNX(str(Path(__file__).with_name("tips.onnx")))


def answers(ink: FloatArray) -> FloatArray:
    """(8, t/2): for each kind the log odds of a tip at a cell, then how far it is from there, mm."""
    wide = ink.shape[1]
    useful = STRIP - 2 * APART
    result = np.empty((2 * KINDS, wide // CELL), dtype=np.float32)
    padded = np.pad(ink.astype(np.float32), ((0, 0), (APART, STRIP)))
    for start in range(0, wide, useful):
        network = _network()
        network.setInput(np.ascontiguousarray(padded[None, None, :, start : start + STRIP]))
        output = network.forward()[0]
        part = slice(start // CELL, min(start + useful, wide) // CELL)
        result[:, part] = output[:, APART // CELL : APART // CELL + part.stop - part.start]
    return result


def _peaks(strip: Strip, scores: FloatArray, rows: IntArray) -> Tips:
    """Cells likelier than their neighbours on the same band."""
    sure = 1.0 / (1.0 + np.exp(-np.clip(scores[:KINDS], -30.0, 30.0)))
    near = np.stack([np.roll(sure, shift, axis=1) for shift in (-2, -1, 1, 2)]).max(axis=0)
    kind, cell = np.nonzero((sure > LEAST_SURE) & (sure >= near))
    column = cell * CELL
    along = strip.along[column] + np.clip(scores[KINDS + kind, cell], -ASIDE_MM, ASIDE_MM)
    return Tips(
        rows[strip.band[column]],
        along.astype(np.float64),
        kind.astype(np.int64),
        sure[kind, cell].astype(float),
    )
