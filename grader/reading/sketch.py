"""The mechanism sketch: which strokes are its links, where its joints are, how it is turned."""

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.expected import Expected, Hand, Slack, expect, links_of
from grader.reading.fitting import Fit, fit_nodes
from grader.reading.lines import Lines
from grader.reading.matching import Ends, Explanation, explain
from grader.reading.placing import Place, Search, places
from reference.assignment import Assignment, Scales, Variant
from reference.derivation import construction_of, parameters_of
from reference.mistakes import Drawing, commit, single_mistakes

SURE = 0.8
"""A sketch supported so well over its length ends the search among other students' variants."""
LINK_ENDS = Ends(at_mm=1.5, at_share=0.7, beyond_mm=4.0, beyond_share=0.15, short_mm=3.0, short_share=0.15)
"""Links stop at joint circles, short of the joint by the circle's radius."""
HAND = Hand(angle_rad=float(np.radians(0.6)), length_mm=0.8, shift_mm=0.5)
ANY_TURN = tuple(float(np.radians(angle)) for angle in range(0, 360, 5))


@dataclass(frozen=True, slots=True)
class Sketch:
    """A mechanism sketch as read.

    Attributes
    ----------
    drawing : the construction and parameters of the variant that the sketch follows
    found, fit : its strokes and its joints
    turn_rad : how the sketch as a whole is turned
    place : where it was laid
    """

    drawing: Drawing
    found: Explanation
    fit: Fit
    turn_rad: float
    place: Place


def drawings(assignment: Assignment, variants: list[Variant], scales: Scales | None) -> list[Drawing]:
    """What the given variants are to draw, each with its own parameters of shape (1,)."""
    result = []
    for variant in variants:
        mechanism = assignment.mechanism([variant])
        own = scales or assignment.scales([variant])
        parameters = parameters_of(mechanism, own.kL, own.kv, own.ka)
        construction = construction_of(mechanism, plate_by_similarity=False)
        result.append(Drawing(construction, parameters))
    return result


def find_sketch(lines: Lines, own: list[Drawing], others: list[Drawing]) -> Sketch | None:
    """The sketch that explains most strokes: the student's own variant first, then others."""
    best: list[tuple[float, Drawing, Place]] = []
    upright = Search(sizes=(1.0, 0.0), smallest=0.4, largest=2.0)
    long = lines.take(lines.length > 6.0)  # noqa: PLR2004 - mm, links are longer
    for drawing, cost in _candidates(own):
        best.extend(_laid(drawing, long, upright, cost))
    if _top(best) < SURE:
        for drawing in others:
            best.extend(_laid(drawing, long, upright, 0.05))
    if _top(best) < 0.5 and own:  # noqa: PLR2004 - under half its length seen: not there
        turned = Search(turns_rad=ANY_TURN, give_rad=float(np.radians(2.5)), sizes=(1.0,))
        best.extend(_laid(own[0], long, turned, 0.05))
    best.sort(key=lambda one: -one[0])
    read = [_read(drawing, place, lines) for _, drawing, place in best[:5]]
    good = [sketch for sketch in read if sketch is not None]
    return max(good, key=lambda sketch: sketch.found.score, default=None)


def _top(best: list[tuple[float, Drawing, Place]]) -> float:
    return max((score for score, _, _ in best), default=0.0)


def _candidates(own: list[Drawing]) -> Iterator[tuple[Drawing, float]]:
    """Each drawing, and each with one group assembled the other way."""
    for drawing in own:
        yield drawing, 0.0
        for mistake in single_mistakes(drawing, "mechanism"):
            if mistake.code == "other_assembly":
                yield commit(mistake, drawing), 0.05


def _expected(drawing: Drawing) -> Expected:
    return expect(drawing, "mechanism", {}, HAND, links_of(drawing.construction))


def _laid(drawing: Drawing, lines: Lines, search: Search, cost: float) -> list[tuple[float, Drawing, Place]]:
    return [
        (place.score - cost, drawing, place) for place in places(_expected(drawing), lines, search, count=2)
    ]


def _read(drawing: Drawing, place: Place, lines: Lines) -> Sketch | None:
    slack = Slack(shift_mm=2.0, turn_rad=float(np.radians(1.0)), relative=0.03)
    expected = _expected(drawing).placed(place.at, place.size, place.turn_rad, slack)
    reach = 30.0
    near = (np.abs(lines.middle - expected.at.mean()) < np.ptp(expected.at.real) + np.ptp(expected.at.imag) + reach)
    around = lines.take(near & (lines.length > 4.0))  # noqa: PLR2004 - mm
    found = explain(expected, around, LINK_ENDS)[0]
    fit = fit_nodes(found, around, end_mm=1.5)
    exact = _expected(drawing).at
    turn = float(np.angle(np.sum((fit.at - fit.at.mean()) * np.conj(exact - exact.mean()))))
    return Sketch(drawing, found, fit, turn, place)


def without(lines: Lines, sketch: Sketch) -> Lines:
    """The strokes that are no link of the sketch."""
    del sketch
    return replace(lines)
