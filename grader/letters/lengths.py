"""Measured lengths in the cells of the printed answer sheet: a digit in each, the last the tenths."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from grader.letters.alphabet import COLUMN, JUNK
from grader.letters.features import normalised
from grader.letters.model import recognise
from grader.records import Box, FloatArray, GreyImage, Page, Sheet

DIGITS = "0123456789"
_PX_PER_MM = 12.0
_BORDER_MM = 0.4
"""Inside of a cell's printed line, with the print's and the registration's error."""
_LEAST_PEAK = 40
"""Of 255: a cell whose darkest ink is fainter is empty."""
_INK = 0.4
_LEAST_MM = 1.0
"""Ink no higher than this is no digit: dust, a dot, the border of the next cell."""
_DUST_MM = 0.35
"""Nor is it a part of one."""
_SOFTEN_MM = 0.11
_FULL = 0.97
"""Share of a cell that is less inked than the middle of a stroke."""
_NO_TENTHS = 0.5
"""Confidence in whole millimetres where the cell of the tenths is left empty: a shifted number looks so."""


def written_lengths(
    page: Page, sheet: Sheet, cells: Mapping[str, Sequence[Box]]
) -> dict[str, tuple[float, float]]:
    """Millimetres and the probability that they are what is written, by name; nothing for empty boxes.

    Arguments: `cells` are the boxes of a name's digits in sheet mm, from the left, the last for the tenths.
    What is no number (a gap between digits, a sign that is no digit) has the probability 0.
    """
    pictures: list[GreyImage] = []
    sizes: list[tuple[float, float]] = []
    filled: dict[str, list[int | None]] = {}
    for name, boxes in cells.items():
        filled[name] = []
        for box in boxes:
            sign = _sign(_crop(page.grey, sheet, box))
            filled[name].append(None if sign is None else len(pictures))
            if sign is not None:
                pictures.append(normalised(sign))
                sizes.append((sign.shape[1], sign.shape[0]))
    probability = recognise(pictures, np.array(sizes, dtype=np.float64).reshape(-1, 2))
    return {
        name: _length(places, probability)
        for name, places in filled.items()
        if any(place is not None for place in places)
    }


def _crop(grey: GreyImage, sheet: Sheet, box: Box) -> GreyImage:
    """Contrast inside a cell, upright, 12 px/mm."""
    x, y, wide, high = box
    size = round((wide - 2.0 * _BORDER_MM) * _PX_PER_MM), round((high - 2.0 * _BORDER_MM) * _PX_PER_MM)
    step, half = 1.0 / _PX_PER_MM, _BORDER_MM + 0.5 / _PX_PER_MM
    place = np.array([[step, 0.0, x + half], [0.0, step, y + half], [0.0, 0.0, 1.0]])
    seen = cv2.warpPerspective(
        grey, sheet.mm_to_px @ place, size, flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
        borderMode=cv2.BORDER_REPLICATE,
    )  # fmt: skip
    paper = max(float(np.quantile(seen, 0.8)), 1.0)
    return np.asarray(np.clip(255.0 * (1.0 - seen / paper), 0.0, 255.0), dtype=np.uint8)


def _sign(grey: GreyImage) -> GreyImage | None:
    """What is written in a cell, cut out; None where it is empty."""
    if grey.size == 0 or grey.max() < _LEAST_PEAK:
        return None
    # A pencil's grain breaks strokes: they are closed before pieces are told from dust.
    soft = cv2.GaussianBlur(grey, (0, 0), _SOFTEN_MM * _PX_PER_MM)
    full = max(float(np.quantile(soft, _FULL)), 1.0)
    even = np.asarray(np.clip(soft * (255.0 / full), 0.0, 255.0), dtype=np.uint8)
    count, labels, stats, _ = cv2.connectedComponentsWithStats((even > _INK * 255.0).astype(np.uint8))
    heights = stats[1:, cv2.CC_STAT_HEIGHT] / _PX_PER_MM
    if count == 1 or heights.max() < _LEAST_MM:
        return None
    rows, columns = np.nonzero(np.isin(labels, 1 + np.flatnonzero(heights >= _DUST_MM)))
    part = even[rows.min() : rows.max() + 1, columns.min() : columns.max() + 1]
    return np.ascontiguousarray(part)


def _length(places: Sequence[int | None], probability: FloatArray) -> tuple[float, float]:
    """The number in a row of cells; a digit is told from the other digits and from what is no sign."""
    columns = [COLUMN[digit] for digit in DIGITS]
    value, sure, begun = 0.0, 1.0, False
    for place in places:
        value *= 10.0
        if place is not None:
            row = probability[place, columns]
            best = int(np.argmax(row))
            sure *= float(row[best] / max(row.sum() + probability[place, COLUMN[JUNK]], 1e-9))
            value += best
        elif begun:
            sure *= _NO_TENTHS if place is places[-1] and len(places) > 1 else 0.0
        begun = begun or place is not None
    if places[-1] is None and any(place is None for place in places[:-1][_first(places) :]):
        sure = 0.0
    return value / 10.0, sure


def _first(places: Sequence[int | None]) -> int:
    return next(index for index, place in enumerate(places) if place is not None)
