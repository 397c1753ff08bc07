"""Names written beside the vectors of force polygons, as evidence for which vector is which.

A name is an initial, F, G or R, with smaller signs behind it: of the links, and of a part. It stands beside
the middle of its vector. What it says is held against the names of all forces of the construction: signs
that fit every name alike say nothing, so that badly read ones are harmless.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.expected import Edge
from grader.reading.lettering import FALL_MM, LEAST_MM, MOST_MM, REACH_MM, STRAY, gaps
from grader.reading.lines import Lines
from grader.records import FloatArray, IntArray, Letters
from reference.geometry import ComplexArray

LOOKS = {"F": "Ff", "G": "G6", "R": "Rpk"}
"""Signs that an initial is read as: without a line to stand on, large and small letters look alike."""
LEAST_INITIAL = 0.25
"""Least probability of an initial."""
MOST_BEHIND = 4
"""Most signs behind an initial, as in F_i3 and R_34 with its part."""
GAP, BELOW, ABOVE = 0.9, 0.9, 0.4
"""Largest gap between the signs of a name, and how far they stand below and above the initial, in heights."""
MISREAD, USUAL = 0.4, 0.08
"""Share of signs that are misread, and usual probability of a sign: one in twelve."""
MIDDLE = np.linspace(0.3, 0.7, 5)
"""Places along a vector beside which its name may stand."""
LEGIBLE = 0.6
"""Share of vectors whose names are written and read."""
LEAST_NAMED, CLEARER = 1.5, 1.3
"""Least likelihood of a name that a vector surely has, at its distance, and that in others' likelihoods."""
MARGIN_MM, SHARE = 0.4, 0.9
"""Strokes within so much of a name, and shorter than this share of its diagonal, are its own."""


@dataclass(frozen=True, slots=True)
class ForceLabels:
    """Names beside vectors.

    Attributes
    ----------
    names : names of all forces
    box_mm : (k, 4) x, y, width, height of each piece of writing, sheet mm, y down
    fits : (k, n) likelihood of each piece as each name, relative to the mean of all names
    """

    names: tuple[str, ...]
    box_mm: FloatArray
    fits: FloatArray

    def beside(self, name: str, tail: ComplexArray, head: ComplexArray) -> FloatArray:
        """Return (m,) nats of segments for being a force of this name, by the writing near each."""
        if not len(self.box_mm):
            return np.zeros(len(tail))
        near = np.exp(-self._gaps(tail, head) / FALL_MM)
        best = (self.fits[:, self.names.index(name), None] * near).max(axis=0)
        return np.asarray(np.log(1.0 - LEGIBLE + LEGIBLE * best))

    def log(self, names: Sequence[str], tail: ComplexArray, head: ComplexArray) -> float:
        """Return the log likelihood of the writing near some vectors, nats against any names."""
        if not len(self.box_mm) or not names:
            return 0.0
        gap = self._gaps(tail, head)
        density = np.exp(-gap / FALL_MM) * (gap < REACH_MM)
        fits = self.fits[:, [self.names.index(name) for name in names]]
        likelihood = (STRAY + (density * fits).sum(axis=1)) / (STRAY + density.sum(axis=1))
        return float(np.log(likelihood).sum())

    def named(self, names: Sequence[str], tail: ComplexArray, head: ComplexArray) -> set[str]:
        """Return which of some vectors have their names beside them, each clearer than any other's there."""
        if not len(self.box_mm) or len(names) < 2:
            return set()
        gap = self._gaps(tail, head)
        fits = self.fits[:, [self.names.index(name) for name in names]] * np.exp(-gap / FALL_MM)
        second, best = np.sort(fits, axis=1)[:, -2:].T
        clear = (best > LEAST_NAMED) & (best > CLEARER * second)
        return {names[column] for column in fits.argmax(axis=1)[clear]}

    def _gaps(self, tail: ComplexArray, head: ComplexArray) -> FloatArray:
        """Return (k, m) distances of the writing from the middle part of each segment."""
        at = tail[:, None] + (head - tail)[:, None] * MIDDLE
        return np.asarray(gaps(self.box_mm, at.ravel()).reshape(len(self.box_mm), *at.shape).min(axis=2))

    def without(self, lines: Lines) -> Lines:
        """Return the lines that are no strokes of the writing."""
        ends = np.stack([lines.start, lines.end])
        inside = (gaps(self.box_mm, ends.ravel()).reshape(len(self.box_mm), *ends.shape) < MARGIN_MM).all(
            axis=1
        )
        short = lines.length < SHARE * np.hypot(*self.box_mm[:, 2:].T)[:, None]
        return lines.take(~(inside & short).any(axis=0))


def force_labels(names: Sequence[str], letters: Letters | None) -> ForceLabels:
    """Return what may be the names of forces on a sheet.

    Arguments: `names` of all forces, such as ``R_34_t``.
    """
    fits, boxes = np.zeros((0, len(names))), np.zeros((0, 4))
    if letters is not None and len(letters) and names:
        signs = _signs(letters)
        found = [
            (first, _behind(first, signs, letters))
            for first in signs
            if _initial(first, letters).max() >= LEAST_INITIAL
        ]
        found = [(first, behind) for first, behind in found if len(behind)]
        if found:
            boxes = np.array([_around(letters.box_mm[[first, *behind]]) for first, behind in found])
            fits = np.array(
                [[_likelihood(name, first, behind, letters) for name in names] for first, behind in found]
            )
            fits /= fits.mean(axis=1, keepdims=True)
    return ForceLabels(tuple(names), boxes, fits)


def ends_of(edges: Sequence[Edge], at: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Return where the edges of a figure begin and end, by the places of its nodes."""
    return at[[edge.tail for edge in edges]], at[[edge.head for edge in edges]]


def _signs(letters: Letters) -> IntArray:
    """Return the rows of signs, from left to right."""
    high = letters.height_mm
    chosen = np.flatnonzero((high > LEAST_MM) & (high < MOST_MM) & (letters.chance("") < 0.5))
    return np.asarray(chosen[np.argsort(letters.box_mm[chosen, 0])], dtype=np.int64)


def _initial(row: int, letters: Letters) -> FloatArray:
    """Return the probabilities of the initials."""
    return np.array(
        [sum(letters.probability[row, letters.column[sign]] for sign in LOOKS[kind]) for kind in LOOKS]
    )


def _behind(first: int, signs: IntArray, letters: Letters) -> list[int]:
    """Return the signs behind an initial, as far as the next initial."""
    x, y, w, h = letters.box_mm[first]
    right, behind = x + w, list[int]()
    for row in signs.tolist():
        left, top, wide, high = letters.box_mm[row]
        if left < x + 0.3 * w or row == first:
            continue
        if len(behind) == MOST_BEHIND or left - right > GAP * h:
            break
        if not y - ABOVE * h < top + high / 2.0 < y + h + BELOW * h / 2.0:
            continue
        if high > 0.9 * h and _initial(row, letters).max() >= LEAST_INITIAL:
            break
        behind.append(row)
        right = max(right, left + wide)
    return behind


def _around(boxes: FloatArray) -> FloatArray:
    low, high = boxes[:, :2].min(axis=0), (boxes[:, :2] + boxes[:, 2:]).max(axis=0)
    return np.concatenate([low, high - low])


def _likelihood(name: str, first: int, behind: Sequence[int], letters: Letters) -> float:
    """Return the likelihood of some signs as a name, against random signs."""
    kind, written = name[0], [letters.column[sign] for sign in name[2:] if sign in letters.column]
    own = dict(zip(LOOKS, _initial(first, letters), strict=True)).get(kind, 0.0)
    shares = [own, *(letters.probability[row, written].max(initial=0.0) for row in behind)]
    part = name.split("_")[2:]
    if part:
        seen = letters.probability[list(behind), letters.column[part[0]]].max()
        shares[0] *= MISREAD + (1.0 - MISREAD) * min(1.0, seen / USUAL)
    return float(np.prod([MISREAD + (1.0 - MISREAD) * share / USUAL for share in shares]))
