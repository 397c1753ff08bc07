"""Errors of hands: what each act of drawing missed by, from the student's own earlier nodes.

Each node is held against the one that a perfect hand would have made of the student's *own* earlier
nodes, so that an error counts where it was made and nowhere after. What an act may miss by, from the
construction's derivative with a usual hand's errors, makes the misses of all acts comparable: for hands
that do not know of each other they are independent and of one spread. A mistake is no error of a hand:
acts that miss by much more than the student's others are left out.

Two lists of d such errors make an angle. Without a common origin all directions in d dimensions are
equally likely, whatever the two hands' quality, and the cosine's distribution is known exactly.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.special import betainc

from grader.alike.handed import Handed
from grader.alike.nodes import Drawn
from grader.records import MECHANISM, FloatArray
from reference.assignment import Assignment, Scales, Variant
from reference.construction import Construction
from reference.elements import View
from reference.geometry import ComplexArray
from reference.hand import SMALL, Skill, hand_errors
from reference.plan import exact_plan
from reference.steps import Coincide, Pivot, Pole, Step

USUAL = Skill(angle_deg=0.3, place_mm=0.3, mark_mm=0.15)
"""A usual hand, and the reading of its marks. Only the ratios matter."""
SCALES = ("kL", "kv", "ka")
GROSS = 4.0
"""A miss so many times as large as the student's usual one is a mistake or a misreading."""
TAIL = 2.5
"""Larger misses count as this: one bad slip does not make two drawings alike."""
LEAST_SPREAD = 0.1
USUAL_SHARE, LARGEST_SHARE = 0.45, 0.7
"""Errors of a hand that count as independent, as a share of all; a class tells its own."""
LEAST_PAIRS = 10
"""So many tell what pushes the hands of all variants the same way."""
LEAST_CLASS = 10
"""So many of one variant tell what they have in common (a copier's scale, a table's rounding)."""


@dataclass(frozen=True, slots=True)
class Row:
    """A student's drawing (by index) held against a variant."""

    owner: int
    variant: Variant


@dataclass(frozen=True, slots=True)
class Hands:
    """Errors of hands, a row for each drawing held against one variant.

    Attributes
    ----------
    rows : whose drawing, held against which variant
    errors : (rows, acts) in units of the student's usual error, nan where not known
    """

    rows: Sequence[Row]
    errors: FloatArray


def hands_of(
    assignment: Assignment, handed: Sequence[Handed], drawn: Mapping[str, Drawn], rows: Sequence[Row]
) -> Hands:
    """The errors of drawings held against variants."""
    owner = np.array([row.owner for row in rows], np.int64)
    variants = [row.variant for row in rows]
    chosen = [handed[row.owner] for row in rows]
    placed = {figure: one.at[owner] for figure, one in drawn.items()}
    misses, by_scale = _misses(assignment, chosen, variants, placed)
    errors = _normed(misses - _scale(misses, by_scale) * by_scale)
    return Hands(rows, _centred(_without(errors, by_scale), variants))


# Misses -------------------------------------------------------------------------------------------


def _misses(
    assignment: Assignment,
    chosen: Sequence[Handed],
    variants: list[Variant],
    drawn: Mapping[str, ComplexArray],
) -> tuple[FloatArray, FloatArray]:
    """What each node is off from the student's own earlier ones, in usual errors; both (rows, 2 nodes).

    The second array is what it would be off if everything came out larger by its own size, as printers
    and copiers do it.
    """
    rule = assignment.scales(variants)
    scales = Scales(
        *(
            np.array(
                [one.used.get(name, usual) for one, usual in zip(chosen, getattr(rule, name), strict=True)]
            )
            for name in SCALES
        )
    )
    plan = exact_plan(assignment, variants, scales)
    own = _own_nodes(plan.construction, plan.nodes_mm, drawn)
    nodes: dict[str, ComplexArray] = {}
    known = plan.drawing.parameters
    view = View(nodes, known)
    copied = View(nodes, {**known, **{name: np.asarray(known[name] / (1.0 + SMALL)) for name in SCALES}})
    found, by_scale = [], []
    with np.errstate(invalid="ignore", divide="ignore"):
        for step in plan.construction.steps:
            expected = np.broadcast_to(step.place(view), (len(chosen),))
            placed = own[step.node]
            if not isinstance(step, Coincide | Pivot | Pole):
                reach = _reach(step, view, expected)
                found.append(_whitened(placed - expected, reach))
                by_scale.append(_whitened((step.place(copied) - expected) / SMALL, reach))
            nodes[step.node] = np.where(np.isfinite(placed), placed, expected)
    return _finite(np.concatenate(found, axis=1)), _finite(np.concatenate(by_scale, axis=1))


def _finite(values: FloatArray) -> FloatArray:
    return np.where(np.isfinite(values), values, np.nan)


def _own_nodes(
    construction: Construction,
    exact: Mapping[str, Mapping[str, ComplexArray]],
    drawn: Mapping[str, ComplexArray],
) -> dict[str, ComplexArray]:
    """The students' nodes in the assignment's frame, nan where not read: plans about their pole."""
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
    """Sketches turned and shifted onto the right ones, and their turn (1 where not known)."""
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


def _reach(step: Step, view: View, expected: ComplexArray) -> FloatArray:
    """(rows, 2, 2) covariance of a node under a usual hand's errors in the acts that make it, mm^2."""
    errors = hand_errors(step, USUAL)
    placed = np.asarray(step.place(View(view.nodes, view.parameters, errors)))
    moved = (np.broadcast_to(placed, (len(next(iter(errors.values()))), len(expected))) - expected) / SMALL
    by = np.nan_to_num(np.stack([moved.real, moved.imag], axis=-1))
    return np.asarray(np.einsum("ari,arj->rij", by, by) + USUAL.mark_mm**2 * np.eye(2))


def _whitened(off: ComplexArray, covariance: FloatArray) -> FloatArray:
    """(rows, 2) an offset in units of its spread."""
    root = np.linalg.cholesky(covariance)
    return np.linalg.solve(root, np.stack([off.real, off.imag], axis=-1)[..., None])[..., 0]


def _normed(misses: FloatArray) -> FloatArray:
    """Misses in units of the student's usual one; mistakes out, bad slips cut to size."""
    with np.errstate(invalid="ignore"):
        usual = _middle(np.abs(misses)) / 0.6745
        scaled = misses / np.maximum(usual, LEAST_SPREAD)
        scaled[np.abs(scaled) > GROSS] = np.nan
        return np.clip(scaled, -TAIL, TAIL)


def _scale(misses: FloatArray, by_scale: FloatArray) -> FloatArray:
    """(rows, 1) the common enlargement, the median of what each length tells, by its weight."""
    weight = np.where(np.isfinite(misses) & np.isfinite(by_scale), np.abs(by_scale), 0.0)
    with np.errstate(invalid="ignore", divide="ignore"):
        told = np.where(weight > 0.0, misses / by_scale, 0.0)
    order = np.argsort(told, axis=1)
    reached = np.cumsum(np.take_along_axis(weight, order, axis=1), axis=1)
    middle = (reached >= reached[:, -1:] / 2.0).argmax(axis=1)[:, None]
    return np.take_along_axis(np.take_along_axis(told, order, axis=1), middle, axis=1)


def _without(errors: FloatArray, by_scale: FloatArray) -> FloatArray:
    """Errors less what a common enlargement explains of them."""
    known = np.isfinite(errors) & np.isfinite(by_scale)
    along = np.where(known, by_scale, 0.0)
    size = np.maximum((along**2).sum(axis=1, keepdims=True), 1e-12)
    share = (np.where(known, errors, 0.0) * along).sum(axis=1, keepdims=True) / size
    return np.asarray(errors - share * along)


def _middle(values: FloatArray) -> FloatArray:
    """Medians of rows, of what is known; nan-free (0 for empty rows)."""
    known = np.isfinite(values)
    ordered = np.sort(np.where(known, values, np.inf), axis=1)
    count = known.sum(axis=1)
    middle = (
        ordered[np.arange(len(values)), np.maximum(count - 1, 0) // 2] if values.shape[1] else count * 0.0
    )
    return np.where(count > 0, middle, 0.0)[:, None]


def _centred(errors: FloatArray, variants: Sequence[Variant]) -> FloatArray:
    """Errors less what all of a variant have in common, where they are many enough to tell."""
    errors = errors.copy()
    for variant in set(variants):
        same = np.array([one == variant for one in variants])
        if same.sum() >= LEAST_CLASS:
            common = _middle(errors[same].T)
            errors[same] -= common.T
    return errors


# Likeness -----------------------------------------------------------------------------------------


@dataclass(frozen=True, slots=True)
class Agreement:
    """How the errors of every two rows agree; arrays (rows, rows).

    Attributes
    ----------
    cosine : of the angle between the two lists of errors
    count : errors that both have
    log_chance : natural logarithm of the chance that two independent hands agree so well
    """

    cosine: FloatArray
    count: FloatArray
    log_chance: FloatArray


def agreement(hands: Hands, together: NDArray[np.bool_]) -> Agreement:
    """How the errors of every two drawings agree.

    Arguments: `together` (rows, rows) are the pairs that are compared.

    What pushes every hand the same way (a protractor, a bent scan, the reading of a node) gives all
    cosines one mean, by which they are reduced: two vectors with a part in common have the cosine
    rho + (1 - rho) cos, where cos is that of their own parts.
    """
    known = np.isfinite(hands.errors)
    values = np.where(known, hands.errors, 0.0)
    mask = known.astype(np.float64)
    size = (values**2) @ mask.T
    with np.errstate(invalid="ignore", divide="ignore"):
        cosine = np.clip(np.nan_to_num((values @ values.T) / np.sqrt(size * size.T)), -1.0, 1.0)
    count = mask @ mask.T
    pairs = np.triu(together, 1)
    common = max(float(np.median(cosine[pairs])), 0.0) if pairs.sum() >= LEAST_PAIRS else 0.0
    own = np.clip((cosine - common) / max(1.0 - common, 0.1), -1.0, 1.0)
    return Agreement(cosine, count, log_chance(own, _share(own[pairs], count[pairs]) * count))


def _share(cosine: FloatArray, count: FloatArray) -> float:
    """Which share of the errors is independent, from how widely the cosines of this class spread."""
    if len(cosine) < LEAST_CLASS * (LEAST_CLASS - 1) // 2:
        return USUAL_SHARE
    low, high = np.percentile(cosine, [15.87, 84.13])
    return float(np.clip(4.0 / max((high - low) ** 2 * float(count.mean()), 1e-9), 0.1, LARGEST_SHARE))


def log_chance(cosine: FloatArray, dimensions: FloatArray) -> FloatArray:
    """Log of P(cos >= c) for a random direction in d dimensions, 0 below two dimensions.

    The half of a regularised incomplete beta function, I_{1 - c^2}((d - 1) / 2, 1 / 2) / 2.
    """
    half = np.maximum(dimensions - 1.0, 1e-9) / 2.0
    tail = 0.5 * betainc(half, 0.5, np.clip(1.0 - cosine**2, 0.0, 1.0))
    chance = np.where(cosine >= 0.0, tail, 1.0 - tail)
    return np.where(dimensions >= 2.0, np.log(np.maximum(chance, 1e-300)), 0.0)
