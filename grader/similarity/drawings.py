"""Similarity of drawings, by drafting errors and by positions on the sheet.

Each node is compared with the one that follows exactly from the student's *own* earlier nodes, so that
an error counts only where it was made. Divided by its propagated standard deviation, the errors of all
acts are comparable: those of independent students are independent and have one spread. Acts with much
larger errors than the student's others are mistakes and are left out.

Two lists of d such errors are two vectors. For independent drawings all directions in d dimensions are
equally likely, whatever the size of the errors, and the distribution of the cosine is known exactly.

How near two placements come to each other by chance is estimated from the class: where a teacher or a
printed sheet says where the pole belongs, all figures lie at the same position, which is no evidence.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
import scipy
from numpy.typing import NDArray

from grader.records import MECHANISM, FloatArray, IntArray
from grader.similarity.submission import (
    UNKNOWN,
    USUAL,
    ComparedSubmission,
    Drawn,
    drawn_of,
    fitting,
    scales_used,
)
from reference.authored.assignment import Assignment, Variant
from reference.construction.elements import View
from reference.construction.graph import Construction
from reference.construction.steps import Coincide, Pivot, Pole, Step
from reference.construction.uncertainty import SMALL, step_errors
from reference.geometry import ComplexArray
from reference.plan import construction_for, exact_plan

USUAL_SHARE = 0.45
"""Share of the drafting errors that is independent; a large class gives its own share,"""
LARGEST_SHARE = 0.7
"""and at most this."""
RARE = -9.0
"""Below this log chance of two placements, each drawing is also compared with the other's variant."""
GROSS = 4.0
"""An error this many times as large as the student's usual one is a mistake or a misreading."""
TAIL = 2.5
"""Larger errors count as this: one large error does not make two drawings similar."""
LEAST_SPREAD = 0.1
"""Least usual error of a student, as a share of the usual drafting errors."""
LEAST_CLASS = 10
"""This many submissions of one variant show what they share (a copier's scale, a table's rounding)."""
NEAR_MM = 0.5
"""Smaller distances count as this."""
RINGS_MM = (1.0, 2.0, 4.0, 8.0, 16.0, 32.0)
"""Radii within which the class's own placements are counted."""
LAYOUT_MM, LAYOUT_SHARE = 16.0, 0.15
"""A class follows a layout if in this share of its pairs all figures are this close. Figures of different
variants on the same poles reach it (0.28), free ones do not (0.003), nor does one copy among ten pairs."""
LEAST_PAIRS = 10
"""Fewer pairs do not show what a class has in common."""
TRUSTED = 3000.0
"""Largest rarity of a placement, as a multiple of the class's pairs: the class cannot show rarer ones."""


@dataclass(frozen=True, slots=True)
class Row:
    """A student's drawing (by index) compared with a variant."""

    owner: int
    variant: Variant


@dataclass(frozen=True, slots=True)
class DrawingSimilarity:
    """Similarity of every two students' drawings; arrays (students, students).

    Attributes
    ----------
    log_chance : natural logarithm of the chance of so much similarity without copying; 0 if not compared
    log_errors, log_places : the same by drafting errors and by positions on the sheet alone
    log_layout : as `log_places`, for those who follow a layout; nan for others
    cosine, count : agreement of the errors, and how many there are
    pairs : of different students
    fits : another variant of the class that a drawing fits, and the residual in mm
    """

    log_chance: FloatArray
    log_errors: FloatArray
    log_places: FloatArray
    log_layout: FloatArray
    cosine: FloatArray
    count: FloatArray
    pairs: int
    fits: list[tuple[Variant, float] | None]


def compare_drawings(assignment: Assignment, submissions: Sequence[ComparedSubmission]) -> DrawingSimilarity:
    """Compare the drawings of a class."""
    construction = construction_for(assignment)
    figures = (MECHANISM, *construction.poles)
    nodes = {figure: [step.node for step in construction.figures[figure]] for figure in figures}
    drawn = drawn_of(submissions, nodes)
    fits = fitting(assignment, submissions, drawn)
    variants = list(dict.fromkeys(each.variant for each in submissions))
    variant = np.array([variants.index(each.variant) for each in submissions])
    printed = np.array([each.printed for each in submissions])
    places, layout = position_chance(drawn, printed, variant)
    rows = _rows(submissions, fits, places)
    together = _compared_rows(rows, submissions)
    cosines, counts, log_agreement = _agreement(
        drafting_errors(assignment, submissions, drawn, rows), together
    )
    log_errors, cosine, count = _by_student(
        rows, len(submissions), np.where(together, log_agreement, 0.0), cosines, counts
    )
    (compared,) = _by_student(rows, len(submissions), np.where(together, -1.0, 0.0))
    people = np.array([each.student_id for each in submissions])
    return DrawingSimilarity(
        log_chance=np.where(compared < 0.0, _fisher_combined(log_errors, places), 0.0),
        log_errors=log_errors,
        log_places=np.where(compared < 0.0, places, 0.0),
        log_layout=layout,
        cosine=cosine,
        count=count,
        pairs=int((people[:, None] != people[None, :]).sum()) // 2,
        fits=fits,
    )


def _rows(
    submissions: Sequence[ComparedSubmission],
    fits: Sequence[tuple[Variant, float] | None],
    places: FloatArray,
) -> list[Row]:
    """Return each drawing with its own variant, those it fits, and those of similarly placed drawings."""
    known = {each.variant for each in submissions}
    rows = [Row(k, each.variant) for k, each in enumerate(submissions)]
    rows += [Row(k, fit[0]) for k, fit in enumerate(fits) if fit is not None]
    diagnosed = [(k, each.fits[0]) for k, each in enumerate(submissions) if each.fits is not None]
    rows += [Row(k, variant) for k, variant in diagnosed if variant in known]
    if len(submissions) > 1:
        rows += [Row(int(j), submissions[i].variant) for i, j in np.argwhere(places < RARE)]
    return list(dict.fromkeys(rows))


def _compared_rows(rows: Sequence[Row], submissions: Sequence[ComparedSubmission]) -> NDArray[np.bool_]:
    """Return (rows, rows) which rows are compared: of one variant, and of two people."""
    variants = list(dict.fromkeys(row.variant for row in rows))
    variant = np.array([variants.index(row.variant) for row in rows])
    person = np.array([submissions[row.owner].student_id for row in rows])
    return np.asarray((variant[:, None] == variant[None, :]) & (person[:, None] != person[None, :]))


def _by_student(
    rows: Sequence[Row], students: int, log_chance: FloatArray, *others: FloatArray
) -> list[FloatArray]:
    """Return for every two students the least chance of their rows, and the other values of those rows."""
    owner = np.array([row.owner for row in rows])
    pair = owner[:, None] * students + owner[None, :]
    order = np.argsort(-log_chance, axis=None, kind="stable")
    by_student = []
    for values in (log_chance, *others):
        best = np.zeros(students * students)
        # The value written last is that of the least chance.
        best[pair.ravel()[order]] = values.ravel()[order]
        by_student.append(best.reshape(students, students))
    return by_student


def _fisher_combined(first: FloatArray, second: FloatArray) -> FloatArray:
    """Combine evidence by Fisher's rule: log of the chance that two independent pieces are so rare."""
    both = scipy.special.gammaincc(2.0, -(first + second))
    with np.errstate(divide="ignore"):
        return np.where(second < 0.0, np.maximum(np.log(both), -690.0), first)


# Drafting errors ----------------------------------------------------------------------------------


def drafting_errors(
    assignment: Assignment,
    submissions: Sequence[ComparedSubmission],
    drawn: Mapping[str, Drawn],
    rows: Sequence[Row],
) -> FloatArray:
    """Return errors of drawings compared with variants, (rows, acts), in the student's usual errors.

    nan if not known.
    """
    owner = np.array([row.owner for row in rows], np.int64)
    variants = [row.variant for row in rows]
    chosen = [submissions[row.owner] for row in rows]
    placed = {figure: nodes.at[owner] for figure, nodes in drawn.items()}
    raw, by_scale = _raw_errors(assignment, chosen, variants, placed)
    errors = _normed(raw - _enlargement(raw, by_scale) * by_scale)
    return _centred(_without(errors, by_scale), variants)


def _raw_errors(
    assignment: Assignment,
    chosen: Sequence[ComparedSubmission],
    variants: list[Variant],
    drawn: Mapping[str, ComplexArray],
) -> tuple[FloatArray, FloatArray]:
    """Return errors of each node given the student's own earlier nodes, in usual errors, (rows, 2 nodes).

    The second array, of the same shape, is their derivative by an enlargement (of printers, copiers).
    """
    plan = exact_plan(assignment, variants, scales_used(assignment, chosen, variants))
    own = _own_nodes(plan.construction, plan.nodes_mm, drawn)
    nodes: dict[str, ComplexArray] = {}
    known = plan.drawing.parameters
    view = View(nodes, known)
    scaled = {name: np.asarray(scale / (1.0 + SMALL)) for name, scale in plan.scales.by_name.items()}
    copied = View(nodes, {**known, **scaled})
    errors, by_scale = [], []
    with np.errstate(invalid="ignore", divide="ignore"):
        for step in plan.construction.steps:
            expected = np.broadcast_to(step.place(view), (len(chosen),))
            placed = own[step.node]
            if not isinstance(step, Coincide | Pivot | Pole):
                covariance = _covariance(step, view, expected)
                errors.append(_whitened(placed - expected, covariance))
                by_scale.append(_whitened((step.place(copied) - expected) / SMALL, covariance))
            nodes[step.node] = np.where(np.isfinite(placed), placed, expected)
    return _finite(np.concatenate(errors, axis=1)), _finite(np.concatenate(by_scale, axis=1))


def _finite(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, np.nan)


def _own_nodes(
    construction: Construction,
    exact: Mapping[str, Mapping[str, ComplexArray]],
    drawn: Mapping[str, ComplexArray],
) -> dict[str, ComplexArray]:
    """Return the students' nodes in the assignment's frame, nan if not read: plans about their pole."""
    own: dict[str, ComplexArray] = {}
    turn = np.ones(len(drawn[MECHANISM]), np.complex128)
    for figure, at in drawn.items():
        names = [step.node for step in construction.figures[figure]]
        if figure == MECHANISM:
            proper = np.array([np.broadcast_to(exact[figure][name], len(at)) for name in names]).T
            placed, turn = _laid_over(at, proper)
        else:
            pole = names.index(construction.poles[figure])
            placed = (at - at[:, pole : pole + 1]) * turn[:, None].conj()
        own |= dict(zip(names, placed.T, strict=True))
    return own


def _laid_over(drawn: ComplexArray, proper: ComplexArray) -> tuple[ComplexArray, ComplexArray]:
    """Turn and shift sketches onto the right ones; return them and their turn (1 if not known)."""
    known = np.isfinite(drawn) & np.isfinite(proper)
    count = np.maximum(known.sum(axis=1, keepdims=True), 1)
    here = np.where(known, drawn, 0.0)
    there = np.where(known, proper, 0.0)
    middle, centre = here.sum(axis=1, keepdims=True) / count, there.sum(axis=1, keepdims=True) / count
    here, there = np.where(known, here - middle, 0.0), np.where(known, there - centre, 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        fit = (here * there.conj()).sum(axis=1) / (np.abs(there) ** 2).sum(axis=1)
        turn = fit / np.abs(fit)
    turn = np.where((known.sum(axis=1) > 1) & np.isfinite(turn), turn, 1.0)
    return (drawn - middle) * turn[:, None].conj() + centre, turn


def _covariance(step: Step, view: View, expected: ComplexArray) -> FloatArray:
    """Return (rows, 2, 2) covariance of a node by usual errors in the acts that make it, mm^2."""
    errors = step_errors(step, USUAL)
    placed = np.asarray(step.place(View(view.nodes, view.parameters, errors)))
    count = len(next(iter(errors.values())))
    change = (np.broadcast_to(placed, (count, len(expected))) - expected) / SMALL
    by = np.nan_to_num(np.stack([change.real, change.imag], axis=-1))
    return np.asarray(np.einsum("ari,arj->rij", by, by) + USUAL.mark_mm**2 * np.eye(2))


def _whitened(error: ComplexArray, covariance: FloatArray) -> FloatArray:
    """Return (rows, 2) an error in units of its standard deviation."""
    root = np.linalg.cholesky(covariance)
    return np.linalg.solve(root, np.stack([error.real, error.imag], axis=-1)[..., None])[..., 0]


def _normed(errors: FloatArray) -> FloatArray:
    """Return errors in units of the student's usual one; mistakes are nan, large errors limited to `TAIL`."""
    with np.errstate(invalid="ignore"):
        usual = _median(np.abs(errors))[:, None] / 0.6745
        scaled = errors / np.maximum(usual, LEAST_SPREAD)
        scaled[np.abs(scaled) > GROSS] = np.nan
        return np.clip(scaled, -TAIL, TAIL)


def _enlargement(errors: FloatArray, by_scale: FloatArray) -> FloatArray:
    """Return (rows, 1) the common enlargement: the weighted median of the enlargements of all lengths."""
    weight = np.where(np.isfinite(errors) & np.isfinite(by_scale), np.abs(by_scale), 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        each = np.where(weight > 0.0, errors / by_scale, 0.0)
    order = np.argsort(each, axis=1)
    reached = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    middle = (reached >= reached[:, -1:] / 2.0).argmax(axis=1)[:, None]
    return np.take_along_axis(np.take_along_axis(each, order, axis=1), middle, axis=1)


def _without(errors: FloatArray, by_scale: FloatArray) -> FloatArray:
    """Return errors without the part that a common enlargement explains."""
    known = np.isfinite(errors) & np.isfinite(by_scale)
    along = np.where(known, by_scale, 0.0)
    size = np.maximum((along**2).sum(axis=1, keepdims=True), 1e-12)
    share = (np.where(known, errors, 0.0) * along).sum(axis=1, keepdims=True) / size
    return np.asarray(errors - share * along)


def _median(values: FloatArray) -> FloatArray:
    """Return lower medians of the finite values along the last axis; 0 if there are none."""
    known = np.isfinite(values)
    count = known.sum(axis=-1)
    if not values.shape[-1]:
        return np.zeros(count.shape)
    ordered = np.sort(np.where(known, values, np.inf), axis=-1)
    middle = np.take_along_axis(ordered, np.maximum(count - 1, 0)[..., None] // 2, axis=-1)[..., 0]
    return np.where(count > 0, middle, 0.0)


def _centred(errors: FloatArray, variants: Sequence[Variant]) -> FloatArray:
    """Subtract from errors the median of those with the same variant, if they are many enough."""
    errors = errors.copy()
    for variant in set(variants):
        same = np.array([each == variant for each in variants])
        if same.sum() >= LEAST_CLASS:
            errors[same] -= _median(errors[same].T)
    return errors


def _agreement(errors: FloatArray, together: NDArray[np.bool_]) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the agreement of every two rows' errors: cosines, number of common errors, log of the chance.

    Arguments: `together` (rows, rows) are the pairs that are compared.

    A common cause (a protractor, a bent scan, the reading of a node) gives all cosines one mean, by which
    they are reduced: two vectors with a common part have the cosine rho + (1 - rho) cos, where cos is that
    of their own parts.
    """
    known = np.isfinite(errors)
    values, mask = np.where(known, errors, 0.0), known.astype(np.float64)
    size = (values**2) @ mask.T
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.clip(np.nan_to_num((values @ values.T) / np.sqrt(size * size.T)), -1.0, 1.0)
    count = mask @ mask.T
    pairs = np.triu(together, 1)
    common = max(float(np.median(cosine[pairs])), 0.0) if pairs.sum() >= LEAST_PAIRS else 0.0
    own = np.clip((cosine - common) / max(1.0 - common, 0.1), -1.0, 1.0)
    return cosine, count, log_chance(own, _share(own[pairs], count[pairs]) * count)


def _share(cosines: FloatArray, counts: FloatArray) -> float:
    """Return the share of the errors that is independent, from the spread of this class's cosines."""
    if len(cosines) < LEAST_CLASS * (LEAST_CLASS - 1) // 2:
        return USUAL_SHARE
    low, high = np.percentile(cosines, [15.87, 84.13])
    return float(np.clip(4.0 / max((high - low) ** 2 * float(counts.mean()), 1e-9), 0.1, LARGEST_SHARE))


def log_chance(cosine: FloatArray, dimensions: FloatArray) -> FloatArray:
    """Return the log of P(cos >= c) for a random direction in d dimensions, 0 below two dimensions.

    The half of a regularised incomplete beta function, I_{1 - c^2}((d - 1) / 2, 1 / 2) / 2.
    """
    half = np.maximum(dimensions - 1.0, 1e-9) / 2.0
    tail = 0.5 * scipy.special.betainc(half, 0.5, np.clip(1.0 - cosine**2, 0.0, 1.0))
    chance = np.where(cosine >= 0.0, tail, 1.0 - tail)
    return np.where(dimensions >= 2.0, np.log(np.maximum(chance, 1e-300)), 0.0)


# Positions on the sheet ---------------------------------------------------------------------------


def position_chance(
    drawn: Mapping[str, Drawn], printed: NDArray[np.bool_], variant: IntArray
) -> tuple[FloatArray, FloatArray]:
    """Return the log chance that two placements are so close, and the part that a layout explains.

    Two arrays (students, students). The first is 0 where positions are not known. The second equals the first
    if the class, or those of one variant, follow a layout; else it is nan.

    Arguments: `printed` says which students drew on printed sheets, whose crosses mark for each variant the
    best position of the poles: there the sketch alone is placed freely. `variant` is each student's, as a
    number.

    The shift of one figure between two sheets is compared with the shift of the next figure, so that the
    position of the sheets in the scanner does not matter.
    """
    shifts = {figure: _shift(nodes.at) for figure, nodes in drawn.items()}
    count = len(next(iter(drawn.values())).at)
    apart, freedom = np.zeros((count, count)), np.zeros((count, count), np.int64)
    for first, second in combinations(drawn, 2):
        together = drawn[first].sheet == drawn[second].sheet
        between = np.abs(shifts[first] - shifts[second])
        free = np.ones(len(printed), bool) if MECHANISM in {first, second} else ~printed
        known = np.isfinite(between) & together[:, None] & together[None, :] & free[:, None] & free[None, :]
        apart = np.maximum(apart, np.where(known, between, 0.0))
        freedom += 2 * known
    # Of three figures' distances, two are independent; with prescribed poles, one.
    most = np.where(printed[:, None] | printed[None, :], 2, 2 * (len(drawn) - 1))
    freedom = np.minimum(freedom, most)
    apart = np.maximum(apart, NEAR_MM)
    same = variant[:, None] == variant[None, :]
    # Drawings of one variant may have more in common than those of the class.
    chance = _chance(apart, freedom)
    chance = np.where(same, np.maximum(chance, _chance(apart, freedom, same)), chance)
    known = (freedom > 0) & ~np.eye(count, dtype=bool)
    layout = np.full(apart.shape, np.nan)
    for among in (np.ones_like(same), same):
        distances = apart[known & among]
        if len(distances) >= 2 * LEAST_PAIRS and (distances < LAYOUT_MM).mean() > LAYOUT_SHARE:
            layout[among] = chance[among]
    return chance, layout


def _shift(at: ComplexArray) -> ComplexArray:
    """Return (students, students) shift of a figure, complex mm: the median over the nodes that both have."""
    between = at[None, :, :] - at[:, None, :]
    shift = _median(between.real) + 1j * _median(between.imag)
    return np.asarray(np.where(np.isfinite(between).any(axis=2), shift, UNKNOWN))


def _chance(apart: FloatArray, freedom: IntArray, among: NDArray[np.bool_] | None = None) -> FloatArray:
    """Return log chances by the densest ring about each placement in the class (or in some pairs of it).

    With too few pairs they are 0 for the whole class, and -inf (no limit) for some pairs of it.
    """
    chance = np.zeros(apart.shape) if among is None else np.full(apart.shape, -np.inf)
    for dimensions in (2, 4):
        of_these = (freedom == dimensions) & ~np.eye(len(apart), dtype=bool)
        of_these &= True if among is None else among
        if of_these.sum() < 2 * LEAST_PAIRS:
            continue
        pairs = np.maximum(_without_both(of_these), 1.0)
        densest = np.full(apart.shape, -np.inf)
        for ring in RINGS_MM:
            others = _without_both(of_these & (apart <= ring))
            if ring == RINGS_MM[-1]:
                others = np.maximum(others, 1.0)
            nearer = dimensions * np.log(np.minimum(apart / ring, 1.0))
            with np.errstate(divide="ignore"):
                densest = np.maximum(densest, np.log(others / pairs) + nearer)
        least = -np.log(TRUSTED * pairs) if among is None else -np.inf
        chance = np.where(of_these, np.clip(densest, least, 0.0), chance)
    return chance


def _without_both(near: NDArray[np.bool_]) -> FloatArray:
    """Return (students, students) the number of pairs among all students except these two.

    The pair itself is no evidence on how others place their figures, nor is a third copy of its sheet.
    """
    each = near.sum(axis=1)
    return np.asarray(np.maximum(near.sum() / 2.0 - each[:, None] - each[None, :] + near, 0.0))
