"""Name the nodes and vectors of a plan that was read, with their standard errors and confidences."""

import cmath
import math
from collections.abc import Iterator, Mapping
from dataclasses import asdict, dataclass, replace

import numpy as np

from grader.reading.arrowheads import is_double
from grader.reading.expected import REGULAR, Edge, xy
from grader.reading.lettering import COMPONENTS
from grader.reading.nodes import NodeFit
from grader.reading.plans import SPECK_MM, PlanReading
from grader.reading.sketch import SketchReading
from grader.records import (
    BESIDE_PX,
    Figure,
    FloatArray,
    InkMap,
    OtherReading,
    ReadNode,
    ReadVector,
    Reason,
    Sheet,
    Unread,
    Value,
)
from reference.geometry import ComplexArray, degrees
from reference.quantities import group_of

BLANK = 0.25
"""Share of a vector's length that other lines may ink if the vector itself is not drawn."""
INKED = 0.9
"""Share from which it is drawn, even if its stroke is another's too; it is read from its nodes."""
DASHED = 0.75
"""Share under which a sum of components is not drawn: 68 dashed ones had 0.83 and more, 36 of 38 not drawn
had less."""
ON_IT_PX = 1
"""Offset at which such a stroke's ink may begin: of vectors a degree apart only one may be drawn."""
LEAST_PLACED = 0.5
"""The prediction says nothing about the reading of a force that its strokes place less surely."""
PREDICTED = 0.7
"""Factor of a prediction's standard errors, which are those of a careless student, as of those of nodes."""
ASTRAY_MM = 2.0
"""Standard deviation of misread forces from where they were drawn, along x and along y: with 3 mm fewer wait,
but 5 instead of 3 of 225 certain ones were misread by more than 1 mm."""
LEAST_ODDS, MOST_ODDS = 0.45, 12.0
"""Bounds of the factor of the odds that a force is right."""
SAME_LINE_MM = 0.3
"""The sum of a part and a shorter one has that part's line."""
ONE_LINE_MM = 0.7
"""Two lines that are nearer to each other look like one."""
BEYOND_MM = (0.7, 4.0)
LEAST_OWN = 0.5
"""A stroke that covers less of a sum's length may be another line's piece."""
MOST_OPEN = 0.8
"""Most confidence in a line of two opposite forces with ink behind its end, of an arrowhead perhaps; and in a
tiny force or a sum without its own stroke: many are left out."""
CLOSE_MM = 5.0
"""Nodes of a lettered graph that are nearer to each other are told apart by letters alone."""
LEAST_VECTOR_MM = 2.0
"""A shorter vector is read from its nodes, with or without a stroke."""


def figure_of_sketch(sketch: SketchReading) -> Figure:
    """Return joints of the mechanism."""
    fit = sketch.fit
    names = sketch.assignment.expected.names
    nodes = {name: _node(fit, row, within(_node_cov(fit, row))) for row, name in enumerate(names)}
    return Figure(nodes, {})


def figure_of_plan(plan: PlanReading, sheet: Sheet, where: InkMap) -> tuple[Figure, list[Unread]]:
    """Return nodes and vectors of a plan; for those not drawn, the reason.

    Arguments: `where` is the sheet's ink.
    """
    fit, names = plan.fit, plan.assignment.expected.names
    explanations = _explanations(plan, fit)
    absent = dict(plan.hypothesis.absent)
    vectors, unread = _vectors(plan, fit, explanations, sheet, where)
    fit, at = in_usual_order(plan), explanations.at
    at = at if plan.usual is None else at @ plan.usual.T
    nodes = {
        name: _node(fit, row, Signs(within(_node_cov(fit, row)), named).confidence())
        for row, name in enumerate(names)
        if name not in absent and np.isfinite(fit.at[row])
        for _, named in explanations.of(at[:, row])[:1]
    }
    unread.extend(Unread(name, reason) for name, reason in absent.items())
    construction = plan.hypothesis.drawing.construction
    for vector in construction.vectors_of(construction.figure_of(names[0])):
        reason = absent.get(vector.head, absent.get(vector.tail))
        if reason is not None and vector.name not in vectors:
            unread.append(Unread(vector.name, reason, is_blank=vector.head in absent))
    edges = plan.assignment.expected.edges if plan.usual is not None else ()
    drawn = {edge.name: (complex(plan.fit.at[edge.tail]), complex(plan.fit.at[edge.head])) for edge in edges}
    return Figure(_no_surer(nodes, vectors, plan), vectors, drawn), unread


def in_usual_order(plan: PlanReading) -> NodeFit:
    """Return the nodes of a plan; of a force polygon where its vectors put them in the usual order."""
    fit, rows = plan.fit, plan.usual
    if rows is None:
        return fit
    both = np.kron(rows, np.eye(2))
    return replace(fit, at=rows @ fit.at, cov=both @ fit.cov @ both.T)


def _no_surer(
    nodes: Mapping[str, ReadNode], vectors: Mapping[str, ReadVector], plan: PlanReading
) -> dict[str, ReadNode]:
    """Limit the nodes' confidence to that of the surest vector that starts or ends there."""
    best = dict.fromkeys(nodes, 0.0)
    for name, read in vectors.items():
        vector = plan.hypothesis.drawing.construction.vectors[name]
        for end in (vector.tail, vector.head):
            best[end] = max(best.get(end, 0.0), read.confidence)
    return {name: replace(node, confidence=min(node.confidence, best[name])) for name, node in nodes.items()}


def _node_cov(fit: NodeFit, index: int) -> FloatArray:
    """Return (2, 2) covariance of one node."""
    rows = slice(2 * index, 2 * index + 2)
    return fit.cov[rows, rows]


def _node(fit: NodeFit, index: int, confidence: float) -> ReadNode:
    return ReadNode(complex(fit.at[index]), _node_cov(fit, index), confidence)


def _vectors(
    plan: PlanReading, fit: NodeFit, explanations: "_Explanations", sheet: Sheet, where: InkMap
) -> tuple[dict[str, ReadVector], list[Unread]]:
    expected = plan.assignment.expected
    vectors: dict[str, ReadVector] = {}
    unread: list[Unread] = []
    is_polygon = bool(group_of(plan.figure))
    lettered = fit.at[[not name.startswith(COMPONENTS) for name in expected.names]]
    for index, edge in enumerate(expected.edges):
        if plan.hypothesis.is_side(edge.name):
            continue
        span = complex(fit.at[edge.head] - fit.at[edge.tail])
        row = int(plan.assignment.stroke[index])
        covered_mm = plan.lines.length[row] if row >= 0 else 0.0
        may_lack = row < 0 or not (is_polygon or edge.optional)
        is_sought = may_lack and covered_mm < DASHED * abs(span) and abs(span) > LEAST_VECTOR_MM
        gap = _gap(plan, edge, where, INKED if row < 0 else DASHED) if is_sought else None
        if gap is not None:
            unread.append(gap)
            continue
        cov = _difference_cov(fit.cov, edge) + sheet.cov_of(span)
        spans = explanations.at[:, edge.head] - explanations.at[:, edge.tail]
        of_two = is_polygon and is_double(plan, edge)
        near_mm = EITHER_MM if of_two else ALIKE_MM if is_polygon else NEAR_MM
        (_, named), *others = explanations.of(spans, near_mm)
        # A long vector is never more certain than the sheet's scale.
        most = math.erf(NEAR_MM / max(math.sqrt(2.0) * sheet.scale_se * abs(span), 1e-9))
        if np.sum(np.abs(lettered - fit.at[[[edge.tail], [edge.head]]]) < CLOSE_MM) > 2:
            named = min(named, plan.told)
        signs = Signs(within(cov), named, off_mm=0.0)
        if row >= 0:
            off_mm = float(np.abs(fit.residual_mm[index]).max())
            least = UNMARKED if abs(span) > SHORT_MM and not is_polygon else 0.0
            marked = max(_marked(plan, fit, edge, row), least)
            signs = replace(signs, off_mm=off_mm, marked=marked)
        sure = signs.confidence()
        if is_polygon:
            sure = _weighed(sure, plan, edge, span, cov, sheet)
            # What a mistake that was sought predicts is no evidence against the other explanations.
            sure = sure if plan.hypothesis.label in REGULAR else min(sure, named)
            sure = min(sure, MOST_OPEN) if _may_be_left_out(plan, fit, index, where) else sure
        elif row < 0 and abs(span) > LEAST_VECTOR_MM and _may_lie_under(plan, fit, edge):
            sure = min(sure, MOST_OPEN)
        read = ReadVector.of(span, cov, min(sure, most, HIGHEST))
        rivals = (
            OtherReading(abs(other), degrees(cmath.phase(other)), min(most, likely))
            for other, likely in ((one, replace(signs, named=share).confidence()) for one, share in others)
        )
        vectors[edge.name] = replace(read, others=tuple(rivals))
    return vectors, unread


def _may_be_left_out(plan: PlanReading, fit: NodeFit, index: int, where: InkMap) -> bool:
    """Return whether a force may be left out or end elsewhere, as a tiny one, or one in another's line."""
    edge, row = plan.assignment.expected.edges[index], int(plan.assignment.stroke[index])
    span, predicted_mm = complex(fit.at[edge.head] - fit.at[edge.tail]), abs(_predicted(plan, edge))
    of_two = is_double(plan, edge)
    # One that is known to be left out is nothing, and no tiny force that may be there.
    is_known = plan.hypothesis.label not in REGULAR and predicted_mm < SPECK_MM
    if (min(abs(span), predicted_mm) < LEAST_VECTOR_MM and not is_known) or (
        row >= 0 and _may_pass_a_tiny_side(plan, fit, edge, row)
    ):
        return True
    return _goes_on(where, complex(fit.at[edge.tail]), span) if of_two else _is_inferred(plan, index)


def _gap(plan: PlanReading, edge: Edge, where: InkMap, least: float) -> Unread | None:
    """Return why a vector cannot be read that lacks ink, or a stroke of its own; None if there is ink.

    Arguments: `least`, the share of it that must have ink.
    """
    # The corners of a force polygon have no letters.
    code, names = ("not_found", "not_found"), plan.assignment.expected.names
    between: dict[str, Value] = {"name": edge.name}
    if not group_of(plan.figure):
        code, between = ("blank", "no_stroke"), {"start": names[edge.tail], "end": names[edge.head]}
    at = complex(plan.fit.at[edge.tail]), complex(plan.fit.at[edge.head])
    on_it = where.share_inked(*at, ON_IT_PX)
    # Where similarity alone places an end, the vector may pass that far beside.
    se_mm = math.sqrt(max(np.diag(plan.fit.cov)[[2 * edge.head, 2 * edge.head + 1]]))
    beside_px = max(BESIDE_PX, round(2.0 * se_mm * where.px_per_mm))
    if on_it < DASHED if edge.optional else where.share_inked(*at, beside_px) <= BLANK:
        return Unread(edge.name, Reason(code[0], between), is_blank=True)
    if not edge.optional and on_it < least:
        return Unread(edge.name, Reason(code[1], between))
    return None


def _may_lie_under(plan: PlanReading, fit: NodeFit, edge: Edge) -> bool:
    """Return whether a vector without a stroke lies on another's line, drawn or not."""
    rows = plan.assignment.stroke[plan.assignment.stroke >= 0]
    from_start = fit.at[[edge.tail, edge.head], None] - plan.lines.start[rows]
    across = np.abs((from_start * np.conj(plan.lines.along[rows])).imag).max(axis=0)
    return bool((across < ONE_LINE_MM).any())


def _is_inferred(plan: PlanReading, index: int) -> bool:
    """Return whether a force may be left out on the sheet: no stroke is surely its own.

    A side has none if another runs back on the same one, as on a letter. A sum has one of its own, unless
    another sum beside it has none, or that of a side, if the other part is next to nothing: of two parts
    across links nothing shows beside which side the smaller one is.
    """
    edges, stroke = plan.assignment.expected.edges, plan.assignment.stroke
    ends = plan.fit.at[[(one.tail, one.head) for one in edges]]
    along, against = (np.abs(ends - way).max(axis=1) for way in (ends[index], ends[index, ::-1]))
    is_sum = np.array([one.optional for one in edges])
    has_stroke, has_own = stroke >= 0, (stroke >= 0) & ~plan.assignment.shared
    if not is_sum[index]:
        return bool((~is_sum & has_stroke & (stroke == stroke[index]) & (against < LEAST_VECTOR_MM)).any())
    is_own = has_own[index] and plan.lines.length[stroke[index]] > LEAST_OWN * abs(np.diff(ends[index])[0])
    if is_own:
        return bool((is_sum & ~has_own & (np.minimum(along, against) < LEAST_VECTOR_MM)).any())
    vectors = plan.hypothesis.drawing.construction.vectors
    parts = sum(vectors[one.name].part == "t" for one in edges)
    return parts > 1 or not (~is_sum & has_stroke & (along < SAME_LINE_MM)).any()


def _may_pass_a_tiny_side(plan: PlanReading, fit: NodeFit, edge: Edge, row: int) -> bool:
    """Return whether a force ends where a tiny one, which may stand at any corner, would put its end."""
    spans = np.array([_predicted(plan, one) for one in plan.placed.edges if not one.optional])
    along = np.abs((spans[np.abs(spans) < LEAST_VECTOR_MM] * np.conj(plan.lines.along[row])).real)
    aside = along[along > MARKED_MM, None]
    ends = [apart[sure > 0.0] for apart, sure in _tips(plan, fit, edge, row)]
    return any((apart > MARKED_MM).all() and (np.abs(apart - aside) < MARKED_MM).any() for apart in ends)


def _predicted(plan: PlanReading, edge: Edge) -> complex:
    """Return a vector as it follows from the data and from the figures read before."""
    return complex(plan.expected.at[edge.head] - plan.expected.at[edge.tail]) * plan.pose.size


def _weighed(
    sure: float, plan: PlanReading, edge: Edge, span: complex, cov: FloatArray, sheet: Sheet
) -> float:
    """Return the confidence in a force, by how far it lies from its prediction for what that is good for.

    Data give it, or another figure where it was drawn as well: a misread would seldom come as near. If the
    strokes hardly place it, it lies there because it was looked for there.
    """
    off = xy(np.array([span - _predicted(plan, edge)]))
    near = cov + (PREDICTED * plan.pose.size) ** 2 * _difference_cov(plan.expected.cov, edge)
    anywhere = near + ASTRAY_MM**2 * np.eye(2)
    nearer = np.linalg.inv(near) - np.linalg.inv(anywhere)
    odds = math.sqrt(np.linalg.det(anywhere) / np.linalg.det(near)) * math.exp(-0.5 * off @ nearer @ off)
    seen = _difference_cov((plan.seen or plan.fit).cov, edge) + sheet.cov_of(span)
    odds = max(LEAST_ODDS, min(odds, MOST_ODDS if within(seen) >= LEAST_PLACED else 1.0))
    return sure * odds / (sure * odds + 1.0 - sure)


def _goes_on(where: InkMap, tail: complex, span: complex) -> bool:
    """Return whether there is ink in line with a vector behind one of its ends."""
    out = span / max(abs(span), LEAST_VECTOR_MM)
    ends = ((tail - near * out, tail + span + near * out) for near in BEYOND_MM)
    return any(where.share_inked(*piece) > BLANK for piece in zip(*ends, strict=True))


def _difference_cov(cov: FloatArray, edge: Edge) -> FloatArray:
    """Return the covariance (2, 2) of a vector from that of all nodes."""
    difference = np.zeros((2, cov.shape[0]))
    for axis in (0, 1):
        difference[axis, 2 * edge.head + axis], difference[axis, 2 * edge.tail + axis] = 1.0, -1.0
    return np.asarray(difference @ cov @ difference.T)


# Confidence ----------------------------------------------------------------------------------------

MARKED_MM, UNMARKED, SHORT_MM = 0.5, 0.15, 5.0
"""A tip within the first marks a node; vectors longer than the last count as marked so well without tips."""
NEAR_MM = 0.5
"""Largest error of a right node: a pencil stroke's width."""
ALIKE_MM = 1.0
"""Explanations of a force polygon that differ less give the same force, though orders or tiny ones differ."""
EITHER_MM = 1.5
"""The same of two lines side by side, for opposite forces: either is the vector as drawn."""
RIVAL_NATS = 12.0
"""Rivals with a score lower by more are left out."""
MOST_OTHERS = 3
"""Most alternatives of one vector that are reported: the rest has a share of a few hundredths."""
TEMPERATURE = 3.0
"""Scores are divided by this: errors of one student's strokes are not independent."""
WEIGHTS = {"placed": 0.2, "named": 0.5, "off_mm": -2.2, "marked": 2.4}
CONSTANT = -1.85
"""Coefficients of a logistic regression on 1,800 vectors of eleven kinds of sheets, each kind judged by the
other ten, the constant lowered by 0.6, since a wrong mark costs more than a check. A line's thinness, a
mistaken plan, further tips, and how surely the ink has a node at both ends add nothing to them."""
PLACED_AND = 0.3
"""Largest excess of a confidence over the geometric probability, whose standard errors are wide."""
HIGHEST = 0.985
"""Highest confidence: of those predicted higher, 98 of 100 were right."""
WORST_MM = 1.5
"""Larger residuals lower the confidence no further."""


@dataclass(frozen=True, slots=True)
class Signs:
    """The features from which the confidence in a vector (or node) is computed.

    Attributes
    ----------
    placed : geometric probability of lying within half a millimetre, from the fit's covariance
    named : share of the explanations that have it there
    off_mm : largest distance of its nodes from its stroke
    marked : probability of the less likely of the tips that mark the vector's two ends on its stroke
    """

    placed: float
    named: float
    off_mm: float = 0.1
    marked: float = 0.4

    def confidence(self) -> float:
        """Return the probability that the name is right and the vector read within half a millimetre."""
        inputs = asdict(self) | {
            "placed": _log_odds(self.placed),
            "named": _log_odds(self.named),
            "off_mm": min(self.off_mm, WORST_MM),
        }
        score = CONSTANT + sum(weight * inputs[name] for name, weight in WEIGHTS.items())
        return min(1.0 / (1.0 + math.exp(-score)), self.placed + PLACED_AND, HIGHEST)


def _log_odds(probability: float) -> float:
    return math.log((probability + 0.002) / (1.002 - probability))


def within(cov: FloatArray, radius_mm: float = NEAR_MM) -> float:
    """Return the probability that a Gaussian error of this covariance (2, 2) is shorter than the radius."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 1e-12))
    first, second = (math.erf(radius_mm / (s * math.sqrt(2.0))) for s in spread)
    return float(first * second)


@dataclass(frozen=True, slots=True)
class _Explanations:
    """A plan and its rivals: weights by their scores (k,), the plan's own 1 first, and nodes (k, n), mm.

    A node that an explanation lacks is nan.
    """

    weight: FloatArray
    at: ComplexArray
    named: float

    def of(self, values: ComplexArray, near_mm: float = NEAR_MM) -> list[tuple[complex, float]]:
        """Return the alternatives for a value (k,): the plan's own, then others, likeliest first.

        Each has the probability of it and those before it, among all explanations, including those that lack
        it; values within `near_mm` are one.
        """
        left = np.isfinite(values)
        total, together = self.weight.sum(), 0.0
        found: list[tuple[complex, float]] = []
        while left.any() and len(found) <= MOST_OTHERS:
            near = left & (np.abs(values - values[:, None]) < near_mm)
            share = near @ self.weight / total
            row = int(np.argmax(np.where(left, share, 0.0))) if found else 0
            together += float(share[row])
            found.append((complex(values[row]), self.named * min(together, 1.0)))
            left = left & ~near[row]
        return found


def _explanations(plan: PlanReading, fit: NodeFit) -> _Explanations:
    names = plan.assignment.expected.names
    # Many hypotheses name the same strokes, and so have their nodes in the same places.
    nodes_by_strokes = {plan.strokes: fit.at}
    weight, places = [1.0], [fit.at]
    # In the order of this plan's sides, whatever that of its rivals.
    own = None if plan.usual is None else np.linalg.inv(plan.usual)
    for rival in (one for one in plan.rivals if one.score > plan.score - RIVAL_NATS):
        if rival.strokes not in nodes_by_strokes:
            there = in_usual_order(rival).at
            nodes_by_strokes[rival.strokes] = there if own is None else own @ there
        at = dict(zip(rival.assignment.expected.names, nodes_by_strokes[rival.strokes], strict=True))
        weight.append(math.exp(min(0.0, rival.score - plan.score) / TEMPERATURE))
        places.append(np.array([at.get(name, np.nan) for name in names]))
    return _Explanations(np.array(weight), np.array(places), plan.named)


def _marked(plan: PlanReading, fit: NodeFit, edge: Edge, row: int) -> float:
    """Return how clearly tips mark a vector's two ends on its stroke."""
    ends = _tips(plan, fit, edge, row)
    return min(float(sure[apart < MARKED_MM].max(initial=0.0)) for apart, sure in ends)


def _tips(plan: PlanReading, fit: NodeFit, edge: Edge, row: int) -> Iterator[tuple[FloatArray, FloatArray]]:
    """Yield how far a stroke's tips (k,) are from the tail, and the head, mm, and how sure they are."""
    along = complex(plan.lines.along[row])
    for node, other in ((edge.tail, edge.head), (edge.head, edge.tail)):
        forward = np.array([((fit.at[node] - fit.at[other]) * np.conj(along)).real > 0])
        tips, sure = plan.lines.tips_towards(np.array([row]), forward)
        yield np.abs(tips[0] - ((fit.at[node] - plan.lines.start[row]) * np.conj(along)).real), sure[0]
