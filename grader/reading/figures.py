"""Records of what was read, with confidences and reasons."""

import math

import numpy as np

from grader.reading import confidence
from grader.reading.expected import Edge
from grader.reading.fitting import Fit
from grader.reading.plans import Plan
from grader.reading.sketch import Sketch
from grader.records import Figure, FloatArray, ReadNode, ReadVector, Unread

CLOSE_MM = 0.35
"""Two vectors on one stroke, both within this of it, could not be drawn any other way."""
LEAST_VECTOR_MM = 2.0
"""A shorter vector is known by its nodes, whether or not it has a stroke."""


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
    names = plan.found.expected.names
    fit = plan.fit
    sure = _node_confidence(plan, fit)
    absent = dict(plan.hypothesis.absent)
    nodes = {
        name: _node(fit, index, float(sure[index]))
        for index, name in enumerate(names)
        if name not in absent and np.isfinite(fit.at[index])
    }
    vectors, unread = _vectors(plan, fit, sure, scale_se)
    unread.extend(Unread(name, reason) for name, reason in absent.items())
    for vector in plan.hypothesis.drawing.construction.vectors_of(figure_name(plan)):
        gone = next((absent[end] for end in (vector.head, vector.tail) if end in absent), None)
        if gone is not None and vector.name not in vectors:
            unread.append(Unread(vector.name, gone))
    return Figure(nodes, vectors), unread


def figure_name(plan: Plan) -> str:
    """Which plan it is."""
    return plan.hypothesis.drawing.construction.figure_of(plan.found.expected.names[0])


def _node(fit: Fit, index: int, sure: float) -> ReadNode:
    return ReadNode(complex(fit.at[index]), fit.cov[2 * index : 2 * index + 2, 2 * index : 2 * index + 2], sure)


def _node_confidence(plan: Plan, fit: Fit) -> FloatArray:
    names = plan.found.expected.names
    rivals = [
        confidence.Rival(dict(zip(other.found.expected.names, other.fit.at, strict=True)), other.score)
        for other in plan.rivals
        if other.score > plan.score - confidence.FARTHEST
    ]
    named = confidence.of_names(names, fit.at, plan.score, rivals)
    placed = confidence.of_places(fit)
    support = min(1.0, max(0.0, (plan.place.score - 0.3) / 0.4))
    return np.asarray(np.minimum(named * placed * support, confidence.HIGHEST))


def _vectors(
    plan: Plan, fit: Fit, sure: FloatArray, scale_se: float
) -> tuple[dict[str, ReadVector], list[Unread]]:
    vectors: dict[str, ReadVector] = {}
    unread: list[Unread] = []
    for index, edge in enumerate(plan.found.expected.edges):
        span = complex(fit.at[edge.head] - fit.at[edge.tail])
        ends = f"{plan.found.expected.names[edge.tail]} and {plan.found.expected.names[edge.head]}"
        if plan.found.stroke[index] < 0 and abs(span) > LEAST_VECTOR_MM:
            unread.append(Unread(edge.name, f"no stroke between {ends} could be told apart"))
            continue
        sureness = float(min(sure[edge.tail], sure[edge.head]))
        if plan.found.shared[index]:
            off = float(np.abs(fit.residual_mm[index]).max())
            sureness = min(sureness, confidence.SHARED_CLOSELY if off < CLOSE_MM else confidence.SHARED_STROKE)
        vectors[edge.name] = _vector(fit, edge, span, sureness, scale_se)
    return vectors, unread


def _vector(fit: Fit, edge: Edge, span: complex, sureness: float, scale_se: float) -> ReadVector:
    """Length and direction node to node, errors from the joint covariance of the two."""
    difference = np.zeros((2, fit.cov.shape[0]))
    for axis in (0, 1):
        difference[axis, 2 * edge.head + axis], difference[axis, 2 * edge.tail + axis] = 1.0, -1.0
    cov = difference @ fit.cov @ difference.T
    length = abs(span)
    along = np.array([span.real, span.imag]) / max(length, 1e-9)
    across = np.array([-along[1], along[0]])
    se_along, se_across = (float(np.sqrt(max(axis @ cov @ axis, 0.0))) for axis in (along, across))
    se_along = float(np.hypot(se_along, scale_se * length))
    se_deg = float(np.degrees(np.arctan2(se_across, max(length, 1e-9))))
    direction = float(np.degrees(np.angle(span)) % 360.0) if length > se_across else None
    sureness *= math.erf(confidence.NEAR_MM / (math.sqrt(2.0) * max(scale_se * length, 1e-6)))
    return ReadVector(length, se_along, direction, se_deg, sureness)
