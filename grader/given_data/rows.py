"""Compare what was drawn of one part with each set of data: directions and ratios of lengths.

Residuals are arrays (sets, rows) with the drafting errors that the construction propagates to each row.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.comparison.evidence import DrawnVector, Evidence
from grader.comparison.task import Task
from grader.given_data.sets import LEAST_TURNED_MM, BoolArray, ExactDrawings
from grader.records import MECHANISM
from reference.construction.uncertainty import acts
from reference.geometry import ComplexArray, FloatArray

LEAST_DOUBT = 0.06
"""Probability that a vector is drawn wrongly, or is an outlier for another reason."""
LEAST_RULED_MM = 3.0
"""Shorter lengths are not compared by their ratio."""
RULED_MM, SEEN_MM = 0.25, 0.1
"""Standard errors, besides those of its ends, of a length measured with a ruler to half a millimetre, and of
one read on a sheet."""
NOTED_DEG = 0.5
"""Standard error of a direction noted to a degree, besides that of the protractor."""
IntArray = np.ndarray[tuple[int, ...], np.dtype[np.int64]]
ZERO, ZERO_MM = 1e-9, 1e-6
NO_DIRECTION = math.pi / 4.0
"""Residual of a direction drawn where the exact vector is zero: it fits in no way."""


@dataclass(frozen=True, slots=True)
class Rows:
    """The measurements of a drawing or a part of it: residuals against each set of data, and their errors.

    Attributes
    ----------
    residuals : (sets, rows) of directions radians, folded to a quarter turn; of lengths see `_length`
    drafting : (rows, acts) shift of a row by one standard deviation of each act of drawing
    reading : (rows,) standard errors of reading or measuring
    is_angle : (rows,) of directions
    by_scale : (rows,) shift of a row with the logarithm of the plan's scale
    doubt : (rows,) probability that a row is of another vector
    reversed : (sets, rows) whether a direction fits only the opposite way
    part : (rows,) the part of the drawing that a row is of
    sheet : (rows,) the sheet on which it is drawn
    """

    residuals: FloatArray
    drafting: FloatArray
    reading: FloatArray
    is_angle: BoolArray
    by_scale: FloatArray
    doubt: FloatArray
    reversed: FloatArray
    part: IntArray
    sheet: IntArray

    def __len__(self) -> int:
        return len(self.reading)


def joined(parts: Sequence[Rows]) -> Rows:
    """Join the rows of several parts into those of one drawing."""
    counts = [len(one) for one in parts]
    return Rows(
        np.concatenate([one.residuals for one in parts], axis=1),
        np.concatenate([one.drafting for one in parts]),
        np.concatenate([one.reading for one in parts]),
        np.concatenate([one.is_angle for one in parts]),
        np.concatenate([one.by_scale for one in parts]),
        np.concatenate([one.doubt for one in parts]),
        np.concatenate([one.reversed for one in parts], axis=1),
        np.repeat(np.arange(len(parts)), counts),
        np.concatenate([one.sheet for one in parts]),
    )


def rows_of(
    task: Task, evidence: Evidence, drawn: Mapping[str, DrawnVector], exact: ExactDrawings, *, sheet: int = 0
) -> Rows:
    """Return directions of all that was drawn; lengths of links, and of vectors without a direction.

    Arguments: `sheet` is 1 for a plan that follows the sketch on a second sheet.
    """
    found: list[_Row] = []
    drawn_mm, real = _largest(drawn, exact)
    for name, one in drawn.items():
        with np.errstate(all="ignore"):
            expected = exact.real[name] * (drawn_mm / real)
        if one.direction_rad is not None and one.length_mm >= LEAST_TURNED_MM:
            found.append(_direction(task, evidence, name, one, expected))
        if one.direction_rad is None or task.segments[name].scale == "kL":
            found.append(_length(task, evidence, name, one, expected))
    return Rows(
        np.array([one.residual for one in found]).T.reshape(len(exact.data), len(found)),
        _by_sheet(task, np.array([one.drafting for one in found]), sheet),
        np.array([one.reading for one in found]),
        np.array([one.by_scale == 0.0 for one in found], np.bool_),
        np.array([one.by_scale for one in found]),
        np.clip([1.0 - one.sure for one in found], LEAST_DOUBT, 1.0 - LEAST_DOUBT),
        np.array([one.is_back for one in found]).T.reshape(len(exact.data), len(found)),
        np.zeros(len(found), np.int64),
        np.full(len(found), sheet),
    )


@dataclass(frozen=True, slots=True)
class _Row:
    """One direction or length: as in `Rows`; of a direction `by_scale` is zero."""

    residual: FloatArray
    drafting: FloatArray
    reading: float
    by_scale: float
    sure: float
    is_back: FloatArray


def _direction(task: Task, evidence: Evidence, name: str, one: DrawnVector, expected: ComplexArray) -> _Row:
    shifts, length = _shifts(task, name), min(one.length_mm, max(abs(expected[0]), LEAST_TURNED_MM))
    with np.errstate(invalid="ignore"):
        on_sheet = (one.direction_rad or 0.0) + one.turn_rad - task.segments[name].turn_rad
        off = np.angle(np.exp(1j * on_sheet) * np.conj(expected))
    is_back = np.abs(off) > math.pi / 2.0
    off = np.where(is_back, off - np.copysign(math.pi, off), off)
    off = np.where(np.abs(expected) < ZERO_MM, NO_DIRECTION, off)
    noted = math.radians(math.hypot(task.rubric.hand.protractor_deg, NOTED_DEG))
    read = math.radians(one.se_deg) if evidence.has_sheets else noted
    return _Row(
        off,
        shifts.imag / length,
        math.hypot(read, _seen(evidence) / one.length_mm),
        0.0,
        one.confidence,
        is_back * 1.0,
    )


def _length(task: Task, evidence: Evidence, name: str, one: DrawnVector, expected: ComplexArray) -> _Row:
    """Transform lengths, logarithmic for long and linear for short ones, by their drafting errors."""
    shifts = _shifts(task, name).real
    floor = math.hypot(LEAST_RULED_MM, 3.0 * math.sqrt(shifts @ shifts))
    size = np.abs(expected)
    # An assembly that does not exist has no lengths.
    off = np.where(np.isfinite(size), np.arcsinh(one.length_mm / floor) - np.arcsinh(size / floor), np.nan)
    shorter = math.hypot(floor, min(one.length_mm, float(size[0])))
    read = math.hypot(_seen(evidence), one.se_mm, 0.0 if evidence.has_sheets else task.rubric.hand.ruler_mm)
    by_scale = max(one.length_mm, ZERO_MM) / math.hypot(floor, one.length_mm)
    return _Row(off, shifts / shorter, read / shorter, by_scale, one.confidence, np.zeros(len(size)))


def _seen(evidence: Evidence) -> float:
    return SEEN_MM if evidence.has_sheets else RULED_MM


def _shifts(task: Task, name: str) -> ComplexArray:
    """Return the shift of a vector's or link's end by each act of drawing, along and across; (acts,) mm."""
    traced, ends = task.traced(task.rule_scales), task.segments[name]
    shifts = traced.made[ends.head].shifts - traced.nodes[ends.tail].shifts
    return np.asarray(shifts * np.conj(_unit(ends.real)))


def _by_sheet(task: Task, drafting: FloatArray, sheet: int) -> FloatArray:
    """Return (rows, acts) with the errors of a second sheet's sketch, drawn anew, after all others."""
    every = acts(task.construction)
    of_sketch = np.array([task.construction.figure_of(node) == MECHANISM for node, _, _ in every])
    first = drafting.reshape(len(drafting), len(every))
    second = first[:, of_sketch]
    return np.hstack([first * ~of_sketch, second] if sheet else [first, np.zeros_like(second)])


def _unit(vector: complex) -> complex:
    return vector / abs(vector) if abs(vector) > 0.0 else 1.0 + 0j


def _largest(drawn: Mapping[str, DrawnVector], exact: ExactDrawings) -> tuple[float, FloatArray]:
    """Return the longest of the drawn lengths, and the longest of the same vectors under each set of data."""
    if not drawn:
        return 1.0, np.ones(len(exact.data))
    sizes = np.array([np.abs(exact.real[name]) for name in drawn])
    longest = np.nan_to_num(sizes, nan=0.0).max(axis=0)
    return max(one.length_mm for one in drawn.values()), np.where(longest > 0.0, longest, 1.0)
