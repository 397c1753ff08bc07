"""Find similar sheets: pairs that are more similar than independent drawings are by chance.

This is no accusation: a person should look at both. Well-drawn plans of one variant are similar anyway,
and so are the values of all who work exactly; the evidence is in the errors. Each kind of evidence gives
the chance of so much similarity between two independent students; times the number of pairs it is the
measure: the number of such pairs that a class of this size shows by chance.

The ink of two sheets is compared as well, on a coarse map: the same drawing, scanned twice, nearly
covers itself. Ink that many sheets have in common (frame, title block, a printed sheet's lines) is left
out, and the usual similarity of independent drawings is estimated on the class itself.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import groupby
from math import exp, log

import numpy as np
import scipy
from numpy.typing import NDArray

from grader.documents import AlikeDocument, Sign
from grader.records import FloatArray, GreyImage
from grader.similarity.drawings import DrawingSimilarity, compare_drawings
from grader.similarity.numbers import compare_numbers
from grader.similarity.submission import ComparedSubmission
from reference.authored.assignment import Assignment, Variant

FALSE_ALARMS = 0.001
"""Mean number of independent pairs that each kind of evidence names in a class by chance."""
NOTED = log(0.05)
"""A part of the evidence is named below this log chance."""
MOST_OWNERS = 3
"""If more students share a number, it does not show whose drawing it is."""
MOST_TOGETHER = 1000
"""Most sheets compared with each other: time and memory grow with the square of their number."""
Maps = Sequence[Sequence[NDArray[np.uint8]]]


@dataclass(frozen=True, slots=True)
class PictureSimilarity:
    """Similarity of every two students' sheets; arrays (students, students).

    Attributes
    ----------
    log_chance : natural logarithm of the chance of so much similarity in this class; 0 if not compared
    overlap : correlation of the ink, the largest of any two sheets
    pairs : compared
    """

    log_chance: FloatArray
    overlap: FloatArray
    pairs: int


@dataclass(slots=True)
class _Pair:
    """The evidence that two students' sheets are similar."""

    why: list[Sign] = field(default_factory=list)
    measure: float | None = None
    share: float | None = None
    compared: int = 0

    def add(self, why: Sequence[Sign], measure: float | None, share: float | None, compared: int) -> None:
        """Add a kind of evidence; the measure is that of the rarest coincidence."""
        self.why += [sign for sign in why if sign not in self.why]
        if measure is not None and (self.measure is None or measure < self.measure):
            self.measure, self.share, self.compared = measure, share, compared


def compared_together(variants: Sequence[Variant]) -> list[list[int]]:
    """Return which sheets are compared: all of a class; of a very large one, those of like variants.

    Returns: indices, in parts of `MOST_TOGETHER` at most, in which the sheets of a variant stay together.
    """
    parts: list[list[int]] = [[]]
    order = sorted(range(len(variants)), key=lambda k: (variants[k].n or 0, variants[k].position or 0))
    for _, group in groupby(order, key=variants.__getitem__):
        same = list(group)
        for begin in range(0, len(same), MOST_TOGETHER):
            some = same[begin : begin + MOST_TOGETHER]
            if len(parts[-1]) + len(some) > MOST_TOGETHER:
                parts.append([])
            parts[-1] += some
    return [sorted(part) for part in parts]


def find_similar(
    assignment: Assignment, submissions: Sequence[ComparedSubmission], maps: Maps = ()
) -> list[AlikeDocument]:
    """Return the groups of similar sheets that a person should compare, the most similar first.

    Arguments: `maps` are each submission's ink maps (see `ink_map`), in the order of `submissions`.
    """
    if len(submissions) < 2:
        return []
    pairs: dict[tuple[int, int], _Pair] = {}
    drawings = compare_drawings(assignment, submissions)
    why: dict[Sign, FloatArray] = {"hand_errors": drawings.log_errors, "same_place": drawings.log_places}
    _add(pairs, drawings.log_chance, drawings.pairs, why, drawings.cosine, drawings.count)
    numbers = compare_numbers(assignment, submissions)
    equal = numbers.equal / np.maximum(numbers.compared, 1)
    why = {"same_numbers": numbers.log_chance}
    _add(pairs, numbers.log_chance, numbers.pairs, why, equal, numbers.compared)
    owners = [k for k, of_student in enumerate(maps) for _ in of_student]
    printed = np.array([each.printed for each in submissions])
    pictures = compare_pictures(owners, [sheet for of_student in maps for sheet in of_student], printed)
    # Good drawings in one layout have the same ink: that is no rarer than their positions.
    log_chance = np.fmax(pictures.log_chance, drawings.log_layout)
    nothing = np.zeros_like(log_chance)
    _add(pairs, log_chance, pictures.pairs, {"same_picture": log_chance}, pictures.overlap, nothing)
    _add_other_numbers(pairs, submissions, drawings)
    strangers = [
        (i, j, pair)
        for (i, j), pair in pairs.items()
        if submissions[i].student_id != submissions[j].student_id
    ]
    entries = [
        _document(submissions, members, strangers) for members in _groups([(i, j) for i, j, _ in strangers])
    ]
    return sorted(entries, key=by_chance)


def by_chance(entry: AlikeDocument) -> tuple[bool, float, list[str]]:
    """Sort key of entries: the least expected from independent work first."""
    return entry.measure is None, entry.measure or 0.0, entry.students


def _add(
    pairs: dict[tuple[int, int], _Pair],
    log_chance: FloatArray,
    number: int,
    why: Mapping[Sign, FloatArray],
    share: FloatArray,
    compared: FloatArray,
) -> None:
    """Add the pairs with evidence rarer than `FALSE_ALARMS`, measured by their expected number in the class.

    Arguments: `why` gives the log chance by each sign, which is named where it is below `NOTED`.
    """
    expected = log_chance + log(max(number, 1))
    for i, j in np.argwhere(np.triu(expected < log(FALSE_ALARMS), 1)):
        signs = [sign for sign, by_sign in why.items() if by_sign[i, j] < NOTED]
        measure, part = exp(max(float(expected[i, j]), -600.0)), float(np.clip(share[i, j], 0.0, 1.0))
        pairs.setdefault((int(i), int(j)), _Pair()).add(signs, measure, part, int(compared[i, j]))


def _add_other_numbers(
    pairs: dict[tuple[int, int], _Pair],
    submissions: Sequence[ComparedSubmission],
    drawings: DrawingSimilarity,
) -> None:
    """Add the pairs of a student who drew with another number and the student who has that number."""
    for k, submission in enumerate(submissions):
        owners = [
            other
            for other, owner in enumerate(submissions)
            if submission.fits is not None
            and owner.variant == submission.fits[0]
            and owner.student_id != submission.student_id
        ]
        if len(owners) <= MOST_OWNERS:
            for other in owners:
                pair = pairs.setdefault((min(k, other), max(k, other)), _Pair())
                pair.add(["other_number"], None, None, 0)
    for (i, j), pair in pairs.items():
        fits = {k: drawings.fits[k] for k in (i, j)}
        crossed = [(fits[i], submissions[j].variant), (fits[j], submissions[i].variant)]
        if any(fit is not None and fit[0] == variant for fit, variant in crossed):
            pair.add(["other_number"], None, None, 0)


def _groups(pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Return the students who are connected by pairs."""
    groups: list[set[int]] = []
    for pair in pairs:
        joined = set(pair).union(*(group for group in groups if not group.isdisjoint(pair)))
        groups = [group for group in groups if group.isdisjoint(joined)] + [joined]
    return [sorted(group) for group in groups]


def _document(
    submissions: Sequence[ComparedSubmission],
    members: Sequence[int],
    strangers: Sequence[tuple[int, int, _Pair]],
) -> AlikeDocument:
    """Return an entry for a group of students, with the measure of its weakest pair that has one."""
    of_these = [pair for i, j, pair in strangers if i in members and j in members]
    weakest = max(of_these, key=lambda pair: -1.0 if pair.measure is None else pair.measure)
    return AlikeDocument(
        students=[submissions[k].student_id for k in members],
        positions=[submissions[k].variant.position for k in members],
        why=list(dict.fromkeys(sign for pair in of_these for sign in pair.why)),
        measure=weakest.measure,
        share=weakest.share,
        compared=weakest.compared,
    )


# Similarity of the ink -----------------------------------------------------------------------------

CELL_MM = 2.5
"""Side of a map's cell."""
CELLS = (118, 168)
"""Rows and columns of an A3 sheet's map; anything outside is left out."""
COMMON = 0.3
"""If this share of the sheets has ink in a cell, the ink belongs to the sheet, not to the drawing."""
INKED = 3
"""Cells darker than this, of 255, have ink, of a hard pencil too."""
DARKEST = 60.0
"""A darker cell counts as this one: ink and pencil weigh alike."""
RUN, RUN_INKED = 32, 0.8
"""Cells of a straight run (80 mm) that belongs to the page, and the share of them that have ink."""
PART = 12
"""Side of a part in cells: 30 mm, a letter or line with its surroundings, less than a figure."""
FAINT = 20.0
"""Norm of a part's ink below which it is dust."""
LEAST_PARTS = 8
"""A sheet with ink in fewer parts shows too little to be recognised by."""
LEAST_SHEETS = 7
"""Fewer sheets are not compared: of six, two are a third, and common ink would count as the page's."""
LEAST_OVERLAP = 0.5
"""Mean correlation of the parts below which two sheets are never the same drawing."""
LEAST_SPREAD = 0.015
"""Least scale of the tail, in inverse hyperbolic tangents: if all pairs are equal there is none."""
QUANTILES = 0.84, 0.95
"""The upper quantile excludes a copied pair in a class of seven."""
BLUR = (0.25, 0.5, 0.25)
"""Shares of a cell and its neighbours after a sheet has shifted a little, as it does with every scan."""
TAIL_DROP = float(np.log((1.0 - QUANTILES[0]) / (1.0 - QUANTILES[1])))
"""Fall of the logarithm of an exponential tail between the two quantiles."""


def ink_map(scan: GreyImage, page_mm: tuple[float, float]) -> NDArray[np.uint8]:
    """Return (118, 168) mean darkness of an upright sheet's cells, 0 = paper.

    Arguments: `scan` (h, w) uint8, 255 = paper, shows the whole page of `page_mm`.
    """
    ink = np.zeros(CELLS, np.uint8)
    high, wide = scan.shape
    if high < CELLS[0] or wide < CELLS[1]:
        return ink
    edges = [
        np.minimum((np.arange(cells + 1) * CELL_MM / size * pixels).astype(np.int64), pixels)
        for cells, size, pixels in ((CELLS[0], page_mm[1], high), (CELLS[1], page_mm[0], wide))
    ]
    rows, columns = (edge[:-1][np.diff(edge) > 0] for edge in edges)
    last = edges[0][len(rows)], edges[1][len(columns)]
    dark = 255 - scan[: last[0], : last[1]]
    sums = np.add.reduceat(np.add.reduceat(dark, rows, axis=0, dtype=np.int64), columns, axis=1)
    area = np.diff([*rows, last[0]])[:, None] * np.diff([*columns, last[1]])
    ink[: len(rows), : len(columns)] = sums / area
    return ink


def compare_pictures(
    owners: Sequence[int], maps: Sequence[NDArray[np.uint8]], printed: NDArray[np.bool_]
) -> PictureSimilarity:
    """Compare the sheets of a class.

    Arguments: `owners` gives the owner of each map, an index of `printed`: who drew on printed answer sheets.
    """
    students = len(printed)
    overlap = np.zeros((students, students))
    owner = np.array(owners, np.int64)
    having = np.unique(owner)
    if len(having) < LEAST_SHEETS:
        return PictureSimilarity(np.zeros_like(overlap), overlap, 0)
    np.maximum.at(overlap, (owner[:, None], owner[None, :]), _agreement(np.array(maps), printed[owner]))
    rows, columns = having[np.array(np.triu_indices(len(having), 1))]
    scaled = np.arctanh(np.minimum(overlap, 0.999))
    # A few printed sheets among plain ones (or the reverse) are similar by their print.
    many = np.bincount(printed[having], minlength=2)[printed.astype(np.int64)] >= LEAST_SHEETS
    compared = (printed[:, None] != printed[None, :]) | many
    log = np.where((overlap > LEAST_OVERLAP) & compared, _log_tail(scaled, scaled[rows, columns]), 0.0)
    return PictureSimilarity(log, overlap, len(rows))


def _log_tail(values: FloatArray, known: FloatArray) -> FloatArray:
    """Return the log chance of such values, by an exponential tail through upper quantiles of the known ones.

    The tail is heavier than a normal one, and no steeper than in the class: if all follow one layout, some
    pairs are much more similar than others.
    """
    middle, high, higher = np.quantile(known, [0.5, *QUANTILES])
    scale = max((high - middle) / 2.0, (higher - high) / TAIL_DROP, LEAST_SPREAD)
    return np.asarray(np.minimum(np.log(1.0 - QUANTILES[1]) - (values - higher) / scale, 0.0))


def _agreement(maps: NDArray[np.uint8], printed: NDArray[np.bool_]) -> FloatArray:
    """Return (sheets, sheets) correlation of the ink in a part of the page, the mean over inked parts.

    A part counts once, however dark it is: a block, a stain or an edge that two sheets share cannot stand for
    the whole of them.
    """
    ink = np.minimum(maps.astype(np.float32), DARKEST) * ~_of_the_page(maps, printed)
    parts = _parts(_blurred(ink))
    size = np.sqrt((parts**2).sum(axis=2))
    parts /= np.maximum(size, FAINT)[..., None]
    total, count = np.zeros((2, len(maps), len(maps)))
    for part, norm in zip(parts, size, strict=True):
        having = (norm[:, None] > FAINT) | (norm[None, :] > FAINT)
        total += having * (part @ part.T)
        count += having
    return np.asarray(total / np.maximum(count, LEAST_PARTS))


def _of_the_page(maps: NDArray[np.uint8], printed: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return (sheets, rows, columns) ink of the page, not of the drawing.

    It is ink that many printed or many plain sheets have in common, and straight runs along an edge that are
    longer than a figure's lines: frame, rows of a title block, folds, squares, the desk beside the paper.
    """
    inked = maps > INKED
    runs = _long_runs(inked) | _long_runs(inked.transpose(0, 2, 1)).transpose(0, 2, 1)
    for kind in (printed, ~printed):
        if kind.any():
            runs[kind] |= inked[kind].mean(axis=0) >= COMMON
    return runs


def _long_runs(inked: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return cells of straight runs along the last axis.

    A run may shift by a cell, because the page is askew, and have gaps, because pencil is faint.
    """
    # A row has fewer than 256 cells: counts fit into bytes.
    wide = _with_neighbours(inked)
    sums = np.pad(wide.cumsum(axis=2, dtype=np.uint8), ((0, 0), (0, 0), (1, 0)))
    begins = sums[..., RUN:] - sums[..., :-RUN] >= RUN_INKED * RUN
    marks = np.pad(begins, ((0, 0), (0, 0), (RUN, RUN))).cumsum(axis=2, dtype=np.uint8)
    covered = marks[..., RUN:] - marks[..., :-RUN] > 0
    return _with_neighbours(covered[..., : inked.shape[2]])


def _with_neighbours(cells: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return cells and those beside them across the last axis."""
    return np.asarray(scipy.ndimage.maximum_filter1d(cells, 3, axis=1, mode="constant"))


def _parts(ink: NDArray[np.float32]) -> NDArray[np.float32]:
    """Return (parts, sheets, cells) squares of `PART` cells, those at the end filled up with paper."""
    sheets, rows, columns = ink.shape
    down, across = -(-rows // PART), -(-columns // PART)
    whole = np.zeros((sheets, down * PART, across * PART), np.float32)
    whole[:, :rows, :columns] = ink
    cut = whole.reshape(sheets, down, PART, across, PART).transpose(1, 3, 0, 2, 4)
    return np.ascontiguousarray(cut).reshape(down * across, sheets, PART * PART)


def _blurred(ink: NDArray[np.float32]) -> NDArray[np.float32]:
    """Blur each cell with its neighbours."""
    for axis in (1, 2):
        ink = scipy.ndimage.correlate1d(ink, BLUR, axis, mode="constant")
    return ink
