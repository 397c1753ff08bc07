"""The nodes of a whole class as arrays, and which variants the drawings fit."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from grader.alike.handed import Handed
from grader.records import FloatArray
from reference.assignment import Assignment, Variant
from reference.geometry import ComplexArray
from reference.plan import exact_plan

UNKNOWN = complex(np.nan, np.nan)
FITS_MM = 2.0
"""Root mean square distance from the exact figures up to which a drawing may be of that variant,"""
FITS_BETTER = 0.5
"""and how many times nearer than to those of the own one it must be."""
LEAST_NODES = 6


@dataclass(frozen=True, slots=True)
class Drawn:
    """The nodes of one figure in all submissions.

    Attributes
    ----------
    names : (nodes,)
    at : (students, nodes) x - i y in sheet millimetres, nan where not read
    sheet : (students,) index of the sheet that it was taken from, -1 where it was on none
    """

    names: tuple[str, ...]
    at: ComplexArray
    sheet: np.ndarray


def drawn_of(handed: Sequence[Handed], nodes: Mapping[str, Sequence[str]]) -> dict[str, Drawn]:
    """Each figure's nodes, of the sheet that shows most of them; two sketches may have been handed in."""
    found = {}
    for figure, names in nodes.items():
        chosen = [_fullest(one, figure) for one in handed]
        at = [
            [UNKNOWN if k < 0 else one.sheets[k][figure].get(name, UNKNOWN) for name in names]
            for one, k in zip(handed, chosen, strict=True)
        ]
        found[figure] = Drawn(tuple(names), np.array(at).reshape(len(handed), -1), np.array(chosen))
    return found


def _fullest(one: Handed, figure: str) -> int:
    having = [k for k, sheet in enumerate(one.sheets) if figure in sheet]
    return max(having, key=lambda k: len(one.sheets[k][figure]), default=-1)


def fitting(
    assignment: Assignment, handed: Sequence[Handed], drawn: Mapping[str, Drawn]
) -> list[tuple[Variant, float] | None]:
    """For each student another variant of the class whose exact figures the drawing fits, and how far off."""
    variants = list(dict.fromkeys(one.variant for one in handed))
    plan = exact_plan(assignment, variants)
    square, count = np.zeros((len(handed), len(variants))), np.zeros((len(handed), 1))
    for figure, one in drawn.items():
        exact = np.array(
            [np.broadcast_to(plan.nodes_mm[figure][name], len(variants)) for name in one.names]
        ).T
        known = np.isfinite(one.at)
        square += _misfit(np.where(known, one.at, 0.0), known, exact)
        count += known.sum(axis=1, keepdims=True)
    off = np.sqrt(square / np.maximum(count, 1.0))
    own = off[np.arange(len(handed)), [variants.index(one.variant) for one in handed]]
    best = off.argmin(axis=1)
    least = off[np.arange(len(handed)), best]
    fits = (count[:, 0] >= LEAST_NODES) & (least < FITS_MM) & (least < FITS_BETTER * own)
    return [(variants[k], float(mm)) if good else None for k, mm, good in zip(best, least, fits, strict=True)]


def _misfit(at: ComplexArray, known: np.ndarray, exact: ComplexArray) -> FloatArray:
    """(students, variants) sums of squares, mm^2, of figures shifted, turned and scaled onto exact ones."""
    weight = known.astype(np.float64)
    count = np.maximum(weight.sum(axis=1), 1.0)
    sum_at, sum_exact = at.sum(axis=1), weight @ exact.T
    spread = (np.abs(at) ** 2).sum(axis=1) - np.abs(sum_at) ** 2 / count
    sizes = weight @ (np.abs(exact) ** 2).T - np.abs(sum_exact) ** 2 / count[:, None]
    joint = at @ exact.conj().T - sum_at[:, None] * sum_exact.conj() / count[:, None]
    with np.errstate(invalid="ignore", divide="ignore"):
        explained = np.nan_to_num(np.abs(joint) ** 2 / sizes)
    return np.asarray(np.maximum(spread[:, None] - explained, 0.0))
