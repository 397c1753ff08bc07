"""Sheets that look alike, more than independent hands come to. Never an accusation: look at both.

Well-drawn plans of one variant are alike anyway, and so are the values of all who work exactly. What
tells are the errors: two hands miss differently. Each kind of evidence gives the chance that two
students who work apart come so near; times the number of pairs it is the measure, how many such pairs
a class of this size would show by chance.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from math import exp, log

import numpy as np
from numpy.typing import NDArray

from grader.alike.drawings import LikeDrawings, like_drawings
from grader.alike.handed import Handed, handed_in
from grader.alike.numbers import LikeNumbers, like_numbers
from grader.alike.pictures import CELLS, LikePictures, ink_map, like_pictures
from grader.documents import AlikeDocument, Sign
from grader.records import FloatArray
from reference.assignment import Assignment

FALSE_ALARMS = 0.001
"""Pairs of independent students told by chance in a class, of each kind of evidence, on average."""
NOTED = log(0.05)
"""Chance below which a part of the evidence is named."""
MOST_OWNERS = 3
"""A number that more students have does not tell whose drawing it is."""

Maps = Sequence[Sequence[NDArray[np.uint8]]]

__all__ = ["CELLS", "FALSE_ALARMS", "Handed", "Maps", "find_alike", "handed_in", "ink_map"]


@dataclass(slots=True)
class _Pair:
    """What speaks for two students' sheets being alike."""

    why: list[Sign] = field(default_factory=list)
    measure: float | None = None
    share: float | None = None
    compared: int = 0

    def add(self, why: Sequence[Sign], measure: float | None, share: float | None, compared: int) -> None:
        """One more kind of evidence; the rarest coincidence is the one that is told."""
        self.why += [sign for sign in why if sign not in self.why]
        if measure is not None and (self.measure is None or measure < self.measure):
            self.measure, self.share, self.compared = measure, share, compared


def find_alike(assignment: Assignment, handed: Sequence[Handed], maps: Maps = ()) -> list[AlikeDocument]:
    """The sheets of a class that a person should hold beside each other, most alike first.

    Arguments: `maps` are each submission's ink maps (see `ink_map`), in the order of `handed`.
    """
    if len(handed) < 2:
        return []
    pairs: dict[tuple[int, int], _Pair] = {}
    drawings = like_drawings(assignment, handed)
    _add_drawings(pairs, drawings)
    _add_numbers(pairs, like_numbers(assignment, handed))
    owners = [k for k, of_one in enumerate(maps) for _ in of_one]
    printed = np.array([one.printed for one in handed])
    pictures = like_pictures(owners, [one for of_one in maps for one in of_one], printed)
    _add_pictures(pairs, pictures, drawings)
    _add_other_numbers(pairs, handed, drawings)
    told = [(i, j, pair) for (i, j), pair in pairs.items() if handed[i].student_id != handed[j].student_id]
    found = [_document(handed, members, told) for members in _groups([(i, j) for i, j, _ in told])]
    return sorted(found, key=lambda one: (one.measure is None, one.measure or 0.0, one.students))


def _rare(log_chance: FloatArray, pairs: int) -> Iterator[tuple[int, int, float]]:
    """The pairs whose evidence is rarer than chance in the class gives, and how many there would be."""
    expected = log_chance + log(max(pairs, 1))
    for i, j in np.argwhere(np.triu(expected < log(FALSE_ALARMS), 1)):
        yield int(i), int(j), exp(max(float(expected[i, j]), -600.0))


def _add_drawings(pairs: dict[tuple[int, int], _Pair], found: LikeDrawings) -> None:
    for i, j, measure in _rare(found.log_chance, found.pairs):
        why: list[Sign] = ["hand_errors"] if found.log_hands[i, j] < NOTED else []
        why += ["same_place"] if found.log_places[i, j] < NOTED else []
        share = float(np.clip(found.cosine[i, j], 0.0, 1.0))
        pairs.setdefault((i, j), _Pair()).add(why, measure, share, int(found.count[i, j]))


def _add_numbers(pairs: dict[tuple[int, int], _Pair], found: LikeNumbers) -> None:
    for i, j, measure in _rare(found.log_chance, found.pairs):
        compared = int(found.compared[i, j])
        share = min(float(found.equal[i, j]) / max(compared, 1), 1.0)
        pairs.setdefault((i, j), _Pair()).add(["same_numbers"], measure, share, compared)


def _add_pictures(pairs: dict[tuple[int, int], _Pair], found: LikePictures, drawings: LikeDrawings) -> None:
    # Good drawings whose figures follow one layout have the same ink: that is no rarer than their places.
    log_chance = np.fmax(found.log_chance, drawings.log_layout)
    for i, j, measure in _rare(log_chance, found.pairs):
        share = float(np.clip(found.overlap[i, j], 0.0, 1.0))
        pairs.setdefault((i, j), _Pair()).add(["same_picture"], measure, share, 0)


def _add_other_numbers(
    pairs: dict[tuple[int, int], _Pair], handed: Sequence[Handed], drawings: LikeDrawings
) -> None:
    """Whose number it is that somebody drew with."""
    for k, one in enumerate(handed):
        if one.fits is not None:
            owners = [other for other, its in enumerate(handed) if its.variant == one.fits[0]]
            owners = [other for other in owners if handed[other].student_id != one.student_id]
            if len(owners) <= MOST_OWNERS:
                for other in owners:
                    pairs.setdefault((min(k, other), max(k, other)), _Pair()).add(
                        ["other_number"], None, None, 0
                    )
    for (i, j), pair in pairs.items():
        fits = {k: drawings.fits[k] for k in (i, j)}
        crossed = [(fits[i], handed[j].variant), (fits[j], handed[i].variant)]
        if any(fit is not None and fit[0] == variant for fit, variant in crossed):
            pair.add(["other_number"], None, None, 0)


def _groups(pairs: Sequence[tuple[int, int]]) -> list[list[int]]:
    """Those who hang together by pairs."""
    group: dict[int, set[int]] = {}
    for i, j in pairs:
        joined = group.get(i, {i}) | group.get(j, {j})
        for one in joined:
            group[one] = joined
    return [sorted(members) for members in {id(one): one for one in group.values()}.values()]


def _document(
    handed: Sequence[Handed], members: Sequence[int], told: Sequence[tuple[int, int, _Pair]]
) -> AlikeDocument:
    """One entry for all who hang together, with the measure of the weakest link that has one."""
    of_these = [pair for i, j, pair in told if i in members and j in members]
    weakest = max(of_these, key=lambda pair: -1.0 if pair.measure is None else pair.measure)
    return AlikeDocument(
        students=[handed[k].student_id for k in members],
        positions=[handed[k].variant.position for k in members],
        why=list(dict.fromkeys(sign for pair in of_these for sign in pair.why)),
        measure=weakest.measure,
        share=weakest.share,
        compared=weakest.compared,
    )
