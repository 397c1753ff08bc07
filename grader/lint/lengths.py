"""Vectors too short to measure at the proposed scales; those asked for apart from the others."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from grader.lint.findings import BoolArray, LintFinding, chosen
from grader.rubric import RubricFile
from reference.geometry import FloatArray
from reference.plan import ZERO_SHARE, Plan

WELL_READ_MM = 8.0
"""Shorter vectors are read from scans with less certainty."""


@dataclass(frozen=True, slots=True)
class Asked:
    """Drawn lengths of the vectors that a rubric asks for.

    Attributes
    ----------
    criteria : index of each vector's criterion
    names : of the vectors, V of them
    length_mm : (V, N)
    is_zero : (V, N), of true length zero (a dead point): no scale makes it longer
    least_mm : (V,), shorter ones are not judged on their direction
    """

    criteria: tuple[int, ...]
    names: tuple[str, ...]
    length_mm: FloatArray
    is_zero: BoolArray
    least_mm: FloatArray

    def short(self, limit_mm: FloatArray | float) -> BoolArray:
        """(V, N): drawn shorter than a limit, though not zero."""
        return np.asarray((self.length_mm < limit_mm) & ~self.is_zero)


def asked_vectors(rubric: RubricFile, plan: Plan) -> Asked:
    """The vectors asked for that the mechanism has."""
    known = [
        (index, criterion.vector, rubric.tolerance_of(criterion).least_mm)
        for index, criterion in enumerate(rubric.criterion)
        if criterion.vector is not None and criterion.vector in plan.vectors_si
    ]
    names = tuple(name for _, name, _ in known)
    return Asked(
        tuple(index for index, _, _ in known),
        names,
        *_lengths(plan, names),
        np.array([one[2] for one in known]),
    )


def _lengths(plan: Plan, names: tuple[str, ...]) -> tuple[FloatArray, BoolArray]:
    count = len(plan.variants)
    lengths, zeros = np.empty((len(names), count)), np.zeros((len(names), count), dtype=np.bool_)
    for row, name in enumerate(names):
        figure = plan.construction.figure_of(plan.construction.vectors[name].head)
        lengths[row] = np.abs(plan.drawn_mm(name))
        zeros[row] = lengths[row] <= ZERO_SHARE * plan.size_mm(figure)
    return lengths, zeros


def length_findings(rubric: RubricFile, plan: Plan, asked: Asked) -> Iterator[LintFinding]:
    """Short vectors one by one where they are asked for, together where they are not."""
    for row, name in enumerate(asked.names):
        path = f"$.criterion[{asked.criteria[row]}]"
        least = float(asked.least_mm[row])
        short = asked.short(least)[row]
        if np.any(short):
            told = f"{name} is shorter than {least:g} mm at the proposed scales, down to"
            shortest = float(np.min(asked.length_mm[row][short]))
            yield LintFinding(
                "warning", "short_vector", "rubric", path,
                f"{told} {shortest:.2g} mm", chosen(plan.variants, short),
            )  # fmt: skip
        zero = asked.is_zero[row]
        if np.any(zero):
            told = f"{name} is zero: it has a length to be judged, and no direction"
            yield LintFinding("hint", "zero_vector", "rubric", path, told, chosen(plan.variants, zero))
    few = asked.short(WELL_READ_MM)
    if np.any(few):
        told = (
            f"{int(few.sum())} of {int((~asked.is_zero).sum())} asked vectors are shorter than"
            f" {WELL_READ_MM:g} mm at the proposed scales: on scans they are read with less certainty"
        )
        meant = chosen(plan.variants, np.any(few, axis=0))
        yield LintFinding("hint", "hard_to_read", "assignment", "$.scales", told, meant)
    yield from _unasked(rubric, plan, asked)


def _unasked(rubric: RubricFile, plan: Plan, asked: Asked) -> Iterator[LintFinding]:
    names = tuple(name for name in plan.vectors_si if name not in asked.names)
    lengths, zeros = _lengths(plan, names)
    short = (lengths < rubric.tolerance.least_mm) & ~zeros
    told = [
        f"{name} (down to {np.min(lengths[row][short[row]]):.2g} mm)"
        for row, name in enumerate(names)
        if np.any(short[row])
    ]
    if told:
        least = f"{rubric.tolerance.least_mm:g} mm"
        message = f"shorter than {least}, though not asked for: {', '.join(told)}"
        meant = chosen(plan.variants, np.any(short, axis=0))
        yield LintFinding("hint", "short_unasked", "assignment", "$.scales", message, meant)
