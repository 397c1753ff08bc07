"""Equal entered values: their chance for two students who measured their own drawings.

Lengths and directions spread about the exact ones by the propagated drafting errors, all vectors of a drawing
together: one inaccurate line shifts many values, which is one coincidence, not many. Nearly exact values are
no evidence, since everybody who works exactly has them. Grossly wrong values are mistakes, which two students
may make independently, and are left out.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import FloatArray
from grader.similarity.drawings import LEAST_CLASS
from grader.similarity.submission import USUAL, ComparedSubmission, scales_used
from reference.authored.assignment import Assignment, Variant
from reference.construction.graph import evaluate
from reference.construction.uncertainty import SMALL, step_errors
from reference.geometry import ComplexArray
from reference.plan import exact_plan

READ_OFF_MM = 0.15
"""Standard deviation of reading a ruler, besides the rounding of the written value."""
SCALE_OFF = 0.015
"""Standard deviation of each plan as a whole: rounded scales and speeds, common to all its vectors."""
GRAINS = (1.0, 0.5, 0.1)
"""Steps of rulers and protractors, mm and degrees. Finer values are calculated, not measured: finer
coincidences do not count."""
NEARLY_ALL = 0.75
"""Share of the values that must be multiples of a step."""
LEAST_MM = 8.0
"""Directions of shorter vectors are not compared."""
GROSS = 4.0
"""An error of more standard deviations is a mistake, not a drafting error."""
ROUNDED_MM = 0.05
"""Residual that counts as exact, besides the step of the values."""
OWN_SHARE = 0.6
"""Share of a student's values that must be near the exact ones; otherwise they are of another drawing."""
LEAST_EQUAL = 5
"""Fewer equal values are not examined,"""
LEAST_TELLING = 3
"""nor are values of which fewer than this differ from the exact ones by more than rounding."""
SKILLS = (0.1, 0.2, 0.35, 0.5, 0.7, 1.0, 1.4, 2.0, 3.0)
"""Drafting errors to try, as multiples of the usual ones."""


@dataclass(frozen=True, slots=True)
class NumberSimilarity:
    """Similarity of every two students' entered values; arrays (students, students).

    Attributes
    ----------
    log_chance : natural logarithm of the chance that independent values are equal in so many places
    equal, compared : values that are the same, and that both have
    pairs : of students with values
    """

    log_chance: FloatArray
    equal: FloatArray
    compared: FloatArray
    pairs: int


@dataclass(frozen=True, slots=True)
class _Table:
    """Entered values and the values expected of each student; nan if there is none.

    Attributes
    ----------
    entered : (students, fields) mm and degrees
    usable : (students, fields) whether the residual may be a drafting error
    telling : (students, fields) whether it is usable and more than rounding
    residual_mm : (students, fields) from the exact values, directions as the vector's end across it;
        without the mean of those with the same variant
    grain_mm : (students, fields) step of the values
    by_act : (students, fields, acts) shift by a usual error of each act, mm
    """

    entered: FloatArray
    usable: NDArray[np.bool_]
    telling: NDArray[np.bool_]
    residual_mm: FloatArray
    grain_mm: FloatArray
    by_act: FloatArray


def compare_numbers(assignment: Assignment, submissions: Sequence[ComparedSubmission]) -> NumberSimilarity:
    """Compare the entered values of a class, each with the variant that was drawn."""
    count = len(submissions)
    chance, equal, compared = np.zeros((count, count)), np.zeros((count, count)), np.zeros((count, count))
    having = [k for k, each in enumerate(submissions) if len(each.numbers) >= LEAST_EQUAL]
    if len(having) < 2:
        return NumberSimilarity(chance, equal, compared, 0)
    table = _table(assignment, [submissions[k] for k in having])
    single = _single(table)
    same, telling, alone, both = _counted(table, single)
    people = np.array([submissions[k].student_id for k in having])
    strangers = people[:, None] != people[None, :]
    pairs = max(int(strangers.sum()) // 2, 1)
    choices = _choices(both, same)
    likely = (same >= LEAST_EQUAL) & (telling >= LEAST_TELLING) & (alone + choices <= -np.log(pairs))
    known: dict[tuple[int, bytes], float] = {}
    for i, j in np.argwhere(likely & strangers):
        chosen = (table.entered[i] == table.entered[j]) & table.usable[i]
        key = int(i), chosen.tobytes()
        if key not in known:
            known[key] = _chance(table, int(i), chosen)
        # Whichever student copied, the values belong to one of the two drawings.
        a, b = having[i], having[j]
        chance[a, b] = chance[b, a] = min(chance[a, b], known[key] + choices[i, j])
    where = np.ix_(having, having)
    equal[where], compared[where] = np.maximum(same, same.T), both
    return NumberSimilarity(chance, equal, compared, pairs)


def _counted(table: _Table, single: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    """Return counts for every two students, arrays (students, students).

    The usable values of the first that the second has, too; the telling ones of them; the sum of the logs
    of their single chances; the number of values that both have.
    """
    count = len(table.entered)
    same, telling, alone = (np.zeros((count, count)) for _ in range(3))
    for field, column in enumerate(table.entered.T):
        equal = column[:, None] == column[None, :]
        usable = equal & table.usable[:, field, None]
        same += usable
        alone += np.where(usable, single[:, field, None], 0.0)
        telling += equal & table.telling[:, field, None]
    known = np.isfinite(table.entered).astype(np.float64)
    return same, telling, alone, known @ known.T


def _choices(both: FloatArray, equal: FloatArray) -> FloatArray:
    """Return the log of the number of combinations in which so many of the values can be the equal ones."""
    log = scipy.special.gammaln
    return np.asarray(log(both + 1.0) - log(equal + 1.0) - log(both - equal + 1.0))


# The table ----------------------------------------------------------------------------------------


def _table(assignment: Assignment, submissions: Sequence[ComparedSubmission]) -> _Table:
    known = {each.variant for each in submissions}
    variants = [each.fits[0] if each.fits and each.fits[0] in known else each.variant for each in submissions]
    exact, added = _exact(assignment, submissions, variants)
    names = list(exact)
    lengths, turns = (
        np.array([[each.numbers.get(f"{name}{part}", np.nan) for name in names] for each in submissions])
        for part in ("", "_deg")
    )
    drawn = np.array([exact[name] for name in names]).T
    size = np.abs(drawn)
    with np.errstate(invalid="ignore", divide="ignore"):
        along = drawn / size
        off = (turns - np.degrees(np.angle(drawn)) + 180.0) % 360.0 - 180.0
        acts = np.moveaxis(np.array([added[name] for name in names]), 0, 1) * along.conj()[..., None]
    turns = np.where(size >= LEAST_MM, turns, np.nan)
    known_mm, known_deg = _grain(lengths), _grain(turns)
    grain = np.concatenate([known_mm * np.ones_like(size), np.radians(known_deg) * size], axis=1)
    residual_mm = np.concatenate([lengths - size, np.radians(off) * size], axis=1)
    by_act = np.concatenate([acts.real, acts.imag], axis=1)
    spread = _spread(by_act, grain)
    excused = np.tile([[name in each.excused for name in names] for each in submissions], 2)
    entered = np.concatenate([lengths, turns], axis=1)
    with np.errstate(invalid="ignore"):
        usable = np.isfinite(entered) & (np.abs(residual_mm) < GROSS * spread) & ~excused
        count = np.isfinite(entered).sum(axis=1, keepdims=True)
        usable &= usable.sum(axis=1, keepdims=True) >= OWN_SHARE * count
        residual_mm = residual_mm - _common(np.where(usable, residual_mm, np.nan), variants)
        telling = usable & (np.abs(residual_mm) > 0.5 * grain + ROUNDED_MM)
    return _Table(entered, usable, telling, residual_mm, grain, by_act)


def _spread(by_act: FloatArray, grain_mm: FloatArray) -> FloatArray:
    """Return (students, fields) standard deviation of values with usual drafting errors, mm."""
    return np.asarray(np.sqrt((by_act**2).sum(axis=2) + READ_OFF_MM**2 + grain_mm**2 / 12.0))


def _exact(
    assignment: Assignment, submissions: Sequence[ComparedSubmission], variants: list[Variant]
) -> tuple[dict[str, ComplexArray], dict[str, ComplexArray]]:
    """Return exact vectors (students,) in mm, and shifts by usual errors of all acts (students, acts)."""
    plan = exact_plan(assignment, variants, scales_used(assignment, submissions, variants))
    vectors = {
        name: np.broadcast_to(plan.drawn_mm(name), len(submissions)) for name in plan.construction.vectors
    }
    changes: dict[str, list[ComplexArray]] = {name: [] for name in vectors}
    for step in plan.construction.steps:
        errors = step_errors(step, USUAL)
        if not errors:
            continue
        nodes = evaluate(plan.construction, plan.drawing.parameters, errors=errors)
        for name, vector in plan.construction.vectors.items():
            ends = np.atleast_2d(nodes[vector.head] - nodes[vector.tail])
            change = (ends[1:] - ends[:1]) / SMALL if len(ends) > 1 else np.zeros((len(errors), 1))
            changes[name].append(np.asarray(np.broadcast_to(change, (len(errors), len(submissions))).T))
    for plan_name in plan.construction.poles:
        of_plan = {vector.name for vector in plan.construction.vectors_of(plan_name)}
        for name, drawn in vectors.items():
            changes[name].append((SCALE_OFF * drawn * (name in of_plan))[:, None])
    return vectors, {name: np.nan_to_num(np.concatenate(parts, axis=1)) for name, parts in changes.items()}


def _common(residual_mm: FloatArray, variants: Sequence[Variant]) -> FloatArray:
    """Return (students, fields) mean residual of those with the same variant, if they are many enough.

    A protractor or a rounded table that all share gives all values the same error. A median of values in
    whole millimetres would be one of them.
    """
    common = np.zeros_like(residual_mm)
    for variant in set(variants):
        same = np.array([each == variant for each in variants])
        known = np.isfinite(residual_mm[same])
        count = known.sum(axis=0)
        mean = np.where(known, residual_mm[same], 0.0).sum(axis=0) / np.maximum(count, 1)
        common[same] = np.where(count >= LEAST_CLASS, mean, 0.0)
    return common


def _grain(values: FloatArray) -> FloatArray:
    """Return (students, 1) the coarsest step of which nearly all values are multiples; else the finest."""
    count = np.isfinite(values).sum(axis=1, keepdims=True)
    coarsest = np.full((len(values), 1), GRAINS[-1])
    for grain in sorted(GRAINS[:-1]):
        with np.errstate(invalid="ignore"):
            whole = (np.abs(values / grain - np.round(values / grain)) < 1e-6).sum(axis=1, keepdims=True)
        coarsest = np.where(whole >= NEARLY_ALL * count, grain, coarsest)
    return coarsest


# Chances ------------------------------------------------------------------------------------------


def _single(table: _Table) -> FloatArray:
    """Return the log chance of each value by itself: a rough upper bound of the evidence."""
    spread = _spread(table.by_act, table.grain_mm)
    with np.errstate(divide="ignore", invalid="ignore"):
        log = np.log(table.grain_mm / spread / np.sqrt(2.0 * np.pi)) - 0.5 * (table.residual_mm / spread) ** 2
    return np.asarray(np.nan_to_num(np.minimum(log, 0.0)))


def _chance(table: _Table, student: int, chosen: np.ndarray) -> float:
    """Return the log chance that an independent student with the same variant has these values.

    The density of all the values together times their steps, at the likeliest size of drafting errors.
    """
    acts, off = table.by_act[student][chosen], table.residual_mm[student][chosen]
    grain = table.grain_mm[student][chosen]
    best = -np.inf
    for skill in SKILLS:
        noise = (skill * READ_OFF_MM) ** 2 + grain**2 / 12.0
        root = np.linalg.cholesky(skill**2 * acts @ acts.T + np.diag(noise))
        whitened = np.linalg.solve(root, off)
        spread = np.log(2.0 * np.pi) * len(off) / 2.0 + np.log(np.diag(root)).sum()
        best = max(best, float(-0.5 * whitened @ whitened - spread))
    return min(best + float(np.log(grain).sum()), 0.0)
