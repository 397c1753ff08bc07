"""The mechanism sketch: which strokes are its links, where its joints are, how it is turned."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.expected import Edge, Expected, Hand, Place, Search, Slack, expect, links_of, places
from grader.reading.lines import BoolArray, Lines
from grader.reading.matching import Ends, Explanation, explain_each
from grader.reading.nodes import LINK_ENDS as LINKS_END
from grader.reading.nodes import Fit, fit_nodes
from grader.records import FloatArray
from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.derive import construction_of
from reference.construction.elements import FixedLine
from reference.construction.graph import parameters_of
from reference.construction.mistakes import Drawing, commit, single_mistakes
from reference.construction.steps import ArcAndLine, OnGuide, Step, TwoLines
from reference.geometry import ComplexArray

LEAST_LINK_MM = 6.0
HARDLY = 0.4
SHORT_LIST = 8
COST_IN_SUPPORT = 0.05
WEIGHT_OF_CIRCLES = 0.25
ROUGHLY_MM = 4.0
SURE = 0.7
"""A sketch supported so well over its length ends the search among other students' variants."""
LINK_ENDS = Ends(at_mm=1.5, at_share=0.7, beyond_mm=4.0, beyond_share=0.15, short_mm=3.0, short_share=0.15)
"""Links stop at joint circles, short of the joint by the circle's radius."""
HAND = Hand(angle_rad=float(np.radians(0.6)), length_mm=0.8, shift_mm=0.5)
COST_OF_OTHER = 8.0
WORTH_OF_CIRCLE = 3.0
UPRIGHT_RAD = float(np.radians(2.0))
GUIDE_DOUBT_MM = 8.0
GUIDE_REACH_MM = 8.0
GUIDE_LEAST_MM = 12.0
GUIDE_TILT_RAD = float(np.radians(2.5))
LEAST_RADIUS_MM, LARGEST_RADIUS_MM = 0.4, 4.0
NEAR_CIRCLE_MM = 1.5
LEAST_SEEN_MM, REACH_MM = 4.0, 30.0
ANY_TURN = tuple(float(np.radians(angle)) for angle in range(0, 360, 5))


@dataclass(frozen=True, slots=True)
class Sketch:
    """A mechanism sketch as read.

    Attributes
    ----------
    drawing : the construction and parameters of the variant that the sketch follows
    found, fit : its strokes and its joints
    turn_rad : how the sketch as a whole is turned, by its joints
    guide_turn_rad : how its guides are turned, by the guides where they are drawn
    place : where it was laid
    score : nats for it: strokes, circles, less what is unlikely beforehand
    """

    drawing: Drawing
    found: Explanation
    fit: Fit
    turn_rad: float
    guide_turn_rad: float
    place: Place
    score: float


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


def find_sketch(
    lines: Lines,
    circles: FloatArray,
    own: list[Drawing],
    others: list[Drawing],
    told: Callable[[Mapping[str, complex]], float],
) -> Sketch | None:
    """The sketch that explains most strokes: the student's own variant first, then others.

    Arguments: `told` gives what letters say of joints by name, nats: it decides among near ties.
    """
    upright = Search(sizes=(1.0, 0.0), smallest=0.4, largest=2.0)
    long = lines.take(lines.length > LEAST_LINK_MM)
    laid = [one for drawing, cost in _candidates(own) for one in _laid(drawing, long, circles, upright, cost)]
    if _top(laid) < SURE:
        for drawing in others:
            laid.extend(_laid(drawing, long, circles, upright, COST_IN_SUPPORT))
    if _top(laid) < HARDLY and own:
        turned = Search(turns_rad=ANY_TURN, give_rad=float(np.radians(2.5)), sizes=(1.0,))
        laid.extend(_laid(own[0], long, circles, turned, COST_IN_SUPPORT))
    laid.sort(key=lambda one: -one[0])
    regular = {id(drawing.construction) for drawing in own}
    best = [
        _Case(drawing, place, id(drawing.construction) in regular) for _, drawing, place in laid[:SHORT_LIST]
    ]
    read = max(_read(best, lines, circles), key=lambda one: one.score + told(one.joints), default=None)
    return None if read is None else _sketch(read, lines)


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


def _laid(
    drawing: Drawing, lines: Lines, circles: FloatArray, search: Search, cost: float
) -> list[tuple[float, Drawing, Place]]:
    """Places with their support by strokes and by joint circles, less the cost."""
    expected = _expected(drawing)
    centres = circles[:, 0] - 1j * circles[:, 1]
    laid = []
    for place in places(expected, lines, search, count=4):
        joints = place.at + place.size * np.exp(1j * place.turn_rad) * expected.at
        off = np.abs(joints[:, None] - centres).min(axis=1) if len(centres) else np.full(len(joints), np.inf)
        circled = float(np.mean(off < ROUGHLY_MM))
        laid.append((place.score + WEIGHT_OF_CIRCLES * (circled - 1.0) - cost, drawing, place))
    return laid


@dataclass(frozen=True, slots=True)
class _Case:
    """A drawing laid at a place; whether it is one that is to be expected."""

    drawing: Drawing
    place: Place
    regular: bool


@dataclass(frozen=True, slots=True)
class _Read:
    """The best explanation of a case by `lines`, with the circles that stand for joints, and its score."""

    case: _Case
    found: Explanation
    lines: Lines
    centres: dict[int, complex]
    score: float

    @property
    def joints(self) -> dict[str, complex]:
        """Where the joints are to be expected, by name."""
        names, at = self.found.expected.names, self.found.expected.at
        return {name: self.centres.get(row, complex(at[row])) for row, name in enumerate(names)}


def _read(cases: Sequence[_Case], lines: Lines, circles: FloatArray) -> Iterator[_Read]:
    groups: dict[tuple[Edge, ...], list[tuple[_Case, Expected]]] = {}
    for case in cases:
        slack = Slack(shift_mm=2.0, turn_rad=float(np.radians(1.0)), relative=0.03)
        expected = _expected(case.drawing).placed(case.place.at, case.place.size, case.place.turn_rad, slack)
        groups.setdefault(expected.edges, []).append((case, expected))
    for group in groups.values():
        placed = [expected for _, expected in group]
        around = lines.take(_near(lines, placed) & (lines.length > LEAST_SEEN_MM))
        for (case, _), (found, *_) in zip(group, explain_each(placed, around, LINK_ENDS), strict=True):
            centres = _centres(found.expected.at, found.expected.cov, circles)
            cost = 0.0 if case.regular else COST_OF_OTHER
            yield _Read(case, found, around, centres, found.score + WORTH_OF_CIRCLE * len(centres) - cost)


def _near(lines: Lines, placed: Sequence[Expected]) -> BoolArray:
    """Which lines lie about any of the figures."""
    near = np.zeros(len(lines), dtype=bool)
    for one in placed:
        reach = np.ptp(one.at.real) + np.ptp(one.at.imag) + REACH_MM
        near |= np.abs(lines.middle - one.at.mean()) < reach
    return near


def _sketch(read: _Read, lines: Lines) -> Sketch:
    """The sketch with its joints fitted."""
    drawing, found = read.case.drawing, read.found
    fit = fit_nodes(found, read.lines, LINKS_END, read.centres)
    exact = _expected(drawing).at
    turn = float(np.angle(np.sum((fit.at - fit.at.mean()) * np.conj(exact - exact.mean()))))
    guide_turn = _guide_turn(drawing, found, fit, lines, turn)
    return Sketch(drawing, found, fit, turn, guide_turn, read.case.place, read.score)


def _guide_turn(drawing: Drawing, found: Explanation, fit: Fit, lines: Lines, turn: float) -> float:
    """The mean turn of strokes along the guides near their joints; upright where none is seen."""
    turns, weights = [0.0 if abs(turn) < UPRIGHT_RAD else turn], [GUIDE_DOUBT_MM]
    for node, step in zip(found.expected.names, drawing.construction.figures["mechanism"], strict=True):
        guide = _fixed_guide(step)
        if guide is None:
            continue
        joint = complex(fit.at[found.expected.names.index(node)])
        angle = float(np.ravel(drawing.parameters[f"angle {guide.guide}"])[0]) + turns[0]
        off = (lines.along * np.exp(-1j * angle)) ** 2
        tilt = np.angle(off) / 2.0
        from_joint = (joint - lines.start) * np.conj(lines.along)
        near = (np.abs(from_joint.imag) < GUIDE_REACH_MM) & (lines.length > GUIDE_LEAST_MM)
        near &= (from_joint.real > -GUIDE_REACH_MM) & (from_joint.real < lines.length + GUIDE_REACH_MM)
        for row in np.flatnonzero(near & (np.abs(tilt) < GUIDE_TILT_RAD)):
            turns.append(turns[0] + float(tilt[row]))
            weights.append(float(lines.length[row]))
    return float(np.average(turns, weights=weights))


def _fixed_guide(step: Step) -> FixedLine | None:
    """The guide on the ground along which a joint slides."""
    match step:
        case ArcAndLine(guide=FixedLine() as guide) | OnGuide(guide=guide):
            return guide
        case TwoLines(first=FixedLine() as guide) | TwoLines(second=FixedLine() as guide):
            return guide
    return None


def _centres(joints: ComplexArray, cov: FloatArray, circles: FloatArray) -> dict[int, complex]:
    """Circles that stand for joints: the nearest one to each, where it is near enough."""
    centres: dict[int, complex] = {}
    round_ones = circles[(circles[:, 2] > LEAST_RADIUS_MM) & (circles[:, 2] < LARGEST_RADIUS_MM)]
    at = round_ones[:, 0] - 1j * round_ones[:, 1]
    for node, joint in enumerate(joints):
        if not len(at):
            break
        nearest = int(np.argmin(np.abs(at - joint)))
        spread = float(np.sqrt(np.trace(cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2])))
        if abs(at[nearest] - joint) < NEAR_CIRCLE_MM + 2.0 * min(spread, 1.0):
            centres[node] = complex(at[nearest])
    return centres
