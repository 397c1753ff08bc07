"""Records of what was read, with confidences and reasons."""

import cmath
import math
from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from grader.reading import confidence
from grader.reading.confidence import Signs, sureness
from grader.reading.expected import Edge
from grader.reading.fitting import Fit
from grader.reading.hypotheses import REGULAR
from grader.reading.plans import Plan
from grader.reading.sketch import Sketch
from grader.records import Figure, FloatArray, ReadNode, ReadVector, Unread

LEAST_VECTOR_MM = 2.0
"""A shorter vector is known by its nodes, whether or not it has a stroke."""
MARKED_MM = 0.5
"""A tip within this of a node marks it."""
ELSEWHERE_MM = (0.8, 15.0)
"""A tip as far off as this may be the one that was meant."""


def figure_of_sketch(sketch: Sketch) -> Figure:
    """Joints of the mechanism."""
    places = confidence.of_places(sketch.fit)
    names = sketch.found.expected.names
    nodes = {name: _node(sketch.fit, index, float(places[index])) for index, name in enumerate(names)}
    return Figure(nodes, {})


def figure_of_plan(plan: Plan, scale_se: float) -> tuple[Figure, list[Unread]]:
    """Nodes and vectors of a plan; what is not drawn, with the reason.

    Arguments: `scale_se` is the sheet's relative standard error of lengths.
    """
    fit, names = plan.fit, plan.found.expected.names
    named = _named(plan, fit)
    placed = confidence.of_places(fit)
    absent = dict(plan.hypothesis.absent)
    nodes = {
        name: _node(fit, index, sureness(Signs(float(placed[index]), float(named[index]))))
        for index, name in enumerate(names)
        if name not in absent and np.isfinite(fit.at[index])
    }
    vectors, unread = _vectors(plan, fit, named, scale_se)
    unread.extend(Unread(name, reason) for name, reason in absent.items())
    for vector in plan.hypothesis.drawing.construction.vectors_of(figure_name(plan)):
        gone = next((absent[end] for end in (vector.head, vector.tail) if end in absent), None)
        if gone is not None and vector.name not in vectors:
            unread.append(Unread(vector.name, gone))
    return Figure(_no_surer(nodes, vectors, plan), vectors), unread


def _no_surer(
    nodes: Mapping[str, ReadNode], vectors: Mapping[str, ReadVector], plan: Plan
) -> dict[str, ReadNode]:
    """A node is no surer than the surest vector that starts or ends there: else its plan may be another."""
    best = dict.fromkeys(nodes, 0.0)
    for name, read in vectors.items():
        vector = plan.hypothesis.drawing.construction.vectors[name]
        for end in (vector.tail, vector.head):
            best[end] = max(best.get(end, 0.0), read.confidence)
    return {name: replace(node, confidence=min(node.confidence, best[name])) for name, node in nodes.items()}


def figure_name(plan: Plan) -> str:
    """Which plan it is."""
    return plan.hypothesis.drawing.construction.figure_of(plan.found.expected.names[0])


def _node(fit: Fit, index: int, sure: float) -> ReadNode:
    rows = slice(2 * index, 2 * index + 2)
    return ReadNode(complex(fit.at[index]), fit.cov[rows, rows], sure)


def _named(plan: Plan, fit: Fit) -> FloatArray:
    """How many of the explanations, by weight, have each node where it is read."""
    near = [other for other in plan.rivals if other.score > plan.score - confidence.FARTHEST]
    # Many hypotheses name the same strokes, and so have their nodes in the same places.
    places = {plan.strokes: fit.at}
    for other in near:
        if other.strokes not in places:
            places[other.strokes] = other.fit.at
    rivals = [
        confidence.Rival(
            dict(zip(other.found.expected.names, places[other.strokes], strict=True)), other.score
        )
        for other in near
    ]
    return confidence.of_names(plan.found.expected.names, fit.at, plan.score, rivals)


def _vectors(
    plan: Plan, fit: Fit, named: FloatArray, scale_se: float
) -> tuple[dict[str, ReadVector], list[Unread]]:
    vectors: dict[str, ReadVector] = {}
    unread: list[Unread] = []
    for index, edge in enumerate(plan.found.expected.edges):
        span = complex(fit.at[edge.head] - fit.at[edge.tail])
        row = int(plan.found.stroke[index])
        ends = f"{plan.found.expected.names[edge.tail]} and {plan.found.expected.names[edge.head]}"
        if row < 0 and abs(span) > LEAST_VECTOR_MM:
            unread.append(Unread(edge.name, f"no stroke between {ends} could be told apart"))
            continue
        cov = _difference_cov(fit, edge, span, scale_se)
        signs = Signs(
            placed=confidence.within(cov),
            named=float(min(named[edge.tail], named[edge.head])),
            off_mm=float(np.abs(fit.residual_mm[index]).max()) if row >= 0 else 0.0,
            thin=row >= 0 and bool(plan.lines.thin[row]),
            mistaken=plan.hypothesis.label not in REGULAR,
        )
        if row >= 0:
            marked, elsewhere = _marks(plan, fit, edge, row)
            signs = replace(signs, marked=marked, elsewhere=elsewhere)
        vectors[edge.name] = _vector(span, cov, sureness(signs))
    return vectors, unread


def _marks(plan: Plan, fit: Fit, edge: Edge, row: int) -> tuple[float, float]:
    """How clearly tips mark a vector's two ends on its stroke, and whether others might be meant."""
    marked, elsewhere = [], []
    along = complex(plan.lines.along[row])
    for node, other in ((edge.tail, edge.head), (edge.head, edge.tail)):
        forward = np.array([((fit.at[node] - fit.at[other]) * np.conj(along)).real > 0])
        tips, sure = plan.lines.tips_towards(np.array([row]), forward, head=node == edge.head)
        off = np.abs(tips[0] - ((fit.at[node] - plan.lines.start[row]) * np.conj(along)).real)
        near, far = off < MARKED_MM, (off >= ELSEWHERE_MM[0]) & (off < ELSEWHERE_MM[1])
        marked.append(float(sure[0, near].max(initial=0.0)))
        elsewhere.append(float(sure[0, far].max(initial=0.0)))
    return min(marked), max(elsewhere)


def _difference_cov(fit: Fit, edge: Edge, span: complex, scale_se: float) -> FloatArray:
    """Covariance (2, 2) of a vector, from both its nodes and the sheet's scale."""
    difference = np.zeros((2, fit.cov.shape[0]))
    for axis in (0, 1):
        difference[axis, 2 * edge.head + axis], difference[axis, 2 * edge.tail + axis] = 1.0, -1.0
    scaled = scale_se * np.array([span.real, span.imag])
    return np.asarray(difference @ fit.cov @ difference.T + np.outer(scaled, scaled))


def _vector(span: complex, cov: FloatArray, sure: float) -> ReadVector:
    """Length and direction with their standard errors."""
    length = float(abs(span))
    along = np.array([span.real, span.imag]) / max(length, 1e-9)
    across = np.array([-along[1], along[0]])
    se_along, se_across = (math.sqrt(max(float(axis @ cov @ axis), 0.0)) for axis in (along, across))
    se_deg = math.degrees(math.atan2(se_across, max(length, 1e-9)))
    direction = math.degrees(cmath.phase(span)) % 360.0 if length > se_across else None
    return ReadVector(length, se_along, direction, se_deg, sure)
