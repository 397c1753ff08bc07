"""Drawings that look alike: errors of the hand and places on the sheet weighed together."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import gammaincc

from grader.alike.handed import Handed
from grader.alike.hands import Row, agreement, hands_of
from grader.alike.nodes import drawn_of, fitting
from grader.alike.places import place_chance
from grader.records import MECHANISM, FloatArray
from reference.assignment import Assignment, Variant
from reference.derivation import construction_of

RARE = -9.0
"""Log of the chance below which two placements make it worth to hold each against the other's variant."""


@dataclass(frozen=True, slots=True)
class LikeDrawings:
    """Every two students' drawings; arrays (students, students).

    Attributes
    ----------
    log_chance : natural logarithm of the chance that independent hands come so near; 0 where not compared
    log_hands, log_places : what errors of the hand and places on the sheet give alone
    log_layout : as `log_places`, of those who follow a layout; nan for others
    cosine, count : agreement of the errors, and how many there are
    pairs : of different students
    fits : the variant of the class that a drawing fits though it is not the own, and how far off it is, mm
    """

    log_chance: FloatArray
    log_hands: FloatArray
    log_places: FloatArray
    log_layout: FloatArray
    cosine: FloatArray
    count: FloatArray
    pairs: int
    fits: list[tuple[Variant, float] | None]


def like_drawings(assignment: Assignment, handed: Sequence[Handed]) -> LikeDrawings:
    """Compare the drawings of a class."""
    construction = construction_of(
        assignment.mechanism(assignment.variants()[:1]),
        plate_by_similarity=assignment.file.plate_images == "similarity",
    )
    figures = (MECHANISM, *construction.poles)
    drawn = drawn_of(handed, {one: [step.node for step in construction.figures[one]] for one in figures})
    fits = fitting(assignment, handed, drawn)
    variants = list(dict.fromkeys(one.variant for one in handed))
    printed = np.array([one.printed for one in handed])
    places, layout = place_chance(drawn, printed, np.array([variants.index(one.variant) for one in handed]))
    rows = _rows(handed, fits, places)
    hands = hands_of(assignment, handed, drawn, rows)
    together = _together(rows, handed)
    found = agreement(hands, together)
    log_hands, cosine, count = _by_student(
        rows,
        len(handed),
        np.asarray(np.where(together, found.log_chance, 0.0), np.float64),
        (found.cosine, found.count),
    )
    compared = _by_student(rows, len(handed), np.where(together, -1.0, 0.0), ())[0] < 0.0
    people = np.array([one.student_id for one in handed])
    return LikeDrawings(
        log_chance=np.where(compared, _both(log_hands, places), 0.0),
        log_hands=log_hands,
        log_places=np.where(compared, places, 0.0),
        log_layout=layout,
        cosine=cosine,
        count=count,
        pairs=int((people[:, None] != people[None, :]).sum()) // 2,
        fits=fits,
    )


def _rows(
    handed: Sequence[Handed], fits: Sequence[tuple[Variant, float] | None], places: FloatArray
) -> list[Row]:
    """Each drawing against its own variant, against those that it fits, and that of whose places it has."""
    rows = dict.fromkeys(Row(k, one.variant) for k, one in enumerate(handed))
    rows |= dict.fromkeys(Row(k, found[0]) for k, found in enumerate(fits) if found is not None)
    known = {one.variant for one in handed}
    rows |= dict.fromkeys(
        Row(k, one.fits[0]) for k, one in enumerate(handed) if one.fits is not None and one.fits[0] in known
    )
    if len(handed) > 1:
        rows |= dict.fromkeys(Row(int(j), handed[i].variant) for i, j in np.argwhere(places < RARE))
    return list(rows)


def _together(rows: Sequence[Row], handed: Sequence[Handed]) -> NDArray[np.bool_]:
    """(rows, rows) which rows are compared: of one variant, and of two people."""
    variants = {one: k for k, one in enumerate(dict.fromkeys(row.variant for row in rows))}
    people = {one: k for k, one in enumerate(dict.fromkeys(one.student_id for one in handed))}
    variant = np.array([variants[row.variant] for row in rows])
    person = np.array([people[handed[row.owner].student_id] for row in rows])
    return np.asarray((variant[:, None] == variant[None, :]) & (person[:, None] != person[None, :]))


def _by_student(
    rows: Sequence[Row], students: int, log_chance: FloatArray, others: Sequence[FloatArray]
) -> list[FloatArray]:
    """For every two students the rows that agree best, and what else is known of those."""
    owner = np.array([row.owner for row in rows])
    pair = owner[:, None] * students + owner[None, :]
    order = np.argsort(-log_chance, axis=None, kind="stable")
    found = []
    for values in (log_chance, *others):
        best = np.zeros(students * students)
        # The last one written is the least chance.
        best[pair.ravel()[order]] = values.ravel()[order]
        found.append(best.reshape(students, students))
    return found


def _both(first: FloatArray, second: FloatArray) -> FloatArray:
    """Fisher's rule: log of the chance that two independent pieces of evidence are so rare together."""
    both = gammaincc(2.0, -(first + second))
    with np.errstate(divide="ignore"):
        return np.where(second < 0.0, np.maximum(np.log(both), -690.0), first)
