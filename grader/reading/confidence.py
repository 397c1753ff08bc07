"""How sure a name and a place are: from the fit, from the strokes there, from rival explanations."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.fitting import Fit
from grader.reading.matching import Explanation
from grader.records import FloatArray
from reference.geometry import ComplexArray

NEAR_MM = 0.5
"""A node is right within this of what was drawn."""
ELSEWHERE_MM = 0.5
TEMPERATURE = 3.0
"""Scores are this much too sure of themselves: strokes of one hand err alike."""
FARTHEST = 12.0
"""Nats: rivals worse by more weigh nothing."""
HIGHEST = 0.995
SHARED_STROKE = 0.8
SHARED_CLOSELY = 0.93


@dataclass(frozen=True, slots=True)
class Rival:
    """Another explanation: its nodes by name, its score."""

    at: Mapping[str, complex]
    score: float


def within(cov: FloatArray, radius_mm: float = NEAR_MM) -> float:
    """Probability that a Gaussian error of this covariance is shorter than the radius."""
    spread = np.sqrt(np.maximum(np.linalg.eigvalsh(cov), 1e-12))
    first, second = (math.erf(radius_mm / (s * math.sqrt(2.0))) for s in spread)
    return float(first * second)


def of_names(names: Sequence[str], at: ComplexArray, score: float, rivals: Sequence[Rival]) -> FloatArray:
    """Share of the explanations, by their scores, that have each node where it is read."""
    agree, total = np.ones(len(names)), np.ones(len(names))
    for rival in rivals:
        weight = math.exp(min(0.0, rival.score - score) / TEMPERATURE)
        for place, name in enumerate(names):
            if name not in rival.at or np.isnan(rival.at[name]):
                continue
            total[place] += weight
            agree[place] += weight * (abs(rival.at[name] - at[place]) < ELSEWHERE_MM)
    return np.asarray(agree / total)


def of_places(fit: Fit) -> FloatArray:
    """Probability for every node that it lies within half a millimetre of where it was drawn."""
    return np.array([
        within(fit.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]) for node in range(len(fit.at))
    ])


def lines_at(found: Explanation) -> list[int]:
    """How many strokes of their own meet at each node."""
    count = [0] * len(found.expected.names)
    for index, edge in enumerate(found.expected.edges):
        if found.stroke[index] >= 0 and not found.shared[index]:
            count[edge.tail] += 1
            count[edge.head] += 1
    return count
