"""The ink of two sheets laid over each other: the very same drawing, scanned twice, nearly covers itself.

Each sheet is stored as a small map of where its ink lies. What belongs to the page (frame, title block,
folds, a printed sheet's lines) is left out, and the class itself shows how much independent drawings
resemble each other.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from grader.records import FloatArray, GreyImage

CELL_MM = 2.5
CELLS = (118, 168)
"""Rows and columns of an A3 sheet's map; what lies outside is left out."""
COMMON = 0.3
"""Share of the sheets with ink in a cell from which it belongs to the sheet, not to the drawing."""
INKED = 3
"""Of 255: darker cells have ink, of a hard pencil too."""
DARKEST = 60.0
"""A darker cell counts as this one: ink and pencil weigh alike."""
RUN, RUN_INKED = 32, 0.8
"""Cells of a straight run (80 mm) that is the page's, and the share of them that have ink."""
PART = 12
"""Side of a part in cells: 30 mm, a letter or line with its surroundings, less than a figure."""
FAINT = 20.0
"""Norm of a part's ink below which it is dust."""
LEAST_PARTS = 8
"""A sheet with ink in fewer parts shows too little to be recognised by."""
LEAST_SHEETS = 7
"""Of six sheets two are a third: what they share would be taken for the page's."""
QUANTILES = 0.84, 0.95
"""The upper one leaves a copied pair out in a class of seven."""
TAIL_DROP = float(np.log((1.0 - QUANTILES[0]) / (1.0 - QUANTILES[1])))
LEAST_SPREAD = 0.015
"""Of the inverse hyperbolic tangent of the correlation: a class of few pairs may show less by chance."""
LEAST_ALIKE = 0.5
"""Mean correlation of the parts below which two sheets are never the same drawing."""


@dataclass(frozen=True, slots=True)
class LikePictures:
    """Every two students' sheets; arrays (students, students).

    Attributes
    ----------
    log_chance : natural logarithm of the chance that sheets of this class are so alike; 0 where not compared
    overlap : correlation of the ink, the largest of any two sheets
    pairs : compared
    """

    log_chance: FloatArray
    overlap: FloatArray
    pairs: int


def ink_map(scan: GreyImage, page_mm: tuple[float, float]) -> NDArray[np.uint8]:
    """(118, 168) mean darkness of an upright sheet's cells, 0 = paper.

    Arguments: `scan` (h, w) uint8, 255 = paper, that shows the whole page of `page_mm`.
    """
    found = np.zeros(CELLS, np.uint8)
    high, wide = scan.shape
    if high < CELLS[0] or wide < CELLS[1]:
        return found
    edges = [
        np.minimum((np.arange(cells + 1) * CELL_MM / size * pixels).astype(np.int64), pixels)
        for cells, size, pixels in ((CELLS[0], page_mm[1], high), (CELLS[1], page_mm[0], wide))
    ]
    rows, columns = (edge[:-1][np.diff(edge) > 0] for edge in edges)
    last = edges[0][len(rows)], edges[1][len(columns)]
    dark = 255 - scan[: last[0], : last[1]]
    sums = np.add.reduceat(np.add.reduceat(dark, rows, axis=0, dtype=np.int64), columns, axis=1)
    area = np.diff([*rows, last[0]])[:, None] * np.diff([*columns, last[1]])
    found[: len(rows), : len(columns)] = sums / area
    return found


def like_pictures(
    owners: Sequence[int], maps: Sequence[NDArray[np.uint8]], printed: NDArray[np.bool_]
) -> LikePictures:
    """Compare the sheets of a class.

    Arguments: `owners` tells whose each map is, an index of `printed`: who drew on printed answer sheets.
    """
    students = len(printed)
    overlap = np.zeros((students, students))
    owner = np.array(owners, np.int64)
    having = np.unique(owner)
    if len(having) < LEAST_SHEETS:
        return LikePictures(np.zeros_like(overlap), overlap, 0)
    np.maximum.at(overlap, (owner[:, None], owner[None, :]), _agreement(np.array(maps), printed[owner]))
    rows, columns = having[np.array(np.triu_indices(len(having), 1))]
    scaled = np.arctanh(np.minimum(overlap, 0.999))
    tail = _log_tail(scaled, scaled[rows, columns], LEAST_SPREAD)
    # A few printed sheets among plain ones (or the reverse) are each other's like by their print.
    many = np.bincount(printed[having], minlength=2)[printed.astype(np.int64)] >= LEAST_SHEETS
    compared = (printed[:, None] != printed[None, :]) | many
    log = np.where((overlap > LEAST_ALIKE) & compared, tail, 0.0)
    return LikePictures(log, overlap, len(rows))


def _log_tail(values: FloatArray, known: FloatArray, least: float) -> FloatArray:
    """Log of the chance of values as large, by an exponential tail through upper quantiles of the known ones.

    The tail is heavier than a normal one, as resemblances are, and no steeper than the class shows: where
    all follow one layout some pairs are much more like each other than others. `least` is its scale at
    the least, in the unit of the values.
    """
    middle, high, higher = np.quantile(known, [0.5, *QUANTILES])
    scale = max((high - middle) / 2.0, (higher - high) / TAIL_DROP, least)
    return np.asarray(np.minimum(np.log(1.0 - QUANTILES[1]) - (values - higher) / scale, 0.0))


def _agreement(maps: NDArray[np.uint8], printed: NDArray[np.bool_]) -> FloatArray:
    """(sheets, sheets) correlation of the ink in one part of the page, the mean over parts that have ink.

    A part counts once, however dark it is: a block, a stain or an edge that two sheets share cannot
    stand for the whole of them.
    """
    ink = np.minimum(maps.astype(np.float32), DARKEST) * ~_of_the_page(maps, printed)
    parts = _parts(_blurred(ink))
    size = np.sqrt((parts**2).sum(axis=2))
    parts /= np.maximum(size, FAINT)[..., None]
    total, count = np.zeros((2, len(maps), len(maps)))
    for part, its_size in zip(parts, size, strict=True):
        having = (its_size[:, None] > FAINT) | (its_size[None, :] > FAINT)
        total += having * (part @ part.T)
        count += having
    return np.asarray(total / np.maximum(count, LEAST_PARTS))


def _of_the_page(maps: NDArray[np.uint8], printed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """(sheets, rows, columns) ink of the page, not of the drawing.

    It is what many printed or many plain sheets have in common, and straight runs along an edge that
    are longer than a figure's lines: frame, rows of a title block, folds, squares, the desk beside
    the paper.
    """
    inked = maps > INKED
    runs = _long_runs(inked) | _long_runs(inked.transpose(0, 2, 1)).transpose(0, 2, 1)
    for kind in (printed, ~printed):
        if kind.any():
            runs[kind] |= inked[kind].mean(axis=0) >= COMMON
    return runs


def _long_runs(inked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells of straight runs along the last axis.

    A run may step aside by a cell, for the page lies askew, and have gaps, for pencil is faint.
    """
    # A row has fewer than 256 cells: counts fit into bytes.
    wide = _with_neighbours(inked).astype(np.uint8)
    sums = np.pad(wide.cumsum(axis=2, dtype=np.uint8), ((0, 0), (0, 0), (1, 0)))
    begins = sums[..., RUN:] - sums[..., :-RUN] >= RUN_INKED * RUN
    marks = np.pad(begins, ((0, 0), (0, 0), (RUN, RUN))).cumsum(axis=2, dtype=np.uint8)
    covered = marks[..., RUN:] - marks[..., :-RUN] > 0
    return _with_neighbours(covered[..., : inked.shape[2]])


def _with_neighbours(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Cells and those beside them across the last axis."""
    wide = cells.copy()
    wide[:, 1:] |= cells[:, :-1]
    wide[:, :-1] |= cells[:, 1:]
    return wide


def _parts(ink: NDArray[np.float32]) -> NDArray[np.float32]:
    """(parts, sheets, cells) squares of `PART` cells, those at the end filled up with paper."""
    sheets, rows, columns = ink.shape
    down, across = -(-rows // PART), -(-columns // PART)
    whole = np.zeros((sheets, down * PART, across * PART), np.float32)
    whole[:, :rows, :columns] = ink
    cut = whole.reshape(sheets, down, PART, across, PART).transpose(1, 3, 0, 2, 4)
    return np.ascontiguousarray(cut).reshape(down * across, sheets, PART * PART)


def _blurred(ink: NDArray[np.float32]) -> NDArray[np.float32]:
    """Each cell with its neighbours: a sheet lies a little otherwise at every scan."""
    down = 0.5 * ink
    down[:, 1:] += 0.25 * ink[:, :-1]
    down[:, :-1] += 0.25 * ink[:, 1:]
    across = 0.5 * down
    across[:, :, 1:] += 0.25 * down[:, :, :-1]
    across[:, :, :-1] += 0.25 * down[:, :, 1:]
    return across
