"""Read the mechanism sketch: the strokes of its links, its joints, and its turn."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from grader.reading.expected import (
    STEP_OF_DERIVATIVE,
    DraftingErrors,
    Expected,
    Pose,
    Search,
    Slack,
    expect,
    links_of,
    poses,
)
from grader.reading.lines import BoolArray, Lines
from grader.reading.matching import EndPrior, StrokeAssignment, assign_groups
from grader.reading.nodes import LINK_ENDS, NodeFit, fit_nodes
from grader.records import MECHANISM, FloatArray, IntArray
from reference.authored.assignment import Assignment, Scales, Variant
from reference.construction.derive import construction_of
from reference.construction.elements import FixedLine
from reference.construction.graph import Construction, evaluate, parameters_of
from reference.construction.mistakes import Drawing, commit, single_mistakes
from reference.construction.steps import ArcAndLine, OnGuide, Step, TwoLines
from reference.plan import exact_plan

LEAST_LINK_MM = 6.0
"""A sketch is not placed on shorter strokes: they are letters and hatching."""
SURE = 0.7
"""A sketch supported over less of its length may be another student's, or turned on the sheet."""
SHORT_LIST = 8
"""Number of best supported sketches whose strokes are assigned."""
COST_IN_SUPPORT = 0.05
"""Cost of another assembly, another student's variant, a turn: one more edge must be supported."""
WEIGHT_OF_CIRCLES = 0.25
ROUGHLY_MM = 4.0
"""Share of the support that depends on joint circles, and the largest distance of a joint's own circle."""
END_PRIOR = EndPrior(
    at_mm=1.5, at_share=0.7, beyond_mm=4.0, beyond_share=0.15, short_mm=3.0, short_share=0.15
)
"""Links stop at joint circles, short of the joint by the circle's radius."""
DRAFTING_ERRORS = DraftingErrors(angle_rad=float(np.radians(0.6)), length_mm=0.8, shift_mm=0.5)
"""A sketch is drawn from lengths, a plan from directions."""
COST_OF_OTHER = 8.0
"""Nats for a construction that is not the student's: as for a mistake in a plan."""
WORTH_OF_CIRCLE = 3.0
"""Nats for a circle at an expected joint."""
UPRIGHT_RAD = float(np.radians(2.0))
"""A sketch turned by less is meant to be upright."""
GUIDE_DOUBT_MM = 8.0
"""Weight of the sketch's own turn relative to strokes along guides, as a length of stroke."""
GUIDE_REACH_MM, GUIDE_LEAST_MM = 8.0, 12.0
"""A stroke along a guide passes its joint within this, and is no shorter than this."""
GUIDE_TILT_RAD = float(np.radians(2.5))
"""Strokes that are turned further are no guides."""
LEAST_RADIUS_MM, LARGEST_RADIUS_MM = 0.4, 4.0
"""Radii of joint circles: smaller ones are dots of letters, larger ones wheels."""
NEAR_CIRCLE_MM = 1.5
"""Largest distance of a joint's circle from its position by the links, besides two standard errors."""
LEAST_VISIBLE_MM, REACH_MM = 4.0, 30.0
"""Lines that may be links: their least length, and how far they may lie outside the sketch."""
ANY_TURN = tuple(float(np.radians(angle)) for angle in range(0, 360, 5))
"""Turns at a spacing of twice the freedom about each, so that none is left out."""


@dataclass(frozen=True, slots=True)
class SketchReading:
    """A mechanism sketch as read.

    Attributes
    ----------
    drawing : the construction and parameters of the variant that the sketch follows
    assignment, fit : its strokes and its joints
    members : the strokes of its links, by their number
    guide_turn_rad : turn of its guides, by the guides if they are drawn
    score : nats for it: strokes and circles, less the prior cost
    """

    drawing: Drawing
    assignment: StrokeAssignment
    fit: NodeFit
    members: IntArray
    guide_turn_rad: float
    score: float


def drawings(assignment: Assignment, variants: list[Variant], scales: Scales | None) -> list[Drawing]:
    """Return the right drawings of the given variants, each with its own parameters of shape (1,)."""
    if assignment.forces is not None:
        return [exact_plan(assignment, [variant], scales).drawing for variant in variants]
    result = []
    for variant in variants:
        mechanism = assignment.mechanism([variant])
        used = scales or assignment.scales([variant])
        construction = construction_of(mechanism, plate_by_similarity=False)
        result.append(Drawing(construction, parameters_of(mechanism, used.kL, used.kv, used.ka)))
    return result


def find_sketch(
    lines: Lines,
    circles: FloatArray,
    own: list[Drawing],
    others: Callable[[], list[Drawing]],
    letters_nats: Callable[[Mapping[str, complex]], float],
) -> SketchReading | None:
    """Return the sketch that explains most strokes: the student's own variant first, then others.

    Arguments: `circles` (k, 3) as in `records.Ink`; `letters_nats` returns how well letters fit joints by
    name: it decides between nearly equal sketches.
    """
    upright = Search(sizes=(1.0, 0.0), smallest=0.4, largest=2.0)
    sheet = _SketchSearch(lines, lines.take(lines.length > LEAST_LINK_MM), circles)
    cases = [case for drawing, cost in _candidates(own) for case in sheet.laid(drawing, upright, cost)]
    if _best_support(cases) < SURE:
        for drawing in others():
            cases.extend(sheet.laid(drawing, upright, COST_IN_SUPPORT))
    if _best_support(cases) < SURE and own:
        turned = Search(turns_rad=ANY_TURN, give_rad=float(np.radians(2.5)), sizes=(1.0,))
        cases.extend(sheet.laid(own[0], turned, COST_IN_SUPPORT))
    cases.sort(key=lambda case: -case.support)
    assigned = sheet.assigned(cases[:SHORT_LIST], [drawing.construction for drawing in own])
    best = max(assigned, key=lambda sketch: sketch.score + letters_nats(sketch.joints), default=None)
    return None if best is None else _fitted(best, lines)


def _candidates(own: list[Drawing]) -> Iterator[tuple[Drawing, float]]:
    """Yield each drawing, and each with one group assembled the other way; with the cost in support."""
    for drawing in own:
        yield drawing, 0.0
        for mistake in single_mistakes(drawing, MECHANISM):
            if mistake.code == "other_assembly":
                yield commit(mistake, drawing), COST_IN_SUPPORT


def _expected(drawing: Drawing) -> Expected:
    return expect(drawing, MECHANISM, {}, DRAFTING_ERRORS, links_of(drawing.construction))


@dataclass(frozen=True, slots=True)
class _SketchCase:
    """A drawing placed at a pose; its support by strokes and by joint circles, less its cost."""

    drawing: Drawing
    pose: Pose
    support: float


def _best_support(cases: Sequence[_SketchCase]) -> float:
    return max((case.support for case in cases), default=0.0)


@dataclass(frozen=True, slots=True)
class _Assigned:
    """A drawing's best assignment to `lines`, the circles that stand for joints, and the score in nats."""

    drawing: Drawing
    assignment: StrokeAssignment
    lines: Lines
    centres: dict[int, complex]
    score: float

    @property
    def joints(self) -> dict[str, complex]:
        """Expected positions of the joints, by name."""
        expected = self.assignment.expected
        return {
            name: self.centres.get(row, complex(expected.at[row])) for row, name in enumerate(expected.names)
        }


@dataclass(frozen=True, slots=True)
class _SketchSearch:
    """The lines and circles in which a sketch is searched: all lines, the long ones, circles (k, 3)."""

    lines: Lines
    long: Lines
    circles: FloatArray

    def laid(self, drawing: Drawing, search: Search, cost: float) -> list[_SketchCase]:
        """Return the poses of a drawing."""
        expected = _expected(drawing)
        centres = self.circles[:, 0] - 1j * self.circles[:, 1]
        cases = []
        for pose in poses(expected, self.long, search, count=4):
            joints = pose.at + pose.size * np.exp(1j * pose.turn_rad) * expected.at
            nearest = np.abs(joints[:, None] - centres).min(axis=1, initial=np.inf)
            circled = float(np.mean(nearest < ROUGHLY_MM))
            cases.append(_SketchCase(drawing, pose, pose.score + WEIGHT_OF_CIRCLES * (circled - 1.0) - cost))
        return cases

    def assigned(self, cases: Sequence[_SketchCase], usual: Sequence[Construction]) -> Iterator[_Assigned]:
        """Yield each case with its strokes; unusual constructions cost more."""
        slack = Slack(relative=0.03)
        placed = [_expected(case.drawing).placed(case.pose, slack) for case in cases]
        for index, (best, *_), around in assign_groups(placed, self.lines, _near, END_PRIOR):
            drawing = cases[index].drawing
            centres = self.centres(best.expected)
            cost = 0.0 if drawing.construction in usual else COST_OF_OTHER
            score = best.score + WORTH_OF_CIRCLE * len(centres) - cost
            yield _Assigned(drawing, best, around, centres, score)

    def centres(self, joints: Expected) -> dict[int, complex]:
        """Return circles that stand for joints, by the joint's index: the nearest one, if near enough."""
        radius = self.circles[:, 2]
        circles = self.circles[(radius > LEAST_RADIUS_MM) & (radius < LARGEST_RADIUS_MM)]
        at = circles[:, 0] - 1j * circles[:, 1]
        centres: dict[int, complex] = {}
        for node, joint in enumerate(joints.at if len(at) else ()):
            nearest = int(np.argmin(np.abs(at - joint)))
            spread = float(np.sqrt(np.trace(joints.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2])))
            if abs(at[nearest] - joint) < NEAR_CIRCLE_MM + 2.0 * min(spread, 1.0):
                centres[node] = complex(at[nearest])
        return centres


def _near(lines: Lines, placed: Sequence[Expected]) -> BoolArray:
    """Return which lines are long enough for a link and lie near any of the figures."""
    near = np.zeros(len(lines), dtype=bool)
    for figure in placed:
        reach = np.ptp(figure.at.real) + np.ptp(figure.at.imag) + REACH_MM
        near |= np.abs(lines.middle - figure.at.mean()) < reach
    return near & (lines.length > LEAST_VISIBLE_MM)


def _fitted(sketch: _Assigned, lines: Lines) -> SketchReading:
    """Return the sketch with its joints fitted."""
    fit = fit_nodes(sketch.assignment, sketch.lines, LINK_ENDS, sketch.centres)
    fit = _with_dots(fit, sketch.drawing, sketch.assignment.expected.names)
    guide_turn = _guide_turn(sketch.drawing, fit, lines)
    stroke = sketch.assignment.stroke
    members = np.unique(sketch.lines.members[stroke[stroke >= 0]])
    return SketchReading(sketch.drawing, sketch.assignment, fit, members, guide_turn, sketch.score)


def _with_dots(fit: NodeFit, drawing: Drawing, names: Sequence[str]) -> NodeFit:
    """Return the fit with the centres of mass, which no stroke shows, placed by the joints."""
    dots, count = drawing.construction.dots, len(names)
    if not dots:
        return fit
    shifted = fit.at[:, None] + STEP_OF_DERIVATIVE * np.kron(np.eye(count, count), [1.0, 1j])
    each = dict(zip(names, np.column_stack([fit.at, shifted]), strict=True))
    joints = {name: at for name, at in each.items() if name not in dots}
    placed = {**joints, **evaluate(drawing.construction, drawing.parameters, given=joints, wanted=dots)}
    at = np.stack([np.broadcast_to(placed[name], 2 * count + 1) for name in names])
    if not np.isfinite(at).all():
        return fit
    moves = (at[:, 1:] - at[:, :1]) / STEP_OF_DERIVATIVE
    slopes = np.stack([moves.real, moves.imag], axis=1).reshape(2 * count, -1)
    laid_mm = np.repeat([DRAFTING_ERRORS.length_mm * (name in dots) for name in names], 2)
    return replace(fit, at=at[:, 0], cov=slopes @ fit.cov @ slopes.T + np.diag(laid_mm**2))


def _guide_turn(drawing: Drawing, fit: NodeFit, lines: Lines) -> float:
    """Return the mean turn (rad) of strokes along the guides near their joints.

    If no such stroke is visible: the turn of all joints together, or none if that is small.
    """
    exact = _expected(drawing).at
    turn = float(np.angle(np.sum((fit.at - fit.at.mean()) * np.conj(exact - exact.mean()))))
    usual = 0.0 if abs(turn) < UPRIGHT_RAD else turn
    turns, weights = [usual], [GUIDE_DOUBT_MM]
    for joint, step in zip(fit.at.tolist(), drawing.construction.figures[MECHANISM], strict=True):
        guide = _fixed_guide(step)
        if guide is None:
            continue
        angle = float(np.ravel(drawing.parameters[f"angle {guide.guide}"])[0]) + usual
        tilt = np.angle((lines.along * np.exp(-1j * angle)) ** 2) / 2.0
        from_start = (joint - lines.start) * np.conj(lines.along)
        near = (np.abs(from_start.imag) < GUIDE_REACH_MM) & (lines.length > GUIDE_LEAST_MM)
        near &= (from_start.real > -GUIDE_REACH_MM) & (from_start.real < lines.length + GUIDE_REACH_MM)
        rows = np.flatnonzero(near & (np.abs(tilt) < GUIDE_TILT_RAD))
        turns.extend(usual + tilt[rows])
        weights.extend(lines.length[rows])
    return float(np.average(turns, weights=weights))


def _fixed_guide(step: Step) -> FixedLine | None:
    """Return the guide on the ground along which a joint slides."""
    match step:
        case ArcAndLine(guide=FixedLine() as guide) | OnGuide(guide=guide):
            return guide
        case TwoLines(first=FixedLine() as guide) | TwoLines(second=FixedLine() as guide):
            return guide
    return None
