"""What judging is held against: the verdicts that can be due, what is seen, what is near enough."""

import cmath
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Literal

from grader.comparison.evidence import Submission
from grader.records import MECHANISM
from grader.rubric import ToleranceTable

Due = Literal["right", "follows", "wrong", "either", "missed", "absent"]
CLEAR, PLAIN = 2.5, 1.0
"""Multiples of the rubric's tolerance beyond which it is clearly wrong, and up to which it is right."""
SHORT = 1.5
"""A value from a vector shorter than so many times the least to be judged may be taken for trivial."""


@dataclass(frozen=True, slots=True)
class Seen:
    """What the judge can see: the vectors and links, and whether their directions are known."""

    directed: Mapping[str, bool]

    @classmethod
    def of(cls, handed_in: Submission, links: Mapping[str, tuple[str, str]]) -> "Seen":
        """From what was handed in; a link is seen where both of its joints are."""
        readings = [*handed_in.readings, *([handed_in.measured] if handed_in.measured else [])]
        joints = {
            joint for one in readings if MECHANISM in one.figures for joint in one.figures[MECHANISM].nodes
        }
        vectors = {
            name: vector.direction_deg is not None
            for reading in readings
            for figure in reading.figures.values()
            for name, vector in figure.vectors.items()
        }
        return cls({**vectors, **{name: True for name, ends in links.items() if joints.issuperset(ends)}})


def off(drawn: complex, due: complex, tolerance: ToleranceTable, *, directed: bool) -> float:
    """How far a vector is from another, in the rubric's plain tolerances; infinite where there is none."""
    if not cmath.isfinite(due) or not cmath.isfinite(drawn):
        return math.inf
    allowed = max(tolerance.length_mm, tolerance.length_relative * abs(due))
    far = abs(abs(drawn) - abs(due)) / allowed
    if directed and min(abs(drawn), abs(due)) >= max(tolerance.least_mm, 1e-9):
        across = math.degrees(math.atan(tolerance.across_mm / abs(due)))
        turned = abs(math.degrees(math.remainder(cmath.phase(drawn) - cmath.phase(due), math.tau)))
        far = max(far, turned / max(tolerance.direction_deg, across))
    return far
