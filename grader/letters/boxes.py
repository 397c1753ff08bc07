"""What is written in the printed boxes: scales as texts, measured lengths a digit in each cell."""

from collections.abc import Mapping, Sequence

import cv2
import numpy as np

from grader.layout import SCALE_BOXES
from grader.letters.alphabet import COLUMN, JUNK
from grader.letters.features import normalised
from grader.letters.grammar import Text, texts_of
from grader.letters.line import Lattice, lattice_of
from grader.letters.model import recognise
from grader.pixels import cut_out
from grader.quantities import ByRule, Declared, ParsedScale, parse_scale
from grader.records import (
    ACCELERATION_PLAN,
    MECHANISM,
    VELOCITY_PLAN,
    Box,
    FloatArray,
    GreyImage,
    Page,
    Sheet,
    Written,
)

_PX_PER_MM = 12.0
"""Resolution at which writing is read: a digit of 3 mm is as high as the recogniser's picture, and more."""
_BORDER_MM, _CELL_BORDER_MM = 0.55, 0.4
"""Inside of a box's and of a cell's printed line, with the print's and the registration's error."""
_PAPER = 0.8
"""Quantile of a box's pixels that is paper: writing never fills a fifth of it."""
_FOREIGN = 0.25
"""Log likelihood by sign that a text may lack against signs at will, before it is doubted."""
_LARGE, _HARDLY = 1000.0, -4.0
"""From here on, a number lost its decimal point more likely than that anybody chose the scale."""
_MOST_TEXTS = 200
"""Less likely texts add nothing to the sum of those that mean the same."""
_SCALE_OF: Mapping[str, str] = {MECHANISM: "kL", VELOCITY_PLAN: "kv", ACCELERATION_PLAN: "ka"}
_DIGITS = "0123456789"
_LEAST_PEAK = 40
"""Of 255: a cell whose darkest ink is fainter is empty."""
_INK = 0.4
"""Of a cell's darkest ink: what is fainter is blur."""
_LEAST_MM = 1.0
"""Ink no higher than this is no digit: dust, a dot, the border of the next cell."""
_DUST_MM = 0.35
"""Nor is it a part of one."""
_SOFTEN_MM = 0.11
"""A pencil's grain breaks strokes: they are closed before pieces are told from dust."""
_FULL = 0.97
"""Share of a cell that is less inked than the middle of a stroke."""
_NO_TENTHS = 0.5
"""Confidence in whole millimetres where the cell of the tenths is left empty: a shifted number looks so."""


def written_scales(page: Page, sheet: Sheet, units: Mapping[str, str] | None = None) -> dict[str, Written]:
    """What stands in the boxes of a printed sheet, by scale; empty boxes, and a plain sheet, give nothing.

    Arguments: `units` are the units of bare numbers where the assignment says them, by scale.
    """
    names = [_SCALE_OF[figure] for figure in sheet.zones if figure in _SCALE_OF]
    if not names:
        return {}
    scales = {}
    for name in names:
        lattice = lattice_of(_writing(page, sheet, SCALE_BOXES[name], _BORDER_MM), _PX_PER_MM)
        if lattice.count:
            scales[name] = read_scale(lattice, name, (units or {}).get(name))
    return scales


def read_scale(lattice: Lattice, name: str, bare_unit: str | None = None) -> Written:
    """The likeliest scale in a line of writing."""
    texts, at_will = texts_of(lattice, name)
    meant = _by_meaning(texts[:_MOST_TEXTS], name, bare_unit)
    if not meant:
        return Written("", 0.0)
    best = max(log for _, log in meant.values())
    shares = {meaning: (text, float(np.exp(log - best))) for meaning, (text, log) in meant.items()}
    total = sum(share for _, share in shares.values())
    fits = float(np.exp(min(0.0, best - at_will + _FOREIGN * lattice.count)))
    ranked = sorted(
        ((text, fits * share / total) for text, share in shares.values()), key=lambda one: -one[1]
    )
    return Written(ranked[0][0], ranked[0][1], tuple(ranked[1:4]))


def _by_meaning(texts: list[Text], name: str, bare_unit: str | None) -> dict[object, tuple[str, float]]:
    """Texts that mean the same put together: the likeliest spelling, and the log of their sum."""
    meanings: dict[object, tuple[str, float]] = {}
    for candidate in texts:
        meaning = _meaning(parse_scale(name, candidate.text, bare_unit=bare_unit))
        if meaning is None:
            continue
        unlikely = _HARDLY if isinstance(meaning, float) and meaning >= _LARGE else 0.0
        text, log = meanings.get(meaning, (candidate.text, -np.inf))
        meanings[meaning] = (text, float(np.logaddexp(log, candidate.log + unlikely)))
    return meanings


def _meaning(parsed: ParsedScale) -> object | None:
    match parsed:
        case Declared(per_mm=value):
            return float(f"{value:.9g}")
        case ByRule(powers=powers):
            return tuple(sorted(powers.items()))
        case _:
            return None


def _writing(page: Page, sheet: Sheet, box: Box, border_mm: float) -> GreyImage:
    """Contrast inside a printed box without its border, upright, 12 px/mm; empty outside of the picture."""
    x, y, wide, high = box
    inner = x + border_mm, y + border_mm, wide - 2.0 * border_mm, high - 2.0 * border_mm
    grey = cut_out(page.grey, sheet.mm_to_px, inner, _PX_PER_MM)
    if grey.size == 0:
        return grey
    paper = max(float(np.quantile(grey, _PAPER)), 1.0)
    return np.asarray(np.clip(255.0 * (1.0 - grey / paper), 0.0, 255.0), dtype=np.uint8)


# Measured lengths ---------------------------------------------------------------------------------


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
            sign = _sign(_writing(page, sheet, box, _CELL_BORDER_MM))
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


def _sign(grey: GreyImage) -> GreyImage | None:
    """What is written in a cell, cut out; None where it is empty."""
    if grey.size == 0 or grey.max() < _LEAST_PEAK:
        return None
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
    columns = [COLUMN[digit] for digit in _DIGITS]
    value, sure = 0.0, 1.0
    for place in places:
        value *= 10.0
        if place is not None:
            row = probability[place, columns]
            best = int(np.argmax(row))
            sure *= float(row[best] / max(row.sum() + probability[place, COLUMN[JUNK]], 1e-9))
            value += best
    begun = places[next(index for index, place in enumerate(places) if place is not None) :]
    if None in begun[:-1]:
        sure = 0.0
    elif begun[-1] is None:
        sure *= _NO_TENTHS
    return value / 10.0, sure
