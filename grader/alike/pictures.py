"""The ink of two sheets laid over each other: the very same drawing, scanned twice, nearly covers itself.

Each sheet is kept as a small map of where its ink lies. What many sheets have in common (frame, title
block, a printed sheet's lines) is left out, and how much independent drawings of this class resemble
each other is told by the class itself.
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
INKED = 12
"""Of 255: darker cells have ink."""
LEAST_SHEETS = 6
LEAST_ALIKE = 0.5
"""Correlation of the ink below which two sheets are never the same drawing."""

LEAST_SPREAD = 0.03
TAIL, TAIL_FROM = 2.0, 2.0
"""The log of the chance falls by 2 for each spread beyond the first: a heavy tail."""


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


def like_pictures(owners: Sequence[int], maps: Sequence[NDArray[np.uint8]], students: int) -> LikePictures:
    """Compare the sheets of a class.

    Arguments: `owners` tells whose each map is, an index below `students`.
    """
    chance, overlap = np.zeros((students, students)), np.zeros((students, students))
    owner = np.array(owners, np.int64)
    if len(set(owners)) < LEAST_SHEETS:
        return LikePictures(chance, overlap, 0)
    alike = _correlations(np.array(maps))
    others = owner[:, None] != owner[None, :]
    turned = np.arctanh(np.clip(alike, -0.999, 0.999))
    known = turned[others & np.triu(np.ones(alike.shape, bool))]
    low, middle, high = np.percentile(known, [15.87, 50.0, 84.13])
    spread = max(high - middle, middle - low, LEAST_SPREAD)
    beyond = (turned - middle) / spread
    # An exponential tail: heavier than a normal one, as resemblances are.
    log = np.where((alike > LEAST_ALIKE) & others, np.minimum(TAIL_FROM - TAIL * beyond, 0.0), 0.0)
    for i, j in np.argwhere(others & (alike > 0.0)):
        a, b = owner[i], owner[j]
        overlap[a, b] = max(overlap[a, b], alike[i, j])
        chance[a, b] = min(chance[a, b], log[i, j])
    return LikePictures(chance, overlap, len(set(owners)) * (len(set(owners)) - 1) // 2)


def _correlations(maps: NDArray[np.uint8]) -> FloatArray:
    """(sheets, sheets) how the ink of sheets correlates, where not all have it."""
    own = (maps > INKED).mean(axis=0) < COMMON
    ink = np.minimum(maps.astype(np.float32), 60.0) * own
    ink = _blurred(ink)[:, own]
    ink -= ink.mean(axis=1, keepdims=True)
    size = np.sqrt((ink**2).sum(axis=1, keepdims=True))
    ink /= np.maximum(size, 1e-6)
    return np.asarray((ink @ ink.T).astype(np.float64))


def _blurred(ink: NDArray[np.float32]) -> NDArray[np.float32]:
    """Each cell with its neighbours: a sheet lies a little otherwise at every scan."""
    down = 0.5 * ink
    down[:, 1:] += 0.25 * ink[:, :-1]
    down[:, :-1] += 0.25 * ink[:, 1:]
    across = 0.5 * down
    across[:, :, 1:] += 0.25 * down[:, :, :-1]
    across[:, :, :-1] += 0.25 * down[:, :, 1:]
    return across
