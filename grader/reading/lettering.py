"""Letters beside a figure's nodes as evidence for the nodes' names.

A letter is written a few millimetres from its node, mostly nearer to it than to any other: each piece of
writing is, with some probability, the label of each node near it, or of none. The likelihoods of the
writing under the names as read, with two of them swapped, and under random names show whether the
letters confirm a name. Letters do not replace the strokes: students swap letters, and pieces of strokes
look like letters.
"""

import math
from collections.abc import Collection, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np

from grader.records import MECHANISM, Figure, FloatArray, IntArray, Letters, Reading, Swapped
from reference.construction.graph import Construction
from reference.geometry import ComplexArray
from reference.quantities import group_of

REACH_MM = 8.0
"""Writing farther from every node is no label of one."""
FALL_MM = 1.4
"""The density of letters falls by 1/e for each such increase of the gap between their box and their node."""
STRAY = 0.03
"""Density of other letters, relative to that of a node's own letter at no gap."""
LEAST_MM, MOST_MM = 1.0, 7.5
"""Heights of letters; primes and points are lower, words run together are wider."""
SHARED = 0.5
"""Pieces that share this much of the smaller one's box are the same ink."""
RARE_NATS = 5.0
"""Two given letters of a plan are swapped in one plan of 150."""
PRIOR_OF_SWAP = 1.0 / (1.0 + math.exp(RARE_NATS))
"""Probability of a swap before letters are considered: the confidences hold with it."""
REPORTED = 0.6
"""Probability from which a swap is reported; whoever judges the drawing weighs it."""
COMPONENTS = ("n_", "k_")
"""Initials of ends of normal and Coriolis components: few people write them, and they share a letter."""
USUAL_SHARE = 0.04
"""Usual share of a sign among the pieces of a sheet: one in some 25."""
LEGIBLE, LEGIBLE_COMPONENT = 0.6, 0.2
"""Shares of nodes whose letters are written and read."""
LIKELY_PRIME = 0.5
"""Probability from which a sign counts as a prime."""
POLE_SIGNS = ("o", "p", "π")
"""Letters for the pole of a plan in different schools."""


@dataclass(frozen=True, slots=True)
class Lettering:
    """Pieces of writing near the nodes of a sheet.

    Attributes
    ----------
    nodes : (figure, node) of each column below
    share : (k, n) probability that a piece, if it is a letter, is the label of the node
    stray : (k,) probability that it is no node's; with `share` a row sums to 1
    fits : (k, n) likelihood ratio of the piece as the letter of the node and as a random letter
    letter : (k,) probability that the piece is a letter that some node may have
    """

    nodes: tuple[tuple[str, str], ...]
    share: FloatArray
    stray: FloatArray
    fits: FloatArray
    letter: FloatArray

    def log(self, named: IntArray | None = None) -> float:
        """Return the log likelihood of the writing, nats against random writing.

        Arguments: `named` (n,) the column whose letter stands at each node; each its own by default.
        """
        fits = self.fits if named is None else self.fits[:, named]
        likelihood = self.stray + (self.share * fits).sum(axis=1)
        return float(np.log(1.0 - self.letter + self.letter * likelihood).sum())

    def swaps(self) -> Iterator[tuple[int, int, float]]:
        """Yield pairs of nodes of one figure, with the nats by which swapping makes the writing likelier."""
        own = self.log()
        usual = np.arange(len(self.nodes))
        for first, second in combinations(range(len(self.nodes)), 2):
            if self.nodes[first][0] == self.nodes[second][0]:
                named = usual.copy()
                named[[first, second]] = second, first
                yield first, second, self.log(named) - own


def support(
    joints: Mapping[str, complex], letters: Letters | None, renamed: Mapping[str, str] | None = None
) -> float:
    """Return the letters' evidence for a mechanism's joints, nats against random ones; 0 without letters."""
    nodes = {(MECHANISM, name): at for name, at in joints.items()}
    writing = lettering(nodes, letters, renamed=renamed)
    return 0.0 if writing is None else writing.log()


def lettered(
    reading: Reading, letters: Letters | None, construction: Construction, renamed: Mapping[str, str]
) -> Reading:
    """Return a sheet's reading with likely swaps of letters, less certain if letters may be swapped.

    The names stay those of the construction. A reported swap leaves the confidences unchanged: they refer to
    the strokes, and one doubt counts once.
    """
    poles = frozenset(construction.poles.values())
    nodes = {
        (figure, name): node.at
        for figure, read in reading.figures.items()
        for name, node in read.nodes.items()
        if not group_of(figure)
    }
    writing = lettering(nodes, letters, poles, renamed)
    if writing is None:
        return reading
    figures, swaps = dict(reading.figures), []
    for first, second, nats in writing.swaps():
        (figure, p), (_, q) = writing.nodes[first], writing.nodes[second]
        if figure == MECHANISM or any(name in poles or name.startswith(COMPONENTS) for name in (p, q)):
            continue
        chance = 1.0 / (1.0 + math.exp(RARE_NATS - nats))
        if chance >= REPORTED:
            swaps.append(Swapped(figure, p, q, chance))
        else:
            left = min(1.0, (1.0 - chance) / (1.0 - PRIOR_OF_SWAP))
            figures[figure] = _doubted(figures[figure], {p, q}, construction, left)
    swaps.sort(key=lambda swap: -swap.confidence)
    return replace(reading, figures=figures, swapped=tuple(swaps))


def _doubted(figure: Figure, names: Collection[str], construction: Construction, share: float) -> Figure:
    """Return the figure with reduced confidence at some nodes and at the vectors that end there."""
    nodes = {
        name: replace(node, confidence=share * node.confidence) if name in names else node
        for name, node in figure.nodes.items()
    }
    vectors = {
        name: replace(read, confidence=share * read.confidence)
        if {construction.vectors[name].tail, construction.vectors[name].head} & set(names)
        else read
        for name, read in figure.vectors.items()
    }
    return Figure(nodes, vectors)


def fitting_letters(
    name: str,
    at: ComplexArray,
    letters: Letters | None,
    poles: Collection[str],
    renamed: Mapping[str, str],
) -> FloatArray:
    """Return (j,) nats of each point for being the node of this name, by the letters near it."""
    if letters is None or not len(letters):
        return np.zeros(len(at))
    signs = _signs(name, poles, renamed, letters)
    high = letters.height_mm
    gap = gaps(letters.box_mm, at)
    near = (gap.min(axis=1) < REACH_MM) & (high > LEAST_MM) & (high < MOST_MM)
    chance = letters.probability[:, signs].sum(axis=1)[near]
    if not len(chance):
        return np.zeros(len(at))
    fits = chance / USUAL_SHARE
    beside = (fits[:, None] * np.exp(-gap[near] / FALL_MM)).max(axis=0)
    legible = LEGIBLE_COMPONENT if name.startswith(COMPONENTS) else LEGIBLE
    return np.asarray(np.log(1.0 - legible + legible * beside))


def primes_beside(at: ComplexArray, letters: Letters | None) -> int:
    """Count the primes near some nodes: those of an acceleration plan have them, others have not."""
    if letters is None or "'" not in letters.column or not len(letters):
        return 0
    primes = gaps(letters.box_mm[letters.chance("'") > LIKELY_PRIME], at)
    return int(np.count_nonzero(primes.min(axis=1, initial=np.inf) < REACH_MM))


def lettering(
    nodes: Mapping[tuple[str, str], complex],
    letters: Letters | None,
    poles: Collection[str] = (),
    renamed: Mapping[str, str] | None = None,
) -> Lettering | None:
    """Return the writing near named nodes of a sheet; None if there is none.

    Arguments
    ---------
    nodes : by figure and name, complex sheet mm, y up
    poles : names of the plans' poles, whose letter differs from school to school
    renamed : what students write for a node, by name, if it is not the name
    """
    if letters is None or not nodes:
        return None
    signs = [_signs(name, poles, renamed or {}, letters) for _, name in nodes]
    at = np.array(list(nodes.values()))
    high = letters.height_mm
    gap = gaps(letters.box_mm, at)
    near = (gap.min(axis=1) < REACH_MM) & (high > LEAST_MM) & (high < MOST_MM)
    columns = sorted({column for of_node in signs for column in of_node})
    known = letters.probability[:, columns].sum(axis=1)
    rows = _apart(np.flatnonzero(near), letters.box_mm, known)
    if not len(rows):
        return None
    density = np.exp(-gap[rows] / FALL_MM)
    total = density.sum(axis=1) + STRAY
    chance = np.column_stack([letters.probability[rows][:, own].sum(axis=1) for own in signs])
    fits = (
        chance / np.maximum(known[rows], 1e-6)[:, None] * len(columns) / [max(len(own), 1) for own in signs]
    )
    return Lettering(
        tuple(nodes), density / total[:, None], STRAY / total, fits, np.minimum(known[rows], 1.0)
    )


def _signs(name: str, poles: Collection[str], renamed: Mapping[str, str], letters: Letters) -> list[int]:
    """Return the columns of a node's possible letters: its name's first, any school's at a pole."""
    written = renamed.get(name, name)[:1]
    signs = (written, *POLE_SIGNS) if name in poles else (written,)
    return sorted({letters.column[sign] for sign in signs if sign in letters.column})


def gaps(box_mm: FloatArray, at: ComplexArray) -> FloatArray:
    """Return (k, n) distances from boxes to points, 0 inside."""
    x, y, w, h = (side[:, None] for side in box_mm.T)
    across = np.maximum(np.maximum(x - at.real, at.real - x - w), 0.0)
    along = np.maximum(np.maximum(y + at.imag, -at.imag - y - h), 0.0)
    return np.asarray(np.hypot(across, along))


def _apart(rows: IntArray, box_mm: FloatArray, known: FloatArray) -> IntArray:
    """Return one row for each piece of ink: of overlapping ones the likeliest letter."""
    order = rows[np.argsort(-known[rows], kind="stable")]
    overlap = _overlaps(box_mm[order]) >= SHARED
    chosen = np.zeros(len(order), dtype=bool)
    for row in range(len(order)):
        chosen[row] = not (overlap[row] & chosen).any()
    return np.asarray(order[chosen], dtype=np.int64)


def _overlaps(box_mm: FloatArray) -> FloatArray:
    """Return (k, k) share of the smaller of two boxes that the other covers."""
    low, size = box_mm[:, :2], box_mm[:, 2:]
    far = low + size
    shared = np.maximum(np.minimum(far[:, None], far) - np.maximum(low[:, None], low), 0.0).prod(axis=2)
    area = size.prod(axis=1)
    return np.asarray(shared / np.maximum(np.minimum(area[:, None], area), 1e-9))
