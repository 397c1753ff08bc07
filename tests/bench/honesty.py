"""Whether standard errors and confidences are what they claim.

A standard error is right where |error| / se is below 1 in 68.3 % and below 1.96 in 95 % of cases; the
robust root mean square (1.4826 times the median of |error| / se) is then 1. A confidence is right
where of all that is reported at it the same share is right.
"""

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from grader.records import FloatArray
from tests.bench.reading_truth import NEAR_MM

BINS = ((0.0, 0.5), (0.5, 0.8), (0.8, 0.9), (0.9, 0.95), (0.95, 0.99), (0.99, 1.0 + 1e-9))
NORMAL_SHARES = (0.683, 0.95)
_TO_SPREAD = 1.4826
"""The median of |x| to the standard deviation of a Gaussian."""


@dataclass(frozen=True, slots=True)
class Spread:
    """Errors in units of their standard error: how many, shares below 1 and 1.96, robust rms."""

    count: int
    under_1: float | None
    under_196: float | None
    rms: float | None

    @classmethod
    def of(cls, ratios: Sequence[float]) -> "Spread":
        """From errors over standard errors, of either sign."""
        if not ratios:
            return cls(0, None, None, None)
        size = np.abs(np.array(ratios))
        return cls(
            len(size), float((size < 1.0).mean()), float((size < 1.96).mean()),
            float(_TO_SPREAD * np.median(size)),
        )  # fmt: skip


@dataclass(frozen=True, slots=True)
class Bin:
    """What was reported at a confidence from `low` to below `high`, and the share within 0.5 mm."""

    low: float
    high: float
    count: int
    mean: float | None
    right: float | None


def calibration(told: Sequence[tuple[float, float]]) -> list[Bin]:
    """Of (confidence, error in mm): how often each confidence was right."""
    values = np.array(told, dtype=float).reshape(-1, 2)
    found = []
    for low, high in BINS:
        inside = values[(values[:, 0] >= low) & (values[:, 0] < high)]
        mean = float(inside[:, 0].mean()) if len(inside) else None
        right = float((inside[:, 1] <= NEAR_MM).mean()) if len(inside) else None
        found.append(Bin(low, min(high, 1.0), len(inside), mean, right))
    return found


def whitened(error: complex, cov: FloatArray) -> list[float]:
    """A place's error along the two principal axes of its covariance, in standard errors."""
    variances, axes = np.linalg.eigh(cov)
    along = np.array([error.real, error.imag]) @ axes
    return [float(x) for x in along / np.sqrt(np.maximum(variances, 1e-12))]


@dataclass(frozen=True, slots=True)
class Honesty:
    """Spreads of confidently read lengths (to nodes, to the nearer of nodes and stroke) and of nodes."""

    length_to_nodes: Spread
    length_to_nearer: Spread
    nodes: Spread
    confidence: Sequence[Bin]

    def as_json(self) -> dict[str, Any]:
        """For the report's JSON."""
        return asdict(self)
