"""Compare declared scales with the driving link's vectors: weak evidence of whose data a plan follows."""

import math
from collections.abc import Mapping

import numpy as np

from grader.comparison.evidence import DrawnVector
from grader.comparison.task import Task
from grader.given_data.sets import ExactDrawings
from reference.geometry import FloatArray
from reference.quantities import OF_MOTION, kind_of

WRONG_SCALE, OF_ANY = 0.1, 0.5
"""Probability that a plan follows the rule's scale instead of the declared one, and any other scale; density
of the logarithm of the factor then."""
AT_DECLARED, AT_OWN_RULE = 0.4, 0.4
"""Probability that a copied plan follows the scale declared beside it, or that of its original author."""
SET_OFF_SHARE, SET_OFF_MM = 0.006, 0.4
"""Standard errors of the driving vector's length: from its rounded scale, and from drawing it."""


def _driving(
    task: Task, drawn: Mapping[str, DrawnVector], scales: Mapping[str, float]
) -> tuple[str, float] | None:
    """Return the driving link's vector of a plan, and its declared scale; None if either is missing."""
    for scale in OF_MOTION:
        name = task.driving_vector(scale)
        has_length = name in drawn and drawn[name].length_mm > 0.0
        if has_length and scale in scales and task.real.get(name):
            return name, scales[scale]
    return None


def _off_scale(drawn: DrawnVector, scale: float, real: FloatArray) -> tuple[FloatArray, float]:
    """Return the log ratio of a drawn length to a real value at a scale, and its standard error."""
    with np.errstate(all="ignore"):
        off = np.log(drawn.length_mm * scale / real)
    sigma = math.hypot(SET_OFF_SHARE, SET_OFF_MM / drawn.length_mm)
    return np.where(np.isfinite(off), off, np.inf), sigma


def by_scale(
    task: Task, drawn: Mapping[str, DrawnVector], scales: Mapping[str, float], exact: ExactDrawings
) -> FloatArray:
    """Return the log probability of a plan's declared scale given its driving vector; (sets,).

    A copy may have the copied scale or the student's own: the scale says little, and never hides a copy.
    """
    found = _driving(task, drawn, scales)
    if found is None:
        return np.zeros(len(exact.data))
    name, declared = found
    real = np.abs(exact.real[name])
    is_other = np.array([one.kind == "other_variant" for one in exact.data])
    rule = np.array([one.rule.get(kind_of(name).scale, declared) for one in exact.data])
    at_declared, at_rule = (
        np.exp(-0.5 * (off / sigma) ** 2) / (sigma * math.sqrt(math.tau))
        for off, sigma in (_off_scale(drawn[name], declared, real), _off_scale(drawn[name], 1.0, real / rule))
    )
    copied = AT_DECLARED * at_declared + AT_OWN_RULE * at_rule + (1.0 - AT_DECLARED - AT_OWN_RULE) * OF_ANY
    own = (1.0 - 2.0 * WRONG_SCALE) * at_declared[0] + WRONG_SCALE * (at_rule[0] + OF_ANY)
    return np.asarray(np.log(np.where(is_other, copied, own)))
