"""How sure a name and a place are: from the fit, from the strokes there, from rival explanations."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.reading.fitting import Fit
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
WEIGHTS = {
    "placed": 0.34,
    "named": 0.34,
    "off_mm": -1.73,
    "mistaken": -0.23,
    "thin": -0.4,
    "marked": 1.47,
    "elsewhere": -1.86,
}
CONSTANT = -0.8
"""Of a logistic regression on sheets drawn by two simulations, the constant lowered by 0.1."""
PLACED_AND = 0.1
"""No surer than the geometric probability by more than this."""


@dataclass(frozen=True, slots=True)
class Rival:
    """Another explanation: its nodes by name, its score."""

    at: Mapping[str, complex]
    score: float


@dataclass(frozen=True, slots=True)
class Signs:
    """What tells how sure a vector (or node) is.

    Attributes
    ----------
    placed : geometric probability of lying within half a millimetre, from the fit's covariance
    named : share of the explanations that have it there
    off_mm : largest distance of its nodes from its stroke
    thin, mistaken : on a line thin as a construction line; in a plan explained by a mistake
    marked : probability of the less likely of the tips that mark the vector's two ends on its stroke
    elsewhere : probability of the likeliest other tip near by that might be meant
    """

    placed: float
    named: float
    off_mm: float = 0.1
    thin: bool = False
    mistaken: bool = False
    marked: float = 0.4
    elsewhere: float = 0.0


def sureness(signs: Signs) -> float:
    """Probability that the name is right and the vector read within half a millimetre."""
    told = CONSTANT
    told += WEIGHTS["placed"] * _log_odds(signs.placed) + WEIGHTS["named"] * _log_odds(signs.named)
    told += WEIGHTS["off_mm"] * min(signs.off_mm, 1.5)
    told += WEIGHTS["marked"] * signs.marked + WEIGHTS["elsewhere"] * signs.elsewhere
    told += WEIGHTS["mistaken"] * signs.mistaken + WEIGHTS["thin"] * signs.thin
    return min(1.0 / (1.0 + math.exp(-told)), signs.placed + PLACED_AND, HIGHEST)


def _log_odds(probability: float) -> float:
    return math.log((probability + 0.002) / (1.002 - probability))


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
    return np.array(
        [within(fit.cov[2 * node : 2 * node + 2, 2 * node : 2 * node + 2]) for node in range(len(fit.at))]
    )
